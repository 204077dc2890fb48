/* Graphs of bodies and joints: motions against the same bodies on free joints, in which all joints are loops, and
 * against trees by hand; positions of joints that close loops against the same joints in a tree; sizes of groups
 * against those of other trees; and what is rejected. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

#include "kinetree/build.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { BODIES = 6, JOINTS = 9 };

/* A closed mechanism: bodies at random poses, and joints whose frames coincide there. */
typedef struct net {
    int body_count, joint_count;
    char name[BODIES][8], joint_name[JOINTS][8];
    kt_body body[BODIES];
    kt_pose pose[BODIES + 1]; /* of the world, then of the bodies */
    kt_graph_joint joint[JOINTS];
} net;

static void release_builder(void *builder) { kt_builder_free(builder); }

static kt_builder *own_builder(void) {
    kt_builder *builder = NULL;
    kt_error error = {0};
    kt_need_fine("builder", kt_builder_create(&builder, &error), &error);
    kt_test_own(builder, release_builder);
    return builder;
}

static kt_rotation rotation_of(kt_mat3 matrix) { return kt_rotation_matrix(matrix); }

static kt_pose random_pose(kt_random *random, bool is_planar) {
    double axis[3];
    kt_random_direction(random, 3, axis);
    const double angle = kt_random_uniform(random, -3.0, 3.0);
    const kt_vec3 turn =
        is_planar ? kt_vec3_make(0.0, 0.0, angle) : kt_vec3_scale(angle, kt_vec3_make(axis[0], axis[1], axis[2]));
    kt_pose pose = {.rotation = kt_mat3_from_euler_vector(turn)};
    pose.position.x = kt_random_uniform(random, -1.0, 1.0);
    pose.position.y = kt_random_uniform(random, -1.0, 1.0);
    pose.position.z = is_planar ? 0.0 : kt_random_uniform(random, -1.0, 1.0);
    return pose;
}

static kt_end end_at(const net *n, int body, kt_pose pose) {
    const kt_pose local = kt_pose_compose(kt_pose_invert(n->pose[body]), pose);
    kt_end end = kt_end_default();
    end.body = body > 0 ? n->name[body - 1] : NULL;
    end.at = local.position;
    end.rotation = rotation_of(local.rotation);
    return end;
}

