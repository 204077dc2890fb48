/* The two files of kt_codegen_write.
 *
 * All graphs are made first. Then functions are printed to memory, because printing yields the list of prepared
 * numbers, which precedes the functions in the source.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/codegen.h"

#include "base/require.h"
#include "codegen/functions.h"
#include "codegen/loops.h"
#include "document/number.h"
#include "dynamics/no_inertia.h"
#include "kinetree/loop.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

/* Inputs and outputs of a function. */
typedef struct code_kind {
    const char *name, *meaning;
    const char *equation;
    const char *input[3]; /* NULL: no more */
    const char *output[3];
    bool is_step;
    bool is_text;  /* it is no graph: it calls other functions */
    bool is_apart; /* no output is an input */
    bool is_hook;  /* its arguments are the same for all models */
} code_kind;

static const code_kind kinds[KT_CODEGEN_HEUN_DERIVATIVES_INDEX] = {
    [KT_CODEGEN_FORWARD_INDEX] = {.equation = "M a = tau - h", .input = {"q", "v", "tau"}, .output = {"a"}},
    [KT_CODEGEN_INVERSE_INDEX] = {.equation = "tau = M a + h", .input = {"q", "v", "a"}, .output = {"tau"}},
    [KT_CODEGEN_BIAS_INDEX] = {.equation = "tau = M a + h with a = 0", .input = {"q", "v"}, .output = {"h"}},
    [KT_CODEGEN_MASS_INDEX] = {.equation = "M, NV x NV, both triangles; not in the memory of q",
                               .input = {"q"},
                               .output = {"M"},
                               .is_apart = true},
    [KT_CODEGEN_EFFECTS_INDEX] = {.equation = "add them to tau", .input = {"q", "v"}, .output = {"tau"}},
    [KT_CODEGEN_STATES_INDEX] = {.equation = "x' = f(t, q, v, x)", .input = {"q", "v"}, .output = {"rate"}},
    [KT_CODEGEN_ACCELERATION_INDEX] = {.equation = "for kt_native_use; generic: a prepared model; x: may be NULL "
                                                   "without auxiliary states",
                                       .input = {"q", "v", "tau"},
                                       .output = {"a"},
                                       .is_hook = true},
    [KT_CODEGEN_ENERGY_INDEX] = {.equation = "kinetic, potential", .input = {"q", "v"}, .output = {"energy"}},
    [KT_CODEGEN_MARKERS_INDEX] = {.equation = "three numbers for each marker",
                                  .input = {"q", "v"},
                                  .output = {"position", "velocity"}},
    [KT_CODEGEN_JACOBIANS_INDEX] = {.equation =
                                        "6 x NV for each marker: angular velocity, velocity; not in the memory of q",
                                    .input = {"q"},
                                    .output = {"jacobian"},
                                    .is_apart = true},
    [KT_CODEGEN_INVERSE_DERIVATIVES_INDEX] = {.equation = "NV x NV each, column-major; not in the memory of inputs",
                                              .input = {"q", "v", "a"},
                                              .output = {"tau_q", "tau_v"},
                                              .is_apart = true},
    [KT_CODEGEN_FORWARD_DERIVATIVES_INDEX] = {.equation = "NV x NV each, column-major; not in the memory of inputs",
                                              .input = {"q", "v", "tau"},
                                              .output = {"a_q", "a_v", "a_tau"},
                                              .is_apart = true},
    [KT_CODEGEN_EFFECT_DERIVATIVES_INDEX] = {.equation = "NV x NV each, column-major; not in the memory of inputs",
                                             .input = {"q", "v"},
                                             .output = {"tau_q", "tau_v"},
                                             .is_apart = true},
    [KT_CODEGEN_LOOPS_INDEX] = {.equation = "NR residuals phi (0 for an equation of velocities), A of A a = right "
                                            "(NR x NV, column-major), and right; not in the memory of inputs",
                                .input = {"q", "v"},
                                .output = {"phi", "A", "right"},
                                .is_apart = true},
    [KT_CODEGEN_PROJECT_INDEX] = {.equation = "phi = 0, and its rate is 0; outputs may be the inputs",
                                  .input = {"q", "v"},
                                  .output = {"next_q", "next_v"},
                                  .is_text = true},
    [KT_CODEGEN_HEUN_INDEX] = {.equation = "from q and v over h seconds, with constant tau; outputs may be the inputs",
                               .input = {"q", "v", "tau"},
                               .output = {"next_q", "next_v"},
                               .is_step = true,
                               .is_text = true},
    [KT_CODEGEN_RK4_INDEX] = {.equation = "likewise",
                              .input = {"q", "v", "tau"},
                              .output = {"next_q", "next_v"},
                              .is_step = true,
                              .is_text = true},
    [KT_CODEGEN_SEMI_IMPLICIT_INDEX] = {.equation = "likewise; v += h a, then q moves by h v",
                                        .input = {"q", "v", "tau"},
                                        .output = {"next_q", "next_v"},
                                        .is_step = true,
                                        .is_text = true},
};

