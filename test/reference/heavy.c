/* Grams and kilotonnes: with all masses, inertias and forces times s, every motion is the same function of time.
 *
 * For s = 2^k, products and sums keep all their bits but the exponent. So do all quantities that decide: pivots, ranks,
 * thresholds, step sizes. If code compares a mass or a force with a fixed number, the bits differ.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/analysis.h"
#include "kinetree/descriptor.h"

#include "files/scene/collect.h"
#include "scene.h"
#include "scene_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const int exponents[] = {-30, 30}; /* 2^30 = 1.07e9 */
enum { SCALES = 2, NUMBERS_MAX = 64 };

/* ---- a description with all masses and forces times s ------------------------------------------------------------ */

static kt_sym3 heavier_inertia(kt_sym3 j, double s) {
    return kt_sym3_make(s * j.xx, s * j.yy, s * j.zz, s * j.xy, s * j.xz, s * j.yz);
}

/* numbers: room for those of a polynomial or a table. */
static void make_function_stronger(kt_function *f, double s, double numbers[NUMBERS_MAX]) {
    f->value *= s;
    f->amplitude *= s;
    f->offset *= s;
    f->from *= s;
    f->to *= s;
    for (int i = 0; i < f->number_count && i < NUMBERS_MAX; i++)
        numbers[i] = f->numbers[i] * (f->type == KT_FUNCTION_TABLE && i % 2 == 0 ? 1.0 : s);
    f->numbers = numbers;
    kt_check_true("room for numbers", f->number_count <= NUMBERS_MAX);
}

/* Members in newtons, by the units of their keys. numbers: room for three functions. */
static void make_stronger(kt_effect *effect, double s, double (*numbers)[NUMBERS_MAX]) {
    const kt_descriptor *type = kt_effect_descriptor(effect->type);
    for (int k = 0; k < type->key_count; k++) {
        const kt_key *key = &type->keys[k];
        void *member = (char *)effect + key->offset;
        if (key->unit[0] != 'N')
            continue;
        if (key->kind == KT_KEY_NUMBER)
            *(double *)member *= s;
        else if (key->kind == KT_KEY_SIX)
            for (int i = 0; i < 6; i++)
                ((double *)member)[i] *= s;
        else if (key->kind == KT_KEY_FUNCTION)
            make_function_stronger(member, s, numbers[0]);
        else if (key->kind == KT_KEY_FUNCTIONS)
            for (int i = 0; i < 3; i++)
                make_function_stronger((kt_function *)member + i, s, numbers[i]);
        else
            kt_check_true("a member in newtons of a kind that this test knows", false);
    }
}

/* The copies that a heavier description points to. */
typedef struct heavier {
    kt_description description;
    kt_body *bodies;
    kt_effect *effects;
    double (*numbers)[NUMBERS_MAX];
} heavier;

static heavier make_heavier(const kt_description *given, double s) {
    heavier h = {.description = *given};
    h.bodies = calloc((size_t)given->body_count + 1, sizeof *h.bodies);
    h.effects = calloc((size_t)given->effect_count + 1, sizeof *h.effects);
    h.numbers = calloc(3 * (size_t)given->effect_count + 1, sizeof *h.numbers);
    if (!kt_check_true("memory", h.bodies && h.effects && h.numbers))
        exit(1);
    for (int i = 0; i < given->body_count; i++) {
        kt_body *body = &h.bodies[i];
        *body = given->bodies[i];
        body->mass *= s;
        body->inertia = heavier_inertia(body->inertia, s);
        for (int k = 0; k < KT_JOINT_NV_MAX; k++)
            body->joint.armature[k] *= s;
    }
    for (int i = 0; i < given->effect_count; i++) {
        h.effects[i] = given->effects[i];
        make_stronger(&h.effects[i], s, h.numbers + 3 * (size_t)i);
    }
    h.description.bodies = h.bodies;
    h.description.effects = h.effects;
    return h;
}

static void free_heavier(heavier *h) {
    free(h->bodies);
    free(h->effects);
    free(h->numbers);
}

/* ---- what is compared -------------------------------------------------------------------------------------------- */

/* The results of a model: `count` numbers that masses do not change. There are none if the call fails with `status`. */
typedef struct outcome {
    kt_status status;
    size_t count;
    double *values;
} outcome;

