/* Beams of rigid segments. Each of the n segments has the length l = length / n. Elastic joints between them have the
 * strain of the length between two middles:
 *
 *   Boundary k = 1 .. n - 1: the section stiffness at x = k l, over l.
 *   Clamped end: the section stiffness there, over l / 2, the distance to the middle of the first segment.
 *   Hinged end: the same for forces; no moment.
 *
 * The moment is a central difference of rotations and displacements, of the second order in l. Segment i has the mass
 * per length at its middle times l, and the inertia of a straight rod of its section. The given stiffnesses determine
 * how segments move on one another:
 *
 *   EA, GA, GJ, EI: in all six ways, with bushings between free joints.
 *   GJ, EI: by rotations, with bushings in spherical joints. The beam keeps its length and its sections stay normal.
 *   EI[1] alone: about z, with springs in revolute joints. The beam bends in its plane.
 *
 * The axis of a curved beam turns by l times the curvature from segment to segment. A segment is the chord of its arc,
 * and begins half such a turn away from the section at its beginning.
 *
 * Source: the finite-segment method, e.g. J. W. Kamman, R. L. Huston, Multibody System Dynamics 6 (2001). Section
 * forces and strains are those of a geometrically exact beam, of which these equations are a difference scheme: J. C.
 * Simo, CMAME 49, p. 55 (1985).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parts/builder.h"

#include "base/require.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

kt_beam kt_beam_default(void) {
    return (kt_beam){.from = kt_end_default(), .to = kt_end_default(), .ends = {KT_BEAM_CLAMPED, KT_BEAM_FREE}};
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static bool is_along(const kt_beam_property *a) { return a->stations != NULL || a->value != 0.0; }
static bool is_in_plane(const kt_beam *b) { return !is_along(&b->EI[0]); }
static bool stretches(const kt_beam *b) { return is_along(&b->EA); }

static kt_status check_along(const char *key, const kt_beam_property *a, kt_error *error) {
    if (a->stations == NULL)
        return a->value == 0.0 || (a->value > 0.0 && isfinite(a->value))
                   ? KT_OK
                   : kt_error_set(error, KT_ERROR_MODEL, key, "%g must be above zero and finite", a->value);
    if (a->station_count < 2)
        return kt_error_set(error, KT_ERROR_MODEL, key, "%d stations along the beam; there must be two or more",
                            a->station_count);
    for (int i = 0; i < a->station_count; i++)
        if (!(a->stations[i] > 0.0 && isfinite(a->stations[i])))
            return kt_error_set(error, KT_ERROR_MODEL, key, "station %d: %g must be above zero and finite", i,
                                a->stations[i]);
    return KT_OK;
}

static kt_status check_ends(const kt_beam *b, kt_error *error) {
    for (int i = 0; i < 2; i++)
        if (b->ends[i] != KT_BEAM_CLAMPED && b->ends[i] != KT_BEAM_HINGED && b->ends[i] != KT_BEAM_FREE)
            return kt_error_set(error, KT_ERROR_MODEL, "ends",
                                "there is no end %d; take KT_BEAM_CLAMPED, _HINGED or _FREE", (int)b->ends[i]);
    return KT_OK;
}

static kt_status check_section(const kt_beam *b, kt_error *error) {
    const bool shears = is_along(&b->GA[0]) && is_along(&b->GA[1]);
    const bool any = stretches(b) || is_along(&b->GA[0]) || is_along(&b->GA[1]);
    if (!is_along(&b->mass))
        return kt_error_set(error, KT_ERROR_MODEL, "", "the mass per length is missing");
    if (!is_along(&b->EI[1]))
        return kt_error_set(error, KT_ERROR_MODEL, "", "the stiffness EI of bending is missing");
    if (is_in_plane(b) && (any || is_along(&b->GJ)))
        return kt_error_set(
            error, KT_ERROR_MODEL, "",
            "EI is one number, so the beam bends in its plane alone; leave out EA, GA and GJ, or write EI: [y, z]");
    if (is_in_plane(b) && (b->curvature.x != 0.0 || b->curvature.y != 0.0))
        return kt_error_set(error, KT_ERROR_MODEL, "curvature",
                            "EI is one number, so the beam lies in its plane; curvature about x or y (%g, %g rad/m) "
                            "needs EI: [y, z] and GJ",
                            b->curvature.x, b->curvature.y);
    if (!is_in_plane(b) && !is_along(&b->GJ))
        return kt_error_set(
            error, KT_ERROR_MODEL, "",
            "EI: [y, z] is for bending in space, which also needs GJ; for bending in a plane, give one number for EI");
    if (any && !(stretches(b) && shears))
        return kt_error_set(error, KT_ERROR_MODEL, "",
                            "EA and GA belong together; give both, or neither for a beam of constant length");
    if (!is_in_plane(b) && !any && b->polar_inertia == 0.0)
        return kt_error_set(
            error, KT_ERROR_MODEL, "",
            "without EA the section's inertia is missing: give inertia_per_length, kg m, about the axis");
    return KT_OK;
}

kt_status kt_beam_check(const kt_beam *b, kt_error *error) {
    if (KT_IS_MISSING(error, b))
        return KT_ERROR_ARGUMENT;
    const struct {
        const char *key;
        const kt_beam_property *along;
    } numbers[] = {{"mass_per_length", &b->mass},
                   {"EA", &b->EA},
                   {"GA", &b->GA[0]},
                   {"GA", &b->GA[1]},
                   {"GJ", &b->GJ},
                   {"EI", &b->EI[0]},
                   {"EI", &b->EI[1]}};
    const double turn = kt_hypot(kt_hypot(b->curvature.x, b->curvature.y), b->curvature.z);
    if (b->name == NULL)
        return kt_error_set(error, KT_ERROR_MODEL, "name", "the name is missing; the segments are NAME-1, NAME-2, ...");
    if (b->segments < 2 || b->segments > KT_BEAM_SEGMENTS_MAX)
        return kt_error_set(error, KT_ERROR_MODEL, "segments", "%d: segments are a whole number, 2 to %d", b->segments,
                            (int)KT_BEAM_SEGMENTS_MAX);
    if (!(b->length > 0.0) || !isfinite(b->length))
        return kt_error_set(error, KT_ERROR_MODEL, "length", "%g m must be above zero and finite", b->length);
    if (!(b->damping >= 0.0) || !isfinite(b->damping))
        return kt_error_set(error, KT_ERROR_MODEL, "damping",
                            "%g: damping, in seconds times the stiffness, is zero or more", b->damping);
    if (!(b->polar_inertia >= 0.0) || !isfinite(b->polar_inertia))
        return kt_error_set(error, KT_ERROR_MODEL, "inertia_per_length", "%g kg m must be finite and not below zero",
                            b->polar_inertia);
    if (!isfinite(turn))
        return kt_error_set(error, KT_ERROR_MODEL, "curvature", "the curvature is not finite");
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        const kt_status status = check_along(numbers[i].key, numbers[i].along, error);
        if (status != KT_OK)
            return status;
    }
    const kt_status status = check_ends(b, error);
    return status == KT_OK ? check_section(b, error) : status;
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

static double value_along(const kt_beam_property *a, double part) {
    if (a->stations == NULL)
        return a->value;
    const int last = a->station_count - 1;
    const double x = part * last;
    const int i = x >= last ? last : (int)x;
    return i == last ? a->stations[i] : a->stations[i] + (x - i) * (a->stations[i + 1] - a->stations[i]);
}

/* Numbers and names that all segments of a beam share. */
typedef struct kt_beam_segment {
    const kt_beam *beam;
    const char *const *names; /* of the segments */
    double l;                 /* along the axis */
    kt_vec3 end;              /* of the chord */
    kt_vec3 turn;             /* from one segment to the next */
} kt_beam_segment;

