/* A coupling of two joints, c_y y + c_x x + f(y, x) = offset, as the polynomial
 *     y = a0 + a1 x + a2 x^2 + a3 x^3 + a4 x^4.
 *
 * a0 to a3 follow from the derivatives at zero, and a4 from the remainder at x = 1. The residual at other positions
 * decides whether the formula is that polynomial. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/third.h"
#include "model/formula_names.h"
#include "robot/write.h"

#include <math.h>

/* The left side less the right one. */
typedef struct relation {
    const kt_loop *loop;
    const kt_expression *formula; /* NULL: there is none */
    int own;                      /* the term of y */
} relation;

static void place(const relation *r, double y, double x, double at[2]) {
    at[r->own] = y;
    at[1 - r->own] = x;
}

static double residual_at(const relation *r, double y, double x) {
    double at[2];
    place(r, y, x, at);
    const double linear = r->loop->terms[0].coefficient * at[0] + r->loop->terms[1].coefficient * at[1];
    return linear + (r->formula != NULL ? kt_expression_evaluate(r->formula, at) : 0.0) - r->loop->offset;
}

/* The first three derivatives of f at zero, by y or by x. */
static void differentiate(const relation *r, bool by_y, double d[3]) {
    double at[2] = {0.0, 0.0}, along[2], y[3];
    d[0] = d[1] = d[2] = 0.0;
    if (r->formula == NULL)
        return;
    place(r, by_y, !by_y, along);
    kt_expression_taylor(r->formula, at, along, NULL, y);
    d[0] = y[1];
    d[1] = y[2];
    d[2] = kt_expression_third(r->formula, at, along);
}

/* Whether the residual equals slope (y - (a0 + a1 x + ... + a4 x^4)), by comparison at 15 points. */
static bool is_polynomial(const relation *r, double slope, const double a[5]) {
    static const double ys[] = {-1.5, 0.0, 0.7}, xs[] = {-2.3, -0.9, 0.4, 1.7, 3.1};
    for (size_t i = 0; i < sizeof ys / sizeof *ys; i++)
        for (size_t k = 0; k < sizeof xs / sizeof *xs; k++) {
            double p = 0.0, size = fabs(ys[i]);
            for (int n = 4; n >= 0; n--) {
                p = a[n] + xs[k] * p;
                size += fabs(a[n] * pow(xs[k], n));
            }
            if (!(fabs(residual_at(r, ys[i], xs[k]) - slope * (ys[i] - p)) <= 1e-12 * fabs(slope) * size))
                return false;
        }
    return true;
}

bool kt_export_polynomial(kt_export *x, const kt_loop *loop, int own, double a[5]) {
    relation r = {.loop = loop, .own = own};
    kt_coupling_names names = {.description = x->d, .loop = loop};
    const kt_symbols symbols = kt_coupling_symbols(&names);
    double by_y[3], by_x[3];
    if (kt_loop_has_formula(loop) && (r.formula = kt_export_parse(x, loop->formula, &symbols)) == NULL)
        return false;
    differentiate(&r, true, by_y);
    differentiate(&r, false, by_x);
    const double slope = loop->terms[own].coefficient + by_y[0];
    if (slope == 0.0 || !isfinite(slope))
        return false;
    a[0] = -residual_at(&r, 0.0, 0.0) / slope;
    a[1] = -(loop->terms[1 - own].coefficient + by_x[0]) / slope;
    a[2] = -by_x[1] / (2.0 * slope);
    a[3] = -by_x[2] / (6.0 * slope);
    a[4] = -residual_at(&r, 0.0, 1.0) / slope - a[0] - a[1] - a[2] - a[3];
    if (fabs(a[4]) <= 1e-13 * (fabs(a[0]) + fabs(a[1]) + fabs(a[2]) + fabs(a[3])))
        a[4] = 0.0;
    return is_polynomial(&r, slope, a);
}
