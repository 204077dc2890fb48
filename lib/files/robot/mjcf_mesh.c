/* Meshes of MJCF, for the masses of bodies.
 *
 * A vertex x of the file is at diag(scale) R(refquat)' (x - refpos) in the frame of the geom. In MJCF, x consists of
 * single-precision numbers: MuJoCo rounds those of files and of the model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_mesh.h"
#include "document/file.h"
#include "robot/mjcf_axes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The file's name, without the folder where the compiler strips paths: those of Windows, too. */
static const char *file_of_mesh(const kt_mjcf *m, const kt_element *e) {
    const char *file = kt_xml_attribute(e, "file"), *end = NULL;
    if (file != NULL && kt_mjcf_settings_of(m, e)->strip_path)
        while ((end = strpbrk(file, "/\\")) != NULL)
            file = end + 1;
    return file;
}

/* "FOLDER/PATH", or an absolute path as it is; NULL: no memory. */
static const char *path_in(kt_mjcf *m, const char *folder, const char *path) {
    const bool is_whole = path[0] == '/' || folder == NULL || folder[0] == '\0';
    return is_whole ? path : kt_robot_print(m->r, &m->r->scratch, "%s/%s", folder, path);
}

/* The path of a mesh's file from the model's folder, unless it is absolute; NULL: no memory. As in MuJoCo, the search
 * starts in the folder of the mesh's document. The folder of the file that names the mesh follows. */
static const char *mesh_path_of(kt_mjcf *m, const kt_element *e, const char *file) {
    const char *path = path_in(m, kt_mjcf_settings_of(m, e)->mesh_folder, file);
    if (path == NULL || e->file == NULL || path[0] == '/')
        return path;
    const char *first = kt_include_relative(m->r, m->source, kt_mjcf_document_at(m, e->document)->root, path);
    const char *near = kt_include_relative(m->r, m->source, e, path);
    return first == NULL || near == NULL || kt_include_is_there(m->r, m->source, first) ||
                   !kt_include_is_there(m->r, m->source, near)
               ? first
               : near;
}

/* Counts a mesh that cannot be read, with the reason of the first. */
static void count_unread_mesh(kt_mjcf *m, kt_left *left, const kt_element *e, const kt_error *error) {
    kt_phrase what = {.length = 0};
    if (error->code == KT_ERROR_MEMORY) {
        (void)kt_reader_out_of_memory(m->r);
        return;
    }
    kt_phrase_add(&what, "%s%s%s", error->where, error->where[0] != '\0' ? ": " : "", error->message);
    if (left->count == 0)
        left->what = kt_reader_text(m->r, &m->r->scratch, what.text, strlen(what.text));
    kt_left_count(left, e);
}

static const char *whole_mesh_path(kt_mjcf *m, const kt_element *e, const char *file, kt_error *error) {
    if (m->source->folder == NULL) {
        (void)kt_error_set(error, KT_ERROR_SCENE, "", "a model that is no file, but text, has no files of meshes");
        return NULL;
    }
    const char *path = mesh_path_of(m, e, file);
    path = path != NULL ? path_in(m, m->source->folder, path) : NULL;
    if (path == NULL)
        (void)kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
    return path;
}

static kt_status read_mesh_surface_of(kt_mjcf *m, const kt_element *e, const char *file, kt_triangles *mesh,
                                      kt_error *error) {
    const char *path = whole_mesh_path(m, e, file, error);
    char *text = NULL;
    size_t size = 0;
    if (path == NULL)
        return error->code;
    kt_status status = kt_file_read(path, &text, &size, error);
    if (status == KT_OK)
        status = kt_triangles_parse(text, size, mesh, error);
    if (status == KT_ERROR_SCENE)
        (void)kt_error_set(error, status, path, "%s", error->message);
    free(text);
    return status;
}

