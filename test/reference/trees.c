/* Trees without a closed form: the invariants, the motion of the centre of mass, and the agreement of two methods.
 *
 * Each bound is three times the error measured when the test was written, unless a comment gives another reason.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

/* ---- free flight ------------------------------------------------------------------------------------------------- */

/* Energy; linear momentum without that of the weight, P - M g t; angular momentum about the centre of mass. */
static int flight_invariants(const kt_case *c, const kt_record *record, double *out) {
    kt_vec3 center;
    const double mass = kt_mass_center(c->model, record->data, &center);
    const kt_wrench momentum = kt_momentum(c->model, record->data);
    const kt_vec3 impulse = kt_vec3_scale(mass * record->t, kt_model_gravity(c->model));
    const kt_vec3 linear = kt_vec3_sub(momentum.force, impulse);
    const kt_vec3 angular = kt_vec3_sub(momentum.moment, kt_vec3_cross(center, momentum.force));
    out[0] = record->kinetic + record->potential;
    out[1] = linear.x;
    out[2] = linear.y;
    out[3] = linear.z;
    out[4] = angular.x;
    out[5] = angular.y;
    out[6] = angular.z;
    return 7;
}

static const char *const flight_names[KT_INVARIANTS_MAX] = {"energy",           "momentum along x", "momentum along y",
                                                            "momentum along z", "momentum about x", "momentum about y",
                                                            "momentum about z"};

/* The path of the centre of mass, from its place and velocity in the first record: c + v t + g t^2 / 2. */
typedef struct path {
    kt_vec3 place, velocity;
} path;

static double path_error(const kt_case *c, const kt_record *record, const void *about) {
    const path *p = about;
    const double t = record->t;
    kt_vec3 center;
    (void)kt_mass_center(c->model, record->data, &center);
    const kt_vec3 fallen = kt_vec3_scale(0.5 * t * t, kt_model_gravity(c->model));
    return kt_vec3_norm(kt_vec3_sub(center, kt_vec3_add(kt_vec3_add(p->place, kt_vec3_scale(t, p->velocity)), fallen)));
}

static path find_path(const kt_case *c) {
    enum { NUMBERS = 64 };
    double q[NUMBERS], v[NUMBERS];
    path p;
    kt_data *data = kt_test_data(c->model);
    kt_error error = {KT_OK, "", ""};
    kt_need(kt_check_below("coordinates", kt_model_nq(c->model), NUMBERS));
    kt_model_initial(c->model, q, v);
    kt_need_fine("kinematics", kt_kinematics_update(c->model, data, q, v, NULL, &error), &error);
    const double mass = kt_mass_center(c->model, data, &p.place);
    p.velocity = kt_vec3_scale(1.0 / mass, kt_momentum(c->model, data).force);
    return p;
}

static void fly(const char *scene, const kt_setting *of_invariants, const kt_setting *of_path, size_t count,
                const double *scale) {
    const kt_case c = kt_case_open(scene);
    const path p = find_path(&c);
    kt_case_conserve(&c, of_invariants, count, flight_invariants, flight_names, scale);
    kt_case_follow(&c, of_path, count, path_error, &p);
}

KT_TEST(three_bodies_keep_energy_and_momenta_and_drift_straight_on) {
    static const double scale[KT_INVARIANTS_MAX] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    static const kt_setting of_invariants[] = {{NULL, 0.0, 0.0, 2.5e-9},
                                               {"dop853", 0.0, 1e-13, 2e-11},
                                               {"dopri5", 0.0, 1e-10, 1.2e-8},
                                               {"rk4", 0.01, 0.0, 2.2e-8}};
    static const kt_setting of_path[] = {{NULL, 0.0, 0.0, 7e-11},
                                         {"dop853", 0.0, 1e-13, 6e-13},
                                         {"dopri5", 0.0, 1e-10, 5e-10},
                                         {"rk4", 0.01, 0.0, 3.5e-9}};
    fly("three-body", of_invariants, of_path, COUNT_OF(of_path), scale);
}

