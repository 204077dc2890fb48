/* A hard case in MuJoCo. Its tree is written as nested bodies, placed at their start, so that all joints start at zero.
 * Its loops are `connect` constraints, one for a point. A hinge that is not in the plane has a second one, 1 m along
 * the axis. The integrator is the fourth-order Runge-Kutta method with the case's step. Constraints, which are soft by
 * design, have the advised stiffness, with a time constant of two steps. */
#include "mujoco.h"

#include "../peers/principal.h"
#include "peers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *kt_hard_mujoco_version(void) {
    static char text[40];
    (void)snprintf(text, sizeof text, "MuJoCo %s", mj_versionString());
    return text;
}

/* ---- the same mechanism ------------------------------------------------------------------------------------------ */

static void write_pose(FILE *xml, kt_pose p) {
    const kt_quat r = kt_quat_from_matrix(p.rotation);
    (void)fprintf(xml, " pos='%.17g %.17g %.17g' quat='%.17g %.17g %.17g %.17g'", p.position.x, p.position.y,
                  p.position.z, r.w, r.x, r.y, r.z);
}

static void write_joint(FILE *xml, int i, const kt_joint *joint) {
    static const char *const types[KT_JOINT_TYPE_COUNT] = {[KT_JOINT_REVOLUTE] = "hinge",
                                                           [KT_JOINT_PRISMATIC] = "slide",
                                                           [KT_JOINT_SPHERICAL] = "ball",
                                                           [KT_JOINT_FREE] = "free"};
    if (types[joint->type])
        (void)fprintf(xml, "<joint name='j%d' type='%s' axis='%.17g %.17g %.17g'/>", i, types[joint->type],
                      joint->axis.x, joint->axis.y, joint->axis.z);
}

/* A body and all that it carries. */
static void write_body(FILE *xml, const kt_hard *h, int i) {
    const kt_body *b = &h->description.bodies[i];
    kt_pose at = h->pose[i];
    kt_vec3 com, moments;
    kt_sym3 inertia;
    if (h->parent[i] >= 0)
        at = kt_pose_compose(kt_pose_invert(h->pose[h->parent[i]]), at);
    kt_hard_peer_mass(h, i, &com, &inertia);
    const kt_quat axes = kt_principal_axes(inertia, &moments);
    (void)fprintf(xml, "<body name='b%d'", i);
    write_pose(xml, at);
    (void)fputs("><inertial", xml);
    write_pose(xml, (kt_pose){kt_matrix_from_quat(axes), com});
    (void)fprintf(xml, " mass='%.17g' diaginertia='%.17g %.17g %.17g'/>", b->mass, moments.x, moments.y, moments.z);
    write_joint(xml, i, &b->joint);
    for (int k = 0; k < h->description.body_count; k++)
        if (h->parent[k] == i)
            write_body(xml, h, k);
    (void)fputs("</body>", xml);
}

/* The first body of a constraint is none that is the world. */
static void write_connect(FILE *xml, const kt_hard *h, int a, int b, kt_vec3 point) {
    const int first = a >= 0 ? a : b, second = a >= 0 ? b : a;
    const kt_vec3 at = kt_pose_apply(kt_pose_invert(h->pose[first]), point);
    (void)fprintf(xml, "<connect body1='b%d' anchor='%.17g %.17g %.17g'", first, at.x, at.y, at.z);
    if (second >= 0)
        (void)fprintf(xml, " body2='b%d'", second);
    (void)fputs("/>", xml);
}

static void write_loops(FILE *xml, const kt_hard *h) {
    (void)fputs("<equality>", xml);
    for (int i = 0; i < h->description.loop_count; i++) {
        const kt_loop *loop = &h->description.loops[i];
        int a, b;
        const kt_pose frame = kt_hard_peer_end(h, &loop->between[0], &a);
        (void)kt_hard_peer_end(h, &loop->between[1], &b);
        write_connect(xml, h, a, b, frame.position);
        if (loop->type == KT_LOOP_REVOLUTE && !kt_hard_peer_flat(h))
            write_connect(xml, h, a, b, kt_pose_apply(frame, kt_vec3_normalize(loop->axis)));
    }
    (void)fputs("</equality>", xml);
}

/* Released with free; NULL without memory. */
static char *write_scene(const kt_hard *h, double step, size_t *size) {
    const kt_vec3 g = h->description.gravity;
    char *text = NULL;
    FILE *xml = open_memstream(&text, size);
    if (!xml)
        return NULL;
    (void)fprintf(
        xml,
        "<mujoco><compiler angle='radian' inertiafromgeom='false'/>"
        "<option gravity='%.17g %.17g %.17g' timestep='%.17g' integrator='RK4' solver='Newton' iterations='100'"
        " tolerance='1e-14'><flag contact='disable'/></option>"
        "<default><equality solref='%.17g 1' solimp='0.9999 0.9999 0.001'/></default><worldbody>",
        g.x, g.y, g.z, step, 2.0 * step);
    for (int i = 0; i < h->description.body_count; i++)
        if (h->parent[i] < 0)
            write_body(xml, h, i);
    (void)fputs("</worldbody>", xml);
    write_loops(xml, h);
    (void)fputs("</mujoco>", xml);
    if (fclose(xml) == 0)
        return text;
    free(text);
    return NULL;
}

