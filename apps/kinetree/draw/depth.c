/* Occlusion: solids, joints, feet, bushings and springs of a state, painted from the farthest to the nearest. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/grow.h"
#include "draw/paper.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* The element of the drawing that a piece belongs to. */
typedef enum thing_type {
    THING_BODY,   /* a solid of the picture */
    THING_JOINT,  /* a pin, a ball, a rail */
    THING_GROUND, /* the foot of a joint on the ground */
    THING_RUBBER, /* a bushing */
    THING_SPRING, /* number: of the effect */
} thing_type;

typedef struct thing {
    thing_type type;
    int number;
    kt_solid solid; /* in the camera's frame, with axes as they are; those of its pieces may be exchanged */
} thing;

typedef struct things {
    thing *items;
    int count;
    size_t room;
    kt_pieces pieces;
    bool is_full; /* memory was insufficient */
} things;

static void add_thing(things *t, const kt_sheet *sheet, kt_pose world, kt_solid solid, thing_type type, int number) {
    thing *items = kt_heap_grow(t->items, (size_t)t->count, 1, &t->room, sizeof *items);
    t->is_full = t->is_full || items == NULL;
    if (items == NULL)
        return;
    t->items = items;
    solid.pose = kt_camera_pose(&sheet->drawing->camera, kt_pose_compose(world, solid.pose));
    t->items[t->count] = (thing){type, number, solid};
    t->is_full = !kt_pieces_add(&t->pieces, &solid, t->count, type == THING_BODY) || t->is_full;
    t->count++;
}

static kt_solid centred(kt_solid_type type, double x, double y, double z) {
    return (kt_solid){.type = type, .pose = kt_pose_identity(), .half = {x, y, z}};
}

/* Whether a place in the world is in a solid of the picture, or nearer to one than a distance, in a state. */
static bool place_is_taken(const kt_picture *p, const kt_pose *poses, kt_vec3 at, double distance) {
    for (int i = 0; i < p->solid_count; i++) {
        const kt_pose pose = kt_pose_compose(poses[p->solids[i].body], p->solids[i].pose);
        const kt_vec3 local = kt_pose_apply(kt_pose_invert(pose), at);
        const double own = p->solids[i].type == KT_SOLID_ROD ? p->solids[i].half.x : 0.0;
        if (kt_vec3_norm(kt_vec3_sub(kt_solid_nearest(&p->solids[i], local), local)) < distance + own)
            return true;
    }
    return false;
}

static bool place_is_ever_taken(const kt_drawing *d, kt_vec3 at, double distance) {
    bool taken = false;
    for (int k = 0; k < kt_mount_states(d) && !taken; k++)
        taken = place_is_taken(d->picture, kt_mount_state(d, k), at, distance);
    return taken;
}

/* The middle of the first solid of a body's rigid part, or the body's origin if it has none. */
static kt_vec3 middle_of(const kt_picture *p, const kt_pose *poses, int body) {
    for (int i = 0; i < p->solid_count; i++)
        if (p->part[p->solids[i].body] == p->part[body])
            return kt_pose_apply(poses[p->solids[i].body], p->solids[i].pose.position);
    return poses[body].position;
}

/* How far the middle of a body is above a place, in the mean of the states that decide about mounts. */
static double mean_height(const kt_drawing *d, int body, kt_vec3 at, kt_vec3 up) {
    double sum = 0.0;
    for (int k = 0; k < kt_mount_states(d); k++)
        sum += kt_vec3_dot(kt_vec3_sub(middle_of(d->picture, kt_mount_state(d, k), body), at), up);
    return sum / kt_mount_states(d);
}

static void add_plate(things *t, const kt_sheet *sheet, kt_vec3 at, kt_vec3 up, double r) {
    const kt_pose pose = {.rotation = kt_triad_from_axis(up, 2), .position = at};
    const kt_pose seen = kt_camera_pose(&sheet->drawing->camera, pose);
    for (int i = 0; i < t->count; i++)
        if (t->items[i].type == THING_GROUND &&
            kt_vec3_norm(kt_vec3_sub(t->items[i].solid.pose.position, seen.position)) < r)
            return;
    add_thing(t, sheet, pose, centred(KT_SOLID_BOX, 3.4 * r, 3.4 * r, 0.45 * r), THING_GROUND, 0);
}

