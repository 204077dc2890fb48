/* Joint forces of effects, as nodes. Each type has the formula of its file in lib/effect. */
#include "codegen/recursion.h"
#include "model/function.h"

#include <stdio.h>

bool kt_code_has_effect(const kt_effect_record *effect) {
    if (effect->ends != 0 || effect->relative.type != 0)
        return false;
    return effect->type == KT_EFFECT_JOINT_DAMPER ||
           (effect->type == KT_EFFECT_JOINT_SPRING && kt_curve_rests(&effect->curve[0]));
}

/* The beginning of the names of an effect's parameters: its name, or its joint's and its type. */
static void name_effect(const kt_code_tree *tree, const kt_effect_record *effect, char name[KT_CODE_NAME]) {
    const kt_model *model = tree->model;
    const char *type = effect->type == KT_EFFECT_JOINT_SPRING ? "spring" : "damper";
    if (effect->name > 0)
        (void)snprintf(name, KT_CODE_BODY_NAME, "%s", model->text + effect->name);
    else
        (void)snprintf(name, KT_CODE_NAME, "%s_%s", tree->body_name[model->link[effect->link[0]].body], type);
    for (char *at = name; *at != '\0'; at++)
        *at = *at == '-' ? '_' : *at;
}

/* force = -k (q - r) - c v */
static kt_op effect_force(kt_code_tree *tree, const kt_effect_record *effect) {
    kt_graph *g = tree->graph;
    const kt_link *link = &tree->model->link[effect->link[0]];
    char name[KT_CODE_NAME];
    name_effect(tree, effect, name);
    const kt_op c = kt_code_number(tree, name, "damping", "N m s/rad or N s/m", effect->damping);
    kt_op force = kt_op_multiply(g, c, kt_op_input(g, KT_OP_RATE, link->v));
    if (effect->type == KT_EFFECT_JOINT_SPRING) {
        const double rest = effect->curve[0].type == KT_FUNCTION_CONSTANT ? effect->curve[0].a : 0.0;
        const kt_op k = kt_code_number(tree, name, "stiffness", "N m/rad or N/m", effect->stiffness);
        const kt_op r = kt_code_number(tree, name, "rest", "rad or m", rest);
        const kt_op stretch = kt_op_subtract(g, kt_op_input(g, KT_OP_POSITION, link->q), r);
        force = kt_op_add(g, kt_op_multiply(g, k, stretch), force);
    }
    return kt_op_negate(g, force);
}

void kt_code_effects(kt_code_tree *tree, kt_op *tau) {
    const kt_model *model = tree->model;
    for (size_t i = 0; i < model->n.v; i++)
        tau[i] = kt_op_number(tree->graph, 0.0);
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        const kt_link *link = &model->link[effect->link[0]];
        kt_graph_section(tree->graph, "%s: force = -k (q - r) - c v", kt_joint_name(model, link->body));
        tau[link->v] = kt_op_add(tree->graph, tau[link->v], effect_force(tree, effect));
    }
}
