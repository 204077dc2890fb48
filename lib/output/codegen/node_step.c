/* Steps of a generated file: y = (q, v, x), y' = (rate of q, accelerations, rates of auxiliary states x).
 *
 *   explicit methods   y_i = y + h sum_j a_ij k_j,   k_i = y'(y_i),   next y = y + h sum_i b_i k_i
 *   semi_implicit      next v = v + h a,   next q = q (+) h next v
 *
 * The joint forces are constant during a step; forces of effects follow the stages, at t + h sum_j a_ij. A quaternion p
 * has the rate p (0, w) / 2, and p (+) d = p exp(d / 2), as in lib/model/joint/position.c. The quaternion has unit norm
 * after the step. With loops, the state is projected after the step (step_loops.c). The tables and the arithmetic are
 * the same as in the library, so that both agree to rounding.
 *
 * Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, II.1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loops.h"
#include "codegen/print_function.h"
#include "kinetree/codegen.h"

/* Whether the joint of a body has a quaternion. */
static bool has_quaternion(const kt_coordinates *c) { return c->nq > c->nv; }

/* Counts the quaternions of a model. */
static int count_quaternions(const kt_model *model) {
    int count = 0;
    for (int b = 1; b < kt_model_body_count(model); b++) {
        const kt_coordinates c = kt_body_coordinates(model, b);
        count += has_quaternion(&c);
    }
    return count;
}

/* Whether the functions need step_move. */
static bool moves_positions(const kt_model *model, unsigned functions) {
    return (functions & KT_CODEGEN_SEMI_IMPLICIT) ||
           (kt_code_count_closed_rows(model) > 0 &&
            (functions & (KT_CODEGEN_STEPS | KT_CODEGEN_PROJECT | KT_CODEGEN_STEP_DERIVATIVES)));
}

bool kt_code_steps_read_sines(const kt_model *model, unsigned functions) {
    return moves_positions(model, functions) && count_quaternions(model) > 0;
}

bool kt_code_steps_read_roots(const kt_model *model, unsigned functions) {
    return (functions & (KT_CODEGEN_STEPS | KT_CODEGEN_PROJECT)) && count_quaternions(model) > 0;
}

/* ---- quaternions ------------------------------------------------------------------------------------------------- */

/* Bodies, unlike links, have the order of their coordinates. */
static void print_quaternions(FILE *file, const kt_model *model) {
    fprintf(file, "/* Quaternions: first position, first velocity, body. */\nstatic const int step_turn[%d][3] = {\n",
            count_quaternions(model));
    for (int b = 1; b < kt_model_body_count(model); b++) {
        const kt_coordinates c = kt_body_coordinates(model, b);
        if (has_quaternion(&c))
            fprintf(file, "    {%d, %d, %d}, /* %s */\n", c.q + c.nq - 4, c.v + c.nv - 3, b, kt_joint_name(model, b));
    }
    fputs("};\n\n", file);
}

static const char *const turn_product = "/* out = p u */\n"
                                        "static void step_multiply(const real *p, const real *u, real *out) {\n"
                                        "    out[0] = p[0] * u[0] - p[1] * u[1] - p[2] * u[2] - p[3] * u[3];\n"
                                        "    out[1] = p[0] * u[1] + p[1] * u[0] + p[2] * u[3] - p[3] * u[2];\n"
                                        "    out[2] = p[0] * u[2] + p[2] * u[0] + p[3] * u[1] - p[1] * u[3];\n"
                                        "    out[3] = p[0] * u[3] + p[3] * u[0] + p[1] * u[2] - p[2] * u[1];\n"
                                        "}\n\n";

/* Scales quaternions to unit norm. */
static void print_units(FILE *file, int count) {
    fprintf(file,
            "/* Gives quaternions unit norm. Returns 0, or the number of a body for which there is none. */\n"
            "static int step_units(real *q) {\n"
            "    for (int k = 0; k < %d; k++) {\n"
            "        real *p = q + step_turn[k][0];\n"
            "        const real square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3];\n"
            "        const real scale = 1 / real_sqrt(square);\n"
            "        if (!is_above(square, SAME(0)) || !is_above(scale, SAME(0)))\n"
            "            return step_turn[k][2];\n"
            "        for (int i = 0; i < 4; i++)\n"
            "            p[i] *= scale;\n"
            "    }\n"
            "    return 0;\n"
            "}\n\n",
            count);
}

