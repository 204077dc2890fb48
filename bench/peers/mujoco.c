/* A tree in MuJoCo.
 *
 * MuJoCo's own diagonalisation of an inertia given in full stops at an angle of some 1e-6. This changes the ninth digit
 * of the accelerations of a long chain. So the principal axes are found here, by Jacobi's rotations (Golub & Van Loan,
 * Matrix Computations, 4th ed., 8.5), and given as a quaternion and three moments.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco.h"
#include "principal.h"

#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *kt_mujoco_version(void) { return mj_versionString(); }

/* ---- the same mechanism ------------------------------------------------------------------------------------------ */

enum {
    PART = 50,
    NAME_SIZE = 32
}; /* bodies above one another in a file: MuJoCo's parser goes some 100 elements deep */

typedef struct writer {
    const kt_description *d;
    mjVFS *files; /* in memory */
    int parts;
    kt_error *error; /* its code: whether all could be written */
} writer;

static void fail(writer *w, kt_status status, const char *why) {
    if (w->error->code == KT_OK)
        (void)kt_error_set(w->error, status, "MuJoCo", "%s", why);
}

/* A universal joint is two hinges of one body, in the same order. */
static void write_joint(writer *w, FILE *xml, const kt_joint *joint) {
    static const char hinge[] = "<joint type='hinge' axis='%.17g %.17g %.17g'/>";
    const kt_vec3 a = joint->axis, b = joint->axis2;
    switch (joint->type) {
    case KT_JOINT_FREE:
        (void)fputs("<freejoint/>", xml);
        break;
    case KT_JOINT_SPHERICAL:
        (void)fputs("<joint type='ball'/>", xml);
        break;
    case KT_JOINT_UNIVERSAL:
        (void)fprintf(xml, hinge, a.x, a.y, a.z);
        (void)fprintf(xml, hinge, b.x, b.y, b.z);
        break;
    case KT_JOINT_REVOLUTE:
        (void)fprintf(xml, hinge, a.x, a.y, a.z);
        break;
    case KT_JOINT_FIXED:
        break;
    default:
        fail(w, KT_ERROR_UNSUPPORTED, "a joint of this type has no twin here");
    }
}

static bool is_child(const kt_body *body, const char *parent) {
    const bool on_world = !body->parent || strcmp(body->parent, "world") == 0;
    return parent ? !on_world && strcmp(body->parent, parent) == 0 : on_world;
}

static void write_children(writer *w, FILE *xml, const char *parent, int depth);

static void write_body(writer *w, FILE *xml, const kt_body *b, int depth) {
    kt_vec3 com, moments;
    kt_sym3 inertia;
    kt_mat3 rest;
    if (kt_body_inertia(b, &com, &inertia, w->error) != KT_OK ||
        kt_rotation_evaluate(&b->joint.rotation, &rest, w->error) != KT_OK)
        return;
    const kt_quat at = kt_quat_from_mat3(rest), r = kt_principal_axes(inertia, &moments);
    (void)fprintf(xml,
                  "<body pos='%.17g %.17g %.17g' quat='%.17g %.17g %.17g %.17g'>"
                  "<inertial pos='%.17g %.17g %.17g' mass='%.17g' quat='%.17g %.17g %.17g %.17g'"
                  " diaginertia='%.17g %.17g %.17g'/>",
                  b->joint.at.x, b->joint.at.y, b->joint.at.z, at.w, at.x, at.y, at.z, com.x, com.y, com.z, b->mass,
                  r.w, r.x, r.y, r.z, moments.x, moments.y, moments.z);
    write_joint(w, xml, &b->joint);
    write_children(w, xml, b->name, depth + 1);
    (void)fputs("</body>", xml);
}

/* Writes a file of its own, which is taken in; part 0 is the whole. */
static void write_part(writer *w, const char *parent, int depth) {
    char name[NAME_SIZE], *text = NULL;
    size_t size = 0;
    FILE *xml = open_memstream(&text, &size);
    (void)snprintf(name, sizeof name, "part-%d.xml", w->parts++);
    if (!xml) {
        fail(w, KT_ERROR_MEMORY, "no memory for its file");
        return;
    }
    if (depth == 0)
        (void)fprintf(xml,
                      "<mujoco><compiler angle='radian' inertiafromgeom='false'/>"
                      "<option gravity='%.17g %.17g %.17g'>"
                      "<flag contact='disable' constraint='disable' actuation='disable' passive='disable'/></option>"
                      "<worldbody>",
                      w->d->gravity.x, w->d->gravity.y, w->d->gravity.z);
    else
        (void)fputs("<mujocoinclude>", xml);
    for (int i = 0; i < w->d->body_count; i++)
        if (is_child(&w->d->bodies[i], parent))
            write_body(w, xml, &w->d->bodies[i], depth);
    (void)fputs(depth == 0 ? "</worldbody></mujoco>" : "</mujocoinclude>", xml);
    if (fclose(xml) == 0 && mj_makeEmptyFileVFS(w->files, name, (int)size) == 0)
        memcpy(w->files->filedata[mj_findFileVFS(w->files, name)], text, size);
    else
        fail(w, KT_ERROR_MEMORY, "the tree does not fit into its file system in memory");
    free(text);
}

