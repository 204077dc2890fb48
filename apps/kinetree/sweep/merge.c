/* Parts of a sweep (--shard), and how they are put together (--merge).
 *
 * Lines of a part have the number of a run and its values, but not the plan of the sweep. FILE.shard next to FILE has a
 * checksum of the plan and the scene, the number of all runs, and the runs of the part. Parts of one sweep have equal
 * checksums.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/merge.h"
#include "records/output.h"
#include "text/input.h"

#include "base/sum.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SHARD_ENDING ".shard"

/* Sweeps have at most 1e12 points, and a number of repeats. */
#define RUNS_MOST INT64_C(1000000000000000000)

/* ---- FILE.shard -------------------------------------------------------------------------------------------------- */

static uint64_t sum_of_axis(uint64_t sum, const kt_axis *axis) {
    const int64_t numbers[] = {axis->is_angle, axis->is_random, axis->draw, axis->is_logarithmic, axis->count};
    const double ends[] = {axis->a, axis->b};
    sum = kt_sum_add_text(sum, axis->path);
    sum = kt_sum_add(kt_sum_add(sum, numbers, sizeof numbers), ends, sizeof ends);
    return axis->values != NULL ? kt_sum_add(sum, axis->values, (size_t)axis->count * sizeof *axis->values) : sum;
}

uint64_t kt_sweep_sum(const kt_sweep *sweep) {
    const kt_sweep_plan *plan = &sweep->plan;
    const kt_settings *settings = &sweep->arguments->settings;
    const int64_t numbers[] = {plan->count,  plan->sample,  plan->is_table,
                               plan->points, plan->repeats, (int64_t)plan->seed};
    uint64_t sum = kt_sum_add(KT_SUM_START, sweep->text, sweep->size);
    sum = kt_sum_add(sum, numbers, sizeof numbers);
    for (int i = 0; i < plan->count; i++)
        sum = sum_of_axis(sum, &plan->axes[i]);
    for (int i = 0; i < settings->count; i++)
        sum = kt_sum_add_text(sum, settings->text[i]);
    return sum;
}

/* Returns the name of FILE.shard, which the caller frees. NULL: FILE is no file of its own ("-", a device), or there is
 * not enough memory. */
static char *shard_name(const char *out) {
    char *partial = kt_partial_name(out);
    const bool is_file = partial != NULL && strcmp(partial, out) != 0;
    char *name = is_file ? kt_join_texts(out, SHARD_ENDING, "") : NULL;
    free(partial);
    return name;
}

void kt_sweep_shard_remove(const char *out) {
    char *name = shard_name(out);
    if (name != NULL)
        (void)unlink(name);
    free(name);
}

int kt_sweep_shard_write(const char *out, const kt_sweep_shard *shard) {
    char *name = shard_name(out), sum[24];
    kt_sweep_shard_remove(out); /* a link of this name is not followed */
    snprintf(sum, sizeof sum, "%016" PRIx64, shard->sweep);
    const int code =
        name == NULL ? KT_EXIT_DONE
                     : kt_json_write(json_pack("{s:s, s:I, s:I, s:I}", "sweep", sum, "runs", (json_int_t)shard->runs,
                                               "first", (json_int_t)shard->first, "end", (json_int_t)shard->end),
                                     name);
    free(name);
    return code;
}

/* Reads FILE.shard, if it is there. */
static int read_shard_file(const char *part, kt_sweep_shard *shard, bool *is_there) {
    kt_error error = {0};
    char *text = NULL;
    size_t size = 0;
    json_int_t runs = 0, first = 0, end = 0;
    const char *sum = NULL;
    char *name = shard_name(part), *rest = NULL;
    json_t *root = NULL;
    int code = -1;
    *is_there = name != NULL && access(name, F_OK) == 0;
    if (*is_there && kt_input_read(name, &kt_input_summary, &text, &size, &error) == KT_OK)
        root = json_loadb(text, size, 0, NULL);
    if (root != NULL &&
        json_unpack(root, "{s:s, s:I, s:I, s:I}", "sweep", &sum, "runs", &runs, "first", &first, "end", &end) == 0)
        *shard = (kt_sweep_shard){.sweep = strtoull(sum, &rest, 16), .runs = runs, .first = first, .end = end};
    if (*is_there && (rest == NULL || *rest != '\0' || first < 0 || end < first || runs < end || runs > RUNS_MOST))
        code = kt_reject(KT_EXIT_SCENE,
                         "sweep: %s does not name the runs of a part; remove it, or compute the part anew", name);
    json_decref(root);
    free(text);
    free(name);
    return code;
}

/* ---- lines of parts ---------------------------------------------------------------------------------------------- */

void kt_sweep_say_columns(const char *name, const char *than, const char *remedy) {
    kt_say("sweep: %s has other columns than %s; %s", name, than, remedy);
}

