/* Motions with hard contacts in this engine, in MuJoCo and in ODE: the error and the depth, next to the time.
 *
 * Block: it falls flat from a height h and slides at v0. Its impact stops the fall, and takes mu v from the speed, with
 *     v = sqrt(2 g h)
 * From then on friction slows it by mu g until it rests. The error is the distance of its centre from this closed form.
 *
 * Quadruped: it drops from 1 cm while its joints hold their start, and stands. The reference for its trunk is a run of
 * this engine with events and a tolerance of 1e-12. Time stepping and the other engines, with shorter and shorter
 * steps, converge to the same motion.
 *
 * Heap: 20 spheres fall into a bin. Their motion is chaotic, so that no reference exists. The heap must come to rest:
 * the error is the largest speed of a centre at the end.
 *
 * The depth is the largest penetration at the records. All engines have the same spheres and planes, without
 * restitution. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "engines.h"
#include "report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void make_dropped_quadruped(kt_contact_mechanism *m) {
    kt_mechanism_quadruped(m);
    m->body[0].joint.position[2] = 0.25 * (cos(0.6) + cos(0.6)) + 0.02 + 0.01; /* the feet's radius, and 1 cm */
}

enum { BLOCK, QUADRUPED, HEAP };
static const kt_contact_motion motions[] = {
    [BLOCK] = {"block that falls and slides", "place, m", kt_mechanism_block, 1.0, 0.01, 0.0, 0.0, {2e-3, 5e-4, 1e-4}},
    [QUADRUPED] = {"quadruped that drops and stands",
                   "place, m",
                   make_dropped_quadruped,
                   1.0,
                   1e-3,
                   120.0,
                   3.0,
                   {1e-3, 2.5e-4, 5e-5}},
    [HEAP] =
        {"20 spheres in a bin", "speed at the end, m/s", kt_mechanism_heap, 1.5, 0.02, 0.0, 0.0, {4e-3, 2e-3, 1e-3}},
};

/* Bounds of this engine's errors: with events, and with steps in proportion to them; and of its depths. Measured: 2e-14
 * m, 0.1 m/s and 3e-10 m. The heap has no bound of its speed. */
static const double events_most = 1e-12, steps_most = 1.0, depth_most = 1e-9;
/* That of kt_run_default. A torque that is constant for an interval makes motions so smooth that a larger one has the
 * same error. */
static const double events_tolerance = 1e-9;

static const kt_contact_engine *const engines[] = {
    &kt_contact_events, &kt_contact_steps,
#ifdef KT_WITH_MUJOCO
    &kt_contact_mujoco, &kt_contact_mujoco_stiff,
#endif
#ifdef KT_WITH_ODE
    &kt_contact_ode,    &kt_contact_ode_quick,
#endif
};

static const char about[] = "Runs motions with hard contacts here, in MuJoCo and in ODE: errors, depths and times.\n";
static const char columns[] = "scene,engine,kind,setting,measured,error,bound,depth_m,seconds,duration_s,words";

/* ---- a scene ----------------------------------------------------------------------------------------------------- */

enum { RECORDS = 1024 };

/* A motion with its model, the twin of its start, and the reference. */
typedef struct scene {
    const kt_contact_motion *motion;
    int index, records;
    kt_contact_mechanism mechanism;
    kt_description description;
    kt_model *model;
    int parent[KT_MECHANISM_BODIES];
    kt_pose start[KT_MECHANISM_BODIES], pose[KT_MECHANISM_BODIES];
    kt_twist rate[KT_MECHANISM_BODIES], twist[KT_MECHANISM_BODIES];
    kt_twin_sphere sphere[KT_MECHANISM_ITEMS];
    kt_twin_plane plane[KT_MECHANISM_PLANES];
    kt_twin_ground ground;
    kt_vec3 reference[RECORDS]; /* of the first body, after each interval */
} scene;

/* The observations of a run. */
typedef struct sight {
    double error, depth, seconds;
    char words[KT_CONTACT_WORDS];
} sight;

bool kt_contact_fail(kt_contact_run *run, const char *words) {
    (void)snprintf(run->words, sizeof run->words, "%.59s", words);
    return false;
}

long kt_contact_steps_of(const kt_contact_run *run) { return lround(run->motion->interval / run->setting); }

