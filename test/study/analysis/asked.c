/* Linearisations, modes and spectra with impossible or empty requests: the calls return messages and change nothing. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "small.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const kt_vec3 none = {0.0, 0.0, 0.0}, down = {0.0, -1.0, 0.0};

static void check_words(const char *what, kt_status status, const kt_error *error, kt_status expected,
                        const char *words) {
    kt_check_equal_int(what, status, expected);
    kt_check_contains("message", error->message, words);
}

/* A bar that hangs from a revolute joint. */
static void make_bar(linkage *l, double angle) {
    linkage_begin(l);
    linkage_bar(l, "bar", NULL, none, down, angle, 0.0);
    linkage_compile(l);
}

/* ---- what is laid out ---------------------------------------------------------------------------------------------
 */

KT_TEST(indices_below_zero_and_memory_that_is_none_are_rejected) {
    static linkage l;
    const int below = -1;
    const kt_marker_index body = {-1, 0}, marker = {1, -1};
    kt_linearization_options settings = kt_linearization_options_default();
    kt_linearization *linearization = NULL;
    kt_modes *modes = NULL;
    kt_spectrum *spectrum = NULL;
    kt_error e = {KT_OK, "", ""};
    make_bar(&l, 0.3);
    settings.inputs = &below;
    settings.input_count = 1;
    check_words("input", kt_linearization_create(l.model, &settings, &linearization, &e), &e, KT_ERROR_ARGUMENT,
                "-1 is no velocity coordinate: they go from 0 to 0");
    settings = (kt_linearization_options){.outputs = &body, .output_count = 1};
    check_words("body", kt_linearization_create(l.model, &settings, &linearization, &e), &e, KT_ERROR_ARGUMENT,
                "there is no body -1");
    settings.outputs = &marker;
    check_words("marker", kt_linearization_create(l.model, &settings, &linearization, &e), &e, KT_ERROR_ARGUMENT,
                "body 'bar' has no marker -1");
    settings = (kt_linearization_options){.input_count = -1};
    check_words("count", kt_linearization_create(l.model, &settings, &linearization, &e), &e, KT_ERROR_ARGUMENT,
                "a count is negative");
    settings = (kt_linearization_options){.output_count = -1};
    check_words("count", kt_linearization_create(l.model, &settings, &linearization, &e), &e, KT_ERROR_ARGUMENT,
                "a count is negative");
    check_words("samples", kt_spectrum_create(l.model, 0, &spectrum, &e), &e, KT_ERROR_ARGUMENT,
                "0: at least one state is needed");
    check_words("samples", kt_spectrum_create(l.model, -3, &spectrum, &e), &e, KT_ERROR_ARGUMENT,
                "-3: at least one state is needed");

    const size_t size = kt_spectrum_size(l.model, 2); /* the largest of them */
    char *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_need(kt_check_true("memory", memory != NULL));
    check_words("none", kt_linearization_init(l.model, NULL, NULL, size, &linearization, &e), &e, KT_ERROR_MEMORY,
                "bytes");
    check_words("none", kt_modes_init(l.model, NULL, size, &modes, &e), &e, KT_ERROR_MEMORY,
                "(kt_modes_size); given: 0 bytes");
    check_words("small", kt_modes_init(l.model, memory, kt_modes_size(l.model) - 1, &modes, &e), &e, KT_ERROR_MEMORY,
                "(kt_modes_size)");
    check_words("askew", kt_modes_init(l.model, memory + 8, size - 8, &modes, &e), &e, KT_ERROR_MEMORY, "misaligned");
    check_words("none", kt_spectrum_init(l.model, 2, NULL, size, &spectrum, &e), &e, KT_ERROR_MEMORY, "given: 0 bytes");
    check_words("small", kt_spectrum_init(l.model, 2, memory, size - 1, &spectrum, &e), &e, KT_ERROR_MEMORY,
                "(kt_spectrum_size)");
    check_words("askew", kt_spectrum_init(l.model, 2, memory + 8, size, &spectrum, &e), &e, KT_ERROR_MEMORY,
                "misaligned");
    kt_check_true("nothing was handed out", linearization == NULL && modes == NULL && spectrum == NULL);
    free(memory);
    kt_linearization_free(NULL);
    kt_modes_free(NULL);
    kt_spectrum_free(NULL);
    kt_constraint_formulation_free(NULL);
}

/* ---- linearisations ------------------------------------------------------------------------------------------------
 */

/* A spring in a joint that can be evaluated only within `reach` of the angle 0.3. */
typedef struct elastic {
    double reach;
    int code;
} elastic;

static int drive(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    const elastic *s = user;
    (void)t;
    (void)v;
    (void)balance;
    if (!(fabs(q - 0.3) <= s->reach))
        return s->code;
    *force = -50.0 * q;
    return 0;
}

