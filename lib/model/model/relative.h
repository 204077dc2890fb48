/* Relative coordinates of loops, and the coordinates in which an effect acts: the coordinate of a joint or of a loop.
 *
 * `joint: NAME` names the one coordinate of a joint or loop, NAME[k] the k-th of several. If a joint and a loop have
 * the same name, NAME means the joint.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_RELATIVE_H
#define KT_MODEL_RELATIVE_H

#include "base/inner.h"
#include "kinetree/description.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* A coordinate of the second end's frame relative to the first's that a loop may leave free
 * (constraint/relative_coordinate.h). */
typedef enum kt_relative {
    KT_RELATIVE_NONE = 0,
    KT_RELATIVE_X, /* displacements along the first end's axes */
    KT_RELATIVE_Y,
    KT_RELATIVE_Z,
    KT_RELATIVE_STRETCH, /* how much longer a span is than its rope */
    KT_RELATIVE_ANGLE,   /* about z of both ends */
    KT_RELATIVE_FIRST,   /* universal: about z of the first end, and about that of the second */
    KT_RELATIVE_SECOND
} kt_relative;

static inline bool kt_relative_is_length(kt_relative relative) {
    return relative >= KT_RELATIVE_X && relative <= KT_RELATIVE_STRETCH;
}

/* Returns the k-th relative coordinate of loops of a type. The order is the order of coordinates in the joint that
 * permits the same motion. Returns KT_RELATIVE_NONE if the type has no more coordinates, or does not exist. */
KT_INNER kt_relative kt_relative_at(kt_loop_type type, int k);
int kt_relative_count(kt_loop_type type);

/* "NAME", "NAME[k]" */
typedef struct kt_coordinate_name {
    size_t length; /* length of NAME */
    int k;         /* 0 if it is not given; -1: the text is no such name */
    bool has_index;
} kt_coordinate_name;

KT_INNER kt_coordinate_name kt_coordinate_name_of(const char *text);

/* Whether NAME is this relative coordinate. */
static inline bool kt_coordinate_is_of(const char *text, kt_coordinate_name name, const char *of) {
    return of != NULL && strncmp(of, text, name.length) == 0 && of[name.length] == '\0';
}

/* Returns the index of the named loop, or -1. The search begins at `first` and continues cyclically. */
KT_INNER int kt_coordinate_loop(const kt_description *description, const char *text, int first);

#endif
