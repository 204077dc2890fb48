/* Groups reduced by fronts against the same groups reduced by dense matrices, on random mechanisms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"
#include "sanitized.h"

#include "constraint/group.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>

/* Of random mechanisms a share is enough for the quick tier, and for sanitizers. */
enum { FEWER = KT_SHORT(8, KT_ADDRESS_SANITIZER ? 4 : 1) };

/* The mechanism's state with the other reduction. */
typedef struct pair {
    kt_model *model;
    kt_data *data;
} pair;

static void other_of(const tangle *g, kt_structure structure, pair *p) {
    kt_model_options options = kt_model_options_default();
    *p = (pair){NULL, NULL};
    options.plan = g->tree.model->n.planar ? KT_PLAN_AUTO : KT_PLAN_SPATIAL;
    options.structure = structure;
    options.metric = g->tree.model->metric;
    p->model = kt_test_model(&g->tree.description, &options);
    p->data = kt_test_data(p->model);
}

typedef struct outcome {
    int mechanisms, compared, fronts, few, narrow, near, ranks; /* ranks: that differ */
    int planar, spatial, branching, carried, redundant, driven, nonholonomic, with_armature, by_mass;
    int alone; /* that one interpolates, and the other does not */
    double apart;
    kt_worst acceleration, interpolated;
} outcome;

static double length_of(const double *x, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

/* Whether two links of a group are on the same one. */
static bool branches(const kt_model *model, const kt_group *group) {
    bool found = false;
    for (int k = 0; k < group->link_count; k++)
        for (int l = 0; l < k; l++)
            found = found || model->link[model->group_link[group->link + k]].parent ==
                                 model->link[model->group_link[group->link + l]].parent;
    return found;
}

/* Counts the properties of a mechanism that are compared. */
static void count_classes(const kt_model *fronts, const kt_data *data, const kt_model *dense, outcome *o) {
    bool planar = false, spatial = false, branching = false, carried = false, redundant = false, rolls = false;
    for (size_t i = 0; i < fronts->n.group; i++) {
        const kt_group *group = &fronts->group[i];
        const bool flat = (size_t)fronts->group_link[group->link] >= fronts->n.spatial;
        o->fronts += group->has_fronts;
        o->few += data->special_form[i];
        o->narrow += group->form == KT_FORM_FRONT4;
        o->ranks += group->rank[KT_ROWS_ALL] != dense->group[i].rank[KT_ROWS_ALL];
        planar = planar || flat;
        spatial = spatial || !flat;
        branching = branching || branches(fronts, group);
        carried = carried || group->parent != 0;
        redundant = redundant || group->rank[KT_ROWS_ALL] < group->count[KT_ROWS_ALL];
        rolls = rolls || group->count[KT_ROWS_CLOSED] < group->count[KT_ROWS_ALL];
    }
    o->planar += planar;
    o->spatial += spatial;
    o->branching += branching;
    o->carried += carried;
    o->redundant += redundant;
    o->nonholonomic += rolls;
    o->driven += fronts->driven;
    o->with_armature += fronts->has_armature;
    o->by_mass += fronts->metric == KT_METRIC_MASS;
}

/* Compares accelerations. The bound is the rounding error times the mechanism's condition (tangle_solve), or 1e-10 of
 * scale. Next to singular positions both structures interpolate from neighbouring states. Projections leave these
 * states different: measured of 20 seeds 5e-7 of scale. Sometimes only one interpolates, because the usual size depends
 * on the order. The other's acceleration then has the error of its position over the cube of the distance. This is `2
 * eps / x^3` = 1e-6 at x = 0.8e-3; measured 1.3e-6. */
static bool compare_accelerations(const tangle *g, const pair *fronts, const pair *dense, const char *of, outcome *o) {
    static tangle_system s;
    double a[KT_TREE_NV], b[KT_TREE_NV], expected[KT_TREE_NV], moved[KT_TREE_NV];
    kt_error e = {0};
    const int nv = g->tree.nv;
    kt_need_fine("fronts",
                 kt_acceleration_evaluate(fronts->model, fronts->data, g->t, g->q, g->v, g->tau, g->external, a, &e),
                 &e);
    kt_need_fine("dense",
                 kt_acceleration_evaluate(dense->model, dense->data, g->t, g->q, g->v, g->tau, g->external, b, &e), &e);
    tangle_system_of(g, &s);
    count_classes(fronts->model, fronts->data, dense->model, o);
    const bool near[] = {tangle_was_near_singular(fronts->model, fronts->data),
                         tangle_was_near_singular(dense->model, dense->data)};
    if (near[0] || near[1]) {
        const double scale = length_of(b, nv);
        o->near++;
        o->alone += near[0] != near[1];
        for (int i = 0; i < nv && near[0] != near[1]; i++)
            o->apart = fmax(o->apart, fabs(a[i] - b[i]) / scale);
        for (int i = 0; i < nv && near[0] && near[1]; i++)
            kt_worst_near(&o->interpolated, a[i], b[i], 1e-6 * scale, "%s, nv %d, %d", of, nv, i);
        return false;
    }
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, expected, moved);
    const double scale = length_of(expected, nv);
    for (int i = 0; i < nv; i++)
        kt_worst_near(&o->acceleration, a[i], b[i], fmax(1e-10 * scale, 8.0 * moved[i]), "%s, nv %d, %d", of, nv, i);
    return true;
}