/* Vertices and faces in the model itself. */
static kt_status read_inline(kt_mjcf *m, const kt_element *e, kt_triangles *mesh, kt_error *error) {
    const char *texts[2] = {kt_xml_attribute(e, "vertex"), kt_xml_attribute(e, "face")};
    double *numbers[2];
    int counts[2];
    if (texts[0] == NULL && kt_xml_child(e, "plugin") != NULL)
        return kt_error_set(error, KT_ERROR_SCENE, "", "a plugin makes the mesh: give its body an <inertial>");
    for (int i = 0; i < 2; i++) {
        const size_t most = texts[i] != NULL ? strlen(texts[i]) / 2 + 1 : 0;
        numbers[i] = kt_reader_take(m->r, &m->r->scratch, most + 1, sizeof **numbers);
        if (numbers[i] == NULL)
            return kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
        counts[i] = texts[i] != NULL ? kt_parse_numbers(texts[i], (int)most, numbers[i]) : 0;
        const bool is_missing = texts[i] == NULL && i == 1; /* then it is a hull */
        if (!is_missing && (counts[i] <= 0 || counts[i] % 3 != 0))
            return kt_error_set(error, KT_ERROR_SCENE, "", "it has no file, and no list of %s, three numbers each",
                                i == 0 ? "vertices" : "faces");
    }
    return kt_triangles_make(numbers[0], counts[0] / 3, numbers[1], counts[1] / 3, mesh, error);
}

/* Whether MuJoCo makes the surface itself. */
static bool is_builtin(const kt_element *e) {
    const char *word = kt_xml_attribute(e, "builtin");
    return word != NULL && strcmp(word, "none") != 0;
}

/* How its mass is summed; the mesh's own setting comes before the compiler's. */
typedef enum mesh_rule { LEGACY, EXACT, CONVEX, SHELL } mesh_rule;

static mesh_rule rule_of(kt_mjcf *m, const kt_element *e) {
    static const char *const words[] = {"legacy", "exact", "convex", "shell", NULL};
    return (mesh_rule)kt_mjcf_choice(m, e, "mesh", "inertia", words, kt_mjcf_settings_of(m, e)->exact_meshes);
}

/* refpos and refquat. */
static kt_pose reference_of(kt_mjcf *m, const kt_element *e) {
    const kt_vec3 zero = kt_vec3_make(0.0, 0.0, 0.0);
    kt_pose frame = {.rotation = kt_mat3_identity(), .position = kt_mjcf_vector(m, e, "mesh", "refpos", zero)};
    double v[4];
    if (kt_mjcf_numbers(m, e, "mesh", "refquat", 4, 4, v) == 4) {
        const kt_quat q = kt_quat_make(v[0], v[1], v[2], v[3]);
        if (kt_quat_norm_squared(q) > 0.0)
            frame.rotation = kt_mat3_from_quat(kt_quat_normalize(q));
    }
    return frame;
}

static kt_vec3 scale_of(kt_mjcf *m, const kt_element *e) {
    return kt_mjcf_vector(m, e, "mesh", "scale", kt_vec3_make(1.0, 1.0, 1.0));
}

/* Sets the axes and the box of a mesh whose solid is known. */
static void box_mesh(const kt_triangles *triangles, kt_mjcf_mesh *mesh) {
    mesh->axes = kt_mjcf_axes(mesh->enclosed.inertia);
    const kt_vec3 axes[3] = {mesh->axes.x, mesh->axes.y, mesh->axes.z};
    for (int k = 0; k < 3; k++) {
        mesh->box[0][k] = (double)INFINITY;
        mesh->box[1][k] = -(double)INFINITY;
        for (int i = 0; i < triangles->vertex_count; i++) {
            const double x = kt_vec3_dot(axes[k], kt_vec3_sub(triangles->vertices[i], mesh->enclosed.com));
            mesh->box[0][k] = fmin(mesh->box[0][k], x);
            mesh->box[1][k] = fmax(mesh->box[1][k], x);
        }
    }
}

/* Reports why a mesh that could be read has no mass. MuJoCo rejects such a mesh. */
static kt_status report_empty(const kt_triangles *triangles, mesh_rule rule, double volume, kt_error *error) {
    const char *reason = triangles->is_lines
                             ? "the mesh consists of lines, which enclose nothing: give it faces, or its "
                               "body an <inertial>"
                         : rule == SHELL ? "the triangles of the mesh have no area"
                         : volume < 0.0  ? "the triangles of the mesh face inwards: turn them, or give the mesh "
                                           "inertia=\"convex\" or \"legacy\""
                                         : "the mesh encloses no volume: inertia=\"shell\" gives it the mass of its "
                                           "surface";
    return kt_error_set(error, KT_ERROR_SCENE, "", "%s", reason);
}

