/* The armature of spatial tendons of MJCF, an inertia a along the length L of a straight path.
 *
 * The armature adds a J'J to the mass matrix and a J' (dJ/dt v) to the bias, with J = dL/dq. A slider without mass has
 * the armature a and the position s, and a coupling keeps s = L. Eliminating s by s' = J v gives these terms exactly.
 *
 * The coupling needs coordinates. Between two points p and q on different bodies, three sliders without mass carry a
 * point along the axes of the body of p. A spherical loop keeps this point at q, so that the positions x, y, z of these
 * sliders are q - p. With the divisor n_i of each part of the path:
 *
 *     s - sum_i sqrt(x_i^2 + y_i^2 + z_i^2) / n_i = the length of the parts within bodies
 *
 * MuJoCo rejects armatures of paths around geoms.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include "kinetree/effect.h"

#include <string.h>

enum { PARTS_MOST = (KT_FORMULA_VARIABLE_MAX - 1) / 3 };

/* A part of a path between two points on different bodies. */
typedef struct part {
    const kt_path_point *from, *to;
    kt_vec3 start; /* at the reference positions, axes of the body of `from` */
    double divisor;
} part;

typedef struct parts {
    part items[PARTS_MOST];
    int count;
    double constant; /* the length of the other parts */
} parts;

/* The second point relative to the first, in the axes of the first body. */
static kt_vec3 offset_between(const kt_mjcf *m, const kt_end *from, const kt_end *to) {
    const kt_pose a = kt_mjcf_body_at(m, kt_mjcf_body_of_end(m, from))->world;
    const kt_pose b = kt_mjcf_body_at(m, kt_mjcf_body_of_end(m, to))->world;
    return kt_vec3_sub(kt_pose_apply(kt_pose_invert(a), kt_pose_apply(b, to->at)), from->at);
}

/* The parts of the path; false if it leads around a geom, has too many parts, or a part without a length. */
static bool find_path_parts(const kt_mjcf *m, const kt_mjcf_tendon *t, parts *p) {
    double divisor = t->path[0].divisor > 0.0 ? t->path[0].divisor : 1.0;
    *p = (parts){.count = 0};
    for (int i = 1; i < t->path_count; i++) {
        const kt_path_point *from = &t->path[i - 1], *to = &t->path[i];
        if (to->radius > 0.0)
            return false;
        if (to->divisor > 0.0) { /* a branch begins */
            divisor = to->divisor;
            continue;
        }
        const kt_vec3 start = offset_between(m, &from->end, &to->end);
        if (from->end.body == to->end.body)
            p->constant += kt_vec3_norm(start) / divisor;
        else if (p->count < PARTS_MOST && kt_vec3_norm(start) > 1e-9)
            p->items[p->count++] = (part){from, to, start, divisor};
        else
            return false;
    }
    return true;
}

/* A slider without mass; its name, or NULL after reporting. */
static const char *add_slider(kt_mjcf *m, const kt_mjcf_tendon *t, const char *wanted, const char *parent,
                              kt_joint joint) {
    kt_body *body = kt_draft_body(&m->draft, t->element, t->element);
    if (body == NULL)
        return NULL;
    body->name = kt_namer_make(&m->bodies_named, wanted);
    body->parent = parent;
    body->joint = joint;
    body->joint.type = KT_JOINT_PRISMATIC;
    body->joint.guess = true;
    const char *name = kt_namer_make(&m->joints_named, body->name);
    body->joint.name = strcmp(name, body->name) != 0 ? name : NULL;
    return name;
}

/* Whether the formula with the names of all sliders has room. */
static bool has_formula_room(const char *wanted, int count) {
    const size_t name = strlen(wanted) + 24; /* with what is around it */
    return name <= KT_EXPRESSION_NAME_MAX && (size_t)count * (3 * name + 40) <= KT_EXPRESSION_LENGTH_MAX;
}

