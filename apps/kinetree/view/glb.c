/* glTF 2.0 (Khronos Group, ISO/IEC 12113:2022). A file of this format is a JSON text and one block of bytes, the
 * buffer. Views of the buffer are rows of numbers, and accessors define the type of these numbers.
 *
 * The root node turns the upward direction into y, as the format requires, and puts the mechanism in its place. Its
 * children are the bodies, and the children of bodies are the solids. Solids of one size share their numbers. If their
 * colour is the same, they also share the mesh. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "view/view.h"

#include "command.h"
#include "picture/picture_mesh.h"
#include "plot/palette.h"
#include "records/output.h"
#include "text/bytes.h"
#include "text/json.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Numbers that the format assigns to types of components, to uses of views, and to chunks. */
enum {
    SHORT = 5122,
    UNSIGNED_INT = 5125,
    FLOAT = 5126,
    FOR_POINTS = 34962,
    FOR_TRIANGLES = 34963,
    CHUNK_JSON = 0x4E4F534A,
    CHUNK_BIN = 0x004E4942,
    MAGIC = 0x46546C67,
    COLOURS = 6,
    SIDES = 24,
};

typedef struct glb {
    const kt_motion *motion;
    json_t *root, *views, *accessors, *meshes, *nodes;
    kt_bytes bytes;
    size_t *frames; /* frames whose times differ in single precision */
    size_t frame_count;
    int *meshes_of; /* [solid]: the mesh; for solids of one size and colour the same one */
} glb;

/* ---- the buffer -------------------------------------------------------------------------------------------------- */

static void put_glb_bytes(glb *g, const void *number, size_t size) {
    char *to = kt_bytes_room(&g->bytes, size);
    for (size_t k = 0; to != NULL && k < size; k++) /* little-endian on every machine */
        to[k] = ((const char *)number)[__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? size - 1 - k : k];
    g->bytes.used += to != NULL ? size : 0;
}

static void put_float(glb *g, double x) {
    const float number = (float)x;
    put_glb_bytes(g, &number, sizeof number);
}

static void put_glb_vector(glb *g, kt_vec3 u) {
    put_float(g, u.x);
    put_float(g, u.y);
    put_float(g, u.z);
}

/* Makes a view of the bytes since `start`: rows of one type. Components of type SHORT are fractions. Returns the view's
 * accessor. */
static int end_view(glb *g, size_t start, int use, int component, const char *type, size_t count, json_t *low,
                    json_t *high) {
    json_t *view = json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", (json_int_t)start, "byteLength",
                             (json_int_t)(g->bytes.used - start));
    json_t *accessor = json_pack("{s:I, s:i, s:I, s:s}", "bufferView", (json_int_t)json_array_size(g->views),
                                 "componentType", component, "count", (json_int_t)count, "type", type);
    if (use != 0)
        json_object_set_new(view, "target", json_integer(use));
    if (component == SHORT)
        json_object_set_new(accessor, "normalized", json_true());
    if (low != NULL)
        json_object_set_new(accessor, "min", low);
    if (high != NULL)
        json_object_set_new(accessor, "max", high);
    json_array_append_new(g->views, view);
    json_array_append_new(g->accessors, accessor);
    return (int)json_array_size(g->accessors) - 1;
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

static kt_vec3 float_vector_of(const float *x) { return kt_vec3_make((double)x[0], (double)x[1], (double)x[2]); }

/* The box of points, as they are in the buffer. In single precision throughout: gcc 12 drops the rounding of a double
 * to a float and back where it vectorises. */
typedef struct box {
    float low[3], high[3];
} box;

static box box_of(const kt_mesh *mesh) {
    box all = {{HUGE_VALF, HUGE_VALF, HUGE_VALF}, {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF}};
    for (int i = 0; i < mesh->point_count; i++) {
        const float p[] = {(float)mesh->points[i].x, (float)mesh->points[i].y, (float)mesh->points[i].z};
        for (int k = 0; k < 3; k++) {
            all.low[k] = fminf(all.low[k], p[k]);
            all.high[k] = fmaxf(all.high[k], p[k]);
        }
    }
    return all;
}

static json_t *describe_primitive(glb *g, const kt_mesh *mesh, int material) {
    const box all = box_of(mesh);
    const size_t points = (size_t)mesh->point_count, corners = 3 * (size_t)mesh->triangle_count;
    size_t start = g->bytes.used;
    for (size_t i = 0; i < points; i++)
        put_glb_vector(g, mesh->points[i]);
    const int positions = end_view(g, start, FOR_POINTS, FLOAT, "VEC3", points,
                                   kt_json_vector(float_vector_of(all.low)), kt_json_vector(float_vector_of(all.high)));
    start = g->bytes.used;
    for (size_t i = 0; i < points; i++)
        put_glb_vector(g, mesh->normals[i]);
    const int normals = end_view(g, start, FOR_POINTS, FLOAT, "VEC3", points, NULL, NULL);
    start = g->bytes.used;
    for (size_t i = 0; i < corners; i++) {
        const uint32_t corner = (uint32_t)mesh->corners[i];
        put_glb_bytes(g, &corner, sizeof corner);
    }
    const int indices = end_view(g, start, FOR_TRIANGLES, UNSIGNED_INT, "SCALAR", corners, NULL, NULL);
    return json_pack("{s:{s:i, s:i}, s:i, s:i}", "attributes", "POSITION", positions, "NORMAL", normals, "indices",
                     indices, "material", material);
}

