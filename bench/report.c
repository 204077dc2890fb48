/* Command line, heading and CSV of the benchmarks. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "report.h"

#include "bench-build.h"
#include "kinetree/batch.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- the command line -------------------------------------------------------------------------------------------- */

static const char *const isa_names[] = {
    [KT_ISA_AUTO] = "auto", [KT_ISA_BASE] = "base", [KT_ISA_V3] = "v3", [KT_ISA_V4] = "v4"};
enum { ISA_COUNT = sizeof isa_names / sizeof *isa_names };

const char *kt_bench_isa_name(kt_isa isa) { return (unsigned)isa < ISA_COUNT ? isa_names[isa] : "unknown"; }

static bool read_isa(const char *text, kt_isa *isa) {
    for (int i = 0; i < ISA_COUNT; i++)
        if (strcmp(text, isa_names[i]) == 0) {
            *isa = (kt_isa)i;
            return true;
        }
    return false;
}

static bool read_max(const char *text, int *max) {
    char *end;
    errno = 0;
    const long value = strtol(text, &end, 10);
    if (end == text || *end != '\0' || errno != 0 || value < 1 || value > 100000000)
        return false;
    *max = (int)value;
    return true;
}

static bool read_seconds(const char *text, double *seconds) {
    char *end;
    const double value = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(value) || !(value > 0.0))
        return false;
    *seconds = value;
    return true;
}

static void help(const char *program, const char *about, const kt_bench_options *defaults) {
    printf("%s\nUsage: %s [OPTION...]\n\n"
           "  --max N       longest chain, or most loops (%d)\n"
           "  --seconds S   processor time for one line of the table (%g)\n"
           "  --csv FILE    writes the figures there\n"
           "  --isa I       instruction set: auto, base, v3, v4 (auto)\n"
           "  --isas        compares the instruction sets, too (scaling)\n"
           "  --check       exit status 1 when a bound does not hold\n"
           "  --help        this text\n\n"
           "Exit status: 0 measured, 1 see --check, 2 nothing to trust was measured.\n",
           about, program, defaults->max, defaults->seconds);
}

int kt_bench_read(int argc, char **argv, const char *about, kt_bench_options *options) {
    enum { MAX = 1, SECONDS, CSV, ISA, ISAS, CHECK, HELP };
    static const struct option known[] = {
        {"max", required_argument, NULL, MAX}, {"seconds", required_argument, NULL, SECONDS},
        {"csv", required_argument, NULL, CSV}, {"isa", required_argument, NULL, ISA},
        {"isas", no_argument, NULL, ISAS},     {"check", no_argument, NULL, CHECK},
        {"help", no_argument, NULL, HELP},     {NULL, 0, NULL, 0},
    };
    const kt_bench_options defaults = *options;
    for (int found; (found = getopt_long(argc, argv, "", known, NULL)) != -1;) {
        bool good = true;
        switch (found) {
        case MAX:
            good = read_max(optarg, &options->max);
            break;
        case SECONDS:
            good = read_seconds(optarg, &options->seconds);
            break;
        case CSV:
            options->csv = optarg;
            break;
        case ISA:
            good = read_isa(optarg, &options->isa);
            break;
        case ISAS:
            options->isas = true;
            break;
        case CHECK:
            options->check = true;
            break;
        case HELP:
            help(argv[0], about, &defaults);
            return KT_BENCH_DONE;
        default:
            return KT_BENCH_FAILED; /* getopt has told */
        }
        if (!good) {
            (void)fprintf(stderr, "%s: '%s' is no value for that option; --help shows them\n", argv[0], optarg);
            return KT_BENCH_FAILED;
        }
    }
    if (optind < argc) {
        (void)fprintf(stderr, "%s: '%s' is no option; --help shows them\n", argv[0], argv[optind]);
        return KT_BENCH_FAILED;
    }
    return -1;
}

/* ---- the heading ------------------------------------------------------------------------------------------------- */

const char *kt_bench_processor(void) {
    static char name[128] = "";
    FILE *file = *name ? NULL : fopen("/proc/cpuinfo", "r");
    char line[256];
    while (file && fgets(line, sizeof line, file)) {
        const char *value = strchr(line, ':');
        if (strncmp(line, "model name", strlen("model name")) != 0 || !value)
            continue;
        value += 1 + strspn(value + 1, " \t");
        (void)snprintf(name, sizeof name, "%.*s", (int)strcspn(value, "\n"), value);
        break;
    }
    if (file)
        (void)fclose(file);
    return *name ? name : "unknown processor";
}

