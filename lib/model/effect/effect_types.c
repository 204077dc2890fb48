/* The list of effect types. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

#define KT_EFFECT_EXTERN(id, name) extern const kt_effect_kind KT_EFFECT(kt_effect_##name);
KT_EFFECT_KIND_LIST(KT_EFFECT_EXTERN)
#undef KT_EFFECT_EXTERN

#define KT_EFFECT_ENTRY(id, name) [id] = &KT_EFFECT(kt_effect_##name),
const kt_effect_kind *const KT_EFFECT(kt_effect_kinds)[KT_EFFECT_TYPE_COUNT] = {KT_EFFECT_KIND_LIST(KT_EFFECT_ENTRY)};
#undef KT_EFFECT_ENTRY