static bool compare(const tangle *g, const char *of, outcome *o) {
    pair fronts = {NULL, NULL}, dense = {NULL, NULL};
    bool compared = false;
    other_of(g, KT_STRUCTURE_FRONTS, &fronts);
    other_of(g, KT_STRUCTURE_DENSE, &dense);
    o->mechanisms++;
    compared = compare_accelerations(g, &fronts, &dense, of, o);
    return compared;
}

static outcome begin(void) {
    return (outcome){.acceleration = kt_worst_make("accelerations"),
                     .interpolated = kt_worst_make("interpolated ones")};
}

static void conclude(const outcome *o) {
    kt_note(
        "%d mechanisms: %d planar, %d spatial, %d branching, %d carried, %d with redundant equations, %d driven, %d "
        "non-holonomic, %d with armature, %d in the metric of masses, %d in that of ones",
        o->mechanisms, o->planar, o->spatial, o->branching, o->carried, o->redundant, o->driven, o->nonholonomic,
        o->with_armature, o->by_mass, o->mechanisms - o->by_mass);
    kt_note("%d groups by fronts, %d of few equations, %d narrow; %d mechanisms are near singular", o->fronts, o->few,
            o->narrow, o->near);
    kt_check_equal_int("ranks that differ", o->ranks, 0);
    kt_check_worst(&o->acceleration);
}

/* Every second in the metric of masses, every third with armature. */
static void run(tangle_plan *plan, int mechanisms, outcome *o) {
    static tangle g;
    kt_random random = kt_random_of_test();
    *o = begin();
    for (int i = 0; i < mechanisms / FEWER; i++) {
        char of[24];
        (void)snprintf(of, sizeof of, "mechanism %d", i);
        plan->options.metric = i % 2 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        plan->tree.with_armature = i % 3 == 2 ? 0.5 : 0.0;
        tangle_grow(&g, plan, &random);
        o->compared += compare(&g, of, o);
    }
    conclude(o);
}

KT_TEST(fronts_and_dense_matrices_agree_in_space) {
    tangle_plan plan = tangle_plan_default();
    outcome o;
    run(&plan, 300, &o);
    kt_check_above("compared", o.compared, 240 / FEWER);
    kt_check_above("spatial", o.spatial, 240 / FEWER);
    kt_check_above("branching", o.branching, 150 / FEWER);
    kt_check_above("driven", o.driven, 60 / FEWER);
    kt_check_above("non-holonomic", o.nonholonomic, 30 / FEWER);
    kt_check_above("with armature", o.with_armature, 60 / FEWER);
    kt_check_above("in the metric of masses", o.by_mass, 120 / FEWER);
}

KT_TEST(fronts_and_dense_matrices_agree_in_a_plane) {
    tangle_plan plan = tangle_plan_planar();
    outcome o;
    run(&plan, 300, &o);
    kt_check_above("compared", o.compared, 240 / FEWER);
    kt_check_above("planar", o.planar, 200 / FEWER);
}

