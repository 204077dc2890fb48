/* The quantities of effects that can be recorded, of every type on one mechanism in random states. Powers are compared
 * with the generalised forces from inverse dynamics. Rates of lengths are compared with differences. Forces are
 * compared with each type's formula of the recorded lengths and rates.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion/simulation/scenes.h"

#include "kinetree/descriptor.h"
#include "kinetree/dynamics.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* There are three kinds of formulas: in a joint, on a body, between two. */
enum {
    BODIES = 4,
    FORMULAS = KT_EFFECT_EXPRESSION,
    EFFECTS = FORMULAS + 3,
    STATES = 60,
    NUMBERS = 24,
    QUANTITIES = 100
};

typedef struct stage {
    kt_body body[BODIES];
    kt_effect effect[EFFECTS];
    kt_description description;
    kt_model *model;
    kt_data *data;
    double q[NUMBERS], v[NUMBERS], forces[NUMBERS], value[QUANTITIES];
    int first[EFFECTS + 1]; /* where each effect's quantities begin */
} stage;

static void add_body(stage *s, int i, const char *name, const char *parent, kt_joint_type type) {
    s->body[i] = kt_body_of(name, parent, type, 1.0 + i);
    s->body[i].inertia = (kt_sym3){1.0, 1.5, 2.0, 0.0, 0.0, 0.0};
}

static void describe(stage *s) {
    add_body(s, 0, "hull", NULL, KT_JOINT_FREE);
    add_body(s, 1, "buoy", NULL, KT_JOINT_FREE);
    add_body(s, 2, "wheel", "hull", KT_JOINT_REVOLUTE);
    add_body(s, 3, "slide", "buoy", KT_JOINT_PRISMATIC);
    for (int i = 0; i < EFFECTS; i++) {
        kt_effect *e = &s->effect[i];
        *e = kt_effect_of((kt_effect_type)(i < FORMULAS ? i : FORMULAS), NULL);
        e->end_count = i - FORMULAS;
        e->formula[0] = i == FORMULAS ? "2*t - 3*position.slide" : i > FORMULAS + 1 ? "7 - 2*length - speed" : "1.5";
        if (i == FORMULAS + 1)
            e->formula[4] = "-velocity.slide";
        e->joint = i % 2 == 0 ? "wheel" : "slide";
        e->between[0].body = "wheel";
        e->between[0].at = kt_vec3_make(0.3, -0.2, 0.5);
        e->between[1].body = "slide";
        e->between[1].at = kt_vec3_make(0.1, 0.7, -0.2);
        e->stiffness = 3.0 + i;
        e->damping = 0.7;
        e->length = 0.4;
        e->initial_length = false;
        e->coulomb = 0.6;
        e->viscous = 0.3;
        e->stribeck = e->smoothing = 0.5;
        e->lower = -0.1;
        e->upper = 0.1;
        e->limit = 2.0;
        e->torque = kt_function_constant(1.7);
        e->target = kt_function_constant(0.2);
        e->linear = 0.4;
        e->quadratic = 0.8;
        e->strength = 2.5;
        e->radius = 0.3;
        e->dissipation = 0.2;
        e->friction = e->type == KT_EFFECT_CONTACT ? 0.4 : 0.0;
        e->slip = 0.5;
        for (int k = 0; k < 6; k++) {
            e->stiffnesses[k] = 2.0 + k;
            e->dampings[k] = 0.5;
        }
        for (int k = 0; k < 3; k++)
            e->value[k] = kt_function_constant(0.5 - k);
    }
    s->effect[KT_EFFECT_SPRING].name = "strut";
    s->description = kt_description_of(s->body, BODIES, NULL, 0, s->effect, EFFECTS);
}

static void build(stage *s) {
    describe(s);
    s->model = kt_scene_compile(&s->description);
    s->data = kt_test_data(s->model);
    s->first[0] = 0;
    for (int i = 0; i < EFFECTS; i++)
        s->first[i + 1] = s->first[i] + kt_effect_quantity_count(s->model, i);
    kt_need(kt_check_true("room", s->first[EFFECTS] <= QUANTITIES));
}

static void random_state(kt_random *random, stage *s) {
    for (int k = 0; k < kt_model_nq(s->model); k++)
        s->q[k] = kt_random_normal(random);
    for (int k = 0; k < kt_model_nv(s->model); k++)
        s->v[k] = kt_random_normal(random);
    kt_error error;
    bool changed;
    (void)kt_fine("unit quaternions", kt_state_project(s->model, s->data, 0.0, s->q, s->v, &changed, &error), &error);
}