static kt_beam_segment find_segment(const kt_beam *b, const char *const *names) {
    const double l = b->length / b->segments, half = 0.5 * l * kt_hypot(b->curvature.y, b->curvature.z);
    return (kt_beam_segment){b, names, l, kt_vec3_make(half > 0.0 ? l * sin(half) / half : l, 0.0, 0.0),
                             kt_vec3_make(l * b->curvature.x, l * b->curvature.y, l * b->curvature.z)};
}

static kt_rotation part_of_turn(const kt_beam_segment *s, double part) {
    return kt_rotation_vector(kt_vec3_make(part * s->turn.x, part * s->turn.y, part * s->turn.z));
}

/* Stiffness of the joint at `part` of the length whose two middles are `apart`: forces, moments. */
static void find_stiffness(const kt_beam *b, double part, double apart, bool hinged, double *k) {
    const kt_beam_property *section[6] = {&b->EA, &b->GA[0], &b->GA[1], &b->GJ, &b->EI[0], &b->EI[1]};
    for (int i = 0; i < 6; i++)
        k[i] = is_along(section[i]) && !(hinged && i >= 3) ? value_along(section[i], part) / apart : 0.0;
}

/* A thin rod. In space the section adds m EI_k / EA about axis k, or half of the polar inertia, and about the rod's
 * axis the sum of both. */
