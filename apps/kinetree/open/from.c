/* Reads the state of a result, joint by joint. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/load.h"
#include "open/released.h"
#include "open/start.h"
#include "picture/picture.h"
#include "records/keep.h"
#include "text/input.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A result: a summary, or records of which one row is the state. */
typedef struct source {
    char *path;
    double time;    /* s, the requested time; NaN: the end */
    json_t *root;   /* NULL: records */
    kt_table table; /* of these */
    size_t row;
} source;

/* ---- the file ---------------------------------------------------------------------------------------------------- */

/* Splits the name of a result from its time. "run.csv:2.5" is the record at 2.5 s of run.csv, unless a file has this
 * whole name. */
static char *split_path(const char *result, const char *folder, double *time) {
    const bool is_here = folder == NULL || result[0] == '/';
    char *path = kt_join_texts(is_here ? "" : folder, is_here ? "" : "/", result), *end;
    *time = (double)NAN;
    if (path == NULL)
        return NULL;
    char *colon = strrchr(path, ':');
    if (colon == NULL || colon[1] == '\0' || access(path, F_OK) == 0)
        return path;
    const double value = strtod(colon + 1, &end);
    if (*end == '\0' && isfinite(value)) {
        *colon = '\0';
        *time = value;
    }
    return path;
}

/* Returns whether the text begins as JSON does. */
static bool is_json(const char *text) { return text[strspn(text, " \n\t\r")] == '{'; }

/* Returns whether one of the first 100 lines of the text begins with the key that every scene has. */
static bool is_scene_text(const char *text) {
    static const char key[] = "kinetree:";
    bool found = false;
    for (int i = 0; text != NULL && !found && i < 100; i++) {
        found = strncmp(text, key, sizeof key - 1) == 0;
        text = strchr(text, '\n');
        text = text != NULL ? text + 1 : NULL;
    }
    return found;
}

static int read_summary_state(source *s, const char *text, size_t size) {
    s->root = kt_input_json(s->path, text, size, "result");
    if (s->root == NULL)
        return KT_EXIT_SCENE;
    const double end = json_number_value(json_object_get(s->root, "time"));
    if (!isnan(s->time) && s->time != end)
        return kt_misuse("%s is a summary, which has the state at its end alone, t = %.9g s, not that at %.9g s; take "
                         "the records of that run (CSV)",
                         s->path, end, s->time);
    return KT_EXIT_DONE;
}

static int find_record(source *s) {
    if (s->table.part_count > 1)
        return kt_reject(KT_EXIT_SCENE, "%s has the records of %zu runs, and --from takes those of one run", s->path,
                         s->table.part_count);
    const double *time = kt_table_column(&s->table, "time");
    s->row = s->table.rows - 1;
    if (time == NULL)
        return kt_reject(KT_EXIT_SCENE, "%s has no column 'time': it is no result of a run", s->path);
    for (size_t i = 0; !isnan(s->time) && i < s->table.rows; i++)
        if (fabs(time[i] - s->time) < fabs(time[s->row] - s->time))
            s->row = i;
    if (!isnan(s->time) && fabs(time[s->row] - s->time) > 1e-9 * fmax(1.0, fabs(s->time)))
        kt_say("%s has no record at %.9g s; the nearest record, at %.9g s, is used", s->path, s->time, time[s->row]);
    return KT_EXIT_DONE;
}

/* Returns whether the path is "FILE:TEXT" with a file FILE, after reporting that the text is no time. */
static bool reject_time(const char *path) {
    const char *colon = strrchr(path, ':');
    char file[4096];
    if (colon == NULL || access(path, F_OK) == 0 ||
        (size_t)snprintf(file, sizeof file, "%.*s", (int)(colon - path), path) >= sizeof file ||
        access(file, F_OK) != 0)
        return false;
    kt_say("--from takes FILE or FILE:TIME, and '%s' is no time; write %s:0.5 for the record at 0.5 s", colon + 1,
           file);
    return true;
}

/* Reports that a result cannot be read. scene: the one whose `initial.from` names it, for the position of the key;
 * NULL: --from names it. */
static int say_unreadable(const kt_scene *scene, const kt_error *error) {
    kt_error located = {0};
    (void)kt_error_set(&located, error->code, "initial.from", "%s", kt_words_of(error).text);
    if (scene != NULL)
        kt_say_located(scene, &located);
    else
        kt_say_error(error);
    return KT_EXIT_SCENE;
}

