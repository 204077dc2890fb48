/* The list of loop types. (Their files are on the way.) */
#include "loop/kind.h"

const kt_loop_kind *const KT_KERNEL(kt_loop_kinds)[KT_LOOP_TYPE_COUNT] = {0};
