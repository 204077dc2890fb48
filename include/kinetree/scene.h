/* Scene files: YAML to a description and back. A library of its own, libkinetree-scene.
 *
 *     static void print_fault(void *user, const kt_error *fault) {
 *         fprintf((FILE *)user, "%s: %s\n", fault->where, fault->message);
 *     }
 *
 * and then
 *
 *     kt_scene scene;
 *     kt_model *compiled = NULL;
 *     status = kt_scene_read("four-bar.yaml", &scene, print_fault, stderr, &error);
 *     if (status == KT_OK) {
 *         status = kt_model_compile(&scene.description, NULL, &compiled, &error);
 *         kt_scene_free(&scene);
 *     }
 *
 * The format is version 1 of scene-files.md, with the types of types.md. They leave these details open:
 * - A file is UTF-8 text of at most 64 MB with one YAML document. Directives, tags, anchors, aliases and
 *   merge keys are refused, so that a small file cannot stand for a large one; nesting ends at 32 levels.
 * - A number is decimal: digits with an optional sign, point and exponent (1e-3). Hexadecimal digits, needless
 *   leading zeros (017), underscores and quotes are refused. The process's locale has no influence.
 * - An angle may end in ` deg` or ` rad`, and so may an initial angular rate (then per second); a length
 *   may not.
 * - Text that YAML reads as a number, boolean or null needs quotes.
 * - A `joint` and a `shape` name their `type`; a key that the type does not have is refused.
 * - Com and inertia are those of the shape where `mass` and `shape` are both given and `com` or `inertia` is not.
 * - An end of a loop or an effect may be {body: B, marker: M, rotation: ROTATION}, too.
 * - Loops have a `name`; effects may have one. Rolling without the contact has `holonomic: false`.
 * - A distance loop without a length has that of the given positions, before loops are closed; a spring without a
 *   length is unstretched at the start, after they have been closed.
 * - If `simulate` or `output`, or one of their keys, is missing, the values of kt_run_default apply; but if `integrator`
 *   is, run.integrator is NULL, and the method is chosen for the model (kt_run_method).
 * - `parameters` is a mapping of names to numbers, angles or expressions of other parameters, in any order. Wherever a
 *   number may stand, = and an expression (expression.h) of them may stand (`mass: =rho*area*L`), in quotes where it has a
 *   comma, a bracket or a brace. It counts as an angle by its units: `=2*tilt` is no length.
 * - An event's `when`, and `simulate.until`, are formulas without =. `then` is an action or a list of them: stop, record,
 *   {set: {NAME: VALUE, ...}} of parameters and states, each value a number or a formula, {release: NAME} and {engage: NAME} of a loop or an effect, which then is switched (kt_switching), {call: NAME}.
 * A key or word that the format does not have is an error, never ignored.
 */
#ifndef KINETREE_SCENE_H
#define KINETREE_SCENE_H

#include "kinetree/simulation.h"
#include "kinetree/study.h" /* types alone */

#include <stdio.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Lines and columns of the items of a scene in its file. */
typedef struct kt_scene_marks kt_scene_marks;

/* Something that a file has and the scene has not, or has in another form. */
typedef struct kt_scene_note {
    const char *where; /* "FILE:LINE:COLUMN", of the first */
    const char *what;  /* what, and how many */
    bool is_warning;   /* the motion is not that of the file */
} kt_scene_note;

/* A number of `parameters`. */
typedef struct kt_scene_parameter {
    const char *name; /* as expressions use it */
    double value;     /* in SI units and radians */
    bool is_set;      /* by a setting, not by the file */
} kt_scene_parameter;

/* What an event does to a loop or an effect: {release: NAME} or {engage: NAME}. */
typedef struct kt_scene_switch {
    const char *name; /* of the loop or effect, which is switched (kt_switching) */
    bool on;          /* engage; else release */
} kt_scene_switch;

/* What an event sets: a parameter, or an own state. A parameter that an event sets is an own state of its name, with the
 * rate 0: formulas, records and checkpoints have it as one. */
typedef struct kt_scene_set {
    const char *name;  /* of the state; or "velocity.JOINT", "velocity.JOINT[k]": a velocity of a joint */
    const char *value; /* a formula, as `when`, of the state before the event */
} kt_scene_set;