/* Reads records or a summary. scene: as for say_unreadable. */
static int read_result(source *s, const kt_scene *scene) {
    kt_error error = {0};
    char *text = NULL;
    size_t size = 0;
    int code;
    if (kt_input_read(s->path, &kt_input_result, &text, &size, &error) != KT_OK)
        return say_unreadable(scene, &error);
    if (is_scene_text(text)) {
        code = kt_misuse("%s is a scene and no result of a run; --from and initial.from take the summary (--summary) "
                         "or the records (CSV) of a run",
                         s->path);
    } else if (!is_json(text)) {
        code = kt_table_parse(s->path, text, &s->table);
        return code < 0 ? find_record(s) : code;
    } else {
        code = read_summary_state(s, text, size);
    }
    free(text);
    return code;
}

/* folder: of the scene whose `initial.from` names the result; NULL: --from does. */
static int open_source(source *s, const kt_scene *scene, const char *result, const char *folder) {
    double time;
    char *path = split_path(result, folder, &time);
    *s = (source){.path = path, .time = time};
    if (path == NULL)
        return kt_say_no_memory(NULL);
    if (isnan(time) && reject_time(path))
        return KT_EXIT_USAGE;
    int code = kt_check_input("the result to start from", path);
    if (code >= 0)
        return code;
    if (!kt_keep_is_meant(path))
        return read_result(s, folder != NULL ? scene : NULL);
    code = kt_table_read_files(&s->path, 1, &s->table);
    return code < 0 ? find_record(s) : code;
}

static void close_source(source *s) {
    json_decref(s->root);
    kt_table_free(&s->table);
    free(s->path);
}

/* ---- the state --------------------------------------------------------------------------------------------------- */

/* Reads `count` numbers of "position" or "velocity" of a joint. Returns the count of values that the result has. The
 * array is complete only if this is `count`; otherwise records may still have filled a part of the array. Values that
 * are no numbers become NaN. */
static int read_part(const source *s, const char *part, const char *joint, int count, double *out) {
    char name[512];
    if (s->root != NULL) {
        const json_t *value = json_object_get(json_object_get(s->root, part), joint);
        const int found = json_is_number(value) ? 1 : json_is_array(value) ? (int)json_array_size(value) : 0;
        for (int k = 0; k < count && found == count; k++) {
            const json_t *one = json_is_array(value) ? json_array_get(value, (size_t)k) : value;
            out[k] = json_is_number(one) ? json_number_value(one) : (double)NAN;
        }
        return found;
    }
    int found = 0;
    for (int k = 0; k < KT_JOINT_NQ_MAX; k++) {
        snprintf(name, sizeof name, count == 1 ? "%s.%s" : "%s.%s[%d]", part, joint, k);
        const double *column = kt_table_column(&s->table, name);
        if (column == NULL || (count == 1 && k > 0))
            break;
        if (k < count)
            out[k] = column[s->row];
        found++;
    }
    return found;
}

/* Returns whether one of the numbers is not finite, after reporting it. */
static bool reject_values(const source *s, const char *part, const char *name, int count, const double *values) {
    for (int k = 0; k < count; k++)
        if (!isfinite(values[k])) {
            kt_say("%s: the %s of '%s' is no finite number there", s->path, part, name);
            return true;
        }
    return false;
}

/* Reads the state of all joints that the result has. Returns their number, or -1 after printing an error. */
static int read_joint_states(const source *s, const kt_model *model, double *q, double *v, char *missing, size_t room) {
    int found = 0, still = 0;
    size_t used = 0;
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        const char *joint = kt_joint_name(model, body);
        double x[KT_JOINT_NQ_MAX], y[KT_JOINT_NQ_MAX] = {0.0};
        const int has = at.nq > 0 ? read_part(s, "position", joint, at.nq, x) : 0;
        if (at.nq == 0)
            continue;
        if (has != 0 && has != at.nq) {
            kt_say("%s: joint '%s' has %d position%s there, and %d in the scene: another type of joint", s->path, joint,
                   has, has == 1 ? "" : "s", at.nq);
            return -1;
        }
        if (has == 0) {
            used +=
                (size_t)snprintf(missing + used, used < room ? room - used : 0, "%s%s", used > 0 ? ", " : "", joint);
            used = used < room ? used : room - 1;
            continue;
        }
        if (read_part(s, "velocity", joint, at.nv, y) != at.nv) {
            memset(y, 0, sizeof y); /* records may have some of its columns */
            still++;
        }
        if (reject_values(s, "position", joint, at.nq, x) || reject_values(s, "velocity", joint, at.nv, y))
            return -1;
        memcpy(q + at.q, x, (size_t)at.nq * sizeof *q);
        memcpy(v + at.v, y, (size_t)at.nv * sizeof *v);
        found++;
    }
    if (still > 0)
        kt_say("%s has no velocities of %d joint%s, which start%s at rest; --record position,velocity records them",
               s->path, still, still == 1 ? "" : "s", still == 1 ? "s" : "");
    return found;
}

