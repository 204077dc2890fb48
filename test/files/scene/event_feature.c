/* Events whose formulas have many features in time: the search for features shares its operations with all searches of
 * the run, also in one that goes on from a checkpoint. Each event that no search missed is compared with samples. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/formula_breakpoint.h"
#include "kinetree/scene.h"
#include "model/function_formula.h"
#include "simulation/simulation.h"

#include <math.h>
#include <stdio.h>

#include "check.h"
#include "math/expression/steep.h"
#include "running.h"
#include "sanitized.h"

enum { TEXT = 4096, MEMORY = 8192, MOST = 40000 };

/* A scene that is simulated with its events. */
typedef struct featured {
    running run;
    int count;
    double times[MOST]; /* of its events */
} featured;

/* A mass that a force moves. Its event is a change of sign of the formula less the level. */
static void begin(featured *f, const char *force, const char *formula, double level) {
    char text[TEXT];
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\n"
                   "gravity: [0, 0, 0]\n"
                   "bodies:\n"
                   "  - {name: mass, joint: {type: prismatic, axis: x}, mass: 1}\n"
                   "effects:\n"
                   "  - {type: motor, joint: mass, force: \"%s\"}\n"
                   "events:\n"
                   "  - {name: level, when: \"%s - (%.17g)\", then: record}\n"
                   "simulate: {duration: 10}\n"
                   "output: {interval: 0.1}\n",
                   force, formula, level);
    f->count = 0;
    f->run = running_start(text, NULL);
}

static int keep(const kt_record *record, void *user) {
    featured *f = user;
    if (record->event != NULL && f->count < MOST)
        f->times[f->count++] = record->t;
    return 0;
}

/* ---- samples ----------------------------------------------------------------------------------------------------- */

/* The changes of sign between samples within which no event lies, and the events at which no sign changes. */
typedef struct faults {
    int missed, wrong, sampled;
} faults;

static faults compare(const featured *f, const kt_expression *formula, double level) {
    enum { SAMPLES = 100000 };
    static const double duration = 10.0, near = 1e-9;
    faults found = {0, 0, 0};
    double from = 0.0, before = kt_expression_evaluate(formula, &from) - level;
    int event = 0;
    for (int i = 1; i <= SAMPLES; i++) {
        const double to = duration * i / SAMPLES, value = kt_expression_evaluate(formula, &to) - level;
        int within = 0;
        for (; event < f->count && f->times[event] <= to; event++)
            within++;
        found.sampled += before * value < 0.0;
        found.missed += before * value < 0.0 && within == 0;
        before = value;
    }
    for (int i = 0; i < f->count; i++) {
        const double a = f->times[i] - near, b = f->times[i] + near;
        found.wrong +=
            !((kt_expression_evaluate(formula, &a) - level) * (kt_expression_evaluate(formula, &b) - level) <= 0.0);
    }
    return found;
}

/* All searches of a run take at most the operations that a run has, of which this one has a part, and the 60 bisections
 * of one more change. A run without cut searches misses no event that samples show. The long tier adds formulas. */
KT_TEST(searches_of_events_share_a_limit) {
    enum { FORMULAS = KT_SHORT(8, 24), LIMIT = KT_BREAKPOINT_OPERATIONS / 4 };
    static featured f;
    kt_random random = kt_random_of_test();
    KT_WORST taken = kt_worst_make("operations over the limit"), wrong = kt_worst_make("events without a root");
    KT_WORST missed = kt_worst_make("missed events"), cuts = kt_worst_make("cut");
    int asked = 0, cut = 0, compared = 0, sampled = 0;
    double least = HUGE_VAL;
    for (int i = 0; i < FORMULAS; i++) {
        static double memory[MEMORY];
        char text[1024];
        const kt_expression *formula = NULL;
        kt_error error = {0};
        kt_write_steep_formula(&random, text, sizeof text);
        const double at = kt_random_uniform(&random, 0.0, 10.0);
        if (!kt_is_asked(&asked, 10) ||
            kt_formula_of_time(text, memory, sizeof memory, &formula, NULL, &error) != KT_OK)
            continue;
        const double level = kt_expression_evaluate(formula, &at);
        begin(&f, "1", text, level);
        f.run.simulation->memory.sought = KT_BREAKPOINT_OPERATIONS - LIMIT;
        const kt_status status = kt_simulation_run(f.run.simulation, keep, &f, &error);
        if (status != KT_OK)
            kt_check_text(text, error.message, "");
        const double used = (double)(f.run.simulation->memory.sought - (KT_BREAKPOINT_OPERATIONS - LIMIT));
        const uint64_t count = kt_simulation_counts_of(f.run.simulation).cut;
        kt_worst_below(&taken, used, LIMIT + 60.0 * (double)formula->count, "%s", text);
        kt_worst_below(&cuts, (double)count, 16 + 16 * 7, "%s", text);
        if (count > 0)
            least = fmin(least, used);
        cut += count > 0;
        const faults found = compare(&f, formula, level);
        kt_worst_below(&wrong, found.wrong, 0.5, "%s", text);
        if (count == 0) {
            kt_worst_below(&missed, found.missed, 0.5, "%s", text);
            compared++;
            sampled += found.sampled;
        }
    }
    kt_check_above("operations of a run that is cut", least, 0.01 * LIMIT);
    kt_check_above("formulas that are cut", cut, 0.5);
    kt_check_above("formulas that are compared", compared, 0.5);
    kt_check_above("roots that samples show", sampled, 0.5);
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* A restored run has no more operations for its events, although the last search for the force is repeated. */
KT_TEST(restored_run_cuts_the_same_searches_of_events) {
    static double block[8192];
    static featured first, second;
    static const char force[] = "exp(-((t - 5)/2)^2)"; /* its first feature is at 2.55 s */
    static const char formula[] = "tanh(20*sin(200*t)) + exp(-(5*sin(190*t))^2)";
    kt_error error = {0};
    begin(&first, force, formula, 0.3);
    begin(&second, force, formula, 0.3);
    kt_need(kt_check_true("room", kt_simulation_state_size(first.run.simulation) <= sizeof block));
    first.run.simulation->memory.sought = KT_BREAKPOINT_OPERATIONS / 20 * 19;
    kt_check_equal_int("advance", kt_simulation_advance(first.run.simulation, 1.5, &error), KT_OK);
    const uint64_t before = kt_simulation_counts_of(first.run.simulation).cut;
    kt_simulation_save(first.run.simulation, block);
    kt_check_equal_int("restore", kt_simulation_restore(second.run.simulation, block, &error), KT_OK);
    kt_check_equal_int("advance", kt_simulation_advance(first.run.simulation, 3.0, &error), KT_OK);
    kt_check_equal_int("advance", kt_simulation_advance(second.run.simulation, 3.0, &error), KT_OK);
    const kt_simulation_counts a = kt_simulation_counts_of(first.run.simulation),
                               b = kt_simulation_counts_of(second.run.simulation);
    kt_check_above("cut before", (double)before, 0.5);
    kt_check_above("cut behind", (double)(a.cut - before), 0.5);
    kt_check_equal_int("cut in the restored run", (long)b.cut, (long)a.cut);
    kt_check_equal_int("operations", second.run.simulation->memory.sought, first.run.simulation->memory.sought);
    kt_check_equal_int("events", (long)kt_simulation_event_count(second.run.simulation, "level"),
                       (long)kt_simulation_event_count(first.run.simulation, "level"));
    kt_check_equal_bits("velocities", kt_simulation_velocities(second.run.simulation),
                        kt_simulation_velocities(first.run.simulation), 1);
}
