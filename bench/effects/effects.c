/* The cost of each type of effect in an evaluation of accelerations: the first one in a scene, and each further one.
 *
 * The effects act on eight links in space, each time on the same two. Evaluations without effects, with one and with 1
 * + --max of them are timed in turns. Instructions are counted by callgrind, where valgrind is installed, with the
 * baseline kernels: the program calls itself. A line is trusted if the accelerations are finite and differ from those
 * without effects.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "chain.h"
#include "kinetree/effect.h"
#include "kinetree/simulation.h"
#include "report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINKS = 8, NEAR = 3, FAR = 6, TASKS = 3, CUSTOM = KT_EFFECT_TYPE_COUNT, TYPES = KT_EFFECT_TYPE_COUNT + 1 };

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

static char names[LINKS][8];
static kt_body bodies[LINKS];

/* A caller's own: a spring of no length. */
static int pull(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    const kt_vec3 d = kt_vec3_sub(ends[1].point, ends[0].point);
    (void)user, (void)t, (void)balance;
    wrenches[0].force = kt_vec3_scale(3.0, d);
    wrenches[1].force = kt_vec3_scale(-3.0, d);
    return 0;
}

/* Every type pushes: the contact is deep, the stop is hit. */
static kt_effect effect_of(kt_effect_type type) {
    kt_effect e = kt_effect_default();
    e.type = type;
    e.joint = names[NEAR];
    e.between[0].body = names[NEAR];
    e.between[1].body = names[FAR];
    e.between[0].at = kt_vec3_make(0.1, 0.2, 0.3);
    e.stiffness = 3.0;
    e.damping = 0.5;
    e.length = 0.2;
    e.coulomb = e.viscous = e.linear = e.quadratic = e.strength = e.friction = e.dissipation = 0.3;
    e.breakaway = 0.5;
    if (type == KT_EFFECT_JOINT_FRICTION)
        e.friction = 0.0; /* no load: at a radius of 9 m, friction that grows with one would jam */
    e.lower = 10.0;
    e.radius = 9.0;
    e.wrench = type == KT_EFFECT_CUSTOM ? pull : NULL;
    e.end_count = 2;
    e.formula[0] = "-3*(length - 0.2) - 0.5*speed";
    e.torque = kt_function_constant(0.7);
    e.target = kt_function_constant(0.7);
    e.mass = kt_function_ramp(1.0, 0.5, 0.0, 1.0);
    e.exhaust = kt_vec3_make(0.3, 0.0, 1.0);
    for (int k = 0; k < 3; k++)
        e.value[k] = kt_function_constant(0.7);
    for (int k = 0; k < 6; k++)
        e.stiffnesses[k] = e.dampings[k] = 0.7;
    return e;
}

static void describe_chain(kt_description *d) {
    for (int i = 0; i < LINKS; i++) {
        snprintf(names[i], sizeof names[i], "link%d", i);
        bodies[i] = kt_chain_link;
        bodies[i].name = names[i];
        bodies[i].parent = i > 0 ? names[i - 1] : NULL;
        bodies[i].joint.axis = kt_chain_axis(i);
        bodies[i].joint.position[0] = 0.3 + 0.1 * i;
        bodies[i].joint.velocity[0] = 0.7 - 0.2 * i;
    }
    *d = kt_description_default();
    d->bodies = bodies;
    d->body_count = LINKS;
    d->gravity = kt_chain_gravity;
}

typedef struct subject {
    kt_model *model;
    kt_data *data;
    double q[LINKS], v[LINKS], a[LINKS];
    kt_error error; /* the first failure */
} subject;