static void set_ground(scene *s) {
    const kt_contact_mechanism *m = &s->mechanism;
    for (int k = 0; k < m->items; k++)
        s->sphere[k] = (kt_twin_sphere){(int)strtol(m->item[k].body + 1, NULL, 10), m->item[k].at, m->item[k].radius};
    for (int k = 0; k < m->planes; k++)
        s->plane[k] = (kt_twin_plane){m->plane[k].at, m->plane[k].normal};
    s->ground = (kt_twin_ground){s->sphere, s->plane, m->items, m->planes, m->touches, m->item[0].friction};
}

static kt_status open_scene(scene *s, int index, kt_isa isa, kt_error *error) {
    double q[KT_CONTACT_COORDINATES], v[KT_CONTACT_COORDINATES];
    kt_data *data = NULL;
    memset(s, 0, sizeof *s);
    s->motion = &motions[index];
    s->index = index;
    s->records = (int)lround(s->motion->duration / s->motion->interval);
    s->motion->make(&s->mechanism);
    kt_status status = kt_mechanism_compile(&s->mechanism, true, isa, &s->model, error);
    if (status == KT_OK)
        status = kt_data_create(s->model, &data, error);
    if (status != KT_OK)
        return status;
    s->description = kt_mechanism_describe(&s->mechanism, true);
    kt_model_initial(s->model, q, v);
    status = kt_kinematics_update(s->model, data, q, v, NULL, error);
    for (int b = 1; b < kt_model_body_count(s->model); b++) {
        const int up = kt_body_parent(s->model, b);
        s->parent[kt_body_source(s->model, b)] = up > 0 ? kt_body_source(s->model, up) : -1;
    }
    const kt_twin start = {NULL, NULL, s->start, s->rate, NULL};
    kt_twin_read(s->model, data, &start);
    kt_data_free(data);
    set_ground(s);
    return status;
}

/* ---- what is measured -------------------------------------------------------------------------------------------- */

static kt_vec3 place_of(const scene *s, int sphere) {
    return kt_pose_apply(s->pose[s->sphere[sphere].body], s->sphere[sphere].at);
}

static double depth_of(const scene *s) {
    double most = 0.0;
    for (int i = 0; i < s->ground.sphere_count; i++) {
        const kt_vec3 at = place_of(s, i);
        for (int k = 0; k < s->ground.plane_count; k++)
            most = fmax(most, s->sphere[i].radius - kt_vec3_dot(s->plane[k].normal, kt_vec3_sub(at, s->plane[k].at)));
        for (int k = 0; k < i && s->ground.touch; k++)
            most =
                fmax(most, s->sphere[i].radius + s->sphere[k].radius - kt_vec3_norm(kt_vec3_sub(at, place_of(s, k))));
    }
    return most;
}

/* The centre of the block. */
static kt_vec3 sliding(double friction, double t) {
    const double g = 9.81, first = sqrt(2.0 * KT_BLOCK_DROP / g), slows = friction * g;
    const double speed = KT_BLOCK_SPEED - slows * first, slides = fmin(fmax(t - first, 0.0), speed / slows);
    return kt_vec3_make(KT_BLOCK_SPEED * fmin(t, first) + slides * (speed - 0.5 * slows * slides), 0.0,
                        KT_BLOCK_LOW + fmax(KT_BLOCK_DROP - 0.5 * g * t * t, 0.0));
}

static double error_of(const scene *s, int record) {
    double most = 0.0;
    if (s->index == HEAP) {
        for (int i = 0; record == s->records - 1 && i < s->description.body_count; i++)
            most = fmax(most, kt_vec3_norm(s->twist[i].linear));
        return most;
    }
    return kt_vec3_norm(kt_vec3_sub(s->pose[0].position, s->reference[record]));
}

/* Runs the motion; true if it came to its end. With `refers`, its poses become the reference. */
static bool run_engine(scene *s, const kt_contact_engine *engine, double setting, bool refers, sight *seen) {
    kt_contact_run run = {.motion = s->motion, .model = s->model, .setting = setting};
    *seen = (sight){.error = 0.0};
    memcpy(s->pose, s->start, sizeof s->pose);
    memcpy(s->twist, s->rate, sizeof s->twist);
    run.twin = (kt_twin){&s->description, s->parent, s->pose, s->twist, &s->ground};
    bool good = engine->open(&run);
    for (int record = 0; good && record < s->records; record++) {
        const double begin = kt_bench_clock();
        good = engine->move(&run);
        seen->seconds += kt_bench_clock() - begin;
        good = good && engine->look(&run);
        if (good && refers)
            s->reference[record] = s->pose[0].position;
        const double error = good ? error_of(s, record) : (double)NAN;
        seen->error = isnan(error) || error > seen->error ? error : seen->error;
        seen->depth = good ? fmax(seen->depth, depth_of(s)) : (double)NAN;
    }
    engine->close(&run);
    memcpy(seen->words, run.words, sizeof seen->words);
    return good;
}

