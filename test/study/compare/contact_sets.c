/* Nothing ignores hard contacts. Every public call that evaluates forces, accelerations or their derivatives takes the
 * set of its model. If an open contact touches in the state, or joint friction sticks that the set lets slip, the call
 * is rejected, and the message names an alternative. With the contact closed in the set, the results are those of the
 * contact: a body at rest has the acceleration 0, and the reaction is its weight. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/analysis.h"
#include "kinetree/batch.h"
#include "kinetree/codegen.h"
#include "kinetree/control.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"
#include "kinetree/study.h"

#include "fixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COORDINATES = 2, WORK = 1 << 18 };
static const double g = 9.81;

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

/* A mass on a vertical slide at z, with its contact, stop, rope or friction. `rests`: where it touches. */
typedef struct mechanism {
    const char *name;
    double rests;
    kt_description description;
    kt_body body;
    kt_effect effect[2];
    kt_loop loop;
} mechanism;

enum { STOP, CONTACT, ROPE, FRICTION, MECHANISMS };

static void describe(mechanism *m, int kind) {
    static const char *const names[] = {"stop", "contact", "rope", "friction"};
    *m = (mechanism){.name = names[kind], .description = kt_description_default(), .body = kt_body_default()};
    m->body.name = "mass";
    m->body.mass = 2.0;
    m->body.joint.type = KT_JOINT_PRISMATIC;
    m->body.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    m->effect[0] = m->effect[1] = kt_effect_default();
    m->effect[0].name = names[kind];
    m->effect[0].joint = "mass";
    m->effect[0].restitution = 0.0;
    m->description.gravity = kt_vec3_make(0.0, 0.0, -g);
    m->description.bodies = &m->body;
    m->description.effects = m->effect;
    m->description.body_count = m->description.effect_count = 1;
    if (kind == STOP) {
        m->effect[0].type = KT_EFFECT_JOINT_LIMIT;
        m->effect[0].lower = 0.0;
    } else if (kind == CONTACT) {
        m->effect[0].type = KT_EFFECT_CONTACT;
        m->effect[0].joint = NULL;
        m->effect[0].between[0].body = "mass";
        m->effect[0].axis = kt_vec3_make(0.0, 0.0, 1.0);
        m->effect[0].radius = 0.1;
        m->rests = 0.1;
    } else if (kind == FRICTION) {
        m->effect[0].type = KT_EFFECT_JOINT_FRICTION;
        m->effect[0].coulomb = 50.0;
        m->effect[0].stick = true;
        m->effect[0].restitution = kt_effect_default().restitution;
    } else {
        m->loop = kt_loop_of("rope", KT_LOOP_DISTANCE);
        m->loop.slack = true;
        m->loop.between[0].at = kt_vec3_make(0.0, 0.0, 1.0); /* its length is 1 m */
        m->loop.between[1].body = "mass";
        m->description.loops = &m->loop;
        m->description.loop_count = 1;
        m->description.effect_count = 0;
    }
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

typedef struct state {
    const kt_model *model;
    kt_data *data;
    void *work;
    double q[COORDINATES], v[COORDINATES];
} state;

static double out[4][8 * COORDINATES * COORDINATES];
static kt_wrench wrench[8];

#define OF(s) (s)->model, (s)->data
#define AT(s) 0.0, (s)->q, (s)->v

static kt_status acceleration(const state *s, kt_error *error) {
    return kt_acceleration_evaluate(OF(s), AT(s), NULL, NULL, out[0], error);
}
static kt_status derivatives(const state *s, kt_error *error) {
    return kt_acceleration_derivatives(OF(s), s->work, WORK, AT(s), NULL, NULL, out[0], out[1], out[2], error);
}
static kt_status stiffness(const state *s, kt_error *error) {
    return kt_stiffness_evaluate(OF(s), s->work, WORK, AT(s), NULL, NULL, NULL, out[3], out[0], out[1], out[2], error);
}
static kt_status power(const state *s, kt_error *error) {
    kt_power result;
    return kt_power_evaluate(OF(s), AT(s), NULL, NULL, out[0], &result, error);
}
static kt_status reactions(const state *s, kt_error *error) {
    return kt_reaction_evaluate(OF(s), AT(s), NULL, NULL, wrench, wrench + 4, error);
}
static kt_status multipliers(const state *s, kt_error *error) {
    return kt_multiplier_evaluate(OF(s), AT(s), NULL, NULL, out[0], error);
}
static kt_status actuation(const state *s, kt_error *error) {
    static const int first = 0;
    const kt_coordinate_list list = {.index = &first, .count = 1};
    return kt_actuation_evaluate(OF(s), s->work, WORK, AT(s), NULL, NULL, list, NULL, out[0], NULL, error);
}
static kt_status linearization(const state *s, kt_error *error) {
    kt_linearization *l = NULL;
    kt_status status = kt_linearization_create(s->model, NULL, &l, error);
    if (status == KT_OK)
        status = kt_linearization_evaluate(l, AT(s), NULL, error);
    kt_linearization_free(l);
    return status;
}
static kt_status equilibrium(const state *s, kt_error *error) {
    const double weight = 2.0 * g;
    double q[COORDINATES];
    kt_linearization *l = NULL;
    kt_status status = kt_linearization_create(s->model, NULL, &l, error);
    memcpy(q, s->q, sizeof q);
    if (status == KT_OK) /* balanced wherever the mass is */
        status = kt_equilibrium_find(l, NULL, 0.0, q, &weight, NULL, error);
    kt_linearization_free(l);
    return status;
}
static kt_status spectrum(const state *s, kt_error *error) {
    kt_spectrum *modes = NULL;
    kt_status status = kt_spectrum_create(s->model, 1, &modes, error);
    if (status == KT_OK)
        status = kt_spectrum_add(modes, AT(s), NULL, error);
    kt_spectrum_free(modes);
    return status;
}
static kt_status formulation(const state *s, kt_error *error) {
    const kt_constraint_formulation_options options =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 1.0);
    kt_constraint_formulation *made = NULL;
    kt_status status = kt_constraint_formulation_create(s->model, &options, &made, error);
    if (status == KT_OK)
        status = kt_constraint_formulation_evaluate(made, s->data, AT(s), NULL, NULL, NULL, out[0], error);
    kt_constraint_formulation_free(made);
    return status;
}
static kt_status batch_task(const state *s, kt_batch_task task, kt_error *error) {
    kt_batch_options options = kt_batch_options_default();
    kt_batch *batch = NULL;
    options.states = 3;
    options.method = kt_method_find("rk4");
    kt_status status = kt_batch_create(s->model, &options, &batch, error);
    for (size_t i = 0; status == KT_OK && i < options.states; i++)
        status = kt_batch_set_state(batch, i, AT(s), error);
    if (status == KT_OK)
        status = kt_batch_compute(batch, &(kt_batch_job){.task = task, .h = 1e-3, .steps = 1}, error);
    kt_batch_free(batch);
    return status;
}
static kt_status batch_forward(const state *s, kt_error *error) { return batch_task(s, KT_BATCH_FORWARD, error); }
static kt_status batch_step(const state *s, kt_error *error) { return batch_task(s, KT_BATCH_STEP, error); }
static kt_status batch_semi_implicit(const state *s, kt_error *error) {
    return batch_task(s, KT_BATCH_SEMI_IMPLICIT_STEP, error);
}
static kt_step step_of(void) { return (kt_step){.method = kt_method_find("rk4"), .h = 1e-2}; }
static kt_status step(const state *s, kt_error *error) {
    const kt_step of = step_of();
    return kt_step_evaluate(OF(s), s->work, WORK, &of, s->q, s->v, out[0], out[1], error);
}
static kt_status step_derivatives(const state *s, kt_error *error) {
    const kt_step of = step_of();
    return kt_step_derivatives(OF(s), s->work, WORK, &of, s->q, s->v, NULL, NULL, out[0], out[1], error);
}
static kt_status step_adjoint(const state *s, kt_error *error) {
    const kt_step of = step_of();
    const double by_next[2 * COORDINATES] = {1.0};
    return kt_step_adjoint(OF(s), s->work, WORK, &of, s->q, s->v, by_next, out[0], out[1], error);
}
/* NOLINTNEXTLINE(readability-non-const-parameter): the type of a cost */
static int height(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    (void)by_tau, (void)user;
    *value = at->q[0];
    if (by_state != NULL)
        by_state[0] = 1.0;
    return 0;
}
static kt_status rollout(const state *s, kt_error *error) {
    const kt_rollout of = {.method = kt_method_find("rk4"), .h = 1e-2, .steps = 2};
    return kt_rollout_gradient(OF(s), s->work, WORK, &of, s->q, s->v, out[0], out[1], NULL, height, NULL, error);
}
static kt_status rollouts(const state *s, kt_error *error) {
    const kt_rollout of = {.method = kt_method_find("rk4"), .h = 1e-2, .steps = 2};
    kt_rollout_task task = {.rollout = of, .q = s->q, .v = s->v, .by_start = out[1]};
    const kt_status status = kt_rollout_gradients(OF(s), s->work, WORK, &task, 1, height, error);
    return status == KT_OK ? task.status : status;
}
static kt_status floquet(const state *s, kt_error *error) {
    kt_floquet_options options = kt_floquet_options_default(0.02);
    kt_floquet *made = NULL;
    options.steps = 2;
    kt_status status = kt_floquet_create(s->model, &options, &made, error);
    if (status == KT_OK)
        status = kt_floquet_evaluate(made, AT(s), error);
    kt_floquet_free(made);
    return status;
}
static kt_status dae(const state *s, kt_error *error) {
    kt_dae_options options = kt_dae_options_default(KT_DAE_INDEX3);
    kt_dae *made = NULL;
    (void)s;
    options.method = kt_method_find("implicit-euler");
    const kt_status status = kt_dae_create(s->model, &options, &made, error);
    kt_dae_free(made);
    return status;
}
static kt_status codegen(const state *s, kt_error *error) {
    FILE *files[2] = {tmpfile(), tmpfile()};
    const kt_status status = files[0] != NULL && files[1] != NULL
                                 ? kt_codegen_write(s->model, "x", KT_CODEGEN_FORWARD, true, files[0], files[1], error)
                                 : KT_ERROR_MEMORY;
    for (int i = 0; i < 2; i++)
        if (files[i] != NULL)
            (void)fclose(files[i]);
    return status;
}

