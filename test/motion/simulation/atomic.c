/* Changes of the state that are rejected leave nothing behind. The oracle is a twin simulation without any of these
 * calls. Every output and the whole later motion have the same bits. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "scenes.h"

static const char *const methods[] = {"rk4", "dopri5", "radau5", "ab4", "bdf2"};
enum { METHODS = sizeof methods / sizeof *methods, TICKS = 150, CALLS = 7 };
typedef enum scene { ARM, RUBBING_ARM, BALL, LIFT } scene;

typedef struct rig {
    kt_lone lone;
    kt_effect effect[2];
    kt_marker marker;
    kt_body body[2];
    kt_loop loop[2];
    kt_term term[2];
    kt_description *description;
} rig;

/* A ball that falls onto a plate, which a drive holds. */
static void make_lift(rig *r) {
    for (int i = 0; i < 2; i++) {
        r->loop[i] = kt_loop_default();
        r->body[i] = kt_body_of(i == 0 ? "ball" : "plate", NULL, KT_JOINT_PRISMATIC, 1.0);
        r->body[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        r->body[i].joint.position[0] = i == 0 ? 0.2 : 0.0;
        r->term[i] = (kt_term){.joint = r->body[i].name, .coefficient = i == 0 ? 1.0 : -1.0};
    }
    r->loop[0].name = "drive";
    r->loop[0].type = KT_LOOP_MOTION;
    r->loop[0].joint = "plate";
    r->loop[0].function = kt_function_ramp(0.0, 0.05, 0.2, 0.8);
    r->loop[1].name = "touch";
    r->loop[1].type = KT_LOOP_COUPLING;
    r->loop[1].side = KT_SIDE_ABOVE;
    r->loop[1].terms = r->term;
    r->loop[1].term_count = 2;
    r->lone.description = kt_description_default();
    r->description = &r->lone.description;
    r->description->gravity = kt_vec3_make(0.0, 0.0, -9.81);
    r->description->bodies = r->body;
    r->description->body_count = r->description->loop_count = 2;
    r->description->loops = r->loop;
}

/* An arm between two stops; with friction that sticks; a ball that bounces, slides and rolls on a plane; or that
 * lift. */
static void make_rig(rig *r, scene which) {
    if (which == LIFT) {
        make_lift(r);
        return;
    }
    kt_lone_make(&r->lone, which == BALL ? KT_JOINT_FREE : KT_JOINT_REVOLUTE, 1.0);
    r->description = &r->lone.description;
    r->description->gravity = which == BALL ? kt_vec3_make(1.0, 0.0, -9.81) : kt_vec3_make(0.0, -9.81, 0.0);
    r->effect[0] = r->effect[1] = kt_effect_default();
    r->effect[0].name = "stop";
    r->effect[0].restitution = 0.3;
    r->description->effects = r->effect;
    r->description->effect_count = which == RUBBING_ARM ? 2 : 1;
    if (which == BALL) {
        r->marker = (kt_marker){.name = "centre"};
        r->lone.body.markers = &r->marker;
        r->lone.body.marker_count = 1;
        r->lone.body.inertia = kt_sym3_make(0.004, 0.004, 0.004, 0.0, 0.0, 0.0);
        r->lone.body.joint.position[2] = 0.15;
        r->effect[0].type = KT_EFFECT_CONTACT;
        r->effect[0].between[0].body = r->lone.body.name;
        r->effect[0].between[0].marker = "centre";
        r->effect[0].radius = 0.1;
        r->effect[0].friction = 0.4;
        return;
    }
    r->lone.body.com = kt_vec3_make(0.0, -0.3, 0.0);
    r->lone.body.inertia = kt_sym3_make(0.01, 0.01, 0.01, 0.0, 0.0, 0.0);
    r->lone.body.joint.position[0] = 0.3;
    r->effect[0].type = KT_EFFECT_JOINT_LIMIT;
    r->effect[0].joint = r->lone.body.name;
    r->effect[0].lower = -0.5;
    r->effect[0].upper = 0.5;
    r->effect[1].name = "friction";
    r->effect[1].type = KT_EFFECT_JOINT_FRICTION;
    r->effect[1].joint = r->lone.body.name;
    r->effect[1].coulomb = 0.5;
    r->effect[1].stick = true;
}

/* Gravity is set twice, and can have its new numbers. The last parameter is rejected: a mass below zero at once.
 * The plate that jumps above the ball is rejected when loops have been closed and contacts are settled. */
static kt_status rejected_change(kt_simulation *s, kt_model *model, scene which, kt_error *error) {
    kt_parameter_change change[3] = {
        {.values = {0.0, 0.0, -3.0}}, {.values = {0.0, 0.0, -5.0}}, {.values = {which == LIFT ? 0.9 : -1.0}}};
    const kt_parameter_change before[3] = {change[0], change[1], change[2]};
    double now[2][KT_PARAMETER_MAX] = {{0.0}};
    char name[40] = "loop drive.position";
    if (which != LIFT)
        (void)snprintf(name, sizeof name, "%s.mass", kt_body_name(model, 1));
    if (kt_parameter_find(model, "gravity", &change[0].parameter, error) != KT_OK ||
        kt_parameter_find(model, name, &change[2].parameter, error) != KT_OK)
        return KT_OK;
    change[1].parameter = change[0].parameter;
    kt_status status = kt_parameter_get(model, &change[0].parameter, now[0], error);
    const kt_status rejection = kt_simulation_change(s, model, change, 3, NULL, error);
    if (status == KT_OK)
        status = kt_parameter_get(model, &change[0].parameter, now[1], NULL);
    const bool same = memcmp(now[0], now[1], sizeof now[0]) == 0 &&
                      memcmp(change[0].values, before[0].values, sizeof before[0].values) == 0 &&
                      memcmp(change[1].values, before[1].values, sizeof before[1].values) == 0 &&
                      memcmp(change[2].values, before[2].values, sizeof before[2].values) == 0;
    return status == KT_OK && same ? rejection : KT_OK;
}

/* A call that is rejected; the state is beyond a boundary, or is not finite. */
static kt_status rejected_call(kt_simulation *s, kt_model *model, scene which, int call, kt_error *error) {
    double q[7], v[6], bad[6] = {0.0};
    memcpy(q, kt_simulation_positions(s), (size_t)kt_model_nq(model) * sizeof *q);
    memcpy(v, kt_simulation_velocities(s), (size_t)kt_model_nv(model) * sizeof *v);
    bad[kt_model_nv(model) - 1] = (double)NAN;
    if (call == 3 || call == 5)
        q[0] = (double)NAN;
    else
        q[which == BALL ? 2 : 0] = which == BALL || which == LIFT ? -0.3 : 0.9;
    switch (call) {
    case 0:
        return kt_simulation_jump(s, q, NULL, error);
    case 1:
        return kt_simulation_set_state(s, 7.0, q, v, error);
    case 2:
        return kt_simulation_jump(s, NULL, bad, error);
    case 3:
        return kt_simulation_jump(s, q, NULL, error);
    case 4:
        return kt_simulation_set_state(s, 0.0, kt_simulation_positions(s), bad, error);
    case 5:
        return kt_simulation_set_state(s, 0.0, q, NULL, error);
    default:
        return rejected_change(s, model, which, error);
    }
}

/* Whether all outputs of two simulations have the same bits. */
static bool are_equal(kt_simulation *a, kt_simulation *b) {
    const size_t size = kt_simulation_state_size(a), nv = (size_t)kt_model_nv(kt_simulation_model(a));
    const size_t nq = (size_t)kt_model_nq(kt_simulation_model(a));
    char *one = malloc(size), *two = malloc(size);
    double x[2][6];
    kt_error error;
    bool equal = size == kt_simulation_state_size(b) && one != NULL && two != NULL;
    if (equal) {
        kt_simulation_save(a, one);
        kt_simulation_save(b, two);
        equal = memcmp(one, two, size) == 0;
    }
    free(one);
    free(two);
    const kt_simulation_counts i = kt_simulation_counts_of(a), j = kt_simulation_counts_of(b);
    const kt_contact_counts k = kt_simulation_contacts(a), l = kt_simulation_contacts(b);
    const kt_work v = kt_simulation_work(a), w = kt_simulation_work(b);
    const kt_status first = kt_simulation_acceleration(a, x[0], &error),
                    last = kt_simulation_acceleration(b, x[1], &error);
    return equal && first == last && (first != KT_OK || memcmp(x[0], x[1], nv * sizeof(double)) == 0) &&
           kt_simulation_time(a) == kt_simulation_time(b) && memcmp(&v, &w, sizeof v) == 0 &&
           memcmp(kt_simulation_positions(a), kt_simulation_positions(b), nq * sizeof(double)) == 0 &&
           memcmp(kt_simulation_velocities(a), kt_simulation_velocities(b), nv * sizeof(double)) == 0 &&
           i.steps == j.steps && i.rejected == j.rejected && i.evaluations == j.evaluations &&
           i.factorizations == j.factorizations && i.jacobians == j.jacobians && i.capped == j.capped &&
           i.iterations.position == j.iterations.position && i.iterations.velocity == j.iterations.velocity &&
           k.impacts == l.impacts && k.closings == l.closings && k.openings == l.openings && k.sticks == l.sticks &&
           k.slips == l.slips && k.pivots == l.pivots && memcmp(&k.dissipated, &l.dissipated, sizeof(double)) == 0 &&
           kt_simulation_released(a) == kt_simulation_released(b);
}

/* Counts of failures. */
typedef struct failures {
    int taken, differ, ticks, closings, sticks;
} failures;

static void compare(scene which, const char *method, double step, bool balanced, int call, failures *f) {
    rig r;
    make_rig(&r, which);
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = method;
    run.step = step;
    options.record = balanced ? KT_RECORD_BALANCE : 0;
    options.watch_works = !balanced && call % 2 == 0;
    kt_model_options settable = kt_model_options_default();
    settable.settable = true;
    kt_model *model = kt_test_model(r.description, &settable), *other = kt_test_model(r.description, &settable);
    kt_simulation *a = kt_test_simulation(model, &run, &options);
    kt_simulation *b = kt_test_simulation(other, &run, &options);
    kt_error error = {0};
    for (int k = 0; k < TICKS; k++) {
        const double tau[6] = {which == BALL || which == LIFT ? 0.0 : 4.0 * sin(0.05 * k)};
        bool fine = kt_simulation_set_torque(a, tau, NULL) == KT_OK && kt_simulation_set_torque(b, tau, NULL) == KT_OK;
        f->taken += rejected_call(a, model, which, call, &error) == KT_OK;
        f->differ += !are_equal(a, b);
        fine = fine && kt_fine("tick", kt_simulation_tick(a, 0.01, &error), &error);
        fine = fine && kt_fine("twin", kt_simulation_tick(b, 0.01, &error), &error);
        f->differ += !fine || !are_equal(a, b);
        f->ticks += fine;
        if (!fine)
            break;
    }
    f->closings += (int)kt_simulation_contacts(a).closings;
    f->sticks += (int)kt_simulation_contacts(a).sticks;
}

static void compare_all(scene which) {
    for (int call = 0; call < CALLS; call++) {
        failures f = {0};
        int runs = 0;
        for (int m = 0; m < METHODS; m++)
            for (int balanced = 0; balanced < 2; balanced++) {
                compare(which, methods[m], 1e-3, balanced, call, &f);
                runs++;
                if (kt_method_find(methods[m])->embedded_order > 0) {
                    compare(which, methods[m], 0.0, balanced, call, &f);
                    runs++;
                }
            }
        kt_check_equal_int("calls that are not rejected", f.taken, 0);
        kt_check_equal_int("comparisons that differ", f.differ, 0);
        kt_check_equal_int("ticks", f.ticks, runs * TICKS);
        kt_check_above("closings", f.closings, runs);
        if (which == RUBBING_ARM || which == BALL)
            kt_check_above("sticks", f.sticks, runs);
    }
}

KT_TEST(rejected_changes_leave_an_arm_between_stops_as_it_was) { compare_all(ARM); }
KT_TEST(rejected_changes_leave_friction_that_sticks_as_it_was) { compare_all(RUBBING_ARM); }
KT_TEST(rejected_changes_leave_a_ball_on_a_plane_as_it_was) { compare_all(BALL); }
KT_TEST(rejected_changes_leave_a_ball_on_a_driven_plate_as_it_was) { compare_all(LIFT); }
