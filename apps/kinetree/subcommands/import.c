/* kinetree import: reads a robot in URDF, MJCF or SDF and writes it as a scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/output.h"
#include "text/arguments.h"

#include <string.h>

typedef struct kt_import_arguments {
    const char *out;
    kt_settings settings; /* only how robots are read, and how notes are printed */
} kt_import_arguments;

#define KT_AT(member) offsetof(kt_import_arguments, member)
static const kt_option options[] = {
    KT_OPTION(TEXT, "out", out, "FILE.yaml", "write to this file; default: standard output"),
    KT_ROBOT_OPTIONS,
    KT_QUIET_OPTION,
    KT_VERBOSE_OPTION,
};

const kt_usage kt_usage_import = {
    .command = "import",
    .examples = "  kinetree import arm.urdf --out arm.yaml\n"
                "  kinetree import quadruped.urdf --floating --stops 1e4 --out quadruped.yaml\n"
                "  kinetree import humanoid.xml --keyframe squat --out humanoid.yaml\n"
                "  kinetree import dog.xml --contacts --ground 0 --keyframe home --out dog.yaml\n"
                "  kinetree import rover.sdf --out rover.yaml\n"
                "  kinetree view arm.urdf --duration 2\n",
    .operands = "ROBOT.urdf",
    .about = "Reads a robot in URDF, MJCF (the XML of MuJoCo) or SDF (that of Gazebo), and writes it as a scene.\n"
             "Loops, effects and settings can be added to this scene.\n"
             "Every subcommand that reads a SCENE also takes such a file itself, except sweep and export --fmu.\n"
             "The subcommands that take it have all options of import except --out.\n"
             "A body has the name of its link, and a joint keeps its name.\n"
             "Omissions are reported on standard error, each kind once, with the number and the first place.\n"
             "Omissions that change the motion are warnings.\n"
             "Such omissions are contacts (without --contacts), transmissions without a rotor, and plugins.\n"
             "Meshes are for pictures (draw, view).\n",
    KT_OPTIONS_OF(options),
};

int kt_command_import(int argc, char **argv) {
    kt_import_arguments a = {.out = "-"};
    int code = kt_arguments_read(&kt_usage_import, argc, argv, &a, NULL);
    if (code >= 0)
        return code;
    kt_robot_options how = {0};
    if (!kt_robot_how_apply(&a.settings.robot, &how))
        return KT_EXIT_USAGE;
    code = kt_check_result("import", "the robot", argv[1], "--out", a.out);
    if (code >= 0)
        return code;
    const char *ending = strrchr(argv[1], '.');
    if (ending != NULL && strcmp(ending, ".yaml") == 0)
        return kt_misuse("import: %s is a scene, not a robot: 'kinetree run %s' runs it as it is", argv[1], argv[1]);
    kt_scene scene;
    kt_error error = {0};
    code = kt_read_robot(argv[1], &how, &a.settings, &scene);
    if (code != KT_EXIT_DONE)
        return code;
    code = kt_write_scene(&scene, a.out, KT_OK, &error);
    kt_scene_free(&scene);
    return code;
}
