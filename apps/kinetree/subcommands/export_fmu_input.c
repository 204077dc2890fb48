/* Inputs of an FMU by the names of --input: forces and torques in joints, and functions of time of effects and loops.
 *
 * A function that becomes an input is a number in the resource, its value at the time 0. The FMU therefore begins with
 * this value at rest. The first line of the resource names the inputs (signal.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/export_fmu.h"

#include "command.h"
#include "text/list.h"

#include "kinetree/descriptor.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KT_FMU_LISTED = 12 /* names in a message */ };

/* ---- candidates -------------------------------------------------------------------------------------------------- */

/* An effect or a loop of a description. */
typedef struct kt_fmu_owner {
    const void *item;
    const kt_descriptor *type;
    const char *name, *joint;
    bool is_loop;
} kt_fmu_owner;

/* Returns the i-th one: effects, then loops. */
static kt_fmu_owner owner_at(const kt_description *d, int i) {
    if (i < d->effect_count) {
        const kt_effect *effect = &d->effects[i];
        return (kt_fmu_owner){effect, kt_effect_descriptor(effect->type), effect->name, effect->joint, false};
    }
    const kt_loop *loop = &d->loops[i - d->effect_count];
    const char *joint = loop->term_count > 0 ? loop->terms[0].joint : loop->joint;
    return (kt_fmu_owner){loop, kt_loop_descriptor(loop->type), loop->name, joint, true};
}

static const kt_function *owner_function_of(const kt_fmu_owner *owner, const kt_key *key) {
    return (const kt_function *)(const void *)((const char *)owner->item + key->offset);
}

/* Returns the k-th key of an owner that is a function of time; NULL: there are no more. A length of a loop that is not
 * given is a number of the start. */
static const kt_key *function_key(const kt_fmu_owner *owner, int k) {
    for (int i = 0; owner->type != NULL && owner->name != NULL && i < owner->type->key_count; i++) {
        const kt_key *key = &owner->type->keys[i];
        const bool is_function = key->kind == KT_KEY_FUNCTION || key->kind == KT_KEY_FUNCTIONS;
        if (is_function && (!owner->is_loop || owner_function_of(owner, key)->type != KT_FUNCTION_NONE) && k-- == 0)
            return key;
    }
    return NULL;
}

static const char *key_name(const kt_key *key, bool slides) {
    return slides && key->also != NULL ? key->also : key->name;
}

static const char *name_of_joint(const kt_body *body) {
    return body->joint.name != NULL ? body->joint.name : body->name;
}

/* Returns the k-th name that can be an input, in `name`; false: there are no more. */
static bool candidate_at(const kt_description *d, int k, char name[KT_FMU_SIGNAL_NAME]) {
    for (int i = 0; i < d->body_count; i++)
        if (d->bodies[i].joint.type != KT_JOINT_FIXED && k-- == 0)
            return snprintf(name, KT_FMU_SIGNAL_NAME, "%s", name_of_joint(&d->bodies[i])) > 0;
    for (int i = 0; i < d->effect_count + d->loop_count; i++) {
        const kt_fmu_owner owner = owner_at(d, i);
        const kt_key *key;
        for (int n = 0; (key = function_key(&owner, n)) != NULL; n++)
            if (kt_fmu_signal_size(key) > 0 && k-- == 0)
                return snprintf(name, KT_FMU_SIGNAL_NAME, "%s.%s", owner.name,
                                key_name(key, kt_fmu_joint_slides(d, owner.joint))) > 0;
    }
    return false;
}

/* ---- messages ---------------------------------------------------------------------------------------------------- */

static void list_input_candidates(const kt_description *d) {
    char text[KT_FMU_LISTED * 64] = "", name[KT_FMU_SIGNAL_NAME];
    size_t length = 0;
    int count = 0;
    while (candidate_at(d, count, name)) {
        if (count < KT_FMU_LISTED && length + strlen(name) + 3 < sizeof text)
            length += (size_t)snprintf(text + length, sizeof text - length, "%s%s", count > 0 ? ", " : "", name);
        count++;
    }
    if (count == 0)
        kt_say("export: the scene has no joint, and no function of time with a name");
    else
        kt_say("export: inputs can be %s%s", kt_show(text).text, count > KT_FMU_LISTED ? ", and others" : "");
}

/* Prints why a name is no input. */
static void report_unknown_input(const kt_description *d, const char *word) {
    kt_nearest nearest = kt_nearest_make(word, NULL);
    char names[2][KT_FMU_SIGNAL_NAME]; /* the best one so far, and the one that is tried */
    int free = 0;
    for (int k = 0; candidate_at(d, k, names[free]); k++) {
        (void)kt_nearest_try(&nearest, names[free]);
        free = nearest.best == names[free] ? 1 - free : free;
    }
    kt_say("export: --input names '%s', which is no joint and no function of time of the scene%s", kt_show(word).text,
           kt_ask(&nearest, "", "").text);
    list_input_candidates(d);
}

