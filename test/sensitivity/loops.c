/* Steps of mechanisms with loops, with the projection after them: coarse steps, which leave the loops open by much. */
#include "../constraint/linkage.h"
#include "differences.h"

#include "kinetree/simulation.h"

#include <stdlib.h>
#include <string.h>

static int compare_linkage(linkage *l, const char *name, double h, kt_structure structure, kt_worst *worst) {
    int taken = 0;
    for (int metric = 0; metric < 2; metric++) {
        l->options = kt_model_options_default();
        l->options.structure = structure;
        l->options.metric = metric ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        if (!linkage_build(l, 0.0))
            continue;
        for (int m = 0; explicit_method(m); m += 2) {
            const step_case c = {l->model, l->data, l->q, l->v, {.method = explicit_method(m), .h = h}, 0.004};
            taken += compare_step(&c, worst, name);
        }
        linkage_free(l);
    }
    return taken;
}

KT_TEST(derivatives_follow_the_projection_of_coarse_steps) {
    static linkage l;
    kt_worst worst = kt_worst_make("A and B");
    int taken = 0;
    four_bar f = four_bar_default();
    f.rate = 3.0;
    linkage_four_bar(&l, &f);
    taken += compare_linkage(&l, "four-bar", 0.05, KT_STRUCTURE_AUTO, &worst);
    linkage_windows(&l, 3, 0.4, 2.0, KT_LOOP_REVOLUTE);
    taken += compare_linkage(&l, "windows", 0.05, KT_STRUCTURE_AUTO, &worst);
    linkage_windows(&l, 12, 0.4, 2.0, KT_LOOP_REVOLUTE); /* by fronts, and the projection's changes along the tree */
    taken += compare_linkage(&l, "many windows", 0.02, KT_STRUCTURE_FRONTS, &worst);
    linkage_bricard(&l);
    taken += compare_linkage(&l, "Bricard", 0.02, KT_STRUCTURE_AUTO, &worst);
    kt_check_worst(&worst);
    kt_check_above("steps", taken, 36.0);
}

KT_TEST(derivatives_of_random_closed_mechanisms_hold) {
    kt_random random = kt_random_of_test();
    kt_worst worst = kt_worst_make("A and B");
    int taken = 0;
    for (int n = 0; n < 24; n++) {
        static tangle g;
        tangle_plan plan = n % 3 == 2 ? tangle_plan_planar() : tangle_plan_default();
        plan.tree.bodies = 7;
        plan.tree.massless = false;
        plan.loops = 1 + n % 2;
        plan.options.metric = n % 2 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        plan.options.structure = n % 4 < 2 ? KT_STRUCTURE_AUTO : KT_STRUCTURE_FRONTS;
        if (tangle_grow(&g, &plan, &random)) {
            const kt_step step = {
                .method = explicit_method(n % 11), .t = g.t, .h = 1e-3, .tau = g.tau, .external = g.external};
            const step_case c = {g.tree.model, g.tree.data, g.q, g.v, step, 1e-3};
            taken += compare_step(&c, &worst, step.method->name);
        }
        tangle_free(&g);
    }
    kt_check_worst(&worst);
    kt_check_above("mechanisms", taken, 12.0);
}
