/* Stacks of boxes that slip on each other. Each box shares its load among four corners in many ways, and friction
 * follows the load, so that one corner of each box opens. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "room.h"

#include <math.h>

#include "random.h"

enum { MOST_BOXES = 4, CORNERS = 4, ITEMS = MOST_BOXES * CORNERS, LINES = 3 * ITEMS };

typedef struct stack {
    int dofs;
    double J[LINES][6 * MOST_BOXES], mass[6 * MOST_BOXES], W[LINES * LINES];
} stack;

/* Adds a point at r of a box to the three rows of a corner: along z, x and y. */
static void add_point(stack *s, int corner, int box, double sign, const double *r) {
    for (int row = 0; row < 3; row++) {
        const int x = (row + 2) % 3, y = (x + 1) % 3, z = (x + 2) % 3; /* r x e_x = z e_y - y e_z */
        double *J = s->J[3 * corner + row] + (ptrdiff_t)6 * box;
        J[x] = sign;
        J[3 + y] = sign * r[z];
        J[3 + z] = -sign * r[y];
    }
}

/* Adds the corners of box k, and the directions in which they slip on the box below. */
static void add_box(kt_random *random, stack *s, int k, const double *half, kt_coulomb *c) {
    const double v[2] = {kt_random_uniform(random, -1.0, 1.0), kt_random_uniform(random, -1.0, 1.0)};
    const double turn = kt_random_uniform(random, -5.0, 5.0), mu = kt_random_uniform(random, 0.1, 0.4);
    for (int i = 0; i < CORNERS; i++) {
        const int at = CORNERS * k + i;
        const double r[3] = {i % 2 ? half[0] : -half[0], i / 2 ? half[1] : -half[1], -half[2]};
        const double below[3] = {r[0], r[1], half[2]};
        const double slip[2] = {v[0] - turn * r[1], v[1] + turn * r[0]}, speed = hypot(slip[0], slip[1]);
        add_point(s, at, k, 1.0, r);
        if (k > 0)
            add_point(s, at, k - 1, -1.0, below);
        c->item[at] = (kt_coulomb_item){.type = KT_COULOMB_SLIPS,
                                        .row = 3 * at,
                                        .across = 3 * at + 1,
                                        .friction = mu,
                                        .size = 9.81,
                                        .e = {slip[0] / speed, slip[1] / speed}};
    }
}

/* Draws a stack: W = J M^-1 J', and b, the accelerations under gravity. */
static void draw_stack(kt_random *random, stack *s, kt_coulomb *c) {
    const int boxes = kt_random_int(random, 2, MOST_BOXES), rows = 3 * CORNERS * boxes;
    const double half[3] = {kt_random_uniform(random, 0.1, 0.3), kt_random_uniform(random, 0.1, 0.3), 0.05};
    *s = (stack){.dofs = 6 * boxes};
    for (int k = 0; k < boxes; k++) {
        for (int j = 0; j < 6; j++)
            s->mass[6 * k + j] =
                j < 3 ? 1.0
                      : (half[0] * half[0] + half[1] * half[1] + half[2] * half[2] - half[j - 3] * half[j - 3]) / 3.0;
        add_box(random, s, k, half, c);
    }
    c->n = CORNERS * boxes;
    c->rows = c->stride = rows;
    c->W = s->W;
    for (int i = 0; i < rows; i++) {
        c->line[i] = i;
        c->b[i] = i % 3 == 0 && i < 3 * CORNERS ? -9.81 : 0.0;
        for (int j = 0; j < rows; j++) {
            double sum = 0.0;
            for (int x = 0; x < s->dofs; x++)
                sum += s->J[i][x] * s->J[j][x] / s->mass[x];
            s->W[i * rows + j] = sum;
        }
    }
}

/* The largest violation of the law: forces in newtons, accelerations relative to gravity. */
static double violation_of_stack(const kt_coulomb *c, const kt_coulomb_solution *to) {
    double worst = 0.0;
    for (int i = 0; i < c->n; i++) {
        const kt_coulomb_item *item = &c->item[i];
        const double N = to->p[item->row];
        double w = c->b[item->row];
        for (int j = 0; j < c->rows; j++)
            w += kt_coulomb_entry(c, item->row, j) * to->p[j];
        worst = fmax(worst, fmax(-N, -w / 9.81));
        worst = fmax(worst, N * fabs(w) / 9.81);
        for (int k = 0; k < 2; k++)
            worst = fmax(worst, fabs(to->p[item->across + k] + item->friction * N * item->e[k]));
    }
    return worst;
}

KT_TEST(boxes_of_a_stack_that_slip_open_one_corner_each) {
    static stack s;
    kt_random random = kt_random_of_test();
    coulomb_room room = make_room(ITEMS, LINES);
    int unsolved = 0;
    double worst = 0.0;
    for (int i = 0; i < 1000; i++) {
        uint64_t steps = 0;
        draw_stack(&random, &s, room.c);
        if (!kt_coulomb_solve(room.c, room.solver, true, room.solution, &steps)) {
            unsolved++;
            continue;
        }
        const double violation = violation_of_stack(room.c, room.solution);
        worst = isnan(violation) ? HUGE_VAL : fmax(worst, violation);
    }
    kt_check_below("stacks without a solution", unsolved, 0.5);
    kt_check_below("violation of the law", worst, 1e-9);
    free_room(&room);
}
