/* Sines and cosines of a generated file, in C99 without a library.
 *
 * The double version reduces angles as lib/math/algebra/sincos.c does, in arithmetic alone: no bits are shifted or
 * masked. Angles beyond 2^20 pi/2 first lose a multiple of 2^20 quarter turns, whose products with P1 to P3 are exact,
 * too. Angles beyond 2^40 pi/2 are NaN. The polynomials are from Sun's fdlibm (1993), whose relative errors are
 * below 2^-57. The polynomials have two terms less than Taylor's series. The float version follows Cody & Waite with
 * three parts of pi/2. Its polynomials are from Moshier's Cephes library (1989).
 *
 * A variable of the type `reals` has several angles: a vector of gcc or clang with SINES_WIDTH numbers. The type is a
 * `real` for other compilers, for processors without vectors, and if `real` itself is a vector. SINES_TAKE puts
 * q[place[l]] in lane l. An array would be slow, because a processor that reads a vector from memory waits until its
 * single numbers have been written, and the computation of sines waits, too.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/print_function.h"

static const char *const double_lines[] = {
    "enum { SINES_WIDE = 1647099 }; /* 2^20 pi/2 */",
    "#define SINES_MOST (1048576.0 * SINES_WIDE)",
    "",
    "/* Sine and cosine of n quarter turns and r + e, with |r| <= pi/4: polynomials of fdlibm. */",
    "static inline void sines_of(reals n, reals r, reals e, reals *sine, reals *cosine) {",
    "    const reals z = r * r;",
    "    const reals zz = z * z;",
    "    const reals p0 = (2.5050760253406863e-8 * zz + 0.0001984126982985795) * zz + 0.16666666666666632;",
    "    const reals p1 = (1.58969099521155e-10 * zz + 2.7557313707070068e-6) * zz + 0.00833333333332249;",
    "    const reals q0 = (2.087572321298175e-9 * zz + 2.480158728947673e-5) * zz + 0.0416666666666666;",
    "    const reals q1 = (1.1359647557788195e-11 * zz + 2.7557314351390663e-7) * zz + 0.001388888888887411;",
    "    const reals p = z * p1 - p0, q = q0 - z * q1; /* even and odd powers apart: they need not wait */",
    "    const reals s = r + (e + z * (r * p - 0.5 * e)), half = 0.5 * z, one = 1.0 - half;",
    "    const reals c = one + (((1.0 - one) - half) + (z * z * q - r * e));",
    "    const reals turn = n - 4.0 * NEAREST(0.25 * n); /* -2 to 2 */",
    "    const reals odd = turn * (4.0 - turn * turn) * (1.0 / 3.0); /* -1, 0, 1: sin(n pi/2) */",
    "    const reals even = 1.0 - 0.5 * (turn * turn + odd * odd); /* cos(n pi/2) */",
    "    *sine = odd * c + even * s;",
    "    *cosine = even * c - odd * s;",
    "}",
    "",
    "/* x = n pi/2 + r + e. The products of n with the first three parts of pi/2 are exact. */",
    "static inline reals sines_reduce(reals x, reals *n, reals *e) {",
    "    *n = NEAREST(x * 0.63661977236758138);",
    "    const reals a = x - *n * 0x1.921fb544p+0, p2 = *n * 0x1.0b4611a6p-34, p3 = *n * 0x1.3198a2ep-69;",
    "    const reals b = a - p2, r = b - p3, lost = ((a - b) - p2) - *n * 0x1.b839a252049c1p-104;",
    "    *e = ((b - r) - p3) + lost;",
    "    return r;",
    "}",
    "",
    "/* An angle beyond SINES_WIDE. */",
    "static void sines_wide(reals x, reals *sine, reals *cosine) {",
    "    const number unit = 1048576.0;",
    "    const reals m = unit * NEAREST(x * (0.63661977236758138 / unit));",
    "    const reals a = x - m * 0x1.921fb544p+0, p2 = m * 0x1.0b4611a6p-34, b = a - p2;",
    "    const reals low = (((a - b) - p2) - m * 0x1.3198a2ep-69) - m * 0x1.b839a252049c1p-104;",
    "    reals n, e;",
    "    const reals r = sines_reduce(b, &n, &e), sum = r + low;",
    "    sines_of(n, sum, e + ((r - sum) + low), sine, cosine);",
    "}",
};

