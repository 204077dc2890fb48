/* Mechanisms written as robots. Read back, they have the same mass matrix, places and loops. The writer reports all
 * losses. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "folder.h"
#include "write_back.h"

#include "check.h"
#include "random.h"

#include "kinetree/import.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- writing and reading back ------------------------------------------------------------------------------------ */

typedef struct compiled {
    kt_model *model;
    kt_data *data;
    double *q, *v, *a, *matrix;
} compiled;

static bool compile(const kt_description *d, kt_vec3 gravity, compiled *c) {
    kt_error error = {0};
    kt_description tree = *d; /* loops do not change the mass matrix, and may not be closed at a random position */
    tree.loop_count = tree.effect_count = tree.hold_count = 0;
    tree.gravity = gravity;
    memset(c, 0, sizeof *c);
    if (kt_model_compile(&tree, NULL, &c->model, &error) != KT_OK ||
        kt_data_create(c->model, &c->data, &error) != KT_OK) {
        kt_note("%s: %s", error.where, error.message);
        return false;
    }
    const size_t nq = (size_t)kt_model_nq(c->model), nv = (size_t)kt_model_nv(c->model);
    c->q = calloc(nq + 2 * nv + nv * nv + 1, sizeof *c->q);
    if (c->q == NULL)
        return false;
    c->v = c->q + nq;
    c->a = c->v + nv;
    c->matrix = c->a + nv;
    return true;
}

static void release(compiled *c) {
    kt_data_free(c->data);
    kt_model_free(c->model);
    free(c->q);
}

/* The coordinates in the other model of each coordinate: of joints of their names, or, of one that has become several,
 * of NAME, NAME__1, NAME__2. Returns whether all are there. */
static bool map_coordinates(const compiled *from, const compiled *to, int *positions, int *velocities) {
    for (int b = 1; b < kt_model_body_count(from->model); b++) {
        const kt_coordinates c = kt_body_coordinates(from->model, b);
        for (int k = 0; k < c.nq; k++) {
            char name[200];
            const char *own = kt_joint_name(from->model, b);
            int other = body_of_joint(to->model, own);
            kt_coordinates there = other > 0 ? kt_body_coordinates(to->model, other) : (kt_coordinates){.nq = 0};
            int part = k;
            if (there.nq != c.nq) {
                (void)snprintf(name, sizeof name, k > 0 ? "%s__%d" : "%s", own, k);
                other = body_of_joint(to->model, name);
                part = 0;
            }
            if (other < 1)
                return false;
            there = kt_body_coordinates(to->model, other);
            positions[c.q + k] = there.q + part;
            if (k < c.nv)
                velocities[c.v + k] = there.v + part;
        }
    }
    return true;
}

static void random_position(const compiled *c, kt_random *random) {
    for (int b = 1; b < kt_model_body_count(c->model); b++) {
        const kt_coordinates at = kt_body_coordinates(c->model, b);
        double norm = 0.0;
        for (int k = 0; k < at.nq; k++)
            c->q[at.q + k] = kt_random_uniform(random, -1.0, 1.0);
        const int first = at.nq - 4;
        for (int k = first; k < at.nq && at.nq > at.nv; k++)
            norm += c->q[at.q + k] * c->q[at.q + k];
        for (int k = first; k < at.nq && at.nq > at.nv; k++)
            c->q[at.q + k] /= sqrt(norm);
        for (int k = 0; k < at.nv; k++)
            c->v[at.v + k] = kt_random_uniform(random, -1.0, 1.0);
    }
}

typedef struct findings {
    kt_worst mass, place, acceleration;
} findings;

static findings make_findings(void) {
    return (findings){kt_worst_make("mass matrix"), kt_worst_make("places, m"), kt_worst_make("accelerations")};
}

static void check_findings(const findings *f) {
    kt_check_worst(&f->mass);
    kt_check_worst(&f->place);
    kt_check_worst(&f->acceleration);
}

static kt_status compute(const compiled *c, kt_error *error) {
    kt_status status = kt_dynamics_mass(c->model, c->data, c->q, c->matrix, error);
    if (status == KT_OK)
        status = kt_dynamics_forward(c->model, c->data, c->q, c->v, NULL, NULL, c->a, error);
    return status == KT_OK ? kt_kinematics_update(c->model, c->data, c->q, c->v, NULL, error) : status;
}

