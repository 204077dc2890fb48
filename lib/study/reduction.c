/* Reductions by name. */
#include "study/reduction.h"
#include "kinetree/study.h"

const kt_reduction_method *kt_reduction_method_of(kt_reduction reduction) {
#ifndef KT_NO_LOOPS
    static const kt_reduction_method partition = KT_REDUCTION_METHOD(kt_reduction_partition);
    static const kt_reduction_method svd = KT_REDUCTION_METHOD(kt_reduction_svd);
    if (reduction == KT_REDUCTION_PARTITION)
        return &partition;
    if (reduction == KT_REDUCTION_SVD)
        return &svd;
#endif
    (void)reduction;
    return NULL;
}
