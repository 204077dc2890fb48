/* Gravity forces as variables of formulas (gravity.JOINT), on random trees of every joint. They are compared with
 * differences of the potential energy and with inverse dynamics at rest. Their derivatives are compared with
 * differences of accelerations. Some arms are held still by these forces. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "mechanics/dynamics/tree.h"

#include "kinetree/kinetree.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TREES = 200, READ = KT_FORMULA_VARIABLE_MAX, NAME = 40 };

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* A law that stores the variables it reads. */
typedef struct reader {
    char name[READ][NAME];
    const char *names[READ];
    int at[READ]; /* velocity coordinates */
    int count;
    double value[READ];
    kt_effect effect;
} reader;

static int read_all(void *user, const double *u, double *force, double *rates) {
    reader *r = user;
    (void)force, (void)rates;
    memcpy(r->value, u, (size_t)r->count * sizeof *u);
    return 0;
}

/* Takes some of the gravity forces of a tree, in any order. */
static void draw_names(reader *r, const kt_tree *tree, kt_random *random) {
    kt_variable variable;
    r->count = 0;
    for (int k = 0; kt_variable_at(&tree->description, k, &variable) && r->count < READ; k++)
        if (variable.type == KT_VARIABLE_GRAVITY && kt_random_int(random, 0, 2) > 0) {
            (void)kt_variable_name(&tree->description, &variable, r->name[r->count], NAME);
            r->names[r->count] = r->name[r->count];
            r->count++;
        }
}

static kt_tree_plan draw_tree_plan(int n) {
    kt_tree_plan plan = n % 4 < 2 ? kt_tree_plan_default() : kt_tree_plan_planar();
    plan.is_shuffled = n % 4 == 1;
    plan.massless = n % 3 == 0 && n % 4 == 0;
    plan.with_armature = n % 3 == 2 ? 0.5 : 0.0;
    if (n % 4 == 3) {
        plan.planar = 2;
        plan.from_world = 0.4;
    }
    return plan;
}

/* A tree with a law on its first body that reads gravity forces. */
static void grow(kt_tree *tree, reader *r, int n, kt_random *random) {
    const kt_tree_plan plan = draw_tree_plan(n);
    kt_tree_describe(tree, &plan, random);
    draw_names(r, tree, random);
    r->effect = kt_effect_of(KT_EFFECT_EXPRESSION, NULL);
    r->effect.end_count = 1;
    r->effect.between[0].body = tree->body[n % plan.bodies].name;
    r->effect.law = read_all;
    r->effect.variables = r->names;
    r->effect.variable_count = r->count;
    r->effect.user = r;
    tree->description.effects = &r->effect;
    tree->description.effect_count = 1;
    kt_tree_compile(tree, NULL);
    for (int k = 0; k < r->count; k++) {
        kt_variable variable;
        (void)kt_variable_find(&tree->description, r->names[k], &variable);
        const int body = kt_body_find(tree->model, tree->description.bodies[variable.body].name);
        r->at[k] = kt_body_coordinates(tree->model, body).v + variable.component;
    }
}

static double potential_at(const kt_tree *tree, const double *q, int v, double step) {
    double delta[KT_TREE_NV] = {0.0}, moved[KT_TREE_NQ];
    kt_error error;
    delta[v] = step;
    kt_position_add(tree->model, q, delta, moved);
    return kt_kinematics_update(tree->model, tree->data, moved, NULL, NULL, &error) == KT_OK
               ? kt_potential_energy(tree->model, tree->data)
               : (double)NAN;
}

/* dV/dq by central differences of order six. */
static double potential_slope(const kt_tree *tree, const double *q, int v, double h) {
    static const double weight[3] = {3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0};
    double sum = 0.0;
    for (int k = 0; k < 3; k++)
        sum += weight[k] * (potential_at(tree, q, v, (k + 1) * h) - potential_at(tree, q, v, -(k + 1) * h)) / h;
    return sum;
}

