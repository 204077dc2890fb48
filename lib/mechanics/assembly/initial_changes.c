/* The changes that an assembly made to the initial values that the description gives.
 *
 * A change is relative to its scale. The scale of an angle is a radian, and that of a length is the length of the
 * longest loop. The scale of a velocity is the fastest velocity of the mechanism, before or after, in the same units.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/closure.h"
#include "model/model.h"

#include <math.h>

/* The unit of the k-th velocity coordinate of a link. */
static double coordinate_unit_of(const kt_model *model, const kt_link *link, int k) {
    return k < kt_link_lengths(link) && model->length > 0.0 ? model->length : 1.0;
}

/* The largest speed, given or initial, in units of the coordinates (rad/s, or the mechanism's length per second). */
static double fastest(const kt_model *model, const double *v) {
    double most = 0.0;
    for (size_t i = 1; i < model->n.link; i++)
        for (int k = 0; k < kt_link_dofs(&model->link[i]); k++) {
            const int32_t at = model->link[i].v + k;
            most = fmax(most, fmax(fabs(v[at]), fabs(model->v0[at])) / coordinate_unit_of(model, &model->link[i], k));
        }
    return most;
}

/* The angle between two quaternions of unit norm. */
static double angle_between(const double *a, const double *b) {
    const kt_quat from = kt_quat_make(a[0], a[1], a[2], a[3]), to = kt_quat_make(b[0], b[1], b[2], b[3]);
    const kt_quat turn = kt_quat_multiply(kt_quat_conjugate(from), to);
    return 2.0 * atan2(sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z), fabs(turn.w));
}

/* The changes of one joint, part by part: positions, orientation, velocities, angular velocity. */
typedef struct parts {
    kt_initial_change part[4];
} parts;

static void update_largest_change(kt_initial_change *part, double change, double unit) {
    if (!(fabs(change) / unit > part->relative))
        return;
    part->change = fabs(change);
    part->relative = fabs(change) / unit;
}

/* Adds the changes of the given coordinates of one link to those of its joint. A quaternion counts as one angle. */
static void add_link_changes(const kt_model *model, const kt_link *link, const double *q, const double *v, double speed,
                             parts *p) {
    const int plain = kt_motion_facts_of(link->motion).plain;
    for (int k = 0; k < kt_link_dofs(link); k++) {
        const double unit = coordinate_unit_of(model, link, k);
        const bool angular = plain > 0 && k >= plain;
        const uint8_t given = model->given[link->v + k];
        if (k < plain && (given & KT_POSITION_GIVEN))
            update_largest_change(&p->part[0], q[link->q + k] - model->q0[link->q + k], unit);
        if (k == plain && (given & KT_POSITION_GIVEN))
            update_largest_change(&p->part[1], angle_between(model->q0 + link->q + plain, q + link->q + plain), 1.0);
        if (given & KT_VELOCITY_GIVEN)
            update_largest_change(&p->part[angular ? 3 : 2], v[link->v + k] - model->v0[link->v + k], unit * speed);
    }
}

/* Whether given velocities and loops leave velocities of a group undetermined. */
static bool has_choice(const kt_model *model, const kt_group *group) {
    int given = 0;
    for (int i = 0; i < group->v_count; i++)
        given += (model->given[model->group_v[group->v + i]] & KT_VELOCITY_GIVEN) != 0;
    return given > 0 && group->v_count - group->rank[KT_ROWS_ALL] > given;
}

int kt_initial_choices(const kt_model *model, const double *v, kt_initial_change *changes, int most) {
    if (!model || !v || most < 0 || (!changes && most > 0))
        return 0;
    const double speed = fastest(model, v);
    int count = 0;
    for (int body = 1; body < (int)model->n.body; body++) {
        kt_initial_change part = {.body = body, .part = KT_GIVEN_VELOCITY};
        for (int32_t i = model->body[body].link; i > 0 && model->link[i].body == body; i = model->link[i].parent) {
            const kt_link *link = &model->link[i];
            const bool chosen = link->group >= 0 && has_choice(model, &model->group[link->group]);
            for (int k = 0; k < kt_link_dofs(link) && chosen; k++)
                if (!(model->given[link->v + k] & KT_VELOCITY_GIVEN))
                    update_largest_change(&part, v[link->v + k], coordinate_unit_of(model, link, k) * speed);
        }
        if (!(part.relative > KT_INITIAL_CHANGE_LEAST))
            continue;
        if (count < most)
            changes[count] = part;
        count++;
    }
    return count;
}

int kt_initial_changes(const kt_model *model, const double *q, const double *v, kt_initial_change *changes, int most) {
    if (!model || !q || !v || most < 0 || (!changes && most > 0))
        return 0;
    static const unsigned bit[4] = {KT_GIVEN_POSITION, KT_GIVEN_ORIENTATION, KT_GIVEN_VELOCITY, KT_GIVEN_ANGULAR};
    const double speed = fastest(model, v);
    int count = 0;
    for (int body = 1; body < (int)model->n.body; body++) {
        parts p = {.part = {{.part = 0}}};
        const int32_t last = model->body[body].link;
        for (int32_t i = last; i > 0 && model->link[i].body == body; i = model->link[i].parent)
            add_link_changes(model, &model->link[i], q, v, speed, &p);
        for (int k = 0; k < 4; k++) {
            if (!(p.part[k].relative > KT_INITIAL_CHANGE_LEAST))
                continue;
            if (count < most) {
                changes[count] = p.part[k];
                changes[count].body = body;
                changes[count].part = bit[k];
            }
            count++;
        }
    }
    return count;
}
