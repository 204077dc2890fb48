/* Parameters: numbers with names, each a number or an expression of the others, in any order.
 *
 * All expressions are read first; then each is evaluated as soon as all that it uses are (Kahn 1962, Communications of
 * the ACM 5: topological sorting). The remaining parameters depend on themselves, or on a parameter that does.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_parameter.h"

#include "document/number.h"
#include "expression/expression.h"
#include "scene/assignment.h"
#include "scene/named.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"
#include "scene/vary.h"

#include <math.h>
#include <string.h>

/* ---- the section ------------------------------------------------------------------------------------------------- */

static void check_name(kt_reader *r, const kt_scope *outer, int k) {
    kt_named_number *parameter = &r->scene->parameters[k];
    if (!kt_name_is_valid(parameter->name) || strchr(parameter->name, '-') != NULL)
        (void)kt_fault_at(r, KT_ERROR_SCENE, outer, parameter->key,
                          "%s is no name of a parameter; take letters, digits and _, and begin with a letter or _",
                          kt_name_quote(parameter->name).text);
    else if (kt_is_reserved(parameter->name))
        (void)kt_fault_at(r, KT_ERROR_SCENE, outer, parameter->key,
                          "'%s' has a meaning of its own in expressions; take another name", parameter->name);
    else if (kt_is_named(r, parameter->name))
        (void)kt_fault_at(r, KT_ERROR_SCENE, outer, parameter->key,
                          "'%s' is one of `expressions`, too; take another name for one of them", parameter->name);
    const int first = kt_names_add(&r->scene->parameter_names, 0, parameter->name, k);
    if (first >= 0)
        (void)kt_fault_at(r, KT_ERROR_SCENE, outer, parameter->key,
                          "the parameter '%s' is there already, in line %u; remove one of them", parameter->name,
                          (unsigned)r->scene->parameters[first].key->line);
}

static bool list_parameters(kt_reader *r, const kt_scope *scope, kt_node *map) {
    const size_t count = map->count;
    void *slots = kt_pool_take(&r->scratch, kt_names_size(count), 1);
    r->scene->parameters = kt_pool_take(&r->scratch, count + 1, sizeof *r->scene->parameters);
    r->scene->parameter_values =
        kt_pool_take(r->scene->varying != NULL ? &r->keep : &r->scratch, count + 1, sizeof *r->scene->parameter_values);
    if (slots == NULL || r->scene->parameters == NULL || r->scene->parameter_values == NULL)
        return kt_reader_out_of_memory(r);
    kt_names_init(&r->scene->parameter_names, count, slots);
    for (kt_node *key = map->of.first; key != NULL; key = key->next->next) {
        if (key->kind != KT_NODE_TEXT)
            (void)kt_fault_expected(r, scope, key, "the name of a parameter");
        if (key->kind != KT_NODE_TEXT || key->faulty)
            continue;
        r->scene->parameters[r->scene->parameter_count] =
            (kt_named_number){.name = key->of.text, .key = key, .node = key->next, .value = (double)NAN};
        r->scene->parameters[r->scene->parameter_count].is_set = kt_is_assigned(r, key->of.text);
        r->scene->parameter_values[r->scene->parameter_count] = (double)NAN;
        check_name(r, scope, r->scene->parameter_count++);
    }
    return true;
}

/* A parameter is assigned if an event sets it, or a parameter from which it follows. */
static void put_value(kt_reader *r, kt_named_number *parameter, double value) {
    parameter->value = value;
    parameter->is_known = true;
    r->scene->parameter_values[parameter - r->scene->parameters] = value;
    parameter->varies = parameter->node->follows;
    parameter->is_assigned = parameter->is_set;
    for (size_t i = 0; parameter->expression != NULL && i < parameter->expression->count; i++) {
        const kt_expression_term *term = &parameter->expression->term[i];
        if (term->code == KT_OPERATOR_SYMBOL)
            parameter->is_assigned = parameter->is_assigned || r->scene->parameters[term->symbol].is_assigned;
    }
    (void)kt_number_follows(r, parameter->node, false, &r->scene->parameter_values[parameter - r->scene->parameters]);
}

/* A number or an angle; its text decides between the two. */
static void read_plain(kt_reader *r, const kt_scope *scope, kt_named_number *parameter) {
    double value = 0.0;
    if (parameter->node->kind == KT_NODE_TEXT)
        parameter->is_angle = kt_scalar_classify(parameter->node->of.text, &value) == KT_SCALAR_ANGLE;
    if (kt_read_number(r, scope, parameter->node, parameter->is_angle ? KT_QUANTITY_ANGLE : KT_QUANTITY_NUMBER, &value))
        put_value(r, parameter, value);
}

/* ---- the order of evaluation ------------------------------------------------------------------------------------- */

