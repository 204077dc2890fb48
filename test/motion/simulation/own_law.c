/* Laws in C, with auxiliary states and without. They agree with the same laws as formulas to the bit. Further subjects
 * are their derivatives, exact and by differences, and the rejection of invalid laws. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "parsed.h"

#include "kinetree/analysis.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A motor for direct current on an arm with a weight, its coil warming up: the states are those of its effect. A spring
 * between two markers hardens, and a force on the body that carries both follows the arm. */
#define BODIES                                                                                                         \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                   \
    "  - {name: arm, joint: {type: revolute, axis: z, position: 30 deg, velocity: 1}, mass: 0.5,\n"                    \
    "     shape: {type: rod, to: [0.4, 0, 0]}, markers: {tip: [0.4, 0, 0]}}\n"                                         \
    "  - {name: cart, joint: {type: prismatic, axis: x, at: [0.6, -0.2, 0]}, mass: 1,\n"                               \
    "     shape: {type: box, size: [0.2, 0.1, 0.1]}, markers: {hook: [0, 0.05, 0]}}\n"
#define TEXT                                                                                                           \
    BODIES "states:\n"                                                                                                 \
           "  current: {initial: 0.1, rate: \"(6 - 2*t - 0.8*current*heat - 0.5*velocity.arm)/0.02\"}\n"               \
           "  heat: {initial: 1, rate: \"0.3*(current*current - 2*(heat - 1))\"}\n"                                    \
           "effects:\n"                                                                                                \
           "  - {name: motor, type: expression, joint: arm, force: \"0.5*current - 0.01*velocity.arm\"}\n"             \
           "  - {type: expression, between: [arm.tip, cart.hook],\n"                                                   \
           "     force: \"-40*(length - 0.3)*length - 0.5*speed\"}\n"                                                  \
           "  - {type: expression, at: cart.hook, force: [\"-5*position.cart\", 0, 0],\n"                              \
           "     torque: [0, 0, \"0.2*position.arm*heat\"]}\n"

typedef struct numbers {
    double stiffness;
    int code, calls;      /* the result of the laws from t = 0.3 on, and the calls of the motor */
    bool breaks_rates;    /* of the motor the rates alone */
    double rate_of_state; /* of the code's test: NaN instead of a rate */
} numbers;

static int motor(void *user, const double *u, double *force, double *rates) {
    numbers *n = user;
    const double t = u[0], v = u[1], current = u[2], heat = u[3];
    n->calls++;
    if (n->code != 0 && t >= 0.3 && (!n->breaks_rates || rates))
        return n->code;
    if (force)
        force[0] = 0.5 * current - 0.01 * v;
    if (rates) {
        rates[0] = (6.0 - 2.0 * t - 0.8 * current * heat - 0.5 * v) / 0.02 + n->rate_of_state;
        rates[1] = 0.3 * (current * current - 2.0 * (heat - 1.0));
    }
    return 0;
}

static int motor_derivatives(void *user, const double *u, double *force, double *rates) {
    const double current = u[2], heat = u[3];
    (void)user;
    if (force) {
        force[1] = -0.01;
        force[2] = 0.5;
    }
    if (rates) {
        rates[0] = -2.0 / 0.02;
        rates[1] = -0.5 / 0.02;
        rates[2] = -0.8 * heat / 0.02;
        rates[3] = -0.8 * current / 0.02;
        rates[4 + 2] = 0.6 * current;
        rates[4 + 3] = -0.6;
    }
    return 0;
}

static int spring(void *user, const double *u, double *force, double *rates) {
    const numbers *n = user;
    (void)rates;
    if (force)
        force[0] = -n->stiffness * (u[0] - 0.3) * u[0] - 0.5 * u[1];
    return 0;
}

static int spring_derivatives(void *user, const double *u, double *force, double *rates) {
    const numbers *n = user;
    (void)rates;
    force[0] = -n->stiffness * (2.0 * u[0] - 0.3);
    force[1] = -0.5;
    return 0;
}

