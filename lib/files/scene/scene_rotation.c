/* Rotations: one of seven mappings.
 *
 * A rotation is kept as the file gives it and is evaluated where it is used; here it is only checked. The norm of a
 * quaternion q may be off by 1e-3. The quaternion is divided by its norm unless |q'q - 1| <= 8 eps, with q'q as
 * computed. With u = eps / 2, the relative errors are at most
 *     e(q'q) = 4 u,   e(1 / sqrt(q'q)) = 4 u,   e(component) = 5 u,   e(square) = 10 u,   e(new q'q) = 14 u = 7 eps.
 * The error of 1 / sqrt(q'q) is half of the sum's, plus those of the root and the quotient. A quaternion that has been
 * normalised therefore stays as it is, and reading a written one changes no bit.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/value.h"

#include "kinetree/algebra.h"

#include <float.h>
#include <math.h>
#include <string.h>

void kt_quaternion_settle(double q[4]) {
    const kt_quat given = kt_quat_make(q[0], q[1], q[2], q[3]);
    if (fabs(kt_quat_norm_squared(given) - 1.0) <= 8.0 * DBL_EPSILON)
        return;
    const kt_quat unit = kt_quat_normalize(given);
    q[0] = unit.w;
    q[1] = unit.x;
    q[2] = unit.y;
    q[3] = unit.z;
}

bool kt_read_quaternion(kt_reader *r, const kt_scope *scope, kt_node *node, double out[4]) {
    double q[4];
    if (node->kind != KT_NODE_LIST || node->count != 4)
        return kt_fault_expected(r, scope, node, "a quaternion [w, x, y, z]");
    if (!kt_read_numbers(r, scope, node, 4, KT_QUANTITY_NUMBER, NULL, q))
        return false;
    double norm = kt_hypot(kt_hypot(q[0], q[1]), kt_hypot(q[2], q[3]));
    if (norm == 0.0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "a quaternion of zeros is no rotation; write [1, 0, 0, 0] for none");
    if (!(fabs(norm - 1.0) <= 1e-3))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "a quaternion [w, x, y, z] has the norm 1, this one has %.6g; divide it by that", norm);
    kt_quaternion_settle(q);
    memcpy(out, q, sizeof q);
    return true;
}

/* ---- the seven forms --------------------------------------------------------------------------------------------- */

static bool read_quaternion_form(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                                 void *object) {
    return kt_read_quaternion(r, scope, node, kt_field_in(object, field));
}

static bool read_angles(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_numbers(r, scope, node, 3, KT_QUANTITY_ANGLE, NULL, kt_field_in(object, field));
}

static bool read_matrix(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    if (node->kind != KT_NODE_LIST || node->count != 3)
        return kt_fault_expected(r, scope, node, "a matrix: a list of three rows of three numbers");
    double *out = kt_field_in(object, field);
    bool good = true;
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        good = kt_read_numbers(r, &here, item, 3, KT_QUANTITY_NUMBER, NULL, out + (ptrdiff_t)3 * here.index) && good;
    return good;
}

static bool read_sequence_form(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                               void *object) {
    static const int sequences[] = {121, 123, 131, 132, 212, 213, 231, 232, 312, 313, 321, 323};
    double value;
    if (!kt_read_number(r, scope, node, KT_QUANTITY_NUMBER, &value))
        return false;
    for (int i = 0; i < KT_COUNT_OF(sequences); i++) {
        if (value == sequences[i]) {
            memcpy(kt_field_in(object, field), &sequences[i], sizeof(int));
            return true;
        }
    }
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                       "there is no sequence '%.40s'; it is one of 121 123 131 132 212 213 231 232 312 313 321 323",
                       node->of.text);
}

static void write_matrix(kt_emitter *e, const kt_member *m) { kt_write_points(e, kt_member_value(m), 3, 3); }

static void write_sequence(kt_emitter *e, const kt_member *m) { kt_emit_integer(e, *(const int *)kt_member_value(m)); }

static const kt_kind kind_unit = {.read = read_quaternion_form,
                                  .write = kt_kind_numbers_write,
                                  .size = 4 * sizeof(double)},
                     kind_angles = {.read = read_angles, .write = kt_kind_numbers_write, .size = 3 * sizeof(double)},
                     kind_matrix = {.read = read_matrix, .write = write_matrix},
                     kind_sequence = {.read = read_sequence_form, .write = write_sequence};

