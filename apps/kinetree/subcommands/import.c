/* kinetree import: reads a robot in URDF, MJCF or SDF and writes it as a scene. */
#include "command.h"
#include "records/output.h"
#include "text/arguments.h"

#include <stdio.h>
#include <string.h>

typedef struct kt_import_arguments {
    const char *out, *inertia, *keyframe, *search, *allow;
    bool floating;
    double stops, stop_damping, density;
    kt_settings masses;
} kt_import_arguments;

#define AT(member) offsetof(kt_import_arguments, member)
static const kt_option options[] = {
    {"out", KT_OPTION_TEXT, AT(out), "FILE.yaml", "where to (standard output)", NULL},
    {"floating", KT_OPTION_FLAG, AT(floating), NULL, "the root moves freely (it is fixed to the world)", NULL},
    {"stops", KT_OPTION_POSITIVE, AT(stops), "STIFFNESS",
     "limits of position become elastic stops, N m/rad or N/m (they are left out)", NULL},
    {"inertia", KT_OPTION_TEXT, AT(inertia), "HOW",
     "inertias that no body has: 'warn' takes those of rigid parts that are off by up to 10 %, and tells them; "
     "'strict' "
     "none; 'accept' all (warn)",
     NULL},
    {"density", KT_OPTION_POSITIVE, AT(density), "DENSITY",
     "links without <inertial>, in MJCF geoms without mass and density, have mass and inertia of their shapes, kg/m^3 "
     "(URDF: none; MJCF: 1000; SDF: 1 kg, 1 kg m^2)",
     NULL},
    {"mass", KT_OPTION_SETTING, AT(masses), "LINK=MASS",
     "mass of a link, kg; its inertia grows with it, or is that of its shapes. Any number of times", NULL},
    {"search", KT_OPTION_TEXT, AT(search), "FOLDER:FOLDER",
     "where meshes of package:// and model:// are, before the folders of KINETREE_SEARCH, ROS_PACKAGE_PATH, "
     "GZ_SIM_RESOURCE_PATH and GAZEBO_MODEL_PATH, that of the robot and those around it; and models that SDF includes",
     NULL},
    {"allow", KT_OPTION_TEXT, AT(allow), "FOLDER:FOLDER",
     "folders outside of the robot's own from which it may include files", NULL},
    {"keyframe", KT_OPTION_TEXT, AT(keyframe), "NAME",
     "MJCF: positions, velocities and controls at the start are those of this keyframe (reference positions)", NULL},
    {"stop-damping", KT_OPTION_POSITIVE, AT(stop_damping), "DAMPING", "of these stops, N m s/rad or N s/m (0)", NULL},
};

const kt_usage kt_usage_import = {
    .command = "import",
    .examples = "  kinetree import arm.urdf --out arm.yaml\n"
                "  kinetree import quadruped.urdf --floating --stops 1e4 --out quadruped.yaml\n"
                "  kinetree import humanoid.xml --keyframe squat --out humanoid.yaml\n"
                "  kinetree import rover.sdf --out rover.yaml\n"
                "  kinetree run arm.urdf --duration 2 --view\n",
    .operands = "ROBOT.urdf",
    .least = 1,
    .most = 1,
    .about =
        "Reads a robot in URDF, MJCF (the XML of MuJoCo) or SDF (that of Gazebo), and writes it as a scene, to which\n"
        "loops, effects and settings are then added. Every subcommand that reads a SCENE takes such a file itself, "
        "too, as without "
        "options\n"
        "here. A body has the name of its link, and a joint keeps its own. What a scene does not have is left out, and "
        "said\n"
        "on standard error, each kind once, with the number and the first place: contacts, transmissions\n"
        "without a rotor, actuators with a state of their own. Meshes are for pictures (draw, view).\n",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
};

/* Returns the choice of a word; -1 after printing what is wrong. */
static int choose_inertia(const char *word) {
    static const char *const words[] = {"warn", "strict", "accept"}; /* as kt_robot_inertia */
    for (int i = 0; i < 3; i++)
        if (word == NULL || strcmp(word, words[i]) == 0)
            return i;
    kt_say("import: --inertia is warn, strict or accept, not '%s'", word);
    return -1;
}

int kt_command_import(int argc, char **argv) {
    kt_import_arguments a = {.out = "-"};
    int operands;
    int code = kt_arguments_read(&kt_usage_import, argc, argv, &a, &operands);
    if (code >= 0)
        return code;
    if (a.stop_damping > 0.0 && !(a.stops > 0.0)) {
        kt_say("import: --stop-damping is that of --stops; give a stiffness, too");
        return KT_EXIT_USAGE;
    }
    const int inertia = choose_inertia(a.inertia);
    if (inertia < 0)
        return KT_EXIT_USAGE;
    const kt_file_use uses[] = {{"the robot", argv[1], false}, {"--out", a.out, true}};
    code = kt_check_files("import", uses, 2);
    if (code >= 0)
        return code;
    const kt_robot_options how = {.floating = a.floating,
                                  .stop_stiffness = a.stops,
                                  .stop_damping = a.stop_damping,
                                  .inertia = (kt_robot_inertia)inertia,
                                  .density = a.density,
                                  .masses = a.masses.text,
                                  .mass_count = a.masses.count,
                                  .keyframe = a.keyframe,
                                  .search = a.search,
                                  .allow = a.allow};
    kt_scene scene;
    kt_error error = {0};
    code = kt_read_robot(argv[1], &how, &scene);
    if (code != KT_EXIT_DONE)
        return code;
    if (kt_write_scene(&scene, a.out, &error) != KT_OK) {
        kt_say("%s cannot be written: %s", a.out, error.message);
        code = KT_EXIT_INTEGRATION;
    }
    kt_scene_free(&scene);
    return code;
}
