/* A contact that slips, and dry friction of joints, share a load: dependent rows, against their own law. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/coulomb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

/* Dry friction, rows with those of the contact, and velocities. */
enum { DRY = 3, ROWS = DRY + 3, WIDTH = 4 };

typedef struct shared {
    kt_coulomb *c;
    kt_coulomb_solver *solver;
    kt_coulomb_solution *solution;
    void *memory[4];
    double J[ROWS][WIDTH], W[ROWS * ROWS];
} shared;

static void *fill_shared(shared *s, int k, size_t size) {
    s->memory[k] = aligned_alloc(KT_ARENA_ALIGNMENT, size);
    if (s->memory[k] != NULL)
        memset(s->memory[k], 0xa5, size);
    return s->memory[k];
}

static void make_shared(shared *s) {
    enum { ITEMS = DRY + 1 };
    void *matrices = fill_shared(s, 0, kt_coulomb_matrices_size(ROWS, ITEMS));
    s->c = kt_coulomb_init(ITEMS, ROWS, ITEMS, fill_shared(s, 1, kt_coulomb_size(ITEMS, ROWS)), matrices);
    s->solver = kt_coulomb_solver_init(ITEMS, ROWS, ITEMS,
                                       fill_shared(s, 2, kt_coulomb_solver_size(ITEMS, ROWS, ITEMS)), matrices);
    s->solution = kt_coulomb_solution_init(ITEMS, ROWS, fill_shared(s, 3, kt_coulomb_solution_size(ITEMS, ROWS)));
}

/* The gap of the contact moves with `joints` joints, which have dry friction. The contact slips with one more joint.
 * Its friction moves each of the others less than its normal force does, so that there are forces. If all joints stick,
 * they and the contact may carry the load in many ways. */
static void draw_shared(kt_random *random, shared *s, int joints) {
    kt_coulomb *c = s->c;
    double a[WIDTH];
    c->n = joints + 1;
    c->rows = c->stride = joints + 3;
    c->W = s->W;
    memset(s->J, 0, sizeof s->J);
    for (int k = 0; k < joints; k++)
        s->J[3 + k][k] = 1.0;
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < joints; k++)
            s->J[r][k] = kt_random_uniform(random, -1.0, 1.0) * (r == 0 ? 1.0 : 0.1 * s->J[0][k]);
    s->J[1][joints] = kt_random_uniform(random, 0.5, 1.0);
    for (int k = 0; k <= joints; k++)
        a[k] = kt_random_uniform(random, -1.0, 1.0);
    for (int i = 0; i < c->rows; i++) {
        c->line[i] = i;
        c->b[i] = 0.0;
        for (int k = 0; k <= joints; k++)
            c->b[i] += s->J[i][k] * a[k];
        for (int j = 0; j < c->rows; j++) {
            s->W[i * c->rows + j] = 0.0;
            for (int k = 0; k <= joints; k++)
                s->W[i * c->rows + j] += s->J[i][k] * s->J[j][k];
        }
    }
    c->item[0] = (kt_coulomb_item){.type = KT_COULOMB_SLIPS,
                                   .across = 1,
                                   .friction = kt_random_uniform(random, 0.0, 0.5),
                                   .e = {1.0, 0.0},
                                   .size = 2.0};
    for (int k = 0; k < joints; k++)
        c->item[1 + k] = (kt_coulomb_item){
            .type = KT_COULOMB_DRY, .row = 3 + k, .friction = kt_random_uniform(random, 0.0, 1.0), .size = 1.0};
}

/* The largest violation of the laws that the modes stand for. Forces and rates are of the size of 1. */
static double violation_of_modes(const shared *s) {
    const kt_coulomb *c = s->c;
    const double *p = s->solution->p;
    double worst = fabs(p[1] + c->item[0].friction * p[0]) + fabs(p[2]);
    for (int i = 0; i < c->n; i++) {
        const int row = c->item[i].row;
        const kt_coulomb_mode mode = s->solution->mode[i];
        const double S = c->item[i].friction, force = p[row];
        double u = c->b[row];
        for (int j = 0; j < c->rows; j++)
            u += s->W[row * c->rows + j] * p[j];
        double broken = fabs(u);
        if (mode == KT_COULOMB_OPEN)
            broken = fmax(fabs(force), -u);
        else if (mode == KT_COULOMB_SLIP)
            broken = fmax(fabs(force + S), -u);
        else if (mode == KT_COULOMB_SLIP_BACK)
            broken = fmax(fabs(force - S), u);
        else
            broken = fmax(broken, i == 0 ? -force : fabs(force) - S);
        worst = broken <= worst ? worst : broken;
    }
    return worst;
}

/* Rest of all joints leaves forces open, and friction of the contact follows its force. So one item reaches a bound:
 * the contact opens, or a joint's friction is at its limit. An item that only bears the name of a bound would have
 * another force in the steps that follow. */
KT_TEST(shared_load_puts_an_item_at_its_bound) {
    kt_random random = kt_random_of_test();
    shared s;
    KT_WORST laws = kt_worst_make("laws");
    int unsolved = 0, crowded = 0, shares = 0;
    make_shared(&s);
    for (int k = 0; k < 20000; k++) {
        const int joints = 1 + k % DRY;
        uint64_t steps = 0;
        int within = 0;
        draw_shared(&random, &s, joints);
        if (!kt_coulomb_solve(s.c, s.solver, true, s.solution, &steps)) {
            unsolved++;
            continue;
        }
        for (int i = 0; i < s.c->n; i++)
            within += s.solution->mode[i] == KT_COULOMB_STICK;
        crowded += within > joints;
        shares += within == joints && s.solution->mode[0] == KT_COULOMB_STICK;
        kt_worst_below(&laws, violation_of_modes(&s), 1e-12, "problem %d", k);
    }
    kt_check_equal_int("unsolved", unsolved, 0);
    kt_check_equal_int("with more items within bounds than independent rows", crowded, 0);
    kt_check_above("in which the contact and all joints but one carry the load", shares, 1000.0);
    for (int i = 0; i < 4; i++)
        free(s.memory[i]);
}