/* Uses in both directions. The parameters that expression k uses are uses[parameter.use + i]. The expressions that use
 * parameter k are users[first_user[k]] to users[first_user[k + 1] - 1]. */
typedef struct kt_uses {
    int *uses, *users;
    size_t *first_user;
} kt_uses;

/* Uses of parameter k begin at its `use`; its users are users[first_user[k]] to users[first_user[k + 1] - 1], by
 * counting. */
static bool list_uses(kt_reader *r, kt_uses *u) {
    const int count = r->scene->parameter_count;
    size_t total = 0;
    for (int k = 0; k < count; k++) {
        kt_named_number *parameter = &r->scene->parameters[k];
        parameter->use = total;
        if (parameter->expression != NULL)
            parameter->use_count = (int)kt_expression_symbols(parameter->expression, 0, NULL);
        total += (size_t)parameter->use_count;
    }
    u->uses = kt_pool_take(&r->scratch, total + 1, sizeof *u->uses);
    u->users = kt_pool_take(&r->scratch, total + 1, sizeof *u->users);
    u->first_user = kt_pool_take(&r->scratch, (size_t)count + 2, sizeof *u->first_user);
    if (u->uses == NULL || u->users == NULL || u->first_user == NULL)
        return kt_reader_out_of_memory(r);
    for (int k = 0; k < count; k++)
        if (r->scene->parameters[k].expression != NULL)
            (void)kt_expression_symbols(r->scene->parameters[k].expression, (size_t)r->scene->parameters[k].use_count,
                                        u->uses + r->scene->parameters[k].use);
    for (size_t i = 0; i < total; i++)
        u->first_user[u->uses[i] + 2]++;
    for (int k = 0; k < count; k++)
        u->first_user[k + 2] += u->first_user[k + 1];
    for (int k = 0; k < count; k++)
        for (int i = 0; i < r->scene->parameters[k].use_count; i++)
            u->users[u->first_user[u->uses[r->scene->parameters[k].use + (size_t)i] + 1]++] = k;
    return true;
}

/* Evaluates a parameter whose expression is computable. */
static void compute_parameter(kt_reader *r, const kt_scope *outer, kt_named_number *parameter) {
    const kt_scope scope = {.outer = outer, .key = parameter->name};
    double value = 0.0;
    if (parameter->expression != NULL &&
        kt_expression_value(r, &scope, parameter->node, parameter->expression, &value)) {
        kt_varying_note(r, parameter->node, parameter->expression);
        put_value(r, parameter, value);
    }
}

/* Reads an expression with its unit, which follows from the units of its parameters: it is read again once these have
 * values. */
static void read_with_unit(kt_reader *r, const kt_scope *outer, kt_named_number *parameter) {
    const kt_scope scope = {.outer = outer, .key = parameter->name};
    parameter->expression = kt_expression_of_node(r, &scope, parameter->node);
    parameter->is_angle = parameter->expression != NULL && kt_expression_is_angle(parameter->expression);
}

/* Computes each parameter after all that it uses (Kahn's topological sort). Parameters on a circle are never reached.
 */
static void compute_all(kt_reader *r, const kt_scope *scope, const kt_uses *u) {
    const int count = r->scene->parameter_count;
    int *computable = kt_reader_take(r, &r->scratch, (size_t)count + 1, sizeof *computable), computable_count = 0;
    if (computable == NULL)
        return;
    for (int k = 0; k < count; k++) {
        r->scene->parameters[k].missing = r->scene->parameters[k].use_count;
        if (r->scene->parameters[k].missing == 0)
            computable[computable_count++] = k;
    }
    for (int i = 0; i < computable_count; i++) {
        kt_named_number *parameter = &r->scene->parameters[computable[i]];
        if (parameter->use_count > 0)
            read_with_unit(r, scope, parameter);
        if (!parameter->is_known)
            compute_parameter(r, scope, parameter);
        if (!parameter->is_known)
            continue; /* its fault has been reported; parameters that use it are left out */
        for (size_t j = u->first_user[computable[i]]; j < u->first_user[computable[i] + 1]; j++)
            if (--r->scene->parameters[u->users[j]].missing == 0)
                computable[computable_count++] = u->users[j];
    }
}

/* ---- circles ----------------------------------------------------------------------------------------------------- */

/* Whether a parameter waits for others, none of which is faulty by itself. */
static bool is_waiting(const kt_named_number *parameter) {
    return !parameter->is_known && parameter->expression != NULL && !kt_node_is_faulty(parameter->node);
}

/* The first parameter that an expression waits for; -1: none. */
static int next_waiting(const kt_reader *r, const kt_uses *u, int k) {
    const kt_named_number *parameter = &r->scene->parameters[k];
    for (int i = 0; i < parameter->use_count; i++)
        if (is_waiting(&r->scene->parameters[u->uses[parameter->use + (size_t)i]]))
            return u->uses[parameter->use + (size_t)i];
    return -1;
}

