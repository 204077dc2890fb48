/* Friction of joints that is proportional to a reaction. Friction number i exerts x_i in its joint, against a speed v:
 *
 *     x_i = -s_i k_i(L_i),    s_i = tanh(v / v0), or the direction of slip if the friction sticks at rest
 *
 * L_i is a load, and k_i its friction, which is not negative and grows with the size of the load:
 *
 *     bearing     L = F, the force of the joint                    k = mu r |F|
 *     guide       L = F - (F . a) a, its force across the axis a   k = mu |L|
 *     thread      L = (F . a) sign(p), its force along the axis    k = mu r |L| / (c (c -+ mu s))
 *     loop        L = F, the force of a loop, such as teeth        k = mu r |F|, or mu |F| in a guide
 *     worm        L = Q, the force of the loop along the worm      k = mu |Q| / (s (cos(alpha) c +- mu s))
 *     efficiency  L = Q, the force of a loop along the coordinate  k = (1 - eta) |Q|, or (1 / eta - 1) |Q|
 *
 * A thread with the lead angle g, tan(g) = p / r, c = cos(g), s = sin(g), carries N c -+ N mu s along its axis, where N
 * is the force normal to the thread. The upper sign belongs to a motion along the force, such as that of a nut that
 * lifts its load. The power of N mu at the sliding speed is k |v|. The threads of a worm have the lead angle g, too,
 * and the pressure angle alpha. Their upper sign belongs to a wheel that drives the worm.
 *
 * An efficiency eta is that of the power Q v which the loop passes on. The joint receives eta of this power if Q v > 0,
 * and supplies it with 1 / eta if Q v < 0.
 *
 * Accelerations and reactions are affine in joint forces, L = L0 + G x. One evaluation yields L0, and one for each
 * friction a column of G. Newton's method solves x_i + s_i k_i(L0 + G x) = 0, from x = 0. For one friction k is convex,
 * so that the iteration approaches the smallest force from below. If the slope 1 + s dk/dx is not positive on the way,
 * no force or a second force may satisfy the law: the friction jams the joint, as in Painleve's paradox. An evaluation
 * with x yields the accelerations, and corrects L0 where reactions are not affine (slip of contacts).
 *
 * Source: F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, 1996, 5.4 (joints with Coulomb's
 * friction); G. Niemann, H. Winter, Maschinenelemente 1, chapter 10 (threads).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/load_friction.h"

#include "algebra/vector_parts.h"
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "kinetree/algebra.h"

#include <math.h>

enum { NEWTON_MAX = 50, CORRECTIONS_MAX = 20 };

/* The smallest pivot of Newton's matrix: friction that makes a load a thousand times as large jams. */
static const double jammed = 1e-3;
/* Residuals of the law, relative to the friction: of Newton's method, and of the evaluation. */
static const double rounding_of_root = 1e-14, agrees = 1e-10;

/* ---- the law of one friction ------------------------------------------------------------------------------------- */

/* Friction number k; the model has model->n.loaded of them. */
static const kt_effect_record *loaded_effect(const kt_model *model, size_t k) {
    size_t i = 0;
    while (model->effect[i].load_slot != (int32_t)k + 1)
        i++;
    return &model->effect[i];
}

static bool is_thread(const kt_model *model, const kt_effect_record *e) {
    return e->load_loop < 0 && model->link[e->link[0]].motion == KT_MOTION_SCREW;
}

/* Whether the teeth of a worm rub in the joint of the worm. */
static bool is_worm(const kt_model *model, const kt_effect_record *e) {
    return e->efficiency == 1.0 && e->load_loop >= 0 && model->loop[e->load_loop].type == KT_LOOP_WORM &&
           model->loop[e->load_loop].link[0] == e->link[0];
}

static bool is_scalar(const kt_model *model, const kt_effect_record *e) {
    return e->efficiency < 1.0 || is_thread(model, e) || is_worm(model, e);
}

