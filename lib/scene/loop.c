/* Loops, and the joints that the assembly holds. */
#include "scene/part.h"

#include <stddef.h>

enum {
    COUPLING = 1 << KT_LOOP_COUPLING,
    MOTION = 1 << KT_LOOP_MOTION,
    ROLLING = 1 << KT_LOOP_ROLLING,
    DISTANCE = 1 << KT_LOOP_DISTANCE,
    SCREW = 1 << KT_LOOP_SCREW,
    TWO_AXES = 1 << KT_LOOP_ORTHOGONAL | 1 << KT_LOOP_UNIVERSAL,
    ONE_AXIS = 1 << KT_LOOP_INLINE | 1 << KT_LOOP_INPLANE | 1 << KT_LOOP_COAXIAL | 1 << KT_LOOP_REVOLUTE |
               1 << KT_LOOP_PRISMATIC | 1 << KT_LOOP_SCREW | 1 << KT_LOOP_CYLINDRICAL | 1 << KT_LOOP_PLANAR,
    NO_AXIS = 1 << KT_LOOP_SPHERICAL | 1 << KT_LOOP_DISTANCE | 1 << KT_LOOP_PARALLEL | 1 << KT_LOOP_WELD,
    BETWEEN = NO_AXIS | ONE_AXIS | TWO_AXES
};

#define LOOP_NAME(id, name) #name,
static const char *const type_names[] = {KT_LOOP_LIST(LOOP_NAME)};
static const kt_choice types = {"loops.type", type_names, KT_LOOP_TYPE_COUNT, 0};

/* ---- couplings --------------------------------------------------------------------------------------------------- */

/* Joints named twice are left to kt_description_check. */
static bool read_terms(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_loop *loop = object;
    if (node->kind != KT_NODE_MAP || node->count == 0)
        return kt_fault_expected(r, scope, node, "a mapping of joints to numbers (crank: 1)");
    kt_term *terms = kt_pool_take(&r->keep, node->count, sizeof *terms);
    if (terms == NULL)
        return kt_reader_out_of_memory(r);
    bool good = true;
    int i = 0;
    for (kt_node *key = node->of.first; key != NULL; key = key->next->next, i++) {
        const kt_scope here = {.outer = scope, .key = key->kind == KT_NODE_TEXT ? key->of.text : "?"};
        good = kt_read_name(r, scope, key, "the name of a joint", &terms[i].joint) && good;
        good = kt_read_number(r, &here, key->next, KT_QUANTITY_NUMBER, &terms[i].coefficient) && good;
    }
    loop->terms = terms;
    loop->term_count = i;
    return good;
}

static void write_terms(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    const kt_loop *loop = object;
    kt_emit_map(e, true);
    for (int i = 0; i < loop->term_count; i++) {
        kt_emit_name(e, loop->terms[i].joint);
        kt_emit_number(e, loop->terms[i].coefficient);
    }
    kt_emit_end(e);
}

/* An angle where a joint of the coupling turns. */
static bool read_offset(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_loop *loop = object;
    kt_quantity quantity = KT_QUANTITY_NUMBER;
    for (int i = 0; i < loop->term_count; i++)
        if (kt_joint_quantity(r, loop->terms[i].joint) == KT_QUANTITY_ANGLE)
            quantity = KT_QUANTITY_ANGLE;
    return kt_read_number(r, scope, node, quantity, kt_field_in(object, field));
}

static const kt_kind kind_terms = {.read = read_terms, .write = write_terms};
static const kt_kind kind_offset = {read_offset, kt_number_write, kt_number_same};

/* ---- a loop ------------------------------------------------------------------------------------------------------ */

