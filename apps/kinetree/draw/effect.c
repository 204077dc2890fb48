/* Symbols of effects and of relations between joints. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"
#include "picture/solid.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* A wall behind the end of a spring that does not move. */
static void paint_wall(const kt_sheet *sheet, kt_spot at, kt_spot from) {
    const kt_spot along = kt_spot_direction(from, at);
    const double half = 2.4 * fmax(sheet->pin, 3.0);
    kt_paint_hatching(sheet, kt_spot_offset(at, along, 0.0, half), kt_spot_offset(at, along, 0.0, -half));
}

static void paint_link(const kt_sheet *sheet, const kt_picture_effect *effect) {
    const kt_spot a = kt_sheet_frame(sheet, &effect->ends[0]), b = kt_sheet_frame(sheet, &effect->ends[1]);
    const bool is_far = kt_spot_distance(a, b) > 3.0;
    const bool is_centre = effect->ends[0].body == 0 || effect->ends[1].body == 0;
    for (int k = 0; k < 2 && effect->type != KT_EFFECT_ATTRACTION && is_far; k++)
        if (kt_sheet_is_ground(sheet, effect->ends[k].body))
            paint_wall(sheet, k == 0 ? a : b, k == 0 ? b : a);
    if (effect->type == KT_EFFECT_ATTRACTION && is_centre) { /* towards the centre, which may be far away */
        const kt_spot from = effect->ends[0].body == 0 ? b : a, to = effect->ends[0].body == 0 ? a : b;
        const double start = 3.0 * sheet->pin, length = fmin(kt_spot_distance(a, b), start + 36.0);
        kt_paint_arrow(sheet, kt_spot_offset(from, kt_spot_direction(from, to), fmin(start, 0.5 * length), 0.0),
                       kt_spot_offset(from, kt_spot_direction(from, to), length, 0.0), 1.2,
                       kt_sheet_faded(sheet, sheet->palette->quiet));
    } else if (effect->type == KT_EFFECT_ATTRACTION)
        kt_paint_dashes(sheet, a, b, kt_sheet_faded(sheet, sheet->palette->quiet), 1.0);
    else if (effect->type == KT_EFFECT_SPRING && sheet->drawing->is_diagram)
        kt_paint_spring(sheet, a, b, 0.0, 1.0, effect->has_stiffness, effect->has_damping, 0.0);
}

/* A bushing: a square of rubber with a cross in it. */
static void paint_bushing(const kt_sheet *sheet, kt_spot at) {
    const double h = 1.5 * fmax(sheet->pin, 3.0);
    cairo_t *c = sheet->c;
    cairo_rectangle(c, at.x - h, at.y - h, 2.0 * h, 2.0 * h);
    kt_paper_use(c, sheet->palette->paper);
    cairo_fill_preserve(c);
    kt_trace_line(c, (kt_spot){at.x - h, at.y - h}, (kt_spot){at.x + h, at.y + h});
    kt_trace_line(c, (kt_spot){at.x - h, at.y + h}, (kt_spot){at.x + h, at.y - h});
    kt_paper_stroke(c, kt_sheet_faded(sheet, sheet->palette->ink), 1.1);
}

/* An arc with a head, anticlockwise, around a spot; clockwise where `sign` is negative. */
static void paint_arc(const kt_sheet *sheet, kt_spot at, double sign, kt_colour colour) {
    const double r = 2.9 * fmax(sheet->pin, 3.0), middle = 1.45 * pi, end = middle - 0.3 * pi * sign;
    const kt_spot tip = {at.x + r * cos(end), at.y + r * sin(end)};
    const kt_spot ahead = {sign * sin(end - 0.08 * sign), -sign * cos(end - 0.08 * sign)};
    cairo_t *c = sheet->c;
    cairo_new_sub_path(c);
    cairo_arc(c, at.x, at.y, r, middle - 0.3 * pi, middle + 0.3 * pi);
    kt_paper_stroke(c, colour, 1.4);
    kt_paint_arrow(sheet, kt_spot_offset(tip, ahead, -3.5, 0.0), kt_spot_offset(tip, ahead, 4.5, 0.0), 1.4, colour);
}