/* The loop over plain numbers, up to each quaternion, and after the last quaternion. i, j: positions, velocities. */
static void print_walk(FILE *file, const kt_model *model, const char *plain, const char *turn) {
    const int count = count_quaternions(model), nq = kt_model_nq(model);
    if (count == 0) {
        fprintf(file, "    for (int i = 0, j = 0; i < %d; i++, j++)\n        %s", nq, plain);
        return;
    }
    fprintf(file,
            "    for (int i = 0, j = 0, k = 0; i < %d; k++) {\n"
            "        for (; i < (k < %d ? step_turn[k][0] : %d); i++, j++)\n            %s"
            "        if (k == %d)\n            break;\n%s        i += 4;\n        j += 3;\n    }\n",
            nq, count, nq, plain, count, turn);
}

/* ---- methods ----------------------------------------------------------------------------------------------------- */

/* Arguments that only some models have. */
static const char *take_states(const kt_model *model) { return model->n.x > 0 ? "const real *x, " : ""; }
static const char *pass_states(const kt_model *model) { return model->n.x > 0 ? "x, " : ""; }

/* The accelerations of a state, with the forces of effects; followed by the rates of auxiliary states. */
static void print_rates(FILE *file, const kt_code_names *n, const kt_model *model) {
    const int nv = kt_model_nv(model);
    fprintf(file, "/* Accelerations of a state%s. Returns as %s_forward. */\nstatic int step_accelerations(%s%s",
            model->n.x > 0 ? ", and rates of its auxiliary states behind them" : "", n->name, n->take,
            kt_code_take_time(n));
    fprintf(file, "const real *q, const real *v, %sconst real *tau, real *a) {\n", take_states(model));
    if (model->n.effect > 0)
        fprintf(file,
                "    real force[%d];\n    (void)%s_effects(%s%sq, v, %sforce);\n    for (int i = 0; i < %d; i++)\n"
                "        force[i] += tau[i];\n",
                nv, n->name, n->pass, kt_code_pass_effect_time(n), pass_states(model), nv);
    if (model->n.x > 0)
        fprintf(file, "    (void)%s_states(%s%sq, v, x, a + %d);\n", n->name, n->pass, kt_code_pass_effect_time(n), nv);
    fprintf(file, "    return %s_forward(%s%sq, v, %s, a);\n}\n\n", n->name, n->pass, kt_code_pass_loop_time(n),
            model->n.effect > 0 ? "force" : "tau");
}

/* Copies the state after a step to the outputs. */
static void print_outputs_of_step(FILE *file, const char *q, int nq, const char *v, int first, int nv, int nx) {
    fprintf(file, "    for (int i = 0; i < %d; i++)\n        next_q[i] = %s[i];\n", nq, q);
    fprintf(file, "    for (int i = 0; i < %d; i++)\n        next_v[i] = %s[%d + i];\n", nv, v, first);
    if (nx > 0)
        fprintf(file, "    for (int i = 0; i < %d; i++)\n        next_x[i] = %s[%d + i];\n", nx, v, first + nv);
    fputs("    return 0;\n}\n\n", file);
}

static void print_step_rate(FILE *file, const kt_model *model) {
    fputs("/* q' for the velocities v; p' = p (0, w) / 2 for quaternions. */\n"
          "static void step_rate(const real *q, const real *v, real *rate) {\n",
          file);
    if (count_quaternions(model) == 0)
        fputs("    (void)q;\n", file);
    print_walk(file, model, "rate[i] = v[j];\n",
               "        const real u[4] = {SAME(0), v[j] / 2, v[j + 1] / 2, v[j + 2] / 2};\n"
               "        step_multiply(q + i, u, rate + i);\n");
    fputs("}\n\n", file);
}

