/* Base parameters: the columns of the regressor that do not depend on earlier columns. The order prefers columns
 * with which a person would name a sum (Gautier 1990). Regressors at random states are rotated, row by row, into
 * the triangle R of their QR factorisation. R is then brought to echelon form. A column depends on earlier base columns
 * if its length below the used rows is not above KT_DEPENDENT of its whole length:
 *
 *     R_B x = R_k,    base_i = pi_i + sum_k x_ik pi_k.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arena.h"
#include "kinetree/algebra.h"
#include "kinetree/identification.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define KT_DEPENDENT 1e-8
#define KT_NOTHING 1e-12

#define KT_BASE_FIELDS(X)                                                                                              \
    X(double, triangle, columns *columns, "R, row by row")                                                             \
    X(double, regressor, n->v *columns, "at one state, by columns")                                                    \
    X(double, row, columns, "one of its rows, in the order of preference")                                             \
    X(double, length, columns, "of R's columns")                                                                       \
    X(double, q0, n->q, "positions in the middle")                                                                     \
    X(double, q, n->q, "of a state")                                                                                   \
    X(double, step, n->v, "from q0 to q")                                                                              \
    X(double, v, n->v, "of a state")                                                                                   \
    X(double, a, n->v, "of a state")                                                                                   \
    X(int32_t, order, columns, "of preference")                                                                        \
    X(int32_t, before, columns, "-1: a base column; else how many of these come before it")

typedef struct base_work {
    KT_ARENA_DECLARE(KT_BASE_FIELDS)
} base_work;

KT_ARENA_ARRAYS(place_arrays, base_work, KT_BASE_FIELDS, const kt_counts *n, size_t columns)

size_t kt_base_parameters_work_size(const kt_model *model) {
    return model ? place_arrays(NULL, NULL, &model->n, (size_t)kt_regressor_columns(model)) : 0;
}

/* ---- the triangle ------------------------------------------------------------------------------------------------ */

/* Inertias, first moments, masses, each from the ground to the tips; then armatures and frictions. */
static void prefer_parameters(const kt_model *model, int32_t *order) {
    static const kt_dynamic_kind first[] = {KT_DYNAMIC_INERTIA_XX, KT_DYNAMIC_MOMENT_X, KT_DYNAMIC_MASS},
                                 last[] = {KT_DYNAMIC_INERTIA_YZ, KT_DYNAMIC_MOMENT_Z, KT_DYNAMIC_MASS};
    const int32_t bodies = 10 * ((int32_t)model->n.body - 1), columns = kt_regressor_columns(model);
    int32_t count = 0;
    for (int group = 0; group < 3; group++)
        for (int32_t c = 0; c < bodies; c++)
            if (c % 10 >= (int32_t)first[group] && c % 10 <= (int32_t)last[group])
                order[count++] = c;
    for (int32_t c = bodies; c < columns; c++)
        order[count++] = c;
}

/* Uniform in (-1, 1), the same on every machine: Steele, Lea & Flood's SplitMix64. */
static double draw_uniform(uint64_t *state) {
    uint64_t z = *state += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return 2.0 * (double)((z ^ z >> 31) >> 11) * 0x1p-53 - 1.0;
}

/* The largest distance between joints of a body, which lengths are drawn from. */
static double largest_link(const kt_model *model) {
    double size = 0.0;
    for (size_t i = 1; i < model->n.link; i++)
        size = fmax(size, model->link[i].parent > 0 ? kt_vec3_norm(model->link[i].at) : 0.0);
    return size > 0.0 ? size : 1.0;
}

/* Draws a random state and accelerations. Lengths are of the order of `size`, angles of the order of 1. */
static void draw_state(const kt_model *model, double size, uint64_t *seed, base_work *w) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        for (int k = 0; k < kt_link_dofs(link); k++) {
            const double unit = k < kt_link_lengths(link) ? size : 1.0;
            w->step[link->v + k] = 3.0 * unit * draw_uniform(seed);
            w->v[link->v + k] = 3.0 * unit * draw_uniform(seed);
            w->a[link->v + k] = 9.0 * unit * draw_uniform(seed);
        }
    }
    kt_position_add(model, w->q0, w->step, w->q);
}

