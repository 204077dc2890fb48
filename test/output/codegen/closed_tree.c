/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "closed_tree.h"
#include "text.h"

#include "kinetree/codegen.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const kt_loop_type kt_closed_types[KT_CLOSED_TYPES] = {
    KT_LOOP_SPHERICAL, KT_LOOP_REVOLUTE,  KT_LOOP_DISTANCE,   KT_LOOP_COUPLING,   KT_LOOP_INLINE,      KT_LOOP_INPLANE,
    KT_LOOP_PARALLEL,  KT_LOOP_COAXIAL,   KT_LOOP_WELD,       KT_LOOP_ORTHOGONAL, KT_LOOP_CYLINDRICAL, KT_LOOP_PLANAR,
    KT_LOOP_PRISMATIC, KT_LOOP_UNIVERSAL, KT_LOOP_MOTION,     KT_LOOP_SCREW,      KT_LOOP_HOMOKINETIC, KT_LOOP_SURFACE,
    KT_LOOP_CURVE,     KT_LOOP_ROLLING,   KT_LOOP_KNIFE_EDGE, KT_LOOP_RATES};

static const char *const loop_names[KT_CLOSED_LOOPS] = {"lock", "ring-2"};

/* A function with this value now; in half of the cases it depends on time. */
static kt_function draw_function(kt_random *random, double value) {
    const double size = kt_random_uniform(random, 0.1, 0.3), speed = kt_random_uniform(random, 0.5, 2.0);
    const double phase = kt_random_uniform(random, -3.0, 3.0);
    if (kt_random_int(random, 0, 1) == 0)
        return kt_function_constant(value);
    return kt_function_sine(size, speed, phase, value - size * sin(6.283185307179586 * speed * KT_CLOSED_NOW + phase));
}

/* A joint of one coordinate has a given motion. */
static bool draw_motion(kt_closed_tree *c, kt_random *random, int k) {
    kt_loop *loop = &c->loop[k];
    loop->type = KT_LOOP_MOTION;
    for (int tries = 0; tries < 50; tries++) {
        const int b = kt_random_int(random, 1, c->tree.count - 1);
        const kt_coordinates at = kt_body_coordinates(c->tree.model, b);
        loop->joint = c->tree.description.bodies[kt_body_source(c->tree.model, b)].name;
        loop->function = draw_function(random, c->state.q[at.q]);
        if (at.nv == 1)
            return true;
    }
    return false;
}

/* Two joints of one coordinate follow each other. In a plane, the first coupling also has a formula
 * of both positions, and every second one of the others has. */
static bool draw_coupling(kt_closed_tree *c, kt_random *random, int k) {
    kt_loop *loop = &c->loop[k];
    int count = 0;
    double position[2];
    loop->type = KT_LOOP_COUPLING;
    loop->terms = c->term[k];
    for (int tries = 0; tries < 50 && count < 2; tries++) {
        const int b = kt_random_int(random, 1, c->tree.count - 1);
        const kt_coordinates at = kt_body_coordinates(c->tree.model, b);
        const char *joint = c->tree.description.bodies[kt_body_source(c->tree.model, b)].name;
        if (at.nv != 1 || (count == 1 && joint == c->term[k][0].joint))
            continue;
        c->term[k][count] = (kt_term){joint, kt_random_uniform(random, 0.5, 2.0)};
        position[count] = c->state.q[at.q];
        loop->offset += c->term[k][count].coefficient * position[count];
        count++;
    }
    loop->term_count = count;
    const bool is_planar = kt_vec3_norm(c->tree.normal) > 0.0;
    if (count == 2 && (k == 0 ? is_planar : kt_random_int(random, 0, 1) == 0)) {
        const double size = kt_random_uniform(random, 0.05, 0.2);
        const char *const joint[2] = {c->term[k][0].joint, c->term[k][1].joint};
        snprintf(c->formula[k], sizeof c->formula[k], "%.17g*sin(position.%s)*position.%s^2 + exp(0.1*position.%s)",
                 size, joint[0], joint[1], joint[1]);
        loop->formula = c->formula[k];
        loop->offset += size * sin(position[0]) * position[1] * position[1] + exp(0.1 * position[1]);
    }
    return count == 2;
}

/* The rates of two joints of one coordinate depend on each other. */
static bool draw_rates(kt_closed_tree *c, kt_random *random, int k) {
    if (!draw_coupling(c, random, k))
        return false;
    c->loop[k].type = KT_LOOP_RATES;
    c->loop[k].formula = NULL;
    c->loop[k].offset = 0.0;
    c->loop[k].function = draw_function(random, kt_random_uniform(random, -1.0, 1.0));
    return true;
}

/* The axes of both ends in the world. In a planar tree one axis is its normal: that of the type for pins and the like,
 * and another one for slides and directions in the plane. */