/* k / |Q| of a worm. along: the wheel drives. The record has tan(alpha) / cos(gamma) and tan(gamma) (loop/worm.c). */
static double worm_factor(const kt_loop_record *worm, double mu, bool along) {
    const double lead = fabs(worm->slope[2]), cosine = 1.0 / sqrt(1.0 + lead * lead), sine = lead * cosine;
    const double pressure = worm->slope[0] * cosine, normal = 1.0 / sqrt(1.0 + pressure * pressure);
    return mu / (sine * (normal * cosine + (along ? 1.0 : -1.0) * mu * sine));
}

/* k / |L|, for a motion along the load or against it. */
static double friction_factor(const kt_model *model, const kt_effect_record *e, bool along) {
    const kt_link *link = &model->link[e->link[0]];
    if (e->efficiency < 1.0)
        return along ? 1.0 - e->efficiency : 1.0 / e->efficiency - 1.0;
    if (is_worm(model, e))
        return worm_factor(&model->loop[e->load_loop], e->friction, along);
    if (kt_link_lengths(link) > 0)
        return e->friction;
    if (!is_thread(model, e))
        return e->friction * e->radius;
    const double slope = fabs(kt_link_pitch(link)) / e->radius, cosine = 1.0 / sqrt(1.0 + slope * slope);
    return e->friction * e->radius / (cosine * cosine * (1.0 + (along ? -1.0 : 1.0) * e->friction * slope));
}

/* k of a load in a direction of motion. gradient: by the load; or NULL. */
static double friction_of_load(const kt_model *model, const kt_effect_record *e, const double load[3], double direction,
                               double gradient[3]) {
    const double size = kt_vec3_norm(kt_vec3_make(load[0], load[1], load[2]));
    const bool along = !is_scalar(model, e) || load[0] * direction > 0.0;
    const double factor = friction_factor(model, e, along);
    for (int i = 0; gradient != NULL && i < 3; i++)
        gradient[i] = size > 0.0 ? factor * load[i] / size : 0.0;
    return factor * size;
}

/* s of an effect: 0 if it exerts no force. */
static double sign_of_motion(const kt_model *model, const kt_data *data, const kt_effect_record *e, const double *v) {
    const bool is_off = (size_t)(e - model->effect) >= model->n.effect || e->idle;
    if (is_off || data->load_rests[e->load_slot - 1])
        return 0.0;
    return e->direction != 0.0 ? e->direction : tanh(v[model->link[e->link[0]].v] / e->smoothing);
}

double kt_load_friction_find(const kt_model *model, const kt_data *data, const kt_effect_record *effect,
                             double direction) {
    const int32_t slot = effect->load_slot;
    return slot > 0 ? friction_of_load(model, effect, data->load + 3 * (slot - 1), direction, NULL) : 0.0;
}

/* ---- loads ------------------------------------------------------------------------------------------------------- */

static bool is_carried(const kt_model *model, int32_t link, int32_t by) {
    while (link > by)
        link = model->link[link].parent;
    return link == by;
}

/* The joint force of a loop: the work done by its wrench for a unit of the coordinate. */
static double force_along(const kt_model *model, const kt_data *data, const kt_link_kinematics *links,
                          const kt_effect_record *e, kt_vec3 axis) {
    const int32_t joint = e->link[0];
    const kt_link *link = &model->link[joint];
    const kt_loop_record *loop = &model->loop[e->load_loop];
    const kt_wrench *w = &data->loop_wrench[e->load_loop];
    const int side = (int)is_carried(model, loop->link[1], joint) - (int)is_carried(model, loop->link[0], joint);
    const kt_link_kinematics *first = &links[loop->link[0]];
    const kt_vec3 point = kt_vec3_add(first->position, kt_mat3_apply(first->axes, loop->frame[0].position));
    const kt_vec3 arm = kt_vec3_sub(point, links[joint].position);
    const double slides = kt_vec3_dot(axis, w->force),
                 turns = kt_vec3_dot(axis, kt_vec3_add(w->moment, kt_vec3_cross(arm, w->force)));
    return side * (kt_link_lengths(link) > 0 ? slides : turns + kt_link_pitch(link) * slides);
}

