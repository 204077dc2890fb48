/* Accuracy studies that cannot be made, or not as far as was asked for: what is said, and what is kept. */
#include "check.h"

#include "kinetree/accuracy.h"

#include <math.h>
#include <string.h>

typedef struct bench {
    kt_body body;
    kt_marker marker;
    kt_loop loop;
    kt_description description;
    kt_run run;
    kt_accuracy_options options;
    const kt_method *methods[2];
    double step, tolerance;
    kt_error error;
    kt_accuracy *study;
} bench;

/* A pendulum let go at 1 rad for 1 s; rk4 at one step. */
static void make(bench *b) {
    memset(b, 0, sizeof *b);
    b->body = kt_body_default();
    b->body.name = "bob";
    b->body.joint.type = KT_JOINT_REVOLUTE;
    b->body.joint.position[0] = 1.0;
    b->body.mass = 1.0;
    b->body.com = kt_vec3_make(0.0, -1.0, 0.0);
    b->description = kt_description_default();
    b->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    b->description.bodies = &b->body;
    b->description.body_count = 1;
    b->run = kt_run_default();
    b->run.duration = 1.0;
    b->options = kt_accuracy_options_default();
    b->options.records = 20;
    b->methods[0] = kt_method_find("rk4");
    b->methods[1] = kt_method_find("dopri5");
    b->options.methods = b->methods;
    b->options.method_count = 1;
    b->step = 0.01;
    b->tolerance = 1e-6;
    b->options.steps = &b->step;
    b->options.step_count = 1;
    b->options.tolerances = &b->tolerance;
    b->options.tolerance_count = 1;
}

static kt_status create(bench *b) {
    b->study = NULL;
    b->error = (kt_error){KT_OK, "", ""};
    return kt_accuracy_create(&b->description, &b->run, &b->options, &b->study, &b->error);
}

static void refuse(bench *b, kt_status expected, const char *where, const char *message) {
    kt_check_equal_int("status", create(b), expected);
    kt_check_text("where", b->error.where, where);
    kt_check_text("message", b->error.message, message);
    kt_check_true("no study", b->study == NULL);
    kt_accuracy_free(b->study); /* NULL, which is allowed */
}

/* ---- options ------------------------------------------------------------------------------------------------------
 */

static const char whole_numbers[] = "records, budget and run_evaluations must be above 0, amplification above 1";
static const char empty[] = "an empty list of methods or variants leaves nothing to run";

