/* Beams: the expansion of a `beams` section. Each beam becomes a chain of rigid bodies NAME-1, NAME-2, ..., one for
 * each of its `segments`, of the length l = length / segments. Elastic joints between them have the strain of the
 * length between two middles:
 *
 *   Boundary k = 1 .. segments - 1: the section stiffness at x = k l, over l.
 *   Clamped end: the section stiffness there, over l / 2, the distance to the middle of the first segment.
 *   Hinged end: the same for forces; no moment.
 *
 * This is a central difference of rotations and displacements, of the second order in l. Segment i has the mass per
 * length at its middle times l, and the inertia of a straight rod of its section. The given stiffnesses determine how
 * segments move on one another:
 *
 *   EA, GA, GJ, EI: in all six ways, with bushings between free joints.
 *   GJ, EI: by rotations, with bushings in spherical joints. The beam keeps its length and its sections stay normal.
 *   EI as one number: about z alone, with springs in revolute joints. The beam bends in its plane.
 *
 * The section is made into items of `bodies`, `effects` and `loops` before these are read. A segment is therefore a
 * body like any other, and others may have it as parent or end. Faults of its items are reported at the beam.
 *
 * Source: the finite-segment method, e.g. J. W. Kamman, R. L. Huston, Multibody System Dynamics 6 (2001). Section
 * forces and strains are those of a geometrically exact beam, of which it is a difference scheme: J. C. Simo, CMAME 49,
 * p. 55 (1985).
 */
#include "scene/beam.h"
#include "document/number.h"
#include "kinetree/algebra.h"
#include "scene/expand.h"
#include "scene/part.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { KT_BEAM_SEGMENTS_MAX = 10000, KT_BEAM_ITEM_SIZE = 1536, KT_BEAM_STATIONS_MAX = 64 };

typedef enum kt_beam_end { KT_BEAM_UNSAID = -1, KT_BEAM_CLAMPED, KT_BEAM_HINGED, KT_BEAM_FREE } kt_beam_end;

/* A number along the beam: at evenly spaced stations from its beginning to its end, linear between. */
typedef struct kt_along {
    double at[KT_BEAM_STATIONS_MAX];
    int count; /* 0: not given */
} kt_along;

typedef struct kt_beam {
    const char *name;
    kt_node *from, *to;
    double segments, length, damping, polar; /* polar: inertia per length about the axis; -1: that of the section */
    kt_along mass, EA, GA[2], GJ, EI[2];
    bool plane; /* EI is one number */
    kt_vec3 curvature;
    kt_beam_end end[2];
} kt_beam;

/* ---- kinds of values --------------------------------------------------------------------------------------------- */

static bool read_node(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)r, (void)scope;
    kt_node **out = kt_field_in(object, field);
    *out = node;
    return true;
}
static const kt_kind kind_node = {.read = read_node};

static bool check_stations(kt_reader *r, const kt_scope *scope, kt_node *node) {
    return (node->count >= 2 && node->count <= KT_BEAM_STATIONS_MAX) ||
           kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%u stations along the beam; there may be 2 to %d", node->count,
                       (int)KT_BEAM_STATIONS_MAX);
}

/* A number, or a list of them at stations along the beam. */
static bool read_along(kt_reader *r, const kt_scope *scope, kt_node *node, kt_along *out) {
    kt_along read = {.count = 0};
    if (node->kind != KT_NODE_LIST) {
        if (!kt_read_number(r, scope, node, KT_QUANTITY_POSITIVE, &read.at[read.count++]))
            return false;
    } else {
        if (!check_stations(r, scope, node))
            return false;
        for (kt_node *item = node->of.first; item != NULL; item = item->next) {
            const kt_scope here = {.outer = scope, .index = read.count};
            if (!kt_read_number(r, &here, item, KT_QUANTITY_POSITIVE, &read.at[read.count++]))
                return false;
        }
    }
    *out = read;
    return true;
}

static bool read_scalar(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return read_along(r, scope, node, kt_field_in(object, field));
}
static const kt_kind kind_scalar = {.read = read_scalar};

