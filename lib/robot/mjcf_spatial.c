/* Spatial tendons of MJCF that run through sites, as forces between these sites.
 *
 * The path of a tendon has segments between two sites. A pulley ends a branch of the path, and divides the lengths of
 * the next branch by its divisor c: L = sum_i |d_i| / c_i. A force f along L is therefore a force f / c_i along each
 * segment between sites of different bodies. It pushes its ends apart if it is positive. A formula has the
 * force of a segment. The segment itself is `length` and `speed` there; the other segments are written with markers:
 *     |d| = sqrt(d_x^2 + d_y^2 + d_z^2),   |d|' = (d_x d_x' + d_y d_y' + d_z d_z') / |d|.
 * Tendons around geoms are left out. */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

static const kt_mjcf_segment *segment_at(const kt_mjcf *m, const kt_mjcf_tendon *t, int i) {
    return (const kt_mjcf_segment *)m->segments.items + t->first_segment + i;
}

static const kt_mjcf_site *site_of(const kt_mjcf *m, const kt_mjcf_tendon *t, int segment, int end) {
    return kt_mjcf_site_at(m, segment_at(m, t, segment)->site[end]);
}

static bool moves(const kt_mjcf *m, const kt_mjcf_tendon *t, int segment) {
    return site_of(m, t, segment, 0)->body != site_of(m, t, segment, 1)->body;
}

/* The motion of a joint from its reference to the position where its spring has no force. */
static kt_pose spring_turn(const kt_mjcf_joint *j) {
    const double x = j->spring - j->ref;
    kt_pose turn = kt_pose_identity();
    if (j->type == KT_MJCF_SLIDE)
        turn.position = kt_vec3_scale(x, kt_vec3_normalize(j->axis));
    if (j->type != KT_MJCF_HINGE)
        return turn;
    turn.rotation = kt_matrix_from_euler_vector(kt_vec3_scale(x, kt_vec3_normalize(j->axis)));
    turn.position = kt_vec3_sub(j->at, kt_mat3_apply(turn.rotation, j->at));
    return turn;
}

/* The pose of a body in the world while the springs of all joints have no force. */
static kt_pose pose_at_rest(const kt_mjcf *m, int body) {
    kt_pose pose = kt_pose_identity();
    for (; body > 0; body = kt_mjcf_body_at(m, body)->parent) {
        const kt_mjcf_body *b = kt_mjcf_body_at(m, body);
        kt_pose own = b->pose;
        for (int k = 0; k < b->joint_count; k++)
            own = kt_pose_compose(own, spring_turn(kt_mjcf_joint_at(m, b->first_joint + k)));
        pose = kt_pose_compose(own, pose);
    }
    return pose;
}

/* The distance of the two sites while the springs of all joints have no force. */
static double length_at_rest(const kt_mjcf *m, const kt_mjcf_tendon *t, int segment) {
    kt_vec3 at[2];
    for (int i = 0; i < 2; i++) {
        const kt_mjcf_site *site = site_of(m, t, segment, i);
        at[i] = kt_pose_apply(pose_at_rest(m, site->body), site->pose.position);
    }
    return kt_vec3_norm(kt_vec3_sub(at[1], at[0]));
}

/* Adds the segment from the site `last` (-1: a branch begins) to that of an element. Returns this site; -1: it is
 * none. */
static int add_segment(kt_mjcf *m, kt_mjcf_tendon *t, const kt_element *e, int last, double divisor) {
    const int site = strcmp(e->name, "site") == 0 ? kt_mjcf_find(m, e, "site", KT_MJCF_SITES) : -1;
    kt_mjcf_segment *to = site >= 0 && last >= 0 ? kt_list_add(m->r, &m->r->scratch, &m->segments, sizeof *to) : NULL;
    if (to == NULL)
        return site;
    *to = (kt_mjcf_segment){.site = {last, site}, .divisor = divisor};
    t->segment_count++;
    return site;
}

