/* The plan of a scene as a list: the kernels that run, their phase and their number of items. Kernels that are left out
 * are listed with the reason.
 *
 * This file decides nothing. Items that a scene does not name have no entries in the model's arrays, over which the
 * kernels loop. Whole passes are skipped when a count is zero. This file reads the same counts.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/group.h"
#include "integrator/integrator.h"
#include "model/model.h"
#include "simulation/simulation.h"

typedef struct list {
    kt_plan_step *step;
    int count;
} list;

static void add_plan_line(list *l, kt_phase phase, const char *name, size_t count, const char *unit) {
    l->step[l->count++] = (kt_plan_step){.phase = phase, .name = name, .count = (int64_t)count, .unit = unit};
}

/* Adds a step; if its count is zero, the step is listed as left out, with the reason. */
static void add_or_drop(list *l, kt_phase phase, const char *name, size_t count, const char *unit, const char *why) {
    add_plan_line(l, phase, name, count, unit);
    l->step[l->count - 1].dropped = count > 0 ? NULL : why;
}

/* ---- every evaluation -------------------------------------------------------------------------------------------- */

static const char *effect_type_name(int type) {
#define PLAN_EFFECT(id, name) [id] = "effect " #name,
    static const char *const names[KT_EFFECT_TYPE_COUNT] = {KT_EFFECT_LIST(PLAN_EFFECT)};
#undef PLAN_EFFECT
    return type == KT_EFFECT_CUSTOM ? "effect of the caller's" : names[type];
}

/* Adds the batches of effects with ends (`ends`), or of effects on joints (not `ends`); returns their number. */
static int add_batches(list *l, const kt_model *model, bool ends) {
    int count = 0;
    for (size_t i = 0; i < model->n.batch; i++) {
        const kt_effect_batch *batch = &model->batch[i];
        if ((batch->ends > 0) != ends)
            continue;
        add_plan_line(l, KT_PHASE_EVALUATION, effect_type_name(batch->type), (size_t)batch->count, "effects");
        count++;
    }
    return count;
}

static void add_plan_effects(list *l, const kt_model *model) {
    static const char none[] = "the scene names none";
    const size_t force_links = model->n.force_link > 0 ? model->n.force_link - 1 : 0;
    const bool ends = model->n.force_link > 0;
    if (add_batches(l, model, false) == 0)
        add_or_drop(l, KT_PHASE_EVALUATION, "effects on joints", 0, "effects", none);
    add_or_drop(l, KT_PHASE_EVALUATION, "motion of links that carry forces", force_links, "links",
                ends ? "all ends of effects are on the world" : "no effect acts on a body");
    if (add_batches(l, model, true) == 0)
        add_or_drop(l, KT_PHASE_EVALUATION, "effects on bodies", 0, "effects", none);
    add_or_drop(l, KT_PHASE_EVALUATION, "wrenches from bodies onto links", ends ? model->n.body - 1 : 0, "bodies",
                "no effect acts on a body (wrenches that a caller sets would)");
}

/* The number of equations of all planar groups, or of all spatial groups. Adds the number of groups that LAPACK factors
 * to *large. */
static size_t plan_equations_of(const kt_model *model, bool planar, size_t *large) {
    size_t count = 0;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (((size_t)model->group_link[group->link] >= model->n.spatial) != planar)
            continue;
        count += (size_t)group->count[KT_ROWS_ALL];
        *large += group->v_count >= KT_LARGE && !group->has_fronts;
    }
    return count;
}

/* Loops of groups that are reduced link by link. */
static size_t front_loops(const kt_model *model) {
    size_t count = 0;
    for (size_t g = 0; g < model->n.group; g++)
        count += model->group[g].has_fronts ? (size_t)model->group[g].loop_count : 0;
    return count;
}

/* Loops whose accelerations follow from the articulated bodies and a matrix of at most four equations. */
static size_t delassus_loops(const kt_model *model) {
    size_t count = 0;
    for (size_t g = 0; g < model->n.group; g++)
        count += model->group[g].form == KT_FORM_DELASSUS ? (size_t)model->group[g].loop_count : 0;
    return count;
}

/* The reason why there are none, or fewer than possible. */
static const char *why_not_delassus(const kt_model *model) {
    for (size_t g = 0; g < model->n.group; g++)
        if (model->group[g].reason == KT_FORM_REASON_INEXACT)
            return "it would lose digits where heavy links hang on light ones";
    return model->n.loop == 0 ? "no loops" : "no loops of one to four equations hold a long chain on the ground";
}

/* The links of planar trees, or of spatial trees, that are in no group of loops. Spatial links come first. */
static size_t outside_groups(const kt_model *model, bool planar) {
    size_t count = 0;
    for (size_t i = 1; i < model->n.link; i++)
        count += model->link[i].group < 0 && (i >= model->n.spatial) == planar;
    return count;
}

