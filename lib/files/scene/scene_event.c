/* Events: their conditions and their actions.
 *
 *     events: [{name: let go, when: "position.arm - 2.3", direction: rising, then: [{release: sling}, {call: tell}]}]
 *     simulate: {until: "marker.ball.centre.y < 0"}
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_event.h"

#include "scene/assignment.h"
#include "scene/foothold.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"
#include "scene/scene_response.h"
#include "scene/vary.h"

#include "base/names.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* The names that a formula of the file may use, for its check and for suggestions. */
static bool find_event_symbol(void *user, const char *name, kt_symbol *symbol) {
    const kt_reader *r = user;
    kt_variable variable;
    *symbol = (kt_symbol){.index = 0};
    return kt_variable_find(r->scene->description, name, &variable) ||
           kt_response_is_named(r->scene->description, name);
}

static const char *list_event_symbol(void *user, int k) {
    kt_reader *r = user;
    kt_variable variable;
    char text[KT_EXPRESSION_NAME_MAX + 1];
    int count = 0;
    r->effort -= 1000;
    if (r->effort <= 0)
        return NULL;
    if (kt_variable_at(r->scene->description, k, &variable))
        return kt_variable_text(r, &variable);
    while (kt_variable_at(r->scene->description, count, &variable))
        count++;
    r->effort -= 50 * (int64_t)count;
    if (!kt_response_name(r->scene->description, k - count, text, sizeof text))
        return NULL;
    return kt_pool_text(&r->scratch, text, strlen(text));
}

static bool read_event_formula(kt_reader *r, const kt_scope *scope, kt_node *node, const char **out) {
    const kt_symbols symbols = {.find = find_event_symbol, .list = list_event_symbol, .user = r};
    if (node->kind != KT_NODE_TEXT || node->count == 0)
        return kt_fault_expected(r, scope, node, "a formula (\"position.arm - 2.3\")");
    if (!kt_variables_are_known(r)) {
        node->faulty = true; /* a fault of the bodies or states has been reported */
        return false;
    }
    return kt_read_formula(r, scope, node, &symbols, true, out) && kt_check_crossing(r, scope, node, &symbols);
}

static bool read_when(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const char **out = kt_field_in(object, field);
    return read_event_formula(r, scope, node, out);
}

static const kt_kind kind_when = {.read = read_when, .write = kt_text_write};

/* ---- what is done ------------------------------------------------------------------------------------------------ */

static const char actions_expected[] =
    "an action: stop, record, {set: {NAME: VALUE}} of parameters, {release: NAME} or {engage: NAME} of a loop or an "
    "effect, {engage_here: NAME} of a loop, or {call: NAME} for one of the program's own";

static int find_effect(const kt_description *d, const char *name) {
    for (int i = 0; i < d->effect_count; i++)
        if (d->effects[i].name != NULL && strcmp(d->effects[i].name, name) == 0)
            return i;
    return -1;
}

/* The name of a loop or of an effect. */
static bool check_switched(kt_reader *r, const kt_scope *scope, kt_node *node, const char *name) {
    const kt_description *d = r->scene->description;
    if (!kt_names_are_known(r) || kt_node_has_stray(r->root) || kt_node_is_faulty(kt_node_find(r->root, "loops")) ||
        kt_node_is_faulty(kt_node_find(r->root, "effects")))
        return true; /* names of some loops or effects could not be read */
    for (int i = 0; i < d->loop_count + d->effect_count; i++) {
        const char *other = i < d->loop_count ? d->loops[i].name : d->effects[i - d->loop_count].name;
        if (other != NULL && !kt_name_is_valid(other))
            return true; /* which the check will report */
    }
    const bool is_loop = kt_find_loop(d, name) >= 0, is_effect = find_effect(d, name) >= 0;
    kt_nearest near = kt_nearest_make(name, &r->effort);
    if (is_loop != is_effect)
        return true;
    if (is_loop)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is a loop and an effect; give one another name",
                           kt_name_quote(name).text);
    for (int i = 0; i < d->loop_count; i++)
        (void)kt_nearest_try(&near, d->loops[i].name);
    for (int i = 0; i < d->effect_count; i++)
        (void)kt_nearest_try(&near, d->effects[i].name);
    if (near.best != NULL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "there is no loop or effect %s; did you mean %s?",
                           kt_name_quote(name).text, kt_name_quote(near.best).text);
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "there is no loop or effect %s", kt_name_quote(name).text);
}

