/* The linearisation of a scene, as used by the subcommands modes, equilibrium and others. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/linear.h"

#include "kinetree/descriptor.h"
#include "kinetree/simulation.h"
#include "open/start.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The dense matrices have twice as many rows as there are velocity coordinates n. Their eigenvalues take
 * (n / ONE_SECOND)^3 seconds on a processor of 2020. */
enum { ONE_SECOND = 300, COORDINATES_MOST = 2000 };

int kt_reject_dense_size(const kt_model *model) {
    const int n = kt_model_nv(model);
    if (n > COORDINATES_MOST)
        return kt_reject(KT_EXIT_INTEGRATION,
                         "the scene has %d degrees of freedom; small motions are computed with dense matrices, for up "
                         "to %d: describe it with fewer bodies",
                         n, COORDINATES_MOST);
    if (n > ONE_SECOND)
        kt_say("small motions of %d degrees of freedom take about %.0f s, since their matrices are dense", n,
               pow((double)n / ONE_SECOND, 3.0));
    return -1;
}

int kt_small_motion_open(kt_small_motion *motion, const char *path, const kt_settings *settings) {
    kt_error error = {0};
    memset(motion, 0, sizeof *motion);
    int code = kt_read_scene(path, settings, &motion->scene);
    if (code != KT_EXIT_DONE)
        return code;
    code = kt_compile_without_contacts(&motion->scene, &motion->model, &motion->lacks_contacts);
    if (code != KT_EXIT_DONE) {
        kt_scene_free(&motion->scene);
        return code;
    }
    const kt_model *model = motion->model;
    char *base = kt_base_name(path);
    motion->name = base != NULL ? strdup(kt_title_of(model, base)) : NULL;
    free(base);
    if ((code = kt_reject_dense_size(model)) >= 0)
        return code;
    motion->q = calloc((size_t)kt_model_nq(model) + 1, sizeof(double));
    motion->v = calloc((size_t)kt_model_nv(model) + 1, sizeof(double));
    if (motion->q == NULL || motion->v == NULL || motion->name == NULL)
        return kt_say_no_memory(NULL);
    kt_status status = kt_linearization_create(model, NULL, &motion->linearization, &error);
    if (status == KT_OK)
        status = kt_modes_create(model, &motion->modes, &error);
    if (status == KT_OK)
        status = kt_data_create(model, &motion->data, &error);
    if (status == KT_OK)
        return kt_start_assemble(&motion->scene, model, motion->data, motion->q, motion->v);
    return kt_say_status(status, &error);
}

void kt_small_motion_close(kt_small_motion *motion) {
    kt_data_free(motion->data);
    kt_modes_free(motion->modes);
    kt_linearization_free(motion->linearization);
    free(motion->q);
    free(motion->v);
    free(motion->name);
    if (motion->model != NULL) {
        kt_model_free(motion->model);
        kt_scene_free(&motion->scene);
    }
}

bool kt_small_motion_moves(const kt_small_motion *motion) {
    for (int i = 0; i < kt_model_nv(motion->model); i++)
        if (fabs(motion->v[i]) > 1e-12)
            return true;
    return false;
}

/* Adds to the message of a failed search downhill that the search for the nearest equilibrium succeeds, if it does. */
static void suggest_nearest(kt_small_motion *motion, kt_error *error) {
    kt_equilibrium_options options = kt_equilibrium_options_default();
    const size_t nq = (size_t)kt_model_nq(motion->model), used = strlen(error->message);
    double *q = malloc((nq + 1) * sizeof *q);
    options.nearest = true;
    if (q != NULL)
        memcpy(q, motion->q, nq * sizeof *q);
    if (q != NULL && kt_equilibrium_find(motion->linearization, &options, 0.0, q, NULL, NULL, NULL) == KT_OK)
        snprintf(error->message + used, sizeof error->message - used, "; --nearest finds one, stable or not");
    free(q);
}

kt_status kt_small_motion_settle(kt_small_motion *motion, bool nearest, kt_error *error) {
    kt_equilibrium_options options = kt_equilibrium_options_default();
    options.nearest = nearest;
    const kt_status status =
        kt_equilibrium_find(motion->linearization, &options, 0.0, motion->q, NULL, &motion->equilibrium, error);
    if (status == KT_ERROR_STEP && !nearest)
        suggest_nearest(motion, error);
    if (status != KT_OK)
        return status;
    if (motion->equilibrium.followed)
        kt_say("Newton's method found no equilibrium from the initial position. This equilibrium is where a motion "
               "from rest ends, computed with long implicit steps; it may not be the nearest one");
    if (motion->equilibrium.starts > 1)
        kt_say("no equilibrium was found from the initial position. Start %d, at another position, led to this one; it "
               "may not be the nearest one",
               motion->equilibrium.starts);
    memset(motion->v, 0, (size_t)kt_model_nv(motion->model) * sizeof *motion->v);
    motion->settled = true;
    return KT_OK;
}

