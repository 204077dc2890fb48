/* The benefit of each form of a constraint group (kt_group_form). Accelerations are timed with the form that the
 * compiler chooses and with the next general one, in turns. Thresholds in lib/mechanics/compile/form.c rest on these
 * ratios.
 *
 * A line is trusted if the group has the form in question, has another one without it, and the accelerations of both
 * agree.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../scaling/bars.h"
#include "kinetree/mechanism.h"
#include "report.h"

#include <math.h>
#include <stdio.h>

static const char about[] = "What each form of a constraint group is worth: accelerations with it and without it, in "
                            "turns.\n";

static const char columns[] = "mechanism,form,instead,ratio," KT_CSV_TIMES "," KT_CSV_ORIGIN;

#define BENCH_FORM_NAME(id, name) [id] = #name,
static const char *const form_name[KT_GROUP_FORM_COUNT] = {KT_GROUP_FORM_LIST(BENCH_FORM_NAME)};

typedef struct subject {
    kt_bars_shape shape;
    int size;
    kt_group_form form;
    bool dense; /* without it: dense matrices, not the next general form */
} subject;

static const subject subjects[] = {
    {KT_BARS_SEPARATE, 1, KT_FORM_PIN, false},
    {KT_BARS_SEPARATE, 10, KT_FORM_PIN, false},
    {KT_BARS_CHAINED, 5, KT_FORM_FRONT4, true},
    {KT_BARS_CHAINED, 10, KT_FORM_FRONT4, true},
    {KT_BARS_CHAINED, 100, KT_FORM_FRONT4, false},
    {KT_BARS_SCISSORS, 10, KT_FORM_FRONT4, true},
    {KT_BARS_SCISSORS, 100, KT_FORM_FRONT4, false},
    {KT_BARS_ROPE, 10, KT_FORM_DELASSUS, false},
    {KT_BARS_ROPE, 100, KT_FORM_DELASSUS, false},
    {KT_BARS_ROPE_IN_SPACE, 10, KT_FORM_DELASSUS, false},
    {KT_BARS_ROPE_OF_BALLS, 4, KT_FORM_DELASSUS, true},
    {KT_BARS_ROPE_OF_BALLS, 9, KT_FORM_DELASSUS, true},
    {KT_BARS_ROPE_OF_BALLS, 100, KT_FORM_DELASSUS, false},
    {KT_BARS_LADDER, 30, KT_FORM_FRONT, true},
    {KT_BARS_LADDER, 60, KT_FORM_FRONT, true},
    {KT_BARS_NET, 20, KT_FORM_FRONT, true},
    {KT_BARS_BENNETT, 20, KT_FORM_FRONT, true},
    {KT_BARS_GRID, 20, KT_FORM_FRONT, true},
    {KT_BARS_SPHERICAL, 20, KT_FORM_FRONT, true},
};

enum { WITH, WITHOUT, WAYS };

/* Two ways of computing one thing differ by rounding; measured: up to 1e-9 of the largest acceleration. */
static const double difference_most = 1e-7;

static double difference(const kt_bars *a, const kt_bars *b) {
    double off = 0.0, most = 0.0;
    for (int i = 0; i < kt_model_nv(a->stepped); i++) {
        off = fmax(off, fabs(a->a[i] - b->a[i]));
        most = fmax(most, fabs(a->a[i]));
    }
    return off / most;
}

static kt_group_form form_of(const kt_bars *bars) { return kt_loop_group_at(bars->stepped, 0).form; }

static bool make(const subject *s, kt_isa isa, int way, kt_bars *bars) {
    kt_model_options options = kt_model_options_default();
    kt_error error;
    options.isa = isa;
    if (way == WITHOUT && s->dense)
        options.structure = KT_STRUCTURE_DENSE;
    else if (way == WITHOUT)
        options.excluded_forms = 1u << s->form;
    if (kt_bars_make(s->shape, s->size, false, KT_FORMULATION_TREE, &options, bars, &error) == KT_OK)
        return true;
    (void)kt_bench_tell(&error);
    return false;
}

static int report(const subject *s, const kt_bars *bars, const kt_bench_times *times, kt_csv *csv) {
    const kt_bench_ratio ratio = kt_bench_compare(&times[WITHOUT], &times[WITH]);
    const kt_group_form form = form_of(&bars[WITH]), instead = form_of(&bars[WITHOUT]);
    const double off = difference(&bars[WITH], &bars[WITHOUT]);
    const bool trusted = form == s->form && instead != form && off <= difference_most;
    char name[64];
    snprintf(name, sizeof name, "%s, %d", kt_bars_shape_name[s->shape], s->size);
    printf("%24s |%9s%9.3f |%9s%9.3f |%7.2f%9.1e%s\n", name, form_name[form], 1e6 * times[WITH].low, form_name[instead],
           1e6 * times[WITHOUT].low, ratio.median, off, trusted ? "" : "  NOT TO BE TRUSTED");
    (void)fflush(stdout);
    for (int way = 0; way < WAYS; way++) {
        kt_csv_text(csv, name);
        kt_csv_text(csv, form_name[form_of(&bars[way])]);
        kt_csv_text(csv, form_name[form_of(&bars[WAYS - 1 - way])]);
        kt_csv_number(csv, ratio.median);
        kt_csv_times(csv, &times[way]);
        kt_csv_origin(csv, kt_model_isa(bars[way].model));
        kt_csv_line(csv);
    }
    return trusted ? KT_BENCH_DONE : KT_BENCH_FAILED;
}

static int measure(size_t index, const kt_bench_options *options, kt_csv *csv) {
    const subject *s = &subjects[index];
    static kt_bench_times times[WAYS];
    kt_bench_task tasks[WAYS];
    kt_bars bars[WAYS];
    int made = 0, result = KT_BENCH_FAILED;
    while (made < WAYS && make(s, options->isa, made, &bars[made]))
        made++;
    for (int way = 0; way < made; way++) {
        tasks[way] = (kt_bench_task){kt_bars_accelerate, &bars[way]};
        kt_bars_accelerate(&bars[way], 1);
    }
    if (made == WAYS) {
        kt_bench_measure(tasks, WAYS, options->seconds, times);
        result = report(s, bars, times, csv);
    }
    for (int way = 0; way < made; way++)
        kt_bars_free(&bars[way]);
    return result;
}

static void print_head(void) {
    printf("Accelerations, us a call (lower quartile), with a form and without it; how many times as long; difference."
           "\n\n%24s |%9s%9s |%9s%9s |%7s%9s\n",
           "", "form", "us", "instead", "us", "ratio", "apart");
}

int main(int argc, char **argv) {
    static const kt_bench_table table = {
        about, columns, "Forms of constraint groups", print_head, sizeof subjects / sizeof *subjects, measure};
    return kt_bench_run(&table, argc, argv);
}
