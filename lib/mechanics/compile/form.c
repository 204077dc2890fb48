/* Chooses the form in which each constraint group is eliminated (kt_group_form). All other code reads the choice.
 *
 * The first choice, before any array is placed, is between dense matrices and fronts. The second choice follows when
 * the ranks have been found (rank.c): whether one of the special forms serves. The second choice is repeated if a
 * parameter gives a joint armature, and if few equations lose digits (delassus_accuracy.c). The costs are measured:
 * bench/run forms.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"
#include "constraint/formula_row.h"
#include "reduction/delassus.h"
#include "reduction/front4.h"
#include "reduction/method.h"

#include <float.h>

/* The costs of an elimination in nanoseconds on a processor of 2023: an operation, a link, a loop, and an entry of the
 * mass matrix. The numbers are fitted to times of ladders, nets, grids, rows of five-bars and of Bennett's linkages,
 * within a third. */
typedef struct form_price {
    double operation, link, loop, entry;
} form_price;

static const form_price front_price[] = {[false] = {0.077, 650.0, 0.0, 0.0}, [true] = {0.17, 220.0, 320.0, 0.0}};
static const form_price dense_price[] = {[false] = {0.070, 170.0, 0.0, 10.6}, [true] = {0.037, 37.0, 93.0, 11.8}};

/* In batches, lanes compute dense groups of fewer coordinates than KT_LARGE and no fronts. Below that number, fronts
 * must therefore take so much less time than dense matrices. */
#define WORTH_LANES 0.5

/* Groups of several free bodies, as in absolute coordinates, have more equations. Fronts lose up to two digits of these
 * equations (Andrews' mechanism). Therefore fronts are chosen only if the operations fall below this share, and the
 * group has this many bodies. */
#define WORTH_FREE 0.125
enum { FREE_LEAST = 10 };

/* From this number of links on, fronts in registers (reduction/front4.h) gain more than batches lose by them. A row of
 * three windows takes nearly the same time with dense matrices, and a row of ten windows twice as much. */
enum { KT_FRONT4_LINKS = 10 };

/* The time of an evaluation: operations, links and loops, and the entries of M, at the measured prices of a form. */
static double form_cost(const form_price *of, double operations, const kt_group *group) {
    const double m = group->v_count;
    return of->operation * operations + of->link * group->link_count + of->loop * group->loop_count + of->entry * m * m;
}

static bool has_several_free(const kt_model *model, const kt_group *group) {
    int count = 0;
    for (int i = 0; i < group->link_count; i++)
        count += model->link[model->group_link[group->link + i]].motion == KT_MOTION_FREE;
    return count > 1;
}

static bool may_be(const kt_model *model, kt_group_form form) { return !(model->excluded_forms & 1u << form); }

static void set_form(kt_group *group, kt_group_form form, kt_form_reason reason) {
    group->form = form;
    group->has_fronts = form >= KT_FORM_FRONT;
    group->reason = reason;
}

/* Whether the equation of a loop is a formula: such a row varies, whereas fronts assume that the row of a coupling is
 * constant. Fronts do not count the turns of ends, either. */
static bool has_formula(const kt_model *model, const kt_group *group) {
    for (int32_t i = group->loop; i < group->loop + group->loop_count; i++)
        if (kt_has_formula_row(&model->loop[model->group_loop[i]]) || model->loop[model->group_loop[i]].counted)
            return true;
    return false;
}

static bool has_one_sided_loop(const kt_model *model, const kt_group *group) {
    for (int32_t i = group->loop; i < group->loop + group->loop_count; i++)
        if (model->loop[model->group_loop[i]].side != KT_SIDE_NONE)
            return true;
    return false;
}

/* Whether half columns have a form for every link: it is computed in space, and its joint has one axis or frees it from
 * the ground. */
static bool has_half_columns(const kt_model *model, const kt_group *group) {
    for (int i = 0; i < group->link_count; i++) {
        const int32_t index = model->group_link[group->link + i];
        const kt_link *link = &model->link[index];
        const bool is_free = link->motion == KT_MOTION_FREE && link->parent == 0;
        if ((size_t)index >= model->n.spatial || (kt_link_dofs(link) != 1 && !is_free))
            return false;
    }
    return true;
}

