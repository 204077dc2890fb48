/* Assembles the initial state of a scene, and reports the changes that the assembly made. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/start.h"

#include "advice/advice.h"
#include "kinetree/descriptor.h"
#include "picture/picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum {
    LISTED_MAX = 12, /* lines of a list */
    TRIED_MAX = 6,   /* joints for which `hold` is tried */
};

static const double degree = 3.14159265358979323846 / 180.0;

/* ---- changes by the assembly ------------------------------------------------------------------------------------- */

typedef struct part_name {
    unsigned part;
    const char *name;
    bool of_velocity;
    int first, count; /* of the joint's coordinates; count 0: all */
} part_name;

static part_name name_joint_part(kt_joint_type type, unsigned part) {
    const bool is_free = kt_joint_coordinate_kind(type, 0) == KT_COORDINATE_TRANSLATION &&
                         kt_joint_coordinate_kind(type, 3) == KT_COORDINATE_ROTATION;
    switch (part) {
    case KT_GIVEN_POSITION:
        return (part_name){part, "position", false, 0, is_free ? 3 : 0};
    case KT_GIVEN_ORIENTATION:
        return (part_name){part, "orientation", false, is_free ? 3 : 0, 4};
    case KT_GIVEN_ANGULAR:
        return (part_name){part, "angular velocity", true, 3, 3};
    default:
        return (part_name){part, is_free ? "linear velocity" : "velocity", true, 0, is_free ? 3 : 0};
    }
}

typedef struct value_text {
    char text[160];
} value_text;

/* Writes the value of a joint's part: `60 deg`, `0.1 m`, `3 rad/s`, `[0, 1, 2]`. */
static value_text show_value(const kt_model *model, int body, const part_name *part, const double *x) {
    const kt_coordinates at = kt_body_coordinates(model, body);
    const int all = part->of_velocity ? at.nv : at.nq, count = part->count ? part->count : all;
    const bool slides = kt_joint_coordinate_kind(at.type, 0) == KT_COORDINATE_LENGTH;
    value_text value = {""};
    x += (part->of_velocity ? at.v : at.q) + part->first;
    if (count == 1) {
        const bool in_degrees = !slides && !part->of_velocity;
        snprintf(value.text, sizeof value.text, "%.6g %s%s", in_degrees ? x[0] / degree : x[0],
                 in_degrees ? "deg"
                 : slides   ? "m"
                            : "rad",
                 part->of_velocity ? "/s" : "");
        return value;
    }
    size_t used = 0;
    for (int k = 0; k < count; k++)
        used += (size_t)snprintf(value.text + used, sizeof value.text - used, "%s%.6g", k ? ", " : "[", x[k]);
    snprintf(value.text + used, sizeof value.text - used, "]");
    return value;
}

/* Returns the list of changes; NULL if there are none, or memory is insufficient. */
static kt_initial_change *list_initial_changes(const kt_model *model, const double *q, const double *v, int *count) {
    *count = kt_initial_changes(model, q, v, NULL, 0);
    kt_initial_change *changes = *count > 0 ? malloc((size_t)*count * sizeof *changes) : NULL;
    *count = changes != NULL ? kt_initial_changes(model, q, v, changes, *count) : 0;
    return changes;
}

/* Prints the changed joints that `hold` could fix. */
static void say_holdable(kt_trials *trials, const kt_model *model, const kt_initial_change *changes, int count) {
    const char *before = "; 'initial: {hold: [JOINT]}' would keep ";
    int last = 0, tried = 0;
    for (int i = 0; i < count && tried < TRIED_MAX && kt_model_nv(model) <= KT_ADVICE_COORDINATES_MAX; i++) {
        if (changes[i].body == last)
            continue;
        last = changes[i].body;
        tried++;
        if (!kt_closes_holding(trials, -1, kt_joint_name(model, last)))
            continue;
        kt_print("%s%s", before, kt_joint_name(model, last));
        before = " or ";
    }
}

/* Reports free joints in `hold` of which only the position or only the orientation is given, if the other part
 * changed. */
static void say_half_held(const char *path, const kt_scene *scene, const kt_model *model, const double *q) {
    const kt_description *d = &scene->description;
    double *given = d->hold_count > 0 ? kt_given_state(model) : NULL;
    for (int i = 0; i < d->hold_count && given != NULL; i++) {
        const int body = kt_body_of_joint(model, d->hold[i]), source = kt_body_source(model, body);
        const kt_coordinates at = kt_body_coordinates(model, body);
        const unsigned parts = kt_joint_given(&d->bodies[source].joint) & (KT_GIVEN_POSITION | KT_GIVEN_ORIENTATION);
        if (at.type != KT_JOINT_FREE || (parts != KT_GIVEN_POSITION && parts != KT_GIVEN_ORIENTATION))
            continue;
        const bool has_position = parts == KT_GIVEN_POSITION;
        const int first = at.q + (has_position ? 3 : 0), count = has_position ? 4 : 3;
        double change = 0.0;
        for (int k = 0; k < count; k++)
            change = fmax(change, fabs(q[first + k] - given[first + k]));
        if (change > KT_INITIAL_CHANGE_LEAST)
            kt_print("%s%s: 'hold' keeps the part of %s that the scene gives, its %s. Its %s is not given and moved to "
                     "close the loops: give it, and it is kept, too\n",
                     path != NULL ? path : "kinetree", path != NULL ? ": warning" : "", d->hold[i],
                     has_position ? "position" : "orientation", has_position ? "orientation" : "position");
    }
    free(given);
}