/* The index of a solid's material: the colours of bodies come first, then grey for parts that are fixed to the
 * world. */
static int material_of(const kt_picture *picture, const kt_solid *solid) {
    const int colour = picture->colour[solid->body];
    return colour >= 0 ? colour % COLOURS : COLOURS;
}

static bool solids_are_alike(const kt_solid *a, const kt_solid *b) {
    return a->mesh == b->mesh && a->type == b->type && a->half.x == b->half.x && a->half.y == b->half.y &&
           a->half.z == b->half.z;
}

/* Returns the mesh of an equal solid before this one, with the same material or with any; -1: there is none yet. */
static int find_glb_mesh(const glb *g, int solid, bool same_material) {
    const kt_solid *solids = g->motion->picture->solids;
    for (int i = solid - 1; i >= 0; i--)
        if (solids_are_alike(&solids[i], &solids[solid]) &&
            (!same_material ||
             material_of(g->motion->picture, &solids[i]) == material_of(g->motion->picture, &solids[solid])))
            return g->meshes_of[i];
    return -1;
}

/* Returns a copy of the primitive of a mesh; NULL for -1. */
static json_t *copy_primitive(const glb *g, int mesh) {
    return json_copy(
        json_array_get(mesh >= 0 ? json_object_get(json_array_get(g->meshes, (size_t)mesh), "primitives") : NULL, 0));
}

static void add_glb_mesh(glb *g, int solid) {
    const kt_picture *picture = g->motion->picture;
    const int material = material_of(picture, &picture->solids[solid]);
    json_t *primitive = copy_primitive(g, find_glb_mesh(g, solid, false));
    if (primitive != NULL) {
        json_object_set_new(primitive, "material", json_integer(material));
    } else {
        kt_mesh mesh = {0};
        kt_solid centred = picture->solids[solid];
        centred.pose = kt_pose_identity();
        g->bytes.is_short = !kt_mesh_add_solid(&mesh, &centred, SIDES) || g->bytes.is_short;
        primitive = g->bytes.is_short ? json_object() : describe_primitive(g, &mesh, material);
        kt_mesh_free(&mesh);
    }
    g->meshes_of[solid] = (int)json_array_size(g->meshes);
    json_array_append_new(g->meshes, json_pack("{s:[o]}", "primitives", primitive));
}

static void add_meshes(glb *g) {
    for (int i = 0; i < g->motion->picture->solid_count && !g->bytes.is_short; i++) {
        g->meshes_of[i] = find_glb_mesh(g, i, true);
        if (g->meshes_of[i] < 0)
            add_glb_mesh(g, i);
    }
}

/* Converts a colour of screens to a linear number. */
static double linear_of(double x) { return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4); }

static json_t *describe_materials(void) {
    const kt_palette *palette = kt_palette_choose(false);
    json_t *list = json_array();
    for (int i = 0; i <= COLOURS; i++) {
        const kt_colour c = i < COLOURS ? palette->series[i] : palette->quiet;
        const double factor[] = {linear_of(c.red), linear_of(c.green), linear_of(c.blue), 1.0};
        json_array_append_new(list,
                              json_pack("{s:{s:o, s:f, s:f}}", "pbrMetallicRoughness", "baseColorFactor",
                                        kt_json_numbers(factor, 4), "metallicFactor", 0.0, "roughnessFactor", 0.6));
    }
    return list;
}

/* ---- nodes ------------------------------------------------------------------------------------------------------- */

/* Describes a rotation as a quaternion, scalar last, as the format requires. */
static json_t *describe_rotation(kt_quat q) {
    const double x[] = {q.x, q.y, q.z, q.w};
    return kt_json_numbers(x, 4);
}

static int add_glb_node(glb *g, const char *name, kt_pose pose, int mesh) {
    json_t *node = json_object();
    if (name != NULL)
        json_object_set_new(node, "name", kt_json_text(name));
    if (mesh >= 0)
        json_object_set_new(node, "mesh", json_integer(mesh));
    json_object_set_new(node, "translation", kt_json_vector(pose.position));
    json_object_set_new(node, "rotation", describe_rotation(kt_quat_from_mat3(pose.rotation)));
    json_array_append_new(g->nodes, node);
    return (int)json_array_size(g->nodes) - 1;
}