static void add_joint(net *n, kt_random *random, int a, int b, kt_joint_type type, bool is_planar) {
    const int i = n->joint_count++;
    const kt_pose pose = random_pose(random, is_planar);
    n->joint[i] = kt_graph_joint_default();
    (void)snprintf(n->joint_name[i], sizeof n->joint_name[i], "j%d", i);
    n->joint[i].joint.name = n->joint_name[i];
    n->joint[i].joint.type = type;
    n->joint[i].joint.pitch = 0.1;
    if (is_planar && type == KT_JOINT_PRISMATIC)
        n->joint[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    const bool turned = kt_random_int(random, 0, 1) == 1;
    n->joint[i].between[turned] = end_at(n, a, pose);
    n->joint[i].between[!turned] = end_at(n, b, pose);
}

static void make_net(net *n, kt_random *random, bool is_planar) {
    static const kt_joint_type in_space[] = {KT_JOINT_REVOLUTE,    KT_JOINT_SPHERICAL, KT_JOINT_UNIVERSAL,
                                             KT_JOINT_CYLINDRICAL, KT_JOINT_SCREW,     KT_JOINT_PLANAR,
                                             KT_JOINT_PRISMATIC,   KT_JOINT_FIXED},
                               closing[] = {KT_JOINT_SPHERICAL, KT_JOINT_PLANAR, KT_JOINT_CYLINDRICAL,
                                            KT_JOINT_UNIVERSAL};
    *n = (net){.body_count = kt_random_int(random, 3, BODIES), .pose[0] = kt_pose_identity()};
    for (int i = 0; i < n->body_count; i++) {
        (void)snprintf(n->name[i], sizeof n->name[i], "b%d", i);
        n->pose[i + 1] = random_pose(random, is_planar);
        n->body[i] = kt_body_default();
        n->body[i].name = n->name[i];
        n->body[i].mass = kt_random_uniform(random, 1.0, 3.0);
        n->body[i].com = kt_vec3_make(kt_random_uniform(random, -0.2, 0.2), kt_random_uniform(random, -0.2, 0.2), 0.0);
        n->body[i].inertia = kt_sym3_make(0.1, 0.12, 0.15, 0.0, 0.0, 0.0);
    }
    for (int i = 0; i < n->body_count; i++) {
        const kt_joint_type type = is_planar
                                       ? (kt_random_int(random, 0, 4) == 0 ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE)
                                       : in_space[kt_random_int(random, 0, 7)];
        add_joint(n, random, kt_random_int(random, 0, i), i + 1, type, is_planar);
    }
    const int loops = kt_random_int(random, 1, is_planar ? n->body_count / 3 : 3);
    for (int i = 0; i < loops; i++) {
        const int a = kt_random_int(random, 0, n->body_count), b = kt_random_int(random, 1, n->body_count);
        if (a != b)
            add_joint(n, random, a, b, is_planar ? KT_JOINT_REVOLUTE : closing[kt_random_int(random, 0, 3)], is_planar);
    }
}

static kt_model *compile_net(const kt_description *parts) {
    kt_description description = *parts;
    description.gravity = kt_vec3_make(0.3, -9.81, 0.2);
    return kt_test_model(&description, NULL);
}

static kt_model *model_of_graph(const net *n, kt_graph_choice *choices) {
    kt_builder *builder = own_builder();
    kt_error error = {0};
    kt_need_fine("graph",
                 kt_builder_add_graph(builder, n->body, n->body_count, n->joint, n->joint_count, choices, &error),
                 &error);
    const kt_description parts = kt_builder_describe(builder);
    return compile_net(&parts);
}

/* ---- motions ----------------------------------------------------------------------------------------------------- */

static void settle_run(kt_run *run) {
    *run = kt_run_default();
    run->integrator = "dop853";
    run->relative = run->absolute = 1e-12;
    run->record = KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_CLOSURE | KT_RECORD_ENERGY;
}

static kt_record sense(kt_simulation *simulation) {
    kt_record record = {0};
    kt_error error = {0};
    kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
    return record;
}

/* The same bodies, each on a free joint, with all joints as loops: no tree, no frame and no reversal has a part. */
static kt_model *model_of_loops(const net *n) {
    static const kt_loop_type types[KT_JOINT_TYPE_COUNT] = {
        [KT_JOINT_FIXED] = KT_LOOP_WELD,
        [KT_JOINT_REVOLUTE] = KT_LOOP_REVOLUTE,
        [KT_JOINT_PRISMATIC] = KT_LOOP_PRISMATIC,
        [KT_JOINT_SCREW] = KT_LOOP_SCREW,
        [KT_JOINT_CYLINDRICAL] = KT_LOOP_CYLINDRICAL,
        [KT_JOINT_PLANAR] = KT_LOOP_PLANAR,
        [KT_JOINT_UNIVERSAL] = KT_LOOP_UNIVERSAL,
        [KT_JOINT_SPHERICAL] = KT_LOOP_SPHERICAL,
    };
    kt_builder *builder = own_builder();
    kt_error error = {0};
    for (int i = 0; i < n->body_count; i++) {
        kt_body body = n->body[i];
        const kt_quat q = kt_quat_from_mat3(n->pose[i + 1].rotation);
        const kt_vec3 p = n->pose[i + 1].position;
        const double position[] = {p.x, p.y, p.z, q.w, q.x, q.y, q.z};
        body.joint.type = KT_JOINT_FREE;
        memcpy(body.joint.position, position, sizeof position);
        kt_need_fine("body", kt_builder_add_body(builder, &body, &error), &error);
    }
    for (int i = 0; i < n->joint_count; i++) {
        const kt_graph_joint *j = &n->joint[i];
        kt_loop loop = kt_loop_of(j->joint.name, types[j->joint.type]);
        memcpy(loop.between, j->between, sizeof loop.between);
        loop.axis = j->joint.axis;
        loop.pitch = j->joint.pitch;
        if (loop.type == KT_LOOP_UNIVERSAL)
            loop.axis2 = kt_vec3_make(1.0, 0.0, 0.0); /* the axis after z */
        kt_need_fine("loop", kt_builder_add_loop(builder, &loop, &error), &error);
    }
    const kt_description parts = kt_builder_describe(builder);
    return compile_net(&parts);
}

static double pose_distance(kt_pose a, kt_pose b) {
    const kt_vec3 turn = kt_euler_vector_from_mat3(kt_mat3_multiply(kt_mat3_transpose(a.rotation), b.rotation));
    return fmax(kt_vec3_norm(kt_vec3_sub(a.position, b.position)), kt_vec3_norm(turn));
}

static void check_random_net(kt_random *random, int k, kt_worst *error, kt_worst *way, int *moving, int *reversed) {
    net n;
    kt_run run;
    kt_graph_choice choices[JOINTS];
    make_net(&n, random, k % 2 == 0);
    settle_run(&run);
    const kt_model *graph = model_of_graph(&n, choices), *loops = model_of_loops(&n);
    kt_simulation *a = kt_test_simulation(graph, &run, NULL), *b = kt_test_simulation(loops, &run, NULL);
    kt_test_advance(a, 0.3);
    kt_test_advance(b, 0.3);
    const kt_record at = sense(a), bt = sense(b);
    double far = 0.0;
    for (int i = 0; i < n.body_count; i++) {
        const kt_pose p = kt_body_pose(graph, at.data, kt_body_find(graph, n.name[i]));
        const kt_pose q = kt_body_pose(loops, bt.data, kt_body_find(loops, n.name[i]));
        kt_worst_below(error, pose_distance(p, q), 1e-10, "graph %d body %d", k, i);
        far = fmax(far, pose_distance(p, n.pose[i + 1]));
    }
    *moving += far > 0.01;
    for (int i = 0; i < n.joint_count; i++)
        *reversed += choices[i].is_reversed;
    kt_worst_near(way, kt_model_mobility(graph).minimal, kt_model_mobility(loops).minimal, 0.0, "graph %d", k);
}

/* The long tier adds graphs. */
KT_TEST(random_graphs_move_as_bodies_whose_joints_are_all_loops) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("poses after 0.3 s"), way = kt_worst_make("degrees of freedom");
    int moving = 0, reversed = 0;
    const int count = kt_sample(KT_SHORT(25, 100));
    for (int k = 0; k < count; k++)
        check_random_net(&random, k, &error, &way, &moving, &reversed);
    kt_check_above("graphs that move", moving, 0.5 * count);
    kt_check_above("reversed joints", reversed, 0.5 * count);
}