static bool find_reference(scene *s, sight *seen) {
    if (s->index == QUADRUPED)
        return run_engine(s, &kt_contact_events, 1e-12, true, seen);
    for (int k = 0; k < s->records; k++)
        s->reference[k] = sliding(s->ground.friction, (k + 1) * s->motion->interval);
    return true;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

static bool is_own(const kt_contact_engine *engine) {
    return engine == &kt_contact_events || engine == &kt_contact_steps;
}

/* The bound of an error, or infinity. */
static double bound_of(const scene *s, const kt_contact_engine *engine, double setting) {
    if (!is_own(engine) || s->index == HEAP)
        return (double)INFINITY;
    return engine->has_tolerance ? events_most : steps_most * setting;
}

/* Returns whether this engine keeps its bounds. */
static bool report_run(const scene *s, const kt_contact_engine *engine, double setting, const sight *seen,
                       kt_csv *csv) {
    const double bound = bound_of(s, engine, setting);
    const bool kept = !is_own(engine) || (seen->error <= bound && seen->depth <= depth_most);
    char words[40];
    const char *kind = engine->has_tolerance ? "tolerance" : "step";
    (void)snprintf(words, sizeof words, "%s %g", kind, setting);
    printf("%17s  %-17s |%10.1e%10.1e%12.3f  %s\n", engine->name, words, seen->error, seen->depth,
           1e3 * seen->seconds / s->motion->duration, kept ? seen->words : "NOT TO BE TRUSTED");
    (void)fflush(stdout);
    kt_csv_text(csv, s->motion->name);
    kt_csv_text(csv, engine->name);
    kt_csv_text(csv, kind);
    kt_csv_number(csv, setting);
    kt_csv_text(csv, s->motion->measured);
    kt_csv_number(csv, seen->error);
    kt_csv_number(csv, isfinite(bound) ? bound : (double)NAN);
    kt_csv_number(csv, seen->depth);
    kt_csv_number(csv, seen->seconds);
    kt_csv_number(csv, s->motion->duration);
    kt_csv_text(csv, seen->words);
    kt_csv_line(csv);
    return kept;
}

/* Short runs have the first setting alone. The time is the lesser one of two runs. Returns whether all bounds hold. */
static bool measure_engine(scene *s, const kt_contact_engine *engine, bool brief, kt_csv *csv) {
    bool kept = true;
    if (engine == &kt_contact_events && s->mechanism.touches) /* friction between spheres needs time stepping */
        return true;
    for (int k = 0; k < (brief || engine->has_tolerance ? 1 : KT_CONTACT_SETTINGS); k++) {
        const double setting = engine->has_tolerance ? events_tolerance : s->motion->step[k];
        sight seen, again;
        if (run_engine(s, engine, setting, false, &seen) && !brief && run_engine(s, engine, setting, false, &again))
            seen.seconds = fmin(seen.seconds, again.seconds);
        kept = report_run(s, engine, setting, &seen, csv) && kept;
    }
    return kept;
}

static int measure_scene(size_t index, const kt_bench_options *options, kt_csv *csv) {
    static scene s;
    kt_error error;
    sight seen;
    const bool brief = options->seconds < 0.1;
    int result = KT_BENCH_DONE;
    printf("%s: %s\n", motions[index].name, motions[index].measured);
    if (open_scene(&s, (int)index, options->isa, &error) != KT_OK) {
        result = kt_bench_tell(&error);
    } else if (!find_reference(&s, &seen)) {
        (void)fprintf(stderr, "%s has no reference: %s\n", motions[index].name, seen.words);
        result = KT_BENCH_FAILED;
    } else {
        for (size_t k = 0; k < sizeof engines / sizeof *engines; k++)
            result = measure_engine(&s, engines[k], brief, csv) ? result : KT_BENCH_FAILED;
    }
    kt_model_free(s.model);
    return result;
}

static void print_scene_head(void) {
    printf("%17s  %-17s |%10s%10s%12s\n", "", "", "error", "depth, m", "ms a second");
}

int main(int argc, char **argv) {
    static const kt_bench_table table = {
        about,        columns, "Hard contacts in other engines", print_scene_head, sizeof motions / sizeof *motions,
        measure_scene};
    return kt_bench_run(&table, argc, argv);
}