/* [y, z], or a list of such pairs at stations along the beam. */
static bool read_pair(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_along *out = kt_field_in(object, field), read[2] = {{.count = 0}, {.count = 0}};
    double x[2];
    if (node->kind != KT_NODE_LIST || node->count < 2)
        return kt_fault_expected(r, scope, node, "[y, z], or a list of such pairs along the beam");
    const bool many = node->of.first->kind == KT_NODE_LIST;
    if (many && !check_stations(r, scope, node))
        return false;
    for (kt_node *item = many ? node->of.first : node; item != NULL; item = many ? item->next : NULL) {
        const kt_scope here = {.outer = scope, .index = read[0].count};
        if (!kt_read_numbers(r, many ? &here : scope, item, 2, KT_QUANTITY_POSITIVE, NULL, x))
            return false;
        for (int i = 0; i < 2; i++)
            read[i].at[read[i].count++] = x[i];
    }
    memcpy(out, read, sizeof read);
    return true;
}
static const kt_kind kind_pair = {.read = read_pair};

/* EI: one number bends in the plane, two about y and z. */
static bool read_bending(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_beam *beam = object;
    if (node->kind == KT_NODE_LIST)
        return read_pair(r, scope, node, field, object);
    beam->plane = true;
    return read_along(r, scope, node, &beam->EI[1]);
}
static const kt_kind kind_bending = {.read = read_bending};

static bool read_ends(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    static const char *const names[] = {"clamped", "hinged", "free"};
    static const kt_choice choice = {"beams.ends", names, 3, 0, NULL};
    kt_beam_end *out = kt_field_in(object, field);
    if (node->kind != KT_NODE_LIST || node->count != 2)
        return kt_fault_expected(r, scope, node, "two of clamped, hinged and free");
    int i = 0;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, i++) {
        const kt_scope here = {.outer = scope, .index = i};
        const int value = kt_choice_read(r, &here, item, &choice);
        if (value < 0)
            return false;
        out[i] = (kt_beam_end)value;
    }
    return true;
}
static const kt_kind kind_ends = {.read = read_ends};

#define AT(member) .offset = offsetof(kt_beam, member)
static const kt_field fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name), .flags = KT_FIELD_REQUIRED},
    {.key = "from", .kind = &kind_node, AT(from)},
    {.key = "to", .kind = &kind_node, AT(to)},
    {.key = "ends", .kind = &kind_ends, AT(end)},
    {.key = "segments", .kind = &kt_kind_positive, AT(segments), .flags = KT_FIELD_REQUIRED},
    {.key = "length", .kind = &kt_kind_positive, AT(length), .flags = KT_FIELD_REQUIRED},
    {.key = "mass_per_length", .kind = &kind_scalar, AT(mass), .flags = KT_FIELD_REQUIRED},
    {.key = "inertia_per_length", .kind = &kt_kind_positive, AT(polar)},
    {.key = "EA", .kind = &kind_scalar, AT(EA)},
    {.key = "GA", .kind = &kind_pair, AT(GA)},
    {.key = "GJ", .kind = &kind_scalar, AT(GJ)},
    {.key = "EI", .kind = &kind_bending, AT(EI), .flags = KT_FIELD_REQUIRED},
    {.key = "curvature", .kind = &kt_kind_vector, AT(curvature)},
    {.key = "damping", .kind = &kt_kind_number, AT(damping)},
};
static const kt_table beam_table = {.fields = fields, .count = KT_COUNT_OF(fields)};

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static bool check_section(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_beam *b) {
    const bool stretches = b->EA.count > 0 || b->GA[0].count > 0;
    if (b->plane && (stretches || b->GJ.count > 0))
        return kt_fault_at(
            r, KT_ERROR_SCENE, scope, node,
            "EI is one number, so the beam bends in its plane alone; leave out EA, GA and GJ, or write EI: [y, z]");
    if (!b->plane && b->GJ.count == 0)
        return kt_fault_at(
            r, KT_ERROR_SCENE, scope, node,
            "EI: [y, z] is for bending in space, which also needs GJ; for bending in a plane, give one number for EI");
    if (stretches && (b->EA.count == 0 || b->GA[0].count == 0))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "EA and GA belong together; give both, or neither for a beam of constant length");
    if (!b->plane && !stretches && b->polar < 0.0)
        return kt_fault_at(
            r, KT_ERROR_SCENE, scope, node,
            "without EA the section's inertia is missing: give inertia_per_length, kg m, about the axis");
    return true;
}