/* ---- positions of joints that close loops ------------------------------------------------------------------------ */

/* The coordinates of a joint: those of a body, or those of a loop. Returns their number. */
static int coordinates_of(const kt_model *model, const kt_record *record, const char *joint, double *q, double *v) {
    const int loop = kt_loop_find(model, joint);
    kt_error ignored;
    int body = 0;
    if (loop >= 0)
        return kt_loop_coordinates_evaluate(model, record->data, loop, record->q, q, v)
                   ? kt_loop_coordinates(model, loop).nq
                   : -1;
    kt_need(kt_check_true(joint, kt_joint_find(model, joint, &body, &ignored) == KT_OK));
    const kt_coordinates at = kt_body_coordinates(model, body);
    memcpy(q, record->q + at.q, (size_t)at.nq * sizeof *q);
    memcpy(v, record->v + at.v, (size_t)at.nv * sizeof *v);
    return at.nq;
}

/* Whether a joint with several coordinates is reversed in one tree alone: it then has other coordinates. */
static bool differs_in_sense(const net *n, int i, const kt_graph_choice *a, const kt_graph_choice *b) {
    const kt_joint_type type = n->joint[i].joint.type;
    const bool may = type == KT_JOINT_UNIVERSAL || type == KT_JOINT_SPHERICAL || type == KT_JOINT_PLANAR;
    return may && (a[i].body != NULL && a[i].is_reversed) != (b[i].body != NULL && b[i].is_reversed);
}

