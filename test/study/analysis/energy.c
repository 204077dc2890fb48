/* The effects of forces and loops on the energy, and the judgement of the energy watch on a run's records. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"

#include "kinetree/analysis.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- what a scene can do to its energy --------------------------------------------------------------------------- */

/* Two blocks on slides, one above the other, and the parts attached to them. */
typedef struct scene {
    kt_description description;
    kt_body body[2];
    kt_effect effect;
    kt_loop loop;
} scene;

static void scene_begin(scene *s) {
    static const char *const names[2] = {"low", "high"};
    memset(s, 0, sizeof *s);
    s->description = kt_description_of(s->body, 2, NULL, 0, NULL, 0);
    for (int i = 0; i < 2; i++) {
        s->body[i] = kt_body_of(names[i], NULL, KT_JOINT_PRISMATIC, 1.0);
        s->body[i].joint.position[0] = 1.0 + i;
        s->body[i].inertia = (kt_sym3){.xx = 1.0, .yy = 1.0, .zz = 1.0};
    }
    s->effect = kt_effect_default();
    s->effect.joint = names[0];
    s->effect.between[0].body = names[0];
    s->effect.between[1].body = names[1];
}

static int energetics_of(const scene *s) {
    kt_error error = {0};
    kt_model *model = NULL;
    int result = -1;
    if (kt_check_equal_int("compiles", kt_model_compile(&s->description, NULL, &model, &error), KT_OK))
        result = (int)kt_model_energetics(model);
    else
        kt_check_text("why", error.message, "");
    kt_model_free(model);
    return result;
}

static kt_function constant(double value) { return (kt_function){.type = KT_FUNCTION_CONSTANT, .value = value}; }

/* Each type with the numbers that make it dissipate, or drive, and without. */
KT_TEST(effects_tell_what_they_can_do_to_the_energy) {
    scene s;
    for (int type = 0; type < KT_EFFECT_TYPE_COUNT; type++)
        for (int lossy = 0; lossy < 2; lossy++) {
            scene_begin(&s);
            kt_effect *e = &s.effect;
            kt_energetics expected = lossy ? KT_ENERGY_DISSIPATED : KT_ENERGY_CONSERVED;
            const double c = lossy ? 0.5 : 0.0;
            s.description.effects = e;
            s.description.effect_count = 1;
            e->type = (kt_effect_type)type;
            e->stiffness = 3.0;
            e->lower = -1.0;
            e->damping = e->dampings[4] = e->viscous = e->quadratic = c;
            e->friction = type == KT_EFFECT_CONTACT ? c : 0.0;
            e->strength = 1.0;
            if (type == KT_EFFECT_EXPRESSION) {
                e->formula[0] = "1";
                expected = KT_ENERGY_SUPPLIED;
            }
            e->torque = e->value[0] = e->value[1] = constant(0.0);
            e->mass = lossy ? kt_function_ramp(1.0, 0.5, 0.0, 1.0) : constant(1.0); /* of a thrust */
            e->value[2] = constant(c);
            if (type == KT_EFFECT_MOTOR)
                e->torque = constant(c);
            if (type == KT_EFFECT_ATTRACTION)
                expected = KT_ENERGY_CONSERVED;
            if (type == KT_EFFECT_SERVO) {
                e->target = constant(0.0);
                expected = KT_ENERGY_SUPPLIED;
            }
            if (type == KT_EFFECT_FORCE || type == KT_EFFECT_TORQUE || type == KT_EFFECT_MOTOR ||
                type == KT_EFFECT_THRUST)
                expected = lossy ? KT_ENERGY_SUPPLIED : KT_ENERGY_CONSERVED;
            kt_check_equal_int(kt_effect_type_name((kt_effect_type)type), energetics_of(&s), (int)expected);
        }
}

KT_TEST(other_numbers_that_dissipate_count_too) {
    scene s;
    for (int i = 0; i < 4; i++) {
        scene_begin(&s);
        s.description.effects = &s.effect;
        s.description.effect_count = 1;
        s.effect.stiffness = 1.0;
        s.effect.type = i < 2 ? KT_EFFECT_JOINT_FRICTION : i == 2 ? KT_EFFECT_DRAG : KT_EFFECT_CONTACT;
        s.effect.coulomb = i == 0;
        s.effect.breakaway = i == 1;
        s.effect.linear = i == 2;
        s.effect.dissipation = i == 3;
        kt_check_equal_int("dissipates", energetics_of(&s), KT_ENERGY_DISSIPATED);
    }
}

