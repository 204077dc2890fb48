/* Warnings of irregularities that a simulation has counted. They are iterations and searches that reached a limit,
 * missing Jacobians, and velocities that events could not set. They are also states next to dead points and singular
 * positions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/linear.h"
#include "subcommands/run.h"

void kt_warn_of_count(kt_outcome *outcome, uint64_t count, const kt_counted *counted) {
    const kt_warning warning = kt_warning_of(counted->code, (double)count, NULL, counted->remedy);
    if (count > 0)
        kt_warn(&outcome->warnings, &warning, "%s%llu %s%s", counted->before, (unsigned long long)count,
                count == 1 ? counted->one : counted->many, counted->after);
}

/* All searches of a run share a limit. */
static const kt_counted cut_searches = {
    .code = "cut_search",
    "",
    "search for the next feature of a formula of time was",
    "searches for the next feature of a formula of time were",
    " cut after too many evaluations: a pulse of the formula, or an event, may have been missed",
    "Make the formula simpler, or bound the steps by a fraction of its shortest feature (--max-step)"};

/* A run may pass the dead point, or end there. */
static const kt_counted joined_states = {.code = "joined",
                                         "at a dead point of the drives the acceleration has no usable value: ",
                                         "state within steps that end there is",
                                         "states within steps that end there are",
                                         " interpolated between their ends alone",
                                         "Let the drives keep away from the dead point, or take shorter steps there"};

/* Warns if steps of an implicit method continued without a new Jacobian, or without convergence of Newton's iteration.
 * An estimate of the fastest decay (rkc2, rkc4) that has not converged is used with a margin. Only the summary lists
 * it. */
static void warn_of_caps(kt_outcome *outcome) {
    const unsigned long long capped = kt_simulation_counts_of(outcome->simulation).capped;
    const kt_method *method = kt_method_find(outcome->run->integrator);
    const kt_warning warning =
        kt_warning_of("capped", (double)capped, NULL, "Take smaller steps or another method, and compare the results");
    if (capped == 0 || method == NULL || !kt_method_is_implicit(method))
        return;
    if (method->gamma != NULL)
        kt_warn(&outcome->warnings, &warning,
                "%llu step%s took the Jacobian of an earlier one, or none, since the Jacobian could not be computed: "
                "the order of %s is lower",
                capped, capped == 1 ? "" : "s", method->name);
    else
        kt_warn(&outcome->warnings, &warning,
                "in %llu step%s, Newton's iteration came no nearer to the solution than 1e-7 of the state; the last "
                "iterate was accepted",
                capped, capped == 1 ? "" : "s");
}

/* Warns if the time of an event was searched too coarsely in fixed steps. */
static void warn_of_event_cuts(kt_outcome *outcome) {
    const kt_event_cuts cuts = kt_simulation_event_cuts(outcome->simulation);
    const kt_warning warning = kt_warning_at("cut_event_search", cuts.time, (double)cuts.count, NULL,
                                             "Take a smaller step (--step), or an adaptive method, which finds them");
    if (cuts.count == 0)
        return;
    kt_warn(&outcome->warnings, &warning,
            "the search for the time of event '%.60s' was cut in %llu step%s, first at t = %.6g s, since joints turn "
            "or the "
            "event's formula changes too often within a step of %g s: events may have been missed",
            cuts.event->name, (unsigned long long)cuts.count, cuts.count == 1 ? "" : "s", cuts.time,
            outcome->run->step);
}

/* Warns if rounding decides how a motion continues next to a singular position. This also applies to driven and damped
 * motions. */
static void warn_of_crossings(kt_outcome *outcome) {
    const kt_crossings seen = kt_simulation_counts_of(outcome->simulation).crossings;
    const kt_warning warning =
        kt_warning_of("singular", seen.error, NULL,
                      "Compare with runs of slightly different lengths or starts: they may take another branch");
    if (seen.error > outcome->run->relative)
        kt_warn(&outcome->warnings, &warning,
                "next to a singular position of the loops, a direction of their equations has %.2g of its usual size. "
                "Rounding decides how the motion continues: it is uncertain by %.2g of a radian or of the mechanism's "
                "length, more than the tolerance of %g",
                seen.smallest, seen.error, outcome->run->relative);
}

/* Warns if the rounding of lengths may decide on which branch a motion continues. If lengths have a relative error d,
 * branches that would meet miss each other. The motion then comes as near to the singular position as s = sqrt(d).
 * Measurements on parallelograms of many sizes gave 3.3 times this distance. */
static void warn_of_branches(kt_outcome *outcome) {
    const kt_crossings seen = kt_simulation_counts_of(outcome->simulation).crossings;
    const double off = seen.smallest * seen.smallest, accepted = outcome->scene->description.tolerance;
    const kt_warning warning = kt_warning_of("branch", off, NULL,
                                             "Give lengths with more digits, or compare with runs of slightly "
                                             "different ones; `initial: {tolerance: 0}` declares them exact");
    if (seen.bend > 0.0 && off < 16.0 * accepted)
        kt_warn(&outcome->warnings, &warning,
                "next to a singular position of the loops the motion bends away onto another branch, since lengths "
                "have relative errors of %.1g at most. That may be their rounding (`initial: {tolerance: %g}`), and "
                "their last digits decide how the motion continues",
                off, accepted);
}

/* Warns if fixed steps leap over a bend of the path next to a singular position. */
static void warn_of_leaps(kt_outcome *outcome) {
    const double step = outcome->run->step, bend = kt_simulation_counts_of(outcome->simulation).crossings.bend;
    const kt_warning warning = kt_warning_of(
        "long_step", step, "s", "Take a step below a tenth of that, or an adaptive method, which finds it");
    if (bend > 0.0 && step > 0.5 * bend)
        kt_warn(
            &outcome->warnings, &warning,
            "next to a singular position of the loops the path bends within %.2g s: steps of %g s leap over the bend",
            bend, step);
}

/* Warns if loops left events no choice of a velocity that they set. */
static void warn_of_missed(kt_outcome *outcome) {
    const kt_scene_missed missed = kt_scene_watch_missed(outcome->events);
    const kt_warning warning =
        kt_warning_at("set_velocity", missed.time, missed.got, NULL,
                      "Set one velocity for each degree of freedom that the loops leave, or release a loop before");
    if (missed.count == 0)
        return;
    kt_warn(&outcome->warnings, &warning,
            "an event set velocity.%s to %g at t = %.6g s, and it became %g, since the loops or the velocities set "
            "before decide "
            "it%s",
            kt_name_column(outcome->model, missed.velocity).text, missed.given, missed.time, missed.got,
            missed.count > 1 ? "; others later likewise" : "");
}

void kt_warn_of_counts(kt_outcome *outcome) {
    const kt_simulation_counts counts = kt_simulation_counts_of(outcome->simulation);
    warn_of_missed(outcome);
    warn_of_caps(outcome);
    kt_warn_of_count(outcome, counts.cut, &cut_searches);
    warn_of_event_cuts(outcome);
    kt_warn_of_count(outcome, counts.joined, &joined_states);
    warn_of_crossings(outcome);
    warn_of_branches(outcome);
    warn_of_leaps(outcome);
}
