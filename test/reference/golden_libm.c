/* The C library's functions of doubles that the library calls, computed in long double and rounded once, in place of
 * libm's own: glibc chooses among several of each by the processor (with fused operations or without), whose last bits
 * differ. Those of long double, of 64 bits of mantissa on x86-64, are the same everywhere, and what the rounding leaves
 * of their error is within 0.5005 ulp. What is missing here and rounds is found by running test/reference/golden with
 * GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2. */
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
