/* Writes records as CSV. */
#include "run.h"

#include "kinetree/descriptor.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NUMBER_SIZE = 32 };

/* Appends a cell: the name of the column in the header (record == NULL), its value in all other lines. */
static void add_cell(kt_csv *csv, const kt_record *record, double value, const char *format, ...) KT_PRINTF(4, 5);

static void add_cell(kt_csv *csv, const kt_record *record, double value, const char *format, ...) {
    kt_lines *lines = &csv->lines;
    va_list arguments;
    int length = NUMBER_SIZE;
    if (record == NULL) {
        va_start(arguments, format);
        length = vsnprintf(NULL, 0, format, arguments);
        va_end(arguments);
    }
    if (length < 0 || !kt_lines_make_room(lines, (size_t)length + 2)) /* a comma before, a zero after it */
        return;
    if (lines->used > lines->whole)
        lines->text[lines->used++] = ',';
    char *end = lines->text + lines->used;
    if (record != NULL) {
        length = snprintf(end, NUMBER_SIZE, "%.17g", value);
    } else {
        va_start(arguments, format);
        length = vsnprintf(end, (size_t)length + 1, format, arguments);
        va_end(arguments);
    }
    lines->used += (size_t)length;
}

/* ---- the columns ------------------------------------------------------------------------------------------------- */

/* x: q, v or a; NULL in the header. */
static void add_coordinates(kt_csv *csv, const kt_record *record, const char *kind, const double *x, bool of_velocity) {
    for (int body = 1; body < kt_model_body_count(csv->model); body++) {
        kt_coordinates at = kt_body_coordinates(csv->model, body);
        int first = of_velocity ? at.v : at.q, count = of_velocity ? at.nv : at.nq;
        const char *name = kt_body_name(csv->model, body);
        for (int k = 0; k < count; k++) {
            double value = record != NULL ? x[first + k] : 0.0;
            if (count == 1)
                add_cell(csv, record, value, "%s.%s", kind, name);
            else
                add_cell(csv, record, value, "%s.%s[%d]", kind, name, k);
        }
    }
}

static void add_marker(kt_csv *csv, const kt_record *record, const kt_marker_pair *pair) {
    int body = pair->body != NULL ? kt_body_find(csv->model, pair->body) : 0;
    kt_vec3 at = {0.0, 0.0, 0.0};
    if (record != NULL) {
        int marker = kt_marker_find(csv->model, body, pair->marker);
        at = kt_point_position(csv->model, record->data, body, kt_marker_at(csv->model, body, marker));
    }
    const char *name = kt_body_name(csv->model, body);
    add_cell(csv, record, at.x, "marker.%s.%s.x", name, pair->marker);
    add_cell(csv, record, at.y, "marker.%s.%s.y", name, pair->marker);
    add_cell(csv, record, at.z, "marker.%s.%s.z", name, pair->marker);
}

/* of: reactions or loop_reactions; NULL in the header. */
static void add_reaction(kt_csv *csv, const kt_record *record, const char *name, const kt_wrench *of, int index) {
    static const kt_wrench none;
    const kt_wrench *w = record != NULL ? &of[index] : &none;
    add_cell(csv, record, w->force.x, "reaction.%s.fx", name);
    add_cell(csv, record, w->force.y, "reaction.%s.fy", name);
    add_cell(csv, record, w->force.z, "reaction.%s.fz", name);
    add_cell(csv, record, w->moment.x, "reaction.%s.mx", name);
    add_cell(csv, record, w->moment.y, "reaction.%s.my", name);
    add_cell(csv, record, w->moment.z, "reaction.%s.mz", name);
}

/* A loop between joints, not between points of bodies, has one equation, whose multiplier is its generalised force. */
static bool is_relation(const kt_model *model, int loop) {
    const kt_descriptor *descriptor = kt_loop_descriptor(kt_loop_type_of(model, loop));
    return kt_descriptor_kind(descriptor, KT_KEY_TERMS) || kt_descriptor_kind(descriptor, KT_KEY_JOINT);
}

