/* Declarations shared by the files of the command: subcommands, exit codes, messages to the user. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_H
#define KT_COMMAND_H

#include "base/memory.h"
#include "base/names.h"
#include "kinetree/formulation.h"
#include "kinetree/import.h"
#include "kinetree/study.h"
#include "text/arguments.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

/* Exit codes. */
enum {
    KT_EXIT_DONE = 0,
    KT_EXIT_USAGE = 1,       /* the command line is wrong */
    KT_EXIT_SCENE = 2,       /* the scene, or another file to be read, is wrong or cannot be read */
    KT_EXIT_ASSEMBLY = 3,    /* the assembly failed, or constraints contradict each other */
    KT_EXIT_INTEGRATION = 4, /* the integration failed, or its results could not be written */
};

/* Main function of a subcommand; argv[0] is its name. Returns an exit code. */
typedef int kt_command_main(int argc, char **argv);

/* The subcommands and one line about each, in the order of the help. A subcommand is a line here and a file that
 * defines kt_command_NAME and kt_usage_NAME; help, man pages and completions are generated from these. The table is in
 * help.c, the only file that refers to all of them. */
#define KT_SUBCOMMAND_LIST(X)                                                                                          \
    X(run, "run a scene; write records as CSV, a summary as JSON, a picture")                                          \
    X(view, "make a page that shows the motion of a scene, in one file for any browser")                               \
    X(sweep, "run a scene many times with other values: grids, samples, tables")                                       \
    X(accuracy, "compare methods: error against CPU time")                                                             \
    X(draw, "draw the mechanism: its start, poses of a run, paths of markers")                                         \
    X(plot, "draw the columns of a result: positions, energies, a phase plane")                                        \
    X(evaluate, "compute mass matrix, bias, acceleration and poses of the initial state, as JSON")                     \
    X(modes, "compute frequencies, damping and shapes of small motions; state matrices")                               \
    X(response, "compute the frequency response to a force in a joint; Bode diagrams")                                 \
    X(equilibrium, "find the position in which a scene comes to rest, and its stability")                              \
    X(info, "show the tree of a scene, its degrees of freedom and masses")                                             \
    X(check, "find every fault of scene files")                                                                        \
    X(demo, "run one of the bundled scenes, or list them")                                                             \
    X(import, "read a robot in URDF, MJCF or SDF and write it as a scene")                                             \
    X(export, "write a scene as URDF or MJCF, its equations as C, or an FMU")                                          \
    X(make, "write chains, pendulums and trees of any size as scenes")                                                 \
    X(stability, "find the fastest modes, and the largest stable step of each method")                                 \
    X(integrators, "list the integration methods and their publications")                                              \
    X(help, "show this help or that of a subcommand; write man pages and completions")

#define KT_SUBCOMMAND_DECLARE(name, summary)                                                                           \
    kt_command_main kt_command_##name;                                                                                 \
    extern const kt_usage kt_usage_##name;
KT_SUBCOMMAND_LIST(KT_SUBCOMMAND_DECLARE)
#undef KT_SUBCOMMAND_DECLARE

typedef struct kt_subcommand {
    const char *name;
    kt_command_main *run;
    const kt_usage *usage;
    const char *summary;
} kt_subcommand;

/* Returns the subcommand of this name; NULL, after printing an error with the nearest name, if there is none. */
const kt_subcommand *kt_subcommand_find(const char *name);

/* Prints the version, the compiler, the instruction set, the libraries and the system, for a report of a fault. */
void kt_print_version(void);

/* Prints a part of a message on standard error: a line of several, or what follows. All messages escape the characters
 * that a terminal would obey. Newlines at both ends of the format are kept, and others are escaped. */
void kt_print(const char *format, ...) KT_PRINTF(1, 2);
void kt_print_all(const char *format, va_list arguments) KT_PRINTF(1, 0);

/* Prints "kinetree: ..." and a newline on standard error. Characters that a terminal would obey are escaped. */
void kt_say(const char *format, ...) KT_PRINTF(1, 2);
/* Does the same, and returns the exit code: `code`, or KT_EXIT_USAGE for a wrong command line. */
int kt_reject(int code, const char *format, ...) KT_PRINTF(2, 3);
#define kt_misuse(...) kt_reject(KT_EXIT_USAGE, __VA_ARGS__)
/* The words of an error: "WHERE: MESSAGE", or the message alone. */
typedef struct kt_error_words {
    char text[KT_WHERE_SIZE + KT_MESSAGE_SIZE + 8];
} kt_error_words;
kt_error_words kt_words_of(const kt_error *error);
/* Prints them in the same form. */
void kt_say_error(const kt_error *error);
/* Does the same, with the position in the file if the scene has it (kt_scene_locate). */
void kt_say_located(const kt_scene *scene, kt_error *error);

/* Prints the error unless the status is KT_OK. Returns the exit code of the status. */
int kt_say_status(kt_status status, const kt_error *error);

/* Prints that there is not enough memory, with the name of the result that is not made unless that is NULL. Returns the
 * exit status. */
int kt_say_no_memory(const char *what);

/* A name for display: characters that a terminal would obey are escaped (base/escape.h), and a long name is
 * truncated. */
typedef struct kt_shown {
    char text[256];
} kt_shown;

kt_shown kt_show(const char *name);

/* The name of a result in messages: that of the file, or "standard output" for "-". */
kt_shown kt_show_result(const char *path);

