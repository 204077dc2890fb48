/* Assembly: it finds the nearest closed state, and held joints keep their bits. If no closed state exists, it fails
 * with a message. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include "assembly/levenberg_marquardt.h"
#include "model/model.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- nearest ----------------------------------------------------------------------------------------------------- */

/* The least step has no part along the directions that A allows to free coordinates. The allowed direction is the
 * acceleration of [1 A'; A 0] under a random force, where held coordinates have no column and feel nothing. */
typedef struct part {
    double along;    /* step' allowed */
    double rounding; /* bound of the rounding in A, and in the step, which is a difference of numbers up to `largest` */
    double unit;     /* sum of |allowed| in units of the coordinates */
} part;

static part part_along(const tangle *g, const bool *held, kt_random *random, const double *step, double largest) {
    static tangle_system s;
    double allowed[KT_TREE_NV], moved[KT_TREE_NV];
    const int nv = g->tree.nv;
    part p = {0.0, 0.0, 0.0};
    tangle_system_of(g, &s);
    memset(s.drift, 0, sizeof s.drift);
    memset(s.mass, 0, (size_t)(nv * nv) * sizeof(double));
    for (int i = 0; i < nv; i++) {
        s.mass[i * nv + i] = 1.0;
        s.force[i] = held[i] ? 0.0 : kt_random_uniform(random, -1.0, 1.0);
        for (int r = 0; r < g->rows && held[i]; r++)
            s.jacobian[i * g->rows + r] = 0.0;
    }
    (void)tangle_solve(g, &s, (tangle_way){.mixes = true}, allowed, moved);
    for (int i = 0; i < nv; i++) {
        p.along += step[i] * allowed[i];
        p.rounding += fabs(step[i]) * moved[i] + DBL_EPSILON * fabs(allowed[i]) * largest;
    }
    for (size_t i = 0; i < g->tree.model->n.group_v; i++)
        p.unit += g->tree.model->unit[i] * fabs(allowed[g->tree.model->group_v[i]]);
    p.along = fabs(p.along);
    return p;
}

/* Holds up to three joints that have coordinates. */
static void hold_some(tangle *g, kt_random *random, const char **names, int count, bool *held) {
    memset(held, 0, KT_TREE_NV * sizeof *held);
    g->tree.description.hold = names;
    g->tree.description.hold_count = 0;
    for (int i = 0; i < count; i++) {
        const int b = kt_random_int(random, 1, g->tree.count - 1);
        const kt_coordinates c = kt_body_coordinates(g->tree.model, b);
        if (c.nv == 0 || held[c.v])
            continue;
        names[g->tree.description.hold_count++] = g->tree.description.bodies[kt_body_source(g->tree.model, b)].name;
        for (int k = 0; k < c.nv; k++)
            held[c.v + k] = true;
    }
}

typedef struct outcome {
    kt_worst closed, position, velocity;
    int assembled, rejected, wrongly, held, capped;
    int late; /* that ended farther than 1e-11 from the nearest state, where nothing brought them nearer */
    long touched;
} outcome;

/* Equations that are independent in the coordinates that are not held. */
static int rank_of(const tangle *g, const bool *held) {
    static tangle_system s;
    double a[KT_TREE_NV], moved[KT_TREE_NV];
    tangle_system_of(g, &s);
    for (int i = 0; i < g->tree.nv; i++)
        for (int r = 0; r < g->rows && held[i]; r++)
            s.jacobian[i * g->rows + r] = 0.0;
    return tangle_solve(g, &s, (tangle_way){0}, a, moved);
}

/* The same mechanism with joints held, from a state that is off by `off`. If the free coordinates leave as many
 * equations independent as all coordinates do, a small step closes the mechanism. */