/* Whether the equations of a dense group may be solved in range space (reduction/half_columns.h): the group has hard
 * contacts, and stands on the ground or is one joint that a stop locks. */
static bool may_solve_in_range_space(const kt_model *model, const kt_group *group) {
    const bool is_locked_joint = group->v_count == 1 && group->row_count == 1;
    return (group->parent == 0 || is_locked_joint) && model->reduction->chooses && !group->planar &&
           has_half_columns(model, group) && has_one_sided_loop(model, group);
}

void kt_form_begin(const kt_model *model, kt_group *group) {
    set_form(group, KT_FORM_DENSE,
             group->balanced                          ? KT_FORM_REASON_RATIO
             : has_formula(model, group)              ? KT_FORM_REASON_FORMULA
             : !model->reduction->fronts              ? KT_FORM_REASON_METHOD
             : model->structure == KT_STRUCTURE_DENSE ? KT_FORM_REASON_ASKED
                                                      : KT_FORM_REASON_SMALL);
    group->damped_form = KT_FORM_DENSE;
    group->ranges = !group->balanced && may_solve_in_range_space(model, group);
}

bool kt_form_is_front(const kt_model *model, kt_group *group, const kt_form_estimate *of) {
    if (group->balanced || group->reason == KT_FORM_REASON_FORMULA)
        return false;
    const bool planar = group->planar;
    const double front = form_cost(&front_price[planar], of->front_flops, group);
    const double dense = form_cost(&dense_price[planar], of->dense_flops, group);
    const bool pays = has_several_free(model, group)
                          ? group->link_count >= FREE_LEAST && of->front_flops < WORTH_FREE * of->dense_flops
                          : front < (group->v_count < KT_LARGE ? WORTH_LANES : 1.0) * dense;
    const bool registers = of->is_front4 && group->link_count >= KT_FRONT4_LINKS && may_be(model, KT_FORM_FRONT4);
    const bool delassus = of->fits_delassus && may_be(model, KT_FORM_DELASSUS);
    if (model->structure == KT_STRUCTURE_FRONTS)
        set_form(group, KT_FORM_FRONT, KT_FORM_REASON_ASKED);
    else if (pays || delassus || registers)
        set_form(group, KT_FORM_FRONT, KT_FORM_REASON_TIME);
    return group->has_fronts;
}

/* ---- the special forms ------------------------------------------------------------------------------------------- */

/* Whether a group consists of three links of a plane and is closed by one pin alone, whose rows are two directions at
 * right angles. Only the QR reduction uses this special form; if the caller selects another reduction, the group gets
 * that reduction. */
static bool is_pin(const kt_model *model, const kt_group *group) {
    if (group->has_fronts || !model->reduction->pins || !group->planar || group->loop_count != 1 ||
        group->link_count != 3 || group->v_count != 3 || group->count[KT_ROWS_ALL] != 2 ||
        group->rank[KT_ROWS_ALL] != 2)
        return false;
    const int32_t loop = model->group_loop[group->loop];
    const kt_planar_loop *flat = &model->planar_loop[loop];
    const kt_planar_row *x = &flat->row[0], *y = &flat->row[1];
    if (model->loop[loop].term_count || flat->count != 2 || x->kind != KT_PLANAR_ROW_ALONG ||
        y->kind != KT_PLANAR_ROW_ALONG)
        return false;
    const double off =
        fmax(fabs(x->e[0] * y->e[0] + x->e[1] * y->e[1]), fmax(fabs(x->e[0] * x->e[0] + x->e[1] * x->e[1] - 1.0),
                                                               fabs(y->e[0] * y->e[0] + y->e[1] * y->e[1] - 1.0)));
    return off < 64.0 * DBL_EPSILON;
}

