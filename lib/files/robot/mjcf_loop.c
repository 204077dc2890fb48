/* Equalities of MJCF as loops.
 *
 * MuJoCo holds equalities with soft forces, whereas the library holds them exactly. Their numbers refer to the
 * reference positions of all joints, at which the bodies have the poses of <body>.
 *   A `connect` keeps a point of the first body on the point of the second body that is there at these positions.
 *   A `weld` keeps the point `anchor` and the axes of the second body at a pose in the first body. The pose is
 *   `relpose`, or that at the reference positions. With torquescale 0 only the point is held.
 *   A `joint` or `tendon` has a polynomial, whose nonlinear part is the coupling's formula:
 *     y - y0 = a0 + a1 (x - x0) + a2 (x - x0)^2 + ...
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <string.h>

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* The two bodies of an equality; the second is the world where none is named. */
static bool find_bodies(kt_mjcf *m, const kt_element *e, int bodies[2]) {
    bodies[0] = kt_mjcf_find(m, e, "body1", KT_MJCF_BODIES);
    bodies[1] = kt_xml_attribute(e, "body2") != NULL ? kt_mjcf_find(m, e, "body2", KT_MJCF_BODIES) : 0;
    return bodies[0] >= 0 && bodies[1] >= 0;
}

/* The pose of MuJoCo's frame of a body in the world, at the reference positions. */
static kt_pose world_of(const kt_mjcf *m, int body) {
    return kt_pose_compose(kt_mjcf_body_at(m, body)->world, kt_mjcf_body_at(m, body)->frame);
}

/* `pose`: in MuJoCo's frame of the body. */
static kt_end end_in(const kt_mjcf *m, int body, kt_pose pose) {
    const kt_mjcf_body *b = kt_mjcf_body_at(m, body);
    return kt_end_at(b->name, kt_pose_compose(b->frame, pose));
}

static kt_end end_at_site(const kt_mjcf *m, int site) {
    const kt_mjcf_site *s = kt_mjcf_site_at(m, site);
    return kt_end_at(kt_mjcf_body_at(m, s->body)->name, s->pose);
}

/* Ends at two sites; false if there are none, or they do not exist. */
static bool find_sites(kt_mjcf *m, const kt_element *e, kt_end ends[2]) {
    const int a = kt_mjcf_find(m, e, "site1", KT_MJCF_SITES), b = kt_mjcf_find(m, e, "site2", KT_MJCF_SITES);
    if (a < 0 || b < 0)
        return false;
    ends[0] = end_at_site(m, a);
    ends[1] = end_at_site(m, b);
    return true;
}

/* The anchor in the first body, and the point of the second body that is there at the reference positions. */
static bool find_connected(kt_mjcf *m, const kt_element *e, kt_end ends[2]) {
    int bodies[2];
    if (kt_xml_attribute(e, "site1") != NULL)
        return find_sites(m, e, ends);
    if (kt_xml_attribute(e, "anchor") == NULL)
        return kt_mjcf_fault(m, e, "the attribute 'anchor' is missing");
    if (!find_bodies(m, e, bodies))
        return false;
    kt_pose first = kt_pose_identity(), second = kt_pose_identity();
    first.position = kt_mjcf_vector(m, e, NULL, "anchor", first.position);
    second.position =
        kt_pose_apply(kt_pose_invert(world_of(m, bodies[1])), kt_pose_apply(world_of(m, bodies[0]), first.position));
    ends[0] = end_in(m, bodies[0], first);
    ends[1] = end_in(m, bodies[1], second);
    return true;
}

