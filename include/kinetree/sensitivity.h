/* Sensitivities: one fixed step as a function of the state and of the inputs held during it, its exact derivatives, and
 * gradients of a scalar over many steps by the adjoint sweep. For optimal control, estimation and identification.
 *
 *     const kt_step step = {.method = kt_method_find("rk4"), .h = 0.01};
 *     const size_t size = kt_step_work_size(model, step.method), nv = (size_t)kt_model_nv(model);
 *     void *work = aligned_alloc(KT_ALIGNMENT, size);
 *     double *A = malloc(6 * nv * nv * sizeof *A), *B = A + 4 * nv * nv;
 *     status = kt_step_derivatives(model, data, work, size, &step, q, v, NULL, NULL, A, B, &error);
 *
 * Tangent coordinates. A change of the state is dx = (xi, dv), 2 nv numbers, with q (+) xi (kt_position_add) and v +
 * dv: of a quaternion p, xi is the change of orientation in the body frame, dp = p o (0, xi) / 2. The matrices
 *     A = d(state after) / d(state before)     2 nv x 2 nv
 *     B = d(state after) / d(tau)              2 nv x nv
 * are column-major and relate such changes: dx+ = A dx + B dtau. With the numbers p of a parameter of the model
 * (model.h)
 *     C = d(state after) / d(p)                2 nv x kt_parameter.count
 *
 * Derivation. With x = (q, v) the stages of a Runge-Kutta method (HNW II.1) are
 *     X_i = x + h sum_j a_ij K_j,   K_i = (E(Q_i) V_i, a(t + c_i h, Q_i, V_i, tau)),   x+ = x + h sum_i b_i K_i
 * and their tangents satisfy the same equations, differentiated:
 *     dX_i = dx + h sum_j a_ij dK_j,   dK_i = (dE(Q_i) V_i + E(Q_i) dV_i,  a_q xi_i + a_v dV_i + a_tau dtau)
 * which is exact for the step itself, not for the differential equation only. q' = E(q) v is v but for quaternions,
 * p' = p o (0, w) / 2, which is linear in p and in w. Stages and sums leave a quaternion's norm off by their error: dp
 * has four numbers at the stages, accelerations depend on its rotation xi = 2 vec(p^-1 o dp) alone, and so does the
 * quaternion that is made a unit again after the step.
 *
 * Implicit methods (implicit-euler, crank-nicolson, radau5, bdf2, two-step): a_ij couples stages forward, too, and the
 * same equations for dK_i are linear ones, by the implicit function theorem at the solved stages:
 *     dK_i - h F_i sum_j a_ij dK_j = F_i dx + f_tau dtau,   F_i = df/dx at stage i
 * They are exact, whatever iteration found the stages (Hairer, Norsett, Wanner I, II.7; HW II, IV.8). A step of a
 * two-step method (bdf2, two-step) from a state alone is its first one, by the diagonally implicit method of its table;
 * so are all steps of a simulation whose inputs change at each. Of rodas5p, which is linearly implicit, a step depends
 * on the Jacobian J at its start, and its derivatives on those of J along the stages' increments: exact to some 1e-11,
 * by differences of exact Jacobians (HW II, IV.7).
 *
 * Loops. After the step q and v are projected (kt_state_project). Each iteration of the projection,
 *     q+ = q (+) x,   W x = J' lambda,   J x = -phi(q),   W = 1 or M (kt_metric)
 * is differentiated as it is, with the terms in dJ and dM, which are of the size of the correction x and would be lost
 * in the projector I - J^+ J that remains at x = 0:
 *     W dx - J' dlambda = (dJ)' lambda - dW x,   J dx = -J xi - (dJ) x
 * and likewise the velocities, M (v+ - v) = A' mu, A v+ = b'. So A and B are exact also where steps are coarse and a
 * step leaves the loops open by much. If a loop's equations repeat others, the choice of the independent ones decides
 * how an open state is closed; the derivatives take the choice of the projection, at stages that of
 * kt_acceleration_derivatives, and are then exact to the gap of the loops at the stages.
 *
 * Parameters. With r(q, v, a; p) = M a + h - J' external - Q, at fixed q and v, a_p dp takes the place of a_tau dtau:
 *     a_p = -a_tau dr/dp,   dr/dp by differences of r, which r's polynomials in p make exact
 * and the projection gains -(dW/dp) x. Of a loop's own function of time J a = b''(p) and J x = -phi(q, p) gain their
 * right sides.
 *
 * Own states (kt_state) of a model are part of the state of a step. kt_step.x and kt_rollout.x give those at the start,
 * so that the result is a function of the arguments alone; NULL stands for those in the data (kt_own_states). When
 * kt_step_evaluate or kt_step_derivatives has succeeded, the data hold those after the step: with NULL the next step
 * continues there. All other calls, and calls that fail, leave those in the data as they are. With m of them a change is (xi, dv, dx), 2 nv + m numbers, and so are the gradients
 * by a state: A is (2 nv + m) x (2 nv + m), B (2 nv + m) x nv, C (2 nv + m) x count. Adjoints then form A and B.
 *
 * Sources: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1 and I.14 (tangents); Griewank,
 * Walther, Evaluating Derivatives, 2008 (adjoints, checkpoints); Sanz-Serna, SIAM Review 58(1), 2016 (adjoints of
 * Runge-Kutta methods).
 */
