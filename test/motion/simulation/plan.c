/* The plan of a scene: which kernels it lists, on how many items, and the reason for each that it leaves out. The test
 * in test/plan verifies that omitted kernels cost no instruction.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "mechanics/constraint/linkage.h"

#include "kinetree/simulation.h"
#include "kinetree/study.h"

#include <stdio.h>
#include <string.h>

typedef struct plan {
    kt_plan_step step[KT_PLAN_STEPS_MAX];
    int count;
} plan;

static plan plan_of(const kt_model *model, const kt_run *run) {
    plan p;
    p.count = kt_plan_steps(model, run, p.step);
    kt_check_below("steps", p.count, KT_PLAN_STEPS_MAX);
    for (int i = 0; i < p.count; i++) {
        const kt_plan_step *s = &p.step[i];
        if ((s->count == 0) != (s->dropped != NULL))
            kt_check_true(s->name, false); /* an item has a reason if and only if it is left out */
    }
    return p;
}

static const kt_plan_step *find(const plan *p, const char *name) {
    static const kt_plan_step nothing = {.name = "", .count = -1, .unit = ""};
    for (int i = 0; i < p->count; i++)
        if (strcmp(p->step[i].name, name) == 0)
            return &p->step[i];
    kt_check_true(name, false);
    return &nothing;
}

static void is_there(const plan *p, const char *name, int count, const char *unit) {
    const kt_plan_step *s = find(p, name);
    kt_check_equal_int(name, s->count, count);
    kt_check_text("unit", s->unit, unit);
    kt_check_true("there", s->dropped == NULL);
}

static void is_dropped(const plan *p, const char *name, const char *why) {
    const kt_plan_step *s = find(p, name);
    kt_check_equal_int(name, s->count, 0);
    kt_check_text("why", s->dropped, why);
}

/* ---- trees and loops -----------------------------------------------------------------------------------------------
 */

KT_TEST(four_bar_is_a_loop_in_a_plane_and_nothing_else) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_compile(&l);
    const plan p = plan_of(l.model, NULL);
    is_dropped(&p, "effects on joints", "the scene names none");
    is_dropped(&p, "effects on bodies", "the scene names none");
    is_dropped(&p, "motion of links that carry forces", "no effect acts on a body");
    is_dropped(&p, "wrenches from bodies onto links", "no effect acts on a body (wrenches that a caller sets would)");
    is_there(&p, "sines and cosines", 3, "angles");
    is_dropped(&p, "articulated bodies in space", "all trees move in planes");
    is_dropped(&p, "articulated bodies in planes", "all planar links are in loops");
    is_dropped(&p, "loops in space", "no loop is of this kind");
    is_there(&p, "loops in planes", 2, "equations");
    is_dropped(&p, "LAPACK", "no dense group of loops has 40 coordinates");
    is_dropped(&p, "gravity", "it is the acceleration that the ground starts with: it costs nothing");
    is_dropped(&p, "powers of effects", "no balance is recorded");
    is_dropped(&p, "power of driven loops (inverse dynamics)", "no balance is recorded");
    is_there(&p, "projection onto the loops", 1, "groups");
    is_dropped(&p, "quaternions to unit norm", "no joint has one");
    is_dropped(&p, "accelerations", "not recorded");
    is_there(&p, "energies", 1, "pass");
    is_there(&p, "residuals of loops", 1, "pass");
    is_dropped(&p, "reactions", "not recorded");
    is_dropped(&p, "markers", "not recorded");
}

KT_TEST(same_loop_in_space_has_the_equations_of_space) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    l.options.plan = KT_PLAN_SPATIAL;
    l.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    linkage_compile(&l);
    const plan p = plan_of(l.model, NULL);
    is_dropped(&p, "articulated bodies in space", "all links are in loops");
    is_dropped(&p, "articulated bodies in planes", "no tree is computed in a plane");
    is_dropped(&p, "loops in planes", "no loop is of this kind");
    is_dropped(&p, "gravity", "the scene names none");
    kt_check_above("equations", (double)find(&p, "loops in space")->count, 2.0);
    for (int axis = 0; axis < 3; axis++) { /* of gravity one component is enough */
        linkage_four_bar(&l, &f);
        l.description.gravity = kt_vec3_make(axis == 0, axis == 1, axis == 2);
        linkage_compile(&l);
        const plan pulled = plan_of(l.model, NULL);
        is_dropped(&pulled, "gravity", "it is the acceleration that the ground starts with: it costs nothing");
    }
}