/* The stages; l: a number of the state. */
static void print_stages(FILE *file, const kt_code_names *n, const kt_model *model) {
    const int nq = kt_model_nq(model), nv = kt_model_nv(model), nx = (int)model->n.x;
    fprintf(file, "    for (int i = 0; i <= stages; a += i++) {\n"
                  "        const number *row = i < stages ? a : b;\n");
    if (kt_code_steps_have_time(n))
        fputs("        number node = 0;\n        for (int j = 0; j < i; j++)\n            node += row[j];\n", file);
    fprintf(file,
            "        for (int l = 0; l < %d; l++) {\n"
            "            real sum = {0};\n"
            "            for (int j = 0; j < i; j++)\n"
            "                sum += row[j] * slope[j][l];\n"
            "            y[l] = (l < %d ? q[l] : ",
            nq + nv + nx, nq);
    if (nx > 0)
        fprintf(file, "l >= %d ? x[l - %d] : ", nq + nv, nq + nv);
    fprintf(file,
            "v[l - %d]) + h * sum;\n"
            "        }\n"
            "        if (i == stages)\n            break;\n"
            "        step_rate(y, y + %d, slope[i]);\n"
            "        code = step_accelerations(%s%sy, y + %d, ",
            nq, nq, n->pass, kt_code_steps_have_time(n) ? "t + node * h, " : "", nq);
    if (nx > 0)
        fprintf(file, "y + %d, ", nq + nv);
    fprintf(file, "tau, slope[i] + %d);\n        if (code != 0)\n            return code;\n    }\n", nq);
}

/* Projects the state after a step. */
static void print_projected(FILE *file, const kt_code_names *n, const kt_model *model, const char *q, const char *v) {
    if (kt_code_count_loop_rows(model) > 0)
        fprintf(file, "    code = step_closed(%s%s%s, %s);\n    if (code != 0)\n        return code;\n", n->pass,
                n->loops_have_time ? "t + h, " : "", q, v);
}

/* Prints step_explicit(), which all explicit methods share. */
static void print_explicit(FILE *file, const kt_code_names *n, const kt_model *model) {
    const int nq = kt_model_nq(model), nv = kt_model_nv(model), nx = (int)model->n.x;
    print_step_rate(file, model);
    fprintf(file,
            "/* A step of an explicit method; a: its matrix, row by row below the diagonal. */\n"
            "static int step_explicit(%sint stages, const number *a, const number *b, %sconst real *q, const real *v,\n"
            "                         %sconst real *tau, number h, real *next_q, real *next_v%s) {\n"
            "    real y[%d], slope[4][%d];\n    int code = 0;\n",
            n->take, kt_code_take_time(n), take_states(model), nx > 0 ? ", real *next_x" : "", nq + nv + nx,
            nq + nv + nx);
    print_stages(file, n, model);
    if (count_quaternions(model) > 0)
        fputs("    code = step_units(y);\n    if (code != 0)\n        return code;\n", file);
    char v[32];
    (void)snprintf(v, sizeof v, "y + %d", nq);
    print_projected(file, n, model, "y", v);
    print_outputs_of_step(file, "y", nq, "y", nq, nv, nx);
}

/* A method with its tables. */
static void print_method(FILE *file, const kt_code_names *n, const kt_model *model, const char *signature, int stages,
                         const char *tables) {
    fprintf(file,
            "%s {\n    static const number %s;\n"
            "    return step_explicit(%s%d, a, b, %sq, v, %stau, h, next_q, next_v%s);\n}\n\n",
            signature, tables, n->pass, stages, kt_code_pass_time(n), pass_states(model),
            model->n.x > 0 ? ", next_x" : "");
}

/* q (+) d */
static void print_move(FILE *file, const kt_model *model) {
    fprintf(file,
            "/* next = q (+) d; next may be q. Returns 0, or the number of a body whose quaternion has no norm. */\n"
            "static int step_move(const real *q, const real *d, real *next) {\n");
    print_walk(file, model, "next[i] = q[i] + d[j];\n",
               "        const real *e = d + j, p[4] = {q[i], q[i + 1], q[i + 2], q[i + 3]};\n"
               "        const real half = real_sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) / 2;\n"
               "        static const int first[SINES_ROOM(1)] = {0};\n"
               "        WHOLE real s[SINES_ROOM(1)], c[SINES_ROOM(1)];\n"
               "        sines(1, &half, first, s, c);\n"
               "        const real scale = CHOOSE(half, s[0] / half, SAME(1)) / 2;\n"
               "        const real turn[4] = {c[0], scale * e[0], scale * e[1], scale * e[2]};\n"
               "        step_multiply(p, turn, next + i);\n");
    fputs(count_quaternions(model) > 0 ? "    return step_units(next);\n}\n\n" : "    return 0;\n}\n\n", file);
}

