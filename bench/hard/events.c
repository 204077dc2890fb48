/* Motions with impacts, stick and slip, held to closed forms:
 *
 *     creep    a block on a slope of tan(a) = 0.95 mu stays where it lies
 *     bounce   a ball that falls from 1 m bounces with e = 1/2, ever lower, and rests from 3 sqrt(2 / g) on
 *     belt     a block on a spring is carried along by a belt at w0 until k x = mu m g; from then on it swings about that
 *              place, at w^2 = k / m, by w0 / w: friction of a belt that is always faster is constant
 *
 * This engine takes the contact as it is (restitution, friction), with steps of its own to 1e-10. */
#include "events.h"

#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <time.h>

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

/* Bounces at t1 (1 + 2 e + ... + 2 e^k), at e^k of the first speed. */
static double bouncing(const kt_events_problem *p, double t) {
    const double g = p->gravity, first = sqrt(2.0 * p->drop / g);
    double begin = first, speed = p->restitution * g * first;
    if (t < first)
        return p->drop - 0.5 * g * t * t;
    while (speed > 1e-9 && t > begin + 2.0 * speed / g) {
        begin += 2.0 * speed / g;
        speed *= p->restitution;
    }
    return speed > 1e-9 ? (t - begin) * (speed - 0.5 * g * (t - begin)) : 0.0;
}

/* Seen from the belt. */
static double carried(const kt_events_problem *p, double t) {
    const double reach = p->friction * p->mass * p->gravity / p->stiffness, w = sqrt(p->stiffness / p->mass);
    const double slip = t - reach / p->belt;
    return slip < 0.0 ? 0.0 : reach + p->belt / w * sin(w * slip) - p->belt * t;
}

void kt_events_see(kt_events_watch *watch, double t, double x) {
    const double exact = watch->which == KT_EVENTS_BOUNCE ? bouncing(watch->problem, t)
                         : watch->which == KT_EVENTS_BELT ? carried(watch->problem, t)
                                                          : 0.0;
    const double error = fabs(x - exact);
    if (!(error <= watch->error)) /* NaN stays */
        watch->error = error;
}

double kt_events_clock(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ---- this engine ------------------------------------------------------------------------------------------------- */

static int see_record(const kt_record *record, void *user) {
    kt_events_watch *watch = user;
    kt_events_see(watch, record->time, record->q[0]);
    return 0;
}

static bool run(kt_events_watch *watch, const kt_description *description) {
    kt_error error = {0};
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_run options = kt_run_default();
    options.duration = watch->problem->duration;
    options.interval = 1e-3;
    options.relative = options.absolute = 1e-10;
    kt_status status = kt_model_compile(description, NULL, &model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &options, NULL, &simulation, &error);
    const double begin = kt_events_clock();
    if (status == KT_OK)
        status = kt_simulation_run(simulation, see_record, watch, &error);
    watch->seconds = kt_events_clock() - begin;
    if (status != KT_OK)
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", error.message);
    kt_simulation_free(simulation);
    kt_model_free(model);
    return status == KT_OK;
}

bool kt_events_kinetree(kt_events_watch *watch) {
    const kt_events_problem *p = watch->problem;
    kt_body body[2] = {kt_body_default(), kt_body_default()};
    kt_effect effect[2] = {kt_effect_default(), kt_effect_default()};
    kt_description d = kt_description_default();
    char formula[80];
    d.gravity = kt_vec3_make(p->gravity * sin(p->tilt), 0.0, -p->gravity * cos(p->tilt));
    d.bodies = body;
    d.effects = effect;
    d.effect_count = 1;
    body[0].name = "x";
    body[0].joint.type = KT_JOINT_PRISMATIC;
    body[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    if (watch->which == KT_EVENTS_BOUNCE) {
        body[0].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        body[0].joint.position[0] = p->drop;
        body[0].mass = p->mass;
        effect[0].type = KT_EFFECT_JOINT_LIMIT;
        effect[0].joint = "x";
        effect[0].lower = 0.0;
        effect[0].restitution = p->restitution;
        d.body_count = 1;
        return run(watch, &d);
    }
    body[1].name = "block";
    body[1].parent = "x";
    body[1].joint.type = KT_JOINT_PRISMATIC;
    body[1].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    body[1].mass = p->mass;
    effect[0].type = KT_EFFECT_CONTACT;
    effect[0].name = "floor";
    effect[0].between[0].body = "block";
    effect[0].friction = p->friction;
    effect[0].restitution = 0.0;
    d.body_count = 2;
    if (watch->which == KT_EVENTS_BELT) {
        (void)snprintf(formula, sizeof formula, "-%.17g*(position.x + %.17g*t)", p->stiffness, p->belt);
        effect[1].type = KT_EFFECT_EXPRESSION;
        effect[1].joint = "x";
        effect[1].formula[0] = formula;
        d.effect_count = 2;
    }
    return run(watch, &d);
}
