/* One number of a generated file, or a vector with one number of each of several states.
 *
 * `real` is such a vector if the user defines NAME_LANES: all operations act on its lanes, and lanes have the same bits
 * as a file without lanes. `number` is a scalar in any case: a number of the model, the time, and the size of a step.
 * Operations between both apply the scalar to all lanes, but a scalar is no vector: SAME makes one.
 *
 * Vectors are those of gcc and clang, which warn of the ABI of vectors as arguments. Static functions alone have these.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/print_function.h"

#include <string.h>

static const char *const lanes_types[] = {
    "#define LANE(x, i) (x)[i]",
    "#define SAME(x) ((x) - (real){0}) /* keeps the sign of zero */",
    "#pragma GCC diagnostic ignored \"-Wpsabi\"",
    "typedef __typeof__((real){0} > 0) mask;",
    "#else",
    "#define LANES 1",
    "#define LANE(x, i) (x)",
    "#define SAME(x) (x)",
    "typedef int mask;",
    "#endif",
    "",
};

static const char *const choose_lines[] = {
    "static inline real CHOOSE(real a, real b, real c) {",
    "    const mask m = a > 0;",
    "    return (real)(((mask)b & m) | ((mask)c & ~m));",
    "}",
    "#else",
    "#define CHOOSE(a, b, c) ((a) > 0 ? (b) : (c))",
    "#endif",
    "",
};

static const char *const above_lines[] = {
    "/* Whether a > b in all lanes. */",
    "static inline int is_above(real a, real b) {",
    "    const mask m = a > b;",
    "    long long all = -1;",
    "    for (int i = 0; i < LANES; i++)",
    "        all &= LANE(m, i);",
    "    return all != 0;",
    "}",
    "",
};

void kt_code_print_lines(FILE *file, const char *const *line, size_t count) {
    for (size_t i = 0; i < count; i++)
        fprintf(file, "%s\n", line[i]);
}

/* The functions of the C library that states pass through, lane by lane. */
static void print_library(FILE *file, const char *functions) {
    for (int k = 0; k <= KT_OP_POWER; k++) {
        const char *const name = kt_op_function_name((kt_op_function)k);
        const bool has_two = k >= KT_OP_ATAN2;
        char call[KT_OP_NAME + 8];
        (void)snprintf(call, sizeof call, "real_%s(", name);
        if (strstr(functions, call) == NULL)
            continue;
        fprintf(file,
                "static inline real %sreal x%s) {\n    for (int i = 0; i < LANES; i++)\n"
                "        LANE(x, i) = (number)%s((double)LANE(x, i)%s);\n    return x;\n}\n\n",
                call, has_two ? ", real y" : "", name, has_two ? ", (double)LANE(y, i)" : "");
    }
}

/* Sines are wrong if a compiler reorders sums, or keeps more digits than a number has. */
static const char *const arithmetic = "#if defined(__FAST_MATH__) || __FLT_EVAL_METHOD__ == 2\n"
                                      "#error \"sums must keep their order\"\n#endif\n\n";

void kt_code_print_lanes(FILE *file, const char *name, const char *functions) {
    fputs(arithmetic, file);
    fprintf(file, "typedef %s_number number;\ntypedef %s_real real;\n\n#ifdef %s_LANES\n#define LANES %s_LANES\n", name,
            name, name, name);
    kt_code_print_lines(file, lanes_types, sizeof lanes_types / sizeof *lanes_types);
    if (strstr(functions, "CHOOSE(") != NULL) {
        fprintf(file, "/* a > 0 ? b : c in each lane */\n#ifdef %s_LANES\n", name);
        kt_code_print_lines(file, choose_lines, sizeof choose_lines / sizeof *choose_lines);
    }
    if (strstr(functions, "is_above(") != NULL)
        kt_code_print_lines(file, above_lines, sizeof above_lines / sizeof *above_lines);
    print_library(file, functions);
}
