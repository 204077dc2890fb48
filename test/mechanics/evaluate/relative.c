/* Effects in coordinates of loops against the same effects in joints of the tree. Three trees represent one mechanism.
 * In the tree `joint`, body a is on the world by the joint, and b on a. In `loop`, a is free on the world and closed by
 * a loop of the joint's type, and b is on a. In `far`, b is free on the world, and a is free on b, with two loops. A
 * rod of constant length holds b. Accelerations, powers, energies and coordinates must agree.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "kinetree/dynamics.h"
#include "kinetree/loop.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MECHANISMS = 60, EFFECTS = 7, SCENES = 3, BODIES = 2 };
static const kt_joint_type joints[] = {KT_JOINT_REVOLUTE,    KT_JOINT_PRISMATIC, KT_JOINT_SCREW,
                                       KT_JOINT_CYLINDRICAL, KT_JOINT_PLANAR,    KT_JOINT_UNIVERSAL};
static const kt_loop_type loops[] = {KT_LOOP_REVOLUTE,    KT_LOOP_PRISMATIC, KT_LOOP_SCREW,
                                     KT_LOOP_CYLINDRICAL, KT_LOOP_PLANAR,    KT_LOOP_UNIVERSAL};

/* ---- one of the three -------------------------------------------------------------------------------------------- */

typedef struct scene {
    kt_body body[BODIES];
    kt_loop loop[3];
    kt_effect effect[EFFECTS];
    char coordinate[16], formula[80];
    kt_description description;
    kt_model *model;
    kt_data *data;
    double q[16], v[16], a[16];
    kt_power power;
    double energy, quantity[EFFECTS * 4];
} scene;

static void add_effects(scene *s, kt_random *random, const char *joint, int k, int count) {
    static const kt_effect_type types[EFFECTS] = {
        KT_EFFECT_JOINT_SPRING, KT_EFFECT_JOINT_DAMPER, KT_EFFECT_JOINT_FRICTION, KT_EFFECT_JOINT_LIMIT,
        KT_EFFECT_MOTOR,        KT_EFFECT_SERVO,        KT_EFFECT_EXPRESSION};
    snprintf(s->coordinate, sizeof s->coordinate, count > 1 ? "%s[%d]" : "%s", joint, k);
    snprintf(s->formula, sizeof s->formula, "cos(t)*position.%s^2 - 0.3*velocity.%s", s->coordinate, s->coordinate);
    for (int i = 0; i < EFFECTS; i++) {
        kt_effect *e = &s->effect[i];
        *e = kt_effect_of(types[i], s->coordinate);
        e->stiffness = kt_random_uniform(random, 0.5, 2.0);
        e->damping = kt_random_uniform(random, 0.5, 2.0);
        e->coulomb = 0.7;
        e->smoothing = 0.6;
        e->viscous = 0.3;
        e->upper = -5.0;
        e->rest = kt_function_sine(0.3, 0.7, 0.4, 0.1);
        e->torque = kt_function_constant(1.5);
        e->target = kt_function_sine(0.7, 0.2, 0.1, 0.2);
        e->limit = 4.0;
        e->formula[0] = s->formula;
    }
    s->description.effects = s->effect;
    s->description.effect_count = EFFECTS;
}

static kt_body body(const char *name) {
    kt_body b = kt_body_default();
    b.name = name;
    b.mass = 1.3;
    b.com = kt_vec3_make(0.1, 0.05, -0.2);
    b.inertia = (kt_sym3){0.5, 0.8, 0.6, 0.0, 0.0, 0.0};
    return b;
}

static kt_loop loop(const char *name, kt_loop_type type, const char *first, const char *second) {
    kt_loop l = kt_loop_of(name, type);
    l.between[0].body = first;
    l.between[1].body = second;
    return l;
}

static void free_at(kt_joint *joint, kt_pose pose, kt_twist twist) {
    const kt_quat p = kt_quat_from_mat3(pose.rotation);
    const kt_vec3 w = kt_mat3_apply_transposed(pose.rotation, twist.angular);
    const double q[7] = {pose.position.x, pose.position.y, pose.position.z, p.w, p.x, p.y, p.z};
    const double v[6] = {twist.linear.x, twist.linear.y, twist.linear.z, w.x, w.y, w.z};
    *joint = kt_joint_default();
    joint->type = KT_JOINT_FREE;
    memcpy(joint->position, q, sizeof q);
    memcpy(joint->velocity, v, sizeof v);
}

