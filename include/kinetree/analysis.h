/* Studies of a mechanism: what other coordinate sets make of it.
 *
 * No call allocates but _create.
 */
#ifndef KINETREE_ANALYSIS_H
#define KINETREE_ANALYSIS_H

#include "kinetree/simulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- other coordinate sets, for comparison ----------------------------------------------------------------------- */

/* Ways to keep loops closed that do not reduce coordinates: right-hand sides for kt_simulation_options, with dense
 * algebra in tree coordinates. They are here to be compared with the reduction, which does the same faster and loses
 * less. With M a = f + A' lambda (f = tau - h of the tree, effects included), phi(u, t) = 0, A v = b', A a = b'':
 *
 *   gauss       a least in (a - M^-1 f)' M (a - M^-1 f) with A a = b'' [MSD 4.22, 4.29]; loops drift open
 *   baumgarte   the same with A a = b'' - 2 alpha (A v - b') - beta^2 phi [MSD 8.38]
 *   augmented   (M + A' s A) a = f + A' s (b'' - 2 alpha (A v - b') - beta^2 phi) - A' lambda*, lambda* iterated
 *               [MSD 9.6; Bayo, Garcia de Jalon, Serna 1988]
 *   projection  u' = w - A^+ (A w - b'), w' as gauss at u', positions put back after each step [MSD 9.11, 9.17]; what a
 *               simulation calls velocities is w
 *
 * id, name */
#define KT_SET_LIST(X)                                                                                                 \
    X(KT_SET_GAUSS, gauss)                                                                                             \
    X(KT_SET_BAUMGARTE, baumgarte)                                                                                     \
    X(KT_SET_AUGMENTED, augmented)                                                                                     \
    X(KT_SET_PROJECTION, projection)

typedef enum kt_set_type {
#define KT_SET_ENUM(id, name) id,
    KT_SET_LIST(KT_SET_ENUM)
#undef KT_SET_ENUM
        KT_SET_TYPE_COUNT
} kt_set_type;

/* "gauss"; NULL for a value that is none. */
KT_API const char *kt_set_type_name(kt_set_type type);

typedef struct kt_set_options {
    kt_set_type type;

    /* Baumgarte, augmented, 1/s: closure errors obey phi'' + 2 alpha phi' + beta^2 phi = 0, rolling and its like
     * psi' + 2 alpha psi = 0. These are eigenvalues of the equations that an explicit method must be stable for: with
     * alpha = beta, the double one -alpha (and -2 alpha for rolling) asks for steps below 2 / alpha with euler, heun or
     * midpoint, 2.78 / alpha with rk4, 3.3 / alpha with dopri5, whatever the tolerance. */
    double alpha, beta;

    /* Augmented: s = penalty / (smallest independent eigenvalue of A M^-1 A' in the state where the set is placed), so
     * that an iteration divides the equations' residual by 1 + penalty there; rounding grows with penalty, too. */
    double penalty;
    int iterations;   /* augmented: at most */
    double tolerance; /* augmented: the last change of the forces against the forces, where the iteration ends; and
                         where it no longer gets less */

    /* Directions of the equations that are smaller than this fraction of the largest count as dependent, and so do
     * those beyond the rank that the loops have at generic positions (kt_model_freedom), unless `uncapped`: then
     * whatever looks independent is trusted, as textbooks have it. Not read by the augmented set, which decides no
     * rank. */
    double rank_tolerance;
    bool uncapped;
} kt_set_options;

/* For steps of this length (adaptive: the longest that is expected), s, > 0: alpha = beta = 0.1 / step, penalty 1e4, 12
 * iterations, tolerances 1e-11 and 1e-12. On the bundled linkages, alpha = 1 / step made rk4's errors 3 to 100 times
 * larger (the stabilising forces disturb the motion) and dopri5's evaluations 5 to 17 times as many. */
KT_API kt_set_options kt_set_options_default(kt_set_type type, double step);

typedef struct kt_set kt_set;

/* Bytes that a set takes. */
KT_API size_t kt_set_size(const kt_model *model);

/* Lays a set out in the caller's memory (KT_ALIGNMENT). The model must outlive it; for simulations in the absolute
 * formulation it is kt_model_absolute of theirs. A set is scratch and belongs to one thread at a time. data are scratch
 * of this model.
 * Errors: KT_ERROR_ARGUMENT (an option), KT_ERROR_MEMORY, KT_ERROR_CONSTRAINT (the initial state cannot be assembled),
 * KT_ERROR_SINGULAR where a tree coordinate has no inertia: reduction asks for inertia only along what loops leave
 * free, these sets along every coordinate. */
KT_API KT_CHECKED kt_status kt_set_place(const kt_model *model, kt_data *data, const kt_set_options *options,
                                         void *memory, size_t size, kt_set **set, kt_error *error);
/* The same in memory of its own, released with kt_set_free. */
KT_API KT_CHECKED kt_status kt_set_create(const kt_model *model, const kt_set_options *options, kt_set **set,
                                          kt_error *error);
KT_API void kt_set_free(kt_set *set);

/* Accelerations a (nv) as kt_acceleration_evaluate has them, by this set; rate (nv; may be NULL) is the velocity that
 * positions follow: v but for force projection. Errors: KT_ERROR_SINGULAR, KT_ERROR_NOT_FINITE. O(nv^3 + nv^2
 * equations). */
KT_API KT_CHECKED kt_status kt_set_evaluate(kt_set *set, kt_data *data, double t, const double *q, const double *v,
                                            const double *tau, const kt_wrench *external, double *rate, double *a,
                                            kt_error *error);

/* Makes simulations with these options use the set, which must outlive them: one simulation at a time. */
KT_API void kt_set_use(kt_set *set, kt_simulation_options *options);

/* What a set has met since it was placed or reset. */
typedef struct kt_set_findings {
    uint64_t evaluations;
    double least, least_time; /* the last independent direction of the equations, smallest against largest seen; when.
                                 1 for the augmented set, which does not know */
    uint64_t dropped;         /* evaluations where the rank fell below that of generic positions */
    uint64_t trusted;         /* uncapped: evaluations where it exceeded it */
    double open, open_time;   /* the largest |phi|, m or rad; when */
    int iterations;           /* augmented: the most */
    double residual;          /* augmented: the largest |A a - c| left, against its terms */
} kt_set_findings;

KT_API kt_set_findings kt_set_findings_get(const kt_set *set);
KT_API void kt_set_reset(kt_set *set);

/* Whether what the set has met lets its results be believed: KT_OK, or KT_ERROR_CONSTRAINT (loops came apart, redundant
 * equations were trusted) or KT_ERROR_SINGULAR (a singular position was passed, which this set has no means to cross),
 * in words. */
KT_API KT_CHECKED kt_status kt_set_verdict(const kt_set *set, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
