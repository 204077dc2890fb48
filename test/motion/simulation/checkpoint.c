/* Checkpoints: after one is taken back, everything that follows has the bits that it would have had. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"
#include "scenes.h"

#include "simulation/checkpoint.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A random tree with forces on every freedom and wrenches on every body. */
typedef struct kt_stage {
    kt_tree tree;
    kt_tree_state state;
} kt_stage;

static void set_stage(kt_stage *stage) {
    kt_random random = kt_random_of_test();
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = 6;
    kt_tree_grow(&stage->tree, &plan, &random);
    kt_tree_state_draw(&stage->tree, &random, &stage->state);
}

static kt_resumption resumption_of(const kt_stage *stage, const kt_run *run) {
    const kt_tree_state *state = &stage->state;
    return (kt_resumption){.model = stage->tree.model,
                           .run = run,
                           .q = state->q,
                           .v = state->v,
                           .torque = state->tau,
                           .external = state->external};
}

static kt_simulation *begin(const kt_stage *stage, const kt_run *run) {
    const kt_resumption r = resumption_of(stage, run);
    return kt_resumption_start(&r);
}

/* Record 17 lies within a step. */
static void compare_runs(const kt_stage *stage, const kt_run *run) {
    const kt_resumption r = resumption_of(stage, run);
    kt_note("%s, step %g", run->integrator, run->step);
    kt_check_equal_int("records", kt_resumption_check(&r, 17), 41);
}

KT_TEST(restored_simulation_goes_on_bit_for_bit) {
    static const char *const methods[] = {
        "rk4",     "dopri5", "tsit5",    "dop853",         "bs32",           "ab2", "ab4", "radau5",
        "rodas5p", "bdf2",   "two-step", "crank-nicolson", "implicit-euler", "auto"};
    static kt_stage stage;
    set_stage(&stage);
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++) {
        kt_run run = kt_run_fixed(methods[i], 0.03, 0.4);
        run.interval = 0.01;
        run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY;
        run.relative = run.absolute = 1e-7;
        compare_runs(&stage, &run);
        run.step = 0.0;
        if (kt_method_find(methods[i])->embedded_order > 0)
            compare_runs(&stage, &run);
    }
}

/* The run sets rho. With rho = 0 the run has the bits of bdf2, and a method of the caller with the same rho has the
 * bits of the run. A checkpoint with one rho is rejected by a run with another. */
