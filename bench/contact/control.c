/* Robots on hard contacts under control: how many runs end with an error, and why.
 *
 * Each robot stands, drops from 1 cm, walks in place (its legs lift in turns), or is pushed while it stands. A push is
 * a random wrench on the trunk, and a new one follows each 50 ms. Its force is at most the weight of the robot, and its
 * moment at most that of the weight at 10 cm. The controller holds the joints at their targets by tau = k (target - q)
 * - d v, once in a period of 1 ms. The grid takes all methods with fixed steps of 1 ms and those with adaptive steps,
 * friction of 0.3 to 1.2, and restitutions of 0 to 0.8. A line of the table has one robot, one task and one method. A
 * tick's cost is its number of evaluations. With fixed steps, step_evaluations bounds this cost (--bound); the column
 * `completed` counts the ticks that a time step has completed. The standing tick is the worst one behind the first 0.2
 * s, in which a robot that stands comes to rest.
 *
 * The stiffness k of all controllers may be multiplied by a factor: feet of soft legs slip more. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"
#include "mechanisms.h"
#include "report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NQ = 64, BODIES = 64, TASKS = 4, FIRST_JOINT = 6 };

static const double period = 1e-3, settling = 0.2, pushing = 0.05, weight_arm = 0.1;
/* A run fails with more tries of steps: 100 in a tick on average. */
static const double tries_most = 100.0 / 1e-3;

static const struct robot {
    const char *name;
    void (*make)(kt_contact_mechanism *m);
    double stiffness, damping, armature;
    double swing; /* of the joints that lift a leg, rad */
} robots[] = {{"quadruped", kt_mechanism_quadruped, 120.0, 3.0, 0.01, 0.3},
              {"biped", kt_mechanism_biped, 800.0, 20.0, 0.05, 0.2},
              {"humanoid", kt_mechanism_humanoid, 800.0, 20.0, 0.05, 0.2}};
static const char *const task_names[TASKS] = {"stands", "drops", "walks", "pushed"};
enum { STAND, DROP, WALK, PUSH };

static const struct way {
    const char *name;
    bool fixed;
} ways[] = {{"rk4", true},   {"heun", true},    {"dopri5", true},  {"dop853", true},  {"radau5", true}, {"auto", true},
            {"heun", false}, {"dopri5", false}, {"dop853", false}, {"radau5", false}, {"auto", false}};
static const double frictions[] = {0.3, 0.6, 0.9, 1.2}, restitutions[] = {0.0, 0.4, 0.8};
enum {
    ROBOTS = sizeof robots / sizeof *robots,
    WAYS = sizeof ways / sizeof *ways,
    FRICTIONS = sizeof frictions / sizeof *frictions,
    RESTITUTIONS = sizeof restitutions / sizeof *restitutions,
    CELLS = ROBOTS * TASKS * WAYS * FRICTIONS * RESTITUTIONS
};

/* A cell of the grid: its numbers, friction first. */
typedef struct cell {
    int robot, task, way;
    double friction, restitution;
    double stiffness; /* a factor */
    uint64_t bound;   /* evaluations of a fixed step; 0: none */
    uint64_t seed;    /* of the pushes */
} cell;

static cell cell_of(int index, double stiffness, uint64_t bound) {
    cell c = {.stiffness = stiffness, .bound = bound, .seed = UINT64_C(0x9e3779b97f4a7c15) * (uint64_t)(index + 1)};
    c.restitution = restitutions[index % RESTITUTIONS];
    c.friction = frictions[index / RESTITUTIONS % FRICTIONS];
    index /= RESTITUTIONS * FRICTIONS;
    c.way = index % WAYS;
    c.task = index / WAYS % TASKS;
    c.robot = index / WAYS / TASKS;
    return c;
}

/* The outcome of a run. */
typedef struct outcome {
    kt_error error; /* code KT_OK: it came to its end */
    double time;
    uint64_t worst, standing, evaluations; /* worst: evaluations of a tick; standing: behind `settling` */
    uint64_t impacts, completed;
} outcome;

