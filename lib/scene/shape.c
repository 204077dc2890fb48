/* Shapes. */
#include "scene/part.h"

enum {
    POINT = 1 << KT_SHAPE_POINT,
    ROD = 1 << KT_SHAPE_ROD,
    BOX = 1 << KT_SHAPE_BOX,
    SPHERE = 1 << KT_SHAPE_SPHERE,
    CYLINDER = 1 << KT_SHAPE_CYLINDER
};

#define SHAPE_NAME(id, name) #name,
static const char *const type_names[] = {KT_SHAPE_LIST(SHAPE_NAME)};
static const kt_choice types = {"shape.type", type_names, KT_SHAPE_TYPE_COUNT, KT_SHAPE_NONE + 1};

#define AT(member) .offset = offsetof(kt_shape, member)
static const kt_field fields[] = {
    {.key = "type", .kind = &kt_kind_choice, AT(type), .flags = KT_FIELD_REQUIRED, .detail = &types},
    {.key = "from", .kind = &kt_kind_vector, AT(from), .types = ROD},
    {.key = "to", .kind = &kt_kind_vector, AT(to), .types = ROD, .flags = KT_FIELD_REQUIRED},
    {.key = "size", .kind = &kt_kind_vector, AT(size), .types = BOX, .flags = KT_FIELD_REQUIRED},
    /* A rod without radius is slender, a sphere or cylinder without one is a slip. */
    {.key = "radius", .kind = &kt_kind_number, AT(radius), .types = ROD},
    {.key = "radius", .kind = &kt_kind_number, AT(radius), .types = SPHERE | CYLINDER, .flags = KT_FIELD_REQUIRED},
    {.key = "length", .kind = &kt_kind_number, AT(length), .types = CYLINDER, .flags = KT_FIELD_REQUIRED},
    {.key = "axis", .kind = &kt_kind_axis, AT(axis), .types = CYLINDER},
    {.key = "at", .kind = &kt_kind_vector, AT(at), .types = POINT | BOX | SPHERE | CYLINDER},
    {.key = "rotation", .kind = &kt_kind_rotation, AT(rotation), .types = BOX | SPHERE | CYLINDER},
};
const kt_table kt_shape_table = {
    .where = "shape", .fields = fields, .count = KT_COUNT_OF(fields), .flow = true, .types = &types};
