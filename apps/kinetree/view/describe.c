/* The mechanism of a page as JSON: its bodies, solids, joints, loops and effects, and the columns of its frames. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "view/view.h"

#include "command.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "open/released.h"
#include "picture/picture_mesh.h"

#include <stdio.h>
#include <string.h>

static void put_rotation(kt_json_writer *out, const char *key, kt_mat3 rotation) {
    const kt_quat q = kt_quat_from_mat3(rotation);
    const double x[] = {q.w, q.x, q.y, q.z};
    kt_json_put_numbers(out, key, x, 4);
}

static void put_pose(kt_json_writer *out, kt_pose pose) {
    kt_json_put_vector(out, "at", pose.position);
    put_rotation(out, "turn", pose.rotation);
}

static void put_frame(kt_json_writer *out, const kt_body_frame *frame) {
    kt_put_integer(out, "body", frame->body);
    put_pose(out, frame->pose);
}

static void put_ends(kt_json_writer *out, const kt_body_frame *ends, int count) {
    kt_put_open(out, "ends", '[');
    for (int k = 0; k < count; k++) {
        kt_put_open(out, NULL, '{');
        put_frame(out, &ends[k]);
        kt_put_close(out, '}');
    }
    kt_put_close(out, ']');
}

static void put_body(kt_json_writer *out, const kt_motion *motion, int body) {
    const kt_model *model = motion->model;
    kt_put_text(out, "name", kt_body_name(model, body));
    kt_put_integer(out, "parent", body > 0 ? kt_body_parent(model, body) : 0);
    kt_put_text(out, "joint", kt_joint_type_name(kt_body_coordinates(model, body).type));
    kt_json_put_number(out, "mass", body > 0 ? kt_body_mass(model, body) : 0.0);
    kt_put_integer(out, "colour", motion->picture->colour[body]);
}

static void put_solid(kt_json_writer *out, const kt_motion *motion, int i) {
    static const char *const types[] = {
        [KT_SOLID_BOX] = "box", [KT_SOLID_SPHERE] = "sphere", [KT_SOLID_CYLINDER] = "cylinder", [KT_SOLID_ROD] = "rod"};
    const kt_solid *solid = &motion->picture->solids[i];
    kt_put_text(out, "type", types[solid->type]);
    kt_put_integer(out, "body", solid->body);
    put_pose(out, solid->pose);
    kt_json_put_vector(out, "half", solid->half);
    if (solid->mesh != NULL)
        kt_put_integer(out, "points", solid->mesh->point_count);
}

static void put_joint(kt_json_writer *out, const kt_motion *motion, int i) {
    const kt_picture_joint *joint = &motion->picture->joints[i];
    kt_put_text(out, "name", joint->name);
    kt_put_text(out, "type", kt_joint_type_name(joint->type));
    kt_put_integer(out, "body", joint->body);
    kt_put_integer(out, "on", joint->frame.body);
    put_pose(out, joint->frame.pose);
    if (i >= motion->picture->joint_count)
        kt_put_boolean(out, "loop", true);
    if (joint->type == KT_JOINT_REVOLUTE)
        put_rotation(out, "child", joint->child);
    if (joint->type == KT_JOINT_UNIVERSAL)
        kt_json_put_vector(out, "axis2", joint->axis2);
}

/* Writes the times at which a loop or an effect is released, engaged, released, and so on. It writes nothing for one
 * that always acts. */
static void put_released(kt_json_writer *out, const kt_motion *motion, const char *name) {
    bool is_off = false, is_open = false;
    for (size_t i = 0; i < motion->count; i++) {
        const bool off = motion->released[i] != 0 && kt_released_holds(motion->scene, motion->released[i], name);
        if (off == is_off)
            continue;
        if (!is_open)
            kt_put_open(out, "released", '[');
        is_open = true;
        is_off = off;
        kt_json_put_number(out, NULL, motion->times[i]);
    }
    if (is_open)
        kt_put_close(out, ']');
}

/* The lengths of a rope: one number, or one for each frame if they differ. */
static void put_rope(kt_json_writer *out, const kt_motion *motion, const kt_picture_loop *loop) {
    bool is_constant = true;
    if (loop->rope == NULL || motion->count == 0)
        return;
    const double first = kt_picture_rope_length(loop, motion->times[0]);
    for (size_t i = 1; i < motion->count && is_constant; i++)
        is_constant = kt_picture_rope_length(loop, motion->times[i]) == first;
    kt_put_open(out, "rope", '[');
    for (size_t i = 0; i < (is_constant ? 1 : motion->count); i++)
        kt_json_put_number(out, NULL, kt_picture_rope_length(loop, motion->times[i]));
    kt_put_close(out, ']');
}

