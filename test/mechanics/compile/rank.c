/* Structural rank: the number of independent equations in a general position. It is neither the rank at the given
 * position nor the rank off the manifold. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include "model/model.h"

#include "kinetree/study.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void expect(linkage *l, const char *what, int tree, int equations, int rank, int alive) {
    linkage_compile(l);
    const kt_mobility f = kt_model_mobility(l->model);
    int count = 0;
    kt_note("%s", what);
    for (size_t g = 0; g < l->model->n.group; g++)
        count += l->model->group[g].count[KT_ROWS_ALL];
    kt_check_equal_int("tree", f.tree, tree);
    kt_check_equal_int("equations", f.equations, equations);
    kt_check_equal_int("rank", f.rank, rank);
    kt_check_equal_int("minimal", f.minimal, tree - rank);
    kt_check_equal_int("equations that are not void", count, alive);
}

KT_TEST(ranks_of_known_mechanisms) {
    static linkage l;
    static const kt_reduction ways[] = {KT_REDUCTION_QR, KT_REDUCTION_SVD, KT_REDUCTION_PARTITION};
    for (int way = 0; way < 3; way++) {
        four_bar f = four_bar_default();
        linkage_four_bar(&l, &f);
        l.options.reduction = kt_reduction_method_of(ways[way]);
        expect(&l, "four-bar, closed by a revolute joint", 3, 5, 2, 2);
        f.type = KT_LOOP_SPHERICAL;
        linkage_four_bar(&l, &f);
        l.options.reduction = kt_reduction_method_of(ways[way]);
        expect(&l, "four-bar, closed by a spherical joint", 3, 3, 2, 2);
        f.type = KT_LOOP_CYLINDRICAL;
        linkage_four_bar(&l, &f);
        l.options.reduction = kt_reduction_method_of(ways[way]);
        expect(&l, "four-bar, closed by a cylindrical joint", 3, 4, 2, 2);
        linkage_bricard(&l);
        l.options.reduction = kt_reduction_method_of(ways[way]);
        expect(&l, "Bricard", 5, 5, 4, 5);
        linkage_windows(&l, 2, 0.0, 1.0, KT_LOOP_REVOLUTE);
        l.options.reduction = kt_reduction_method_of(ways[way]);
        expect(&l, "two windows", 5, 10, 4, 4);
        linkage_windows(&l, 5, 0.0, 1.0, KT_LOOP_SPHERICAL);
        l.options.reduction = kt_reduction_method_of(ways[way]);
        expect(&l, "five windows", 11, 15, 10, 10);
    }
}

/* The rank must not depend on the given position. The cases are a singular position, one far from closed, and a plane
 * that is no coordinate plane. */
KT_TEST(rank_does_not_depend_on_the_given_position) {
    static linkage l;
    for (int k = -2; k <= 2; k++) {
        linkage_windows(&l, 3, 1.5707963267948966 + (k % 2 ? 1e-9 * k : 0.5e-3 * k), 1.0, KT_LOOP_REVOLUTE);
        expect(&l, "three windows that lie flat", 7, 15, 6, 6);
    }
    four_bar f = four_bar_default();
    f.angle[0] += 0.5;
    f.angle[1] -= 0.5;
    f.angle[2] += 0.5;
    linkage_four_bar(&l, &f);
    expect(&l, "thirty degrees off", 3, 5, 2, 2);
    /* a parallelogram in one line: a change point */
    f = (four_bar){.crank = 1.0, .coupler = 2.0, .rocker = 1.0, .ground = 2.0, .size = 1.0, .type = KT_LOOP_REVOLUTE};
    linkage_four_bar(&l, &f);
    expect(&l, "flat parallelogram", 3, 5, 2, 2);
    f = four_bar_default();
    linkage_four_bar(&l, &f);
    l.body[0].joint.rotation = l.body[2].joint.rotation = kt_rotation_rpy(0.3, -0.7, 1.1);
    const kt_mat3 turn = kt_mat3_from_rpy(kt_vec3_make(0.3, -0.7, 1.1));
    l.body[2].joint.at = kt_mat3_apply(turn, l.body[2].joint.at);
    expect(&l, "oblique plane", 3, 5, 2, 2);
}

KT_TEST(loops_given_twice_count_once) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    l.loop[1] = l.loop[0];
    l.loop[1].name = "again";
    l.description.loop_count = 2;
    expect(&l, "four-bar closed twice", 3, 10, 2, 4);
    linkage_bricard(&l);
    l.loop[1] = l.loop[0];
    l.loop[1].name = "again";
    l.description.loop_count = 2;
    expect(&l, "Bricard closed twice", 5, 10, 4, 10);
}

