/* Ends of loops and effects.
 *
 * `body.marker`, `body`, `world`, or {body: B, at: [..], rotation: ROTATION}. A frame at a marker can be rotated as
 * well: {body: B, marker: M, rotation: ROTATION}.
 */
#include "scene/value.h"

#include <stddef.h>
#include <string.h>

static const kt_field end_fields[] = {
    {.key = "body", .kind = &kt_kind_name, .offset = offsetof(kt_end, body), .flags = KT_FIELD_REQUIRED},
    {.key = "marker", .kind = &kt_kind_name, .offset = offsetof(kt_end, marker)},
    {.key = "at", .kind = &kt_kind_vector, .offset = offsetof(kt_end, at)},
    {.key = "rotation", .kind = &kt_kind_rotation, .offset = offsetof(kt_end, rotation)},
};
static const kt_table end_table = {.fields = end_fields, .count = KT_COUNT_OF(end_fields)};

/* Splits `body.marker`; a name without a point is a body. */
static bool split_end(kt_reader *r, const kt_scope *scope, kt_node *node, kt_end *out) {
    const char *text;
    if (!kt_read_name(r, scope, node, "a body, or BODY.MARKER", &text))
        return false;
    const char *point = strchr(text, '.');
    if (point == text || (point != NULL && point[1] == '\0'))
        return kt_fault_expected(r, scope, node, "a body, or BODY.MARKER");
    out->body = text;
    if (point == NULL)
        return true;
    out->body = kt_pool_text(&r->keep, text, (size_t)(point - text));
    if (out->body == NULL)
        return kt_reader_out_of_memory(r);
    out->marker = point + 1;
    return true;
}

bool kt_read_end(kt_reader *r, const kt_scope *scope, kt_node *node, kt_end *out) {
    kt_end end = kt_end_default();
    if (node->kind == KT_NODE_LIST)
        return kt_fault_expected(r, scope, node, "a body, BODY.MARKER, or {body: ..., at: ...}");
    if (node->kind == KT_NODE_TEXT) {
        if (!split_end(r, scope, node, &end))
            return false;
    } else {
        (void)kt_table_read(r, scope, node, &end_table, &end);
        if (end.marker != NULL && kt_node_find(node, "at") != NULL)
            kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'marker' and 'at' are two points; leave one of them out");
        if (kt_node_is_faulty(node))
            return false;
    }
    if (end.body != NULL && strcmp(end.body, "world") == 0)
        end.body = NULL;
    *out = end;
    return true;
}

void kt_write_end(kt_emitter *e, const kt_end *end) {
    const kt_end standard = kt_end_default();
    const char *body = end->body == NULL ? "world" : end->body;
    bool turned = !kt_same_rotation(&end->rotation, &standard.rotation);
    bool moved = end->marker == NULL && !kt_same_bits(&end->at, &standard.at, sizeof end->at);
    if (!turned && !moved && end->marker == NULL) {
        kt_emit_text(e, body);
        return;
    }
    if (!turned && !moved) {
        kt_emit_pair(e, body, end->marker);
        return;
    }
    kt_emit_map(e, true);
    kt_emit_key(e, "body");
    kt_emit_text(e, body);
    if (end->marker != NULL) {
        kt_emit_key(e, "marker");
        kt_emit_text(e, end->marker);
    }
    if (moved) {
        const double at[] = {end->at.x, end->at.y, end->at.z};
        kt_emit_key(e, "at");
        kt_emit_numbers(e, at, 3);
    }
    if (turned) {
        kt_emit_key(e, "rotation");
        kt_write_rotation(e, &end->rotation);
    }
    kt_emit_end(e);
}

bool kt_kind_end_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_end(r, scope, node, kt_field_in(object, field));
}

void kt_kind_end_write(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    kt_write_end(e, kt_field_of(object, field));
}

bool kt_kind_ends_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_end *ends = kt_field_in(object, field);
    if (node->kind != KT_NODE_LIST || node->count != 2)
        return kt_fault_expected(r, scope, node, "a list of two ends");
    bool good = true;
    int i = 0;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, i++) {
        const kt_scope here = {.outer = scope, .index = i};
        good = kt_read_end(r, &here, item, &ends[i]) && good;
    }
    return good;
}

void kt_kind_ends_write(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    const kt_end *ends = kt_field_of(object, field);
    kt_emit_list(e, true);
    kt_write_end(e, &ends[0]);
    kt_write_end(e, &ends[1]);
    kt_emit_end(e);
}

const kt_kind kt_kind_end = {.read = kt_kind_end_read, .write = kt_kind_end_write};
const kt_kind kt_kind_ends = {.read = kt_kind_ends_read, .write = kt_kind_ends_write};
