/* Constraints and drives of joints in MJCF: tendons, equalities, actuators, and the start.
 *
 * A slider that represents a sum of joints, n = offset / c + L, is a fixed tendon of the length L (write_role.c). Its
 * rest positions and targets are therefore less by offset / c. A coupling of several joints is a tendon whose length an
 * equality holds. A loop of type revolute is two points of its axis that coincide, six equations of which one is
 * redundant.
 *
 * A servo, k (r - q) + c (r' - v), is an actuator with the control r and the force k r - k q - c v. Without stiffness
 * it has the control r'. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joint_name.h"
#include "robot/write.h"

#include <math.h>

static const char *joint_of(const kt_export *x, int body) { return kt_joint_name_of(kt_export_body(x, body)); }

/* ---- tendons ----------------------------------------------------------------------------------------------------- */

/* Writes the joints of a relation, except the joint of the body `but`, with their coefficients times `factor`. */
static void write_terms(kt_export *x, const kt_loop *loop, int but, double factor) {
    for (int k = 0; k < loop->term_count; k++) {
        const double coefficient = factor * loop->terms[k].coefficient;
        const int body = kt_export_scalar(x, loop->terms[k].joint);
        if (body != but && coefficient != 0.0)
            kt_export_print(x, "<joint joint=\"%s\" coef=\"%g\"/>", loop->terms[k].joint, coefficient);
    }
}

/* The slider of body i represents a sum of joints. Writes a fixed tendon in its place. The slider's forces, armature
 * and limits act on the tendon's length, which is n less an offset (see the file's head). */
static void write_number(kt_export *x, int i) {
    const kt_export_forces *f = &x->forces[i];
    const kt_joint *joint = &kt_export_body(x, i)->joint;
    double own;
    const double offset = kt_export_number_offset(x, i, &own);
    kt_export_print(x, "    <fixed name=\"%s\"", joint_of(x, i));
    kt_export_write_polynomial(x, "damping", f->damping);
    kt_export_unless_zero(x, "frictionloss", f->friction);
    kt_export_write_polynomial(x, "stiffness", f->stiffness);
    if (f->stiffness[0] != 0.0 || f->stiffness[1] != 0.0 || f->stiffness[2] != 0.0)
        kt_export_print(x, " springlength=\"%g %g\"", f->rest[0] - offset, f->rest[1] - offset);
    kt_export_unless_zero(x, "armature", joint->armature[0]);
    if (isfinite(joint->limits.lower) && isfinite(joint->limits.upper) && joint->limits.lower < joint->limits.upper)
        kt_export_print(x, " range=\"%g %g\"", joint->limits.lower - offset, joint->limits.upper - offset);
    kt_export_print(x, ">");
    write_terms(x, x->sum[i], i, -1.0 / own);
    kt_export_print(x, "</fixed>\n");
}

static void write_line(kt_export *x, int i) {
    const kt_export_line *line = &x->lines[i];
    kt_export_print(x, "    <fixed");
    kt_export_line_name(x, "name", i);
    kt_export_sum_range(x, line->actuator);
    if (line->spring != NULL) {
        kt_export_write_polynomial(x, "stiffness", line->spring->stiffness);
        kt_export_numbers(x, "springlength", line->spring->rest, 2);
        kt_export_write_polynomial(x, "damping", line->spring->damping);
    }
    kt_export_print(x, ">");
    for (int k = 0; k < line->count; k++)
        kt_export_print(x, "<joint joint=\"%s\" coef=\"%g\"/>", line->terms[k].joint, line->terms[k].coefficient);
    kt_export_print(x, "</fixed>\n");
}

void kt_export_tendons(kt_export *x) {
    kt_export_print(x, "  <tendon>\n");
    for (int i = 0; i < x->d->body_count; i++)
        if (x->role[i] == KT_EXPORT_SUM)
            write_number(x, i);
    for (int i = 0; i < x->tendon_count; i++) {
        kt_export_print(x, "    <fixed name=\"%s\">", x->tendons[i]->name);
        write_terms(x, x->tendons[i], -1, 1.0);
        kt_export_print(x, "</fixed>\n");
    }
    for (int i = 0; i < x->line_count; i++)
        write_line(x, i);
    kt_export_ropes(x);
    kt_export_print(x, "  </tendon>\n");
}

/* ---- equalities -------------------------------------------------------------------------------------------------- */

static void write_sites(kt_export *x, const kt_loop *loop, const char *type, const char *suffix, int first) {
    kt_export_print(x, "    <%s name=\"%s%s\" site1=\"%s__%d\" site2=\"%s__%d\"/>\n", type, loop->name, suffix,
                    loop->name, first, loop->name, first + 1);
}

static void write_held(kt_export *x, const kt_loop *loop) {
    double v[3];
    const double at = kt_function_evaluate(&loop->function, 0.0, v, NULL) == KT_OK ? v[0] : 0.0;
    kt_export_print(x, "    <joint joint1=\"%s\" polycoef=\"%g 0 0 0 0\"/>\n", loop->joint, at);
}

