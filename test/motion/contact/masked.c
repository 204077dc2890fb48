/* Hard contacts, stops and ropes whose sets have no models of their own: closed forms, memory and checkpoints. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "masks.h"
#include "motion/simulation/scenes.h"

enum { FEET = 8, SLIDERS = 8, MOST = MASKS_CONTACTS };
static const double g = MASKS_GRAVITY;

/* Sliders that never come to their stops, two each. */
static void add_far_stops(masks_scene *s, int count) {
    for (int i = 0; i < count; i++) {
        const char *name = masks_add_body(s, KT_JOINT_PRISMATIC, kt_vec3_make(1.0, 0.0, 0.0))->name;
        kt_effect *stop = masks_add_effect(s, KT_EFFECT_JOINT_LIMIT);
        stop->joint = name;
        stop->lower = -100.0;
        stop->upper = 100.0;
    }
}

/* A plate on feet in a circle below it. */
static void scene_plate(masks_scene *s, int feet, double friction) {
    masks_make(s);
    kt_body *plate = masks_add_body(s, KT_JOINT_FREE, kt_vec3_make(0.0, 0.0, 1.0));
    plate->inertia.xx = plate->inertia.yy = 0.1;
    plate->inertia.zz = 0.2;
    plate->markers = s->marker;
    plate->marker_count = feet;
    plate->joint.position[2] = 0.1;
    for (int i = 0; i < feet; i++) {
        const double angle = 6.283185307179586 * i / feet;
        char *name = s->name[MASKS_BODIES + i];
        (void)snprintf(name, sizeof s->name[0], "p%d", i);
        s->marker[i] = (kt_marker){.name = name, .at = kt_vec3_make(0.3 * cos(angle), 0.3 * sin(angle), -0.1)};
        kt_effect *foot = masks_add_effect(s, KT_EFFECT_CONTACT);
        foot->name = name;
        foot->between[0].body = plate->name;
        foot->between[0].marker = name;
        foot->friction = friction;
    }
}

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

/* Eight feet slide at v0 and come to rest after v0^2 / (2 mu g). On a slope below mu they stay at rest, and their
 * reactions carry the plate. */
KT_TEST(plate_on_eight_feet_slides_to_rest) {
    static const char *const methods[] = {"dopri5", "rk4", "radau5", "auto", NULL};
    const double mu = 0.3, v0 = 1.2, path = v0 * v0 / (2.0 * mu * g), time = v0 / (mu * g);
    masks_scene s;
    scene_plate(&s, FEET, mu);
    s.body[0].joint.velocity[0] = 0.6 * v0;
    s.body[0].joint.velocity[1] = -0.8 * v0;
    kt_model *model = kt_scene_compile(&s.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *simulation =
            masks_start(model, methods[m], methods[m] && strcmp(methods[m], "rk4") == 0 ? 0.01 : 0.0);
        kt_error error = {0};
        const double energy = kt_scene_balance(simulation);
        const kt_status status = kt_simulation_advance(simulation, 1.0, &error);
        kt_need_fine(methods[m] ? methods[m] : "default", status, &error);
        const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
        double most = 0.0;
        kt_record record = {0};
        for (int i = 0; i < 6; i++)
            most = fmax(most, fabs(v[i]));
        kt_check_near("path, m", hypot(q[0], q[1]), path, 1e-10);
        kt_check_near("direction", q[0] / q[1], -0.75, 1e-10);
        /* the rows of eight feet have rank six at most, and their redundancy leaves 400 units of rounding */
        kt_check_below("rests, m/s and rad/s", most, 1e-12);
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-10);
        kt_check_equal_int("sticks", kt_simulation_contacts(simulation).sticks > 0, 1);
        kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
        double force = 0.0;
        for (int i = 0; i < kt_loop_count(model); i++)
            force += kt_loop_side(model, i) != KT_SIDE_NONE ? record.loop_reactions[i].force.z : 0.0;
        kt_check_near("reactions, N", fabs(force), g, 1e-11);
    }
    kt_note("at rest from %.3g s", time);
}

/* Thrown plates rock on their rims, and creep: slip that turns round its rest ends, and so do the steps. They dissipate
 * exactly the energy that they lose. */
