/* kinetree sweep: many runs of one scene, a line each. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/sweep.h"
#include "open/load.h"
#include "records/interrupt.h"
#include "records/keep.h"
#include "subcommands/run.h"
#include "sweep/merge.h"
#include "sweep/ranks.h"
#include "text/input.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define KT_AT(member) offsetof(kt_sweep_arguments, member)

static const kt_option options[] = {
    KT_OPTION(SETTING, "vary", vary, "NAME=VALUES",
              "vary a value: FROM:TO:COUNT, log:FROM:TO:COUNT or A,B,C; repeated: every combination"),
    KT_OPTION(SETTING, "random", random, "NAME=DISTRIBUTION",
              "draw a value for each run: uniform(FROM,TO), normal(MEAN,DEVIATION), lognormal(MEAN,DEVIATION)"),
    KT_OPTION(TEXT, "sample", sample, "KIND:COUNT",
              "place points in the ranges of --vary FROM:TO: sobol:COUNT, latin:COUNT"),
    KT_OPTION(TEXT, "from", from, "FILE.csv",
              "read a table: names in the first line, and the values of one run in each other line"),
    KT_OPTION(COUNT, "repeats", repeats, "COUNT", "run each point COUNT times, for --random; default: 1"),
    KT_OPTION(COUNT, "seed", seed, "N", "seed the random values and latin; default: 0"),
    KT_SET_OPTION,
    KT_OPTION(NAMES, "columns", columns, "A,B",
              "write these columns of the records; default: all that the scene records"),
    KT_OPTION(
        NAMES, "functionals", functionals, "A,B",
        "write these numbers of each column: end, min, max, mean, rms, integral (over time); default: end,min,max"),
    KT_OPTION(TEXT, "out", out, "FILE",
              "write one line for each run, as CSV; '-': standard output; default: NAME-sweep.csv"),
    KT_OPTION(TEXT, "keep", keep, "FILE.h5",
              "write all records, too, as HDF5: a dataset for each run, with its values as attributes"),
    KT_OPTION(SEVERAL, "jobs", jobs, "COUNT", "use COUNT threads; default: one for each processor"),
    KT_FLAG(
        "one-by-one", one_by_one,
        "compute one run at a time in each thread instead of one for each lane, for comparison; the bytes are equal"),
    KT_FLAG("native", native,
            "compute accelerations by generated C, as run --native does; all runs of one structure share the file"),
    KT_OPTION(TEXT, "shard", shard, "K/N", "compute the K-th of N parts of the runs only, for schedulers"),
    KT_FLAG("merge", merge, "join the parts that --shard has written, in --out"),
    KT_FLAG("resume", resume, "continue an interrupted sweep"),
    KT_FLAG("quiet", quiet, "print errors only, and no progress bar"),
};

static const kt_option_group groups[] = {{"Input", "vary"},     {"Output", "columns"}, {"Computation", "jobs"},
                                         {"Recovery", "merge"}, {"Messages", "quiet"}, {NULL, NULL}};

static const kt_option_rule rules[] = {
    {"from", false, "vary,sample", "--from gives the values of all runs; leave --vary and --sample out"},
    {"repeats", true, "random", NULL},
    {"seed", true, "random,sample", NULL},
};

const kt_usage kt_usage_sweep = {
    .command = "sweep",
    .examples = "  kinetree sweep pendulum.yaml --vary bodies.bob.mass=0.5:2:20\n"
                "  kinetree sweep arm.yaml --vary L=1,1.5,2 --vary k=log:1:100:10 --columns position.arm,energy.total\n"
                "  kinetree sweep arm.yaml --vary L=1:2 --vary k=1:100 --sample sobol:1000 --out - | head\n"
                "  kinetree sweep arm.yaml --random \"m=normal(1,0.1)\" --repeats 200 --seed 7\n"
                "  kinetree sweep arm.yaml --from cases.csv --resume\n"
                "  kinetree sweep arm.yaml --vary L=1:2:900 --shard 3/9 --out 3.csv\n"
                "  kinetree sweep --merge 1.csv 2.csv 3.csv --out all.csv\n",
    .operands = "SCENE, or with --merge PART...",
    .about = "Runs a scene many times with other values, as --set gives them, and writes one line for each run.\n"
             "A line has the values, the end of the run (done, scene, assembly, integration) and its reason, its cost, "
             "and the error of its energy.\n"
             "The last, least and greatest value of each column of the records follow.\n"
             "A run that fails has a line, too.\n"
             "Lines are in the order of the runs.\n"
             "The bytes of the lines do not depend on --jobs, --shard or an interruption.\n"
             "\n"
             "Results are written to FILE.partial, which is renamed at the end.\n"
             "If a sweep is killed, FILE.partial stays, and --resume continues from it.\n"
             "With --shard, FILE.shard names the sweep and its runs, and --merge checks it.\n"
             "On a terminal, a sweep of more than 100,000 runs needs a confirmation, unless --quiet is given.\n"
             "With MPI, 'mpirun kinetree sweep ...' divides the runs among its processes.\n",
    KT_OPTIONS_OF(options),
    .groups = groups,
    KT_RULES_OF(rules),
};

/* ---- lines in files ---------------------------------------------------------------------------------------------- */