/* Rotates two rows so that entry j of the second becomes zero. */
static void rotate_rows(double *pivot, double *row, size_t columns, size_t j) {
    const double length = kt_hypot(pivot[j], row[j]);
    if (row[j] == 0.0)
        return;
    const double c = pivot[j] / length, s = row[j] / length;
    for (size_t k = j; k < columns; k++) {
        const double x = pivot[k], y = row[k];
        pivot[k] = c * x + s * y;
        row[k] = c * y - s * x;
    }
}

/* Rotates the rows of regressors at random states into the triangle R. 2 columns / nv + 4 states have more than twice
 * as many rows as there are columns. */
static kt_status collect_regressors(const kt_model *model, kt_data *data, size_t columns, base_work *w,
                                    kt_error *error) {
    const size_t nv = model->n.v, states = nv > 0 ? 2 * columns / nv + 4 : 0;
    const double size = largest_link(model);
    uint64_t seed = 1;
    kt_model_initial(model, w->q0, w->v);
    memset(w->triangle, 0, columns * columns * sizeof *w->triangle);
    for (size_t n = 0; n < states; n++) {
        draw_state(model, size, &seed, w);
        const kt_status status = kt_regressor_evaluate(model, data, w->q, w->v, w->a, w->regressor, error);
        if (status != KT_OK)
            return status;
        for (size_t i = 0; i < nv; i++) {
            for (size_t c = 0; c < columns; c++)
                w->row[c] = w->regressor[(size_t)w->order[c] * nv + i];
            for (size_t c = 0; c < columns; c++)
                rotate_rows(w->triangle + c * columns, w->row, columns, c);
        }
    }
    return KT_OK;
}

/* ---- dependent columns ------------------------------------------------------------------------------------------- */

static double column_length(const double *triangle, size_t columns, size_t from, size_t j) {
    double length = 0.0;
    for (size_t i = from; i <= j; i++)
        length = kt_hypot(length, triangle[i * columns + j]);
    return length;
}

/* 0 to 5: masses, first moments, inertias, armatures, viscous and Coulomb frictions. */
static int column_group_of(const kt_model *model, int32_t column) {
    const kt_dynamic_kind kind = kt_regressor_parameter(model, column).kind;
    return kind >= KT_DYNAMIC_ARMATURE     ? 3 + (int)kind - (int)KT_DYNAMIC_ARMATURE
           : kind >= KT_DYNAMIC_INERTIA_XX ? 2
           : kind >= KT_DYNAMIC_MOMENT_X   ? 1
                                           : 0;
}

/* Computes the lengths of columns. A length that is a rounding error of the longest one of its unit becomes zero. An
 * example is a first moment along the axis of a joint that is on a vertical axis. */
static void measure_columns(const kt_model *model, base_work *w, size_t columns) {
    double longest[6] = {0.0};
    for (size_t j = 0; j < columns; j++) {
        const int group = column_group_of(model, w->order[j]);
        w->length[j] = column_length(w->triangle, columns, 0, j);
        longest[group] = fmax(longest[group], w->length[j]);
    }
    for (size_t j = 0; j < columns; j++)
        if (w->length[j] <= KT_NOTHING * longest[column_group_of(model, w->order[j])])
            w->length[j] = 0.0;
}

/* One pass of the factorisation: columns that depend on earlier ones get the number of these in `before`, base
 * columns get -1. Returns the rank. */
static size_t pass_over_columns(const kt_model *model, base_work *w, size_t columns) {
    size_t rank = 0;
    measure_columns(model, w, columns);
    for (size_t j = 0; j < columns; j++) {
        const bool is_base =
            w->length[j] > 0.0 && column_length(w->triangle, columns, rank, j) > KT_DEPENDENT * w->length[j];
        w->before[j] = is_base ? -1 : (int32_t)(w->length[j] > 0.0 ? rank : 0);
        for (size_t i = rank + 1; i <= j && is_base; i++)
            rotate_rows(w->triangle + rank * columns, w->triangle + i * columns, columns, j);
        rank += is_base;
    }
    return rank;
}

