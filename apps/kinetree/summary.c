/* The summary of a run: the end of it, and what it cost. */
#include "json.h"
#include "run.h"

#include <math.h>
#include <stdlib.h>

/* "BODY.MARKER": [x, y, z], world. */
static json_t *list_markers(const kt_model *model, const kt_data *data) {
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

static json_t *describe_method(const kt_run *run, const kt_model *model) {
    json_t *method = json_object();
    json_object_set_new(method, "integrator", json_string(run->integrator));
    if (run->step > 0.0) {
        json_object_set_new(method, "step", json_real(run->step));
    } else {
        json_object_set_new(method, "step", json_null());
        json_object_set_new(method, "tolerance",
                            json_pack("{s:f, s:f}", "relative", run->relative, "absolute", run->absolute));
    }
    json_object_set_new(method, "formulation", json_string(kt_formulation_name(run->formulation)));
    json_object_set_new(method, "reduction", json_string(kt_reduction_name(run->reduction)));
    json_object_set_new(method, "plan", json_string(kt_model_plan(model)));
    return method;
}

static json_t *count_cost(const kt_outcome *outcome) {
    kt_simulation_counts counts = kt_simulation_counts_get(outcome->simulation);
    return json_pack("{s:I, s:I, s:I, s:I, s:f}", "steps", (json_int_t)counts.steps, "rejected",
                     (json_int_t)counts.rejected, "evaluations", (json_int_t)counts.evaluations, "factorizations",
                     (json_int_t)counts.factorizations, "cpu_seconds", outcome->cpu_seconds);
}

static json_t *measure_energy(const kt_outcome *outcome, kt_data *data) {
    const kt_model *model = outcome->model;
    const kt_simulation *simulation = outcome->simulation;
    double kinetic = kt_kinetic_energy(model, data);
    double potential = kt_potential_energy(model, data) + kt_effect_energy(model, data, kt_simulation_time(simulation),
                                                                           kt_simulation_positions(simulation),
                                                                           kt_simulation_velocities(simulation));
    json_t *energy = json_object();
    json_object_set_new(energy, "kinetic", kt_json_number(kinetic));
    json_object_set_new(energy, "potential", kt_json_number(potential));
    json_object_set_new(energy, "total", kt_json_number(kinetic + potential));
    json_object_set_new(energy, "drift", kt_json_number(outcome->energy.change));
    return energy;
}

static json_t *measure_balance(const kt_outcome *outcome) {
    const kt_work work = kt_simulation_work(outcome->simulation);
    json_t *balance = json_object();
    json_object_set_new(balance, "dissipated", kt_json_number(work.dissipated));
    json_object_set_new(balance, "supplied", kt_json_number(work.supplied));
    json_object_set_new(balance, "drift", kt_json_number(outcome->energy.balance_change));
    return balance;
}

static json_t *describe(const kt_outcome *outcome, kt_data *data, double *a, kt_error *error) {
    const kt_model *model = outcome->model;
    const double *q = kt_simulation_positions(outcome->simulation);
    const double *v = kt_simulation_velocities(outcome->simulation);
    kt_mobility dof = kt_model_mobility(model);
    /* Where the run failed there may be no acceleration; the rest is there all the same. */
    bool has_acceleration = kt_simulation_acceleration(outcome->simulation, a, error) == KT_OK;
    if (kt_kinematics_update(model, data, q, v, NULL, error) != KT_OK)
        return NULL;
    json_t *root = json_object();
    json_object_set_new(root, "scene", kt_json_text(outcome->name));
    json_object_set_new(root, "time", json_real(kt_simulation_time(outcome->simulation)));
    json_object_set_new(root, "freedom",
                        json_pack("{s:i, s:i, s:i, s:i}", "tree", dof.tree, "equations", dof.equations, "rank",
                                  dof.rank, "minimal", dof.minimal));
    json_object_set(root, "moved", outcome->moved);
    json_object_set_new(root, "inertia_excess", kt_start_inertias(outcome->scene));
    json_object_set_new(root, "position", kt_json_by_joint(model, q, false));
    json_object_set_new(root, "velocity", kt_json_by_joint(model, v, true));
    json_object_set_new(root, "acceleration", kt_json_by_joint(model, has_acceleration ? a : NULL, true));
    json_object_set_new(root, "marker", list_markers(model, data));
    json_object_set_new(root, "energy", measure_energy(outcome, data));
    if (outcome->energy.has_balance)
        json_object_set_new(root, "balance", measure_balance(outcome));
    json_object_set_new(
        root, "constraint",
        json_pack("{s:f, s:f}", "position", outcome->constraint.position, "velocity", outcome->constraint.velocity));
    json_object_set_new(root, "method", describe_method(outcome->run, model));
    json_object_set_new(root, "cost", count_cost(outcome));
    json_object_set_new(root, "warnings", kt_warnings_describe(&outcome->warnings));
    return root;
}

int kt_summary_write(const kt_outcome *outcome, const char *path) {
    kt_error error = {0};
    kt_data *data = NULL;
    json_t *root = NULL;
    double *a = malloc(sizeof(double) * ((size_t)kt_model_nv(outcome->model) + 1));
    if (a == NULL || kt_data_create(outcome->model, &data, &error) != KT_OK) {
        kt_say("there is not enough memory for the summary");
        free(a);
        return KT_EXIT_INTEGRATION;
    }
    root = describe(outcome, data, a, &error);
    kt_data_free(data);
    free(a);
    if (root == NULL) {
        kt_say_error(&error);
        return KT_EXIT_INTEGRATION;
    }
    return kt_json_write(root, path);
}
