/* kinetree modes --period: the Floquet multipliers of a periodic motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/output.h"
#include "subcommands/modes.h"
#include "text/json.h"

#include <math.h>
#include <stdio.h>

/* A larger gap, in rad or m, is reported: the motion does not return after the period. Rounding and the method cause
 * smaller gaps. */
#define KT_GAP_TOLD 1e-6

static json_t *describe_multipliers(const kt_small_motion *motion, const kt_floquet *floquet, double period) {
    json_t *root = json_object(), *list = json_array();
    json_object_set_new(root, "scene", json_string(motion->name));
    json_object_set_new(root, "period", kt_json_number(period));
    json_object_set_new(root, "gap", kt_json_number(kt_floquet_gap(floquet)));
    for (int i = 0; i < kt_floquet_count(floquet); i++) {
        const kt_multiplier m = kt_floquet_at(floquet, i);
        json_array_append_new(list,
                              json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:i}", "real", kt_json_number(m.real),
                                        "imaginary", kt_json_number(m.imaginary), "modulus", kt_json_number(m.modulus),
                                        "growth", kt_json_number(m.growth), "frequency", kt_json_number(m.frequency),
                                        "error", kt_json_number(m.error), "count", m.count));
    }
    json_object_set_new(root, "multipliers", list);
    return root;
}

static int print_multiplier_table(const kt_small_motion *motion, const kt_floquet *floquet, double period) {
    printf("%s: small differences from its motion over a period of %.9g s\n", kt_show(motion->name).text, period);
    printf("mode  %12s  %12s  %12s  %12s\n", "multiplier", "growth", "frequency", "uncertain");
    printf("      %12s  %12s  %12s  %12s\n", "modulus", "1/s", "Hz", "by");
    int growing = 0;
    for (int i = 0; i < kt_floquet_count(floquet); i++) {
        const kt_multiplier m = kt_floquet_at(floquet, i);
        const bool neutral = fabs(m.modulus - 1.0) <= m.error;
        printf("%4d  %12.9g  %12.6g  %12.6g  %12.1e%s\n", i + 1, m.modulus, neutral ? 0.0 : m.growth, m.frequency,
               m.error, m.count == 2 ? "  (pair)" : "");
        growing += m.modulus > 1.0 + m.error ? m.count : 0;
    }
    if (growing > 0)
        printf("The motion is unstable: %d multiplier%s above 1.\n", growing, growing == 1 ? " is" : "s are");
    else
        puts("No multiplier is above 1 by more than its uncertainty.");
    puts("Frequencies are those between 0 and half of 1 / period; multiples of 1 / period may be added.");
    return kt_finish_output(KT_EXIT_DONE);
}

int kt_modes_print_period(const kt_small_motion *motion, double period, long steps, bool json) {
    kt_floquet_options options = kt_floquet_options_default(period);
    kt_floquet *floquet = NULL;
    kt_error error = {0};
    if (steps > 0)
        options.steps = (int)steps;
    kt_status status = kt_floquet_create(motion->model, &options, &floquet, &error);
    if (status == KT_OK)
        status = kt_floquet_evaluate(floquet, 0.0, motion->q, motion->v, &error);
    int code = kt_say_status(status, &error);
    if (status == KT_OK) {
        if (!(kt_floquet_gap(floquet) <= KT_GAP_TOLD))
            kt_say("after %.9g s the motion is %.2g (rad or m) from its start: the period is another one, or the start "
                   "is not on the periodic motion. These multipliers describe this part of the motion only",
                   period, kt_floquet_gap(floquet));
        code = json ? kt_json_write(describe_multipliers(motion, floquet, period), "-")
                    : print_multiplier_table(motion, floquet, period);
    }
    kt_floquet_free(floquet);
    return code;
}
