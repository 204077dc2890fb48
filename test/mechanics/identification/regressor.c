/* The regressor against inverse dynamics of trees with other masses, and base parameters against published numbers and
 * sets, with forces of random parameters. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/control/along.h"

#include "kinetree/identification.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TREES = 60, COLUMNS_MOST = 10 * KT_TREE_BODIES + 3 * KT_TREE_NV };

static double regressor[COLUMNS_MOST * KT_TREE_NV];

static void evaluate(const kt_tree *tree, const kt_tree_state *s) {
    kt_error e;
    kt_need_fine("regressor", kt_regressor_evaluate(tree->model, tree->data, s->q, s->v, s->a, regressor, &e), &e);
}

/* Row i of Y pi, and of |Y| |pi|. */
static double row_times(const kt_tree *tree, const double *pi, int i, double *size) {
    double sum = 0.0;
    *size = 0.0;
    for (int c = 0; c < kt_regressor_columns(tree->model); c++) {
        sum += regressor[(size_t)c * (size_t)tree->nv + (size_t)i] * pi[c];
        *size += fabs(regressor[(size_t)c * (size_t)tree->nv + (size_t)i] * pi[c]);
    }
    return sum;
}

/* ---- inverse dynamics -------------------------------------------------------------------------------------------- */

/* Gives all bodies that have an inertia another one. */
static void load_anew(kt_tree *tree, kt_random *random) {
    for (int i = 0; i < tree->description.body_count; i++) {
        kt_body *body = &tree->body[i];
        if (!(body->mass > 0.0))
            continue;
        body->mass = kt_random_uniform(random, 0.5, 3.0);
        body->com = kt_tree_vector(random, -0.4, 0.4);
        body->inertia = kt_tree_inertia(random, body->mass, 0.5);
    }
    kt_tree_free(tree);
    kt_tree_compile(tree, NULL);
}

/* Y of the first masses, pi of the second ones. Rounding errors are proportional to the largest of the forces' terms,
 * for all pass through the same accelerations: measured over forty seeds, up to 17 eps. */
KT_TEST(regressor_times_parameters_is_inverse_dynamics) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("Y pi");
    for (int n = 0; n < TREES; n++) {
        static double pi[COLUMNS_MOST];
        double tau[KT_TREE_NV], size;
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        memset(s.external, 0, sizeof s.external);
        evaluate(&tree, &s);
        load_anew(&tree, &random);
        kt_tree_inverse(&tree, &s, tau);
        kt_regressor_parameters(tree.model, pi);
        double largest = 0.0;
        for (int i = 0; i < tree.nv; i++) {
            (void)row_times(&tree, pi, i, &size);
            largest = fmax(largest, size);
        }
        for (int i = 0; i < tree.nv; i++)
            kt_worst_near(&error, row_times(&tree, pi, i, &size), tau[i], 40.0 * DBL_EPSILON * largest,
                          "tree %d row %d", n, i);
        kt_tree_free(&tree);
    }
}

/* Armature times a, viscous friction times v, Coulomb friction times the sign of v, each in its own coordinate
 * alone. */
KT_TEST(frictions_and_armatures_act_in_their_coordinates) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s;
    along_grow(&tree, 0, &random, &s);
    s.v[1] = 0.0;
    const int columns = kt_regressor_columns(tree.model);
    int wrong = 0, seen = 0;
    evaluate(&tree, &s);
    for (int c = 0; c < columns; c++) {
        const kt_dynamic_parameter p = kt_regressor_parameter(tree.model, c);
        const double *column = regressor + (size_t)c * (size_t)tree.nv;
        for (int i = 0; i < tree.nv && p.coordinate >= 0; i++) {
            const double v = s.v[i], sign = (v > 0.0) - (v < 0.0);
            const double own = p.kind == KT_DYNAMIC_ARMATURE ? s.a[i] : p.kind == KT_DYNAMIC_VISCOUS ? v : sign;
            wrong += column[i] != (i == p.coordinate ? own : 0.0);
            seen++;
        }
    }
    kt_check_equal_int("entries", seen, 3 * tree.nv * tree.nv);
    kt_check_equal_int("wrong ones", wrong, 0);
    kt_tree_free(&tree);
}

/* Both are compiled of one source, without fused operations. */
KT_TEST(regressor_has_the_same_bits_on_every_instruction_set) {
    static double baseline[COLUMNS_MOST * KT_TREE_NV];
    kt_random random = kt_random_of_test();
    const kt_model_options base = {.isa = KT_ISA_BASE};
    for (int n = 0; n < 6; n++) {
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        evaluate(&tree, &s);
        const size_t count = (size_t)kt_regressor_columns(tree.model) * (size_t)tree.nv;
        memcpy(baseline, regressor, count * sizeof *baseline);
        kt_tree_free(&tree);
        kt_tree_compile(&tree, &base);
        evaluate(&tree, &s);
        kt_check_equal_bits("regressor", regressor, baseline, count);
        kt_tree_free(&tree);
    }
}

