/* The values that an assembly keeps because the description gives them, its report on moved values, and its end.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A four-bar of which the description gives the crank alone, away from where all would move least. */
static void give_crank(linkage *l, double angle, double rate) {
    four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    for (int k = 0; k < 3; k++) {
        l->body[k].joint.position[0] = k ? 0.0 : angle;
        l->body[k].joint.velocity[0] = k ? 0.0 : rate;
        l->body[k].joint.given = 0;
    }
}

KT_TEST(given_values_stay_where_the_rest_can_close) {
    static linkage l;
    const double angle = 1.2, rate = 3.0;
    kt_residual r = {(double)NAN, (double)NAN};
    kt_error e = {0};
    give_crank(&l, angle, rate);
    linkage_build(&l, 0.0);
    kt_check_equal_bits("angle", &l.q[0], &angle, 1);
    kt_check_equal_bits("rate", &l.v[0], &rate, 1);
    (void)kt_fine("residual", kt_loop_residual(l.model, l.data, 0.0, l.q, l.v, &r, &e), &e);
    kt_check_below("closed", r.position, 1e-14);
    kt_check_below("fits", r.velocity, 1e-13);
    kt_check_equal_int("nothing to tell", kt_initial_changes(l.model, l.q, l.v, NULL, 0), 0);
    give_crank(&l, 0.0, 0.0); /* zeros that are given */
    l.body[0].joint.given = KT_GIVEN_POSITION;
    linkage_build(&l, 0.0);
    const double zero = 0.0;
    kt_check_equal_bits("angle 0", &l.q[0], &zero, 1);
    kt_check_above("the others moved", fabs(l.q[1]) + fabs(l.q[2]), 0.1);
}

/* The closed position of a four-bar with this crank, and the rocker nearest to `rocker` (circles about both ends of the
 * coupler). Returns false if the coupler does not reach. */
static bool close_rocker(const four_bar *f, double crank, double near, double *rocker) {
    const double x = f->crank * cos(crank) - f->ground, y = f->crank * sin(crank);
    const double c =
        (x * x + y * y + f->rocker * f->rocker - f->coupler * f->coupler) / (2.0 * f->rocker * hypot(x, y));
    double best = HUGE_VAL;
    for (int side = -1; side < 2 && fabs(c) <= 1.0; side += 2) {
        const double angle = atan2(y, x) + side * acos(c), off = remainder(angle - near, 8.0 * atan(1.0));
        if (fabs(off) < fabs(best))
            best = off;
    }
    *rocker = near + best;
    return isfinite(best);
}

/* The least change of crank and rocker that closes the four-bar, sqrt(dc^2 + dr^2), of cranks in steps of 1e-4 rad. */
static double least_change_of_given(const four_bar *f, double crank, double rocker) {
    double least = HUGE_VAL;
    for (int i = -10000; i <= 10000; i++) {
        double r;
        if (close_rocker(f, crank + 1e-4 * i, rocker, &r))
            least = fmin(least, hypot(1e-4 * i, r - rocker));
    }
    return least;
}

/* Crank and rocker of random four-bars are given, up to 0.3 rad off, and cannot both stay. They move by the least
 * change, although the coupler starts at 0. The changes are reported. */
KT_TEST(given_values_that_cannot_stay_move_least_and_are_told) {
    static linkage l;
    kt_random random = kt_random_of_test();
    KT_WORST change = kt_worst_make("change of given values, over the least one");
    for (int n = 0; n < 60; n++) {
        four_bar f = four_bar_default();
        kt_initial_change changes[8] = {{.body = -1}};
        double rocker, told = 0.0;
        f.coupler *= kt_random_uniform(&random, 0.9, 1.1);
        f.rocker *= kt_random_uniform(&random, 0.9, 1.1);
        const double crank = kt_random_uniform(&random, 0.5, 1.5);
        if (!close_rocker(&f, crank, 1.6, &rocker))
            continue;
        linkage_four_bar(&l, &f);
        const double given[2] = {crank + kt_random_uniform(&random, -0.3, 0.3),
                                 rocker + kt_random_uniform(&random, -0.3, 0.3)};
        const double start[3] = {given[0], 0.0, given[1]};
        for (int k = 0; k < 3; k++) {
            l.body[k].joint.position[0] = start[k];
            l.body[k].joint.velocity[0] = 0.0;
            l.body[k].joint.given = k == 1 ? 0 : KT_GIVEN_POSITION;
        }
        linkage_build(&l, 0.0);
        const int count = kt_initial_changes(l.model, l.q, l.v, changes, 8);
        for (int i = 0; i < count; i++)
            told = hypot(told, changes[i].change);
        kt_worst_near(&change, hypot(l.q[0] - given[0], l.q[2] - given[1]),
                      least_change_of_given(&f, given[0], given[1]), 1e-5, "four-bar %d", n);
        kt_worst_near(&change, told, hypot(l.q[0] - given[0], l.q[2] - given[1]), 1e-6, "report of four-bar %d", n);
    }
}

