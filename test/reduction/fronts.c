/* Groups reduced by fronts against the same groups reduced by dense matrices, on random mechanisms. */
#include "tangle.h"

#include "model/model.h"

#include <math.h>

/* The mechanism's state with the other reduction. */
typedef struct pair {
    kt_model *model;
    kt_data *data;
} pair;

static bool other_of(const tangle *g, kt_structure structure, pair *p) {
    kt_model_options options = kt_model_options_default();
    kt_error e = {0};
    *p = (pair){NULL, NULL};
    options.plan = g->tree.model->n.planar ? KT_PLAN_AUTO : KT_PLAN_SPATIAL;
    options.structure = structure;
    options.metric = g->tree.model->metric;
    return kt_tree_fine("compiles", kt_model_compile(&g->tree.description, &options, &p->model, &e), &e) &&
           kt_tree_fine("data", kt_data_create(p->model, &p->data, &e), &e);
}

static void other_free(pair *p) {
    kt_data_free(p->data);
    kt_model_free(p->model);
}

typedef struct outcome {
    int compared, fronts, planar, carried, redundant, driven, near, ranks; /* ranks: that differ */
    kt_worst acceleration;
} outcome;

static double length_of(const double *x, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

/* Accelerations: the bound is what the condition of the mechanism makes of rounding (tangle_solve), or 1e-10 of scale. */
static bool compare_accelerations(const tangle *g, const pair *fronts, const pair *dense, outcome *o) {
    static tangle_system s;
    double a[KT_TREE_NV], b[KT_TREE_NV], expected[KT_TREE_NV], moved[KT_TREE_NV];
    kt_error e = {0};
    const int nv = g->tree.nv;
    if (!kt_tree_fine(
            "fronts",
            kt_acceleration_evaluate(fronts->model, fronts->data, g->t, g->q, g->v, g->tau, g->external, a, &e), &e) ||
        !kt_tree_fine("dense",
                      kt_acceleration_evaluate(dense->model, dense->data, g->t, g->q, g->v, g->tau, g->external, b, &e),
                      &e) ||
        !tangle_system_of(g, &s))
        return false;
    for (size_t i = 0; i < fronts->model->n.group; i++) {
        const kt_group *group = &fronts->model->group[i];
        o->fronts += group->front.used;
        o->carried += group->parent != 0;
        o->redundant += group->rank[KT_ROWS_ALL] < group->count[KT_ROWS_ALL];
        o->planar += (size_t)fronts->model->group_link[group->link] >= fronts->model->n.spatial;
        o->ranks += group->rank[KT_ROWS_ALL] != dense->model->group[i].rank[KT_ROWS_ALL];
    }
    o->driven += fronts->model->driven;
    if (tangle_was_near_singular(fronts->model, fronts->data) || tangle_was_near_singular(dense->model, dense->data)) {
        o->near++;
        return false;
    }
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, expected, moved);
    const double scale = length_of(expected, nv);
    for (int i = 0; i < nv; i++)
        kt_worst_near(&o->acceleration, a[i], b[i], fmax(1e-10 * scale, 8.0 * moved[i]), "nv %d, %d", nv, i);
    return true;
}

static void run(const tangle_plan *plan, int mechanisms, outcome *o) {
    static tangle g;
    kt_random random = kt_random_of_test();
    *o = (outcome){.acceleration = kt_worst_make("accelerations")};
    for (int i = 0; i < mechanisms; i++) {
        pair fronts = {NULL, NULL}, dense = {NULL, NULL};
        if (tangle_grow(&g, plan, &random) && other_of(&g, KT_STRUCTURE_FRONTS, &fronts) &&
            other_of(&g, KT_STRUCTURE_DENSE, &dense))
            o->compared += compare_accelerations(&g, &fronts, &dense, o);
        other_free(&fronts);
        other_free(&dense);
        tangle_free(&g);
    }
    kt_note("%d compared, %d near singular, %d groups by fronts, %d planar, %d carried, %d redundant, %d driven",
            o->compared, o->near, o->fronts, o->planar, o->carried, o->redundant, o->driven);
    kt_check_equal_int("ranks that differ", o->ranks, 0);
    kt_check_worst(&o->acceleration);
}

KT_TEST(fronts_and_dense_matrices_agree_in_space) {
    tangle_plan plan = tangle_plan_default();
    outcome o;
    run(&plan, 300, &o);
    kt_check_above("compared", o.compared, 240);
}

KT_TEST(fronts_and_dense_matrices_agree_in_a_plane) {
    tangle_plan plan = tangle_plan_planar();
    outcome o;
    run(&plan, 300, &o);
    kt_check_above("compared", o.compared, 240);
    kt_check_above("planar", o.planar, 200);
}