static bool evaluate(stage *s, double *values) {
    kt_error error;
    return kt_fine("kinematics", kt_kinematics_update(s->model, s->data, s->q, s->v, NULL, &error), &error) &&
           kt_fine("quantities", kt_effect_quantities_evaluate(s->model, s->data, 0.0, s->q, s->v, values, &error),
                   &error);
}

/* The value of the first of these quantities; NaN if the effect has none. */
static double value_of(const stage *s, int effect, kt_effect_quantity quantity) {
    for (int k = 0; k < kt_effect_quantity_count(s->model, effect); k++)
        if (kt_effect_quantity_at(s->model, effect, k) == quantity)
            return s->value[s->first[effect] + k];
    return (double)NAN;
}

/* Sum of v_k Q_k; both sums have some 30 terms of size `size`. */
KT_TEST(powers_of_effects_are_those_of_their_generalised_forces) {
    static stage s;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("power");
    kt_error error;
    build(&s);
    for (int n = 0; n < STATES; n++) {
        random_state(&random, &s);
        if (!evaluate(&s, s.value) ||
            !kt_fine("forces", kt_effect_forces(s.model, s.data, 0.0, s.q, s.v, s.forces, &error), &error))
            break;
        double power = 0.0, expected = 0.0, size = 0.0;
        for (int i = 0; i < EFFECTS; i++) {
            power += value_of(&s, i, KT_QUANTITY_POWER);
            size += fabs(value_of(&s, i, KT_QUANTITY_POWER));
        }
        for (int k = 0; k < kt_model_nv(s.model); k++) {
            expected += s.v[k] * s.forces[k];
            size += fabs(s.v[k] * s.forces[k]);
        }
        kt_worst_near(&worst, power, expected, 8.0 * DBL_EPSILON * size, "state %d", n);
    }
}

/* Central differences along the motion. Their error is h^2 / 6 of the third derivative, which is below 1e3 here. */
KT_TEST(rates_of_effects_are_those_of_their_lengths) {
    static stage s;
    static double before[QUANTITIES], after[QUANTITIES];
    const double h = 1e-5;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("rate");
    build(&s);
    for (int n = 0; n < STATES; n++) {
        random_state(&random, &s);
        double q[NUMBERS], *to[2] = {before, after};
        if (!evaluate(&s, s.value))
            break;
        for (int k = 0; k < kt_model_nq(s.model); k++)
            q[k] = s.q[k];
        for (int k = 0; k < 2; k++) {
            double step[NUMBERS];
            for (int j = 0; j < kt_model_nv(s.model); j++)
                step[j] = (k == 0 ? -h : h) * s.v[j];
            kt_position_add(s.model, q, step, s.q);
            (void)evaluate(&s, to[k]);
        }
        for (int i = 0; i < EFFECTS; i++)
            for (int k = 0; k + 1 < kt_effect_quantity_count(s.model, i); k++) {
                const int at = s.first[i] + k;
                if (kt_effect_quantity_at(s.model, i, k) == KT_QUANTITY_LENGTH ||
                    kt_effect_quantity_at(s.model, i, k) == KT_QUANTITY_COORDINATE)
                    kt_worst_near(&worst, s.value[at + 1], (after[at] - before[at]) / (2.0 * h), 2e-8,
                                  "state %d, effect %d", n, i);
            }
    }
}

