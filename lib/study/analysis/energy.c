/* The energy along a run: the part of its change that is an integration error (kinetree/analysis.h has the
 * definitions).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/analysis.h"

#include <math.h>

/* The rounding error of energies that cancel, relative to the larger of kinetic and potential energy at the start. A
 * motion about a state at rest with less energy than this share does not define an energy scale. */
#define ROUNDING 1e-12

/* Energies below this are rounding, J: a spring of 1e12 N/m that is off by the rounding of a metre has less. A blow-up
 * exceeds any energy within a few steps. */
#define LEAST 1e-20

kt_energy_watch kt_energy_watch_start(const kt_model *model) {
    if (!model)
        return (kt_energy_watch){.start = (double)NAN};
    return (kt_energy_watch){.energetics = kt_model_energetics(model), .excess_time = (double)NAN};
}

/* Errors up to this are rounding, J. A body that is held at rest has a large potential energy and next to no energy of
 * motion, so that the rounding of the first exceeds the second. */
static double rounding_of_energies(const kt_energy_watch *watch) {
    const double potential = fmax(fabs(watch->potential[0]), fabs(watch->potential[1]));
    return fmax(LEAST, ROUNDING * fmax(watch->start_size, fmax(watch->kinetic, potential)));
}

/* Dissipated minus supplied energy since the start, J; NaN if unknown. */
static double net_work(const kt_energy_watch *watch, const kt_record *record) {
    return watch->has_balance ? record->work.dissipated - record->work.supplied : record->estimate.net;
}

static void begin_energy_watch(kt_energy_watch *watch, const kt_record *record) {
    watch->start = watch->lowest = record->kinetic + record->potential;
    watch->start_size = fmax(record->kinetic, fabs(record->potential));
    watch->potential[0] = watch->potential[1] = record->potential;
    watch->has_balance = !isnan(record->work.dissipated);
    watch->has_estimate = !watch->has_balance && !isnan(record->estimate.net);
    watch->balance_start = watch->start + net_work(watch, record);
}

/* The part of a change of the balance that exceeds the uncertainty of the work done. */
static double balance_error(kt_energy_watch *watch, const kt_record *record, double energy) {
    const double net = net_work(watch, record);
    if (isnan(net))
        return 0.0;
    if (watch->has_estimate) {
        watch->work = fmax(watch->work, record->estimate.turned);
        watch->uncertainty = fmax(watch->uncertainty, record->estimate.error);
    } else {
        watch->work = fmax(watch->work, fmax(fabs(record->work.dissipated), fabs(record->work.supplied)));
    }
    watch->balance_change = fmax(watch->balance_change, fabs(energy + net - watch->balance_start));
    return fmax(fabs(energy + net - watch->balance_start) - watch->uncertainty, 0.0);
}

/* Replace fmax and fmin without a call of the C library; a NaN changes nothing. */
static void raise_to(double *most, double x) { *most = x > *most ? x : *most; }
static void lower_to(double *least, double x) { *least = x < *least ? x : *least; }

void kt_energy_watch_add(kt_energy_watch *watch, const kt_record *record) {
    if (!watch || !record)
        return;
    const double energy = record->kinetic + record->potential;
    double error = 0.0;
    if (isnan(energy))
        return;
    if (watch->records++ == 0)
        begin_energy_watch(watch, record);
    lower_to(&watch->lowest, energy);
    raise_to(&watch->change, fabs(energy - watch->start));
    raise_to(&watch->kinetic, record->kinetic);
    lower_to(&watch->potential[0], record->potential);
    raise_to(&watch->potential[1], record->potential);
    if (watch->energetics == KT_ENERGY_CONSERVED)
        error = watch->change;
    if (watch->energetics != KT_ENERGY_SUPPLIED)
        raise_to(&watch->gain, energy - watch->lowest);
    if (watch->energetics == KT_ENERGY_DISSIPATED)
        error = watch->gain;
    if (watch->has_balance || watch->has_estimate)
        error = fmax(error, balance_error(watch, record, energy));
    raise_to(&watch->error, error);
    if (!(kt_energy_watch_error(watch) > KT_ENERGY_ERROR))
        watch->excess_time = (double)NAN; /* the scale has grown since */
    else if (isnan(watch->excess_time))
        watch->excess_time = record->t;
}

void kt_energy_watch_step(kt_energy_watch *watch, double kinetic, double potential) {
    if (!watch || watch->records == 0 || isnan(kinetic + potential))
        return;
    raise_to(&watch->kinetic, kinetic);
    lower_to(&watch->potential[0], potential);
    raise_to(&watch->potential[1], potential);
}

double kt_energy_watch_scale(const kt_energy_watch *watch) {
    if (!watch)
        return (double)NAN;
    double scale = watch->start - watch->potential[0];
    if (watch->energetics == KT_ENERGY_SUPPLIED)
        scale = fmax(fmax(watch->kinetic, watch->work), watch->potential[1] - watch->potential[0]);
    return fmax(scale, ROUNDING * watch->start_size);
}

double kt_energy_watch_error(const kt_energy_watch *watch) {
    if (!watch)
        return (double)NAN;
    const double scale = kt_energy_watch_scale(watch);
    return scale > 0.0 && watch->error > rounding_of_energies(watch) ? watch->error / scale : 0.0;
}

bool kt_energy_watch_is_blown_up(const kt_energy_watch *watch) {
    if (!watch)
        return false;
    const double scale = kt_energy_watch_scale(watch);
    return scale > 0.0 && watch->gain > KT_ENERGY_BLOW_UP * scale && watch->gain > fmax(watch->start_size, LEAST);
}