static void add_dynamics(list *l, const kt_model *model) {
    const bool all_planar = model->n.spatial <= 1;
    size_t large = 0;
    const size_t spatial = plan_equations_of(model, false, &large), planar = plan_equations_of(model, true, &large);
    const char *const no_loops = model->n.loop == 0 ? "the scene names no loops" : "no loop is of this kind";
    add_or_drop(l, KT_PHASE_EVALUATION, "sines and cosines", model->n.angle, "angles", "no joint turns about one axis");
    add_or_drop(l, KT_PHASE_EVALUATION, "articulated bodies in space", outside_groups(model, false), "links",
                all_planar ? "all trees move in planes" : "all links are in loops");
    add_or_drop(l, KT_PHASE_EVALUATION, "articulated bodies in planes", outside_groups(model, true), "links",
                model->n.planar == 0 ? "no tree is computed in a plane" : "all planar links are in loops");
    add_or_drop(l, KT_PHASE_EVALUATION, "loops in space", spatial, "equations", no_loops);
    add_or_drop(l, KT_PHASE_EVALUATION, "loops in planes", planar, "equations", no_loops);
    add_or_drop(l, KT_PHASE_EVALUATION, "loops reduced link by link", front_loops(model), "loops",
                model->n.loop == 0 ? "no loops" : "dense matrices take less time");
    add_or_drop(l, KT_PHASE_EVALUATION, "loops of few equations on many links", delassus_loops(model), "loops",
                why_not_delassus(model));
    add_or_drop(l, KT_PHASE_EVALUATION, "LAPACK", large, "groups",
                model->n.loop == 0 ? "no loops" : "no dense group of loops has 40 coordinates");
    add_or_drop(l, KT_PHASE_EVALUATION, "gravity", 0, "",
                model->gravity[0] == 0.0 && model->gravity[1] == 0.0 && model->gravity[2] == 0.0
                    ? "the scene names none"
                    : "it is the acceleration that the ground starts with: it costs nothing");
}

static void add_powers(list *l, const kt_model *model, bool balance) {
    const char *const why = "no balance is recorded";
    add_or_drop(l, KT_PHASE_EVALUATION, "powers of effects", balance ? model->n.effect : 0, "effects",
                balance ? "the scene names no effects" : why);
    add_or_drop(l, KT_PHASE_EVALUATION, "power of driven loops (inverse dynamics)", balance && model->driven, "pass",
                balance ? "no loop changes with time" : why);
}

/* ---- steps and records ------------------------------------------------------------------------------------------- */

/* Adds the kernels of a method that is implicit, or that may become implicit. */
static void add_implicit(list *l, const kt_model *model, const kt_run *run) {
    kt_method storage;
    const kt_method *method = kt_run_method(run, model, &storage);
    const bool implicit = method != NULL && kt_method_needs_newton(method);
    const char *reason = kt_run_method_reason(run, model);
    const char *name = implicit && !kt_method_is_implicit(method) ? "linear equations while it is stiff"
                                                                  : "linear equations of implicit steps";
    add_or_drop(l, KT_PHASE_STEP, name, implicit ? model->n.v : 0, "unknowns",
                reason != NULL ? reason : "the method is explicit");
}

static void add_plan_step(list *l, const kt_model *model, const kt_run *run) {
    add_implicit(l, model, run);
    add_or_drop(l, KT_PHASE_STEP, "projection onto the loops", model->n.group, "groups", "the scene names no loops");
    add_or_drop(l, KT_PHASE_STEP, "quaternions to unit norm", model->n.q - model->n.v, "quaternions",
                "no joint has one");
}

static void add_record(list *l, const kt_run *run, unsigned record, size_t effects) {
    static const char why[] = "not recorded";
    const unsigned energies = KT_RECORD_ENERGY | KT_RECORD_BALANCE;
    add_or_drop(l, KT_PHASE_RECORD, "accelerations", (record & KT_RECORD_ACCELERATIONS) != 0, "evaluation", why);
    add_or_drop(l, KT_PHASE_RECORD, "energies", (record & energies) != 0, "pass", why);
    add_or_drop(l, KT_PHASE_RECORD, "residuals of loops", (record & KT_RECORD_CONSTRAINT) != 0, "pass", why);
    add_or_drop(l, KT_PHASE_RECORD, "reactions", (record & KT_RECORD_REACTIONS) != 0, "pass", why);
    add_or_drop(l, KT_PHASE_RECORD, "momentum", (record & KT_RECORD_MOMENTUM) != 0, "pass", why);
    add_or_drop(l, KT_PHASE_RECORD, "orientations", (record & KT_RECORD_ORIENTATION) != 0, "pass", why);
    if ((record & (KT_RECORD_ANGULAR_VELOCITY | KT_RECORD_ANGULAR_ACCELERATION)) != 0)
        add_or_drop(l, KT_PHASE_RECORD, "angular velocities, accelerations", 1, "pass", why);
    if ((record & KT_RECORD_SINGULAR_VALUE) != 0)
        add_or_drop(l, KT_PHASE_RECORD, "smallest singular value", 1, "decomposition", why);
    if ((record & KT_RECORD_GRAVITY) != 0)
        add_or_drop(l, KT_PHASE_RECORD, "gravity in joints", 1, "pass", why);
    add_or_drop(l, KT_PHASE_RECORD, "what effects exert", (record & KT_RECORD_EFFECT) != 0 ? effects : 0, "effects",
                (record & KT_RECORD_EFFECT) != 0 ? "the scene names no effects" : why);
    add_or_drop(l, KT_PHASE_RECORD, "relative coordinates of loops", (record & KT_RECORD_CLOSURE) != 0, "pass", why);
    add_or_drop(l, KT_PHASE_RECORD, "markers", (size_t)run->marker_count, "markers", why);
}

int kt_plan_steps(const kt_model *model, const kt_run *run, kt_plan_step *steps) {
    if (!model || !steps)
        return 0;
    const kt_run standard = kt_run_default();
    const unsigned record = kt_run_record(run ? run : &standard, model);
    list l = {steps, 0};
    run = run ? run : &standard;
    add_plan_effects(&l, model);
    add_dynamics(&l, model);
    add_powers(&l, model, (record & KT_RECORD_BALANCE) != 0);
    add_plan_step(&l, model, run);
    add_record(&l, run, record, model->n.effect);
    return l.count;
}
