/* The C interface of FMI 3.0: model exchange and co-simulation. The names of the functions are those of the standard.
 * Variables are numbers of 64 bits (reference.h); functions for other types report an error if they get any.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "exchange.h"
#include "instance.h"
#include "present.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- messages ---------------------------------------------------------------------------------------------------- */

kt_fmi_status kt_fmu_report(kt_fmu *fmu, const char *format, ...) {
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (fmu != NULL && fmu->log != NULL)
        fmu->log(fmu->environment, KT_FMI_ERROR, "error", text);
    return KT_FMI_ERROR;
}

kt_fmi_status kt_fmu_report_status(kt_fmu *fmu, kt_status status, const kt_error *error) {
    if (status == KT_OK)
        return KT_FMI_OK;
    return kt_fmu_report(fmu, "%s%s%s", error->where, error->where[0] != '\0' ? ": " : "", error->message);
}

static bool is_in(const kt_fmu *fmu, kt_fmu_phase a, kt_fmu_phase b) { return fmu->phase == a || fmu->phase == b; }

/* ---- instances --------------------------------------------------------------------------------------------------- */

typedef struct kt_fmu_request {
    const char *token, *folder;
    void *environment;
    kt_fmi_log *log;
    kt_fmi_update *update;
    bool is_exchange, has_event_mode, returns_early;
} kt_fmu_request;

static kt_fmu *instantiate_fmu(const kt_fmu_request *request) {
    kt_error error = {0};
    kt_fmu *fmu = calloc(1, sizeof *fmu);
    if (fmu == NULL)
        return NULL;
    fmu->log = request->log;
    fmu->environment = request->environment;
    fmu->is_exchange = request->is_exchange;
    fmu->has_event_mode = request->has_event_mode;
    fmu->returns_early = request->returns_early;
    fmu->update = request->update;
    kt_status status = kt_fmu_open(fmu, request->folder != NULL ? request->folder : "", &error);
    if (status == KT_OK && (request->token == NULL || strcmp(request->token, fmu->token.text) != 0))
        status = kt_error_set(&error, KT_ERROR_ARGUMENT, NULL,
                              "the instantiation token is not that of the resources; export the FMU again");
    if (status == KT_OK)
        status = kt_fmu_start(fmu, &error);
    const char *reason =
        status == KT_OK && fmu->is_exchange ? kt_fmu_reason_against_exchange(&fmu->scene, fmu->model) : NULL;
    if (reason != NULL)
        status = kt_error_set(&error, KT_ERROR_UNSUPPORTED, NULL, "%s: use co-simulation", reason);
    if (status == KT_OK)
        return fmu;
    (void)kt_fmu_report_status(fmu, status, &error);
    kt_fmu_close(fmu);
    free(fmu);
    return NULL;
}

KT_FMI(void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *folder, bool visible,
                                          bool logging, void *environment, kt_fmi_log *log)) {
    (void)name, (void)visible, (void)logging;
    return instantiate_fmu(&(kt_fmu_request){token, folder, environment, log, NULL, true, false, false});
}

KT_FMI(void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder, bool visible,
                                         bool logging, bool event_mode, bool early_return,
                                         const kt_fmi_reference *required, size_t required_count, void *environment,
                                         kt_fmi_log *log, kt_fmi_update *update)) {
    (void)name, (void)visible, (void)logging;
    (void)required, (void)required_count; /* all variables are there in updates */
    return instantiate_fmu(&(kt_fmu_request){token, folder, environment, log, update, false, event_mode, early_return});
}

KT_FMI(void fmi3FreeInstance(void *instance)) {
    if (instance != NULL)
        kt_fmu_close(instance);
    free(instance);
}

KT_FMI(const char *fmi3GetVersion(void)) { return "3.0"; }

KT_FMI(kt_fmi_status fmi3SetDebugLogging(void *instance, bool logging, size_t count, const char *const *names)) {
    (void)logging, (void)count, (void)names; /* errors are always reported, and there is nothing else */
    KT_FMU_TAKE(instance);
    return KT_FMI_OK;
}