/* At h = 0.02 the truncation is some `h^6 / 140` = 5e-13 of m g r, and rounding some `1e-16 / h` of the energies. */
KT_TEST(gravity_forces_are_the_slopes_of_the_potential_energy) {
    kt_random random = kt_random_of_test();
    KT_WORST slope = kt_worst_make("slope of the potential energy"), rest = kt_worst_make("inverse dynamics at rest");
    KT_WORST query = kt_worst_make("queries");
    int read = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        static reader r;
        kt_tree_state s;
        kt_error error = {0};
        double a[KT_TREE_NV], tau[KT_TREE_NV], scale = 0.0;
        kt_effect_load load;
        grow(&tree, &r, n, &random);
        kt_tree_state_draw(&tree, &random, &s);
        kt_need_fine("accelerates",
                     kt_acceleration_evaluate(tree.model, tree.data, 0.0, s.q, s.v, NULL, NULL, a, &error), &error);
        double value[READ];
        memcpy(value, r.value, sizeof value);
        (void)kt_fine("at rest", kt_dynamics_inverse(tree.model, tree.data, s.q, NULL, NULL, NULL, tau, &error),
                      &error);
        for (int v = 0; v < tree.nv; v++)
            scale = fmax(scale, fabs(tau[v]));
        for (int i = 0; i < tree.description.body_count; i++) /* possible cancellation: weights on arms of 1 m */
            scale += 9.81 * tree.body[i].mass;
        (void)kt_fine("kinematics", kt_kinematics_update(tree.model, tree.data, s.q, s.v, NULL, &error), &error);
        (void)kt_fine("query", kt_effect_evaluate(tree.model, tree.data, 0.0, s.q, s.v, 0, &load, &error), &error);
        for (int k = 0; k < r.count; k++) {
            kt_worst_near(&rest, value[k], tau[r.at[k]], 2e-14 * scale, "tree %d %s", n, r.names[k]);
            kt_worst_near(&query, r.value[k], tau[r.at[k]], 2e-14 * scale, "tree %d %s", n, r.names[k]);
        }
        for (int k = 0; k < r.count; k++, read++)
            kt_worst_near(&slope, value[k], potential_slope(&tree, s.q, r.at[k], 0.02), 1e-10 * scale, "tree %d %s", n,
                          r.names[k]);
    }
    kt_check_above("variables", read, 1000);
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

typedef struct formulas {
    char text[3][400];
    kt_effect effect[3];
    kt_auxiliary_state state;
    char rate[400];
} formulas;

/* Any gravity force of the tree. */
static void draw_name(const kt_tree *tree, kt_random *random, char *name) {
    kt_variable variable;
    int count = 0;
    *name = '\0';
    for (int k = 0; kt_variable_at(&tree->description, k, &variable); k++)
        if (variable.type == KT_VARIABLE_GRAVITY && kt_random_int(random, 0, count++) == 0)
            (void)kt_variable_name(&tree->description, &variable, name, NAME);
}

static const char *joint_of_one(const kt_tree *tree) {
    for (int i = 0; i < tree->description.body_count; i++)
        if (tree->body[i].joint.type == KT_JOINT_REVOLUTE || tree->body[i].joint.type == KT_JOINT_PRISMATIC)
            return tree->body[i].name;
    return NULL;
}

/* In a joint, on a body, between two bodies, and in the rate of a state that a force reads. */
static void load_tree(kt_tree *tree, formulas *f, kt_random *random) {
    char a[NAME], b[NAME], c[NAME];
    int count = 0;
    draw_name(tree, random, a);
    draw_name(tree, random, b);
    draw_name(tree, random, c);
    (void)snprintf(f->text[0], sizeof f->text[0], "0.7*%s + 0.1*sin(%s) + lag", a, b);
    (void)snprintf(f->text[1], sizeof f->text[1], "0.05*%s*(length - 1) - 0.3*speed", b);
    (void)snprintf(f->text[2], sizeof f->text[2], "0.02*%s - 0.01*%s", c, a);
    (void)snprintf(f->rate, sizeof f->rate, "0.3*%s - lag + 0.1*t*%s", c, b);
    for (int k = 0; k < 3; k++) {
        f->effect[k] = kt_effect_of(KT_EFFECT_EXPRESSION, NULL);
    }
    if (joint_of_one(tree) != NULL) {
        f->effect[count].joint = joint_of_one(tree);
        f->effect[count++].formula[0] = f->text[0];
    }
    f->effect[count].end_count = 2;
    f->effect[count].between[0] = (kt_end){.body = tree->body[0].name, .at = kt_tree_vector(random, -0.5, 0.5)};
    f->effect[count].between[1] = (kt_end){.at = kt_tree_vector(random, 1.0, 2.0)};
    f->effect[count++].formula[0] = f->text[1];
    f->effect[count].end_count = 1;
    f->effect[count].frame = KT_FRAME_BODY;
    f->effect[count].between[0] =
        (kt_end){.body = tree->body[tree->description.body_count - 1].name, .at = kt_tree_vector(random, -0.5, 0.5)};
    for (int k = 0; k < 6; k += 2)
        f->effect[count].formula[k] = f->text[2];
    f->state = (kt_auxiliary_state){.name = "lag", .initial = 0.4, .rate = f->rate};
    tree->description.effects = f->effect;
    tree->description.effect_count = count + 1;
    tree->description.states = &f->state;
    tree->description.state_count = 1;
}

