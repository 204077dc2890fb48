/* Generated loops over repeated links: long chains, and bodies with equal limbs. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "generated.h"

#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    BODIES = 45,
    NV = BODIES + 5,
    FUNCTIONS = KT_CODEGEN_FORWARD | KT_CODEGEN_INVERSE | KT_CODEGEN_MASS | KT_CODEGEN_BIAS | KT_CODEGEN_ACCELERATION
};

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

typedef enum repeated_kind {
    CHAIN,
    MIXED_CHAIN,
    TURNED_CHAIN,
    PLANAR_CHAIN,
    FOLDED_CHAIN, /* its numbers are fixed, and equal for all links */
    LIMBS,
    LIMBS_OF_GROUND,
    REPEATED_KINDS
} repeated_kind;

/* The bodies of a kind, and the least number of its loops over links in forward, inverse, mass and bias; 0: they may be
 * straight lines. */
static const struct {
    const char *name;
    int bodies, loops[4];
} repeated_kinds[REPEATED_KINDS] = {
    [CHAIN] = {"a chain about x, y and z", 31, {6, 5, 30, 5}},
    [MIXED_CHAIN] = {"a chain of several joints", 45, {3, 1, 15, 1}},
    [TURNED_CHAIN] = {"a chain whose frames are in quarter turns", 40, {3, 2, 38, 2}},
    [PLANAR_CHAIN] = {"a chain in a plane", 45, {3, 0, 36, 0}},
    [FOLDED_CHAIN] = {"a chain of fixed numbers", 30, {1, 1, 25, 1}},
    [LIMBS] = {"a free body with six limbs", 31, {2, 2, 2, 2}},
    [LIMBS_OF_GROUND] = {"six limbs on the ground", 30, {6, 0, 0, 0}},
};

/* A description of some bodies; not to be copied. */
typedef struct repeated {
    kt_description description;
    kt_body body[BODIES];
    char name[BODIES][16];
    kt_model *model;
    kt_data *data;
} repeated;

static kt_vec3 draw_vector(kt_random *random, double size) {
    return kt_vec3_make(kt_random_uniform(random, 0.2, 1.0) * size, kt_random_uniform(random, -1.0, -0.2) * size,
                        kt_random_uniform(random, 0.2, 1.0) * size);
}

static void add_body(repeated *m, kt_random *random, int parent, kt_joint_type type, int axis) {
    const int i = m->description.body_count++;
    kt_body *b = &m->body[i];
    const kt_vec3 off = draw_vector(random, 0.002);
    snprintf(m->name[i], sizeof m->name[i], "b%d", i + 1);
    *b = kt_body_of(m->name[i], parent >= 0 ? m->name[parent] : NULL, type, 0.0);
    b->joint.axis = kt_vec3_make(axis == 0, axis == 1, axis == 2);
    b->joint.at = draw_vector(random, 0.3);
    if (type == KT_JOINT_SCREW)
        b->joint.pitch = kt_random_uniform(random, 0.01, 0.05);
    b->mass = kt_random_uniform(random, 0.5, 2.0);
    b->com = draw_vector(random, 0.1);
    b->inertia = kt_sym3_make(0.03 + off.x, 0.035 + off.y, 0.028 + off.z, off.x, off.y, off.z);
}

/* Turns the frame of the last joint by quarters, so that signs go from link to link, and makes most numbers zero. */
static void turn_last(repeated *m, kt_random *random) {
    static const kt_mat3 turn[3] = {{.x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}},
                                    {.x = {0, -1, 0}, .y = {0, 0, -1}, .z = {1, 0, 0}},
                                    {.x = {0, 1, 0}, .y = {0, 0, 1}, .z = {1, 0, 0}}};
    const int i = m->description.body_count - 1;
    kt_body *b = &m->body[i];
    b->joint.rotation = kt_rotation_matrix(turn[i % 3]);
    b->joint.at = kt_vec3_make(0.0, 0.0, draw_vector(random, 0.3).x);
    b->com.x = 0.0;
    b->inertia = kt_sym3_make(0.03, 0.035, 0.028, 0.0, 0.0, 0.0);
}

