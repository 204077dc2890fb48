/* The check of stops and contacts: elastic, with a stiffness, or hard, with a restitution (compile/one_sided.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "model/relative.h"

/* Rejects an effect in a coordinate of a loop. The effect is a loop in the model, and loops relate only the coordinates
 * of joints. */
static void reject_coordinate_of_loop(kt_checker *checker, const kt_effect *effect, const char *what,
                                      const char *remedy) {
    const kt_description *d = checker->description;
    if (effect->joint == NULL)
        return;
    const kt_coordinate_name name = kt_coordinate_name_of(effect->joint);
    for (int i = 0; i < d->body_count; i++)
        if (kt_coordinate_is_of(effect->joint, name, kt_joint_name_of(&d->bodies[i])))
            return;
    if (kt_coordinate_loop(d, effect->joint, 0) >= 0)
        kt_checker_fault(checker, "joint", -1, "%s is a coordinate of a loop; %s acts in one of a joint: %s",
                         kt_name_quote(effect->joint).text, what, remedy);
}

/* Rejects a number that only an elastic contact or stop has. */
static void reject_elastic(kt_checker *checker, const char *key, double value, const char *what) {
    if (value > 0.0)
        kt_checker_fault(checker, key, -1, "a hard %s (restitution) has no %s; leave one of the two out", what, key);
}

void kt_effect_check_hard(kt_checker *checker, const kt_effect *effect, const char *what) {
    if (!kt_effect_is_hard(effect)) {
        if (effect->stiffness == 0.0)
            kt_checker_fault(checker, "stiffness", -1,
                             "stiffness is 0 or missing; give it, or a restitution for a hard %s", what);
        if (effect->poisson)
            kt_checker_fault(checker, "poisson", -1, "Poisson's rule is for a hard %s; give a restitution", what);
        return;
    }
    const bool is_limit = effect->type == KT_EFFECT_JOINT_LIMIT;
    reject_elastic(checker, "stiffness", effect->stiffness, what);
    if (effect->restitution > 1.0 && kt_number_is_fine(effect->restitution))
        kt_checker_fault(checker, "restitution", -1, "restitution is %g; it must be 0 to 1", effect->restitution);
    if (is_limit)
        reject_coordinate_of_loop(checker, effect, "a hard stop (restitution)", "give a stiffness instead");
    if (is_limit)
        reject_elastic(checker, "damping", effect->damping, what);
    else
        reject_elastic(checker, "dissipation", effect->dissipation, what);
    if (!is_limit && (effect->rolling > 0.0 || effect->torsion > 0.0))
        kt_checker_fault(checker, effect->rolling > 0.0 ? "rolling" : "torsion", -1,
                         "a hard contact has no rolling or torsional friction; give a stiffness in place of the "
                         "restitution, or leave %s out",
                         effect->rolling > 0.0 ? "`rolling`" : "`torsion`");
    if (!is_limit && effect->slip != kt_effect_default().slip)
        kt_checker_fault(checker, "slip", -1, "friction of a hard contact is not smoothed; leave `slip` out");
}

void kt_effect_check_stick(kt_checker *checker, const kt_effect *effect) {
    reject_coordinate_of_loop(checker, effect, "friction that sticks", "leave `stick` out");
    if (effect->coulomb == 0.0 && !kt_effect_has_load(effect))
        kt_checker_fault(checker, "coulomb", -1,
                         "coulomb is 0; give the friction of slip (coulomb, coefficient or efficiency), or leave "
                         "`stick` out");
    if (effect->smoothing != kt_effect_default().smoothing)
        kt_checker_fault(checker, "smoothing", -1,
                         "friction that sticks is not smoothed; leave `smoothing` or `stick` out");
}