/* Places a mesh and computes the solid that it encloses. For a hull, replaces the triangles with the hull. */
static kt_status enclose(kt_mjcf *m, const kt_element *e, kt_triangles *triangles, kt_mjcf_mesh *mesh,
                         kt_error *error) {
    static const kt_volume_rule rules[] = {[LEGACY] = KT_VOLUME_ABSOLUTE,
                                           [EXACT] = KT_VOLUME_SIGNED,
                                           [CONVEX] = KT_VOLUME_SIGNED,
                                           [SHELL] = KT_VOLUME_SURFACE};
    const mesh_rule rule = rule_of(m, e);
    const kt_vec3 scale = scale_of(m, e);
    if (triangles->is_lines)
        return report_empty(triangles, rule, 0.0, error);
    if (!kt_triangles_round(triangles))
        return kt_error_set(error, KT_ERROR_SCENE, "", "a vertex is beyond the range of single-precision numbers");
    kt_triangles_place(triangles, reference_of(m, e), scale);
    if (m->source->options->contacts)
        mesh->point_count = kt_contact_mesh_points(triangles, mesh->points);
    if (scale.x * scale.y * scale.z < 0.0) /* a mirror */
        kt_triangles_turn_over(triangles);
    const kt_status status = rule == CONVEX ? kt_triangles_hull(triangles, error) : KT_OK;
    if (status == KT_OK)
        mesh->enclosed = kt_triangles_enclosed(triangles, rules[rule]);
    if (status == KT_OK && mesh->enclosed.volume > 0.0)
        box_mesh(triangles, mesh);
    else if (status == KT_OK)
        return report_empty(triangles, rule, mesh->enclosed.volume, error);
    if ((rule == CONVEX || triangles->is_hull) && kt_mjcf_number(m, e, "mesh", "maxhullvert", -1.0) > 0.0)
        kt_unknown_count(&m->changes, "a hull with a bounded number of vertices, for which the scene uses all vertices",
                         e);
    return status;
}

const char *kt_mjcf_asset_name(kt_mjcf *m, const kt_element *e) {
    const char *name = kt_xml_attribute(e, "name"), *file = file_of_mesh(m, e);
    if (name != NULL || file == NULL)
        return name;
    const char *slash = strrchr(file, '/'), *start = slash != NULL ? slash + 1 : file, *dot = strrchr(start, '.');
    name = kt_reader_text(m->r, &m->r->scratch, start, dot != NULL ? (size_t)(dot - start) : strlen(start));
    for (int d = e->document; d > 0 && name != NULL; d = kt_mjcf_document_at(m, d)->parent)
        name = kt_mjcf_join(m, e, kt_mjcf_document_at(m, d)->prefix, name);
    return name;
}

static void add_mesh(kt_mjcf *m, const kt_element *e) {
    const char *name = kt_mjcf_asset_name(m, e);
    if (name != NULL && kt_names_add(&m->names, KT_MJCF_MESHES, name, m->meshes.count) >= 0)
        (void)kt_mjcf_fault(m, e, "there is another mesh of this name; each needs one of its own");
    kt_mjcf_mesh *mesh = kt_list_add(m->r, &m->r->scratch, &m->meshes, sizeof *mesh);
    if (mesh != NULL)
        mesh->element = e;
}

