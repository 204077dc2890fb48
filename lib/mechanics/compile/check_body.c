/* Rules for a body: its joint and markers. The rules for its mass properties are in mass_properties.c, the rules for
 * its position in the tree are in check_description.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"
#include "joint/joint.h"

#include <math.h>
#include <stdio.h>

bool kt_joint_is_limited(const kt_joint *joint) {
    const kt_joint_limits l = joint->limits;
    const double none = (double)INFINITY;
    return !(l.lower == -none && l.upper == none && l.velocity == none && l.effort == none);
}

static void check_joint_limits(kt_checker *checker, const kt_joint *joint) {
    const kt_joint_limits l = joint->limits;
    const int nq = kt_joint_sizes[joint->type].nq;
    if (nq != 1)
        kt_checker_fault(checker, "joint.limits", -1,
                         "joint.limits are those of a joint with one coordinate, and a %s joint has %d; leave them out",
                         kt_joint_type_name(joint->type), nq);
    else if (!(l.lower <= l.upper))
        kt_checker_fault(checker, "joint.limits", -1,
                         "joint.limits.lower is %g, and joint.limits.upper is %g; lower must not be above upper",
                         l.lower, l.upper);
    else if (!(l.velocity >= 0.0))
        kt_checker_fault(checker, "joint.limits", -1, "joint.limits.velocity is %g; it cannot be negative", l.velocity);
    else if (!(l.effort >= 0.0))
        kt_checker_fault(checker, "joint.limits", -1, "joint.limits.effort is %g; it cannot be negative", l.effort);
}

static void check_body_joint(kt_checker *checker, const kt_joint *joint) {
    kt_checker_name(checker, KT_NAMES_OF_JOINTS, "the joint of bodies", joint->name, true);
    if (kt_joint_type_name(joint->type) == NULL) {
        kt_checker_fault(checker, "joint.type", -1,
                         "joint.type is %d, and there is no joint of that number; take one of kt_joint_type",
                         (int)joint->type);
        return;
    }
    kt_joint_check(checker, joint);
    if (kt_joint_is_limited(joint))
        check_joint_limits(checker, joint);
}

static void check_body_markers(kt_checker *checker, const kt_body *body) {
    if (body->marker_count < 0)
        kt_checker_fault(checker, "markers", -1, "marker_count is %d; it cannot be negative", body->marker_count);
    else if (body->marker_count > 0 && body->markers == NULL)
        kt_checker_fault(checker, "markers", -1, "markers is NULL, and marker_count is %d", body->marker_count);
    for (int i = 0; i < kt_checker_marker_count(body) && !kt_checker_is_done(checker); i++) {
        const kt_marker *marker = &body->markers[i];
        const char *name = marker->name != NULL ? marker->name : "";
        const kt_name_text quoted = kt_name_quote(name);
        const int first = kt_names_find(&checker->names, checker->index, name);
        if (name[0] == '\0')
            kt_checker_fault(checker, "markers", i, "markers[%d] has no name; give it one", i);
        else if (!kt_name_is_valid(name))
            kt_checker_fault(
                checker, "markers", i,
                "marker name %s is not valid; begin with a letter or _, go on with letters, digits, _ and -",
                quoted.text);
        else if (first != i)
            kt_checker_fault(checker, "markers", i,
                             "marker %s is given twice, first as markers[%d]; choose another name", quoted.text, first);
        char suffix[KT_NAME_TEXT_SIZE + 8];
        snprintf(suffix, sizeof suffix, " %s", name[0] != '\0' ? quoted.text : "");
        kt_checker_vector(checker, "markers", i, suffix, marker->at);
        kt_checker_rotation(checker, "markers", i, suffix, &marker->rotation);
    }
}

void kt_checker_body_rules(kt_checker *checker, const kt_body *body) {
    check_body_joint(checker, &body->joint);
    kt_checker_mass(checker, body);
    kt_checker_variable_mass(checker, body);
    check_body_markers(checker, body);
}
