/* Writes the page that shows a motion: its sources, made into texts by the build (view/embed.py), with the description
 * of the mechanism as JSON and the frames in base64 between them (view/motion.js has the order of the bytes). */
#include "view.h"

#include "command.h"
#include "json.h"
#include "kinetree/descriptor.h"
#include "kinetree/loop.h"
#include "kinetree/reduction.h"
#include "output.h"
#include "view/page.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- base64 ------------------------------------------------------------------------------------------------------ */

/* Bytes on their way to letters, four for each three; a whole block is written at once. */
typedef struct base64 {
    FILE *file;
    char pairs[4096][2]; /* the two letters of twelve bits */
    unsigned char bytes[3 * 8192];
    size_t count;
} base64;

static base64 start_letters(FILE *file) {
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    base64 out = {.file = file};
    for (size_t i = 0; i < sizeof out.pairs / sizeof *out.pairs; i++) {
        out.pairs[i][0] = letters[i / 64];
        out.pairs[i][1] = letters[i % 64];
    }
    return out;
}

/* Writes the block, filled up to three bytes with zeros, which no reader looks at. */
static void flush_letters(base64 *out) {
    char text[4 * 8192], *to = text;
    if (out->count == 0)
        return;
    while (out->count % 3 != 0)
        out->bytes[out->count++] = 0;
    const unsigned char *const end = out->bytes + out->count;
    for (const unsigned char *from = out->bytes; from < end; from += 3) {
        const unsigned three = (unsigned)from[0] << 16 | (unsigned)from[1] << 8 | (unsigned)from[2];
        memcpy(to, out->pairs[three >> 12], 2);
        memcpy(to + 2, out->pairs[three & 4095U], 2);
        to += 4;
    }
    (void)fwrite(text, 1, (size_t)(to - text), out->file); /* errors are asked for at the end */
    out->count = 0;
}

static void put_bytes(base64 *out, const unsigned char *from, size_t size) {
    while (size > 0) {
        const size_t room = sizeof out->bytes - out->count, part = size < room ? size : room;
        memcpy(out->bytes + out->count, from, part);
        out->count += part;
        from += part;
        size -= part;
        if (out->count == sizeof out->bytes)
            flush_letters(out);
    }
}

/* Numbers of `size` bytes each, little-endian on every machine. */
static void put_numbers(base64 *out, const void *numbers, size_t count, size_t size) {
    const unsigned char *from = numbers;
    if (__BYTE_ORDER__ != __ORDER_BIG_ENDIAN__) {
        put_bytes(out, from, count * size);
        return;
    }
    for (size_t i = 0; i < count * size; i++)
        put_bytes(out, &from[i + size - 1 - 2 * (i % size)], 1);
}

static void put_frames(const kt_motion *motion, FILE *file) {
    const size_t n = motion->count, bodies = kt_motion_bodies(motion);
    base64 out = start_letters(file);
    put_numbers(&out, motion->times, n, sizeof *motion->times);
    put_numbers(&out, motion->places, 3 * n * bodies, sizeof *motion->places);
    put_numbers(&out, motion->turns, 4 * n * bodies, sizeof *motion->turns);
    put_numbers(&out, motion->values, n * kt_motion_width(motion), sizeof *motion->values);
    put_numbers(&out, motion->force_values, 3 * n * (size_t)motion->force_count, sizeof *motion->force_values);
    flush_letters(&out);
}

/* ---- the mechanism as JSON --------------------------------------------------------------------------------------- */

/* Most numbers of a description are 0 or 1; whole ones are shorter and cheaper without a point. */
static json_t *describe_number(double x) {
    return fabs(x) < 1e9 && x == floor(x) ? json_integer((json_int_t)x) : kt_json_number(x);
}

static json_t *describe_numbers(const double *x, int count) {
    json_t *list = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(list, describe_number(x[i]));
    return list;
}

static json_t *describe_vector(kt_vec3 u) {
    const double x[] = {u.x, u.y, u.z};
    return describe_numbers(x, 3);
}

static json_t *describe_quaternion(kt_mat3 rotation) {
    const kt_quat q = kt_quat_from_matrix(rotation);
    const double x[] = {q.w, q.x, q.y, q.z};
    return describe_numbers(x, 4);
}

