/* without-lapack computes two mechanisms, with a library that has LAPACK or not. The first is a quadruped on contacts,
 * whose legs are closed by four-bars. The second is a rope of one large group. The program prints the coordinates of
 * the groups and the quadruped's last state in hexadecimal digits. It also prints the message from compiling the rope
 * (without_lapack.py compares them). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "describe.h"

#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>

enum { LEGS = 4, BODIES = 1 + 5 * LEGS, LINKS = 48 };

typedef struct quadruped {
    kt_body body[BODIES];
    char name[BODIES][24];
    kt_loop loop[LEGS];
    char closed[LEGS][24];
    kt_effect effect[3 * LEGS];
} quadruped;

static kt_body bar(const char *name, const char *parent, kt_vec3 axis, kt_vec3 at, kt_vec3 to) {
    kt_body body = kt_body_of(name, parent, KT_JOINT_REVOLUTE, 0.4);
    body.joint.axis = axis;
    body.joint.at = at;
    body.com = kt_vec3_scale(0.5, to);
    body.inertia = kt_sym3_make(3e-3, 3e-3, 3e-3, 0.0, 0.0, 0.0);
    return body;
}

static kt_effect hold(const char *joint) {
    kt_effect spring = kt_effect_of(KT_EFFECT_JOINT_SPRING, joint);
    spring.stiffness = 150.0;
    spring.damping = 4.0;
    return spring;
}

/* A hip about x carries a thigh and a crank about y at one place. The thigh carries the shank. The crank carries a rod
 * parallel to the thigh, which is closed on the shank's lever. */
static void add_leg(quadruped *r, int k) {
    static const char *const part[] = {"hip", "thigh", "shank", "crank", "rod"};
    const kt_vec3 none = {0.0, 0.0, 0.0}, x = {1.0, 0.0, 0.0}, y = {0.0, 1.0, 0.0}, down = {0.0, 0.0, -0.3};
    const kt_vec3 lever = {0.1, 0.0, 0.0}, corner = {k < 2 ? 0.3 : -0.3, k % 2 ? 0.15 : -0.15, 0.0};
    kt_body *body = r->body + 1 + 5 * k;
    char(*name)[24] = r->name + 1 + 5 * k;
    for (int i = 0; i < 5; i++)
        (void)snprintf(name[i], sizeof name[i], "%s%d", part[i], k);
    body[0] = bar(name[0], "trunk", x, corner, none);
    body[1] = bar(name[1], name[0], y, none, down);
    body[2] = bar(name[2], name[1], y, down, down);
    body[3] = bar(name[3], name[0], y, none, lever);
    body[4] = bar(name[4], name[3], y, lever, down);
    (void)snprintf(r->closed[k], sizeof r->closed[k], "leg%d", k);
    r->loop[k] = kt_loop_of(r->closed[k], KT_LOOP_REVOLUTE);
    r->loop[k].axis = y;
    r->loop[k].between[0] = (kt_end){.body = name[4], .at = down};
    r->loop[k].between[1] = (kt_end){.body = name[2], .at = lever};
    kt_effect *contact = &r->effect[3 * k];
    *contact = kt_effect_of(KT_EFFECT_CONTACT, NULL);
    contact->between[0] = (kt_end){.body = name[2], .at = down};
    contact->stiffness = 1e5;
    contact->dissipation = 0.5;
    contact->friction = 0.6;
    contact->slip = 0.01;
    r->effect[3 * k + 1] = hold(name[1]);
    r->effect[3 * k + 2] = hold(name[0]);
}

static kt_status run_quadruped(kt_error *error) {
    static quadruped r;
    kt_description d = kt_description_default();
    kt_run run = kt_run_default();
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    r.body[0] = kt_body_of("trunk", NULL, KT_JOINT_FREE, 12.0);
    r.body[0].joint.position[2] = 0.61;
    r.body[0].inertia = kt_sym3_make(0.2, 0.5, 0.6, 0.0, 0.0, 0.0);
    for (int k = 0; k < LEGS; k++)
        add_leg(&r, k);
    d.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    d.bodies = r.body, d.body_count = BODIES;
    d.loops = r.loop, d.loop_count = LEGS;
    d.effects = r.effect, d.effect_count = 3 * LEGS;
    run.integrator = "rk4";
    run.step = 1e-4;
    kt_status status = kt_model_compile(&d, NULL, &model, error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &run, NULL, &simulation, error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, 0.2, error);
    for (int g = 0; g < kt_loop_group_count(model) && status == KT_OK; g++)
        printf("group of %d coordinates\n", kt_loop_group_at(model, g).coordinates);
    for (int i = 0; i < kt_model_nq(model) && status == KT_OK; i++)
        printf("%a\n", kt_simulation_positions(simulation)[i]);
    kt_simulation_free(simulation);
    kt_model_free(model);
    return status;
}

/* A rope whose ends are held: one group of as many coordinates as it has links, as one dense matrix. */
static kt_status compile_rope(kt_error *error) {
    static kt_body bodies[LINKS];
    static char names[LINKS][24];
    const kt_vec3 none = {0.0, 0.0, 0.0}, x = {1.0, 0.0, 0.0}, z = {0.0, 0.0, 1.0};
    kt_vec3 end = none;
    double direction = 0.0;
    for (int i = 0; i < LINKS; i++) {
        (void)snprintf(names[i], sizeof names[i], "link%d", i);
        bodies[i] = bar(names[i], i ? names[i - 1] : NULL, z, i ? x : none, x);
        bodies[i].joint.position[0] = i ? -1.0 / LINKS : 0.5;
        direction += bodies[i].joint.position[0];
        end = kt_vec3_add(end, kt_vec3_make(cos(direction), sin(direction), 0.0));
    }
    kt_loop loop = kt_loop_of("far-end", KT_LOOP_SPHERICAL);
    loop.between[0] = (kt_end){.body = names[LINKS - 1], .at = x};
    loop.between[1].at = end;
    kt_description d = kt_description_default();
    kt_model_options options = kt_model_options_default();
    kt_model *model = NULL;
    d.bodies = bodies, d.body_count = LINKS;
    d.loops = &loop, d.loop_count = 1;
    options.structure = KT_STRUCTURE_DENSE;
    const kt_status status = kt_model_compile(&d, &options, &model, error);
    kt_model_free(model);
    return status;
}

int main(void) {
    kt_error error = {0};
    const kt_status walks = run_quadruped(&error);
    if (walks != KT_OK)
        printf("%s: %s\n", error.where, error.message);
    error = (kt_error){0};
    const kt_status rope = compile_rope(&error);
    printf("rope: %s; %s: %s\n",
           rope == KT_OK                  ? "ok"
           : rope == KT_ERROR_UNSUPPORTED ? "unsupported"
                                          : "error",
           error.where, error.message);
    return walks != KT_OK;
}
