/* Against MuJoCo, an engine that shares nothing with this one: random trees with the joints that both have. A
 * universal, cylindrical or planar joint is two or three MuJoCo joints of one body, in the same order. A free body
 * hangs on the world, its joint frame that of the world; its velocities are then the same numbers in both. Some joints
 * have armature. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "tree.h"

#include "kinetree/control.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TREES = 60 };

/* ---- the same mechanism for MuJoCo --------------------------------------------------------------------------- */

typedef struct twin {
    kt_tree tree;
    kt_quat principal[KT_TREE_BODIES]; /* principal axes of each inertia, */
    kt_vec3 moments[KT_TREE_BODIES];   /* and its moments: MuJoCo has no rounding to add to them */
    mjModel *m;
    mjData *d;
} twin;

static void write_triple(FILE *file, const char *name, kt_vec3 v) {
    fprintf(file, " %s='%.17g %.17g %.17g'", name, v.x, v.y, v.z);
}

static void write_quaternion(FILE *file, kt_quat q) {
    fprintf(file, " quat='%.17g %.17g %.17g %.17g'", q.w, q.x, q.y, q.z);
}

static void write_joint(FILE *file, const char *type, double armature, kt_vec3 axis) {
    fprintf(file, "<joint type='%s' armature='%.17g'", type, armature);
    write_triple(file, "axis", axis);
    fprintf(file, "/>");
}

static void write_joints(FILE *file, const kt_joint *joint) {
    const kt_vec3 n = joint->axis;
    const double *armature = joint->armature;
    const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(n), 2);
    switch (joint->type) {
    case KT_JOINT_REVOLUTE:
        write_joint(file, "hinge", armature[0], n);
        break;
    case KT_JOINT_PRISMATIC:
        write_joint(file, "slide", armature[0], n);
        break;
    case KT_JOINT_CYLINDRICAL:
        write_joint(file, "hinge", armature[0], n);
        write_joint(file, "slide", armature[1], n);
        break;
    case KT_JOINT_UNIVERSAL:
        write_joint(file, "hinge", armature[0], n);
        write_joint(file, "hinge", armature[1], joint->axis2);
        break;
    case KT_JOINT_PLANAR:
        write_joint(file, "slide", armature[0], triad.x);
        write_joint(file, "slide", armature[1], triad.y);
        write_joint(file, "hinge", armature[2], n);
        break;
    case KT_JOINT_SPHERICAL:
        fprintf(file, "<joint type='ball' armature='%.17g'/>", armature[0]);
        break;
    case KT_JOINT_FREE:
        fprintf(file, "<joint type='free' armature='%.17g'/>", armature[0]);
        break;
    default:
        break;
    }
}

static void write_body(FILE *file, const twin *t, int i) {
    const kt_tree *tree = &t->tree;
    const kt_body *body = &tree->body[i];
    kt_mat3 rest = kt_mat3_identity();
    kt_error e;
    if (kt_rotation_evaluate(&body->joint.rotation, &rest, &e) != KT_OK)
        abort();
    fprintf(file, "<body name='%s'", body->name);
    write_triple(file, "pos", body->joint.at);
    write_quaternion(file, kt_quat_from_mat3(rest));
    fprintf(file, "><inertial mass='%.17g'", body->mass);
    write_triple(file, "pos", body->com);
    write_quaternion(file, t->principal[i]);
    write_triple(file, "diaginertia", t->moments[i]);
    fprintf(file, "/>");
    write_joints(file, &body->joint);
    for (int k = 0; k < tree->description.body_count; k++)
        if (tree->body[k].parent && strcmp(tree->body[k].parent, body->name) == 0)
            write_body(file, t, k);
    fprintf(file, "</body>\n");
}

static void write_model(FILE *file, const twin *t) {
    const kt_tree *tree = &t->tree;
    fprintf(file, "<mujoco><compiler angle='radian' inertiafromgeom='false' boundmass='0' boundinertia='0'/><option");
    write_triple(file, "gravity", tree->description.gravity);
    fprintf(file,
            "><flag constraint='disable' contact='disable' passive='disable' actuation='disable' energy='enable'/>"
            "</option><worldbody>\n");
    for (int i = 0; i < tree->description.body_count; i++)
        if (!tree->body[i].parent || strcmp(tree->body[i].parent, "world") == 0)
            write_body(file, t, i);
    fprintf(file, "</worldbody></mujoco>\n");
}

