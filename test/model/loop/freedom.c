/* The freedoms that each type leaves, and the number that it takes away. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include <float.h>

#define EPS DBL_EPSILON

/* The axes x, y, z that may slide. The letter gives the orientation: any, none, or about z (Z). N is any that keeps the
 * second z normal to the first, and H is any without a turn about z. */
typedef struct dof {
    int equations; /* SCENE, "Loops" */
    bool slides[3];
    char turns;
} dof;

static const dof dofs[KT_LOOP_TYPE_COUNT] = {
    [KT_LOOP_SPHERICAL] = {3, {false, false, false}, '*'},  [KT_LOOP_INLINE] = {2, {false, false, true}, '*'},
    [KT_LOOP_INPLANE] = {1, {true, true, false}, '*'},      [KT_LOOP_DISTANCE] = {1, {true, true, true}, '*'},
    [KT_LOOP_PARALLEL] = {3, {true, true, true}, '0'},      [KT_LOOP_COAXIAL] = {2, {true, true, true}, 'Z'},
    [KT_LOOP_ORTHOGONAL] = {1, {true, true, true}, 'N'},    [KT_LOOP_REVOLUTE] = {5, {false, false, false}, 'Z'},
    [KT_LOOP_PRISMATIC] = {5, {false, false, true}, '0'},   [KT_LOOP_SCREW] = {5, {false, false, true}, 'Z'},
    [KT_LOOP_CYLINDRICAL] = {4, {false, false, true}, 'Z'}, [KT_LOOP_PLANAR] = {3, {true, true, false}, 'Z'},
    [KT_LOOP_WELD] = {6, {false, false, false}, '0'},       [KT_LOOP_UNIVERSAL] = {4, {false, false, false}, 'N'},
    [KT_LOOP_COUPLING] = {1, {false, false, false}, '0'},   [KT_LOOP_MOTION] = {1, {false, false, false}, '0'},
    [KT_LOOP_ROLLING] = {2, {true, true, true}, '*'},       [KT_LOOP_KNIFE_EDGE] = {1, {true, true, true}, '*'},
    [KT_LOOP_RATES] = {1, {false, false, false}, '0'},      [KT_LOOP_HOMOKINETIC] = {4, {false, false, false}, 'H'},
    [KT_LOOP_SURFACE] = {1, {false, false, false}, '*'},    [KT_LOOP_CURVE] = {2, {false, false, false}, '*'},
    [KT_LOOP_GEAR] = {1, {false, false, false}, '0'},       [KT_LOOP_RACK] = {1, {false, false, false}, '0'},
    [KT_LOOP_WORM] = {1, {false, false, false}, '0'},       [KT_LOOP_SPAN] = {1, {false, false, false}, '0'},
    [KT_LOOP_BELT] = {2, {false, false, false}, '0'},
};

static void turn_by(moving *m, int k, jet angle) {
    jet q[4];
    moving_turn(k, angle, q);
    moving_multiply(m->q, q, m->q);
}

static jet plus(jet a, double b) { return jet_add(a, jet_constant((long double)b)); }

/* A point of a surface, from two free numbers. */
static void slide_on_surface(const kt_loop_record *loop, const jet free[2], jet p[3]) {
    const jet c = jet_cos(free[0]), s = jet_sin(free[0]), up = jet_sin(free[1]), out = jet_cos(free[1]);
    const bool torus = loop->form == KT_SURFACE_TORUS, cylinder = loop->form == KT_SURFACE_CYLINDER;
    const long double r = (long double)(torus ? loop->tube : loop->radius);
    const jet rho = torus ? plus(jet_scale(r, out), loop->radius) : cylinder ? jet_constant(r) : jet_scale(r, out);
    p[0] = loop->form == KT_SURFACE_PLANE ? free[0] : jet_mul(rho, c);
    p[1] = loop->form == KT_SURFACE_PLANE ? free[1] : jet_mul(rho, s);
    p[2] = loop->form == KT_SURFACE_PLANE ? jet_constant(0.0L) : cylinder ? free[1] : jet_scale(r, up);
}

/* A point of a line, a circle or a helix, from its arc length. */
static void slide_on_curve(const kt_loop_record *loop, jet length, jet p[3]) {
    const long double R = (long double)loop->radius, h = (long double)loop->pitch;
    const jet angle = jet_scale(1.0L / sqrtl(R * R + h * h), length);
    p[0] = loop->form == KT_TRACK_LINE ? jet_constant(0.0L) : jet_scale(R, jet_cos(angle));
    p[1] = loop->form == KT_TRACK_LINE ? jet_constant(0.0L) : jet_scale(R, jet_sin(angle));
    p[2] = loop->form == KT_TRACK_LINE ? length : jet_scale(h, angle);
}

