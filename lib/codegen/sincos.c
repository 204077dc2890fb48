/* Sines and cosines of a generated file, in C99 without a library.
 *
 * The double version is that of lib/algebra/sincos.c, in arithmetic alone: no bits are shifted or masked, so that a
 * compiler can compute several angles at once. Angles beyond 2^20 pi/2 first lose a multiple of 2^20 quarter turns,
 * whose products with P1 to P3 are exact, too. Angles beyond 2^40 pi/2 are NaN. The float version follows Cody & Waite
 * with three parts of pi/2; its polynomials are those of Moshier's Cephes library (1989).
 */
#include "codegen/print.h"

static const char *const double_lines[] = {
    "enum { SINES_WIDE = 1647099 }; /* 2^20 pi/2 */",
    "",
    "/* Sine and cosine of n quarter turns and r + e, with |r| <= pi/4: Taylor's series. */",
    "static inline void sines_of(real n, real r, real e, real *sine, real *cosine) {",
    "    const real z = r * r;",
    "    const real zz = z * z;",
    "    const real p0 = -((zz * (1.0 / 1307674368000.0) + 1.0 / 39916800.0) * zz + 1.0 / 5040.0) * zz - 1.0 / 6.0;",
    "    const real p1 = ((zz * (1.0 / 355687428096000.0) + 1.0 / 6227020800.0) * zz + 1.0 / 362880.0) * zz +",
    "                    1.0 / 120.0;",
    "    const real q0 = ((zz * (1.0 / 20922789888000.0) + 1.0 / 479001600.0) * zz + 1.0 / 40320.0) * zz + 1.0 / 24.0;",
    "    const real q1 = ((zz * (1.0 / 6402373705728000.0) + 1.0 / 87178291200.0) * zz + 1.0 / 3628800.0) * zz +",
    "                    1.0 / 720.0;",
    "    const real p = p0 + z * p1, q = q0 - z * q1; /* even and odd powers apart: they need not wait */",
    "    const real s = r + (e + z * (r * p - 0.5 * e)), half = 0.5 * z, one = 1.0 - half;",
    "    const real c = one + (((1.0 - one) - half) + (z * z * q - r * e));",
    "    const real turn = n - 4.0 * ((0.25 * n + 6755399441055744.0) - 6755399441055744.0); /* -2 to 2 */",
    "    const real odd = n - 2.0 * ((0.5 * n + 6755399441055744.0) - 6755399441055744.0); /* -1, 0, 1: sin(n pi/2) */",
    "    const real even = 1.0 - 0.5 * (turn * turn + odd * odd); /* cos(n pi/2) */",
    "    *sine = odd * c + even * s;",
    "    *cosine = even * c - odd * s;",
    "}",
    "",
    "/* x = n pi/2 + r + e. The products of n with the first three parts of pi/2 are exact. */",
    "static inline real sines_reduce(real x, real *n, real *e) {",
    "    *n = (x * 0.63661977236758138 + 6755399441055744.0) - 6755399441055744.0;",
    "    const real a = x - *n * 0x1.921fb544p+0, p2 = *n * 0x1.0b4611a6p-34, p3 = *n * 0x1.3198a2ep-69;",
    "    const real b = a - p2, r = b - p3, lost = ((a - b) - p2) - *n * 0x1.b839a252049c1p-104;",
    "    *e = ((b - r) - p3) + lost;",
    "    return r;",
    "}",
    "",
    "/* An angle beyond SINES_WIDE. */",
    "static void sines_wide(real x, real *sine, real *cosine) {",
    "    const number most = 1048576.0 * SINES_WIDE, unit = 1048576.0;",
    "    const real m = unit * ((x * (0.63661977236758138 / unit) + 6755399441055744.0) - 6755399441055744.0);",
    "    const real a = x - m * 0x1.921fb544p+0, p2 = m * 0x1.0b4611a6p-34, b = a - p2;",
    "    const real low = (((a - b) - p2) - m * 0x1.3198a2ep-69) - m * 0x1.b839a252049c1p-104;",
    "    real n, e;",
    "    const real r = sines_reduce(b, &n, &e), sum = r + low;",
    "    sines_of(n, sum, e + ((r - sum) + low), sine, cosine);",
    "    for (int i = 0; i < LANES; i++)",
    "        if (!(LANE(x, i) < most && LANE(x, i) > -most))",
    "            LANE(*sine, i) = LANE(*cosine, i) = (most - most) / (most - most);",
    "}",
};

