/* Contacts and friction whose sets are masks, and loops that the caller switches: the motion is that of models of all
 * sets. */
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdlib.h>

#include "mask_pair.h"
#include "scenes.h"

/* Copies each simulation by a checkpoint into a new one. */
static bool restore(mask_pair *pair) {
    kt_error error = {0};
    kt_status status = KT_OK;
    for (int k = 0; status == KT_OK && k < MASK_PAIR; k++) {
        void *block = malloc(kt_simulation_state_size(pair->simulation[k]));
        status = block != NULL ? KT_OK : KT_ERROR_MEMORY;
        if (status == KT_OK) {
            kt_simulation_save(pair->simulation[k], block);
            status = mask_pair_renew(pair, k, &error);
        }
        if (status == KT_OK)
            status = kt_simulation_restore(pair->simulation[k], block, &error);
        free(block);
    }
    return kt_fine("restores", status, &error);
}

/* Five sliders on stops. A coupling of all of them would join their five groups into one, but is off. */
KT_TEST(masks_have_room_for_the_groups_that_a_loop_would_join) {
    static const char text[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies:\n"
        "  - {name: a, joint: {type: prismatic, axis: z, position: 0.3}, mass: 1}\n"
        "  - {name: b, joint: {type: prismatic, axis: z, position: 0.4}, mass: 1}\n"
        "  - {name: c, joint: {type: prismatic, axis: z, position: 0.5}, mass: 1}\n"
        "  - {name: d, joint: {type: prismatic, axis: z, position: 0.6}, mass: 1}\n"
        "  - {name: e, joint: {type: prismatic, axis: z, position: 0.7}, mass: 1}\n"
        "loops:\n"
        "  - {name: clutch, type: coupling, coefficients: {a: 1, b: 1, c: 1, d: 1, e: 1}, offset: 0, switched: off}\n"
        "effects:\n"
        "  - {name: fa, type: joint_limit, joint: a, lower: 0, restitution: 0}\n"
        "  - {name: fb, type: joint_limit, joint: b, lower: 0, restitution: 0.5}\n"
        "  - {name: fc, type: joint_limit, joint: c, lower: 0, restitution: 0}\n"
        "  - {name: fd, type: joint_limit, joint: d, lower: 0, restitution: 0}\n"
        "  - {name: fe, type: joint_limit, joint: e, lower: 0, restitution: 0}\n"
        "simulate: {duration: 10, integrator: rk4, step: 0.001}\n";
    mask_pair pair;
    bool fine = mask_pair_make(&pair, text, false);
    double most = 0.0;
    for (int k = 1; fine && k <= 10; k++) {
        fine = mask_pair_advance(&pair, 0.1 * k) && restore(&pair);
        const double difference = fine ? mask_pair_difference(&pair, 1.0) : 0.0;
        most = difference <= most ? most : difference;
    }
    if (fine) {
        kt_check_below("difference of states", most, 1e-10);
        kt_check_below("slider a rests, m", fabs(kt_simulation_positions(pair.simulation[1])[0]), 1e-14);
        kt_check_above("impacts", (double)kt_simulation_contacts(pair.simulation[1]).impacts, 10.0);
    }
    mask_pair_free(&pair);
}
