/* Options of a program that may be compiled with the headers of an earlier version.
 *
 * An options struct begins with its size, and grows only at its end. Members beyond the size that the caller gives keep
 * their defaults. Size 0 means the size in version 0.2, the first version with this member:
 *
 *     kt_batch_options own = kt_batch_options_default();
 *     const kt_batch_options *o = KT_OPTIONS(kt_batch_options, method, &own, options, error);
 *     if (o == NULL)
 *         return KT_ERROR_ARGUMENT;
 *
 * `method` is the last member that version 0.2 has. Options that are complete are not copied: o is then `options`.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_OPTIONS_H
#define KT_BASE_OPTIONS_H

#include "base/inner.h"

#include <stddef.h>

/* The bytes of a struct that ends with this member. */
#define KT_SIZE_TO(type, last)                                                                                         \
    ((offsetof(type, last) + sizeof((type *)0)->last + _Alignof(type) - 1) / _Alignof(type) * _Alignof(type))

/* The kind of an options struct: its name, its bytes now, and its bytes in version 0.2. */
typedef struct kt_options_kind {
    const char *name;
    size_t now, first;
} kt_options_kind;

/* Returns the options to read: `given`, or `own`, which has the defaults and receives the members of `given`. Returns
 * NULL with KT_ERROR_ARGUMENT in *error if the size is not valid. */
KT_INNER const void *kt_options_read(const kt_options_kind *kind, void *own, const void *given, kt_error *error);

#define KT_OPTIONS(type, last, own, given, error)                                                                      \
    ((const type *)kt_options_read(&(const kt_options_kind){#type, sizeof(type), KT_SIZE_TO(type, last)}, own, given,  \
                                   error))

#endif