static kt_sym3 find_inertia(const kt_beam *b, double part, double l, double mass) {
    double inertia[3] = {0.0, mass * l * l / 12.0, mass * l * l / 12.0};
    const double square =
        stretches(b) ? 1.0 / value_along(&b->EA, part) : 0.0; /* EI of it: squared radius of inertia */
    for (int k = 0; k < 2 && !is_in_plane(b); k++) {
        const double section =
            b->polar_inertia > 0.0 ? 0.5 * b->polar_inertia * l : mass * value_along(&b->EI[k], part) * square;
        inertia[0] += section;
        inertia[k + 1] += section;
    }
    return kt_sym3_make(inertia[0], inertia[1], inertia[2], 0.0, 0.0, 0.0);
}

/* ---- segments ---------------------------------------------------------------------------------------------------- */

/* The position of the first segment's joint, of half a turn of a segment. */
static kt_status set_first_position(const kt_beam_segment *s, kt_joint *joint, kt_error *error) {
    const kt_rotation half = part_of_turn(s, 0.5);
    double *p = joint->position + (joint->type == KT_JOINT_FREE ? 3 : 0);
    kt_mat3 matrix;
    if (half.value[0] == 0.0 && half.value[1] == 0.0 && half.value[2] == 0.0)
        return KT_OK;
    if (joint->type == KT_JOINT_REVOLUTE || joint->type == KT_JOINT_PLANAR) {
        joint->position[joint->type == KT_JOINT_PLANAR ? 2 : 0] = half.value[2];
        return KT_OK;
    }
    const kt_status status = kt_rotation_evaluate(&half, &matrix, error);
    if (status != KT_OK)
        return status;
    const kt_quat q = kt_quat_from_mat3(matrix);
    p[0] = q.w;
    p[1] = q.x;
    p[2] = q.y;
    p[3] = q.z;
    return KT_OK;
}

/* Segment i, from 0. The first one is attached by find_start. */
static kt_body make_segment(const kt_beam_segment *s, int i, const kt_marker *marker) {
    const kt_beam *b = s->beam;
    const double part = (i + 0.5) / b->segments, mass = value_along(&b->mass, part) * s->l;
    const bool is_free = i == 0 && b->ends[0] == KT_BEAM_FREE;
    kt_body body = kt_body_default();
    body.name = s->names[i];
    body.joint.type = is_in_plane(b)            ? (is_free ? KT_JOINT_PLANAR : KT_JOINT_REVOLUTE)
                      : stretches(b) || is_free ? KT_JOINT_FREE
                                                : KT_JOINT_SPHERICAL;
    if (i > 0) {
        body.parent = s->names[i - 1];
        body.joint.at = s->end;
        body.joint.rotation = part_of_turn(s, 1.0);
    }
    body.mass = mass;
    body.com = kt_vec3_make(0.5 * s->end.x, 0.0, 0.0);
    body.inertia = find_inertia(b, part, s->l, mass);
    body.shape.type = KT_SHAPE_ROD;
    body.shape.to = s->end;
    body.markers = marker;
    body.marker_count = 1;
    return body;
}

/* The marker of an end among the bodies that have been added; NULL: none. */
static const kt_marker *find_added_marker(const kt_builder *builder, const kt_end *end) {
    for (int i = 0; end->body != NULL && i < builder->body_count; i++) {
        const kt_body *body = &builder->bodies[i];
        const bool is_it = body->name != NULL && strcmp(body->name, end->body) == 0;
        for (int k = 0; is_it && k < body->marker_count; k++)
            if (body->markers[k].name != NULL && strcmp(body->markers[k].name, end->marker) == 0)
                return &body->markers[k];
    }
    return NULL;
}

