/* A simulation in memory: the request, the sizes and the layout of its parts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/options.h"
#include "base/where.h"
#include "compile/compile.h"
#include "contact/moreau.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/gaps.h"
#include "integrator/integrator.h"
#include "kinetree/loop.h"
#include "model/switching.h"
#include "simulation/simulation.h"

#include <math.h>
#include <string.h>

/* ---- the request ------------------------------------------------------------------------------------------------- */

/* Run and options, with defaults in place of NULL, and the values derived from them. */
typedef struct kt_simulation_request {
    kt_run run;
    kt_simulation_options options;
    const kt_method *method;
    kt_method by_rho; /* storage of `method` */
    unsigned record;
} kt_simulation_request;

/* Whether the accelerations are those of the model, computed by the library or by the caller. */
static bool has_model_equations(const kt_simulation_request *settings) {
    return settings->options.acceleration == NULL || settings->options.equals_model;
}

/* Rejects options that cannot be combined with coordinates that move no mass. */
static kt_status reject_massless_options(const kt_model *model, const kt_simulation_options *options, kt_error *error) {
    if (options->acceleration != NULL || options->projection != NULL)
        return kt_massless_reject(model, "acceleration", "equations in place of the engine's do not balance forces",
                                  error);
    return KT_OK;
}

static kt_status check_simulation_options(const kt_simulation_options *options, kt_error *error) {
    if (!kt_is_not_negative(options->switch_gap))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "switch_gap", "%g: must be zero or more", options->switch_gap);
    const bool first = !kt_is_not_negative(options->initial_step);
    if (first || !kt_is_not_negative(options->max_step))
        return kt_error_set(error, KT_ERROR_ARGUMENT, first ? "initial_step" : "max_step", "%g s: must be zero or more",
                            first ? options->initial_step : options->max_step);
    if (options->events < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "events", "%d: must be zero or more", options->events);
    if (options->progress != NULL && options->progress_steps == 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "progress_steps", "0: must be one or more");
    if (options->event_evaluations != 0 && options->event_evaluations < KT_EVENT_EVALUATIONS_LEAST)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "event_evaluations", "%d: must be 0, or %d or more",
                            options->event_evaluations, (int)KT_EVENT_EVALUATIONS_LEAST);
    return kt_record_check(options->record, error);
}

/* Whether contacts are resolved by time steps, always or to bound a step. */
static bool takes_time_steps(const kt_simulation_options *options) {
    return options->contact == KT_CONTACT_STEPS || kt_bounds_steps(options);
}

/* Rejects Poisson's rule, which time steps do not support. */
static kt_status reject_poisson(const kt_model *model, kt_error *error) {
    for (size_t i = 0; i < model->n.loop; i++)
        if (model->loop[i].poisson)
            return kt_error_set(error, KT_ERROR_UNSUPPORTED, "contact",
                                "'%.60s' follows Poisson's rule, and time stepping Newton's; leave `poisson` out, or "
                                "take contact: events without step_evaluations and stall_evaluations",
                                kt_loop_name(model, (int)i));
    return KT_OK;
}

/* Checks a bound of the evaluations of a fixed step, or of a part of it. */
static kt_status check_bound(const kt_simulation_request *settings, const char *name, uint64_t given, kt_error *error) {
    const uint64_t least = kt_step_evaluations_least(settings->method);
    if (given == 0)
        return KT_OK;
    if (given < least)
        return kt_error_set(error, KT_ERROR_ARGUMENT, name, "%.0f: must be 0, or %.0f or more with %s", (double)given,
                            (double)least, settings->method->name);
    if (!(settings->run.step > 0.0) || settings->options.contact != KT_CONTACT_EVENTS)
        return kt_error_set(error, KT_ERROR_ARGUMENT, name,
                            "it bounds fixed steps with contact: events; give a step, or leave it out");
    return KT_OK;
}

