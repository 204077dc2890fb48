/* Models in MJCF, read here and by MuJoCo itself: the same mass matrix, bias force, places of bodies, forces of springs, dampers,
 * motors and servos, and accelerations, at random states; and equalities that have the same residuals.
 *
 * Positions are the same numbers in both: joints differ in their order alone. KT_MJCF_FILES names more files, apart by blanks, of
 * which those that both read are compared. */
#include "check.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 20 };

typedef struct pair {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    mjModel *m;
    mjData *d;
    int nq, nv, *at, *bodies; /* MuJoCo's velocity of each of ours; its body of each of ours, -1: none */
    double *q, *v, *a, *tau, *matrix, *theirs;
} pair;

/* ---- names --------------------------------------------------------------------------------------------------------- */

/* Ours have '_' for what names of scenes cannot have. */
static bool same_name(const char *ours, const char *theirs) {
    for (; *theirs != '\0' && (*theirs == *ours || *ours == '_'); theirs++)
        ours++;
    return *theirs == '\0' && *ours == '\0';
}

static int our_body(const kt_model *model, const char *theirs) {
    for (int b = 1; b < kt_model_body_count(model); b++)
        if (*theirs != '\0' && same_name(kt_body_name(model, b), theirs))
            return b;
    return -1;
}

/* The body of ours that has MuJoCo's joint: its own, or the body's own, which has as many coordinates. */
static int carrier_of(const pair *p, int joint) {
    static const int dofs[] = {[mjJNT_FREE] = 6, [mjJNT_BALL] = 3, [mjJNT_SLIDE] = 1, [mjJNT_HINGE] = 1};
    const mjModel *m = p->m;
    const char *names[] = {m->names + m->name_jntadr[joint], m->names + m->name_bodyadr[m->jnt_bodyid[joint]]};
    for (int i = 0; i < 2; i++) {
        const int b = our_body(p->model, names[i]);
        if (b >= 0 && kt_body_coordinates(p->model, b).nv == dofs[m->jnt_type[joint]])
            return b;
    }
    return -1;
}

/* ---- loading --------------------------------------------------------------------------------------------------------- */

static void release(pair *p) {
    kt_data_free(p->data);
    kt_model_free(p->model);
    kt_scene_free(&p->scene);
    if (p->d != NULL)
        mj_deleteData(p->d);
    if (p->m != NULL)
        mj_deleteModel(p->m);
    free(p->at);
    free(p->bodies);
    free(p->q);
}

static bool take_memory(pair *p) {
    const size_t nq = (size_t)p->nq + 1, nv = (size_t)p->nv + 1, bodies = (size_t)kt_model_body_count(p->model);
    p->at = calloc(nv, sizeof *p->at);
    p->bodies = calloc(bodies, sizeof *p->bodies);
    p->q = calloc(nq + 3 * nv + 2 * nv * nv, sizeof *p->q);
    if (p->at == NULL || p->bodies == NULL || p->q == NULL)
        return kt_check_true("there is memory", false);
    p->v = p->q + nq;
    p->a = p->v + nv;
    p->tau = p->a + nv;
    p->matrix = p->tau + nv;
    p->theirs = p->matrix + nv * nv;
    return true;
}