/* Reports a circle at its parameter `first`. */
static void report_circle(kt_reader *r, const kt_scope *outer, const kt_uses *u, int first) {
    const kt_scope scope = {.outer = outer, .key = r->scene->parameters[first].name};
    kt_phrase phrase = {.length = 0};
    int k = first, shown = 0;
    do {
        if (shown++ < 8)
            kt_phrase_add(&phrase, "%s -> ", r->scene->parameters[k].name);
        k = next_waiting(r, u, k);
    } while (k != first);
    kt_phrase_add(&phrase, "%s%s", shown > 8 ? "... -> " : "", r->scene->parameters[first].name);
    (void)kt_fault_at(r, KT_ERROR_SCENE, &scope, r->scene->parameters[first].node,
                      "the parameter depends on itself: %s; give one of them a number", phrase.text);
}

/* Walks from each parameter along those that it waits for. A walk that comes back to a parameter of its own has found a
 * circle. `missing` is no longer needed, and numbers the walks. */
static void report_circles(kt_reader *r, const kt_scope *scope, const kt_uses *u) {
    for (int k = 0; k < r->scene->parameter_count; k++)
        r->scene->parameters[k].missing = -1;
    for (int walk = 0; walk < r->scene->parameter_count; walk++) {
        int k = walk;
        while (k >= 0 && is_waiting(&r->scene->parameters[k]) && r->scene->parameters[k].missing < 0) {
            r->scene->parameters[k].missing = walk;
            k = next_waiting(r, u, k);
        }
        if (k >= 0 && is_waiting(&r->scene->parameters[k]) && r->scene->parameters[k].missing == walk)
            report_circle(r, scope, u, k);
    }
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

void kt_parameters_read(kt_reader *r) {
    const kt_scope scope = {.key = "parameters"};
    kt_uses uses = {.uses = NULL};
    kt_node *map = kt_node_find(r->root, "parameters");
    if (map == NULL || r->scene->parameters_are_hidden)
        return;
    if (map->kind != KT_NODE_MAP) {
        (void)kt_fault_expected(r, &scope, map, "a mapping of names to numbers (L: 1.2)");
        r->scene->parameters_are_hidden = true;
        return;
    }
    if (!list_parameters(r, &scope, map))
        return;
    r->scene->hides_parameters = r->scene->hides_parameters || kt_node_has_stray(map);
    for (int k = 0; k < r->scene->parameter_count && !r->out_of_memory; k++) {
        kt_named_number *parameter = &r->scene->parameters[k];
        const kt_scope here = {.outer = &scope, .key = parameter->name};
        if (kt_is_expression(parameter->node))
            read_with_unit(r, &scope, parameter);
        else
            read_plain(r, &here, parameter);
    }
    if (r->out_of_memory || !list_uses(r, &uses))
        return;
    compute_all(r, &scope, &uses);
    report_circles(r, &scope, &uses);
    for (int k = 0; k < r->scene->parameter_count; k++) /* from now on: uses by others than parameters */
        r->scene->parameters[k].is_used = false;
}

/* ---- uses -------------------------------------------------------------------------------------------------------- */

/* Marks the parameters that used parameters depend on, and those that any parameter depends on. */
static void follow_parameter_uses(kt_reader *r) {
    const int count = r->scene->parameter_count;
    kt_uses uses = {.uses = NULL};
    int *used = kt_reader_take(r, &r->scratch, (size_t)count + 1, sizeof *used), used_count = 0;
    if (used == NULL || !list_uses(r, &uses))
        return;
    for (int k = 0; k < count; k++) {
        r->scene->parameters[k].is_mentioned = uses.first_user[k + 1] > uses.first_user[k];
        if (r->scene->parameters[k].is_used)
            used[used_count++] = k;
    }
    for (int i = 0; i < used_count; i++) {
        const kt_named_number *parameter = &r->scene->parameters[used[i]];
        for (int j = 0; j < parameter->use_count; j++) {
            const int k = uses.uses[parameter->use + (size_t)j];
            if (!r->scene->parameters[k].is_used)
                used[used_count++] = k;
            r->scene->parameters[k].is_used = true;
        }
    }
}

static void put_note(kt_reader *r, const char *path, uint32_t line, uint32_t column, const char *what,
                     kt_scene_note *note) {
    char where[KT_WHERE_SIZE];
    kt_document_where(where, path, line, column);
    *note = (kt_scene_note){.where = kt_reader_text(r, &r->keep, where, strlen(where)),
                            .what = kt_reader_text(r, &r->keep, what, strlen(what))};
}

/* A formula that was meant to use the parameter has other values. */
static void note_hidden(kt_reader *r, const char *path, const kt_named_number *parameter, kt_scene_note *note) {
    kt_phrase what = {.length = 0};
    kt_phrase_add(&what,
                  "'%s' is a variable of this formula, which hides the parameter '%s'%s; give the parameter "
                  "another name",
                  parameter->name, parameter->name, parameter->is_used ? "" : ", and nothing else uses the parameter");
    const bool is_in_file = parameter->hidden_line < KT_SETTING_LINE;
    put_note(r, path, is_in_file ? parameter->hidden_line : parameter->key->line,
             is_in_file ? parameter->hidden_column : parameter->key->column, what.text, note);
}

static void note_parameter(kt_reader *r, const char *path, const kt_named_number *parameter, kt_scene_note *note) {
    kt_phrase what = {.length = 0};
    kt_phrase_add(&what, "nothing uses the parameter '%s'%s; write =%s where it is meant", parameter->name,
                  parameter->is_mentioned ? " but others that nothing uses" : "", parameter->name);
    put_note(r, path, parameter->key->line, parameter->key->column, what.text, note);
}

static void note_expression(kt_reader *r, const char *path, const kt_node *key, kt_scene_note *note) {
    kt_phrase what = {.length = 0};
    kt_phrase_add(&what, "nothing uses the expression '%.60s'; write its name in a formula, or remove it",
                  key->of.text);
    put_note(r, path, key->line, key->column, what.text, note);
}

static void note_table(kt_reader *r, const char *path, const kt_node *key, kt_scene_note *note) {
    kt_phrase what = {.length = 0};
    kt_phrase_add(&what, "no formula calls the table '%.60s'; write %.60s(x) in a formula, or remove it", key->of.text,
                  key->of.text);
    put_note(r, path, key->line, key->column, what.text, note);
}

static bool is_noted(const kt_named_number *parameter) { return !parameter->is_used || parameter->hidden_line != 0; }

/* A parameter, a table or an expression without a use is noted, since it was probably meant to be used. So is a
 * parameter that a variable of some formula hides. */
static void note_unused(kt_reader *r, const char *path, kt_scene *scene) {
    int count = 0;
    for (int k = 0; k < r->scene->parameter_count; k++)
        count += is_noted(&r->scene->parameters[k]);
    for (int k = 0; kt_expression_unused(r, k) != NULL; k++)
        count++;
    for (int k = 0; k < scene->description.table_count; k++)
        count += !r->scene->table_is_used[k];
    kt_scene_note *notes = count > 0 ? kt_reader_take(r, &r->keep, (size_t)count, sizeof *notes) : NULL;
    if (notes == NULL)
        return;
    for (int k = 0; k < r->scene->parameter_count; k++)
        if (is_noted(&r->scene->parameters[k]))
            (r->scene->parameters[k].hidden_line != 0 ? note_hidden : note_parameter)(r, path, &r->scene->parameters[k],
                                                                                      &notes[scene->note_count++]);
    const kt_node *key;
    for (int k = 0; (key = kt_expression_unused(r, k)) != NULL; k++)
        note_expression(r, path, key, &notes[scene->note_count++]);
    for (int k = 0; k < scene->description.table_count; k++)
        if (!r->scene->table_is_used[k])
            note_table(r, path, r->scene->table_keys[k], &notes[scene->note_count++]);
    scene->notes = notes;
}

static void keep_parameters(kt_reader *r, kt_scene *scene) {
    kt_scene_parameter *parameters = kt_reader_take(r, &r->keep, (size_t)r->scene->parameter_count, sizeof *parameters);
    for (int k = 0; parameters != NULL && k < r->scene->parameter_count; k++) {
        const kt_named_number *from = &r->scene->parameters[k];
        parameters[k] = (kt_scene_parameter){.name = kt_reader_text(r, &r->keep, from->name, strlen(from->name)),
                                             .value = from->value,
                                             .is_set = from->node->line >= KT_SETTING_LINE,
                                             .is_used = from->is_used};
    }
    scene->parameters = parameters;
    scene->parameter_count = r->scene->parameter_count;
}

static void keep_settings(kt_reader *r, const kt_scene_options *options, kt_scene *scene) {
    const int count = options->setting_count;
    const char **settings = kt_reader_take(r, &r->keep, (size_t)count, sizeof *settings);
    for (int k = 0; settings != NULL && k < count; k++)
        settings[k] = kt_reader_text(r, &r->keep, options->settings[k], strlen(options->settings[k]));
    scene->settings = settings;
    scene->setting_count = count;
}

void kt_parameters_finish(kt_reader *r, const char *path, const kt_scene_options *options, kt_scene *scene) {
    if (r->scene->parameter_count > 0) {
        follow_parameter_uses(r);
        keep_parameters(r, scene);
    }
    if (options != NULL && options->setting_count > 0)
        keep_settings(r, options, scene);
    note_unused(r, path, scene);
}
