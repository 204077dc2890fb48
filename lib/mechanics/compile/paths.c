/* The paths of the loops: from below the common ancestor of its ends down to each.
 *
 * The paths of a net of n rows have up to n links each, n^2 in all. The groups of such a net are still found in O(n log
 * n). Common ancestors are found with jumps [Myers 1983]: each link has one to a higher link, and log n of jumps and
 * steps to parents reach any higher link. Links that a path has joined are skipped by the next path. If a path is the
 * beginning of another path down from the same link, both are stored once. The paths of the net then take O(n) memory.
 * (Not so if the links at their ends are all different, as in a ladder whose rungs are bodies.)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/rounding.h"
#include "compile/attach.h"

#include <math.h>
#include <string.h>

void kt_attach_measure_links(kt_attach *a, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const int32_t up = a->tree->link[i].parent, far = a->jump[up];
        a->top[i] = (int32_t)i;
        if (i == 0)
            continue;
        a->jump[i] = a->depth[up] - a->depth[far] == a->depth[far] - a->depth[a->jump[far]] ? a->jump[far] : up;
        a->base[i] = up ? a->base[up] : (int32_t)i;
        a->far[i] = up ? a->far[up] + kt_vec3_norm(kt_vec3_sub(a->pose[i].position, a->pose[up].position)) : 0.0;
    }
}

int32_t kt_attach_ancestor(const kt_attach *a, int32_t i, int32_t j) {
    const kt_link *link = a->tree->link;
    int32_t high = a->depth[i] < a->depth[j] ? i : j, low = high == i ? j : i;
    while (a->depth[low] > a->depth[high])
        low = a->depth[a->jump[low]] >= a->depth[high] ? a->jump[low] : link[low].parent;
    while (low != high) { /* as deep as each other, and so are the ends of their jumps */
        const bool over = a->jump[low] == a->jump[high];
        low = over ? link[low].parent : a->jump[low];
        high = over ? link[high].parent : a->jump[high];
    }
    return low;
}

/* The highest link that paths have joined with i. */
static int32_t top_of(kt_attach *a, int32_t i) {
    while (a->top[i] != i)
        i = a->top[i] = a->top[a->top[i]];
    return i;
}