static void add_pose(json_t *object, kt_pose pose) {
    json_object_set_new(object, "at", describe_vector(pose.position));
    json_object_set_new(object, "turn", describe_quaternion(pose.rotation));
}

static json_t *describe_frame(const kt_body_frame *frame) {
    json_t *object = json_object();
    json_object_set_new(object, "body", json_integer(frame->body));
    add_pose(object, frame->pose);
    return object;
}

static json_t *describe_ends(const kt_body_frame *ends, int count) {
    json_t *list = json_array();
    for (int k = 0; k < count; k++)
        json_array_append_new(list, describe_frame(&ends[k]));
    return list;
}

static json_t *describe_bodies(const kt_motion *motion) {
    const kt_model *model = motion->model;
    json_t *list = json_array();
    for (int body = 0; body < kt_model_body_count(model); body++) {
        json_t *one = json_object();
        json_object_set_new(one, "name", kt_json_text(kt_body_name(model, body)));
        json_object_set_new(one, "parent", json_integer(body > 0 ? kt_body_parent(model, body) : 0));
        json_object_set_new(one, "joint", json_string(kt_joint_type_name(kt_body_coordinates(model, body).type)));
        json_object_set_new(one, "mass", describe_number(body > 0 ? kt_body_mass(model, body) : 0.0));
        json_object_set_new(one, "colour", json_integer(motion->picture->colour[body]));
        json_array_append_new(list, one);
    }
    return list;
}

static json_t *describe_solids(const kt_picture *picture) {
    static const char *const types[] = {
        [KT_SOLID_BOX] = "box", [KT_SOLID_SPHERE] = "sphere", [KT_SOLID_CYLINDER] = "cylinder", [KT_SOLID_ROD] = "rod"};
    json_t *list = json_array();
    for (int i = 0; i < picture->solid_count; i++) {
        const kt_solid *solid = &picture->solids[i];
        json_t *one = json_object();
        json_object_set_new(one, "type", json_string(types[solid->type]));
        json_object_set_new(one, "body", json_integer(solid->body));
        add_pose(one, solid->pose);
        json_object_set_new(one, "half", describe_vector(solid->half));
        json_array_append_new(list, one);
    }
    return list;
}

static json_t *describe_joints(const kt_picture *picture) {
    json_t *list = json_array();
    for (int i = 0; i < picture->joint_count; i++) {
        const kt_picture_joint *joint = &picture->joints[i];
        json_t *one = json_object();
        json_object_set_new(one, "name", kt_json_text(joint->name));
        json_object_set_new(one, "type", json_string(kt_joint_type_name(joint->type)));
        json_object_set_new(one, "body", json_integer(joint->body));
        json_object_set_new(one, "on", json_integer(joint->frame.body));
        add_pose(one, joint->frame.pose);
        if (joint->type == KT_JOINT_REVOLUTE)
            json_object_set_new(one, "child", describe_quaternion(joint->child));
        if (joint->type == KT_JOINT_UNIVERSAL)
            json_object_set_new(one, "axis2", describe_vector(joint->axis2));
        json_array_append_new(list, one);
    }
    return list;
}

static json_t *describe_loops(const kt_picture *picture) {
    json_t *list = json_array();
    for (int i = 0; i < picture->loop_count; i++) {
        const kt_picture_loop *loop = &picture->loops[i];
        json_t *one = json_object();
        json_object_set_new(one, "name", kt_json_text(loop->name));
        json_object_set_new(one, "type", json_string(kt_loop_type_name(loop->type)));
        json_object_set_new(one, "ends", describe_ends(loop->ends, 2));
        json_array_append_new(list, one);
    }
    return list;
}

static json_t *describe_relations(const kt_picture *picture) {
    json_t *list = json_array();
    for (int i = 0; i < picture->relation_count; i++) {
        const kt_picture_relation *relation = &picture->relations[i];
        json_t *one = json_object();
        json_object_set_new(one, "name", kt_json_text(relation->name));
        json_object_set_new(one, "type", json_string(kt_loop_type_name(relation->type)));
        json_object_set_new(one, "joint", json_integer(relation->joint));
        json_object_set_new(one, "other", json_integer(relation->other));
        json_array_append_new(list, one);
    }
    return list;
}