static void add_multipliers(kt_csv *csv, const kt_record *record, int loop) {
    const kt_loop_rows rows = kt_loop_rows_of(csv->model, loop);
    const char *name = kt_loop_name(csv->model, loop);
    for (int k = 0; k < rows.count; k++) {
        const double value = record != NULL ? record->multipliers[rows.first + k] : 0.0;
        if (rows.count == 1)
            add_cell(csv, record, value, "reaction.%s.multiplier", name);
        else
            add_cell(csv, record, value, "reaction.%s.multiplier[%d]", name, k);
    }
}

/* A coupling of joints has joint forces only and therefore no wrench. */
static void add_reactions(kt_csv *csv, const kt_record *r) {
    for (int body = 1; body < kt_model_body_count(csv->model); body++)
        add_reaction(csv, r, kt_body_name(csv->model, body), r != NULL ? r->reactions : NULL, body);
    for (int loop = 0; loop < kt_loop_count(csv->model); loop++) {
        if (!kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(csv->model, loop)), KT_KEY_TERMS))
            add_reaction(csv, r, kt_loop_name(csv->model, loop), r != NULL ? r->loop_reactions : NULL, loop);
        if (is_relation(csv->model, loop))
            add_multipliers(csv, r, loop);
    }
}

/* The multipliers that add_reactions leaves out. */
static void add_all_multipliers(kt_csv *csv, const kt_record *r) {
    const bool reacts = (csv->record & KT_RECORD_REACTION) != 0;
    for (int loop = 0; loop < kt_loop_count(csv->model); loop++)
        if (!reacts || !is_relation(csv->model, loop))
            add_multipliers(csv, r, loop);
}