/* Checks bounds of the evaluations of fixed steps, and whether time steps support the model. */
static kt_status check_bounds(const kt_model *model, const kt_simulation_request *settings, kt_error *error) {
    kt_status status = check_bound(settings, "step_evaluations", settings->options.step_evaluations, error);
    if (status == KT_OK)
        status = check_bound(settings, "stall_evaluations", settings->options.stall_evaluations, error);
    if (status != KT_OK || !kt_bounds_steps(&settings->options))
        return status;
    status = kt_load_reject(model, "contacts", "time stepping does not support this", error);
    return status == KT_OK ? reject_poisson(model, error) : status;
}

/* Rejects options that time stepping over contacts does not support. */
static kt_status check_time_stepping_options(const kt_model *model, const kt_simulation_request *settings,
                                             kt_error *error) {
    const kt_simulation_options *options = &settings->options;
    if ((unsigned)options->contact >= KT_CONTACT_SCHEME_COUNT)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "contact", "%d: must be KT_CONTACT_EVENTS or KT_CONTACT_STEPS",
                            (int)options->contact);
    const char *integrator = settings->run.integrator;
    if (options->method != NULL)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "contact",
                            "time stepping is a method of its own; leave the method out");
    if (integrator != NULL && strcmp(integrator, kt_method_moreau_jean.name) != 0)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "integrator",
                            "time stepping is a method of its own, and not '%.40s'; set the integrator to NULL",
                            integrator);
    if (!(settings->run.step > 0.0))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step",
                            "time stepping (contact: steps) has a fixed step; give it");
    const kt_status status = reject_poisson(model, error);
    return status != KT_OK || kt_contacts_of(model) > 0
               ? status
               : kt_error_set(error, KT_ERROR_ARGUMENT, "contact",
                              "time stepping (contact: steps) is for hard stops, contacts, slack ropes and friction "
                              "that sticks, and there are none; leave it out");
}

/* Rejects markers that the model does not have, and repeated pairs of names. */
static kt_status check_run_markers(const kt_model *model, const kt_run *run, kt_error *error) {
    for (int i = 0; i < run->marker_count; i++) {
        const kt_marker_pair *pair = &run->markers[i];
        const kt_where_text where = kt_where_format("markers[%d]", i);
        if (pair->body == NULL || pair->marker == NULL)
            return kt_error_set(error, KT_ERROR_ARGUMENT, where.text, "it has no name of %s",
                                pair->body == NULL ? "a body" : "a marker");
        const int body = kt_body_find(model, pair->body);
        if (body < 0)
            return kt_error_set(error, KT_ERROR_ARGUMENT, where.text, "the model has no body '%.80s'", pair->body);
        if (kt_marker_find(model, body, pair->marker) < 0)
            return kt_error_set(error, KT_ERROR_ARGUMENT, where.text, "body '%.80s' has no marker '%.80s'", pair->body,
                                pair->marker);
        for (int k = 0; k < i; k++)
            if (strcmp(pair->body, run->markers[k].body) == 0 && strcmp(pair->marker, run->markers[k].marker) == 0)
                return kt_error_set(error, KT_ERROR_ARGUMENT, where.text, "[%.80s, %.80s] is there already; remove one",
                                    pair->body, pair->marker);
    }
    return KT_OK;
}

static bool has_loop_coordinates(const kt_model *model) {
    bool has_any = false;
    for (int i = 0; i < kt_loop_count(model) && !has_any; i++)
        has_any = kt_loop_coordinates(model, i).nq > 0;
    return has_any;
}

