/* Millimetres and kilometres: the mechanism decides which quantities are small, not the unit.
 *
 * With all lengths and gravity times s, inertias times s^2 and masses as they are, every angle is the same function of
 * time.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include <math.h>

static const double sizes[] = {1e-6, 1e-3, 1.0, 1e3, 1e6, 1e8};
enum { SIZES = 6, UNIT = 2 };

static void enlarge(linkage *l, double s) {
    l->description.gravity = kt_vec3_scale(s, l->description.gravity);
    for (int i = 0; i < l->description.body_count; i++) {
        kt_body *b = &l->body[i];
        b->joint.at = kt_vec3_scale(s, b->joint.at);
        b->com = kt_vec3_scale(s, b->com);
        const kt_sym3 j = b->inertia;
        b->inertia = kt_sym3_make(s * s * j.xx, s * s * j.yy, s * s * j.zz, s * s * j.xy, s * s * j.xz, s * s * j.yz);
        if (b->joint.type == KT_JOINT_PRISMATIC) {
            b->joint.position[0] *= s;
            b->joint.velocity[0] *= s;
        }
    }
    for (int i = 0; i < l->description.loop_count; i++)
        for (int k = 0; k < 2; k++)
            l->loop[i].between[k].at = kt_vec3_scale(s, l->loop[i].between[k].at);
}

/* From far off, ranks and the closed state are the same; so are the accelerations there, and a gap is so much larger.
 */
KT_TEST(four_bar_is_assembled_alike_at_every_size) {
    static linkage l;
    double q[3], a[3], b[3];
    KT_WORST accelerations = kt_worst_make("accelerations"); /* measured: 1.5e-15 */
    const int order[SIZES] = {UNIT, 0, 1, 3, 4, 5};
    for (int k = 0; k < SIZES; k++) {
        const double s = sizes[order[k]];
        four_bar f = four_bar_default();
        f.angle[0] += 0.4;
        f.angle[1] -= 0.4;
        f.angle[2] += 0.5;
        linkage_four_bar(&l, &f);
        enlarge(&l, s);
        linkage_build(&l, 0.0);
        kt_note("%g m", s);
        kt_check_equal_int("rank", kt_model_mobility(l.model).rank, 2);
        kt_check_below("gap", linkage_residual(&l, 0.0).position, 2e-15 * s);
        linkage_accelerate(&l, 0.0, k ? b : a);
        for (int i = 0; i < 3; i++) {
            if (k == 0)
                q[i] = l.q[i];
            kt_check_near(l.body_name[i], l.q[i], q[i], 1e-13);
            kt_worst_near(&accelerations, k ? b[i] : a[i], a[i], 1e-14, "%g m, %d", s, i);
        }
    }
}

KT_TEST(unreachable_loop_is_rejected_at_every_size) {
    static linkage l;
    for (int k = 0; k < SIZES; k++) {
        four_bar f = four_bar_default();
        kt_error e = {0};
        f.ground = 4.8 + 1e-3; /* with all bars in line 4.8 m */
        linkage_four_bar(&l, &f);
        enlarge(&l, sizes[k]);
        linkage_compile(&l);
        kt_check_equal_int("status", kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e), KT_ERROR_CONSTRAINT);
        static const char *const gaps[SIZES] = {"'close' by 1e-09", "'close' by 1e-06", "'close' by 0.001",
                                                "'close' by 1 ",    "'close' by 1e+03", "'close' by 1e+05"};
        kt_check_contains("message", e.message, gaps[k]);
    }
}