KT_TEST(a_run_chooses_rho_and_its_checkpoint_knows_it) {
    static kt_stage stage;
    kt_error error;
    set_stage(&stage);
    kt_run run = kt_run_fixed("two-step", 0.02, 1.0), bdf = kt_run_fixed("bdf2", 0.02, 1.0);
    kt_method own = *kt_method_find("two-step");
    kt_simulation_options options = kt_simulation_options_default();
    own.rho = 0.2;
    options.method = &own;
    run.rho = 0.0;
    kt_simulation *none = begin(&stage, &run), *two = begin(&stage, &bdf);
    run.rho = 0.2;
    kt_simulation *some = begin(&stage, &run), *callers = kt_test_simulation(stage.tree.model, &bdf, &options);
    kt_simulation *all[] = {none, two, some, callers};
    const size_t nq = (size_t)stage.tree.nq;
    for (int i = 0; i < 4; i++) {
        (void)kt_fine("state", kt_simulation_set_state(all[i], 0.0, stage.state.q, stage.state.v, &error), &error);
        (void)kt_fine("torque", kt_simulation_set_torque(all[i], stage.state.tau, &error), &error);
        (void)kt_fine("wrenches", kt_simulation_set_wrenches(all[i], stage.state.external, &error), &error);
        kt_test_advance(all[i], 0.2);
    }
    kt_check_equal_bits("rho = 0 and bdf2", kt_simulation_positions(none), kt_simulation_positions(two), nq);
    kt_check_equal_bits("rho = 0.2 and the caller's", kt_simulation_positions(some), kt_simulation_positions(callers),
                        nq);
    kt_check_true("rho makes a difference",
                  memcmp(kt_simulation_positions(none), kt_simulation_positions(some), nq * sizeof(double)) != 0);
    void *block = malloc(kt_simulation_state_size(some));
    kt_simulation_save(some, block);
    kt_check_equal_int("the caller's goes on", kt_simulation_restore(callers, block, &error), KT_OK);
    kt_check_equal_int("another rho does not", kt_simulation_restore(none, block, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "another integrator: two-step 0.2");
    free(block);
}

/* A checkpoint includes the inputs that are set and wait for the next step. */
KT_TEST(checkpoint_keeps_torques_that_wait) {
    static kt_stage stage;
    kt_run run = kt_run_fixed("dopri5", 0.02, 1.0);
    kt_error error;
    set_stage(&stage);
    size_t nv = (size_t)stage.tree.nv;
    kt_simulation *simulation = begin(&stage, &run);
    (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
    for (size_t i = 0; i < nv; i++)
        stage.state.tau[i] *= -2.0;
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, stage.state.tau, &error), &error);
    kt_simulation *other = kt_test_simulation(stage.tree.model, &run, NULL);
    kt_need(kt_scene_hand_over(simulation, other));
    (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
    (void)kt_fine("step", kt_simulation_step(other, HUGE_VAL, &error), &error);
    kt_check_equal_bits("velocities", kt_simulation_velocities(other), kt_simulation_velocities(simulation), nv);
}

/* Checks that a block is rejected in these words, and that the simulation stays as it was. */
static void check_restore(const char *what, kt_simulation *simulation, const void *block, kt_status expected,
                          const char *words) {
    const size_t size = kt_simulation_state_size(simulation);
    void *before = malloc(size), *after = malloc(size);
    kt_error error = {KT_OK, "", ""};
    kt_need(kt_check_true("memory", before != NULL && after != NULL));
    kt_simulation_save(simulation, before);
    kt_check_equal_int(what, kt_simulation_restore(simulation, block, &error), expected);
    kt_check_contains("message", error.message, words);
    kt_simulation_save(simulation, after);
    kt_check_true("the state is what it was", memcmp(before, after, size) == 0);
    free(before);
    free(after);
}

KT_TEST(wrong_checkpoint_is_rejected_and_changes_nothing) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    kt_model *another = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL),
                  *stranger = kt_test_simulation(another, NULL, NULL);
    kt_run run = kt_run_default();
    run.integrator = "tsit5";
    kt_simulation *other_method = kt_test_simulation(model, &run, NULL);
    void *block = calloc(1, kt_simulation_state_size(stranger));
    kt_error error;
    (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
    check_restore("zeros", simulation, block, KT_ERROR_ARGUMENT, "not a checkpoint");
    kt_simulation_save(stranger, block);
    check_restore("another model", simulation, block, KT_ERROR_ARGUMENT, "another model");
    kt_simulation_save(other_method, block);
    check_restore("another method", simulation, block, KT_ERROR_ARGUMENT, "tsit5");
    free(block);
}

/* ---- settings ---------------------------------------------------------------------------------------------------- */

/* A block of a simulation with this run and these options is rejected by one with the others, and changes nothing. */
static int pause_at_record(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 1;
}

/* The checkpoint is taken after the first record. */
static void check_rejected(const kt_model *model, const kt_run *run, const kt_simulation_options *options,
                           const kt_run *other_run, const kt_simulation_options *other_options, const char *words) {
    kt_simulation *from = kt_test_simulation(model, run, options);
    kt_simulation *to = kt_test_simulation(model, other_run, other_options);
    kt_error error = {KT_OK, "", ""};
    const size_t size = kt_simulation_state_size(from);
    void *block = malloc(size);
    kt_check_equal_int("sizes", (long long)kt_simulation_state_size(to), (long long)size);
    kt_check_equal_int("pauses", kt_simulation_run(from, pause_at_record, NULL, &error), KT_ERROR_CALLBACK);
    (void)kt_fine("step", kt_simulation_step(from, 0.1, &error), &error);
    kt_simulation_save(from, block);
    check_restore(words, to, block, KT_ERROR_ARGUMENT, words);
    free(block);
}

