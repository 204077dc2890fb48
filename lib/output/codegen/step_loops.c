/* The projection of a state onto the loops, as in lib/mechanics/assembly/project.c.
 *
 *   positions    q := q (+) dq with A dq = -phi, least in the metric of the model, until phi is rounding
 *   velocities   v := v + dv with A dv = rate - A v, least in kinetic energy
 *
 * Changes of the state, the columns of A and B of a step, pass through the derivative of each step of the iteration.
 * The derivatives of a step without a move, and of the velocities, follow.
 *
 * Equations of velocities, such as those of rolling, belong only to the second projection.
 *
 * Newton's iteration ends if phi is at most ROUNDING of its scale, or if phi is at most CLOSED and no longer halves. A
 * closed lane does not change until all lanes are closed. The iteration takes at most 10 steps, of which one usually
 * suffices. The iteration calls two functions, and both compute phi: one at the position before a step, the other at
 * the position after it, at which velocities are projected.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loops.h"
#include "codegen/print_function.h"
#include "kinetree/codegen.h"

/* Prints the functions with which lanes close their loops: a lane is closed if its gap is rounding, or is small and did
 * not halve. */
static void print_gap(FILE *file, int rows) {
    fputs("#define ROUNDING (number)(sizeof(number) < sizeof(double) ? 1e-6 : 2e-15)\n"
          "#define CLOSED (number)(sizeof(number) < sizeof(double) ? 1e-4 : 1e-12)\n\n",
          file);
    fprintf(file,
            "/* The largest gap of each lane, and the equation of the largest of all. */\n"
            "static real step_gap(const real *gap, int *widest) {\n"
            "    real most = {0};\n    number all = 0;\n    *widest = 0;\n"
            "    for (int i = 0; i < %d; i++)\n        for (int l = 0; l < LANES; l++) {\n"
            "            const number x = LANE(gap[i], l) < 0 ? -LANE(gap[i], l) : LANE(gap[i], l);\n"
            "            if (!(x <= LANE(most, l)))\n                LANE(most, l) = x;\n"
            "            if (!(x <= all)) {\n                all = x;\n                *widest = i;\n            }\n"
            "        }\n    return most;\n}\n\n",
            rows);
    fputs("/* Finds which of the open lanes are closed now, and returns how many are still open. */\n"
          "static int step_opens(real before, real after, real *open, real *closing) {\n"
          "    int left = 0;\n"
          "    for (int l = 0; l < LANES; l++) {\n"
          "        const number a = LANE(after, l), b = LANE(before, l);\n"
          "        const int is_open = LANE(*open, l) > 0;\n"
          "        const int is_closed = a <= ROUNDING || (a <= CLOSED && a > b / 2);\n"
          "        LANE(*closing, l) = (number)(is_open && is_closed);\n"
          "        LANE(*open, l) = (number)(is_open && !is_closed);\n"
          "        left += is_open && !is_closed;\n    }\n    return left;\n}\n\n"
          "/* to = from in the lanes with where > 0 */\n"
          "static void step_take(int count, real where, const real *from, real *to) {\n"
          "    for (int i = 0; i < count; i++)\n        to[i] = CHOOSE(where, from[i], to[i]);\n}\n\n",
          file);
}

/* Projects positions and velocities, and the columns of their changes. */
static void print_closing_projection(FILE *file, const kt_code_names *n, const kt_model *model, bool changes) {
    const int nv = kt_model_nv(model), rows = kt_code_count_closed_rows(model);
    const char *const time = n->loops_have_time ? "t, " : "";
    fprintf(file,
            "/* Projects a state%s onto the loops, in place. */\n"
            "static int step_closed%s(%s%sreal *q, real *v%s) {\n"
            "    static const int loop[%d] = {",
            changes ? " and its changes" : "", changes ? "_changes" : "", n->take,
            n->loops_have_time ? "number t, " : "", changes ? ", real *change" : "", rows);
    for (int i = 0, at = 0; i < (int)model->n.loop; i++)
        for (int k = kt_code_closed_rows_of_loop(model, i); k > 0; k--, at++)
            fprintf(file, "%s%d", at > 0 ? ", " : "", i + 1);
    fprintf(file,
            "}; /* of each equation */\n    real step[%d], p[%d], u[%d], gap[%d], open = SAME(1), closing = SAME(0);\n"
            "    int code, widest = 0, left = LANES;\n",
            nv, kt_model_nq(model), nv, rows);
    if (changes)
        fprintf(file, "    real by[%d];\n", 2 * nv * nv);
    fprintf(file,
            "    for (int i = 0; i < 10; i++) {\n"
            "        code = close_positions(%s%sq, step, gap);\n"
            "        if (code != 0)\n            return code;\n"
            "        const real before = step_gap(gap, &widest);\n",
            n->pass, time);
    if (changes) {
        fprintf(file,
                "        code = close_changes(%s%sq, by);\n"
                "        if (code != 0)\n            return code;\n",
                n->pass, time);
        fprintf(file, "        project_changes(by, open, %d, 0, change);\n", nv);
    }
    fprintf(file,
            "        code = step_move(q, step, p);\n"
            "        if (code != 0)\n            return code;\n"
            "        step_take(%d, CHOOSE(before - ROUNDING, open, SAME(0)), p, q);\n"
            "        code = settle_velocities(%s%sq, v, u, gap);\n"
            "        if (code != 0)\n            return code;\n"
            "        const int stay = step_opens(before, step_gap(gap, &widest), &open, &closing);\n",
            kt_model_nq(model), n->pass, time);
    if (changes)
        fprintf(file,
                "        if (stay < left) {\n"
                "            code = close_changes(%s%sq, by);\n"
                "            if (code == 0)\n                project_changes(by, closing, %d, 0, change);\n"
                "            if (code == 0)\n                code = settle_changes(%s%sq, v, by);\n"
                "            if (code != 0)\n                return code;\n"
                "            project_changes(by, closing, %d, %d, change);\n        }\n",
                n->pass, time, nv, n->pass, time, 2 * nv, nv);
    fprintf(file,
            "        step_take(%d, closing, u, v);\n        left = stay;\n        if (left == 0)\n"
            "            return 0;\n"
            "    }\n    return -loop[widest];\n}\n\n",
            nv);
}

