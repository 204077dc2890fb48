/* The cone solver's memory, and the way that a problem takes: a stored matrix through the cascade (cone.c), blocks
 * through a working set (cone_members.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include <assert.h>

KT_ARENA_LAYOUT(lay_out_cone, struct kt_cone, KT_CONE_FIELDS, size_t m)
KT_ARENA_ARRAYS(lay_out_cone_members, struct kt_cone, KT_CONE_MEMBER_FIELDS, size_t n, size_t m)
KT_ARENA_ARRAYS(lay_out_cone_matrices, struct kt_cone, KT_CONE_MATRICES, size_t m)

size_t kt_cone_size(int n, int most) {
    const size_t m = 3 * (size_t)most;
    return lay_out_cone(NULL, m) + (n > most ? lay_out_cone_members(NULL, NULL, (size_t)n, m) : 0);
}

size_t kt_cone_matrices_size(int most) { return lay_out_cone_matrices(NULL, NULL, 3 * (size_t)most); }

kt_cone *kt_cone_init(int n, int most, void *memory, void *matrices) {
    assert(n >= 0 && most >= 0);
    kt_cone *cone = memory;
    const size_t m = 3 * (size_t)most, own = lay_out_cone(memory, m);
    (void)lay_out_cone_matrices(cone, matrices, m);
    cone->most = most;
    if (n > most)
        (void)lay_out_cone_members(cone, (char *)memory + own, (size_t)n, m);
    return cone;
}

int kt_cone_room(const kt_cone *cone) { return cone->most; }
double *kt_cone_matrix(kt_cone *cone) { return cone->W; }

#ifndef NDEBUG
/* Whether none of n numbers is negative or NaN; true for an array that is not given. */
static bool are_nonnegative(const double *x, int n) {
    bool are = true;
    for (int i = 0; i < n && x != NULL; i++)
        are = are && x[i] >= 0.0;
    return are;
}
#endif

kt_cone_result kt_cone_solve(kt_cone *cone, const kt_cone_problem *problem, double *p) {
    assert(problem->n >= 0 && (problem->blocks != NULL || problem->n <= cone->most));
    assert(problem->n == 0 || problem->W != NULL || problem->blocks != NULL);
    assert(are_nonnegative(problem->mu, problem->n) && are_nonnegative(problem->least, problem->n));
    assert(problem->enough >= 0.0);
    return problem->blocks == NULL ? kt_cone_cascade(cone, problem, NULL, problem->n, p)
                                   : kt_cone_solve_members(cone, problem, p);
}