/* Ten crossings in 10 s, seen from the angle at the end. */
KT_TEST(windows_pass_singular_positions_at_every_size) {
    static linkage l;
    double reference[5];
    const int order[SIZES] = {UNIT, 0, 1, 3, 4, 5};
    for (int k = 0; k < SIZES; k++) {
        linkage_run r;
        linkage_windows(&l, 2, 0.0, 1.0, KT_LOOP_REVOLUTE);
        enlarge(&l, sizes[order[k]]);
        linkage_build(&l, 0.0);
        linkage_run_start(&r, &l, "rk4", 1e-3, 0.0, false, 0.0);
        kt_note("%g m", sizes[order[k]]);
        kt_check_equal_int("rank", kt_model_mobility(l.model).rank, 4);
        linkage_run_to(&r, 10.0);
        for (int i = 0; i < 5 && k == 0; i++)
            reference[i] = l.q[i];
        for (int i = 0; i < 5 && k; i++)
            kt_check_near(l.body_name[i], l.q[i], reference[i], 1e-10);
        kt_check_below("gap", linkage_residual(&l, 10.0).position, 1e-14 * sizes[order[k]]);
    }
}

/* Metres and radians in one loop: a crank and a rod of one length, the rod's end on a slider through the crank's pivot.
 * At 90 degrees the slider is at the pivot and could stay there. It continues with x = 2 cos(angle), and the angle
 * between the bars is twice -angle. */
KT_TEST(isosceles_slider_crank_passes_its_pivot_at_every_size) {
    static linkage l;
    KT_WORST rod = kt_worst_make("rod"), place = kt_worst_make("slider");
    for (int k = 0; k < SIZES; k++) {
        const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), bar = kt_vec3_make(1.0, 0.0, 0.0);
        const double s = sizes[k], angle = 0.5, rate = 3.0;
        linkage_run r;
        linkage_begin(&l);
        linkage_bar(&l, "crank", NULL, none, bar, angle, rate);
        linkage_bar(&l, "rod", "crank", bar, bar, -2.0 * angle, -2.0 * rate);
        kt_body *slider = linkage_bar(&l, "slider", NULL, none, bar, 2.0 * cos(angle), -2.0 * sin(angle) * rate);
        slider->joint.type = KT_JOINT_PRISMATIC;
        slider->joint.axis = bar;
        linkage_close(&l, "close", KT_LOOP_REVOLUTE, "rod", bar, "slider", none);
        l.description.gravity = none;
        enlarge(&l, s);
        linkage_build(&l, 0.0);
        linkage_run_start(&r, &l, "dop853", 0.0, 1e-11, false, 0.0);
        kt_note("%g m", s);
        for (int i = 1; i <= 50; i++) {
            linkage_run_to(&r, 0.1 * i);
            kt_worst_near(&rod, l.q[1], -2.0 * l.q[0], 5e-12, "%g m, t = %g", s, 0.1 * i);
            kt_worst_near(&place, l.q[2], 2.0 * s * cos(l.q[0]), 5e-12 * s, "%g m, t = %g", s, 0.1 * i);
        }
        kt_check_equal_int("rank", kt_model_mobility(l.model).rank, 2);
        kt_check_above("turned", l.q[0], 6.0);
    }
}

/* A free body that is welded to its parent, at oblique places, behind a hinge and a slider: six equations of lengths
 * and angles in six coordinates of both. The body at rest stays at rest: accelerations of its joint vanish. */
