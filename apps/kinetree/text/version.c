/* kinetree --version: what a report of a fault needs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"

#include "kinetree/kinetree.h"

#include <stdio.h>
#include <sys/utsname.h>

#if defined(__clang__)
#define KT_COMPILER "clang " __clang_version__
#elif defined(__GNUC__)
#define KT_COMPILER "gcc " __VERSION__
#else
#define KT_COMPILER "unknown"
#endif

/* Returns the instruction set that the recursions of a model take on this processor. */
static const char *instruction_set(void) {
    static const char *const names[] = {"unknown", "baseline", "x86-64-v3", "x86-64-v4"};
    const kt_body body = {.name = "body",
                          .joint = {.type = KT_JOINT_REVOLUTE, .axis = {0.0, 0.0, 1.0}},
                          .mass = 1.0,
                          .inertia = {.xx = 1.0, .yy = 1.0, .zz = 1.0}};
    const kt_description description = {.bodies = &body, .body_count = 1};
    kt_model *model = NULL;
    kt_isa isa = KT_ISA_AUTO;
    if (kt_model_compile(&description, NULL, &model, NULL) == KT_OK)
        isa = kt_model_isa(model);
    kt_model_free(model);
    return names[isa <= KT_ISA_V4 ? isa : KT_ISA_AUTO];
}

void kt_print_version(void) {
    struct utsname system;
    printf("kinetree %s\n"
           "  compiler      %s\n"
           "  kernels       %s (compiled: %s)\n"
           "  libraries     %s\n",
           kt_version(), KT_COMPILER, instruction_set(), KT_KERNEL_LEVELS, KT_LIBRARY_VERSIONS);
    if (uname(&system) == 0)
        printf("  system        %s %s %s\n", system.sysname, system.release, system.machine);
}
