/* Several simulations at once. Each one has its own state, steps, error control and records. The stages of their steps
 * are computed together, each simulation in a lane.
 *
 * A lane follows kt_simulation_run, in the same order and with the same functions. The lane passes records on, plans a
 * try of a step, and accepts or rejects the try (kt_attempt of integrator/integrator.h). Only the stages of the tries
 * of all lanes are computed at once, between planning and the decision on acceptance. A lane whose simulation has ended
 * continues with the next simulation. Lanes cannot compute a step of an implicit method, or a stage that fails. The
 * simulation itself tries such a step. Events, gaps and breakpoints are handled lane by lane between tries, by the
 * phases of kt_simulation_take_step (step/phases.h).
 *
 * Simulations take part if their models agree in all data that the recursions share between lanes (kt_lanes_agree). The
 * others are run one after the other.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/ensemble_lane.h"

#include "algebra/finite.h"
#include "base/copy.h"

KT_ARENA_LAYOUT(lay_out, kt_ensemble, KT_ENSEMBLE_FIELDS, const kt_ensemble_counts *n)

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static kt_ensemble_counts count_ensemble(const kt_model *model) {
    const kt_lane_kernels *kernels = kt_lane_kernels_of(model);
    return (kt_ensemble_counts){.width = kernels ? kernels->width : 1,
                                .nq = model->n.q,
                                .nv = model->n.v,
                                .nx = model->n.x,
                                .N = model->n.q + model->n.v + model->n.x,
                                .body = kt_where(model->n.force_link, model->n.body),
                                .lane_bytes = kernels ? kernels->layout(model, NULL) : 0};
}

size_t kt_ensemble_size(const kt_model *model) {
    if (!model)
        return 0;
    const kt_ensemble_counts n = count_ensemble(model);
    return lay_out(NULL, &n);
}

kt_status kt_ensemble_init(const kt_model *model, void *memory, size_t size, kt_ensemble **ensemble, kt_error *error) {
    if (KT_IS_MISSING(error, model, ensemble))
        return KT_ERROR_ARGUMENT;
    const kt_ensemble_counts n = count_ensemble(model);
    const kt_status status =
        kt_arena_begin("kt_ensemble_init", "kt_ensemble_size", memory, size, lay_out(NULL, &n), error);
    if (status != KT_OK)
        return status;
    (void)lay_out(memory, &n);
    kt_ensemble *made = memory;
    made->kernels = kt_lane_kernels_of(model);
    made->shape = model->shape;
    made->n = n;
    made->report.width = n.width;
    if (made->kernels) {
        (void)made->kernels->layout(model, made->work);
        made->kernels->put_model(model, made->work, kt_lanes_first(n.width));
    }
    for (size_t i = 0; i < KT_METHOD_STAGES_MAX; i++)
        made->k[i] = made->stages + i * n.width * n.N;
    *ensemble = made;
    return KT_OK;
}

kt_status kt_ensemble_create(const kt_model *model, kt_ensemble **ensemble, kt_error *error) {
    if (KT_IS_MISSING(error, model, ensemble))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_ensemble_size(model);
    void *memory = kt_arena_allocate(size, "the ensemble", error);
    return memory ? kt_arena_own(memory, kt_ensemble_init(model, memory, size, ensemble, error)) : KT_ERROR_MEMORY;
}

void kt_ensemble_free(kt_ensemble *ensemble) { kt_arena_free(ensemble); }

kt_ensemble_report kt_ensemble_report_of(const kt_ensemble *ensemble) {
    return ensemble ? ensemble->report : (kt_ensemble_report){.width = 0};
}

/* ---- which simulations take part --------------------------------------------------------------------------------- */

/* The reason why a simulation's steps are not computed in lanes; NULL: lanes compute them. */
static const char *why_model(const kt_ensemble *e, const kt_model *model) {
    if (model->shape != e->shape)
        return "its joints, loops or effects are not those of the first run";
    if (model->n.loaded > 0)
        return "friction in a joint is proportional to a reaction, which is computed state by state";
    if (!e->kernels || !kt_lanes_fit_model(model))
        return "it has loops or paths that are computed state by state";
    if (model->variants || model->n.massless > 0 || kt_mass_curve_count(model) > 0)
        return "it has masses that vary, coordinates without mass, or switched parts";
    return model->n.v == 0 ? "nothing moves" : NULL;
}

