/* Angles that were probably given in degrees without the unit. */
#include "advice/angles.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdio.h>

static const double one_turn = 2.0 * 3.14159265358979323846;

bool kt_doubtful_angle(double x) {
    const double degrees = 1000.0 * 360.0 * (x / one_turn);
    return fabs(x) > one_turn && fabs(degrees - rint(degrees)) > 1e-6 * fabs(degrees) / 360.0;
}

static void warn_of_angle(kt_warnings *warnings, const kt_body *body, int k, double x) {
    char remedy[80], index[8] = "";
    (void)snprintf(remedy, sizeof remedy, "Write '%.9g deg' if degrees are meant", x);
    if (k > 0)
        (void)snprintf(index, sizeof index, "[%d]", k);
    const kt_warning warning = {.code = "radians", .time = 0.0, .value = x, .unit = "rad", .remedy = remedy};
    kt_warn(warnings, &warning, "body '%s': joint.position%s: %.9g is in radians, %.3g turns", body->name, index, x,
            x / one_turn);
}

int kt_angles_warn(kt_warnings *warnings, const kt_scene *scene, bool only_whole) {
    int count = 0;
    for (int i = 0; i < scene->description.body_count; i++) {
        const kt_body *body = &scene->description.bodies[i];
        for (int k = 0; k < KT_JOINT_NQ_MAX; k++) {
            const double x = body->joint.position[k];
            if (kt_joint_coordinate_kind(body->joint.type, k) != KT_COORDINATE_ANGLE || !kt_doubtful_angle(x) ||
                (only_whole && x != rint(x)))
                continue;
            warn_of_angle(warnings, body, k, x);
            count++;
        }
    }
    return count;
}

int kt_angles_say(const kt_scene *scene, bool quiet) {
    kt_warnings warnings = {.quiet = quiet};
    const int count = kt_angles_warn(&warnings, scene, true);
    kt_warnings_free(&warnings);
    return count;
}
