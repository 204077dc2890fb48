/* The method of a run in words. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/method_words.h"

#include <stdio.h>

kt_method_words kt_describe_method(const kt_run *run) {
    kt_method_words words;
    if (run->step > 0.0)
        snprintf(words.text, sizeof words.text, "%s, step %g s", run->integrator, run->step);
    else if (run->relative == run->absolute)
        snprintf(words.text, sizeof words.text, "%s, tolerance %g", run->integrator, run->relative);
    else
        snprintf(words.text, sizeof words.text, "%s, tolerances %g relative, %g absolute", run->integrator,
                 run->relative, run->absolute);
    return words;
}
