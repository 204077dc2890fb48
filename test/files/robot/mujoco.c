/* A robot in URDF, read here and by MuJoCo, which has a reader of its own. Mass matrix, bias force and places of links
 * are the same. MuJoCo 2.2 leaves `mimic` out and names bodies as links; joints are found by their bodies. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "match.h"
#include "mujoco_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 20, NV = 16 };

typedef struct robots {
    mujoco_pair both;
    int nv, at[NV]; /* MuJoCo's coordinate of each of ours */
} robots;

static int body_of(const mjModel *m, const char *ours) {
    for (int i = 1; i < m->nbody; i++)
        if (same_name(ours, m->names + m->name_bodyadr[i]))
            return i;
    return -1;
}

static bool load(robots *r) {
    load_mujoco_pair(&r->both, KT_MODELS "/arm.urdf", NULL);
    r->both.m->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_PASSIVE | mjDSBL_ACTUATION;
    r->nv = kt_model_nv(r->both.model);
    for (int b = 1; b < kt_model_body_count(r->both.model); b++) {
        const kt_coordinates c = kt_body_coordinates(r->both.model, b);
        const int theirs = body_of(r->both.m, kt_body_name(r->both.model, b));
        if (c.nv == 1 && !kt_check_true("MuJoCo has the body", theirs > 0 && r->both.m->body_dofnum[theirs] == 1))
            return false;
        if (c.nv == 1)
            r->at[c.v] = r->both.m->body_dofadr[theirs];
    }
    return kt_check_equal_int("degrees of freedom", r->nv, r->both.m->nv);
}

/* M and h against theirs, in parts of the largest entry. MuJoCo turns inertias to principal axes and stops at
 * off-diagonal entries below 1e-12 kg m^2. This is 1.8e-11 of the largest entry here. An inertia about other axes, or
 * with the other sign of its products, is 1e-4 off. */
static void compare(robots *r, kt_random *random, kt_worst *mass, kt_worst *bias, kt_worst *place) {
    double q[NV], v[NV], zero[NV] = {0}, tau[NV], matrix[NV * NV], theirs[NV * NV];
    kt_error error = {0};
    for (int i = 0; i < r->nv; i++) {
        r->both.d->qpos[r->at[i]] = q[i] = kt_random_uniform(random, -2.0, 2.0);
        r->both.d->qvel[r->at[i]] = v[i] = kt_random_uniform(random, -3.0, 3.0);
    }
    mj_forward(r->both.m, r->both.d);
    mj_fullM(r->both.m, theirs, r->both.d->qM);
    if (kt_dynamics_mass(r->both.model, r->both.data, q, matrix, &error) != KT_OK ||
        kt_dynamics_inverse(r->both.model, r->both.data, q, v, zero, NULL, tau, &error) != KT_OK) {
        kt_worst_below(mass, (double)NAN, 0.0, "%s", error.message);
        return;
    }
    double most = 0.0, force = 0.0;
    for (int i = 0; i < r->nv * r->nv; i++)
        most = fmax(most, fabs(theirs[i]));
    for (int i = 0; i < r->nv; i++)
        force = fmax(force, fabs(r->both.d->qfrc_bias[i]));
    for (int i = 0; i < r->nv; i++) {
        for (int k = 0; k < r->nv; k++)
            kt_worst_near(mass, matrix[i + r->nv * k], theirs[r->at[i] * r->nv + r->at[k]], 1e-10 * most, "%d, %d", i,
                          k);
        kt_worst_near(bias, tau[i], r->both.d->qfrc_bias[r->at[i]], 1e-10 * force, "%d", i);
    }
    if (kt_kinematics_update(r->both.model, r->both.data, q, v, NULL, &error) != KT_OK)
        kt_worst_below(place, (double)NAN, 0.0, "%s", error.message);
    for (int b = 1; b < kt_model_body_count(r->both.model); b++) {
        const int other = body_of(r->both.m, kt_body_name(r->both.model, b));
        const kt_vec3 p = kt_body_pose(r->both.model, r->both.data, b).position;
        for (int k = 0; k < 3 && other > 0; k++)
            kt_worst_near(place, (const double[]){p.x, p.y, p.z}[k], r->both.d->xpos[3 * other + k], 1e-14, "%s",
                          kt_body_name(r->both.model, b));
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
}
