/* Generated C against the library, in turns: forward and inverse dynamics, the mass matrix, and derivatives of forward
 * dynamics of trees; accelerations and rk4 steps of linkages. The mechanisms are scenes, and the chain of chain.h. A
 * step of a linkage includes the projection of positions and velocities, on both sides. In lanes, a call computes the
 * accelerations of eight states: kt_batch_forward, against a file with mech_LANES.
 *
 * The program writes the files with kt_codegen_write, compiles them with `cc` for this processor, and loads them. A
 * line is trusted if both results agree to 1e-9 of their largest number. Bars are ratios of times, library over
 * generated.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/codegen.h"
#include "chain.h"
#include "kinetree/batch.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"
#include "report.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LANES_FLAGS "-Dmech_LANES=8 -Wno-psabi"
#define COMPILE "cc -std=c99 -O3 -march=native -fno-math-errno -fPIC -shared"

enum { FORWARD, INVERSE, MASS, DERIVATIVES, STEP, LANES, FUNCTIONS };
enum { STATES = 8, NV_MOST = 64, NQ_MOST = 70, PREPARED_MOST = 4096 };

typedef int given_function(const void *model, const double *q, const double *v, const double *x, double *out);
typedef int mass_function(const void *model, const double *q, double *out);
typedef int derivative_function(const void *model, const double *q, const double *v, const double *x, double *by_q,
                                double *by_v, double *by_x);
typedef int step_function(const void *model, const double *q, const double *v, const double *x, double h,
                          double *next_q, double *next_v);
typedef void prepare_function(const void *parameters, void *model);

/* A mechanism in both forms, at one state. */
typedef struct subject {
    const char *scene;
    int links;             /* of the chain; 0: it is a scene */
    double bar[FUNCTIONS]; /* 0: the function is left out, since its code would be very long */
    kt_model *model;
    kt_data *data;
    void *library, *many; /* the file for one state, and for STATES */
    given_function *given[2], *together;
    kt_batch *batch;
    _Alignas(64) double lanes[4][NQ_MOST * STATES]; /* q, v, x, out */
    mass_function *mass;
    derivative_function *derivatives;
    step_function *step;
    void *work; /* of the library's derivatives or steps */
    size_t work_size;
    double prepared[PREPARED_MOST];
    double q[NQ_MOST], v[NV_MOST], x[NV_MOST];
    double out[2][3 * NV_MOST * NV_MOST]; /* of the library, generated */
    int function;
    kt_status status;
} subject;

static subject subjects[] = {
    {.scene = "arm7", .bar = {2.0, 2.2, 3.0, 1.5, [LANES] = 2.9}},
    {.scene = "humanoid", .bar = {1.2, 1.5, 1.15}},
    {.scene = "chain", .links = 32, .bar = {1.4, 2.0, 1.0}},
    {.scene = "four-bar", .bar = {[FORWARD] = 2.5, [STEP] = 4.5}},
};

enum { SUBJECTS = sizeof subjects / sizeof *subjects };

static kt_status derive_library(subject *s, kt_error *error) {
    const size_t square = (size_t)kt_model_nv(s->model) * (size_t)kt_model_nv(s->model);
    double *out = s->out[0];
    return kt_dynamics_forward_derivatives(s->model, s->data, s->work, s->work_size, s->q, s->v, s->x, NULL, out,
                                           out + square, out + 2 * square, error);
}

static int derive_generated(subject *s) {
    const size_t square = (size_t)kt_model_nv(s->model) * (size_t)kt_model_nv(s->model);
    double *out = s->out[1];
    return s->derivatives(s->prepared, s->q, s->v, s->x, out, out + square, out + 2 * square);
}

#define STEP_SIZE 1e-3

static kt_status step_library(subject *s, kt_error *error) {
    const kt_step step = {.method = kt_method_find("rk4"), .h = STEP_SIZE, .tau = s->x};
    double *out = s->out[0];
    return kt_step_evaluate(s->model, s->data, s->work, s->work_size, &step, s->q, s->v, out,
                            out + kt_model_nq(s->model), error);
}

