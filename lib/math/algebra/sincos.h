/* Sines and cosines of many angles at once, the same bits on every instruction-set level and every libm. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SINCOS_H
#define KT_SINCOS_H

#include "base/isa.h"

#include <stddef.h>
#include <stdint.h>

enum { KT_SINCOS_LANES = 8 };

/* Computes sine[k], cosine[k] of q[angle[k]] for k < count. The arrays sine and cosine have room for whole groups of
 * eight. The array angle continues to a whole group of eight with any indices of q. */
#define KT_SINCOS_DECLARE(isa)                                                                                         \
    void kt_sincos_gather_##isa(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine);
KT_EACH_ISA(KT_SINCOS_DECLARE)
#undef KT_SINCOS_DECLARE

#ifdef KT_ISA
#define kt_sincos_gather KT_PASTE(kt_sincos_gather_, KT_ISA)
#else
#define kt_sincos_gather kt_sincos_gather_baseline
#endif

#endif
