/* Sensitivities: the exact derivatives of one fixed step with respect to the state and to the inputs held during the
 * step. An adjoint sweep gives the gradient of a scalar over many steps. The functions serve optimal control,
 * estimation and identification.
 *
 *     const kt_step step = {.method = kt_method_find("rk4"), .h = 0.01};
 *     const size_t size = kt_step_work_size(model, step.method), nv = (size_t)kt_model_nv(model);
 *     void *work = aligned_alloc(KT_ALIGNMENT, size);
 *     double *A = malloc(6 * nv * nv * sizeof *A), *B = A + 4 * nv * nv;
 *     status = kt_step_derivatives(model, data, work, size, &step, q, v, NULL, NULL, A, B, &error);
 *
 * Tangent coordinates. A change of the state is dx = (xi, dv) with 2 nv numbers. This change leads to q (+) xi
 * (kt_position_add) and to v + dv. For a quaternion p, xi is the change of orientation in the body frame: dp = p o (0,
 * xi) / 2. The matrices
 *
 *     A = d(state after) / d(state before)     2 nv x 2 nv
 *     B = d(state after) / d(tau)              2 nv x nv
 *
 * are column-major and relate such changes: dx+ = A dx + B dtau. For the numbers p of a parameter of the model
 * (model.h), the matrix is
 *
 *     C = d(state after) / d(p)                2 nv x kt_parameter.count
 *
 * Derivation. With x = (q, v) the stages of a Runge-Kutta method (HNW II.1) are
 *
 *     X_i = x + h sum_j a_ij K_j,   K_i = (E(Q_i) V_i, a(t + c_i h, Q_i, V_i, tau)),   x+ = x + h sum_i b_i K_i
 *
 * Their tangents satisfy the same equations, differentiated:
 *
 *     dX_i = dx + h sum_j a_ij dK_j,   dK_i = (dE(Q_i) V_i + E(Q_i) dV_i,  a_q xi_i + a_v dV_i + a_tau dtau)
 *
 * These tangents are exact for the step itself, not only for the differential equation. The rate q' = E(q) v equals v
 * except for quaternions. For quaternions p' = p o (0, w) / 2, which is linear in p and in w. Stages and sums leave an
 * error in the norm of a quaternion, so dp has four components at the stages. Accelerations depend only on the rotation
 * xi = 2 vec(p^-1 o dp). The quaternion that is normalised after the step depends on the same rotation alone.
 *
 * Implicit methods (implicit-euler, crank-nicolson, radau5, bdf2, two-step). The coefficients a_ij also couple each
 * stage to later stages. The implicit function theorem at the solved stages gives linear equations for dK_i:
 *
 *     dK_i - h F_i sum_j a_ij dK_j = F_i dx + f_tau dtau,   F_i = df/dx at stage i
 *
 * The derivatives are exact for every iteration that finds the stages (Hairer, Norsett, Wanner I, II.7; HW II, IV.8). A
 * step of a two-step method (bdf2, two-step) from a state alone is its first step. This first step uses the diagonally
 * implicit method of its table. All steps of a simulation whose inputs change at each step are such first steps. A step
 * of the linearly implicit method rodas5p depends on the Jacobian J at its start. The derivatives of this step depend
 * on the derivatives of J along the stages' increments. Differences of exact Jacobians give them to about 1e-11 (HW II,
 * IV.7).
 *
 * Loops. After the step q and v are projected (kt_state_project). Each iteration of the projection
 *
 *     q+ = q (+) x,   W x = J' lambda,   J x = -phi(q),   W = 1 or M (kt_metric)
 *
 * is differentiated, including the terms in dJ and dM. These terms have the size of the correction x. The projector I -
 * J^+ J, which remains at x = 0, would lose them:
 *
 *     W dx - J' dlambda = (dJ)' lambda - dW x,   J dx = -J xi - (dJ) x
 *
 * The projection of the velocities, M (v+ - v) = A' mu with A v+ = b', is differentiated likewise. So A and B stay
 * exact if steps are coarse and a step leaves the loops open by a large amount. If equations of loops are redundant,
 * the choice of the independent equations decides how an open state is closed. The derivatives use the choice of the
 * projection; at the stages they use the choice of kt_acceleration_derivatives. In this case, derivatives are exact to
 * the gap of the loops at the stages.
 *
 * Parameters. With r(q, v, a; p) = M a + h - J' external - Q, at fixed q and v, the term a_p dp replaces a_tau dtau:
 *
 *     a_p = -a_tau dr/dp
 *
 * Differences of r give dr/dp exactly, since r is a polynomial in p. The projection gains the term -(dW/dp) x. For a
 * loop's own function of time, J a = b''(p) and J x = -phi(q, p) gain the derivatives of their right sides.
 *
 * Auxiliary states (kt_auxiliary_state) of a model are part of the state of a step. The members kt_step.x and
 * kt_rollout.x give their values at the start, so that the result is a function of the arguments alone. NULL selects
 * the values in the data (kt_auxiliary_states). After a successful kt_step_evaluate or kt_step_derivatives the data
 * hold the values after the step. With NULL the next step continues from these values. All other calls, and calls that
 * fail, leave the values in the data unchanged. With m auxiliary states a change is (xi, dv, dx) with 2 nv + m numbers,
 * and so are the gradients with respect to a state. A, B and C then have 2 nv + m rows, and A as many columns. Adjoints
 * then form A and B.
 *
 * Sources: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1 and I.14 (tangents). Griewank,
 * Walther, Evaluating Derivatives, 2008 (adjoints, checkpoints). Sanz-Serna, SIAM Review 58(1), 2016 (adjoints of
 * Runge-Kutta methods).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_SENSITIVITY_H
#define KINETREE_SENSITIVITY_H

#include "kinetree/mechanism.h"
#include "kinetree/method.h"
#include "kinetree/simulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A fixed step from t to t + h, and the quantities that are constant during the step. Clear the struct, then set the
 * members that apply. */
