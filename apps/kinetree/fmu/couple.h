/* FMUs of a scene (effects of the type `fmu`) in a simulation of the command. */
#ifndef KT_COMMAND_FMU_COUPLE_H
#define KT_COMMAND_FMU_COUPLE_H

#include "kinetree/scene.h"

#include <jansson.h>

/* Checks the FMUs of a scene against their descriptions, and prints all faults. Prints doubts as warnings unless it is
 * quiet: units that differ, inputs without a value. Returns an exit code. */
int kt_fmus_check(const kt_scene *scene, bool is_quiet);

/* Checks their archives and binaries, as a simulation does before it runs them. Returns an exit code after printing all
 * faults. Other uses of a scene leave its FMUs out. */
int kt_fmus_inspect(const kt_scene *scene);

/* The communication points of a simulation, at which its steps end. */
typedef struct kt_fmu_clock kt_fmu_clock;

/* Before a simulation is created: makes its clock, and sets the members of *options for it. Without FMUs, *clock is
 * NULL. kt_fmus_couple takes the clock over; without that call, kt_fmus_end releases it. */
KT_CHECKED kt_status kt_fmus_begin(const kt_scene *scene, kt_simulation_options *options, kt_fmu_clock **clock,
                                   kt_error *error);
void kt_fmus_end(kt_fmu_clock *clock);

/* Couples all FMUs of the scene to a simulation at its start. The scene must outlive the watch, which releases the
 * FMUs and the clock; the simulation must end before. Errors: those of the FMU, with its place in the file or with its
 * name and the time. */
KT_CHECKED kt_status kt_fmus_couple(const kt_scene *scene, kt_scene_watch *watch, kt_simulation *simulation,
                                    kt_fmu_clock *clock, kt_error *error);

/* Reports FMUs whose state cannot be saved. */
KT_CHECKED kt_status kt_fmus_can_resume(const kt_scene *scene, const kt_scene_watch *watch, kt_error *error);

/* Returns the states of all FMUs for a checkpoint, as texts by the names of the FMUs; NULL after an error. */
json_t *kt_fmus_save(const kt_scene *scene, const kt_scene_watch *watch, kt_error *error);

/* Continues from these states. */
KT_CHECKED kt_status kt_fmus_restore(const kt_scene *scene, const kt_scene_watch *watch, const json_t *states,
                                     kt_error *error);

#endif
