/* Links and joints of SDF.
 *
 * A joint of two axes is two joints with a link without mass between them, so that each axis has its own damping,
 * spring and limits. The types revolute2 and universal turn about `axis`, then about `axis2`. A piston turns about its
 * axis and slides along it.
 *
 * An axis is a vector in the frame that `expressed_in` names, else in that of the joint. Until 1.6,
 * `use_parent_model_frame` selects the frame of the model. In 1.4 the axis is always in this frame.
 *
 * A screw of pitch p metres a turn advances by p / (2 pi) metres a radian. The older thread_pitch t is in radians a
 * metre, of a left-handed thread: -1 / t metres a radian.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

typedef struct kind {
    const char *name;
    kt_joint_type first, second; /* second: KT_JOINT_FIXED where there is none */
} kind;

static const kind kinds[] = {
    {"revolute", KT_JOINT_REVOLUTE, KT_JOINT_FIXED},     {"continuous", KT_JOINT_REVOLUTE, KT_JOINT_FIXED},
    {"prismatic", KT_JOINT_PRISMATIC, KT_JOINT_FIXED},   {"fixed", KT_JOINT_FIXED, KT_JOINT_FIXED},
    {"ball", KT_JOINT_SPHERICAL, KT_JOINT_FIXED},        {"screw", KT_JOINT_SCREW, KT_JOINT_FIXED},
    {"universal", KT_JOINT_REVOLUTE, KT_JOINT_REVOLUTE}, {"revolute2", KT_JOINT_REVOLUTE, KT_JOINT_REVOLUTE},
    {"piston", KT_JOINT_REVOLUTE, KT_JOINT_PRISMATIC},
};

static const kind *find_sdf_kind(kt_sdf *m, const kt_element *e) {
    const char *type = kt_xml_attribute(e, "type");
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds && type != NULL; i++)
        if (strcmp(kinds[i].name, type) == 0)
            return &kinds[i];
    (void)kt_robot_fault(
        m->r, e,
        "%s'%.40s'; it is revolute, continuous, prismatic, fixed, ball, screw, universal, revolute2, "
        "piston or gearbox",
        type != NULL ? "there is no type " : "the attribute 'type' is missing: ", type != NULL ? type : "");
    return NULL;
}

/* ---- axes -------------------------------------------------------------------------------------------------------- */

void kt_sdf_read_axis(kt_sdf *m, kt_sdf_joint *j, const char *which) {
    const kt_sdf_frame *f = kt_sdf_frame_at(m, j->frame);
    j->axis = kt_xml_child(j->element, which);
    const kt_element *xyz = j->axis != NULL ? kt_xml_child(j->axis, "xyz") : NULL;
    const char *expressed = xyz != NULL ? kt_xml_attribute(xyz, "expressed_in") : NULL;
    j->direction = kt_sdf_vector(m, j->axis, "xyz", kt_vec3_make(0.0, 0.0, 1.0));
    if (!(kt_vec3_norm_wide(j->direction) > 0.0)) {
        (void)kt_robot_fault(m->r, xyz, "the axis is zero");
        j->direction = kt_vec3_make(0.0, 0.0, 1.0);
    }
    j->expressed = j->frame;
    if (f->version <= 106 && j->axis != NULL && kt_sdf_flag(m, j->axis, "use_parent_model_frame", f->version <= 104))
        j->expressed = f->home;
    else if (expressed != NULL && *expressed != '\0')
        j->expressed = kt_sdf_find(m, xyz, j->frame, expressed);
    if (j->expressed < 0)
        j->expressed = j->frame; /* which has been reported */
}

