/* The worst-case cost of a step inside a control loop, rather than the average.
 *
 * Mechanisms of five kinds are stepped by rk4 in steps of 1 ms, with torques set before every step. First they run
 * freely. Then clock_nanosleep on absolute times paces them at 1 kHz, so caches are cold and the system interferes.
 * Each step is timed by itself, by the monotonic clock. A step is kt_simulation_set_torque and kt_simulation_advance.
 * With --sensors it includes kt_simulation_sense, for accelerations of points and wrenches in all joints and loops.
 * After the first step, allocations and page faults are counted. The thread's stack has been painted, to measure its
 * depth of use.
 *
 * The torques are a spring and a damper in every joint and a wave on top, in proportion to its inertia. They keep the
 * mechanism moving near its start for any length of the run.
 *
 * A line is trusted under four conditions. Every step succeeded. The number of steps is as reported, or larger if hard
 * stops end steps. No iteration ended at its cap. The mechanism is where springs keep it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "leg.h"
#include "options.h"
#include "report.h"

#include "kinetree/scene.h"

#include "interpose.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

enum { STACK = 1 << 20, PAINT = 0xA5, MARGIN = 512 };

static const double step = 1e-3;            /* s */
static const double pace = 8.0, wave = 5.0; /* times the inertia: 1/s of the springs, 1/s^2 of the torques */
static const double furthest = 100.0;       /* rad or m from the start, where springs would be broken */

/* name; file in apps/scenes, or the scene itself */
static const struct scene {
    const char *name, *file, *text;
} scenes[] = {
    {"cart-pole", "cart-pole.yaml", NULL},       {"arm7", "arm7.yaml", NULL},
    {"humanoid", "humanoid.yaml", NULL},         {"leg with four-bar", NULL, kt_leg},
    {"leg with hard stops", NULL, kt_leg_stops},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

/* A mechanism and the loop that drives it. */
typedef struct plant {
    kt_model *model;
    void *memory; /* of the simulation */
    size_t size;
    kt_simulation *simulation;
    kt_record seen;
    int nq, nv;
    double *q0, *v0, *weight, *inertia, *away,
        *torque; /* nq; then nv each: start; rest; load at rest; inertia of joints; displacement; torque set */

    bool is_paced, has_sensors;
    long steps;
    double *seconds; /* steps: of each */
    void *stack;     /* STACK bytes */

    long allocations, faults, late; /* late: steps that ended after the next was due */
    size_t depth;                   /* bytes of stack below the loop */
    double furthest;
    kt_status status;
    kt_error error;
} plant;

/* ---- the loop ---------------------------------------------------------------------------------------------------- */

static double now(void) {
    struct timespec at;
    clock_gettime(CLOCK_MONOTONIC, &at);
    return (double)at.tv_sec + 1e-9 * (double)at.tv_nsec;
}

static long page_faults(void) {
    struct rusage usage;
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_minflt + usage.ru_majflt;
}

/* Computes torques from the quantities that a controller would measure. */
static void think(plant *p, long k) {
    const double *q = kt_simulation_positions(p->simulation), *v = kt_simulation_velocities(p->simulation);
    kt_position_subtract(p->model, p->q0, q, p->away);
    for (int i = 0; i < p->nv; i++) {
        const double phase = 0.01 * (double)k + i;
        p->torque[i] =
            p->weight[i] + p->inertia[i] * (pace * pace * p->away[i] - 0.6 * pace * v[i] + wave * sin(phase));
        p->furthest = fmax(p->furthest, fabs(p->away[i]));
    }
}

static void take_step(plant *p, long k) {
    if (p->status == KT_OK)
        p->status = kt_simulation_set_torque(p->simulation, p->torque, &p->error);
    if (p->status == KT_OK && p->has_sensors)
        p->status = kt_simulation_sense(p->simulation, &p->seen, &p->error);
    if (p->status == KT_OK)
        p->status = kt_simulation_advance(p->simulation, (double)(k + 1) * step, &p->error);
}

/* Fills the stack below this frame, except for the few bytes that the function itself needs. */
__attribute__((noinline, no_sanitize("address"))) static void paint(void *stack) {
    volatile unsigned char *end = (unsigned char *)__builtin_frame_address(0) - MARGIN;
    for (volatile unsigned char *at = stack; at < end; at++)
        *at = PAINT;
}

/* How far below `top` the paint is gone; MARGIN or so at least. */
__attribute__((noinline, no_sanitize("address"))) static size_t depth_below(const void *top, const void *stack) {
    const volatile unsigned char *at = stack;
    while ((const void *)at < top && *at == PAINT)
        at++;
    return (size_t)((const unsigned char *)top - (const unsigned char *)at);
}

static void run_steps(plant *p) {
    double due = now() + step;
    for (long k = 1; k < p->steps; k++) {
        think(p, k);
        if (p->is_paced) {
            const struct timespec at = {(time_t)due, (long)(1e9 * (due - floor(due)))};
            while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL) == EINTR)
                ;
        }
        const double start = now();
        take_step(p, k);
        const double end = now();
        p->seconds[k] = end - start;
        due += step;
        p->late += p->is_paced && end > due;
    }
}

