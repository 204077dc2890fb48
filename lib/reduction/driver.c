/* Dynamics and closure of mechanisms with loops: the articulated-body recursion (dynamics/aba.h), in which each
 * constraint group is one step (spatial_group.h), and the same recursion without forces for steps that are least in
 * kinetic energy. Bodies outside all loops cost what they cost in a tree.
 *
 * The functions treat links 1 to end - 1 and the groups among them (driver.h): all of them, or those before the planar
 * ones, which planar_driver.c treats.
 */
#include "reduction/driver.h"

#include "constraint/loop_wrenches.h"
#include "constraint/spatial_rows.h"
#include "reduction/delassus.h"
#include "reduction/front.h"
#include "reduction/front4.h"
#include "reduction/kernel.h"
#include "reduction/spatial_group.h"

/* ---- the recursion ----------------------------------------------------------------------------------------------- */

void KT_KERNEL(kt_spatial_pose)(const kt_model *model, kt_data *data, const double *q, size_t end) {
    const kt_v4 none = kt_v4_splat(0.0);
    const size_t angles = end == model->n.link ? model->n.angle : model->n.spatial_angle;
    kt_sincos_gather(q, model->angle, angles, data->sine, data->cosine);
    kt_ground_set(none, &data->motion[0]);
    for (size_t i = 1; i < end; i++)
        kt_link_pose(&model->link[i], &data->motion[model->link[i].parent], q, data->cosine, data->sine,
                     &data->motion[i]);
}

void KT_KERNEL(kt_spatial_move)(const kt_model *model, kt_data *data, const double *v, size_t end) {
    for (size_t i = 1; i < end; i++)
        kt_link_velocity(&model->link[i], &data->motion[model->link[i].parent], v, &data->motion[i]);
}

void KT_KERNEL(kt_spatial_clear)(const kt_model *model, kt_data *data, size_t end) {
    for (size_t i = 1; i < end; i++)
        kt_articulated_clear(&model->link[i], &data->articulated[model->link[i].articulated]);
    kt_external_none(data);
}

void KT_KERNEL(kt_spatial_motion)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                  const kt_wrench *external, size_t end) {
    kt_articulated_motion(model, data, q, v, end);
    if (external)
        kt_external_set(model, data, external);
}

static void add_total(const kt_front_total *total, kt_articulated *to) {
    const double *x = total->inertia;
    for (int c = 0; c < 3; c++, x += KT_FRONT_SPACE) {
        const double *l = x + 3 * KT_FRONT_SPACE;
        to->j[c] += (kt_v4){x[0], x[1], x[2], 0.0};
        to->g[c] += (kt_v4){x[3], x[4], x[5], 0.0};
        to->h[c] += (kt_v4){l[0], l[1], l[2], 0.0};
        to->m[c] += (kt_v4){l[3], l[4], l[5], 0.0};
    }
    to->moment += (kt_v4){total->bias[0], total->bias[1], total->bias[2], 0.0};
    to->force += (kt_v4){total->bias[3], total->bias[4], total->bias[5], 0.0};
}

static bool eliminate_front(const kt_model *model, kt_data *data, int32_t g, const double *tau) {
    const kt_group *group = &model->group[g];
    const kt_front_aim aim = {.kind = KT_FRONT_DYNAMICS, .tau = tau, .base = group->parent != 0};
    kt_front_total total;
    kt_group_bias(model, data, group);
    if (!KT_KERNEL(kt_front_reduce)(model, data, (size_t)g, &aim, &total))
        return false;
    if (group->parent)
        add_total(&total, &data->articulated[group->parent]);
    return true;
}

KT_INLINE bool eliminate_dense(const kt_model *model, kt_data *data, int32_t g, const double *tau, bool has_armature) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, (size_t)g, data->factored[g]);
    kt_articulated total;
    kt_group_assemble(model, data, group, &w, tau, &total);
    if (has_armature)
        kt_group_gear(model, group, &w);
    if (!model->reduction->solve(&w, data->rank[g], group->parent ? 6 : 0))
        return false;
    if (group->parent)
        kt_group_onto_parent(&w, &total, &data->articulated[group->parent]);
    return true;
}