/* Compares the places of bodies of the same name. A mechanism that is turned upright keeps the heights of its bodies,
 * along the gravity of each description, and their distances from the origin. */
static void compare_places(const compiled *ours, const compiled *theirs, bool is_turned, kt_worst *worst) {
    const kt_vec3 down = kt_vec3_normalize(kt_model_gravity(ours->model));
    double most = 1.0;
    for (int b = 1; b < kt_model_body_count(ours->model); b++)
        most = fmax(most, kt_vec3_norm(kt_body_pose(ours->model, ours->data, b).position));
    for (int b = 1; b < kt_model_body_count(ours->model); b++)
        for (int other = 1; other < kt_model_body_count(theirs->model); other++)
            if (strcmp(kt_body_name(ours->model, b), kt_body_name(theirs->model, other)) == 0) {
                const kt_vec3 x = kt_body_pose(ours->model, ours->data, b).position;
                const kt_vec3 y = kt_body_pose(theirs->model, theirs->data, other).position;
                const char *name = kt_body_name(ours->model, b);
                const double bound = 64.0 * DBL_EPSILON * most;
                if (is_turned) {
                    kt_worst_near(worst, -y.z, kt_vec3_dot(down, x), bound, "%s, height", name);
                    kt_worst_near(worst, kt_vec3_norm(y), kt_vec3_norm(x), bound, "%s, distance", name);
                } else {
                    kt_worst_near(worst, kt_vec3_norm(kt_vec3_sub(x, y)), 0.0, bound, "%s", name);
                }
            }
}

/* Moments and masses that MuJoCo rejects are raised to 1.5e-14 in URDF. The bound is 64 eps. It covers some ten
 * rotations and products of numbers that are rounded on the way into text and back. It also covers rpy of URDF close to
 * a pitch of a quarter turn. */
static void compare(const compiled *ours, const compiled *theirs, bool is_turned, kt_random *random, findings *f) {
    enum { COORDINATES = 256 };
    int positions[COORDINATES], velocities[COORDINATES];
    kt_error error = {0};
    const int nv = kt_model_nv(ours->model);
    if (!kt_check_equal_int("degrees of freedom", kt_model_nv(theirs->model), nv) ||
        kt_model_nq(ours->model) > COORDINATES ||
        !kt_check_true("joints have their names", map_coordinates(ours, theirs, positions, velocities)))
        return;
    random_position(ours, random);
    for (int i = 0; i < kt_model_nq(ours->model); i++)
        theirs->q[positions[i]] = ours->q[i];
    for (int i = 0; i < nv; i++)
        theirs->v[velocities[i]] = ours->v[i];
    if (compute(ours, &error) != KT_OK || compute(theirs, &error) != KT_OK) {
        kt_worst_below(&f->mass, (double)NAN, 0.0, "%s", error.message);
        return;
    }
    compare_places(ours, theirs, is_turned, &f->place);
    double most = 0.0, fastest = 1.0; /* the balance of gravity leaves rounding of some 9 m/s^2 */
    for (int i = 0; i < nv; i++)
        fastest = fmax(fastest, fabs(ours->a[i]));
    for (int i = 0; i < nv; i++)
        kt_worst_near(&f->acceleration, theirs->a[velocities[i]], ours->a[i], 1e-12 * fastest, "%s, %d",
                      kt_body_name(ours->model, 1), i);
    for (int i = 0; i < nv * nv; i++)
        most = fmax(most, fabs(ours->matrix[i]));
    const double raised = 2.0 * 1.5e-14 * kt_model_body_count(ours->model);
    for (int i = 0; i < nv; i++)
        for (int k = 0; k < nv; k++)
            kt_worst_near(&f->mass, theirs->matrix[velocities[i] + nv * velocities[k]], ours->matrix[i + nv * k],
                          64.0 * DBL_EPSILON * most + raised, "%d, %d", i, k);
}

/* Whether a free joint counts from the world in both, and no screw has become two joints. */
static bool is_plain(const kt_description *d, bool is_turned) {
    for (int i = 0; i < d->body_count; i++) {
        const kt_joint *j = &d->bodies[i].joint;
        if (j->type == KT_JOINT_SCREW)
            return false;
        if (j->type == KT_JOINT_FREE &&
            (is_turned || j->rotation.type != KT_ROTATION_NONE || j->at.x != 0.0 || j->at.y != 0.0 || j->at.z != 0.0))
            return false;
    }
    return true;
}

