/* kinetree: runs and analyses scenes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "text/json.h"

#include "kinetree/batch.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Restricts OpenBLAS to one thread. OpenBLAS starts its threads when it is loaded, which the library does at the first
 * use. The library does not set their number. One thread is fastest for the matrix sizes of linkages and makes results
 * independent of the machine. Moreover, under `ulimit -v` threads cannot be started, and OpenBLAS would otherwise wait
 * for them forever at exit. */
static void ask_for_one_thread(void) {
    (void)setenv("OPENBLAS_NUM_THREADS", "1", 1);
    (void)setenv("OMP_NUM_THREADS", "1", 1);
}

int main(int argc, char **argv) {
    static char help[] = "help";
    ask_for_one_thread();
    kt_json_watch_memory();
    if (argc < 2)
        return kt_misuse("a subcommand is missing; 'kinetree --help' lists them, 'kinetree demo' lists scenes to run");
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)
        return kt_command_help(1, (char *[]){help, NULL});
    if (strcmp(argv[1], "--version") == 0) {
        kt_print_version();
        return kt_finish_output(KT_EXIT_DONE);
    }
    const kt_subcommand *subcommand = kt_subcommand_find(argv[1]);
    return subcommand != NULL ? subcommand->run(argc - 1, argv + 1) : KT_EXIT_USAGE;
}