static void compare_positions(kt_random *random, int k, kt_worst *position, kt_worst *velocity, int *compared) {
    net n;
    kt_run run;
    kt_graph_choice first[JOINTS], second[JOINTS];
    make_net(&n, random, k % 2 == 0);
    settle_run(&run);
    const kt_model *a = model_of_graph(&n, first);
    for (int i = 0; i < n.joint_count; i++)
        n.joint[i].is_coordinate = first[i].body == NULL;
    const kt_model *b = model_of_graph(&n, second);
    kt_simulation *sa = kt_test_simulation(a, &run, NULL), *sb = kt_test_simulation(b, &run, NULL);
    kt_test_advance(sa, 0.3);
    kt_test_advance(sb, 0.3);
    const kt_record ra = sense(sa), rb = sense(sb);
    for (int i = 0; i < n.joint_count; i++) {
        double qa[KT_JOINT_NQ_MAX], qb[KT_JOINT_NQ_MAX], va[KT_JOINT_NV_MAX], vb[KT_JOINT_NV_MAX];
        if ((first[i].body == NULL) == (second[i].body == NULL) || differs_in_sense(&n, i, first, second))
            continue;
        const int nq = coordinates_of(a, &ra, n.joint_name[i], qa, va);
        kt_need(kt_check_equal_int("coordinates", coordinates_of(b, &rb, n.joint_name[i], qb, vb), nq));
        const double sign = nq == 4 && qa[0] * qb[0] < 0.0 ? -1.0 : 1.0; /* both quaternions are one rotation */
        for (int c = 0; c < nq; c++)
            kt_worst_near(position, qa[c], sign * qb[c], 1e-11, "graph %d joint %d [%d]", k, i, c);
        for (int c = 0; c < nq - (nq == 4); c++)
            kt_worst_near(velocity, va[c], vb[c], 1e-10, "graph %d joint %d [%d]", k, i, c);
        (*compared)++;
    }
}

KT_TEST(joints_that_close_loops_have_the_coordinates_of_joints_in_a_tree) {
    kt_random random = kt_random_of_test();
    KT_WORST position = kt_worst_make("positions"), velocity = kt_worst_make("velocities");
    int compared = 0;
    const int count = kt_sample(60);
    for (int k = 0; k < count; k++)
        compare_positions(&random, k, &position, &velocity, &compared);
    kt_check_above("compared joints", compared, 0.5 * count);
}

/* A four-bar linkage whose crank turns 20 times: the angle of the cut joint counts the turns. */
KT_TEST(a_joint_that_closes_a_loop_counts_its_turns) {
    static const char *const names[] = {"crank", "rod", "rocker"};
    const kt_vec3 ends[4] = {{0.0, 0.0, 0.0}, {0.3, 0.0, 0.0}, {1.0, 0.6, 0.0}, {1.0, 0.0, 0.0}};
    kt_body body[3];
    kt_graph_joint joint[4];
    kt_model *model[2];
    double q[2][KT_JOINT_NQ_MAX], v[KT_JOINT_NV_MAX];
    kt_run run;
    for (int i = 0; i < 3; i++) {
        body[i] = kt_body_default();
        body[i].name = names[i];
        body[i].mass = 1.0;
        body[i].inertia = kt_sym3_make(0.1, 0.1, 0.1, 0.0, 0.0, 0.0);
    }
    for (int i = 0; i < 4; i++) {
        static const char *const joints[] = {"A", "B", "C", "D"};
        joint[i] = kt_graph_joint_default();
        joint[i].joint.name = joints[i];
        joint[i].joint.type = KT_JOINT_REVOLUTE;
        joint[i].between[0].body = i > 0 ? names[i - 1] : NULL;
        joint[i].between[1].body = i < 3 ? names[i] : NULL;
        joint[i].between[0].at = joint[i].between[1].at = ends[i];
    }
    joint[0].joint.velocity[0] = 1.0; /* given, so that the crank is a coordinate of both trees */
    for (int k = 0; k < 2; k++) {
        joint[1].is_coordinate = k == 1;
        joint[2].is_coordinate = k == 0;
        joint[3].is_coordinate = true;
        kt_builder *builder = own_builder();
        kt_error error = {0};
        kt_graph_choice choices[4];
        kt_need_fine("graph", kt_builder_add_graph(builder, body, 3, joint, 4, choices, &error), &error);
        kt_check_true("B or C is cut", choices[1 + (k == 1)].body == NULL);
        const kt_description parts = kt_builder_describe(builder);
        model[k] = kt_test_model(&parts, NULL);
        settle_run(&run);
        kt_simulation *simulation = kt_test_simulation(model[k], &run, NULL);
        kt_test_advance(simulation, 120.0);
        const kt_record record = sense(simulation);
        kt_check_equal_int("one coordinate", coordinates_of(model[k], &record, "B", q[k], v), 1);
    }
    kt_check_above("turns of the joint between crank and rod", fabs(q[1][0]) / 6.283185307179586, 10.0);
    kt_check_near("its angle", q[0][0], q[1][0], 1e-7); /* 20 turns at 1e-12 a step */
}

/* ---- start values ------------------------------------------------------------------------------------------------ */

