/* `kinetree export --fmu`: an FMU of FMI 3.0 or 2.0, for model exchange and co-simulation; and the C files of
 * `kinetree export --c`. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SUBCOMMANDS_EXPORT_FMU_H
#define KT_COMMAND_SUBCOMMANDS_EXPORT_FMU_H

#include "../fmu/roles.h"
#include "../fmu/signal.h"
#include "kinetree/descriptor.h"
#include "records/columns.h"
#include "text/arguments.h"

#include <stdbool.h>
#include <stdio.h>

typedef struct kt_export_fmu {
    const char *scene, *inputs, *out; /* inputs: names, apart by commas; NULL: none */
    const kt_settings *settings;
    int version;      /* KT_FMU_SECOND, KT_FMU_THIRD */
    bool has_sources; /* the archive has the source of the binary, too */
} kt_export_fmu;

/* Checks the command line. Returns -1, or an exit code after printing the error. */
int kt_export_fmu_check(const kt_export_fmu *fmu);

/* Reads the scene and writes the archive. Returns an exit code. */
int kt_export_fmu_write(const kt_export_fmu *fmu);

/* ---- inputs ------------------------------------------------------------------------------------------------------ */

/* An input: the force or torque in a joint, or a function of time of an effect or a loop. */
typedef struct kt_fmu_input {
    char of[KT_FMU_SIGNAL_NAME];       /* the joint, effect or loop */
    char name[2 * KT_FMU_SIGNAL_NAME]; /* name of a function: "drive.position" */
    const kt_key *key;                 /* key of a function; NULL: in a joint */
    bool is_loop, slides;              /* slides: its joint does; it has the second of two units */
    int size;                          /* kt_fmu_signal_size */
    double start[KT_FMU_SIGNAL_MOST];
} kt_fmu_input;

typedef struct kt_fmu_inputs {
    int count;
    kt_fmu_input *items;
} kt_fmu_inputs;

/* Finds the inputs of a list. Returns an exit code after printing an error. Ownership: kt_fmu_free_inputs. */
int kt_fmu_find_inputs(const kt_scene *scene, const char *list, kt_fmu_inputs *inputs);
void kt_fmu_free_inputs(kt_fmu_inputs *inputs);

/* Writes the setting that replaces a function by its value, with either name of its key. */
void kt_fmu_set_input(const kt_fmu_input *input, bool has_other_name, char *setting, size_t size);

/* Writes the first line of the resource, if functions are inputs. */
void kt_fmu_write_inputs(const kt_fmu_inputs *inputs, FILE *to);

/* Whether a joint, or the coordinate of a loop, slides. */
bool kt_fmu_joint_slides(const kt_description *d, const char *joint);

/* ---- the description --------------------------------------------------------------------------------------------- */

enum { KT_FMU_SECOND, KT_FMU_THIRD }; /* versions of the standard, in the order of the choices of --fmi */

enum { KT_FMU_UNIT = 32 };

/* Copies the unit of the k-th number of a key: "A|B" are those of turning and sliding joints, "A, B" those along and
 * about axes. */
void kt_fmu_copy_unit(const char *unit, bool slides, int k, char to[KT_FMU_UNIT]);

/* The number of a scene that a parameter is: "mass of arm", and its unit. Empty: not available. */
typedef struct kt_fmu_use {
    char text[KT_FMU_UNIT * 12], unit[KT_FMU_UNIT];
} kt_fmu_use;

/* Finds the use of a parameter by the same scene with another value of it. */
void kt_fmu_find_use(const kt_scene *scene, const kt_scene *other, int parameter, kt_fmu_use *use);

/* All that modelDescription.xml depends on. */
typedef struct kt_fmu_model {
    const char *name, *token; /* the name of the binary, and the token of the resources */
    const kt_scene *scene;
    const kt_model *model;
    const kt_columns *columns;
    const bool *is_input; /* [nv]: joint forces that are inputs */
    const kt_fmu_inputs *inputs;
    const kt_fmu_role *roles; /* [parameter_count] */
    const kt_fmu_use *uses;   /* [parameter_count] */
    bool has_exchange;        /* model exchange is offered */
    bool has_sources;         /* the archive has KT_FMU_SOURCE */
    int version;              /* KT_FMU_SECOND, KT_FMU_THIRD */
} kt_fmu_model;

/* The source of the binary, next to the installed binary and in the folder `sources` of an archive. */
#define KT_FMU_SOURCE "kinetree-fmu.c"

/* Writes modelDescription.xml. Errors of the stream stay in it (ferror). */
void kt_fmu_describe(const kt_fmu_model *fmu, FILE *stream);

/* Writes sources/buildDescription.xml: how to compile KT_FMU_SOURCE. */
void kt_fmu_describe_build(const kt_fmu_model *fmu, FILE *stream);

typedef struct kt_export_c {
    const char *scene, *functions, *out; /* functions: NULL for the default */
    const kt_settings *settings;
    bool constant;
} kt_export_c;

/* Checks the command line. Returns -1, or an exit code after printing the error. */
int kt_export_c_check(const kt_export_c *c);

/* Reads the scene and writes both files. Returns an exit code. */
int kt_export_c_write(const kt_export_c *c);

#endif
