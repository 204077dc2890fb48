/* Numbers, words and poses in elements of SDF. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <math.h>
#include <string.h>
#include <strings.h>

const char *kt_sdf_text(const kt_element *e, const char *child) {
    const kt_element *found = e != NULL ? kt_xml_child(e, child) : NULL;
    return found != NULL ? found->text : NULL;
}

bool kt_sdf_numbers(kt_sdf *m, const kt_element *e, const char *child, int count, double *values) {
    double read[7];
    const kt_element *found = e != NULL ? kt_xml_child(e, child) : NULL;
    if (found == NULL)
        return false;
    const char *text = found->text != NULL ? found->text : "";
    if (kt_parse_numbers(text, count, read) != count)
        return kt_robot_fault(m->r, found, "expected %d number%s, found '%.60s'", count, count > 1 ? "s" : "", text);
    memcpy(values, read, (size_t)count * sizeof *values);
    return true;
}

double kt_sdf_number(kt_sdf *m, const kt_element *e, const char *child, double standard) {
    (void)kt_sdf_numbers(m, e, child, 1, &standard);
    return standard;
}

kt_vec3 kt_sdf_vector(kt_sdf *m, const kt_element *e, const char *child, kt_vec3 standard) {
    double v[3] = {standard.x, standard.y, standard.z};
    (void)kt_sdf_numbers(m, e, child, 3, v);
    return kt_vec3_make(v[0], v[1], v[2]);
}

bool kt_sdf_is_true(kt_sdf *m, const kt_element *e, const char *text) {
    if (strcasecmp(text, "true") == 0 || strcmp(text, "1") == 0)
        return true;
    if (strcasecmp(text, "false") != 0 && strcmp(text, "0") != 0)
        (void)kt_robot_fault(m->r, e, "expected true or false, found '%.40s'", text);
    return false;
}

bool kt_sdf_flag(kt_sdf *m, const kt_element *e, const char *child, bool standard) {
    const char *text = kt_sdf_text(e, child);
    return text != NULL ? kt_sdf_is_true(m, kt_xml_child(e, child), text) : standard;
}

/* Six numbers, x y z roll pitch yaw, or seven, with a quaternion x y z w. */
kt_pose kt_sdf_read_pose(kt_sdf *m, const kt_element *pose) {
    kt_pose read = kt_pose_identity();
    double v[7];
    if (pose == NULL || pose->text == NULL)
        return read;
    const char *format = kt_xml_attribute(pose, "rotation_format"), *degrees = kt_xml_attribute(pose, "degrees");
    const bool is_quaternion = kt_text_is(format, "quat_xyzw");
    const double angle = degrees != NULL && kt_sdf_is_true(m, pose, degrees) ? 3.14159265358979323846 / 180.0 : 1.0;
    const int count = is_quaternion ? 7 : 6;
    if (format != NULL && !is_quaternion && strcmp(format, "euler_rpy") != 0)
        (void)kt_robot_fault(m->r, pose, "rotation_format: there is no '%.40s'; it is euler_rpy or quat_xyzw", format);
    if (kt_parse_numbers(pose->text, count, v) != count) {
        (void)kt_robot_fault(m->r, pose, "expected %d numbers, found '%.60s'", count, pose->text);
        return read;
    }
    read.position = kt_vec3_make(v[0], v[1], v[2]);
    if (!is_quaternion) {
        read.rotation = kt_mat3_from_rpy(kt_vec3_make(angle * v[3], angle * v[4], angle * v[5]));
        return read;
    }
    const kt_quat q = kt_quat_make(v[6], v[3], v[4], v[5]);
    if (kt_quat_norm_squared(q) > 0.0 && isfinite(kt_quat_norm_squared(q)))
        read.rotation = kt_mat3_from_quat(kt_quat_normalize(q));
    else
        (void)kt_robot_fault(m->r, pose, "the norm of the quaternion is zero or too large");
    return read;
}
