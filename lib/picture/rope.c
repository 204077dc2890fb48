/* Ropes: their lengths, and how far slack ones sag. */
#include "picture/maker.h"

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

void kt_picture_measure_ropes(kt_picture_maker *m) {
    for (int i = 0; i < m->picture->loop_count; i++) {
        kt_picture_loop *loop = &m->picture->loops[i];
        const kt_vec3 first = kt_body_frame_pose(&loop->ends[0], m->poses).position,
                      second = kt_body_frame_pose(&loop->ends[1], m->poses).position;
        loop->rope_given = loop->rope != NULL ? kt_vec3_norm(kt_vec3_sub(second, first)) : (double)NAN;
    }
}