static __attribute__((noinline)) bool eliminate_dense_armature(const kt_model *model, kt_data *data, int32_t g,
                                                               const double *tau) {
    return eliminate_dense(model, data, g, tau, true);
}

static __attribute__((noinline)) bool eliminate_whole(const kt_model *model, kt_data *data, int32_t g,
                                                      const double *tau) {
    if (kt_group_has_fronts(&model->group[g]))
        return eliminate_front(model, data, g, tau);
    if (model->group[g].has_armature)
        return eliminate_dense_armature(model, data, g, tau);
    return eliminate_dense(model, data, g, tau, false);
}

/* S'[J H; G M] S of a joint with one axis, S = (s_n, s_f). */
KT_INLINE double inertia_along(const kt_link *link, kt_v4 s, const kt_articulated *x) {
    const kt_v4 none = kt_v4_splat(0.0);
    const kt_v4 n = link->motion == KT_MOTION_PRISMATIC ? none : s;
    const kt_v4 f = link->motion == KT_MOTION_REVOLUTE ? none
                    : link->motion == KT_MOTION_SCREW  ? kt_v4_splat(kt_link_pitch(link)) * s
                                                       : s;
    return kt_v4_dot2(n, kt_v4_apply(x->j, n) + kt_v4_apply(x->h, f), f, kt_v4_apply(x->g, n) + kt_v4_apply(x->m, f));
}

/* A link of a group in the form of Delassus is one of the tree: its inverse inertia is stored for delassus.c. */
KT_INLINE void keep_inverse(const kt_model *model, const kt_data *data, size_t i, const kt_articulated *x,
                            double armature) {
    const kt_link *link = &model->link[i];
    kt_delassus d;
    if (link->motion == KT_MOTION_SPHERICAL)
        return;
    kt_delassus_find(model, data, (size_t)link->group, &d);
    d.inverse[link->local] = 1.0 / (inertia_along(link, kt_link_axis(link, &data->motion[i]), x) + armature);
}

/* A group is eliminated at its first link, which the backward pass reaches last. */
KT_INLINE kt_elimination eliminate_of_group(const kt_model *model, kt_data *data, size_t i, const double *tau,
                                            kt_articulated *x) {
    const int32_t group = model->link[i].group;
    data->articulated[i] = *x;
    const bool first = model->group_link[model->group[group].link] == (int32_t)i;
    return first && !eliminate_whole(model, data, group, tau) ? KT_ELIMINATION_SINGULAR : KT_ELIMINATION_ENDED;
}

/* `context` is not NULL if groups in the form of Delassus are not eliminated. */
KT_INLINE kt_elimination eliminate(const kt_model *model, kt_data *data, size_t i, const double *tau, kt_articulated *x,
                                   void *context) {
    const int32_t group = model->link[i].group;
    const bool delassus = group >= 0 && context && data->special_form[group];
    if (group >= 0 && !delassus)
        return eliminate_of_group(model, data, i, tau, x);
    if (delassus)
        keep_inverse(model, data, i, x, 0.0);
    return kt_eliminate_joint(model, data, i, tau, x, NULL);
}

static kt_elimination eliminate_armature(const kt_model *model, kt_data *data, size_t i, const double *tau,
                                         kt_articulated *x, void *context) {
    const int32_t group = model->link[i].group;
    const bool delassus = group >= 0 && context && data->special_form[group];
    if (group >= 0 && !delassus)
        return eliminate_of_group(model, data, i, tau, x);
    if (delassus)
        keep_inverse(model, data, i, x, model->armature[model->link[i].v]);
    return kt_eliminate_armature(model, data, i, tau, x, NULL);
}

/* The acceleration of a group's parent. */
typedef struct kt_front_base {
    double x[KT_FRONT_SPACE];
} kt_front_base;

static kt_front_base front_base(const kt_data *data, const kt_group *group) {
    const kt_link_motion *m = &data->motion[group->parent];
    return (kt_front_base){{m->alpha[0], m->alpha[1], m->alpha[2], m->linear[0], m->linear[1], m->linear[2]}};
}