void kt_export_equalities(kt_export *x) {
    kt_export_print(x, "  <equality>\n");
    for (int i = 0; i < x->d->loop_count; i++) {
        const kt_loop *loop = &x->d->loops[i];
        if (kt_export_is_held(x, loop))
            write_held(x, loop);
        if (!kt_export_has_sites(loop))
            continue;
        write_sites(x, loop, loop->type == KT_LOOP_WELD ? "weld" : "connect", "", 1);
        if (loop->type == KT_LOOP_REVOLUTE)
            write_sites(x, loop, "connect", "__axis", 3);
    }
    for (int i = 0; i < x->d->body_count; i++) {
        const kt_export_follower *f = &x->followers[i];
        const kt_joint *joint = &kt_export_body(x, i)->joint;
        if (f->master >= 0)
            kt_export_print(x, "    <joint joint1=\"%s\" joint2=\"%s\" polycoef=\"%g %g %g %g %g\"/>\n", joint_of(x, i),
                            joint_of(x, f->master), f->a[0], f->a[1], f->a[2], f->a[3], f->a[4]);
        if (joint->type == KT_JOINT_SCREW) /* its slide advances with its hinge */
            kt_export_print(x, "    <joint joint1=\"%s__1\" joint2=\"%s\" polycoef=\"0 %g 0 0 0\"/>\n", joint_of(x, i),
                            joint_of(x, i), joint->pitch);
    }
    for (int i = 0; i < x->tendon_count; i++)
        kt_export_print(x, "    <tendon tendon1=\"%s\" polycoef=\"%g 0 0 0 0\"/>\n", x->tendons[i]->name,
                        x->tendons[i]->offset);
    kt_export_print(x, "  </equality>\n");
}

/* ---- actuators --------------------------------------------------------------------------------------------------- */

/* A function of time at the start, and its rate. */
static double start_of(const kt_function *f, int derivative) {
    double v[3] = {0.0, 0.0, 0.0};
    return f->type != KT_FUNCTION_NONE && kt_function_evaluate(f, 0.0, v, NULL) == KT_OK ? v[derivative] : 0.0;
}

/* A target without stiffness grows at a constant rate. */
static bool is_steady(const kt_effect *e) {
    const kt_function *f = e->type == KT_EFFECT_MOTOR ? &e->torque : &e->target;
    const bool is_line = f->type == KT_FUNCTION_POLYNOMIAL && f->number_count <= 2;
    return f->type == KT_FUNCTION_NONE || f->type == KT_FUNCTION_CONSTANT ||
           (is_line && e->type == KT_EFFECT_SERVO && e->stiffness == 0.0);
}

/* The bounds of a servo's force, which are sharp in MuJoCo. */
static void write_bounds(kt_export *x, const kt_effect *e) {
    const double lower = fmax(e->lower, -e->limit), upper = fmin(e->upper, e->limit);
    if (isfinite(e->limit))
        kt_export_lose(x, "smooth limits of servos, which MuJoCo has as sharp ones");
    if (isfinite(lower) || isfinite(upper))
        kt_export_print(x, " forcerange=\"%g %g\"", kt_export_bound(lower), kt_export_bound(upper));
}

/* A servo has the force k u - k q - c v for the control u, its target. Without stiffness k, it has c u - c v, and u is
 * the rate of the target. */
static void write_motor(kt_export *x, const kt_export_motor *motor) {
    const kt_effect *e = motor->effect;
    const bool is_number = x->role[motor->body] == KT_EXPORT_SUM, is_servo = e->type == KT_EFFECT_SERVO;
    kt_export_print(x, "    <%s", is_servo ? "general" : "motor");
    if (e->name != NULL)
        kt_export_print(x, " name=\"%s\"", e->name);
    kt_export_print(x, " %s=\"%s\"", is_number ? "tendon" : "joint", joint_of(x, motor->body));
    if (is_servo) {
        kt_export_print(x, " biastype=\"affine\" gainprm=\"%g\" biasprm=\"0 %g %g\"",
                        e->stiffness > 0.0 ? e->stiffness : e->damping, -e->stiffness, -e->damping);
        write_bounds(x, e);
    }
    kt_export_print(x, "/>\n");
    if (!is_steady(e))
        kt_export_lose(x, "functions of time of motors and servos, whose controls are those of the start");
    if (isfinite(kt_export_body(x, motor->body)->joint.limits.effort) && !is_number)
        kt_export_lose(x, KT_EXPORT_EFFORTS);
}

void kt_export_actuators(kt_export *x) {
    kt_export_print(x, "  <actuator>\n");
    for (int i = 0; i < x->motor_count; i++)
        write_motor(x, &x->motors[i]);
    kt_export_listed_actuators(x);
    kt_export_print(x, "  </actuator>\n");
}