/* ---- base parameters --------------------------------------------------------------------------------------------- */

typedef struct base_set {
    int rank, columns;
    int *column;
    double *relation;
} base_set;

static bool find(const kt_model *model, kt_data *data, base_set *b) {
    const size_t size = kt_base_parameters_work_size(model), columns = (size_t)kt_regressor_columns(model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    kt_error e;
    *b = (base_set){.columns = (int)columns,
                    .column = calloc(columns, sizeof *b->column),
                    .relation = calloc(columns * columns, sizeof *b->relation)};
    const bool found =
        kt_fine("base", kt_base_parameters_find(model, data, work, size, &b->rank, b->column, b->relation, &e), &e);
    free(work);
    return found;
}

static void forget(base_set *b) {
    free(b->column);
    free(b->relation);
}

static double base_value(const base_set *b, const double *pi, int i) {
    double value = pi[b->column[i]];
    for (int k = 0; k < b->columns - b->rank; k++)
        value += b->relation[(size_t)i + (size_t)k * (size_t)b->rank] * pi[b->column[b->rank + k]];
    return value;
}

/* Forces of random parameters from the base parameters alone, at states that the search has not seen. The relations are
 * exact to eps times the condition of the base columns: measured over forty seeds, up to 3.4e-13 of |Y| |pi|. */
KT_TEST(base_parameters_give_all_forces) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("forces");
    for (int n = 0; n < 12; n++) {
        static double pi[COLUMNS_MOST];
        kt_tree tree;
        kt_tree_state s;
        base_set b;
        along_grow(&tree, n, &random, &s);
        if (!find(tree.model, tree.data, &b))
            return;
        evaluate(&tree, &s);
        for (int c = 0; c < b.columns; c++)
            pi[c] = kt_random_normal(&random);
        for (int i = 0; i < tree.nv; i++) {
            double size, sum = 0.0;
            const double wanted = row_times(&tree, pi, i, &size);
            for (int k = 0; k < b.rank; k++)
                sum += regressor[(size_t)b.column[k] * (size_t)tree.nv + (size_t)i] * base_value(&b, pi, k);
            kt_worst_near(&error, sum, wanted, 1e-12 * size, "tree %d row %d", n, i);
        }
        forget(&b);
        kt_tree_free(&tree);
    }
}

/* A chain of turning bodies without friction or armature, whose joints lie at points in generic or special places. */
typedef struct arm {
    kt_body bodies[8];
    kt_description description;
    kt_model *model;
    kt_data *data;
} arm;

static void make_arm(arm *x, int count, const kt_vec3 *axis, const kt_vec3 *at, kt_vec3 gravity) {
    static const char *const names[] = {"one", "two", "three", "four", "five", "six", "seven", "eight"};
    *x = (arm){.description = kt_description_default()};
    for (int i = 0; i < count; i++) {
        x->bodies[i] = kt_body_of(names[i], i > 0 ? names[i - 1] : NULL, KT_JOINT_REVOLUTE, 1.0);
        x->bodies[i].joint.axis = axis[i];
        x->bodies[i].joint.at = at[i];
        x->bodies[i].inertia = kt_sym3_make(0.1, 0.1, 0.1, 0.0, 0.0, 0.0);
    }
    x->description.bodies = x->bodies;
    x->description.body_count = count;
    x->description.gravity = gravity;
    x->model = kt_test_model(&x->description, NULL);
    x->data = kt_test_data(x->model);
}

/* The number of parameters of inertia. The others are viscous and Coulomb friction of all joints. The armatures of some
 * joints are parameters too, if they do not appear in an inertia of the first bodies. */
static int inertial(const arm *x, const base_set *b) {
    int count = 0;
    for (int i = 0; i < b->rank; i++)
        count += kt_regressor_parameter(x->model, b->column[i]).kind < KT_DYNAMIC_ARMATURE;
    return count;
}

static void check_count(const char *what, int count, const kt_vec3 *axis, const kt_vec3 *at, kt_vec3 gravity,
                        int wanted) {
    arm x;
    base_set b;
    make_arm(&x, count, axis, at, gravity);
    if (!find(x.model, x.data, &b))
        return;
    kt_check_equal_int(what, inertial(&x, &b), wanted);
    forget(&b);
}

#define X_AXIS                                                                                                         \
    { 1.0, 0.0, 0.0 }
#define Y_AXIS                                                                                                         \
    { 0.0, 1.0, 0.0 }
#define Z_AXIS                                                                                                         \
    { 0.0, 0.0, 1.0 }