KT_TEST(large_group_goes_to_lapack) {
    static linkage l;
    linkage_windows(&l, 20, 1.0, 0.0, KT_LOOP_REVOLUTE);
    l.options.structure = KT_STRUCTURE_DENSE;
    linkage_compile(&l);
    const plan p = plan_of(l.model, NULL);
    is_dropped(&p, "loops reduced link by link", "dense matrices take less time");
    is_there(&p, "LAPACK", 1, "groups");
    is_there(&p, "loops in planes", 40, "equations");
}

KT_TEST(row_of_windows_is_reduced_link_by_link) {
    static linkage l;
    linkage_windows(&l, 20, 1.0, 0.0, KT_LOOP_REVOLUTE);
    linkage_compile(&l);
    const plan p = plan_of(l.model, NULL);
    is_there(&p, "loops reduced link by link", 20, "loops");
    is_there(&p, "loops in planes", 40, "equations");
    is_dropped(&p, "LAPACK", "no dense group of loops has 40 coordinates");
}

/* Chains of bars about z (planar), about x and z in turn, or on spherical joints: one link each. */
static plan chain_plan(int count, bool planar, bool ball) {
    static linkage l;
    char name[16];
    linkage_begin(&l);
    for (int i = 0; i < count; i++) {
        (void)snprintf(name, sizeof name, "bar%d", i);
        kt_body *bar = linkage_bar(&l, name, i ? l.body[i - 1].name : NULL, kt_vec3_make(0.0, i ? -1.0 : 0.0, 0.0),
                                   kt_vec3_make(0.0, -1.0, 0.0), 0.1, 0.0);
        if (!planar)
            bar->joint.axis = kt_vec3_make(i % 2, 0.0, (i + 1) % 2);
        if (ball) {
            bar->joint.type = KT_JOINT_SPHERICAL;
            bar->inertia.yy = 0.01;
            bar->joint.position[0] = 1.0;
            bar->joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        }
    }
    plan p = {.count = 0};
    linkage_compile(&l);
    p = plan_of(l.model, NULL);
    return p;
}

KT_TEST(chain_lists_a_link_for_each_body) {
    for (int kind = 0; kind < 3; kind++) {
        const char *const name = kind == 0 ? "articulated bodies in planes" : "articulated bodies in space";
        const plan eight = chain_plan(8, kind == 0, kind == 2), more = chain_plan(24, kind == 0, kind == 2);
        is_there(&eight, name, 8, "links");
        is_there(&more, name, 24, "links");
        is_dropped(&eight, "projection onto the loops", "the scene names no loops");
        is_dropped(&eight, "residuals of loops", "not recorded");
        is_dropped(&eight, "LAPACK", "no loops");
        if (kind == 2) {
            is_there(&eight, "quaternions to unit norm", 8, "quaternions");
            is_dropped(&eight, "sines and cosines", "no joint turns about one axis");
        }
    }
}

/* Separate four-bars are separate constraint groups. */
KT_TEST(separate_loops_are_groups_of_their_own) {
    static linkage l;
    for (int n = 1; n <= 3; n++) {
        const four_bar f = four_bar_default();
        linkage_four_bar(&l, &f);
        for (int i = 1; i < n; i++) {
            char name[3][16];
            for (int k = 0; k < 3; k++)
                (void)snprintf(name[k], sizeof name[k], "%s%d", k == 0 ? "crank" : k == 1 ? "coupler" : "rocker", i);
            const kt_vec3 x = kt_vec3_make(1.0, 0.0, 0.0);
            linkage_bar(&l, name[0], NULL, kt_vec3_make(0.0, 0.0, 0.0), x, 1.0, 0.0);
            linkage_bar(&l, name[1], l.body[3 * i].name, x, kt_vec3_make(2.0, 0.0, 0.0), -0.6, 0.0);
            linkage_bar(&l, name[2], NULL, kt_vec3_make(2.2, 0.0, 0.0), kt_vec3_make(1.8, 0.0, 0.0), 1.6, 0.0);
            (void)snprintf(name[0], sizeof name[0], "close%d", i);
            linkage_close(&l, name[0], KT_LOOP_REVOLUTE, l.body[3 * i + 1].name, kt_vec3_make(2.0, 0.0, 0.0),
                          l.body[3 * i + 2].name, kt_vec3_make(1.8, 0.0, 0.0));
        }
        l.options.reduction = kt_reduction_method_of(KT_REDUCTION_SVD); /* no pin at one go */
        linkage_compile(&l);
        const plan p = plan_of(l.model, NULL);
        is_there(&p, "projection onto the loops", n, "groups");
        is_there(&p, "loops in planes", 2 * n, "equations");
    }
}