static bool load_twin(twin *t) {
    char path[] = "mujoco-twin-XXXXXX", error[1000] = "";
    const int handle = mkstemp(path);
    FILE *file = handle < 0 ? NULL : fdopen(handle, "w");
    if (!file)
        return kt_check_true("a file for MuJoCo", false);
    write_model(file, t);
    fclose(file);
    t->m = mj_loadXML(path, NULL, error, sizeof error);
    remove(path);
    if (!t->m) {
        kt_note("%s", error);
        return kt_check_true("MuJoCo reads it", false);
    }
    t->d = mj_makeData(t->m);
    return true;
}

static bool grow_twin(twin *t, bool floats, kt_random *random) {
    kt_tree_plan plan = kt_tree_plan_default();
    memset(t, 0, sizeof *t);
    plan.massless = false;
    plan.floats = floats;
    plan.bodies = kt_random_int(random, 1, 14);
    plan.types = KT_TREE_ALL_TYPES & ~(1U << KT_JOINT_SCREW | 1U << KT_JOINT_FREE);
    plan.with_armature = 0.4;
    kt_tree_describe(&t->tree, &plan, random);
    for (int i = 0; i < plan.bodies; i++) {
        kt_joint *joint = &t->tree.body[i].joint; /* MuJoCo's balls and free joints have one armature */
        for (int k = 1; k < KT_JOINT_NV_MAX && (joint->type == KT_JOINT_SPHERICAL || joint->type == KT_JOINT_FREE); k++)
            joint->armature[k] = joint->armature[0];
        kt_body *body = &t->tree.body[i];
        double q[4];
        kt_random_direction(random, 4, q);
        const double x = kt_random_uniform(random, 0.1, 1.0), y = kt_random_uniform(random, 0.1, 1.0);
        t->principal[i] = kt_quat_make(q[0], q[1], q[2], q[3]);
        t->moments[i] = kt_vec3_make(x, y, kt_random_uniform(random, fabs(x - y) + 0.05, x + y));
        body->inertia = kt_sym3_rotate(kt_mat3_from_quat(t->principal[i]),
                                       kt_sym3_make(t->moments[i].x, t->moments[i].y, t->moments[i].z, 0.0, 0.0, 0.0));
        if (body->joint.type == KT_JOINT_UNIVERSAL && kt_vec3_norm(body->joint.axis2) == 0.0)
            body->joint.axis2 = kt_triad_from_axis(kt_vec3_normalize(body->joint.axis), 2).x;
    }
    if (floats) {
        t->tree.body[0].joint.at = kt_vec3_make(0.0, 0.0, 0.0);
        t->tree.body[0].joint.rotation = (kt_rotation){.type = KT_ROTATION_NONE};
    }
    kt_tree_compile(&t->tree, NULL);
    if (!load_twin(t))
        return false;
    return (t->m->nv == t->tree.nv && t->m->nq == t->tree.nq) || kt_check_true("as many freedoms", false);
}

static void free_twin(twin *t) {
    mj_deleteData(t->d);
    mj_deleteModel(t->m);
}

static int body_of(const twin *t, int b) { return mj_name2id(t->m, mjOBJ_BODY, kt_body_name(t->tree.model, b)); }

/* First coordinate in MuJoCo of a body's joints. */
static int position_of(const twin *t, int b) { return t->m->jnt_qposadr[t->m->body_jntadr[body_of(t, b)]]; }
static int velocity_of(const twin *t, int b) { return t->m->body_dofadr[body_of(t, b)]; }

/* From our order of velocities to MuJoCo's, and back. */
static void to_twin(const twin *t, const double *ours, double *theirs) {
    for (int b = 1; b < t->tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(t->tree.model, b);
        for (int k = 0; k < c.nv; k++)
            theirs[velocity_of(t, b) + k] = ours[c.v + k];
    }
}