/* x (rank numbers) of a dependent column: by back substitution over the earlier base columns, which are at[0], at[1],
 * ... */
static void relate_column(const base_work *w, size_t columns, const int *at, size_t j, size_t rank, double *x) {
    memset(x, 0, rank * sizeof *x);
    for (size_t i = (size_t)w->before[j]; i-- > 0;) {
        const double *row = w->triangle + i * columns;
        double sum = row[j];
        for (size_t k = i + 1; k < (size_t)w->before[j]; k++)
            sum -= row[at[k]] * x[k];
        x[i] = sum / row[at[i]];
    }
}

kt_status kt_base_parameters_find(const kt_model *model, kt_data *data, void *work, size_t work_size, int *rank,
                                  int *column, double *relation, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, rank, column, relation))
        return KT_ERROR_ARGUMENT;
    const size_t columns = (size_t)kt_regressor_columns(model);
    base_work w = {.before = NULL};
    kt_status status = kt_arena_check("work", "kt_base_parameters_work_size", work, work_size,
                                      kt_base_parameters_work_size(model), error);
    if (status != KT_OK)
        return status;
    (void)place_arrays(&w, work, &model->n, columns);
    prefer_parameters(model, w.order);
    status = collect_regressors(model, data, columns, &w, error);
    if (status != KT_OK)
        return status;
    const size_t found = pass_over_columns(model, &w, columns);
    size_t base = 0, rest = found;
    for (size_t j = 0; j < columns; j++) /* places in R first, which relate needs */
        column[w.before[j] < 0 ? base++ : rest++] = (int)j;
    for (size_t k = found; k < columns; k++)
        relate_column(&w, columns, column, (size_t)column[k], found, relation + (k - found) * found);
    for (size_t k = 0; k < columns; k++)
        column[k] = w.order[column[k]];
    *rank = (int)found;
    return KT_OK;
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* Text that may be longer than its memory. */
typedef struct words {
    char *text;
    size_t size;
    int length;
} words;

/* Appends "+ 0.25 m(lower)". The first term has no sign and no factor, and a factor of 1 is not written. */
static void add_combination_term(words *to, const kt_model *model, int column, double coefficient) {
    static const char *const symbols[] = {"m",   "mcx", "mcy", "mcz",      "Ixx",     "Iyy",    "Izz",
                                          "Ixy", "Ixz", "Iyz", "armature", "viscous", "Coulomb"};
    const kt_dynamic_parameter p = kt_regressor_parameter(model, column);
    const size_t used = (size_t)to->length < to->size ? (size_t)to->length : to->size;
    char factor[32] = "", which[16] = "";
    if (to->length > 0 && fabs(fabs(coefficient) - 1.0) > 1e-9)
        (void)snprintf(factor, sizeof factor, "%.4g ", fabs(coefficient));
    if (p.coordinate >= 0 && kt_body_coordinates(model, p.body).nv > 1)
        (void)snprintf(which, sizeof which, "[%d]", p.coordinate - kt_body_coordinates(model, p.body).v);
    to->length += snprintf(used < to->size ? to->text + used : NULL, to->size - used, "%s%s%s(%s%s)",
                           to->length == 0     ? ""
                           : coefficient < 0.0 ? " - "
                                               : " + ",
                           factor, symbols[p.kind], kt_body_name(model, p.body), which);
}

int kt_base_parameter_name(const kt_model *model, int rank, const int *column, const double *relation, int index,
                           /* NOLINTNEXTLINE(readability-non-const-parameter): it is written by way of the words */
                           char *text, size_t size) {
    if (!model || !column || !relation || rank < 0 || rank > kt_regressor_columns(model) || !KT_IS_INDEX(index, rank) ||
        (!text && size > 0))
        return 0;
    const int rest = kt_regressor_columns(model) - rank;
    words to = {.text = text, .size = size};
    add_combination_term(&to, model, column[index], 1.0);
    for (int k = 0; k < rest; k++) {
        const double coefficient = relation[(size_t)index + (size_t)k * (size_t)rank];
        if (fabs(coefficient) > 1e-9)
            add_combination_term(&to, model, column[rank + k], coefficient);
    }
    return to.length;
}