int32_t kt_attach_join_path(kt_attach *a, int32_t i, int32_t ancestor) {
    for (int32_t j = top_of(a, i); a->depth[j] > a->depth[ancestor] + 1; j = top_of(a, j)) {
        a->top[j] = a->tree->link[j].parent;
        kt_attach_join(a, j, a->top[j]);
    }
    return a->depth[i] - a->depth[ancestor];
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

/* Places the path of an end. If an earlier path from the same ancestor leads through its link, both are stored
 * together. If not, the path is stored at the end of the list. Longer paths have been placed before. */
static void place_path(kt_attach *a, kt_loop_record *r, int k, kt_counts *n) {
    const int32_t i = r->link[k];
    if (a->from[i] == r->ancestor) {
        r->path[k] = a->place[i] - (r->length[k] - 1);
        return;
    }
    r->path[k] = (int32_t)n->path;
    n->path += (size_t)r->length[k];
    int32_t at = (int32_t)n->path;
    for (int32_t j = i; j != r->ancestor; j = a->tree->link[j].parent) {
        a->from[j] = r->ancestor;
        a->place[j] = --at;
    }
}

void kt_attach_place_paths(kt_attach *a, kt_counts *n) {
    int32_t *first = a->change, *end = a->next_end, sum = 0; /* the ends by the lengths of their paths */
    const size_t ends = 2 * n->loop;
    memset(first, 0, (n->link + 1) * sizeof *first);
    for (size_t i = 0; i < n->link; i++)
        a->from[i] = -1;
    for (size_t e = 0; e < ends; e++)
        first[a->loop[e / 2].length[e % 2]]++;
    for (size_t length = n->link + 1; length-- > 0;) {
        const int32_t count = first[length];
        first[length] = sum;
        sum += count;
    }
    for (size_t e = 0; e < ends; e++)
        end[first[a->loop[e / 2].length[e % 2]]++] = (int32_t)e;
    for (size_t e = 0; e < ends; e++) {
        kt_loop_record *r = &a->loop[end[e] / 2];
        if (r->length[end[e] % 2])
            place_path(a, r, end[e] % 2, n);
    }
}

void kt_paths_fill(kt_model *m) {
    for (size_t i = 0; i < m->n.loop; i++)
        for (int k = 0; k < 2; k++) {
            const kt_loop_record *r = &m->loop[i];
            int32_t *path = m->path + r->path[k], j = r->link[k], at = r->length[k];
            for (; at > 0 && path[at - 1] != j;
                 j = m->link[j].parent) /* the links above a stored link are stored, too */
                path[--at] = j;
        }
}

bool kt_attach_find_origin(const kt_model *m, const kt_loop_record *r, kt_vec3 *origin) {
    bool found = false;
    for (int k = 0; k < 2 && r->ancestor == 0; k++) {
        if (r->length[k] == 0)
            continue;
        const kt_link *first = &m->link[m->path[r->path[k]]];
        if (kt_link_lengths(first) || kt_link_pitch(first) != 0.0)
            return false;
        if (!found)
            *origin = first->at;
        found = true;
    }
    return found;
}

/* ---- lengths ----------------------------------------------------------------------------------------------------- */

/* Returns the length of a loop, once around, at the initial positions. Points on the ground count by their distance
 * from `origin`. With `exactly`, the length is summed link by link; otherwise the length may differ by rounding
 * errors. */
static double length_of_loop(const kt_attach *a, const kt_loop_record *r, kt_vec3 origin, bool exactly) {
    double length = fabs(r->curve.a); /* of a distance loop */
    for (int k = 0; k < 2; k++) {
        const bool stands = r->link[k] == 0; /* the end is on the ground */
        length += kt_vec3_norm(stands ? kt_vec3_sub(r->frame[k].position, origin) : r->frame[k].position);
        if (!exactly && r->length[k]) {
            length += a->far[r->link[k]] - a->far[r->ancestor];
            length += r->ancestor ? 0.0 : kt_vec3_norm(kt_vec3_sub(a->pose[a->base[r->link[k]]].position, origin));
        }
        for (int32_t j = r->link[k]; exactly && j != r->ancestor; j = a->tree->link[j].parent) {
            const int32_t up = a->tree->link[j].parent;
            length += kt_vec3_norm(kt_vec3_sub(a->pose[j].position, up ? a->pose[up].position : origin));
        }
    }
    return length;
}

/* A point of a loop that stands on the ground: an end, or the first joint of an end's path. */
static kt_vec3 point_on_ground(const kt_attach *a, const kt_loop_record *r) {
    const int k = r->link[0] != 0 && r->link[1] == 0;
    return r->link[k] == 0 ? r->frame[k].position : a->pose[a->base[r->link[k]]].position;
}

/* The largest distance of a link or its centre of mass from the world's origin. */
static double reach_of_tree(const kt_attach *a) {
    double most = 0.0;
    for (size_t i = 1; i < a->tree->n.link; i++) {
        const kt_link *link = &a->tree->link[i];
        most = fmax(most, kt_vec3_norm(a->pose[i].position));
        if (link->mass > 0.0)
            most = fmax(most, kt_vec3_norm(link->moment) / link->mass);
    }
    return most;
}

static bool is_measured(const kt_loop_record *r) { return !kt_attach_is_relation(r->type) && !kt_loop_is_off(r); }

/* The mean of the points that kt_attach_find_origin finds. Each point has a part in it, so that the order of the loops
 * does not matter. */
static kt_vec3 common_origin(const kt_model *m) {
    kt_vec3 mean = kt_vec3_make(0.0, 0.0, 0.0), own;
    double count = 0.0;
    for (size_t i = 0; i < m->n.loop; i++)
        if (is_measured(&m->loop[i]) && kt_attach_find_origin(m, &m->loop[i], &own))
            mean = kt_vec3_add(mean, kt_vec3_scale(1.0 / ++count, kt_vec3_sub(own, mean)));
    return mean;
}

void kt_attach_measure_loops(const kt_attach *a, kt_model *m) {
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), common = common_origin(m);
    double about = 0.0, longest = 0.0, given = 0.0;
    kt_vec3 own;
    for (int pass = 0; pass < 2; pass++) { /* only those that may be the longest are summed link by link */
        for (size_t i = 0; i < m->n.loop; i++) {
            kt_loop_record *r = &m->loop[i];
            if (!is_measured(r))
                continue;
            const kt_vec3 origin = kt_attach_find_origin(m, r, &own) ? common : none;
            const double length = length_of_loop(a, r, origin, false);
            if (pass && length >= (1.0 - 1e-9) * about)
                longest = fmax(longest, length_of_loop(a, r, origin, true));
            r->around = length_of_loop(a, r, point_on_ground(a, r), false);
            about = fmax(about, length);
            given = fmax(given, length_of_loop(a, r, none, false));
        }
    }
    if (!(longest > KT_ROUNDING * given))
        longest = given > 0.0 ? given : reach_of_tree(a);
    m->length = longest > 0.0 ? longest : 1.0;
    m->rounding = KT_ROUNDING * fmax(1.0, given / m->length);
}
