/* Accuracy studies of unusual scenes and settings: scales without an extent, ladders that end at once, coordinate sets,
 * an effect that fails. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bench.h"
#include "sanitized.h"

#include "kinetree/effect.h"

#include <math.h>

/* ---- scenes --------------------------------------------------------------------------------------------------------
 */

/* A body that hangs at rest has no amplitude that errors could be compared with. */
KT_TEST(scene_at_rest_is_no_study) {
    bench b;
    make(&b);
    b.body.joint.position[0] = 0.0;
    kt_check_true("rejected", create(&b) != KT_OK);
    kt_check_contains("message", b.error.message, "nothing moves in 1 s");
}

/* A cylindrical joint has an angle and a length. The box of the length scale holds the marker, 5 m off the axis, which
 * turns by 2 rad to both sides. The scale is 10 m, and would be some 1 m without the marker. */
KT_TEST(markers_count_in_the_length_scale) {
    bench b;
    make(&b);
    b.body.joint.type = KT_JOINT_CYLINDRICAL;
    b.body.joint.velocity[1] = 0.1;
    must_create(&b);
    const double without = kt_accuracy_results_of(b.study)->length;
    kt_check_equal_int("unit", kt_accuracy_results_of(b.study)->unit, KT_ACCURACY_MIXED);
    b.marker = (kt_marker){.name = "far", .at = kt_vec3_make(0.0, -5.0, 0.0)};
    b.body.markers = &b.marker;
    b.body.marker_count = 1;
    must_create(&b);
    /* The swing of 1 rad to both sides is 10 sin 1 wide. It is sampled at records, and one of them lies near the turn.
     */
    kt_check_near("length", kt_accuracy_results_of(b.study)->length, 5.0 * without, 1e-9);
    kt_check_near("length", kt_accuracy_results_of(b.study)->length, 10.0 * sin(1.0), 0.1);
}

/* It has no centre of mass, and turns as fast for ever. */
KT_TEST(wheel_without_mass_is_measured) {
    bench b;
    make(&b);
    b.body.mass = 0.0;
    b.body.com = kt_vec3_make(0.0, 0.0, 0.0);
    b.body.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    b.body.joint.velocity[0] = 3.0;
    must_create(&b);
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_check_near("amplitude", r->amplitude, 3.0, 1e-13);
    kt_check_below("error", r->points[0].error.position, 1e-13);
    kt_check_true("usable", r->points[0].usable);
}

/* On the axis nothing has an extent: a metre is the scale. */
KT_TEST(motion_without_extent_is_measured_against_a_metre) {
    bench b;
    make(&b);
    b.body.joint.type = KT_JOINT_CYLINDRICAL;
    b.body.joint.velocity[0] = 1.0;
    b.body.com = kt_vec3_make(0.0, 0.0, 0.0);
    b.body.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    b.options.duration = 0.5;
    must_create(&b);
    kt_check_near("length", kt_accuracy_results_of(b.study)->length, 1.0, 0.0);
    kt_check_near("duration, of the options", kt_accuracy_results_of(b.study)->asked, 0.5, 0.0);
}

/* Uniform motion is had by any step: the ladder begins with a single one, and its error is the rounding's. */
KT_TEST(motion_that_any_step_has_ends_the_ladder_at_once) {
    bench b;
    make(&b);
    b.body.joint.type = KT_JOINT_PRISMATIC;
    b.body.joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    b.body.joint.position[0] = 0.0;
    b.body.joint.velocity[0] = 1.0;
    b.options.steps = NULL;
    b.options.step_count = 0;
    must_create(&b);
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_check_near("the coarsest step is the duration", r->points[0].setting, 1.0, 0.0);
    kt_check_below("its error", r->points[0].error.position, 1e-15);
    kt_check_equal_int("the end", r->curves[0].end, KT_ACCURACY_FLOOR);
    kt_check_equal_int("the best point", kt_accuracy_best(b.study, 1e-12), 0);
}

/* The limit goes from no working point to all requested points. A curve ends by length or by its accuracy, and its
 * points that do not work have no error. */
