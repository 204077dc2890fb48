/* Bodies and joints that form a graph, made into a tree with loops. The tree is that of spanning.c.
 *
 * A joint has the frame P on the body that carries it and the frame C on the body that it carries. It moves C relative
 * to P by J(q), so the pose of the second body in the first is P J(q) C^-1. The body frame of a tree is the child side
 * of its joint. So C^-1 is removed in one of three ways:
 *
 *     C = 1:                                  joint frame P, motion J
 *     C J C^-1 has its axes through the       joint frame P C^-1, motion C J C^-1: the axes are turned by C
 *     origin of the body:
 *     otherwise:                              a massless body moves by J in P, and the body is fixed to it at C^-1
 *
 * If the second end of a joint is the nearer one to the ground, the joint is reversed. The inverse of J(q) about an
 * axis is the motion by q about the opposite axis; R1(q1) R2(q2) has the inverse of R2(-q2) R1(-q1).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parts/joint_graph.h"

#include "base/names.h"
#include "base/require.h"
#include "joint/joint.h"
#include "parts/builder.h"
#include "parts/spanning.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Digits of the weight of a joint in the tree: coordinates, and what is preferred to few coordinates. */
enum { DOFS = 1, START = 8, COORDINATE = 16 };

enum { JOINTS = -1 }; /* the scope of their names */

/* An end of a joint: vertex 0 is the world, and vertex i + 1 is body i. */
typedef struct graph_end {
    int vertex;
    kt_pose pose;
    kt_rotation rotation; /* of the pose */
} graph_end;

typedef struct graph_ends {
    graph_end end[2];
} graph_ends;

typedef struct graph_work {
    kt_pool *pool;
    kt_graph *graph;
    kt_names names;
    graph_ends *ends; /* of each joint */
    int *top;         /* of each vertex: the vertex from which placed bodies carry it, itself where a joint does */
    kt_edge *edges;
    kt_spanning spanning;
} graph_work;

kt_graph_joint kt_graph_joint_default(void) {
    return (kt_graph_joint){.joint = kt_joint_default(), .between = {kt_end_default(), kt_end_default()}};
}