static const code_kind changes_of_step = {
    .equation = "next (dq, dv) = A (dq, dv) + B dtau; 2 NV x 2 NV and 2 NV x NV, column-major, not in memory of inputs",
    .input = {"q", "v", "tau"},
    .output = {"A", "B"},
    .is_step = true,
    .is_text = true};

static const code_kind inner_kinds[KT_CODE_FUNCTIONS - KT_CODEGEN_COUNT] = {
    {.name = "close_positions",
     .meaning = "the step of positions towards closed loops",
     .equation = "the least step with A step = - phi; gap: phi over its scales",
     .input = {"q"},
     .output = {"step", "gap"}},
    {.name = "settle_velocities",
     .meaning = "velocities after the impulse of the loops",
     .equation = "M (next_v - v) = A' lambda, A next_v = rate; gap: phi over its scales",
     .input = {"q", "v"},
     .output = {"next_v", "gap"}},
    {.name = "close_changes",
     .meaning = "changes of closed positions",
     .equation = "derivatives of q + step by q, NV x NV, column-major; not in the memory of q",
     .input = {"q"},
     .output = {"change"},
     .is_apart = true},
    {.name = "settle_changes",
     .meaning = "changes of velocities after the impulse of the loops",
     .equation = "derivatives of next_v by q and v, NV x 2 NV, column-major; not in the memory of inputs",
     .input = {"q", "v"},
     .output = {"change"},
     .is_apart = true},
};

static const char *const names[] = {
#define KT_CODEGEN_NAME(id, name, meaning) #name,
    KT_CODEGEN_LIST(KT_CODEGEN_NAME)
#undef KT_CODEGEN_NAME
};
static const code_kind *kind_of(int k) {
    return k >= KT_CODEGEN_COUNT                    ? &inner_kinds[k - KT_CODEGEN_COUNT]
           : k >= KT_CODEGEN_HEUN_DERIVATIVES_INDEX ? &changes_of_step
                                                    : &kinds[k];
}
static const char *function_name_of(int k) { return k >= KT_CODEGEN_COUNT ? kind_of(k)->name : names[k]; }

static const char *const meanings[] = {
#define KT_CODEGEN_MEANING(id, name, meaning) meaning,
    KT_CODEGEN_LIST(KT_CODEGEN_MEANING)
#undef KT_CODEGEN_MEANING
};

const char *kt_codegen_name(int k) { return KT_IS_INDEX(k, KT_CODEGEN_COUNT) ? names[k] : NULL; }
const char *kt_codegen_meaning(int k) { return KT_IS_INDEX(k, KT_CODEGEN_COUNT) ? meanings[k] : NULL; }

/* ---- header ------------------------------------------------------------------------------------------------------ */

/* Whether a function evaluates effects: their forces, or rates of auxiliary states. Such a function has the time as an
 * argument if these depend on time, and the auxiliary states, if there are some. */