static int push(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    (void)user, (void)t, (void)ends, (void)wrenches, (void)balance;
    return 0;
}

/* The strongest of all parts counts: a motor next to a damper; a loop that is driven. */
KT_TEST(functions_of_time_and_own_effects_supply_energy) {
    scene s;
    kt_effect effects[2];
    scene_begin(&s);
    effects[0] = effects[1] = s.effect;
    effects[0].type = KT_EFFECT_MOTOR;
    effects[0].torque = (kt_function){.type = KT_FUNCTION_SINE, .amplitude = 1.0, .frequency = 1.0};
    effects[1].type = KT_EFFECT_JOINT_DAMPER;
    effects[1].damping = 1.0;
    s.description.effects = effects;
    s.description.effect_count = 2;
    kt_check_equal_int("motor and damper", energetics_of(&s), KT_ENERGY_SUPPLIED);
    effects[0].type = KT_EFFECT_CUSTOM;
    effects[0].wrench = push;
    effects[0].end_count = 2;
    kt_check_equal_int("the caller's", energetics_of(&s), KT_ENERGY_SUPPLIED);
    static const double line[2] = {1.0, 1.0};
    for (int driven = 0; driven < 2; driven++) {
        scene_begin(&s);
        s.loop = kt_loop_of("motion", KT_LOOP_MOTION);
        s.loop.joint = "low";
        s.loop.function = constant(1.0);
        if (driven)
            s.loop.function = (kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = line, .number_count = 2};
        s.description.loops = &s.loop;
        s.description.loop_count = 1;
        kt_check_equal_int("a motion", energetics_of(&s), driven ? KT_ENERGY_SUPPLIED : KT_ENERGY_CONSERVED);
    }
}

/* A loop that closes ends a motion, and an effect brings its stored energy along. */
KT_TEST(what_is_switched_counts_where_it_is_off_too) {
    scene s;
    for (int switching = KT_ALWAYS_ON; switching <= KT_SWITCHED_OFF; switching++) {
        const bool switched = switching != KT_ALWAYS_ON;
        scene_begin(&s);
        s.loop = kt_loop_of("motion", KT_LOOP_MOTION);
        s.loop.joint = "low";
        s.loop.function = constant(1.0);
        s.loop.switching = (kt_switching)switching;
        s.description.loops = &s.loop;
        s.description.loop_count = 1;
        kt_check_equal_int("loop", energetics_of(&s), switched ? KT_ENERGY_DISSIPATED : KT_ENERGY_CONSERVED);
        s.description.loop_count = 0;
        s.effect.type = KT_EFFECT_JOINT_SPRING;
        s.effect.stiffness = 2.0;
        s.effect.switching = (kt_switching)switching;
        s.description.effects = &s.effect;
        s.description.effect_count = 1;
        kt_check_equal_int("spring", energetics_of(&s), switched ? KT_ENERGY_SUPPLIED : KT_ENERGY_CONSERVED);
    }
}

/* ---- the watch --------------------------------------------------------------------------------------------------- */

static kt_energy_watch watch_of(kt_energetics energetics) {
    return (kt_energy_watch){.energetics = energetics, .excess_time = (double)NAN};
}

/* A record with these energies; works NaN where they are not recorded. */
static void add(kt_energy_watch *watch, double time, double kinetic, double potential, double dissipated,
                double supplied) {
    kt_record record = {.t = time, .kinetic = kinetic, .potential = potential};
    record.work = (kt_work){dissipated, supplied};
    record.estimate = (kt_work_estimate){(double)NAN, (double)NAN, (double)NAN};
    kt_energy_watch_add(watch, &record);
}

static const double none = (double)NAN;