KT_INLINE void respond_to(const kt_model *model, kt_data *data, size_t i, bool delassus, double *a) {
    const kt_link *link = &model->link[i];
    if (link->group < 0 || (delassus && data->special_form[link->group])) {
        kt_link_respond(model, data, i, a);
        return;
    }
    const kt_group *group = &model->group[link->group];
    if (model->group_link[group->link] == (int32_t)i && kt_group_has_fronts(group)) {
        const kt_front_base base = front_base(data, group);
        KT_KERNEL(kt_front_respond)(model, data, (size_t)link->group, group->parent ? base.x : NULL, a);
    } else if (model->group_link[group->link] == (int32_t)i) {
        const kt_group_work w = kt_group_matrices(model, data, (size_t)link->group, KT_ROWS_ALL);
        kt_group_respond(model, data, group, &w, a);
    }
    kt_link_acceleration(link, &data->motion[link->parent], a, &data->motion[i]);
}

KT_INLINE void respond(const kt_model *model, kt_data *data, size_t i, double *a) {
    respond_to(model, data, i, false, a);
}
KT_INLINE void respond_delassus(const kt_model *model, kt_data *data, size_t i, double *a) {
    respond_to(model, data, i, true, a);
}

/* Solves the groups in the form of Delassus, between the passes; returns the first link of one that cannot be solved,
 * or 0. */
static size_t solve_delassus(const kt_model *model, kt_data *data, size_t end) {
    for (size_t g = 0; g < model->n.group; g++) {
        const int32_t link = model->group_link[model->group[g].link];
        if (data->special_form[g] && (size_t)link < end && !KT_KERNEL(kt_delassus_solve)(model, data, g, NULL))
            return (size_t)link;
    }
    return 0;
}

/* The same with groups in the form of Delassus, which delassus.h solves between the passes. */
static size_t accelerate_delassus(const kt_model *model, kt_data *data, const double *tau, size_t end, double *a) {
    bool delassus = true;
    const size_t failed = kt_articulated_backward(model, data, tau, end, eliminate, &delassus);
    const size_t singular = failed ? failed : solve_delassus(model, data, end);
    if (!singular)
        kt_articulated_forward(model, data, end, respond_delassus, a);
    return singular;
}

static void respond_armature(const kt_model *model, kt_data *data, size_t i, double *a) {
    const int32_t group = model->link[i].group;
    if (group < 0 || data->special_form[group])
        kt_link_respond_armature(model, data, i, a);
    else
        respond(model, data, i, a);
}

/* Either with armature. */
static __attribute__((noinline)) size_t accelerate_armature(const kt_model *model, kt_data *data, const double *tau,
                                                            size_t end, bool delassus, double *a) {
    const size_t failed =
        kt_articulated_backward(model, data, tau, end, eliminate_armature, delassus ? &delassus : NULL);
    const size_t singular = failed || !delassus ? failed : solve_delassus(model, data, end);
    if (!singular)
        kt_articulated_forward(model, data, end, respond_armature, a);
    return singular;
}

size_t KT_KERNEL(kt_spatial_accelerate)(const kt_model *model, kt_data *data, const double *tau, size_t end,
                                        bool delassus, double *a) {
    if (model->has_armature)
        return accelerate_armature(model, data, tau, end, delassus, a);
    if (delassus)
        return accelerate_delassus(model, data, tau, end, a);
    const size_t failed = kt_articulated_backward(model, data, tau, end, eliminate, NULL);
    if (!failed)
        kt_articulated_forward(model, data, end, respond, a);
    return failed;
}

