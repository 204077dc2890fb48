/* The spanning tree of a model in SDF, whose joints are a graph.
 *
 * From the world on, breadth first, a joint carries its child. If a link is reached by no joint as a child, a joint
 * carries it as its parent. This joint turns about the opposite axis, so that its position is the same. Links that the
 * world does not reach move freely, from a link that is no child. Joints that carry nothing close loops.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

/* Sorts joints by their parents or children: first[i] to first[i + 1] are those of link i. */
static bool sort_joints(kt_sdf *m, bool by_child, int **first, int **joints) {
    const size_t links = (size_t)m->links.count;
    int *ends = kt_reader_take(m->r, &m->r->scratch, links + 2, sizeof *ends);
    *joints = kt_reader_take(m->r, &m->r->scratch, (size_t)m->joints.count + 1, sizeof **joints);
    *first = ends;
    if (ends == NULL || *joints == NULL)
        return false;
    for (int i = 0; i < m->joints.count; i++) {
        const kt_sdf_joint *j = kt_sdf_joint_at(m, i);
        ends[(by_child ? j->child : j->parent) + 2]++;
    }
    for (size_t i = 2; i < links + 2; i++)
        ends[i] += ends[i - 1];
    for (int i = 0; i < m->joints.count; i++) {
        const kt_sdf_joint *j = kt_sdf_joint_at(m, i);
        (*joints)[ends[(by_child ? j->child : j->parent) + 1]++] = i;
    }
    return true;
}

/* Adds a link to the tree. */
static void visit(kt_sdf *m, int link, int joint, int parent) {
    kt_sdf_link *l = kt_sdf_link_at(m, link);
    l->carrier = joint;
    l->depth = parent >= 0 ? kt_sdf_link_at(m, parent)->depth + 1 : 0;
    m->order[m->order_count++] = link;
    if (joint >= 0)
        kt_sdf_joint_at(m, joint)->is_used = true;
}

/* Adds the links at the other ends of a link's joints to the tree, as their children or as their parents. */
static void expand(kt_sdf *m, int link, bool is_reversed) {
    const int *first = is_reversed ? m->first_owner : m->first_child;
    const int *joints = is_reversed ? m->owners : m->children;
    for (int k = first[link]; k < first[link + 1]; k++) {
        kt_sdf_joint *j = kt_sdf_joint_at(m, joints[k]);
        const int next = is_reversed ? j->parent : j->child;
        if (j->is_cut || kt_sdf_link_at(m, next)->depth >= 0)
            continue;
        j->is_reversed = is_reversed;
        if (is_reversed)
            kt_left_count(&m->reversed, j->element);
        visit(m, next, joints[k], link);
    }
}

/* Visits all links that the visited ones reach; forwards as far as possible first. */
static void spread(kt_sdf *m, int *forwards, int *backwards) {
    while (*backwards < m->order_count)
        if (*forwards < m->order_count)
            expand(m, m->order[(*forwards)++], false);
        else
            expand(m, m->order[(*backwards)++], true);
}

void kt_sdf_grow_tree(kt_sdf *m) {
    int forwards = 0, backwards = 0;
    m->order = kt_reader_take(m->r, &m->r->scratch, (size_t)m->links.count + 1, sizeof *m->order);
    if (m->order == NULL || !sort_joints(m, false, &m->first_child, &m->children) ||
        !sort_joints(m, true, &m->first_owner, &m->owners))
        return;
    for (int i = 0; i < m->links.count; i++)
        if (i == 0 || kt_sdf_link_at(m, i)->is_static)
            visit(m, i, -1, -1);
    spread(m, &forwards, &backwards);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 1; i < m->links.count; i++)
            if (kt_sdf_link_at(m, i)->depth < 0 && (pass == 1 || !kt_sdf_link_at(m, i)->is_child)) {
                visit(m, i, -1, -1);
                spread(m, &forwards, &backwards);
            }
}
