/* Finds contacts and joint limits that act in a state, and warns of those that a scene violates at its start. It also
 * warns of springs and attractions without a direction, and of wheels that lie flat at the start. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/penetration.h"
#include "advice/advice.h"

#include "kinetree/descriptor.h"
#include "picture/picture.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- one contact or limit ---------------------------------------------------------------------------------------- */

kt_penetration_name kt_name_penetration(const kt_effect *effect) {
    const char *of = effect->joint != NULL ? effect->joint : effect->between[0].body;
    kt_penetration_name name;
    if (effect->name != NULL && *effect->name != '\0')
        snprintf(name.text, sizeof name.text, "%s '%.70s' of '%.70s'", kt_effect_type_name(effect->type), effect->name,
                 of != NULL ? of : "world");
    else
        snprintf(name.text, sizeof name.text, "%s of '%.70s'", kt_effect_type_name(effect->type),
                 of != NULL ? of : "world");
    return name;
}

static int end_body_of(const kt_model *model, const kt_end *end) {
    return end->body != NULL ? kt_body_find(model, end->body) : 0;
}

static kt_vec3 end_point_of(const kt_model *model, const kt_data *data, const kt_end *end) {
    const int body = end_body_of(model, end),
              marker = end->marker != NULL ? kt_marker_find(model, body, end->marker) : -1;
    return kt_point_position(model, data, body, marker >= 0 ? kt_marker_at(model, body, marker) : end->at);
}

/* Returns the unit vector of an axis, which is given in the frame of an end, in the world's axes. */
static kt_vec3 end_direction_of(const kt_model *model, const kt_data *data, const kt_end *end, kt_vec3 axis) {
    const int body = end_body_of(model, end);
    kt_mat3 turn = kt_mat3_identity();
    if (kt_rotation_evaluate(&end->rotation, &turn, NULL) != KT_OK)
        return kt_vec3_make(0.0, 0.0, 0.0); /* not reached: the description has been checked */
    if (end->marker != NULL)
        turn = kt_mat3_multiply(kt_marker_rotation(model, body, kt_marker_find(model, body, end->marker)), turn);
    return kt_mat3_apply(kt_body_pose(model, data, body).rotation, kt_mat3_apply(turn, kt_vec3_normalize(axis)));
}

/* Returns the distance by which a sphere, or a disc (with an axle), reaches below its centre, m. */
static double sphere_reach_of(const kt_model *model, const kt_data *data, const kt_effect *effect, kt_vec3 normal) {
    if (kt_vec3_norm_wide(effect->axle) == 0.0)
        return effect->radius;
    const kt_vec3 axle = end_direction_of(model, data, &effect->between[0], effect->axle);
    return effect->radius * kt_vec3_norm(kt_vec3_cross(normal, axle));
}

bool kt_effect_can_penetrate(const kt_effect *effect) {
    return effect->type == KT_EFFECT_CONTACT || effect->type == KT_EFFECT_JOINT_LIMIT;
}

kt_penetration kt_penetration_of(const kt_model *model, const kt_data *data, const kt_description *d, int index,
                                 const double *q) {
    const kt_effect *effect = &d->effects[index];
    kt_penetration penetration = {.effect = effect};
    double exponent = 1.0;
    if (effect->type == KT_EFFECT_CONTACT) {
        const kt_vec3 apart =
            kt_vec3_sub(end_point_of(model, data, &effect->between[0]), end_point_of(model, data, &effect->between[1]));
        penetration.normal = end_direction_of(model, data, &effect->between[1], effect->axis);
        if (effect->radius2 > 0.0)
            penetration.depth = effect->radius + effect->radius2 - kt_vec3_norm(apart);
        else
            penetration.depth =
                sphere_reach_of(model, data, effect, penetration.normal) - kt_vec3_dot(penetration.normal, apart);
        exponent = effect->exponent;
    } else if (effect->type == KT_EFFECT_JOINT_LIMIT) {
        const double x = kt_effect_coordinate(model, data, q, index);
        penetration.body = kt_effect_body(model, index, 0);
        penetration.depth = fmax(effect->lower - x, x - effect->upper);
        penetration.is_length = kt_effect_is_sliding(model, index);
        penetration.is_below = x < effect->lower;
    }
    if (penetration.depth > 0.0) {
        penetration.force = effect->stiffness * pow(penetration.depth, exponent);
        penetration.energy = penetration.force * penetration.depth / (exponent + 1.0);
    }
    return penetration;
}

/* ---- initial state ----------------------------------------------------------------------------------------------- */

/* Data for the warnings about an initial state. */
typedef struct start {
    kt_warnings *warnings;
    const kt_scene *scene;
    const kt_model *model;
    kt_data *data;
    const double *q;
    double weight; /* of all bodies, N */
} start;

