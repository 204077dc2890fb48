/* SPDX-License-Identifier: Apache-2.0 */
#include "along.h"

#include <string.h>

void along_grow(kt_tree *tree, int n, kt_random *random, kt_tree_state *state) {
    kt_tree_plan plan = n % 3 == 0 ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.planar = n % 3 == 0 ? 1 + n % 2 : 0;
    plan.bodies = n % 3 == 0 ? kt_random_int(random, 1, 10) : KT_JOINT_TYPE_COUNT + kt_random_int(random, 0, 3);
    plan.massless = n % 3 == 1;
    plan.is_shuffled = n % 3 == 2;
    kt_tree_describe(tree, &plan, random);
    for (int i = 0; i < plan.bodies && n % 4 == 1; i++) /* every fourth tree has armature */
        for (int k = 0; k < KT_JOINT_NV_MAX; k++)
            tree->body[i].joint.armature[k] = 0.1 * ((i + k) % 4);
    kt_tree_compile(tree, NULL);
    kt_tree_state_draw(tree, random, state);
}

bool along_differentiate(const kt_tree *tree, const kt_tree_state *s, along_function *f, int count, double *rate) {
    static const double weight[4] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    static double value[ALONG_MOST];
    const double step = 5e-3;
    memset(rate, 0, (size_t)count * sizeof *rate);
    for (int k = 0; k < 8; k++) {
        const double side = k % 2 ? -1.0 : 1.0, by = side * step * (k / 2 + 1);
        double move[KT_TREE_NV], q[KT_TREE_NQ];
        for (int i = 0; i < tree->nv; i++)
            move[i] = by * s->v[i];
        kt_position_add(tree->model, s->q, move, q);
        if (!f(tree, q, s->v, value))
            return false;
        for (int i = 0; i < count; i++)
            rate[i] += side * weight[k / 2] * value[i] / step;
    }
    return true;
}
