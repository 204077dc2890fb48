/* SUNDIALS as a user of Kinetree writes it: CVODE, ARKODE and IDA call the right-hand side of equations.h.
 *
 *     cvode-adams   CVODE, Adams-Moulton to order 12, fixed-point iteration
 *     cvode-bdf     CVODE, BDF to order 5, Newton with a dense Jacobian by differences; its projection closes loops
 *     erk5, erk8    ARKODE ERKStep, its defaults of order 5 and 8; a function after each step closes loops
 *     dirk5         ARKODE ARKStep, implicit, its default of order 5, Newton likewise
 *     ida           IDA, BDF on y' - f(t, y) = 0, Newton likewise
 *
 * A state may leave the loops during a run of cvode-adams and ida, which have no place for a projection. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "equations.h"

#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <cvode/cvode_proj.h>
#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <string.h>
#include <sundials/sundials_version.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

/* Before version 7 a context has a pointer in place of a communicator. */
#if SUNDIALS_VERSION_MAJOR >= 7
#define NO_COMMUNICATOR SUN_COMM_NULL
#else
#define NO_COMMUNICATOR NULL
#endif

static const long most_steps = 10000000;
const char *const sundials_methods[] = {"cvode-adams", "cvode-bdf", "erk5", "erk8", "dirk5", "ida", NULL};

/* The objects of SUNDIALS that all solvers use. sundials_run releases them. */
typedef struct session {
    equations *e;
    double tolerance, end;
    int records;           /* intervals up to the end */
    solver_output *output; /* NULL: none */
    void *user;
    SUNContext context;
    N_Vector y, rate;
    SUNMatrix matrix;
    SUNLinearSolver linear;
    SUNNonlinearSolver fixed_point;
} session;

const char *sundials_version(void) {
    static char text[32];
    return SUNDIALSGetVersion(text, sizeof text) == 0 ? text : "unknown";
}

static int rate_of(sunrealtype t, N_Vector y, N_Vector dydt, void *user) {
    session *s = user;
    return equations_rate(s->e, t, N_VGetArrayPointer(y), N_VGetArrayPointer(dydt));
}

static int residual_of(sunrealtype t, N_Vector y, N_Vector dydt, N_Vector residual, void *user) {
    const int failed = rate_of(t, y, residual, user);
    N_VLinearSum(1.0, dydt, -1.0, residual, residual);
    return failed;
}

static int project_step(sunrealtype t, N_Vector y, void *user) {
    session *s = user;
    bool changed = false;
    return equations_project(s->e, t, N_VGetArrayPointer(y), &changed);
}

/* The correction of CVODE's projection: y + correction is on the loops. The error estimate stays as it is. */
static int project_correction(sunrealtype t, N_Vector y, N_Vector correction, sunrealtype epsilon, N_Vector error,
                              void *user) {
    (void)epsilon;
    (void)error;
    N_VScale(1.0, y, correction);
    const int failed = project_step(t, correction, user);
    N_VLinearSum(1.0, correction, -1.0, y, correction);
    return failed;
}

static const char *fault_of(bool good, bool has_ended) {
    return has_ended ? NULL : good ? "the solver gave up" : "the solver could not be set up";
}

/* The end of an interval. */
static double end_of(const session *s, int record) {
    return record == s->records ? s->end : s->end * record / s->records;
}

static bool put_record(const session *s, int record) {
    return s->output == NULL || s->output(s->user, record, N_VGetArrayPointer(s->y));
}

static const char *run_cvode(session *s, bool adams) {
    void *solver = CVodeCreate(adams ? CV_ADAMS : CV_BDF, s->context);
    sunrealtype t = 0.0;
    bool good = solver != NULL && CVodeInit(solver, rate_of, 0.0, s->y) == CV_SUCCESS &&
                CVodeSStolerances(solver, s->tolerance, s->tolerance) == CV_SUCCESS &&
                CVodeSetUserData(solver, s) == CV_SUCCESS && CVodeSetMaxNumSteps(solver, most_steps) == CV_SUCCESS &&
                CVodeSetStopTime(solver, s->end) == CV_SUCCESS;
    if (good && adams)
        good = CVodeSetNonlinearSolver(solver, s->fixed_point) == CV_SUCCESS;
    if (good && !adams)
        good = CVodeSetLinearSolver(solver, s->linear, s->matrix) == CV_SUCCESS &&
               CVodeSetProjFn(solver, project_correction) == CV_SUCCESS &&
               CVodeSetProjErrEst(solver, SUNFALSE) == CV_SUCCESS;
    bool runs = good;
    for (int k = 1; k <= s->records && runs; k++)
        runs = CVode(solver, end_of(s, k), s->y, &t, CV_NORMAL) >= 0 && put_record(s, k);
    CVodeFree(&solver);
    return fault_of(good, runs);
}