/* Draws the numbers of a mechanism. All draws have one structure. */
static void repeated_make(repeated *m, repeated_kind kind, kt_random *random) {
    static const kt_joint_type mixed[3] = {KT_JOINT_REVOLUTE, KT_JOINT_PRISMATIC, KT_JOINT_SCREW};
    memset(m, 0, sizeof *m);
    m->description = kt_description_default();
    m->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    m->description.bodies = m->body;
    const int base = kind == LIMBS; /* limbs have five links */
    if (kind == LIMBS)
        add_body(m, random, -1, KT_JOINT_FREE, 0);
    for (int i = 0; i < repeated_kinds[kind].bodies - base; i++) {
        kt_random same = kt_random_named("links with equal numbers");
        kt_random *draws = kind == FOLDED_CHAIN ? &same : random;
        if (kind == LIMBS || kind == LIMBS_OF_GROUND)
            add_body(m, draws, i % 5 > 0 ? i - 1 + base : base - 1, KT_JOINT_REVOLUTE, i % 5 % 3);
        else
            add_body(m, draws, i - 1, kind == MIXED_CHAIN ? mixed[i % 3] : KT_JOINT_REVOLUTE,
                     kind == PLANAR_CHAIN || kind == TURNED_CHAIN ? 2 : i % 3);
        if (kind == CHAIN)
            m->body[i].joint.armature[0] = kt_random_uniform(random, 0.01, 0.02);
        if (kind == TURNED_CHAIN)
            turn_last(m, random);
    }
    m->model = kt_test_model(&m->description, NULL);
    m->data = kt_test_data(m->model);
}

/* A position, velocities, accelerations and forces. */
typedef struct repeated_state {
    double q[NV + 1], v[NV], a[NV], tau[NV];
} repeated_state;

static void draw_state(const kt_model *model, kt_random *random, repeated_state *s) {
    kt_model_initial(model, s->q, s->v);
    double turn[NV];
    for (int i = 0; i < kt_model_nv(model); i++) {
        turn[i] = kt_random_uniform(random, -2.0, 2.0);
        s->v[i] = kt_random_uniform(random, -1.0, 1.0);
        s->a[i] = kt_random_uniform(random, -1.0, 1.0);
        s->tau[i] = kt_random_uniform(random, -1.0, 1.0);
    }
    kt_position_add(model, s->q, turn, s->q);
}

/* ---- the library ------------------------------------------------------------------------------------------------- */

static double largest_number(const double *x, int count) {
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

typedef struct repeated_errors {
    kt_worst inverse, bias, mass, forward;
} repeated_errors;

/* The accelerations of the file give the joint forces by the inverse dynamics of the library. */
static void compare_with_library(kt_generated *g, const repeated *m, const repeated_state *s, repeated_errors *e) {
    static double own[NV * NV], right[NV * NV];
    const int nv = kt_model_nv(m->model);
    kt_error error = {0};
    kt_check_equal_int("inverse", g->inverse(g->model, s->q, s->v, s->a, own), 0);
    kt_need_fine("inverse dynamics", kt_dynamics_inverse(m->model, m->data, s->q, s->v, s->a, NULL, right, &error),
                 &error);
    for (int i = 0; i < nv; i++)
        kt_worst_near(&e->inverse, own[i], right[i], 100.0 * DBL_EPSILON * largest_number(right, nv), "entry %d", i);
    static const double no_rates[NV];
    kt_check_equal_int("bias", g->bias(g->model, s->q, s->v, own), 0);
    kt_need_fine("bias", kt_dynamics_inverse(m->model, m->data, s->q, s->v, no_rates, NULL, right, &error), &error);
    for (int i = 0; i < nv; i++)
        kt_worst_near(&e->bias, own[i], right[i], 100.0 * DBL_EPSILON * largest_number(right, nv), "entry %d", i);
    kt_check_equal_int("forward", g->forward(g->model, s->q, s->v, s->tau, own), 0);
    kt_check_equal_int("acceleration", g->acceleration(g->model, 0.0, s->q, s->v, NULL, s->tau, right), 0);
    kt_check_equal_bits("acceleration is forward without effects", right, own, (size_t)nv);
    const double fastest = largest_number(own, nv);
    kt_need_fine("forward dynamics", kt_dynamics_inverse(m->model, m->data, s->q, s->v, own, NULL, right, &error),
                 &error);
    double off[NV];
    for (int i = 0; i < nv; i++)
        off[i] = right[i] - s->tau[i];
    kt_check_equal_int("mass", g->mass(g->model, s->q, own), 0);
    kt_need_fine("mass matrix", kt_dynamics_mass(m->model, m->data, s->q, right, &error), &error);
    const double heaviest = largest_number(right, nv * nv);
    for (int i = 0; i < nv * nv; i++)
        kt_worst_near(&e->mass, own[i], right[i], 100.0 * DBL_EPSILON * heaviest, "entry %d", i);
    for (int i = 0; i < nv; i++)
        kt_worst_near(&e->forward, off[i], 0.0, 100.0 * DBL_EPSILON * heaviest * fastest, "joint %d", i);
}

/* Counts the loops over links of each function. */
static void count_loops(const kt_generated *g, int loops[4]) {
    char path[128], line[512];
    static const char *const function[4] = {" forward_", " inverse_", " mass_", " bias_"};
    int at = -1, iterations;
    snprintf(path, sizeof path, "%s/mech.c", g->folder);
    FILE *file = fopen(path, "r");
    loops[0] = loops[1] = loops[2] = loops[3] = 0;
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        for (int k = 0; k < 4; k++)
            at = strstr(line, "static ") != NULL && strstr(line, function[k]) != NULL ? k : at;
        if (at >= 0 && sscanf(line, " for (int i = 0; i < %d;", &iterations) == 1)
            loops[at]++;
    }
    if (file != NULL)
        fclose(file);
}

