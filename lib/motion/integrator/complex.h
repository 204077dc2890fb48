/* Arithmetic of complex numbers. The C library's own type is avoided: its products look for infinities, which costs
 * calls. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_COMPLEX_H
#define KT_INTEGRATOR_COMPLEX_H

#include "kinetree/integrator.h"

static inline kt_complex kt_complex_add(kt_complex a, kt_complex b) { return (kt_complex){a.re + b.re, a.im + b.im}; }

static inline kt_complex kt_complex_subtract(kt_complex a, kt_complex b) {
    return (kt_complex){a.re - b.re, a.im - b.im};
}

static inline kt_complex kt_complex_multiply(kt_complex a, kt_complex b) {
    return (kt_complex){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

/* 1 / a, unless |a|^2 overflows or underflows. */
static inline kt_complex kt_complex_invert(kt_complex a) {
    const double square = a.re * a.re + a.im * a.im;
    return (kt_complex){a.re / square, -a.im / square};
}

#endif