/* ---- effects --------------------------------------------------------------------------------------------------------
 */

static int push(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    (void)user, (void)t, (void)ends, (void)wrenches, (void)balance;
    return 0;
}

static kt_effect force_of(kt_function function) {
    kt_effect effect = kt_effect_of(KT_EFFECT_FORCE, NULL);
    effect.between[0].body = "bar";
    for (int k = 0; k < 3; k++)
        effect.value[k] = function;
    return effect;
}

KT_TEST(effects_stand_by_their_types) {
    static linkage l;
    static const double numbers[6] = {0.0, 0.0, 1.0, 1.0, 2.0, 0.0};
    kt_effect effects[7];
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), 0.1, 0.0);
    effects[0] = kt_effect_of(KT_EFFECT_JOINT_DAMPER, "bar");
    effects[0].damping = 1.0;
    effects[1] = force_of((kt_function){.type = KT_FUNCTION_CONSTANT, .value = 1.0});
    effects[2] = force_of((kt_function){.type = KT_FUNCTION_SINE, .amplitude = 1.0, .frequency = 1.0});
    effects[3] = force_of((kt_function){.type = KT_FUNCTION_RAMP, .to = 1.0, .end = 1.0});
    effects[4] = force_of((kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = numbers, .number_count = 3});
    effects[5] = force_of((kt_function){.type = KT_FUNCTION_TABLE, .numbers = numbers, .number_count = 6});
    effects[6] = kt_effect_of(KT_EFFECT_CUSTOM, NULL);
    effects[6].between[0].body = "bar";
    effects[6].wrench = push;
    effects[6].end_count = 1;
    l.description.effects = effects;
    for (int count = 2; count <= 6; count++) {
        l.description.effect_count = count;
        linkage_compile(&l);
        const plan p = plan_of(l.model, NULL);
        is_there(&p, "effect joint_damper", 1, "effects");
        is_there(&p, "effect force", count - 1, "effects");
        is_there(&p, "motion of links that carry forces", 1, "links");
        is_there(&p, "wrenches from bodies onto links", 1, "bodies");
    }
    l.description.effect_count = 7;
    linkage_compile(&l);
    kt_run run = kt_run_default();
    run.record = KT_RECORD_BALANCE | KT_RECORD_ACCELERATION | KT_RECORD_REACTION;
    const plan p = plan_of(l.model, &run);
    is_there(&p, "effect of the caller's", 1, "effects");
    is_there(&p, "powers of effects", 7, "effects");
    is_dropped(&p, "power of driven loops (inverse dynamics)", "no loop changes with time");
    is_there(&p, "accelerations", 1, "evaluation");
    is_there(&p, "reactions", 1, "pass");
    is_there(&p, "energies", 1, "pass");
}

/* A force on the world pushes nothing that moves. */
KT_TEST(effects_between_what_stands_still_move_no_link) {
    static linkage l;
    kt_effect effect = kt_effect_default();
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), 0.1, 0.0);
    linkage_bar(&l, "post", NULL, kt_vec3_make(2.0, 0.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), 0.0, 0.0)->joint.type =
        KT_JOINT_FIXED;
    effect.type = KT_EFFECT_DRAG;
    effect.between[0].body = "post";
    effect.linear = 1.0;
    l.description.effects = &effect;
    l.description.effect_count = 1;
    linkage_compile(&l);
    const plan p = plan_of(l.model, NULL);
    is_there(&p, "effect drag", 1, "effects");
    is_dropped(&p, "motion of links that carry forces", "all ends of effects are on the world");
}