static bool check_beam(kt_reader *r, const kt_scope *scope, kt_node *node, kt_beam *b) {
    if (!(b->segments >= 2.0 && b->segments <= KT_BEAM_SEGMENTS_MAX && b->segments == floor(b->segments)))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "segments"),
                           "%g: segments are a whole number, 2 to %d", b->segments, (int)KT_BEAM_SEGMENTS_MAX);
    if (!(b->damping >= 0.0))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "damping"),
                           "%g: damping, in seconds times the stiffness, is zero or more", b->damping);
    if (b->end[0] == KT_BEAM_UNSAID) {
        b->end[0] = KT_BEAM_CLAMPED;
        b->end[1] = b->to != NULL ? KT_BEAM_CLAMPED : KT_BEAM_FREE;
    }
    if (b->to == NULL && b->end[1] != KT_BEAM_FREE)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "ends"),
                           "the second end is attached, but 'to: END' is missing; add it, or make the end free");
    if (b->to != NULL && b->end[1] == KT_BEAM_FREE)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "ends"),
                           "the second end is free, so 'to' has no meaning; leave out one of them");
    return check_section(r, scope, node, b);
}

/* ---- text -------------------------------------------------------------------------------------------------------- */

typedef struct kt_text {
    char *at, *end;
} kt_text;

static void put_beam_text(kt_text *t, const char *format, ...) KT_PRINTF(2, 3);

static void put_beam_text(kt_text *t, const char *format, ...) {
    va_list values;
    va_start(values, format);
    const int used = vsnprintf(t->at, (size_t)(t->end - t->at), format, values);
    va_end(values);
    t->at += used > 0 && used < t->end - t->at ? used : 0; /* sized so that it fits */
}

static void put_beam_numbers(kt_text *t, const double *x, int count) {
    for (int i = 0; i < count; i++) {
        char number[KT_NUMBER_SIZE];
        kt_number_format(number, x[i]);
        put_beam_text(t, i == 0 ? "[%s" : ", %s", number);
    }
    put_beam_text(t, "]");
}

static double value_along(const kt_along *a, double part) {
    const double x = part * (a->count - 1);
    const int i = x >= a->count - 1 ? a->count - 1 : (int)x;
    return i == a->count - 1 ? a->at[i] : a->at[i] + (x - i) * (a->at[i + 1] - a->at[i]);
}

/* A segment: its length as a chord of the curved axis, and the turn from one segment to the next. */
typedef struct kt_beam_segment {
    double length, turn[3];
} kt_beam_segment;

static kt_beam_segment segment_of(const kt_beam *b) {
    const double l = b->length / b->segments, half = 0.5 * l * kt_hypot(b->curvature.y, b->curvature.z);
    const kt_beam_segment s = {half > 0.0 ? l * sin(half) / half : l,
                               {l * b->curvature.x, l * b->curvature.y, l * b->curvature.z}};
    return s;
}

/* `, rotation: {vector: factor turn}` */
static void put_turn(kt_text *t, const kt_beam_segment *s, double factor) {
    const double turn[] = {factor * s->turn[0], factor * s->turn[1], factor * s->turn[2]};
    put_beam_text(t, ", rotation: {vector: ");
    put_beam_numbers(t, turn, 3);
    put_beam_text(t, "}");
}

/* Stiffness or damping of the joint at `part` of the length whose two middles are `apart`: forces, moments. */
static void find_stiffness(const kt_beam *b, double part, double apart, bool hinged, double *k) {
    const kt_along *section[6] = {&b->EA, &b->GA[0], &b->GA[1], &b->GJ, &b->EI[0], &b->EI[1]};
    for (int i = 0; i < 6; i++)
        k[i] = section[i]->count > 0 && !(hinged && i >= 3) ? value_along(section[i], part) / apart : 0.0;
}

static void put_beam_spring(kt_text *t, const kt_beam *b, const double *k) {
    double c[6];
    for (int i = 0; i < 6; i++)
        c[i] = b->damping * k[i];
    put_beam_text(t, "stiffness: ");
    put_beam_numbers(t, k, 6);
    put_beam_text(t, ", damping: ");
    put_beam_numbers(t, c, 6);
    put_beam_text(t, "}\n");
}