/* Prints the joints of the summary that the scene does not have. */
static void say_unknown_joints(const source *s, const kt_model *model) {
    const char *name;
    json_t *value;
    json_object_foreach(json_object_get(s->root, "position"), name, value) {
        if (kt_body_of_joint(model, name) > 0)
            continue;
        kt_nearest nearest = kt_nearest_make(name, NULL);
        for (int body = 1; body < kt_model_body_count(model); body++)
            (void)kt_nearest_try(&nearest, kt_joint_name(model, body));
        kt_say("%s has a joint '%s', which the scene does not have%s", s->path, name, kt_ask(&nearest, "", "").text);
    }
}

/* Reads the auxiliary states of the result. A state that the result lacks keeps its initial value in the scene. */
static kt_status take_auxiliary_states(kt_scene *scene, const source *s, const kt_model *model, kt_error *error) {
    const int count = kt_auxiliary_state_count(model);
    double *x = calloc((size_t)count + 1, sizeof *x);
    if (x == NULL)
        return kt_reject_memory(error);
    kt_auxiliary_states_initial(model, x);
    for (int i = 0; i < count; i++)
        if (read_part(s, "state", kt_auxiliary_state_name(model, i), 1, &x[i]) != 1)
            kt_say("%s has no state '%s', which starts with its value in the scene; --record state records it", s->path,
                   kt_auxiliary_state_name(model, i));
    const kt_status status = kt_scene_start_states(scene, x, error);
    free(x);
    return status;
}

/* Releases the loops and effects that the result lists as released, and engages the others. Records have no such
 * list. */
static void take_released(kt_scene *scene, const source *s) {
    const json_t *list = json_object_get(s->root, "released");
    char names[400];
    kt_released_names(scene, names, sizeof names);
    if (json_is_array(list))
        kt_released_apply(scene, list);
    else if (names[0] != '\0')
        kt_say("%s does not list the released loops and effects: %s begin as in the scene; the summary of that run "
               "(--summary) lists them",
               s->path, names);
}

static int take_given_state(kt_scene *scene, const source *s, const kt_model *model, double *q, double *v) {
    char missing[400] = "";
    kt_error error = {0};
    const int found = read_joint_states(s, model, q, v, missing, sizeof missing);
    if (found < 0)
        return KT_EXIT_SCENE;
    if (s->root != NULL)
        say_unknown_joints(s, model);
    if (found == 0)
        return kt_reject(KT_EXIT_SCENE, "%s has the state of no joint of the scene: %s", s->path, missing);
    if (missing[0] != '\0')
        kt_say("%s has no state of %s: the values of the scene stay", s->path, missing);
    char start[1100];
    (void)snprintf(start, sizeof start, "the motion starts at t = 0 from the state of %s", s->path);
    kt_say_anew(scene, start, s->path);
    kt_status status = kt_scene_start_from(scene, model, q, v, &error);
    if (status == KT_OK)
        take_released(scene, s);
    if (status == KT_OK && kt_auxiliary_state_count(model) > 0)
        status = take_auxiliary_states(scene, s, model, &error);
    return kt_say_status(status, &error);
}

int kt_start_from(kt_scene *scene, const char *result, const char *folder) {
    source s;
    kt_model *model = NULL;
    int code = open_source(&s, scene, result, folder);
    if (code == KT_EXIT_DONE)
        code = kt_compile_scene(scene, &model);
    double *q = code == KT_EXIT_DONE ? kt_given_state(model) : NULL;
    if (code == KT_EXIT_DONE)
        code = q != NULL ? take_given_state(scene, &s, model, q, q + kt_model_nq(model)) : kt_say_no_memory(NULL);
    free(q);
    kt_model_free(model);
    close_source(&s);
    return code;
}