const char *kt_start_cause(const kt_model *model, bool is_struck) {
    if (is_struck)
        return "impacts at the start, and assembly where loops were open,";
    if (kt_massless_count(model) == 0)
        return "to close the loops, assembly";
    return kt_loop_count(model) > 0
               ? "to close the loops and to balance the forces on joints that move no mass, assembly"
               : "the balance of forces on joints that move no mass";
}

/* Reports velocities that assembly has chosen, since neither the scene nor its loops determine them. */
static void say_chosen(const char *path, const kt_model *model, const double *v) {
    kt_initial_change chosen[LISTED_MAX];
    const int count = kt_initial_choices(model, v, chosen, LISTED_MAX);
    for (int i = 0; i < count && i < LISTED_MAX; i++) {
        const kt_coordinates at = kt_body_coordinates(model, chosen[i].body);
        const part_name part = name_joint_part(at.type, chosen[i].part);
        if (i == 0)
            kt_print("%s%s: neither the scene nor its loops determine these velocities, and assembly chose the least "
                     "ones; give them, or those of other joints:\n",
                     path != NULL ? path : "kinetree", path != NULL ? ": warning" : "");
        kt_print("  %s: %s %s\n", kt_joint_name(model, chosen[i].body), part.name,
                 show_value(model, chosen[i].body, &part, v).text);
    }
    if (count > LISTED_MAX)
        kt_print("  and %d more\n", count - LISTED_MAX);
}

int kt_start_say_moved(const char *path, const kt_scene *scene, const kt_model *model, const double *q, const double *v,
                       bool is_struck) {
    int count;
    kt_trials trials = {.scene = scene, .usual = kt_trial_work(model)};
    kt_initial_change *changes = list_initial_changes(model, q, v, &count);
    double *given = count > 0 ? kt_given_state(model) : NULL;
    if (given != NULL)
        kt_print("%s%s: %s moved initial values that the scene gives", path != NULL ? path : "kinetree",
                 path != NULL ? ": warning" : "", kt_start_cause(model, is_struck));
    if (given != NULL && kt_loop_count(model) > 0 && !is_struck)
        say_holdable(&trials, model, changes, count);
    if (given != NULL)
        kt_print(":\n");
    for (int i = 0; given != NULL && i < count && i < LISTED_MAX; i++) {
        const int body = changes[i].body;
        const part_name part = name_joint_part(kt_body_coordinates(model, body).type, changes[i].part);
        const double *from = part.of_velocity ? given + kt_model_nq(model) : given, *to = part.of_velocity ? v : q;
        kt_print("  %s: %s from %s to %s\n", kt_joint_name(model, body), part.name,
                 show_value(model, body, &part, from).text, show_value(model, body, &part, to).text);
    }
    if (given != NULL && count > LISTED_MAX)
        kt_print("  and %d more\n", count - LISTED_MAX);
    kt_say_trials_ended(&trials);
    free(given);
    free(changes);
    say_half_held(path, scene, model, q);
    say_chosen(path, model, v);
    return count;
}

json_t *kt_start_moved(const kt_model *model, const double *q, const double *v) {
    json_t *list = json_array();
    int count;
    kt_initial_change *changes = list_initial_changes(model, q, v, &count);
    double *given = kt_given_state(model);
    for (int i = 0; given != NULL && i < count; i++) {
        const kt_coordinates at = kt_body_coordinates(model, changes[i].body);
        const part_name part = name_joint_part(at.type, changes[i].part);
        const int first = (part.of_velocity ? at.v : at.q) + part.first;
        const int numbers = part.count ? part.count : part.of_velocity ? at.nv : at.nq;
        const double *from = (part.of_velocity ? given + kt_model_nq(model) : given) + first;
        const double *to = (part.of_velocity ? v : q) + first;
        json_t *one = json_object();
        json_object_set_new(one, "joint", json_string(kt_joint_name(model, changes[i].body)));
        json_object_set_new(one, "part", json_string(part.name));
        json_object_set_new(one, "from", numbers == 1 ? kt_json_number(*from) : kt_json_numbers(from, numbers));
        json_object_set_new(one, "to", numbers == 1 ? kt_json_number(*to) : kt_json_numbers(to, numbers));
        json_array_append_new(list, one);
    }
    free(given);
    free(changes);
    return list;
}