KT_TEST(curves_end_as_runs_may_be_longer) {
    int studies = 0, strange = 0, rejected = 0;
    for (int most = 2; most < 3000; most += 1 + most / 4) {
        bench b;
        make(&b);
        b.options.steps = b.options.tolerances = NULL;
        b.options.step_count = b.options.tolerance_count = 0;
        b.options.method_count = 2;
        b.options.run_evaluations = (uint64_t)most;
        const kt_status status = create(&b);
        if (status == KT_ERROR_STEP) {
            rejected++;
            continue;
        }
        kt_need(kt_check_equal_int("study", status, KT_OK));
        studies++;
        const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
        for (int i = 0; i < r->point_count; i++)
            strange += r->points[i].usable ? r->points[i].status != KT_OK
                                           : r->points[i].status != KT_OK && !isinf(r->points[i].error.position);
        for (int i = 0; i < r->curve_count; i++)
            strange += r->curves[i].count > 0 ? r->curves[i].end == KT_ACCURACY_UNUSABLE
                                              : r->curves[i].end < KT_ACCURACY_LENGTH; /* listed, floor or reference */
    }
    kt_check_above("studies", studies, 5.0);
    kt_check_above("references out of time", rejected, 1.0);
    kt_check_equal_int("points and curves that contradict themselves", strange, 0);
}

KT_TEST(given_reference_needs_its_first_record) {
    const double q[3] = {1.0, 0.9, 0.8}, v[3] = {0.0, -1.0, -1.0};
    const kt_reference reference = {0.5, 3, q, v};
    for (int most = 10; most <= 100; most += 10) {
        bench b;
        make(&b);
        b.options.run_evaluations = (uint64_t)most;
        b.options.reference = &reference;
        const kt_status status = create(&b);
        kt_check_equal_int("status", status, status == KT_ERROR_ARGUMENT ? KT_ERROR_ARGUMENT : KT_ERROR_STEP);
        kt_check_contains("message", b.error.message,
                          status == KT_ERROR_ARGUMENT ? "it parts from what dop853 computes" : "of 1 s it came to ");
    }
}

/* ---- an effect that fails -------------------------------------------------------------------------------------------
 */

typedef struct counted {
    long calls, failing;
    int code;
} counted;

static int drive(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    counted *c = user;
    (void)t;
    (void)q;
    (void)v;
    if (balance != NULL)
        *balance = (kt_effect_balance){0.0, 0.0, 0.0};
    *force = 0.0;
    return ++c->calls >= c->failing && c->failing > 0 ? c->code : 0;
}

/* The effect fails from its n-th evaluation on. Either the study is rejected with the effect's message, or it has the
 * runs that came before. A run that failed is a point without an error. */
KT_TEST(study_survives_an_effect_that_fails) {
    int rejected = 0, wordless = 0, strange = 0, had = 0;
    for (int code = -1; code <= 1; code += 2)
        for (long n = 1;; n += 1 + n / 3) {
            bench b;
            counted c = {0, n, code};
            kt_effect effect = kt_effect_default();
            make(&b);
            b.run.duration = 0.25;
            b.options.records = 4;
            effect.name = "hand";
            effect.type = KT_EFFECT_CUSTOM;
            effect.joint = "bob";
            effect.joint_force = drive;
            effect.user = &c;
            b.description.effects = &effect;
            b.description.effect_count = 1;
            b.options.method_count = 2;
            const kt_status status = create(&b);
            if (status != KT_OK) {
                rejected++;
                wordless += b.error.code != status || b.error.message[0] == '\0' || b.study != NULL;
                continue;
            }
            had++;
            const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
            for (int i = 0; i < r->point_count; i++)
                strange += r->points[i].usable && r->points[i].status != KT_OK;
            if (c.calls < n)
                break;
        }
    kt_check_above("rejected", rejected, 10.0);
    kt_check_equal_int("without words", wordless, 0);
    kt_check_above("had", had, 4.0);
    kt_check_equal_int("points that contradict themselves", strange, 0);
}

/* ---- sets ----------------------------------------------------------------------------------------------------------
 */

/* A bob on a slide, held on a circle by a rod: closure shows as an error of constraint. */
static void make_rod(bench *b) {
    make(b);
    b->body.joint.type = KT_JOINT_PLANAR;
    b->body.joint.position[0] = sin(1.0);
    b->body.joint.position[1] = -cos(1.0);
    b->body.joint.position[2] = 0.0;
    b->body.com = kt_vec3_make(0.0, 0.0, 0.0);
    b->body.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    b->loop = kt_loop_of("rod", KT_LOOP_DISTANCE);
    b->loop.between[1].body = "bob";
    b->description.loops = &b->loop;
    b->description.loop_count = 1;
}