/* `always`: rejects these models in every state. `other`: a state that is not rejected may have another error, as it
 * belongs to no closed orbit. */
static const struct {
    const char *name;
    kt_status (*call)(const state *s, kt_error *error);
    bool always, other;
} calls[] = {{"kt_acceleration_evaluate", acceleration, false, false},
             {"kt_acceleration_derivatives", derivatives, false, false},
             {"kt_stiffness_evaluate", stiffness, false, false},
             {"kt_power_evaluate", power, false, false},
             {"kt_reaction_evaluate", reactions, false, false},
             {"kt_multiplier_evaluate", multipliers, false, false},
             {"kt_actuation_evaluate", actuation, false, false},
             {"kt_linearization_evaluate", linearization, false, false},
             {"kt_equilibrium_find", equilibrium, false, false},
             {"kt_spectrum_add", spectrum, false, false},
             {"kt_constraint_formulation_evaluate", formulation, false, false},
             {"kt_batch_forward", batch_forward, false, false},
             {"kt_batch_step", batch_step, true, false},
             {"kt_batch_step_semi_implicit", batch_semi_implicit, true, false},
             {"kt_step_evaluate", step, false, false},
             {"kt_step_derivatives", step_derivatives, false, false},
             {"kt_step_adjoint", step_adjoint, false, false},
             {"kt_rollout_gradient", rollout, false, false},
             {"kt_rollout_gradients", rollouts, false, false},
             {"kt_floquet_evaluate", floquet, false, true},
             {"kt_dae_create", dae, true, false},
             {"kt_codegen_write", codegen, true, false}};