/* A plate on the ground, at the end of a fixed part. Without such a part it is below a joint, or above it if the body
 * hangs. There is none if neither has room in all states. */
static void add_foot(things *t, const kt_sheet *sheet, const kt_body_frame *frame, int body, double r) {
    const kt_drawing *d = sheet->drawing;
    const kt_mount mount = kt_mount_of(sheet, frame);
    const kt_vec3 up = kt_picture_vertical(d->picture);
    if (mount.is_of_part) {
        add_plate(t, sheet, kt_vec3_add(mount.place, kt_vec3_scale(mount.is_above ? 0.45 * r : -0.45 * r, up)), up, r);
        return;
    }
    const double side = mean_height(d, body, mount.place, up) < -3.0 * r ? 1.0 : -1.0;
    for (int i = 0; i < 12; i++) {
        const int pair = i / 2;
        const double height = (2.6 + pair) * r * (i % 2 == 0 ? side : -side);
        const kt_vec3 place = kt_vec3_add(mount.place, kt_vec3_scale(height, up));
        if (place_is_ever_taken(d, place, 1.8 * r))
            continue;
        add_plate(t, sheet, place, up, r);
        return;
    }
}

/* Makes a pin longer, so that it extends beyond a body, unless it would be longer than twelve radii. */
static void lengthen_pin(const kt_sheet *sheet, const kt_pose *frame, int body, double r, double *low, double *high) {
    double longer_low = *low, longer_high = *high;
    kt_reach_along(sheet->drawing->picture, sheet->poses, body, frame, r, &longer_low, &longer_high);
    if (longer_high - longer_low < 12.0 * r) {
        *low = longer_low;
        *high = longer_high;
    }
}

/* A pin along z of a frame, through the bodies that it joins. */
static void add_pin(things *t, const kt_sheet *sheet, kt_pose frame, int body, int other, double r) {
    double low = -1.4 * r, high = 1.4 * r;
    lengthen_pin(sheet, &frame, body, r, &low, &high);
    if (other > 0)
        lengthen_pin(sheet, &frame, other, r, &low, &high);
    kt_solid pin = centred(KT_SOLID_CYLINDER, r, r, 0.5 * (high - low) + 0.7 * r);
    pin.pose.position.z = 0.5 * (high + low);
    add_thing(t, sheet, frame, pin, THING_JOINT, 0);
}

static void add_pin_cross(things *t, const kt_sheet *sheet, kt_pose first, kt_pose second, double r) {
    second.position = first.position;
    add_thing(t, sheet, first, centred(KT_SOLID_CYLINDER, 0.7 * r, 0.7 * r, 2.2 * r), THING_JOINT, 0);
    add_thing(t, sheet, second, centred(KT_SOLID_CYLINDER, 0.7 * r, 0.7 * r, 2.2 * r), THING_JOINT, 0);
}

/* A rail, which extends beyond all positions of its body. */
static void add_rail(things *t, const kt_sheet *sheet, const kt_picture_joint *joint, kt_pose frame, double r) {
    double low, high;
    if (!kt_rail_span(sheet->drawing, joint, r, &low, &high))
        return;
    const double thick = (joint->type == KT_JOINT_SCREW ? 0.9 : 0.5) * r;
    kt_solid rail = centred(KT_SOLID_CYLINDER, thick, thick, 0.5 * (high - low) + 4.0 * r);
    rail.pose.position.z = 0.5 * (high + low);
    add_thing(t, sheet, frame, rail, THING_JOINT, 0);
}