static const char *const float_lines[] = {
    "enum { SINES_WIDE = 8192 };",
    "#define SINES_MOST 1e9f",
    "",
    "/* Sine and cosine of n quarter turns and r, with |r| <= pi/4. */",
    "static inline void sines_of(reals n, reals r, reals e, reals *sine, reals *cosine) {",
    "    const reals z = r * r, turn = n - 4.0f * ((0.25f * n + 12582912.0f) - 12582912.0f); /* -2 to 2 */",
    "    const reals s = r + (e + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f - 1.9515295891e-4f * z)));",
    "    const reals c = 1.0f - 0.5f * z +",
    "                   z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + 2.443315711809948e-5f * z));",
    "    const reals odd = turn * (4.0f - turn * turn) * (1.0f / 3.0f); /* -1, 0, 1: sin(n pi/2) */",
    "    const reals even = 1.0f - 0.5f * (turn * turn + odd * odd); /* cos(n pi/2) */",
    "    *sine = odd * c + even * s;",
    "    *cosine = even * c - odd * s;",
    "}",
    "",
    "/* x = n pi/2 + r + e */",
    "static inline reals sines_reduce(reals x, reals *n, reals *e) {",
    "    *n = (x * 0.636619772f + 12582912.0f) - 12582912.0f;",
    "    *e = (reals){0};",
    "    return ((x - *n * 1.5703125f) - *n * 4.83751296997e-4f) - *n * 7.54978994877e-8f;",
    "}",
    "",
    "/* An angle beyond SINES_WIDE, in double precision. */",
    "static void sines_wide(reals x, reals *sine, reals *cosine) {",
    "    reals turn = {0}, r = {0};",
    "    for (int i = 0; i < SINES_ALL; i++) {",
    "        const double a = (double)ANGLE(x, i);",
    "        const double n = NEAREST(a * 0.63661977236758138);",
    "        ANGLE(turn, i) = (number)(n - 4.0 * NEAREST(0.25 * n));",
    "        ANGLE(r, i) = (number)((a - n * 0x1.921fb544p+0) - n * 0x1.0b4611a626331p-34);",
    "    }",
    "    sines_of(turn, r, (reals){0}, sine, cosine);",
    "}",
};

/* The type of several angles. Vectors of 64 bytes pay only for many angles, because an Intel processor disables a port
 * for single numbers while such vectors are in use. */
enum { ANGLES_MANY = 16 };

static const char *const lane_lines[] = {
    "#define SINES_WIDTH 4",
    "#define SINES_TAKE(q, p) {(q)[(p)[0]], (q)[(p)[1]], (q)[(p)[2]], (q)[(p)[3]]}",
    "#else",
    "#define SINES_WIDTH 2",
    "#define SINES_TAKE(q, p) {(q)[(p)[0]], (q)[(p)[1]]}",
    "#endif",
    "#if SINES_WIDTH > 1",
    "typedef real reals __attribute__((vector_size(SINES_WIDTH * sizeof(real))));",
    "#define WHOLE __attribute__((aligned(sizeof(reals))))",
    "#define ANGLE(x, i) (x)[i]",
    "#else",
    "typedef real reals;",
    "#define WHOLE",
    "#define ANGLE(x, i) LANE(x, i)",
    "#endif",
    "#define NEAREST(x) (((x) + 6755399441055744.0) - 6755399441055744.0)",
    "#define SINES_ROOM(n) (((n) + SINES_WIDTH - 1) / SINES_WIDTH * SINES_WIDTH)",
    "#define SINES_ALL (SINES_WIDTH * LANES)",
    "",
};

