/* Derivatives of the forces of effects with respect to the state, one direction at a time (support.h).
 *
 * The wrenches of an effect between two bodies depend only on their relative motion, and rotate with them: so the link
 * that carries both bodies is taken to be at rest, as for loops. An effect with a single end is relative to the ground.
 */
#include "effect/effect.h"
#include "reduction/support.h"

/* The deepest common ancestor of links a and b. */
static int32_t carrier_of(const kt_model *model, int32_t a, int32_t b) {
    while (a != b) {
        if (a > b)
            a = model->link[a].parent;
        else
            b = model->link[b].parent;
    }
    return a;
}

/* Evaluates the wrenches on the ends, as dual numbers along degree of freedom k. */
static void evaluate(const kt_support *w, const kt_effect_record *effect, int32_t k, kt_direction along,
                     kt_end_wrench pushed[2]) {
    const kt_support_dof *by = &w->x->dof[k];
    kt_effect_frame end[2];
    kt_effect_wrench wrench[2];
    for (int i = 0; i < effect->ends; i++) {
        const kt_loop_end m = kt_support_end_dual(&w->end[i], by->end == i ? &by->motion : NULL, along);
        end[i] = (kt_effect_frame){
            .axes = {m.axes[0], m.axes[1], m.axes[2]}, .point = m.point, .omega = m.omega, .velocity = m.velocity};
    }
    kt_effect_kind_of(effect->type)->wrench(effect, w->x->model->number, end, w->x->t, wrench, NULL);
    for (int i = 0; i < effect->ends; i++) {
        pushed[i].force = wrench[i].force;
        pushed[i].moment = wrench[i].moment + kt_cross(end[i].point, wrench[i].force);
    }
}

static void push(const kt_dual_motion *x, const kt_effect_record *effect, double *d_q, double *d_v) {
    const size_t n = x->model->n.v;
    const int32_t ancestor = effect->ends == 2 ? carrier_of(x->model, effect->link[0], effect->link[1]) : 0;
    kt_support w = {.x = x};
    kt_end_wrench pushed[2];
    kt_support_find(&w, ancestor, effect->ends, effect->link, effect->frame);
    for (int32_t k = 0; k < w.count; k++) {
        const size_t j = (size_t)x->dof[k].v;
        evaluate(&w, effect, k, KT_BY_POSITION, pushed);
        kt_support_subtract(&w, k, KT_BY_POSITION, pushed, d_q + j * n);
        evaluate(&w, effect, k, KT_BY_RATE, pushed);
        kt_support_subtract(&w, k, KT_BY_RATE, pushed, d_v + j * n);
    }
}

static void drive(const kt_dual_motion *x, const kt_effect_record *effect, double *d_q, double *d_v) {
    const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
    const kt_link *link = &x->model->link[effect->link[0]];
    const double q = x->q[link->q], v = x->v[link->v], *numbers = x->model->number;
    const size_t diagonal = (size_t)link->v * (x->model->n.v + 1);
    d_q[diagonal] -=
        kt_derivative_of(kind->joint_force(effect, numbers, kt_dual_make(q, 1.0), kt_dual_make(v, 0.0), x->t, NULL));
    d_v[diagonal] -=
        kt_derivative_of(kind->joint_force(effect, numbers, kt_dual_make(q, 0.0), kt_dual_make(v, 1.0), x->t, NULL));
}

void kt_dual_effects(const kt_dual_motion *x, double *d_q, double *d_v) {
    for (size_t i = 0; i < x->model->n.effect; i++) {
        const kt_effect_record *effect = &x->model->effect[i];
        if (effect->type == KT_EFFECT_CUSTOM)
            continue;
        if (effect->ends)
            push(x, effect, d_q, d_v);
        else
            drive(x, effect, d_q, d_v);
    }
}
