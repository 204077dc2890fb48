/* Contacts without friction and dry friction of joints: complementarity problems with a positive semidefinite matrix of
 * any rank, against their own definition. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "room.h"

#include <math.h>

enum { ITEMS = 10 };

typedef struct smooth {
    coulomb_room room;
    double W[ITEMS * ITEMS];
} smooth;

/* W = J J' with `rank` columns of J, and b in its range, so that a solution exists. The odd items are dry friction. */
static void draw_smooth(kt_random *random, smooth *s, int n, int rank, bool dry) {
    double J[ITEMS][ITEMS], a[ITEMS];
    kt_coulomb *c = s->room.c;
    c->n = c->rows = c->stride = n;
    c->W = s->W;
    for (int k = 0; k < rank; k++)
        a[k] = kt_random_uniform(random, -1.0, 1.0);
    for (int i = 0; i < n; i++) {
        c->line[i] = i;
        c->b[i] = 0.0;
        for (int k = 0; k < rank; k++) {
            J[i][k] = kt_random_uniform(random, -1.0, 1.0);
            c->b[i] += J[i][k] * a[k];
        }
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int k = 0; k < rank; k++)
                sum += J[i][k] * J[j][k];
            s->W[i * n + j] = s->W[j * n + i] = sum;
        }
        const bool is_dry = dry && i % 2;
        c->item[i] = (kt_coulomb_item){.type = is_dry ? KT_COULOMB_DRY : KT_COULOMB_FRICTIONLESS,
                                       .row = i,
                                       .friction = is_dry ? kt_random_uniform(random, 0.0, 1.0) : 0.0,
                                       .size = fabs(c->b[i])};
    }
}

/* The largest violation of the laws, relative to the terms of a rate and to the force that belongs to them. */
static double violation_of_smooth(const smooth *s) {
    const kt_coulomb *c = s->room.c;
    double worst = 0.0, square = 0.0;
    for (int i = 0; i < c->n; i++)
        square += s->W[i * c->n + i] * s->room.solution->p[i] * s->room.solution->p[i];
    for (int i = 0; i < c->n; i++) {
        const double W = s->W[i * c->n + i], size = fabs(c->b[i]) + sqrt(W * square), S = c->item[i].friction;
        double u = c->b[i];
        for (int j = 0; j < c->n; j++)
            u += s->W[i * c->n + j] * s->room.solution->p[j];
        const double p = s->room.solution->p[i] * W / size, limit = S * W / size, rate = u / size;
        const bool is_dry = c->item[i].type == KT_COULOMB_DRY;
        const double broken = is_dry ? fmax(fabs(p) - limit, fmin(fabs(rate), fabs(p + copysign(limit, rate))))
                                     : fmax(fmax(-p, -rate), fmin(p, rate));
        worst = broken <= worst ? worst : broken;
    }
    return worst;
}

/* All are solved. Forces that are not unique become a vertex of the set of solutions: no more items are strictly within
 * their bounds than rows are independent. Otherwise, redundant contacts would close, and their events would watch
 * reactions that the equations do not determine. */
KT_TEST(smooth_problems_of_any_rank_have_a_vertex) {
    kt_random random = kt_random_of_test();
    smooth s = {.room = make_room(ITEMS, ITEMS)};
    KT_WORST laws = kt_worst_make("laws");
    int unsolved = 0, crowded = 0, redundant = 0;
    for (int k = 0; k < 20000; k++) {
        const int n = 1 + k % 10, rank = 1 + k / 10 % 10;
        uint64_t steps = 0;
        int within = 0;
        draw_smooth(&random, &s, n, rank, k / 100 % 2);
        if (!kt_coulomb_solve(s.room.c, s.room.solver, k / 200 % 2, s.room.solution, &steps)) {
            unsolved++;
            continue;
        }
        for (int i = 0; i < n; i++)
            within += s.room.solution->mode[i] == KT_COULOMB_STICK;
        crowded += within > rank;
        redundant += within == rank && n > rank;
        kt_worst_below(&laws, violation_of_smooth(&s), 1e-9, "problem %d", k);
    }
    kt_check_equal_int("unsolved", unsolved, 0);
    kt_check_equal_int("with more items within bounds than independent rows", crowded, 0);
    kt_check_above("with as many, and further ones", redundant, 1000.0);
    free_room(&s.room);
}

/* An event lets friction slip. A solution below its limit is none, because the step behind the decision would have the
 * force of the limit. All items obey their laws. */
KT_TEST(smooth_friction_that_leaves_has_its_largest_force) {
    kt_random random = kt_random_of_test();
    smooth s = {.room = make_room(ITEMS, ITEMS)};
    KT_WORST leaving = kt_worst_make("reserve of friction that leaves");
    KT_WORST laws = kt_worst_make("laws");
    int solved = 0, unsolved = 0;
    for (int k = 0; k < 20000; k++) {
        const int n = 2 + k % 9, leaves = 1 + 2 * kt_random_int(&random, 0, n / 2 - 1);
        uint64_t steps = 0;
        draw_smooth(&random, &s, n, 1 + k / 10 % 10, true);
        s.room.c->item[leaves].rejected = 1U << KT_COULOMB_STICK;
        if (!kt_coulomb_solve(s.room.c, s.room.solver, true, s.room.solution, &steps)) {
            unsolved++;
            continue;
        }
        solved++;
        kt_worst_below(&leaving, s.room.c->item[leaves].friction - fabs(s.room.solution->p[leaves]), 1e-12,
                       "problem %d", k);
        kt_worst_below(&laws, violation_of_smooth(&s), 1e-12, "problem %d", k);
    }
    kt_check_above("solved", solved, 1000.0);
    kt_check_above("unsolved: friction must stick", unsolved, 1000.0);
    free_room(&s.room);
}
