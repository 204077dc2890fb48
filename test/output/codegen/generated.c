/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "generated.h"

#include "folder.h"

#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DERIVATIVES = KT_CODEGEN_INVERSE_DERIVATIVES | KT_CODEGEN_FORWARD_DERIVATIVES };

bool kt_generated_has(const char *compiler) {
    char command[128];
    snprintf(command, sizeof command, "%s --version >/dev/null 2>&1", compiler);
    return system(command) == 0; /* NOLINT(cert-env33-c): a compiler of this machine */
}

void kt_generated_need_compiler(void) {
    if (kt_generated_has("cc"))
        return;
    kt_skip("generated C", "there is no compiler of the name cc");
    kt_end_test();
}

/* Names of the members of mech_parameters, as the header lists them. */
static bool read_names(kt_generated *g) {
    char path[128], line[512];
    bool inside = false;
    snprintf(path, sizeof path, "%s/mech.h", g->folder);
    FILE *file = fopen(path, "r");
    if (!kt_check_true("the header can be read", file != NULL))
        return false;
    g->count = 0;
    while (fgets(line, sizeof line, file) != NULL && g->count < KT_GENERATED_PARAMETERS) {
        if (strstr(line, "typedef struct mech_parameters") != NULL)
            inside = true;
        else if (inside && line[0] == '}')
            break;
        else if (inside && sscanf(line, " mech_number %63[a-zA-Z0-9_];", g->name[g->count]) == 1)
            g->count++;
    }
    fclose(file);
    return kt_check_true("the header lists parameters", inside && g->count < KT_GENERATED_PARAMETERS);
}

/* Parts of a file with fixed numbers: it has a function of the same head, and no parameters. */
#define FOLDED_HOOK                                                                                                    \
    "int folded_acceleration(const void *m, double t, const double *q, const double *v, const double *x,\n"            \
    "    const double *tau, double *a) { return mech_acceleration(m, t, q, v, x, tau, a); }\n"                         \
    "const double folded_default[1] = {0};\n"                                                                          \
    "void folded_prepare(const double *p, double *m) { (void)p; (void)m; }\n"

/* Functions of a file with fixed numbers that take a model, and ignore it. */
static const char folded[] =
    "#define RATES(f) int folded_##f(const void *m, const double *q, const double *v, double *x) { \\\n"
    "    (void)m; return mech_##f(q, v, x); }\n"
    "#define GIVEN(f) int folded_##f(const void *m, const double *q, const double *v, const double *x, double *y) { "
    "\\\n"
    "    (void)m; return mech_##f(q, v, x, y); }\n"
    "#define STEP(f) int folded_##f(const void *m, const double *q, const double *v, const double *x, double h, \\\n"
    "    double *p, double *u) { (void)m; return mech_##f(q, v, x, h, p, u); }\n"
    "RATES(bias) RATES(effects) RATES(energy) GIVEN(forward) GIVEN(inverse) STEP(heun) STEP(rk4)\n"
    "STEP(semi_implicit)\n"
    "int folded_jacobians(const void *m, const double *q, double *x) { (void)m; return mech_jacobians(q, x); }\n"
    "int folded_inverse_derivatives(const void *m, const double *q, const double *v, const double *x, double *y,\n"
    "    double *z) { (void)m; return mech_inverse_derivatives(q, v, x, y, z); }\n"
    "int folded_forward_derivatives(const void *m, const double *q, const double *v, const double *x, double *y,\n"
    "    double *z, double *w) { (void)m; return mech_forward_derivatives(q, v, x, y, z, w); }\n"
    "int folded_mass(const void *m, const double *q, double *x) { (void)m; return mech_mass(q, x); }\n"
    "int folded_markers(const void *m, const double *q, const double *v, double *x, double *u) {\n"
    "    (void)m; return mech_markers(q, v, x, u); }\n" FOLDED_HOOK;

/* The same of recursions alone. */
static const char folded_recursions[] =
    "#define GIVEN(f) int folded_##f(const void *m, const double *q, const double *v, const double *x, double *y) { "
    "\\\n"
    "    (void)m; return mech_##f(q, v, x, y); }\n"
    "GIVEN(forward) GIVEN(inverse)\n"
    "int folded_bias(const void *m, const double *q, const double *v, double *x) { (void)m; return mech_bias(q, v, x); "
    "}\n"
    "int folded_mass(const void *m, const double *q, double *x) { (void)m; return mech_mass(q, x); }\n" FOLDED_HOOK;

