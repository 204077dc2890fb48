/* Forces of a medium on the bodies of a model in MJCF, as drag along the axes of their inertia.
 *
 * MuJoCo replaces a body by the box of its mass m and its principal moments I_i. With the sizes
 *     b_i = sqrt(6 (I_j + I_k - I_i) / m)
 * and d = (b_1 + b_2 + b_3) / 3, a medium of the density rho and the viscosity mu has the coefficients of drag
 *     linear:     3 pi d mu            along, and   pi d^3 mu                     about each axis,
 *     quadratic:  rho b_j b_k / 2      along, and   rho b_i (b_j^4 + b_k^4) / 64  about the axis i.
 * The force acts at the centre of mass. Source: MuJoCo's documentation, Computation, "Inertia model" of fluid forces.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_axes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static bool has_medium(const kt_mjcf *m) { return m->density > 0.0 || m->viscosity > 0.0; }

/* ---- the frames of the inertias ---------------------------------------------------------------------------------- */

static void find_ellipsoid(kt_mjcf *m, const kt_element *geom, int body, kt_pose frame) {
    (void)frame;
    if (kt_text_is(kt_mjcf_text(m, geom, "geom", "fluidshape"), "ellipsoid"))
        kt_mjcf_body_at(m, body)->has_ellipsoids = true;
}

/* A marker's name that no site of the body has. */
static const char *name_marker(kt_mjcf *m, const kt_mjcf_body *b) {
    char name[24] = "medium";
    for (int number = 2, i = 0; i < b->markers.count; i++)
        if (strcmp(((const kt_marker *)b->markers.items)[i].name, name) == 0) {
            (void)snprintf(name, sizeof name, "medium_%d", number++);
            i = -1;
        }
    return kt_reader_text(m->r, &m->r->keep, name, strlen(name));
}

/* Adds a marker at the centre of mass, along the axes of the inertia. */
static void place_marker(kt_mjcf *m, kt_mjcf_body *b) {
    const kt_mat3 axes = kt_mjcf_axes_of_body(b);
    const char *name = name_marker(m, b);
    kt_marker *marker = kt_list_add(m->r, &m->r->keep, &b->markers, sizeof *marker);
    if (name == NULL || marker == NULL)
        return;
    *marker = (kt_marker){.name = name, .at = b->com, .rotation = kt_rotation_of_matrix(axes)};
    b->medium = name;
    b->medium_axes = axes;
    if (m->density > 0.0 && kt_mjcf_has_doubtful_axes(b))
        kt_unknown_count(
            &m->changes,
            "drag of a medium on a body with a mesh and equal moments of inertia, whose axes may be others",
            b->element);
}

void kt_mjcf_place_media(kt_mjcf *m) {
    for (int i = 1; i < m->bodies.count && has_medium(m); i++) {
        kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        kt_mjcf_for_each(m, b->element, "geom", i, find_ellipsoid);
        if (b->has_ellipsoids)
            kt_left_count(&m->notes.fluid, b->element);
        else if (b->mass > 0.0)
            place_marker(m, b);
    }
}

/* ---- drag -------------------------------------------------------------------------------------------------------- */

/* b: the sizes of the box (top of the file). */
static void set_coefficients(const kt_mjcf *m, const double b[3], kt_effect *drag) {
    const double pi = 3.14159265358979323846, d = (b[0] + b[1] + b[2]) / 3.0;
    for (int i = 0; i < 3; i++) {
        const double j = b[(i + 1) % 3], k = b[(i + 2) % 3];
        drag->dampings[i] = 3.0 * pi * d * m->viscosity;
        drag->dampings[3 + i] = pi * d * d * d * m->viscosity;
        drag->quadratics[i] = 0.5 * m->density * j * k;
        drag->quadratics[3 + i] = m->density * b[i] * (j * j * j * j + k * k * k * k) / 64.0;
    }
}

/* sizes: b_i = sqrt(6 (I_j + I_k - I_i) / m), of the box with the mass and the moments of inertia of the body. */
void kt_mjcf_resist(kt_mjcf *m, const kt_mjcf_body *b) {
    double moments[3], sizes[3];
    kt_effect *drag = b->medium != NULL ? kt_draft_effect(&m->draft, b->element, KT_EFFECT_DRAG) : NULL;
    if (drag == NULL)
        return;
    kt_moments_about(b->inertia, b->medium_axes, moments);
    for (int i = 0; i < 3; i++) {
        const double twice = moments[(i + 1) % 3] + moments[(i + 2) % 3] - moments[i];
        sizes[i] = sqrt(6.0 * fmax(1e-15, twice) / b->mass);
    }
    drag->between[0].body = b->name;
    drag->between[0].marker = b->medium;
    set_coefficients(m, sizes, drag);
}
