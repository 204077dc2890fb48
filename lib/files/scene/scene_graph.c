/* The section `joints`: joints between bodies of which none is the parent (parts/joint_graph.c). It is read behind the
 * bodies. Joints that carry bodies become joints of these, and the others become loops, before any other section is
 * read. All names are therefore those of the file. A body with the key `joint` or `parent` keeps its place in the tree.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parts/joint_graph.h"
#include "scene/scene_part.h"
#include "scene/vary.h"

#include <string.h>

/* ---- joints that are needed as coordinates ----------------------------------------------------------------------- */

enum { NAME_MOST = 255 };

/* The joints, by their names. */
typedef struct graph_names {
    kt_names names;
    kt_graph_joint *joints;
} graph_names;

static void mark_coordinate(graph_names *g, const char *text, size_t length) {
    char name[NAME_MOST + 1];
    if (length == 0 || length > NAME_MOST)
        return;
    memcpy(name, text, length);
    name[length] = '\0';
    const int found = kt_names_find(&g->names, 0, name);
    if (found >= 0)
        g->joints[found].is_coordinate = true;
}

/* Marks the joint of "position.NAME" in a formula. A hyphen may belong to the name, or be a minus. */
static void mark_formula(graph_names *g, const char *text) {
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
    static const char *const words[] = {"position.", "velocity.", "acceleration."};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        for (const char *at = strstr(text, words[i]); at != NULL; at = strstr(at + 1, words[i])) {
            const char *name = at + strlen(words[i]);
            const size_t all = strspn(name, letters);
            for (size_t length = all; length > 0; length--)
                if (length == all || name[length] == '-')
                    mark_coordinate(g, name, length);
        }
}

/* Marks the joints that a section names: as a joint, or in a formula. */
static void mark_joints(graph_names *g, const kt_node *node) {
    static const char *const places[] = {"between", "on", "body", "path", "from", "markers"};
    if (node->kind == KT_NODE_TEXT) {
        mark_coordinate(g, node->of.text, strcspn(node->of.text, "["));
        mark_formula(g, node->of.text);
        return;
    }
    for (const kt_node *item = node->of.first; item != NULL; item = item->next) {
        bool is_place = false;
        if (node->kind == KT_NODE_MAP) {
            for (size_t i = 0; i < sizeof places / sizeof *places && item->kind == KT_NODE_TEXT; i++)
                is_place = is_place || strcmp(item->of.text, places[i]) == 0;
            mark_joints(g, item);
            item = item->next;
        }
        if (!is_place)
            mark_joints(g, item);
    }
}

/* A joint whose name occurs in one of these sections counts as a coordinate, which the tree should have. */
static bool mark_coordinates(kt_reader *r, kt_graph_joint *joints, int count) {
    static const char *const sections[] = {"expressions", "states", "loops",    "initial",
                                           "effects",     "events", "simulate", "output"};
    graph_names g = {.joints = joints};
    void *table = kt_reader_take(r, &r->scratch, 1, kt_names_size((size_t)count));
    if (table == NULL)
        return false;
    kt_names_init(&g.names, (size_t)count, table);
    for (int i = 0; i < count; i++)
        if (joints[i].joint.name != NULL)
            (void)kt_names_add(&g.names, 0, joints[i].joint.name, i);
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++) {
        const kt_node *section = kt_node_find(r->root, sections[i]);
        if (section != NULL)
            mark_joints(&g, section);
    }
    return true;
}

/* ---- numbers that follow from variables -------------------------------------------------------------------------- */

/* The numbers of bodies and of their joints are in the tree now. Numbers of frames have been copied into it. */
static void move_graph_numbers(kt_reader *r, const kt_graph *g) {
    kt_varying_move(r, g->bodies, (size_t)g->body_count * sizeof *g->bodies, g->tree);
    for (int i = 0; i < g->joint_count; i++) {
        const kt_graph_joint *j = &g->joints[i];
        if (g->joint_body[i] >= 0 && !g->choices[i].is_reversed)
            kt_varying_move(r, &j->joint, sizeof j->joint, &g->tree[g->joint_body[i]].joint);
        kt_varying_copied(r, j, sizeof *j);
    }
    for (int i = 0; i < g->body_count; i++)
        if (g->bodies[i].marker_count > 0)
            kt_varying_copied(r, g->bodies[i].markers, (size_t)g->bodies[i].marker_count * sizeof *g->bodies->markers);
}

/* ---- bodies and loops -------------------------------------------------------------------------------------------- */

bool kt_graph_loops_append(kt_reader *r, kt_description *description) {
    const kt_graph *g = r->scene->graph;
    const int own = description->loop_count;
    if (g == NULL || g->loop_count == 0)
        return true;
    const size_t all = (size_t)own + (size_t)g->loop_count;
    kt_loop *loops = kt_reader_take(r, &r->keep, all, sizeof *loops);
    kt_node **nodes = kt_reader_take(r, &r->scratch, all, sizeof *nodes);
    if (loops == NULL || nodes == NULL)
        return false;
    for (int i = 0; i < own; i++) {
        loops[i] = description->loops[i];
        nodes[i] = r->scene->loop_nodes[i];
    }
    if (own > 0)
        kt_varying_move(r, description->loops, (size_t)own * sizeof *loops, loops);
    for (int i = 0; i < g->loop_count; i++) {
        loops[own + i] = g->loops[i];
        nodes[own + i] = r->scene->graph_nodes[g->loop_joint[i]];
    }
    description->loops = loops;
    description->loop_count = own + g->loop_count;
    r->scene->loop_nodes = nodes;
    return true;
}

