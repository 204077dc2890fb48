/* Random closed mechanisms, with loops of every type, in the absolute formulation: their accelerations against the
 * dense solution of the tree's equations, and their mobility. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "formulation.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { MECHANISMS = 60, FREE_NQ = 14 * KT_TREE_BODIES, BODIES = 2 * KT_TREE_BODIES + 1 };

/* The accelerations of the absolute formulation in the coordinates of the tree. Returns false if there are none, or if
 * loops only just reach each other. Another test covers that case. */
static bool accelerate(const tangle *g, const kt_absolute *formulation, kt_data *data, double *a, double *largest) {
    static double q[FREE_NQ], v[FREE_NQ], free_a[FREE_NQ], seen_q[KT_TREE_NQ], seen_v[KT_TREE_NV];
    static kt_wrench push[BODIES];
    const kt_model *absolute = kt_absolute_model(formulation);
    kt_error e = {0};
    kt_need_fine("kinematics", kt_kinematics_update(g->tree.model, g->tree.data, g->q, g->v, NULL, &e), &e);
    kt_absolute_from_tree(formulation, g->tree.data, g->q, g->v, q, v);
    kt_absolute_wrenches(formulation, q, g->tau, g->external, push);
    kt_need_fine("acceleration", kt_acceleration_evaluate(absolute, data, g->t, q, v, NULL, push, free_a, &e), &e);
    memcpy(seen_q, g->q, sizeof seen_q);
    kt_absolute_to_tree(formulation, q, v, free_a, 0.0, seen_q, seen_v, a);
    *largest = kt_tree_largest(free_a, kt_model_nv(absolute));
    return !tangle_was_near_singular(absolute, data);
}

/* The bound is the effect of rounding on the tree's own equations, as in evaluate/acceleration.c. The acceleration of
 * a joint is the difference between those of two bodies, and these combine all joints on the way. The largest error in
 * 12 x 60 mechanisms was a quarter of the bound. */
KT_TEST(closed_mechanisms_accelerate_as_their_equations_say) {
    static tangle g;
    static tangle_system s;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("acceleration"), mobility = kt_worst_make("mobility");
    int compared = 0, counters = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        tangle_plan plan = tangle_plan_default();
        plan.linear = true; /* formulas read the joints of the tree */
        double a[KT_TREE_NV], expected[KT_TREE_NV], moved[KT_TREE_NV], largest;
        kt_data *data = NULL;
        kt_error e = {0};
        tangle_grow(&g, &plan, &random);
        kt_absolute *formulation =
            kt_formulate(&g.tree.description, &plan.options, g.tree.model, KT_FORMULATION_ABSOLUTE);
        if (formulation == NULL)
            return;
        const kt_model *absolute = kt_absolute_model(formulation);
        counters += kt_model_body_count(absolute) - g.tree.count;
        kt_worst_near(&mobility, kt_model_mobility(absolute).minimal, kt_model_mobility(g.tree.model).minimal, 0.5,
                      "%d", n);
        if (kt_fine("data", kt_data_create(absolute, &data, &e), &e) &&
            accelerate(&g, formulation, data, a, &largest)) {
            tangle_system_of(&g, &s);
            (void)tangle_solve(&g, &s, (tangle_way){.mixes = true}, expected, moved);
            const double least = 16.0 * DBL_EPSILON * fmax(largest, kt_tree_largest(expected, g.tree.nv));
            for (int i = 0; i < g.tree.nv; i++)
                kt_worst_near(&worst, a[i], expected[i], 4.0 * moved[i] + least, "%d, %d", n, i);
            compared++;
        }
        kt_data_free(data);
    }
    kt_check_above("compared", compared, 0.8 * MECHANISMS);
    kt_check_above("counters and crosses", counters, MECHANISMS);
}