/* As why_model, for all settings of a simulation. */
static const char *fallback_reason_of_member(const kt_ensemble *e, const kt_simulation *s) {
    if (s->contacts != NULL)
        return "it has hard contacts, stops or slack ropes, or friction that sticks";
    const char *why = why_model(e, s->model);
    if (why)
        return why;
    if (s->options.acceleration || s->options.projection)
        return "it integrates equations of the caller";
    return s->size.n > s->size.work || s->works.watches ? "it records or watches the work done (balance)" : NULL;
}

static bool is_empty(const kt_ensemble *e) {
    for (size_t i = 0; i < e->n.width; i++)
        if (e->lane[i].member.simulation)
            return false;
    return true;
}

/* Whether a simulation can run together with the running ones. */
static bool fits_ensemble(kt_ensemble *e, const kt_simulation *s) {
    const kt_ensemble_lane *other = kt_ensemble_first_lane(e);
    const char *why = fallback_reason_of_member(e, s);
    if (!why && other && !kt_lanes_agree(other->member.simulation->model, s->model))
        why = other->revision != other->begun
                  ? "events or recorders have changed the models of those that run, in more than masses, lengths and "
                    "gravity"
                  : "its model differs in more than masses, lengths, gravity and where its motion begins";
    if (why) {
        e->report.alone++;
        e->report.why = why;
    } else {
        e->report.together++;
    }
    return !why;
}

/* ---- tries ------------------------------------------------------------------------------------------------------- */

/* The table of a lane's try, if that is one of lanes: without inputs, by an explicit method. */
static const kt_method *lane_table_of(const kt_ensemble_lane *l) {
    const kt_simulation *s = l->member.simulation;
    const kt_method *table = s->integrator->table;
    return !kt_ensemble_is_current(l) || s->tau || s->external || kt_method_family_of(table) != &kt_family_explicit
               ? NULL
               : table;
}

/* Chooses the lanes that take the same step as the first of these lanes, whose number is *first. */
static kt_lane_mask choose_leading_lanes(const kt_ensemble *e, size_t *first) {
    const kt_method *table = NULL;
    kt_lane_mask mask = 0;
    for (size_t i = 0; i < e->n.width; i++) {
        const kt_method *own = e->lane[i].member.simulation ? lane_table_of(&e->lane[i]) : NULL;
        if (!own || (table && own != table))
            continue;
        *first = table ? *first : i;
        table = own;
        mask |= (kt_lane_mask)1 << i;
    }
    return mask;
}

/* Copies step size, state and first slope of each lane from its simulation to the group. */
static void gather_lane_steps(kt_ensemble *e, kt_lane_mask mask) {
    const size_t width = e->n.width, N = e->n.N;
    for (size_t i = 0; i < width; i++) {
        const kt_interval *in = &e->lane[i].attempt.plan.interval;
        if (!kt_lane_is_in(mask, i))
            continue;
        e->h[i] = in->h;
        kt_lane_put(in->y, width, i, N, e->y);
        kt_lane_put(e->lane[i].member.simulation->integrator->k[0], width, i, N, e->k[0]);
    }
}

/* Slope i of the stages at e->stage. Returns the lanes of `mask` in which the slope could be computed. */
static kt_lane_mask evaluate_members(kt_ensemble *e, const kt_model *model, double c, kt_lane_mask mask,
                                     double *slope) {
    const size_t q = e->n.width * e->n.nq, x = q + e->n.width * e->n.nv;
    const kt_lane_state at = {
        .t = e->t, .q = e->stage, .v = e->stage + q, .x = e->stage + x, .tau = e->tau, .active = mask};
    const kt_lane_work work = {.lanes = e->work, .total = e->total, .wrench = e->wrench, .a = slope + q};
    for (size_t i = 0; i < e->n.width; i++) {
        const kt_interval *in = &e->lane[i].attempt.plan.interval;
        const kt_simulation *s = e->lane[i].member.simulation;
        e->t[i] = c == 1.0 ? in->end : in->t + c * in->h;
        if (kt_lane_is_in(mask, i) && s->breakpoints.any)
            e->t[i] = kt_simulation_time_inside(s, e->t[i]);
    }
    e->kernels->rate(model, e->work, at.q, at.v, slope);
    const kt_lane_mask done = kt_lanes_accelerate(e->kernels, model, &at, &work);
    return e->n.nx > 0 ? done & e->kernels->own_rates(model, e->work, &at, slope + x) : done;
}

/* All stages, as kt_explicit_step. */
static kt_lane_mask take_ensemble_stages(kt_ensemble *e, const kt_simulation *leader, kt_lane_mask mask) {
    const kt_integrator *it = leader->integrator;
    const size_t s = (size_t)it->table->stages, N = e->n.N;
    for (size_t i = 1; i < s && mask; i++) {
        e->kernels->combine(e->stage, e->y, e->h, it->terms + it->row[i], it->row[i + 1] - it->row[i], e->k, N);
        mask = evaluate_members(e, leader->model, it->table->c[i], mask, e->k[i]);
    }
    if (!it->table->fsal)
        e->kernels->combine(e->stage, e->y, e->h, it->terms + it->row[s], it->row[s + 1] - it->row[s], e->k, N);
    return mask;
}

