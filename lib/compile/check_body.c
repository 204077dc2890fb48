/* Rules of a body: its joint, mass, inertia and markers. Its place in the tree is check.c's. */
#include "compile/compile.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>

/* Two axes of a universal joint whose sine is smaller are taken for parallel: their joint would turn about one axis to
 * half the digits of a double. */
static const double least_sine = 1e-8;

static void check_universal(kt_checker *checker, const kt_joint *joint, bool axis_is_fine) {
    if (joint->axis2.x == 0.0 && joint->axis2.y == 0.0 && joint->axis2.z == 0.0) /* not given */
        return;
    if (!kt_checker_axis(checker, "joint.axis2", joint->axis2) || !axis_is_fine)
        return;
    const kt_vec3 n = kt_vec3_cross(kt_vec3_normalize(joint->axis), kt_vec3_normalize(joint->axis2));
    if (!(kt_vec3_norm(n) >= least_sine))
        kt_checker_fault(checker, "joint.axis2", -1,
                         "joint.axis2 is parallel to joint.axis; turn it away (default: the axis after joint.axis)");
}

/* A quaternion among the initial coordinates; four zeros stand for no rotation. */
static void check_quaternion(kt_checker *checker, const double *q) {
    const kt_quat quat = {q[0], q[1], q[2], q[3]};
    const double norm = sqrt(kt_quat_norm_squared(quat)); /* numbers are within 1e50; tiny ones are far from 1 anyway */
    if (q[0] == 0.0 && q[1] == 0.0 && q[2] == 0.0 && q[3] == 0.0)
        return;
    if (!(fabs(norm - 1.0) <= 1e-3))
        kt_checker_fault(checker, "joint.position", -1,
                         "joint.position: the quaternion [%g, %g, %g, %g] has norm %.6g; it must be 1 within 0.001",
                         q[0], q[1], q[2], q[3], norm);
}

static void check_coordinates(kt_checker *checker, const kt_joint *joint) {
#define JOINT_NQ(id, name, nq, nv) nq,
#define JOINT_NV(id, name, nq, nv) nv,
    static const int positions[] = {KT_JOINT_LIST(JOINT_NQ)};
    static const int velocities[] = {KT_JOINT_LIST(JOINT_NV)};
    const int nq = positions[joint->type], nv = velocities[joint->type];
    bool fine;
    if (nq == 1)
        fine = kt_checker_number(checker, "joint.position", joint->position[0]);
    else
        fine = kt_checker_values(checker, "joint.position", -1, "", joint->position, nq);
    if (fine && joint->type == KT_JOINT_SPHERICAL)
        check_quaternion(checker, joint->position);
    if (fine && joint->type == KT_JOINT_FREE)
        check_quaternion(checker, joint->position + 3);
    if (nv == 1)
        kt_checker_number(checker, "joint.velocity", joint->velocity[0]);
    else
        kt_checker_values(checker, "joint.velocity", -1, "", joint->velocity, nv);
}

static bool has_axis(kt_joint_type type) {
    return type != KT_JOINT_FIXED && type != KT_JOINT_SPHERICAL && type != KT_JOINT_FREE;
}

static void check_joint(kt_checker *checker, const kt_joint *joint) {
    const bool is_known = kt_joint_type_name(joint->type) != NULL;
    if (!is_known)
        kt_checker_fault(checker, "joint.type", -1,
                         "joint.type is %d, and there is no joint of that number; take one of kt_joint_type",
                         (int)joint->type);
    if (is_known && has_axis(joint->type)) {
        const bool fine = kt_checker_axis(checker, "joint.axis", joint->axis);
        if (joint->type == KT_JOINT_UNIVERSAL)
            check_universal(checker, joint, fine);
        if (joint->type == KT_JOINT_SCREW)
            kt_checker_number(checker, "joint.pitch", joint->pitch);
    }
    kt_checker_vector(checker, "joint.at", -1, "", joint->at);
    kt_checker_rotation(checker, "joint.rotation", -1, "", &joint->rotation);
    if (is_known)
        check_coordinates(checker, joint);
}

/* A mass of zero may have an inertia: a rotor whose mass is counted elsewhere. */
static void check_mass(kt_checker *checker, double mass) {
    if (kt_checker_not_negative(checker, "mass", "", mass) && mass != 0.0 && mass < KT_MASS_LEAST)
        kt_checker_fault(checker, "mass", -1, "mass is %g, too small to compute with; give 0, or %g or more", mass,
                         KT_MASS_LEAST);
}

/* The triangle inequality is broken. */
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
