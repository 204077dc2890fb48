/* A robot in URDF, read here and by MuJoCo, which has a reader of its own. Mass matrix, bias force and places of links
 * are the same. MuJoCo 2.2 leaves `mimic` out and names bodies as links; joints are found by their bodies. */
#include "check.h"
#include "match.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 20, NV = 16 };

typedef struct robots {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    mjModel *m;
    mjData *d;
    int nv, at[NV]; /* MuJoCo's coordinate of each of ours */
} robots;

static int body_of(const mjModel *m, const char *ours) {
    for (int i = 1; i < m->nbody; i++)
        if (same_name(ours, m->names + m->name_bodyadr[i]))
            return i;
    return -1;
}

static bool load(robots *r) {
    kt_error error = {0};
    char said[1000] = "";
    memset(r, 0, sizeof *r);
    if (kt_robot_read(ARM, NULL, &r->scene, NULL, NULL, &error) != KT_OK ||
        kt_model_compile(&r->scene.description, NULL, &r->model, &error) != KT_OK ||
        kt_data_create(r->model, &r->data, &error) != KT_OK) {
        kt_note("%s: %s", error.where, error.message);
        return kt_check_true("it is read and compiled", false);
    }
    r->m = mj_loadXML(ARM, NULL, said, sizeof said);
    if (r->m == NULL) {
        kt_note("%s", said);
        return kt_check_true("MuJoCo reads it", false);
    }
    r->m->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_PASSIVE | mjDSBL_ACTUATION;
    r->d = mj_makeData(r->m);
    r->nv = kt_model_nv(r->model);
    for (int b = 1; b < kt_model_body_count(r->model); b++) {
        const kt_coordinates c = kt_body_coordinates(r->model, b);
        const int theirs = body_of(r->m, kt_body_name(r->model, b));
        if (c.nv == 1 && !kt_check_true("MuJoCo has the body", theirs > 0 && r->m->body_dofnum[theirs] == 1))
            return false;
        if (c.nv == 1)
            r->at[c.v] = r->m->body_dofadr[theirs];
    }
    return kt_check_equal_int("degrees of freedom", r->nv, r->m->nv);
}

static void release(robots *r) {
    kt_data_free(r->data);
    kt_model_free(r->model);
    kt_scene_free(&r->scene);
    if (r->d != NULL)
        mj_deleteData(r->d);
    if (r->m != NULL)
        mj_deleteModel(r->m);
}

/* M and h against theirs, in parts of the largest entry. MuJoCo turns inertias to principal axes and stops at
 * off-diagonal entries below 1e-12 kg m^2. This is 1.8e-11 of the largest entry here. An inertia about other axes, or
 * with the other sign of its products, is 1e-4 off. */
static void compare(robots *r, kt_random *random, kt_worst *mass, kt_worst *bias, kt_worst *place) {
    double q[NV], v[NV], zero[NV] = {0}, tau[NV], matrix[NV * NV], theirs[NV * NV];
    kt_error error = {0};
    for (int i = 0; i < r->nv; i++) {
        r->d->qpos[r->at[i]] = q[i] = kt_random_uniform(random, -2.0, 2.0);
        r->d->qvel[r->at[i]] = v[i] = kt_random_uniform(random, -3.0, 3.0);
    }
    mj_forward(r->m, r->d);
    mj_fullM(r->m, theirs, r->d->qM);
    if (kt_dynamics_mass(r->model, r->data, q, matrix, &error) != KT_OK ||
        kt_dynamics_inverse(r->model, r->data, q, v, zero, NULL, tau, &error) != KT_OK) {
        kt_worst_below(mass, (double)NAN, 0.0, "%s", error.message);
        return;
    }
    double most = 0.0, force = 0.0;
    for (int i = 0; i < r->nv * r->nv; i++)
        most = fmax(most, fabs(theirs[i]));
    for (int i = 0; i < r->nv; i++)
        force = fmax(force, fabs(r->d->qfrc_bias[i]));
    for (int i = 0; i < r->nv; i++) {
        for (int k = 0; k < r->nv; k++)
            kt_worst_near(mass, matrix[i + r->nv * k], theirs[r->at[i] * r->nv + r->at[k]], 1e-10 * most, "%d, %d", i,
                          k);
        kt_worst_near(bias, tau[i], r->d->qfrc_bias[r->at[i]], 1e-10 * force, "%d", i);
    }
    if (kt_kinematics_update(r->model, r->data, q, v, NULL, &error) != KT_OK)
        kt_worst_below(place, (double)NAN, 0.0, "%s", error.message);
    for (int b = 1; b < kt_model_body_count(r->model); b++) {
        const int other = body_of(r->m, kt_body_name(r->model, b));
        const kt_vec3 p = kt_body_pose(r->model, r->data, b).position;
        for (int k = 0; k < 3 && other > 0; k++)
            kt_worst_near(place, (const double[]){p.x, p.y, p.z}[k], r->d->xpos[3 * other + k], 1e-14, "%s",
                          kt_body_name(r->model, b));
    }
}

KT_TEST(robot_is_the_one_that_mujoco_reads) {
    robots r;
    kt_random random = kt_random_of_test();
    kt_worst mass = kt_worst_make("mass matrix"), bias = kt_worst_make("bias force"), place = kt_worst_make("place, m");
    if (load(&r)) {
        for (int n = 0; n < STATES; n++)
            compare(&r, &random, &mass, &bias, &place);
        kt_check_worst(&mass);
        kt_check_worst(&bias);
        kt_check_worst(&place);
    }
    release(&r);
}
