/* Compiles boxes that each fall on four hard contacts, creates a simulation with events, and lets the boxes come to
 * rest with time steps. growth.py counts the instructions.
 *
 * growth-count BOXES */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../describe.h"

#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 200, CORNERS = 4 };

static void describe(kt_description *d, int boxes) {
    static kt_body body[MOST];
    static kt_effect effect[MOST * CORNERS];
    static char name[MOST][8];
    for (int i = 0; i < boxes; i++) {
        (void)snprintf(name[i], sizeof name[i], "b%d", i);
        body[i] = kt_body_of(name[i], NULL, KT_JOINT_FREE, 1.0);
        body[i].inertia = (kt_sym3){.xx = 0.1, .yy = 0.12, .zz = 0.2};
        body[i].joint.position[0] = 2.0 * i;
        body[i].joint.position[2] = 0.11;
        body[i].joint.position[3] = 1.0;
        body[i].joint.velocity[0] = 0.1;
        for (int k = 0; k < CORNERS; k++) {
            kt_effect *corner = &effect[CORNERS * i + k];
            *corner = kt_effect_of(KT_EFFECT_CONTACT, NULL);
            corner->between[0].body = name[i];
            corner->between[0].at = kt_vec3_make((k & 1) != 0 ? 0.2 : -0.2, (k & 2) != 0 ? 0.3 : -0.3, -0.1);
            corner->friction = 0.4;
            corner->restitution = 0.0;
        }
    }
    *d = kt_description_default();
    d->gravity = kt_vec3_make(0.0, 0.0, -9.81);
    d->bodies = body;
    d->body_count = boxes;
    d->effects = effect;
    d->effect_count = boxes * CORNERS;
}

/* Whether all boxes lie still on the ground. */
static bool lie_still(const kt_simulation *simulation, int boxes) {
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    bool still = true;
    for (int i = 0; i < boxes; i++)
        still = still && fabs(q[7 * i + 2] - 0.1) < 1e-9 && fabs(v[6 * i]) < 1e-9;
    return still;
}

/* Creates a simulation with events, which does not run. */
static kt_status create_alone(const kt_model *model, kt_error *error) {
    kt_run run = kt_run_default();
    kt_simulation *simulation = NULL;
    run.integrator = "dopri5";
    run.duration = 1.0;
    const kt_status status = kt_simulation_create(model, &run, NULL, &simulation, error);
    kt_simulation_free(simulation);
    return status;
}

/* Lets the boxes fall with time steps. */
static kt_status let_fall(const kt_model *model, int boxes, bool *still, kt_error *error) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_default();
    kt_simulation *simulation = NULL;
    options.contact = KT_CONTACT_STEPS;
    run.integrator = NULL;
    run.step = 1e-3;
    run.duration = 1.0;
    kt_status status = kt_simulation_create(model, &run, &options, &simulation, error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, 0.06, error);
    *still = status == KT_OK && lie_still(simulation, boxes);
    kt_simulation_free(simulation);
    return status;
}

int main(int argc, char **argv) {
    const int boxes = argc > 1 ? atoi(argv[1]) : 1;
    kt_description d;
    kt_model_options options = kt_model_options_default();
    kt_error error = {0};
    kt_model *model = NULL;
    bool still = false;
    if (boxes < 1 || boxes > MOST)
        return 1;
    describe(&d, boxes);
    options.isa = KT_ISA_BASE; /* valgrind lacks AVX-512 */
    kt_status status = kt_model_compile(&d, &options, &model, &error);
    if (status == KT_OK)
        status = create_alone(model, &error);
    if (status == KT_OK)
        status = let_fall(model, boxes, &still, &error);
    if (!still)
        (void)fprintf(stderr, "%s: %s\n", error.where, error.message);
    kt_model_free(model);
    return still ? 0 : 1;
}
