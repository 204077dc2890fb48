/* Generated files as right-hand sides of simulations (kt_native_use). */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "files/scene/collect.h"
#include "generated.h"
#include "text.h"

#include "kinetree/batch.h"
#include "kinetree/ensemble.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON

/* A file of accelerations, and a random tree that it belongs to. */
typedef struct native_tree {
    kt_tree tree;
    kt_generated file;
    kt_native native;
} native_tree;

/* Dampers in the joints of one coordinate. */
static void add_dampers(kt_tree *tree, kt_effect effect[KT_TREE_BODIES]) {
    int count = 0;
    for (int b = 0; b < tree->description.body_count; b++) {
        const kt_joint_type type = tree->description.bodies[b].joint.type;
        if (type != KT_JOINT_REVOLUTE && type != KT_JOINT_PRISMATIC)
            continue;
        effect[count] = kt_effect_of(KT_EFFECT_JOINT_DAMPER, tree->description.bodies[b].name);
        effect[count++].damping = 0.5;
    }
    tree->description.effects = effect;
    tree->description.effect_count = count;
    kt_tree_compile(tree, NULL);
}

static void native_tree_make(native_tree *n, kt_random *random, kt_effect effect[KT_TREE_BODIES]) {
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = 8;
    plan.massless = false;
    memset(&n->file, 0, sizeof n->file);
    kt_generated_need_compiler();
    kt_tree_grow(&n->tree, &plan, random);
    add_dampers(&n->tree, effect);
    kt_generated_make_some(&n->file, n->tree.model, KT_CODEGEN_ACCELERATION, "cc -O1", false);
    n->native = (kt_native){.structure = kt_codegen_structure(n->tree.model),
                            .acceleration = n->file.acceleration,
                            .prepared = n->file.model};
}

/* ---- motions ----------------------------------------------------------------------------------------------------- */

typedef struct motion {
    double y[KT_TREE_NQ + KT_TREE_NV];
    kt_simulation_counts counts;
} motion;

/* Runs from a state, whose velocities are larger by the part `off`. native: NULL for the library. */
static void run_motion(const native_tree *n, const kt_run *run, kt_native *native, const kt_tree_state *s, double off,
                       motion *to) {
    const size_t nq = (size_t)n->tree.nq, nv = (size_t)n->tree.nv;
    double v[KT_TREE_NV];
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    kt_status status = native != NULL ? kt_native_use(native, n->tree.model, &options, &error) : KT_OK;
    for (size_t i = 0; i < nv; i++)
        v[i] = s->v[i] * (1.0 + off);
    if (status == KT_OK)
        status = kt_simulation_create(n->tree.model, run, &options, &simulation, &error);
    if (status == KT_OK)
        status = kt_simulation_set_state(simulation, 0.0, s->q, v, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, run->duration, &error);
    if (status == KT_OK) {
        memcpy(to->y, kt_simulation_positions(simulation), nq * sizeof *to->y);
        memcpy(to->y + nq, kt_simulation_velocities(simulation), nv * sizeof *to->y);
        to->counts = kt_simulation_counts_of(simulation);
    }
    kt_simulation_free(simulation);
    kt_need_fine(run->integrator != NULL ? run->integrator : "default", status, &error);
}

