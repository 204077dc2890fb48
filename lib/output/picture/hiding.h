/* Hidden surfaces: convex solids in the order in which they are to be painted, from the back to the front.
 *
 * If two solids overlap in the picture, the solid whose surface is nearer to the viewer there is painted later. Each
 * solid may be nearer in some part of the overlap, because both run through each other, or pass each other like links
 * of a chain. Then the longer solid is cut across its length within the overlap, and each piece is ordered
 * separately. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_HIDING_H
#define KT_PICTURE_HIDING_H

#include "picture/picture.h"

/* A solid or a piece of a solid, in the camera's frame. */
typedef struct kt_piece {
    kt_solid solid;   /* the whole solid; its z is the direction in which it may be cut */
    int thing;        /* the caller's number */
    bool shines;      /* is seen where it is inside of another one that shines, as if that were transparent */
    double low, high; /* the piece: z from low to high in the solid's frame; that of the whole: -half.z to half.z */
} kt_piece;

/* A growing list; starts as {0}. */
typedef struct kt_pieces {
    kt_piece *items;
    int count;
    size_t room;
} kt_pieces;

/* Adds a whole solid, in the camera's frame. The longest edge of a box becomes its z. Returns false if memory is
 * insufficient. */
bool kt_pieces_add(kt_pieces *pieces, const kt_solid *solid, int thing, bool shines);
/* Adds a piece as it is. Returns false if memory is insufficient. */
bool kt_pieces_append(kt_pieces *pieces, kt_piece piece);
void kt_pieces_free(kt_pieces *pieces);

/* The solid that a piece is. */
kt_solid kt_piece_solid(const kt_piece *piece);

/* Sorts pieces from the back to the front, and cuts pieces if necessary. Pieces that do not overlap, or whose
 * surfaces are nearer to each other than `tolerance`, keep their order. In a diagram of a plane (is_diagram), solids
 * that run through each other are not hidden by each other: the thinner solid comes later. Pieces of a diagram keep
 * their order while bodies turn and slide in the plane. A solid that `shines`, is whole and lies inside another solid
 * comes later, too. If memory is insufficient, returns false and removes no piece. Cost: about O(n^2) for n
 * pieces. */
bool kt_pieces_sort(kt_pieces *pieces, double tolerance, bool is_diagram);

#endif