static void begin(scene *s) {
    memset(s, 0, sizeof *s);
    s->description = kt_description_default();
    s->description.gravity = kt_vec3_make(1.0, -3.0, 9.0);
    s->description.bodies = s->body;
    s->description.body_count = BODIES;
    s->description.loops = s->loop;
    s->body[0] = body("a");
    s->body[1] = body("b");
}

static void compile(scene *s) {
    s->model = kt_test_model(&s->description, NULL);
    s->data = kt_test_data(s->model);
    kt_model_initial(s->model, s->q, s->v);
}

static void evaluate(scene *s) {
    kt_error e = {0};
    s->energy = kt_effect_energy(s->model, s->data, 0.3, s->q, s->v);
    kt_need_fine("power", kt_power_evaluate(s->model, s->data, 0.3, s->q, s->v, NULL, NULL, s->a, &s->power, &e), &e);
    kt_need_fine("kinematics", kt_kinematics_update(s->model, s->data, s->q, s->v, s->a, &e), &e);
    kt_need_fine("quantities", kt_effect_quantities_evaluate(s->model, s->data, 0.3, s->q, s->v, s->quantity, &e), &e);
}

/* ---- the three --------------------------------------------------------------------------------------------------- */

/* b hangs on a by a spherical joint, and its tip by a rod on the world. */
static void describe_joint(scene *s, kt_random *random, int type, kt_random effects) {
    begin(s);
    kt_joint *j = &s->body[0].joint;
    j->type = joints[type];
    j->axis = kt_tree_direction(random);
    j->axis2 = kt_triad_from_axis(j->axis, 2).x;
    j->at = kt_tree_vector(random, -1.0, 1.0);
    j->rotation = kt_tree_rotation(random);
    j->pitch = 0.3;
    const int count = type < 3 ? 1 : joints[type] == KT_JOINT_PLANAR ? 3 : 2;
    for (int k = 0; k < count; k++) {
        j->position[k] = kt_random_uniform(random, -2.5, 2.5);
        j->velocity[k] = kt_random_uniform(random, -2.0, 2.0);
    }
    s->body[1].parent = "a";
    s->body[1].joint.type = KT_JOINT_SPHERICAL;
    s->body[1].joint.at = kt_tree_vector(random, -1.0, 1.0);
    s->body[1].joint.position[0] = 1.0;
    s->loop[0] = loop("rod", KT_LOOP_DISTANCE, NULL, "b");
    s->loop[0].between[0].at = kt_vec3_make(5.0, 4.0, -3.0);
    s->loop[0].between[1].at = kt_vec3_make(0.3, 0.8, -0.4);
    s->description.loop_count = 1;
    add_effects(s, &effects, "a", type < 3 ? 0 : kt_random_int(random, 0, count - 1), count);
    kt_error e = {0};
    compile(s);
    kt_need_fine("assembly", kt_state_assemble(s->model, s->data, 0.3, s->q, s->v, &e), &e);
    evaluate(s);
}

/* The rod's length is that of the assembled joint scene. */
static void add_rod(scene *s, const scene *from) {
    const kt_vec3 tip =
        kt_point_position(from->model, from->data, kt_body_find(from->model, "b"), from->loop[0].between[1].at);
    s->loop[0] = from->loop[0];
    s->loop[0].function = kt_function_constant(kt_vec3_norm(kt_vec3_sub(tip, from->loop[0].between[0].at)));
}

static void close_joint(scene *s, const scene *from, int type) {
    const kt_joint *j = &from->body[0].joint;
    s->loop[1] = loop("pin", loops[type], NULL, "a");
    s->loop[1].between[0].at = j->at;
    s->loop[1].between[0].rotation = j->rotation;
    s->loop[1].axis = j->axis;
    s->loop[1].axis2 = j->axis2;
    s->loop[1].pitch = j->pitch;
}

static kt_pose pose_of(const scene *s, const char *name) {
    return kt_body_pose(s->model, s->data, kt_body_find(s->model, name));
}
static kt_twist twist_of(const scene *s, const char *name) {
    return kt_body_twist(s->model, s->data, kt_body_find(s->model, name));
}

