/* The cost of closed hard contacts and stops: an evaluation of the accelerations while they are closed, in evaluations
 * of the same mechanism without them.
 *
 * Both are timed in turns. A line is trusted if the accelerations keep the contacts closed. The normal acceleration of
 * each closed contact is then zero, and so are the tangential one of a contact that sticks and the acceleration of a
 * stopped joint. They are found from the motion of the bodies, not from the equations of the contacts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"
#include "mechanisms.h"
#include "report.h"

#include <math.h>
#include <string.h>

static const struct subject {
    const char *name;
    void (*make)(kt_contact_mechanism *m);
    int closed; /* the first contacts */
    bool sticks;
} subjects[] = {
    {"quadruped, 4 feet stick", kt_mechanism_quadruped, 4, true},
    {"quadruped, 1 foot sticks", kt_mechanism_quadruped, 1, true},
    {"quadruped, 4 feet slip", kt_mechanism_quadruped, 4, false},
    {"humanoid, 8 corners stick", kt_mechanism_humanoid, 8, true},
    {"box, 4 corners stick", kt_mechanism_box, 4, true},
    {"box, 3 corners slip", kt_mechanism_tripod, 3, false},
    {"chain in space, 10 stops", kt_mechanism_chain, 10, false},
    {"four-bar with a stop", kt_mechanism_fourbar, 1, false},
};

enum { OPEN, CLOSED, WAYS, NV = 64 };

/* Accelerations of the contacts, as a part of the largest free acceleration. Measured: 2e-15. */
static const double moving_most = 1e-12;

static const char about[] = "Times accelerations with closed hard contacts against those without, in turns.\n";
static const char columns[] = "subject,way," KT_CSV_TIMES ",moving," KT_CSV_ORIGIN;
static const char *const way_name[WAYS] = {"open", "closed"};

typedef struct way {
    kt_model *made;
    const kt_model *model; /* of the set of closed contacts */
    kt_data *data;
    const double *q, *v;
    double a[NV];
    kt_error error; /* the first failure */
} way;

static void evaluate(void *user, long repetitions) {
    way *w = user;
    for (long k = 0; k < repetitions; k++) {
        kt_error error;
        if (kt_acceleration_evaluate(w->model, w->data, 0.0, w->q, w->v, NULL, NULL, w->a, &error) != KT_OK &&
            w->error.code == KT_OK)
            w->error = error;
    }
}

/* The set in which the first contacts are closed, and stick or slip. A contact has two switches: that of its friction
 * comes second. */
static uint64_t set_of(const struct subject *s, const kt_contact_mechanism *m, const kt_model *model) {
    const int each = kt_switch_count(model) / m->items;
    uint64_t set = 0;
    for (int k = 0; k < s->closed * each; k++)
        set |= k % each == 0 || s->sticks ? kt_switch_bits(model, k) : 0;
    return set;
}

/* The velocities agree with the closed contacts, so that dependent equations do not contradict each other. */
static kt_status make(const struct subject *s, kt_contact_mechanism *m, kt_isa isa, way ways[WAYS], double *q,
                      double *v, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < WAYS && status == KT_OK; k++) {
        way *w = &ways[k];
        status = kt_mechanism_compile(m, k == CLOSED, isa, &w->made, error);
        if (status != KT_OK)
            return status;
        w->model = k == CLOSED ? kt_model_switched(w->made, set_of(s, m, w->made)) : w->made;
        w->q = q;
        w->v = v;
        status = w->model ? kt_data_create(w->model, &w->data, error)
                          : kt_error_set(error, KT_ERROR_UNSUPPORTED, s->name, "this set has no model of its own");
    }
    if (status != KT_OK)
        return status;
    kt_model_initial(ways[OPEN].model, q, v);
    for (int i = 0; i < kt_model_nv(ways[OPEN].model); i++)
        v[i] = 0.3 * sin(1.0 + i);
    status = kt_state_assemble(ways[OPEN].model, ways[OPEN].data, 0.0, q, v, error);
    return status == KT_OK ? kt_velocity_impact(ways[CLOSED].model, ways[CLOSED].data, 0.0, q, v, NULL, error) : status;
}

