/* The results of a run: the summary as JSON, and a short report for the terminal. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/excess.h"
#include "open/released.h"
#include "subcommands/run.h"
#include "text/json.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Returns an object that maps "BODY.MARKER" to [x, y, z] in the world frame, m. */
static json_t *describe_markers(const kt_model *model, const kt_data *data) {
    json_t *object = json_object();
    for (int body = 0; body < kt_model_body_count(model); body++)
        for (int marker = 0; marker < kt_marker_count(model, body); marker++) {
            kt_vec3 at = kt_point_position(model, data, body, kt_marker_at(model, body, marker));
            json_t *name = json_sprintf("%s.%s", kt_body_name(model, body), kt_marker_name(model, body, marker));
            json_object_set_new(object, json_string_value(name), kt_json_vector(at));
            json_decref(name);
        }
    return object;
}

/* Returns the reason for the choice of the method; NULL: the scene or the command line names the method. */
static const char *method_reason(const kt_outcome *outcome) {
    return outcome->scene->contact == KT_CONTACT_STEPS
               ? NULL
               : kt_run_method_reason(&outcome->scene->run, kt_integrated_model(outcome->model, outcome->absolute));
}

static json_t *describe_method(const kt_outcome *outcome) {
    const kt_run *run = outcome->run;
    const kt_scene *scene = outcome->scene;
    json_t *method = json_object();
    const char *reason = method_reason(outcome);
    json_object_set_new(method, "integrator", json_string(run->integrator));
    json_object_set_new(method, "chosen", reason != NULL ? json_string(reason) : json_null());
    kt_method storage;
    if (kt_run_method(run, outcome->model, &storage) == &storage)
        json_object_set_new(method, "rho", json_real(run->rho));
    if (run->step > 0.0) {
        json_object_set_new(method, "step", json_real(run->step));
    } else {
        json_object_set_new(method, "step", json_null());
        if (run->max_step > 0.0)
            json_object_set_new(method, "max_step", json_real(run->max_step));
        json_object_set_new(method, "tolerance",
                            json_pack("{s:f, s:f}", "relative", run->relative, "absolute", run->absolute));
    }
    json_object_set_new(method, "formulation", json_string(kt_formulation_name(scene->formulation)));
    json_object_set_new(method, "reduction", json_string(kt_reduction_name(scene->reduction)));
    json_object_set_new(method, "plan", json_string(kt_model_plan(outcome->model)));
    return method;
}

static json_t *count_cost(const kt_outcome *outcome) {
    kt_simulation_counts counts = kt_simulation_counts_of(outcome->simulation);
    return json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:f}", "steps", (json_int_t)counts.steps, "rejected",
                     (json_int_t)counts.rejected, "evaluations", (json_int_t)counts.evaluations, "factorizations",
                     (json_int_t)counts.factorizations, "jacobians", (json_int_t)counts.jacobians, "switches",
                     (json_int_t)counts.switches, "capped", (json_int_t)counts.iterations.capped, "balance_evaluations",
                     (json_int_t)counts.balance, "cpu_seconds", outcome->so_far.cpu_seconds);
}

/* Lists the numbers of the scene in this run, if the scene has parameters or settings. */
static void describe_parameters(const kt_scene *scene, json_t *root) {
    json_t *parameters = json_object(), *settings = json_array();
    for (int i = 0; i < scene->parameter_count; i++)
        json_object_set_new(parameters, scene->parameters[i].name, json_real(scene->parameters[i].value));
    for (int i = 0; i < scene->setting_count; i++)
        json_array_append_new(settings, kt_json_text(scene->settings[i]));
    if (scene->parameter_count > 0)
        json_object_set(root, "parameters", parameters);
    if (scene->setting_count > 0)
        json_object_set(root, "settings", settings);
    json_decref(parameters);
    json_decref(settings);
}

static json_t *describe_crossings(const kt_outcome *outcome) {
    const kt_crossings seen = kt_simulation_counts_of(outcome->simulation).crossings;
    const bool is_near = seen.near > 0;
    return json_pack("{s:I, s:I, s:o, s:o, s:o, s:o}", "near", (json_int_t)seen.near, "interpolated",
                     (json_int_t)seen.interpolated, "error", kt_json_number(seen.error), "smallest",
                     is_near ? kt_json_number(seen.smallest) : json_null(), "bend",
                     seen.bend > 0.0 ? kt_json_number(seen.bend) : json_null(), "since",
                     is_near ? kt_json_number(seen.since) : json_null());
}

