/* Recursions of models in which some coordinates move no mass (evaluate/quasi_static.c).
 *
 * With N the motions that move no mass, M N = 0, the mass matrix M is singular. An armature of 1 on one coordinate w of
 * each such motion makes M + E E' regular. E are the unit vectors of these coordinates, and N' E = 1. The accelerations
 * satisfy
 *
 *     (M + E E') a = tau - h,   so that   a_w = N' (tau - h)
 *
 * as N' M = 0 and N' h = 0: the residual of the balance of forces along N. If the effect of the armature is zero, M a =
 * tau - h holds exactly. Only forward dynamics has this armature: inverse dynamics and the mass matrix leave it out.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "dynamics/without_masses.h"
#include "kinetree/dynamics.h"

static const kt_kernels *plain(const kt_model *model) { return kt_kernels_of(model->isa, model->sweep, false); }

static size_t massless_forward(const kt_model *model, kt_data *data, const double *q, const double *v,
                               const double *tau, const kt_wrench *external, double *a) {
    return kt_kernels_of(model->isa, model->sweep, true)->forward(model, data, q, v, tau, external, a);
}

static double armature_of(const kt_model *model, size_t v) {
    return kt_is_massless(model, v) ? 0.0 : model->armature[v];
}

static void massless_inverse(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                             const kt_wrench *external, double *tau) {
    plain(model)->inverse(model, data, q, v, a, external, tau);
    for (size_t i = 0; i < model->n.v; i++)
        tau[i] += armature_of(model, i) * a[i];
}

static size_t massless_mass(const kt_model *model, kt_data *data, const double *q, double *matrix) {
    const size_t failed = plain(model)->mass(model, data, q, matrix);
    for (size_t i = 0; i < model->n.v && !failed; i++)
        matrix[i * (model->n.v + 1)] += armature_of(model, i);
    return failed;
}

void kt_massless_attach(kt_model *model) {
    static const kt_kernels kernels = {.name = "coordinates that move no mass",
                                       .forward = massless_forward,
                                       .inverse = massless_inverse,
                                       .mass = massless_mass,
                                       .mirror = mirror,
                                       .kinematics = kinematics,
                                       .follow = follow,
                                       .force_links = force_links};
    if (model->n.massless)
        model->kernels = &kernels;
}

kt_status kt_massless_reject(const kt_model *model, const char *where, const char *what, kt_error *error) {
    if (model->n.massless)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                            "joint '%.60s' moves no mass and follows from the balance of forces, and %s; give its "
                            "bodies a small mass, and integrate with an implicit method (radau5)",
                            kt_joint_name(model, kt_velocity_body(model, model->massless[0])), what);
    (void)model, (void)where, (void)what, (void)error;
    return KT_OK;
}
