/* States of FMUs with changed words and right sums, as an attacker makes them. Each is rejected, or the instance goes
 * on from it, with an error at worst. The first state of the instance then restores it.
 *
 * Byte 0 chooses the scene and the kind of instance, 1 the steps before the state, 2 whether the sums are made anew.
 * The others change words (kt_bytes_change_word). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fuzz.h"

#include "base/sum.h"
#include "fmu/instance.h"
#include "integrator/integrator.h"
#include "simulation/checkpoint.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

KT_FMI_DECLARE(kt_fmi_status fmi3EnterStepMode(void *instance));

/* Parameters, inputs, events with limits, auxiliary states, contacts, loops, states of formulas. */
static const char *const scenes[] = {"double-pendulum", "bouncing-ball", "servo-arm", "cart-pole", "four-bar",
                                     "clutch",          "lugre",         "trebuchet", "driven"};
enum { SCENES = sizeof scenes / sizeof *scenes, KINDS = 3, STEPS = 3, STEPS_MOST = 200 };

/* A drive and a torque as inputs, a parameter that can be tuned, an event with a limit. */
static const char driven[] = KT_FMU_SIGNALS
    "loop d.position, effect m.torque\n"
    "kinetree: 1\ngravity: [0, 0, -9.81]\nparameters: {k: 3, l: 0.4}\nbodies:\n"
    "  - {name: a, joint: {type: revolute, axis: y}, mass: 1, com: [0, 0, -0.2], inertia: [0.1, 0.1, 0.1]}\n"
    "  - {name: b, parent: a, joint: {type: revolute, axis: y, at: [0, 0, =-l]}, mass: 1, com: [0, 0, -0.2],"
    " inertia: [0.1, 0.1, 0.1]}\n"
    "  - {name: c, joint: {type: prismatic, axis: x}, mass: 1, inertia: [0.1, 0.1, 0.1]}\n"
    "loops:\n  - {name: d, type: motion, joint: c, position: 0.1}\n"
    "effects:\n  - {name: m, type: motor, joint: a, torque: 0.1}\n"
    "  - {name: s, type: joint_spring, joint: b, stiffness: =k}\n"
    "states:\n  x: {initial: 1, rate: position.a - x}\n"
    "events:\n  - {name: e, when: position.a - 0.01, limit: 2, then: {set: {x: 0.5}}}\n"
    "simulate: {duration: 1, integrator: rk4, step: 0.01}\n";

typedef struct instance {
    kt_fmu fmu;
    bool is_tried, is_there;
    void *first; /* its first state */
} instance;

static char *text_of(const char *name, size_t *size) {
    char path[4096];
    char *text = calloc(1, 65536);
    kt_fuzz_must(text != NULL, "there is memory");
    if (strcmp(name, "driven") == 0) {
        *size = sizeof driven - 1;
        memcpy(text, driven, *size);
        return text;
    }
    (void)snprintf(path, sizeof path, "%s/%s.yaml", KT_SCENES, name);
    FILE *file = fopen(path, "rb");
    kt_fuzz_must(file != NULL, "%s is there", path);
    *size = fread(text, 1, 65535, file);
    (void)fclose(file);
    return text;
}

/* Starts an instance, as kt_fmu_open does from a file. Scenes with contacts have no model exchange. */
static void start(instance *s, const char *name, int kind) {
    kt_error error = {0};
    s->is_tried = true;
    s->fmu.scene_text = text_of(name, &s->fmu.scene_size);
    s->fmu.token = kt_fmu_token_of(s->fmu.scene_text, s->fmu.scene_size);
    s->fmu.is_exchange = kind == 2;
    s->fmu.has_event_mode = s->fmu.returns_early = kind == 1;
    const kt_status status = kt_fmu_start(&s->fmu, &error);
    kt_fuzz_must(status == KT_OK, "%s starts: %s: %s", name, error.where, error.message);
    s->is_there = kind != 2 || kt_switch_count(s->fmu.model) == 0;
    kt_fuzz_must(!s->is_there || fmi3GetFMUState(&s->fmu, &s->first) == KT_FMI_OK, "%s has a state", name);
}

/* All variables that can be read, one after the other: their references have gaps. */
static void read_variables(kt_fmu *fmu) {
    for (kt_fmi_reference kind = 0; kind <= KT_FMU_SIGNAL; kind += KT_FMU_INPUT)
        for (kt_fmi_reference i = 0; i < 12; i++) {
            const kt_fmi_reference reference = kind + i;
            double value;
            (void)fmi3GetFloat64(fmu, &reference, 1, &value, 1);
        }
}

static void update(kt_fmu *fmu) {
    bool flags[5];
    double next;
    (void)fmi3UpdateDiscreteStates(fmu, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4], &next);
}