/* A bar that hangs by one, without gravity. */
static void elastic_bar(linkage *l, kt_effect *effect, elastic *spring) {
    linkage_begin(l);
    l->description.gravity = none;
    linkage_bar(l, "bar", NULL, none, down, 0.3, 0.0);
    *effect = kt_effect_of(KT_EFFECT_CUSTOM, "bar");
    effect->name = "spring";
    effect->joint_force = drive;
    effect->user = spring;
    l->description.effects = effect;
    l->description.effect_count = 1;
}

/* A uniform bar of 1 kg and 1 m turns about its end: `q'' = -50 q / I`, `I = 1/3`. */
KT_TEST(derivatives_are_taken_within_reach_of_what_an_effect_can_tell) {
    static linkage l;
    elastic spring = {0.01, 1};
    kt_effect effect;
    kt_error e = {KT_OK, "", ""};
    small s = {0};
    elastic_bar(&l, &effect, &spring);
    linkage_compile(&l);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    const double stiffness = small_at(s.system->state, 2, 1, 0);
    kt_check_near("-k / I", stiffness, -150.0, fmax(4.0 * small_at(s.system->state_error, 2, 1, 0), 1e-10));
    kt_check_below("and it knows how well", small_at(s.system->state_error, 2, 1, 0), 1e-8);
    spring.reach = 0.0;
    check_words("told nowhere else", kt_linearization_evaluate(s.linearization, 0.0, l.q, l.v, NULL, &e), &e,
                KT_ERROR_EFFECT, "its callback cannot compute its force here (code 1)");
    kt_check_contains("where", e.where, "effect 'spring'");
    kt_check_equal_int("nobody need hear of it", kt_linearization_evaluate(s.linearization, 0.0, l.q, l.v, NULL, NULL),
                       KT_ERROR_EFFECT);
    kt_check_equal_bits("what was known stays", s.system->state + 1, &stiffness, 1);
    check_words("no time", kt_linearization_evaluate(s.linearization, HUGE_VAL, l.q, l.v, NULL, &e), &e,
                KT_ERROR_NOT_FINITE, "the time is inf; give a finite number");
    const double tau = (double)NAN;
    spring.reach = 1.0;
    check_words("torque", kt_linearization_evaluate(s.linearization, 0.0, l.q, l.v, &tau, &e), &e, KT_ERROR_NOT_FINITE,
                "force or torque");
    double q = 0.3;
    spring.reach = 0.01; /* rest is at zero, outside the reach */
    kt_equilibrium found;
    kt_check_true("no equilibrium", kt_equilibrium_find(s.linearization, NULL, 0.0, &q, NULL, &found, &e) != KT_OK);
    kt_note("%s: %s", e.where, e.message);
    kt_check_near("the position is untouched", q, 0.3, 0.0);
    q = (double)NAN;
    check_words("nowhere", kt_equilibrium_find(s.linearization, NULL, 0.0, &q, NULL, &found, &e), &e,
                KT_ERROR_NOT_FINITE, "position");
}

KT_TEST(equilibrium_that_takes_more_steps_than_allowed_names_the_joint) {
    static linkage l;
    kt_error e = {KT_OK, "", ""};
    small s = {0};
    make_bar(&l, 2.0);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    kt_equilibrium_options options = kt_equilibrium_options_default();
    double q = 2.0;
    options.most = 1;
    check_words("one step", kt_equilibrium_find(s.linearization, &options, 0.0, &q, NULL, NULL, &e), &e, KT_ERROR_STEP,
                "steps");
    kt_note("%s: %s", e.where, e.message);
    kt_check_contains("where", e.where, "bar");
    kt_check_near("the position is untouched", q, 2.0, 0.0);
    options.most = 0;
    kt_check_equal_int("as many as it takes", kt_equilibrium_find(s.linearization, &options, 0.0, &q, NULL, NULL, &e),
                       KT_OK);
    kt_check_near("hanging", q, 0.0, 1e-18);
}