/* Joints in space: a pin that extends beyond its bodies, a ball, crossed pins, a rail. */
static void add_joint_symbol(things *t, const kt_sheet *sheet, const kt_picture_joint *joint, double r) {
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses), body = sheet->poses[joint->body];
    const kt_pose second = {.rotation = kt_mat3_multiply(body.rotation, kt_triad_from_axis(joint->axis2, 2))};
    switch (joint->type) {
    case KT_JOINT_REVOLUTE:
        add_pin(t, sheet, frame, joint->body, joint->frame.body, r);
        break;
    case KT_JOINT_UNIVERSAL:
        add_pin_cross(t, sheet, frame, second, r);
        break;
    case KT_JOINT_SPHERICAL:
        add_thing(t, sheet, frame, centred(KT_SOLID_SPHERE, 1.4 * r, 1.4 * r, 1.4 * r), THING_JOINT, 0);
        break;
    case KT_JOINT_PRISMATIC:
    case KT_JOINT_CYLINDRICAL:
    case KT_JOINT_SCREW:
        add_rail(t, sheet, joint, frame, r);
        return;
    default:
        return;
    }
    if (kt_sheet_is_ground(sheet, joint->frame.body))
        add_foot(t, sheet, &joint->frame, joint->body, r);
}

static void add_loop_symbol(things *t, const kt_sheet *sheet, const kt_picture_loop *loop, double r) {
    const kt_pose a = kt_body_frame_pose(&loop->ends[0], sheet->poses),
                  b = kt_body_frame_pose(&loop->ends[1], sheet->poses);
    switch (loop->type) {
    case KT_LOOP_REVOLUTE:
        add_pin(t, sheet, a, loop->ends[0].body, loop->ends[1].body, r);
        break;
    case KT_LOOP_SPHERICAL:
        add_thing(t, sheet, a, centred(KT_SOLID_SPHERE, 1.4 * r, 1.4 * r, 1.4 * r), THING_JOINT, 0);
        break;
    case KT_LOOP_UNIVERSAL:
        add_pin_cross(t, sheet, a, b, r);
        break;
    default:
        return;
    }
    for (int k = 0; k < 2; k++)
        if (kt_sheet_is_ground(sheet, loop->ends[k].body) && !kt_sheet_is_ground(sheet, loop->ends[1 - k].body))
            add_foot(t, sheet, &loop->ends[k], loop->ends[1 - k].body, r);
}

static void add_bushing(things *t, const kt_sheet *sheet, const kt_picture_effect *effect, double r) {
    const kt_pose frame = kt_body_frame_pose(&effect->ends[0], sheet->poses);
    add_thing(t, sheet, frame, centred(KT_SOLID_CYLINDER, 2.2 * r, 2.2 * r, 1.6 * r), THING_RUBBER, 0);
}

/* The radius on the page of a bar that runs along most of a spring; 0: there is none. */
static double bar_in(const kt_sheet *sheet, kt_vec3 a, kt_vec3 b) {
    const kt_picture *p = sheet->drawing->picture;
    const kt_vec3 along = kt_vec3_sub(b, a);
    const double length = kt_vec3_norm(along);
    double radius = 0.0;
    for (int i = 0; i < p->solid_count; i++) {
        const kt_solid *solid = &p->solids[i];
        const kt_pose pose = kt_pose_compose(sheet->poses[solid->body], solid->pose);
        const kt_vec3 apart = kt_vec3_cross(kt_vec3_sub(pose.position, a), pose.rotation.z);
        if ((solid->type == KT_SOLID_ROD || solid->type == KT_SOLID_CYLINDER) && solid->half.z > 0.2 * length &&
            fabs(kt_vec3_dot(along, pose.rotation.z)) > 0.99 * length && kt_vec3_norm(apart) < solid->half.x)
            radius = fmax(radius, sheet->scale * solid->half.x);
    }
    return radius;
}

static void add_spring_symbol(things *t, const kt_sheet *sheet, int number, double r) {
    const kt_picture_effect *effect = &sheet->drawing->picture->effects[number];
    const kt_vec3 a = kt_body_frame_pose(&effect->ends[0], sheet->poses).position;
    const kt_vec3 b = kt_body_frame_pose(&effect->ends[1], sheet->poses).position;
    kt_solid rod = kt_solid_rod(a, b, fmax(r, 1.35 * bar_in(sheet, a, b) / sheet->scale));
    rod.type = KT_SOLID_CYLINDER;
    add_thing(t, sheet, kt_pose_identity(), rod, THING_SPRING, number);
}

