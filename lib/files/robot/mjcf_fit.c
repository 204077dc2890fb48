/* Solids of MJCF that are fitted to a mesh: geoms with a mesh whose type is a sphere, capsule, ellipsoid, cylinder or
 * box.
 *
 * The solid has the axes of the mesh's inertia, with the largest moment first. By default its sizes are those of the
 * box of equal inertia. With the moments I_k of the mesh at density 1 and its volume V, the half sides are
 *     h_k = sqrt(6 (I_0 + I_1 + I_2 - 2 I_k) / V) / 2.
 * With `fitaabb` they are those of the box around all vertices, whose centre is that of the solid. All sizes are
 * multiplied by `fitscale`. The numbers for round solids are those of MuJoCo. Source: FitGeom in user_mesh.cc. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_mesh.h"

#include <math.h>

static void set_half_sides(const kt_mjcf_mesh *mesh, double half[3]) {
    const kt_sym3 d = kt_sym3_rotate(kt_mat3_transpose(mesh->axes), mesh->enclosed.inertia);
    const double moments[3] = {d.xx, d.yy, d.zz}, sum = d.xx + d.yy + d.zz;
    for (int k = 0; k < 3; k++)
        half[k] = 0.5 * sqrt(fmax(6.0 * (sum - 2.0 * moments[k]) / mesh->enclosed.volume, 0.0));
}

/* A solid of the inertia of the box. */
static void fit_inertia(kt_solid solid, const double h[3], double size[3]) {
    const double radius = solid == KT_SOLID_SPHERE ? (h[0] + h[1] + h[2]) / 3.0 : 0.5 * (h[0] + h[1]);
    const double length = solid == KT_SOLID_CAPSULE ? h[2] - 0.5 * radius : h[2];
    const bool is_round = solid != KT_SOLID_BOX && solid != KT_SOLID_ELLIPSOID;
    size[0] = is_round ? radius : h[0];
    size[1] = is_round ? fmax(length, 0.0) : h[1];
    size[2] = h[2];
}

/* The least solid whose own box contains the box. */
static void fit_box(kt_solid solid, const double h[3], double size[3]) {
    const double radius = solid == KT_SOLID_SPHERE ? fmax(fmax(h[0], h[1]), h[2]) : fmax(h[0], h[1]);
    const bool is_round = solid != KT_SOLID_BOX && solid != KT_SOLID_ELLIPSOID;
    size[0] = is_round ? radius : h[0];
    size[1] = is_round ? h[2] - (solid == KT_SOLID_CAPSULE ? radius : 0.0) : h[1];
    size[2] = h[2];
}

bool kt_mjcf_fit(kt_mjcf *m, const kt_element *geom, kt_solid solid, double size[3], kt_pose *pose) {
    const double scale = kt_mjcf_number(m, geom, "geom", "fitscale", 1.0);
    double half[3], centre[3] = {0.0, 0.0, 0.0};
    if (solid == KT_SOLID_NONE)
        return kt_mjcf_fault(m, geom, "no plane and no field of heights can be fitted to a mesh");
    if (kt_mjcf_text(m, geom, "geom", "fromto") != NULL)
        return kt_mjcf_fault(m, geom, "fromto is not possible in a geom with a mesh");
    const kt_mjcf_mesh *mesh = kt_mjcf_find_mesh(m, geom);
    if (mesh == NULL)
        return false;
    const bool is_box = kt_mjcf_settings_of(m, geom)->fits_boxes;
    set_half_sides(mesh, half);
    for (int k = 0; k < 3 && is_box; k++) {
        centre[k] = 0.5 * (mesh->box[0][k] + mesh->box[1][k]);
        half[k] = mesh->box[1][k] - centre[k];
    }
    (is_box ? fit_box : fit_inertia)(solid, half, size);
    for (int k = 0; k < 3; k++)
        size[k] *= scale;
    if (!(size[0] > 0.0 && size[2] > 0.0) || (solid != KT_SOLID_SPHERE && !(size[1] > 0.0)))
        return kt_mjcf_fault(m, geom, "the solid that is fitted to the mesh has no extent along an axis");
    pose->rotation = mesh->axes;
    pose->position =
        kt_vec3_add(mesh->enclosed.com, kt_mat3_apply(mesh->axes, kt_vec3_make(centre[0], centre[1], centre[2])));
    return true;
}