static void from_twin(const twin *t, const double *theirs, double *ours) {
    for (int b = 1; b < t->tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(t->tree.model, b);
        for (int k = 0; k < c.nv; k++)
            ours[c.v + k] = theirs[velocity_of(t, b) + k];
    }
}

/* The same state; MuJoCo's wrenches act at the centre of mass, force first. */
static void set_state(twin *t, const kt_tree_state *s) {
    for (int b = 1; b < t->tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(t->tree.model, b);
        for (int k = 0; k < c.nq; k++)
            t->d->qpos[position_of(t, b) + k] = s->q[c.q + k];
    }
    to_twin(t, s->v, t->d->qvel);
    to_twin(t, s->tau, t->d->qfrc_applied);
    kt_tree_kinematics(&t->tree, s);
    for (int b = 1; b < t->tree.count; b++) {
        const kt_vec3 com = t->tree.body[kt_body_source(t->tree.model, b)].com;
        const kt_vec3 arm = kt_mat3_apply(kt_body_pose(t->tree.model, t->tree.data, b).rotation, com);
        const kt_vec3 force = s->external[b].force;
        const kt_vec3 moment = kt_vec3_sub(s->external[b].moment, kt_vec3_cross(arm, force));
        memcpy(t->d->xfrc_applied + 6 * body_of(t, b), (kt_vec3[]){force, moment}, 6 * sizeof(double));
    }
    mj_forward(t->m, t->d);
}

/* ---- comparisons: parts of the largest number of its kind -------------------------------------------------------- */

typedef void comparison(twin *t, const kt_tree_state *s, kt_worst *error, int n);

static void compare_all(const char *what, comparison *compare) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make(what);
    for (int n = 0; n < TREES; n++) {
        static twin t;
        kt_tree_state s;
        if (!grow_twin(&t, n % 2 == 0, &random))
            return;
        kt_tree_state_draw(&t.tree, &random, &s);
        set_state(&t, &s);
        compare(&t, &s, &error, n);
        free_twin(&t);
    }
}

static void vectors(const twin *t, const double *ours, const double *theirs, double part, kt_worst *error, int n) {
    double x[KT_TREE_NV];
    from_twin(t, theirs, x);
    const double scale = kt_tree_largest(x, t->tree.nv);
    for (int i = 0; i < t->tree.nv; i++)
        kt_worst_near(error, ours[i], x[i], part * scale, "tree %d coordinate %d", n, i);
}

/* Composite bodies, factored, and solved; against articulated bodies. */
static void accelerations(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    double a[KT_TREE_NV];
    kt_tree_forward(&t->tree, s, a);
    vectors(t, a, t->d->qacc, 3e-13, error, n);
}

KT_TEST(forward_dynamics_agree_with_mujoco) { compare_all("a", accelerations); }

static void forces(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    double tau[KT_TREE_NV], theirs[KT_TREE_NV];
    kt_error e = {0};
    to_twin(t, s->a, t->d->qacc);
    mj_rne(t->m, t->d, 1, theirs);
    for (int i = 0; i < t->tree.nv; i++) /* which mj_rne leaves out */
        theirs[i] += t->m->dof_armature[i] * t->d->qacc[i];
    const kt_status status = kt_dynamics_inverse(t->tree.model, t->tree.data, s->q, s->v, s->a, NULL, tau, &e);
    kt_need_fine("inverse dynamics", status, &e);
    vectors(t, tau, theirs, 1e-14, error, n);
}

KT_TEST(inverse_dynamics_agree_with_mujoco) { compare_all("tau", forces); }

static void masses(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    static double mass[KT_TREE_NV * KT_TREE_NV], theirs[KT_TREE_NV * KT_TREE_NV];
    double index[KT_TREE_NV], order[KT_TREE_NV] = {0};
    const int nv = t->tree.nv;
    mj_fullM(t->m, theirs, t->d->qM);
    for (int i = 0; i < nv; i++)
        order[i] = i;
    from_twin(t, order, index);
    kt_tree_mass(&t->tree, s, mass);
    for (int i = 0; i < nv; i++)
        for (int j = 0; j < nv; j++)
            kt_worst_near(error, mass[i * nv + j], theirs[(int)index[i] * nv + (int)index[j]],
                          3e-14 * sqrt(mass[i * nv + i] * mass[j * nv + j]), "tree %d entry %d %d", n, i, j);
}

