/* Every type of effect on random trees. The joint forces of an effect are the slope of its energy. The energy balance
 * of a motion closes. The absolute formulation gives the same motion.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "both.h"

#include "mechanics/dynamics/tree.h"

#include "kinetree/joint.h"

#include <math.h>

enum { BODIES = KT_BOTH_BODIES - 1 };

/* A tree with one effect of each type. */
typedef struct stage {
    kt_tree tree;
    kt_effect effects[KT_EFFECT_TYPE_COUNT];
    kt_model *model;
    kt_absolute *absolute;
} stage;

static kt_end random_end(const stage *s, kt_random *random, int body) {
    kt_end end = kt_end_default();
    end.body = body < 0 ? NULL : s->tree.body[body].name;
    end.at = kt_tree_vector(random, -1.0, 1.0);
    end.rotation = kt_tree_rotation(random);
    return end;
}

static const char *scalar_joint(const stage *s, kt_random *random) {
    for (;;) {
        const kt_body *body = &s->tree.body[kt_random_int(random, 0, BODIES - 1)];
        if (body->joint.type == KT_JOINT_REVOLUTE || body->joint.type == KT_JOINT_PRISMATIC ||
            body->joint.type == KT_JOINT_SCREW)
            return body->name;
    }
}

/* How much is lost: nothing, nor driven; in all but stops and contacts, which are left out (smooth) or there; in these,
 * too. */
typedef enum loss_kind { NOTHING, SMOOTH, MOST, ALL } loss_kind;

/* One effect of each type, with numbers about 1. */
static void draw_effects(stage *s, kt_random *random, loss_kind kind) {
    const double loss = kind == NOTHING ? 0.0 : 1.0;
    for (int type = 0; type < KT_EFFECT_TYPE_COUNT; type++) {
        kt_effect *e = &s->effects[type];
        const int first = kt_random_int(random, 0, BODIES - 1), step = kt_random_int(random, 1, BODIES);
        const int second = first + step > BODIES - 1 ? first + step - BODIES - 1 : first + step; /* -1: the world */
        *e = kt_effect_of((kt_effect_type)type, scalar_joint(s, random));
        e->between[0] = random_end(s, random, first);
        e->between[1] = random_end(s, random, second);
        e->stiffness = kt_random_uniform(random, 1.0, 3.0);
        e->damping = loss * kt_random_uniform(random, 0.1, 0.5);
        e->length = 1.0;
        e->lower = -0.2;
        e->upper = 0.1;
        e->coulomb = 0.5 * loss;
        e->breakaway = 0.8 * loss;
        e->viscous = 0.2 * loss;
        e->stribeck = e->smoothing = e->slip = 1.0;
        e->linear = e->quadratic = 0.1 * loss;
        e->strength = 0.5;
        e->axis = kt_tree_direction(random);
        e->radius = kt_random_uniform(random, 0.0, 0.5);
        e->dissipation = 0.1 * loss;
        e->friction = e->type == KT_EFFECT_CONTACT ? 0.3 * loss : 0.0;
        for (int i = 0; i < 6; i++) {
            e->stiffnesses[i] = kt_random_uniform(random, 0.5, 2.0);
            e->dampings[i] = 0.2 * loss;
        }
        e->torque = kt_function_constant(loss * kt_random_normal(random));
        e->target = kt_function_sine(0.3, 0.7, 0.0, kt_random_normal(random));
        for (int i = 0; i < 3; i++)
            e->value[i] = kt_function_sine(loss * kt_random_normal(random), 1.0, i, 0.1 * loss);
        e->frame = kt_random_int(random, 0, 1) ? KT_FRAME_BODY : KT_FRAME_WORLD;
    }
    if (kind == MOST)
        s->effects[KT_EFFECT_JOINT_LIMIT].damping = s->effects[KT_EFFECT_CONTACT].dissipation = 0.0;
}

/* A stage without drives has no servo, and a smooth stage has no kinks. */
static bool fits(const kt_effect *e, loss_kind kind) {
    if (e->type == KT_EFFECT_EXPRESSION || e->type == KT_EFFECT_THRUST) /* there are none in absolute coordinates */
        return false;
    if (kind == NOTHING)
        return e->type != KT_EFFECT_SERVO;
    return kind != SMOOTH || (e->type != KT_EFFECT_JOINT_LIMIT && e->type != KT_EFFECT_CONTACT);
}

static void leave_out_others(kt_description *d, kt_effect *effects, loss_kind kind) {
    int count = 0;
    for (int i = 0; i < d->effect_count; i++)
        if (fits(&effects[i], kind))
            effects[count++] = effects[i];
    d->effect_count = count;
}