/* Without residuals the positions stay. */
static void print_projection_of_velocities(FILE *file, const kt_code_names *n, int nv, bool changes) {
    const char *const take_time = n->loops_have_time ? "number t, " : "", *const time = n->loops_have_time ? "t, " : "";
    fprintf(file,
            "/* Projects velocities%s onto the loops, in place: no equation has a residual. */\n"
            "static int step_closed%s(%s%sconst real *q, real *v%s) {\n"
            "    real u[%d], gap[1];\n    int code = settle_velocities(%s%sq, v, u, gap);\n",
            changes ? " and their changes" : "", changes ? "_changes" : "", n->take, take_time,
            changes ? ", real *change" : "", nv, n->pass, time);
    if (changes)
        fprintf(file,
                "    real by[%d];\n    if (code == 0)\n        code = settle_changes(%s%sq, v, by);\n"
                "    if (code == 0)\n        project_changes(by, SAME(1), %d, %d, change);\n",
                2 * nv * nv, n->pass, time, 2 * nv, nv);
    fprintf(file, "    for (int k = 0; code == 0 && k < %d; k++)\n        v[k] = u[k];\n    return code;\n}\n\n", nv);
}

/* Prints the projection of states, and that of states with their changes. */
static void print_projections(FILE *file, const kt_code_names *n, const kt_model *model, unsigned functions) {
    const int nv = kt_model_nv(model);
    const bool is_closed = kt_code_count_closed_rows(model) > 0;
    if (is_closed)
        print_gap(file, kt_code_count_closed_rows(model));
    if (functions & KT_CODEGEN_STEP_DERIVATIVES)
        fprintf(
            file,
            "/* The first `columns` numbers of a change give %d of the next one, from number `first` on, in the lanes\n"
            " * with where > 0. */\n"
            "static void project_changes(const real *by, real where, int columns, int first, real *change) {\n"
            "    for (int c = 0; c < %d; c++) {\n        real next[%d];\n"
            "        for (int i = 0; i < %d; i++) {\n            next[i] = SAME(0);\n"
            "            for (int m = 0; m < columns; m++)\n"
            "                next[i] += by[%d * m + i] * change[%d * c + m];\n        }\n"
            "        for (int i = 0; i < %d; i++)\n"
            "            change[%d * c + first + i] = CHOOSE(where, next[i], change[%d * c + first + i]);\n    "
            "}\n}\n\n",
            nv, 3 * nv, nv, nv, nv, 2 * nv, nv, 2 * nv, 2 * nv);
    for (int k = 0; k < 2; k++)
        if (functions & (k == 0 ? KT_CODEGEN_STEPS | KT_CODEGEN_PROJECT : KT_CODEGEN_STEP_DERIVATIVES)) {
            if (is_closed)
                print_closing_projection(file, n, model, k == 1);
            else
                print_projection_of_velocities(file, n, nv, k == 1);
        }
}

void kt_code_print_projection(FILE *file, const kt_code_names *n, const kt_model *model, unsigned functions,
                              const char *signature) {
    const int nq = kt_model_nq(model), nv = kt_model_nv(model);
    print_projections(file, n, model, functions);
    if (!(functions & KT_CODEGEN_PROJECT))
        return;
    fprintf(file,
            "%s {\n    real p[%d], u[%d];\n    for (int i = 0; i < %d; i++)\n        p[i] = q[i];\n"
            "    for (int i = 0; i < %d; i++)\n        u[i] = v[i];\n"
            "    const int code = step_closed(%s%sp, u);\n    if (code != 0)\n        return code;\n"
            "    for (int i = 0; i < %d; i++)\n        next_q[i] = p[i];\n"
            "    for (int i = 0; i < %d; i++)\n        next_v[i] = u[i];\n    return 0;\n}\n\n",
            signature, nq, nv, nq, nv, n->pass, n->loops_have_time ? "t, " : "", nq, nv);
}
