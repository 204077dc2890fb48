/* The norm of the difference of two states (defined in kinetree/study.h).
 *
 * Differences follow the algebra of the joints: dv with q (+) dv = q_other. A quaternion therefore yields the
 * vector of the rotation between the two. Coordinates of a joint that form one vector (a rotation, a translation) count
 * by its Euclidean length, all others individually.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/accuracy.h"

#include "kinetree/descriptor.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"

#include <math.h>

static const double turn = 6.28318530717958647692;

static bool kind_is_length(kt_coordinate_kind kind) {
    return kind == KT_COORDINATE_LENGTH || kind == KT_COORDINATE_TRANSLATION;
}

/* Adds one joint. of_velocities: whole turns count. */
static void add_joint(kt_joint_type type, int count, bool of_velocities, const double *d, kt_difference *largest) {
    for (int k = 0; k < count;) {
        const kt_coordinate_kind kind = kt_joint_coordinate_kind(type, k);
        const bool is_vector = kind == KT_COORDINATE_TRANSLATION || kind == KT_COORDINATE_ROTATION;
        double square = 0.0;
        do {
            const double x = kind == KT_COORDINATE_ANGLE && !of_velocities ? remainder(d[k], turn) : d[k];
            square += x * x;
            k++;
        } while (is_vector && k < count && kt_joint_coordinate_kind(type, k) == kind);
        double *to = kind_is_length(kind) ? &largest->length : &largest->angle;
        *to = kt_worse(*to, sqrt(square));
    }
}

kt_difference kt_difference_size(const kt_model *model, const double *difference, bool of_velocities) {
    kt_difference largest = {0.0, 0.0};
    if (!model || !difference)
        return (kt_difference){(double)NAN, (double)NAN};
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        add_joint(at.type, at.nv, of_velocities, difference + at.v, &largest);
    }
    return largest;
}

/* The norm of study->difference. */
static double measure_accuracy_norm(const kt_accuracy *study, bool of_velocities) {
    const kt_difference largest = kt_difference_size(study->model, study->difference, of_velocities);
    return kt_worse(largest.angle, largest.length / study->results.length);
}

kt_accuracy_norm kt_accuracy_distance(const kt_accuracy *study, kt_accuracy_state a, kt_accuracy_state b) {
    kt_accuracy_norm norm;
    kt_position_subtract(study->model, b.q, a.q, study->difference);
    norm.position = measure_accuracy_norm(study, false);
    for (size_t i = 0; i < study->nv; i++)
        study->difference[i] = b.v[i] - a.v[i];
    norm.velocity = measure_accuracy_norm(study, true);
    return norm;
}

kt_accuracy_unit kt_accuracy_find_unit(const kt_model *model) {
    bool angles = false, lengths = false;
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        for (int k = 0; k < at.nv; k++) {
            const bool length = kind_is_length(kt_joint_coordinate_kind(at.type, k));
            lengths = lengths || length;
            angles = angles || !length;
        }
    }
    return angles && lengths ? KT_ACCURACY_MIXED : lengths ? KT_ACCURACY_METRE : KT_ACCURACY_RADIAN;
}

bool kt_accuracy_has_contacts(const kt_model *model) {
    for (int i = 0; i < kt_loop_count(model); i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE || kt_loop_is_stick(model, i))
            return true;
    return false;
}