/* Both motions differ by rounding, which grows as a change of the velocities does. */
KT_TEST(motions_of_each_method_are_those_of_the_library) {
    static const char *const method[] = {"rk4",  "dopri5", "dop853", "heun",    "ab4",
                                         "bdf2", "radau5", "rodas4", "two-step"};
    static native_tree n;
    static kt_effect effect[KT_TREE_BODIES];
    static motion own, library, moved;
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("state at the end");
    kt_tree_state s;
    native_tree_make(&n, &random, effect);
    kt_tree_state_draw(&n.tree, &random, &s);
    for (size_t k = 0; k < sizeof method / sizeof *method; k++) {
        if (kt_method_find(method[k]) == NULL)
            continue;
        kt_run run = kt_run_default();
        run.integrator = method[k];
        run.step = 1e-3;
        run.duration = 0.2;
        run_motion(&n, &run, NULL, &s, 0.0, &library);
        run_motion(&n, &run, NULL, &s, 1e-8, &moved);
        run_motion(&n, &run, &n.native, &s, 0.0, &own);
        double growth = 1.0, size = 1.0;
        for (int i = 0; i < n.tree.nq + n.tree.nv; i++) {
            growth = fmax(growth, fabs(moved.y[i] - library.y[i]) / 1e-8);
            size = fmax(size, fabs(library.y[i]));
        }
        for (int i = 0; i < n.tree.nq + n.tree.nv; i++)
            kt_worst_near(&error, own.y[i], library.y[i], 1000.0 * EPS * (growth + size), "%s, number %d", method[k],
                          i);
        kt_check_above("accelerations by the file", (double)n.native.computed, 199.0);
        kt_check_equal_int("accelerations by the library", (long long)n.native.left, 0);
        kt_check_equal_int("Jacobians", (long long)own.counts.jacobians, (long long)library.counts.jacobians);
        kt_check_equal_int("steps", (long long)own.counts.steps, (long long)library.counts.steps);
    }
}

/* The default method is that of the model, and implicit steps take its derivatives. */
KT_TEST(stiff_motions_keep_the_default_method) {
    static native_tree n;
    static kt_effect effect[KT_TREE_BODIES];
    static motion own, library;
    kt_random random = kt_random_of_test();
    kt_tree_state s;
    native_tree_make(&n, &random, effect);
    kt_tree_state_draw(&n.tree, &random, &s);
    for (int i = 0; i < n.tree.description.effect_count; i++)
        effect[i].damping = 1e5;
    kt_tree_compile(&n.tree, NULL);
    kt_generated_make_some(&n.file, n.tree.model, KT_CODEGEN_ACCELERATION, "cc -O1", false);
    n.native.acceleration = n.file.acceleration;
    kt_run run = kt_run_default();
    run.integrator = NULL;
    run.duration = 0.5;
    run.relative = run.absolute = 1e-6;
    run_motion(&n, &run, NULL, &s, 0.0, &library);
    run_motion(&n, &run, &n.native, &s, 0.0, &own);
    kt_check_above("switches", (double)library.counts.switches, 0.5);
    kt_check_equal_int("switches", (long long)own.counts.switches, (long long)library.counts.switches);
    for (int i = 0; i < n.tree.nq; i++)
        kt_check_near("position", own.y[i], library.y[i], 1e-12 * (1.0 + fabs(library.y[i])));
}

/* Members of an ensemble, which end with their states. */
typedef struct native_members {
    kt_simulation *simulation[3];
    int given, ended;
    kt_status status;
} native_members;

