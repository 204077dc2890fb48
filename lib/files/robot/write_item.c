/* Parts that both formats write: numbers, texts, joints of several coordinates as several joints, solids, masses. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot.h"
#include "robot/write.h"

#include <string.h>

/* ---- text -------------------------------------------------------------------------------------------------------- */

/* Writes a piece of a format as it is. In an argument, special characters are replaced; a character that XML does not
 * have becomes '?'. */
static void write_piece(void *user, const char *text, size_t length, bool is_argument) {
    const kt_export *x = user;
    for (size_t i = 0; i < length; i++)
        if (is_argument && text[i] == '<')
            fputs("&lt;", x->stream);
        else if (is_argument && text[i] == '&')
            fputs("&amp;", x->stream);
        else if (is_argument && text[i] == '"')
            fputs("&quot;", x->stream);
        else
            fputc(is_argument && (unsigned char)text[i] < ' ' ? '?' : text[i], x->stream);
}

void kt_export_print(kt_export *x, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    kt_print_pieces(write_piece, x, format, arguments);
    va_end(arguments);
}

void kt_export_numbers(kt_export *x, const char *name, const double *values, int count) {
    kt_export_print(x, " %s=\"", name);
    for (int i = 0; i < count; i++)
        kt_export_print(x, i > 0 ? " %g" : "%g", values[i]);
    kt_export_print(x, "\"");
}

void kt_export_unless_zero(kt_export *x, const char *name, double value) {
    if (value != 0.0)
        kt_export_print(x, " %s=\"%g\"", name, value);
}

void kt_export_vector(kt_export *x, const char *name, kt_vec3 v) {
    kt_export_numbers(x, name, (const double[]){v.x, v.y, v.z}, 3);
}

void kt_export_lose(kt_export *x, const char *what) {
    int i = 0;
    while (i < x->lost_count && strcmp(x->lost[i].what, what) != 0)
        i++;
    if (i == KT_LOST_MOST)
        return;
    if (i == x->lost_count)
        x->lost[x->lost_count++].what = what;
    x->lost[i].count++;
}

/* ---- joints and masses ------------------------------------------------------------------------------------------- */

int kt_export_steps(const kt_joint *joint, kt_export_step steps[KT_EXPORT_STEPS]) {
    const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(joint->axis), 2);
    const kt_vec3 second = joint->axis2;
    const bool has_second = second.x != 0.0 || second.y != 0.0 || second.z != 0.0;
    switch (joint->type) {
    case KT_JOINT_FIXED:
        return 0;
    case KT_JOINT_CYLINDRICAL:
        steps[0] = (kt_export_step){KT_JOINT_REVOLUTE, joint->axis};
        steps[1] = (kt_export_step){KT_JOINT_PRISMATIC, joint->axis};
        return 2;
    case KT_JOINT_UNIVERSAL:
        steps[0] = (kt_export_step){KT_JOINT_REVOLUTE, joint->axis};
        steps[1] = (kt_export_step){KT_JOINT_REVOLUTE, has_second ? second : triad.x};
        return 2;
    case KT_JOINT_PLANAR:
        steps[0] = (kt_export_step){KT_JOINT_PRISMATIC, triad.x};
        steps[1] = (kt_export_step){KT_JOINT_PRISMATIC, triad.y};
        steps[2] = (kt_export_step){KT_JOINT_REVOLUTE, joint->axis};
        return 3;
    default:
        steps[0] = (kt_export_step){joint->type, joint->axis};
        return 1;
    }
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

const kt_expression *kt_export_parse(kt_export *x, const char *text, const kt_symbols *symbols) {
    const size_t size = kt_expression_size(text);
    void *memory = size > 0 ? kt_pool_take(&x->pool, size, 1) : NULL;
    const kt_expression *parsed = NULL;
    kt_symbols without_tables = *symbols; /* no format of robots has tables */
    kt_error ignored;
    without_tables.table_count = 0;
    if (memory == NULL || kt_expression_parse(text, &without_tables, memory, size, &parsed, NULL, &ignored) != KT_OK)
        return NULL;
    return parsed;
}

/* ---- shapes, ends ------------------------------------------------------------------------------------------------ */

static kt_rotation as_rotation(kt_mat3 matrix) {
    const kt_quat q = kt_quat_from_mat3(matrix);
    return kt_rotation_quaternion(q.w, q.x, q.y, q.z);
}

bool kt_export_solid(kt_export *x, kt_shape *shape) {
    kt_vec3 axis = shape->axis;
    kt_mat3 own = kt_mat3_identity();
    if (shape->type == KT_SHAPE_POINT || (shape->type == KT_SHAPE_ROD && !(shape->radius > 0.0))) {
        kt_export_lose(x, "shapes that are points or rods without a radius");
        return false;
    }
    if (shape->type == KT_SHAPE_POLYGON) {
        kt_export_lose(x, "shapes that are polygons");
        return false;
    }
    if (shape->type == KT_SHAPE_ROD) {
        axis = kt_vec3_sub(shape->to, shape->from);
        shape->length = kt_vec3_norm(axis);
        shape->at = kt_vec3_scale(0.5, kt_vec3_add(shape->from, shape->to));
        shape->rotation = (kt_rotation){.type = KT_ROTATION_NONE};
    } else {
        own = kt_mat3_of_rotation(&shape->rotation);
    }
    if (shape->type == KT_SHAPE_ROD || shape->type == KT_SHAPE_CYLINDER) {
        shape->type = KT_SHAPE_CYLINDER;
        if (shape->length > 0.0)
            shape->rotation = as_rotation(kt_mat3_multiply(own, kt_mat3_z_to(kt_vec3_normalize(axis))));
    }
    return true;
}

kt_pose kt_export_end(const kt_export *x, const kt_end *end) {
    const int body = end->marker != NULL ? kt_export_find(x, end->body) : -1;
    const kt_pose own = {.position = end->at, .rotation = kt_mat3_of_rotation(&end->rotation)};
    for (int i = 0; body >= 0 && i < x->d->bodies[body].marker_count; i++) {
        const kt_marker *marker = &x->d->bodies[body].markers[i];
        if (strcmp(marker->name, end->marker) == 0)
            return (kt_pose){.position = marker->at,
                             .rotation = kt_mat3_multiply(kt_mat3_of_rotation(&marker->rotation), own.rotation)};
    }
    return own;
}
