/* Small mechanisms with loops and effects, moved for a moment. A result that a call accepts is a number. A rejected
 * call leaves its outputs unchanged. Loops that are reported as closed are closed, and a state that is undone is the
 * same as before.
 *
 * All memory has exactly the required size, so that the address sanitizer detects an access beyond it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion.h"
#include "fuzz.h"

#include "assembly/project.h"
#include "model/model.h"

#include <stdlib.h>
#include <string.h>

bool kt_fuzz_all_finite(const double *x, int count) {
    for (int i = 0; i < count; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

static bool is_number(double x) { return !isnan(x); }

void *kt_fuzz_take(size_t size) {
    void *memory = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_fuzz_must(memory != NULL, "there is memory");
    memset(memory, 0xA5, size); /* numbers that nobody has written would be large, and differ */
    return memory;
}

static double *take_numbers(int count) {
    double *x = malloc((size_t)count * sizeof *x + (count == 0));
    kt_fuzz_must(x != NULL, "there is memory");
    for (int i = 0; i < count; i++)
        x[i] = -1.5;
    return x;
}

/* ---- loops closed where the mechanism stands --------------------------------------------------------------------- */

/* Turns and moves the second end of a loop to the first, in the present state of the tree. */
static void close_loop(const kt_model *model, const kt_data *data, kt_loop *loop) {
    const int a = loop->between[0].body == NULL ? 0 : kt_body_find(model, loop->between[0].body),
              b = loop->between[1].body == NULL ? 0 : kt_body_find(model, loop->between[1].body);
    kt_mat3 turn;
    if (a < 0 || b < 0 || kt_rotation_evaluate(&loop->between[0].rotation, &turn, NULL) != KT_OK)
        return;
    loop->between[0].marker = loop->between[1].marker = NULL;
    const kt_pose first = kt_body_pose(model, data, a), second = kt_body_pose(model, data, b);
    const kt_mat3 back = kt_mat3_transpose(second.rotation);
    const kt_vec3 point = kt_point_position(model, data, a, loop->between[0].at);
    loop->between[1].at = kt_mat3_apply(back, kt_vec3_sub(point, second.position));
    loop->between[1].rotation = kt_rotation_matrix(kt_mat3_multiply(back, kt_mat3_multiply(first.rotation, turn)));
}

/* Closes the loops in the initial state, except those in `spared`, one bit each. Loops that are closed already stay
 * so. */
static void close_loops(kt_fuzz_mechanism *m, unsigned spared) {
    kt_description tree = m->description;
    kt_model *model = NULL;
    kt_data *data = NULL;
    tree.loop_count = tree.effect_count = tree.hold_count = 0;
    if (kt_model_compile(&tree, NULL, &model, NULL) != KT_OK)
        return;
    double *q = take_numbers(kt_model_nq(model)), *v = take_numbers(kt_model_nv(model));
    kt_model_initial(model, q, v);
    if (kt_data_create(model, &data, NULL) == KT_OK && kt_kinematics_update(model, data, q, NULL, NULL, NULL) == KT_OK)
        for (int i = 0; i < m->description.loop_count; i++)
            if ((spared & 1U << i) == 0 && m->loop[i].type != KT_LOOP_COUPLING && m->loop[i].type != KT_LOOP_MOTION &&
                m->loop[i].type != KT_LOOP_RATES && m->loop[i].type != KT_LOOP_KNIFE_EDGE &&
                m->loop[i].type != KT_LOOP_SURFACE && m->loop[i].type != KT_LOOP_CURVE &&
                m->loop[i].type != KT_LOOP_DISTANCE && m->loop[i].type != KT_LOOP_ROLLING)
                close_loop(model, data, &m->loop[i]);
    free(q);
    free(v);
    kt_data_free(data);
    kt_model_free(model);
}

/* ---- one state --------------------------------------------------------------------------------------------------- */

typedef struct scene {
    const kt_model *model;
    void *memory;
    kt_data *data;
    int nq, nv, bodies, loops;
    double t;
    double *q, *v, *tau, *a;
    kt_wrench *external, *joints, *reactions;
} scene;

static void check_kept(const scene *s, const double *q, const double *v, const char *what) {
    kt_fuzz_must(memcmp(q, s->q, (size_t)s->nq * sizeof *q) == 0 && memcmp(v, s->v, (size_t)s->nv * sizeof *v) == 0,
                 "%s: a failure leaves the state untouched", what);
}

