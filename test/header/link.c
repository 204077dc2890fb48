/* Every function that a public header declares is in the libraries of this build: this program would not link
 * otherwise. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/experimental.h"
#include "kinetree/kinetree.h"

#include "check.h"
#include "link.h"

typedef void any_function(void);

static any_function *const functions[] = {
#define ADDRESS_OF(name) (any_function *)name,
    FUNCTION_LIST(ADDRESS_OF)};

KT_TEST(every_declared_function_is_linked) {
    int missing = 0, count = (int)(sizeof functions / sizeof *functions);
    for (int i = 0; i < count; i++)
        missing += functions[i] == NULL;
    kt_note("%d functions", count);
    kt_check_equal_int("missing", missing, 0);
    kt_check_true("there are many", count > 400);
}