enum { CALLS = sizeof calls / sizeof calls[0] };

/* ---- tests ------------------------------------------------------------------------------------------------------- */

static void begin(mechanism *m, int kind, kt_model **model, state *s) {
    describe(m, kind);
    *s = (state){.work = aligned_alloc(KT_ALIGNMENT, WORK), .q = {m->rests}};
    kt_test_own(s->work, free);
    s->model = *model = kt_test_model(&m->description, NULL);
    s->data = kt_test_data(*model);
    kt_check_true(m->name, s->work != NULL);
}

/* The words name one of the remedies. */
static bool names_remedy(const kt_error *error) {
    static const char *const words[] = {"kt_simulation", "kt_ensemble_run", "take a simulation", "switched",
                                        "loop",          "use the library"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        if (strstr(error->message, words[i]) != NULL)
            return true;
    return false;
}

static void check_call(const char *where, int k, const state *s, bool rejected) {
    kt_error error = {0};
    const kt_status status = calls[k].call(s, &error);
    const kt_status rejects = calls[k].call == codegen ? KT_ERROR_MODEL : KT_ERROR_UNSUPPORTED;
    const bool right = rejected ? status == rejects : status == KT_OK || calls[k].other;
    if (!right || (rejected && !names_remedy(&error)))
        kt_note("%s, %s: status %d, %s: %s", where, calls[k].name, (int)status, error.where, error.message);
    kt_check_true(calls[k].name, right);
    if (rejected)
        kt_check_true("the message names a remedy", names_remedy(&error));
}

/* At rest on the boundary, beyond it, and on the way into it: rejected. Free, and on the way out: computed. */
KT_TEST(open_contacts_that_touch_are_rejected_by_every_call) {
    for (int kind = 0; kind < FRICTION; kind++) {
        mechanism m;
        kt_model *model = NULL;
        state s;
        begin(&m, kind, &model, &s);
        const double at[][3] = {/* height, speed, whether it is rejected */
                                {0.0, 0.0, 1.0},  {-1e-12, 0.0, 1.0}, {-0.3, 0.0, 1.0},
                                {0.0, -1.0, 1.0}, {0.2, -0.1, 0.0},   {0.0, 0.5, 0.0}};
        for (size_t i = 0; i < sizeof at / sizeof at[0]; i++)
            for (int k = 0; k < CALLS; k++) {
                const bool rests = calls[k].call == equilibrium && at[i][0] <= 0.0; /* whatever its speed is */
                const bool rejected = at[i][2] > 0.0 || rests;
                s.q[0] = m.rests + at[i][0];
                s.v[0] = at[i][1];
                check_call(m.name, k, &s, rejected || calls[k].always);
            }
    }
}

/* The set lets friction slip forwards: at rest and backwards it would push. */
KT_TEST(friction_that_slips_the_other_way_is_rejected_by_every_call) {
    mechanism m;
    kt_model *model = NULL;
    state s;
    begin(&m, FRICTION, &model, &s);
    for (int way = -1; way <= 1; way++)
        for (int k = 0; k < CALLS; k++) {
            const bool steps = calls[k].call == step || calls[k].call == step_derivatives ||
                               calls[k].call == step_adjoint || calls[k].call == rollout || calls[k].call == rollouts ||
                               calls[k].call == floquet;
            s.v[0] = way;
            if (calls[k].call != equilibrium) /* there is none */
                check_call(m.name, k, &s, way < 1 || steps || calls[k].always);
        }
}

/* An arm of two bars in the xz plane, whose tip touches a slope through the origin. Its second body turns about the
 * first axis, y, or in space about z at first. The normal of the slope is n. */
static const double bar[2] = {1.0, 0.7}, ball = 0.1;
static const double n[3] = {0.28, 0.0, 0.96};

static kt_model *compile_arm(bool in_space) {
    kt_body body[2] = {kt_body_default(), kt_body_default()};
    kt_effect touch = kt_effect_default();
    for (int i = 0; i < 2; i++) {
        body[i].name = i == 0 ? "upper" : "lower";
        body[i].parent = i == 0 ? NULL : "upper";
        body[i].mass = 1.0;
        body[i].inertia = (kt_sym3){.xx = 0.1, .yy = 0.2, .zz = 0.3};
        body[i].joint.type = KT_JOINT_REVOLUTE;
        body[i].joint.axis = i == 0 && in_space ? kt_vec3_make(0.0, 0.0, 1.0) : kt_vec3_make(0.0, 1.0, 0.0);
    }
    body[1].joint.at = kt_vec3_make(bar[0], 0.0, 0.0);
    body[0].joint.position[0] = -0.5;
    body[1].joint.position[0] = -1.0;
    touch.name = "tip";
    touch.type = KT_EFFECT_CONTACT;
    touch.between[0].body = "lower";
    touch.between[0].at = kt_vec3_make(bar[1], 0.0, 0.0);
    touch.axis = kt_vec3_make(n[0], n[1], n[2]);
    touch.radius = ball;
    touch.restitution = 0.0;
    kt_description d = kt_description_of(body, 2, NULL, 0, &touch, 1);
    return kt_test_model(&d, NULL);
}

/* The distance of the tip from the slope in closed form, by the angles; its rate by differences. */
static double arm_gap(bool in_space, const double q[2], const double v[2], double h) {
    const double a = q[0] + h * v[0], b = q[1] + h * v[1], turn = in_space ? b : a + b;
    const double along = bar[1] * cos(turn), down = -bar[1] * sin(turn);
    const double x = in_space ? cos(a) * (bar[0] + along) : bar[0] * cos(a) + along;
    return n[0] * x + n[2] * (in_space ? down : down - bar[0] * sin(a)) - ball;
}

/* A state is rejected if the closed form has the gap closed and closing, and computed otherwise. NaN is no contact. */
KT_TEST(gaps_are_those_of_the_closed_form) {
    for (int in_space = 0; in_space < 2; in_space++) {
        kt_error error = {0};
        kt_model *model = compile_arm(in_space);
        int rejected = 0, computed = 0, wrong = 0;
        kt_data *data = kt_test_data(model);
        for (int k = 0; k < 500; k++) {
            const double q[2] = {3.1 * sin(1.7 * k), 3.1 * sin(2.3 * k + 1.0)}, v[2] = {sin(5.1 * k), cos(3.3 * k)};
            const double gap = arm_gap(in_space, q, v, 0.0);
            const double rate = (arm_gap(in_space, q, v, 1e-6) - arm_gap(in_space, q, v, -1e-6)) / 2e-6;
            double a[2];
            const kt_status status = kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error);
            const bool touches = gap <= 0.0 && rate <= 0.0;
            wrong += status != (touches ? KT_ERROR_UNSUPPORTED : KT_OK);
            *(touches ? &rejected : &computed) += 1;
        }
        kt_check_equal_int("states that the check takes otherwise", wrong, 0);
        kt_check_above("states that touch", rejected, 50);
        kt_check_above("states that do not", computed, 50);
        const double q[2] = {0.0, 1.0}, v[2] = {(double)NAN, 0.0};
        double a[2];
        kt_check_equal_int("NaN", kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error),
                           KT_ERROR_NOT_FINITE);
    }
}

