/* The hard cases of test/hard in their full length: the measure, its bound, and the result of MuJoCo and ODE for the
 * same mechanism. A peer is compared if it has the joints and the motion can be compared. All engines take the same
 * fixed step. If this engine steps adaptively, the others take the step that the case names. All use the same measures,
 * computed from the poses and velocities of their bodies. For motions with impacts, stick and slip (events.h), the time
 * is measured, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../report.h"
#include "draw.h"
#include "events.h"
#include "peers.h"

#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char about[] =
    "Runs the cases on which engines break, and shows what is measured and its bound.\n"
    "Usage: bench-hard [OPTION...]\n\n"
    "  --only N     the cases of kind N, 1 to 15; 16: motions with impacts, stick, slip, slack\n"
    "               ropes and releases, with processor times\n"
    "  --short      as short as the tests run them; motions of kind 16 once, not three times\n"
    "  --alone      without the other engines\n"
    "  --markdown   prints a table in Markdown\n"
    "  --csv FILE   writes the figures there\n"
    "  --plot FILE  draws those that other engines can run, as SVG or PNG; --plot-dark FILE for a dark page\n"
    "  --help       this text\n\n"
    "Exit status: 0 all bounds hold, 1 one does not, 2 the command line or the file is wrong.\n";

enum { EVENTS = KT_HARD_KINDS + 1 }; /* the kind of motions with events */

typedef struct options {
    int only;
    bool brief, alone, markdown;
    const char *csv, *plot[2]; /* on a light page, on a dark one */
} options;

/* -1 to go on, or the exit status. */
static int read_options(int argc, char **argv, options *o) {
    enum { ONLY = 1, BRIEF, ALONE, MARKDOWN, CSV, PLOT, PLOT_DARK, HELP };
    static const struct option known[] = {{"only", required_argument, NULL, ONLY},
                                          {"short", no_argument, NULL, BRIEF},
                                          {"alone", no_argument, NULL, ALONE},
                                          {"markdown", no_argument, NULL, MARKDOWN},
                                          {"csv", required_argument, NULL, CSV},
                                          {"plot", required_argument, NULL, PLOT},
                                          {"plot-dark", required_argument, NULL, PLOT_DARK},
                                          {"help", no_argument, NULL, HELP},
                                          {NULL, 0, NULL, 0}};
    for (int found; (found = getopt_long(argc, argv, "", known, NULL)) != -1;)
        switch (found) {
        case ONLY:
            o->only = (int)strtol(optarg, NULL, 10);
            if (o->only < 1 || o->only > EVENTS) {
                (void)fprintf(stderr, "%s: '%s' is no kind of 1 to %d\n", argv[0], optarg, EVENTS);
                return KT_BENCH_FAILED;
            }
            break;
        case BRIEF:
            o->brief = true;
            break;
        case ALONE:
            o->alone = true;
            break;
        case MARKDOWN:
            o->markdown = true;
            break;
        case CSV:
            o->csv = optarg;
            break;
        case PLOT:
        case PLOT_DARK:
            o->plot[found == PLOT_DARK] = optarg;
            break;
        case HELP:
            (void)fputs(about, stdout);
            return KT_BENCH_DONE;
        default:
            return KT_BENCH_FAILED;
        }
    return -1;
}

/* ---- one case ---------------------------------------------------------------------------------------------------- */

enum { PEERS = 2, CELL = 40 };
static kt_hard_peer_run *const peers[PEERS] = {kt_hard_mujoco, kt_hard_ode};
static const char *const peer_names[PEERS] = {"MuJoCo", "ODE"};

typedef struct row {
    kt_hard own;
    bool ran[PEERS];
    kt_hard_watch peer[PEERS];
    char words[PEERS][KT_HARD_WORDS];
} row;

static void run_peer(row *r, int k, bool full) {
    const kt_hard_motion *motion = r->own.c->motion;
    static kt_hard h;
    h = (kt_hard){.c = r->own.c, .full = full, .scene = kt_scene_default()};
    memset(&r->peer[k], 0, sizeof r->peer[k]);
    if (kt_hard_open(&h, motion) && kt_hard_start(&h, motion))
        r->ran[k] = peers[k](&h, motion, &r->peer[k], r->words[k]);
    else
        (void)snprintf(r->words[k], sizeof r->words[k], "%s", h.words);
    kt_hard_close(&h);
}

static bool holds(const kt_hard *h, int m) { return h->observed[m] <= h->c->measures[m].bound; }

/* The cell of measure m for a peer. */
static const char *cell(const row *r, int k, int m, char *text) {
    const kt_hard_motion *motion = r->own.c->motion;
    if (!motion || motion->alone || (r->own.c->run && m == 2)) /* a measure that needs two runs */
        return "-";
    if (r->ran[k] && isfinite(r->peer[k].observed[m]))
        (void)snprintf(text, CELL, "%.1e", r->peer[k].observed[m]);
    else
        (void)snprintf(text, CELL, "%.39s", r->ran[k] ? "nan" : r->words[k]);
    return text;
}

