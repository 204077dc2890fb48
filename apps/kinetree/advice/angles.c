/* Angles that were probably given in degrees without the unit. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/angles.h"

#include "base/decimal.h"
#include "kinetree/descriptor.h"
#include "open/load.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double one_turn = 2.0 * 3.14159265358979323846;

/* Returns whether an angle, rad, was probably given in degrees without the unit: it is beyond one turn, and no multiple
 * of 0.001 degrees. */
static bool is_doubtful_angle(double x) {
    const double degrees = 1000.0 * 360.0 * (x / one_turn);
    return fabs(x) > one_turn && fabs(degrees - rint(degrees)) > 1e-6 * fabs(degrees) / 360.0;
}

/* Angles of the command line above this one are doubtful, even if they are not whole numbers, rad. */
#define MANY 50.0

/* The list of warnings, and which angles are doubtful. */
typedef struct angles {
    kt_warnings *warnings;
    bool only_whole, is_robot;
    const kt_settings *settings; /* of the command line; NULL: none */
    bool only_settings;          /* other angles are not reported */
    int count;
} angles;

/* Returns whether one of the settings is this number, without a unit: "bodies.arm.joint.position=57.3". */
static bool is_setting(const kt_settings *settings, double x) {
    for (int i = 0; settings != NULL && i < settings->count; i++) {
        const char *number = strchr(settings->text[i], '='), *end;
        double value;
        if (number != NULL && kt_decimal_read(number + 1, &value, &end) && *end == '\0' && value == x)
            return true;
    }
    return false;
}

/* Returns whether an angle is to be reported. In records of earlier runs, angles that are no whole numbers may have
 * many turns. */
static bool is_reported(const angles *a, double x) {
    if (!isfinite(x) || !is_doubtful_angle(x) || (a->only_settings && !is_setting(a->settings, x)))
        return false;
    return !a->only_whole || x == rint(x) || (fabs(x) > MANY && is_setting(a->settings, x));
}

/* Warns of an angle if it is doubtful. The format names its item and its key. Files of robots know no 'deg'. */
static void check_radians(angles *a, double x, const char *format, ...) KT_PRINTF(3, 4);
static void check_radians(angles *a, double x, const char *format, ...) {
    char remedy[80], what[240];
    va_list arguments;
    if (!is_reported(a, x))
        return;
    va_start(arguments, format);
    (void)vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    if (a->is_robot)
        (void)snprintf(remedy, sizeof remedy, "Write %.9g, in radians, if degrees are meant", x * one_turn / 360.0);
    else
        (void)snprintf(remedy, sizeof remedy, "Write '%.9g deg' if degrees are meant", x);
    const kt_warning warning = kt_warning_at("radians", 0.0, x, "rad", remedy);
    kt_warn(a->warnings, &warning, "%s: %.9g is in radians, %.3g turns", what, x, x / one_turn);
    a->count++;
}

static void check_rotation_angles(angles *a, const kt_rotation *rotation, const char *what, const char *name,
                                  const char *key) {
    for (int k = 0; k < 3 && rotation->type == KT_ROTATION_RPY; k++)
        check_radians(a, rotation->value[k], "%s '%.80s': %.90s.rpy[%d]", what, name, key, k);
    for (int k = 0; k < 3 && rotation->type == KT_ROTATION_EULER; k++)
        check_radians(a, rotation->value[k], "%s '%.80s': %.90s.euler.angles[%d]", what, name, key, k);
    if (rotation->type == KT_ROTATION_AXIS_ANGLE)
        check_radians(a, rotation->value[3], "%s '%.80s': %.90s.angle", what, name, key);
}

static void check_end_angles(angles *a, const kt_end between[2], const char *what, const char *name) {
    check_rotation_angles(a, &between[0].rotation, what, name, "between[0].rotation");
    check_rotation_angles(a, &between[1].rotation, what, name, "between[1].rotation");
}

static void check_body_angles(angles *a, const kt_body *body) {
    char key[100];
    for (int k = 0; k < KT_JOINT_NQ_MAX; k++) {
        const double x = body->joint.position[k];
        if (kt_joint_coordinate_kind(body->joint.type, k) != KT_COORDINATE_ANGLE)
            continue;
        if (k == 0)
            check_radians(a, x, "body '%.80s': joint.position", body->name);
        else
            check_radians(a, x, "body '%.80s': joint.position[%d]", body->name, k);
    }
    check_rotation_angles(a, &body->joint.rotation, "body", body->name, "joint.rotation");
    check_rotation_angles(a, &body->shape.rotation, "body", body->name, "shape.rotation");
    for (int k = 0; k < body->shape_count; k++) {
        (void)snprintf(key, sizeof key, "shapes[%d].rotation", k + 1); /* the first one is `shape` */
        check_rotation_angles(a, &body->shapes[k].rotation, "body", body->name, key);
    }
    for (int k = 0; k < body->marker_count; k++) {
        (void)snprintf(key, sizeof key, "markers.%.60s.rotation", body->markers[k].name);
        check_rotation_angles(a, &body->markers[k].rotation, "body", body->name, key);
    }
}

/* Returns whether the coordinate of a joint, NAME or NAME[k], is an angle. */
static bool coordinate_turns(const kt_description *d, const char *joint) {
    const char *bracket = joint != NULL ? strchr(joint, '[') : NULL;
    const size_t length = joint == NULL ? 0 : bracket != NULL ? (size_t)(bracket - joint) : strlen(joint);
    const int k = bracket != NULL ? (int)strtol(bracket + 1, NULL, 10) : 0;
    for (int i = 0; i < d->body_count && joint != NULL; i++) {
        const kt_body *body = &d->bodies[i];
        const char *name = body->joint.name != NULL ? body->joint.name : body->name;
        if (strncmp(name, joint, length) == 0 && name[length] == '\0')
            return kt_joint_coordinate_kind(body->joint.type, k) == KT_COORDINATE_ANGLE;
    }
    return false;
}

