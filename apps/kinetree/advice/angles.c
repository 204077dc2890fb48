/* Angles that were probably given in degrees without the unit. */
#include "advice/angles.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double one_turn = 2.0 * 3.14159265358979323846;

bool kt_doubtful_angle(double x) {
    const double degrees = 1000.0 * 360.0 * (x / one_turn);
    return fabs(x) > one_turn && fabs(degrees - rint(degrees)) > 1e-6 * fabs(degrees) / 360.0;
}

static void warn_of_angle(kt_warnings *warnings, const kt_body *body, int k, double x) {
    char remedy[80], index[8] = "";
    (void)snprintf(remedy, sizeof remedy, "Write '%.9g deg' if degrees are meant", x);
    if (k > 0)
        (void)snprintf(index, sizeof index, "[%d]", k);
    const kt_warning warning = {.code = "radians", .time = 0.0, .value = x, .unit = "rad", .remedy = remedy};
    kt_warn(warnings, &warning, "body '%s': joint.position%s: %.9g is in radians, %.3g turns", body->name, index, x,
            x / one_turn);
}

/* Returns whether the coordinate of a joint, NAME or NAME[k], is an angle. */
static bool coordinate_turns(const kt_description *d, const char *joint) {
    const char *bracket = joint != NULL ? strchr(joint, '[') : NULL;
    const size_t length = joint == NULL ? 0 : bracket != NULL ? (size_t)(bracket - joint) : strlen(joint);
    for (int i = 0; i < d->body_count && joint != NULL; i++) {
        const kt_body *body = &d->bodies[i];
        const char *name = body->joint.name != NULL ? body->joint.name : body->name;
        if (strncmp(name, joint, length) == 0 && name[length] == '\0')
            return kt_joint_coordinate_kind(body->joint.type, bracket != NULL ? (int)strtol(bracket + 1, NULL, 10)
                                                                              : 0) == KT_COORDINATE_ANGLE;
    }
    return false;
}

/* Warns of the positions to which an effect pulls or at which it stops its joint, if they are constant. */
static int warn_of_effect(kt_warnings *warnings, const kt_description *d, const kt_effect *effect, bool only_whole) {
    const kt_descriptor *descriptor = kt_effect_descriptor(effect->type);
    int count = 0;
    for (int k = 0; k < descriptor->key_count && coordinate_turns(d, effect->joint); k++) {
        const kt_key *key = &descriptor->keys[k];
        const void *member = (const char *)effect + key->offset;
        const kt_function *function = key->kind == KT_KEY_FUNCTION ? member : NULL;
        const double x = key->kind == KT_KEY_NUMBER                                   ? *(const double *)member
                         : function != NULL && function->type == KT_FUNCTION_CONSTANT ? function->value
                                                                                      : 0.0;
        if (strcmp(key->unit, "rad|m") != 0 || !isfinite(x) || !kt_doubtful_angle(x) || (only_whole && x != rint(x)))
            continue;
        char remedy[80];
        (void)snprintf(remedy, sizeof remedy, "Write '%.9g deg' if degrees are meant", x);
        const kt_warning warning = {.code = "radians", .time = 0.0, .value = x, .unit = "rad", .remedy = remedy};
        kt_warn(warnings, &warning, "%s of '%s': %s: %.9g is in radians, %.3g turns", descriptor->name, effect->joint,
                key->name, x, x / one_turn);
        count++;
    }
    return count;
}

int kt_angles_warn(kt_warnings *warnings, const kt_scene *scene, bool only_whole) {
    int count = 0;
    for (int i = 0; i < scene->description.body_count; i++) {
        const kt_body *body = &scene->description.bodies[i];
        for (int k = 0; k < KT_JOINT_NQ_MAX; k++) {
            const double x = body->joint.position[k];
            if (kt_joint_coordinate_kind(body->joint.type, k) != KT_COORDINATE_ANGLE || !kt_doubtful_angle(x) ||
                (only_whole && x != rint(x)))
                continue;
            warn_of_angle(warnings, body, k, x);
            count++;
        }
    }
    for (int i = 0; i < scene->description.effect_count; i++)
        count += warn_of_effect(warnings, &scene->description, &scene->description.effects[i], only_whole);
    return count;
}

int kt_angles_say(const kt_scene *scene, bool quiet) {
    kt_warnings warnings = {.quiet = quiet};
    const int count = kt_angles_warn(&warnings, scene, true);
    kt_warnings_free(&warnings);
    return count;
}