KT_TEST(thrown_plates_come_to_rest_in_few_steps) {
    static const char *const methods[] = {"dopri5", "radau5", "auto"};
    for (int feet = 6; feet <= 8; feet += 2) {
        masks_scene s;
        scene_plate(&s, feet, 0.3);
        s.body[0].joint.position[2] = 0.22;
        s.body[0].joint.velocity[0] = 1.0;
        s.body[0].joint.velocity[3] = 0.3;
        s.body[0].joint.velocity[4] = 0.2;
        s.body[0].joint.velocity[5] = 2.0;
        for (int i = 0; i < feet; i++)
            s.effect[i].restitution = 0.3;
        kt_model *model = kt_scene_compile(&s.description);
        for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
            kt_simulation *simulation = masks_start(model, methods[m], 0.0);
            kt_error error = {0};
            const double energy = kt_scene_balance(simulation);
            kt_status status = KT_OK;
            uint64_t steps = 0;
            while (status == KT_OK && steps < 40000) {
                status = kt_simulation_step(simulation, 2.0, &error);
                steps = kt_simulation_counts_of(simulation).steps;
                if (status == KT_OK && kt_simulation_time(simulation) >= 2.0)
                    break;
            }
            kt_need_fine(methods[m], status, &error);
            double most = 0.0;
            for (int i = 0; i < 6; i++)
                most = fmax(most, fabs(kt_simulation_velocities(simulation)[i]));
            kt_check_near("its end, s", kt_simulation_time(simulation), 2.0, 0.0);
            kt_check_below("steps", (double)steps, 4000.0);
            kt_check_below("rests, m/s and rad/s", most, 1e-9);
            kt_check_near("height, m", kt_simulation_positions(simulation)[2], 0.1, 1e-9);
            kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-8);
        }
    }
}

/* Sliders fall on stops of their own: between impacts parabolas, of which each is lower by e^2. */
static void check_sliders(int sliders) {
    const double end = 1.5;
    masks_scene s;
    masks_make(&s);
    for (int i = 0; i < sliders; i++) {
        kt_body *body = masks_add_body(&s, KT_JOINT_PRISMATIC, kt_vec3_make(0.0, 0.0, 1.0));
        kt_effect *stop = masks_add_effect(&s, KT_EFFECT_JOINT_LIMIT);
        body->joint.position[0] = 0.3 + 0.05 * (i % SLIDERS) + 1e-4 * i;
        stop->joint = body->name;
        stop->lower = 0.0;
        stop->upper = 10.0;
        stop->restitution = i % SLIDERS < 4 ? 0.0 : 0.5 + 0.03 * (i % SLIDERS);
    }
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = masks_start(model, "dopri5", 0.0);
    kt_error error = {0};
    KT_WORST place = kt_worst_make("height, m"), rate = kt_worst_make("rate, m/s");
    const kt_status status = kt_simulation_advance(simulation, end, &error);
    for (int i = 0; kt_fine("runs", status, &error) && i < sliders; i++) {
        const double e = s.effect[i].restitution;
        double t = sqrt(2.0 * s.body[i].joint.position[0] / g), v = e * g * t;
        while (v > 1e-9 && t + 2.0 * v / g < end) {
            t += 2.0 * v / g;
            v *= e;
        }
        const double left = v > 1e-9 ? end - t : 0.0;
        const int at = kt_body_coordinates(model, kt_body_find(model, s.name[i])).q;
        kt_worst_near(&place, kt_simulation_positions(simulation)[at], v * left - 0.5 * g * left * left, 1e-10,
                      "slider %d", i);
        kt_worst_near(&rate, kt_simulation_velocities(simulation)[at], left > 0.0 ? v - g * left : 0.0, 1e-9,
                      "slider %d", i);
    }
}

KT_TEST(eight_sliders_bounce_each_by_its_own_restitution) { check_sliders(SLIDERS); }

/* More than 62 contacts share two bits of a set. */
KT_TEST(seventy_sliders_bounce_each_by_its_own_restitution) { check_sliders(70); }

/* ---- models ------------------------------------------------------------------------------------------------------ */

/* Two models serve any number of contacts. Their memory grows by that of a contact for each. */
KT_TEST(models_of_contacts_grow_with_their_number) {
    static const int counts[] = {10, 20, 50, 200};
    for (int way = 0; way < 3; way++) {
        double size[4] = {0.0};
        for (int i = 0; i < 4; i++) {
            masks_scene s;
            if (way < 2)
                scene_plate(&s, counts[i], way == 0 ? 0.0 : 0.4);
            else
                masks_make(&s);
            if (way == 2)
                add_far_stops(&s, counts[i] / 2);
            kt_model *model = kt_scene_compile(&s.description);
            size[i] = (double)kt_model_size(model);
        }
        kt_note("%s: %.1f, %.1f, %.1f, %.1f kB",
                way == 0   ? "feet"
                : way == 1 ? "feet with friction"
                           : "stops",
                1e-3 * size[0], 1e-3 * size[1], 1e-3 * size[2], 1e-3 * size[3]);
        kt_check_below("bytes of ten", size[0], 200e3);
        kt_check_below("growth from 50 to 200, over 15 times that from 10 to 20",
                       (size[3] - size[2]) / (15.0 * (size[1] - size[0])), 1.05);
    }
}

