/* Contacts and friction of joints whose sets are masks: the same motion as by models of these sets, and closed forms of
 * friction. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>

#include "check.h"
#include "masks.h"
#include "motion/simulation/scenes.h"

enum { LINKS = 4 };

/* ---- trees ------------------------------------------------------------------------------------------------------- */

/* A tree of links with a stop each, a foot with friction, and perhaps a slack rope: seven switches. */
static void scene_tree(masks_scene *s, kt_loop *loop, kt_random *random) {
    masks_make(s);
    for (int i = 0; i < LINKS; i++) {
        double axis[3];
        kt_random_direction(random, 3, axis);
        const kt_joint_type type = kt_random_int(random, 0, 3) == 0 ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE;
        kt_body *body = masks_add_body(s, type, kt_vec3_make(axis[0], axis[1], axis[2]));
        body->parent = i > 0 ? s->name[kt_random_int(random, 0, i - 1)] : NULL;
        body->joint.at = kt_vec3_make(i > 0 ? 0.5 : 0.0, 0.0, 0.0);
        body->joint.velocity[0] = kt_random_uniform(random, -2.0, 2.0);
        body->mass = kt_random_uniform(random, 0.3, 2.0);
        body->com = kt_vec3_make(kt_random_uniform(random, -0.4, 0.4), kt_random_uniform(random, -0.4, 0.4), 0.2);
        body->inertia.xx = body->inertia.yy = body->inertia.zz = kt_random_uniform(random, 0.05, 0.3);
        kt_effect *stop = masks_add_effect(s, KT_EFFECT_JOINT_LIMIT);
        stop->joint = body->name;
        stop->lower = -kt_random_uniform(random, 0.1, 1.0);
        stop->restitution = kt_random_int(random, 0, 2) == 0 ? 0.0 : kt_random_uniform(random, 0.0, 0.9);
    }
    kt_effect *foot = masks_add_effect(s, KT_EFFECT_CONTACT);
    foot->between[0] = (kt_end){.body = s->name[LINKS - 1], .at = kt_vec3_make(0.4, 0.1, 0.0)};
    foot->between[1].at = kt_vec3_make(0.0, 0.0, -kt_random_uniform(random, 1.2, 1.8));
    foot->friction = kt_random_uniform(random, 0.1, 0.8);
    foot->restitution = kt_random_int(random, 0, 1) == 0 ? 0.0 : 0.3;
    *loop = kt_loop_of("rope", KT_LOOP_DISTANCE);
    loop->slack = true;
    loop->between[0].at = kt_vec3_make(0.3, 0.2, 2.0);
    loop->between[1] = (kt_end){.body = s->name[LINKS - 1], .at = kt_vec3_make(0.2, 0.0, 0.0)};
    loop->function = kt_function_constant(kt_random_uniform(random, 3.0, 4.0));
    s->description.loops = loop;
    s->description.loop_count = kt_random_int(random, 0, 1);
}

typedef struct end {
    double q[LINKS], v[LINKS], reaction[LINKS];
    kt_contact_counts counts;
} end;

/* The motion to the end of the first interval behind an impact, at which events have happened; false where it fails.
 * switches: up to so many of contacts have a model of each set. */
static bool run(const masks_scene *s, int switches, double time, const char *method, end *to) {
    kt_model_options options = kt_model_options_default();
    kt_error error = {0};
    kt_record record = {0};
    options.contact_switches = switches;
    kt_model *model = kt_test_model(&s->description, &options);
    kt_simulation *simulation = masks_start(model, method, 0.0);
    kt_status status = kt_simulation_advance(simulation, time, &error);
    if (status == KT_OK)
        status = kt_simulation_sense(simulation, &record, &error);
    if (status != KT_OK)
        kt_note("%s: %s", error.where, error.message);
    for (int i = 0; status == KT_OK && i < LINKS; i++) {
        const kt_coordinates at = kt_body_coordinates(model, kt_body_find(model, s->name[i]));
        to->q[i] = kt_simulation_positions(simulation)[at.q];
        to->v[i] = kt_simulation_velocities(simulation)[at.v];
    }
    for (int i = 0, k = 0; status == KT_OK && i < kt_loop_count(model) && k < LINKS; i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE)
            to->reaction[k++] = kt_vec3_norm(record.loop_reactions[i].force);
    to->counts = kt_simulation_contacts(simulation);
    return status == KT_OK;
}