#ifndef KINETREE_SENSITIVITY_H
#define KINETREE_SENSITIVITY_H

#include "kinetree/integrator.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A fixed step from t to t + h, and what is held constant during it. Clear the struct and fill in what there is. */
typedef struct kt_step {
    const kt_method *method;   /* an explicit Runge-Kutta method, or an implicit one: its stages are used, not its error
                                * estimate */
    double t, h;               /* s; h is finite, and may be negative */
    const double *tau;         /* nv joint forces; NULL: none */
    const kt_wrench *external; /* one for each body, as for kt_acceleration_evaluate; NULL: none */
    bool unprojected;          /* loops are not closed after the step */
    const double *x;           /* own states at the start (kt_own_state_count); NULL: those in the data */
} kt_step;

/* Returns the number of bytes that the calls of this header need as work memory, aligned to KT_ALIGNMENT, the caller's,
 * needed during the call alone; 0 if a step of the method is no function of a state, which the calls then report.
 * About 8 s (6 nv)^2 + 2 kt_acceleration_work_size bytes with s stages. */
KT_API size_t kt_step_work_size(const kt_model *model, const kt_method *method);

/* Takes the step: from q (nq), v (nv) to next_q, next_v, which may be the same arrays. The bits are those of a
 * simulation's fixed step from there (kt_simulation_step); of an implicit method they are its own, since a simulation's
 * iteration begins with what it remembers, and differ by rounding. Errors: KT_ERROR_ARGUMENT if the method is another
 * one (stabilised methods, auto and explicit multistep ones depend on earlier steps), or h is not finite;
 * KT_ERROR_MEMORY; KT_ERROR_STEP if the stages cannot be solved; KT_ERROR_UNSUPPORTED if a hard contact, stop or slack rope
 * closes within the step, or its reaction begins to pull, or friction sticks (joint_friction with stick): take a
 * kt_simulation, which follows these events; as kt_acceleration_evaluate and
 * kt_state_project, and of implicit methods kt_acceleration_derivatives. Outputs are then untouched. Cost: as many
 * evaluations as the method has stages (one less with fsal), and the projection; of implicit ones a Jacobian and some
 * four evaluations for each solved stage, of rodas5p one Jacobian. */
KT_API KT_CHECKED kt_status kt_step_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                             const kt_step *step, const double *q, const double *v, double *next_q,
                                             double *next_v, kt_error *error);

/* Takes the step, and computes A (2 nv x 2 nv) and B (2 nv x nv), either of which may be NULL, as may next_q and
 * next_v. Exact to rounding, with the library's effects in closed form; of a caller's own effects that give no
 * derivatives see kt_acceleration_derivatives. A step in which a hard contact, stop or slack rope closes, or in which its
 * reaction begins to pull, holds an event, whose impulse and time they would leave out: KT_ERROR_UNSUPPORTED, of the
 * adjoint and of gradients over many steps, too. Errors: as kt_step_evaluate and kt_acceleration_derivatives:
 * KT_ERROR_SINGULAR next to a singular position of the loops, at a stage or after the step, where rounding leaves the
 * derivatives uncertain by more than 1e-3 of the largest. Outputs are then untouched. Cost: the derivatives of the
 * accelerations at each stage, and 6 nv^3 multiplications at most for each; of implicit methods solutions with dense
 * factors besides, and of rodas5p 40 Jacobians. Of the governor, over a step of a simulation: implicit-euler 1.4,
 * radau5 2.3 (meson test plan/implicit). */
KT_API KT_CHECKED kt_status kt_step_derivatives(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                const kt_step *step, const double *q, const double *v, double *next_q,
                                                double *next_v, double *A, double *B, kt_error *error);

/* Returns the number of bytes that kt_step_parameter_derivatives needs: those of a step, and a copy of the model. */
KT_API size_t kt_step_parameter_work_size(const kt_model *model, const kt_method *method);

