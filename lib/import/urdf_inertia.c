/* Inertias that no body has, in robots of URDF.
 *
 * The principal moments of a body are not negative, and none exceeds the sum of the two others. Files often give an
 * inertia to a link that has none worth speaking of, such as a sensor, and round it. What moves is a rigid part, the
 * links that fixed joints connect, and it is the part that is judged:
 *
 *     m = sum m_i,  m c = sum m_i c_i,  J = sum R_i J_i R_i' + m_i (|d_i|^2 1 - d_i d_i'),  d_i = c_i - c,
 *
 * with the pose of link i in the frame of the part's first link. A part that is fixed to the world does not move, and
 * is not judged.
 */
#include "import/urdf.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double excess_most = 0.1; /* that is accepted and told */

typedef struct part {
    double mass;
    kt_vec3 moment; /* sum of m_i c_i */
    kt_sym3 inertia;
    bool moves, is_odd;
} part;

typedef struct parts {
    kt_urdf *u;
    int *body_of;  /* of links: in the description; -1: the world */
    int *first;    /* of links: the first link of its part; -1: not found yet */
    kt_pose *pose; /* of links: in that link's frame */
    int *path;     /* links on the way to the first one */
    part *part;    /* of first links */
} parts;

static bool take_parts(parts *p, kt_urdf *u) {
    kt_pool *scratch = &u->r->scratch;
    const size_t links = (size_t)u->link_count + 1;
    *p = (parts){.u = u};
    p->body_of = kt_pool_take(scratch, links, sizeof *p->body_of);
    p->first = kt_pool_take(scratch, links, sizeof *p->first);
    p->pose = kt_pool_take(scratch, links, sizeof *p->pose);
    p->path = kt_pool_take(scratch, links, sizeof *p->path);
    p->part = kt_pool_take(scratch, links, sizeof *p->part);
    if (p->body_of == NULL || p->first == NULL || p->pose == NULL || p->path == NULL || p->part == NULL)
        return kt_reader_out_of_memory(u->r);
    for (int i = 0; i < u->link_count; i++) {
        p->body_of[i] = p->first[i] = -1;
        p->part[i] = (part){.moment = kt_vec3_make(0.0, 0.0, 0.0)};
    }
    for (int b = 0; b < u->description->body_count; b++)
        p->body_of[u->body_links[b]] = b;
    return true;
}

/* The link that a link is fixed to; -1: it moves on its parent, or is the root. */
static int fixed_to(const parts *p, int link) {
    const kt_urdf *u = p->u;
    if (p->body_of[link] < 0 || u->links[link].carrier < 0 || u->bodies[p->body_of[link]].joint.type != KT_JOINT_FIXED)
        return -1;
    return u->joints[u->links[link].carrier].parent;
}

/* Whether the part of a first link moves: its joint is not fixed. */
static bool is_moving(const parts *p, int first) {
    return p->body_of[first] >= 0 && p->u->bodies[p->body_of[first]].joint.type != KT_JOINT_FIXED;
}

static kt_pose pose_on_parent(const kt_body *body) {
    kt_pose pose = {.rotation = kt_mat3_identity(), .position = body->joint.at};
    if (body->joint.rotation.type != KT_ROTATION_NONE &&
        kt_rotation_evaluate(&body->joint.rotation, &pose.rotation, NULL) != KT_OK)
        pose.rotation = kt_mat3_identity(); /* the check of the description reports it */
    return pose;
}

/* A walk over all links has met a circle of parents: it ends there, and the check of the description reports the
 * circle. */
static void find_firsts(parts *p) {
    for (int i = 0; i < p->u->link_count; i++) {
        int count = 0, at = i;
        while (p->first[at] < 0 && fixed_to(p, at) >= 0 && count < p->u->link_count) {
            p->path[count++] = at;
            at = fixed_to(p, at);
        }
        if (p->first[at] < 0) {
            p->first[at] = at;
            p->pose[at] = kt_pose_identity();
            p->part[at].moves = is_moving(p, at);
        }
        while (count-- > 0) {
            const int link = p->path[count];
            p->first[link] = p->first[at];
            p->pose[link] = kt_pose_compose(p->pose[at], pose_on_parent(&p->u->bodies[p->body_of[link]]));
            at = link;
        }
    }
}

/* ---- the inertia of a part --------------------------------------------------------------------------------------- */

/* Centre of mass and inertia of a body, about the axes of its part. */
static void properties_of(const parts *p, int b, kt_vec3 *centre, kt_sym3 *inertia) {
    const kt_body *body = &p->u->bodies[b];
    const kt_pose pose = p->pose[p->u->body_links[b]];
    kt_vec3 com = body->com;
    kt_sym3 own = body->inertia;
    if ((body->com_of_shape || body->inertia_of_shape) && kt_body_inertia(body, &com, &own, NULL) != KT_OK)
        com = body->com; /* likewise */
    *centre = kt_pose_apply(pose, com);
    *inertia = kt_sym3_rotate(pose.rotation, own);
}

