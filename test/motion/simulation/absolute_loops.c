/* Mechanisms with loops and effects move alike in both formulations. This includes relations and effects that refer to
 * the position of a joint, although a free body has no such position.
 *
 * Steps are so short that the results differ only by rounding. Bounds are five times the measured differences.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "both.h"

#include <math.h>

static kt_body make_body(const char *name, const char *parent, kt_joint_type type, double x, double y) {
    kt_body body = kt_body_of(name, parent, type, 1.0);
    body.joint.at = kt_vec3_make(x, y, 0.0);
    body.com = kt_vec3_make(0.2, 0.1, -0.05);
    body.inertia = kt_sym3_make(0.1, 0.15, 0.2, 0.01, -0.02, 0.03);
    return body;
}

static kt_loop make_loop(const char *name, kt_loop_type type, const char *first, const char *second) {
    kt_loop loop = kt_loop_of(name, type);
    loop.between[0] = loop.between[1] = kt_end_default();
    loop.between[0].body = first;
    loop.between[1].body = second;
    return loop;
}

static kt_effect make_effect(kt_effect_type type, const char *joint) {
    kt_effect effect = kt_effect_of(type, joint);
    return effect;
}

static kt_description describe(const kt_body *bodies, int body_count, const kt_loop *loops, int loop_count,
                               const kt_effect *effects, int effect_count) {
    kt_description d = kt_description_default();
    d.gravity = kt_vec3_make(0.5, -9.0, 2.0);
    kt_describe(&d, bodies, body_count, loops, loop_count, effects, effect_count);
    return d;
}

/* Half a second, by each reduction. No function of time has a corner: there a step errs, and projections differ in
 * where they put that. */
static void follow(const kt_description *d, const kt_both_bounds *bounds) {
    static const char *const names[] = {"qr", "partition", "svd"};
    static kt_both_trace tree, other;
    kt_both_worst worst = kt_both_worst_make();
    kt_residual open = {0.0, 0.0};
    kt_run run = kt_run_fixed("dop853", 0.002, 0.5);
    run.interval = 0.01;
    for (int r = 0; r < 3; r++) {
        kt_model_options options = kt_model_options_default();
        options.reduction = kt_reduction_method_of((kt_reduction)r);
        kt_absolute *absolute = NULL;
        kt_model *model = kt_both_compile(d, &options, &absolute);
        if (model && kt_both_run(model, NULL, run, &tree) && kt_both_run(model, absolute, run, &other))
            kt_both_compare(&worst, names[r], &tree, &other, bounds);
        open.position = fmax(open.position, other.constraint.position);
        open.velocity = fmax(open.velocity, other.constraint.velocity);
    }
    kt_both_check(&worst);
    kt_check_below("closure, positions", open.position, 4e-14);
    kt_check_below("closure, velocities", open.velocity, 1e-12);
}

/* Redundant: a planar linkage in space. Damper and motor on its crank, a spring across it. */
KT_TEST(four_bar_linkage_moves_alike) {
    kt_body bodies[3] = {make_body("crank", NULL, KT_JOINT_REVOLUTE, 0.0, 0.0),
                         make_body("coupler", "crank", KT_JOINT_REVOLUTE, 0.5, 0.0),
                         make_body("rocker", NULL, KT_JOINT_REVOLUTE, 1.2, 0.0)};
    kt_loop loop = make_loop("close", KT_LOOP_REVOLUTE, "coupler", "rocker");
    kt_effect effects[3] = {make_effect(KT_EFFECT_JOINT_DAMPER, "crank"), make_effect(KT_EFFECT_MOTOR, "crank"),
                            make_effect(KT_EFFECT_SPRING, NULL)};
    loop.between[0].at = kt_vec3_make(1.1, 0.0, 0.0);
    loop.between[1].at = kt_vec3_make(0.9, 0.0, 0.0);
    bodies[0].joint.position[0] = 7.3; /* more than a turn */
    bodies[0].joint.velocity[0] = 3.0;
    bodies[1].joint.position[0] = -0.5;
    bodies[2].joint.position[0] = 1.2;
    effects[0].damping = 0.4;
    effects[1].torque = kt_function_sine(8.0, 2.0, 0.3, 1.0);
    effects[2].between[0] = effects[2].between[1] = kt_end_default();
    effects[2].between[0].body = "coupler";
    effects[2].between[1].at = kt_vec3_make(0.2, 1.5, 0.3);
    effects[2].stiffness = 50.0;
    effects[2].initial_length = true;
    const kt_description d = describe(bodies, 3, &loop, 1, effects, 3);
    const kt_both_bounds bounds = {4e-15, 6e-15, 1.5e-14, 1e-14, 0.0};
    follow(&d, &bounds);
}