static int ignore_record(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

static bool next_member(void *user, bool may_block, kt_ensemble_member *member) {
    native_members *m = user;
    (void)may_block;
    if (m->given == 3)
        return false;
    *member = (kt_ensemble_member){.simulation = m->simulation[m->given++], .record = ignore_record};
    return true;
}

static void end_member(void *user, const kt_ensemble_member *member, kt_status status, const kt_error *error) {
    native_members *m = user;
    (void)member, (void)error;
    m->ended++;
    m->status = status != KT_OK ? status : m->status;
}

KT_TEST(ensembles_advance_files_one_after_the_other) {
    static native_tree n;
    static kt_effect effect[KT_TREE_BODIES];
    static motion alone;
    kt_random random = kt_random_of_test();
    kt_native native[3];
    kt_tree_state s;
    kt_error error = {0};
    kt_run run = kt_run_default();
    native_members members = {.status = KT_OK};
    kt_ensemble *ensemble = NULL;
    run.integrator = "dopri5";
    run.duration = 0.2;
    native_tree_make(&n, &random, effect);
    kt_tree_state_draw(&n.tree, &random, &s);
    kt_status status = kt_ensemble_create(n.tree.model, &ensemble, &error);
    for (int i = 0; i < 3 && status == KT_OK; i++) {
        kt_simulation_options options = kt_simulation_options_default();
        native[i] = n.native;
        status = kt_native_use(&native[i], n.tree.model, &options, &error);
        if (status == KT_OK)
            status = kt_simulation_create(n.tree.model, &run, &options, &members.simulation[i], &error);
        if (status == KT_OK)
            status = kt_simulation_set_state(members.simulation[i], 0.0, s.q, s.v, &error);
    }
    for (int i = 0; i < 10 && status == KT_OK && members.ended < 3; i++)
        status = kt_ensemble_run(ensemble, next_member, end_member, &members, &error);
    kt_need_fine("ensemble", status, &error);
    run_motion(&n, &run, &n.native, &s, 0.0, &alone);
    kt_check_equal_int("members", members.ended, 3);
    kt_check_equal_int("status", members.status, KT_OK);
    kt_check_equal_int("alone", (long long)kt_ensemble_report_of(ensemble).together, 0);
    for (int i = 0; i < 3; i++)
        kt_check_equal_bits("positions", kt_simulation_positions(members.simulation[i]), alone.y, (size_t)n.tree.nq);
    for (int i = 0; i < 3; i++)
        kt_simulation_free(members.simulation[i]);
    kt_ensemble_free(ensemble);
}

/* ---- what a file cannot compute ---------------------------------------------------------------------------------- */

KT_TEST(wrenches_on_bodies_are_left_to_the_library) {
    static native_tree n;
    static kt_effect effect[KT_TREE_BODIES];
    kt_random random = kt_random_of_test();
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_tree_state s;
    kt_error error = {0};
    double a[KT_TREE_NV], right[KT_TREE_NV];
    native_tree_make(&n, &random, effect);
    kt_tree_state_draw(&n.tree, &random, &s);
    kt_status status = kt_native_use(&n.native, n.tree.model, &options, &error);
    if (status == KT_OK)
        status = kt_simulation_create(n.tree.model, NULL, &options, &simulation, &error);
    if (status == KT_OK)
        status = kt_simulation_set_state(simulation, 0.0, s.q, s.v, &error);
    if (status == KT_OK)
        status = kt_simulation_set_wrenches(simulation, s.external, &error);
    const uint64_t before = n.native.left;
    if (status == KT_OK)
        status = kt_simulation_acceleration(simulation, a, &error);
    kt_check_equal_int("by the library", (long long)(n.native.left - before), 1);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(n.tree.model, n.tree.data, 0.0, s.q, s.v, NULL, s.external, right, &error);
    kt_need_fine("wrenches", status, &error);
    kt_check_equal_bits("accelerations", a, right, (size_t)n.tree.nv);
    kt_simulation_free(simulation);
}

/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int do_nothing(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    (void)at, (void)rate, (void)a, (void)error, (void)user;
    return 0;
}

KT_TEST(files_of_other_structures_are_rejected) {
    static native_tree n;
    static kt_effect effect[KT_TREE_BODIES];
    kt_random random = kt_random_of_test();
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error = {0};
    native_tree_make(&n, &random, effect);
    n.native.structure++;
    kt_check_equal_int("structure", kt_native_use(&n.native, n.tree.model, &options, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("message", error.message, "generate it again");
    kt_check_true("unchanged", options.acceleration == NULL && n.native.model == NULL);
    n.native.structure--;
    options.acceleration = do_nothing;
    kt_check_equal_int("a function of the caller", kt_native_use(&n.native, n.tree.model, &options, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "acceleration");
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

KT_TEST(numbers_are_those_of_the_model) {
    static native_tree n;
    static kt_effect effect[KT_TREE_BODIES];
    static double numbers[KT_GENERATED_PARAMETERS];
    kt_random random = kt_random_of_test();
    kt_error error = {0};
    int count = 0;
    native_tree_make(&n, &random, effect);
    kt_status status = kt_codegen_numbers(n.tree.model, KT_CODEGEN_ACCELERATION, NULL, 0, &count, &error);
    kt_check_equal_int("count", count, n.file.count);
    if (status == KT_OK)
        status = kt_codegen_numbers(n.tree.model, KT_CODEGEN_ACCELERATION, numbers, count, &count, &error);
    kt_need_fine("numbers", status, &error);
    kt_check_equal_bits("numbers", numbers, n.file.standard, (size_t)count);
    kt_check_equal_int("no function", kt_codegen_numbers(n.tree.model, 0, NULL, 0, &count, &error), KT_ERROR_ARGUMENT);
}

/* Reads the numbers of mech_default. Returns how many; -1 if there are too many. */
static int read_standard_numbers(const char *source, double *numbers, int room) {
    const char *at = strstr(source, "mech_default = {"), *const end = at != NULL ? strstr(at, "};") : NULL;
    int count = 0;
    for (at = at != NULL ? strstr(at, "(number)") : NULL; at != NULL && at < end; at = strstr(at, "(number)")) {
        if (count == room)
            return -1;
        at += strlen("(number)");
        numbers[count++] = strtod(at, NULL);
    }
    return count;
}

/* Compares the numbers of a scene. Returns how many; -1: it cannot be generated. */
static int compare_numbers(const char *name) {
    static double numbers[4000], standard[4000];
    const unsigned functions = KT_CODEGEN_ACCELERATION;
    kt_generated_text text;
    kt_error error = {0};
    int count = -1;
    const kt_model *model = kt_test_model(&kt_test_bundled(name)->description, NULL);
    if (kt_model_nv(model) > 60 || kt_generate_text(model, "mech", functions, false, &text, &error) != KT_OK)
        return -1;
    kt_need_fine(name, kt_codegen_numbers(model, functions, numbers, 4000, &count, &error), &error);
    if (kt_check_equal_int(name, count, read_standard_numbers(text.source, standard, 4000)))
        kt_check_equal_bits(name, numbers, standard, (size_t)count);
    return count;
}

/* The numbers are read without making the functions of the file, and have the order of the file. */
KT_TEST(numbers_of_scenes_are_those_of_their_files) {
    int scenes = 0, most = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const int found = compare_numbers(kt_bundled(i));
        scenes += found >= 0;
        most = found > most ? found : most;
    }
    kt_check_above("scenes", scenes, 50);
    kt_check_above("most numbers", most, 100);
}

/* A file whose numbers are set anew has the motion of the changed model. */
KT_TEST(files_follow_changed_numbers) {
    static native_tree n;
    static kt_effect effect[KT_TREE_BODIES];
    static double numbers[KT_GENERATED_PARAMETERS];
    kt_random random = kt_random_of_test();
    kt_tree_state s;
    kt_error error = {0};
    int count = 0;
    static motion own, library;
    kt_run run = kt_run_default();
    run.integrator = "dopri5";
    run.step = 1e-3;
    run.duration = 0.05;
    native_tree_make(&n, &random, effect);
    kt_tree_state_draw(&n.tree, &random, &s);
    n.tree.body[n.tree.description.body_count - 1].mass *= 1.5;
    kt_tree_compile(&n.tree, NULL);
    const kt_status status =
        kt_codegen_numbers(n.tree.model, KT_CODEGEN_ACCELERATION, numbers, KT_GENERATED_PARAMETERS, &count, &error);
    kt_need_fine("numbers", status, &error);
    run_motion(&n, &run, NULL, &s, 0.0, &library);
    run_motion(&n, &run, &n.native, &s, 0.0, &own);
    double off = 0.0;
    for (int i = 0; i < n.tree.nq; i++)
        off = fmax(off, fabs(own.y[i] - library.y[i]));
    kt_check_above("before, the old mass moves it", off, 1e-8);
    n.file.prepare(numbers, n.file.model);
    run_motion(&n, &run, &n.native, &s, 0.0, &own);
    for (int i = 0; i < n.tree.nq; i++)
        kt_check_near("position", own.y[i], library.y[i], 100.0 * EPS * (1.0 + fabs(library.y[i])));
}
