/* Items of a problem with Coulomb's friction in units of their own. Contacts have forces in N, stops and dry friction
 * of hinges have torques in N m, so that another unit of length changes the numbers of some items alone. If the rows of
 * item i are multiplied by d, W and b of these rows grow by d, and the item's forces by 1 / d. With powers of two,
 * modes and all bits are the same. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "enumeration.h"
#include "room.h"

#include <math.h>

enum { ITEMS = 4, ROWS = 3 * ITEMS, DOFS = 9 };

typedef struct scaled {
    coulomb_room room;
    double W[ROWS * ROWS], unit[ROWS];
    bool found;
} scaled;

typedef struct drawn {
    int n, dofs;
    kt_coulomb_type type[ITEMS];
    double friction[ITEMS], J[ROWS][DOFS], v[DOFS];
} drawn;

/* Items on a mechanism of few or many coordinates, so that rows may depend on each other. */
static void draw_items(kt_random *random, drawn *d) {
    *d = (drawn){.n = kt_random_int(random, 1, ITEMS), .dofs = kt_random_int(random, 3, DOFS)};
    for (int i = 0; i < d->n; i++) {
        const int kind = kt_random_int(random, 0, 3);
        d->type[i] = kind == 0 ? KT_COULOMB_DRY : kind == 1 ? KT_COULOMB_FRICTIONLESS : KT_COULOMB_CONE;
        d->friction[i] = kt_random_uniform(random, 0.05, 1.0);
    }
    for (int k = 0; k < d->dofs; k++) {
        d->v[k] = kt_random_normal(random);
        for (int j = 0; j < 3 * d->n; j++)
            d->J[j][k] = kt_random_normal(random);
    }
}

/* Poses and solves a problem whose item i is measured in 1 / unit[i]. */
static void solve_in_units(const drawn *d, const double *unit, scaled *s) {
    kt_coulomb *c = s->room.c;
    uint64_t steps = 0;
    c->n = c->rows = 0;
    for (int i = 0; i < d->n; i++) {
        const bool is_cone = d->type[i] == KT_COULOMB_CONE;
        c->item[c->n++] = (kt_coulomb_item){.type = d->type[i],
                                            .row = c->rows,
                                            .across = c->rows + 1,
                                            .friction = d->friction[i] / (is_cone ? 1.0 : unit[i])};
        for (int r = 0; r < (is_cone ? 3 : 1); r++) {
            s->unit[c->rows] = unit[i];
            c->line[c->rows++] = 3 * i + r;
        }
    }
    c->W = s->W;
    c->stride = 3 * d->n;
    for (int i = 0; i < c->rows; i++) {
        const double *J = d->J[c->line[i]];
        c->b[i] = 0.0;
        for (int k = 0; k < d->dofs; k++)
            c->b[i] += s->unit[i] * J[k] * d->v[k];
        for (int j = 0; j < c->rows; j++) {
            double *W = &s->W[c->line[i] * c->stride + c->line[j]];
            *W = 0.0;
            for (int k = 0; k < d->dofs; k++)
                *W += s->unit[i] * s->unit[j] * J[k] * d->J[c->line[j]][k];
        }
    }
    enumeration_set_sizes(c);
    s->found = kt_coulomb_solve(c, s->room.solver, true, s->room.solution, &steps);
}

/* The largest difference of two solutions, of forces and rates relative to the largest ones; infinite if modes
 * differ. */
static double apart(const scaled *a, const scaled *b) {
    double most = 0.0, force = 1e-300, rate = 1e-300;
    if (a->found != b->found)
        return HUGE_VAL;
    for (int i = 0; i < a->room.c->n; i++)
        most = a->room.solution->mode[i] == b->room.solution->mode[i] ? most : HUGE_VAL;
    for (int j = 0; j < a->room.c->rows; j++) {
        force = fmax(force, fabs(a->room.solution->p[j]));
        rate = fmax(rate, fabs(a->room.c->b[j]));
    }
    for (int j = 0; j < a->room.c->rows; j++) {
        most = fmax(most, fabs(a->room.solution->p[j] - b->room.solution->p[j] * b->unit[j]) / force);
        most = fmax(most, fabs(a->room.solution->u[j] - b->room.solution->u[j] / b->unit[j]) / rate);
    }
    return most;
}