/* The contents of a `then`: names of calls, switches, and assignments. */
typedef struct actions_read {
    const char **calls;
    kt_scene_switch *switches;
    kt_scene_set *sets;
} actions_read;

bool kt_event_value_read(kt_reader *r, const kt_scope *scope, kt_node *node, bool may_turn, const char **value) {
    kt_node *inner = kt_pool_take(&r->scratch, 1, sizeof *inner);
    const kt_symbols symbols = {.find = find_event_symbol, .list = list_event_symbol, .user = r};
    if (node->kind != KT_NODE_TEXT || node->count == 0)
        return kt_fault_expected(r, scope, node, "a number or a formula (\"2*k\")");
    if (inner == NULL)
        return kt_reader_out_of_memory(r);
    *inner = *node;
    kt_varying_note(r, node, NULL); /* of a variable: the formula stays as it was read */
    if (kt_is_expression(node)) {
        inner->of.text++;
        inner->column++;
    }
    const bool good = kt_read_formula(r, scope, inner, &symbols, may_turn, value);
    node->faulty = node->faulty || inner->faulty;
    return good;
}

/* Tries the name of a state or velocity. Only engage_here sets the states of footholds, so that these are left out. */
static void try_settable(const kt_reader *r, kt_nearest *near, const char *name) {
    const kt_nearest before = *near;
    (void)kt_nearest_try(near, name);
    if (near->best != before.best && kt_foothold_named(r, near->best) != NULL)
        *near = before;
}

/* The nearest name that an event can set. */
static kt_phrase did_you_mean(kt_reader *r, const char *name) {
    kt_phrase phrase = {.length = 0};
    kt_nearest near = kt_nearest_make(name, &r->effort);
    kt_variable variable;
    for (int k = 0; kt_variable_at(r->scene->description, k, &variable) && r->effort > 0; k++)
        if (variable.type == KT_VARIABLE_STATE || variable.type == KT_VARIABLE_VELOCITY)
            try_settable(r, &near, kt_variable_text(r, &variable));
    if (near.best != NULL)
        kt_phrase_add(&phrase, "; did you mean '%s'?", near.best);
    return phrase;
}

/* {set: {NAME: VALUE, ...}} of parameters, auxiliary states and velocities. */
static bool read_set(kt_reader *r, const kt_scope *scope, kt_node *map, kt_scene_event *event, const actions_read *to) {
    if (map->kind != KT_NODE_MAP || map->count == 0)
        return kt_fault_expected(r, scope, map, "names of parameters or states and their values ('{k: 200}')");
    for (kt_node *key = map->of.first; key != NULL; key = key->next->next) {
        kt_scene_set *set = &to->sets[event->set_count];
        kt_variable variable;
        if (key->kind != KT_NODE_TEXT)
            return kt_fault_expected(r, scope, key, "the name of a parameter or a state");
        const kt_scope here = {.outer = scope, .key = key->of.text};
        if (!kt_names_are_known(r) || r->scene->parameters_are_hidden || r->scene->hides_parameters)
            return true;
        const bool is_settable = kt_variable_find(r->scene->description, key->of.text, &variable) &&
                                 (variable.type == KT_VARIABLE_STATE || variable.type == KT_VARIABLE_VELOCITY);
        if (!is_settable && kt_is_parameter(r, key->of.text))
            return true; /* whose value has been reported */
        if (!is_settable)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, key,
                               "there is no parameter, state or velocity %s%s; an event sets a name of `parameters` or "
                               "`states`, or velocity.JOINT",
                               kt_name_quote(key->of.text).text, did_you_mean(r, key->of.text).text);
        const char *loop = kt_foothold_named(r, key->of.text);
        if (loop != NULL)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, key,
                               "%s holds the place of the loop %s, which no value moves; use {engage_here: %.60s}",
                               kt_name_quote(key->of.text).text, kt_name_quote(loop).text, loop);
        set->name = kt_pool_text(&r->keep, key->of.text, key->count);
        if (set->name == NULL)
            return kt_reader_out_of_memory(r);
        const bool may_turn = variable.type != KT_VARIABLE_VELOCITY ||
                              kt_joint_quantity(r, key->of.text + strlen("velocity.")) == KT_QUANTITY_ANGLE;
        if (!kt_event_value_read(r, &here, key->next, may_turn, &set->value))
            return false;
        event->set_count++;
    }
    return true;
}

