/* Whether the address sanitizer is in the program: gcc defines a macro, clang answers a question. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SANITIZED_H
#define KT_TEST_SANITIZED_H

#if defined(__SANITIZE_ADDRESS__)
#define KT_ADDRESS_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define KT_ADDRESS_SANITIZER 1
#endif
#endif
#ifndef KT_ADDRESS_SANITIZER
#define KT_ADDRESS_SANITIZER 0
#endif

#include <stdbool.h>

/* Sanitizers check memory and not figures, and a program takes some thirty times as long with them. Each `share`th of
 * many similar cases is then enough. `count` counts the calls. */
static inline bool kt_is_asked(int *count, int share) { return (*count)++ % (KT_ADDRESS_SANITIZER ? share : 1) == 0; }

#endif
