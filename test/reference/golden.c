/* The bits of the records of every bundled scene, compared with the list golden.txt. If a change of the code changes a
 * number, the test reports the scene and the setting. A line is a case:
 *
 *     four-bar tree qr identity auto rk4 h=0.0025 t=0.5    motion 0123456789abcdef  forces 0123456789abcdef
 *
 * The first number of a line is the FNV-1a hash (64 bits) of time, q and v of all records. The second is the hash of
 * everything else in a record: accelerations, energies, works, residuals and reactions.
 *
 * The list is the same on every machine. The instruction-set levels of the library give equal bits. The functions of
 * the C library differ, because glibc chooses them by the processor. They are taken from golden_libm.c here. OpenBLAS's
 * kernels depend on the processor, too. Scenes that call them are left out ("LAPACK" in the list). These are dense
 * groups of 40 coordinates or more, the absolute formulation of more than six bodies, and the reduction svd.
 *
 * test/reference/golden --update writes the list anew (KT_GOLDEN_UPDATE). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../formulation.h"
#include "files/scene/collect.h"
#include "scene.h"
#include "scene_files.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- hashes ------------------------------------------------------------------------------------------------------ */

/* FNV-1a over the bytes of the numbers, the lowest first. */
static void hash(uint64_t *h, const double *x, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &x[i], sizeof bits);
        for (int byte = 0; byte < 8; byte++)
            *h = (*h ^ (bits >> (8 * byte) & 0xff)) * 0x100000001b3u;
    }
}

static void hash_vector(uint64_t *h, kt_vec3 x) { hash(h, (const double[]){x.x, x.y, x.z}, 3); }

static void hash_wrenches(uint64_t *h, const kt_wrench *wrenches, int first, int count) {
    for (int i = first; i < count; i++) {
        hash_vector(h, wrenches[i].moment);
        hash_vector(h, wrenches[i].force);
    }
}

typedef struct hashes {
    const kt_model *model;
    uint64_t motion, forces;
    int64_t records;
} hashes;

