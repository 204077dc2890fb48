/* Records as CSV. */
#include "run.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- a line under way -------------------------------------------------------------------------------------------- */

static bool make_room(kt_csv *csv, size_t more) {
    if (csv->room - csv->used >= more)
        return true;
    size_t room = 2 * csv->room + more;
    char *line = realloc(csv->line, room);
    csv->full = csv->full || line == NULL;
    if (line == NULL)
        return false;
    csv->line = line;
    csv->room = room;
    return true;
}

enum { NUMBER_SIZE = 32 };

/* The name of a column in the header (record == NULL), its value in all other lines. */
static void add_cell(kt_csv *csv, const kt_record *record, double value, const char *format, ...) KT_PRINTF(4, 5);

static void add_cell(kt_csv *csv, const kt_record *record, double value, const char *format, ...) {
    va_list arguments;
    int length = NUMBER_SIZE;
    if (record == NULL) {
        va_start(arguments, format);
        length = vsnprintf(NULL, 0, format, arguments);
        va_end(arguments);
    }
    if (length < 0 || !make_room(csv, (size_t)length + 2)) /* a comma before it, a zero after it */
        return;
    if (csv->used > 0)
        csv->line[csv->used++] = ',';
    char *end = csv->line + csv->used;
    if (record != NULL) {
        length = snprintf(end, NUMBER_SIZE, "%.17g", value);
    } else {
        va_start(arguments, format);
        length = vsnprintf(end, (size_t)length + 1, format, arguments);
        va_end(arguments);
    }
    csv->used += (size_t)length;
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

static void add_reactions(kt_csv *csv, const kt_record *r) {
    for (int body = 1; body < kt_model_body_count(csv->model); body++)
        add_reaction(csv, r, kt_body_name(csv->model, body), r != NULL ? r->reactions : NULL, body);
    for (int loop = 0; loop < kt_loop_count(csv->model); loop++)
        add_reaction(csv, r, kt_loop_name(csv->model, loop), r != NULL ? r->loop_reactions : NULL, loop);
}

/* One walk for the header and for the lines under it. */
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
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

static const char *shown_path(const kt_csv *csv) { return csv->file == STDOUT_FILENO ? "standard output" : csv->path; }

/* All of the line in one write; what a write leaves over, as pipes do, in further ones. */
static int write_line(kt_csv *csv) {
    size_t done = 0;
    if (!csv->full && make_room(csv, 1))
        csv->line[csv->used++] = '\n';
    if (csv->full) {
        kt_say("there is not enough memory for a line of %s", shown_path(csv));
        return -1;
    }
    while (done < csv->used) {
        ssize_t count = write(csv->file, csv->line + done, csv->used - done);
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0) {
            int reason = errno;
            if (csv->is_regular && ftruncate(csv->file, csv->whole) != 0)
                kt_say("%s ends in an incomplete line", shown_path(csv));
            kt_say("%s cannot be written: %s", shown_path(csv), strerror(reason));
            return -1;
        }
        done += (size_t)count;
    }
    csv->whole += (long long)csv->used;
    csv->used = 0;
    return 0;
}

int kt_csv_open(kt_csv *csv, const char *path, const kt_model *model, const kt_run *run) {
    *csv = (kt_csv){.model = model, .run = run, .record = kt_run_record(run, model), .path = path};
    csv->file = strcmp(path, "-") == 0 ? STDOUT_FILENO : open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (csv->file < 0) {
        kt_say("%s cannot be written: %s; --out FILE writes elsewhere", path, strerror(errno));
        return KT_EXIT_INTEGRATION;
    }
    struct stat status;
    csv->is_regular = csv->file != STDOUT_FILENO && fstat(csv->file, &status) == 0 && S_ISREG(status.st_mode);
    add_line(csv, NULL);
    if (write_line(csv) == 0)
        return -1;
    (void)kt_csv_close(csv);
    return KT_EXIT_INTEGRATION;
}

/* Whether the file begins with this header. */
static bool begins_with_line(const kt_csv *csv) {
    char *text = malloc(csv->used + 1);
    bool same = text != NULL && pread(csv->file, text, csv->used + 1, 0) >= (ssize_t)csv->used &&
                memcmp(text, csv->line, csv->used) == 0 && text[csv->used] == '\n';
    free(text);
    return same;
}

int kt_csv_reopen(kt_csv *csv, const char *path, const kt_model *model, const kt_run *run, long long lines) {
    *csv = (kt_csv){.model = model, .run = run, .record = kt_run_record(run, model), .path = path, .whole = lines};
    struct stat status;
    csv->file = open(path, O_RDWR | O_CLOEXEC);
    if (csv->file < 0) {
        kt_say("%s, the records until the checkpoint, cannot be opened: %s", path, strerror(errno));
        return KT_EXIT_USAGE;
    }
    csv->is_regular = true;
    add_line(csv, NULL);
    const char *wrong = NULL;
    if (fstat(csv->file, &status) != 0 || !S_ISREG(status.st_mode) || status.st_size < lines || csv->full ||
        !begins_with_line(csv))
        wrong = "these are not the records until the checkpoint; give the --out of the run that wrote it";
    else if (ftruncate(csv->file, lines) != 0 || lseek(csv->file, lines, SEEK_SET) != lines)
        wrong = strerror(errno);
    if (wrong == NULL)
        return -1;
    kt_say("%s: %s", path, wrong);
    (void)kt_csv_close(csv);
    return KT_EXIT_USAGE;
}

int kt_csv_write(kt_csv *csv, const kt_record *record) {
    csv->used = 0;
    add_line(csv, record);
    return write_line(csv);
}

int kt_csv_close(kt_csv *csv) {
    int failed = 0;
    if (csv->file > STDOUT_FILENO && close(csv->file) != 0) {
        kt_say("%s cannot be written: %s", csv->path, strerror(errno));
        failed = -1;
    }
    csv->file = -1;
    free(csv->line);
    csv->line = NULL;
    return failed;
}
