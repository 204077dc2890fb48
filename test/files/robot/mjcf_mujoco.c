/* Models in MJCF, read here and by MuJoCo itself. At random states they have the same mass matrix, bias force, places
 * of bodies and accelerations. The forces of springs, dampers, motors and servos agree as well. Equalities have the
 * same residuals.
 *
 * Positions are the same numbers in both: joints differ in their order alone. KT_MJCF_FILES names more files, separated
 * by blanks. Those that both can read are compared. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "equality.h"
#include "match.h"
#include "mujoco_pair.h"
#include "numbers.h"

#include "algebra/principal.h"
#include "base/order.h"

#include "kinetree/export.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 20 };

typedef struct pair {
    mujoco_pair both;
    int nq, nv, *at, *bodies; /* MuJoCo's velocity of each of ours; its body of each of ours, -1: none */
    int *carrier;             /* our body of each of MuJoCo's joints */
    double *q, *v, *a, *tau, *matrix, *theirs;
} pair;

/* The bodies of ours that have MuJoCo's joints: both are in the order of the file. The other moving bodies are lengths
 * of tendons. */
static bool find_carriers(pair *p) {
    static const int dofs[] = {[mjJNT_FREE] = 6, [mjJNT_BALL] = 3, [mjJNT_SLIDE] = 1, [mjJNT_HINGE] = 1};
    int joint = 0;
    for (int i = 0; i < p->both.scene->description.body_count && joint < p->both.m->njnt; i++) {
        const kt_body *body = &p->both.scene->description.bodies[i];
        if (body->joint.type == KT_JOINT_FIXED)
            continue;
        p->carrier[joint] = our_body(p->both.model, body->name);
        if (!kt_check_true("it has the joint",
                           p->carrier[joint] >= 0 && kt_body_coordinates(p->both.model, p->carrier[joint]).nv ==
                                                         dofs[p->both.m->jnt_type[joint]]))
            return false;
        joint++;
    }
    return kt_check_equal_int("joints", joint, p->both.m->njnt);
}

/* ---- loading ----------------------------------------------------------------------------------------------------- */

static void release(pair *p) {
    free(p->at);
    free(p->bodies);
    free(p->carrier);
    free(p->q);
}

static bool take_memory(pair *p) {
    const size_t nq = (size_t)kt_model_nq(p->both.model) + 1, nv = (size_t)kt_model_nv(p->both.model) + 1,
                 bodies = (size_t)kt_model_body_count(p->both.model);
    p->at = calloc(nv, sizeof *p->at);
    p->bodies = calloc(bodies, sizeof *p->bodies);
    p->carrier = calloc((size_t)p->both.m->njnt + 1, sizeof *p->carrier);
    if (p->at == NULL || p->bodies == NULL || p->carrier == NULL)
        return kt_check_true("there is memory", false);
    return TAKE_NUMBERS({&p->q, nq}, {&p->v, nv}, {&p->a, nv}, {&p->tau, nv}, {&p->matrix, nv * nv},
                        {&p->theirs, nv * nv});
}