/* The files that receive the lines and records of a sweep, and its progress. */
typedef struct sink {
    const kt_sweep *sweep;
    FILE *file;
    kt_keep *keep;
    kt_progress progress;
    int64_t first, end, failed;
    kt_shown why;          /* the reason of the first run that failed */
    double start, flushed; /* s, when lines were written out last */
} sink;

/* The last field of a line, the reason of a failure, without its quotes. */
static kt_shown reason_of_line(const char *line) {
    const char *field = line;
    bool is_quoted = false;
    for (const char *at = line; *at != '\0'; at++) {
        is_quoted = is_quoted != (*at == '"');
        if (*at == ',' && !is_quoted)
            field = at + 1;
    }
    char text[sizeof((kt_shown *)NULL)->text];
    field += *field == '"';
    snprintf(text, sizeof text, "%.*s", (int)strcspn(field, "\"\n"), field);
    return kt_show(text);
}

/* Writes the records before the line, so that every run with a line has all its records. */
static int write_result(void *user, int64_t run, const kt_sweep_result *result) {
    sink *s = user;
    const size_t columns = s->sweep->column_count + 1;
    char words[64];
    const char *line = result->line;
    if (kt_keep_begin(s->keep, run) != 0 || kt_keep_rows(s->keep, result->records, result->rows, columns) != 0 ||
        kt_keep_close_run(s->keep, run, result->code, result->rows, columns) != 0)
        return -1;
    const double now = kt_clock();
    const bool is_due =
        now - s->flushed > 0.02 || run + 1 == s->end; /* s; a break loses at most the lines of this time */
    if (fputs(line, s->file) < 0 || (is_due && fflush(s->file) != 0)) {
        kt_say("sweep: the line of run %lld cannot be written: %s", (long long)run, strerror(errno));
        return -1;
    }
    if (result->code != KT_EXIT_DONE && s->failed++ == 0)
        s->why = reason_of_line(line);
    if (!is_due)
        return 0;
    s->flushed = now;
    const double spent = now - s->start;
    snprintf(words, sizeof words, "%lld of %lld runs, %.3g a second", (long long)(run + 1 - s->first),
             (long long)(s->end - s->first), spent > 0.0 ? (double)(run + 1 - s->first) / spent : 0.0);
    kt_progress_show(&s->progress, (double)(run + 1 - s->first) / (double)(s->end - s->first), words);
    return 0;
}

/* The start of the line of a run, which the caller frees; NULL: not enough memory. */
static char *start_of_line(const kt_sweep *sweep, int64_t run) {
    double values[KT_SWEEP_AXES_MAX];
    kt_bytes start = {0};
    kt_sweep_plan_values(&sweep->plan, run, values);
    kt_sweep_plan_start(&sweep->plan, run, values, &start);
    return start.text;
}

/* Returns -1 if a line of an earlier sweep has the number and the values of this run, and with `whole` also the results
 * that the scene gives now. Otherwise prints the error and returns an exit code. */
