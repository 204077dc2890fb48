/* The rows of a loop in a plane (model/planar_loop.h), from the parts that its type consists of (loop.h).
 *
 * The ends are given in the plane's basis, with its normal n last. With e_k the axes of end 1 and f_k those of end 2:
 *
 *   x, y, z            phi = e_k . d: the part of e_k in the plane, and e_k . n times the height
 *
 *   rotation about k   phi = e_k . p, p = 4 tan(theta / 4) n: a rotation with the factor e_k . n.
 *                      The row requires that n has the same components in both ends.
 *
 *   tilt about k       like a rotation, where theta is the angle from e_z to f_z. Both axes lie in the plane. The row
 *                      is void if both are n in the same sense.
 *
 *   normal             if both e_z and f_z lie in the plane; void if one is n and the other lies in the plane
 *
 *   spatial            always
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/loop.h"

static kt_vec3 end_axis_of(const kt_pose *end, int k) {
    return k == 0 ? end->rotation.x : k == 1 ? end->rotation.y : end->rotation.z;
}

static double length_in_plane(kt_vec3 u) { return sqrt(u.x * u.x + u.y * u.y); }

/* A loop whose planar form is being computed. */
typedef struct sheet {
    const kt_pose *end;
    double direction, length; /* bounds below which a number counts as zero */
    kt_planar_loop *flat;
} sheet;

static void set_planar_angle(const sheet *s, double cosine, double sine) {
    const double norm = sqrt(cosine * cosine + sine * sine);
    s->flat->c = cosine / norm;
    s->flat->s = sine / norm;
}

/* The row of a distance along axis k of the first end. Returns false if the plane cannot satisfy the row. */
static bool lay_along(const sheet *s, int k, kt_planar_row *row) {
    const kt_vec3 e = end_axis_of(&s->end[0], k);
    const double height = e.z * s->flat->height;
    const bool in_plane = fabs(height) <= s->length;
    if (length_in_plane(e) <= s->direction)
        return in_plane;
    row->kind = KT_PLANAR_ROW_ALONG;
    row->e[0] = e.x;
    row->e[1] = e.y;
    row->constant = in_plane ? 0.0 : height;
    return true;
}

static void lay_turn(const sheet *s, int k, kt_planar_row *row) {
    row->constant = end_axis_of(&s->end[0], k).z;
    if (fabs(row->constant) > s->direction)
        row->kind = KT_PLANAR_ROW_ROTATION;
}

/* Returns 1 if both ends' axes z are n, 2 if they lie in the plane, and 0 otherwise. */
static int lie_of_axes(const sheet *s) {
    const kt_vec3 e = s->end[0].rotation.z, f = s->end[1].rotation.z;
    if (length_in_plane(e) <= s->direction && length_in_plane(f) <= s->direction)
        return 1;
    return fabs(e.z) <= s->direction && fabs(f.z) <= s->direction ? 2 : 0;
}

static void set_angle_of_axes(const sheet *s) {
    const kt_vec3 e = s->end[0].rotation.z, f = s->end[1].rotation.z;
    set_planar_angle(s, e.x * f.x + e.y * f.y, e.x * f.y - e.y * f.x);
}

/* The row of a tilt about x or y: an angle in the plane if the axes lie in it. If they are normal to the plane, no
 * row is needed. */
static bool lay_tilt(const sheet *s, int k, kt_planar_row *row) {
    const int lie = lie_of_axes(s);
    if (lie == 1)
        return s->end[0].rotation.z.z * s->end[1].rotation.z.z > 0.0;
    if (lie == 0)
        return false;
    set_angle_of_axes(s);
    lay_turn(s, k, row);
    return true;
}

/* The row of a rotation about axis k, if the ends differ by a rotation about the normal: R2 = R_n(theta) R1.
 * Otherwise returns false. */
