/* kinetree integrators: the table of methods. */
#include "arguments.h"
#include "command.h"

#include <stdio.h>
#include <string.h>

static const kt_usage usage = {
    .command = "integrators",
    .examples = "  kinetree integrators\n"
                "  kinetree run pendulum.yaml --integrator tsit5 --tolerance 1e-10\n"
                "  kinetree run pendulum.yaml --integrator rk4 --step 1e-3\n",
    .operands = "",
    .about = "Lists the explicit Runge-Kutta methods. Adaptive ones choose their steps by a tolerance and can also be\n"
             "given a fixed step; the others need one. Dense is the order of the records between steps.\n",
};

int kt_command_integrators(int argc, char **argv) {
    int operands;
    int code = kt_arguments_read(&usage, argc, argv, NULL, &operands);
    if (code >= 0)
        return code;
    int name_width = 4, title_width = 5;
    for (int i = 0; i < kt_method_count(); i++) {
        int name = (int)strlen(kt_method_at(i)->name), title = (int)strlen(kt_method_at(i)->title);
        name_width = name > name_width ? name : name_width;
        title_width = title > title_width ? title : title_width;
    }
    printf("%-*s  order  stages  adaptive  dense  %-*s  source\n", name_width, "name", title_width, "title");
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *method = kt_method_at(i);
        printf("%-*s  %5d  %6d  %8s  %5d  %-*s  %s\n", name_width, method->name, method->order, method->stages,
               method->embedded_order > 0 ? "yes" : "no", kt_method_dense_order(method), title_width, method->title,
               method->source);
    }
    return kt_finish_output(KT_EXIT_DONE);
}
