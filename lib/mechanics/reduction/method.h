/* Methods of solving the equations of a group: their functions, compiled for each instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_METHOD_H
#define KT_REDUCTION_METHOD_H

#include "constraint/group.h"

/* x (m): a solution of the independent equations of A x = b (k). */
typedef void kt_particular(const kt_group_work *w, int rank, const kt_real1 *b, kt_real1 *x);

/* w->basis: m x (m - rank), A basis = 0. */
typedef void kt_basis(const kt_group_work *w, int rank);

#ifndef KT_LANES

/* Balanced groups, which have units (compile/group_units.c): a method factors the matrix of A_ij unit_j / scale_i, and
 * finds the numbers y_j = x_j / unit_j. These functions serve balanced groups only. */

/* Scales the entries of equation c. */
static inline void kt_group_scale_equation(const kt_group_work *w, int c, double *x) {
    for (int i = 0; i < w->m; i++)
        x[i] *= w->unit[i] / w->scale[c];
}

/* y to x, or forces on coordinates to forces in their units. */
static inline void kt_group_scale_coordinates(const kt_group_work *w, double *x) {
    for (int i = 0; i < w->m; i++)
        x[i] *= w->unit[i];
}

/* Multiplies the scales of the equations into the first `rank` columns of an upper triangle in w->factor. */
static inline void kt_group_unscale_columns(const kt_group_work *w, int rank) {
    for (int c = 0; c < rank; c++)
        for (int i = 0; i <= c; i++)
            w->factor[(size_t)c * (size_t)w->m + (size_t)i] *= w->scale[w->pivot[c]];
}

/* Turns a basis in y into one in x. */
KT_INNER void kt_group_scale_basis(const kt_group_work *w, int rank);

/* A method of solving A x = b for the coordinates (qr_method.c; others in lib/study/compare). `cap` is the structural
 * rank. */
typedef struct kt_reduction_kind {
    bool least;   /* `particular` is the least solution */
    bool chooses; /* rank is below the number of equations: some are chosen, and the others are not solved */
    bool pins;    /* a group that one pin in a plane closes may be solved in closed form instead (pin.h) */
    bool fronts;  /* large groups may be eliminated link by link instead (front.h) */
    int large;    /* groups with this number of coordinates and more need the memory that `open` provides */
    kt_status (*open)(kt_error *error);
    /* Factors w->a; returns the numerical rank, at most cap, or -1 if a number was not finite. */
    int (*factor)(kt_group_work *w, int cap);
    /* The size of the i-th direction as factored. */
    double (*size)(const kt_group_work *w, int i);
    kt_particular *particular;
    kt_basis *basis;
    /* Maggi-Kane with these two (maggi_kane.h). */
    bool (*solve)(const kt_group_work *w, int rank, int width);
    /* lambda (k): A' lambda = g (m), zeros for dependent equations; g is overwritten. */
    void (*multipliers)(const kt_group_work *w, int rank, double *g, double *lambda);
} kt_reduction_kind;

/* A method, compiled for each instruction set. */
struct kt_reduction_method {
    const kt_reduction_kind *baseline, *v3, *v4;
};

/* The table of a method whose functions end in the name of the instruction set. */
#ifdef KT_ISAS
#define KT_REDUCTION_METHOD(name)                                                                                      \
    { &name##_baseline, &name##_v3, &name##_v4 }
#else
#define KT_REDUCTION_METHOD(name)                                                                                      \
    { &name##_baseline, NULL, NULL }
#endif

#define KT_REDUCTION_EXTERN(name) extern const kt_reduction_kind name##_baseline, name##_v3, name##_v4;
KT_REDUCTION_EXTERN(kt_reduction_qr)

/* Returns a method's functions for an instruction set; NULL: the functions of QR. */
const kt_reduction_kind *kt_reduction_kind_of(const kt_reduction_method *method, kt_isa isa);

#else

/* The method of this instruction set in lanes, for groups of fewer coordinates than KT_LARGE (qr_method.c). `factor`
 * returns the states whose rank is `cap`, and `solve` those whose reduced inertia is regular. */
kt_condition KT_KERNEL(kt_qr_factor)(const kt_group_work *w, int cap);
kt_particular KT_KERNEL(kt_qr_particular);
kt_condition KT_KERNEL(kt_qr_solve_group)(const kt_group_work *w, int rank, int width);

#endif

#endif