/* Crank and rocker of random four-bars have rounded values, which are given. They move by the rounding alone, although
 * the coupler, whose values are not given, moves far from its start at 0. */
KT_TEST(given_values_that_almost_fit_move_by_their_rounding) {
    static linkage l;
    static const double rounding = 1e-6, step = 1e-5;
    kt_random random = kt_random_of_test();
    KT_WORST position = kt_worst_make("change of given angles, rad");
    KT_WORST velocity = kt_worst_make("change of given rates, rad/s");
    for (int n = 0; n < 20; n++) {
        four_bar f = four_bar_default();
        double rocker[3] = {1.6, 1.6, 1.6};
        f.coupler *= kt_random_uniform(&random, 0.9, 1.1);
        f.rocker *= kt_random_uniform(&random, 0.9, 1.1);
        const double crank = kt_random_uniform(&random, 0.7, 1.3), rate = kt_random_uniform(&random, 5.0, 10.0);
        bool closes = true;
        for (int i = 0; i < 3; i++)
            closes = closes && close_rocker(&f, crank + (i - 1) * step, 1.6, &rocker[i]);
        if (!closes)
            continue;
        const double angles[3] = {crank, 0.0, rocker[1] + rounding},
                     rates[3] = {rate, 0.0, rate * (rocker[2] - rocker[0]) / (2.0 * step) - rounding};
        linkage_four_bar(&l, &f);
        for (int k = 0; k < 3; k++) {
            l.body[k].joint.position[0] = angles[k];
            l.body[k].joint.velocity[0] = rates[k];
            l.body[k].joint.given = k == 1 ? 0 : KT_GIVEN_POSITION | KT_GIVEN_VELOCITY;
        }
        linkage_build(&l, 0.0);
        kt_worst_near(&position, hypot(l.q[0] - angles[0], l.q[2] - angles[2]), 0.0, 1.1 * rounding, "four-bar %d", n);
        kt_worst_near(&velocity, hypot(l.v[0] - rates[0], l.v[2] - rates[2]), 0.0, 10.0 * rounding, "four-bar %d", n);
    }
}

/* The position of a follower enters its equation with a constant coefficient. A step of any length is exact for the
 * follower, and the given cam stays, for lifts up to far above the length of the mechanism. */
KT_TEST(followers_of_given_cams_move_any_distance) {
    static linkage l;
    const double angle = 1.2;
    const kt_vec3 bar = kt_vec3_make(1.0, 0.0, 0.0), none = kt_vec3_make(0.0, 0.0, 0.0);
    for (int exponent = 0; exponent <= 6; exponent += 2) {
        const double lift = pow(10.0, exponent);
        const kt_term terms[2] = {{"cam", 0.0}, {"follower", 1.0}};
        char formula[64];
        linkage_begin(&l);
        linkage_bar(&l, "cam", NULL, none, bar, angle, 0.0)->joint.given = KT_GIVEN_POSITION;
        kt_joint *slide = &linkage_bar(&l, "follower", NULL, none, bar, 0.0, 0.0)->joint;
        slide->type = KT_JOINT_PRISMATIC;
        slide->given = 0;
        kt_loop *loop = linkage_close(&l, "lift", KT_LOOP_COUPLING, NULL, none, NULL, none);
        (void)snprintf(formula, sizeof formula, "-%.17g*sin(position.cam)", lift);
        loop->terms = terms;
        loop->term_count = 2;
        loop->formula = formula;
        linkage_build(&l, 0.0);
        kt_check_equal_bits("cam", &l.q[0], &angle, 1);
        kt_check_near(formula, l.q[1], lift * sin(angle), 1e-14 * lift);
    }
}

