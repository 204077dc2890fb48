/* The problem of hard contacts that slip (slip.c), and their responses to forces in range space (slip_response.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EVALUATE_SLIP_H
#define KT_EVALUATE_SLIP_H

#include "base/arena.h"
#include "cone/coulomb.h"
#include "evaluate/evaluate.h"
#include "reduction/half_columns.h"

#include <math.h>

/* The rate below which friction has come to rest, as a part of the rate at which the mechanism moves by its own size
 * (contact/own_time.c), or of the speeds of the motion. */
static const double kt_slip_rest = 1e-9;

/* Directions of slip and normal forces of n contacts. Slow slip has rows of each: N, in `unit`, and (s + tau s') / tau
 * along both axes. Contacts of different islands (kt_group.island) do not act on each other. Therefore the islands are
 * solved one after the other, and arrays have room for `most` contacts, the number in the largest island. */
#define SLIP_FIELDS(X)                                                                                                 \
    X(kt_slip_contact, contact, n, "the contacts")                                                                     \
    X(int, order, n, "their indices, island by island")                                                                \
    X(kt_slip_island, island, n, "islands with contacts that slip")                                                    \
    X(int, place, count->group, "scratch: of the contacts of an island in this order")                                 \
    X(int, responded, n, "the contacts in the order of their responses, island by island")                             \
    X(int, coupled, most, "scratch: contacts of an island by blocks of W (kt_coulomb_list_blocks)")                    \
    X(int, end, most, "of each of these blocks")                                                                       \
    X(double, column, kt_half_response_count(count->island_v, 2 * most), "of unit forces: half columns in each group") \
    X(kt_half_force, force, 2 * most, "units of force along each axis of each contact")                                \
    X(double, unit_force, 2 * most * count->v, "joint forces of these")                                                \
    X(double, factor, 2 * most, "of these: friction")                                                                  \
    X(double, change, 2 * most * count->island_row, "of the multipliers of each group, due to these")                  \
    X(double, by_normal, 2 * most * most, "of normal forces, due to these")                                            \
    X(double, by_rate, 4 * most * most, "of J a, due to these")                                                        \
    X(double, normal, most, "normal forces")                                                                           \
    X(double, W, 9 * n * most, "of slow slip: responses of each island")                                               \
    X(double, N0, n, "normal forces without friction")                                                                 \
    X(double, N, n, "likewise under a unit of force")                                                                  \
    X(double, rate0, 2 * n, "J a without friction")                                                                    \
    X(double, rate, 2 * n, "likewise under a unit of force")                                                           \
    X(double, drift, 2 * n, "the part of s' that is not due to accelerations")                                         \
    X(double, tau, n, "of each contact, s")                                                                            \
    X(bool, predicted, n, "whether the direction of each contact is that of slow slip")                                \
    X(double, slowing, n, "the deceleration of slip in its present direction, m/s^2")                                  \
    X(bool, fades, n, "whether slip of each contact does not grow (slip_prediction.c)")                                \
    X(double, by_slip, 6 * most * most, "derivatives of the forces by slip velocities")                                \
    X(int, pivot, 3 * most, "scratch: of these, and of normal forces")

/* Arrays of slow slip alone. The solution covers all contacts, in `order`. */
#define SLIP_SLOW_FIELDS(X)                                                                                            \
    X(char, matrices, kt_coulomb_matrices_size(3 * most, most), "of the problem and its solver")                       \
    X(char, problem, kt_coulomb_size(most, 3 * most), "the problem")                                                   \
    X(char, solution, kt_coulomb_solution_size(n, 3 * n), "its solution")                                              \
    X(char, trial, kt_coulomb_solution_size(most, 3 * most), "likewise, with a contact that is held")                  \
    X(char, solver, kt_coulomb_solver_size(most, 3 * most, most), "its solver")

/* A contact that slips, and its friction. */
typedef struct kt_slip_contact {
    const kt_loop_record *loop;
    const kt_effect_record *effect;
} kt_slip_contact;

/* The contacts of an island that slip, or of a block of its W. */
typedef struct kt_slip_island {
    int32_t index;   /* kt_group.island */
    size_t first, n; /* in `order` */
    bool is_slow;    /* some slip is slow: */
    double unit;
} kt_slip_island;

