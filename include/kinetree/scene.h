/* Scene files: conversion of YAML to a description and back. The functions are in a separate library,
 * libkinetree-scene.
 *
 *     static void print_fault(void *user, const kt_error *fault) {
 *         fprintf((FILE *)user, "%s: %s\n", fault->where, fault->message);
 *     }
 *
 * This callback prints faults. A program passes the callback to the reader:
 *
 *     kt_scene scene;
 *     kt_model *compiled = NULL;
 *     status = kt_scene_read("four-bar.yaml", &scene, print_fault, stderr, &error);
 *     if (status == KT_OK) {
 *         status = kt_model_compile(&scene.description, NULL, &compiled, &error);
 *         kt_scene_free(&scene);
 *     }
 *
 * The format is version 1 of scene-files.md, with the types of types.md. The following details complete these pages:
 * - A file is UTF-8 text of at most 64 MB with one YAML document. Directives, tags, anchors, aliases and merge keys are
 *   rejected, so that a small file cannot expand to a large one. Nesting ends at 32 levels.
 * - A number is decimal: digits with an optional sign, point and exponent (1e-3). Hexadecimal digits, needless leading
 *   zeros (017), underscores and quotes are rejected. The process's locale has no influence.
 * - An angle may end in ` deg` or ` rad`, and so may an initial angular rate (then per second). A length may not.
 * - Text that YAML reads as a number, boolean or null needs quotes.
 * - A `joint` and a `shape` name their `type`. A key that the type does not have is rejected.
 * - If `mass` and `shape` are given, the shape determines a missing `com` or `inertia`.
 * - An end of a loop or an effect may also be {body: B, marker: M, rotation: ROTATION}.
 * - Loops have a `name`; effects may have one. Rolling without the contact has `holonomic: false`.
 * - A distance loop without a length has the distance at the given positions, before loops are closed. A spring without
 *   a length is unstretched at the start, after loops have been closed.
 * - If `simulate` or `output`, or one of their keys, is missing, the values of kt_run_default apply. If `integrator` is
 *   missing, run.integrator is NULL, and the method is chosen for the model (kt_run_method).
 * - `parameters` is a mapping of names to numbers, angles or expressions of other parameters, in any order. Any number
 *   may be replaced by = and an expression (expression.h) of these parameters (`mass: =rho*area*L`). An expression with
 *   a comma, a bracket or a brace needs quotes. The units of the expression decide whether it counts as an angle:
 * `=2*tilt` is no length.
 * - An event's `when`, and `simulate.until`, are formulas without =. The key `then` is an action or a list of actions.
 *   The actions are stop, record, {call: NAME}, and {set: {NAME: VALUE, ...}} for parameters and states. Each value is
 *   a number or a formula. The actions {release: NAME} and {engage: NAME} act on a loop or an effect, which is then
 *   switched (kt_switching).
 * A key or word that the format does not have is an error, never ignored.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_SCENE_H
#define KINETREE_SCENE_H

#include "kinetree/run.h"
#include "kinetree/simulation.h"

#include <stdio.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The lines and columns of the items of a scene in its file. */
typedef struct kt_scene_marks kt_scene_marks;

/* The rank of a note. */
typedef enum kt_note_rank {
    KT_NOTE_RANK_NAME = 0, /* a name without a use, or that the format does not have: it may be misspelt */
    KT_NOTE_RANK_MOTION,   /* a warning: the motion differs from that of the file */
    KT_NOTE_RANK_START,    /* the start, fixed and free bodies, limits, contacts that are left out */
    KT_NOTE_RANK_DETAIL,   /* pictures, the form of the scene, names that do not concern the motion */
} kt_note_rank;

/* A note about an element of a file that the scene omits or has in another form. */
typedef struct kt_scene_note {
    const char *where; /* "FILE:LINE:COLUMN", of the first such element */
    const char *what;  /* the kind of element, and the number of elements */
    kt_note_rank rank; /* how much it matters */
} kt_scene_note;

/* A parameter of `parameters`. */
typedef struct kt_scene_parameter {
    const char *name; /* name in expressions */
    double value;     /* value in SI units and radians */
    bool is_set;      /* set by a setting, not by the file */
    bool is_used;     /* a number or a formula uses it, directly or through other parameters */
} kt_scene_parameter;

