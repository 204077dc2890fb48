/* Model and workspace in one static buffer.
 *
 * Firmware reserves its memory when it is linked. The compilation of a mechanism uses the allocator, once, at start-up.
 * kt_model_copy then moves the result into the program's static buffer, which also contains the simulation and its
 * checkpoint. From then on the heap is not used. Memory that is one byte short or misaligned is rejected, with a
 * message that states by how much.
 *
 *     static_memory [--csv FILE]
 *
 * The plant: a cart on a rail with a double pendulum, driven by a force on the cart that is set every millisecond. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { POOL = 64 * 1024, STEPS = 4000, NV = 3 };

static _Alignas(KT_ALIGNMENT) unsigned char pool[POOL];
static size_t used;

/* Returns the next bytes of the pool, aligned; NULL if too few are left. */
static void *take_from_pool(size_t size) {
    const size_t rounded = (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    if (rounded > POOL - used)
        return NULL;
    used += rounded;
    return pool + used - rounded;
}

static kt_body make_rod(const char *name, const char *parent, double at, double angle) {
    kt_body body = kt_body_default();
    body.name = name;
    body.parent = parent;
    body.joint.type = KT_JOINT_REVOLUTE;
    body.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    body.joint.at = kt_vec3_make(0.0, at, 0.0);
    body.joint.position[0] = angle;
    body.mass = 0.3;
    body.com = kt_vec3_make(0.0, -0.25, 0.0);
    body.inertia = kt_sym3_make(6.25e-3, 1e-5, 6.25e-3, 0.0, 0.0, 0.0);
    return body;
}

static kt_status compile_in_pool(kt_model **model, kt_error *error) {
    kt_body bodies[3] = {kt_body_default(), make_rod("upper", "cart", 0.0, 0.5), make_rod("lower", "upper", -0.5, 0.0)};
    kt_description description = kt_description_default();
    bodies[0].name = "cart";
    bodies[0].joint.type = KT_JOINT_PRISMATIC;
    bodies[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    bodies[0].mass = 1.0;
    description.name = "cart and double pendulum";
    description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    description.bodies = bodies;
    description.body_count = 3;
    return kt_model_compile(&description, NULL, model, error);
}

static int report_error(const kt_error *error) {
    fprintf(stderr, "static_memory: %s%s%s\n", error->where, error->where[0] ? ": " : "", error->message);
    return 1;
}

/* One control step of 1 ms: this force on the cart replaces a controller. */
static kt_status tick(kt_simulation *simulation, int step, kt_error *error) {
    const double t = 1e-3 * step;
    const double torque[NV] = {2.0 * sin(3.0 * t), 0.0, 0.0};
    const kt_status status = kt_simulation_set_torque(simulation, torque, error);
    return status == KT_OK ? kt_simulation_tick(simulation, 1e-3, error) : status;
}

/* Runs control steps first .. last - 1 from the present state; writes a row of the CSV file, if there is one, every 10
 * ms. */
static kt_status run_control_steps(kt_simulation *simulation, int first, int last, FILE *csv, kt_error *error) {
    for (int step = first; step < last; step++) {
        const double *q = kt_simulation_positions(simulation);
        if (csv && step % 10 == 0)
            fprintf(csv, "%.3f,%.17g,%.17g,%.17g\n", 1e-3 * step, q[0], q[1], q[2]);
        const kt_status status = tick(simulation, step, error);
        if (status != KT_OK)
            return status;
    }
    return KT_OK;
}

/* Returns whether unsuitable memory is rejected, and prints the messages. */
static bool rejects(const kt_model *model, void *memory, size_t size) {
    kt_model *copy = NULL;
    kt_error error;
    const bool short_rejected = kt_model_copy(model, memory, size - 1, &copy, &error) == KT_ERROR_MEMORY;
    printf("a byte short:   %s\n", error.message);
    const bool shift_rejected =
        kt_model_copy(model, (unsigned char *)memory + 8, size, &copy, &error) == KT_ERROR_MEMORY;
    printf("misaligned:     %s\n", error.message);
    return short_rejected && shift_rejected && !copy;
}

/* Compiles the model, copies it into the pool and releases the original on the heap. */
static kt_status settle_in_pool(kt_model **model, kt_error *error) {
    kt_model *compiled = NULL;
    kt_status status = compile_in_pool(&compiled, error);
    if (status != KT_OK)
        return status;
    const size_t size = kt_model_size(compiled);
    void *memory = take_from_pool(size);
    if (!memory || !rejects(compiled, memory, size))
        status = kt_error_set(error, KT_ERROR_MEMORY, "settle", "the pool is too small, or too much was accepted");
    else
        status = kt_model_copy(compiled, memory, size, model, error);
    kt_model_free(compiled);
    return status;
}

/* Copies the state (q, v). */
static void copy_state(const kt_simulation *simulation, double state[2 * NV]) {
    memcpy(state, kt_simulation_positions(simulation), NV * sizeof *state);
    memcpy(state + NV, kt_simulation_velocities(simulation), NV * sizeof *state);
}

/* Runs the whole simulation with a workspace on the heap. */
static kt_status run_on_heap(const kt_model *model, const kt_run *plan, double end[2 * NV], kt_error *error) {
    kt_simulation *simulation = NULL;
    kt_status status = kt_simulation_create(model, plan, NULL, &simulation, error);
    if (status == KT_OK)
        status = run_control_steps(simulation, 0, STEPS, NULL, error);
    if (status == KT_OK)
        copy_state(simulation, end);
    kt_simulation_free(simulation);
    return status;
}

static int demonstrate(FILE *csv) {
    kt_error error = {0};
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_run plan = kt_run_default();
    if (settle_in_pool(&model, &error) != KT_OK)
        return report_error(&error);

    plan.integrator = "rk4";
    plan.step = 1e-3;
    plan.duration = 1e-3 * STEPS;
    const size_t size = kt_simulation_size(model, &plan, NULL);
    if (kt_simulation_init(model, &plan, NULL, take_from_pool(size), size, &simulation, &error) != KT_OK)
        return report_error(&error);
    const size_t state_size = kt_simulation_state_size(simulation);
    void *checkpoint = take_from_pool(state_size);
    if (!checkpoint)
        return fprintf(stderr, "static_memory: the pool is too small\n"), 1;
    printf("one static buffer: model %zu, simulation %zu, checkpoint %zu: %zu of %d bytes\n", kt_model_size(model),
           size, state_size, used, POOL);

    double end[2 * NV], again[2 * NV], heap[2 * NV];
    if (csv)
        fprintf(csv, "time,position.cart,position.upper,position.lower\n");
    if (run_control_steps(simulation, 0, STEPS / 2, csv, &error) !=
        KT_OK) /* a checkpoint is saved after the first half */
        return report_error(&error);
    kt_simulation_save(simulation, checkpoint);
    if (run_control_steps(simulation, STEPS / 2, STEPS, csv, &error) != KT_OK)
        return report_error(&error);
    copy_state(simulation, end);

    /* The second half, repeated from the checkpoint, and the whole run on the heap must give identical bits. */
    if (kt_simulation_restore(simulation, checkpoint, &error) != KT_OK ||
        run_control_steps(simulation, STEPS / 2, STEPS, NULL, &error) != KT_OK ||
        run_on_heap(model, &plan, heap, &error) != KT_OK)
        return report_error(&error);
    copy_state(simulation, again);
    printf("after %d steps: cart %.9f m, rods %.9f and %.9f rad\n", STEPS, end[0], end[1], end[2]);
    printf("the second half again from the checkpoint: %s\n",
           memcmp(end, again, sizeof end) == 0 /* NOLINT: compares bits */ ? "same bits" : "DIFFERENT");
    printf("all of it with a workspace on the heap: %s\n",
           memcmp(end, heap, sizeof end) == 0 /* NOLINT: compares bits */ ? "same bits" : "DIFFERENT");
    return 0;
}

int main(int argc, char **argv) {
    FILE *csv = argc == 3 && strcmp(argv[1], "--csv") == 0 ? fopen(argv[2], "w") : NULL;
    if (argc > 1 && !csv)
        return fprintf(stderr, "usage: static_memory [--csv FILE], a file that can be written\n"), 1;
    const int status = demonstrate(csv);
    if (csv && fclose(csv) != 0 && status == 0)
        return fprintf(stderr, "static_memory: %s cannot be written\n", argv[2]), 1;
    return status;
}