/* Adds "-sqrt(position.x^2 + position.y^2 + position.z^2)/n". */
static void put_part(const char *const names[3], double divisor, kt_formula_text *to) {
    for (int k = 0; k < 3; k++) {
        kt_formula_put(to, k == 0 ? "-sqrt(" : " + ");
        kt_mjcf_put_coordinate(to, 1.0, "position", names[k]);
        kt_formula_put(to, k == 2 ? "^2)" : "^2");
    }
    if (divisor != 1.0)
        kt_formula_print(to, "/%g", divisor);
}

/* Adds the sliders of a part as terms without a coefficient, and its length to the formula. */
static void add_part_of_path(kt_mjcf *m, const kt_mjcf_tendon *t, const part *p, const char *wanted, kt_term *terms,
                             kt_formula_text *to) {
    const double start[3] = {p->start.x, p->start.y, p->start.z};
    const char *names[3], *parent = p->from->end.body;
    for (int k = 0; k < 3; k++) {
        kt_joint joint = kt_joint_default();
        joint.axis = kt_vec3_make(k == 0, k == 1, k == 2);
        joint.position[0] = start[k];
        if (k == 0)
            joint.at = p->from->end.at;
        names[k] = add_slider(m, t, wanted, parent, joint);
        if (names[k] == NULL)
            return;
        terms[k] = (kt_term){names[k], 0.0};
        parent = ((const kt_body *)m->draft.bodies.items)[m->draft.bodies.count - 1].name;
    }
    put_part(names, p->divisor, to);
    kt_loop *loop = kt_draft_loop(&m->draft, t->element, KT_LOOP_SPHERICAL, kt_element_name(t->element, "tendon"));
    if (loop == NULL)
        return;
    loop->between[0].body = parent;
    loop->between[1] = p->to->end;
}

static bool is_jointed(const kt_mjcf *m, int body, int base) {
    bool found = false;
    for (; body != base; body = kt_mjcf_body_at(m, body)->parent)
        found = found || kt_mjcf_body_at(m, body)->joint_count > 0;
    return found;
}

/* Whether the path joins branches: joints of which none carries the other. */
static bool joins_branches(const kt_mjcf *m, const kt_mjcf_tendon *t) {
    for (int i = 0; i < t->path_count; i++)
        for (int k = 0; k < i; k++) {
            const int a = kt_mjcf_body_of_end(m, &t->path[i].end), b = kt_mjcf_body_of_end(m, &t->path[k].end);
            const int common = kt_mjcf_common_body(m, a, b);
            if (is_jointed(m, a, common) && is_jointed(m, b, common))
                return true;
        }
    return false;
}

void kt_mjcf_add_armature(kt_mjcf *m, const kt_mjcf_tendon *t) {
    const char *wanted = kt_element_name(t->element, "tendon");
    kt_formula_text to = {.whole = true};
    kt_joint joint = kt_joint_default();
    parts p;
    if (!find_path_parts(m, t, &p) || !has_formula_room(wanted, p.count)) {
        kt_left_count(&m->notes.armatures, t->element);
        return;
    }
    if (p.count == 0) /* a constant length */
        return;
    joint.armature[0] = kt_mjcf_number(m, t->element, "tendon", "armature", 0.0);
    joint.position[0] = p.constant;
    for (int i = 0; i < p.count; i++)
        joint.position[0] += kt_vec3_norm(p.items[i].start) / p.items[i].divisor;
    const char *length = add_slider(m, t, wanted, NULL, joint);
    kt_term *terms;
    kt_loop *loop = kt_draft_coupling(&m->draft, t->element, wanted, 1 + 3 * p.count, &terms);
    if (length == NULL || loop == NULL)
        return;
    terms[0] = (kt_term){length, 1.0};
    loop->offset = p.constant;
    const int index = m->draft.loops.count - 1;
    for (int i = 0; i < p.count && !m->r->out_of_memory; i++)
        add_part_of_path(m, t, &p.items[i], wanted, terms + 1 + 3 * i, &to);
    ((kt_loop *)m->draft.loops.items)[index].formula = kt_mjcf_keep_formula(m, &to);
    kt_left_count(&m->notes.tied_paths, t->element);
    if (joins_branches(m, t))
        kt_left_count(&m->notes.branches, t->element);
    kt_mjcf_keep_start(m);
}
