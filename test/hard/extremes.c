/* Kinds 13 and 14: next to nothing, and far too much.
 *
 * A Runge-Kutta method of order 2 or more finds free fall, `y = -g t^2 / 2`, but for rounding. Over n steps the sum
 * rounds by at most n eps of its end. A body that turns about a principal axis turns evenly. A pendulum's motion does
 * not depend on its mass, nor on its length if gravity grows with it. For all numbers that a double has, the result
 * must be this motion or a rejection.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const kt_hard_motion second = {.integrator = "rk4", .duration = 1.0, .step = 1e-3, .interval = 0.1};

static bool start(kt_hard *h) { return kt_hard_start(h, &second); }

static void stop(kt_hard *h) {
    kt_simulation_free(h->simulation);
    kt_model_free(h->model);
    h->simulation = NULL;
    h->model = NULL;
}

static bool one_body(kt_hard *h, kt_joint_type type) {
    if (!kt_hard_make(h, 1, 0, 0))
        return false;
    h->bodies[0].name = "body";
    h->bodies[0].joint.type = type;
    h->bodies[0].mass = 2.0;
    h->bodies[0].inertia = kt_sym3_make(1.0, 2.0, 3.0, 0.0, 0.0, 0.0);
    return true;
}

/* ---- 13 ---------------------------------------------------------------------------------------------------------- */

/* Falls and turns about its third axis at 3 rad/s, or, without gravity, does not fall. */
static void fall(kt_hard *h, double g) {
    kt_error error;
    if (!one_body(h, KT_JOINT_FREE))
        return;
    h->description.gravity.y = -g;
    h->bodies[0].joint.velocity[5] = 3.0;
    if (start(h) && kt_hard_fine(h, kt_simulation_advance(h->simulation, 1.0, &error), &error)) {
        const double *q = kt_simulation_positions(h->simulation);
        h->observed[0] = fabs(q[1] + 0.5 * g);
        h->observed[1] = fabs(2.0 * atan2(q[6], q[3]) - 3.0);
    }
}

static void run_fall(kt_hard *h) { fall(h, 9.81); }
static void run_weightless(kt_hard *h) { fall(h, 0.0); }

/* A massless body at the end of a massive one: its acceleration is undetermined. */
static void run_massless(kt_hard *h) {
    kt_error error = {KT_OK, "", ""};
    double a[1];
    h->observed[0] = 0.0;
    if (!one_body(h, KT_JOINT_REVOLUTE))
        return;
    h->bodies[0].mass = 0.0;
    h->bodies[0].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    if (!start(h))
        return;
    const kt_status status = kt_simulation_acceleration(h->simulation, a, &error);
    kt_hard_claim(h, 0, status == KT_ERROR_SINGULAR, "it is rejected");
    kt_hard_claim(h, 0, strstr(error.where, "'body'") != NULL, "the joint is named");
    kt_hard_say(h, "%s: %s", error.where, error.message);
}

static int count_record(const kt_record *record, void *user) {
    (void)record;
    ++*(int *)user;
    return 0;
}

static void run_nothing(kt_hard *h) {
    kt_error error;
    int records = 0;
    h->observed[0] = 0.0;
    if (!kt_hard_make(h, 0, 0, 0) || !start(h)) {
        kt_hard_claim(h, 0, false, "it starts");
        return;
    }
    kt_hard_claim(h, 0, kt_hard_fine(h, kt_simulation_run(h->simulation, count_record, &records, &error), &error),
                  "it runs");
    kt_hard_claim(h, 0, records == 11 && kt_simulation_time(h->simulation) == 1.0, "it runs to its end");
}

static void run_one(kt_hard *h) {
    kt_error error;
    kt_upright exact = {9.81L, 0.0L, 0.5L * acosl(-1.0L), 0.0L};
    if (!one_body(h, KT_JOINT_REVOLUTE))
        return;
    h->description.gravity.y = -9.81;
    h->bodies[0].com = kt_vec3_make(1.0, 0.0, 0.0);
    h->bodies[0].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    kt_upright_move(&exact, 1.0L);
    if (start(h) && kt_hard_fine(h, kt_simulation_advance(h->simulation, 1.0, &error), &error))
        h->observed[0] = fabs(0.5 * acos(-1.0) - (double)exact.theta - kt_simulation_positions(h->simulation)[0]);
}

/* ---- 14 ---------------------------------------------------------------------------------------------------------- */

typedef struct tally {
    int right, rejected, wrong;
} tally;

/* A pendulum, and a spring on it; `apply` puts a value into it. */
static bool pendulum(kt_hard *h) {
    if (!kt_hard_make(h, 2, 0, 1))
        return false;
    for (int i = 0; i < 2; i++) {
        h->bodies[i].name = i ? "lower" : "upper";
        h->bodies[i].parent = i ? "upper" : NULL;
        h->bodies[i].joint.type = KT_JOINT_REVOLUTE;
        h->bodies[i].joint.at.x = i;
        h->bodies[i].joint.position[0] = 0.3;
        h->bodies[i].mass = 1.0;
        h->bodies[i].com = kt_vec3_make(0.5, 0.0, 0.0);
        h->bodies[i].inertia = kt_sym3_make(0.1, 0.1, 0.1, 0.0, 0.0, 0.0);
    }
    h->effects[0].type = KT_EFFECT_SPRING;
    h->effects[0].between[1].body = "lower";
    h->effects[0].between[1].at.x = 1.0;
    h->effects[0].stiffness = 0.0;
    h->effects[0].length = 1.0;
    h->description.gravity.y = -9.81;
    return true;
}