/* Options choose how many switches of contacts have models of all sets. */
KT_TEST(options_make_models_of_all_sets) {
    for (int switches = 0; switches <= 4; switches += 2) {
        masks_scene s;
        kt_model_options options = kt_model_options_default();
        kt_model *model = NULL;
        kt_error error = {0};
        scene_plate(&s, 4, 0.0);
        options.contact_switches = switches;
        const kt_model *compiled = kt_test_model(&s.description, &options);
        if (compiled != NULL) {
            int sets = 0;
            for (uint64_t set = 0; set < 16; set++)
                sets += kt_model_switched(compiled, set) != NULL;
            kt_check_equal_int("sets with a model", sets, switches < 4 ? 2 : 16);
        }
        options.contact_switches = switches < 4 ? -1 - switches : KT_SWITCH_MAX + 1;
        kt_check_equal_int("out of range", kt_model_compile(&s.description, &options, &model, &error),
                           KT_ERROR_ARGUMENT);
        kt_check_text("where", error.where, "options.contact_switches");
    }
}

/* ---- memory, checkpoints, limits --------------------------------------------------------------------------------- */

/* A checkpoint holds the origin of a mask. At any time, the simulation and its restored copy go on with the same
 * bits. */
static void check_checkpoints(int feet) {
    masks_scene s;
    scene_plate(&s, feet, 0.4);
    s.body[0].joint.position[2] = 0.22;
    s.body[0].joint.velocity[0] = 1.0;
    s.body[0].joint.velocity[3] = 2.0;
    for (int i = 0; i < feet; i++)
        s.effect[i].restitution = 0.3;
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *one = masks_start(model, "dopri5", 0.0), *other = masks_start(model, "dopri5", 0.0);
    const size_t size = kt_simulation_state_size(one);
    void *block = malloc(size + 1);
    kt_error error = {0};
    int differ = 0, masked = 0;
    long allocations = 0;
    kt_status status = block != NULL ? KT_OK : KT_ERROR_MEMORY;
    for (int k = 1; status == KT_OK && k <= 60; k++) {
        kt_interpose_start();
        kt_simulation_save(one, block);
        status = kt_simulation_restore(other, block, &error);
        for (kt_simulation *next = one; status == KT_OK && next != NULL; next = next == one ? other : NULL)
            status = kt_simulation_advance(next, 0.03 * k, &error);
        allocations += kt_interpose_stop();
        differ += memcmp(kt_simulation_positions(one), kt_simulation_positions(other), 7 * sizeof(double)) != 0;
        differ += memcmp(kt_simulation_velocities(one), kt_simulation_velocities(other), 6 * sizeof(double)) != 0;
        masked += kt_switch_set(kt_simulation_model(one)) != 0;
    }
    kt_need_fine("runs", status, &error);
    kt_check_equal_int("states that differ", differ, 0);
    kt_check_equal_int("allocations", allocations, 0);
    kt_check_equal_int("closed at some", masked > 10, 1);
    free(block);
}

KT_TEST(masks_go_on_from_a_checkpoint_with_equal_bits_and_without_allocation) { check_checkpoints(7); }

/* 66 switches: contacts share bits. */
KT_TEST(masks_of_shared_bits_go_on_from_a_checkpoint) { check_checkpoints(33); }

/* A changed gravity takes effect while contacts are closed: the mask has it, too. */
KT_TEST(masks_take_parameters_over) {
    masks_scene s;
    scene_plate(&s, 7, 0.5);
    kt_model *compiled = kt_scene_compile(&s.description), *model = NULL;
    const size_t size = kt_model_size(compiled);
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_parameter gravity;
    kt_error error = {0};
    kt_record record = {0};
    const double lighter[3] = {0.0, 0.0, -1.5};
    kt_status status = memory != NULL ? kt_model_copy(compiled, memory, size, &model, &error) : KT_ERROR_MEMORY;
    kt_need_fine("copied", status, &error);
    kt_simulation *simulation = masks_start(model, "dopri5", 0.0);
    status = kt_simulation_advance(simulation, 0.1, &error);
    if (status == KT_OK)
        status = kt_parameter_find(model, "gravity", &gravity, &error);
    if (status == KT_OK)
        status = kt_simulation_set_parameter(simulation, model, &gravity, lighter, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, 0.2, &error);
    if (status == KT_OK)
        status = kt_simulation_sense(simulation, &record, &error);
    kt_need_fine("runs", status, &error);
    double force = 0.0;
    for (int i = 0; i < kt_loop_count(model); i++)
        force += kt_loop_side(model, i) != KT_SIDE_NONE ? record.loop_reactions[i].force.z : 0.0;
    kt_check_near("reactions, N", fabs(force), 1.5, 1e-12);
    free(memory);
}

/* All contacts may strike at once, yet matrices have room for a number of them that depends on the degrees of freedom.
 * The memory of simulations grows with the number of contacts, with friction and without. */
