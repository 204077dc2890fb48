/* The list of loop types, for one instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/loop.h"

#define KT_LOOP_EXTERN(id, name) extern const kt_loop_kind KT_KERNEL(kt_loop_##name);
KT_LOOP_LIST(KT_LOOP_EXTERN)
#undef KT_LOOP_EXTERN

#define KT_LOOP_ENTRY(id, name) [id] = &KT_KERNEL(kt_loop_##name),
extern const kt_loop_kind KT_KERNEL(kt_loop_custom);
const kt_loop_kind *const KT_KERNEL(kt_loop_kinds)[KT_LOOP_KIND_COUNT] = {
    KT_LOOP_LIST(KT_LOOP_ENTRY)[KT_LOOP_KIND_CUSTOM] = &KT_KERNEL(kt_loop_custom)};
#undef KT_LOOP_ENTRY
