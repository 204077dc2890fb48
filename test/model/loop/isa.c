/* The same bits on every instruction set that this processor has. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include "dynamics/dynamics.h"

static const kt_loop_kind *const *kinds_of(kt_isa isa) {
#ifdef KT_ISAS
    if (isa == KT_ISA_V4)
        return kt_loop_kinds_v4;
    if (isa == KT_ISA_V3)
        return kt_loop_kinds_v3;
#endif
    return isa == KT_ISA_BASE ? kt_loop_kinds_baseline : NULL;
}

/* Every number of the rows: 11 a row. */
static size_t flatten(const kt_loop_row *rows, int count, double *out) {
    size_t n = 0;
    for (int r = 0; r < count; r++) {
        for (int k = 0; k < 4; k++) {
            out[n++] = rows[r].moment[k];
            out[n++] = rows[r].force[k];
        }
        out[n++] = rows[r].residual;
        out[n++] = rows[r].rate;
        out[n++] = rows[r].drift;
    }
    return n;
}

KT_TEST(every_level_gives_the_same_bits) {
    enum { MANY = 100, ROW = 11 };
    static double expected[KT_LOOP_TYPE_COUNT * MANY * KT_LOOP_ROW_MAX * ROW];
    static double observed[KT_LOOP_TYPE_COUNT * MANY * KT_LOOP_ROW_MAX * ROW];
    const kt_isa levels[3] = {KT_ISA_BASE, KT_ISA_V3, KT_ISA_V4};
    for (int i = 0; i < 3; i++) {
        if (kt_isa_resolve(levels[i]) != levels[i] || !kinds_of(levels[i])) {
            kt_skip(levels[i] == KT_ISA_V3 ? "v3" : "v4", KT_NO_ISA);
            continue;
        }
        kt_random random = kt_random_of_test();
        size_t used = 0;
        for (int n = 0; n < MANY; n++)
            for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
                const kt_loop_kind *kind = kinds_of(levels[i])[type];
                double numbers[MOVING_NUMBERS];
                const kt_loop_record loop = moving_loop(&random, type, numbers);
                const moving a = moving_random(&random, 1.0), b = moving_random(&random, 1.0);
                const kt_loop_end end[2] = {moving_end(&a, NULL), moving_end(&b, NULL)};
                kt_loop_row rows[KT_LOOP_ROW_MAX] = {0};
                if (kind->relate) {
                    const kt_relation_row row = kind->relate(&loop, numbers, 1.25, (double)n);
                    rows[0].residual = row.residual, rows[0].rate = row.rate, rows[0].drift = row.drift;
                }
                const int count = kind->relate ? 1 : kind->evaluate(&loop, numbers, end, (double)n, rows);
                used += flatten(rows, count, (i ? observed : expected) + used);
            }
        if (i)
            kt_check_equal_bits("numbers", observed, expected, used);
        else
            kt_check_true("numbers are written", used > MANY * KT_LOOP_TYPE_COUNT * ROW);
    }
}