static void take_load(const kt_model *model, kt_data *data, const kt_link_kinematics *links, const kt_wrench *joints,
                      const kt_effect_record *e, double load[3]) {
    const kt_link *link = &model->link[e->link[0]];
    const kt_vec3 axis = kt_mat3_column(links[e->link[0]].axes, link->axis);
    const bool is_off = e->load_loop >= 0 && kt_loop_is_off(&model->loop[e->load_loop]);
    kt_vec3 f = is_off              ? kt_vec3_make(0.0, 0.0, 0.0)
                : e->load_loop >= 0 ? data->loop_wrench[e->load_loop].force
                                    : joints[e->body[0]].force;
    if (e->efficiency < 1.0 || is_worm(model, e))
        f = kt_vec3_make(is_off ? 0.0 : force_along(model, data, links, e, axis), 0.0, 0.0);
    else if (is_thread(model, e))
        f = kt_vec3_make(copysign(1.0, kt_link_pitch(link)) * kt_vec3_dot(f, axis), 0.0, 0.0);
    else if (e->load_loop < 0 && kt_link_lengths(link) > 0)
        f = kt_vec3_sub(f, kt_vec3_scale(kt_vec3_dot(f, axis), axis));
    load[0] = f.x;
    load[1] = f.y;
    load[2] = f.z;
}

void kt_loads_take(const kt_model *model, kt_data *data, const kt_link_kinematics *links, const kt_wrench *joints) {
    for (size_t k = 0; k < model->n.loaded; k++)
        take_load(model, data, links, joints, loaded_effect(model, k), data->load + 3 * k);
}

/* Accelerations under the friction in data->load_friction, and its loads unless `last`. Loads leave the kinematics in
 * place of the links' motion, from which reactions of the caller follow. Therefore the last evaluation is without
 * loads. */
static kt_status evaluate_loads(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a, bool last,
                                kt_error *error) {
    kt_dynamic_state loaded = *at;
    kt_copy_or_clear(data->load_tau, at->tau, model->n.v * sizeof *data->load_tau);
    for (size_t k = 0; k < model->n.loaded; k++)
        data->load_tau[model->link[loaded_effect(model, k)->link[0]].v] += data->load_friction[k];
    loaded.tau = data->load_tau;
    const kt_status status = model->unloaded(model, data, &loaded, a, error);
    return status == KT_OK && !last
               ? kt_motion_complete(model, data, &loaded, a, kt_links_scratch(data), data->load_joint, NULL, error)
               : status;
}

/* ---- the forces -------------------------------------------------------------------------------------------------- */

/* A problem: the signs s, and the scale of friction. */
typedef struct load_problem {
    const kt_model *model;
    kt_data *data;
    const kt_dynamic_state *at;
    size_t n;
    double unit;
} load_problem;

static kt_status reject_jam(const load_problem *p, size_t slot, double pivot, kt_error *error) {
    const int32_t body = loaded_effect(p->model, slot)->body[0];
    return kt_error_set(error, KT_ERROR_SINGULAR, kt_where_at("joint", kt_joint_name(p->model, body), p->at->t).text,
                        "its friction jams: it grows as fast as the reaction that causes it, so that no force or two "
                        "forces satisfy its law (1 - dF/dF = %.3g); take less friction, more inertia, or start at rest "
                        "with `stick`",
                        pivot);
}

/* Writes x + s k(L0 + G x) to load_residual, and its derivative to load_matrix. Returns the largest residual over the
 * friction. */
