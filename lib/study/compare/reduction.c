/* Reductions and formulations by name. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/reduction.h"
#include "kinetree/study.h"
#include "model/describe.h"

const char *kt_reduction_name(kt_reduction reduction) {
    static const char *const names[] = {KT_REDUCTION_LIST(KT_LISTED_NAME)};
    return (unsigned)reduction < KT_REDUCTION_COUNT ? names[reduction] : NULL;
}

const char *kt_formulation_name(kt_formulation formulation) {
    static const char *const names[] = {KT_FORMULATION_LIST(KT_LISTED_NAME)};
    return (unsigned)formulation < KT_FORMULATION_COUNT ? names[formulation] : NULL;
}

const kt_reduction_method *kt_reduction_method_of(kt_reduction reduction) {
    static const kt_reduction_method partition = KT_REDUCTION_METHOD(kt_reduction_partition);
    static const kt_reduction_method svd = KT_REDUCTION_METHOD(kt_reduction_svd);
    if (reduction == KT_REDUCTION_PARTITION)
        return &partition;
    static const kt_reduction_method eigen = KT_REDUCTION_METHOD(kt_reduction_eigen);
    if (reduction == KT_REDUCTION_SVD)
        return &svd;
    if (reduction == KT_REDUCTION_EIGEN)
        return &eigen;
    (void)reduction;
    return NULL;
}
