/* Closed loops under the clock: assembled at the start, closed at every record, the motion that of the closed form.
 *
 * A parallelogram: the cranks are uniform rods of length l and mass n, on pivots at the same height. They carry a
 * coupler of mass m between their ends, which does not turn. It swings as a pendulum,
 *
 *     (2 n / 3 + m) l^2 u'' = -(n + m) g l sin u.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "scenes.h"
#include "swing.h"

#include <float.h>
#include <math.h>

static const double rod = 0.6, coupler = 1.5, length = 0.8, start = 1.1;

/* The error after projection, which stops within 64 eps of the mechanism's length (here 2.8 m). */
static const double projected = 64.0 * 2.8 * DBL_EPSILON;

typedef struct four_bar_frame {
    kt_body bodies[3];
    kt_loop loop;
    const char *hold[1];
    kt_description description;
} four_bar_frame;

static kt_body make_rod(const char *name, double x, double to) {
    kt_body body = kt_body_of(name, NULL, KT_JOINT_REVOLUTE, rod);
    body.joint.at = kt_vec3_make(x, 0.0, 0.0);
    body.joint.position[0] = start;
    body.shape.type = KT_SHAPE_ROD;
    body.shape.to = kt_vec3_make(0.0, -to, 0.0);
    body.com_of_shape = body.inertia_of_shape = true;
    return body;
}

/* The second crank and the coupler are given off by `error` rad, for assembly to put right. With cranks of unequal
 * lengths it is a four-bar linkage whose closure is not linear in its angles. */
static void fill_linkage(four_bar_frame *f, double error, double right) {
    f->bodies[0] = make_rod("left", 0.0, length);
    f->bodies[1] = make_rod("right", 2.0, right);
    f->bodies[1].joint.position[0] = start + error;
    f->bodies[2] = kt_body_of("coupler", "left", KT_JOINT_REVOLUTE, coupler);
    f->bodies[2].joint.at = kt_vec3_make(0.0, -length, 0.0);
    f->bodies[2].joint.position[0] = -start - error;
    f->bodies[2].com = kt_vec3_make(1.0, 0.0, 0.0);
    f->bodies[2].inertia = (kt_sym3){0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
    f->loop = kt_loop_of("close", KT_LOOP_REVOLUTE);
    f->loop.between[0] = kt_end_default();
    f->loop.between[0].body = "right";
    f->loop.between[0].at = kt_vec3_make(0.0, -right, 0.0);
    f->loop.between[1] = kt_end_default();
    f->loop.between[1].body = "coupler";
    f->loop.between[1].at = kt_vec3_make(2.0, 0.0, 0.0);
    f->hold[0] = "left";
    f->description = kt_description_default();
    f->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    kt_describe(&f->description, f->bodies, 3, &f->loop, 1, NULL, 0);
    f->description.hold = f->hold;
    f->description.hold_count = 1;
}

static kt_model *make_linkage(double error, double right) {
    four_bar_frame f;
    fill_linkage(&f, error, right);
    return kt_scene_compile(&f.description);
}

static double frequency(void) { return sqrt(9.81 * (rod + coupler) / ((2.0 / 3.0 * rod + coupler) * length)); }

typedef struct kt_watch {
    int left, right; /* their places in q */
    kt_worst angle, twin, position, velocity, energy;
    double bound, closed, total;
} kt_watch;

static int watch(const kt_record *record, void *user) {
    kt_watch *w = user;
    double t = record->t, u = record->q[w->left];
    if (record->index == 0)
        w->total = record->kinetic + record->potential;
    kt_worst_near(&w->angle, u, swing_angle(start, frequency(), t), w->bound, "t = %g", t);
    kt_worst_near(&w->twin, record->q[w->right], u, w->closed, "t = %g", t);
    kt_worst_below(&w->position, record->constraint.position, w->closed, "t = %g", t);
    kt_worst_below(&w->velocity, record->constraint.velocity, 10.0 * w->closed, "t = %g", t);
    kt_worst_near(&w->energy, record->kinetic + record->potential, w->total, 10.0 * w->bound, "t = %g", t);
    return 0;
}

static kt_watch run_linkage(const kt_model *model, kt_run run, bool unprojected, double bound, double closed) {
    kt_watch w = {.bound = bound, .closed = closed};
    kt_simulation_options options = kt_simulation_options_default();
    w.left = kt_body_coordinates(model, kt_body_find(model, "left")).q;
    w.right = kt_body_coordinates(model, kt_body_find(model, "right")).q;
    w.angle = kt_worst_make(run.integrator);
    w.twin = kt_worst_make("the other crank");
    w.position = kt_worst_make("closure, positions");
    w.velocity = kt_worst_make("closure, velocities");
    w.energy = kt_worst_make("energy");
    options.unprojected = unprojected;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_test_run(simulation, watch, &w);
    return w;
}

/* 10 s are some six swings. The bounds of the angle are five times the measured errors. */
KT_TEST(parallelogram_swings_as_a_pendulum_and_stays_closed) {
    static const struct {
        const char *integrator;
        double tolerance, bound;
    } cases[] = {{"dopri5", 1e-8, 2.2e-6}, {"dop853", 1e-11, 1.4e-10}, {"bs32", 1e-6, 7.8e-4}};
    kt_model *model = make_linkage(0.0, length);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        kt_run run = kt_run_default();
        run.integrator = cases[i].integrator;
        run.relative = run.absolute = cases[i].tolerance;
        kt_watch w = run_linkage(model, run, false, cases[i].bound, projected);
        kt_check_worst(&w.angle);
        kt_check_worst(&w.twin);
        kt_check_worst(&w.position);
        kt_check_worst(&w.velocity);
        kt_check_worst(&w.energy);
    }
}

