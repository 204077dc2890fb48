/* Past singular positions at a small distance: the path bends, and no interpolation may cut the corner. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "sanitized.h"

#include "kinetree/study.h"

#include <math.h>
#include <stdlib.h>

/* Bars of `2.5, 2, 1.5` and a crank of `1 - d`. Stretched out, the mechanism is off the line by d, and its path bends
 * within some sqrt(d). It falls from rest. */
static void build(linkage *l, double d, kt_reduction reduction, kt_plan plan) {
    const double pi = 3.14159265358979324;
    const char *hold[] = {"crank"};
    const four_bar f = {.crank = 1.0 - d,
                        .coupler = 2.0,
                        .rocker = 1.5,
                        .ground = 2.5,
                        .size = 1.0,
                        .type = KT_LOOP_REVOLUTE,
                        .angle = {pi * 120.0 / 180.0, -pi * 113.0 / 180.0, pi * 132.0 / 180.0}};
    linkage_four_bar(l, &f);
    l->options.reduction = kt_reduction_method_of(reduction);
    l->options.plan = plan;
    l->description.hold = hold;
    l->description.hold_count = 1;
    linkage_build(l, 0.0);
}

static double energy(const linkage *l, double *kinetic) {
    kt_error e = {0};
    kt_need_fine("kinematics", kt_kinematics_update(l->model, l->data, l->q, l->v, NULL, &e), &e);
    *kinetic = fmax(*kinetic, kt_kinetic_energy(l->model, l->data));
    return kt_kinetic_energy(l->model, l->data) + kt_potential_energy(l->model, l->data);
}

/* The largest change of the energy over the largest kinetic energy, in 2 s: two to four bends. */
static double lost(linkage *l, const char *method) {
    linkage_run r;
    double most = 0.0, kinetic = 0.0;
    const double first = energy(l, &kinetic);
    linkage_run_start(&r, l, method, 0.0, 1e-10, false, 0.0);
    for (int i = 1; i <= 40; i++) {
        linkage_run_to(&r, 0.05 * i);
        const double change = fabs(energy(l, &kinetic) - first);
        most = change <= most ? most : change; /* keeps a NaN */
    }
    return most / kinetic;
}

/* Tested on either side, at every distance. Measured: 1e-9 to 4e-8. Interpolation across the bend gives 1e-4 to 0.6. */
KT_TEST(motions_past_a_singular_position_keep_their_energy) {
    static const struct {
        const char *name;
        kt_reduction reduction;
        kt_plan plan;
    } ways[] = {{"planar", KT_REDUCTION_QR, KT_PLAN_AUTO},
                {"in space", KT_REDUCTION_QR, KT_PLAN_SPATIAL},
                {"singular values", KT_REDUCTION_SVD, KT_PLAN_AUTO},
                {"partition", KT_REDUCTION_PARTITION, KT_PLAN_SPATIAL}};
    static linkage l;
    int asked = 0;
    for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++) {
        KT_WORST worst = kt_worst_make(ways[w].name);
        for (int k = KT_SHORT(-12, -13); k <= 13; k += KT_SHORT(3, 1)) {
            if (!kt_is_asked(&asked, 5))
                continue;
            const double d = k ? copysign(pow(10.0, -3.0 - 0.75 * (13 - abs(k))), k) : 0.0;
            build(&l, d, ways[w].reduction, ways[w].plan);
            kt_worst_below(&worst, lost(&l, "dopri5"), 1e-7, "off by %g", d);
        }
    }
}

/* The report of a passage: the distance, and which of the two ways. Away from it nothing is. */
KT_TEST(passages_are_told) {
    static linkage l;
    static const struct {
        double d, smallest; /* size of the smallest direction, an upper bound */
        bool near, crosses;
    } cases[] = {
        {-0.1, 1.0, false, false}, {1e-6, 3e-3, true, false}, {1e-9, 1e-4, true, false}, {0.0, 1e-2, true, true}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        build(&l, cases[i].d, KT_REDUCTION_QR, KT_PLAN_AUTO);
        (void)kt_data_crossings(l.data);
        kt_check_below("energy", lost(&l, "dopri5"), 1e-8);
        const kt_crossings seen = kt_data_crossings(l.data);
        kt_note("off by %g", cases[i].d);
        kt_check_equal_int("near", seen.near > 0, cases[i].near);
        kt_check_equal_int("interpolated", seen.interpolated > 0, cases[i].crosses);
        kt_check_below("smallest direction", seen.smallest, cases[i].smallest);
        kt_check_below("error", seen.error, 1e-9);
        kt_check_equal_int("bends", seen.bend > 0.0, cases[i].near && !cases[i].crosses);
        kt_check_equal_int("told once", (long)kt_data_crossings(l.data).near, 0);
    }
}
