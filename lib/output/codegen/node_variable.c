/* The variables of formulas, as nodes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/node_effect.h"

code_line kt_code_line_of(const code_effect *e) {
    kt_graph *g = e->tree->graph;
    code_line line = {.d = kt_op3_subtract(g, e->end[1].point, e->end[0].point)};
    line.moving = kt_op3_subtract(g, e->end[1].velocity, e->end[0].velocity);
    line.length = kt_op3_length(g, line.d);
    const kt_op along = kt_op_divide(g, kt_op3_dot(g, line.d, line.moving), line.length);
    line.rate = kt_op_choose(g, line.length, along, kt_op3_length(g, line.moving));
    return line;
}

/* A coordinate of a marker, or its rate, in the world. */
static kt_op marker_variable(const code_effect *e, const kt_variable_record *x) {
    kt_code_tree *tree = e->tree;
    kt_graph *g = tree->graph;
    const kt_op33 *turn = &e->place->turn[x->link];
    kt_op3 arm = kt_op3_of(g, (const double[3]){x->arm.x, x->arm.y, x->arm.z});
    if (x->link > 0) {
        const kt_code_link *l = &tree->link[x->link];
        arm.x[l->link->axis] = kt_op_subtract(g, arm.x[l->link->axis], l->shift);
    }
    for (int b = 0; b < (int)tree->model->n.body; b++) {
        const kt_pose *in = &tree->model->body[b].in_link;
        const kt_vec3 at = kt_mat3_apply_transposed(in->rotation, kt_vec3_sub(x->arm, in->position));
        const int marker = tree->model->body[b].link == x->link ? kt_code_find_marker(tree, b, at) : -1;
        if (marker >= 0)
            arm = kt_code_marker(tree, b, marker);
    }
    const kt_code_speed *s = &e->speed[x->link];
    const kt_op3 at = kt_op3_add(g, e->place->position[x->link], kt_op33_apply(g, turn, arm));
    const kt_op3 rate = kt_op33_apply(g, turn, kt_op3_add(g, s->linear, kt_op3_cross(g, s->omega, arm)));
    return x->type == KT_VARIABLE_MARKER ? at.x[x->component] : rate.x[x->component];
}

/* The forces that balance gravity: the forces of inverse dynamics at rest. */
static kt_op gravity_variable(const code_effect *e, int v) {
    kt_code_tree *tree = e->tree;
    kt_op *tau = kt_graph_take(tree->graph, tree->model->n.v, sizeof *tau);
    if (tau == NULL)
        return 0;
    tree->is_at_rest = tree->graph->is_nameless = true;
    kt_code_inverse(tree, false, tau);
    tree->is_at_rest = tree->graph->is_nameless = false;
    return tau[v];
}

kt_op kt_code_variable(const code_effect *e, const kt_variable_record *x) {
    kt_graph *g = e->tree->graph;
    switch (x->type) {
    case KT_VARIABLE_POSITION:
        return kt_op_input(g, KT_OP_POSITION, x->q);
    case KT_VARIABLE_VELOCITY:
        return kt_op_input(g, KT_OP_RATE, x->v);
    case KT_VARIABLE_MARKER:
    case KT_VARIABLE_MARKER_VELOCITY:
        return marker_variable(e, x);
    case KT_VARIABLE_STATE:
        return kt_op_input(g, KT_OP_OWN_STATE, x->x);
    case KT_VARIABLE_GRAVITY:
        return gravity_variable(e, x->v);
    case KT_VARIABLE_LENGTH:
        return kt_code_line_of(e).length;
    case KT_VARIABLE_SPEED:
        return kt_code_line_of(e).rate;
    default:
        return kt_op_input(g, KT_OP_TIME, 0);
    }
}