static kt_status read_options(const kt_model *model, const kt_run *run, const kt_simulation_options *options,
                              kt_simulation_request *settings, kt_error *error) {
    settings->run = run != NULL ? *run : kt_run_default();
    kt_simulation_options own = kt_simulation_options_default();
    const kt_simulation_options *given = KT_OPTIONS(kt_simulation_options, steps_per_call, &own, options, error);
    if (given == NULL)
        return KT_ERROR_ARGUMENT;
    settings->options = *given;
    const kt_model *known = has_model_equations(settings) ? model : NULL;
    settings->method = settings->options.method != NULL ? settings->options.method
                                                        : kt_run_method(&settings->run, known, &settings->by_rho);
    if (settings->options.contact == KT_CONTACT_STEPS)
        settings->method = &kt_method_moreau_jean;
    if (settings->method == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "integrator",
                            "there is no method '%s'; kt_method_at lists the methods", settings->run.integrator);
    kt_status status = kt_run_check(&settings->run, error);
    if (status == KT_OK)
        status = check_run_markers(model, &settings->run, error);
    if (status == KT_OK)
        status = check_simulation_options(&settings->options, error);
    if (status == KT_OK && settings->options.contact != KT_CONTACT_EVENTS)
        status = check_time_stepping_options(model, settings, error);
    if (status == KT_OK)
        status = check_bounds(model, settings, error);
    if (status == KT_OK)
        status = reject_massless_options(model, &settings->options, error);
    if (status != KT_OK)
        return status;
    if (!(settings->run.step > 0.0) && !kt_method_is_adaptive(settings->method))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "integrator",
                            "%s has no error estimate and cannot choose its steps; give it a step",
                            settings->method->name);
    settings->record = kt_run_record(&settings->run, model) | settings->options.record;
    if ((settings->record & (KT_RECORD_POSITION | KT_RECORD_VELOCITY)) != 0 && has_loop_coordinates(model))
        settings->record |= KT_RECORD_CLOSURE; /* coordinates of loops follow from the kinematics */
    if ((settings->record & KT_RECORD_ACCELERATIONS) != 0)
        return kt_massless_reject(model, "record", "its acceleration is not computed; leave accelerations out", error);
    return KT_OK;
}

/* The solver of Newton's equations: the solver of the simulation. NULL if the caller supplies the equations, if nothing
 * moves, if coordinates follow from the balance of forces, or if the library was built without this solver. */
static const kt_newton *newton_of(const kt_model *model, const kt_simulation_request *settings) {
    const bool own = has_model_equations(settings) && kt_model_nv(model) > 0 && model->n.massless == 0;
    return kt_method_needs_newton(settings->method) && own ? &kt_simulation_newton : NULL;
}

static void measure_simulation(const kt_model *model, const kt_simulation_request *settings,
                               kt_simulation_sizes *size) {
    const size_t contacts = kt_contacts_of(model);
    const bool reacts = (settings->record & KT_RECORD_REACTIONS) != 0 || contacts > 0; /* contacts are checked */
    size->nq = (size_t)kt_model_nq(model);
    size->nv = (size_t)kt_model_nv(model);
    const size_t x = model->n.x, all = size->nq + size->nv + x;
    size->x = x;
    size->work = all > 0 ? all : 1;
    size->integrates_works = (settings->record & KT_RECORD_BALANCE) != 0;
    size->n = size->work + (size->integrates_works ? 2 : 0);
    size->balanced = model->n.massless > 0 ? size->n : 0;
    size->panel = size->integrates_works && !(settings->run.step > 0.0);
    size->body = (size_t)kt_model_body_count(model);
    size->gap = kt_gap_list(model, NULL);
    size->curve = kt_curve_count(model);
    size->event = settings->options.events > 0 ? (size_t)settings->options.events : 0;
    size->event += contacts;
    size->contacts = contacts;
    size->contact = kt_contacts_size(model);
    size->mask = contacts > 0 ? kt_mask_size(model) : 0;
    size->ranks = contacts > 0 ? kt_mask_ranks_size(model) : 0;
    size->moreau = contacts > 0 && takes_time_steps(&settings->options) ? kt_moreau_size(model, size->n) : 0;
    size->reaction = reacts ? size->body : 0;
    size->loop_reaction = reacts ? (size_t)kt_loop_count(model) : 0;
    size->multiplier = reacts ? (size_t)kt_model_mobility(model).equations : 0;
    size->quaternion = size->nq - size->nv; /* each has one position more than velocities */
    size->data = kt_data_size(model);
    const kt_integrator_options solver = {.newton = newton_of(model, settings)};
    if (solver.newton != NULL)
        kt_simulation_newton_measure(model, kt_method_family_of(settings->method)->exact, size);
    size->integrator = kt_integrator_size_with(settings->method, size->n, &solver);
    size->rate = settings->options.acceleration != NULL ? size->nv : 0;
    size->state = size->nq + size->nv + x;
    size->undo = contacts > 0 ? kt_simulation_undo_size(size) : 0;
}