KT_TEST(options_out_of_range_are_refused) {
    bench b;
    make(&b);
    b.run.duration = HUGE_VAL;
    refuse(&b, KT_ERROR_ARGUMENT, "duration", "must be above zero for an error to be measured");
    make(&b);
    b.options.records = 0;
    refuse(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.options.budget = (double)NAN;
    refuse(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.options.amplification = 1.0;
    refuse(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.options.run_evaluations = 0;
    refuse(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.step = HUGE_VAL;
    refuse(&b, KT_ERROR_ARGUMENT, "steps", "must be 1 to 40 numbers above zero");
    make(&b);
    b.options.step_count = 0;
    refuse(&b, KT_ERROR_ARGUMENT, "steps", "must be 1 to 40 numbers above zero");
    make(&b);
    b.tolerance = -1.0;
    refuse(&b, KT_ERROR_ARGUMENT, "tolerances", "must be 1 to 40 numbers above zero");
    make(&b);
    double many[41];
    for (int i = 0; i < 41; i++)
        many[i] = 1e-3;
    b.options.tolerances = many;
    b.options.tolerance_count = 41;
    refuse(&b, KT_ERROR_ARGUMENT, "tolerances", "must be 1 to 40 numbers above zero");
    make(&b);
    b.options.method_count = 0;
    refuse(&b, KT_ERROR_ARGUMENT, "accuracy", empty);
    make(&b);
    const kt_variant own = kt_variant_default(&b.run);
    b.options.variants = &own;
    refuse(&b, KT_ERROR_ARGUMENT, "accuracy", empty);
}

KT_TEST(references_that_are_none_are_refused) {
    static const char words[] = "it needs two records or more, an interval above zero apart";
    const double q[3] = {1.0, 1.0, 1.0}, v[3] = {0.0, 0.0, 0.0};
    kt_reference reference = {0.5, 3, q, v};
    bench b;
    make(&b);
    b.options.reference = &reference;
    reference.count = 1; /* no interval, and so no duration */
    refuse(&b, KT_ERROR_ARGUMENT, "duration", "must be above zero for an error to be measured");
    reference = (kt_reference){-0.5, -1, q, v}; /* two wrongs */
    refuse(&b, KT_ERROR_ARGUMENT, "reference", words);
    reference = (kt_reference){0.5, 3, q, v};
    kt_check_equal_int("one that stands still", create(&b), KT_ERROR_ARGUMENT);
    kt_check_contains("message", b.error.message, "it parts from what dop853 computes at once");
}

KT_TEST(measurements_of_nothing_are_refused) {
    static const char words[] = "a method, adaptive only with an error estimate, and a setting above zero";
    bench b;
    kt_accuracy_point point = {.setting = 77.0};
    make(&b);
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    const kt_variant own = kt_variant_default(&b.run);
    kt_check_equal_int("no method", kt_accuracy_measure(b.study, &own, NULL, false, 0.01, &point, &b.error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("message", b.error.message, words);
    kt_check_equal_int("no step", kt_accuracy_measure(b.study, &own, b.methods[0], false, 0.0, &point, &b.error),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("no estimate", kt_accuracy_measure(b.study, &own, b.methods[0], true, 0.01, &point, &b.error),
                       KT_ERROR_ARGUMENT);
    b.body.mass = -1.0; /* the description is the caller's all the time */
    kt_check_equal_int("a scene that has become wrong",
                       kt_accuracy_measure(b.study, &own, b.methods[0], false, 0.01, &point, &b.error), KT_ERROR_MODEL);
    kt_check_near("the point is untouched", point.setting, 77.0, 0.0);
    kt_check_equal_int("the model is the scene's", kt_model_nv(kt_accuracy_model(b.study)), 1);
    kt_accuracy_free(b.study);
}

/* ---- too little time ----------------------------------------------------------------------------------------------
 */

typedef struct ticking {
    double time, step;
} ticking;

static double tick(void *user) {
    ticking *t = user;
    return t->time += t->step;
}

/* Counted in evaluations, as there is no clock; or by a clock, which tells how much would do. */
KT_TEST(reference_out_of_time_says_how_far_it_came) {
    bench b;
    ticking slow = {0.0, 1.0};
    make(&b);
    b.options.run_evaluations = 2;
    kt_check_equal_int("evaluations", create(&b), KT_ERROR_STEP);
    kt_note("%s: %s", b.error.where, b.error.message);
    kt_check_text("where", b.error.where, "reference");
    kt_check_contains("message", b.error.message, "of 1 s it came to ");
    kt_check_contains("message", b.error.message,
                      " s of the processor's time: a larger budget or a shorter duration is needed");
    make(&b);
    b.run.duration = 1e4;
    b.options.clock = tick;
    b.options.user = &slow;
    b.options.budget = 30.0;
    kt_check_equal_int("clock", create(&b), KT_ERROR_STEP);
    kt_note("%s: %s", b.error.where, b.error.message);
    kt_check_contains("message", b.error.message, "of 10000 s it came to ");
    kt_check_contains("message", b.error.message, ", all of it some ");
}

/* What the reference can be had for is studied. */
KT_TEST(study_ends_where_its_reference_does) {
    bench b;
    make(&b);
    b.run.duration = 1000.0;
    b.options.run_evaluations = 2000;
    b.options.records = 200;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    const kt_accuracy_results *r = kt_accuracy_get(b.study);
    kt_check_equal_int("cut", r->cut, KT_ACCURACY_LATE);
    kt_check_near("asked", r->asked, 1000.0, 0.0);
    kt_check_above("studied", r->duration, 10.0);
    kt_check_below("studied", r->duration, 500.0);
    kt_check_below("uncertainty", r->uncertainty.position, 1e-10);
    kt_accuracy_free(b.study);
}

/* Runs longer than run_evaluations say so, and nothing of them is used. */
KT_TEST(runs_that_are_too_long_are_points_without_an_error) {
    bench b;
    make(&b);
    b.options.run_evaluations = 1000;
    b.step = 1e-6;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    const kt_accuracy_results *r = kt_accuracy_get(b.study);
    if (kt_check_equal_int("points", r->point_count, 1)) {
        kt_check_true("unusable", !r->points[0].usable && r->points[0].status != KT_OK);
        kt_check_true("without an error", isinf(r->points[0].error.position));
    }
    kt_check_equal_int("none is best", kt_accuracy_best(b.study, 1.0), -1);
    kt_accuracy_free(b.study);

    make(&b); /* and where settings are found no coarser one is left */
    b.options.steps = b.options.tolerances = NULL;
    b.options.step_count = b.options.tolerance_count = 0;
    b.options.method_count = 2;
    b.options.run_evaluations = 300;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    r = kt_accuracy_get(b.study);
    for (int i = 0; i < r->curve_count; i++)
        kt_check_equal_int(r->curves[i].method->name, r->curves[i].end, KT_ACCURACY_LENGTH);
    kt_accuracy_free(b.study);
}

/* ---- scenes --------------------------------------------------------------------------------------------------------
 */

/* What hangs at rest has no amplitude, against which errors could be small. */
KT_TEST(motion_without_amplitude_is_measured_against_one) {
    bench b;
    make(&b);
    b.body.joint.position[0] = 0.0;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    const kt_accuracy_results *r = kt_accuracy_get(b.study);
    kt_check_near("amplitude", r->amplitude, 0.0, 0.0);
    kt_check_near("error", r->points[0].error.position, 0.0, 0.0);
    kt_check_true("usable", r->points[0].usable);
    kt_accuracy_free(b.study);
}

/* A cylindrical joint has an angle and a length; the box that is its length scale holds the marker, 5 m off the axis,
 * which turns by 2 rad to both sides: 10 m, where it would be some 1 m without. */
KT_TEST(markers_count_in_the_length_scale) {
    bench b;
    make(&b);
    b.body.joint.type = KT_JOINT_CYLINDRICAL;
    b.body.joint.velocity[1] = 0.1;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    const double without = kt_accuracy_get(b.study)->length;
    kt_check_equal_int("unit", kt_accuracy_get(b.study)->unit, KT_ACCURACY_MIXED);
    kt_accuracy_free(b.study);
    b.marker = (kt_marker){"far", kt_vec3_make(0.0, -5.0, 0.0)};
    b.body.markers = &b.marker;
    b.body.marker_count = 1;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    /* swinging from 1 rad to -1: 10 sin 1 wide, at records, of which one lies near the turn */
    kt_check_near("length", kt_accuracy_get(b.study)->length, 5.0 * without, 1e-9);
    kt_check_near("length", kt_accuracy_get(b.study)->length, 10.0 * sin(1.0), 0.1);
    kt_accuracy_free(b.study);
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
    b->loop = kt_loop_default();
    b->loop.name = "rod";
    b->loop.type = KT_LOOP_DISTANCE;
    b->loop.between[1].body = "bob";
    b->description.loops = &b->loop;
    b->description.loop_count = 1;
}

KT_TEST(sets_are_measured_beside_the_reduction) {
    bench b;
    make_rod(&b);
    kt_variant variants[3];
    for (int i = 0; i < 3; i++)
        variants[i] = kt_variant_default(&b.run);
    variants[1].label = "gauss";
    variants[1].has_set = true;
    variants[1].set = KT_SET_GAUSS;
    variants[2].label = "half of Baumgarte's gains, with records";
    variants[2].has_set = variants[2].records = true;
    variants[2].set = KT_SET_BAUMGARTE;
    variants[2].gain = 0.5;
    b.options.variants = variants;
    b.options.variant_count = 3;
    b.options.method_count = 2;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    const kt_accuracy_results *r = kt_accuracy_get(b.study);
    kt_check_equal_int("points", r->point_count, 6);
    double open[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < r->curve_count; i++)
        for (int k = 0; k < r->curves[i].count; k++) {
            const kt_accuracy_point *point = &r->points[r->curves[i].first + k];
            kt_check_true("usable", point->usable);
            /* within the long steps of dopri5 sets leave the circle by more than a millimetre */
            const bool apart = r->curves[i].variant > 0 && r->curves[i].adaptive;
            kt_check_equal_int("verdict", point->verdict, apart ? KT_ERROR_CONSTRAINT : KT_OK);
            open[r->curves[i].variant] = fmax(open[r->curves[i].variant], point->error.constraint.position);
        }
    kt_check_below("reduction: closed to rounding", open[0], 1e-14);
    kt_check_above("gauss drifts", open[1], 1e-7);
    kt_check_below("baumgarte drifts less than rk4's error at this step", open[2], 1e-6);
    kt_accuracy_free(b.study);
}

/* Reduction needs inertia along what loops leave free, sets along every coordinate. */
KT_TEST(set_that_cannot_do_a_scene_is_a_point_that_says_so) {
    bench b;
    make_rod(&b);
    b.body.inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    b.loop.type = KT_LOOP_PARALLEL;
    b.loop.between[1].body = "bob";
    kt_variant variant = kt_variant_default(&b.run);
    variant.label = "gauss";
    variant.has_set = true;
    b.options.variants = &variant;
    b.options.variant_count = 1;
    if (!kt_check_equal_int("study", create(&b), KT_OK))
        return;
    const kt_accuracy_results *r = kt_accuracy_get(b.study);
    kt_check_equal_int("status", r->points[0].status, KT_ERROR_SINGULAR);
    kt_check_equal_int("verdict", r->points[0].verdict, KT_ERROR_SINGULAR);
    kt_check_true("unusable", !r->points[0].usable);
    kt_accuracy_free(b.study);
}