static void print_row(const row *r, const options *o) {
    const kt_hard_case *c = r->own.c;
    for (int m = 0; m < KT_HARD_MEASURES && c->measures[m].what; m++) {
        const kt_hard_measure *measure = &c->measures[m];
        char text[PEERS][CELL], what[120];
        (void)snprintf(what, sizeof what, "%s%s%s", measure->what, *measure->unit ? ", " : "", measure->unit);
        const char *mark = holds(&r->own, m) ? "" : " MISSED", *one = cell(r, 0, m, text[0]),
                   *two = cell(r, 1, m, text[1]);
        char number[8];
        (void)snprintf(number, sizeof number, "%d", c->number);
        if (o->markdown)
            printf("| %s | %s | %s | %s | %.1e | %.1e%s | %s | %s |\n", m ? "" : number, m ? "" : c->name,
                   m ? "" : c->why, what, r->own.observed[m], measure->bound, mark, one, two);
        else
            printf("%2s %-34s %-46s %8.1e %8.1e%-7s %-10s %s\n", m ? "" : number, m ? "" : c->name, what,
                   r->own.observed[m], measure->bound, mark, one, two);
    }
    if (!o->markdown && r->own.words[0])
        printf("     (%s)\n", r->own.words);
    (void)fflush(stdout);
}

static void write_row(kt_csv *csv, const row *r) {
    const kt_hard_case *c = r->own.c;
    for (int m = 0; m < KT_HARD_MEASURES && c->measures[m].what; m++) {
        char text[CELL];
        kt_csv_number(csv, c->number);
        kt_csv_text(csv, c->name);
        kt_csv_text(csv, c->why);
        kt_csv_text(csv, c->measures[m].what);
        kt_csv_text(csv, c->measures[m].unit);
        kt_csv_number(csv, r->own.observed[m]);
        kt_csv_number(csv, c->measures[m].bound);
        for (int k = 0; k < PEERS; k++)
            kt_csv_text(csv, cell(r, k, m, text));
        kt_csv_text(csv, r->own.words);
        kt_csv_line(csv);
    }
}

/* Collects the measures that can be compared with another engine. */
static int gather(kt_hard_dots *dots, int count, const row *r) {
    const kt_hard_case *c = r->own.c;
    if (!c->motion || c->motion->alone)
        return count;
    for (int m = 0; m < KT_HARD_MEASURES && c->measures[m].what && count < KT_HARD_DOTS_MAX; m++) {
        const kt_hard_measure *measure = &c->measures[m];
        kt_hard_dots *d = &dots[count];
        *d = (kt_hard_dots){.bound = measure->bound, .value = {r->own.observed[m], (double)NAN, (double)NAN}};
        if (measure->bound <= 0.0 || (c->run && m == 2))
            continue;
        (void)snprintf(d->label, sizeof d->label, "%s: %s%s%s", c->name, measure->what, *measure->unit ? ", " : "",
                       measure->unit);
        for (int k = 0; k < PEERS; k++) {
            if (r->ran[k])
                d->value[k + 1] = r->peer[k].observed[m];
            if (m == 0)
                (void)cell(r, k, m, d->words[k + 1]);
        }
        count++;
    }
    return count;
}

/* ---- motions with impacts, stick and slip ------------------------------------------------------------------------ */

static const char why_hard[] = "it rests, bounces, sticks, slips or lets go";

/* Runs a motion in an engine. The processor time is the least of so many runs. */
static bool run_events(kt_events_engine *engine, const kt_events_problem *p, int times, kt_events_watch *watch) {
    bool good = true;
    double least = (double)INFINITY;
    for (int i = 0; good && i < times; i++) {
        *watch = (kt_events_watch){.problem = p};
        good = engine(watch);
        if (good && !watch->is_seen)
            watch->error = (double)NAN;
        least = fmin(least, watch->seconds);
    }
    watch->seconds = least;
    return good;
}

static void print_events(const kt_events_problem *p, const char (*text)[2][CELL], const char *mark, const options *o) {
    for (int line = 0; line < 2; line++) {
        char bound[CELL] = "";
        if (line == 0)
            (void)snprintf(bound, sizeof bound, "%.1e%s", p->bound, mark);
        const char *what = line == 0 ? p->measured : "processor time, s";
        if (o->markdown)
            printf("| %s | %s | %s | %s | %s | %s | %s | %s |\n", line ? "" : "16", line ? "" : p->name,
                   line ? "" : why_hard, what, text[0][line], bound, text[1][line], text[2][line]);
        else
            printf("%2s %-34s %-46s %8s %8s%7s %-10s %s\n", line ? "" : "16", line ? "" : p->name, what, text[0][line],
                   bound, "", text[1][line], text[2][line]);
    }
    (void)fflush(stdout);
}

