/* Hard contacts that slip, by Coulomb's friction. The contact is a loop of the mechanism, whose multiplier is the normal force N.
 * With s the velocity of the sphere's lowest point against the plane, the force
 *
 *     T = -mu N e,   e = s / |s|
 *
 * acts on the sphere in that point, and -T on the plane's body. Accelerations and multipliers are affine in all forces: with N0
 * the multipliers without friction and G_ij the change of N_i for one N of N_j,
 *
 *     (1 - G) N = N0
 *
 * and with these N the accelerations are evaluated once more: k + 2 evaluations where k contacts slip. Where a contact's
 * 1 - G_ii is not positive friction wedges it in its own direction of slip, and the force has no value, or two (Painleve 1895): this
 * is an error.
 *
 * e jumps where s passes through zero, which ends a step that would go beyond (simulation/contact.c). So that the steps before see
 * no jump, e is -s / |s| where s . d < 0, with d the direction in which the contact began to slip; and d where s = 0. While slip is
 * slow e follows s at a rate of mu N / (m |s|), without bound where slip begins: what s has across d there is rounding, and is left
 * out up to `still`, as is slip as slow as that.
 *
 * F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, 1996, 5.4; F. Genot, B. Brogliato, New results on
 * Painleve paradoxes, Eur. J. Mech. A 18, 1999.
 */
#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "mechanism/evaluate.h"

#include <math.h>
#include <stdio.h>

/* 1 - G_ii from which on a reaction counts as wedged. */
static const double wedged = 1e-9;
/* A slip velocity that is nothing, m/s. */
static const double still = 1e-14;

void kt_slip_add(kt_model *model) {
    model->n.slip++;
    *(model->n.varying > 0 ? &model->steady : &model->forward) = kt_slip_forward;
}

/* The k-th loop that slips. */
static const kt_loop_record *loop_of(const kt_model *model, size_t k) {
    size_t i = 0;
    for (size_t left = k + 1; i < model->n.loop; i++)
        if (model->loop[i].slips > 0 && --left == 0)
            break;
    return &model->loop[i];
}

/* ---- forces ------------------------------------------------------------------------------------------------------ */

typedef struct slip_end {
    kt_mat3 axes;
    kt_vec3 point, omega, velocity;
    kt_vec3 arm; /* from its body's origin */
} slip_end;

static slip_end end_of(const kt_link_kinematics *links, const kt_effect_record *effect, int k) {
    const kt_link_kinematics *link = &links[effect->link[k]];
    const kt_vec3 arm = kt_mat3_apply(link->axes, effect->frame[k].position);
    return (slip_end){.axes = kt_mat3_multiply(link->axes, effect->frame[k].rotation),
                      .point = kt_vec3_add(link->position, arm),
                      .omega = link->omega,
                      .velocity = kt_vec3_add(link->velocity, kt_vec3_cross(link->omega, arm)),
                      .arm = kt_mat3_apply(link->axes, effect->arm[k])};
}

/* e, from the slip velocity and the direction in which slip began, d; 0 where both are. */
static void direction_of(const double s[2], const double d[2], double e[2]) {
    const double along = s[0] * d[0] + s[1] * d[1], across = d[0] * s[1] - d[1] * s[0];
    const double side = copysign(fmax(fabs(across) - still, 0.0), along < 0.0 ? -across : across);
    const bool has_begun = d[0] != 0.0 || d[1] != 0.0;
    const double x = has_begun ? (fabs(along) + still) * d[0] - side * d[1] : s[0];
    const double y = has_begun ? (fabs(along) + still) * d[1] + side * d[0] : s[1], norm = hypot(x, y);
    e[0] = norm > 0.0 ? x / norm : 0.0;
    e[1] = norm > 0.0 ? y / norm : 0.0;
}

/* The slip velocity of a contact, and what its friction exerts on both bodies for one N of normal force. */
static void find_unit(const kt_model *model, kt_data *data, const kt_link_kinematics *links, size_t k) {
    const kt_effect_record *effect = kt_effect_record_find(model, loop_of(model, k)->slips - 1);
    const slip_end centre = end_of(links, effect, 0), plane = end_of(links, effect, 1);
    const kt_vec3 down = kt_vec3_scale(-effect->radius, plane.axes.z);
    const kt_vec3 lever = kt_vec3_sub(kt_vec3_add(centre.point, down), plane.point);
    const kt_vec3 on_sphere = kt_vec3_add(centre.velocity, kt_vec3_cross(centre.omega, down));
    const kt_vec3 on_plane = kt_vec3_add(plane.velocity, kt_vec3_cross(plane.omega, lever));
    const kt_vec3 slip = kt_vec3_sub(on_sphere, on_plane);
    double *s = data->slip_velocity + 2 * k, e[2];
    s[0] = kt_vec3_dot(plane.axes.x, slip);
    s[1] = kt_vec3_dot(plane.axes.y, slip);
    direction_of(s, data->slip + 2 * k, e);
    const kt_vec3 force = kt_vec3_scale(
        -effect->friction, kt_vec3_add(kt_vec3_scale(e[0], plane.axes.x), kt_vec3_scale(e[1], plane.axes.y)));
    const kt_vec3 back = kt_vec3_scale(-1.0, force);
    data->slip_unit[2 * k] = (kt_wrench){.moment = kt_vec3_cross(kt_vec3_add(centre.arm, down), force), .force = force};
    data->slip_unit[2 * k + 1] =
        (kt_wrench){.moment = kt_vec3_cross(kt_vec3_add(plane.arm, lever), back), .force = back};
}

