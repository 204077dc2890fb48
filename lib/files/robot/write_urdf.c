/* A mechanism in URDF.
 *
 * A link has the frame of its body. The `origin` of its joint is our joint frame, and the axis is in this frame. Joints
 * of several coordinates have links without mass between them.
 *
 * Gravity in URDF is along -z. If g has another direction, the rotation R turns the mechanism as a whole, so that R g
 * is along -z. The origins of joints on the world are multiplied by R. With u = -g / |g| and c = u . z, the shortest
 * rotation from u to z is
 *
 *     R = c 1 + [u x z]x + (u x z) (u x z)' / (1 + c),
 *
 * which loses digits for c close to -1. For c < 0 half a turn about x comes first.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joint_name.h"
#include "robot/write.h"

#include <math.h>
#include <string.h>

/* The name of a link or a joint, or of step 1, 2 ... of a joint: BODY, BODY__1, BODY__2. */
static void write_between(kt_export *x, const char *body, int step) {
    kt_export_print(x, "%s", body);
    if (step > 0)
        kt_export_print(x, "__%d", step);
}

static void write_origin(kt_export *x, const char *indent, kt_vec3 at, const kt_rotation *rotation) {
    const bool is_rpy = rotation->type == KT_ROTATION_RPY;
    const kt_vec3 rpy = is_rpy ? kt_vec3_make(rotation->value[0], rotation->value[1], rotation->value[2])
                               : kt_rpy_from_mat3(kt_mat3_of_rotation(rotation), NULL);
    kt_export_print(x, "%s<origin xyz=\"%g %g %g\"", indent, at.x, at.y, at.z);
    if (rotation->type != KT_ROTATION_NONE)
        kt_export_vector(x, "rpy", rpy);
    kt_export_print(x, "/>\n");
}

static void write_urdf_inertial(kt_export *x, int body, bool moves) {
    const kt_export_moments m = kt_export_take_moments(x, body, moves);
    if (m.is_nothing)
        return;
    const kt_sym3 s = m.is_plain ? m.full : kt_sym3_make(m.moment[0], m.moment[1], m.moment[2], 0.0, 0.0, 0.0);
    const kt_quat q = kt_quat_from_mat3(m.axes);
    kt_rotation axes = {.type = KT_ROTATION_NONE};
    if (!m.is_plain)
        axes = kt_rotation_quaternion(q.w, q.x, q.y, q.z);
    kt_export_print(x, "    <inertial>\n");
    write_origin(x, "      ", m.com, &axes);
    kt_export_print(x, "      <mass value=\"%g\"/>\n      <inertia ixx=\"%g\" ixy=\"%g\" ixz=\"%g\"", m.mass, s.xx,
                    s.xy, s.xz);
    kt_export_print(x, " iyy=\"%g\" iyz=\"%g\" izz=\"%g\"/>\n    </inertial>\n", s.yy, s.yz, s.zz);
}

/* A rod is a cylinder between its ends. */
static void write_visual(kt_export *x, const kt_shape *of) {
    kt_shape shape = *of;
    if (shape.type == KT_SHAPE_NONE || !kt_export_solid(x, &shape))
        return;
    kt_export_print(x, "    <visual>\n");
    write_origin(x, "      ", shape.at, &shape.rotation);
    if (shape.type == KT_SHAPE_BOX)
        kt_export_print(x, "      <geometry><box size=\"%g %g %g\"", shape.size.x, shape.size.y, shape.size.z);
    else if (shape.type == KT_SHAPE_SPHERE)
        kt_export_print(x, "      <geometry><sphere radius=\"%g\"", shape.radius);
    else
        kt_export_print(x, "      <geometry><cylinder radius=\"%g\" length=\"%g\"", shape.radius, shape.length);
    kt_export_print(x, "/></geometry>\n    </visual>\n");
}

