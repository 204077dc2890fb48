/* Linear damper in a joint: force = -c v, dissipated = c v^2. */
#include "effect/kind.h"

static double drive(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                    kt_effect_balance *balance) {
    (void)numbers, (void)q, (void)t;
    if (balance)
        *balance = (kt_effect_balance){.dissipated = effect->damping * v * v};
    return -effect->damping * v;
}

const kt_effect_kind kt_effect_joint_damper = {.drive = drive};
