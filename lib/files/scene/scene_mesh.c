/* Surfaces in files, which pictures show as parts of bodies.
 *
 *     meshes:
 *       - {body: arm, file: meshes/arm.stl, scale: [1e-3, 1e-3, 1e-3],
 *          at: [0, 0, 0.1], rotation: {rpy: [0, 0, 90 deg]}}
 *       - {body: lid, file: meshes/lid.stl, density: 2700}
 *
 * Reading a scene does not open the files of pictures. A missing file is no fault, but the program that draws the scene
 * reports it. Files with a density are opened: the solids that the meshes of a body enclose are its mass, centre of
 * mass and inertia. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/csv.h"
#include "scene/scene_part.h"
#include "scene/shapes.h"
#include "scene/vary.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define AT(member) .offset = offsetof(kt_scene_mesh, member)
static const kt_field fields[] = {
    {.key = "body", .kind = &kt_kind_name, AT(body), .flags = KT_FIELD_REQUIRED},
    {.key = "file", .kind = &kt_kind_text, AT(file), .flags = KT_FIELD_REQUIRED},
    {.key = "scale", .kind = &kt_kind_vector, AT(scale)},
    {.key = "at", .kind = &kt_kind_vector, AT(at)},
    {.key = "rotation", .kind = &kt_kind_rotation, AT(rotation)},
    {.key = "density", .kind = &kt_kind_number, AT(density)},
};
static const kt_table table = {.fields = fields, .count = KT_COUNT_OF(fields), .flow = true};

static kt_scene_mesh standard_mesh(void) {
    return (kt_scene_mesh){.scale = kt_vec3_make(1.0, 1.0, 1.0), .rotation = {.type = KT_ROTATION_NONE}};
}

/* ---- masses ------------------------------------------------------------------------------------------------------ */

void kt_body_add_enclosed(kt_body *body, double density, const kt_enclosed *solid) {
    const double m = density * solid->volume, all = body->mass + m;
    const kt_vec3 com = kt_vec3_add(kt_vec3_scale(body->mass / all, body->com), kt_vec3_scale(m / all, solid->com));
    body->inertia =
        kt_sym3_add(kt_sym3_shift(body->inertia, body->mass, kt_vec3_sub(body->com, com)),
                    kt_sym3_shift(kt_sym3_scaled(density, solid->inertia), m, kt_vec3_sub(solid->com, com)));
    body->com = com;
    body->mass = all;
}

/* Whether a mesh before the k-th has given the body its mass. */
static bool has_solid_before(const kt_scene_mesh *meshes, int k) {
    for (int i = 0; i < k; i++)
        if (meshes[i].density > 0.0 && strcmp(meshes[i].body, meshes[k].body) == 0)
            return true;
    return false;
}

/* The masses of a body's meshes add up. The first mesh with a density replaces the centre and the inertia that shapes
 * gave. */
static bool give_mesh_mass(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_scene_mesh *meshes, int k,
                           kt_body *body) {
    const kt_sym3 zero = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    kt_enclosed solid = {.volume = 0.0};
    kt_error error = {0};
    if (!(meshes[k].density > 0.0 && isfinite(meshes[k].density)))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "density"),
                           "density is %g kg/m^3; it must be above zero", meshes[k].density);
    if (!has_solid_before(meshes, k) && (body->mass != 0.0 || body->variable_mass != NULL))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "density"),
                           "body %s has a mass of its own; leave out its `mass`, or the density of its mesh",
                           kt_name_quote(body->name).text);
    if (r->scene->is_alone)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "density"),
                           "its mesh is in another file, which cannot be read here; give the body a mass, a com and an "
                           "inertia, and leave out density");
    const kt_status status = kt_scene_mesh_enclosed(&meshes[k], &solid, &error);
    if (status == KT_ERROR_MEMORY)
        return kt_reader_out_of_memory(r);
    if (status != KT_OK)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "file"), "%s%s%s, and it has a density",
                           error.where, error.where[0] != '\0' ? ": " : "", error.message);
    if (!has_solid_before(meshes, k)) {
        body->com_of_shape = body->inertia_of_shape = false;
        body->com = kt_vec3_make(0.0, 0.0, 0.0);
        body->inertia = zero;
    }
    kt_body_add_enclosed(body, meshes[k].density, &solid);
    return true;
}

/* ---- reading and writing ----------------------------------------------------------------------------------------- */

/* NULL: a fault of the names has been reported. */
static kt_body *mesh_body_of(kt_reader *r, kt_scene *scene, const char *name) {
    const int index = kt_names_are_known(r) ? kt_find_body(r, name) : -1;
    return index >= 0 ? (kt_body *)&scene->description.bodies[index] : NULL;
}

static void read_mesh_item(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    kt_node *node = item->nodes[item->index];
    kt_scene_mesh *mesh = (kt_scene_mesh *)item->items + item->index;
    *mesh = standard_mesh();
    if (!kt_table_read(r, scope, node, &table, mesh))
        return;
    if (kt_names_are_known(r) && mesh->body != NULL && kt_find_body(r, mesh->body) < 0) {
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "body"), "body %s does not exist",
                          kt_name_quote(mesh->body).text);
        return;
    }
    if (mesh->file == NULL)
        return; /* its key is missing, or has a fault */
    mesh->file = kt_path_near(r, mesh->file);
    kt_body *body = mesh_body_of(r, item->object, mesh->body);
    if (kt_node_find(node, "density") == NULL || body == NULL)
        return;
    kt_varying_note_fixed(r, node, false); /* masses are not computed again */
    if (!give_mesh_mass(r, scope, node, item->items, item->index, body) && body->mass == 0.0) {
        body->mass = 1.0; /* a missing mass is no second fault */
        body->inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    }
}

static void write_mesh(kt_emitter *e, const void *item, int index) {
    const kt_scene_mesh rest = standard_mesh();
    kt_scene_mesh mesh = *(const kt_scene_mesh *)item;
    (void)index;
    mesh.density = 0.0; /* the body has the mass by it */
    kt_table_write(e, &table, &mesh, &rest);
}

const kt_items kt_meshes = {.expected = "a list of meshes ('- {body: ..., file: ...}')",
                            .size = sizeof(kt_scene_mesh),
                            .array = offsetof(kt_scene, meshes),
                            .count = offsetof(kt_scene, mesh_count),
                            .read = read_mesh_item,
                            .write = write_mesh};
