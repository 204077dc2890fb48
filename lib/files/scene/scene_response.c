/* Accelerations and reactions as variables of events. The values of such variables follow from an evaluation of the
 * equations of motion in the state at hand, under the torques and wrenches that are set. An event finds the instant at
 * which one of them passes a value as for a position.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_response.h"
#include "algebra/vector_parts.h"
#include "base/text.h"

#include "kinetree/descriptor.h"
#include "kinetree/dynamics.h"
#include "kinetree/expression.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "model/formula_names.h"
#include "model/joint_name.h"
#include "model/switching.h"
#include "scene/scene_part.h"
#include "simulation/response.h"

#include <stdio.h>
#include <string.h>

static const char *const wrench_names[] = {"fx", "fy", "fz", "mx", "my", "mz"};
static const char *const axis_names[] = {"x", "y", "z", "body_x", "body_y", "body_z"};
enum { COMPONENTS = 6 };

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* A name in parts: the name of its object, and its last word. */
typedef struct parts {
    kt_response_type type;
    char of[KT_EXPRESSION_NAME_MAX + 1];
    int component;
} parts;

/* Splits "OF.LAST" at its last dot, with a last word of the list. */
static bool split_response(const char *text, const char *const *words, parts *out) {
    const char *dot = strrchr(text, '.');
    if (dot == NULL || (size_t)(dot - text) >= sizeof out->of)
        return false;
    memcpy(out->of, text, (size_t)(dot - text));
    out->of[dot - text] = '\0';
    for (out->component = 0; out->component < COMPONENTS; out->component++)
        if (strcmp(dot + 1, words[out->component]) == 0)
            return true;
    return false;
}

/* Finds the velocity of the same joint, or of the same marker. */
static bool find_by_velocity(const kt_description *d, const char *name, kt_variable *variable) {
    char text[KT_EXPRESSION_NAME_MAX + 1];
    const size_t length = strlen(name);
    if (kt_text_begins(name, "acceleration.")) {
        (void)snprintf(text, sizeof text, "velocity.%s", name + 13);
        return kt_variable_find(d, text, variable) && variable->type == KT_VARIABLE_VELOCITY;
    }
    if (!kt_text_begins(name, "marker.") || length < 3 || length >= sizeof text || name[length - 2] != 'a' ||
        name[length - 3] != '.')
        return false;
    memcpy(text, name, length + 1);
    text[length - 2] = 'v';
    return kt_variable_find(d, text, variable) && variable->type == KT_VARIABLE_MARKER_VELOCITY;
}

/* Reactions and angular rates, whose names are in parts. */
static bool find_parts(const char *name, parts *out) {
    static const char *const multiplier[COMPONENTS] = {"multiplier", "", "", "", "", ""};
    out->type = KT_RESPONSE_ANGULAR_VELOCITY;
    if (kt_text_begins(name, "angular_velocity."))
        return split_response(name + 17, axis_names, out);
    out->type = KT_RESPONSE_ANGULAR_ACCELERATION;
    if (kt_text_begins(name, "angular_acceleration."))
        return split_response(name + 21, axis_names, out);
    out->type = KT_RESPONSE_JOINT_REACTION;
    if (!kt_text_begins(name, "reaction."))
        return false;
    if (split_response(name + 9, wrench_names, out))
        return true;
    out->type = KT_RESPONSE_MULTIPLIER;
    return split_response(name + 9, multiplier, out) && out->component == 0;
}

static int find_response_body(const kt_description *d, const char *name) {
    for (int i = 0; i < d->body_count; i++)
        if (d->bodies[i].name != NULL && strcmp(d->bodies[i].name, name) == 0)
            return i;
    return -1;
}