static kt_status make(subject *s, int type, int count, kt_isa isa, kt_error *error) {
    kt_description d;
    kt_model_options options = kt_model_options_default();
    kt_effect *effects = calloc((size_t)count + 1, sizeof *effects);
    memset(s, 0, sizeof *s);
    describe_chain(&d);
    for (int i = 0; i < count && effects; i++)
        effects[i] = effect_of(type == CUSTOM ? KT_EFFECT_CUSTOM : (kt_effect_type)type);
    d.effects = effects;
    d.effect_count = count;
    options.isa = isa;
    kt_status status = effects ? kt_model_compile(&d, &options, &s->model, error)
                               : kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the effects");
    if (status == KT_OK)
        status = kt_data_create(s->model, &s->data, error);
    if (status == KT_OK)
        kt_model_initial(s->model, s->q, s->v);
    free(effects);
    return status;
}

static void drop(subject *s) {
    kt_data_free(s->data);
    kt_model_free(s->model);
}

static void evaluate(void *user, long repetitions) {
    subject *s = user;
    for (long k = 0; k < repetitions; k++) {
        kt_error error;
        if (kt_acceleration_evaluate(s->model, s->data, 0.1, s->q, s->v, NULL, NULL, s->a, &error) != KT_OK &&
            s->error.code == KT_OK)
            s->error = error;
    }
}

/* ---- instructions ------------------------------------------------------------------------------------------------ */

static const char *own_path;

/* Instructions of one evaluation with `count` effects of a type. NaN if they cannot be counted. */
static double count_instructions(int type, int count) {
    char command[1200], line[256];
    double found = (double)NAN;
    snprintf(command, sizeof command,
             "LD_BIND_NOW=1 valgrind --tool=callgrind --callgrind-out-file=/dev/null "
             "--toggle-collect=kt_acceleration_evaluate '%s' --once %d %d 2>&1 >/dev/null",
             own_path, type, count);
    FILE *pipe = popen(command, "r"); /* NOLINT(cert-env33-c): nothing of it comes from elsewhere */
    while (pipe && fgets(line, sizeof line, pipe)) {
        const char *at = strstr(line, "Collected : ");
        if (at)
            found = strtod(at + strlen("Collected : "), NULL);
    }
    if (pipe && pclose(pipe) != 0)
        found = (double)NAN;
    return found;
}

/* The program that callgrind runs. */
static int run_once(int type, int count) {
    static subject s;
    kt_error error = {0};
    if (type < 0 || type >= TYPES || make(&s, type, count, KT_ISA_BASE, &error) != KT_OK)
        return KT_BENCH_FAILED;
    evaluate(&s, 1);
    drop(&s);
    return s.error.code == KT_OK ? KT_BENCH_DONE : KT_BENCH_FAILED;
}

/* ---- lines ------------------------------------------------------------------------------------------------------- */

typedef struct line {
    const char *name;
    kt_bench_times times[TASKS];    /* none, one, 1 + max */
    double first, each;             /* s: medians of the differences round by round */
    double first_count, each_count; /* instructions */
    bool trusted;
} line;

static double median_difference(const kt_bench_times *less, const kt_bench_times *more, double by) {
    kt_bench_times differences = {.rounds = less->rounds};
    for (int i = 0; i < less->rounds; i++)
        differences.sample[i] = (more->sample[i] - less->sample[i]) / by;
    kt_bench_sort(&differences);
    return differences.median;
}