/* Writes the stages of a lane to its integrator. */
static void scatter_lane_stages(const kt_ensemble *e, size_t number) {
    kt_simulation *simulation = e->lane[number].member.simulation;
    kt_integrator *it = simulation->integrator;
    const size_t s = (size_t)it->table->stages, width = e->n.width, N = e->n.N;
    for (size_t i = 1; i < s; i++)
        kt_lane_take(e->k[i], width, number, N, it->k[i]);
    kt_lane_take(e->stage, width, number, N, it->trial);
    simulation->cached = KT_CACHED_NOTHING;
    it->memory.counts.evaluations += s - 1;
    simulation->memory.factorizations += (uint64_t)simulation->groups * (s - 1);
}

/* ---- errors of tries --------------------------------------------------------------------------------------------- */

/* Mean squares of the errors of all lanes. */
static void measure_errors(kt_ensemble *e, const kt_integrator *leader) {
    const size_t *row = leader->row + leader->table->stages, N = e->n.N;
    const kt_lane_scales scales = {.y0 = e->y, .y1 = e->stage, .absolute = e->absolute, .relative = e->relative};
    for (size_t i = 0; i < e->n.width; i++) {
        const kt_simulation *s = e->lane[i].member.simulation;
        e->absolute[i] = s ? s->integrator->options.absolute_tolerance : 1.0;
        e->relative[i] = s ? s->integrator->options.relative_tolerance : 1.0;
    }
    e->kernels->mean_square(e->norm, &scales, leader->terms + row[KT_ROW_E], row[KT_ROW_E + 1] - row[KT_ROW_E], e->k,
                            N);
    if (leader->table->e_low)
        e->kernels->mean_square(e->norm + e->n.width, &scales, leader->terms + row[KT_ROW_E_LOW],
                                row[KT_ROW_E_LOW + 1] - row[KT_ROW_E_LOW], e->k, N);
}

/* Checks the try of a lane, whose new state is finite. The mean squares are those of adaptive steps with one absolute
 * tolerance and without quadratures. */
static void check_lane_try(const kt_ensemble *e, size_t number) {
    kt_ensemble_lane *l = &e->lane[number];
    kt_integrator *it = l->member.simulation->integrator;
    const kt_interval *in = &l->attempt.plan.interval;
    if (it->options.step > 0.0 || it->options.absolute_tolerances || it->counted != e->n.N)
        (void)kt_try_check(it, in, &l->tried);
    else
        (void)kt_try_check_error(
            in, kt_explicit_error(in->h, e->norm[number], it->table->e_low != NULL, e->norm[e->n.width + number]),
            &l->tried);
}

/* Computes the factors by which the next steps may be longer than the accepted tries of some lanes. */
static void find_growths(kt_ensemble *e, kt_lane_mask mask) {
    const size_t width = e->n.width;
    for (size_t i = 0; i < width; i++) {
        const kt_ensemble_lane *l = &e->lane[i];
        const bool known = kt_lane_is_in(mask, i) && l->tried.result == KT_TRY_PASSED && l->tried.error > 0.0;
        const kt_integrator *it = known ? l->member.simulation->integrator : NULL;
        e->base[i] = known ? l->tried.error : 1.0;
        e->base[width + i] = known ? it->memory.control_error : 1.0;
        e->exponent[i] = known ? kt_control_exponent(it) : 1.0;
        e->exponent[width + i] = known ? kt_control_exponent_before(it) : 1.0;
        mask &= ~((kt_lane_mask)!known << i);
    }
    mask &= e->kernels->power(e->base, e->exponent, e->power);
    mask &= e->kernels->power(e->base + width, e->exponent + width, e->power + width);
    for (size_t i = 0; i < width; i++)
        if (kt_lane_is_in(mask, i))
            e->lane[i].tried.growth =
                kt_control_growth(e->lane[i].member.simulation->integrator, e->power[i], e->power[width + i]);
}

/* Computes the stages of the planned steps of two or more lanes. Returns the lanes in which the stages could be
 * computed. */