static void assemble_one(tangle *g, const tangle_plan *plan, kt_random *random, int hold, double off, outcome *o) {
    const char *names[3];
    bool held[KT_TREE_NV];
    double q[KT_TREE_NQ], v[KT_TREE_NV], from_q[KT_TREE_NQ], from_v[KT_TREE_NV], step[KT_TREE_NV];
    kt_error e = {0};
    hold_some(g, random, names, hold, held);
    kt_tree_compile(&g->tree, &plan->options);
    const int nv = g->tree.nv, nq = g->tree.nq;
    for (int i = 0; i < nv; i++) {
        step[i] = kt_random_uniform(random, -off, off);
        v[i] = g->v[i] + step[i];
    }
    kt_position_add(g->tree.model, g->q, step, q);
    memcpy(from_q, q, sizeof q);
    memcpy(from_v, v, sizeof v);
    if (kt_state_assemble(g->tree.model, g->tree.data, g->t, q, v, &e) != KT_OK) {
        o->rejected++;
        o->wrongly += rank_of(g, held) == kt_model_mobility(g->tree.model).rank;
        return;
    }
    o->assembled++;
    memcpy(g->q, q, sizeof q);
    memcpy(g->v, v, sizeof v);
    kt_residual r = {(double)NAN, (double)NAN};
    (void)kt_fine("residual", kt_loop_residual(g->tree.model, g->tree.data, g->t, q, v, &r, &e), &e);
    /* a search for positions is done where the squares of the residuals, over the mechanism's length, are 1e-28 a
     * row */
    const double settled = 1e-14 * sqrt(g->rows) * fmax(1.0, g->tree.model->length);
    kt_worst_below(&o->closed, r.position, settled, "nv %d", nv);
    kt_worst_below(&o->closed, r.velocity, 1e-13 * fmax(1.0, kt_tree_largest(v, nv)), "nv %d", nv);
    for (int b = 1; b < g->tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(g->tree.model, b);
        if (c.nv == 0 || !held[c.v])
            continue;
        o->held++;
        o->touched += memcmp(q + c.q, from_q + c.q, (size_t)c.nq * sizeof *q) != 0;
        o->touched += memcmp(v + c.v, from_v + c.v, (size_t)c.nv * sizeof *v) != 0;
    }
    kt_position_subtract(g->tree.model, q, from_q, step);
    const bool capped = kt_data_iterations(g->tree.data).capped > 0; /* closed, but another may be nearer */
    part p = part_along(g, held, random, step, fmax(1.0, kt_tree_largest(q, nq)));
    o->capped += capped;
    const double there = 1e-11 * p.unit + p.rounding;
    o->late += !capped && p.along > there;
    if (!capped)
        kt_worst_below(&o->position, p.along, p.along > there ? 1e-9 * p.unit : there, "nv %d", nv);
    for (int i = 0; i < nv; i++)
        step[i] = v[i] - from_v[i];
    p = part_along(g, held, random, step, fmax(1.0, kt_tree_largest(v, nv)));
    kt_worst_below(&o->velocity, p.along, p.rounding, "nv %d", nv);
}

static outcome run(const tangle_plan *plan, kt_random *random, int mechanisms, int hold, double off) {
    static tangle g;
    outcome o = {.closed = kt_worst_make("closed"),
                 .position = kt_worst_make("step in positions, along what loops allow"),
                 .velocity = kt_worst_make("step in velocities, along what loops allow")};
    for (int i = 0; i < mechanisms; i++) {
        tangle_grow(&g, plan, random);
        assemble_one(&g, plan, random, hold, off, &o);
    }
    kt_check_worst(&o.closed);
    kt_check_worst(&o.position);
    kt_check_worst(&o.velocity);
    kt_check_below("closed, but another may be nearer", o.capped, 2.0);
    kt_check_below("near to the nearest", o.late, 1.0);
    return o;
}

KT_TEST(assembly_finds_the_nearest_closed_state) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    outcome o = run(&plan, &random, 60, 0, 0.1);
    kt_check_equal_int("not assembled", o.rejected, 0);
    plan.options.reduction = kt_reduction_method_of(KT_REDUCTION_PARTITION);
    o = run(&plan, &random, 30, 0, 0.1);
    kt_check_equal_int("not assembled", o.rejected, 0);
    plan.options.reduction = kt_reduction_method_of(KT_REDUCTION_SVD);
    plan.options.metric = KT_METRIC_MASS; /* of projections, not of assembly */
    o = run(&plan, &random, 30, 0, 0.1);
    kt_check_equal_int("not assembled", o.rejected, 0);
}