enum { DEEP_MOST = 90 };

static bool add_file(mjVFS *files, const char *name, const kt_mujoco_text *text) {
    if (!text->text || mj_makeEmptyFileVFS(files, name, (int)text->size) != 0)
        return false;
    memcpy(files->filedata[mj_findFileVFS(files, name)], text->text, text->size);
    return true;
}

mjModel *kt_mujoco_read_parts(kt_mujoco_text *scene, kt_mujoco_text *part, char reason[KT_MUJOCO_REASON]) {
    mjModel *model = NULL;
    mjVFS *files = malloc(sizeof *files);
    reason[0] = '\0';
    if (files) {
        mj_defaultVFS(files);
        if (add_file(files, "scene.xml", scene) && (!part || add_file(files, "part.xml", part)))
            model = mj_loadXML("scene.xml", files, reason, KT_MUJOCO_REASON);
        mj_deleteVFS(files);
    }
    free(files);
    free(scene->text);
    if (part)
        free(part->text);
    return model;
}

mjModel *kt_mujoco_read(char *text, size_t size, char reason[KT_MUJOCO_REASON]) {
    return kt_mujoco_read_parts(&(kt_mujoco_text){text, size}, NULL, reason);
}

static mjModel *load(const kt_hard *h, double step, char *words) {
    char reason[KT_MUJOCO_REASON];
    size_t size = 0;
    char *text = write_scene(h, step, &size);
    mjModel *model = kt_mujoco_read(text, size, reason);
    if (!model)
        (void)snprintf(words, KT_HARD_WORDS, "%s",
                       strstr(reason, "mass and inertia")      ? "refused: needs mass"
                       : h->description.body_count > DEEP_MOST ? "refused: too deep" /* for its parser */
                                                               : "refused");
    return model;
}

/* ---- the same motion --------------------------------------------------------------------------------------------- */

/* The rates of a joint are the same numbers: a ball's in its own axes, a free body's place in the world's. */
static void set_rates(const kt_hard *h, const mjModel *m, mjData *d) {
    const double *v = kt_simulation_velocities(h->simulation);
    for (int b = 1; b < kt_model_body_count(h->model); b++) {
        const kt_coordinates c = kt_body_coordinates(h->model, b);
        char name[24];
        (void)snprintf(name, sizeof name, "j%d", kt_body_source(h->model, b));
        const int joint = mj_name2id(m, mjOBJ_JOINT, name);
        if (joint >= 0)
            memcpy(d->qvel + m->jnt_dofadr[joint], v + c.v, (size_t)c.nv * sizeof *v);
    }
}

static void read_bodies(kt_hard *h, const mjModel *m, mjData *d) {
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mj_comVel(m, d);
    for (int i = 0; i < h->description.body_count; i++) {
        char name[24];
        mjtNum rate[6];
        (void)snprintf(name, sizeof name, "b%d", i);
        const int b = mj_name2id(m, mjOBJ_BODY, name);
        const mjtNum *p = d->xpos + 3 * b, *r = d->xquat + 4 * b;
        mj_objectVelocity(m, d, mjOBJ_XBODY, b, rate, 0);
        h->pose[i].position = kt_vec3_make(p[0], p[1], p[2]);
        h->pose[i].rotation = kt_matrix_from_quat(kt_quat_make(r[0], r[1], r[2], r[3]));
        h->twist[i] = (kt_twist){kt_vec3_make(rate[0], rate[1], rate[2]), kt_vec3_make(rate[3], rate[4], rate[5])};
    }
}

/* It resets itself to the start where numbers grow too large, with a warning: that is the end here. */
static bool went_wrong(const mjData *d) {
    return d->warning[mjWARN_BADQPOS].number + d->warning[mjWARN_BADQVEL].number + d->warning[mjWARN_BADQACC].number >
           0;
}

static void say_nothing(const char *words) { (void)words; }

bool kt_hard_mujoco(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words) {
    mju_user_warning = say_nothing;
    if (!kt_hard_peer_begin(h, words))
        return false;
    mjModel *m = load(h, motion->step, words);
    if (!m)
        return false;
    mjData *d = mj_makeData(m);
    set_rates(h, m, d);
    read_bodies(h, m, d);
    bool good = kt_hard_peer_view(h, motion, watch, 0.0, words);
    long step = 0;
    for (long view = 0, n; good && (n = kt_hard_peer_steps(h, motion, view)) > 0; view++) {
        for (long k = 0; k < n; k++, step++)
            mj_step(m, d);
        read_bodies(h, m, d);
        good = !went_wrong(d);
        if (!good)
            (void)snprintf(words, KT_HARD_WORDS, "unstable at %.2g s", (double)step * motion->step);
        good = good && kt_hard_peer_view(h, motion, watch, (double)step * motion->step, words);
    }
    mj_deleteData(d);
    mj_deleteModel(m);
    return good;
}
