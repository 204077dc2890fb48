/* SUNDIALS on the library's own equations as a peer of `kinetree accuracy`. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "peer_scene.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct solver_motion {
    peer_request *request;
    equations e;
    double *poses; /* of the run that is under way; NULL: not wanted */
    bool is_open;
} solver_motion;

static const peer_method methods[] = {{"cvode-adams", true}, {"cvode-bdf", true}, {"erk5", true}, {"erk8", true},
                                      {"dirk5", true},       {"ida", true},       {NULL, false}};

static const char *name_version(void) {
    static char text[40];
    (void)snprintf(text, sizeof text, "SUNDIALS %s", sundials_version());
    return text;
}

static void close_motion(void *given) {
    solver_motion *motion = given;
    if (motion->is_open)
        equations_close(&motion->e);
    free(motion);
}

static bool open_motion(peer_request *request, void **given) {
    solver_motion *motion = calloc(1, sizeof *motion);
    kt_scene_options options = kt_scene_options_default();
    if (motion == NULL)
        return false;
    *given = motion;
    motion->request = request;
    options.settings = request->settings;
    options.setting_count = request->setting_count;
    motion->is_open = equations_open(&motion->e, request->scene, &options, KT_ISA_AUTO);
    motion->e.limit = 100000000;
    if (!motion->is_open)
        (void)snprintf(request->reason, PEER_REASON, "the scene cannot be read");
    else if (kt_auxiliary_state_count(motion->e.model) > 0)
        (void)snprintf(request->reason, PEER_REASON, "auxiliary states are not part of these equations");
    return motion->is_open && kt_auxiliary_state_count(motion->e.model) == 0;
}

static bool write_record(void *given, int record, const double *y) {
    solver_motion *motion = given;
    equations *e = &motion->e;
    const int count = kt_model_body_count(e->model) - 1;
    if (motion->poses == NULL)
        return true;
    if (kt_kinematics_update(e->model, e->data, y, y + e->nq, NULL, &e->error) != KT_OK)
        return false;
    for (int b = 1; b <= count; b++)
        peer_pose_write(kt_body_pose(e->model, e->data, b),
                        motion->poses + ((size_t)record * (size_t)count + (size_t)b - 1) * PEER_POSE);
    return true;
}

static bool run_motion(void *given, double *poses) {
    solver_motion *motion = given;
    const peer_request *r = motion->request;
    motion->poses = poses;
    motion->e.evaluations = 0;
    const char *failed = write_record(motion, 0, motion->e.start)
                             ? sundials_records(&motion->e, r->method, r->setting, r->interval * r->records, r->records,
                                                write_record, motion)
                             : motion->e.error.message;
    if (failed != NULL)
        (void)snprintf(motion->request->reason, PEER_REASON, "%.299s", failed);
    return failed == NULL;
}

static int count_bodies(const void *given) { return kt_model_body_count(((const solver_motion *)given)->e.model) - 1; }

static const char *name_body(const void *given, int i) {
    return kt_body_name(((const solver_motion *)given)->e.model, i + 1);
}

static long count_evaluations(const void *given) { return ((const solver_motion *)given)->e.evaluations; }

int main(int argc, char **argv) {
    static const peer_engine engine = {name_version, methods,   open_motion,       run_motion,
                                       count_bodies, name_body, count_evaluations, close_motion};
    return peer_main(&engine, argc, argv);
}