static bool lay_parallel(const sheet *s, int k, kt_planar_row *row) {
    double cosine = 0.0, sine = 0.0;
    for (int i = 0; i < 3; i++) {
        const kt_vec3 e = end_axis_of(&s->end[0], i), f = end_axis_of(&s->end[1], i);
        if (fabs(e.z - f.z) > s->direction)
            return false;
        cosine += e.x * f.x + e.y * f.y;
        sine += e.x * f.y - e.y * f.x;
    }
    set_planar_angle(s, cosine, sine);
    lay_turn(s, k, row);
    return true;
}

/* The row that keeps the normals of both ends at right angles. Returns whether a row in the plane can replace the
 * row. */
static bool lay_normal(const sheet *s, kt_planar_row *row) {
    const kt_vec3 e = s->end[0].rotation.z, f = s->end[1].rotation.z;
    if (lie_of_axes(s) != 2)
        return (length_in_plane(e) <= s->direction && fabs(f.z) <= s->direction) ||
               (length_in_plane(f) <= s->direction && fabs(e.z) <= s->direction);
    set_angle_of_axes(s);
    row->kind = KT_PLANAR_ROW_ORTHOGONAL;
    return true;
}

/* The row of a distance between two points. Where the points coincide, the row is taken along e. */
static void lay_distance(const sheet *s, kt_planar_row *row) {
    const kt_vec3 x = s->end[0].rotation.x, y = s->end[0].rotation.y;
    const kt_vec3 e =
        length_in_plane(x) >= 0.5 ? x : y; /* of two axes at right angles one reaches so far into the plane */
    row->kind = KT_PLANAR_ROW_DISTANCE;
    row->e[0] = e.x / length_in_plane(e);
    row->e[1] = e.y / length_in_plane(e);
}

/* Lays one part of a loop into the plane. Returns false if the part has no counterpart there. */
static bool lay_part(const sheet *s, kt_loop_part part, kt_planar_row *row) {
    switch (part) {
    case KT_PART_X:
    case KT_PART_Y:
    case KT_PART_Z:
        return lay_along(s, (int)part - KT_PART_X, row);
    case KT_PART_ROTATION_X:
    case KT_PART_ROTATION_Y:
    case KT_PART_ROTATION_Z:
        return lay_parallel(s, (int)part - KT_PART_ROTATION_X, row);
    case KT_PART_TILT_X:
    case KT_PART_TILT_Y:
        return lay_tilt(s, (int)part - KT_PART_TILT_X, row);
    case KT_PART_NORMAL:
        return lay_normal(s, row);
    case KT_PART_DISTANCE:
        lay_distance(s, row);
        return true;
    case KT_PART_SPATIAL:
        row->kind = KT_PLANAR_ROW_SPATIAL;
        return true;
    case KT_PART_NONE:
        break;
    }
    return false;
}

bool kt_loop_planar_rows(const kt_loop *loop, const kt_pose end[2], double direction, double length,
                         kt_planar_loop *flat) {
    const kt_loop_kind *kind = kt_loop_kinds_baseline[kt_loop_kind_index(loop->type)];
    const int count = kt_loop_equation_count(loop);
    const sheet s = {.end = end, .direction = direction, .length = length, .flat = flat};
    kt_planar_row rows[KT_PLANAR_ROW_MAX];
    flat->c = 1.0;
    flat->s = 0.0;
    flat->placed = 0;
    flat->height = end[1].position.z - end[0].position.z;
    flat->count = flat->vanishing_count = 0;
    for (int r = 0; r < count; r++) {
        rows[r] = (kt_planar_row){.kind = KT_PLANAR_ROW_VOID, .row = r};
        if (!lay_part(&s, (kt_loop_part)kind->part[r], &rows[r]))
            return false;
        if (rows[r].kind != KT_PLANAR_ROW_VOID)
            flat->row[flat->count++] = rows[r];
    }
    for (int r = 0; r < count; r++)
        if (rows[r].kind == KT_PLANAR_ROW_VOID)
            flat->row[flat->count + flat->vanishing_count++] = rows[r];
    return true;
}
