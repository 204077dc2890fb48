/* A and B of steps: the change of the next state y = (q, v) is A (dq, dv) + B dtau.
 *
 *   explicit methods   Y_i = (1, 0) + h sum_j a_ij K_j,   K_i = F(y_i) Y_i + (0, a_tau),   (A, B) = Y behind the stages
 *   semi_implicit      next dv = dv + h da,   next dq = dq + h next dv
 *
 * F has the rows (0, 1) and (da/dq, da/dv). With the forces f of effects, da/dq = a_q + a_tau f_q, and da/dv likewise.
 * Columns of Y and K are the changes of q, v and tau. All matrices are column-major.
 *
 * Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, I.14.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loops.h"
#include "codegen/print_function.h"

void kt_code_print_jacobians(FILE *file, const kt_code_names *n, const kt_model *model) {
    const int nv = kt_model_nv(model);
    fprintf(file,
            "/* da/dq, da/dv and da/dtau of a state, %d x %d each, in turn. Returns as %s_forward. */\n"
            "static int step_jacobians(%s%sconst real *q, const real *v, const real *tau, real *f) {\n",
            nv, nv, n->name, n->take, kt_code_take_time(n));
    if (model->n.effect == 0) {
        fprintf(file, "    return %s_forward_derivatives(%s%sq, v, tau, f, f + %d, f + %d);\n}\n\n", n->name, n->pass,
                kt_code_pass_loop_time(n), nv * nv, 2 * nv * nv);
        return;
    }
    fprintf(file,
            "    real force[%d], by[%d];\n    (void)%s_effects(%s%sq, v, force);\n"
            "    (void)%s_effect_derivatives(%s%sq, v, by, by + %d);\n"
            "    for (int i = 0; i < %d; i++)\n        force[i] += tau[i];\n"
            "    const int code = %s_forward_derivatives(%s%sq, v, force, f, f + %d, f + %d);\n"
            "    for (int c = 0; c < %d && code == 0; c++)\n        for (int m = 0; m < %d; m++)\n"
            "            for (int i = 0; i < %d; i++)\n"
            "                f[%d * c + i] += f[%d + %d * m + i] * by[%d * c + m];\n    return code;\n}\n\n",
            nv, 2 * nv * nv, n->name, n->pass, kt_code_pass_effect_time(n), n->name, n->pass,
            kt_code_pass_effect_time(n), nv * nv, nv, n->name, n->pass, kt_code_pass_loop_time(n), nv * nv, 2 * nv * nv,
            2 * nv, nv, nv, nv, 2 * nv * nv, nv, nv);
}

/* Prints the function that computes the derivatives K_i of a stage from Y_i and F. */
static void print_product(FILE *file, int nv) {
    fprintf(file,
            "/* k = F Y + (0, a_tau) */\n"
            "static void step_change(const real *f, const real *y, real *k) {\n"
            "    for (int c = 0; c < %d; c++)\n        for (int i = 0; i < %d; i++) {\n"
            "            real sum = c < %d ? SAME(0) : f[%d * c + i];\n"
            "            for (int m = 0; m < %d; m++)\n"
            "                sum += f[%d * m + i] * y[%d * c + m];\n"
            "            k[%d * c + i] = y[%d * c + %d + i];\n"
            "            k[%d * c + %d + i] = sum;\n        }\n}\n\n",
            3 * nv, nv, 2 * nv, nv, 2 * nv, nv, 2 * nv, 2 * nv, 2 * nv, nv, 2 * nv, nv);
}