/* A chain of two bars between crank and rocker that is too short: crank and rocker alone would move to where the chain
 * is straight. All move alike instead, and the chain stays bent. */
KT_TEST(given_values_do_not_move_to_a_singular_position) {
    static linkage l;
    const kt_vec3 bar = kt_vec3_make(1.0, 0.0, 0.0), none = kt_vec3_make(0.0, 0.0, 0.0);
    linkage_begin(&l);
    linkage_bar(&l, "crank", NULL, none, bar, 2.2, 0.0)->joint.given = KT_GIVEN_POSITION;
    linkage_bar(&l, "first", "crank", bar, bar, 0.0, 0.0)->joint.given = 0;
    linkage_bar(&l, "second", "first", bar, bar, 0.0, 0.0)->joint.given = 0;
    linkage_bar(&l, "rocker", NULL, kt_vec3_make(2.0, 0.0, 0.0), bar, 0.9, 0.0)->joint.given = KT_GIVEN_POSITION;
    linkage_close(&l, "close", KT_LOOP_REVOLUTE, "second", bar, "rocker", bar);
    linkage_build(&l, 0.0);
    kt_check_above("angle of the chain", fabs(sin(l.q[2])), 0.05);
}

/* A group of two degrees of freedom with one given velocity: the others are chosen, and reported. */
KT_TEST(velocities_that_nothing_determines_are_told) {
    static linkage l;
    static const kt_term term[2] = {{"w0", 1.0}, {"w1", -3.0}};
    const kt_term sum[3] = {{"w0", 1.0}, {"w1", 1.0}, {"w2", -1.0}};
    const kt_vec3 none = {0.0, 0.0, 0.0};
    kt_initial_change chosen[4] = {{.body = -1}};
    for (int all = 0; all < 2; all++) {
        linkage_begin(&l);
        for (int i = 0; i < 3; i++) {
            kt_body *wheel = linkage_bar(&l, sum[i].joint, NULL, kt_vec3_make(i, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0),
                                         0.0, i == 0 ? 100.0 : 0.0);
            wheel->joint.given = i == 0 ? KT_GIVEN_VELOCITY : 0;
        }
        kt_loop *first = linkage_close(&l, "sum", KT_LOOP_COUPLING, NULL, none, NULL, none);
        first->terms = sum;
        first->term_count = 3;
        if (all) {
            kt_loop *second = linkage_close(&l, "gear", KT_LOOP_COUPLING, NULL, none, NULL, none);
            second->terms = term;
            second->term_count = 2;
        }
        linkage_build(&l, 0.0);
        const int count = kt_initial_choices(l.model, l.v, chosen, 4);
        kt_check_equal_int("chosen", count, all ? 0 : 2);
        for (int i = 0; i < count; i++)
            kt_check_near("velocity", chosen[i].change, fabs(l.v[chosen[i].body - 1]), 0.0);
    }
}

/* One group's contradiction moves nothing of another. */
KT_TEST(given_values_are_released_group_by_group) {
    static linkage l;
    const kt_vec3 tip = kt_vec3_make(2.0, 0.0, 0.0), far = kt_vec3_make(0.0, 0.0, 5.0);
    const double angle = 1.2;
    give_crank(&l, angle, 0.0);
    linkage_bar(&l, "crank2", NULL, far, kt_vec3_make(1.0, 0.0, 0.0), 1.2, 0.0);
    linkage_bar(&l, "coupler2", "crank2", kt_vec3_make(1.0, 0.0, 0.0), tip, 0.0, 0.0)->joint.given = 0;
    linkage_bar(&l, "rocker2", NULL, kt_vec3_make(2.2, 0.0, 5.0), kt_vec3_make(1.8, 0.0, 0.0), 0.1, 0.0);
    linkage_close(&l, "close2", KT_LOOP_REVOLUTE, "coupler2", tip, "rocker2", kt_vec3_make(1.8, 0.0, 0.0));
    linkage_build(&l, 0.0);
    kt_check_equal_int("groups", kt_loop_group_count(l.model), 2);
    kt_check_equal_bits("the first crank", &l.q[0], &angle, 1);
    kt_check_above("the second crank moved", fabs(l.q[3] - angle), 0.01);
    kt_check_equal_int("told", kt_initial_changes(l.model, l.q, l.v, NULL, 0), 2);
}