/* The formulas of the types' page. */
KT_TEST(forces_of_effects_follow_from_their_lengths_and_rates) {
    static stage s;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("force");
    int touching = 0;
    build(&s);
    for (int n = 0; n < STATES; n++) {
        random_state(&random, &s);
        if (!evaluate(&s, s.value))
            break;
        const kt_effect *e = &s.effect[KT_EFFECT_SPRING];
        double x = value_of(&s, KT_EFFECT_SPRING, KT_QUANTITY_LENGTH);
        double rate = value_of(&s, KT_EFFECT_SPRING, KT_QUANTITY_LENGTH_RATE);
        kt_worst_near(&worst, value_of(&s, KT_EFFECT_SPRING, KT_QUANTITY_TENSION),
                      e->stiffness * (x - e->length) + e->damping * rate, 1e-13, "spring, state %d", n);
        x = value_of(&s, KT_EFFECT_ATTRACTION, KT_QUANTITY_LENGTH);
        kt_worst_near(&worst, value_of(&s, KT_EFFECT_ATTRACTION, KT_QUANTITY_TENSION) * x * x,
                      s.effect[KT_EFFECT_ATTRACTION].strength, 1e-13, "attraction, state %d", n);
        kt_worst_near(&worst, value_of(&s, KT_EFFECT_MOTOR, KT_QUANTITY_JOINT_FORCE), 1.7, 0.0, "motor");
        kt_worst_near(&worst, value_of(&s, FORMULAS, KT_QUANTITY_JOINT_FORCE),
                      -3.0 * value_of(&s, FORMULAS, KT_QUANTITY_COORDINATE), 1e-13, "formula, state %d", n);
        kt_worst_near(&worst, value_of(&s, FORMULAS + 1, KT_QUANTITY_FORCE_X), 1.5, 1e-13, "formula, state %d", n);
        kt_worst_near(&worst, value_of(&s, FORMULAS + 2, KT_QUANTITY_TENSION),
                      2.0 * value_of(&s, FORMULAS + 2, KT_QUANTITY_LENGTH) +
                          value_of(&s, FORMULAS + 2, KT_QUANTITY_LENGTH_RATE) - 7.0,
                      1e-13, "formula between two, state %d", n);
        e = &s.effect[KT_EFFECT_JOINT_SPRING];
        kt_worst_near(&worst, value_of(&s, KT_EFFECT_JOINT_SPRING, KT_QUANTITY_JOINT_FORCE),
                      -e->stiffness * value_of(&s, KT_EFFECT_JOINT_SPRING, KT_QUANTITY_COORDINATE) -
                          e->damping * value_of(&s, KT_EFFECT_JOINT_SPRING, KT_QUANTITY_COORDINATE_RATE),
                      1e-13, "joint spring, state %d", n);
        e = &s.effect[KT_EFFECT_JOINT_LIMIT];
        x = e->stiffness * value_of(&s, KT_EFFECT_JOINT_LIMIT, KT_QUANTITY_EXCESS);
        rate = e->damping * value_of(&s, KT_EFFECT_JOINT_LIMIT, KT_QUANTITY_COORDINATE_RATE);
        const double force = value_of(&s, KT_EFFECT_JOINT_LIMIT, KT_QUANTITY_JOINT_FORCE);
        if (x > 0.0)
            kt_worst_near(&worst, fabs(force), x - (force > 0.0 ? 1.0 : -1.0) * rate * x / (x + fabs(rate)), 1e-13,
                          "limit, state %d", n);
        e = &s.effect[KT_EFFECT_CONTACT];
        x = value_of(&s, KT_EFFECT_CONTACT, KT_QUANTITY_EXCESS);
        const double normal = value_of(&s, KT_EFFECT_CONTACT, KT_QUANTITY_NORMAL);
        const double friction = value_of(&s, KT_EFFECT_CONTACT, KT_QUANTITY_FRICTION);
        const double slip = value_of(&s, KT_EFFECT_CONTACT, KT_QUANTITY_SLIP);
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += pow(value_of(&s, KT_EFFECT_CONTACT, (kt_effect_quantity)(KT_QUANTITY_FORCE_X + k)), 2.0);
        kt_worst_near(&worst, friction, e->friction * normal * tanh(slip / e->slip), 1e-13 * (1.0 + normal),
                      "friction, state %d", n);
        kt_worst_near(&worst, sqrt(square), hypot(normal, friction), 1e-13 * (1.0 + normal), "contact, state %d", n);
        kt_worst_near(&worst, x > 0.0 ? 0.0 : normal, 0.0, 0.0, "no contact, state %d", n);
        touching += x > 0.0;
    }
    kt_check_above("states in contact", touching, 5.0);
}