/* The quantity that a value replaces. The first two leave the motion as it is: all masses, all lengths with gravity. */
typedef enum place {
    MASSES,
    LENGTHS,
    MASS,
    INERTIA,
    COM,
    AT,
    GRAVITY,
    POSITION,
    VELOCITY,
    STIFFNESS,
    REST,
    PLACES
} place;

static void scale(kt_body *b, double mass, double length) {
    const double j = 0.1 * mass * length * length;
    b->mass *= mass;
    b->com.x *= length;
    b->joint.at.x *= length;
    b->inertia = kt_sym3_make(j, j, j, 0.0, 0.0, 0.0);
}

static void put(kt_hard *h, place where, double x) {
    kt_body *b = &h->bodies[1];
    double *const field[PLACES] = {[MASS] = &b->mass,
                                   [INERTIA] = &b->inertia.zz,
                                   [COM] = &b->com.x,
                                   [AT] = &b->joint.at.x,
                                   [GRAVITY] = &h->description.gravity.y,
                                   [POSITION] = &b->joint.position[0],
                                   [VELOCITY] = &b->joint.velocity[0],
                                   [STIFFNESS] = &h->effects[0].stiffness,
                                   [REST] = &h->effects[0].length};
    if (field[where])
        *field[where] = x;
    if (where == INERTIA)
        b->inertia.xx = b->inertia.yy = x;
    for (int i = 0; i < 2 && where <= LENGTHS; i++)
        scale(&h->bodies[i], where == MASSES ? x : 1.0, where == LENGTHS ? x : 1.0);
    if (where == LENGTHS)
        h->description.gravity.y *= x;
}

/* Ten steps; the state, or false where it is rejected at any point. */
static bool swing(kt_hard *h, double *state) {
    kt_model_options options = kt_model_options_default();
    kt_run run = kt_run_default();
    kt_error error;
    run.integrator = "rk4";
    run.step = 0.01;
    run.duration = 0.1;
    const bool done = kt_model_compile(&h->description, &options, &h->model, &error) == KT_OK &&
                      kt_simulation_create(h->model, &run, NULL, &h->simulation, &error) == KT_OK &&
                      kt_simulation_advance(h->simulation, 0.1, &error) == KT_OK;
    if (h->simulation) {
        memcpy(state, kt_simulation_positions(h->simulation), 2 * sizeof *state);
        memcpy(state + 2, kt_simulation_velocities(h->simulation), 2 * sizeof *state);
    }
    stop(h);
    return done;
}

/* The results are always numbers. If `known` gives the motion for ones, they must agree with it, up to the rounding of
 * ten steps of four evaluations. Each evaluation has some 100 operations. */
static void try_value(kt_hard *h, place where, double x, const double *known, tally *t) {
    double state[4] = {0.0, 0.0, 0.0, 0.0};
    if (!pendulum(h))
        return;
    put(h, where, x);
    const bool done = swing(h, state);
    bool fine = true;
    for (int i = 0; i < 4; i++) {
        fine = fine && isfinite(state[i]);
        if (done && where <= LENGTHS)
            fine = fine && fabs(state[i] - known[i]) <= 4000.0 * DBL_EPSILON;
    }
    kt_hard_close(h);
    if (!fine)
        kt_hard_say(h, "%g in place %d is wrong", x, (int)where);
    *(fine ? done ? &t->right : &t->rejected : &t->wrong) += 1;
}

static void run_values(kt_hard *h) {
    static const double values[] = {5e-324, 1e-310, DBL_MIN, 1e-300, 1e-200, 1e-150, 1e-100, 1e-50,
                                    1e-20,  1e20,   1e50,    1e100,  1e150,  1e200,  1e300,  DBL_MAX};
    enum { VALUES = sizeof values / sizeof *values };
    const double none[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    double known[4];
    tally t = {0, 0, 0}, not_numbers = {0, 0, 0};
    if (!pendulum(h) || !swing(h, known))
        return;
    kt_hard_close(h);
    for (int where = 0; where < PLACES; where++) {
        for (int i = 0; i < VALUES; i++)
            try_value(h, (place)where, values[i], known, &t);
        for (int i = 0; i < 3; i++)
            try_value(h, (place)where, none[i], known, &not_numbers);
    }
    h->observed[0] = t.wrong + not_numbers.wrong;
    h->observed[1] = not_numbers.right;
    kt_hard_say(h, "of %d: %d run, %d rejected", t.right + t.rejected + t.wrong, t.right, t.rejected);
}

const kt_hard_case kt_hard_extremes[] = {
    {.number = 13,
     .name = "free fall and free rotation",
     .run = run_fall,
     .why = "nothing holds it: what is exact on paper must be exact here",
     .measures = {{"fall", "m", 1000.0 * DBL_EPSILON * 4.905}, {"turn", "rad", 4e-13}}},
    {.number = 13,
     .name = "zero gravity",
     .run = run_weightless,
     .why = "no force at all",
     .measures = {{"fall", "m", 0.0}, {"turn", "rad", 4e-13}}},
    {.number = 13,
     .name = "no mass where it matters",
     .run = run_massless,
     .why = "0 / 0: nothing says how the joint accelerates",
     .measures = {{"claims", "", 0.0}}},
    {.number = 13,
     .name = "one body, a particle",
     .run = run_one,
     .why = "without inertia about its centre of mass",
     .measures = {{"angle off the exact motion", "rad", 2.4e-12}}},
    {.number = 13,
     .name = "no body at all",
     .run = run_nothing,
     .why = "no coordinates, no matrices, and still a clock",
     .measures = {{"claims", "", 0.0}}},
    {.number = 14,
     .name = "5e-324 to 1.8e308 in every place",
     .run = run_values,
     .why = "squares overflow and underflow far inside the range of a double",
     .measures = {{"wrong, or NaN", "", 0.0}, {"values that are no numbers let in", "", 0.0}}},
    {.name = NULL}};
