/* Under limits of memory the command ends, with words, whether a scene needs OpenBLAS or not. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <stdio.h>
#include <string.h>

#define LITTLE "ulimit -v 120000; timeout 600 "

KT_TEST(commands_end_under_a_limit_of_addresses) {
    kt_expect(0, NULL, LITTLE "$K --version");
    kt_expect(0, NULL, LITTLE "$K run %s/four-bar.yaml --duration 0.1 --quiet", KT_SCENES);
    kt_expect(0, NULL, "ulimit -v 400000; timeout 600 $K run %s/n-four-bar-40.yaml --duration 0.01 --quiet", KT_SCENES);
}

KT_TEST(scene_that_needs_openblas_is_rejected_under_a_limit_that_is_too_small) {
    kt_expect(2, "raise its limit", LITTLE "$K run %s/four-bar.yaml --reduction svd --quiet --out wide.csv", KT_SCENES);
    kt_check_true("no records are begun", kt_read_file("wide.csv") == NULL);
    kt_expect(2, "raise its limit", LITTLE "$K modes %s/pendulum.yaml", KT_SCENES);
}

KT_TEST(installation_without_the_module_of_lapack_is_told) {
    kt_shell("mkdir alone; cp $(dirname $K)/../../lib/libkinetree*.so." KT_INTERFACE " alone");
    kt_expect(0, NULL, "LD_LIBRARY_PATH=alone $K run %s/four-bar.yaml --duration 0.1 --quiet", KT_SCENES);
    kt_expect(2, KT_LAPACK_FILE ": LAPACK, needed for groups of loops",
              "LD_LIBRARY_PATH=alone $K modes %s/pendulum.yaml", KT_SCENES);
    /* The warning of a run with LAPACK: rk4 takes 6.8 steps a period. */
    static const char run[] = "$K run %s/pendulum.yaml --integrator rk4 --step 0.3 --out /dev/null --summary -";
    char line[256];
    snprintf(line, sizeof line, run, KT_SCENES);
    kt_check_contains("with it", kt_shell("%s", line).err, "warning: rk4 at 0.3 s takes 6.78 steps a period");
    const kt_ran ran = kt_shell("LD_LIBRARY_PATH=alone %s", line);
    const char *told = strstr(ran.err, "warning: steps of 0.3 s may be unstable or too long for rk4");
    kt_check_true("told", told != NULL);
    kt_check_true("once", told != NULL && strstr(told + strlen("warning: whether"), "whether steps") == NULL);
    kt_check_contains("why", ran.err, KT_LAPACK_FILE ": LAPACK, needed for");
    json_t *root = kt_json(ran.out);
    kt_check_text("in the summary", json_string_value(kt_json_find(root, "warnings[0].code")), "unknown_stability");
    json_decref(root);
}