/* Trees and loops of one plane, which planar kernels would reduce to two or three equations a loop: in space each
 * repeats equations. */
KT_TEST(fronts_and_dense_matrices_agree_on_redundant_loops) {
    tangle_plan plan = tangle_plan_planar();
    outcome o;
    plan.options.plan = KT_PLAN_SPATIAL;
    run(&plan, 200, &o);
    kt_check_above("compared", o.compared, 160 / FEWER);
    kt_check_above("redundant", o.redundant, 150 / FEWER);
}

/* Many loops on few bodies: groups that branch, share links and have few degrees of freedom left. */
KT_TEST(fronts_and_dense_matrices_agree_on_crowded_mechanisms) {
    tangle_plan plan = tangle_plan_default();
    outcome o;
    plan.loops = 7;
    plan.nearby = 0.2;
    plan.types = TANGLE_ALL_TYPES & ~(1U << KT_LOOP_WELD | 1U << KT_LOOP_REVOLUTE | 1U << KT_LOOP_PRISMATIC);
    run(&plan, 100, &o);
    kt_check_above("compared", o.compared, 80 / FEWER);
}

/* Random mechanisms at a singular position, and at distances of 1e-1 to 1e-12 from it. In every second mechanism the
 * equation that is lost there is redundant, and positions are regular. */
KT_TEST(fronts_and_dense_matrices_agree_next_to_singular_positions) {
    enum { PLACES = 13, ROUNDS = 10 / FEWER };
    static tangle g;
    kt_random random = kt_random_of_test();
    outcome o = begin();
    int braced = 0;
    for (int i = 0; i < PLACES * ROUNDS; i++) {
        tangle_plan plan = i % 4 < 2 ? tangle_plan_default() : tangle_plan_planar();
        const double off = i % PLACES < PLACES - 1 ? pow(10.0, -1.0 - i % PLACES) : 0.0;
        char of[64];
        (void)snprintf(of, sizeof of, "mechanism %d, %g from it", i, off);
        plan.still = true;
        plan.options.metric = i % 8 < 4 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        bool grown = false;
        for (int tries = 0; tries < 20 && !grown; tries++) {
            tangle_grow(&g, &plan, &random);
            grown = tangle_add_dead_centre(&g, off, i % 2, &plan.options, &random);
        }
        if (grown)
            braced += compare(&g, of, &o) && i % 2;
    }
    conclude(&o);
    kt_check_worst(&o.interpolated);
    kt_check_below("difference where one of both interpolates", o.apart, 1e-5);
    kt_check_below("where one of both interpolates", o.alone, PLACES * ROUNDS / 10);
    kt_check_above("mechanisms", o.mechanisms, PLACES * ROUNDS - 1);
    kt_check_above("near singular", o.near, PLACES * ROUNDS / 3);
    kt_check_above("regular by a redundant rod", braced, PLACES * ROUNDS / 3);
}

/* ---- wheels joined by rods --------------------------------------------------------------------------------------- */

/* Wheels of radius 1 at equal angles turn as one, for every choice of pairs that rods join. Rods beyond a spanning tree
 * are redundant everywhere on this branch of the positions. a = the sum of torques over the sum of inertias. */
enum { WHEELS_MOST = 8 };

typedef struct wheels {
    linkage l;
    int count;
    double x[WHEELS_MOST], y[WHEELS_MOST], inertia[WHEELS_MOST], torque[WHEELS_MOST];
    int rods, rod[2 * WHEELS_MOST][2];
} wheels;

/* The first rod joins the first two wheels, which so are the first that a front takes. */
static void draw_wheels(wheels *w, int count, kt_random *random) {
    w->count = count;
    w->rods = 0;
    for (int i = 0; i < count; i++) {
        w->x[i] = kt_random_uniform(random, -3.0, 3.0);
        w->y[i] = kt_random_uniform(random, -3.0, 3.0);
        w->inertia[i] = kt_random_uniform(random, 0.5, 2.0);
        w->torque[i] = kt_random_uniform(random, -1.0, 1.0);
    }
    for (int i = 1; i < count; i++) {
        w->rod[w->rods][0] = kt_random_int(random, 0, i - 1);
        w->rod[w->rods++][1] = i;
    }
    for (int i = 2; i < count; i++) {
        w->rod[w->rods][0] = w->rod[i - 1][0] == i - 1 ? 0 : i - 1;
        w->rod[w->rods++][1] = i;
    }
}