KT_TEST(assembly_keeps_held_joints_to_the_bit) {
    kt_random random = kt_random_of_test();
    const tangle_plan plan = tangle_plan_default();
    const outcome o = run(&plan, &random, 120, 2, 1e-4);
    kt_check_above("assembled", o.assembled, 50.0);
    kt_check_below("rejected, and should not be (near a fold)", o.wrongly, 1.0);
    kt_check_above("joints held", o.held, 60.0);
    kt_check_equal_int("touched", o.touched, 0);
}

KT_TEST(assembly_closes_from_thirty_degrees_off) {
    kt_random random = kt_random_of_test();
    const tangle_plan plan = tangle_plan_default();
    const outcome o = run(&plan, &random, 60, 0, 0.52);
    kt_check_above("assembled", o.assembled, 55.0);
}

/* A four-bar has one freedom: the nearest state is found by going along it, too. With the crank free and the crank
 * held. */
KT_TEST(four_bar_is_assembled_as_a_search_over_its_crank_says) {
    for (int hold = 0; hold < 2; hold++) {
        static linkage l;
        const char *names[] = {"crank"};
        four_bar f = four_bar_default();
        double best = 1e9, nearest[3] = {0.0};
        f.angle[0] += 0.3;
        f.angle[1] -= 0.4;
        f.angle[2] += 0.5;
        linkage_four_bar(&l, &f);
        l.description.hold = names;
        l.description.hold_count = hold;
        for (int i = -20000; i <= 20000; i++) { /* triangles: the crank's tip, the ground pivot, the coupler's tip */
            const double crank = hold ? f.angle[0] : f.angle[0] + 1e-4 * i;
            const double x = f.ground - cos(crank) * f.crank, y = -sin(crank) * f.crank, d = hypot(x, y);
            const double c = (d * d + f.coupler * f.coupler - f.rocker * f.rocker) / (2.0 * d * f.coupler);
            if (fabs(c) > 1.0)
                continue;
            const double coupler = atan2(y, x) + acos(c);
            const double rocker = atan2(f.coupler * sin(coupler) - y, f.coupler * cos(coupler) - x);
            const double at[3] = {crank, coupler - crank, rocker};
            const double off = pow(at[0] - f.angle[0], 2) + pow(at[1] - f.angle[1], 2) + pow(at[2] - f.angle[2], 2);
            if (off < best) {
                best = off;
                memcpy(nearest, at, sizeof at);
            }
        }
        linkage_build(&l, 0.0);
        /* the search steps by 1e-4, so its distance may be larger by twice the square of half a step */
        double off = 0.0;
        for (int k = 0; k < 3; k++) {
            kt_check_near(l.body_name[k], l.q[k], nearest[k], hold ? 1e-14 : 1.1e-4);
            off += pow(l.q[k] - f.angle[k], 2);
        }
        kt_check_below("distance, against the search's", off, best + 1e-15);
        if (hold)
            kt_check_equal_bits("crank", &l.q[0], &f.angle[0], 1);
    }
}

/* ---- from where no slope leads --------------------------------------------------------------------------------------
 */

/* Three bars in one line must fold to end 2 m away: at first all of them can only move across. */
/* Two almost stretched bars of 1 m end at the distance 2 cos u. A radian of the first bar changes this distance by 2 u,
 * or 2e-5 m. For a gap of 4e-13 m there, a damped step is a ten-millionth, which rounding hides. */
KT_TEST(last_roundings_are_closed_along_a_weak_direction_too) {
    static linkage l;
    const double u = 1e-5, off = 2e-8;
    const kt_vec3 origin = kt_vec3_make(0.0, 0.0, 0.0), tip = kt_vec3_make(1.0, 0.0, 0.0);
    linkage_begin(&l);
    linkage_bar(&l, "first", NULL, origin, tip, u, 0.0);
    linkage_bar(&l, "second", "first", tip, tip, -2.0 * u, 0.0);
    linkage_close(&l, "close", KT_LOOP_REVOLUTE, NULL, kt_vec3_make(2.0 * cos(u), 0.0, 0.0), "second", tip);
    linkage_compile(&l);
    l.q[0] = u - off;
    l.q[1] = -2.0 * l.q[0];
    const double gap = kt_assemble_levenberg_marquardt(l.model, l.data, 0.0, NULL, KT_SEARCH_GIVEN, l.q);
    kt_check_true("gap, relative", gap <= DBL_EPSILON);
    kt_check_near("angle", l.q[0], u, 4.0 * DBL_EPSILON / (2.0 * u)); /* the gap, over its slope in u */
}