typedef struct kt_step {
    const kt_method *method;   /* an explicit Runge-Kutta method or an implicit method; the step uses its stages, not
                                * its error estimate */
    double t, h;               /* s; h is finite, and may be negative */
    const double *tau;         /* nv joint forces; NULL: none */
    const kt_wrench *external; /* one for each body, as for kt_acceleration_evaluate; NULL: none */
    bool unprojected;          /* loops are not closed after the step */
    const double *x;           /* auxiliary states at the start (kt_auxiliary_state_count); NULL: those in the data */
    double end;                /* s, the time at the end: t + h up to rounding; 0: t + h */
} kt_step;

/* Returns the number of bytes of work memory for the calls of this header. Returns 0 if a step of the method is not a
 * function of a state; the calls then report an error.
 * Ownership: the memory belongs to the caller, is aligned to KT_ALIGNMENT, and is used only during the call.
 * Cost: about 288 s nv^2 bytes with s stages, and twice kt_acceleration_work_size. */
KT_API size_t kt_step_work_size(const kt_model *model, const kt_method *method);

/* Takes the step from q (nq) and v (nv) to next_q and next_v, which may be the same arrays. An explicit method gives
 * the same bits as a simulation's fixed step from the same state (kt_simulation_step). If forces or loops depend on
 * time, step->end must be the time of the simulation after the step. The steps of a simulation end at multiples of h,
 * which may differ from t + h in the last digit. With an implicit method, the results differ by rounding, because the
 * iteration of a simulation starts from stored values of earlier steps.
 * Errors: KT_ERROR_ARGUMENT if h is not finite, if `end` is not t + h, or if the method is of another kind. Stabilised
 * methods, auto and explicit multistep methods depend on earlier steps. KT_ERROR_MEMORY. KT_ERROR_STEP if the stages
 * cannot be solved.
 * KT_ERROR_UNSUPPORTED if an event occurs within the step. A hard contact, stop or slack rope closes, or its reaction
 * begins to pull, or friction sticks (joint_friction with stick). For such steps, use a kt_simulation, which handles
 * events. Further errors are those of kt_acceleration_evaluate and kt_state_project, and for implicit methods those of
 * kt_acceleration_derivatives. Outputs are untouched on failure.
 * Cost: as many evaluations as the method has stages (one less with fsal), and the projection. An implicit method needs
 * a Jacobian and about four evaluations for each solved stage; rodas5p needs one Jacobian. */