/* The elastic joint before segment i (0 ..): effect NAME-joint-i+1. The first segment is half a turn of a segment away
 * from the section at the beginning. */
static void put_joint_effect(kt_text *t, const kt_beam *b, int i) {
    const int n = (int)b->segments;
    const double l = b->length / n;
    const kt_beam_segment s = segment_of(b);
    const double end[] = {s.length, 0.0, 0.0};
    double k[6];
    if (i == 0 && (b->end[0] == KT_BEAM_FREE || (b->end[0] == KT_BEAM_HINGED && b->EA.count == 0)))
        return;
    find_stiffness(b, (double)i / n, i == 0 ? 0.5 * l : l, i == 0 && b->end[0] == KT_BEAM_HINGED, k);
    if (b->plane) {
        const double numbers[] = {k[5], i == 0 ? 0.5 * s.turn[2] : 0.0, b->damping * k[5]};
        char text[3][KT_NUMBER_SIZE];
        for (int m = 0; m < 3; m++)
            kt_number_format(text[m], numbers[m]);
        put_beam_text(t,
                      "- {name: %s-joint-%d, type: joint_spring, joint: %s-%d, stiffness: %s, rest: %s, damping: %s}\n",
                      b->name, i + 1, b->name, i + 1, text[0], text[1], text[2]);
        return;
    }
    put_beam_text(t, "- {name: %s-joint-%d, type: bushing, between: [", b->name, i + 1);
    if (i == 0) {
        put_beam_text(t, "__from__, {body: %s-1", b->name);
        put_turn(t, &s, -0.5);
        put_beam_text(t, "}], ");
    } else {
        put_beam_text(t, "{body: %s-%d, at: ", b->name, i);
        put_beam_numbers(t, end, 3);
        put_turn(t, &s, 1.0);
        put_beam_text(t, "}, %s-%d], ", b->name, i + 1);
    }
    put_beam_spring(t, b, k);
}

/* The joint at the second end: a bushing from the last segment to `to`. A beam that keeps its length is closed by a
 * loop. */
static void put_last_effect(kt_text *t, const kt_beam *b) {
    const int n = (int)b->segments;
    const kt_beam_segment s = segment_of(b);
    const double end[] = {s.length, 0.0, 0.0};
    double k[6];
    if (b->end[1] == KT_BEAM_FREE || (b->end[1] == KT_BEAM_HINGED && b->EA.count == 0))
        return;
    find_stiffness(b, 1.0, 0.5 * b->length / n, b->end[1] == KT_BEAM_HINGED, k);
    put_beam_text(t, "- {name: %s-joint-%d, type: bushing, between: [{body: %s-%d, at: ", b->name, n + 1, b->name, n);
    put_beam_numbers(t, end, 3);
    put_turn(t, &s, 0.5);
    put_beam_text(t, "}, __to__], ");
    put_beam_spring(t, b, k);
}

static void put_beam_loop(kt_text *t, const kt_beam *b) {
    const double end[] = {segment_of(b).length, 0.0, 0.0};
    if (b->end[1] == KT_BEAM_FREE || b->EA.count > 0)
        return;
    put_beam_text(t, "- {name: %s-end, type: spherical, between: [{body: %s-%d, at: ", b->name, b->name,
                  (int)b->segments);
    put_beam_numbers(t, end, 3);
    put_beam_text(t, "}, __to__]}\n");
}

/* The position of the first segment's joint, of half a turn of a segment. */
static void put_position(kt_text *t, const kt_beam_segment *s, const char *joint) {
    const double half[] = {0.5 * s->turn[0], 0.5 * s->turn[1], 0.5 * s->turn[2]};
    if (half[0] == 0.0 && half[1] == 0.0 && half[2] == 0.0)
        return;
    put_beam_text(t, ", position: ");
    if (strcmp(joint, "free") == 0) {
        put_beam_text(t, "{orientation: {vector: ");
        put_beam_numbers(t, half, 3);
        put_beam_text(t, "}}");
    } else if (strcmp(joint, "spherical") == 0) {
        put_beam_text(t, "{vector: ");
        put_beam_numbers(t, half, 3);
        put_beam_text(t, "}");
    } else if (strcmp(joint, "planar") == 0) {
        const double position[] = {0.0, 0.0, half[2]};
        put_beam_numbers(t, position, 3);
    } else {
        char number[KT_NUMBER_SIZE];
        kt_number_format(number, half[2]);
        put_beam_text(t, "%s", number);
    }
}

