/* Reports the parts of a scene that a later initial state does not continue: everything that reads the time, and the
 * counts of events. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "kinetree/effect.h"
#include "open/load.h"

#include <stdio.h>
#include <string.h>

/* Returns whether a formula reads t: the name that consists of this letter alone. */
static bool formula_reads_time(const char *formula) {
    const char *const in_names = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.";
    for (const char *at = formula; at != NULL && *at != '\0';) {
        const size_t length = strspn(at, in_names);
        if (length == 1 && *at == 't')
            return true;
        at += length > 0 ? length : 1;
    }
    return false;
}

static bool has_formulas_of_time(const kt_description *d) {
    for (int i = 0; i < d->effect_count; i++)
        for (int k = 0; k < d->effects[i].actuator_count; k++)
            if (d->effects[i].actuators[k].delay > 0.0)
                return true;
    for (int i = 0; i < d->effect_count; i++)
        for (int k = 0; k < 6; k++)
            if (d->effects[i].type == KT_EFFECT_EXPRESSION && formula_reads_time(d->effects[i].formula[k]))
                return true;
    for (int i = 0; i < d->state_count; i++)
        if (formula_reads_time(d->states[i].rate) ||
            (d->states[i].activation != NULL && d->states[i].activation->delay > 0.0))
            return true;
    return false;
}

static bool varies_with_time(const kt_function *f) {
    return f->type != KT_FUNCTION_NONE && f->type != KT_FUNCTION_CONSTANT;
}

static bool has_functions_of_time(const kt_description *d) {
    for (int i = 0; i < d->loop_count; i++)
        if (varies_with_time(&d->loops[i].function))
            return true;
    for (int i = 0; i < d->effect_count; i++) {
        const kt_effect *e = &d->effects[i];
        const kt_function *all[] = {&e->rest,     &e->torque,   &e->target, &e->value[0],
                                    &e->value[1], &e->value[2], &e->mass};
        for (size_t k = 0; k < sizeof all / sizeof *all; k++)
            if (varies_with_time(all[k]))
                return true;
    }
    return false;
}

/* Returns the first body whose mass is a function of time, or NULL. */
static const kt_body *body_of_variable_mass(const kt_description *d) {
    for (int i = 0; i < d->body_count; i++)
        if (d->bodies[i].variable_mass != NULL)
            return &d->bodies[i];
    return NULL;
}

/* Returns whether `when` of an event, or a value that it sets, reads t. */
static bool event_reads_time(const kt_scene_event *event) {
    bool any = formula_reads_time(event->when);
    for (int i = 0; i < event->set_count; i++)
        any = any || formula_reads_time(event->sets[i].value);
    return any;
}

/* Names of events, "'a', 'b'": at most three, and then "...". */
typedef struct event_names {
    char text[800];
    size_t used;
    int count;
} event_names;

static void append_event_name(event_names *list, const char *name) {
    const int number = list->count++;
    if (number <= 3)
        list->used += (size_t)snprintf(list->text + list->used, sizeof list->text - list->used, "%s%s",
                                       number > 0 ? ", " : "", number < 3 ? kt_name_quote(name).text : "...");
}

static void say_events_anew(const kt_scene *scene, const char *start, const char *source) {
    event_names timed = {.count = 0}, limited = {.count = 0};
    for (int i = 0; i < scene->event_count; i++) {
        if (event_reads_time(&scene->events[i]))
            append_event_name(&timed, scene->events[i].name);
        if (scene->events[i].limit > 0)
            append_event_name(&limited, scene->events[i].name);
    }
    if (formula_reads_time(scene->until.when))
        append_event_name(&timed, "until");
    if (timed.count > 0)
        kt_say("%s: the time in %s begins anew", start, timed.text);
    if (limited.count > 0)
        kt_say("%s has no counts of events: the limit of %s counts from 0", source, limited.text);
}

void kt_say_anew(const kt_scene *scene, const char *start, const char *source) {
    const kt_description *d = &scene->description;
    const kt_body *body = body_of_variable_mass(d);
    if (has_functions_of_time(d) || has_formulas_of_time(d))
        kt_say("%s: functions of time begin anew, and driven joints are moved to their first values", start);
    if (body != NULL)
        kt_say("%s: the mass of %s is a function of time and has its first value again", start,
               kt_name_quote(body->name).text);
    say_events_anew(scene, start, source);
}
