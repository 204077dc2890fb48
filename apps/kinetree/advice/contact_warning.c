/* Warnings about hard contacts: a law had to be weakened, or it does not decide the motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

static const kt_counted failed_problems = {.code = "contact_failures",
                                           "the impulses of ",
                                           "problem",
                                           "problems",
                                           " of contacts were not found to 1e-7: the best ones were taken",
                                           "Compare with a smaller step, or with less friction"};

static const kt_counted reduced_impacts = {
    .code = "restitution",
    "at ",
    "impact",
    "impacts",
    " Newton's rule has no impulses, or would let the energy grow: restitutions were made less there",
    "Take `poisson: true`, smaller restitutions, or leave gaps so that impacts come one by one"};

static const kt_counted slow_slips = {
    .code = "contact_capped",
    "at ",
    "evaluation",
    "evaluations",
    " the iteration for the direction of slow slip did not converge: friction acted against the slip that there was",
    "Compare with a smaller `max_step`, or take elastic contacts (stiffness)"};

static const kt_counted jams = {
    .code = "friction_jammed",
    "at ",
    "instant",
    "instants",
    " no acceleration obeyed Coulomb's law (Painleve's paradox): an impulse without a collision stopped the slip",
    "Take less friction, or elastic contacts (stiffness)"};

/* Warns if friction of contacts allowed several motions. */
static void warn_of_undecided(kt_outcome *outcome) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    const bool shared = seen.redundant == seen.undecided;
    const kt_warning warning =
        kt_warning_at("friction_undecided", seen.undecided_time, (double)seen.undecided, NULL,
                      shared ? "Take three contacts for a flat face, or elastic contacts (stiffness)"
                             : "Take less friction, or elastic contacts (stiffness)");
    if (seen.undecided > 0)
        kt_warn(&outcome->warnings, &warning,
                "friction of contacts allowed more than one motion %llu time%s, first at '%s' at t = %.9g s (%s): the "
                "one %s was taken",
                (unsigned long long)seen.undecided, seen.undecided == 1 ? "" : "s",
                kt_loop_name(kt_simulation_model(outcome->simulation), seen.undecided_loop), seen.undecided_time,
                shared ? "more contacts than necessary share a load in several ways, and friction depends on the shares"
                       : "Painleve's paradox, or a wedge",
                shared ? "next to sticking" : "in which most sticks");
}

/* Warns if contacts at rest share a load in several ways, and records have their forces. */
static void warn_of_wedge(kt_outcome *outcome) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    const kt_warning wedged =
        kt_warning_of("reactions_shared", (double)seen.shared, NULL,
                      "Take an elastic contact (stiffness) for one of them where its force matters");
    const uint64_t record = kt_run_record(outcome->run, kt_simulation_model(outcome->simulation));
    if (seen.shared > 0 && (record & (KT_RECORD_EFFECT | KT_RECORD_REACTION)) != 0)
        kt_warn(&outcome->warnings, &wedged,
                "contacts at rest share a load in several ways, which a rigid body does not decide: the least forces "
                "within all friction cones are recorded");
}

/* Warns if a contact that was held had a force beyond the law. */
static void warn_of_excess(kt_outcome *outcome) {
    const kt_contact_excess seen = kt_simulation_contact_excess(outcome->simulation);
    const kt_warning warning =
        kt_warning_at("contact_excess", seen.time, seen.most, NULL,
                      "Compare with smaller steps, less friction, or elastic contacts (stiffness)");
    if (seen.steps > 0)
        kt_warn(
            &outcome->warnings, &warning,
            "no motion that obeys Coulomb's law was found: %llu step%s began with a force beyond it, most at '%s' at "
            "t = %.9g s, by %.3g of its friction cone (of its normal force if it pulls)",
            (unsigned long long)seen.steps, kt_plural((long long)seen.steps),
            kt_loop_name(kt_simulation_model(outcome->simulation), seen.loop), seen.time, seen.most);
}

/* Warns if time steps completed fixed steps. */
static void warn_of_completed(kt_outcome *outcome) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    const kt_completed_steps steps = kt_simulation_completed_steps(outcome->simulation);
    const kt_warning warning =
        kt_warning_at("step_completed", steps.time, (double)seen.completed, NULL,
                      "Take a smaller `step`, adaptive steps (a `tolerance`), or `contact: steps`");
    if (seen.completed == 0)
        return;
    kt_warn(
        &outcome->warnings, &warning,
        "contacts changed without end, or had no solution, within a fixed step: a time step over contacts completed "
        "%llu step%s, first at t = %.9g s, with an error in proportion to the step. Forces in %llu record%s are "
        "means over such a time step",
        (unsigned long long)seen.completed, kt_plural((long long)seen.completed), steps.time,
        (unsigned long long)steps.records, kt_plural((long long)steps.records));
}

/* Warns if impacts at one instant reached their limit. */
static void warn_of_dropped_speed(kt_outcome *outcome) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    const kt_warning warning =
        kt_warning_of("contact_dropped", seen.dropped, NULL, "Take a larger `rest_velocity`, or less restitution");
    if (seen.dropped > 0.0)
        kt_warn(&outcome->warnings, &warning,
                "impacts accumulated at one instant, and 100,000 of them left %.3g m/s (or rad/s): the contacts then "
                "stopped at once",
                seen.dropped);
}

void kt_warn_of_contacts(kt_outcome *outcome) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    kt_warn_of_count(outcome, seen.failures, &failed_problems);
    kt_warn_of_count(outcome, seen.reduced, &reduced_impacts);
    warn_of_undecided(outcome);
    warn_of_wedge(outcome);
    warn_of_dropped_speed(outcome);
    warn_of_excess(outcome);
    warn_of_completed(outcome);
    kt_warn_of_count(outcome, seen.jammed, &jams);
    kt_warn_of_count(outcome, seen.unconverged, &slow_slips);
}