/* The other crank and the coupler start 0.2 rad off; the held crank stays where it is, and the motion is the same. */
KT_TEST(open_loop_is_assembled_at_the_start) {
    kt_model *model = make_linkage(0.2, length);
    kt_run run = kt_run_default();
    kt_watch w = run_linkage(model, run, false, 2.1e-7, projected);
    kt_check_worst(&w.angle);
    kt_check_worst(&w.twin);
    kt_check_worst(&w.position);
}

/* Without projection, the loop opens by the error of the steps. Half the step gives an error smaller by 2^4. */
/* A spring without a length is as long as at the assembled start. The linkage is given far from that start. The energy
 * k (d - L)^2 / 2 measures the distance from the assembled start. */
KT_TEST(spring_without_a_length_is_unstretched_where_the_loops_are_closed) {
    four_bar_frame f;
    kt_effect spring = kt_effect_default();
    fill_linkage(&f, 0.3, 1.3);
    spring.type = KT_EFFECT_SPRING;
    spring.between[0].at = kt_vec3_make(0.5, 0.4, 0.0);
    spring.between[1].body = "coupler";
    spring.between[1].at = kt_vec3_make(1.0, 0.2, 0.0);
    spring.stiffness = 2.0;
    spring.initial_length = true;
    f.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    f.description.effects = &spring;
    f.description.effect_count = 1;
    for (int formulation = 0; formulation < KT_FORMULATION_COUNT; formulation++) {
        kt_run run = kt_run_default();
        kt_record record;
        kt_error error;
        run.record = KT_RECORD_ENERGY;
        kt_model *model = kt_scene_compile(&f.description);
        kt_absolute *absolute = kt_formulate(&f.description, NULL, model, (kt_formulation)formulation);
        kt_simulation *simulation = kt_either_begin(model, absolute, &run, NULL).simulation;
        if (kt_fine("sense", kt_simulation_sense(simulation, &record, &error), &error))
            kt_check_below("stretch, m", sqrt(record.potential), 16.0 * DBL_EPSILON);
    }
}

KT_TEST(loop_drifts_open_without_projection) {
    kt_model *model = make_linkage(0.0, 1.3);
    double open[2];
    for (int i = 0; i < 2; i++) {
        kt_run run = kt_run_fixed("rk4", 0.02 / (1 << i), 5.0);
        run.record = KT_RECORD_CONSTRAINT | KT_RECORD_ENERGY;
        double closed = run_linkage(model, run, false, 1.0, 1.0).position.observed;
        open[i] = run_linkage(model, run, true, 1.0, 1.0).position.observed;
        kt_check_above("times what it is with projection", open[i] / closed, 1e8);
    }
    kt_check_near("order of the drift", log2(open[0] / open[1]), 4.0, 0.5);
}