/* Prints which contacts a simulation in the state closes, or that one is beyond its boundary. */
static void say_contacts_of_state(const kt_small_motion *motion, kt_simulation *simulation) {
    kt_error error = {0};
    double *a = calloc((size_t)kt_model_nv(motion->model) + 1, sizeof *a);
    kt_status status = kt_simulation_set_state(simulation, 0.0, motion->q, motion->v, &error);
    if (a != NULL && status == KT_OK)
        status = kt_simulation_acceleration(simulation, a, &error);
    free(a);
    if (status != KT_OK) {
        kt_say("`run` cannot reach this state: %s", error.message);
        return;
    }
    const kt_model *model = kt_simulation_model(simulation);
    int first = -1, count = 0;
    for (int i = 0; i < kt_loop_count(model); i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE && kt_loop_rows_of(model, i).count > 0)
            first = count++ == 0 ? i : first;
    if (count > 0)
        kt_say("'%s'%s closed in this state, and the results are those without the reactions",
               kt_show(kt_loop_name(model, first)).text, count > 1 ? " and others are" : " is");
}

/* Compares the state with one of a run, which has the hard parts of the scene. */
static void check_contacts_of_state(const kt_small_motion *motion) {
    const kt_model_options options = kt_compile_options(&motion->scene);
    kt_run run = kt_run_default();
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    run.integrator = "dop853"; /* without matrices */
    if (kt_model_compile(&motion->scene.description, &options, &model, NULL) == KT_OK &&
        kt_simulation_create(model, &run, NULL, &simulation, NULL) == KT_OK)
        say_contacts_of_state(motion, simulation);
    kt_simulation_free(simulation);
    kt_model_free(model);
}

int kt_small_motion_linearize(kt_small_motion *motion) {
    kt_error error = {0};
    kt_status status = kt_linearization_evaluate(motion->linearization, 0.0, motion->q, motion->v, NULL, &error);
    if (status == KT_OK)
        status = kt_modes_evaluate(motion->modes, kt_linearization_system(motion->linearization), &error);
    if (status == KT_OK && motion->lacks_contacts)
        check_contacts_of_state(motion);
    return kt_say_status(status, &error);
}

int kt_small_motion_places(const kt_small_motion *motion) {
    int count = 0;
    for (int k = 0; k < kt_auxiliary_state_count(motion->model); k++)
        count += kt_scene_is_place_state(&motion->scene, kt_auxiliary_state_name(motion->model, k));
    return count;
}

double kt_mode_modulus(const kt_mode *mode) { return hypot(mode->real, mode->imaginary); }

bool kt_mode_is_neutral(const kt_mode *mode) {
    return kt_mode_modulus(mode) <= mode->error || kt_mode_modulus(mode) < DBL_MIN;
}

bool kt_mode_is_uncertain(const kt_small_motion *motion, const kt_mode *mode) {
    const kt_mode fastest = kt_modes_at(motion->modes, kt_modes_count(motion->modes) - 1);
    return kt_mode_is_neutral(mode) && kt_mode_modulus(mode) > sqrt(DBL_EPSILON) * kt_mode_modulus(&fastest);
}

bool kt_mode_grows(const kt_mode *mode) {
    return !kt_mode_is_neutral(mode) && mode->real > mode->error && mode->real > 1e-9 * kt_mode_modulus(mode);
}

/* The amplitude of component i of a shape, in its unit. Places of footholds do not move. first: coordinate of i = 0. */
static double shape_amplitude(const kt_small_motion *motion, const double *shape, int first, int i) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    if (first > 0 && kt_scene_is_place_state(&motion->scene, kt_auxiliary_state_name(motion->model, i)))
        return 0.0;
    return hypot(shape[2 * i], shape[2 * i + 1]) / (first > 0 ? 1.0 : system->unit[i]);
}

int kt_find_movers(const kt_small_motion *motion, int mode, kt_mover *movers, int most, double least) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    const double *shapes[] = {kt_modes_positions(motion->modes, mode), kt_modes_velocities(motion->modes, mode),
                              kt_modes_auxiliary_states(motion->modes, mode)};
    const double *shape = shapes[0];
    double largest = 0.0;
    int begin = 0, components = system->coordinates;
    for (int pass = 0; pass < 3 && largest == 0.0; pass++) {
        begin = pass < 2 ? 0 : system->coordinates;
        components = pass < 2 ? system->coordinates : system->auxiliary_states;
        shape = shapes[pass];
        for (int i = 0; i < components; i++)
            largest = fmax(largest, shape_amplitude(motion, shape, begin, i));
    }
    int count = 0;
    for (int i = 0; i < components && largest > 0.0; i++) {
        const double share = shape_amplitude(motion, shape, begin, i) / largest;
        if (!(share > least))
            continue;
        int at = count < most ? count++ : most;
        for (; at > 0 && movers[at - 1].share < share * (1.0 - 1e-6); at--)
            if (at < most)
                movers[at] = movers[at - 1];
        if (at < most)
            movers[at] = (kt_mover){begin + i, share, atan2(shape[2 * i + 1], shape[2 * i])};
    }
    const double first = count > 0 ? movers[0].phase : 0.0;
    for (int i = 0; i < count; i++)
        movers[i].phase = remainder(movers[i].phase - first, 2.0 * 3.14159265358979323846);
    return count;
}