static void *control(void *user) {
    plant *p = user;
    think(p, 0);
    const double start = now();
    take_step(p, 0); /* resolves symbols, touches pages: extra cost of the first step */
    p->seconds[0] = now() - start;
    paint(p->stack);
    const long faults = page_faults();
    kt_interpose_start();
    run_steps(p);
    p->allocations = kt_interpose_stop();
    p->faults = page_faults() - faults;
    p->depth = depth_below(__builtin_frame_address(0), p->stack);
    return NULL;
}

static bool run_thread(plant *p) {
    pthread_attr_t attributes;
    pthread_t thread;
    if (pthread_attr_init(&attributes) != 0)
        return false;
    const bool started = pthread_attr_setstack(&attributes, p->stack, STACK) == 0 &&
                         pthread_create(&thread, &attributes, control, p) == 0;
    (void)pthread_attr_destroy(&attributes);
    return started && pthread_join(thread, NULL) == 0;
}

/* ---- set-up ------------------------------------------------------------------------------------------------------ */

static void report_fault(void *user, const kt_error *fault) {
    (void)user;
    (void)fprintf(stderr, "%s: %s\n", fault->where, fault->message);
}

static kt_status make_model(const struct scene *which, kt_model **model, kt_error *error) {
    char path[1024];
    kt_scene scene;
    (void)snprintf(path, sizeof path, "%s/%s", KT_SCENES, which->file ? which->file : "");
    kt_status status =
        which->file ? kt_scene_read(path, &scene, report_fault, NULL, error)
                    : kt_scene_parse(which->name, which->text, strlen(which->text), &scene, report_fault, NULL, error);
    if (status != KT_OK)
        return status;
    status = kt_model_compile(&scene.description, NULL, model, error);
    kt_scene_free(&scene);
    return status;
}

/* Finds the torques that keep the start at rest. Also finds the inertia that a joint has to move there while all others
 * may give way. This is one over the acceleration by a unit torque. With dampers `rate` times that in n joints, none
 * decays faster than n rate. */
static kt_status find_inertia(plant *p, kt_error *error) {
    const size_t nv = (size_t)p->nv;
    kt_data *data = NULL;
    kt_status status = kt_data_create(p->model, &data, error);
    memset(p->torque, 0, nv * sizeof(double));
    memset(p->v0, 0, nv * sizeof(double));
    if (status == KT_OK)
        status = kt_dynamics_inverse(p->model, data, p->q0, NULL, NULL, NULL, p->weight, error);
    for (size_t i = 0; i < nv; i++)
        p->v0[i] = 1e-6; /* rad/s: friction that sticks has a direction in motion alone */
    for (size_t i = 0; i < nv && status == KT_OK; i++) {
        double at[2];
        for (int unit = 0; unit < 2 && status == KT_OK; unit++) {
            p->torque[i] = unit;
            status = kt_acceleration_evaluate(p->model, data, 0.0, p->q0, p->v0, p->torque, NULL, p->away, error);
            at[unit] = p->away[i];
        }
        p->torque[i] = 0.0;
        if (status == KT_OK)
            p->inertia[i] = 1.0 / (at[1] - at[0]);
    }
    memset(p->v0, 0, nv * sizeof(double));
    kt_data_free(data);
    return status;
}