/* An item of `events`, or `simulate.until` (name "until", rising, stops). */
typedef struct kt_scene_event {
    const char *name; /* for messages, records and kt_simulation_event_count */
    const char
        *when; /* a formula (expression.h) of the variables of kt_variable_find and of accelerations and reactions,
                                under the names of their columns: its sign, or if it is a
                                comparison whether it holds; parameters are in it as the numbers that they are */
    kt_direction direction;          /* which changes of sign count; of a comparison: rising, it comes to hold */
    bool record, stop;               /* a record is written; the run ends, after one */
    const char *const *call;         /* names of the program's actions; NULL: none */
    int call_count;                  /* length of call */
    const kt_scene_switch *switches; /* take effect together, before the calls; NULL: none */
    int switch_count;                /* length of switches */
    const kt_scene_set *sets;        /* take effect together, before the switches; NULL: none */
    int set_count;                   /* length of sets */
    int limit;                       /* how often it happens at most; 0: any number */
} kt_scene_event;

/* An item of `output.columns`: a column of the records by a formula over all others, recorded or not (the command's CSV
 * files have them). */
typedef struct kt_scene_column {
    const char *name;    /* of the column */
    const char *formula; /* parameters are in it as the numbers that they are */
    const char *unit;    /* of its values, as text for records and pictures; NULL: not given */
} kt_scene_column;

/* An item of `meshes`: a surface of triangles in a file (STL, OBJ), which pictures show as part of a body. One with a
 * density encloses a solid; reading the scene gives its mass, centre and inertia to the body. */
typedef struct kt_scene_mesh {
    const char *body;     /* that it belongs to */
    const char *file;     /* absolute, or relative to the scene's file */
    kt_vec3 scale;        /* times the components of its points, m a unit of the file */
    kt_vec3 at;           /* its origin, body frame, m */
    kt_rotation rotation; /* of its axes against the body's */
    double density;       /* of the solid that it encloses, kg/m^3; 0: for pictures alone */
} kt_scene_mesh;

/* How a file is read. */
typedef struct kt_scene_options {
    size_t size; /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    /* Values that replace those of the file, each "PATH=VALUE": PATH is the name of a parameter, or keys, names of items and
     * numbers of list items that lead to a value (L, bodies.crank.mass, bodies.crank.com[1], simulate.tolerance); VALUE
     * is written as in a file. A key that the file does not have is added. They are checked as the file is, and a fault's
     * `where` is then the setting itself. */
    const char *const *settings;
    int setting_count; /* length of settings */

    /* Values that kt_scene_vary changes after the scene has been read: the PATH of each, as of a setting, and the number that
     * it has first, as by a setting behind the others. */
    const char *const *variables;
    const double *values; /* variable_count numbers */
    int variable_count;   /* length of variables */
} kt_scene_options;