typedef struct part {
    const char *name;
    FILE *file;
    kt_bytes line; /* the next one */
    long long run; /* its number; -1: there is none */
    kt_sweep_shard shard;
    bool has_shard;
} part;

static int say_sweep_part(const part *p, const char *what) {
    return kt_reject(KT_EXIT_SCENE, "sweep: %s: %s", p->name, what);
}

/* Reads the next line. Returns 1; 0 at the end; -1 after printing the error. */
static int read_part_line(part *p) {
    const int found = kt_input_line(p->file, &p->line);
    if (found < 0 && (errno == EINVAL || errno == EFBIG)) {
        (void)say_sweep_part(p, errno == EINVAL ? "the file has bytes of zero, so it is no text; compute the part anew"
                                                : "a line is longer than any line of a sweep; compute the part anew");
    } else if (found < 0) {
        kt_error error = {0};
        (void)kt_file_reject(p->name, &kt_input_lines, errno, &error);
        kt_say_error(&error);
    }
    return found;
}

/* Reads the number of the next run, which is one of those that the part's FILE.shard lists. */
static int next_part_line(part *p) {
    char *end;
    const int found = read_part_line(p);
    p->run = -1;
    if (found <= 0)
        return found < 0 ? KT_EXIT_SCENE : -1;
    const long long run = strtoll(p->line.text, &end, 10);
    if (end == p->line.text || *end != ',' || run < 0 || p->line.text[p->line.used - 1] != '\n')
        return say_sweep_part(p, "its last line is no whole run: is that part still being written?");
    if (run >= RUNS_MOST)
        return say_sweep_part(p, "a line has the number of a run that no sweep has; compute the part anew");
    if (p->has_shard && (run < p->shard.first || run >= p->shard.end))
        return kt_misuse("sweep: %s has run %lld, and %s%s lists the runs %lld to %lld: it is of another file", p->name,
                         run, p->name, SHARD_ENDING, (long long)p->shard.first, (long long)p->shard.end - 1);
    p->run = run;
    return -1;
}

/* Opens the parts; their first lines must agree. */
static int open_parts(part *parts, int count, char **names) {
    kt_error error = {0};
    int code = -1;
    for (int i = 0; code < 0 && i < count; i++) {
        part *p = &parts[i];
        p->name = names[i];
        p->file = kt_input_open(names[i], &kt_input_lines, &error);
        if (p->file == NULL)
            return say_sweep_part(p, error.message);
        const int found = read_part_line(p);
        if (found <= 0)
            return found < 0 ? KT_EXIT_SCENE : say_sweep_part(p, "it is empty");
        if (i > 0 && strcmp(p->line.text, parts[0].line.text) != 0) {
            kt_sweep_say_columns(p->name, "the first part", "leave it out, or compute it anew");
            return KT_EXIT_USAGE;
        }
    }
    return code;
}

/* Reads FILE.shard of each part. *runs: the number of all runs, -1 if some part has no such file. */
static int read_shards(part *parts, int count, int64_t *runs) {
    int known = -1, unknown = -1;
    for (int i = 0; i < count; i++) {
        part *p = &parts[i];
        const int code = read_shard_file(p->name, &p->shard, &p->has_shard);
        if (code >= 0)
            return code;
        if (!p->has_shard) {
            unknown = unknown < 0 ? i : unknown;
        } else if (known < 0) {
            known = i;
        } else if (p->shard.sweep != parts[known].shard.sweep || p->shard.runs != parts[known].shard.runs) {
            return kt_misuse("sweep: %s is a part of another sweep than %s: the scene or the options differ; leave one "
                             "of them out, or compute it anew",
                             p->name, parts[known].name);
        }
    }
    if (unknown >= 0)
        kt_say("sweep: there is no %s%s: whether the parts are of one sweep, and whether its last runs are there, is "
               "not checked",
               parts[unknown].name, SHARD_ENDING);
    *runs = unknown < 0 && known >= 0 ? parts[known].shard.runs : -1;
    return -1;
}

/* Returns the part with the lowest run; NULL: no part has a run. */
static part *lowest(part *parts, int count) {
    part *found = NULL;
    for (int i = 0; i < count; i++)
        if (parts[i].run >= 0 && (found == NULL || parts[i].run < found->run))
            found = &parts[i];
    return found;
}

/* Reports the runs that are missing or repeated. Returns an exit code. */
static int say_missing(const char *out, long long missing, long long first, long long repeated, int64_t runs) {
    if (repeated > 0)
        kt_say("sweep: %lld runs are in two parts; the first is taken", repeated);
    if (missing == 0)
        return KT_EXIT_DONE;
    char of[40] = "";
    if (runs >= 0)
        snprintf(of, sizeof of, " of %lld", (long long)runs);
    return kt_reject(KT_EXIT_INTEGRATION,
                     "sweep: %lld%s run%s %s in none of the parts, from run %lld on; %s has the others", missing, of,
                     missing == 1 && runs < 0 ? "" : "s", missing == 1 ? "is" : "are", first, kt_show_result(out).text);
}