/* Actions: those up to RECORD are words, those from RELEASE on have a name. */
enum { STOP, RECORD, SET, RELEASE, ENGAGE, ENGAGE_HERE, CALL };
static const struct {
    const char *word, *form; /* how it is written */
    const char *expected;    /* its name; NULL: it has none */
} actions[] = {
    [STOP] = {"stop", "'stop'", NULL},
    [RECORD] = {"record", "'record'", NULL},
    [SET] = {"set", "{set: {NAME: VALUE}}", NULL},
    [RELEASE] = {"release", "{release: NAME}", "the name of a loop or an effect"},
    [ENGAGE] = {"engage", "{engage: NAME}", "the name of a loop or an effect"},
    [ENGAGE_HERE] = {"engage_here", "{engage_here: NAME}", "the name of a loop"},
    [CALL] = {"call", "{call: NAME}", "the name of an action of the program"},
};

/* Reports a word or a key that is no action, and names the nearest one. */
static bool reject_action(kt_reader *r, const kt_scope *scope, kt_node *node, const char *word) {
    kt_nearest near = kt_nearest_make(word, &r->effort);
    kt_phrase what = {.length = 0};
    for (int k = 0; k < KT_COUNT_OF(actions); k++)
        (void)kt_nearest_try(&near, actions[k].word);
    for (int k = 0; k < KT_COUNT_OF(actions) && near.best != NULL; k++)
        if (strcmp(near.best, actions[k].word) == 0)
            kt_phrase_add(&what, "did you mean %s? ", actions[k].form);
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is no action; %s%s %s", kt_name_quote(word).text, what.text,
                       near.best != NULL ? "Expected" : "expected", actions_expected);
}

/* The action that is a word alone; -1: none. */
static int find_action_word(const char *text) {
    for (int k = STOP; k <= RECORD; k++)
        if (strcmp(text, actions[k].word) == 0)
            return k;
    return -1;
}

/* {call: NAME}, {release: NAME}, {engage: NAME}, {engage_here: NAME} */
static bool read_named(kt_reader *r, const kt_scope *scope, kt_node *node, kt_scene_event *event,
                       const actions_read *to) {
    kt_node *set = node->count == 1 ? kt_node_find(node, "set") : NULL;
    if (set != NULL) {
        const kt_scope here = {.outer = scope, .key = "set"};
        return read_set(r, &here, set, event, to);
    }
    for (int k = RELEASE; k < KT_COUNT_OF(actions) && node->count == 1; k++) {
        kt_node *name = kt_node_find(node, actions[k].word);
        const kt_scope here = {.outer = scope, .key = actions[k].word};
        const char *text = NULL;
        if (name == NULL)
            continue;
        if (!kt_read_name(r, &here, name, actions[k].expected, &text))
            return false;
        if (k != CALL && !check_switched(r, &here, name, text))
            return false;
        if (k == ENGAGE_HERE && !kt_foothold_check(r, &here, name, text))
            return false;
        if (k == CALL)
            to->calls[event->call_count++] = text;
        else
            to->switches[event->switch_count++] =
                (kt_scene_switch){.name = text, .on = k != RELEASE, .here = k == ENGAGE_HERE};
        return true;
    }
    const kt_node *key = node->count == 1 ? node->of.first : NULL;
    if (key == NULL || key->kind != KT_NODE_TEXT)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected one action in each map: %s", actions_expected);
    const int word = find_action_word(key->of.text);
    if (word >= 0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s takes no value; write the word alone: %s",
                           actions[word].form, actions[word].word);
    return reject_action(r, scope, node, key->of.text);
}

/* The action that is a word; -1 after reporting that there is none. */
static int read_word(kt_reader *r, const kt_scope *scope, kt_node *node) {
    if (node->kind != KT_NODE_TEXT || node->count == 0) {
        (void)kt_fault_expected(r, scope, node, actions_expected);
        return -1;
    }
    const int word = find_action_word(node->of.text);
    if (word < 0)
        (void)reject_action(r, scope, node, node->of.text);
    return word;
}

static void read_action(kt_reader *r, const kt_scope *scope, kt_node *node, kt_scene_event *event,
                        const actions_read *to) {
    if (node->kind == KT_NODE_MAP) {
        (void)read_named(r, scope, node, event, to);
        return;
    }
    const int action = read_word(r, scope, node);
    if (action < 0)
        return;
    bool *flag = action == STOP ? &event->stop : &event->record;
    if (*flag)
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%s' is there already; remove one", actions[action].word);
    *flag = true;
}