static bool load(pair *p, const char *path, const kt_robot_options *options) {
    kt_error error = {0};
    char said[1000] = "";
    memset(p, 0, sizeof *p);
    if (kt_robot_read(path, options, &p->scene, NULL, NULL, &error) != KT_OK ||
        kt_model_compile(&p->scene.description, NULL, &p->model, &error) != KT_OK ||
        kt_data_create(p->model, &p->data, &error) != KT_OK) {
        kt_note("%s: %s", error.where, error.message);
        return kt_check_true("it is read and compiled", false);
    }
    p->m = mj_loadXML(path, NULL, said, sizeof said);
    if (p->m == NULL) {
        kt_note("%s", said);
        return kt_check_true("MuJoCo reads it", false);
    }
    p->m->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_CONSTRAINT;
    p->d = mj_makeData(p->m);
    p->nq = p->m->nq;
    p->nv = p->m->nv;
    if (!take_memory(p))
        return false;
    for (int b = 0; b < kt_model_body_count(p->model); b++)
        p->bodies[b] = b == 0 ? 0 : -1;
    for (int i = 1; i < p->m->nbody; i++) {
        const int b = our_body(p->model, p->m->names + p->m->name_bodyadr[i]);
        if (b > 0)
            p->bodies[b] = i;
    }
    for (int j = 0; j < p->m->njnt; j++) {
        const int b = carrier_of(p, j);
        if (b < 0) {
            kt_note("joint %s of body %s", p->m->names + p->m->name_jntadr[j],
                    p->m->names + p->m->name_bodyadr[p->m->jnt_bodyid[j]]);
            return kt_check_true("it has the joint", false);
        }
        const kt_coordinates c = kt_body_coordinates(p->model, b);
        for (int k = 0; k < c.nv; k++)
            p->at[c.v + k] = p->m->jnt_dofadr[j] + k;
    }
    return true;
}

/* ---- states ---------------------------------------------------------------------------------------------------------- */

/* A random state of MuJoCo, and the same in our coordinates. */
static void set_state(pair *p, kt_random *random) {
    const mjModel *m = p->m;
    for (int i = 0; i < p->nq; i++)
        p->d->qpos[i] = kt_random_uniform(random, -1.0, 1.0);
    mj_normalizeQuat(m, p->d->qpos);
    for (int i = 0; i < p->nv; i++)
        p->d->qvel[i] = kt_random_uniform(random, -2.0, 2.0);
    for (int j = 0; j < m->njnt; j++) {
        const kt_coordinates c = kt_body_coordinates(p->model, carrier_of(p, j));
        memcpy(p->q + c.q, p->d->qpos + m->jnt_qposadr[j], (size_t)c.nq * sizeof *p->q);
        memcpy(p->v + c.v, p->d->qvel + m->jnt_dofadr[j], (size_t)c.nv * sizeof *p->v);
    }
}

typedef struct findings {
    kt_worst mass, bias, place, turn, force, acceleration;
} findings;

/* Positions and velocities of ours that MuJoCo does not have: lengths of tendons. They do not concern what trees have. */
static void compare_vector(kt_worst *worst, const pair *p, const double *ours, const double *theirs, double bound) {
    double most = 1e-9;
    for (int i = 0; i < p->nv; i++)
        most = fmax(most, fabs(theirs[i]));
    for (int i = 0; i < p->nv; i++)
        kt_worst_near(worst, ours[i], theirs[p->at[i]], bound * most, "%d", i);
}

static void compare_places(pair *p, findings *f) {
    kt_error error = {0};
    if (kt_kinematics_update(p->model, p->data, p->q, p->v, NULL, &error) != KT_OK)
        kt_worst_below(&f->place, (double)NAN, 0.0, "%s", error.message);
    for (int b = 1; b < kt_model_body_count(p->model); b++) {
        const int i = p->bodies[b];
        const kt_pose pose = kt_body_pose(p->model, p->data, b);
        const kt_mat3 r = kt_mat3_transpose(pose.rotation);
        for (int k = 0; k < 3 && i > 0; k++)
            kt_worst_near(&f->place, (&pose.position.x)[k], p->d->xpos[3 * i + k],
                          1e-14 * fmax(1.0, kt_vec3_norm(pose.position)), "%s", kt_body_name(p->model, b));
        for (int k = 0; k < 9 && i > 0; k++)
            kt_worst_near(&f->turn, (&r.x.x)[k], p->d->xmat[9 * i + k], 1e-14, "%s", kt_body_name(p->model, b));
    }
}

/* MuJoCo turns inertias to principal axes, by rotations which end where the cosine of the next is above 1 - 1e-12: axes may be
 * off by 1.4e-6 rad, and an inertia by that times the difference of two principal moments. 1.6e-10 of the largest entry was
 * measured. Places do not depend on it. */