KT_TEST(mass_matrices_agree_with_mujoco) { compare_all("M", masses); }

static void poses(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    kt_tree_kinematics(&t->tree, s);
    for (int b = 1; b < t->tree.count; b++) {
        const kt_pose pose = kt_body_pose(t->tree.model, t->tree.data, b);
        const kt_mat3 rows = kt_mat3_transpose(pose.rotation);
        const double *theirs = t->d->xpos + 3 * body_of(t, b), *matrix = t->d->xmat + 9 * body_of(t, b);
        for (int i = 0; i < 3; i++)
            kt_worst_near(error, (&pose.position.x)[i], theirs[i], 2e-14, "tree %d body %d", n, b);
        for (int i = 0; i < 9; i++)
            kt_worst_near(error, (&rows.x.x)[i], matrix[i], 2e-14, "tree %d body %d", n, b);
    }
}

KT_TEST(poses_agree_with_mujoco) { compare_all("places and axes", poses); }

/* MuJoCo counts bodies that are fixed to the world into its potential energy. */
static void energies(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    kt_tree_kinematics(&t->tree, s);
    const kt_vec3 g = t->tree.description.gravity;
    double fixed = 0.0, mass = 0.0;
    for (int b = 1; b < t->tree.count; b++) {
        const kt_body *body = &t->tree.body[kt_body_source(t->tree.model, b)];
        bool moves = false;
        for (int k = b; k > 0; k = kt_body_parent(t->tree.model, k))
            moves |= kt_body_coordinates(t->tree.model, k).nv > 0;
        mass += body->mass;
        if (!moves)
            fixed -= body->mass * kt_vec3_dot(g, kt_point_position(t->tree.model, t->tree.data, b, body->com));
    }
    const double kinetic = kt_kinetic_energy(t->tree.model, t->tree.data);
    kt_worst_near(error, kinetic, t->d->energy[1], 2e-14 * kinetic, "tree %d kinetic", n);
    kt_worst_near(error, kt_potential_energy(t->tree.model, t->tree.data) + fixed, t->d->energy[0], 2e-14 * mass * 9.81,
                  "tree %d potential", n);
}

KT_TEST(energies_agree_with_mujoco) { compare_all("T and V", energies); }

/* ---- control.h --------------------------------------------------------------------------------------------------- */

/* Rows of a Jacobian, theirs row by row in their order. */
static void rows(const twin *t, const double *ours, int stride, const double *theirs, double bound, kt_worst *error,
                 int n) {
    double x[KT_TREE_NV];
    for (int r = 0; r < 3; r++) {
        from_twin(t, theirs + r * t->tree.nv, x);
        for (int i = 0; i < t->tree.nv; i++)
            kt_worst_near(error, ours[stride * i + r], x[i], bound, "tree %d row %d column %d", n, r, i);
    }
}

static void jacobians(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    static double ours[6 * KT_TREE_NV], angular[3 * KT_TREE_NV], linear[3 * KT_TREE_NV];
    const kt_vec3 at = kt_vec3_make(0.3, -0.1, 0.2);
    kt_tree_kinematics(&t->tree, s);
    for (int b = 1; b < t->tree.count; b++) {
        const kt_vec3 p = kt_point_position(t->tree.model, t->tree.data, b, at);
        mj_jac(t->m, t->d, linear, angular, (const double[]){p.x, p.y, p.z}, body_of(t, b));
        kt_frame_jacobian(t->tree.model, t->tree.data, b, at, KT_TWIST_ALIGNED, ours);
        rows(t, ours, 6, angular, 2e-14, error, n);
        rows(t, ours + 3, 6, linear, 2e-14, error, n);
    }
}

KT_TEST(jacobians_of_points_agree_with_mujoco) { compare_all("J", jacobians); }