/* A wheel that rolls on the ground, and an axle that keeps it upright: holonomic equations and others. */
KT_TEST(rolling_counts_at_the_velocity_level_only) {
    static linkage l;
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0);
    linkage_begin(&l);
    kt_body *disc = linkage_bar(&l, "disc", NULL, none, kt_vec3_make(0.3, 0.0, 0.0), 0.0, 0.0);
    disc->joint.type = KT_JOINT_FREE;
    disc->joint.position[1] = 0.5;
    kt_loop *loop = linkage_close(&l, "roll", KT_LOOP_ROLLING, "disc", none, NULL, none);
    loop->axis = kt_vec3_make(0.0, 0.0, 1.0);
    loop->axis2 = kt_vec3_make(0.0, 1.0, 0.0);
    loop->radius = 0.5;
    loop->holonomic = true;
    linkage_build(&l, 0.0);
    const kt_group *group = &l.model->group[0];
    kt_check_equal_int("rank of velocities", group->rank[KT_ROWS_ALL], 3);
    kt_check_equal_int("rank of positions", group->rank[KT_ROWS_CLOSED], 1);
    kt_check_equal_int("minimal", kt_model_mobility(l.model).minimal, 3);
}

/* Off the manifold Bricard's five equations are independent, but four still count. The acceleration is near that on the
 * manifold: a step of e changes it in proportion. */
KT_TEST(rank_does_not_change_off_the_manifold) {
    static linkage l;
    for (int way = 0; way < 3; way++) {
        linkage_bricard(&l);
        l.options.reduction = kt_reduction_method_of((kt_reduction)way);
        linkage_build(&l, 0.0);
        double a[5], moved[5], q[5], kept = 0.0;
        /* somewhere on the manifold, in motion */
        l.q[0] += 0.4;
        l.v[0] = 1.0;
        kt_error e = {0};
        kt_need_fine("assembles", kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e), &e);
        linkage_accelerate(&l, 0.0, a);
        memcpy(q, l.q, sizeof q);
        for (int s = 2; s <= 8; s += 2) {
            const double off = pow(10.0, -s);
            double change = 0.0;
            for (int k = 0; k < 5; k++)
                l.q[k] = q[k] + off * (k % 2 ? 1.0 : -0.7);
            linkage_accelerate(&l, 0.0, moved);
            kt_check_equal_int("rank", l.data->rank[0], 4);
            for (int k = 0; k < 5; k++)
                change = fmax(change, fabs(moved[k] - a[k]));
            if (s == 2)
                kept = change / off;
            else
                kt_check_near("change of the acceleration", change / off, kept, 0.3 * kept);
        }
    }
}

/* Groups: which loops share links. All windows in a row share links. Two four-bars on the ground do not, nor does one
 * that is mounted on the other's coupler. */
KT_TEST(groups_are_loops_that_share_links) {
    static linkage l;
    const kt_vec3 x = kt_vec3_make(1.0, 0.0, 0.0), up = kt_vec3_make(0.0, 1.0, 0.0), none = kt_vec3_make(0.0, 0.0, 0.0);
    linkage_windows(&l, 4, 0.3, 0.0, KT_LOOP_REVOLUTE);
    linkage_compile(&l);
    kt_loop_group g = kt_loop_group_at(l.model, 0);
    kt_check_equal_int("groups", kt_loop_group_count(l.model), 1);
    kt_check_equal_int("loops", g.loop_count, 4);
    kt_check_equal_int("coordinates", g.coordinates, 9);
    kt_check_equal_int("equations", g.equations, 20);
    kt_check_equal_int("rank", g.rank, 8);
    for (int i = 0; i < 4; i++)
        kt_check_equal_int("loop", g.loops[i], i);
    kt_check_text("name", kt_loop_name(l.model, 2), "loop2");
    kt_check_equal_int("type", kt_loop_type_of(l.model, 2), KT_LOOP_REVOLUTE);
    linkage_begin(&l);
    for (int i = 0; i < 3; i++) { /* a window each; the third is mounted on the second's bar */
        char left[12], right[12], bar[12], name[12];
        const char *on = i == 2 ? "bar1" : NULL;
        snprintf(left, sizeof left, "left%d", i);
        snprintf(right, sizeof right, "right%d", i);
        snprintf(bar, sizeof bar, "bar%d", i);
        snprintf(name, sizeof name, "loop%d", i);
        linkage_bar(&l, left, on, i == 2 ? none : kt_vec3_make(3.0 * i, 0.0, 0.0), up, 0.1, 0.0);
        linkage_bar(&l, right, on, i == 2 ? x : kt_vec3_make(3.0 * i + 1.0, 0.0, 0.0), up, 0.1, 0.0);
        linkage_bar(&l, bar, l.body[3 * i].name, up, x, -0.1, 0.0);
        linkage_close(&l, name, KT_LOOP_REVOLUTE, l.body[3 * i + 2].name, x, l.body[3 * i + 1].name, up);
    }
    linkage_compile(&l);
    kt_check_equal_int("groups", kt_loop_group_count(l.model), 3);
    for (int i = 0; i < 3; i++) {
        g = kt_loop_group_at(l.model, i);
        kt_check_equal_int("loops", g.loop_count, 1);
        kt_check_equal_int("loop", g.loops[0], i);
        kt_check_equal_int("coordinates", g.coordinates, 3);
        kt_check_equal_int("rank", g.rank, 2);
    }
    kt_check_equal_int("what the third stands on is in the second", l.model->link[l.model->group[2].parent].group, 1);
}