/* Takes the step, and computes C (2 nv x parameter->count), its derivatives by the numbers of a parameter at their
 * present values (kt_parameter_find, kt_parameter_get): of gravity, masses, coms, inertias, armature exact to rounding;
 * of effects by differences over 1/1024 of a number, or 1/1024 of its unit at 0: exact to some 1e-12 away from kinks.
 * The model may be a compiled one or a copy; neither it nor the parameter's numbers change. inertia has the six
 * independent entries; masses and inertias change with com constant. A function of time must be constant or set by
 * kt_parameter_set: others have not the numbers of a parameter. Over many steps dx/dp follows S+ = A S + C. Errors: as
 * kt_step_derivatives; KT_ERROR_ARGUMENT for hold, which is no number, and for other functions of time. C is then
 * untouched. Cost: B of a step, and two inverse dynamics for each number at each stage, four of effects and loops. */
KT_API KT_CHECKED kt_status kt_step_parameter_derivatives(const kt_model *model, kt_data *data, void *work,
                                                          size_t work_size, const kt_step *step,
                                                          const kt_parameter *parameter, const double *q,
                                                          const double *v, double *C, kt_error *error);

/* Applies the transposed derivatives of a step, without forming them: a gradient by_next (2 nv) with respect to the
 * state after the step becomes those with respect to the state before it, by_state = A' by_next (2 nv), and to tau,
 * by_tau = B' by_next (nv); either may be NULL. Errors and work as kt_step_derivatives, but that next to a singular
 * position the uncertainty is compared with accelerations, and not with the derivatives themselves. Cost, with effects
 * in joints alone: at each stage an evaluation, the response w to mu (M w = mu + J' pi, J w = 0), a sweep for the gradient of w .
 * inverse dynamics, and with loops the multipliers and the gradient of one sum of the equations, O(n) in all; the
 * projection likewise. With effects between bodies and a caller's own, and of implicit methods, the derivatives at each
 * stage; of rodas5p A and B are formed. */
KT_API KT_CHECKED kt_status kt_step_adjoint(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                            const kt_step *step, const double *q, const double *v,
                                            const double *by_next, double *by_state, double *by_tau, kt_error *error);

/* ---- through events ---------------------------------------------------------------------------------------------- */

/* Returns the number of bytes of work memory of kt_motion_derivatives; 0 for NULL. Some 16 (2 nv)(3 nv) bytes,
 * kt_step_work_size, a checkpoint and data. */
KT_API size_t kt_motion_work_size(const kt_simulation *simulation);

/* Advances the simulation to t_end, as kt_simulation_advance does and with its bits, and computes how the state there
 * changes with the present one, A (2 nv x 2 nv), and with joint forces that are added to those of the simulation over the
 * whole interval, B (2 nv x nv); either may be NULL. Models with own states have 2 nv + m numbers, as of a step. A and B are
 * products of those of the steps, and at events of saltation matrices: of impacts, of contacts, stops and ropes that
 * close and open, of joint friction that comes to rest or begins to slip, and of actions that say that they are repeatable
 * (kt_event). The derivatives of the steps are exact; at an event those of the motion are, so that A and B agree with
 * differences of the simulation to the error of its steps; what an event does is differenced, to some 1e-10 of its size. If
 * an event stops the motion, A and B are those of the state at that time. Of methods whose steps depend on earlier ones
 * those of radau5 over the same steps are taken; of bdf2 and two-step, those of steps that begin anew. Errors: as
 * kt_simulation_advance and kt_step_derivatives; KT_ERROR_UNSUPPORTED where the action of an event is not repeatable, while
 * a contact slips, and for equations of the caller's; KT_ERROR_SINGULAR at an event that has no derivative: its value
 * touches zero and does not cross it, two happen at the same instant, or neighbouring motions come out of it with other
 * contacts closed. A and B are then untouched, and the simulation is at that time; the event takes effect as it goes on.
 * Cost: kt_step_derivatives of every step, and at an event twelve evaluations of it for each column. */
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
    int checkpoints;         /* steps whose start the work memory holds; 0, or more than steps: all */
    const double *x;         /* own states at the start (kt_own_state_count); NULL: those in the data */
} kt_rollout;

/* A point of the motion at which the cost is asked for. */
typedef struct kt_cost_point {
    int step;            /* 0 .. steps: the state before this step; steps: the last state */
    double t;            /* s */
    const double *q, *v; /* state */
    const double *tau;   /* nv, held during this step; NULL: none, and at the last state */
    const double *x;     /* own states (kt_own_state_count); NULL: none */
} kt_cost_point;

