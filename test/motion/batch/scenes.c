/* Every bundled scene as a batch, and random linkages: with effects and loops, in lanes and state by state. The states
 * lie around the initial one, loops closed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closures.h"
#include "files/scene/collect.h"
#include "fixture.h"
#include "linkages.h"
#include "many.h"
#include "ropes.h"
#include "scene_files.h"

#include "dynamics/dynamics.h"
#include "kinetree/closure.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* States that differ from the initial one by `most` in positions, and in velocities and forces. */
static void draw_states(kt_many *many, kt_data *data, double most, kt_random *random) {
    double *step = calloc(many->nv + 1, sizeof *step);
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        double *q = many->q + i * many->nq, *v = many->v + i * many->nv;
        for (size_t k = 0; k < many->nv; k++) {
            step[k] = kt_random_uniform(random, -most, most);
            v[k] += kt_random_uniform(random, -0.1, 0.1);
            many->tau[i * many->nv + k] = kt_random_uniform(random, -1.0, 1.0);
            many->a[i * many->nv + k] = kt_random_uniform(random, -1.0, 1.0);
        }
        kt_position_add(many->model, q, step, q);
        if (kt_state_project(many->model, data, many->t[i], q, v, NULL, NULL) != KT_OK)
            kt_note("state %zu: its loops stay open", i);
    }
    free(step);
}

typedef struct sums {
    int scenes, in_lanes, different, rejected;
} sums;

static bool has_contacts(const kt_model *model) {
    for (int i = 0; i < kt_loop_count(model); i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE || kt_loop_is_stick(model, i))
            return true;
    return false;
}

/* Steps of a batch do not follow events of hard contacts. */
static int count_rejections(kt_many *many) {
    kt_error error = {.code = KT_OK};
    kt_check_equal_int("steps", kt_batch_step(many->batch, 1e-4, 1, &error), KT_ERROR_UNSUPPORTED);
    kt_check_contains("with the remedy", error.message, "kt_ensemble_run");
    kt_check_equal_int("semi-implicit steps", kt_batch_step_semi_implicit(many->batch, 1e-4, 1, &error),
                       KT_ERROR_UNSUPPORTED);
    return 1;
}

static void compare(const char *name, const kt_scene *scene, kt_random *random, sums *s) {
    kt_model_options options = kt_model_options_default();
    kt_many many;
    kt_error error;
    options.metric = scene->run.metric;
    kt_model *model = kt_test_model(&scene->description, &options);
    kt_data *data = kt_test_data(model);
    if (kt_has_variable_mass(&scene->description)) { /* which a batch does not carry, and rejects */
        kt_batch *batch = NULL;
        const kt_batch_options one = kt_batch_options_default();
        kt_check_true("variable masses are rejected", kt_batch_create(model, &one, &batch, &error) != KT_OK);
        kt_batch_free(batch);
    } else if (kt_many_make(&many, model, kt_method_find("rk4"))) {
        draw_states(&many, data, 0.02, random);
        int different = kt_many_compare_forward(&many, data) + kt_many_compare_inverse(&many, data) +
                        kt_many_compare_sensors(&many, data);
        if (has_contacts(model))
            s->rejected += count_rejections(&many);
        else if (many.nv <= 200) /* of large ones each step takes long, state by state, and again */
            different +=
                kt_many_compare_steps(&many, data, 1e-4, 2) + kt_many_compare_semi_implicit(&many, data, 1e-4, 2);
        const kt_batch_report report = kt_batch_report_of(many.batch);
        if (different > 0)
            kt_note("%s: %d differ", name, different);
        s->scenes++;
        s->different += different;
        s->in_lanes += report.in_lanes > report.alone;
        if (report.width == 1 && report.why == NULL)
            kt_check_true("it says why it is computed state by state", false);
        kt_many_free(&many);
    }
}

KT_TEST(bundled_scenes_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    sums s = {0, 0, 0, 0};
    for (int i = 0; kt_bundled(i) != NULL; i++)
        compare(kt_bundled(i), kt_test_bundled(kt_bundled(i)), &random, &s);
    kt_note("%d scenes, %d of them in lanes; steps of %d are rejected", s.scenes, s.in_lanes, s.rejected);
    kt_check_above("rejected", s.rejected, 3);
    kt_check_above("scenes", s.scenes, 50);
    kt_check_above("scenes in lanes", s.in_lanes, 65);
    kt_check_equal_int("results that differ", s.different, 0);
}

