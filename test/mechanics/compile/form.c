/* The form of a constraint group: the expected forms of some mechanisms, with the reason. A form that is excluded is
 * not chosen, and accelerations stay the same but for rounding. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include <math.h>
#include <stdio.h>

enum { WINDOWS = 10, RODS = 20 };

static void build_four_bar(linkage *l) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
}

static void build_geared_four_bar(linkage *l) {
    build_four_bar(l);
    l->body[0].joint.armature[0] = 0.5;
}

static void build_windows(linkage *l) { linkage_windows(l, WINDOWS, 0.7, 0.3, KT_LOOP_REVOLUTE); }

/* Rods that hang between two points; a heavy one every other time. */
static void hang(linkage *l, double ratio) {
    linkage_begin(l);
    for (int i = 0; i < RODS; i++) {
        char name[16];
        (void)snprintf(name, sizeof name, "rod%d", i);
        kt_body *rod = linkage_bar(l, name, i ? l->body_name[i - 1] : NULL, kt_vec3_make(i ? 1.0 : 0.0, 0.0, 0.0),
                                   kt_vec3_make(1.0, 0.0, 0.0), i ? -2.0 / RODS : 1.0, 0.1 * (i % 7));
        rod->mass = i % 2 ? 1.0 : ratio;
        rod->inertia.xx = rod->inertia.yy = rod->inertia.zz = 0.1 * rod->mass;
    }
    (void)linkage_close(l, "held", KT_LOOP_REVOLUTE, l->body_name[RODS - 1], kt_vec3_make(1.0, 0.0, 0.0), NULL,
                        kt_vec3_make(0.8 * RODS, 0.0, 0.0));
}

static void build_rope(linkage *l) { hang(l, 1.0); }
static void build_uneven_rope(linkage *l) { hang(l, 1e9); }

static void build_bricard(linkage *l) { linkage_bricard(l); }

typedef struct subject {
    const char *name;
    void (*build)(linkage *l);
    kt_group_form form, without; /* as chosen; and if that is excluded: of so few links dense matrices */
    double bound;                /* of the difference of both: measured, times 8 or so */
    const char *reason;
} subject;

static const subject subjects[] = {
    {"four-bar", build_four_bar, KT_FORM_PIN, KT_FORM_DENSE, 1e-14, "one pin closes three coordinates in a plane"},
    {"four-bar with armature", build_geared_four_bar, KT_FORM_DENSE, KT_FORM_DENSE, 0.0,
     "one pin closes three coordinates, but a joint has armature"},
    {"windows", build_windows, KT_FORM_FRONT4, KT_FORM_DENSE, 1e-14,
     "four parameters or fewer pass from link to link in a plane"},
    {"rope", build_rope, KT_FORM_DELASSUS, KT_FORM_DENSE, 1e-11, "one to four equations hold many links on the ground"},
    {"uneven rope", build_uneven_rope, KT_FORM_FRONT, KT_FORM_FRONT, 0.0,
     "its few equations alone would lose digits where heavy links hang on light ones"},
    {"Bricard's", build_bricard, KT_FORM_DENSE, KT_FORM_DENSE, 0.0,
     "dense matrices of its coordinates take the fewest operations"},
};

KT_TEST(known_mechanisms_have_the_form_that_suits_them_and_say_why) {
    static linkage l;
    for (size_t i = 0; i < sizeof subjects / sizeof *subjects; i++) {
        subjects[i].build(&l);
        linkage_compile(&l);
        const kt_loop_group group = kt_loop_group_at(l.model, 0);
        kt_check_equal_int(subjects[i].name, (int)group.form, (int)subjects[i].form);
        kt_check_text(subjects[i].name, group.reason, subjects[i].reason);
    }
}

KT_TEST(form_that_is_excluded_is_not_chosen_and_accelerations_stay) {
    static linkage l, other;
    for (size_t i = 0; i < sizeof subjects / sizeof *subjects; i++) {
        double a[LINKAGE_NQ], b[LINKAGE_NQ], most = 0.0, off = (double)NAN;
        kt_error e = {0};
        subjects[i].build(&l);
        subjects[i].build(&other);
        other.options.excluded_forms = 1u << subjects[i].form & ~1u;
        linkage_build(&l, 0.0);
        linkage_build(&other, 0.0);
        linkage_accelerate(&l, 0.0, a);
        kt_need_fine(subjects[i].name,
                     kt_acceleration_evaluate(other.model, other.data, 0.0, l.q, l.v, NULL, NULL, b, &e), &e);
        kt_check_equal_int(subjects[i].name, (int)kt_loop_group_at(other.model, 0).form, (int)subjects[i].without);
        off = 0.0;
        for (int k = 0; k < l.nv; k++) {
            most = fmax(most, fabs(a[k]));
            off = fmax(off, fabs(a[k] - b[k]));
        }
        kt_check_below(subjects[i].name, off / most, subjects[i].bound);
    }
}

KT_TEST(bits_beyond_the_forms_are_rejected) {
    static linkage l;
    kt_model *model = NULL;
    kt_error error = {0};
    build_four_bar(&l);
    linkage_compile(&l);
    kt_model_options options = kt_model_options_default();
    options.excluded_forms = 1u << KT_GROUP_FORM_COUNT;
    kt_check_equal_int("status", kt_model_compile(&l.description, &options, &model, &error), KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "options.excluded_forms");
    kt_check_true("untouched", model == NULL);
}
