/* The constant parts in a front's slots, step by step (front.h). The constant of a link is t, the constant part of its
 * acceleration. Relations and delayed equations have constant parts, too. Slots enter and leave in this file, and
 * determine the right-hand sides of the equations that a step completes:
 *   t_i = shift(t_parent)         e = b - W (t_b - t_a)         t += T y
 *
 * This is a template. In front_solve.c a right-hand side is a number. In kkt_solve.c, eight right-hand sides form a
 * vector, with a lane for each. The including file defines
 *
 *   KT_COLUMN              the type of one number, or of a lane each
 *   KT_COLUMN_SHIFT        kt_motion_shift (components.h) for it
 *
 * `constant` is the array of the slots' constants, f->constant in front_solve.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/front_link.h"

#include <string.h>

KT_INLINE KT_COLUMN *constant_at(const kt_front *f, KT_COLUMN *constant, int32_t holder) {
    return constant + kt_front_place(f, holder);
}

/* Enters the slots of a step's link, whose constant is the parent's constant, shifted. Also enters the slots of
 * relations that begin with the link; their constants begin with zero. */
KT_INLINE void enter_slots(kt_front *f, KT_COLUMN *constant, int s) {
    const kt_front_step *step = &f->step[s];
    const KT_COLUMN *up = step->up < 0 ? NULL : constant_at(f, constant, step->up);
    const int n = f->components;
    KT_COLUMN x[KT_FRONT_SPACE], *own = constant_at(f, constant, s);
    /* Not to n: the compiler would take a string instruction, which is slow to begin. */
    for (int c = 0; c < KT_FRONT_SPACE; c++)
        x[c] = up && c < n ? up[c] : (KT_COLUMN){0};
    if (up)
        KT_COLUMN_SHIFT(n, kt_front_offset(f, step->link), x);
    for (int c = 0; c < KT_FRONT_SPACE; c++)
        if (c < n)
            own[c] = x[c];
    kt_front_enter(f, s);
    for (int i = step->term; i < step->term + step->term_count; i++) {
        const int32_t slot = f->group->link_count + f->model->front_term[i].slot;
        if (!f->model->front_term[i].first)
            continue;
        *constant_at(f, constant, slot) = (KT_COLUMN){0};
        kt_front_enter(f, slot);
    }
}

/* The constant part of the equation `row` of a loop that the step completes. */
KT_INLINE KT_COLUMN constant_of(const kt_front *f, KT_COLUMN *constant, const kt_front_step *step, int32_t index,
                                int32_t row) {
    const kt_loop_record *loop = &f->model->loop[index];
    KT_COLUMN sum = {0};
    if (loop->term_count)
        return *constant_at(f, constant, kt_front_relation_of(f, step, index));
    for (int k = 0; k < 2; k++) {
        const int32_t at = kt_front_step_of(f, loop->link[k]);
        const double *w = kt_front_wrench(f, row, k);
        const KT_COLUMN *t = constant_at(f, constant, at < 0 ? 0 : at);
        for (int c = 0; c < f->components && at >= 0; c++)
            sum += w[c] * t[c];
    }
    return sum;
}

/* e of the step's independent equations, in the order of their pivots. */
KT_INLINE void find_right(const kt_front *f, KT_COLUMN *constant, int s, const KT_COLUMN *b, KT_COLUMN *e) {
    const kt_front_step *step = &f->step[s];
    const kt_front_count *count = &f->count[s];
    const int32_t *pivot = f->w.pivot + count->first;
    for (int d = 0; d < count->received; d++)
        for (int j = 0; j < count->rank; j++)
            if (pivot[j] == count->received_row[d])
                e[j] = b[pivot[j]] - *constant_at(f, constant, kt_front_delayed(f, d));
    for (int i = step->loop; i < step->loop + step->loop_count; i++) {
        const int32_t index = f->model->front_loop[i];
        const kt_loop_record *loop = &f->model->loop[index];
        const int32_t *slot = f->model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++)
            for (int j = 0; j < count->rank && slot[r] >= 0; j++)
                if (pivot[j] == slot[r])
                    e[j] = b[slot[r]] - constant_of(f, constant, step, index, slot[r]);
    }
}

/* Updates the slots of delayed equations. The slots that the step received leave. The slots that the step passes on
 * enter with their previous constants. */
KT_INLINE void pass_delayed(kt_front *f, KT_COLUMN *constant, int s) {
    const kt_front_step *step = &f->step[s];
    const kt_front_count *count = &f->count[s];
    KT_COLUMN constants[KT_FRONT_DELAYED_MOST];
    memset(constants, 0, sizeof constants);
    for (int d = 0; d < count->delayed; d++) {
        for (int e = 0; e < count->received; e++)
            if (count->received_row[e] == count->delayed_row[d])
                constants[d] = *constant_at(f, constant, kt_front_delayed(f, e));
        for (int i = step->loop; i < step->loop + step->loop_count; i++) {
            const int32_t index = f->model->front_loop[i];
            const kt_loop_record *loop = &f->model->loop[index];
            const int32_t *slot = f->model->slot + loop->slot;
            for (int r = 0; r < loop->row_count; r++)
                if (slot[r] == count->delayed_row[d])
                    constants[d] = constant_of(f, constant, step, index, slot[r]);
        }
    }
    for (int d = 0; d < count->received; d++)
        kt_front_release(f, kt_front_delayed(f, d));
    for (int d = 0; d < count->delayed; d++) {
        *constant_at(f, constant, kt_front_delayed(f, d)) = constants[d];
        kt_front_enter(f, kt_front_delayed(f, d));
    }
}

/* Adds T y to t for the slots in use: `rows` has `rank` numbers for each of their vectors. */
KT_INLINE void add_y(const kt_front *f, KT_COLUMN *constant, const double *rows, int rank, const KT_COLUMN *y) {
    for (int32_t l = 0; l < f->active_count; l++) {
        KT_COLUMN *t = constant_at(f, constant, f->active[l]);
        for (int c = 0; c < kt_front_vector_count(f, f->active[l]); c++, rows += rank)
            for (int j = 0; j < rank; j++)
                t[c] += rows[j] * y[j];
    }
}
