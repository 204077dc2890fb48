/* Floating-point operations of an evaluation: additions, subtractions, multiplications, divisions and square roots, as
 * the baseline kernels execute them. Vectors of three ride in four lanes, and the fourth counts; sines and cosines come
 * in groups of eight, which count whole. Functions of the C library and a caller's own do not count.
 *
 * Of trees the cost is a sum over links, and the numbers below are exact: test/plan/plan.py counts what is executed,
 * instruction by instruction. Of a group of loops with m coordinates, k equations and rank r the dense algebra follows
 * from its loops (qr.c, dense.h); what its links and equations take is a fit to mechanisms of many sorts, good to a few
 * parts in a hundred of the whole.
 */
#include "reduction/cost.h"

#include "reduction/reduce.h"

#include <math.h>

/* A group of eight sines and cosines. */
static const double eight_angles = 488.0;

/* One elementary joint and what it carries, on the ground. */
static const double spatial_link[] = {[KT_MOTION_REVOLUTE] = 631.0,
                                      [KT_MOTION_PRISMATIC] = 632.0,
                                      [KT_MOTION_SCREW] = 751.0,
                                      [KT_MOTION_SPHERICAL] = 701.0,
                                      [KT_MOTION_FREE] = 873.0};
/* In a plane, and what it takes there to hand on to a moving parent: of a mechanism without loops, and of one with. */
typedef struct planar_cost {
    double turn, slide, carried;
} planar_cost;
static const planar_cost planar_tree = {104.0, 161.0, 8.0}, planar_closed = {81.0, 134.0, 29.0};
/* More: axes that are turned at rest (at each of a link's uses of them); handing on to a moving parent; taking from
 * children in more than one branch. */
static const double turned = 60.0, turned_free = 240.0;
static const double spatial_carried = 243.0, spatial_branches = 56.0, planar_branches = 9.0;

static const double force_link_of[] = {[KT_MOTION_REVOLUTE] = 73.0,
                                       [KT_MOTION_PRISMATIC] = 57.0,
                                       [KT_MOTION_SCREW] = 87.0,
                                       [KT_MOTION_SPHERICAL] = 158.0,
                                       [KT_MOTION_FREE] = 202.0};
static const double force_link_rotate_free = 120.0;
static const double spatial_wrench = 41.0, planar_wrench = 38.0; /* of one body, onto its link */

/* In groups: a link's turn, slide, or freedom of a ball or free joint; each link above it in the group, for each of its
 * freedoms; a loop of two frames; its equations; the links on its paths; these times the equations. */
typedef struct group_cost {
    double turn, slide, dof, above, loop, row, path, entry;
} group_cost;
static const group_cost spatial_group = {843.9, 862.4, 419.7, 15.6, 433.8, -19.6, 88.5, 18.2};
static const group_cost planar_group = {60.9, 142.5, 0.0, 12.0, 12.0, 0.0, 49.7, 0.0};

/* A group that one pin closes (planar_pin.h): exact. Three turns; each that is a slide; all links on one path; on a
 * parent that moves. */
static const double pin_turns = 406.0, pin_slide = 17.0, pin_one_path = 4.0, pin_rides = 189.0;

static double angles_of(size_t count) {
    const size_t groups = (count + 7) / 8;
    return eight_angles * (double)groups;
}

/* ---- trees ------------------------------------------------------------------------------------------------------- */

static double spatial_of(const kt_link *link) {
    double flops = spatial_link[link->motion];
    flops += link->branches ? spatial_branches : 0.0;
    return flops + (link->parent ? spatial_carried : 0.0);
}

static double planar_of(const kt_planar_link *link, const planar_cost *cost) {
    double flops = link->motion == KT_MOTION_REVOLUTE ? cost->turn : cost->slide;
    flops += link->branches ? planar_branches : 0.0;
    return flops + (link->parent ? cost->carried : 0.0);
}

static double rest_of(const kt_link *link, double free) {
    return !link->turned ? 0.0 : link->motion == KT_MOTION_FREE ? free : turned;
}

static double force_links_of(const kt_model *model) {
    double flops = angles_of(model->n.force_link_angle);
    for (size_t i = 1; i < model->n.force_link; i++) {
        const kt_link *link = &model->link[model->force_link[i].link];
        flops += force_link_of[link->motion] + rest_of(link, force_link_rotate_free);
    }
    return flops;
}

static double external_of(const kt_model *model) {
    double flops = 0.0;
    for (size_t b = 1; b < model->n.body && model->n.force_link > 0; b++) {
        const bool planar = (size_t)model->body[b].link >= model->n.spatial;
        flops += planar ? planar_wrench : 0.0;
        flops += model->n.spatial > 1 || !planar ? spatial_wrench : 0.0;
    }
    return flops;
}

/* ---- groups ------------------------------------------------------------------------------------------------------ */

/* Column-pivoted QR of m x k at rank r, a particular solution, the null space, N' M N with its Cholesky factor, and the
 * response to `width` accelerations of the parent. */
static double dense_of(int m, int k, int r, int width) {
    const int f = m - r;
    double flops = 2.0 * m * k, reflect = 0.0, factor = 0.0;
    for (int j = 0; j < r; j++) {
        flops += 4.0 + (m - j - 1) + (k - j) + (k - j - 1) * (6.0 * (m - j - 1) + 2.0);
        reflect += 4.0 * (m - j - 1) + 2.0;
    }
    for (int j = 0; j < f; j++)
        factor += 2.0 * j * (f - j) + 3.0 + (f - j);
    const double solve = 2.0 * f * f + 4.0 * m * f;
    flops += (double)r * r + (1.0 + f) * reflect; /* particular, basis */
    flops += f * (2.0 * m * m + 3.0 * m) + (double)m * f * (f + 1) + factor;
    return flops + 2.0 * m * m + m + solve + width * solve;
}

