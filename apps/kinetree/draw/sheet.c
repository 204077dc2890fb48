/* From the world to the page, and the colours of bodies. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"

#include <math.h>

static const kt_colour white = {1.0, 1.0, 1.0}, black = {0.0, 0.0, 0.0};

kt_spot kt_sheet_spot(const kt_sheet *sheet, kt_vec3 point) {
    return (kt_spot){sheet->x + sheet->scale * point.x, sheet->y - sheet->scale * point.y};
}

kt_spot kt_sheet_place(const kt_sheet *sheet, kt_vec3 point) {
    return kt_sheet_spot(sheet, kt_camera_point(&sheet->drawing->camera, point));
}

bool kt_sheet_is_crowded(const kt_sheet *sheet, double radius, int least) {
    const kt_picture *p = sheet->drawing->picture;
    kt_spot last = {0};
    int near = 0;
    for (int i = 0; i < p->joint_count; i++) {
        const kt_spot at = kt_sheet_place(sheet, kt_body_frame_pose(&p->joints[i].frame, sheet->poses).position);
        near += i > 0 && hypot(at.x - last.x, at.y - last.y) < 2.0 * radius;
        last = at;
    }
    return p->joint_count > least && 2 * near > p->joint_count;
}

bool kt_sheet_is_plain(const kt_sheet *sheet) { return sheet->drawing->is_plain && sheet->fade > 0.0; }

kt_colour kt_sheet_edge(const kt_sheet *sheet, kt_colour fill) {
    const kt_colour edge = kt_colour_mix(fill, black, sheet->drawing->is_dark ? 0.72 : 0.55);
    return kt_colour_mix(edge, sheet->palette->paper, 0.85 * sheet->fade);
}

kt_colour kt_sheet_colour(const kt_sheet *sheet, int body) {
    const int series = sheet->is_grey ? -1 : sheet->drawing->picture->colour[body];
    const kt_colour own = series < 0 ? sheet->palette->quiet : sheet->palette->series[series];
    const kt_colour soft = kt_colour_mix(own, white, sheet->drawing->is_dark ? 0.05 : series < 0 ? 0.45 : 0.22);
    return kt_colour_mix(soft, sheet->palette->paper, 0.85 * sheet->fade);
}

kt_spot kt_sheet_frame(const kt_sheet *sheet, const kt_body_frame *frame) {
    return kt_sheet_place(sheet, kt_body_frame_pose(frame, sheet->poses).position);
}

bool kt_sheet_is_ground(const kt_sheet *sheet, int body) { return sheet->drawing->picture->part[body] == 0; }

kt_colour kt_sheet_faded(const kt_sheet *sheet, kt_colour colour) {
    return kt_colour_mix(colour, sheet->palette->paper, 0.85 * sheet->fade);
}