/* Returns whether a key is a position of the joint in which the item acts. It is an angle if the joint turns. */
static bool is_position_key(const kt_key *key) { return strcmp(key->unit, "rad|m") == 0; }

/* Checks the positions to which an effect pulls or at which it stops its joint, if they are constant. */
static void check_effect_angles(angles *a, const kt_description *d, const kt_effect *effect) {
    const kt_descriptor *descriptor = kt_effect_descriptor(effect->type);
    for (int i = 0; i < descriptor->key_count && coordinate_turns(d, effect->joint); i++) {
        const kt_key *key = &descriptor->keys[i];
        const void *member = (const char *)effect + key->offset;
        const kt_function *function = key->kind == KT_KEY_FUNCTION ? member : NULL;
        if (!is_position_key(key))
            continue;
        if (key->kind == KT_KEY_NUMBER)
            check_radians(a, *(const double *)member, "%s of '%.80s': %s", descriptor->name, effect->joint, key->name);
        else if (function != NULL && function->type == KT_FUNCTION_CONSTANT)
            check_radians(a, function->value, "%s of '%.80s': %s", descriptor->name, effect->joint, key->name);
    }
}

/* Checks the values of a function, given by `key`, that drives a joint which turns. Of a table, only the first doubtful
 * row is reported. Coefficients of polynomials are rates, too, and 40 rad/s is usual. */
static void check_function_angles(angles *a, const char *what, const char *name, const char *key,
                                  const kt_function *f) {
    const struct {
        kt_function_type type;
        const char *part;
        double value;
    } parts[] = {{KT_FUNCTION_CONSTANT, "", f->value},          {KT_FUNCTION_SINE, ".sine.amplitude", f->amplitude},
                 {KT_FUNCTION_SINE, ".sine.offset", f->offset}, {KT_FUNCTION_RAMP, ".ramp.from", f->from},
                 {KT_FUNCTION_RAMP, ".ramp.to", f->to},         {KT_FUNCTION_BUMP, ".bump.height", f->amplitude}};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
        if (parts[i].type == f->type)
            check_radians(a, parts[i].value, "%s '%.80s': %s%s", what, name, key, parts[i].part);
    for (int i = 1, before = a->count; f->type == KT_FUNCTION_TABLE && i < f->number_count && a->count == before;
         i += 2)
        check_radians(a, f->numbers[i], "%s '%.80s': %s.table[%d][1]", what, name, key, i / 2);
}

/* Checks positions as functions of time: prescribed motions of joints, and positions to which effects pull joints.
 * Constant ones of effects are checked with their other numbers. */
static void check_driven_angles(angles *a, const kt_description *d) {
    for (int i = 0; i < d->loop_count; i++) {
        const kt_loop *loop = &d->loops[i];
        const kt_key *key = kt_descriptor_kind(kt_loop_descriptor(loop->type), KT_KEY_FUNCTION);
        if (key != NULL && is_position_key(key) && coordinate_turns(d, loop->joint))
            check_function_angles(a, "loop", loop->name, key->name, &loop->function);
    }
    for (int i = 0; i < d->effect_count; i++) {
        const kt_effect *effect = &d->effects[i];
        const kt_key *key = kt_descriptor_kind(kt_effect_descriptor(effect->type), KT_KEY_FUNCTION);
        const void *function = key != NULL ? (const char *)effect + key->offset : NULL;
        char what[64];
        (void)snprintf(what, sizeof what, "%s of", kt_effect_type_name(effect->type));
        if (key != NULL && is_position_key(key) && coordinate_turns(d, effect->joint) &&
            ((const kt_function *)function)->type != KT_FUNCTION_CONSTANT)
            check_function_angles(a, what, effect->joint, key->name, function);
    }
}

static void check_scene_angles(angles *a, const kt_scene *scene) {
    const kt_description *d = &scene->description;
    a->is_robot = kt_is_robot_scene(scene);
    for (int i = 0; i < d->body_count; i++)
        check_body_angles(a, &d->bodies[i]);
    for (int i = 0; i < d->loop_count; i++)
        check_end_angles(a, d->loops[i].between, "loop", d->loops[i].name);
    for (int i = 0; i < d->effect_count; i++) {
        const kt_effect *effect = &d->effects[i];
        char name[100];
        if (effect->name != NULL && effect->name[0] != '\0')
            (void)snprintf(name, sizeof name, "%.90s", effect->name);
        else
            (void)snprintf(name, sizeof name, "effect[%d]", i);
        check_effect_angles(a, d, effect);
        check_end_angles(a, effect->between, "effect", name);
    }
    if (!a->only_whole)
        check_driven_angles(a, d);
}

int kt_angles_warn(kt_warnings *warnings, const kt_scene *scene, bool only_whole, const kt_settings *settings) {
    angles a = {.warnings = warnings, .only_whole = only_whole, .settings = settings};
    check_scene_angles(&a, scene);
    return a.count;
}

int kt_angles_say(const kt_scene *scene, const kt_settings *settings) {
    kt_warnings warnings = {.quiet = false};
    const int count = kt_angles_warn(&warnings, scene, true, settings);
    kt_warnings_free(&warnings);
    return count;
}

int kt_angles_set_warn(kt_warnings *warnings, const kt_scene *scene, const kt_settings *settings) {
    angles a = {.warnings = warnings, .only_whole = true, .settings = settings, .only_settings = true};
    check_scene_angles(&a, scene);
    return a.count;
}