/* Room for all that a `then` sets. */
static size_t count_sets(const kt_node *then) {
    size_t count = 1;
    if (then->kind == KT_NODE_MAP) {
        const kt_node *set = kt_node_find(then, "set");
        count += set != NULL && set->kind == KT_NODE_MAP ? set->count : 0;
    }
    for (const kt_node *one = then->kind == KT_NODE_LIST ? then->of.first : NULL; one != NULL; one = one->next)
        count += one->kind == KT_NODE_MAP ? count_sets(one) : 0;
    return count;
}

static bool read_then(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene_event *event = object;
    const bool is_list = node->kind == KT_NODE_LIST;
    const size_t room = is_list ? node->count + 1 : 1;
    const actions_read to = {.calls = kt_pool_take(&r->keep, room, sizeof *to.calls),
                             .switches = kt_pool_take(&r->keep, room, sizeof *to.switches),
                             .sets = kt_pool_take(&r->keep, count_sets(node), sizeof *to.sets)};
    if (to.calls == NULL || to.switches == NULL || to.sets == NULL)
        return kt_reader_out_of_memory(r);
    if (is_list && node->count == 0)
        return kt_fault_expected(r, scope, node, "an action or a list of actions: stop, record, {call: NAME}");
    if (!is_list)
        read_action(r, scope, node, event, &to);
    kt_scope here = {.outer = scope};
    for (kt_node *item = is_list ? node->of.first : NULL; item != NULL; item = item->next, here.index++)
        read_action(r, &here, item, event, &to);
    event->call = event->call_count > 0 ? to.calls : NULL;
    event->switches = event->switch_count > 0 ? to.switches : NULL;
    event->sets = event->set_count > 0 ? to.sets : NULL;
    return !kt_node_is_faulty(node);
}

static void write_event_name(kt_emitter *e, int action, const char *name) {
    kt_emit_map(e, KT_EMIT_FLOW);
    kt_emit_key(e, actions[action].word);
    kt_emit_text(e, name);
    kt_emit_end(e);
}

static void write_set(kt_emitter *e, const kt_scene_event *event) {
    kt_emit_map(e, KT_EMIT_FLOW);
    kt_emit_key(e, "set");
    kt_emit_map(e, KT_EMIT_FLOW);
    for (int i = 0; i < event->set_count; i++) {
        if (strchr(event->sets[i].name, '[') != NULL)
            kt_emit_name(e, event->sets[i].name); /* in quotes */
        else
            kt_emit_key(e, event->sets[i].name);
        kt_emit_text(e, event->sets[i].value);
    }
    kt_emit_end(e);
    kt_emit_end(e);
}

static void write_then(kt_emitter *e, const kt_member *m) {
    const kt_scene_event *event = m->object;
    kt_emit_list(e, KT_EMIT_FLOW);
    if (event->stop)
        kt_emit_word(e, "stop");
    if (event->record)
        kt_emit_word(e, "record");
    if (event->set_count > 0)
        write_set(e, event);
    for (int i = 0; i < event->switch_count; i++)
        write_event_name(e,
                         event->switches[i].here ? ENGAGE_HERE
                         : event->switches[i].on ? ENGAGE
                                                 : RELEASE,
                         event->switches[i].name);
    for (int i = 0; i < event->call_count; i++)
        write_event_name(e, CALL, event->call[i]);
    kt_emit_end(e);
}

static const kt_kind kind_then = {.read = read_then, .write = write_then};

/* ---- one event --------------------------------------------------------------------------------------------------- */

static const char *const direction_names[] = {"either", "rising", "falling"};
static const kt_choice directions = {"events.direction", direction_names, KT_COUNT_OF(direction_names), 0, NULL};

static bool read_event_limit(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    double value;
    if (!kt_read_number(r, scope, node, KT_QUANTITY_POSITIVE, &value))
        return false;
    if (value != (double)(int)value)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%.40s' must be a whole number", node->of.text);
    *(int *)kt_field_in(object, field) = (int)value;
    return true;
}

static void write_event_limit(kt_emitter *e, const kt_member *m) {
    kt_emit_integer(e, *(const int *)kt_member_value(m));
}

static const kt_kind kind_limit = {.read = read_event_limit, .write = write_event_limit, .size = sizeof(int)};

#define AT(member) .offset = offsetof(kt_scene_event, member)
static const kt_field event_fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name), .flags = KT_FIELD_REQUIRED},
    {.key = "when", .kind = &kind_when, AT(when), .flags = KT_FIELD_REQUIRED},
    {.key = "direction", .kind = &kt_kind_choice, AT(direction), .detail = &directions},
    {.key = "then", .kind = &kind_then, .flags = KT_FIELD_REQUIRED},
    {.key = "limit", .kind = &kind_limit, AT(limit)},
};
static const kt_table event_table = {.fields = event_fields, .count = KT_COUNT_OF(event_fields), .flow = true};