static void write_urdf_meshes(kt_export *x, int i) {
    for (int k = 0; k < x->mesh_count; k++) {
        const kt_scene_mesh *mesh = &x->meshes[k];
        if (x->mesh_files[k] == NULL || kt_export_find(x, mesh->body) != i)
            continue;
        kt_export_print(x, "    <visual>\n");
        write_origin(x, "      ", mesh->at, &mesh->rotation);
        kt_export_print(x, "      <geometry><mesh filename=\"%s\"", x->mesh_files[k]);
        kt_export_vector(x, "scale", mesh->scale);
        kt_export_print(x, "/></geometry>\n    </visual>\n");
    }
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

static const char *type_name(const kt_joint *joint, const kt_export_step *step) {
    const bool is_limited = isfinite(joint->limits.lower) || isfinite(joint->limits.upper);
    if (step == NULL)
        return "fixed";
    if (step->type == KT_JOINT_REVOLUTE)
        return is_limited ? "revolute" : "continuous";
    return step->type == KT_JOINT_PRISMATIC ? "prismatic" : step->type == KT_JOINT_PLANAR ? "planar" : "floating";
}

/* URDF has no limit on one side alone, nor a prismatic joint without limits. */
static void write_limit(kt_export *x, const kt_joint *joint, const char *type) {
    const kt_joint_limits *l = &joint->limits;
    const bool has_rates = isfinite(l->velocity) || isfinite(l->effort);
    if (strcmp(type, "revolute") != 0 && strcmp(type, "prismatic") != 0 && !has_rates)
        return;
    kt_export_print(x, "    <limit");
    if (strcmp(type, "continuous") != 0) {
        const double lower = kt_export_bound(l->lower), upper = kt_export_bound(l->upper);
        kt_export_print(x, " lower=\"%g\" upper=\"%g\"", lower, upper);
        if (lower == -1e9 || upper == 1e9)
            kt_export_lose(x, "missing limits, which are written as 1e9");
    }
    kt_export_print(x, " effort=\"%g\" velocity=\"%g\"/>\n", kt_export_bound(l->effort), kt_export_bound(l->velocity));
}

static void write_urdf_forces(kt_export *x, int i) {
    const kt_export_forces *f = &x->forces[i];
    const kt_export_follower *follower = &x->followers[i];
    if (f->damping[0] != 0.0 || f->friction != 0.0)
        kt_export_print(x, "    <dynamics damping=\"%g\" friction=\"%g\"/>\n", f->damping[0], f->friction);
    if (follower->master >= 0)
        kt_export_print(x, "    <mimic joint=\"%s\" multiplier=\"%g\" offset=\"%g\"/>\n",
                        kt_joint_name_of(kt_export_body(x, follower->master)), follower->a[1], follower->a[0]);
}

/* ---- the direction of gravity ------------------------------------------------------------------------------------ */

/* Whether gravity is along -z, or absent. */
static bool is_upright(kt_vec3 gravity) { return gravity.x == 0.0 && gravity.y == 0.0 && gravity.z <= 0.0; }

/* R of a direction of gravity. */
static kt_mat3 turn_upright(kt_vec3 gravity) {
    kt_vec3 u = kt_vec3_scale(-1.0, kt_vec3_normalize(gravity));
    kt_mat3 half = kt_mat3_identity(), turn = half;
    half.y.y = half.z.z = u.z < 0.0 ? -1.0 : 1.0;
    u = kt_mat3_apply(half, u);
    const kt_vec3 w = kt_vec3_cross(u, kt_vec3_make(0.0, 0.0, 1.0)), scaled = kt_vec3_scale(1.0 / (1.0 + u.z), w);
    turn = kt_mat3_add(kt_mat3_scale(u.z, turn), kt_mat3_skew(w));
    turn.x = kt_vec3_add(turn.x, kt_vec3_scale(w.x, scaled));
    turn.y = kt_vec3_add(turn.y, kt_vec3_scale(w.y, scaled));
    turn.z = kt_vec3_add(turn.z, kt_vec3_scale(w.z, scaled));
    return kt_mat3_multiply(turn, half);
}

/* The origin of a joint on the world. */
static void write_root_origin(kt_export *x, const kt_joint *joint) {
    if (is_upright(x->d->gravity)) {
        write_origin(x, "    ", joint->at, &joint->rotation);
        return;
    }
    const kt_mat3 turn = turn_upright(x->d->gravity);
    const kt_rotation rotation = kt_rotation_matrix(kt_mat3_multiply(turn, kt_mat3_of_rotation(&joint->rotation)));
    write_origin(x, "    ", kt_mat3_apply(turn, joint->at), &rotation);
}

/* Step k of `count` steps; of a fixed joint there is one, NULL. */
static void write_urdf_joint(kt_export *x, int i, int k, int count, const kt_export_step *step) {
    const kt_body *body = kt_export_body(x, i);
    const kt_rotation none = {.type = KT_ROTATION_NONE};
    const char *type = type_name(&body->joint, step);
    const char *parent = k > 0 ? body->name : x->parent[i] >= 0 ? kt_export_body(x, x->parent[i])->name : "world";
    kt_export_print(x, "  <joint name=\"");
    write_between(x, kt_joint_name_of(body), k);
    kt_export_print(x, "\" type=\"%s\">\n    <parent link=\"", type);
    write_between(x, parent, k);
    kt_export_print(x, "\"/>\n    <child link=\"");
    write_between(x, body->name, k < count - 1 ? k + 1 : 0);
    kt_export_print(x, "\"/>\n");
    if (k == 0 && x->parent[i] < 0)
        write_root_origin(x, &body->joint);
    else
        write_origin(x, "    ", k == 0 ? body->joint.at : kt_vec3_make(0.0, 0.0, 0.0),
                     k == 0 ? &body->joint.rotation : &none);
    if (step != NULL && step->type != KT_JOINT_FREE) {
        const kt_vec3 axis = kt_vec3_normalize(step->axis);
        kt_export_print(x, "    <axis xyz=\"%g %g %g\"/>\n", axis.x, axis.y, axis.z);
        write_limit(x, &body->joint, type);
    }
    if (k == 0)
        write_urdf_forces(x, i);
    kt_export_print(x, "  </joint>\n");
    if (k < count - 1) {
        kt_export_print(x, "  <link name=\"%s__%d\">\n", body->name, k + 1);
        write_urdf_inertial(x, -1, true);
        kt_export_print(x, "  </link>\n");
    }
}

/* The armature as a rotor that turns with the joint. */
static void write_rotor(kt_export *x, const kt_body *body, const kt_export_step *step) {
    const bool is_scalar = step->type == KT_JOINT_REVOLUTE || step->type == KT_JOINT_PRISMATIC;
    bool has_any = false;
    for (int k = 0; k < KT_JOINT_NV_MAX; k++)
        has_any = has_any || body->joint.armature[k] != 0.0;
    if (!has_any)
        return;
    if (!is_scalar || body->joint.type == KT_JOINT_CYLINDRICAL || body->joint.type == KT_JOINT_UNIVERSAL) {
        kt_export_lose(x, "armatures of joints of several coordinates");
        return;
    }
    const char *joint = kt_joint_name_of(body);
    kt_export_print(
        x,
        "  <transmission name=\"%s_rotor\">\n    <type>transmission_interface/SimpleTransmission</type>\n"
        "    <joint name=\"%s\"/>\n    <actuator name=\"%s_motor\"><mechanicalReduction>1</mechanicalReduction>"
        "<motorInertia value=\"%g\"/></actuator>\n  </transmission>\n",
        joint, joint, joint, body->joint.armature[0]);
}

static void lose_start(kt_export *x, const kt_joint *joint) {
    bool moves = false;
    for (int k = 0; k < KT_JOINT_NV_MAX; k++)
        moves = moves || joint->velocity[k] != 0.0 || joint->position[k] != 0.0;
    if (moves)
        kt_export_lose(x, "joints that do not start at rest in zero");
}

static void write_body(kt_export *x, int i) {
    const kt_body *body = kt_export_body(x, i);
    kt_export_step steps[KT_EXPORT_STEPS] = {{KT_JOINT_PLANAR, body->joint.axis}};
    const int count = body->joint.type == KT_JOINT_PLANAR ? 1 : kt_export_steps(&body->joint, steps);
    kt_export_print(x, "  <link name=\"%s\">\n", body->name);
    write_urdf_inertial(x, i, count > 0);
    for (int k = 0; k <= body->shape_count; k++)
        write_visual(x, kt_export_shape(body, k));
    write_urdf_meshes(x, i);
    kt_export_print(x, "  </link>\n");
    for (int k = 0; k < (count > 0 ? count : 1); k++)
        write_urdf_joint(x, i, k, count > 0 ? count : 1, count > 0 ? &steps[k] : NULL);
    if (count > 0)
        write_rotor(x, body, &steps[0]);
    lose_start(x, &body->joint);
    for (int k = 0; k < body->marker_count; k++)
        kt_export_lose(x, "markers");
}

void kt_export_urdf(kt_export *x) {
    const kt_vec3 g = x->d->gravity;
    kt_export_print(x, "<?xml version=\"1.0\"?>\n<robot name=\"%s\">\n  <link name=\"world\"/>\n",
                    x->d->name != NULL ? x->d->name : "robot");
    for (int i = 0; i < x->d->body_count; i++)
        write_body(x, i);
    kt_export_print(x, "</robot>\n");
    if (!is_upright(g))
        kt_export_lose(x, "gravity that is not along -z: the mechanism is turned upright");
    if (fabs(kt_vec3_norm(g) - 9.81) > 1e-12)
        kt_export_lose(x, "gravity that is not 9.81 m/s^2");
}
