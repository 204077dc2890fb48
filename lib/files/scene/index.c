/* The names of bodies, joints, markers and loops, which other items refer to. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_part.h"

#include <string.h>

bool kt_index_bodies(kt_pool *pool, kt_names *names, const kt_body *bodies, int count) {
    size_t most = 2 * (size_t)count;
    for (int i = 0; i < count; i++)
        most += (size_t)bodies[i].marker_count;
    void *memory = kt_pool_take(pool, 1, kt_names_size(most));
    if (memory == NULL)
        return false;
    kt_names_init(names, most, memory);
    for (int i = 0; i < count; i++) {
        if (bodies[i].name != NULL)
            (void)kt_names_add(names, 0, bodies[i].name, i);
        if (bodies[i].joint.name != NULL)
            (void)kt_names_add(names, KT_NAMES_OF_JOINTS, bodies[i].joint.name, i);
        for (int k = 0; k < bodies[i].marker_count; k++)
            if (bodies[i].markers[k].name != NULL)
                (void)kt_names_add(names, i + 1, bodies[i].markers[k].name, k);
    }
    return true;
}

int kt_find_body(const kt_reader *r, const char *name) {
    return name == NULL ? -1 : kt_names_find(&r->scene->names, 0, name);
}

int kt_find_joint(const kt_reader *r, const char *name) {
    const int body = kt_find_body(r, name);
    const int own = name == NULL ? -1 : kt_names_find(&r->scene->names, KT_NAMES_OF_JOINTS, name);
    return own >= 0 || body < 0 || r->scene->description->bodies[body].joint.name != NULL ? own : body;
}

bool kt_body_is_hidden(const kt_reader *r, int body) {
    const kt_node *joint = kt_node_find(r->scene->body_nodes[body], "joint");
    if (kt_node_has_stray(r->scene->body_nodes[body]))
        return true;
    if (joint != NULL && (joint->faulty || kt_node_has_stray(joint) || kt_node_is_faulty(kt_node_find(joint, "type"))))
        return true;
    return kt_node_is_faulty(kt_node_find(r->scene->body_nodes[body], "markers"));
}

int kt_find_marker(const kt_reader *r, int body, const char *name) {
    return kt_names_find(&r->scene->names, body + 1, name);
}

int kt_find_loop(const kt_description *description, const char *name) {
    for (int i = 0; i < description->loop_count; i++)
        if (description->loops[i].name != NULL && strcmp(description->loops[i].name, name) == 0)
            return i;
    return -1;
}
