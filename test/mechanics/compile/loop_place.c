/* Places of loops on the world. A set place gives the equations of a model that was compiled with it, in space and in a
 * plane. At the place of a body's present pose the loop is closed. A rod in flight that is caught at such a place turns
 * as the closed form demands.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"
#include "random.h"

#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

enum { BODIES = 3, MOST = 24, TRIALS = 200 };

static const kt_loop_type types[] = {
    KT_LOOP_SPHERICAL, KT_LOOP_INLINE,    KT_LOOP_INPLANE,     KT_LOOP_DISTANCE, KT_LOOP_PARALLEL, KT_LOOP_COAXIAL,
    KT_LOOP_REVOLUTE,  KT_LOOP_PRISMATIC, KT_LOOP_CYLINDRICAL, KT_LOOP_PLANAR,   KT_LOOP_WELD,
};

/* A chain of three bodies, the last of which a loop connects with the world. */
typedef struct chain {
    kt_body body[BODIES];
    kt_loop loop;
    kt_description description;
} chain;

static kt_vec3 random_vector(kt_random *random, bool flat) {
    const double x = kt_random_normal(random), y = kt_random_normal(random), z = kt_random_normal(random);
    return kt_vec3_make(x, y, flat ? 0.0 : z);
}

/* A rotation vector, about z if flat. */
static kt_vec3 random_turn(kt_random *random, bool flat) {
    const kt_vec3 any = random_vector(random, false);
    return flat ? kt_vec3_make(0.0, 0.0, any.z) : any;
}

static void place_in(chain *c, int end, kt_vec3 at, kt_vec3 turn) {
    c->loop.between[end].at = at;
    c->loop.between[end].rotation = kt_rotation_vector(turn);
}

static void make_chain(chain *c, kt_random *random, kt_loop_type type, int end, bool flat) {
    static const char *const names[] = {"base", "link", "foot"};
    for (int i = 0; i < BODIES; i++) {
        kt_body *body = &c->body[i];
        *body = kt_body_of(names[i], i > 0 ? names[i - 1] : NULL,
                           i > 0  ? KT_JOINT_REVOLUTE
                           : flat ? KT_JOINT_PLANAR
                                  : KT_JOINT_FREE,
                           1.0 + 0.3 * i);
        body->joint.axis = flat || i == 0 ? kt_vec3_make(0.0, 0.0, 1.0) : random_vector(random, false);
        body->joint.at = random_vector(random, flat);
        body->com = random_vector(random, flat);
        body->inertia = (kt_sym3){.xx = 0.4, .yy = 0.5, .zz = 0.6};
    }
    c->loop = kt_loop_of("foot", type);
    c->loop.axis = kt_vec3_make(0.0, 0.0, 1.0);
    c->loop.function = type == KT_LOOP_DISTANCE ? kt_function_constant(0.7) : c->loop.function;
    c->loop.between[1 - end].body = "foot";
    place_in(c, 1 - end, random_vector(random, flat), random_turn(random, flat));
    c->description = kt_description_of(c->body, BODIES, &c->loop, 1, NULL, 0);
}

/* Makes the loop of the foot one with the first body, in which the place then is. The second body moves freely on the
 * first one, so that all equations are independent. */
static void join_bodies(chain *c) {
    c->body[1].joint.type = c->body[0].joint.type;
    c->body[1].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    c->loop.between[1].body = "base";
}

static kt_model *compile(const chain *c, bool settable) {
    kt_model_options options = kt_model_options_default();
    options.settable = settable;
    return kt_test_model(&c->description, &options);
}

/* Accelerations, residuals and reactions of a model at (q, v), whose loops are open. */
typedef struct answer {
    double a[MOST], residual[2];
    kt_wrench reaction;
} answer;

static void ask(const kt_model *model, const double *q, const double *v, answer *x) {
    kt_error error = {0};
    kt_residual residual = {0};
    kt_wrench joints[BODIES + 1];
    memset(x, 0, sizeof *x);
    kt_data *data = kt_test_data(model);
    kt_need_fine("a", kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, x->a, &error), &error);
    kt_need_fine("residual", kt_loop_residual(model, data, 0.0, q, v, &residual, &error), &error);
    kt_need_fine("reactions", kt_reaction_evaluate(model, data, 0.0, q, v, NULL, NULL, joints, &x->reaction, &error),
                 &error);
    x->residual[0] = residual.position;
    x->residual[1] = residual.velocity;
}

/* The largest difference of two answers, relative to the size of theirs. */
static double difference(const answer *ours, const answer *theirs) {
    const double *x = (const double *)(const void *)ours, *y = (const double *)(const void *)theirs;
    double most = 0.0, size = 1.0;
    for (size_t i = 0; i < sizeof *ours / sizeof *x; i++) {
        most = fmax(most, fabs(x[i] - y[i]));
        size = fmax(size, fabs(y[i]));
        if (isnan(x[i]) || isnan(y[i]))
            return (double)NAN;
    }
    return most / size;
}

