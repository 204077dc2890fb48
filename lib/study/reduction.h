/* Reductions that serve comparison with QR decomposition. */
#ifndef KT_STUDY_REDUCTION_H
#define KT_STUDY_REDUCTION_H

#include "reduction/method.h"

KT_REDUCTION_EXTERN(kt_reduction_svd)
KT_REDUCTION_EXTERN(kt_reduction_eigen)
KT_REDUCTION_EXTERN(kt_reduction_partition)

#endif