/* The same trees, whose sets of contacts have models or are masks: the same motion. */
KT_TEST(masks_move_trees_as_the_models_of_their_sets_do) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5"};
    kt_random random = kt_random_named("masks");
    KT_WORST place = kt_worst_make("positions, m and rad"), rate = kt_worst_make("rates, m/s and rad/s");
    unsigned long long impacts = 0, sticks = 0;
    int failed = 0;
    for (int n = 0; n < 24; n++) {
        masks_scene s;
        kt_loop loop;
        end few, many;
        scene_tree(&s, &loop, &random);
        bool fine = run(&s, KT_SWITCH_MAX, 0.7, methods[n % 3], &few);
        fine = run(&s, 0, 0.7, methods[n % 3], &many) && fine;
        failed += !fine;
        for (int i = 0; fine && i < LINKS; i++) {
            kt_worst_near(&place, many.q[i], few.q[i], 1e-7, "tree %d joint %d", n, i);
            kt_worst_near(&rate, many.v[i], few.v[i], 1e-6, "tree %d joint %d", n, i);
        }
        impacts += fine ? many.counts.impacts : 0;
        sticks += fine ? many.counts.sticks : 0;
    }
    kt_note("%llu impacts, %llu sticks", impacts, sticks);
    kt_check_equal_int("failed", failed, 0);
    kt_check_equal_int("impacts", impacts > 50, 1);
}

/* ---- friction of joints ------------------------------------------------------------------------------------------ */

/* Sliders with dry friction, half of which slip backwards. The last one is released at first. */
static void scene_sliders(masks_scene *s, int sliders) {
    masks_make(s);
    for (int i = 0; i < sliders; i++) {
        kt_body *body = masks_add_body(s, KT_JOINT_PRISMATIC, kt_vec3_make(1.0, 0.0, 0.0));
        kt_effect *friction = masks_add_effect(s, KT_EFFECT_JOINT_FRICTION);
        body->joint.velocity[0] = (i % 2 == 0 ? 1.0 : -1.0) * (0.5 + 0.2 * i);
        friction->joint = body->name;
        friction->coulomb = 1.0 + 0.2 * i;
        friction->stribeck = 0.0;
        friction->restitution = kt_effect_default().restitution;
        friction->stick = true;
        friction->switching = i == sliders - 1 ? KT_SWITCHED_OFF : KT_ALWAYS_ON;
    }
}

/* A slider comes to rest after v^2 / (2 C). The one that is released goes on until it is engaged. At that time, the
 * second of many is released, and goes on at its speed. */
static void check_friction(int sliders, const char *method) {
    const double engaged = 0.55, last_time = 2.0;
    masks_scene s;
    scene_sliders(&s, sliders);
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = masks_start(model, method, 0.0);
    kt_error error = {0};
    kt_status status = kt_simulation_advance(simulation, engaged, &error);
    const double energy = status == KT_OK ? kt_scene_balance(simulation) : 0.0;
    if (status == KT_OK) {
        const int last = kt_effect_stick_loop(model, sliders - 1);
        kt_check_equal_int("released", kt_simulation_released(simulation) != 0, 1);
        kt_check_equal_int("its switch",
                           kt_simulation_released(simulation) == kt_switch_bits(model, kt_loop_switch(model, last)), 1);
        const int second = sliders > 1 ? kt_loop_switch(model, kt_effect_stick_loop(model, 1)) : -1;
        status = kt_simulation_set_released(simulation, kt_switch_bits(model, second), &error);
    }
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, last_time, &error);
    KT_WORST place = kt_worst_make("place, m"), rate = kt_worst_make("rate, m/s");
    for (int i = 0; kt_fine(method, status, &error) && i < sliders; i++) {
        const double v = s.body[i].joint.velocity[0], C = copysign(s.effect[i].coulomb, v), left = v - C * engaged;
        const double far = 0.5 * (v + left) * engaged + left * (last_time - engaged);
        const double path = i == 1 ? far : 0.5 * v * v / C;
        const int at = kt_body_coordinates(model, kt_body_find(model, s.name[i])).q;
        kt_worst_near(&place, kt_simulation_positions(simulation)[at], path + (i == sliders - 1 ? engaged * v : 0.0),
                      1e-9, "slider %d", i);
        kt_worst_near(&rate, kt_simulation_velocities(simulation)[at], i == 1 ? left : 0.0, i == 1 ? 1e-12 : 0.0,
                      "slider %d", i);
    }
    if (status == KT_OK)
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-9);
}

