/* Impacts, stick and slip in MuJoCo: bodies on slides, perhaps on a hinge, each a box or a sphere, and planes. MuJoCo's
 * contacts are soft by design. Contacts without restitution have the stiffness that is advised for the step and the
 * elliptic cone. Their impedance along friction is ten times as large, and the solver that removes slip is on. MuJoCo
 * has no restitution: such a contact is a spring and a damper that do not pull. The damping ratio yields e (T.
 * Schwager, T. Poeschel, Granular Matter 9, 2007). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco.h"

#include <math.h>
#include <stdlib.h>

static const char *const axes[KT_EVENTS_AXES] = {"1 0 0", "0 0 1"};

/* The damping ratio z with
 *     e = exp(-z / w (pi - atan2(2 z w, 1 - 2 z^2))), w = sqrt(1 - z^2)
 * The right-hand side falls with z. The result is 0 for e = 1. */
double kt_mujoco_damping(double e) {
    const double pi = 3.14159265358979323846;
    double low = 0.0, high = 0.999;
    for (int i = 0; i < 60; i++) {
        const double z = 0.5 * (low + high), w = sqrt(1.0 - z * z);
        *(exp(-z / w * (pi - atan2(2.0 * z * w, 1.0 - 2.0 * z * z))) > e ? &low : &high) = z;
    }
    return low;
}

/* Contacts with restitution e oscillate at w, a fraction of the rate of steps. The search covered fractions from 0.03
 * to 1.3. The chosen w has the least error of the bouncing ball. Others take two steps (for the rocking block, two to
 * ten are alike, 4e-5 to 2e-4 m). In a cradle no w helps. Contacts that overlap in time are solved together, as one
 * impact of all balls, and the first ball comes back. */
static void write_contacts(FILE *xml, const kt_events_problem *p) {
    const double w = 0.18 / p->step;
    if (p->restitution > 0.0)
        (void)fprintf(xml, "<default><geom solref='%.17g %.17g'", -w * w, -2.0 * kt_mujoco_damping(p->restitution) * w);
    else
        (void)fprintf(xml, "<default><geom solref='%.17g 1'", 2.0 * p->step);
    (void)fprintf(xml, " solimp='0.9999 0.9999 0.001' friction='%.17g 0 0'/></default>", p->friction);
}

static void write_body(FILE *xml, const kt_events_body *body, const char *name) {
    (void)fprintf(xml, "<body pos='%.17g 0 %.17g'>", body->at[KT_EVENTS_X], body->at[KT_EVENTS_Z]);
    for (int axis = 0; axis < KT_EVENTS_AXES; axis++)
        if (body->is_free[axis])
            (void)fprintf(xml, "<joint type='slide' axis='%s'/>", axes[axis]);
    if (body->turns)
        (void)fputs("<joint type='hinge' axis='0 1 0'/>", xml);
    if (body->shape == KT_EVENTS_BALL)
        (void)fprintf(xml, "<geom type='sphere' size='%.17g'", body->half[KT_EVENTS_X]);
    else
        (void)fprintf(xml, "<geom type='box' size='%.17g 0.1 %.17g'", body->half[KT_EVENTS_X], body->half[KT_EVENTS_Z]);
    (void)fprintf(xml, " mass='%.17g'/><site name='%s'/></body>", body->mass, name);
}

/* A tendon with a limit from the world's site to that of the first body, as stiff as the contacts. */
static void write_rope(FILE *xml, const kt_events_problem *p) {
    if (p->rope > 0.0)
        (void)fprintf(
            xml,
            "<tendon><spatial limited='true' range='0 %.17g' solreflimit='%.17g 1' solimplimit='0.9999 0.9999 0.001'>"
            "<site site='origin'/><site site='first'/></spatial></tendon>",
            p->rope, 2.0 * p->step);
}

static void write_scene(FILE *xml, const kt_events_problem *p) {
    (void)fprintf(
        xml,
        "<mujoco><option gravity='%.17g 0 %.17g' timestep='%.17g' integrator='%s' solver='Newton' iterations='100'"
        " tolerance='1e-14' cone='elliptic' impratio='10' noslip_iterations='20' noslip_tolerance='1e-14'/>",
        p->gravity * sin(p->tilt), -p->gravity * cos(p->tilt), p->step, p->restitution > 0.0 ? "RK4" : "Euler");
    write_contacts(xml, p);
    (void)fputs("<worldbody>", xml);
    for (int i = 0; i < p->contact_count; i++)
        if (p->contact[i].lower < 0)
            (void)fprintf(xml, "<geom type='plane' size='100 100 1' zaxis='%s'/>", axes[p->contact[i].axis]);
    for (int i = 0; i < p->body_count; i++)
        write_body(xml, &p->body[i], i == 0 ? "first" : "");
    (void)fputs("<site name='origin'/></worldbody>", xml);
    write_rope(xml, p);
    (void)fputs("</mujoco>", xml);
}