/* A closed contact is a constraint: a = 0, and it bears the weight, 2 g. Friction that sticks bears it, too. Their
 * effects have no force of their own, and report that. */
KT_TEST(closed_contacts_bear_the_weight) {
    for (int kind = 0; kind < MECHANISMS; kind++) {
        mechanism m;
        kt_model *model = NULL;
        state s;
        kt_error error = {0};
        double a = 1.0, lambda = 0.0, quantity[16];
        begin(&m, kind, &model, &s);
        const int loop = kt_loop_count(model) - 1;
        kt_check_equal_int("closes", kt_loop_set_on(&s.model, s.data, loop, true, &error), KT_OK);
        kt_check_equal_int(m.name, kt_acceleration_evaluate(OF(&s), AT(&s), NULL, NULL, &a, &error), KT_OK);
        kt_check_near("acceleration", a, 0.0, 1e-14);
        kt_check_equal_int(m.name, kt_multiplier_evaluate(OF(&s), AT(&s), NULL, NULL, &lambda, &error), KT_OK);
        kt_check_near("reaction, N", fabs(lambda), 2.0 * g, 1e-13);
        if (kind != ROPE) {
            kt_effect_load load;
            kt_check_equal_int("kinematics", kt_kinematics_update(OF(&s), s.q, s.v, NULL, &error), KT_OK);
            kt_check_equal_int("effect", kt_effect_evaluate(OF(&s), AT(&s), 0, &load, &error), KT_ERROR_UNSUPPORTED);
            kt_check_contains("names the loop", error.message, kt_loop_name(model, loop));
            kt_check_equal_int("quantities", kt_effect_quantities_evaluate(OF(&s), AT(&s), quantity, &error), KT_OK);
            for (int k = 0; k < kt_effect_quantity_count(model, 0); k++)
                kt_check_true(kt_quantity_name(kt_effect_quantity_at(model, 0, k), true),
                              isnan(quantity[k]) == (kt_effect_quantity_at(model, 0, k) <= KT_QUANTITY_POWER));
        }
    }
}

