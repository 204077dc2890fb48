/* Rows of many loops that fronts reduce: windows, irregular rows and rows that fork, against dense matrices and closed
 * forms. The memory is proportional to the number of loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "sanitized.h"

#include "constraint/group.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

enum { FEWER = KT_ADDRESS_SANITIZER ? 4 : 1 }; /* of random mechanisms a share is enough for sanitizers */

/* ---- a row of windows -------------------------------------------------------------------------------------------- */

enum { WINDOWS = 40 };

/* The row at this angle, with this structure: its cranks' and couplers' accelerations, which have one value each.
 * Returns the largest error, relative to gravity's. */
static double windows_error(kt_structure structure, double theta) {
    static linkage l;
    double a[LINKAGE_NQ], error = (double)NAN;
    linkage_windows(&l, WINDOWS, theta, 0.7, KT_LOOP_REVOLUTE);
    l.options.structure = structure;
    linkage_compile(&l);
    linkage_accelerate(&l, 0.0, a);
    const double exact = windows_acceleration(WINDOWS, theta);
    error = 0.0;
    for (int i = 0; i < l.nv; i++)
        error = fmax(error, fabs(fabs(a[i]) - fabs(exact)));
    kt_check_true("structure", l.model->group[0].has_fronts == (structure != KT_STRUCTURE_DENSE));
    return error / 9.81;
}

/* Cranks along the line of their pivots are the singular positions of all windows at once. Next to it accelerations are
 * interpolated from neighbouring states. The rounding error there is below 1e-9. Measured: 1.2e-10 and 5e-12. */
KT_TEST(row_of_windows_is_exact_up_to_its_singular_position) {
    KT_WORST fronts = kt_worst_make("fronts"), dense = kt_worst_make("dense");
    for (int k = 1; k <= 13; k++) {
        const double off = k <= 12 ? pow(10.0, -k) : 0.0, theta = acos(-1.0) / 2.0 - off;
        kt_worst_below(&fronts, windows_error(KT_STRUCTURE_AUTO, theta), 1e-9, "%g from it", off);
        kt_worst_below(&dense, windows_error(KT_STRUCTURE_DENSE, theta), 1e-9, "%g from it", off);
    }
}

/* Narrow fronts do not support held coordinates; other forms then solve the group. Measured: 6e-15. */
KT_TEST(row_is_assembled_around_a_held_crank_as_by_dense_matrices) {
    static const char *const hold[] = {"crank3"};
    static linkage l, dense;
    linkage *const both[] = {&l, &dense};
    for (int held = 0; held < 2; held++) {
        for (int i = 0; i < 2; i++) {
            linkage_windows(both[i], 30, 0.5, 1.0, KT_LOOP_REVOLUTE);
            both[i]->description.hold = hold;
            both[i]->description.hold_count = held;
            both[i]->options.structure = i ? KT_STRUCTURE_DENSE : KT_STRUCTURE_AUTO;
            linkage_compile(both[i]);
        }
        kt_check_below(held ? "held" : "free",
                       linkage_assemblies_differ((const kt_model *const[2]){l.model, dense.model},
                                                 (kt_data *const[2]){l.data, dense.data}, 0.0, l.q, l.v, 1e-2),
                       1e-13);
        kt_check_equal_int("narrow", l.data->special_form[0] != 0, !held);
    }
}

/* ---- irregular rows ---------------------------------------------------------------------------------------------- */

enum { ROW = 30, ROWS = 60 / FEWER };

/* The start of the next coupler. The body is turned by `angle`. The point is `tip` in the body's frame and `point` in
 * the world. */
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

/* A row of windows of random bars, with every fifth crank on a slide. A rod between the two points closes one window,
 * instead of a pin. This leaves one more freedom. If `loaded`, every fourth joint has armature, and others have springs
 * with dampers or friction. */
static void build_row(linkage *l, bool loaded, kt_random *random) {
    static kt_effect effects[LINKAGE_BODIES];
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
    for (int b = 1; b < l->description.body_count && loaded; b += 4)
        l->body[b].joint.armature[0] = 0.5;
    for (int b = 0; b < l->description.body_count && loaded; b += 3) {
        kt_effect *e = &effects[l->description.effect_count++];
        *e = kt_effect_of(b % 2 ? KT_EFFECT_JOINT_SPRING : KT_EFFECT_JOINT_FRICTION, l->body_name[b]);
        e->stiffness = 20.0;
        e->damping = e->coulomb = 2.0;
    }
    l->description.effects = effects;
    linkage_build(l, 0.0);
}

/* Both close positions up to rounding, eps times the row's length. Let sigma be the smallest direction of the
 * equations. The gap moves coordinates by up to 1 / sigma times its size, and velocities by up to speed / sigma times
 * its size. The last number on R's diagonal is somewhat larger than sigma, and there are several roundings. The bound
 * is therefore 4 times this. Measured of twenty seeds: 0.05 to 1.2 times. */