static double links_of(const kt_model *model, const kt_group *group, const group_cost *cost) {
    double flops = 0.0;
    for (int l = 0; l < group->link_count; l++) {
        const int32_t i = model->group_link[group->link + l];
        const kt_link *link = &model->link[i];
        const int dofs = kt_link_dofs(link);
        flops += link->motion == KT_MOTION_REVOLUTE    ? cost->turn
                 : link->motion == KT_MOTION_PRISMATIC ? cost->slide
                                                       : cost->dof * dofs;
        for (int32_t j = link->parent; j != group->parent; j = model->link[j].parent)
            flops += cost->above * dofs;
    }
    return flops;
}

static double loops_of(const kt_model *model, const kt_group *group, const group_cost *cost) {
    double flops = 0.0;
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const int32_t *slot = model->slot + group->row + loop->row, links = loop->length[0] + loop->length[1];
        int count = 0;
        for (int r = 0; r < loop->row_count; r++)
            count += slot[r] >= 0;
        if (loop->term_count == 0)
            flops += cost->loop + cost->row * loop->row_count + cost->path * links + cost->entry * links * count;
    }
    return flops;
}

static double pin_of(const kt_model *model, const kt_group *group) {
    const kt_loop_record *loop = &model->loop[model->group_loop[group->loop]];
    double flops = pin_turns + (group->parent ? pin_rides : 0.0);
    for (int l = 0; l < group->link_count; l++)
        flops += model->link[model->group_link[group->link + l]].motion == KT_MOTION_PRISMATIC ? pin_slide : 0.0;
    return flops + (loop->length[0] == 0 || loop->length[1] == 0 ? pin_one_path : 0.0);
}

static double group_of(const kt_model *model, const kt_group *group) {
    if (group->pin)
        return pin_of(model, group);
    const bool planar = kt_group_is_planar(model, group);
    const group_cost *cost = planar ? &planar_group : &spatial_group;
    if (group->v_count >= KT_LARGE)
        return (double)NAN;
    return dense_of(group->v_count, group->count[KT_ROWS_ALL], group->rank[KT_ROWS_ALL],
                    !group->parent ? 0
                    : planar       ? 3
                                   : 6) +
           links_of(model, group, cost) + loops_of(model, group, cost);
}

kt_cost kt_cost_of(const kt_model *model) {
    kt_cost cost = {.force_links = model->n.force_link > 0 ? force_links_of(model) : 0.0,
                    .external = external_of(model)};
    cost.angles = angles_of(model->n.spatial_angle) + angles_of(model->n.angle - model->n.spatial_angle);
    for (size_t i = 1; i < model->n.spatial; i++) {
        const kt_link *link = &model->link[i];
        *(link->group < 0 ? &cost.spatial : &cost.spatial_loops) += rest_of(link, turned_free);
        if (link->group < 0)
            cost.spatial += spatial_of(link);
    }
    for (size_t i = 1; i < model->n.planar; i++)
        if (model->planar[i].group < 0)
            cost.planar += planar_of(&model->planar[i], model->n.group ? &planar_closed : &planar_tree);
    for (size_t g = 0; g < model->n.group; g++)
        *(kt_group_is_planar(model, &model->group[g]) ? &cost.planar_loops : &cost.spatial_loops) +=
            group_of(model, &model->group[g]);
    return cost;
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* An end's motion, and its wrench onto its body. */
static const double effect_end = 130.0;

/* The rest, where it takes most: a contact that touches, a stop that is hit. */
static const double effect_own[KT_EFFECT_TYPE_COUNT] = {
    [KT_EFFECT_SPRING] = 28.0,         [KT_EFFECT_JOINT_SPRING] = 7.0, [KT_EFFECT_JOINT_DAMPER] = 4.0,
    [KT_EFFECT_JOINT_FRICTION] = 12.0, [KT_EFFECT_JOINT_LIMIT] = 13.0, [KT_EFFECT_BUSHING] = 290.0,
    [KT_EFFECT_MOTOR] = 3.0,           [KT_EFFECT_DRAG] = 11.0,        [KT_EFFECT_ATTRACTION] = 18.0,
    [KT_EFFECT_CONTACT] = 96.0,
};

static double function_of(const kt_curve *curve) {
    switch (curve->type) {
    case KT_FUNCTION_SINE:
        return 8.0;
    case KT_FUNCTION_RAMP:
        return 20.0;
    case KT_FUNCTION_POLYNOMIAL:
        return 1.0 + 6.0 * curve->count;
    case KT_FUNCTION_TABLE:
        return 16.0;
    case KT_FUNCTION_NONE:
    case KT_FUNCTION_CONSTANT:
        break;
    }
    return 0.0;
}

double kt_cost_of_batch(const kt_model *model, const kt_effect_batch *batch) {
    double flops = 0.0;
    for (int32_t i = batch->first; i < batch->first + batch->count; i++) {
        flops += effect_end * batch->ends + (batch->type == KT_EFFECT_CUSTOM ? 0.0 : effect_own[batch->type]);
        for (int k = 0; k < 3; k++)
            flops += function_of(&model->effect[i].curve[k]);
    }
    return flops;
}
