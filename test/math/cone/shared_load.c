/* A contact that slips, and dry friction of joints, share a load: dependent rows, against their own law. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "room.h"

#include <math.h>

/* Dry friction, rows with those of the contact, and velocities. */
enum { DRY = 3, ROWS = DRY + 3, WIDTH = 4 };

typedef struct shared {
    coulomb_room room;
    double J[ROWS][WIDTH], W[ROWS * ROWS];
} shared;

/* The gap of the contact moves with `joints` joints, which have dry friction. The contact slips with one more joint.
 * Its friction moves each of the others less than its normal force does, so that there are forces. If all joints stick,
 * they and the contact may carry the load in many ways. */
static void draw_shared(kt_random *random, shared *s, int joints) {
    kt_coulomb *c = s->room.c;
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

/* The largest violation of the laws: each item obeys the law of its mode. Forces and rates are of the order of 1. */
static double violation_of_modes(const shared *s) {
    const kt_coulomb *c = s->room.c;
    const double *p = s->room.solution->p;
    double worst = fabs(p[1] + c->item[0].friction * p[0]) + fabs(p[2]);
    for (int i = 0; i < c->n; i++) {
        const int row = c->item[i].row;
        const kt_coulomb_mode mode = s->room.solution->mode[i];
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

/* If all joints rest, their forces and that of the contact are not unique. The solver takes forces with which one item
 * reaches a bound: the contact opens, or a joint's friction is at its limit. The mode of this item is that of the
 * bound. Its force must be the bound, too, because the steps that follow assume this force. */
KT_TEST(shared_load_puts_an_item_at_its_bound) {
    kt_random random = kt_random_of_test();
    shared s = {.room = make_room(DRY + 1, ROWS)};
    KT_WORST laws = kt_worst_make("laws");
    int unsolved = 0, crowded = 0, shares = 0;
    for (int k = 0; k < 20000; k++) {
        const int joints = 1 + k % DRY;
        uint64_t steps = 0;
        int within = 0;
        draw_shared(&random, &s, joints);
        if (!kt_coulomb_solve(s.room.c, s.room.solver, true, s.room.solution, &steps)) {
            unsolved++;
            continue;
        }
        for (int i = 0; i < s.room.c->n; i++)
            within += s.room.solution->mode[i] == KT_COULOMB_STICK;
        crowded += within > joints;
        shares += within == joints && s.room.solution->mode[0] == KT_COULOMB_STICK;
        kt_worst_below(&laws, violation_of_modes(&s), 1e-12, "problem %d", k);
    }
    kt_check_equal_int("unsolved", unsolved, 0);
    kt_check_equal_int("with more items within bounds than independent rows", crowded, 0);
    kt_check_above("in which the contact and all joints but one carry the load", shares, 1000.0);
    free_room(&s.room);
}