/* The control at the start (write_motor). A tendon has its own zero, by which the target is shifted. */
static double control_of(const kt_export *x, const kt_export_motor *motor) {
    const kt_effect *e = motor->effect;
    double own;
    if (e->type == KT_EFFECT_MOTOR)
        return start_of(&e->torque, 0);
    if (!(e->stiffness > 0.0))
        return start_of(&e->target, 1);
    return start_of(&e->target, 0) -
           (x->role[motor->body] == KT_EXPORT_SUM ? kt_export_number_offset(x, motor->body, &own) : 0.0);
}

/* ---- the start --------------------------------------------------------------------------------------------------- */

static void add_numbers(kt_export *x, const double *values, int count) {
    for (int i = 0; i < count; i++)
        kt_export_print(x, " %g", values[i]);
}

static void add_quat(kt_export *x, const double *p) {
    kt_quat q = kt_quat_make(p[0], p[1], p[2], p[3]);
    q = kt_quat_norm_squared(q) > 0.0 ? kt_quat_normalize(q) : kt_quat_make(1.0, 0.0, 0.0, 0.0);
    add_numbers(x, (const double[]){q.w, q.x, q.y, q.z}, 4);
}

/* Adds numbers of joints of one coordinate each; the second of a screw follows. */
static void add_scalars(kt_export *x, const kt_joint *j, const double *values) {
    kt_export_step steps[KT_EXPORT_STEPS];
    add_numbers(x, values, kt_export_steps(j, steps));
    if (j->type == KT_JOINT_SCREW)
        add_numbers(x, (const double[]){j->pitch * values[0]}, 1);
}

/* A free joint of MuJoCo counts from the world; on another body it is three slides and a ball. */
static void write_position(kt_export *x, int i, int depth) {
    const kt_joint *j = &kt_export_body(x, i)->joint;
    (void)depth;
    if (x->role[i] == KT_EXPORT_SUM)
        return;
    if (kt_export_is_deep(x, i)) {
        add_numbers(x, j->position, 3);
        add_quat(x, j->position + 3);
    } else if (j->type == KT_JOINT_FREE) {
        const kt_pose pose = kt_export_pose(x, i);
        const kt_quat q = kt_quat_from_mat3(pose.rotation);
        add_numbers(x, (const double[]){pose.position.x, pose.position.y, pose.position.z}, 3);
        add_numbers(x, (const double[]){q.w, q.x, q.y, q.z}, 4);
    } else if (j->type == KT_JOINT_SPHERICAL) {
        add_quat(x, j->position);
    } else {
        add_scalars(x, j, j->position);
    }
}

/* As positions. A free joint has the velocity in world axes and the angular velocity in body axes. */
static void write_velocity(kt_export *x, int i, int depth) {
    const kt_joint *j = &kt_export_body(x, i)->joint;
    (void)depth;
    if (x->role[i] == KT_EXPORT_SUM)
        return;
    if (kt_export_is_deep(x, i)) {
        add_numbers(x, j->velocity, 6);
    } else if (j->type == KT_JOINT_FREE) {
        const kt_vec3 own = kt_vec3_make(j->velocity[0], j->velocity[1], j->velocity[2]);
        const kt_vec3 v = kt_mat3_apply(kt_mat3_of_rotation(&j->rotation), own);
        add_numbers(x, (const double[]){v.x, v.y, v.z}, 3);
        add_numbers(x, j->velocity + 3, 3);
    } else if (j->type == KT_JOINT_SPHERICAL) {
        add_numbers(x, j->velocity, 3);
    } else {
        add_scalars(x, j, j->velocity);
    }
}

static void write_activations(kt_export *x) {
    bool has_any = false;
    for (int i = 0; i < x->actuator_count; i++) {
        if (x->actuators[i].state < 0)
            continue;
        if (!has_any)
            kt_export_print(x, "\"\n      act=\"");
        has_any = true;
        add_numbers(x, &x->d->states[x->actuators[i].state].initial, 1);
    }
}

void kt_export_start(kt_export *x) {
    kt_export_print(x, "  <keyframe>\n    <key name=\"start\" qpos=\"");
    kt_export_tree(x, write_position, NULL);
    kt_export_print(x, "\"\n      qvel=\"");
    kt_export_tree(x, write_velocity, NULL);
    if (x->motor_count + x->actuator_count > 0)
        kt_export_print(x, "\"\n      ctrl=\"");
    for (int i = 0; i < x->motor_count; i++)
        add_numbers(x, (const double[]){control_of(x, &x->motors[i])}, 1);
    for (int i = 0; i < x->actuator_count; i++)
        add_numbers(x, (const double[]){kt_export_control(x, &x->actuators[i])}, 1);
    write_activations(x);
    kt_export_print(x, "\"/>\n  </keyframe>\n");
}
