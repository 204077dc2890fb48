/* Attributes of URDF: numbers, and the faults of texts that are none. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/urdf.h"

#include <math.h>
#include <string.h>

/* ---- attributes -------------------------------------------------------------------------------------------------- */

/* Reads an attribute of numbers; without it, values stay as they are. Returns whether there are numbers now. */
bool kt_urdf_numbers(kt_reader *r, const kt_element *e, const char *name, int count, double *values) {
    static const char *const words[] = {"no numbers", "a number", "two numbers", "three numbers", "four numbers"};
    double read[4];
    const char *text = e != NULL ? kt_xml_attribute(e, name) : NULL;
    if (text == NULL)
        return false;
    if (kt_parse_numbers(text, count, read) != count)
        return kt_robot_fault(r, e, "%s: expected %s, found '%.60s'", name, words[count], text);
    memcpy(values, read, (size_t)count * sizeof *values);
    return true;
}

void kt_urdf_need_number(kt_reader *r, const kt_element *e, const char *name, double *value) {
    if (kt_xml_attribute(e, name) == NULL)
        (void)kt_robot_fault(r, e, "the attribute '%s' is missing", name);
    else
        (void)kt_urdf_numbers(r, e, name, 1, value);
}

kt_vec3 kt_urdf_vector(kt_reader *r, const kt_element *e, const char *name, kt_vec3 standard) {
    double v[3] = {standard.x, standard.y, standard.z};
    (void)kt_urdf_numbers(r, e, name, 3, v);
    return kt_vec3_make(v[0], v[1], v[2]);
}

bool kt_urdf_bound(kt_reader *r, const kt_element *e, const char *name, double *value) {
    const char *text = kt_xml_attribute(e, name);
    if (text == NULL)
        return false;
    if (kt_parse_bounds(text, 1, value) != 1)
        return kt_robot_fault(r, e, "%s: expected a number or inf, found '%.60s'", name, text);
    return true;
}

/* The place and the rotation of an element's `origin`. Version 1.1 of the format has quaternions x y z w, of which the
 * length has no meaning. */
kt_pose kt_urdf_origin(kt_reader *r, const kt_element *e, kt_rotation *rotation) {
    const kt_vec3 zero = kt_vec3_make(0.0, 0.0, 0.0);
    const kt_element *origin = kt_xml_child(e, "origin");
    const kt_vec3 at = kt_urdf_vector(r, origin, "xyz", zero), rpy = kt_urdf_vector(r, origin, "rpy", zero);
    double x[4] = {0.0, 0.0, 0.0, 1.0};
    *rotation = (kt_rotation){.type = KT_ROTATION_NONE};
    if (rpy.x != 0.0 || rpy.y != 0.0 || rpy.z != 0.0)
        *rotation = kt_rotation_rpy(rpy.x, rpy.y, rpy.z);
    if (kt_urdf_numbers(r, origin, "quat_xyzw", 4, x)) {
        const kt_quat q = kt_quat_make(x[3], x[0], x[1], x[2]);
        const double norm = kt_quat_norm_squared(q);
        if (kt_xml_attribute(origin, "rpy") != NULL)
            (void)kt_robot_fault(r, origin, "rpy and quat_xyzw both give the rotation; leave one of them out");
        else if (!(norm > 0.0) || !isfinite(norm))
            (void)kt_robot_fault(r, origin, "quat_xyzw: the length is %g; it must be above zero", sqrt(norm));
        else
            *rotation = kt_rotation_of_matrix(kt_mat3_from_quat(q));
    }
    return (kt_pose){.rotation = kt_mat3_of_rotation(rotation), .position = at};
}
