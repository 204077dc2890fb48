/* Names: tables that map names to indices, the spelling that names must have, and suggestions for misspelt ones.
 *
 * A table lies in the caller's memory and points to the caller's strings, which must outlive it. A lookup does not
 * write.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_NAMES_H
#define KT_BASE_NAMES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- tables ------------------------------------------------------------------------------------------------------ */

typedef struct kt_name_slot {
    const char *name; /* NULL: free */
    uint32_t hash;
    int32_t scope, index;
} kt_name_slot;

/* Open addressing with linear probing, at most two thirds full. A scope is any number, such as the index of the body to
 * which markers belong; the same name may occur in several scopes. */
typedef struct kt_names {
    kt_name_slot *slots;
    size_t mask; /* number of slots, a power of two, minus one */
} kt_names;

/* Returns the bytes that a table of `count` names takes. */
size_t kt_names_size(size_t count);

/* Initialises an empty table for up to `count` names in kt_names_size(count) bytes of memory with the alignment of a
 * pointer. O(count). */
void kt_names_init(kt_names *names, size_t count, void *memory);

/* Adds a name with an index >= 0 and returns -1. If the scope contains the name already, nothing changes, and the index
 * of that name is returned. O(1) on average. */
int kt_names_add(kt_names *names, int scope, const char *name, int index);

/* Returns the index of a name in a scope, or -1 if the scope does not contain it. O(1) on average. */
int kt_names_find(const kt_names *names, int scope, const char *name);

/* ---- spelling ---------------------------------------------------------------------------------------------------- */

/* Whether a name matches [A-Za-z_][A-Za-z0-9_-]*; NULL is not valid. */
bool kt_name_is_valid(const char *name);

/* A name in quotes, for messages: control characters become '?', and a long name is cut and ends in "...". */
enum { KT_NAME_TEXT_SIZE = 72 };
typedef struct kt_name_text {
    char text[KT_NAME_TEXT_SIZE];
} kt_name_text;

kt_name_text kt_name_quote(const char *name);

/* ---- "did you mean ...?" ----------------------------------------------------------------------------------------- */

/* A search for the candidate nearest to a name that does not exist, with the Damerau-Levenshtein distance. Insertions,
 * deletions, replacements and swaps of neighbours each count one; case does not count. The distance of a suggested
 * candidate is at most 4. The distance is also at most a third of the longer name's letters, or 1. Among equally near
 * candidates, the first one that was tried is suggested. */
typedef struct kt_nearest {
    const char *wanted;
    size_t length;
    int limit;        /* the largest distance that a candidate may have */
    const char *best; /* the nearest candidate so far; NULL: none */
    int64_t *effort;  /* remaining operations, or NULL: without limit */
} kt_nearest;

/* Begins a search. Each try reduces *effort by about the number of its operations; tries with no effort left do
 * nothing. A caller that shares one *effort among many searches bounds the total cost. */
kt_nearest kt_nearest_make(const char *wanted, int64_t *effort);

/* Compares a candidate; NULL is none. Returns false when no further try can change the result. */
bool kt_nearest_try(kt_nearest *search, const char *candidate);

#endif