/* A switching action of an event on a loop or an effect: {release: NAME}, {engage: NAME} or {engage_here: LOOP}. */
typedef struct kt_scene_switch {
    const char *name; /* name of the loop or effect, which is switched (kt_switching) */
    bool on;          /* true: engage; false: release */
    bool here;        /* engage: moves the loop's end on the world to where its body is, unless the loop acts already.
                       * The place is held by six auxiliary states, NAME_x, _y, _z (m) and NAME_rx, _ry, _rz (rad) */
} kt_scene_switch;

/* An assignment of an event to a parameter or an auxiliary state. A parameter that an event sets is an auxiliary state
 * with its name and the rate 0. Formulas, records and checkpoints contain such a parameter as an auxiliary state. */
typedef struct kt_scene_set {
    const char *name;  /* name of the state; or "velocity.JOINT", "velocity.JOINT[k]" for a velocity of a joint */
    const char *value; /* a formula, as `when`, that is evaluated in the state before the event */
} kt_scene_set;

/* An item of `events`, or `simulate.until` (name "until", rising, stops). */
typedef struct kt_scene_event {
    const char *name; /* name in messages, records and kt_simulation_event_count; it may have blanks */
    const char
        *when; /* a formula (expression.h) of the variables of kt_variable_find and of accelerations and reactions,
                * under the names of their columns. Its sign is watched, or for a comparison whether the comparison
                * is true. Parameters appear as numbers */
    kt_direction direction;          /* the changes of sign that count; of a comparison rising: it becomes true */
    bool record, stop;               /* record: a record is written; stop: the run ends, after a record */
    const char *const *call;         /* names of the program's actions; NULL: none */
    int call_count;                  /* length of call */
    const kt_scene_switch *switches; /* take effect together, before the calls; NULL: none */
    int switch_count;                /* length of switches */
    const kt_scene_set *sets;        /* take effect together, before the switches; NULL: none */
    int set_count;                   /* length of sets */
    int limit;                       /* the maximum number of occurrences; 0: any number */
} kt_scene_event;

/* An item of `output.columns`: a column of the records. Its formula may use all other columns, recorded or not. The CSV
 * files of the command contain these columns. */
typedef struct kt_scene_column {
    const char *name;    /* name of the column */
    const char *formula; /* formula; parameters appear as numbers */
    const char *unit;    /* unit of its values, as text for records and pictures; NULL: not given */
} kt_scene_column;

/* An item of `meshes`: a surface of triangles, from a file (STL, OBJ). Pictures show the mesh as part of a body.
 * A mesh with a density encloses a solid. When the scene is read, the solid gives its mass, centre and inertia to the
 * body. */
typedef struct kt_scene_mesh {
    const char *body;     /* body that the mesh belongs to */
    const char *file;     /* file, absolute or relative to the scene's file */
    kt_vec3 scale;        /* factors of the components of its points, m per unit of the file */
    kt_vec3 at;           /* origin of the mesh, body frame, m */
    kt_rotation rotation; /* rotation of its axes relative to the body's axes */
    double density;       /* density of the enclosed solid, kg/m^3; 0: for pictures alone */
} kt_scene_mesh;

/* Options for reading a file. */
typedef struct kt_scene_options {
    size_t size; /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    /* Values that replace those of the file, each "PATH=VALUE". PATH is the name of a parameter, or a sequence that
     * leads to a value: keys, names of items and numbers of list items. Examples are L, bodies.crank.mass,
     * bodies.crank.com[1], simulate.tolerance. VALUE is written as in a file. A key that the file does not have is
     * added. Settings are checked like the file; the `where` of a fault is then the setting itself. */
    const char *const *settings;
    int setting_count; /* length of settings */

    /* Values that kt_scene_vary changes after the scene has been read: the PATH of each, as for a setting, and its
     * first number. The first number acts like a setting after the others. */
    const char *const *variables;
    const double *values; /* variable_count numbers */
    int variable_count;   /* length of variables */

    bool gives_step; /* the program sets run.step itself: a method with a fixed step needs no `step` in the file */
    bool is_alone;   /* tables of files are faults, and meshes of files that have a density */
} kt_scene_options;

