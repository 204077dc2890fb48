/* Plans the groups that are reduced by fronts (reduction/front.h): the order in which a front takes their links, the
 * parts that are complete after each link, and the memory.
 *
 * A link may be taken when its parent has been taken. The link is then active until all its children have been taken
 * and all loops on it are complete. The front holds the accelerations of the active links as functions of its
 * parameters. The cost grows with the cube of their number, so that several orders are compared by their operations.
 * The first order keeps the number of active links low at each link, the second is that of the model, the third is by
 * depth.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "constraint/group.h"
#include "reduction/delassus.h"
#include "reduction/front4.h"

#include <string.h>

/* The cost of a step of the elimination, in operations, in addition to the counted operations. */
#define STEP_FLOPS 300.0

/* From this number of coordinates on, few equations are solved faster with their links in the tree
 * (reduction/delassus.h). Microseconds for one evaluation of a rope:
 *
 * | rods, joints    | few eq. | dense |
 * | 10, in a plane  | 1.0     | 1.9   |
 * | 10, in space    | 1.5     | 2.5   |
 * | 10, spherical   | 1.9     | 19    |
 * | 4, spherical    | 1.4     | 2.8   |
 * | 5, in a plane   | 0.8     | 0.8   | */
#define DELASSUS_COORDINATES 10

typedef struct planner {
    kt_attach *a;
    kt_model *m;
    const kt_group *group;
    const int32_t *link; /* of the group */
    int32_t count;
} planner;

static bool is_in_group(const planner *p, int32_t link) { return link != p->group->parent; }

static const kt_loop_record *planned_loop_of(const planner *p, int i) {
    return &p->m->loop[p->m->group_loop[p->group->loop + i]];
}

/* ---- the links and loops of a group ------------------------------------------------------------------------------ */

/* Puts an end of a loop at the head of the list of ends on its link. */
static void add_end(const planner *p, int32_t loop, int end) {
    const int32_t link = p->m->loop[loop].link[end], at = 2 * loop + end;
    if (!is_in_group(p, link))
        return;
    p->a->next_end[at] = p->a->end[link];
    p->a->end[link] = at + 1;
}

/* Lists the children of each link within the group, and the ends of loops on each link. */
static void list_children(const planner *p) {
    for (int l = 0; l < p->count; l++)
        p->a->child[p->link[l]] = p->a->end[p->link[l]] = 0;
    for (int l = p->count - 1; l >= 0; l--) {
        const int32_t i = p->link[l], up = p->m->link[i].parent;
        if (!is_in_group(p, up))
            continue;
        p->a->sibling[i] = p->a->child[up];
        p->a->child[up] = i;
    }
    for (int i = p->group->loop_count - 1; i >= 0; i--) {
        const int32_t loop = p->m->group_loop[p->group->loop + i];
        for (int k = 0; k < 2 && !p->m->loop[loop].term_count; k++)
            add_end(p, loop, k);
    }
}

/* ---- orders ------------------------------------------------------------------------------------------------------ */

static void order_as_in_model(const planner *p) { memcpy(p->a->order, p->link, (size_t)p->count * sizeof *p->link); }

/* Orders links by depth; links of equal depth keep the order of the model. */
static void order_by_depth(const planner *p) {
    kt_attach *a = p->a;
    const int32_t top = a->depth[p->group->parent] + 1;
    memset(a->change, 0, (size_t)(p->count + 1) * sizeof *a->change);
    for (int l = 0; l < p->count; l++)
        a->change[a->depth[p->link[l]] - top + 1]++;
    for (int l = 0; l < p->count; l++)
        a->change[l + 1] += a->change[l];
    for (int l = 0; l < p->count; l++)
        a->order[a->change[a->depth[p->link[l]] - top]++] = p->link[l];
}

static bool link_is_taken(const planner *p, int32_t link) { return !is_in_group(p, link) || p->a->step[link] >= 0; }

