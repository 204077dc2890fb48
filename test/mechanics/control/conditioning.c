/* Reciprocal condition numbers that come with results. A slider-crank near its dead point is compared with its
 * geometry. Other cases are feet that a loop holds, and arms near their stretched position. Singular cases must be
 * rejected.
 *
 * The slider-crank has the crank r at the angle a from the line of the slider and the rod l at the angle a + b,
 *     r sin a + l sin(a + b) = 0
 * With c = cos(a + b), the slider x = r cos a + l c has
 *     dx/da = -r sin a - l sin(a + b) (1 + db/da),   (1 + db/da) = -r cos a / (l c)
 * so that near a = 0 one metre of the slider turns the crank by 1 / (dx/da) radians.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/control.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { CRANK, ROD, SLIDER };

#define R 0.3
#define L 1.1

/* `size` multiplies lengths. */
static void build_crank(linkage *l, double angle, double size, kt_structure structure) {
    linkage_begin(l);
    l->options.structure = structure;
    const double turned = asin(-R * sin(angle) / L);
    (void)linkage_bar(l, "crank", NULL, kt_vec3_make(0, 0, 0), kt_vec3_make(R * size, 0, 0), angle, 0.0);
    (void)linkage_bar(l, "rod", "crank", kt_vec3_make(R * size, 0, 0), kt_vec3_make(L * size, 0, 0), turned - angle,
                      0.0);
    kt_body *slider = linkage_bar(l, "slider", NULL, kt_vec3_make(0, 0, 0), kt_vec3_make(0.1 * size, 0, 0),
                                  size * (R * cos(angle) + L * cos(turned)), 0.0);
    slider->joint.type = KT_JOINT_PRISMATIC;
    slider->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    linkage_close(l, "pin", KT_LOOP_REVOLUTE, "rod", kt_vec3_make(L * size, 0, 0), "slider", kt_vec3_make(0, 0, 0));
    linkage_compile(l);
}

typedef struct calls {
    kt_status basis, forces;
    double of_basis, of_forces, force;
} calls;