/* A mass that falls 1 m onto a hard stop, or slides with friction that sticks. */
static kt_status take_step(const char *effect, double h, double q[1], kt_error *error) {
    char text[512];
    kt_scene scene;
    kt_model *model = NULL;
    kt_data *data = NULL;
    double v[1] = {0.0};
    snprintf(text, sizeof text,
             "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies: [{name: mass, mass: 1, joint: {type: prismatic, axis: z}}]\n"
             "effects: [{name: bound, joint: mass, %s}]\n",
             effect);
    const kt_step step = {.method = kt_method_find("rk4"), .h = h};
    kt_check_equal_int("scene", kt_scene_parse("s", text, strlen(text), &scene, NULL, NULL, error), KT_OK);
    kt_status status = kt_model_compile(&scene.description, NULL, &model, error);
    if (status == KT_OK)
        status = kt_data_create(model, &data, error);
    const size_t size = kt_step_work_size(model, step.method);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    q[0] = 1.0;
    if (status == KT_OK)
        status = kt_step_evaluate(model, data, work, size, &step, q, v, q, v, error);
    free(work);
    kt_data_free(data);
    kt_model_free(model);
    kt_scene_free(&scene);
    return status;
}

KT_TEST(a_step_that_would_pass_a_hard_stop_is_rejected) {
    static const char stop[] = "type: joint_limit, lower: 0, restitution: 0.5";
    kt_error error = {.code = KT_OK};
    double q[1];
    kt_check_equal_int("above it", take_step(stop, 0.4, q, &error), KT_OK);
    kt_check_near("free fall", q[0], 1.0 - 0.5 * 9.81 * 0.16, 1e-15);
    kt_check_equal_int("through it", take_step(stop, 0.5, q, &error), KT_ERROR_UNSUPPORTED);
    kt_check_near("q stays", q[0], 1.0, 0.0);
    kt_check_contains("the effect", error.where, "bound");
    kt_check_contains("the remedy", error.message, "kt_simulation_advance");
    kt_check_equal_int("sticks", take_step("type: joint_friction, coulomb: 20, stick: true", 0.1, q, &error),
                       KT_ERROR_UNSUPPORTED);
    kt_check_contains("the effect", error.where, "bound");
    kt_check_contains("the remedy", error.message, "kt_simulation_advance");
}

/* An effect in the coordinate of a loop is not computed in lanes, nor are the others of such a model. */
KT_TEST(effects_in_coordinates_of_loops_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    sums s = {0, 0, 0, 0};
    kt_effect spring = kt_effect_of(KT_EFFECT_JOINT_SPRING, "close");
    spring.stiffness = 3.0;
    kt_scene scene = *kt_test_bundled("four-bar");
    scene.description.effects = &spring;
    scene.description.effect_count = 1;
    compare("four-bar with a spring in its loop", &scene, &random, &s);
    kt_check_equal_int("scenes in lanes", s.in_lanes, 0);
    kt_check_equal_int("results that differ", s.different, 0);
}

/* Machine elements: teeth, belts, rigid and elastic ropes, and friction from loads. Wheels of the plane are computed
 * state by state, as are effects in coordinates of loops and friction from loads. */
KT_TEST(machine_elements_have_the_bits_of_single_states) {
    static const char bodies[] =
        "kinetree: 1\nbodies:\n"
        "  - {name: a, joint: {type: revolute, axis: z, velocity: 3}, mass: 1, inertia: [1, 1, 0.002]}\n"
        "  - {name: b, joint: {type: revolute, axis: z, at: [0.5, 0, 0]}, mass: 4, inertia: [1, 1, 0.05]}\n";
    static const char across[] =
        "  - {name: c, parent: b, joint: {type: revolute, axis: x}, mass: 1, com: [0, 0.1, 0.1], "
        "inertia: [1, 1, 1]}\n";
    static const struct {
        const char *name, *loops, *effects;
        bool in_lanes; /* with a body across, so that nothing is planar */
    } table[] = {
        {"gear", "{name: u, type: gear, between: [a, b], teeth: 20, teeth2: 60}", "", true},
        {"belt", "{name: u, type: belt, between: [a, b], radius: 0.05, radius2: 0.15, tension: 50}", "", true},
        {"span", "{name: u, type: span, between: [a, b], radius: 0.05, radius2: -0.15, tension: 20}", "", true},
        {"elastic", "{name: u, type: span, between: [a, b], radius: 0.05, radius2: 0.15, switched: never}",
         "  - {type: joint_spring, joint: u, stiffness: 8e4, rest: -0.002}\n"
         "  - {type: joint_damper, joint: u, damping: 3}\n",
         false},
        {"slack", "{name: u, type: span, between: [a, b], radius: -0.05, radius2: 0.15, switched: never}",
         "  - {type: joint_limit, joint: u, upper: 0, stiffness: 8e4, damping: 5}\n", false},
        {"formula", "{name: u, type: span, between: [a, b], radius: 0.05, switched: never}",
         "  - {type: expression, joint: u, force: \"-1e3 * position.u - 2 * velocity.u\"}\n", false},
        {"friction", "{name: u, type: gear, between: [a, b], teeth: 20, teeth2: 60}",
         "  - {type: joint_friction, joint: b, coefficient: 0.2, radius: 0.02}\n", false},
    };
    kt_random random = kt_random_of_test();
    for (size_t i = 0; i < 2 * sizeof table / sizeof *table; i++) {
        const bool in_space = i % 2 == 1;
        char text[1200];
        kt_scene scene;
        kt_error error = {.code = KT_OK};
        sums s = {0, 0, 0, 0};
        (void)snprintf(text, sizeof text, "%s%sloops:\n  - %s\neffects:\n  - {type: motor, joint: a, torque: 0.1}\n%s",
                       bodies, in_space ? across : "", table[i / 2].loops, table[i / 2].effects);
        kt_need_fine(table[i / 2].name, kt_scene_parse("s", text, strlen(text), &scene, NULL, NULL, &error), &error);
        compare(table[i / 2].name, &scene, &random, &s);
        kt_check_equal_int(table[i / 2].name, s.in_lanes, in_space && table[i / 2].in_lanes);
        kt_check_equal_int("results that differ", s.different, 0);
        kt_scene_free(&scene);
    }
}