static kt_mat3 draw_axes(const kt_closed_tree *c, kt_random *random, kt_loop_type type) {
    const bool planar = kt_vec3_norm(c->tree.normal) > 0.0;
    const kt_vec3 n =
        planar ? kt_vec3_scale(1.0 / kt_vec3_norm(c->tree.normal), c->tree.normal) : kt_tree_direction(random);
    const kt_vec3 across = kt_vec3_cross(n, kt_tree_direction(random));
    const kt_vec3 a = kt_vec3_scale(1.0 / kt_vec3_norm(across), across), b = kt_vec3_cross(n, a);
    const bool lies = type == KT_LOOP_INLINE || type == KT_LOOP_INPLANE || type == KT_LOOP_PRISMATIC ||
                      type == KT_LOOP_COAXIAL || type == KT_LOOP_KNIFE_EDGE || type == KT_LOOP_SURFACE ||
                      (type == KT_LOOP_CURVE && kt_random_int(random, 0, 1) == 0);
    return lies ? (kt_mat3){.x = b, .y = n, .z = a} : (kt_mat3){.x = a, .y = b, .z = n};
}

int kt_closed_count_forms(kt_loop_type type) {
    return type == KT_LOOP_SURFACE || type == KT_LOOP_CURVE ? 4 : type == KT_LOOP_ROLLING ? 2 : 0;
}

/* The form of a loop, from 0. */
static int form_of(const kt_closed_tree *c, kt_random *random, kt_loop_type type) {
    return c->form >= 0 ? c->form : kt_random_int(random, 0, kt_closed_count_forms(type) - 1);
}

/* A surface through a place, as seen from the first end. */
static void draw_surface(kt_random *random, int k, kt_vec3 *d, kt_loop *loop) {
    const kt_surface_type form = (kt_surface_type)(KT_SURFACE_PLANE + k);
    const double rho = sqrt(d->x * d->x + d->y * d->y);
    loop->surface.type = form;
    if (form == KT_SURFACE_PLANE)
        d->z = 0.0;
    if (form == KT_SURFACE_CYLINDER)
        loop->surface.radius = rho;
    if (form == KT_SURFACE_SPHERE)
        loop->surface.radius = kt_vec3_norm(*d);
    if (form != KT_SURFACE_TORUS)
        return;
    loop->surface.radius = rho * kt_random_uniform(random, 1.2, 1.5);
    d->z = fmax(fmin(d->z, 0.2 * rho), -0.2 * rho);
    const double s = rho - loop->surface.radius;
    loop->surface.tube = sqrt(s * s + d->z * d->z);
}

/* A line or a circle; the arc length is free or given. */
static void draw_curve(kt_random *random, bool is_line, bool is_driven, kt_vec3 *d, kt_loop *loop) {
    double length = d->z;
    loop->curve.type = is_line ? KT_TRACK_LINE : KT_TRACK_CIRCLE;
    if (is_line) {
        d->x = d->y = 0.0;
    } else {
        d->z = 0.0;
        loop->curve.radius = kt_vec3_norm(*d);
        length = loop->curve.radius * atan2(d->y, d->x);
    }
    if (is_driven)
        loop->function = draw_function(random, length);
}

/* The ends of a type whose points or axes are apart. pose: of both bodies; axes: those of the first end, in the world.
 */
static void part_ends(const kt_closed_tree *c, kt_random *random, const kt_pose pose[2], const kt_mat3 *axes,
                      kt_vec3 here, kt_loop *loop) {
    const bool planar = kt_vec3_norm(c->tree.normal) > 0.0;
    kt_vec3 d = kt_tree_vector(random, 0.3, 1.0), away;
    kt_mat3 second = *axes;
    if (loop->type == KT_LOOP_ROLLING) { /* the first end is the disc */
        const kt_vec3 n = planar ? axes->x : kt_tree_direction(random);
        const kt_vec3 a = axes->z, across = kt_vec3_cross(n, a);
        const double s = kt_vec3_norm(across);
        const kt_vec3 x = kt_vec3_scale(1.0 / s, across), y = kt_vec3_cross(n, x);
        loop->radius = kt_random_uniform(random, 0.2, 0.6);
        loop->holonomic = form_of(c, random, loop->type) == 0;
        second = (kt_mat3){.x = x, .y = y, .z = n};
        away = kt_vec3_sub(here, kt_vec3_scale(loop->radius * s, n));
        away = kt_vec3_add(away, kt_vec3_add(kt_vec3_scale(d.x, x), kt_vec3_scale(d.y, y)));
    } else {
        if (loop->type == KT_LOOP_SURFACE)
            draw_surface(random, form_of(c, random, loop->type), &d, loop);
        if (loop->type == KT_LOOP_CURVE) {
            const int form = form_of(c, random, loop->type);
            const bool is_line = planar ? fabs(kt_vec3_dot(axes->z, c->tree.normal)) < 0.1 : form % 2 == 0;
            draw_curve(random, is_line, form / 2 == 1, &d, loop);
        }
        const bool stays = loop->type == KT_LOOP_SCREW || loop->type == KT_LOOP_HOMOKINETIC;
        away = stays ? here : kt_vec3_add(here, kt_mat3_apply(*axes, d));
        if (loop->type == KT_LOOP_SCREW) {
            const double turn = kt_random_uniform(random, -3.0, 3.0), sine = sin(turn), cosine = cos(turn);
            second.x = kt_vec3_add(kt_vec3_scale(cosine, axes->x), kt_vec3_scale(sine, axes->y));
            second.y = kt_vec3_cross(axes->z, second.x);
            loop->pitch = kt_random_uniform(random, 0.02, 0.2);
        }
        if (loop->type == KT_LOOP_HOMOKINETIC && !planar)
            second = draw_axes(c, random, loop->type);
    }
    loop->between[1].at = kt_pose_apply(kt_pose_invert(pose[1]), away);
    loop->between[1].rotation = kt_rotation_matrix(kt_mat3_multiply(kt_mat3_transpose(pose[1].rotation), second));
}