KT_TEST(items_in_other_units_have_the_same_solution) {
    static const double natural[ITEMS] = {1.0, 1.0, 1.0, 1.0};
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("difference");
    scaled a = {.room = make_room(ITEMS, ROWS)}, b = {.room = make_room(ITEMS, ROWS)};
    int found = 0;
    for (int k = 0; k < 1000; k++) {
        drawn d;
        double unit[ITEMS];
        draw_items(&random, &d);
        for (int i = 0; i < ITEMS; i++)
            unit[i] = ldexp(1.0, kt_random_int(&random, -20, 20));
        solve_in_units(&d, natural, &a);
        solve_in_units(&d, unit, &b);
        found += a.found;
        kt_worst_below(&worst, a.found || b.found ? apart(&a, &b) : 0.0, 1e-9, "problem %d", k);
    }
    kt_check_above("solved", found, 900.0);
    free_room(&a.room);
    free_room(&b.room);
}

/* A contact moves by its three rows, dry friction by one. Forces of both are compared by these weights. */
KT_TEST(the_weight_of_an_item_is_the_mean_of_its_rows) {
    static const double natural[ITEMS] = {1.0, 1.0, 1.0, 1.0};
    drawn d = {.n = 2, .dofs = 4, .type = {KT_COULOMB_CONE, KT_COULOMB_DRY}, .friction = {0.5, 0.5}};
    scaled a = {.room = make_room(ITEMS, ROWS)};
    for (int k = 0; k < 4; k++)
        d.J[k][k] = 1.0 + k;
    solve_in_units(&d, natural, &a);
    kt_check_near("contact, 1/kg", kt_coulomb_weight(a.room.c, 0), (1.0 + 4.0 + 9.0) / 3.0, 1e-15);
    kt_check_near("dry friction, 1/(kg m^2)", kt_coulomb_weight(a.room.c, 1), 16.0, 0.0);
    free_room(&a.room);
}

/* Two feet of a body that slides or turns share the force along the line between them in many ways. Their shares are in
 * proportion to their limits mu N. So friction seems able to hold the body wherever it is. */
KT_TEST(feet_that_share_friction_reach_their_limits_together) {
    static const double natural[ITEMS] = {1.0, 1.0, 1.0, 1.0}, mu[] = {0.3, 0.9};
    drawn d = {.n = 2,
               .dofs = 4,
               .type = {KT_COULOMB_CONE, KT_COULOMB_CONE},
               .friction = {mu[0], mu[1]},
               .v = {2.0, 0.5, -10.0, -4.0}};
    scaled a = {.room = make_room(ITEMS, ROWS)};
    for (int i = 0; i < 2; i++) { /* moves along x, y and z, and tips */
        d.J[3 * i][2] = d.J[3 * i + 1][0] = d.J[3 * i + 2][1] = 1.0;
        d.J[3 * i][3] = i == 0 ? 1.0 : -1.0;
    }
    solve_in_units(&d, natural, &a);
    a.room.solution->mode[0] = a.room.solution->mode[1] = KT_COULOMB_STICK;
    kt_coulomb_linear(a.room.c, a.room.solution);
    const double limit[] = {7.0 * mu[0], 3.0 * mu[1]};
    for (int i = 0; i < 2; i++) {
        const double part = limit[i] / (limit[0] + limit[1]), *p = a.room.solution->p + 3 * i;
        kt_check_near("normal force, N", p[0], i == 0 ? 7.0 : 3.0, 1e-14);
        kt_check_near("along the line, N", p[1], -2.0 * part, 1e-14);
        kt_check_near("across the line, N", p[2], -0.5 * part, 1e-14);
    }
    free_room(&a.room);
}