static void take_step(kt_fmu *fmu) {
    bool needs_event, terminate, early;
    double last;
    if (fmu->phase == KT_FMU_EVENT && !fmu->is_exchange) {
        update(fmu);
        (void)fmi3EnterStepMode(fmu);
    }
    uint64_t *most = &fmu->simulation->integrator->options.max_steps; /* checkpoints compare it */
    *most = STEPS_MOST; /* a state may hold any speed, and the steps are then short */
    (void)fmi3DoStep(fmu, fmu->time, 0.01, false, &needs_event, &terminate, &early, &last);
    *most = 0;
    if (needs_event)
        (void)fmi3EnterEventMode(fmu);
}

/* A step of Euler's method, and the calls of an importer around it. */
static void exchange(kt_fmu *fmu) {
    const size_t count = (size_t)kt_fmu_size(fmu), events = (size_t)fmu->event_count;
    double *y = calloc(2 * count + events + 1, sizeof *y);
    kt_fuzz_must(y != NULL, "there is memory");
    double *rates = y + count, *indicators = rates + count;
    bool enters, terminates;
    if (fmu->phase == KT_FMU_EVENT) {
        update(fmu);
        (void)fmi3EnterContinuousTimeMode(fmu);
    }
    (void)fmi3GetContinuousStates(fmu, y, count);
    (void)fmi3GetContinuousStateDerivatives(fmu, rates, count);
    for (size_t i = 0; i < count; i++)
        y[i] += 0.01 * rates[i];
    (void)fmi3SetTime(fmu, fmu->time + 0.01);
    (void)fmi3SetContinuousStates(fmu, y, count);
    (void)fmi3GetEventIndicators(fmu, indicators, events);
    if (fmi3CompletedIntegratorStep(fmu, false, &enters, &terminates) == KT_FMI_OK)
        (void)fmi3EnterEventMode(fmu);
    free(y);
}

static void go_on(kt_fmu *fmu, unsigned steps) {
    for (unsigned i = 0; i < steps; i++)
        if (fmu->is_exchange)
            exchange(fmu);
        else
            take_step(fmu);
}

static void seal(const kt_fmu *fmu, unsigned char *block, size_t size) {
    kt_checkpoint_seal(fmu->simulation, block + size - kt_simulation_state_size(fmu->simulation));
    kt_fmu_seal(block, size);
}

/* Numbers that become integers, and times, of a state that was accepted. */
static void check_words(const kt_fmu *fmu) {
    kt_fuzz_must(isfinite(fmu->time) && isfinite(fmu->start), "times are finite");
    for (int k = 0; k < fmu->event_count; k++) {
        const kt_fmu_event *e = &fmu->events[k];
        kt_fuzz_must(e->side == 0.0 || fabs(e->side) == 1.0, "the side of event %d is a sign", k);
        kt_fuzz_must(e->count >= 0.0 && e->count < 1e16 && e->count == floor(e->count), "event %d is counted", k);
    }
}

/* Serialises the present state, changes it, and lets the instance take it over. */
static void change_state(kt_bytes *bytes, kt_fmu *fmu) {
    const bool is_sealed = kt_bytes_next(bytes) % 8 != 0;
    void *state = NULL;
    size_t size = 0;
    if (fmi3GetFMUState(fmu, &state) != KT_FMI_OK || fmi3SerializedFMUStateSize(fmu, state, &size) != KT_FMI_OK)
        return;
    unsigned char *block = malloc(2 * size), *before = block + size;
    kt_fuzz_must(block != NULL && fmi3SerializeFMUState(fmu, state, block, size) == KT_FMI_OK, "it is serialised");
    memcpy(before, block, size);
    while (bytes->at < bytes->end)
        kt_bytes_change_word(bytes, (char *)block, size / 8);
    const bool is_same = memcmp(block, before, size) == 0;
    if (is_sealed)
        seal(fmu, block, size);
    kt_fuzz_must(fmi3DeserializeFMUState(fmu, block, size, &state) == KT_FMI_OK, "it is copied");
    const kt_fmi_status status = fmi3SetFMUState(fmu, state);
    kt_fuzz_must(is_sealed || is_same || status != KT_FMI_OK, "a changed bit is detected");
    if (status == KT_FMI_OK) {
        check_words(fmu);
        read_variables(fmu);
        go_on(fmu, STEPS);
        read_variables(fmu);
    }
    (void)fmi3FreeFMUState(fmu, &state);
    free(block);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static instance instances[SCENES * KINDS];
    kt_bytes bytes = {data, data + size};
    const int k = kt_bytes_pick(&bytes, SCENES * KINDS);
    instance *s = &instances[k];
    if (!s->is_tried)
        start(s, scenes[k / KINDS], k % KINDS);
    if (!s->is_there)
        return 0;
    const unsigned steps = kt_bytes_next(&bytes) % 16;
    kt_fuzz_must(fmi3EnterInitializationMode(&s->fmu, false, 0.0, 0.0, false, 0.0) == KT_FMI_OK, "it is initialised");
    if (steps > 0)
        (void)fmi3ExitInitializationMode(&s->fmu);
    go_on(&s->fmu, steps);
    change_state(&bytes, &s->fmu);
    kt_fuzz_must(fmi3SetFMUState(&s->fmu, s->first) == KT_FMI_OK, "the first state restores the instance");
    return 0;
}
