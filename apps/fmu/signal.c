/* Inputs in the place of functions of time (signal.h). Such a function is a parameter of the model: with the numbers
 * x, v, a and t0 it is x + v s + a s^2 / 2 with s = t - t0.
 *
 *     model exchange: t0 is the time of each evaluation, so that the function has the values of the inputs
 *     co-simulation:  t0 is the begin of each step. Within the step the function continues. If the inputs of the next
 *                     step differ from its end, it jumps there: loops close again, as at an event of the scene.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "signal.h"

#include "instance.h"
#include "present.h"

#include <stdlib.h>
#include <string.h>

/* Writes the next name of the list, and moves *at behind it. Returns false at the end. */
static bool next_name(const char **at, char name[KT_FMU_SIGNAL_NAME]) {
    const size_t length = strcspn(*at, ",\n");
    if (length == 0 || length >= KT_FMU_SIGNAL_NAME)
        return false;
    memcpy(name, *at, length);
    name[length] = '\0';
    *at += length;
    if (**at == ',')
        *at += strlen(KT_FMU_SIGNALS_BETWEEN);
    return true;
}

/* Returns the begin of the list; an empty text: there is none. */
static const char *signal_list_of(const kt_fmu *fmu) {
    const bool is_there = strncmp(fmu->scene_text, KT_FMU_SIGNALS, strlen(KT_FMU_SIGNALS)) == 0;
    return is_there ? fmu->scene_text + strlen(KT_FMU_SIGNALS) : "";
}

kt_status kt_fmu_list_signals(kt_fmu *fmu, kt_error *error) {
    kt_fmu_signals *s = &fmu->signals;
    char name[KT_FMU_SIGNAL_NAME];
    for (const char *at = signal_list_of(fmu); next_name(&at, name);)
        s->count++;
    const size_t room = (size_t)s->count + 1;
    s->signal = calloc(room, sizeof *s->signal);
    s->changes = calloc(room, sizeof *s->changes);
    if (s->signal == NULL || s->changes == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
    return KT_OK;
}

void kt_fmu_free_signals(kt_fmu *fmu) {
    free(fmu->signals.signal);
    free(fmu->signals.changes);
}

/* Gives the model the numbers of a signal. */
static kt_status put_signal(kt_fmu *fmu, int k, const double numbers[4], kt_error *error) {
    return kt_parameter_set(fmu->model, &fmu->signals.signal[k].parameter, numbers, error);
}

/* Gives the model the present values of all signals from the time t on. */
static kt_status put_signal_values(kt_fmu *fmu, double t, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < fmu->signals.count && status == KT_OK; k++) {
        kt_fmu_signal *signal = &fmu->signals.signal[k];
        memcpy(signal->set, signal->value, sizeof signal->value);
        signal->set[3] = t;
        status = put_signal(fmu, k, signal->set, error);
    }
    fmu->signals.are_set = status == KT_OK;
    return status;
}

kt_status kt_fmu_bind_signals(kt_fmu *fmu, double t, kt_error *error) {
    const char *at = signal_list_of(fmu);
    char name[KT_FMU_SIGNAL_NAME];
    for (int k = 0; k < fmu->signals.count && next_name(&at, name); k++) {
        kt_fmu_signal *signal = &fmu->signals.signal[k];
        double numbers[KT_PARAMETER_MAX] = {0.0};
        const bool is_first = signal->size == 0;
        kt_status status = kt_parameter_find(fmu->model, name, &signal->parameter, error);
        if (status == KT_OK)
            status = kt_parameter_get(fmu->model, &signal->parameter, numbers, error);
        if (status != KT_OK)
            return status;
        signal->size = kt_fmu_signal_size(signal->parameter.key);
        for (int i = 0; i < signal->size && is_first; i++)
            signal->value[i] = signal->start[i] = numbers[i];
    }
    return put_signal_values(fmu, t, error);
}

void kt_fmu_reset_signals(kt_fmu *fmu) {
    for (int k = 0; k < fmu->signals.count; k++)
        memcpy(fmu->signals.signal[k].value, fmu->signals.signal[k].start, sizeof fmu->signals.signal[k].value);
}

/* Computes the numbers that the signal has in the model at the time t. */
static void write_present(const kt_fmu_signal *signal, double t, double numbers[4]) {
    const double *set = signal->set, s = t - set[3];
    memcpy(numbers, set, sizeof signal->set);
    if (signal->parameter.kind == KT_PARAMETER_EFFECT_VALUE)
        return;
    numbers[0] += s * (set[1] + 0.5 * s * set[2]);
    numbers[1] += s * set[2];
    numbers[3] = t;
}