static void compare_mass(pair *p, findings *f, double bound) {
    double most = 0.0;
    kt_error error = {0};
    mj_fullM(p->m, p->theirs, p->d->qM);
    if (kt_dynamics_mass(p->model, p->data, p->q, p->matrix, &error) != KT_OK ||
        kt_dynamics_inverse(p->model, p->data, p->q, p->v, p->a, NULL, p->tau, &error) != KT_OK)
        kt_worst_below(&f->mass, (double)NAN, 0.0, "%s", error.message);
    for (int i = 0; i < p->nv * p->nv; i++)
        most = fmax(most, fabs(p->theirs[i]));
    for (int i = 0; i < p->nv; i++)
        for (int k = 0; k < p->nv; k++)
            kt_worst_near(&f->mass, p->matrix[i + p->nv * k], p->theirs[p->at[i] * p->nv + p->at[k]], bound * most,
                          "%d, %d", i, k);
    compare_vector(&f->bias, p, p->tau, p->d->qfrc_bias, bound);
}

/* Forces of springs, dampers and actuators, and what follows. */
static void compare_forces(pair *p, findings *f, double bound) {
    kt_error error = {0};
    mjtNum *sum = p->theirs;
    for (int i = 0; i < p->nv; i++)
        sum[i] = p->d->qfrc_passive[i] + p->d->qfrc_actuator[i];
    if (kt_effect_forces(p->model, p->data, 0.0, p->q, p->v, p->tau, &error) != KT_OK)
        kt_worst_below(&f->force, (double)NAN, 0.0, "%s", error.message);
    compare_vector(&f->force, p, p->tau, sum, 1e-13);
    if (kt_acceleration_evaluate(p->model, p->data, 0.0, p->q, p->v, NULL, NULL, p->a, &error) != KT_OK)
        kt_worst_below(&f->acceleration, (double)NAN, 0.0, "%s", error.message);
    compare_vector(&f->acceleration, p, p->a, p->d->qacc, bound);
    memset(p->a, 0, (size_t)p->nv * sizeof *p->a);
}

static void compare_tree(const char *path, const kt_robot_options *options, bool forces, double bound) {
    pair p;
    kt_random random = kt_random_of_test();
    findings f = {kt_worst_make("mass matrix"), kt_worst_make("bias force"),    kt_worst_make("place, m"),
                  kt_worst_make("orientation"), kt_worst_make("forces"), kt_worst_make("accelerations")};
    if (load(&p, path, options) && kt_check_equal_int("degrees of freedom", kt_model_nv(p.model), p.nv)) {
        for (int n = 0; n < STATES; n++) {
            set_state(&p, &random);
            mj_forward(p.m, p.d);
            compare_mass(&p, &f, bound);
            compare_places(&p, &f);
            if (forces)
                compare_forces(&p, &f, 100.0 * bound);
        }
        kt_worst *all[] = {&f.mass, &f.bias, &f.place, &f.turn, &f.force, &f.acceleration};
        for (int i = 0; i < (forces ? 6 : 4); i++)
            kt_check_worst(all[i]);
    }
    release(&p);
}

KT_TEST(tree_of_every_element_is_the_one_that_mujoco_reads) {
    compare_tree(MODELS "/tree.xml", NULL, true, 1e-9);
}

KT_TEST(masses_follow_the_settings_of_the_compiler) {
    compare_tree(MODELS "/masses.xml", NULL, true, 1e-13);
}

KT_TEST(files_that_are_named_are_those_that_mujoco_reads) {
    const char *files = getenv("KT_MJCF_FILES");
    char list[100000];
    if (files == NULL) {
        kt_skip("files that are named", "KT_MJCF_FILES names none");
        return;
    }
    (void)snprintf(list, sizeof list, "%s", files);
    for (char *path = strtok(list, " \n"); path != NULL; path = strtok(NULL, " \n")) {
        kt_note("%s", path);
        compare_tree(path, NULL, getenv("KT_MJCF_FORCES") != NULL, 1e-9);
    }
}