/* The change of the number of active links if i is taken: i opens, and other links may close. */
static int32_t opening(const planner *p, int32_t i) {
    const kt_attach *a = p->a;
    const int32_t up = p->m->link[i].parent;
    int32_t own = a->waiting[i], more = 0;
    if (is_in_group(p, up) && a->waiting[up] == 1)
        more--;
    for (int32_t e = a->end[i]; e; e = a->next_end[e - 1]) {
        const int32_t other = p->m->loop[(e - 1) / 2].link[e % 2];
        if (!link_is_taken(p, other) || other == i)
            continue;
        own--;
        more -= is_in_group(p, other) && a->waiting[other] == 1;
    }
    return more + (own > 0);
}

/* Puts link i at position `at` of the order. `waiting` counts the children and the partners in loops that come later
 * and need the link. */
static void take_link(const planner *p, int32_t i, int32_t at) {
    kt_attach *a = p->a;
    const int32_t up = p->m->link[i].parent;
    a->step[i] = at;
    a->order[at] = i;
    if (is_in_group(p, up))
        a->waiting[up]--;
    for (int32_t e = a->end[i]; e; e = a->next_end[e - 1]) {
        const int32_t other = p->m->loop[(e - 1) / 2].link[e % 2];
        if (!link_is_taken(p, other) || other == i)
            continue;
        a->waiting[i]--;
        if (is_in_group(p, other))
            a->waiting[other]--;
    }
}

/* The link to be taken before `link` can be. */
static int32_t first_towards(const planner *p, int32_t link) {
    while (!link_is_taken(p, p->m->link[link].parent))
        link = p->m->link[link].parent;
    return link;
}

typedef struct choice {
    int32_t link, activates, pending, next; /* next: which of the active links it is next to */
} choice;

/* Replaces *best by link i if that is the better next link. The first difference decides: i activates fewer links,
 * fewer later links need i, i is next to the link that was activated later, or the index of i is lower. */
static void consider(const planner *p, int32_t i, int32_t next, choice *best) {
    if (link_is_taken(p, i) || !link_is_taken(p, p->m->link[i].parent))
        return;
    const choice c = {.link = i, .activates = opening(p, i), .pending = p->a->waiting[i], .next = next};
    const int32_t order[][2] = {
        {best->activates, c.activates}, {best->pending, c.pending}, {c.next, best->next}, {best->link, c.link}};
    size_t k = 0;
    while (k + 1 < sizeof order / sizeof *order && order[k][0] == order[k][1])
        k++;
    if (!best->link || order[k][0] > order[k][1])
        *best = c;
}

/* Among the neighbours of active links, takes the link after which the fewest links are active. If several are
 * equal, the link that the fewest other links need is taken, then the link next to that activated last. If a row forks,
 * one branch is thus ended before the other is begun. The number of active links is then the number of forks above each
 * other, not the number of branches. */
static void order_by_width(const planner *p) {
    kt_attach *a = p->a;
    int32_t active_count = 0, lowest = 0, *active = a->last_use;
    for (int l = 0; l < p->count; l++) {
        const int32_t i = p->link[l];
        a->step[i] = -1;
        a->waiting[i] = 0;
        for (int32_t j = a->child[i]; j; j = a->sibling[j])
            a->waiting[i]++;
        for (int32_t e = a->end[i]; e; e = a->next_end[e - 1])
            a->waiting[i]++;
    }
    for (int32_t at = 0; at < p->count; at++) {
        choice best = {0};
        for (int32_t n = 0; n < active_count; n++) {
            for (int32_t j = a->child[active[n]]; j; j = a->sibling[j])
                consider(p, j, n, &best);
            for (int32_t e = a->end[active[n]]; e; e = a->next_end[e - 1]) {
                const int32_t other = p->m->loop[(e - 1) / 2].link[e % 2];
                if (!link_is_taken(p, other))
                    consider(p, first_towards(p, other), n, &best);
            }
        }
        while (!best.link) {
            consider(p, p->link[lowest], -1, &best);
            lowest += best.link ? 0 : 1;
        }
        take_link(p, best.link, at);
        active[active_count++] = best.link;
        int32_t kept = 0;
        for (int32_t n = 0; n < active_count; n++)
            if (a->waiting[active[n]] > 0)
                active[kept++] = active[n];
        active_count = kept;
    }
}