/* A crank driven through turns, a coupler on two balls, a slider with an oblique guide and a length that grows. */
KT_TEST(driven_crank_moves_alike) {
    kt_body bodies[4] = {make_body("crank", NULL, KT_JOINT_REVOLUTE, 0.0, 0.0),
                         make_body("coupler", "crank", KT_JOINT_SPHERICAL, 0.4, 0.0),
                         make_body("slider", NULL, KT_JOINT_PRISMATIC, 1.6, 0.1),
                         make_body("bob", "slider", KT_JOINT_FREE, 0.1, 0.0)};
    kt_loop loops[3] = {make_loop("ball", KT_LOOP_SPHERICAL, "coupler", "slider"),
                        make_loop("drive", KT_LOOP_MOTION, NULL, NULL),
                        make_loop("rod", KT_LOOP_DISTANCE, "slider", "bob")};
    static const double course[] = {0.4, 31.0, -9.0, 4.0};
    loops[0].between[0].at = kt_vec3_make(1.2, 0.0, 0.0);
    loops[1].joint = "crank";
    loops[1].function = kt_function_polynomial(course, 4);
    loops[2].function = kt_function_sine(0.1, 1.5, 0.0, 0.5);
    bodies[0].joint.axis = kt_vec3_make(0.1, -0.2, 1.0);
    bodies[0].joint.position[0] = 0.4;
    bodies[2].joint.axis = kt_vec3_make(1.0, 0.2, 0.1);
    bodies[2].joint.rotation = kt_rotation_rpy(0.1, -0.2, 0.05);
    bodies[3].joint.position[1] = -0.5;
    bodies[3].joint.position[3] = 1.0;
    const kt_description d = describe(bodies, 4, loops, 3, NULL, 0);
    const kt_both_bounds bounds = {8e-14, 1.2e-12, 2e-12, 4e-13, 5e-13};
    follow(&d, &bounds);
}

/* Relations of angles and lengths that lie several turns apart, a prescribed slide and a prescribed screw; the gears
 * sit on a carrier that swings. */