static kt_status build(const cell *c, kt_model **model, kt_contact_mechanism *m, kt_error *error) {
    memset(m, 0, sizeof *m);
    robots[c->robot].make(m);
    for (int i = 1; i < m->bodies; i++)
        m->body[i].joint.armature[0] = robots[c->robot].armature;
    for (int k = 0; k < m->items; k++) {
        m->item[k].friction = c->friction;
        m->item[k].restitution = c->restitution;
    }
    return kt_mechanism_compile(m, true, KT_ISA_AUTO, model, error);
}

/* The height of the lowest contact above the floor. */
static double clearance(const kt_model *model, kt_data *data, const kt_contact_mechanism *m, const double *q) {
    double least = HUGE_VAL;
    kt_error error;
    if (kt_kinematics_update(model, data, q, NULL, NULL, &error) != KT_OK)
        return (double)NAN;
    for (int k = 0; k < m->items; k++) {
        const kt_mechanism_item *item = &m->item[k];
        least = fmin(least, kt_point_position(model, data, kt_body_find(model, item->body), item->at).z - item->radius);
    }
    return least;
}

/* A random number from -1 to 1. Source: xorshift64* (Vigna 2016). */
static double draw(uint64_t *seed) {
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return 2.0 * (double)((*seed * UINT64_C(2685821657736338717)) >> 11) / 9007199254740992.0 - 1.0;
}

/* Pushes the trunk with another random wrench. */
static kt_status push(cell *c, const kt_model *model, kt_simulation *simulation, kt_error *error) {
    kt_wrench wrench[BODIES];
    double weight = 0.0;
    memset(wrench, 0, sizeof wrench);
    for (int body = 1; body < kt_model_body_count(model); body++)
        weight += 9.81 * kt_body_mass(model, body);
    double *to[] = {&wrench[1].force.x,  &wrench[1].force.y,  &wrench[1].force.z,
                    &wrench[1].moment.x, &wrench[1].moment.y, &wrench[1].moment.z};
    for (int i = 0; i < 6; i++)
        *to[i] = draw(&c->seed) * weight * (i < 3 ? 1.0 : weight_arm);
    return kt_simulation_set_wrenches(simulation, wrench, error);
}

/* The targets at time t: while a leg is lifted its hip and knee bend. */
static void control(const cell *c, const kt_contact_mechanism *m, const double *rest, double t, const double *q,
                    const double *v, double *tau) {
    const struct robot *r = &robots[c->robot];
    const double phase = sin(4.0 * acos(-1.0) * t);
    for (int i = 0; i < FIRST_JOINT; i++)
        tau[i] = 0.0;
    for (int i = 1; i < m->bodies; i++) {
        const int joint = FIRST_JOINT + i - 1;
        const double angle = rest[joint + 1];
        /* Legs are bent: their thighs and knees have positions. Bodies to the left have odd places in their chains. */
        const bool left = r->make == kt_mechanism_quadruped ? ((i - 1) / 3 % 2 == 0) : i > m->bodies - 7;
        const bool bends = c->task == WALK && fabs(angle) > 0.3 && m->body[i].joint.axis.y > 0.5;
        const double lift = bends ? fmax(left ? phase : -phase, 0.0) * r->swing * angle / fabs(angle) : 0.0;
        tau[joint] = c->stiffness * r->stiffness * (angle + lift - q[joint + 1]) - r->damping * v[joint];
    }
}

static kt_status begin(const cell *c, const kt_model *model, const kt_contact_mechanism *m, double *rest,
                       double duration, kt_simulation **simulation, kt_error *error) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    kt_data *data = NULL;
    double v[NQ] = {0.0};
    kt_status status = kt_data_create(model, &data, error);
    if (status != KT_OK)
        return status;
    kt_model_initial(model, rest, v);
    rest[2] += (c->task == DROP ? 0.01 : 1e-6) - clearance(model, data, m, rest);
    kt_data_free(data);
    run.integrator = strcmp(ways[c->way].name, "auto") == 0 ? NULL : ways[c->way].name;
    run.step = ways[c->way].fixed ? period : 0.0;
    run.relative = run.absolute = 1e-6;
    run.duration = 1e3;
    options.max_steps = (uint64_t)(tries_most * duration);
    options.step_evaluations = ways[c->way].fixed ? c->bound : 0;
    status = kt_simulation_create(model, &run, &options, simulation, error);
    return status == KT_OK ? kt_simulation_set_state(*simulation, 0.0, rest, v, error) : status;
}