static calls ask(const linkage *l, int coordinate) {
    const kt_coordinate_list list = {&coordinate, 1};
    size_t size = (kt_actuation_work_size(l->model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    double basis[9];
    calls c = {.of_basis = (double)NAN, .of_forces = (double)NAN, .force = (double)NAN};
    kt_error e = {0};
    c.basis = kt_independent_basis(l->model, l->data, work, size, 0.0, l->q, list, basis, &c.of_basis, &e);
    c.forces = kt_actuation_evaluate(l->model, l->data, work, size, 0.0, l->q, NULL, NULL, NULL, list, NULL, &c.force,
                                     &c.of_forces, &e);
    free(work);
    return c;
}

/* The extent of the mechanism, its unit of lengths, is the crank's 0.3 m or the rod's half, 0.55 m. For a slider's
 * unit, the rod's motion against the crank is the largest, as 1 + r/l to the crank's 1. */
static double expected(double angle) {
    const double sum = asin(-R * sin(angle) / L), rate = -R * cos(angle) / (L * cos(sum));
    const double slope = -R * sin(angle) - L * sin(sum) * rate, extent = 0.5 * L;
    return fmin(1.0, fabs(slope) / extent / fmax(1.0, fabs(rate - 1.0)));
}

KT_TEST(a_slider_that_drives_a_crank_near_its_dead_point_is_told_its_conditioning) {
    static const double angles[] = {1.0, 0.1, 1e-3, 1e-6, 1e-9};
    for (int n = 0; n < 6; n++) {
        const double size = n < 2 ? 1.0 : n < 4 ? 1e-3 : 1e3;
        for (int i = 0; i < 5; i++) {
            linkage l;
            build_crank(&l, angles[i], size, n % 2 ? KT_STRUCTURE_FRONTS : KT_STRUCTURE_DENSE);
            kt_note("lengths times %g, %g rad from the dead point", size, angles[i]);
            const calls slider = ask(&l, SLIDER), crank = ask(&l, CRANK);
            /* the basis has rounding errors of its length 1, in which the slider's part is the slope times the size */
            const double part = 1e-14 + 20.0 * DBL_EPSILON / (angles[i] * size);
            kt_check_equal_int("basis", slider.basis, KT_OK);
            kt_check_equal_int("forces", slider.forces, KT_OK);
            kt_check_near("of the basis, over the geometry's", slider.of_basis / expected(angles[i]), 1.0, part);
            kt_check_near("of the forces, over the geometry's", slider.of_forces / expected(angles[i]), 1.0, part);
            kt_check_equal_int("crank", crank.forces, KT_OK);
            kt_check_above("of the crank, whose rod turns no more than 1 + r/l times as far", crank.of_forces,
                           1.0 / (1.0 + R / L) - 1e-12);
        }
    }
}

KT_TEST(at_a_dead_point_up_to_rounding_forces_are_rejected) {
    static const double angles[] = {1e-12, 1e-14, 0.0};
    for (int n = 0; n < 6; n++) {
        linkage l;
        build_crank(&l, angles[n / 2], 1.0, n % 2 ? KT_STRUCTURE_FRONTS : KT_STRUCTURE_DENSE);
        kt_note("%g rad", angles[n / 2]);
        const calls slider = ask(&l, SLIDER), crank = ask(&l, CRANK);
        kt_check_equal_int("basis", slider.basis, KT_ERROR_SINGULAR);
        kt_check_equal_int("forces", slider.forces, KT_ERROR_SINGULAR);
        kt_check_true("untouched", isnan(slider.force) && isnan(slider.of_forces) && isnan(slider.of_basis));
        kt_check_equal_int("crank", crank.forces, KT_OK);
    }
}

/* Weights spare a motor; that of the other ones is not the worse conditioned for it. */
KT_TEST(conditioning_of_more_actuators_than_freedoms_is_that_of_the_best) {
    linkage l;
    const int both[2] = {CRANK, SLIDER};
    const double weights[2] = {1.0, 1e8};
    double forces[2], rcond[2] = {0.0, 0.0};
    kt_error e = {0};
    build_crank(&l, 1e-6, 1.0, KT_STRUCTURE_DENSE);
    size_t size = (kt_actuation_work_size(l.model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    for (int i = 0; i < 2; i++)
        (void)kt_fine("forces",
                      kt_actuation_evaluate(l.model, l.data, work, size, 0.0, l.q, NULL, NULL, NULL,
                                            (kt_coordinate_list){both, 2}, i ? weights : NULL, forces, &rcond[i], &e),
                      &e);
    kt_check_above("equal weights", rcond[0], 1.0 / (1.0 + R / L) - 1e-9);
    kt_check_above("slider spared", rcond[1], 1.0 / (1.0 + R / L) - 1e-9);
    free(work);
}

/* ---- operational space ------------------------------------------------------------------------------------------- */

/* The last bar's end: rows x and y of its Jacobian. */
static void end_rows(const linkage *l, int body, double reach, double *rows) {
    double six[6 * LINKAGE_NQ];
    kt_error e = {0};
    (void)kt_fine("kinematics", kt_kinematics_update(l->model, l->data, l->q, NULL, NULL, &e), &e);
    kt_frame_jacobian(l->model, l->data, body, kt_vec3_make(reach, 0, 0), KT_TWIST_ALIGNED, six);
    for (int i = 0; i < l->nv; i++)
        for (int r = 0; r < 2; r++)
            rows[2 * i + r] = six[6 * i + 3 + r];
}

static kt_status feel(const linkage *l, int count, const double *rows, double *inertia, double *rcond) {
    kt_error e = {0};
    double consistent[2 * LINKAGE_NQ];
    kt_mass_inverse *w = kt_test_mass_inverse(l->model, 2);
    kt_need_fine("terms", kt_mass_inverse_compute(w, l->data, 0.0, l->q, &e), &e);
    const kt_status status = kt_operational_inertia(w, count, rows, inertia, consistent, rcond, &e);
    return status;
}

/* Three bars whose end is pinned to the ground, as a foot. The end cannot move, in spite of rounding. */
KT_TEST(no_inertia_is_felt_at_a_pinned_foot) {
    for (int n = 0; n < 6; n++) {
        linkage l;
        double rows[2 * LINKAGE_NQ], x[LINKAGE_NQ], y[LINKAGE_NQ], inertia[4] = {7.0, 7.0, 7.0, 7.0}, rcond = 7.0;
        const double size = n < 2 ? 1.0 : n < 4 ? 1e-3 : 1e3;
        linkage_begin(&l);
        l.options.structure = n % 2 ? KT_STRUCTURE_FRONTS : KT_STRUCTURE_DENSE;
        for (int i = 0; i < 3; i++)
            (void)linkage_bar(&l,
                              i == 0   ? "thigh"
                              : i == 1 ? "shin"
                                       : "foot",
                              i == 0   ? NULL
                              : i == 1 ? "thigh"
                                       : "shin",
                              kt_vec3_make(i ? size : 0.0, 0, 0), kt_vec3_make(size, 0, 0), i ? -1.0 : 1.5, 0.0);
        linkage_close(
            &l, "ground", KT_LOOP_REVOLUTE, NULL,
            kt_vec3_make(size * (cos(1.5) + cos(0.5) + cos(-0.5)), size * (sin(1.5) + sin(0.5) + sin(-0.5)), 0), "foot",
            kt_vec3_make(size, 0, 0));
        linkage_compile(&l);
        end_rows(&l, 3, size, rows);
        for (int i = 0; i < l.nv; i++) {
            x[i] = rows[2 * i];
            y[i] = rows[2 * i + 1];
        }
        kt_check_equal_int("x", feel(&l, 1, x, inertia, &rcond), KT_ERROR_SINGULAR);
        kt_check_equal_int("y", feel(&l, 1, y, inertia, &rcond), KT_ERROR_SINGULAR);
        kt_check_equal_int("both", feel(&l, 2, rows, inertia, &rcond), KT_ERROR_SINGULAR);
        kt_check_equal_bits("untouched", inertia, (const double[]){7.0, 7.0, 7.0, 7.0}, 4);
        kt_check_equal_bits("untouched", &rcond, (const double[]){7.0}, 1);
        end_rows(&l, 2, size, rows); /* the ankle moves on a circle about the foot: one of its rows, not both */
        for (int i = 0; i < l.nv; i++)
            x[i] = rows[2 * i];
        kt_check_equal_int("ankle", feel(&l, 1, x, inertia, &rcond), KT_OK);
        kt_check_above("ankle", rcond, 0.1);
        kt_check_equal_int("ankle, both", feel(&l, 2, rows, inertia, &rcond), KT_ERROR_SINGULAR);
    }
}

/* Two bars of 1 m along x, the second one turned by `bend`. Up to signs, the row of the end along x is (sin(bend),
 * sin(bend)). The row across is (1 + cos(bend), cos(bend)). The first row is sin(bend) of a metre, and independent of
 * the second. */
KT_TEST(an_arm_near_its_stretched_position_is_told_how_near) {
    static const double bends[] = {0.5, 1e-3, 1e-6, 0.0};
    for (int n = 0; n < 4; n++) {
        linkage l;
        double rows[2 * LINKAGE_NQ], along[2], inertia[4], rcond = (double)NAN;
        linkage_begin(&l);
        (void)linkage_bar(&l, "upper", NULL, kt_vec3_make(0, 0, 0), kt_vec3_make(1, 0, 0), 3.141592653589793, 0.0);
        (void)linkage_bar(&l, "fore", "upper", kt_vec3_make(1, 0, 0), kt_vec3_make(1, 0, 0), bends[n], 0.0);
        linkage_compile(&l);
        end_rows(&l, 2, 1.0, rows);
        kt_note("bent by %g", bends[n]);
        const kt_status status = feel(&l, 2, rows, inertia, &rcond), expected = n < 3 ? KT_OK : KT_ERROR_SINGULAR;
        kt_check_equal_int("both", status, expected);
        for (int i = 0; i < 2; i++)
            along[i] = rows[2 * i];
        if (expected == KT_OK) {
            kt_check_below("of both, over the sine of the bend", rcond / sin(bends[n]), 1.0 + 1e-9);
            kt_check_above("of both, over the sine of the bend", rcond / sin(bends[n]), 0.1);
        }
        kt_check_equal_int("along the arm alone", feel(&l, 1, along, inertia, &rcond), expected);
        if (expected == KT_OK)
            kt_check_near("along the arm, over the sine", rcond / sin(bends[n]), 1.0, 1e-14 + 4e-16 / bends[n]);
        else
            kt_check_below("the row", fabs(along[0]) + fabs(along[1]), 1e-15);
    }
}
