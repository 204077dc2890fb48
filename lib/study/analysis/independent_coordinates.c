/* Coordinates of the manifold of states: which joint coordinates are independent, and how the others depend on them.
 *
 * At a state the equations of all loops allow steps dq with A1 dq = 0 (A1: the equations with a residual). At a fixed
 * position they allow velocity changes dv with A dv = 0. Gauss-Jordan elimination with full pivoting turns A1 into
 * [1 R1], with as many dependent coordinates as A1 has rank. Continued with the other equations, the elimination turns
 * A into [1 R]:
 *
 *     dq = [-R1; 1] dq_independent,    dv = [-R; 1] dv_independent.
 *
 * The columns of C = d(A v - b')/dq take part in the elimination. Along a step dq on the manifold, velocities must
 * change by A dv = -C dq. Among all such dv, this one leaves the independent velocities unchanged:
 *
 *     dv = [-T C dq; 0],               T A = [1 R].
 *
 * Coordinates with independent velocities have independent positions, too. Equations are scaled to size one and
 * coordinates to their units. Joints that are fixed or driven by a motor become dependent only if their column is more
 * than ten times larger than the others.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"

#include "base/where.h"
#include "constraint/dual_rows.h"
#include "dynamics/dynamics.h"
#include "reduction/kernel.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- elimination ------------------------------------------------------------------------------------------------- */

enum { UNUSED = -1 };

/* A row's largest weighted entry in a column without a pivot: the first among equal entries. */
typedef struct candidate {
    double weighted; /* 0: none */
    int32_t column;
    bool taken; /* the row has a pivot */
} candidate;
_Static_assert(sizeof(candidate) <= KT_CANDIDATE_BYTES, "a linearisation has room for the candidates of its rows");

typedef struct elimination {
    double *a; /* rows x width, column-major: `columns` of coordinates, then further columns that are transformed
                  along */
    size_t rows, columns, width;
    int32_t *pivot_row; /* pivot row of each column; UNUSED: the coordinate is independent */
    const double *weight;
    candidate *candidate; /* of each row */
    int32_t *filled;      /* rows with an entry in the pivot's column */
    double first, last;   /* the first pivot and the smallest one */
} elimination;

/* Finds the column with the largest weighted entry of a row, among the columns that are no pivots yet. */
static void find_candidate(const elimination *e, size_t row) {
    candidate *best = &e->candidate[row];
    best->weighted = 0.0;
    for (size_t c = 0; c < e->columns && !best->taken; c++) {
        const double x = fabs(e->a[c * e->rows + row]) * e->weight[c];
        if (e->pivot_row[c] != UNUSED || !(x > best->weighted))
            continue;
        best->weighted = x;
        best->column = (int32_t)c;
    }
}

/* Finds the largest weighted entry in columns without a pivot. Only unused rows with holonomic[row] == kind count.
 * Returns the size of the entry, or 0 if there is none. */
static double find_coordinate_pivot(const elimination *e, const bool *holonomic, bool kind, size_t *row,
                                    size_t *column) {
    double best = 0.0;
    for (size_t r = 0; r < e->rows; r++) {
        if (holonomic[r] != kind || !(e->candidate[r].weighted > best))
            continue;
        best = e->candidate[r].weighted;
        *row = r;
        *column = (size_t)e->candidate[r].column;
    }
    return best > 0.0 ? fabs(e->a[*column * e->rows + *row]) : 0.0;
}

/* Only rows and columns with entries in the pivot's column and row change. */
static void eliminate_coordinate(elimination *e, size_t row, size_t column) {
    double *pivot = e->a + column * e->rows;
    const double whole = pivot[row];
    size_t count = 0;
    for (size_t r = 0; r < e->rows; r++)
        if (r != row && pivot[r] != 0.0)
            e->filled[count++] = (int32_t)r;
    for (size_t c = 0; c < e->width; c++) {
        double *to = e->a + c * e->rows;
        const double x = to[row] /= whole;
        for (size_t i = 0; i < count && c != column && x != 0.0; i++)
            to[e->filled[i]] -= x * pivot[e->filled[i]];
    }
    for (size_t r = 0; r < e->rows; r++)
        pivot[r] = r == row ? 1.0 : 0.0;
    e->pivot_row[column] = (int32_t)row;
    e->candidate[row] = (candidate){.taken = true};
    for (size_t i = 0; i < count; i++)
        find_candidate(e, (size_t)e->filled[i]);
}

