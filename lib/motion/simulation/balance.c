/* The work done in an energy balance, for steps that are too long for the powers.
 *
 * The work W = (W_d, W_s) is a quadrature of powers, W' = P(t, q, v). A step integrates the powers with its own rule,
 * together with the motion. The step is chosen for the motion alone. An example is a crank with a constant driven
 * speed. In a step of a whole turn, the motion is exact, but the power of the weight is not.
 *
 * Therefore, if the method's error estimate of the work is large, the powers are integrated once more along the dense
 * output, panel by panel. With P at the nodes x_j of a panel of length L (s in [-1, 1]),
 *
 *     b_m          = L / 4 sum_j w_j Q_m(x_j) P_j                     Kronrod's rule of 15 nodes
 *     W(s) - W(-1) = sum_m b_m (Q_{m+1} - Q_{m-1})(s)                 P in Legendre's polynomials Q_m, Q_{-1} = -1
 *     W(1) - W(-1) = 2 b_0
 *     errors       = L / 2 |sum_j (w_j - g_j) P_j|                    of the whole: Gauss' rule of 7 of the nodes
 *                    2 (|b_11| + |b_12|)                              within it, for sums up to m = 12
 *
 * A panel whose errors exceed the tolerances is halved. If halving does not help, the work that the method has
 * integrated remains. Next to a singular position of loops, more panels do not improve the powers. The whole step is
 * then one panel. The motion itself does not change in any bit.
 *
 * Source: R. Piessens, E. de Doncker-Kapenga, C. W. Ueberhuber, D. K. Kahaner, QUADPACK, 1983.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "simulation/simulation.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A part of the last step, along which powers were integrated. */
enum { KT_PANEL_TERMS = 13 };
typedef struct kt_work_panel {
    bool known;                /* the panel belongs to the last step */
    int tried;                 /* panels of this step, tried or taken */
    double from, to, next;     /* s; `next`: the proposed length of the next panel */
    kt_work start;             /* at `from`, since the start of the run */
    kt_work b[KT_PANEL_TERMS]; /* the work done from `from` on, as coefficients of Legendre's polynomials */
} kt_work_panel;

/* Before a dead point of a drive, its power grows without bound and finally consists of rounding errors. A step
 * therefore gets at most PANELS_MOST panels, tried or taken. */
enum { NODES = 15, HALVINGS = 20, PANELS_MOST = 128 };

/* The number of tolerances from which on the powers are integrated again. Estimates come from the embedded formula,
 * which has the lower order, so that true errors are far below the estimates. On the bundled scenes, a repetition is
 * rare. A limit of 1 improves no balance by more than a factor of four, for up to twice the evaluations.
 *
 * For driven loops, the power v . (M a + h - tau) contains accelerations. Stages violate the loops by their errors c,
 * which change an acceleration by some c v^2 / s^3. s is the size of the smallest direction
 * (evaluate/singular_crossing.c). Next to a singular position, one stage then dominates, and the estimate may be as
 * large as the error or smaller. In a step before a change point of a driven four-bar, the estimate was 26 tolerances
 * and the error 160. */
static double doubt_of(const kt_model *model) { return model->driven ? 10.0 : 100.0; }

static const double node[8] = {
    0.991455371120812639206855, 0.949107912342758524526190, 0.864864423359769072789713, 0.741531185599394439863865,
    0.586087235467691130294145, 0.405845151377397166906606, 0.207784955007898467600689, 0.0};
static const double kronrod[8] = {0.022935322010529224963732, 0.063092092629978553290701, 0.104790010322250183839876,
                                  0.140653259715525918745190, 0.169004726639267902826583, 0.190350578064785409913256,
                                  0.204432940075298892414162, 0.209482141084727828012999};
static const double gauss[8] = {0.0, 0.129484966168869693270611, 0.0, 0.279705391489276667901468,
                                0.0, 0.381830050505118944950370, 0.0, 0.417959183673469387755102};

/* The rule has 15 nodes in [-1, 1], symmetric to 0. The tables have those from 1 down to 0. The functions return the
 * index of node j in the tables, and node j itself; j counts from -1 to 1. */
static int node_index(int j) { return j < 8 ? j : 14 - j; }
static double node_at(int j) { return j < 8 ? -node[j] : node[14 - j]; }