/* ---- phases ------------------------------------------------------------------------------------------------------ */

kt_fmi_status kt_fmu_settle(kt_fmu *fmu) {
    kt_error error = {0};
    if (!fmu->is_stale)
        return KT_FMI_OK;
    const double time = fmu->time;
    kt_status status = kt_fmu_compile(fmu, &error);
    fmu->time = time;
    return kt_fmu_report_status(fmu, status, &error);
}

/* Enters a phase, unless the parameters that were given are wrong. They can be set again then. */
static kt_fmi_status settle_into(kt_fmu *fmu, kt_fmu_phase phase) {
    const kt_fmi_status status = kt_fmu_settle(fmu);
    if (status == KT_FMI_OK)
        fmu->phase = phase;
    return status;
}

kt_fmi_status kt_fmu_set_start(kt_fmu *fmu, double start) {
    KT_FMU_REQUIRE(fmu->phase == KT_FMU_INSTANTIATED, "the initialization must follow the instantiation");
    KT_FMU_REQUIRE(isfinite(start), "the start time is not finite");
    fmu->is_stale |= fmu->start != start;
    fmu->start = fmu->time = start;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3EnterInitializationMode(void *instance, bool has_tolerance, double tolerance, double start,
                                                 bool has_stop, double stop)) {
    KT_FMU_TAKE(instance);
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    const kt_fmi_status status = kt_fmu_set_start(fmu, start);
    return status == KT_FMI_OK ? settle_into(fmu, KT_FMU_INITIALIZATION) : status;
}

KT_FMI(kt_fmi_status fmi3ExitInitializationMode(void *instance)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE(fmu->phase == KT_FMU_INITIALIZATION, "the instance is not in initialization mode");
    return settle_into(fmu, fmu->is_exchange || fmu->has_event_mode ? KT_FMU_EVENT : KT_FMU_STEP);
}

KT_FMI(kt_fmi_status fmi3EnterEventMode(void *instance)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE(fmu->phase == KT_FMU_CONTINUOUS || (fmu->has_event_mode && fmu->phase == KT_FMU_STEP),
                   "event mode follows continuous-time mode, or step mode if the importer uses event mode");
    fmu->phase = KT_FMU_EVENT;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3EnterContinuousTimeMode(void *instance)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE(fmu->is_exchange && fmu->phase == KT_FMU_EVENT, "continuous-time mode follows event mode");
    fmu->phase = KT_FMU_CONTINUOUS;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3EnterStepMode(void *instance)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE(fmu->has_event_mode && fmu->phase == KT_FMU_EVENT, "step mode follows event mode of co-simulation");
    fmu->phase = KT_FMU_STEP;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3Terminate(void *instance)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE(fmu->phase >= KT_FMU_EVENT && fmu->phase < KT_FMU_TERMINATED,
                   "an instance can be terminated between its initialization and its end, outside of steps");
    fmu->phase = KT_FMU_TERMINATED;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3Reset(void *instance)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    KT_FMU_REQUIRE_NO_UPDATE;
    for (int i = 0; i < fmu->parameter_count; i++)
        fmu->is_given[i] = false;
    kt_fmu_copy_tunables(fmu, fmu->tunables.standard, fmu->tunables.wanted);
    memset(fmu->torque, 0, (size_t)fmu->nv * sizeof *fmu->torque);
    kt_fmu_reset_signals(fmu);
    fmu->phase = KT_FMU_INSTANTIATED;
    fmu->start = 0.0;
    return kt_fmu_report_status(fmu, kt_fmu_compile(fmu, &error), &error);
}

/* ---- variables --------------------------------------------------------------------------------------------------- */

/* Returns the index of a reference of a kind with `count` members; -1: it is of another kind. */
static int reference_index_of(kt_fmi_reference reference, kt_fmi_reference first, int count) {
    return reference >= first && reference - first < (kt_fmi_reference)count ? (int)(reference - first) : -1;
}