/* In a simulation, callbacks and queries see contacts closed: its data follow them. */
KT_TEST(simulations_obey) {
    for (int kind = 0; kind < MECHANISMS; kind++) {
        mechanism m;
        kt_model *model = NULL;
        state s;
        kt_error error = {0};
        kt_run run = kt_run_default();
        double a = 1.0;
        begin(&m, kind, &model, &s);
        run.duration = 1.0;
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        kt_check_equal_int("state", kt_simulation_set_state(simulation, 0.0, s.q, s.v, &error), KT_OK);
        kt_check_equal_int(m.name, kt_simulation_acceleration(simulation, &a, &error), KT_OK);
        kt_check_near("acceleration", a, 0.0, 1e-14);
        s.model = kt_simulation_model(simulation);
        a = 1.0;
        s.data = kt_test_data(s.model);
        kt_check_equal_int("its set", kt_acceleration_evaluate(OF(&s), AT(&s), NULL, NULL, &a, &error), KT_OK);
        kt_check_near("acceleration", a, 0.0, 1e-14);
    }
}

/* A mass that begins 10 mm below its stop is set to 1 m, or moved there. It meets the stop at sqrt(2 h / g). Without
 * either, all calls that need the state report it, also after a rejected state. */
KT_TEST(start_below_the_floor_is_an_error_unless_a_state_follows) {
    const double above = 1.0, below = -0.5, still = 0.0, t = sqrt(2.0 / g);
    mechanism m;
    kt_error error = {0};
    kt_run run = kt_run_default();
    describe(&m, STOP);
    m.body.joint.position[0] = -0.01;
    run.integrator = "rk4";
    run.step = 1e-3;
    run.duration = 1.0;
    kt_model *model = kt_test_model(&m.description, NULL);
    for (int way = 0; way < 2; way++) {
        kt_record record;
        double a;
        kt_simulation *s = kt_test_simulation(model, &run, NULL);
        kt_check_equal_int("step", kt_simulation_step(s, 1e-3, &error), KT_ERROR_CONSTRAINT);
        kt_check_equal_int("sensors", kt_simulation_sense(s, &record, &error), KT_ERROR_CONSTRAINT);
        kt_check_equal_int("acceleration", kt_simulation_acceleration(s, &a, &error), KT_ERROR_CONSTRAINT);
        kt_check_equal_int("below", kt_simulation_set_state(s, 0.0, &below, &still, &error), KT_ERROR_CONSTRAINT);
        kt_check_equal_int("advance", kt_simulation_advance(s, 1.0, &error), KT_ERROR_CONSTRAINT);
        kt_check_contains("where", error.where, "at t = 0 s");
        kt_check_contains("that of the start", error.message, "0.01 (m or rad) beyond its boundary");
        kt_check_equal_int("above",
                           way == 0 ? kt_simulation_set_state(s, 0.0, &above, &still, &error)
                                    : kt_simulation_jump(s, &above, &still, &error),
                           KT_OK);
        kt_check_equal_int("falls", kt_simulation_advance(s, 0.9 * t, &error), KT_OK);
        kt_check_near("z", kt_simulation_positions(s)[0], 1.0 - 0.81, 1e-12);
        kt_check_equal_int("lands", kt_simulation_advance(s, 2.0 * t, &error), KT_OK);
        kt_check_near("z", kt_simulation_positions(s)[0], 0.0, 1e-12);
    }
}
