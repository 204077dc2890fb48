/* An effect fails at its n-th evaluation, n = 1, 2, ... The call then fails with the effect's message, and earlier
 * results stay. It may also be right all the same, if it can do without a neighbouring evaluation.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "small.h"

#include "kinetree/effect.h"

#include <math.h>
#include <string.h>

typedef struct counted {
    int calls, failing;
    bool lasting; /* all that follow fail, too */
} counted;

static int drive(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    counted *c = user;
    (void)t;
    (void)v;
    if (balance != NULL)
        balance->energy = 1.5 * q * q;
    *force = -3.0 * q;
    c->calls++;
    return c->calls == c->failing || (c->lasting && c->calls > c->failing && c->failing > 0) ? -1 : 0;
}

typedef struct stand {
    linkage l;
    kt_effect effects[2];
    kt_marker marker;
    counted c;
    small s;
} stand;

/* A four-bar with a spring of the caller's in its crank, a motor there, and a marker on its coupler. */
static void open_stand(stand *d) {
    const four_bar f = four_bar_default();
    memset(&d->c, 0, sizeof d->c);
    linkage_four_bar(&d->l, &f);
    d->effects[0] = d->effects[1] = kt_effect_default();
    d->effects[0].name = "spring";
    d->effects[0].type = KT_EFFECT_CUSTOM;
    d->effects[0].joint = "crank";
    d->effects[0].joint_force = drive;
    d->effects[0].user = &d->c;
    d->effects[1].type = KT_EFFECT_MOTOR;
    d->effects[1].joint = "crank";
    d->effects[1].torque = (kt_function){.type = KT_FUNCTION_CONSTANT, .value = 0.5};
    d->l.description.effects = d->effects;
    d->l.description.effect_count = 2;
    d->marker = (kt_marker){.name = "middle", .at = kt_vec3_make(1.0, 0.0, 0.0)};
    d->l.body[1].markers = &d->marker;
    d->l.body[1].marker_count = 1;
    linkage_build(&d->l, 0.0);
    const kt_marker_index middle = {kt_body_find(d->l.model, "coupler"), 0};
    const kt_linearization_options options = {.outputs = &middle, .output_count = 1};
    small_open(&d->s, d->l.model, &options, 0.0, d->l.q, d->l.v, NULL);
}

/* The outcome of the calls with n = 1, 2, ... */
typedef struct outcome {
    int tried, rejected, wordless, touched, wrong;
} outcome;

static void check(const char *what, const outcome *seen, double least) {
    kt_note("%s: %d of %d rejected", what, seen->rejected, seen->tried);
    kt_check_above("evaluations that failed", seen->tried, least);
    kt_check_above("of these rejected", seen->rejected, 1.0);
    kt_check_equal_int("rejections in other words", seen->wordless, 0);
    kt_check_equal_int("rejections that touched what was known", seen->touched, 0);
    kt_check_equal_int("results that are wrong", seen->wrong, 0);
}

static void note_rejection(outcome *seen, kt_status status, const kt_error *e, bool same) {
    seen->rejected++;
    seen->wordless += status != KT_ERROR_CALLBACK || e->code != status || strstr(e->where, "effect 'spring'") == NULL;
    seen->touched += !same;
}

KT_TEST(linearisation_survives_each_failing_evaluation) {
    static stand d;
    outcome seen = {0};
    open_stand(&d);
    double known[4], output[12];
    memcpy(known, d.s.system->state, sizeof known);
    memcpy(output, d.s.system->output, sizeof output);
    for (int lasting = 0; lasting < 2; lasting++)
        for (int n = 1;; n++) {
            kt_error e = {KT_OK, "", ""};
            d.c = (counted){.failing = n, .lasting = lasting};
            const kt_status status = kt_linearization_evaluate(d.s.linearization, 0.0, d.l.q, d.l.v, NULL, &e);
            if (d.c.calls < n)
                break;
            const kt_linear_system *s = kt_linearization_system(d.s.linearization);
            seen.tried++;
            if (status != KT_OK)
                note_rejection(&seen, status, &e,
                               memcmp(s->state, known, sizeof known) == 0 &&
                                   memcmp(s->output, output, sizeof output) == 0);
            for (int i = 0; i < 4 && status == KT_OK; i++)
                seen.wrong += !(fabs(s->state[i] - known[i]) <= 4.0 * s->state_error[i] + 1e-9 * fabs(known[i]));
            d.c = (counted){0};
            kt_need_fine("again", kt_linearization_evaluate(d.s.linearization, 0.0, d.l.q, d.l.v, NULL, &e), &e);
        }
    check("linearisation", &seen, 50.0);
}