static kt_lane_mask try_together(kt_ensemble *e) {
    size_t first = 0;
    kt_lane_mask mask = choose_leading_lanes(e, &first);
    if ((mask & (mask - 1)) == 0)
        return 0;
    const kt_simulation *leader = e->lane[first].member.simulation;
    const size_t N = e->n.N, s = (size_t)leader->integrator->table->stages;
    e->table = leader->integrator->table;
    gather_lane_steps(e, mask);
    mask = take_ensemble_stages(e, leader, mask);
    mask &= e->kernels->finite(e->k[1], (s - 1) * N) & e->kernels->finite(e->stage, N);
    measure_errors(e, leader->integrator);
    return mask;
}

/* Tries the steps that are planned in all lanes. */
static void try_steps(kt_ensemble *e) {
    const kt_lane_mask mask = try_together(e);
    for (size_t i = 0; i < e->n.width; i++) {
        kt_ensemble_lane *l = &e->lane[i];
        l->tried = (kt_try){.result = KT_TRY_PASSED};
        l->holds = kt_lane_is_in(mask, i);
        e->report.in_lanes += l->holds;
        e->report.left += !l->holds && l->member.simulation;
        if (l->holds) {
            scatter_lane_stages(e, i);
            check_lane_try(e, i);
        } else if (l->member.simulation) {
            const kt_interval *in = &l->attempt.plan.interval;
            kt_integrator *it = l->member.simulation->integrator;
            if (it->family->try_step(it, in, &l->tried) == KT_TRY_PASSED)
                (void)kt_try_check(it, in, &l->tried);
        }
    }
    if (mask)
        find_growths(e, mask);
}

/* ---- a lane ------------------------------------------------------------------------------------------------------ */

/* A simulation ends if a record has failed, if an event stops the run, or at its duration. */
static bool has_ended(const kt_ensemble_lane *l) {
    const kt_simulation *s = l->member.simulation;
    return !l->steps &&
           (l->status != KT_OK || s->memory.stopped > 0 || !(kt_integrator_time(s->integrator) < s->duration));
}

/* Hands over the records of a lane between two steps, unless the lanes have done so. Events that happened at the
 * present time take effect. */
static kt_status hand_over_lane_records(kt_ensemble_lane *l) {
    const kt_ensemble_member *to = &l->member;
    kt_simulation *s = to->simulation;
    const kt_status status =
        kt_ensemble_shares_now(l) ? KT_OK : kt_simulation_hand_over(s, to->record, to->user, &l->error);
    return status == KT_OK ? kt_simulation_fire(s, to->record, to->user, &l->error) : status;
}

/* Copies the numbers of the lane's model to the lane again, after events or a recorder have changed numbers. Does
 * nothing if lanes no longer compute this model, for example because of a new armature. Also does nothing if the models
 * of other lanes disagree with this model. */
static void renew_numbers(kt_ensemble *e, kt_ensemble_lane *l) {
    const kt_model *model = l->member.simulation->model;
    const kt_ensemble_lane *other = kt_ensemble_first_lane(e);
    if (why_model(e, model) || (other && !kt_lanes_agree(other->member.simulation->model, model)))
        return;
    e->kernels->put_model(model, e->work, other ? (kt_lane_mask)1 << (l - e->lane) : kt_lanes_first(e->n.width));
    l->revision = model->revision;
}

static kt_status begin_attempt(kt_ensemble_lane *l, kt_error *from) {
    kt_simulation *s = l->member.simulation;
    kt_phase_prepare(s, &l->progress);
    return kt_attempt_begin(s->integrator, l->progress.t_limit, &l->attempt, from);
}

/* Begins the next step, as kt_simulation_take_step. */
static kt_status begin_lane_step(kt_ensemble *e, kt_ensemble_lane *l) {
    kt_simulation *s = l->member.simulation;
    kt_ensemble_clear(&e->from);
    if (!kt_ensemble_is_current(l))
        renew_numbers(e, l);
    l->steps = true;
    kt_status status = kt_phase_enter(s, s->duration, &l->progress, &e->from);
    if (status == KT_OK)
        status = kt_phase_begin(s, &e->from);
    if (status == KT_OK)
        status = begin_attempt(l, &e->from);
    return status == KT_OK ? KT_OK : kt_phase_end(s, status, &e->from, &l->error);
}

/* Accepts or rejects the tried step. A step in which an event happens is repeated up to the event. */
static kt_status end_lane_try(kt_ensemble *e, kt_ensemble_lane *l) {
    kt_simulation *s = l->member.simulation;
    bool again;
    kt_ensemble_clear(&e->from);
    kt_status status = kt_attempt_end(s->integrator, &l->attempt, &l->tried, &again, &e->from);
    if (status == KT_OK && again)
        return KT_OK;
    if (status == KT_OK)
        status = kt_phase_check(s, &l->progress, &again, &e->from);
    if (status == KT_OK && again)
        status = begin_attempt(l, &e->from);
    if (status == KT_OK && again)
        return KT_OK;
    l->steps = false;
    return kt_phase_end(s, status, &e->from, &l->error);
}