/* Prints why an effect or a loop is no input. */
static void report_owner(const kt_fmu_owner *owner, const char *word) {
    const char *kind = owner->is_loop ? "loop" : "effect";
    const kt_key *key = function_key(owner, 0), *second = key != NULL ? function_key(owner, 1) : NULL;
    if (second != NULL)
        kt_say("export: --input names the %s '%s', which has several functions; write %s.%s or %s.%s", kind, word, word,
               key->name, word, second->name);
    else if (key != NULL)
        kt_say("export: the %s of '%s' cannot be an input: the body loses it, too; take the force as an input",
               key->name, word);
    else
        kt_say("export: --input names the %s '%s', which has no function of time; %s%s", kind, word,
               owner->joint != NULL && !owner->is_loop ? "its joint can have a force as an input: "
                                                       : "inputs are joints, and functions of effects and loops",
               owner->joint != NULL && !owner->is_loop ? owner->joint : "");
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

/* Whether a word is NAME or NAME.KEY of the function of a key. */
static bool names_function(const char *word, const char *name, const kt_key *key) {
    const size_t length = strlen(name);
    if (strncmp(word, name, length) != 0 || (word[length] != '\0' && word[length] != '.'))
        return false;
    const char *rest = word + length + 1;
    return word[length] == '\0' || strcmp(rest, key->name) == 0 || (key->also != NULL && strcmp(rest, key->also) == 0);
}

/* Makes the input of a function. Returns false after printing an error. */
static bool make_input(const kt_description *d, const kt_fmu_owner *owner, const kt_key *key, kt_fmu_input *input) {
    const kt_function *functions = owner_function_of(owner, key);
    const int count = key->kind == KT_KEY_FUNCTIONS ? 3 : 1;
    *input = (kt_fmu_input){.key = key,
                            .is_loop = owner->is_loop,
                            .slides = kt_fmu_joint_slides(d, owner->joint),
                            .size = kt_fmu_signal_size(key)};
    (void)snprintf(input->of, sizeof input->of, "%s", owner->name);
    (void)snprintf(input->name, sizeof input->name, "%s.%s", owner->name, key_name(key, input->slides));
    for (int k = 0; k < count; k++) {
        kt_error error = {0};
        double now[3] = {0.0};
        if (functions[k].type != KT_FUNCTION_NONE && kt_function_evaluate(&functions[k], 0.0, now, &error) != KT_OK) {
            kt_say_error(&error);
            return false;
        }
        input->start[k] = now[0];
    }
    return true;
}

/* Finds the input of a word. Returns false after printing an error. */
static bool find_input(const kt_description *d, const char *word, kt_fmu_input *input) {
    for (int i = 0; i < d->body_count; i++)
        if (strcmp(name_of_joint(&d->bodies[i]), word) == 0) {
            *input = (kt_fmu_input){.key = NULL};
            (void)snprintf(input->of, sizeof input->of, "%s", word);
            return true;
        }
    for (int i = 0; i < d->effect_count + d->loop_count; i++) {
        const kt_fmu_owner owner = owner_at(d, i);
        const kt_key *key, *found = NULL;
        int count = 0;
        for (int k = 0; (key = function_key(&owner, k)) != NULL; k++)
            if (names_function(word, owner.name, key)) {
                found = key;
                count++;
            }
        if (count == 1 && kt_fmu_signal_size(found) > 0)
            return make_input(d, &owner, found, input);
        if (count > 0 || (owner.name != NULL && strcmp(owner.name, word) == 0)) {
            report_owner(&owner, owner.name);
            return false;
        }
    }
    report_unknown_input(d, word);
    return false;
}

/* Whether an input is in the list already. */
static bool input_is_listed(const kt_fmu_inputs *inputs, const kt_fmu_input *input) {
    for (int k = 0; k < inputs->count; k++)
        if (strcmp(inputs->items[k].of, input->of) == 0 && inputs->items[k].key == input->key &&
            inputs->items[k].is_loop == input->is_loop)
            return true;
    return false;
}

int kt_fmu_find_inputs(const kt_scene *scene, const char *list, kt_fmu_inputs *inputs) {
    char word[KT_FMU_SIGNAL_NAME];
    int count = 1;
    *inputs = (kt_fmu_inputs){.items = NULL};
    for (const char *at = list; at != NULL && *at != '\0'; at++)
        count += *at == ',';
    inputs->items = calloc((size_t)count + 1, sizeof *inputs->items);
    if (inputs->items == NULL)
        return kt_say_no_memory(NULL);
    if (list != NULL && *list == '\0') { /* which inputs are there? */
        report_unknown_input(&scene->description, list);
        return KT_EXIT_USAGE;
    }
    while (kt_list_next(&list, word, sizeof word)) {
        kt_fmu_input input;
        if (!find_input(&scene->description, word, &input))
            return KT_EXIT_USAGE;
        if (input_is_listed(inputs, &input))
            return kt_misuse("export: --input names the input '%s' twice; remove one", kt_show(word).text);
        inputs->items[inputs->count++] = input;
    }
    return KT_EXIT_DONE;
}

void kt_fmu_free_inputs(kt_fmu_inputs *inputs) { free(inputs->items); }

/* ---- the resource ------------------------------------------------------------------------------------------------ */

void kt_fmu_set_input(const kt_fmu_input *input, bool has_other_name, char *setting, size_t size) {
    const char *section = input->is_loop ? "loops" : "effects",
               *key = has_other_name ? input->key->also : input->key->name;
    const double *x = input->start;
    if (input->key->kind == KT_KEY_FUNCTIONS)
        (void)snprintf(setting, size, "%s.%s.%s=[%.17g, %.17g, %.17g]", section, input->of, key, x[0], x[1], x[2]);
    else
        (void)snprintf(setting, size, "%s.%s.%s=%.17g", section, input->of, key, x[0]);
}

void kt_fmu_write_inputs(const kt_fmu_inputs *inputs, FILE *to) {
    int count = 0;
    for (int k = 0; k < inputs->count; k++) {
        const kt_fmu_input *input = &inputs->items[k];
        if (input->key == NULL)
            continue;
        fprintf(to, "%s%s %s.%s", count++ == 0 ? KT_FMU_SIGNALS : KT_FMU_SIGNALS_BETWEEN,
                input->is_loop ? "loop" : "effect", input->of, input->key->name);
    }
    if (count > 0)
        fputc('\n', to);
}
