/* `contact_count MECHANISM open|closed` evaluates accelerations once with the kernels of the baseline, for callgrind to
 * count the instructions (contact_cost.py). MECHANISM is a name in the table `subjects`. Its first contacts are closed,
 * and stick or slip; or the mechanism has no contacts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/mechanism.h"
#include "mechanisms.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct count_subject {
    const char *name;
    void (*make)(kt_contact_mechanism *m);
    int closed;
    bool sticks;
} subjects[] = {
    {"box-slips", kt_mechanism_tripod, 3, false},          {"quadruped-slips", kt_mechanism_quadruped, 4, false},
    {"quadruped-sticks", kt_mechanism_quadruped, 4, true}, {"quadruped-one-sticks", kt_mechanism_quadruped, 1, true},
    {"humanoid-sticks", kt_mechanism_humanoid, 8, true},   {"chain-stopped", kt_mechanism_chain, 10, false},
    {"four-bar-stopped", kt_mechanism_fourbar, 1, false},
};

enum { WAYS = 2, NV = 64 };

static kt_contact_mechanism mechanism;
static double q[NV], v[NV], a[NV];

/* The model without contacts, and the one in which the first contacts are closed. A contact with friction has two
 * switches, and that of its friction comes second. */
static const kt_model *model_of(const struct count_subject *s, const kt_model *made, bool closed) {
    const int each = kt_switch_count(made) / mechanism.items;
    uint64_t set = 0;
    for (int k = 0; k < s->closed * each; k++)
        set |= k % each == 0 || s->sticks ? kt_switch_bits(made, k) : 0;
    return closed ? kt_model_switched(made, set) : made;
}

int main(int argc, char **argv) {
    const struct count_subject *s = NULL;
    kt_model *made[WAYS] = {NULL};
    const kt_model *model[WAYS] = {NULL};
    kt_data *data[WAYS] = {NULL};
    kt_error error = {0};
    kt_status status = KT_OK;
    for (size_t i = 0; i < sizeof subjects / sizeof *subjects && argc == 3; i++)
        s = strcmp(argv[1], subjects[i].name) == 0 ? &subjects[i] : s;
    if (s == NULL)
        return 2;
    s->make(&mechanism);
    for (int k = 0; k < WAYS && status == KT_OK; k++) {
        status = kt_mechanism_compile(&mechanism, k == 1, KT_ISA_BASE, &made[k], &error);
        model[k] = status == KT_OK ? model_of(s, made[k], k == 1) : NULL;
        if (status == KT_OK)
            status = model[k] ? kt_data_create(model[k], &data[k], &error) : KT_ERROR_UNSUPPORTED;
    }
    if (status == KT_OK) {
        kt_model_initial(model[0], q, v);
        for (int i = 0; i < kt_model_nv(model[0]); i++)
            v[i] = 0.3 * sin(1.0 + i);
        status = kt_state_assemble(model[0], data[0], 0.0, q, v, &error);
    }
    if (status == KT_OK)
        status = kt_velocity_impact(model[1], data[1], 0.0, q, v, NULL, &error);
    const int way = argc == 3 && strcmp(argv[2], "closed") == 0;
    if (status == KT_OK)
        status = kt_acceleration_evaluate(model[way], data[way], 0.0, q, v, NULL, NULL, a, &error);
    if (status != KT_OK)
        (void)fprintf(stderr, "%s: %s\n", error.where, error.message);
    for (int k = 0; k < WAYS; k++) {
        kt_data_free(data[k]);
        kt_model_free(made[k]);
    }
    return status == KT_OK ? 0 : 1;
}
