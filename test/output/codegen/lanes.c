/* Generated files with mech_LANES: each lane has the bits of a file that computes one state. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "closed_tree.h"
#include "effect_set.h"
#include "files/scene/collect.h"

#include "kinetree/joint.h"
#include "kinetree/scene.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    LANES_MOST = 8,
    RECURSIONS = KT_GENERATED_USUAL & ~(KT_CODEGEN_INVERSE_DERIVATIVES | KT_CODEGEN_FORWARD_DERIVATIVES),
    NUMBERS = 6 * 6 * KT_TREE_NV, /* of an array of a function, at most */
    CHANGES = KT_CODEGEN_HEUN_DERIVATIVES | KT_CODEGEN_RK4_DERIVATIVES | KT_CODEGEN_SEMI_IMPLICIT_DERIVATIVES,
    CHANGED_MOST = 5 /* coordinates of a mechanism whose steps are differentiated */
};

static const double now = KT_CLOSED_NOW, length_of_step = 1e-2, unwritten = -0x1.234566p+77; /* a float, too */

/* ---- functions by their heads ------------------------------------------------------------------------------------ */

/* The arguments of a function, as the header declares them. */
typedef struct lanes_head {
    char input[4][8]; /* names */
    int inputs, outputs;
    bool has_time, has_step;
} lanes_head;

/* Reads the head of mech_NAME from the header. Returns false if the file does not have it. */
static bool read_head(const kt_generated *g, const char *name, lanes_head *head) {
    char path[128], line[512], begin[64];
    bool found = false;
    snprintf(path, sizeof path, "%s/mech.h", g->folder);
    snprintf(begin, sizeof begin, "int mech_%s(", name);
    FILE *file = fopen(path, "r");
    memset(head, 0, sizeof *head);
    while (file != NULL && !found && fgets(line, sizeof line, file) != NULL)
        found = strncmp(line, begin, strlen(begin)) == 0;
    if (file != NULL)
        fclose(file);
    for (char *rest = line, *word; found && (word = strtok_r(rest, "(,", &rest)) != NULL;) {
        char *const star = strchr(word, '*');
        head->has_time |= strstr(word, "mech_number t") != NULL;
        head->has_step |= strstr(word, "mech_number h") != NULL;
        if (star == NULL || strstr(word, "mech_real") == NULL)
            continue;
        if (strstr(word, "const") == NULL)
            head->outputs++;
        else if (head->inputs < 4)
            snprintf(head->input[head->inputs++], sizeof head->input[0], "%.7s", star + 1);
    }
    return found;
}

/* Calls the function `at` with arguments of these types. */
#define LANES_CALL(types, arguments)                                                                                   \
    {                                                                                                                  \
        int(*function) types;                                                                                          \
        memcpy(&function, &at, sizeof function);                                                                       \
        return function arguments;                                                                                     \
    }