/* The energy is 1898 J, which makes its errors larger than those of the momenta. */
KT_TEST(human_figure_keeps_energy_and_momenta_and_flies_as_a_stone) {
    static const double scale[KT_INVARIANTS_MAX] = {1.0, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25};
    static const kt_setting of_invariants[] = {{NULL, 0.0, 0.0, 1.2e-8},
                                               {"dop853", 0.0, 1e-12, 3.5e-11},
                                               {"dopri5", 0.0, 1e-10, 1.5e-9},
                                               {"rk4", 2e-3, 0.0, 1.7e-8}};
    static const kt_setting of_path[] = {{NULL, 0.0, 0.0, 2e-11},
                                         {"dop853", 0.0, 1e-12, 3e-14},
                                         {"dopri5", 0.0, 1e-10, 2e-12},
                                         {"rk4", 2e-3, 0.0, 1e-11}};
    fly("humanoid", of_invariants, of_path, COUNT_OF(of_path), scale);
}

/* ---- energy against tolerance ------------------------------------------------------------------------------------ */

static void conserve(const char *scene, const kt_setting *settings, size_t count) {
    kt_case c = kt_case_open(scene);
    kt_case_conserve_energy(&c, settings, count);
}

KT_TEST(seven_axis_arm_keeps_its_energy_as_its_tolerance_says) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 1.5e-8},      {"dop853", 0.0, 1e-12, 1.5e-10}, {"dop853", 0.0, 1e-8, 8e-7},
        {"dop853", 0.0, 1e-6, 1.5e-4}, {"dopri5", 0.0, 1e-10, 4e-8},    {"tsit5", 0.0, 1e-10, 2.5e-8},
        {"bs32", 0.0, 1e-7, 1.2e-5},   {"rk4", 1e-3, 0.0, 6e-6},
    };
    conserve("arm7", settings, COUNT_OF(settings));
}

KT_TEST(whip_keeps_its_energy_as_its_tolerance_says) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 3e-10},
                                          {"dopri5", 0.0, 1e-10, 3e-12},
                                          {"dop853", 0.0, 1e-12, 5e-14},
                                          {"rk4", 2e-4, 0.0, 4e-10}};
    conserve("chain", settings, COUNT_OF(settings));
}

/* ---- two methods ------------------------------------------------------------------------------------------------- */

static const kt_setting eighth = {"dop853", 0.0, 1e-13, 0.0}, fifth = {"tsit5", 0.0, 1e-13, 0.0},
                        own = {NULL, 0.0, 0.0, 0.0};

static void agree(const char *scene, const kt_setting *a, const kt_setting *b, double bound) {
    const kt_case c = kt_case_open(scene);
    kt_case_agree(&c, a, b, bound);
}

/* In its two seconds the arm multiplies a small difference by some 1e4: the first bound has room for other last bits.
 */
KT_TEST(two_methods_move_the_seven_axis_arm_alike) {
    static const kt_setting fourth = {"rk4", 2.5e-4, 0.0, 0.0};
    agree("arm7", &eighth, &fifth, 1e-8);
    agree("arm7", &eighth, &fourth, 1.5e-4);
    agree("arm7", &eighth, &own, 7e-6);
}

KT_TEST(two_methods_move_the_human_figure_alike) {
    static const kt_setting fourth = {"rk4", 1e-3, 0.0, 0.0};
    agree("humanoid", &eighth, &fifth, 2e-12);
    agree("humanoid", &eighth, &fourth, 5e-10);
    agree("humanoid", &eighth, &own, 6e-9);
}

KT_TEST(two_methods_move_the_three_bodies_alike) {
    agree("three-body", &eighth, &fifth, 4e-11);
    agree("three-body", &eighth, &own, 2e-9);
}
