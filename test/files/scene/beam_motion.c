/* Beams that move, and a beam that bends in space. The cases are a spin-up, a shaft through its first critical speed,
 * and the Princeton beam. They are compared with solutions of beam equations that have nothing in common with segments.
 * Runs with finer segments are compared with each other. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "collect.h"

#include "kinetree/analysis.h"
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* The quantity that is observed in a run: the point of a body in the axes of the hub. */
typedef struct watch {
    int hub, last, component; /* bodies; 1: the least y; 2: the largest distance from the hub's x axis */
    kt_vec3 at, end;          /* of the last body; where it ended */
    double most;              /* the largest magnitude */
} watch;

static int look(const kt_record *record, void *user) {
    watch *w = user;
    const kt_pose hub = kt_body_pose(record->model, record->data, w->hub);
    const kt_vec3 tip = kt_point_position(record->model, record->data, w->last, w->at);
    w->end = kt_mat3_apply_transposed(hub.rotation, kt_vec3_sub(tip, hub.position));
    w->most = fmax(w->most, w->component == 1 ? -w->end.y : hypot(w->end.y, w->end.z));
    return 0;
}

/* Runs a scene with bodies `hub` and `last`. */
static void run(const char *text, const char *last, const char *method, double step, watch *w) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_error e = {0};
    kt_scene *scene = kt_test_scene(text);
    scene->run.integrator = method;
    scene->run.step = step;
    options.record = KT_RECORD_ENERGY; /* and so kinematics */
    const kt_model *model = kt_test_model(&scene->description, NULL);
    w->hub = kt_body_find(model, "hub");
    w->last = kt_body_find(model, last);
    w->at = kt_marker_at(model, w->last, 0);
    w->most = 0.0;
    kt_need_fine("run", kt_simulation_run(kt_test_simulation(model, &scene->run, &options), look, w, &e), &e);
}

/* ---- spin-up ----------------------------------------------------------------------------------------------------- */

/* The beam of T. R. Kane, R. R. Ryan, A. K. Banerjee, J. Guidance 10 (1987) 139, turned up to `speed` in 15 s. J. C.
 * Simo and L. Vu-Quoc, J. Appl. Mech. 53 (1986) 855, give its data:
 *     10 m, 1.2 kg/m, EI = 1.4e4 N m^2, EA = 2.8e7 N. */
#define SPIN_LENGTH 10.0
#define SPIN_MASS 1.2
#define SPIN_EI 1.4e4
#define SPIN_TIME 15.0

static double spin_speed(double speed, double t) {
    return speed / SPIN_TIME * (t - SPIN_TIME / (2.0 * pi) * sin(2.0 * pi * t / SPIN_TIME));
}
static double spin_slope(double speed, double t) { return speed / SPIN_TIME * (1.0 - cos(2.0 * pi * t / SPIN_TIME)); }

/* Galerkin's method on the linear equation of the bending v(x, t) in turning axes, N the tension of the rotation,
 *     m (v'' - W^2 v) + EI v_xxxx - (N v_x)_x = -m W' x,   N = m W^2 (l^2 - x^2) / 2,
 * with v = sum c_k (x / l)^(k + 2), integrated in time by classical Runge-Kutta steps. Returns the largest -v(l). */
enum { TERMS = 5 };

static void solve(double a[TERMS][TERMS], double *b) {
    for (int k = 0; k < TERMS; k++)
        for (int i = k + 1; i < TERMS; i++) {
            const double f = a[i][k] / a[k][k];
            for (int j = k; j < TERMS; j++)
                a[i][j] -= f * a[k][j];
            b[i] -= f * b[k];
        }
    for (int k = TERMS; k-- > 0;) {
        for (int j = k + 1; j < TERMS; j++)
            b[k] -= a[k][j] * b[j];
        b[k] /= a[k][k];
    }
}

static void spin_accelerate(double speed, double t, const double *c, double *out) {
    const double w = spin_speed(speed, t), w2 = w * w, l = SPIN_LENGTH, m = SPIN_MASS;
    double a[TERMS][TERMS];
    for (int i = 0; i < TERMS; i++) {
        const double p = i + 2.0;
        out[i] = -m * spin_slope(speed, t) * l * l / (p + 2.0);
        for (int j = 0; j < TERMS; j++) {
            const double q = j + 2.0, s = p + q;
            a[i][j] = m * l / (s + 1.0);
            const double bending = SPIN_EI / (l * l * l) * p * (p - 1.0) * q * (q - 1.0) / (s - 3.0);
            const double tension = 0.5 * m * w2 * l * p * q * (1.0 / (s - 1.0) - 1.0 / (s + 1.0));
            out[i] -= (bending + tension - w2 * a[i][j]) * c[j];
        }
    }
    solve(a, out);
}