/* Whether a switch shares its bits with no other. */
static bool has_own_bit(const kt_model *model, int k) {
    const uint64_t bits = kt_switch_bits(model, k);
    return (bits & (bits - 1)) == 0;
}

/* Lists the switched loops and effects, and whether they are on at the end. Contacts that share bits are left out. For
 * sticking friction, its two switches together determine whether it acts and whether it sticks. */
static json_t *list_switched(const kt_model *model) {
    json_t *switched = json_object();
    const uint64_t set = kt_switch_set(model);
    for (int k = 0; k < kt_switch_count(model); k++)
        if (kt_switch_name(model, k)[0] != '\0' && has_own_bit(model, k))
            json_object_set_new(switched, kt_switch_name(model, k),
                                json_boolean((set & kt_switch_bits(model, k)) != 0));
    for (int i = 0; i < kt_effect_count(model); i++) {
        const int back = kt_effect_switch(model, i), stick = kt_loop_switch(model, kt_effect_stick_loop(model, i));
        if (back < 0 || stick < 0)
            continue;
        const bool slips_back = (set & kt_switch_bits(model, back)) != 0;
        const bool is_held = (set & kt_switch_bits(model, stick)) != 0;
        if (kt_switch_name(model, back)[0] != '\0')
            json_object_set_new(switched, kt_switch_name(model, back), json_boolean(!(slips_back && is_held)));
        json_object_set_new(switched, kt_switch_name(model, stick), json_boolean(is_held && !slips_back));
    }
    return switched;
}

/* Returns the k-th event of the scene; `until` is the last one. */
static const kt_scene_event *event_of(const kt_scene *scene, int k) {
    return k < scene->event_count ? &scene->events[k] : &scene->until;
}

/* Returns whether an event of the scene has not happened. If another event has ended the run, `until` does not count as
 * missed. */
static bool event_is_missed(const kt_outcome *outcome, int k) {
    const kt_scene_event *event = event_of(outcome->scene, k);
    const bool is_moot = event == &outcome->scene->until && kt_simulation_stopped(outcome->simulation) != NULL;
    return !is_moot && kt_simulation_event_count(outcome->simulation, event->name) == 0;
}

/* Lists the count of each event, the missed events, and the event that has ended the run. */
static void list_events(const kt_outcome *outcome, json_t *root) {
    const kt_scene *scene = outcome->scene;
    const kt_event *stopped = kt_simulation_stopped(outcome->simulation);
    json_t *counts = json_object(), *missed = json_array();
    for (int i = 0; i < kt_scene_event_room(scene); i++) {
        const char *name = event_of(scene, i)->name;
        json_object_set_new(counts, name,
                            json_integer((json_int_t)kt_simulation_event_count(outcome->simulation, name)));
        if (event_is_missed(outcome, i))
            json_array_append_new(missed, json_string(name));
    }
    const kt_model *model = kt_outcome_model(outcome);
    if (kt_switch_count(model) > 0)
        json_object_set_new(root, "switched", list_switched(model));
    if (kt_switch_count(model) > 0)
        json_object_set_new(root, "released", kt_released_list(scene, outcome->simulation));
    if (kt_scene_event_room(scene) > 0) {
        json_object_set(root, "events", counts);
        json_object_set(root, "never_happened", missed);
        json_object_set_new(root, "ended_by", stopped != NULL ? json_string(stopped->name) : json_null());
    }
    if (kt_scene_event_room(scene) > 0 || kt_simulation_contacts(outcome->simulation).count > 0) {
        json_t *marks = kt_marks_describe(&outcome->marks);
        json_object_update(root, marks);
        json_decref(marks);
    }
    json_decref(missed);
    json_decref(counts);
}

static void list_time_stepping(const kt_contact_counts *seen, json_t *contacts) {
    json_object_set_new(contacts, "closed", json_integer((json_int_t)seen->closed));
    json_object_set_new(contacts, "iterations", json_integer((json_int_t)seen->pivots));
    json_object_set_new(contacts, "failures", json_integer((json_int_t)seen->failures));
    json_object_set_new(contacts, "supplied", kt_json_number(seen->supplied));
    json_object_set_new(contacts, "penetration", kt_json_number(seen->penetration));
}