typedef struct kt_slip_problem {
    bool responds;     /* responses to unit forces are known: */
    bool is_known;     /* the last evaluation with normal forces left what responses follow from */
    bool has_friction; /* the last accelerations contain friction: */
    kt_status status;  /* status of the evaluation of normal forces, */
    double t;          /* at this time, */
    kt_error *error;   /* with this error */
    bool found;        /* all directions of slow slip are found */
    bool wide;         /* predictions have the length of fixed steps (slip_prediction.c) */
    double slow_time;  /* an input of simulations: tau0 of adaptive steps, s */
    size_t wedged;     /* the contact that friction wedged last; n: none. Simulations clear it */
    size_t per;        /* directions of each contact: one, along e, or two, along both axes */
    size_t islands;
    bool is_sorted;       /* the contacts of an island are sorted by blocks of W */
    kt_slip_island *at;   /* the present one, of the arrays with room for `most` contacts */
    kt_slip_island block; /* a block of its W; `at` may point to the block */
    double *W_at;         /* the present part of W, */
    size_t stride;        /* with so many numbers in a row */
    kt_coulomb *c;
    kt_coulomb_solution *all, *held;
    kt_coulomb_solution to;      /* the present part of `all` */
    const kt_loop_record *loops; /* loops of the model whose contacts are in `contact`, */
    const kt_effect_record *effects;
    uint64_t slips; /* kt_model.slips of that model */
    KT_ARENA_DECLARE(SLIP_FIELDS)
    KT_ARENA_DECLARE(SLIP_SLOW_FIELDS)
} kt_slip_problem;

static inline kt_slip_problem *kt_slip_problem_of(const kt_data *data) {
    return (kt_slip_problem *)(void *)data->slip_work;
}

/* The index of contact i of the present island. */
static inline size_t kt_slip_index(const kt_slip_problem *p, size_t i) { return (size_t)p->order[p->at->first + i]; }

/* The slip velocity that counts as zero, as a part of s0, unless rounding of the time is larger. The least s0 and tau0
 * of adaptive steps, as parts of the speed and time of a motion of the mechanism by its size (slip_prediction.c). */
static const double kt_slip_still = 2.5e-9, kt_slip_slow = 1.2e-6;

/* tau of fixed steps for slip of this speed, which slows down at the rate `slowing`, m/s^2, and would slow down at the
 * rate `most` by friction alone (slip_prediction.c). tau is 0 if slip does not slow down. */
static inline double kt_slip_fading_time(double largest, double speed, double slowing, double most) {
    const double part = fmin(1.0, 9.0 - 10.0 * slowing / most);
    return slowing > 0.0 && part > 0.0 ? fmin(largest, 0.5 * part * speed / slowing) : 0.0;
}

/* Whether slip is too fast for a prediction: tau is 0 (slip_prediction.c). */
static inline bool kt_slip_is_fast(const kt_data *data, size_t k) {
    const double *s = data->slip_velocity + 2 * k, wide = data->slip_slow[2 * k + 1];
    const double most = wide > data->slow_slip ? wide : data->slow_slip;
    return fabs(s[0]) >= most || fabs(s[1]) >= most;
}

/* kt_slip_size returns the size of a problem. kt_slip_init lays it out in new data, and finds its contacts and
 * islands. kt_slip_begin begins an evaluation. If the model's contacts have changed, kt_slip_begin finds contacts and
 * islands again. kt_slip_begin_slow prepares the solution of slow slip. kt_slip_select selects an island
 * (slip_islands.c). */
size_t kt_slip_size(const kt_counts *n);
void kt_slip_init(const kt_model *model, kt_data *data);
void kt_slip_begin(const kt_model *model, kt_data *data);
void kt_slip_begin_slow(const kt_model *model, kt_slip_problem *p);
void kt_slip_select(const kt_model *model, kt_slip_problem *p, kt_slip_island *island);
/* Sorts the contacts of the present island, whose W is known, by blocks of W. Returns the number of blocks. Selects a
 * block of an island that is sorted. */
int kt_slip_sort_blocks(const kt_data *data, kt_slip_problem *p);
void kt_slip_select_block(const kt_model *model, kt_slip_problem *p, kt_slip_island *island, int block);

/* The largest speed of a joint, m/s, whose turn moves points by up to the mechanism's length. */
double kt_largest_speed(const kt_model *model, const double *v);

