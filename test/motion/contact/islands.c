/* Hard contacts that slip in several islands: motions as in each island alone, and memory that grows linearly. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/slip.h"
#include "kinetree/study.h"
#include "simulation/simulation.h"

#include <math.h>
#include <string.h>

#include "check.h"
#include "masks.h"
#include "motion/simulation/scenes.h"
#include "random.h"

enum { PLATES = 3, FEET = 3, NQ = 7, NV = 6 };

/* A scene of plates from `first` on, each on feet. Their effects take turns, so that the contacts of an island do not
 * follow each other. */
static void scene_plates(masks_scene *s, int first, int count, int feet) {
    masks_make(s);
    for (int i = 0; i < count; i++) {
        kt_body *plate = masks_add_body(s, KT_JOINT_FREE, kt_vec3_make(0.0, 0.0, 1.0));
        plate->mass = 1.0 + 0.3 * (first + i);
        plate->inertia = (kt_sym3){.xx = 0.1, .yy = 0.12, .zz = 0.2};
        plate->joint.position[0] = 2.0 * (first + i);
        plate->joint.position[2] = 0.1;
        plate->joint.position[3] = 1.0;
    }
    for (int k = 0; k < feet; k++)
        for (int i = 0; i < count; i++) {
            const double angle = 6.283185307179586 * k / feet;
            kt_effect *foot = masks_add_effect(s, KT_EFFECT_CONTACT);
            foot->between[0].body = s->body[i].name;
            foot->between[0].at = kt_vec3_make(0.3 * cos(angle), 0.3 * sin(angle), -0.1);
            foot->friction = 0.2 + 0.1 * (first + i);
        }
}

typedef struct way {
    const char *method;
    kt_reduction reduction; /* only QR has responses in range space */
    double step, duration, speed, bound;
} way;

/* Compares contacts that slip: their number, that of their islands, and whether slip is slow. */
static void check_islands(const kt_simulation *simulation, int count, bool is_slow) {
    const kt_slip_problem *p = kt_slip_problem_of(simulation->data);
    int slow = 0;
    kt_need(kt_check_equal_int("contacts that slip", (long long)simulation->model->n.slip, FEET * count));
    kt_check_equal_int("islands", (long long)p->islands, count);
    for (size_t i = 0; i < p->islands; i++)
        slow += p->island[i].is_slow;
    kt_check_equal_int("of slow slip", slow, is_slow ? count : 0);
}

typedef struct plate_state {
    double q[NQ], v[NV], damping[NV * NV];
} plate_state;

/* Writes the state of a plate and its part of the damping, whose other parts are zero. */
static void take_plate(const kt_simulation *simulation, const char *name, const double *damping, plate_state *to) {
    const kt_model *model = simulation->model;
    const kt_coordinates at = kt_body_coordinates(model, kt_body_find(model, name));
    const int nv = kt_model_nv(model);
    memcpy(to->q, kt_simulation_positions(simulation) + at.q, sizeof to->q);
    memcpy(to->v, kt_simulation_velocities(simulation) + at.v, sizeof to->v);
    for (int c = 0; c < NV; c++) {
        double others = 0.0;
        for (int i = 0; i < nv; i++) {
            const double x = damping[(at.v + c) * nv + i];
            others += i < at.v || i >= at.v + NV ? fabs(x) : 0.0;
            if (i >= at.v && i < at.v + NV)
                to->damping[c * NV + i - at.v] = x;
        }
        to->damping[c * NV] += others;
    }
}

/* Slides plates from `first` on for a time, and writes their states. */
static bool slide(const way *w, int first, int count, plate_state *to) {
    static masks_scene s;
    kt_error error = {0};
    kt_model_options options = kt_model_options_default();
    scene_plates(&s, first, count, FEET);
    s.description.gravity.x = 2.5;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            s.body[i].joint.velocity[k == 2 ? 5 : k] = w->speed * (1.0 + 0.4 * sin(3.0 * (first + i) + k));
    options.reduction = kt_reduction_method_of(w->reduction);
    kt_model *model = kt_test_model(&s.description, &options);
    kt_simulation *simulation = masks_start(model, w->method, w->step);
    kt_status status = kt_simulation_advance(simulation, w->duration, &error);
    const bool fine = kt_fine(w->method, status, &error);
    if (fine) {
        static double damping[PLATES * NV * PLATES * NV];
        double a[PLATES * NV];
        const kt_dynamic_state at = {.t = kt_simulation_time(simulation),
                                     .q = kt_simulation_positions(simulation),
                                     .v = kt_simulation_velocities(simulation),
                                     .tau = simulation->model->zero};
        const size_t nv = simulation->model->n.v;
        memset(damping, 0, sizeof damping);
        status = kt_slip_add_damping(simulation->model, simulation->data, &at, NULL, nv, a, damping, &error);
        (void)kt_fine("damping", status, &error);
        check_islands(simulation, count, w->speed < 1e-3);
        for (int i = 0; i < count; i++)
            take_plate(simulation, s.body[i].name, damping, &to[i]);
    }
    return fine;
}