KT_TEST(stretched_chain_folds_to_close) {
    static linkage l;
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), bar = kt_vec3_make(1.0, 0.0, 0.0);
    linkage_begin(&l);
    linkage_bar(&l, "a", NULL, none, bar, 0.0, 0.0);
    linkage_bar(&l, "b", "a", bar, bar, 0.0, 0.0);
    linkage_bar(&l, "c", "b", bar, bar, 0.0, 0.0);
    linkage_close(&l, "end", KT_LOOP_SPHERICAL, NULL, kt_vec3_make(2.0, 0.0, 0.0), "c", bar);
    linkage_build(&l, 0.0);
    kt_check_below("closed", linkage_residual(&l, 0.0).position, 1e-14);
    kt_check_above("folded", fabs(l.q[0]), 0.3);
    kt_check_equal_int("rank", kt_model_mobility(l.model).rank, 2);
}

/* The same loop twice closes as once. */
KT_TEST(loop_given_twice_is_accepted) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    l.loop[1] = l.loop[0];
    l.loop[1].name = "again";
    l.description.loop_count = 2;
    linkage_build(&l, 0.0);
    const kt_mobility dof = kt_model_mobility(l.model);
    kt_check_equal_int("equations", dof.equations, 10);
    kt_check_equal_int("rank", dof.rank, 2);
    kt_check_below("closed", linkage_residual(&l, 0.0).position, 1e-15);
    double q[3], v[3];
    memcpy(q, l.q, sizeof q);
    memcpy(v, l.v, sizeof v);
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    for (int k = 0; k < 3; k++) {
        kt_check_near(l.body_name[k], q[k], l.q[k], 1e-9);
        kt_check_near("its rate", v[k], l.v[k], 1e-9);
    }
}

/* ---- where there is none ----------------------------------------------------------------------------------------- */

static void reject(linkage *l, const char *message) {
    double q[LINKAGE_NQ], v[LINKAGE_NQ];
    kt_error e = {0};
    linkage_compile(l);
    memcpy(q, l->q, sizeof q);
    memcpy(v, l->v, sizeof v);
    kt_check_equal_int("status", kt_state_assemble(l->model, l->data, 0.0, q, v, &e), KT_ERROR_CONSTRAINT);
    kt_check_text("where", e.where, "t = 0 s");
    kt_check_text("message", e.message, message);
    kt_check_equal_bits("positions", q, l->q, (size_t)l->nq);
    kt_check_equal_bits("velocities", v, l->v, (size_t)l->nv);
}

KT_TEST(loop_out_of_reach_is_named_with_its_gap) {
    static linkage l;
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), bar = kt_vec3_make(1.0, 0.0, 0.0);
    linkage_begin(&l);
    linkage_bar(&l, "a", NULL, none, bar, 0.4, 0.0);
    linkage_bar(&l, "b", "a", bar, bar, -0.3, 0.0);
    linkage_close(&l, "end", KT_LOOP_SPHERICAL, NULL, kt_vec3_make(2.5, 0.0, 0.0), "b", bar);
    reject(&l,
           "the loops cannot be closed from the given positions (they are out of reach, contradict each other, or held "
           "joints prevent it); these stay open: 'end' by 0.5 m");
}

/* The tip of a bar must be 1 m from one point and 1.5 m from another. These points are 3 m apart, so the least squares
 * leave a gap of 1/4 m to each. */