static bool has_code_effects(int k) {
    return kind_of(k)->is_step || k == KT_CODEGEN_EFFECTS_INDEX || k == KT_CODEGEN_STATES_INDEX ||
           k == KT_CODEGEN_EFFECT_DERIVATIVES_INDEX;
}
/* Whether a function evaluates equations of loops. */
static bool has_equations(int k) {
    return kind_of(k)->is_step || k == KT_CODEGEN_FORWARD_INDEX || k == KT_CODEGEN_FORWARD_DERIVATIVES_INDEX ||
           k == KT_CODEGEN_LOOPS_INDEX || k == KT_CODEGEN_PROJECT_INDEX || k >= KT_CODEGEN_COUNT;
}
static bool has_time(const kt_model *model, int k) {
    return kind_of(k)->is_hook || (has_code_effects(k) && kt_code_has_time(model)) ||
           (has_equations(k) && kt_code_loops_have_time(model));
}
static bool has_states(const kt_model *model, int k) {
    return kind_of(k)->is_hook || (has_code_effects(k) && model->n.x > 0);
}

/* Prints the head of a function. C++, which reads declarations, has no word for is_apart. */
static void print_signature(FILE *file, const kt_code_tree *tree, const char *name, int k, bool declares) {
    const code_kind *kind = kind_of(k);
    if (k >= KT_CODEGEN_COUNT)
        fprintf(file, "static int %s(", function_name_of(k));
    else
        fprintf(file, "int %s_%s(", name, names[k]);
    if (kind->is_hook)
        fputs("const void *generic, ", file);
    else if (!tree->constant)
        fprintf(file, "const %s_model *model, ", name);
    if (has_time(tree->model, k))
        fprintf(file, "%s_number t, ", name);
    for (int i = 0; i < 3 && kind->input[i] != NULL; i++) {
        fprintf(file, "const %s_real *%s, ", name, kind->input[i]);
        if (i == 1 && has_states(tree->model, k))
            fprintf(file, "const %s_real *x, ", name);
    }
    if (kind->is_step)
        fprintf(file, "%s_number h, ", name);
    for (int i = 0; i < 3 && kind->output[i] != NULL; i++)
        fprintf(file, "%s%s_real *%s%s", i > 0 ? ", " : "", name, kind->is_apart && !declares ? "restrict " : "",
                kind->output[i]);
    if (kind->is_step && has_states(tree->model, k))
        fprintf(file, ", %s_real *next_x", name);
    fputs(")", file);
}

/* Bodies with their coordinates, as a comment. */
static void print_bodies(FILE *file, const kt_model *model) {
    fputs(" *\n * body  name (joint): positions, velocities\n", file);
    for (int b = 1; b < kt_model_body_count(model); b++) {
        static const char *const type[] = {
#define KT_CODEGEN_JOINT(id, name, nq, nv) #name,
            KT_JOINT_LIST(KT_CODEGEN_JOINT)
#undef KT_CODEGEN_JOINT
        };
        const kt_coordinates c = kt_body_coordinates(model, b);
        fprintf(file, " * %4d  %s (%s)", b, kt_body_name(model, b), type[c.type]);
        if (c.nv == 1)
            fprintf(file, ": q[%d], v[%d]", c.q, c.v);
        else if (c.nv > 1)
            fprintf(file, ": q[%d] to q[%d], v[%d] to v[%d]", c.q, c.q + c.nq - 1, c.v, c.v + c.nv - 1);
        fputs("\n", file);
    }
    for (int b = 0, index = 0; b < kt_model_body_count(model); b++)
        for (int k = 0; k < kt_marker_count(model, b); k++, index++)
            fprintf(file, "%s * %4d  marker %s of %s\n", index == 0 ? " *\n" : "", index, kt_marker_name(model, b, k),
                    kt_body_name(model, b));
    for (int i = 0; i < (int)model->n.loop; i++)
        fprintf(file, "%s * %4d  loop %s: %d of its %d equations; the others repeat these or are void\n",
                i == 0 ? " *\n" : "", i + 1, kt_loop_name(model, i), kt_code_rows_of_loop(model, i),
                kt_loop_rows_of(model, i).count);
    for (int i = 0; i < (int)model->n.x; i++)
        fprintf(file, "%s * %4d  auxiliary state %s: x[%d]\n", i == 0 ? " *\n" : "", i,
                kt_auxiliary_state_name(model, i), i);
}