/* A file of one draw computes the functions of other draws, whose numbers it receives. */
static void check_kind(repeated_kind kind, kt_random *random) {
    static const char *const what[4] = {"loops of forward", "loops of inverse", "loops of mass", "loops of bias"};
    static kt_generated g;
    static double numbers[KT_GENERATED_PARAMETERS];
    repeated_errors e = {kt_worst_make("inverse dynamics"), kt_worst_make("bias"), kt_worst_make("mass matrix"),
                         kt_worst_make("forward dynamics")};
    repeated m;
    int loops[4], count = 0;
    kt_error error = {0};
    const bool fold = kind == FOLDED_CHAIN;
    kt_note("%s", repeated_kinds[kind].name);
    repeated_make(&m, kind, random);
    kt_generated_make_some(&g, m.model, FUNCTIONS, "cc -O0", fold);
    count_loops(&g, loops);
    for (int k = 0; k < 4; k++)
        if (repeated_kinds[kind].loops[k] > 0)
            kt_check_above(what[k], loops[k] + 0.5, repeated_kinds[kind].loops[k]);
    for (int draw = 0; draw < 10; draw++) {
        repeated_state s;
        repeated_make(&m, kind, random);
        const kt_status status =
            kt_codegen_numbers(m.model, FUNCTIONS, numbers, KT_GENERATED_PARAMETERS, &count, &error);
        kt_need_fine("numbers", status, &error);
        if (!fold && !kt_check_equal_int("parameters", count, g.count))
            break;
        if (!fold)
            g.prepare(numbers, g.model);
        draw_state(m.model, random, &s);
        compare_with_library(&g, &m, &s, &e);
    }
    kt_check_worst(&e.inverse);
    kt_check_worst(&e.bias);
    kt_check_worst(&e.mass);
    kt_check_worst(&e.forward);
}

KT_TEST(loops_over_links_agree_with_the_library_for_all_numbers) {
    kt_random random = kt_random_of_test();
    kt_generated_need_compiler();
    for (int kind = 0; kind < REPEATED_KINDS; kind++)
        check_kind((repeated_kind)kind, &random);
}

/* Entries of the mass matrix are moments about the last link of a chain. Seen from the ground at a distance of 1e6 m,
 * they would have six digits less. The smallest entries are as exact as their rows and columns. */
