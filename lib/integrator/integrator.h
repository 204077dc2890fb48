/* What the files of this folder share.
 *
 *     table_*.c   the coefficients, a const struct a method
 *     method.c    the list of methods
 *     order.c     rooted trees and order conditions
 *     place.c     layout in the caller's memory, start, checkpoints
 *     stages.c    one try: slopes, new state, error estimate
 *     control.c   the step size
 *     step.c      one accepted step
 *     dense.c     values within it
 *     chebyshev.c the family of a stabilised method: coefficients, how far it is stable
 *     stabilise.c a try with it
 *     radius.c    the spectral radius that says how many stages that needs
 *     stability.c linear stability of all of them
 */
#ifndef KT_INTEGRATOR_INTEGRATOR_H
#define KT_INTEGRATOR_INTEGRATOR_H

#include "kinetree/integrator.h"

/* ---- methods ----------------------------------------------------------------------------------------------------- */

/* One line a method, in rising order. */
#define KT_METHOD_LIST(X)                                                                                              \
    X(euler)                                                                                                           \
    X(midpoint)                                                                                                        \
    X(heun)                                                                                                            \
    X(ralston)                                                                                                         \
    X(rkc2)                                                                                                            \
    X(kutta3)                                                                                                          \
    X(bs32)                                                                                                            \
    X(rk4)                                                                                                             \
    X(rk38)                                                                                                            \
    X(rkc4)                                                                                                            \
    X(dopri5)                                                                                                          \
    X(tsit5)                                                                                                           \
    X(dop853)

#define KT_METHOD_EXTERN(name) extern const kt_method kt_method_##name;
KT_METHOD_LIST(KT_METHOD_EXTERN)
#undef KT_METHOD_EXTERN

/* Whether the struct is one of the list, which tests have checked. */
bool kt_method_is_built_in(const kt_method *method);

/* Checks the sizes and that no array is missing: what kt_integrator_size needs to know before it reads anything. */
kt_status kt_method_check_sizes(const kt_method *method, kt_error *error);

/* For tests: rooted trees, and so order conditions, of 1 <= nodes <= KT_METHOD_ORDER_MAX nodes. */
int kt_tree_count(int nodes);

/* Slots of slopes: the stages, f(t1, y1) (the last stage where fsal is set), the stages of the dense output. */
static inline int kt_method_fresh(const kt_method *method) { return method->stages - (method->fsal ? 1 : 0); }
static inline int kt_method_slots(const kt_method *method) {
    return kt_method_fresh(method) + 1 + method->dense_stages;
}

/* ---- integrator -------------------------------------------------------------------------------------------------- */

/* weight * k_slot */
typedef struct kt_stage_term {
    double weight;
    size_t slot;
} kt_stage_term;

/* Rows of the compiled table, zeros left out: the stages, then these, then the stages of the dense output. */
enum { KT_ROW_B, KT_ROW_E, KT_ROW_E_LOW, KT_ROW_DENSE };

enum { KT_RADIUS_VECTORS = 8 }; /* directions in which f is differenced for its spectral radius, at most */

typedef struct kt_integrator_sizes {
    size_t n;      /* equations */
    size_t stride; /* doubles from one slope to the next */
    size_t slots, rows, terms;
    size_t moved, krylov; /* for a stabilised method, else 0 */
} kt_integrator_sizes;

/* Every array: type, name, count, what becomes of it between calls, meaning. One list declares, measures, places and
 * poisons. SCRATCH holds what is written before it is read, or can be computed again. */
#define KT_INTEGRATOR_FIELDS(X)                                                                                        \
    X(kt_stage_term, terms, s->terms, KEPT, "the table without its zeros")                                             \
    X(size_t, row, s->rows + 1, KEPT, "first term of each row")                                                        \
    X(double *, k, s->slots, KEPT, "slope in each slot")                                                               \
    X(double, y, s->n, KEPT, "state at t")                                                                             \
    X(double, previous_y, s->n, KEPT, "state at previous_t")                                                           \
    X(double, trial, s->n, SCRATCH, "states of the stages; state at the end of the try")                               \
    X(double, moved, s->moved, SCRATCH, "stabilised: two stages less y")                                               \
    X(double, krylov, s->krylov, SCRATCH, "stabilised: directions")                                                    \
    X(double, slopes, s->slots * s->stride, SCRATCH, "the slopes")

struct kt_integrator {
    const kt_method *method;
    kt_integrator_options options;
    kt_integrator_callbacks callbacks;
    kt_integrator_memory memory;
    kt_integrator_sizes sizes;
    double error_order;        /* err ~ h^error_order */
    size_t counted;            /* equations that the error norms run over: all but the quadratures, which come last */
    size_t fresh;              /* slot of f at the end of a step */
    bool gives_end_derivative; /* a try leaves f(t1, y1) in slot `fresh` */
    bool started;
    /* What is known of the slopes. A try needs f(t, y) in slot 0; the dense output of the last step needs it in slot
     * `fresh`, beside the stages of that step. The two uses take turns and swap pointers. */
    bool stages_known;     /* the slots hold the stages of the last step, as far as its dense output needs them */
    bool dense_known;      /* and the stages of the dense output */
    int derivative_slot;   /* where f(t, y) is: 0, fresh, or -1 where it is not known */
    double radius;         /* stabilised: the spectral radius that the tries of this step count on */
    bool radius_is_of_now; /* and it was estimated at this step's beginning */
#define KT_INTEGRATOR_DECLARE(type, name, count, kind, meaning) type *name;
    KT_INTEGRATOR_FIELDS(KT_INTEGRATOR_DECLARE)
#undef KT_INTEGRATOR_DECLARE
};