KT_API KT_CHECKED kt_status kt_step_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                             const kt_step *step, const double *q, const double *v, double *next_q,
                                             double *next_v, kt_error *error);

/* Takes the step, and computes its derivatives A and B. A, B, next_q and next_v may each be NULL. The derivatives are
 * exact to rounding; the library's effects are differentiated in closed form. For effects of the caller that give no
 * derivatives, see kt_acceleration_derivatives.
 *
 * A step contains an event if a hard contact, stop or slack rope closes, or if its reaction begins to pull. A and B
 * would omit the impulse and the time of the event, so the call fails with KT_ERROR_UNSUPPORTED. The adjoint and the
 * gradients over many steps fail likewise.
 * Shape: A is 2 nv x 2 nv. B is 2 nv x nv.
 * Errors: as kt_step_evaluate and kt_acceleration_derivatives. KT_ERROR_SINGULAR next to a singular position of the
 * loops, at a stage or after the step. Rounding then leaves the derivatives uncertain by more than 1e-3 of the largest.
 * Outputs are untouched on failure.
 * Cost: the derivatives of the accelerations at each stage, and at most 6 nv^3 multiplications for each. Implicit
 * methods also need solutions with dense factors, and rodas5p needs 40 Jacobians. For the bundled governor the cost
 * relative to a step of a simulation is 1.4 (implicit-euler) and 2.3 (radau5); see meson test plan/implicit. */
KT_API KT_CHECKED kt_status kt_step_derivatives(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                const kt_step *step, const double *q, const double *v, double *next_q,
                                                double *next_v, double *A, double *B, kt_error *error);

/* Returns the number of bytes of work memory for kt_step_parameter_derivatives: the memory of a step, and a copy of
 * the model. */
KT_API size_t kt_step_parameter_work_size(const kt_model *model, const kt_method *method);

/* Takes the step, and computes C (2 nv x parameter->count), the derivatives with respect to the numbers of a parameter.
 * The derivatives hold at the present values (kt_parameter_find, kt_parameter_get). For gravity, masses, coms, inertias
 * and armature, the derivatives are exact to rounding. For effects, the derivatives are differences over 1/1024 of a
 * number. For a number that is zero, the difference is over the same fraction of its unit. Away from kinks these
 * differences are exact to about 1e-12.
 *
 * The model may be a compiled model or a copy. The call changes neither the model nor the numbers of the parameter. The
 * parameter inertia has the six independent entries; masses and inertias change with constant com. A function of time
 * must be constant or set by kt_parameter_set, since other functions do not have the numbers of a parameter. Over many
 * steps dx/dp follows S+ = A S + C.
 * Errors: as kt_step_derivatives. KT_ERROR_ARGUMENT if the parameter is hold (which is not a number) or another
 * function of time. KT_ERROR_UNSUPPORTED for the place of a loop. C is untouched on failure.
 * Cost: B of a step. Each number needs two inverse dynamics at each stage, and four for effects and loops. */
KT_API KT_CHECKED kt_status kt_step_parameter_derivatives(const kt_model *model, kt_data *data, void *work,
                                                          size_t work_size, const kt_step *step,
                                                          const kt_parameter *parameter, const double *q,
                                                          const double *v, double *C, kt_error *error);

/* Applies the transposed derivatives of a step without forming them. The input by_next (2 nv) is a gradient with
 * respect to the state after the step. The output by_state = A' by_next (2 nv) is the gradient with respect to the
 * state before the step. The output by_tau = B' by_next (nv) is the gradient with respect to tau. Either output may be
 * NULL.
 * Errors: as kt_step_derivatives, with the same work memory. Next to a singular position the uncertainty is compared
 * with accelerations, and not with the derivatives themselves.
 * Cost: O(n) in all if effects act only in joints. Each stage then needs an evaluation, and the response w to mu (M w =
 * mu + J' pi, J w = 0). A sweep gives the gradient of the scalar product of w and the inverse dynamics. With loops each
 * stage also needs the multipliers and the gradient of one sum of the equations; the projection costs as much as a
 * stage. Effects between bodies, effects of the caller, and implicit methods need the derivatives at each stage. For
 * rodas5p A and B are formed. */
