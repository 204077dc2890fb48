/* Warns of reactions that a run records, or whose value an event or a column reads, and that the model does not
 * determine: redundant loops share them, or a coupling passes the bearing by. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include "kinetree/mechanism.h"
#include "picture/picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Components below this part of the largest reaction are rounding: forces out of the plane of a planar linkage. */
static const double negligible = 1e-9;

enum { NAMES_MOST = 6 }; /* names in a message */

bool kt_shares_begin(kt_shares *shares, const kt_model *model) {
    shares->bodies = (size_t)kt_model_body_count(model);
    shares->loops = (size_t)kt_loop_count(model);
    shares->of = calloc(2 * (shares->bodies + shares->loops) + 1, sizeof *shares->of);
    return shares->of != NULL;
}

void kt_shares_free(kt_shares *shares) {
    free(shares->of);
    shares->of = NULL;
}

/* Contacts and events change the model, and then what it determines. */
void kt_watch_shares(kt_outcome *outcome, const kt_record *record) {
    kt_shares *shares = &outcome->shares;
    kt_data *data = NULL;
    if (shares->of == NULL || record->model == shares->seen)
        return;
    kt_reaction_share *now = shares->of + shares->bodies + shares->loops;
    shares->seen = record->model;
    if (kt_data_create(record->model, &data, NULL) == KT_OK &&
        kt_reaction_shares(record->model, data, record->t, record->q, now, now + shares->bodies, NULL) == KT_OK)
        for (size_t i = 0; i < shares->bodies + shares->loops; i++) {
            shares->of[i].open |= now[i].open;
            shares->of[i].is_too_large |= now[i].is_too_large;
            shares->of[i].length = fmax(shares->of[i].length, now[i].length);
        }
    kt_data_free(data);
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* A list of names in a message. */
typedef struct name_list {
    char text[420];
    size_t count;
} name_list;

static void add_name(name_list *list, const char *name) {
    const size_t used = strlen(list->text);
    if (list->count++ < NAMES_MOST)
        (void)snprintf(list->text + used, sizeof list->text - used, "%s%.60s", used > 0 ? ", " : "", name);
}

static void end_names(name_list *list) {
    const size_t used = strlen(list->text);
    if (list->count > NAMES_MOST)
        (void)snprintf(list->text + used, sizeof list->text - used, " and %zu more", list->count - NAMES_MOST);
}

static const char *const components[] = {"fx", "fy", "fz", "mx", "my", "mz", "multiplier"};

/* Returns whether a formula has this name, as a whole. */
static bool reads_name(const char *formula, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = formula; at != NULL && (at = strstr(at, name)) != NULL; at += length)
        if (strchr("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.", at[length]) == NULL ||
            at[length] == '\0')
            return true;
    return false;
}

/* Returns whether an event or a column of the scene reads this name. */
static bool scene_reads(const kt_scene *scene, const char *name) {
    bool reads = reads_name(scene->until.when, name);
    for (int i = 0; i < scene->event_count && !reads; i++) {
        reads = reads_name(scene->events[i].when, name);
        for (int k = 0; k < scene->events[i].set_count && !reads; k++)
            reads = reads_name(scene->events[i].sets[k].value, name);
    }
    for (int i = 0; i < scene->column_count && !reads; i++)
        reads = reads_name(scene->columns[i].formula, name);
    return reads;
}

static bool is_reaction(kt_column_source source) {
    return source == KT_COLUMN_REACTION || source == KT_COLUMN_LOOP_REACTION || source == KT_COLUMN_BEARING;
}

static double largest_of(const kt_outcome *outcome, size_t column) {
    const kt_extreme *e = &outcome->extremes.column[column];
    return fmax(fabs(e->least), fabs(e->greatest));
}

/* The joint or loop, and the component, of a column of reactions; NULL: another column. */
static const kt_reaction_share *share_of(const kt_outcome *outcome, const kt_column *column, int *component) {
    const kt_shares *shares = &outcome->shares;
    *component = column->source == KT_COLUMN_MULTIPLIER ? 6 : column->component;
    if (column->source == KT_COLUMN_REACTION || column->source == KT_COLUMN_BEARING)
        return &shares->of[column->index];
    const bool relates = column->source == KT_COLUMN_LOOP_REACTION || column->source == KT_COLUMN_MULTIPLIER;
    return relates ? &shares->of[shares->bodies + (size_t)column->index] : NULL;
}

/* Returns the largest force of a recorded reaction. */
static double largest_force(const kt_outcome *outcome) {
    const kt_columns *columns = outcome->columns;
    double largest = 0.0;
    for (size_t i = 0; i < columns->count; i++)
        if (is_reaction(columns->columns[i].source) && columns->columns[i].component < 3)
            largest = fmax(largest, largest_of(outcome, i));
    return largest;
}

/* ---- redundant loops --------------------------------------------------------------------------------------------- */