/* A tree, whose joints start at given positions and velocities: against the poses that follow from them by hand. */
KT_TEST(given_starts_are_those_of_the_joints) {
    static const kt_joint_type types[] = {KT_JOINT_REVOLUTE, KT_JOINT_PRISMATIC, KT_JOINT_SCREW, KT_JOINT_SPHERICAL,
                                          KT_JOINT_UNIVERSAL};
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("poses"), twist = kt_worst_make("angular velocities");
    for (int k = 0; k < 40; k++) {
        net n = {.body_count = 1, .pose = {kt_pose_identity(), random_pose(&random, false)}};
        const kt_joint_type type = types[k % 5];
        kt_graph_choice choice;
        double axis[4], rate[3];
        strcpy(n.name[0], "b");
        n.body[0] = kt_body_of(n.name[0], NULL, KT_JOINT_FIXED, 1.0);
        n.body[0].inertia = kt_sym3_make(0.1, 0.1, 0.1, 0.0, 0.0, 0.0);
        add_joint(&n, &random, 0, 1, type, false);
        kt_joint *joint = &n.joint[0].joint;
        kt_random_direction(&random, 4, axis);
        kt_random_direction(&random, 3, rate);
        memcpy(joint->position, axis,
               (type == KT_JOINT_SPHERICAL   ? 4
                : type == KT_JOINT_UNIVERSAL ? 2
                                             : 1) *
                   sizeof *axis);
        memcpy(joint->velocity, rate,
               (type == KT_JOINT_SPHERICAL   ? 3
                : type == KT_JOINT_UNIVERSAL ? 2
                                             : 1) *
                   sizeof *rate);
        const kt_model *model = model_of_graph(&n, &choice);
        /* by hand: from the first end's frame to the second's */
        kt_mat3 turn = kt_mat3_identity();
        kt_vec3 way = {0.0, 0.0, 0.0}, omega = {0.0, 0.0, 0.0};
        if (type == KT_JOINT_SPHERICAL) {
            turn = kt_mat3_from_quat(kt_quat_make(axis[0], axis[1], axis[2], axis[3]));
            omega = kt_mat3_apply(turn, kt_vec3_make(rate[0], rate[1], rate[2]));
        } else if (type == KT_JOINT_UNIVERSAL) {
            const kt_mat3 first = kt_mat3_about(2, axis[0]);
            turn = kt_mat3_multiply(first, kt_mat3_about(0, axis[1]));
            omega = kt_vec3_add(kt_vec3_make(0.0, 0.0, rate[0]), kt_vec3_scale(rate[1], first.x));
        } else {
            if (type != KT_JOINT_PRISMATIC) {
                turn = kt_mat3_about(2, axis[0]);
                omega.z = rate[0];
            }
            way.z = type == KT_JOINT_REVOLUTE ? 0.0 : (type == KT_JOINT_SCREW ? 0.1 : 1.0) * axis[0];
        }
        const kt_pose moved = {.rotation = turn, .position = way};
        kt_pose end[2];
        for (int e = 0; e < 2; e++) {
            end[e].position = n.joint[0].between[e].at;
            (void)(kt_rotation_evaluate(&n.joint[0].between[e].rotation, &end[e].rotation, NULL) == KT_OK);
        }
        /* P J = X C if the body is at the second end; X C J = P if it is at the first */
        const bool is_first = n.joint[0].between[0].body != NULL;
        const kt_pose expected =
            is_first ? kt_pose_compose(kt_pose_compose(end[1], kt_pose_invert(moved)), kt_pose_invert(end[0]))
                     : kt_pose_compose(kt_pose_compose(end[0], moved), kt_pose_invert(end[1]));
        kt_data *data = kt_test_data(model);
        double q[8], v[8];
        kt_error e = {0};
        kt_model_initial(model, q, v);
        kt_need_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &e), &e);
        const int b = kt_body_find(model, "b");
        kt_worst_below(&error, pose_distance(kt_body_pose(model, data, b), expected), 1e-14, "case %d", k);
        const kt_vec3 w = kt_body_twist(model, data, b).angular;
        const kt_vec3 by_hand =
            is_first ? kt_vec3_scale(-1.0, kt_mat3_apply(end[1].rotation, kt_mat3_apply_transposed(turn, omega)))
                     : kt_mat3_apply(end[0].rotation, omega);
        kt_worst_below(&twist, kt_vec3_norm(kt_vec3_sub(w, by_hand)), 1e-14, "case %d", k);
    }
}

