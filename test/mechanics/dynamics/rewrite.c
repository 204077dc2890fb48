/* SPDX-License-Identifier: Apache-2.0 */
#include "rewrite.h"

#include <stdio.h>
#include <string.h>

void kt_rewrite_begin(kt_tree *out, const kt_tree *tree) {
    memset(out, 0, sizeof *out);
    out->description = tree->description;
    out->description.bodies = out->body;
    out->description.body_count = 0;
}

kt_body *kt_rewrite_helper(kt_tree *out, const char *parent, kt_joint_type type, kt_vec3 axis) {
    const int i = out->description.body_count++;
    kt_body *body = &out->body[i];
    snprintf(out->name[i], sizeof out->name[i], "h%d", i);
    *body = kt_body_of(out->name[i], parent, type, 0.0);
    body->joint.axis = axis;
    return body;
}

kt_body *kt_rewrite_copy(kt_tree *out, const kt_body *body) {
    kt_body *to = &out->body[out->description.body_count++];
    *to = *body;
    return to;
}

void kt_rewrite_state(const kt_tree *tree, const kt_tree_state *s, const kt_tree *other, kt_tree_state *out) {
    *out = *s;
    memset(out->external, 0, sizeof out->external);
    for (int b = 1; b < tree->count; b++)
        out->external[kt_body_find(other->model, kt_body_name(tree->model, b))] = s->external[b];
}
