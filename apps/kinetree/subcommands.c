/* The table of subcommands. */
#include "command.h"

#include <string.h>

#define KT_SUBCOMMAND_ROW(name, summary) {#name, kt_command_##name, &kt_usage_##name, summary},
const kt_subcommand kt_subcommands[] = {KT_SUBCOMMAND_LIST(KT_SUBCOMMAND_ROW)};
#undef KT_SUBCOMMAND_ROW

const size_t kt_subcommand_count = sizeof kt_subcommands / sizeof kt_subcommands[0];

const kt_subcommand *kt_subcommand_find(const char *name) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (size_t i = 0; i < kt_subcommand_count; i++) {
        if (strcmp(name, kt_subcommands[i].name) == 0)
            return &kt_subcommands[i];
        (void)kt_nearest_try(&nearest, kt_subcommands[i].name);
    }
    if (nearest.best != NULL)
        kt_say("there is no subcommand '%s'%s", name, kt_ask(&nearest, "").text);
    else
        kt_say("there is no subcommand '%s'; 'kinetree --help' lists them", name);
    return NULL;
}
