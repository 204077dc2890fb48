/* Shared by the files of joints, loops, effects, shapes and functions, which define the descriptors of their types
 * (kinetree/descriptor.h).
 *
 * Some files are compiled several times, for instruction sets, derivatives and lanes. Such a file defines its
 * descriptor in one of these compilations only, within #if KT_DESCRIBES.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_DESCRIBE_H
#define KT_MODEL_DESCRIBE_H

#include "base/isa.h"
#include "kinetree/descriptor.h"

#include <stddef.h>

#if defined(KT_LANES)
#define KT_DESCRIBES 0
#elif defined(KT_ISA)
#define KT_DESCRIBES_baseline 1
#define KT_DESCRIBES_v3 0
#define KT_DESCRIBES_v4 0
#define KT_DESCRIBES_dual 0
#define KT_DESCRIBES KT_PASTE(KT_DESCRIBES_, KT_ISA)
#else
#define KT_DESCRIBES 1
#endif

/* The names of a list X(id, name), as an array. */
#define KT_LISTED_NAME(id, name) #name,

/* Members of a descriptor: the array `keys` of its file. */
#define KT_DESCRIPTOR_KEYS .keys = keys, .key_count = (int)(sizeof keys / sizeof *keys)

/* Members of an effect's descriptor: the quantities that can be recorded. */
#define KT_QUANTITIES(...)                                                                                             \
    .quantities = (const kt_effect_quantity[]){__VA_ARGS__},                                                           \
    .quantity_count = (int)(sizeof((const kt_effect_quantity[]){__VA_ARGS__}) / sizeof(kt_effect_quantity))
#define KT_QUANTITIES_FORCE KT_QUANTITY_FORCE_X, KT_QUANTITY_FORCE_Y, KT_QUANTITY_FORCE_Z
#define KT_QUANTITIES_MOMENT KT_QUANTITY_MOMENT_X, KT_QUANTITY_MOMENT_Y, KT_QUANTITY_MOMENT_Z
#define KT_QUANTITIES_JOINT                                                                                            \
    KT_QUANTITIES(KT_QUANTITY_JOINT_FORCE, KT_QUANTITY_POWER, KT_QUANTITY_COORDINATE, KT_QUANTITY_COORDINATE_RATE)
#define KT_QUANTITIES_LINE                                                                                             \
    KT_QUANTITIES(KT_QUANTITY_TENSION, KT_QUANTITY_POWER, KT_QUANTITY_LENGTH, KT_QUANTITY_LENGTH_RATE)

/* Keys that several types have. */

/* The rule of impacts for a one-sided constraint. */
#define KT_POISSON_KEY(offset, of)                                                                                     \
    {"poisson",                                                                                                        \
     KT_KEY_FLAG,                                                                                                      \
     offset,                                                                                                           \
     "",                                                                                                               \
     of "true: e follows Poisson's rule (impulses) instead of Newton's (speeds)",                                      \
     .needed = false},
#define KT_BETWEEN_KEY(object)                                                                                         \
    { "between", KT_KEY_ENDS, offsetof(object, between), "", "the two ends, on two bodies", .needed = true }
#define KT_JOINT_KEY(object, words)                                                                                    \
    { "joint", KT_KEY_JOINT, offsetof(object, joint), "", words, .needed = true }

/* Whether a key of the type refers to the member at this offset; false if the type does not exist (NULL). */
bool kt_descriptor_reads(const kt_descriptor *descriptor, size_t offset);

/* Returns the number of ends of a type, at most 2. */
int kt_descriptor_end_count(const kt_descriptor *descriptor);

#endif
