/* What the files of the command share: subcommands, exit codes, words to the user. */
#ifndef KT_COMMAND_H
#define KT_COMMAND_H

#include "arguments.h"
#include "base/names.h"
#include "kinetree/scene.h"

#include <stdbool.h>
#include <stddef.h>

/* What the shell is told. */
enum {
    KT_EXIT_DONE = 0,
    KT_EXIT_USAGE = 1,       /* the command line is wrong */
    KT_EXIT_SCENE = 2,       /* the scene is wrong, or cannot be read */
    KT_EXIT_ASSEMBLY = 3,    /* it could not be assembled, or its constraints contradict */
    KT_EXIT_INTEGRATION = 4, /* the integration failed, or its results could not be written */
};

/* argv[0] is the subcommand's name. Returns an exit code. */
typedef int kt_command_main(int argc, char **argv);

/* The subcommands and one line about each, in the order in which they are shown. A subcommand is a line here and a file
 * that defines kt_command_NAME and kt_usage_NAME; help, man pages and completions follow. */
#define KT_SUBCOMMAND_LIST(X)                                                                                          \
    X(run, "run a scene; records as CSV, a summary as JSON, a picture")                                                \
    X(accuracy, "what accuracy costs: error against CPU time, for every method")                                       \
    X(plot, "draw the columns of a result: positions, energies, a phase plane")                                        \
    X(evaluate, "mass matrix, bias, acceleration, poses of the initial state, as JSON")                                \
    X(modes, "frequencies, damping and shapes of small motions; state matrices as JSON")                               \
    X(equilibrium, "where a scene comes to rest, and whether it stays there")                                          \
    X(info, "what a scene consists of: the tree, its degrees of freedom and masses")                                   \
    X(check, "find every fault of scene files")                                                                        \
    X(demo, "run one of the bundled scenes, or list them")                                                             \
    X(make, "write chains, pendulums and trees of any size as scenes")                                                 \
    X(stability, "the fastest modes, and the largest stable step of each method")                                      \
    X(integrators, "the integration methods and where they are published")                                             \
    X(help, "this help, that of a subcommand, man pages, completions for shells")

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

extern const kt_subcommand kt_subcommands[];
extern const size_t kt_subcommand_count;

/* The subcommand of this name. NULL: there is none, and that is said with the nearest name. */
const kt_subcommand *kt_subcommand_find(const char *name);

/* Words to the user, on standard error: "kinetree: ..." and a newline. What a terminal would obey is escaped. */
void kt_say(const char *format, ...) KT_PRINTF(1, 2);
void kt_say_error(const kt_error *error);

/* A name as it is shown: what a terminal would obey is escaped (base/escape.h), and a long name is cut. */
typedef struct kt_shown {
    char text[256];
} kt_shown;

kt_shown kt_show(const char *name);

/* The exit code that tells a status. */
int kt_exit_code(kt_status status);

/* "; did you mean 'NAME'?" with `before` before the name, or an empty text. */
typedef struct kt_question {
    char text[96];
} kt_question;

kt_question kt_ask(const kt_nearest *nearest, const char *before);

/* Writes out what standard output still holds. Returns code, or says that it could not be written and returns
 * KT_EXIT_INTEGRATION. The last call of a subcommand that has printed. */
int kt_finish_output(int code);

/* Whether what is drawn on this file descriptor may use box-drawing characters: a terminal, in a UTF-8 locale. */
bool kt_speaks_utf8(int descriptor);

/* ---- reading a scene --------------------------------------------------------------------------------------------- */

/* Reads a scene ("-": standard input) and says every fault of it. Returns KT_EXIT_DONE, and then *scene is released
 * with kt_scene_free, or an exit code. */
int kt_read_scene(const char *path, kt_scene *scene);

/* Compiles a scene as its `simulate` asks for, and says what is wrong with it. */
int kt_compile_scene(const kt_scene *scene, kt_model **model);

/* Reads and compiles; both are released by the caller, and neither exists where the exit code is not KT_EXIT_DONE. */
int kt_load_model(const char *path, kt_scene *scene, kt_model **model);

/* The file's name without folders and without its ending: "scenes/four-bar.yaml" gives "four-bar"; "-" gives "scene".
 * The caller frees it. NULL where there is no memory. */
char *kt_base_name(const char *path);

/* Says where a result (NULL: none; "-": a stream) could not be written in the end, before the work that leads to it:
 * returns KT_EXIT_INTEGRATION, or -1 where nothing speaks against it. */
int kt_check_writable(const char *path);

#endif