static void write_events(kt_csv *csv, const kt_events_problem *p, const char (*text)[2][CELL]) {
    for (int line = 0; line < 2; line++) {
        kt_csv_number(csv, EVENTS);
        kt_csv_text(csv, p->name);
        kt_csv_text(csv, why_hard);
        kt_csv_text(csv, line == 0 ? p->measured : "processor time, s");
        kt_csv_text(csv, "");
        kt_csv_text(csv, text[0][line]);
        kt_csv_number(csv, line == 0 ? p->bound : (double)NAN);
        kt_csv_text(csv, text[1][line]);
        kt_csv_text(csv, text[2][line]);
        kt_csv_text(csv, "");
        kt_csv_line(csv);
    }
}

static const kt_events_problem *const mechanisms[] = {&kt_events_clutch, &kt_events_coin, &kt_events_trebuchet,
                                                      &kt_events_woodpecker, &kt_events_whip};
enum { MOTIONS = KT_EVENTS_COUNT + sizeof mechanisms / sizeof *mechanisms };

/* Returns how many errors of this engine are over their bounds. */
static int compare_events(const options *o, kt_csv *csv) {
    static kt_events_engine *const engines[KT_EVENTS_ENGINES] = {kt_events_kinetree, kt_events_mujoco, kt_events_ode};
    int missed = 0;
    for (int which = 0; which < MOTIONS; which++) {
        char text[KT_EVENTS_ENGINES][2][CELL] = {{"-", "-"}, {"-", "-"}, {"-", "-"}};
        const kt_events_problem *p =
            which < KT_EVENTS_COUNT ? &kt_events_problems[which] : mechanisms[which - KT_EVENTS_COUNT];
        bool held = false;
        (void)p->exact(p, 0, 0.0); /* a reference that is found once, for all times, is not timed */
        for (int k = 0; k < (o->alone ? 1 : KT_EVENTS_ENGINES); k++) {
            kt_events_watch watch;
            const bool good = run_events(p->engine[k] ? p->engine[k] : engines[k], p, o->brief ? 1 : 3, &watch);
            if (good) {
                (void)snprintf(text[k][0], CELL, "%.1e", watch.error);
                (void)snprintf(text[k][1], CELL, "%.1e", watch.seconds);
            } else {
                (void)snprintf(text[k][0], CELL, "%s", watch.words);
            }
            held = held || (k == 0 && good && watch.error <= p->bound);
        }
        missed += !held;
        print_events(p, text, held ? "" : " MISSED", o);
        write_events(csv, p, text);
    }
    return missed;
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

static void head(const options *o) {
    if (o->markdown) {
        printf("| | case | why it is hard | measured | kinetree | bound | %s | %s |\n"
               "|--|--|--|--|--|--|--|--|\n",
               kt_hard_mujoco_version(), kt_hard_ode_version());
        return;
    }
    printf("Hard cases, %s; for comparison %s and %s\nfigures    %s\n\n",
           o->brief ? "as the tests run them" : "in full length", kt_hard_mujoco_version(), kt_hard_ode_version(),
           o->csv ? o->csv : "in this table only (--csv FILE)");
    printf("%2s %-34s %-46s %8s %8s%-7s %-10s %s\n", "", "case", "measured", "kinetree", "bound", "", peer_names[0],
           peer_names[1]);
}

static bool draw(const options *o, const kt_hard_dots *dots, int count) {
    static const char *const names[KT_HARD_ENGINES] = {"Kinetree", "MuJoCo", "ODE"};
    bool fine = true;
    for (int dark = 0; dark < 2; dark++)
        if (o->plot[dark])
            fine = kt_hard_draw(o->plot[dark], dark == 1, dots, count, names) && fine;
    return fine;
}

int main(int argc, char **argv) {
    static kt_hard_dots dots[KT_HARD_DOTS_MAX];
    options o = {.only = 0};
    int missed = 0, count = 0, dot_count = 0;
    kt_csv csv;
    static row r;
    const int status = read_options(argc, argv, &o);
    if (status >= 0)
        return status;
    if (!kt_csv_open(&csv, o.csv, "kind,case,why,measured,unit,kinetree,bound,mujoco,ode,words"))
        return KT_BENCH_FAILED;
    head(&o);
    for (int i = 0; i < kt_hard_count(); i++) {
        const kt_hard_case *c = kt_hard_at(i);
        if (o.only && c->number != o.only)
            continue;
        memset(&r, 0, sizeof r);
        kt_hard_run(&r.own, c, !o.brief);
        for (int k = 0; k < PEERS && !o.alone && c->motion && !c->motion->alone; k++)
            run_peer(&r, k, !o.brief);
        for (int m = 0; m < KT_HARD_MEASURES && c->measures[m].what; m++, count++)
            missed += !holds(&r.own, m);
        print_row(&r, &o);
        write_row(&csv, &r);
        dot_count = gather(dots, dot_count, &r);
    }
    if (o.only == 0 || o.only == EVENTS) {
        missed += compare_events(&o, &csv);
        count += MOTIONS;
    }
    if (!o.markdown)
        printf("\n%d measures, %d over their bounds\n", count, missed);
    const bool drawn = draw(&o, dots, dot_count);
    return !kt_csv_close(&csv) || !drawn ? KT_BENCH_FAILED : missed ? KT_BENCH_MISSED : KT_BENCH_DONE;
}