/* Adds the cost of a tick. */
static void count_tick(const kt_simulation *simulation, outcome *o) {
    const uint64_t now = kt_simulation_counts_of(simulation).evaluations, cost = now - o->evaluations;
    o->worst = cost > o->worst ? cost : o->worst;
    o->standing = o->time > settling && cost > o->standing ? cost : o->standing;
    o->evaluations = now;
    o->time = kt_simulation_time(simulation);
}

static outcome run_cell(cell *c, double duration) {
    static kt_contact_mechanism m;
    const long every = lround(pushing / period);
    outcome o = {.time = 0.0};
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    double rest[NQ], tau[NQ];
    kt_status status = build(c, &model, &m, &o.error);
    if (status == KT_OK)
        status = begin(c, model, &m, rest, duration, &simulation, &o.error);
    for (long k = 0; status == KT_OK && o.time < duration - 0.5 * period; k++) {
        if (c->task == PUSH && k % every == 0)
            status = push(c, model, simulation, &o.error);
        control(c, &m, rest, o.time, kt_simulation_positions(simulation), kt_simulation_velocities(simulation), tau);
        if (status == KT_OK)
            status = kt_simulation_set_torque(simulation, tau, &o.error);
        if (status == KT_OK)
            status = kt_simulation_tick(simulation, period, &o.error);
        count_tick(simulation, &o);
    }
    o.error.code = status;
    o.impacts = kt_simulation_contacts(simulation).impacts;
    o.completed = kt_simulation_contacts(simulation).completed;
    kt_simulation_free(simulation);
    kt_model_free(model);
    return o;
}

/* The sums of a line of the table. */
typedef struct line {
    int runs, failed;
    uint64_t worst, standing, evaluations, impacts, completed;
    double time;
    cell of; /* the cell with the worst tick with fixed steps, of all */
} line;

/* The cells that run: every stride-th one, from the cell `offset` on, with `only` in their names. */
typedef struct choice {
    double duration;
    int stride, offset;
    const char *only;
    double most;      /* evaluations of a tick */
    uint64_t bound;   /* evaluations of a fixed step; 0: none */
    double stiffness; /* a factor */
    const char *csv;  /* a file with a line for each cell; NULL: none */
} choice;

static void print_line(const cell *c, const line *l) {
    printf("%10s %7s %7s %-8s |%5d%7d%11.0f%10.0f%10.1f%10.2f%10.0f\n", robots[c->robot].name, task_names[c->task],
           ways[c->way].name, ways[c->way].fixed ? "1 ms" : "adaptive", l->runs, l->failed, (double)l->worst,
           (double)l->standing, (double)l->evaluations * period / l->time, (double)l->impacts / l->time,
           (double)l->completed);
    (void)fflush(stdout);
}

static void write_cell(kt_csv *csv, const cell *c, const outcome *o) {
    const double numbers[] = {c->friction,        c->restitution,      o->time,
                              (double)o->worst,   (double)o->standing, (double)o->evaluations,
                              (double)o->impacts, (double)o->completed};
    kt_csv_text(csv, robots[c->robot].name);
    kt_csv_text(csv, task_names[c->task]);
    kt_csv_text(csv, ways[c->way].name);
    kt_csv_text(csv, ways[c->way].fixed ? "fixed" : "adaptive");
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        kt_csv_number(csv, numbers[i]);
    kt_csv_text(csv, o->error.code == KT_OK ? "" : o->error.message);
    kt_csv_line(csv);
}

static void add_run(cell *c, double duration, line *l, kt_csv *csv) {
    const outcome o = run_cell(c, duration);
    write_cell(csv, c, &o);
    l->runs++;
    l->failed += o.error.code != KT_OK;
    l->worst = o.worst > l->worst ? o.worst : l->worst;
    l->standing = o.standing > l->standing ? o.standing : l->standing;
    l->completed += o.completed;
    l->evaluations += o.evaluations;
    l->impacts += o.impacts;
    l->time += o.time;
    if (o.error.code != KT_OK)
        printf("friction %.1f, restitution %.1f: %s: %s\n", c->friction, c->restitution, o.error.where,
               o.error.message);
}

