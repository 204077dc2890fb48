/* Sines and cosines of q[angle[k]] as the recursions of each level compute them; room for whole groups of eight. */
#ifndef KT_TEST_ALGEBRA_SINCOS_LEVEL_H
#define KT_TEST_ALGEBRA_SINCOS_LEVEL_H

#include <stddef.h>
#include <stdint.h>

enum { KT_SINCOS_MOST = 1024 }; /* angles at a time */

typedef void kt_test_sincos(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine);

kt_test_sincos kt_test_sincos_baseline, kt_test_sincos_v3, kt_test_sincos_v4;

#endif
