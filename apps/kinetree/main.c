/* kinetree: runs scenes and looks at them. A subcommand is a file and a line in this table. */
#include "command.h"
#include "json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_subcommand {
    const char *name;
    kt_command_main *run;
    const char *summary;
} kt_subcommand;

static const kt_subcommand subcommands[] = {
    {"run", kt_command_run, "run a scene; records as CSV, a summary as JSON, a picture"},
    {"accuracy", kt_command_accuracy, "what accuracy costs: error against CPU time, for every method"},
    {"plot", kt_command_plot, "draw the columns of a result: positions, energies, a phase plane"},
    {"evaluate", kt_command_evaluate, "mass matrix, bias, acceleration, poses of the initial state, as JSON"},
    {"modes", kt_command_modes, "frequencies, damping and shapes of small motions; state matrices as JSON"},
    {"equilibrium", kt_command_equilibrium, "where a scene comes to rest, and whether it stays there"},
    {"info", kt_command_info, "what a scene consists of: the tree, its freedoms and masses"},
    {"check", kt_command_check, "find every fault of scene files"},
    {"demo", kt_command_demo, "run one of the bundled scenes, or list them"},
    {"make", kt_command_make, "write chains, pendulums and trees of any size as scenes"},
    {"stability", kt_command_stability, "the fastest modes, and the largest stable step of each method"},
    {"integrators", kt_command_integrators, "the integration methods and where they are published"},
};
static const size_t subcommand_count = sizeof subcommands / sizeof subcommands[0];

static int show_help(void) {
    fputs("Examples\n"
          "  kinetree demo                          list the bundled scenes\n"
          "  kinetree run pendulum.yaml             simulate; records go to pendulum.csv\n"
          "  kinetree run pendulum.yaml --out - --interval 0.1 | head\n"
          "  kinetree accuracy pendulum.yaml        which method and setting is the cheapest for an accuracy\n"
          "  kinetree info robot.yaml               draw its tree\n"
          "  kinetree make chain --links 100 | kinetree run - --duration 1\n"
          "\n"
          "Usage: kinetree SUBCOMMAND ...\n"
          "\n",
          stdout);
    for (size_t i = 0; i < subcommand_count; i++)
        printf("  %-12s %s\n", subcommands[i].name, subcommands[i].summary);
    fputs("\n"
          "'kinetree SUBCOMMAND --help' shows examples and options; 'kinetree --version' the version.\n"
          "\n"
          "Exit status: 0 done; 1 usage; 2 the scene is wrong; 3 it could not be assembled or its constraints\n"
          "contradict; 4 the integration failed or its results could not be written: records up to then are kept,\n"
          "in NAME.partial.\n",
          stdout);
    return kt_finish_output(KT_EXIT_DONE);
}

static int say_unknown(const char *name) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (size_t i = 0; i < subcommand_count; i++)
        (void)kt_nearest_try(&nearest, subcommands[i].name);
    if (nearest.best != NULL)
        kt_say("there is no subcommand '%s'%s", name, kt_ask(&nearest, "").text);
    else
        kt_say("there is no subcommand '%s'; 'kinetree --help' lists them", name);
    return KT_EXIT_USAGE;
}

/* OpenBLAS starts its threads when it is loaded, which the library does where it first needs it. The library leaves
 * their number alone; here, one is fastest for the sizes that linkages have, results do not depend on the machine, and
 * under `ulimit -v`, where threads cannot be started, OpenBLAS would wait for them for ever at the end. */
static void ask_for_one_thread(void) {
    (void)setenv("OPENBLAS_NUM_THREADS", "1", 1);
    (void)setenv("OMP_NUM_THREADS", "1", 1);
}

int main(int argc, char **argv) {
    static char help[] = "--help";
    ask_for_one_thread();
    kt_json_watch_memory();
    if (argc < 2) {
        kt_say("a subcommand is missing; 'kinetree --help' lists them, 'kinetree demo' shows what there is to run");
        return KT_EXIT_USAGE;
    }
    if (strcmp(argv[1], "help") == 0 && argc > 2) { /* 'help run' is 'run --help' */
        argv[1] = argv[2];
        argv[2] = help;
        argc = 3;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || strcmp(argv[1], "help") == 0)
        return show_help();
    if (strcmp(argv[1], "--version") == 0) {
        printf("kinetree %s\n", kt_version());
        return kt_finish_output(KT_EXIT_DONE);
    }
    for (size_t i = 0; i < subcommand_count; i++)
        if (strcmp(argv[1], subcommands[i].name) == 0)
            return subcommands[i].run(argc - 1, argv + 1);
    return say_unknown(argv[1]);
}