/* Writes the lines of all parts in the order of their runs. *written: the number of these runs, if the file has all
 * lines of the parts. */
static int merge_lines(part *parts, int count, FILE *file, int64_t runs, const char *out, long long *written) {
    long long expected = 0, missing = 0, repeated = 0, first = -1;
    int code = fputs(parts[0].line.text, file) >= 0 ? -1 : KT_EXIT_INTEGRATION;
    for (int i = 0; code < 0 && i < count; i++)
        code = next_part_line(&parts[i]);
    for (part *p = lowest(parts, count); code < 0 && p != NULL; p = lowest(parts, count)) {
        if (p->run >= expected) {
            first = first < 0 && p->run > expected ? expected : first;
            missing += p->run - expected;
            expected = p->run + 1;
            code = fputs(p->line.text, file) >= 0 ? -1 : KT_EXIT_INTEGRATION;
        } else {
            repeated++;
        }
        code = code < 0 ? next_part_line(p) : code;
    }
    if (code == KT_EXIT_INTEGRATION)
        kt_say("sweep: the runs cannot be written: %s", strerror(errno));
    if (code >= 0)
        return code;
    *written = expected - missing;
    first = first < 0 && expected < runs ? expected : first;
    missing += expected < runs ? runs - expected : 0;
    return say_missing(out, missing, first, repeated, runs);
}

/* The parts with some runs missing are a part again. */
static int write_merged_shard(const part *parts, int count, const char *out) {
    kt_sweep_shard all = parts[0].shard;
    for (int i = 1; i < count; i++) {
        all.first = parts[i].shard.first < all.first ? parts[i].shard.first : all.first;
        all.end = parts[i].shard.end > all.end ? parts[i].shard.end : all.end;
    }
    return kt_sweep_shard_write(out, &all);
}

static void report_merged(const char *out, long long runs, int parts, const char *replaced) {
    char remark[80];
    snprintf(remark, sizeof remark, ", %lld run%s of %d part%s", runs, runs == 1 ? "" : "s", parts,
             parts == 1 ? "" : "s");
    kt_say_written("joined", out, remark, replaced);
}

/* The joined file must be none of the parts. */
static int check_merged_file(const char *out, char **names, int count) {
    kt_file_use *uses = calloc((size_t)count + 1, sizeof *uses);
    if (uses == NULL)
        return kt_reject(KT_EXIT_INTEGRATION, "sweep: there is not enough memory");
    for (int i = 0; i < count; i++)
        uses[i] = (kt_file_use){"a part", names[i], false};
    uses[count] = (kt_file_use){"--out", out, true};
    const int code = kt_check_files("sweep", uses, count + 1);
    free(uses);
    return code;
}

int kt_sweep_merge(const kt_sweep_arguments *arguments, char **names, int count) {
    kt_output output = {.lock = -1};
    part *parts = calloc((size_t)count, sizeof *parts);
    const char *out = arguments->out;
    int code = KT_EXIT_USAGE;
    if (out == NULL || parts == NULL) {
        kt_say(out == NULL ? "sweep: --merge writes to --out FILE; give it" : "sweep: there is not enough memory");
        free(parts);
        return code;
    }
    const bool to_file = strcmp(out, "-") != 0;
    long long written = -1;
    int64_t runs = -1;
    char replaced[400] = "";
    code = check_merged_file(out, names, count);
    code = code < 0 ? open_parts(parts, count, names) : code;
    code = code < 0 ? read_shards(parts, count, &runs) : code;
    if (code < 0 && to_file)
        code = kt_output_start(&output, out);
    FILE *file = code >= 0 ? NULL : to_file ? kt_output_stream(&output) : stdout;
    if (code < 0 && file == NULL)
        code = say_sweep_part(&(part){.name = out}, strerror(errno));
    if (code < 0) {
        code = merge_lines(parts, count, file, runs, out, &written);
        if (to_file && fclose(file) != 0) {
            written = -1;
            code = KT_EXIT_INTEGRATION;
        }
    }
    kt_note_replaced(out, replaced, sizeof replaced);
    if (to_file && kt_output_end(&output, written >= 0 ? KT_OUTPUT_WHOLE : KT_OUTPUT_NOTHING) != 0)
        code = KT_EXIT_INTEGRATION;
    if (written >= 0)
        kt_sweep_shard_remove(out);
    if (written >= 0 && runs >= 0 && code == KT_EXIT_INTEGRATION)
        (void)write_merged_shard(parts, count, out);
    if (code == KT_EXIT_DONE && !arguments->quiet)
        report_merged(out, written, count, replaced);
    for (int i = 0; i < count; i++) {
        if (parts[i].file != NULL)
            (void)fclose(parts[i].file);
        free(parts[i].line.text);
    }
    free(parts);
    return code;
}