/* Prints a text in which the name of the mechanism replaces each @. */
static void print_named(FILE *file, const char *name, const char *text) {
    for (; *text != '\0'; text++)
        if (*text == '@')
            fputs(name, file);
        else
            fputc(*text, file);
}

/* The comment at the top, the types of numbers, and the sizes. */
static void print_types(FILE *file, const kt_model *model, const char *name) {
    const int rows = kt_code_count_loop_rows(model);
    fprintf(file, "/* %s.h: a mechanism as C, generated by Kinetree %s. Do not edit.\n", name, kt_version());
    print_bodies(file, model);
    print_named(
        file, name,
        " *\n * Units: SI and radians. Forces of effects are in @_effects and in steps alone, if these are here.\n"
        " * A function returns 0, or the number of the body whose joint has no inertia; it then writes nothing.\n");
    if (rows > 0)
        fputs(" * Minus the number of a loop: its equations depend on others in this position, or a step opened it.\n"
              " * inverse, bias and mass are those of the tree without loops.\n",
              file);
    print_named(file, name,
                " * Equal bits on all processors need -ffp-contract=off or -std=c99.\n */\n"
                "#ifndef @_GENERATED_H\n#define @_GENERATED_H\n\n"
                "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n"
                "#ifdef @_FLOAT /* define it for all files: single precision */\ntypedef float @_number;\n#else\n"
                "typedef double @_number;\n#endif\n"
                "#ifdef @_LANES /* define it, as 8, for all files: all functions compute as many states, with gcc or "
                "clang */\n"
                "typedef @_number @_real __attribute__((vector_size(@_LANES * sizeof(@_number))));\n#else\n"
                "typedef @_number @_real;\n#endif\n\n");
    fprintf(file, "enum { %s_NQ = %d, %s_NV = %d, %s_NX = %d", name, kt_model_nq(model), name, kt_model_nv(model), name,
            (int)model->n.x);
    if (rows > 0)
        fprintf(file, ", %s_NR = %d", name, rows);
    fprintf(file, " }; /* positions, velocities, auxiliary states%s */\n\n", rows > 0 ? ", equations of loops" : "");
    fprintf(file, "/* kt_codegen_structure of the model */\n#define %s_STRUCTURE 0x%016llxu\n\n", name,
            (unsigned long long)kt_codegen_structure(model));
}

/* The structs of parameters and of the numbers that follow from these alone. */
static void print_parameters(FILE *file, const kt_code_tree *tree, const char *name, int prepared) {
    print_named(file, name,
                "/* Numbers that may change. Those that are zero in the scene are left out: they stay zero. */\n"
                "typedef struct @_parameters {\n");
    for (int i = 0; i < tree->parameter_count; i++)
        fprintf(file, "    %s_number %s; /* %s */\n", name, tree->parameter[i].name, tree->parameter[i].meaning);
    if (tree->parameter_count == 0)
        fprintf(file, "    %s_number none;\n", name);
    print_named(file, name, "} @_parameters;\n\n/* What the parameters alone decide. */\ntypedef struct @_model {\n");
    fprintf(file, "    %s_number k[%d];\n", name, prepared > 0 ? prepared : 1);
    print_named(file, name,
                "} @_model;\n\nextern const @_parameters @_default; /* the numbers of the scene */\n\n"
                "/* Computes the model. Call it once, and after each change of a parameter. */\n"
                "void @_prepare(const @_parameters *p, @_model *model);\n\n");
}

static void print_header(FILE *file, const kt_code_tree *tree, const char *name, unsigned functions, int prepared) {
    print_types(file, tree->model, name);
    if (!tree->constant)
        print_parameters(file, tree, name, prepared);
    for (int k = 0; k < KT_CODEGEN_COUNT; k++)
        if (functions & 1u << k) {
            fprintf(file, "/* %s: %s */\n", meanings[k], kind_of(k)->equation);
            print_signature(file, tree, name, k, true);
            fputs(";\n\n", file);
        }
    fputs("#ifdef __cplusplus\n}\n#endif\n#endif\n", file);
}

