/* The norm of the difference of two states: see kinetree/accuracy.h.
 *
 * Differences are those of the joints' own algebra, dv with q (+) dv = q_other, so that a quaternion gives the vector
 * of the rotation between the two. Coordinates of a joint that make one vector (a rotation, a translation) count by its
 * Euclidean length, all others by themselves.
 */
#include "study/accuracy.h"

#include "kinetree/joint.h"

#include <math.h>

static const double turn = 6.28318530717958647692;

/* What a velocity coordinate of a joint measures. */
typedef enum quantity {
    NOTHING = 0,
    CIRCLE,   /* an angle, whole turns of which are the same position */
    ANGLE,    /* an angle that counts its turns */
    LENGTH,   /* by itself */
    PLACE,    /* a component of a translation */
    ROTATION, /* a component of a rotation vector */
} quantity;

static const quantity quantities[KT_JOINT_TYPE_COUNT][KT_JOINT_NV_MAX] = {
    [KT_JOINT_REVOLUTE] = {CIRCLE},
    [KT_JOINT_PRISMATIC] = {LENGTH},
    [KT_JOINT_SCREW] = {ANGLE},
    [KT_JOINT_CYLINDRICAL] = {CIRCLE, LENGTH},
    [KT_JOINT_PLANAR] = {PLACE, PLACE, CIRCLE},
    [KT_JOINT_UNIVERSAL] = {CIRCLE, CIRCLE},
    [KT_JOINT_SPHERICAL] = {ROTATION, ROTATION, ROTATION},
    [KT_JOINT_FREE] = {PLACE, PLACE, PLACE, ROTATION, ROTATION, ROTATION},
};

static double larger(double a, double b) { return a > b || isnan(a) ? a : b; }

/* The largest over one joint. of_rates: whole turns count. */
static double measure_joint(const quantity *kinds, int count, double length, bool of_rates, const double *d) {
    double largest = 0.0;
    for (int k = 0; k < count;) {
        const quantity kind = kinds[k];
        const bool is_vector = kind == PLACE || kind == ROTATION;
        double square = 0.0;
        do {
            const double x = kind == CIRCLE && !of_rates ? remainder(d[k], turn) : d[k];
            square += x * x;
            k++;
        } while (is_vector && k < count && kinds[k] == kind);
        const double size = sqrt(square);
        largest = larger(kind == LENGTH || kind == PLACE ? size / length : size, largest);
    }
    return largest;
}

static double measure(const kt_model *model, double length, bool of_rates, const double *d) {
    double largest = 0.0;
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        largest = larger(measure_joint(quantities[at.type], at.nv, length, of_rates, d + at.v), largest);
    }
    return largest;
}

kt_accuracy_norm kt_accuracy_distance(const kt_model *model, double length, const double *q, const double *v,
                                      const double *q_other, const double *v_other, double *dv) {
    kt_accuracy_norm norm;
    kt_position_subtract(model, q_other, q, dv);
    norm.position = measure(model, length, false, dv);
    for (int i = 0; i < kt_model_nv(model); i++)
        dv[i] = v_other[i] - v[i];
    norm.velocity = measure(model, length, true, dv);
    return norm;
}

kt_accuracy_unit kt_accuracy_find_unit(const kt_model *model) {
    bool angles = false, lengths = false;
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        for (int k = 0; k < at.nv; k++) {
            const quantity kind = quantities[at.type][k];
            lengths = lengths || kind == LENGTH || kind == PLACE;
            angles = angles || !(kind == LENGTH || kind == PLACE);
        }
    }
    return angles && lengths ? KT_ACCURACY_MIXED : lengths ? KT_ACCURACY_METRE : KT_ACCURACY_RADIAN;
}
