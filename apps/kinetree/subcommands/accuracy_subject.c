/* accuracy --of: the errors that a study is about. They are those of positions, of velocities, or of a column of the
 * records. A column is an own column of the scene, or any quantity that `output.columns` may name. It is evaluated as
 * the formula of an own column. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/accuracy.h"

#include <stdio.h>
#include <string.h>

static double evaluate_subject(const kt_record *record, void *user) {
    kt_study_subject *subject = user;
    return kt_columns_evaluate(&subject->columns, record)[subject->columns.count - 1];
}

/* Returns the own column of this name; NULL: the scene has none. */
static const kt_scene_column *find_own_column(const kt_scene *scene, const char *name) {
    for (int k = 0; k < scene->column_count; k++)
        if (strcmp(scene->columns[k].name, name) == 0)
            return &scene->columns[k];
    return NULL;
}

/* Writes the unit of a recorded quantity; "": it has none, or the name is a formula. */
static bool find_unit(const kt_scene *scene, const kt_model *model, const char *name, char *unit, size_t size) {
    kt_columns all = {0};
    const bool fine = kt_columns_list_all(&all, scene, model);
    const size_t at = fine ? kt_columns_find(&all, name, 0) : 0;
    const char *known = fine && at < all.count ? kt_column_quantity(&all, at).unit : NULL;
    (void)snprintf(unit, size, "%s", known != NULL ? known : "");
    kt_columns_free(&all);
    return fine;
}

/* The names of columns in files of records end with a unit: "effect.tyre.force [N]". */
static void remove_unit(char *name) {
    char *bracket = strstr(name, " [");
    if (bracket != NULL && name[strlen(name) - 1] == ']')
        *bracket = '\0';
}

static int open_column(kt_study_subject *subject, const char *name, const kt_scene *scene, const kt_model *model) {
    static const kt_run none;
    const kt_scene_column *own = find_own_column(scene, name);
    kt_error error = {0};
    (void)snprintf(subject->name, sizeof subject->name, "%s", name);
    if (own == NULL)
        remove_unit(subject->name);
    subject->column = (kt_scene_column){.name = subject->name, .formula = own != NULL ? own->formula : subject->name};
    subject->scene = *scene;
    subject->scene.columns = &subject->column;
    subject->scene.column_count = 1;
    bool fine = kt_columns_list(&subject->columns, &subject->scene, model, &none, 0U);
    if (own != NULL)
        (void)snprintf(subject->unit, sizeof subject->unit, "%s", own->unit != NULL ? own->unit : "");
    else
        fine = fine && find_unit(scene, model, subject->name, subject->unit, sizeof subject->unit);
    if (!fine)
        return kt_say_no_memory("the column");
    if (kt_columns_add_own(&subject->columns, &subject->scene, &subject->quantity.record, &error) != KT_OK)
        return kt_reject(KT_EXIT_SCENE,
                         "accuracy: --of %s: %s; --of takes 'position', 'velocity', or a column that output.columns "
                         "may name",
                         kt_show(name).text, kt_show(error.message).text);
    subject->quantity.evaluate = evaluate_subject;
    subject->quantity.user = subject;
    return -1;
}

int kt_study_subject_open(kt_study_subject *subject, const char *of, const kt_scene *scene, const kt_model *model) {
    *subject = (kt_study_subject){.of = KT_ACCURACY_POSITIONS};
    if (of == NULL || strcmp(of, "position") == 0)
        return -1;
    subject->of = strcmp(of, "velocity") == 0 ? KT_ACCURACY_VELOCITIES : KT_ACCURACY_QUANTITY;
    return subject->of == KT_ACCURACY_VELOCITIES ? -1 : open_column(subject, of, scene, model);
}

void kt_study_subject_close(kt_study_subject *subject) { kt_columns_free(&subject->columns); }

const char *kt_findings_unit(const kt_findings *findings) {
    const bool is_length = findings->results->unit == KT_ACCURACY_METRE;
    switch (findings->results->subject) {
    case KT_ACCURACY_VELOCITIES:
        return is_length ? "m/s" : "rad/s";
    case KT_ACCURACY_QUANTITY:
        return findings->subject->unit;
    default:
        return is_length ? "m" : "rad";
    }
}

void kt_findings_title(const kt_findings *findings, char *text, size_t size) {
    switch (findings->results->subject) {
    case KT_ACCURACY_VELOCITIES:
        (void)snprintf(text, size, "Velocity error");
        break;
    case KT_ACCURACY_QUANTITY:
        (void)snprintf(text, size, "Error of %.160s", findings->subject->name);
        break;
    default:
        (void)snprintf(text, size, "Position error");
        break;
    }
}