/* ---- source ------------------------------------------------------------------------------------------------------ */

static void print_body(kt_code_printer *p, const char *name, int k, const kt_code_function *f) {
    const code_kind *kind = kind_of(k);
    const kt_code_arrays arrays = {.given = kind->input[2] != NULL ? kind->input[2] : "",
                                   .output = {kind->output[0], kind->output[1], kind->output[2]}};
    const kt_op_array array[3] = {KT_OP_POSITION, KT_OP_RATE, KT_OP_GIVEN};
    const kt_op_counts n = kt_graph_count(p->graph, f->out, f->out_count);
    kt_code_print_parts(p, f, &arrays, function_name_of(k));
    fprintf(p->file, "/* %s: %s\n * Operations: %d products, %d sums, %d divisions",
            k < KT_CODEGEN_COUNT ? meanings[k] : kind->meaning, kind->equation, n.multiply, n.add, n.divide);
    if (n.call + n.choose > 0)
        fprintf(p->file, ", %d functions of the C library, %d choices", n.call, n.choose);
    fputs(".", p->file);
    if (p->place_count > 0)
        fprintf(p->file, "\n * w: %d numbers on the stack.", p->place_count);
    fputs(" */\n", p->file);
    print_signature(p->file, p->tree, name, k, false);
    fputs(" {\n", p->file);
    const bool has_angles = kt_code_reads(p, f, KT_OP_SINE) || kt_code_reads(p, f, KT_OP_COSINE);
    const int angles = (int)p->tree->model->n.angle;
    if (kind->is_hook && !p->tree->constant)
        fprintf(p->file, "    const %s_model *model = generic;\n", name);
    if (kind->is_hook && p->tree->constant)
        fputs("    (void)generic;\n", p->file);
    if (!p->tree->constant)
        fputs("    const number *k = model->k;\n", p->file);
    if (has_angles)
        fprintf(p->file, "    WHOLE real s[SINES_ROOM(%d)], c[SINES_ROOM(%d)];\n    sines(%d, q, place, s, c);\n",
                angles, angles, angles);
    for (int i = 0; i < 3 && kind->input[i] != NULL; i++)
        if (!kt_code_reads(p, f, array[i]) && !(i == 0 && has_angles))
            fprintf(p->file, "    (void)%s;\n", kind->input[i]);
    if (has_time(p->tree->model, k))
        fputs(kt_code_reads(p, f, KT_OP_TIME) ? "    const real time = SAME(t);\n" : "    (void)t;\n", p->file);
    if (has_states(p->tree->model, k) && !kt_code_reads(p, f, KT_OP_OWN_STATE))
        fputs("    (void)x;\n", p->file);
    if (!p->tree->constant)
        fputs("    (void)k;\n", p->file);
    for (int i = 0; i < 3 && kind->output[i] != NULL; i++)
        if (f->output[i] == 0)
            fprintf(p->file, "    (void)%s;\n", kind->output[i]);
    kt_code_print_function(p, f, function_name_of(k));
    fputs("    return 0;\n}\n\n", p->file);
}

/* Pragmas around a source. The pragmas forbid gcc to make vectors of straight-line code, because a vector load waits
 * until single numbers are stored. Vectors also differ in bits on processors with fused products (its bug 106902). */
static const char *const no_vectors = "#ifdef __clang__\n#pragma STDC FP_CONTRACT OFF\n#elif defined(__GNUC__)\n"
                                      "#pragma GCC push_options\n"
                                      "#pragma GCC optimize(\"no-tree-slp-vectorize\")\n#endif\n\n";
static const char *const vectors_again =
    "#if defined(__GNUC__) && !defined(__clang__)\n#pragma GCC pop_options\n#endif\n";