static int check_line(const kt_sweep *sweep, const char *name, int64_t run, const char *line, bool whole) {
    kt_sweep_worker worker = {.has_scene = false};
    kt_sweep_result own = {.line = whole ? NULL : start_of_line(sweep, run)};
    if (whole)
        own = kt_sweep_one(sweep, &worker, run);
    kt_sweep_worker_free(&worker);
    const bool same = own.line != NULL && strncmp(own.line, line, strlen(own.line) + whole) == 0;
    if (own.line == NULL)
        kt_say("sweep: there is not enough memory");
    else if (!same)
        kt_say("sweep: run %lld has %s in %s than %s: the file belongs to another scene or sweep; leave --resume out, "
               "or name another --out",
               (long long)run, whole ? "another line" : "another number or other values", name,
               whole ? "the scene gives now" : "in this sweep");
    kt_sweep_result_free(&own);
    return same ? -1 : KT_EXIT_USAGE;
}

/* Reads the lines that a broken sweep has left. *next: the first run without a line, or `end`. The file ends before
 * this run. */
static int resume_lines(const kt_sweep *sweep, FILE *file, const char *name, int64_t first, int64_t end,
                        int64_t *next) {
    char *header = kt_sweep_header(sweep);
    kt_bytes line = {0};
    long whole = 0;
    int code = header != NULL ? -1 : KT_EXIT_INTEGRATION;
    *next = first;
    for (int64_t lines = 0;
         code < 0 && (lines == 0 || *next < end) && kt_input_line(file, &line) > 0 && line.text[line.used - 1] == '\n';
         lines++) {
        if (lines == 0 && strcmp(line.text, header) != 0) {
            kt_sweep_say_columns(name, "this sweep", "leave --resume out, or name another --out");
            code = KT_EXIT_USAGE;
        } else {
            code = lines > 0 ? check_line(sweep, name, *next, line.text, lines == 1) : -1;
            *next += lines > 0;
            whole += (long)line.used;
        }
    }
    free(header);
    free(line.text);
    if (code >= 0)
        return code;
    if (fseek(file, whole, SEEK_SET) != 0 || ftruncate(fileno(file), whole) != 0)
        return kt_reject(KT_EXIT_INTEGRATION, "sweep: %s cannot be continued: %s", name, strerror(errno));
    return -1;
}

/* ---- a sweep ----------------------------------------------------------------------------------------------------- */

static int threads_of(const kt_sweep_arguments *arguments) {
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const long jobs = arguments->jobs > 0 ? arguments->jobs : processors;
    return jobs > 0 ? (int)(jobs < 256 ? jobs : 256) : 1;
}

/* Describes the runs of --native. */
static void report_native(const kt_sweep_worker *all, int64_t runs) {
    kt_print("\n  --native: %lld run%s with %llu accelerations by generated code", (long long)all->natively,
             all->natively == 1 ? "" : "s", (unsigned long long)all->computed);
    if (all->left > 0)
        kt_print(", and %llu by the library next to singular positions or beyond the range of the file",
                 (unsigned long long)all->left);
    if (all->natively < runs)
        kt_print("\n  --native: %lld by the library, since the structure differs from that of the first run: another "
                 "number is zero, or an axis, a rotation or a formula changes",
                 (long long)(runs - all->natively));
}

/* Names the file of --keep, and the older results, which are replaced next. */
static void report_kept(const char *keep, const char *out) {
    char replaced[400] = "";
    if (keep != NULL)
        kt_print("  all records: %s\n", kt_show(keep).text);
    kt_note_replaced(out, replaced, sizeof replaced);
    kt_note_replaced(keep, replaced, sizeof replaced);
    if (replaced[0] != '\0')
        kt_print("  replaces an older %s\n", replaced);
}

static void report_sweep(const sink *s, const kt_sweep_worker *all, const char *out, int64_t before) {
    const int64_t runs = s->end - s->first;
    kt_print("%lld run%s, %lld of them failed", (long long)runs, runs == 1 ? "" : "s", (long long)s->failed);
    if (before > 0)
        kt_print("; %lld more were there already", (long long)before);
    if (s->failed > 0)
        kt_print("\n  the first failure: %s (the column 'why' has all reasons)", s->why.text);
    if (all->together > 0)
        kt_print("\n  %lld of them in lanes, up to %zu at a time in each thread", (long long)all->together, all->width);
    if (all->alone != NULL)
        kt_print("\n  %s one by one, not in lanes: %s", all->together > 0 ? "others" : "all", all->alone);
    if (all->natively > 0)
        report_native(all, runs - all->unmade);
    if (all->why[0] != '\0')
        kt_print("\n  the scene was read anew for each run, since a value that varies changes more than numbers: %s",
                 all->why);
    kt_print("\n  %s\n", kt_show_result(out).text);
    report_kept(s->sweep->arguments->keep, out);
}