/* The bound of kt_state_assemble, against the largest scale that an equation has. */
static void check_closed(const scene *s) {
    kt_residual residual;
    double scale = fmax(1.0, s->model->length), unit = 1.0, sum = 0.0;
    for (size_t i = 0; i < s->model->n.group_v; i++)
        unit = fmax(unit, s->model->unit[i]);
    for (size_t i = 0; i < s->model->n.term; i++)
        sum += fabs(s->model->term[i].coefficient);
    if (kt_loop_residual(s->model, s->data, s->t, s->q, s->v, &residual, NULL) != KT_OK)
        return; /* too large to be had */
    scale = fmax(scale, sum * unit);
    kt_fuzz_must(residual.position <= 2.0 * KT_CLOSED_ASSEMBLED * scale, "assembled loops are closed: %g of %g",
                 residual.position, scale);
}

static bool assemble(scene *s) {
    double *q = take_numbers(s->nq), *v = take_numbers(s->nv);
    memcpy(q, s->q, (size_t)s->nq * sizeof *q);
    memcpy(v, s->v, (size_t)s->nv * sizeof *v);
    const kt_status status = kt_state_assemble(s->model, s->data, s->t, s->q, s->v, NULL);
    if (status != KT_OK)
        check_kept(s, q, v, "assembly");
    else
        kt_fuzz_must(kt_fuzz_all_finite(s->q, s->nq) && kt_fuzz_all_finite(s->v, s->nv),
                     "an assembled state is finite");
    free(q);
    free(v);
    return status == KT_OK;
}

static void check_projection(scene *s) {
    double *q = take_numbers(s->nq), *v = take_numbers(s->nv);
    bool changed = false;
    memcpy(q, s->q, (size_t)s->nq * sizeof *q);
    memcpy(v, s->v, (size_t)s->nv * sizeof *v);
    if (kt_state_project(s->model, s->data, s->t, q, v, &changed, NULL) != KT_OK)
        check_kept(s, q, v, "projection");
    else
        kt_fuzz_must(kt_fuzz_all_finite(q, s->nq) && kt_fuzz_all_finite(v, s->nv), "a projected state is finite");
    free(q);
    free(v);
}

/* False where there is no acceleration. */
static bool check_acceleration(scene *s) {
    double *again = take_numbers(s->nv);
    kt_power power = {-7.0, -7.0};
    kt_error error = {KT_OK, "", ""};
    const kt_status status =
        kt_acceleration_evaluate(s->model, s->data, s->t, s->q, s->v, s->tau, s->external, s->a, &error);
    const kt_status with_power =
        kt_power_evaluate(s->model, s->data, s->t, s->q, s->v, s->tau, s->external, again, &power, NULL);
    for (int i = 0; i < s->nv; i++) {
        kt_fuzz_must(status == KT_OK ? isfinite(s->a[i]) : s->a[i] == -1.5, "accelerations are finite, or untouched");
        kt_fuzz_must(with_power == KT_OK || again[i] == -1.5, "rejected, they are untouched");
        kt_fuzz_must(with_power != KT_OK || status != KT_OK || memcmp(&again[i], &s->a[i], sizeof *again) == 0,
                     "the same with powers");
    }
    kt_fuzz_must(status == KT_OK || (error.code == status && error.message[0] != '\0'), "what fails is said in words");
    kt_fuzz_must(with_power == KT_OK ? is_number(power.dissipated) && is_number(power.supplied)
                                     : power.dissipated == -7.0 && power.supplied == -7.0,
                 "powers are numbers, or untouched: %g, %g", power.dissipated, power.supplied);
    free(again);
    return status == KT_OK;
}

static void check_wrenches(const kt_wrench *w, int count, bool fine, const char *what) {
    for (int i = 0; i < count; i++) {
        const double sum = w[i].force.x + w[i].force.y + w[i].force.z + w[i].moment.x + w[i].moment.y + w[i].moment.z;
        kt_fuzz_must(fine ? is_number(sum) : sum == 6.0 * -1.5, "%s are numbers, or untouched", what);
    }
}

static void check_forces(scene *s) {
    double *tau = take_numbers(s->nv), *drift = NULL, *jacobian = NULL;
    const kt_status inverse = kt_dynamics_inverse(s->model, s->data, s->q, s->v, s->a, s->external, tau, NULL);
    kt_fuzz_must(inverse != KT_OK || kt_fuzz_all_finite(tau, s->nv), "forces are finite");
    const kt_status reaction =
        kt_reaction_evaluate(s->model, s->data, s->t, s->q, s->v, s->tau, s->external, s->joints, s->reactions, NULL);
    check_wrenches(s->joints, s->bodies, reaction == KT_OK, "reactions in joints");
    check_wrenches(s->reactions, s->loops, reaction == KT_OK, "reactions in loops");
    const int rows = kt_model_mobility(s->model).equations;
    drift = take_numbers(rows);
    jacobian = take_numbers(rows * s->nv);
    const kt_status equations =
        kt_loop_equations(s->model, s->data, s->t, s->q, s->v, jacobian, NULL, NULL, drift, NULL);
    kt_fuzz_must(equations != KT_OK || (kt_fuzz_all_finite(jacobian, rows * s->nv) && kt_fuzz_all_finite(drift, rows)),
                 "equations are finite");
    free(tau);
    free(drift);
    free(jacobian);
}

