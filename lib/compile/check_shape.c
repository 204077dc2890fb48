/* Rules of a shape. */
#include "compile/compile.h"

#include <stddef.h>

static void check_rod(kt_checker *checker, const kt_shape *shape) {
    const bool from = kt_checker_vector(checker, "shape.from", -1, "", shape->from);
    const bool to = kt_checker_vector(checker, "shape.to", -1, "", shape->to);
    if (from && to && !(kt_vec3_norm_wide(kt_vec3_sub(shape->to, shape->from)) > 0.0))
        kt_checker_fault(checker, "shape.to", -1, "shape.to is where shape.from is; a rod needs a length");
    kt_checker_not_negative(checker, "shape.radius", "", shape->radius);
}

static void check_box(kt_checker *checker, const kt_shape *shape) {
    const double size[3] = {shape->size.x, shape->size.y, shape->size.z};
    if (!kt_checker_values(checker, "shape.size", -1, "", size, 3))
        return;
    for (int i = 0; i < 3; i++)
        if (!(size[i] > 0.0)) {
            kt_checker_fault(checker, "shape.size", -1, "shape.size[%d] is %g; it must be greater than 0", i, size[i]);
            return;
        }
}

void kt_checker_shape(kt_checker *checker, const kt_shape *shape) {
    const kt_shape_type type = shape->type;
    if (kt_shape_type_name(type) == NULL) {
        kt_checker_fault(checker, "shape.type", -1,
                         "shape.type is %d, and there is no shape of that number; take one of kt_shape_type",
                         (int)type);
        return;
    }
    if (type == KT_SHAPE_ROD)
        check_rod(checker, shape);
    else if (type != KT_SHAPE_NONE)
        kt_checker_vector(checker, "shape.at", -1, "", shape->at);
    if (type == KT_SHAPE_BOX)
        check_box(checker, shape);
    if (type == KT_SHAPE_SPHERE || type == KT_SHAPE_CYLINDER)
        kt_checker_positive(checker, "shape.radius", shape->radius);
    if (type == KT_SHAPE_CYLINDER) {
        kt_checker_positive(checker, "shape.length", shape->length);
        kt_checker_axis(checker, "shape.axis", shape->axis);
    }
    /* A turned sphere is the same sphere, but no rotation is none: a scene file could not hold it. */
    if (type == KT_SHAPE_BOX || type == KT_SHAPE_SPHERE || type == KT_SHAPE_CYLINDER)
        kt_checker_rotation(checker, "shape.rotation", -1, "", &shape->rotation);
}