int KT_KERNEL(kt_group_factor)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular) {
    const kt_group *group = &model->group[g];
    data->special_form[g] = KT_SPECIAL_FORM_NONE;
    if (kt_group_has_fronts(group))
        return KT_KERNEL(kt_front_factor)(model, data, g, rows, regular);
    const kt_reduction_kind *kind = model->reduction;
    const double small = KT_NEAR_SINGULAR * group->usual[rows];
    kt_group_work w;
    kt_group_find(model, data, g, rows, &w);
    int rank = kind->factor(&w, group->rank[rows]);
    data->factored[g] = rows;
    data->last[g] = rank > 0 ? kind->size(&w, rank - 1) : 0.0;
    data->near[g] = rank >= 0 && (rank < group->rank[rows] || data->last[g] < small);
    while (regular && rank > 0 && kind->size(&w, rank - 1) < small)
        rank--;
    data->rank[g] = rank < 0 ? 0 : rank;
    return rank;
}

static void fill_group(const kt_model *model, kt_data *data, size_t g, bool moving, const double *q, const double *v,
                       double t) {
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    if (kt_group_has_fronts(&model->group[g]))
        KT_KERNEL(kt_front_fill)(model, data, g, false, moving, q, v, t);
    else
        kt_rows_fill(model, data, g, &w, moving, q, v, t);
}

bool KT_KERNEL(kt_group_prepare)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular,
                                 bool delassus) {
    const bool special =
        delassus && model->group[g].form == KT_FORM_DELASSUS && KT_KERNEL(kt_delassus_prepare)(model, data, g, rows);
    data->special_form[g] = special ? kt_special_form_as(regular) : KT_SPECIAL_FORM_NONE;
    return special || KT_KERNEL(kt_group_factor)(model, data, g, rows, regular) >= 0;
}

static size_t try_forward(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                          const double *tau, const kt_wrench *external, bool regular, bool delassus, double *a) {
    const size_t end = model->n.link;
    KT_KERNEL(kt_spatial_motion)(model, data, q, v, external, end);
    size_t failed = 0;
    for (size_t g = 0; g < model->n.group; g++) {
        fill_group(model, data, g, true, q, v, t);
        if (!KT_KERNEL(kt_group_prepare)(model, data, g, KT_ROWS_ALL, regular, delassus))
            failed = (size_t)model->group_link[model->group[g].link];
    }
    if (failed)
        return failed;
    return KT_KERNEL(kt_spatial_accelerate)(model, data, tau, end, delassus, a);
}

/* If groups in the form of Delassus cannot be solved by their own method, for whatever reason, the general one decides.
 * */
static size_t forward(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                      const double *tau, const kt_wrench *external, bool regular, double *a) {
    if (!regular && model->has_delassus && try_forward(model, data, t, q, v, tau, external, false, true, a) == 0)
        return 0;
    return try_forward(model, data, t, q, v, tau, external, regular, false, a);
}

/* ---- closure -------------------------------------------------------------------------------------------------------
 */

void KT_KERNEL(kt_group_residuals)(const kt_model *model, kt_data *data, size_t g, const double *v, const bool *held,
                                   kt_violation *violation) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    kt_group_position_residuals(&w, violation);
    if (v && kt_group_has_fronts(group))
        KT_KERNEL(kt_front_apply)(model, data, g, KT_ROWS_ALL, v, w.right, w.multiplier);
    if (v && kt_group_has_fronts(group))
        kt_group_violation(&w, w.multiplier, violation);
    else if (v)
        kt_group_velocity_residuals(model, group, &w, v, violation);
    for (int i = 0; i < w.m && held && kt_group_has_fronts(group); i++)
        data->front_fixed[group->v + i] = held[model->group_v[group->v + i]];
    for (int i = 0; i < w.m && held && !kt_group_has_fronts(group); i++)
        for (int r = 0; r < w.k && held[model->group_v[group->v + i]]; r++)
            w.a[(size_t)r * (size_t)w.m + (size_t)i] = 0.0;
}

static bool residuals(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                      const bool *held, kt_violation *violation) {
    *violation = kt_violation_none;
    KT_KERNEL(kt_spatial_pose)(model, data, q, model->n.link);
    for (size_t g = 0; g < model->n.group; g++) {
        fill_group(model, data, g, false, q, v, t);
        KT_KERNEL(kt_group_residuals)(model, data, g, v, held, violation);
    }
    return isfinite(violation->position + violation->velocity);
}