/* The header and the lines below it are written by the same traversal, so that columns always match. */
static void add_line(kt_csv *csv, const kt_record *r) {
    add_cell(csv, r, r != NULL ? r->time : 0.0, "time");
    if ((csv->record & KT_RECORD_POSITION) != 0)
        add_coordinates(csv, r, "position", r != NULL ? r->q : NULL, false);
    if ((csv->record & KT_RECORD_VELOCITY) != 0)
        add_coordinates(csv, r, "velocity", r != NULL ? r->v : NULL, true);
    if ((csv->record & KT_RECORD_ACCELERATION) != 0)
        add_coordinates(csv, r, "acceleration", r != NULL ? r->a : NULL, true);
    for (int i = 0; i < csv->run->marker_count; i++)
        add_marker(csv, r, &csv->run->markers[i]);
    if ((csv->record & KT_RECORD_ENERGY) != 0) {
        add_cell(csv, r, r != NULL ? r->kinetic : 0.0, "energy.kinetic");
        add_cell(csv, r, r != NULL ? r->potential : 0.0, "energy.potential");
        add_cell(csv, r, r != NULL ? r->kinetic + r->potential : 0.0, "energy.total");
    }
    if ((csv->record & KT_RECORD_BALANCE) != 0) {
        add_cell(csv, r, r != NULL ? r->work.dissipated : 0.0, "energy.dissipated");
        add_cell(csv, r, r != NULL ? r->work.supplied : 0.0, "energy.supplied");
        add_cell(csv, r, r != NULL ? kt_balance_of(r) : 0.0, "energy.balance");
    }
    if ((csv->record & KT_RECORD_CONSTRAINT) != 0) {
        add_cell(csv, r, r != NULL ? r->constraint.position : 0.0, "constraint.position");
        add_cell(csv, r, r != NULL ? r->constraint.velocity : 0.0, "constraint.velocity");
    }
    if ((csv->record & KT_RECORD_REACTION) != 0)
        add_reactions(csv, r);
    if ((csv->record & KT_RECORD_MULTIPLIER) != 0)
        add_all_multipliers(csv, r);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

int kt_csv_open(kt_csv *csv, const char *path, const kt_model *model, const kt_run *run) {
    *csv = (kt_csv){.model = model, .run = run, .record = kt_run_record(run, model)};
    int code = kt_output_start(&csv->output, path);
    if (code >= 0)
        return code;
    const char *name = kt_output_path(&csv->output);
    int file = strcmp(path, "-") == 0 ? STDOUT_FILENO : open(name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) {
        kt_say("%s cannot be written: %s; --out FILE writes elsewhere", name, strerror(errno));
        (void)kt_output_end(&csv->output, KT_OUTPUT_AS_IS);
        return KT_EXIT_INTEGRATION;
    }
    kt_lines_start(&csv->lines, file, path, 0);
    add_line(csv, NULL);
    if (kt_lines_end(&csv->lines) == 0)
        return -1;
    (void)kt_csv_close(csv, KT_OUTPUT_NOTHING);
    return KT_EXIT_INTEGRATION;
}

int kt_csv_close(kt_csv *csv, kt_output_fate fate) {
    const int failed = kt_lines_close(&csv->lines);
    if (failed != 0 && fate == KT_OUTPUT_WHOLE)
        fate = KT_OUTPUT_PART;
    return kt_output_end(&csv->output, fate) != 0 ? -1 : failed;
}

/* Returns whether the file begins with the line that is being built (the header). */
static bool begins_with_line(const kt_lines *lines) {
    char *text = malloc(lines->used + 1);
    bool same = text != NULL && pread(lines->file, text, lines->used + 1, 0) >= (ssize_t)lines->used &&
                memcmp(text, lines->text, lines->used) == 0 && text[lines->used] == '\n';
    free(text);
    return same;
}

/* Copies at most `size` bytes to a new file. Returns its descriptor, or -1. */
static int copy_beginning(const char *from, const char *to, long long size) {
    char block[1 << 16];
    FILE *in = fopen(from, "rb"), *out = in != NULL ? fopen(to, "wb") : NULL;
    bool fine = out != NULL;
    size_t count = 1;
    while (fine && size > 0 && count > 0) {
        count = fread(block, 1, size < (long long)sizeof block ? (size_t)size : sizeof block, in);
        fine = !ferror(in) && fwrite(block, 1, count, out) == count;
        size -= (long long)count;
    }
    if (in != NULL)
        (void)fclose(in);
    if (out != NULL)
        fine = fclose(out) == 0 && fine;
    return fine ? open(to, O_RDWR | O_CLOEXEC) : -1;
}

/* Opens the records up to the checkpoint: the partial file that an interrupted run has left, or else a copy of the
 * first bytes of a finished result, whose remainder is computed again; then *copied is true. */
static int open_beginning(const kt_output *output, long long written, bool *copied) {
    const int file = open(kt_output_path(output), O_RDWR | O_CLOEXEC);
    *copied = file < 0 && errno == ENOENT && output->partial != NULL && access(output->name, R_OK) == 0;
    return *copied ? copy_beginning(output->name, output->partial, written) : file;
}

int kt_csv_reopen(kt_csv *csv, const char *path, const kt_model *model, const kt_run *run, long long written) {
    *csv = (kt_csv){.model = model, .run = run, .record = kt_run_record(run, model)};
    struct stat status;
    int code = kt_output_start(&csv->output, path);
    if (code >= 0)
        return code;
    const char *name = kt_output_path(&csv->output);
    bool copied;
    int file = open_beginning(&csv->output, written, &copied);
    if (file < 0) {
        kt_say("%s, the records until the checkpoint, cannot be opened: %s", path, strerror(errno));
        (void)kt_output_end(&csv->output, KT_OUTPUT_AS_IS);
        return KT_EXIT_USAGE;
    }
    kt_lines *lines = &csv->lines;
    kt_lines_start(lines, file, path, written);
    add_line(csv, NULL);
    const char *wrong = NULL;
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode) || status.st_size < written || lines->full ||
        !begins_with_line(lines))
        wrong = "these are not the records until the checkpoint; give the --out of the run that wrote it";
    else if (ftruncate(file, written) != 0 || lseek(file, written, SEEK_SET) != written)
        wrong = strerror(errno);
    lines->used = 0;
    if (wrong == NULL)
        return -1;
    kt_say("%s: %s", copied ? path : name, wrong);
    (void)kt_csv_close(csv, copied ? KT_OUTPUT_NOTHING : KT_OUTPUT_AS_IS);
    return KT_EXIT_USAGE;
}

int kt_csv_write(kt_csv *csv, const kt_record *record) {
    add_line(csv, record);
    return kt_lines_end(&csv->lines);
}
