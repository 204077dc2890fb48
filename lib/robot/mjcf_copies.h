/* Copies by a <replicate>. */
#ifndef KT_ROBOT_MJCF_COPIES_H
#define KT_ROBOT_MJCF_COPIES_H

#include "robot/mjcf.h"

/* Replaces each <replicate> with its copies, after the compiler's settings have been read. */
void kt_mjcf_replicate(kt_mjcf *m, int document);

/* kt_mjcf.copies has the outermost copies of the model itself (kt_mjcf_copy). Some actuators act on copies:
 * kt_mjcf.moved_actuators has their places in the file (int). */

/* A copy: the <frame> around it, and what its names end in. */
typedef struct kt_mjcf_copy {
    const kt_element *frame;
    char suffix[80];
} kt_mjcf_copy;

/* The copy that an element is in, if it is `near` (-1: none) or the one after; else -1. */
int kt_mjcf_copy_of(const kt_mjcf *m, const kt_element *e, int near);

/* The scope of the names to which an attribute refers; -1: none. */
int kt_mjcf_reference(const char *attribute);

/* Whether a name is that of an element which has copies by a <replicate>. */
bool kt_mjcf_has_copies(const kt_mjcf *m, const char *name);

#endif
