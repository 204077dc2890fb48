/* Files of generated C: rejections, joints without inertia, sines, fixed numbers, equal bits of compilers,
 * operations. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "generated.h"
#include "text.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

enum { BODIES = 24 };

/* A description of some bodies; not to be copied. */
typedef struct small_tree {
    kt_description description;
    kt_body body[BODIES];
    kt_marker marker;
    kt_model *model;
} small_tree;

static const char *const names[BODIES] = {"link1",  "link2",  "link3",  "link4",  "link5",  "link6",
                                          "link-7", "link8",  "link9",  "link10", "link11", "link12",
                                          "link13", "link14", "link15", "link16", "link17", "link18",
                                          "link19", "link20", "link21", "link22", "link23", "link24"};

/* A chain of hinges about z, y, z ... with a marker at x = 1 on the last link. */
static void small_tree_describe(small_tree *t, int count) {
    t->description = kt_description_default();
    t->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    kt_describe(&t->description, t->body, count, NULL, 0, NULL, 0);
    t->marker = (kt_marker){.name = "tip", .at = {1.0, 0.0, 0.0}};
    t->model = NULL;
    for (int i = 0; i < count; i++) {
        kt_body *b = &t->body[i];
        *b = kt_body_of(names[i], i > 0 ? names[i - 1] : NULL, KT_JOINT_REVOLUTE, 2.0);
        b->joint.axis = i % 2 ? kt_vec3_make(0.0, 1.0, 0.0) : kt_vec3_make(0.0, 0.0, 1.0);
        b->joint.at = i > 0 ? kt_vec3_make(0.1, 0.0, 0.3) : kt_vec3_make(0.0, 0.0, 0.0);
        b->com = kt_vec3_make(0.05, 0.02, 0.1);
        b->inertia = kt_sym3_make(0.02, 0.03, 0.025, 0.001, 0.002, 0.003);
    }
    t->body[count - 1].markers = &t->marker;
    t->body[count - 1].marker_count = 1;
}

static void small_tree_compile(small_tree *t) { t->model = kt_test_model(&t->description, NULL); }