/* Prints the step of the semi-implicit method: velocities first, with which the positions then move. */
static void print_semi_implicit(FILE *file, const kt_code_names *n, const kt_model *model, const char *signature) {
    const int nq = kt_model_nq(model), nv = kt_model_nv(model), nx = (int)model->n.x;
    fprintf(file,
            "%s {\n    real p[%d], u[%d], d[%d];\n    int code = step_accelerations(%s%sq, v, %stau, u);\n    if (code "
            "!= 0)\n"
            "        return code;\n    for (int i = 0; i < %d; i++) {\n        u[i] = v[i] + h * u[i];\n"
            "        d[i] = h * u[i];\n    }\n",
            signature, nq, nv + nx, nv, n->pass, kt_code_pass_time(n), pass_states(model), nv);
    if (nx > 0)
        fprintf(file, "    for (int i = 0; i < %d; i++)\n        u[%d + i] = x[i] + h * u[%d + i];\n", nx, nv, nv);
    fputs("    code = step_move(q, d, p);\n    if (code != 0)\n        return code;\n", file);
    print_projected(file, n, model, "p", "u");
    print_outputs_of_step(file, "p", nq, "u", 0, nv, nx);
}

/* Explicit methods: stages, and tables. */
static const struct {
    int stages;
    const char *tables;
} explicit_methods[2] = {
    {2, "a[] = {1}, b[] = {(number)0.5, (number)0.5}"},
    {4, "a[] = {(number)0.5, 0, (number)0.5, 0, 0, 1};\n"
        "    static const number b[] = {(number)(1.0 / 6.0), (number)(1.0 / 3.0), (number)(1.0 / 3.0),\n"
        "                             (number)(1.0 / 6.0)}"},
};

/* A and B of the steps among the functions. */
static void print_changes(FILE *file, const kt_code_names *names, const kt_model *model, unsigned functions,
                          const char *const signature[KT_CODE_STEPS]) {
    kt_code_print_jacobians(file, names, model);
    if (functions & (KT_CODEGEN_HEUN_DERIVATIVES | KT_CODEGEN_RK4_DERIVATIVES))
        kt_code_print_explicit_changes(file, names, model);
    for (int k = 0; k < 2; k++)
        if (functions & (k == 0 ? KT_CODEGEN_HEUN_DERIVATIVES : KT_CODEGEN_RK4_DERIVATIVES))
            kt_code_print_method_changes(file, names, signature[4 + k], explicit_methods[k].stages,
                                         explicit_methods[k].tables);
    if (functions & KT_CODEGEN_SEMI_IMPLICIT_DERIVATIVES)
        kt_code_print_semi_implicit_changes(file, names, model, signature[6]);
}

void kt_code_print_steps(FILE *file, const kt_code_names *names, const kt_model *model, unsigned functions,
                         const char *const signature[KT_CODE_STEPS]) {
    const int count = count_quaternions(model);
    const unsigned with_forward =
        (unsigned)KT_CODEGEN_STEPS | (unsigned)KT_CODEGEN_HEUN_DERIVATIVES | (unsigned)KT_CODEGEN_RK4_DERIVATIVES |
        (kt_code_count_loop_rows(model) > 0 ? (unsigned)KT_CODEGEN_SEMI_IMPLICIT_DERIVATIVES : 0u);
    if (!(functions & (KT_CODEGEN_STEPS | KT_CODEGEN_STEP_DERIVATIVES | KT_CODEGEN_PROJECT)))
        return;
    fputs("/* ---- steps ---- */\n\n", file);
    if (count > 0) {
        print_quaternions(file, model);
        fputs(turn_product, file);
        print_units(file, count);
    }
    if (moves_positions(model, functions))
        print_move(file, model);
    if (kt_code_count_loop_rows(model) > 0)
        kt_code_print_projection(file, names, model, functions, signature[0]);
    if (functions & with_forward)
        print_rates(file, names, model);
    if (functions & (KT_CODEGEN_HEUN | KT_CODEGEN_RK4))
        print_explicit(file, names, model);
    for (int k = 0; k < 2; k++)
        if (functions & (k == 0 ? KT_CODEGEN_HEUN : KT_CODEGEN_RK4))
            print_method(file, names, model, signature[1 + k], explicit_methods[k].stages, explicit_methods[k].tables);
    if (functions & KT_CODEGEN_SEMI_IMPLICIT)
        print_semi_implicit(file, names, model, signature[3]);
    if (functions & KT_CODEGEN_STEP_DERIVATIVES)
        print_changes(file, names, model, functions, signature);
}