/* The largest sizes that any variant of a model needs. */
static void measure_most(const kt_model *model, const kt_simulation_request *settings, kt_simulation_sizes *size) {
    measure_simulation(model, settings, size);
    for (uint64_t k = 0; model->variants && k < kt_variants_count(model->variants); k++) {
        kt_simulation_sizes one = {0};
        measure_simulation(kt_variants_model(model->variants, k), settings, &one);
#define MEMORY_MOST(member) size->member = one.member > size->member ? one.member : size->member;
        KT_SIMULATION_OF_MODEL(MEMORY_MOST)
#undef MEMORY_MOST
    }
    if (size->mask > 0 &&
        newton_of(model, settings) != NULL) /* the loops of a mask may leave any number of free velocities */
        size->basis = size->along = size->nv * size->nv;
    size->parts = kt_simulation_measure_parts(size);
}

/* ---- layout ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_simulation, KT_SIMULATION_FIELDS, const kt_simulation_sizes *size)

size_t kt_simulation_size(const kt_model *model, const kt_run *run, const kt_simulation_options *options) {
    if (!model)
        return 0;
    kt_simulation_request settings;
    kt_simulation_sizes size = {0};
    if (read_options(model, run, options, &settings, NULL) != KT_OK)
        return 0;
    measure_most(model, &settings, &size);
    return lay_out(NULL, &size);
}

/* ---- initialising ------------------------------------------------------------------------------------------------ */

/* Lists the positions of the quaternions in q. */
static void find_quaternions(kt_simulation *simulation) {
    size_t count = 0;
    for (int body = 1; body < kt_model_body_count(simulation->model); body++) {
        kt_coordinates at = kt_body_coordinates(simulation->model, body);
        if (at.nq > at.nv) /* the quaternion comes last */
            simulation->quaternion[count++] = at.q + at.nq - 4;
    }
}

/* The longest step that the run, the caller and the functions of time allow; 0: no limit. */
static double longest_run_step(const kt_model *model, const kt_simulation_request *settings) {
    if (model->variants) /* the model with all switches on has the least limit */
        model = kt_variants_model(model->variants, kt_variants_count(model->variants) - 1);
    double longest = kt_simulation_longest_step(model);
    if (settings->run.max_step > 0.0)
        longest = fmin(longest, settings->run.max_step);
    if (settings->options.max_step > 0.0)
        longest = fmin(longest, settings->options.max_step);
    return isfinite(longest) ? longest : 0.0;
}

static kt_status init_integrator(kt_simulation *simulation, const kt_simulation_request *settings, kt_error *error) {
    kt_integrator_options options = kt_integrator_options_default();
    options.step = settings->run.step;
    options.relative_tolerance = settings->run.relative;
    options.absolute_tolerance = settings->run.absolute;
    options.initial_step = settings->options.initial_step;
    options.max_step = longest_run_step(simulation->model, settings);
    options.max_steps = settings->options.max_steps;
    options.quadratures = simulation->size.n - simulation->size.work;
    options.positions = simulation->size.nq;
    options.newton = newton_of(simulation->model, settings);
    simulation->method = settings->by_rho;
    const kt_method *method = settings->method == &settings->by_rho ? &simulation->method : settings->method;
    const kt_status status = kt_integrator_init(simulation->integrator_memory, simulation->size.integrator, method,
                                                simulation->size.n, &options, &simulation->integrator, error);
    if (status == KT_OK)
        simulation->size.history = kt_integrator_history_size(simulation->integrator);
    return status;
}