const char *kt_graph_reason_words(kt_graph_reason reason) {
    static const char *const words[] = {
#define GRAPH_WORDS(id, text) text,
        KT_GRAPH_REASON_LIST(GRAPH_WORDS)
#undef GRAPH_WORDS
    };
    return (unsigned)reason < KT_GRAPH_REASON_COUNT ? words[reason] : "";
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

/* Reports a fault of a joint, or of a body if joint is -1. */
KT_PRINTF(5, 6)
static kt_status graph_fault(graph_work *w, int joint, int body, kt_error *error, const char *format, ...) {
    char where[KT_WHERE_SIZE], message[KT_MESSAGE_SIZE];
    const char *name = joint >= 0 ? w->graph->joints[joint].joint.name : w->graph->bodies[body].name;
    va_list arguments;
    w->graph->joint_at_fault = joint;
    w->graph->body_at_fault = body;
    (void)snprintf(where, sizeof where, "%s '%.100s'", joint >= 0 ? "joint" : "body", name != NULL ? name : "");
    va_start(arguments, format);
    (void)vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    return kt_error_set(error, KT_ERROR_MODEL, where, "%s", message);
}

/* ---- ends -------------------------------------------------------------------------------------------------------- */

static const char *vertex_name(const graph_work *w, int vertex) {
    return vertex > 0 ? w->graph->bodies[vertex - 1].name : NULL;
}

static const kt_marker *find_graph_marker(const kt_body *body, const char *name) {
    for (int i = 0; i < body->marker_count; i++)
        if (body->markers[i].name != NULL && strcmp(body->markers[i].name, name) == 0)
            return &body->markers[i];
    return NULL;
}

/* The rotation `a`, then `b` in its axes; of one that is given alone, as it is given. */
static kt_status compose_rotations(const kt_rotation *a, const kt_rotation *b, graph_end *out, kt_error *error) {
    kt_mat3 first = kt_mat3_identity(), second = first;
    kt_status status = a->type != KT_ROTATION_NONE ? kt_rotation_evaluate(a, &first, error) : KT_OK;
    if (status == KT_OK && b->type != KT_ROTATION_NONE)
        status = kt_rotation_evaluate(b, &second, error);
    out->pose.rotation = kt_mat3_multiply(first, second);
    out->rotation = b->type == KT_ROTATION_NONE   ? *a
                    : a->type == KT_ROTATION_NONE ? *b
                                                  : kt_rotation_matrix(out->pose.rotation);
    return status;
}

/* Finds the vertex (0: the world) and the pose of an end in its body. */
static kt_status place_end(graph_work *w, int joint, const kt_end *end, graph_end *out, kt_error *error) {
    const bool is_world = end->body == NULL || strcmp(end->body, "world") == 0;
    const kt_rotation none = {.type = KT_ROTATION_NONE};
    const int body = is_world ? -1 : kt_names_find(&w->names, 0, end->body);
    kt_error reason;
    if (!is_world && body < 0)
        return graph_fault(w, joint, -1, error, "body %s does not exist; name a body of the graph",
                           kt_name_quote(end->body).text);
    const kt_marker *marker =
        end->marker != NULL && body >= 0 ? find_graph_marker(&w->graph->bodies[body], end->marker) : NULL;
    if (end->marker != NULL && marker == NULL)
        return graph_fault(w, joint, -1, error, "the body has no marker %s", kt_name_quote(end->marker).text);
    out->vertex = body + 1;
    out->pose.position = marker != NULL ? marker->at : end->at;
    if (compose_rotations(marker != NULL ? &marker->rotation : &none, &end->rotation, out, &reason) != KT_OK)
        return graph_fault(w, joint, -1, error, "%s", reason.message);
    return KT_OK;
}

static bool is_zero(kt_vec3 u) { return u.x == 0.0 && u.y == 0.0 && u.z == 0.0; }

static kt_status check_graph_joint(graph_work *w, int i, kt_error *error) {
    const kt_joint *joint = &w->graph->joints[i].joint;
    if (joint->name == NULL || kt_joint_type_name(joint->type) == NULL)
        return graph_fault(w, i, -1, error, "%s",
                           joint->name == NULL ? "the name is missing" : "there is no joint of this type");
    if (kt_names_add(&w->names, JOINTS, joint->name, i) >= 0)
        return graph_fault(w, i, -1, error, "another joint has this name");
    if (!is_zero(joint->at) || joint->rotation.type != KT_ROTATION_NONE)
        return graph_fault(w, i, -1, error, "the first end gives the joint frame; leave at and rotation out");
    if (joint->type != KT_JOINT_FIXED && is_zero(joint->axis))
        return graph_fault(w, i, -1, error, "the axis is zero; give it a direction, such as [0, 0, 1]");
    return KT_OK;
}

static kt_status read_ends(graph_work *w, kt_error *error) {
    for (int i = 0; i < w->graph->joint_count; i++) {
        kt_status status = check_graph_joint(w, i, error);
        for (int k = 0; k < 2 && status == KT_OK; k++)
            status = place_end(w, i, &w->graph->joints[i].between[k], &w->ends[i].end[k], error);
        if (status == KT_OK && w->ends[i].end[0].vertex == w->ends[i].end[1].vertex)
            status = graph_fault(w, i, -1, error, "both ends are on one body");
        if (status != KT_OK)
            return status;
    }
    return KT_OK;
}

/* ---- the tree ---------------------------------------------------------------------------------------------------- */

static int parent_vertex(const graph_work *w, int vertex) {
    const char *parent = w->graph->bodies[vertex - 1].parent;
    const int body = parent == NULL || strcmp(parent, "world") == 0 ? -1 : kt_names_find(&w->names, 0, parent);
    return body + 1;
}

/* The check of the description reports a parent that does not exist, and parents in a circle. */
static void find_tops(graph_work *w) {
    for (int i = 1; i <= w->graph->body_count; i++) {
        int top = i, steps = 0;
        while (top > 0 && w->graph->is_placed[top - 1] && steps++ <= w->graph->body_count)
            top = parent_vertex(w, top);
        w->top[i] = steps <= w->graph->body_count ? top : 0;
    }
}

static bool has_armature(const kt_joint *joint) {
    for (int k = 0; k < KT_JOINT_NV_MAX; k++)
        if (joint->armature[k] != 0.0)
            return true;
    return false;
}

/* The weight of a joint as an edge of the tree, which has the least weight of all trees (spanning.c). Joints outside
 * of the tree become loops. The lowest digit counts coordinates, so that the tree has few of them. Joints that have a
 * start, or are chosen as coordinates, lack the higher digits, and are preferred. A fixed joint makes no coordinate,
 * and a free one no loop. */
static int weight_of(const kt_graph_joint *j) {
    if (j->joint.type == KT_JOINT_FIXED || j->joint.type == KT_JOINT_FREE)
        return 0;
    const int dofs = DOFS * kt_joint_sizes[j->joint.type].nv;
    const bool is_coordinate = j->is_coordinate || has_armature(&j->joint);
    return dofs + (kt_joint_given(&j->joint) != 0 ? 0 : START) + (is_coordinate ? 0 : COORDINATE);
}

static kt_graph_reason reason_of(int weight, int heaviest) {
    if (weight == heaviest)
        return KT_GRAPH_CUT_OF_LENGTHS;
    if (heaviest > 0 && weight / COORDINATE != heaviest / COORDINATE)
        return KT_GRAPH_CUT_OF_COORDINATES;
    return heaviest > 0 && weight / START != heaviest / START ? KT_GRAPH_CUT_OF_STARTS : KT_GRAPH_CUT_OF_FREEDOMS;
}

static kt_status span_graph(graph_work *w, kt_error *error) {
    kt_graph *g = w->graph;
    for (int i = 0; i < g->joint_count; i++)
        w->edges[i] = (kt_edge){.end = {w->top[w->ends[i].end[0].vertex], w->top[w->ends[i].end[1].vertex]},
                                .weight = weight_of(&g->joints[i])};
    w->spanning = (kt_spanning){.vertex_count = g->body_count + 1, .edge_count = g->joint_count, .edge = w->edges};
    if (!kt_spanning_find(w->pool, &w->spanning))
        return kt_builder_out_of_memory(error);
    for (int i = 1; i <= g->body_count; i++)
        if (w->top[i] == i && w->spanning.carrier[i] < 0)
            return graph_fault(w, -1, i - 1, error,
                               "no joint connects this body with the world; add a joint, or let the body float with "
                               "joint: {type: free}");
    return KT_OK;
}

/* ---- joints of the tree ------------------------------------------------------------------------------------------ */

static kt_vec3 opposite(kt_vec3 axis) { return kt_vec3_scale(-1.0, axis); }

static void exchange(double *x) {
    const double first = x[0];
    x[0] = x[1];
    x[1] = first;
}

/* The rotation of the second end of a spherical joint, seen from there: the conjugate; and its rate. */
static void reverse_rotation(kt_joint *joint) {
    const kt_quat q = kt_quat_make(joint->position[0], joint->position[1], joint->position[2], joint->position[3]);
    const bool is_given = q.w != 0.0 || q.x != 0.0 || q.y != 0.0 || q.z != 0.0;
    const kt_vec3 w = kt_vec3_make(joint->velocity[0], joint->velocity[1], joint->velocity[2]);
    const kt_vec3 back = opposite(is_given ? kt_mat3_apply(kt_mat3_from_quat(q), w) : w);
    for (int k = 1; k < 4; k++)
        joint->position[k] = -joint->position[k];
    kt_joint_store(joint->velocity, back);
}

/* Turns a joint round. */
static kt_status reverse_joint(graph_work *w, int i, kt_joint *joint, kt_error *error) {
    const kt_vec3 axis = joint->axis;
    const bool has_start = kt_joint_given(joint) != 0;
    switch (joint->type) {
    case KT_JOINT_UNIVERSAL:
        joint->axis = opposite(kt_joint_second_axis(joint));
        joint->axis2 = opposite(axis);
        exchange(joint->position);
        exchange(joint->velocity);
        exchange(joint->armature);
        break;
    case KT_JOINT_SPHERICAL:
        reverse_rotation(joint);
        break;
    case KT_JOINT_PLANAR:
    case KT_JOINT_FREE:
        if (has_start)
            return graph_fault(w, i, -1, error,
                               "its second end is nearer to the ground, and its start values would belong to the first "
                               "end; exchange both ends, and give the start values of the other end");
        break;
    default:
        joint->axis = opposite(axis);
    }
    return KT_OK;
}

/* Whether the axes of a joint that is turned by its frame C in a body can pass through the body's origin. */
static bool axes_meet_origin(const kt_joint *joint, const graph_end *c) {
    const kt_vec3 p = c->pose.position, axis = kt_joint_unit(kt_mat3_apply(c->pose.rotation, joint->axis));
    const kt_vec3 across = kt_vec3_sub(p, kt_vec3_scale(kt_vec3_dot(p, axis), axis));
    const bool is_turned = c->rotation.type != KT_ROTATION_NONE;
    switch (joint->type) {
    case KT_JOINT_FIXED:
    case KT_JOINT_PRISMATIC:
        return true;
    case KT_JOINT_UNIVERSAL:
        return is_zero(p);
    case KT_JOINT_REVOLUTE:
    case KT_JOINT_SCREW:
    case KT_JOINT_CYLINDRICAL:
        return kt_vec3_norm(across) <= 16.0 * DBL_EPSILON * kt_vec3_norm(p);
    default:
        return is_zero(p) && !is_turned;
    }
}

/* The frame P C^-1 of a joint, and its axes there. */
static void set_moved_frame(kt_joint *joint, const graph_end *p, const graph_end *c) {
    const kt_pose frame = kt_pose_compose(p->pose, kt_pose_invert(c->pose));
    const bool is_turned = c->rotation.type != KT_ROTATION_NONE;
    joint->at = frame.position;
    joint->rotation = is_turned ? kt_rotation_matrix(frame.rotation) : p->rotation;
    if (!is_turned || joint->type == KT_JOINT_FIXED)
        return;
    if (joint->type == KT_JOINT_UNIVERSAL)
        joint->axis2 = kt_mat3_apply(c->pose.rotation, kt_joint_second_axis(joint));
    joint->axis = kt_mat3_apply(c->pose.rotation, joint->axis);
}

/* A name for a body or joint that no other has: the stem, if it is free and may be used, else STEM-ENDING,
 * STEM-ENDING2, ... NULL if there is no memory. */
static const char *make_name(graph_work *w, const char *stem, const char *ending, bool may_be_stem) {
    const size_t size = strlen(stem) + strlen(ending) + 24;
    char *name = kt_pool_take(w->pool, size, 1);
    if (name == NULL)
        return NULL;
    (void)snprintf(name, size, "%s", stem);
    if (may_be_stem && kt_names_find(&w->names, 0, name) < 0)
        return name;
    (void)snprintf(name, size, "%s-%s", stem, ending);
    for (int i = 2; kt_names_find(&w->names, 0, name) >= 0 || kt_names_find(&w->names, JOINTS, name) >= 0; i++)
        (void)snprintf(name, size, "%s-%s%d", stem, ending, i);
    return name;
}

/* Adds the massless body that moves by a joint, and fixes `body` to it. */
static kt_status add_frame(graph_work *w, const kt_joint *joint, const char *parent, const graph_end *c, kt_body *body,
                           kt_error *error) {
    kt_graph *g = w->graph;
    kt_body *frame = &g->tree[g->tree_count];
    *frame = kt_body_default();
    frame->name = make_name(w, joint->name, "frame", true);
    if (frame->name == NULL)
        return kt_builder_out_of_memory(error);
    (void)kt_names_add(&w->names, 0, frame->name, g->tree_count++);
    frame->parent = parent;
    frame->joint = *joint;
    if (strcmp(frame->name, joint->name) == 0)
        frame->joint.name = NULL; /* a joint has the name of its body */
    const kt_pose back = kt_pose_invert(c->pose);
    body->parent = frame->name;
    body->joint = kt_joint_default();
    /* its fixed joint has another name than a joint of the graph */
    const bool has_twin = kt_names_find(&w->names, JOINTS, body->name) >= 0;
    body->joint.name = has_twin ? make_name(w, body->name, "mount", false) : NULL;
    if (has_twin && body->joint.name == NULL)
        return kt_builder_out_of_memory(error);
    body->joint.at = kt_vec3_add(back.position, kt_vec3_make(0.0, 0.0, 0.0)); /* no -0 */
    if (c->rotation.type != KT_ROTATION_NONE)
        body->joint.rotation = kt_rotation_matrix(back.rotation);
    return KT_OK;
}

/* Lets joint i carry its body. */
static kt_status attach_carried(graph_work *w, int i, kt_error *error) {
    kt_graph *g = w->graph;
    const bool is_reversed = w->edges[i].is_reversed;
    const graph_end *p = &w->ends[i].end[is_reversed], *c = &w->ends[i].end[!is_reversed];
    kt_joint joint = g->joints[i].joint;
    if (w->top[c->vertex] != c->vertex || c->vertex == 0)
        return graph_fault(w, i, -1, error,
                           "it would carry a body below its parent; connect it with %s, which has no joint of its own",
                           kt_name_quote(vertex_name(w, w->top[c->vertex])).text);
    const kt_status status = is_reversed ? reverse_joint(w, i, &joint, error) : KT_OK;
    kt_body *body = &g->tree[c->vertex - 1];
    if (status != KT_OK)
        return status;
    g->choices[i].body = body->name;
    g->choices[i].is_reversed = is_reversed;
    joint.at = p->pose.position;
    joint.rotation = p->rotation;
    g->joint_body[i] = c->vertex - 1;
    if (!axes_meet_origin(&joint, c)) {
        g->joint_body[i] = g->tree_count;
        return add_frame(w, &joint, vertex_name(w, p->vertex), c, body, error);
    }
    if (!is_zero(c->pose.position) || c->rotation.type != KT_ROTATION_NONE)
        set_moved_frame(&joint, p, c);
    body->parent = vertex_name(w, p->vertex);
    body->joint = joint;
    return KT_OK;
}

/* ---- joints that close loops ------------------------------------------------------------------------------------- */

static kt_status check_cut(graph_work *w, int i, const kt_loop *loop, kt_error *error) {
    const kt_joint *joint = &w->graph->joints[i].joint;
    if (joint->type == KT_JOINT_FREE)
        return graph_fault(w, i, -1, error,
                           "a free joint between bodies that are connected holds nothing; leave it out");
    if (has_armature(joint))
        return graph_fault(
            w, i, -1, error,
            "it closes a loop, in which no armature acts; give the armature to another joint of the loop");
    if (joint->type == KT_JOINT_UNIVERSAL &&
        fabs(kt_vec3_dot(kt_joint_unit(loop->axis), kt_joint_unit(loop->axis2))) > 1e-9)
        return graph_fault(w, i, -1, error,
                           "it closes a loop, in which both axes must be at right angles; give a start value, so that "
                           "another joint of the loop is cut");
    return KT_OK;
}

/* The vertex that a vertex is fixed to, by any number of fixed joints; itself if it moves. */
static int rigid_of(const graph_work *w, int vertex) {
    const kt_graph *g = w->graph;
    for (int steps = 0; vertex > 0 && steps <= g->body_count; steps++) {
        const bool is_placed = g->is_placed[vertex - 1];
        const int carrier = is_placed ? -1 : w->spanning.carrier[vertex];
        const kt_joint_type type = is_placed      ? g->bodies[vertex - 1].joint.type
                                   : carrier >= 0 ? g->joints[carrier].joint.type
                                                  : KT_JOINT_FREE;
        if (type != KT_JOINT_FIXED)
            break;
        vertex = is_placed ? parent_vertex(w, vertex) : w->ends[carrier].end[w->edges[carrier].is_reversed].vertex;
    }
    return vertex;
}

/* A joint outside of the tree becomes a loop. Between parts that are fixed to each other anyway, it is left out. */
static kt_status close_graph_loop(graph_work *w, int i, kt_error *error) {
    kt_graph *g = w->graph;
    const kt_graph_joint *j = &g->joints[i];
    kt_loop *loop = &g->loops[g->loop_count];
    g->joint_body[i] = -1;
    if (rigid_of(w, w->ends[i].end[0].vertex) == rigid_of(w, w->ends[i].end[1].vertex)) {
        g->choices[i].reason = KT_GRAPH_RIGID;
        return KT_OK;
    }
    *loop = kt_loop_default();
    loop->name = j->joint.name;
    loop->type = kt_joint_kinds[j->joint.type]->loop;
    loop->coordinates = kt_joint_sizes[j->joint.type].nv > 0;
    memcpy(loop->between, j->between, sizeof loop->between);
    if (j->joint.type != KT_JOINT_FIXED && j->joint.type != KT_JOINT_SPHERICAL)
        loop->axis = j->joint.axis;
    if (j->joint.type == KT_JOINT_UNIVERSAL)
        loop->axis2 = kt_joint_second_axis(&j->joint);
    if (j->joint.type == KT_JOINT_SCREW)
        loop->pitch = j->joint.pitch;
    g->loop_joint[g->loop_count++] = i;
    int length;
    const int heaviest = kt_spanning_heaviest(&w->spanning, i, &length);
    const int weight = w->edges[i].weight;
    g->choices[i].loses_start = kt_joint_given(&j->joint) != 0;
    g->choices[i].reason = reason_of(weight, heaviest < 0 ? weight : w->edges[heaviest].weight);
    g->choices[i].length = length + 1;
    return check_cut(w, i, loop, error);
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

static bool take_graph(graph_work *w) {
    kt_graph *g = w->graph;
    const size_t bodies = (size_t)g->body_count, joints = (size_t)g->joint_count, names = 2 * bodies + 2 * joints;
    void *table = kt_pool_take(w->pool, 1, kt_names_size(names));
    w->ends = kt_pool_take(w->pool, joints + 1, sizeof *w->ends);
    w->edges = kt_pool_take(w->pool, joints + 1, sizeof *w->edges);
    w->top = kt_pool_take(w->pool, bodies + 1, sizeof *w->top);
    g->tree = kt_pool_take(w->pool, bodies + joints + 1, sizeof *g->tree);
    g->joint_body = kt_pool_take(w->pool, joints + 1, sizeof *g->joint_body);
    g->loops = kt_pool_take(w->pool, joints + 1, sizeof *g->loops);
    g->loop_joint = kt_pool_take(w->pool, joints + 1, sizeof *g->loop_joint);
    g->choices = kt_pool_take(w->pool, joints + 1, sizeof *g->choices);
    if (table == NULL || w->ends == NULL || w->edges == NULL || w->top == NULL || g->tree == NULL ||
        g->joint_body == NULL || g->loops == NULL || g->loop_joint == NULL || g->choices == NULL)
        return false;
    kt_names_init(&w->names, names, table);
    for (int i = 0; i < g->body_count; i++) {
        g->tree[i] = g->bodies[i];
        if (g->bodies[i].name != NULL)
            (void)kt_names_add(&w->names, 0, g->bodies[i].name, i);
        if (g->bodies[i].name != NULL && g->is_placed[i])
            (void)kt_names_add(&w->names, JOINTS, kt_joint_name_of(&g->bodies[i]), g->joint_count + i);
    }
    g->tree_count = g->body_count;
    g->loop_count = 0;
    g->joint_at_fault = g->body_at_fault = -1;
    return true;
}

kt_status kt_graph_make(kt_pool *pool, kt_graph *graph, kt_error *error) {
    graph_work w = {.pool = pool, .graph = graph};
    if (!take_graph(&w))
        return kt_builder_out_of_memory(error);
    kt_status status = read_ends(&w, error);
    find_tops(&w);
    if (status == KT_OK)
        status = span_graph(&w, error);
    for (int i = 0; i < graph->joint_count && status == KT_OK; i++) {
        graph->choices[i].joint = graph->joints[i].joint.name;
        status = w.edges[i].is_used ? attach_carried(&w, i, error) : close_graph_loop(&w, i, error);
    }
    return status;
}

static void mark_placed(const kt_body *bodies, int count, bool *is_placed) {
    for (int i = 0; i < count; i++)
        is_placed[i] = bodies[i].parent != NULL || bodies[i].joint.type != KT_JOINT_FIXED;
}

kt_status kt_builder_add_graph(kt_builder *builder, const kt_body *bodies, int body_count, const kt_graph_joint *joints,
                               int joint_count, kt_graph_choice *choices, kt_error *error) {
    if (KT_IS_MISSING(error, builder, bodies || body_count == 0, joints || joint_count == 0))
        return KT_ERROR_ARGUMENT;
    if (body_count < 0 || joint_count < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "", "%d bodies and %d joints; a count cannot be negative",
                            body_count, joint_count);
    kt_graph graph = {.bodies = bodies, .body_count = body_count, .joints = joints, .joint_count = joint_count};
    bool *is_placed = kt_pool_take(&builder->pool, (size_t)body_count + 1, sizeof *is_placed);
    if (is_placed == NULL)
        return kt_builder_out_of_memory(error);
    mark_placed(bodies, body_count, is_placed);
    graph.is_placed = is_placed;
    kt_status status = kt_graph_make(&builder->pool, &graph, error);
    if (status == KT_OK)
        status = kt_builder_reserve(builder, graph.tree_count, graph.loop_count, 0, error);
    if (status != KT_OK)
        return status;
    memcpy(builder->bodies + builder->body_count, graph.tree, (size_t)graph.tree_count * sizeof *graph.tree);
    if (graph.loop_count > 0)
        memcpy(builder->loops + builder->loop_count, graph.loops, (size_t)graph.loop_count * sizeof *graph.loops);
    builder->body_count += graph.tree_count;
    builder->loop_count += graph.loop_count;
    if (choices != NULL && joint_count > 0)
        memcpy(choices, graph.choices, (size_t)joint_count * sizeof *choices);
    return KT_OK;
}
