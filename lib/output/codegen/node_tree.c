/* Reads a model into links of nodes.
 *
 * A body of mass m with centre of mass c' and inertia I about c', in its own axes, lies in its link with the rotation R
 * and the position p. The body adds to the link, with c = p + R c',
 *
 *   m,   m c,   R I R' + m (c . c 1 - c c')
 *
 * Base parameters (Gautier & Khalil 1990): a link that rotates about its axis k moves its mass on the axis, and an
 * inertia t (1 - e_k e_k'), without an effect on the joint. These parts are the parent's. Two of its nine numbers
 * vanish, and its inertia is J_ii - J_jj. A spherical joint gives its mass to the parent, a prismatic one its inertia.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/node_tree.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- parameters -------------------------------------------------------------------------------------------------- */

kt_op kt_code_number(kt_code_tree *tree, const char *prefix, const char *suffix, const char *meaning, double value) {
    if (value == 0.0 || tree->constant || tree->graph->failed)
        return kt_op_number(tree->graph, value);
    kt_code_parameter *larger = kt_pool_grow(&tree->graph->pool, tree->parameter, (size_t)tree->parameter_count, 1,
                                             &tree->parameter_room, sizeof *larger);
    tree->graph->failed |= larger == NULL;
    if (larger == NULL)
        return 0;
    tree->parameter = larger;
    kt_code_parameter *p = &tree->parameter[tree->parameter_count];
    *p = (kt_code_parameter){.meaning = meaning, .value = value};
    const int length =
        snprintf(p->name, sizeof p->name, "%s%s%s", prefix != NULL ? prefix : "", prefix != NULL ? "_" : "", suffix);
    for (int other = 0, number = 2; other < tree->parameter_count; other++)
        if (strcmp(tree->parameter[other].name, p->name) == 0) {
            (void)snprintf(p->name + length, sizeof p->name - (size_t)length, "_%d", number++);
            other = -1;
        }
    return kt_op_parameter(tree->graph, tree->parameter_count++);
}

static kt_op make_parameter(kt_code_tree *tree, int body, const char *suffix, const char *meaning, double value) {
    return kt_code_number(tree, body > 0 ? tree->body_name[body] : NULL, suffix, meaning, value);
}

kt_op3 kt_code_numbers(kt_code_tree *tree, const char *prefix, const char *suffix, const char *meaning,
                       const double value[3]) {
    kt_op3 out;
    for (int k = 0; k < 3; k++) {
        char text[KT_CODE_NAME];
        (void)snprintf(text, sizeof text, "%s_%c", suffix, "xyz"[k]);
        out.x[k] = kt_code_number(tree, prefix, text, meaning, value[k]);
    }
    return out;
}

static kt_op3 make_parameters(kt_code_tree *tree, int body, const char *suffix, const char *meaning, kt_vec3 value) {
    const double x[3] = {value.x, value.y, value.z};
    return kt_code_numbers(tree, body > 0 ? tree->body_name[body] : NULL, suffix, meaning, x);
}

/* Writes names of bodies as identifiers, no two of which are equal. */
static void name_code_bodies(kt_code_tree *tree) {
    for (int b = 0; b < (int)tree->model->n.body; b++) {
        char *name = tree->body_name[b];
        (void)snprintf(name, KT_CODE_BODY_NAME, "%s", kt_body_name(tree->model, b));
        for (char *at = name; *at != '\0'; at++)
            *at = *at == '-' ? '_' : *at;
        const size_t length = strlen(name);
        for (int other = 0, number = 2; other < b; other++)
            if (strcmp(tree->body_name[other], name) == 0) {
                (void)snprintf(name + length, KT_CODE_NAME - length, "_%d", number++);
                other = -1;
            }
    }
}

/* ---- numbers of the model ---------------------------------------------------------------------------------------- */

/* A number of a rotation: becomes exactly 0, 1 or -1 if it differs from this value only by rounding. */
static double snap_number(double x) {
    const double near = nearbyint(x);
    return fabs(x - near) <= 4.0 * 2.220446049250313e-16 ? near + 0.0 : x;
}

