/* Names: tables from names to indices, what a name may look like, and the name that was meant.
 *
 * A table lives in the caller's memory and points at the caller's strings, which must outlive it. Looking up reads
 * only.
 */
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

/* Open addressing with linear probing, at most two thirds full. Names of different scopes (any number: the index of the
 * body whose markers they are, say) do not know of each other. */
typedef struct kt_names {
    kt_name_slot *slots;
    size_t mask; /* number of slots, a power of two, minus one */
} kt_names;

/* Bytes that a table of `count` names takes. */
size_t kt_names_size(size_t count);

/* An empty table for up to `count` names in kt_names_size(count) bytes of memory, aligned as a pointer is. O(count). */
void kt_names_init(kt_names *names, size_t count, void *memory);

/* Adds a name with an index >= 0 and returns -1. Where the scope has the name already nothing changes, and its index is
 * returned. O(1) on average. */
int kt_names_add(kt_names *names, int scope, const char *name, int index);

/* The index of a name in a scope, -1 where there is none. O(1) on average. */
int kt_names_find(const kt_names *names, int scope, const char *name);

/* ---- spelling ---------------------------------------------------------------------------------------------------- */

/* [A-Za-z_][A-Za-z0-9_-]*; NULL is not valid. */
bool kt_name_is_valid(const char *name);

/* A name as messages show it, in quotes: control characters turn into '?', and a long name is cut ("..."). */
enum { KT_NAME_TEXT_SIZE = 72 };
typedef struct kt_name_text {
    char text[KT_NAME_TEXT_SIZE];
} kt_name_text;

kt_name_text kt_name_quote(const char *name);

/* ---- "did you mean ...?" ----------------------------------------------------------------------------------------- */

/* A search for the candidate nearest to a name that does not exist, by the Damerau-Levenshtein distance (insertions,
 * deletions, replacements and swaps of neighbours each count one; case does not count). Candidates farther than a third
 * of the longer one's letters are no suggestion; of equally near ones the first tried is. */
typedef struct kt_nearest {
    const char *wanted;
    size_t length;
    int limit;        /* what a candidate may still differ by */
    const char *best; /* NULL: nothing near yet */
    int64_t *effort;  /* what may still be spent, or NULL: without limit */
} kt_nearest;

/* *effort goes down by about the number of operations of each try; where it is used up, tries do nothing. So a caller
 * bounds the cost of many searches among many candidates. */
kt_nearest kt_nearest_make(const char *wanted, int64_t *effort);

/* Returns false when no further try can change the answer. NULL is no candidate. */
bool kt_nearest_try(kt_nearest *search, const char *candidate);

#endif