/* One step of a checkpoint taken by 1e-3 s covered 1.5 s where the other simulation had steps of 2.5e-3 s. */
KT_TEST(checkpoint_of_other_settings_is_rejected_in_words) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    const kt_run fixed = kt_run_fixed("rk4", 1e-3, 3.0), adaptive = kt_run_fixed("dopri5", 0.0, 3.0);
    const kt_simulation_options plain = kt_simulation_options_default();
    kt_run run = fixed;
    kt_simulation_options options = plain;
    run.step = 2.5e-3;
    check_rejected(model, &fixed, &plain, &run, &plain,
                   "made with a step of 0.001, and this simulation has 0.0025; "
                   "kt_simulation_set_state takes over the time and the state alone");
    run = fixed;
    run.duration = 4.0;
    check_rejected(model, &fixed, &plain, &run, &plain, "a duration of 3, and this simulation has 4");
    run = fixed;
    run.interval = 0.5;
    check_rejected(model, &fixed, &plain, &run, &plain, "an interval between records of 0.003,");
    options.unprojected = true;
    check_rejected(model, &fixed, &plain, &fixed, &options, "the option 'unprojected' at 0,");
    run = adaptive;
    run.relative = 1e-6;
    check_rejected(model, &adaptive, &plain, &run, &plain, "a relative tolerance of 1e-09, and");
    run = adaptive;
    run.absolute = 1e-6;
    check_rejected(model, &adaptive, &plain, &run, &plain, "an absolute tolerance of 1e-09, and");
    options = plain;
    options.max_step = 0.01;
    check_rejected(model, &adaptive, &plain, &adaptive, &options, "a longest step of 0, and");
    options = plain;
    options.max_steps = 1000;
    check_rejected(model, &adaptive, &plain, &adaptive, &options, "a largest number of steps of 0, and");
}

/* A block fits a model by its structure: one whose body has another name is another, a copy with another mass is
 * not. */
KT_TEST(checkpoint_knows_the_structure_of_its_model) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    const kt_run run = kt_run_fixed("rk4", 1e-3, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    lone.body.mass *= 2.0;
    kt_model *heavier = kt_scene_compile(&lone.description);
    lone.body.name = "somebody_else";
    kt_model *other = kt_scene_compile(&lone.description);
    kt_simulation *a = kt_test_simulation(model, &run, NULL), *b = kt_test_simulation(heavier, &run, NULL),
                  *c = kt_test_simulation(other, &run, NULL);
    kt_error error = {KT_OK, "", ""};
    void *block = malloc(kt_simulation_state_size(a));
    (void)kt_fine("step", kt_simulation_step(a, HUGE_VAL, &error), &error);
    kt_simulation_save(a, block);
    (void)kt_fine("another mass", kt_simulation_restore(b, block, &error), &error);
    kt_check_equal_int("another name", kt_simulation_restore(c, block, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "with the same number of coordinates, but other names, types");
    free(block);
}

/* Looking ahead with coarser steps: they are counted from the time that is taken over. */
KT_TEST(state_is_taken_over_by_a_simulation_with_coarser_steps) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    const kt_run fine = kt_run_fixed("rk4", 1e-3, 3.0), coarse = kt_run_fixed("rk4", 2.5e-3, 3.0);
    kt_simulation *plant = kt_test_simulation(model, &fine, NULL), *ahead = kt_test_simulation(model, &coarse, NULL);
    kt_error error;
    kt_test_advance(plant, 1.001);
    (void)kt_fine("state",
                  kt_simulation_set_state(ahead, kt_simulation_time(plant), kt_simulation_positions(plant),
                                          kt_simulation_velocities(plant), &error),
                  &error);
    (void)kt_fine("step", kt_simulation_step(ahead, HUGE_VAL, &error), &error);
    kt_check_near("a step", kt_simulation_time(ahead), 1.0035, 4.5e-16);
    kt_test_advance(ahead, 2.0);
    kt_test_advance(plant, 2.0);
    /* rk4 with h = 2.5e-3 on a pendulum of 1 m. The error is h^4 times the fourth derivatives, some 1e-10 in 1 s */
    kt_check_near("angle", kt_simulation_positions(ahead)[0], kt_simulation_positions(plant)[0], 1e-9);
}

