/* Derivatives of laws that give none, by central differences in each of their variables (difference.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/difference.h"
#include "derivative/dual_effect.h"
#include "evaluate/effect_formula.h"

#include <math.h>

/* A law at the values of its variables, of which the j-th is moved and restored. */
typedef struct law_point {
    const kt_effect_record *effect;
    double *values;
    int j;
} law_point;

/* The values of the law with variable j moved; *largest grows to their largest magnitude. */
static int sample_law(void *user, double moved, double *out, double *largest) {
    const law_point *p = user;
    const double at = p->values[p->j];
    p->values[p->j] = at + moved;
    const int code = kt_formulas_evaluate(NULL, p->effect, p->values, out);
    p->values[p->j] = at;
    for (int i = 0; i < 6 && code == 0; i++)
        *largest = fmax(*largest, fabs(out[i]));
    return code;
}

int kt_law_difference(const kt_effect_record *effect, double *values, double by[KT_FORMULA_VARIABLE_MAX][6],
                      double *error) {
    double sample[6], eight[6], six[6];
    int code = 0;
    for (int j = 0; j < effect->variable_count && code == 0; j++) {
        law_point at = {effect, values, j};
        /* cppcheck-suppress legacyUninitvar ; its addresses are taken, and kt_difference_find fills them */
        const kt_differenced law = {sample_law, &at, 6, sample, eight, six};
        /* Variables may be pressures or currents, so the step is relative to large values. */
        code = kt_difference_find(&law, KT_DIFFERENCE_STEP * fmax(1.0, fabs(values[j])), by[j], error);
    }
    return code;
}