KT_TEST(friction_of_one_joint_or_of_many_stops_them) {
    static const char *const methods[] = {"dopri5", "radau5", "auto"};
    for (int m = 0; m < 3; m++) {
        check_friction(1, methods[m]);
        check_friction(12, methods[m]);
    }
}

KT_TEST(friction_that_sticks_in_more_joints_than_bits_is_rejected) {
    masks_scene s;
    scene_sliders(&s, 32);
    kt_scene_check_rejected("32 joints", &s.description, "friction that sticks in joints needs 64 switches");
}

/* A chain of three joints with friction swings, sticks and slips by models of sets and by masks alike. */
KT_TEST(masks_move_joints_with_friction_as_the_models_of_their_sets_do) {
    static const char *const methods[] = {"dopri5", "radau5", "steps"};
    for (int n = 0; n < 6; n++) {
        kt_random random = kt_random_named("joints");
        masks_scene s;
        kt_loop none;
        end few, many;
        for (int i = 0; i <= n; i++)
            scene_tree(&s, &none, &random);
        s.description.effect_count = s.description.loop_count = 0;
        for (int i = 0; i < LINKS; i++) {
            kt_effect *friction = masks_add_effect(&s, KT_EFFECT_JOINT_FRICTION);
            friction->joint = s.name[i];
            friction->coulomb = kt_random_uniform(&random, 0.5, 4.0);
            friction->breakaway = friction->coulomb * kt_random_uniform(&random, 1.0, 1.5);
            friction->stribeck = 0.0;
            friction->viscous = 0.1;
            friction->restitution = kt_effect_default().restitution;
            friction->stick = true;
        }
        const bool fine = run(&s, KT_SWITCH_MAX, 1.5, methods[n % 3], &few) && run(&s, 0, 1.5, methods[n % 3], &many);
        kt_check_equal_int("runs", fine, 1);
        for (int i = 0; fine && i < LINKS; i++) {
            kt_check_near("position", many.q[i], few.q[i], 1e-7);
            kt_check_near("rate", many.v[i], few.v[i], 1e-6);
        }
        if (fine)
            kt_note("%llu sticks, %llu slips", (unsigned long long)many.counts.sticks,
                    (unsigned long long)many.counts.slips);
    }
}

static int is_beyond(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[1] + 0.1; /* the second slider goes backwards */
    return 0;
}

/* Steps over contacts end at an event, and go on. */
KT_TEST(time_stepping_goes_on_behind_an_event) {
    const kt_event event = {.name = "beyond", .function = is_beyond, .limit = 1};
    masks_scene s;
    scene_sliders(&s, 3);
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = masks_start(model, "steps", 0.0);
    kt_error error = {0};
    kt_status status = kt_simulation_event_add(simulation, &event, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, 1.0, &error);
    kt_need_fine("runs", status, &error);
    const double v = s.body[1].joint.velocity[0];
    kt_check_near("path, m", kt_simulation_positions(simulation)[1], 0.5 * v * fabs(v) / s.effect[1].coulomb, 1e-6);
    kt_check_equal_int("stands", kt_simulation_velocities(simulation)[1] == 0.0, 1);
}