/* A wheel on a free joint, whose spin is given and whose speed is not: it rolls at radius times spin. The other way
 * round the speed stays. */
KT_TEST(parts_of_a_free_joint_are_given_by_themselves) {
    static linkage l;
    for (int given = 0; given < 2; given++) {
        linkage_begin(&l);
        kt_body *wheel = linkage_bar(&l, "wheel", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.1, 0.0, 0.0), 0, 0);
        wheel->joint = kt_joint_default();
        wheel->joint.type = KT_JOINT_FREE;
        wheel->joint.position[2] = 0.5;
        wheel->joint.velocity[given ? 0 : 4] = given ? 3.0 : 10.0;
        kt_loop *loop = linkage_close(&l, "roll", KT_LOOP_ROLLING, "wheel", kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                      kt_vec3_make(0.0, 0.0, 0.0));
        loop->axis = kt_vec3_make(0.0, 1.0, 0.0);
        loop->radius = 0.5;
        linkage_build(&l, 0.0);
        const double spin = given ? 6.0 : 10.0, speed = given ? 3.0 : 5.0;
        kt_check_near("speed", l.v[0], speed, given ? 0.0 : 1e-14);
        kt_check_near("spin", l.v[4], spin, given ? 1e-14 : 0.0);
        kt_check_equal_int("nothing to tell", kt_initial_changes(l.model, l.q, l.v, NULL, 0), 0);
    }
}

/* The given spin and speed of a coin do not satisfy the rolling condition. Both change, and the report compares both
 * changes with the fastest rate. */
KT_TEST(velocities_that_cannot_stay_are_told) {
    static linkage l;
    kt_initial_change changes[4] = {{.body = -1}};
    linkage_begin(&l);
    kt_body *wheel = linkage_bar(&l, "wheel", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.1, 0.0, 0.0), 0, 0);
    wheel->joint = kt_joint_default();
    wheel->joint.type = KT_JOINT_FREE;
    wheel->joint.position[2] = 0.5;
    wheel->joint.velocity[4] = 10.0;
    wheel->joint.given = KT_GIVEN_VELOCITY;
    kt_loop *loop = linkage_close(&l, "roll", KT_LOOP_ROLLING, "wheel", kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                  kt_vec3_make(0.0, 0.0, 0.0));
    loop->axis = kt_vec3_make(0.0, 1.0, 0.0);
    loop->radius = 0.5;
    linkage_build(&l, 0.0);
    /* least |dv|: dx - 0.5 dw = 5, so dx = 4, dw = -2 */
    kt_check_near("speed", l.v[0], 4.0, 1e-14);
    kt_check_near("spin", l.v[4], 8.0, 1e-14);
    kt_check_equal_int("told", kt_initial_changes(l.model, l.q, l.v, changes, 4), 2);
    kt_check_equal_int("linear", changes[0].part, KT_GIVEN_VELOCITY);
    kt_check_near("by", changes[0].change, 4.0, 1e-14);
    kt_check_equal_int("angular", changes[1].part, KT_GIVEN_ANGULAR);
    kt_check_near("by", changes[1].change, 2.0, 1e-14);
    kt_check_near("of the fastest, 10 rad/s", changes[1].relative, 0.2, 1e-14);
}

/* The state at the end of a failed search, equation by equation. Two bars of 1 m should meet, but their pivots are 2.5
 * m apart. */
