/* MuJoCo as a peer of `kinetree accuracy`. It reads the scene as MJCF. Loops in that file are constraints of sites,
 * which versions before 3.1 do not have. If MuJoCo rejects the file, the mechanism is built by mujoco_twin.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco_twin.h"
#include "peer_scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct mujoco_run {
    peer_request *request;
    mjModel *model;
    mjData *data;
    int steps, stages; /* of an interval; evaluations of a step */
    long evaluations;
    peer_scene scene; /* of a twin */
    bool is_twin;
} mujoco_run;

static const peer_method methods[] = {{"Euler", false}, {"implicit", false}, {"RK4", false}, {NULL, false}};

static const char *name_version(void) {
    static char text[40];
    (void)snprintf(text, sizeof text, "MuJoCo %s", mj_versionString());
    return text;
}

static void close_run(void *given) {
    mujoco_run *run = given;
    mj_deleteData(run->data);
    mj_deleteModel(run->model);
    peer_scene_close(&run->scene);
    free(run);
}

/* Constraints are soft by design. Their time constant becomes the least that MuJoCo advises, two steps. */
static void stiffen(mjModel *model) {
    const mjtNum reference[] = {2.0 * model->opt.timestep, 1.0};
    const mjtNum impedance[] = {0.9999, 0.9999, 0.001, 0.5, 2.0};
    for (int i = 0; i < model->neq; i++) {
        memcpy(model->eq_solref + (size_t)i * mjNREF, reference, sizeof reference);
        memcpy(model->eq_solimp + (size_t)i * mjNIMP, impedance, sizeof impedance);
    }
    model->opt.iterations = 100;
    model->opt.tolerance = 1e-14;
}

/* On failure the reason is that of the file, unless an old version merely does not know constraints of sites. */
static mjModel *build_twin(mujoco_run *run) {
    peer_request twin_request = *run->request;
    char reason[KT_MUJOCO_REASON];
    size_t size = 0;
    if (!peer_scene_open(&twin_request, &run->scene)) {
        if (strstr(run->request->reason, "'site1'") != NULL)
            memcpy(run->request->reason, twin_request.reason, sizeof twin_request.reason);
        return NULL;
    }
    const kt_twin twin = peer_scene_twin(&run->scene);
    char *text = kt_mujoco_twin_write(&twin, run->request->interval / peer_steps(run->request), &size);
    run->is_twin = true;
    return kt_mujoco_read(text, size, reason);
}

static bool open_run(peer_request *request, void **given) {
    mujoco_run *run = calloc(1, sizeof *run);
    if (run == NULL)
        return false;
    *given = run;
    run->request = request;
    run->model = mj_loadXML(request->mjcf, NULL, request->reason, PEER_REASON);
    if (run->model == NULL)
        run->model = build_twin(run);
    if (run->model == NULL)
        return false;
    run->steps = peer_steps(request);
    run->stages = strcmp(request->method, "RK4") == 0 ? 4 : 1;
    run->model->opt.timestep = request->interval / run->steps;
    run->model->opt.integrator = run->stages == 4                           ? mjINT_RK4
                                 : strcmp(request->method, "implicit") == 0 ? mjINT_IMPLICIT
                                                                            : mjINT_EULER;
    stiffen(run->model);
    run->data = mj_makeData(run->model);
    return run->data != NULL;
}

/* MuJoCo resets a state that has no finite acceleration; its warnings count that. */
static bool was_good(mujoco_run *run, int record) {
    for (int w = 0; w < mjNWARNING; w++)
        if (run->data->warning[w].number > 0) {
            (void)snprintf(run->request->reason, PEER_REASON, "%s (before t = %g s)",
                           mju_warningText(w, run->data->warning[w].lastinfo), record * run->request->interval);
            return false;
        }
    return true;
}

static void write_poses(const mujoco_run *run, double *poses) {
    mj_kinematics(run->model, run->data);
    for (int b = 1; b < run->model->nbody; b++, poses += PEER_POSE) {
        memcpy(poses, run->data->xpos + 3 * (size_t)b, 3 * sizeof *poses);
        memcpy(poses + 3, run->data->xquat + 4 * (size_t)b, 4 * sizeof *poses);
    }
}

static bool run_motion(void *given, double *poses) {
    mujoco_run *run = given;
    const size_t width = PEER_POSE * ((size_t)run->model->nbody - 1);
    if (run->model->nkey > 0)
        mj_resetDataKeyframe(run->model, run->data, 0);
    else
        mj_resetData(run->model, run->data);
    if (run->is_twin)
        kt_mujoco_twin_rates(run->scene.e.model, run->scene.e.start + run->scene.e.nq, run->model, run->data);
    run->evaluations = 0;
    for (int record = 0; record <= run->request->records; record++) {
        for (int k = 0; record > 0 && k < run->steps; k++, run->evaluations += run->stages)
            mj_step(run->model, run->data);
        if (!was_good(run, record))
            return false;
        if (poses != NULL)
            write_poses(run, poses + (size_t)record * width);
    }
    return true;
}

static int count_bodies(const void *given) { return ((const mujoco_run *)given)->model->nbody - 1; }

static const char *name_body(const void *given, int i) {
    const mujoco_run *run = given;
    const char *name = mj_id2name(run->model, mjOBJ_BODY, i + 1);
    return run->is_twin ? run->scene.e.scene.description.bodies[strtol(name + 1, NULL, 10)].name : name;
}

static long count_evaluations(const void *given) { return ((const mujoco_run *)given)->evaluations; }

static const peer_engine engine = {name_version, methods,   open_run,          run_motion,
                                   count_bodies, name_body, count_evaluations, close_run};

static void say_nothing(const char *text) { (void)text; }

int main(int argc, char **argv) {
    mju_user_warning = say_nothing; /* it would write a file of its own */
    return peer_main(&engine, argc, argv);
}