/* A loop, or the beginning of the name of a loop that belongs to an effect. */
static bool is_loop(const kt_description *d, const char *name) {
    if (kt_find_loop(d, name) >= 0)
        return true;
    for (int i = 0; i < d->effect_count; i++) {
        const char *effect = d->effects[i].name;
        const size_t length = effect != NULL ? strlen(effect) : 0;
        if (length > 0 && strncmp(name, effect, length) == 0 &&
            (name[length] == '\0' || strcmp(name + length, ".lower") == 0 || strcmp(name + length, ".upper") == 0))
            return true;
    }
    return false;
}

bool kt_response_is_named(const kt_description *d, const char *name) {
    kt_variable variable;
    parts p;
    if (find_by_velocity(d, name, &variable))
        return true;
    if (!find_parts(name, &p))
        return false;
    if (p.type == KT_RESPONSE_ANGULAR_VELOCITY || p.type == KT_RESPONSE_ANGULAR_ACCELERATION)
        return find_response_body(d, p.of) >= 0;
    return (p.type == KT_RESPONSE_JOINT_REACTION && kt_body_with_joint(d, p.of) >= 0) || is_loop(d, p.of);
}

/* The name of an acceleration, from that of the velocity. */
static bool name_by_velocity(const kt_description *d, const kt_variable *variable, char *text, size_t size) {
    char name[KT_EXPRESSION_NAME_MAX + 1];
    const int length = kt_variable_name(d, variable, name, sizeof name);
    if (length <= 2 || length >= (int)sizeof name)
        return false;
    if (variable->type == KT_VARIABLE_VELOCITY)
        (void)snprintf(text, size, "acceleration.%s", name + 9);
    name[length - 2] = 'a';
    if (variable->type == KT_VARIABLE_MARKER_VELOCITY)
        (void)snprintf(text, size, "%s", name);
    return true;
}

/* The names of one body: the reaction of its joint, and its angular velocity and acceleration. */
static void name_of_body(const kt_body *body, int k, char *text, size_t size) {
    const char *name = body->name != NULL ? body->name : "", *joint = kt_joint_name_of(body);
    if (k < COMPONENTS)
        (void)snprintf(text, size, "reaction.%s.%s", joint != NULL ? joint : "", wrench_names[k]);
    else
        (void)snprintf(text, size, "angular_%s.%s.%s", k < 2 * COMPONENTS ? "velocity" : "acceleration", name,
                       axis_names[k % COMPONENTS]);
}

bool kt_response_name(const kt_description *d, int k, char *text, size_t size) {
    kt_variable variable;
    for (int i = 0; kt_variable_at(d, i, &variable); i++)
        if ((variable.type == KT_VARIABLE_VELOCITY || variable.type == KT_VARIABLE_MARKER_VELOCITY) && k-- == 0)
            return name_by_velocity(d, &variable, text, size);
    if (k < 3 * COMPONENTS * d->body_count) {
        name_of_body(&d->bodies[k / (3 * COMPONENTS)], k % (3 * COMPONENTS), text, size);
        return true;
    }
    k -= 3 * COMPONENTS * d->body_count;
    if (k >= (COMPONENTS + 1) * d->loop_count)
        return false;
    const char *loop = d->loops[k / (COMPONENTS + 1)].name;
    const int component = k % (COMPONENTS + 1);
    (void)snprintf(text, size, "reaction.%s.%s", loop != NULL ? loop : "",
                   component < COMPONENTS ? wrench_names[component] : "multiplier");
    return true;
}

/* ---- in a model -------------------------------------------------------------------------------------------------- */

/* The acceleration that belongs to a velocity: of a coordinate, or of a marker. */
static kt_status bind_by_velocity(const kt_description *d, const kt_model *model, const kt_variable *variable,
                                  kt_event_response *out, kt_error *error) {
    const kt_body *body = &d->bodies[variable->body];
    const int item = kt_body_find(model, body->name);
    *out = (kt_event_response){.type = KT_RESPONSE_ACCELERATION, .component = variable->component};
    if (item <= 0)
        return kt_error_set(error, KT_ERROR_MODEL, "kt_scene_watch_create", "the model has no body '%s'", body->name);
    out->item = item;
    if (variable->type == KT_VARIABLE_VELOCITY) {
        out->item = kt_body_coordinates(model, item).v + variable->component;
        return KT_OK;
    }
    out->type = KT_RESPONSE_MARKER_ACCELERATION;
    out->point = kt_marker_at(model, item, kt_marker_find(model, item, body->markers[variable->marker].name));
    return KT_OK;
}

