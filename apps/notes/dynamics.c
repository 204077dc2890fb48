/* Chapters 3 and 4: a point of variable mass, bars, kinetic energy, Gauss' principle. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "notes.h"

#include <math.h>

/* A bar of 3 kg and 2 m on a floor without friction. */
static const char bar[] =
    "kinetree: 1\nbodies:\n"
    "  - {name: bar, joint: {type: planar, axis: z}, mass: 3, shape: {type: rod, to: [2, 0, 0]}}\n";

static bool accelerate_mechanism(mechanism *m, const char *text, double *a) {
    kt_error e = {0};
    return open_mechanism(m, text) &&
           works(kt_acceleration_evaluate(m->model, m->data, 0.0, m->q, m->v, NULL, NULL, a, &e), &e);
}

static bool bars(void) {
    mechanism m;
    double a[8];
    /* 3.1: a force of 6 N along the bar at its end: x'' = f / m */
    if (!accelerate_mechanism(
            &m,
            "kinetree: 1\nbodies:\n"
            "  - {name: bar, joint: {type: planar, axis: z}, mass: 3, shape: {type: rod, to: [2, 0, 0]}}\n"
            "effects:\n  - {type: force, at: bar, value: [6, 0, 0], frame: body}\n",
            a))
        return false;
    tell("3.1", a[0]);
    close_mechanism(&m);
    /* 3.3: a force f = 6 N up at one end, and down at the other. The result is w' = 12 f / (m l). */
    if (!accelerate_mechanism(
            &m,
            "kinetree: 1\nbodies:\n"
            "  - {name: bar, joint: {type: planar, axis: z}, mass: 3, shape: {type: rod, to: [2, 0, 0]}, "
            "markers: {end: [2, 0, 0]}}\n"
            "effects:\n  - {type: force, at: bar.end, value: [0, 6, 0], frame: body}\n"
            "  - {type: force, at: bar, value: [0, -6, 0], frame: body}\n",
            a))
        return false;
    tell("3.3", a[2]);
    close_mechanism(&m);
    return true;
}

/* H 3.1: m v' = f + m' u. A rocket of 10 kg ejects 8 kg backwards. The exhaust velocity is 2500 m/s. The final velocity
 * is u ln(m0 / m), independently of the way that it burns. */
static bool rocket(void) {
    kt_scene scene;
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_error e = {0};
    static const char text[] = "kinetree: 1\nbodies:\n"
                               "  - {name: rocket, joint: {type: prismatic, axis: z}, exhaust: [0, 0, -2500],\n"
                               "     mass: {ramp: {from: 10, to: 2, start: 0, end: 3}}}\n"
                               "simulate: {duration: 3, integrator: dopri5, tolerance: 1e-10}\n";
    if (!works(kt_scene_parse("rocket", text, sizeof text - 1, &scene, NULL, NULL, &e), &e) ||
        !works(kt_model_compile(&scene.description, NULL, &model, &e), &e) ||
        !works(kt_simulation_create(model, &scene.run, NULL, &simulation, &e), &e) ||
        !works(kt_simulation_advance(simulation, 3.0, &e), &e))
        return false;
    tell("3.1H", kt_simulation_velocities(simulation)[0]);
    kt_simulation_free(simulation);
    kt_model_free(model);
    kt_scene_free(&scene);
    return true;
}

/* The bar cut at a quarter, both parts welded: the load of the weld is the internal force. */
static bool cut(const char *exercise, const char *effects, int component) {
    static const char parts[] =
        "kinetree: 1\nbodies:\n"
        "  - {name: first, joint: {type: planar, axis: z}, mass: 0.75, shape: {type: rod, to: [0.5, 0, 0]}}\n"
        "  - {name: second, parent: first, joint: {type: fixed, at: [0.5, 0, 0]}, mass: 2.25, shape: {type: "
        "rod, to: [1.5, 0, 0]}, markers: {end: [1.5, 0, 0]}}\neffects:\n";
    mechanism m;
    kt_error e = {0};
    kt_wrench joints[8];
    char text[1024];
    size_t used = 0;
    for (const char *part = parts; *part; part++)
        text[used++] = *part;
    for (const char *part = effects; *part; part++)
        text[used++] = *part;
    text[used] = '\0';
    if (!open_mechanism(&m, text) ||
        !works(kt_reaction_evaluate(m.model, m.data, 0.0, m.q, m.v, NULL, NULL, joints, NULL, &e), &e))
        return false;
    const kt_wrench w = joints[kt_body_find(m.model, "second")];
    tell(exercise, component == 0 ? w.force.x : component == 1 ? w.force.y : w.moment.z);
    close_mechanism(&m);
    return true;
}

