/* Rules for names, and for references to items by name. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/check.h"
#include "model/model.h"
#include "model/relative.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* Returns the first item of a name. A joint without its own name has the name of its body. */
static int first_named(const kt_checker *checker, int scope, const char *name) {
    const int first = kt_names_find(&checker->names, scope, name);
    if (scope != KT_NAMES_OF_JOINTS || (first >= 0 && first != checker->index))
        return first;
    const int body = kt_names_find(&checker->names, KT_SCOPE_BODY, name);
    return body >= 0 && checker->description->bodies[body].joint.name == NULL ? body : first;
}

void kt_checker_name(kt_checker *checker, int scope, const char *list, const char *name, bool optional) {
    const char *field = scope == KT_NAMES_OF_JOINTS ? "joint.name" : "name";
    if (name == NULL && optional)
        return;
    if (name == NULL || *name == '\0') {
        kt_checker_fault(checker, field, -1, "name is missing; give it one");
        return;
    }
    const int first = first_named(checker, scope, name);
    if (!kt_name_is_valid(name))
        kt_checker_fault(checker, field, -1,
                         "name %s is not valid; begin with a letter or _, go on with letters, digits, _ and -",
                         kt_name_quote(name).text);
    else if ((scope == KT_SCOPE_BODY || scope == KT_NAMES_OF_JOINTS) && strcmp(name, "world") == 0)
        kt_checker_fault(checker, field, -1, "name 'world' is that of the ground; choose another");
    else if (first != checker->index)
        kt_checker_fault(checker, field, -1, "name %s is that of %s[%d] already; choose another",
                         kt_name_quote(name).text, list, first);
}

/* Returns the name of a body or joint that is nearest to a name that does not exist; NULL if none is near. The names of
 * the body being checked are excluded. */
static const char *nearest_body(kt_checker *checker, const char *name, int scope) {
    const kt_description *d = checker->description;
    kt_nearest search = kt_nearest_make(name, &checker->effort);
    if (scope == KT_SCOPE_BODY)
        kt_nearest_try(&search, "world");
    for (int i = 0; i < d->body_count; i++) {
        if (checker->item == KT_ITEM_BODY && i == checker->index)
            continue;
        if (!kt_nearest_try(&search, scope == KT_SCOPE_BODY ? d->bodies[i].name : kt_joint_name_of(&d->bodies[i])))
            break;
    }
    return search.best;
}

/* Reports a name that does not exist; near: NULL where none is. */
static int reject_missing_name(kt_checker *checker, const char *field, int sub, const char *what, const char *name,
                               const char *near, const char *remedy) {
    const kt_name_text suggested = kt_name_quote(near != NULL ? near : "");
    kt_checker_fault(checker, field, sub, "%s %s does not exist; %s%s%s", what, kt_name_quote(name).text,
                     near != NULL ? "did you mean " : remedy, near != NULL ? suggested.text : "",
                     near != NULL ? "?" : "");
    return KT_BODY_UNKNOWN;
}

int kt_checker_body(kt_checker *checker, const char *field, int sub, const char *what, const char *name) {
    if (name == NULL || strcmp(name, "world") == 0)
        return KT_BODY_WORLD;
    const int body = kt_names_find(&checker->names, KT_SCOPE_BODY, name);
    if (body >= 0)
        return body;
    if (kt_checker_is_done(checker))
        return KT_BODY_UNKNOWN;
    return reject_missing_name(checker, field, sub, what, name, nearest_body(checker, name, KT_SCOPE_BODY),
                               "name a body of the scene, or 'world'");
}

/* Returns the body whose joint has the name. Otherwise returns a body of that name, whose joint has another name; -1:
 * none. */
static int find_joint_named(const kt_checker *checker, const char *name) {
    const int own = kt_names_find(&checker->names, KT_NAMES_OF_JOINTS, name);
    return own < 0 ? kt_names_find(&checker->names, KT_SCOPE_BODY, name) : own;
}

int kt_checker_joint(kt_checker *checker, const char *field, int sub, const char *name) {
    if (name == NULL) {
        kt_checker_fault(checker, field, sub, "joint is missing; name the body that it carries");
        return KT_BODY_UNKNOWN;
    }
    const kt_body *bodies = checker->description->bodies;
    const int body = find_joint_named(checker, name);
    if (body >= 0 && strcmp(kt_joint_name_of(&bodies[body]), name) == 0)
        return body;
    if (kt_checker_is_done(checker))
        return KT_BODY_UNKNOWN;
    const char *near = body >= 0 ? bodies[body].joint.name : nearest_body(checker, name, KT_NAMES_OF_JOINTS);
    if (strcmp(name, "world") != 0)
        return reject_missing_name(checker, field, sub, "joint", name, near, "name a body of the scene");
    kt_checker_fault(checker, field, sub, "the world has no joint; name a body of the scene");
    return KT_BODY_UNKNOWN;
}

int kt_checker_scalar_joint(kt_checker *checker, const char *field, int sub, const char *name) {
    const int body = kt_checker_joint(checker, field, sub, name);
    if (body < 0)
        return body;
    const kt_joint_type type = checker->description->bodies[body].joint.type;
    const char *type_name = kt_joint_type_name(type);
    if (type_name == NULL) /* reported with its body */
        return body;
    if (kt_joint_sizes[type].nq != 1) {
        kt_checker_fault(checker, field, sub,
                         "joint %s is %s; name a joint of one coordinate: revolute, prismatic or screw",
                         kt_name_quote(name).text, type_name);
        return KT_BODY_UNKNOWN;
    }
    return body;
}