static const char eight_angles[] =
    "#elif defined(__AVX512F__)\n#define SINES_WIDTH 8\n"
    "#define SINES_TAKE(q, p) \\\n"
    "    {(q)[(p)[0]], (q)[(p)[1]], (q)[(p)[2]], (q)[(p)[3]], (q)[(p)[4]], (q)[(p)[5]], (q)[(p)[6]], (q)[(p)[7]]}\n";

/* A sum of squares finds whether any angle may be wide. */
static const char *const common_lines[] = {
    "",
    "/* Sines and cosines of q[place[i]]. */",
    "static void sines(int count, const real *restrict q, const int *restrict place, real *sine, real *cosine) {",
    "    reals squares = {0}, n, e, s, c;",
    "    number sum = 0;",
    "    for (int i = 0; i < count; i += SINES_WIDTH) {",
    "        const reals x = SINES_TAKE(q, place + i), r = sines_reduce(x, &n, &e);",
    "        sines_of(n, r, e, (reals *)(sine + i), (reals *)(cosine + i));",
    "        squares += x * x;",
    "    }",
    "    for (int l = 0; l < SINES_ALL; l++)",
    "        sum += ANGLE(squares, l);",
    "    for (int i = 0; i < count && !(sum < (number)SINES_WIDE * SINES_WIDE); i += SINES_WIDTH) {",
    "        const reals x = SINES_TAKE(q, place + i);",
    "        sines_wide(x, &s, &c);",
    "        for (int l = 0; l < SINES_ALL; l++) {",
    "            const number a = ANGLE(x, l) < 0 ? -ANGLE(x, l) : ANGLE(x, l);",
    "            if (a < SINES_WIDE)",
    "                continue;",
    "            if (!(a < SINES_MOST))",
    "                ANGLE(s, l) = ANGLE(c, l) = (a - a) / (a - a);",
    "            ANGLE(*(reals *)(sine + i), l) = ANGLE(s, l);",
    "            ANGLE(*(reals *)(cosine + i), l) = ANGLE(c, l);",
    "        }",
    "    }",
    "}",
    "",
};

/* The angles of a model among its positions. The list is filled up to whole vectors, with zeros. */
static void print_places(FILE *file, const kt_model *model) {
    const int count = (int)model->n.angle;
    if (count == 0)
        return;
    fprintf(file, "static const int place[SINES_ROOM(%d)] = {", count);
    for (int i = 0; i < count; i++)
        fprintf(file, "%s%d", i == 0 ? "" : i % 24 == 0 ? ",\n    " : ", ", (int)model->angle[i]);
    fputs("}; /* of angles in q */\n\n", file);
}

void kt_code_print_sincos(FILE *file, const char *name, const kt_model *model) {
    fprintf(file,
            "/* ---- sines and cosines ---- */\n\n"
            "#if defined(%s_LANES) || !(defined(__SSE2__) || defined(__aarch64__))\n#define SINES_WIDTH 1\n"
            "#define SINES_TAKE(q, p) (q)[(p)[0]]\n%s#elif defined(__AVX__) || defined(%s_FLOAT)\n",
            name, model->n.angle >= ANGLES_MANY ? eight_angles : "", name);
    kt_code_print_lines(file, lane_lines, sizeof lane_lines / sizeof *lane_lines);
    fprintf(file, "#ifdef %s_FLOAT\n\n", name);
    kt_code_print_lines(file, float_lines, sizeof float_lines / sizeof *float_lines);
    fputs("\n#else\n\n", file);
    kt_code_print_lines(file, double_lines, sizeof double_lines / sizeof *double_lines);
    fputs("\n#endif\n", file);
    kt_code_print_lines(file, common_lines, sizeof common_lines / sizeof *common_lines);
    print_places(file, model);
}