static void set_stage(stage *s, kt_random *random, loss_kind kind) {
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = BODIES;
    plan.massless = false;
    plan.types &= ~(1U << KT_JOINT_FIXED); /* effects cannot move bodies that are fixed to the world */
    kt_tree_describe(&s->tree, &plan, random);
    draw_effects(s, random, kind);
    s->tree.description.effects = s->effects;
    s->tree.description.effect_count = KT_EFFECT_TYPE_COUNT;
    leave_out_others(&s->tree.description, s->effects, kind);
    s->model = kt_both_compile(&s->tree.description, NULL, &s->absolute);
}

/* ---- slopes ------------------------------------------------------------------------------------------------------ */

static const double rest[KT_TREE_NV];

/* The energy of the effects at q moved by h w. */
static double energy_at(const kt_model *model, kt_data *data, const double *q, const double *w, double h) {
    double step[KT_TREE_NV], moved[KT_TREE_NQ];
    kt_error error;
    for (int i = 0; i < kt_model_nv(model); i++)
        step[i] = h * w[i];
    kt_position_add(model, q, step, moved);
    kt_need_fine("kinematics", kt_kinematics_update(model, data, moved, rest, NULL, &error), &error);
    return kt_effect_energy(model, data, 0.0, moved, rest);
}

/* Differences of sixth order. */
static double slope_of(const kt_model *model, kt_data *data, const double *q, const double *w, double h) {
    static const double weight[4] = {0.0, 0.75, -0.15, 1.0 / 60.0};
    double sum = 0.0;
    for (int i = 1; i <= 3; i++)
        sum += weight[i] / h * (energy_at(model, data, q, w, i * h) - energy_at(model, data, q, w, -i * h));
    return sum;
}

/* The joint forces of the effects at rest, M a + g, along a random direction. Energies are up to 200 J, so rounding EPS
 * V / h is 4e-11; bound: five times the largest of forty seeds. A stop or a contact may begin within the difference.
 * The difference is then wrong, as a difference of half its width shows. Only a few such cases are allowed. */
KT_TEST(effects_push_joints_by_the_slope_of_their_energy) {
    static stage s;
    kt_random random = kt_random_of_test();
    KT_WORST slope = kt_worst_make("power along a direction");
    double most = 0.0;
    int kinks = 0;
    for (int n = 0; n < 40; n++) {
        set_stage(&s, &random, NOTHING);
        double q[KT_TREE_NQ], v[KT_TREE_NV], a[KT_TREE_NV], tau[KT_TREE_NV], w[KT_TREE_NV], power = 0.0;
        const int nv = kt_model_nv(s.model);
        kt_data *data = NULL;
        kt_error error;
        kt_model_initial(s.model, q, v);
        kt_random_direction(&random, nv, w);
        kt_status status = kt_data_create(s.model, &data, &error);
        if (status == KT_OK)
            status = kt_acceleration_evaluate(s.model, data, 0.0, q, rest, NULL, NULL, a, &error);
        if (status == KT_OK)
            status = kt_dynamics_inverse(s.model, data, q, rest, a, NULL, tau, &error);
        kt_need_fine("forces", status, &error);
        for (int i = 0; i < nv; i++)
            power += tau[i] * w[i];
        most = fmax(most, fabs(power));
        const double rise = slope_of(s.model, data, q, w, 1e-3), half = slope_of(s.model, data, q, w, 5e-4);
        const bool bent = !(fabs(rise - half) <= 4e-10);
        kinks += bent;
        kt_worst_near(&slope, power, -half, bent ? 2.0 * fabs(rise - half) : 4e-10, "tree %d", n);
        kt_data_free(data);
    }
    kt_check_below("next to a kink, of 40", kinks, 4.0);
    kt_check_above("power", most, 1.0);
}

/* ---- motions ----------------------------------------------------------------------------------------------------- */

typedef struct ledger {
    double start, worst, heat;
    bool cooled; /* heat was given back */
} ledger;

static int enter(const kt_record *r, void *user) {
    ledger *l = user;
    const double balance = r->kinetic + r->potential + r->work.dissipated - r->work.supplied;
    if (r->index == 0)
        *l = (ledger){.start = balance};
    l->worst = fmax(l->worst, fabs(balance - l->start) / (1.0 + fabs(r->kinetic) + fabs(l->start)));
    l->cooled |= !(r->work.dissipated >= l->heat);
    l->heat = r->work.dissipated;
    return 0;
}

