/* Groups reduced by fronts against the same groups reduced by dense matrices, on random mechanisms. */
#include "linkage.h"
#include "tangle.h"

#include "model/model.h"

#include <math.h>
#include <stdio.h>

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
    int compared, fronts, few, narrow, planar, carried, redundant, driven, near, ranks; /* ranks: that differ */
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
        o->few += fronts->data->solved[i];
        o->narrow += group->narrow;
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
    kt_note(
        "%d compared, %d near singular, %d groups by fronts, %d of few equations, %d narrow, %d planar, %d carried, %d "
        "redundant, %d driven",
        o->compared, o->near, o->fronts, o->few, o->narrow, o->planar, o->carried, o->redundant, o->driven);
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

/* ---- a row of windows -------------------------------------------------------------------------------------------- */

enum { WINDOWS = 40 };

/* The row at this angle, with this structure: its cranks' and couplers' accelerations, which have one value each.
 * Returns the largest error, relative to gravity's. */
static double windows_error(kt_structure structure, double theta) {
    static linkage l;
    double a[LINKAGE_NQ], error = (double)NAN;
    linkage_windows(&l, WINDOWS, theta, 0.7, KT_LOOP_REVOLUTE);
    l.options.structure = structure;
    if (linkage_compile(&l) && linkage_accelerate(&l, 0.0, a)) {
        const double exact = windows_acceleration(WINDOWS, theta);
        error = 0.0;
        for (int i = 0; i < l.nv; i++)
            error = fmax(error, fabs(fabs(a[i]) - fabs(exact)));
        kt_check_true("structure", l.model->group[0].front.used == (structure != KT_STRUCTURE_DENSE));
    }
    linkage_free(&l);
    return error / 9.81;
}

/* Cranks along the line of their pivots are the singular positions of all windows at once. Next to it accelerations are
 * interpolated from neighbouring states: 1e-9 is what rounding leaves there (measured: 1.2e-10 and 5e-12). */
KT_TEST(row_of_windows_is_exact_up_to_its_singular_position) {
    kt_worst fronts = kt_worst_make("fronts"), dense = kt_worst_make("dense");
    for (int k = 1; k <= 13; k++) {
        const double off = k <= 12 ? pow(10.0, -k) : 0.0, theta = acos(-1.0) / 2.0 - off;
        kt_worst_below(&fronts, windows_error(KT_STRUCTURE_AUTO, theta), 1e-9, "%g from it", off);
        kt_worst_below(&dense, windows_error(KT_STRUCTURE_DENSE, theta), 1e-9, "%g from it", off);
    }
    kt_check_worst(&fronts);
    kt_check_worst(&dense);
}

/* ---- irregular rows ---------------------------------------------------------------------------------------------- */

enum { ROW = 30, ROWS = 60 };

/* Where the next coupler begins: on this body, which is turned by `angle`, at `tip` in its frame and `point` in the
 * world. */
typedef struct row_end {
    const char *body;
    double angle;
    kt_vec3 tip, point;
} row_end;

/* A bar from (x, 0) to the end's point, on a pin or a slide. */
static void add_crank(linkage *l, int i, double x, bool slides, double rate, row_end *end) {
    const kt_vec3 base = kt_vec3_make(x, 0.0, 0.0), along = kt_vec3_sub(end->point, base);
    char name[16];
    (void)snprintf(name, sizeof name, "crank%d", i);
    end->angle = slides ? 0.0 : atan2(along.y, along.x);
    end->tip = slides ? along : kt_vec3_make(kt_vec3_norm(along), 0.0, 0.0);
    kt_body *body = linkage_bar(l, name, NULL, base, end->tip, end->angle, rate);
    end->body = body->name;
    if (!slides)
        return;
    body->joint.type = KT_JOINT_PRISMATIC;
    body->joint.axis = kt_vec3_make(1.0, 0.3, 0.0);
}

/* A row of windows of random bars, every fifth crank on a slide; one window is closed by a rod between the two points
 * instead of a pin, which leaves one more freedom. */
