/* The fastest mode at the states of a run, by the power method without a matrix.
 *
 * Small motions x = (dq, dv) obey x' = J x with J x = (dv, a(q (+) dq, v + dv) - a(q, v)). At each state a direction is
 * multiplied by J twice, and |J^2 x| / |x| is the estimate of |lambda|^2. For an undamped mode J^2 is -omega^2 on both
 * halves of x, whereas J alone maps one half to the other. Lengths and angles are scaled by the coordinates' units.
 * Velocities are scaled by these times the previous rate. Both halves of the fastest mode then have the same weight.
 *
 * The direction is carried from state to state, and a small vector with a part in every mode is added each time. One
 * iteration per state therefore follows a mode that changes slowly. The iteration also detects new stiffness, such as a
 * foot that has come to the ground. The iteration is repeated until convergence only if a rate is new or has grown.
 * Estimates are usually too low.
 *
 * The term of the rotating body axes (dq' = dv - omega x dq) is left out, and loops are not projected. The equations
 * satisfy A a = b'' off the manifold, too, which only adds zero eigenvalues to J.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/elementary.h"
#include "analysis/analysis.h"
#include "base/arena.h"
#include "evaluate/evaluate.h"
#include "kinetree/joint.h"

#include <math.h>
#include <string.h>

enum { ITERATIONS = 8 };

#define SMALL 1e-7   /* of a unit: step of the velocities */
#define MIXED 0.3    /* of the direction: size of the added vector */
#define SETTLED 0.02 /* relative change of the rate in the last iteration */
#define GROWN 1.05   /* times the largest rate so far: the iteration is repeated */

/* Every array: type, name, count, meaning. */
#define KT_MODE_WATCH_FIELDS(X)                                                                                        \
    X(double, unit, nv, "1 rad, or a length of the mechanism")                                                         \
    X(double, direction, 2 * nv, "dq and dv over their units, of length 1")                                            \
    X(double, image, 2 * nv, "J times the direction")                                                                  \
    X(double, step, nv, "dq")                                                                                          \
    X(double, moved_q, nq, "q (+) dq")                                                                                 \
    X(double, moved_v, nv, "v + dv")                                                                                   \
    X(double, a, nv, "acceleration at the state")                                                                      \
    X(double, moved_a, nv, "at the neighbouring state")                                                                \
    X(double, fast_q, nq, "where the mode was fastest")                                                                \
    X(double, fast_v, nv, "there")                                                                                     \
    X(char, data_memory, kt_data_size(model), "scratch")

struct kt_mode_watch {
    void *owned; /* memory of kt_mode_watch_create, or NULL */
    const kt_model *model;
    kt_data *data;
    size_t nq, nv;
    double scale;      /* 1/s, scale of velocities over positions: the last rate */
    double time, rate; /* time and rate of the fastest mode */
    uint64_t states, evaluations;
    KT_ARENA_DECLARE(KT_MODE_WATCH_FIELDS)
};

/* ---- one state --------------------------------------------------------------------------------------------------- */

/* Adds fractional parts of multiples of the golden ratio. The numbers form a vector with a part in every mode,
 * different at each state and the same in every run. */
static void mix_direction(kt_mode_watch *w) {
    const size_t n = 2 * w->nv;
    const double part = w->states == 0 ? 1.0 : MIXED / sqrt((double)n);
    for (size_t i = 0; i < n; i++) {
        const double x = 0.61803398874989485 * (double)(i + 1 + (n + 1) * (w->states % 4096));
        w->direction[i] += part * 2.0 * sqrt(3.0) * (x - floor(x) - 0.5);
    }
    const double length = kt_norm(w->direction, n);
    for (size_t i = 0; i < n; i++)
        w->direction[i] /= length;
}

/* direction <- J direction / |J direction|; returns this length, or 0 where the acceleration cannot be computed. */
static double multiply_direction(kt_mode_watch *w, double t, const double *q, const double *v) {
    const size_t nv = w->nv;
    const double *position = w->direction, *velocity = w->direction + nv;
    double *rate = w->image, *change = w->image + nv;
    const double size = SMALL / fmax(1.0, w->scale); /* step of dq; that of dv is SMALL at most */
    for (size_t i = 0; i < nv; i++) {
        w->step[i] = size * w->unit[i] * position[i];
        w->moved_v[i] = v[i] + size * w->unit[i] * w->scale * velocity[i];
    }
    kt_position_add(w->model, q, w->step, w->moved_q);
    w->evaluations++;
    if (kt_acceleration_evaluate(w->model, w->data, t, w->moved_q, w->moved_v, NULL, NULL, w->moved_a, NULL) != KT_OK)
        return 0.0;
    for (size_t i = 0; i < nv; i++) {
        rate[i] = w->scale * velocity[i];
        change[i] = (w->moved_a[i] - w->a[i]) / (size * w->unit[i] * w->scale);
    }
    const double length = kt_norm(w->image, 2 * nv);
    if (!(length > 0.0) || !isfinite(length))
        return 0.0;
    for (size_t i = 0; i < 2 * nv; i++)
        w->direction[i] = w->image[i] / length;
    return length;
}

/* Scales velocities by the new rate from now on. */
static void rescale(kt_mode_watch *w, double rate) {
    for (size_t i = w->nv; i < 2 * w->nv; i++)
        w->direction[i] *= w->scale / rate;
    w->scale = rate;
    const double length = kt_norm(w->direction, 2 * w->nv);
    for (size_t i = 0; i < 2 * w->nv; i++)
        w->direction[i] /= length;
}