static double spin_by_galerkin(double speed) {
    const double h = 1e-3;
    double y[2 * TERMS] = {0.0}, most = 0.0;
    for (int n = 0; n < 20000; n++) {
        static const double at[] = {0.0, 0.5, 0.5, 1.0};
        double k[4][2 * TERMS], z[2 * TERMS], tip = 0.0;
        for (int s = 0; s < 4; s++) {
            for (int i = 0; i < 2 * TERMS; i++)
                z[i] = y[i] + (s > 0 ? at[s] * h * k[s - 1][i] : 0.0);
            memcpy(k[s], z + TERMS, TERMS * sizeof *z);
            spin_accelerate(speed, fmin(SPIN_TIME, (n + at[s]) * h), z, k[s] + TERMS);
        }
        for (int i = 0; i < 2 * TERMS; i++)
            y[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        for (int i = 0; i < TERMS; i++)
            tip += y[i];
        most = fmax(most, -tip);
    }
    return most;
}

static double spin_by_segments(int segments, double speed, double step) {
    char text[1024], last[16];
    watch w = {.component = 1};
    snprintf(last, sizeof last, "b-%d", segments);
    snprintf(
        text, sizeof text,
        "kinetree: 1\nbodies:\n  - {name: hub, joint: {type: revolute}, mass: 1, inertia: [1e9, 1e9, 1e9]}\n"
        "effects:\n  - {type: motor, joint: hub, torque: {sine: {amplitude: %.17g, frequency: =1/15, phase: =pi/2, "
        "offset: %.17g}}}\n"
        "beams:\n  - {name: b, from: hub, segments: %d, length: 10, mass_per_length: 1.2, EI: 1.4e4}\n"
        "simulate: {duration: 15}\noutput: {interval: 0.01}\n",
        -1e9 * speed / SPIN_TIME, 1e9 * speed / SPIN_TIME, segments);
    run(text, last, "rk4", step, &w);
    return w.most;
}

/* Segments converge at second order to the linear equation, but for the square of the deflection over the length. Half
 * the speed gives half of the deflection or less, and a quarter of the difference or less. */
KT_TEST(spin_up_bends_back_as_galerkins_solution) {
    double apart[2];
    for (int i = 0; i < 2; i++) {
        const double speed = i == 0 ? 6.0 : 3.0, galerkin = spin_by_galerkin(speed);
        const double coarse = spin_by_segments(5, speed, 5e-3), middle = spin_by_segments(10, speed, 2.5e-3),
                     finest = spin_by_segments(20, speed, 6e-4);
        const double limit = finest + (finest - middle) / 3.0;
        kt_note("%g rad/s: %.5f, %.5f, %.5f with 5, 10, 20 segments, to %.5f; Galerkin %.5f", speed, coarse, middle,
                finest, limit, galerkin);
        kt_check_near("order in segments", log2((coarse - middle) / (middle - finest)), 2.0, 0.3);
        apart[i] = fabs(limit / galerkin - 1.0);
    }
    kt_check_below("difference at 6 rad/s", apart[0], 3e-3);
    kt_check_below("at 3 rad/s over that at 6", apart[1] / apart[0], 0.5);
}

/* At constant speed, the beam is longer by m W^2 l^3 / (3 EA). Here this is 5.14e-4 m (Simo and Vu-Quoc). */
KT_TEST(a_beam_that_has_been_spun_up_is_longer) {
    static const char text[] =
        "kinetree: 1\nbodies:\n  - {name: hub, joint: {type: revolute, velocity: 6}, mass: 1, inertia: [1, 1, 1]}\n"
        "loops:\n  - {name: drive, type: motion, joint: hub, position: {polynomial: [0, 6]}}\n"
        "beams:\n  - {name: b, from: hub, segments: 8, length: 10, mass_per_length: 1.2, EA: 2.8e7, GA: [1e7, 1e7], "
        "GJ: 1e4, EI: [1.4e4, 1.4e4], damping: 0.02}\n"
        "simulate: {duration: 1.5}\noutput: {interval: 0.5}\n";
    watch w = {.component = 1};
    run(text, "b-8", "radau5", 0.02, &w);
    kt_check_near("extension, m", w.end.x - 10.0, 1.2 * 36.0 * 1000.0 / (3.0 * 2.8e7), 5e-6);
}

/* ---- a shaft through its first critical speed -------------------------------------------------------------------- */

/* A shaft of 1 m, EI = 100, is clamped in a bearing that turns it ever faster. At its end, it carries an unbalanced
 * disc of 1 kg, 1 mm off the axis. A medium damps it with c = 1 N s/m. The shaft has 0.05 kg. The fraction 33 / 140 of
 * this counts in its first mode (Rayleigh). */
#define SHAFT_EI 100.0
#define SHAFT_MASS 0.05
#define SHAFT_OFF 1e-3
#define SHAFT_SLOPE 10.0 /* rad/s^2 */

/* Jeffcott's rotor, with f = slope t^2 / 2:
 *     (M + m) z'' + c z' + k z = M e (f'^2 - i f'') exp(i f).
 * Returns the largest |z|. */
static double jeffcott(double stiffness, double mass, double end) {
    const double h = 2e-4;
    double y[4] = {0.0}, most = 0.0;
    for (int n = 0; n * h < end; n++) {
        static const double at[] = {0.0, 0.5, 0.5, 1.0};
        double k[4][4], z[4];
        for (int s = 0; s < 4; s++) {
            const double t = (n + at[s]) * h, f = 0.5 * SHAFT_SLOPE * t * t, w = SHAFT_SLOPE * t;
            for (int i = 0; i < 4; i++)
                z[i] = y[i] + (s > 0 ? at[s] * h * k[s - 1][i] : 0.0);
            const double push[] = {SHAFT_OFF * (w * w * cos(f) + SHAFT_SLOPE * sin(f)),
                                   SHAFT_OFF * (w * w * sin(f) - SHAFT_SLOPE * cos(f))};
            for (int i = 0; i < 2; i++) {
                k[s][i] = z[2 + i];
                k[s][2 + i] = (push[i] - z[2 + i] - stiffness * z[i]) / mass;
            }
        }
        for (int i = 0; i < 4; i++)
            y[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        most = fmax(most, hypot(y[0], y[1]));
    }
    return most;
}

/* The stiffness of the end of the chain. It is 3 EI / L^3 for a beam. For the segments, the compliance is the sum over
 * the joints of
 *     l_k (L - x_k)^2 / EI. */
static double chain_stiffness(int segments) {
    double compliance = 0.0;
    const double l = 1.0 / segments;
    for (int k = 0; k < segments; k++)
        compliance += (k == 0 ? 0.5 : 1.0) * l * (1.0 - k * l) * (1.0 - k * l) / SHAFT_EI;
    return 1.0 / compliance;
}

KT_TEST(a_shaft_runs_through_its_first_critical_speed_as_jeffcotts_rotor) {
    enum { SEGMENTS = 8 };
    static const char format[] =
        "kinetree: 1\nbodies:\n  - {name: hub, joint: {type: revolute, axis: x}, mass: 1, inertia: [1e9, 1e9, 1e9]}\n"
        "  - {name: disc, parent: s-8, joint: {type: fixed, at: [0.125, 0, 0]}, mass: 1, com: [0, %g, 0], "
        "markers: {centre: [0, 0, 0]}}\n"
        "beams:\n  - {name: s, from: hub, segments: 8, length: 1, mass_per_length: %g, inertia_per_length: 1e-5, GJ: "
        "1, "
        "EI: [%g, %g]}\n"
        "effects:\n  - {type: motor, joint: hub, torque: %g}\n  - {type: drag, on: disc, at: centre, linear: 1}\n"
        "simulate: {duration: 3}\noutput: {interval: 1e-3}\n";
    char text[1024];
    watch w = {.component = 2};
    snprintf(text, sizeof text, format, SHAFT_OFF, SHAFT_MASS, SHAFT_EI, SHAFT_EI, 1e9 * SHAFT_SLOPE);
    run(text, "disc", "rk4", 5e-5, &w);
    const double whole = jeffcott(chain_stiffness(SEGMENTS), 1.0 + 33.0 / 140.0 * SHAFT_MASS, 3.0);
    const double plain = jeffcott(3.0 * SHAFT_EI, 1.0, 3.0);
    kt_note("%.6g mm; Jeffcott's rotor %.6g mm, with neither the mass of the shaft nor its segments %.6g mm",
            1e3 * w.most, 1e3 * whole, 1e3 * plain);
    kt_check_near("largest whirl over Jeffcott's", w.most / whole, 1.0, 2e-3);
    kt_check_above("whirl over the offset", w.most / SHAFT_OFF, 4.0);
    kt_check_below("beyond, it falls again: over the largest", hypot(w.end.y, w.end.z) / w.most, 0.8);
}

/* ---- the Princeton beam ------------------------------------------------------------------------------------------ */

/* A thin strip is clamped at one end. A weight at its other end, at an angle to its section, bends and twists it far:
 * E. H. Dowell, J. Traybar, Princeton AMS 1194 (1975). The strip is of aluminium, with
 *     length 0.508 m, section 12.77 by 3.2 mm, weight 13.345 N.
 * Stiffnesses here are those of that section: GJ, and EI about the axes y and z. */
static const double strip[3] = {3.22, 2.506, 39.85}, strip_length = 0.508;

/* The equations of a rod that keeps its length (Kirchhoff), from the clamp to the end:
 *     r' = R x,   R' = R [k],   k = K^-1 R'((r_end - r) x F).
 * An iteration finds the position of the end. */
static kt_vec3 bend_rod(kt_vec3 force) {
    enum { STEPS = 400, TIMES = 200 };
    const double h = strip_length / STEPS;
    kt_vec3 end = {strip_length, 0.0, 0.0};
    for (int n = 0; n < TIMES; n++) {
        kt_vec3 r = {0.0, 0.0, 0.0};
        kt_mat3 R = kt_mat3_identity();
        for (int i = 0; i < STEPS; i++) { /* the midpoint rule on rotations */
            kt_mat3 middle = R;
            kt_vec3 at = kt_vec3_add(r, kt_vec3_scale(0.5 * h, R.x)), k = {0.0, 0.0, 0.0};
            for (int side = 0; side < 2; side++) {
                const kt_vec3 m = kt_vec3_cross(kt_vec3_sub(end, side ? at : r), force);
                k = kt_mat3_apply_transposed(side ? middle : R, m);
                k = kt_vec3_make(k.x / strip[0], k.y / strip[1], k.z / strip[2]);
                middle = kt_mat3_multiply(R, kt_mat3_from_euler_vector(kt_vec3_scale(0.5 * h, k)));
            }
            r = kt_vec3_add(r, kt_vec3_scale(h, middle.x));
            R = kt_mat3_multiply(R, kt_mat3_from_euler_vector(kt_vec3_scale(h, k)));
        }
        end = kt_vec3_add(kt_vec3_scale(0.5, end), kt_vec3_scale(0.5, r));
    }
    return end;
}

/* The end of the strip of segments, at rest. */
static kt_vec3 bend_segments(int segments, kt_vec3 force) {
    char last[16];
    static double q[400], v[300];
    kt_error e = {0};
    const kt_equilibrium_options options = {.nearest = false, .most = 2000};
    snprintf(last, sizeof last, "b-%d", segments);
    const kt_opened at = kt_test_open(
        kt_test_scene_of(
            "kinetree: 1\nbeams:\n  - {name: b, segments: %d, length: %g, mass_per_length: 1, inertia_per_length: "
            "1e-4, "
            "GJ: %g, EI: [%g, %g]}\neffects:\n  - {type: force, at: %s.end, value: [%.17g, %.17g, %.17g]}\n",
            segments, strip_length, strip[0], strip[1], strip[2], last, force.x, force.y, force.z),
        NULL);
    kt_model_initial(at.model, q, v);
    kt_need_fine("equilibrium",
                 kt_equilibrium_find(kt_test_linearization(at.model, NULL), &options, 0.0, q, NULL, NULL, &e), &e);
    kt_need_fine("kinematics", kt_kinematics_update(at.model, at.data, q, NULL, NULL, &e), &e);
    const int body = kt_body_find(at.model, last);
    return kt_point_position(at.model, at.data, body, kt_marker_at(at.model, body, 0));
}

KT_TEST(the_princeton_beam_bends_and_twists_as_kirchhoffs_rod) {
    KT_WORST worst = kt_worst_make("end of the beam");
    for (int angle = 0; angle <= 90; angle += 30) {
        const double a = angle * pi / 180.0;
        const kt_vec3 force = {0.0, 13.345 * sin(a), -13.345 * cos(a)}, rod = bend_rod(force);
        const kt_vec3 end[2] = {bend_segments(8, force), bend_segments(16, force)};
        const double coarse = kt_vec3_norm(kt_vec3_sub(end[0], rod)), finer = kt_vec3_norm(kt_vec3_sub(end[1], rod));
        const kt_vec3 limit = kt_vec3_add(end[1], kt_vec3_scale(1.0 / 3.0, kt_vec3_sub(end[1], end[0])));
        kt_note("%d degrees: the end at (%.5f, %.5f, %.5f) m; off by %.2e and %.2e m with 8 and 16 segments", angle,
                rod.x, rod.y, rod.z, coarse, finer);
        kt_check_near("order in segments", log2(coarse / finer), 2.0, 0.1);
        kt_worst_near(&worst, kt_vec3_norm(kt_vec3_sub(limit, rod)), 0.0, 3e-5, "%d degrees", angle);
    }
}