/* A free body of 2 kg on a bushing of 50 N/m to the world sinks by m g / k, and turns nowhere. */
KT_TEST(free_body_sinks_into_its_bushing) {
    static linkage l;
    kt_effect bushing = kt_effect_default();
    kt_error e = {KT_OK, "", ""};
    small s = {0};
    linkage_begin(&l);
    kt_body *body = linkage_bar(&l, "block", NULL, none, down, 0.0, 0.0);
    body->joint.type = KT_JOINT_FREE;
    body->joint.position[3] = 1.0;
    body->mass = 2.0;
    body->com = none;
    body->inertia = kt_sym3_make(1.0, 2.0, 3.0, 0.0, 0.0, 0.0);
    bushing.type = KT_EFFECT_BUSHING;
    bushing.between[1].body = "block";
    for (int k = 0; k < 6; k++)
        bushing.stiffnesses[k] = 50.0;
    l.description.effects = &bushing;
    l.description.effect_count = 1;
    linkage_compile(&l);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    double q[7];
    memcpy(q, l.q, sizeof q);
    kt_need_fine("rests", kt_equilibrium_find(s.linearization, NULL, 0.0, q, NULL, NULL, &e), &e);
    kt_check_near("y", q[1], -2.0 * 9.81 / 50.0, 1e-14);
    kt_check_near("w", fabs(q[3]), 1.0, 4.0 * DBL_EPSILON);
}

/* At t = 0 the crank is at rest, but it accelerates: `1 + t^2`. */
KT_TEST(loop_that_is_about_to_move_has_no_equilibrium) {
    static linkage l;
    static const double numbers[3] = {1.0, 0.0, 1.0};
    const four_bar f = four_bar_default();
    kt_error e = {KT_OK, "", ""};
    linkage_four_bar(&l, &f);
    kt_loop *motion = linkage_close(&l, "drive", KT_LOOP_MOTION, NULL, none, NULL, none);
    motion->joint = "crank";
    motion->function = (kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = numbers, .number_count = 3};
    l.body[0].joint.velocity[0] = 0.0;
    linkage_build(&l, 0.0);
    kt_linearization *linearization = kt_test_linearization(l.model, NULL);
    const double before = l.q[1];
    check_words("driven", kt_equilibrium_find(linearization, NULL, 0.0, l.q, NULL, NULL, &e), &e, KT_ERROR_CONSTRAINT,
                "it drives the mechanism at t = 0 s");
    kt_check_text("where", e.where, "loop 'drive'");
    kt_check_equal_bits("the position is untouched", &l.q[1], &before, 1);
}

/* A parallelogram stretched flat may go on as one or crossed; it is alone, and named alone. */
KT_TEST(change_point_is_rejected_by_the_loop_s_name) {
    static linkage l;
    const four_bar f = {1.0, 2.0, 1.0, 2.0, {0.0, 0.0, 0.0}, 1.0, 1.0, KT_LOOP_REVOLUTE};
    kt_error e = {KT_OK, "", ""};
    linkage_four_bar(&l, &f);
    linkage_compile(&l);
    kt_linearization *linearization = kt_test_linearization(l.model, NULL);
    kt_check_equal_int("status", kt_linearization_evaluate(linearization, 0.0, l.q, l.v, NULL, &e), KT_ERROR_SINGULAR);
    kt_note("%s: %s", e.where, e.message);
    kt_check_contains("where", e.where, "close");
    kt_check_true("no others", strstr(e.where, "share") == NULL && strstr(e.message, "share") == NULL);
}

/* ---- modes ----------------------------------------------------------------------------------------------------------
 */

KT_TEST(modes_of_a_strange_system_are_rejected) {
    static linkage bar, bars;
    kt_error e = {KT_OK, "", ""};
    small s = {0}, other = {0};
    linkage_begin(&bars);
    linkage_bar(&bars, "upper", NULL, none, down, 0.3, 0.0);
    linkage_bar(&bars, "lower", "upper", down, down, 0.1, 0.0);
    make_bar(&bar, 0.3);
    linkage_compile(&bars);
    small_open(&s, bar.model, NULL, 0.0, bar.q, bar.v, NULL);
    small_open(&other, bars.model, NULL, 0.0, bars.q, bars.v, NULL);
    const kt_mode before = kt_modes_at(s.modes, 0);
    kt_check_equal_int("another's", kt_modes_evaluate(s.modes, other.system, &e), KT_ERROR_ARGUMENT);
    kt_note("%s", e.message);
    kt_linear_system broken = *s.system;
    double state[4];
    memcpy(state, broken.state, sizeof state);
    state[2] = (double)NAN;
    broken.state = state;
    check_words("NaN", kt_modes_evaluate(s.modes, &broken, &e), &e, KT_ERROR_NOT_FINITE,
                "the eigenvalues of the state matrix cannot be found");
    broken = *s.system;
    broken.states = 3; /* of one coordinate there are two at most */
    kt_check_equal_int("too many states", kt_modes_evaluate(s.modes, &broken, &e), KT_ERROR_ARGUMENT);
    (void)kt_fine("again", kt_modes_evaluate(s.modes, s.system, &e), &e);
    const kt_mode after = kt_modes_at(s.modes, 0);
    kt_check_equal_bits("frequency", &after.frequency, &before.frequency, 1);
}

