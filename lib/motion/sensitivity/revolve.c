/* Checkpoints of a motion that is reversed, step by step. The memory holds the states at the start of some steps. Other
 * states are computed again from the last earlier checkpoint.
 *
 * With c checkpoints in memory, including the checkpoint of the present step, and at most r runs over each step,
 *
 *     beta(c, r) = (c + r)! / (c! r!)
 *
 * steps can be reversed. The next checkpoint is set beta(c, r - 1) steps ahead, with the least r that suffices. The
 * steps before this checkpoint are reversed with c checkpoints and one run less. The remaining steps are reversed with
 * c - 1 checkpoints.
 *
 * Source: Griewank, Walther, algorithm revolve, ACM Transactions on Mathematical Software 26(1), 19-45, 2000. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sensitivity/sensitivity.h"

#include <string.h>

int kt_checkpoints_of(const kt_rollout *rollout) {
    return rollout->checkpoints > 0 && rollout->checkpoints < rollout->steps ? rollout->checkpoints : rollout->steps;
}

kt_revolve kt_revolve_of(const kt_rollout *rollout, size_t numbers, double *state, double *here, int *index,
                         bool *taken) {
    return (kt_revolve){.steps = rollout->steps,
                        .most = kt_checkpoints_of(rollout),
                        .numbers = numbers,
                        .state = state,
                        .here = here,
                        .index = index,
                        .taken = taken};
}

/* beta(c, r), or any number of at least n once beta reaches n. */
static double beta(int c, int r, int n) {
    double product = 1.0;
    for (int i = 1; i <= r && product < n; i++)
        product *= (double)(c + i) / i;
    return product;
}

/* The distance to the next checkpoint in steps, with n > 1 steps left to reverse and c checkpoints, including the
 * present one. */
static int checkpoint_distance(int n, int c) {
    int r = 1;
    if (c >= n)
        return 1;
    while (beta(c, r, n) < n)
        r++;
    const double most = beta(c, r - 1, n);
    return most < n - 1 ? (int)most : n - 1;
}

kt_status kt_revolve_run(kt_revolve *r, kt_revolve_advance *advance, kt_revolve_reverse *reverse, void *user,
                         kt_error *error) {
    kt_status status = KT_OK;
    r->kept = 1;
    r->index[0] = 0;
    r->taken[0] = false;
    for (int target = r->steps - 1; target >= 0 && status == KT_OK;) {
        const double *last = r->state + (size_t)(r->kept - 1) * r->numbers;
        int k = r->index[r->kept - 1];
        if (k == target) {
            r->kept--;
            status = reverse(user, target--, r->taken[r->kept] ? r->kept : -1, last, error);
            continue;
        }
        const int free = r->most - r->kept, end = free > 0 ? k + checkpoint_distance(target - k + 1, free + 1) : target;
        memcpy(r->here, last, r->numbers * sizeof *r->here);
        for (; k < end && status == KT_OK; k++) {
            bool *taken = &r->taken[r->kept - 1];
            const bool keeps = k == r->index[r->kept - 1] && !*taken;
            status = advance(user, k, keeps ? r->kept - 1 : -1, r->here, error);
            *taken = *taken || keeps;
        }
        if (free > 0) {
            memcpy(r->state + (size_t)r->kept * r->numbers, r->here, r->numbers * sizeof *r->here);
            r->taken[r->kept] = false;
            r->index[r->kept++] = end;
        } else if (status == KT_OK)
            status = reverse(user, target--, -1, r->here, error);
    }
    return status;
}
