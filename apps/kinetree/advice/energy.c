/* Warnings about changes of energy that the scene cannot cause, with a suggested remedy. */
#include "subcommands/run.h"

#include <math.h>
#include <stdio.h>

/* The error of a method of order p is proportional to h^p, so that h is reduced by the p-th root of the reduction of
 * the error. Errors of 0.1 and more are outside of this asymptotic range. */
static void write_remedy(const kt_outcome *outcome, double error, char *text, size_t size) {
    const kt_run *run = outcome->run;
    const kt_method *method = run->integrator != NULL ? kt_method_find(run->integrator) : NULL;
    const char *also = outcome->unprojected && kt_loop_count(outcome->model) > 0 ? ", and leave out --unprojected" : "";
    const bool in_proportion = error < 0.1 && method != NULL;
    const double shorter = 0.9 * KT_ENERGY_ERROR / error;
    double step = in_proportion ? run->step * pow(shorter, 1.0 / (double)method->order) : 0.0;
    if (outcome->advised_step > 0.0 && outcome->advised_step < step)
        step = outcome->advised_step;
    if (run->step > 0.0 && in_proportion)
        snprintf(text, size, "Take steps below %.2g s, or a method of higher order%s", step, also);
    else if (run->step > 0.0)
        snprintf(text, size,
                 "Take much smaller steps, or an adaptive method, as --integrator dopri5 --tolerance 1e-9%s", also);
    else if (in_proportion)
        snprintf(text, size, "Take a tolerance below %.2g%s", run->relative * shorter, also);
    else
        snprintf(text, size, "Take a much smaller tolerance%s", also);
}

void kt_warn_of_energy(kt_outcome *outcome) {
    const kt_energy_watch *energy = &outcome->energy;
    const double error = kt_energy_watch_error(energy), scale = kt_energy_watch_scale(energy);
    char remedy[192];
    if (!(error > KT_ENERGY_ERROR) || outcome->is_blown_up)
        return;
    write_remedy(outcome, error, remedy, sizeof remedy);
    const kt_warning warning = {
        .code = "energy", .time = energy->excess_time, .value = error, .unit = NULL, .remedy = remedy};
    if (energy->energetics == KT_ENERGY_CONSERVED)
        kt_warn(&outcome->warnings, &warning,
                "the total energy is off by %.3g J, %.2g of the energy of the motion (%.3g J), while nothing in the "
                "scene supplies or dissipates any; the error exceeds %g of that from t = %g s on",
                energy->error, error, scale, KT_ENERGY_ERROR, energy->excess_time);
    else if (energy->energetics == KT_ENERGY_DISSIPATED && energy->error == energy->gain)
        kt_warn(&outcome->warnings, &warning,
                "the total energy rises by %.3g J, %.2g of the energy of the motion (%.3g J), while the scene can only "
                "dissipate it; the error exceeds %g of that from t = %g s on",
                energy->error, error, scale, KT_ENERGY_ERROR, energy->excess_time);
    else
        kt_warn(&outcome->warnings, &warning,
                "the balance of energies (kinetic + potential + dissipated - supplied) is off by %.3g J, %.2g of the "
                "energy of the motion (%.3g J); the error exceeds %g of that from t = %g s on",
                energy->error, error, scale, KT_ENERGY_ERROR, energy->excess_time);
}

void kt_say_blown_up(kt_outcome *outcome, double time) {
    const kt_energy_watch *energy = &outcome->energy;
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