/* Returns a number of a signal; NULL: the reference is another one. */
static double *signal_of(const kt_fmu *fmu, kt_fmi_reference reference) {
    const int i = reference_index_of(reference, KT_FMU_SIGNAL, KT_FMU_SIGNAL_MOST * fmu->signals.count);
    return i >= 0 ? kt_fmu_signal_at(fmu, i) : NULL;
}

static kt_fmi_status get_value(kt_fmu *fmu, kt_fmi_reference reference, double *value) {
    kt_error error = {0};
    kt_fmi_status status = KT_FMI_OK;
    int i;
    if (reference == 0) {
        *value = fmu->time;
    } else if ((i = reference_index_of(reference, 0, (int)fmu->columns.count)) >= 0) {
        status = kt_fmu_report_status(fmu, kt_fmu_evaluate(fmu, &error), &error);
        if (status == KT_FMI_OK)
            *value = fmu->values[i];
    } else if ((i = reference_index_of(reference, KT_FMU_INPUT, fmu->nv)) >= 0) {
        *value = fmu->torque[i];
    } else if (signal_of(fmu, reference) != NULL) {
        *value = *signal_of(fmu, reference);
    } else if ((i = reference_index_of(reference, KT_FMU_PARAMETER, fmu->parameter_count)) >= 0) {
        *value = fmu->scene.parameters[i].value;
    } else if ((i = reference_index_of(reference, KT_FMU_STATE, kt_fmu_size(fmu))) >= 0) {
        *value = kt_fmu_state(fmu)[i];
    } else if ((i = reference_index_of(reference, KT_FMU_DERIVATIVE, kt_fmu_size(fmu))) >= 0) {
        status = kt_fmu_report_status(fmu, kt_fmu_derive(fmu, &error), &error);
        if (status == KT_FMI_OK)
            *value = fmu->rates[i];
    } else if ((i = reference_index_of(reference, KT_FMU_INDICATOR, kt_scene_event_room(&fmu->scene))) >= 0) {
        status = kt_fmu_report_status(fmu, kt_fmu_indicate(fmu, i, value, &error), &error);
    } else {
        return kt_fmu_report(fmu, "there is no variable with the reference %u", (unsigned)reference);
    }
    return status;
}

KT_FMI(kt_fmi_status fmi3GetFloat64(void *instance, const kt_fmi_reference *references, size_t count, double *values,
                                    size_t value_count)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE(count == value_count, "%zu references go with %zu values", count, value_count);
    kt_fmi_status status = kt_fmu_settle(fmu);
    for (size_t i = 0; i < count && status == KT_FMI_OK; i++)
        status = get_value(fmu, references[i], &values[i]);
    return status;
}

static bool is_before_run(const kt_fmu *fmu) { return is_in(fmu, KT_FMU_INSTANTIATED, KT_FMU_INITIALIZATION); }

/* Before the run, the scene begins with the value. Later the value acts at the next evaluation or step. */
static void set_signal(kt_fmu *fmu, double *signal, double value) {
    fmu->is_stale |= is_before_run(fmu) && *signal != value;
    *signal = value;
    fmu->signals.are_set = false;
    kt_fmu_change(fmu);
}

/* Parameters that are set to their present values stay as they are, and follow others. */
static kt_fmi_status set_parameter(kt_fmu *fmu, int i, double value) {
    const int k = kt_fmu_tunable_at(fmu, i);
    const double now = k >= 0             ? fmu->tunables.wanted[k]
                       : fmu->is_given[i] ? fmu->given[i]
                                          : fmu->scene.parameters[i].value;
    const char *name = fmu->scene.parameters[i].name;
    if (value == now)
        return KT_FMI_OK;
    KT_FMU_REQUIRE(!kt_fmu_role_follows(fmu->roles[i]), "the parameter %s follows from others", name);
    KT_FMU_REQUIRE(k >= 0 || is_before_run(fmu),
                   "the parameter %s is fixed: it can be set before the end of the initialization", name);
    KT_FMU_REQUIRE(is_before_run(fmu) || is_in(fmu, KT_FMU_EVENT, KT_FMU_STEP),
                   "the parameter %s is tunable: it can be set in event mode, or between steps", name);
    if (k >= 0) {
        fmu->tunables.wanted[k] = value;
    } else {
        fmu->is_given[i] = true;
        fmu->given[i] = value;
    }
    fmu->is_stale |= is_before_run(fmu);
    return KT_FMI_OK;
}

