/* A whip of 100 links that falls until its end is caught by a rope.
 *
 * The reference is an integration of its own equations, in angles against the ground and accelerations of the links'
 * ends. A link has length l, mass m and moment of inertia J about its centre, with e along it and n across. It turns at
 * w. The acceleration of its first end is a, and the force there is F. The next link has a+ and F+:
 *     a+ = a + l (w' n - w^2 e),  F = F+ + m (a + l/2 (w' n - w^2 e) - g),  J w' = -l/2 n.(F + F+)
 * With F+ = A+ a+ + b+ for the next one, w' = -(h.a + k) / D, with
 *     h = l A+ n + m l/2 n,  c = b+ - l w^2 A+ e,  k = l n.c - m l/2 n.g,  D = J + m l^2/4 + l^2 n.A+ n,
 * and F = A a + b, with
 *     A = A+ + m 1 - h h'/D,  b = c - m l/2 w^2 e - m g - h k/D
 *
 * A pull f of the rope along u on the tip is b+ = -f u behind the last link. Accelerations are linear in f, and f keeps
 * the tip on its circle. When the rope becomes taut, an impulse removes the tip's speed along the rope. The impulse
 * determines the changes of the rates in the same way as forces determine w'.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../../test/motion/contact/whip.h"

#include "events.h"
#include "kinetree/scene.h"

#include <math.h>
#include <string.h>

enum { N = KT_WHIP_LINKS };
static const double l = KT_WHIP_LINK, m = KT_WHIP_MASS, g = KT_WHIP_GRAVITY;

/* ---- its own equations ------------------------------------------------------------------------------------------- */

typedef struct motion {
    double t, angle[N], rate[N], pull;
    bool is_taut;
} motion;

typedef struct tip {
    double x, y, vx, vy, stretch, ux, uy; /* u: from the tip along the rope */
} tip;

static tip tip_of(const motion *s) {
    tip p = {.x = 0.0};
    for (int i = 0; i < N; i++) {
        const double x = l * cos(s->angle[i]), y = l * sin(s->angle[i]);
        p.x += x;
        p.y += y;
        p.vx -= s->rate[i] * y;
        p.vy += s->rate[i] * x;
    }
    const double distance = hypot(KT_WHIP_X - p.x, KT_WHIP_Y - p.y);
    p.ux = (KT_WHIP_X - p.x) / distance;
    p.uy = (KT_WHIP_Y - p.y) / distance;
    p.stretch = distance - KT_WHIP_ROPE;
    return p;
}

/* Angular accelerations under a pull along u, and the tip's acceleration along it; `rate` of NULL: those that belong to
 * the pull alone. */
static double accelerate(const double *angle, const double *rate, double pull, const tip *p, double *turn) {
    double hx[N], hy[N], k[N], D[N], Axx = 0.0, Axy = 0.0, Ayy = 0.0, bx = -pull * p->ux, by = -pull * p->uy;
    double ex[N], ey[N], ax = 0.0, ay = 0.0;
    const double gy = rate ? -g : 0.0;
    for (int i = N - 1; i >= 0; i--) {
        const double x = ex[i] = cos(angle[i]), y = ey[i] = sin(angle[i]), ww = rate ? rate[i] * rate[i] : 0.0;
        const double nx = -y, ny = x, Anx = Axx * nx + Axy * ny, Any = Axy * nx + Ayy * ny;
        const double cx = bx - l * ww * (Axx * x + Axy * y), cy = by - l * ww * (Axy * x + Ayy * y);
        hx[i] = l * Anx + 0.5 * m * l * nx;
        hy[i] = l * Any + 0.5 * m * l * ny;
        k[i] = l * (nx * cx + ny * cy) - 0.5 * m * l * ny * gy;
        D[i] = m * l * l / 3.0 + l * l * (nx * Anx + ny * Any);
        Axx += m - hx[i] * hx[i] / D[i];
        Axy -= hx[i] * hy[i] / D[i];
        Ayy += m - hy[i] * hy[i] / D[i];
        bx = cx - 0.5 * m * l * ww * x - hx[i] * k[i] / D[i];
        by = cy - 0.5 * m * l * ww * y - m * gy - hy[i] * k[i] / D[i];
    }
    for (int i = 0; i < N; i++) {
        const double ww = rate ? rate[i] * rate[i] : 0.0;
        turn[i] = -(hx[i] * ax + hy[i] * ay + k[i]) / D[i];
        ax += l * (-turn[i] * ey[i] - ww * ex[i]);
        ay += l * (turn[i] * ex[i] - ww * ey[i]);
    }
    return ax * p->ux + ay * p->uy;
}