static const char *run_erk(session *s, int order) {
    void *solver = ERKStepCreate(rate_of, 0.0, s->y, s->context);
    sunrealtype t = 0.0;
    const bool good = solver != NULL && ERKStepSetOrder(solver, order) == ARK_SUCCESS &&
                      ERKStepSStolerances(solver, s->tolerance, s->tolerance) == ARK_SUCCESS &&
                      ERKStepSetUserData(solver, s) == ARK_SUCCESS &&
                      ERKStepSetMaxNumSteps(solver, most_steps) == ARK_SUCCESS &&
                      ERKStepSetPostprocessStepFn(solver, project_step) == ARK_SUCCESS &&
                      ERKStepSetStopTime(solver, s->end) == ARK_SUCCESS;
    bool runs = good;
    for (int k = 1; k <= s->records && runs; k++)
        runs = ERKStepEvolve(solver, end_of(s, k), s->y, &t, ARK_NORMAL) >= 0 && put_record(s, k);
    ERKStepFree(&solver);
    return fault_of(good, runs);
}

static const char *run_dirk(session *s) {
    void *solver = ARKStepCreate(NULL, rate_of, 0.0, s->y, s->context);
    sunrealtype t = 0.0;
    const bool good = solver != NULL && ARKStepSetOrder(solver, 5) == ARK_SUCCESS &&
                      ARKStepSStolerances(solver, s->tolerance, s->tolerance) == ARK_SUCCESS &&
                      ARKStepSetUserData(solver, s) == ARK_SUCCESS &&
                      ARKStepSetMaxNumSteps(solver, most_steps) == ARK_SUCCESS &&
                      ARKStepSetLinearSolver(solver, s->linear, s->matrix) == ARK_SUCCESS &&
                      ARKStepSetPostprocessStepFn(solver, project_step) == ARK_SUCCESS &&
                      ARKStepSetStopTime(solver, s->end) == ARK_SUCCESS;
    bool runs = good;
    for (int k = 1; k <= s->records && runs; k++)
        runs = ARKStepEvolve(solver, end_of(s, k), s->y, &t, ARK_NORMAL) >= 0 && put_record(s, k);
    ARKStepFree(&solver);
    return fault_of(good, runs);
}

static const char *run_ida(session *s) {
    void *solver = IDACreate(s->context);
    sunrealtype t = 0.0;
    const bool good = solver != NULL && rate_of(0.0, s->y, s->rate, s) == 0 &&
                      IDAInit(solver, residual_of, 0.0, s->y, s->rate) == IDA_SUCCESS &&
                      IDASStolerances(solver, s->tolerance, s->tolerance) == IDA_SUCCESS &&
                      IDASetUserData(solver, s) == IDA_SUCCESS &&
                      IDASetMaxNumSteps(solver, most_steps) == IDA_SUCCESS &&
                      IDASetLinearSolver(solver, s->linear, s->matrix) == IDA_SUCCESS &&
                      IDASetStopTime(solver, s->end) == IDA_SUCCESS;
    bool runs = good;
    for (int k = 1; k <= s->records && runs; k++)
        runs = IDASolve(solver, end_of(s, k), &t, s->y, s->rate, IDA_NORMAL) >= 0 && put_record(s, k);
    IDAFree(&solver);
    return fault_of(good, runs);
}

static const char *run_method(session *s, const char *method) {
    if (strncmp(method, "cvode", 5) == 0)
        return run_cvode(s, strcmp(method, "cvode-adams") == 0);
    if (strncmp(method, "erk", 3) == 0)
        return run_erk(s, method[3] - '0');
    return strcmp(method, "ida") == 0 ? run_ida(s) : run_dirk(s);
}

/* The whole life of a session. y (NULL: not wanted) receives the state at the end. */
static const char *run_session(session *s, const char *method, double *y) {
    const sunindextype n = (sunindextype)s->e->n;
    const char *failed = "no memory";
    if (SUNContext_Create(NO_COMMUNICATOR, &s->context) != 0)
        return failed;
    s->y = N_VNew_Serial(n, s->context);
    s->rate = N_VNew_Serial(n, s->context);
    s->matrix = SUNDenseMatrix(n, n, s->context);
    s->linear = s->y && s->matrix ? SUNLinSol_Dense(s->y, s->matrix, s->context) : NULL;
    s->fixed_point = s->y ? SUNNonlinSol_FixedPoint(s->y, 0, s->context) : NULL;
    if (s->rate && s->linear && s->fixed_point) {
        memcpy(N_VGetArrayPointer(s->y), s->e->start, s->e->n * sizeof *y);
        failed = run_method(s, method);
        if (y != NULL)
            memcpy(y, N_VGetArrayPointer(s->y), s->e->n * sizeof *y);
    }
    SUNNonlinSolFree(s->fixed_point);
    SUNLinSolFree(s->linear);
    SUNMatDestroy(s->matrix);
    N_VDestroy(s->rate);
    N_VDestroy(s->y);
    SUNContext_Free(&s->context);
    return failed;
}

const char *sundials_run(equations *e, const char *method, double tolerance, double end, double *y) {
    session s = {.e = e, .tolerance = tolerance, .end = end, .records = 1};
    return run_session(&s, method, y);
}

const char *sundials_records(equations *e, const char *method, double tolerance, double end, int records,
                             solver_output *output, void *user) {
    session s = {.e = e, .tolerance = tolerance, .end = end, .records = records, .output = output, .user = user};
    return run_session(&s, method, NULL);
}