static double find_load_residuals(const load_problem *p) {
    const kt_data *d = p->data;
    double worst = 0.0;
    for (size_t k = 0; k < p->n; k++) {
        const kt_effect_record *e = loaded_effect(p->model, k);
        const double s = sign_of_motion(p->model, d, e, p->at->v);
        double load[3], gradient[3];
        for (size_t c = 0; c < 3; c++) {
            load[c] = d->load_free[3 * k + c];
            for (size_t j = 0; j < p->n; j++)
                load[c] += d->load_gain[3 * (j * p->n + k) + c] * d->load_friction[j];
        }
        const double friction = fabs(s) * friction_of_load(p->model, e, load, s, gradient);
        d->load_residual[k] = d->load_friction[k] + copysign(friction, s);
        for (size_t j = 0; j < p->n; j++) {
            const double *gain = d->load_gain + 3 * (j * p->n + k);
            d->load_matrix[j * p->n + k] =
                (double)(j == k) + s * (gradient[0] * gain[0] + gradient[1] * gain[1] + gradient[2] * gain[2]);
        }
        worst = fmax(worst, fabs(d->load_residual[k]) / fmax(fmax(friction, fabs(d->load_friction[k])), p->unit));
    }
    return worst;
}

/* Eliminates in order, since each leading minor of the matrix is that of fewer frictions, and must be positive, too.
 * Returns the row whose pivot is not; n: none. The solution replaces load_residual. */
static size_t solve_load_step(const load_problem *p, double *pivot) {
    const size_t n = p->n;
    double *A = p->data->load_matrix, *b = p->data->load_residual;
    for (size_t k = 0; k < n; k++) {
        *pivot = A[k * n + k];
        if (!(*pivot > jammed))
            return k;
        for (size_t i = k + 1; i < n; i++) {
            const double factor = A[k * n + i] / *pivot;
            for (size_t j = k + 1; j < n; j++)
                A[j * n + i] -= factor * A[j * n + k];
            b[i] -= factor * b[k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; j++)
            b[k] -= A[j * n + k] * b[j];
        b[k] /= A[k * n + k];
    }
    return n;
}

static kt_status find_friction(const load_problem *p, kt_error *error) {
    for (int step = 0; step < NEWTON_MAX; step++) {
        double pivot;
        if (find_load_residuals(p) <= rounding_of_root)
            return KT_OK;
        const size_t stuck = solve_load_step(p, &pivot);
        if (stuck < p->n)
            return reject_jam(p, stuck, pivot, error);
        double change = 0.0;
        for (size_t k = 0; k < p->n; k++) {
            const double before = p->data->load_friction[k];
            p->data->load_friction[k] -= p->data->load_residual[k];
            change = fmax(change, fabs(p->data->load_residual[k]) / fmax(fabs(before), p->unit));
        }
        if (change <= rounding_of_root)
            return KT_OK;
    }
    return reject_jam(p, 0, (double)NAN, error);
}

/* Finds the loads without this friction, and their gain by each friction. */
static kt_status find_gains(load_problem *p, double *a, kt_error *error) {
    kt_data *d = p->data;
    kt_clear(d->load_friction, p->n * sizeof *d->load_friction);
    kt_clear(d->load_gain, 3 * p->n * p->n * sizeof *d->load_gain);
    kt_status status = evaluate_loads(p->model, d, p->at, a, false, error);
    kt_copy(d->load_free, d->load, 3 * p->n * sizeof *d->load);
    p->unit = 0.0;
    for (size_t k = 0; status == KT_OK && k < p->n; k++)
        p->unit = fmax(p->unit, kt_load_friction_find(p->model, d, loaded_effect(p->model, k), 1.0));
    p->unit = p->unit > 0.0 ? p->unit : 1.0;
    for (size_t k = 0; status == KT_OK && k < p->n; k++) {
        if (sign_of_motion(p->model, d, loaded_effect(p->model, k), p->at->v) == 0.0)
            continue;
        d->load_friction[k] = p->unit;
        status = evaluate_loads(p->model, d, p->at, a, false, error);
        for (size_t c = 0; c < 3 * p->n; c++)
            d->load_gain[3 * k * p->n + c] = (d->load[c] - d->load_free[c]) / p->unit;
        d->load_friction[k] = 0.0;
    }
    return status;
}

/* Moves L0 by the difference between evaluated and affine loads. Returns the largest difference, over the friction. */
static double correct_loads(const load_problem *p) {
    const kt_data *d = p->data;
    double worst = 0.0;
    for (size_t k = 0; k < p->n; k++) {
        const kt_effect_record *e = loaded_effect(p->model, k);
        for (size_t c = 0; c < 3; c++) {
            double load = d->load_free[3 * k + c];
            for (size_t j = 0; j < p->n; j++)
                load += d->load_gain[3 * (j * p->n + k) + c] * d->load_friction[j];
            d->load_free[3 * k + c] += d->load[3 * k + c] - load;
        }
        const double s = sign_of_motion(p->model, d, e, p->at->v);
        const double friction = fabs(s) * kt_load_friction_find(p->model, d, e, s);
        worst = fmax(worst, fabs(d->load_friction[k] + copysign(friction, s)) / fmax(friction, p->unit));
    }
    return worst;
}

static bool acts(const kt_model *model, const kt_data *data, const double *v) {
    bool any = false;
    for (size_t k = 0; k < model->n.loaded; k++)
        any = any || sign_of_motion(model, data, loaded_effect(model, k), v) != 0.0;
    return any;
}

static kt_status load_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                              kt_error *error) {
    load_problem p = {.model = model, .data = data, .at = at, .n = model->n.loaded};
    data->load_state = kt_state_hash(model, at->q, at->v);
    if (!acts(model, data, at->v)) {
        kt_clear(data->load_friction, p.n * sizeof *data->load_friction);
        kt_copy_or_clear(data->load_tau, at->tau, model->n.v * sizeof *data->load_tau);
        return model->unloaded(model, data, at, a, error);
    }
    kt_status status = find_gains(&p, a, error);
    for (int k = 0; status == KT_OK && k < CORRECTIONS_MAX; k++) {
        status = find_friction(&p, error);
        if (status == KT_OK)
            status = evaluate_loads(model, data, at, a, false, error);
        if (status == KT_OK && correct_loads(&p) <= agrees)
            return evaluate_loads(model, data, at, a, true, error);
    }
    return status == KT_OK ? reject_jam(&p, 0, (double)NAN, error) : status;
}

