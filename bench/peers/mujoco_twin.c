/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco_twin.h"
#include "principal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the same mechanism ------------------------------------------------------------------------------------------ */

static void write_pose(FILE *xml, kt_pose p) {
    const kt_quat r = kt_quat_from_mat3(p.rotation);
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

/* Spheres collide with planes, and with spheres if these touch. */
static void write_spheres(FILE *xml, const kt_twin_ground *ground, int body) {
    for (int k = 0; ground && k < ground->sphere_count; k++) {
        const kt_twin_sphere *s = &ground->sphere[k];
        if (s->body == body)
            (void)fprintf(xml,
                          "<geom type='sphere' size='%.17g' pos='%.17g %.17g %.17g' contype='1' conaffinity='%d'"
                          " friction='%.17g 0 0'/>",
                          s->radius, s->at.x, s->at.y, s->at.z, ground->touch, ground->friction);
    }
}

static void write_planes(FILE *xml, const kt_twin_ground *ground) {
    for (int k = 0; ground && k < ground->plane_count; k++) {
        const kt_twin_plane *p = &ground->plane[k];
        (void)fprintf(xml,
                      "<geom type='plane' size='100 100 1' pos='%.17g %.17g %.17g' zaxis='%.17g %.17g %.17g'"
                      " contype='0' conaffinity='1' friction='%.17g 0 0'/>",
                      p->at.x, p->at.y, p->at.z, p->normal.x, p->normal.y, p->normal.z, ground->friction);
    }
}

/* A body and all that it carries. */
static void write_body(FILE *xml, const kt_twin *twin, int i) {
    const kt_body *b = &twin->description->bodies[i];
    kt_pose at = twin->pose[i];
    kt_vec3 com, moments;
    kt_sym3 inertia;
    if (twin->parent[i] >= 0)
        at = kt_pose_compose(kt_pose_invert(twin->pose[twin->parent[i]]), at);
    kt_twin_mass(twin, i, &com, &inertia);
    const kt_quat axes = kt_principal_axes(inertia, &moments);
    (void)fprintf(xml, "<body name='b%d'", i);
    write_pose(xml, at);
    (void)fputs("><inertial", xml);
    write_pose(xml, (kt_pose){kt_mat3_from_quat(axes), com});
    (void)fprintf(xml, " mass='%.17g' diaginertia='%.17g %.17g %.17g'/>", b->mass, moments.x, moments.y, moments.z);
    write_joint(xml, i, &b->joint);
    write_spheres(xml, twin->ground, i);
    for (int k = 0; k < twin->description->body_count; k++)
        if (twin->parent[k] == i)
            write_body(xml, twin, k);
    (void)fputs("</body>", xml);
}

/* The first body of a constraint is none that is the world. */
static void write_connect(FILE *xml, const kt_twin *twin, int a, int b, kt_vec3 point) {
    const int first = a >= 0 ? a : b, second = a >= 0 ? b : a;
    const kt_vec3 at = kt_pose_apply(kt_pose_invert(twin->pose[first]), point);
    (void)fprintf(xml, "<connect body1='b%d' anchor='%.17g %.17g %.17g'", first, at.x, at.y, at.z);
    if (second >= 0)
        (void)fprintf(xml, " body2='b%d'", second);
    (void)fputs("/>", xml);
}

static void write_loops(FILE *xml, const kt_twin *twin) {
    (void)fputs("<equality>", xml);
    for (int i = 0; i < twin->description->loop_count; i++) {
        const kt_loop *loop = &twin->description->loops[i];
        int a, b;
        const kt_pose frame = kt_twin_end(twin, &loop->between[0], &a);
        (void)kt_twin_end(twin, &loop->between[1], &b);
        write_connect(xml, twin, a, b, frame.position);
        if (loop->type == KT_LOOP_REVOLUTE && !kt_twin_flat(twin))
            write_connect(xml, twin, a, b, kt_pose_apply(frame, kt_vec3_normalize(loop->axis)));
    }
    (void)fputs("</equality>", xml);
}

char *kt_mujoco_twin_write(const kt_twin *twin, double step, size_t *size) {
    const kt_vec3 g = twin->description->gravity;
    char *text = NULL;
    FILE *xml = open_memstream(&text, size);
    if (!xml)
        return NULL;
    (void)fprintf(
        xml,
        "<mujoco><compiler angle='radian' inertiafromgeom='false'/>"
        "<option gravity='%.17g %.17g %.17g' timestep='%.17g' integrator='RK4' solver='Newton' iterations='100'"
        " tolerance='1e-14'><flag contact='%s'/></option>%s"
        "<default><equality solref='%.17g 1' solimp='0.9999 0.9999 0.001'/></default><worldbody>",
        g.x, g.y, g.z, step, twin->ground ? "enable" : "disable",
        twin->ground ? "<size njmax='4000' nconmax='1000'/>" : "", 2.0 * step);
    write_planes(xml, twin->ground);
    for (int i = 0; i < twin->description->body_count; i++)
        if (twin->parent[i] < 0)
            write_body(xml, twin, i);
    (void)fputs("</worldbody>", xml);
    write_loops(xml, twin);
    (void)fputs("</mujoco>", xml);
    if (fclose(xml) == 0)
        return text;
    free(text);
    return NULL;
}

void kt_mujoco_twin_rates(const kt_model *model, const double *v, const mjModel *m, mjData *d) {
    for (int b = 1; b < kt_model_body_count(model); b++) {
        const kt_coordinates c = kt_body_coordinates(model, b);
        char name[24];
        (void)snprintf(name, sizeof name, "j%d", kt_body_source(model, b));
        const int joint = mj_name2id(m, mjOBJ_JOINT, name);
        if (joint >= 0)
            memcpy(d->qvel + m->jnt_dofadr[joint], v + c.v, (size_t)c.nv * sizeof *v);
    }
}

void kt_mujoco_twin_read(const mjModel *m, mjData *d, const kt_twin *to) {
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mj_comVel(m, d);
    for (int i = 0; i < to->description->body_count; i++) {
        char name[24];
        mjtNum rate[6];
        (void)snprintf(name, sizeof name, "b%d", i);
        const int b = mj_name2id(m, mjOBJ_BODY, name);
        const mjtNum *p = d->xpos + 3 * (size_t)b, *r = d->xquat + 4 * (size_t)b;
        mj_objectVelocity(m, d, mjOBJ_XBODY, b, rate, 0);
        to->pose[i].position = kt_vec3_make(p[0], p[1], p[2]);
        to->pose[i].rotation = kt_mat3_from_quat(kt_quat_make(r[0], r[1], r[2], r[3]));
        to->twist[i] = (kt_twist){kt_vec3_make(rate[0], rate[1], rate[2]), kt_vec3_make(rate[3], rate[4], rate[5])};
    }
}

/* ---- texts in memory --------------------------------------------------------------------------------------------- */

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