/* Eliminates `rank` dependent coordinates with rows of one kind; returns false if fewer rows are independent. */
static bool reduce_coordinates(elimination *e, const bool *holonomic, bool kind, int rank) {
    for (int k = 0; k < rank; k++) {
        size_t row = 0, column = 0;
        const double size = find_coordinate_pivot(e, holonomic, kind, &row, &column);
        if (!(e->first > 0.0))
            e->first = e->last = size;
        e->last = fmin(e->last, size);
        if (!(size > KT_RANK_TOLERANCE * e->first))
            return false;
        eliminate_coordinate(e, row, column);
    }
    return true;
}

/* Writes the basis of the motions that remain free, and the independent coordinates; returns their number. */
static int write_free_basis(const elimination *e, const double *unit, int *coordinate, double *basis) {
    int count = 0;
    for (size_t j = 0; j < e->columns; j++) {
        if (e->pivot_row[j] != UNUSED)
            continue;
        double *x = basis + (size_t)count * e->columns;
        for (size_t d = 0; d < e->columns; d++)
            x[d] = e->pivot_row[d] == UNUSED ? (d == j ? 1.0 : 0.0)
                                             : -e->a[j * e->rows + (size_t)e->pivot_row[d]] * unit[d] / unit[j];
        coordinate[count++] = (int)j;
    }
    return count;
}

/* dv = -T C dq of a position state in the dependent coordinates, and a bound of its rounding errors. */
static void write_dependent_velocity(const elimination *e, const double *unit, const double *dq, double *dv,
                                     double *rounding) {
    const double *c_q = e->a + e->rows * e->columns, condition = e->last > 0.0 ? e->first / e->last : 1.0;
    memset(dv, 0, e->columns * sizeof *dv);
    memset(rounding, 0, e->columns * sizeof *rounding);
    for (size_t k = 0; k < e->columns; k++) {
        if (dq[k] == 0.0)
            continue;
        for (size_t d = 0; d < e->columns; d++) {
            const double x = e->pivot_row[d] == UNUSED ? 0.0 : c_q[k * e->rows + (size_t)e->pivot_row[d]] * dq[k];
            dv[d] += x;
            rounding[d] += fabs(x);
        }
    }
    for (size_t d = 0; d < e->columns; d++) {
        dv[d] = dv[d] != 0.0 ? -unit[d] * dv[d] : 0.0;
        rounding[d] *= 4.0 * DBL_EPSILON * condition * unit[d];
    }
}

/* ---- choice ------------------------------------------------------------------------------------------------------ */

/* Scales coordinates to their units and the row to size one. A row that is only rounding compared with its possible
 * size could_be is set to zero, because the scaled row would count as an equation. */
static void scale_row(kt_linearization *l, size_t row, double could_be) {
    const size_t rows = l->size.rows, nv = l->size.v;
    double largest = 0.0;
    for (size_t c = 0; c < nv; c++) {
        l->equation[c * rows + row] *= l->unit[c];
        largest = fmax(largest, fabs(l->equation[c * rows + row]));
    }
    const bool counts = largest > KT_RANK_TOLERANCE * KT_RANK_FLOOR * could_be;
    for (size_t c = 0; c < 2 * nv; c++)
        l->equation[c * rows + row] = counts ? l->equation[c * rows + row] / largest : 0.0;
}

/* Divides each equation by its scale, so that pivots of different equations are comparable. */
static void scale_coordinates(kt_linearization *l) {
    const kt_model *model = l->model;
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        if (kt_loop_is_off(loop))
            continue;
        const kt_group_work w = kt_group_matrices(model, l->data, (size_t)loop->group, KT_ROWS_ALL);
        const int32_t *slot = model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++)
            scale_row(l, (size_t)loop->equation + (size_t)r, slot[r] < 0 ? 0.0 : w.scale[slot[r]]);
    }
}

/* Marks the equations that restrict positions, not only velocities. */
static void find_holonomic(kt_linearization *l) {
    const kt_model *model = l->model;
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        if (kt_loop_is_off(loop))
            continue;
        const kt_group *group = &model->group[loop->group];
        const int32_t *slot = model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++)
            l->holonomic[loop->equation + r] = slot[r] < group->count[KT_ROWS_CLOSED];
    }
}

static kt_status reject_singular_group(const kt_linearization *l, size_t g, kt_error *error) {
    const kt_loop_group group = kt_loop_group_at(l->model, (int)g);
    const char *others = group.loop_count > 1 ? " and those that share its links" : "";
    return kt_error_set(
        error, KT_ERROR_SINGULAR,
        kt_where_format("loop '%.60s'%s, t = %.9g s", kt_loop_name(l->model, group.loops[0]), others, l->t).text,
        "in this singular position the equations of the loops depend on each other, and the mechanism "
        "can move on in more than one way, so there is no linearisation; use a neighbouring position");
}