static void accelerate(const kt_tree *tree, const double *q, const double *v, double *a) {
    kt_error error = {0};
    kt_need_fine("accelerates", kt_acceleration_evaluate(tree->model, tree->data, 0.3, q, v, NULL, NULL, a, &error),
                 &error);
}

/* Central differences of order eight: rounding, some 1e-16 of the accelerations over h, is most of their error. */
KT_TEST(derivatives_with_gravity_forces_are_exact) {
    static const double weight[4] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    const double h = 1e-3;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("da/dq");
    static double d[3 * KT_TREE_NV * KT_TREE_NV];
    for (int n = 0; n < 60; n++) {
        kt_tree tree;
        formulas f;
        kt_tree_state s;
        kt_error error = {0};
        kt_tree_plan plan = draw_tree_plan(n);
        plan.bodies = 3 + n % 10;
        kt_tree_describe(&tree, &plan, &random);
        load_tree(&tree, &f, &random);
        kt_tree_compile(&tree, NULL);
        kt_tree_state_draw(&tree, &random, &s);
        const size_t size = (kt_acceleration_work_size(tree.model) + KT_ALIGNMENT) / KT_ALIGNMENT * KT_ALIGNMENT;
        void *work = aligned_alloc(KT_ALIGNMENT, size);
        const int nv = tree.nv;
        (void)kt_fine("derivatives",
                      kt_acceleration_derivatives(tree.model, tree.data, work, size, 0.3, s.q, s.v, NULL, NULL, d,
                                                  d + nv * nv, d + 2 * nv * nv, &error),
                      &error);
        free(work);
        double scale = 0.0;
        for (int i = 0; i < nv * nv; i++)
            scale = fmax(scale, fabs(d[i]));
        for (int j = 0; j < nv; j++) {
            double step[KT_TREE_NV] = {0.0}, q[KT_TREE_NQ], a[KT_TREE_NV], slope[KT_TREE_NV] = {0.0};
            for (int k = -4; k <= 4; k++) {
                step[j] = k * h;
                kt_position_add(tree.model, s.q, step, q);
                if (k == 0)
                    continue;
                accelerate(&tree, q, s.v, a);
                for (int i = 0; i < nv; i++)
                    slope[i] += (k > 0 ? 1.0 : -1.0) * weight[abs(k) - 1] * a[i] / h;
            }
            for (int i = 0; i < nv; i++)
                kt_worst_near(&worst, d[j * nv + i], slope[i], 1e-8 * scale, "tree %d da[%d]/dq[%d]", n, i, j);
        }
    }
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

typedef struct mechanism {
    kt_scene *scene;
    kt_model *model;
    kt_data *data;
    int nv;
} mechanism;

static void make(mechanism *m, const char *text) {
    m->scene = kt_test_scene(text);
    m->model = kt_test_model(&m->scene->description, NULL);
    m->data = kt_test_data(m->model);
    m->nv = kt_model_nv(m->model);
}

/* An arm in space with oblique axes and a slider. The targets are `0.3, -0.7, 1.1 and 0.2`. */
#define ARM                                                                                                            \
    "kinetree: 1\ngravity: [1.5, 0, -9.81]\nbodies:\n"                                                                 \
    "  - {name: base, joint: {type: revolute, axis: [0, 1, 0.2], position: 0.3}, mass: 3, com: [0.4, 0, 0.1],\n"       \
    "     inertia: [0.1, 0.2, 0.2]}\n"                                                                                 \
    "  - {name: upper, parent: base, joint: {name: shoulder, type: revolute, axis: y, at: [0.8, 0, 0], position: "     \
    "-0.7}, mass: 2, com: [0.3, 0.05, 0], inertia: [0.1, 0.1, 0.1]}\n"                                                 \
    "  - {name: fore, parent: upper, joint: {name: elbow, type: revolute, axis: [1, 1, 0], at: [0.6, 0, 0], "          \
    "position: 1.1}, mass: 1, com: [0.3, 0, 0], inertia: [0.05, 0.1, 0.1]}\n"                                          \
    "  - {name: hand, parent: fore, joint: {type: prismatic, axis: x, at: [0.5, 0, 0], position: 0.2}, mass: 4,\n"     \
    "     inertia: [0.02, 0.02, 0.02]}\n"
#define HOLD(joint, target)                                                                                            \
    "  - {type: expression, joint: " joint ", force: \"gravity." joint " - 40*(position." joint " - " target           \
    ") - 40*velocity." joint "\"}\n"
#define HELD "effects:\n" HOLD("base", "0.3") HOLD("shoulder", "-0.7") HOLD("elbow", "1.1") HOLD("hand", "0.2")

static void run_to(mechanism *m, const double *q, double t_end, double *reached) {
    kt_error error = {0};
    const double rest[4] = {0.0};
    kt_simulation *simulation = kt_test_simulation(m->model, &m->scene->run, NULL);
    kt_need_fine("start", kt_simulation_set_state(simulation, 0.0, q, rest, &error), &error);
    kt_need_fine("run", kt_simulation_advance(simulation, t_end, &error), &error);
    memcpy(reached, kt_simulation_positions(simulation), (size_t)m->nv * sizeof *reached);
}

/* From rest at the target, and from far away: without the gravity forces the shoulder would sag by half a radian. */
KT_TEST(a_controller_with_gravity_forces_holds_its_target) {
    static const double target[4] = {0.3, -0.7, 1.1, 0.2}, away[4] = {-0.5, 0.4, 0.2, 0.5};
    static const char *const methods[] = {"dopri5", "radau5", "rodas5p"};
    mechanism m;
    make(&m, ARM HELD "simulate: {duration: 80, tolerance: 1e-10}\n");
    for (int k = 0; k < 3; k++) {
        double held[4] = {HUGE_VAL}, reached[4] = {HUGE_VAL};
        m.scene->run.integrator = methods[k];
        run_to(&m, target, 2.0, held);
        run_to(&m, away, 80.0, reached);
        KT_WORST still = kt_worst_make("held"), back = kt_worst_make("reached");
        for (int i = 0; i < 4; i++) {
            kt_worst_near(&still, held[i], target[i], 1e-9, "%s q[%d]", methods[k], i);
            kt_worst_near(&back, reached[i], target[i], 1e-9, "%s q[%d]", methods[k], i);
        }
    }
}

/* In a loop they are those of the tree: together they hold the mechanism in every position. */
KT_TEST(gravity_forces_of_all_tree_joints_hold_a_loop) {
    static const char *const text =
        "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
        "  - {name: crank, joint: {type: revolute, axis: z, position: 50 deg}, mass: 1, shape: {type: rod, to: [1, 0, "
        "0]}}\n"
        "  - {name: coupler, parent: crank, joint: {type: revolute, axis: z, at: [1, 0, 0], position: -30 deg}, mass: "
        "2, shape: {type: rod, to: [2, 0, 0]}}\n"
        "  - {name: rocker, joint: {type: revolute, axis: z, at: [2, 0, 0], position: 80 deg}, mass: 3, shape: {type: "
        "rod, to: [1.5, 0, 0]}}\n"
        "loops:\n  - {name: pin, type: revolute, axis: z, between: [{body: coupler, at: [2, 0, 0]}, {body: rocker, "
        "at: [1.5, 0, 0]}]}\n"
        "effects:\n  - {type: expression, joint: crank, force: gravity.crank}\n"
        "  - {type: expression, joint: coupler, force: gravity.coupler}\n"
        "  - {type: expression, joint: rocker, force: gravity.rocker}\n";
    mechanism m;
    make(&m, text);
    KT_WORST worst = kt_worst_make("accelerations");
    for (int k = 0; k < 20; k++) {
        double q[3] = {0.1 + 0.05 * k, -0.5, 1.4}, v[3] = {0.0, 0.0, 0.0}, a[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
        kt_error error = {0};
        (void)kt_fine("closes", kt_state_assemble(m.model, m.data, 0.0, q, v, &error), &error);
        (void)kt_fine("accelerates", kt_acceleration_evaluate(m.model, m.data, 0.0, q, v, NULL, NULL, a, &error),
                      &error);
        for (int i = 0; i < 3; i++)
            kt_worst_near(&worst, a[i], 0.0, 1e-12, "position %d a[%d]", k, i);
    }
}

/* Masses and gravity are in the formulas, too, which bend: against differences of whole steps. */
KT_TEST(derivatives_by_masses_include_gravity_forces) {
    static const char *const names[] = {"hand.mass", "upper.com", "gravity"};
    static const char *const text =
        ARM "effects:\n  - {type: expression, joint: shoulder, force: \"20*tanh(0.05*gravity.shoulder)\"}\n"
            "  - {type: expression, joint: base, force: \"0.8*gravity.base\"}\n";
    mechanism m;
    make(&m, text);
    const kt_step step = {.method = kt_method_find("rk4"), .h = 0.02};
    const double q[4] = {0.3, -0.7, 1.1, 0.2}, v[4] = {0.5, -0.2, 0.3, 0.1};
    const size_t size = kt_step_parameter_work_size(m.model, step.method) + KT_ALIGNMENT;
    void *work = aligned_alloc(KT_ALIGNMENT, size / KT_ALIGNMENT * KT_ALIGNMENT);
    void *memory =
        aligned_alloc(KT_ALIGNMENT, (kt_model_size(m.model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_model *own = NULL;
    kt_error error = {0};
    (void)kt_fine("copy", kt_model_copy(m.model, memory, kt_model_size(m.model), &own, &error), &error);
    KT_WORST worst = kt_worst_make("C");
    for (int n = 0; n < 3 && own != NULL; n++) {
        kt_parameter p;
        double C[8 * KT_PARAMETER_MAX], now[KT_PARAMETER_MAX], end_q[2][4], end_v[2][4];
        (void)kt_fine("found", kt_parameter_find(m.model, names[n], &p, &error), &error);
        (void)kt_fine("read", kt_parameter_get(m.model, &p, now, &error), &error);
        (void)kt_fine("derivatives",
                      kt_step_parameter_derivatives(m.model, m.data, work, size / KT_ALIGNMENT * KT_ALIGNMENT, &step,
                                                    &p, q, v, C, &error),
                      &error);
        for (int k = 0; k < p.count; k++) {
            const double h = 1e-5;
            for (int side = 0; side < 2; side++) {
                double moved[KT_PARAMETER_MAX];
                memcpy(moved, now, sizeof moved);
                moved[k] += side ? h : -h;
                (void)kt_fine("set", kt_parameter_set(own, &p, moved, &error), &error);
                (void)kt_fine("step",
                              kt_step_evaluate(own, m.data, work, size / KT_ALIGNMENT * KT_ALIGNMENT, &step, q, v,
                                               end_q[side], end_v[side], &error),
                              &error);
            }
            (void)kt_fine("set", kt_parameter_set(own, &p, now, &error), &error);
            for (int i = 0; i < 4; i++) {
                kt_worst_near(&worst, C[8 * k + i], (end_q[1][i] - end_q[0][i]) / (2.0 * h), 1e-9, "%s[%d] q[%d]",
                              names[n], k, i);
                kt_worst_near(&worst, C[8 * k + 4 + i], (end_v[1][i] - end_v[0][i]) / (2.0 * h), 1e-9, "%s[%d] v[%d]",
                              names[n], k, i);
            }
        }
    }
    free(memory);
    free(work);
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

static void check_fault(const char *effect, const char *mass, const char *words) {
    char text[1000];
    kt_error error = {0};
    kt_scene scene;
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\nbodies:\n  - {name: arm, joint: {type: revolute, axis: y}, mass: %s, shape: {type: "
                   "rod, to: [1, 0, 0]}}\neffects:\n  - {type: expression, joint: arm, force: \"%s\"}\n",
                   mass, effect);
    if (kt_check_true("is rejected", kt_scene_parse("x", text, strlen(text), &scene, NULL, NULL, &error) != KT_OK))
        kt_check_contains("message", error.message, words);
    else
        kt_scene_free(&scene);
}

KT_TEST(names_and_masses_that_cannot_be_read_are_rejected) {
    check_fault("gravity.arn", "1", "did you mean 'gravity.arm'");
    check_fault("gravity.arm[0]", "1", "gravity.arm");
    check_fault("gravity.arm", "{table: [[0, 2], [1, 1]]}", "the mass of body 'arm' is a function of time");
}