KT_TEST(failed_assembly_tells_where_it_ended) {
    static linkage l;
    const kt_vec3 bar = kt_vec3_make(1.0, 0.0, 0.0);
    double q[2], residual[5];
    kt_error e = {0};
    linkage_begin(&l);
    linkage_bar(&l, "left", NULL, kt_vec3_make(0.0, 0.0, 0.0), bar, 0.3, 0.0);
    linkage_bar(&l, "right", NULL, kt_vec3_make(2.5, 0.0, 0.0), bar, 2.5, 0.0);
    linkage_close(&l, "meet", KT_LOOP_REVOLUTE, "left", bar, "right", bar);
    linkage_compile(&l);
    static const kt_loop_measure measure[5] = {KT_MEASURE_LENGTH, KT_MEASURE_LENGTH, KT_MEASURE_LENGTH,
                                               KT_MEASURE_ANGLE, KT_MEASURE_ANGLE};
    kt_check_equal_int("status", kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e), KT_ERROR_CONSTRAINT);
    kt_assembly_reached(l.model, l.data, q);
    (void)kt_fine("equations", kt_loop_equations(l.model, l.data, 0.0, q, NULL, NULL, residual, NULL, NULL, &e), &e);
    kt_check_near("gap", hypot(residual[0], residual[1]), 0.5, 1e-9);
    for (int r = 0; r < 5; r++)
        kt_check_equal_int("measure", kt_loop_measure_of(l.model, 0, r), measure[r]);
}

/* A bar that has turned by 0.7 rad about z, against frames with which it should agree, and one to which it should be
 * normal. */
KT_TEST(residual_of_an_angle_gives_the_angle) {
    static const struct {
        kt_loop_type type;
        double angle;
    } cases[] = {{KT_LOOP_PARALLEL, 0.7},  {KT_LOOP_WELD, 0.7},    {KT_LOOP_ORTHOGONAL, 0.7},
                 {KT_LOOP_UNIVERSAL, 0.7}, {KT_LOOP_COAXIAL, 0.7}, {KT_LOOP_MOTION, 0.5}};
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), x = kt_vec3_make(1.0, 0.0, 0.0), y = kt_vec3_make(0.0, 1.0, 0.0);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        static linkage l;
        kt_error e = {0};
        double residual[6];
        linkage_begin(&l);
        linkage_bar(&l, "bar", NULL, none, x, 0.7, 0.0);
        kt_loop *loop = linkage_close(&l, "loop", cases[i].type, NULL, none, "bar", none);
        const bool normal = cases[i].type == KT_LOOP_ORTHOGONAL || cases[i].type == KT_LOOP_UNIVERSAL;
        loop->axis = normal ? y : x;
        loop->axis2 = x;
        if (cases[i].type == KT_LOOP_MOTION) {
            loop->joint = "bar";
            loop->function = kt_function_constant(0.2);
        }
        linkage_compile(&l);
        kt_need_fine("equations", kt_loop_equations(l.model, l.data, 0.0, l.q, NULL, NULL, residual, NULL, NULL, &e),
                     &e);
        const int count = kt_loop_rows_of(l.model, 0).count;
        int row = 0; /* the only one that is open */
        for (int r = 1; r < count; r++)
            row = fabs(residual[r]) > fabs(residual[row]) ? r : row;
        kt_check_equal_int("measure", kt_loop_measure_of(l.model, 0, row), KT_MEASURE_ANGLE);
        kt_check_near(kt_loop_type_name(cases[i].type), fabs(kt_loop_residual_angle(l.model, 0, row, residual[row])),
                      cases[i].angle, 4e-15);
    }
}

/* `hold` keeps given values. If only the position of a crank is given, the drive of its joint sets the rate. */
KT_TEST(held_joint_without_a_given_velocity_moves_as_its_drive_wants) {
    static linkage l;
    const char *names[] = {"crank"};
    const double angle = 1.2, drive[] = {1.2, 3.0};
    kt_residual r = {(double)NAN, (double)NAN};
    kt_error e = {0};
    give_crank(&l, angle, 0.0);
    kt_loop *loop = linkage_close(&l, "drive", KT_LOOP_MOTION, NULL, kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                  kt_vec3_make(0.0, 0.0, 0.0));
    loop->joint = "crank";
    loop->function = kt_function_polynomial(drive, 2);
    l.description.hold = names;
    l.description.hold_count = 1;
    linkage_build(&l, 0.0);
    kt_check_near("angle", l.q[0], angle, 1e-15);
    kt_check_near("rate", l.v[0], drive[1], 1e-14);
    (void)kt_fine("residual", kt_loop_residual(l.model, l.data, 0.0, l.q, l.v, &r, &e), &e);
    kt_check_below("fits", r.velocity, 1e-13);
}
