/* The files of `kinetree run`: checks of their names before the run. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "plot/run.h"
#include "records/checkpoint.h"
#include "subcommands/run.h"

#include <string.h>
#include <sys/stat.h>

int kt_run_check_files(const kt_run_arguments *arguments, const char *path, const kt_result_names *names) {
    const kt_file_use states[] = {{"the checkpoint", arguments->resume, false},
                                  {"--checkpoint", arguments->checkpoint, true}};
    int code = arguments->resume != NULL ? kt_checkpoint_check(arguments->resume) : -1;
    for (size_t i = 0; i < sizeof states / sizeof states[0] && code < 0; i++) {
        const kt_file_use uses[] = {{"the scene", path, false},    states[i],
                                    {"--out", names->out, true},   {"--summary", names->summary, true},
                                    {"--plot", names->plot, true}, {"--view", names->view, true},
                                    {"--glb", names->glb, true},   {"--scene", arguments->scene, true}};
        code = kt_check_files(arguments->command, uses, sizeof uses / sizeof uses[0]);
    }
    code = code < 0 ? kt_check_records(names->out) : code;
    code = code < 0 ? kt_check_summary(names->summary) : code;
    if (code < 0 && kt_keep_is_meant(names->out) && (arguments->checkpoint != NULL || arguments->resume != NULL))
        code = kt_misuse(
            "--checkpoint and --resume go with records as CSV: HDF5 is made at the end of a run; take --out FILE.csv");
    code = code < 0 && kt_keep_is_meant(names->out) ? kt_keep_check(names->out) : code;
    code = code < 0 ? kt_check_ending("--view", names->view, ".html") : code;
    code = code < 0 ? kt_check_ending("--glb", names->glb, ".glb") : code;
    kt_plot_size size;
    code = code < 0 ? kt_plot_size_read(arguments->command, arguments->size, &size) : code;
    return code < 0 && names->plot != NULL ? kt_plot_check(names->plot) : code;
}

int kt_run_spare_results(const kt_result_names *names) {
    for (int i = 0; i < KT_RESULTS; i++) {
        struct stat status;
        const char *name = names->all[i];
        if (name != NULL && strcmp(name, "-") != 0 && stat(name, &status) == 0 && S_ISREG(status.st_mode))
            return kt_misuse("demo: %s exists already; --force replaces it%s", name,
                             i == KT_RESULT_OUT ? ", --out FILE writes elsewhere" : "");
    }
    return -1;
}
