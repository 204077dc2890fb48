/* Status codes and error messages.
 *
 * Every call that can fail returns a kt_status and fills a caller-owned kt_error, if one is given. On failure all
 * outputs are unchanged. The library never prints, exits or aborts.
 *
 * A pointer must be given unless its docstring allows NULL. If such a pointer is NULL, or data belong to another model,
 * the call returns KT_ERROR_ARGUMENT and names the argument. Arrays of no numbers may be NULL. Velocities that are an
 * input of an evaluation may be NULL everywhere: zero.
 *
 * Some calls cannot fail. If an index is out of range, a pointer is NULL or data belong to another model, such a call
 * returns NULL, -1, 0 or NaN and writes nothing.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_STATUS_H
#define KINETREE_STATUS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of these headers, semantic versioning; KT_VERSION is the version as text. The function kt_version returns
 * the version of the library. */
#define KT_VERSION_MAJOR 0
#define KT_VERSION_MINOR 2
#define KT_VERSION_PATCH 0
#define KT_VERSION "0.2.0"

/* Attributes: a function of the library, a status that must be used, and a printf-like text with its first argument.
 * For compilers without such attributes, the macros are empty. */
#if defined(__GNUC__)
#define KT_API __attribute__((visibility("default")))
#define KT_CHECKED __attribute__((warn_unused_result))
#define KT_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define KT_API
#define KT_CHECKED
#define KT_PRINTF(text, first)
#endif

/* One list gives the codes, their pinned values and their texts: X(id, value, text). */
#define KT_STATUS_LIST(X)                                                                                              \
    X(KT_OK, 0, "done")                                                                                                \
    X(KT_ERROR_ARGUMENT, 1, "an argument of the call is wrong")                                                        \
    X(KT_ERROR_MEMORY, 2, "not enough memory, or the memory given is too small or misaligned")                         \
    X(KT_ERROR_MODEL, 3, "the description of the mechanism is wrong")                                                  \
    X(KT_ERROR_SINGULAR, 4, "the equations have no unique solution: no inertia, or a singular position")               \
    X(KT_ERROR_CONSTRAINT, 5, "the loops cannot be closed, or contradict each other")                                  \
    X(KT_ERROR_NOT_FINITE, 6, "a value is not finite")                                                                 \
    X(KT_ERROR_STEP, 7, "the integration step became too small")                                                       \
    X(KT_ERROR_CALLBACK, 8, "a callback asked to stop")                                                                \
    X(KT_ERROR_FILE, 9, "a file cannot be read or written")                                                            \
    X(KT_ERROR_SCENE, 10, "the scene file is wrong")                                                                   \
    X(KT_ERROR_UNSUPPORTED, 11, "not supported yet")                                                                   \
    X(KT_ERROR_EFFECT, 12, "an effect cannot be computed in this state")

/* How a call ended. Values are pinned: a code keeps its number in every version. */
typedef enum kt_status {
#define KT_STATUS_ENUM(name, value, text) name = value,
    KT_STATUS_LIST(KT_STATUS_ENUM)
#undef KT_STATUS_ENUM
} kt_status;

/* Bytes of the texts of a kt_error, the terminating zero included. */
enum {
    KT_WHERE_SIZE = 160,   /* of `where` */
    KT_MESSAGE_SIZE = 480, /* of `message` */
};

/* The cause of an error, its place and its remedy. Texts are always terminated. A text that is too long ends in "...".
 */
typedef struct kt_error {
    kt_status code;                /* the status that the call returned */
    char where[KT_WHERE_SIZE];     /* file:line:column, body, joint, loop or time; may be empty */
    char message[KT_MESSAGE_SIZE]; /* the cause and the remedy */
} kt_error;

/* Returns the text of a code; "unknown status" for an invalid value. Static storage. */
KT_API const char *kt_status_text(kt_status status);

/* Fills *error (which may be NULL) with printf-style texts and returns code. A function can therefore end with "return
 * kt_error_set(...)". `where` may be NULL or empty. Allocates nothing. */
KT_API kt_status kt_error_set(kt_error *error, kt_status code, const char *where, const char *format, ...)
    KT_PRINTF(4, 5);

/* Returns the version of the loaded library, "MAJOR.MINOR.PATCH". KT_VERSION is the version of the headers. */
KT_API const char *kt_version(void);

/* Returns the size of a public struct in the loaded library by its name. For example, kt_struct_size("kt_run") is
 * sizeof(kt_run). Returns 0 if there is no struct of this name. For bindings that declare structs by themselves.
 * O(structs). */
KT_API size_t kt_struct_size(const char *name);

#ifdef __cplusplus
}
#endif
#endif
