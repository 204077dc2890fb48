/* Warnings about changes of energy that the scene cannot cause, with a suggested remedy. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/excess.h"
#include "open/start.h"
#include "subcommands/run.h"

#include <math.h>
#include <stdio.h>

/* Returns whether the watch costs at most 2 % of the evaluations of a step, and loops do not drive the motion. The
 * counts are instructions (callgrind):
 *
 *     watch, once a step   250 + 50 for each effect
 *     evaluation           800 + 500 for each body + 300 for each degree of freedom
 *                          + 160 for each effect on a joint + 600 for each other effect
 *
 * Measured costs are 0.01 to 2.8 % of a step. A cart and a pole with four effects has the largest share. If loops drive
 * the motion, powers also need inverse dynamics, and the watch costs 4 to 6 %. */
static bool is_cheap(const kt_outcome *outcome, const kt_method *method) {
    const kt_description *d = &outcome->scene->description;
    double watch = 250.0, evaluation = 800.0 + 500.0 * d->body_count + 300.0 * kt_model_nv(outcome->model);
    for (int i = 0; i < d->effect_count; i++) {
        watch += 50.0;
        evaluation += d->effects[i].joint != NULL ? 160.0 : 600.0;
    }
    return !kt_is_driven(d) && watch <= 0.02 * method->stages * evaluation;
}

bool kt_watches_works(const kt_outcome *outcome) {
    const kt_method *method = kt_method_find(outcome->run->integrator);
    return outcome->so_far.energy.energetics != KT_ENERGY_CONSERVED && method != NULL && is_cheap(outcome, method) &&
           (kt_run_record(outcome->run, outcome->model) & KT_RECORD_BALANCE) == 0;
}

bool kt_energy_is_known(const kt_energy_watch *energy) {
    return energy->records > 0 &&
           (energy->has_balance || energy->has_estimate || energy->energetics != KT_ENERGY_SUPPLIED);
}

const char *kt_energy_not_watched(const kt_outcome *outcome) {
    const kt_energy_watch *energy = &outcome->so_far.energy;
    if (energy->records == 0 || energy->has_balance || energy->has_estimate ||
        energy->energetics == KT_ENERGY_CONSERVED)
        return NULL;
    return energy->energetics == KT_ENERGY_SUPPLIED
               ? "that would cost more than 2 % here; record 'balance' to watch it"
               : "except for growth, since the rest would cost more than 2 % here; record 'balance' to watch it";
}

/* Writes the remedy for an error of the energy. The error of a method of order p is proportional to h^p. Therefore h is
 * reduced by the p-th root of the reduction of the error. Errors of 0.1 and more are outside of this asymptotic
 * range. */
static void write_remedy(const kt_outcome *outcome, double error, char *text, size_t size) {
    const kt_run *run = outcome->run;
    const kt_method *method = run->integrator != NULL ? kt_method_find(run->integrator) : NULL;
    const char *also = outcome->unprojected && kt_loop_count(outcome->model) > 0 ? ", and leave out --unprojected" : "";
    const bool in_proportion = error < 0.1 && method != NULL;
    const double shorter = 0.9 * KT_ENERGY_ERROR / error;
    const bool rounding = kt_simulation_counts_of(outcome->simulation).crossings.error > run->relative;
    double step = in_proportion ? run->step * pow(shorter, 1.0 / (double)method->order) : 0.0;
    if (outcome->advised_step > 0.0 && outcome->advised_step < step)
        step = outcome->advised_step;
    if (run->step > 0.0 && in_proportion)
        snprintf(text, size, "Take steps below %.2g s, or a method of higher order%s", step, also);
    else if (outcome->scene->contact == KT_CONTACT_STEPS)
        snprintf(text, size, "Take much smaller steps, or events: --set simulate.contact=events");
    else if (run->step > 0.0)
        snprintf(text, size,
                 "Take much smaller steps, or an adaptive method, as --integrator dopri5 --tolerance 1e-9%s", also);
    else if (rounding)
        snprintf(text, size,
                 "Positions closer than rounding decide the motion next to a singular position of the loops: a smaller "
                 "tolerance does not help%s",
                 also);
    else if (in_proportion)
        snprintf(text, size, "Take a tolerance below %.2g%s", run->relative * shorter, also);
    else
        snprintf(text, size, "Take a much smaller tolerance%s", also);
}