/* An attached second end needs a position, because the default would be the origin of the world. */
static kt_status check_second_end(const kt_beam *b, kt_error *error) {
    const kt_end none = kt_end_default();
    const bool has_place = b->to.body != NULL || b->to.marker != NULL || b->to.at.x != none.at.x ||
                           b->to.at.y != none.at.y || b->to.at.z != none.at.z ||
                           b->to.rotation.type != none.rotation.type;
    return b->ends[1] == KT_BEAM_FREE || has_place
               ? KT_OK
               : kt_error_set(error, KT_ERROR_MODEL, "to",
                              "the second end is attached; give its place (body \"world\" for the world's origin), or "
                              "make the end free");
}

/* Attaches the first segment at `from`. */
static kt_status attach_first(const kt_builder *builder, const kt_beam *b, kt_body *body, kt_error *error) {
    const kt_marker *marker = b->from.marker != NULL ? find_added_marker(builder, &b->from) : NULL;
    body->parent = b->from.body;
    body->joint.at = b->from.at;
    body->joint.rotation = b->from.rotation;
    if (b->from.marker == NULL)
        return KT_OK;
    if (marker == NULL)
        return kt_error_set(error, KT_ERROR_MODEL, "from",
                            "body '%s' with a marker '%s' has not been added; add it before the beam",
                            b->from.body != NULL ? b->from.body : "world", b->from.marker);
    const bool turned = marker->rotation.type != KT_ROTATION_NONE;
    if (turned && b->from.rotation.type != KT_ROTATION_NONE)
        return kt_error_set(error, KT_ERROR_MODEL, "from",
                            "marker '%s' and the beam both have a rotation; give one rotation that combines the two",
                            b->from.marker);
    body->joint.at = marker->at;
    if (turned)
        body->joint.rotation = marker->rotation;
    return KT_OK;
}

/* ---- elastic joints ---------------------------------------------------------------------------------------------- */

static kt_effect make_bushing(const kt_beam *b, const char *name, const double *k) {
    kt_effect effect = kt_effect_default();
    effect.name = name;
    effect.type = KT_EFFECT_BUSHING;
    for (int i = 0; i < 6; i++) {
        effect.stiffnesses[i] = k[i];
        effect.dampings[i] = b->damping * k[i];
    }
    return effect;
}

static kt_end end_on(const char *body, kt_vec3 at, kt_rotation rotation) {
    kt_end end = kt_end_default();
    end.body = body;
    end.at = at;
    end.rotation = rotation;
    return end;
}

/* Whether an end has an elastic joint: a beam that keeps its length has none where it is hinged. */
static bool has_joint_at(const kt_beam *b, int end) {
    return b->ends[end] == KT_BEAM_CLAMPED || (b->ends[end] == KT_BEAM_HINGED && stretches(b));
}

/* The elastic joint before segment i, from 0. */
static kt_effect make_joint_before(const kt_beam_segment *s, int i, const char *name) {
    const kt_beam *b = s->beam;
    const kt_vec3 zero = kt_vec3_make(0.0, 0.0, 0.0);
    double k[6];
    find_stiffness(b, (double)i / b->segments, i == 0 ? 0.5 * s->l : s->l, i == 0 && b->ends[0] == KT_BEAM_HINGED, k);
    kt_effect effect = make_bushing(b, name, k);
    if (is_in_plane(b)) {
        effect = kt_effect_default();
        effect.name = name;
        effect.type = KT_EFFECT_JOINT_SPRING;
        effect.joint = s->names[i];
        effect.stiffness = k[5];
        effect.damping = b->damping * k[5];
        if (i == 0)
            effect.rest = kt_function_constant(0.5 * s->turn.z);
    } else if (i == 0) {
        effect.between[0] = b->from;
        effect.between[1] = end_on(s->names[0], zero, part_of_turn(s, -0.5));
    } else {
        effect.between[0] = end_on(s->names[i - 1], s->end, part_of_turn(s, 1.0));
        effect.between[1] = end_on(s->names[i], zero, kt_end_default().rotation);
    }
    return effect;
}

/* The joint at the second end: a bushing from the last segment to `to`. */
static kt_effect make_last_joint(const kt_beam_segment *s, const char *name) {
    const kt_beam *b = s->beam;
    double k[6];
    find_stiffness(b, 1.0, 0.5 * s->l, b->ends[1] == KT_BEAM_HINGED, k);
    kt_effect effect = make_bushing(b, name, k);
    effect.between[0] = end_on(s->names[b->segments - 1], s->end, part_of_turn(s, 0.5));
    effect.between[1] = b->to;
    return effect;
}

