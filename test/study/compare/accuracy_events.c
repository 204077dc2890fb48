/* Accuracy studies of motions with events and hard contacts, against closed forms.
 *
 * Spring: x'' = -25 x from x = 1. An event at x = 0, falling, turns the velocity around and halves it. The events are
 * at pi/10 + k pi/5, and the amplitude is 2^-k behind the k-th one.
 * Bounces: a point falls from 1 m; each impact leaves 0.8 of its speed.
 * Friction: x'' = -4 x - 4 sign(x') from x = 0 with x' = 3. The motion stops at atan2(1.5, 1) / 2 and sticks. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bench.h"
#include "sanitized.h"

#include "kinetree/effect.h"

#include <math.h>

static const double pi = 3.14159265358979323846, g = 9.81;

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

/* A point on a rail, and its events. */
typedef struct rail {
    bench b;
    kt_effect effects[2];
    kt_accuracy_events events;
    int occurred; /* events of the last run */
    double times[100];
} rail;

static int position_of_point(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[0];
    return 0;
}

static int turn_point(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    rail *r = user;
    const double v = -0.5 * kt_simulation_velocities(simulation)[0];
    if (r->occurred < 100)
        r->times[r->occurred++] = what->time;
    return kt_simulation_jump(simulation, NULL, &v, error) == KT_OK ? 0 : -1;
}

static kt_status add_turn(kt_simulation *simulation, const kt_model *model, void **watch, void *user, kt_error *error) {
    const kt_event event = {.name = "turn",
                            .function = position_of_point,
                            .action = turn_point,
                            .user = user,
                            .direction = KT_DIRECTION_FALLING};
    (void)model;
    *watch = user;
    ((rail *)user)->occurred = 0;
    return kt_simulation_event_add(simulation, &event, error);
}

static kt_status add_ground(kt_simulation *simulation, const kt_model *model, void **watch, void *user,
                            kt_error *error) {
    const kt_event event = {
        .name = "ground", .function = position_of_point, .direction = KT_DIRECTION_FALLING, .stop = true};
    (void)model;
    *watch = user;
    return kt_simulation_event_add(simulation, &event, error);
}

static void release_nothing(void *watch) { (void)watch; }

static void make_rail(rail *r, double position, double velocity, double duration) {
    memset(r, 0, sizeof *r);
    make(&r->b);
    r->b.body.joint.type = KT_JOINT_PRISMATIC;
    r->b.body.joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    r->b.body.joint.position[0] = position;
    r->b.body.joint.velocity[0] = velocity;
    r->b.body.com = kt_vec3_make(0.0, 0.0, 0.0);
    r->b.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    r->b.run.duration = duration;
    r->b.options.records = 100;
    r->b.description.effects = r->effects;
}

static void make_spring(rail *r) {
    make_rail(r, 1.0, 0.0, pi);
    r->effects[0] = kt_effect_of(KT_EFFECT_JOINT_SPRING, "bob");
    r->effects[0].stiffness = 25.0;
    r->b.description.effect_count = 1;
    r->events = (kt_accuracy_events){.count = 1, .add = add_turn, .release = release_nothing, .user = r};
    r->b.options.events = &r->events;
}

static void make_bounces(rail *r) {
    make_rail(r, 1.0, 0.0, 3.0);
    r->b.description.gravity = kt_vec3_make(0.0, -g, 0.0);
    r->effects[0] = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "bob");
    r->effects[0].lower = 0.0;
    r->effects[0].restitution = 0.8;
    r->b.description.effect_count = 1;
}

static void make_friction(rail *r) {
    make_rail(r, 0.0, 3.0, 1.0);
    r->effects[0] = kt_effect_of(KT_EFFECT_JOINT_SPRING, "bob");
    r->effects[0].stiffness = 4.0;
    r->effects[1] = kt_effect_of(KT_EFFECT_JOINT_FRICTION, "bob");
    r->effects[1].coulomb = 4.0;
    r->effects[1].stick = true;
    r->b.description.effect_count = 2;
}

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

static double spring_at(double t) {
    const int turns = (int)floor((t + 0.1 * pi) / (0.2 * pi));
    return fabs(cos(5.0 * t)) * pow(0.5, turns);
}

/* The time of the k-th impact. */
static double impact_at(int k) {
    const double v = sqrt(2.0 * g);
    double t = v / g;
    for (int i = 0; i < k; i++)
        t += 2.0 * v * pow(0.8, i + 1) / g;
    return t;
}

