/* Attributes of URDF: numbers, and the faults of texts that are none. */
#include "robot/urdf.h"

#include <string.h>

/* ---- attributes -------------------------------------------------------------------------------------------------- */

/* Reads an attribute of numbers; without it, values stay as they are. Returns whether there are numbers now. */
bool kt_urdf_numbers(kt_reader *r, const kt_element *e, const char *name, int count, double *values) {
    double read[3];
    const char *text = e != NULL ? kt_xml_attribute(e, name) : NULL;
    if (text == NULL)
        return false;
    if (kt_parse_numbers(text, count, read) != count)
        return kt_robot_fault(r, e, "%s: expected %s, found '%.60s'", name, count == 1 ? "a number" : "three numbers",
                              text);
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

/* The place and the rotation of an element's `origin`. */
void kt_urdf_origin(kt_reader *r, const kt_element *e, kt_vec3 *at, kt_vec3 *rpy) {
    const kt_vec3 zero = kt_vec3_make(0.0, 0.0, 0.0);
    const kt_element *origin = kt_xml_child(e, "origin");
    *at = kt_urdf_vector(r, origin, "xyz", zero);
    *rpy = kt_urdf_vector(r, origin, "rpy", zero);
}