static void print_source(kt_code_printer *p, const char *name, const char *functions, bool has_angles, bool has_math) {
    const kt_code_tree *tree = p->tree;
    FILE *file = p->file;
    fprintf(file, "/* %s.c: generated by Kinetree %s. Do not edit. */\n#include \"%s.h\"\n%s\n%s", name, kt_version(),
            name, has_math ? "\n#include <math.h>\n" : "", no_vectors);
    kt_code_print_lanes(file, name, functions);
    if (has_angles)
        kt_code_print_sincos(file, name, tree->model);
    if (!tree->constant) {
        fprintf(file, "/* ---- parameters ---- */\n\nconst %s_parameters %s_default = {\n", name, name);
        for (int i = 0; i < tree->parameter_count; i++) {
            char text[KT_NUMBER_SIZE];
            kt_number_format(text, tree->parameter[i].value);
            fprintf(file, "    (number)%s, /* %s */\n", text, tree->parameter[i].name);
        }
        fprintf(file, "%s};\n\nvoid %s_prepare(const %s_parameters *p, %s_model *model) {\n    number *k = model->k;\n",
                tree->parameter_count == 0 ? "    0\n" : "", name, name, name);
        fputs("    (void)p;\n    (void)k;\n", file);
        kt_code_print_prepared(p);
        fputs("}\n\n", file);
    }
    fputs("/* ---- functions ---- */\n\n", file);
    if (strstr(functions, "NO_INERTIA") != NULL)
        fprintf(file,
                "/* Below this part of what a joint carries, its inertia is rounding. */\n"
                "#define NO_INERTIA (number)(sizeof(number) < sizeof(double) ? %.1e : %.1e)\n\n",
                KT_NO_INERTIA / DBL_EPSILON * (double)FLT_EPSILON, KT_NO_INERTIA);
    if (kt_code_count_loop_rows(tree->model) > 0)
        fputs("/* Equations of loops whose squared sine is below this depend on others. From the second one on, there "
              "are\n"
              " * states for which the library has smaller errors. */\n"
              "#define SINGULAR (number)(sizeof(number) < sizeof(double) ? 1e-5 : 1e-12)\n"
              "#define NEAR_SINGULAR (number)1e-4\n\n",
              file);
    if (p->has_parts)
        fputs("#ifdef __GNUC__ /* a part has registers of its own */\n#define PART __attribute__((noinline))\n"
              "#else\n#define PART\n#endif\n\n",
              file);
    fputs(functions, file);
    fputs(vectors_again, file);
}

/* ---- text ------------------------------------------------------------------------------------------------------- */

/* Prints the steps, which call other functions. Returns false if memory is insufficient. */
static bool print_steps(FILE *file, const kt_code_tree *tree, const char *name, unsigned functions) {
    char *signature[KT_CODE_STEPS] = {NULL}, take[KT_CODE_NAME];
    bool fine = true;
    for (int i = 0; i < KT_CODE_STEPS; i++) {
        size_t length = 0;
        FILE *memory = open_memstream(&signature[i], &length);
        if (memory != NULL)
            print_signature(memory, tree, name, KT_CODEGEN_PROJECT_INDEX + i, false);
        fine &= memory != NULL && fclose(memory) == 0 && signature[i] != NULL;
    }
    (void)snprintf(take, sizeof take, "const %s_model *model, ", name);
    const kt_code_names called = {.name = name,
                                  .take = tree->constant ? "" : take,
                                  .pass = tree->constant ? "" : "model, ",
                                  .effects_have_time = kt_code_has_time(tree->model),
                                  .loops_have_time = kt_code_loops_have_time(tree->model)};
    if (fine)
        kt_code_print_steps(file, &called, tree->model, functions, (const char *const *)signature);
    for (int i = 0; i < KT_CODE_STEPS; i++)
        free(signature[i]);
    return fine;
}

