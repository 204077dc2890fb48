/* Effects in derivatives, powers and at singular positions, against closed forms. Impossible computations are
 * reported. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/effect.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const kt_vec3 none = {0.0, 0.0, 0.0}, down = {0.0, -1.0, 0.0};

/* An effect of the caller's on a joint, or on a body: rejects beyond `reach`, and may be heard of power that is none.
 */
typedef struct owner {
    double reach, force, dissipated, supplied;
    int code;
} owner;

static int drive(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    const owner *o = user;
    (void)t;
    (void)v;
    *force = o->force;
    if (balance != NULL)
        *balance = (kt_effect_balance){.dissipated = o->dissipated, .supplied = o->supplied};
    return fabs(q - 0.3) <= o->reach ? 0 : o->code;
}

static int push(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    const owner *o = user;
    (void)t;
    (void)ends;
    memset(wrenches, 0, sizeof *wrenches);
    wrenches[0].force.x = o->force;
    if (balance != NULL)
        *balance = (kt_effect_balance){.dissipated = o->dissipated, .supplied = o->supplied};
    return o->code;
}

static kt_effect own_effect(owner *o, bool on_body) {
    kt_effect effect = kt_effect_of(KT_EFFECT_CUSTOM, NULL);
    effect.user = o;
    if (on_body) {
        effect.between[0].body = "bar";
        effect.wrench = push;
        effect.end_count = 1;
    } else {
        effect.joint = "bar";
        effect.joint_force = drive;
    }
    return effect;
}

/* A bar of 1 kg and 1 m with these effects. It hangs at `0.3 rad` and turns at `2 rad/s`. */
static void make_bar(linkage *l, const kt_effect *effects, int count) {
    linkage_begin(l);
    linkage_bar(l, "bar", NULL, none, down, 0.3, 2.0);
    l->description.effects = effects;
    l->description.effect_count = count;
    linkage_compile(l);
}

typedef struct derivatives {
    double q[LINKAGE_BODIES], v[LINKAGE_BODIES], tau[LINKAGE_BODIES];
} derivatives;