KT_TEST(factorizations_are_counted) {
    kt_model *model = make_linkage(0.0, length);
    kt_run run = kt_run_fixed("rk4", 0.1, 1.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_advance(simulation, 1.0);
    kt_simulation_counts counts = kt_simulation_counts_of(simulation);
    kt_check_equal_int("evaluations", (long long)counts.evaluations, 40);
    kt_check_equal_int("factorizations", (long long)counts.factorizations, 50); /* and a projection a step */
}

/* The coupler hangs on both cranks. Horizontally and vertically,
 *     left + right joints on the coupler = m (a - g)
 * with the acceleration of a translation, a = l (u'' cos u - u'^2 sin u, u'' sin u + u'^2 cos u). The loop's reaction
 * is on its second end, the coupler, from the right crank. */
static int check_reactions(const kt_record *record, void *user) {
    kt_watch *w = user;
    double u = record->q[w->left], du = record->v[w->left], ddu = record->a[w->left];
    double ax = length * (ddu * cos(u) - du * du * sin(u)), ay = length * (ddu * sin(u) + du * du * cos(u));
    kt_vec3 sum = kt_vec3_add(record->reactions[w->right].force, record->loop_reactions[0].force);
    double scale = coupler * (9.81 + length * (du * du + fabs(ddu)));
    kt_worst_near(&w->position, sum.x, coupler * ax, 64.0 * DBL_EPSILON * scale, "t = %g", record->t);
    kt_worst_near(&w->velocity, sum.y, coupler * (ay + 9.81), 64.0 * DBL_EPSILON * scale, "t = %g", record->t);
    return 0;
}

KT_TEST(reactions_of_joint_and_loop_carry_the_coupler) {
    kt_model *model = make_linkage(0.0, length);
    kt_run run = kt_run_default();
    run.duration = 2.0;
    run.interval = 0.05;
    run.record = KT_RECORD_REACTION | KT_RECORD_ACCELERATION;
    kt_watch w = {.position = kt_worst_make("horizontal"), .velocity = kt_worst_make("vertical")};
    w.left = kt_body_coordinates(model, kt_body_find(model, "left")).q;
    w.right = kt_body_find(model, "coupler"); /* the body whose joint it is */
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_run(simulation, check_reactions, &w);
    kt_check_worst(&w.position);
    kt_check_worst(&w.velocity);
}

/* A loop that cannot be closed: the cranks too far apart. */
/* A wheel is driven to t^3 / 6. A step of euler from t adds h t to its velocity t^2 / 2. Its error is h^2 / 2. The
 * error of rk4 is zero. */
KT_TEST(correction_of_velocities_is_the_error_of_a_step) {
    static const double cubic[] = {0.0, 0.0, 0.0, 1.0 / 6.0}, h = 0.015625, end = 2.0;
    kt_body bodies[2] = {kt_body_default(), make_rod("wheel", 1.0, 0.5)};
    bodies[0].name = "idle";
    bodies[0].joint.type = KT_JOINT_FREE;
    bodies[0].joint.velocity[0] = 50.0;
    bodies[0].mass = 1.0;
    bodies[0].inertia = (kt_sym3){1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
    bodies[1].joint.position[0] = 0.0;
    kt_loop drive = kt_loop_of("drive", KT_LOOP_MOTION);
    drive.joint = "wheel";
    drive.function = kt_function_polynomial(cubic, 4);
    kt_description description = kt_description_of(bodies, 2, &drive, 1, NULL, 0);
    kt_model *model = kt_scene_compile(&description);
    for (int i = 0; i < 2; i++) {
        const kt_run run = kt_run_fixed(i == 0 ? "euler" : "rk4", h, end);
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        const kt_velocity_correction none = kt_simulation_velocity_correction(simulation);
        kt_check_true("none yet", none.share == 0.0 && isnan(none.time) && none.body == 0);
        kt_test_advance(simulation, end);
        const kt_velocity_correction found = kt_simulation_velocity_correction(simulation);
        kt_check_near(run.integrator, found.share, i == 0 ? (h / end) * (h / end) : 0.0, 8.0 * DBL_EPSILON);
        if (i == 0)
            kt_check_text("joint", kt_body_name(model, found.body), "wheel");
    }
}

KT_TEST(loop_out_of_reach_is_rejected_at_the_start) {
    kt_body bodies[2] = {make_rod("a", 0.0, length), make_rod("b", 5.0, length)};
    kt_error error;
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_loop loop = kt_loop_of("reach", KT_LOOP_SPHERICAL);
    loop.between[0] = loop.between[1] = kt_end_default();
    loop.between[0].body = "a";
    loop.between[1].body = "b";
    loop.between[0].at = loop.between[1].at = kt_vec3_make(0.0, -length, 0.0);
    kt_description description = kt_description_of(bodies, 2, &loop, 1, NULL, 0);
    kt_status status = kt_model_compile(&description, NULL, &model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(model, NULL, NULL, &simulation, &error);
    kt_check_equal_int("status", status, KT_ERROR_CONSTRAINT);
    kt_note("%s: %s", error.where, error.message);
    kt_check_contains("message", error.message, "'reach'");
    kt_check_true("no simulation", simulation == NULL);
    kt_model_free(model);
}

/* A checkpoint within a step of a closed loop. */
KT_TEST(restored_loop_goes_on_bit_for_bit) {
    kt_run run = kt_run_default();
    run.duration = 1.0;
    run.interval = 0.01;
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY;
    kt_check_equal_int("records",
                       kt_resumption_check(&(kt_resumption){.model = make_linkage(0.0, length), .run = &run}, 37), 101);
}
