/* Every lower pair as a loop against the same pair as a tree joint: one motion.
 *
 * An arm turns about an oblique axis on a pivot, and a bob moves on the arm, under gravity. Both are eccentric and have
 * products of inertia. In one model, the bob's joint is a joint of the tree. In the other one, it is a closure between
 * the arm and a free bob, from the same pose and twist. The first end is at the joint's place on the arm, in the joint
 * frame; the second is the bob's frame. The promised difference is below 1e-9; over a second, it consists of rounding
 * alone.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion/simulation/scenes.h"

#include "kinetree/study.h"

#include <math.h>
#include <stdio.h>

enum { RECORDS = 21 };

typedef struct pair {
    kt_joint_type joint;
    kt_loop_type loop;
} pair;

/* Three times the largest difference that was measured; m, m/s, rad/s. */
static const double bound = 1e-13;

static const kt_vec3 oblique = {0.3, -0.5, 0.8};

static kt_body make_body(const char *name, const char *parent) {
    kt_body body = kt_body_default();
    body.name = name;
    body.parent = parent;
    body.mass = 1.5;
    body.com = kt_vec3_make(0.2, -0.3, 0.15);
    body.inertia = kt_sym3_make(0.3, 0.4, 0.5, 0.03, -0.05, 0.02);
    return body;
}

typedef struct scene {
    kt_body bodies[2];
    kt_loop loop;
    kt_description description;
} scene;

/* With the bob's joint in the tree. */
static void make_tree(const pair *p, scene *s) {
    s->bodies[0] = make_body("arm", NULL);
    s->bodies[0].joint.type = KT_JOINT_REVOLUTE;
    s->bodies[0].joint.axis = kt_vec3_make(1.0, 2.0, 0.5);
    s->bodies[0].joint.position[0] = 0.4;
    s->bodies[0].joint.velocity[0] = 1.2;
    s->bodies[1] = make_body("bob", "arm");
    kt_joint *joint = &s->bodies[1].joint;
    joint->type = p->joint;
    joint->axis = oblique;
    joint->axis2 = kt_triad_from_axis(kt_vec3_normalize(oblique), 2).y;
    joint->pitch = 0.2;
    joint->at = kt_vec3_make(0.5, -0.4, 0.3);
    joint->rotation = kt_rotation_rpy(0.4, -0.7, 1.1);
    for (int i = 0; i < 7; i++)
        joint->position[i] = 0.3 - 0.2 * i;
    for (int i = 0; i < 6; i++)
        joint->velocity[i] = 0.9 - 0.5 * i;
    if (p->joint == KT_JOINT_SPHERICAL) {
        const kt_quat q = kt_quat_normalize(kt_quat_make(0.3, 0.1, -0.1, -0.3));
        joint->position[0] = q.w, joint->position[1] = q.x, joint->position[2] = q.y, joint->position[3] = q.z;
    }
    s->description = kt_description_default();
    s->description.gravity = kt_vec3_make(1.0, -2.0, -9.0);
    kt_describe(&s->description, s->bodies, 2, NULL, 0, NULL, 0);
}

/* The same, the bob free where the tree has it, and held by a loop. The angle of a screw's closure counts from the
 * initial one, so its end on the bob lies where the thread begins. */
static void make_loop(const pair *p, const scene *tree, kt_pose pose, kt_twist twist, scene *s) {
    const kt_joint *joint = &tree->bodies[1].joint;
    const kt_quat q = kt_quat_from_mat3(pose.rotation);
    const kt_vec3 w = kt_mat3_apply_transposed(pose.rotation, twist.angular);
    const double position[7] = {pose.position.x, pose.position.y, pose.position.z, q.w, q.x, q.y, q.z};
    const double velocity[6] = {twist.linear.x, twist.linear.y, twist.linear.z, w.x, w.y, w.z};
    *s = *tree;
    s->description.bodies = s->bodies;
    s->description.loops = &s->loop;
    s->description.loop_count = 1;
    s->bodies[1].parent = NULL;
    s->bodies[1].joint = kt_joint_default();
    s->bodies[1].joint.type = KT_JOINT_FREE;
    for (int i = 0; i < 7; i++)
        s->bodies[1].joint.position[i] = position[i];
    for (int i = 0; i < 6; i++)
        s->bodies[1].joint.velocity[i] = velocity[i];
    s->loop = kt_loop_of("pair", p->loop);
    s->loop.axis = oblique;
    s->loop.axis2 = joint->axis2;
    s->loop.pitch = joint->pitch;
    s->loop.between[0] = s->loop.between[1] = kt_end_default();
    s->loop.between[0].body = "arm";
    s->loop.between[0].at = joint->at;
    s->loop.between[0].rotation = joint->rotation;
    s->loop.between[1].body = "bob";
    if (p->loop == KT_LOOP_SCREW)
        s->loop.between[1].at = kt_vec3_scale(-joint->pitch * joint->position[0], kt_vec3_normalize(oblique));
}

