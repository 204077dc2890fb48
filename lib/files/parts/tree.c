/* Chains and trees of links.
 *
 * With the branching b, link i has the parent (i - 2) / b + 1, rounded down. The children of a link number
 * k = 0 .. b - 1. The joint of child k is turned about z by fan (k / (b - 1) - 1/2).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parts/builder.h"

#include "base/require.h"

#include <math.h>
#include <stdio.h>

kt_link_tree kt_link_tree_default(void) {
    const double half_pi = 1.57079632679489661923;
    return (kt_link_tree){
        .branching = 1, .fan = half_pi, .end = kt_vec3_make(1.0, 0.0, 0.0), .link = kt_body_default()};
}

static kt_status check_tree(const kt_link_tree *tree, kt_error *error) {
    char where[KT_WHERE_SIZE];
    snprintf(where, sizeof where, "tree '%s'", tree->name != NULL ? tree->name : "");
    if (tree->name == NULL)
        return kt_error_set(error, KT_ERROR_MODEL, where, "the name is missing; its links are NAME1, NAME2, ...");
    if (tree->count < 1)
        return kt_error_set(error, KT_ERROR_MODEL, where, "%d links; there must be at least one", tree->count);
    if (tree->branching < 1)
        return kt_error_set(error, KT_ERROR_MODEL, where, "a branching of %d; each link carries one (a chain) or more",
                            tree->branching);
    if (!isfinite(tree->fan))
        return kt_error_set(error, KT_ERROR_MODEL, where, "the fan is %g rad; give a finite angle", tree->fan);
    return KT_OK;
}

kt_status kt_builder_add_tree(kt_builder *builder, const kt_link_tree *tree, kt_error *error) {
    if (KT_IS_MISSING(error, builder, tree))
        return KT_ERROR_ARGUMENT;
    kt_status status = check_tree(tree, error);
    if (status == KT_OK)
        status = kt_builder_reserve(builder, tree->count, 0, 0, error);
    if (status != KT_OK)
        return status;
    kt_body *links = builder->bodies + builder->body_count;
    for (int i = 0; i < tree->count; i++) {
        links[i] = tree->link;
        links[i].name = kt_builder_name(builder, tree->name, "", i + 1);
        if (links[i].name == NULL)
            return kt_builder_out_of_memory(error);
        if (i == 0) {
            links[i].parent = tree->parent;
            continue;
        }
        links[i].parent = links[(i - 1) / tree->branching].name;
        links[i].joint.at = tree->end;
        if (tree->branching > 1) {
            const double place = (double)((i - 1) % tree->branching) / (double)(tree->branching - 1);
            links[i].joint.rotation = kt_rotation_rpy(0.0, 0.0, tree->fan * (place - 0.5));
        }
    }
    builder->body_count += tree->count;
    return KT_OK;
}
