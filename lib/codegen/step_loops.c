/* The projection of a state onto the loops, as in lib/closure/project.c.
 *
 *   positions    q := q (+) dq with A dq = -phi, least in the metric of the model, until phi is rounding
 *   velocities   v := v + dv with A dv = rate - A v, least in kinetic energy
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

/* Projects positions and velocities. */
static void print_closing_projection(FILE *file, const kt_code_names *n, const kt_model *model) {
    const int nv = kt_model_nv(model), rows = kt_code_count_closed_rows(model);
    const char *const time = n->loops_have_time ? "t, " : "";
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
    fprintf(file,
            "/* Projects a state onto the loops, in place. */\n"
            "static int step_project(%s%sreal *q, real *v) {\n"
            "    static const int loop[%d] = {",
            n->take, n->loops_have_time ? "real t, " : "", rows);
    for (int i = 0, at = 0; i < (int)model->n.loop; i++)
        for (int k = kt_code_closed_rows_of_loop(model, i); k > 0; k--, at++)
            fprintf(file, "%s%d", at > 0 ? ", " : "", i + 1);
    fprintf(file,
            "}; /* of each equation */\n"
            "    real step[%d], u[%d], gap[%d];\n    int code, widest = 0;\n"
            "    for (int i = 0; i < 10; i++) {\n"
            "        code = close_positions(%s%sq, step, gap);\n"
            "        if (code != 0)\n            return code;\n"
            "        const real before = step_gap(gap, &widest);\n"
            "        if (!(before <= ROUNDING))\n            code = step_move(q, step, q);\n"
            "        if (code == 0)\n            code = settle_velocities(%s%sq, v, u, gap);\n"
            "        if (code != 0)\n            return code;\n"
            "        const real after = step_gap(gap, &widest);\n"
            "        if (after <= ROUNDING || (after <= CLOSED && after > before / 2)) {\n"
            "            for (int k = 0; k < %d; k++)\n                v[k] = u[k];\n            return 0;\n        }\n"
            "    }\n    return -loop[widest];\n}\n\n",
            nv, nv, rows, n->pass, time, n->pass, time, nv);
}

/* Without residuals the positions stay. */
static void print_projection_of_velocities(FILE *file, const kt_code_names *n, int nv) {
    fprintf(file,
            "/* Projects velocities onto the loops, in place: no equation has a residual. */\n"
            "static int step_project(%s%sconst real *q, real *v) {\n"
            "    real u[%d], gap[1] = {0};\n"
            "    const int code = settle_velocities(%s%sq, v, u, gap);\n"
            "    for (int k = 0; code == 0 && k < %d; k++)\n        v[k] = u[k];\n    return code;\n}\n\n",
            n->take, n->loops_have_time ? "real t, " : "", nv, n->pass, n->loops_have_time ? "t, " : "", nv);
}

void kt_code_print_projection(FILE *file, const kt_code_names *n, const kt_model *model, unsigned functions,
                              const char *signature) {
    const int nq = kt_model_nq(model), nv = kt_model_nv(model), rows = kt_code_count_closed_rows(model);
    if (rows > 0)
        print_closing_projection(file, n, model);
    else
        print_projection_of_velocities(file, n, nv);
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
