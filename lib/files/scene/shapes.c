/* Several shapes of a body: their mass, centre of mass and inertia together.
 *
 * A shape has a mass of its own, or a share of the remaining mass of the body, in proportion to its volume. If none of
 * the shapes without a mass has a volume, slender rods share by length. With m = sum m_i:
 *   c = sum m_i c_i / m,   I = sum (I_i + m_i (|d_i|^2 1 - d_i d_i')),   d_i = c_i - c
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/shapes.h"

#include "compile/compile.h"

#include <math.h>

static double shape_length_of(const kt_shape *shape) {
    return shape->type == KT_SHAPE_ROD ? kt_vec3_norm_wide(kt_vec3_sub(shape->to, shape->from)) : 0.0;
}

/* ---- rules ------------------------------------------------------------------------------------------------------- */

typedef struct complaint {
    kt_reader *r;
    const kt_scope *scope;
    kt_node *node;
    bool good;
} complaint;

static void complain(void *user, const kt_place *place, const kt_error *error) {
    complaint *c = user;
    (void)place;
    c->good = kt_fault_at(c->r, KT_ERROR_SCENE, c->scope, c->node, "%s", error->message) && c->good;
}

static kt_body part_body_of(const kt_scene_part *part) {
    kt_body body = kt_body_default();
    body.name = "shape";
    body.mass = part->mass > 0.0 ? part->mass : 1.0;
    body.shape = part->shape;
    body.com_of_shape = body.inertia_of_shape = true;
    return body;
}

/* The rules of a single shape, and of its mass. */
static bool check_part(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_scene_part *part) {
    const kt_body body = part_body_of(part);
    kt_description description = kt_description_default();
    complaint c = {r, scope, node, true};
    description.bodies = &body;
    description.body_count = 1;
    const kt_status status = kt_description_check(&description, complain, &c, NULL);
    if (status == KT_ERROR_MEMORY)
        return kt_reader_out_of_memory(r);
    if (part->mass < 0.0 || isinf(part->mass))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "mass is %g; it cannot be negative", part->mass);
    return status == KT_OK && c.good;
}

/* ---- masses ------------------------------------------------------------------------------------------------------ */

/* Gives shapes without a mass their share of the remaining mass. */
static bool share(kt_reader *r, const kt_scope *scope, kt_node *const *nodes, kt_scene_part *parts, int count,
                  double left) {
    double volume = 0.0, length = 0.0;
    for (int i = 0; i < count; i++)
        if (isnan(parts[i].mass)) {
            volume += kt_shape_volume(&parts[i].shape);
            length += shape_length_of(&parts[i].shape);
        }
    for (int i = 0; i < count; i++) {
        if (!isnan(parts[i].mass))
            continue;
        const double part =
            volume > 0.0 ? kt_shape_volume(&parts[i].shape) / volume : shape_length_of(&parts[i].shape) / length;
        if (!(part > 0.0))
            return kt_fault_at(r, KT_ERROR_SCENE, scope, nodes[i],
                               "the shape has no volume, by which it could have a share of the body's mass; give it a "
                               "`mass`");
        parts[i].mass = part * left;
    }
    return true;
}

static bool settle_masses(kt_reader *r, const kt_scope *scope, kt_node *node, kt_node *const *nodes,
                          kt_scene_part *parts, int count, bool has_mass, double *mass) {
    double own = 0.0;
    int without = 0;
    for (int i = 0; i < count; i++) {
        without += isnan(parts[i].mass);
        own += isnan(parts[i].mass) ? 0.0 : parts[i].mass;
    }
    if (!has_mass && without > 0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "some shapes have a `mass` and %d %s none; give all of them one, or the body its `mass`",
                           without, without == 1 ? "has" : "have");
    if (!has_mass)
        *mass = own;
    if (own > *mass * (1.0 + 1e-9) || (without == 0 && own < *mass * (1.0 - 1e-9)))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "masses of the shapes add up to %g kg, and the body's mass is %g kg; leave one of them out",
                           own, *mass);
    return without == 0 || share(r, scope, nodes, parts, count, fmax(*mass - own, 0.0));
}

/* ---- all of them ------------------------------------------------------------------------------------------------- */

static kt_sym3 shifted(kt_sym3 i, double m, kt_vec3 d) {
    const double dd = kt_vec3_dot(d, d);
    return kt_sym3_make(i.xx + m * (dd - d.x * d.x), i.yy + m * (dd - d.y * d.y), i.zz + m * (dd - d.z * d.z),
                        i.xy - m * d.x * d.y, i.xz - m * d.x * d.z, i.yz - m * d.y * d.z);
}

bool kt_parts_settle(kt_reader *r, const kt_scope *scope, kt_node *node, kt_node *const *nodes, kt_scene_part *parts,
                     int count, unsigned given, kt_body *body) {
    kt_vec3 com = kt_vec3_make(0.0, 0.0, 0.0);
    kt_sym3 inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), own;
    bool good = true, any = (given & KT_GIVES_MASS) != 0;
    for (int i = 0; i < count; i++) {
        good = check_part(r, scope, nodes[i], &parts[i]) && good;
        any = any || !isnan(parts[i].mass);
    }
    const unsigned both = KT_GIVES_COM | KT_GIVES_INERTIA;
    if (!good || !any || count == 0 || ((given & both) == both && (given & KT_GIVES_MASS)))
        return good; /* pictures alone, or all is given */
    if (!settle_masses(r, scope, node, nodes, parts, count, (given & KT_GIVES_MASS) != 0, &body->mass))
        return false;
    for (int i = 0; i < count && body->mass > 0.0; i++) {
        const kt_body part = part_body_of(&parts[i]);
        kt_vec3 c;
        if (kt_body_inertia(&part, &c, &own, NULL) != KT_OK)
            return good; /* not reached: it has passed the rules */
        com = kt_vec3_add(com, kt_vec3_scale(parts[i].mass / body->mass, c));
    }
    for (int i = 0; i < count && body->mass > 0.0; i++) {
        const kt_body part = part_body_of(&parts[i]);
        kt_vec3 c;
        if (parts[i].mass > 0.0 && kt_body_inertia(&part, &c, &own, NULL) == KT_OK)
            inertia = kt_sym3_add(inertia, shifted(own, parts[i].mass, kt_vec3_sub(c, com)));
    }
    body->com = given & KT_GIVES_COM ? body->com : com;
    body->inertia = given & KT_GIVES_INERTIA ? body->inertia : inertia;
    return true;
}