/* Coordinates are counted from the start. A body's slides come first among its joints, that along x before that along
 * z. */
static void see(kt_events_watch *watch, const mjModel *m, mjData *d, double t) {
    const kt_events_problem *p = watch->problem;
    for (int i = 0; i < p->body_count; i++) {
        const kt_events_body *body = &p->body[i];
        const int first = m->jnt_qposadr[m->body_jntadr[i + 1]];
        const int skipped = p->axis == KT_EVENTS_Z && body->is_free[KT_EVENTS_X];
        kt_events_see(watch, i, t, body->at[p->axis] + (body->is_free[p->axis] ? d->qpos[first + skipped] : 0.0));
    }
}

static void push(const kt_events_problem *p, mjModel *m, mjData *d, double t) {
    for (int i = 0; i < p->body_count; i++)
        if (p->body[i].is_free[KT_EVENTS_X]) {
            const int joint = m->body_jntadr[i + 1];
            const double x = p->body[i].at[KT_EVENTS_X] + d->qpos[m->jnt_qposadr[joint]];
            d->qfrc_applied[m->jnt_dofadr[joint]] = p->body[i].push + (i == 0 ? kt_events_pull(p, x, t) : 0.0);
        }
}

static void begin(const kt_events_problem *p, const mjModel *m, mjData *d) {
    for (int i = 0; i < p->body_count; i++) {
        if (p->body[i].is_free[KT_EVENTS_X])
            d->qvel[m->body_dofadr[i + 1]] = p->body[i].speed;
        if (p->body[i].turns) /* by the last of its joints */
            d->qpos[m->jnt_qposadr[m->body_jntadr[i + 1] + m->body_jntnum[i + 1] - 1]] = p->body[i].lean;
    }
}

bool kt_events_mujoco(kt_events_watch *watch) {
    static const kt_mujoco_motion slides = {.write = write_scene, .begin = begin, .see = see, .act = push};
    return kt_mujoco_run(watch, &slides);
}

/* ---- any motion -------------------------------------------------------------------------------------------------- */

/* With no text where there is no memory. */
static void write_text(const kt_mujoco_motion *motion, const kt_events_problem *p, bool is_part, kt_mujoco_text *out) {
    FILE *xml = open_memstream(&out->text, &out->size);
    if (!xml)
        return;
    if (is_part)
        motion->write_part(xml);
    else
        motion->write(xml, p);
    if (fclose(xml) != 0) {
        free(out->text);
        out->text = NULL;
    }
}

static mjModel *load(kt_events_watch *watch, const kt_mujoco_motion *motion) {
    char reason[KT_MUJOCO_REASON];
    kt_mujoco_text scene = {.text = NULL}, part = {.text = NULL};
    write_text(motion, watch->problem, false, &scene);
    if (motion->write_part)
        write_text(motion, watch->problem, true, &part);
    mjModel *model = kt_mujoco_read_parts(&scene, motion->write_part ? &part : NULL, reason);
    if (!model)
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", reason);
    return model;
}

static void say_nothing(const char *words) { (void)words; }

bool kt_mujoco_run(kt_events_watch *watch, const kt_mujoco_motion *motion) {
    const kt_events_problem *p = watch->problem;
    const long every = lround(1e-3 / p->step), steps = lround(p->duration / p->step);
    mju_user_warning = say_nothing; /* it would write a file */
    mjModel *m = load(watch, motion);
    if (!m)
        return false;
    mjData *d = mj_makeData(m);
    if (motion->begin)
        motion->begin(p, m, d);
    const double start = kt_events_clock();
    for (long k = 0; k <= steps; k++) {
        const double t = (double)k * p->step;
        if (k % every == 0)
            motion->see(watch, m, d, t);
        if (motion->act)
            motion->act(p, m, d, t);
        mj_step(m, d);
    }
    watch->seconds = kt_events_clock() - start;
    mj_deleteData(d);
    mj_deleteModel(m);
    return true;
}