/* No settings, no variables. */
static inline kt_scene_options kt_scene_options_default(void) {
    kt_scene_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* The numbers of a scene that follow from its variables. */
typedef struct kt_scene_variables kt_scene_variables;

/* The contents of a scene file. All strings and arrays that reading puts in it belong to it (or are static). */
typedef struct kt_scene {
    kt_description description; /* the mechanism */
    kt_run run;                 /* `simulate` and `output`, without the next two */

    /* Of `simulate`, for kt_absolute_create and kt_reduction_method_of of libkinetree-study. A program that reads
     * neither gets the same motion in tree coordinates, by QR. */
    kt_formulation formulation; /* coordinates that are integrated */
    kt_reduction reduction;     /* how the equations of loops are solved */

    /* Of `initial`: the result of a run, a file next to the scene's, from whose end the motion starts; NULL: none. The
     * command acts upon it; a program reads the file and calls kt_scene_start_from. */
    const char *from;

    const kt_scene_event *events;   /* `events`; NULL: none */
    int event_count;                /* length of events */
    kt_scene_event until;           /* `simulate.until`; its `when` is NULL: there is none */
    const kt_scene_column *columns; /* `output.columns`; NULL: none */
    int column_count;               /* length of columns */
    const kt_scene_mesh *meshes;    /* `meshes`, for pictures; NULL: none */
    int mesh_count;                 /* length of meshes */
    kt_scene_parameter *parameters; /* in the order of the file; NULL: none */
    int parameter_count;            /* length of parameters */
    const char *const *settings;    /* those of kt_scene_options, as they were given; NULL: none */
    int setting_count;              /* length of settings */
    const kt_scene_note *notes;     /* what an import (import.h) has left out or changed, each kind once, and parameters
                                 * that nothing uses; NULL: nothing */
    int note_count;                 /* length of notes */
    void *memory;                   /* where the arrays and strings live; for kt_scene_free */
    const kt_scene_marks *marks;    /* for kt_scene_locate; NULL: not read from a file or text */
    kt_scene_variables *variables;  /* for kt_scene_vary; NULL: none */
} kt_scene;

/* Returns a scene with an empty mechanism and kt_run_default, but no method named. */
KT_API kt_scene kt_scene_default(void);

/* Called once for each fault of a file, in the order of lines and columns. fault->where is "FILE:LINE:COLUMN", both
 * counted from 1 and columns in characters; fault->message says what is wrong with which text and how to mend it. */
typedef void kt_scene_report(void *user, const kt_error *fault);

/* Reads a scene from a regular file (`path`), or from `size` bytes of text (`path` is then only its name in messages;
 * NULL: "scene"). The file's form and the mechanism are both checked, and every fault of both is reported in one call;
 * only an error in YAML's own syntax ends the reading at once, and faults beyond 1000 are only counted. A fault that
 * follows from another one is not reported. report may be NULL. On success *scene is filled, to be released with
 * kt_scene_free; on failure it is untouched. Errors, *error being the first fault: KT_ERROR_FILE (the file cannot be
 * read), KT_ERROR_SCENE (its form), KT_ERROR_MODEL (the mechanism, as kt_description_check), KT_ERROR_MEMORY,
 * KT_ERROR_ARGUMENT. Time and memory grow in proportion to the size of the file. */
KT_API KT_CHECKED kt_status kt_scene_read(const char *path, kt_scene *scene, kt_scene_report *report, void *user,
                                          kt_error *error);
KT_API KT_CHECKED kt_status kt_scene_parse(const char *path, const char *text, size_t size, kt_scene *scene,
                                           kt_scene_report *report, void *user, kt_error *error);

/* The same with options (NULL: none). */
KT_API KT_CHECKED kt_status kt_scene_read_with(const char *path, const kt_scene_options *options, kt_scene *scene,
                                               kt_scene_report *report, void *user, kt_error *error);
KT_API KT_CHECKED kt_status kt_scene_parse_with(const char *path, const char *text, size_t size,
                                                const kt_scene_options *options, kt_scene *scene,
                                                kt_scene_report *report, void *user, kt_error *error);

/* Gives the variables of a scene other values, variable_count finite numbers: its numbers, and the values of its parameters,
 * are then those of the file read with these values, to the bit, without reading it. What kt_description_check and
 * kt_run_check judge, they judge when the scene is compiled and run. Errors, the scene being as before:
 * KT_ERROR_UNSUPPORTED (more than numbers follows from a variable: a formula of time, a rotation, a table; error->where is
 * such a place; read the scene again), KT_ERROR_SCENE (a number would not be finite, or not above 0 where it must be),
 * KT_ERROR_ARGUMENT (no variables). Allocates nothing. O(numbers that follow). */
KT_API KT_CHECKED kt_status kt_scene_vary(kt_scene *scene, const double *values, kt_error *error);

/* Adds the position in the file to a fault that only kt_model_compile finds: error->where, "body 'crank'" or "loop
 * 'close'", becomes "FILE:LINE:COLUMN", and its former text begins the message. Returns false, with the error
 * untouched, if that is no body or loop of the scene, or if the scene was not read. Allocates nothing. O(bodies +
 * loops). */
KT_API bool kt_scene_locate(const kt_scene *scene, kt_error *error);

/* The path that the scene was read from, or its name in messages; NULL: it was not read. In places of faults
 * (kt_error.where) a long path is cut at its beginning, after "...". The scene owns the text. O(1). */
KT_API const char *kt_scene_path(const kt_scene *scene);

/* Releases the memory that reading took, and sets *scene to kt_scene_default. NULL is allowed. */
KT_API void kt_scene_free(kt_scene *scene);

/* Makes a state of a scene's model, q (nq) and v (nv; NULL: at rest), its initial state: all of it is given then, and is
 * what the loops are closed from. What the scene measures in its initial state keeps the value that it has there: lengths
 * of springs and distances of loops become numbers, and the first ends of screw closures move along their axes. Functions
 * of time begin at 0, as before. scene->from is NULL afterwards. model: compiled from this scene, and not changed. On
 * failure the scene is untouched. Errors: KT_ERROR_MEMORY; KT_ERROR_CONSTRAINT where springs have no length because the
 * scene's own initial state cannot be assembled. */
KT_API KT_CHECKED kt_status kt_scene_start_from(kt_scene *scene, const kt_model *model, const double *q,
                                                const double *v, kt_error *error);

/* Makes own states x (description.state_count) those that the scene starts with. The scene's states are replaced; other
 * pointers into it stay valid. Errors: KT_ERROR_MEMORY, KT_ERROR_ARGUMENT; the scene is then as before. O(states). */
KT_API KT_CHECKED kt_status kt_scene_start_states(kt_scene *scene, const double *x, kt_error *error);
/* ---- events ------------------------------------------------------------------------------------------------------ */

/* The events of a scene as a simulation watches them. */
typedef struct kt_scene_watch kt_scene_watch;

/* What a program does at an event whose `then` has {call: name}. */
typedef struct kt_scene_call {
    const char *name;        /* as in the scene */
    kt_event_action *action; /* what is called */
    void *user;              /* for it */
} kt_scene_call;

/* How many events a simulation of this scene needs room for (kt_simulation_options.events). O(1). */
KT_API int kt_scene_event_room(const kt_scene *scene);

/* Whether events of the scene set parameters: its model is then to be settable (kt_model_options), or a copy. O(events). */
KT_API bool kt_scene_sets(const kt_scene *scene);

/* A checksum over an event of the scene, one of `events` or `until`: what it watches and does, and, where it sets parameters, the
 * formulas of the numbers that follow from these, which files of kt_scene_write do not have. Events that do the same have the
 * same sum; checkpoints are refused where it differs (kt_event.sum). Returns 0 if one of both is NULL. Allocates nothing.
 * O(numbers that follow). */
KT_API uint64_t kt_scene_event_sum(const kt_scene *scene, const kt_scene_event *event);

/* Adds the events of a scene to a simulation of its model. Formulas are evaluated in the simulation's own data, and
 * allocate nothing; *watch holds what they need, must outlive the simulation, as must the model and `calls`, and is
 * released with kt_scene_watch_free; the scene may be released before. Errors: KT_ERROR_MODEL (a body is not in the
 * model), KT_ERROR_SCENE (a formula; a call that is not among `calls`, where call_count is not negative: -1 leaves
 * calls out), KT_ERROR_MEMORY, KT_ERROR_ARGUMENT (kt_scene_sets, and the model is immutable). O(events * (variables +
 * bodies)). */
KT_API KT_CHECKED kt_status kt_scene_watch_create(const kt_scene *scene, const kt_model *model,
                                                  kt_simulation *simulation, const kt_scene_call *calls, int call_count,
                                                  kt_scene_watch **watch, kt_error *error);
/* Sets the parameters of the model to what the own states of the simulation say of them: after kt_simulation_restore and
 * kt_simulation_set_state, where events of the scene set parameters; else nothing is to be done. Errors: those of
 * kt_parameter_set. O(numbers that follow). */
KT_API KT_CHECKED kt_status kt_scene_watch_sync(kt_scene_watch *watch, const kt_simulation *simulation,
                                                kt_error *error);
/* Whether the comparison `until` of the scene holds in the simulation's state. Where it does at the start, it ends nothing
 * before it has ceased to hold: an event is a change. False where there is none, or a formula that compares nothing, and
 * for NULL. Allocates nothing. O(variables; with markers: bodies). */
KT_API bool kt_scene_until_holds(kt_scene_watch *watch, const kt_simulation *simulation);
/* Velocities that events of the scene were to set, and that loops, or velocities set before by the same event, decide. */
typedef struct kt_scene_missed {
    uint64_t count;    /* how many */
    double time;       /* s, of the first; the rest likewise: */
    int velocity;      /* index in v */
    double given, got; /* the value that it was to have, and the one that it has */
} kt_scene_missed;
/* Those of the simulation so far; the count is 0 for NULL. O(1). */
KT_API kt_scene_missed kt_scene_watch_missed(const kt_scene_watch *watch);
/* Releases it; NULL is allowed. */
KT_API void kt_scene_watch_free(kt_scene_watch *watch);

/* Writes a scene, read or made by the caller, as a scene file: SI units and radians, defaults left out, numbers with as
 * many digits as are needed to read back the same bits. Parameters and expressions are written as the numbers that they
 * are. Reading what was written gives the same description and run to the bit (of each struct the members of its type; a parent, or the body of an end, that is "world" comes back as
 * NULL), and writing that gives the same bytes. The scene is checked first, and nothing is written if it has a fault.
 * Errors: those of kt_description_check, KT_ERROR_ARGUMENT (the run), KT_ERROR_UNSUPPORTED, KT_ERROR_FILE (the stream
 * fails). */
KT_API KT_CHECKED kt_status kt_scene_write(const kt_scene *scene, FILE *stream, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