/* The first rod is `off` from its dead centre. */
static void build_wheels(wheels *w, double off, kt_structure structure, bool spatial) {
    linkage *l = &w->l;
    const double theta = atan2(w->y[1] - w->y[0], w->x[1] - w->x[0]) + off;
    const kt_vec3 arm = kt_vec3_make(1.0, 0.0, 0.0), none = kt_vec3_make(0.0, 0.0, 0.0);
    char name[16];
    linkage_begin(l);
    l->description.gravity = none;
    l->options.structure = structure;
    l->options.plan = spatial ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
    for (int i = 0; i < w->count; i++) {
        const double j = w->inertia[i];
        snprintf(name, sizeof name, "wheel%d", i);
        kt_body *body = linkage_bar(l, name, NULL, kt_vec3_make(w->x[i], w->y[i], 0.0), arm, theta, 0.7);
        body->com = none;
        body->inertia = kt_sym3_make(j, j, j, 0.0, 0.0, 0.0);
    }
    for (int i = 0; i < w->rods; i++) {
        const int a = w->rod[i][0], b = w->rod[i][1];
        snprintf(name, sizeof name, "rod%d", i);
        kt_loop *rod = linkage_close(l, name, KT_LOOP_DISTANCE, l->body[a].name, arm, l->body[b].name, arm);
        rod->function = kt_function_constant(hypot(w->x[a] - w->x[b], w->y[a] - w->y[b]));
    }
    linkage_compile(l);
}

/* The largest error of the accelerations next to the state, and of the forces that hold the rods, A' lambda = M a -
 * tau. */
typedef struct wheels_errors {
    double acceleration, force;
} wheels_errors;

static wheels_errors errors_of(wheels *w, kt_random *random) {
    double a[WHEELS_MOST], jacobian[2 * WHEELS_MOST * WHEELS_MOST], lambda[2 * WHEELS_MOST], torque = 0.0,
                                                                                             inertia = 0.0;
    linkage *l = &w->l;
    kt_error e = {0};
    wheels_errors error = {0.0, 0.0};
    for (int i = 0; i < w->count; i++) {
        l->q[i] += kt_random_uniform(random, -1e-14, 1e-14);
        l->v[i] += kt_random_uniform(random, -1e-14, 1e-14);
        torque += w->torque[i];
        inertia += w->inertia[i];
    }
    const bool done =
        kt_fine("moves", kt_acceleration_evaluate(l->model, l->data, 0.0, l->q, l->v, w->torque, NULL, a, &e), &e) &&
        kt_fine("reacts", kt_multiplier_evaluate(l->model, l->data, 0.0, l->q, l->v, w->torque, NULL, lambda, &e),
                &e) &&
        kt_fine("has equations", kt_loop_equations(l->model, l->data, 0.0, l->q, l->v, jacobian, NULL, NULL, NULL, &e),
                &e);
    for (int i = 0; i < w->count && done; i++) {
        double sum = w->inertia[i] * a[i] - w->torque[i];
        for (int r = 0; r < w->rods; r++)
            sum -= jacobian[i * w->rods + r] * lambda[r];
        error.acceleration = fmax(error.acceleration, fabs(a[i] - torque / inertia));
        error.force = fmax(error.force, fabs(sum));
    }
    return done ? error : (wheels_errors){(double)NAN, (double)NAN};
}

/* The bound is noise of 1e-14 in positions and velocities times 16 squared, or a few times the dense error. A preferred
 * rod is replaced below a factor of 16, and its neighbour has another 16. Measured of 13 seeds: 1e-15. Next to 0.01,
 * fronts prefer another rod than dense matrices do, and 1.8e-12 was measured. Fronts that accepted the first candidate
 * were off by 6e-11 with three wheels, and by 0.4 with five. Fronts that preferred the first candidate were off by
 * 6e-11 with five, and their forces by 2e-13. */