static void collect_things(things *t, const kt_sheet *sheet) {
    const kt_drawing *d = sheet->drawing;
    const kt_picture *p = d->picture;
    const double r = sheet->pin / sheet->scale;
    for (int i = 0; i < p->solid_count; i++)
        add_thing(t, sheet, sheet->poses[p->solids[i].body], p->solids[i], THING_BODY, p->solids[i].body);
    if (d->is_diagram || sheet->fade > 0.0) /* of earlier states the bodies are enough */
        return;
    for (int i = 0; i < p->joint_count; i++)
        add_joint_symbol(t, sheet, &p->joints[i], r);
    for (int i = 0; i < p->loop_count; i++)
        add_loop_symbol(t, sheet, &p->loops[i], r);
    for (int i = 0; i < p->effect_count; i++)
        if (p->effects[i].type == KT_EFFECT_SPRING)
            add_spring_symbol(t, sheet, i, r);
        else if (p->effects[i].type == KT_EFFECT_BUSHING)
            add_bushing(t, sheet, &p->effects[i], r);
}

static void paint_spring(const kt_sheet *sheet, const kt_piece *piece, int number) {
    const kt_picture_effect *effect = &sheet->drawing->picture->effects[number];
    const kt_vec3 a = kt_body_frame_pose(&effect->ends[0], sheet->poses).position;
    const kt_vec3 b = kt_body_frame_pose(&effect->ends[1], sheet->poses).position;
    const double half = piece->solid.half.z;
    if (!(half > 0.0))
        return;
    kt_paint_spring(sheet, kt_sheet_place(sheet, a), kt_sheet_place(sheet, b), 0.5 + 0.5 * piece->low / half,
                    0.5 + 0.5 * piece->high / half, effect->has_stiffness, effect->has_damping,
                    1.35 * bar_in(sheet, a, b));
}

static kt_colour thing_colour_of(const kt_sheet *sheet, const thing *what) {
    const kt_palette *palette = sheet->palette;
    const kt_colour metal = kt_colour_mix(palette->paper, palette->quiet, 0.45);
    switch (what->type) {
    case THING_BODY:
        return kt_sheet_colour(sheet, what->number);
    case THING_JOINT:
        return kt_colour_mix(metal, palette->paper, 0.85 * sheet->fade);
    case THING_GROUND:
        return kt_colour_mix(palette->paper, palette->quiet, 0.3);
    default:
        return palette->quiet;
    }
}

/* FNV-1a, over the numbers of the things in their order. */
static void note_order(uint64_t *order, int number) {
    for (unsigned rest = (unsigned)number, k = 0; k < 4; k++, rest >>= 8)
        *order = (*order ^ (rest & 255U)) * UINT64_C(1099511628211);
}

static const double clear_opacity = 0.3;

static bool is_clear(const kt_sheet *sheet, const thing *what) {
    return what->type == THING_BODY && sheet->drawing->clear != NULL && sheet->drawing->clear[what->number];
}

static void end_clear(cairo_t *c) {
    cairo_pop_group_to_source(c);
    cairo_paint_with_alpha(c, clear_opacity);
}

static void paint_thing(const kt_sheet *sheet, const kt_piece *piece, const thing *what) {
    if (sheet->order != NULL)
        note_order(sheet->order, piece->thing);
    const bool clear = is_clear(sheet, what);
    if (clear)
        cairo_push_group(sheet->c);
    if (what->type == THING_SPRING)
        paint_spring(sheet, piece, what->number);
    else
        kt_paint_piece(sheet, piece, thing_colour_of(sheet, what));
    if (clear)
        end_clear(sheet->c);
}

