/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include "files/scene/collect.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- the scene --------------------------------------------------------------------------------------------------- */

kt_case kt_case_open(const char *name) {
    kt_scene *scene = kt_test_bundled(name);
    return (kt_case){name, *scene, kt_test_model(&scene->description, NULL)};
}

static kt_coordinates find(const kt_case *c, const char *joint) {
    int body = kt_body_find(c->model, joint);
    if (body < 0) {
        kt_note("there is no joint '%s'", joint);
        (void)kt_check_true("joint", false);
        return (kt_coordinates){0};
    }
    return kt_body_coordinates(c->model, body);
}

int kt_case_q(const kt_case *c, const char *joint) { return find(c, joint).q; }
int kt_case_v(const kt_case *c, const char *joint) { return find(c, joint).v; }

/* ---- running ----------------------------------------------------------------------------------------------------- */

static kt_run run_of(const kt_case *c, const kt_setting *setting, double interval) {
    kt_run run = c->scene.run;
    if (setting->integrator != NULL) {
        run.integrator = setting->integrator;
        run.step = setting->step;
        run.relative = run.absolute = setting->tolerance;
    }
    if (interval > 0.0)
        run.interval = interval;
    return run;
}

const char *kt_setting_text(const kt_case *c, const kt_setting *setting) {
    static char texts[4][80];
    static unsigned next;
    char *text = texts[next++ % 4];
    const kt_run run = run_of(c, setting, 0.0);
    if (run.step > 0.0)
        snprintf(text, sizeof texts[0], "%s: %s h=%g", c->name, run.integrator, run.step);
    else
        snprintf(text, sizeof texts[0], "%s: %s %g%s", c->name, run.integrator != NULL ? run.integrator : "its default",
                 run.relative, setting->integrator == NULL ? " (its own)" : "");
    return text;
}

bool kt_case_run(const kt_case *c, const kt_setting *setting, double interval, kt_recorder *record, void *user) {
    kt_run run = run_of(c, setting, interval);
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_error error = {KT_OK, "", ""};
    options.record = KT_RECORD_ENERGY | KT_RECORD_CONSTRAINT;
    options.kinematics = true;
    bool fine = kt_fine("simulation", kt_simulation_create(c->model, &run, &options, &simulation, &error), &error) &&
                kt_fine("run", kt_simulation_run(simulation, record, user, &error), &error);
    kt_simulation_free(simulation);
    return fine;
}

/* ---- what is known of the motion --------------------------------------------------------------------------------- */

typedef struct follower {
    const kt_case *c;
    kt_error_of *error_of;
    const void *about;
    double bound, last;
    kt_worst error;
} follower;

static int follow(const kt_record *record, void *user) {
    follower *f = user;
    f->last = f->error_of(f->c, record, f->about);
    kt_worst_below(&f->error, f->last, f->bound, "t = %g", record->t);
    return 0;
}

void kt_scene_follow(const char *scene, const kt_setting *settings, size_t count, kt_error_of *error_of,
                     const void *about) {
    const kt_case c = kt_case_open(scene);
    kt_case_follow(&c, settings, count, error_of, about);
}

void kt_case_follow(const kt_case *c, const kt_setting *settings, size_t count, kt_error_of *error_of,
                    const void *about) {
    for (size_t i = 0; i < count; i++) {
        follower f = {c, error_of, about, settings[i].bound, 0.0, kt_worst_make(kt_setting_text(c, &settings[i]))};
        (void)kt_case_run(c, &settings[i], 0.0, follow, &f);
        kt_check_worst(&f.error);
    }
}

void kt_case_order(const kt_case *c, const char *integrator, double step, double order, kt_error_of *error_of,
                   const void *about) {
    double last[2];
    for (int i = 0; i < 2; i++) {
        kt_setting setting = {integrator, i == 0 ? step : 0.5 * step, 0.0, 1.0};
        follower f = {c, error_of, about, 1.0, 0.0, kt_worst_make("")};
        (void)kt_case_run(c, &setting, c->scene.run.duration, follow, &f);
        last[i] = f.last;
    }
    kt_note("%s: h = %g: error %.3g; h / 2: %.3g", integrator, step, last[0], last[1]);
    kt_check_near("order", log2(last[0] / last[1]), order, 0.2);
}