/* The marker of one body, and the point and axes of another that are there; or a point at some distance. */
static bool draw_ends(kt_closed_tree *c, kt_random *random, int k, kt_loop_type type) {
    const kt_model *model = c->tree.model;
    kt_loop *loop = &c->loop[k];
    const int a = kt_random_int(random, 1, c->tree.count - 1), b = kt_random_int(random, 0, c->tree.count - 1);
    const kt_body *first = &c->tree.description.bodies[kt_body_source(model, a)];
    if (a == b)
        return false;
    const kt_pose pose[2] = {kt_body_pose(model, c->tree.data, a), kt_body_pose(model, c->tree.data, b)};
    const kt_vec3 here = kt_pose_apply(pose[0], first->markers[0].at);
    const kt_vec3 away = kt_vec3_add(here, kt_tree_vector(random, 0.5, 1.0));
    const kt_mat3 axes = draw_axes(c, random, type);
    loop->type = type;
    loop->axis = kt_vec3_make(0.0, 0.0, 1.0);
    loop->axis2 = kt_vec3_make(1.0, 0.0, 0.0);
    loop->between[0] = (kt_end){.body = first->name, .at = first->markers[0].at};
    loop->between[1] = (kt_end){.at = kt_pose_apply(kt_pose_invert(pose[1]), type == KT_LOOP_DISTANCE ? away : here)};
    if (b > 0)
        loop->between[1].body = c->tree.description.bodies[kt_body_source(model, b)].name;
    for (int i = 0; i < 2; i++)
        loop->between[i].rotation = kt_rotation_matrix(kt_mat3_multiply(kt_mat3_transpose(pose[i].rotation), axes));
    if (type >= KT_LOOP_ROLLING || type == KT_LOOP_SCREW)
        part_ends(c, random, pose, &axes, here, loop);
    if (type == KT_LOOP_ROLLING || type == KT_LOOP_KNIFE_EDGE)
        loop->axis2 = loop->axis;
    if (type == KT_LOOP_DISTANCE)
        loop->function = draw_function(random, kt_vec3_norm(kt_vec3_sub(away, here)));
    return true;
}

/* The given positions become those of the state, from which some types take their angle at the start. */
static void give_positions(kt_closed_tree *c) {
    for (int b = 1; b < c->tree.count; b++) {
        const kt_coordinates at = kt_body_coordinates(c->tree.model, b);
        kt_body *body = &c->tree.body[kt_body_source(c->tree.model, b)];
        memcpy(body->joint.position, c->state.q + at.q, (size_t)at.nq * sizeof *body->joint.position);
    }
}

/* Bytes of a source with the equations and the projection; compilers take minutes for more. */
enum { SOURCE_MOST = 3000000 };

bool kt_closed_is_generated(const kt_model *model) {
    const unsigned functions = KT_CODEGEN_LOOPS | KT_CODEGEN_PROJECT;
    kt_generated_text text;
    kt_error error = {0};
    if (kt_model_mobility(model).minimal < 1)
        return false;
    const kt_status status = kt_generate_text(model, "mech", functions, false, &text, &error);
    kt_generated_text_release(&text);
    return status == KT_OK && text.length <= SOURCE_MOST;
}