static int load(void *user, const double *u, double *force, double *rates) {
    (void)user, (void)rates;
    force[0] = -5.0 * u[0];
    force[5] = 0.2 * u[1] * u[2];
    return 0;
}

static int load_derivatives(void *user, const double *u, double *force, double *rates) {
    (void)user, (void)rates;
    force[0] = -5.0;
    force[5 * 3 + 1] = 0.2 * u[2];
    force[5 * 3 + 2] = 0.2 * u[1];
    return 0;
}

static const char *const of_motor[] = {"t", "velocity.arm", "current", "heat"};
static const char *const of_spring[] = {"length", "speed"};
static const char *const of_load[] = {"position.cart", "position.arm", "state.heat"};
static const char *const of_both[] = {"current", "heat"};

/* The mechanism by formulas, or by laws. */
typedef struct mechanism {
    kt_scene scene;
    kt_effect effects[3];
    kt_auxiliary_state states[2];
    kt_description description;
    numbers n;
    kt_model *model;
} mechanism;

static void give_law(kt_effect *e, numbers *n, kt_effect_law_callback *law, kt_effect_law_derivatives_callback *by,
                     const char *const *variables, int count) {
    memset((void *)e->formula, 0, sizeof e->formula);
    e->law = law;
    e->law_derivatives = by;
    e->variables = variables;
    e->variable_count = count;
    e->user = n;
}

static void describe(mechanism *m, bool by_laws, bool exact) {
    memset(m, 0, sizeof *m);
    kt_parsed_scene(TEXT, &m->scene);
    m->n.stiffness = 40.0;
    m->description = m->scene.description;
    memcpy(m->effects, m->description.effects, sizeof m->effects);
    memcpy(m->states, m->description.states, sizeof m->states);
    if (!by_laws)
        return;
    give_law(&m->effects[0], &m->n, motor, exact ? motor_derivatives : NULL, of_motor, 4);
    give_law(&m->effects[1], &m->n, spring, exact ? spring_derivatives : NULL, of_spring, 2);
    give_law(&m->effects[2], &m->n, load, exact ? load_derivatives : NULL, of_load, 3);
    m->effects[0].states = of_both;
    m->effects[0].state_count = 2;
    m->states[0].rate = m->states[1].rate = NULL;
    m->description.effects = m->effects;
    m->description.states = m->states;
}

