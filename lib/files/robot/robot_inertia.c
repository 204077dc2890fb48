/* Checks of inertias that no physical body has, in robots.
 *
 * The principal moments of a body are not negative, and none exceeds the sum of the two others. Files often give a
 * rounded inertia to a link of negligible inertia, such as a sensor. The check therefore applies to rigid parts. A
 * rigid part consists of the links that fixed joints connect:
 *
 *     m = sum m_i,  m c = sum m_i c_i,  J = sum R_i J_i R_i' + m_i (|d_i|^2 1 - d_i d_i'),  d_i = c_i - c,
 *
 * with the pose of link i in the frame of the part's first link. A part that is fixed to the world does not move and is
 * not checked.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot.h"

#include <float.h>
#include <math.h>

static const double excess_most = 0.1; /* the largest excess that is accepted with a note */

typedef struct part {
    double mass;
    kt_vec3 moment; /* sum of m_i c_i */
    kt_sym3 inertia;
    bool moves;
} part;

typedef struct parts {
    kt_inertia_findings *findings;
    int *first;    /* of bodies: the first body of its part; -1: not found yet */
    kt_pose *pose; /* of bodies: in that body's frame */
    int *path;     /* bodies on the way to the first one */
    part *part;    /* of first bodies */
} parts;

static bool take_parts(parts *p, kt_inertia_findings *findings) {
    kt_reader *r = findings->d->r;
    const size_t count = (size_t)findings->d->bodies.count + 1;
    *p = (parts){.findings = findings};
    p->first = kt_reader_take(r, &r->scratch, count, sizeof *p->first);
    p->pose = kt_reader_take(r, &r->scratch, count, sizeof *p->pose);
    p->path = kt_reader_take(r, &r->scratch, count, sizeof *p->path);
    p->part = kt_reader_take(r, &r->scratch, count, sizeof *p->part);
    if (p->first == NULL || p->pose == NULL || p->path == NULL || p->part == NULL)
        return false;
    for (int i = 0; i < findings->d->bodies.count; i++) {
        p->first[i] = -1;
        p->part[i] = (part){.moment = kt_vec3_make(0.0, 0.0, 0.0)};
    }
    return true;
}

/* The body that a body is fixed to; -1: it moves on its parent, or is fixed to the world. */
static int fixed_to(const parts *p, int b) {
    return kt_draft_body_at(p->findings->d, b)->joint.type == KT_JOINT_FIXED ? p->findings->d->parents[b] : -1;
}

/* A walk over all bodies that meets a circle of parents ends there, and the check of the description reports the
 * circle. */
static void find_firsts(parts *p) {
    const kt_draft *d = p->findings->d;
    for (int i = 0; i < d->bodies.count; i++) {
        int count = 0, at = i;
        while (p->first[at] < 0 && fixed_to(p, at) >= 0 && count < d->bodies.count) {
            p->path[count++] = at;
            at = fixed_to(p, at);
        }
        if (p->first[at] < 0) {
            p->first[at] = at;
            p->pose[at] = kt_pose_identity();
            p->part[at].moves = kt_draft_body_at(d, at)->joint.type != KT_JOINT_FIXED;
        }
        while (count-- > 0) {
            const int b = p->path[count];
            p->first[b] = p->first[at];
            p->pose[b] = kt_pose_compose(p->pose[at], kt_frame_of_joint(&kt_draft_body_at(d, b)->joint));
            at = b;
        }
    }
}

/* ---- the inertia of a part --------------------------------------------------------------------------------------- */

/* Centre of mass and inertia of a body, about the axes of its part. */
static void properties_of(const parts *p, int b, kt_vec3 *centre, kt_sym3 *inertia) {
    const kt_pose pose = p->pose[b];
    kt_properties_of(kt_draft_body_at(p->findings->d, b), centre, inertia);
    *centre = kt_pose_apply(pose, *centre);
    *inertia = kt_sym3_rotate(pose.rotation, *inertia);
}

static part *part_of(const parts *p, int body) { return &p->part[p->first[body]]; }

/* The first pass sums mass and first moment of each rigid part; the second sums the inertia about the centre that
 * follows. */
static void sum_parts(parts *p) {
    const kt_draft *d = p->findings->d;
    const int count = d->bodies.count;
    for (int b = 0; b < count; b++) {
        part *all = part_of(p, b);
        kt_vec3 centre;
        kt_sym3 ignored;
        properties_of(p, b, &centre, &ignored);
        all->mass += kt_draft_body_at(d, b)->mass;
        all->moment = kt_vec3_add(all->moment, kt_vec3_scale(kt_draft_body_at(d, b)->mass, centre));
    }
    for (int b = 0; b < count; b++) {
        part *all = part_of(p, b);
        kt_vec3 at;
        kt_sym3 own;
        properties_of(p, b, &at, &own);
        const kt_vec3 centre = all->mass > 0.0 ? kt_vec3_scale(1.0 / all->mass, all->moment) : all->moment;
        const kt_vec3 e = kt_vec3_sub(at, centre);
        const double m = kt_draft_body_at(d, b)->mass, ee = kt_vec3_dot(e, e);
        all->inertia = kt_sym3_make(
            all->inertia.xx + own.xx + m * (ee - e.x * e.x), all->inertia.yy + own.yy + m * (ee - e.y * e.y),
            all->inertia.zz + own.zz + m * (ee - e.z * e.z), all->inertia.xy + own.xy - m * e.x * e.y,
            all->inertia.xz + own.xz - m * e.x * e.z, all->inertia.yz + own.yz - m * e.y * e.z);
    }
}

