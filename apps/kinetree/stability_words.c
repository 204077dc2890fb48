/* Modes in words, and the warning of a step that is too long. */
#include "stability.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- modes ------------------------------------------------------------------------------------------------------- */

enum { MOVERS_MAX = 4 };

static double mover_of(const kt_model *model, const double *moves, int body) {
    const kt_coordinates at = kt_body_coordinates(model, body);
    double most = 0.0;
    for (int i = 0; i < at.nv; i++)
        most = fmax(most, moves[at.v + i]);
    return most;
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
        for (int body = 1; body < kt_model_body_count(model); body++) { /* equal ones in the order of the model */
            const double move = mover_of(model, moves, body);
            const bool is_next = move < before || (move == before && body > last);
            if (is_next && move > most) {
                most = move;
                best = body;
            }
        }
        if (best == 0 || most < 0.1)
            break;
        used += (size_t)snprintf(text + used, size - used, "%s%s", n > 0 ? ", " : "", kt_body_name(model, best));
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
        snprintf(text, size, "undamped swing of %.4g Hz", mode->frequency);
    else
        snprintf(text, size, "swing of %.4g Hz, damping %.2g", mode->frequency, mode->damping);
}

/* ---- the warning ------------------------------------------------------------------------------------------------- */

enum { WARNED_MOST = 60 }; /* velocity coordinates: what a linearisation costs a run then hardly shows */

static void say_warning(kt_warnings *warnings, const kt_model *model, const kt_run *run, const kt_method *method,
                        const kt_spectrum *spectrum, const kt_step_limit *limit) {
    char mode[64], movers[128], remedy[128], way[48] = "blows up";
    const kt_spectrum_mode at = kt_spectrum_at(spectrum, limit->mode);
    kt_write_mode(&at.mode, mode, sizeof mode);
    kt_write_movers(model, at.moves, movers, sizeof movers);
    if (limit->growth < 1e6)
        snprintf(way, sizeof way, "grows about %.2g times over the run", limit->growth);
    snprintf(remedy, sizeof remedy, "Take steps below %.3g s%s; 'kinetree stability' shows more", limit->step,
             !method->stabilised && limit->growth >= 1e6 && at.mode.damping > 0.9 ? ", or rkc2" : "");
    const kt_warning warning = {
        .code = "unstable_step", .time = at.time, .value = limit->step, .unit = "s", .remedy = remedy};
    kt_warn(warnings, &warning,
            "steps of %g s are too long for %s to be stable: %s %s (%s) %s, which in truth it does not", run->step,
            method->name, mode[0] == 'u' ? "an" : "a", mode, movers, way);
}

bool kt_warn_of_step(kt_warnings *warnings, const kt_model *model, const kt_run *run, const kt_simulation *simulation) {
    const kt_method *method = run->integrator != NULL ? kt_method_find(run->integrator) : NULL;
    const int nv = kt_model_nv(model);
    bool warns = false;
    kt_spectrum *spectrum = NULL;
    if (!(run->step > 0.0) || !(run->duration > run->step) || method == NULL || nv == 0 || nv > WARNED_MOST)
        return false;
    /* What cannot be linearised cannot be warned of; the run itself says what is wrong with the scene. */
    if (kt_spectrum_create(model, 1, &spectrum, NULL) == KT_OK &&
        kt_spectrum_add(spectrum, kt_simulation_time(simulation), kt_simulation_positions(simulation),
                        kt_simulation_velocities(simulation), NULL, NULL) == KT_OK) {
        const kt_step_limit limit = kt_spectrum_limit(spectrum, method, run->duration, run->step);
        warns = limit.growth > KT_STABILITY_GROWTH && limit.mode >= 0;
        if (warns)
            say_warning(warnings, model, run, method, spectrum, &limit);
    }
    kt_spectrum_free(spectrum);
    return warns;
}