static void random_state(kt_random *random, const kt_model *model, double *q, double *v) {
    kt_model_initial(model, q, v);
    for (int i = 0; i < kt_model_nq(model); i++)
        q[i] += 0.5 * kt_random_normal(random);
    for (int i = 0; i < kt_model_nv(model); i++)
        v[i] = kt_random_normal(random);
}

/* Sets a place in the model of one description; `then` has it from the beginning. Returns the difference. */
static double compare(kt_random *random, kt_model *model, const chain *then, const double *numbers) {
    kt_error error = {0};
    kt_parameter place;
    double q[MOST], v[MOST], back[KT_PARAMETER_MAX];
    answer ours, theirs;
    kt_model *other = compile(then, false);
    random_state(random, model, q, v);
    kt_need_fine("find", kt_parameter_find(model, "loop foot.place", &place, &error), &error);
    kt_need_fine("set", kt_parameter_set(model, &place, numbers, &error), &error);
    kt_need_fine("get", kt_parameter_get(model, &place, back, &error), &error);
    ask(model, q, v, &ours);
    ask(other, q, v, &theirs);
    double worst = difference(&ours, &theirs);
    const double rounding = then->loop.between[1].body && then->loop.between[0].body ? 1e-14 : 0.0;
    for (int i = 0; i < 3; i++)
        worst = fabs(back[i] - numbers[i]) <= rounding ? worst : (double)NAN;
    return worst;
}

static void compare_many(bool flat) {
    kt_random random = kt_random_of_test();
    double worst = 0.0, moved = 0.0;
    for (int i = 0; i < TRIALS; i++) {
        chain c;
        const int end = kt_random_int(&random, 0, 1);
        make_chain(&c, &random, types[kt_random_int(&random, 0, (int)(sizeof types / sizeof *types) - 1)], end, flat);
        if (end == 1 && i % 2 == 1)
            join_bodies(&c);
        kt_model *model = compile(&c, true);
        const kt_vec3 at = random_vector(&random, flat), turn = random_turn(&random, flat);
        const double numbers[] = {at.x, at.y, at.z, turn.x, turn.y, turn.z};
        double q[MOST], v[MOST];
        answer before, after;
        random_state(&random, model, q, v);
        ask(model, q, v, &before);
        place_in(&c, end, at, turn);
        const double d = compare(&random, model, &c, numbers);
        if (!(d < 1e-11))
            kt_note("%s, %s end: %.3g", kt_loop_type_name(c.loop.type), end ? "second" : "first", d);
        worst = isnan(d) ? d : fmax(worst, d);
        ask(model, q, v, &after);
        moved = fmax(moved, difference(&after, &before));
    }
    kt_check_below("a set place against a compiled one, relative", worst, 1e-11);
    kt_check_above("it matters", moved, 0.1);
}

KT_TEST(set_places_have_the_equations_of_a_model_that_was_compiled_with_them) { compare_many(false); }
KT_TEST(so_have_set_places_in_a_plane) { compare_many(true); }

/* Welds, pins and hinges where the foot is. */
KT_TEST(loops_are_closed_where_their_body_is) {
    static const kt_loop_type closing[] = {KT_LOOP_WELD, KT_LOOP_SPHERICAL, KT_LOOP_REVOLUTE, KT_LOOP_CYLINDRICAL};
    kt_random random = kt_random_of_test();
    double before = HUGE_VAL, after = 0.0;
    for (int i = 0; i < TRIALS; i++) {
        chain c;
        kt_error error = {0};
        kt_parameter place;
        double q[MOST], v[MOST], here[KT_PARAMETER_MAX];
        answer open, shut;
        make_chain(&c, &random, closing[i % 4], i / 4 % 2, i / 8 % 2 == 1);
        if (i / 4 % 2 == 1 && i % 3 == 0)
            join_bodies(&c);
        kt_model *model = compile(&c, true);
        kt_data *data = kt_test_data(model);
        random_state(&random, model, q, v);
        kt_check_equal_int("without kinematics", kt_loop_place_here(model, data, 0, here, &error), KT_ERROR_ARGUMENT);
        ask(model, q, v, &open);
        kt_need_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &error), &error);
        kt_need_fine("here", kt_loop_place_here(model, data, 0, here, &error), &error);
        kt_need_fine("find", kt_parameter_find(model, "loop foot.place", &place, &error), &error);
        kt_need_fine("set", kt_parameter_set(model, &place, here, &error), &error);
        ask(model, q, v, &shut);
        before = fmin(before, open.residual[0]);
        after = isnan(shut.residual[0]) ? (double)NAN : fmax(after, shut.residual[0]);
    }
    kt_check_above("the gap before", before, 1e-3);
    kt_check_below("the gap after", after, 2e-14);
}

