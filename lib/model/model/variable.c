/* Variables of formulas: time, auxiliary states, the motion of joints and markers, and gravity in joints. A variable
 * has the name of the column that records it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/model.h"

#include <stdio.h>
#include <string.h>

enum { TIME_COUNT = 1, POINT_COUNT = 6 /* coordinates and velocities of a marker */ };

/* The number of variables of a body: the variables of its joint, a gravity force for each velocity, and six for each
 * marker. */
static kt_joint_size variable_sizes_of(const kt_body *body) {
    const bool known = (unsigned)body->joint.type < KT_JOINT_TYPE_COUNT;
    return known ? kt_joint_sizes[body->joint.type] : (kt_joint_size){0, 0};
}
static int markers_of(const kt_body *body) { return body->markers && body->marker_count > 0 ? body->marker_count : 0; }
static int description_states_of(const kt_description *d) {
    return d->states && d->state_count > 0 ? d->state_count : 0;
}
static int variable_count_of(const kt_body *body) {
    return variable_sizes_of(body).nq + 2 * variable_sizes_of(body).nv + POINT_COUNT * markers_of(body);
}

/* The k-th variable of a body. */
static kt_variable body_variable_of(const kt_body *body, int index, int k) {
    const kt_joint_size size = variable_sizes_of(body);
    kt_variable found = {.type = KT_VARIABLE_POSITION, .body = index, .marker = 0, .component = k};
    if (k < size.nq)
        return found;
    found.type = KT_VARIABLE_VELOCITY;
    found.component = k -= size.nq;
    if (k < size.nv)
        return found;
    found.type = KT_VARIABLE_GRAVITY;
    found.component = k -= size.nv;
    if (k < size.nv)
        return found;
    k -= size.nv;
    found.type = k % POINT_COUNT < 3 ? KT_VARIABLE_MARKER : KT_VARIABLE_MARKER_VELOCITY;
    found.marker = k / POINT_COUNT;
    found.component = k % 3;
    return found;
}

bool kt_variable_at(const kt_description *description, int k, kt_variable *variable) {
    if (!description || !variable || k < 0)
        return false;
    if (k == 0) {
        *variable = (kt_variable){.type = KT_VARIABLE_TIME, .body = -1, .marker = 0, .component = 0};
        return true;
    }
    k -= TIME_COUNT;
    if (k < description_states_of(description)) {
        *variable = (kt_variable){.type = KT_VARIABLE_STATE, .body = -1, .marker = 0, .component = k};
        return true;
    }
    k -= description_states_of(description);
    for (int i = 0; i < description->body_count; i++) {
        const int count = variable_count_of(&description->bodies[i]);
        if (k < count) {
            *variable = body_variable_of(&description->bodies[i], i, k);
            return true;
        }
        k -= count;
    }
    return false;
}

/* The beginnings of the names of joint variables, and whether a joint has as many such variables as positions or as
 * velocities. */
static const struct {
    kt_variable_type type;
    const char *begin;
} of_joints[] = {
    {KT_VARIABLE_POSITION, "position."}, {KT_VARIABLE_VELOCITY, "velocity."}, {KT_VARIABLE_GRAVITY, "gravity."}};
enum { JOINT_KINDS = sizeof of_joints / sizeof *of_joints };

/* The entry of `of_joints` of a type; -1: the type does not belong to a joint. */
static int joint_entry(kt_variable_type type) {
    for (int i = 0; i < JOINT_KINDS; i++)
        if (of_joints[i].type == type)
            return i;
    return -1;
}

static int components_of(const kt_body *body, kt_variable_type type) {
    return type == KT_VARIABLE_POSITION ? variable_sizes_of(body).nq : variable_sizes_of(body).nv;
}

/* "position.crank", "velocity.ball[2]" */
static int name_coordinate_variable(const kt_body *body, const kt_variable *variable, char *text, size_t size) {
    const char *const begin = of_joints[joint_entry(variable->type)].begin;
    const int k = variable->component, count = components_of(body, variable->type);
    if (k < 0 || k >= count)
        return 0;
    return count == 1 ? snprintf(text, size, "%s%s", begin, kt_joint_name_of(body))
                      : snprintf(text, size, "%s%s[%d]", begin, kt_joint_name_of(body), k);
}

/* "marker.crank.tip.x", "marker.crank.tip.vx" */
static int name_point(const kt_body *body, const kt_variable *variable, char *text, size_t size) {
    const int k = variable->component;
    if (k < 0 || k >= 3 || variable->marker < 0 || variable->marker >= markers_of(body))
        return 0;
    return snprintf(text, size, "marker.%s.%s.%s%c", body->name, body->markers[variable->marker].name,
                    variable->type == KT_VARIABLE_MARKER ? "" : "v", "xyz"[k]);
}