/* Runs the cells. Returns the number of runs that failed, and of lines with a tick that takes too many evaluations. */
static int run_grid(const choice *what, kt_csv *csv) {
    int expensive = 0;
    line l = {0}, all = {0};
    printf("%34s |%5s%7s%11s%10s%10s%10s%10s\n", "", "runs", "failed", "worst tick", "standing", "mean tick",
           "impacts/s", "completed");
    for (int i = 0; i < CELLS; i++) {
        cell c = cell_of(i, what->stiffness, what->bound);
        const cell next = cell_of(i + 1 < CELLS ? i + 1 : 0, what->stiffness, what->bound);
        char name[64];
        (void)snprintf(name, sizeof name, "%s %s %s %s", robots[c.robot].name, task_names[c.task], ways[c.way].name,
                       ways[c.way].fixed ? "fixed" : "adaptive");
        if (i % what->stride == what->offset && (what->only == NULL || strstr(name, what->only) != NULL))
            add_run(&c, what->duration, &l, csv);
        if (l.runs == 0 || (c.way == next.way && c.task == next.task && c.robot == next.robot))
            continue;
        print_line(&c, &l);
        if (ways[c.way].fixed && l.worst > all.worst)
            all.worst = l.worst, all.of = c;
        all.runs += l.runs;
        all.failed += l.failed;
        all.completed += l.completed;
        all.standing = c.task == STAND && ways[c.way].fixed && l.standing > all.standing ? l.standing : all.standing;
        expensive += (double)l.worst > what->most;
        l = (line){0};
    }
    printf("%d runs of %g s, %d failed\n", all.runs, what->duration, all.failed);
    printf("the worst tick with fixed steps takes %.0f evaluations: %s %s %s; %.0f of robots that stand\n",
           (double)all.worst, robots[all.of.robot].name, task_names[all.of.task], ways[all.of.way].name,
           (double)all.standing);
    printf("%.0f ticks were completed by a time step\n", (double)all.completed);
    if (expensive > 0)
        printf("%d lines have a tick of more than %.0f evaluations\n", expensive, what->most);
    return all.failed + expensive;
}

int main(int argc, char **argv) {
    choice what = {.duration = 10.0, .stride = 1, .most = HUGE_VAL, .stiffness = 1.0, .bound = 300};
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (value != NULL && strcmp(argv[i], "--duration") == 0)
            what.duration = strtod(argv[++i], NULL);
        else if (value != NULL && strcmp(argv[i], "--stride") == 0)
            what.stride = (int)strtol(argv[++i], NULL, 10);
        else if (value != NULL && strcmp(argv[i], "--offset") == 0)
            what.offset = (int)strtol(argv[++i], NULL, 10);
        else if (value != NULL && strcmp(argv[i], "--only") == 0)
            what.only = argv[++i];
        else if (value != NULL && strcmp(argv[i], "--most") == 0)
            what.most = strtod(argv[++i], NULL);
        else if (value != NULL && strcmp(argv[i], "--bound") == 0)
            what.bound = strtoull(argv[++i], NULL, 10);
        else if (value != NULL && strcmp(argv[i], "--csv") == 0)
            what.csv = argv[++i];
        else if (value != NULL && strcmp(argv[i], "--stiffness") == 0)
            what.stiffness = strtod(argv[++i], NULL);
        else
            what.stride = 0;
    }
    if (what.stride < 1 || what.offset < 0 || what.offset >= what.stride || !(what.duration > 0.0) ||
        !(what.stiffness > 0.0)) {
        (void)fprintf(stderr,
                      "usage: bench-control [--duration S] [--stride N] [--offset M] [--only WORDS] [--most E] "
                      "[--stiffness F] [--bound N] [--csv FILE]\n"
                      "Runs every N-th cell of the grid for S seconds, from the cell M < N on. WORDS: a part of "
                      "a line's name. F: the factor of the controllers' stiffness. N: evaluations of a fixed step; 0: "
                      "no bound; default 300. FILE: gets a line for each cell.\nReturns 1 if a run fails, or if a "
                      "tick takes more than E evaluations.\n");
        return 2;
    }
    kt_csv csv;
    if (!kt_csv_open(&csv, what.csv,
                     "robot,task,method,steps,friction,restitution,time_s,worst,standing,evaluations,impacts,"
                     "completed,error"))
        return 2;
    const int wrong = run_grid(&what, &csv);
    return kt_csv_close(&csv) && wrong == 0 ? 0 : 1;
}