/* Functions are printed first, into memory: they number the prepared numbers that the files begin with. */
static kt_status print_files(const kt_code_tree *tree, const char *name, unsigned functions, kt_code_function *f,
                             FILE *source, FILE *header, kt_error *error) {
    char *text = NULL;
    size_t length = 0;
    kt_code_printer p;
    FILE *memory = open_memstream(&text, &length);
    bool fine = kt_code_printer_init(&p, tree, memory) && memory != NULL,
         has_angles = kt_code_steps_read_sines(tree->model, functions),
         has_math = kt_code_steps_read_roots(tree->model, functions);
    for (int k = 0; fine && k < KT_CODE_FUNCTIONS; k++)
        if (functions & 1u << k && !kind_of(k)->is_text) {
            has_angles |= kt_code_reads(&p, &f[k], KT_OP_SINE) || kt_code_reads(&p, &f[k], KT_OP_COSINE);
            has_math |= kt_code_calls(&p, &f[k]);
            print_body(&p, name, k, &f[k]);
        }
    fine = fine && print_steps(memory, tree, name, functions);
    fine = memory != NULL && fclose(memory) == 0 && text != NULL && fine && !p.failed;
    p.file = source;
    if (fine) {
        print_source(&p, name, text, has_angles, has_math);
        print_header(header, tree, name, functions, p.prepared_count);
        fine = !p.failed;
    }
    kt_code_printer_free(&p);
    free(text);
    if (!fine)
        return kt_error_set(error, KT_ERROR_MEMORY, name, "there is not enough memory to generate the files");
    if (ferror(source) || ferror(header))
        return kt_error_set(error, KT_ERROR_FILE, name, "the files could not be written; check the room on the disk");
    return KT_OK;
}

/* ---- both files ------------------------------------------------------------------------------------------------- */

/* The graphs of a call, which are made before any text is written. */
typedef struct code_made {
    unsigned functions; /* with those that they call */
    kt_graph graph;
    kt_code_tree tree;
    kt_code_function f[KT_CODE_FUNCTIONS];
} code_made;

static void free_made(code_made *made) {
    kt_graph_free(&made->graph);
    free(made);
}

/* Joints and loops whose pivots are zero by structure, in any position: the code would divide by zero. */
static kt_status check_pivots(const code_made *made, kt_error *error) {
    const kt_model *model = made->tree.model;
    for (int k = 0; k < KT_CODE_FUNCTIONS; k++)
        for (int i = 0; i < made->f[k].guard_count; i++) {
            const kt_code_guard *guard = &made->f[k].guard[i];
            const kt_op_node *pivot = &made->graph.node[guard->pivot];
            if (pivot->kind != KT_OP_CONSTANT || pivot->value > 0.0)
                continue;
            return kt_error_set(error, KT_ERROR_MODEL,
                                guard->loop > 0 ? kt_loop_name(model, guard->loop - 1)
                                                : kt_body_name(model, guard->body),
                                "code for accelerations divides by %s, which is zero here; %s, leave out forward, its "
                                "derivatives, acceleration and project, or use the library",
                                guard->loop > 0 ? "what the equation moves" : "the inertia that the joint moves",
                                guard->loop > 0 ? "remove the loop" : "give the body a mass");
        }
    return KT_OK;
}

static kt_status reject_memory(kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory to generate the files");
}

/* The functions that projections, and their changes, call. */
static unsigned functions_of_projection(const kt_model *model, unsigned functions) {
    const bool is_closed = kt_code_count_closed_rows(model) > 0;
    const bool changes = functions & KT_CODEGEN_STEP_DERIVATIVES;
    if (kt_code_count_loop_rows(model) == 0 || !(changes || functions & (KT_CODEGEN_STEPS | KT_CODEGEN_PROJECT)))
        return 0;
    return 1u << KT_CODE_SETTLE | (is_closed ? 1u << KT_CODE_CLOSE : 0u) |
           (changes ? 1u << KT_CODE_SETTLE_CHANGES : 0u) | (changes && is_closed ? 1u << KT_CODE_CLOSE_CHANGES : 0u);
}

