/* The paths of effects: their points in the axes of links, and the list of these links. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "effect/path.h"

/* Returns the index of a body among the bodies of a path's first points, or `count` if the body is new. */
static int find_path_link(const kt_model *m, const kt_path_link *links, int count, const kt_end *end) {
    const int32_t link = m->body[kt_attach_body_named(m, end->body)].link;
    int k = 0;
    while (k < count && links[k].link != link)
        k++;
    return k;
}

void kt_attach_count_path(const kt_model *tree, const kt_effect *effect, kt_counts *n) {
    kt_path_link links[KT_PATH_LINK_MAX];
    int count = 0;
    for (int i = 0; i < effect->path_count; i++) {
        const kt_end *end = &effect->path[i].end;
        if (find_path_link(tree, links, count, end) == count)
            links[count++].link = tree->body[kt_attach_body_named(tree, end->body)].link;
    }
    n->path_point += (size_t)effect->path_count;
    n->path_link += (size_t)count;
}

kt_status kt_attach_fill_path(kt_model *m, const kt_effect *effect, kt_effect_record *r, size_t *point, size_t *link,
                              kt_error *error) {
    kt_path_link *links = m->path_link + *link;
    r->path_point = (int32_t)*point;
    r->path_link = (int32_t)*link;
    r->path_count = effect->path_count;
    for (int i = 0; i < effect->path_count; i++) {
        const kt_path_point *from = &effect->path[i];
        const int k = find_path_link(m, links, r->path_link_count, &from->end);
        kt_path_link found = {.force_link = 0};
        kt_pose frame;
        const kt_status status = kt_attach_place_end(m, &from->end, &found.body, &found.link, &frame, error);
        if (status != KT_OK)
            return status;
        found.arm = kt_vec3_scale(-1.0, m->body[found.body].in_link.position);
        if (k == r->path_link_count)
            links[r->path_link_count++] = found;
        m->path_point[*point + (size_t)i] = kt_path_record_of(from, &frame, k);
    }
    *point += (size_t)r->path_count;
    *link += (size_t)r->path_link_count;
    return KT_OK;
}
