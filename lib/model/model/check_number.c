/* Rules for numbers, directions and rotations in a description. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/check.h"

#include <math.h>
#include <stdio.h>

bool kt_number_is_fine(double value) { return fabs(value) <= KT_NUMBER_MOST; /* false for NaN */ }

/* "joint.position[2]" */
typedef struct number_name {
    char text[128];
} number_name;

static number_name number_name_of(const char *field, const char *suffix, int component) {
    number_name name;
    if (component < 0)
        snprintf(name.text, sizeof name.text, "%s%s", field, suffix);
    else
        snprintf(name.text, sizeof name.text, "%s%s[%d]", field, suffix, component);
    return name;
}

bool kt_checker_value(kt_checker *checker, const char *field, int sub, const char *suffix, int component,
                      double value) {
    if (kt_number_is_fine(value))
        return true;
    const number_name name = number_name_of(field, suffix, component);
    if (isfinite(value))
        kt_checker_fault(checker, field, sub, "%s is %g, and the equations would overflow; magnitudes end at %g",
                         name.text, value, KT_NUMBER_MOST);
    else /* written out, because printf may show the sign of a NaN */
        kt_checker_fault(checker, field, sub, "%s is %s; give a finite number", name.text,
                         isnan(value) ? "nan" : (value > 0.0 ? "inf" : "-inf"));
    return false;
}

bool kt_checker_values(kt_checker *checker, const char *field, int sub, const char *suffix, const double *values,
                       int count) {
    for (int i = 0; i < count; i++)
        if (!kt_checker_value(checker, field, sub, suffix, i, values[i]))
            return false;
    return true;
}

bool kt_checker_number(kt_checker *checker, const char *field, double value) {
    return kt_checker_value(checker, field, -1, "", -1, value);
}

bool kt_checker_vector(kt_checker *checker, const char *field, int sub, const char *suffix, kt_vec3 value) {
    const double values[3] = {value.x, value.y, value.z};
    return kt_checker_values(checker, field, sub, suffix, values, 3);
}

void kt_checker_positive(kt_checker *checker, const char *field, double value) {
    if (kt_checker_number(checker, field, value) && !(value > 0.0))
        kt_checker_fault(checker, field, -1, "%s is %g; it must be greater than 0", field, value);
}

bool kt_checker_not_negative(kt_checker *checker, const char *field, const char *suffix, double value) {
    if (!kt_checker_value(checker, field, -1, suffix, -1, value))
        return false;
    if (value < 0.0) {
        kt_checker_fault(checker, field, -1, "%s%s is %g; it cannot be negative", field, suffix, value);
        return false;
    }
    return true;
}

bool kt_axis_is_fine(kt_vec3 axis) {
    return kt_number_is_fine(axis.x) && kt_number_is_fine(axis.y) && kt_number_is_fine(axis.z) &&
           (axis.x != 0.0 || axis.y != 0.0 || axis.z != 0.0);
}

bool kt_checker_axis(kt_checker *checker, const char *field, kt_vec3 axis) {
    if (!kt_checker_vector(checker, field, -1, "", axis))
        return false;
    if (axis.x == 0.0 && axis.y == 0.0 && axis.z == 0.0) {
        kt_checker_fault(checker, field, -1, "%s is zero; give it a direction, such as [0, 0, 1]", field);
        return false;
    }
    return true;
}

void kt_checker_rotation(kt_checker *checker, const char *field, int sub, const char *suffix,
                         const kt_rotation *rotation) {
    kt_mat3 matrix;
    kt_error error;
    if (kt_rotation_evaluate(rotation, &matrix, &error) != KT_OK)
        kt_checker_fault(checker, field, sub, "%s%s: %s", field, suffix, error.message);
}