/* The same with forces that depend on time. */
static const char folded_timed[] =
    "int folded_effects(const void *m, double t, const double *q, const double *v, double *x) {\n"
    "    (void)m; return mech_effects(t, q, v, x); }\n"
    "#define STEP(f) int folded_##f(const void *m, double t, const double *q, const double *v, const double *x, \\\n"
    "    double h, double *p, double *u) { (void)m; return mech_##f(t, q, v, x, h, p, u); }\n"
    "STEP(heun) STEP(rk4) STEP(semi_implicit)\n" FOLDED_HOOK;

static void write_files(kt_generated *g, const kt_model *model, unsigned functions, bool fold) {
    char path[2][128];
    kt_error error = {0};
    snprintf(path[0], sizeof path[0], "%s/mech.c", g->folder);
    snprintf(path[1], sizeof path[1], "%s/mech.h", g->folder);
    FILE *source = fopen(path[0], "w"), *header = fopen(path[1], "w");
    kt_status status = KT_ERROR_FILE;
    if (kt_check_true("files can be written", source != NULL && header != NULL))
        status = kt_codegen_write(model, "mech", functions, fold, source, header, &error);
    if (source != NULL && fold)
        fputs(!(functions & KT_CODEGEN_FORWARD)  ? folded_timed
              : (functions & KT_CODEGEN_EFFECTS) ? folded
                                                 : folded_recursions,
              source);
    if (source != NULL)
        fclose(source);
    if (header != NULL)
        fclose(header);
    kt_need_fine("generate", status, &error);
}

/* Finds which equation the accelerations have, and which functions are divided into parts. */
static void read_method(kt_generated *g) {
    char path[128], line[512];
    snprintf(path, sizeof path, "%s/mech.c", g->folder);
    FILE *file = fopen(path, "r");
    kt_need(kt_check_true("the source can be read", file != NULL));
    while (fgets(line, sizeof line, file) != NULL) {
        g->is_articulated |= strstr(line, "U = A s") != NULL;
        g->is_planar |= strstr(line, "J' = p . M p - V^2 / D") != NULL;
        g->loops_have_time |= strstr(line, "int mech_forward(const mech_model *model, mech_number t, ") != NULL;
        g->has_parts[0] |= strstr(line, " forward_1(") != NULL;
        g->has_parts[1] |= strstr(line, " mass_1(") != NULL;
    }
    fclose(file);
}

/* Whether a symbol is a function that the file does not have. */
static bool is_left_out(const char *name, unsigned functions) {
    for (int k = 0; k < KT_CODEGEN_COUNT; k++)
        if (strcmp(kt_codegen_name(k), name) == 0)
            return (functions & 1u << k) == 0;
    return false;
}

static void close_library(void *library) { (void)dlclose(library); }

static void load_file(kt_generated *g, const char *prefix, unsigned functions) {
    char path[128], name[64];
    snprintf(path, sizeof path, "%s/mech.so", g->folder);
    g->library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    kt_test_own(g->library, close_library);
    kt_need(kt_check_true("the file can be loaded", g->library != NULL));
    const struct {
        const char *name;
        void *target;
    } symbol[] = {{"prepare", &g->prepare},
                  {"forward", &g->forward},
                  {"inverse", &g->inverse},
                  {"acceleration", &g->acceleration},
                  {"bias", &g->bias},
                  {"effects", &g->effects},
                  {"energy", &g->energy},
                  {"mass", &g->mass},
                  {"markers", &g->markers},
                  {"default", &g->standard},
                  {"heun", &g->heun},
                  {"rk4", &g->rk4},
                  {"semi_implicit", &g->semi_implicit},
                  {"jacobians", &g->jacobians},
                  {"project", &g->project},
                  {"loops", &g->loops},
                  {"inverse_derivatives", &g->inverse_derivatives},
                  {"forward_derivatives", &g->forward_derivatives}};
    for (size_t i = 0; i < sizeof symbol / sizeof *symbol; i++) {
        if (is_left_out(symbol[i].name, functions))
            continue;
        snprintf(name, sizeof name, "%s_%s", prefix, symbol[i].name);
        void *const at = dlsym(g->library, name);
        kt_need(kt_check_true(name, at != NULL));
        memcpy(symbol[i].target, &at, sizeof at);
    }
    memcpy(&g->effects_at, &g->effects, sizeof g->effects);
    memcpy(&g->forward_at, &g->forward, sizeof g->forward);
    memcpy(&g->forward_derivatives_at, &g->forward_derivatives, sizeof g->forward_derivatives);
    memcpy(&g->project_at, &g->project, sizeof g->project);
    memcpy(&g->loops_at, &g->loops, sizeof g->loops);
    memcpy(&g->heun_at, &g->heun, sizeof g->heun);
    memcpy(&g->rk4_at, &g->rk4, sizeof g->rk4);
    memcpy(&g->semi_implicit_at, &g->semi_implicit, sizeof g->semi_implicit);
    g->prepare(g->standard, g->model);
}