/* Linear equations are those of implicit methods, and of the default one. */
KT_TEST(plan_tells_of_linear_equations_of_implicit_steps) {
    static const struct {
        const char *method, *name;
        double step;
    } cases[] = {{NULL, "linear equations while it is stiff", 0.0},
                 {"radau5", "linear equations of implicit steps", 0.0},
                 {"dopri5", NULL, 0.0},
                 {NULL, NULL, 0.1}};
    static const char *const reasons[] = {NULL, NULL, "the method is explicit", "the default with a fixed step"};
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_compile(&l);
    for (int i = 0; i < 4; i++) {
        kt_run run = kt_run_default();
        run.integrator = cases[i].method;
        run.step = cases[i].step;
        const plan p = plan_of(l.model, &run);
        if (cases[i].name != NULL)
            is_there(&p, cases[i].name, 3, "unknowns");
        else
            is_dropped(&p, "linear equations of implicit steps", reasons[i]);
    }
}

/* ---- runs -----------------------------------------------------------------------------------------------------------
 */

KT_TEST(balance_of_a_driven_loop_takes_inverse_dynamics) {
    static linkage l;
    const four_bar f = four_bar_default();
    const kt_marker_pair marker = {"crank", "tip"};
    kt_run run = kt_run_default();
    linkage_four_bar(&l, &f);
    kt_loop *motion = linkage_close(&l, "motion", KT_LOOP_MOTION, NULL, kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                    kt_vec3_make(0.0, 0.0, 0.0));
    const double rate[2] = {1.0, 2.0};
    motion->joint = "crank";
    motion->function = (kt_function){.type = KT_FUNCTION_POLYNOMIAL, .numbers = rate, .number_count = 2};
    linkage_compile(&l);
    run.record = KT_RECORD_BALANCE;
    run.markers = &marker;
    run.marker_count = 1;
    const plan p = plan_of(l.model, &run);
    is_there(&p, "power of driven loops (inverse dynamics)", 1, "pass");
    is_dropped(&p, "powers of effects", "the scene names no effects");
    is_there(&p, "markers", 1, "markers");
    is_there(&p, "loops in planes", 3, "equations");
}

/* Three free bodies, each with a quaternion; the joints are loops, too. */
KT_TEST(plan_of_the_absolute_formulation_is_that_of_free_bodies) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_compile(&l);
    const plan tree = plan_of(l.model, NULL);
    is_dropped(&tree, "quaternions to unit norm", "no joint has one");
    kt_absolute *absolute = kt_formulate(&l.description, NULL, l.model, KT_FORMULATION_ABSOLUTE);
    if (absolute == NULL)
        return;
    const plan p = plan_of(kt_absolute_model(absolute), NULL);
    is_there(&p, "quaternions to unit norm", 3, "quaternions");
    is_dropped(&p, "sines and cosines", "no joint turns about one axis");
    is_there(&p, "loops in space", 20, "equations"); /* four revolute joints of five */
}

/* One tree in a plane and one in space: each has its own, and wrenches of both are counted. */
KT_TEST(mixed_scene_has_both) {
    static linkage l;
    kt_effect effects[2];
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), 0.1, 0.0);
    linkage_bar(&l, "slide", "bar", kt_vec3_make(0.0, -1.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), 0.1, 0.0)->joint.type =
        KT_JOINT_PRISMATIC;
    l.body[1].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    kt_body *ball = linkage_bar(&l, "ball", NULL, kt_vec3_make(3.0, 0.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), 1.0, 0.0);
    ball->joint.type = KT_JOINT_FREE;
    ball->joint.position[0] = 0.0;
    ball->joint.position[3] = 1.0;
    ball->joint.rotation = kt_rotation_vector(kt_vec3_make(0.3, 0.2, 0.1));
    ball->inertia.yy = 0.01;
    for (int i = 0; i < 2; i++) {
        effects[i] = kt_effect_of(KT_EFFECT_DRAG, NULL);
        effects[i].between[0].body = i ? "ball" : "slide";
        effects[i].linear = 1.0;
    }
    l.description.effects = effects;
    l.description.effect_count = 2;
    linkage_compile(&l);
    kt_check_text("plan", kt_model_plan(l.model), "mixed");
    const plan p = plan_of(l.model, NULL);
    is_there(&p, "articulated bodies in planes", 2, "links");
    is_there(&p, "articulated bodies in space", 1, "links");
    is_there(&p, "wrenches from bodies onto links", 3, "bodies");
    is_there(&p, "motion of links that carry forces", 3, "links");
}