static kt_work work_add(kt_work work, double factor, kt_power power) {
    return (kt_work){work.dissipated + factor * power.dissipated, work.supplied + factor * power.supplied};
}

/* Computes the powers at a time within the last step. */
static bool find_power(kt_simulation *simulation, double t, kt_power *power) {
    kt_error error;
    simulation->memory.balance_evaluations++;
    return kt_simulation_between(simulation, t, &error) == KT_OK &&
           kt_simulation_power(simulation, t, simulation->y, power, &error) == KT_OK;
}

/* Computes the powers at all nodes of a panel. Returns false if one of them cannot be computed. */
static bool find_powers(kt_simulation *simulation, const kt_work_panel *panel, kt_power power[NODES]) {
    const double middle = 0.5 * (panel->from + panel->to), half = 0.5 * (panel->to - panel->from);
    for (int j = 0; j < NODES; j++)
        if (!find_power(simulation, middle + half * node_at(j), &power[j]))
            return false;
    return true;
}

/* Computes the coefficients b_m with the recurrence of Legendre's polynomials:
 *
 *     (m + 1) Q_{m+1} = (2 m + 1) x Q_m - m Q_{m-1} */
static void expand_panel(kt_work_panel *panel, const kt_power power[NODES]) {
    const double quarter = 0.25 * (panel->to - panel->from);
    memset(panel->b, 0, sizeof panel->b);
    for (int j = 0; j < NODES; j++) {
        double before = 0.0, now = 1.0;
        for (int m = 0; m < KT_PANEL_TERMS; m++) {
            const double k = (double)m, next = ((2.0 * k + 1.0) * node_at(j) * now - k * before) / (k + 1.0);
            panel->b[m] = work_add(panel->b[m], quarter * kronrod[node_index(j)] * now, power[j]);
            before = now;
            now = next;
        }
    }
}

/* The larger of the two errors over the tolerances, for one component of W. Errors: `difference` of the two rules;
 * `turned`: the integral of the power's magnitude; `tail`: |b_11| + |b_12|. */
static double error_over_tolerance(const kt_simulation *simulation, double start, double turned, double difference,
                                   double tail) {
    const kt_integrator_options *o = &simulation->integrator->options;
    const double relative = fmax(o->relative_tolerance, 64.0 * DBL_EPSILON);
    return fmax(fabs(difference), 2.0 * tail) / kt_scale_of(o->absolute_tolerance, relative, start, turned);
}

/* The error of the work over a panel, relative to the tolerance: from the difference of the Kronrod and the Gauss
 * sum, and from the last two terms of the expansion. */
static double panel_error_of(const kt_simulation *simulation, const kt_work_panel *panel, const kt_power power[NODES]) {
    const double half = 0.5 * (panel->to - panel->from);
    const kt_work *b = panel->b + KT_PANEL_TERMS - 2;
    kt_work difference = {0.0, 0.0}, turned = {0.0, 0.0};
    for (int j = 0; j < NODES; j++) {
        const int at = node_index(j);
        const kt_power p = power[j], size = {fabs(p.dissipated), fabs(p.supplied)};
        difference = work_add(difference, half * (kronrod[at] - gauss[at]), p);
        turned = work_add(turned, half * kronrod[at], size);
    }
    return fmax(error_over_tolerance(simulation, panel->start.dissipated, turned.dissipated, difference.dissipated,
                                     fabs(b[0].dissipated) + fabs(b[1].dissipated)),
                error_over_tolerance(simulation, panel->start.supplied, turned.supplied, difference.supplied,
                                     fabs(b[0].supplied) + fabs(b[1].supplied)));
}

/* The work at the end of the panel. b[0] is half of the integral of the powers over the panel. */
static kt_work panel_end_of(const kt_work_panel *panel) {
    return (kt_work){panel->start.dissipated + 2.0 * panel->b[0].dissipated,
                     panel->start.supplied + 2.0 * panel->b[0].supplied};
}

/* Whether the last step was accepted although its error estimate was too large, because errors of accelerations caused
 * it (kt_noise). Powers have these errors too, and shorter panels do not reduce them. */
static bool step_is_noise(const kt_simulation *simulation) { return simulation->integrator->memory.last_error > 1.0; }

