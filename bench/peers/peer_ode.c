/* ODE as a peer of `kinetree accuracy`. It has one method, and this twin has gravity as its only force. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "ode_twin.h"
#include "peer_scene.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct ode_run {
    peer_request *request;
    peer_scene scene;
    kt_pose *pose;
    kt_twist *twist; /* of the bodies, now */
    kt_ode_twin *twin;
} ode_run;

static const peer_method methods[] = {{"semi-implicit", false}, {NULL, false}};

static const char *name_version(void) { return "ODE " KT_ODE_VERSION; }

static void close_run(void *given) {
    ode_run *run = given;
    if (run->twin != NULL)
        kt_ode_twin_free(run->twin);
    peer_scene_close(&run->scene);
    free(run->pose);
    free(run->twist);
    free(run);
}

static bool fail(ode_run *run, const char *why) {
    (void)snprintf(run->request->reason, PEER_REASON, "%.299s", why);
    return false;
}

static bool open_run(peer_request *request, void **given) {
    ode_run *run = calloc(1, sizeof *run);
    if (run == NULL)
        return false;
    *given = run;
    run->request = request;
    if (!peer_scene_open(request, &run->scene))
        return false;
    const kt_twin source = peer_scene_twin(&run->scene);
    run->twin = kt_ode_twin_create(&source);
    if (run->twin == NULL)
        return fail(run, "a body has no mass or no moment of inertia");
    run->pose = calloc((size_t)run->scene.count + 1, sizeof *run->pose);
    run->twist = calloc((size_t)run->scene.count + 1, sizeof *run->twist);
    return (run->pose != NULL && run->twist != NULL) || fail(run, "there is not enough memory");
}

static bool write_poses(ode_run *run, double *poses) {
    const kt_twin now = {NULL, NULL, run->pose, run->twist, NULL};
    kt_ode_twin_read(run->twin, &now);
    for (int i = 0; i < run->scene.count; i++) {
        if (!kt_vec3_is_finite(run->pose[i].position))
            return fail(run, "its numbers are not finite");
        peer_pose_write(run->pose[i], poses + PEER_POSE * i);
    }
    return true;
}

static bool run_motion(void *given, double *poses) {
    ode_run *run = given;
    const int steps = peer_steps(run->request);
    kt_ode_twin_start(run->twin);
    bool good = true;
    for (int record = 0; record <= run->request->records && good; record++) {
        if (record > 0)
            kt_ode_twin_step(run->twin, run->request->interval / steps, steps);
        if (poses != NULL)
            good = write_poses(run, poses + (size_t)record * (size_t)run->scene.count * PEER_POSE);
    }
    return good;
}

static int count_bodies(const void *given) { return ((const ode_run *)given)->scene.count; }

static const char *name_body(const void *given, int i) {
    return ((const ode_run *)given)->scene.e.scene.description.bodies[i].name;
}

static long count_evaluations(const void *given) {
    const peer_request *request = ((const ode_run *)given)->request;
    return (long)peer_steps(request) * request->records;
}

int main(int argc, char **argv) {
    static const peer_engine engine = {name_version, methods,   open_run,          run_motion,
                                       count_bodies, name_body, count_evaluations, close_run};
    return peer_main(&engine, argc, argv);
}