static void compare_wheels(int count, int mechanisms, bool spatial, kt_worst worst[2]) {
    static wheels w;
    kt_random random = kt_random_of_test();
    for (int i = 0; i < mechanisms; i += FEWER) {
        draw_wheels(&w, count, &random);
        for (int k = 1; k <= 13; k += FEWER) { /* the last is at the dead centre */
            const double off = k <= 12 ? pow(10.0, -k) : 0.0;
            const kt_random noise = random;
            wheels_errors error[2];
            for (int dense = 0; dense < 2; dense++) {
                kt_random same = noise;
                build_wheels(&w, off, dense ? KT_STRUCTURE_DENSE : KT_STRUCTURE_FRONTS, spatial);
                error[dense] = errors_of(&w, &same);
                random = same;
            }
            kt_worst_below(&worst[0], error[0].acceleration, fmax(3e-12, 8.0 * error[1].acceleration),
                           "%d wheels, mechanism %d, %g from it", count, i, off);
            kt_worst_below(&worst[1], error[0].force, fmax(1e-14, 8.0 * error[1].force),
                           "%d wheels, mechanism %d, %g from it", count, i, off);
        }
    }
}

KT_TEST(equation_that_is_small_next_to_a_dead_centre_does_not_spoil_later_ones) {
    kt_worst worst[] = {kt_worst_make("accelerations"), kt_worst_make("forces")};
    compare_wheels(3, 12, false, worst);
    compare_wheels(5, 8, false, worst);
    compare_wheels(8, 6, false, worst);
    compare_wheels(3, 2, true, worst);
    compare_wheels(6, 2, true, worst);
    for (int i = 0; i < 2; i++)
        kt_check_worst(&worst[i]);
}

/* ---- levers ------------------------------------------------------------------------------------------------------ */

/* Each lever turns the next by three times its angle. A solution that is carried on lever by lever grows to 3^40. The
 * forces that turn all levers grow as much, and both have to cancel. At rest `a_i = 3^i sum(3^j tau_j) / sum(9^j
 * I_j)`. */
enum { LEVERS = 41 };

static double lever_error(kt_structure structure) {
    static linkage l;
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), in = kt_vec3_make(0.0, 1.0, 0.0),
                  out = kt_vec3_make(0.0, 3.0, 0.0);
    kt_random random = kt_random_of_test();
    double a[LINKAGE_NQ], tau[LEVERS], inertia[LEVERS], pull = 0.0, whole = 0.0, error = 0.0;
    char name[16];
    kt_error e = {0};
    linkage_begin(&l);
    l.description.gravity = none;
    l.options.structure = structure;
    for (int i = 0; i < LEVERS; i++) {
        snprintf(name, sizeof name, "lever%d", i);
        kt_body *body = linkage_bar(&l, name, NULL, kt_vec3_make(5.0 * i, 0.0, 0.0), in, 0.0, 0.0);
        inertia[i] = kt_random_uniform(&random, 0.5, 2.0);
        tau[i] = kt_random_uniform(&random, -1.0, 1.0);
        body->com = none;
        body->inertia = kt_sym3_make(inertia[i], inertia[i], inertia[i], 0.0, 0.0, 0.0);
        pull += pow(3.0, i - LEVERS) * tau[i];
        whole += pow(9.0, i - LEVERS) * inertia[i];
    }
    for (int i = 0; i + 1 < LEVERS; i++) {
        snprintf(name, sizeof name, "rod%d", i);
        linkage_close(&l, name, KT_LOOP_DISTANCE, l.body[i].name, out, l.body[i + 1].name, in)->function =
            kt_function_constant(hypot(5.0, 2.0));
    }
    linkage_compile(&l);
    if (!kt_fine("moves", kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, l.v, tau, NULL, a, &e), &e))
        error = (double)NAN;
    for (int i = 0; i < LEVERS && error == error; i++) /* of the fastest */
        error = fmax(error, fabs(a[i] - pow(3.0, i - LEVERS) * pull / whole));
    return fabs(error / (pull / whole));
}

/* Orthogonal factors let nothing grow: measured 5e-17. */
KT_TEST(errors_do_not_grow_along_a_chain_of_levers) {
    kt_check_below("fronts", lever_error(KT_STRUCTURE_FRONTS), 1e-15);
    kt_check_below("dense", lever_error(KT_STRUCTURE_DENSE), 1e-15);
}