static bool bodies_are_alike(const kt_picture *p, int i, int k) {
    return p->solids[k].type == KT_SOLID_ROD && p->solids[k].half.x == p->solids[i].half.x &&
           p->colour[p->solids[k].body] == p->colour[p->solids[i].body];
}

/* Paints bars of one colour and width as one path. Each then takes a quarter of the bytes of a separate path. */
static void paint_bars(const kt_sheet *sheet, int first) {
    const kt_picture *p = sheet->drawing->picture;
    for (int k = first; k < p->solid_count; k++) {
        const kt_pose pose = kt_pose_compose(sheet->poses[p->solids[k].body], p->solids[k].pose);
        const kt_vec3 half = kt_vec3_make(0.0, 0.0, p->solids[k].half.z);
        const kt_spot a = kt_sheet_place(sheet, kt_pose_apply(pose, kt_vec3_scale(-1.0, half)));
        const kt_spot b = kt_sheet_place(sheet, kt_pose_apply(pose, half));
        if (bodies_are_alike(p, first, k))
            kt_trace_line(sheet->c, a, b);
    }
    cairo_set_line_cap(sheet->c, CAIRO_LINE_CAP_ROUND);
    kt_paper_stroke(sheet->c, kt_sheet_colour(sheet, p->solids[first].body),
                    2.0 * fmax(sheet->scale * p->solids[first].half.x, 1.1));
    cairo_set_line_cap(sheet->c, CAIRO_LINE_CAP_BUTT);
}

static void paint_all_bars(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    for (int i = 0; i < p->solid_count; i++) {
        bool is_first = p->solids[i].type == KT_SOLID_ROD;
        for (int k = 0; k < i && is_first; k++)
            is_first = !bodies_are_alike(p, i, k);
        if (is_first)
            paint_bars(sheet, i);
    }
}

/* The rectangle of the page that the things take. */
static void find_limits(const kt_sheet *sheet, const things *t, kt_spot *low, kt_spot *high) {
    *low = (kt_spot){DBL_MAX, DBL_MAX};
    *high = (kt_spot){-DBL_MAX, -DBL_MAX};
    for (int i = 0; i < t->count; i++) {
        const kt_solid *solid = &t->items[i].solid;
        const kt_mat3 back = kt_mat3_transpose(solid->pose.rotation);
        const kt_spot middle = kt_sheet_spot(sheet, solid->pose.position);
        const double x = sheet->scale * kt_solid_reach(solid, back.x), y = sheet->scale * kt_solid_reach(solid, back.y);
        *low = (kt_spot){fmin(low->x, middle.x - x), fmin(low->y, middle.y - y)};
        *high = (kt_spot){fmax(high->x, middle.x + x), fmax(high->y, middle.y + y)};
    }
}

/* ---- paths before and behind things ------------------------------------------------------------------------------ */

typedef struct covering_things {
    const kt_sheet *sheet;
    const things *things;
} covering_things;

/* The nearest of the things that hide paths; springs and clear bodies do not. */
static bool depth_of_things(const void *user, kt_vec3 at, double *depth) {
    const covering_things *covering = user;
    const things *t = covering->things;
    bool found = false;
    for (int i = 0; i < t->count; i++) {
        const kt_solid *solid = &t->items[i].solid;
        const double room = kt_vec3_norm(solid->half) + solid->half.x;
        double enter, leave;
        if (t->items[i].type == THING_SPRING || is_clear(covering->sheet, &t->items[i]) ||
            fabs(at.x - solid->pose.position.x) > room || fabs(at.y - solid->pose.position.y) > room)
            continue;
        const kt_pose inverse = kt_pose_invert(solid->pose);
        const kt_vec3 from = kt_pose_apply(inverse, kt_vec3_make(at.x, at.y, 0.0));
        if (!kt_solid_cut(solid, from, inverse.rotation.z, &enter, &leave))
            continue;
        *depth = found ? fmax(*depth, leave) : leave;
        found = true;
    }
    return found;
}

typedef struct pixels {
    const kt_sheet *sheet;
    const kt_raster *raster;
} pixels;

