/* Joint forces of effects, as nodes. Each type has the formula of its file in lib/model/effect.
 *
 * An effect with ends exerts a moment m and a force f on each, in world axes. With R the rotation of the end's link,
 * and c the end in the link's axes, the link carries the wrench f' = R'f, n' = R'm + c x f' about its origin. Each
 * joint has the force s . (n, f) of all wrenches beyond the joint, and passes (n, f) to its parent, as in inverse
 * dynamics.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

#include "codegen/node_effect.h"
#include "kinetree/descriptor.h"

#include <stdio.h>
#include <string.h>

/* ---- which effects ----------------------------------------------------------------------------------------------- */

const char *kt_code_effect_fault(const kt_model *model, const kt_effect_record *effect) {
    const bool is_hard = (effect->hard || effect->direction != 0.0 || effect->loops > 0);
    if (effect->type == KT_EFFECT_CUSTOM || effect->law != NULL)
        return "its force is a function in C";
    if (effect->load_slot > 0)
        return "its friction is proportional to a reaction";
    if (effect->path_count > 0)
        return "it acts along a path";
    if (is_hard || effect->relative.type != 0)
        return "it acts in a loop, or counts as one";
    for (int k = 0; k < 3; k++)
        if (!kt_code_has_curve(model, &effect->curve[k]))
            return "its function of time has more than 100 rows, or follows a parameter that was set";
    for (int k = 0; k < 6; k++)
        if (effect->formula[k] > 0 && !kt_code_has_tables(kt_code_formula_of(model, effect, k)))
            return "its formula calls a table of more than 100 rows, or of more than 400 points of a grid";
    return NULL;
}

static bool reads_time(const kt_model *model, const kt_effect_record *e) {
    for (int k = 0; k < 3; k++)
        if (!kt_curve_rests(&e->curve[k]))
            return true;
    for (int k = 0; k < e->variable_count; k++)
        if (model->variable[e->variable + k].type == KT_VARIABLE_TIME)
            return true;
    return false;
}

bool kt_code_has_time(const kt_model *model) {
    for (size_t i = 0; i < model->n.effect; i++)
        if (reads_time(model, &model->effect[i]))
            return true;
    for (size_t i = 0; i < model->n.x; i++)
        if (reads_time(model, &model->state[i]))
            return true;
    return false;
}

/* Which numbers are zero or infinite. */
static void hash_kinds(const double *x, int count, kt_code_hash *hash, uint64_t *h) {
    for (int i = 0; i < count; i++) {
        const int kind = x[i] == 0.0 ? 0 : isinf(x[i]) ? 2 : 1;
        hash(h, &kind, sizeof kind);
    }
}

/* Adds what formulas fold: indices, and which numbers of the arms are zero. */
static void hash_variables(const kt_model *model, const kt_effect_record *e, kt_code_hash *hash, uint64_t *h) {
    for (int k = 0; k < e->variable_count; k++) {
        const kt_variable_record *x = &model->variable[e->variable + k];
        const int32_t fixed[6] = {x->type, x->q, x->v, x->link, x->component, x->x};
        const double arm[3] = {x->arm.x, x->arm.y, x->arm.z};
        hash(h, fixed, sizeof fixed);
        hash_kinds(arm, 3, hash, h);
    }
    for (int k = 0; k < 6; k++)
        if (e->formula[k] > 0)
            kt_code_hash_formula(kt_code_formula_of(model, e, k), hash, h);
}

void kt_code_hash_effects(const kt_model *model, kt_code_hash *hash, uint64_t *h) {
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *e = &model->effect[i];
        const int32_t fixed[5] = {e->type, e->ends, e->link[0], e->link[1], e->in_body};
        const double number[] = {
#define CODE_EFFECT_NUMBER(member) e->member,
            KT_EFFECT_NUMBERS(CODE_EFFECT_NUMBER)
#undef CODE_EFFECT_NUMBER
                e->exhaust.x,
            e->exhaust.y,
            e->exhaust.z,
        };
        hash(h, fixed, sizeof fixed);
        hash_kinds(number, (int)(sizeof number / sizeof *number), hash, h);
        hash_kinds(e->stiffnesses, 6, hash, h);
        hash_kinds(e->dampings, 6, hash, h);
        hash_kinds(e->quadratics, 6, hash, h);
        for (int k = 0; k < e->ends; k++) {
            const double arm[3] = {e->arm[k].x, e->arm[k].y, e->arm[k].z};
            hash(h, &e->frame[k].rotation, sizeof e->frame[k].rotation);
            hash_kinds(arm, 3, hash, h);
        }
        for (int k = 0; k < 3; k++)
            kt_code_hash_curve(model, &e->curve[k], hash, h);
        hash_variables(model, e, hash, h);
    }
    for (size_t i = 0; i < model->n.x; i++)
        hash_variables(model, &model->state[i], hash, h);
}