/* ---- the cost of an order ---------------------------------------------------------------------------------------- */

static int32_t later(int32_t a, int32_t b) { return a > b ? a : b; }

/* Determines after which step each loop is complete and each link released. */
static void measure_order(const planner *p, const int32_t *order) {
    kt_attach *a = p->a;
    for (int32_t l = 0; l < p->count; l++)
        a->step[order[l]] = l;
    memset(a->begun, 0, (size_t)(p->count + 1) * sizeof *a->begun);
    for (int i = 0; i < p->group->loop_count; i++) {
        const int32_t index = p->m->group_loop[p->group->loop + i];
        const kt_loop_record *loop = &p->m->loop[index];
        int32_t last = 0, first = p->count;
        for (int k = 0; k < loop->term_count; k++) {
            const int32_t step = a->step[p->m->term[loop->term + k].link];
            first = step < first ? step : first;
            last = later(last, step);
        }
        for (int k = 0; k < 2 && !loop->term_count; k++)
            if (is_in_group(p, loop->link[k]))
                last = later(last, a->step[loop->link[k]]);
        a->complete[index] = last;
        if (loop->term_count) {
            a->begun[first]++;
            a->begun[last]--;
        }
    }
    for (int32_t l = p->count - 1; l >= 0; l--) {
        const int32_t i = order[l];
        a->last_use[i] = l;
        for (int32_t j = a->child[i]; j; j = a->sibling[j])
            a->last_use[i] = later(a->last_use[i], a->step[j]);
        for (int32_t e = a->end[i]; e; e = a->next_end[e - 1])
            a->last_use[i] = later(a->last_use[i], a->complete[(e - 1) / 2]);
    }
}

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

/* The equations of a loop that is not void in a plane. */
static size_t loop_equations_of(const planner *p, int32_t loop) {
    const bool flat = p->group->planar && !p->m->loop[loop].term_count;
    return (size_t)(flat ? p->m->planar_loop[loop].count : p->m->loop[loop].row_count);
}

/* The number of active links after each step, in a->change; the numbers of equations that complete loops add, in
 * a->slot. */
static void count_open(const planner *p) {
    kt_attach *a = p->a;
    int32_t open = 0;
    memset(a->change, 0, (size_t)(p->count + 1) * sizeof *a->change);
    memset(a->slot, 0, (size_t)p->count * sizeof *a->slot);
    for (int l = 0; l < p->count; l++)
        a->change[a->last_use[p->link[l]]]++;
    for (int l = 0; l < p->count; l++) {
        open += 1 - a->change[l];
        a->change[l] = open;
    }
    for (int i = 0; i < p->group->loop_count; i++) {
        const int32_t loop = p->m->group_loop[p->group->loop + i];
        a->slot[a->complete[loop]] += (int32_t)loop_equations_of(p, loop);
    }
}

/* Operations of an elimination, if all equations are independent. */
static double flops_of(const planner *p, const int32_t *order) {
    const double base = p->group->planar ? KT_FRONT_SPACE / 2 : KT_FRONT_SPACE;
    double n = 0.0, sum = 0.0, relations = 0.0;
    measure_order(p, order);
    count_open(p);
    for (int32_t l = 0; l < p->count; l++) {
        n += kt_link_dofs(&p->m->link[order[l]]);
        relations += p->a->begun[l];
        const double k = fmin(p->a->slot[l], n), vectors = base * p->a->change[l] + relations;
        sum += STEP_FLOPS + 2.0 * n * base * (base + n) + k * n * (6.0 * n + 4.0 * vectors + 2.0 * k);
        n -= k;
        if (n <= vectors)
            continue;
        sum += vectors * n * (6.0 * n + 2.0 * vectors) + n * (n - vectors) * n;
        n = vectors;
    }
    return sum;
}