static bool depth_of_pixels(const void *user, kt_vec3 at, double *depth) {
    const pixels *p = user;
    return kt_raster_depth(p->raster, kt_sheet_spot(p->sheet, at), depth);
}

/* ---- painting ---------------------------------------------------------------------------------------------------- */

/* All things but springs as pixels: without clear bodies, or with them, whose numbers then begin at *first_clear. The
 * solids of a rigid part have one line around them. NULL: memory is insufficient. */
static kt_raster *make_pixels(const kt_sheet *sheet, const things *t, int *first_clear) {
    const kt_picture *p = sheet->drawing->picture;
    kt_spot low, high;
    find_limits(sheet, t, &low, &high);
    kt_raster *raster = kt_raster_create(sheet, low, high);
    bool fine = raster != NULL;
    const int clear_from = p->body_count + t->count;
    for (int i = 0; i < t->count && fine; i++) {
        const thing *what = &t->items[i];
        const bool clear = is_clear(sheet, what);
        const int number = (what->type == THING_BODY ? p->part[what->number] : p->body_count + i) + clear * clear_from;
        if (what->type != THING_SPRING && (!clear || first_clear != NULL))
            fine = kt_raster_paint(raster, &what->solid, number, thing_colour_of(sheet, what));
    }
    if (first_clear != NULL)
        *first_clear = clear_from;
    if (fine)
        return raster;
    kt_raster_free(raster);
    return NULL;
}

/* Shows the clear bodies where they are nearest. */
static bool show_clear_pixels(const kt_sheet *sheet, const things *t) {
    int first;
    kt_raster *raster = make_pixels(sheet, t, &first);
    if (raster == NULL)
        return false;
    kt_raster_keep(raster, first);
    cairo_push_group(sheet->c);
    const bool fine = kt_raster_show(raster);
    end_clear(sheet->c);
    kt_raster_free(raster);
    return fine;
}

/* The pixels also cover paths. */
static bool paint_pixels(const kt_sheet *sheet, const things *t, bool is_shown) {
    kt_raster *raster = make_pixels(sheet, t, NULL);
    if (raster != NULL)
        kt_traces_cover(sheet, depth_of_pixels, &(pixels){sheet, raster});
    const bool fine =
        raster != NULL &&
        (!is_shown || (kt_raster_show(raster) && (sheet->drawing->clear == NULL || show_clear_pixels(sheet, t))));
    kt_raster_free(raster);
    for (int i = 0; i < t->pieces.count && fine && is_shown; i++)
        if (t->items[t->pieces.items[i].thing].type == THING_SPRING)
            paint_thing(sheet, &t->pieces.items[i], &t->items[t->pieces.items[i].thing]);
    return fine;
}

/* Paints all things as shapes of the page, the farthest first. */
static bool paint_pieces(const kt_sheet *sheet, things *t, bool joins_bars, bool is_shown) {
    if (is_shown && !kt_pieces_sort(&t->pieces, 0.8 / sheet->scale, sheet->drawing->is_diagram))
        return false;
    for (int i = 0; i < t->pieces.count && is_shown; i++)
        if (!joins_bars || t->pieces.items[i].solid.type != KT_SOLID_ROD)
            paint_thing(sheet, &t->pieces.items[i], &t->items[t->pieces.items[i].thing]);
    kt_traces_cover(sheet, depth_of_things, &(covering_things){sheet, t});
    return true;
}

bool kt_paint_solids(const kt_sheet *sheet) {
    const bool has_meshes = sheet->drawing->picture->mesh_count > 0, is_shown = sheet->c != NULL;
    const bool joins_bars = is_shown && kt_sheet_is_plain(sheet) && sheet->drawing->is_diagram && !has_meshes;
    if (joins_bars)
        paint_all_bars(sheet);
    things t = {0};
    collect_things(&t, sheet);
    const bool fine =
        !t.is_full && (has_meshes ? paint_pixels(sheet, &t, is_shown) : paint_pieces(sheet, &t, joins_bars, is_shown));
    kt_pieces_free(&t.pieces);
    free(t.items);
    return fine;
}