/* A rod of 1 m and 1 kg flies at 2 m/s across its length and turns, and a pin catches its end at any time. */
KT_TEST(rod_in_flight_is_caught_where_its_end_is) {
    for (int trial = 0; trial < 4; trial++) {
        const double turn = 0.7 * trial, caught = 0.1 + 0.13 * trial;
        kt_error error = {0};
        chain c;
        kt_random random = kt_random_of_test();
        kt_parameter place;
        double here[KT_PARAMETER_MAX];
        make_chain(&c, &random, KT_LOOP_SPHERICAL, 0, true);
        c.body[0].joint.at = c.body[0].com = kt_vec3_make(0.0, 0.0, 0.0);
        c.body[0].mass = 1.0;
        c.body[0].inertia = (kt_sym3){.yy = 1.0 / 12.0, .zz = 1.0 / 12.0};
        c.description.body_count = 1;
        c.loop.switching = KT_SWITCHED_OFF;
        c.loop.between[1].body = "base";
        c.loop.between[0].at = kt_vec3_make(7.0, -3.0, 0.0);
        c.loop.between[1].at = kt_vec3_make(-0.5, 0.0, 0.0);
        c.loop.between[1].rotation = kt_rotation_vector(kt_vec3_make(0.0, 0.0, 0.0));
        kt_model *model = compile(&c, true);
        const double q[3] = {0.0, 0.0, turn}, v[3] = {-2.0 * sin(turn), 2.0 * cos(turn), 0.0};
        kt_run run = kt_run_default();
        run.duration = 2.0;
        kt_data *data = kt_test_data(model);
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        kt_need_fine("state", kt_simulation_set_state(simulation, 0.0, q, v, &error), &error);
        kt_need_fine("flight", kt_simulation_advance(simulation, caught, &error), &error);
        kt_need_fine("kinematics",
                     kt_kinematics_update(model, data, kt_simulation_positions(simulation), NULL, NULL, &error),
                     &error);
        kt_need_fine("here", kt_loop_place_here(model, data, 0, here, &error), &error);
        kt_need_fine("find", kt_parameter_find(model, "loop foot.place", &place, &error), &error);
        kt_check_equal_int("far from its place", kt_simulation_set_switches(simulation, 1, NULL, &error),
                           KT_ERROR_CONSTRAINT);
        (void)kt_fine("set", kt_simulation_set_parameter(simulation, model, &place, here, &error), &error);
        double loss = (double)NAN;
        (void)kt_fine("switch", kt_simulation_set_switches(simulation, 1, &loss, &error), &error);
        kt_check_near("the pin is at the end: x", here[0], -0.5 * cos(turn) - 2.0 * sin(turn) * caught, 1e-9);
        kt_check_near("the loss, J", loss, 0.5, 1e-9);
        kt_check_near("the rate, rad/s", kt_simulation_velocities(simulation)[2], 3.0, 1e-9);
        (void)kt_fine("turns", kt_simulation_advance(simulation, caught + 1.0, &error), &error);
        kt_check_near("the angle, rad", kt_simulation_positions(simulation)[2], turn + 3.0, 1e-8);
        kt_check_near("the end stays: x", kt_simulation_positions(simulation)[0] - 0.5 * cos(turn + 3.0), here[0],
                      1e-8);
    }
}

KT_TEST(places_that_do_not_exist_are_rejected) {
    kt_random random = kt_random_of_test();
    kt_error error = {0};
    chain c;
    kt_parameter place;
    double here[KT_PARAMETER_MAX] = {0};
    make_chain(&c, &random, KT_LOOP_SPHERICAL, 0, true);
    kt_model *flat = compile(&c, true);
    kt_data *data = kt_test_data(flat);
    kt_need_fine("find", kt_parameter_find(flat, "loop foot.place", &place, &error), &error);
    here[2] = 0.01;
    kt_check_equal_int("above the plane", kt_parameter_set(flat, &place, here, &error), KT_ERROR_MODEL);
    kt_check_true("it names the shift", strstr(error.message, "0.01 m") != NULL);
    here[2] = 0.0;
    here[3] = 0.02;
    kt_check_equal_int("a tilted point", kt_parameter_set(flat, &place, here, &error), KT_OK);
    here[3] = (double)NAN;
    kt_check_equal_int("NaN", kt_parameter_set(flat, &place, here, &error), KT_ERROR_MODEL);
    kt_check_equal_int("no such loop", kt_loop_place_here(flat, data, 1, here, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no data", kt_loop_place_here(flat, NULL, 0, here, &error), KT_ERROR_ARGUMENT);
    make_chain(&c, &random, KT_LOOP_WELD, 0, true);
    kt_model *held = compile(&c, true);
    here[3] = 0.02;
    kt_need_fine("find", kt_parameter_find(held, "loop foot.place", &place, &error), &error);
    kt_check_equal_int("tilted", kt_parameter_set(held, &place, here, &error), KT_ERROR_MODEL);
    kt_check_true("it names the remedy", strstr(error.message, "--plan spatial") != NULL);
    c.loop.between[0].body = "base";
    c.loop.type = KT_LOOP_SCREW;
    kt_model *inner = compile(&c, true);
    kt_check_equal_int("a screw", kt_parameter_find(inner, "loop foot.place", &place, &error), KT_ERROR_ARGUMENT);
}