/* Nothing moves: no states, no modes, nothing that bounds a step. */
KT_TEST(mechanism_without_freedoms_has_no_modes) {
    static linkage l;
    small s = {0};
    kt_error e = {KT_OK, "", ""};
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, none, down, 0.0, 0.0)->joint.type = KT_JOINT_FIXED;
    linkage_compile(&l);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    kt_spectrum *spectrum = kt_test_spectrum(l.model, 2);
    kt_check_equal_int("states", s.system->states, 0);
    kt_check_equal_int("modes", kt_modes_count(s.modes), 0);
    kt_check_near("error", s.system->error, 0.0, 0.0);
    (void)kt_fine("add", kt_spectrum_add(spectrum, 0.0, l.q, l.v, NULL, &e), &e);
    kt_check_equal_int("fastest", kt_spectrum_fastest(spectrum), -1);
    const kt_step_limit limit = kt_spectrum_limit(spectrum, kt_method_find("rk4"), 1.0, 0.1);
    kt_check_true("no limit", isinf(limit.step) && limit.mode == -1);
}

/* ---- spectra along a motion -----------------------------------------------------------------------------------------
 */

/* A bar with a small swing: a cosine of frequency `w = sqrt(3 g / 2 l) / (2 pi)`, at every state. */
static void check_along(kt_spectrum *spectrum, const kt_run *run, const char *what) {
    kt_error e = {KT_OK, "", ""};
    kt_need_fine(what, kt_spectrum_along(spectrum, run, &e), &e);
    kt_check_equal_int("states", kt_spectrum_samples(spectrum), 3);
    for (int i = 0; i < kt_spectrum_count(spectrum); i++)
        kt_check_near("frequency", kt_spectrum_at(spectrum, i).mode.imaginary, sqrt(1.5 * 9.81), 1e-5);
}

KT_TEST(motion_is_looked_at_adaptively_whatever_the_run_asks_for) {
    static linkage l;
    kt_error e = {KT_OK, "", ""};
    kt_run run = kt_run_default();
    make_bar(&l, 1e-3);
    kt_spectrum *spectrum = kt_test_spectrum(l.model, 3);
    run.duration = 0.5;
    check_along(spectrum, &run, "adaptive");
    run.integrator = "rk4";
    run.step = 0.4; /* far too long for following the motion */
    check_along(spectrum, &run, "fixed");
    run.step = 0.0;
    check_along(spectrum, &run, "a method that needs a step");
    run.integrator = NULL;
    check_along(spectrum, &run, "no method");
    run.integrator = "leapfrog";
    check_along(spectrum, &run, "an unknown method");
    run.duration = 0.0; /* its start, three times */
    check_along(spectrum, &run, "no time");
    kt_check_near("time", kt_spectrum_at(spectrum, kt_spectrum_count(spectrum) - 1).t, 0.0, 0.0);
    run.duration = (double)NAN;
    check_words("no duration", kt_spectrum_along(spectrum, &run, &e), &e, KT_ERROR_ARGUMENT, "must be zero or more");
    kt_check_equal_int("nothing is kept", kt_spectrum_samples(spectrum), 0);
    const double q = (double)NAN;
    check_words("nowhere", kt_spectrum_add(spectrum, 0.0, &q, l.v, NULL, &e), &e, KT_ERROR_NOT_FINITE, "position");
    kt_check_equal_int("nothing is kept", kt_spectrum_count(spectrum), 0);

    /* with rk4 an undamped mode may grow by the given limit at most; a message names the mode if the step is too
     * long */
    run = kt_run_default();
    run.duration = 0.5;
    check_along(spectrum, &run, "again");
    const kt_step_limit limit = kt_spectrum_limit(spectrum, kt_method_find("rk4"), 100.0, 2.0);
    kt_check_true("a limit", limit.step < 2.0 && limit.mode >= 0);
    kt_check_above("growth, in decades", log10(limit.growth), 3.0);
}

/* The spring cannot be evaluated once the bar has left its reach. The states up to there are kept. */
KT_TEST(motion_that_ends_leaves_the_modes_up_to_there) {
    static linkage l;
    elastic spring = {0.2, -1};
    kt_effect effect;
    kt_error e = {KT_OK, "", ""};
    kt_run run = kt_run_default();
    elastic_bar(&l, &effect, &spring);
    linkage_compile(&l);
    kt_spectrum *spectrum = kt_test_spectrum(l.model, 20);
    run.duration = 1.0;
    check_words("along", kt_spectrum_along(spectrum, &run, &e), &e, KT_ERROR_CALLBACK,
                "its callback stopped (code -1)");
    /* 0.3 cos(w t) leaves 0.1 after acos(1/3) / w = 0.1005 s: two of 0, 0.0526, 0.105, ... */
    kt_check_equal_int("states", kt_spectrum_samples(spectrum), 2);
}