/* lower, upper: null where there is no limit */
static void describe_joint_effect(json_t *one, const kt_picture_effect *effect) {
    json_object_set_new(one, "joint", json_integer(effect->joint));
    if (effect->type == KT_EFFECT_JOINT_LIMIT) {
        json_object_set_new(one, "lower", describe_number(effect->lower));
        json_object_set_new(one, "upper", describe_number(effect->upper));
    }
}

static json_t *describe_effects(const kt_picture *picture) {
    json_t *list = json_array();
    for (int i = 0; i < picture->effect_count; i++) {
        const kt_picture_effect *effect = &picture->effects[i];
        json_t *one = json_object();
        json_object_set_new(one, "name", effect->name != NULL ? kt_json_text(effect->name) : json_null());
        json_object_set_new(one, "type", json_string(kt_effect_type_name(effect->type)));
        json_object_set_new(one, "ends", describe_ends(effect->ends, effect->end_count));
        json_object_set_new(one, "radius", describe_number(effect->radius));
        json_object_set_new(one, "stiff", json_boolean(effect->has_stiffness));
        if (effect->joint >= 0)
            describe_joint_effect(one, effect);
        json_array_append_new(list, one);
    }
    return list;
}

static json_t *describe_planes(const kt_picture *picture) {
    json_t *list = json_array();
    for (int i = 0; i < picture->plane_count; i++) {
        json_t *one = describe_frame(&picture->planes[i].frame);
        json_object_set_new(one, "half", describe_number(picture->planes[i].half));
        json_array_append_new(list, one);
    }
    return list;
}

static bool is_traced(const kt_view *view, const char *body, const char *marker) {
    for (int i = 0; view->run != NULL && i < view->run->marker_count; i++) {
        const kt_marker_pair *pair = &view->run->markers[i];
        if (strcmp(pair->body != NULL ? pair->body : "world", body) == 0 && strcmp(pair->marker, marker) == 0)
            return true;
    }
    return false;
}

/* Markers of the world do not move. */
static json_t *describe_markers(const kt_motion *motion, const kt_view *view) {
    json_t *list = json_array();
    for (int body = 1; body < kt_model_body_count(motion->model); body++)
        for (int k = 0; k < kt_marker_count(motion->model, body); k++) {
            const char *name = kt_marker_name(motion->model, body, k);
            json_t *one = json_object();
            json_object_set_new(one, "body", json_integer(body));
            json_object_set_new(one, "name", kt_json_text(name));
            json_object_set_new(one, "at", describe_vector(kt_marker_at(motion->model, body, k)));
            json_object_set_new(one, "traced", json_boolean(is_traced(view, kt_body_name(motion->model, body), name)));
            json_array_append_new(list, one);
        }
    return list;
}

static json_t *describe_column(const char *name, const char *title, const char *unit) {
    json_t *one = json_object();
    json_object_set_new(one, "name", kt_json_text(name));
    json_object_set_new(one, "group", json_string(title));
    json_object_set_new(one, "unit", json_string(unit));
    return one;
}

static json_t *describe_columns(const kt_motion *motion) {
    json_t *list = json_array();
    for (size_t i = 1; i < motion->columns.count; i++) {
        char name[512];
        const kt_quantity quantity = kt_column_quantity(&motion->columns, i);
        (void)kt_column_name(&motion->columns, i, name, sizeof name);
        json_array_append_new(list, describe_column(name, quantity.title, quantity.unit));
    }
    if (motion->has_drift)
        json_array_append_new(list, describe_column("energy.total less its start", "Change of the energy", "J"));
    return list;
}

static json_t *describe_force(const kt_motion_force *force) {
    static const char *const sources[] = {[KT_FORCE_JOINT] = "reaction",
                                          [KT_FORCE_LOOP] = "reaction",
                                          [KT_FORCE_CONTACT] = "contact",
                                          [KT_FORCE_EFFECT] = "effect"};
    json_t *one = json_object();
    json_object_set_new(one, "source", json_string(sources[force->source]));
    json_object_set_new(one, "body", json_integer(force->body));
    json_object_set_new(one, "at", describe_vector(force->at));
    if (force->source == KT_FORCE_CONTACT || force->source == KT_FORCE_EFFECT)
        json_object_set_new(one, "effect", json_integer(force->index));
    return one;
}