/* none: instructions without effects. */
static kt_status measure(int type, double none, const kt_bench_options *options, line *l, kt_error *error) {
    static subject s[TASKS];
    const int counts[TASKS] = {0, 1, 1 + options->max};
    kt_bench_task tasks[TASKS];
    kt_status status = KT_OK;
    for (int i = 0; i < TASKS; i++) {
        if (status == KT_OK)
            status = make(&s[i], type, counts[i], options->isa, error);
        tasks[i] = (kt_bench_task){evaluate, &s[i]};
    }
    if (status == KT_OK) {
        *l = (line){.name = kt_effect_type_name(type == CUSTOM ? KT_EFFECT_CUSTOM : (kt_effect_type)type)};
        kt_bench_measure(tasks, TASKS, options->seconds, l->times);
        l->first = median_difference(&l->times[0], &l->times[1], 1.0);
        l->each = median_difference(&l->times[1], &l->times[2], options->max);
        const double one = count_instructions(type, 1);
        l->first_count = one - none;
        l->each_count = (count_instructions(type, counts[2]) - one) / options->max;
        const double change = kt_chain_difference(s[1].a, s[0].a, s[0].a, LINKS);
        l->trusted = isfinite(change) && change > 0.0;
        for (int i = 0; i < TASKS; i++)
            if (s[i].error.code != KT_OK && status == KT_OK) {
                status = s[i].error.code;
                *error = s[i].error;
            }
    }
    for (int i = 0; i < TASKS; i++)
        drop(&s[i]);
    return status;
}

static void print_number(double x, int digits) {
    if (isnan(x))
        printf("%14s", "-");
    else
        printf("%14.*f", digits, x);
}

static void print_line(const line *l) {
    printf("%-16s", l->name);
    print_number(1e9 * l->first, 1);
    print_number(1e9 * l->each, 1);
    print_number(l->first_count, 0);
    print_number(l->each_count, 0);
    puts(l->trusted ? "" : "  NOT TO BE TRUSTED");
    (void)fflush(stdout);
}

static void write_line(kt_csv *csv, const line *l, int max, kt_isa isa) {
    for (int i = 0; i < TASKS; i++) {
        kt_csv_text(csv, l->name);
        kt_csv_number(csv, i == 0 ? 0 : i == 1 ? 1 : 1 + max);
        kt_csv_times(csv, &l->times[i]);
        kt_csv_number(csv, l->first);
        kt_csv_number(csv, l->each);
        kt_csv_number(csv, l->first_count);
        kt_csv_number(csv, l->each_count);
        kt_csv_origin(csv, isa);
        kt_csv_line(csv);
    }
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

static const char about[] =
    "Costs of each type of effect: of the first in a scene, and of each of --max further ones.\n";
static const char columns[] =
    "effect,effects," KT_CSV_TIMES ",first_s,each_s,first_instructions,each_instructions," KT_CSV_ORIGIN;

static int run(const kt_bench_options *options, kt_csv *csv) {
    const double none = count_instructions(0, 0);
    bool trusted = true;
    for (int type = 0; type < TYPES; type++) {
        static line l;
        kt_error error = {0};
        if (measure(type, none, options, &l, &error) != KT_OK)
            return kt_bench_tell(&error);
        print_line(&l);
        write_line(csv, &l, options->max, options->isa);
        trusted &= l.trusted;
    }
    return trusted ? KT_BENCH_DONE : KT_BENCH_FAILED;
}

int main(int argc, char **argv) {
    kt_bench_options options = {.max = 100, .seconds = 0.5};
    kt_csv csv;
    own_path = argv[0];
    if (argc == 4 && strcmp(argv[1], "--once") == 0)
        return run_once((int)strtol(argv[2], NULL, 10), (int)strtol(argv[3], NULL, 10));
    const int status = kt_bench_read(argc, argv, about, &options);
    if (status >= 0)
        return status;
    if (!kt_csv_open(&csv, options.csv, columns))
        return KT_BENCH_FAILED;
    kt_bench_heading("Effects on a chain of 8 links", options.isa, options.csv);
    printf(
        "ns: time that an evaluation of accelerations takes more (median of the rounds), for the first effect of a "
        "type,\n"
        "which wants the motion of the links below it, and for each further one. Instructions: the same, counted by\n"
        "callgrind with the baseline kernels (-: valgrind is not there).\n\n"
        "%-16s%14s%14s%14s%14s\n",
        "effect", "first ns", "each ns", "first instr.", "each instr.");
    const int result = run(&options, &csv);
    return kt_csv_close(&csv) ? result : KT_BENCH_FAILED;
}