static void describe_loop(scene *s, const scene *from, int type, kt_random effects) {
    begin(s);
    const kt_coordinates b = kt_body_coordinates(from->model, kt_body_find(from->model, "b"));
    free_at(&s->body[0].joint, pose_of(from, "a"), twist_of(from, "a"));
    s->body[1].parent = "a";
    s->body[1].joint = from->body[1].joint;
    memcpy(s->body[1].joint.position, from->q + b.q, 4 * sizeof(double));
    memcpy(s->body[1].joint.velocity, from->v + b.v, 3 * sizeof(double));
    add_rod(s, from);
    close_joint(s, from, type);
    s->description.loop_count = 2;
    const char *k = strchr(from->coordinate, '[');
    add_effects(s, &effects, "pin", k ? k[1] - '0' : 0, k ? 2 : 1);
    compile(s);
    evaluate(s);
}

static void describe_far(scene *s, const scene *from, int type, kt_random effects) {
    begin(s);
    const kt_pose a = pose_of(from, "a"), b = pose_of(from, "b");
    const kt_twist va = twist_of(from, "a"), vb = twist_of(from, "b");
    const kt_vec3 apart = kt_vec3_sub(a.position, b.position);
    const kt_vec3 moving = kt_vec3_sub(kt_vec3_sub(va.linear, vb.linear), kt_vec3_cross(vb.angular, apart));
    const kt_twist seen = {.angular = kt_mat3_apply_transposed(b.rotation, kt_vec3_sub(va.angular, vb.angular)),
                           .linear = kt_mat3_apply_transposed(b.rotation, moving)};
    free_at(&s->body[1].joint, b, vb);
    free_at(&s->body[0].joint, kt_pose_compose(kt_pose_invert(b), a), seen);
    s->body[0].parent = "b";
    add_rod(s, from);
    close_joint(s, from, type);
    s->loop[2] = loop("ball", KT_LOOP_SPHERICAL, "a", "b");
    s->loop[2].between[0].at = from->body[1].joint.at;
    s->description.loop_count = 3;
    const char *k = strchr(from->coordinate, '[');
    add_effects(s, &effects, "pin", k ? k[1] - '0' : 0, k ? 2 : 1);
    compile(s);
    evaluate(s);
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

static double apart(kt_twist x, kt_twist y) {
    return kt_vec3_norm(kt_vec3_sub(x.angular, y.angular)) + kt_vec3_norm(kt_vec3_sub(x.linear, y.linear));
}

static double size_of(kt_twist x) { return 1.0 + kt_vec3_norm(x.angular) + kt_vec3_norm(x.linear); }

/* The bounds are some hundred eps of the summed terms. They are larger if inertias and rods are badly conditioned. Over
 * eleven seeds, 0.1 of the bound was measured for accelerations, and 0.2 for the others. */
KT_TEST(effects_in_loops_are_those_in_joints) {
    kt_random random = kt_random_of_test();
    KT_WORST motion = kt_worst_make("accelerations"), power = kt_worst_make("powers"),
             energy = kt_worst_make("energies"), quantity = kt_worst_make("forces, powers, coordinates");
    static scene s[SCENES];
    for (int n = 0; n < MECHANISMS; n++) {
        const int type = n % (int)(sizeof joints / sizeof *joints);
        const kt_random seed = random; /* the effects of all three are the same */
        memset(s, 0, sizeof s);
        describe_joint(&s[0], &random, type, seed);
        describe_loop(&s[1], &s[0], type, seed);
        describe_far(&s[2], &s[0], type, seed);
        for (int k = 1; k < SCENES; k++) {
            for (int b = 0; b < BODIES; b++) {
                const char *name = b ? "b" : "a";
                const kt_twist x = kt_body_acceleration(s[0].model, s[0].data, kt_body_find(s[0].model, name)),
                               y = kt_body_acceleration(s[k].model, s[k].data, kt_body_find(s[k].model, name));
                kt_worst_below(&motion, apart(x, y), 1e-13 * size_of(x), "%s of tree %d, %s", name, k,
                               kt_joint_type_name(joints[type]));
            }
            const double watts = 1.0 + fabs(s[0].power.supplied) + fabs(s[0].power.dissipated);
            kt_worst_near(&power, s[k].power.supplied, s[0].power.supplied, 3e-14 * watts, "tree %d", k);
            kt_worst_near(&power, s[k].power.dissipated, s[0].power.dissipated, 3e-14 * watts, "tree %d", k);
            kt_worst_near(&energy, s[k].energy, s[0].energy, 1e-14 * (1.0 + fabs(s[0].energy)), "tree %d", k);
            int count = 0;
            for (int i = 0; i < EFFECTS; i++)
                count += kt_effect_quantity_count(s[0].model, i);
            for (int i = 0; i < count; i++)
                kt_worst_near(&quantity, s[k].quantity[i], s[0].quantity[i], 2e-14 * (10.0 + fabs(s[0].quantity[i])),
                              "%d of tree %d, %s of %s", i, k, s[0].coordinate, kt_joint_type_name(joints[type]));
        }
    }
}

/* ---- turns ------------------------------------------------------------------------------------------------------- */

/* One spring acts on the rocker's angle, one between coupler and rocker, the other way round in the other tree. The
 * mechanism is a drag link, whose bars all turn. If it is cut between coupler and rocker, the rocker's angle is that of
 * a joint. If it is cut at the rocker's pivot on the ground, the angle is that of a loop. Angles p of the bars against
 * the world. */
enum { BARS = 3, STEPS = 400 };
typedef struct drag_link {
    scene s;
    kt_body bar[BARS];
} drag_link;

static void describe_drag_link(drag_link *g, bool at_ground, const double p[BARS]) {
    static const double length[BARS] = {2.0, 2.2, 2.4};
    static const char *const names[] = {"crank", "coupler", "rocker"};
    begin(&g->s);
    for (int i = 0; i < BARS; i++) {
        g->bar[i] = body(names[i]);
        g->bar[i].joint.type = KT_JOINT_REVOLUTE;
        g->bar[i].joint.position[0] = p[i];
    }
    g->bar[0].joint.velocity[0] = at_ground ? 0.0 : 1.0;
    g->bar[1].parent = "crank";
    g->bar[1].joint.at.x = length[0];
    g->bar[1].joint.position[0] = p[1] - p[0];
    g->bar[2].joint.at.x = 1.0;
    g->s.loop[0] = loop("pin", KT_LOOP_REVOLUTE, "rocker", "coupler");
    g->s.loop[0].between[0].at.x = length[2];
    g->s.loop[0].between[1].at.x = length[1];
    if (at_ground) { /* the rocker's frame is at its pin on the ground, so its joint is at its other end */
        g->bar[2].parent = "coupler";
        g->bar[2].joint.at.x = length[1];
        g->bar[2].com.x -= length[2];
        g->bar[2].joint.position[0] = p[2] - p[1];
        g->s.loop[0] = loop("pin", KT_LOOP_REVOLUTE, NULL, "rocker");
        g->s.loop[0].between[0].at.x = 1.0;
        g->s.loop[0].between[1].at.x = -length[2];
    }
    g->s.description.bodies = g->bar;
    g->s.description.body_count = BARS;
    g->s.description.loop_count = 1;
    for (int i = 0; i < 2; i++) {
        g->s.effect[i] = kt_effect_of(KT_EFFECT_JOINT_SPRING, at_ground == (i == 0) ? "pin" : "rocker");
        g->s.effect[i].stiffness = 0.02;
    }
    g->s.description.effects = g->s.effect;
    g->s.description.effect_count = 2;
    compile(&g->s);
}

/* The acceleration; force, power, angle and its rate. */
static void measure(scene *s, const double *q) {
    kt_error e = {0};
    kt_need_fine("acceleration", kt_acceleration_evaluate(s->model, s->data, 0.0, q, s->v, NULL, NULL, s->a, &e), &e);
    kt_need_fine("kinematics", kt_kinematics_update(s->model, s->data, q, s->v, NULL, &e), &e);
    kt_need_fine("quantities", kt_effect_quantities_evaluate(s->model, s->data, 0.0, q, s->v, s->quantity, &e), &e);
}

static int place_of(const scene *s, const char *name) {
    return kt_body_coordinates(s->model, kt_body_find(s->model, name)).q;
}

KT_TEST(angles_of_loops_count_turns) {
    const double start[BARS] = {0.3, 1.2, 0.9}, turn = 2.0 * acos(-1.0);
    static drag_link cut[2];
    kt_error e = {0};
    KT_WORST angle = kt_worst_make("angle of the rocker"), force = kt_worst_make("torque of its spring"),
             motion = kt_worst_make("acceleration of the crank"), between = kt_worst_make("angle on the coupler");
    describe_drag_link(&cut[0], false, start);
    describe_drag_link(&cut[1], true, start);
    scene *joint = &cut[0].s, *pin = &cut[1].s;
    const int crank = place_of(joint, "crank"), coupler = place_of(joint, "coupler"),
              rocker = place_of(joint, "rocker");
    double first = 0.0, last = 0.0;
    bool changed;
    kt_need_fine("assembly", kt_state_assemble(joint->model, joint->data, 0.0, joint->q, joint->v, &e), &e);
    for (int step = 0; step <= STEPS; step++) {
        double *q = joint->q;
        pin->q[place_of(pin, "crank")] = q[crank];
        pin->q[place_of(pin, "coupler")] = q[coupler];
        pin->q[place_of(pin, "rocker")] = q[rocker] - q[crank] - q[coupler];
        const double *v = joint->v;
        pin->v[place_of(pin, "crank")] = v[crank];
        pin->v[place_of(pin, "coupler")] = v[coupler];
        pin->v[place_of(pin, "rocker")] = v[rocker] - v[crank] - v[coupler];
        measure(joint, q);
        measure(pin, pin->q);
        kt_worst_near(&motion, pin->a[place_of(pin, "crank")], joint->a[crank], 1e-13, "step %d", step);
        kt_worst_near(&angle, pin->quantity[2], q[rocker], 64.0 * DBL_EPSILON * (1.0 + fabs(q[rocker])), "step %d",
                      step);
        kt_worst_near(&between, pin->quantity[6], -joint->quantity[6], 64.0 * DBL_EPSILON * (1.0 + fabs(q[rocker])),
                      "step %d", step);
        kt_worst_near(&force, pin->quantity[0], joint->quantity[0], 64.0 * DBL_EPSILON, "step %d", step);
        first = step == 0 ? q[rocker] : first;
        last = q[rocker];
        q[crank] += 0.05; /* the others follow */
        q[rocker] += 0.05;
        kt_need_fine("projection", kt_state_project(joint->model, joint->data, 0.0, q, joint->v, &changed, &e), &e);
    }
    kt_check_above("turns of the rocker", fabs(last - first) / turn, 2.0);
}

/* A mast of two hinges and an arm that is pinned to its top, by a loop or by a hinge. The spring acts on the pin's
 * angle. The upper hinge is parallel to the pin, and the lower one is tilted, so that no sum of angles is
 * the pin's angle. */
static void describe_tilted_mast(drag_link *g, bool by_loop) {
    static const char *const names[] = {"foot", "top", "arm"};
    begin(&g->s);
    for (int i = 0; i < BARS; i++) {
        g->bar[i] = body(names[i]);
        g->bar[i].parent = i > 0 ? names[i - 1] : NULL;
        g->bar[i].joint.type = KT_JOINT_REVOLUTE;
        g->bar[i].joint.at.x = i > 0 ? 0.8 : 0.0;
    }
    g->bar[0].joint.axis = kt_vec3_make(0.1, 0.0, 1.0);
    if (by_loop) { /* at angles of zero, only the axes of the first hinge are turned */
        g->bar[2].parent = NULL;
        free_at(&g->bar[2].joint, (kt_pose){.position = {1.6, 0.0, 0.0}, .rotation = kt_pose_identity().rotation},
                (kt_twist){.angular = {0}});
        g->s.loop[0] = loop("pin", KT_LOOP_REVOLUTE, "top", "arm");
        g->s.loop[0].between[0].at.x = 0.8;
    }
    g->s.description.bodies = g->bar;
    g->s.description.body_count = BARS;
    g->s.description.loop_count = by_loop;
    g->s.effect[0] = kt_effect_of(KT_EFFECT_JOINT_SPRING, by_loop ? "pin" : "arm");
    g->s.effect[0].stiffness = 2.0;
    g->s.effect[0].rest = kt_function_constant(0.4);
    g->s.description.effects = g->s.effect;
    g->s.description.effect_count = 1;
    compile(&g->s);
}

KT_TEST(angles_of_loops_count_no_turns_below_a_tilted_joint) {
    static drag_link cut[2];
    KT_WORST motion = kt_worst_make("acceleration of the mast");
    describe_tilted_mast(&cut[0], false);
    describe_tilted_mast(&cut[1], true);
    scene *joint = &cut[0].s, *pin = &cut[1].s;
    measure(joint, joint->q);
    measure(pin, pin->q);
    for (int i = 0; i < 2; i++)
        kt_worst_near(&motion, pin->a[place_of(pin, i ? "top" : "foot")], joint->a[place_of(joint, i ? "top" : "foot")],
                      1e-12, "hinge %d", i);
    kt_check_near("torque of the spring", pin->quantity[0], joint->quantity[0], 1e-14);
}
