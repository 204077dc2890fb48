/* Where the ground holds a joint or the end of a loop: below the fixed part that carries it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"
#include "picture/solid.h"

/* The solid of a body with its middle farthest along a direction, among the given ones; -1: the body has none. Implied
 * rods and balls are left out. */
static int outermost_solid(const kt_sheet *sheet, int body, kt_vec3 direction) {
    const kt_picture *p = sheet->drawing->picture;
    int found = -1;
    double most = 0.0;
    for (int i = 0; i < p->solid_count; i++) {
        const kt_pose pose = kt_pose_compose(sheet->poses[body], p->solids[i].pose);
        const double far = kt_vec3_dot(pose.position, direction);
        if (p->solids[i].body != body || p->solids[i].source == KT_SOURCE_IMPLIED || (found >= 0 && far <= most))
            continue;
        found = i;
        most = far;
    }
    return found;
}

static bool has_implied_solid(const kt_picture *p, int body) {
    bool found = false;
    for (int i = 0; i < p->solid_count; i++)
        found = found || (p->solids[i].body == body && p->solids[i].source == KT_SOURCE_IMPLIED);
    return found;
}

/* The outer end of a solid along a direction, on the line through its middle. */
static kt_vec3 solid_end(const kt_sheet *sheet, int solid, kt_vec3 direction) {
    const kt_solid *s = &sheet->drawing->picture->solids[solid];
    const kt_pose pose = kt_pose_compose(sheet->poses[s->body], s->pose);
    const double reach = kt_solid_reach(s, kt_mat3_apply_transposed(pose.rotation, direction));
    return kt_vec3_add(pose.position, kt_vec3_scale(reach, direction));
}

kt_mount kt_mount_of(const kt_sheet *sheet, const kt_body_frame *frame) {
    const kt_picture *p = sheet->drawing->picture;
    const bool is_diagram = sheet->drawing->is_diagram; /* whose page may be level */
    const kt_vec3 up = is_diagram ? sheet->drawing->camera.axes.y : kt_picture_vertical(p);
    const kt_vec3 joint = kt_body_frame_pose(frame, sheet->poses).position;
    kt_mount mount = {.place = joint};
    for (int body = frame->body; body > 0; body = kt_body_parent(p->model, body)) {
        const kt_vec3 down = kt_vec3_scale(-1.0, up);
        const int lowest = outermost_solid(sheet, body, down);
        if (lowest < 0 && !has_implied_solid(p, body))
            continue;
        const kt_vec3 origin = sheet->poses[body].position;
        const kt_pose middle =
            lowest >= 0 ? kt_pose_compose(sheet->poses[body], p->solids[lowest].pose) : (kt_pose){.position = origin};
        mount.is_of_part = true;
        mount.is_above = kt_vec3_dot(kt_vec3_sub(joint, middle.position), up) < -1e-6 * p->size;
        mount.place = origin;
        if (lowest >= 0) {
            const kt_vec3 away = mount.is_above ? up : down;
            mount.place = solid_end(sheet, outermost_solid(sheet, body, away), away);
        }
    }
    return mount;
}

enum { MOUNT_STATES = 24 };

int kt_mount_states(const kt_drawing *d) {
    return d->rest != NULL ? 1 : d->state_count < MOUNT_STATES ? d->state_count : MOUNT_STATES;
}

const kt_pose *kt_mount_state(const kt_drawing *d, int k) {
    const int count = kt_mount_states(d), state = count > 1 ? (d->state_count - 1) * k / (count - 1) : 0;
    return d->rest != NULL ? d->rest : d->poses + (ptrdiff_t)state * d->picture->body_count;
}