static int name_state_variable(const kt_description *d, const kt_variable *variable, char *text, size_t size) {
    const int k = variable->component;
    return k >= 0 && k < description_states_of(d) && d->states[k].name ? snprintf(text, size, "%s", d->states[k].name)
                                                                       : 0;
}

int kt_variable_name(const kt_description *description, const kt_variable *variable, char *text, size_t size) {
    if (text && size > 0)
        *text = '\0';
    if (!description || !variable || !text)
        return 0;
    if (variable->type == KT_VARIABLE_TIME)
        return snprintf(text, size, "t");
    if (variable->type == KT_VARIABLE_STATE)
        return name_state_variable(description, variable, text, size);
    if (variable->body < 0 || variable->body >= description->body_count)
        return 0;
    const kt_body *body = &description->bodies[variable->body];
    return joint_entry(variable->type) >= 0 ? name_coordinate_variable(body, variable, text, size)
                                            : name_point(body, variable, text, size);
}

/* ---- by name ----------------------------------------------------------------------------------------------------- */

/* Whether a name begins with `word`. If so, *name advances to the rest. */
static bool skip_word(const char **name, const char *word) {
    const size_t length = word != NULL ? strlen(word) : 0;
    if (length == 0 || strncmp(*name, word, length) != 0)
        return false;
    *name += length;
    return true;
}

/* "" where there is one component, else "[k]". */
static bool read_index(const char *text, int count, int *k) {
    char expected[16];
    for (*k = 0; *k < count; ++*k) {
        (void)snprintf(expected, sizeof expected, "[%d]", *k);
        if (strcmp(text, count == 1 ? "" : expected) == 0)
            return true;
    }
    return false;
}

/* ".x", ".vx" */
static bool read_component(const char *text, kt_variable *found) {
    static const char *const names[POINT_COUNT] = {".x", ".y", ".z", ".vx", ".vy", ".vz"};
    for (int k = 0; k < POINT_COUNT; k++)
        if (strcmp(text, names[k]) == 0) {
            found->type = k < 3 ? KT_VARIABLE_MARKER : KT_VARIABLE_MARKER_VELOCITY;
            found->component = k % 3;
            return true;
        }
    return false;
}

/* `text` is the rest behind the name of the body. */
static bool read_marker_variable(const kt_body *body, const char *text, kt_variable *found) {
    if (*text++ != '.')
        return false;
    for (found->marker = 0; found->marker < markers_of(body); found->marker++) {
        const char *rest = text;
        if (skip_word(&rest, body->markers[found->marker].name) && read_component(rest, found))
            return true;
    }
    return false;
}

/* "current", "state.current" */
static bool find_state(const kt_description *d, const char *name, kt_variable *variable) {
    (void)skip_word(&name, "state.");
    for (int i = 0; i < description_states_of(d); i++)
        if (d->states[i].name && strcmp(d->states[i].name, name) == 0) {
            *variable = (kt_variable){.type = KT_VARIABLE_STATE, .body = -1, .marker = 0, .component = i};
            return true;
        }
    return false;
}

/* Whether a name begins like a variable of a joint (*type: which variable) or of a marker. *rest: the text after this
 * beginning. */
static bool begins_variable(const char *name, kt_variable_type *type, const char **rest) {
    *rest = name;
    for (int i = 0; i < JOINT_KINDS; i++) {
        *type = of_joints[i].type;
        if (skip_word(rest, of_joints[i].begin))
            return true;
    }
    *type = KT_VARIABLE_MARKER;
    return skip_word(rest, "marker.");
}

bool kt_variable_find(const kt_description *description, const char *name, kt_variable *variable) {
    kt_variable found = {.type = KT_VARIABLE_POSITION, .body = -1, .marker = 0, .component = 0};
    const char *rest;
    if (!description || !name || !variable)
        return false;
    if (strcmp(name, "t") == 0)
        return kt_variable_at(description, 0, variable);
    if (find_state(description, name, variable))
        return true;
    if (!begins_variable(name, &found.type, &rest))
        return false;
    const bool is_joint = joint_entry(found.type) >= 0;
    for (int i = 0; i < description->body_count; i++) {
        const kt_body *body = &description->bodies[i];
        const char *text = rest;
        if (!skip_word(&text, is_joint ? kt_joint_name_of(body) : body->name))
            continue;
        if (is_joint ? !read_index(text, components_of(body, found.type), &found.component)
                     : !read_marker_variable(body, text, &found))
            continue;
        found.body = i;
        *variable = found;
        return true;
    }
    return false;
}
