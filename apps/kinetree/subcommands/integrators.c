/* kinetree integrators: prints the table of methods. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "text/arguments.h"

#include <stdio.h>

const kt_usage kt_usage_integrators = {
    .command = "integrators",
    .examples = "  kinetree integrators\n"
                "  kinetree run pendulum.yaml --integrator tsit5 --tolerance 1e-10\n"
                "  kinetree run pendulum.yaml --integrator rk4 --step 1e-3\n",
    .operands = "",
    .about =
        "Lists the methods.\n"
        "A stabilised method takes more stages than those listed if the motion decays fast.\n"
        "Implicit methods (dirk, two-step, rosenbrock, radau) solve equations in each step, for stiff motions.\n"
        "Multistep methods (adams, two-step) use past steps, and start with a one-step method of their order.\n"
        "Adaptive methods choose their steps from a tolerance, or take a fixed step. The others need a fixed step.\n"
        "Dense is the order of the records between steps.\n"
        "A scene without a method runs with auto. It runs with dopri5 if it has a fixed step or more than 100 velocity "
        "coordinates.\n",
};

int kt_command_integrators(int argc, char **argv) {
    int code = kt_arguments_read(&kt_usage_integrators, argc, argv, NULL, NULL);
    if (code >= 0)
        return code;
    printf("%-14s  %5s  %6s  %8s  %5s  %-10s  %s\n", "name", "order", "stages", "adaptive", "dense", "family", "title");
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *method = kt_method_at(i);
        printf("%-14s  %5d  %6d  %8s  %5d  %-10s  %s\n", method->name, method->order, method->stages,
               kt_method_is_adaptive(method) ? "yes" : "no", kt_method_dense_order(method),
               kt_method_family_name(method), method->title);
    }
    puts("\nsources");
    for (int i = 0; i < kt_method_count(); i++)
        printf("%-14s  %s\n", kt_method_at(i)->name, kt_method_at(i)->source);
    return kt_finish_output(KT_EXIT_DONE);
}