/* An arc around a driven joint that turns; an arrow along one that slides. In diagrams alone. */
static void paint_motor(const kt_sheet *sheet, const kt_picture_joint *joint) {
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses);
    const kt_vec3 axis = kt_camera_point(&sheet->drawing->camera, frame.rotation.z);
    const kt_spot at = kt_sheet_place(sheet, frame.position);
    const double r = 2.9 * fmax(sheet->pin, 3.0), across = hypot(axis.x, axis.y);
    const kt_colour ink = kt_sheet_faded(sheet, sheet->palette->ink);
    if (!sheet->drawing->is_diagram)
        return;
    if (joint->type == KT_JOINT_PRISMATIC && across > 0.2) {
        const kt_spot along = {axis.x / across, -axis.y / across};
        kt_paint_arrow(sheet, kt_spot_offset(at, along, -1.2 * r, 1.4 * r), kt_spot_offset(at, along, 1.2 * r, 1.4 * r),
                       1.3, ink);
    } else if (fabs(axis.z) > 0.5) {
        paint_arc(sheet, at, axis.z > 0.0 ? 1.0 : -1.0, ink);
    }
}

/* The spot at (x, y, z) of a joint's frame, in units of the page. */
static kt_spot joint_spot(const kt_sheet *sheet, const kt_picture_joint *joint, double x, double y, double z) {
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses);
    const kt_vec3 at = kt_vec3_scale(1.0 / sheet->scale, kt_vec3_make(x, y, z));
    return kt_sheet_place(sheet, kt_pose_apply(frame, at));
}

static double spiral_unit(const kt_sheet *sheet) { return 0.9 * fmax(sheet->pin, 3.0); }

/* A spiral around a joint that turns; a zigzag next to one that slides. In diagrams alone. */
static void paint_joint_spring(const kt_sheet *sheet, const kt_picture_joint *joint) {
    const double r = spiral_unit(sheet);
    const bool slides = joint->type == KT_JOINT_PRISMATIC;
    const int steps = slides ? 8 : 60;
    for (int i = 0; i <= steps; i++) {
        const double s = (double)i / steps, angle = 5.0 * pi * s, out = (1.5 + 2.0 * s) * r;
        const kt_spot at = slides ? joint_spot(sheet, joint, (i % 2 != 0 ? 2.6 : 1.8) * r, 0.0, (i - 4) * 0.8 * r)
                                  : joint_spot(sheet, joint, out * cos(angle), out * sin(angle), 0.0);
        cairo_line_to(sheet->c, at.x, at.y);
    }
    kt_paper_stroke(sheet->c, kt_sheet_faded(sheet, sheet->palette->ink), 1.1);
}

/* The direction of a joint's body at position 0: that of the first solid of the body that is not at the joint. */
static double body_lever_of(const kt_picture *p, const kt_picture_joint *joint) {
    for (int i = 0; i < p->solid_count; i++) {
        const kt_vec3 at = kt_mat3_apply(joint->child, p->solids[i].pose.position);
        if (p->solids[i].body == joint->body && hypot(at.x, at.y) > 0.0)
            return atan2(at.y, at.x);
    }
    return 0.0;
}

/* A bar across the way of a joint's body at a limit. Only in diagrams. */
static void paint_stop(const kt_sheet *sheet, const kt_picture_joint *joint, double limit) {
    const double r = fmax(sheet->pin, 3.0), z = sheet->scale * limit;
    const double angle = body_lever_of(sheet->drawing->picture, joint) + limit;
    const kt_colour ink = kt_sheet_faded(sheet, sheet->palette->ink);
    if (!isfinite(limit))
        return;
    if (joint->type == KT_JOINT_PRISMATIC)
        kt_paint_line(sheet, joint_spot(sheet, joint, -2.5 * r, 0.0, z), joint_spot(sheet, joint, 2.5 * r, 0.0, z), 1.8,
                      ink);
    else
        kt_paint_line(sheet, joint_spot(sheet, joint, 2.0 * r * cos(angle), 2.0 * r * sin(angle), 0.0),
                      joint_spot(sheet, joint, 5.5 * r * cos(angle), 5.5 * r * sin(angle), 0.0), 1.8, ink);
}

