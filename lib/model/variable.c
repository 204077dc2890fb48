/* Variables of formulas: time, auxiliary states, and the motion of joints and markers. Their names are those of the
 * columns that record them. */
#include "model/model.h"

#include <stdio.h>
#include <string.h>

enum { TIME_COUNT = 1, POINT_COUNT = 6 /* coordinates and velocities of a marker */ };

/* How many variables a body has: those of its joint, and six for each marker. */
static kt_joint_size size_of(const kt_body *body) {
    const bool known = (unsigned)body->joint.type < KT_JOINT_TYPE_COUNT;
    return known ? kt_joint_sizes[body->joint.type] : (kt_joint_size){0, 0};
}
static int markers_of(const kt_body *body) { return body->markers && body->marker_count > 0 ? body->marker_count : 0; }
static int states_of(const kt_description *d) { return d->states && d->state_count > 0 ? d->state_count : 0; }
static int count_of(const kt_body *body) {
    return size_of(body).nq + size_of(body).nv + POINT_COUNT * markers_of(body);
}

/* The k-th variable of a body. */
static kt_variable variable_of(const kt_body *body, int index, int k) {
    const kt_joint_size size = size_of(body);
    kt_variable found = {.type = KT_VARIABLE_POSITION, .body = index, .marker = 0, .component = k};
    if (k < size.nq)
        return found;
    found.type = KT_VARIABLE_VELOCITY;
    found.component = k -= size.nq;
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
    if (k < states_of(description)) {
        *variable = (kt_variable){.type = KT_VARIABLE_STATE, .body = -1, .marker = 0, .component = k};
        return true;
    }
    k -= states_of(description);
    for (int i = 0; i < description->body_count; i++) {
        const int count = count_of(&description->bodies[i]);
        if (k < count) {
            *variable = variable_of(&description->bodies[i], i, k);
            return true;
        }
        k -= count;
    }
    return false;
}

/* "position.crank", "velocity.ball[2]" */
static int name_coordinate(const kt_body *body, const kt_variable *variable, char *text, size_t size) {
    const bool is_velocity = variable->type == KT_VARIABLE_VELOCITY;
    const char *const kind = is_velocity ? "velocity" : "position";
    const int k = variable->component, count = is_velocity ? size_of(body).nv : size_of(body).nq;
    if (k < 0 || k >= count)
        return 0;
    return count == 1 ? snprintf(text, size, "%s.%s", kind, kt_joint_name_of(body))
                      : snprintf(text, size, "%s.%s[%d]", kind, kt_joint_name_of(body), k);
}

/* "marker.crank.tip.x", "marker.crank.tip.vx" */
static int name_point(const kt_body *body, const kt_variable *variable, char *text, size_t size) {
    const int k = variable->component;
    if (k < 0 || k >= 3 || variable->marker < 0 || variable->marker >= markers_of(body))
        return 0;
    return snprintf(text, size, "marker.%s.%s.%s%c", body->name, body->markers[variable->marker].name,
                    variable->type == KT_VARIABLE_MARKER ? "" : "v", "xyz"[k]);
}

static int name_state(const kt_description *d, const kt_variable *variable, char *text, size_t size) {
    const int k = variable->component;
    return k >= 0 && k < states_of(d) && d->states[k].name ? snprintf(text, size, "%s", d->states[k].name) : 0;
}

int kt_variable_name(const kt_description *description, const kt_variable *variable, char *text, size_t size) {
    if (text && size > 0)
        *text = '\0';
    if (!description || !variable || !text)
        return 0;
    if (variable->type == KT_VARIABLE_TIME)
        return snprintf(text, size, "t");
    if (variable->type == KT_VARIABLE_STATE)
        return name_state(description, variable, text, size);
    if (variable->body < 0 || variable->body >= description->body_count)
        return 0;
    const kt_body *body = &description->bodies[variable->body];
    return variable->type == KT_VARIABLE_POSITION || variable->type == KT_VARIABLE_VELOCITY
               ? name_coordinate(body, variable, text, size)
               : name_point(body, variable, text, size);
}

/* ---- by name ----------------------------------------------------------------------------------------------------- */

/* Whether a name begins with `word`. If so, *name advances to the rest. */
static bool begins(const char **name, const char *word) {
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
static bool read_marker(const kt_body *body, const char *text, kt_variable *found) {
    if (*text++ != '.')
        return false;
    for (found->marker = 0; found->marker < markers_of(body); found->marker++) {
        const char *rest = text;
        if (begins(&rest, body->markers[found->marker].name) && read_component(rest, found))
            return true;
    }
    return false;
}

/* "current", "state.current" */
static bool find_state(const kt_description *d, const char *name, kt_variable *variable) {
    (void)begins(&name, "state.");
    for (int i = 0; i < states_of(d); i++)
        if (d->states[i].name && strcmp(d->states[i].name, name) == 0) {
            *variable = (kt_variable){.type = KT_VARIABLE_STATE, .body = -1, .marker = 0, .component = i};
            return true;
        }
    return false;
}

bool kt_variable_find(const kt_description *description, const char *name, kt_variable *variable) {
    kt_variable found = {.type = KT_VARIABLE_POSITION, .body = -1, .marker = 0, .component = 0};
    if (!description || !name || !variable)
        return false;
    if (strcmp(name, "t") == 0)
        return kt_variable_at(description, 0, variable);
    if (find_state(description, name, variable))
        return true;
    const char *rest = name;
    const bool is_position = begins(&rest, "position."), is_velocity = !is_position && begins(&rest, "velocity.");
    if (!is_position && !is_velocity && !begins(&rest, "marker."))
        return false;
    found.type = is_velocity ? KT_VARIABLE_VELOCITY : KT_VARIABLE_POSITION;
    for (int i = 0; i < description->body_count; i++) {
        const kt_body *body = &description->bodies[i];
        const kt_joint_size size = size_of(body);
        const char *text = rest;
        const bool is_joint = is_position || is_velocity;
        if (!begins(&text, is_joint ? kt_joint_name_of(body) : body->name))
            continue;
        if (is_joint ? !read_index(text, is_velocity ? size.nv : size.nq, &found.component)
                     : !read_marker(body, text, &found))
            continue;
        found.body = i;
        *variable = found;
        return true;
    }
    return false;
}