static void find_inertia(const kt_beam *b, double part, double l, double mass, double inertia[3]) {
    const double square =
        b->EA.count > 0 ? 1.0 / value_along(&b->EA, part) : 0.0; /* EI of it: the radius of inertia squared */
    inertia[0] = 0.0;
    inertia[1] = inertia[2] = mass * l * l / 12.0;
    for (int k = 0; k < 2 && !b->plane; k++) {
        const double section = b->polar >= 0.0 ? 0.5 * b->polar * l : mass * value_along(&b->EI[k], part) * square;
        inertia[0] += section;
        inertia[k + 1] += section;
    }
}

static void put_segment(kt_text *t, const kt_beam *b, int i) {
    const int n = (int)b->segments;
    const kt_beam_segment s = segment_of(b);
    const double l = b->length / n, part = (i + 0.5) / n, mass = value_along(&b->mass, part) * l;
    const double end[] = {s.length, 0.0, 0.0}, com[] = {0.5 * s.length, 0.0, 0.0};
    double inertia[3];
    char number[KT_NUMBER_SIZE];
    const char *joint = b->plane ? "revolute" : b->EA.count > 0 ? "free" : "spherical";
    if (i == 0 && b->end[0] == KT_BEAM_FREE)
        joint = b->plane ? "planar" : "free";
    find_inertia(b, part, l, mass, inertia);
    put_beam_text(t, "- {name: %s-%d, ", b->name, i + 1);
    if (i == 0) {
        put_beam_text(t, "parent: __parent__, joint: {type: %s, at: __at__, rotation: __rotation__", joint);
        put_position(t, &s, joint);
    } else {
        put_beam_text(t, "parent: %s-%d, joint: {type: %s, at: ", b->name, i, joint);
        put_beam_numbers(t, end, 3);
        put_turn(t, &s, 1.0);
    }
    kt_number_format(number, mass);
    put_beam_text(t, "}, mass: %s, com: ", number);
    put_beam_numbers(t, com, 3);
    put_beam_text(t, ", inertia: ");
    put_beam_numbers(t, inertia, 3);
    put_beam_text(t, ", shape: {type: rod, to: ");
    put_beam_numbers(t, end, 3);
    put_beam_text(t, "}, markers: {end: ");
    put_beam_numbers(t, end, 3);
    put_beam_text(t, "}}\n");
}

/* ---- nodes ------------------------------------------------------------------------------------------------------- */

/* The place of a marker in the file's bodies; NULL: none. */
static const kt_node *find_beam_marker(const kt_reader *r, const char *body, const char *marker) {
    const kt_node *bodies = kt_node_find(r->root, "bodies");
    if (bodies == NULL || bodies->kind != KT_NODE_LIST)
        return NULL;
    for (const kt_node *item = bodies->of.first; item != NULL; item = item->next) {
        const kt_node *name = item->kind == KT_NODE_MAP ? kt_node_find(item, "name") : NULL;
        const kt_node *markers = item->kind == KT_NODE_MAP ? kt_node_find(item, "markers") : NULL;
        if (name != NULL && name->kind == KT_NODE_TEXT && strcmp(name->of.text, body) == 0)
            return markers != NULL && markers->kind == KT_NODE_MAP ? kt_node_find(markers, marker) : NULL;
    }
    return NULL;
}

