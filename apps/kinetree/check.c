/* kinetree check: every fault of scene files. */
#include "arguments.h"
#include "command.h"

#include <stdio.h>

static const kt_usage usage = {
    .command = "check",
    .examples = "  kinetree check pendulum.yaml\n"
                "  kinetree check scenes/*.yaml\n"
                "  kinetree make tree --links 50 | kinetree check -\n",
    .operands = "SCENE...",
    .least = 1,
    .most = -1,
    .about =
        "Reads and compiles each scene. Prints 'FILE: ok' for each that is right, and every fault of the others on\n"
        "standard error as FILE:LINE:COLUMN: message. Exit status 2 where any is wrong.\n",
};

int kt_command_check(int argc, char **argv) {
    int operands, code = kt_arguments_read(&usage, argc, argv, NULL, &operands);
    if (code >= 0)
        return code;
    code = KT_EXIT_DONE;
    for (int i = 1; i <= operands; i++) {
        kt_scene scene;
        kt_model *model = NULL;
        int one = kt_load_model(argv[i], &scene, &model);
        if (one != KT_EXIT_DONE) {
            code = code == KT_EXIT_DONE ? one : code;
            continue;
        }
        printf("%s: ok\n", argv[i]);
        kt_model_free(model);
        kt_scene_free(&scene);
    }
    return kt_finish_output(code);
}
