/* Force: a vector f(t) on a point of a body, its components in world axes or in the end's; supplied = f . v. */
#include "effect/kind.h"

static void push(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                 kt_wrench *wrench, kt_effect_balance *balance) {
    double x[3], y[3], z[3];
    kt_curve_evaluate(&effect->curve[0], numbers, t, x);
    kt_curve_evaluate(&effect->curve[1], numbers, t, y);
    kt_curve_evaluate(&effect->curve[2], numbers, t, z);
    const kt_vec3 f = kt_vec3_make(x[0], y[0], z[0]);
    wrench[0].moment = kt_vec3_make(0.0, 0.0, 0.0);
    wrench[0].force = effect->in_body ? kt_mat3_apply(end[0].axes, f) : f;
    if (balance)
        *balance = (kt_effect_balance){.supplied = kt_vec3_dot(wrench[0].force, end[0].velocity)};
}

const kt_effect_kind kt_effect_force = {.ends = 1, .push = push};
