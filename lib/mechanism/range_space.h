/* Closed contacts as rows in range space, over the tree of the mechanism (range_space.c). Only models whose closed
 * loops are all hard contacts, stops or friction that sticks have this form. */
#ifndef KT_MECHANISM_RANGE_SPACE_H
#define KT_MECHANISM_RANGE_SPACE_H

#include "base/arena.h"
#include "dynamics/aba_inverse.h"

/* The most rows that can be independent. */
static inline size_t kt_range_most(const kt_counts *n) { return n->row < n->v ? n->row : n->v; }

/* Every array: type, name, count, meaning. Matrices are column-major. */
#define KT_RANGE_FIELDS(X)                                                                                             \
    X(double, jacobian, kt_range_most(n) * n->v, "J', a column for each row")                                          \
    X(double, response, kt_range_most(n) * n->v, "M^-1 J'")                                                            \
    X(double, factor, kt_range_most(n) * kt_range_most(n), "K = J M^-1 J', then L")                                    \
    X(double, diagonal, kt_range_most(n), "of K")                                                                      \
    X(double, right, kt_range_most(n), "b''")                                                                          \
    X(double, multiplier, kt_range_most(n), "lambda without further forces")                                           \
    X(double, change, kt_range_most(n), "a change of lambda")                                                          \
    X(double, free, n->v, "accelerations of the tree")                                                                 \
    X(double, force, n->v, "scratch: joint forces")                                                                    \
    X(int32_t, first, n->link, "the first degree of freedom of each link, in the order of the links")                  \
    X(char, inverse, kt_inverse_layout(NULL, NULL, n), "M^-1")

typedef struct kt_range {
    int rows, nv;
    kt_inverse_terms terms;
    KT_ARENA_DECLARE(KT_RANGE_FIELDS)
} kt_range;

size_t kt_range_size(const kt_counts *n);
/* Lays the arrays out in memory of kt_range_size. */
kt_range *kt_range_init(const kt_model *model, void *memory);

/* Finds rows, M^-1 J', K and the multipliers without further forces. Data then hold the poses of the state. Returns
 * false if the rows do not have this form: other loops are closed, rows are dependent or nearly so, or a number is not
 * finite. */
bool kt_range_prepare(const kt_model *model, kt_data *data, const kt_dynamic_state *at, kt_range *r);

/* The row of the first equation of a loop that is closed. */
int kt_range_row(const kt_model *model, const kt_loop_record *loop);

/* Adds to the joint forces x those of a wrench about the origin of a link. */
void kt_range_add_wrench(const kt_model *model, const kt_range *r, int32_t link, kt_vec3 moment, kt_vec3 force,
                         double *x);

/* The change of lambda due to joint forces. */
void kt_range_respond(const kt_range *r, const double *force, double *change);

/* Adds J' lambda to joint forces. */
void kt_range_add_rows(const kt_range *r, const double *lambda, double *force);

/* Accelerations under further joint forces. Returns false if a number is not finite. */
bool kt_range_accelerate(const kt_model *model, kt_range *r, const double *force, double *a);

#endif
