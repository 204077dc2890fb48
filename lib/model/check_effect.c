/* Rules of the effects: which members each type reads, and what these must be. */
#include "model/check.h"

#include <stddef.h>

enum { ENDS = 1, JOINT = 2, STIFFNESS = 4, LENGTH = 8, DAMPING = 16, TORQUE = 32, FORCE = 64 };

static const unsigned reads[KT_EFFECT_TYPE_COUNT] = {
    [KT_EFFECT_SPRING] = ENDS | STIFFNESS | LENGTH | DAMPING,
    [KT_EFFECT_JOINT_DAMPER] = JOINT | DAMPING,
    [KT_EFFECT_MOTOR] = JOINT | TORQUE,
    [KT_EFFECT_FORCE] = FORCE,
};

static void check_force(kt_checker *checker, const kt_effect *effect) {
    kt_checker_end(checker, "at", &effect->between[0]);
    for (int k = 0; k < 3; k++) {
        if (effect->value[k].type == KT_FUNCTION_NONE)
            kt_checker_fault(checker, "value", -1, "value has a component missing; give three numbers or functions");
        else
            kt_checker_function(checker, "value", &effect->value[k]);
    }
    if (effect->frame != KT_FRAME_WORLD && effect->frame != KT_FRAME_BODY)
        kt_checker_fault(checker, "frame", -1, "frame is %d; take KT_FRAME_WORLD or KT_FRAME_BODY", (int)effect->frame);
}

void kt_checker_effect(kt_checker *checker, const kt_effect *effect) {
    kt_checker_name(checker, KT_SCOPE_EFFECT, "effects", effect->name, true);
    if (kt_effect_type_name(effect->type) == NULL) {
        kt_checker_fault(checker, "type", -1, "type is %d, and there is no effect of that number", (int)effect->type);
        return;
    }
    const unsigned what = reads[effect->type];
    if (what & ENDS)
        kt_checker_ends(checker, effect->between);
    if (what & JOINT)
        kt_checker_scalar_joint(checker, "joint", -1, effect->joint);
    if (what & STIFFNESS)
        kt_checker_not_negative(checker, "stiffness", "", effect->stiffness);
    if ((what & LENGTH) && !effect->initial_length)
        kt_checker_not_negative(checker, "length", "", effect->length);
    if (what & DAMPING)
        kt_checker_not_negative(checker, "damping", "", effect->damping);
    if (what & FORCE)
        check_force(checker, effect);
    if (what & TORQUE) {
        if (effect->torque.type == KT_FUNCTION_NONE)
            kt_checker_fault(checker, "torque", -1, "torque is missing; give a number or a function of time");
        else
            kt_checker_function(checker, "torque", &effect->torque);
    }
}