/* Lists the counts of hard stops, contacts and slack ropes. */
static void list_contacts(const kt_outcome *outcome, json_t *root) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    const kt_contact_excess excess = kt_simulation_contact_excess(outcome->simulation);
    const kt_completed_steps steps = kt_simulation_completed_steps(outcome->simulation);
    json_t *contacts = json_object();
    json_object_set_new(contacts, "impacts", json_integer((json_int_t)seen.impacts));
    json_object_set_new(contacts, "closings", json_integer((json_int_t)seen.closings));
    json_object_set_new(contacts, "openings", json_integer((json_int_t)seen.openings));
    json_object_set_new(contacts, "sticks", json_integer((json_int_t)seen.sticks));
    json_object_set_new(contacts, "slips", json_integer((json_int_t)seen.slips));
    json_object_set_new(contacts, "undecided", json_integer((json_int_t)seen.undecided));
    json_object_set_new(contacts, "redundant", json_integer((json_int_t)seen.redundant));
    if (seen.undecided > 0)
        json_object_set_new(
            contacts, "first_undecided",
            json_pack("{s:f, s:o}", "time", seen.undecided_time, "contact",
                      kt_json_text(kt_loop_name(kt_simulation_model(outcome->simulation), seen.undecided_loop))));
    json_object_set_new(contacts, "shared", json_integer((json_int_t)seen.shared));
    json_object_set_new(contacts, "unconverged", json_integer((json_int_t)seen.unconverged));
    json_object_set_new(contacts, "rested", json_integer((json_int_t)seen.rested));
    if (excess.steps > 0)
        json_object_set_new(
            contacts, "excess",
            json_pack("{s:I, s:f, s:f, s:o}", "steps", (json_int_t)excess.steps, "most", excess.most, "time",
                      excess.time, "contact",
                      kt_json_text(kt_loop_name(kt_simulation_model(outcome->simulation), excess.loop))));
    json_object_set_new(contacts, "reduced", json_integer((json_int_t)seen.reduced));
    json_object_set_new(contacts, "jammed", json_integer((json_int_t)seen.jammed));
    json_object_set_new(contacts, "dissipated", kt_json_number(seen.dissipated));
    if (seen.completed > 0)
        json_object_set_new(contacts, "completed",
                            json_pack("{s:I, s:f, s:I}", "steps", (json_int_t)seen.completed, "time", steps.time,
                                      "mean_records", (json_int_t)steps.records));
    if (outcome->scene->contact == KT_CONTACT_STEPS || seen.completed > 0)
        list_time_stepping(&seen, contacts);
    if (seen.count > 0)
        json_object_set(root, "contacts", contacts);
    json_decref(contacts);
}

static void describe_state_values(const kt_outcome *outcome, json_t *root) {
    if (kt_auxiliary_state_count(outcome->model) > 0)
        json_object_set_new(
            root, "state",
            kt_json_auxiliary_states(outcome->model, kt_simulation_auxiliary_states(outcome->simulation)));
}

static json_t *measure_energy(const kt_outcome *outcome, kt_data *data) {
    const kt_model *model = kt_outcome_model(outcome); /* with its switches at the end */
    const kt_simulation *simulation = outcome->simulation;
    double kinetic = kt_kinetic_energy(model, data);
    double potential = kt_potential_energy(model, data) + kt_effect_energy(model, data, kt_simulation_time(simulation),
                                                                           kt_outcome_positions(outcome),
                                                                           kt_outcome_velocities(outcome));
    const bool is_known = kt_energy_is_known(&outcome->so_far.energy);
    const double error = kt_energy_watch_error(&outcome->so_far.energy); /* relative, as energy.error of sweeps */
    return json_pack("{s:o, s:o, s:o, s:o, s:o}", "kinetic", kt_json_number(kinetic), "potential",
                     kt_json_number(potential), "total", kt_json_number(kinetic + potential), "drift",
                     kt_json_number(outcome->so_far.energy.change), "error",
                     is_known ? kt_json_number(error) : json_null());
}

static json_t *measure_balance(const kt_outcome *outcome) {
    const kt_work work = kt_simulation_work(outcome->simulation);
    return json_pack("{s:o, s:o, s:o}", "dissipated", kt_json_number(work.dissipated), "supplied",
                     kt_json_number(work.supplied), "drift", kt_json_number(outcome->so_far.energy.balance_change));
}

