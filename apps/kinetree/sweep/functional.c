/* Functionals of the columns of a run: its last, least and greatest value, and its mean over time. */
#include "sweep/functional.h"

#include "command.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void kt_sweep_range_extend(kt_sweep_range *of, double time, double value) {
    if (isnan(value)) {
        of->time = (double)NAN;
        return;
    }
    const double step = isnan(of->time) ? 0.0 : time - of->time, before = step > 0.0 ? of->last : value;
    of->covered += step;
    of->integral += 0.5 * step * (before + value);
    of->squares += 0.5 * step * (before * before + value * value);
    of->time = time;
    of->last = value;
    of->least = value < of->least ? value : of->least;
    of->greatest = value > of->greatest ? value : of->greatest;
}

/* Values without any duration have the last one as their mean. */
double kt_sweep_range_value(const kt_sweep_range *of, kt_functional which) {
    const double duration = of->covered;
    switch (which) {
    case KT_FUNCTIONAL_MIN:
        return of->least;
    case KT_FUNCTIONAL_MAX:
        return of->greatest;
    case KT_FUNCTIONAL_MEAN:
        return duration > 0.0 ? of->integral / duration : of->last;
    case KT_FUNCTIONAL_RMS:
        return duration > 0.0 ? sqrt(of->squares / duration) : fabs(of->last);
    case KT_FUNCTIONAL_INTEGRAL:
        return of->integral;
    case KT_FUNCTIONAL_END:
    case KT_FUNCTIONALS:
        break;
    }
    return of->last;
}

kt_sweep_range *kt_sweep_ranges_create(size_t count) {
    kt_sweep_range *ranges = malloc((count + 1) * sizeof *ranges);
    for (size_t i = 0; ranges != NULL && i < count; i++)
        ranges[i] = (kt_sweep_range){
            .last = (double)NAN, .least = HUGE_VAL, .greatest = -HUGE_VAL, .covered = 0.0, .time = (double)NAN};
    return ranges;
}

#define FUNCTIONAL_NAME(id, name) #name,
const char *const kt_sweep_functional_names[] = {KT_FUNCTIONAL_LIST(FUNCTIONAL_NAME)};

int kt_sweep_list_functionals(kt_sweep *sweep) {
    const char *list = sweep->arguments->functionals != NULL ? sweep->arguments->functionals : "end,min,max";
    for (const char *from = list; from != NULL;) {
        const size_t length = strcspn(from, ",");
        int found = 0;
        while (found < KT_FUNCTIONALS && (strlen(kt_sweep_functional_names[found]) != length ||
                                          strncmp(kt_sweep_functional_names[found], from, length) != 0))
            found++;
        for (int k = 0; k < sweep->functional_count && found < KT_FUNCTIONALS; k++)
            if ((int)sweep->functionals[k] == found)
                found = KT_FUNCTIONALS + 1;
        if (found >= KT_FUNCTIONALS)
            return kt_misuse(
                "sweep: --functionals takes some of end, min, max, mean, rms and integral, each once, not '%.*s'%s",
                (int)length, from, found > KT_FUNCTIONALS ? " again" : "");
        sweep->functionals[sweep->functional_count++] = (kt_functional)found;
        from = from[length] == ',' ? from + length + 1 : NULL;
    }
    return -1;
}