KT_TEST(simulations_grow_with_the_number_of_contacts) {
    static const int feet[] = {MOST / 4, MOST / 2, MOST};
    static const char *const name[] = {"events", "time stepping", "events, no friction", "time stepping, no friction"};
    for (int way = 0; way < 4; way++) {
        const bool stepping = way % 2;
        double size[3];
        kt_run run = kt_run_default();
        kt_simulation_options options = kt_simulation_options_default();
        run.integrator = stepping ? NULL : "dopri5";
        run.step = stepping ? 1e-3 : 0.0;
        options.contact = stepping ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
        for (int i = 0; i < 3; i++) {
            masks_scene s;
            scene_plate(&s, feet[i], way < 2 ? 0.4 : 0.0);
            kt_model *model = kt_scene_compile(&s.description);
            size[i] = (double)kt_simulation_size(model, &run, &options);
        }
        kt_note("%s: %.2f MB", name[way], 1e-6 * size[2]);
        kt_check_below("400 feet over 200", size[2] / size[1], 2.1);
        kt_check_below("growth by 200 feet, over that by 100", (size[2] - size[1]) / (size[1] - size[0]), 2.0 * 1.05);
        kt_check_below("bytes for each of these", (size[2] - size[1]) / (MOST / 2), 14e3);
    }
}

/* A plate on many feet that slide: the same motion as on three. Without friction it goes on. More than 32 feet are
 * solved on a working set. */
KT_TEST(plate_on_many_feet_slides_as_on_three) {
    const double mu = 0.3, v0 = 1.2, path = v0 * v0 / (2.0 * mu * g);
    static const int feet[] = {32, 33, 70, MOST, 70, MOST};
    for (int i = 0; i < 6; i++) {
        const bool slides = i < 4;
        masks_scene s;
        scene_plate(&s, feet[i], slides ? mu : 0.0);
        s.body[0].joint.velocity[0] = 0.6 * v0;
        s.body[0].joint.velocity[1] = -0.8 * v0;
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = masks_start(model, "dopri5", 0.0);
        kt_error error = {0};
        const kt_status status = kt_simulation_advance(simulation, 1.0, &error);
        kt_note("%d feet", feet[i]);
        kt_need_fine("runs", status, &error);
        const double *q = kt_simulation_positions(simulation);
        kt_check_near("path, m", hypot(q[0], q[1]), slides ? path : v0, 1e-10);
        kt_check_near("height, m", q[2], 0.1, 1e-10);
    }
}

/* A plate falls flat on many feet, which strike at once, and slides on. The impulses of all feet remove the speed of
 * the fall, and friction takes mu times that from the speed along the floor. */
KT_TEST(plate_falls_on_many_feet_at_once) {
    const double mu = 0.3, v0 = 1.2, drop = 0.01, fall = sqrt(2.0 * g * drop), speed = v0 - mu * fall;
    static const int feet[] = {16, 33, KT_SHORT(100, MOST)}; /* the long tier has the most */
    for (int way = 0; way < 6; way++) {
        const bool stepping = way >= 3;
        kt_simulation_options options = kt_simulation_options_default();
        kt_run run = kt_run_fixed(stepping ? NULL : "dopri5", stepping ? 1e-3 : 0.0, 1.0);
        run.relative = run.absolute = 1e-11;
        options.contact = stepping ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
        masks_scene s;
        scene_plate(&s, feet[way % 3], mu);
        s.body[0].joint.position[2] = 0.1 + drop;
        s.body[0].joint.velocity[0] = v0;
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = kt_test_simulation(model, &run, &options);
        kt_error error = {0};
        const kt_status status = kt_simulation_advance(simulation, 0.1, &error);
        kt_note("%d feet, %s", feet[way % 3], stepping ? "time stepping" : "events");
        kt_need_fine("runs", status, &error);
        const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
        const double later = 0.1 - fall / g;
        kt_check_near("speed, m/s", v[0], speed - mu * g * later, 1e-10);
        kt_check_near("height, m", q[2], 0.1, 1e-10);
        kt_check_below("turning, rad/s", fmax(fmax(fabs(v[3]), fabs(v[4])), fabs(v[5])), 1e-10);
    }
}

/* A set between none and all has no model without a simulation: closing one of its contacts by hand is rejected. */
KT_TEST(single_contacts_are_closed_by_a_simulation_alone) {
    masks_scene s;
    scene_plate(&s, 7, 0.0);
    add_far_stops(&s, 2);
    kt_model *compiled = kt_scene_compile(&s.description);
    const kt_model *model = compiled;
    kt_error error = {0};
    kt_check_equal_int("one", kt_loop_set_on(&model, NULL, kt_loop_find(model, "p0"), true, &error),
                       KT_ERROR_UNSUPPORTED);
    kt_check_contains("words", error.message, "that only a simulation closes and opens");
    kt_check_true("the model stays", model == compiled);
}
