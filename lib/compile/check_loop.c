/* Rules of the loops: which members each type reads, and what these must be. */
#include "compile/compile.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>

enum {
    ENDS = 1,
    AXIS = 2,
    AXIS2 = 4,
    PITCH = 8,
    LENGTH = 16, /* function, under the key `length` */
    MOTION = 32, /* joint, and function under the key `position` */
    TERMS = 64,
    RADIUS = 128
};

static const unsigned reads[KT_LOOP_TYPE_COUNT] = {
    [KT_LOOP_SPHERICAL] = ENDS,
    [KT_LOOP_INLINE] = ENDS | AXIS,
    [KT_LOOP_INPLANE] = ENDS | AXIS,
    [KT_LOOP_DISTANCE] = ENDS | LENGTH,
    [KT_LOOP_PARALLEL] = ENDS,
    [KT_LOOP_COAXIAL] = ENDS | AXIS,
    [KT_LOOP_ORTHOGONAL] = ENDS | AXIS | AXIS2,
    [KT_LOOP_REVOLUTE] = ENDS | AXIS,
    [KT_LOOP_PRISMATIC] = ENDS | AXIS,
    [KT_LOOP_SCREW] = ENDS | AXIS | PITCH,
    [KT_LOOP_CYLINDRICAL] = ENDS | AXIS,
    [KT_LOOP_PLANAR] = ENDS | AXIS,
    [KT_LOOP_WELD] = ENDS,
    [KT_LOOP_UNIVERSAL] = ENDS | AXIS | AXIS2,
    [KT_LOOP_COUPLING] = TERMS,
    [KT_LOOP_MOTION] = MOTION,
    [KT_LOOP_ROLLING] = ENDS | AXIS | AXIS2 | RADIUS,
};

/* A sum of distinct scalar joints, not all of them times zero. */
static void check_terms(kt_checker *checker, const kt_loop *loop) {
    if (loop->term_count < 1 || loop->terms == NULL) {
        kt_checker_fault(checker, "coefficients", -1, "coefficients are missing; give each joint its own");
        return;
    }
    const int stamp = ++checker->stamp;
    double most = 0.0;
    bool fine = true;
    for (int i = 0; i < loop->term_count; i++) {
        const kt_term *term = &loop->terms[i];
        const int body = kt_checker_scalar_joint(checker, "coefficients", i, term->joint);
        if (body >= 0 && checker->mark[body] == stamp)
            kt_checker_fault(checker, "coefficients", i, "joint %s stands twice; add up its coefficients",
                             kt_name_quote(term->joint).text);
        if (body >= 0)
            checker->mark[body] = stamp;
        if (!kt_number_is_fine(term->coefficient)) {
            char suffix[KT_NAME_TEXT_SIZE + 8];
            snprintf(suffix, sizeof suffix, " of %s", kt_name_quote(term->joint == NULL ? "" : term->joint).text);
            fine = kt_checker_value(checker, "coefficients", i, suffix, -1, term->coefficient);
        }
        most = fmax(most, fabs(term->coefficient));
    }
    if (fine && !(most >= 1.0 / KT_NUMBER_MOST))
        kt_checker_fault(checker, "coefficients", -1, "coefficients are all zero, or next to it; give one that is not");
    kt_checker_number(checker, "offset", loop->offset);
}

void kt_checker_loop(kt_checker *checker, const kt_loop *loop) {
    kt_checker_name(checker, KT_SCOPE_LOOP, "loops", loop->name, false);
    if (kt_loop_type_name(loop->type) == NULL) {
        kt_checker_fault(checker, "type", -1,
                         "type is %d, and there is no loop of that number; take one of kt_loop_type", (int)loop->type);
        return;
    }
    const unsigned what = reads[loop->type];
    if (what & ENDS)
        kt_checker_ends(checker, loop->between);
    if (what & AXIS)
        kt_checker_axis(checker, "axis", loop->axis);
    if (what & AXIS2)
        kt_checker_axis(checker, "axis2", loop->axis2);
    if (what & PITCH)
        kt_checker_number(checker, "pitch", loop->pitch);
    if (what & LENGTH)
        kt_checker_positive_function(checker, "length", &loop->function);
    if (what & MOTION) {
        kt_checker_scalar_joint(checker, "joint", -1, loop->joint);
        if (loop->function.type == KT_FUNCTION_NONE)
            kt_checker_fault(checker, "position", -1, "position is missing; give the joint's motion in time");
        else
            kt_checker_function(checker, "position", &loop->function);
    }
    if (what & TERMS)
        check_terms(checker, loop);
    if (what & RADIUS)
        kt_checker_positive(checker, "radius", loop->radius);
}