void kt_code_print_explicit_changes(FILE *file, const kt_code_names *n, const kt_model *model) {
    const int nv = kt_model_nv(model), all = 6 * nv * nv;
    print_product(file, nv);
    fprintf(file,
            "/* A and B of an explicit method; a: its matrix, row by row below the diagonal. */\n"
            "static int step_changes(%sint stages, const number *a, const number *b, %sconst real *q, const real *v,\n"
            "                        const real *tau, number h, real *A, real *B) {\n"
            "    real y[%d], slope[4][%d], f[%d], change[%d], k[4][%d];\n"
            "    for (int i = 0; i <= stages; a += i++) {\n"
            "        const number *row = i < stages ? a : b;\n",
            n->take, kt_code_take_time(n), 2 * nv, 2 * nv, 3 * nv * nv, all, all);
    if (kt_code_steps_have_time(n))
        fputs("        number node = 0;\n        for (int j = 0; j < i; j++)\n            node += row[j];\n", file);
    fprintf(file,
            "        for (int l = 0; l < %d; l++) {\n            real sum = {0};\n"
            "            for (int j = 0; j < i; j++)\n                sum += row[j] * k[j][l];\n"
            "            change[l] = (number)(l %% %d == 0 && l < %d) + h * sum;\n        }\n"
            "        for (int l = 0; l < %d; l++) {\n            real sum = {0};\n"
            "            for (int j = 0; j < i; j++)\n                sum += row[j] * slope[j][l];\n"
            "            y[l] = (l < %d ? q[l] : v[l - %d]) + h * sum;\n        }\n"
            "        if (i == stages)\n            break;\n"
            "        for (int l = 0; l < %d; l++)\n            slope[i][l] = y[%d + l];\n",
            all, 2 * nv + 1, 4 * nv * nv, 2 * nv, nv, nv, nv, nv);
    const char *const time = kt_code_steps_have_time(n) ? "t + node * h, " : "";
    fprintf(file,
            "        int code = step_accelerations(%s%sy, y + %d, tau, slope[i] + %d);\n"
            "        if (code == 0)\n            code = step_jacobians(%s%sy, y + %d, tau, f);\n"
            "        if (code != 0)\n            return code;\n",
            n->pass, time, nv, nv, n->pass, time, nv);
    fputs("        step_change(f, change, k[i]);\n    }\n", file);
    if (kt_code_count_loop_rows(model) > 0)
        fprintf(file,
                "    const int closed = step_closed_changes(%s%sy, y + %d, change);\n"
                "    if (closed != 0)\n        return closed;\n",
                n->pass, n->loops_have_time ? "t + h, " : "", nv);
    fprintf(file,
            "    for (int l = 0; l < %d; l++)\n        A[l] = change[l];\n"
            "    for (int l = 0; l < %d; l++)\n        B[l] = change[%d + l];\n    return 0;\n}\n\n",
            4 * nv * nv, 2 * nv * nv, 4 * nv * nv);
}

void kt_code_print_method_changes(FILE *file, const kt_code_names *n, const char *signature, int stages,
                                  const char *tables) {
    fprintf(file,
            "%s {\n    static const number %s;\n    return step_changes(%s%d, a, b, %sq, v, tau, h, A, B);\n}\n\n",
            signature, tables, n->pass, stages, kt_code_pass_time(n));
}

void kt_code_print_semi_implicit_changes(FILE *file, const kt_code_names *n, const kt_model *model,
                                         const char *signature) {
    const int nv = kt_model_nv(model);
    const bool has_loops = kt_code_count_loop_rows(model) > 0;
    fprintf(file,
            "%s {\n    real f[%d], change[%d];\n    int code = step_jacobians(%s%sq, v, tau, f);\n    if (code != 0)\n"
            "        return code;\n    for (int c = 0; c < %d; c++) {\n"
            "        real *column = change + %d * c;\n"
            "        for (int i = 0; i < %d; i++) {\n"
            "            column[%d + i] = h * f[%d * c + i] + (number)(c == %d + i);\n"
            "            column[i] = h * column[%d + i] + (number)(c == i);\n        }\n    }\n",
            signature, 3 * nv * nv, 6 * nv * nv, n->pass, kt_code_pass_time(n), 3 * nv, 2 * nv, nv, nv, nv, nv, nv);
    if (has_loops)
        fprintf(file,
                "    real p[%d], u[%d];\n    code = step_accelerations(%s%sq, v, tau, u);\n    if (code != 0)\n"
                "        return code;\n    for (int i = 0; i < %d; i++) {\n        u[i] = v[i] + h * u[i];\n"
                "        p[i] = q[i] + h * u[i];\n    }\n"
                "    code = step_closed_changes(%s%sp, u, change);\n    if (code != 0)\n        return code;\n",
                nv, nv, n->pass, kt_code_pass_time(n), nv, n->pass, n->loops_have_time ? "t + h, " : "");
    fprintf(file,
            "    for (int l = 0; l < %d; l++)\n        A[l] = change[l];\n"
            "    for (int l = 0; l < %d; l++)\n        B[l] = change[%d + l];\n    return 0;\n}\n\n",
            4 * nv * nv, 2 * nv * nv, 4 * nv * nv);
}