/* Replaces the bodies by the tree of the graph. A joint that became a body of its own has the node of the joint. */
static bool use_graph(kt_reader *r, const kt_graph *g, kt_scene *scene) {
    kt_node **nodes = kt_reader_take(r, &r->scratch, (size_t)g->tree_count, sizeof *nodes);
    if (nodes == NULL)
        return false;
    memcpy(nodes, r->scene->body_nodes, (size_t)g->body_count * sizeof *nodes);
    for (int i = 0; i < g->joint_count; i++)
        if (g->joint_body[i] >= g->body_count)
            nodes[g->joint_body[i]] = r->scene->graph_nodes[i];
    move_graph_numbers(r, g);
    r->scene->body_nodes = nodes;
    r->scene->graph = g;
    scene->description.bodies = g->tree;
    scene->description.body_count = g->tree_count;
    scene->joints = g->choices;
    scene->joint_count = g->joint_count;
    return kt_bodies_index(r, g->tree, g->tree_count) && kt_graph_loops_append(r, &scene->description);
}

/* Reports the fault of the graph at its joint or body. */
static bool report_graph_fault(kt_reader *r, const kt_graph *g, const kt_error *error) {
    const int joint = g->joint_at_fault, body = g->body_at_fault;
    if (error->code == KT_ERROR_MEMORY)
        return kt_reader_out_of_memory(r);
    kt_node *node = joint >= 0 ? r->scene->graph_nodes[joint] : r->scene->body_nodes[body];
    const kt_scope scope =
        joint >= 0 ? kt_item_scope("joint", "joints", joint, node) : kt_item_scope("body", "bodies", body, node);
    return kt_fault_at(r, KT_ERROR_MODEL, &scope, node, "%s", error->message);
}

/* A body with a joint or a parent of its own is placed already. */
static bool connect(kt_reader *r, kt_graph_joint *joints, int count, kt_scene *scene) {
    const kt_description *d = &scene->description;
    kt_graph *g = kt_reader_take(r, &r->keep, 1, sizeof *g);
    bool *is_placed = kt_reader_take(r, &r->scratch, (size_t)d->body_count + 1, sizeof *is_placed);
    kt_error error;
    if (g == NULL || is_placed == NULL || !mark_coordinates(r, joints, count))
        return false;
    for (int i = 0; i < d->body_count; i++)
        is_placed[i] = kt_node_find(r->scene->body_nodes[i], "joint") != NULL ||
                       kt_node_find(r->scene->body_nodes[i], "parent") != NULL;
    *g = (kt_graph){.bodies = d->bodies,
                    .is_placed = is_placed,
                    .body_count = d->body_count,
                    .joints = joints,
                    .joint_count = count};
    return kt_graph_make(&r->keep, g, &error) == KT_OK ? use_graph(r, g, scene) : report_graph_fault(r, g, &error);
}

/* ---- the section ------------------------------------------------------------------------------------------------- */

/* The first end gives the place of a joint. */
static bool has_no_place(kt_reader *r, const kt_scope *scope, const kt_node *node) {
    static const char *const keys[] = {"at", "rotation"};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        kt_node *value = kt_node_find(node, keys[i]);
        if (value != NULL)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, value,
                               "the first end of `between` gives the joint frame; write {body: B, at: [x, y, z], "
                               "rotation: R} there");
    }
    return true;
}

static bool read_graph_joints(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_node **nodes = NULL;
    int count = 0;
    (void)field;
    if (!kt_list_nodes(r, scope, node, "a list of joints ('- {name: ..., type: ..., between: [..., ...]}')", &nodes,
                       &count))
        return false;
    kt_graph_joint *joints = kt_reader_take(r, &r->keep, (size_t)count + 1, sizeof *joints);
    if (joints == NULL)
        return false;
    bool good = kt_names_are_known(r) && !r->scene->hides_bodies;
    for (int i = 0; i < count; i++) {
        const kt_scope here = kt_item_scope("joint", "joints", i, nodes[i]);
        joints[i] = kt_graph_joint_default();
        good = kt_table_read(r, &here, nodes[i], &kt_graph_joint_table, &joints[i]) &&
               has_no_place(r, &here, nodes[i]) && !kt_node_is_faulty(nodes[i]) && good;
    }
    r->scene->graph_nodes = nodes;
    good = good && connect(r, joints, count, object);
    r->scene->names_are_known = r->scene->names_are_known && good; /* no second fault of names that it defines */
    return good;
}

/* Never written: the bodies and loops that follow from it are. */
const kt_kind kt_kind_joints = {.read = read_graph_joints, .same = kt_never_written};