/* Makes the graphs of functions. free_made releases *all, which is NULL after an error. */
static kt_status make_graphs(const kt_model *model, unsigned functions, bool constant, code_made **all,
                             kt_error *error) {
    *all = NULL;
    if (functions == 0 || (functions & ~(unsigned)KT_CODEGEN_ALL) != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "functions", "functions is %#x; give a sum of KT_CODEGEN_ bits",
                            functions);
    if (functions == KT_CODEGEN_ALL)
        functions = kt_code_available(model);
    if (functions & KT_CODEGEN_STEP_DERIVATIVES)
        functions |= KT_CODEGEN_FORWARD_DERIVATIVES | (model->n.effect > 0 ? KT_CODEGEN_EFFECT_DERIVATIVES : 0u);
    if (functions & (KT_CODEGEN_STEPS | KT_CODEGEN_STEP_DERIVATIVES)) /* they call these */
        functions |= KT_CODEGEN_FORWARD | (model->n.effect > 0 ? KT_CODEGEN_EFFECTS : 0u) |
                     (model->n.x > 0 ? KT_CODEGEN_STATES : 0u);
    const kt_status status = kt_code_check(model, functions, error);
    if (status != KT_OK)
        return status;
    functions |= functions_of_projection(model, functions);
    code_made *made = calloc(1, sizeof *made);
    if (made == NULL)
        return reject_memory(error);
    made->functions = functions;
    kt_graph_init(&made->graph);
    if (kt_code_tree_read(&made->tree, model, &made->graph, constant)) {
        kt_code_tree_place_origins(&made->tree);
        kt_code_tree_regroup(&made->tree);
    }
    for (int k = 0; k < KT_CODE_FUNCTIONS && !made->graph.failed; k++)
        if (functions & 1u << k && !kind_of(k)->is_text)
            kt_code_make_function(&made->tree, k, kind_of(k)->is_apart, &made->f[k]);
    if (made->graph.failed) {
        free_made(made);
        return reject_memory(error);
    }
    const kt_status sound = check_pivots(made, error);
    if (sound != KT_OK)
        free_made(made);
    else
        *all = made;
    return sound;
}

kt_status kt_codegen_write(const kt_model *model, const char *name, unsigned functions, bool constant, FILE *source,
                           FILE *header, kt_error *error) {
    if (KT_IS_MISSING(error, model, name, source, header))
        return KT_ERROR_ARGUMENT;
    if (!kt_code_is_identifier(name))
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "name",
            "'%s' is not a name for C; begin with a letter, go on with letters, digits and _, %d in all at most", name,
            (int)KT_CODE_BODY_NAME);
    code_made *made;
    kt_status status = make_graphs(model, functions, constant, &made, error);
    if (status != KT_OK)
        return status;
    status = print_files(&made->tree, name, made->functions, made->f, source, header, error);
    free_made(made);
    return status;
}

/* Counts and writes the numbers of accelerations. The parameters of accelerations follow from the tree, the effects and
 * the loops. The dynamics, which take most of the time, have no others. */
static kt_status read_numbers_of_accelerations(const kt_model *model, double *numbers, int room, int *count,
                                               kt_error *error) {
    const kt_status status = kt_code_check(model, KT_CODEGEN_ACCELERATION, error);
    if (status != KT_OK)
        return status;
    kt_graph graph;
    kt_code_tree tree;
    kt_graph_init(&graph);
    kt_op *force = kt_graph_take(&graph, model->n.v + 1, sizeof *force);
    bool fine = kt_code_tree_read(&tree, model, &graph, false);
    if (fine && model->n.effect > 0)
        kt_code_effects(&tree, force);
    if (fine && kt_code_count_loop_rows(model) > 0)
        (void)kt_code_read_loops(&tree);
    fine = !graph.failed;
    if (fine)
        *count = tree.parameter_count;
    for (int i = 0; fine && i < tree.parameter_count && i < room; i++)
        numbers[i] = tree.parameter[i].value;
    kt_graph_free(&graph);
    return fine ? KT_OK : reject_memory(error);
}

kt_status kt_codegen_numbers(const kt_model *model, unsigned functions, double *numbers, int room, int *count,
                             kt_error *error) {
    if (KT_IS_MISSING(error, model, numbers || room <= 0, count))
        return KT_ERROR_ARGUMENT;
    if (functions == KT_CODEGEN_ACCELERATION)
        return read_numbers_of_accelerations(model, numbers, room, count, error);
    code_made *made;
    const kt_status status = make_graphs(model, functions, false, &made, error);
    if (status != KT_OK)
        return status;
    *count = made->tree.parameter_count;
    for (int i = 0; i < *count && i < room; i++)
        numbers[i] = made->tree.parameter[i].value;
    free_made(made);
    return KT_OK;
}