static void put_view_loop(kt_json_writer *out, const kt_motion *motion, int i) {
    const kt_picture_loop *loop = &motion->picture->loops[i];
    kt_put_text(out, "name", loop->name);
    kt_put_text(out, "type", kt_loop_type_name(loop->type));
    put_ends(out, loop->ends, 2);
    put_released(out, motion, loop->name);
    put_rope(out, motion, loop);
    if (loop->radii[0] != 0.0)
        kt_json_put_numbers(out, "radii", loop->radii, 2);
    if (loop->stroke_count > 0)
        kt_json_put_numbers(out, "strokes", &loop->strokes[0].from.x, 6 * loop->stroke_count);
}

static void put_relation(kt_json_writer *out, const kt_motion *motion, int i) {
    const kt_picture_relation *relation = &motion->picture->relations[i];
    kt_put_text(out, "name", relation->name);
    kt_put_text(out, "type", kt_loop_type_name(relation->type));
    kt_put_integer(out, "joint", relation->joint);
    kt_put_integer(out, "other", relation->other);
    put_released(out, motion, relation->name);
}

/* lower, upper: null where there is no limit */
static void put_effect(kt_json_writer *out, const kt_motion *motion, int i) {
    const kt_picture_effect *effect = &motion->picture->effects[i];
    kt_put_text(out, "name", effect->name);
    kt_put_text(out, "type", kt_effect_type_name(effect->type));
    put_ends(out, effect->ends, effect->end_count);
    put_released(out, motion, effect->name);
    kt_json_put_number(out, "radius", effect->radius);
    kt_put_integer(out, "lines", effect->line_count);
    kt_put_boolean(out, "stiff", effect->has_stiffness);
    if (effect->joint >= 0)
        kt_put_integer(out, "joint", effect->joint);
    if (effect->joint >= 0 && effect->type == KT_EFFECT_JOINT_LIMIT) {
        kt_json_put_number(out, "lower", effect->lower);
        kt_json_put_number(out, "upper", effect->upper);
    }
}

static void put_plane(kt_json_writer *out, const kt_motion *motion, int i) {
    put_frame(out, &motion->picture->planes[i].frame);
    kt_json_put_number(out, "half", motion->picture->planes[i].half);
}

static void put_view_force(kt_json_writer *out, const kt_motion *motion, int i) {
    static const char *const sources[] = {[KT_FORCE_JOINT] = "reaction",
                                          [KT_FORCE_LOOP] = "reaction",
                                          [KT_FORCE_CONTACT] = "contact",
                                          [KT_FORCE_EFFECT] = "effect"};
    const kt_motion_force *force = &motion->forces[i];
    kt_put_text(out, "source", sources[force->source]);
    kt_put_integer(out, "body", force->body);
    kt_json_put_vector(out, "at", force->at);
    if (force->source == KT_FORCE_CONTACT || force->source == KT_FORCE_EFFECT)
        kt_put_integer(out, "effect", force->index);
}