/* Derives from the run which quantities records need. Without an interval there are a thousand intervals. */
static void set_records(kt_simulation *simulation, const kt_simulation_request *settings) {
    simulation->step = settings->run.step;
    simulation->duration = settings->run.duration;
    simulation->records.interval =
        settings->run.interval > 0.0 ? settings->run.interval : settings->run.duration / 1000.0;
    simulation->records.bits = settings->record;
    simulation->records.places =
        settings->options.kinematics || settings->run.marker_count > 0 ||
        (settings->record & (KT_RECORD_BALANCE | KT_RECORD_REACTIONS | KT_RECORD_KINEMATICS)) != 0;
    simulation->records.kinematics = simulation->records.places || (settings->record & KT_RECORD_ENERGY) != 0;
    simulation->records.count = 1 + (int64_t)kt_record_intervals(simulation->duration, simulation->records.interval);
}

/* Writes the initial state to `state` and y. */
static kt_status assemble(kt_simulation *simulation, kt_error *error) {
    double *q = simulation->state, *v = q + simulation->size.nq;
    kt_model_initial(simulation->model, q, v);
    kt_copy(v + simulation->size.nv, simulation->model->v0 + simulation->model->n.v, simulation->size.x * sizeof *v);
    kt_status status = kt_state_assemble(simulation->model, simulation->data, 0.0, q, v, error);
    memcpy(simulation->y, q, simulation->size.state * sizeof *q);
    if (status == KT_OK && simulation->size.balanced > 0) {
        bool changed;
        status = kt_simulation_project(simulation, 0.0, simulation->y, &changed, error);
        memcpy(q, simulation->y, simulation->size.state * sizeof *q);
    }
    return status;
}

/* The parts that can fail, in memory that is already laid out. */
static kt_status fill_simulation(kt_simulation *simulation, const kt_simulation_request *settings, kt_error *error) {
    kt_status status = kt_data_init_followed(simulation->model, simulation->data_memory, simulation->size.data,
                                             &simulation->data, error);
    if (status != KT_OK) /* GCOVR_EXCL_BR_LINE: its memory has the size that it measured */
        return status;   /* GCOVR_EXCL_LINE */
    simulation->options = settings->options;
    simulation->records.progress_due = settings->options.progress_steps;
    const int evaluations = settings->options.event_evaluations;
    simulation->events.evaluations = evaluations > 0 ? evaluations : KT_EVENT_EVALUATIONS;
    simulation->steps_over_contacts = settings->options.contact == KT_CONTACT_STEPS;
    simulation->works.watches = settings->options.watch_works && has_model_equations(settings) &&
                                settings->options.contact == KT_CONTACT_EVENTS;
    simulation->lacks_end_stage = !kt_simulation_has_end_stage(settings->method);
    simulation->lacks_inner_stage = !kt_simulation_has_inner_stage(settings->method);
    find_quaternions(simulation);
    set_records(simulation, settings);
    kt_simulation_follow_model(simulation);
    status = init_integrator(simulation, settings, error);
    if (status != KT_OK)
        return status;
    if (simulation->groups > 0)
        simulation->integrator->noise = &kt_simulation_noise;
    status = assemble(simulation, error);
    if (status != KT_OK)
        return status;
    kt_simulation_count(simulation);
    kt_integrator_callbacks callbacks = kt_simulation_callbacks(simulation);
    status = kt_integrator_start(simulation->integrator, 0.0, simulation->y, &callbacks, error);
    if (status == KT_OK && simulation->size.contact > 0)
        status = kt_contacts_init(simulation, error);
    if (status == KT_OK && simulation->size.contact > 0) {
        /* The compiled model of masked friction that is released at first is one in which it slips. */
        kt_phase_reset(simulation);
        status = kt_phase_settle(simulation, error);
    }
    if (simulation->memory.beyond) /* kt_simulation_set_state may follow; otherwise a step or a record reports it */
        status = KT_OK;
    return status;
}