/* ---- assembly ---------------------------------------------------------------------------------------------------- */

int kt_start_assemble(const kt_scene *scene, const kt_model *model, kt_data *data, double *q, double *v) {
    kt_error error = {0};
    kt_model_initial(model, q, v);
    kt_status status = kt_state_assemble(model, data, 0.0, q, v, &error);
    if (status == KT_OK)
        status = kt_massless_balance(model, data, 0.0, q, v, NULL, NULL, &error);
    if (status == KT_OK) {
        (void)kt_say_disagreement(scene, model);
        (void)kt_start_say_moved(NULL, scene, model, q, v, false);
        return KT_EXIT_DONE;
    }
    kt_say_error(&error);
    if (status == KT_ERROR_CONSTRAINT)
        kt_say_open_loops(scene, model);
    return kt_exit_code(status);
}

int kt_start_report(const kt_scene *scene, const kt_model *model) {
    kt_error error = {0};
    kt_data *data = NULL;
    double *state = kt_given_state(model);
    const kt_status status = state == NULL ? kt_reject_memory(&error) : kt_data_create(model, &data, &error);
    int code = kt_exit_code(status);
    if (status == KT_OK)
        code = kt_start_assemble(scene, model, data, state, state + kt_model_nq(model));
    else
        kt_say_error(&error);
    kt_data_free(data);
    free(state);
    return code;
}

/* ---- inertias ---------------------------------------------------------------------------------------------------- */

/* Returns the excess of the body's inertia. It is infinite if a principal moment is negative, or if only one moment is
 * not zero. */
static double inertia_excess_of(const kt_body *body) {
    kt_vec3 com;
    kt_sym3 inertia;
    if (kt_body_inertia(body, &com, &inertia, NULL) != KT_OK)
        inertia = body->inertia; /* one that was accepted */
    return kt_inertia_check(inertia, NULL) == KT_INERTIA_NEGATIVE ? (double)INFINITY : kt_inertia_excess(inertia);
}

json_t *kt_start_massless(const kt_model *model) {
    json_t *list = json_array();
    int last = 0;
    for (int k = 0; k < kt_massless_count(model); k++) {
        const int body = kt_velocity_body(model, kt_massless_coordinate(model, k));
        if (body != last)
            json_array_append_new(list, json_string(kt_joint_name(model, body)));
        last = body;
    }
    return list;
}

void kt_start_say_massless(const kt_model *model) {
    json_t *list = kt_start_massless(model);
    const size_t count = json_array_size(list);
    if (count > 0)
        kt_say("joint '%s'%s %s no mass: %s from the balance of forces (quasi-statics)",
               json_string_value(json_array_get(list, 0)), count > 1 ? " and others" : "", count > 1 ? "move" : "moves",
               count > 1 ? "they follow" : "it follows");
    json_decref(list);
}

int kt_start_say_inertias(const kt_scene *scene) {
    const kt_description *d = &scene->description;
    const char *how = d->inertia_check == KT_INERTIA_ACCEPT ? "accept" : "warn";
    int count = 0, worst = -1;
    double most = 0.0;
    for (int i = 0; i < d->body_count; i++) {
        const double excess = inertia_excess_of(&d->bodies[i]);
        count += excess > 0.0;
        worst = excess > most ? i : worst;
        most = fmax(most, excess);
    }
    if (count > 0 && isinf(most))
        kt_say("inertia_check: %s accepts %d impossible inertia%s: '%s' has a negative principal moment, or only one "
               "above zero; parts that move with such an inertia alone may have wrong accelerations",
               how, count, count == 1 ? "" : "s", d->bodies[worst].name);
    else if (count > 0)
        kt_say("inertia_check: %s accepts %d impossible inertia%s: the largest principal moment of '%s' exceeds the "
               "sum of the others by %.2g %%; %s",
               how, count, count == 1 ? "" : "s", d->bodies[worst].name, 100.0 * most,
               most <= 0.01 ? "give inertias with more digits"
                            : "this is more than rounding; check the units, the order (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), "
                              "and that they are about the centre of mass");
    return count;
}

json_t *kt_start_inertias(const kt_scene *scene) {
    const kt_description *d = &scene->description;
    json_t *object = json_object();
    for (int i = 0; i < d->body_count; i++) {
        const double excess = inertia_excess_of(&d->bodies[i]);
        if (excess > 0.0)
            json_object_set_new(object, d->bodies[i].name, kt_json_number(excess)); /* null: infinite */
    }
    return object;
}

json_t *kt_start_disagreement(const kt_model *model) {
    json_t *object = json_object();
    for (int i = 0; i < kt_loop_count(model); i++) {
        const kt_loop_disagreement d = kt_loop_disagreement_of(model, i);
        if (d.length > 0.0 || d.angle > 0.0)
            json_object_set_new(object, kt_loop_name(model, i),
                                kt_json_numbers((const double[]){d.length, d.angle}, 2));
    }
    return object;
}
