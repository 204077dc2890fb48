/* The chain in MuJoCo.
 *
 * Its own diagonalisation of an inertia given in full stops at an angle of some 1e-6, which the accelerations of a long
 * chain show in the ninth digit. So the principal axes are found here, by Jacobi's rotations (Golub & Van Loan, Matrix
 * Computations, 4th ed., 8.5), and given as a quaternion and three moments.
 */
#include "mujoco.h"
#include "principal.h"

#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *kt_mujoco_version(void) { return mj_versionString(); }

/* ---- the same mechanism ------------------------------------------------------------------------------------------ */

static void write_link(FILE *xml, int i) {
    const kt_body *b = &kt_chain_link;
    const kt_vec3 axis = kt_chain_axis(i);
    kt_vec3 moments;
    const kt_quat r = kt_principal_axes(b->inertia, &moments);
    (void)fprintf(xml,
                  "<body pos='%.17g %.17g %.17g'>"
                  "<inertial pos='%.17g %.17g %.17g' mass='%.17g' quat='%.17g %.17g %.17g %.17g'"
                  " diaginertia='%.17g %.17g %.17g'/>"
                  "<joint type='hinge' axis='%g %g %g'/>",
                  b->joint.at.x, b->joint.at.y, b->joint.at.z, b->com.x, b->com.y, b->com.z, b->mass, r.w, r.x, r.y,
                  r.z, moments.x, moments.y, moments.z, axis.x, axis.y, axis.z);
}

enum { PART = 50, NAME_SIZE = 32 }; /* links in a file: MuJoCo's parser goes some 100 elements deep */

/* One part of the chain in MuJoCo's language, which takes in the next. Released with free; NULL without memory. */
static char *write_part(int part, int n, size_t *size) {
    const int first = part * PART, end = first + PART < n ? first + PART : n;
    char *text = NULL;
    FILE *xml = open_memstream(&text, size);
    if (!xml)
        return NULL;
    if (part == 0)
        (void)fprintf(xml,
                      "<mujoco><compiler angle='radian' inertiafromgeom='false'/>"
                      "<option gravity='%.17g %.17g %.17g'>"
                      "<flag contact='disable' constraint='disable' actuation='disable' passive='disable'/></option>"
                      "<worldbody>",
                      kt_chain_gravity.x, kt_chain_gravity.y, kt_chain_gravity.z);
    else
        (void)fputs("<mujocoinclude>", xml);
    for (int i = first; i < end; i++)
        write_link(xml, i);
    if (end < n)
        (void)fprintf(xml, "<include file='chain-%d.xml'/>", part + 1);
    for (int i = first; i < end; i++)
        (void)fputs("</body>", xml);
    (void)fputs(part == 0 ? "</worldbody></mujoco>" : "</mujocoinclude>", xml);
    if (fclose(xml) == 0)
        return text;
    free(text);
    return NULL;
}

static bool add_part(mjVFS *files, int part, int n) {
    char name[NAME_SIZE];
    size_t size = 0;
    (void)snprintf(name, sizeof name, "chain-%d.xml", part);
    char *text = write_part(part, n, &size);
    const bool added = text && mj_makeEmptyFileVFS(files, name, (int)size) == 0;
    if (added)
        memcpy(files->filedata[mj_findFileVFS(files, name)], text, size);
    free(text);
    return added;
}

/* By files in memory. */
static mjModel *load(int n, kt_error *error) {
    char reason[300] = "the chain does not fit into its file system in memory";
    mjVFS *files = malloc(sizeof *files);
    mjModel *model = NULL;
    if (files) {
        mj_defaultVFS(files);
        bool added = true;
        for (int part = 0; added && part * PART < n; part++)
            added = add_part(files, part, n);
        if (added)
            model = mj_loadXML("chain-0.xml", files, reason, sizeof reason);
        mj_deleteVFS(files);
    }
    free(files);
    if (!model)
        (void)kt_error_set(error, KT_ERROR_MODEL, "MuJoCo", "%s", reason);
    return model;
}

kt_status kt_mujoco_make(const kt_chain *chain, kt_mujoco *twin, kt_error *error) {
    const size_t n = (size_t)chain->n;
    *twin = (kt_mujoco){.n = chain->n, .q = chain->q, .v = chain->v, .tau = chain->tau, .acceleration = chain->a};
    twin->model = load(chain->n, error);
    if (!twin->model)
        return KT_ERROR_MODEL;
    twin->data = mj_makeData(twin->model);
    twin->a = calloc(n, sizeof *twin->a);
    twin->torque = calloc(n, sizeof *twin->torque);
    twin->force = calloc(n, sizeof *twin->force);
    const mjModel *model = twin->model;
    kt_status status = KT_OK;
    if (!twin->data || !twin->a || !twin->torque || !twin->force)
        status = kt_error_set(error, KT_ERROR_MEMORY, "MuJoCo", "no memory for the data of %d links", chain->n);
    else if (model->nq != chain->n || model->nv != chain->n)
        status = kt_error_set(error, KT_ERROR_MODEL, "MuJoCo", "it has %d freedoms, not %d", model->nv, chain->n);
    if (status != KT_OK)
        kt_mujoco_free(twin);
    return status;
}

void kt_mujoco_free(kt_mujoco *twin) {
    free(twin->a);
    free(twin->torque);
    free(twin->force);
    mj_deleteData(twin->data);
    mj_deleteModel(twin->model);
    *twin = (kt_mujoco){.n = 0};
}

/* ---- the same work ----------------------------------------------------------------------------------------------- */

/* As the caller of the library would: the state goes in. */
static void set_state(const kt_mujoco *t, mjData *d) {
    memcpy(d->qpos, t->q, (size_t)t->n * sizeof *t->q);
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