/* Returns whether the description could be written. */
static bool check_back(const kt_description *d, kt_robot_format format, kt_random *random, findings *f) {
    told t;
    char *text = NULL;
    kt_error error = {0};
    kt_scene *back = kt_test_scene_place();
    compiled ours, theirs;
    const kt_robot_options accept = {.inertia = KT_ROBOT_INERTIA_ACCEPT};
    if (write_back(d, format, &t, &text, &error) != KT_OK) {
        kt_note("%s: %s", error.where, error.message);
        return kt_check_equal_int("rejected with a reason", error.message[0] == '\0', 0) && false;
    }
    const kt_status status = kt_robot_parse("back", text, strlen(text), &accept, back, NULL, NULL, &error);
    if (status != KT_OK) {
        kt_note("%s: %s\n%s", error.where, error.message, text);
        return kt_check_true("it is read back", false);
    }
    /* URDF has no gravity but that along -z. Other directions turn the mechanism, so that both have the same motion. */
    const kt_vec3 any = kt_vec3_make(1.0, -2.0, -9.0), g = d->gravity;
    const bool is_turned = format == KT_ROBOT_URDF && (g.x != 0.0 || g.y != 0.0 || g.z > 0.0);
    const kt_vec3 from = is_turned ? kt_vec3_scale(9.81, kt_vec3_normalize(g)) : any;
    if (compile(d, from, &ours)) { /* some have no inertia along all coordinates where no loop is closed */
        const kt_vec3 to = is_turned ? back->description.gravity : any;
        if (kt_check_true("it is compiled", compile(&back->description, to, &theirs)) && is_plain(d, is_turned))
            compare(&ours, &theirs, is_turned, random, f);
        release(&theirs);
    }
    release(&ours);
    return true;
}

/* ---- bundled scenes ---------------------------------------------------------------------------------------------- */

KT_TEST(bundled_scenes_read_back_with_the_same_masses_places_and_accelerations) {
    int written[2] = {0, 0}, scenes = 0;
    kt_random random = kt_random_of_test();
    findings f = make_findings();
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const kt_description *description = &kt_test_bundled(kt_bundled(i))->description;
        if (description->body_count > 100)
            continue;
        scenes++;
        for (int format = 0; format < 2; format++)
            written[format] += check_back(description, (kt_robot_format)format, &random, &f);
    }
    kt_note("%d scenes: %d in URDF, %d in MJCF", scenes, written[0], written[1]);
    kt_check_above("in URDF", written[0], 60.5);
    kt_check_equal_int("in MJCF", written[1], scenes);
    check_findings(&f);
}

/* ---- random trees ------------------------------------------------------------------------------------------------ */

enum { BODIES = 9 };

static kt_vec3 random_vector(kt_random *r) {
    return kt_vec3_make(kt_random_uniform(r, -1.0, 1.0), kt_random_uniform(r, -1.0, 1.0),
                        kt_random_uniform(r, -1.0, 1.0));
}

/* The inertia of points, turned, so that it is one of bodies. */
static kt_sym3 random_inertia(kt_random *r) {
    kt_sym3 s = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (int i = 0; i < 4; i++) {
        const kt_vec3 p = random_vector(r);
        s = kt_sym3_add(s, kt_sym3_make(p.y * p.y + p.z * p.z, p.x * p.x + p.z * p.z, p.x * p.x + p.y * p.y, -p.x * p.y,
                                        -p.x * p.z, -p.y * p.z));
    }
    return s;
}

static kt_rotation rotation_of(kt_vec3 v) {
    const kt_quat q = kt_quat_normalize(kt_quat_make(1.0, v.x, v.y, v.z));
    return kt_rotation_quaternion(q.w, q.x, q.y, q.z);
}