/* Calls a function of this head, whose numbers are of the type `real`. A head without a case fails the test. */
#define LANES_CALL_HEAD(call, real)                                                                                    \
    static int call(void *at, const lanes_head *head, const void *model, real *const in[4], real *const out[3]) {      \
        typedef const void *model_of;                                                                                  \
        typedef const real *given;                                                                                     \
        typedef real *found;                                                                                           \
        const real t = (real)now, h = (real)length_of_step;                                                            \
        const int kind = head->has_step * 1000 + head->has_time * 100 + head->inputs * 10 + head->outputs;             \
        switch (kind) {                                                                                                \
        case 11:                                                                                                       \
            LANES_CALL((model_of, given, found), (model, in[0], out[0]))                                               \
        case 21:                                                                                                       \
            LANES_CALL((model_of, given, given, found), (model, in[0], in[1], out[0]))                                 \
        case 31:                                                                                                       \
            LANES_CALL((model_of, given, given, given, found), (model, in[0], in[1], in[2], out[0]))                   \
        case 22:                                                                                                       \
            LANES_CALL((model_of, given, given, found, found), (model, in[0], in[1], out[0], out[1]))                  \
        case 32:                                                                                                       \
            LANES_CALL((model_of, given, given, given, found, found), (model, in[0], in[1], in[2], out[0], out[1]))    \
        case 23:                                                                                                       \
            LANES_CALL((model_of, given, given, found, found, found), (model, in[0], in[1], out[0], out[1], out[2]))   \
        case 33:                                                                                                       \
            LANES_CALL((model_of, given, given, given, found, found, found),                                           \
                       (model, in[0], in[1], in[2], out[0], out[1], out[2]))                                           \
        case 121:                                                                                                      \
            LANES_CALL((model_of, real, given, given, found), (model, t, in[0], in[1], out[0]))                        \
        case 131:                                                                                                      \
            LANES_CALL((model_of, real, given, given, given, found), (model, t, in[0], in[1], in[2], out[0]))          \
        case 141:                                                                                                      \
            LANES_CALL((model_of, real, given, given, given, given, found),                                            \
                       (model, t, in[0], in[1], in[2], in[3], out[0]))                                                 \
        case 122:                                                                                                      \
            LANES_CALL((model_of, real, given, given, found, found), (model, t, in[0], in[1], out[0], out[1]))         \
        case 123:                                                                                                      \
            LANES_CALL((model_of, real, given, given, found, found, found),                                            \
                       (model, t, in[0], in[1], out[0], out[1], out[2]))                                               \
        case 133:                                                                                                      \
            LANES_CALL((model_of, real, given, given, given, found, found, found),                                     \
                       (model, t, in[0], in[1], in[2], out[0], out[1], out[2]))                                        \
        case 1032:                                                                                                     \
            LANES_CALL((model_of, given, given, given, real, found, found),                                            \
                       (model, in[0], in[1], in[2], h, out[0], out[1]))                                                \
        case 1132:                                                                                                     \
            LANES_CALL((model_of, real, given, given, given, real, found, found),                                      \
                       (model, t, in[0], in[1], in[2], h, out[0], out[1]))                                             \
        case 1143:                                                                                                     \
            LANES_CALL((model_of, real, given, given, given, given, real, found, found, found),                        \
                       (model, t, in[0], in[1], in[2], in[3], h, out[0], out[1], out[2]))                              \
        default:                                                                                                       \
            kt_check_equal_int("the head of the function", kind, 0);                                                   \
            return 0;                                                                                                  \
        }                                                                                                              \
    }

LANES_CALL_HEAD(call_head, double)
LANES_CALL_HEAD(call_single_head, float)

/* ---- lanes against single states --------------------------------------------------------------------------------- */

/* The same mechanism twice: for one state, and for several. */
typedef struct lanes_pair {
    kt_generated one, many;
    int lanes;
    bool is_single; /* precision */
    kt_tree_state state[LANES_MOST];
    double x[LANES_MOST][KT_EFFECT_STATES];
} lanes_pair;

typedef struct lanes_counts {
    int files, calls, numbers, rejected, states;
} lanes_counts;

/* Arguments of a function, in either precision. */
typedef struct lanes_arguments {
    _Alignas(64) double in[4][KT_TREE_NQ * LANES_MOST];
    _Alignas(64) double out[3][NUMBERS * LANES_MOST];
    _Alignas(64) float single_in[4][KT_TREE_NQ * LANES_MOST];
    _Alignas(64) float single_out[3][NUMBERS * LANES_MOST];
} lanes_arguments;

static const double *array_of_state(const lanes_pair *p, int lane, const char *name) {
    const kt_tree_state *s = &p->state[lane];
    return strcmp(name, "q") == 0     ? s->q
           : strcmp(name, "v") == 0   ? s->v
           : strcmp(name, "tau") == 0 ? s->tau
           : strcmp(name, "a") == 0   ? s->a
                                      : p->x[lane];
}

static size_t numbers_of_input(const kt_model *model, const char *name) {
    return (size_t)(name[0] == 'x'   ? kt_auxiliary_state_count(model)
                    : name[0] == 'q' ? kt_model_nq(model)
                                     : kt_model_nv(model));
}