/* Describes the quantity that watched the energy, its errors, and the reason for a missing watch. */
static json_t *describe_watch(const kt_outcome *outcome) {
    const kt_energy_watch *energy = &outcome->so_far.energy;
    const char *missing = kt_energy_not_watched(outcome);
    const char *by = energy->records == 0 || (missing != NULL && energy->energetics == KT_ENERGY_SUPPLIED) ? "nothing"
                     : energy->has_balance                                                                 ? "balance"
                     : energy->has_estimate ? "powers at the ends of steps"
                                            : "total energy";
    json_t *watch =
        json_pack("{s:s, s:o, s:o, s:o, s:o}", "by", by, "error", kt_json_number(energy->error), "scale",
                  kt_json_number(kt_energy_watch_scale(energy)), "imbalance", kt_json_number(energy->balance_change),
                  "uncertainty", kt_json_number(energy->uncertainty));
    if (missing != NULL)
        json_object_set_new(watch, "why", json_string(missing));
    return watch;
}

static json_t *describe_outcome(const kt_outcome *outcome, kt_data *data, double *a, kt_error *error) {
    const kt_model *model = kt_outcome_model(outcome); /* with its switches at the end */
    const double *q = kt_outcome_positions(outcome);
    const double *v = kt_outcome_velocities(outcome);
    kt_mobility dof = kt_model_mobility(model);
    /* After a failed run the acceleration may not exist; the other values do. */
    bool has_acceleration = kt_simulated_acceleration(kt_outcome_simulated(outcome), a, error) == KT_OK;
    if (kt_kinematics_update(model, data, q, v, NULL, error) != KT_OK)
        return NULL;
    json_t *root = json_object();
    json_object_set_new(root, "scene", kt_json_text(outcome->name));
    json_object_set_new(root, "time", json_real(kt_simulation_time(outcome->simulation)));
    describe_parameters(outcome->scene, root);
    list_events(outcome, root);
    list_contacts(outcome, root);
    json_object_set_new(root, "freedom",
                        json_pack("{s:i, s:i, s:i, s:i}", "tree", dof.tree, "equations", dof.equations, "rank",
                                  dof.rank, "minimal", dof.minimal));
    json_object_set(root, "moved", outcome->moved);
    json_object_set_new(root, "disagreement", kt_start_disagreement(outcome->model));
    json_object_set_new(root, "inertia_excess", kt_start_inertias(outcome->scene));
    if (kt_massless_count(model) > 0)
        json_object_set_new(root, "massless", kt_start_massless(model));
    json_object_set_new(root, "position", kt_json_by_joint(model, q, false));
    json_object_set_new(root, "velocity", kt_json_by_joint(model, v, true));
    describe_state_values(outcome, root);
    json_object_set_new(root, "acceleration", kt_json_by_joint(model, has_acceleration ? a : NULL, true));
    json_object_set_new(root, "marker", describe_markers(model, data));
    json_object_set_new(root, "energy", measure_energy(outcome, data));
    json_object_set_new(root, "energy_watch", describe_watch(outcome));
    if (outcome->so_far.energy.has_balance)
        json_object_set_new(root, "balance", measure_balance(outcome));
    json_object_set_new(root, "constraint",
                        json_pack("{s:f, s:f}", "position", outcome->so_far.constraint.position, "velocity",
                                  outcome->so_far.constraint.velocity));
    if (outcome->so_far.compressions.count > 0)
        json_object_set_new(root, "compression",
                            kt_compressions_describe(&outcome->so_far.compressions, outcome->scene));
    if (outcome->columns != NULL)
        json_object_set_new(root, "columns", kt_extremes_describe(&outcome->extremes, outcome->columns));
    json_object_set_new(root, "singular", describe_crossings(outcome));
    json_object_set_new(root, "method", describe_method(outcome));
    json_object_set_new(root, "cost", count_cost(outcome));
    if (outcome->check != NULL)
        json_object_set_new(root, "error", kt_error_check_describe(outcome->check));
    json_object_set_new(root, "warnings", kt_warnings_describe(&outcome->warnings));
    return root;
}

int kt_summary_write(const kt_outcome *outcome, const char *path) {
    kt_error error = {0};
    kt_data *data = NULL;
    json_t *root = NULL;
    double *a = malloc(sizeof(double) * ((size_t)kt_model_nv(outcome->model) + 1));
    if (a == NULL || kt_data_create(kt_outcome_model(outcome), &data, &error) != KT_OK) {
        kt_say("there is not enough memory for the summary");
        free(a);
        return KT_EXIT_INTEGRATION;
    }
    root = describe_outcome(outcome, data, a, &error);
    kt_data_free(data);
    free(a);
    if (root == NULL) {
        kt_say_error(&error);
        return KT_EXIT_INTEGRATION;
    }
    return kt_json_write(root, path);
}