static void make(mechanism *m, bool by_laws, bool exact) {
    describe(m, by_laws, exact);
    m->model = kt_scene_compile(&m->description);
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

enum { RECORDS = 120, NUMBERS = 6 };

typedef struct records {
    int count, stop;
    double y[RECORDS][NUMBERS];
} records;

static int keep(const kt_record *record, void *user) {
    records *r = user;
    if (r->count == RECORDS)
        return -1;
    double *y = r->y[r->count];
    memcpy(y, record->q, 2 * sizeof *y);
    memcpy(y + 2, record->v, 2 * sizeof *y);
    memcpy(y + 4, record->x, 2 * sizeof *y);
    return ++r->count == r->stop ? -1 : 0;
}

static kt_run run_by(const char *method, double step) {
    kt_run run = kt_run_fixed(method, step, 1.0);
    run.interval = 0.0101;
    run.relative = 1e-9;
    run.absolute = 1e-11;
    return run;
}

static const struct {
    const char *name;
    double step;
    bool is_implicit;
} methods[] = {{"dopri5", 0.0, false}, {"rk4", 1e-3, false},   {"ab4", 1e-3, false},
               {"radau5", 0.0, true},  {"rodas5p", 0.0, true}, {"bdf2", 1e-3, true}};
enum { METHODS = sizeof methods / sizeof *methods };

static void run(const mechanism *m, size_t k, records *r) {
    kt_error error;
    const kt_run by = run_by(methods[k].name, methods[k].step);
    kt_simulation *s = kt_test_simulation(m->model, &by, NULL);
    *r = (records){.count = 0};
    (void)kt_fine(methods[k].name, kt_simulation_run(s, keep, r, &error), &error);
}

/* Explicit methods agree to the bit. Given derivatives differ from those of formulas by rounding; with differences the
 * steps of implicit methods move within their tolerance. */
KT_TEST(laws_in_c_move_as_formulas_do) {
    static records text, law;
    static mechanism m[3];
    for (int i = 0; i < 3; i++)
        make(&m[i], i > 0, i == 1);
    for (size_t k = 0; k < METHODS; k++)
        for (int i = 1; i < 3; i++) {
            kt_worst worst = {.what = methods[k].name};
            run(&m[0], k, &text);
            run(&m[i], k, &law);
            kt_check_equal_int("records", law.count, text.count);
            if (!methods[k].is_implicit)
                kt_check_equal_bits(methods[k].name, law.y[0], text.y[0], NUMBERS * (size_t)text.count);
            for (int j = 0; j < text.count; j++)
                for (int c = 0; c < NUMBERS; c++)
                    kt_worst_near(&worst, law.y[j][c], text.y[j][c], i == 1 ? 1e-12 : 3e-9, "%d.%d", j, c);
            if (methods[k].is_implicit)
                kt_check_worst(&worst);
        }
}

KT_TEST(runs_with_laws_go_on_with_the_same_bits_and_allocate_nothing) {
    static records whole, first, rest;
    static mechanism m;
    kt_error error;
    make(&m, true, true);
    for (size_t k = 0; k < METHODS; k++) {
        const kt_run by = run_by(methods[k].name, methods[k].step);
        kt_simulation *a = kt_test_simulation(m.model, &by, NULL), *b = kt_test_simulation(m.model, &by, NULL);
        void *block = malloc(kt_simulation_state_size(a));
        whole = first = rest = (records){.count = 0};
        first.stop = 31;
        kt_note("%s", methods[k].name);
        run(&m, k, &whole);
        kt_interpose_start();
        const kt_status stopped = kt_simulation_run(a, keep, &first, &error);
        kt_simulation_save(a, block);
        const kt_status restored = kt_simulation_restore(b, block, &error);
        const kt_status ended = kt_simulation_run(b, keep, &rest, &error);
        kt_check_equal_int("allocations", kt_interpose_stop(), 0);
        kt_check_equal_int("stops", stopped, KT_ERROR_CALLBACK);
        kt_check_true("goes on", restored == KT_OK && ended == KT_OK);
        kt_check_equal_int("records", first.count + rest.count, whole.count);
        kt_check_equal_bits("before", first.y[0], whole.y[0], NUMBERS * (size_t)first.count);
        kt_check_equal_bits("after", rest.y[0], whole.y[first.count], NUMBERS * (size_t)rest.count);
        free(block);
    }
}

/* Two states of one law: it is called once for both. */
KT_TEST(rates_of_one_law_are_computed_together) {
    static mechanism m;
    kt_error error;
    double q[2], v[2], rates[2];
    make(&m, true, true);
    kt_data *data = kt_test_data(m.model);
    kt_model_initial(m.model, q, v);
    m.n.calls = 0;
    (void)kt_fine("rates", kt_auxiliary_state_rates(m.model, data, 0.1, q, v, rates, &error), &error);
    kt_check_equal_int("calls", m.n.calls, 1);
    kt_check_near("current", rates[0], (5.8 - 0.8 * 0.1 - 0.5) / 0.02, 1e-13);
    kt_check_near("heat", rates[1], 0.3 * 0.01, 1e-17);
}

/* A supply that is switched on at 0.3 s, reported as a corner of the law: x' = 1 from there. */
static int switched(void *user, const double *u, double *force, double *rates) {
    (void)user, (void)force;
    if (rates)
        rates[0] = u[0] >= 0.3 ? 1.0 : 0.0;
    return 0;
}

static double corner(void *user, double t) {
    (void)user;
    return t < 0.3 ? 0.3 : HUGE_VAL;
}

KT_TEST(steps_end_at_the_corners_of_laws) {
    static mechanism m;
    const kt_run by = run_by("dopri5", 0.0);
    describe(&m, true, true);
    give_law(&m.effects[0], &m.n, switched, NULL, of_motor, 1);
    m.effects[0].breakpoint = corner;
    m.states[0].initial = 0.0;
    m.states[1].rate = "0";
    m.effects[0].state_count = 1;
    m.model = kt_scene_compile(&m.description);
    kt_simulation *s = kt_test_simulation(m.model, &by, NULL);
    kt_test_advance(s, 1.0);
    kt_check_near("state", kt_simulation_auxiliary_states(s)[0], 0.7, 1e-14);
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* The state matrix, away from the start; entries are of 1 to 1e3. */
static bool linearize(const mechanism *m, double matrix[36]) {
    const double q[2] = {0.7, -0.05}, v[2] = {-1.2, 0.4};
    kt_linearization_options options = kt_linearization_options_default();
    kt_error error;
    kt_linearization *l = kt_test_linearization(m->model, &options);
    double *x = kt_linearization_auxiliary_states(l);
    x[0] = 0.8;
    x[1] = 1.3;
    const bool fine = kt_fine("evaluate", kt_linearization_evaluate(l, 0.4, q, v, NULL, &error), &error) &&
                      kt_check_equal_int("states", kt_linearization_system(l)->states, 6);
    if (fine)
        memcpy(matrix, kt_linearization_system(l)->state, 36 * sizeof *matrix);
    return fine;
}

KT_TEST(derivatives_of_laws_are_those_of_formulas) {
    static mechanism m[3];
    double a[3][36];
    for (int i = 0; i < 3; i++) {
        make(&m[i], i > 0, i == 1);
        kt_need(linearize(&m[i], a[i]));
        kt_check_true("differenced", kt_model_is_differenced(m[i].model) == (i == 2));
    }
    for (int i = 1; i < 3; i++) {
        kt_worst worst = {.what = i == 1 ? "given" : "differences"};
        for (int k = 0; k < 36; k++)
            kt_worst_near(&worst, a[i][k], a[0][k], (i == 1 ? 1e-14 : 1e-11) * fmax(1.0, fabs(a[0][k])), "%d", k);
        kt_check_worst(&worst);
    }
}

/* Its kink is 1e-5 m from the length that the ends are apart at the start, within all steps of differences. */
static int kinked(void *user, const double *u, double *force, double *rates) {
    (void)user, (void)rates;
    if (force)
        force[0] = -40.0 * fabs(u[0] - 1e-5 - hypot(0.6 - 0.4 * cos(acos(-1.0) / 6.0), 0.35));
    return 0;
}

/* Differences come with an estimate of their error. The estimate is rounding for smooth laws, and as large as the
 * derivative at a kink. */
KT_TEST(differences_of_laws_tell_their_error) {
    for (int k = 0; k < 2; k++) {
        static mechanism m;
        kt_error error = {0};
        double q[2], v[2], by[2][4];
        describe(&m, true, false);
        if (k == 1)
            m.effects[1].law = kinked;
        m.model = kt_scene_compile(&m.description);
        kt_data *data = kt_test_data(m.model);
        if (data == NULL)
            return;
        const size_t size = kt_acceleration_work_size(m.model);
        void *work = aligned_alloc(KT_ALIGNMENT, size);
        kt_model_initial(m.model, q, v);
        (void)kt_fine(
            "derivatives",
            kt_acceleration_derivatives(m.model, data, work, size, 0.0, q, v, NULL, NULL, by[0], by[1], NULL, &error),
            &error);
        const double told = kt_data_difference_error(data);
        if (k == 0)
            kt_check_below("of smooth laws", told, 1e-9);
        else
            kt_check_above("at a kink", told, 1e-3);
        free(work);
    }
}

/* ---- what fails -------------------------------------------------------------------------------------------------- */

static void run_into(mechanism *m, const char *method, double step, kt_status code, const char *where,
                     const char *what) {
    kt_error error = {0};
    const kt_run by = run_by(method, step);
    kt_simulation *s = kt_test_simulation(m->model, &by, NULL);
    kt_check_equal_int(method, kt_simulation_advance(s, 1.0, &error), code);
    kt_check_contains("where", error.where, where);
    kt_check_contains("what", error.message, what);
    kt_check_below("not beyond", kt_simulation_time(s), 0.3001);
}

KT_TEST(laws_that_fail_are_named) {
    static mechanism m;
    make(&m, true, true);
    m.n.code = -7;
    run_into(&m, "rk4", 0.01, KT_ERROR_CALLBACK, "effect 'motor'", "code -7");
    m.n.breaks_rates = true;
    run_into(&m, "rk4", 0.01, KT_ERROR_CALLBACK, "state 'current'", "code -7");
    m.n.code = 2;
    run_into(&m, "dopri5", 0.0, KT_ERROR_EFFECT, "state 'current'", "code 2");
    m.n.code = 0;
    m.n.rate_of_state = (double)NAN;
    run_into(&m, "rk4", 0.01, KT_ERROR_NOT_FINITE, "state 'current'", "its rate is");
}

static void reject(const mechanism *m, const char *where, const char *words) {
    kt_error error = {0};
    kt_model *model = NULL;
    kt_check_equal_int(words, kt_model_compile(&m->description, NULL, &model, &error), KT_ERROR_MODEL);
    kt_check_contains("where", error.where, where);
    kt_check_contains("words", error.message, words);
    kt_model_free(model);
}

KT_TEST(wrong_laws_are_told) {
    static const struct {
        const char *variables[2], *states[2];
        const char *words;
    } table[] = {
        {{"velocity.amr", NULL}, {"current", "heat"}, "velocity.amr"},
        {{"2*t", "t"}, {"current", "heat"}, "'2*t' is a formula; give the name of a variable"},
        {{"t", "t"}, {"current", "heat"}, "'t' is listed twice"},
        {{"t", NULL}, {"current", "heat"}, "a name is NULL"},
        {{"t", "length"}, {"current", "heat"}, "length"},
        {{"t", "heat"}, {"current", "hat"}, "state 'hat' does not exist"},
        {{"t", "heat"}, {"current", "current"}, "'current' is listed twice"},
    };
    static mechanism m;
    const char *const three[] = {"current", "heat", "spare"};
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        describe(&m, true, true);
        m.effects[0].variables = table[k].variables;
        m.effects[0].variable_count = 2;
        m.effects[0].states = table[k].states;
        reject(&m, "effect 'motor'", table[k].words);
    }
    describe(&m, true, true);
    m.effects[0].state_count = 1;
    reject(&m, "state 'heat'", "rate is missing; give the formula of its derivative by time, or name it in an effect");
    m.effects[0].state_count = KT_LAW_STATE_MAX + 1;
    reject(&m, "effect 'motor'", "states: the count is 17; it must be 0 to 16");
    m.effects[0].state_count = 2;
    m.effects[0].variables = NULL;
    reject(&m, "effect 'motor'", "variables: the list is NULL, and its count 4");
    m.effects[0].variables = of_motor;
    m.effects[0].formula[0] = "t";
    reject(&m, "effect 'motor'", "both a formula and a law are given");
    m.effects[0].formula[0] = NULL;
    m.states[1].rate = "1";
    reject(&m, "effect 'motor'", "state 'heat' has both a formula for its rate and a law");
    m.states[1].rate = NULL;
    m.effects[2].states = three + 1;
    m.effects[2].state_count = 1;
    reject(&m, "state 'heat'", "the laws of two effects write it");
}
