/* Inverse dynamics of a floating base whose feet are on the ground with unknown forces. It has twelve motors and
 * eighteen degrees of freedom. Three or four feet are down as points, or two as flat feet, and the set is switched.
 *
 * M a + h = S' tau + A' lambda, and sum w tau^2 is least:
 *     [W  0  S] [tau   ]   [0]
 *     [0  0  A] [lambda] = [0]
 *     [S' A' 0] [mu    ]   [M a + h]
 * which is solved here by elimination in long double, with the matrices alone. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/oracle.h"

#include "kinetree/control.h"
#include "kinetree/loop.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEGS = 4, MOTORS = 12, NV = 18, NQ = 19, ROWS = 12, FEET = 6, ALL = MOTORS + ROWS + NV };

typedef struct quadruped {
    kt_body body[1 + 3 * LEGS];
    char name[1 + 3 * LEGS][8];
    kt_loop foot[FEET]; /* points of all legs; flat ones of the first and the last */
    char foot_name[FEET][8];
    kt_description description;
    kt_model *model;
    kt_data *data;
} quadruped;

static void describe(quadruped *r) {
    memset(r, 0, sizeof *r);
    r->description = kt_description_default();
    r->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    for (int i = 0; i < 1 + 3 * LEGS; i++) {
        kt_body *b = &r->body[i];
        const int leg = (i - 1) / 3, part = (i - 1) % 3;
        const double x = leg < 2 ? 0.3 : -0.3, y = leg % 2 ? -0.15 : 0.15;
        *b = kt_body_default();
        (void)snprintf(r->name[i], sizeof r->name[i], "b%d", i);
        b->name = r->name[i];
        b->mass = i ? 0.8 - 0.2 * part : 9.0;
        b->inertia = (kt_sym3){0.02 * b->mass, 0.03 * b->mass, 0.025 * b->mass, 0.0, 0.0, 0.0};
        b->joint.type = i ? KT_JOINT_REVOLUTE : KT_JOINT_FREE;
        if (!i) {
            b->joint.position[2] = 0.45;
            b->joint.position[3] = 1.0;
            continue;
        }
        b->parent = part ? r->name[i - 1] : r->name[0];
        b->joint.axis = part ? kt_vec3_make(0.0, 1.0, 0.0) : kt_vec3_make(1.0, 0.0, 0.0);
        b->joint.at = part == 0 ? kt_vec3_make(x, y, 0.0)
                                : kt_vec3_make(0.0, part == 1 ? (y > 0 ? 0.06 : -0.06) : 0.0, part == 1 ? 0.0 : -0.25);
        b->joint.position[0] = part == 0 ? 0.1 * (leg - 1.5) : part == 1 ? 0.6 + 0.1 * leg : -1.1;
        b->com = kt_vec3_make(0.01, 0.0, part ? -0.11 : 0.0);
    }
    kt_describe(&r->description, r->body, 1 + 3 * LEGS, NULL, 0, NULL, 0);
}

/* Fixes the feet to the ground at their initial positions. */
static void put_down(quadruped *r) {
    kt_error e = {0};
    double q[NQ], v[NV];
    r->model = kt_test_model(&r->description, NULL);
    r->data = kt_test_data(r->model);
    kt_model_initial(r->model, q, v);
    kt_need_fine("kinematics", kt_kinematics_update(r->model, r->data, q, v, NULL, &e), &e);
    for (int k = 0; k < FEET; k++) {
        const int leg = k < LEGS ? k : k == LEGS ? 0 : LEGS - 1;
        kt_loop *foot = &r->foot[k];
        *foot = kt_loop_default();
        (void)snprintf(r->foot_name[k], sizeof r->foot_name[k], "foot%d", k);
        foot->name = r->foot_name[k];
        foot->type = k < LEGS ? KT_LOOP_SPHERICAL : KT_LOOP_WELD;
        foot->between[1].body = r->name[3 * leg + 3];
        foot->between[1].at = kt_vec3_make(0.0, 0.0, -0.24);
        foot->between[0].at = kt_point_position(r->model, r->data, 3 * leg + 4, foot->between[1].at);
        foot->between[0].rotation = kt_rotation_matrix(kt_body_pose(r->model, r->data, 3 * leg + 4).rotation);
        foot->switching = KT_SWITCHED_OFF;
    }
    r->description.loops = r->foot;
    r->description.loop_count = FEET;
    r->model = kt_test_model(&r->description, NULL);
    r->data = kt_test_data(r->model);
}

/* Forces and multipliers by elimination. Returns false if they are not determined. */
static bool eliminate(const double *right, const double *jacobian, int rows, const double *weight, double *forces,
                      double *multipliers) {
    static long double a[ALL * ALL], b[ALL];
    const int n = MOTORS + rows + NV, at = MOTORS + rows;
    memset(a, 0, sizeof a);
    memset(b, 0, sizeof b);
    for (int i = 0; i < MOTORS; i++) {
        a[i * n + i] = weight ? (long double)weight[i] : 1.0L;
        a[i * n + at + 6 + i] = a[(at + 6 + i) * n + i] = 1.0L;
    }
    for (int r = 0; r < rows; r++)
        for (int j = 0; j < NV; j++)
            a[(MOTORS + r) * n + at + j] = a[(at + j) * n + MOTORS + r] = (long double)jacobian[j * rows + r];
    for (int j = 0; j < NV; j++)
        b[at + j] = (long double)right[j];
    if (!kt_oracle_solve(n, a, 1, b))
        return false;
    for (int i = 0; i < MOTORS; i++)
        forces[i] = (double)b[i];
    for (int r = 0; r < rows; r++)
        multipliers[r] = (double)b[MOTORS + r];
    return true;
}