static kt_fmi_status set_referenced_value(kt_fmu *fmu, kt_fmi_reference reference, double value) {
    int i;
    KT_FMU_REQUIRE(isfinite(value), "the value of the variable %u is not finite", (unsigned)reference);
    KT_FMU_REQUIRE_NO_UPDATE;
    KT_FMU_REQUIRE(fmu->phase != KT_FMU_TERMINATED, "a terminated instance only reads variables");
    if ((i = reference_index_of(reference, KT_FMU_INPUT, fmu->nv)) >= 0) {
        if (fmu->torque[i] != value)
            kt_fmu_change(fmu);
        fmu->torque[i] = value;
        return KT_FMI_OK;
    }
    if (signal_of(fmu, reference) != NULL) {
        set_signal(fmu, signal_of(fmu, reference), value);
        return KT_FMI_OK;
    }
    i = reference_index_of(reference, KT_FMU_PARAMETER, fmu->parameter_count);
    KT_FMU_REQUIRE(i >= 0, "the variable %u cannot be set", (unsigned)reference);
    return set_parameter(fmu, i, value);
}

KT_FMI(kt_fmi_status fmi3SetFloat64(void *instance, const kt_fmi_reference *references, size_t count,
                                    const double *values, size_t value_count)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    KT_FMU_REQUIRE(count == value_count, "%zu references go with %zu values", count, value_count);
    kt_fmi_status status = KT_FMI_OK;
    for (size_t i = 0; i < count && status == KT_FMI_OK; i++)
        status = set_referenced_value(fmu, references[i], values[i]);
    if (is_before_run(fmu))
        return status;
    if (status == KT_FMI_OK)
        return kt_fmu_report_status(fmu, kt_fmu_tune(fmu, true, &error), &error);
    kt_fmu_copy_tunables(fmu, fmu->tunables.values, fmu->tunables.wanted);
    return status;
}

/* ---- co-simulation ----------------------------------------------------------------------------------------------- */

/* Whether a step must be rejected, after a message. */
static kt_fmi_status check_requested_step(kt_fmu *fmu, double from, double step) {
    KT_FMU_REQUIRE(fmu->phase == KT_FMU_STEP, "a step needs step mode");
    KT_FMU_REQUIRE(!fmu->is_over, "an event of the scene has ended the simulation at %g s", fmu->time);
    KT_FMU_REQUIRE(isfinite(step) && step > 0.0, "a step of %g s is not finite and above zero; steps go forwards",
                   step);
    KT_FMU_REQUIRE(fmu->time + step > fmu->time, "a step of %g s does not change the time, %.17g s; take a longer one",
                   step, fmu->time);
    KT_FMU_REQUIRE(fabs(from - fmu->time) <= 1e-6 * step, "the step begins at %.17g, but the instance is at %.17g",
                   from, fmu->time);
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3DoStep(void *instance, double from, double step, bool is_final, bool *needs_event,
                                bool *terminate, bool *early, double *last)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    (void)is_final;
    *needs_event = *terminate = *early = false;
    *last = fmu->time;
    kt_fmi_status result = check_requested_step(fmu, from, step);
    if (result != KT_FMI_OK)
        return result;
    const kt_status status = kt_fmu_advance(fmu, step, needs_event, early, &error);
    *last = fmu->time;
    *terminate = fmu->is_over;
    return kt_fmu_report_status(fmu, status, &error);
}

/* ---- model exchange ---------------------------------------------------------------------------------------------- */

/* Rejects another number of states than there are. */
#define KT_FMU_REQUIRE_STATES                                                                                          \
    KT_FMU_REQUIRE(count == (size_t)kt_fmu_size(fmu), "there are %d continuous states, not %zu", kt_fmu_size(fmu),     \
                   count)