static void add_child(glb *g, int node, int child) {
    json_t *parent = json_array_get(g->nodes, (size_t)node), *children = json_object_get(parent, "children");
    if (children == NULL) {
        children = json_array();
        json_object_set_new(parent, "children", children);
    }
    json_array_append_new(children, json_integer(child));
}

/* The pose of the root. It turns the upward direction into y and adds motion->centre, because positions in frames are
 * relative to this point. */
static kt_pose root_pose(const kt_motion *motion) {
    const kt_vec3 g = motion->picture->gravity, y = kt_vec3_make(0.0, 1.0, 0.0);
    const double norm = kt_vec3_norm(g);
    const bool is_flat = motion->picture->is_planar && fabs(motion->picture->normal.z) > 0.999;
    const kt_vec3 up = norm > 0.0 ? kt_vec3_scale(-1.0 / norm, g) : is_flat ? y : kt_vec3_make(0.0, 0.0, 1.0);
    const kt_vec3 axis = kt_vec3_cross(up, y);
    const double sine = kt_vec3_norm(axis), angle = atan2(sine, kt_vec3_dot(up, y));
    const kt_vec3 turn = sine > 0.0 ? kt_vec3_scale(angle / sine, axis) : kt_vec3_make(angle, 0.0, 0.0);
    kt_pose pose = {.rotation = kt_mat3_from_quat(kt_quat_from_euler_vector(turn))};
    pose.position = kt_mat3_apply(pose.rotation, motion->centre);
    return pose;
}

static kt_pose first_pose(const kt_motion *motion, int body) {
    kt_pose pose = kt_pose_identity();
    if (body == 0) {
        pose.position = kt_vec3_scale(-1.0, motion->centre);
        return pose;
    }
    const float *place = motion->places + 3 * (size_t)(body - 1);
    const int16_t *q = motion->turns + 4 * (size_t)(body - 1);
    pose.position = float_vector_of(place);
    pose.rotation = kt_mat3_from_quat(kt_quat_make(q[0], q[1], q[2], q[3]));
    return pose;
}

/* The root is node 0. Body b is node 1 + b, and the world is body 0. The solids follow. */
static void add_nodes(glb *g, const char *name) {
    const kt_motion *motion = g->motion;
    const kt_picture *picture = motion->picture;
    (void)add_glb_node(g, name, root_pose(motion), -1);
    for (int body = 0; body < picture->body_count; body++)
        add_child(g, 0, add_glb_node(g, kt_body_name(motion->model, body), first_pose(motion, body), -1));
    for (int i = 0; i < picture->solid_count; i++)
        add_child(g, 1 + picture->solids[i].body, add_glb_node(g, NULL, picture->solids[i].pose, g->meshes_of[i]));
}

/* ---- animation --------------------------------------------------------------------------------------------------- */

/* Adds the times of frames, which must increase in single precision. */
static int add_times(glb *g) {
    const size_t start = g->bytes.used;
    const double *times = g->motion->times;
    for (size_t i = 0; i < g->motion->count; i++)
        if (i == 0 || (float)times[i] > (float)times[g->frames[g->frame_count - 1]]) {
            g->frames[g->frame_count++] = i;
            put_float(g, times[i]);
        }
    const float first = (float)times[0], last = (float)times[g->frames[g->frame_count - 1]];
    const double low = (double)first, high = (double)last;
    return end_view(g, start, 0, FLOAT, "SCALAR", g->frame_count, kt_json_numbers(&low, 1), kt_json_numbers(&high, 1));
}

static int add_places(glb *g, size_t body) {
    const size_t start = g->bytes.used, bodies = kt_motion_bodies(g->motion);
    for (size_t i = 0; i < g->frame_count; i++) {
        const float *place = g->motion->places + 3 * (g->frames[i] * bodies + body);
        put_glb_vector(g, float_vector_of(place));
    }
    return end_view(g, start, 0, FLOAT, "VEC3", g->frame_count, NULL, NULL);
}

static int add_turns(glb *g, size_t body) {
    const size_t start = g->bytes.used, bodies = kt_motion_bodies(g->motion);
    for (size_t i = 0; i < g->frame_count; i++) {
        const int16_t *q = g->motion->turns + 4 * (g->frames[i] * bodies + body);
        for (int k = 1; k <= 4; k++)
            put_glb_bytes(g, &q[k % 4], sizeof *q);
    }
    return end_view(g, start, 0, SHORT, "VEC4", g->frame_count, NULL, NULL);
}

static void add_channel(json_t *samplers, json_t *channels, int times, int values, int node, const char *path) {
    json_array_append_new(channels, json_pack("{s:I, s:{s:i, s:s}}", "sampler", (json_int_t)json_array_size(samplers),
                                              "target", "node", node, "path", path));
    json_array_append_new(samplers, json_pack("{s:i, s:i}", "input", times, "output", values));
}