/* Calls a function for the lanes from `first` on, of which it takes `lanes`. Results are in a->out. */
static int call_lanes(const lanes_pair *p, const kt_generated *g, void *at, const lanes_head *head,
                      const kt_model *model, int first, int lanes, lanes_arguments *a) {
    for (int i = 0; i < head->inputs; i++)
        for (int l = 0; l < lanes; l++)
            for (size_t k = 0; k < numbers_of_input(model, head->input[i]); k++) {
                const size_t to = k * (size_t)lanes + (size_t)l;
                a->in[i][to] = array_of_state(p, first + l, head->input[i])[k];
                a->single_in[i][to] = (float)a->in[i][to];
            }
    for (int o = 0; o < 3; o++)
        for (int k = 0; k < NUMBERS * lanes; k++)
            a->single_out[o][k] = (float)(a->out[o][k] = unwritten);
    if (!p->is_single)
        return call_head(at, head, g->model, (double *[4]){a->in[0], a->in[1], a->in[2], a->in[3]},
                         (double *[3]){a->out[0], a->out[1], a->out[2]});
    const int code = call_single_head(at, head, g->model,
                                      (float *[4]){a->single_in[0], a->single_in[1], a->single_in[2], a->single_in[3]},
                                      (float *[3]){a->single_out[0], a->single_out[1], a->single_out[2]});
    for (int o = 0; o < 3; o++)
        for (int k = 0; k < NUMBERS * lanes; k++)
            a->out[o][k] = (double)a->single_out[o][k];
    return code;
}

/* Calls a function for all lanes at once, and for each of them alone. */
static void compare_function(lanes_pair *p, const kt_model *model, const char *name, const lanes_head *head,
                             lanes_counts *counts) {
    static lanes_arguments together, alone;
    char symbol[64];
    int different = 0, numbers = 0;
    bool fails = false, is_known = false;
    snprintf(symbol, sizeof symbol, "mech_%s", name);
    void *const single = dlsym(p->one.library, symbol), *const several = dlsym(p->many.library, symbol);
    kt_need(kt_check_true(symbol, single != NULL && several != NULL));
    const int code = call_lanes(p, &p->many, several, head, model, 0, p->lanes, &together);
    for (int l = 0; l < p->lanes; l++) {
        const int own = call_lanes(p, &p->one, single, head, model, l, 1, &alone);
        fails |= own != 0;
        is_known |= own == code;
        for (int o = 0; o < 3 && code == 0; o++)
            for (int k = 0; k < NUMBERS; k++) {
                const double *const x = &together.out[o][k * p->lanes + l], *const y = &alone.out[o][k];
                different += memcmp(x, y, sizeof *x) != 0 && !(*x != *x && *y != *y); /* NaN are alike */
                numbers += *y != unwritten;
            }
    }
    kt_check_true(symbol, is_known && fails == (code != 0));
    if (!kt_check_equal_int(symbol, different, 0))
        kt_note("%s of %d lanes", symbol, p->lanes);
    counts->calls++;
    counts->numbers += numbers;
    counts->rejected += code != 0;
    for (int i = 0; i < head->inputs; i++)
        counts->states += head->input[i][0] == 'x' && kt_auxiliary_state_count(model) > 0;
}

/* Generates both files, and compares all functions. `place` gives lanes their states. */
static void compare_lanes(lanes_pair *p, const kt_model *model, unsigned functions, int n, lanes_counts *counts) {
    static const char *const compilers[4] = {"cc -O0", "clang -O1", "cc -O2", "clang -O0"};
    char command[2][96];
    const char *const compiler = compilers[kt_generated_has("clang") ? n % 4 : n % 2 * 2];
    p->lanes = n % 3 == 0 ? 8 : n % 3 == 1 ? 4 : 2;
    const char *const precision = p->is_single ? "-Dmech_FLOAT" : "";
    snprintf(command[0], sizeof command[0], "cc -O0 %s", precision);
    snprintf(command[1], sizeof command[1], "%s %s -Wno-psabi -Dmech_LANES=%d", compiler, precision, p->lanes);
    memset(&p->many, 0, sizeof p->many);
    kt_generated_make_some(&p->one, model, functions, command[0], false);
    kt_generated_make_some(&p->many, model, functions, command[1], false);
    counts->files++;
    for (int k = 0; k < KT_CODEGEN_COUNT; k++) {
        lanes_head head;
        if (read_head(&p->one, kt_codegen_name(k), &head))
            compare_function(p, model, kt_codegen_name(k), &head, counts);
    }
}

static int count_rounds(int usual) {
    const char *text = getenv("KT_MECHANISMS");
    return text != NULL ? (int)strtol(text, NULL, 10) : usual;
}