/* Next to its kind and its method a checkpoint begins with four numbers of its model. */
KT_TEST(damaged_checkpoint_is_rejected_and_changes_nothing) {
    enum { NUMBERS = 48 };
    const double mark = 0.123456789;
    kt_lone lone;
    kt_pendulum_make(&lone, mark, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    const size_t size = kt_simulation_state_size(simulation);
    char *block = malloc(size), *before = malloc(size);
    kt_error error = {KT_OK, "", ""};
    kt_need(kt_check_true("memory", block != NULL && before != NULL));
    kt_simulation_save(simulation, before);
    for (size_t k = 0; k < 4; k++) {
        memcpy(block, before, size);
        block[NUMBERS + 8 * k] = (char)(block[NUMBERS + 8 * k] + 1);
        check_restore("a number", simulation, block, KT_ERROR_ARGUMENT, "the sum of its head, bytes 0 to ");
        kt_checkpoint_seal(simulation, block);
        check_restore("a number", simulation, block, KT_ERROR_ARGUMENT, "another model");
    }
    int found = 0;
    const double nan = (double)NAN;
    memcpy(block, before, size);
    for (size_t at = 0; at + sizeof mark <= size; at += sizeof mark)
        if (memcmp(block + at, &mark, sizeof mark) == 0) {
            memcpy(block + at, &nan, sizeof nan);
            found++;
        }
    kt_check_above("places of the angle", found, 1.0);
    kt_checkpoint_seal(simulation, block);
    check_restore("NaN in the state", simulation, block, KT_ERROR_NOT_FINITE, "is not finite");
    (void)kt_fine("undamaged, before any step", kt_simulation_restore(simulation, before, &error), &error);
    free(block);
    free(before);
}

/* Every byte is covered by a sum, whose part the error names. */
KT_TEST(every_changed_bit_of_a_checkpoint_is_rejected) {
    static kt_stage stage;
    set_stage(&stage);
    const kt_run run = kt_run_fixed("radau5", 0.03, 0.4);
    kt_simulation *simulation = begin(&stage, &run);
    const size_t size = kt_simulation_state_size(simulation);
    char *block = malloc(size);
    kt_error error = {KT_OK, "", ""};
    kt_need(kt_check_true("memory", block != NULL));
    kt_test_advance(simulation, 0.2);
    kt_simulation_save(simulation, block);
    size_t rejected = 0, damaged = 0;
    for (size_t bit = 0; bit < 8 * size; bit++) {
        block[bit / 8] = (char)(block[bit / 8] ^ (1 << bit % 8));
        rejected += kt_simulation_restore(simulation, block, &error) == KT_ERROR_ARGUMENT;
        damaged += strstr(error.message, "is damaged: the sum of its ") != NULL;
        block[bit / 8] = (char)(block[bit / 8] ^ (1 << bit % 8));
    }
    kt_check_equal_int("rejected", (int)rejected, (int)(8 * size));
    kt_check_equal_int("by a sum, except the 16 bytes of the kind", (int)damaged, (int)(8 * (size - 16)));
    (void)kt_fine("undamaged", kt_simulation_restore(simulation, block, &error), &error);
    free(block);
}

/* Right sums do not make an index right: a word out of its range is named. */
KT_TEST(words_out_of_range_are_rejected_although_the_sums_are_right) {
    kt_lone lone;
    kt_pendulum_make(&lone, 0.1, 0.0);
    kt_simulation *simulation = kt_test_simulation(kt_scene_compile(&lone.description), NULL, NULL);
    const size_t size = kt_simulation_state_size(simulation);
    char *block = malloc(size), *before = malloc(size);
    kt_need(kt_check_true("memory", block != NULL && before != NULL));
    kt_simulation_save(simulation, before);
    static const struct {
        const char *name;
        size_t at;
    } words[] = {{"stopped", offsetof(kt_simulation_memory, stopped)},
                 {"corrections.v", offsetof(kt_simulation_memory, corrections.v)},
                 {"contacts.undecided_loop", offsetof(kt_simulation_memory, contacts.undecided_loop)},
                 {"event_cut_of", offsetof(kt_simulation_memory, event_cut_of)},
                 {"next_record", offsetof(kt_simulation_memory, next_record)}};
    const size_t memory = kt_checkpoint_memory_at(simulation);
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        memcpy(block, before, size);
        memset(block + memory + words[i].at, 0xF7, sizeof(int));
        memset(block + memory + words[i].at + (i == 2 ? 0 : 4), 0xF7, sizeof(int));
        kt_checkpoint_seal(simulation, block);
        check_restore("out of range", simulation, block, KT_ERROR_ARGUMENT, words[i].name);
    }
    free(block);
    free(before);
}

