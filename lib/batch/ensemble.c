/* Several simulations at once: every one has its own state, steps, error control and records, and the stages of their
 * steps are computed together, a simulation a lane.
 *
 * A lane does what kt_simulation_run does, in the same order and by the same functions: it hands records over, plans a
 * try of a step, and accepts or rejects it (kt_attempt of integrator/integrator.h). Only the stages of the tries of all
 * lanes are computed at once, between planning and judging. A lane whose simulation has ended takes the next one; what
 * lanes cannot compute (a step of an implicit method, a stage that fails) is tried by the simulation itself.
 *
 * The recursions in lanes have one model for all lanes: simulations take part whose models differ in nothing but where
 * they start. The others are run one after the other.
 */
#include "batch/batch.h"

#include "algebra/finite.h"
#include "base/copy.h"
#include "simulation/simulation.h"

#include <string.h>

typedef struct kt_ensemble_counts {
    size_t width, nq, nv, body, lane_bytes;
} kt_ensemble_counts;

/* A simulation that runs. */
typedef struct lane {
    kt_ensemble_member member; /* without a simulation: none runs here */
    kt_attempt attempt;
    kt_try tried;
    bool steps;       /* within a step */
    bool shares;      /* its records are computed in lanes, too */
    int64_t waiting;  /* records that have been read, but not handed over yet */
    kt_status status; /* of records that were handed over */
    kt_error error;
} lane;

/* A record whose energies are to be computed. */
typedef struct waiting_record {
    size_t lane;
    kt_record record;
} waiting_record;

#define KT_ENSEMBLE_FIELDS(X)                                                                                          \
    X(lane, lane, n->width, "simulations")                                                                             \
    X(double, t, n->width, "times of a stage")                                                                         \
    X(double, h, n->width, "lengths of steps")                                                                         \
    X(double, y, n->width *(n->nq + n->nv), "states in which steps begin")                                             \
    X(double, stage, n->width *(n->nq + n->nv), "states of a stage")                                                   \
    X(double, stages, n->width *(n->nq + n->nv) * KT_METHOD_STAGES_MAX, "slopes of all stages")                        \
    X(double *, k, KT_METHOD_STAGES_MAX, "slope i of all lanes")                                                       \
    X(double, tau, n->width * n->nv, "joint forces: none")                                                             \
    X(double, total, n->width * n->nv, "joint forces of effects")                                                      \
    X(double, wrench, n->width * 6 * n->body, "wrenches of effects")                                                   \
    X(waiting_record, waiting, n->width, "records that have been read")                                                \
    X(double, read, n->width *(n->nq + n->nv), "their states, one after the other")                                    \
    X(double, read_lanes, n->width *(n->nq + n->nv), "their states in lanes")                                          \
    X(double, energy, 2 * n->width, "kinetic, then potential")                                                         \
    X(char, work, n->lane_bytes, "workspace of the recursions")

struct kt_ensemble {
    void *owned; /* memory of kt_ensemble_create, or NULL */
    const kt_lane_kernels *kernels;
    uint64_t shape; /* of the models */
    kt_ensemble_counts n;
    kt_ensemble_report report;
    size_t read_count; /* records that have been read */
    KT_ARENA_DECLARE(KT_ENSEMBLE_FIELDS)
};

KT_ARENA_LAYOUT(lay_out, kt_ensemble, KT_ENSEMBLE_FIELDS, const kt_ensemble_counts *n)

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static kt_ensemble_counts count(const kt_model *model) {
    const kt_lane_kernels *kernels = kt_lane_kernels_of(model);
    return (kt_ensemble_counts){.width = kernels ? kernels->width : 1,
                                .nq = model->n.q,
                                .nv = model->n.v,
                                .body = kt_where(model->n.force_link, model->n.body),
                                .lane_bytes = kernels ? kernels->layout(model, NULL) : 0};
}

size_t kt_ensemble_size(const kt_model *model) {
    if (!model)
        return 0;
    const kt_ensemble_counts n = count(model);
    return lay_out(NULL, &n);
}

