/* Rules for a body: its joint, mass, inertia and markers. The rules for its place in the tree are in check.c. */
#include "compile/compile.h"
#include "joint/joint.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>

static void check_joint(kt_checker *checker, const kt_joint *joint) {
    if (kt_joint_type_name(joint->type) == NULL)
        kt_checker_fault(checker, "joint.type", -1,
                         "joint.type is %d, and there is no joint of that number; take one of kt_joint_type",
                         (int)joint->type);
    else
        kt_joint_check(checker, joint);
}

/* A body without mass may have an inertia: a rotor whose mass is counted elsewhere. */
static void check_mass(kt_checker *checker, double mass) {
    if (kt_checker_not_negative(checker, "mass", "", mass) && mass != 0.0 && mass < KT_MASS_LEAST)
        kt_checker_fault(checker, "mass", -1, "mass is %g, too small to compute with; give 0, or %g or more", mass,
                         KT_MASS_LEAST);
}

/* Reports that the principal moments violate the triangle inequality. */
static void check_triangle(kt_checker *checker, kt_vec3 m, double excess) {
    const bool little = excess <= KT_INERTIA_EXCESS_MAX;
    if (little && checker->description->inertia_check == KT_INERTIA_WARN)
        return;
    kt_checker_fault(checker, "inertia", -1,
                     "inertia has the principal moments %g, %g, %g; of no body is one larger than the two others "
                     "together: check units and order (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), and that it is about the com%s",
                     m.x, m.y, m.z,
                     little ? "; rounded data that breaks this by up to 1 % is accepted with 'inertia_check: warn'"
                            : "");
}

static void check_inertia(kt_checker *checker, kt_sym3 inertia) {
    const double entries[6] = {inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz};
    double most = 0.0;
    for (int i = 0; i < 6; i++) {
        most = fmax(most, fabs(entries[i]));
        if (!isfinite(entries[i])) {
            kt_checker_value(checker, "inertia", -1, "", i, entries[i]);
            return;
        }
    }
    kt_vec3 m;
    const kt_inertia_fault fault = kt_inertia_check(inertia, &m);
    if (most > KT_INERTIA_MOST)
        kt_checker_fault(checker, "inertia", -1,
                         "inertia has the entry %g, and the equations would overflow; magnitudes end at %g", most,
                         KT_INERTIA_MOST);
    else if (most != 0.0 && most < KT_INERTIA_LEAST)
        kt_checker_fault(checker, "inertia", -1,
                         "inertia is %g at most, too small to compute with; give 0, or %g or more", most,
                         KT_INERTIA_LEAST);
    else if (fault == KT_INERTIA_NEGATIVE)
        kt_checker_fault(checker, "inertia", -1,
                         "inertia has the principal moments %g, %g, %g; none can be negative: check signs and order "
                         "(Ixx, Iyy, Izz, Ixy, Ixz, Iyz)",
                         m.x, m.y, m.z);
    else if (fault == KT_INERTIA_TRIANGLE)
        check_triangle(checker, m, kt_inertia_excess(inertia));
}

static void check_markers(kt_checker *checker, const kt_body *body) {
    if (body->marker_count < 0)
        kt_checker_fault(checker, "markers", -1, "marker_count is %d; it cannot be negative", body->marker_count);
    else if (body->marker_count > 0 && body->markers == NULL)
        kt_checker_fault(checker, "markers", -1, "markers is NULL, and marker_count is %d", body->marker_count);
    for (int i = 0; i < kt_checker_marker_count(body) && !kt_checker_is_done(checker); i++) {
        const kt_marker *marker = &body->markers[i];
        const bool has_name = marker->name != NULL && marker->name[0] != '\0';
        if (!has_name)
            kt_checker_fault(checker, "markers", i, "markers[%d] has no name; give it one", i);
        else if (!kt_name_is_valid(marker->name))
            kt_checker_fault(
                checker, "markers", i,
                "marker name %s is not valid; begin with a letter or _, go on with letters, digits, _ and -",
                kt_name_quote(marker->name).text);
        else if (kt_names_find(&checker->names, checker->index, marker->name) != i)
            kt_checker_fault(checker, "markers", i, "marker %s stands twice, first as markers[%d]; choose another name",
                             kt_name_quote(marker->name).text,
                             kt_names_find(&checker->names, checker->index, marker->name));
        if (kt_number_is_fine(marker->at.x) && kt_number_is_fine(marker->at.y) && kt_number_is_fine(marker->at.z))
            continue;
        char suffix[KT_NAME_TEXT_SIZE + 8];
        snprintf(suffix, sizeof suffix, " %s", has_name ? kt_name_quote(marker->name).text : "");
        kt_checker_vector(checker, "markers", i, suffix, marker->at);
    }
}

void kt_checker_mass(kt_checker *checker, const kt_body *body) {
    check_mass(checker, body->mass);
    if (!body->com_of_shape)
        kt_checker_vector(checker, "com", -1, "", body->com);
    if (!body->inertia_of_shape)
        check_inertia(checker, body->inertia);
    kt_checker_shape(checker, &body->shape);
    if (body->shape.type == KT_SHAPE_NONE && (body->com_of_shape || body->inertia_of_shape))
        kt_checker_fault(checker, "shape", -1, "%s to be that of the shape, and there is none; give a shape or the %s",
                         body->com_of_shape ? "com is" : "inertia is", body->com_of_shape ? "com" : "inertia");
}

void kt_checker_body_rules(kt_checker *checker, const kt_body *body) {
    check_joint(checker, &body->joint);
    kt_checker_mass(checker, body);
    check_markers(checker, body);
}