/* Explicit and implicit steps, and accelerations with and without responses in range space. Explicit steps have the
 * bits of each plate alone. */
KT_TEST(plates_slide_as_each_one_alone) {
    static const way ways[] = {
        {"rk4", KT_REDUCTION_QR, 1e-3, 0.05, 1.0, 0.0},
        {"radau5", KT_REDUCTION_QR, 1e-3, 0.05, 1.0, 1e-11}, /* of Newton's iteration; measured: 6e-13 */
        {"rk4", KT_REDUCTION_PARTITION, 1e-3, 0.05, 1.0, 0.0},
        {"rk4", KT_REDUCTION_QR, 1e-9, 4e-9, 2e-6, 0.0},
        {"radau5", KT_REDUCTION_QR, 1e-9, 4e-9, 2e-6, 1e-13},
        {"rk4", KT_REDUCTION_PARTITION, 1e-9, 4e-9, 2e-6, 0.0},
    };
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        plate_state all[PLATES], alone;
        double q = 0.0, v = 0.0, damping = 0.0, size = 0.0;
        bool fine = slide(&ways[k], 0, PLATES, all);
        for (int i = 0; i < PLATES && fine; i++) {
            fine = slide(&ways[k], i, 1, &alone);
            for (int j = 0; j < NQ && fine; j++)
                q = fmax(q, fabs(all[i].q[j] - alone.q[j]));
            for (int j = 0; j < NV && fine; j++)
                v = fmax(v, fabs(all[i].v[j] - alone.v[j]) / ways[k].speed);
            for (int j = 0; j < NV * NV && fine; j++) {
                damping = fmax(damping, fabs(all[i].damping[j] - alone.damping[j]));
                size = fmax(size, fabs(alone.damping[j]));
            }
        }
        if (fine) {
            kt_note("%s, reduction %d, %g m/s", ways[k].method, (int)ways[k].reduction, ways[k].speed);
            kt_check_below("positions", q, ways[k].bound);
            kt_check_below("velocities, over the speed", v, ways[k].bound);
            kt_check_below("damping, over its largest number", damping / size, ways[k].bound);
        }
    }
}

static void check_growth(const char *what, const double size[3]) {
    kt_note("%s: %.0f bytes for each of 100 boxes, and %.0f of 200", what, size[1] / 100, size[2] / 200);
    kt_check_below("size of 200 boxes, over that of 100", size[2] / size[1], 2.1);
    kt_check_below("growth by 100 boxes, over that by 50", (size[2] - size[1]) / (size[1] - size[0]), 2.0 * 1.05);
}

/* Four contacts a box. */
KT_TEST(models_and_data_of_boxes_grow_with_their_number) {
    static const int boxes[] = {50, 100, 200};
    double model_size[3] = {0.0}, data_size[3] = {0.0};
    for (int i = 0; i < 3; i++) {
        static masks_scene s;
        scene_plates(&s, 0, boxes[i], 4);
        kt_model *model = kt_scene_compile(&s.description);
        model_size[i] = (double)kt_model_size(model);
        data_size[i] = (double)kt_data_size(model);
    }
    check_growth("models", model_size);
    check_growth("data", data_size);
}

/* Measured: 15 kB. With arrays for the contacts of all boxes at once it is 110 kB at 50 boxes, and 390 kB at 200. */
KT_TEST(data_of_boxes_grow_with_their_number) {
    static const int boxes[] = {50, 100, 200};
    double size[3] = {0.0};
    for (int i = 0; i < 3; i++) {
        static masks_scene s;
        scene_plates(&s, 0, boxes[i], 2);
        kt_model *model = kt_scene_compile(&s.description);
        size[i] = (double)kt_data_size(model);
    }
    kt_check_below("bytes for each of 50 boxes", size[0] / 50, 24e3);
    kt_check_below("bytes for each of 200 boxes", size[2] / 200, 24e3);
    kt_check_below("growth by 100 boxes, over that by 50", (size[2] - size[1]) / (size[1] - size[0]), 2.0 * 1.05);
}

