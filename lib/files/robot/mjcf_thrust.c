/* Actuators of MJCF at sites, such as propellers, and motors of free joints. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* Half of a wrench on a body: `force` times a vector in the axes of the frame. */
static void add_half(kt_mjcf *m, const kt_element *e, kt_effect_type type, const kt_end *end, kt_frame frame,
                     kt_vec3 vector, double force) {
    const double parts[3] = {vector.x, vector.y, vector.z};
    kt_effect *effect =
        parts[0] != 0.0 || parts[1] != 0.0 || parts[2] != 0.0 ? kt_draft_effect(&m->draft, e, type) : NULL;
    if (effect == NULL)
        return;
    effect->between[0] = *end;
    effect->frame = frame;
    for (int k = 0; k < 3; k++)
        effect->value[k] = kt_function_constant(force * parts[k]);
    kt_mjcf_name_effect(m, kt_xml_attribute(e, "name"));
}

/* A wrench on a body, in the axes of the body: the parts of `vectors` times the force of an actuator. */
static void add_driven_wrench(kt_mjcf *m, const kt_element *e, const kt_end *end, const kt_vec3 vectors[2],
                              const kt_actuator *numbers) {
    const double parts[6] = {vectors[0].x, vectors[0].y, vectors[0].z, vectors[1].x, vectors[1].y, vectors[1].z};
    kt_actuator *actuator = kt_reader_take(m->r, &m->r->keep, 1, sizeof *actuator);
    kt_effect *effect = kt_draft_effect(&m->draft, e, KT_EFFECT_EXPRESSION);
    if (effect == NULL || actuator == NULL)
        return;
    *actuator = *numbers;
    memcpy(actuator->wrench, parts, sizeof parts);
    for (int k = 1; k < 3; k++) /* the length is zero */
        actuator->gain[k] = actuator->bias[k] = 0.0;
    effect->actuators = actuator;
    effect->actuator_count = 1;
    effect->between[0] = *end;
    effect->end_count = 1;
    effect->frame = KT_FRAME_BODY;
    kt_mjcf_name_effect(m, kt_xml_attribute(e, "name"));
}

static void read_gears(kt_mjcf *m, const kt_element *e, kt_vec3 gears[2]) {
    double gear[6];
    kt_mjcf_gears_of(m, e, gear);
    for (int i = 0; i < 2; i++)
        gears[i] = kt_vec3_make(gear[3 * i], gear[3 * i + 1], gear[3 * i + 2]);
}

/* The force of an actuator for a control, within its bounds. */
static double bounded_force_of(kt_mjcf *m, const kt_element *e, double force) {
    double bounds[2];
    return kt_mjcf_actuator_range(m, e, "forcelimited", "forcerange", bounds) ? fmin(fmax(force, bounds[0]), bounds[1])
                                                                              : force;
}

/* An actuator of a site without another site acts with force times gear, a force and a moment in the site's axes. Its
 * length is zero. The force is that of the control u, or of the numbers `driven`, if these are not NULL. */
void kt_mjcf_act_at_site(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double u,
                         const kt_actuator *driven) {
    const int index = kt_mjcf_find(m, e, "site", KT_MJCF_SITES);
    const kt_mjcf_site *site = index >= 0 ? kt_mjcf_site_at(m, index) : NULL;
    double c[3];
    kt_vec3 gears[2];
    read_gears(m, e, gears);
    kt_mjcf_force_of(a, kt_mjcf_control_of(m, e, a, u), c);
    if (c[2] != 0.0 || (driven != NULL && a->has_affine_gain && a->gain[2] != 0.0))
        kt_unknown_count(&m->changes, "damping of an actuator of a site, which is left out", e);
    c[0] = bounded_force_of(m, e, c[0]);
    if (site == NULL || site->body == 0)
        return;
    if (kt_mjcf_is_bounded_above(m, site->body))
        kt_unknown_count(&m->changes, "actuatorfrcrange of joints that an actuator of a site moves, too", e);
    const kt_end end = {.body = kt_mjcf_body_at(m, site->body)->name, .at = site->pose.position};
    for (int i = 0; i < 2; i++)
        gears[i] = kt_mat3_apply(site->pose.rotation, gears[i]);
    for (int i = 0; i < 2 && driven == NULL; i++)
        add_half(m, e, i == 0 ? KT_EFFECT_FORCE : KT_EFFECT_TORQUE, &end, KT_FRAME_BODY, gears[i], c[0]);
    if (driven != NULL)
        add_driven_wrench(m, e, &end, gears, driven);
    kt_left_count(&m->notes.motors, e);
}

/* Adds a motor of a free joint, which acts with force times gear. The force is along the axes of the world. The moment
 * is about the axes of the body, or with `jointinparent` about the axes of the world. Returns false if the actuator is
 * no such motor, for example because its force depends on the motion or on an activation. */
bool kt_mjcf_act_in_free(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control) {
    const char *in_parent = kt_xml_attribute(e, "jointinparent"), *joint = kt_xml_attribute(e, "joint");
    const char *name = in_parent != NULL ? in_parent : joint;
    const int index = name != NULL ? kt_names_find(&m->names, KT_MJCF_JOINTS, name) : -1;
    const kt_mjcf_joint *j = index >= 0 ? kt_mjcf_joint_at(m, index) : NULL;
    double c[3];
    kt_vec3 gears[2];
    kt_mjcf_force_of(a, kt_mjcf_control_of(m, e, a, control), c);
    if (j == NULL || j->type != KT_MJCF_FREE || c[1] != 0.0 || c[2] != 0.0 || kt_mjcf_is_dynamic(&a->dynamics) ||
        a->dynamics.delay > 0.0 || a->has_active || a->has_passive)
        return false;
    const kt_end end = {.body = j->carrier};
    const double force = bounded_force_of(m, e, c[0]);
    read_gears(m, e, gears);
    add_half(m, e, KT_EFFECT_FORCE, &end, KT_FRAME_WORLD, gears[0], force);
    add_half(m, e, KT_EFFECT_TORQUE, &end, in_parent != NULL ? KT_FRAME_WORLD : KT_FRAME_BODY, gears[1], force);
    kt_left_count(&m->notes.motors, e);
    return true;
}
