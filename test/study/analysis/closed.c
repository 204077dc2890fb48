/* Springs, tops, carts and four-bars against closed forms and one-coordinate models. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "small.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;
static const kt_vec3 none = {0.0, 0.0, 0.0};

/* ---- springs ----------------------------------------------------------------------------------------------------- */

/* n masses m on a line between two walls, with n + 1 springs k: `omega_j = 2 sqrt(k/m) sin(j pi / (2 (n + 1)))`. */
KT_TEST(masses_between_springs_have_the_eigenvalues_of_the_tridiagonal_matrix) {
    enum { N = 12 };
    const double k = 70.0, m = 0.4, distance = 0.3;
    linkage l;
    static kt_effect spring[N + 1];
    small s = {0};
    char name[16];
    linkage_begin(&l);
    for (int i = 0; i < N; i++) {
        snprintf(name, sizeof name, "m%d", i);
        kt_body *body = linkage_bar(&l, name, NULL, none, kt_vec3_make(m, 0.0, 0.0), (i + 1) * distance, 0.0);
        body->joint.type = KT_JOINT_PRISMATIC;
        body->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    }
    for (int i = 0; i <= N; i++) {
        spring[i] = kt_effect_of(KT_EFFECT_SPRING, NULL);
        spring[i].stiffness = k;
        spring[i].length = 0.8 * distance; /* under tension, which does not count along the line */
        spring[i].between[0].body = i ? l.body_name[i - 1] : NULL;
        spring[i].between[1].body = i < N ? l.body_name[i] : NULL;
        if (i == N)
            spring[i].between[1].at = kt_vec3_make((N + 1) * distance, 0.0, 0.0);
    }
    l.description.effects = spring;
    l.description.effect_count = N + 1;
    linkage_compile(&l);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    KT_WORST worst = kt_worst_make("omega");
    kt_check_equal_int("modes", kt_modes_count(s.modes), N);
    for (int j = 1; j <= N && j <= kt_modes_count(s.modes); j++) {
        const kt_mode mode = kt_modes_at(s.modes, j - 1);
        kt_worst_near(&worst, mode.imaginary, 2.0 * sqrt(k / m) * sin(j * pi / (2.0 * (N + 1))), 5e-13, "mode %d", j);
        kt_worst_near(&worst, mode.real, 0.0, 2e-12, "mode %d", j);
    }
    const double *shape = kt_modes_positions(s.modes, 2); /* `sin(3 pi i / (N + 1))`, largest made 1 */
    KT_WORST form = kt_worst_make("shape");
    double largest = 0.0;
    for (int i = 1; i <= N; i++)
        if (fabs(sin(3.0 * i * pi / (N + 1))) > fabs(largest) * (1.0 + 1e-6))
            largest = sin(3.0 * i * pi / (N + 1));
    for (int i = 1; i <= N; i++)
        kt_worst_near(&form, shape[2 * (i - 1)] / s.system->unit[i - 1], sin(3.0 * i * pi / (N + 1)) / largest, 5e-14,
                      "mass %d", i);
}

/* ---- stop -------------------------------------------------------------------------------------------------------- */

/* A door with a spring and a damper, `J q'' = -k q - c q'`. A hard stop is at q = -0.013 rad, and the door does not
 * touch it. `lambda^2 + c/J lambda + k/J = 0` holds as without the stop. If the door just touches the stop, there is no
 * derivative. The estimated error is then at least half the jump of the stiffness. */