void kt_generated_make_some(kt_generated *g, const kt_model *model, unsigned functions, const char *compile,
                            bool fold) {
    char command[512];
    memset(g, 0, sizeof *g);
    g->folder = kt_test_folder();
    write_files(g, model, functions, fold);
    if (!fold)
        read_names(g);
    read_method(g);
    snprintf(command, sizeof command,
             "%s -std=c99 -Wall -Wextra -Werror -pedantic -Wconversion -fPIC -shared %s/mech.c -o %s/mech.so -lm",
             compile, g->folder, g->folder);
    const int code = system(command); /* NOLINT(cert-env33-c): a compiler of this machine */
    kt_need(kt_check_equal_int("the compiler's exit code", code, 0));
    load_file(g, fold ? "folded" : "mech", functions);
}

void kt_generated_make(kt_generated *g, const kt_model *model, const char *compile) {
    kt_generated_make_some(g, model, KT_GENERATED_USUAL, compile, false);
}

void kt_generated_make_plain(kt_generated *g, const kt_model *model, const char *compile) {
    kt_generated_make_some(g, model, (unsigned)KT_GENERATED_USUAL & ~(unsigned)DERIVATIVES, compile, false);
}

void kt_generated_fold(kt_generated *g, const kt_model *model, const char *compile) {
    kt_generated_make_some(g, model, KT_GENERATED_USUAL, compile, true);
}

static double *part_of(kt_vec3 *v, const char *end) { return end[0] == 'x' ? &v->x : end[0] == 'y' ? &v->y : &v->z; }

