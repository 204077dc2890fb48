/* The command line of a subcommand: a table of options, parsed into a plain struct. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_TEXT_ARGUMENTS_H
#define KT_COMMAND_TEXT_ARGUMENTS_H

#include <stdbool.h>
#include <stddef.h>

/* The argument of an option, and the type of the struct member that it fills. */
typedef enum kt_option_type {
    KT_OPTION_FLAG,      /* nothing; bool */
    KT_OPTION_TEXT,      /* any text; const char * */
    KT_OPTION_NAMES,     /* names with commas between, at least one, each once; const char * */
    KT_OPTION_ANY_NAMES, /* names with commas between, each once, or none; const char * */
    KT_OPTION_NUMBER,    /* a finite number; double */
    KT_OPTION_POSITIVE,  /* a number above zero; double */
    KT_OPTION_ANGLE,     /* a finite number, in degrees if followed by "deg"; double, rad */
    KT_OPTION_COUNT,     /* a whole number, zero or more; long */
    KT_OPTION_SEVERAL,   /* a whole number above zero; long */
    KT_OPTION_SETTING,   /* PATH=VALUE, any number of times; kt_setting_list, or kt_settings, which begins with it */
    KT_OPTION_CHOICE,    /* one of the words of `choices`; int, its index among them */
} kt_option_type;

/* Values that replace those of the scene: kt_scene_options. */
enum { KT_SETTINGS_MAX = 1024 };
typedef struct kt_setting_list {
    const char *text[KT_SETTINGS_MAX];
    int count;
} kt_setting_list;

typedef struct kt_settings {
    const char *text[KT_SETTINGS_MAX]; /* as in kt_setting_list */
    int count;
    bool is_quiet;   /* notes about parts that a reader has left out are not printed */
    bool is_verbose; /* all of them are printed */
    bool gives_step; /* an option gives the step: kt_scene_options */
    struct kt_robot_how {
        bool floating, contacts;
        const char *ground, *keyframe, *search, *allow; /* NULL: none */
        int inertia;                                    /* kt_robot_inertia */
        double stops, stop_damping, density;            /* 0: none */
        kt_setting_list masses;                         /* "LINK=MASS" */
    } robot;                                            /* how the file of a robot is read */
} kt_settings;
_Static_assert(offsetof(kt_settings, text) == offsetof(kt_setting_list, text) &&
                   offsetof(kt_settings, count) == offsetof(kt_setting_list, count),
               "settings begin with a list");

typedef struct kt_option {
    const char *name; /* without the dashes */
    kt_option_type type;
    size_t offset;        /* offset of the member in the struct */
    const char *argument; /* name of the argument in the help: "FILE" */
    const char *help;
    const char *choices; /* "qr|partition|svd" */
} kt_option;

/* Rows of a table of options. KT_AT(member) is the offset of a member in the struct of the subcommand, of which
 * `settings` is its kt_settings. */
