/* Events and hard contacts in `kinetree accuracy`: the events of the scene in every run, and the errors of their
 * instants. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/accuracy.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- the events of the scene ------------------------------------------------------------------------------------- */

static kt_status add_scene_events(kt_simulation *simulation, const kt_model *model, void **watch, void *user,
                                  kt_error *error) {
    kt_scene_watch *made = NULL;
    const kt_status status = kt_scene_watch_create(user, model, simulation, NULL, -1, &made, error);
    *watch = made;
    return status;
}

static kt_status restart_scene_events(void *watch, const kt_simulation *simulation, kt_error *error) {
    return kt_scene_watch_sync(watch, simulation, error);
}

static void release_scene_events(void *watch) { kt_scene_watch_free(watch); }

kt_accuracy_events kt_study_events(const kt_scene *scene) {
    return (kt_accuracy_events){.count = kt_scene_event_room(scene),
                                .add = add_scene_events,
                                .restart = kt_scene_needs_settable(scene) ? restart_scene_events : NULL,
                                .release = release_scene_events,
                                .user = (void *)scene};
}

/* ---- tables ------------------------------------------------------------------------------------------------------ */

const char *kt_findings_method(const kt_accuracy_curve *curve) {
    return strcmp(kt_method_family_name(curve->method), "time stepping") == 0 ? KT_STEPS_NAME : curve->method->name;
}

/* Prints the number of instants of each name, in the order of their first ones. */
static void print_counts(const kt_accuracy_results *results) {
    enum { NAMES = 6 };
    int printed = 0;
    for (int i = 0; i < results->instant_count; i++) {
        const char *name = results->instants[i].name;
        int first = 0, count = 0;
        while (strcmp(results->instants[first].name, name) != 0)
            first++;
        if (first < i)
            continue;
        for (int k = i; k < results->instant_count; k++)
            count += strcmp(results->instants[k].name, name) == 0;
        if (printed < NAMES)
            printf("%s %s (%d)", printed > 0 ? "," : "", kt_show(name).text, count);
        printed++;
    }
    if (printed > NAMES)
        printf(" and %d other names", printed - NAMES);
}

void kt_findings_print_instants(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    if (results->instant_count == 0)
        return;
    printf("  instants of events:");
    print_counts(results);
    printf("\n  errors are those outside of windows of +-%.2g s about these instants: %d of %d records are left out\n",
           results->window, results->left_out, results->records + 1);
    if (results->reference != NULL)
        printf("  the instants of the reference and its check differ by %.2g s", results->uncertainty.instant);
    else
        printf("  the instants are those of %s", results->check->name);
    if (results->reference != NULL && results->uncertainty.missed > 0)
        printf(", and %d of them have no partner", results->uncertainty.missed);
    putchar('\n');
}

static void print_instant_error(const kt_findings *findings, const kt_accuracy_curve *curve, double goal) {
    const kt_accuracy_results *results = findings->results;
    const kt_accuracy_point *points = results->points + curve->first;
    const int found = kt_accuracy_best_of(findings->study, points, curve->count, goal);
    char error[32] = "-", missed[32] = "";
    if (found >= 0) {
        const double value = points[found].error.instant, least = results->uncertainty.instant;
        (void)snprintf(error, sizeof error, value > least ? "%.2g" : "<%.2g", value > least ? value : least);
        if (points[found].error.missed > 0)
            (void)snprintf(missed, sizeof missed, "%d", points[found].error.missed);
    }
    printf("  %-10s %6s", error, missed);
}

void kt_findings_print_instant_errors(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    const int goals = findings->arguments->goal_count < 4 ? findings->arguments->goal_count : 4;
    if (results->instant_count == 0)
        return;
    printf("\n  the largest error of the instants of events, s, at these settings\n  %-14s", "");
    for (int g = 0; g < goals; g++)
        printf("  %-8.3g %-8s", findings->arguments->goals[g], kt_findings_unit(findings));
    printf("\n  %-14s", "method");
    for (int g = 0; g < goals; g++)
        printf("  %-10s %6s", "error", "missed");
    putchar('\n');
    for (int i = 0; i < results->curve_count; i++) {
        const kt_accuracy_curve *curve = &results->curves[i];
        if (curve->variant > 0)
            break;
        printf("  %-14s", kt_findings_method(curve));
        for (int g = 0; g < goals; g++)
            print_instant_error(findings, curve, findings->arguments->goals[g]);
        putchar('\n');
    }
    puts("  missed: instants without a partner in the other motion. Instants of one name are compared in their order");
}