/* A beam that keeps its length is closed by a loop. */
static kt_loop make_closing_loop(const kt_beam_segment *s, const char *name) {
    const kt_beam *b = s->beam;
    kt_loop loop = kt_loop_default();
    loop.name = name;
    loop.type = KT_LOOP_SPHERICAL;
    loop.between[0] = end_on(s->names[b->segments - 1], s->end, kt_end_default().rotation);
    loop.between[1] = b->to;
    return loop;
}

/* ---- the beam ---------------------------------------------------------------------------------------------------- */

/* The names of the parts, and the marker that all segments have. */
typedef struct kt_beam_parts {
    const char **segment, **joint; /* one joint more than segments */
    const char *loop;
    const kt_marker *end;
} kt_beam_parts;

static bool name_parts(kt_builder *builder, const kt_beam *b, kt_beam_parts *parts) {
    const size_t n = (size_t)b->segments;
    parts->segment = kt_pool_take(&builder->pool, 2 * n + 1, sizeof *parts->segment);
    if (parts->segment == NULL)
        return false;
    parts->joint = parts->segment + n;
    for (size_t i = 0; i <= n; i++) {
        if (i < n && (parts->segment[i] = kt_builder_name(builder, b->name, "-", (int)i + 1)) == NULL)
            return false;
        if ((parts->joint[i] = kt_builder_name(builder, b->name, "-joint-", (int)i + 1)) == NULL)
            return false;
    }
    char *loop = kt_pool_take(&builder->pool, strlen(b->name) + sizeof "-end", 1);
    if (loop == NULL)
        return false;
    memcpy(loop, b->name, strlen(b->name));
    memcpy(loop + strlen(b->name), "-end", sizeof "-end");
    parts->loop = loop;
    return true;
}

/* Adds parts as long as the beam has room. */
static void add_parts(kt_builder *builder, const kt_beam *b, const kt_beam_segment *s, const kt_beam_parts *parts,
                      const kt_body *first) {
    const int n = b->segments;
    for (int i = 0; i < n; i++) {
        builder->bodies[builder->body_count++] = i == 0 ? *first : make_segment(s, i, parts->end);
        if (i > 0 || has_joint_at(b, 0))
            builder->effects[builder->effect_count++] = make_joint_before(s, i, parts->joint[i]);
    }
    if (has_joint_at(b, 1))
        builder->effects[builder->effect_count++] = make_last_joint(s, parts->joint[n]);
    if (b->ends[1] != KT_BEAM_FREE && !stretches(b))
        builder->loops[builder->loop_count++] = make_closing_loop(s, parts->loop);
}

/* Writes the name of the beam before the name of the member in an error. */
static kt_status name_beam(const kt_beam *b, kt_status status, const kt_error *from, kt_error *error) {
    char where[KT_WHERE_SIZE];
    snprintf(where, sizeof where, "beam '%s'", b->name != NULL ? b->name : "");
    return from->where[0] == '\0' ? kt_error_set(error, status, where, "%s", from->message)
                                  : kt_error_set(error, status, where, "%s: %s", from->where, from->message);
}

kt_status kt_builder_add_beam(kt_builder *builder, const kt_beam *b, kt_error *error) {
    if (KT_IS_MISSING(error, builder, b))
        return KT_ERROR_ARGUMENT;
    kt_beam_parts parts = {.segment = NULL};
    kt_error from = {0};
    kt_status status = kt_beam_check(b, &from);
    if (status == KT_OK)
        status = check_second_end(b, &from);
    if (status != KT_OK)
        return name_beam(b, status, &from, error);
    status = kt_builder_reserve(builder, b->segments, 1, b->segments + 1, error);
    if (status != KT_OK)
        return status;
    if (!name_parts(builder, b, &parts))
        return kt_builder_out_of_memory(error);
    const kt_beam_segment s = find_segment(b, parts.segment);
    parts.end = kt_builder_marker(builder, "end", s.end);
    if (parts.end == NULL)
        return kt_builder_out_of_memory(error);
    kt_body first = make_segment(&s, 0, parts.end);
    status = attach_first(builder, b, &first, &from);
    if (status == KT_OK)
        status = set_first_position(&s, &first.joint, &from);
    if (status != KT_OK)
        return name_beam(b, status, &from, error);
    add_parts(builder, b, &s, &parts, &first);
    return KT_OK;
}
