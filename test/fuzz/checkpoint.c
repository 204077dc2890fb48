/* Checkpoints with changed words and right sums, as an attacker makes them: each is rejected and changes nothing, or
 * the simulation goes on from it, with an error at worst. An unchanged checkpoint then restores the simulation.
 *
 * Byte 0 chooses the scene, 1 the method, 2 the steps before the checkpoint. The others change words: the number of the
 * word in two bytes, and a value. A block whose sums are not made anew must be rejected. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fuzz.h"

#include "kinetree/scene.h"
#include "simulation/checkpoint.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Loops, contacts with masks, events, switches, auxiliary states, joints without mass, friction of joints. */
static const char *const names[] = {
    "double-pendulum", "four-bar",     "rocking-block",      "trebuchet", "clutch",    "bouncing-ball", "servo-arm",
    "landing-gear",    "rolling-ball", "hydraulic-cylinder", "lugre",     "parachute", "cart-pole",     "quadruped"};
static const char *const methods[] = {"rk4",  "dopri5", "ab4",  "radau5", "rodas5p",        "bdf2",
                                      "rkc4", "auto",   "rkc2", "dop853", "implicit-euler", "two-step"};
enum { NAMES = sizeof names / sizeof *names, METHODS = sizeof methods / sizeof *methods, STEPS = 4 };

/* Four feet with friction: contacts have masks. */
static const char quadruped[] =
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
    "  - {name: b, joint: {type: free, position: {position: [0, 0, 0.1]}, velocity: {linear: [0.2, 0, -0.1]}}, mass: 2,"
    " inertia: [0.01, 0.02, 0.02], markers: {k: [0.2, 0.1, -0.1], l: [0.2, -0.1, -0.1], m: [-0.2, 0.1, -0.1],"
    " n: [-0.2, -0.1, -0.1]}}\neffects:\n"
    "  - {name: k, type: contact, point: b.k, radius: 0, plane: world, restitution: 0, friction: 0.4}\n"
    "  - {name: l, type: contact, point: b.l, radius: 0, plane: world, restitution: 0, friction: 0.4}\n"
    "  - {name: m, type: contact, point: b.m, radius: 0, plane: world, restitution: 0, friction: 0.4}\n"
    "  - {name: n, type: contact, point: b.n, radius: 0, plane: world, restitution: 0, friction: 0.4}\n"
    "simulate: {duration: 1}\n";

typedef struct setup {
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_scene_watch *watch;
} setup;

static void must(const char *what, kt_status status, const kt_error *error) {
    kt_fuzz_must(status == KT_OK, "%s: %s: %s", what, error->where, error->message);
}

static void load(setup *s, const char *name) {
    char path[4096];
    kt_error error = {KT_OK, "", ""};
    if (s->model != NULL)
        return;
    (void)snprintf(path, sizeof path, "%s/%s.yaml", KT_SCENES, name);
    must(name,
         strcmp(name, "quadruped") == 0
             ? kt_scene_parse(name, quadruped, sizeof quadruped - 1, &s->scene, NULL, NULL, &error)
             : kt_scene_read(path, &s->scene, NULL, NULL, &error),
         &error);
    kt_model_options options = kt_model_options_default();
    options.settable = kt_scene_needs_settable(&s->scene);
    must(name, kt_model_compile(&s->scene.description, &options, &s->model, &error), &error);
}

static bool start(setup *s, const char *method, bool is_fixed) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = s->scene.run;
    kt_error error = {KT_OK, "", ""};
    const bool is_adaptive = kt_method_find(method)->embedded_order > 0 && !is_fixed;
    run.integrator = method;
    run.step = is_adaptive ? 0.0 : 1e-3;
    run.relative = run.absolute = is_adaptive ? 1e-5 : 0.0;
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_REACTION | KT_RECORD_BALANCE;
    options.contact = s->scene.contact;
    options.events = kt_scene_event_room(&s->scene);
    options.max_steps = 200;
    if (kt_simulation_create(s->model, &run, &options, &s->simulation, &error) != KT_OK)
        return false;
    if (options.events > 0)
        must("events", kt_scene_watch_create(&s->scene, s->model, s->simulation, NULL, -1, &s->watch, &error), &error);
    return true;
}