/* Returns options without settings and variables. */
static inline kt_scene_options kt_scene_options_default(void) {
    kt_scene_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* The numbers of a scene that follow from its variables. */
typedef struct kt_scene_variables kt_scene_variables;

struct kt_graph_choice;

/* The contents of a scene file.
 * Ownership: all strings and arrays that the reader creates belong to the scene (or are static). */
typedef struct kt_scene {
    kt_description description; /* the mechanism */
    kt_run run;                 /* `simulate` and `output`, without the next two */

    /* The entries of `simulate` for kt_absolute_create and kt_reduction_method_of of libkinetree-study. A program that
     * ignores both gets the same motion in tree coordinates, with QR. */
    kt_formulation formulation; /* coordinates that are integrated */
    kt_reduction reduction;     /* how the equations of loops are solved */

    kt_contact_scheme contact; /* the entry of `simulate` for kt_simulation_options.contact */

    /* The entry of `initial` for the result of a run, a file next to the scene's file. The motion starts from its end;
     * NULL: none. The command uses this entry. A program reads the file and calls kt_scene_start_from. */
    const char *from;

    const kt_scene_event *events;         /* `events`; NULL: none */
    int event_count;                      /* length of events */
    kt_scene_event until;                 /* `simulate.until`; its `when` is NULL: there is none */
    const kt_scene_column *columns;       /* `output.columns`; NULL: none */
    int column_count;                     /* length of columns */
    const kt_scene_mesh *meshes;          /* `meshes`, for pictures; NULL: none */
    int mesh_count;                       /* length of meshes */
    const struct kt_graph_choice *joints; /* `joints`: which of them carry bodies and which close loops (build.h);
                                           * NULL: none */
    int joint_count;                      /* length of joints */
    kt_scene_parameter *parameters;       /* in the order of the file; NULL: none */
    int parameter_count;                  /* length of parameters */
    const char *const *settings;          /* settings of kt_scene_options, as given; NULL: none */
    int setting_count;                    /* length of settings */
    const kt_scene_note *notes;    /* omissions and changes of an import (import.h), each kind once, and parameters
                                     * that nothing uses or that a variable of a formula hides; NULL: none */
    int note_count;                /* length of notes */
    void *memory;                  /* memory of the arrays and strings, for kt_scene_free */
    const kt_scene_marks *marks;   /* for kt_scene_locate; NULL: not read from a file or text */
    kt_scene_variables *variables; /* for kt_scene_vary; NULL: none */
} kt_scene;

/* Returns a scene with an empty mechanism and kt_run_default, but no method named. */
KT_API kt_scene kt_scene_default(void);

/* Called once for each fault of a file, in the order of lines and columns. The position fault->where is
 * "FILE:LINE:COLUMN", both counted from 1, and columns in characters. The text fault->message describes the fault,
 * quotes the text, and gives a remedy. */
typedef void kt_scene_report(void *user, const kt_error *fault);

/* Reads a scene from a regular file (`path`), or from `size` bytes of text. For text, `path` is only its name in
 * messages (NULL: "scene"). The form of the file and the mechanism are both checked, and one call reports every fault.
 * Only an error in YAML's own syntax ends the reading at once. Faults beyond 1000 are only counted. A fault that
 * follows from another fault is not reported. The callback report may be NULL.
 * Ownership: on success *scene is filled, and the caller releases it with kt_scene_free. On failure *scene is
 * untouched.
 * Errors: *error is the first fault. KT_ERROR_FILE (the file cannot be read), KT_ERROR_SCENE (its form), KT_ERROR_MODEL
 * (the mechanism, as kt_description_check), KT_ERROR_MEMORY, KT_ERROR_ARGUMENT.
 * Cost: time and memory are proportional to the size of the file. */
KT_API KT_CHECKED kt_status kt_scene_read(const char *path, kt_scene *scene, kt_scene_report *report, void *user,
                                          kt_error *error);
KT_API KT_CHECKED kt_status kt_scene_parse(const char *path, const char *text, size_t size, kt_scene *scene,
                                           kt_scene_report *report, void *user, kt_error *error);

/* Reads a scene like kt_scene_read and kt_scene_parse, with options (NULL: none). */
KT_API KT_CHECKED kt_status kt_scene_read_with(const char *path, const kt_scene_options *options, kt_scene *scene,
                                               kt_scene_report *report, void *user, kt_error *error);
KT_API KT_CHECKED kt_status kt_scene_parse_with(const char *path, const char *text, size_t size,
                                                const kt_scene_options *options, kt_scene *scene,
                                                kt_scene_report *report, void *user, kt_error *error);

/* Gives the variables of a scene other values, variable_count finite numbers. The numbers of the scene and the values
 * of its parameters then equal, to the bit, those of the file with these values. The file is not read again. The checks
 * of kt_description_check and kt_run_check follow when the scene is compiled and run. The call allocates nothing.
 * Errors: the scene is unchanged on failure. KT_ERROR_UNSUPPORTED if a variable affects more than numbers: a formula of
 * time, a rotation, a table. In this case error->where is such a place; read the scene again. KT_ERROR_SCENE if a
 * number would not be finite, or not above 0 although it must be. KT_ERROR_ARGUMENT if the scene has no variables.
 * Cost: O(numbers that follow). */
KT_API KT_CHECKED kt_status kt_scene_vary(kt_scene *scene, const double *values, kt_error *error);

/* Returns whether the variables of a scene can change while a simulation of it runs. This is the case if the variables
 * determine only numbers that kt_parameter_set can set, or other parameters. Such numbers are gravity, masses, centres,
 * inertias and armatures of bodies, and numbers and constant functions of effects and loops. Returns false for NULL,
 * without variables, and if no number follows.
 * Cost: O(numbers that follow). */
KT_API bool kt_scene_is_tunable(const kt_scene *scene);

/* Returns whether the k-th parameter of a scene is computed from its variables. Returns false for NULL and without
 * variables.
 * Cost: O(numbers that follow). */
KT_API bool kt_scene_parameter_follows(const kt_scene *scene, int k);

/* Adds the position in the file to a fault that is found after reading. The text error->where, "body 'crank'",
 * "loop 'close'" or "initial.from", becomes "FILE:LINE:COLUMN", and the former text begins the message. Returns false
 * if the text names no body, loop or key of the file, or if the scene was not read. The error is then untouched. The
 * call allocates nothing.
 * Cost: O(bodies + loops). */
KT_API bool kt_scene_locate(const kt_scene *scene, kt_error *error);

/* Returns the path from which the scene was read, or its name in messages; NULL if the scene was not read. In positions
 * of faults (kt_error.where) a long path is cut at its beginning, after "...".
 * Ownership: the scene owns the text.
 * Cost: O(1). */
KT_API const char *kt_scene_path(const kt_scene *scene);

/* Returns the path of the k-th file that the scene's file names, k from 0, in any order: tables and meshes, but not
 * the result of `initial.from`. Existing files have absolute paths. A program must not write its results to
 * these files. Returns NULL if k is too large, and for scenes of robots.
 * Ownership: the scene owns the text.
 * Cost: O(k). */
KT_API const char *kt_scene_file(const kt_scene *scene, size_t k);

/* Releases the memory of a scene that was read, and sets *scene to kt_scene_default. NULL is allowed. */
KT_API void kt_scene_free(kt_scene *scene);

/* Makes a state of a scene's model, q (nq) and v (nv; NULL: at rest), the initial state of the scene. All its values
 * then count as given, and loops are closed from this state. Quantities that the scene measures in its initial state
 * keep their values. Lengths of springs and distances of loops become numbers, and the first ends of screw closures
 * move along their axes. Functions of time begin at 0, as before. The entry scene->from is NULL afterwards. The model
 * must be compiled from this scene, and is not changed.
 * Errors: KT_ERROR_MEMORY. KT_ERROR_CONSTRAINT if springs have no length because the scene's own initial state cannot
 * be assembled. The scene is untouched on failure. */
KT_API KT_CHECKED kt_status kt_scene_start_from(kt_scene *scene, const kt_model *model, const double *q,
                                                const double *v, kt_error *error);

/* Makes x (description.state_count numbers) the initial values of the scene's auxiliary states. The scene's states are
 * replaced, and loops of `engage_here` move to the positions in these states. Other pointers into the scene remain
 * valid.
 * Errors: KT_ERROR_MEMORY, KT_ERROR_ARGUMENT. The scene is unchanged on failure.
 * Cost: O(states). */
KT_API KT_CHECKED kt_status kt_scene_start_states(kt_scene *scene, const double *x, kt_error *error);
/* ---- events ------------------------------------------------------------------------------------------------------ */

/* The events of a scene in a simulation. */
typedef struct kt_scene_watch kt_scene_watch;

/* The action of a program at an event whose `then` has {call: name}. */
typedef struct kt_scene_call {
    const char *name;        /* name in the scene */
    kt_event_action *action; /* action that is called */
    void *user;              /* argument of the action */
} kt_scene_call;

/* Returns the number of events that a simulation of this scene needs room for (kt_simulation_options.events).
 * Cost: O(1). */
KT_API int kt_scene_event_room(const kt_scene *scene);

/* Returns whether events set parameters, states or places (`engage_here`). If so, the model must be settable or a copy.
 * Cost: O(events). */
KT_API bool kt_scene_needs_settable(const kt_scene *scene);

/* Returns whether the auxiliary state of this name holds a number of the position of a foothold (`engage_here`). Such
 * states have the rate 0, and the scene file does not list them.
 * Cost: O(events). */
KT_API bool kt_scene_is_place_state(const kt_scene *scene, const char *name);

/* Returns a checksum of an event of the scene, one of `events` or `until`. The sum covers the formula and the actions
 * of the event. If the event sets parameters, it also covers the formulas of the numbers that follow from these. Files
 * of kt_scene_write do not have these formulas. Events with equal formulas and actions have equal sums. Checkpoints are
 * rejected if the sums differ (kt_event.sum). Returns 0 if an argument is NULL. The call allocates nothing.
 * Cost: O(numbers that follow). */
KT_API uint64_t kt_scene_event_sum(const kt_scene *scene, const kt_scene_event *event);

/* Adds the events of a scene to a simulation of its model. Formulas are evaluated in the simulation's own data, and
 * allocate nothing.
 * Ownership: *watch holds the formulas. *watch, the model and `calls` must outlive the simulation; kt_scene_watch_free
 * releases *watch. The scene may be released earlier.
 * Errors: KT_ERROR_MODEL (a body is not in the model). KT_ERROR_SCENE for a faulty formula, or for a call that is not
 * among `calls`. If call_count is -1, calls are omitted. KT_ERROR_MEMORY. KT_ERROR_ARGUMENT (kt_scene_needs_settable,
 * and the model is immutable).
 * Cost: O(events * (variables + bodies)). */
KT_API KT_CHECKED kt_status kt_scene_watch_create(const kt_scene *scene, const kt_model *model,
                                                  kt_simulation *simulation, const kt_scene_call *calls, int call_count,
                                                  kt_scene_watch **watch, kt_error *error);

/* Sets the parameters of the model to the values in the auxiliary states of the simulation. Call this function after
 * kt_simulation_restore and kt_simulation_set_state if kt_scene_needs_settable is true. Other scenes do not
 * need this call.
 * Errors: those of kt_parameter_set.
 * Cost: O(numbers that follow). */
KT_API KT_CHECKED kt_status kt_scene_watch_sync(kt_scene_watch *watch, const kt_simulation *simulation,
                                                kt_error *error);
/* Returns the value of an event's formula in the simulation's state. The value of a comparison is above zero if the
 * comparison is true: for `>`, it is the left side minus the right one. `event` is an index in the events of the
 * scene; their number stands for `until`. Returns NaN if the formula cannot be computed, if there is no such event, and
 * for NULL. An event is a change of sign: if the value at the start is on the side to which the event leads, it must
 * first return to the other one. The call allocates nothing.
 * Cost: O(variables); with markers O(bodies), with reactions an evaluation of accelerations. */
KT_API double kt_scene_event_value(kt_scene_watch *watch, const kt_simulation *simulation, int event);
/* The velocities that events of the scene could not set. Loops, or velocities which the same event has set before,
 * determine these velocities. */
typedef struct kt_scene_missed {
    uint64_t count;    /* number of velocities */
    double time;       /* time of the first such velocity, s; the members below belong to it, too */
    int velocity;      /* index in v */
    double given, got; /* the value in the event, and the actual value */
} kt_scene_missed;
/* Returns these velocities of the simulation so far; the count is 0 for NULL.
 * Cost: O(1). */
KT_API kt_scene_missed kt_scene_watch_missed(const kt_scene_watch *watch);
/* Releases the events; NULL is allowed. */
KT_API void kt_scene_watch_free(kt_scene_watch *watch);

/* Writes a scene, read or made by the caller, as a scene file in SI units and radians. Defaults are omitted. Numbers
 * have as many digits as are needed to read back the same bits. Parameters and expressions are written as numbers.
 * Reading the file gives the same description and run to the bit. This applies to the members of each struct that
 * belong to its type. If a parent or the body of an end is "world", it comes back as NULL. Writing the result again
 * gives the same bytes. The scene is checked first, and a scene with a fault is not written.
 * Errors: those of kt_description_check, KT_ERROR_ARGUMENT (the run), KT_ERROR_UNSUPPORTED, KT_ERROR_FILE (the stream
 * fails). */
KT_API KT_CHECKED kt_status kt_scene_write(const kt_scene *scene, FILE *stream, kt_error *error);

/* Writes the text of a scene file in the flow style of YAML, with the settings of the options (NULL: none). Parameters
 * and formulas remain, unlike in kt_scene_write. Only the form of the text and the settings are checked.
 * Errors: those of kt_scene_parse. KT_ERROR_FILE (the stream fails). */
KT_API KT_CHECKED kt_status kt_scene_write_flow(const char *path, const char *text, size_t size,
                                                const kt_scene_options *options, FILE *stream, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