/* Measured: 80 kB, with events and with time steps. With matrices for the contacts of all boxes at once it is
 * 350 kB at 50 boxes, and 1.1 MB at 200. */
KT_TEST(simulations_of_boxes_grow_with_their_number) {
    static const int boxes[] = {50, 100, 200};
    for (int steps = 0; steps < 2; steps++) {
        kt_simulation_options options = kt_simulation_options_default();
        kt_run run = kt_run_default();
        double size[3] = {0.0};
        run.integrator = steps ? NULL : "dopri5";
        run.step = steps ? 1e-3 : 0.0;
        options.contact = steps ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
        for (int i = 0; i < 3; i++) {
            static masks_scene s;
            scene_plates(&s, 0, boxes[i], 4);
            kt_model *model = kt_scene_compile(&s.description);
            size[i] = (double)kt_simulation_size(model, &run, &options);
        }
        kt_check_below("bytes for each of 50 boxes", size[0] / 50, 100e3);
        kt_check_below("bytes for each of 200 boxes", size[2] / 200, 100e3);
        check_growth(steps ? "simulations with time steps" : "simulations with events", size);
    }
}

/* Boxes fall by 1 cm, in groups of equal heights, and friction stops them. */
KT_TEST(two_hundred_boxes_fall_and_come_to_rest) {
    const int boxes = kt_sample(200);
    static masks_scene s;
    double height = 0.0, speed = 0.0;
    scene_plates(&s, 0, boxes, 4);
    for (int i = 0; i < boxes; i++) {
        s.body[i].joint.position[2] = 0.11 + 1e-3 * (i % 5);
        s.body[i].joint.velocity[0] = 0.05;
        s.body[i].mass = 1.0;
    }
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = masks_start(model, "dopri5", 0.0);
    kt_test_advance(simulation, 0.5);
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    for (int i = 0; i < boxes; i++)
        height = fmax(height, fabs(q[NQ * i + 2] - 0.1));
    for (int i = 0; i < boxes * NV; i++)
        speed = fmax(speed, fabs(v[i]));
    kt_check_below("height above the floor", height, 1e-10);
    kt_check_below("speed", speed, 1e-10);
    kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 4 * boxes);
}

/* Puts an arm on each plate, whose joint has a stop that is open. */
static void add_arms(masks_scene *s) {
    for (int i = 0; i < PLATES; i++) {
        kt_body *arm = masks_add_body(s, KT_JOINT_REVOLUTE, kt_vec3_make(0.0, 1.0, 0.0));
        kt_effect *stop = masks_add_effect(s, KT_EFFECT_JOINT_LIMIT);
        arm->parent = s->body[i].name;
        arm->com.x = 0.1;
        arm->joint.at.z = 0.2;
        arm->inertia = (kt_sym3){.xx = 0.1, .yy = 0.1, .zz = 0.1};
        stop->joint = arm->name;
        stop->lower = -1.0;
        s->body[i].joint.velocity[0] = 1.0;
    }
}

/* An open stop is a group without an equation in the plate's island. Accelerations of slip have the same bits for every
 * content of the groups' matrices. */
static void check_matrices(const kt_simulation *simulation) {
    static const int garbage[] = {0, 0x41, 0xff}; /* zeros, numbers, and those that are none */
    const kt_model *model = simulation->model;
    kt_data *data = simulation->data;
    const kt_dynamic_state at = {.t = kt_simulation_time(simulation),
                                 .q = kt_simulation_positions(simulation),
                                 .v = kt_simulation_velocities(simulation),
                                 .tau = model->zero};
    double a[2][PLATES * (NV + 1)];
    kt_error error = {0};
    int empty = 0;
    for (size_t g = 0; g < model->n.group; g++)
        empty += model->group[g].rank[KT_ROWS_ALL] == 0;
    kt_check_equal_int("groups without an equation", empty, PLATES);
    for (int k = 0; k < 3; k++) {
        memset(data->dense, garbage[k], model->n.dense * sizeof *data->dense);
        (void)kt_fine("a", kt_acceleration_trusted(model, data, &at, a[k > 0], &error), &error);
        kt_check_true("equal bits", k == 0 || memcmp(a[0], a[1], sizeof a[0]) == 0);
    }
}

KT_TEST(open_stops_leave_accelerations_of_slip) {
    static masks_scene s;
    scene_plates(&s, 0, PLATES, FEET);
    add_arms(&s);
    kt_simulation *simulation = masks_start(kt_scene_compile(&s.description), "rk4", 1e-3);
    kt_test_advance(simulation, 0.01);
    check_islands(simulation, PLATES, false);
    check_matrices(simulation);
}