/* Writes a list of objects; a function writes each of them. */
static void put_list(kt_json_writer *out, const char *key, const kt_motion *motion, int count,
                     void (*one)(kt_json_writer *, const kt_motion *, int)) {
    kt_put_open(out, key, '[');
    for (int i = 0; i < count; i++) {
        kt_put_open(out, NULL, '{');
        one(out, motion, i);
        kt_put_close(out, '}');
    }
    kt_put_close(out, ']');
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
static void put_markers(kt_json_writer *out, const kt_motion *motion, const kt_view *view) {
    const kt_model *model = motion->model;
    kt_put_open(out, "markers", '[');
    for (int body = 1; body < kt_model_body_count(model); body++)
        for (int k = 0; k < kt_marker_count(model, body); k++) {
            const char *name = kt_marker_name(model, body, k);
            kt_put_open(out, NULL, '{');
            kt_put_integer(out, "body", body);
            kt_put_text(out, "name", name);
            kt_json_put_vector(out, "at", kt_marker_at(model, body, k));
            kt_put_boolean(out, "traced", is_traced(view, kt_body_name(model, body), name));
            kt_put_close(out, '}');
        }
    kt_put_close(out, ']');
}

static void put_column(kt_json_writer *out, const char *name, const char *title, const char *unit) {
    kt_put_open(out, NULL, '{');
    kt_put_text(out, "name", name);
    kt_put_text(out, "group", title);
    kt_put_text(out, "unit", unit);
    kt_put_close(out, '}');
}

static void put_columns(kt_json_writer *out, const kt_motion *motion) {
    kt_put_open(out, "columns", '[');
    for (size_t i = 1; i < motion->columns->count; i++) {
        char name[512];
        const kt_measure quantity = kt_column_quantity(motion->columns, i);
        (void)kt_column_name(motion->columns, i, name, sizeof name);
        put_column(out, name, quantity.title, quantity.unit);
    }
    if (motion->has_drift)
        put_column(out, "energy.total less its start", "Change of the energy", "J");
    kt_put_close(out, ']');
}

static void put_marks(kt_json_writer *out, const kt_marks *marks) {
    kt_put_open(out, "marks", '[');
    for (int i = 0; marks != NULL && i < marks->count; i++) {
        kt_put_open(out, NULL, '{');
        kt_json_put_number(out, "time", marks->mark[i].time);
        kt_put_text(out, "name", marks->mark[i].name);
        kt_put_close(out, '}');
    }
    kt_put_close(out, ']');
}

/* Whether an error is about a name: errors put such names in quotation marks. */
static bool error_names(const kt_error *error, const char *name) {
    char quoted[KT_MESSAGE_SIZE];
    (void)snprintf(quoted, sizeof quoted, "'%s'", name);
    return strstr(error->where, quoted) != NULL || strstr(error->message, quoted) != NULL;
}

static void put_found(kt_json_writer *out, const kt_model *model, const char *name) {
    const int body = name != NULL ? kt_body_of_joint(model, name) : -1;
    if (body > 0)
        kt_put_integer(out, NULL, body);
}

/* Writes the bodies of loops between joints, because such loops are invisible. */
static void put_related(kt_json_writer *out, const kt_motion *motion, const kt_error *error) {
    const kt_description *d = &motion->scene->description;
    for (int i = 0; i < d->loop_count; i++)
        if (error_names(error, d->loops[i].name)) {
            put_found(out, motion->model, d->loops[i].joint);
            for (int k = 0; k < d->loops[i].term_count; k++)
                put_found(out, motion->model, d->loops[i].terms[k].joint);
        }
}

/* Writes the elements that a failure names, as numbers of bodies and of `loops`. */
static void put_failure(kt_json_writer *out, const kt_motion *motion, const kt_error *error) {
    const kt_picture *picture = motion->picture;
    kt_put_open(out, "failed", '{');
    kt_put_text(out, "message", kt_words_of(error).text);
    kt_put_open(out, "bodies", '[');
    for (int body = 1; body < picture->body_count; body++)
        if (error_names(error, kt_body_name(motion->model, body)) ||
            error_names(error, kt_joint_name(motion->model, body)))
            kt_put_integer(out, NULL, body);
    put_related(out, motion, error);
    kt_put_close(out, ']');
    kt_put_open(out, "loops", '[');
    for (int i = 0; i < picture->loop_count; i++)
        if (error_names(error, picture->loops[i].name))
            kt_put_integer(out, NULL, i);
    kt_put_close(out, ']');
    kt_put_close(out, '}');
}

static void put_head(kt_json_writer *out, const kt_motion *motion, const kt_view *view) {
    const kt_picture *picture = motion->picture;
    kt_put_text(out, "version", kt_version());
    kt_put_text(out, "name", view->name);
    kt_put_text(out, "method", view->method);
    kt_put_integer(out, "frames", (long long)motion->count);
    kt_json_put_vector(out, "centre", motion->centre);
    kt_json_put_vector(out, "gravity", picture->gravity);
    if (picture->is_planar)
        kt_json_put_vector(out, "normal", picture->normal);
    else
        kt_put_null(out, "normal");
    kt_json_put_number(out, "size", picture->size);
    kt_json_put_number(out, "radius", picture->radius);
    kt_put_boolean(out, "overlay", view->is_overlay);
}

static void put_view_modes(kt_json_writer *out, const kt_motion *motion, const kt_view *view) {
    kt_put_open(out, "modes", '[');
    for (int i = 0; i < view->mode_count; i++) {
        const kt_view_mode *mode = &view->modes[i];
        kt_put_open(out, NULL, '{');
        kt_put_text(out, "title", mode->title);
        kt_json_put_number(out, "frequency", mode->frequency);
        kt_json_put_number(out, "rate", mode->rate);
        kt_json_put_number(out, "damping", mode->damping);
        kt_json_put_number(out, "amplitude", mode->amplitude);
        kt_json_put_number(out, "phase", mode->phase);
        kt_json_put_numbers(out, "screws", mode->screws, 12 * motion->picture->body_count);
        kt_put_close(out, '}');
    }
    kt_put_close(out, ']');
}

void kt_view_describe(kt_json_writer *out, const kt_motion *motion, const kt_view *view) {
    const kt_picture *picture = motion->picture;
    kt_put_open(out, NULL, '{');
    put_head(out, motion, view);
    put_list(out, "bodies", motion, picture->body_count, put_body);
    put_list(out, "solids", motion, picture->solid_count, put_solid);
    put_list(out, "joints", motion, picture->joint_count + picture->coordinate_count, put_joint);
    put_list(out, "loops", motion, picture->loop_count, put_view_loop);
    put_list(out, "relations", motion, picture->relation_count, put_relation);
    put_list(out, "effects", motion, picture->effect_count, put_effect);
    put_list(out, "planes", motion, picture->plane_count, put_plane);
    put_markers(out, motion, view);
    put_columns(out, motion);
    put_marks(out, view->marks);
    put_list(out, "arrows", motion, motion->force_count, put_view_force);
    kt_put_integer(out, "lines", motion->line_count);
    if (view->modes != NULL)
        put_view_modes(out, motion, view);
    if (view->failed != NULL)
        put_failure(out, motion, view->failed);
    if (view->notes != NULL)
        kt_put_json(out, "notes", view->notes);
    kt_put_close(out, '}');
}
