/* Code shared by the benchmark programs: the command line, the heading, the file of figures. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_REPORT_H
#define KT_BENCH_REPORT_H

#include "bench.h"
#include "kinetree/model.h"

#include <stdio.h>

/* Exit status: measured; --check was given and a bound does not hold; nothing to trust was measured. */
enum { KT_BENCH_DONE = 0, KT_BENCH_MISSED = 1, KT_BENCH_FAILED = 2 };

typedef struct kt_bench_options {
    int max;         /* longest chain */
    double seconds;  /* of processor time for one line of the table */
    const char *csv; /* NULL: none */
    kt_isa isa;
    bool isas; /* compare the instruction sets, too */
    bool check;
} kt_bench_options;

/* Reads the command line over the values that are in *options. Returns -1 to go on, or the exit status (after --help,
 * or after a mistake, which it reports). `about` heads the help, in lines. */
int kt_bench_read(int argc, char **argv, const char *about, kt_bench_options *options);

/* auto, base, v3, v4 */
const char *kt_bench_isa_name(kt_isa isa);

/* Library, compiler, flags, instruction set, processor and file of figures (NULL: none), each on a line. */
void kt_bench_heading(const char *title, kt_isa isa, const char *csv);

/* Reports an error on stderr, and returns KT_BENCH_FAILED. */
int kt_bench_tell(const kt_error *error);

/* The name of the processor; static storage. */
const char *kt_bench_processor(void);

/* ---- comma-separated values (RFC 4180) --------------------------------------------------------------------------- */

typedef struct kt_csv {
    FILE *file; /* NULL: nothing is written */
    const char *name;
    int column;
} kt_csv;

/* Opens `name` (NULL: writes nothing) and writes the line of column names, as given. Reports a failure on stderr and
 * returns false. */
bool kt_csv_open(kt_csv *csv, const char *name, const char *columns);
void kt_csv_text(kt_csv *csv, const char *text);
void kt_csv_number(kt_csv *csv, double value);
/* Level, processor and compiler: which measurement a line belongs to. */
void kt_csv_origin(kt_csv *csv, kt_isa isa);
/* least, low, median, high, rounds, repetitions */
void kt_csv_times(kt_csv *csv, const kt_bench_times *times);
void kt_csv_line(kt_csv *csv);
/* Returns false if the file could not be written, and reports this on stderr. */
bool kt_csv_close(kt_csv *csv);

#define KT_CSV_ORIGIN "isa,processor,compiler"
#define KT_CSV_TIMES "least_s,low_s,median_s,high_s,rounds,repetitions"

/* A benchmark that prints a table with a line for each subject. Its members are its help, the names of its file's
 * columns, its title and two functions. The first function prints the head of the table. The second one measures a
 * subject and prints its line (KT_BENCH_...). */
typedef struct kt_bench_table {
    const char *about, *columns, *title;
    void (*print_head)(void);
    size_t subjects;
    int (*measure)(size_t subject, const kt_bench_options *options, kt_csv *csv);
} kt_bench_table;

/* What main returns. A bound that is missed counts with --check alone. */
int kt_bench_run(const kt_bench_table *table, int argc, char **argv);

#endif
