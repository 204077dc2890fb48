/* What scene-files.md describes and this version cannot do yet: refused in words, never ignored. */
#ifndef KT_SCENE_SUPPORT_H
#define KT_SCENE_SUPPORT_H

#include <stdbool.h>
#include <stddef.h>

/* Ends in NULL. */
extern const char *const kt_support_refused[];

/* Whether the list (NULL: an empty one) has "WHERE.NAME" (or NAME alone where `where` is empty). */
bool kt_support_is_refused(const char *const *refused, const char *where, const char *name);

/* The n-th name (from 0) that the list has at this place; NULL where there are fewer. */
const char *kt_support_refused_name(const char *const *refused, const char *where, size_t n);

#endif
