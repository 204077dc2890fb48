/* Describes modes in words. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/stability.h"

#include <math.h>
#include <stdio.h>

/* ---- modes ------------------------------------------------------------------------------------------------------- */

enum { MOVERS_MAX = 4 };

/* Returns the amplitude of a body's joint; the largest of all is 1. It is rounded to a millionth, so that bodies with
 * equal amplitudes compare equal despite rounding errors of the eigenvectors. */
static double mover_of(const kt_model *model, const double *moves, int body) {
    const kt_coordinates at = kt_body_coordinates(model, body);
    double most = 0.0;
    for (int i = 0; i < at.nv; i++)
        most = fmax(most, moves[at.v + i]);
    return 1e-6 * round(1e6 * most);
}

void kt_write_movers(const kt_model *model, const double *moves, char *text, size_t size) {
    size_t used = 0;
    double before = HUGE_VAL;
    int last = 0, more = -MOVERS_MAX;
    text[0] = '\0';
    if (moves == NULL)
        return;
    for (int body = 1; body < kt_model_body_count(model); body++)
        more += mover_of(model, moves, body) >= 0.1;
    for (int n = 0; n < MOVERS_MAX && used < size; n++) {
        int best = 0;
        double most = 0.0;
        for (int body = 1; body < kt_model_body_count(model); body++) { /* ties: in the order of the model */
            const double move = mover_of(model, moves, body);
            const bool is_next = move < before || (move == before && body > last);
            if (is_next && move > most) {
                most = move;
                best = body;
            }
        }
        if (best == 0 || most < 0.1)
            break;
        used += (size_t)snprintf(text + used, size - used, "%s%s", n > 0 ? ", " : "", kt_joint_name(model, best));
        before = most;
        last = best;
    }
    if (more > 0 && used < size)
        snprintf(text + used, size - used, " and %d more", more);
}

void kt_write_mode(const kt_mode *mode, char *text, size_t size) {
    const double least = fmax(1e-3 * hypot(mode->real, mode->imaginary), mode->error);
    const bool swings = fabs(mode->imaginary) > least, moves = fabs(mode->real) > least;
    if (!swings)
        snprintf(text, size, "%s of %.4g /s", mode->real > 0.0 ? "growth" : "decay", fabs(mode->real));
    else if (!moves)
        snprintf(text, size, "undamped oscillation of %.4g Hz", mode->frequency);
    else
        snprintf(text, size, "oscillation of %.4g Hz, damping ratio %.2g", mode->frequency, mode->damping);
}

void kt_write_moving_mode(const kt_model *model, const kt_spectrum_mode *at, char *text, size_t size) {
    char mode[64], movers[128];
    kt_write_mode(&at->mode, mode, sizeof mode);
    kt_write_movers(model, at->moves, movers, sizeof movers);
    snprintf(text, size, "%s%s%s%s", mode, movers[0] != '\0' ? " (" : "", movers, movers[0] != '\0' ? ")" : "");
}

/* ---- methods ----------------------------------------------------------------------------------------------------- */

void kt_write_verdict(const kt_method *method, char *text, size_t size) {
    kt_stability stability;
    text[0] = '\0';
    if (!kt_method_is_implicit(method) || kt_stability_make(method, 0, &stability, NULL) != KT_OK)
        return;
    const kt_stability_verdict verdict = kt_stability_assess(&stability);
    if (verdict.l_stable)
        snprintf(text, size, "L-stable");
    else if (verdict.a_stable)
        snprintf(text, size, "A-stable, %.3g at infinity", verdict.at_infinity);
    else
        snprintf(text, size, "not A-stable");
}