typedef outcome kt_find(const kt_case *c, const kt_model *model);

/* The motion after part of its time, and the counts of the run. */
static outcome run_shortly(const kt_case *c, const kt_model *model) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    kt_run run = c->scene.run;
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    run.duration = fmin(run.duration, 0.5);
    outcome o = {.count = nq + nv + 2, .values = calloc(nq + nv + 2, sizeof(double))};
    o.status = kt_simulation_create(model, &run, NULL, &simulation, &error);
    if (o.status == KT_OK)
        o.status = kt_simulation_advance(simulation, run.duration, &error);
    if (o.status != KT_OK)
        kt_note("%s: %s: %s", c->name, error.where, error.message);
    if (simulation && o.values) {
        memcpy(o.values, kt_simulation_positions(simulation), nq * sizeof(double));
        memcpy(o.values + nq, kt_simulation_velocities(simulation), nv * sizeof(double));
        const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
        o.values[nq + nv] = (double)counts.steps;
        o.values[nq + nv + 1] = (double)counts.evaluations;
    }
    kt_simulation_free(simulation);
    return o;
}

static outcome find_rest(const kt_model *model, bool nearest) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    kt_equilibrium_options options = kt_equilibrium_options_default();
    kt_linearization *linearization = NULL;
    kt_data *data = NULL;
    outcome o = {.count = nq, .values = calloc(nq + nv + 1, sizeof(double))};
    options.nearest = nearest;
    o.status = kt_data_create(model, &data, NULL);
    if (o.status == KT_OK) {
        kt_model_initial(model, o.values, o.values + nq);
        o.status = kt_state_assemble(model, data, 0.0, o.values, o.values + nq, NULL);
    }
    if (o.status == KT_OK)
        o.status = kt_linearization_create(model, NULL, &linearization, NULL);
    if (o.status == KT_OK)
        o.status = kt_equilibrium_find(linearization, &options, 0.0, o.values, NULL, NULL, NULL);
    kt_linearization_free(linearization);
    kt_data_free(data);
    return o;
}

static outcome find_stable_rest(const kt_case *c, const kt_model *model) { return (void)c, find_rest(model, false); }
static outcome find_nearest_rest(const kt_case *c, const kt_model *model) { return (void)c, find_rest(model, true); }

static int compared; /* outcomes that are no errors */

/* Formulas of forces are in newtons, and hold numbers that a description cannot scale. */
static bool has_formulas(const kt_description *description) {
    for (int i = 0; i < description->effect_count; i++)
        if (description->effects[i].type == KT_EFFECT_EXPRESSION)
            return true;
    return false;
}

static void compare(const kt_case *c, kt_find *find) {
    if (has_formulas(&c->scene.description) || kt_has_variable_mass(&c->scene.description)) {
        kt_note("%s: left out, its forces or masses are formulas", c->name);
        return;
    }
    const outcome usual = find(c, c->model);
    compared += usual.status == KT_OK;
    for (int k = 0; k < SCALES; k++) {
        heavier h = make_heavier(&c->scene.description, ldexp(1.0, exponents[k]));
        KT_WORST off = kt_worst_make("bits");
        kt_model *model = kt_test_model(&h.description, NULL);
        const outcome o = find(c, model);
        kt_worst_near(&off, o.status, usual.status, 0.0, "%s, masses times 2^%d: status", c->name, exponents[k]);
        for (size_t i = 0; i < usual.count && usual.status == KT_OK && o.status == KT_OK; i++)
            kt_worst_near(&off, o.values[i], usual.values[i], 0.0, "%s, masses times 2^%d: number %zu", c->name,
                          exponents[k], i);
        free(o.values);
        free_heavier(&h);
    }
    free(usual.values);
}

static void compare_all(kt_find *find, int least) {
    compared = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        kt_case c = kt_case_open(kt_bundled(i));
        compare(&c, find);
    }
    kt_check_above("scenes compared", compared, least);
}

KT_TEST(motions_do_not_depend_on_the_unit_of_mass) { compare_all(run_shortly, 50); }
KT_TEST(stable_rests_do_not_depend_on_the_unit_of_mass) { compare_all(find_stable_rest, 38); }
KT_TEST(nearest_rests_do_not_depend_on_the_unit_of_mass) { compare_all(find_nearest_rest, 39); }
