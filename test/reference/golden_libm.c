/* The functions of doubles that the library calls, computed in long double and rounded once. They replace those of
 * libm. glibc chooses among several versions by the processor, with fused operations or without, whose last bits
 * differ. The functions of long double have a mantissa of 64 bits on x86-64 and are the same everywhere. After
 * rounding, their error is within 0.5005 ulp. To find a missing function that rounds, run test/reference/golden with
 * GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

double atan2(double y, double x) { return (double)atan2l(y, x); }
double cos(double x) { return (double)cosl(x); }
double exp(double x) { return (double)expl(x); }
double hypot(double x, double y) { return (double)hypotl(x, y); }
double log(double x) { return (double)logl(x); }
double pow(double x, double y) { return (double)powl(x, y); }
double sin(double x) { return (double)sinl(x); }
double tan(double x) { return (double)tanl(x); }
double tanh(double x) { return (double)tanhl(x); }

/* gcc makes one call of two, of sin and cos of one angle. */
void sincos(double x, double *sine, double *cosine);
void sincos(double x, double *sine, double *cosine) {
    *sine = (double)sinl(x);
    *cosine = (double)cosl(x);
}
