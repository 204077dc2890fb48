/* Masses that files in URDF do not have in <inertial>: from the options, from shapes, and from rotors of transmissions.
 *
 * A rotor of inertia J behind a reduction n, which turns n times as fast as the joint, has the armature n^2 J.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_axes.h"
#include "robot/urdf.h"

#include "algebra/vector_parts.h"

/* ---- transmissions ----------------------------------------------------------------------------------------------- */

/* Reads a number from an attribute `value`, or from the text. Returns whether there is one; another text is counted. */
static bool read_value(kt_urdf *u, const kt_element *e, double *value) {
    const char *text = e != NULL ? kt_element_value(e) : NULL;
    double read;
    if (text == NULL)
        return false;
    const bool is_number = kt_parse_numbers(text, 1, &read) == 1;
    if (is_number)
        *value = read;
    else
        kt_left_count(&u->words, e);
    return is_number;
}

/* The first element of one of the names in a joint or an actuator of a transmission. */
static const kt_element *find_first_named(const kt_element *transmission, const char *const *names) {
    for (const kt_element *part = transmission->first; part != NULL; part = part->next)
        for (int i = 0; names[i] != NULL; i++)
            if (kt_xml_child(part, names[i]) != NULL)
                return kt_xml_child(part, names[i]);
    return NULL;
}

/* A rotor of the inertia J behind the reduction n acts in the joint as the armature n^2 J. */
static void read_transmission(kt_urdf *u, const kt_element *e) {
    static const char *const reductions[] = {"mechanicalReduction", "mechanical_reduction", "drake:gear_ratio", NULL};
    static const char *const inertias[] = {"rotorInertia", "motorInertia", "rotor_inertia", "drake:rotor_inertia",
                                           NULL};
    const kt_element *joint = kt_xml_child(e, "joint");
    const char *name = joint != NULL ? kt_xml_attribute(joint, "name") : NULL;
    const int index = name != NULL ? kt_names_find(&u->names, JOINTS, name) : -1;
    double reduction = 1.0, inertia = 0.0;
    const kt_element *ratio = find_first_named(e, reductions);
    const int words = u->words.count;
    const bool has_ratio = ratio == NULL || read_value(u, ratio, &reduction);
    const bool has_rotor = read_value(u, find_first_named(e, inertias), &inertia) && inertia != 0.0 && has_ratio;
    if (u->words.count > words)
        return;
    if (!has_rotor || index < 0 || u->joints[index].kind == NULL || !u->joints[index].kind->is_scalar) {
        kt_left_count(&u->ungeared, e);
        return;
    }
    u->joints[index].armature += reduction * reduction * inertia;
    kt_left_count(&u->geared, e);
}

void kt_urdf_transmissions(kt_urdf *u) {
    for (const kt_element *e = kt_xml_child(u->robot, "transmission"); e != NULL; e = kt_xml_next(e, "transmission"))
        read_transmission(u, e);
}

/* ---- settings of MuJoCo's compiler ------------------------------------------------------------------------------- */

/* Adds masses of bodies that a joint of their path moves: MuJoCo makes others parts of the world. */
static double moving_mass(const kt_urdf *u, double scale) {
    double total = 0.0;
    if (u->draft.parents == NULL)
        return 0.0;
    for (int i = 0; i < u->draft.bodies.count; i++) {
        kt_body *body = kt_draft_body_at(&u->draft, i);
        int at = i;
        for (int steps = 0; steps < u->draft.bodies.count && at >= 0; steps++) {
            if (kt_draft_body_at(&u->draft, at)->joint.type != KT_JOINT_FIXED)
                break;
            at = u->draft.parents[at];
        }
        if (at < 0)
            continue;
        total += body->mass;
        body->mass *= scale;
        body->inertia = kt_sym3_scaled(scale, body->inertia);
    }
    return total;
}

void kt_urdf_settle_masses(kt_urdf *u) {
    const kt_urdf_compiler *c = &u->compiler;
    for (int i = 0; i < u->link_count; i++) {
        const kt_urdf_link *link = &u->links[i];
        kt_body *body = link->index >= 0 && link->carrier >= 0 ? kt_draft_body_at(&u->draft, link->index) : NULL;
        if (body == NULL)
            continue;
        const bool is_light = body->mass < c->mass_least;
        body->mass = is_light ? c->mass_least : body->mass;
        const bool is_raised =
            c->inertia_least > 0.0 && kt_inertia_raise(&body->inertia, kt_mjcf_axes(body->inertia), c->inertia_least);
        if (is_light || is_raised)
            kt_left_count(&u->bounded, link->element);
        if (c->balances && kt_inertia_balance(&body->inertia))
            kt_left_count(&u->balanced, link->element);
    }
    if (!(c->total_mass > 0.0) || u->draft.bodies.count == 0 || !kt_draft_find_parents(&u->draft))
        return;
    const double total = moving_mass(u, 1.0);
    if (total > 0.0)
        (void)moving_mass(u, c->total_mass / total);
}

/* ---- masses of the options --------------------------------------------------------------------------------------- */

/* Accepts a robot without any mass, and notes that no body has one: it has poses and pictures, but no accelerations. */
static void accept_missing_masses(kt_urdf *u) {
    const kt_body *bodies = u->draft.bodies.items;
    bool moves = false;
    for (int b = 0; b < u->draft.bodies.count; b++) {
        if (bodies[b].mass > 0.0)
            return;
        moves = moves || bodies[b].joint.type != KT_JOINT_FIXED;
    }
    if (!moves)
        return;
    u->inertias.limit = KT_INERTIA_ACCEPT;
    kt_left_count(&u->massless, u->robot);
}

void kt_urdf_given_masses(kt_urdf *u) {
    kt_masses_give(&u->draft, u->source->options);
    accept_missing_masses(u);
}