/* Lists the columns of components that are not unique and not zero. */
static void list_columns(const kt_outcome *outcome, name_list *list, const kt_reaction_share **first) {
    const kt_columns *columns = outcome->columns;
    const double largest = largest_force(outcome);
    int k;
    for (size_t i = 0; i < columns->count; i++) {
        const kt_reaction_share *share = share_of(outcome, &columns->columns[i], &k);
        char name[120];
        if (share == NULL || share->is_too_large || (share->open >> k & 1U) == 0 ||
            !(largest_of(outcome, i) > negligible * largest * (k >= 3 ? share->length : 1.0)))
            continue;
        (void)kt_column_name(columns, i, name, sizeof name);
        add_name(list, name);
        *first = *first != NULL ? *first : share;
    }
}

/* Lists the components that events and columns read. */
static void list_read(const kt_outcome *outcome, name_list *list, const kt_reaction_share **first) {
    const kt_shares *shares = &outcome->shares;
    static const char *const kinds[] = {"reaction", "bearing"};
    for (size_t i = 0; i < shares->bodies + shares->loops; i++)
        for (int k = 0; k < 7; k++)
            for (int kind = 0; kind < 2 && (shares->of[i].open >> k & 1U) != 0 && !shares->of[i].is_too_large; kind++) {
                char name[160];
                const bool joint = i < shares->bodies;
                (void)snprintf(name, sizeof name, "%s.%.100s.%s", kinds[kind],
                               joint ? kt_joint_name(outcome->model, (int)i)
                                     : kt_loop_name(outcome->model, (int)(i - shares->bodies)),
                               components[k]);
                if (!scene_reads(outcome->scene, name) ||
                    kt_columns_find(outcome->columns, name, 0) < outcome->columns->count)
                    continue;
                add_name(list, name);
                *first = *first != NULL ? *first : &shares->of[i];
            }
}

static void warn_of_redundancy(kt_outcome *outcome) {
    name_list list = {.count = 0};
    const kt_reaction_share *first = NULL;
    list_columns(outcome, &list, &first);
    list_read(outcome, &list, &first);
    end_names(&list);
    if (list.count == 0)
        return;
    const kt_warning warning =
        kt_warning_of("shared_reaction", first->length, "m",
                      "Replace a loop by the type that holds only what its bearing holds (`spherical`, `inline`, "
                      "`inplane`), or by a bushing with the stiffness of the bearing");
    kt_warn(&outcome->warnings, &warning,
            "%s %s not unique, since loops repeat what joints and other loops hold. Shown is the least sum of |F|^2 + "
            "|M|^2/L^2 over joints and loops, L = %.4g m, the length of the longest loop once around",
            list.text, list.count > 1 ? "are" : "is", first->length);
}

/* Returns whether an event or a column of the scene reads one of these components of the reaction of a loop; 0: any. */
static bool scene_reads_loop(const kt_outcome *outcome, int loop, unsigned open) {
    for (int k = 0; k < 7; k++) {
        char name[160];
        if (open != 0 && (open >> k & 1U) == 0)
            continue;
        (void)snprintf(name, sizeof name, "reaction.%.100s.%s", kt_loop_name(outcome->model, loop), components[k]);
        if (scene_reads(outcome->scene, name))
            return true;
    }
    return false;
}

/* Returns whether a column has the reaction of a loop. */
static bool records_loop(const kt_outcome *outcome, int loop) {
    const kt_columns *columns = outcome->columns;
    for (size_t i = 0; i < columns->count; i++)
        if ((columns->columns[i].source == KT_COLUMN_LOOP_REACTION ||
             columns->columns[i].source == KT_COLUMN_MULTIPLIER) &&
            columns->columns[i].index == loop)
            return true;
    return false;
}

/* Returns the number of equations that repeat others, in the group of a loop. */
static int repeated_equations(const kt_model *model, int loop) {
    for (int g = 0; g < kt_loop_group_count(model); g++) {
        const kt_loop_group group = kt_loop_group_at(model, g);
        for (int i = 0; i < group.loop_count; i++)
            if (group.loops[i] == loop)
                return group.equations - group.rank;
    }
    return 0;
}

/* Returns whether the reactions of joints may have one of these components, beyond rounding: they are not recorded, or
 * a record shows it. 0: any component. */
static bool may_have_components(const kt_outcome *outcome, const kt_reaction_share *share) {
    const kt_columns *columns = outcome->columns;
    const double largest = largest_force(outcome);
    bool has = share->open == 0, is_recorded = false;
    for (size_t i = 0; i < columns->count && !has; i++) {
        const kt_column *c = &columns->columns[i];
        is_recorded = is_recorded || c->source == KT_COLUMN_REACTION;
        has = is_reaction(c->source) && (share->open >> c->component & 1U) != 0 &&
              largest_of(outcome, i) > negligible * largest * (c->component >= 3 ? share->length : 1.0);
    }
    return has || !is_recorded;
}