/* MuJoCo 2.2.2 has no derivative of a Jacobian, but accelerations: those at rest of all joint rates, without the
 * gravity that it adds. */
static void biases(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    const kt_vec3 g = t->tree.description.gravity;
    kt_tree_kinematics(&t->tree, s);
    memset(t->d->qacc, 0, (size_t)t->m->nv * sizeof(double));
    mj_rnePostConstraint(t->m, t->d);
    for (int b = 1; b < t->tree.count; b++) {
        double theirs[6];
        const kt_twist ours =
            kt_frame_bias(t->tree.model, t->tree.data, b, kt_vec3_make(0.0, 0.0, 0.0), KT_TWIST_ALIGNED);
        mj_objectAcceleration(t->m, t->d, mjOBJ_XBODY, body_of(t, b), theirs, 0);
        for (int r = 0; r < 6; r++)
            kt_worst_near(error, ((const double *)&ours)[r], theirs[r] + (r < 3 ? 0.0 : (&g.x)[r - 3]), 2e-13,
                          "tree %d body %d row %d", n, b, r);
    }
}

KT_TEST(bias_accelerations_agree_with_mujoco) { compare_all("J' v", biases); }

static void solutions(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    double x[KT_TREE_NV] = {0.0}, y[KT_TREE_NV], given[KT_TREE_NV];
    kt_mass_inverse *inverse = NULL;
    kt_error e = {0};
    memcpy(y, s->tau, sizeof y);
    to_twin(t, s->tau, given);
    mj_solveM(t->m, t->d, x, given, 1);
    kt_need_fine("inverse", kt_mass_inverse_create(t->tree.model, 0, &inverse, &e), &e);
    kt_need_fine("terms", kt_mass_inverse_compute(inverse, t->tree.data, 0.0, s->q, &e), &e);
    kt_need_fine("applies", kt_mass_inverse_apply(inverse, 1, y, &e), &e);
    vectors(t, y, x, 3e-13, error, n);
    kt_mass_inverse_free(inverse);
}

KT_TEST(products_with_the_inverse_mass_matrix_agree_with_mujoco) { compare_all("M^-1 x", solutions); }

/* MuJoCo counts bodies that are fixed to the world, which have no momentum, into mass and centre. */
static void momenta(twin *t, const kt_tree_state *s, kt_worst *error, int n) {
    static double matrix[6 * KT_TREE_NV], jacobian[3 * KT_TREE_NV], theirs[3 * KT_TREE_NV];
    kt_vec3 center;
    kt_tree_kinematics(&t->tree, s);
    const double mass = kt_mass_center(t->tree.model, t->tree.data, &center), all = t->m->body_subtreemass[0];
    kt_centroidal_matrix(t->tree.model, t->tree.data, matrix);
    kt_mass_center_jacobian(t->tree.model, t->tree.data, jacobian);
    mj_jacSubtreeCom(t->m, t->d, theirs, 0);
    for (int i = 0; i < 3 * t->tree.nv; i++) {
        theirs[i] *= all;
        jacobian[i] *= mass;
    }
    rows(t, jacobian, 3, theirs, 1e-14 * all, error, n);
    rows(t, matrix + 3, 6, theirs, 1e-14 * all, error, n);
    mj_subtreeVel(t->m, t->d);
    double ours[6] = {0.0};
    for (int r = 0; r < 6; r++)
        for (int i = 0; i < t->tree.nv; i++)
            ours[r] += matrix[6 * i + r] * s->v[i];
    const double *c = t->d->subtree_com;
    const kt_vec3 arm = kt_vec3_sub(center, kt_vec3_make(c[0], c[1], c[2]));
    const kt_vec3 shift = kt_vec3_cross(arm, kt_vec3_make(ours[3], ours[4], ours[5]));
    for (int r = 0; r < 3; r++)
        kt_worst_near(error, ours[r] + (&shift.x)[r], t->d->subtree_angmom[r], 1e-13 * all, "tree %d angular %d", n, r);
}

KT_TEST(momentum_as_a_function_of_rates_agrees_with_mujoco) { compare_all("momentum", momenta); }
