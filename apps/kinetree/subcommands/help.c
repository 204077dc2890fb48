/* The table of subcommands, and kinetree help, which shows it on a terminal, as man pages or as shell completions. All
 * are generated from the tables of options by which command lines are parsed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/load.h"
#include "text/reference.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

typedef struct kt_help_arguments {
    bool man, types;
    int completion; /* -1: none */
} kt_help_arguments;

#define KT_AT(member) offsetof(kt_help_arguments, member)

static const kt_option options[] = {
    KT_FLAG("man", man, "print a man page"),
    KT_CHOICE("completion", completion, "SHELL", "print a script that completes command lines", KT_SHELLS),
    KT_FLAG("types", types, "print all types of joints, loops, effects, functions and shapes, as Markdown"),
};

const kt_usage kt_usage_help = {
    .command = "help",
    .examples = "  kinetree help run\n"
                "  kinetree help revolute                 formula, keys and an example of the joint and of the loop\n"
                "  kinetree help --man run > kinetree-run.1 && man ./kinetree-run.1\n"
                "  kinetree help --completion bash > kinetree.bash && . ./kinetree.bash\n",
    .operands = "[SUBCOMMAND|TYPE]",
    .about = "Shows the list of subcommands, the help of one subcommand, or a type of scene files.\n"
             "A type belongs to a joint, a loop, an effect, a function of time or a shape.\n"
             "Man pages and completions are installed with the command.\n"
             "The options write both for a command that was built for another machine.\n",
    KT_OPTIONS_OF(options),
};

#define SUBCOMMAND_ROW(name, summary) {#name, kt_command_##name, &kt_usage_##name, summary},
static const kt_subcommand subcommands[] = {KT_SUBCOMMAND_LIST(SUBCOMMAND_ROW)};
#undef SUBCOMMAND_ROW
enum { SUBCOMMAND_COUNT = sizeof subcommands / sizeof subcommands[0] };

static const kt_overview overview = {
    .summary = "simulate mechanisms in minimal coordinates",
    .examples = "  kinetree demo                          list the bundled scenes\n"
                "  kinetree run pendulum.yaml             simulate; records go to pendulum.csv\n"
                "  kinetree run pendulum.yaml --out - --interval 0.1 | head\n"
                "  kinetree accuracy pendulum.yaml        find the cheapest method for an accuracy\n"
                "  kinetree info robot.yaml               draw its tree\n"
                "  kinetree make chain --links 100 | kinetree run - --duration 1\n",
    .exit_status = "  0    done\n"
                   "  1    the command line is wrong\n"
                   "  2    the scene is wrong, or it or another input file cannot be read\n"
                   "  3    the scene could not be assembled, or its constraints contradict each other\n"
                   "  4    the integration failed, or its results could not be written; earlier records are kept\n"
                   "  130  ended by Ctrl-C\n",
    .subcommands = subcommands,
    .count = SUBCOMMAND_COUNT,
};

static void print_command_overview(void) {
    printf("Examples\n%s\nUsage: kinetree SUBCOMMAND ...\n\n", overview.examples);
    for (size_t i = 0; i < SUBCOMMAND_COUNT; i++)
        printf("  %-12s %s\n", subcommands[i].name, subcommands[i].summary);
    printf("\n'kinetree SUBCOMMAND --help' shows examples and options; 'kinetree --version' shows the version.\n"
           "\nExit status\n%s",
           overview.exit_status);
}

/* Returns the subcommand of this name. NULL: there is none, and the nearest name is in *nearest. */
static const kt_subcommand *find_subcommand(const char *name, kt_nearest *nearest) {
    *nearest = kt_nearest_make(name, NULL);
    for (size_t i = 0; i < SUBCOMMAND_COUNT; i++) {
        if (strcmp(name, subcommands[i].name) == 0)
            return &subcommands[i];
        (void)kt_nearest_try(nearest, subcommands[i].name);
    }
    return NULL;
}

const kt_subcommand *kt_subcommand_find(const char *name) {
    kt_nearest nearest;
    const kt_subcommand *found = find_subcommand(name, &nearest);
    if (found == NULL && (kt_is_scene_name(name) || (nearest.best == NULL && access(name, F_OK) == 0)))
        kt_say("there is no subcommand '%s'; 'kinetree run %s' simulates this file, and 'kinetree --help' lists the "
               "subcommands",
               kt_show(name).text, kt_show(name).text);
    else if (found == NULL)
        kt_say("there is no subcommand '%s'%s", name, kt_ask(&nearest, "", "; 'kinetree --help' lists them").text);
    if (found == NULL && kt_is_scene_name(name))
        kt_missing_suggest(name);
    return found;
}

static void say_unknown_topic(const char *name, kt_nearest *nearest) {
    static const char lists[] = "; 'kinetree --help' lists the former, 'kinetree help --types' the latter";
    kt_types_try(nearest);
    kt_say("there is no subcommand and no type '%s'%s", name, kt_ask(nearest, "", lists).text);
}

int kt_command_help(int argc, char **argv) {
    kt_help_arguments arguments = {.completion = -1};
    kt_nearest nearest;
    int operands;
    const int code = kt_arguments_read(&kt_usage_help, argc, argv, &arguments, &operands);
    if (code >= 0)
        return code;
    const kt_subcommand *subcommand = operands > 0 ? find_subcommand(argv[1], &nearest) : NULL;
    if (arguments.completion >= 0 && (arguments.man || operands > 0))
        return kt_misuse("help: --completion covers all subcommands and takes neither --man nor the name of one");
    if (arguments.types && (arguments.man || arguments.completion >= 0 || operands > 0))
        return kt_misuse("help: --types covers all types and takes neither a name nor another option");
    if (operands > 0 && subcommand == NULL) {
        if (!arguments.man && kt_types_print(argv[1]))
            return kt_finish_output(KT_EXIT_DONE);
        say_unknown_topic(argv[1], &nearest);
        return KT_EXIT_USAGE;
    }
    if (arguments.completion >= 0)
        kt_completion_print(&overview, arguments.completion);
    else if (arguments.types)
        kt_types_print_page();
    else if (arguments.man)
        kt_man_print(&overview, subcommand);
    else if (subcommand != NULL)
        kt_usage_print(subcommand->usage);
    else
        print_command_overview();
    return kt_finish_output(KT_EXIT_DONE);
}
