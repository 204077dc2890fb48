/* The module that links OpenBLAS: a table of the calls (lapack_call.c, here and in lib/study/compare), for
 * lapack_load.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "linear/lapack.h"

KT_API extern const kt_lapack_table kt_lapack_module;

#define KT_LAPACK_FILL(name, parameters, arguments) .name = kt_lapack_##name,
const kt_lapack_table kt_lapack_module = {.version = KT_VERSION, KT_LAPACK_LIST(KT_LAPACK_FILL)};
