/* Equilibria relative to a rotating frame: steady rotations of a mechanism about the axis of one joint, in which all
 * other joints rest.
 *
 * With the angular velocity w = W n about the axis through p, a body of mass m, centre c and inertia I at rest in the
 * rotating frame is loaded by
 *
 *     m W^2 (1 - n n')(c - p)  at its centre,    -w x (I w).
 *
 * These loads depend on positions alone. With the joint held at its position and these loads on all bodies that the
 * joint carries, a relative equilibrium is an equilibrium, and the search of `equilibrium` finds it
 * (kt_equilibrium_find). The result is then a state of the original model, with the velocity W in the joint. Its modes
 * have gyroscopic forces.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/linear.h"

#include "command.h"
#include "kinetree/dynamics.h"
#include "kinetree/effect.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The loads on one body. */
typedef struct kt_rotating_load {
    kt_vec3 point, axis; /* of the axis of rotation */
    double square;       /* of the angular velocity */
    double mass;
    kt_sym3 inertia;
} kt_rotating_load;

typedef struct kt_rotating {
    const kt_description *of;
    int body; /* that the joint carries; of the description */
    kt_rotating_load load;
    kt_rotating_load *loads;
    kt_loop *loops;
    kt_effect *effects;
    kt_description description;
} kt_rotating;

static int load_body(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    const kt_rotating_load *l = user;
    const kt_vec3 arm = kt_vec3_sub(ends[0].point, l->point);
    const kt_vec3 out = kt_vec3_sub(arm, kt_vec3_scale(kt_vec3_dot(arm, l->axis), l->axis));
    const kt_vec3 own = kt_mat3_apply_transposed(ends[0].axes, l->axis);
    const kt_vec3 momentum = kt_mat3_apply(ends[0].axes, kt_sym3_apply(l->inertia, own));
    (void)t, (void)balance;
    wrenches[0].force = kt_vec3_scale(l->mass * l->square, out);
    wrenches[0].moment = kt_vec3_scale(-l->square, kt_vec3_cross(l->axis, momentum));
    return 0;
}

/* The index of a body in the description; -1: the world. */
static int find_description_body(const kt_description *d, const char *name) {
    for (int i = 0; i < d->body_count && name != NULL; i++)
        if (strcmp(d->bodies[i].name, name) == 0)
            return i;
    return -1;
}

/* Whether a body moves with the rotating one. */
static bool is_carried(const kt_rotating *r, int body) {
    for (int steps = 0; body >= 0 && steps <= r->of->body_count; steps++) {
        if (body == r->body)
            return true;
        body = find_description_body(r->of, r->of->bodies[body].parent);
    }
    return false;
}

/* Returns whether the axis of the joint is fixed in the world: no joint below it moves. */
static bool has_fixed_axis(const kt_rotating *r) {
    int body = find_description_body(r->of, r->of->bodies[r->body].parent);
    for (int steps = 0; body >= 0 && steps <= r->of->body_count; steps++) {
        if (r->of->bodies[body].joint.type != KT_JOINT_FIXED)
            return false;
        body = find_description_body(r->of, r->of->bodies[body].parent);
    }
    return true;
}

/* Holds the joint: a motion loop with its position replaces the loops that drive it. */
static void hold_joint(kt_rotating *r, const char *joint, double position) {
    int count = 0;
    for (int i = 0; i < r->of->loop_count; i++) {
        const kt_loop *loop = &r->of->loops[i];
        const bool drives = loop->type == KT_LOOP_MOTION && loop->joint != NULL && strcmp(loop->joint, joint) == 0;
        const bool rates =
            loop->type == KT_LOOP_RATES && loop->term_count == 1 && strcmp(loop->terms[0].joint, joint) == 0;
        if (!drives && !rates)
            r->loops[count++] = *loop;
    }
    r->loops[count] = kt_loop_default();
    r->loops[count].name = "rotating-frame";
    r->loops[count].type = KT_LOOP_MOTION;
    r->loops[count].joint = joint;
    r->loops[count++].function = kt_function_constant(position);
    r->description.loops = r->loops;
    r->description.loop_count = count;
}

