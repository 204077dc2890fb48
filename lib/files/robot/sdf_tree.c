/* The spanning tree of a model in SDF, whose joints are a graph (parts/spanning.c). If no joint leads from the tree to
 * a link, a joint carries the link as its parent. This joint turns about the opposite axis, so that its position is the
 * same. Links that the world does not reach move freely, from a link that is no child. Joints that carry nothing close
 * loops.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include "model/model.h"
#include "parts/spanning.h"

/* Coordinates, and the weight of a joint without a given start. Both joints of a pair of axes close a loop together. */
static int sdf_weight(const kt_sdf *m, const kt_sdf_joint *j) {
    enum { NO_START = 8 };
    const bool is_pair = kt_sdf_link_at(m, j->parent)->is_between || kt_sdf_link_at(m, j->child)->is_between;
    const bool has_start = j->axis != NULL && kt_xml_child(j->axis, "initial_position") != NULL;
    if (j->is_cut)
        return KT_EDGE_CUT;
    return j->type == KT_JOINT_FIXED ? 0 : (is_pair ? 2 : kt_joint_sizes[j->type].nv) + (has_start ? 0 : NO_START);
}

static void use_sdf_tree(kt_sdf *m, const kt_spanning *tree) {
    for (int i = 0; i < m->joints.count; i++) {
        kt_sdf_joint *j = kt_sdf_joint_at(m, i);
        j->is_used = tree->edge[i].is_used;
        j->is_reversed = tree->edge[i].is_reversed;
        if (j->is_reversed)
            kt_left_count(&m->reversed, j->element);
    }
    for (int i = 0; i < m->links.count; i++) {
        kt_sdf_link_at(m, i)->carrier = tree->carrier[i];
        kt_sdf_link_at(m, i)->depth = tree->depth[i];
    }
    m->order = tree->order;
    m->order_count = m->links.count;
}

void kt_sdf_grow_tree(kt_sdf *m) {
    kt_edge *edges = kt_reader_take(m->r, &m->r->scratch, (size_t)m->joints.count + 1, sizeof *edges);
    bool *is_root = kt_reader_take(m->r, &m->r->scratch, (size_t)m->links.count + 1, sizeof *is_root);
    if (edges == NULL || is_root == NULL)
        return;
    for (int i = 0; i < m->joints.count; i++) {
        const kt_sdf_joint *j = kt_sdf_joint_at(m, i);
        edges[i] = (kt_edge){.end = {j->parent, j->child}, .weight = sdf_weight(m, j)};
    }
    for (int i = 0; i < m->links.count; i++)
        is_root[i] = kt_sdf_link_at(m, i)->is_static;
    kt_spanning tree = {
        .vertex_count = m->links.count, .edge_count = m->joints.count, .edge = edges, .is_root = is_root};
    if (kt_spanning_find(&m->r->scratch, &tree))
        use_sdf_tree(m, &tree);
    else
        (void)kt_reader_out_of_memory(m->r);
}