/* The largest acceleration of an item that is closed, from the motion of its body. */
static double acceleration_of(const kt_mechanism_item *item, const way *w, bool sticks) {
    const int body = kt_body_find(w->model, item->body);
    if (item->stop)
        return fabs(w->a[kt_body_coordinates(w->model, body).v]);
    const kt_vec3 centre = kt_point_acceleration(w->model, w->data, body, item->at);
    const kt_vec3 alpha = kt_body_acceleration(w->model, w->data, body).angular;
    const kt_vec3 lowest = kt_vec3_add(centre, kt_vec3_cross(alpha, kt_vec3_make(0.0, 0.0, -item->radius)));
    return sticks ? fmax(fabs(centre.z), hypot(lowest.x, lowest.y)) : fabs(centre.z);
}

/* The same of all, as a part of the largest free acceleration; NaN if there is none. */
static double moving(const struct subject *s, const kt_contact_mechanism *m, const way ways[WAYS]) {
    const way *w = &ways[CLOSED];
    double most = 0.0, size = 0.0;
    kt_error error;
    if (kt_kinematics_update(w->model, w->data, w->q, w->v, w->a, &error) != KT_OK)
        return (double)NAN;
    for (int k = 0; k < s->closed; k++) {
        const double a = acceleration_of(&m->item[k], w, s->sticks);
        most = isnan(a) || a > most ? a : most;
    }
    for (int i = 0; i < kt_model_nv(w->model); i++)
        size = fmax(size, fabs(ways[OPEN].a[i]));
    return most / size;
}

static int report(const struct subject *s, const kt_bench_times times[WAYS], double off, kt_isa isa, kt_csv *csv) {
    const kt_bench_ratio ratio = kt_bench_compare(&times[CLOSED], &times[OPEN]);
    const bool trusted = off <= moving_most;
    printf("%26s |%9.3f%9.3f%8.2f |%9.1e%s\n", s->name, 1e6 * times[OPEN].low, 1e6 * times[CLOSED].low, ratio.median,
           off, trusted ? "" : "  NOT TO BE TRUSTED");
    (void)fflush(stdout);
    for (int k = 0; k < WAYS; k++) {
        kt_csv_text(csv, s->name);
        kt_csv_text(csv, way_name[k]);
        kt_csv_times(csv, &times[k]);
        kt_csv_number(csv, off);
        kt_csv_origin(csv, isa);
        kt_csv_line(csv);
    }
    return trusted ? KT_BENCH_DONE : KT_BENCH_FAILED;
}

static int measure(size_t index, const kt_bench_options *options, kt_csv *csv) {
    const struct subject *s = &subjects[index];
    static kt_contact_mechanism m;
    static way ways[WAYS];
    static kt_bench_times times[WAYS];
    kt_bench_task tasks[WAYS];
    kt_error error = {0};
    static double q[NV], v[NV];
    int result = KT_BENCH_FAILED;
    memset(&m, 0, sizeof m);
    memset(ways, 0, sizeof ways);
    s->make(&m);
    if (make(s, &m, options->isa, ways, q, v, &error) == KT_OK) {
        for (int k = 0; k < WAYS; k++)
            tasks[k] = (kt_bench_task){evaluate, &ways[k]};
        kt_bench_measure(tasks, WAYS, options->seconds, times);
        error = ways[OPEN].error.code != KT_OK ? ways[OPEN].error : ways[CLOSED].error;
    }
    if (error.code == KT_OK)
        result = report(s, times, moving(s, &m, ways), kt_model_isa(ways[OPEN].model), csv);
    else
        (void)kt_bench_tell(&error);
    for (int k = 0; k < WAYS; k++) {
        kt_data_free(ways[k].data);
        kt_model_free(ways[k].made);
    }
    return result;
}

static void print_head(void) {
    printf("Accelerations, us a call (lower quartile), and what the closed contacts do to their cost.\n\n%26s "
           "|%9s%9s%8s |%9s\n",
           "", "open", "closed", "ratio", "moving");
}

int main(int argc, char **argv) {
    static const kt_bench_table table = {
        about, columns, "Closed hard contacts", print_head, sizeof subjects / sizeof *subjects, measure};
    return kt_bench_run(&table, argc, argv);
}