static bool signals_differ(const double *a, const double *b) { return a[0] != b[0] || a[1] != b[1] || a[2] != b[2]; }

/* Lists the signals that jump. */
static int list_signal_jumps(kt_fmu *fmu) {
    int count = 0;
    for (int k = 0; k < fmu->signals.count; k++) {
        kt_fmu_signal *signal = &fmu->signals.signal[k];
        kt_parameter_change *change = &fmu->signals.changes[count];
        double now[4];
        write_present(signal, fmu->time, now);
        signal->jumps = signals_differ(now, signal->value);
        if (!signal->jumps)
            continue;
        *change = (kt_parameter_change){.parameter = signal->parameter};
        memcpy(change->values, signal->value, sizeof signal->value);
        change->values[3] = fmu->time;
        count++;
    }
    return count;
}

kt_status kt_fmu_take_signals(kt_fmu *fmu, kt_error *error) {
    if (fmu->signals.are_set || fmu->signals.count == 0)
        return KT_OK;
    if (fmu->is_exchange)
        return put_signal_values(fmu, fmu->time, error);
    const int count = list_signal_jumps(fmu);
    kt_status status = KT_OK;
    if (count > 0)
        status = kt_simulation_change(fmu->simulation, fmu->model, fmu->signals.changes, count, NULL, error);
    if (status != KT_OK)
        return status;
    for (int k = 0; k < fmu->signals.count; k++) {
        kt_fmu_signal *signal = &fmu->signals.signal[k];
        if (!signal->jumps)
            continue;
        memcpy(signal->set, signal->value, sizeof signal->value);
        signal->set[3] = fmu->time;
    }
    if (count > 0)
        kt_fmu_change(fmu);
    fmu->signals.are_set = true;
    return KT_OK;
}

kt_status kt_fmu_show_signals(kt_fmu *fmu, kt_error *error) {
    const bool is_pending = !fmu->is_exchange && fmu->phase == KT_FMU_EVENT;
    return is_pending ? KT_OK : kt_fmu_take_signals(fmu, error);
}

bool kt_fmu_signal_moves(const kt_fmu *fmu, int i) {
    const kt_fmu_signal *signal = &fmu->signals.signal[i / KT_FMU_SIGNAL_MOST];
    return signal->parameter.kind == KT_PARAMETER_LOOP_CURVE && i % KT_FMU_SIGNAL_MOST < signal->size - 1;
}

double *kt_fmu_signal_at(const kt_fmu *fmu, int i) {
    kt_fmu_signal *signal = &fmu->signals.signal[i / KT_FMU_SIGNAL_MOST];
    return i % KT_FMU_SIGNAL_MOST < signal->size ? &signal->value[i % KT_FMU_SIGNAL_MOST] : NULL;
}

kt_status kt_fmu_shift_signals(kt_fmu *fmu, double distance, const double *along, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < fmu->signals.count && status == KT_OK; k++) {
        const kt_fmu_signal *signal = &fmu->signals.signal[k];
        double numbers[4];
        write_present(signal, fmu->time, numbers);
        for (int i = 0; i < KT_FMU_SIGNAL_MOST && distance != 0.0; i++)
            numbers[i] += distance * along[k * KT_FMU_SIGNAL_MOST + i];
        status = put_signal(fmu, k, distance != 0.0 ? numbers : signal->set, error);
    }
    if (fmu->signals.count > 0)
        kt_fmu_forget_present(fmu->simulation);
    return status;
}

/* ---- in a block -------------------------------------------------------------------------------------------------- */

size_t kt_fmu_signal_numbers(const kt_fmu *fmu) { return 7 * (size_t)fmu->signals.count + 1; }

double *kt_fmu_save_signals(const kt_fmu *fmu, double *to) {
    for (int k = 0; k < fmu->signals.count; k++, to += 7) {
        memcpy(to, fmu->signals.signal[k].value, 3 * sizeof *to);
        memcpy(to + 3, fmu->signals.signal[k].set, 4 * sizeof *to);
    }
    *to++ = fmu->signals.are_set;
    return to;
}

kt_status kt_fmu_restore_signals(kt_fmu *fmu, const double *from, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < fmu->signals.count && status == KT_OK; k++, from += 7) {
        memcpy(fmu->signals.signal[k].value, from, 3 * sizeof *from);
        memcpy(fmu->signals.signal[k].set, from + 3, 4 * sizeof *from);
        status = put_signal(fmu, k, from + 3, error);
    }
    fmu->signals.are_set = status == KT_OK && *from != 0.0;
    return status;
}