KT_TEST(contradicting_loops_are_named) {
    static linkage l;
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), bar = kt_vec3_make(1.0, 0.0, 0.0);
    linkage_begin(&l);
    linkage_bar(&l, "a", NULL, none, bar, 0.4, 0.0);
    linkage_bar(&l, "b", "a", bar, bar, -0.3, 0.0);
    linkage_close(&l, "left", KT_LOOP_DISTANCE, NULL, none, "b", bar)->function = kt_function_constant(1.0);
    linkage_close(&l, "right", KT_LOOP_DISTANCE, NULL, kt_vec3_make(3.0, 0.0, 0.0), "b", bar)->function =
        kt_function_constant(1.5);
    linkage_bar(&l, "apart", NULL, none, bar, 0.4, 0.0); /* a loop that closes is not named */
    linkage_close(&l, "fine", KT_LOOP_DISTANCE, NULL, kt_vec3_make(3.0, 0.0, 0.0), "apart", bar)->function =
        kt_function_constant(2.5);
    linkage_compile(&l);
    kt_error e = {0};
    kt_check_equal_int("status", kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e), KT_ERROR_CONSTRAINT);
    kt_check_contains("message", e.message, "these stay open: '"); /* in either order */
    kt_check_contains("message", e.message, "'left' by 0.25");
    kt_check_contains("message", e.message, "'right' by 0.25");
    kt_check_true("and nothing else", strstr(e.message, "fine") == NULL && strstr(e.message, "others") == NULL);
}

/* A net of knots in a plane, 1 m apart, whose first and last knot are to be 9 m apart; this loop counts evaluations. */
enum { NET = 4, KNOTS = NET * NET, NAME = 8 };
#define FAR 9.0

static int keep_far(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *row) {
    const double length = kt_vec3_norm(motion->position);
    (void)t;
    (*(int *)user)++;
    row->residual = length - FAR;
    row->force = kt_vec3_scale(1.0 / length, motion->position);
    const double along = kt_vec3_dot(row->force, motion->velocity);
    row->drift = (kt_vec3_dot(motion->velocity, motion->velocity) - along * along) / length;
    return 0;
}

static void tie(kt_description *d, char name[NAME], const kt_body *a, const kt_body *b) {
    kt_loop *loop = (kt_loop *)&d->loops[d->loop_count];
    *loop = kt_loop_default();
    (void)snprintf(name, NAME, "t%d", d->loop_count++);
    loop->type = KT_LOOP_DISTANCE;
    loop->name = name;
    loop->between[0].body = a->name;
    loop->between[1].body = b->name;
    loop->function = kt_function_constant(1.0);
}

/* From knots that are off by some centimetres the search creeps along a valley to the minimum. Searches that only
 * decide whether the loops close end there. All searches take 5,737 evaluations, with compilation. They would take
 * 20,020 if they all went on to the minimum. */
KT_TEST(net_that_contradicts_itself_is_rejected_soon) {
    static kt_body knots[KNOTS];
    static kt_loop loops[2 * KNOTS];
    static char names[KNOTS][NAME], ties[2 * KNOTS][NAME];
    int evaluations = 0;
    kt_description d = kt_description_default();
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_error e = {0};
    double q[3 * KNOTS], v[3 * KNOTS];
    d.bodies = knots;
    d.body_count = KNOTS;
    d.loops = loops;
    for (int k = 0; k < KNOTS; k++) {
        const int i = k / NET, j = k % NET;
        (void)snprintf(names[k], NAME, "k%d", k);
        knots[k] = kt_body_of(names[k], NULL, KT_JOINT_PLANAR, 1.0);
        knots[k].joint.position[0] = i + 0.03 * ((7 * i + 3 * j) % 5);
        knots[k].joint.position[1] = j + 0.02 * ((5 * i + j) % 7);
        knots[k].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
        if (i > 0)
            tie(&d, ties[d.loop_count], &knots[k - NET], &knots[k]);
        if (j > 0)
            tie(&d, ties[d.loop_count], &knots[k - 1], &knots[k]);
    }
    kt_loop *far = &loops[d.loop_count];
    tie(&d, ties[d.loop_count], &knots[0], &knots[KNOTS - 1]);
    far->name = "far";
    far->type = KT_LOOP_CUSTOM;
    far->equations = keep_far;
    far->equation_count = 1;
    far->given = KT_LOOP_GIVES_ALL;
    far->user = &evaluations;
    far->function = (kt_function){.type = KT_FUNCTION_NONE};
    kt_check_equal_int("compiles", kt_model_compile(&d, NULL, &model, &e), KT_OK);
    if (model != NULL && kt_data_create(model, &data, &e) == KT_OK) {
        kt_model_initial(model, q, v);
        kt_check_equal_int("status", kt_state_assemble(model, data, 0.0, q, v, &e), KT_ERROR_CONSTRAINT);
        kt_check_contains("message", e.message, "'far' by ");
        kt_check_below("evaluations", evaluations, 8000);
    }
    kt_data_free(data);
    kt_model_free(model);
}

