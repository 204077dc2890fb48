/* Objects in one block of memory: a struct, followed by its arrays.
 *
 * The arrays of an object are one list of fields,
 *
 *     #define KT_THING_FIELDS(X) X(double, value, s->values, "what it holds") ...       type, name, count, meaning
 *
 * which declares, measures, places and poisons them. The struct contains KT_ARENA_DECLARE(KT_THING_FIELDS), and
 *
 *     KT_ARENA_LAYOUT(lay_out, kt_thing, KT_THING_FIELDS, const kt_thing_sizes *s)
 *
 * defines lay_out(memory, s). The function returns the bytes of struct and arrays. Unless memory is NULL, it also sets
 * the pointers of the object at `memory`. The counts in the list are expressions in the parameters of this function.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_ARENA_H
#define KT_BASE_ARENA_H

#include "kinetree/status.h"

#include <assert.h>
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

/* For functions that define `object`, `memory`, `used` or `at`, and the names in the counts. */
#define KT_ARENA_MEASURE(type, name, count, meaning) used += kt_arena_round((count) * sizeof(type));
#define KT_ARENA_PLACE(type, name, count, meaning)                                                                     \
    object->name = (type *)(void *)((char *)memory + at);                                                              \
    at += kt_arena_round((count) * sizeof(type));

#define KT_ARENA_LAYOUT(function, object_type, list, ...)                                                              \
    static size_t function(void *memory, __VA_ARGS__) {                                                                \
        assert((uintptr_t)memory % KT_ARENA_ALIGNMENT == 0);                                                           \
        object_type *object = (object_type *)memory;                                                                   \
        size_t used = kt_arena_round(sizeof *object), at = used;                                                       \
        list(KT_ARENA_MEASURE) if (memory != NULL) { list(KT_ARENA_PLACE) }                                            \
        return used;                                                                                                   \
    }

/* Defines a function that places the arrays of a struct that lies elsewhere, such as the working arrays of a
 * calculation: function(object, memory, ...). The object may be NULL while measuring, unless counts read it. */
#define KT_ARENA_ARRAYS(function, object_type, list, ...)                                                              \
    static size_t function(object_type *object, void *memory, __VA_ARGS__) {                                           \
        assert((uintptr_t)memory % KT_ARENA_ALIGNMENT == 0);                                                           \
        size_t used = 0, at = 0;                                                                                       \
        list(KT_ARENA_MEASURE) if (memory != NULL) { list(KT_ARENA_PLACE) }                                            \
        return used;                                                                                                   \
    }

/* For a function that defines `object`, `byte`, and the names in the counts. */
#define KT_ARENA_POISON(type, name, count, meaning) memset(object->name, byte, (count) * sizeof(type));

/* ---- the caller's memory, and the library's own ------------------------------------------------------------------ */

/* Checks the size and the alignment of a caller's memory. Errors: KT_ERROR_MEMORY at `where`, with the size and
 * alignment that are needed. `query` is the name of the function that returns the size. */
kt_status kt_arena_check(const char *where, const char *query, const void *memory, size_t size, size_t needed,
                         kt_error *error);

/* Checks memory as kt_arena_check does, and clears `needed` bytes for an object. */
kt_status kt_arena_begin(const char *where, const char *query, void *memory, size_t size, size_t needed,
                         kt_error *error);

/* Allocates memory that an object will own, with the alignment that kt_arena_check requires. Returns NULL, with
 * KT_ERROR_MEMORY in *error, if there is no memory. `what` names the object in the message: "modes". */
void *kt_arena_allocate(size_t bytes, const char *what, kt_error *error);

/* The end of a kt_*_create: `memory` is that of kt_arena_allocate, and `status` the result of initialising in it an
 * object whose first member is `void *owned`. If status is KT_OK, the object owns its memory from here on; otherwise
 * the memory is released. Returns `status`. */
kt_status kt_arena_own(void *memory, kt_status status);

/* The body of a kt_*_free: releases the memory that such an object owns, if any; NULL is allowed. */
void kt_arena_free(void *object);

#endif