/* ---- ends -------------------------------------------------------------------------------------------------------- */

/* The beginning of the names of an effect's parameters: its name, or its joint's or body's and its type. */
static void name_effect(code_effect *e) {
    const kt_model *model = e->tree->model;
    const kt_effect_record *r = e->record;
    const char *type = kt_effect_descriptor((kt_effect_type)r->type)->name;
    if (r->name > 0)
        (void)snprintf(e->name, KT_CODE_BODY_NAME, "%s", model->text + r->name);
    else
        (void)snprintf(e->name, KT_CODE_NAME, "%s_%s", e->tree->body_name[r->body[r->ends - (r->ends > 0)]],
                       strncmp(type, "joint_", 6) == 0 ? type + 6 : type);
    for (char *at = e->name; *at != '\0'; at++)
        *at = *at == '-' ? '_' : *at;
}

/* The place of an end in its link: the position of a marker, or separate numbers, in the axes of its body. */
static kt_op3 place_of_end(const code_effect *e, int k) {
    const kt_effect_record *r = e->record;
    const int body = r->body[k];
    const kt_vec3 at = kt_mat3_apply_transposed(e->tree->model->body[body].in_link.rotation, r->arm[k]);
    return kt_code_place_in_link(e->tree, body, at, e->name, k);
}

/* The point, velocity and axes of an end in the world, from the link that has the end. */
static void move_end(code_effect *e, int k) {
    kt_graph *g = e->tree->graph;
    code_end *end = &e->end[k];
    bool unused;
    end->link = e->record->link[k];
    const kt_op33 *turn = &e->place->turn[end->link];
    const kt_code_speed *speed = &e->speed[end->link];
    const kt_op33 frame = kt_code_rotation(g, &e->record->frame[k].rotation, &unused);
    end->arm = place_of_end(e, k);
    end->axes = kt_op33_multiply(g, turn, &frame);
    end->point = kt_op3_add(g, e->place->position[end->link], kt_op33_apply(g, turn, end->arm));
    end->omega = kt_op33_apply(g, turn, speed->omega);
    end->velocity = kt_op33_apply(g, turn, kt_op3_add(g, speed->linear, kt_op3_cross(g, speed->omega, end->arm)));
}

/* ---- joint forces ------------------------------------------------------------------------------------------------ */

/* Adds the wrench on an end to the wrench on its link. */
static void load_end(const code_effect *e, int k, code_load *load) {
    kt_graph *g = e->tree->graph;
    const code_end *end = &e->end[k];
    const kt_op33 *turn = &e->place->turn[end->link];
    const kt_op3 force = kt_op33_apply_transposed(g, turn, e->force[k]);
    const kt_op3 moment = kt_op33_apply_transposed(g, turn, e->moment[k]);
    code_load *on = &load[end->link];
    on->force = kt_op3_add(g, on->force, force);
    on->moment = kt_op3_add(g, on->moment, kt_op3_add(g, moment, kt_op3_cross(g, end->arm, force)));
}

/* Computes the joint forces of the wrenches on links, and passes the wrenches on to the ground. */
static void pass_loads(kt_code_tree *tree, code_load *load, kt_op *tau) {
    kt_graph *g = tree->graph;
    for (int i = tree->link_count - 1; i > 0; i--) {
        const kt_link *link = tree->link[i].link;
        code_load *own = &load[i], *up = &load[tree->link[i].parent];
        kt_op force[KT_DOF_MAX];
        kt_graph_section(g, "%s: tau = s . (n, f);  the parent carries f and n + r x f", tree->link[i].name);
        const kt_code_frame frame = kt_code_frame_of(tree, i);
        kt_code_project(tree, &frame, own->moment, own->force, force);
        for (int k = 0; k < kt_link_dofs(link); k++)
            tau[link->v + k] = kt_op_add(g, tau[link->v + k], force[k]);
        const kt_op3 f = kt_code_up(g, &frame, own->force), r_f = kt_op3_cross(g, frame.offset, f);
        const kt_op3 n = kt_op3_add(g, kt_code_up(g, &frame, own->moment), r_f);
        up->force = kt_op3_add(g, up->force, f);
        up->moment = kt_op3_add(g, up->moment, n);
    }
}