static void paint_in_joint(const kt_sheet *sheet, const kt_picture_effect *effect) {
    const kt_picture_joint *joint = &sheet->drawing->picture->joints[effect->joint];
    if (effect->type == KT_EFFECT_MOTOR || effect->type == KT_EFFECT_SERVO) {
        paint_motor(sheet, joint);
    } else if (sheet->drawing->is_diagram && effect->type == KT_EFFECT_JOINT_SPRING) {
        paint_joint_spring(sheet, joint);
    } else if (sheet->drawing->is_diagram && effect->type == KT_EFFECT_JOINT_LIMIT) {
        paint_stop(sheet, joint, effect->lower);
        paint_stop(sheet, joint, effect->upper);
    }
}

/* A prescribed motion as a motor; a coupling as a dashed line between its joints. In diagrams alone. */
void kt_paint_relations(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    for (int i = 0; i < p->relation_count && sheet->drawing->is_diagram; i++) {
        const kt_picture_relation *relation = &p->relations[i];
        const kt_picture_joint *joint = &p->joints[relation->joint];
        if (relation->other < 0)
            paint_motor(sheet, joint);
        else
            kt_paint_dashes(sheet, kt_sheet_frame(sheet, &joint->frame),
                            kt_sheet_frame(sheet, &p->joints[relation->other].frame),
                            kt_sheet_faded(sheet, sheet->palette->quiet), 1.0);
    }
}

/* Paints a force as an arrow whose head is at its point, unless it points at the viewer. Paints a torque as an arc, if
 * its axis is more than 30 degrees out of the page. */
static void paint_load(const kt_sheet *sheet, const kt_picture_effect *effect) {
    const kt_pose frame = kt_body_frame_pose(&effect->ends[0], sheet->poses);
    const kt_vec3 world = effect->is_carried ? kt_mat3_apply(frame.rotation, effect->direction) : effect->direction;
    const kt_vec3 d = kt_camera_point(&sheet->drawing->camera, world);
    const kt_spot at = kt_sheet_place(sheet, frame.position);
    const kt_colour colour = kt_sheet_faded(sheet, sheet->palette->series[1]);
    if (effect->type != KT_EFFECT_TORQUE && hypot(d.x, d.y) > 0.2)
        kt_paint_arrow(sheet, (kt_spot){at.x - 46.0 * d.x, at.y + 46.0 * d.y}, at, 2.0, colour);
    else if (effect->type == KT_EFFECT_TORQUE && fabs(d.z) > 0.5)
        paint_arc(sheet, at, d.z > 0.0 ? 1.0 : -1.0, colour);
}

static void paint_path_line(void *user, kt_vec3 from, kt_vec3 to) {
    const kt_sheet *sheet = user;
    kt_paint_line(sheet, kt_sheet_place(sheet, from), kt_sheet_place(sheet, to), 1.4,
                  kt_sheet_faded(sheet, sheet->palette->ink));
}

void kt_paint_effects(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    const bool has_spirals = !kt_sheet_is_crowded(sheet, 3.5 * spiral_unit(sheet), 8);
    for (int i = 0; i < p->effect_count; i++) {
        const kt_picture_effect *effect = &p->effects[i];
        if (effect->type == KT_EFFECT_JOINT_SPRING && !has_spirals)
            continue;
        kt_picture_path(p, effect, sheet->poses, paint_path_line, (void *)sheet);
        if (effect->type == KT_EFFECT_SPRING || effect->type == KT_EFFECT_ATTRACTION)
            paint_link(sheet, effect);
        else if (effect->type == KT_EFFECT_FORCE || effect->type == KT_EFFECT_TORQUE ||
                 effect->type == KT_EFFECT_THRUST)
            paint_load(sheet, effect);
        else if (effect->type == KT_EFFECT_BUSHING && sheet->drawing->is_diagram)
            paint_bushing(sheet, kt_sheet_frame(sheet, &effect->ends[0]));
        else if (effect->joint >= 0)
            paint_in_joint(sheet, effect);
    }
}