/* Compares T of a tumbling bar by the engine with T of (3.35) about its end:
 *
 *     T = m v v / 2 + w . s x v + w J w / 2 */
static bool check_kinetic_energy(void) {
    mechanism m;
    kt_error e = {0};
    if (!open_mechanism(&m, bar))
        return false;
    m.v[0] = 0.3;
    m.v[1] = -0.8;
    m.v[2] = 1.7;
    if (!works(kt_kinematics_update(m.model, m.data, m.q, m.v, NULL, &e), &e))
        return false;
    const double T = kt_kinetic_energy(m.model, m.data);
    const double mass = 3.0, l = 2.0, vx = 0.3, vy = -0.8, w = 1.7;
    const double about_end =
        0.5 * mass * (vx * vx + vy * vy) + w * mass * 0.5 * l * vy + 0.5 * w * w * mass * l * l / 3.0;
    const double cx = vx, cy = vy + 0.5 * l * w;
    const double about_centre = 0.5 * mass * (cx * cx + cy * cy) + 0.5 * w * w * mass * l * l / 12.0;
    tell("3.4", fabs(T - about_end));
    tell("3.5", fabs(T - about_centre));
    tell("3.6", T);
    kt_vec3 centre;
    (void)kt_mass_center(m.model, m.data, &centre);
    tell("3.2", centre.x);
    close_mechanism(&m);
    return true;
}

/* 4.4: of all accelerations that the pendulum's rod allows, that of the engine has the least Gaussian. */
static bool gauss(void) {
    mechanism m;
    kt_error e = {0};
    double a[4], least = INFINITY;
    if (!open_mechanism(
            &m, "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                "  - {name: x, joint: {type: prismatic, axis: x, position: 0.6, velocity: 0.8}}\n"
                "  - {name: z, parent: x, joint: {type: prismatic, axis: z, position: -0.8, velocity: 0.6}, mass: 2}\n"
                "loops:\n  - {name: rod, type: distance, between: [world, z], length: 1}\n") ||
        !works(kt_acceleration_evaluate(m.model, m.data, 0.0, m.q, m.v, NULL, NULL, a, &e), &e))
        return false;
    const double G = a[0] * a[0] + (a[1] + 9.81) * (a[1] + 9.81); /* over m / 2 */
    for (int i = -100; i <= 100; i++) {                           /* along the rod's tangent (0.8, 0.6) */
        const double s = 0.01 * i, x = a[0] + 0.8 * s, z = a[1] + 0.6 * s;
        const double other = x * x + (z + 9.81) * (z + 9.81) - G;
        least = i == 0 ? least : fmin(least, other / (s * s)); /* s^2 exactly at a minimum */
    }
    tell("4.4", least);
    close_mechanism(&m);
    return true;
}

/* Internal forces on the part beyond the cut, with f = 6 N and s = xi / l:
 *
 *   - A force f pushes one end along the bar. The normal force is -f (1 - xi / l).
 *   - A pair of forces turns the bar, at rest. The shear force is f (1 - 6 s + 6 s^2). */
bool dynamics(void) {
    return rocket() && bars() && cut("3.2E", "  - {type: force, at: first, value: [6, 0, 0], frame: body}\n", 0) &&
           cut("3.3H",
               "  - {type: force, at: first, value: [0, -6, 0], frame: body}\n"
               "  - {type: force, at: second.end, value: [0, 6, 0], frame: body}\n",
               1) &&
           check_kinetic_energy() && gauss();
}
