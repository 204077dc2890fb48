/* The list of pieces of solids (hiding.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/grow.h"
#include "picture/hiding.h"

#include <stdlib.h>

bool kt_pieces_append(kt_pieces *pieces, kt_piece piece) {
    kt_piece *more = kt_heap_grow(pieces->items, (size_t)pieces->count, 1, &pieces->room, sizeof *more);
    if (more == NULL)
        return false;
    pieces->items = more;
    pieces->items[pieces->count++] = piece;
    return true;
}

bool kt_pieces_add(kt_pieces *pieces, const kt_solid *solid, int thing, bool shines) {
    kt_piece piece = {.solid = *solid, .thing = thing, .shines = shines};
    kt_solid *s = &piece.solid;
    const kt_mat3 r = s->pose.rotation;
    const kt_vec3 h = s->half;
    if (s->type == KT_SOLID_BOX && h.x > h.z && h.x >= h.y) { /* x, y, z become y, z, x */
        s->pose.rotation = (kt_mat3){r.y, r.z, r.x};
        s->half = kt_vec3_make(h.y, h.z, h.x);
    } else if (s->type == KT_SOLID_BOX && h.y > h.z) {
        s->pose.rotation = (kt_mat3){r.z, r.x, r.y};
        s->half = kt_vec3_make(h.z, h.x, h.y);
    }
    piece.low = -s->half.z;
    piece.high = s->half.z;
    return kt_pieces_append(pieces, piece);
}

void kt_pieces_free(kt_pieces *pieces) {
    free(pieces->items);
    *pieces = (kt_pieces){0};
}

/* A cut rod counts as a cylinder. At an end that was not cut, the cylinder extends to the tip of the rod. */
kt_solid kt_piece_solid(const kt_piece *piece) {
    kt_solid solid = piece->solid;
    double low = piece->low, high = piece->high;
    if (solid.type == KT_SOLID_SPHERE || high - low == 2.0 * solid.half.z)
        return solid;
    if (solid.type == KT_SOLID_ROD) {
        low -= low == -solid.half.z ? solid.half.x : 0.0;
        high += high == solid.half.z ? solid.half.x : 0.0;
        solid.type = KT_SOLID_CYLINDER;
    }
    solid.pose.position = kt_pose_apply(solid.pose, kt_vec3_make(0.0, 0.0, 0.5 * (low + high)));
    solid.half.z = 0.5 * (high - low);
    return solid;
}