/* A relative pose that the type allows, from six free numbers: three to slide, three to turn. */
static moving allowed(const kt_loop_record *loop, double t, const jet free[6]) {
    const dof *f = &dofs[loop->type];
    const jet zero = jet_constant(0.0L);
    moving m = {{zero, zero, zero}, {jet_constant(1.0L), zero, zero, zero}};
    for (int k = 0; k < 3; k++)
        if (f->slides[k])
            m.p[k] = free[k];
    if (loop->type == KT_LOOP_DISTANCE) {
        m.p[2].x += 3.0L; /* a direction, then, that turns no faster than the points move */
        const jet scale = jet_div(moving_length(t), jet_sqrt(jet_dot(m.p, m.p)));
        for (int k = 0; k < 3; k++)
            m.p[k] = jet_mul(scale, m.p[k]);
    }
    if (loop->type == KT_LOOP_SURFACE)
        slide_on_surface(loop, free, m.p);
    if (loop->type == KT_LOOP_CURVE)
        slide_on_curve(loop, loop->row_count > 2 ? moving_length(t) : free[0], m.p);
    if (loop->type == KT_LOOP_SCREW) /* many turns */
        m.p[2] = jet_scale((long double)loop->pitch, jet_sub(free[3], jet_constant((long double)loop->angle)));
    if (f->turns != '0')
        turn_by(&m, 2, free[3]);
    if (f->turns == 'N')
        turn_by(&m, 1, jet_constant(2.0L * atanl(1.0L)));
    if (f->turns == '*')
        turn_by(&m, 0, free[4]);
    if (f->turns == 'H')
        turn_by(&m, 0, jet_scale(0.1L, free[4]));
    if (f->turns == 'N' || f->turns == '*')
        turn_by(&m, 2, free[5]);
    if (f->turns == 'H')
        turn_by(&m, 2, jet_sub(jet_constant((long double)loop->angle), free[3]));
    return m;
}

/* Types whose equations are all about the relative pose. Wheels are about axes that keep their distance
 * (test/command/wheels.py). */
static bool is_about_poses(int type) {
    return kt_loop_kinds_baseline[type]->rows > 0 && type < KT_LOOP_GEAR && type != KT_LOOP_ROLLING &&
           type != KT_LOOP_KNIFE_EDGE;
}

/* Rounding of numbers up to 20 (the turns of the screw); measured over forty seeds: at most 0.8 of the bounds. */
KT_TEST(allowed_motions_keep_every_equation_closed) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
        if (!is_about_poses(type))
            continue;
        KT_WORST residual = kt_worst_make(kt_loop_type_name((kt_loop_type)type));
        KT_WORST first = kt_worst_make("  phi'"), second = kt_worst_make("  phi''");
        for (int n = 0; n < 500; n++) {
            double numbers[MOVING_NUMBERS];
            jet free[6];
            const double t = kt_random_uniform(&random, 0.0, 5.0);
            kt_loop_record loop = moving_loop(&random, type, numbers);
            loop.row_count += kt_random_int(&random, 0, 1);
            for (int i = 0; i < 6; i++)
                free[i] = moving_random_jet(&random, i < 3 ? 2.0 : 20.0);
            const moving relative = allowed(&loop, t, free), a = moving_random(&random, 2.0);
            const moving b = moving_compose(&a, &relative);
            kt_v4 acceleration[2][2];
            const kt_loop_end end[2] = {moving_end(&a, acceleration[0]), moving_end(&b, acceleration[1])};
            kt_loop_row rows[KT_LOOP_ROW_MAX];
            const int count = kt_loop_kinds_baseline[type]->evaluate(&loop, numbers, end, t, rows);
            for (int k = 0; k < count; k++) {
                const moving_rates rates = moving_rates_of(&rows[k], end, acceleration);
                const moving_rates scale = moving_scales(end, acceleration);
                kt_worst_near(&residual, rows[k].residual, 0.0, 20.0 * EPS, "%d, row %d", n, k);
                kt_worst_near(&first, rates.first, 0.0, 3.0 * EPS * scale.first, "%d, row %d", n, k);
                kt_worst_near(&second, rates.second, 0.0, 3.0 * EPS * scale.second, "%d, row %d", n, k);
            }
        }
    }
}

/* Makes vectors of six numbers orthogonal, the longest first. Returns how many are longer than 1e-6 of the first. The
 * length of the shortest of these, relative to the first, is in *shortest. */
static int rank_of(double x[][6], int count, double *shortest) {
    double first = 0.0;
    for (int r = 0; r < count; r++) {
        double most = 0.0;
        int best = r;
        for (int i = r; i < count; i++) {
            double square = 0.0;
            for (int k = 0; k < 6; k++)
                square += x[i][k] * x[i][k];
            if (square > most) {
                most = square;
                best = i;
            }
        }
        const double length = sqrt(most);
        first = r == 0 ? length : first;
        if (!(length > 1e-6 * first))
            return r;
        *shortest = length / first;
        for (int k = 0; k < 6; k++) {
            const double swap = x[r][k];
            x[r][k] = x[best][k] / length;
            if (best != r)
                x[best][k] = swap;
        }
        for (int i = r + 1; i < count; i++) {
            double dot = 0.0;
            for (int k = 0; k < 6; k++)
                dot += x[i][k] * x[r][k];
            for (int k = 0; k < 6; k++)
                x[i][k] -= dot * x[r][k];
        }
    }
    return count;
}

