/* The humanoid in lanes and in MuJoCo, without contact. Both take steps of rk4 from one state. All other computations
 * of MuJoCo (collisions, constraints, actuators, passive forces) are switched off. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "peer.h"

#include "../chain.h"
#include "../peers/mujoco.h"

#include "kinetree/batch.h"
#include "kinetree/scene.h"

#include <stdio.h>

typedef struct pair {
    kt_chain chain;
    kt_mujoco twin;
    kt_batch *batch;
    bool failed;
} pair;

/* All states of the batch, once a repetition. */
static void step_lanes(void *user, long repetitions) {
    pair *p = user;
    for (; repetitions > 0; repetitions--)
        p->failed |= kt_batch_step(p->batch, 0.0, 1, NULL) != KT_OK;
}

static void step_peer(void *user, long repetitions) { kt_mujoco_step(&((pair *)user)->twin, repetitions); }

static kt_status make(size_t states, kt_isa isa, pair *p, kt_error *error) {
    const kt_batch_options many = {.states = states, .method = kt_method_find("rk4")};
    kt_scene scene;
    kt_status status = kt_scene_read(KT_SCENES "/humanoid.yaml", &scene, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    status = kt_chain_of(&scene.description, isa, true, &p->chain, error);
    if (status == KT_OK)
        status = kt_mujoco_make(&scene.description, &p->chain, &p->twin, error);
    if (status == KT_OK)
        status = kt_batch_create(p->chain.model, &many, &p->batch, error);
    for (size_t i = 0; i < states && status == KT_OK; i++) {
        status = kt_batch_set_state(p->batch, i, 0.0, p->chain.q, p->chain.v, error);
        if (status == KT_OK)
            status = kt_batch_set_torque(p->batch, i, p->chain.tau, error);
    }
    kt_scene_free(&scene);
    return status;
}

int kt_measure_peer(size_t states, const kt_bench_options *options, kt_csv *csv) {
    static kt_bench_times times[2];
    static pair p;
    kt_error error;
    int status = KT_BENCH_DONE;
    if (make(states, options->isa, &p, &error) != KT_OK) {
        status = kt_bench_tell(&error);
    } else {
        const kt_bench_task tasks[2] = {{step_lanes, &p}, {step_peer, &p}};
        kt_bench_measure(tasks, 2, options->seconds, times);
        const double lanes = (double)states / times[0].low, peer = 1.0 / times[1].low;
        printf("%-14s %-9s %10.0f %10.0f %8.2f   MuJoCo %s and lanes, without contact\n", "humanoid", "rk4 step", peer,
               lanes, lanes / peer, kt_mujoco_version());
        kt_csv_text(csv, "humanoid");
        kt_csv_text(csv, "rk4 step of MuJoCo");
        kt_csv_number(csv, peer);
        kt_csv_number(csv, lanes);
        kt_csv_number(csv, lanes / peer);
        kt_csv_origin(csv, kt_model_isa(p.chain.model));
        kt_csv_line(csv);
        status = p.failed ? KT_BENCH_FAILED : KT_BENCH_DONE;
    }
    kt_batch_free(p.batch);
    kt_mujoco_free(&p.twin);
    kt_chain_free(&p.chain);
    return status;
}