bool KT_KERNEL(kt_groups_factor)(const kt_model *model, kt_data *data, kt_rows rows, bool regular) {
    bool fine = true;
    for (size_t g = 0; g < model->n.group; g++)
        fine &= KT_KERNEL(kt_group_factor)(model, data, g, rows, regular) >= 0;
    return fine;
}

static void fill(const kt_model *model, kt_data *data, double t, const double *q, const double *v) {
    KT_KERNEL(kt_spatial_pose)(model, data, q, model->n.link);
    KT_KERNEL(kt_spatial_move)(model, data, v, model->n.link);
    for (size_t g = 0; g < model->n.group; g++) {
        fill_group(model, data, g, true, q, v, t);
    }
}

static bool prepare(const kt_model *model, kt_data *data, kt_rows rows, bool regular) {
    bool fine = true;
    for (size_t g = 0; g < model->n.group; g++)
        fine &= KT_KERNEL(kt_group_prepare)(model, data, g, rows, regular, true);
    return fine;
}

bool KT_KERNEL(kt_groups_refactor)(const kt_model *model, kt_data *data) {
    bool some = false;
    for (size_t g = 0; g < model->n.group; g++) {
        if (!data->special_form[g])
            continue;
        some = true;
        if (KT_KERNEL(kt_group_factor)(model, data, g, data->factored[g],
                                       data->special_form[g] == KT_SPECIAL_FORM_REGULAR) < 0)
            return false;
    }
    return some;
}

/* Closes a group by its own form, if that is `special`; otherwise factors it. */
static bool least_step_special(const kt_model *model, kt_data *data, size_t g, double *step) {
    if (model->group[g].form == KT_FORM_DELASSUS) {
        KT_KERNEL(kt_delassus_least)(model, data, g, step);
        return true;
    }
    if (KT_KERNEL(kt_front4_solve)(model, data, g, NULL, step))
        return true;
    (void)KT_KERNEL(kt_group_factor)(model, data, g, data->factored[g],
                                     data->special_form[g] == KT_SPECIAL_FORM_REGULAR);
    return false;
}

bool KT_KERNEL(kt_groups_least_step)(const kt_model *model, kt_data *data, double *step) {
    const kt_reduction_kind *kind = model->reduction;
    memset(step, 0, model->n.v * sizeof *step);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        const kt_group *group = &model->group[g];
        if (data->special_form[g] && least_step_special(model, data, g, step))
            continue;
        if (kt_group_has_fronts(group)) {
            const kt_front_aim aim = {.kind = KT_FRONT_COORDINATES};
            if (!KT_KERNEL(kt_front_reduce)(model, data, g, &aim, NULL))
                return false;
            KT_KERNEL(kt_front_respond)(model, data, g, NULL, step);
            continue;
        }
        kind->particular(&w, data->rank[g], w.right, w.free);
        if (!kind->least && !kt_group_make_least(kind, &w, data->rank[g]))
            return false;
        for (int i = 0; i < w.m; i++)
            step[model->group_v[group->v + i]] = w.free[i];
    }
    return true;
}

/* min dv' M dv / 2 - force' dv with A dv = right: the equations of motion at rest, with dv in place of the
 * accelerations. */
static bool least_step(const kt_model *model, kt_data *data, kt_metric metric, const double *force, double *step) {
    if (metric != KT_METRIC_MASS)
        return KT_KERNEL(kt_groups_least_step)(model, data, step);
    KT_KERNEL(kt_spatial_move)(model, data, model->zero, model->n.link);
    KT_KERNEL(kt_spatial_clear)(model, data, model->n.link);
    data->motion[0].linear = kt_v4_splat(0.0);
    if (KT_KERNEL(kt_spatial_accelerate)(model, data, force, model->n.link, model->has_delassus, step) == 0)
        return true;
    return KT_KERNEL(kt_groups_refactor)(model, data) && least_step(model, data, metric, force, step);
}

/* ---- reactions --------------------------------------------------------------------------------------------------- */