kt_op33 kt_code_rotation(kt_graph *g, const kt_mat3 *r, bool *is_rotated) {
    const double m[3][3] = {{snap_number(r->x.x), snap_number(r->y.x), snap_number(r->z.x)},
                            {snap_number(r->x.y), snap_number(r->y.y), snap_number(r->z.y)},
                            {snap_number(r->x.z), snap_number(r->y.z), snap_number(r->z.z)}};
    *is_rotated = m[0][0] != 1.0 || m[1][1] != 1.0 || m[2][2] != 1.0;
    return kt_op33_of(g, m);
}

void kt_code_add_rigid(kt_graph *g, kt_code_link *to, kt_op m, kt_op3 h, const kt_op6 *j, kt_op3 r) {
    const kt_op3 moved = kt_op3_scale(g, m, r);
    /* J + m (r . r 1 - r r') + 2 r . h 1 - r h' - h r' */
    const kt_op3 mean = kt_op3_add(g, h, kt_op3_scale(g, kt_op_number(g, 0.5), moved));
    const kt_op6 shift = kt_op6_inertia_of(g, r, mean);
    const kt_op6 early = kt_op6_add(g, &to->inertia, &shift); /* the inertia of the child is the last to be known */
    to->mass = kt_op_add(g, to->mass, m);
    to->moment = kt_op3_add(g, to->moment, kt_op3_add(g, h, moved));
    to->inertia = kt_op6_add(g, &early, j);
}

/* Adds a body to its link. The pose of the body in the link is known. */
static void load_body(kt_code_tree *tree, int b) {
    static const char *const part[6] = {"inertia_xx", "inertia_yy", "inertia_zz",
                                        "inertia_xy", "inertia_xz", "inertia_yz"};
    const kt_body_record *body = &tree->model->body[b];
    const double value[6] = {body->inertia.xx, body->inertia.yy, body->inertia.zz,
                             body->inertia.xy, body->inertia.xz, body->inertia.yz};
    kt_graph *g = tree->graph;
    kt_code_link *l = &tree->link[body->link];
    const kt_op mass = make_parameter(tree, b, "mass", "kg", body->mass);
    kt_op3 com = kt_op3_zero(g);
    kt_op6 inertia;
    if (body->mass != 0.0)
        com = make_parameters(tree, b, "com", "centre of mass, body frame, m", body->com);
    for (int k = 0; k < 6; k++)
        inertia.x[k] = make_parameter(tree, b, part[k], "about the centre of mass, body axes, kg m^2", value[k]);
    kt_graph_section(g, "%s: mass, first moment and inertia about the origin of its link", l->name);
    const kt_op3 at = kt_op3_add(g, tree->body_position[b], kt_op33_apply(g, &tree->body_rotation[b], com));
    const kt_op6 turned = kt_op6_rotate(g, &tree->body_rotation[b], &inertia);
    kt_code_add_rigid(g, l, mass, kt_op3_zero(g), &turned, at);
}

/* Reads a link: its frame at rest, and the numbers of its joint. */
static void read_link(kt_code_tree *tree, int i) {
    const kt_model *model = tree->model;
    const kt_link *link = &model->link[i];
    const kt_body_record *body = &model->body[link->body];
    kt_code_link *l = &tree->link[i];
    const kt_mat3 identity = kt_mat3_identity();
    kt_graph *g = tree->graph;
    l->link = link;
    l->parent = link->parent;
    l->name = kt_joint_name(model, link->body);
    l->rest = kt_code_rotation(g, link->rest_is_rotated ? &kt_link_rest_of(link)->axes : &identity, &l->is_rotated);
    l->at = kt_op3_zero(g);
    l->pitch = make_parameter(tree, link->body, "pitch", "m/rad", kt_link_pitch(link));
    const bool is_first = link->parent == 0 || model->link[link->parent].body != link->body;
    if (is_first) {
        const int up = body->parent;
        const kt_op3 at = make_parameters(tree, link->body, "at", "origin of the joint frame, parent's body frame, m",
                                          body->joint.position);
        l->at = kt_op3_add(g, tree->body_position[up], kt_op33_apply(g, &tree->body_rotation[up], at));
    }
    for (int k = 0; k < kt_link_dofs(link); k++) {
        char name[32] = "armature";
        if (kt_body_coordinates(model, link->body).nv > 1)
            (void)snprintf(name, sizeof name, "armature_%d", link->v - body->v + k + 1);
        l->armature[k] = make_parameter(tree, link->body, name, "kg m^2 or kg", model->armature[link->v + k]);
    }
}