static void add_friction(const kt_model *model, kt_data *data, size_t k, double normal) {
    const kt_effect_record *effect = kt_effect_record_find(model, loop_of(model, k)->slips - 1);
    for (int end = 0; end < 2; end++) {
        kt_wrench *body = &data->slip_loaded[effect->body[end]];
        const kt_wrench *unit = &data->slip_unit[2 * k + (size_t)end];
        body->moment = kt_vec3_add(body->moment, kt_vec3_scale(normal, unit->moment));
        body->force = kt_vec3_add(body->force, kt_vec3_scale(normal, unit->force));
    }
}

static void load(const kt_model *model, kt_data *data, const kt_wrench *external) {
    if (external)
        memcpy(data->slip_loaded, external, model->n.body * sizeof *data->slip_loaded);
    else
        memset(data->slip_loaded, 0, model->n.body * sizeof *data->slip_loaded);
}

/* ---- normal forces ----------------------------------------------------------------------------------------------- */

/* Accelerations under the wrenches in slip_loaded, and the normal forces with them. */
static kt_status evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a, double *normal,
                          kt_error *error) {
    kt_dynamic_state loaded = *at;
    loaded.external = data->slip_loaded;
    kt_status status = KT_HAS_LOOPS ? kt_closed_forward(model, data, &loaded, a, error) : KT_ERROR_UNSUPPORTED;
    if (status != KT_OK || normal == NULL)
        return status;
    kt_multipliers_find(model, data, &loaded, a);
    status = kt_multipliers_take(model, data, at->t, data->slip_multiplier, error);
    for (size_t k = 0; status == KT_OK && k < model->n.slip; k++)
        normal[k] = data->slip_multiplier[loop_of(model, k)->equation];
    return status;
}

static kt_status refuse(const kt_model *model, size_t k, double t, double pivot, kt_error *error) {
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "contact '%.60s' at t = %.9g s",
                   kt_loop_name(model, (int)(loop_of(model, k) - model->loop)), t);
    return kt_error_set(error, KT_ERROR_SINGULAR, where,
                        "it slips in a direction in which friction wedges it: its normal force has no value, or two "
                        "(Painleve's paradox; 1 - dN/dN = %.3g); take less friction, or an elastic contact (stiffness)",
                        pivot);
}

/* Solves (1 - G) N = N0, in the columns of slip_matrix; N becomes slip_normal. */
static kt_status solve(const kt_model *model, kt_data *data, double t, kt_error *error) {
    const size_t n = model->n.slip;
    double *A = data->slip_matrix, *N = data->slip_normal;
    for (size_t k = 0; k < n; k++)
        if (!(A[k * n + k] > wedged))
            return refuse(model, k, t, A[k * n + k], error);
    for (size_t k = 0; k < n; k++) {
        const double pivot = A[k * n + k];
        if (!(pivot > wedged))
            return refuse(model, k, t, pivot, error);
        for (size_t i = k + 1; i < n; i++) {
            const double factor = A[k * n + i] / pivot;
            for (size_t j = k; j <= n; j++)
                A[j * n + i] -= factor * A[j * n + k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        double sum = A[n * n + k];
        for (size_t j = k + 1; j < n; j++)
            sum -= A[j * n + k] * N[j];
        N[k] = sum / A[k * n + k];
    }
    return KT_OK;
}

kt_status kt_slip_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                          kt_error *error) {
    const size_t n = model->n.slip;
    double *A = data->slip_matrix, *N0 = A + n * n, scale = 0.0;
    kt_link_kinematics *links = kt_links_scratch(data);
    kt_links_sweep(model, data, at->q, at->v, links);
    for (size_t k = 0; k < n; k++)
        find_unit(model, data, links, k);
    load(model, data, at->external);
    kt_status status = evaluate(model, data, at, a, N0, error);
    for (size_t k = 0; k < n; k++)
        scale = fmax(scale, fabs(N0[k]));
    scale = status == KT_OK && scale > 0.0 ? scale : 1.0;
    for (size_t k = 0; status == KT_OK && k < n; k++) {
        load(model, data, at->external);
        add_friction(model, data, k, scale);
        status = evaluate(model, data, at, a, A + k * n, error);
        for (size_t i = 0; i < n; i++)
            A[k * n + i] = (i == k ? 1.0 : 0.0) - (A[k * n + i] - N0[i]) / scale;
    }
    if (status == KT_OK)
        status = solve(model, data, at->t, error);
    if (status != KT_OK)
        return status;
    load(model, data, at->external);
    for (size_t k = 0; k < n; k++)
        add_friction(model, data, k, data->slip_normal[k]);
    return evaluate(model, data, at, a, NULL, error);
}

kt_status kt_slip_refuse(const kt_model *model, const char *where, kt_error *error) {
    return model->n.slip == 0
               ? KT_OK
               : kt_error_set(
                     error, KT_ERROR_UNSUPPORTED, where,
                     "'%.60s' is a hard contact that slips, and derivatives of its friction are not computed; take "
                     "differences, or an elastic contact (stiffness)",
                     kt_loop_name(model, (int)(loop_of(model, 0) - model->loop)));
}

double kt_slip_power(const kt_model *model, const kt_data *data) {
    double sum = 0.0;
    for (size_t k = 0; k < model->n.slip; k++) {
        const kt_effect_record *effect = kt_effect_record_find(model, loop_of(model, k)->slips - 1);
        const double *s = data->slip_velocity + 2 * k, *d = data->slip + 2 * k;
        double e[2];
        direction_of(s, d, e);
        sum += effect->friction * data->slip_normal[k] * (e[0] * s[0] + e[1] * s[1]);
    }
    return sum;
}