/* Rejects a time or states that the importer sets before or after its run. */
#define KT_FMU_REQUIRE_RUN                                                                                             \
    KT_FMU_REQUIRE(is_in(fmu, KT_FMU_EVENT, KT_FMU_CONTINUOUS) && fmu->is_exchange,                                    \
                   "time and states are set in event mode or continuous-time mode of model exchange")

KT_FMI(kt_fmi_status fmi3SetTime(void *instance, double time)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE_RUN;
    KT_FMU_REQUIRE(isfinite(time), "the time %g cannot be set", time);
    fmu->time = time;
    kt_fmu_change(fmu);
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3SetContinuousStates(void *instance, const double *states, size_t count)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE_RUN;
    KT_FMU_REQUIRE_STATES;
    memcpy(fmu->y, states, count * sizeof *states);
    kt_fmu_change(fmu);
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3GetContinuousStates(void *instance, double *states, size_t count)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE_STATES;
    const kt_fmi_status status = kt_fmu_settle(fmu);
    if (status == KT_FMI_OK)
        memcpy(states, kt_fmu_state(fmu), count * sizeof *states);
    return status;
}

KT_FMI(kt_fmi_status fmi3GetContinuousStateDerivatives(void *instance, double *derivatives, size_t count)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    KT_FMU_REQUIRE_STATES;
    kt_fmi_status status = kt_fmu_settle(fmu);
    if (status == KT_FMI_OK)
        status = kt_fmu_report_status(fmu, kt_fmu_derive(fmu, &error), &error);
    if (status == KT_FMI_OK)
        memcpy(derivatives, fmu->rates, count * sizeof *derivatives);
    return status;
}

KT_FMI(kt_fmi_status fmi3GetNominalsOfContinuousStates(void *instance, double *nominals, size_t count)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE_STATES;
    for (size_t i = 0; i < count; i++)
        nominals[i] = 1.0;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3GetNumberOfContinuousStates(void *instance, size_t *count)) {
    KT_FMU_TAKE(instance);
    *count = (size_t)kt_fmu_size(fmu);
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3GetNumberOfEventIndicators(void *instance, size_t *count)) {
    KT_FMU_TAKE(instance);
    *count = (size_t)fmu->event_count;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3GetEventIndicators(void *instance, double *indicators, size_t count)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    KT_FMU_REQUIRE(count == (size_t)fmu->event_count, "there are %d event indicators, not %zu", fmu->event_count,
                   count);
    kt_fmi_status status = kt_fmu_settle(fmu);
    for (size_t k = 0; k < count && status == KT_FMI_OK; k++)
        status = kt_fmu_report_status(fmu, kt_fmu_indicate(fmu, (int)k, &indicators[k], &error), &error);
    return status;
}

/* Event mode is requested if the state has left the loops. */
KT_FMI(kt_fmi_status fmi3CompletedIntegratorStep(void *instance, bool is_final, bool *enter_event, bool *terminate)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    (void)is_final;
    *enter_event = *terminate = false;
    KT_FMU_REQUIRE(fmu->phase == KT_FMU_CONTINUOUS, "the instance is not in continuous-time mode");
    return kt_fmu_report_status(fmu, kt_fmu_project(fmu, enter_event, &error), &error);
}

/* Events in co-simulation. The next ones are located in steps. */
static kt_fmi_status update_simulation(kt_fmu *fmu, bool *terminate, bool *values_changed) {
    kt_error error = {0};
    const size_t size = (size_t)kt_fmu_size(fmu) * sizeof *fmu->moved;
    memcpy(fmu->moved, kt_fmu_state(fmu), size);
    kt_status status = kt_fmu_fire(fmu, &error);
    if (status == KT_OK)
        status = kt_fmu_take_signals(fmu, &error);
    *values_changed = memcmp(fmu->moved, kt_fmu_state(fmu), size) != 0;
    *terminate = fmu->is_over;
    return kt_fmu_report_status(fmu, status, &error);
}

