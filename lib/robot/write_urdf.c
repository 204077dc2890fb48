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
#include "model/joint_name.h"
#include "robot/write.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Names of links and joints between the steps of a joint: BODY__1, BODY__2. */
static void write_between(kt_export *x, const char *body, int step) { fprintf(x->stream, "%s__%d", body, step); }

static void write_origin(kt_export *x, const char *indent, kt_vec3 at, const kt_rotation *rotation) {
    const bool is_rpy = rotation->type == KT_ROTATION_RPY;
    const kt_vec3 rpy = is_rpy ? kt_vec3_make(rotation->value[0], rotation->value[1], rotation->value[2])
                               : kt_rpy_from_matrix(kt_export_matrix(rotation), NULL);
    fprintf(x->stream, "%s<origin", indent);
    kt_export_vector(x, "xyz", at);
    if (rotation->type != KT_ROTATION_NONE)
        kt_export_vector(x, "rpy", rpy);
    fputs("/>\n", x->stream);
}

static void write_urdf_inertial(kt_export *x, int body, bool moves) {
    static const char *const names[] = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
    const kt_export_moments m = kt_export_take_moments(x, body, moves);
    if (m.is_nothing)
        return;
    const kt_sym3 s = m.is_plain ? m.full : kt_sym3_make(m.moment[0], m.moment[1], m.moment[2], 0.0, 0.0, 0.0);
    const double values[] = {s.xx, s.xy, s.xz, s.yy, s.yz, s.zz};
    const kt_quat q = kt_quat_from_matrix(m.axes);
    kt_rotation axes = {.type = KT_ROTATION_NONE};
    if (!m.is_plain)
        axes = kt_rotation_quaternion(q.w, q.x, q.y, q.z);
    fputs("    <inertial>\n", x->stream);
    write_origin(x, "      ", m.com, &axes);
    fputs("      <mass", x->stream);
    kt_export_numbers(x, "value", &m.mass, 1);
    fputs("/>\n      <inertia", x->stream);
    for (int i = 0; i < 6; i++)
        kt_export_numbers(x, names[i], &values[i], 1);
    fputs("/>\n    </inertial>\n", x->stream);
}

/* A rod is a cylinder between its ends. */
static void write_visual(kt_export *x, const kt_shape *of) {
    kt_shape shape = *of;
    if (shape.type == KT_SHAPE_NONE)
        return;
    if (!kt_export_solid(x, &shape))
        return;
    fputs("    <visual>\n", x->stream);
    write_origin(x, "      ", shape.at, &shape.rotation);
    fputs("      <geometry><", x->stream);
    if (shape.type == KT_SHAPE_BOX) {
        fputs("box", x->stream);
        kt_export_vector(x, "size", shape.size);
    } else {
        fputs(shape.type == KT_SHAPE_SPHERE ? "sphere" : "cylinder", x->stream);
        kt_export_numbers(x, "radius", &shape.radius, 1);
        if (shape.type == KT_SHAPE_CYLINDER)
            kt_export_numbers(x, "length", &shape.length, 1);
    }
    fputs("/></geometry>\n    </visual>\n", x->stream);
}