/* Writes the lines from run `first` on that the file does not have yet. */
static int write_runs(const kt_sweep *sweep, kt_ranks *ranks, FILE *file, kt_keep *keep, const char *name,
                      const char *out, int64_t first, int64_t end) {
    const kt_sweep_arguments *arguments = sweep->arguments;
    int64_t next = first, kept = end;
    int code = -1;
    if (arguments->resume && keep->file != NULL)
        code = kt_keep_resume(keep, first, end, &kept);
    if (code < 0 && arguments->resume)
        code = resume_lines(sweep, file, name, first, kept, &next);
    if (code < 0 && arguments->resume && keep->file != NULL && next < kept)
        code = kt_keep_resume(keep, first, next, &kept);
    if (code < 0 && arguments->resume)
        code = kt_sweep_confirm(sweep, next, end, ranks != NULL ? 0 : threads_of(arguments));
    if (code >= 0)
        return code;
    char *header = next == first ? kt_sweep_header(sweep) : NULL;
    if (next == first && arguments->resume) /* behind the lines that were read */
        rewind(file);
    const bool begins = next > first || (header != NULL && fputs(header, file) >= 0);
    free(header);
    if (!begins)
        return kt_reject(KT_EXIT_INTEGRATION, "sweep: %s cannot be written: %s", name, strerror(errno));
    sink s = {.sweep = sweep,
              .file = file,
              .keep = keep,
              .progress = kt_progress_start(arguments->quiet),
              .first = next,
              .end = end,
              .start = kt_clock()};
    kt_sweep_worker all = {.has_scene = false};
    int failed = 0;
    if (next < end && ranks != NULL)
        failed = kt_ranks_serve(ranks, sweep, next, end, write_result, &s, &all);
    else if (next < end)
        failed = kt_sweep_run_all(sweep, next, end, threads_of(arguments), write_result, &s, &all);
    kt_progress_end(&s.progress);
    if (failed == 0 && !arguments->quiet)
        report_sweep(&s, &all, out, next - first);
    return failed == 0 ? KT_EXIT_DONE : KT_EXIT_INTEGRATION;
}

/* Opens the file of lines, and writes it. */
static int write_sweep_file(const kt_sweep *sweep, kt_ranks *ranks, kt_keep *keep, const char *out, int64_t first,
                            int64_t end) {
    kt_output output;
    if (strcmp(out, "-") == 0)
        return kt_finish_output(write_runs(sweep, ranks, stdout, keep, "standard output", out, first, end));
    int code = kt_output_start(&output, out);
    if (code >= 0)
        return code;
    if (output.partial == NULL && sweep->arguments->resume) {
        (void)kt_output_end(&output, KT_OUTPUT_AS_IS);
        return kt_misuse("sweep: %s is a device or a pipe, which cannot be taken up again: --resume needs a file", out);
    }
    const int descriptor = kt_output_open(&output, O_CREAT | (output.partial != NULL ? O_RDWR : O_WRONLY | O_TRUNC));
    FILE *file = descriptor >= 0 ? fdopen(descriptor, output.partial != NULL ? "r+" : "w") : NULL;
    if (file == NULL || (!sweep->arguments->resume && output.partial != NULL && ftruncate(descriptor, 0) != 0)) {
        kt_say("sweep: %s cannot be written: %s", out,
               errno == EBUSY ? "another sweep is writing it" : strerror(errno));
        (void)kt_output_end(&output, KT_OUTPUT_AS_IS);
        return KT_EXIT_INTEGRATION;
    }
    kt_interrupt_start(output.partial, "run", NULL);
    kt_interrupt_advise("To go on, repeat the command with --resume");
    code = write_runs(sweep, ranks, file, keep, kt_output_path(&output), out, first, end);
    kt_interrupt_end();
    struct stat status;
    if (code == KT_EXIT_INTEGRATION && output.partial != NULL && stat(output.partial, &status) == 0 &&
        status.st_size > 0)
        kt_say("sweep: %s holds the finished runs. To go on, free some space and repeat the command with --resume",
               output.partial);
    if (fclose(file) != 0 && code == KT_EXIT_DONE)
        code = kt_reject(KT_EXIT_INTEGRATION, "sweep: %s cannot be written: %s", out, strerror(errno));
    return kt_output_end(&output, code == KT_EXIT_DONE ? KT_OUTPUT_WHOLE : KT_OUTPUT_AS_IS) == 0 ? code
                                                                                                 : KT_EXIT_INTEGRATION;
}