/* The results of a comparison of random mechanisms. */
typedef struct findings {
    int different;
    uint64_t in_lanes, alone;
    int delassus; /* groups in that form */
} findings;

/* Some states that cannot be computed, or come near to that. */
static void spoil_states(kt_many *many, kt_random *random) {
    static const double bad[] = {(double)NAN, (double)INFINITY, 1e300, -1e160, 1e-170};
    for (size_t i = 1; i < KT_MANY_STATES; i += 4) {
        double *x = i % 8 == 1 ? many->q + i * many->nq : many->v + i * many->nv;
        x[(size_t)kt_random_int(random, 0, (int)many->nv - 1)] = bad[kt_random_int(random, 0, 4)];
    }
}

/* Compares mechanism n, whose states lie `most` around the initial one, some of them spoilt. Returns how many states
 * differ, or -1 if the comparison failed. */
static int compare_random(const kt_description *description, kt_isa isa, int n, double most, bool spoilt,
                          kt_random *random, findings *f) {
    const kt_model_options options = {.isa = isa};
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_many many;
    kt_error error;
    if (kt_model_compile(description, &options, &model, &error) != KT_OK ||
        kt_data_create(model, &data, &error) != KT_OK ||
        !kt_many_make(&many, model, kt_method_find(n % 2 ? "dopri5" : "rk4"))) {
        kt_note("mechanism %d: %s: %s", n, error.where, error.message);
        return -1;
    }
    draw_states(&many, data, most, random);
    if (spoilt)
        spoil_states(&many, random);
    if (n % 4 == 1 && !kt_many_vary(&many, random)) /* other masses and gravity */
        return -1;
    many.threads = 1 + (size_t)n % KT_MANY_THREADS;
    const int found = kt_many_compare_forward(&many, data) + kt_many_compare_inverse(&many, data) +
                      kt_many_compare_sensors(&many, data) + kt_many_compare_steps(&many, data, 1e-3, 2) +
                      kt_many_compare_semi_implicit(&many, data, 1e-3, 2);
    const kt_batch_report report = kt_batch_report_of(many.batch);
    if (found > 0)
        kt_note("mechanism %d: %d differ", n, found);
    f->in_lanes += report.in_lanes;
    f->alone += report.alone;
    for (int g = 0; g < kt_loop_group_count(model); g++)
        f->delassus += kt_loop_group_at(model, g).form == KT_FORM_DELASSUS;
    kt_many_free(&many);
    kt_data_free(data);
    kt_model_free(model);
    return found;
}

static void report_findings(const char *name, const findings *f) {
    kt_note("%s: %llu evaluations in lanes, %llu alone", name, (unsigned long long)f->in_lanes,
            (unsigned long long)f->alone);
    kt_check_equal_int("states that differ", f->different, 0);
    kt_check_above("evaluations in lanes for one alone", (double)f->in_lanes / (double)(f->alone + 1), 2.0);
    kt_check_above("evaluations that leave the lanes", (double)f->alone, 100.0);
}

