/* Kinds 9 and 10: fast motion next to slow motion.
 *
 * Two blocks in a row, with masses M and m and springs K and k. Let u be the place of the first block, and s that of
 * the second on the first. The equations are `(M + m) u'' + m s'' = -K u` and `m (u'' + s'') = -k s`. The modes are `u
 * = A cos(w t + ...)` and s = rho u with rho = w^2 / (k/m - w^2). The frequencies follow from `(K - (M + m) w^2)(k - m
 * w^2) = m^2 w^4`. From rest,
 *   u = sum_i A_i cos(w_i t),  s = sum_i rho_i A_i cos(w_i t),  sum A_i = u0, sum rho_i A_i = s0.
 * The larger root follows from the formula for a sum, the smaller from their product, so that neither cancels.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include "kinetree/analysis.h"

#include <math.h>

static void watch_energy(kt_hard_watch *w, const kt_hard_view *view) { kt_hard_watch_energy(w, view, 0); }

/* ---- announced --------------------------------------------------------------------------------------------------- */

/* Beyond the limit, the analysis reports it before the run. A run that starts nevertheless ends with a message and a
 * finite state. `step` is beyond the limit. The limit must lie between `least` and `most`. */
static void announce(kt_hard *h, const kt_hard_motion *motion, double step, double least, double most) {
    kt_hard_motion fixed = *motion;
    kt_spectrum *spectrum = NULL;
    kt_error error = {KT_OK, "", ""};
    h->observed[1] = 0.0;
    fixed.integrator = "rk4";
    fixed.tolerance = 0.0;
    fixed.step = step;
    if (!kt_hard_start(h, &fixed) || !kt_hard_fine(h, kt_spectrum_create(h->model, 1, &spectrum, &error), &error))
        return;
    kt_run run = kt_hard_settings(h, &fixed);
    if (kt_hard_fine(h, kt_spectrum_along(spectrum, &run, &error), &error)) {
        const kt_step_limit limit = kt_spectrum_limit(spectrum, kt_method_find("rk4"), run.duration, step);
        kt_hard_say(h, "RK4 is stable to %.3g s", limit.step);
        kt_hard_claim(h, 1, limit.step > least && limit.step < most, "the limit is where theory has it");
        kt_hard_claim(h, 1, limit.growth > 1e3, "the growth beyond it is told");
    }
    kt_spectrum_free(spectrum);
    const kt_status status = kt_simulation_advance(h->simulation, run.duration, &error);
    kt_hard_claim(h, 1, status == KT_ERROR_NOT_FINITE || status == KT_ERROR_CONSTRAINT,
                  "a run beyond it ends in words");
    kt_hard_claim(h, 1, error.where[0] == 't', "and says when");
    for (int i = 0; i < kt_model_nq(h->model); i++)
        kt_hard_claim(h, 1, isfinite(kt_simulation_positions(h->simulation)[i]), "the state is of numbers");
}

/* energy + heat - supply, kept by the balance of a run. */
typedef struct balance {
    double start, kinetic, worst;
    int count;
} balance;

static int keep_balance(const kt_record *record, void *user) {
    balance *b = user;
    const double all = record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
    if (b->count++ == 0)
        b->start = all;
    b->kinetic = fmax(b->kinetic, record->kinetic);
    if (!(fabs(all - b->start) <= b->worst))
        b->worst = fabs(all - b->start);
    return 0;
}

/* The adaptive run reaches its end, and its balance is kept. The announcement of the limit follows. */
static void run_stiff(kt_hard *h, double step, double least, double most) {
    balance b = {0.0, 0.0, 0.0, 0};
    kt_error error;
    const kt_hard_motion *motion = h->c->motion;
    if (!kt_hard_open(h, motion) || !kt_hard_compile(h, motion))
        return;
    kt_run run = kt_hard_settings(h, motion);
    run.record = KT_RECORD_BALANCE;
    if (kt_hard_fine(h, kt_simulation_create(h->model, &run, NULL, &h->simulation, &error), &error) &&
        kt_hard_fine(h, kt_simulation_run(h->simulation, keep_balance, &b, &error), &error))
        h->observed[0] = b.worst / b.kinetic;
    kt_simulation_free(h->simulation);
    kt_model_free(h->model);
    h->simulation = NULL;
    h->model = NULL;
    announce(h, motion, step, least, most);
}

/* The governor's fastest decay is 8117 /s at the start. RK4 is stable to `2.785 / 8117` = 3.4e-4 s. */
static const kt_hard_motion governor = {.scene = "flyball-governor",
                                        .duration = 10.0,
                                        .shorter = 1.0,
                                        .integrator = "dopri5",
                                        .tolerance = 1e-9,
                                        .step = 1e-4,
                                        .interval = 0.01,
                                        .watch = watch_energy,
                                        .alone = true};
static void run_governor(kt_hard *h) { run_stiff(h, 1e-3, 3e-4, 4e-4); }