/* ---- the check --------------------------------------------------------------------------------------------------- */

static double largest(kt_sym3 s) {
    return fmax(fmax(fmax(fabs(s.xx), fabs(s.yy)), fmax(fabs(s.zz), fabs(s.xy))), fmax(fabs(s.xz), fabs(s.yz)));
}

/* The excess of an inertia over the triangle inequality; infinite if a moment is negative. */
static double oddness(kt_sym3 inertia, kt_vec3 *moments) {
    const kt_inertia_fault fault = kt_inertia_check(inertia, moments);
    return fault == KT_INERTIA_TRIANGLE ? kt_inertia_excess(inertia)
           : fault == KT_INERTIA_VALID  ? 0.0
                                        : (double)INFINITY;
}

static bool accepts(const kt_inertia_findings *findings, double odd) {
    const kt_robot_inertia how = findings->options->inertia;
    return odd <= 0.0 || how == KT_ROBOT_INERTIA_ACCEPT || (how == KT_ROBOT_INERTIA_WARN && odd <= excess_most);
}

static void reject_inertia(kt_inertia_findings *findings, const kt_element *e, kt_vec3 m, double odd) {
    (void)kt_robot_fault(findings->d->r, e,
                         "the principal moments are %g, %g, %g, and with what is fixed to it, too, %s: no body has a "
                         "negative one, or one above the sum of the two others; check units, order and the axes of "
                         "<origin>, or accept it with --inertia %s",
                         m.x, m.y, m.z, isinf(odd) ? "one is negative or alone" : "one is too large",
                         odd <= excess_most ? "warn" : "accept");
}

/* Whether an inertia is the rounding error of a zero. The scale is the inertia of the part plus the moment m c^2 about
 * the link's origin. The parallel-axis theorem subtracts a term as large as this moment. */
static bool is_rounding(const parts *p, int b) {
    const kt_body *body = kt_draft_body_at(p->findings->d, b);
    const double scale = largest(part_of(p, b)->inertia) + body->mass * kt_vec3_dot(body->com, body->com);
    return largest(body->inertia) <= 8.0 * DBL_EPSILON * scale;
}

static const kt_element *link_of(const kt_inertia_findings *findings, int body) {
    return ((const kt_element *const *)findings->d->links.items)[body];
}

/* Checks a body whose own inertia is invalid, using the inertia of its part. */
static void check_body(parts *p, int b, double own, kt_vec3 moments) {
    kt_inertia_findings *findings = p->findings;
    const kt_element *link = link_of(findings, b), *inertial = kt_xml_child(link, "inertial");
    const kt_element *e =
        inertial != NULL && kt_xml_child(inertial, "inertia") ? kt_xml_child(inertial, "inertia") : link;
    const part *all = part_of(p, b);
    kt_vec3 ignored;
    const double odd = all->moves ? oddness(all->inertia, &ignored) : 0.0;
    if (!accepts(findings, odd)) {
        reject_inertia(findings, e, moments, odd);
        return;
    }
    kt_left_count(odd > 0.0 ? &findings->odd_inertias : &findings->odd_links, e);
    findings->worst_excess = fmax(findings->worst_excess, odd);
    if (own > KT_INERTIA_EXCESS_MAX)
        findings->limit = KT_INERTIA_ACCEPT;
}

void kt_inertias_check(kt_inertia_findings *findings, kt_draft *d, const kt_robot_options *options) {
    parts p;
    *findings = (kt_inertia_findings){.d = d, .options = options, .limit = KT_INERTIA_WARN};
    if (!kt_draft_find_parents(d) || !take_parts(&p, findings))
        return;
    find_firsts(&p);
    sum_parts(&p);
    for (int b = 0; b < d->bodies.count; b++) {
        kt_sym3 *inertia = &kt_draft_body_at(d, b)->inertia;
        kt_vec3 moments;
        const double own = oddness(*inertia, &moments);
        if (!(own > 0.0))
            continue;
        if (is_rounding(&p, b)) {
            kt_left_count(&findings->nothings, link_of(findings, b));
            *inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        } else {
            check_body(&p, b, own, moments);
        }
    }
}

void kt_inertia_notes(kt_notes *notes, const kt_inertia_findings *findings) {
    kt_phrase by = {.length = 0};
    kt_note_put(notes, KT_NOTE_RANK_DETAIL, &findings->nothings,
                "inertias that are nothing but rounding, taken for zero: %d", findings->nothings.count);
    kt_note_put(notes, KT_NOTE_RANK_DETAIL, &findings->odd_links,
                "impossible inertias of links, within rigid parts whose total inertia is possible (the scene has "
                "'inertia_check: accept'): %d",
                findings->odd_links.count);
    if (isinf(findings->worst_excess))
        kt_phrase_add(&by, "a principal moment being negative, or the only one");
    else
        kt_phrase_add(&by, "their largest principal moment exceeding the sum of the others by up to %.2g %% of it",
                      100.0 * findings->worst_excess);
    kt_note_put(
        notes, KT_NOTE_RANK_MOTION, &findings->odd_inertias,
        "impossible inertias are used as they are, %s: %d; where such a part moves, accelerations may be wrong or "
        "not exist",
        by.text, findings->odd_inertias.count);
}
