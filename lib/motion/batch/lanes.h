/* The recursions over trees, compiled for several states at once (algebra/real3.h), and their workspace.
 *
 * Numbers of a group of `width` states lie coordinate by coordinate: x[coordinate * width + lane]. The results of a
 * lane have the bits of the same state computed alone, for any numbers in the other lanes.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BATCH_LANES_H
#define KT_BATCH_LANES_H

#include "base/isa.h"
#include "integrator/integrator.h"
#include "model/model.h"

#include <stddef.h>
#include <stdint.h>

/* Lanes are bits of masks. */
typedef uint32_t kt_lane_mask;

enum { KT_LANES_MOST = 8 };

/* A group of states: times, positions, velocities, auxiliary states (if there are some) and joint forces. The lanes in
 * `active` are computed. */
typedef struct kt_lane_state {
    const double *t, *q, *v, *x, *tau;
    kt_lane_mask active;
} kt_lane_state;

/* The data that scale errors: the states at both ends of a step, and the tolerances of each lane. */
typedef struct kt_lane_scales {
    const double *y0, *y1, *absolute, *relative;
} kt_lane_scales;

/* Replaces theta = (t - t0) / (t1 - t0) if t is t1. Rounding may give theta = 1 for earlier times, too. */
#define KT_LANE_AT_END 2.0

/* A step by a table: its length, and the states at its ends. */
typedef struct kt_lane_step {
    const kt_method *method;
    const double *h, *y0, *y1;
} kt_lane_step;

/* A frame on a body, which is the body's own frame or a marker. `marker` has the KT_POSE_NUMBERS numbers of kt_pose, of
 * each lane's model. A result has the KT_FRAME_NUMBERS numbers of kt_frame_motion (batch.h). */
enum { KT_POSE_NUMBERS = 12, KT_FRAME_NUMBERS = 24 };
typedef struct kt_lane_frame {
    int body;
    const double *marker; /* NULL: the body's own frame */
} kt_lane_frame;

typedef struct kt_lane_kernels {
    size_t width;
    /* Bytes of the workspace; if memory is not NULL, it is initialised there, at a multiple of KT_ARENA_ALIGNMENT. */
    size_t (*layout)(const kt_model *model, void *memory);
    /* Gives some lanes the numbers of links, bodies and planes, and the gravity, of a model. Every lane must have the
     * numbers of some model before any computation. The models of lanes agree in all else (kt_lanes_agree). The
     * functions below take any one of them. */
    void (*put_model)(const kt_model *model, void *work, kt_lane_mask lanes);
    /* Computes a by forward dynamics of a tree, or of a mechanism with loops that lanes compute (kt_lanes_fit_model).
     * The array `external` has the layout of the others, with 6 numbers a body, moment and force; it may be NULL. Times
     * are used by loops that depend on time. Returns the lanes whose accelerations are finite and whose joints all have
     * inertia, without a loop near a singular position. The accelerations of other lanes are undefined. */
    kt_lane_mask (*forward)(const kt_model *model, void *work, const kt_lane_state *at, const double *external,
                            double *a);
    /* Effects: writes the joint forces with those of effects to tau, and their wrenches on bodies (as external above;
     * NULL if no link carries forces). Returns the active lanes whose forces are finite. */
    kt_lane_mask (*effects)(const kt_model *model, void *work, const kt_lane_state *at, double *tau, double *external);
    /* After `effects` in the same state, computes the rates of auxiliary states. Returns the active lanes whose rates
     * are finite. */
    kt_lane_mask (*own_rates)(const kt_model *model, void *work, const kt_lane_state *at, double *rates);
    /* Inverse dynamics of the tree: tau. Returns the lanes whose forces are finite. */
    kt_lane_mask (*inverse)(const kt_model *model, void *work, const double *q, const double *v, const double *a,
                            const double *external, double *tau);
    /* Computes the motion of all links, without gravity, in the workspace, as kt_kinematics_update. Returns the lanes
     * whose motion is finite. */
    kt_lane_mask (*kinematics)(const kt_model *model, void *work, const double *q, const double *v, const double *a);
    /* After `kinematics`: the first call writes the motion of a frame on a body. The second one writes the nonzero
     * columns of its Jacobian to out[lane], for the lanes that have one. */
    void (*frame)(const kt_model *model, void *work, const kt_lane_frame *frame, double *motion);
    void (*jacobian)(const kt_model *model, void *work, const kt_lane_frame *frame, double *const *out);
    /* Computes kinetic and potential energy of the bodies, a number for each lane. Both are those of kt_kinetic_energy
     * and kt_potential_energy for models without armature, after kt_kinematics_update without accelerations. The array
     * `zero` has as many zeros as there are velocities. Returns the lanes whose motion is finite. */
    kt_lane_mask (*energy)(const kt_model *model, void *work, const double *q, const double *v, const double *zero,
                           double *kinetic, double *potential);
    /* Closes the loops of the active lanes, as kt_state_project, at times, positions and velocities. Returns the lanes
     * that are closed. The numbers of other lanes are undefined. */
    kt_lane_mask (*project)(const kt_model *model, void *work, kt_lane_mask active, const double *t, double *q,
                            double *v);
    /* Writes the rates of positions: the velocities, except for quaternions. */
    void (*rate)(const kt_model *model, void *work, const double *q, const double *v, double *out);
    /* Makes quaternions units, as kt_position_make_units. Returns the lanes where this could be done; the others are
     * unchanged. */
    kt_lane_mask (*make_units)(const kt_model *model, void *work, double *q);
    /* out = y + h sum_j weight_j k_j, n numbers of each lane, every lane with an h of its own. The bits are those of
     * kt_combine. */
    void (*combine)(double *out, const double *y, const double *h, const kt_stage_term *terms, size_t count,
                    double *const *k, size_t n);
    /* Returns the lanes whose n numbers are all finite. */
    kt_lane_mask (*finite)(const double *x, size_t n);
    /* mean over i of (sum_j weight_j k_ji / scale_i)^2, as the error norm of explicit methods has it. */
    void (*mean_square)(double *out, const kt_lane_scales *scales, const kt_stage_term *terms, size_t count,
                        double *const *k, size_t n);
    /* Computes kt_control_power of each lane. Returns the lanes whose numbers are usual. The powers of other lanes are
     * undefined. */
    kt_lane_mask (*power)(const double *bases, const double *exponents, double *out);
    /* Computes the dense output at theta of the step, with the bits of kt_table_interpolate. The last stage of the
     * method must be at the end of the step, and the method must need no further stages. At 0 and at KT_LANE_AT_END the
     * result is the state at that end. */
    void (*interpolate)(double *out, const kt_lane_step *step, const double *thetas, double *const *k, size_t n);
    /* The first call initialises the memory of `adjoint`, as `layout`. The second one is the adjoint of forward
     * dynamics of a tree, without effects, at the accelerations a. The gradient has 3 nv numbers, of which the last nv
     * are mu on entry. On exit it is the gradient of mu . a with respect to v, tau and xi, which is a change of q in
     * velocity coordinates (rotations instead of quaternions).
     * Returns the lanes that could be computed; their numbers may not be finite. */
    size_t (*adjoint_layout)(const kt_model *model, void *memory);
    kt_lane_mask (*adjoint)(const kt_model *model, void *work, void *memory, const kt_lane_state *at, const double *a,
                            double *gradient);
    /* kt_turns_drop_transposed, rate_transposed and lift_transposed (joint/turn.h). */
    void (*drop_transposed)(const kt_model *model, void *work, const double *q, const double *by_xi, double *by_q);
    void (*rate_transposed)(const kt_model *model, void *work, const double *q, const double *v, const double *by_rate,
                            double *by_q, double *by_v);
    void (*lift_transposed)(const kt_model *model, void *work, const double *q, const double *by_q, double *by_xi);
} kt_lane_kernels;