static int hash_record(const kt_record *r, void *user) {
    hashes *h = user;
    const kt_model *model = h->model;
    const double numbers[] = {r->kinetic,       r->potential,           r->work.dissipated,
                              r->work.supplied, r->constraint.position, r->constraint.velocity};
    hash(&h->motion, &r->t, 1);
    hash(&h->motion, r->q, (size_t)kt_model_nq(model));
    hash(&h->motion, r->v, (size_t)kt_model_nv(model));
    hash(&h->motion, r->x, (size_t)kt_auxiliary_state_count(model));
    hash(&h->forces, r->a, (size_t)kt_model_nv(model));
    hash(&h->forces, numbers, sizeof numbers / sizeof numbers[0]);
    hash_wrenches(&h->forces, r->reactions, 1, kt_model_body_count(model));
    hash_wrenches(&h->forces, r->loop_reactions, 0, kt_loop_count(model));
    h->records++;
    return 0;
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

enum { CASES_MAX = 2048, NAME_SIZE = 120, RESULT_SIZE = 64, LINE_SIZE = 200 };

static const char heading[] = "# Hashes of the records of every bundled scene: see golden.c. Written by "
                              "test/reference/golden --update; a commit that\n"
                              "# moves a line says why, and by how much.\n";

static struct {
    char line[CASES_MAX][LINE_SIZE];
    bool met[CASES_MAX];
    int count, moved;
    FILE *update; /* where the list is written anew; NULL: it is compared */
} list;

static void read_list(void) {
    FILE *file = fopen(KT_GOLDEN, "r");
    char line[LINE_SIZE];
    list.count = 0;
    while (file != NULL && list.count < CASES_MAX && fgets(line, sizeof line, file) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        if (line[0] != '#' && line[0] != '\0') {
            list.met[list.count] = false;
            memcpy(list.line[list.count++], line, sizeof line);
        }
    }
    if (file != NULL)
        fclose(file);
}

/* The line of the list whose case is `name`; "" where there is none. */
static const char *find_line(const char *name) {
    const size_t length = strlen(name);
    for (int i = 0; i < list.count; i++)
        if (strncmp(list.line[i], name, length) == 0 && list.line[i][length] == ' ') {
            list.met[i] = true;
            return list.line[i];
        }
    return "";
}

static void compare(const char *name, const char *result) {
    char line[LINE_SIZE];
    snprintf(line, sizeof line, "%-70.119s  %.63s", name, result);
    if (list.update != NULL)
        fprintf(list.update, "%s\n", line);
    else
        list.moved += !kt_check_text(name, line, find_line(name));
}

/* ---- cases ------------------------------------------------------------------------------------------------------- */

/* Whether the plan has a step whose name begins so. */
static bool plan_has(const kt_model *model, const kt_run *run, const char *name) {
    kt_plan_step steps[KT_PLAN_STEPS_MAX];
    const int count = kt_plan_steps(model, run, steps);
    bool has = false, known = false;
    for (int i = 0; i < count; i++)
        if (strcmp(steps[i].name, name) == 0) {
            known = true;
            has = has || steps[i].dropped == NULL;
        }
    if (!known)
        kt_check_true(name, known);
    return has;
}

static bool is_planar(const kt_model *model, const kt_run *run) {
    return plan_has(model, run, "articulated bodies in planes") || plan_has(model, run, "loops in planes");
}

/* How a scene is computed. */
typedef struct computation {
    kt_run run;
    kt_formulation formulation;
    kt_reduction reduction;
    kt_model *model;
    kt_absolute *absolute;
} computation;

static bool compile(const kt_case *c, computation *with) {
    kt_model_options options = kt_model_options_default();
    kt_error error = {KT_OK, "", ""};
    options.reduction = kt_reduction_method_of(with->reduction);
    options.metric = with->run.metric;
    options.plan = with->run.plan;
    with->model = NULL;
    (void)kt_fine(c->name, kt_model_compile(&c->scene.description, &options, &with->model, &error), &error);
    with->absolute = kt_formulate(&c->scene.description, &options, with->model, with->formulation);
    return with->model != NULL && (with->absolute != NULL) == (with->formulation == KT_FORMULATION_ABSOLUTE);
}

static const kt_model *integrated(const computation *with) {
    return with->absolute != NULL ? kt_absolute_model(with->absolute) : with->model;
}

static void write_name(const kt_case *c, const computation *with, const kt_run *run, char *name, size_t size) {
    kt_method storage;
    const int length = snprintf(name, size, "%s %s %s %s %s %s ", c->name, kt_formulation_name(with->formulation),
                                kt_reduction_name(with->reduction), kt_metric_name(run->metric),
                                kt_plan_name(run->plan), kt_run_method(run, integrated(with), &storage)->name);
    if (run->step > 0.0)
        snprintf(name + length, size - (size_t)length, "h=%g t=%g", run->step, run->duration);
    else
        snprintf(name + length, size - (size_t)length, "%g t=%g", run->relative, run->duration);
}

static void run_case(const kt_case *c, const computation *with, const kt_run *run) {
    char name[NAME_SIZE], result[RESULT_SIZE] = "failed";
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error = {KT_OK, "", ""};
    hashes h = {with->model, 0xcbf29ce484222325u, 0xcbf29ce484222325u, 0};
    options.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ACCELERATION | KT_RECORD_ENERGY |
                     KT_RECORD_BALANCE | KT_RECORD_CONSTRAINT | KT_RECORD_REACTION;
    write_name(c, with, run, name, sizeof name);
    if (plan_has(integrated(with), run, "LAPACK")) {
        compare(name, "LAPACK");
        return;
    }
    const kt_either simulation = kt_either_begin(with->model, with->absolute, run, &options);
    kt_need_fine(name, kt_either_run(simulation, hash_record, &h, &error), &error);
    snprintf(result, sizeof result, "motion %016" PRIx64 "  forces %016" PRIx64, h.motion, h.forces);
    compare(name, result);
}

enum { RECORDS = 100 };

/* The scene's time between records, or an interval of which one half is a stable step for rk4. */
static double interval_of(const kt_case *c) {
    const double parts = strcmp(c->name, "fishing-rod") == 0           ? 200.0
                         : strcmp(c->name, "flyball-governor") == 0    ? 100.0
                         : strcmp(c->name, "five-bar") == 0            ? 100.0
                         : strcmp(c->name, "shot") == 0                ? 20.0
                         : strcmp(c->name, "tethered-satellites") == 0 ? 10.0
                                                                       : 1.0;
    return c->scene.run.interval / parts;
}

/* A hundred records: with rk4 and two steps a record, and with the method of the scene. */
static void run_steps(const kt_case *c, const computation *with) {
    kt_run run = with->run;
    run.interval = interval_of(c);
    run.duration = RECORDS * run.interval;
    run.integrator = "rk4";
    run.step = 0.5 * run.interval;
    run_case(c, with, &run);
    const bool fixed = c->scene.run.step > 0.0;
    run.integrator = fixed ? "dopri5" : c->scene.run.integrator;
    run.step = 0.0;
    if (fixed)
        run.relative = run.absolute = 1e-9;
    run_case(c, with, &run);
}

/* In the plane where the scene has one, and in space. */
static void run_plans(const kt_case *c, computation with) {
    bool both = true;
    for (with.run.plan = KT_PLAN_AUTO; with.run.plan < KT_PLAN_COUNT && both; with.run.plan++) {
        both = compile(c, &with);
        if (both) {
            run_steps(c, &with);
            both = is_planar(integrated(&with), &with.run);
        }
        kt_model_free(with.model);
    }
}

/* The absolute formulation of up to six free bodies has fewer coordinates than LAPACK is called for. */
enum { ABSOLUTE_BODIES_MAX = 6 };

static void run_scene(const char *name) {
    kt_case c = kt_case_open(name);
    if (plan_has(c.model, &c.scene.run, "LAPACK")) {
        compare(name, "LAPACK");
    } else {
        computation with = {.run = c.scene.run, .formulation = c.scene.formulation, .reduction = c.scene.reduction};
        const bool loops = kt_loop_count(c.model) > 0;
        run_plans(&c, with);
        with.run.metric = KT_METRIC_MASS;
        if (loops)
            run_plans(&c, with);
        with.run.metric = KT_METRIC_IDENTITY;
        with.reduction = KT_REDUCTION_PARTITION;
        if (loops)
            run_plans(&c, with);
        with.formulation = KT_FORMULATION_ABSOLUTE;
        if (kt_model_body_count(c.model) - 1 <= ABSOLUTE_BODIES_MAX && !kt_is_for_trees_alone(&c.scene.description)) {
            run_plans(&c, with);
            with.reduction = KT_REDUCTION_QR;
            run_plans(&c, with);
        }
    }
}

static void run_scenes(void) {
    for (int i = 0; kt_bundled(i) != NULL; i++)
        run_scene(kt_bundled(i));
}

/* Every method, with the scene's step and with a tolerance. */
static void run_methods(const char *name) {
    kt_case c = kt_case_open(name);
    const computation with = {.model = c.model};
    kt_run run = c.scene.run;
    run.interval = interval_of(&c);
    run.duration = RECORDS * run.interval;
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *method = kt_method_at(i);
        run.integrator = method->name;
        run.step = 0.5 * run.interval;
        if (strcmp(method->name, "rk4") != 0)
            run_case(&c, &with, &run);
        run.step = 0.0;
        run.relative = run.absolute = 1e-6;
        if (method->embedded_order > 0)
            run_case(&c, &with, &run);
    }
}

/* ---- the test ---------------------------------------------------------------------------------------------------- */

static void run_all(void) {
    static const char *const trees_and_loops[] = {"double-pendulum", "three-body", "four-bar", "flyball-governor"};
    run_scenes();
    for (size_t i = 0; i < sizeof trees_and_loops / sizeof trees_and_loops[0]; i++)
        run_methods(trees_and_loops[i]);
}

KT_TEST(records_have_the_bits_of_the_list) {
    const char *update = getenv("KT_GOLDEN_UPDATE");
    if (update != NULL) {
        list.update = fopen(update, "w");
        kt_need(kt_check_true("the list can be written", list.update != NULL));
        fputs(heading, list.update);
        run_all();
        kt_check_equal_int("writing", fclose(list.update), 0);
        return;
    }
    read_list();
    run_all();
    int left = 0;
    for (int i = 0; i < list.count; i++)
        if (!list.met[i]) {
            kt_note("no such case any more: %s", list.line[i]);
            left++;
        }
    kt_check_equal_int("lines without a case", left, 0);
    if (left + list.moved > 0)
        kt_note("where numbers are meant to move: 'test/reference/golden --update' writes the list anew; the commit "
                "must say why they move, and by how much");
}