void kt_load_attach(kt_model *model) {
    if (model->n.loaded == 0)
        return;
    model->unloaded = model->forward;
    model->forward = load_forward;
}

/* ---- queries ----------------------------------------------------------------------------------------------------- */

double kt_load_power(const kt_model *model, const kt_data *data, const double *v) {
    double sum = 0.0;
    for (size_t k = 0; k < model->n.loaded; k++)
        sum -= data->load_friction[k] * v[model->link[loaded_effect(model, k)->link[0]].v];
    return sum;
}

double kt_load_friction_of(const kt_model *model, const kt_data *data, const double *q, const double *v,
                           const kt_effect_record *effect) {
    if (effect->load_slot == 0)
        return 0.0;
    return data->load_state == kt_state_hash(model, q, v) ? data->load_friction[effect->load_slot - 1] : (double)NAN;
}

double kt_load_damping(const kt_model *model, const kt_data *data, const kt_effect_record *effect, double v) {
    const double sign = effect->direction != 0.0 ? effect->direction : tanh(v / effect->smoothing);
    if (effect->load_slot == 0 || effect->direction != 0.0)
        return 0.0;
    return -kt_load_friction_find(model, data, effect, sign) * (1.0 - sign * sign) / effect->smoothing;
}

kt_status kt_load_reject(const kt_model *model, const char *where, const char *what, kt_error *error) {
    return model->n.loaded == 0 ? KT_OK
                                : kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                                               "the friction in joint '%.60s' is proportional to a reaction; %s",
                                               kt_joint_name(model, loaded_effect(model, 0)->body[0]), what);
}