static kt_status derive(const linkage *l, derivatives *d, bool with_tau, const double *tau, kt_error *e) {
    const size_t size = kt_acceleration_work_size(l->model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    const kt_status status = kt_acceleration_derivatives(l->model, l->data, work, size, 0.0, l->q, l->v, tau, NULL,
                                                         d->q, d->v, with_tau ? d->tau : NULL, e);
    free(work);
    return status;
}

/* `I q'' = tau - k (q - r) - c q' - m g / 2 sin q - d q'`, with `I = 1/3` and d of the drag at the end of the bar.
 * Differences of effects are good to some 1e-9. */
KT_TEST(springs_dampers_and_drag_have_their_derivatives) {
    static linkage l;
    kt_effect effects[2];
    derivatives d = {.tau = {77.0}};
    kt_error e = {0};
    effects[0] = kt_effect_of(KT_EFFECT_JOINT_SPRING, "bar");
    effects[0].stiffness = 7.0;
    effects[0].damping = 0.5;
    effects[1] = kt_effect_of(KT_EFFECT_DRAG, NULL);
    effects[1].between[0].body = "bar";
    effects[1].between[0].at = down;
    effects[1].linear = 0.25;
    make_bar(&l, effects, 2);
    const double tau = 1.5;
    kt_need_fine("derivatives", derive(&l, &d, true, &tau, &e), &e);
    kt_check_near("da/dq", d.q[0], -3.0 * (7.0 + 0.5 * 9.81 * cos(0.3)), 2e-13);
    kt_check_near("da/dv", d.v[0], -3.0 * (0.5 + 0.25), 1e-10);
    kt_check_near("da/dtau", d.tau[0], 3.0, 16.0 * DBL_EPSILON);
    d.tau[0] = 77.0;
    (void)kt_fine("without the last", derive(&l, &d, false, NULL, &e), &e);
    kt_check_near("nothing is written there", d.tau[0], 77.0, 0.0);
}

static void reject_derivatives(const linkage *l, kt_status expected, const char *where, const char *message) {
    derivatives d = {{77.0}, {77.0}, {77.0}};
    kt_error e = {KT_OK, "", ""};
    kt_check_equal_int("derivatives", derive(l, &d, true, NULL, &e), expected);
    kt_check_contains("where", e.where, where);
    kt_check_contains("message", e.message, message);
    kt_check_true("nothing is written", d.q[0] == 77.0 && d.v[0] == 77.0 && d.tau[0] == 77.0);
}

KT_TEST(derivatives_that_cannot_be_had_are_rejected) {
    static linkage l;
    owner o = {.reach = 0.0, .code = 2};
    kt_effect effect = own_effect(&o, false);
    kt_error e = {KT_OK, "", ""};
    double out[1] = {77.0};
    make_bar(&l, &effect, 1);
    kt_check_equal_int(
        "no memory",
        kt_acceleration_derivatives(l.model, l.data, NULL, 1 << 20, 0.0, l.q, l.v, NULL, NULL, out, out, out, &e),
        KT_ERROR_MEMORY);
    kt_check_contains("message", e.message, "kt_acceleration_work_size");
    reject_derivatives(&l, KT_ERROR_EFFECT, "effects[0] (custom) on joint 'bar'",
                       "its callback cannot compute its force here (code 2)"); /* at a neighbouring state */

    linkage_windows(&l, 2, acos(0.0), 1.0, KT_LOOP_REVOLUTE);
    linkage_compile(&l);
    reject_derivatives(&l, KT_ERROR_SINGULAR, "derivatives", "the loops are at a singular position, or next to one");
}

/* ---- powers ---------------------------------------------------------------------------------------------------------
 */

static void reject_power(const linkage *l, const kt_wrench *external, kt_status expected, const char *where,
                         const char *message) {
    double a[LINKAGE_BODIES] = {77.0};
    kt_power power = {77.0, 77.0};
    kt_error e = {KT_OK, "", ""};
    kt_check_equal_int("power", kt_power_evaluate(l->model, l->data, 0.5, l->q, l->v, NULL, external, a, &power, &e),
                       expected);
    kt_check_contains("where", e.where, where);
    kt_check_contains("message", e.message, message);
    kt_check_true("nothing is written", a[0] == 77.0 && power.supplied == 77.0 && power.dissipated == 77.0);
}

/* The one that is at fault is found among others, by its name or its number. */
KT_TEST(power_that_is_not_finite_is_its_effect_s) {
    static linkage l;
    for (int on_body = 0; on_body < 2; on_body++) {
        owner right = {.reach = 9.0, .force = 1.0}, wrong = {.reach = 9.0, .force = 1.0};
        kt_effect effects[2] = {own_effect(&right, on_body), own_effect(&wrong, on_body)};
        const char *where =
            on_body ? "effects[1] (custom) on body 'bar', t = 0.5 s" : "effects[1] (custom) on joint 'bar', t = 0.5 s";
        effects[0].name = "right";
        make_bar(&l, effects, 2);
        wrong.dissipated = HUGE_VAL;
        reject_power(&l, NULL, KT_ERROR_NOT_FINITE, where, "its callback gave a force or power that is not finite");
        wrong.dissipated = 0.0;
        wrong.supplied = (double)NAN;
        reject_power(&l, NULL, KT_ERROR_NOT_FINITE, where, "its callback gave a force or power that is not finite");
        wrong.supplied = 0.0;
        wrong.force = -HUGE_VAL;
        reject_power(&l, NULL, KT_ERROR_NOT_FINITE, where, "its callback gave a force or power that is not finite");
        wrong.force = 0.0;
        wrong.reach = -1.0;
        wrong.code = 5;
        reject_power(&l, NULL, KT_ERROR_EFFECT, where, "its callback cannot compute its force here (code 5)");
        wrong.code = -5;
        reject_power(&l, NULL, KT_ERROR_CALLBACK, where, "its callback stopped (code -5)");
        wrong.code = 0;
        kt_wrench external[2] = {{none, none}, {none, {0.0, HUGE_VAL, 0.0}}};
        reject_power(&l, external, KT_ERROR_NOT_FINITE, "'bar'", "the external wrench on it is not finite");
    }
}

/* A spring's force is not finite if its joint's position is not finite. The message names the position, not the
 * spring. */
KT_TEST(state_that_is_not_finite_is_told_before_its_effects) {
    static linkage l;
    kt_effect spring = kt_effect_of(KT_EFFECT_JOINT_SPRING, "bar");
    spring.name = "spring";
    spring.stiffness = 7.0;
    make_bar(&l, &spring, 1);
    l.q[0] = (double)NAN;
    reject_power(&l, NULL, KT_ERROR_NOT_FINITE, "'bar'", "position");
}

/* A four-bar pushed from outside and damped within: d(T + V)/dt = supplied - dissipated. */
KT_TEST(wrenches_supply_what_the_energies_of_a_loop_gain) {
    static linkage l;
    const four_bar f = four_bar_default();
    double a[3], q[3], v[3], energy[2];
    kt_wrench external[4] = {{none, none}, {{0.0, 0.0, 2.0}, none}, {none, {3.0, -1.0, 0.0}}, {none, none}};
    const double tau[3] = {0.5, -0.25, 1.0}, h = 1e-4;
    kt_power power = {0.0, 0.0};
    kt_error e = {0};
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    kt_need_fine("power", kt_power_evaluate(l.model, l.data, 0.0, l.q, l.v, tau, external, a, &power, &e), &e);
    for (int side = 0; side < 2; side++) { /* along the motion, to second order */
        const double dt = side ? h : -h;
        for (int k = 0; k < 3; k++) {
            q[k] = l.q[k] + dt * l.v[k] + 0.5 * dt * dt * a[k];
            v[k] = l.v[k] + dt * a[k];
        }
        kt_need_fine("kinematics", kt_kinematics_update(l.model, l.data, q, v, NULL, &e), &e);
        energy[side] = kt_kinetic_energy(l.model, l.data) + kt_potential_energy(l.model, l.data);
    }
    kt_check_near("dissipated", power.dissipated, 0.0, 0.0);
    kt_check_near("supplied", power.supplied, (energy[1] - energy[0]) / (2.0 * h), 1e-5);
}

/* ---- singular positions ------------------------------------------------------------------------------------------ */

/* One group at a singular position, and another that is not: each moves as it does alone. */
KT_TEST(group_beside_a_singular_one_moves_as_it_does_alone) {
    static linkage l, alone;
    const four_bar f = four_bar_default();
    double a[LINKAGE_BODIES], expected[LINKAGE_BODIES];
    linkage_four_bar(&alone, &f);
    linkage_build(&alone, 0.0);
    linkage_accelerate(&alone, 0.0, expected);
    linkage_windows(&l, 2, acos(0.0), 3.0, KT_LOOP_REVOLUTE);
    const int first = l.description.body_count;
    for (int k = 0; k < 3; k++) {
        kt_body *body = &l.body[first + k];
        *body = alone.body[k];
        body->joint.position[0] = alone.q[k];
        body->joint.velocity[0] = alone.v[k];
    }
    l.description.body_count += 3;
    l.loop[l.description.loop_count++] = alone.loop[0];
    linkage_compile(&l);
    linkage_accelerate(&l, 0.0, a);
    kt_check_equal_int("groups", kt_loop_group_count(l.model), 2);
    for (int k = 0; k < 3; k++) {
        const int at = kt_body_coordinates(l.model, kt_body_find(l.model, alone.body[k].name)).v;
        kt_check_near("next to it", a[at], expected[k], 1e-14 * fabs(expected[k]));
        char name[16];
        (void)snprintf(name, sizeof name, "crank%d", k);
        const int crank = kt_body_coordinates(l.model, kt_body_find(l.model, name)).v;
        /* cranks are counted clockwise: the joint's angle is -theta */
        kt_check_near("crank", a[crank], -windows_acceleration(2, acos(0.0)), 1e-9);
    }
}

/* Massless bars have no acceleration anywhere, at a singular position either. */
KT_TEST(massless_mechanism_at_a_singular_position_is_rejected) {
    static linkage l;
    linkage_windows(&l, 2, acos(0.0), 3.0, KT_LOOP_REVOLUTE);
    for (int i = 0; i < l.description.body_count; i++) {
        l.body[i].mass = 0.0;
        l.body[i].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    }
    linkage_compile(&l);
    double a[LINKAGE_BODIES] = {77.0};
    kt_error e = {KT_OK, "", ""};
    kt_check_equal_int("acceleration", kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, NULL, a, &e),
                       KT_ERROR_SINGULAR);
    kt_check_contains("message", e.message, "the mechanism has no positive inertia");
    kt_check_near("nothing is written", a[0], 77.0, 0.0);
}