static double projection_bound(const linkage *dense, double fastest) {
    const double reach = 1.0 / dense->data->last[0], moved = 4.0 * DBL_EPSILON * ROW * reach;
    return moved * (1.0 + fastest * reach);
}

/* Accelerations relative to the largest (measured: 2e-12). */
KT_TEST(narrow_fronts_and_dense_matrices_agree_on_irregular_rows) {
    static linkage l, dense;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("accelerations"), projection = kt_worst_make("projections");
    int narrow = 0;
    for (int n = 0; n < ROWS; n++) {
        double a[LINKAGE_NQ], b[LINKAGE_NQ], most = 0.0, fastest = 1.0;
        kt_random same = random;
        build_row(&l, n % 2, &random);
        build_row(&dense, n % 2, &same);
        kt_error e = {0};
        dense.options.structure = KT_STRUCTURE_DENSE;
        linkage_compile(&dense);
        linkage_accelerate(&l, 0.0, a);
        kt_need_fine("dense", kt_acceleration_evaluate(dense.model, dense.data, 0.0, l.q, l.v, NULL, NULL, b, &e), &e);
        narrow += l.data->special_form[0];
        for (int i = 0; i < l.nv; i++)
            most = fmax(most, fabs(b[i]));
        for (int i = 0; i < l.nv; i++)
            kt_worst_near(&worst, a[i], b[i], 1e-10 * most, "row %d, %d", n, i);
        for (int i = 0; i < l.nv; i++)
            fastest = fmax(fastest, fabs(l.v[i]));
        kt_worst_below(&projection,
                       linkage_projections_differ((const kt_model *const[2]){l.model, dense.model},
                                                  (kt_data *const[2]){l.data, dense.data}, 0.0, l.q, l.v),
                       projection_bound(&dense, fastest), "row %d", n);
    }
    kt_check_above("narrow", narrow, 0.9 * ROWS);
}

/* ---- a row that forks -------------------------------------------------------------------------------------------- */

/* The pivot of a crank of a row that forks at each: crank i ends a window that begins with crank (i - 1) / 2. */
static kt_vec3 fork_pivot(int i, int *forks) {
    int level = 1;
    for (*forks = 0; 2 * level <= i + 1; ++*forks)
        level *= 2;
    return kt_vec3_make(*forks, 5.0 * (i + 1 - level) / level, 0.0);
}

/* Cranks of 1 m that lean by theta, whose couplers do not turn. Returns their mass, at 1 kg a metre. */
static double build_fork(linkage *l, double theta) {
    const kt_vec3 up = kt_vec3_make(0.0, 1.0, 0.0);
    double mass = 0.0;
    char name[16];
    int forks;
    linkage_begin(l);
    for (int i = 0; i <= WINDOWS; i++) {
        (void)snprintf(name, sizeof name, "crank%d", i);
        linkage_bar(l, name, NULL, fork_pivot(i, &forks), up, -theta, 0.0);
    }
    for (int i = 1; i <= WINDOWS; i++) {
        const kt_vec3 to = kt_vec3_sub(fork_pivot(i, &forks), fork_pivot((i - 1) / 2, &forks));
        (void)snprintf(name, sizeof name, "coupler%d", i);
        linkage_bar(l, name, l->body[(i - 1) / 2].name, up, to, theta, 0.0);
        linkage_close(l, name, KT_LOOP_REVOLUTE, l->body[WINDOWS + i].name, to, l->body[i].name, up);
        mass += kt_vec3_norm(to);
    }
    return mass;
}

/* One branch ends before the next begins. The number of open links is therefore the number of forks above, plus two. An
 * order with the first links first opened one for every fourth window, here 12. Error: measured 7e-14. */
KT_TEST(row_that_forks_opens_as_many_links_as_forks_are_above_each_other) {
    static linkage l;
    const double theta = 0.5, mass = build_fork(&l, theta), cranks = WINDOWS + 1;
    const double exact = 9.81 * sin(theta) * (0.5 * cranks + mass) / (cranks / 3.0 + mass);
    double a[LINKAGE_NQ], error = 0.0;
    int forks;
    (void)fork_pivot(WINDOWS, &forks);
    linkage_compile(&l);
    linkage_accelerate(&l, 0.0, a);
    for (int i = 0; i < l.nv; i++)
        error = fmax(error, fabs(fabs(a[i]) - exact));
    kt_check_true("by fronts", l.model->group[0].has_fronts);
    kt_check_below("open links", l.model->group[0].front.slots, 2 * forks);
    kt_check_below("error", error, 1e-12);
}

KT_TEST(memory_grows_with_the_number_of_windows) {
    static linkage l;
    size_t size[2];
    for (int k = 0; k < 2; k++) {
        linkage_windows(&l, k ? WINDOWS : WINDOWS / 4, 1.0, 0.0, KT_LOOP_REVOLUTE);
        linkage_compile(&l);
        size[k] = kt_data_size(l.model);
    }
    kt_check_below("bytes of four times as many windows, of four times the bytes",
                   (double)size[1] / (4.0 * (double)size[0]), 1.05);
}