static void clear(plant *p) {
    kt_model_free(p->model);
    free(p->memory);
    free(p->q0);
    free(p->v0);
    free(p->weight);
    free(p->inertia);
    free(p->away);
    free(p->torque);
    free(p->seconds);
    free(p->stack);
    *p = (plant){0};
}

/* All memory is taken, and touched, here. */
static kt_status prepare(plant *p, const struct scene *which, const kt_realtime_options *settings, bool is_paced,
                         kt_error *error) {
    const long steps = is_paced ? settings->paced : settings->steps;
    kt_simulation_options options = kt_simulation_options_default();
    kt_run fixed = kt_run_default();
    fixed.integrator = "rk4";
    fixed.step = step;
    if (settings->sensors)
        fixed.record = KT_RECORD_ACCELERATION | KT_RECORD_REACTION;
    options.kinematics = settings->sensors;
    *p = (plant){.steps = steps, .is_paced = is_paced, .has_sensors = settings->sensors};
    kt_status status = make_model(which, &p->model, error);
    if (status != KT_OK)
        return status;
    p->nq = kt_model_nq(p->model);
    p->nv = kt_model_nv(p->model);
    p->size = kt_simulation_size(p->model, &fixed, &options);
    const size_t nq = (size_t)p->nq, nv = (size_t)p->nv;
    p->memory = aligned_alloc(KT_ALIGNMENT, p->size);
    p->stack = aligned_alloc(4096, STACK);
    p->q0 = malloc(nq * sizeof(double));
    p->v0 = malloc(nv * sizeof(double));
    p->weight = malloc(nv * sizeof(double));
    p->inertia = malloc(nv * sizeof(double));
    p->away = malloc(nv * sizeof(double));
    p->torque = malloc(nv * sizeof(double));
    p->seconds = malloc((size_t)steps * sizeof(double));
    if (!p->memory || !p->stack || !p->q0 || !p->v0 || !p->weight || !p->inertia || !p->away || !p->torque ||
        !p->seconds)
        return kt_error_set(error, KT_ERROR_MEMORY, which->name, "no memory for %ld steps", steps);
    memset(p->stack, 0, STACK);
    memset(p->seconds, 0xFF, (size_t)steps * sizeof(double)); /* NaN: not measured */
    status = kt_simulation_init(p->model, &fixed, &options, p->memory, p->size, &p->simulation, error);
    if (status != KT_OK)
        return status;
    memcpy(p->q0, kt_simulation_positions(p->simulation), nq * sizeof(double)); /* with its loops closed */
    return find_inertia(p, error);
}

/* ---- figures ----------------------------------------------------------------------------------------------------- */

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The least sample that at least this part of them do not exceed; samples are sorted. */
static double quantile(const double *sorted, long count, double part) {
    const long at = (long)ceil(part * (double)count) - 1;
    return sorted[at > 0 ? at : 0];
}

static const char columns[] =
    "scene,bodies,freedoms,loops,mode,sensors,steps,first_s,median_s,p99_9_s,max_s,late,allocations,"
    "page_faults,stack_bytes,model_bytes,simulation_bytes,furthest," KT_CSV_ORIGIN;