static json_t *describe_animation(glb *g) {
    json_t *samplers = json_array(), *channels = json_array();
    const int times = add_times(g);
    for (int body = 1; body < g->motion->picture->body_count; body++)
        if (g->motion->picture->colour[body] >= 0) {
            add_channel(samplers, channels, times, add_places(g, (size_t)body - 1), 1 + body, "translation");
            add_channel(samplers, channels, times, add_turns(g, (size_t)body - 1), 1 + body, "rotation");
        }
    return json_pack("[{s:s, s:o, s:o}]", "name", "motion", "samplers", samplers, "channels", channels);
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

static bool moves(const kt_picture *picture) {
    for (int body = 1; body < picture->body_count; body++)
        if (picture->colour[body] >= 0)
            return true;
    return false;
}

static void describe_glb(glb *g, const char *name) {
    char generator[64];
    snprintf(generator, sizeof generator, "Kinetree %s", kt_version());
    json_object_set_new(g->root, "asset", json_pack("{s:s, s:s}", "version", "2.0", "generator", generator));
    json_object_set_new(g->root, "scene", json_integer(0));
    json_object_set_new(g->root, "scenes", json_pack("[{s:o, s:[i]}]", "name", kt_json_text(name), "nodes", 0));
    add_meshes(g);
    add_nodes(g, name);
    if (moves(g->motion->picture))
        json_object_set_new(g->root, "animations", describe_animation(g));
    if (json_array_size(g->meshes) > 0) { /* the format has no empty lists */
        json_object_set_new(g->root, "materials", describe_materials());
        json_object_set(g->root, "meshes", g->meshes);
    }
    json_object_set(g->root, "nodes", g->nodes);
    if (g->bytes.used > 0) {
        json_object_set_new(g->root, "buffers", json_pack("[{s:I}]", "byteLength", (json_int_t)g->bytes.used));
        json_object_set(g->root, "bufferViews", g->views);
        json_object_set(g->root, "accessors", g->accessors);
    }
}

static void write_word(FILE *file, size_t word) {
    for (int k = 0; k < 4; k++)
        (void)fputc((int)(word >> (8 * k) & 255U), file); /* errors are checked at the end */
}

static size_t whole_words(size_t size) { return (size + 3) / 4 * 4; }

static void write_chunk(FILE *file, size_t type, const void *bytes, size_t size, int filling) {
    write_word(file, whole_words(size));
    write_word(file, type);
    (void)fwrite(bytes, 1, size, file);
    for (size_t i = size; i < whole_words(size); i++)
        (void)fputc(filling, file);
}

/* The parts of a file. */
typedef struct glb_file {
    const char *json;
    const kt_bytes *buffer;
} glb_file;

static void write_glb(FILE *file, const void *what) {
    const glb_file *parts = what;
    const size_t length = strlen(parts->json), used = parts->buffer->used;
    const size_t buffer = used > 0 ? 8 + whole_words(used) : 0;
    write_word(file, MAGIC);
    write_word(file, 2);
    write_word(file, 12 + 8 + whole_words(length) + buffer);
    write_chunk(file, CHUNK_JSON, parts->json, length, ' ');
    if (buffer > 0)
        write_chunk(file, CHUNK_BIN, parts->buffer->text, used, 0);
}

int kt_glb_write(const kt_motion *motion, const char *name, const char *path) {
    if (motion->count == 0)
        return KT_EXIT_DONE; /* there are no frames, and the reason was printed */
    glb g = {.motion = motion,
             .root = json_object(),
             .views = json_array(),
             .accessors = json_array(),
             .meshes = json_array(),
             .nodes = json_array(),
             .frames = malloc(motion->count * sizeof *g.frames),
             .meshes_of = malloc((size_t)(motion->picture->solid_count + 1) * sizeof *g.meshes_of)};
    g.bytes.is_short = g.frames == NULL || g.meshes_of == NULL;
    if (!g.bytes.is_short)
        describe_glb(&g, name);
    char *json = NULL;
    if (g.bytes.is_short) {
        kt_say("there is not enough memory for the glTF file");
        json_decref(g.root);
    } else {
        json = kt_json_print(g.root, JSON_COMPACT | JSON_REAL_PRECISION(17));
    }
    const int code = json != NULL ? kt_output_write(path, write_glb, &(glb_file){json, &g.bytes}) : KT_EXIT_INTEGRATION;
    free(json);
    json_decref(g.views);
    json_decref(g.accessors);
    json_decref(g.meshes);
    json_decref(g.nodes);
    free(g.bytes.text);
    free(g.frames);
    free(g.meshes_of);
    return code;
}