static kt_status accelerate_library(subject *s, kt_error *error) {
    return kt_loop_count(s->model) > 0
               ? kt_acceleration_evaluate(s->model, s->data, 0.0, s->q, s->v, s->x, NULL, s->out[0], error)
               : kt_dynamics_forward(s->model, s->data, s->q, s->v, s->x, NULL, s->out[0], error);
}

static void run_library(void *user, long repetitions) {
    subject *s = user;
    kt_error error;
    for (long i = 0; i < repetitions && s->status == KT_OK; i++)
        s->status = s->function == DERIVATIVES ? derive_library(s, &error)
                    : s->function == STEP      ? step_library(s, &error)
                    : s->function == LANES     ? kt_batch_forward(s->batch, &error)
                    : s->function == FORWARD   ? accelerate_library(s, &error)
                    : s->function == INVERSE
                        ? kt_dynamics_inverse(s->model, s->data, s->q, s->v, s->x, NULL, s->out[0], &error)
                        : kt_dynamics_mass(s->model, s->data, s->q, s->out[0], &error);
}

static void run_generated(void *user, long repetitions) {
    subject *s = user;
    int code = 0;
    for (long i = 0; i < repetitions; i++)
        code |= s->function == DERIVATIVES ? derive_generated(s)
                : s->function == STEP
                    ? s->step(s->prepared, s->q, s->v, s->x, STEP_SIZE, s->out[1], s->out[1] + kt_model_nq(s->model))
                : s->function == LANES ? s->together(s->prepared, s->lanes[0], s->lanes[1], s->lanes[2], s->lanes[3])
                : s->function == MASS  ? s->mass(s->prepared, s->q, s->out[1])
                                       : s->given[s->function](s->prepared, s->q, s->v, s->x, s->out[1]);
    if (code != 0)
        s->status = KT_ERROR_SINGULAR;
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

static bool find_symbol(void *library, const char *name, void *target) {
    void *const at = dlsym(library, name);
    memcpy(target, &at, sizeof at);
    return at != NULL;
}

/* Compiles the source and loads it under another name, since a name is loaded once; NULL: this fails. */
static void *compile_file(const char *folder, const char *name, const char *flags) {
    char command[400], path[64];
    (void)snprintf(path, sizeof path, "%s/%s.so", folder, name);
    (void)snprintf(command, sizeof command, COMPILE " %s %s/mech.c -o %s", flags, folder, path);
    void *const library = system(command) == 0 ? dlopen(path, RTLD_NOW) : NULL; /* NOLINT(cert-env33-c): ours */
    (void)unlink(path);
    return library;
}

/* Writes, compiles and loads the file of a model. Returns false after printing the fault. */
static bool load_generated(subject *s) {
    char folder[] = "/tmp/kt-bench-XXXXXX", path[2][64];
    static const char *const end[2] = {"c", "h"};
    kt_error error = {0};
    prepare_function *prepare = NULL;
    const void *standard = NULL;
    if (mkdtemp(folder) == NULL)
        return false;
    for (int i = 0; i < 2; i++)
        snprintf(path[i], sizeof path[i], "%s/mech.%s", folder, end[i]);
    FILE *source = fopen(path[0], "w"), *header = fopen(path[1], "w");
    const bool derives = s->bar[DERIVATIVES] > 0.0;
    const bool steps = s->bar[STEP] > 0.0;
    const unsigned functions = KT_CODEGEN_FORWARD | KT_CODEGEN_INVERSE | KT_CODEGEN_MASS |
                               (derives ? KT_CODEGEN_FORWARD_DERIVATIVES : 0u) | (steps ? KT_CODEGEN_RK4 : 0u);
    bool fine = source != NULL && header != NULL &&
                kt_codegen_write(s->model, "mech", functions, false, source, header, &error) == KT_OK;
    fine = source != NULL && fclose(source) == 0 && fine;
    fine = header != NULL && fclose(header) == 0 && fine;
    s->library = fine ? compile_file(folder, "mech", "") : NULL;
    s->many = fine && s->bar[LANES] > 0.0 ? compile_file(folder, "lanes", LANES_FLAGS) : NULL;
    fine = s->library != NULL && find_symbol(s->library, "mech_prepare", &prepare) &&
           find_symbol(s->library, "mech_default", &standard) &&
           find_symbol(s->library, "mech_forward", &s->given[FORWARD]) &&
           find_symbol(s->library, "mech_inverse", &s->given[INVERSE]) &&
           find_symbol(s->library, "mech_mass", &s->mass) &&
           (s->bar[LANES] <= 0.0 || (s->many != NULL && find_symbol(s->many, "mech_forward", &s->together))) &&
           (!steps || find_symbol(s->library, "mech_rk4", &s->step)) &&
           (!derives || find_symbol(s->library, "mech_forward_derivatives", &s->derivatives));
    if (fine)
        prepare(standard, s->prepared);
    else
        fprintf(stderr, "%s: the file cannot be made: %s\n", s->scene, error.message);
    for (int i = 0; i < 2; i++)
        (void)unlink(path[i]);
    (void)rmdir(folder);
    return fine;
}

static kt_status compile_scene(subject *s, kt_error *error) {
    char path[512];
    kt_scene scene;
    snprintf(path, sizeof path, "%s/%s.yaml", KT_SCENES, s->scene);
    kt_status status = kt_scene_read(path, &scene, NULL, NULL, error);
    if (status == KT_OK) {
        scene.description.effect_count = scene.description.state_count = 0; /* the file has none */
        status = kt_model_compile(&scene.description, NULL, &s->model, error);
        kt_scene_free(&scene);
    }
    return status;
}

static kt_status compile_chain(subject *s, kt_error *error) {
    kt_chain_description chain;
    kt_status status = kt_chain_describe(s->links, 1, &chain, error);
    if (status == KT_OK) {
        status = kt_model_compile(&chain.description, NULL, &s->model, error);
        kt_chain_describe_free(&chain);
    }
    return status;
}

/* Gives all lanes their states, here and in the batch: forces differ. */
static kt_status spread_states(subject *s, kt_error *error) {
    const kt_batch_options options = {.states = STATES};
    kt_status status = kt_batch_create(s->model, &options, &s->batch, error);
    for (size_t l = 0; l < STATES && status == KT_OK; l++) {
        double x[NV_MOST];
        for (int i = 0; i < kt_model_nq(s->model); i++)
            s->lanes[0][i * STATES + (int)l] = s->q[i];
        for (int i = 0; i < kt_model_nv(s->model); i++) {
            s->lanes[1][i * STATES + (int)l] = s->v[i];
            s->lanes[2][i * STATES + (int)l] = x[i] = s->x[i] + 0.1 * (double)l;
        }
        status = kt_batch_set_state(s->batch, l, 0.0, s->q, s->v, error);
        if (status == KT_OK)
            status = kt_batch_set_torque(s->batch, l, x, error);
    }
    return status;
}

static bool load_subject(subject *s) {
    kt_error error = {0};
    kt_status status = s->links > 0 ? compile_chain(s, &error) : compile_scene(s, &error);
    if (status == KT_OK)
        status = kt_data_create(s->model, &s->data, &error);
    if (status != KT_OK || kt_model_nv(s->model) > NV_MOST)
        return kt_bench_tell(&error) == KT_BENCH_DONE;
    const bool steps = s->bar[STEP] > 0.0;
    s->work_size = steps ? kt_step_work_size(s->model, kt_method_find("rk4")) : kt_dynamics_work_size(s->model);
    s->work = aligned_alloc(KT_ALIGNMENT, (s->work_size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    if (s->work == NULL)
        return false;
    kt_model_initial(s->model, s->q, s->v);
    for (int i = 0; i < kt_model_nv(s->model); i++) {
        s->v[i] = sin(1.0 + i);
        s->x[i] = cos(2.0 + 3.0 * i);
    }
    if (kt_loop_count(s->model) == 0) {
        kt_position_add(s->model, s->q, s->x, s->q);
    } else if (kt_state_project(s->model, s->data, 0.0, s->q, s->v, NULL, &error) != KT_OK) {
        (void)kt_bench_tell(&error);
        return false;
    }
    if (s->bar[LANES] > 0.0 && spread_states(s, &error) != KT_OK) {
        (void)kt_bench_tell(&error);
        return false;
    }
    return load_generated(s);
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

static void print_head(void) {
    printf("%-10s %-11s %12s %12s %7s %7s %7s %6s\n", "scene", "function", "library, ns", "generated, ns", "low",
           "ratio", "high", "bar");
}

static int measure_line(size_t line, const kt_bench_options *options, kt_csv *csv) {
    static const char *const name[FUNCTIONS] = {"forward", "inverse", "mass", "derivatives", "rk4", "8 lanes"};
    subject *s = &subjects[line / FUNCTIONS];
    kt_bench_times times[2];
    if (s->bar[line % FUNCTIONS] <= 0.0)
        return KT_BENCH_DONE;
    if (s->model == NULL && !load_subject(s))
        return KT_BENCH_FAILED;
    s->function = (int)(line % FUNCTIONS);
    const kt_bench_task tasks[2] = {{run_library, s}, {run_generated, s}};
    kt_bench_measure(tasks, 2, options->seconds, times);
    const int nv = kt_model_nv(s->model), count = s->function == DERIVATIVES ? 3 * nv * nv
                                                  : s->function == MASS      ? nv * nv
                                                  : s->function == STEP      ? kt_model_nq(s->model) + nv
                                                                             : nv;
    for (int l = 0; s->function == LANES && l < STATES; l++) {
        if (kt_batch_get_acceleration(s->batch, (size_t)l, s->out[0] + l * nv, NULL) != KT_OK)
            return KT_BENCH_FAILED;
        for (int i = 0; i < nv; i++)
            s->out[1][l * nv + i] = s->lanes[3][i * STATES + l];
    }
    double most = 0.0, off = 0.0;
    for (int i = 0; i < (s->function == LANES ? STATES * nv : count); i++) {
        most = fmax(most, fabs(s->out[0][i]));
        off = fmax(off, fabs(s->out[0][i] - s->out[1][i]));
    }
    if (s->status != KT_OK || !(off <= 1e-9 * most)) {
        fprintf(stderr, "%s %s: results differ by %g of %g\n", s->scene, name[s->function], off, most);
        return KT_BENCH_FAILED;
    }
    const kt_bench_ratio ratio = kt_bench_compare(&times[0], &times[1]);
    const double bar = s->bar[s->function];
    printf("%-10s %-11s %12.1f %12.1f %7.2f %7.2f %7.2f %6.2f%s\n", s->scene, name[s->function], 1e9 * times[0].low,
           1e9 * times[1].low, ratio.low, ratio.median, ratio.high, bar, ratio.median < bar ? "  below" : "");
    kt_csv_text(csv, s->scene);
    kt_csv_text(csv, name[s->function]);
    kt_csv_number(csv, ratio.median);
    kt_csv_number(csv, bar);
    kt_csv_origin(csv, options->isa);
    kt_csv_times(csv, &times[1]);
    kt_csv_line(csv);
    return ratio.median < bar ? KT_BENCH_MISSED : KT_BENCH_DONE;
}

int main(int argc, char **argv) {
    const kt_bench_table table = {
        .about = "Generated C against the library, in turns. Needs a C compiler with the name cc.\n",
        .columns = "scene,function,ratio,bar," KT_CSV_ORIGIN "," KT_CSV_TIMES,
        .title = "generated C (" COMPILE ")",
        .print_head = print_head,
        .subjects = SUBJECTS * FUNCTIONS,
        .measure = measure_line,
    };
    const int code = kt_bench_run(&table, argc, argv);
    for (int i = 0; i < SUBJECTS; i++) {
        if (subjects[i].library != NULL)
            dlclose(subjects[i].library);
        free(subjects[i].work);
        kt_data_free(subjects[i].data);
        kt_model_free(subjects[i].model);
    }
    return code;
}
