/* Actuators of MJCF at sites, such as propellers. */
#include "robot/mjcf.h"

#include <math.h>

void kt_mjcf_name_effect(kt_mjcf *m, const char *name) {
    kt_effect *effects = m->draft.effects.items;
    if (name != NULL && *name != '\0')
        effects[m->draft.effects.count - 1].name = kt_namer_make(&m->effects_named, name);
}

/* Half of a wrench on the body of a site, along its axes. */
static void add_at_site(kt_mjcf *m, const kt_element *e, const kt_mjcf_site *site, kt_effect_type type,
                        const double *gear, double force) {
    const kt_vec3 along = kt_mat3_apply(site->pose.rotation, kt_vec3_make(gear[0], gear[1], gear[2]));
    const double parts[3] = {along.x, along.y, along.z};
    if (parts[0] == 0.0 && parts[1] == 0.0 && parts[2] == 0.0)
        return;
    kt_effect *effect = kt_draft_effect(&m->draft, e, type);
    if (effect == NULL)
        return;
    effect->between[0].body = kt_mjcf_body_at(m, site->body)->name;
    effect->between[0].at = site->pose.position;
    effect->frame = KT_FRAME_BODY;
    for (int k = 0; k < 3; k++)
        effect->value[k] = kt_function_constant(force * parts[k]);
    kt_mjcf_name_effect(m, kt_xml_attribute(e, "name"));
}

/* An actuator of a site without another site acts with force times gear, a force and a moment in the site's axes. Its
 * length is zero. */
void kt_mjcf_act_at_site(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control) {
    const int index = kt_mjcf_find(m, e, "site", KT_MJCF_SITES);
    const kt_mjcf_site *site = index >= 0 ? kt_mjcf_site_at(m, index) : NULL;
    double gear[6] = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0}, c[3], bounds[2];
    const char *tag = kt_mjcf_actuator_tag(m, e, "gear");
    if (tag != NULL)
        (void)kt_mjcf_numbers(m, e, tag, "gear", 1, 6, gear);
    kt_mjcf_force_of(a, kt_mjcf_control_of(m, e, a, control), c);
    if (c[2] != 0.0)
        kt_unknown_count(&m->changes, "damping of an actuator of a site, which is left out", e);
    if (kt_mjcf_is_dynamic(&a->dynamics))
        kt_unknown_count(&m->changes, "activation of an actuator of a site, whose control acts at once", e);
    if (a->dynamics.delay > 0.0)
        kt_unknown_count(&m->changes, "delay of the control of an actuator of a site, which acts at once", e);
    if (kt_mjcf_actuator_range(m, e, "forcelimited", "forcerange", bounds))
        c[0] = fmin(fmax(c[0], bounds[0]), bounds[1]);
    if (site == NULL || site->body == 0)
        return;
    if (kt_mjcf_is_bounded_above(m, site->body))
        kt_unknown_count(&m->changes, "actuatorfrcrange of joints that an actuator of a site moves, too", e);
    add_at_site(m, e, site, KT_EFFECT_FORCE, gear, c[0]);
    add_at_site(m, e, site, KT_EFFECT_TORQUE, gear + 3, c[0]);
    kt_left_count(&m->motors, e);
}