/* Places a body in its link. */
static void place_body(kt_code_tree *tree, int b) {
    const kt_body_record *body = &tree->model->body[b];
    kt_graph *g = tree->graph;
    bool unused;
    tree->body_rotation[b] = kt_code_rotation(g, &body->in_link.rotation, &unused);
    tree->body_position[b] = kt_op3_zero(g);
    if (b == 0 || body->type != KT_JOINT_FIXED)
        return;
    const int up = body->parent;
    const kt_op3 at =
        make_parameters(tree, b, "at", "origin of the joint frame, parent's body frame, m", body->joint.position);
    tree->body_position[b] = kt_op3_add(g, tree->body_position[up], kt_op33_apply(g, &tree->body_rotation[up], at));
}

kt_op3 kt_code_marker(kt_code_tree *tree, int body, int marker) {
    kt_graph *g = tree->graph;
    kt_op3 *known = &tree->marker[tree->model->body[body].marker + marker];
    char name[KT_CODE_BODY_NAME];
    if (known->x[0] >= 0)
        return *known;
    (void)snprintf(name, sizeof name, "marker_%s", kt_marker_name(tree->model, body, marker));
    for (char *at = name; *at != '\0'; at++)
        *at = *at == '-' ? '_' : *at;
    const kt_op3 at = make_parameters(tree, body, name, "body frame, m", kt_marker_at(tree->model, body, marker));
    *known = kt_op3_add(g, tree->body_position[body], kt_op33_apply(g, &tree->body_rotation[body], at));
    return *known;
}

int kt_code_find_marker(const kt_code_tree *tree, int body, kt_vec3 at) {
    for (int k = 0; k < tree->model->body[body].marker_count; k++) {
        const kt_vec3 apart = kt_vec3_sub(kt_marker_at(tree->model, body, k), at);
        if (kt_vec3_norm(apart) <= 8.0 * 2.220446049250313e-16 * kt_vec3_norm(at))
            return k;
    }
    return -1;
}

kt_op3 kt_code_place_in_link(kt_code_tree *tree, int body, kt_vec3 at, const char *name, int end) {
    kt_graph *g = tree->graph;
    const int marker = kt_vec3_norm(at) > 0.0 ? kt_code_find_marker(tree, body, at) : -1;
    if (marker >= 0)
        return kt_code_marker(tree, body, marker);
    const double value[3] = {at.x, at.y, at.z};
    const kt_op3 own = kt_code_numbers(tree, name, end == 0 ? "at" : "at2", "body frame, m", value);
    return kt_op3_add(g, tree->body_position[body], kt_op33_apply(g, &tree->body_rotation[body], own));
}

/* The order of magnitude of the inertia that a link carries, as compile/build.c; a sum replaces the largest shift. */
static void size_code_links(kt_code_tree *tree) {
    kt_graph *g = tree->graph;
    const size_t count = (size_t)tree->link_count;
    kt_op *sum = kt_graph_take(g, 3 * count, sizeof *sum); /* mass, trace, shift */
    if (sum == NULL)
        return;
    for (size_t i = 0; i < 3 * count; i++)
        sum[i] = kt_op_number(g, 0.0);
    for (int i = tree->link_count - 1; i > 0; i--) {
        kt_code_link *l = &tree->link[i];
        kt_op *own = sum + 3 * i, *up = sum + 3 * l->parent;
        kt_graph_section(g, "%s: size of the inertia that the joint carries", l->name);
        const kt_op trace = kt_op_add(g, kt_op_add(g, l->inertia.x[0], l->inertia.x[1]), l->inertia.x[2]);
        own[0] = kt_op_add(g, own[0], l->mass);
        own[1] = kt_op_add(g, own[1], trace);
        const kt_op turning = kt_op_add(g, own[1], own[2]);
        const kt_op pitch = kt_op_multiply(g, kt_op_multiply(g, l->pitch, l->pitch), own[0]);
        l->carried = own[0];
        l->size = kt_op_add(g, turning, pitch);
        const kt_op step = kt_op_multiply(g, own[0], kt_op3_dot(g, l->at, l->at));
        up[0] = kt_op_add(g, up[0], own[0]);
        up[1] = kt_op_add(g, up[1], own[1]);
        up[2] = kt_op_add(g, up[2], kt_op_add(g, own[2], step));
    }
}