KT_TEST(gears_and_screws_move_alike) {
    kt_body bodies[6] = {make_body("carrier", NULL, KT_JOINT_UNIVERSAL, 0.0, 0.0),
                         make_body("sun", "carrier", KT_JOINT_REVOLUTE, 0.3, 0.0),
                         make_body("planet", "carrier", KT_JOINT_REVOLUTE, -0.3, 0.2),
                         make_body("rack", "carrier", KT_JOINT_PRISMATIC, 0.0, 0.4),
                         make_body("nut", NULL, KT_JOINT_SCREW, 1.0, 0.0),
                         make_body("piston", "planet", KT_JOINT_PRISMATIC, 0.1, 0.1)};
    kt_loop loops[4] = {
        make_loop("gear", KT_LOOP_COUPLING, NULL, NULL), make_loop("teeth", KT_LOOP_COUPLING, NULL, NULL),
        make_loop("stroke", KT_LOOP_MOTION, NULL, NULL), make_loop("thread", KT_LOOP_MOTION, NULL, NULL)};
    static const kt_term gear[2] = {{"sun", 1.0}, {"planet", 2.5}},
                         teeth[3] = {{"rack", 4.0}, {"sun", -0.3}, {"nut", 0.01}};
    static const double thread[] = {9.0, 5.0, 80.0};
    kt_effect effects[4] = {make_effect(KT_EFFECT_MOTOR, "sun"), make_effect(KT_EFFECT_JOINT_DAMPER, "rack"),
                            make_effect(KT_EFFECT_JOINT_DAMPER, "nut"), make_effect(KT_EFFECT_MOTOR, "piston")};
    bodies[0].joint.axis = kt_vec3_make(0.0, 1.0, 1.0);
    bodies[0].joint.axis2 = kt_vec3_make(1.0, 0.0, 0.4); /* oblique: a cross between */
    bodies[0].joint.velocity[1] = 1.0;
    bodies[1].joint.position[0] = 25.0;
    bodies[1].joint.velocity[0] = 30.0;
    bodies[2].joint.position[0] = -11.0;
    bodies[2].joint.axis = kt_vec3_make(0.1, 0.0, -1.0);
    bodies[3].joint.axis = kt_vec3_make(1.0, 0.3, 0.0);
    bodies[4].joint.pitch = 0.05;
    bodies[4].joint.position[0] = 9.0;
    loops[0].terms = gear;
    loops[0].term_count = 2;
    loops[0].offset = -2.0;
    loops[1].terms = teeth;
    loops[1].term_count = 3;
    loops[1].offset = -6.0;
    loops[2].joint = "piston";
    loops[2].function = kt_function_sine(0.2, 3.0, 0.0, 0.1);
    loops[3].joint = "nut";
    loops[3].function = kt_function_polynomial(thread, 3);
    effects[0].torque = kt_function_constant(3.0);
    effects[1].damping = 2.0;
    effects[2].damping = 0.1;
    effects[3].torque = kt_function_constant(1.0);
    const kt_description d = describe(bodies, 6, loops, 4, effects, 4);
    /* Energies are quadratic in velocities: twice their bound. */
    const kt_both_bounds bounds = {3e-15, 5e-15, 6e-14, 2.0 * 5e-15, 2e-14};
    follow(&d, &bounds);
}

/* A wheel that rolls on a tilted plate, which itself rocks; and an arm of fixed pieces, one of them without mass. */
KT_TEST(rolling_wheel_and_fixed_pieces_move_alike) {
    kt_body bodies[5] = {
        make_body("plate", NULL, KT_JOINT_REVOLUTE, 0.0, 0.0), make_body("wheel", NULL, KT_JOINT_FREE, 0.0, 0.0),
        make_body("post", "plate", KT_JOINT_FIXED, 0.2, 0.3), make_body("arm", "post", KT_JOINT_PLANAR, 0.0, 0.2),
        make_body("tip", "arm", KT_JOINT_FIXED, 0.4, 0.0)};
    kt_loop loops[2] = {make_loop("roll", KT_LOOP_ROLLING, "wheel", "plate"),
                        make_loop("slot", KT_LOOP_INLINE, NULL, "tip")};
    bodies[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.1);
    bodies[0].joint.velocity[0] = 0.3;
    bodies[1].joint.position[2] = 0.25;
    bodies[1].joint.position[3] = 1.0;
    bodies[1].joint.velocity[0] = 1.0;
    bodies[1].joint.velocity[4] = 4.0;
    bodies[1].com = kt_vec3_make(0.02, 0.0, 0.01);
    bodies[3].joint.rotation = kt_rotation_rpy(0.3, 0.2, 0.5);
    bodies[3].joint.position[2] = 8.0;
    bodies[3].joint.velocity[2] = 2.0;
    bodies[4].mass = 0.0;
    bodies[4].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    loops[0].axis = kt_vec3_make(0.0, 1.0, 0.0);
    loops[0].axis2 = kt_vec3_make(0.0, 0.0, 1.0);
    loops[0].radius = 0.25;
    loops[0].holonomic = true;
    loops[1].axis = kt_vec3_make(0.3, 1.0, 0.2);
    loops[1].between[0].at = kt_vec3_make(0.3, 0.6, 0.1);
    kt_description d = describe(bodies, 5, loops, 2, NULL, 0);
    d.gravity = kt_vec3_make(0.5, 2.0, -9.0);
    const kt_both_bounds bounds = {6e-15, 2e-14, 6e-14, 2e-14, 5e-14};
    follow(&d, &bounds);
}