void kt_warn_of_energy(kt_outcome *outcome) {
    const kt_energy_watch *energy = &outcome->so_far.energy;
    const double error = kt_energy_watch_error(energy), scale = kt_energy_watch_scale(energy);
    char remedy[192];
    if (!(error > KT_ENERGY_ERROR) || outcome->is_blown_up || kt_is_held(outcome))
        return;
    write_remedy(outcome, error, remedy, sizeof remedy);
    const kt_warning warning = kt_warning_at("energy", energy->excess_time, error, NULL, remedy);
    if (energy->energetics == KT_ENERGY_CONSERVED)
        kt_warn(&outcome->warnings, &warning,
                "the total energy is off by %.3g J, %.2g times the energy of the motion (%.3g J), while nothing in the "
                "scene supplies or dissipates any; the error exceeds %g of that from t = %g s on",
                energy->error, error, scale, KT_ENERGY_ERROR, energy->excess_time);
    else if (energy->energetics == KT_ENERGY_DISSIPATED && energy->error == energy->gain)
        kt_warn(
            &outcome->warnings, &warning,
            "the total energy rises by %.3g J, %.2g times the energy of the motion (%.3g J), while the scene can only "
            "dissipate it; the error exceeds %g of that from t = %g s on",
            energy->error, error, scale, KT_ENERGY_ERROR, energy->excess_time);
    else if (energy->has_estimate)
        kt_warn(&outcome->warnings, &warning,
                "the balance of energies (kinetic + potential + dissipated - supplied) is off by %.3g J more than the "
                "uncertainty of the work done (%.2g J), which is estimated at the ends of steps. That is %.2g of the "
                "energy of the motion (%.3g J); the error exceeds %g of that from t = %g s on",
                energy->error, energy->uncertainty, error, scale, KT_ENERGY_ERROR, energy->excess_time);
    else
        kt_warn(&outcome->warnings, &warning,
                "the balance of energies (kinetic + potential + dissipated - supplied) is off by %.3g J, %.2g of the "
                "energy of the motion (%.3g J); the error exceeds %g of that from t = %g s on",
                energy->error, error, scale, KT_ENERGY_ERROR, energy->excess_time);
}

/* Warns if the energy has a larger error than usual steps leave. If the errors of all steps add up, each step
 * contributes less than a tenth of the tolerance. A thirtieth was measured in linkages away from singular positions. */
void kt_warn_of_passages(kt_outcome *outcome) {
    const kt_energy_watch *energy = &outcome->so_far.energy;
    const kt_simulation_counts counts = kt_simulation_counts_of(outcome->simulation);
    const double error = kt_energy_watch_error(energy), tolerance = outcome->run->relative;
    const kt_warning warning = kt_warning_of("singular_energy", energy->error, "J",
                                             "Compare with runs of slightly different lengths or starts, and with one "
                                             "of a smaller tolerance");
    if (outcome->run->step == 0.0 && counts.crossings.near > 0 && !(error > KT_ENERGY_ERROR) &&
        error > tolerance * fmax(100.0, 0.1 * (double)counts.steps))
        kt_warn(&outcome->warnings, &warning,
                "the energy is off by %.2g J, %.2g of that of the motion (%.3g J) and more than a tolerance of %g "
                "explains. The motion passes a singular position of the loops, in which a direction of their equations "
                "has %.2g of its usual size. Rounding is magnified there, and the path may bend within a step",
                energy->error, error, kt_energy_watch_scale(energy), tolerance, counts.crossings.smallest);
}

void kt_say_excess(kt_outcome *outcome) {
    const kt_warning warning = {.code = "blow_up",
                                .time = kt_simulation_time(outcome->simulation),
                                .value = (double)NAN,
                                .is_said = true,
                                .remedy = "Take smaller steps, or an adaptive method"};
    outcome->is_blown_up = true;
    kt_say("%s", outcome->excess.message);
    kt_warn(&outcome->warnings, &warning, "%s", outcome->excess.message);
}

void kt_say_blown_up(kt_outcome *outcome, double time) {
    const kt_energy_watch *energy = &outcome->so_far.energy;
    const double scale = kt_energy_watch_scale(energy);
    outcome->is_blown_up = true;
    const char *remedy = outcome->run->step > 0.0
                             ? "Take smaller steps ('kinetree stability' shows which are stable), or an adaptive method"
                             : "Take a smaller tolerance";
    const kt_warning warning = {
        .code = "blow_up", .time = time, .value = energy->gain, .unit = "J", .is_said = true, .remedy = remedy};
    kt_say("t = %.9g s: the total energy has risen by %.3g J, %.2g times the energy of the motion (%.3g J), in a scene "
           "that cannot gain any: the integration has blown up. %s",
           time, energy->gain, energy->gain / scale, scale, remedy);
    kt_warn(&outcome->warnings, &warning,
            "the total energy has risen by %.3g J in a scene that cannot gain any: the integration has blown up",
            energy->gain);
}