/* An effect in a joint adds to tau. An effect at ends adds to the wrenches of links, of which pass_loads() makes joint
 * forces. */
static void add_effect(code_effect *e, code_load *load, kt_op *tau) {
    kt_graph *g = e->tree->graph;
    const kt_effect_record *r = e->record;
    const kt_descriptor *descriptor = kt_effect_descriptor((kt_effect_type)r->type);
    name_effect(e);
    const char *const law = descriptor->formula, *const words = strstr(law, "    ");
    kt_graph_section(g, "%s: %.*s", r->name > 0 ? e->tree->model->text + r->name : e->name,
                     (int)(words != NULL ? (size_t)(words - law) : strlen(law)), law);
    if (r->ends == 0) {
        const kt_op q = kt_op_input(g, KT_OP_POSITION, e->tree->model->link[r->link[0]].q);
        const int v = e->tree->model->link[r->link[0]].v;
        tau[v] = kt_op_add(g, tau[v], kt_code_joint_force(e, q, kt_op_input(g, KT_OP_RATE, v)));
        return;
    }
    for (int k = 0; k < r->ends; k++) {
        move_end(e, k);
        e->force[k] = e->moment[k] = kt_op3_zero(g);
    }
    kt_code_wrench(e);
    for (int k = 0; k < r->ends; k++)
        load_end(e, k, load);
}

static void make_code_effects(kt_code_tree *tree, kt_op *tau) {
    kt_graph *g = tree->graph;
    code_load *load = kt_graph_take(g, (size_t)tree->link_count, sizeof *load);
    kt_code_speed *speed = kt_code_speeds(tree);
    const kt_code_places place = kt_code_place_links(tree);
    for (int i = 0; i < tree->link_count && !g->failed; i++)
        load[i].force = load[i].moment = kt_op3_zero(g);
    for (size_t i = 0; i < tree->model->n.v; i++)
        tau[i] = kt_op_number(g, 0.0);
    for (size_t i = 0; i < tree->model->n.effect && !g->failed; i++) {
        code_effect effect = {.tree = tree, .record = &tree->model->effect[i], .speed = speed, .place = &place};
        add_effect(&effect, load, tau);
    }
    if (!g->failed)
        pass_loads(tree, load, tau);
}

/* Makes the forces once, since their parameters exist once. Returns false if memory is insufficient. */
static bool know_effects(kt_code_tree *tree) {
    if (tree->force == NULL) {
        tree->force = kt_graph_take(tree->graph, tree->model->n.v, sizeof *tree->force);
        if (tree->force != NULL)
            make_code_effects(tree, tree->force);
    }
    return !tree->graph->failed;
}

void kt_code_effects(kt_code_tree *tree, kt_op *tau) {
    if (know_effects(tree))
        memcpy(tau, tree->force, tree->model->n.v * sizeof *tau);
}

void kt_code_effect_derivatives(kt_code_tree *tree, kt_op *out) {
    if (know_effects(tree))
        kt_code_differentiate(tree, tree->force, (int)tree->model->n.v, out);
}

void kt_code_states(kt_code_tree *tree, kt_op *rate) {
    kt_code_speed *speed = kt_code_speeds(tree);
    const kt_code_places place = kt_code_place_links(tree);
    for (size_t i = 0; i < tree->model->n.x && !tree->graph->failed; i++) {
        const kt_effect_record *record = &tree->model->state[i];
        const code_effect state = {.tree = tree, .record = record, .speed = speed, .place = &place};
        kt_graph_section(tree->graph, "state %s: its rate", tree->model->text + record->name);
        rate[i] = kt_code_formula_value(&state, 0);
    }
}