/* ---- all lanes --------------------------------------------------------------------------------------------------- */

typedef struct source {
    kt_ensemble_next *next;
    kt_ensemble_done *done;
    void *user;
    int pause; /* rounds until `next` is called again after it has had none */
} source;

enum { PAUSE = 16 };

/* Frees the lane, and reports the end of its simulation to the caller. */
static void end_lane(const source *from, kt_ensemble_lane *l, kt_status status, const kt_error *error) {
    const kt_ensemble_member member = l->member;
    l->member.simulation = NULL;
    l->steps = false;
    from->done(from->user, &member, status, status == KT_OK ? NULL : error);
}

/* Takes simulations until one fits in; the others are run at once. Returns whether one did. */
static bool take_next_simulation(kt_ensemble *e, source *from, kt_ensemble_lane *l) {
    const bool none = is_empty(e);
    while (none || from->pause == 0) {
        kt_ensemble_member member = {NULL, NULL, NULL};
        kt_error error = {0};
        if (!from->next(from->user, none, &member) || !member.simulation) {
            from->pause = PAUSE;
            return false;
        }
        const bool together = fits_ensemble(e, member.simulation);
        const kt_status status = together ? kt_simulation_begin_run(member.simulation, &error)
                                          : kt_simulation_run(member.simulation, member.record, member.user, &error);
        if (together && status == KT_OK) {
            const kt_model *model = member.simulation->model;
            const bool alone = kt_ensemble_first_lane(e) == NULL; /* then all lanes get these numbers */
            *l = (kt_ensemble_lane){.member = member,
                                    .revision = model->revision,
                                    .begun = model->revision,
                                    .shares = kt_ensemble_shares_records(member.simulation)};
            e->kernels->put_model(model, e->work,
                                  alone ? kt_lanes_first(e->n.width) : (kt_lane_mask)1 << (l - e->lane));
            return true;
        }
        from->done(from->user, &member, status, status == KT_OK ? NULL : &error);
    }
    return false;
}

/* Hands over all records up to the present, and gives the lanes of simulations that have ended to others. */
static void fill_idle_lanes(kt_ensemble *e, source *from) {
    for (bool again = true; again;) {
        again = false;
        for (size_t i = 0; i < e->n.width; i++) {
            kt_ensemble_lane *l = &e->lane[i];
            if (!l->steps && !l->member.simulation)
                (void)take_next_simulation(e, from, l);
        }
        kt_ensemble_give_records(e);
        for (size_t i = 0; i < e->n.width; i++) {
            kt_ensemble_lane *l = &e->lane[i];
            if (!l->member.simulation)
                continue;
            if (!l->steps && l->status == KT_OK)
                l->status = hand_over_lane_records(l);
            if (!has_ended(l))
                continue;
            again = true;
            end_lane(from, l, l->status, &l->error);
        }
    }
}

/* Begins a step in every lane that is between two steps; returns the number of lanes. */
static size_t begin_all(kt_ensemble *e, const source *from) {
    size_t lanes = 0;
    for (size_t i = 0; i < e->n.width; i++) {
        kt_ensemble_lane *l = &e->lane[i];
        const kt_status status = l->member.simulation && !l->steps ? begin_lane_step(e, l) : KT_OK;
        lanes += l->member.simulation != NULL;
        if (status != KT_OK)
            end_lane(from, l, status, &l->error);
    }
    return lanes;
}

/* Ends the try of each lane: accepts the step, plans another try, or ends the lane with its error. */
static void end_tries(kt_ensemble *e, const source *from) {
    for (size_t i = 0; i < e->n.width; i++) {
        kt_ensemble_lane *l = &e->lane[i];
        const kt_status status = l->member.simulation ? end_lane_try(e, l) : KT_OK;
        if (status != KT_OK)
            end_lane(from, l, status, &l->error);
    }
}

kt_status kt_ensemble_run(kt_ensemble *e, kt_ensemble_next *next, kt_ensemble_done *done, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, e, next, done))
        return KT_ERROR_ARGUMENT;
    source from = {.next = next, .done = done, .user = user};
    do {
        fill_idle_lanes(e, &from);
        from.pause -= from.pause > 0;
        if (begin_all(e, &from) == 0)
            break;
        try_steps(e);
        end_tries(e, &from);
    } while (true);
    return KT_OK;
}