KT_FMI(kt_fmi_status fmi3UpdateDiscreteStates(void *instance, bool *need_update, bool *terminate,
                                              bool *nominals_changed, bool *values_changed, bool *has_next,
                                              double *next)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    bool applied = false;
    *need_update = *terminate = *nominals_changed = *values_changed = *has_next = false;
    *next = 0.0;
    KT_FMU_REQUIRE(fmu->phase == KT_FMU_EVENT, "the instance is not in event mode");
    if (!fmu->is_exchange)
        return update_simulation(fmu, terminate, values_changed);
    kt_status status = kt_fmu_project(fmu, values_changed, &error);
    if (*values_changed) {
        memcpy(fmu->y, fmu->moved, (size_t)kt_fmu_size(fmu) * sizeof *fmu->y);
        kt_fmu_change(fmu);
    }
    if (status == KT_OK)
        status = kt_fmu_apply_events(fmu, &applied, terminate, &error);
    *values_changed |= applied;
    fmu->is_over |= *terminate;
    const double jump = fmin(kt_fmu_next_jump(fmu->model, fmu->time), kt_fmu_next_breakpoint(fmu, fmu->time));
    *has_next = jump < HUGE_VAL;
    *next = *has_next ? jump : 0.0;
    return kt_fmu_report_status(fmu, status, &error);
}