static void write_urdf_meshes(kt_export *x, int i) {
    for (int k = 0; k < x->mesh_count; k++) {
        const kt_scene_mesh *mesh = &x->meshes[k];
        if (x->mesh_files[k] == NULL || kt_names_find(&x->names, 0, mesh->body) != i)
            continue;
        fputs("    <visual>\n", x->stream);
        write_origin(x, "      ", mesh->at, &mesh->rotation);
        fputs("      <geometry><mesh filename=\"", x->stream);
        kt_export_text(x, x->mesh_files[k]);
        fputs("\"", x->stream);
        kt_export_vector(x, "scale", mesh->scale);
        fputs("/></geometry>\n    </visual>\n", x->stream);
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
    static const double far = 1e9;
    const kt_joint_limits *l = &joint->limits;
    const bool has_rates = isfinite(l->velocity) || isfinite(l->effort);
    if (strcmp(type, "revolute") != 0 && strcmp(type, "prismatic") != 0 && !has_rates)
        return;
    fputs("    <limit", x->stream);
    if (strcmp(type, "continuous") != 0) {
        const double lower = isfinite(l->lower) ? l->lower : -far, upper = isfinite(l->upper) ? l->upper : far;
        kt_export_numbers(x, "lower", &lower, 1);
        kt_export_numbers(x, "upper", &upper, 1);
        if (lower == -far || upper == far)
            kt_export_lose(x, "missing limits, which are written as 1e9");
    }
    const double effort = isfinite(l->effort) ? l->effort : far, velocity = isfinite(l->velocity) ? l->velocity : far;
    kt_export_numbers(x, "effort", &effort, 1);
    kt_export_numbers(x, "velocity", &velocity, 1);
    fputs("/>\n", x->stream);
}

static void write_urdf_forces(kt_export *x, int i) {
    const kt_export_forces *f = &x->forces[i];
    const kt_export_follower *follower = &x->followers[i];
    if (f->damping != 0.0 || f->friction != 0.0) {
        fputs("    <dynamics", x->stream);
        kt_export_numbers(x, "damping", &f->damping, 1);
        kt_export_numbers(x, "friction", &f->friction, 1);
        fputs("/>\n", x->stream);
    }
    if (follower->master < 0)
        return;
    fprintf(x->stream, "    <mimic joint=\"%s\"", kt_joint_name_of(kt_export_body(x, follower->master)));
    kt_export_numbers(x, "multiplier", &follower->a[1], 1);
    kt_export_numbers(x, "offset", &follower->a[0], 1);
    fputs("/>\n", x->stream);
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
    const kt_rotation rotation = kt_rotation_matrix(kt_mat3_multiply(turn, kt_export_matrix(&joint->rotation)));
    write_origin(x, "    ", kt_mat3_apply(turn, joint->at), &rotation);
}

/* Step k of `count` steps; of a fixed joint there is one, NULL. */
static void write_urdf_joint(kt_export *x, int i, int k, int count, const kt_export_step *step) {
    const kt_body *body = kt_export_body(x, i);
    const kt_rotation none = {.type = KT_ROTATION_NONE};
    const char *type = type_name(&body->joint, step);
    fprintf(x->stream, "  <joint name=\"%s", kt_joint_name_of(body));
    if (k > 0)
        fprintf(x->stream, "__%d", k);
    fprintf(x->stream, "\" type=\"%s\">\n    <parent link=\"", type);
    if (k > 0)
        write_between(x, body->name, k);
    else
        fputs(x->parent[i] >= 0 ? kt_export_body(x, x->parent[i])->name : "world", x->stream);
    fputs("\"/>\n    <child link=\"", x->stream);
    if (k < count - 1)
        write_between(x, body->name, k + 1);
    else
        fputs(body->name, x->stream);
    fputs("\"/>\n", x->stream);
    if (k == 0 && x->parent[i] < 0)
        write_root_origin(x, &body->joint);
    else
        write_origin(x, "    ", k == 0 ? body->joint.at : kt_vec3_make(0.0, 0.0, 0.0),
                     k == 0 ? &body->joint.rotation : &none);
    if (step != NULL && step->type != KT_JOINT_FREE) {
        fputs("    <axis", x->stream);
        kt_export_vector(x, "xyz", kt_vec3_normalize(step->axis));
        fputs("/>\n", x->stream);
        write_limit(x, &body->joint, type);
    }
    if (k == 0)
        write_urdf_forces(x, i);
    fputs("  </joint>\n", x->stream);
    if (k < count - 1) {
        fputs("  <link name=\"", x->stream);
        write_between(x, body->name, k + 1);
        fputs("\">\n", x->stream);
        write_urdf_inertial(x, -1, true);
        fputs("  </link>\n", x->stream);
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
    fprintf(x->stream,
            "  <transmission name=\"%s_rotor\">\n    <type>transmission_interface/SimpleTransmission</type>\n"
            "    <joint name=\"%s\"/>\n    <actuator name=\"%s_motor\"><mechanicalReduction>1</mechanicalReduction>"
            "<motorInertia",
            joint, joint, joint);
    kt_export_numbers(x, "value", &body->joint.armature[0], 1);
    fputs("/></actuator>\n  </transmission>\n", x->stream);
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
    fprintf(x->stream, "  <link name=\"%s\">\n", body->name);
    write_urdf_inertial(x, i, count > 0);
    for (int k = 0; k <= body->shape_count; k++)
        write_visual(x, kt_export_shape(body, k));
    write_urdf_meshes(x, i);
    fputs("  </link>\n", x->stream);
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
    fputs("<?xml version=\"1.0\"?>\n<robot name=\"", x->stream);
    kt_export_text(x, x->d->name != NULL ? x->d->name : "robot");
    fputs("\">\n  <link name=\"world\"/>\n", x->stream);
    for (int i = 0; i < x->d->body_count; i++)
        write_body(x, i);
    fputs("</robot>\n", x->stream);
    if (!is_upright(g))
        kt_export_lose(x, "gravity that is not along -z: the mechanism is turned upright");
    if (fabs(kt_vec3_norm(g) - 9.81) > 1e-12)
        kt_export_lose(x, "gravity that is not 9.81 m/s^2");
}