/* Whether this order's fronts fit into registers (form.c), if all equations are independent. */
static bool order_fits_front4(const planner *p, const int32_t *order) {
    int32_t params = 0;
    bool fits = p->group->parent == 0 && p->group->planar;
    measure_order(p, order);
    count_open(p);
    for (int32_t l = 0; l < p->count && fits; l++) {
        const int32_t rows = p->a->slot[l];
        params += kt_link_dofs(&p->m->link[order[l]]);
        fits = params <= KT_FRONT4_PARAMS && rows <= KT_FRONT4_ROWS && rows <= params && p->a->begun[l] == 0;
        params = p->a->change[l] ? params - rows : 0;
    }
    return fits;
}

/* Whether the group is solved by reduction/delassus.h (form.c), if all equations are independent, and this
 * takes less time than dense matrices. */
static bool fits_delassus(const planner *p) {
    size_t count = 0;
    bool fits =
        p->group->parent == 0 && p->group->v_count >= DELASSUS_COORDINATES && p->group->loop_count <= KT_DELASSUS_MAX;
    for (int i = 0; i < p->group->loop_count && fits; i++)
        count += loop_equations_of(p, p->m->group_loop[p->group->loop + i]);
    for (int l = 0; l < p->count && fits; l++)
        fits = p->m->link[p->link[l]].motion != KT_MOTION_FREE;
    return fits && count <= KT_DELASSUS_MAX;
}

/* Operations of the dense form: the factors of A', Q2, M Q2 and Q2' M Q2, and the factors of the reduced inertia. */
static double dense_flops(const planner *p) {
    double m = p->group->v_count, k = 0.0;
    for (int i = 0; i < p->group->loop_count; i++)
        k += (double)loop_equations_of(p, p->m->group_loop[p->group->loop + i]);
    const double rank = fmin(m, k), free = m - rank;
    return 4.0 * m * k * rank + 4.0 * m * rank * free + 2.0 * m * m * free + m * free * free + free * free * free / 3.0;
}

/* ---- the plan ---------------------------------------------------------------------------------------------------- */

/* Sorts the group's loops and links by the steps that complete a loop or use a link last, and gives each active link a
 * slot. */
static void write_steps(const planner *p, kt_front_plan *plan, const int32_t *order, int32_t first_loop) {
    kt_attach *a = p->a;
    kt_model *m = p->m;
    kt_front_step *step = m->front + plan->step;
    int32_t *vacant = a->order, vacancies = 0, left = plan->step, loop = first_loop;
    memset(a->change, 0, (size_t)(p->count + 1) * sizeof *a->change);
    memset(a->begun, 0, (size_t)(p->count + 1) * sizeof *a->begun);
    for (int l = 0; l < p->count; l++)
        a->change[a->last_use[p->link[l]]]++;
    for (int i = 0; i < p->group->loop_count; i++)
        a->begun[a->complete[m->group_loop[p->group->loop + i]]]++;
    for (int32_t l = 0; l < p->count; l++) {
        step[l] = (kt_front_step){.link = order[l], .up = -1, .loop = loop, .last_use = left};
        loop += a->begun[l];
        left += a->change[l];
    }
    for (int i = 0; i < p->group->loop_count; i++) {
        const int32_t index = m->group_loop[p->group->loop + i];
        kt_front_step *at = &step[a->complete[index]];
        m->front_loop[at->loop + at->loop_count++] = index;
    }
    for (int32_t l = 0; l < p->count; l++) { /* the links, by the steps of their last use */
        kt_front_step *at = &step[a->last_use[order[l]]];
        m->front_last_use[at->last_use + at->last_use_count++] = order[l];
    }
    for (int32_t l = 0; l < p->count; l++) {
        const int32_t up = m->link[order[l]].parent;
        a->slot[order[l]] = step[l].slot = vacancies ? vacant[--vacancies] : plan->slots++;
        m->front_step[p->group->v + m->link[order[l]].local] = l;
        step[l].up = is_in_group(p, up) ? a->step[up] : -1;
        for (int32_t i = step[l].last_use; i < step[l].last_use + step[l].last_use_count; i++) {
            vacant[vacancies++] = a->slot[m->front_last_use[i]];
            m->front_last_use[i] = a->step[m->front_last_use[i]];
        }
    }
}