KT_TEST(sets_are_measured_beside_the_reduction) {
    bench b;
    make_rod(&b);
    kt_variant variants[4];
    for (int i = 0; i < 4; i++)
        variants[i] = kt_variant_default(&b.run);
    variants[1].label = "gauss";
    variants[1].has_constraint_formulation = true;
    variants[1].constraint_formulation = KT_CONSTRAINT_FORMULATION_GAUSS;
    variants[2].label = "half of Baumgarte's gains, with records";
    variants[2].has_constraint_formulation = variants[2].records = true;
    variants[2].constraint_formulation = KT_CONSTRAINT_FORMULATION_BAUMGARTE;
    variants[2].gain = 0.5;
    variants[3].label = "gauss, of free bodies";
    variants[3].has_constraint_formulation = true;
    variants[3].formulation = KT_FORMULATION_ABSOLUTE;
    b.options.variants = variants;
    b.options.variant_count = 4;
    b.options.method_count = 2;
    must_create(&b);
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_check_equal_int("points", r->point_count, 8);
    double open[4] = {0.0, 0.0, 0.0, 0.0};
    for (int i = 0; i < r->curve_count; i++)
        for (int k = 0; k < r->curves[i].count; k++) {
            const kt_accuracy_point *point = &r->points[r->curves[i].first + k];
            kt_check_true("usable", point->usable);
            /* within the long steps of dopri5 sets leave the circle by more than a millimetre */
            const bool apart = r->curves[i].variant > 0 && r->curves[i].adaptive;
            kt_check_equal_int("verdict", point->verdict, apart ? KT_ERROR_CONSTRAINT : KT_OK);
            open[r->curves[i].variant] = fmax(open[r->curves[i].variant], point->error.constraint.position);
        }
    kt_check_equal_int("the best is the reduction's", r->curves[0].variant == 0 && kt_accuracy_best(b.study, 1e-3) >= 0,
                       true);
    kt_check_below("reduction: closed to rounding", open[0], 1e-14);
    kt_check_above("gauss drifts", open[1], 1e-7);
    kt_check_below("baumgarte drifts less than rk4's error at this step", open[2], 1e-6);
}

/* Reduction needs inertia along the directions that loops leave free, sets along every coordinate. */
KT_TEST(set_that_cannot_do_a_scene_is_a_point_that_says_so) {
    bench b;
    make_rod(&b);
    b.body.inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    b.loop.type = KT_LOOP_PARALLEL;
    b.loop.between[1].body = "bob";
    kt_variant variant = kt_variant_default(&b.run);
    variant.label = "gauss";
    variant.has_constraint_formulation = true;
    b.options.variants = &variant;
    b.options.variant_count = 1;
    must_create(&b);
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_check_equal_int("status", r->points[0].status, KT_ERROR_SINGULAR);
    kt_check_equal_int("verdict", r->points[0].verdict, KT_ERROR_SINGULAR);
    kt_check_true("unusable", !r->points[0].usable);
}

/* ---- without options -----------------------------------------------------------------------------------------------
 */

/* The long tier adds a longer run. */
KT_TEST(without_options_every_method_is_measured_until_errors_no_longer_fall) {
    if (KT_ADDRESS_SANITIZER) {
        kt_skip("every method", "it takes a minute under sanitizers; the other tests run the same code");
        return;
    }
    bench b;
    make(&b);
    b.run.duration = KT_SHORT(0.05, 0.2);
    kt_need(kt_check_equal_int("study", kt_accuracy_create(&b.description, &b.run, NULL, &b.study, &b.error), KT_OK));
    kt_test_own(b.study, release_study);
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_check_equal_int("a curve a method", r->curve_count, (long long)kt_method_count());
    kt_check_above("points", (double)r->point_count, 10.0 * (double)kt_method_count());
    kt_check_true("one is as good as can be", kt_accuracy_best(b.study, 1e-13) >= 0);
    kt_check_true("none is better than rounding", kt_accuracy_best(b.study, 1e-17) < 0);
    kt_check_true("no clock, no times", isnan(r->points[0].cpu));
}