/* Returns an upper bound of the moment of all weights about a joint, N m. It is the sum of m g times the distance from
 * the joint, and holds for any direction of gravity. */
static double moment_of_weights(const start *s, int on) {
    const kt_description *d = &s->scene->description;
    const kt_vec3 axis = kt_body_pose(s->model, s->data, on).position;
    double sum = 0.0;
    for (int i = 0; i < d->body_count; i++) {
        const kt_body *body = &d->bodies[i];
        kt_vec3 com;
        kt_sym3 inertia;
        if (!kt_body_stands_still(d, body->name) && kt_body_inertia(body, &com, &inertia, NULL) == KT_OK) {
            const kt_vec3 at = kt_point_position(s->model, s->data, kt_body_find(s->model, body->name), com);
            sum += body->mass * kt_vec3_norm(d->gravity) * kt_vec3_norm(kt_vec3_sub(at, axis));
        }
    }
    return sum;
}

/* Warns of a limit with more than twice the force that weights can cause at rest. This force is the weight of all
 * bodies (prismatic joint), or the moment of their weights about the joint (revolute joint). */
static int warn_of_limit(const start *s, const kt_penetration *penetration) {
    const kt_effect *effect = penetration->effect;
    const char *unit = penetration->is_length ? "m" : "rad", *beyond = penetration->is_below ? "lower" : "upper";
    char remedy[200];
    if (!(penetration->force > 2.0 * (penetration->is_length ? s->weight : moment_of_weights(s, penetration->body))))
        return 0;
    snprintf(remedy, sizeof remedy, "Start the joint at %.6g %s or %s, or move '%s'",
             penetration->is_below ? effect->lower : effect->upper, unit, penetration->is_below ? "above" : "below",
             beyond);
    const kt_warning warning = kt_warning_at("starts_beyond_limit", 0.0, penetration->depth, unit, remedy);
    kt_warn(s->warnings, &warning, "%s starts %.3g %s beyond '%s', where it pushes with %.3g %s and stores %.3g J",
            kt_name_penetration(effect).text, penetration->depth, unit, beyond, penetration->force,
            penetration->is_length ? "N" : "N m", penetration->energy);
    return 1;
}

static void warn_of_contact(const start *s, const kt_penetration *penetration) {
    const kt_vec3 n = penetration->normal;
    char remedy[200];
    snprintf(remedy, sizeof remedy, "Start it %.3g m further along the plane's normal [%.3g, %.3g, %.3g]",
             penetration->depth, n.x + 0.0, n.y + 0.0, n.z + 0.0); /* adding 0.0 avoids -0 */
    const kt_warning warning = kt_warning_at("starts_in_contact", 0.0, penetration->depth, "m", remedy);
    kt_warn(
        s->warnings, &warning,
        "%s starts %.3g m inside its plane, where it pushes with %.3g N (all bodies weigh %.3g N) and stores %.3g J",
        kt_name_penetration(penetration->effect).text, penetration->depth, penetration->force, s->weight,
        penetration->energy);
}

static void warn_of_contacts(const start *s, const kt_penetration *deepest, int count, double force, double energy) {
    char remedy[300];
    snprintf(remedy, sizeof remedy, "Start them further along their planes' normals, %s by %.3g m",
             kt_name_penetration(deepest->effect).text, deepest->depth);
    const kt_warning warning = kt_warning_at("starts_in_contact", 0.0, deepest->depth, "m", remedy);
    kt_warn(s->warnings, &warning,
            "%d contacts start inside their planes, %s by %.3g m, the deepest, where they push with %.3g N together "
            "(all bodies weigh %.3g N) and store %.3g J",
            count, kt_name_penetration(deepest->effect).text, deepest->depth, force, s->weight, energy);
}

/* Warns of contacts with more than twice the weight of all bodies together; with less, the scene may be at rest. */
static int warn_of_all_contacts(const start *s) {
    const kt_description *d = &s->scene->description;
    kt_penetration deepest = {.effect = NULL};
    double force = 0.0, energy = 0.0;
    int count = 0;
    for (int i = 0; i < d->effect_count; i++) {
        const kt_penetration penetration = kt_penetration_of(s->model, s->data, d, i, s->q);
        if (d->effects[i].type != KT_EFFECT_CONTACT || penetration.depth <= 0.0)
            continue;
        count++;
        force += penetration.force;
        energy += penetration.energy;
        if (penetration.depth > deepest.depth)
            deepest = penetration;
    }
    if (count == 0 || !(force > 2.0 * s->weight))
        return 0;
    if (count == 1)
        warn_of_contact(s, &deepest);
    else
        warn_of_contacts(s, &deepest, count, force, energy);
    return 1;
}