/* A relation of joints has no wrench, and a loop between ends has several multipliers. */
static bool has(const kt_model *model, int loop, kt_response_type type) {
    const kt_descriptor *descriptor = kt_loop_descriptor(kt_loop_type_of(model, loop));
    const bool joins_joints = kt_descriptor_kind(descriptor, KT_KEY_TERMS) != NULL;
    const bool drives = kt_descriptor_kind(descriptor, KT_KEY_JOINT) != NULL;
    return type == KT_RESPONSE_MULTIPLIER ? joins_joints || drives : !joins_joints;
}

kt_status kt_response_bind(const kt_description *d, const kt_model *model, const char *name, kt_event_response *out,
                           kt_error *error) {
    kt_variable variable;
    parts p = {.component = 0};
    if (find_by_velocity(d, name, &variable))
        return bind_by_velocity(d, model, &variable, out, error);
    if (!find_parts(name, &p))
        return kt_error_set(error, KT_ERROR_MODEL, "kt_scene_watch_create", "there is no '%s'", name);
    *out = (kt_event_response){.type = p.type, .component = p.component, .item = -1};
    const int joint = p.type == KT_RESPONSE_JOINT_REACTION ? kt_body_with_joint(d, p.of) : -1;
    if (joint >= 0) {
        out->item = kt_body_find(model, d->bodies[joint].name);
    } else if (p.type == KT_RESPONSE_ANGULAR_VELOCITY || p.type == KT_RESPONSE_ANGULAR_ACCELERATION) {
        out->item = kt_body_find(model, p.of);
    } else {
        out->type = p.type == KT_RESPONSE_MULTIPLIER ? p.type : KT_RESPONSE_LOOP_REACTION;
        const int loop = kt_loop_find(model, p.of);
        out->item = loop >= 0 && has(model, loop, out->type) ? loop : -1;
    }
    return out->item >= 0 ? KT_OK
                          : kt_error_set(error, KT_ERROR_SCENE, "kt_scene_watch_create",
                                         "the model has no '%s'; loops between points have fx to mz, and couplings and "
                                         "motions a multiplier",
                                         name);
}

/* The largest number of equations of any set of switches. */
static size_t most_equations(const kt_model *model) {
    size_t most = (size_t)kt_model_mobility(model).equations;
    for (uint64_t k = 0; model->variants != NULL && k < kt_variants_count(model->variants); k++) {
        const size_t rows = kt_variants_model(model->variants, k)->n.row;
        most = rows > most ? rows : most;
    }
    return most;
}