/* Without a relpose, or with one whose quaternion is zero, the bodies keep their pose at the reference positions. */
static bool find_welded(kt_mjcf *m, const kt_element *e, kt_end ends[2]) {
    int bodies[2];
    double v[7] = {0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    if (kt_xml_attribute(e, "site1") != NULL)
        return find_sites(m, e, ends);
    if (!find_bodies(m, e, bodies))
        return false;
    (void)kt_mjcf_numbers(m, e, NULL, "relpose", 7, 7, v);
    const kt_quat q = kt_quat_make(v[3], v[4], v[5], v[6]);
    kt_pose second = kt_pose_identity();
    second.position = kt_mjcf_vector(m, e, NULL, "anchor", second.position);
    kt_pose first =
        kt_pose_compose(kt_pose_invert(world_of(m, bodies[0])), kt_pose_compose(world_of(m, bodies[1]), second));
    if (kt_quat_norm_squared(q) > 0.0) {
        first.position = kt_vec3_make(v[0], v[1], v[2]);
        first.rotation = kt_mat3_from_quat(kt_quat_normalize(q));
    }
    ends[0] = end_in(m, bodies[0], first);
    ends[1] = end_in(m, bodies[1], second);
    return true;
}

/* A <weld>, or a <connect>, which holds a point alone. */
static void join_bodies(kt_mjcf *m, const kt_element *e, bool is_weld) {
    kt_end ends[2];
    if (!(is_weld ? find_welded(m, e, ends) : find_connected(m, e, ends)))
        return;
    const double turning = is_weld ? kt_mjcf_number(m, e, "equality", "torquescale", 1.0) : 0.0;
    if (turning != 0.0 && turning != 1.0)
        kt_left_count(&m->notes.scaled, e);
    kt_loop *loop = kt_draft_loop(&m->draft, e, turning != 0.0 ? KT_LOOP_WELD : KT_LOOP_SPHERICAL,
                                  kt_element_name(e, is_weld ? "weld" : "connect"));
    if (loop != NULL)
        memcpy(loop->between, ends, sizeof ends);
}

/* ---- joints and tendons ------------------------------------------------------------------------------------------ */

/* One side of an equality of scalars: terms of joints, and the value at the reference positions. */
typedef struct side {
    kt_mjcf_term own;
    const kt_mjcf_term *terms;
    int count;
    double reference;
} side;

static bool find_joint(kt_mjcf *m, const kt_element *e, const char *attribute, side *s) {
    const int joint = kt_mjcf_find(m, e, attribute, KT_MJCF_JOINTS);
    if (joint < 0)
        return false;
    if (!kt_mjcf_is_scalar(kt_mjcf_joint_at(m, joint)))
        return kt_mjcf_fault(m, e, "only hinge and slide joints can be equal");
    *s = (side){.own = {joint, 1.0}, .count = 1, .reference = kt_mjcf_joint_at(m, joint)->ref};
    return true;
}

static bool find_tendon(kt_mjcf *m, const kt_element *e, const char *attribute, side *s) {
    const char *name = kt_xml_attribute(e, attribute);
    const int tendon = name != NULL ? kt_names_find(&m->names, KT_MJCF_TENDONS, name) : -1;
    if (tendon < 0 || kt_mjcf_tendon_at(m, tendon)->count == 0) {
        kt_unknown_count(&m->forces, "equality of a tendon that is left out", e);
        return false;
    }
    const kt_mjcf_tendon *t = kt_mjcf_tendon_at(m, tendon);
    *s = (side){.terms = kt_mjcf_term_at(m, t->first), .count = t->count, .reference = t->length};
    return true;
}

static int add_terms(const kt_mjcf *m, const side *s, double factor, kt_term *to) {
    for (int i = 0; i < s->count; i++) {
        const kt_mjcf_term *term = s->terms != NULL ? &s->terms[i] : &s->own;
        to[i] = (kt_term){kt_mjcf_joint_at(m, term->joint)->name, factor * term->coefficient};
    }
    return s->count;
}

/* Writes `(position.a + -0.1)`, for a tendon `(0.5*position.a + 2*position.b + -0.1)`. */
static void put_length(const kt_mjcf *m, const side *s, kt_formula_text *to) {
    for (int i = 0; i < s->count; i++) {
        const kt_mjcf_term *term = s->terms != NULL ? &s->terms[i] : &s->own;
        kt_formula_put(to, i == 0 ? "(" : " + ");
        kt_mjcf_put_coordinate(to, term->coefficient, "position", kt_mjcf_joint_at(m, term->joint)->name);
    }
    if (s->reference != 0.0)
        kt_formula_print(to, " + %g", -s->reference);
    kt_formula_put(to, ")");
}

/* Writes `-a2 (x - x0)^2 - a3 (x - x0)^3 - a4 (x - x0)^4`; NULL after reporting the reason. `others`: the number of
 * joints of the other side. */
static const char *write_formula(kt_mjcf *m, const kt_element *e, const side *x, int others, const double a[5]) {
    static const char *const powers[] = {"^2", "^3", "^4"};
    kt_formula_text to = {.whole = true};
    for (int k = 2; k < 5; k++) {
        if (a[k] == 0.0)
            continue;
        kt_formula_print(&to, "%s%g*", to.length > 0 ? " + " : "", -a[k]);
        put_length(m, x, &to);
        kt_formula_put(&to, powers[k - 2]);
    }
    if (to.whole && x->count + others <= KT_FORMULA_VARIABLE_MAX)
        return kt_mjcf_keep_formula(m, &to);
    kt_unknown_count(&m->forces, "equality by a polynomial of too many joints, or of names that are too long", e);
    return NULL;
}

/* y - a1 x - a2 (x - x0)^2 - ... = y0 + a0 - a1 x0 for two joints or two tendons. Without x, y is constant. */
static void couple_mjcf_joints(kt_mjcf *m, const kt_element *e, bool is_tendon) {
    double a[5] = {0.0, 1.0, 0.0, 0.0, 0.0};
    side y, x = {.count = 0};
    bool (*find)(kt_mjcf *, const kt_element *, const char *, side *) = is_tendon ? find_tendon : find_joint;
    const char *second = is_tendon ? "tendon2" : "joint2";
    (void)kt_mjcf_numbers(m, e, NULL, "polycoef", 1, 5, a);
    if (!find(m, e, is_tendon ? "tendon1" : "joint1", &y) ||
        (kt_xml_attribute(e, second) != NULL && !find(m, e, second, &x)))
        return;
    const bool is_linear = x.count == 0 || (a[2] == 0.0 && a[3] == 0.0 && a[4] == 0.0);
    const char *formula = is_linear ? NULL : write_formula(m, e, &x, y.count, a);
    if (!is_linear && formula == NULL)
        return;
    const char *name = kt_element_name(e, is_tendon ? "tendon_equality" : "joint_equality");
    kt_term *terms;
    kt_loop *loop = kt_draft_coupling(&m->draft, e, name, y.count + x.count, &terms);
    if (loop == NULL)
        return;
    const int first = add_terms(m, &y, 1.0, terms);
    loop->term_count = kt_terms_merge(terms, first + add_terms(m, &x, -a[1], terms + first));
    loop->formula = formula;
    loop->offset = y.reference + a[0] - (x.count > 0 ? a[1] * x.reference : 0.0);
}

/* ---- all of them ------------------------------------------------------------------------------------------------- */

void kt_mjcf_equalities(kt_mjcf *m) {
    for (const kt_element *e = kt_mjcf_section(m, "equality", NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_section(m, "equality", e)) {
        const int before = m->draft.loops.count;
        if (m->off.equalities)
            kt_left_count(&m->notes.idle_ties, e);
        else if (!kt_mjcf_flag(m, e, "equality", "active", true))
            kt_left_count(&m->notes.inactive, e);
        else if (strcmp(e->name, "connect") == 0 || strcmp(e->name, "weld") == 0)
            join_bodies(m, e, strcmp(e->name, "weld") == 0);
        else if (strcmp(e->name, "joint") == 0 || strcmp(e->name, "tendon") == 0)
            couple_mjcf_joints(m, e, strcmp(e->name, "tendon") == 0);
        if (m->draft.loops.count > before)
            kt_left_count(&m->notes.soft, e);
    }
}
