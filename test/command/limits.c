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

/* The command finds its modules beside itself or beside the libraries of the engine, unless the environment names an
 * earlier folder. */
KT_TEST(modules_that_cannot_be_loaded_are_told) {
    kt_shell("mkdir damaged; touch damaged/libkinetree-hdf5.so damaged/libkinetree-assimp.so");
#ifdef KT_LOADS_HDF5
    kt_expect(0, NULL, "$K run " KT_SCENES "/pendulum.yaml --duration 0.1 --quiet --out fine.h5");
    kt_expect(4, "a.h5: HDF5 cannot be loaded: damaged/libkinetree-hdf5.so: file too short",
              "LD_LIBRARY_PATH=damaged $K run " KT_SCENES "/pendulum.yaml --duration 0.1 --quiet --out a.h5");
    kt_check_true("no records are begun", kt_read_file("a.h5.partial") == NULL);
    kt_expect(4, "fine.h5: HDF5 cannot be loaded", "LD_LIBRARY_PATH=damaged $K plot fine.h5 --out a.svg");
#endif
#ifdef KT_LOADS_ASSIMP
    kt_write_file("t.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
    kt_write_file("t.yaml", "kinetree: 1\nbodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
                            "meshes: [{body: a, file: t.off}]\nsimulate: {duration: 1}\n");
    static const char words[] = "assimp cannot be loaded: damaged/libkinetree-assimp.so: file too short";
    kt_check_true("loaded", strstr(kt_shell("$K view t.yaml --out t.html").err, "assimp") == NULL);
    kt_check_contains("damaged", kt_shell("LD_LIBRARY_PATH=damaged $K view t.yaml --out t.html").err, words);
#endif
}
