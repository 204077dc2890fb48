/* The projection of a state onto the loops, as in lib/closure/project.c.
 *
 *   positions    q := q (+) dq with A dq = -phi, least in the metric of the model, until phi is rounding
 *   velocities   v := v + dv with A dv = rate - A v, least in kinetic energy
 *
 * Changes of the state, the columns of A and B of a step, pass through the derivative of each step of the iteration.
 * Those of a step without a move and of the velocities follow.
 *
 * Equations of velocities, such as those of rolling, belong to the second alone.
 *
 * Newton's iteration ends if phi is at most ROUNDING of its scale, or if it is at most CLOSED and no longer halves. It
 * takes at most 10 steps, of which one suffices after a usual step. It calls two functions, and both compute phi: one
 * at the position before a step, and one behind it, where the velocities are projected.
 */
#include "codegen/loops.h"
#include "codegen/print.h"
#include "kinetree/codegen.h"

static void print_gap(FILE *file, int rows) {
    fputs("#define ROUNDING (real)(sizeof(real) < sizeof(double) ? 1e-6 : 2e-15)\n"
          "#define CLOSED (real)(sizeof(real) < sizeof(double) ? 1e-4 : 1e-12)\n\n",
          file);
    fprintf(file,
            "/* The largest gap, and its equation. */\n"
            "static real step_gap(const real *gap, int *widest) {\n"
            "    real most = 0;\n    *widest = 0;\n"
            "    for (int i = 0; i < %d; i++) {\n"
            "        const real x = gap[i] < 0 ? -gap[i] : gap[i];\n"
            "        if (!(x <= most)) {\n            most = x;\n            *widest = i;\n        }\n    }\n"
            "    return most;\n}\n\n",
            rows);
}

/* Projects positions and velocities, and with them the columns of their changes. */
static void print_closing_projection(FILE *file, const kt_code_names *n, const kt_model *model, bool changes) {
    const int nv = kt_model_nv(model), rows = kt_code_count_closed_rows(model);
    const char *const time = n->loops_have_time ? "t, " : "";
    fprintf(file,
            "/* Projects a state%s onto the loops, in place. */\n"
            "static int step_project%s(%s%sreal *q, real *v%s) {\n"
            "    static const int loop[%d] = {",
            changes ? " and its changes" : "", changes ? "_changes" : "", n->take, n->loops_have_time ? "real t, " : "",
            changes ? ", real *change" : "", rows);
    for (int i = 0, at = 0; i < (int)model->n.loop; i++)
        for (int k = kt_code_closed_rows_of_loop(model, i); k > 0; k--, at++)
            fprintf(file, "%s%d", at > 0 ? ", " : "", i + 1);
    fprintf(file, "}; /* of each equation */\n    real step[%d], u[%d], gap[%d];\n    int code, widest = 0;\n", nv, nv,
            rows);
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
        fprintf(file, "        project_changes(by, %d, 0, change);\n", nv);
    }
    fprintf(file,
            "        if (!(before <= ROUNDING))\n            code = step_move(q, step, q);\n"
            "        if (code == 0)\n            code = settle_velocities(%s%sq, v, u, gap);\n"
            "        if (code != 0)\n            return code;\n"
            "        const real after = step_gap(gap, &widest);\n"
            "        if (after <= ROUNDING || (after <= CLOSED && after > before / 2)) {\n",
            n->pass, time);
    if (changes)
        fprintf(file,
                "            code = close_changes(%s%sq, by);\n"
                "            if (code == 0)\n                project_changes(by, %d, 0, change);\n"
                "            if (code == 0)\n                code = settle_changes(%s%sq, v, by);\n"
                "            if (code != 0)\n                return code;\n"
                "            project_changes(by, %d, %d, change);\n",
                n->pass, time, nv, n->pass, time, 2 * nv, nv);
    fprintf(file,
            "            for (int k = 0; k < %d; k++)\n                v[k] = u[k];\n            return 0;\n        }\n"
            "    }\n    return -loop[widest];\n}\n\n",
            nv);
}

/* Without residuals the positions stay. */
static void print_projection_of_velocities(FILE *file, const kt_code_names *n, int nv, bool changes) {
    const char *const take_time = n->loops_have_time ? "real t, " : "", *const time = n->loops_have_time ? "t, " : "";
    fprintf(file,
            "/* Projects velocities%s onto the loops, in place: no equation has a residual. */\n"
            "static int step_project%s(%s%sconst real *q, real *v%s) {\n"
            "    real u[%d], gap[1] = {0};\n    int code = settle_velocities(%s%sq, v, u, gap);\n",
            changes ? " and their changes" : "", changes ? "_changes" : "", n->take, take_time,
            changes ? ", real *change" : "", nv, n->pass, time);
    if (changes)
        fprintf(file,
                "    real by[%d];\n    if (code == 0)\n        code = settle_changes(%s%sq, v, by);\n"
                "    if (code == 0)\n        project_changes(by, %d, %d, change);\n",
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
        fprintf(file,
                "/* The first `columns` numbers of a change give %d of the next one, from number `first` on. */\n"
                "static void project_changes(const real *by, int columns, int first, real *change) {\n"
                "    for (int c = 0; c < %d; c++) {\n        real next[%d];\n"
                "        for (int i = 0; i < %d; i++) {\n            next[i] = 0;\n"
                "            for (int m = 0; m < columns; m++)\n"
                "                next[i] += by[%d * m + i] * change[%d * c + m];\n        }\n"
                "        for (int i = 0; i < %d; i++)\n            change[%d * c + first + i] = next[i];\n    }\n}\n\n",
                nv, 3 * nv, nv, nv, nv, 2 * nv, nv, 2 * nv);
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
            "    const int code = step_project(%s%sp, u);\n    if (code != 0)\n        return code;\n"
            "    for (int i = 0; i < %d; i++)\n        next_q[i] = p[i];\n"
            "    for (int i = 0; i < %d; i++)\n        next_v[i] = u[i];\n    return 0;\n}\n\n",
            signature, nq, nv, nq, nv, n->pass, n->loops_have_time ? "t, " : "", nq, nv);
}