#define TOLERANCE 1e-12

/* The bound of the balance's error, relative to the energies. */
typedef double bound_of(const kt_model *model, const kt_simulation *simulation);

/* The error of a step is TOLERANCE (1 + |y|), root mean square. The error of one velocity is larger by up to sqrt(nv),
 * and the relative error of an energy p v / 2 is twice as large. Error control ignores works. They are integrals of
 * equally smooth functions by the same formula. The bound is half of the possible error of all steps together. The
 * largest error of seven seeds was a twentieth of the possible error. */
static double bound_smooth(const kt_model *model, const kt_simulation *simulation) {
    return (double)kt_simulation_counts_of(simulation).steps * sqrt(kt_model_nv(model)) * TOLERANCE;
}

/* A step over a kink is of first order, and its estimate of the error may be zero by chance. The bound above does not
 * apply. The bound is five times the largest error of twelve seeds. */
static double bound_kinked(const kt_model *model, const kt_simulation *simulation) {
    (void)model, (void)simulation;
    return 2.5e-9;
}

/* Stops and contacts have no damping here. If a body leaves a surface, its last energy turns into heat. The force is
 * then too small for the error control of the motion. The heat is exact to second order only. */
static void check_balance(loss_kind kind, bound_of *bound) {
    static stage s;
    kt_random random = kt_random_of_test();
    KT_WORST balance = kt_worst_make("balance, relative");
    bool cooled = false;
    double least = (double)INFINITY;
    for (int n = 0; n < 20; n++) {
        set_stage(&s, &random, kind);
        for (int formulation = 0; formulation < KT_FORMULATION_COUNT; formulation++) {
            ledger l = {0};
            kt_error error;
            kt_run run = kt_run_within("dop853", TOLERANCE, 0.2);
            run.interval = 0.02;
            run.record = KT_RECORD_BALANCE;
            const kt_either e = kt_either_begin(s.model, formulation ? s.absolute : NULL, &run, NULL);
            kt_need_fine("run", kt_either_run(e, enter, &l, &error), &error);
            kt_worst_below(&balance, l.worst, bound(s.model, e.simulation), "tree %d, formulation %d", n, formulation);
            cooled |= l.cooled;
            least = fmin(least, l.heat);
        }
    }
    kt_check_true("heat is never given back", !cooled);
    kt_check_above("heat, J", least, 0.05);
}

KT_TEST(energy_balance_closes_on_random_trees_under_smooth_forces) { check_balance(SMOOTH, bound_smooth); }

KT_TEST(energy_balance_closes_on_random_trees_under_forces_with_kinks) { check_balance(MOST, bound_kinked); }

/* Steps have errors in each formulation's own coordinates, in which forces vary within a step by as much as their size.
 * The change by half the step measures the error, and a tenth of it is allowed (measured with 20 seeds: a
 * hundredth). */
static kt_both_bounds widen(const kt_both_bounds *rounding, const kt_both_trace *whole, const kt_both_trace *half) {
    kt_both_worst step = kt_both_worst_make();
    kt_both_compare(&step, "half the step", whole, half, rounding);
    return (kt_both_bounds){rounding->position * fmax(1.0, 0.1 * step.position.ratio),
                            rounding->velocity * fmax(1.0, 0.1 * step.velocity.ratio),
                            rounding->acceleration * fmax(1.0, 0.1 * step.acceleration.ratio),
                            rounding->energy * fmax(1.0, 0.1 * step.energy.ratio),
                            rounding->reaction * fmax(1.0, 0.1 * step.reaction.ratio)};
}

KT_TEST(both_formulations_move_alike_under_effects) {
    static stage s;
    static kt_both_trace tree, half, other;
    static const kt_both_bounds rounding = {5e-14, 2e-13, 3e-13, 5e-14, 1e-12};
    kt_random random = kt_random_of_test();
    kt_both_worst worst = kt_both_worst_make();
    for (int n = 0; n < 10; n++) {
        set_stage(&s, &random, ALL);
        kt_run run = kt_run_fixed("dop853", 1e-3, 0.05), finer = kt_run_fixed("dop853", 5e-4, 0.05);
        run.interval = finer.interval = 0.005;
        if (kt_both_run(s.model, NULL, run, &tree) && kt_both_run(s.model, NULL, finer, &half) &&
            kt_both_run(s.model, s.absolute, run, &other)) {
            const kt_both_bounds bounds = widen(&rounding, &tree, &half);
            kt_both_compare(&worst, "tree", &tree, &other, &bounds);
        }
    }
    kt_both_check(&worst);
}