/* ---- coordinates in which effects act ---------------------------------------------------------------------------- */

/* Reports an invalid or missing index of a coordinate of a joint or loop, `what`, that has `count` coordinates. */
static void check_component(kt_checker *checker, const char *field, const char *what, const char *type, int count,
                            const char *text, kt_coordinate_name name) {
    if (count == 0)
        kt_checker_fault(checker, field, -1, "%s %s is %s, which has no coordinate along which a force could act", what,
                         kt_name_quote(text).text, type);
    else if (name.k < 0 || name.k >= count)
        kt_checker_fault(checker, field, -1, "%s %s: there is no such coordinate; %s has %d, the first is [0]", what,
                         kt_name_quote(text).text, type, count);
    else if (count > 1 && !name.has_index)
        kt_checker_fault(
            checker, field, -1, "%s %s is %s and has %d coordinates; name one of them: %.*s[0] to %.*s[%d]", what,
            kt_name_quote(text).text, type, count, (int)name.length, text, (int)name.length, text, count - 1);
}

/* Returns the body whose joint a text names with an index; -1: none. */
static int indexed_body(const kt_checker *checker, const char *text, kt_coordinate_name name) {
    const kt_description *d = checker->description;
    for (int i = 0; i < d->body_count && name.has_index; i++)
        if (kt_coordinate_is_of(text, name, kt_joint_name_of(&d->bodies[i])))
            return i;
    return -1;
}

/* In a joint with a quaternion, forces do not belong to single coordinates. */
static void check_joint_component(kt_checker *checker, const char *field, int body, const char *text,
                                  kt_coordinate_name name) {
    const kt_joint_type type = checker->description->bodies[body].joint.type;
    const char *type_name = kt_joint_type_name(type);
    const kt_joint_size *size = &kt_joint_sizes[type_name ? type : KT_JOINT_FIXED];
    if (type_name) /* else reported with its body */
        check_component(checker, field, "joint", type_name, size->nq == size->nv ? size->nv : 0, text, name);
}

void kt_checker_coordinate(kt_checker *checker, const char *field, const char *text) {
    const kt_coordinate_name name = text ? kt_coordinate_name_of(text) : (kt_coordinate_name){.k = 0};
    const int joint = text ? find_joint_named(checker, text) : -1;
    if (text == NULL || (joint >= 0 && strcmp(kt_joint_name_of(&checker->description->bodies[joint]), text) == 0)) {
        (void)kt_checker_scalar_joint(checker, field, -1, text);
        return;
    }
    const int body = indexed_body(checker, text, name);
    const int loop = body < 0 ? kt_coordinate_loop(checker->description, text, 0) : -1;
    if (body >= 0) {
        check_joint_component(checker, field, body, text, name);
    } else if (loop >= 0) {
        const kt_loop_type type = checker->description->loops[loop].type;
        const char *type_name = kt_loop_type_name(type);
        check_component(checker, field, "loop", type_name ? type_name : "one of your own", kt_relative_count(type),
                        text, name);
    } else {
        (void)kt_checker_scalar_joint(checker, field, -1, text);
    }
}

/* Reports a marker that its body does not have, with the nearest name while the effort for suggestions lasts. */
static void check_marker_name(kt_checker *checker, const char *field, int sub, int body, const char *marker) {
    if (body == KT_BODY_WORLD) {
        kt_checker_fault(checker, field, sub, "the world has no markers, and no %s; give the point by `at`",
                         kt_name_quote(marker).text);
        return;
    }
    if (kt_names_find(&checker->names, body, marker) >= 0 || kt_checker_is_done(checker))
        return;
    const kt_body *owner = &checker->description->bodies[body];
    kt_nearest search = kt_nearest_make(marker, &checker->effort);
    for (int i = 0; i < kt_checker_marker_count(owner); i++)
        if (!kt_nearest_try(&search, owner->markers[i].name))
            break;
    if (search.best != NULL)
        kt_checker_fault(checker, field, sub, "body %s has no marker %s; did you mean %s?",
                         kt_name_quote(owner->name).text, kt_name_quote(marker).text, kt_name_quote(search.best).text);
    else
        kt_checker_fault(checker, field, sub, "body %s has no marker %s; add it, or give the point by `at`",
                         kt_name_quote(owner->name).text, kt_name_quote(marker).text);
}

int kt_checker_end(kt_checker *checker, const char *field, int sub, const kt_end *end) {
    char at[32] = ".at", rotation[32] = ".rotation";
    if (sub >= 0) {
        (void)snprintf(at, sizeof at, "[%d].at", sub);
        (void)snprintf(rotation, sizeof rotation, "[%d].rotation", sub);
    }
    const int body = kt_checker_body(checker, field, sub, "body", end->body);
    if (end->marker == NULL)
        kt_checker_vector(checker, field, sub, at, end->at);
    else if (body != KT_BODY_UNKNOWN)
        check_marker_name(checker, field, sub, body, end->marker);
    kt_checker_rotation(checker, field, sub, rotation, &end->rotation);
    return body;
}