/* ---- report on the terminal -------------------------------------------------------------------------------------- */

/* Prints "3 bodies, 1 loop, 1 degree of freedom". The loops are those of the scene: a hard contact is a loop of the
 * model. */
static void say_mechanism_size(const kt_outcome *outcome) {
    const int bodies = kt_model_body_count(outcome->model) - 1, loops = outcome->scene->description.loop_count;
    const unsigned long long contacts = kt_simulation_contacts(outcome->simulation).count;
    kt_mobility dof = kt_model_mobility(outcome->model);
    kt_print("  %d bod%s", bodies, bodies == 1 ? "y" : "ies");
    if (loops > 0)
        kt_print(", %d loop%s", loops, kt_plural(loops));
    if (contacts > 0)
        kt_print(", %llu hard contact%s", contacts, kt_plural((long long)contacts));
    kt_print(", %d degree%s of freedom", dof.minimal, kt_plural(dof.minimal));
}

void kt_print_steps(const kt_run *run, FILE *to) {
    if (run->step > 0.0)
        fprintf(to, " with steps of %g s", run->step);
    else if (run->relative == run->absolute)
        fprintf(to, " at tolerance %g", run->relative);
    else
        fprintf(to, " at tolerances %g relative, %g absolute", run->relative, run->absolute);
}

static void say_method(const kt_outcome *outcome) {
    const kt_run *run = outcome->run;
    const char *reason = method_reason(outcome);
    kt_print(", %s", run->integrator);
    kt_print_steps(run, stderr);
    if (reason != NULL)
        kt_print(" (%s is %s)", run->integrator, reason);
    kt_print("\n");
}

static void say_cost(const kt_outcome *outcome, double time) {
    kt_simulation_counts counts = kt_simulation_counts_of(outcome->simulation);
    kt_print("  %llu step%s", (unsigned long long)counts.steps, kt_plural((long long)counts.steps));
    if (counts.rejected > 0)
        kt_print(" (%llu rejected)", (unsigned long long)counts.rejected);
    if (counts.switches > 0)
        kt_print(", %llu switch%s between explicit and implicit ones", (unsigned long long)counts.switches,
                 counts.switches > 1 ? "es" : "");
    kt_print(", %llu evaluations, %.3g s of CPU time", (unsigned long long)counts.evaluations,
             outcome->so_far.cpu_seconds);
    if (outcome->so_far.cpu_seconds > 0.0 && time > 0.0)
        kt_print(": %.3g times real time", time / outcome->so_far.cpu_seconds);
    kt_print("\n");
}

/* The change is that from the first record to a later one. */
static void say_energy(const kt_outcome *outcome) {
    const kt_energy_watch *energy = &outcome->so_far.energy;
    if (energy->records > 1 && energy->energetics == KT_ENERGY_CONSERVED)
        kt_print("  total energy %g J, drift at most %.2g J\n", energy->start, energy->change);
    else if (energy->records > 1)
        kt_print("  total energy %g J at the start, change at most %.2g J\n", energy->start, energy->change);
    else if (energy->records > 0)
        kt_print("  total energy %g J at the start\n", energy->start);
}

/* States how much of the motion passes between records of an interval that the user has chosen. */
static void say_aliased(const kt_outcome *outcome) {
    const size_t i = kt_find_aliased(outcome);
    char name[200];
    if (i >= outcome->extremes.count || outcome->scene->run.interval == 0.0)
        return;
    (void)kt_column_name(outcome->columns, i, name, sizeof name);
    kt_print("  '%s' goes through its range and back %.2g times between two records; a shorter --interval shows it\n",
             name, kt_periods_between(outcome, i));
}

