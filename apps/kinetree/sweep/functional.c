/* Functionals of the columns of a run (--functionals): its last, least and greatest value, and others. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/sweep.h"

#include "text/list.h"

#include <string.h>

double kt_sweep_functional_of(const kt_extreme *of, kt_functional which) {
    switch (which) {
    case KT_FUNCTIONAL_MIN:
        return of->least;
    case KT_FUNCTIONAL_MAX:
        return of->greatest;
    case KT_FUNCTIONAL_MEAN:
        return kt_extreme_mean(of);
    case KT_FUNCTIONAL_RMS:
        return kt_extreme_rms(of);
    case KT_FUNCTIONAL_INTEGRAL:
        return of->integral;
    case KT_FUNCTIONAL_END:
    case KT_FUNCTIONALS:
        break;
    }
    return of->last;
}

#define FUNCTIONAL_NAME(id, name) #name,
const char *const kt_sweep_functional_names[] = {KT_FUNCTIONAL_LIST(FUNCTIONAL_NAME)};

int kt_sweep_list_functionals(kt_sweep *sweep) {
    const char *list = sweep->arguments->functionals != NULL ? sweep->arguments->functionals : "end,min,max";
    char word[32];
    while (kt_list_next(&list, word, sizeof word)) {
        int found = 0;
        while (found < KT_FUNCTIONALS && strcmp(kt_sweep_functional_names[found], word) != 0)
            found++;
        if (found == KT_FUNCTIONALS)
            return kt_misuse(
                "sweep: --functionals takes some of end, min, max, mean, rms and integral, each once, not '%s'", word);
        sweep->functionals[sweep->functional_count++] = (kt_functional)found;
    }
    return -1;
}
