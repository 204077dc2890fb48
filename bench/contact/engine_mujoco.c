/* Motions with contacts in MuJoCo. Its contacts are soft by design. One method has MuJoCo's defaults. The other one has
 * the stiffness that is advised for the step, the elliptic cone and the solver that removes slip, as in bench/hard. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../peers/mujoco_twin.h"
#include "engines.h"

#include <stdlib.h>
#include <string.h>

typedef struct mujoco_scene {
    mjModel *model;
    mjData *data;
} mujoco_scene;

/* The constant of time that MuJoCo advises, two steps. */
static void set_stiff_contacts(mjModel *model) {
    const mjtNum reference[] = {2.0 * model->opt.timestep, 1.0};
    for (int i = 0; i < model->ngeom; i++) {
        mjtNum *impedance = model->geom_solimp + (size_t)i * mjNIMP;
        memcpy(model->geom_solref + (size_t)i * mjNREF, reference, sizeof reference);
        impedance[0] = impedance[1] = 0.9999;
    }
    model->opt.cone = mjCONE_ELLIPTIC;
    model->opt.impratio = 10.0;
    model->opt.noslip_iterations = 20;
    model->opt.noslip_tolerance = 1e-14;
    model->opt.tolerance = 1e-14;
}

static void hide_warning(const char *words) { (void)words; }

static bool open_mujoco(kt_contact_run *run, bool is_stiff) {
    mujoco_scene *scene = run->own = calloc(1, sizeof *scene);
    char reason[KT_MUJOCO_REASON];
    double q[KT_CONTACT_COORDINATES], v[KT_CONTACT_COORDINATES];
    size_t size = 0;
    if (scene == NULL)
        return kt_contact_fail(run, "there is not enough memory");
    mju_user_warning = hide_warning; /* it would write a file */
    char *text = kt_mujoco_twin_write(&run->twin, run->setting, &size);
    scene->model = kt_mujoco_read(text, size, reason);
    if (scene->model == NULL)
        return kt_contact_fail(run, reason);
    scene->model->opt.integrator = mjINT_EULER;
    scene->model->opt.tolerance = 1e-8;
    if (is_stiff)
        set_stiff_contacts(scene->model);
    scene->data = mj_makeData(scene->model);
    kt_model_initial(run->model, q, v);
    kt_mujoco_twin_rates(run->model, v, scene->model, scene->data);
    return true;
}

static bool open_default(kt_contact_run *run) { return open_mujoco(run, false); }

static bool open_stiff(kt_contact_run *run) { return open_mujoco(run, true); }

static void hold_hinges(const kt_contact_run *run, const mujoco_scene *scene) {
    const mjModel *m = scene->model;
    for (int j = 0; j < m->njnt; j++)
        if (m->jnt_type[j] == mjJNT_HINGE)
            scene->data->qfrc_applied[m->jnt_dofadr[j]] =
                -run->motion->stiffness * scene->data->qpos[m->jnt_qposadr[j]] -
                run->motion->damping * scene->data->qvel[m->jnt_dofadr[j]];
}

static bool move_mujoco(kt_contact_run *run) {
    const mujoco_scene *scene = run->own;
    if (run->motion->stiffness > 0.0)
        hold_hinges(run, scene);
    for (long k = kt_contact_steps_of(run); k > 0; k--)
        mj_step(scene->model, scene->data);
    for (int w = 0; w < mjNWARNING; w++)
        if (scene->data->warning[w].number > 0)
            return kt_contact_fail(run, mju_warningText(w, scene->data->warning[w].lastinfo));
    return true;
}

static bool look_at_mujoco(kt_contact_run *run) {
    const mujoco_scene *scene = run->own;
    kt_mujoco_twin_read(scene->model, scene->data, &run->twin);
    return true;
}

static void close_mujoco(kt_contact_run *run) {
    mujoco_scene *scene = run->own;
    if (scene != NULL) {
        mj_deleteData(scene->data);
        mj_deleteModel(scene->model);
    }
    free(scene);
}

const kt_contact_engine kt_contact_mujoco = {"MuJoCo", false, open_default, move_mujoco, look_at_mujoco, close_mujoco};
const kt_contact_engine kt_contact_mujoco_stiff = {"MuJoCo, stiff", false,          open_stiff,
                                                   move_mujoco,     look_at_mujoco, close_mujoco};
