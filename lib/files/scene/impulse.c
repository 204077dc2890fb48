/* Velocities that events set. The loops leave the velocities v + N z free. The velocities v are those before, which
 * keep the loops closed, and A N = 0 (kt_loop_nullspace). The event takes the least change |N z| with
 *
 *     (v + N z)_i = given_i        for the velocities i that are set.
 *
 * N is made orthonormal, so that |N z| = |z|. Its rows i are made orthogonal to each other one by one (Gram and
 * Schmidt, twice). The vector z is the sum of the missing velocities along the remainders of these rows. If nothing
 * remains of a row, loops determine the velocity, or velocities that are set before it. Hard contacts and friction that
 * sticks are left out of A: they open, and impacts stop bodies that approach.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/assignment.h"

#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "model/follow.h"

#include <math.h>
#include <string.h>

struct kt_impulses {
    const kt_model *model;
    int nv;
    double *basis; /* nv x nv: N, column by column */
    double *row;   /* count x nv: rows of N, orthonormal; then z */
    double *v;     /* nv */
    kt_scene_missed missed;
};

static const double least = 1e-9; /* of a row of N, whose entries are at most 1: a smaller remainder is rounding */

kt_impulses *kt_impulses_create(kt_pool *pool, const kt_model *model, int count) {
    const size_t nv = (size_t)kt_model_nv(model);
    kt_impulses *made = kt_pool_take(pool, 1, sizeof *made);
    if (made == NULL)
        return NULL;
    *made = (kt_impulses){.model = model, .nv = (int)nv};
    made->basis = kt_pool_take(pool, nv * nv + 1, sizeof(double));
    made->row = kt_pool_take(pool, ((size_t)count + 1) * nv + 1, sizeof(double));
    made->v = kt_pool_take(pool, nv + 1, sizeof(double));
    return made->basis != NULL && made->row != NULL && made->v != NULL ? made : NULL;
}

kt_scene_missed kt_impulses_missed(const kt_impulses *impulses) { return impulses->missed; }

/* ---- vectors ----------------------------------------------------------------------------------------------------- */

static double dot_of_rows(const double *a, const double *b, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static void add_scaled_row(double *a, double factor, const double *b, int n) {
    for (int i = 0; i < n; i++)
        a[i] += factor * b[i];
}

/* Subtracts from a its components along the first `count` vectors, which are orthonormal. Scales the remainder to the
 * length 1, and returns the length before; 0 if it is rounding. */
static double orthonormalise(double *a, const double *others, int count, int n) {
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < count; k++)
            add_scaled_row(a, -dot_of_rows(a, others + (ptrdiff_t)k * n, n), others + (ptrdiff_t)k * n, n);
    const double length = sqrt(dot_of_rows(a, a, n));
    if (!(length > least))
        return 0.0;
    for (int i = 0; i < n; i++)
        a[i] /= length;
    return length;
}

/* ---- an event ---------------------------------------------------------------------------------------------------- */

/* The model with the switches of the simulation, but with all contacts open and no friction that sticks. */
static const kt_model *model_without_contacts(const kt_simulation *simulation) {
    const kt_model *model = kt_simulation_model(simulation);
    uint64_t set = kt_switch_set(model);
    for (int i = 0; i < kt_loop_count(model); i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE && kt_loop_switch(model, i) >= 0)
            set &= ~kt_switch_bits(model, kt_loop_switch(model, i));
    for (int i = 0; i < kt_effect_count(model); i++)
        if (kt_effect_stick_loop(model, i) >= 0)
            set &= ~(kt_switch_bits(model, kt_loop_switch(model, kt_effect_stick_loop(model, i))) |
                     kt_switch_bits(model, kt_effect_switch(model, i)));
    const kt_model *open = kt_model_switched(model, set);
    return open != NULL ? open : model;
}

/* Makes the columns of N orthonormal; before, those of a group may be linearly independent only. */
static int orthonormal_basis(double *basis, int columns, int nv) {
    int kept = 0;
    for (int k = 0; k < columns; k++) {
        double *column = basis + (ptrdiff_t)kept * nv;
        if (kept != k)
            memcpy(column, basis + (ptrdiff_t)k * nv, (size_t)nv * sizeof *column);
        kept += orthonormalise(column, basis, kept, nv) > 0.0;
    }
    return kept;
}

static void note_missed(kt_impulses *w, const kt_simulation *simulation, int at, double given, double got) {
    if (w->missed.count++ == 0)
        w->missed = (kt_scene_missed){
            .count = 1, .velocity = at, .time = kt_simulation_time(simulation), .given = given, .got = got};
}

kt_status kt_impulses_apply(kt_impulses *w, kt_simulation *simulation, kt_data *data, const int *at,
                            const double *values, int count, kt_error *error) {
    const kt_model *model = model_without_contacts(simulation);
    const int nv = w->nv;
    int columns = 0, rows = 0;
    kt_data_follow(model, data);
    kt_status status = kt_loop_nullspace(model, data, kt_simulation_time(simulation),
                                         kt_simulation_positions(simulation), w->basis, &columns, error);
    if (status != KT_OK)
        return status;
    columns = orthonormal_basis(w->basis, columns, nv);
    memcpy(w->v, kt_simulation_velocities(simulation), (size_t)nv * sizeof *w->v);
    for (int i = 0; i < count; i++) {
        double *row = w->row + (ptrdiff_t)rows * nv;
        for (int k = 0; k < columns; k++)
            row[k] = w->basis[(ptrdiff_t)k * nv + at[i]];
        for (int k = columns; k < nv; k++)
            row[k] = 0.0;
        const double length = orthonormalise(row, w->row, rows, nv), lacks = values[i] - w->v[at[i]];
        for (int k = 0; k < columns && length > 0.0; k++)
            add_scaled_row(w->v, lacks / length * row[k], w->basis + (ptrdiff_t)k * nv, nv);
        rows += length > 0.0;
        if (!(length > 0.0) && !(fabs(values[i] - w->v[at[i]]) <= least * (1.0 + fabs(values[i]))))
            note_missed(w, simulation, at[i], values[i], w->v[at[i]]);
    }
    return kt_simulation_jump(simulation, NULL, w->v, error);
}
