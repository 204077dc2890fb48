/* Records of the simulations of an ensemble, computed in lanes.
 *
 * A record that holds no more than a state and energies of bodies shares the lanes. The state of such a record is the
 * dense output of the step that the lanes hold. The kinetic and the potential energies of all lanes are then computed
 * at once. Other records are computed by the simulation itself. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/ensemble_lane.h"

#include "base/copy.h"
#include "effect/effect.h"

/* Whether effects have no potential energy. A law in C may fail, so that the record fails, too. */
static bool store_none(const kt_model *model) {
    for (size_t i = 0; i < model->n.effect; i++)
        if (!kt_effect_kind_of(model->effect[i].type)->stores_none || (model->effect[i].law))
            return false;
    return true;
}

bool kt_ensemble_shares_records(const kt_simulation *s) {
    return s->model->n.group == 0 && !s->breakpoints.fixed &&
           s->records.bits == (s->records.bits & (KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ENERGY)) &&
           (s->records.bits & KT_RECORD_ENERGY) != 0 && !s->records.places && store_none(s->model) &&
           !s->model->has_armature;
}

/* Whether the state of a record is the dense output of the step that the lanes hold, with no loops to close. */
static bool is_dense(const kt_ensemble_lane *l) {
    const kt_simulation *s = l->member.simulation;
    const kt_integrator *it = s->integrator;
    return l->holds && it->stages_known && it->gives_end_derivative && it->derivative_slot == (int)it->fresh &&
           it->table->dense_stages == 0 && s->size.quaternion == 0 && !s->closes_loops && !s->memory.refined;
}

/* Begins the next record, without a state. Other members keep the values of the record before, or are empty. */
static void begin_record(kt_ensemble_lane *l) {
    kt_simulation *s = l->member.simulation;
    const int64_t k = s->memory.next_record;
    if (!l->record.model) {
        kt_simulation_begin_record(s, k, &l->record);
        return;
    }
    l->record.index = k;
    l->record.t = kt_simulation_record_time(s, k);
}

/* Reads the record of a lane if one is due, and returns whether it is. Reads the state or, if *dense, the position of
 * the record in the step. */
static bool read_lane_record(kt_ensemble *e, size_t number, bool *dense) {
    kt_ensemble_lane *l = &e->lane[number];
    const kt_ensemble_member *m = &l->member;
    kt_simulation *s = m->simulation;
    const kt_integrator_memory *at = &s->integrator->memory;
    if (!kt_simulation_owes_record(s))
        return false;
    *dense = is_dense(l);
    if (*dense) {
        begin_record(l);
        e->theta[number] =
            l->record.t == at->t ? KT_LANE_AT_END : (l->record.t - at->previous_t) / (at->t - at->previous_t);
        return true;
    }
    kt_ensemble_clear(&e->from);
    const kt_status status = kt_simulation_read_record(s, s->memory.next_record, &l->record, &e->from);
    if (status == KT_OK)
        return true;
    l->status = kt_simulation_complete_record(s, status, &l->record, &e->from, m->record, m->user, &l->error);
    return false;
}

bool kt_ensemble_shares_now(const kt_ensemble_lane *l) {
    return l->member.simulation && l->shares && kt_ensemble_is_current(l);
}

/* Reads the next record of each lane that is due. Returns of which lanes there is one, its state being in e->read. */
static kt_lane_mask read_lane_records(kt_ensemble *e) {
    const size_t width = e->n.width, N = e->n.N;
    kt_lane_mask due = 0, sparse = 0;
    for (size_t i = 0; i < width; i++) {
        const kt_ensemble_lane *l = &e->lane[i];
        bool dense = false;
        const bool is_due =
            kt_ensemble_shares_now(l) && !l->steps && l->status == KT_OK && read_lane_record(e, i, &dense);
        due |= (kt_lane_mask)is_due << i;
        sparse |= (kt_lane_mask)(is_due && !dense) << i;
    }
    if (due & ~sparse)
        e->kernels->interpolate(e->read, &(kt_lane_step){.method = e->table, .h = e->h, .y0 = e->y, .y1 = e->stage},
                                e->theta, e->k, N);
    for (size_t i = 0; i < width; i++)
        if (kt_lane_is_in(sparse, i))
            kt_lane_put(e->lane[i].member.simulation->y, width, i, N, e->read);
    return due;
}

/* Passes a record on after its energies have been computed; `fine`: the energies are finite. */
static kt_status give_lane_record(kt_ensemble *e, size_t number, bool fine) {
    kt_ensemble_lane *l = &e->lane[number];
    const kt_ensemble_member *to = &l->member;
    kt_simulation *s = to->simulation;
    kt_record *record = &l->record;
    kt_lane_take(e->read, e->n.width, number, e->n.N, e->one);
    if (!fine) {
        kt_copy(s->y, e->one, s->size.n * sizeof *e->one);
        kt_record whole = *record;
        kt_ensemble_clear(&e->from);
        return kt_simulation_complete_record(s, KT_OK, &whole, &e->from, to->record, to->user, &l->error);
    }
    record->q = e->one;
    record->v = record->q + e->n.nq;
    record->x = record->v + e->n.nv;
    record->work = kt_simulation_work_of(s, e->one);
    record->kinetic = e->energy[number];
    record->potential = e->energy[e->n.width + number] + 0.0; /* effects store none */
    return kt_simulation_give_record(s, record, to->record, to->user, &l->error);
}

void kt_ensemble_give_records(kt_ensemble *e) {
    const double *q = e->read, *v = q + e->n.width * e->n.nq;
    for (kt_lane_mask due = read_lane_records(e); due; due = read_lane_records(e)) {
        const kt_model *model = kt_ensemble_first_lane(e)->member.simulation->model;
        const kt_lane_mask fine = e->kernels->energy(model, e->work, q, v, e->tau, e->energy, e->energy + e->n.width);
        for (size_t i = 0; i < e->n.width; i++)
            if (kt_lane_is_in(due, i))
                e->lane[i].status = give_lane_record(e, i, kt_lane_is_in(fine, i));
    }
}