static json_t *describe_forces(const kt_motion *motion) {
    json_t *list = json_array();
    for (int i = 0; i < motion->force_count; i++)
        json_array_append_new(list, describe_force(&motion->forces[i]));
    return list;
}

/* Errors name what they are about in quotation marks. */
static bool is_named(const kt_error *error, const char *name) {
    char quoted[KT_MESSAGE_SIZE];
    (void)snprintf(quoted, sizeof quoted, "'%s'", name);
    return strstr(error->where, quoted) != NULL || strstr(error->message, quoted) != NULL;
}

static void add_body(json_t *bodies, const kt_model *model, const char *name) {
    const int body = name != NULL ? kt_body_find(model, name) : -1;
    if (body > 0)
        json_array_append_new(bodies, json_integer(body));
}

/* Loops between joints cannot be seen; their bodies stand for them. */
static void add_related(json_t *bodies, const kt_motion *motion, const kt_error *error) {
    const kt_description *d = &motion->scene->description;
    for (int i = 0; i < d->loop_count; i++)
        if (is_named(error, d->loops[i].name)) {
            add_body(bodies, motion->model, d->loops[i].joint);
            for (int k = 0; k < d->loops[i].term_count; k++)
                add_body(bodies, motion->model, d->loops[i].terms[k].joint);
        }
}

/* What a failure names, as numbers of bodies and of `loops`. */
static json_t *describe_failure(const kt_motion *motion, const kt_error *error) {
    const kt_picture *picture = motion->picture;
    json_t *bodies = json_array(), *loops = json_array(), *one = json_object();
    char message[KT_WHERE_SIZE + KT_MESSAGE_SIZE + 8];
    (void)snprintf(message, sizeof message, "%s%s%s", error->where, error->where[0] != '\0' ? ": " : "",
                   error->message[0] != '\0' ? error->message : kt_status_text(error->code));
    for (int body = 1; body < picture->body_count; body++)
        if (is_named(error, kt_body_name(motion->model, body)))
            json_array_append_new(bodies, json_integer(body));
    add_related(bodies, motion, error);
    for (int i = 0; i < picture->loop_count; i++)
        if (is_named(error, picture->loops[i].name))
            json_array_append_new(loops, json_integer(i));
    json_object_set_new(one, "message", kt_json_text(message));
    json_object_set_new(one, "bodies", bodies);
    json_object_set_new(one, "loops", loops);
    return one;
}

static json_t *describe(const kt_motion *motion, const kt_view *view) {
    const kt_picture *picture = motion->picture;
    json_t *root = json_object();
    json_object_set_new(root, "version", json_string(kt_version()));
    json_object_set_new(root, "name", kt_json_text(view->name));
    json_object_set_new(root, "method", json_string(view->method));
    json_object_set_new(root, "frames", json_integer((json_int_t)motion->count));
    json_object_set_new(root, "centre", describe_vector(motion->centre));
    json_object_set_new(root, "gravity", describe_vector(picture->gravity));
    json_object_set_new(root, "normal", picture->is_planar ? describe_vector(picture->normal) : json_null());
    json_object_set_new(root, "size", describe_number(picture->size));
    json_object_set_new(root, "radius", describe_number(picture->radius));
    json_object_set_new(root, "bodies", describe_bodies(motion));
    json_object_set_new(root, "solids", describe_solids(picture));
    json_object_set_new(root, "joints", describe_joints(picture));
    json_object_set_new(root, "loops", describe_loops(picture));
    json_object_set_new(root, "relations", describe_relations(picture));
    json_object_set_new(root, "effects", describe_effects(picture));
    json_object_set_new(root, "planes", describe_planes(picture));
    json_object_set_new(root, "markers", describe_markers(motion, view));
    json_object_set_new(root, "columns", describe_columns(motion));
    json_object_set_new(root, "arrows", describe_forces(motion));
    json_object_set_new(root, "overlay", json_boolean(view->is_overlay));
    if (view->failed != NULL)
        json_object_set_new(root, "failed", describe_failure(motion, view->failed));
    if (view->notes != NULL)
        json_object_set(root, "notes", view->notes);
    return root;
}