bool kt_mjcf_read_path(kt_mjcf *m, kt_mjcf_tendon *t) {
    double divisor = 1.0;
    int last = -1;
    t->first_segment = m->segments.count;
    for (const kt_element *c = t->element->first; c != NULL; c = c->next) {
        const bool is_pulley = strcmp(c->name, "pulley") == 0;
        if (is_pulley)
            divisor = kt_mjcf_number(m, c, NULL, "divisor", 0.0);
        last = is_pulley ? -1 : add_segment(m, t, c, last, divisor);
        if ((is_pulley && !(divisor > 0.0)) || (!is_pulley && last < 0))
            return false;
    }
    for (int i = 0; i < 2 * t->segment_count; i++)
        t->is_bounded = t->is_bounded || kt_mjcf_is_bounded_above(m, site_of(m, t, i / 2, i % 2)->body);
    for (int i = 0; i < t->segment_count; i++)
        t->rest += length_at_rest(m, t, i) / segment_at(m, t, i)->divisor;
    return t->segment_count > 0;
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* A coordinate of a site, or of its velocity: "marker.BODY.SITE.vx", or a number for a site of the world. */
static void put_coordinate(const kt_mjcf *m, const kt_mjcf_site *site, int axis, bool is_rate, kt_mjcf_formula *to) {
    static const char *const ends[2][3] = {{".x", ".y", ".z"}, {".vx", ".vy", ".vz"}};
    const char *name = kt_xml_attribute(site->element, "name");
    const kt_vec3 at = site->pose.position;
    if (site->body == 0) {
        kt_mjcf_put_number(to, is_rate ? 0.0 : axis == 0 ? at.x : axis == 1 ? at.y : at.z);
        return;
    }
    to->whole = to->whole && name != NULL && kt_name_is_valid(name);
    kt_mjcf_put(to, "marker.");
    kt_mjcf_put(to, kt_mjcf_body_at(m, site->body)->name);
    kt_mjcf_put(to, ".");
    kt_mjcf_put(to, name != NULL ? name : "");
    kt_mjcf_put(to, ends[is_rate][axis]);
}

static void put_difference(const kt_mjcf *m, const kt_mjcf_tendon *t, int segment, int axis, bool is_rate,
                           kt_mjcf_formula *to) {
    kt_mjcf_put(to, "(");
    put_coordinate(m, site_of(m, t, segment, 1), axis, is_rate, to);
    kt_mjcf_put(to, " - ");
    put_coordinate(m, site_of(m, t, segment, 0), axis, is_rate, to);
    kt_mjcf_put(to, ")");
}

/* "sqrt((..)^2+(..)^2+(..)^2)", or a number if the segment does not change. */
static void put_distance(const kt_mjcf *m, const kt_mjcf_tendon *t, int segment, kt_mjcf_formula *to) {
    if (segment == t->segment) {
        kt_mjcf_put(to, "length");
        return;
    }
    if (!moves(m, t, segment)) {
        kt_mjcf_put_number(to, length_at_rest(m, t, segment));
        return;
    }
    for (int axis = 0; axis < 3; axis++) {
        kt_mjcf_put(to, axis == 0 ? "sqrt(" : "+");
        put_difference(m, t, segment, axis, false, to);
        kt_mjcf_put(to, "^2");
    }
    kt_mjcf_put(to, ")");
}

static void put_speed(const kt_mjcf *m, const kt_mjcf_tendon *t, int segment, kt_mjcf_formula *to) {
    if (segment == t->segment || !moves(m, t, segment)) {
        kt_mjcf_put(to, segment == t->segment ? "speed" : "0");
        return;
    }
    for (int axis = 0; axis < 3; axis++) {
        kt_mjcf_put(to, axis == 0 ? "(" : "+");
        put_difference(m, t, segment, axis, false, to);
        kt_mjcf_put(to, "*");
        put_difference(m, t, segment, axis, true, to);
    }
    kt_mjcf_put(to, ")/");
    put_distance(m, t, segment, to);
}

void kt_mjcf_put_path(const kt_mjcf *m, const kt_mjcf_tendon *t, double factor, bool is_rate, kt_mjcf_formula *to) {
    kt_mjcf_put_number(to, factor);
    for (int i = 0; i < t->segment_count; i++) {
        const double divisor = segment_at(m, t, i)->divisor;
        kt_mjcf_put(to, i == 0 ? "*(" : "+");
        if (is_rate)
            put_speed(m, t, i, to);
        else
            put_distance(m, t, i, to);
        if (divisor != 1.0) {
            kt_mjcf_put(to, "/");
            kt_mjcf_put_number(to, divisor);
        }
    }
    kt_mjcf_put(to, ")");
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

static void set_end(const kt_mjcf *m, const kt_mjcf_site *site, kt_end *end) {
    end->body = kt_mjcf_body_at(m, site->body)->name;
    end->at = site->pose.position;
}

/* Whether a segment's formula has no more variables than an expression may have. */
static bool is_short(const kt_mjcf *m, const kt_mjcf_tendon *t) {
    int markers = 0;
    for (int i = 0; i < t->segment_count && t->segment_count > 1; i++)
        for (int end = 0; end < 2; end++) {
            const int *site = segment_at(m, t, i)->site;
            const bool is_new = end == 1 || i == 0 || segment_at(m, t, i - 1)->site[1] != site[0];
            markers += is_new && site_of(m, t, i, end)->body != 0;
        }
    return 6 * markers + 3 <= KT_FORMULA_VARIABLE_MAX;
}

/* Writes the force of a segment: that along the length, over the divisor of the segment. */
static void put_part(kt_mjcf *m, const kt_mjcf_tendon *t, kt_mjcf_put_force *put, const void *user,
                     kt_mjcf_formula *to) {
    const double divisor = segment_at(m, t, t->segment)->divisor;
    if (divisor == 1.0) {
        put(m, t, user, to);
        return;
    }
    kt_mjcf_put_number(to, 1.0 / divisor);
    kt_mjcf_put(to, "*(");
    put(m, t, user, to);
    kt_mjcf_put(to, ")");
}

void kt_mjcf_add_along_path(kt_mjcf *m, kt_mjcf_tendon *t, const kt_element *e, kt_mjcf_put_force *put,
                            const void *user) {
    for (int i = 0; i < t->segment_count; i++) {
        kt_mjcf_formula to = {.whole = true};
        if (!moves(m, t, i))
            continue;
        t->segment = i;
        put_part(m, t, put, user, &to);
        const char *text = is_short(m, t) ? kt_mjcf_keep_formula(m, &to) : NULL;
        kt_effect *effect = text != NULL ? kt_draft_effect(&m->draft, e, KT_EFFECT_EXPRESSION) : NULL;
        if (effect == NULL) {
            kt_unknown_count(&m->forces, "force of a spatial tendon that is too long for a formula", e);
            return;
        }
        const char *name = kt_xml_attribute(e, "name");
        effect->formula[0] = text;
        effect->name = name != NULL && *name != '\0' ? kt_namer_make(&m->effects_named, name) : NULL;
        effect->end_count = 2;
        set_end(m, site_of(m, t, i, 0), &effect->between[0]);
        set_end(m, site_of(m, t, i, 1), &effect->between[1]);
    }
}

/* ---- springs, dampers and stops ---------------------------------------------------------------------------------- */

typedef struct passive {
    double stiffness, damping, rest[2];
    bool only_beyond; /* a stop: damping acts beyond the lengths of rest alone */
} passive;

/* k times the length of the spring without force: "k*a", or "clamp(L, a, b)*k". */
static void put_rest(const kt_mjcf *m, const kt_mjcf_tendon *t, const passive *p, kt_mjcf_formula *to) {
    if (p->rest[0] == p->rest[1]) {
        kt_mjcf_put_number(to, p->stiffness * p->rest[0]);
        return;
    }
    kt_mjcf_put(to, "clamp(");
    kt_mjcf_put_path(m, t, 1.0, false, to);
    for (int i = 0; i < 2; i++) {
        kt_mjcf_put(to, ", ");
        kt_mjcf_put_number(to, p->rest[i]);
    }
    kt_mjcf_put(to, ")*");
    kt_mjcf_put_number(to, p->stiffness);
}

/* "k*clamp(L, a, b) - k*L - d*L'". */
static void put_passive(const kt_mjcf *m, const kt_mjcf_tendon *t, const void *user, kt_mjcf_formula *to) {
    const passive *p = user;
    put_rest(m, t, p, to);
    kt_mjcf_put(to, " + ");
    kt_mjcf_put_path(m, t, -p->stiffness, false, to);
    if (p->damping == 0.0)
        return;
    kt_mjcf_put(to, " + ");
    kt_mjcf_put_path(m, t, -p->damping, true, to);
    for (int i = 0; i < 2 && p->only_beyond; i++) {
        kt_mjcf_put(to, i == 0 ? "*((" : ") + (");
        kt_mjcf_put_path(m, t, 1.0, false, to);
        kt_mjcf_put(to, i == 0 ? " < " : " > ");
        kt_mjcf_put_number(to, p->rest[i]);
    }
    kt_mjcf_put(to, p->only_beyond ? "))" : "");
}

/* What a spatial tendon has and its forces do not. */
static void count_lost(kt_mjcf *m, const kt_mjcf_tendon *t, const double stiffness[3], const double damping[3]) {
    const kt_element *e = t->element;
    if (stiffness[1] != 0.0 || stiffness[2] != 0.0 || damping[1] != 0.0 || damping[2] != 0.0)
        kt_unknown_count(&m->changes,
                         "stiffness or damping by a polynomial in a spatial tendon, whose first term alone "
                         "acts",
                         e);
    if (kt_mjcf_number(m, e, "tendon", "armature", 0.0) != 0.0)
        kt_unknown_count(&m->changes, "armature of a spatial tendon, which is left out", e);
    if (kt_mjcf_number(m, e, "tendon", "frictionloss", 0.0) != 0.0 && !m->off.friction)
        kt_unknown_count(&m->changes, "frictionloss of a spatial tendon, which is left out", e);
}

void kt_mjcf_act_in_path(kt_mjcf *m, kt_mjcf_tendon *t) {
    const kt_element *e = t->element;
    const kt_robot_options *o = m->source->options;
    double stiffness[3] = {0.0}, damping[3] = {0.0}, rest[2] = {-1.0, -1.0}, range[2];
    (void)kt_mjcf_numbers(m, e, "tendon", "stiffness", 1, 3, stiffness);
    (void)kt_mjcf_numbers(m, e, "tendon", "damping", 1, 3, damping);
    if (kt_mjcf_numbers(m, e, "tendon", "springlength", 1, 2, rest) == 1)
        rest[1] = rest[0];
    if (rest[0] < 0.0)
        rest[0] = rest[1] = t->rest;
    count_lost(m, t, stiffness, damping);
    const passive p = {.stiffness = m->off.springs ? 0.0 : stiffness[0],
                       .damping = m->off.dampers ? 0.0 : damping[0],
                       .rest = {rest[0], rest[1]}};
    if (p.stiffness != 0.0 || p.damping != 0.0)
        kt_mjcf_add_along_path(m, t, e, put_passive, &p);
    if (m->off.limits || !kt_mjcf_is_limited(m, e, "tendon", "limited", "range") ||
        kt_mjcf_numbers(m, e, "tendon", "range", 2, 2, range) != 2)
        return;
    kt_left_count(&m->limits, e);
    const passive stop = {
        .stiffness = o->stop_stiffness, .damping = o->stop_damping, .rest = {range[0], range[1]}, .only_beyond = true};
    if (o->stop_stiffness != 0.0)
        kt_mjcf_add_along_path(m, t, e, put_passive, &stop);
}