/* A comparison begins to hold in one direction only. */
static void check_direction(kt_reader *r, const kt_scope *scope, kt_node *node, kt_scene_event *event) {
    kt_node *given = kt_node_find(node, "direction");
    if (event->when == NULL || !kt_formula_is_comparison(r->scene->description, event->when))
        return;
    if (given != NULL && event->direction != KT_DIRECTION_RISING)
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, given,
                          "'when' is a comparison, and the event is that it becomes true; leave out 'direction', or "
                          "write a difference in 'when'");
    event->direction = KT_DIRECTION_RISING;
}

static void check_event_names(kt_reader *r, const kt_scope *scope, kt_node **nodes, const kt_scene_event *events,
                              int k) {
    if (events[k].name == NULL)
        return;
    for (int i = 0; i < k; i++)
        if (events[i].name != NULL && strcmp(events[i].name, events[k].name) == 0) {
            (void)kt_fault_at(r, KT_ERROR_SCENE, scope, nodes[k], "there is an event of this name already, in line %u",
                              (unsigned)nodes[i]->line);
            return;
        }
}

/* Loops and effects that an event releases or engages are switched. If their item gives no initial state, they begin
 * on. */
static void mark_switches(kt_scene *scene, const kt_scene_event *event) {
    for (int i = 0; i < event->switch_count; i++) {
        const int loop = kt_find_loop(&scene->description, event->switches[i].name);
        const int effect = find_effect(&scene->description, event->switches[i].name);
        kt_switching *switching = NULL;
        if (loop >= 0) /* these arrays are the scene's own */
            switching = &((kt_loop *)(uintptr_t)scene->description.loops)[loop].switching;
        else if (effect >= 0)
            switching = &((kt_effect *)(uintptr_t)scene->description.effects)[effect].switching;
        if (switching != NULL && *switching == KT_ALWAYS_ON)
            *switching = KT_SWITCHED_ON;
    }
}

/* Names are compared with each other: a scene has few events. */
enum { EVENT_COUNT_MAX = 1000 };

static void read_event(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    kt_scene_event *event = (kt_scene_event *)item->items + item->index;
    if (kt_table_read(r, scope, item->nodes[item->index], &event_table, event))
        check_direction(r, scope, item->nodes[item->index], event);
    mark_switches(item->object, event);
    check_event_names(r, scope, item->nodes, item->items, item->index);
}

static void write_event(kt_emitter *e, const void *item, int index) {
    static const kt_scene_event rest = {.name = NULL};
    (void)index;
    kt_table_write(e, &event_table, item, &rest);
}

const kt_items kt_event_items = {.expected = "a list of events ('- {name: ..., when: ..., then: ...}')",
                                 .noun = "event",
                                 .section = "events",
                                 .most = EVENT_COUNT_MAX,
                                 .size = sizeof(kt_scene_event),
                                 .array = offsetof(kt_scene, events),
                                 .count = offsetof(kt_scene, event_count),
                                 .read = read_event,
                                 .write = write_event};

static void write_events(kt_emitter *e, const kt_member *m) {
    const kt_assigned_number *number;
    for (size_t k = 0; (number = kt_assignments_next(m->object, &k)) != NULL;)
        if (number->parameter < 0 || !kt_assignments_parameter(m->object, number->parameter).is_set) {
            kt_emit_reject(e, KT_ERROR_UNSUPPORTED,
                           "events of this scene set parameters from which other numbers follow; a written scene has "
                           "numbers in place of parameters, so that its events could not set them");
            break;
        }
    kt_items_write(e, m);
}

const kt_kind kt_kind_events = {.read = kt_items_read, .write = write_events, .same = kt_items_same};

/* ---- until ------------------------------------------------------------------------------------------------------- */

/* A comparison becomes true when it rises; other formulas end the run at any change of sign. */
static bool read_until(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    const char *when = NULL;
    if (!read_event_formula(r, scope, node, &when))
        return false;
    scene->until = (kt_scene_event){
        .name = "until",
        .when = when,
        .direction = kt_formula_is_comparison(r->scene->description, when) ? KT_DIRECTION_RISING : KT_DIRECTION_EITHER,
        .stop = true};
    return true;
}

const kt_kind kt_kind_until = {.read = read_until, .write = kt_text_write, .size = sizeof(char *)};