/* The spring's arms of 0.5 m at right angles pull with a lever of 0.35 m. Two bars of 1 m (and their neighbours) have
 * an inertia of some `0.05 kg m^2`. The frequency w is 4e4 to 1e5 rad/s. RK4 is stable to `2.83 / w`, which is 3e-5 to
 * 7e-5 s. */
static const kt_hard_motion spring = {.scene = "stiff-spring",
                                      .duration = 1.0,
                                      .shorter = 0.1,
                                      .integrator = "dop853",
                                      .tolerance = 1e-9,
                                      .step = 1e-5,
                                      .interval = 0.01,
                                      .watch = watch_energy};
static void run_spring(kt_hard *h) { run_stiff(h, 1e-3, 2e-5, 1e-4); }

/* ---- fast and slow ----------------------------------------------------------------------------------------------- */

/* Modes of the two blocks, see above. */
static void watch_blocks(kt_hard_watch *w, const kt_hard_view *view) {
    const double big = 1.0, small = 1e-3, soft = 1.0, hard = 1e5, u0 = 1.0, s0 = 1e-4;
    const double a = big * small, b = soft * small + hard * (big + small), c = soft * hard;
    const double fast = (b + sqrt(b * b - 4.0 * a * c)) / (2.0 * a), slow = c / (a * fast);
    const double w2[2] = {slow, fast};
    double rho[2], x = 0.0, s = 0.0;
    rho[0] = slow / (hard / small - slow);
    rho[1] = (soft - (big + small) * fast) / (small * fast); /* from the first equation, which does not cancel here */
    const double second = (s0 - rho[0] * u0) / (rho[1] - rho[0]), part[2] = {u0 - second, second};
    for (int i = 0; i < 2; i++) {
        x += part[i] * cos(sqrt(w2[i]) * view->t);
        s += rho[i] * part[i] * cos(sqrt(w2[i]) * view->t);
    }
    kt_hard_raise(w, 0, fabs(view->pose[0].position.x - x));
    kt_hard_raise(w, 1, fabs(view->pose[1].position.x - view->pose[0].position.x - s) / s0);
}

static const kt_hard_motion blocks = {.scene = "frequencies",
                                      .duration = 10.0,
                                      .shorter = 1.0,
                                      .integrator = "dop853",
                                      .tolerance = 1e-12,
                                      .step = 1e-5,
                                      .interval = 0.01,
                                      .watch = watch_blocks,
                                      .alone = true};

/* phi + pi is counted from upright: phi'' = -c sin(phi) with c = omega^2 R / l = 100. */
static void watch_flywheel(kt_hard_watch *w, const kt_hard_view *view) {
    const kt_vec3 out = view->pose[0].rotation.x, arm = view->pose[1].rotation.x;
    const double sine = kt_vec3_cross(out, arm).z, cosine = kt_vec3_dot(out, arm);
    if (w->count == 0)
        w->exact = (kt_upright){100.0L, 0.0L, (long double)atan2(sine, cosine) + acosl(-1.0L),
                                (long double)(view->twist[1].angular.z - view->twist[0].angular.z)};
    kt_upright_move(&w->exact, (long double)view->t);
    kt_hard_raise(w, 0, hypot(sine + (double)sinl(w->exact.theta), cosine + (double)cosl(w->exact.theta)));
    kt_hard_watch_energy(w, view, 1);
}

static const kt_hard_motion flywheel = {.scene = "flywheel",
                                        .duration = 10.0,
                                        .integrator = "rk4",
                                        .step = 1e-4,
                                        .interval = 0.01,
                                        .watch = watch_flywheel};

/* Three times the values measured over the full length. */
const kt_hard_case kt_hard_stiff[] = {
    {.number = 9,
     .name = "flyball governor",
     .motion = &governor,
     .run = run_governor,
     .why = "springs with dampers decay at 8117 /s next to a motion of seconds: stability, not accuracy, sets the step",
     .measures = {{"energy's balance, adaptive", "of the kinetic", 9e-12}, {"step beyond the limit: claims", "", 0.0}}},
    {.number = 9,
     .name = "spring of 1e9 N/m in a chain",
     .motion = &spring,
     .run = run_spring,
     .why = "1e5 rad/s next to 3 rad/s",
     .measures = {{"energy's balance, adaptive", "of the kinetic", 5e-12}, {"step beyond the limit: claims", "", 0.0}}},
    {.number = 10,
     .name = "frequencies 1e4 apart",
     .motion = &blocks,
     .why = "the fast one needs 16,000 oscillations while the slow one does two",
     .measures = {{"slow one off the exact motion", "m", 8e-14}, {"fast one", "of its amplitude", 1e-7}}},
    {.number = 10,
     .name = "milligram on a flywheel",
     .motion = &flywheel,
     .why = "twelve orders between two inertias: the pendulum's motion must not drown in rounding of the wheel's",
     .measures = {{"pendulum off the exact motion", "rad", 2e-10}, {"energy", "of the kinetic", 1.4e-13}}},
    {.name = NULL}};