static void stop(setup *s) {
    kt_simulation_free(s->simulation);
    kt_scene_watch_free(s->watch);
    s->simulation = NULL;
    s->watch = NULL;
}

static int record(const kt_record *r, void *user) {
    (void)r;
    return ++*(int *)user > 20;
}

/* Goes on from a changed checkpoint, with every call that reads the restored words. */
static void go_on(setup *s) {
    int records = 0;
    kt_status status = s->watch != NULL ? kt_scene_watch_sync(s->watch, s->simulation, NULL) : KT_OK;
    for (int i = 0; i < STEPS && status == KT_OK; i++)
        status = kt_simulation_step(s->simulation, HUGE_VAL, NULL);
    status = kt_simulation_tick(s->simulation, 1e-3, NULL);
    status = kt_simulation_run(s->simulation, record, &records, NULL);
    (void)status;
    (void)kt_simulation_stopped(s->simulation);
    (void)kt_simulation_event_cuts(s->simulation);
    (void)kt_simulation_counts_of(s->simulation);
    const kt_contact_counts contacts = kt_simulation_contacts(s->simulation);
    if (contacts.undecided > 0)
        (void)kt_loop_name(kt_simulation_model(s->simulation), contacts.undecided_loop);
}

static void check_equal(kt_simulation *simulation, const void *block, void *again, size_t size, const char *what) {
    kt_simulation_save(simulation, again);
    kt_fuzz_must(memcmp(block, again, size) == 0, "%s", what);
}

static void check_changed(kt_bytes *bytes, setup *s, char *changed, char *again, size_t size) {
    kt_error error = {KT_OK, "", ""};
    bool is_sealed = kt_bytes_next(bytes) % 8 != 0;
    char *before = malloc(size);
    kt_fuzz_must(before != NULL, "there is memory");
    kt_simulation_save(s->simulation, before);
    memcpy(changed, before, size);
    while (bytes->at < bytes->end)
        kt_bytes_change_word(bytes, changed, size / 8);
    const bool is_same = memcmp(changed, before, size) == 0;
    if (is_sealed)
        kt_checkpoint_seal(s->simulation, changed);
    const kt_status status = kt_simulation_restore(s->simulation, changed, &error);
    kt_fuzz_must(is_sealed || is_same || status != KT_OK, "a changed bit is detected");
    if (status == KT_OK)
        go_on(s);
    else
        check_equal(s->simulation, before, again, size, "a rejected checkpoint changes nothing");
    must("the unchanged one", kt_simulation_restore(s->simulation, before, &error), &error);
    check_equal(s->simulation, before, again, size, "it restores everything");
    free(before);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static setup setups[NAMES];
    kt_bytes bytes = {data, data + size};
    const int k = kt_bytes_pick(&bytes, NAMES);
    setup *s = &setups[k];
    load(s, names[k]);
    const char *method = methods[kt_bytes_pick(&bytes, METHODS)];
    const unsigned steps = kt_bytes_next(&bytes);
    if (start(s, method, steps % 2 == 0)) {
        for (unsigned i = 0; i < steps / 8; i++)
            if (kt_simulation_step(s->simulation, HUGE_VAL, NULL) != KT_OK)
                break;
        const size_t length = kt_simulation_state_size(s->simulation);
        char *changed = malloc(length), *again = malloc(length);
        kt_fuzz_must(changed != NULL && again != NULL, "there is memory");
        check_changed(&bytes, s, changed, again, length);
        free(changed);
        free(again);
    }
    stop(s);
    return 0;
}