static part *part_of(const parts *p, int body) { return &p->part[p->first[p->u->body_links[body]]]; }

static void sum_parts(parts *p) {
    const int count = p->u->description->body_count;
    for (int b = 0; b < count; b++) {
        part *all = part_of(p, b);
        kt_vec3 centre;
        kt_sym3 ignored;
        properties_of(p, b, &centre, &ignored);
        all->mass += p->u->bodies[b].mass;
        all->moment = kt_vec3_add(all->moment, kt_vec3_scale(p->u->bodies[b].mass, centre));
    }
    for (int b = 0; b < count; b++) {
        part *all = part_of(p, b);
        kt_vec3 at;
        kt_sym3 own;
        properties_of(p, b, &at, &own);
        const kt_vec3 centre = all->mass > 0.0 ? kt_vec3_scale(1.0 / all->mass, all->moment) : all->moment;
        const kt_vec3 d = kt_vec3_sub(at, centre);
        const double m = p->u->bodies[b].mass, dd = kt_vec3_dot(d, d);
        all->inertia = kt_sym3_make(
            all->inertia.xx + own.xx + m * (dd - d.x * d.x), all->inertia.yy + own.yy + m * (dd - d.y * d.y),
            all->inertia.zz + own.zz + m * (dd - d.z * d.z), all->inertia.xy + own.xy - m * d.x * d.y,
            all->inertia.xz + own.xz - m * d.x * d.z, all->inertia.yz + own.yz - m * d.y * d.z);
    }
}

/* ---- the judgement ----------------------------------------------------------------------------------------------- */

static double largest(kt_sym3 s) {
    return fmax(fmax(fmax(fabs(s.xx), fabs(s.yy)), fmax(fabs(s.zz), fabs(s.xy))), fmax(fabs(s.xz), fabs(s.yz)));
}

/* By how much an inertia breaks the inequality; infinite where a moment is negative. */
static double oddness(kt_sym3 inertia, kt_vec3 *moments) {
    const kt_inertia_fault fault = kt_inertia_check(inertia, moments);
    return fault == KT_INERTIA_TRIANGLE ? kt_inertia_excess(inertia)
           : fault == KT_INERTIA_VALID  ? 0.0
                                        : (double)INFINITY;
}

static bool accepts(const kt_urdf *u, double odd) {
    const kt_robot_inertia how = u->options->inertia;
    return odd <= 0.0 || how == KT_ROBOT_INERTIA_ACCEPT || (how == KT_ROBOT_INERTIA_WARN && odd <= excess_most);
}

static void refuse(kt_urdf *u, const kt_element *e, kt_vec3 m, double odd) {
    (void)kt_urdf_fault(
        u->r, e,
        "the principal moments are %g, %g, %g, and with what is fixed to it, too, %s: of no body is one "
        "negative, or larger than the two others together; check units, order and the axes of "
        "<origin>, or let 'kinetree import --inertia %s' accept it",
        m.x, m.y, m.z, isinf(odd) ? "one is negative or alone" : "one is too large",
        odd <= excess_most ? "warn" : "accept");
}

/* Judges a body whose own inertia is odd, by its part. */
static void judge(parts *p, int b, double own, kt_vec3 moments) {
    kt_urdf *u = p->u;
    const kt_element *link = u->links[u->body_links[b]].element, *inertial = kt_xml_child(link, "inertial");
    const kt_element *e =
        inertial != NULL && kt_xml_child(inertial, "inertia") ? kt_xml_child(inertial, "inertia") : link;
    const part *all = part_of(p, b);
    kt_vec3 ignored;
    const double odd = all->moves ? oddness(all->inertia, &ignored) : 0.0;
    if (!accepts(u, odd)) {
        refuse(u, e, moments, odd);
        return;
    }
    kt_left_count(odd > 0.0 ? &u->odd_inertias : &u->odd_links, e);
    u->worst_excess = fmax(u->worst_excess, odd);
    if (own > KT_INERTIA_EXCESS_MAX)
        u->description->inertia_check = KT_INERTIA_ACCEPT;
}

void kt_urdf_judge_inertias(kt_urdf *u) {
    parts p;
    u->description->inertia_check = KT_INERTIA_WARN;
    if (!take_parts(&p, u))
        return;
    find_firsts(&p);
    sum_parts(&p);
    for (int b = 0; b < u->description->body_count; b++) {
        kt_vec3 moments;
        const double own = oddness(u->bodies[b].inertia, &moments);
        if (!(own > 0.0))
            continue;
        if (largest(u->bodies[b].inertia) <= DBL_EPSILON * largest(part_of(&p, b)->inertia)) {
            kt_left_count(&u->nothings, u->links[u->body_links[b]].element);
            u->bodies[b].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        } else {
            judge(&p, b, own, moments);
        }
    }
}
