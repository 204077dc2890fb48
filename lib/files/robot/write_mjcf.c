/* A mechanism in MJCF: bodies, their joints, masses and pictures.
 *
 * A body has the pose of our joint frame in its parent. Its joints act at its origin, one for each coordinate except
 * those of ball and free joints. A free joint counts from the world. If its joint frame is elsewhere, its start
 * includes the frame. On another body it is three slides and a ball. A screw is a hinge, a slide, and an equality of
 * both.
 *
 * A body without mass that carries one other gives its joint to that (write_role.c). Let J_1 J_2 ... J_n be the joint
 * frames of such bodies and the last one. The body has the pose J = J_1 ... J_n, and joint k acts in the frame (J_{k+1}
 * ... J_n)^-1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joint_name.h"
#include "robot/write.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void write_quat(kt_export *x, kt_mat3 rotation) {
    const kt_quat q = kt_quat_from_mat3(rotation);
    if (q.x != 0.0 || q.y != 0.0 || q.z != 0.0)
        kt_export_numbers(x, "quat", (const double[]){q.w, q.x, q.y, q.z}, 4);
}

/* The place of a body, a geom or a site. */
static void write_place(kt_export *x, kt_vec3 at, kt_mat3 rotation) {
    kt_export_vector(x, "pos", at);
    write_quat(x, rotation);
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* A joint of MJCF: a step of one of our joints, on the body that has it in the file. */
typedef struct act {
    int body, part, count; /* which step of how many */
    kt_pose frame;         /* the joint frame, seen from the body that has it; the identity for its own */
    bool is_own;           /* it is */
} act;

/* Bounds of the sum of actuators have precedence over the effort of the joint, since MJCF has one range. */
static void write_limits(kt_export *x, int i) {
    const kt_joint_limits *l = &kt_export_body(x, i)->joint.limits;
    if (isfinite(l->velocity))
        kt_export_lose(x, "limits of speed");
    if (kt_export_has_force_range(&x->forces[i]))
        kt_export_numbers(x, "actuatorfrcrange", x->forces[i].range, 2);
    else if (isfinite(l->effort) && l->effort > 0.0)
        kt_export_print(x, " actuatorfrcrange=\"%g %g\"", -l->effort, l->effort);
    if (!isfinite(l->lower) && !isfinite(l->upper))
        return;
    if (l->lower < l->upper)
        kt_export_print(x, " range=\"%g %g\"", kt_export_bound(l->lower), kt_export_bound(l->upper));
    else
        kt_export_lose(x, "ranges of joints without a length");
}

static void write_mjcf_forces(kt_export *x, const kt_export_forces *f) {
    kt_export_write_polynomial(x, "damping", f->damping);
    kt_export_unless_zero(x, "frictionloss", f->friction);
    kt_export_write_polynomial(x, "stiffness", f->stiffness);
    kt_export_unless_zero(x, "springref", f->rest[0]);
}

static void write_mjcf_joint(kt_export *x, const act *a, const kt_export_step *step) {
    const kt_body *body = kt_export_body(x, a->body);
    const bool is_ball = step->type == KT_JOINT_SPHERICAL, is_free = step->type == KT_JOINT_FREE;
    const bool is_whole = a->count == 1 || (body->joint.type == KT_JOINT_SCREW && a->part == 0);
    const int nv = is_free ? 6 : is_ball ? 3 : 1;
    const char *type = is_free ? "free" : is_ball ? "ball" : step->type == KT_JOINT_PRISMATIC ? "slide" : "hinge";
    const double armature = body->joint.armature[a->part < KT_JOINT_NV_MAX ? a->part : 0];
    for (int n = 1; n < nv; n++)
        if (body->joint.armature[a->part + n] != armature)
            kt_export_lose(x, "armatures of a ball or free joint that differ");
    kt_export_print(x, "<joint name=\"%s", kt_joint_name_of(body));
    if (a->part > 0)
        kt_export_print(x, "__%d", a->part);
    kt_export_print(x, "\" type=\"%s\"", type);
    if (!a->is_own)
        kt_export_vector(x, "pos", a->frame.position);
    if (nv == 1)
        kt_export_vector(x, "axis",
                         a->is_own ? kt_vec3_normalize(step->axis)
                                   : kt_mat3_apply(a->frame.rotation, kt_vec3_normalize(step->axis)));
    if (body->joint.type != KT_JOINT_SCREW || a->part == 0)
        kt_export_unless_zero(x, "armature", armature);
    if (is_whole && nv == 1) {
        write_limits(x, a->body);
        write_mjcf_forces(x, &x->forces[a->body]);
    } else if (is_ball || is_free) {
        write_mjcf_forces(x, &x->forces[a->body]);
    }
    kt_export_print(x, "/>");
}

/* The joints of a body: those of its own joint, which may be several. */
static int list_steps(const kt_export *x, int i, kt_export_step steps[KT_EXPORT_STEPS]) {
    const kt_joint *joint = &kt_export_body(x, i)->joint;
    static const double axes[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    if (joint->type == KT_JOINT_SCREW) {
        steps[0] = (kt_export_step){KT_JOINT_REVOLUTE, joint->axis};
        steps[1] = (kt_export_step){KT_JOINT_PRISMATIC, joint->axis};
        return 2;
    }
    if (!kt_export_is_deep(x, i))
        return kt_export_steps(joint, steps);
    for (int k = 0; k < 3; k++)
        steps[k] = (kt_export_step){KT_JOINT_PRISMATIC, kt_vec3_make(axes[k][0], axes[k][1], axes[k][2])};
    steps[3] = (kt_export_step){KT_JOINT_SPHERICAL, joint->axis};
    return 4;
}

static int write_own_joints(kt_export *x, int i, const kt_pose *frame) {
    kt_export_step steps[KT_EXPORT_STEPS];
    act a = {.body = i, .count = list_steps(x, i, steps), .is_own = frame == NULL};
    if (frame != NULL)
        a.frame = *frame;
    for (a.part = 0; a.part < a.count; a.part++)
        write_mjcf_joint(x, &a, &steps[a.part]);
    return a.count;
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* The first of the bodies without mass that give their joints to a body, or the body itself. */
static int first_of(const kt_export *x, int i) {
    while (x->parent[i] >= 0 && x->role[x->parent[i]] == KT_EXPORT_MERGED)
        i = x->parent[i];
    return i;
}

/* The pose of a body in its parent, including the bodies before it that give it their joints. */
static kt_pose whole_pose(const kt_export *x, int i) {
    kt_pose pose = kt_export_pose(x, i);
    for (int k = x->parent[i]; k >= 0 && x->role[k] == KT_EXPORT_MERGED; k = x->parent[k])
        pose = kt_pose_compose(kt_export_pose(x, k), pose);
    return pose;
}

/* Writes the joints of the bodies that are merged into body i (first_of), then its own, and returns their number.
 * `frame` is the pose of body k in body i; as many bodies may be merged, each pose is found anew. */
static int write_joints(kt_export *x, int i) {
    int count = 0;
    for (int k = first_of(x, i); k != i; k = x->first_child[k]) {
        kt_pose after = kt_pose_identity();
        for (int n = i; n != k; n = x->parent[n])
            after = kt_pose_compose(kt_export_pose(x, n), after);
        const kt_pose frame = kt_pose_invert(after);
        count += write_own_joints(x, k, &frame);
    }
    return count + write_own_joints(x, i, NULL);
}

static void write_mjcf_inertial(kt_export *x, int body, bool moves) {
    const kt_export_moments m = kt_export_take_moments(x, body, moves);
    if (m.is_nothing)
        return;
    const kt_sym3 s = m.full;
    const bool is_diagonal = s.xy == 0.0 && s.xz == 0.0 && s.yz == 0.0;
    kt_export_print(x, "<inertial pos=\"%g %g %g\" mass=\"%g\"", m.com.x, m.com.y, m.com.z, m.mass);
    if (m.is_plain) {
        kt_export_numbers(x, is_diagonal ? "diaginertia" : "fullinertia",
                          (const double[]){s.xx, s.yy, s.zz, s.xy, s.xz, s.yz}, is_diagonal ? 3 : 6);
    } else {
        write_quat(x, m.axes);
        kt_export_numbers(x, "diaginertia", m.moment, 3);
    }
    kt_export_print(x, "/>");
}

static const char for_pictures[] = " mass=\"0\" contype=\"0\" conaffinity=\"0\"/>";

static void write_geom(kt_export *x, const kt_shape *of) {
    kt_shape shape = *of;
    if (shape.type == KT_SHAPE_NONE || !kt_export_solid(x, &shape))
        return;
    const bool is_box = shape.type == KT_SHAPE_BOX, is_sphere = shape.type == KT_SHAPE_SPHERE;
    const double size[] = {is_box ? 0.5 * shape.size.x : shape.radius, 0.5 * (is_box ? shape.size.y : shape.length),
                           0.5 * shape.size.z};
    const int count = is_box ? 3 : is_sphere ? 1 : 2;
    for (int k = 0; k < count; k++)
        if (!(size[k] > 0.0)) {
            kt_export_lose(x, "shapes without a volume");
            return;
        }
    kt_export_print(x, "<geom type=\"%s\"", is_box ? "box" : is_sphere ? "sphere" : "cylinder");
    kt_export_numbers(x, "size", size, count);
    write_place(x, shape.at, kt_mat3_of_rotation(&shape.rotation));
    kt_export_print(x, for_pictures);
}

/* The asset of a mesh: the first one of its source and scale. */
static int asset_of(const kt_export *x, int mesh) {
    const kt_vec3 scale = x->meshes[mesh].scale;
    for (int i = 0; i < mesh; i++) {
        const kt_vec3 other = x->meshes[i].scale;
        const char *file = x->mesh_files[i];
        if (file != NULL && strcmp(file, x->mesh_files[mesh]) == 0 && other.x == scale.x && other.y == scale.y &&
            other.z == scale.z)
            return i;
    }
    return mesh;
}

static void write_mjcf_meshes(kt_export *x, int i) {
    for (int k = 0; k < x->mesh_count; k++) {
        const kt_scene_mesh *mesh = &x->meshes[k];
        if (x->mesh_files[k] == NULL || kt_export_find(x, mesh->body) != i)
            continue;
        kt_export_print(x, "<geom type=\"mesh\" mesh=\"mesh_%d\"", asset_of(x, k));
        write_place(x, mesh->at, kt_mat3_of_rotation(&mesh->rotation));
        kt_export_print(x, for_pictures);
    }
}

static void write_assets(kt_export *x) {
    kt_export_print(x, "  <asset>\n");
    for (int k = 0; k < x->mesh_count; k++) {
        const kt_vec3 scale = x->meshes[k].scale;
        if (x->mesh_files[k] == NULL || asset_of(x, k) != k)
            continue;
        kt_export_print(x, "    <mesh name=\"mesh_%d\" inertia=\"shell\" file=\"%s\"", k, x->mesh_files[k]);
        if (scale.x != 1.0 || scale.y != 1.0 || scale.z != 1.0)
            kt_export_vector(x, "scale", scale);
        kt_export_print(x, "/>\n");
    }
    kt_export_print(x, "  </asset>\n");
}

/* The ends of loops are sites LOOP__1 and LOOP__2. Points a unit along the axis of a revolute loop are LOOP__3 and
 * LOOP__4. */
static void write_ends(kt_export *x, int body) {
    for (int i = 0; i < x->d->loop_count; i++) {
        const kt_loop *loop = &x->d->loops[i];
        for (int k = 0; k < 2 && kt_export_has_sites(loop); k++) {
            const kt_end *end = &loop->between[k];
            if ((kt_export_find(x, end->body)) != body)
                continue;
            const kt_pose frame = kt_export_end(x, end);
            kt_export_print(x, "<site name=\"%s__%d\"", loop->name, k + 1);
            write_place(x, frame.position, frame.rotation);
            kt_export_print(x, "/>");
            if (loop->type != KT_LOOP_REVOLUTE)
                continue;
            kt_export_print(x, "<site name=\"%s__%d\"", loop->name, k + 3);
            kt_export_vector(x, "pos", kt_pose_apply(frame, kt_vec3_normalize(loop->axis)));
            kt_export_print(x, "/>");
        }
    }
}

static void write_markers(kt_export *x, int i) {
    const kt_body *body = kt_export_body(x, i);
    for (int k = 0; k < body->marker_count; k++) { /* names of sites are those of the whole model */
        const bool is_first = kt_names_find(&x->names, 2, body->markers[k].name) == i;
        kt_export_print(x, "<site name=\"%s%s%s\"", is_first ? "" : body->name, is_first ? "" : "__",
                        body->markers[k].name);
        write_place(x, body->markers[k].at, kt_mat3_of_rotation(&body->markers[k].rotation));
        kt_export_print(x, "/>");
    }
}

/* The sites at which actuators act. */
static void write_actuated(kt_export *x, int body) {
    for (int i = 0; i < x->actuator_count; i++) {
        const kt_effect *e = x->actuators[i].effect;
        if (e->end_count != 1 || kt_export_find(x, e->between[0].body) != body)
            continue;
        const kt_pose frame = kt_export_end(x, &e->between[0]);
        kt_export_print(x, "<site name=\"actuator__%d\"", i + 1);
        write_place(x, frame.position, frame.rotation);
        kt_export_print(x, "/>");
    }
}

static void begin_body(kt_export *x, int i, int depth) {
    const kt_body *body = kt_export_body(x, i);
    if (x->role[i] != KT_EXPORT_BODY)
        return;
    const kt_pose pose = whole_pose(x, i);
    fprintf(x->stream, "%*s<body name=\"%s\"", 2 * depth + 4, "", body->name);
    write_place(x, pose.position, pose.rotation);
    kt_export_print(x, ">");
    const int joints = write_joints(x, i);
    write_mjcf_inertial(x, i, joints > 0);
    for (int k = 0; k <= body->shape_count; k++)
        write_geom(x, kt_export_shape(body, k));
    write_mjcf_meshes(x, i);
    write_markers(x, i);
    write_ends(x, i);
    kt_export_rope_points(x, i);
    write_actuated(x, i);
    kt_export_print(x, "\n");
}

static void end_body(kt_export *x, int i, int depth) {
    if (x->role[i] == KT_EXPORT_BODY)
        fprintf(x->stream, "%*s</body>\n", 2 * depth + 4, "");
}

void kt_export_mjcf(kt_export *x) {
    kt_export_print(x, "<mujoco model=\"%s\">\n", x->d->name != NULL ? x->d->name : "robot");
    kt_export_print(x, "  <compiler angle=\"radian\" autolimits=\"true\"/>\n  <option");
    kt_export_vector(x, "gravity", x->d->gravity);
    kt_export_print(x, "/>\n");
    write_assets(x);
    kt_export_print(x, "  <worldbody>\n    ");
    write_ends(x, -1);
    kt_export_rope_points(x, -1);
    kt_export_print(x, "\n");
    kt_export_tree(x, begin_body, end_body);
    kt_export_print(x, "  </worldbody>\n");
    kt_export_tendons(x);
    kt_export_equalities(x);
    kt_export_actuators(x);
    kt_export_start(x);
    kt_export_print(x, "</mujoco>\n");
}
