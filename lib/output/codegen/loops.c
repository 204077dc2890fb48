/* The equations of loops as nodes: phi = 0, A v = rate, A a = right.
 *
 * A loop joins two frames. The links of its two paths are followed from their nearest common ancestor, whose origin
 * counts as at rest. All vectors are in the axes of the ancestor. Let P be the point of the second end, and v_i(P),
 * a_i(P) the velocity and the bias acceleration that P has as a point of the body of end i. d leads from the first
 * point to P, and
 *
 *   u = v_2(P) - v_1(P),   d'' seen from the first end = a_2(P) - a_1(P) - 2 w_1 x u =: g
 *
 * Of a wheel that rolls, the first end counts as the second: P is its centre, and far from the second point.
 *
 * These are u and the sum of all accelerations in lib/model/loop/relative_motion.h: a_1(P) contains alpha_1 x d and
 * w_1 x (w_1 x d). So neither A nor the right-hand side needs the point of the first end.
 *
 * The equations follow in loop_rows.c. Couplings and driven joints need no ends:
 *
 *   positions   phi = sum of c q - f(t),   A v = sum of c v = f',   A a = f''
 *   formula F   phi += F(q),   A_k += F_k,   A a = f'' - F_kl v_k v_l
 *   rates       no phi,                    A v = sum of c v = f,    A a = f'
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"
#include "constraint/formula_row.h"
#include "kinetree/loop.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* ---- which loops ------------------------------------------------------------------------------------------------- */

const char *kt_code_switched_fault(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    if (r->friction > 0)
        return "its friction sticks and slips; friction without 'stick' can be generated";
    if (r->side != KT_SIDE_NONE || r->rubs > 0)
        return "it acts on one side only; contacts and stops with a stiffness can be generated";
    return NULL;
}

const char *kt_code_loop_fault(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    if (r->group < 0 || model->variants != NULL)
        return "parts of the mechanism are switched on and off";
    if (r->type == KT_LOOP_CURVE && (r->form == KT_TRACK_HELIX || r->form == KT_TRACK_SPLINE))
        return "the nearest point of a helix or a spline follows from an iteration; a line or a circle can be "
               "generated";
    if (!kt_code_has_loop_type(model, loop))
        return r->type == KT_LOOP_CUSTOM
                   ? "functions in C are not among the types"
                   : "its function or its table has more than 100 rows, its grid more than 400 points, or "
                     "its function follows a parameter that was set";
    if (model->disagreement > 0.0)
        return "its data contradict those of other loops by rounding";
    const kt_group *group = &model->group[r->group];
    int count = 0;
    bool is_known = true; /* a loop of the group without code is a fault of its own */
    for (int i = 0; i < group->loop_count; i++) {
        count += kt_code_rows_of_loop(model, model->group_loop[group->loop + i]);
        is_known = is_known && kt_code_has_loop_type(model, model->group_loop[group->loop + i]);
    }
    return is_known && count != group->rank[KT_ROWS_ALL]
               ? "its equations repeat those of other loops, and the choice among them depends on the position"
               : NULL;
}

const char *kt_code_projection_fault(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    if (r->group < 0)
        return NULL;
    const kt_group *group = &model->group[r->group];
    int count = 0;
    for (int i = 0; i < group->loop_count; i++)
        count += kt_code_closed_rows_of_loop(model, model->group_loop[group->loop + i]);
    return count != group->rank[KT_ROWS_CLOSED]
               ? "equations of positions repeat those of velocities, and were left out with them"
               : NULL;
}

bool kt_code_loops_have_time(const kt_model *model) {
    for (int i = 0; i < (int)model->n.loop; i++)
        if (kt_code_rows_of_loop(model, i) > 0 && model->loop[i].curve.type != KT_FUNCTION_NONE &&
            !kt_curve_rests(&model->loop[i].curve))
            return true;
    return false;
}

int kt_code_count_loop_rows(const kt_model *model) {
    int count = 0;
    for (int i = 0; i < (int)model->n.loop; i++)
        count += kt_code_rows_of_loop(model, i);
    return count;
}