/* A block moves and turns; its axes are those of the world. Each component of force and moment is -(b + q |s|) s. */
KT_TEST(drag_records_its_moments) {
    kt_lone lone;
    kt_error error;
    kt_effect drag = kt_effect_default();
    const double q[7] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0}, v[6] = {2.0, -1.0, 0.5, 3.0, -4.0, 0.25};
    const double damping[6] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, quadratic[6] = {0.7, 0.6, 0.5, 0.4, 0.3, 0.2};
    double x[16], power = 0.0;
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    drag.type = KT_EFFECT_DRAG;
    drag.between[0].body = "block";
    memcpy(drag.dampings, damping, sizeof damping);
    memcpy(drag.quadratics, quadratic, sizeof quadratic);
    lone.description.bodies = &lone.body;
    lone.description.effects = &drag;
    lone.description.effect_count = 1;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_data *data = kt_test_data(model);
    kt_need_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &error), &error);
    kt_need(kt_check_equal_int("quantities", kt_effect_quantity_count(model, 0), 7));
    kt_need_fine("quantities", kt_effect_quantities_evaluate(model, data, 0.0, q, v, x, &error), &error);
    for (int k = 0; k < 6; k++) {
        const double by_hand = -(damping[k] + quadratic[k] * fabs(v[k])) * v[k];
        power += by_hand * v[k];
        kt_check_near(kt_quantity_name(kt_effect_quantity_at(model, 0, k), false), x[k], by_hand, 1e-14);
    }
    kt_check_near("power", x[6], power, 1e-13);
}

/* A sphere of radius 0.3 slides along x at 2 m/s, with its centre 0.2 above a plane. The expected values are computed
 * by hand. */
KT_TEST(contact_says_where_it_is_and_how_deep) {
    kt_lone lone;
    kt_error error;
    kt_effect contact = kt_effect_default();
    const double q[7] = {1.0, 2.0, 0.2, 1.0, 0.0, 0.0, 0.0}, v[6] = {2.0, 0.0, 0.0, 0.0, 4.0, 0.0};
    double x[16];
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    contact.type = KT_EFFECT_CONTACT;
    contact.between[0].body = "block";
    contact.radius = 0.3;
    contact.stiffness = 1000.0;
    contact.exponent = 2.0;
    contact.friction = 0.5;
    contact.slip = 1.0;
    lone.description.bodies = &lone.body;
    lone.description.effects = &contact;
    lone.description.effect_count = 1;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_data *data = kt_test_data(model);
    kt_need_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &error), &error);
    kt_need_fine("quantities", kt_effect_quantities_evaluate(model, data, 0.0, q, v, x, &error), &error);
    /* N = 1000 0.1^2 = 10; the lowest point slides at 2 - 4 0.3 = 0.8 m/s */
    const double rub = 5.0 * tanh(0.8);
    const double by_hand[] = {10.0, rub, -rub, 0.0, 10.0, -0.8 * rub, 0.1, 0.8, 1.0, 2.0, -0.1};
    kt_check_equal_int("quantities", kt_effect_quantity_count(model, 0), (int)(sizeof by_hand / sizeof *by_hand));
    for (int k = 0; k < kt_effect_quantity_count(model, 0); k++) {
        kt_check_near(kt_quantity_name(kt_effect_quantity_at(model, 0, k), false), x[k], by_hand[k], 1e-14);
    }
}

KT_TEST(names_and_units_of_quantities_tell_turning_from_sliding) {
    static stage s;
    build(&s);
    kt_check_equal_int("found", kt_effect_find(s.model, "strut"), KT_EFFECT_SPRING);
    kt_check_equal_int("not found", kt_effect_find(s.model, "stru"), -1);
    kt_check_text("name", kt_effect_name(s.model, KT_EFFECT_SPRING), "strut");
    kt_check_equal_int("no such effect", kt_effect_type_of(s.model, EFFECTS), KT_EFFECT_TYPE_COUNT);
    kt_check_equal_int("no such quantity", kt_effect_quantity_at(s.model, 0, 99), KT_QUANTITY_COUNT);
    kt_check_text("depth of a contact",
                  kt_quantity_unit(KT_QUANTITY_EXCESS, kt_effect_is_sliding(s.model, KT_EFFECT_CONTACT)), "m");
    for (int i = 0; i < EFFECTS; i++)
        if (kt_effect_quantity_at(s.model, i, 0) == KT_QUANTITY_JOINT_FORCE) {
            kt_check_text("name", kt_quantity_name(KT_QUANTITY_JOINT_FORCE, kt_effect_is_sliding(s.model, i)),
                          i % 2 == 0 ? "torque" : "force");
            kt_check_text("unit", kt_quantity_unit(KT_QUANTITY_JOINT_FORCE, kt_effect_is_sliding(s.model, i)),
                          i % 2 == 0 ? "N m" : "N");
        }
}