kt_status kt_ensemble_init(const kt_model *model, void *memory, size_t size, kt_ensemble **ensemble, kt_error *error) {
    if (KT_IS_MISSING(error, model, ensemble))
        return KT_ERROR_ARGUMENT;
    const kt_ensemble_counts n = count(model);
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
    if (made->kernels)
        (void)made->kernels->layout(model, made->work);
    for (size_t i = 0; i < KT_METHOD_STAGES_MAX; i++)
        made->k[i] = made->stages + i * n.width * (n.nq + n.nv);
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
    return ensemble ? ensemble->report : (kt_ensemble_report){0, 0, 0, NULL};
}

/* ---- which simulations take part --------------------------------------------------------------------------------- */

static bool are_equal(const void *a, const void *end, const void *b) {
    return memcmp(a, b, (size_t)((const char *)end - (const char *)a)) == 0;
}

/* Whether two models of one shape give every state the same motion, bit by bit: of their arrays, which lie in the order of
 * KT_MODEL_FIELDS, those alone may differ that say where they start, and the table of names, which has pointers. */
static bool moves_alike(const kt_model *a, const kt_model *b) {
    if (a == b)
        return true;
    if (a->bytes != b->bytes || a->kernels != b->kernels || a->forward != b->forward)
        return false;
    for (int k = 0; k < 3; k++)
        if (a->gravity[k] != b->gravity[k])
            return false;
    return are_equal(a->link, a->q0, b->link) && are_equal(a->armature, a->index, b->armature);
}

/* Why a simulation's steps are not computed in lanes; NULL: they are. */
static const char *why_model(const kt_ensemble *e, const kt_model *model) {
    if (!e->kernels || model->n.group > 0)
        return "it has loops, which are closed state by state";
    if (model->shape != e->shape)
        return "its model has another structure";
    if (model->family || kt_own_state_count(model) > 0 || model->n.massless > 0 || kt_mass_curve_count(model) > 0)
        return "it has own states, masses that vary, coordinates without mass, or what is switched";
    if (kt_lanes_have_formulas(model))
        return "it has forces by formulas";
    return model->n.v == 0 ? "nothing moves" : NULL;
}

static const char *why_alone(const kt_ensemble *e, const kt_simulation *s) {
    const char *why = why_model(e, s->model);
    if (why)
        return why;
    if (s->transformation || s->acceleration || s->projection)
        return "its equations are not those of its own model";
    if (s->watch || s->watches_gaps || s->corners.any || s->corners.fixed)
        return "its steps end at events, contacts, stops or corners";
    return s->size.n > s->size.work || s->watches_works ? "works are computed with its motion" : NULL;
}

static const lane *first_lane(const kt_ensemble *e) {
    for (size_t i = 0; i < e->n.width; i++)
        if (e->lane[i].member.simulation)
            return &e->lane[i];
    return NULL;
}