/* Rejects options that bypass the engine's equations, since the engine closes contacts in these equations. */
static kt_status check_contacts(const kt_model *model, const kt_simulation_request *settings, kt_error *error) {
    const bool foreign = settings->options.acceleration != NULL || settings->options.projection != NULL;
    if (foreign || settings->options.unprojected)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "contact",
                            "hard stops, contacts and slack ropes take the engine's own equations and projection; "
                            "leave %s out, or take elastic ones",
                            foreign ? "the caller's" : "unprojected");
    const bool steps = settings->options.contact == KT_CONTACT_STEPS;
    bool rubs = false;
    for (size_t i = 0; i < model->n.loop; i++)
        rubs = rubs || model->loop[i].rubs > 0;
    for (size_t i = 0; i < model->n.loop && !steps; i++)
        if (model->loop[i].friction > 0 && model->loop[i].tube > 0.0)
            return kt_error_set(error, KT_ERROR_UNSUPPORTED, "contact",
                                "'%.60s': friction between spheres (radius2) needs time stepping; take contact: steps "
                                "with a step, or leave the friction out",
                                kt_loop_name(model, (int)i));
    if (rubs && kt_method_family_of(settings->method)->exact)
        return kt_error_set(
            error, KT_ERROR_UNSUPPORTED, "contact",
            "the order of %s depends on exact derivatives, and those of friction of hard contacts, which "
            "slips by its normal force, are not computed; take radau5, or an explicit method",
            settings->method->name);
    return KT_OK;
}

kt_status kt_simulation_init(const kt_model *model, const kt_run *run, const kt_simulation_options *options,
                             void *memory, size_t size, kt_simulation **simulation, kt_error *error) {
    if (KT_IS_MISSING(error, model, simulation))
        return KT_ERROR_ARGUMENT;
    kt_simulation_request settings;
    kt_simulation_sizes sizes = {0};
    kt_status status = read_options(model, run, options, &settings, error);
    if (status != KT_OK)
        return status;
    measure_most(model, &settings, &sizes);
    status = kt_arena_begin("kt_simulation_init", "kt_simulation_size", memory, size, lay_out(NULL, &sizes), error);
    if (status != KT_OK)
        return status;
    (void)lay_out(memory, &sizes);
    kt_simulation *made = memory;
    made->size = sizes;
    kt_simulation_place_parts(made);
    if (model->variants) { /* parts have room for every variant, and the sizes are those of this one */
        memset(&made->size, 0, sizeof made->size);
        measure_simulation(model, &settings, &made->size);
    }
    made->model = model;
    made->memory.set = model->set;
    if (made->size.contact > 0)
        status = check_contacts(model, &settings, error);
    if (status != KT_OK)
        return status;
    status = fill_simulation(made, &settings, error);
    if (status == KT_OK)
        *simulation = made;
    return status;
}

kt_status kt_simulation_create(const kt_model *model, const kt_run *run, const kt_simulation_options *options,
                               kt_simulation **simulation, kt_error *error) {
    if (KT_IS_MISSING(error, model, simulation))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_simulation_size(model, run, options);
    void *memory = kt_arena_allocate(size, "the simulation", error);
    return memory == NULL
               ? KT_ERROR_MEMORY
               : kt_arena_own(memory, kt_simulation_init(model, run, options, memory, size, simulation, error));
}

void kt_simulation_free(kt_simulation *simulation) { kt_arena_free(simulation); }