KT_TEST(equilibrium_survives_each_failing_evaluation) {
    static stand d;
    for (int nearest = 0; nearest < 2; nearest++) {
        outcome seen = {0};
        kt_equilibrium_options options = kt_equilibrium_options_default();
        kt_error e = {KT_OK, "", ""};
        double rest[3];
        options.nearest = nearest;
        open_stand(&d);
        memcpy(rest, d.l.q, sizeof rest);
        kt_need_fine("rest", kt_equilibrium_find(d.s.linearization, &options, 0.0, rest, NULL, NULL, &e), &e);
        for (int n = 1;; n += n < 60 ? 1 : 7) {
            double q[3];
            memcpy(q, d.l.q, sizeof q);
            d.c = (counted){.failing = n, .lasting = n % 2};
            const kt_status status = kt_equilibrium_find(d.s.linearization, &options, 0.0, q, NULL, NULL, &e);
            if (d.c.calls < n)
                break;
            seen.tried++;
            if (status != KT_OK && status != KT_ERROR_STEP) /* or no step leads on */
                note_rejection(&seen, status, &e, memcmp(q, d.l.q, sizeof q) == 0);
            for (int i = 0; i < 3 && status == KT_OK; i++)
                seen.wrong += !(fabs(q[i] - rest[i]) <= 1e-7);
        }
        check(nearest ? "nearest" : "stable", &seen, 20.0);
    }
}

KT_TEST(spectrum_survives_each_failing_evaluation) {
    static stand d;
    outcome seen = {0};
    kt_error e = {KT_OK, "", ""};
    open_stand(&d);
    kt_spectrum *spectrum = kt_test_spectrum(d.l.model, 2);
    (void)kt_fine("first", kt_spectrum_add(spectrum, 0.0, d.l.q, d.l.v, NULL, &e), &e);
    const int count = kt_spectrum_count(spectrum);
    for (int n = 1;; n++) {
        d.c = (counted){.failing = n, .lasting = true};
        const kt_status status = kt_spectrum_add(spectrum, 0.5, d.l.q, d.l.v, NULL, &e);
        if (status == KT_OK)
            break;
        seen.tried++;
        note_rejection(&seen, status, &e, kt_spectrum_count(spectrum) == count && kt_spectrum_samples(spectrum) == 1);
    }
    kt_check_equal_int("twice as many modes in the end", kt_spectrum_count(spectrum), 2 * count);
    check("spectrum", &seen, 3.0);
    kt_check_equal_int("no room", kt_spectrum_add(spectrum, 1.0, d.l.q, d.l.v, NULL, &e), KT_ERROR_ARGUMENT);
    kt_check_text("message", e.message, "there is room for 2 states");
}

/* At its start the row of windows is folded level, which is left out; later it is not. */
KT_TEST(singular_states_of_a_motion_are_left_out) {
    static linkage l;
    kt_error e = {KT_OK, "", ""};
    kt_run run = kt_run_default();
    run.duration = 0.2;
    linkage_windows(&l, 2, acos(0.0), 1.0, KT_LOOP_REVOLUTE);
    linkage_compile(&l);
    kt_spectrum *spectrum = kt_test_spectrum(l.model, 3);
    kt_need_fine("along", kt_spectrum_along(spectrum, &run, &e), &e);
    kt_check_equal_int("states", kt_spectrum_samples(spectrum), 2);
    kt_check_near("the first of them", kt_spectrum_at(spectrum, 0).t, 0.1, 1e-15);
}