KT_TEST(stop_that_is_near_does_not_enter_and_one_that_touches_shows) {
    const double inertia = 0.8, stiffness = 50.0, damping = 3.4, wall = 1e6, rest[] = {0.0, -0.013};
    linkage l;
    kt_effect effect[2] = {kt_effect_default(), kt_effect_default()};
    linkage_begin(&l);
    kt_body *door = linkage_bar(&l, "door", NULL, none, kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    door->mass = 0.0;
    door->com = none;
    door->inertia = kt_sym3_make(inertia, inertia, inertia, 0.0, 0.0, 0.0);
    for (int k = 0; k < 2; k++)
        effect[k].joint = "door";
    effect[0].type = KT_EFFECT_JOINT_SPRING;
    effect[0].stiffness = stiffness;
    effect[0].damping = damping;
    effect[1].type = KT_EFFECT_JOINT_LIMIT;
    effect[1].stiffness = wall;
    effect[1].lower = -0.013;
    effect[1].upper = 2.0;
    l.description.effects = effect;
    l.description.effect_count = 2;
    linkage_compile(&l);
    small s = {0};
    const double half = 0.5 * damping / inertia;
    small_open(&s, l.model, NULL, 0.0, &rest[0], l.v, NULL);
    const kt_mode mode = kt_modes_at(s.modes, 0);
    kt_check_near("decay", mode.real, -half, 1e-13);
    kt_check_near("frequency", mode.imaginary, sqrt(stiffness / inertia - half * half), 1e-13);
    kt_check_below("estimated error", mode.error, 1e-12);
    kt_check_true("exact", s.system->exact);
    small_open(&s, l.model, NULL, 0.0, &rest[1], l.v, NULL);
    kt_check_above("estimated error where it touches", small_at(s.system->state_error, 2, 1, 0), 0.5 * wall / inertia);
}

/* ---- top --------------------------------------------------------------------------------------------------------- */

/* Shapes belong to their eigenvalues: A x = lambda x with the states' numbers of dq and dv. */
static void expect_shapes(const small *s, kt_worst *worst) {
    const kt_linear_system *y = s->system;
    for (int k = 0; k < kt_modes_count(s->modes); k++) {
        const kt_mode mode = kt_modes_at(s->modes, k);
        const double *dq = kt_modes_positions(s->modes, k), *dv = kt_modes_velocities(s->modes, k);
        for (int i = 0; i < y->states; i++) {
            double re = 0.0, im = 0.0, own[2] = {0.0, 0.0};
            for (int j = 0; j < y->states; j++) {
                const double *x = j < y->positions ? dq + 2 * y->position_coordinate[j]
                                                   : dv + 2 * y->velocity_coordinate[j - y->positions];
                re += small_at(y->state, y->states, i, j) * x[0];
                im += small_at(y->state, y->states, i, j) * x[1];
                own[0] = i == j ? x[0] : own[0];
                own[1] = i == j ? x[1] : own[1];
            }
            const double size = 1.0 + hypot(mode.real, mode.imaginary);
            const double a = mode.real * own[0] - mode.imaginary * own[1];
            const double b = mode.real * own[1] + mode.imaginary * own[0];
            kt_worst_below(worst, hypot(re - a, im - b) / (size * size), 2e-14, "mode %d state %d", k, i);
        }
    }
}

/* A sleeping top: spin w about the upright axis, moment C about this axis, and A across at the fixed point. In an
 * inertial frame the axis moves as exp(i p t), `A p^2 - C w p + m g l = 0`. In the top's own axes the rate is p - w.
 * The top is stable from C w = 2 sqrt(A m g l) on. */
KT_TEST(sleeping_top_whirls_at_the_roots_of_its_quadratic) {
    const double m = 0.5, l = 0.12, c = 0.003, across = 0.002, a = across + m * l * l;
    const double least = 2.0 * sqrt(a * m * 9.81 * l) / c, spins[] = {1.6, 1.01, 0.7, 0.0};
    linkage top;
    linkage_begin(&top);
    top.description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    kt_body *body = linkage_bar(&top, "top", NULL, none, kt_vec3_make(0.0, 0.0, 1.0), 0.0, 0.0);
    body->joint.type = KT_JOINT_SPHERICAL;
    memset(body->joint.position, 0, sizeof body->joint.position);
    body->mass = m;
    body->com = kt_vec3_make(0.0, 0.0, l);
    body->inertia = kt_sym3_make(across, across, c, 0.0, 0.0, 0.0);
    linkage_compile(&top);
    KT_WORST worst = kt_worst_make("lambda / least spin"), shapes = kt_worst_make("A x - lambda x");
    for (size_t k = 0; k < sizeof spins / sizeof spins[0]; k++) {
        const double w = spins[k] * least, square = c * c * w * w / 4.0 - a * m * 9.81 * l;
        const double root = sqrt(fabs(square)) / a, middle = c * w / (2.0 * a) - w;
        small s = {0};
        top.v[2] = w;
        small_open(&s, top.model, NULL, 0.0, top.q, top.v, NULL);
        for (int sign = -1; sign <= 1; sign += 2) {
            const double re = square < 0.0 ? sign * root : 0.0, im = square < 0.0 ? middle : middle + sign * root;
            double distance;
            (void)small_nearest(&s, re, im, &distance);
            kt_worst_below(&worst, distance / least, 2e-14, "spin %g of the least", spins[k]);
        }
        expect_shapes(&s, &shapes);
    }
}

/* ---- cart and pole ----------------------------------------------------------------------------------------------- */

/* The textbook's model. The cart has mass M, friction b and force u along x. A point mass m is at l on an upright rod.
 * The angle q counts from upright about z, so that the tip is at x - l sin q. The equations are `M x'' = u - b x' + m g
 * q` and `M l q'' = (M + m) g q + u - b x'`. */
KT_TEST(cart_and_pole_have_the_matrices_of_the_textbook) {
    const double big = 2.0, m = 0.3, len = 0.6, b = 0.7, g = 9.81;
    linkage l;
    small s = {0};
    const kt_marker tip = {.name = "tip", .at = {0.0, len, 0.0}};
    linkage_begin(&l);
    kt_body *cart = linkage_bar(&l, "cart", NULL, none, kt_vec3_make(big, 0.0, 0.0), 0.5, 0.0);
    cart->joint.type = KT_JOINT_PRISMATIC;
    cart->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    kt_body *pole = linkage_bar(&l, "pole", "cart", none, kt_vec3_make(0.0, len, 0.0), 0.0, 0.0);
    pole->mass = m;
    pole->com = tip.at;
    pole->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    pole->markers = &tip;
    pole->marker_count = 1;
    kt_effect effect[2];
    effect[0] = kt_effect_of(KT_EFFECT_JOINT_DAMPER, "cart");
    effect[0].damping = b;
    effect[1] = kt_effect_of(KT_EFFECT_MOTOR, "cart");
    effect[1].torque = kt_function_constant(0.0);
    l.description.effects = effect;
    l.description.effect_count = 2;
    linkage_compile(&l);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    const kt_linear_system *y = s.system;
    const double state[4][4] = {{0, 0, 1, 0},
                                {0, 0, 0, 1},
                                {0, m * g / big, -b / big, 0},
                                {0, (big + m) * g / (big * len), -b / (big * len), 0}};
    const double input[4] = {0, 0, 1.0 / big, 1.0 / (big * len)};
    const double output[6][4] = {{1, -len, 0, 0}, {0}, {0}, {0, 0, 1, -len}, {0}, {0}};
    KT_WORST a = kt_worst_make("state"), honest = kt_worst_make("state against estimate"), c = kt_worst_make("output"),
             u = kt_worst_make("input");
    kt_check_equal_int("states", y->states, 4);
    kt_check_equal_int("inputs", y->inputs, 1);
    kt_check_equal_int("outputs", y->outputs, 6);
    for (int i = 0; i < 4 && y->states == 4; i++) {
        for (int j = 0; j < 4; j++) {
            const double error = small_at(y->state_error, 4, i, j);
            kt_worst_near(&a, small_at(y->state, 4, i, j), state[i][j], 2e-14, "%d, %d", i, j);
            kt_worst_near(&honest, small_at(y->state, 4, i, j), state[i][j], error, "%d, %d", i, j);
        }
        kt_worst_near(&u, y->input[i], input[i], 1e-15, "%d", i);
        for (int k = 0; k < 6; k++)
            kt_worst_near(&c, small_at(y->output, 6, k, i), output[k][i], 1e-13, "%d, %d", k, i);
    }
}

/* ---- four-bar ---------------------------------------------------------------------------------------------------- */

/* Ends of crank and coupler by the crank's angle, from two circles. */
static void four_bar_points(const four_bar *f, double angle, double p[4]) {
    const double x = f->crank * cos(angle), y = f->crank * sin(angle), dx = f->ground - x, dy = -y, d = hypot(dx, dy);
    const double along = (d * d + f->coupler * f->coupler - f->rocker * f->rocker) / (2.0 * d);
    const double aside = sqrt(f->coupler * f->coupler - along * along);
    p[0] = x;
    p[1] = y;
    p[2] = x + along * dx / d - aside * dy / d;
    p[3] = y + along * dy / d + aside * dx / d;
}

/* One coordinate: T = m(angle) rate^2 / 2, V(angle). A uniform bar from a to b of mass m has T = m (a'a' + a'b' + b'b')
 * / 6. Slopes of the points by differences of the eighth order. */
static void four_bar_energies(const four_bar *f, double angle, double *mass, double *potential) {
    static const double weight[4] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    double p[4], slope[4] = {0.0}, ahead[4], behind[4];
    const double h = 0.02;
    four_bar_points(f, angle, p);
    for (int k = 0; k < 4; k++) {
        four_bar_points(f, angle + (k + 1) * h, ahead);
        four_bar_points(f, angle - (k + 1) * h, behind);
        for (int i = 0; i < 4; i++)
            slope[i] += weight[k] * (ahead[i] - behind[i]) / h;
    }
    const double pp = slope[0] * slope[0] + slope[1] * slope[1], pq = slope[0] * slope[2] + slope[1] * slope[3];
    const double qq = slope[2] * slope[2] + slope[3] * slope[3];
    *mass = (f->crank * pp + f->coupler * (pp + pq + qq) + f->rocker * qq) / 3.0; /* masses are the lengths */
    *potential = 9.81 * 0.5 * (f->crank * p[1] + f->coupler * (p[1] + p[3]) + f->rocker * p[3]);
}

/* First and second derivatives of both energies, to the eighth order. */
typedef struct scalar_model {
    double m, m1, m2, v1, v2;
} scalar_model;

static scalar_model four_bar_scalar(const four_bar *f, double angle) {
    static const double first[4] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    static const double second[5] = {-205.0 / 72.0, 8.0 / 5.0, -1.0 / 5.0, 8.0 / 315.0, -1.0 / 560.0};
    const double h = 0.02;
    double m, v, ma, va, mb, vb;
    four_bar_energies(f, angle, &m, &v);
    scalar_model s = {.m = m, .m2 = second[0] * m / (h * h), .v2 = second[0] * v / (h * h)};
    for (int k = 1; k <= 4; k++) {
        four_bar_energies(f, angle + k * h, &ma, &va);
        four_bar_energies(f, angle - k * h, &mb, &vb);
        s.m1 += first[k - 1] * (ma - mb) / h;
        s.v1 += first[k - 1] * (va - vb) / h;
        s.m2 += second[k] * (ma + mb) / (h * h);
        s.v2 += second[k] * (va + vb) / (h * h);
    }
    return s;
}

/* m q'' + m' q'^2 / 2 + V' = 0 */
static void expect_four_bar(const four_bar *f, const linkage *l, kt_worst *worst) {
    small s = {0};
    small_open(&s, l->model, NULL, 0.0, l->q, l->v, NULL);
    const scalar_model x = four_bar_scalar(f, l->q[0]);
    const double rate = l->v[0], a = -(0.5 * x.m1 * rate * rate + x.v1) / x.m;
    const double by_angle = -(0.5 * x.m2 * rate * rate + x.v2) / x.m - x.m1 / x.m * a;
    const kt_linear_system *y = s.system;
    kt_check_equal_int("states", y->states, 2);
    kt_check_equal_int("the crank, which is held", y->position_coordinate[0], 0);
    kt_check_equal_int("and its rate", y->velocity_coordinate[0], 0);
    kt_worst_near(worst, y->rate[1], a, 1e-9, "acceleration");
    kt_worst_near(worst, small_at(y->state, 2, 0, 0), 0.0, 0.0, "0, 0");
    kt_worst_near(worst, small_at(y->state, 2, 0, 1), 1.0, 0.0, "0, 1");
    kt_worst_near(worst, small_at(y->state, 2, 1, 0), by_angle, 1e-9, "1, 0");
    kt_worst_near(worst, small_at(y->state, 2, 1, 1), -x.m1 / x.m * rate, 1e-9, "1, 1");
}

KT_TEST(four_bar_has_the_matrix_of_its_one_coordinate_model_at_rest_and_in_motion) {
    const four_bar f = four_bar_default();
    static const char *const hold[] = {"crank"};
    linkage l;
    linkage_four_bar(&l, &f);
    l.description.hold = hold;
    l.description.hold_count = 1;
    linkage_build(&l, 0.0);
    kt_error error = {0};
    KT_WORST moving = kt_worst_make("in motion"), resting = kt_worst_make("at rest");
    expect_four_bar(&f, &l, &moving);
    kt_linearization *search = kt_test_linearization(l.model, NULL);
    kt_need_fine("rests", kt_equilibrium_find(search, NULL, 0.0, l.q, NULL, NULL, &error), &error);
    memset(l.v, 0, sizeof l.v);
    expect_four_bar(&f, &l, &resting);
}

/* ---- far away ---------------------------------------------------------------------------------------------------- */

/* A cart far from the world's origin is no worse than one at it. */
KT_TEST(place_in_the_world_does_not_matter) {
    KT_WORST worst = kt_worst_make("lambda"), honest = kt_worst_make("state against estimate");
    for (int far = 0; far < 2; far++) {
        linkage l;
        small s = {0};
        linkage_begin(&l);
        kt_body *cart = linkage_bar(&l, "cart", NULL, none, kt_vec3_make(1.0, 0.0, 0.0), far ? 1e6 : 0.0, 0.0);
        cart->joint.type = KT_JOINT_PRISMATIC;
        cart->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        kt_body *pole = linkage_bar(&l, "pole", "cart", none, kt_vec3_make(0.0, -1.0, 0.0), 0.0, 0.0);
        pole->com = kt_vec3_make(0.0, -1.0, 0.0);
        pole->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        linkage_compile(&l);
        small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
        small_expect(&s, 0.0, sqrt(9.81 * 2.0), 2e-14, &worst);
        kt_worst_near(&honest, small_at(s.system->state, 4, 3, 1), -2.0 * 9.81,
                      small_at(s.system->state_error, 4, 3, 1), "far: %d", far);
    }
}

/* ---- a loop of rounding alone ------------------------------------------------------------------------------------ */

/* Two bars geared to each other. One has a rope to its axis, which is an equation of 1e-16. The rope begins to pull
 * later. The result must be that without the rope. */
KT_TEST(equation_of_rounding_alone_leaves_the_linearisation) {
    static const kt_term term[] = {{.joint = "other", .coefficient = -2.0}, {.joint = "arm", .coefficient = 1.0}};
    const kt_vec3 far = {2.1, 0.7, 0.0}, down = {0.0, -1.0, 0.0}, end = {0.0, 0.0, 0.0};
    double rate[2] = {0.0, 0.0};
    for (int k = 0; k < 2; k++) {
        linkage l;
        small s = {0};
        linkage_begin(&l);
        linkage_bar(&l, "arm", NULL, none, down, 0.0, 0.0);
        linkage_bar(&l, "other", NULL, far, down, 0.0, 0.0);
        if (k)
            linkage_close(&l, "rope", KT_LOOP_DISTANCE, "arm", end, NULL, far)->function =
                kt_function_ramp(kt_vec3_norm(far), 3.0, 1.0, 2.0);
        kt_loop *gears = linkage_close(&l, "gears", KT_LOOP_COUPLING, NULL, none, NULL, none);
        gears->terms = term;
        gears->term_count = 2;
        linkage_build(&l, 0.0);
        small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
        kt_check_equal_int("modes", kt_modes_count(s.modes), 1);
        rate[k] = kt_modes_at(s.modes, 0).imaginary;
        const double *shape = kt_modes_positions(s.modes, 0);
        kt_check_near("the arm's part over the other's", hypot(shape[0], shape[1]) / hypot(shape[2], shape[3]), 2.0,
                      1e-14);
    }
    /* `I = 1/3`, stiffness g/2, and a quarter of both: `sqrt(3 g / 2)` */
    kt_check_near("without the rope, rad/s", rate[0], sqrt(1.5 * 9.81), 1e-13);
    kt_check_near("with it", rate[1], rate[0], 1e-12);
}