#define KT_OPTION(type, name, member, argument, help)                                                                  \
    { name, KT_OPTION_##type, KT_AT(member), argument, help, NULL }
#define KT_FLAG(name, member, help)                                                                                    \
    { name, KT_OPTION_FLAG, KT_AT(member), NULL, help, NULL }
#define KT_CHOICE(name, member, argument, help, choices)                                                               \
    { name, KT_OPTION_CHOICE, KT_AT(member), argument, help, choices }

/* Options of a subcommand that reads a scene. */
#define KT_SET_OPTION                                                                                                  \
    KT_OPTION(SETTING, "set", settings, "PATH=VALUE",                                                                  \
              "replace a value of the scene: L=1.5, bodies.arm.mass=2; may be repeated")
#define KT_QUIET_OPTION KT_FLAG("quiet", settings.is_quiet, "print no notes on a robot's file")
#define KT_VERBOSE_OPTION                                                                                              \
    KT_FLAG("verbose", settings.is_verbose, "print all notes on a robot's file, also those on pictures and names")

/* Options of a subcommand that reads a robot's file. */
#define KT_ROBOT_FLAG(name, help) KT_FLAG(#name, settings.robot.name, help)
#define KT_ROBOT_TEXT(name, argument, help) KT_OPTION(TEXT, #name, settings.robot.name, argument, help)
#define KT_ROBOT_OPTIONS                                                                                               \
    KT_ROBOT_FLAG(floating, "let the root of a robot's file move freely; default: it is fixed to the world"),          \
        KT_ROBOT_TEXT(keyframe, "NAME",                                                                                \
                      "start from the positions, velocities and controls of this keyframe of MJCF; default: "          \
                      "reference positions"),                                                                          \
        KT_ROBOT_FLAG(contacts, "let the collisions of a robot's file touch planes; default: they touch nothing"),     \
        KT_ROBOT_TEXT(ground, "HEIGHT", "add a floor at this height, m, to --contacts; default: none"),                \
        KT_OPTION(POSITIVE, "stops", settings.robot.stops, "STIFFNESS",                                                \
                  "make limits of position of a robot's file elastic stops, N m/rad or N/m; default: with --contacts " \
                  "as soft as MuJoCo's, otherwise they do not act"),                                                   \
        KT_OPTION(POSITIVE, "stop-damping", settings.robot.stop_damping, "DAMPING",                                    \
                  "set the damping of --stops, N m s/rad or N s/m; default: 0"),                                       \
        KT_CHOICE("inertia", settings.robot.inertia, "HOW",                                                            \
                  "treat impossible inertias of a robot's file: 'warn' accepts those of rigid parts that are off by "  \
                  "up to 10 %, with a warning; 'strict' accepts none, 'accept' all; default: warn",                    \
                  "warn|strict|accept"),                                                                               \
        KT_OPTION(POSITIVE, "density", settings.robot.density, "DENSITY",                                              \
                  "give links without <inertial>, and geoms of MJCF without mass and density, the mass and inertia "   \
                  "of their shapes, kg/m^3; default: none in URDF, 1000 in MJCF, and in SDF 1 kg and 1 kg m^2"),       \
        KT_OPTION(SETTING, "mass", settings.robot.masses, "LINK=MASS",                                                 \
                  "set the mass of a link of a robot's file, kg; its inertia grows with it, or follows from its "      \
                  "shapes; may be repeated"),                                                                          \
        KT_ROBOT_TEXT(search, "FOLDER:FOLDER",                                                                         \
                      "find meshes of package:// and model://, and models that SDF includes, in these folders first; " \
                      "then in those of KINETREE_SEARCH, ROS_PACKAGE_PATH, GZ_SIM_RESOURCE_PATH and "                  \
                      "GAZEBO_MODEL_PATH, those in which Gazebo keeps models, that of the robot and those around it"), \
        KT_ROBOT_TEXT(allow, "FOLDER:FOLDER",                                                                          \
                      "allow a robot's file to include files of these folders outside of its own")

/* Options of a subcommand that reads scenes and robots. */
#define KT_READER_OPTIONS KT_ROBOT_OPTIONS, KT_QUIET_OPTION, KT_VERBOSE_OPTION

/* A heading of the help, above the option `first`. */
typedef struct kt_option_group {
    const char *title, *first;
} kt_option_group;

/* A rule of options that go together, or exclude each other. */
typedef struct kt_option_rule {
    const char *option; /* if this one is given, */
    bool needs;         /* one of the others must be given, too; else none of them may be */
    const char *others; /* with commas between */
    const char *words;  /* the message; NULL: the usual one. The other option's name follows words that end in "--" */
} kt_option_rule;

typedef struct kt_usage {
    const char *command;  /* "run" */
    const char *examples; /* lines, shown first in the help */
    const char *operands; /* "SCENE": one, "SCENE...": one or more, "[NAME]": one or none, "": none */
    const char *about;    /* shown after the examples: paragraphs that are wrapped, and indented lines that are not */
    const kt_option *options;
    size_t option_count;
    const kt_option_group *groups; /* NULL, or headings in the order of the options; the last one has no title */
    const kt_option_rule *rules;   /* are checked in this order, after all else */
    size_t rule_count;
    const struct kt_usage *also; /* NULL, or a subcommand whose options are all accepted, too; its help shows them */
} kt_usage;

/* The options of a kt_usage: those of a table. */
#define KT_OPTIONS_OF(table) .options = table, .option_count = sizeof table / sizeof table[0]

#define KT_RULES_OF(table) .rules = table, .rule_count = sizeof table / sizeof table[0]

/* Parses argv[1] onwards into the struct `members`. Members whose options are not given keep their values. The operands
 * are moved to argv[1] onwards and counted, unless operand_count is NULL. Both "--name value" and "--name=value" are
 * accepted, and "--" ends the options. An option of the subcommand is no value of the option before it, unless "="
 * precedes it. Returns -1 if the command can continue, otherwise an exit code: help was requested and printed, or an
 * error was found and printed. */
int kt_arguments_read(const kt_usage *usage, int argc, char **argv, void *members, int *operand_count);

/* Prints the text of --help on standard output. */
void kt_usage_print(const kt_usage *usage);

/* Returns the title of the group that begins with this option; NULL: none does. */
const char *kt_group_title(const kt_usage *usage, const kt_option *option);

#endif
