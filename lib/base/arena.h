/* Objects in one block of memory: a struct, and behind it its arrays.
 *
 * The arrays of an object are one list of fields,
 *
 *     #define KT_THING_FIELDS(X) X(double, value, s->values, "what it holds") ...       type, name, count, meaning
 *
 * which declares, measures, places and poisons them. In the struct stands KT_ARENA_DECLARE(KT_THING_FIELDS), and
 *
 *     KT_ARENA_LAYOUT(lay_out, kt_thing, KT_THING_FIELDS, const kt_thing_sizes *s)
 *
 * defines lay_out(memory, s): it returns the bytes of struct and arrays, and sets the pointers of the object at
 * `memory` unless that is NULL. The counts of the list are written in the names of the parameters.
 */
#ifndef KT_BASE_ARENA_H
#define KT_BASE_ARENA_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { KT_ARENA_ALIGNMENT = 64 }; /* a cache line, and the widest vector */

static inline size_t kt_arena_round(size_t bytes) {
    return (bytes + KT_ARENA_ALIGNMENT - 1) / KT_ARENA_ALIGNMENT * KT_ARENA_ALIGNMENT;
}

/* ---- a list of fields -------------------------------------------------------------------------------------------- */

#define KT_ARENA_MEMBER(type, name, count, meaning) type *name;
#define KT_ARENA_DECLARE(list) list(KT_ARENA_MEMBER)

/* For functions that have `object`, `memory`, `used` or `at`, and the names of the counts. */
#define KT_ARENA_MEASURE(type, name, count, meaning) used += kt_arena_round((count) * sizeof(type));
#define KT_ARENA_PLACE(type, name, count, meaning)                                                                     \
    object->name = (type *)(void *)((char *)memory + at);                                                              \
    at += kt_arena_round((count) * sizeof(type));

#define KT_ARENA_LAYOUT(function, object_type, list, ...)                                                              \
    static size_t function(void *memory, __VA_ARGS__) {                                                                \
        object_type *object = (object_type *)memory;                                                                   \
        size_t used = kt_arena_round(sizeof *object), at = used;                                                       \
        list(KT_ARENA_MEASURE) if (memory != NULL) { list(KT_ARENA_PLACE) }                                            \
        return used;                                                                                                   \
    }

/* The same for arrays of a struct that lies elsewhere, as that of a calculation's working arrays does:
 * function(object, memory, ...). The object may be NULL while measuring, unless counts read it. */
#define KT_ARENA_ARRAYS(function, object_type, list, ...)                                                              \
    static size_t function(object_type *object, void *memory, __VA_ARGS__) {                                           \
        size_t used = 0, at = 0;                                                                                       \
        list(KT_ARENA_MEASURE) if (memory != NULL) { list(KT_ARENA_PLACE) }                                            \
        return used;                                                                                                   \
    }

/* For a function that has `object`, `byte`, and the names of the counts. */
#define KT_ARENA_POISON(type, name, count, meaning) memset(object->name, byte, (count) * sizeof(type));

/* ---- the caller's memory, and the library's own ------------------------------------------------------------------ */

/* Whether a caller's memory will do: KT_ERROR_MEMORY at `where`, with what it must be. `query` is the call that tells
 * the size. */
kt_status kt_arena_check(const char *where, const char *query, const void *memory, size_t size, size_t needed,
                         kt_error *error);

/* The same, and clears `needed` bytes of it for an object. */
kt_status kt_arena_begin(const char *where, const char *query, void *memory, size_t size, size_t needed,
                         kt_error *error);

/* Memory that an object will own, aligned as kt_arena_check asks; NULL, with KT_ERROR_MEMORY in *error, if there is
 * none. `what` names the object in the message: "modes". */
void *kt_arena_allocate(size_t bytes, const char *what, kt_error *error);

/* The end of a kt_*_create: `memory` is that of kt_arena_allocate, `status` that of initialising an object in it whose
 * first member is `void *owned`. The object owns its memory from here on; if it failed, the memory is released. Returns
 * `status`. */
kt_status kt_arena_own(void *memory, kt_status status);

/* kt_*_free: releases what such an object owns, if anything; NULL is let pass. */
void kt_arena_free(void *object);

#endif
