/* Random formulas of time with many features, some of which take long to find. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_EXPRESSION_STEEP_H
#define KT_TEST_EXPRESSION_STEEP_H

#include "random.h"

#include <stddef.h>

/* Writes a sum of one to four steep functions of lines and waves. Some of them multiply a wave. */
void kt_write_steep_formula(kt_random *random, char *text, size_t size);

#endif