static void values_of_run(const void *user, int64_t run, double *values) { kt_sweep_plan_values(user, run, values); }

/* Writes the HDF5 file with all runs that were added. The result is whole only with this file. */
static int end_keep(kt_keep *keep, kt_sweep *sweep, int code) {
    const char *names[KT_SWEEP_AXES_MAX];
    const size_t count = sweep->column_count + 1;
    const char **columns = calloc(2 * count, sizeof *columns);
    for (int i = 0; i < sweep->plan.count; i++)
        names[i] = sweep->plan.axes[i].path;
    for (size_t i = 0; columns != NULL && i < count; i++) {
        columns[i] = i > 0 ? sweep->columns[i - 1].name : "time";
        columns[count + i] = i > 0 ? sweep->columns[i - 1].unit : "s";
    }
    const kt_keep_words words = {.columns = columns,
                                 .units = columns != NULL ? columns + count : NULL,
                                 .column_count = columns != NULL ? count : 0,
                                 .names = names,
                                 .name_count = (size_t)sweep->plan.count,
                                 .values = values_of_run,
                                 .user = &sweep->plan};
    const int failed =
        kt_keep_end(keep, &words, code == KT_EXIT_DONE && columns != NULL ? KT_OUTPUT_WHOLE : KT_OUTPUT_AS_IS);
    free(columns);
    return failed != 0 && code == KT_EXIT_DONE ? KT_EXIT_INTEGRATION : code;
}

/* Writes lines and, with --keep, records. */
static int write_results(kt_sweep *sweep, kt_ranks *ranks, const char *out, int64_t first, int64_t end) {
    const kt_sweep_arguments *arguments = sweep->arguments;
    kt_keep keep = {.output.lock = -1};
    int code = arguments->keep != NULL ? kt_keep_open(&keep, arguments->keep, arguments->resume) : -1;
    if (code < 0)
        code = write_sweep_file(sweep, ranks, &keep, out, first, end);
    return end_keep(&keep, sweep, code);
}

/* Writes the results, and with --shard a file next to them that names the sweep. */
static int write_part(kt_sweep *sweep, kt_ranks *ranks, const char *out, int64_t first, int64_t end) {
    const kt_sweep_shard shard = {
        .sweep = kt_sweep_sum(sweep), .runs = kt_sweep_plan_runs(&sweep->plan), .first = first, .end = end};
    kt_sweep_shard_remove(out);
    const int code = write_results(sweep, ranks, out, first, end);
    return code == KT_EXIT_DONE && sweep->arguments->shard != NULL ? kt_sweep_shard_write(out, &shard) : code;
}

static int check_sweep_files(const kt_sweep_arguments *arguments, const char *path, const char *out) {
    const kt_file_use uses[] = {{"the scene", path, false},
                                {"--from", arguments->from, false},
                                {"--out", out, true},
                                {"--keep", arguments->keep, true}};
    if (arguments->keep != NULL && !kt_keep_is_meant(arguments->keep))
        return kt_misuse("sweep: --keep writes HDF5 and takes FILE.h5, not '%s'", arguments->keep);
    int code = kt_check_lines(arguments->out);
    code = code < 0 && arguments->keep != NULL ? kt_keep_check(arguments->keep) : code;
    return code < 0 ? kt_check_files("sweep", uses, sizeof uses / sizeof uses[0]) : code;
}

/* Reads "K/N" with 1 <= K <= N. Returns false if the text has another form. */
static bool read_shard(const char *text, long long *k, long long *n) {
    char *end;
    *k = strtoll(text, &end, 10);
    if (end == text || *end != '/')
        return false;
    const char *second = end + 1;
    *n = strtoll(second, &end, 10);
    return end != second && *end == '\0' && *k >= 1 && *n >= *k && *n <= 1000000;
}

