/* Elastic torques between the bodies of a cable in MJCF, those of the plugin mujoco.elasticity.cable.
 *
 * A section with the torsion constant J and the second moments of area Iy, Iz resists twist and bending over the
 * length L to the body before it: k = (G J, E Iy, E Iz) / L about x, y, z. Let phi be the Euler vector of a body
 * relative to the one before it, and phi0 its value at rest. MuJoCo's torque on the body is
 *     -diag(k) (phi - phi0)   in the axes of the body before it,
 * which has no energy unless phi stays along one axis, or all k are equal and phi0 = 0. Here a bushing acts, whose
 * axes are halfway between both bodies at rest. Its torque has an energy. It equals MuJoCo's in these two cases. Else
 * both differ by about |phi| (1 - least k / largest k) / 2 of the torque. */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

static const double TYPICAL_ANGLE = 0.1; /* rad, between neighbours of a cable that bends */

/* J, Iy and Iz of the first geom of a body; false if it is no capsule, cylinder or box. */
static bool read_cable_section(kt_mjcf *m, const kt_mjcf_body *b, double section[3]) {
    const double pi = 3.14159265358979323846;
    const kt_element *e = kt_xml_child(b->element, "geom");
    const char *type = e != NULL ? kt_mjcf_text(m, e, "geom", "type") : NULL;
    double size[3] = {0.0, 0.0, 0.0};
    if (type == NULL || kt_mjcf_numbers(m, e, "geom", "size", 1, 3, size) == 0)
        return false;
    if (strcmp(type, "capsule") == 0 || strcmp(type, "cylinder") == 0) {
        section[1] = section[2] = 0.25 * pi * pow(size[0], 4.0);
        section[0] = 2.0 * section[1];
        return true;
    }
    const double h = size[1], w = size[2], large = fmax(h, w), small = fmin(h, w), ratio = small / large;
    if (strcmp(type, "box") != 0 || !(small > 0.0))
        return false;
    section[0] = large * pow(small, 3.0) * (16.0 / 3.0 - 3.36 * ratio * (1.0 - pow(ratio, 4.0) / 12.0));
    section[1] = pow(2.0 * w, 3.0) * 2.0 * h / 12.0;
    section[2] = pow(2.0 * h, 3.0) * 2.0 * w / 12.0;
    return true;
}

static const kt_element *elasticity_of(const kt_mjcf_body *b) { return kt_xml_child(b->element, KT_MJCF_ELASTICITY); }

/* Whether the body that carries another one is its neighbour in a cable. */
static bool has_neighbour(const kt_mjcf *m, const kt_mjcf_body *b) {
    const kt_element *here = elasticity_of(b),
                     *before = b->parent > 0 ? elasticity_of(kt_mjcf_body_at(m, b->parent)) : NULL;
    return before != NULL && kt_text_is(kt_xml_attribute(here, "instance"), kt_xml_attribute(before, "instance"));
}

static void note_cable(kt_mjcf *m, const double k[3], double angle, const kt_element *e) {
    const double most = fmax(k[0], fmax(k[1], k[2])), least = fmin(k[0], fmin(k[1], k[2]));
    const double share = 0.5 * (angle + TYPICAL_ANGLE) * (1.0 - least / most);
    if (!(share > 1e-9 || angle > 0.0))
        return;
    m->cable_share = fmax(m->cable_share, angle > 0.0 && !(share > 1e-9) ? 0.5 * angle : share);
    kt_left_count(&m->cables, e);
}

void kt_mjcf_add_elasticity(kt_mjcf *m, const kt_mjcf_body *b) {
    const kt_element *e = elasticity_of(b);
    double section[3], k[6] = {0.0};
    if (e == NULL || !has_neighbour(m, b))
        return;
    const kt_mjcf_joint *j = b->joint_count == 1 ? kt_mjcf_joint_at(m, b->first_joint) : NULL;
    const double length = kt_vec3_norm(b->pose.position);
    if (j == NULL || j->type != KT_MJCF_BALL || !(length > 0.0) || !read_cable_section(m, b, section)) {
        kt_unknown_count(&m->forces, "elasticity of a cable at a body without a ball joint, a length or a section", e);
        return;
    }
    k[3] = section[0] * kt_mjcf_number(m, e, NULL, "twist", 0.0) / length;
    k[4] = section[1] * kt_mjcf_number(m, e, NULL, "bend", 0.0) / length;
    k[5] = section[2] * kt_mjcf_number(m, e, NULL, "bend", 0.0) / length;
    if (!(fmax(k[3], fmax(k[4], k[5])) > 0.0))
        return;
    const kt_joint *joint = &((const kt_body *)m->draft.bodies.items)[j->carrier_index].joint;
    kt_vec3 rest = kt_vec3_make(0.0, 0.0, 0.0);
    if (!kt_text_is(kt_xml_attribute(e, "flat"), "true"))
        rest = kt_euler_vector_from_matrix(b->pose.rotation);
    kt_effect *effect = kt_draft_effect(&m->draft, e, KT_EFFECT_BUSHING);
    if (effect == NULL)
        return;
    effect->between[0].body = ((const kt_body *)m->draft.bodies.items)[j->carrier_index].parent;
    effect->between[0].at = joint->at;
    effect->between[0].rotation = kt_rotation_of_matrix(kt_matrix_from_euler_vector(kt_vec3_scale(0.5, rest)));
    effect->between[1].body = j->carrier;
    effect->between[1].rotation = kt_rotation_of_matrix(kt_matrix_from_euler_vector(kt_vec3_scale(-0.5, rest)));
    memcpy(effect->stiffnesses, k, sizeof k);
    note_cable(m, k + 3, kt_vec3_norm(rest), e);
}