KT_API KT_CHECKED kt_status kt_step_adjoint(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                            const kt_step *step, const double *q, const double *v,
                                            const double *by_next, double *by_state, double *by_tau, kt_error *error);

/* ---- through events ---------------------------------------------------------------------------------------------- */

/* Returns the number of bytes of work memory for kt_motion_derivatives; 0 for NULL.
 * Cost: about 96 nv^2 bytes, kt_step_work_size, a checkpoint and data. */
KT_API size_t kt_motion_work_size(const kt_simulation *simulation);

/* Advances the simulation to t_end with the same bits as kt_simulation_advance, and computes the derivatives of the
 * state at t_end. A (2 nv x 2 nv) is the derivative with respect to the present state. B (2 nv x nv) is the derivative
 * with respect to joint forces that are added to those of the simulation over the whole interval. Either may be NULL.
 * Models with auxiliary states have 2 nv + m numbers, as for a step.
 *
 * A and B are products of the matrices of the steps and, at events, of saltation matrices. These events are impacts,
 * and contacts, stops and ropes that close and open. Joint friction that comes to rest or begins to slip is an event,
 * too, and so are actions that are declared repeatable (kt_event). The derivatives of the steps are exact. At an event,
 * the derivatives of the motion are used. A and B therefore agree with differences of the simulation to the error of
 * its steps. The effect of an event is differenced, to about 1e-10 of its size. If an event stops the motion, A and B
 * belong to the state at that time.
 *
 * If the steps of a method depend on earlier steps, the derivatives of radau5 over the same steps are used. For bdf2
 * and two-step, the derivatives are those of steps that begin anew.
 * Errors: as kt_simulation_advance and kt_step_derivatives. KT_ERROR_UNSUPPORTED if the action of an event is not
 * repeatable, while a contact slips, and for equations of the caller. KT_ERROR_SINGULAR at an event without a
 * derivative. Its value touches zero without crossing, two events happen at the same instant, or neighbouring motions
 * leave with other contacts closed. A and B are then untouched. The simulation remains at that time; the event takes
 * effect when the simulation goes on.
 * Cost: kt_step_derivatives for every step. An event needs twelve evaluations of the event for each column. */
KT_API KT_CHECKED kt_status kt_motion_derivatives(kt_simulation *simulation, void *work, size_t work_size, double t_end,
                                                  double *A, double *B, kt_error *error);

/* ---- gradients over many steps ----------------------------------------------------------------------------------- */

/* A motion of many equal steps from t on, with an input for each. */
typedef struct kt_rollout {
    const kt_method *method; /* as of a step */
    double t, h;             /* s */
    int steps;               /* > 0 */
    const double *inputs;    /* joint forces held during each step, nv x steps, column-major; NULL: none */
    bool unprojected;        /* as of a step */
    int checkpoints;         /* number of steps whose start is stored in the work memory; 0, or more than steps: all */
    const double *x;         /* auxiliary states at the start (kt_auxiliary_state_count); NULL: those in the data */
} kt_rollout;

/* A point of the motion at which the cost is evaluated. */
typedef struct kt_cost_point {
    int step;            /* 0 .. steps: the state before this step; steps: the last state */
    double t;            /* s */
    const double *q, *v; /* state */
    const double *tau;   /* nv, held during this step; NULL: none, and at the last state */
    const double *x;     /* auxiliary states (kt_auxiliary_state_count); NULL: none */
} kt_cost_point;

/* Computes the cost of a point and writes the cost to *value and, unless by_state and by_tau are NULL, its gradients.
 * The output by_state is the gradient with respect to the state: xi and dv (2 nv numbers), then the auxiliary states.
 * The output by_tau (nv) is the gradient with respect to tau. All outputs are 0 on entry. The scalar is the sum of the
 * values of the points 0 .. steps. The function returns 0, or another number to stop. The library may call this
 * function more than once for a point. */
typedef int kt_cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user);

/* Returns the number of bytes of work memory, which must be aligned to KT_ALIGNMENT. The size is that of a step, and
 * about 8 nv bytes for each step of the rollout. With s stages each checkpoint takes about this number of bytes:
 *
 *     8 (2 nq + (2 + s) nv)
 *
 * Returns 0 if there are no steps, if the step has no derivatives, or if checkpoints are negative. */
