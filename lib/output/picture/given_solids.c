/* The solids that a scene gives: shapes, meshes, or boxes of the same inertia. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/principal.h"
#include "picture/load.h"
#include "picture/maker.h"
#include "picture/solid.h"

#include <math.h>
#include <stdio.h>

bool kt_picture_has_own(const kt_picture_maker *m, int body) {
    const kt_picture *p = m->picture;
    int i = m->first[p->part[body]];
    while (i >= 0 && p->solids[i].body != body)
        i = m->next[i];
    return i >= 0;
}

void kt_picture_add_solid(kt_picture_maker *m, kt_solid solid) {
    kt_picture *p = m->picture;
    m->next[p->solid_count] = m->first[p->part[solid.body]];
    m->first[p->part[solid.body]] = p->solid_count;
    p->solids[p->solid_count++] = solid;
}

/* A shape may be a solid, or edges that are drawn as solids. */
static void add_shape(kt_picture_maker *m, int body, const kt_shape *shape) {
    kt_solid solid = {.body = body};
    if (kt_solid_of_shape(shape, &solid))
        kt_picture_add_solid(m, solid);
    for (size_t k = 0; k < kt_solid_edge_count(shape); k++) {
        solid = kt_solid_edge(shape, k);
        solid.body = body;
        kt_picture_add_solid(m, solid);
    }
}

void kt_picture_list_shapes(kt_picture_maker *m) {
    for (int body = 1; body < m->picture->body_count; body++) {
        add_shape(m, body, &kt_picture_source(m, body)->shape);
        for (int i = 0; i < kt_picture_source(m, body)->shape_count; i++)
            add_shape(m, body, &kt_picture_source(m, body)->shapes[i]);
    }
}

/* The meshes that can be read; each has its part of the triangles. */
kt_status kt_picture_list_meshes(kt_picture_maker *m, kt_error *error) {
    kt_picture *p = m->picture;
    const int count = m->scene->mesh_count, all = m->options->triangles > 0 ? m->options->triangles : 400000;
    for (int i = 0; i < count; i++) {
        kt_error reason = {0};
        kt_solid solid = {.body = kt_body_find(m->model, m->scene->meshes[i].body)};
        if (solid.body < 0)
            continue;
        const kt_status status =
            kt_mesh_load(&m->scene->meshes[i], all / count, &p->meshes[p->mesh_count], &solid, &reason);
        if (status == KT_ERROR_MEMORY)
            return kt_error_set(error, status, "picture", "%s", reason.message);
        if (status != KT_OK) {
            if (p->lost_meshes++ == 0)
                (void)snprintf(p->lost_reason, sizeof p->lost_reason, "%s: %s", reason.where, reason.message);
            continue;
        }
        solid.mesh = &p->meshes[p->mesh_count++];
        kt_picture_add_solid(m, solid);
    }
    return KT_OK;
}

/* The half edges a, b, c of a box of mass m follow from its principal moments of inertia:
 *
 *     I_x = m (b^2 + c^2) / 3,    a^2 = 3/2 (I_y + I_z - I_x) / m
 */
void kt_picture_list_boxes(kt_picture_maker *m) {
    for (int body = 1; body < m->picture->body_count; body++) {
        const kt_body *source = kt_picture_source(m, body);
        kt_solid solid = {.type = KT_SOLID_BOX, .source = KT_SOURCE_INERTIA, .body = body};
        kt_sym3 inertia;
        if (!(source->mass > 0.0) || kt_body_inertia(source, &solid.pose.position, &inertia, NULL) != KT_OK)
            continue;
        solid.pose.rotation = kt_principal_axes(inertia);
        const kt_sym3 d = kt_sym3_rotate(kt_mat3_transpose(solid.pose.rotation), inertia);
        const double k = 1.5 / source->mass;
        solid.half = kt_vec3_make(sqrt(fmax(k * (d.yy + d.zz - d.xx), 0.0)), sqrt(fmax(k * (d.zz + d.xx - d.yy), 0.0)),
                                  sqrt(fmax(k * (d.xx + d.yy - d.zz), 0.0)));
        kt_picture_add_solid(m, solid);
    }
}

/* Slender rods and points, whose radius follows from the size. */
void kt_picture_thicken(kt_picture_maker *m) {
    kt_picture *p = m->picture;
    for (int i = 0; i < p->solid_count; i++)
        if (p->solids[i].source == KT_SOURCE_SLENDER) {
            const double radius = p->solids[i].type == KT_SOLID_SPHERE ? 2.4 * p->radius : p->radius;
            p->solids[i].half.x = p->solids[i].half.y = radius;
            if (p->solids[i].type == KT_SOLID_SPHERE)
                p->solids[i].half.z = radius;
        } else if (p->solids[i].source == KT_SOURCE_INERTIA) { /* inertias of points and rods */
            const kt_vec3 half = p->solids[i].half;
            const double least = 0.5 * p->radius;
            p->solids[i].half = kt_vec3_make(fmax(half.x, least), fmax(half.y, least), fmax(half.z, least));
        }
}