/* Determines the runs of a part, or all runs. Returns -1, or an exit code after printing the error. */
static int choose_shard(const char *text, int64_t runs, int64_t *first, int64_t *end) {
    long long k = 1, n = 1;
    if (text != NULL && !read_shard(text, &k, &n))
        return kt_misuse("sweep: --shard takes K/N with 1 <= K <= N, as 3/100, not '%s'", text);
    *first = runs / n * (k - 1) + runs % n * (k - 1) / n;
    *end = runs / n * k + runs % n * k / n;
    return -1;
}

static int read_sweep_scene(kt_sweep *sweep) {
    kt_error error = {0};
    const bool fine = kt_input_read(sweep->path, &kt_input_scene, &sweep->text, &sweep->size, &error) == KT_OK;
    if (fine && kt_is_robot_name(sweep->path))
        return kt_reject(KT_EXIT_SCENE,
                         "%s is a robot, and sweeps take scenes: kinetree import %s >robot.yaml makes one", sweep->path,
                         sweep->path);
    if (fine)
        return -1;
    kt_say_error(&error);
    kt_missing_suggest(sweep->path);
    return KT_EXIT_SCENE;
}

static int sweep_scene(const kt_sweep_arguments *arguments, kt_ranks *ranks, const char *path) {
    kt_sweep sweep = {.arguments = arguments, .path = path};
    int64_t first = 0, end = 0;
    char lines[4096];
    char *base = kt_base_name(path);
    (void)snprintf(lines, sizeof lines, "%s-sweep.csv", base != NULL ? base : "scene");
    free(base);
    const char *out = arguments->out != NULL ? arguments->out : lines;
    int code = check_sweep_files(arguments, path, out);
    code = code < 0 ? kt_sweep_list_functionals(&sweep) : code;
    code = code < 0 ? kt_sweep_plan_make(arguments, kt_sweep_line_columns, &sweep.plan) : code;
    code = code < 0 ? choose_shard(arguments->shard, kt_sweep_plan_runs(&sweep.plan), &first, &end) : code;
    code = code < 0 ? read_sweep_scene(&sweep) : code;
    code = code < 0 ? kt_sweep_list_columns(&sweep) : code;
    if (code < 0 && kt_ranks_own(ranks) > 0) {
        kt_ranks_work(ranks, &sweep, arguments->jobs > 0 ? threads_of(arguments) : 1);
        code = KT_EXIT_DONE;
    }
    if (code < 0 &&
        !arguments->resume) /* before files are emptied; --resume confirms after it has found the missing runs */
        code = kt_sweep_confirm(&sweep, first, end, ranks != NULL ? 0 : threads_of(arguments));
    if (code < 0)
        code = write_part(&sweep, ranks, out, first, end);
    kt_sweep_free(&sweep);
    return code;
}

/* ---- the command ------------------------------------------------------------------------------------------------- */

int kt_command_sweep(int argc, char **argv) {
    kt_sweep_arguments arguments = {.repeats = 1};
    int operands;
    /* All ranks read the same command line and the same scene. Rank 0 prints for all. */
    if (kt_ranks_is_later() && (freopen("/dev/null", "w", stdout) == NULL || freopen("/dev/null", "w", stderr) == NULL))
        return KT_EXIT_INTEGRATION;
    const int code = kt_arguments_read(&kt_usage_sweep, argc, argv, &arguments, &operands);
    if (code >= 0)
        return code;
    if (arguments.merge)
        return kt_sweep_merge(&arguments, argv + 1, operands);
    if (operands > 1)
        return kt_misuse("sweep: '%s' is one word too many; only --merge takes several files", argv[2]);
    if (arguments.repeats < 1 || arguments.repeats > 1000000000)
        return kt_misuse("sweep: --repeats must be 1 to 1e9");
    if (arguments.resume && arguments.out != NULL && strcmp(arguments.out, "-") == 0)
        return kt_misuse("sweep: standard output cannot be taken up again: --resume needs a file");
    int code_of_ranks;
    kt_ranks *ranks = kt_ranks_start(&code_of_ranks);
    if (ranks != NULL && strcmp(argv[1], "-") == 0) {
        kt_say("sweep: standard input has the scene for one process alone; name a file");
        code_of_ranks = KT_EXIT_USAGE;
    }
    return kt_ranks_end(ranks, code_of_ranks >= 0 ? code_of_ranks : sweep_scene(&arguments, ranks, argv[1]));
}