/* Checks that all constraint groups have their usual ranks at this state. */
static kt_status check_ranks(const kt_linearization *l, bool *near, kt_error *error) {
    const kt_model *model = l->model;
    *near = false;
    for (int rows = KT_ROWS_COUNT - 1; rows >= 0; rows--) {
        if (!model->group_kernels->factor(model, l->data, (kt_rows)rows, false))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "an equation of the loops is not finite");
        for (size_t g = 0; g < model->n.group; g++) {
            if (l->data->rank[g] < model->group[g].rank[rows])
                return reject_singular_group(l, g, error);
            *near |= l->data->near[g];
        }
    }
    return KT_OK;
}

/* Fills A and C at the state. */
static kt_status fill_equations(kt_linearization *l, kt_error *error) {
    const kt_model *model = l->model;
    kt_status status = kt_loop_equations(model, l->data, l->t, l->q0, l->v0, l->equation, NULL, NULL, NULL, error);
    if (status == KT_OK)
        status = kt_motion_update(model, l->data, l->q0, l->v0, NULL, error);
    if (status != KT_OK)
        return status;
    const kt_dual_motion at = {.model = model,
                               .data = l->data,
                               .t = l->t,
                               .q = l->q0,
                               .v = l->v0,
                               .a = l->a0,
                               .dof = l->dof,
                               .chain = l->chain};
    kt_dual_loop_rates(&at, l->equation + l->size.rows * l->size.v);
    return KT_OK;
}

/* The weight of each coordinate in the choice of pivots: low for coordinates that should remain independent. */
static void fill_weights(const kt_linearization *l, double *weight) {
    for (size_t c = 0; c < l->size.v; c++)
        weight[c] = l->model->held[c] ? 0.1 : 1.0;
    for (size_t i = 0; i < l->model->n.effect; i++)
        if (l->model->effect[i].type == KT_EFFECT_MOTOR)
            weight[l->model->link[l->model->effect[i].link[0]].v] = 0.1;
}

kt_status kt_independent_coordinates_choose(kt_linearization *l, kt_system_arrays *out, kt_linear_system *system,
                                            kt_error *error) {
    const kt_model *model = l->model;
    elimination e = {.a = l->equation,
                     .rows = l->size.rows,
                     .columns = l->size.v,
                     .width = 2 * l->size.v,
                     .pivot_row = l->pivot_row,
                     .candidate = (candidate *)(void *)l->candidate,
                     .filled = l->filled,
                     .weight = l->direction};
    int rank[KT_ROWS_COUNT] = {0, 0};
    for (size_t c = 0; c < e.columns; c++)
        l->pivot_row[c] = UNUSED;
    system->near_singular = false;
    if (model->n.group) {
        kt_status status = fill_equations(l, error);
        if (status == KT_OK)
            status = check_ranks(l, &system->near_singular, error);
        if (status != KT_OK)
            return status;
        for (size_t g = 0; g < model->n.group; g++)
            for (int k = 0; k < KT_ROWS_COUNT; k++)
                rank[k] += model->group[g].rank[k];
        scale_coordinates(l);
        find_holonomic(l);
    }
    fill_weights(l, l->direction);
    for (size_t r = 0; r < e.rows && rank[KT_ROWS_ALL] > 0; r++) {
        e.candidate[r] = (candidate){.taken = false};
        find_candidate(&e, r);
    }
    bool fine = reduce_coordinates(&e, l->holonomic, true, rank[KT_ROWS_CLOSED]);
    system->positions = write_free_basis(&e, l->unit, out->position_coordinate, l->free_position);
    fine = fine && reduce_coordinates(&e, l->holonomic, false, rank[KT_ROWS_ALL] - rank[KT_ROWS_CLOSED]);
    system->velocities = write_free_basis(&e, l->unit, out->velocity_coordinate, l->free_velocity);
    system->auxiliary_states = (int)l->size.x;
    system->states = system->positions + system->velocities + system->auxiliary_states;
    for (size_t j = 0; j < (size_t)system->positions && fine; j++)
        write_dependent_velocity(&e, l->unit, l->free_position + j * l->size.v, l->velocity_change + j * l->size.v,
                                 l->velocity_rounding + j * l->size.v);
    return fine ? KT_OK : reject_singular_group(l, 0, error);
}