static int rank_of_rows(const kt_loop_row *rows, int count, double *shortest) {
    double x[KT_LOOP_ROW_MAX][6];
    for (int r = 0; r < count; r++)
        for (int k = 0; k < 3; k++) {
            x[r][k] = rows[r].moment[k];
            x[r][3 + k] = rows[r].force[k];
        }
    return rank_of(x, count, shortest);
}

/* Relative velocities (w, u) of many motions through one place, less those of the first (which has the part that time
 * alone makes). */
static int rank_of_motions(const kt_loop_record *loop, kt_random *random, const moving *a, const jet free[6],
                           kt_loop_end at[2]) {
    enum { MANY = 12 };
    double x[MANY][6], none[6] = {0.0}, shortest;
    for (int n = 0; n <= MANY; n++) {
        jet rates[6];
        for (int i = 0; i < 6; i++)
            rates[i] = jet_make(free[i].x, (long double)kt_random_normal(random), 0.0L);
        const moving relative = allowed(loop, 1.0, rates), b = moving_compose(a, &relative);
        at[0] = moving_end(a, NULL);
        at[1] = moving_end(&b, NULL);
        const kt_v4 w = at[1].omega - at[0].omega;
        const kt_v4 u = at[1].velocity - at[0].velocity - kt_v4_cross(at[0].omega, at[1].point - at[0].point);
        for (int k = 0; k < 3; k++) {
            double *out = n ? x[n - 1] : none;
            out[k] = w[k] - (n ? none[k] : 0.0);
            out[3 + k] = u[k] - (n ? none[3 + k] : 0.0);
        }
    }
    return rank_of(x, MANY, &shortest);
}

/* Together with the test above: the rows forbid exactly the motions that the type forbids. */
KT_TEST(independent_rows_and_freedoms_left_make_six) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
        if (!is_about_poses(type))
            continue;
        int least = 6, left_most = 0, left_least = 6;
        double shortest = 1.0;
        for (int n = 0; n < 100; n++) {
            double numbers[MOVING_NUMBERS], relative = 0.0;
            jet free[6];
            kt_loop_end end[2];
            kt_loop_row rows[KT_LOOP_ROW_MAX];
            const kt_loop_record loop = moving_loop(&random, type, numbers);
            const moving a = moving_random(&random, 2.0);
            for (int i = 0; i < 6; i++)
                free[i] = moving_random_jet(&random, 2.0);
            const int left = rank_of_motions(&loop, &random, &a, free, end);
            const int count = kt_loop_kinds_baseline[type]->evaluate(&loop, numbers, end, 1.0, rows);
            const int rank = rank_of_rows(rows, count, &relative);
            least = rank < least ? rank : least;
            left_most = left > left_most ? left : left_most;
            left_least = left < left_least ? left : left_least;
            shortest = fmin(shortest, relative);
        }
        kt_check_equal_int(kt_loop_type_name((kt_loop_type)type), least, dofs[type].equations);
        kt_check_equal_int("  freedoms left, most", left_most, 6 - dofs[type].equations);
        kt_check_equal_int("  freedoms left, least", left_least, 6 - dofs[type].equations);
        kt_note("shortest independent row, relative: %.2g", shortest);
    }
}

KT_TEST(counts_are_those_of_the_scene_format) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
        kt_loop loop = kt_loop_default();
        loop.type = (kt_loop_type)type;
        loop.holonomic = false;
        kt_check_equal_int(kt_loop_type_name(loop.type), kt_loop_equation_count(&loop), dofs[type].equations);
        loop.holonomic = true;
        const int most = dofs[type].equations + (type == KT_LOOP_ROLLING);
        kt_check_equal_int("  with contact", kt_loop_equation_count(&loop), most);
        const kt_loop_kind *kind = kt_loop_kinds_baseline[type];
        kt_check_equal_int("  rows at most", kind->rows, kind->relate ? 0 : most + (type == KT_LOOP_CURVE));
        if (!kind->evaluate)
            continue;
        double numbers[MOVING_NUMBERS];
        kt_loop_record record = moving_loop(&random, type, numbers);
        const moving a = moving_random(&random, 2.0), b = moving_random(&random, 2.0);
        const kt_loop_end end[2] = {moving_end(&a, NULL), moving_end(&b, NULL)};
        kt_loop_row rows[KT_LOOP_ROW_MAX];
        kt_check_equal_int("  rows written", kind->evaluate(&record, numbers, end, 0.0, rows), most);
        record.contact = false;
        kt_check_equal_int("  without contact", kind->evaluate(&record, numbers, end, 0.0, rows), dofs[type].equations);
    }
}