static void random_tree(kt_random *r, const kt_joint_type *types, int type_count, kt_body *bodies) {
    static const char *const names[BODIES] = {"a", "b", "c", "d", "e", "f", "g", "h", "i"};
    static const char *const joints[BODIES] = {NULL, "jb", NULL, "jd", "je", NULL, "jg", NULL, "ji"};
    for (int i = 0; i < BODIES; i++) {
        const int parent = i > 0 ? (int)kt_random_uniform(r, 0.0, (double)i) : -1;
        kt_body *b = &bodies[i];
        *b = kt_body_of(names[i], parent >= 0 ? names[parent] : NULL,
                        i == 0 ? KT_JOINT_FREE : types[(int)kt_random_uniform(r, 0.0, (double)type_count)], 0.0);
        b->joint.name = joints[i];
        b->joint.axis = random_vector(r);
        if (i % 2 == 0)
            b->joint.axis2 = random_vector(r);
        if (i > 0) {
            const kt_vec3 v = random_vector(r);
            b->joint.at = random_vector(r);
            b->joint.rotation = i % 3 == 0 ? kt_rotation_rpy(v.x, v.y, v.z) : rotation_of(v);
        }
        if (b->joint.type == KT_JOINT_REVOLUTE || b->joint.type == KT_JOINT_PRISMATIC)
            b->joint.armature[0] = kt_random_uniform(r, 0.0, 1.0);
        b->mass = kt_random_uniform(r, 0.5, 2.0);
        b->com = random_vector(r);
        b->inertia = random_inertia(r);
        b->shape.type = (kt_shape_type)((int)KT_SHAPE_ROD + i % 4);
        b->shape.to = random_vector(r);
        b->shape.axis = random_vector(r);
        b->shape.size = kt_vec3_make(1.0, 2.0, 3.0);
        b->shape.radius = b->shape.length = 0.5;
    }
}

KT_TEST(random_trees_read_back_with_the_same_masses_places_and_accelerations) {
    static const kt_joint_type types[] = {KT_JOINT_FIXED,     KT_JOINT_REVOLUTE,    KT_JOINT_PRISMATIC,
                                          KT_JOINT_UNIVERSAL, KT_JOINT_CYLINDRICAL, KT_JOINT_PLANAR,
                                          KT_JOINT_SPHERICAL};
    kt_random random = kt_random_of_test();
    for (int format = 0; format < 2; format++) {
        findings f = make_findings();
        kt_note("%s", format == KT_ROBOT_URDF ? "in URDF" : "in MJCF");
        for (int n = 0; n < 200; n++) {
            kt_body bodies[BODIES];
            random_tree(&random, types, format == KT_ROBOT_URDF ? 6 : 7, bodies);
            kt_description d = kt_description_of(bodies, BODIES, NULL, 0, NULL, 0);
            kt_need(kt_check_true("it is written", check_back(&d, (kt_robot_format)format, &random, &f)));
        }
        check_findings(&f);
    }
}

/* Gravity in any direction, along axes and nearly upwards, too. The file has gravity along -z, and the same motion. */
KT_TEST(trees_under_any_gravity_are_turned_upright_in_urdf) {
    static const kt_joint_type types[] = {KT_JOINT_FIXED, KT_JOINT_REVOLUTE, KT_JOINT_PRISMATIC, KT_JOINT_PLANAR};
    static const kt_vec3 special[] = {{0.0, -1.0, 0.0}, {0.0, 1.0, 0.0},    {-1.0, 0.0, 0.0},   {1.0, 0.0, 0.0},
                                      {0.0, 0.0, 1.0},  {1e-9, -2e-9, 1.0}, {1e-9, 1e-9, -1.0}, {0.6, 0.8, 1e-17}};
    enum { SPECIAL = sizeof special / sizeof special[0] };
    kt_random random = kt_random_of_test();
    findings f = make_findings();
    for (int n = 0; n < 100; n++) {
        kt_body bodies[BODIES];
        random_tree(&random, types, 4, bodies);
        bodies[0].joint.type = n % 2 == 0 ? KT_JOINT_REVOLUTE : KT_JOINT_PRISMATIC;
        bodies[0].joint.at = random_vector(&random);
        bodies[0].joint.rotation = rotation_of(random_vector(&random));
        kt_description d = kt_description_of(bodies, BODIES, NULL, 0, NULL, 0);
        d.gravity = kt_vec3_scale(9.81, kt_vec3_normalize(n < SPECIAL ? special[n] : random_vector(&random)));
        kt_need(kt_check_true("it is written", check_back(&d, KT_ROBOT_URDF, &random, &f)));
    }
    check_findings(&f);
}

/* ---- all else ---------------------------------------------------------------------------------------------------- */