KT_TEST(the_mass_matrix_of_a_chain_does_not_depend_on_its_place) {
    static kt_generated g;
    static double near[NV * NV], far[NV * NV], right[NV * NV];
    kt_random random = kt_random_of_test();
    KT_WORST error_of_entries = kt_worst_make("entry");
    kt_error error = {0};
    repeated m;
    repeated_state s;
    kt_generated_need_compiler();
    repeated_make(&m, CHAIN, &random);
    kt_generated_make_some(&g, m.model, KT_CODEGEN_MASS, "cc -O1", false);
    const int nv = kt_model_nv(m.model);
    draw_state(m.model, &random, &s);
    kt_check_equal_int("mass", g.mass(g.model, s.q, near), 0);
    double parameter[KT_GENERATED_PARAMETERS];
    memcpy(parameter, g.standard, (size_t)g.count * sizeof *parameter);
    int moved = 0;
    for (int i = 0; i < g.count; i++)
        if (strncmp(g.name[i], "b1_at_", strlen("b1_at_")) == 0) {
            parameter[i] = 1e6;
            moved++;
        }
    kt_check_above("coordinates that are moved", moved, 0.5);
    g.prepare(parameter, g.model);
    kt_check_equal_int("mass", g.mass(g.model, s.q, far), 0);
    kt_check_equal_bits("far from the ground", far, near, (size_t)(nv * nv));
    kt_need_fine("mass matrix", kt_dynamics_mass(m.model, m.data, s.q, right, &error), &error);
    for (int i = 0; i < nv * nv; i++)
        kt_worst_near(&error_of_entries, near[i], right[i],
                      100.0 * DBL_EPSILON * sqrt(right[i % nv * (nv + 1)] * right[i / nv * (nv + 1)]), "entry %d", i);
}

/* ---- refusals and bits ------------------------------------------------------------------------------------------- */

/* A rotor of negative inertia makes the inertia of one joint negative. */
KT_TEST(loops_return_the_body_whose_joint_has_no_inertia) {
    static kt_generated g;
    kt_random random = kt_random_of_test();
    repeated m;
    repeated_state s;
    kt_generated_need_compiler();
    repeated_make(&m, CHAIN, &random);
    kt_generated_make_some(&g, m.model, FUNCTIONS, "cc -O1", false);
    draw_state(m.model, &random, &s);
    for (int body = 6; body < 18; body++) {
        double parameter[KT_GENERATED_PARAMETERS], a[NV] = {7.0};
        memcpy(parameter, g.standard, (size_t)g.count * sizeof *parameter);
        char name[32];
        snprintf(name, sizeof name, "b%d_armature", body);
        for (int i = 0; i < g.count; i++)
            if (strcmp(g.name[i], name) == 0)
                parameter[i] = -1e6;
        g.prepare(parameter, g.model);
        kt_check_equal_int("body", g.forward(g.model, s.q, s.v, s.tau, a), body);
        kt_check_near("nothing is written", a[0], 7.0, 0.0);
    }
}

enum { RESULTS = NV * (NV + 2), COMPARED = KT_CODEGEN_FORWARD | KT_CODEGEN_INVERSE | KT_CODEGEN_MASS };

/* Loops that a compiler turns into vectors, or not. */
KT_TEST(bits_of_loops_are_equal_for_compilers) {
    static const char *const compile[] = {"gcc -O0", "gcc -O3", "clang -O3", "gcc -O3 -mavx512f"};
    static kt_generated g;
    static double first[RESULTS], other[RESULTS];
    kt_random random = kt_random_of_test();
    repeated m;
    repeated_state s;
    int compared = 0;
    repeated_make(&m, CHAIN, &random);
    draw_state(m.model, &random, &s);
    for (size_t k = 0; k < sizeof compile / sizeof *compile; k++) {
        char name[8];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(compile[k], " "), compile[k]);
#if defined(__x86_64__)
        const bool is_able = strstr(compile[k], "avx512") == NULL || __builtin_cpu_supports("avx512f");
#else
        const bool is_able = strstr(compile[k], "-m") == NULL;
#endif
        if (!kt_generated_has(name) || !is_able) {
            kt_skip(compile[k], "this machine has no such compiler or no such instructions");
            continue;
        }
        kt_generated_make_some(&g, m.model, COMPARED, compile[k], false);
        double *out = compared++ == 0 ? first : other;
        kt_check_equal_int("forward", g.forward(g.model, s.q, s.v, s.tau, out), 0);
        kt_check_equal_int("inverse", g.inverse(g.model, s.q, s.v, s.a, out + NV), 0);
        kt_check_equal_int("mass", g.mass(g.model, s.q, out + 2 * NV), 0);
        if (compared > 1)
            kt_check_equal_bits(compile[k], other, first, RESULTS);
    }
}
