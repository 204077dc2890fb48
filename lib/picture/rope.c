/* Ropes: their lengths, and how far slack ones sag. */
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

/* A parabola of the depth d over the distance c has the length
 *     c/2 (sqrt(1 + u^2) + asinh(u) / u),   u = 4 d / c */
static double parabola_length(double depth, double distance) {
    const double u = 4.0 * depth / distance;
    return u > 1e9 ? 2.0 * depth : u > 1e-9 ? 0.5 * distance * (sqrt(1.0 + u * u) + asinh(u) / u) : distance;
}

/* Bisection: the depth is below that of two straight halves, which is at most half of the length. */
double kt_picture_rope_sag(double length, double distance) {
    double low = 0.0, high = 0.5 * length;
    if (!(length > distance * (1.0 + 1e-6)))
        return 0.0;
    for (int i = 0; i < 40; i++) {
        const double depth = 0.5 * (low + high);
        const bool is_long = parabola_length(depth, distance) > length;
        low = is_long ? low : depth;
        high = is_long ? depth : high;
    }
    return low;
}

int kt_picture_rope_points(const kt_picture_loop *loop, kt_vec3 gravity, kt_vec3 a, kt_vec3 b, kt_vec3 points[2]) {
    const kt_vec3 between = kt_vec3_sub(b, a), middle = kt_vec3_scale(0.5, kt_vec3_add(a, b));
    const double distance = kt_vec3_norm(between),
                 sag = kt_picture_rope_sag(kt_picture_rope_length(loop, 0.0), distance);
    if (!(sag > 0.0) || !(distance > 0.0))
        return 0;
    const kt_vec3 along = kt_vec3_scale(1.0 / distance, between);
    const kt_vec3 down = kt_vec3_sub(gravity, kt_vec3_scale(kt_vec3_dot(gravity, along), along));
    const double size = kt_vec3_norm(down);
    if (size > 1e-3 * kt_vec3_norm(gravity)) {
        points[0] = kt_vec3_add(middle, kt_vec3_scale(sag / size, down));
        return 1;
    }
    const kt_mat3 axes = kt_triad_from_axis(along, 0); /* it is drawn on one of two sides */
    points[0] = kt_vec3_add(middle, kt_vec3_scale(sag, kt_vec3_add(axes.y, axes.z)));
    points[1] = kt_vec3_sub(middle, kt_vec3_scale(sag, kt_vec3_add(axes.y, axes.z)));
    return 2;
}
