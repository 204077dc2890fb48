/* Settings of a model in MJCF. Those of <compiler>, also of an attached model, determine the meaning of all other
 * attributes. Those of <option> are gravity, features that are turned off, and a surrounding medium, which is counted.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <string.h>

static void read_sequence(kt_mjcf *m, const kt_element *e, char sequence[4]) {
    const char *text = kt_xml_attribute(e, "eulerseq");
    if (text == NULL)
        return;
    if (strlen(text) == 3 && strspn(text, "xyzXYZ") == 3)
        memcpy(sequence, text, 4);
    else
        (void)kt_mjcf_fault(m, e, "eulerseq: expected three of x, y, z, X, Y, Z, found '%.40s'", text);
}

/* An attribute that is missing keeps the value of an earlier <compiler>. */
static void read_compiler(kt_mjcf *m, const kt_element *e) {
    static const char *const angles[] = {"degree", "radian", NULL}, *const coordinates[] = {"local", NULL};
    static const char *const from_geoms[] = {"false", "true", "auto", NULL};
    kt_mjcf_settings *s = &kt_mjcf_document_at(m, e->document)->settings;
    double groups[2] = {s->group_first, s->group_last};
    if (kt_mjcf_choice(m, e, NULL, "angle", angles, s->angle == 1.0) == 1)
        s->angle = 1.0;
    else
        s->angle = 3.14159265358979323846 / 180.0;
    (void)kt_mjcf_choice(m, e, NULL, "coordinate", coordinates, 0);
    read_sequence(m, e, s->sequence);
    s->autolimits = kt_mjcf_flag(m, e, NULL, "autolimits", s->autolimits);
    s->total_mass = kt_mjcf_number(m, e, NULL, "settotalmass", s->total_mass);
    s->balance = kt_mjcf_flag(m, e, NULL, "balanceinertia", s->balance);
    s->mass_least = kt_mjcf_number(m, e, NULL, "boundmass", s->mass_least);
    s->least = kt_mjcf_number(m, e, NULL, "boundinertia", s->least);
    s->from_geom = (kt_mjcf_from_geom)kt_mjcf_choice(m, e, NULL, "inertiafromgeom", from_geoms, (int)s->from_geom);
    (void)kt_mjcf_numbers(m, e, NULL, "inertiagrouprange", 2, 2, groups);
    s->group_first = groups[0];
    s->group_last = groups[1];
    s->exact_meshes = kt_mjcf_flag(m, e, NULL, "exactmeshinertia", s->exact_meshes);
    s->fits_boxes = kt_mjcf_flag(m, e, NULL, "fitaabb", s->fits_boxes);
    s->strip_path = kt_mjcf_flag(m, e, NULL, "strippath", s->strip_path);
    s->fuses_static = kt_mjcf_flag(m, e, NULL, "fusestatic", s->fuses_static);
    s->align_free = kt_mjcf_flag(m, e, NULL, "alignfree", s->align_free);
    const char *folder = kt_xml_attribute(e, "meshdir");
    folder = folder != NULL ? folder : kt_xml_attribute(e, "assetdir");
    s->mesh_folder = folder != NULL ? folder : s->mesh_folder;
}

void kt_mjcf_read_settings(kt_mjcf *m, int document) {
    kt_mjcf_document *d = kt_mjcf_document_at(m, document);
    d->settings = (kt_mjcf_settings){.angle = 3.14159265358979323846 / 180.0,
                                     .sequence = "xyz",
                                     .autolimits = true,
                                     .from_geom = KT_MJCF_AUTO,
                                     .group_last = 5.0};
    for (const kt_element *e = kt_xml_child(d->root, "compiler"); e != NULL; e = kt_xml_next(e, "compiler"))
        read_compiler(m, e);
}

/* ---- options ----------------------------------------------------------------------------------------------------- */

/* Whether a flag differs from its default. */
static bool is_flag(kt_mjcf *m, const kt_element *flag, const char *name, bool standard) {
    static const char *const words[] = {"disable", "enable", NULL};
    return kt_mjcf_choice(m, flag, NULL, name, words, standard) != standard;
}

static void read_flags(kt_mjcf *m, const kt_element *flag) {
    const bool passive = is_flag(m, flag, "passive", true), constraint = is_flag(m, flag, "constraint", true);
    const kt_mjcf_off off = {.springs = passive || is_flag(m, flag, "spring", true),
                             .dampers = passive || is_flag(m, flag, "damper", true),
                             .friction = constraint || is_flag(m, flag, "frictionloss", true),
                             .limits = constraint || is_flag(m, flag, "limit", true),
                             .equalities = constraint || is_flag(m, flag, "equality", true),
                             .actuation = is_flag(m, flag, "actuation", true),
                             .control_limits = is_flag(m, flag, "clampctrl", true),
                             .contacts = constraint || is_flag(m, flag, "contact", true)};
    const unsigned groups = m->off.actuator_groups;
    m->off = off;
    m->off.actuator_groups = groups;
    if (is_flag(m, flag, "gravity", true))
        m->gravity = kt_vec3_make(0.0, 0.0, 0.0);
    if (off.springs || off.dampers || off.friction || off.limits || off.equalities || off.actuation ||
        off.control_limits)
        kt_left_count(&m->notes.disabled, flag);
}

static void read_groups(kt_mjcf *m, const kt_element *e) {
    double groups[31];
    const char *text = kt_xml_attribute(e, "actuatorgroupdisable");
    const int count = text != NULL ? kt_parse_numbers(text, 31, groups) : 0;
    if (count < 0)
        (void)kt_mjcf_fault(m, e, "actuatorgroupdisable: expected numbers of groups, found '%.60s'", text);
    for (int i = 0; i < count; i++)
        if (groups[i] >= 0.0 && groups[i] < 31.0)
            m->off.actuator_groups |= 1U << (unsigned)groups[i];
}

static void read_medium(kt_mjcf *m, const kt_element *e) {
    const kt_vec3 still = {0.0, 0.0, 0.0};
    m->density = kt_mjcf_number(m, e, NULL, "density", m->density);
    m->viscosity = kt_mjcf_number(m, e, NULL, "viscosity", m->viscosity);
    if ((m->density > 0.0 || m->viscosity > 0.0) && kt_vec3_norm(kt_mjcf_vector(m, e, NULL, "wind", still)) > 0.0)
        kt_unknown_count(&m->changes, "wind, so that the medium is at rest", e);
}

void kt_mjcf_read_options(kt_mjcf *m) {
    m->gravity = kt_vec3_make(0.0, 0.0, -9.81);
    for (const kt_element *e = kt_xml_child(m->root, "option"); e != NULL; e = kt_xml_next(e, "option")) {
        const kt_element *flag = kt_xml_child(e, "flag");
        m->gravity = kt_mjcf_vector(m, e, NULL, "gravity", m->gravity);
        read_groups(m, e);
        if (flag != NULL)
            read_flags(m, flag);
        read_medium(m, e);
    }
}