static void check_totals(scene *s) {
    double *mass = take_numbers(s->nv * s->nv);
    kt_vec3 center;
    if (kt_dynamics_mass(s->model, s->data, s->q, mass, NULL) == KT_OK)
        kt_fuzz_must(kt_fuzz_all_finite(mass, s->nv * s->nv), "masses are finite");
    free(mass);
    if (kt_kinematics_update(s->model, s->data, s->q, s->v, NULL, NULL) != KT_OK)
        return;
    kt_fuzz_must(is_number(kt_kinetic_energy(s->model, s->data)), "kinetic energy is a number");
    kt_fuzz_must(is_number(kt_potential_energy(s->model, s->data)), "potential energy is a number");
    kt_fuzz_must(is_number(kt_mass_center(s->model, s->data, &center)), "mass is a number");
    const kt_wrench momentum = kt_momentum(s->model, s->data);
    kt_fuzz_must(is_number(momentum.force.x) && is_number(momentum.moment.x), "momentum is a number");
}

static void place_scene(scene *s, const kt_model *model) {
    s->model = model;
    s->nq = kt_model_nq(model);
    s->nv = kt_model_nv(model);
    s->bodies = kt_model_body_count(model);
    s->loops = kt_loop_count(model);
    const size_t size = kt_data_size(model);
    s->memory = kt_fuzz_take(size);
    kt_fuzz_must(kt_data_init(model, s->memory, size, &s->data, NULL) == KT_OK, "data are placed");
    s->q = take_numbers(s->nq);
    s->v = take_numbers(s->nv);
    s->a = take_numbers(s->nv);
    s->joints = (kt_wrench *)(void *)take_numbers(6 * s->bodies);
    s->reactions = (kt_wrench *)(void *)take_numbers(6 * s->loops);
}

static void free_scene(scene *s) {
    free(s->memory);
    free(s->q);
    free(s->v);
    free(s->a);
    free(s->tau);
    free(s->external);
    free(s->joints);
    free(s->reactions);
}

/* Joint forces and wrenches, or none. */
static void draw_loads(kt_bytes *bytes, kt_wildness wild, scene *s) {
    const unsigned chosen = kt_bytes_next(bytes);
    if ((chosen & 1U) != 0) {
        s->tau = take_numbers(s->nv);
        for (int i = 0; i < s->nv; i++)
            s->tau[i] = kt_bytes_number(bytes, wild);
    }
    if ((chosen & 2U) != 0) {
        double *x = take_numbers(6 * s->bodies);
        for (int i = 6; i < 6 * s->bodies; i++)
            x[i] = kt_bytes_number(bytes, wild);
        s->external = (kt_wrench *)(void *)x;
    }
    s->t = (chosen & 4U) != 0 ? kt_bytes_number(bytes, wild) : 0.0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static kt_fuzz_mechanism m;
    kt_bytes bytes = {data, data + size};
    kt_model *model = NULL;
    scene s = {0};
    kt_formulation formulation;
    const kt_model_options options = kt_fuzz_options(&bytes, &formulation);
    const unsigned spared = kt_bytes_next(&bytes);
    kt_fuzz_describe(&bytes, &m);
    close_loops(&m, spared);
    if (kt_model_compile(&m.description, &options, &model, NULL) != KT_OK)
        return 0;
    place_scene(&s, model);
    draw_loads(&bytes, m.wild < KT_WILD_NUMBERS ? m.wild : KT_WILD_NUMBERS, &s);
    kt_model_initial(model, s.q, s.v);
    if (assemble(&s)) {
        check_closed(&s);
        check_projection(&s);
        if (check_acceleration(&s))
            check_forces(&s);
        check_totals(&s);
    }
    kt_absolute *absolute = kt_fuzz_absolute(&m.description, &options, model, formulation);
    kt_fuzz_simulate(&bytes, model, absolute);
    kt_absolute_free(absolute);
    free_scene(&s);
    kt_model_free(model);
    return 0;
}
