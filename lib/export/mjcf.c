/* A mechanism in MJCF.
 *
 * A body stands in its parent as our joint frame does, and its joints, one for each coordinate but of ball and free ones,
 * act at its origin. A free joint counts from the world: of one that stands elsewhere the start is taken along. Loops
 * between bodies are equalities of sites.
 */
#include "export/robot.h"
#include "model/joint_name.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void write_quat(kt_export *x, kt_mat3 rotation) {
    const kt_quat q = kt_quat_from_matrix(rotation);
    if (q.x != 0.0 || q.y != 0.0 || q.z != 0.0)
        kt_export_numbers(x, "quat", (const double[]){q.w, q.x, q.y, q.z}, 4);
}

static kt_quat quat_of(const double *p) {
    const kt_quat q = kt_quat_make(p[0], p[1], p[2], p[3]);
    return kt_quat_norm_squared(q) > 0.0 ? kt_quat_normalize(q) : kt_quat_make(1.0, 0.0, 0.0, 0.0);
}

/* Where the body stands in its parent: in its joint frame, or, of a free one, where it starts. */
static kt_pose pose_of(const kt_joint *joint) {
    const kt_pose frame = {.rotation = kt_export_matrix(&joint->rotation), .position = joint->at};
    if (joint->type != KT_JOINT_FREE)
        return frame;
    const kt_pose start = {.rotation = kt_matrix_from_quat(quat_of(joint->position + 3)),
                           .position = kt_vec3_make(joint->position[0], joint->position[1], joint->position[2])};
    return kt_pose_compose(frame, start);
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static void write_range(kt_export *x, const kt_joint *joint) {
    const kt_joint_limits *l = &joint->limits;
    static const double far = 1e9;
    if (isfinite(l->velocity) || isfinite(l->effort))
        kt_export_lose(x, "limits of effort and speed");
    if (!isfinite(l->lower) && !isfinite(l->upper))
        return;
    kt_export_numbers(x, "range",
                      (const double[]){isfinite(l->lower) ? l->lower : -far, isfinite(l->upper) ? l->upper : far}, 2);
}

static void write_forces(kt_export *x, const kt_export_forces *f) {
    if (f->damping != 0.0)
        kt_export_numbers(x, "damping", &f->damping, 1);
    if (f->friction != 0.0)
        kt_export_numbers(x, "frictionloss", &f->friction, 1);
    if (f->stiffness != 0.0)
        kt_export_numbers(x, "stiffness", &f->stiffness, 1);
    if (f->stiffness != 0.0 && f->rest != 0.0)
        kt_export_numbers(x, "springref", &f->rest, 1);
}

static void write_joint(kt_export *x, int i, int k, int count, const kt_export_step *step) {
    const kt_body *body = kt_export_body(x, i);
    const bool is_ball = step->type == KT_JOINT_SPHERICAL, is_free = step->type == KT_JOINT_FREE;
    const int nv = is_free ? 6 : is_ball ? 3 : 1;
    const char *type = is_free ? "free" : is_ball ? "ball" : step->type == KT_JOINT_PRISMATIC ? "slide" : "hinge";
    for (int n = 1; n < nv; n++)
        if (body->joint.armature[n] != body->joint.armature[0])
            kt_export_lose(x, "armatures of a ball or free joint that differ");
    fprintf(x->stream, "<joint name=\"%s", kt_joint_name_of(body));
    if (k > 0)
        fprintf(x->stream, "__%d", k);
    fprintf(x->stream, "\" type=\"%s\"", type);
    if (!is_ball && !is_free)
        kt_export_vector(x, "axis", kt_vec3_normalize(step->axis));
    if (body->joint.armature[k] != 0.0)
        kt_export_numbers(x, "armature", &body->joint.armature[k], 1);
    if (count == 1 && nv == 1) {
        write_range(x, &body->joint);
        write_forces(x, &x->forces[i]);
    }
    fputs("/>", x->stream);
}

static void write_inertial(kt_export *x, const kt_body *body, bool moves) {
    kt_vec3 com;
    kt_sym3 s;
    kt_export_mass(body, &com, &s);
    const bool is_diagonal = s.xy == 0.0 && s.xz == 0.0 && s.yz == 0.0;
    if (body->mass == 0.0 && is_diagonal && s.xx == 0.0 && s.yy == 0.0 && s.zz == 0.0) {
        if (moves)
            kt_export_lose(x, "bodies that move and have no mass (MuJoCo refuses them)");
        return;
    }
    fputs("<inertial", x->stream);
    kt_export_vector(x, "pos", com);
    kt_export_numbers(x, "mass", &body->mass, 1);
    kt_export_numbers(x, is_diagonal ? "diaginertia" : "fullinertia",
                      (const double[]){s.xx, s.yy, s.zz, s.xy, s.xz, s.yz}, is_diagonal ? 3 : 6);
    fputs("/>", x->stream);
}

static void write_geom(kt_export *x, const kt_body *body) {
    kt_shape shape = body->shape;
    if (shape.type == KT_SHAPE_NONE || !kt_export_solid(x, &shape))
        return;
    const bool is_box = shape.type == KT_SHAPE_BOX, is_sphere = shape.type == KT_SHAPE_SPHERE;
    const double size[] = {is_box ? 0.5 * shape.size.x : shape.radius, 0.5 * (is_box ? shape.size.y : shape.length),
                           0.5 * shape.size.z};
    fprintf(x->stream, "<geom type=\"%s\"", is_box ? "box" : is_sphere ? "sphere" : "cylinder");
    kt_export_numbers(x, "size", size, is_box ? 3 : is_sphere ? 1 : 2);
    kt_export_vector(x, "pos", shape.at);
    write_quat(x, kt_export_matrix(&shape.rotation));
    fputs(" mass=\"0\" contype=\"0\" conaffinity=\"0\"/>", x->stream);
}

/* The ends of loops are sites LOOP__1 and LOOP__2. */
static void write_ends(kt_export *x, int body) {
    for (int i = 0; i < x->d->loop_count; i++) {
        const kt_loop *loop = &x->d->loops[i];
        if (loop->type != KT_LOOP_SPHERICAL && loop->type != KT_LOOP_WELD)
            continue;
        for (int k = 0; k < 2; k++) {
            const kt_end *end = &loop->between[k];
            if ((end->body != NULL ? kt_names_find(&x->names, 0, end->body) : -1) != body)
                continue;
            fprintf(x->stream, "<site name=\"%s__%d\"", loop->name, k + 1);
            const kt_pose frame = kt_export_end(x, end);
            kt_export_vector(x, "pos", frame.position);
            write_quat(x, frame.rotation);
            fputs("/>", x->stream);
        }
    }
}

static void begin_body(kt_export *x, int i, int depth) {
    const kt_body *body = kt_export_body(x, i);
    const kt_pose pose = pose_of(&body->joint);
    kt_export_step steps[KT_EXPORT_STEPS];
    const int count = kt_export_steps(&body->joint, steps);
    fprintf(x->stream, "%*s<body name=\"%s\"", 2 * depth + 4, "", body->name);
    kt_export_vector(x, "pos", pose.position);
    write_quat(x, pose.rotation);
    fputs(">", x->stream);
    for (int k = 0; k < count; k++)
        write_joint(x, i, k, count, &steps[k]);
    write_inertial(x, body, count > 0);
    write_geom(x, body);
    for (int k = 0; k < body->marker_count; k++) { /* names of sites are those of the whole model */
        const bool is_first = kt_names_find(&x->names, 2, body->markers[k].name) == i;
        fprintf(x->stream, "<site name=\"%s%s%s\"", is_first ? "" : body->name, is_first ? "" : "__",
                body->markers[k].name);
        kt_export_vector(x, "pos", body->markers[k].at);
        write_quat(x, kt_export_matrix(&body->markers[k].rotation));
        fputs("/>", x->stream);
    }
    write_ends(x, i);
    fputs("\n", x->stream);
}

/* Bodies within one another, without recursion: their number has no bound. */
static void write_tree(kt_export *x, kt_export_visit *visit, bool has_ends) {
    int depth = 0;
    for (int at = x->first_root; at >= 0;) {
        visit(x, at, depth);
        if (x->first_child[at] >= 0) {
            at = x->first_child[at];
            depth++;
            continue;
        }
        for (;;) {
            if (has_ends)
                fprintf(x->stream, "%*s</body>\n", 2 * depth + 4, "");
            if (x->next_child[at] >= 0) {
                at = x->next_child[at];
                break;
            }
            at = x->parent[at];
            if (at < 0)
                return;
            depth--;
        }
    }
}

/* ---- equalities, start ------------------------------------------------------------------------------------------- */

static void write_equalities(kt_export *x) {
    fputs("  <equality>\n", x->stream);
    for (int i = 0; i < x->d->loop_count; i++) {
        const kt_loop *loop = &x->d->loops[i];
        if (loop->type == KT_LOOP_SPHERICAL || loop->type == KT_LOOP_WELD)
            fprintf(x->stream, "    <%s name=\"%s\" site1=\"%s__1\" site2=\"%s__2\"/>\n",
                    loop->type == KT_LOOP_WELD ? "weld" : "connect", loop->name, loop->name, loop->name);
    }
    for (int i = 0; i < x->d->body_count; i++) {
        const kt_export_follower *f = &x->followers[i];
        if (f->master < 0)
            continue;
        fprintf(x->stream, "    <joint joint1=\"%s\" joint2=\"%s\"", kt_joint_name_of(kt_export_body(x, i)),
                kt_joint_name_of(kt_export_body(x, f->master)));
        kt_export_numbers(x, "polycoef", f->a, 5);
        fputs("/>\n", x->stream);
    }
    fputs("  </equality>\n", x->stream);
}

static void add_numbers(kt_export *x, const double *values, int count) {
    for (int i = 0; i < count; i++) {
        char text[KT_EXPORT_NUMBER];
        kt_export_number(text, values[i]);
        fprintf(x->stream, " %s", text);
    }
}

static void write_position(kt_export *x, int i, int depth) {
    const kt_joint *j = &kt_export_body(x, i)->joint;
    const kt_pose pose = pose_of(j);
    kt_quat q = j->type == KT_JOINT_FREE ? kt_quat_from_matrix(pose.rotation) : quat_of(j->position);
    (void)depth;
    if (j->type == KT_JOINT_FREE)
        add_numbers(x, (const double[]){pose.position.x, pose.position.y, pose.position.z}, 3);
    if (j->type == KT_JOINT_FREE || j->type == KT_JOINT_SPHERICAL)
        add_numbers(x, (const double[]){q.w, q.x, q.y, q.z}, 4);
    else
        add_numbers(x, j->position, kt_export_steps(j, (kt_export_step[KT_EXPORT_STEPS]){{KT_JOINT_FIXED, j->axis}}));
}

static void write_velocity(kt_export *x, int i, int depth) {
    const kt_joint *j = &kt_export_body(x, i)->joint;
    const kt_vec3 v =
        kt_mat3_apply(kt_export_matrix(&j->rotation), kt_vec3_make(j->velocity[0], j->velocity[1], j->velocity[2]));
    (void)depth;
    if (j->type == KT_JOINT_FREE) {
        add_numbers(x, (const double[]){v.x, v.y, v.z}, 3);
        add_numbers(x, j->velocity + 3, 3);
    } else if (j->type == KT_JOINT_SPHERICAL) {
        add_numbers(x, j->velocity, 3);
    } else {
        add_numbers(x, j->velocity, kt_export_steps(j, (kt_export_step[KT_EXPORT_STEPS]){{KT_JOINT_FIXED, j->axis}}));
    }
}

void kt_export_mjcf(kt_export *x) {
    fputs("<mujoco model=\"", x->stream);
    kt_export_text(x, x->d->name != NULL ? x->d->name : "robot");
    fputs("\">\n  <compiler angle=\"radian\" autolimits=\"true\"/>\n  <option", x->stream);
    kt_export_vector(x, "gravity", x->d->gravity);
    fputs("/>\n  <worldbody>\n    ", x->stream);
    write_ends(x, -1);
    fputs("\n", x->stream);
    write_tree(x, begin_body, true);
    fputs("  </worldbody>\n", x->stream);
    write_equalities(x);
    fputs("  <keyframe>\n    <key name=\"start\" qpos=\"", x->stream);
    write_tree(x, write_position, false);
    fputs("\"\n      qvel=\"", x->stream);
    write_tree(x, write_velocity, false);
    fputs("\"/>\n  </keyframe>\n</mujoco>\n", x->stream);
}