/* If each revolute joint is parallel or perpendicular to the one before, the number is `7 n - 4 b - 2 l`. Here b is the
 * number of links in the first run of parallel axes. If the first axis is along gravity, l = 1 (Mayeda, Yoshida & Osuka
 * 1990). This gives 36 for a `PUMA 560`, and 43 for an arm with seven axes. */
KT_TEST(base_parameters_are_as_many_as_published) {
    static const kt_vec3 planar[] = {Z_AXIS, Z_AXIS}, puma[] = {Z_AXIS, Y_AXIS, Y_AXIS, Z_AXIS, Y_AXIS, Z_AXIS},
                         seven[] = {Z_AXIS, Y_AXIS, Z_AXIS, Y_AXIS, Z_AXIS, Y_AXIS, Z_AXIS};
    static const kt_vec3 rods[] = {{0.0, 0.0, 0.0}, {0.7, 0.0, 0.0}};
    static const kt_vec3 puma_at[] = {{0.0, 0.0, 0.0},   {0.0, 0.15, 0.0}, {0.43, 0.0, 0.0},
                                      {0.02, 0.0, 0.43}, {0.0, 0.0, 0.0},  {0.0, 0.0, 0.0}};
    static const kt_vec3 seven_at[] = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.34}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.4},
                                       {0.0, 0.0, 0.0}, {0.0, 0.0, 0.4},  {0.0, 0.0, 0.0}};
    check_count("two links in a vertical plane", 2, planar, rods, kt_vec3_make(0.0, -9.81, 0.0), 6);
    check_count("in a horizontal plane", 2, planar, rods, kt_vec3_make(0.0, 0.0, -9.81), 4);
    check_count("PUMA 560", 6, puma, puma_at, kt_vec3_make(0.0, 0.0, -9.81), 36);
    check_count("seven axes", 7, seven, seven_at, kt_vec3_make(0.0, 0.0, -9.81), 43);
}

/* Two rods in a vertical plane, the first of 0.7 m. The parameters are Izz1 + l^2 m2 with the first rotor, mcx1 + l m2,
 * and all others alone. */
KT_TEST(base_parameters_of_two_links_have_their_known_names) {
    static const kt_vec3 axis[] = {Z_AXIS, Z_AXIS}, at[] = {{0.0, 0.0, 0.0}, {0.7, 0.0, 0.0}};
    static const char *const wanted[] = {"Izz(one) + 0.49 m(two) + armature(one)",
                                         "Izz(two)",
                                         "mcx(one) + 0.7 m(two)",
                                         "mcy(one)",
                                         "mcx(two)",
                                         "mcy(two)",
                                         "armature(two)",
                                         "viscous(one)",
                                         "viscous(two)",
                                         "Coulomb(one)",
                                         "Coulomb(two)"};
    arm x;
    base_set b;
    make_arm(&x, 2, axis, at, kt_vec3_make(0.0, -9.81, 0.0));
    if (!find(x.model, x.data, &b))
        return;
    kt_check_equal_int("base parameters", b.rank, 11);
    for (int i = 0; i < b.rank && i < 11; i++) {
        char text[80];
        const int length = kt_base_parameter_name(x.model, b.rank, b.column, b.relation, i, text, sizeof text);
        kt_check_text(wanted[i], text, wanted[i]);
        kt_check_equal_int("length", length, (int)strlen(wanted[i]));
        kt_check_equal_int("measured alone", kt_base_parameter_name(x.model, b.rank, b.column, b.relation, i, NULL, 0),
                           length);
        (void)kt_base_parameter_name(x.model, b.rank, b.column, b.relation, i, text, 5);
        kt_check_equal_int("cut off", (int)strlen(text), 4);
    }
    forget(&b);
}

KT_TEST(wrong_input_is_rejected_and_leaves_outputs) {
    static const kt_vec3 axis[] = {Z_AXIS}, at[] = {{0.0, 0.0, 0.0}};
    arm x;
    kt_error e = {0};
    double y[13] = {7.0}, relation[169];
    const double q[1] = {(double)NAN};
    int rank = 5, column[13];
    char small[64];
    make_arm(&x, 1, axis, at, kt_vec3_make(0.0, -9.81, 0.0));
    kt_check_equal_int("NaN", kt_regressor_evaluate(x.model, x.data, q, NULL, NULL, y, &e), KT_ERROR_NOT_FINITE);
    kt_check_contains("names the joint", e.where, "'one'");
    kt_check_near("untouched", y[0], 7.0, 0.0);
    kt_check_equal_int("small",
                       kt_base_parameters_find(x.model, x.data, small, sizeof small, &rank, column, relation, &e),
                       KT_ERROR_MEMORY);
    kt_check_equal_int("untouched", rank, 5);
}