KT_TEST(forces_limits_couplings_and_the_start_come_back) {
    kt_body bodies[] = {make_body("a", NULL, KT_JOINT_REVOLUTE), make_body("b", "a", KT_JOINT_PRISMATIC)};
    const kt_term terms[] = {{"a", 2.0}, {"b", -4.0}};
    kt_effect effects[] = {kt_effect_default(), kt_effect_default(), kt_effect_default()};
    kt_loop loops[] = {kt_loop_default()};
    told t;
    char *text = NULL;
    kt_error error = {0};
    bodies[0].joint.position[0] = 0.25;
    bodies[0].joint.velocity[0] = 1.5;
    bodies[0].joint.limits.lower = -1.0;
    bodies[0].joint.limits.upper = 2.0;
    effects[0].type = KT_EFFECT_JOINT_DAMPER;
    effects[0].damping = 0.5;
    effects[1].type = KT_EFFECT_JOINT_SPRING;
    effects[1].stiffness = 3.0;
    effects[1].rest = kt_function_constant(0.125);
    effects[2].type = KT_EFFECT_DRAG;
    effects[2].linear = 1.0;
    effects[2].between[0].body = "a";
    effects[0].joint = effects[1].joint = "a";
    loops[0].name = "tie";
    loops[0].type = KT_LOOP_COUPLING;
    loops[0].terms = terms;
    loops[0].term_count = 2;
    loops[0].offset = 1.0;
    kt_description d = kt_description_of(bodies, 2, loops, 1, effects, 3);
    const kt_robot_options start = {.keyframe = "start"};
    const kt_scene *back = come_back(&d, KT_ROBOT_MJCF, &start, &t);
    kt_check_text("told", t.text, "effects of type drag 1\n");
    const kt_joint *j = &back->description.bodies[0].joint;
    const kt_loop *tie = &back->description.loops[0];
    kt_check_equal_bits("joint", (const double[]){j->position[0], j->velocity[0], j->limits.lower, j->limits.upper},
                        (const double[]){0.25, 1.5, -1.0, 2.0}, 4);
    kt_check_equal_int("effects", back->description.effect_count, 2);
    kt_check_equal_int("loops", back->description.loop_count, 1);
    kt_check_equal_bits("a - 2 b = 1/2",
                        (const double[]){tie->terms[0].coefficient, tie->terms[1].coefficient, tie->offset},
                        (const double[]){1.0, -2.0, 0.5}, 3);
    kt_check_equal_int("written", write_back(&d, KT_ROBOT_URDF, &t, &text, &error), KT_OK);
    kt_check_contains("told", t.text, "effects of type joint_spring 1\neffects of type drag 1\n");
    kt_check_contains("told", t.text, "joints that do not start at rest in zero 2\n");
    kt_check_contains("told", t.text, "gravity that is not 9.81 m/s^2 1\n");
}

/* Of a ball joint stiffness and damping, and of a free joint its damping, which MJCF has for all axes at once. */
KT_TEST(damping_of_ball_and_free_joints_comes_back) {
    kt_body bodies[2] = {make_body("drone", NULL, KT_JOINT_FREE), make_body("ball", "drone", KT_JOINT_SPHERICAL)};
    kt_effect effects[2] = {kt_effect_default(), kt_effect_default()};
    kt_description d = kt_description_default();
    told t;
    bodies[1].joint.at = kt_vec3_make(0.0, 0.5, 0.0);
    for (int i = 0; i < 2; i++) {
        effects[i].type = KT_EFFECT_BUSHING;
        effects[i].between[0] = kt_end_default();
        effects[i].between[1] = kt_end_default();
        effects[i].between[1].body = bodies[i].name;
        for (int k = i == 0 ? 0 : 3; k < 6; k++)
            effects[i].dampings[k] = 0.7 + i;
    }
    effects[1].between[0].body = "drone";
    effects[1].between[0].at = bodies[1].joint.at;
    for (int k = 3; k < 6; k++)
        effects[1].stiffnesses[k] = 4.0;
    d.bodies = bodies;
    d.body_count = 2;
    d.effects = effects;
    d.effect_count = 2;
    const kt_description back = come_back(&d, KT_ROBOT_MJCF, NULL, &t)->description;
    kt_need(kt_check_equal_int("effects", back.effect_count, 2));
    for (int i = 0; i < 2; i++) {
        const kt_effect *e = &back.effects[i];
        const int own = strcmp(e->between[1].body, "drone") == 0 ? 0 : 1;
        kt_check_equal_int("type", (int)e->type, KT_EFFECT_BUSHING);
        for (int k = 0; k < 6; k++) {
            kt_check_near("damping", e->dampings[k], effects[own].dampings[k], 0.0);
            kt_check_near("stiffness", e->stiffnesses[k], effects[own].stiffnesses[k], 0.0);
        }
    }
    effects[0].dampings[2] = 3.0; /* MJCF has no such damping */
    (void)come_back(&d, KT_ROBOT_MJCF, NULL, &t);
    kt_check_contains("what is lost", t.text, "effects of type bushing");
}