/* Computes the cost of a point: writes it to *value, which is 0 on entry, and where they are not NULL its gradients
 * with respect to the state (by_state: 2 nv, xi and dv, and then those of own states) and to tau (by_tau: nv), all 0 on entry. The scalar is the sum
 * of the values of the points 0 .. steps. Returns 0, or another number to stop. It may be called more than once for a
 * point. */
typedef int kt_cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user);

/* Returns the number of bytes of work memory, aligned to KT_ALIGNMENT: that of a step, with s stages some 8 (2 nq +
 * (2 + s) nv) for each checkpoint, and 8 nv for each step; 0 if there is no step or none that has derivatives, or checkpoints are negative. */
KT_API size_t kt_rollout_work_size(const kt_model *model, const kt_rollout *rollout);

/* Computes a sum of costs over a motion from q, v and the own states rollout->x, its gradient by_start (2 nv, and one
 * number for each own state) with respect to the state at the start, and by_inputs (nv x steps) with respect to all inputs; either may be NULL. The motion is run once, states at the
 * start of steps and the accelerations of these steps are kept as checkpoints, and the adjoints run backwards from the
 * end; what is not kept is computed again from the last checkpoint before it. With c checkpoints each step is run r
 * times at most, where (c + r)! / (c! r!) reaches the number of steps: with sqrt(2 steps) checkpoints twice, and once
 * more for its adjoint. Cost whatever the number of inputs: with a checkpoint for every step, some 3 to 4 runs of the
 * motion (see kt_step_adjoint). Errors: as kt_step_adjoint; KT_ERROR_CALLBACK if the cost stops; KT_ERROR_NOT_FINITE.
 * Outputs are then untouched. */
KT_API KT_CHECKED kt_status kt_rollout_gradient(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                const kt_rollout *rollout, const double *q, const double *v,
                                                double *value, double *by_start, double *by_inputs, kt_cost *cost,
                                                void *user, kt_error *error);

/* ---- many motions at once ---------------------------------------------------------------------------------------- */

/* A motion, and what its gradient is written to: as of kt_rollout_gradient. Clear the struct and fill in what there is. */
typedef struct kt_rollout_task {
    kt_rollout rollout;           /* with inputs of its own */
    const kt_model *model;        /* with parameters of its own: a copy of the model; NULL: the model of the call */
    const double *q, *v;          /* state at the start; v NULL: at rest */
    double value;                 /* result */
    double *by_start, *by_inputs; /* results, or NULL */
    void *user;                   /* passed to the cost */
    kt_status status;             /* result */
    bool in_lanes;                /* result: it was computed together with others */
} kt_rollout_task;

/* Returns how many motions of a model are computed at once, a motion a lane of the processor's vectors: 8 with x86-64-v4, 4
 * with v3, else 2; 1 where each is computed by itself, and *why (may be NULL) tells the reason, else NULL. Together are
 * computed trees, in space and in the plane, whose effects act in joints and are neither by formulas nor the caller's, by
 * explicit methods. */
KT_API size_t kt_rollout_width(const kt_model *model, const kt_rollout *rollout, const char **why);

/* Returns the number of bytes of work memory of kt_rollout_gradients, aligned to KT_ALIGNMENT: kt_rollout_width times the
 * checkpoints and inputs of one motion, or if that is more, kt_rollout_work_size; 0 as this. It does not depend on the
 * number of motions. */
KT_API size_t kt_rollout_gradients_work_size(const kt_model *model, const kt_rollout *rollout);

/* Computes the gradients of `count` motions: value, by_start and by_inputs of each are those of kt_rollout_gradient, to the
 * bit, whatever the other motions are, but for a library whose lanes are fused (kt_batch_is_fused). Groups of
 * kt_rollout_width tasks, as they follow each other, are computed together where they have the same method and the same
 * numbers of steps and checkpoints, and their models differ in nothing but gravity, masses, centres of mass, inertias and
 * lengths; times, lengths of steps, inputs and costs are each task's own. The others are computed one after the other, as are all
 * if work_size is less than kt_rollout_gradients_work_size, and at least kt_rollout_work_size; task->in_lanes tells it. The cost is called for the motions of a group in turns; for a motion that fails
 * in lanes from its start again. A motion that fails fails alone, with its status, and its outputs stay as they were.
 * Errors: that of the first motion that failed, as of kt_rollout_gradient. Cost: `bench/run batch`. */
KT_API KT_CHECKED kt_status kt_rollout_gradients(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 kt_rollout_task *tasks, size_t count, kt_cost *cost, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