KT_TEST(held_joints_that_prevent_closure_are_an_error) {
    static linkage l;
    const char *names[] = {"crank", "rocker"};
    four_bar f = four_bar_default();
    f.angle[2] += 0.3;
    linkage_four_bar(&l, &f);
    l.description.hold = names;
    l.description.hold_count = 2;
    linkage_compile(&l);
    kt_error e = {0};
    kt_check_equal_int("status", kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e), KT_ERROR_CONSTRAINT);
    kt_check_contains("message", e.message, "held joints prevent it); these stay open: 'close' by ");
}

/* Frames that nothing can move, given speeds. After the first correction, the remaining speed is rounding of the given
 * one, and not of itself. Two corrections leave some eps^2 of a speed: 2e-31 was measured. */
KT_TEST(speed_that_loops_forbid_altogether_is_taken_away) {
    static linkage l;
    kt_random random = kt_random_of_test();
    KT_WORST left = kt_worst_make("speed left");
    int rejected = 0;
    for (int i = 0; i < 100; i++) {
        const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0),
                      bar = kt_vec3_make(kt_random_uniform(&random, 0.8, 2.0), 0, 0);
        const kt_vec3 brace = kt_vec3_make(kt_random_uniform(&random, 0.8, 2.0), 0.0, 0.0);
        kt_error e = {0};
        linkage_begin(&l);
        linkage_bar(&l, "bar", NULL, none, bar, 1.0, kt_random_normal(&random));
        linkage_bar(&l, "brace", NULL, kt_vec3_make(1.5, 0.0, 0.0), brace, 2.0, kt_random_normal(&random));
        linkage_close(&l, "top", KT_LOOP_SPHERICAL, "bar", bar, "brace", brace);
        linkage_compile(&l);
        rejected += kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e) != KT_OK;
        for (int k = 0; k < 2; k++)
            kt_worst_near(&left, l.v[k], 0.0, 1e-30, "frame %d", i);
    }
    kt_check_equal_int("rejected", rejected, 0);
}

/* Positions fit, and the velocities that are held do not. */
KT_TEST(held_velocities_that_contradict_are_an_error) {
    static linkage l;
    const char *names[] = {"crank", "rocker"};
    four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    for (int k = 0; k < 3; k++)
        f.angle[k] = l.q[k];
    const double rocker = l.v[2];
    for (int k = 0; k < 2; k++) {
        kt_error e = {0};
        linkage_four_bar(&l, &f);
        l.description.hold = names;
        l.description.hold_count = 2;
        l.body[0].joint.velocity[0] = f.rate;
        l.body[2].joint.velocity[0] = rocker * f.rate / f.rate + 0.25 * k;
        linkage_compile(&l);
        l.v[2] = k ? l.v[2] : rocker;
        l.v[0] = f.rate;
        const kt_status status = kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e);
        kt_check_equal_int("status", status, KT_ERROR_CONSTRAINT);
        kt_check_contains("message", e.message,
                          "the initial velocities contradict the loops; hold fewer joints, or make loops agree; apart "
                          "are: 'close' by ");
    }
}

/* Two motions of one joint agree in position at t = 0 and not in velocity. */
KT_TEST(motions_that_contradict_in_velocity_are_named) {
    static linkage l;
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), bar = kt_vec3_make(1.0, 0.0, 0.0);
    const double slow[] = {0.1, 1.0}, fast[] = {0.1, 1.5};
    linkage_begin(&l);
    linkage_bar(&l, "a", NULL, none, bar, 0.0, 0.0);
    for (int i = 0; i < 2; i++) {
        kt_loop *loop = linkage_close(&l, i ? "fast" : "slow", KT_LOOP_MOTION, NULL, none, NULL, none);
        loop->joint = "a";
        loop->function = kt_function_polynomial(i ? fast : slow, 2);
    }
    reject(&l,
           "the initial velocities contradict the loops; hold fewer joints, or make loops agree; apart are: 'fast' by "
           "0.25, 'slow' by 0.25 (m/s or rad/s)");
}