static void load_bodies(kt_rotating *r) {
    int count = r->of->effect_count;
    for (int i = 0; i < count; i++)
        r->effects[i] = r->of->effects[i];
    for (int i = 0; i < r->of->body_count; i++) {
        kt_rotating_load *load = &r->loads[i];
        kt_effect *effect = &r->effects[count];
        kt_vec3 com;
        *load = r->load;
        load->mass = r->of->bodies[i].mass;
        if (!is_carried(r, i) || kt_body_inertia(&r->of->bodies[i], &com, &load->inertia, NULL) != KT_OK)
            continue;
        *effect = kt_effect_default();
        effect->type = KT_EFFECT_CUSTOM;
        effect->between[0].body = r->of->bodies[i].name;
        effect->between[0].at = com;
        effect->end_count = 1;
        effect->wrench = load_body;
        effect->user = load;
        count++;
    }
    r->description.effects = r->effects;
    r->description.effect_count = count;
}

/* The axis of rotation, and whether a frame that rotates about it can be in equilibrium. */
static int find_axis(kt_small_motion *motion, kt_rotating *r, const char *joint) {
    kt_error error = {0};
    int body = 0;
    kt_status status = kt_joint_find(motion->model, joint, &body, &error);
    if (status == KT_OK)
        status = kt_kinematics_update(motion->model, motion->data, motion->q, motion->v, NULL, &error);
    if (status != KT_OK)
        return kt_say_status(status, &error);
    const kt_coordinates at = kt_body_coordinates(motion->model, body);
    const kt_pose pose = kt_body_pose(motion->model, motion->data, body);
    r->body = kt_body_source(motion->model, body);
    if (at.type != KT_JOINT_REVOLUTE || !has_fixed_axis(r))
        return kt_misuse("--rotating: joint '%s' is not a revolute joint on the world, so that its axis is not fixed",
                         joint);
    const double speed = motion->v[at.v];
    const kt_vec3 axis = kt_vec3_normalize(kt_mat3_apply(pose.rotation, r->of->bodies[r->body].joint.axis));
    const double across = kt_vec3_norm(kt_vec3_cross(axis, r->of->gravity));
    if (speed == 0.0)
        return kt_misuse(
            "--rotating: joint '%s' has the velocity 0 at the start; give it a velocity in the scene, or by --set",
            joint);
    if (across > 1e-9 * kt_vec3_norm(r->of->gravity))
        return kt_misuse("--rotating: gravity is not along the axis of '%s', so that it changes in the rotating frame",
                         joint);
    r->load = (kt_rotating_load){.point = pose.position, .axis = axis, .square = speed * speed};
    hold_joint(r, joint, motion->q[at.q]);
    load_bodies(r);
    memset(motion->v, 0, (size_t)kt_model_nv(motion->model) * sizeof *motion->v);
    motion->v[at.v] = speed;
    return KT_EXIT_DONE;
}

static kt_status settle_held(kt_small_motion *motion, const kt_rotating *r, bool nearest, kt_error *error) {
    const kt_model_options compile = kt_compile_options(&motion->scene);
    kt_equilibrium_options options = kt_equilibrium_options_default();
    kt_model *model = NULL;
    kt_linearization *linearization = NULL;
    options.nearest = nearest;
    kt_status status = kt_model_compile(&r->description, &compile, &model, error);
    if (status == KT_OK)
        status = kt_linearization_create(model, NULL, &linearization, error);
    if (status == KT_OK)
        status = kt_equilibrium_find(linearization, &options, 0.0, motion->q, NULL, &motion->equilibrium, error);
    kt_linearization_free(linearization);
    kt_model_free(model);
    return status;
}

int kt_small_motion_rotate(kt_small_motion *motion, const char *joint, bool nearest) {
    const kt_description *d = &motion->scene.description;
    kt_rotating r = {.of = d, .description = *d};
    kt_error error = {0};
    r.loops = calloc((size_t)d->loop_count + 1, sizeof *r.loops);
    r.effects = calloc((size_t)d->effect_count + (size_t)d->body_count + 1, sizeof *r.effects);
    r.loads = calloc((size_t)d->body_count + 1, sizeof *r.loads);
    int code =
        r.loops != NULL && r.effects != NULL && r.loads != NULL ? find_axis(motion, &r, joint) : kt_say_no_memory(NULL);
    if (code == KT_EXIT_DONE)
        code = kt_say_status(settle_held(motion, &r, nearest, &error), &error);
    free(r.loops);
    free(r.effects);
    free(r.loads);
    motion->settled = code == KT_EXIT_DONE;
    return code;
}
