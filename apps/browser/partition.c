/* Coordinate partitioning for a live page. Its private headers and those of the viewer both have a type kt_motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/reduction.h"

const kt_reduction_method *kt_page_partition(void);
const kt_reduction_method *kt_page_partition(void) {
    static const kt_reduction_method partition = KT_REDUCTION_METHOD(kt_reduction_partition);
    return &partition;
}