static void swap_ends(kt_loop *loop) {
    const kt_end end = loop->between[0];
    const kt_vec3 axis = loop->axis;
    loop->between[0] = loop->between[1];
    loop->between[1] = end;
    if (loop->type == KT_LOOP_UNIVERSAL) {
        loop->axis = loop->axis2;
        loop->axis2 = axis;
    }
}

/* ---- motion ------------------------------------------------------------------------------------------------------ */

typedef struct trace {
    const kt_model *model;
    int count;
    kt_pose pose[RECORDS][2];
    kt_twist twist[RECORDS][2];
} trace;

static int keep(const kt_record *record, void *user) {
    trace *t = user;
    for (int k = 0; k < 2; k++) {
        const int body = kt_body_find(t->model, k ? "bob" : "arm");
        t->pose[t->count][k] = kt_body_pose(t->model, record->data, body);
        t->twist[t->count][k] = kt_body_twist(t->model, record->data, body);
    }
    t->count++;
    return 0;
}

/* A second in steps so short that only rounding is left. */
static bool run_for_a_second(const scene *s, const kt_model_options *options, trace *t) {
    kt_run run = kt_run_fixed("dop853", 0.01, 1.0);
    kt_simulation_options more = kt_simulation_options_default();
    kt_model *model = kt_test_model(&s->description, options);
    kt_error error;
    run.interval = 0.05;
    more.kinematics = true;
    *t = (trace){.model = NULL};
    t->model = model;
    kt_simulation *simulation = kt_test_simulation(model, &run, &more);
    (void)kt_fine("run", kt_simulation_run(simulation, keep, t, &error), &error);
    return t->count == RECORDS;
}

static double distance(kt_vec3 a, kt_vec3 b) { return kt_vec3_norm(kt_vec3_sub(a, b)); }

static double difference(const trace *a, const trace *b, int i, int k) {
    const kt_pose *p = &a->pose[i][k], *q = &b->pose[i][k];
    double most = distance(p->position, q->position);
    most = fmax(most, distance(p->rotation.x, q->rotation.x));
    most = fmax(most, distance(p->rotation.y, q->rotation.y));
    most = fmax(most, distance(a->twist[i][k].linear, b->twist[i][k].linear));
    return fmax(most, distance(a->twist[i][k].angular, b->twist[i][k].angular));
}

static void compare(const pair *p, const trace *tree, const scene *s, const kt_model_options *options,
                    const char *what) {
    char text[80];
    trace loop;
    snprintf(text, sizeof text, "%s, %s", kt_loop_type_name(p->loop), what);
    KT_WORST error = kt_worst_make(text);
    if (run_for_a_second(s, options, &loop))
        for (int i = 0; i < RECORDS; i++)
            for (int k = 0; k < 2; k++)
                kt_worst_below(&error, difference(tree, &loop, i, k), bound, "record %d, body %d", i, k);
}

static void follow(const pair *p) {
    static const char *const names[] = {"qr", "partition", "svd"};
    kt_model_options options = kt_model_options_default();
    scene tree, loop;
    trace motion;
    make_tree(p, &tree);
    kt_need(kt_check_true("tree", run_for_a_second(&tree, &options, &motion)));
    make_loop(p, &tree, motion.pose[0][1], motion.twist[0][1], &loop);
    for (int r = 0; r < 3; r++) {
        options.reduction = kt_reduction_method_of((kt_reduction)r);
        compare(p, &motion, &loop, &options, names[r]);
    }
    options = kt_model_options_default();
    options.metric = KT_METRIC_MASS;
    compare(p, &motion, &loop, &options, "in the metric of mass");
    options = kt_model_options_default();
    swap_ends(&loop.loop);
    compare(p, &motion, &loop, &options, "ends exchanged");
}

KT_TEST(every_pair_as_a_loop_moves_as_the_joint_does) {
    static const pair pairs[] = {
        {KT_JOINT_FIXED, KT_LOOP_WELD},
        {KT_JOINT_REVOLUTE, KT_LOOP_REVOLUTE},
        {KT_JOINT_PRISMATIC, KT_LOOP_PRISMATIC},
        {KT_JOINT_SCREW, KT_LOOP_SCREW},
        {KT_JOINT_CYLINDRICAL, KT_LOOP_CYLINDRICAL},
        {KT_JOINT_PLANAR, KT_LOOP_PLANAR},
        {KT_JOINT_UNIVERSAL, KT_LOOP_UNIVERSAL},
        {KT_JOINT_SPHERICAL, KT_LOOP_SPHERICAL},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++)
        follow(&pairs[i]);
}
