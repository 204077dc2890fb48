/* Ends of loops and effects.
 *
 * `body.marker`, `body`, `world`, or {body: B, at: [..], rotation: ROTATION}. A frame at a marker can be rotated as
 * well: {body: B, marker: M, rotation: ROTATION}.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/value.h"

#include <stddef.h>
#include <string.h>

static const kt_field end_fields[] = {
    {.key = "body", .kind = &kt_kind_name, .offset = offsetof(kt_end, body), .flags = KT_FIELD_REQUIRED},
    {.key = "marker", .kind = &kt_kind_name, .offset = offsetof(kt_end, marker)},
    {.key = "at", .kind = &kt_kind_vector, .offset = offsetof(kt_end, at)},
    {.key = "rotation", .kind = &kt_kind_rotation, .offset = offsetof(kt_end, rotation)},
};
static const kt_table end_table = {.fields = end_fields, .count = KT_COUNT_OF(end_fields), .flow = true};

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

bool kt_end_settle(kt_reader *r, const kt_scope *scope, kt_node *node, kt_end *end) {
    if (end->marker != NULL && kt_node_find(node, "at") != NULL)
        kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'marker' and 'at' are two points; leave one of them out");
    if (end->body != NULL && strcmp(end->body, "world") == 0)
        end->body = NULL;
    return !kt_node_is_faulty(node);
}

bool kt_read_end(kt_reader *r, const kt_scope *scope, kt_node *node, kt_end *out) {
    kt_end end = kt_end_default();
    if (node->kind == KT_NODE_LIST)
        return kt_fault_expected(r, scope, node, "a body, BODY.MARKER, or {body: ..., at: ...}");
    if (!(node->kind == KT_NODE_TEXT ? split_end(r, scope, node, &end)
                                     : kt_table_read(r, scope, node, &end_table, &end)) ||
        !kt_end_settle(r, scope, node, &end))
        return false;
    *out = end;
    return true;
}

void kt_write_end(kt_emitter *e, const kt_end *end) {
    const kt_end standard = kt_end_default();
    kt_end written = *end;
    if (end->body == NULL)
        written.body = "world";
    if (end->marker != NULL)
        written.at = standard.at;
    bool turned = !kt_same_rotation(&written.rotation, &standard.rotation);
    bool moved = !kt_same_bits(&written.at, &standard.at, sizeof written.at);
    if (turned || moved)
        kt_table_write(e, &end_table, &written, &standard);
    else if (end->marker != NULL)
        kt_emit_pair(e, written.body, end->marker);
    else
        kt_emit_text(e, written.body);
}

bool kt_kind_end_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_end(r, scope, node, kt_field_in(object, field));
}

void kt_kind_end_write(kt_emitter *e, const kt_member *m) { kt_write_end(e, kt_member_value(m)); }

bool kt_kind_ends_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_end *ends = kt_field_in(object, field);
    if (node->kind != KT_NODE_LIST || node->count != 2)
        return kt_fault_expected(r, scope, node, "a list of two ends");
    bool good = true;
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        good = kt_read_end(r, &here, item, &ends[here.index]) && good;
    return good;
}

void kt_kind_ends_write(kt_emitter *e, const kt_member *m) {
    const kt_end *ends = kt_member_value(m);
    kt_emit_list(e, KT_EMIT_FLOW);
    kt_write_end(e, &ends[0]);
    kt_write_end(e, &ends[1]);
    kt_emit_end(e);
}

const kt_kind kt_kind_end = {.read = kt_kind_end_read, .write = kt_kind_end_write};
const kt_kind kt_kind_ends = {.read = kt_kind_ends_read, .write = kt_kind_ends_write};