/* ---- what stays -------------------------------------------------------------------------------------------------- */

typedef struct keeper {
    const kt_case *c;
    kt_invariants *invariants;
    const double *scale;
    double bound, start[KT_INVARIANTS_MAX];
    kt_worst change[KT_INVARIANTS_MAX];
    int count;
} keeper;

static int keep(const kt_record *record, void *user) {
    keeper *k = user;
    double now[KT_INVARIANTS_MAX];
    k->count = k->invariants(k->c, record, now);
    if (record->index == 0)
        memcpy(k->start, now, sizeof now);
    for (int i = 0; i < k->count; i++)
        kt_worst_near(&k->change[i], now[i], k->start[i], k->scale[i] * k->bound, "t = %g", record->t);
    return 0;
}

void kt_case_conserve(const kt_case *c, const kt_setting *settings, size_t count, kt_invariants *invariants,
                      const char *const *names, const double *scale) {
    for (size_t i = 0; i < count; i++) {
        keeper k = {.c = c, .invariants = invariants, .scale = scale, .bound = settings[i].bound};
        for (int n = 0; n < KT_INVARIANTS_MAX; n++)
            k.change[n] = kt_worst_make(names[n]);
        kt_note("%s", kt_setting_text(c, &settings[i]));
        (void)kt_case_run(c, &settings[i], 0.0, keep, &k);
        for (int n = 0; n < k.count; n++)
            kt_check_worst(&k.change[n]);
    }
}

static int energy_of(const kt_case *c, const kt_record *record, double *out) {
    (void)c;
    out[0] = record->kinetic + record->potential;
    return 1;
}

void kt_case_conserve_energy(const kt_case *c, const kt_setting *settings, size_t count) {
    static const char *const names[KT_INVARIANTS_MAX] = {"energy"};
    static const double scale[] = {1.0};
    kt_case_conserve(c, settings, count, energy_of, names, scale);
}

/* ---- two runs ---------------------------------------------------------------------------------------------------- */

enum { RECORDS_MAX = 2048, NUMBERS_MAX = 64 };

typedef struct kept_run {
    const kt_case *c;
    double q[RECORDS_MAX][NUMBERS_MAX];
    int64_t count;
    bool second;
    kt_worst difference;
    double bound;
} kept_run;

static int keep_or_compare(const kt_record *record, void *user) {
    kept_run *kept = user;
    const kt_model *model = kept->c->model;
    double difference[NUMBERS_MAX];
    if (record->index >= RECORDS_MAX || kt_model_nq(model) > NUMBERS_MAX)
        return -1;
    double *q = kept->q[record->index];
    if (!kept->second) {
        memcpy(q, record->q, (size_t)kt_model_nq(model) * sizeof *q);
        kept->count = record->index + 1;
        return 0;
    }
    if (record->index >= kept->count)
        return -1;
    kt_position_subtract(model, record->q, q, difference);
    for (int i = 0; i < kt_model_nv(model); i++)
        kt_worst_below(&kept->difference, fabs(difference[i]), kept->bound, "coordinate %d at t = %g", i, record->t);
    return 0;
}

void kt_case_agree(const kt_case *c, const kt_setting *a, const kt_setting *b, double bound) {
    static kept_run kept;
    memset(&kept, 0, sizeof kept);
    kept.c = c;
    kept.bound = bound;
    kept.difference = kt_worst_make("difference of the two");
    kt_note("%s against %s", kt_setting_text(c, a), kt_setting_text(c, b));
    (void)kt_case_run(c, a, 0.0, keep_or_compare, &kept);
    kept.second = true;
    (void)kt_case_run(c, b, 0.0, keep_or_compare, &kept);
    kt_check_worst(&kept.difference);
}

double kt_degrees(double degrees) { return degrees * (3.14159265358979323846 / 180.0); }

double kt_angle_between(kt_quat a, kt_quat b) {
    const kt_quat turn = kt_quat_multiply(kt_quat_conjugate(a), b);
    return 2.0 * atan2(kt_vec3_norm(kt_vec3_make(turn.x, turn.y, turn.z)), fabs(turn.w));
}