static void print_head(bool markdown) {
    if (markdown)
        printf("| | bodies | freedoms | mode | steps | median, us | 99.9 %%, us | max, us | late | allocations | page "
               "faults "
               "| stack, bytes |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    else
        printf("%-18s%7s%5s  %-6s%9s |%8s%8s%9s%6s |%6s%7s%8s%8s%9s\n", "", "bodies", "dof", "mode", "steps", "median",
               "99.9 %", "max", "late", "alloc", "faults", "stack", "model", "simul.");
}

/* Prints and writes a line; false where it is not to be trusted. */
static bool tell(plant *p, const struct scene *which, bool markdown, kt_csv *csv) {
    const long count = p->steps - 1; /* the first step is reported separately */
    double *rest = p->seconds + 1;
    qsort(rest, (size_t)count, sizeof *rest, compare);
    const double median = quantile(rest, count, 0.5), high = quantile(rest, count, 0.999), most = rest[count - 1];
    const int bodies = kt_model_body_count(p->model) - 1, dofs = kt_model_mobility(p->model).minimal;
    const char *mode = p->is_paced ? "paced" : "free";
    const kt_simulation_counts counts = kt_simulation_counts_of(p->simulation);
    const kt_contact_counts contacts = kt_simulation_contacts(p->simulation);
    /* Events end steps: there are more of these. */
    const bool are_all = contacts.count > 0 ? counts.steps >= (uint64_t)p->steps : counts.steps == (uint64_t)p->steps;
    const bool is_trusted = p->status == KT_OK && p->furthest < furthest && are_all && counts.iterations.capped == 0;
    const char *doubt = is_trusted ? "" : "  NOT TRUSTED";
    if (markdown)
        printf("| %s%s | %d | %d | %s | %ld | %.2f | %.2f | %.2f | %ld | %ld | %ld | %zu |\n", which->name, doubt,
               bodies, dofs, mode, p->steps, 1e6 * median, 1e6 * high, 1e6 * most, p->late, p->allocations, p->faults,
               p->depth);
    else
        printf("%-18s%7d%5d  %-6s%9ld |%8.2f%8.2f%9.2f%6ld |%6ld%7ld%8zu%8zu%9zu%s\n", which->name, bodies, dofs, mode,
               p->steps, 1e6 * median, 1e6 * high, 1e6 * most, p->late, p->allocations, p->faults, p->depth,
               kt_model_size(p->model), p->size, doubt);
    (void)fflush(stdout);
    kt_csv_text(csv, which->name);
    kt_csv_number(csv, bodies);
    kt_csv_number(csv, dofs);
    kt_csv_number(csv, kt_loop_count(p->model));
    kt_csv_text(csv, mode);
    const double numbers[] = {(double)p->has_sensors,
                              (double)p->steps,
                              p->seconds[0],
                              median,
                              high,
                              most,
                              (double)p->late,
                              (double)p->allocations,
                              (double)p->faults,
                              (double)p->depth,
                              (double)kt_model_size(p->model),
                              (double)p->size,
                              p->furthest};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        kt_csv_number(csv, numbers[i]);
    kt_csv_origin(csv, kt_model_isa(p->model));
    kt_csv_line(csv);
    return is_trusted;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

static int run(const kt_realtime_options *settings, kt_csv *csv) {
    kt_error error;
    bool trusted = true;
    for (int mode = 0; mode < 2; mode++)
        for (int i = 0; i < SCENES; i++) {
            plant p;
            if ((mode == 0 ? settings->steps : settings->paced) == 0)
                continue;
            const kt_status status = prepare(&p, &scenes[i], settings, mode == 1, &error);
            if (status != KT_OK || !run_thread(&p)) {
                clear(&p);
                return status != KT_OK ? kt_bench_tell(&error) : KT_BENCH_FAILED;
            }
            if (mode == 0 && i == 0)
                print_head(settings->markdown);
            trusted &= tell(&p, &scenes[i], settings->markdown, csv);
            if (p.status != KT_OK)
                (void)kt_bench_tell(&p.error);
            clear(&p);
        }
    return trusted ? KT_BENCH_DONE : KT_BENCH_FAILED;
}

int main(int argc, char **argv) {
    kt_realtime_options settings = {.steps = 1000000, .paced = 10000};
    const int status = kt_realtime_read(argc, argv, &settings);
    kt_csv csv;
    if (status >= 0)
        return status;
    if (!kt_csv_open(&csv, settings.csv, columns))
        return KT_BENCH_FAILED;
    const bool is_locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    if (!settings.markdown) {
        kt_bench_heading("Times of single steps, us: rk4, 1 ms, torques set before each", KT_ISA_AUTO, settings.csv);
        printf(
            "Allocations, page faults and stack (bytes below the loop) are those after the first step; memory is %s;\n"
            "late: steps that ended after the next was due. Sensors are %s.\n\n",
            is_locked ? "locked" : "not locked (not allowed)", settings.sensors ? "read in each step" : "not read");
    }
    const int result = run(&settings, &csv);
    return kt_csv_close(&csv) ? result : KT_BENCH_FAILED;
}