/* Sorts the terms of the group's relations by the steps of their links. */
static void write_relation_terms(const planner *p, kt_front_plan *plan, int32_t first_term) {
    kt_attach *a = p->a;
    kt_model *m = p->m;
    kt_front_step *step = m->front + plan->step;
    int32_t term = first_term;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < p->group->loop_count; i++) {
            const int32_t index = m->group_loop[p->group->loop + i];
            const kt_loop_record *loop = &m->loop[index];
            if (loop->term_count && !pass)
                a->relation[index] = plan->relations++;
            int32_t first = p->count;
            for (int k = 0; k < loop->term_count; k++)
                first = first < a->step[m->term[loop->term + k].link] ? first : a->step[m->term[loop->term + k].link];
            for (int k = 0; k < loop->term_count; k++) {
                kt_front_step *at = &step[a->step[m->term[loop->term + k].link]];
                if (!pass) {
                    at->term_count++;
                    continue;
                }
                bool begins = at == &step[first];
                for (int32_t n = 0; n < at->term_count && begins; n++)
                    begins = m->front_term[at->term + n].loop != index;
                m->front_term[at->term + at->term_count++] =
                    (kt_front_term){.loop = index, .term = loop->term + k, .slot = a->relation[index], .first = begins};
            }
        }
        for (int32_t l = 0; l < p->count && !pass; l++) {
            step[l].term = term;
            term += step[l].term_count;
            step[l].term_count = 0;
        }
    }
}

/* Counts the arrays that all steps of a group share:
 *   - the contents of the slots, by parameters and constant, and a copy of their coupled part;
 *   - the energy, its linear part, and the size of its terms;
 *   - a solution, and the sizes of speeds;
 *   - intermediate results. */
static size_t shared_count(const kt_front_plan *plan) {
    const size_t stride = (size_t)plan->stride, width = (size_t)plan->width;
    return plan->vectors * (width + 1) + width * width + 2 * (size_t)plan->slots + stride * stride +
           (4 + KT_FRONT_SPACE) * stride;
}

/* Determines the most memory that the steps can need. */
static void write_sizes(const kt_model *m, kt_front_plan *plan, int32_t count) {
    kt_front_step *step = m->front + plan->step;
    size_t kept = 0, open = 0, relations = 0, width = 0, used = 0;
    for (int32_t l = 0; l < count; l++) {
        kt_front_size s = {.params = kept + (size_t)kt_link_dofs(&m->link[step[l].link])};
        for (int32_t i = 0; i < step[l].loop_count; i++)
            s.rows += (size_t)m->loop[m->front_loop[step[l].loop + i]].row_count;
        s.rows += s.rows ? (size_t)plan->delayed_most : 0;
        open += 1 - (size_t)step[l].last_use_count;
        for (int32_t i = 0; i < step[l].term_count; i++)
            relations += m->front_term[step[l].term + i].first;
        for (int32_t i = 0; i < step[l].loop_count; i++)
            relations -= m->loop[m->front_loop[step[l].loop + i]].term_count > 0;
        s.vectors = KT_FRONT_SPACE * open + relations + (size_t)plan->delayed_most;
        s.kept = kept = least(s.params, s.vectors);
        width = s.params > width ? s.params : width;
        step[l].at = used;
        used += kt_front_step_count(&s);
    }
    plan->width = kt_front_padded((int32_t)width);
    plan->stride = kt_front_padded(plan->width + KT_FRONT_SPACE);
    plan->vectors = KT_FRONT_SPACE * (size_t)plan->slots + (size_t)plan->relations + (size_t)plan->delayed_most;
    plan->shared = used;
    plan->count = used + shared_count(plan);
}