static bool build_row(linkage *l, kt_random *random) {
    const int rod = kt_random_int(random, 1, ROW);
    row_end last = {.angle = 0.0}, next;
    linkage_begin(l);
    for (int i = 0; i <= ROW; i++) {
        const double x = i + kt_random_uniform(random, -0.2, 0.2), angle = kt_random_uniform(random, 1.0, 2.1);
        const double length = kt_random_uniform(random, 0.6, 1.4), rate = i ? 0.0 : 1.0;
        next.point = kt_vec3_make(x + length * cos(angle), length * sin(angle), 0.0);
        add_crank(l, i, x, i % 5 == 3, rate, &next);
        l->body[l->description.body_count - 1].joint.given =
            i ? KT_GIVEN_POSITION : KT_GIVEN_POSITION | KT_GIVEN_VELOCITY;
        if (i) {
            char name[16];
            const kt_vec3 d = kt_vec3_sub(next.point, last.point);
            const kt_vec3 to = kt_vec3_make(kt_vec3_norm(d) * (i == rod ? 0.7 : 1.0), 0.0, 0.0);
            (void)snprintf(name, sizeof name, "coupler%d", i);
            linkage_bar(l, name, last.body, last.tip, to, atan2(d.y, d.x) - last.angle, 0.0)->joint.given =
                KT_GIVEN_POSITION;
            (void)linkage_close(l, name, i == rod ? KT_LOOP_DISTANCE : KT_LOOP_REVOLUTE,
                                l->body_name[l->description.body_count - 1], to, next.body, next.tip);
        }
        last = next;
    }
    return linkage_build(l, 0.0);
}

/* Relative to the largest acceleration (measured: 2e-12), and velocity (3e-12). */
KT_TEST(narrow_fronts_and_dense_matrices_agree_on_irregular_rows) {
    static linkage l, dense;
    kt_random random = kt_random_of_test();
    kt_worst worst = kt_worst_make("accelerations"), projection = kt_worst_make("projections");
    int narrow = 0;
    for (int n = 0; n < ROWS; n++) {
        double a[LINKAGE_NQ], b[LINKAGE_NQ], most = 0.0, fastest = 1.0;
        kt_random same = random;
        if (build_row(&l, &random) && build_row(&dense, &same)) {
            kt_error e = {0};
            kt_model_free(dense.model);
            kt_data_free(dense.data);
            dense.options.structure = KT_STRUCTURE_DENSE;
            if (linkage_compile(&dense) && linkage_accelerate(&l, 0.0, a) &&
                linkage_fine("dense",
                             kt_acceleration_evaluate(dense.model, dense.data, 0.0, l.q, l.v, NULL, NULL, b, &e), &e)) {
                narrow += l.model->group[0].narrow && !tangle_was_near_singular(l.model, l.data);
                for (int i = 0; i < l.nv; i++)
                    most = fmax(most, fabs(b[i]));
                for (int i = 0; i < l.nv; i++)
                    kt_worst_near(&worst, a[i], b[i], 1e-10 * most, "row %d, %d", n, i);
                for (int i = 0; i < l.nv; i++)
                    fastest = fmax(fastest, fabs(l.v[i]));
                kt_worst_below(&projection,
                               linkage_projections_differ((const kt_model *const[2]){l.model, dense.model},
                                                          (kt_data *const[2]){l.data, dense.data}, 0.0, l.q, l.v),
                               1e-11 * fastest, "row %d", n);
            }
        }
        linkage_free(&l);
        linkage_free(&dense);
    }
    kt_check_worst(&worst);
    kt_check_worst(&projection);
    kt_check_above("narrow", narrow, ROWS / 2);
}

KT_TEST(memory_grows_with_the_number_of_windows) {
    static linkage l;
    size_t size[2];
    for (int k = 0; k < 2; k++) {
        linkage_windows(&l, k ? WINDOWS : WINDOWS / 4, 1.0, 0.0, KT_LOOP_REVOLUTE);
        size[k] = linkage_compile(&l) ? kt_data_size(l.model) : 0;
        linkage_free(&l);
    }
    kt_check_below("bytes of four times as many windows, of four times the bytes",
                   (double)size[1] / (4.0 * (double)size[0]), 1.05);
}
