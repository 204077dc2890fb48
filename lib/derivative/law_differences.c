/* Derivatives of laws that give none, by central differences in each of their variables (difference.h). */
#include "derivative/difference.h"
#include "derivative/dual_effect.h"
#include "mechanism/formula.h"

#include <float.h>
#include <string.h>

/* The differences by one variable. */
typedef struct difference {
    double eight[6], six[6];
    double bound; /* of the error of `eight`, relative to the largest of them; 0 if it is rounding */
} difference;

/* values: those of the variables. The j-th is moved and restored. */
static int find_law_difference(const kt_effect_record *effect, double *values, int j, double h, difference *d) {
    const double at = values[j];
    double out[6], largest = 0.0, most = 0.0, apart = 0.0;
    int code = 0;
    *d = (difference){.bound = 0.0};
    for (int k = -4; k <= 4 && code == 0; k++) {
        double eight, six;
        if (k == 0)
            continue;
        values[j] = at + k * h;
        code = kt_formulas_evaluate(NULL, effect, values, out);
        kt_difference_weights(k, h, &eight, &six);
        for (int i = 0; i < 6; i++) {
            largest = fmax(largest, fabs(out[i]));
            d->eight[i] += eight * out[i];
            d->six[i] += six * out[i];
        }
    }
    values[j] = at;
    for (int i = 0; i < 6; i++) {
        most = fmax(most, fabs(d->eight[i]));
        apart = fmax(apart, fabs(d->eight[i] - d->six[i]));
    }
    if (apart > KT_DIFFERENCE_ROUNDING * DBL_EPSILON * largest / h)
        d->bound = apart / most;
    return code;
}

int kt_law_difference(const kt_effect_record *effect, double *values, double by[KT_FORMULA_VARIABLE_MAX][6],
                      double *error) {
    int code = 0;
    for (int j = 0; j < effect->variable_count && code == 0; j++) {
        /* Variables may be pressures or currents, so the step is relative to large values. */
        const double step = KT_DIFFERENCE_STEP * fmax(1.0, fabs(values[j]));
        double least = HUGE_VAL;
        for (int k = 0; k < KT_DIFFERENCE_STEPS && least > KT_DIFFERENCE_COARSE && code == 0; k++) {
            difference d;
            code = find_law_difference(effect, values, j, ldexp(step, -3 * k), &d);
            if (!(d.bound < least))
                continue;
            least = d.bound;
            memcpy(by[j], d.eight, sizeof d.eight);
        }
        *error = fmax(*error, least);
    }
    return code;
}