void kt_bench_heading(const char *title, kt_isa isa, const char *csv) {
    printf("%s\n"
           "library    kinetree %s\n"
           "compiler   %s\n"
           "flags      %s\n"
           "kernels    %s (built: %s)\n"
           "processor  %s\n"
           "figures    %s\n\n",
           title, kt_version(), KT_BENCH_COMPILER, KT_BENCH_FLAGS, kt_bench_isa_name(isa), KT_BENCH_ISAS,
           kt_bench_processor(), csv ? csv : "in this table only (--csv FILE)");
}

int kt_bench_tell(const kt_error *error) {
    (void)fflush(stdout);
    (void)fprintf(stderr, "%s: %s%s%s\n", kt_status_text(error->code), error->where, *error->where ? ": " : "",
                  error->message);
    return KT_BENCH_FAILED;
}

/* ---- comma-separated values -------------------------------------------------------------------------------------- */

bool kt_csv_open(kt_csv *csv, const char *name, const char *columns) {
    *csv = (kt_csv){.name = name};
    if (!name)
        return true;
    csv->file = fopen(name, "w");
    if (!csv->file) {
        (void)fprintf(stderr, "%s cannot be written: %s\n", name, strerror(errno));
        return false;
    }
    (void)fprintf(csv->file, "%s\n", columns);
    return true;
}

static void separate(kt_csv *csv) {
    if (csv->column++ > 0)
        (void)fputc(',', csv->file);
}

void kt_csv_text(kt_csv *csv, const char *text) {
    if (!csv->file)
        return;
    separate(csv);
    const bool plain = strpbrk(text, ",\"\r\n") == NULL;
    if (!plain)
        (void)fputc('"', csv->file);
    for (const char *c = text; *c; c++) {
        if (*c == '"')
            (void)fputc('"', csv->file);
        (void)fputc(*c, csv->file);
    }
    if (!plain)
        (void)fputc('"', csv->file);
}

void kt_csv_number(kt_csv *csv, double value) {
    if (!csv->file)
        return;
    separate(csv);
    if (!isnan(value)) /* an empty field: not measured */
        (void)fprintf(csv->file, "%.9g", value);
}

void kt_csv_origin(kt_csv *csv, kt_isa isa) {
    kt_csv_text(csv, kt_bench_isa_name(isa));
    kt_csv_text(csv, kt_bench_processor());
    kt_csv_text(csv, KT_BENCH_COMPILER);
}

void kt_csv_times(kt_csv *csv, const kt_bench_times *times) {
    kt_csv_number(csv, times->least);
    kt_csv_number(csv, times->low);
    kt_csv_number(csv, times->median);
    kt_csv_number(csv, times->high);
    kt_csv_number(csv, times->rounds);
    kt_csv_number(csv, (double)times->repetitions);
}

void kt_csv_line(kt_csv *csv) {
    if (csv->file)
        (void)fputc('\n', csv->file);
    csv->column = 0;
}

bool kt_csv_close(kt_csv *csv) {
    if (!csv->file)
        return true;
    const bool written = !ferror(csv->file);
    const bool closed = fclose(csv->file) == 0;
    csv->file = NULL;
    if (written && closed)
        return true;
    (void)fprintf(stderr, "%s could not be written in full\n", csv->name);
    return false;
}

int kt_bench_run(const kt_bench_table *table, int argc, char **argv) {
    kt_bench_options options = {.max = 1, .seconds = 1.0};
    int result = kt_bench_read(argc, argv, table->about, &options);
    if (result >= 0)
        return result;
    kt_csv csv;
    if (!kt_csv_open(&csv, options.csv, table->columns))
        return KT_BENCH_FAILED;
    kt_bench_heading(table->title, options.isa, options.csv);
    table->print_head();
    result = KT_BENCH_DONE;
    for (size_t i = 0; i < table->subjects; i++) {
        const int one = table->measure(i, &options, &csv);
        result = one > result ? one : result;
    }
    if (!kt_csv_close(&csv))
        return KT_BENCH_FAILED;
    return result == KT_BENCH_MISSED && !options.check ? KT_BENCH_DONE : result;
}