/* screw_thread_pitch has precedence; without either element, the pitch is 1 m for each turn. */
static void read_pitch(kt_sdf *m, kt_sdf_joint *j) {
    double thread = 1.0, pitch = 1.0;
    const bool has_thread = kt_sdf_numbers(m, j->element, "thread_pitch", 1, &thread);
    const bool has_pitch = kt_sdf_numbers(m, j->element, "screw_thread_pitch", 1, &pitch);
    if (has_pitch || !has_thread)
        j->pitch = pitch / (2.0 * pi);
    else if (thread != 0.0)
        j->pitch = -1.0 / thread;
    else
        (void)kt_robot_fault(m->r, kt_xml_child(j->element, "thread_pitch"), "the thread is zero radians a metre");
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* is_between: the link without mass between the two axes of a joint, whose element and frame it has. */
static int add_link(kt_sdf *m, const kt_element *e, int frame, bool is_between) {
    const int index = m->links.count;
    kt_sdf_link *link = kt_list_add(m->r, &m->r->scratch, &m->links, sizeof *link);
    if (link == NULL)
        return -1;
    *link = (kt_sdf_link){.element = e, .frame = frame, .is_between = is_between, .carrier = -1, .depth = -1};
    link->is_static = kt_sdf_frame_at(m, frame)->is_static && !is_between;
    link->index = -1;
    return index;
}

/* which: the child element that describes the axis. */
static void add_sdf_joint(kt_sdf *m, int frame, kt_joint_type type, const char *which, int parent, int child) {
    const int index = m->joints.count;
    kt_sdf_joint *j = kt_list_add(m->r, &m->r->scratch, &m->joints, sizeof *j);
    if (j == NULL)
        return;
    if (kt_sdf_frame_at(m, frame)->link < 0)
        kt_sdf_frame_at(m, frame)->link = index;
    *j = (kt_sdf_joint){.element = kt_sdf_frame_at(m, frame)->element, .frame = frame, .type = type};
    j->parent = parent;
    j->child = child;
    j->body = -1;
    j->direction = kt_vec3_make(0.0, 0.0, 1.0);
    j->expressed = frame;
    if (kt_sdf_is_scalar(j))
        kt_sdf_read_axis(m, j, which);
    if (type == KT_JOINT_SCREW)
        read_pitch(m, j);
    const kt_element *physics = kt_xml_child(j->element, "physics");
    const kt_element *simbody = physics != NULL ? kt_xml_child(physics, "simbody") : NULL;
    j->is_cut = kt_sdf_flag(m, simbody, "must_be_loop_joint", false);
}

/* The link that a joint names; -1 after reporting. */
int kt_sdf_link_named(kt_sdf *m, int frame, const char *child) {
    const int found = kt_sdf_named_by(m, frame, child);
    return found >= 0 ? kt_sdf_link_of(m, kt_xml_child(kt_sdf_frame_at(m, frame)->element, child), found) : -1;
}

static void read_sdf_joint(kt_sdf *m, int frame) {
    const kt_element *e = kt_sdf_frame_at(m, frame)->element;
    const char *type = kt_xml_attribute(e, "type");
    const int parent = kt_sdf_link_named(m, frame, "parent"), child = kt_sdf_link_named(m, frame, "child");
    if (kt_text_is(type, "gearbox")) {
        int *added = kt_list_add(m->r, &m->r->scratch, &m->gears, sizeof *added);
        if (added != NULL)
            *added = frame;
        return;
    }
    const kind *k = find_sdf_kind(m, e);
    if (parent < 0 || child < 0 || k == NULL)
        return;
    if (parent == child) {
        (void)kt_robot_fault(m->r, e, "parent and child are the same link");
        return;
    }
    if (k->second == KT_JOINT_FIXED) {
        add_sdf_joint(m, frame, k->first, "axis", parent, child);
        return;
    }
    const int between = add_link(m, e, frame, true);
    if (between < 0)
        return;
    kt_left_count(&m->halves, e);
    add_sdf_joint(m, frame, k->first, "axis", parent, between);
    if (m->joints.count > 0)
        kt_sdf_joint_at(m, m->joints.count - 1)->is_cut = false; /* the second is */
    add_sdf_joint(m, frame, k->second, k->second == KT_JOINT_PRISMATIC ? "axis" : "axis2", between, child);
}

void kt_sdf_read_joints(kt_sdf *m) {
    (void)add_link(m, m->root, 0, false);
    for (int i = 1; i < m->frames.count && !m->r->out_of_memory; i++)
        if (kt_sdf_frame_at(m, i)->kind == KT_SDF_LINK) {
            if (strcmp(kt_sdf_frame_at(m, i)->name, "world") == 0)
                kt_left_count(&m->reserved, kt_sdf_frame_at(m, i)->element);
            kt_sdf_frame_at(m, i)->link = add_link(m, kt_sdf_frame_at(m, i)->element, i, false);
        }
    for (int i = 1; i < m->frames.count && !m->r->out_of_memory; i++)
        if (kt_sdf_frame_at(m, i)->kind == KT_SDF_JOINT)
            read_sdf_joint(m, i);
}