/* Returns whether what is recorded or read of a loop, in a group that is too large, is not unique. */
static bool shows_large_group(const kt_outcome *outcome, int loop) {
    const kt_reaction_share *share = &outcome->shares.of[outcome->shares.bodies + (size_t)loop];
    return share->is_too_large && ((records_loop(outcome, loop) && may_have_components(outcome, share)) ||
                                   scene_reads_loop(outcome, loop, share->open));
}

/* Names loops in groups that are too large, if their reactions are recorded or read. */
static void warn_of_large_groups(kt_outcome *outcome) {
    name_list list = {.count = 0};
    int repeated = 0;
    for (size_t i = 0; i < outcome->shares.loops; i++)
        if (shows_large_group(outcome, (int)i)) {
            add_name(&list, kt_loop_name(outcome->model, (int)i));
            const int here = repeated_equations(outcome->model, (int)i);
            repeated = here > repeated ? here : repeated;
        }
    end_names(&list);
    const kt_warning warning =
        kt_warning_of("shared_reaction", (double)repeated, NULL,
                      "Replace loops by types that hold only what their bearings hold (`spherical`, `inline`, "
                      "`inplane`), or some by bushings, so that fewer equations repeat others");
    if (list.count > 0)
        kt_warn(&outcome->warnings, &warning,
                "the reactions of loops %s, and of joints on their paths, are one of many sets that balance: %d "
                "equations of these loops repeat others, which is too many for the least sum of |F|^2 + |M|^2/L^2 to "
                "be found (256 kB of numbers)",
                list.text, repeated);
}

/* ---- couplings --------------------------------------------------------------------------------------------------- */

/* Marks the joints on the path between two joints, and these: they lack the force of a coupling between them. */
static void mark_path(const kt_model *model, int a, int b, bool *lacks) {
    lacks[a] = lacks[b] = true;
    for (; a != b; lacks[a] = lacks[b] = true) {
        if (a > b)
            a = kt_body_parent(model, a);
        else
            b = kt_body_parent(model, b);
        if (a == b)
            return;
    }
}

static void mark_joints(const kt_model *model, const kt_loop *loop, bool *lacks) {
    for (int k = 1; k < loop->term_count; k++)
        mark_path(model, kt_body_of_joint(model, loop->terms[0].joint), kt_body_of_joint(model, loop->terms[k].joint),
                  lacks);
}

/* Returns whether a reaction of the joint is recorded, or an event or a column reads one. */
static bool shows_reaction(const kt_outcome *outcome, int body) {
    const kt_columns *columns = outcome->columns;
    for (size_t i = 0; i < columns->count; i++)
        if ((columns->columns[i].source == KT_COLUMN_REACTION || columns->columns[i].source == KT_COLUMN_BEARING) &&
            columns->columns[i].index == body)
            return true;
    for (int k = 0; k < 6; k++) {
        char name[2][160];
        const char *joint = kt_joint_name(outcome->model, body);
        (void)snprintf(name[0], sizeof name[0], "reaction.%.100s.%s", joint, components[k]);
        (void)snprintf(name[1], sizeof name[1], "bearing.%.100s.%s", joint, components[k]);
        if (scene_reads(outcome->scene, name[0]) || scene_reads(outcome->scene, name[1]))
            return true;
    }
    return false;
}

static void warn_of_couplings(kt_outcome *outcome) {
    const kt_description *d = &outcome->scene->description;
    bool *lacks = calloc(outcome->shares.bodies, sizeof *lacks);
    name_list joints = {.count = 0}, couplings = {.count = 0};
    for (int i = 0; i < d->loop_count && lacks != NULL; i++)
        if (d->loops[i].type == KT_LOOP_COUPLING && d->loops[i].term_count > 1) {
            mark_joints(outcome->model, &d->loops[i], lacks);
            add_name(&couplings, kt_loop_name(outcome->model, i));
        }
    for (size_t i = 1; couplings.count > 0 && i < outcome->shares.bodies; i++)
        if (lacks[i] && shows_reaction(outcome, (int)i))
            add_name(&joints, kt_joint_name(outcome->model, (int)i));
    free(lacks);
    end_names(&joints);
    end_names(&couplings);
    const kt_warning warning =
        kt_warning_of("coupling_bearing", (double)joints.count, NULL,
                      "Use the loop `gear`, `rack`, `worm`, `span` or `belt`, which has this force");
    if (joints.count > 0)
        kt_warn(&outcome->warnings, &warning,
                "the reactions of the joints %s lack the forces of %s: a coupling relates coordinates, has no place, "
                "and loads no bearing",
                joints.text, couplings.text);
}

void kt_warn_of_shares(kt_outcome *outcome) {
    if (outcome->shares.of == NULL || outcome->columns == NULL || outcome->extremes.column == NULL)
        return;
    warn_of_redundancy(outcome);
    warn_of_large_groups(outcome);
    warn_of_couplings(outcome);
}