int kt_code_count_closed_rows(const kt_model *model) {
    int count = 0;
    for (int i = 0; i < (int)model->n.loop; i++)
        count += kt_code_closed_rows_of_loop(model, i);
    return count;
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

/* The place of an end in its body. */
static kt_vec3 place_of_loop_end(const kt_model *model, const kt_loop_record *r, int k) {
    const kt_pose *in = &model->body[r->body[k]].in_link;
    return kt_mat3_apply_transposed(in->rotation, kt_vec3_sub(r->frame[k].position, in->position));
}

/* The numbers of a type, which types without numbers do not read. */
typedef struct code_loop_number {
    size_t record, loop; /* where it is in both structs */
    const char *key, *meaning;
    unsigned types; /* bits of kt_loop_type */
} code_loop_number;

#define OF(type) (1u << KT_LOOP_##type)

static const code_loop_number loop_numbers[] = {
    {offsetof(kt_loop_record, pitch), offsetof(kt_code_loop, pitch), "pitch", "of the loop, m/rad", OF(SCREW)},
    {offsetof(kt_loop_record, angle), offsetof(kt_code_loop, angle), "angle", "of the loop at the start, rad",
     OF(SCREW) | OF(HOMOKINETIC)},
    {offsetof(kt_loop_record, radius), offsetof(kt_code_loop, radius), "radius", "of the loop, m",
     OF(ROLLING) | OF(SURFACE) | OF(CURVE)},
    {offsetof(kt_loop_record, tube), offsetof(kt_code_loop, tube), "tube", "of the loop, m", OF(SURFACE)},
};

enum { LOOP_NUMBERS = sizeof loop_numbers / sizeof *loop_numbers };

/* A number of a loop; 0 if its type has none. */
static double number_of_record(const kt_loop_record *r, int k) {
    const code_loop_number *n = &loop_numbers[k];
    double value;
    memcpy(&value, (const char *)r + n->record, sizeof value);
    return r->type < KT_LOOP_TYPE_COUNT && (n->types & 1u << r->type) ? value : 0.0;
}

static void read_loop_numbers(kt_code_tree *tree, const kt_loop_record *r, kt_code_loop *l) {
    for (int k = 0; k < LOOP_NUMBERS; k++) {
        const kt_op number =
            kt_code_number(tree, l->name, loop_numbers[k].key, loop_numbers[k].meaning, number_of_record(r, k));
        memcpy((char *)l + loop_numbers[k].loop, &number, sizeof number);
    }
}

/* Makes the parameters of a loop. A function of time that does not rest has none: its numbers are folded
 * (set_function_of_loop). */
static void read_loop(kt_code_tree *tree, int index) {
    const kt_model *model = tree->model;
    const kt_loop_record *r = &model->loop[index];
    kt_code_loop *l = &tree->loop[index];
    (void)snprintf(l->name, sizeof l->name, "%s", kt_loop_name(model, index));
    for (char *at = l->name; *at != '\0'; at++)
        *at = *at == '-' ? '_' : *at;
    l->value = kt_op_number(tree->graph, 0.0);
    if ((r->type == KT_LOOP_DISTANCE || r->type == KT_LOOP_CURVE) && kt_curve_rests(&r->curve))
        l->value =
            kt_code_curve(tree, &r->curve, l->name, r->type == KT_LOOP_CURVE ? "distance" : "length", "of the loop, m");
    read_loop_numbers(tree, r, l);
    static const char *const key[KT_LOOP_TYPE_COUNT] = {
        [KT_LOOP_COUPLING] = "offset", [KT_LOOP_MOTION] = "position", [KT_LOOP_RATES] = "rate"};
    if (r->term_count > 0 && kt_curve_rests(&r->curve))
        l->value = kt_code_curve(tree, &r->curve, l->name, key[r->type], "of the loop, rad or m, or a second");
    for (int k = 0; k < r->term_count; k++) {
        const kt_term_record *term = &model->term[r->term + k];
        const char *joint = tree->body_name[model->link[term->link].body];
        tree->coefficient[r->term + k] = r->type == KT_LOOP_MOTION
                                             ? kt_op_number(tree->graph, 1.0)
                                             : kt_code_number(tree, l->name, joint, "coefficient", term->coefficient);
    }
    for (int k = 0; k < 2 && r->term_count == 0; k++)
        l->at[k] = kt_code_place_in_link(tree, r->body[k], place_of_loop_end(model, r, k), l->name, k);
}

bool kt_code_read_loops(kt_code_tree *tree) {
    const kt_model *model = tree->model;
    if (tree->loop != NULL || tree->graph->failed)
        return !tree->graph->failed;
    tree->loop = kt_graph_take(tree->graph, model->n.loop + 1, sizeof *tree->loop);
    tree->coefficient = kt_graph_take(tree->graph, model->n.term + 1, sizeof *tree->coefficient);
    kt_graph_section(tree->graph, "numbers of loops");
    tree->loop_length =
        kt_code_number(tree, NULL, "loop_length", "what residuals of loops are relative to, m", model->length);
    for (int i = 0; i < (int)model->n.loop && !tree->graph->failed; i++)
        read_loop(tree, i);
    return !tree->graph->failed;
}

/* The numbers that loop_wheel.c folds. */
static void hash_wheels(const kt_model *model, const kt_loop_record *r, kt_code_hash *hash, uint64_t *h) {
    hash(h, r->gain, sizeof r->gain);
    hash(h, r->bearing, sizeof r->bearing);
    hash(h, r->turned, sizeof r->turned);
    hash(h, &r->sense, sizeof r->sense);
    hash(h, r->phase, sizeof r->phase);
    hash(h, &r->period, sizeof r->period);
    hash(h, &r->slope[1], sizeof r->slope[1]);
    if (r->counted && !kt_loop_is_off(r))
        hash(h, model->number + r->turn, (size_t)(r->length[0] + r->length[1]) * sizeof *model->number);
}

void kt_code_hash_loops(const kt_model *model, kt_code_hash *hash, uint64_t *h) {
    for (int i = 0; i < (int)model->n.loop; i++) {
        const kt_loop_record *r = &model->loop[i];
        const int32_t fixed[5] = {r->type, r->body[0], r->body[1], r->term_count, r->group};
        const int rows = kt_code_rows_of_loop(model, i);
        if (r->type == KT_LOOP_SURFACE || r->type == KT_LOOP_CURVE)
            hash(h, &r->form, sizeof r->form);
        for (int k = 0; k < LOOP_NUMBERS; k++) {
            const int is_zero = number_of_record(r, k) == 0.0;
            if (r->type < KT_LOOP_TYPE_COUNT && loop_numbers[k].types & 1u << r->type)
                hash(h, &is_zero, sizeof is_zero);
        }
        hash(h, fixed, sizeof fixed);
        hash(h, &rows, sizeof rows);
        if (r->type >= KT_LOOP_GEAR && r->type <= KT_LOOP_BELT)
            hash_wheels(model, r, hash, h);
        for (int k = 0; k < r->term_count; k++)
            hash(h, &model->term[r->term + k].link, sizeof model->term->link);
        for (int k = 0; k < 2 && r->term_count == 0; k++) {
            const kt_vec3 at = place_of_loop_end(model, r, k);
            const int32_t zero[3] = {at.x == 0.0, at.y == 0.0, at.z == 0.0};
            hash(h, zero, sizeof zero);
            if (r->type != KT_LOOP_SPHERICAL && r->type != KT_LOOP_DISTANCE)
                hash(h, &r->frame[k].rotation, sizeof r->frame[k].rotation);
        }
        kt_code_hash_curve(model, &r->curve, hash, h);
        if (kt_has_formula_row(r))
            kt_code_hash_formula(kt_loop_formula(model, r), hash, h);
    }
}

/* ---- ends -------------------------------------------------------------------------------------------------------- */

/* The motion of a link from the motion of its parent. */
static void move_loop_link(kt_code_closing *c, int k, int i, const kt_code_frame *frame, kt_op3 offset) {
    kt_code_tree *tree = c->tree;
    kt_graph *g = tree->graph;
    const kt_op33 *own = &c->place->turn[i], *parent = &c->place->turn[tree->link[i].parent];
    kt_op3 spin, shift;
    kt_code_rates(tree, i, KT_OP_RATE, &spin, &shift);
    const kt_op3 w = c->omega[k], turning = kt_op33_apply(g, own, spin);
    const kt_op3 along = kt_op33_apply(g, parent, kt_code_rest_up(g, frame, shift));
    const kt_op3 carried = kt_op3_cross(g, w, offset), twice = kt_op3_scale(g, kt_op_number(g, 2.0), along);
    const kt_op3 inward = kt_op3_cross(g, w, kt_op3_add(g, carried, twice));
    const kt_op3 bias = kt_op3_add(g, kt_op3_cross(g, c->alpha[k], offset), inward);
    c->velocity[k] = kt_op3_add(g, c->velocity[k], kt_op3_add(g, carried, along));
    c->linear[k] = kt_op3_add(g, c->linear[k], bias);
    c->alpha[k] = kt_op3_add(g, c->alpha[k], kt_op3_cross(g, w, turning));
    c->omega[k] = kt_op3_add(g, w, turning);
}

/* Follows the path to an end. */
static void follow_loop_path(kt_code_closing *c, int k) {
    kt_code_tree *tree = c->tree;
    kt_graph *g = tree->graph;
    const kt_loop_record *r = c->record;
    const kt_code_places *at = c->place;
    const int end = c->end[k];
    for (int n = 0; n < r->length[end]; n++) {
        const int i = tree->model->path[r->path[end] + n], up = tree->link[i].parent;
        kt_graph_section(g, "%s: link %d on the way to end %d of %s, in the axes of link %d", tree->link[i].name, i,
                         end + 1, c->number->name, r->ancestor);
        const kt_code_frame frame = kt_code_frame_of(tree, i);
        const kt_op33 own = kt_code_turn_of_frame(g, &frame);
        const kt_op3 offset = kt_op33_apply(g, &at->turn[up], frame.offset);
        at->turn[i] = kt_op33_multiply(g, &at->turn[up], &own);
        at->position[i] = kt_op3_add(g, at->position[up], offset);
        if (c->moves)
            move_loop_link(c, k, i, &frame, offset);
    }
    const int link = r->link[end];
    c->point[k] = kt_op3_add(g, at->position[link], kt_op33_apply(g, &at->turn[link], c->number->at[end]));
    kt_op3_name(g, c->point[k], "e", 2 * (int)(r - tree->model->loop) + end);
    bool unused;
    const kt_op33 frame = kt_code_rotation(g, &r->frame[end].rotation, &unused);
    c->axes[k] = kt_op33_multiply(g, &at->turn[link], &frame);
}

/* The columns of both paths for the point P, the columns of the first path with the opposite sign; 6 x nv. */
static kt_op *make_loop_columns(const kt_code_closing *c) {
    kt_code_tree *tree = c->tree;
    kt_graph *g = tree->graph;
    const kt_loop_record *r = c->record;
    kt_op *column = kt_graph_take(g, 6 * tree->model->n.v, sizeof *column);
    for (size_t i = 0; i < 6 * tree->model->n.v && !g->failed; i++)
        column[i] = kt_op_number(g, 0.0);
    for (int k = 0; k < 2 && !g->failed; k++)
        for (int n = 0; n < r->length[c->end[k]]; n++) {
            const int i = tree->model->path[r->path[c->end[k]] + n];
            kt_code_fill_jacobian(tree, c->place, i, c->point[1], column);
            for (int x = 0; x < 6 * kt_link_dofs(tree->link[i].link) && k == 0; x++) {
                kt_op *entry = column + 6 * tree->link[i].link->v + x;
                *entry = kt_op_negate(g, *entry);
            }
        }
    return column;
}

/* v_i(P) and a_i(P) */
static void move_point(const kt_code_closing *c, int k, kt_op3 *velocity, kt_op3 *linear) {
    kt_graph *g = c->tree->graph;
    const kt_op3 arm = kt_op3_subtract(g, c->point[1], c->place->position[c->record->link[c->end[k]]]);
    const kt_op3 carried = kt_op3_cross(g, c->omega[k], arm), inward = kt_op3_cross(g, c->omega[k], carried);
    const kt_op3 bias = kt_op3_add(g, kt_op3_cross(g, c->alpha[k], arm), inward);
    *velocity = kt_op3_add(g, c->velocity[k], carried);
    *linear = kt_op3_add(g, c->linear[k], bias);
}

/* The angular velocity of the ancestor, in its own axes. */
static kt_op3 omega_of_ancestor(kt_code_tree *tree, int ancestor) {
    kt_op3 omega = kt_op3_zero(tree->graph);
    tree->graph->is_nameless = true; /* other recursions give these names */
    kt_code_speed *all = ancestor > 0 ? kt_code_speeds(tree) : NULL;
    tree->graph->is_nameless = false;
    if (all != NULL)
        omega = all[ancestor].omega;
    return omega;
}

/* The equations of a loop between two ends. The ancestor's origin counts as at rest, but its axes turn. So both paths
 * begin with its angular velocity, and with zero for all other rates. */
static void add_loop_of_ends(kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_graph *g = c->tree->graph;
    static const double unit[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    const int ancestor = c->record->ancestor;
    const kt_op3 zero = kt_op3_zero(g);
    kt_op3 velocity[2] = {zero, zero}, linear[2] = {zero, zero};
    c->end[0] = c->record->type == KT_LOOP_ROLLING; /* rows of a wheel are those of its centre, seen from the plane */
    c->end[1] = 1 - c->end[0];
    c->omega[0] = c->omega[1] = c->moves ? omega_of_ancestor(c->tree, ancestor) : zero;
    for (int k = 0; k < 2; k++)
        c->velocity[k] = c->alpha[k] = c->linear[k] = zero;
    c->u = c->bias = zero;
    c->place->turn[ancestor] = kt_op33_of(g, unit);
    c->place->position[ancestor] = kt_op3_zero(g);
    for (int k = 0; k < 2; k++)
        follow_loop_path(c, k);
    kt_graph_section(g, "%s: A, from the velocities that unit rates give to the second point", c->number->name);
    c->column = make_loop_columns(c);
    if (g->failed)
        return;
    kt_graph_section(g, "%s: u = v_2 - v_1,  a_2 - a_1 - 2 w_1 x u  of the second point", c->number->name);
    for (int k = 0; k < 2 && c->moves; k++)
        move_point(c, k, &velocity[k], &linear[k]);
    if (c->moves) {
        c->u = kt_op3_subtract(g, velocity[1], velocity[0]);
        const kt_op3 swung = kt_op3_cross(g, c->omega[0], c->u);
        const kt_op3 twice = kt_op3_scale(g, kt_op_number(g, 2.0), swung);
        c->bias = kt_op3_subtract(g, kt_op3_subtract(g, linear[1], linear[0]), twice);
    }
    c->d = kt_op3_subtract(g, c->point[1], c->point[0]);
    kt_code_add_end_rows(c, rows);
}

/* Adds the formula F of a coupling: phi += F,  A_k += F_k,  right -= F_kl v_k v_l. */
static void add_loop_formula(kt_code_tree *tree, const kt_loop_record *r, kt_code_loop_rows *rows, int at) {
    kt_graph *g = tree->graph;
    const kt_term_record *term = &tree->model->term[r->term];
    kt_op position[KT_FORMULA_VARIABLE_MAX];
    for (int k = 0; k < r->term_count; k++)
        position[k] = kt_op_input(g, KT_OP_POSITION, tree->link[term[k].link].link->q);
    const kt_op value = kt_code_formula(g, kt_loop_formula(tree->model, r), position);
    kt_op bent = kt_op_number(g, 0.0);
    for (int k = 0; k < r->term_count; k++) {
        const kt_link *link = tree->link[term[k].link].link;
        const kt_op slope = kt_code_rate_of_position(g, value, link), v = kt_op_input(g, KT_OP_RATE, link->v);
        kt_op *entry = &rows->a[(size_t)at * tree->model->n.v + (size_t)link->v], along = kt_op_number(g, 0.0);
        *entry = kt_op_add(g, *entry, slope);
        for (int i = 0; i < r->term_count; i++) {
            const kt_link *other = tree->link[term[i].link].link;
            const kt_op rate = kt_op_input(g, KT_OP_RATE, other->v);
            along = kt_op_add(g, along, kt_op_multiply(g, kt_code_rate_of_position(g, slope, other), rate));
        }
        bent = kt_op_add(g, bent, kt_op_multiply(g, along, v));
    }
    rows->phi[at] = kt_op_add(g, rows->phi[at], value);
    rows->right[at] = kt_op_subtract(g, rows->right[at], bent);
}

/* A relation of positions, sum of c q + F(q) = f(t), or of rates, sum of c v = f(t). */
static void add_relation(kt_code_closing *c, kt_code_loop_rows *rows) {
    kt_code_tree *tree = c->tree;
    kt_graph *g = tree->graph;
    const kt_loop_record *r = c->record;
    const int at = rows->count++;
    kt_graph_section(g, "%s: sum of coefficients and positions - offset", c->number->name);
    rows->loop[at] = (int)(r - tree->model->loop);
    rows->block[at] = at;
    const bool has_positions = r->type != KT_LOOP_RATES;
    rows->is_closed[at] = has_positions;
    rows->phi[at] = has_positions ? kt_op_negate(g, c->function[0]) : kt_op_number(g, 0.0);
    rows->rate[at] = c->function[has_positions ? 1 : 0];
    rows->right[at] = c->function[has_positions ? 2 : 1];
    kt_op scale = kt_op_number(g, 0.0);
    for (size_t v = 0; v < tree->model->n.v; v++)
        rows->a[(size_t)at * tree->model->n.v + v] = rows->size[(size_t)at * tree->model->n.v + v] =
            kt_op_number(g, 0.0);
    for (int k = 0; k < r->term_count; k++) {
        const kt_term_record *term = &tree->model->term[r->term + k];
        const kt_link *link = tree->link[term->link].link;
        kt_op *entry = &rows->a[(size_t)at * tree->model->n.v + (size_t)link->v];
        const kt_op factor = tree->coefficient[r->term + k];
        const kt_op q = kt_op_input(g, KT_OP_POSITION, link->q);
        *entry = kt_op_add(g, *entry, factor);
        if (has_positions)
            rows->phi[at] = kt_op_add(g, rows->phi[at], kt_op_multiply(g, factor, q));
    }
    if (kt_has_formula_row(r))
        add_loop_formula(tree, r, rows, at);
    for (int k = 0; k < r->term_count; k++) {
        const kt_link *link = tree->link[tree->model->term[r->term + k].link].link;
        const kt_op unit = link->motion == KT_MOTION_PRISMATIC ? tree->loop_length : kt_op_number(g, 1.0);
        const kt_op entry = rows->a[(size_t)at * tree->model->n.v + (size_t)link->v];
        scale = kt_op_add(g, scale, kt_op_call(g, KT_OP_ABS, kt_op_multiply(g, entry, unit), -1));
    }
    rows->scaled[at] = kt_op_divide(g, rows->phi[at], scale);
}

/* ---- all loops --------------------------------------------------------------------------------------------------- */

/* A function of time belongs to the function of the file that reads it. */
static void set_function_of_loop(kt_code_closing *c) {
    kt_graph *g = c->tree->graph;
    const bool rests = c->record->curve.type == KT_FUNCTION_NONE || kt_curve_rests(&c->record->curve);
    c->function[0] = rests ? c->number->value : kt_code_curve(c->tree, &c->record->curve, NULL, NULL, NULL);
    for (int k = 1; k < 3; k++)
        c->function[k] = rests ? kt_op_number(g, 0.0) : kt_code_rate_of_time(g, c->function[k - 1]);
}

static void add_code_loop(kt_code_tree *tree, int index, const kt_code_places *place, bool moves,
                          kt_code_loop_rows *rows) {
    kt_graph *g = tree->graph;
    kt_code_closing c = {.tree = tree,
                         .record = &tree->model->loop[index],
                         .number = &tree->loop[index],
                         .place = place,
                         .moves = moves};
    if (kt_code_rows_of_loop(tree->model, index) == 0)
        return; /* others close it */
    kt_graph_section(g, "%s: its function of time", c.number->name);
    set_function_of_loop(&c);
    if (c.record->term_count > 0) {
        add_relation(&c, rows);
        return;
    }
    add_loop_of_ends(&c, rows);
}

void kt_code_make_loop_rows(kt_code_tree *tree, bool moves, kt_code_loop_rows *rows) {
    const size_t count = (size_t)kt_code_count_loop_rows(tree->model) + 1;
    kt_graph *g = tree->graph;
    *rows = (kt_code_loop_rows){.loop = kt_graph_take(g, count, sizeof *rows->loop),
                                .a = kt_graph_take(g, count * (tree->model->n.v + 1), sizeof *rows->a),
                                .phi = kt_graph_take(g, count, sizeof *rows->phi),
                                .scaled = kt_graph_take(g, count, sizeof *rows->scaled),
                                .rate = kt_graph_take(g, count, sizeof *rows->rate),
                                .right = kt_graph_take(g, count, sizeof *rows->right),
                                .is_closed = kt_graph_take(g, count, sizeof *rows->is_closed),
                                .block = kt_graph_take(g, count, sizeof *rows->block),
                                .size = kt_graph_take(g, count * (tree->model->n.v + 1), sizeof *rows->size)};
    const kt_code_places place = kt_code_no_places(tree);
    for (int i = 0; i < (int)tree->model->n.loop && kt_code_read_loops(tree); i++)
        add_code_loop(tree, i, &place, moves, rows);
}