/* Within a script element nothing but "<" could begin what a browser takes for markup; in JSON it stands in texts
 * alone. */
static void put_json(const char *text, FILE *file) {
    for (const char *less; (less = strchr(text, '<')) != NULL; text = less + 1) {
        (void)fwrite(text, 1, (size_t)(less - text), file);
        (void)fputs("\\u003c", file);
    }
    (void)fputs(text, file);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

/* Returns 0, or the errno. */
static int write_page(const kt_motion *motion, const char *json, const char *path) {
    errno = 0;
    FILE *file = fopen(path, "w");
    if (file == NULL)
        return errno;
    char block[1 << 16]; /* as much as a write takes */
    (void)setvbuf(file, block, _IOFBF, sizeof block);
    (void)fwrite(kt_page_head, 1, kt_page_head_size, file);
    put_json(json, file);
    (void)fwrite(kt_page_middle, 1, kt_page_middle_size, file);
    put_frames(motion, file);
    (void)fwrite(kt_page_tail, 1, kt_page_tail_size, file);
    const bool fine = fflush(file) == 0 && !ferror(file);
    const int reason = fine ? 0 : errno != 0 ? errno : EIO;
    return fclose(file) != 0 && reason == 0 ? errno : reason;
}

int kt_view_write(const kt_motion *motion, const kt_view *view, const char *path) {
    if (motion->count == 0)
        return KT_EXIT_DONE; /* there is nothing to see, and why was said */
    char *json = kt_json_print(describe(motion, view), JSON_COMPACT | JSON_REAL_PRECISION(9));
    if (json == NULL)
        return KT_EXIT_INTEGRATION;
    kt_output output;
    int code = kt_output_start(&output, path);
    if (code < 0) {
        const int reason = write_page(motion, json, kt_output_path(&output));
        if (reason != 0)
            kt_say("%s cannot be written: %s", path, strerror(reason));
        const int ended = kt_output_end(&output, reason != 0 ? KT_OUTPUT_NOTHING : KT_OUTPUT_WHOLE);
        code = reason != 0 || ended != 0 ? KT_EXIT_INTEGRATION : KT_EXIT_DONE;
    }
    free(json);
    return code;
}

/* ---- the initial state ------------------------------------------------------------------------------------------- */

/* Takes the given state and the assembled one, q and v being memory for one. *error tells how the assembly has ended. */
static int take_start(kt_motion *motion, const kt_model *model, kt_data *data, double *q, double *v, kt_error *error) {
    kt_model_initial(model, q, v);
    if (kt_motion_take_state(motion, 0.0, q, v) != 0)
        return -1;
    if (kt_state_assemble(model, data, 0.0, q, v, error) == KT_ERROR_CONSTRAINT)
        kt_assembly_reached(model, data, q);
    return kt_motion_take_state(motion, 1.0, q, v);
}

int kt_view_write_start(const kt_scene *scene, const kt_model *model, const char *name, const char *path) {
    kt_error error = {0};
    kt_data *data = NULL;
    kt_run run = scene->run;
    run.record = KT_RECORD_POSITION;
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    double *q = calloc(nq + nv + 1, sizeof *q);
    kt_motion *motion = kt_motion_start(scene, model, &run, 2, false);
    int code = KT_EXIT_INTEGRATION;
    if (q == NULL || motion == NULL || kt_data_create(model, &data, &error) != KT_OK)
        kt_say("there is not enough memory for the view");
    else if (take_start(motion, model, data, q, q + nq, &error) == 0) {
        const kt_view view = {
            .name = name, .method = "initial state", .failed = error.code != KT_OK ? &error : NULL, .is_overlay = true};
        code = kt_view_write(motion, &view, path);
    }
    kt_data_free(data);
    kt_motion_free(motion);
    free(q);
    return code;
}