/* Returns the exit code for a status, and its name in lines of sweeps and in HDF5. */
int kt_exit_code(kt_status status);
const char *kt_exit_name(int code);

/* The text "; did you mean 'NAME'?" with `before` in front of the name; `otherwise` if no name is near enough. */
typedef struct kt_question {
    char text[96];
} kt_question;

kt_question kt_ask(const kt_nearest *nearest, const char *before, const char *otherwise);

/* Flushes standard output; the last call of a subcommand that prints. Returns code, or KT_EXIT_INTEGRATION after
 * printing an error if the output could not be written. */
int kt_finish_output(int code);

/* Returns whether box-drawing characters may be used on this file descriptor: a terminal, in a UTF-8 locale. */
bool kt_speaks_utf8(int descriptor);

/* ---- reading a scene --------------------------------------------------------------------------------------------- */

/* Reads a scene and prints every error in it. path: "-" for standard input; settings: NULL for none. If it returns
 * KT_EXIT_DONE, the caller releases *scene with kt_scene_free. Otherwise it returns another exit code. */
int kt_read_scene(const char *path, const kt_settings *settings, kt_scene *scene);

/* Does the same, and lets the scene start from the result `from` (kt_start_from). If `from` is NULL, the scene's key
 * `initial.from` names the result, if it exists. */
int kt_read_scene_from(const char *path, const kt_settings *settings, const char *from, kt_scene *scene);

/* Reads a robot in URDF, MJCF or SDF with options. kt_read_scene reads robots, too, with the default options: files
 * named *.urdf, *.mjcf, *.sdf, *.world or *.xml, and those that begin with '<'. Both print notes on the elements that
 * the scene has left out, according to `settings`. */
int kt_read_robot(const char *path, const kt_robot_options *options, const kt_settings *settings, kt_scene *scene);

/* Sets the options of a robot that all subcommands have. Returns false after printing the error. */
bool kt_robot_how_apply(const struct kt_robot_how *how, kt_robot_options *options);

/* Writes a scene to a file, whole or not at all, or to standard output ("-"). status: of the changes to the scene, with
 * the error. Returns KT_EXIT_DONE, or an exit code after printing the error. */
int kt_write_scene(const kt_scene *scene, const char *path, kt_status status, kt_error *error);

/* Returns the name of the method of a scene's run, for reports: that of time stepping over contacts, or of
 * kt_run_method for the integrated model, which may use *storage. */
const char *kt_scene_method_name(const kt_scene *scene, const kt_model *model, kt_method *storage);

/* Reports a name that is no method, and suggests one. where: the subcommand, and its option. Returns KT_EXIT_USAGE. */
int kt_reject_method(const char *where, const char *name);

/* The options of a scene's `simulate` section for its compilation, and as a variant of an accuracy study. */
kt_model_options kt_compile_options(const kt_scene *scene);
kt_variant kt_own_variant(const kt_scene *scene);

/* Returns the initial state as given in the scene, q followed by v. The caller frees it. NULL: not enough memory. */
double *kt_given_state(const kt_model *model);

/* Compiles a scene with these options, and prints the errors. */
int kt_compile_scene(const kt_scene *scene, kt_model **model);

/* Compiles the absolute formulation of the scene's model, if the scene selects it, and prints the errors; otherwise
 * *absolute is NULL. */
int kt_compile_absolute(const kt_scene *scene, const kt_model *model, kt_absolute **absolute);

/* The name of the scene, or another one if it has none. */
const char *kt_title_of(const kt_model *model, const char *base);

/* The model that is integrated: that of the absolute formulation if it exists. */
const kt_model *kt_integrated_model(const kt_model *model, const kt_absolute *absolute);

/* Reads and compiles a scene; the caller releases both. If the exit code is not KT_EXIT_DONE, neither exists. */
int kt_load_model(const char *path, const kt_settings *settings, kt_scene *scene, kt_model **model);

/* Loads a scene for the duration of a call. Returns the exit code of `use`, or of an error before it. */
typedef int kt_model_use(const kt_scene *scene, const kt_model *model, const void *user);
int kt_use_model(const char *path, const kt_settings *settings, kt_model_use *use, const void *user);

/* Compiles a scene without its hard stops, contacts, slack ropes and dry friction that sticks. Prints that they are
 * left out, and sets *lacks if the scene has any. Indices of loops and effects are the scene's. Prints the errors. */
int kt_compile_without_contacts(const kt_scene *scene, kt_model **model, bool *lacks);
/* Returns the number of loops of hard stops, contacts, slack ropes and dry friction that sticks. */
int kt_contact_count(const kt_model *model);
/* Rejects a model with such elements and prints the reason. Returns an exit code, or -1 if the model has none of
 * them. */
int kt_reject_contacts(const char *command, const kt_model *model);
/* Prints that the command computes the motion without the scene's events, if it has any. */
void kt_say_left_out(const char *command, const kt_scene *scene);

/* Returns "s" unless the count is 1. */
static inline const char *kt_plural(long long count) { return count == 1 ? "" : "s"; }

/* Returns the file's name without folders and extension: "scenes/four-bar.yaml" gives "four-bar"; "-" gives "scene".
 * The caller frees it. NULL: not enough memory. */
char *kt_base_name(const char *path);

/* Checks, before the computation, that a result (NULL: none; "-": a stream) can be written at its end. Returns -1 if it
 * probably can, otherwise KT_EXIT_INTEGRATION after printing the error. */
int kt_check_writable(const char *path);

#endif