/* Each body of a chain is within the one before. */
KT_TEST(long_chains_come_back) {
    enum { LINKS = 1500 };
    static kt_body bodies[LINKS];
    static char names[LINKS][8];
    kt_description d = kt_description_default();
    told t;
    for (int i = 0; i < LINKS; i++) {
        (void)snprintf(names[i], sizeof names[i], "b%d", i);
        bodies[i] = make_body(names[i], i > 0 ? names[i - 1] : NULL, KT_JOINT_REVOLUTE);
    }
    d.bodies = bodies;
    d.body_count = LINKS;
    kt_check_equal_int("bodies", come_back(&d, KT_ROBOT_MJCF, NULL, &t)->description.body_count, LINKS);
}

KT_TEST(loops_between_bodies_come_back_where_they_were) {
    kt_body bodies[] = {make_body("a", NULL, KT_JOINT_REVOLUTE), make_body("b", NULL, KT_JOINT_FREE)};
    told t;
    kt_loop loop = kt_loop_of("weld", KT_LOOP_WELD);
    loop.between[0].body = "a";
    loop.between[0].at = kt_vec3_make(0.5, 0.0, 0.25);
    loop.between[1].body = "b";
    loop.between[1].rotation = kt_rotation_quaternion(0.5, 0.5, 0.5, 0.5);
    kt_description d = kt_description_of(bodies, 2, &loop, 1, NULL, 0);
    const kt_loop *l = &come_back(&d, KT_ROBOT_MJCF, NULL, &t)->description.loops[0];
    kt_check_text("nothing is lost", t.text, "");
    kt_check_equal_int("type", l->type, KT_LOOP_WELD);
    kt_check_equal_bits("place", &l->between[0].at.x, &loop.between[0].at.x, 3);
    kt_check_near("orientation", l->between[1].rotation.value[1], 0.5, DBL_EPSILON);
}

KT_TEST(joints_that_a_format_has_not_are_rejected_and_nothing_is_written) {
    static const struct {
        kt_joint_type type;
        kt_robot_format format;
        const char *words;
    } table[] = {{KT_JOINT_SCREW, KT_ROBOT_URDF, "URDF has no screw joint; MJCF has"},
                 {KT_JOINT_SPHERICAL, KT_ROBOT_URDF, "URDF has no spherical joint; MJCF has"}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_body bodies[] = {make_body("a", NULL, KT_JOINT_REVOLUTE), make_body("b", "a", table[i].type)};
        told t;
        char *text = NULL;
        kt_error error = {0};
        bodies[1].joint.pitch = 0.5;
        kt_description d = kt_description_of(bodies, 2, NULL, 0, NULL, 0);
        kt_check_equal_int("status", write_back(&d, table[i].format, &t, &text, &error), KT_ERROR_MODEL);
        kt_check_text("words", error.message, table[i].words);
        kt_check_text("where", error.where, "b");
        kt_check_text("written", text, "");
    }
}

