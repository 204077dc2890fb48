/* Surfaces in files, which pictures show as parts of bodies.
 *
 *     meshes:
 *       - {body: arm, file: meshes/arm.stl, scale: [1e-3, 1e-3, 1e-3], at: [0, 0, 0.1], rotation: {rpy: [0, 0, 90 deg]}}
 *
 * Reading a scene does not open the files: a missing one is no fault, but told by who draws the scene.
 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "scene/part.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define AT(member) .offset = offsetof(kt_scene_mesh, member)
static const kt_field fields[] = {
    {.key = "body", .kind = &kt_kind_name, AT(body), .flags = KT_FIELD_REQUIRED},
    {.key = "file", .kind = &kt_kind_text, AT(file), .flags = KT_FIELD_REQUIRED},
    {.key = "scale", .kind = &kt_kind_vector, AT(scale)},
    {.key = "at", .kind = &kt_kind_vector, AT(at)},
    {.key = "rotation", .kind = &kt_kind_rotation, AT(rotation)},
};
static const kt_table table = {.fields = fields, .count = KT_COUNT_OF(fields), .flow = true};

static kt_scene_mesh standard_mesh(void) {
    return (kt_scene_mesh){.scale = kt_vec3_make(1.0, 1.0, 1.0), .rotation = {.type = KT_ROTATION_NONE}};
}

/* Relative names count from the folder of the scene's file; a file that is there has its whole path. */
static const char *path_of(kt_reader *r, const char *name) {
    const char *slash = r->path != NULL ? strrchr(r->path, '/') : NULL;
    const size_t folder = slash != NULL && name[0] != '/' ? (size_t)(slash - r->path) + 1 : 0;
    char *joined = kt_pool_take(&r->scratch, folder + strlen(name) + 1, 1);
    if (joined == NULL)
        return name;
    (void)sprintf(joined, "%.*s%s", (int)folder, folder > 0 ? r->path : "", name);
    char *whole = realpath(joined, NULL);
    const char *kept = kt_pool_text(&r->keep, whole != NULL ? whole : joined, strlen(whole != NULL ? whole : joined));
    free(whole);
    if (kept == NULL)
        (void)kt_reader_out_of_memory(r);
    return kept != NULL ? kept : name;
}

static bool read_mesh(kt_reader *r, const kt_scope *scope, kt_node *node, kt_scene_mesh *mesh) {
    *mesh = standard_mesh();
    if (!kt_table_read(r, scope, node, &table, mesh))
        return false;
    if (r->names_are_known && kt_find_body(r, mesh->body) < 0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "body"), "body %s does not exist",
                           kt_name_quote(mesh->body).text);
    mesh->file = path_of(r, mesh->file);
    return true;
}

static bool read_meshes(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_scene *scene = object;
    kt_node **nodes = NULL;
    int count = 0;
    (void)field;
    if (!kt_list_nodes(r, scope, node, "a list of meshes ('- {body: ..., file: ...}')", &nodes, &count))
        return false;
    kt_scene_mesh *meshes = kt_pool_take(&r->keep, (size_t)count + 1, sizeof *meshes);
    if (meshes == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++) {
        const kt_scope here = {.outer = scope, .index = i};
        (void)read_mesh(r, &here, nodes[i], &meshes[i]);
    }
    scene->meshes = meshes;
    scene->mesh_count = count;
    return true;
}

static void write_meshes(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    const kt_scene *scene = object;
    const kt_scene_mesh rest = standard_mesh();
    (void)field, (void)standard;
    kt_emit_list(e, false);
    for (int i = 0; i < scene->mesh_count; i++)
        kt_table_write(e, &table, &scene->meshes[i], &rest);
    kt_emit_end(e);
}

static bool same_meshes(const kt_field *field, const void *object, const void *standard) {
    (void)field, (void)standard;
    return ((const kt_scene *)object)->mesh_count == 0;
}

const kt_kind kt_kind_meshes = {read_meshes, write_meshes, same_meshes};