/* Lanes far from each other. Lane 1 has angles beyond 2^20 quarter turns, and sines in lane 5 are NaN. Lane 0 has
 * angles that the reduction of larger ones would round otherwise. */
static void draw_states(lanes_pair *p, const kt_tree *tree, kt_random *random) {
    for (int l = 0; l < LANES_MOST; l++) {
        kt_tree_state_draw(tree, random, &p->state[l]);
        for (int b = 1; b < tree->count; b++) {
            const kt_coordinates c = kt_body_coordinates(tree->model, b);
            if (c.type == KT_JOINT_REVOLUTE && l % 4 == 1)
                p->state[l].q[c.q] *= l == 1 ? 1e7 : 1e13;
            if (c.type == KT_JOINT_REVOLUTE && l == 0)
                p->state[l].q[c.q] += 1.3e6;
        }
    }
}

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

KT_TEST(lanes_of_trees_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    static lanes_pair p;
    lanes_counts counts = {0};
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(2); n++) {
        kt_tree_plan plan = n % 3 == 2 ? kt_tree_plan_planar() : kt_tree_plan_default();
        kt_tree tree;
        plan.bodies = n == 0 ? 4 : 7;
        plan.massless = false;
        plan.floats = n % 3 == 1;
        kt_tree_grow(&tree, &plan, &random);
        draw_states(&p, &tree, &random);
        compare_lanes(&p, tree.model, n == 0 ? KT_GENERATED_USUAL : RECURSIONS, n, &counts);
    }
    kt_check_above("functions", counts.calls, 12 * counts.files - 1);
    kt_check_above("numbers", counts.numbers, 4000 * counts.files);
}

KT_TEST(lanes_with_effects_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    static lanes_pair p;
    static kt_effect_set set;
    lanes_counts counts = {0};
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(1) * KT_EFFECT_TYPE_COUNT; n++) {
        kt_tree_plan plan = kt_tree_plan_default();
        kt_tree tree;
        plan.bodies = 5;
        plan.massless = false;
        plan.floats = n % 3 == 0;
        kt_tree_grow(&tree, &plan, &random);
        kt_effect_set_draw(&set, (kt_effect_type)(n % KT_EFFECT_TYPE_COUNT), &tree, &random);
        for (int l = 0; l < LANES_MOST; l++)
            kt_tree_state_draw(&tree, &random, &p.state[l]);
        compare_lanes(&p, tree.model, KT_CODEGEN_EFFECTS | KT_CODEGEN_HEUN, n, &counts);
    }
    kt_check_above("functions", counts.calls, 2 * counts.files);
}

/* Lanes close their loops after different numbers of steps: some are open by more than others. */
static void draw_closed_states(lanes_pair *p, const kt_closed_tree *m, kt_random *random) {
    for (int l = 0; l < LANES_MOST; l++) {
        double move[KT_TREE_NV] = {0.0};
        p->state[l] = m->state;
        for (int i = 0; i < m->tree.nv; i++) {
            move[i] = kt_random_uniform(random, -1.0, 1.0) * (l == 0 ? 0.0 : l % 2 == 1 ? 1e-9 : 1e-3);
            p->state[l].v[i] = kt_random_uniform(random, -1.0, 1.0);
            p->state[l].tau[i] = kt_random_uniform(random, -1.0, 1.0);
        }
        kt_position_add(m->tree.model, m->state.q, move, p->state[l].q);
    }
}

KT_TEST(lanes_with_loops_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    static lanes_pair p;
    static kt_closed_tree m;
    lanes_counts counts = {0};
    int changed = 0;
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(8); n++) {
        if (kt_closed_grow(&m, &random, 3 * n + n % 2 * KT_CLOSED_TYPES)) {
            const bool changes = m.tree.nv <= CHANGED_MOST && m.tree.nv == kt_model_nq(m.tree.model);
            draw_closed_states(&p, &m, &random);
            compare_lanes(&p, m.tree.model,
                          ((unsigned)KT_GENERATED_WITH_LOOPS & ~(unsigned)KT_CODEGEN_FORWARD_DERIVATIVES) |
                              (changes ? (unsigned)CHANGES : 0u),
                          n, &counts);
            changed += changes;
        }
    }
    kt_check_above("functions", counts.calls, 7 * counts.files - 1);
    kt_check_above("mechanisms whose steps are differentiated", changed, counts.files / 8 - 1);
    kt_check_below("calls that some lane rejects", counts.rejected, counts.calls / 2);
}

