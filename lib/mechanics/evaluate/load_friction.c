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
 * The forces x are found in load_forward.c.
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

/* ---- the law of one friction ------------------------------------------------------------------------------------- */

const kt_effect_record *kt_loaded_effect(const kt_model *model, size_t k) {
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

double kt_load_law(const kt_model *model, const kt_effect_record *e, const double load[3], double direction,
                   double gradient[3]) {
    const double size = kt_vec3_norm(kt_vec3_make(load[0], load[1], load[2]));
    const bool along = !is_scalar(model, e) || load[0] * direction > 0.0;
    const double factor = friction_factor(model, e, along);
    for (int i = 0; gradient != NULL && i < 3; i++)
        gradient[i] = size > 0.0 ? factor * load[i] / size : 0.0;
    return factor * size;
}

static bool acts(const kt_model *model, const kt_data *data, const kt_effect_record *e) {
    return (size_t)(e - model->effect) < model->n.effect && !e->idle && !data->load_rests[e->load_slot - 1];
}

double kt_load_sign(const kt_model *model, const kt_data *data, const kt_effect_record *e, const double *v) {
    if (!acts(model, data, e))
        return 0.0;
    return e->direction != 0.0 ? e->direction : tanh(v[model->link[e->link[0]].v] / e->smoothing);
}

double kt_load_sign_slope(const kt_model *model, const kt_data *data, const kt_effect_record *e, const double *v) {
    const double sign = kt_load_sign(model, data, e, v);
    return e->direction == 0.0 && acts(model, data, e) ? (1.0 - sign * sign) / e->smoothing : 0.0;
}

double kt_load_friction_find(const kt_model *model, const kt_data *data, const kt_effect_record *effect,
                             double direction) {
    const int32_t slot = effect->load_slot;
    return slot > 0 ? kt_load_law(model, effect, data->load + 3 * (slot - 1), direction, NULL) : 0.0;
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

/* Finds the load L of friction e from the wrenches of joints and loops, by the table at the beginning of this file.
 * Loads with one component are in load[0]. */
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
        take_load(model, data, links, joints, kt_loaded_effect(model, k), data->load + 3 * k);
}

/* ---- queries ----------------------------------------------------------------------------------------------------- */

double kt_load_power(const kt_model *model, const kt_data *data, const double *v) {
    double sum = 0.0;
    for (size_t k = 0; k < model->n.loaded; k++)
        sum -= data->load_friction[k] * v[model->link[kt_loaded_effect(model, k)->link[0]].v];
    return sum;
}

double kt_load_friction_of(const kt_model *model, const kt_data *data, const double *q, const double *v,
                           const kt_effect_record *effect) {
    if (effect->load_slot == 0)
        return 0.0;
    return data->load_state == kt_state_hash(model, q, v) ? data->load_friction[effect->load_slot - 1] : (double)NAN;
}

kt_status kt_load_reject(const kt_model *model, const char *where, const char *what, kt_error *error) {
    return model->n.loaded == 0 ? KT_OK
                                : kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                                               "the friction in joint '%.60s' is proportional to a reaction; %s",
                                               kt_joint_name(model, kt_loaded_effect(model, 0)->body[0]), what);
}