static const kt_field euler_fields[] = {
    {.key = "sequence", .kind = &kind_sequence, .offset = offsetof(kt_rotation, sequence), .flags = KT_FIELD_REQUIRED},
    {.key = "angles", .kind = &kind_angles, .offset = offsetof(kt_rotation, value), .flags = KT_FIELD_REQUIRED},
};
static const kt_table euler_table = {
    .fields = euler_fields, .count = 2, .flow = true, .example = "{sequence: 313, angles: [a, b, c]}"};

#define VALUE .offset = offsetof(kt_rotation, value)
static const kt_field form_fields[] = {
    {.key = "quaternion", .kind = &kind_unit, VALUE},
    {.key = "rpy", .kind = &kind_angles, VALUE},
    {.key = "euler", .kind = &kt_kind_map, .detail = &euler_table},
    {.key = "vector", .kind = &kind_angles, VALUE},
    {.key = "cgr", .kind = &kt_kind_vector, VALUE},
    {.key = "matrix", .kind = &kind_matrix, VALUE},
    {.key = "axis", .kind = &kt_kind_axis, VALUE},
    {.key = "angle", .kind = &kt_kind_angle, .offset = offsetof(kt_rotation, value) + 3 * sizeof(double)},
};
static const int form_types[] = {
    KT_ROTATION_QUATERNION, KT_ROTATION_RPY,    KT_ROTATION_EULER,      KT_ROTATION_VECTOR,
    KT_ROTATION_CGR,        KT_ROTATION_MATRIX, KT_ROTATION_AXIS_ANGLE, KT_ROTATION_AXIS_ANGLE,
};
static const kt_table form_table = {.fields = form_fields, .count = KT_COUNT_OF(form_fields)};
static const kt_forms forms = {.several = "rotations",
                               .expected = "a rotation, such as {rpy: [0, 0, 90 deg]}",
                               .missing = "the rotation is missing; give one of quaternion, rpy, euler, vector, cgr, "
                                          "matrix, or axis and angle",
                               .fields = form_fields,
                               .types = form_types,
                               .count = KT_COUNT_OF(form_fields)};

/* Whether a rotation by axis and angle has both; if not, that is reported, unless a wrong key may be the other one. */
static bool has_axis_and_angle(kt_reader *r, const kt_scope *scope, kt_node *node) {
    const bool has_axis = kt_node_find(node, "axis") != NULL;
    if (has_axis == (kt_node_find(node, "angle") != NULL))
        return true;
    if (!kt_node_has_stray(node))
        kt_fault_at(r, KT_ERROR_SCENE, scope, node, "the key '%s' is missing; a rotation is given by axis and angle",
                    has_axis ? "angle" : "axis");
    return false;
}

bool kt_read_rotation(kt_reader *r, const kt_scope *scope, kt_node *node, kt_rotation *out) {
    kt_rotation rotation = {.type = KT_ROTATION_NONE};
    if (node->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, node, forms.expected);
    (void)kt_table_read(r, scope, node, &form_table, &rotation);
    rotation.type = (kt_rotation_type)kt_form_find(r, scope, node, &forms);
    if (rotation.type == KT_ROTATION_NONE || !has_axis_and_angle(r, scope, node) || kt_node_is_faulty(node))
        return false;
    kt_mat3 matrix;
    kt_error error;
    if (kt_rotation_evaluate(&rotation, &matrix, &error) != KT_OK)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s", error.message);
    *out = rotation;
    return true;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

void kt_write_rotation(kt_emitter *e, const kt_rotation *rotation) {
    kt_form_write(e, &forms, (int)rotation->type, rotation, rotation);
}

/* Only the values that the type has are compared. */
bool kt_same_rotation(const kt_rotation *a, const kt_rotation *b) {
    static const size_t counts[] = {
        [KT_ROTATION_NONE] = 0,   [KT_ROTATION_QUATERNION] = 4, [KT_ROTATION_RPY] = 3,        [KT_ROTATION_EULER] = 3,
        [KT_ROTATION_VECTOR] = 3, [KT_ROTATION_CGR] = 3,        [KT_ROTATION_AXIS_ANGLE] = 4, [KT_ROTATION_MATRIX] = 9};
    if (a->type != b->type || (a->type == KT_ROTATION_EULER && a->sequence != b->sequence))
        return false;
    return kt_same_bits(a->value, b->value, counts[a->type] * sizeof(double));
}

static bool read_rotation(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_rotation(r, scope, node, kt_field_in(object, field));
}

static void write_rotation(kt_emitter *e, const kt_member *m) { kt_write_rotation(e, kt_member_value(m)); }

static bool same_rotation(const kt_member *m) { return kt_same_rotation(kt_member_value(m), kt_member_standard(m)); }

const kt_kind kt_kind_rotation = {.read = read_rotation, .write = write_rotation, .same = same_rotation};
