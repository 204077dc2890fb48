/* How a scene is run: defaults and names. */
#include "kinetree/simulation.h"

kt_run kt_run_default(void) {
    kt_run run = {0};
    run.duration = 10.0;
    run.integrator = "dopri5";
    run.relative = 1e-9;
    run.absolute = 1e-9;
    return run;
}

unsigned kt_run_record(const kt_run *run, const kt_model *model) {
    if (run->record != KT_RECORD_DEFAULT)
        return run->record;
    unsigned constraint = kt_loop_count(model) > 0 ? KT_RECORD_CONSTRAINT : 0U;
    return KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ENERGY | constraint;
}

#define KT_RUN_CASE(id, name)                                                                                          \
    case id:                                                                                                           \
        return #name;

const char *kt_formulation_name(kt_formulation formulation) {
    switch (formulation) {
        KT_FORMULATION_LIST(KT_RUN_CASE)
    case KT_FORMULATION_COUNT:
        break;
    }
    return NULL;
}

const char *kt_reduction_name(kt_reduction reduction) {
    switch (reduction) { KT_REDUCTION_LIST(KT_RUN_CASE) }
    return NULL;
}

const char *kt_metric_name(kt_metric metric) {
    switch (metric) { KT_METRIC_LIST(KT_RUN_CASE) }
    return NULL;
}

const char *kt_plan_name(kt_plan plan) {
    switch (plan) {
        KT_PLAN_LIST(KT_RUN_CASE)
    case KT_PLAN_COUNT:
        break;
    }
    return NULL;
}

const char *kt_record_name(unsigned bit) {
    switch (bit) {
#define KT_RECORD_CASE(id, value, name)                                                                                \
    case value:                                                                                                        \
        return #name;
        KT_RECORD_LIST(KT_RECORD_CASE)
#undef KT_RECORD_CASE
    default:
        return NULL;
    }
}