KT_TEST(lanes_with_auxiliary_states_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    static lanes_pair p;
    static kt_effect_set set;
    lanes_counts counts = {0};
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(2); n++) {
        kt_tree_plan plan = kt_tree_plan_default();
        kt_tree tree;
        kt_auxiliary_state state[KT_EFFECT_STATES];
        plan.bodies = 5;
        plan.massless = false;
        plan.types = 1u << KT_JOINT_REVOLUTE | 1u << KT_JOINT_PRISMATIC | 1u << KT_JOINT_SCREW; /* one coordinate */
        plan.floats = n % 2 == 1;
        p.is_single = n % 4 == 1;
        kt_tree_grow(&tree, &plan, &random);
        kt_effect_set_draw_states(&set, &tree, state, &random);
        for (int l = 0; l < LANES_MOST; l++) {
            kt_tree_state_draw(&tree, &random, &p.state[l]);
            for (int i = 0; i < KT_EFFECT_STATES; i++)
                p.x[l][i] = kt_random_uniform(&random, -1.0, 1.0);
        }
        compare_lanes(&p, tree.model,
                      KT_CODEGEN_EFFECTS | KT_CODEGEN_STATES | KT_CODEGEN_ACCELERATION | KT_CODEGEN_STEPS, n, &counts);
    }
    kt_check_above("functions with auxiliary states", counts.states, 6 * counts.files - 1);
}

/* Arguments, results and numbers of the file are floats, as many in a register as there are doubles in two. */
KT_TEST(lanes_in_single_precision_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    static lanes_pair p = {.is_single = true};
    static kt_closed_tree m;
    static kt_effect_set set;
    lanes_counts counts = {0};
    kt_generated_need_compiler();
    for (int n = 0; n < 3 * count_rounds(1); n++) {
        kt_tree_plan plan = kt_tree_plan_default();
        kt_tree own;
        kt_tree *const tree = n % 3 == 2 ? &m.tree : &own;
        unsigned functions = n % 3 == 0 ? (unsigned)RECURSIONS : KT_CODEGEN_EFFECTS | KT_CODEGEN_HEUN;
        plan.massless = false;
        if (n % 3 == 2) {
            if (!kt_closed_grow(&m, &random, n))
                continue;
            functions = (unsigned)KT_GENERATED_WITH_LOOPS & ~(unsigned)KT_CODEGEN_FORWARD_DERIVATIVES;
            draw_closed_states(&p, &m, &random);
        } else {
            kt_tree_grow(tree, &plan, &random);
            if (n % 3 == 1)
                kt_effect_set_draw(&set, KT_EFFECT_BUSHING, tree, &random);
            draw_states(&p, tree, &random);
        }
        compare_lanes(&p, tree->model, functions, n, &counts);
    }
    kt_check_above("functions", counts.calls, 6 * counts.files);
    kt_check_below("calls that some lane rejects", counts.rejected, counts.calls / 2);
}

/* Its functions are divided, and have loops over its limbs. */
KT_TEST(lanes_of_a_humanoid_have_the_bits_of_single_states) {
    kt_random random = kt_random_of_test();
    static lanes_pair p;
    lanes_counts counts = {0};
    kt_generated_need_compiler();
    kt_model *model = kt_test_model(&kt_test_bundled("humanoid")->description, NULL);
    for (int l = 0; l < LANES_MOST; l++) {
        double move[KT_TREE_NV];
        for (int i = 0; i < kt_model_nv(model); i++)
            move[i] = kt_random_uniform(&random, -1.0, 1.0);
        kt_model_initial(model, p.state[l].q, p.state[l].v);
        kt_position_add(model, p.state[l].q, move, p.state[l].q);
        for (int i = 0; i < kt_model_nv(model); i++)
            p.state[l].v[i] = p.state[l].tau[i] = p.state[l].a[i] = kt_random_uniform(&random, -1.0, 1.0);
    }
    compare_lanes(&p, model, KT_CODEGEN_INVERSE | KT_CODEGEN_MASS, 4, &counts);
    kt_check_above("numbers", counts.numbers, 10000);
}