static void say_result_file(const char *what, const char *path) {
    enum { LARGE = 20000000 }; /* bytes; only frames need more */
    struct stat status;
    if (path != NULL)
        kt_print("  %s: %s\n", what, kt_show_result(path).text);
    if (path != NULL && stat(path, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > LARGE)
        kt_print("    it has %.3g MB; a longer --interval makes it smaller, with fewer frames\n",
                 1e-6 * (double)status.st_size);
}

/* The energy that impacts and closings have dissipated; 0 if it is below the rounding of the energies of the motion. */
static double dissipated_beyond_rounding(const kt_outcome *outcome, double dissipated) {
    const kt_energy_watch *e = &outcome->so_far.energy;
    const double size = fmax(fmax(e->kinetic, e->start_size), fmax(fabs(e->potential[0]), fabs(e->potential[1])));
    return fabs(dissipated) > DBL_EPSILON * size ? dissipated : 0.0;
}

static void say_contacts(const kt_outcome *outcome) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    const double dissipated = dissipated_beyond_rounding(outcome, seen.dissipated);
    if (seen.count > 0)
        kt_print("  contacts: %llu impact%s (%g J dissipated), %llu closing%s, %llu opening%s; friction: %llu stick%s, "
                 "%llu slip%s\n",
                 (unsigned long long)seen.impacts, kt_plural((long long)seen.impacts), dissipated,
                 (unsigned long long)seen.closings, kt_plural((long long)seen.closings),
                 (unsigned long long)seen.openings, kt_plural((long long)seen.openings),
                 (unsigned long long)seen.sticks, kt_plural((long long)seen.sticks), (unsigned long long)seen.slips,
                 kt_plural((long long)seen.slips));
    const unsigned long long steps = kt_simulation_counts_of(outcome->simulation).steps;
    if (outcome->scene->contact == KT_CONTACT_STEPS && steps > 0)
        kt_print("  %.3g closed contacts in a step, %.3g iterations; they penetrate by at most %.3g m or rad\n",
                 (double)seen.closed / (double)steps, (double)seen.pivots / (double)steps, seen.penetration);
}

/* Names the events that have not happened, with their conditions. */
static void say_missed(const kt_outcome *outcome) {
    enum { LISTED = 8 };
    int count = 0;
    for (int i = 0; i < kt_scene_event_room(outcome->scene); i++) {
        const kt_scene_event *event = event_of(outcome->scene, i);
        if (!event_is_missed(outcome, i) || count++ >= LISTED)
            continue;
        if (event == &outcome->scene->until)
            kt_print("  until never happened: %s\n", kt_show(event->when).text);
        else
            kt_print("  event '%s' never happened: %s\n", kt_show(event->name).text, kt_show(event->when).text);
    }
    if (count > LISTED)
        kt_print("  and %d more events never happened\n", count - LISTED);
}

void kt_report_outcome(const kt_outcome *outcome, const kt_result_names *names) {
    double time = kt_simulation_time(outcome->simulation), duration = outcome->run->duration;
    kt_print("%s: %g s simulated", kt_show(outcome->name).text, time);
    const kt_event *stopped = kt_simulation_stopped(outcome->simulation);
    if (time < duration)
        kt_print(" of %g s", duration);
    if (stopped != NULL)
        kt_print(", ended by event '%s'", kt_show(stopped->name).text);
    kt_print("\n");
    say_mechanism_size(outcome);
    say_method(outcome);
    say_cost(outcome, time);
    say_energy(outcome);
    if (outcome->so_far.energy.has_balance) {
        const kt_work work = kt_simulation_work(outcome->simulation);
        kt_print("  %g J dissipated, %g J supplied: the balance closes to %.2g J\n", work.dissipated, work.supplied,
                 outcome->so_far.energy.balance_change);
    }
    if (kt_energy_not_watched(outcome) != NULL)
        kt_print("  energy not watched: %s\n", kt_energy_not_watched(outcome));
    if (kt_loop_count(outcome->model) > 0 && outcome->so_far.records > 0)
        kt_print("  %s closed to %.2g m or rad, %.2g m/s or rad/s\n",
                 outcome->scene->description.loop_count > 0 ? "loops" : "active contacts",
                 outcome->so_far.constraint.position, outcome->so_far.constraint.velocity);
    if (outcome->check != NULL)
        kt_error_check_say(outcome->check);
    say_contacts(outcome);
    say_missed(outcome);
    kt_compressions_say(&outcome->so_far.compressions, outcome->scene);
    say_aliased(outcome);
    if (names->out != NULL)
        kt_print("  %lld record%s: %s\n", (long long)outcome->so_far.records, kt_plural(outcome->so_far.records),
                 kt_show_result(names->out).text);
    say_result_file("summary", names->summary);
    say_result_file("picture", names->plot);
    say_result_file("view", names->view);
    say_result_file("glTF", names->glb);
    if (outcome->replaced[0] != '\0')
        kt_print("  replaces an older %s\n", outcome->replaced);
}
