/* SPDX-License-Identifier: Apache-2.0 */
#include "both.h"

#include <math.h>
#include <string.h>

int kt_both_keep(const kt_record *record, void *trace) {
    kt_both_trace *t = trace;
    const int k = t->count;
    if (k == KT_BOTH_RECORDS)
        return -1;
    memcpy(t->q[k], record->q, (size_t)t->nq * sizeof(double));
    memcpy(t->v[k], record->v, (size_t)t->nv * sizeof(double));
    memcpy(t->a[k], record->a, (size_t)t->nv * sizeof(double));
    t->energy[k][0] = record->kinetic;
    t->energy[k][1] = record->potential;
    memcpy(t->joint[k], record->reactions, (size_t)t->bodies * sizeof(kt_wrench));
    if (t->loops > 0)
        memcpy(t->loop[k], record->loop_reactions, (size_t)t->loops * sizeof(kt_wrench));
    for (int b = 1; b < t->bodies; b++)
        t->point[k][b] = kt_point_position(t->model, record->data, b, kt_vec3_make(0.3, -0.2, 0.1));
    t->constraint.position = fmax(t->constraint.position, record->constraint.position);
    t->constraint.velocity = fmax(t->constraint.velocity, record->constraint.velocity);
    t->count++;
    return 0;
}

kt_model *kt_both_compile(const kt_description *description, const kt_model_options *options, kt_absolute **absolute) {
    kt_model *model = kt_test_model(description, options);
    *absolute = kt_formulate(description, options, model, KT_FORMULATION_ABSOLUTE);
    return *absolute != NULL ? model : NULL;
}

bool kt_both_run(const kt_model *model, const kt_absolute *absolute, kt_run run, kt_both_trace *t) {
    kt_error error;
    memset(t, 0, sizeof *t);
    t->model = model;
    t->nq = kt_model_nq(model);
    t->nv = kt_model_nv(model);
    t->bodies = kt_model_body_count(model);
    t->loops = kt_loop_count(model);
    if (t->nq > KT_BOTH_COORDINATES || t->bodies > KT_BOTH_BODIES || t->loops > KT_BOTH_BODIES)
        return kt_check_true("room", false);
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY | KT_RECORD_REACTION | KT_RECORD_CONSTRAINT;
    const kt_either e = kt_either_begin(model, absolute, &run, NULL);
    return kt_fine(absolute != NULL ? "absolute" : "tree", kt_either_run(e, kt_both_keep, t, &error), &error);
}

/* ---- what differs ------------------------------------------------------------------------------------------------ */

static double apart(kt_vec3 a, kt_vec3 b) { return kt_vec3_norm(kt_vec3_sub(a, b)); }

static double largest(double most, const double *x, int count) {
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

static double largest_load(double most, const kt_wrench *w, int count) {
    for (int i = 0; i < count; i++)
        most = fmax(most, fmax(kt_vec3_norm(w[i].force), kt_vec3_norm(w[i].moment)));
    return most;
}

/* The largest magnitudes in a trace, or 1: below that the numbers themselves count. */
typedef struct scales {
    double position, velocity, acceleration, energy, load;
} scales;

static scales scales_of(const kt_both_trace *t) {
    scales s = {1.0, 1.0, 1.0, 1.0, 1.0};
    for (int k = 0; k < t->count; k++) {
        s.position = largest(s.position, t->q[k], t->nq);
        s.velocity = largest(s.velocity, t->v[k], t->nv);
        s.acceleration = largest(s.acceleration, t->a[k], t->nv);
        s.energy = largest(s.energy, t->energy[k], 2);
        s.load = largest_load(largest_load(s.load, t->joint[k], t->bodies), t->loop[k], t->loops);
    }
    return s;
}

kt_both_worst kt_both_worst_make(void) {
    return (kt_both_worst){kt_worst_make("position"), kt_worst_make("velocity"), kt_worst_make("acceleration"),
                           kt_worst_make("energy"), kt_worst_make("reaction")};
}

static void compare_numbers(kt_worst *worst, const double *a, const double *b, int count, double scale, double bound,
                            const char *name, int record) {
    for (int i = 0; i < count; i++)
        kt_worst_near(worst, a[i] / scale, b[i] / scale, bound, "%s, record %d, %d", name, record, i);
}

static void compare_loads(kt_worst *worst, const kt_wrench *a, const kt_wrench *b, int count, double scale,
                          double bound, const char *name, int record) {
    for (int i = 0; i < count; i++)
        kt_worst_below(worst, fmax(apart(a[i].force, b[i].force), apart(a[i].moment, b[i].moment)) / scale, bound,
                       "%s, record %d, %d", name, record, i);
}

void kt_both_compare(kt_both_worst *worst, const char *name, const kt_both_trace *s, const kt_both_trace *t,
                     const kt_both_bounds *bounds) {
    const scales scale = scales_of(s);
    if (t->count != s->count)
        kt_check_equal_int(name, t->count, s->count);
    for (int k = 0; k < s->count && k < t->count; k++) {
        for (int b = 1; b < s->bodies; b++)
            kt_worst_below(&worst->position, apart(t->point[k][b], s->point[k][b]) / scale.position, bounds->position,
                           "%s, record %d, point of %d", name, k, b);
        compare_numbers(&worst->position, t->q[k], s->q[k], s->nq, scale.position, bounds->position, name, k);
        compare_numbers(&worst->velocity, t->v[k], s->v[k], s->nv, scale.velocity, bounds->velocity, name, k);
        compare_numbers(&worst->acceleration, t->a[k], s->a[k], s->nv, scale.acceleration, bounds->acceleration, name,
                        k);
        compare_numbers(&worst->energy, t->energy[k], s->energy[k], 2, scale.energy, bounds->energy, name, k);
        if (!(bounds->reaction > 0.0))
            continue;
        compare_loads(&worst->reaction, t->joint[k], s->joint[k], s->bodies, scale.load, bounds->reaction, name, k);
        compare_loads(&worst->reaction, t->loop[k], s->loop[k], s->loops, scale.load, bounds->reaction, name, k);
    }
}

void kt_both_check(const kt_both_worst *worst) {
    kt_check_worst(&worst->position);
    kt_check_worst(&worst->velocity);
    kt_check_worst(&worst->acceleration);
    kt_check_worst(&worst->energy);
    if (worst->reaction.count > 0)
        kt_check_worst(&worst->reaction);
}
