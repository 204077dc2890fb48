/* Ropes: their lengths, and the sag of slack ropes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/camera.h"
#include "picture/picture.h"

#include <math.h>

double kt_picture_rope_length(const kt_picture_loop *loop, double t) {
    double length[3];
    if (loop->rope == NULL)
        return (double)NAN;
    if (loop->rope->type == KT_FUNCTION_NONE)
        return loop->rope_given;
    return kt_function_evaluate(loop->rope, t, length, NULL) == KT_OK ? length[0] : (double)NAN;
}

/* A rope hangs as a parabola over the chord c from a to b, lower by d in its middle, along the unit vector g:
 *     p(s) = a + s c + 4 s (1 - s) d g,   |p'|^2 = (u + c.g)^2 + h^2,   u = 4 d (1 - 2 s),   h^2 = c.c - (c.g)^2
 * With F(w) = (w sqrt(w^2 + h^2) + h^2 asinh(w / h)) / 2, its length is (F(c.g + 4 d) - F(c.g - 4 d)) / (8 d). */
static double integral_of_speed(double w, double h) {
    return 0.5 * (w * sqrt(w * w + h * h) + (h > 0.0 ? h * h * asinh(w / h) : 0.0));
}

static double parabola_length(double depth, double along, double across) {
    return (integral_of_speed(along + 4.0 * depth, across) - integral_of_speed(along - 4.0 * depth, across)) /
           (8.0 * depth);
}

/* Bisection: the length is at least the length of two straight halves, which is at least 2 d. 0: the rope is taut. */
static double rope_depth(double length, kt_vec3 chord, kt_vec3 down) {
    const double along = kt_vec3_dot(chord, down), distance = kt_vec3_norm(chord);
    const double across = kt_vec3_norm(kt_vec3_sub(chord, kt_vec3_scale(along, down)));
    double low = 0.0, high = 0.5 * length;
    if (!(length > distance * (1.0 + 1e-6)))
        return 0.0;
    for (int i = 0; i < 40; i++) {
        const double depth = 0.5 * (low + high);
        const bool is_long = parabola_length(depth, along, across) > length;
        low = is_long ? low : depth;
        high = is_long ? depth : high;
    }
    return low;
}

bool kt_picture_rope_curve(const kt_picture *picture, const kt_picture_loop *loop, double t, kt_vec3 a, kt_vec3 b,
                           kt_vec3 control[2]) {
    const double weight = kt_vec3_norm(picture->gravity);
    const kt_vec3 down = weight > 0.0 ? kt_vec3_scale(1.0 / weight, picture->gravity)
                                      : kt_vec3_scale(-1.0, kt_picture_vertical(picture));
    const kt_vec3 chord = kt_vec3_sub(b, a);
    const double depth = rope_depth(kt_picture_rope_length(loop, t), chord, down);
    for (int k = 0; k < 2; k++)
        control[k] =
            kt_vec3_add(kt_vec3_add(a, kt_vec3_scale((k + 1) / 3.0, chord)), kt_vec3_scale(4.0 / 3.0 * depth, down));
    return depth > 0.0;
}