static bool load(pair *p, const char *path, const kt_robot_options *options) {
    memset(p, 0, sizeof *p);
    load_mujoco_pair(&p->both, path, options);
    p->both.m->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_CONSTRAINT;
    p->nq = p->both.m->nq;
    p->nv = p->both.m->nv;
    if (!take_memory(p))
        return false;
    for (int b = 0; b < kt_model_body_count(p->both.model); b++)
        p->bodies[b] = b == 0 ? 0 : -1;
    for (int i = 1; i < p->both.m->nbody; i++) {
        const int b = our_body(p->both.model, p->both.m->names + p->both.m->name_bodyadr[i]);
        if (b > 0)
            p->bodies[b] = i;
    }
    if (!find_carriers(p))
        return false;
    for (int j = 0; j < p->both.m->njnt; j++) {
        const kt_coordinates c = kt_body_coordinates(p->both.model, p->carrier[j]);
        for (int k = 0; k < c.nv; k++)
            p->at[c.v + k] = p->both.m->jnt_dofadr[j] + k;
    }
    return true;
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* A random state of MuJoCo, and the same in our coordinates. */
static void set_state(pair *p, kt_random *random) {
    const mjModel *m = p->both.m;
    for (int i = 0; i < p->nq; i++)
        p->both.d->qpos[i] = kt_random_uniform(random, -1.0, 1.0);
    mj_normalizeQuat(m, p->both.d->qpos);
    for (int i = 0; i < p->nv; i++)
        p->both.d->qvel[i] = kt_random_uniform(random, -2.0, 2.0);
    for (int j = 0; j < m->njnt; j++) {
        const kt_coordinates c = kt_body_coordinates(p->both.model, p->carrier[j]);
        memcpy(p->q + c.q, p->both.d->qpos + m->jnt_qposadr[j], (size_t)c.nq * sizeof *p->q);
        memcpy(p->v + c.v, p->both.d->qvel + m->jnt_dofadr[j], (size_t)c.nv * sizeof *p->v);
    }
}

typedef struct findings {
    kt_worst mass, bias, place, turn, force, acceleration;
} findings;

/* Positions and velocities of ours that MuJoCo does not have: lengths of tendons. They do not affect the quantities of
 * trees. */
static void compare_vector(kt_worst *worst, const pair *p, const double *ours, const double *theirs, double bound) {
    double most = 1e-9;
    for (int i = 0; i < p->nv; i++)
        most = fmax(most, fabs(theirs[i]));
    for (int i = 0; i < p->nv; i++)
        kt_worst_near(worst, ours[i], theirs[p->at[i]], bound * most, "%d", i);
}

static void compare_places(pair *p, findings *f) {
    kt_error error = {0};
    if (kt_kinematics_update(p->both.model, p->both.data, p->q, p->v, NULL, &error) != KT_OK)
        kt_worst_below(&f->place, (double)NAN, 0.0, "%s", error.message);
    for (int b = 1; b < kt_model_body_count(p->both.model); b++) {
        const int i = p->bodies[b];
        const kt_pose pose = kt_body_pose(p->both.model, p->both.data, b);
        const kt_vec3 x = pose.rotation.x, y = pose.rotation.y, z = pose.rotation.z;
        const double at[3] = {pose.position.x, pose.position.y, pose.position.z};
        const double rows[9] = {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
        for (int k = 0; k < 3 && i > 0; k++)
            kt_worst_near(&f->place, at[k], p->both.d->xpos[3 * i + k], 1e-14 * fmax(1.0, kt_vec3_norm(pose.position)),
                          "%s", kt_body_name(p->both.model, b));
        for (int k = 0; k < 9 && i > 0; k++)
            kt_worst_near(&f->turn, rows[k], p->both.d->xmat[9 * i + k], 1e-14, "%s", kt_body_name(p->both.model, b));
    }
}

/* MuJoCo turns inertias to principal axes, by rotations that stop when the cosine of the next is above `1 - 1e-12`.
 * Axes may be off by 1.4e-6 rad. An inertia may be off by this times the difference of two principal moments. 1.6e-10
 * of the largest entry was measured. Places do not depend on it. */
static void compare_mass(pair *p, findings *f, double bound) {
    double most = 0.0;
    kt_error error = {0};
    mj_fullM(p->both.m, p->theirs, p->both.d->qM);
    if (kt_dynamics_mass(p->both.model, p->both.data, p->q, p->matrix, &error) != KT_OK ||
        kt_dynamics_inverse(p->both.model, p->both.data, p->q, p->v, p->a, NULL, p->tau, &error) != KT_OK)
        kt_worst_below(&f->mass, (double)NAN, 0.0, "%s", error.message);
    for (int i = 0; i < p->nv * p->nv; i++)
        most = fmax(most, fabs(p->theirs[i]));
    for (int i = 0; i < p->nv; i++)
        for (int k = 0; k < p->nv; k++)
            kt_worst_near(&f->mass, p->matrix[i + p->nv * k], p->theirs[p->at[i] * p->nv + p->at[k]], bound * most,
                          "%d, %d", i, k);
    compare_vector(&f->bias, p, p->tau, p->both.d->qfrc_bias, bound);
}

/* Compares forces of springs, dampers and actuators, and the resulting accelerations. */
static void compare_forces(pair *p, findings *f, double bound) {
    kt_error error = {0};
    mjtNum *sum = p->theirs;
    for (int i = 0; i < p->nv; i++)
        sum[i] = p->both.d->qfrc_passive[i] + p->both.d->qfrc_actuator[i];
    if (kt_effect_forces(p->both.model, p->both.data, 0.0, p->q, p->v, p->tau, &error) != KT_OK)
        kt_worst_below(&f->force, (double)NAN, 0.0, "%s", error.message);
    compare_vector(&f->force, p, p->tau, sum, 1e-13);
    if (kt_acceleration_evaluate(p->both.model, p->both.data, 0.0, p->q, p->v, NULL, NULL, p->a, &error) != KT_OK)
        kt_worst_below(&f->acceleration, (double)NAN, 0.0, "%s", error.message);
    compare_vector(&f->acceleration, p, p->a, p->both.d->qacc, bound);
    memset(p->a, 0, (size_t)p->nv * sizeof *p->a);
}

/* ---- principal axes ---------------------------------------------------------------------------------------------- */

/* Quantities that do not depend on axes agree to rounding: mass, centre of mass, and principal moments. The error of
 * these moments is of second order in that of the axes. The whole inertia agrees to 1.5e-6, the largest error of
 * MuJoCo's rotations. Its axes and moments are then replaced by those that belong to the same inertia to rounding. */
static void compare_inertia(pair *p, int ours, int theirs, kt_worst *invariant, kt_worst *whole) {
    const kt_body *body = &p->both.scene->description.bodies[kt_body_source(p->both.model, ours)];
    const mjModel *m = p->both.m;
    kt_vec3 com;
    kt_sym3 inertia;
    kt_error error = {0};
    if (kt_body_inertia(body, &com, &inertia, &error) != KT_OK)
        kt_worst_below(invariant, (double)NAN, 0.0, "%s", error.message);
    const kt_mat3 axes = kt_principal_axes(inertia);
    const kt_sym3 d = kt_sym3_rotate(kt_mat3_transpose(axes), inertia);
    const double own[3] = {d.xx, d.yy, d.zz}, *at = m->body_ipos + 3 * theirs, *q = m->body_iquat + 4 * theirs;
    const double at_own[3] = {com.x, com.y, com.z};
    double sorted[2][3], most = 0.0;
    for (int k = 0; k < 3; k++) {
        sorted[0][k] = own[k];
        sorted[1][k] = m->body_inertia[3 * theirs + k];
        most = fmax(most, own[k]);
        kt_worst_near(invariant, at_own[k], at[k], 1e-12 * fmax(1.0, kt_vec3_norm(com)), "com of %s", body->name);
    }
    const kt_sym3 as_theirs = kt_sym3_rotate(kt_mat3_from_quat(kt_quat_make(q[0], q[1], q[2], q[3])),
                                             kt_sym3_make(sorted[1][0], sorted[1][1], sorted[1][2], 0.0, 0.0, 0.0));
    const double entries[2][3] = {{inertia.xy, inertia.xz, inertia.yz}, {as_theirs.xy, as_theirs.xz, as_theirs.yz}};
    for (int k = 0; k < 3; k++)
        kt_worst_near(whole, entries[0][k], entries[1][k], 1.5e-6 * most, "%s", body->name);
    qsort(sorted[0], 3, sizeof *sorted[0], kt_compare_numbers);
    qsort(sorted[1], 3, sizeof *sorted[1], kt_compare_numbers);
    for (int k = 0; k < 3; k++)
        kt_worst_near(invariant, sorted[0][k], sorted[1][k], 1e-12 * most, "moments of %s", body->name);
    kt_worst_near(invariant, body->mass, m->body_mass[theirs], 1e-12 * body->mass, "mass of %s", body->name);
    const kt_quat exact = kt_quat_from_mat3(axes);
    const double quaternion[4] = {exact.w, exact.x, exact.y, exact.z};
    memcpy(m->body_iquat + 4 * theirs, quaternion, sizeof quaternion);
    memcpy(m->body_inertia + 3 * theirs, own, sizeof own);
    m->body_sameframe[theirs] = 0;
}

static void compare_inertias(pair *p) {
    KT_WORST invariant = kt_worst_make("mass, com, moments"), whole = kt_worst_make("products of inertia");
    for (int b = 1; b < kt_model_body_count(p->both.model); b++)
        if (p->bodies[b] > 0)
            compare_inertia(p, b, p->bodies[b], &invariant, &whole);
}

static void compare_tree_with(const char *path, const kt_robot_options *options, bool forces, bool exact_axes,
                              double bound) {
    pair p;
    kt_random random = kt_random_of_test();
    findings f = {kt_worst_make("mass matrix"), kt_worst_make("bias force"), kt_worst_make("place, m"),
                  kt_worst_make("orientation"), kt_worst_make("forces"),     kt_worst_make("accelerations")};
    if (load(&p, path, options) && kt_check_equal_int("degrees of freedom", kt_model_nv(p.both.model), p.nv)) {
        if (exact_axes)
            compare_inertias(&p);
        for (int n = 0; n < STATES; n++) {
            set_state(&p, &random);
            mj_forward(p.both.m, p.both.d);
            compare_mass(&p, &f, bound);
            compare_places(&p, &f);
            if (forces)
                compare_forces(&p, &f, 10.0 * bound);
        }
        kt_worst *all[] = {&f.mass, &f.bias, &f.place, &f.turn, &f.force, &f.acceleration};
        for (int i = 0; i < (forces ? 6 : 4); i++)
            kt_check_worst(all[i]);
    }
    release(&p);
}

static void compare_tree(const char *path, const kt_robot_options *options, bool forces, double bound) {
    compare_tree_with(path, options, forces, false, bound);
}

/* All elements together. Inertias are compared by quantities that do not depend on axes, all else with the axes of
 * these inertias, to rounding. */
KT_TEST(tree_of_every_element_is_that_of_mujoco_to_rounding_but_for_its_principal_axes) {
    compare_tree_with(KT_MODELS "/mjcf/tree.xml", NULL, true, true, 1e-13);
}

KT_TEST(tree_of_every_element_is_the_one_that_mujoco_reads) {
    compare_tree(KT_MODELS "/mjcf/tree.xml", NULL, true, 1e-9);
}

KT_TEST(masses_follow_the_settings_of_the_compiler) { compare_tree(KT_MODELS "/mjcf/masses.xml", NULL, true, 1e-13); }

/* ---- what is exported -------------------------------------------------------------------------------------------- */

/* Writes a description as MJCF into a file of its own, which both read. */
static void compare_exported(const kt_description *d, double bound) {
    char path[] = "/tmp/kinetree-export-XXXXXX";
    kt_error error = {0};
    const int descriptor = mkstemp(path);
    FILE *file = descriptor >= 0 ? fdopen(descriptor, "w") : NULL;
    kt_need(kt_check_true("there is a file", file != NULL));
    const kt_status status = kt_robot_write(d, KT_ROBOT_MJCF, file, NULL, NULL, &error);
    (void)fclose(file);
    if (kt_check_equal_int("written", status, KT_OK))
        compare_tree(path, NULL, false, bound);
    (void)remove(path);
}

/* The tree of every element with inertias along the axes of their bodies, which MuJoCo does not turn. MuJoCo rejects
 * joints on bodies without mass, so these bodies have mass here. */
KT_TEST(tree_of_every_element_without_principal_axes_is_that_of_mujoco_to_rounding) {
    kt_scene *scene = kt_test_scene_place();
    kt_error error = {0};
    kt_need(
        kt_check_equal_int("read", kt_robot_read(KT_MODELS "/mjcf/tree.xml", NULL, scene, NULL, NULL, &error), KT_OK));
    kt_description d = scene->description;
    kt_body *bodies = calloc((size_t)d.body_count, sizeof *bodies);
    if (kt_check_true("there is memory", bodies != NULL))
        for (int i = 0; i < d.body_count; i++) {
            kt_sym3 *s = &bodies[i].inertia;
            bodies[i] = d.bodies[i];
            bodies[i].mass = fmax(bodies[i].mass, 0.1);
            *s = kt_sym3_make(fmax(s->xx, 0.01), fmax(s->yy, 0.01), fmax(s->zz, 0.01), 0.0, 0.0, 0.0);
            const double most = fmax(s->xx, fmax(s->yy, s->zz));
            if (s->xx + s->yy + s->zz < 2.0 * most)
                *s = kt_sym3_make(most, most, most, 0.0, 0.0, 0.0);
        }
    d.bodies = bodies;
    d.loop_count = d.effect_count = 0;
    if (bodies != NULL)
        compare_exported(&d, 1e-13);
    free(bodies);
}

/* Random trees of all joints that MJCF has. */
KT_TEST(exported_trees_are_those_that_mujoco_computes) {
    enum { BODIES = 8, TREES = 20 };
    static const char *const names[BODIES] = {"a", "b", "c", "d", "e", "f", "g", "h"};
    static const kt_joint_type types[] = {KT_JOINT_FIXED,     KT_JOINT_REVOLUTE,    KT_JOINT_PRISMATIC,
                                          KT_JOINT_UNIVERSAL, KT_JOINT_CYLINDRICAL, KT_JOINT_PLANAR,
                                          KT_JOINT_SPHERICAL};
    kt_random random = kt_random_of_test();
    for (int n = 0; n < TREES; n++) {
        kt_body bodies[BODIES];
        for (int i = 0; i < BODIES; i++) {
            double v[12];
            for (int k = 0; k < 12; k++)
                v[k] = kt_random_uniform(&random, -1.0, 1.0);
            kt_body *b = &bodies[i];
            const char *parent = i > 0 ? names[(int)kt_random_uniform(&random, 0.0, (double)i)] : NULL;
            *b = kt_body_of(names[i], parent, i > 0 ? types[(int)kt_random_uniform(&random, 0.0, 7.0)] : KT_JOINT_FREE,
                            0.0);
            b->joint.axis = kt_vec3_make(v[0], v[1], v[2]);
            b->com = kt_vec3_make(v[3], v[4], v[5]);
            if (i > 0) {
                b->joint.at = kt_vec3_make(v[6], v[7], v[8]);
                b->joint.rotation = kt_rotation_rpy(v[9], v[10], v[11]);
            }
            b->mass = 1.5 + v[0];
            b->inertia = kt_sym3_make(0.8 + 0.2 * v[1], 0.8 + 0.2 * v[2], 0.8 + 0.2 * v[3], 0.0, 0.0, 0.0);
        }
        kt_description d = kt_description_of(bodies, BODIES, NULL, 0, NULL, 0);
        d.gravity = kt_vec3_make(1.0, -2.0, -9.0);
        compare_exported(&d, 1e-13);
    }
}

/* MuJoCo 2.2.2 keeps vertices as single-precision numbers: 6e-8 of their size, several of which make an inertia. */
KT_TEST(masses_of_meshes_are_those_that_mujoco_computes) {
    compare_tree(KT_MODELS "/mjcf/meshes.xml", NULL, false, 1e-6);
}

KT_TEST(masses_of_exact_meshes_are_those_that_mujoco_computes) {
    compare_tree(KT_MODELS "/mjcf/exact_meshes.xml", NULL, false, 1e-6);
}

/* ---- fixed tendons and equalities -------------------------------------------------------------------------------- */

static const char *name_of(const mjModel *m, int address) { return m->names + address; }

static const kt_loop *find_loop(const pair *p, const char *name) {
    for (int i = 0; i < p->both.scene->description.loop_count; i++)
        if (strcmp(p->both.scene->description.loops[i].name, name) == 0)
            return &p->both.scene->description.loops[i];
    return NULL;
}

/* The position of one of our joints in a state of MuJoCo: its own, or a tendon's length. */
static double position_of(const pair *p, const char *joint, bool rate) {
    const mjModel *m = p->both.m;
    for (int j = 0; j < m->njnt; j++)
        if (strcmp(kt_body_name(p->both.model, p->carrier[j]), joint) == 0)
            return rate ? p->both.d->qvel[m->jnt_dofadr[j]] : p->both.d->qpos[m->jnt_qposadr[j]];
    for (int t = 0; t < m->ntendon; t++)
        if (strcmp(name_of(m, m->name_tendonadr[t]), joint) == 0)
            return rate ? p->both.d->ten_velocity[t] : p->both.d->ten_length[t];
    kt_check_true(joint, false);
    return (double)NAN;
}

/* Forces of tendons reach the joints: the accelerations are MuJoCo's, whose model has no equality then. */
KT_TEST(fixed_tendons_pull_as_those_of_mujoco) {
    pair p;
    kt_random random = kt_random_of_test();
    kt_error error = {0};
    kt_worst worst = kt_worst_make("accelerations");
    if (load(&p, KT_MODELS "/mjcf/tendons.xml", NULL)) {
        kt_check_equal_int("lengths of tendons", kt_model_nv(p.both.model) - p.nv, 2);
        for (int n = 0; n < STATES; n++) {
            set_state(&p, &random);
            mj_forward(p.both.m, p.both.d);
            for (int b = 1; b < kt_model_body_count(p.both.model); b++) {
                const kt_coordinates c = kt_body_coordinates(p.both.model, b);
                if (c.nv == 1) {
                    p.q[c.q] = position_of(&p, kt_body_name(p.both.model, b), false);
                    p.v[c.v] = position_of(&p, kt_body_name(p.both.model, b), true);
                }
            }
            if (kt_acceleration_evaluate(p.both.model, p.both.data, 0.0, p.q, p.v, NULL, NULL, p.a, &error) != KT_OK)
                kt_worst_below(&worst, (double)NAN, 0.0, "%s", error.message);
            double most = 0.0;
            for (int i = 0; i < p.nv; i++)
                most = fmax(most, fabs(p.both.d->qacc[i]));
            for (int j = 0; j < p.both.m->njnt; j++)
                for (int k = 0; k < kt_body_coordinates(p.both.model, p.carrier[j]).nv; k++)
                    kt_worst_near(&worst, p.a[kt_body_coordinates(p.both.model, p.carrier[j]).v + k],
                                  p.both.d->qacc[p.both.m->jnt_dofadr[j] + k], 1e-12 * most, "joint %d", j);
        }
        kt_check_worst(&worst);
    }
    release(&p);
}

/* The pose of MuJoCo's body of this name; NULL: the world. */
static kt_pose pose_of_body(const pair *p, const char *name) {
    int body = 0;
    for (int i = 1; i < p->both.m->nbody; i++)
        body = name != NULL && strcmp(name_of(p->both.m, p->both.m->name_bodyadr[i]), name) == 0 ? i : body;
    kt_pose pose = kt_pose_identity();
    const mjtNum *x = p->both.d->xpos + 3 * body, *r = p->both.d->xmat + 9 * body;
    pose.position = kt_vec3_make(x[0], x[1], x[2]);
    pose.rotation.x = kt_vec3_make(r[0], r[3], r[6]);
    pose.rotation.y = kt_vec3_make(r[1], r[4], r[7]);
    pose.rotation.z = kt_vec3_make(r[2], r[5], r[8]);
    return pose;
}

/* The residual of a coupling and its derivatives, and MuJoCo's, of y - y0 - a0 - a1 (x - x0) - a2 (x - x0)^2 ... */
static void compare_coupling(const pair *p, const kt_loop *loop, int row, kt_worst *worst) {
    double at[COUPLING_TERMS], along[COUPLING_TERMS] = {0.0}, y[3] = {0.0, 0.0, 0.0}, memory[COUPLING_FORMULA];
    const kt_expression *formula = NULL;
    for (int k = 0; k < loop->term_count && k < COUPLING_TERMS; k++)
        at[k] = position_of(p, loop->terms[k].joint, false);
    if (!parse_coupling(loop, memory, &formula))
        return;
    kt_worst_near(worst, open_by(loop, formula, at), p->both.d->efc_pos[row], 1e-14, "%s", loop->name);
    for (int k = 0; k < loop->term_count; k++) {
        const int joint = mj_name2id(p->both.m, mjOBJ_JOINT, loop->terms[k].joint);
        along[k] = 1.0;
        kt_expression_taylor(formula, at, along, NULL, y);
        along[k] = 0.0;
        kt_worst_near(worst, loop->terms[k].coefficient + y[1],
                      p->both.d->efc_J[row * p->both.m->nv + p->both.m->jnt_dofadr[joint]], 1e-14,
                      "%s, derivative by %s", loop->name, loop->terms[k].joint);
    }
}

KT_TEST(loops_are_open_by_what_equalities_of_mujoco_are) {
    pair p;
    kt_random random = kt_random_of_test();
    kt_worst worst = kt_worst_make("residual");
    int compared = 0;
    if (load(&p, KT_MODELS "/mjcf/ties.xml", NULL)) {
        p.both.m->opt.disableflags &= ~mjDSBL_CONSTRAINT;
        for (int n = 0; n < STATES; n++) {
            set_state(&p, &random);
            mj_forward(p.both.m, p.both.d);
            for (int row = 0; row < p.both.d->ne;) {
                const int e = p.both.d->efc_id[row];
                const kt_loop *loop = find_loop(&p, name_of(p.both.m, p.both.m->name_eqadr[e]));
                const kt_end *ends = loop != NULL ? loop->between : NULL;
                if (loop != NULL && loop->type == KT_LOOP_COUPLING)
                    compare_coupling(&p, loop, row, &worst);
                else if (loop != NULL)
                    compare_ends(loop, pose_of_end(pose_of_body(&p, ends[0].body), &ends[0]),
                                 pose_of_end(pose_of_body(&p, ends[1].body), &ends[1]), 1.0, p.both.d->efc_pos + row,
                                 &worst);
                compared += loop != NULL;
                while (row < p.both.d->ne && p.both.d->efc_id[row] == e)
                    row++;
            }
        }
        kt_check_equal_int("equalities compared", compared, 9 * STATES);
        kt_check_worst(&worst);
    }
    release(&p);
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