/* Moves to the next panel, from the end of the previous panel. Returns false if no panel is short enough. */
static bool advance_panel(kt_simulation *simulation, kt_work_panel *panel) {
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    const double t1 = kt_integrator_time(simulation->integrator), least = ldexp(t1 - t0, -HALVINGS);
    panel->start = panel_end_of(panel);
    panel->from = panel->to;
    double length = 2.0 * panel->next;
    for (;;) {
        length *= 0.5;
        kt_power power[NODES];
        panel->to = panel->from + 1.5 * length < t1 ? panel->from + length : t1;
        if (panel->tried++ == PANELS_MOST || !find_powers(simulation, panel, power))
            return false;
        expand_panel(panel, power);
        const double error = panel_error_of(simulation, panel, power);
        if (error <= 1.0 || step_is_noise(simulation)) { /* ~ L^12 */
            panel->next = (panel->to - panel->from) * (error < 1e-4 ? 2.0 : 1.0);
            return true;
        }
        if (!(length > least))
            return false;
    }
}

/* The work done at s in a panel. */
static kt_work within(const kt_work_panel *panel, double s) {
    double before = -1.0, now = 1.0; /* Q_{m-1} and Q_m */
    kt_work work = panel->start;
    for (int m = 0; m < KT_PANEL_TERMS; m++) {
        const double k = (double)m, next = m == 0 ? s : ((2.0 * k + 1.0) * s * now - k * before) / (k + 1.0);
        work.dissipated += panel->b[m].dissipated * (next - before);
        work.supplied += panel->b[m].supplied * (next - before);
        before = now;
        now = next;
    }
    return work;
}

/* Puts an empty panel at the start of the last step. */
static bool begin_panel(kt_simulation *simulation, kt_work_panel *panel) {
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    kt_error error;
    if (kt_integrator_interpolate(simulation->integrator, t0, simulation->y, &error) != KT_OK)
        return false;
    *panel = (kt_work_panel){.from = t0, .to = t0, .next = kt_integrator_time(simulation->integrator) - t0};
    panel->start = kt_simulation_work_of(simulation, simulation->y);
    panel->known = true;
    return true;
}

bool kt_simulation_works_at(kt_simulation *simulation, double t, kt_work *work) {
    kt_work_panel *panel = simulation->works.panel;
    const kt_crossings crossings = simulation->data->crossings; /* only crossings of the motion are reported */
    bool fine = (panel->known && panel->from <= t) || begin_panel(simulation, panel);
    while (fine && panel->to < t)
        fine = advance_panel(simulation, panel);
    simulation->data->crossings = crossings;
    panel->known = fine;
    if (fine)
        *work = t == panel->to ? panel_end_of(panel)
                               : within(panel, (2.0 * t - panel->from - panel->to) / (panel->to - panel->from));
    return fine;
}

/* After a step: integrates the powers along the step, if the work done is less accurate than the tolerances require. */
static void refine_works(kt_simulation *simulation) {
    const double t = kt_integrator_time(simulation->integrator);
    kt_work work;
    simulation->works.panel->known = simulation->memory.refined = false;
    if (!(kt_integrator_quadrature_error(simulation->integrator) > doubt_of(simulation->model)))
        return;
    const uint64_t factorizations = simulation->memory.factorizations; /* only those of the motion count */
    if (kt_simulation_works_at(simulation, t, &work)) {
        kt_integrator_put_quadratures(simulation->integrator, (double[]){work.dissipated, work.supplied});
        simulation->memory.refined = true;
    }
    simulation->memory.factorizations = factorizations;
    simulation->cached = KT_CACHED_NOTHING;
}

static size_t measure_panel(const kt_simulation_sizes *size) { return size->panel * sizeof(kt_work_panel); }

static void init_panel(kt_simulation *simulation, void *memory) { simulation->works.panel = memory; }

static bool has_panel(const kt_simulation *simulation) { return simulation->size.panel > 0; }

static void resume_panel(kt_simulation *simulation) { simulation->works.panel->known = false; }

static void forget_panel(kt_simulation *simulation) {
    simulation->works.panel->known = simulation->memory.refined = false;
}

const kt_part kt_balance_part = {.measure = measure_panel,
                                 .init = init_panel,
                                 .is_active = has_panel,
                                 .forget = forget_panel,
                                 .resume = resume_panel,
                                 .finish = refine_works};