/* The supply is 4 J of 10 J. The rest is dissipated, as estimated to 0.5 J. A larger gap in the balance is an error. */
KT_TEST(estimated_works_are_believed_up_to_their_uncertainty) {
    static const double missing[] = {0.0, 0.4, 0.6}, error[] = {0.0, 0.0, 0.1};
    for (int i = 0; i < 3; i++) {
        kt_energy_watch watch = watch_of(KT_ENERGY_SUPPLIED);
        kt_record record = {.kinetic = 10.0, .work = {none, none}, .estimate = {0.0, 0.0, 0.0}};
        kt_energy_watch_add(&watch, &record);
        record = (kt_record){.t = 1.0, .kinetic = 8.0 - missing[i], .work = {none, none}, .estimate = {2.0, 0.5, 10.0}};
        kt_energy_watch_add(&watch, &record);
        kt_check_true("estimated", watch.has_estimate && !watch.has_balance);
        kt_check_near("imbalance", watch.balance_change, missing[i], 1e-14);
        kt_check_near("error", watch.error, error[i], 1e-14);
        kt_check_near("uncertainty", watch.uncertainty, 0.5, 0.0);
    }
}

/* A pendulum of 10 J, its potential counted from anywhere: at the bottom all is kinetic. */
KT_TEST(scale_does_not_depend_on_where_potentials_are_counted_from) {
    static const double base[] = {0.0, 1e5, -1e5};
    for (int i = 0; i < 3; i++) {
        kt_energy_watch watch = watch_of(KT_ENERGY_CONSERVED);
        add(&watch, 0.0, 0.0, base[i] + 10.0, none, none);
        add(&watch, 1.0, 10.0, base[i], none, none);
        add(&watch, 2.0, 2.0, base[i] + 8.0, none, none);
        kt_check_near("scale", kt_energy_watch_scale(&watch), 10.0, 2e5 * DBL_EPSILON);
        kt_check_below("error", kt_energy_watch_error(&watch), 1e5 * DBL_EPSILON);
        kt_check_true("never in excess", isnan(watch.excess_time));
    }
}

/* At 1e-3 of 10 J it is no error yet, above it is: of loss and of gain. */
KT_TEST(loss_counts_like_gain) {
    static const double change[] = {0.00999, -0.00999, 0.01001, -0.01001};
    for (int i = 0; i < 4; i++) {
        kt_energy_watch watch = watch_of(KT_ENERGY_CONSERVED);
        add(&watch, 0.0, 0.0, 10.0, none, none);
        add(&watch, 1.0, 10.0, 0.0, none, none);
        add(&watch, 2.0, 5.0, 5.0 + change[i], none, none);
        add(&watch, 3.0, 5.0, 5.0 + change[i], none, none);
        kt_check_near("error", kt_energy_watch_error(&watch), 0.1 * fabs(change[i]), 1e-15);
        kt_check_true("in excess", (watch.excess_time == 2.0) == (i >= 2));
    }
}

/* An excess may be large compared with the little that has moved so far, and small compared with the whole. */
KT_TEST(excess_of_a_beginning_is_forgotten) {
    kt_energy_watch watch = watch_of(KT_ENERGY_CONSERVED);
    add(&watch, 0.0, 0.0, 10.0, none, none);
    add(&watch, 0.1, 0.0101, 9.99, none, none);
    kt_check_near("at first", watch.excess_time, 0.1, 0.0);
    add(&watch, 1.0, 10.0, 0.0, none, none);
    kt_check_true("not in the end", isnan(watch.excess_time));
}

KT_TEST(what_dissipates_may_lose_and_not_gain) {
    kt_energy_watch watch = watch_of(KT_ENERGY_DISSIPATED);
    add(&watch, 0.0, 0.0, 10.0, none, none);
    add(&watch, 1.0, 4.0, 0.0, none, none);
    kt_check_near("a loss is none", kt_energy_watch_error(&watch), 0.0, 0.0);
    add(&watch, 2.0, 0.0, 4.5, none, none);
    kt_check_near("a rise is an error", kt_energy_watch_error(&watch), 0.05, 1e-15);
    add(&watch, 3.0, 0.0, 1.0, none, none);
    kt_check_near("and stays one", kt_energy_watch_error(&watch), 0.05, 1e-15);
}