static const char *const float_lines[] = {
    "enum { SINES_WIDE = 8192 };",
    "",
    "/* Sine and cosine of n quarter turns and r, with |r| <= pi/4. */",
    "static inline void sines_of(real n, real r, real e, real *sine, real *cosine) {",
    "    const real z = r * r, turn = n - 4.0f * ((0.25f * n + 12582912.0f) - 12582912.0f); /* -2 to 2 */",
    "    const real s = r + (e + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f - 1.9515295891e-4f * z)));",
    "    const real c = 1.0f - 0.5f * z +",
    "                   z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + 2.443315711809948e-5f * z));",
    "    const real odd = n - 2.0f * ((0.5f * n + 12582912.0f) - 12582912.0f); /* -1, 0, 1: sin(n pi/2) */",
    "    const real even = 1.0f - 0.5f * (turn * turn + odd * odd); /* cos(n pi/2) */",
    "    *sine = odd * c + even * s;",
    "    *cosine = even * c - odd * s;",
    "}",
    "",
    "/* x = n pi/2 + r + e */",
    "static inline real sines_reduce(real x, real *n, real *e) {",
    "    *n = (x * 0.636619772f + 12582912.0f) - 12582912.0f;",
    "    *e = SAME(0.0f);",
    "    return ((x - *n * 1.5703125f) - *n * 4.83751296997e-4f) - *n * 7.54978994877e-8f;",
    "}",
    "",
    "/* An angle beyond SINES_WIDE, in double precision. */",
    "static void sines_wide(real x, real *sine, real *cosine) {",
    "    const double most = 1e9;",
    "    real turn = {0}, r = {0};",
    "    for (int i = 0; i < LANES; i++) {",
    "        const double a = (double)LANE(x, i);",
    "        const double n = (a * 0.63661977236758138 + 6755399441055744.0) - 6755399441055744.0;",
    "        LANE(turn, i) = (number)(n - 4.0 * ((0.25 * n + 6755399441055744.0) - 6755399441055744.0));",
    "        LANE(r, i) = (number)((a - n * 0x1.921fb544p+0) - n * 0x1.0b4611a626331p-34);",
    "    }",
    "    sines_of(turn, r, SAME(0.0f), sine, cosine);",
    "    for (int i = 0; i < LANES; i++)",
    "        if (!((double)LANE(x, i) < most && (double)LANE(x, i) > -most))",
    "            LANE(*sine, i) = LANE(*cosine, i) = (number)((most - most) / (most - most));",
    "}",
};

/* How many numbers of double precision a vector has. Angles are filled up to whole vectors. */
static const char *const lane_lines[] = {
    "#if defined(__AVX512F__)",
    "#define SINES_BYTES 64",
    "#elif defined(__AVX__)",
    "#define SINES_BYTES 32",
    "#elif defined(__SSE2__) || defined(__aarch64__)",
    "#define SINES_BYTES 16",
    "#else",
    "#define SINES_BYTES (int)sizeof(real)",
    "#endif",
    "#define SINES_LANES (SINES_BYTES > (int)sizeof(real) ? SINES_BYTES / (int)sizeof(real) : 1)",
    "#define SINES_ROOM(n) (((n) + SINES_LANES - 1) / SINES_LANES * SINES_LANES)",
    "",
};

static const char *const common_lines[] = {
    "",
    "/* The first loop has no branches, and a compiler may compute several angles at once. */",
    "static void sines(int count, const real *restrict x, real *restrict sine, real *restrict cosine) {",
    "    for (int i = 0; i < count; i++) {",
    "        real n, e;",
    "        const real r = sines_reduce(x[i], &n, &e);",
    "        sines_of(n, r, e, &sine[i], &cosine[i]);",
    "    }",
    "    for (int i = 0; i < count; i++)",
    "        for (int l = 0; l < LANES; l++)",
    "            if (!(LANE(x[i], l) < SINES_WIDE && LANE(x[i], l) > -SINES_WIDE)) {",
    "                real s, c;",
    "                sines_wide(x[i], &s, &c);",
    "                LANE(sine[i], l) = LANE(s, l);",
    "                LANE(cosine[i], l) = LANE(c, l);",
    "            }",
    "}",
    "",
};

void kt_code_print_sincos(FILE *file, const char *name) {
    fputs("/* ---- sines and cosines ---- */\n\n", file);
    kt_code_print_lines(file, lane_lines, sizeof lane_lines / sizeof *lane_lines);
    fprintf(file, "#ifdef %s_FLOAT\n\n", name);
    kt_code_print_lines(file, float_lines, sizeof float_lines / sizeof *float_lines);
    fputs("\n#else\n\n", file);
    kt_code_print_lines(file, double_lines, sizeof double_lines / sizeof *double_lines);
    fputs("\n#endif\n", file);
    kt_code_print_lines(file, common_lines, sizeof common_lines / sizeof *common_lines);
}