/* A body that moves freely, whose loop is off. No equation is left, but a quaternion must still be normalised. */
KT_TEST(effects_in_loops_that_are_off_have_the_bits_of_single_states) {
    kt_description description = kt_description_default();
    kt_effect spring = kt_effect_default();
    kt_random random = kt_random_of_test();
    findings f = {0};
    kt_body body = kt_body_of("a", NULL, KT_JOINT_FREE, 1.0);
    body.inertia = (kt_sym3){.xx = 0.1, .yy = 0.1, .zz = 0.1};
    kt_loop loop = kt_loop_of("close", KT_LOOP_REVOLUTE);
    loop.between[1].body = "a";
    loop.switching = KT_SWITCHED_OFF;
    spring.type = KT_EFFECT_JOINT_SPRING;
    spring.joint = "close";
    spring.stiffness = 3.0;
    description.bodies = &body;
    description.loops = &loop;
    description.effects = &spring;
    description.body_count = description.loop_count = description.effect_count = 1;
    kt_check_equal_int("states that differ", compare_random(&description, KT_ISA_AUTO, 0, 0.1, false, &random, &f), 0);
    kt_check_above("evaluations that leave the lanes", (double)f.alone, 1.0);
    kt_check_equal_int("evaluations in lanes", (long long)f.in_lanes, 0);
}

enum { LINKAGES = 80, CLOSURES = 60, ROPES = 40 };

/* Random linkages of which some states are near singular positions: these leave the lanes. */
static void compare_linkages(kt_isa isa, const char *name) {
    kt_random random = kt_random_of_test();
    findings f = {0};
    for (int n = 0; n < LINKAGES && kt_isa_resolve(isa) == isa; n++) {
        static kt_linkages linkages;
        kt_linkages_describe(&linkages, n % 5 == 4, &random);
        const int found = compare_random(&linkages.description, isa, n, n % 5 == 4 ? 1e-3 : 0.1, false, &random, &f);
        kt_need(kt_check_true("a linkage is compiled", found >= 0));
        f.different += found;
    }
    if (kt_isa_resolve(isa) != isa)
        kt_skip(name, KT_NO_ISA);
    else
        report_findings(name, &f);
}

/* Random mechanisms with loops of every type in space and in a plane, half of them driven. */
static void compare_closures(kt_isa isa, const char *name) {
    kt_random random = kt_random_of_test();
    findings f = {0};
    for (int n = 0; n < CLOSURES && kt_isa_resolve(isa) == isa; n++) {
        static kt_closures closures;
        kt_closures_describe(&closures, n % 4 == 3, n % 2, &random);
        const bool spoilt = n % 8 > 5;
        const int found = compare_random(&closures.description, isa, n, 0.02, spoilt, &random, &f);
        kt_need(kt_check_true("a mechanism is compiled", found >= 0));
        f.different += found;
    }
    if (kt_isa_resolve(isa) != isa)
        kt_skip(name, KT_NO_ISA);
    else
        report_findings(name, &f);
}

/* Random chains that few equations hold, of which some are folded: these leave the lanes. */
static void compare_ropes(kt_isa isa, const char *name) {
    kt_random random = kt_random_of_test();
    findings f = {0};
    for (int n = 0; n < ROPES && kt_isa_resolve(isa) == isa; n++) {
        static kt_ropes ropes;
        const bool folded = n % 5 == 4;
        kt_ropes_describe(&ropes, n % 2, folded, &random);
        const bool spoilt = n % 8 > 5;
        const int found = compare_random(&ropes.description, isa, n, folded ? 1e-3 : 0.05, spoilt, &random, &f);
        kt_need(kt_check_true("a rope is compiled", found >= 0));
        f.different += found;
    }
    if (kt_isa_resolve(isa) != isa) {
        kt_skip(name, KT_NO_ISA);
        return;
    }
    report_findings(name, &f);
    kt_check_above("groups in the form of Delassus", f.delassus, ROPES);
}

KT_TEST(ropes_have_the_bits_of_single_states_on_the_baseline) { compare_ropes(KT_ISA_BASE, "baseline"); }
KT_TEST(ropes_have_the_bits_of_single_states_on_v3) { compare_ropes(KT_ISA_V3, "v3"); }
KT_TEST(ropes_have_the_bits_of_single_states_on_v4) { compare_ropes(KT_ISA_V4, "v4"); }

KT_TEST(closures_have_the_bits_of_single_states_on_the_baseline) { compare_closures(KT_ISA_BASE, "baseline"); }
KT_TEST(closures_have_the_bits_of_single_states_on_v3) { compare_closures(KT_ISA_V3, "v3"); }
KT_TEST(closures_have_the_bits_of_single_states_on_v4) { compare_closures(KT_ISA_V4, "v4"); }

KT_TEST(linkages_have_the_bits_of_single_states_on_the_baseline) { compare_linkages(KT_ISA_BASE, "baseline"); }
KT_TEST(linkages_have_the_bits_of_single_states_on_v3) { compare_linkages(KT_ISA_V3, "v3"); }
KT_TEST(linkages_have_the_bits_of_single_states_on_v4) { compare_linkages(KT_ISA_V4, "v4"); }