KT_TEST(weld_of_a_free_body_keeps_its_rank_at_every_size) {
    static linkage l;
    double reference[8];
    kt_random random = kt_random_of_test();
    const int order[SIZES] = {UNIT, 0, 1, 3, 4, 5};
    KT_WORST worst = kt_worst_make("accelerations"); /* measured: 4e-15 */
    KT_WORST freedoms = kt_worst_make("degrees of freedom");
    for (int n = 0; n < 20; n++) {
        double x[12];
        for (int i = 0; i < 12; i++)
            x[i] = kt_random_uniform(&random, -1.0, 1.0);
        for (int k = 0; k < SIZES; k++) {
            const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), bar = kt_vec3_make(1.0, 0.3, 0.0);
            const double s = sizes[order[k]];
            double a[LINKAGE_NQ];
            linkage_begin(&l);
            linkage_bar(&l, "hinged", NULL, none, bar, x[0], x[1])->joint.rotation = kt_rotation_rpy(x[2], x[3], 0.0);
            kt_body *slider = linkage_bar(&l, "slider", "hinged", bar, bar, x[4], x[5]);
            slider->joint.type = KT_JOINT_PRISMATIC;
            kt_body *body = linkage_bar(&l, "free", "slider", none, bar, 0.0, 0.0);
            const kt_vec3 there = kt_vec3_make(x[6], x[7], x[8]);
            body->joint.type = KT_JOINT_FREE;
            body->inertia = kt_sym3_make(0.3, 0.4, 0.5, 0.0, 0.0, 0.0);
            body->joint.position[0] = s * (there.x - x[9]);
            body->joint.position[1] = s * (there.y - x[10]);
            body->joint.position[2] = s * (there.z - x[11]);
            body->joint.position[3] = 1.0;
            linkage_close(&l, "weld", KT_LOOP_WELD, "free", kt_vec3_make(x[9], x[10], x[11]), "slider", there);
            enlarge(&l, s);
            linkage_build(&l, 0.0);
            kt_worst_near(&freedoms, kt_model_mobility(l.model).minimal, 2.0, 0.5, "mechanism %d, %g m", n, s);
            linkage_accelerate(&l, 0.0, a);
            for (int i = 0; i < l.nv; i++) {
                a[i] /= i == 1 || (i > 1 && i < 5) ? s : 1.0;
                reference[i] = k == 0 ? a[i] : reference[i];
                kt_worst_near(&worst, a[i], reference[i], 1e-13, "mechanism %d, %g m, %d", n, s, i);
            }
        }
    }
}

/* A door on its joint and two hinges more, of which each could carry the door alone. Forces on the hinges do not depend
 * on the unit of length, and moments grow with the lengths. */
KT_TEST(redundant_hinges_share_a_load_alike_at_every_size) {
    kt_wrench right[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
    KT_WORST worst = kt_worst_make("wrenches of the hinges, relative to the weight");
    for (int n = 0; n < SIZES; n++) {
        const double size = sizes[(UNIT + n) % SIZES], q = 0.2, v = 0.0, weight = 9.81; /* that of metres first */
        kt_body door = kt_body_of("door", NULL, KT_JOINT_REVOLUTE, 1.0);
        kt_loop hinge[2];
        kt_wrench joints[2], loops[2];
        kt_error e = {0};
        door.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        door.joint.position[0] = q;
        door.com = kt_vec3_make(0.5 * size, 0.1 * size, 0.7 * size);
        door.inertia = kt_sym3_make(size * size, size * size, size * size, 0.0, 0.0, 0.0);
        for (int k = 0; k < 2; k++) {
            hinge[k] = kt_loop_of(k == 0 ? "middle" : "top", KT_LOOP_REVOLUTE);
            hinge[k].axis = kt_vec3_make(0.0, 0.0, 1.0);
            hinge[k].between[0].at = hinge[k].between[1].at = kt_vec3_make(0.0, 0.0, (k + 1.0) * size);
            hinge[k].between[1].body = "door";
        }
        kt_description d = kt_description_of(&door, 1, hinge, 2, NULL, 0);
        d.gravity = kt_vec3_make(0.0, 0.0, -weight);
        const kt_model *model = kt_test_model(&d, NULL);
        kt_need_fine("reactions",
                     kt_reaction_evaluate(model, kt_test_data(model), 0.0, &q, &v, NULL, NULL, joints, loops, &e), &e);
        for (int k = 0; k < 2; k++) {
            right[k] = n == 0 ? loops[k] : right[k];
            const kt_vec3 force = kt_vec3_sub(loops[k].force, right[k].force);
            const kt_vec3 moment = kt_vec3_sub(kt_vec3_scale(1.0 / size, loops[k].moment), right[k].moment);
            kt_worst_below(&worst, (kt_vec3_norm(force) + kt_vec3_norm(moment)) / weight, 1e-12, "size %g, hinge %d",
                           size, k);
        }
    }
    kt_check_above("the hinges share the load", kt_vec3_norm(right[0].force), 1.0);
}