/* A' lambda = M x + F' A - (tau - h) */
static void multipliers(const kt_model *model, kt_data *data, const double *v, const double *a) {
    KT_KERNEL(kt_spatial_move)(model, data, v, model->n.link);
    data->motion[0].linear = -model->gravity;
    for (size_t i = 1; i < model->n.link; i++)
        kt_link_acceleration(&model->link[i], &data->motion[model->link[i].parent], a, &data->motion[i]);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        const kt_group *group = &model->group[g];
        const kt_link_motion *p = &data->motion[group->parent];
        if (data->special_form[g])
            continue;
        if (kt_group_has_fronts(group)) {
            KT_KERNEL(kt_front_multipliers)(model, data, g, a, w.multiplier);
            continue;
        }
        double *x = w.gain, *need = w.half; /* no longer needed */
        for (int i = 0; i < w.m; i++)
            x[i] = a[model->group_v[group->v + i]];
        kt_dense_apply(w.mass, w.m, w.m, x, need);
        for (int i = 0; i < w.m; i++) {
            need[i] -= w.bias[i];
            for (int c = 0; c < 3 && group->parent; c++)
                need[i] += w.coupling[6 * (size_t)i + (size_t)c] * p->alpha[c] +
                           w.coupling[6 * (size_t)i + 3 + (size_t)c] * p->linear[c];
        }
        model->reduction->multipliers(&w, data->rank[g], need, w.multiplier);
    }
}

void KT_KERNEL(kt_groups_multipliers_of)(const kt_model *model, kt_data *data, const double *force) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        double *need = kt_group_has_fronts(group) ? w.free : w.half; /* no longer needed */
        for (int i = 0; i < w.m; i++)
            need[i] = force[model->group_v[group->v + i]];
        if (kt_group_has_fronts(group))
            KT_KERNEL(kt_front_multipliers_of)(model, data, g, w.multiplier);
        else
            model->reduction->multipliers(&w, data->rank[g], need, w.multiplier);
    }
}

static void basis(const kt_model *model, kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        if (!kt_group_has_fronts(&model->group[g]))
            model->reduction->basis(&w, data->rank[g]);
    }
}

/* If the group is in the form of Delassus, `special` says from here on that its few equations alone have been measured.
 * */
double KT_KERNEL(kt_damped_measure)(const kt_model *model, kt_data *data, size_t g, kt_rows rows) {
    double size = 0.0;
    const bool special =
        model->group[g].damped_form == KT_FORM_DELASSUS && KT_KERNEL(kt_delassus_measure)(model, data, g, rows, &size);
    data->special_form[g] = special ? KT_SPECIAL_FORM_WHOLE : KT_SPECIAL_FORM_NONE;
    return special ? size : KT_KERNEL(kt_front_measure)(model, data, g, rows);
}

bool KT_KERNEL(kt_damped_solve)(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping,
                                double *step) {
    if (data->special_form[g])
        return KT_KERNEL(kt_delassus_damp)(model, data, g, gap, damping, step);
    const kt_front_aim aim = {.kind = KT_FRONT_DAMPED, .gap = gap, .damping = damping};
    if (!KT_KERNEL(kt_front_reduce)(model, data, g, &aim, NULL))
        return false;
    KT_KERNEL(kt_front_respond)(model, data, g, NULL, step);
    return true;
}

const kt_reduction_kernels KT_KERNEL(kt_reduction_kernels) = {.forward = forward,
                                                              .apply = KT_KERNEL(kt_front_apply),
                                                              .measure = KT_KERNEL(kt_damped_measure),
                                                              .damp = KT_KERNEL(kt_damped_solve),
                                                              .nullspace = KT_KERNEL(kt_front_nullspace),
                                                              .residuals = residuals,
                                                              .factor = KT_KERNEL(kt_groups_factor),
                                                              .prepare = prepare,
                                                              .fill = fill,
                                                              .least_step = least_step,
                                                              .multipliers = multipliers,
                                                              .basis = basis,
                                                              .react = KT_KERNEL(kt_react)};