KT_FMI(kt_fmi_status fmi3EvaluateDiscreteStates(void *instance)) {
    (void)instance;
    return KT_FMI_OK;
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

static kt_fmi_status add_signal_seed(kt_fmu *fmu, int i, double seed, const kt_fmu_direction *along) {
    KT_FMU_REQUIRE(fmu->is_exchange || !kt_fmu_signal_moves(fmu, i),
                   "in co-simulation the input %u moves the state at once, as loops close again, and there are no "
                   "derivatives by it; use model exchange",
                   (unsigned)(KT_FMU_SIGNAL + i));
    along->w[i] += seed;
    return KT_FMI_OK;
}

/* Adds a seed in a known variable to a direction. */
static kt_fmi_status add_seed(kt_fmu *fmu, kt_fmi_reference known, double seed, const kt_fmu_direction *along) {
    int i;
    KT_FMU_REQUIRE(isfinite(seed), "the seed of the variable %u is not finite", (unsigned)known);
    if ((i = reference_index_of(known, KT_FMU_STATE, kt_fmu_size(fmu))) >= 0)
        along->y[i] += seed;
    else if ((i = reference_index_of(known, KT_FMU_INPUT, fmu->nv)) >= 0)
        along->u[i] += seed;
    else if (signal_of(fmu, known) != NULL)
        return add_signal_seed(fmu, (int)(known - KT_FMU_SIGNAL), seed, along);
    else
        return kt_fmu_report(fmu, "there are derivatives by states and inputs, not by the variable %u",
                             (unsigned)known);
    return KT_FMI_OK;
}

/* The derivatives along a direction: of states, of their rates, and of columns (NULL: not requested). */
typedef struct kt_fmu_results {
    const double *y, *rates, *columns;
} kt_fmu_results;

/* Computes them along a seed in known variables. */
static kt_fmi_status differentiate_along(kt_fmu *fmu, const kt_fmi_reference *knowns, const double *seed, size_t count,
                                         bool has_columns, kt_fmu_results *results) {
    kt_error error = {0};
    kt_fmu_direction along;
    kt_status status = kt_fmu_direction_make(fmu, &along, &error);
    for (size_t k = 0; k < count && status == KT_OK; k++) {
        const kt_fmi_status added = add_seed(fmu, knowns[k], seed[k], &along);
        if (added != KT_FMI_OK)
            return added;
    }
    *results = (kt_fmu_results){.y = along.y};
    if (status == KT_OK)
        status = kt_fmu_rates_along(fmu, &results->rates, &error);
    if (status == KT_OK && has_columns)
        status = kt_fmu_columns_along(fmu, &results->columns, &error);
    return kt_fmu_report_status(fmu, status, &error);
}

/* Returns the derivative of an unknown; NULL: it is a column, and these were not computed, or no such variable. */
static const double *result_of(const kt_fmu *fmu, const kt_fmu_results *results, kt_fmi_reference unknown) {
    int i;
    if ((i = reference_index_of(unknown, KT_FMU_DERIVATIVE, kt_fmu_size(fmu))) >= 0)
        return results->rates + i;
    if ((i = reference_index_of(unknown, KT_FMU_STATE, kt_fmu_size(fmu))) >= 0)
        return results->y + i;
    i = reference_index_of(unknown, 0, (int)fmu->columns.count);
    return i >= 0 && results->columns != NULL ? results->columns + i : NULL;
}

/* Checks unknowns in the present state. *has_columns: whether any of them is a column. */
static kt_fmi_status check_unknowns(kt_fmu *fmu, const kt_fmi_reference *unknowns, size_t count, bool *has_columns) {
    static const double none = 0.0;
    const kt_fmu_results all = {&none, &none, &none};
    const kt_fmi_status status = kt_fmu_settle(fmu);
    for (size_t i = 0; i < count && status == KT_FMI_OK; i++) {
        KT_FMU_REQUIRE(result_of(fmu, &all, unknowns[i]) != NULL,
                       "there are derivatives of outputs, states and their rates, not of the variable %u",
                       (unsigned)unknowns[i]);
        *has_columns |= reference_index_of(unknowns[i], 0, (int)fmu->columns.count) >= 0;
    }
    return status;
}

KT_FMI(kt_fmi_status fmi3GetDirectionalDerivative(void *instance, const kt_fmi_reference *unknowns,
                                                  size_t unknown_count, const kt_fmi_reference *knowns,
                                                  size_t known_count, const double *seed, size_t seed_count,
                                                  double *sensitivity, size_t sensitivity_count)) {
    KT_FMU_TAKE(instance);
    kt_fmu_results results;
    bool has_columns = false;
    KT_FMU_REQUIRE(known_count == seed_count && unknown_count == sensitivity_count,
                   "%zu knowns go with %zu seeds, and %zu unknowns with %zu sensitivities", known_count, seed_count,
                   unknown_count, sensitivity_count);
    kt_fmi_status status = check_unknowns(fmu, unknowns, unknown_count, &has_columns);
    if (status == KT_FMI_OK)
        status = differentiate_along(fmu, knowns, seed, known_count, has_columns, &results);
    for (size_t i = 0; i < unknown_count && status == KT_FMI_OK; i++)
        sensitivity[i] = *result_of(fmu, &results, unknowns[i]);
    return status;
}

/* The product of the seed with the derivatives along each known by itself. The matrices are computed once. */
KT_FMI(kt_fmi_status fmi3GetAdjointDerivative(void *instance, const kt_fmi_reference *unknowns, size_t unknown_count,
                                              const kt_fmi_reference *knowns, size_t known_count, const double *seed,
                                              size_t seed_count, double *sensitivity, size_t sensitivity_count)) {
    KT_FMU_TAKE(instance);
    static const double one = 1.0;
    kt_fmu_results results;
    bool has_columns = false;
    KT_FMU_REQUIRE(unknown_count == seed_count && known_count == sensitivity_count,
                   "%zu unknowns go with %zu seeds, and %zu knowns with %zu sensitivities", unknown_count, seed_count,
                   known_count, sensitivity_count);
    kt_fmi_status status = check_unknowns(fmu, unknowns, unknown_count, &has_columns);
    for (size_t k = 0; k < known_count && status == KT_FMI_OK; k++) {
        status = differentiate_along(fmu, &knowns[k], &one, 1, has_columns, &results);
        double sum = 0.0;
        for (size_t i = 0; i < unknown_count && status == KT_FMI_OK; i++)
            sum += seed[i] != 0.0 ? seed[i] * *result_of(fmu, &results, unknowns[i]) : 0.0;
        sensitivity[k] = sum;
    }
    return status;
}