/* Chooses the form for damped steps of the assembly, y = -B' (B B' + mu 1)^-1 r (reduction/delassus.h). The form of
 * Delassus sweeps wrenches to the ground, and has one column for each degree of freedom of a joint. Therefore the group
 * must be on the ground, and no link may move freely. */
void kt_form_choose_damped(const kt_model *model, kt_group *group) {
    bool fits = group->has_fronts && group->parent == 0 && group->loop_count <= KT_DELASSUS_MAX &&
                kt_delassus_count((size_t)group->v_count) <= group->front.count && may_be(model, KT_FORM_DELASSUS);
    for (int i = 0; i < group->link_count && fits; i++)
        fits = model->link[model->group_link[group->link + i]].motion != KT_MOTION_FREE;
    group->damped_form = fits ? KT_FORM_DELASSUS : group->has_fronts ? KT_FORM_FRONT : KT_FORM_DENSE;
}

/* Whether a group is solved by reduction/delassus.h: few equations (dependent ones not counted). If rows may be
 * delayed, fronts solve the group instead. */
static bool is_delassus(const kt_group *group) {
    return group->damped_form == KT_FORM_DELASSUS && !group->front.delayed_most && group->rank[KT_ROWS_ALL] > 0 &&
           group->rank[KT_ROWS_ALL] <= KT_DELASSUS_MAX;
}

/* Whether a group is reduced by reduction/front4.h. Such a group is planar, lies on the ground and has fronts of few
 * parameters. Each step has at most two equations, and all equations are independent. */
static bool fits_front4(const kt_model *model, const kt_group *group) {
    const kt_front_plan *plan = &group->front;
    const int32_t *cap = model->front_cap + (size_t)KT_ROWS_ALL * model->n.front + plan->step;
    int32_t params = 0, active = 0, rank = 0;
    bool fits = group->has_fronts && !plan->delayed_most && group->parent == 0 && group->planar &&
                plan->relations == 0 && plan->slots <= KT_FRONT4_SLOTS &&
                kt_front4_count((size_t)group->link_count) <= plan->count;
    for (int32_t s = 0; s < group->link_count && fits; s++) {
        const kt_front_step *step = &model->front[plan->step + s];
        int32_t rows = 0;
        for (int32_t i = step->loop; i < step->loop + step->loop_count; i++) {
            const kt_loop_record *loop = &model->loop[model->front_loop[i]];
            for (int r = 0; r < loop->row_count; r++)
                rows += model->slot[loop->slot + r] >= 0;
        }
        rank += rows;
        active += 1 - step->last_use_count;
        fits = ++params <= KT_FRONT4_PARAMS && rows <= KT_FRONT4_ROWS && rows <= params && cap[s] == rank;
        params = active ? params - rows : 0;
    }
    return fits;
}

/* Chooses a special form of a group that is planned for fronts, if ranks and accuracy permit it. */
static void choose_among_fronts(const kt_model *model, kt_group *group) {
    const bool inexact = group->reason == KT_FORM_REASON_INEXACT;
    if (is_delassus(group) && !inexact)
        set_form(group, KT_FORM_DELASSUS, KT_FORM_REASON_FEW);
    else if (!is_delassus(group) && fits_front4(model, group) && may_be(model, KT_FORM_FRONT4))
        set_form(group, KT_FORM_FRONT4, KT_FORM_REASON_REGISTERS);
}

void kt_forms_choose(kt_model *model) {
    model->has_delassus = false;
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group *group = &model->group[g];
        if (group->has_fronts)
            choose_among_fronts(model, group);
        else if (is_pin(model, group) && may_be(model, KT_FORM_PIN))
            set_form(group, group->has_armature ? KT_FORM_DENSE : KT_FORM_PIN,
                     group->has_armature ? KT_FORM_REASON_ARMATURE : KT_FORM_REASON_PIN);
        model->has_delassus |= group->form == KT_FORM_DELASSUS || (group->form == KT_FORM_DENSE && group->ranges);
    }
}

void kt_form_reject_inexact(kt_group *group) { set_form(group, KT_FORM_FRONT, KT_FORM_REASON_INEXACT); }
