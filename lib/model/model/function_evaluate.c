/* The value of a function of time that no model has compiled yet. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "base/arena.h"
#include "base/require.h"
#include "model/check.h"
#include "model/function.h"

#include <string.h>

kt_status kt_function_evaluate(const kt_function *function, double t, double out[3], kt_error *error) {
    if (KT_IS_MISSING(error, function, out))
        return KT_ERROR_ARGUMENT;
    const kt_description nothing = kt_description_default();
    kt_checker checker = kt_checker_make(&nothing, NULL, NULL);
    if (!kt_checker_function(&checker, "function", function)) {
        if (error)
            *error = checker.first;
        return checker.first.code;
    }
    double made[3];
    const size_t count = kt_curve_number_count(function) + 1;
    double *numbers = kt_arena_allocate(count * sizeof *numbers, "a function of time", error);
    if (!numbers)
        return KT_ERROR_MEMORY;
    const kt_curve curve = kt_curve_compile(function, numbers, 0);
    kt_curve_evaluate(&curve, numbers, t, made);
    kt_aligned_release(numbers);
    memcpy(out, made, sizeof made);
    return KT_OK;
}