/* Determines at which steps equations may be delayed: the steps that complete an equation which the step does not need
 * at generic positions. A group that cannot move may have been sampled in another assembly, so that every step counts.
 * Returns whether such a step exists. */
static bool find_equation_delays(kt_model *m, const kt_group *group, int rows) {
    const size_t first = (size_t)rows * m->n.front + (size_t)group->front.step;
    const int32_t *cap = m->front_cap + first;
    const bool rigid = group->rank[rows] == group->v_count;
    bool delays = false, any = false;
    for (int32_t l = group->link_count - 1; l >= 0; l--) {
        const kt_front_step *step = &m->front[group->front.step + l];
        int32_t count = 0;
        for (int32_t i = step->loop; i < step->loop + step->loop_count; i++) {
            const kt_loop_record *loop = &m->loop[m->front_loop[i]];
            for (int32_t r = 0; r < loop->row_count; r++) {
                const int32_t slot = m->slot[loop->slot + r];
                count += slot >= 0 && slot < group->count[rows];
            }
        }
        m->front_may_delay[first + (size_t)l] = delays;
        any = any || (delays && count > 0);
        delays = delays || count > cap[l] - (l ? cap[l - 1] : 0) || (count > 0 && rigid);
    }
    return any;
}

void kt_fronts_find_delays(kt_model *m) {
    for (size_t g = 0; g < m->n.group; g++) {
        kt_group *group = &m->group[g];
        bool any = false;
        for (int rows = 0; rows < KT_ROWS_COUNT && group->has_fronts; rows++)
            any = find_equation_delays(m, group, rows) || any;
        group->front.delayed_most = any ? KT_FRONT_DELAYED_MOST : 0;
        if (any)
            write_sizes(m, &group->front, group->link_count);
    }
}

void kt_attach_plan_fronts(kt_attach *a, kt_model *m) {
    static void (*const orders[])(const planner *) = {order_by_width, order_as_in_model, order_by_depth};
    int32_t step = 0, loop = 0, term = 0;
    for (size_t g = 0; g < m->n.group; g++) {
        kt_group *group = &m->group[g];
        const planner p = {
            .a = a, .m = m, .group = group, .link = m->group_link + group->link, .count = group->link_count};
        double flops = (double)INFINITY;
        group->front = (kt_front_plan){.step = step};
        list_children(&p);
        for (size_t k = 0; k < sizeof orders / sizeof *orders; k++) {
            orders[k](&p);
            const double of = flops_of(&p, a->order);
            if (of < flops)
                memcpy(a->best, a->order, (size_t)p.count * sizeof *a->best);
            flops = fmin(flops, of);
        }
        const kt_form_estimate estimate = {.front_flops = flops,
                                           .dense_flops = dense_flops(&p),
                                           .fits_delassus = fits_delassus(&p),
                                           .is_front4 = order_fits_front4(&p, a->best)};
        if (!kt_form_is_front(m, group, &estimate))
            continue;
        measure_order(&p, a->best);
        write_steps(&p, &group->front, a->best, loop);
        write_relation_terms(&p, &group->front, term);
        write_sizes(m, &group->front, p.count);
        step += p.count;
        loop += group->loop_count;
        for (int i = 0; i < group->loop_count; i++)
            term += planned_loop_of(&p, i)->term_count;
    }
}

void kt_groups_place_matrices(kt_model *m) {
    m->n.dense = 0;
    for (size_t g = 0; g < m->n.group; g++) {
        m->group[g].dense = m->n.dense;
        m->n.dense += kt_group_layout(&m->group[g]);
    }
}