KT_TEST(what_is_driven_is_judged_by_its_balance_alone) {
    kt_energy_watch watch = watch_of(KT_ENERGY_SUPPLIED);
    add(&watch, 0.0, 0.0, 0.0, none, none);
    add(&watch, 1.0, 1e9, 0.0, none, none);
    kt_check_near("unknown", kt_energy_watch_error(&watch), 0.0, 0.0);
    kt_check_true("no blow-up", !kt_energy_watch_is_blown_up(&watch));
    watch = watch_of(KT_ENERGY_SUPPLIED);
    add(&watch, 0.0, 0.0, 0.0, 0.0, 0.0);
    add(&watch, 1.0, 60.0, 0.0, 40.0, 100.0);
    kt_check_near("it closes", kt_energy_watch_error(&watch), 0.0, 0.0);
    add(&watch, 2.0, 60.0, 0.0, 40.0, 101.0);
    kt_check_near("it is open by 1 J of 101", kt_energy_watch_error(&watch), 1.0 / 101.0, 1e-15);
    watch = watch_of(KT_ENERGY_DISSIPATED);
    add(&watch, 0.0, 0.0, 10.0, 0.0, 0.0);
    add(&watch, 1.0, 0.0, 0.0, 9.0, 0.0);
    kt_check_near("a loss that no damper has taken", kt_energy_watch_error(&watch), 0.1, 1e-15);
}

/* A thousandfold of the scale; of a prestressed mechanism at rest, whose motion has no energy, more than it stores. */
KT_TEST(blow_up_is_a_thousandfold_gain) {
    for (int i = 0; i < 2; i++) {
        kt_energy_watch watch = watch_of(i ? KT_ENERGY_DISSIPATED : KT_ENERGY_CONSERVED);
        add(&watch, 0.0, 10.0, 0.0, none, none);
        add(&watch, 1.0, 10009.0, 0.0, none, none);
        kt_check_true("not yet", !kt_energy_watch_is_blown_up(&watch));
        add(&watch, 2.0, 10011.0, 0.0, none, none);
        kt_check_true("now", kt_energy_watch_is_blown_up(&watch));
    }
    kt_energy_watch watch = watch_of(KT_ENERGY_CONSERVED);
    add(&watch, 0.0, 0.0, 100.0, none, none);
    add(&watch, 1.0, 1.0, 100.0, none, none);
    kt_check_true("noise of a mechanism under load", !kt_energy_watch_is_blown_up(&watch));
    add(&watch, 2.0, 101.0, 100.0, none, none);
    kt_check_true("more than its load", kt_energy_watch_is_blown_up(&watch));
}

/* An elastic mechanism at rest without gravity: its energy is that of rounding, until it blows up. */
KT_TEST(rounding_of_a_mechanism_at_rest_is_neither_an_error_nor_a_blow_up) {
    kt_energy_watch watch = watch_of(KT_ENERGY_DISSIPATED);
    add(&watch, 0.0, 0.0, 1e-45, none, none);
    add(&watch, 0.1, 1e-28, 0.0, none, none);
    add(&watch, 0.2, 3e-27, 2e-26, none, none);
    kt_check_near("no error", kt_energy_watch_error(&watch), 0.0, 0.0);
    kt_check_true("no blow-up", !kt_energy_watch_is_blown_up(&watch));
    add(&watch, 0.3, 1e-10, 0.0, none, none);
    kt_check_true("a blow-up", kt_energy_watch_is_blown_up(&watch));
    kt_check_above("and an error", kt_energy_watch_error(&watch), 1.0);
}

KT_TEST(records_without_energy_say_nothing) {
    kt_energy_watch watch = watch_of(KT_ENERGY_CONSERVED);
    add(&watch, 0.0, none, none, none, none);
    add(&watch, 1.0, 1.0, none, none, none); /* an effect of the caller's without a potential */
    kt_check_equal_int("none taken", (long long)watch.records, 0);
    kt_check_near("no error", kt_energy_watch_error(&watch), 0.0, 0.0);
    add(&watch, 2.0, 0.0, 0.0, none, none);
    add(&watch, 3.0, 1e-30, 0.0, none, none);
    kt_check_near("nothing to be held against", kt_energy_watch_error(&watch), 0.0, 0.0);
    kt_check_true("no blow-up", !kt_energy_watch_is_blown_up(&watch));
}
