/* Under limits of memory the command ends, with words, whether a scene needs OpenBLAS or not. */
#include "shell.h"

#include <string.h>

#define LITTLE "ulimit -v 120000; timeout 600 "

KT_TEST(commands_end_under_a_limit_of_addresses) {
    kt_expect(0, NULL, LITTLE "$K --version");
    kt_expect(0, NULL, LITTLE "$K run %s/four-bar.yaml --duration 0.1 --quiet", KT_SCENES);
    kt_expect(0, NULL, "ulimit -v 400000; timeout 600 $K run %s/n-four-bar-40.yaml --duration 0.01 --quiet", KT_SCENES);
}

KT_TEST(scene_that_needs_openblas_is_refused_under_a_limit_that_is_too_small) {
    kt_expect(2, "raise its limit", LITTLE "$K run %s/n-four-bar-40.yaml --duration 0.01 --quiet --out wide.csv",
              KT_SCENES);
    kt_check_true("no records are begun", kt_read_file("wide.csv") == NULL);
    kt_expect(2, "raise its limit", LITTLE "$K run %s/four-bar.yaml --reduction svd --quiet", KT_SCENES);
    kt_expect(2, "raise its limit", LITTLE "$K modes %s/pendulum.yaml", KT_SCENES);
}

KT_TEST(installation_without_the_module_of_lapack_is_told) {
    kt_shell("mkdir alone; cp $(dirname $K)/../../lib/libkinetree*.so.0 alone");
    kt_expect(0, NULL, "LD_LIBRARY_PATH=alone $K run %s/four-bar.yaml --duration 0.1 --quiet", KT_SCENES);
    kt_expect(2, KT_LAPACK_FILE ": LAPACK, needed for groups of loops",
              "LD_LIBRARY_PATH=alone $K modes %s/pendulum.yaml", KT_SCENES);
}