#define AT(member) .offset = offsetof(kt_loop, member)
#define REQUIRED .flags = KT_FIELD_REQUIRED
static const kt_field fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name)},
    {.key = "type", .kind = &kt_kind_choice, AT(type), REQUIRED, .detail = &types},
    {.key = "between", .kind = &kt_kind_ends, AT(between), .types = BETWEEN, REQUIRED},
    {.key = "wheel", .kind = &kt_kind_end, AT(between[0]), .types = ROLLING, REQUIRED},
    {.key = "axis", .kind = &kt_kind_axis, AT(axis), .types = ONE_AXIS | TWO_AXES | ROLLING},
    {.key = "axis2", .kind = &kt_kind_axis, AT(axis2), .types = TWO_AXES},
    {.key = "pitch", .kind = &kt_kind_number, AT(pitch), .types = SCREW, REQUIRED},
    {.key = "length", .kind = &kt_kind_function, AT(function), .types = DISTANCE},
    {.key = "coefficients", .kind = &kind_terms, .types = COUPLING, REQUIRED},
    {.key = "offset", .kind = &kind_offset, AT(offset), .types = COUPLING},
    {.key = "joint", .kind = &kt_kind_name, AT(joint), .types = MOTION, REQUIRED},
    {.key = "position", .kind = &kt_kind_motion, AT(function), .types = MOTION, REQUIRED},
    {.key = "radius", .kind = &kt_kind_number, AT(radius), .types = ROLLING, REQUIRED},
    {.key = "on", .kind = &kt_kind_end, AT(between[1]), .types = ROLLING, REQUIRED},
    {.key = "normal", .kind = &kt_kind_axis, AT(axis2), .types = ROLLING},
    {.key = "holonomic", .kind = &kt_kind_flag, AT(holonomic), .types = ROLLING},
};
static const kt_table loop_table = {
    .where = "loops", .fields = fields, .count = KT_COUNT_OF(fields), .flow = true, .types = &types};

static bool read_loops(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    int count = 0;
    if (!kt_list_nodes(r, scope, node, "a list of loops ('- {type: ..., between: ...}')", &r->loop_nodes, &count))
        return false;
    kt_loop *loops = kt_pool_take(&r->keep, (size_t)count, sizeof *loops);
    if (loops == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++) {
        const kt_scope here = kt_item_scope("loop", "loops", i, r->loop_nodes[i]);
        loops[i] = kt_loop_default();
        (void)kt_table_read(r, &here, r->loop_nodes[i], &loop_table, &loops[i]);
    }
    scene->description.loops = loops;
    scene->description.loop_count = count;
    return true;
}

static void write_loops(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    const kt_description *description = &((const kt_scene *)object)->description;
    const kt_loop rest = kt_loop_default();
    kt_emit_list(e, false);
    for (int i = 0; i < description->loop_count; i++)
        kt_table_write(e, &loop_table, &description->loops[i], &rest);
    kt_emit_end(e);
}

static bool same_loops(const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    return ((const kt_scene *)object)->description.loop_count == 0;
}

const kt_kind kt_kind_loops = {read_loops, write_loops, same_loops};

/* ---- the initial state ------------------------------------------------------------------------------------------- */

static bool read_hold(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    int count = 0;
    if (!kt_list_nodes(r, scope, node, "a list of joints", &r->hold_nodes, &count))
        return false;
    const char **hold = kt_pool_take(&r->keep, (size_t)count, sizeof *hold);
    if (hold == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++) {
        const kt_scope here = {.outer = scope, .index = i};
        (void)kt_read_name(r, &here, r->hold_nodes[i], "the name of a joint", &hold[i]);
    }
    scene->description.hold = hold;
    scene->description.hold_count = count;
    return true;
}

static void write_hold(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    const kt_description *description = &((const kt_scene *)object)->description;
    kt_emit_list(e, true);
    for (int i = 0; i < description->hold_count; i++)
        kt_emit_text(e, description->hold[i]);
    kt_emit_end(e);
}

static bool same_hold(const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    return ((const kt_scene *)object)->description.hold_count == 0;
}

static const kt_kind kind_hold = {read_hold, write_hold, same_hold};
static const kt_field initial_fields[] = {{.key = "hold", .kind = &kind_hold}};
const kt_table kt_initial_table = {.where = "initial", .fields = initial_fields, .count = KT_COUNT_OF(initial_fields)};