/* A method of the caller's need not have a name. */
KT_TEST(checkpoint_of_a_method_without_a_name_goes_on) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_method nameless = *kt_method_find("rk4");
    kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_run_fixed("rk4", 0.1, 1.0);
    kt_error error;
    nameless.name = NULL;
    options.method = &nameless;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options),
                  *other = kt_test_simulation(model, &run, &options), *named = kt_test_simulation(model, &run, NULL);
    void *block = malloc(kt_simulation_state_size(simulation));
    (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
    kt_simulation_save(simulation, block);
    (void)kt_fine("restore", kt_simulation_restore(other, block, &error), &error);
    kt_check_equal_bits("angle", kt_simulation_positions(other), kt_simulation_positions(simulation), 1);
    kt_check_equal_int("one with a name", kt_simulation_restore(named, block, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("message", error.message, "another integrator");
    free(block);
}

/* Dampers that are so strong that auto leaves dopri5 and comes back. In the second simulation, the Jacobian is computed
 * again at each step. Its cost must not count when auto compares the costs of its two methods. */
KT_TEST(checkpoints_do_not_change_the_choice_of_auto) {
    static double block[512];
    kt_run run = kt_run_default();
    kt_lone lone;
    kt_effect effects[2] = {kt_effect_default(), kt_effect_default()};
    kt_error error;
    run.integrator = "auto";
    run.relative = run.absolute = 1e-3;
    kt_pendulum_make(&lone, 1.0, 0.0);
    effects[0].type = KT_EFFECT_JOINT_SPRING;
    effects[1].type = KT_EFFECT_MOTOR;
    effects[0].joint = effects[1].joint = lone.body.name;
    effects[0].stiffness = 5.0;
    effects[0].damping = 100.0;
    effects[1].torque = kt_function_sine(12.0, 3.5, 0.0, 0.0);
    lone.description.effects = effects;
    lone.description.effect_count = 2;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *whole = kt_test_simulation(model, &run, NULL), *now = kt_test_simulation(model, &run, NULL),
                  *next = kt_test_simulation(model, &run, NULL);
    kt_need(kt_check_below("bytes", (double)kt_simulation_state_size(whole), sizeof block));
    while (kt_simulation_time(whole) < run.duration && kt_simulation_time(now) == kt_simulation_time(whole)) {
        kt_simulation *last = now;
        kt_simulation_save(now, block);
        now = next;
        next = last;
        kt_need_fine("restores", kt_simulation_restore(now, block, &error), &error);
        kt_need_fine("steps", kt_simulation_step(whole, run.duration, &error), &error);
        kt_need_fine("steps", kt_simulation_step(now, run.duration, &error), &error);
    }
    kt_scene_check_equal("state", now, whole);
    kt_check_near("time", kt_simulation_time(now), run.duration, 0.0);
    kt_check_above("switches", (double)kt_simulation_counts_of(whole).switches, 1.5);
}