/* Whether a model with loops is computed in lanes. Groups must be pins (reduction/pin.h), dense matrices of some
 * coordinates, or in the form of Delassus (reduction/delassus.h). No equation may be a formula or a caller's. */
bool kt_lanes_fit_model(const kt_model *model);

/* Whether models of one shape differ at most in the numbers that put_lane_model writes to each lane, in their initial
 * motions, and in names. */
bool kt_lanes_agree(const kt_model *a, const kt_model *b);

/* Evaluates an effect of one state with the code for one state: its wrenches, or its force in a joint. Returns whether
 * the callback of the effect succeeded. For an effect with formulas, the argument has the variables
 * (KT_FORMULA_VARIABLE_MAX at most); for other effects it is NULL. The force may be the rate of an auxiliary state. */
bool kt_effect_alone_wrench(const kt_model *model, const kt_effect_record *effect, const double *variables,
                            const kt_effect_end *end, double t, kt_wrench wrench[2]);
bool kt_effect_alone_force(const kt_model *model, const kt_effect_record *effect, const double *variables, double q,
                           double v, double t, double *force);

#ifdef KT_LANES
/* The effects of a group, into tau and applied. Returns the lanes whose forces are finite. */
kt_condition KT_KERNEL(kt_effects_sum)(const kt_model *model, kt_data *data, const kt_lane_state *at, kt_real1 *tau,
                                       kt_external *applied);

/* Computes the rates of auxiliary states, after kt_effects_sum. */
kt_condition KT_KERNEL(kt_own_rates)(const kt_model *model, kt_data *data, const kt_lane_state *at, kt_real1 *rates);

/* The energies of the motion that data hold. */
kt_real1 KT_KERNEL(kt_kinetic)(const kt_model *model, const kt_data *data);
kt_real1 KT_KERNEL(kt_potential)(const kt_model *model, const kt_data *data);

/* The motion and the Jacobian of a frame, as above. */
void KT_KERNEL(kt_frame_motion)(const kt_model *model, const kt_data *data, const kt_lane_frame *frame, kt_real1 *out);
void KT_KERNEL(kt_frame_columns)(const kt_model *model, const kt_data *data, const kt_lane_frame *frame,
                                 double *const *out);

/* Members of the kernels, as above. */
size_t KT_KERNEL(kt_adjoint_layout)(const kt_model *model, void *memory);
kt_condition KT_KERNEL(kt_tree_adjoint)(const kt_model *model, kt_data *data, void *memory, const kt_lane_state *at,
                                        const double *a, double *gradient);
void KT_KERNEL(kt_lanes_combine)(double *out, const double *y, const double *h, const kt_stage_term *terms,
                                 size_t count, double *const *k, size_t n);
void KT_KERNEL(kt_lanes_mean_square)(double *out, const kt_lane_scales *scales, const kt_stage_term *terms,
                                     size_t count, double *const *k, size_t n);
kt_lane_mask KT_KERNEL(kt_lanes_power)(const double *bases, const double *exponents, double *out);
void KT_KERNEL(kt_lanes_interpolate)(double *out, const kt_lane_step *step, const double *thetas, double *const *k,
                                     size_t n);

/* The lanes for which a condition holds. */
KT_OPERATOR kt_lane_mask kt_mask_of(kt_condition condition) {
    kt_lane_mask mask = 0;
    for (int lane = 0; lane < KT_LANES; lane++)
        mask |= (kt_lane_mask)(condition[lane] & 1) << lane;
    return mask;
}
#endif

extern const kt_lane_kernels kt_lane_kernels_baseline, kt_lane_kernels_v3, kt_lane_kernels_v4;

#endif