/* Whether a simulation can run with those that do. */
static bool fits(kt_ensemble *e, const kt_simulation *s) {
    const lane *other = first_lane(e);
    const char *why = why_alone(e, s);
    if (!why && other && !moves_alike(other->member.simulation->model, s->model))
        why = "its model differs in more than its initial state";
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
static const kt_method *table_of(const lane *l) {
    const kt_simulation *s = l->member.simulation;
    const kt_method *table = s->integrator->table;
    return s->tau || s->external || kt_method_family_of(table) != &kt_family_explicit ? NULL : table;
}

/* The lanes that take the same step as the first one of them, whose number is *first. */
static kt_lane_mask choose(const kt_ensemble *e, size_t *first) {
    const kt_method *table = NULL;
    kt_lane_mask mask = 0;
    for (size_t i = 0; i < e->n.width; i++) {
        const kt_method *own = e->lane[i].member.simulation ? table_of(&e->lane[i]) : NULL;
        if (!own || (table && own != table))
            continue;
        *first = table ? *first : i;
        table = own;
        mask |= (kt_lane_mask)1 << i;
    }
    return mask;
}

static void gather(kt_ensemble *e, kt_lane_mask mask) {
    const size_t width = e->n.width, N = e->n.nq + e->n.nv;
    for (size_t i = 0; i < width; i++) {
        const kt_interval *in = &e->lane[i].attempt.plan.interval;
        if (!kt_lane_is_in(mask, i))
            continue;
        e->h[i] = in->h;
        kt_lane_put(in->y, width, i, N, e->y);
        kt_lane_put(e->lane[i].member.simulation->integrator->k[0], width, i, N, e->k[0]);
    }
}

/* Slope i of the stages at e->stage. Returns the lanes of `mask` where it could be computed. */
static kt_lane_mask evaluate(kt_ensemble *e, const kt_model *model, double c, kt_lane_mask mask, double *slope) {
    const size_t q = e->n.width * e->n.nq;
    const kt_lane_state at = {.t = e->t, .q = e->stage, .v = e->stage + q, .tau = e->tau, .live = mask};
    const kt_lane_work work = {.lanes = e->work, .total = e->total, .wrench = e->wrench, .a = slope + q};
    for (size_t i = 0; i < e->n.width; i++) {
        const kt_interval *in = &e->lane[i].attempt.plan.interval;
        e->t[i] = c == 1.0 ? in->end : in->t + c * in->h;
    }
    if (e->n.nq == e->n.nv)
        kt_copy(slope, at.v, q * sizeof *slope);
    else
        e->kernels->rate(model, at.q, at.v, slope);
    return kt_lanes_accelerate(e->kernels, model, &at, &work);
}

/* All stages, as kt_explicit_step. */
static kt_lane_mask take_stages(kt_ensemble *e, const kt_simulation *leader, kt_lane_mask mask) {
    const kt_integrator *it = leader->integrator;
    const size_t s = (size_t)it->table->stages, N = e->n.nq + e->n.nv;
    for (size_t i = 1; i < s && mask; i++) {
        e->kernels->combine(e->stage, e->y, e->h, it->terms + it->row[i], it->row[i + 1] - it->row[i], e->k, N);
        mask = evaluate(e, leader->model, it->table->c[i], mask, e->k[i]);
    }
    if (!it->table->fsal)
        e->kernels->combine(e->stage, e->y, e->h, it->terms + it->row[s], it->row[s + 1] - it->row[s], e->k, N);
    return mask;
}

/* Writes the stages of a lane to its integrator; false if one is not finite. */
static bool scatter(const kt_ensemble *e, size_t number) {
    kt_simulation *simulation = e->lane[number].member.simulation;
    kt_integrator *it = simulation->integrator;
    const size_t s = (size_t)it->table->stages, width = e->n.width, N = e->n.nq + e->n.nv;
    bool finite = true;
    for (size_t i = 1; i < s; i++) {
        kt_lane_take(e->k[i], width, number, N, it->k[i]);
        finite = finite && kt_all_finite(it->k[i], N);
    }
    kt_lane_take(e->stage, width, number, N, it->trial);
    simulation->cached = KT_CACHED_NOTHING;
    if (finite)
        it->memory.counts.evaluations += s - 1;
    return finite;
}

/* Tries the steps that are planned in all lanes. */
static void try_steps(kt_ensemble *e) {
    size_t first = 0;
    kt_lane_mask mask = choose(e, &first);
    if ((mask & (mask - 1)) != 0) { /* two or more */
        gather(e, mask);
        mask = take_stages(e, e->lane[first].member.simulation, mask);
    } else {
        mask = 0;
    }
    for (size_t i = 0; i < e->n.width; i++) {
        lane *l = &e->lane[i];
        const kt_interval *in = &l->attempt.plan.interval;
        if (!l->member.simulation)
            continue;
        l->tried = (kt_try){.result = KT_TRY_PASSED};
        if (kt_lane_is_in(mask, i) && scatter(e, i))
            (void)kt_try_check(l->member.simulation->integrator, in, &l->tried);
        else
            (void)kt_try_step(l->member.simulation->integrator, in, &l->tried);
    }
}

/* ---- records ----------------------------------------------------------------------------------------------------- */

/* Whether records of a simulation hold no more than states and energies of bodies. */
static bool shares_records(const kt_simulation *s) {
    return s->record == (s->record & (KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ENERGY)) &&
           (s->record & KT_RECORD_ENERGY) != 0 && !s->places && s->model->n.effect == 0 && !s->model->has_armature;
}

/* Hands a record over whose energies are known; `fine`: they are finite. */
static kt_status give(const kt_ensemble *e, size_t number, bool fine, kt_error *error) {
    kt_record record = e->waiting[number].record;
    const kt_ensemble_member *to = &e->lane[e->waiting[number].lane].member;
    kt_simulation *s = to->simulation;
    const double *y = e->read + number * (e->n.nq + e->n.nv);
    kt_error from = {0};
    if (!fine) {
        kt_copy(s->y, y, s->size.n * sizeof *y);
        return kt_simulation_complete_record(s, KT_OK, &record, &from, to->record, to->user, error);
    }
    record.q = y;
    record.v = y + e->n.nq;
    record.x = record.v + e->n.nv;
    record.work = kt_simulation_work_of(s, y);
    record.kinetic = e->energy[number];
    record.potential = e->energy[e->n.width + number] + 0.0; /* effects store none */
    return kt_simulation_give_record(s, &record, to->record, to->user, error);
}

/* Computes the records that wait, and hands them over in their order, of each simulation until its recorder stops. */
static void give_all(kt_ensemble *e) {
    const size_t q = e->n.width * e->n.nq, count = e->read_count;
    if (count == 0)
        return;
    const kt_model *model = e->lane[e->waiting[0].lane].member.simulation->model;
    const kt_lane_mask fine =
        e->kernels->energy(model, e->work, e->read_lanes, e->read_lanes + q, e->tau, e->energy, e->energy + e->n.width);
    for (size_t i = 0; i < count; i++) {
        lane *l = &e->lane[e->waiting[i].lane];
        l->waiting = 0;
        if (l->status == KT_OK)
            l->status = give(e, i, kt_lane_is_in(fine, i), &l->error);
    }
    e->read_count = 0;
}

/* Adds a record, whose state is in the simulation's y. */
static void add_record(kt_ensemble *e, size_t number, const kt_record *record) {
    const size_t N = e->n.nq + e->n.nv;
    const double *y = e->lane[number].member.simulation->y;
    e->waiting[e->read_count] = (waiting_record){.lane = number, .record = *record};
    e->lane[number].waiting++;
    kt_copy(e->read + e->read_count * N, y, N * sizeof *y);
    kt_lane_put(y, e->n.width, e->read_count, N, e->read_lanes);
    e->read_count++;
}

/* Reads the records of a lane up to the present time. */
static void read_records(kt_ensemble *e, size_t number) {
    lane *l = &e->lane[number];
    const kt_ensemble_member *m = &l->member;
    kt_simulation *s = m->simulation;
    const double now = kt_integrator_time(s->integrator);
    while (l->status == KT_OK) {
        if (e->read_count == e->n.width)
            give_all(e);
        const int64_t k = s->memory.next_record + l->waiting;
        kt_record record;
        kt_error from = {0};
        if (l->status != KT_OK || k >= s->record_count || kt_simulation_record_time(s, k) > now)
            return;
        const kt_status status = kt_simulation_read_record(s, k, &record, &from);
        if (status == KT_OK) {
            add_record(e, number, &record);
            continue;
        }
        give_all(e);
        if (l->status == KT_OK)
            l->status = kt_simulation_complete_record(s, status, &record, &from, m->record, m->user, &l->error);
    }
}

static void hand_over(kt_ensemble *e, size_t number) {
    lane *l = &e->lane[number];
    if (l->shares)
        read_records(e, number);
    else
        l->status = kt_simulation_hand_over(l->member.simulation, l->member.record, l->member.user, &l->error);
}

/* ---- a lane ------------------------------------------------------------------------------------------------------ */

/* A simulation ends where its records have failed, and at its duration. */
static bool has_ended(const lane *l) {
    const kt_simulation *s = l->member.simulation;
    return !l->steps && (l->status != KT_OK || !(kt_integrator_time(s->integrator) < s->duration));
}

static kt_status begin_step(lane *l, kt_error *from) {
    kt_simulation *s = l->member.simulation;
    s->cause.code = KT_OK;
    const kt_status status = s->memory.pending ? kt_simulation_inputs_commit(s, from) : KT_OK;
    l->steps = true;
    return status == KT_OK ? kt_attempt_begin(s->integrator, s->duration, &l->attempt, from) : status;
}

/* Plans the next try. */
static kt_status plan(lane *l, kt_error *error) {
    kt_error from = {0};
    kt_status status = l->steps ? KT_OK : begin_step(l, &from);
    if (status == KT_OK)
        status = kt_attempt_plan(l->member.simulation->integrator, &l->attempt, &from);
    return status == KT_OK ? KT_OK : kt_simulation_end_step(l->member.simulation, status, &from, error);
}

/* Accepts or rejects what was tried. */
static kt_status judge(lane *l, kt_error *error) {
    kt_simulation *s = l->member.simulation;
    kt_error from = {0};
    bool again;
    const kt_status status = kt_attempt_end(s->integrator, &l->attempt, &l->tried, &again, &from);
    if (status == KT_OK && again)
        return KT_OK;
    l->steps = false;
    return kt_simulation_end_step(s, status, &from, error);
}

/* ---- all lanes --------------------------------------------------------------------------------------------------- */

typedef struct source {
    kt_ensemble_next *next;
    kt_ensemble_done *done;
    void *user;
    int pause; /* rounds until `next` is called again after it has had none */
} source;

enum { PAUSE = 16 };

static void end_lane(const source *from, lane *l, kt_status status, const kt_error *error) {
    const kt_ensemble_member member = l->member;
    l->member.simulation = NULL;
    l->steps = false;
    from->done(from->user, &member, status, status == KT_OK ? NULL : error);
}

/* Takes simulations until one fits in; the others are run at once. Returns whether one did. */
static bool take(kt_ensemble *e, source *from, lane *l) {
    const bool none = first_lane(e) == NULL;
    while (none || from->pause == 0) {
        kt_ensemble_member member = {NULL, NULL, NULL};
        kt_error error = {0};
        if (!from->next(from->user, none, &member) || !member.simulation) {
            from->pause = PAUSE;
            return false;
        }
        const bool together = fits(e, member.simulation);
        const kt_status status = together ? kt_simulation_begin_run(member.simulation, &error)
                                          : kt_simulation_run(member.simulation, member.record, member.user, &error);
        if (together && status == KT_OK) {
            *l = (lane){.member = member, .status = KT_OK, .shares = shares_records(member.simulation)};
            return true;
        }
        from->done(from->user, &member, status, status == KT_OK ? NULL : &error);
    }
    return false;
}

/* Hands over all records up to the present, and gives the lanes of simulations that have ended to others. */
static void fill(kt_ensemble *e, source *from) {
    for (bool again = true; again;) {
        again = false;
        for (size_t i = 0; i < e->n.width; i++)
            if (!e->lane[i].steps && (e->lane[i].member.simulation || take(e, from, &e->lane[i])))
                hand_over(e, i);
        give_all(e);
        for (size_t i = 0; i < e->n.width; i++) {
            lane *l = &e->lane[i];
            if (!l->member.simulation || !has_ended(l))
                continue;
            again = true;
            end_lane(from, l, l->status, &l->error);
        }
    }
}

/* Plans a try in every lane; returns how many there are. */
static size_t plan_all(kt_ensemble *e, const source *from) {
    size_t lanes = 0;
    for (size_t i = 0; i < e->n.width; i++) {
        lane *l = &e->lane[i];
        kt_error error = {0};
        const kt_status status = l->member.simulation ? plan(l, &error) : KT_OK;
        lanes += l->member.simulation != NULL;
        if (status != KT_OK)
            end_lane(from, l, status, &error);
    }
    return lanes;
}

static void judge_all(kt_ensemble *e, const source *from) {
    for (size_t i = 0; i < e->n.width; i++) {
        lane *l = &e->lane[i];
        kt_error error = {0};
        const kt_status status = l->member.simulation ? judge(l, &error) : KT_OK;
        if (status != KT_OK)
            end_lane(from, l, status, &error);
    }
}

kt_status kt_ensemble_run(kt_ensemble *e, kt_ensemble_next *next, kt_ensemble_done *done, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, e, next, done))
        return KT_ERROR_ARGUMENT;
    source from = {.next = next, .done = done, .user = user};
    do {
        fill(e, &from);
        from.pause -= from.pause > 0;
        if (plan_all(e, &from) == 0)
            break;
        try_steps(e);
        judge_all(e, &from);
    } while (true);
    return KT_OK;
}