static void small_tree_make(small_tree *t, int count) {
    small_tree_describe(t, count);
    small_tree_compile(t);
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

static void check_rejected(const char *what, const kt_model *model, const char *name, unsigned functions,
                           kt_status status, const char *message) {
    kt_generated_text text;
    kt_error error = {0};
    kt_check_equal_int(what, kt_generate_text(model, name, functions, false, &text, &error), status);
    kt_check_contains(what, error.message, message);
    kt_check_text("nothing is written", text.source, "");
    kt_check_text("nothing is written", text.header, "");
}

static int push_joint(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user, (void)t, (void)q, (void)v, (void)balance;
    *force = 1.0;
    return 0;
}

KT_TEST(what_cannot_be_generated_is_rejected_with_a_reason) {
    small_tree t;
    small_tree_make(&t, 3);
    check_rejected("a name with a dash", t.model, "my-arm", KT_CODEGEN_MASS, KT_ERROR_ARGUMENT, "not a name for C");
    check_rejected("a name with a digit", t.model, "7arm", KT_CODEGEN_MASS, KT_ERROR_ARGUMENT, "not a name for C");
    check_rejected("a long name", t.model, "a23456789b123456789c123456789d123456789e123456789f123456789g12345",
                   KT_CODEGEN_MASS, KT_ERROR_ARGUMENT, "64 in all at most");
    check_rejected("no function", t.model, "arm", 0, KT_ERROR_ARGUMENT, "functions");
    check_rejected("an unknown function", t.model, "arm", 1u << 30, KT_ERROR_ARGUMENT, "functions");

    small_tree_describe(&t, 3);
    t.body[2].marker_count = 0;
    small_tree_compile(&t);
    check_rejected("no state", t.model, "arm", KT_CODEGEN_STATES, KT_ERROR_MODEL, "no auxiliary states");
    if (t.model != NULL)
        check_rejected("no marker", t.model, "arm", KT_CODEGEN_MARKERS, KT_ERROR_MODEL, "no markers");

    small_tree_describe(&t, 3);
    kt_effect effect = kt_effect_of(KT_EFFECT_CUSTOM, names[1]);
    effect.joint_force = push_joint;
    t.description.effects = &effect;
    t.description.effect_count = 1;
    small_tree_compile(&t);
    check_rejected("an effect", t.model, "arm", KT_CODEGEN_EFFECTS, KT_ERROR_MODEL, "a function in C");
    check_rejected("a step needs it", t.model, "arm", KT_CODEGEN_RK4, KT_ERROR_MODEL, "steps need it");

    small_tree_describe(&t, 1);
    t.body[0].joint.type = KT_JOINT_FIXED;
    small_tree_compile(&t);
    check_rejected("no joint moves", t.model, "arm", KT_CODEGEN_MASS, KT_ERROR_MODEL, "no joint can move");
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

/* The mass of the last link of a chain lies on its axis once its parameters are changed. */
static void check_no_inertia(int count) {
    static kt_generated g;
    small_tree t;
    const double zero[BODIES] = {0.0};
    double q[BODIES], a[BODIES] = {7.0}, next[2 * BODIES], parameter[KT_GENERATED_PARAMETERS];
    char last[16];
    for (int i = 0; i < BODIES; i++)
        q[i] = 0.1 * (i + 1);
    small_tree_make(&t, count);
    kt_generated_make_some(&g, t.model, KT_CODEGEN_FORWARD | KT_CODEGEN_STEPS, "cc -O0", false);
    const int body = kt_body_find(t.model, names[count - 1]);
    kt_check_equal_int("parts", g.has_parts[0], count > 3);
    kt_check_equal_int("regular", g.forward(g.model, q, zero, zero, a), 0);
    memcpy(parameter, g.standard, sizeof(double) * (size_t)g.count);
    const int length = snprintf(last, sizeof last, "%s_", names[count - 1]);
    for (int i = 0; i < g.count; i++) {
        const char *of = g.name[i] + length;
        if (strncmp(g.name[i], last, (size_t)length) == 0 &&
            (strncmp(of, "inertia", 7) == 0 || strcmp(of, "com_z") == 0 || strcmp(of, "com_x") == 0 ||
             strcmp(of, "com_y") == 0))
            parameter[i] = 0.0;
    }
    g.prepare(parameter, g.model);
    a[0] = 7.0;
    kt_check_equal_int("body", g.forward(g.model, q, zero, zero, a), body);
    kt_check_near("nothing is written", a[0], 7.0, 0.0);
    kt_generated_step *const step[3] = {g.heun, g.rk4, g.semi_implicit};
    for (int k = 0; k < 3; k++) {
        next[0] = next[count] = 7.0;
        kt_check_equal_int("a step returns the body", step[k](g.model, q, zero, zero, 0.1, next, next + count), body);
        kt_check_near("a step writes nothing", next[0] + next[count], 14.0, 0.0);
    }
    q[count / 2] = (double)NAN;
    g.prepare(g.standard, g.model);
    kt_check_above("a position that is not finite", g.forward(g.model, q, zero, zero, a), 1.0);
}

KT_TEST(forward_returns_the_body_whose_joint_has_no_inertia) {
    kt_generated_need_compiler();
    check_no_inertia(3);
    check_no_inertia(BODIES);
}

/* x = cos q, y = sin q of a marker on a hinge. Bounds: one unit in the last place of 1, and `2^-82` absolutely. */
KT_TEST(sines_are_those_of_long_double_at_all_sizes_of_angles) {
    static kt_generated g;
    kt_random random = kt_random_of_test();
    small_tree t;
    KT_WORST error = kt_worst_make("sine and cosine");
    const double zero = 0.0;
    double at[3], rate[3];
    kt_generated_need_compiler();
    small_tree_make(&t, 1);
    kt_generated_make_plain(&g, t.model, "cc -O2");
    for (int k = 0; k < 40000; k++) {
        const double size = pow(10.0, kt_random_uniform(&random, -8.0, 11.8));
        const double turns = floor(kt_random_uniform(&random, -1.0, 1.0) * size) * 1.5707963267948966;
        const double q = k % 2 ? size * kt_random_uniform(&random, -1.0, 1.0) : turns;
        if (g.markers(g.model, &q, &zero, at, rate) != 0)
            break;
        kt_worst_near(&error, at[0], (double)cosl((long double)q), 0.7 * EPS, "q = %.17g", q);
        kt_worst_near(&error, at[1], (double)sinl((long double)q), 0.7 * EPS, "q = %.17g", q);
    }
    for (int k = 0; k < 3; k++) {
        const double far[3] = {1e13, (double)INFINITY, (double)NAN};
        (void)g.markers(g.model, &far[k], &zero, at, rate);
        kt_check_true("beyond its range a sine is NaN", isnan(at[0]) && isnan(at[1]));
    }
}

/* ---- texts ------------------------------------------------------------------------------------------------------- */

/* The operations of a function, as its comment counts them. */
static int count_operations(const char *source, const char *function) {
    char start[64];
    long sum = 0;
    snprintf(start, sizeof start, "\nint arm_%s(", function);
    const char *at = strstr(source, start), *comment = NULL;
    for (const char *c = source; at != NULL && c != NULL && c < at; c = strstr(c + 1, " * Operations: "))
        comment = c;
    if (comment == NULL)
        return -1;
    for (int k = 0; k < 3; k++) { /* " * Operations: 1 products, 2 sums, 3 divisions." */
        char *end;
        comment += strcspn(comment, "0123456789");
        sum += strtol(comment, &end, 10);
        comment = end;
    }
    return (int)sum;
}

static int count_words(const char *text, const char *word) {
    int count = 0;
    for (const char *at = text; (at = strstr(at, word)) != NULL; at++)
        count++;
    return count;
}

static kt_generated_text generate_arm(const kt_model *model, unsigned functions, bool fold) {
    kt_generated_text text;
    kt_error error = {0};
    kt_need_fine("generate", kt_generate_text(model, "arm", functions, fold, &text, &error), &error);
    return text;
}

/* A function of a chain needs at most as many operations as the bar, which is the count for this version. */
static void check_operations(int bodies, const char *equation, const int bar[5]) {
    static const char *const function[5] = {"forward", "inverse", "bias", "mass", "energy"};
    small_tree t;
    small_tree_make(&t, bodies);
    const kt_generated_text arm = generate_arm(t.model, KT_GENERATED_USUAL, false);
    kt_check_contains("the method with fewer operations", arm.source, equation);
    for (int i = 0; i < 5; i++) {
        const int count = count_operations(arm.source, function[i]);
        kt_check_above("they are counted", count, 50);
        kt_check_below(function[i], count, bar[i]);
    }
}

KT_TEST(an_arm_of_seven_takes_no_more_operations) {
    check_operations(7, "L_ki = M_ki / D_kk", (const int[5]){1352, 680, 647, 468, 340});
}

KT_TEST(a_chain_of_24_takes_no_more_operations) {
    check_operations(24, "U = A s", (const int[5]){7313, 2746, 2696, 5928, 1394});
}

KT_TEST(files_name_joints_equations_and_parameters) {
    small_tree t;
    char structure[64];
    small_tree_make(&t, 7);
    const kt_generated_text arm = generate_arm(t.model, KT_CODEGEN_FORWARD, false);
    snprintf(structure, sizeof structure, "#define arm_STRUCTURE 0x%016llxu",
             (unsigned long long)kt_codegen_structure(t.model));
    kt_check_contains("structure", arm.header, structure);
    kt_check_contains("a name with a dash", arm.header, "    arm_number link_7_mass; /* kg */");
    kt_check_true("zeros are not parameters", strstr(arm.header, "link3_at_y") == NULL);
    kt_check_contains("a block", arm.source, "/* link-7: motion of link 7 in its own axes");
    kt_check_true("no library", strstr(arm.source, "#include <") == NULL && strstr(arm.source, "malloc") == NULL);
    kt_check_equal_int("guards", count_words(arm.source, "    if (!is_above("), 7);
    const kt_generated_text fixed = generate_arm(t.model, KT_CODEGEN_FORWARD, true);
    kt_check_true("no parameters",
                  strstr(fixed.header, "arm_parameters") == NULL && strstr(fixed.source, "k[") == NULL);
    kt_check_contains("a function", fixed.header, "int arm_forward(const arm_real *q,");
}

/* A change of a number keeps the structure; a number that becomes zero, another axis or joint does not. */
KT_TEST(structure_changes_with_all_that_is_folded) {
    small_tree t;
    uint64_t seen[8];
    for (int k = 0; k < 8; k++) {
        small_tree_describe(&t, 3);
        if (k == 1)
            t.body[1].mass = 3.0;
        if (k == 2)
            t.body[1].com.x = 0.0;
        if (k == 3)
            t.body[1].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        if (k == 4)
            t.body[1].joint.type = KT_JOINT_PRISMATIC;
        if (k == 5)
            t.body[1].joint.rotation = kt_rotation_rpy(0.1, 0.0, 0.0);
        if (k == 6)
            t.body[1].joint.armature[0] = 0.5;
        if (k == 7)
            t.description.gravity.x = 1.0;
        small_tree_compile(&t);
        seen[k] = kt_codegen_structure(t.model);
    }
    kt_check_true("a number", seen[1] == seen[0]);
    for (int k = 2; k < 8; k++)
        for (int j = 0; j < k; j++)
            kt_check_true("another structure", j == 1 || seen[k] != seen[j]);
    kt_check_true("no model", kt_codegen_structure(NULL) == 0);
}

/* ---- bits -------------------------------------------------------------------------------------------------------- */

/* The functions whose results are compared. */
static const unsigned compared_functions =
    KT_CODEGEN_FORWARD | KT_CODEGEN_INVERSE | KT_CODEGEN_ENERGY | KT_CODEGEN_MARKERS | KT_CODEGEN_MASS;

/* Their results in turn: two of nv, energies, positions and velocities of markers, the mass matrix. */
enum { RESULTS = 2 * KT_TREE_NV + 2 + 6 * KT_TREE_BODIES + KT_TREE_NV * KT_TREE_NV };

static void collect_results(kt_generated *g, const kt_tree_state *s, double out[RESULTS]) {
    memset(out, 0, RESULTS * sizeof *out);
    double *const energy = out + 2 * KT_TREE_NV, *const marker = energy + 2;
    kt_check_equal_int("forward", g->forward(g->model, s->q, s->v, s->tau, out), 0);
    kt_check_equal_int("inverse", g->inverse(g->model, s->q, s->v, s->a, out + KT_TREE_NV), 0);
    kt_check_equal_int("energy", g->energy(g->model, s->q, s->v, energy), 0);
    kt_check_equal_int("markers", g->markers(g->model, s->q, s->v, marker, marker + 3 * KT_TREE_BODIES), 0);
    kt_check_equal_int("mass", g->mass(g->model, s->q, marker + 6 * KT_TREE_BODIES), 0);
}

/* Whether this processor and this compiler of the test know an instruction set that a command asks for. */
static bool has_instructions(const char *command) {
#if defined(__x86_64__)
    return strstr(command, "avx512") == NULL || __builtin_cpu_supports("avx512f");
#else
    return strstr(command, "-m") == NULL;
#endif
}

/* SSE2, AVX2 and AVX-512; the second tree has functions in parts. */
KT_TEST(bits_are_equal_for_compilers_and_levels) {
    static const char *const compile[] = {"gcc -O0",
                                          "gcc -O3",
                                          "gcc -O3 -mavx2",
                                          "gcc -O3 -mavx2 -mfma",
                                          "gcc -O3 -mavx512f -mprefer-vector-width=512",
                                          "clang -O2",
                                          "clang -O3 -march=x86-64-v3",
                                          "clang -O3 -mavx512f -mprefer-vector-width=512"};
    static kt_generated g;
    static double first[RESULTS], other[RESULTS];
    kt_random random = kt_random_of_test();
    for (int n = 0; n < 2; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = n == 0 ? KT_SHORT(3, 6) : 12;
        int compared = 0;
        kt_tree_sample(&tree, &plan, &random, &s);
        for (size_t k = 0; k < sizeof compile / sizeof *compile; k++) {
            char name[8];
            if (n == 1 && k > 0 && strstr(compile[k], "avx512") == NULL) /* they take long */
                continue;
            snprintf(name, sizeof name, "%.*s", (int)strcspn(compile[k], " "), compile[k]);
            if (!kt_generated_has(name) || !has_instructions(compile[k])) {
                kt_skip(compile[k], "this machine has no such compiler or no such instructions");
                continue;
            }
            kt_generated_make_some(&g, tree.model, compared_functions, compile[k], false);
            collect_results(&g, &s, compared++ == 0 ? first : other);
            kt_check_true("the second tree has parts", n == 0 || g.has_parts[0]);
            if (compared > 1)
                kt_check_equal_bits(compile[k], other, first, RESULTS);
        }
    }
}

typedef int float_forward(const void *model, const float *q, const float *v, const float *tau, float *a);

/* Three hinges z, y, z in one point, of which the last link has all inertia: at a small angle of the second one, the
 * inertia about the first one is J sin^2. In single precision that is rounding of J. */
static void check_small_inertia(const char *compile, bool is_single) {
    static kt_generated g;
    static float one[KT_GENERATED_PARAMETERS];
    static double two[KT_GENERATED_PARAMETERS];
    static const double angle[] = {0.0, 1e-5, 1e-4, 5e-4, 0.5};
    small_tree t;
    small_tree_make(&t, 3);
    kt_generated_make_some(&g, t.model, KT_CODEGEN_FORWARD, compile, false);
    for (int i = 0; i < g.count; i++) {
        const bool is_kept = strncmp(g.name[i], "link3_", 6) == 0 && strstr(g.name[i], "_at_") == NULL;
        one[i] = is_kept ? ((const float *)(const void *)g.standard)[i] : 0.0F;
        two[i] = is_kept && !is_single ? g.standard[i] : 0.0;
    }
    g.prepare(is_single ? (const double *)(const void *)one : two, g.model);
    for (int k = 0; k < 5; k++) {
        const double q[3] = {0.3, angle[k], 0.7}, v[3] = {0.0}, tau[3] = {1.0, 0.0, 0.0};
        const float q1[3] = {0.3F, (float)angle[k], 0.7F}, v1[3] = {0.0F}, tau1[3] = {1.0F, 0.0F, 0.0F};
        double a[3];
        float a1[3];
        float_forward *forward;
        memcpy(&forward, &g.forward, sizeof forward);
        const int code = is_single ? forward(g.model, q1, v1, tau1, a1) : g.forward(g.model, q, v, tau, a);
        const int expected = k == 0 || (is_single && k < 4) ? kt_body_find(t.model, "link1") : 0;
        kt_note("%s, angle %g", is_single ? "single" : "double", angle[k]);
        kt_check_equal_int("body without inertia", code, expected);
    }
}

KT_TEST(the_least_inertia_of_a_joint_depends_on_the_precision) {
    kt_generated_need_compiler();
    check_small_inertia("cc -O1", false);
    check_small_inertia("cc -O1 -Dmech_FLOAT", true);
}