/* With the pull that keeps the tip on its circle, where the rope is taut. */
static void rates_of(motion *s, double *turn) {
    const tip p = tip_of(s);
    const double along = accelerate(s->angle, s->rate, 0.0, &p, turn);
    s->pull = 0.0;
    if (!s->is_taut)
        return;
    double unit[N];
    const double across = p.vx * p.uy - p.vy * p.ux, more = accelerate(s->angle, NULL, 1.0, &p, unit);
    s->pull = (across * across / (KT_WHIP_ROPE + p.stretch) - along) / more;
    for (int i = 0; i < N; i++)
        turn[i] += s->pull * unit[i];
}

/* RK4; the pull becomes that at the end. */
static void step(motion *s, double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    const motion old = *s;
    motion here = old;
    double turn[N] = {0.0}, rate[N] = {0.0};
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < N && stage > 0; i++) {
            here.angle[i] = old.angle[i] + at[stage] * h * rate[i];
            here.rate[i] = old.rate[i] + at[stage] * h * turn[i];
        }
        memcpy(rate, here.rate, sizeof rate);
        rates_of(&here, turn);
        for (int i = 0; i < N; i++) {
            s->angle[i] += h / 6.0 * weight[stage] * rate[i];
            s->rate[i] += h / 6.0 * weight[stage] * turn[i];
        }
    }
    s->t = old.t + h;
    rates_of(s, turn);
}

/* Above zero once something is to happen: the rope becomes taut, or slack. */
static double excess(const motion *s) { return s->is_taut ? -s->pull : tip_of(s).stretch; }

static void catch_tip(motion *s) {
    const tip p = tip_of(s);
    double unit[N];
    const double gain = accelerate(s->angle, NULL, 1.0, &p, unit), impulse = -(p.vx * p.ux + p.vy * p.uy) / gain;
    for (int i = 0; i < N; i++)
        s->rate[i] += impulse * unit[i];
    s->is_taut = true;
    rates_of(s, unit);
    s->is_taut = s->pull > 0.0;
}

static void change(motion *s) {
    if (s->is_taut)
        s->is_taut = false;
    else
        catch_tip(s);
}

/* To `end` in one step, or in parts that end where something happens, found by bisection. */
static void advance(motion *s, double end) {
    enum { HALVINGS = 50 };
    while (end - s->t > 1e-14) {
        motion next = *s;
        double low = 0.0, high = end - s->t;
        step(&next, high);
        for (int i = 0; excess(&next) > 0.0 && i < HALVINGS; i++) {
            motion part = *s;
            const double middle = 0.5 * (low + high);
            step(&part, middle);
            if (excess(&part) > 0.0) {
                high = middle;
                next = part;
            } else {
                low = middle;
            }
        }
        *s = next;
        if (excess(s) > 0.0)
            change(s);
    }
}

/* The coordinate x (`which` 0) or y (`which` 1) of the tip after t, a multiple of 1 ms. The steps have 1/40 ms. Each
 * value is computed once. */
static double caught(const kt_events_problem *p, int which, double t) {
    enum { MOST = 140, PARTS = 40 };
    static double at[MOST + 1][2];
    static motion s;
    static int found = 0;
    const int asked = (int)lround(1e3 * t);
    (void)p;
    for (; found <= asked; found++) {
        for (int i = 1; found > 0 && i <= PARTS; i++)
            advance(&s, 1e-3 * ((found - 1) + (double)i / PARTS));
        const tip end = tip_of(&s);
        at[found][0] = end.x;
        at[found][1] = end.y;
    }
    return at[asked][which];
}

/* ---- this engine ------------------------------------------------------------------------------------------------- */

static int see(const kt_record *record, void *user) {
    double x, y;
    kt_whip_tip(record->q, &x, &y);
    kt_events_see(user, 0, record->t, x);
    kt_events_see(user, 1, record->t, y);
    return 0;
}

static bool run(kt_events_watch *watch) {
    kt_whip whip;
    kt_whip_make(&whip, 0.0, true);
    const kt_scene scene = {.description = whip.description};
    return kt_events_run(watch, &scene, see, watch);
}

const kt_events_problem kt_events_whip = {
    .name = "whip of 100 links and a slack rope",
    .measured = "place of its tip, m",
    .bound = 2e-11,
    .duration = 0.14, /* caught at 0.0872 s, slack until 0.0905 s */
    .step = 1e-3,
    .engine = {run, kt_events_whip_mujoco, kt_events_whip_ode},
    .exact = caught,
};
