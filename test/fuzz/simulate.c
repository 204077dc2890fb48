/* A simulation for a moment: steps, records, checkpoints. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion.h"

#include <stdlib.h>
#include <string.h>

enum { STEPS = 10, STEPS_OF_MANY_STAGES = 3, RECORDS = 30 };

static kt_run draw_run(kt_bytes *bytes, bool *frees, kt_simulation_options *options) {
    kt_run run = kt_run_default();
    const unsigned chosen = kt_bytes_next(bytes);
    const kt_method *method = kt_method_at(kt_bytes_pick(bytes, kt_method_count()));
    run.integrator = method->name;
    run.duration = (1.0 + kt_bytes_next(bytes)) / 256.0;
    run.interval = run.duration * (1.0 + kt_bytes_next(bytes)) / 256.0;
    run.interval = fmax(run.interval, run.duration / RECORDS);
    if (method->embedded_order == 0 || (chosen & 1U) != 0)
        run.step = run.duration * (1.0 + kt_bytes_next(bytes)) / 512.0;
    else
        run.relative = run.absolute = pow(10.0, -kt_bytes_pick(bytes, 14));
    run.record = (chosen >> 2) & 31U ? kt_bytes_next(bytes) & 127U : KT_RECORD_DEFAULT;
    *options = kt_simulation_options_default();
    *frees = (chosen & 2U) != 0;
    options->max_steps = kt_method_stages_vary(method) || method->stages > 8 ? STEPS_OF_MANY_STAGES : STEPS;
    options->unprojected = (chosen & 128U) != 0 && kt_bytes_chance(bytes);
    options->kinematics = kt_bytes_chance(bytes);
    return run;
}

typedef struct heard {
    const kt_model *model;
    int64_t count, index;
    double time;
} heard;

static int record(const kt_record *r, void *user) {
    heard *h = user;
    kt_fuzz_must(h->count == 0 || r->index == h->index + 1, "records come in order");
    kt_fuzz_must(h->count == 0 || r->t > h->time, "their times rise");
    kt_fuzz_must(kt_fuzz_all_finite(r->q, kt_model_nq(h->model)) && kt_fuzz_all_finite(r->v, kt_model_nv(h->model)),
                 "recorded states are finite");
    kt_fuzz_must(r->a == NULL || kt_fuzz_all_finite(r->a, kt_model_nv(h->model)), "recorded accelerations are finite");
    h->time = r->t;
    h->index = r->index;
    return ++h->count > 2 * RECORDS ? 1 : 0;
}

static void check_checkpoint(kt_simulation *simulation, void *block) {
    const size_t size = kt_simulation_state_size(simulation);
    unsigned char *again = kt_fuzz_take(size);
    kt_error error;
    kt_simulation_save(simulation, block);
    const kt_status status = kt_simulation_restore(simulation, block, &error);
    kt_fuzz_must(status == KT_OK, "a checkpoint is taken back: %s", error.message);
    kt_simulation_save(simulation, again);
    kt_fuzz_must(memcmp(block, again, size) == 0, "it has the same bytes");
    free(again);
}

/* Takes one step at a time: a step that fails leaves the state unchanged. */
static void step(kt_simulation *simulation, const kt_model *model, double duration) {
    const int nq = kt_model_nq(model), nv = kt_model_nv(model);
    const size_t size = kt_simulation_state_size(simulation), bytes = (size_t)(nq + nv) * sizeof(double);
    unsigned char *block = kt_fuzz_take(size);
    double *before = kt_fuzz_take(bytes);
    for (int i = 0; i < STEPS / 2; i++) {
        const double t = kt_simulation_time(simulation), *q = kt_simulation_positions(simulation),
                     *v = kt_simulation_velocities(simulation);
        memcpy(before, q, (size_t)nq * sizeof *q);
        memcpy(before + nq, v, (size_t)nv * sizeof *v);
        check_checkpoint(simulation, block);
        const kt_status status = kt_simulation_step(simulation, duration, NULL);
        q = kt_simulation_positions(simulation);
        v = kt_simulation_velocities(simulation);
        if (status != KT_OK) {
            kt_fuzz_must(memcmp(before, q, (size_t)nq * sizeof *q) == 0 &&
                             memcmp(before + nq, v, (size_t)nv * sizeof *v) == 0 && kt_simulation_time(simulation) == t,
                         "a failed step leaves the state untouched");
            break;
        }
        kt_fuzz_must(kt_fuzz_all_finite(q, nq) && kt_fuzz_all_finite(v, nv), "states are finite");
        kt_fuzz_must(kt_simulation_time(simulation) > t && kt_simulation_time(simulation) <= duration, "time goes on");
        if (kt_simulation_time(simulation) >= duration)
            break;
    }
    free(before);
    free(block);
}

/* A motion of free bodies: it is refused in words, or its records and its last state are finite. */
static void move_freely(const kt_model *model, const kt_absolute *absolute, const kt_run *run,
                        const kt_simulation_options *options) {
    kt_absolute_motion *motion = NULL;
    kt_error error = {KT_OK, "", ""};
    heard h = {.model = model};
    kt_status status = kt_absolute_motion_create(absolute, run, options, &motion, &error);
    kt_fuzz_must((status == KT_OK) == (motion != NULL), "there is a motion, or an error");
    if (status == KT_OK) {
        status = kt_absolute_motion_run(motion, record, &h, &error);
        kt_fuzz_must(kt_fuzz_all_finite(kt_absolute_motion_positions(motion), kt_model_nq(model)) &&
                         kt_fuzz_all_finite(kt_absolute_motion_velocities(motion), kt_model_nv(model)),
                     "the last state is finite");
    }
    kt_fuzz_must(status == KT_OK || (error.code == status && error.message[0] != '\0'), "what fails is said in words");
    kt_absolute_motion_free(motion);
}

void kt_fuzz_simulate(kt_bytes *bytes, const kt_model *model, const kt_absolute *absolute) {
    kt_simulation_options options;
    bool frees;
    const kt_run run = draw_run(bytes, &frees, &options);
    if (frees && absolute != NULL) {
        move_freely(model, absolute, &run, &options);
        return;
    }
    kt_simulation *simulation = NULL;
    kt_error error = {KT_OK, "", ""};
    const size_t size = kt_simulation_size(model, &run, &options);
    void *memory = kt_fuzz_take(size);
    const kt_status placed = kt_simulation_init(model, &run, &options, memory, size, &simulation, &error);
    kt_fuzz_must(size > 0 || placed != KT_OK, "what has no size cannot be placed");
    kt_fuzz_must(placed == KT_OK || (error.code == placed && error.message[0] != '\0'), "what fails is said in words");
    if (placed == KT_OK) {
        heard h = {.model = model};
        if (kt_bytes_chance(bytes))
            step(simulation, model, run.duration);
        const kt_status ran = kt_simulation_run(simulation, record, &h, &error);
        kt_fuzz_must(kt_fuzz_all_finite(kt_simulation_positions(simulation), kt_model_nq(model)) &&
                         kt_fuzz_all_finite(kt_simulation_velocities(simulation), kt_model_nv(model)),
                     "the last state is finite");
        kt_fuzz_must(ran != KT_OK || kt_simulation_time(simulation) == run.duration, "a run ends at its end");
        kt_fuzz_must(ran == KT_OK || (error.code == ran && error.message[0] != '\0'), "what fails is said in words");
        void *block = kt_fuzz_take(kt_simulation_state_size(simulation));
        check_checkpoint(simulation, block);
        free(block);
    }
    free(memory);
}
