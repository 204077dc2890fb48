/* kinetree export: writes the mechanism of a scene as a robot in URDF or MJCF, its equations as C, or an FMU. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/output.h"
#include "subcommands/export_fmu.h"
#include "text/arguments.h"

#include "kinetree/export.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_export_arguments {
    const char *out, *functions, *inputs;
    bool urdf, mjcf, c, fmu, constant, sources;
    int version;
    kt_settings settings;
} kt_export_arguments;

#define KT_AT(member) offsetof(kt_export_arguments, member)
static const kt_option options[] = {
    KT_FLAG("urdf", urdf, "write URDF, the format of ROS"),
    KT_FLAG("mjcf", mjcf, "write MJCF, the format of MuJoCo"),
    KT_FLAG("c", c, "write C: FILE.c and FILE.h, without any library"),
    KT_FLAG("fmu", fmu, "write an FMU, for other simulation tools"),
    KT_CHOICE("fmi", version, "VERSION", "set the version of the standard of an FMU; default: 3", "2|3"),
    KT_OPTION(ANY_NAMES, "input", inputs, "LIST", "take joint forces and functions of time as inputs of an FMU"),
    KT_FLAG("sources", sources, "add the source of the binary to an FMU"),
    KT_OPTION(NAMES, "functions", functions, "LIST", "write these functions of C; default: forward,inverse,bias,mass"),
    KT_FLAG("fold", constant, "write all numbers of C as constants"),
    KT_OPTION(TEXT, "out", out, "FILE", "write to this file; default: standard output"),
    KT_SET_OPTION,
    KT_READER_OPTIONS,
};

static const kt_option_rule rules[] = {
    {"fold", true, "c", "--fold is an option of --c"},
    {"functions", true, "c", "--functions is an option of --c"},
    {"input", true, "fmu", "--input is an option of --fmu"},
    {"sources", true, "fmu", "--sources is an option of --fmu"},
    {"fmi", true, "fmu", "--fmi is an option of --fmu"},
};

const kt_usage kt_usage_export = {
    .command = "export",
    .examples = "  kinetree export --urdf arm.yaml --out arm.urdf\n"
                "  kinetree export --mjcf four-bar.yaml --set L=1.5 --out four-bar.xml\n"
                "  kinetree export --c arm.yaml --functions forward,mass --out arm.c\n"
                "  kinetree export --fmu arm.yaml --input shoulder,elbow --out arm.fmu\n",
    .operands = "SCENE",
    .about = "Writes the mechanism of a scene as a robot in URDF or MJCF, its equations as C, or all of it as an FMU.\n"
             "Both robot formats have bodies, joints, masses, shapes, meshes, dampers, friction, limits and couplings "
             "of two joints.\n"
             "MJCF also has gravity, markers, springs in joints, motors, servos and couplings of several joints.\n"
             "Tendons of MJCF represent springs and dampers between two ends or along paths.\n"
             "MJCF has spherical, revolute and weld loops and the assembled start, too.\n"
             "Omissions and changes are reported on standard error, each kind once, with its number.\n"
             "A file that is read back has the mass matrix of the scene, except for rounding.\n"
             "\n"
             "C has trees and most types of loops. Its files need no library and allocate nothing.\n"
             "Zeros, axes and rotations are folded; other numbers stay parameters, unless --fold is given.\n"
             "The functions are forward, inverse, bias, mass, effects, states, acceleration, energy, markers,\n"
             "jacobians, inverse_derivatives, forward_derivatives, effect_derivatives, heun, rk4, semi_implicit,\n"
             "heun_derivatives, rk4_derivatives, semi_implicit_derivatives; with loops also loops and project.\n"
             "The functions effects, acceleration and steps have the forces of effects. The others leave them out.\n"
             "\n"
             "An FMU of FMI 3.0 or 2.0 is for model exchange and co-simulation in other tools, on systems like this "
             "one.\n"
             "Its outputs are the records of the scene. Parameters of the scene are parameters of the FMU.\n"
             "--input takes joints, and functions of time of effects and loops: hold, hold.target.\n"
             "With --sources gcc and clang compile its binary for other systems.\n"
             "For scenes with hard contacts, the FMU has only co-simulation. A scene that needs other files is "
             "rejected.\n",
    KT_OPTIONS_OF(options),
    KT_RULES_OF(rules),
};

/* Notes on what a format lacks. The first one has the name of the scene, unless notes of the reader precede it. */
typedef struct losses {
    const char *path;
    bool is_quiet, is_named;
} losses;

static void say_lost_by_format(void *user, const char *what, int count) {
    losses *l = user;
    if (l->is_quiet)
        return;
    kt_print("%s%snote: left out or changed: %s (%d)\n", l->is_named ? "  " : l->path, l->is_named ? "" : ": ", what,
             count);
    l->is_named = true;
}

static losses begin_losses(const char *path, const kt_scene *scene, const kt_settings *settings) {
    losses l = {path, settings->is_quiet, false};
    for (int i = 0; i < scene->note_count; i++)
        l.is_named = l.is_named || settings->is_verbose || scene->notes[i].rank != KT_NOTE_RANK_DETAIL;
    return l;
}

/* A robot that is written. */
typedef struct robot {
    const kt_scene *scene;
    kt_robot_format format;
    const char *out;
    losses *lost;
} robot;

static kt_status write_robot(FILE *file, const void *what, kt_error *error) {
    const robot *r = what;
    char *folder = strcmp(r->out, "-") != 0 ? kt_folder_of(r->out) : NULL;
    const kt_status status =
        kt_robot_write_scene(r->scene, r->format, folder, file, say_lost_by_format, r->lost, error);
    free(folder);
    return status;
}

int kt_command_export(int argc, char **argv) {
    kt_export_arguments a = {.out = "-", .version = -1};
    int code = kt_arguments_read(&kt_usage_export, argc, argv, &a, NULL);
    if (code >= 0)
        return code;
    if (a.urdf + a.mjcf + a.c + a.fmu != 1)
        return kt_misuse("export: give --urdf, --mjcf, --c or --fmu%s",
                         a.urdf || a.mjcf || a.c || a.fmu ? ", one of them" : "");
    const kt_export_c c = {argv[1], a.functions, a.out, &a.settings, a.constant};
    const int version = a.version < 0 ? KT_FMU_THIRD : a.version;
    const kt_export_fmu fmu = {argv[1], a.inputs, a.out, &a.settings, version, a.sources};
    code = a.c ? kt_export_c_check(&c) : a.fmu ? kt_export_fmu_check(&fmu) : -1;
    code = code < 0 ? kt_check_result("export", "the scene", argv[1], "--out", a.out) : code;
    if (code >= 0)
        return code;
    if (a.c || a.fmu)
        return a.c ? kt_export_c_write(&c) : kt_export_fmu_write(&fmu);
    kt_scene scene;
    kt_error error = {0};
    code = kt_read_scene(argv[1], &a.settings, &scene);
    if (code != KT_EXIT_DONE)
        return code;
    losses lost = begin_losses(argv[1], &scene, &a.settings);
    const robot written = {&scene, a.urdf ? KT_ROBOT_URDF : KT_ROBOT_MJCF, a.out, &lost};
    const kt_status status = kt_output_fill(a.out, write_robot, &written, &error);
    code = status == KT_OK ? KT_EXIT_DONE : status == KT_ERROR_MODEL ? KT_EXIT_SCENE : KT_EXIT_INTEGRATION;
    if (status != KT_OK)
        kt_say("%s cannot be exported: %s", argv[1], kt_words_of(&error).text);
    kt_scene_free(&scene);
    return code;
}