KT_API size_t kt_rollout_work_size(const kt_model *model, const kt_rollout *rollout);

/* Computes a sum of costs over a motion from q, v and the auxiliary states rollout->x, and its gradients. The output
 * by_start (2 nv, and one number for each auxiliary state) is the gradient with respect to the state at the start. The
 * output by_inputs (nv x steps) is the gradient with respect to all inputs. Either may be NULL.
 *
 * The motion runs once. States at the start of steps, with the accelerations of these steps, are kept as checkpoints.
 * The adjoints then run backwards from the end. A step that is not stored is computed again from the last checkpoint
 * before this step. With c checkpoints each step runs at most r times, if (c + r)! / (c! r!) reaches the number of
 * steps. With sqrt(2 steps) checkpoints each step runs twice, and once more for its adjoint.
 * Errors: as kt_step_adjoint; KT_ERROR_CALLBACK if the cost stops; KT_ERROR_NOT_FINITE. Outputs are untouched on
 * failure.
 * Cost: independent of the number of inputs. With a checkpoint for every step, the cost is 3 to 4 runs of the motion
 * (see kt_step_adjoint). */
KT_API KT_CHECKED kt_status kt_rollout_gradient(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                const kt_rollout *rollout, const double *q, const double *v,
                                                double *value, double *by_start, double *by_inputs, kt_cost *cost,
                                                void *user, kt_error *error);

/* ---- many motions at once ---------------------------------------------------------------------------------------- */

/* A motion, and the outputs of its gradient as in kt_rollout_gradient. Clear the struct, then set the members that
 * apply. */
typedef struct kt_rollout_task {
    kt_rollout rollout;           /* with inputs of its own */
    const kt_model *model;        /* with parameters of its own: a copy of the model; NULL: the model of the call */
    const double *q, *v;          /* state at the start; v NULL: at rest */
    double value;                 /* result */
    double *by_start, *by_inputs; /* results, or NULL */
    void *user;                   /* passed to the cost */
    kt_status status;             /* result */
    bool in_lanes;                /* result: it was computed together with other motions */
} kt_rollout_task;

/* Returns how many motions of a model are computed at once, with one motion in each lane of the processor's vectors.
 * x86-64-v4 has 8 lanes, v3 has four; all other processors have two. Returns 1 if each motion is computed separately;
 * *why (may be NULL) is then the reason, and otherwise NULL. Lanes compute trees, in space and in the plane, with
 * explicit methods. The effects of these trees must act in joints; formulas and effects of the caller are excluded. */
KT_API size_t kt_rollout_width(const kt_model *model, const kt_rollout *rollout, const char **why);

/* Returns the number of bytes of work memory of kt_rollout_gradients, aligned to KT_ALIGNMENT. The size is
 * kt_rollout_width times the checkpoints and inputs of one motion, or kt_rollout_work_size if that is larger.
 * Returns 0 in the same cases as kt_rollout_work_size. The size does not depend on the number of motions. */
KT_API size_t kt_rollout_gradients_work_size(const kt_model *model, const kt_rollout *rollout);

/* Computes the gradients of `count` motions. For each motion, value, by_start and by_inputs have the same bits as
 * kt_rollout_gradient and do not depend on the other motions.
 *
 * Groups of kt_rollout_width consecutive tasks are computed together under two conditions. These tasks must have the
 * same method, and the same numbers of steps and checkpoints. Their models differ only in gravity, masses, centres of
 * mass, inertias and lengths. Times, step lengths, inputs and costs belong to each task. All other tasks are computed
 * one after the other. If work_size is less than kt_rollout_gradients_work_size, all tasks are computed one after the
 * other. work_size must be at least kt_rollout_work_size. The result task->in_lanes reports this.
 *
 * The cost is called in turns for the motions of a group. If a motion fails in lanes, the cost is called again from the
 * start of this motion. A failure of one motion does not affect the others: task->status reports it, and the outputs of
 * the motion are untouched.
 * Errors: that of the first motion that failed, as for kt_rollout_gradient.
 * Cost: `bench/run batch`. */
KT_API KT_CHECKED kt_status kt_rollout_gradients(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 kt_rollout_task *tasks, size_t count, kt_cost *cost, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