void kt_mode_watch_add(kt_mode_watch *w, double t, const double *q, const double *v) {
    if (!w || (!q && w->nq > 0))
        return;
    double rate = 0.0;
    v = v ? v : w->model->zero;
    w->evaluations++;
    if (w->nv == 0 || kt_acceleration_evaluate(w->model, w->data, t, q, v, NULL, NULL, w->a, NULL) != KT_OK)
        return;
    mix_direction(w);
    w->states++;
    for (int k = 0; k < ITERATIONS; k++) {
        const double first = multiply_direction(w, t, q, v),
                     second = first > 0.0 ? multiply_direction(w, t, q, v) : 0.0;
        const double last = rate;
        if (!(second > 0.0))
            break;
        rate = sqrt(first * second);
        rescale(w, rate);
        if (!(rate > GROWN * w->rate) || fabs(rate - last) <= SETTLED * rate)
            break;
    }
    if (!(rate > w->rate))
        return;
    w->rate = rate;
    w->time = t;
    memcpy(w->fast_q, q, w->nq * sizeof *q);
    memcpy(w->fast_v, v, w->nv * sizeof *v);
}

kt_fast_state kt_mode_watch_fastest(const kt_mode_watch *w) {
    if (!w)
        return (kt_fast_state){.t = (double)NAN};
    return (kt_fast_state){w->time, w->rate, w->fast_q, w->fast_v};
}

uint64_t kt_mode_watch_evaluations(const kt_mode_watch *w) { return w ? w->evaluations : 0; }

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* The numbers that later estimates depend on: name, count. One list measures, writes and reads. */
#define KT_MODE_WATCH_STATE(X)                                                                                         \
    X(&w->scale, 1)                                                                                                    \
    X(&w->time, 1)                                                                                                     \
    X(&w->rate, 1)                                                                                                     \
    X(&w->states, 1)                                                                                                   \
    X(&w->evaluations, 1)                                                                                              \
    X(w->direction, 2 * w->nv)                                                                                         \
    X(w->fast_q, w->nq)                                                                                                \
    X(w->fast_v, w->nv)

size_t kt_mode_watch_state_size(const kt_mode_watch *w) {
    size_t count = 0;
    if (!w)
        return 0;
#define KT_MODE_WATCH_COUNT(part, numbers) count += (numbers);
    KT_MODE_WATCH_STATE(KT_MODE_WATCH_COUNT)
#undef KT_MODE_WATCH_COUNT
    return count * sizeof(double);
}

void kt_mode_watch_save(const kt_mode_watch *w, void *block) {
    double *to = block;
    if (!w || !block)
        return;
#define KT_MODE_WATCH_SAVE(part, numbers)                                                                              \
    memcpy(to, part, (numbers) * sizeof *to);                                                                          \
    to += (numbers);
    KT_MODE_WATCH_STATE(KT_MODE_WATCH_SAVE)
#undef KT_MODE_WATCH_SAVE
}

void kt_mode_watch_restore(kt_mode_watch *w, const void *block) {
    const double *from = block;
    if (!w || !block)
        return;
#define KT_MODE_WATCH_RESTORE(part, numbers)                                                                           \
    memcpy(part, from, (numbers) * sizeof *from);                                                                      \
    from += (numbers);
    KT_MODE_WATCH_STATE(KT_MODE_WATCH_RESTORE)
#undef KT_MODE_WATCH_RESTORE
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_mode_watch, KT_MODE_WATCH_FIELDS, const kt_model *model, size_t nq, size_t nv)

size_t kt_mode_watch_size(const kt_model *model) {
    return model ? lay_out(NULL, model, (size_t)kt_model_nq(model), (size_t)kt_model_nv(model)) : 0;
}

kt_status kt_mode_watch_init(const kt_model *model, void *memory, size_t size, kt_mode_watch **watch, kt_error *error) {
    if (KT_IS_MISSING(error, model, watch))
        return KT_ERROR_ARGUMENT;
    kt_status status = KT_OK;
    if (!kt_auxiliary_states_are_idle(model))
        status = kt_auxiliary_states_reject(model, "kt_mode_watch_init",
                                            "the frequencies that are watched would be those without them", error);
    if (status == KT_OK)
        status = kt_massless_reject(model, "kt_mode_watch_init", "its accelerations have no derivatives", error);
    if (status != KT_OK)
        return status;
    status = kt_arena_begin("kt_mode_watch_init", "kt_mode_watch_size", memory, size, kt_mode_watch_size(model), error);
    if (status != KT_OK)
        return status;
    kt_mode_watch *w = memory;
    w->model = model;
    w->nq = (size_t)kt_model_nq(model);
    w->nv = (size_t)kt_model_nv(model);
    w->scale = 1.0;
    (void)lay_out(memory, model, w->nq, w->nv);
    kt_model_units(model, w->unit);
    status = kt_data_init_followed(model, w->data_memory, kt_data_size(model), &w->data, error);
    if (status == KT_OK) /* GCOVR_EXCL_BR_LINE: its memory has the layout that it requires */
        *watch = w;
    return status;
}

kt_status kt_mode_watch_create(const kt_model *model, kt_mode_watch **watch, kt_error *error) {
    if (KT_IS_MISSING(error, model, watch))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_mode_watch_size(model);
    void *memory = kt_arena_allocate(size, "a watch on modes", error);
    return memory == NULL ? KT_ERROR_MEMORY
                          : kt_arena_own(memory, kt_mode_watch_init(model, memory, size, watch, error));
}

void kt_mode_watch_free(kt_mode_watch *watch) { kt_arena_free(watch); }