KT_TEST(twelve_motors_move_a_floating_base_on_its_feet) {
    kt_random random = kt_random_of_test();
    static quadruped r;
    static double jacobian[ROWS * NV];
    KT_WORST motors = kt_worst_make("motor torques"), feet = kt_worst_make("foot forces");
    int index[MOTORS], stances = 0;
    for (int i = 0; i < MOTORS; i++)
        index[i] = 6 + i;
    describe(&r);
    put_down(&r);
    const kt_model *model = r.model;
    const size_t size = 4 * kt_actuation_work_size(model) + 65536;
    void *work = aligned_alloc(KT_ALIGNMENT, (size + 63) / 64 * 64);
    static const unsigned sets[] = {0x7, 0xb, 0xd, 0xe, 0xf, 0x30};
    for (size_t n = 0; work && n < sizeof sets / sizeof *sets; n++) {
        const unsigned set = sets[n];
        double q[NQ], v[NV], tau[NV], a[NV], right[NV], weight[MOTORS], forces[MOTORS], expected[MOTORS],
            all[NV] = {0.0};
        double lambda[ROWS], found[ROWS], most = 0.0;
        kt_error e = {0};
        for (int k = 0; k < FEET; k++)
            (void)kt_fine("switch", kt_loop_set_on(&model, r.data, k, set >> k & 1, &e), &e);
        const int rows = kt_model_mobility(model).equations;
        kt_check_equal_int("rows", rows, set == 0x7 || set == 0xb || set == 0xd || set == 0xe ? 9 : 12);
        kt_model_initial(model, q, v);
        for (int i = 0; i < NV; i++) {
            v[i] = kt_random_uniform(&random, -0.3, 0.3);
            tau[i] = kt_random_uniform(&random, -5.0, 5.0);
        }
        for (int i = 0; i < MOTORS; i++)
            weight[i] = kt_random_uniform(&random, 0.2, 5.0);
        for (int weighted = 0; weighted < 2; weighted++) {
            const double *w = weighted ? weight : NULL;
            double rcond = 0.0;
            memset(all, 0, sizeof all);
            const bool fine =
                kt_fine("velocities", kt_velocity_impact(model, r.data, 0.0, q, v, NULL, &e), &e) &&
                kt_fine("accelerations", kt_acceleration_evaluate(model, r.data, 0.0, q, v, tau, NULL, a, &e), &e) &&
                kt_fine("forces",
                        kt_actuation_evaluate(model, r.data, work, size, 0.0, q, v, a, NULL,
                                              (kt_coordinate_list){index, MOTORS}, w, forces, &rcond, &e),
                        &e) &&
                kt_fine("inverse", kt_dynamics_inverse(model, r.data, q, v, a, NULL, right, &e), &e) &&
                kt_fine("rows", kt_loop_equations(model, r.data, 0.0, q, v, jacobian, NULL, NULL, NULL, &e), &e);
            if (!fine || !kt_check_true("determined", eliminate(right, jacobian, rows, w, expected, lambda)))
                continue;
            memcpy(all + 6, forces, sizeof forces);
            kt_need_fine("reactions", kt_multiplier_evaluate(model, r.data, 0.0, q, v, all, NULL, found, &e), &e);
            for (int i = 0; i < MOTORS; i++)
                most = fmax(most, fabs(expected[i]));
            for (int k = 0; k < rows; k++)
                most = fmax(most, fabs(lambda[k]));
            const double bound = 512.0 * DBL_EPSILON * most / rcond;
            for (int i = 0; i < MOTORS; i++)
                kt_worst_near(&motors, forces[i], expected[i], bound, "feet %x, motor %d", set, i);
            for (int k = 0; k < rows; k++)
                kt_worst_near(&feet, found[k], lambda[k], bound, "feet %x, row %d", set, k);
            stances++;
        }
    }
    kt_check_equal_int("stances", stances, 12);
    free(work);
}

/* On two points the body can tip about the line through them with all motors at rest. */
KT_TEST(a_body_on_two_points_tips_and_is_told_so) {
    static quadruped r;
    static const int index[MOTORS] = {6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17};
    double q[NQ], v[NV], forces[MOTORS];
    kt_error e = {0};
    describe(&r);
    put_down(&r);
    const kt_model *model = r.model;
    kt_need_fine("first foot", kt_loop_set_on(&model, r.data, 0, true, &e), &e);
    kt_need_fine("second foot", kt_loop_set_on(&model, r.data, 3, true, &e), &e);
    const size_t size = kt_actuation_work_size(model);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + 63) / 64 * 64);
    kt_model_initial(model, q, v);
    kt_check_true("rejected", kt_actuation_evaluate(model, r.data, work, size, 0.0, q, NULL, NULL, NULL,
                                                    (kt_coordinate_list){index, MOTORS}, NULL, forces, NULL,
                                                    &e) == KT_ERROR_SINGULAR);
    kt_note("%s: %s", e.where, e.message);
    free(work);
}