KT_TEST(names_of_scenes_are_escaped) {
    kt_body body = make_body("a", NULL, KT_JOINT_REVOLUTE);
    kt_description d = kt_description_of(&body, 1, NULL, 0, NULL, 0);
    d.name = "a <b> & \"c\"\n";
    for (int format = 0; format < 2; format++) {
        told t;
        const kt_scene *back = come_back(&d, (kt_robot_format)format, NULL, &t);
        kt_check_text("name", back->description.name, "a <b> & \"c\"?");
    }
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

KT_TEST(meshes_are_referred_to_from_the_folder_of_the_robot) {
    static const char tetrahedron[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    char folder[] = "/tmp/kinetree-export-XXXXXX", file[200], other[200], out[200];
    kt_body body = make_body("a", NULL, KT_JOINT_REVOLUTE);
    kt_scene scene = kt_scene_default();
    kt_error error = {0};
    kt_need(kt_check_true("there is a folder", mkdtemp(folder) != NULL));
    (void)snprintf(out, sizeof out, "%s/robots", folder);
    (void)snprintf(file, sizeof file, "%s/part.obj", folder);
    (void)snprintf(other, sizeof other, "%s/part.dae", folder);
    kt_check_equal_int("folder", mkdir(out, 0700), 0);
    for (int i = 0; i < 2; i++) {
        FILE *f = fopen(i == 0 ? file : other, "w");
        kt_need(kt_check_true("a file", f != NULL));
        (void)fputs(tetrahedron, f);
        (void)fclose(f);
    }
    const kt_scene_mesh meshes[] = {{.body = "a", .file = file, .scale = {1.0, 1.0, 1.0}},
                                    {.body = "a", .file = file, .scale = {1.0, 1.0, 1.0}, .at = {0.0, 0.0, 2.0}},
                                    {.body = "a", .file = other, .scale = {1.0, 1.0, 1.0}},
                                    {.body = "a", .file = "/nowhere/part.stl", .scale = {1.0, 1.0, 1.0}}};
    scene.description.bodies = &body;
    scene.description.body_count = 1;
    scene.meshes = meshes;
    scene.mesh_count = 4;
    for (int format = 0; format < 2; format++) {
        told t = {{0}};
        char *text = NULL;
        size_t size = 0;
        FILE *stream = open_memstream(&text, &size);
        kt_check_equal_int("written",
                           kt_robot_write_scene(&scene, (kt_robot_format)format, out, stream, hear, &t, &error), KT_OK);
        (void)fclose(stream);
        kt_check_contains("a path from the folder", text, "\"../part.obj\"");
        kt_check_contains("told", t.text, "meshes whose files are not there 1\n");
        if (format == KT_ROBOT_MJCF) {
            kt_check_contains("told", t.text, "meshes in formats that MuJoCo does not read");
            kt_check_true("an asset for both",
                          strstr(text, "mesh_0") != NULL && strstr(text, "name=\"mesh_1\"") == NULL);
        } else {
            kt_check_contains("URDF names all", text, "\"../part.dae\"");
        }
        free(text);
    }
    kt_check_equal_int("clean", remove(file) + remove(other) + remove(out) + remove(folder), 0);
}

KT_TEST(meshes_that_mujoco_rejects_are_left_out_of_mjcf) {
    static const char *const table[][3] = {
        {"a.stl", "solid a\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
         "since they are STL as text (it reads binary STL, OBJ and MSH) 1\n"},
        {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n", "since they have no area 1\n"},
        {"b.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "since they have no area 1\n"},
        {"c.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "since they have no triangles 1\n"},
        {"d.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ""},
    };
    char folder[] = "/tmp/kinetree-export-XXXXXX", file[200];
    kt_body body = make_body("a", NULL, KT_JOINT_REVOLUTE);
    kt_error error = {0};
    kt_need(kt_check_true("there is a folder", mkdtemp(folder) != NULL));
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene_mesh mesh = {.body = "a", .file = file, .scale = {1.0, 1.0, 1.0}};
        kt_scene scene = kt_scene_default();
        told t = {{0}};
        FILE *nowhere = fopen("/dev/null", "w");
        scene.description.bodies = &body;
        scene.description.body_count = scene.mesh_count = 1;
        scene.meshes = &mesh;
        (void)snprintf(file, sizeof file, "%s/%s", folder, table[i][0]);
        (void)kt_test_file(folder, table[i][0], table[i][1]);
        kt_check_equal_int("written", kt_robot_write_scene(&scene, KT_ROBOT_MJCF, folder, nowhere, hear, &t, &error),
                           KT_OK);
        if (table[i][2][0] != '\0')
            kt_check_contains("told", t.text, table[i][2]);
        kt_check_equal_int(table[i][0], strstr(t.text, "meshes") == NULL, table[i][2][0] == '\0');
        kt_check_equal_int("clean", fclose(nowhere) + remove(file), 0);
    }
    kt_check_equal_int("clean", remove(folder), 0);
}