/* Finds, for each coordinate, the next coordinate on the way to the ground. */
static void chain_coordinates(kt_code_tree *tree) {
    for (int i = 1; i < tree->link_count; i++) {
        const kt_link *link = tree->link[i].link;
        const kt_link *parent = link->parent > 0 ? tree->link[link->parent].link : NULL;
        int32_t before = parent != NULL ? parent->v + kt_link_dofs(parent) - 1 : -1;
        for (int k = 0; k < kt_link_dofs(link); k++) {
            tree->before[link->v + k] = before;
            before = link->v + k;
        }
    }
}

bool kt_code_tree_read(kt_code_tree *tree, const kt_model *model, kt_graph *graph, bool constant) {
    const size_t bodies = model->n.body, links = model->n.link;
    *tree = (kt_code_tree){.model = model, .graph = graph, .constant = constant, .link_count = (int)links};
    tree->link = kt_graph_take(graph, links, sizeof *tree->link);
    tree->body_rotation = kt_graph_take(graph, bodies, sizeof *tree->body_rotation);
    tree->body_position = kt_graph_take(graph, bodies, sizeof *tree->body_position);
    tree->body_name = kt_graph_take(graph, bodies, sizeof *tree->body_name);
    tree->before = kt_graph_take(graph, model->n.v + 1, sizeof *tree->before);
    tree->marker = kt_graph_take(graph, model->n.marker + 1, sizeof *tree->marker);
    if (graph->failed)
        return false;
    name_code_bodies(tree);
    for (size_t i = 0; i < model->n.marker; i++)
        tree->marker[i].x[0] = -1;
    kt_graph_section(graph, "numbers");
    tree->gravity = make_parameters(tree, 0, "gravity", "world axes, m/s^2", kt_model_gravity(model));
    for (size_t i = 0; i < links; i++) {
        kt_code_link *l = &tree->link[i];
        l->mass = l->size = l->carried = l->pitch = l->shift = kt_op_number(graph, 0.0);
        l->moment = kt_op3_zero(graph);
        l->inertia = kt_op6_zero(graph);
    }
    for (int b = 0; b < (int)bodies; b++) {
        place_body(tree, b);
        for (int i = 1; i < (int)links; i++)
            if (b > 0 && model->link[i].body == b)
                read_link(tree, i);
        if (b > 0 && model->body[b].link > 0)
            load_body(tree, b);
    }
    chain_coordinates(tree);
    size_code_links(tree);
    return !graph->failed;
}

/* ---- base parameters --------------------------------------------------------------------------------------------- */

void kt_code_tree_regroup(kt_code_tree *tree) {
    kt_graph *g = tree->graph;
    for (int c = tree->link_count - 1; c > 0; c--) {
        kt_code_link *l = &tree->link[c];
        const int k = l->link->axis, i = kt_op6_index((k + 1) % 3, (k + 1) % 3),
                  j = kt_op6_index((k + 2) % 3, (k + 2) % 3);
        const kt_op zero = kt_op_number(g, 0.0);
        kt_op mass = zero;
        kt_op3 moment = kt_op3_zero(g);
        kt_op6 inertia = kt_op6_zero(g);
        kt_graph_section(g, "%s: what its joint cannot distinguish from the parent is the parent's", l->name);
        switch (kt_code_motion(l)) {
        case KT_MOTION_REVOLUTE:
            mass = l->mass;
            moment.x[k] = l->moment.x[k];
            inertia.x[i] = inertia.x[j] = l->inertia.x[j];
            l->moment.x[k] = zero;
            l->inertia.x[i] = kt_op_subtract(g, l->inertia.x[i], l->inertia.x[j]);
            l->inertia.x[j] = l->mass = zero;
            break;
        case KT_MOTION_SPHERICAL:
            mass = l->mass;
            l->mass = zero;
            break;
        case KT_MOTION_PRISMATIC:
            inertia = l->inertia;
            l->inertia = kt_op6_zero(g);
            break;
        default:
            continue;
        }
        const kt_op33 *rest = &l->rest;
        const kt_op6 turned = kt_op6_rotate(g, rest, &inertia);
        kt_code_add_rigid(g, &tree->link[l->parent], mass, kt_op33_apply(g, rest, moment), &turned, l->at);
    }
}