/* For tests: fills all that is scratch with a byte, and forgets what was known of it. No bit of what follows changes.
 */
void kt_integrator_poison(kt_integrator *it, unsigned char byte);

/* ---- tries ------------------------------------------------------------------------------------------------------- */

typedef enum kt_try_result {
    KT_TRY_PASSED = 0,
    KT_TRY_RECOVERABLE, /* a callback returned > 0 */
    KT_TRY_NOT_FINITE,
    KT_TRY_INACCURATE,
    KT_TRY_UNSTABLE, /* more stages would be needed than there are */
    KT_TRY_STOPPED   /* a callback returned < 0 */
} kt_try_result;

/* What became of a try, and where. */
typedef struct kt_try {
    kt_try_result result;
    const char *what; /* "the right-hand side", "the new state" ... */
    double t;
    int code;         /* of the callback */
    size_t component; /* that is not finite */
    double error;     /* weighted norm, of an adaptive step */
    double radius;    /* KT_TRY_UNSTABLE: the rate of decay, 1/s, ... */
    double reach;     /* ... and the step that the most stages allow */
} kt_try;

/* From (t, y) over h to `end`, which is t + h up to rounding: stages with c = 1 are evaluated at `end` itself. */
typedef struct kt_interval {
    double t, h, end;
    const double *y;
} kt_interval;

/* out = y + h sum_j weight_j k_j over one row, n values, summed in the order of the row. */
void kt_combine(double *out, const double *y, double h, const kt_stage_term *terms, size_t count, double *const *k,
                size_t n);

/* The first value that is not finite; n if all are. */
size_t kt_first_not_finite(const double *values, size_t n);

/* k[slot] = f(t, y), counted and checked. */
kt_try_result kt_evaluate(kt_integrator *it, double t, const double *y, size_t slot, kt_try *result);

/* Stages first .. last - 1 of the table into their slots, of an interval. */
kt_try_result kt_evaluate_stages(kt_integrator *it, const kt_interval *interval, size_t first, size_t last,
                                 kt_try *result);

/* Slot 0 holds f(t, y): all other slopes and `trial`; if adaptive, result->error. */
kt_try_result kt_try_step(kt_integrator *it, const kt_interval *interval, kt_try *result);

/* Of a stabilised method: all slopes that are kept, and `trial`, without the norm of the error (stabilise.c). */
kt_try_result kt_stabilised_stages(kt_integrator *it, const kt_interval *interval, kt_try *result);

/* Its error estimate, weighted; y1 in `trial`, f(t1, y1) in slot `fresh`. */
double kt_stabilised_error(const kt_integrator *it, double h);

/* Stages are chosen for this times the spectral radius that was estimated. */
#define KT_RADIUS_MARGIN 1.2

/* Before a step with a stabilised method: `radius`, estimated anew where the memory's is too old or `again`. */
kt_try_result kt_need_radius(kt_integrator *it, bool again, kt_try *result);

/* The longest step for which the method has stages enough; HUGE_VAL for one that is not stabilised. */
double kt_stabilised_reach(const kt_integrator *it);

/* absolute_i + relative max(|y0|, |y1|) */
double kt_error_scale(const kt_integrator *it, size_t i, double y0, double y1);

/* sqrt(mean((u_i - v_i) / scale_i)^2)) with the scale of the current state; v may be NULL: 0. */
double kt_scaled_norm(const kt_integrator *it, const double *u, const double *v);

/* A try that failed, as an error: code, where, words. */
kt_status kt_try_report(const kt_try *result, const char *advice, kt_error *error);

/* ---- step size --------------------------------------------------------------------------------------------------- */

/* x^p for finite x > 0 and |p| <= 2, to about 1e-12, by arithmetic alone: the same bits everywhere, which no libm
 * promises. */
double kt_power(double x, double p);

/* h_new / h after an accepted step; after a rejected one. */
double kt_control_accepted(const kt_integrator *it, double error);
double kt_control_rejected(const kt_integrator *it, double error);

/* Proposal for the first step, in a direction (+-1), after HNW II.4; f is asked for within `limit`. Slot 0 holds f(t,
 * y). 0 where a callback stopped. */
double kt_control_initial(kt_integrator *it, double direction, double limit, kt_try *result);

/* Control's err_last, before there is one and as the least that is remembered (Hairer's DOPRI5). */
#define KT_CONTROL_ERROR_FLOOR 1e-4

#endif