/* Finds the start of the first segment: its parent, and the point and the rotation there. */
static bool find_from(kt_reader *r, const kt_scope *scope, const kt_beam *b, kt_replacement *words) {
    kt_end end = kt_end_default();
    if (b->from != NULL && !kt_read_end(r, scope, b->from, &end))
        return false;
    const bool is_map = b->from != NULL && b->from->kind == KT_NODE_MAP;
    const kt_node *at = is_map ? kt_node_find(b->from, "at") : NULL;
    const kt_node *turned = is_map ? kt_node_find(b->from, "rotation") : NULL;
    if (end.marker != NULL) {
        at = find_beam_marker(r, end.body != NULL ? end.body : "world", end.marker);
        if (at == NULL)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, b->from, "body '%s' has no marker '%s'",
                               end.body != NULL ? end.body : "world", end.marker);
    }
    if (at != NULL && at->kind == KT_NODE_MAP) {
        const kt_node *on = kt_node_find(at, "rotation");
        at = kt_node_find(at, "at");
        if (on != NULL && turned != NULL)
            return kt_fault_at(
                r, KT_ERROR_SCENE, scope, b->from,
                "marker '%s' has a rotation, and the beam another one against it; give one that has both", end.marker);
        turned = on != NULL ? on : turned;
    }
    words[0] = (kt_replacement){"__parent__", NULL, end.body != NULL ? end.body : "world"};
    words[1] = (kt_replacement){"__at__", at, NULL};
    words[2] = (kt_replacement){"__rotation__", turned, NULL};
    words[3] = (kt_replacement){"__from__", b->from, b->from == NULL ? "world" : NULL};
    words[4] = (kt_replacement){"__to__", b->to, NULL};
    return true;
}

/* ---- the section ------------------------------------------------------------------------------------------------- */

static void expand_beam(kt_reader *r, kt_node *node, const kt_scope *scope, const kt_beam *b) {
    enum { WORDS = 5, PARTS = 3 };
    static const char *const sections[PARTS] = {"bodies", "effects", "loops"};
    kt_replacement words[WORDS];
    const int n = (int)b->segments;
    const size_t size = ((size_t)n + 2) * (KT_BEAM_ITEM_SIZE + 4 * strlen(b->name));
    if (!find_from(r, scope, b, words))
        return;
    kt_node *zero = kt_nodes_parse(r, "[0, 0, 0]", 9), *rest = kt_nodes_parse(r, "{vector: [0, 0, 0]}", 19);
    char *memory = kt_pool_take(&r->scratch, PARTS, size);
    if (memory == NULL || zero == NULL || rest == NULL) {
        (void)kt_reader_out_of_memory(r);
        return;
    }
    words[1].node = words[1].node != NULL ? words[1].node : zero;
    words[2].node = words[2].node != NULL ? words[2].node : rest;
    kt_text text[PARTS];
    for (int p = 0; p < PARTS; p++)
        text[p] = (kt_text){memory + (size_t)p * size, memory + (size_t)(p + 1) * size};
    for (int i = 0; i < n; i++) {
        put_segment(&text[0], b, i);
        put_joint_effect(&text[1], b, i);
    }
    put_last_effect(&text[1], b);
    put_beam_loop(&text[2], b);
    for (int p = 0; p < PARTS && !r->out_of_memory; p++) {
        const char *start = memory + (size_t)p * size;
        kt_node *items = kt_nodes_parse(r, start, (size_t)(text[p].at - start));
        if (items == NULL)
            continue;
        kt_nodes_settle(items, node, words, WORDS);
        kt_nodes_append(r, sections[p], items, node);
    }
}

void kt_beams_expand(kt_reader *r) {
    const kt_scope scope = {.key = "beams"};
    kt_node *list = kt_node_find(r->root, "beams"), **nodes;
    int count = 0;
    if (list == NULL ||
        !kt_list_nodes(r, &scope, list, "a list of beams ('- {name: ..., segments: ...}')", &nodes, &count))
        return;
    for (int i = 0; i < count && !r->out_of_memory; i++) {
        const kt_scope here = kt_item_scope("beam", "beams", i, nodes[i]);
        kt_beam beam = {.polar = -1.0, .end = {KT_BEAM_UNSAID, KT_BEAM_UNSAID}};
        if (kt_table_read(r, &here, nodes[i], &beam_table, &beam) && !kt_node_is_faulty(nodes[i]) &&
            check_beam(r, &here, nodes[i], &beam))
            expand_beam(r, nodes[i], &here, &beam);
    }
    if (kt_node_is_faulty(list))
        r->scene->names_are_known = false;
}