/* Draws loops until they are independent. */
static bool draw_loops(kt_closed_tree *c, kt_random *random, kt_loop_type type, int count) {
    kt_error error = {0};
    kt_tree_state_draw(&c->tree, random, &c->state);
    memset(c->state.external, 0, sizeof c->state.external);
    give_positions(c);
    for (int tries = 0; tries < 100; tries++) {
        bool fine = true;
        kt_tree_kinematics(&c->tree, &c->state);
        for (int k = 0; k < count && fine; k++) {
            const kt_loop_type own = k == 0 ? type : kt_closed_types[kt_random_int(random, 0, KT_CLOSED_TYPES - 1)];
            c->loop[k] = kt_loop_default();
            c->loop[k].name = loop_names[k];
            fine = own == KT_LOOP_COUPLING ? draw_coupling(c, random, k)
                   : own == KT_LOOP_RATES  ? draw_rates(c, random, k)
                   : own == KT_LOOP_MOTION ? draw_motion(c, random, k)
                                           : draw_ends(c, random, k, own);
        }
        if (!fine)
            continue;
        c->tree.description.loops = c->loop;
        c->tree.description.loop_count = count;
        kt_model *closed = NULL;
        if (kt_model_compile(&c->tree.description, NULL, &closed, &error) != KT_OK)
            continue;
        c->tree.model = closed;
        const kt_status status = kt_data_create(closed, &c->tree.data, &error);
        kt_tree_own(&c->tree);
        kt_need_fine("data", status, &error);
        if (kt_closed_is_generated(closed))
            return true;
    }
    return false;
}

bool kt_closed_grow(kt_closed_tree *c, kt_random *random, int n) {
    const bool planar = n / KT_CLOSED_TYPES % 2 == 0;
    kt_tree_plan plan = planar ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.bodies = kt_random_int(random, 4, planar ? 8 : 7);
    plan.massless = false;
    plan.one_plane = planar;
    plan.floats = !planar && n % 3 == 0;
    plan.with_armature = n % 4 < 2 ? 0.5 : 0.0;
    memset(c, 0, sizeof *c);
    c->form = -1;
    kt_tree_grow(&c->tree, &plan, random);
    return draw_loops(c, random, kt_closed_types[n % KT_CLOSED_TYPES], 1 + n % KT_CLOSED_LOOPS);
}

bool kt_closed_grow_form(kt_closed_tree *c, kt_random *random, kt_loop_type type, int form) {
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = kt_random_int(random, 3, 5);
    plan.massless = false;
    memset(c, 0, sizeof *c);
    c->form = form;
    kt_tree_grow(&c->tree, &plan, random);
    return draw_loops(c, random, type, 1);
}

/* ---- singular positions ------------------------------------------------------------------------------------------ */

/* M = L L': replaces the lower triangle. Returns false if a pivot is not positive. */
static bool factor_metric(double *mass, int n) {
    for (int j = 0; j < n; j++)
        for (int i = j; i < n; i++) {
            double sum = mass[i + n * j];
            for (int k = 0; k < j; k++)
                sum -= mass[i + n * k] * mass[j + n * k];
            if (i == j && !(sum > 0.0))
                return false;
            mass[i + n * j] = i == j ? sqrt(sum) : sum / mass[j + n * j];
        }
    return true;
}

static double dot_of(const double *x, const double *y, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

double kt_closed_least_direction(const kt_tree *tree, const kt_tree_state *s, const double *matrix, int m) {
    static double mass[KT_TREE_NV * KT_TREE_NV], row[KT_TREE_NV][KT_TREE_NV];
    const int n = tree->nv;
    double least = 1.0;
    kt_error error = {0};
    if (kt_dynamics_mass(tree->model, tree->data, s->q, mass, &error) != KT_OK || !factor_metric(mass, n))
        return 1.0;
    for (int r = 0; r < m; r++) {
        double *y = row[r];
        for (int i = 0; i < n; i++) {
            y[i] = matrix[r + m * i];
            for (int k = 0; k < i; k++)
                y[i] -= mass[i + n * k] * y[k];
            y[i] /= mass[i + n * i];
        }
        const double whole = dot_of(y, y, n);
        for (int k = 0; k < r; k++) {
            const double part = dot_of(y, row[k], n);
            for (int i = 0; i < n; i++)
                y[i] -= part * row[k][i];
        }
        const double normal = dot_of(y, y, n);
        least = fmin(least, normal / whole);
        for (int i = 0; i < n; i++)
            y[i] /= sqrt(normal);
    }
    return least;
}

double kt_closed_largest_part(const kt_tree *tree, const kt_tree_state *s, const double *a) {
    double cut[KT_TREE_NV], largest = 0.0;
    kt_error error = {0};
    const bool is_cut = kt_dynamics_forward(tree->model, tree->data, s->q, s->v, s->tau, NULL, cut, &error) == KT_OK;
    for (int i = 0; i < tree->nv; i++)
        largest = fmax(largest, is_cut ? fmax(fabs(cut[i]), fabs(a[i] - cut[i])) : fabs(a[i]));
    return largest;
}