static double *entry_of(kt_sym3 *j, const char *end) {
    static const char *const part[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
    double *const entry[] = {&j->xx, &j->yy, &j->zz, &j->xy, &j->xz, &j->yz};
    for (int i = 0; i < 6; i++)
        if (strcmp(part[i], end) == 0)
            return entry[i];
    return NULL;
}

static double *number_of_body(kt_tree *tree, int b, const char *what) {
    kt_body *body = &tree->body[b];
    if (strcmp(what, "mass") == 0)
        return &body->mass;
    if (strncmp(what, "com_", 4) == 0)
        return part_of(&body->com, what + 4);
    if (strncmp(what, "inertia_", 8) == 0)
        return entry_of(&body->inertia, what + 8);
    if (strncmp(what, "at_", 3) == 0)
        return part_of(&body->joint.at, what + 3);
    if (strcmp(what, "pitch") == 0)
        return &body->joint.pitch;
    if (strcmp(what, "armature") == 0)
        return &body->joint.armature[0];
    if (strncmp(what, "armature_", 9) == 0)
        return &body->joint.armature[what[9] - '1'];
    if (strncmp(what, "marker_tip_", 11) == 0)
        return part_of(&tree->marker[body->markers - tree->marker].at, what + 11);
    return NULL;
}

/* KEY_1 to KEY_6 among six numbers; NULL: another name. */
static double *one_of_six(double *six, const char *key, const char *name) {
    const size_t length = strlen(key);
    return strncmp(name, key, length) == 0 && name[length] >= '1' && name[length] <= '6' ? six + (name[length] - '1')
                                                                                         : NULL;
}

static double *vector_of_effect(kt_effect *e, const char *name) {
    if (strncmp(name, "at_", 3) == 0)
        return part_of(&e->between[0].at, name + 3);
    if (strncmp(name, "at2_", 4) == 0)
        return part_of(&e->between[1].at, name + 4);
    if (strncmp(name, "exhaust_", 8) == 0)
        return part_of(&e->exhaust, name + 8);
    if (strncmp(name, "value_", 6) == 0)
        return &e->value[name[6] - 'x'].value;
    double *found = one_of_six(e->stiffnesses, "stiffness_", name);
    found = found != NULL ? found : one_of_six(e->dampings, "damping_", name);
    found = found != NULL ? found : one_of_six(e->dampings, "axes_linear_", name);
    return found != NULL ? found : one_of_six(e->quadratics, "axes_quadratic_", name);
}

static double *scalar_of_effect(kt_effect *e, const char *name) {
    const struct {
        const char *name;
        double *number;
    } all[] = {{"stiffness", &e->stiffness},
               {"damping", &e->damping},
               {"rest", &e->rest.value},
               {"length", &e->length},
               {"coulomb", &e->coulomb},
               {"viscous", &e->viscous},
               {"static", &e->breakaway},
               {"stribeck", &e->stribeck},
               {"smoothing", &e->smoothing},
               {"lower", &e->lower},
               {"upper", &e->upper},
               {"limit", &e->limit},
               {"torque", &e->torque.value},
               {"target", &e->target.value},
               {"linear", &e->linear},
               {"quadratic", &e->quadratic},
               {"strength", &e->strength},
               {"radius", &e->radius},
               {"exponent", &e->exponent},
               {"friction", &e->friction},
               {"slip", &e->slip},
               {"dissipation", &e->dissipation},
               {"rolling", &e->rolling},
               {"torsion", &e->torsion},
               {"turn", &e->turn}};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        if (strcmp(all[i].name, name) == 0)
            return all[i].number;
    return NULL;
}

/* A number of an effect, which is called e and its index. */
static double *number_of_effect(kt_tree *tree, const char *name) {
    char *end;
    const long i = strtol(name + 1, &end, 10);
    kt_effect *effect = (kt_effect *)(uintptr_t)&tree->description.effects[i]; /* the test's own */
    if (i < 0 || i >= tree->description.effect_count)
        return NULL;
    if (*end != '_')
        return NULL;
    double *const found = scalar_of_effect(effect, end + 1);
    return found != NULL ? found : vector_of_effect(effect, end + 1);
}

double *kt_generated_number(kt_tree *tree, const char *name) {
    double *found = name[0] == 'e' ? number_of_effect(tree, name) : NULL;
    if (strncmp(name, "gravity_", 8) == 0)
        return part_of(&tree->description.gravity, name + 8);
    for (int b = 0; b < tree->description.body_count && found == NULL; b++) {
        const size_t length = strlen(tree->body[b].name);
        if (strncmp(name, tree->body[b].name, length) == 0 && name[length] == '_')
            found = number_of_body(tree, b, name + length + 1);
    }
    kt_check_true(name, found != NULL);
    return found;
}

static void semi_implicit_library_step(const kt_tree *tree, double t, double h, const kt_tree_state *s, double *next) {
    const int nq = kt_model_nq(tree->model);
    double a[KT_TREE_NV];
    kt_error error = {0};
    kt_status status = kt_acceleration_evaluate(tree->model, tree->data, t, s->q, s->v, s->tau, NULL, a, &error);
    for (int i = 0; i < tree->nv && status == KT_OK; i++) {
        next[nq + i] = s->v[i] + h * a[i];
        a[i] = h * next[nq + i];
    }
    if (status == KT_OK)
        kt_position_add(tree->model, s->q, a, next);
    if (status == KT_OK && kt_loop_count(tree->model) > 0)
        status = kt_state_project(tree->model, tree->data, t + h, next, next + nq, NULL, &error);
    kt_need_fine("semi-implicit step", status, &error);
}

void kt_generated_library_step(const kt_tree *tree, const kt_method *method, double t, double h, const kt_tree_state *s,
                               double *next) {
    if (method == NULL) {
        semi_implicit_library_step(tree, t, h, s, next);
        return;
    }
    const kt_step step = {.method = method, .t = t, .h = h, .tau = s->tau};
    const size_t size = kt_step_work_size(tree->model, method);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_error error = {0};
    const kt_status status = kt_step_evaluate(tree->model, tree->data, work, size, &step, s->q, s->v, next,
                                              next + kt_model_nq(tree->model), &error);
    free(work);
    kt_need_fine("step", status, &error);
}