bool kt_responses_take(kt_pool *pool, const kt_model *model, kt_responses *responses) {
    const size_t loops = (size_t)kt_loop_count(model);
    responses->a = kt_pool_take(pool, (size_t)kt_model_nv(model) + 1, sizeof(double));
    responses->multiplier = kt_pool_take(pool, most_equations(model) + 1, sizeof(double));
    responses->joint = kt_pool_take(pool, (size_t)kt_model_body_count(model) + 1, sizeof(kt_wrench));
    responses->loop = kt_pool_take(pool, loops + 1, sizeof(kt_wrench));
    return responses->a != NULL && responses->multiplier != NULL && responses->joint != NULL && responses->loop != NULL;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static const unsigned velocities = 1U << KT_RESPONSE_ANGULAR_VELOCITY, multipliers = 1U << KT_RESPONSE_MULTIPLIER,
                      reactions = 1U << KT_RESPONSE_JOINT_REACTION | 1U << KT_RESPONSE_LOOP_REACTION;

bool kt_responses_are_stepped(const kt_responses *responses, unsigned bits) {
    return (bits & ~velocities) != 0 && kt_simulation_is_stepped(responses->simulation);
}

/* With time stepping, no evaluation of the model finds the forces of contacts. Records have them. */
static kt_status respond_as_records(kt_responses *responses, unsigned bits, const kt_instant *at, kt_error *error) {
    kt_simulation_response r = {.record = (bits & (reactions | multipliers)) != 0 ? KT_RECORD_REACTION : 0U,
                                .a = responses->a,
                                .joint = responses->joint,
                                .loop = responses->loop,
                                .multiplier = responses->multiplier};
    const kt_status status = kt_simulation_respond(responses->simulation, at, &r, error);
    responses->model = r.model;
    responses->data = r.data;
    return status == KT_OK ? kt_kinematics_update(at->model, at->data, at->q, at->v, NULL, error) : status;
}

kt_status kt_responses_evaluate(kt_responses *responses, unsigned bits, const kt_instant *at, kt_error *error) {
    const bool accelerates = (bits & ~velocities) != 0;
    if (kt_responses_are_stepped(responses, bits))
        return respond_as_records(responses, bits, at, error);
    double *x = kt_auxiliary_states(at->model, at->data);
    kt_status status = KT_OK;
    responses->model = at->model;
    responses->data = at->data;
    if (x != NULL && at->x != NULL && x != at->x)
        memmove(x, at->x, (size_t)kt_auxiliary_state_count(at->model) * sizeof *x);
    if (accelerates)
        status = kt_acceleration_evaluate(at->model, at->data, at->t, at->q, at->v, at->tau, at->external, responses->a,
                                          error);
    if (status == KT_OK && (bits & reactions) != 0)
        status = kt_reaction_evaluate(at->model, at->data, at->t, at->q, at->v, at->tau, at->external, responses->joint,
                                      responses->loop, error);
    if (status == KT_OK && (bits & multipliers) != 0)
        status = kt_multiplier_evaluate(at->model, at->data, at->t, at->q, at->v, at->tau, at->external,
                                        responses->multiplier, error);
    return status == KT_OK
               ? kt_kinematics_update(at->model, at->data, at->q, at->v, accelerates ? responses->a : NULL, error)
               : status;
}

/* In world axes, or in those of the body. */
static double turning(const kt_responses *of, const kt_event_response *r, kt_vec3 u) {
    const kt_vec3 w =
        r->component < 3 ? u : kt_mat3_apply_transposed(kt_body_pose(of->model, of->data, r->item).rotation, u);
    return kt_vec3_part(w, r->component % 3);
}

static double of_wrench(const kt_wrench *wrench, int k) {
    return kt_vec3_part(k < 3 ? wrench->force : wrench->moment, k % 3);
}

double kt_response_value(const kt_responses *responses, const kt_event_response *r) {
    const kt_model *model = responses->model;
    const kt_data *data = responses->data;
    kt_loop_rows rows;
    switch (r->type) {
    case KT_RESPONSE_ACCELERATION:
        return responses->a[r->item];
    case KT_RESPONSE_MARKER_ACCELERATION:
        return kt_vec3_part(kt_point_acceleration(model, data, r->item, r->point), r->component);
    case KT_RESPONSE_ANGULAR_VELOCITY:
        return turning(responses, r, kt_body_twist(model, data, r->item).angular);
    case KT_RESPONSE_ANGULAR_ACCELERATION:
        return turning(responses, r, kt_body_acceleration(model, data, r->item).angular);
    case KT_RESPONSE_JOINT_REACTION:
        return of_wrench(&responses->joint[r->item], r->component);
    case KT_RESPONSE_LOOP_REACTION:
        return of_wrench(&responses->loop[r->item], r->component);
    case KT_RESPONSE_MULTIPLIER:
        break;
    }
    rows = kt_loop_rows_of(model, r->item);
    return rows.count > 0 ? responses->multiplier[rows.first] : 0.0;
}