/* Evaluates kt_acceleration_evaluate for a model in which hard contacts slip, without effects (slip.c). */
kt_forward_call kt_slip_forward;
/* Adds one such contact to a model that is being compiled. */
void kt_slip_add(kt_model *model);
/* Turns a direction in data->slip to the present slip, in the state q, v, if slip that is faster than `least`, m/s, has
 * turned away from the direction. Returns whether any direction turned. */
bool kt_slip_follow(const kt_model *model, kt_data *data, const double *q, const double *v, double least);
/* Adds the derivative of the directions of friction by velocities to a matrix of damping, Z'C (slip_damping.c). Z has
 * `free` columns of nv numbers; NULL: Z = 1. a: scratch (nv). */
KT_CHECKED kt_status kt_slip_add_damping(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                         const double *basis, size_t free, double *a, double *damping, kt_error *error);
/* Finds slip velocities of all contacts, and where their friction acts: data->slip_velocity and slip_frame. In a model
 * without planar links, the poses and velocities are those with which the next accelerations begin (kt_data.posed). */
void kt_slip_find_frames(const kt_model *model, kt_data *data, const kt_dynamic_state *at);
/* Slip velocities of all contacts in the state q, v. */
void kt_slip_find_rates(const kt_model *model, kt_data *data, const double *q, const double *v, double *s);
/* Returns tau of slip that grows, or 0 if the contact is not slow or has not begun to slip in a direction that is set.
 * *grows: by which factor the part of (s + tau s') / tau along s grows faster than s (slip_prediction.c). */
double kt_slip_prediction_time(const kt_data *data, size_t k, double *grows);
/* Slip up to this, m/s, keeps the direction in which it began (slip.c): rounding, and with fixed steps slip that
 * friction changes within a small part of a step. */
double kt_slip_still_speed(const kt_data *data, size_t k);
/* Whether slip that a fixed step does not resolve has turned from its direction by more than this speed. */
bool kt_slip_lags(const kt_data *data, size_t k);
/* Returns tau of slip of this speed that has these tau0 and s0. */
double kt_slip_time_at_speed(double speed, double tau0, double s0);

/* The friction of an item in excess of the force that holds it, in these forces p of all rows. */
double kt_slip_excess(const kt_coulomb_item *item, const double *p);
/* Slow slip of a contact, as far as its prediction depends on it. */
typedef struct kt_slip_fate {
    double speed, slowing; /* m/s; its deceleration in the present direction, m/s^2 */
    double largest;        /* tau without limits, s */
    double adaptive;       /* the same with adaptive steps */
    double friction; /* the rate at which friction changes slip, m/s^2, if fixed steps do not resolve this; HUGE_VAL:
                              they do */
} kt_slip_fate;
/* Returns tau of slip of item i. Friction `holds` all slow slip, of so many contacts, with the forces `held`; or this
 * slip `fades`. */
double kt_slip_limited_time(const kt_coulomb *c, int i, const double *held, int slow_ones, const kt_slip_fate *of,
                            bool holds, bool fades);
/* Writes predicted directions of slow slip to p->to.e, for the present block of an island. Its W and its rates without
 * friction are inputs. If `wide`, contacts under fixed steps have the length of these steps as tau0. Returns false if
 * there is no solution. */
bool kt_slip_predict(const kt_data *data, kt_slip_problem *p, bool wide);
/* Lists the contacts of the present island by blocks of W: p->coupled and p->end. Returns the number of blocks. */
int kt_slip_list_blocks(const kt_data *data, kt_slip_problem *p);
/* Whether some of the last directions were predicted with the length of fixed steps. */
bool kt_slip_predicts_wide(const kt_data *data, const kt_slip_problem *p);

/* The following calls need loops. */

/* Whether the last accelerations stored the terms from which responses follow: the groups of all contacts that slip are
 * solved in range space (reduction/half_columns.h). */
bool kt_slip_has_responses(const kt_model *model, const kt_data *data);

/* The multiplier of the first equation of such a contact. */
double kt_slip_multiplier(const kt_model *model, const kt_data *data, const kt_loop_record *loop);

/* Responses to unit forces in an island: of normal forces, and of J a if there are two of each contact. */
void kt_slip_find_responses(const kt_model *model, const kt_data *data, kt_slip_problem *p);

/* Adds the friction in an island, whose responses are known, to the last free accelerations of the joints. */
void kt_slip_add_friction(const kt_model *model, kt_data *data, kt_slip_problem *p);

/* The accelerations that follow. Returns false if a number is not finite. */
bool kt_slip_resume(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a);

#endif