/* The bodies on a body, or on the world if parent is NULL. */
static void write_children(writer *w, FILE *xml, const char *parent, int depth) {
    bool any = false;
    for (int i = 0; i < w->d->body_count; i++) {
        const kt_body *b = &w->d->bodies[i];
        if (!is_child(b, parent))
            continue;
        if (depth % PART != 0)
            write_body(w, xml, b, depth);
        any = true;
    }
    if (any && depth % PART == 0) {
        (void)fprintf(xml, "<include file='part-%d.xml'/>", w->parts);
        write_part(w, parent, depth);
    }
}

static mjModel *load(const kt_description *d, kt_error *error) {
    char reason[300] = "";
    kt_error first = {.code = KT_OK};
    mjModel *model = NULL;
    writer w = {.d = d, .files = malloc(sizeof *w.files), .error = &first};
    if (w.files) {
        mj_defaultVFS(w.files);
        write_part(&w, NULL, 0);
        if (first.code == KT_OK)
            model = mj_loadXML("part-0.xml", w.files, reason, sizeof reason);
        mj_deleteVFS(w.files);
    } else {
        fail(&w, KT_ERROR_MEMORY, "no memory for its file system");
    }
    free(w.files);
    if (!model)
        fail(&w, KT_ERROR_MODEL, reason);
    if (first.code != KT_OK && error)
        *error = first;
    return model;
}

kt_status kt_mujoco_make(const kt_description *description, const kt_chain *chain, kt_mujoco *twin, kt_error *error) {
    const size_t n = (size_t)chain->n;
    *twin = (kt_mujoco){
        .n = chain->n, .nq = chain->nq, .q = chain->q, .v = chain->v, .tau = chain->tau, .acceleration = chain->a};
    twin->model = load(description, error);
    if (!twin->model)
        return KT_ERROR_MODEL;
    twin->data = mj_makeData(twin->model);
    twin->a = calloc(n, sizeof *twin->a);
    twin->torque = calloc(n, sizeof *twin->torque);
    twin->force = calloc(n, sizeof *twin->force);
    twin->mass = calloc(n * n, sizeof *twin->mass);
    const mjModel *model = twin->model;
    kt_status status = KT_OK;
    if (!twin->data || !twin->a || !twin->torque || !twin->force || !twin->mass)
        status = kt_error_set(error, KT_ERROR_MEMORY, "MuJoCo", "no memory for the data of %d links", chain->n);
    else if (model->nq != chain->nq || model->nv != chain->n)
        status = kt_error_set(error, KT_ERROR_MODEL, "MuJoCo", "it has %d freedoms, not %d", model->nv, chain->n);
    if (status != KT_OK)
        kt_mujoco_free(twin);
    return status;
}

void kt_mujoco_free(kt_mujoco *twin) {
    free(twin->a);
    free(twin->torque);
    free(twin->force);
    free(twin->mass);
    mj_deleteData(twin->data);
    mj_deleteModel(twin->model);
    *twin = (kt_mujoco){.n = 0};
}

/* ---- the same work ----------------------------------------------------------------------------------------------- */

/* As the caller of the library would: the state goes in. */
static void set_state(const kt_mujoco *t, mjData *d) {
    memcpy(d->qpos, t->q, (size_t)t->nq * sizeof *t->q);
    memcpy(d->qvel, t->v, (size_t)t->n * sizeof *t->v);
}

void kt_mujoco_forward(void *twin, long repetitions) {
    const kt_mujoco *t = twin;
    const mjModel *m = t->model;
    mjData *d = t->data;
    set_state(t, d);
    for (long k = 0; k < repetitions; k++) {
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_crb(m, d);
        mj_factorM(m, d);
        mj_comVel(m, d);
        mj_rne(m, d, 0, t->force);
        for (int i = 0; i < t->n; i++)
            t->force[i] = t->tau[i] - t->force[i];
        mj_solveM(m, d, t->a, t->force, 1);
    }
}

void kt_mujoco_inverse(void *twin, long repetitions) {
    const kt_mujoco *t = twin;
    const mjModel *m = t->model;
    mjData *d = t->data;
    set_state(t, d);
    memcpy(d->qacc, t->acceleration, (size_t)t->n * sizeof *t->acceleration);
    for (long k = 0; k < repetitions; k++) {
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_comVel(m, d);
        mj_rne(m, d, 1, t->torque);
    }
}

void kt_mujoco_mass(void *twin, long repetitions) {
    const kt_mujoco *t = twin;
    const mjModel *m = t->model;
    mjData *d = t->data;
    set_state(t, d);
    for (long k = 0; k < repetitions; k++) {
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_crb(m, d);
        mj_fullM(m, t->mass, d->qM);
    }
}

void kt_mujoco_factor(void *twin, long repetitions) {
    const kt_mujoco *t = twin;
    for (long k = 0; k < repetitions; k++)
        mj_factorM(t->model, t->data);
}

void kt_mujoco_solve(void *twin, long repetitions) {
    const kt_mujoco *t = twin;
    for (long k = 0; k < repetitions; k++)
        mj_solveM(t->model, t->data, t->a, t->tau, 1);
}

/* From the state as it is, without its time going far. */
void kt_mujoco_step(void *twin, long repetitions) {
    const kt_mujoco *t = twin;
    mjModel *m = t->model;
    mjData *d = t->data;
    m->opt.integrator = mjINT_RK4;
    m->opt.timestep = 1e-12;
    set_state(t, d);
    memcpy(d->qfrc_applied, t->tau, (size_t)t->n * sizeof *t->tau);
    for (long k = 0; k < repetitions; k++)
        mj_step(m, d);
}