static double friction_at(double t) {
    const double stop = 0.5 * atan2(1.5, 1.0), x = t < stop ? t : stop;
    return -1.0 + cos(2.0 * x) + 1.5 * sin(2.0 * x);
}

/* ---- runs of the test -------------------------------------------------------------------------------------------- */

/* The largest error of a run at its records, and the times of its contacts. */
typedef struct own_run {
    double (*exact)(double t);
    const kt_accuracy_results *study; /* its windows are left out */
    double error, velocity;
    int contacts;
    double times[100];
} own_run;

static bool is_left_out(const kt_accuracy_results *study, double t) {
    for (int i = 0; i < study->instant_count; i++)
        if (fabs(study->instants[i].time - t) <= study->window)
            return true;
    return false;
}

static int watch_own(const kt_record *record, void *user) {
    own_run *own = user;
    if (record->index == KT_INDEX_CONTACT) {
        const bool is_new = own->contacts == 0 || record->t > own->times[own->contacts - 1];
        if (is_new && own->contacts < 100)
            own->times[own->contacts++] = record->t;
    } else if (own->exact != NULL && !is_left_out(own->study, record->t)) {
        own->error = fmax(own->error, fabs(record->q[0] - own->exact(record->t)));
    }
    return 0;
}

/* One run as kt_simulation_run makes it, without the study. */
static void run_own(rail *r, const char *method, double step, kt_contact_scheme contact, own_run *own) {
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_error error;
    kt_run run = r->b.run;
    kt_simulation_options options = kt_simulation_options_default();
    void *watch = NULL;
    own->study = kt_accuracy_results_of(r->b.study);
    run.integrator = method;
    run.step = step;
    run.interval = run.duration / r->b.options.records;
    options.contact = contact;
    options.record_contacts = true;
    options.events = r->b.options.events != NULL ? r->events.count : 0;
    kt_status status = kt_model_compile(&r->b.description, NULL, &model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &run, &options, &simulation, &error);
    if (status == KT_OK && options.events > 0)
        status = r->events.add(simulation, model, &watch, r->events.user, &error);
    if (status == KT_OK)
        status = kt_simulation_run(simulation, watch_own, own, &error);
    kt_check_equal_int("run", status, KT_OK);
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

/* The printed errors are those of a run, outside of the windows. A record lies at each instant, and would have the jump
 * of 7.5 m/s as the error of its velocity. */
KT_TEST(errors_of_events_are_those_of_the_closed_form) {
    rail r;
    make_spring(&r);
    r.b.step = 0.01;
    must_create(&r.b);
    const kt_accuracy_results *study = kt_accuracy_results_of(r.b.study);
    const kt_accuracy_point *point = &study->points[0];
    kt_check_equal_int("instants", study->instant_count, 5);
    for (int k = 0; k < study->instant_count; k++)
        kt_check_near("instant of the reference", study->instants[k].time, 0.1 * pi + 0.2 * pi * k, 1e-12);
    kt_check_equal_int("records at instants", study->left_out, 5);
    own_run own = {.exact = spring_at};
    run_own(&r, "rk4", 0.01, KT_CONTACT_EVENTS, &own);
    double late = 0.0;
    kt_check_equal_int("events", r.occurred, 5);
    for (int k = 0; k < r.occurred; k++)
        late = fmax(late, fabs(r.times[k] - (0.1 * pi + 0.2 * pi * k)));
    kt_check_near("error of instants", point->error.instant, late, 1e-12);
    kt_check_near("error of positions", point->error.position, own.error, 1e-12);
    kt_check_true("they are no zeros", late > 1e-8 && own.error > 1e-8);
    kt_check_below("error of velocities", point->error.velocity, 1e-4);
    kt_check_equal_int("missed", point->error.missed, 0);
}

/* Free bodies have no events: their curve ends without points, and the other one is complete. */
KT_TEST(absolute_coordinates_do_not_run_a_motion_with_events) {
    rail r;
    kt_variant variants[2];
    make_spring(&r);
    r.b.step = 0.01;
    variants[0] = variants[1] = kt_variant_default(&r.b.run);
    variants[1].formulation = KT_FORMULATION_ABSOLUTE;
    r.b.options.variants = variants;
    r.b.options.variant_count = 2;
    must_create(&r.b);
    const kt_accuracy_results *study = kt_accuracy_results_of(r.b.study);
    kt_need(kt_check_equal_int("curves", study->curve_count, 2));
    kt_check_equal_int("tree", study->curves[0].count, 1);
    kt_check_equal_int("absolute", study->curves[1].count, 0);
    kt_check_equal_int("why", study->curves[1].end, KT_ACCURACY_UNSUPPORTED);
}

/* The instants of a contact, in the reference and in a run that is far off. */
KT_TEST(errors_of_impacts_are_those_of_the_closed_form) {
    rail r;
    make_bounces(&r);
    r.b.methods[0] = kt_method_find("euler");
    r.b.step = 0.002;
    must_create(&r.b);
    const kt_accuracy_results *study = kt_accuracy_results_of(r.b.study);
    kt_check_equal_int("impacts", study->instant_count, 6);
    for (int k = 0; k < study->instant_count; k++)
        kt_check_near("impact of the reference", study->instants[k].time, impact_at(k), 1e-12);
    own_run own = {.exact = NULL};
    run_own(&r, "euler", 0.002, KT_CONTACT_EVENTS, &own);
    double late = 0.0;
    kt_check_equal_int("impacts of the run", own.contacts, 6);
    for (int k = 0; k < own.contacts && k < 6; k++)
        late = fmax(late, fabs(own.times[k] - impact_at(k)));
    kt_check_near("error of instants", study->points[0].error.instant, late, 1e-12);
    kt_check_true("it is no zero", late > 1e-3);
}

/* Events and time stepping are two curves of one study. Time stepping has no instants, and its error falls like h. */
KT_TEST(both_contact_methods_are_points_of_one_study) {
    rail r;
    make_friction(&r);
    r.b.step = 0.01;
    r.b.options.contact_steps = true;
    must_create(&r.b);
    const kt_accuracy_results *study = kt_accuracy_results_of(r.b.study);
    kt_need(kt_check_equal_int("curves", study->curve_count, 2));
    kt_check_text("time stepping", study->curves[1].method->name, "moreau-jean");
    kt_check_equal_int("instants", study->instant_count, 1);
    kt_check_near("it sticks", study->instants[0].time, 0.5 * atan2(1.5, 1.0), 1e-12);
    const char *const names[] = {"rk4", NULL};
    for (int c = 0; c < 2; c++) {
        own_run own = {.exact = friction_at};
        run_own(&r, names[c], 0.01, c == 0 ? KT_CONTACT_EVENTS : KT_CONTACT_STEPS, &own);
        const kt_accuracy_point *point = &study->points[study->curves[c].first];
        kt_check_near("error", point->error.position, own.error, 1e-13);
        kt_check_equal_int("missed", point->error.missed, c);
        kt_check_true("usable", point->usable && own.error > 1e-12);
    }
}

/* The study ends where the reference does. A run that ends earlier has no error there, and is not used. */
KT_TEST(study_ends_at_the_event_that_ends_the_run) {
    rail r;
    make_rail(&r, 1.0, 0.0, 10.0);
    r.b.description.gravity = kt_vec3_make(0.0, -g, 0.0);
    r.events = (kt_accuracy_events){.count = 1, .add = add_ground, .release = release_nothing, .user = &r};
    r.b.options.events = &r.events;
    r.b.methods[0] = kt_method_find("implicit-euler");
    r.b.options.records = 200;
    const double steps[] = {0.02, 1e-4};
    r.b.options.steps = steps;
    r.b.options.step_count = 2;
    must_create(&r.b);
    const kt_accuracy_results *study = kt_accuracy_results_of(r.b.study);
    kt_check_equal_int("cut", study->cut, KT_ACCURACY_STOPPED);
    kt_check_near("end", study->duration, sqrt(2.0 / g), 1e-12);
    kt_check_near("asked", study->asked, 10.0, 0.0);
    kt_check_equal_int("records", study->records, 200);
    kt_check_true("early by 2 %: not usable", !study->points[0].usable && study->points[0].status == KT_OK);
    kt_check_true("fine steps", study->points[1].usable);
    /* z = 1 - g t (t + h) / 2 with implicit Euler */
    const double h = 1e-4, end = -0.5 * h + sqrt(0.25 * h * h + 2.0 / g);
    kt_check_near("error of the end", study->points[1].error.instant, sqrt(2.0 / g) - end, 1e-3 * h);
}