void kt_mjcf_read_meshes(kt_mjcf *m) {
    for (const kt_element *e = kt_mjcf_section(m, "asset", NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_section(m, "asset", e))
        if (strcmp(e->name, "mesh") == 0)
            add_mesh(m, e);
}

/* Adds the file of a mesh, or its name, to an error. */
static void name_unread_mesh(kt_mjcf *m, const kt_element *e, kt_error *error) {
    const char *file = file_of_mesh(m, e), *name = file != NULL ? file : kt_mjcf_asset_name(m, e);
    if (name != NULL)
        (void)kt_error_set(error, error->code, name, "%s", error->message);
}

/* Reads a mesh, once. */
static void read_mesh(kt_mjcf *m, kt_mjcf_mesh *mesh) {
    const kt_element *e = mesh->element;
    const char *file = file_of_mesh(m, e);
    kt_triangles triangles = {.vertices = NULL};
    kt_error error = {0};
    if (file == NULL && is_builtin(e)) {
        kt_left_count(&m->notes.builtins, e);
        return;
    }
    kt_status status =
        file != NULL ? read_mesh_surface_of(m, e, file, &triangles, &error) : read_inline(m, e, &triangles, &error);
    if (status == KT_OK)
        status = enclose(m, e, &triangles, mesh, &error);
    if (status == KT_ERROR_SCENE && error.where[0] == '\0')
        name_unread_mesh(m, e, &error);
    kt_triangles_free(&triangles);
    if (status != KT_OK) {
        error.code = status;
        count_unread_mesh(m, &m->notes.mesh_files, e, &error);
    }
}

/* The mesh that a geom names; NULL: there is none. */
static kt_mjcf_mesh *mesh_of(const kt_mjcf *m, const char *name) {
    const int index = name != NULL ? kt_names_find(&m->names, KT_MJCF_MESHES, name) : -1;
    return index >= 0 ? (kt_mjcf_mesh *)m->meshes.items + index : NULL;
}

/* The mesh of a geom, which is read if it was not; NULL after reporting that there is none. */
static const kt_mjcf_mesh *need_mesh(kt_mjcf *m, const kt_element *geom) {
    const char *name = kt_mjcf_text(m, geom, "geom", "mesh");
    kt_mjcf_mesh *mesh = mesh_of(m, name);
    if (mesh == NULL) {
        (void)kt_mjcf_fault(m, geom, "mesh %s does not exist",
                            name != NULL ? kt_name_quote(name).text : "without a name");
        return NULL;
    }
    if (!mesh->is_known)
        read_mesh(m, mesh);
    mesh->is_known = true;
    return mesh;
}

const kt_mjcf_mesh *kt_mjcf_find_mesh(kt_mjcf *m, const kt_element *geom) {
    const kt_mjcf_mesh *mesh = need_mesh(m, geom);
    return mesh != NULL && mesh->enclosed.volume > 0.0 ? mesh : NULL;
}

const kt_vec3 *kt_mjcf_mesh_points(kt_mjcf *m, const kt_element *geom, int *count) {
    const kt_mjcf_mesh *mesh = need_mesh(m, geom);
    *count = mesh != NULL ? mesh->point_count : 0;
    return mesh != NULL ? mesh->points : NULL;
}

/* Points of a file are scaled in its own axes, so that a mesh that is turned by refquat has to have one scale. With s
 * that scale: p + R s R0' (x - x0) = (p - R s R0' x0) + R R0' s x. */
void kt_mjcf_draw_mesh(kt_mjcf *m, const kt_element *geom, kt_pose pose) {
    const kt_mjcf_mesh *mesh = mesh_of(m, kt_mjcf_text(m, geom, "geom", "mesh"));
    const char *file = mesh != NULL ? file_of_mesh(m, mesh->element) : NULL,
               *path = file != NULL ? mesh_path_of(m, mesh->element, file) : NULL;
    if (path == NULL) {
        kt_left_count(&m->notes.pictures, geom);
        return;
    }
    const kt_pose frame = reference_of(m, mesh->element);
    const kt_vec3 s = scale_of(m, mesh->element);
    const bool is_turned = frame.rotation.x.x != 1.0 || frame.rotation.y.y != 1.0;
    if (is_turned && (s.x != s.y || s.y != s.z)) {
        kt_left_count(&m->notes.pictures, geom);
        return;
    }
    pose.rotation = kt_mat3_multiply(pose.rotation, kt_mat3_transpose(frame.rotation));
    const kt_vec3 moved = kt_vec3_make(s.x * frame.position.x, s.y * frame.position.y, s.z * frame.position.z);
    pose.position = kt_vec3_sub(pose.position, kt_mat3_apply(pose.rotation, moved));
    (void)kt_appearance_add_mesh(&m->appearance, geom, path, pose, s);
}
