/* SPDX-License-Identifier: Apache-2.0 */
#include "difference.h"

#include "collect.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static char found[160];

static bool differ(const char *format, ...) __attribute__((format(printf, 1, 2)));

static bool differ(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(found, sizeof found, format, arguments); /* NOLINT(clang-analyzer-valist.Uninitialized) */
    va_end(arguments);
    return true;
}

/* Comparisons of members of a and b; `where` names the object. */
#define VALUE(member)                                                                                                  \
    if (a->member != b->member)                                                                                        \
    return differ("%s.%s", where, #member)
#define BITS(member)                                                                                                   \
    if (!kt_same_bytes(&a->member, &b->member, sizeof a->member))                                                      \
    return differ("%s.%s", where, #member)
#define TEXT(member)                                                                                                   \
    if (text_differs(a->member, b->member))                                                                            \
    return differ("%s.%s", where, #member)

static bool text_differs(const char *a, const char *b) { return a == NULL || b == NULL ? a != b : strcmp(a, b) != 0; }

static bool rotation_differs(const char *where, const kt_rotation *a, const kt_rotation *b) {
    VALUE(type);
    VALUE(sequence);
    BITS(value);
    return false;
}

static bool function_differs(const char *where, const kt_function *a, const kt_function *b) {
    VALUE(type);
    BITS(value);
    BITS(amplitude);
    BITS(frequency);
    BITS(phase);
    BITS(offset);
    BITS(from);
    BITS(to);
    BITS(start);
    BITS(end);
    VALUE(number_count);
    VALUE(interpolation);
    for (int i = 0; i < a->number_count; i++)
        BITS(numbers[i]);
    TEXT(text);
    VALUE(part_count);
    for (int i = 0; i < a->part_count; i++)
        if (function_differs(where, &a->parts[i], &b->parts[i]))
            return true;
    return false;
}

static bool end_differs(const char *where, const kt_end *a, const kt_end *b) {
    TEXT(body);
    TEXT(marker);
    BITS(at);
    return rotation_differs(where, &a->rotation, &b->rotation);
}

static bool joint_differs(const char *where, const kt_joint *a, const kt_joint *b) {
    VALUE(type);
    BITS(axis);
    BITS(axis2);
    BITS(pitch);
    BITS(at);
    BITS(position);
    BITS(velocity);
    if (kt_joint_given(a) != kt_joint_given(b))
        return differ("%s.given", where);
    return rotation_differs(where, &a->rotation, &b->rotation);
}

static bool shape_differs(const char *where, const kt_shape *a, const kt_shape *b) {
    VALUE(type);
    BITS(from);
    BITS(to);
    BITS(at);
    BITS(size);
    BITS(radius);
    BITS(length);
    BITS(axis);
    return rotation_differs(where, &a->rotation, &b->rotation);
}

static bool body_differs(const char *where, const kt_body *a, const kt_body *b) {
    char part[100];
    TEXT(name);
    TEXT(parent);
    BITS(mass);
    BITS(com);
    BITS(inertia);
    VALUE(com_of_shape);
    VALUE(inertia_of_shape);
    VALUE(marker_count);
    for (int i = 0; i < a->marker_count; i++) {
        TEXT(markers[i].name);
        BITS(markers[i].at);
        snprintf(part, sizeof part, "%s.markers[%d]", where, i);
        if (rotation_differs(part, &a->markers[i].rotation, &b->markers[i].rotation))
            return true;
    }
    snprintf(part, sizeof part, "%s.joint", where);
    if (joint_differs(part, &a->joint, &b->joint))
        return true;
    snprintf(part, sizeof part, "%s.shape", where);
    return shape_differs(part, &a->shape, &b->shape);
}

static bool loop_differs(const char *where, const kt_loop *a, const kt_loop *b) {
    TEXT(name);
    VALUE(type);
    BITS(axis);
    BITS(axis2);
    BITS(pitch);
    BITS(radius);
    VALUE(holonomic);
    TEXT(joint);
    BITS(offset);
    TEXT(formula);
    VALUE(term_count);
    for (int i = 0; i < a->term_count; i++) {
        TEXT(terms[i].joint);
        BITS(terms[i].coefficient);
    }
    return end_differs(where, &a->between[0], &b->between[0]) || end_differs(where, &a->between[1], &b->between[1]) ||
           function_differs(where, &a->function, &b->function);
}

static bool effect_differs(const char *where, const kt_effect *a, const kt_effect *b) {
    TEXT(name);
    VALUE(type);
    TEXT(joint);
    BITS(stiffness);
    BITS(length);
    VALUE(initial_length);
    BITS(damping);
    BITS(limit);
    BITS(coulomb);
    BITS(viscous);
    BITS(breakaway);
    BITS(stribeck);
    BITS(smoothing);
    BITS(lower);
    BITS(upper);
    BITS(stiffnesses);
    BITS(dampings);
    BITS(quadratics);
    VALUE(end_count);
    for (int i = 0; i < 6; i++)
        TEXT(formula[i]);
    VALUE(frame);
    BITS(linear);
    BITS(quadratic);
    BITS(strength);
    BITS(axis);
    BITS(radius);
    BITS(exponent);
    BITS(dissipation);
    BITS(friction);
    BITS(slip);
    for (int k = 0; k < 3; k++)
        if (function_differs(where, &a->value[k], &b->value[k]))
            return true;
    return end_differs(where, &a->between[0], &b->between[0]) || end_differs(where, &a->between[1], &b->between[1]) ||
           function_differs(where, &a->torque, &b->torque) || function_differs(where, &a->rest, &b->rest) ||
           function_differs(where, &a->target, &b->target);
}

static bool description_differs(const kt_description *a, const kt_description *b) {
    const char *where = "description";
    char item[40];
    TEXT(name);
    BITS(gravity);
    VALUE(inertia_check);
    VALUE(body_count);
    VALUE(loop_count);
    VALUE(effect_count);
    VALUE(hold_count);
    for (int i = 0; i < a->body_count; i++) {
        snprintf(item, sizeof item, "bodies[%d]", i);
        if (body_differs(item, &a->bodies[i], &b->bodies[i]))
            return true;
    }
    for (int i = 0; i < a->loop_count; i++) {
        snprintf(item, sizeof item, "loops[%d]", i);
        if (loop_differs(item, &a->loops[i], &b->loops[i]))
            return true;
    }
    for (int i = 0; i < a->effect_count; i++) {
        snprintf(item, sizeof item, "effects[%d]", i);
        if (effect_differs(item, &a->effects[i], &b->effects[i]))
            return true;
    }
    for (int i = 0; i < a->hold_count; i++)
        TEXT(hold[i]);
    return false;
}

static bool run_differs(const kt_run *a, const kt_run *b) {
    const char *where = "run";
    BITS(duration);
    TEXT(integrator);
    BITS(step);
    BITS(relative);
    BITS(absolute);
    VALUE(metric);
    VALUE(plan);
    BITS(interval);
    BITS(rho);
    VALUE(record);
    VALUE(marker_count);
    for (int i = 0; i < a->marker_count; i++) {
        TEXT(markers[i].body);
        TEXT(markers[i].marker);
    }
    return false;
}

const char *kt_run_difference(const kt_run *a, const kt_run *b) { return run_differs(a, b) ? found : ""; }

static bool computation_differs(const kt_scene *a, const kt_scene *b) {
    const char *where = "scene";
    VALUE(formulation);
    VALUE(reduction);
    VALUE(event_count);
    return false;
}

const char *kt_scene_difference(const kt_scene *a, const kt_scene *b) {
    return description_differs(&a->description, &b->description) || run_differs(&a->run, &b->run) ||
                   computation_differs(a, b)
               ? found
               : "";
}