/* ---- the choice -------------------------------------------------------------------------------------------------- */

static int group_size(const kt_model *model) {
    int size = 0;
    for (int g = 0; g < kt_loop_group_count(model); g++) {
        const kt_loop_group group = kt_loop_group_at(model, g);
        size += group.coordinates + group.equations;
    }
    return size;
}

/* Other trees of the same graph are those of random preferences. */
KT_TEST(no_other_tree_has_smaller_groups) {
    kt_random random = kt_random_of_test();
    KT_WORST size = kt_worst_make("coordinates and equations of groups, over the least of others");
    int larger = 0;
    for (int k = 0; k < 20; k++) {
        net n;
        int least = 1000;
        make_net(&n, &random, false);
        const int own = group_size(model_of_graph(&n, NULL));
        for (int other = 0; other < 20; other++) {
            for (int i = 0; i < n.joint_count; i++)
                n.joint[i].is_coordinate = kt_random_int(&random, 0, 1) == 1;
            const int found = group_size(model_of_graph(&n, NULL));
            least = found < least ? found : least;
            larger += found > own;
        }
        kt_worst_below(&size, own, least, "graph %d", k);
    }
    kt_check_above("trees with larger groups", larger, 20.0);
}

/* ---- what is rejected -------------------------------------------------------------------------------------------- */

static void check_fault(const char *what, net *n, const char *where, const char *message) {
    kt_builder *builder = own_builder();
    kt_error error = {0};
    const kt_status status =
        kt_builder_add_graph(builder, n->body, n->body_count, n->joint, n->joint_count, NULL, &error);
    kt_check_equal_int(what, status, KT_ERROR_MODEL);
    kt_check_text(what, error.where, where);
    kt_check_contains(what, error.message, message);
    kt_check_equal_int("bodies of the builder", kt_builder_describe(builder).body_count, 0);
}

/* Two bodies, the second on the first. */
static net two_bodies(kt_random *random) {
    net n = {.body_count = 2, .pose = {kt_pose_identity(), random_pose(random, false), random_pose(random, false)}};
    for (int i = 0; i < 2; i++) {
        (void)snprintf(n.name[i], sizeof n.name[i], "b%d", i);
        n.body[i] = kt_body_of(NULL, NULL, KT_JOINT_FIXED, 1.0);
    }
    return n;
}

KT_TEST(faults_of_graphs_name_the_joint_or_the_body) {
    kt_random random = kt_random_of_test();
    for (int k = 0; k < 8; k++) {
        net n = two_bodies(&random);
        n.body[0].name = n.name[0];
        n.body[1].name = n.name[1];
        add_joint(&n, &random, 0, 1, KT_JOINT_REVOLUTE, false);
        add_joint(&n, &random, 1, 2, KT_JOINT_REVOLUTE, false);
        n.joint[0].joint.name = "a";
        n.joint[1].joint.name = "b";
        switch (k) {
        case 0:
            n.joint_count = 1;
            check_fault("an isolated body", &n, "body 'b1'", "no joint connects this body with the world");
            break;
        case 1:
            n.joint[1].between[0].body = "c";
            check_fault("an unknown body", &n, "joint 'b'", "body 'c' does not exist");
            break;
        case 2:
            n.joint[1].between[1].marker = "tip";
            check_fault("an unknown marker", &n, "joint 'b'", "no marker 'tip'");
            break;
        case 3:
            n.joint[1].joint.axis = kt_vec3_make(0.0, 0.0, 0.0);
            check_fault("no axis", &n, "joint 'b'", "the axis is zero");
            break;
        case 4:
            n.joint[1].joint.name = "a";
            check_fault("one name", &n, "joint 'a'", "another joint has this name");
            break;
        case 5:
            n.joint[1].between[0] = n.joint[1].between[1];
            check_fault("one body", &n, "joint 'b'", "both ends are on one body");
            break;
        case 6:
            n.joint[1].joint.at.x = 1.0;
            check_fault("a place", &n, "joint 'b'", "the first end gives the joint frame");
            break;
        default:
            n.body[1].parent = n.name[0];
            n.joint[0].between[n.joint[0].between[1].body != NULL].body = n.name[1];
            n.joint_count = 1;
            check_fault("a body below its parent", &n, "joint 'a'", "below its parent");
        }
    }
}
