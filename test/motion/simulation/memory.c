/* Memory: all memory is the caller's and has the reported size. The contents of scratch do not matter, and nothing is
 * allocated after set-up. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "mechanics/dynamics/tree.h"
#include "scenes.h"

#include "model/model.h"
#include "simulation/simulation.h"

#include <stdlib.h>
#include <string.h>

static int count_records(const kt_record *record, void *user) {
    (void)record;
    ++*(int *)user;
    return 0;
}

KT_TEST(placed_simulation_stays_within_its_memory) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    kt_error error;
    kt_simulation *simulation = NULL;
    int records = 0;
    run.record = KT_RECORD_ENERGY | KT_RECORD_REACTION;
    size_t size = kt_simulation_size(model, &run, NULL), guard = 4096;
    unsigned char *memory = aligned_alloc(KT_ALIGNMENT, size + guard);
    memset(memory, 0x5A, size + guard);
    kt_need_fine("place", kt_simulation_init(model, &run, NULL, memory, size, &simulation, &error), &error);
    kt_test_run(simulation, count_records, &records);
    size_t touched = 0;
    for (size_t i = 0; i < guard; i++)
        touched += memory[size + i] != 0x5A;
    kt_check_equal_int("bytes touched beyond", (long long)touched, 0);
    kt_check_equal_int("records", records, 1001);

    kt_simulation *none = NULL;
    kt_check_equal_int("a byte less", kt_simulation_init(model, &run, NULL, memory, size - 1, &none, &error),
                       KT_ERROR_MEMORY);
    kt_check_equal_int("misaligned", kt_simulation_init(model, &run, NULL, memory + 8, size + 64, &none, &error),
                       KT_ERROR_MEMORY);
    kt_check_contains("message", error.message, "misaligned");
    kt_check_equal_int("none at all", kt_simulation_init(model, &run, NULL, NULL, size, &none, &error),
                       KT_ERROR_MEMORY);
    kt_check_contains("message", error.message, "given: 0 bytes");
    kt_check_true("no simulation", none == NULL);
    free(memory);
}

static void check_allocations(const char *integrator) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    lone.body.joint.velocity[4] = 1.0;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    kt_error error;
    kt_simulation *simulation = NULL;
    int records = 0;
    double torque[6] = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    kt_record sensed;
    run.record = KT_RECORD_ENERGY | KT_RECORD_REACTION;
    run.integrator = integrator;
    size_t size = kt_simulation_size(model, &run, NULL);
    void *memory = aligned_alloc(KT_ALIGNMENT, size), *block = NULL;
    kt_interpose_start();
    kt_need_fine("place", kt_simulation_init(model, &run, NULL, memory, size, &simulation, &error), &error);
    long placing = kt_interpose_stop();
    block = malloc(kt_simulation_state_size(simulation));
    kt_interpose_start();
    kt_status status = kt_simulation_set_torque(simulation, torque, &error);
    status = status == KT_OK ? kt_simulation_advance(simulation, 1.0, &error) : status;
    status = status == KT_OK ? kt_simulation_sense(simulation, &sensed, &error) : status;
    kt_simulation_save(simulation, block);
    status = status == KT_OK ? kt_simulation_run(simulation, count_records, &records, &error) : status;
    status = status == KT_OK ? kt_simulation_restore(simulation, block, &error) : status;
    status = status == KT_OK ? kt_simulation_acceleration(simulation, torque, &error) : status;
    long running = kt_interpose_stop();
    kt_check_equal_int("status", status, KT_OK);
    kt_check_equal_int("allocations while placing", placing, 0);
    kt_check_equal_int("allocations while running", running, 0);
    kt_check_equal_int("records", records, 901);
    free(memory);
    free(block);
}

KT_TEST(nothing_allocates_after_placing) {
    static const char *const methods[] = {"dop853", "radau5", "rodas5p", "auto"};
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++)
        check_allocations(methods[i]);
}

KT_TEST(creation_that_fails_leaks_nothing) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_error error;
    kt_simulation *simulation = NULL;
    kt_interpose_start_failing(1);
    kt_status status = kt_simulation_create(model, NULL, NULL, &simulation, &error);
    (void)kt_interpose_stop();
    kt_check_equal_int("no memory", status, KT_ERROR_MEMORY);
    kt_run run = kt_run_default();
    run.relative = -1.0; /* found by the integrator, when the memory is there already */
    kt_interpose_start();
    status = kt_simulation_create(model, &run, NULL, &simulation, &error);
    long allocations = kt_interpose_stop();
    kt_check_equal_int("tolerance below zero", status, KT_ERROR_ARGUMENT);
    kt_check_equal_int("given back", kt_interpose_frees(), allocations);
    kt_check_true("no simulation", simulation == NULL);
}

/* ---- scratch ----------------------------------------------------------------------------------------------------- */

/* Fills all that is scratch with bytes that are no sensible number. */
static void poison(kt_simulation *simulation, int byte) {
    const kt_simulation_sizes *size = &simulation->size;
    kt_data *data = simulation->data;
    const kt_counts *n = &simulation->model->n;
    memset(simulation->y, byte, size->n * sizeof(double));
    memset(simulation->a, byte, size->nv * sizeof(double));
    memset(simulation->reaction, byte, size->reaction * sizeof(kt_wrench));
#define KT_POISON(type, name, count, meaning) memset(data->name, byte, (count) * sizeof(type));
    KT_DATA_FIELDS(KT_POISON)
#undef KT_POISON
}

typedef struct kt_poisoner {
    kt_simulation *simulation;
    kt_kept *kept;
    int byte; /* < 0: none */
} kt_poisoner;

static int keep_and_poison(const kt_record *record, void *user) {
    kt_poisoner *p = user;
    int result = kt_keep(record, p->kept);
    if (p->byte >= 0)
        poison(p->simulation, p->byte);
    return result;
}

static kt_kept *run_poisoned(const kt_tree *tree, const kt_tree_state *state, int byte) {
    kt_run run = kt_run_default();
    kt_error error;
    run.duration = 0.5;
    run.interval = 0.01;
    run.relative = run.absolute = 1e-6;
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY | KT_RECORD_REACTION;
    kt_poisoner p = {kt_test_simulation(tree->model, &run, NULL), kt_kept_empty(tree->model), byte};
    (void)kt_fine("state", kt_simulation_set_state(p.simulation, 0.0, state->q, state->v, &error), &error);
    kt_test_run(p.simulation, keep_and_poison, &p);
    return p.kept;
}

KT_TEST(garbage_in_scratch_changes_no_bit) {
    static const int bytes[] = {0xFF, 0x7F, 0xA5};
    static kt_tree tree;
    static kt_tree_state state;
    static kt_kept clean;
    kt_random random = kt_random_of_test();
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = 7;
    kt_tree_grow(&tree, &plan, &random);
    kt_tree_state_draw(&tree, &random, &state);
    clean = *run_poisoned(&tree, &state, -1);
    kt_check_equal_int("records", clean.count, 51);
    for (size_t i = 0; i < sizeof bytes / sizeof bytes[0]; i++) {
        const kt_kept *kept = run_poisoned(&tree, &state, bytes[i]);
        kt_check_equal_int("records", kept->count, clean.count);
        kt_check_equal_bits("states and accelerations", kept->state[0], clean.state[0],
                            (size_t)clean.count * KT_KEPT_NUMBERS);
        kt_check_equal_bits("energies", kept->energy, clean.energy, (size_t)clean.count);
    }
}