static bool needs_direction(const kt_effect *effect) {
    return (effect->type == KT_EFFECT_SPRING && effect->stiffness > 0.0 && effect->length > 0.0) ||
           (effect->type == KT_EFFECT_ATTRACTION && effect->strength != 0.0);
}

/* Warns of a spring or an attraction whose ends coincide, up to the rounding of their positions. Its force has no
 * direction there, or one that rounding decides. */
static int warn_of_direction(const start *s, const kt_effect *effect) {
    const bool is_spring = effect->type == KT_EFFECT_SPRING;
    if (!needs_direction(effect))
        return 0;
    const kt_vec3 a = end_point_of(s->model, s->data, &effect->between[0]);
    const kt_vec3 b = end_point_of(s->model, s->data, &effect->between[1]);
    if (!(kt_vec3_norm(kt_vec3_sub(b, a)) <= 4.0 * DBL_EPSILON * (kt_vec3_norm(a) + kt_vec3_norm(b))))
        return 0;
    const kt_warning warning =
        kt_warning_at("no_direction", 0.0, is_spring ? effect->stiffness * effect->length : (double)NAN,
                      is_spring ? "N" : NULL, is_spring ? "Move one end, or set `length: 0`" : "Move one end");
    char size[60] = "";
    if (is_spring)
        snprintf(size, sizeof size, ", %.3g N,", warning.value);
    kt_warn(s->warnings, &warning, "%s has both ends at one point at the start: its force%s has no direction",
            kt_name_penetration(effect).text, size);
    return 1;
}

/* Warns of a wheel whose axle is normal to its plane: each point of its rim touches. A scene that leaves out `axis` or
 * `normal` often has such a wheel. */
static int warn_of_flat_wheel(const start *s, const kt_loop *loop) {
    if (loop->type != KT_LOOP_ROLLING)
        return 0;
    const kt_vec3 axle = end_direction_of(s->model, s->data, &loop->between[0], loop->axis);
    const kt_vec3 normal = end_direction_of(s->model, s->data, &loop->between[1], loop->axis2);
    if (kt_vec3_norm(kt_vec3_cross(normal, axle)) > 1e-6)
        return 0;
    const kt_warning warning = kt_warning_at(
        "flat_wheel", 0.0, (double)NAN, NULL,
        "Give `axis` the direction of the axle in the frame of the wheel, and `normal` that of the plane");
    kt_warn(s->warnings, &warning,
            "the wheel of loop '%s' lies flat at the start: its axle is along the normal of the plane, "
            "[%.3g, %.3g, %.3g], and no point of contact is lowest",
            loop->name, normal.x + 0.0, normal.y + 0.0, normal.z + 0.0);
    return 1;
}

/* Warns of flat wheels in the initial values. Assembly turns a wheel whose centre is at the height of its radius. */
static int warn_of_flat_wheels(const start *s) {
    const kt_description *d = &s->scene->description;
    double *state = kt_given_state(s->model);
    int count = 0;
    if (state != NULL && kt_kinematics_update(s->model, s->data, state, NULL, NULL, NULL) == KT_OK)
        for (int i = 0; i < d->loop_count; i++)
            count += warn_of_flat_wheel(s, &d->loops[i]);
    free(state);
    return count;
}

int kt_penetration_warn(kt_warnings *warnings, const kt_scene *scene, const kt_model *model, const double *q) {
    const kt_description *d = &scene->description;
    kt_vec3 center;
    start s = {.warnings = warnings, .scene = scene, .model = model, .q = q};
    bool any = false;
    int count = 0;
    for (int i = 0; i < d->effect_count; i++)
        any |= kt_effect_can_penetrate(&d->effects[i]) || needs_direction(&d->effects[i]);
    for (int i = 0; i < d->loop_count; i++)
        any |= d->loops[i].type == KT_LOOP_ROLLING;
    if (!any || kt_data_create(model, &s.data, NULL) != KT_OK)
        return 0;
    if (kt_kinematics_update(model, s.data, q, NULL, NULL, NULL) == KT_OK) {
        s.weight = kt_mass_center(model, s.data, &center) * kt_vec3_norm(d->gravity);
        count = warn_of_all_contacts(&s);
        for (int i = 0; i < d->effect_count; i++) {
            const kt_penetration penetration = kt_penetration_of(model, s.data, d, i, q);
            if (d->effects[i].type == KT_EFFECT_JOINT_LIMIT && penetration.depth > 0.0)
                count += warn_of_limit(&s, &penetration);
            count += warn_of_direction(&s, &d->effects[i]);
        }
    }
    count += warn_of_flat_wheels(&s);
    kt_data_free(s.data);
    return count;
}
