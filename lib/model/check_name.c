/* Rules for names, and for references to items by name. */
#include "model/check.h"
#include "model/model.h"

#include <stddef.h>
#include <string.h>

void kt_checker_name(kt_checker *checker, int scope, const char *list, const char *name, bool optional) {
    if (name == NULL && optional)
        return;
    if (name == NULL || *name == '\0') {
        kt_checker_fault(checker, "name", -1, "name is missing; give it one");
        return;
    }
    const int first = kt_names_find(&checker->names, scope, name);
    if (!kt_name_is_valid(name))
        kt_checker_fault(checker, "name", -1,
                         "name %s is not valid; begin with a letter or _, go on with letters, digits, _ and -",
                         kt_name_quote(name).text);
    else if (scope == KT_SCOPE_BODY && strcmp(name, "world") == 0)
        kt_checker_fault(checker, "name", -1, "name 'world' is that of the ground; choose another");
    else if (first != checker->index)
        kt_checker_fault(checker, "name", -1, "name %s is that of %s[%d] already; choose another",
                         kt_name_quote(name).text, list, first);
}

/* Returns the body's name that is nearest to one that does not exist, except that of the body being checked; NULL if
 * none is near. */
static const char *nearest_body(kt_checker *checker, const char *name, bool or_world) {
    const kt_description *d = checker->description;
    kt_nearest search = kt_nearest_make(name, &checker->effort);
    if (or_world)
        kt_nearest_try(&search, "world");
    for (int i = 0; i < d->body_count; i++) {
        if (checker->item == KT_ITEM_BODY && i == checker->index)
            continue;
        if (!kt_nearest_try(&search, d->bodies[i].name))
            break;
    }
    return search.best;
}

int kt_checker_body(kt_checker *checker, const char *field, int sub, const char *what, const char *name) {
    if (name == NULL || strcmp(name, "world") == 0)
        return KT_BODY_WORLD;
    const int body = kt_names_find(&checker->names, KT_SCOPE_BODY, name);
    if (body >= 0)
        return body;
    if (!kt_checker_is_done(checker)) {
        const char *near = nearest_body(checker, name, true);
        if (near != NULL)
            kt_checker_fault(checker, field, sub, "%s %s does not exist; did you mean %s?", what,
                             kt_name_quote(name).text, kt_name_quote(near).text);
        else
            kt_checker_fault(checker, field, sub, "%s %s does not exist; name a body of the scene, or 'world'", what,
                             kt_name_quote(name).text);
    }
    return KT_BODY_UNKNOWN;
}

int kt_checker_joint(kt_checker *checker, const char *field, int sub, const char *name) {
    if (name == NULL) {
        kt_checker_fault(checker, field, sub, "joint is missing; name the body that it carries");
        return KT_BODY_UNKNOWN;
    }
    const int body = kt_names_find(&checker->names, KT_SCOPE_BODY, name);
    if (body >= 0)
        return body;
    if (!kt_checker_is_done(checker)) {
        const char *near = nearest_body(checker, name, false);
        if (strcmp(name, "world") == 0)
            kt_checker_fault(checker, field, sub, "the world has no joint; name a body of the scene");
        else if (near != NULL)
            kt_checker_fault(checker, field, sub, "joint %s does not exist; did you mean %s?", kt_name_quote(name).text,
                             kt_name_quote(near).text);
        else
            kt_checker_fault(checker, field, sub, "joint %s does not exist; name a body of the scene",
                             kt_name_quote(name).text);
    }
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
                         "joint %s is %s; what is wanted has one coordinate: revolute, prismatic or screw",
                         kt_name_quote(name).text, type_name);
        return KT_BODY_UNKNOWN;
    }
    return body;
}

static void check_marker(kt_checker *checker, const char *field, int sub, int body, const char *marker) {
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
    static const char *const at[3] = {".at", "[0].at", "[1].at"};
    static const char *const rotation[3] = {".rotation", "[0].rotation", "[1].rotation"};
    const int body = kt_checker_body(checker, field, sub, "body", end->body);
    if (end->marker == NULL)
        kt_checker_vector(checker, field, sub, at[sub + 1], end->at);
    else if (body != KT_BODY_UNKNOWN)
        check_marker(checker, field, sub, body, end->marker);
    kt_checker_rotation(checker, field, sub, rotation[sub + 1], &end->rotation);
    return body;
}
