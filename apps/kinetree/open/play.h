/* The simulation of a scene with all the scene's settings for its run: the formulation, the events, `until`. Or a
 * motion that has been recorded, in the place of a simulation.
 *
 *     kt_play play;
 *     status = kt_play_start(&play, &scene, model, absolute, &error);
 *     if (status == KT_OK)
 *         status = kt_play_to(&play, 0.5, &error);
 *     if (status == KT_OK)
 *         status = kt_play_poses(&play, poses, &error);
 *     kt_play_end(&play);
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_PLAY_H
#define KT_COMMAND_SCENE_PLAY_H

#include "command.h"
#include "kinetree/analysis.h"
#include "open/recorded.h"
#include "open/simulated.h"

#include <stdbool.h>

/* Creates the simulation of a scene's model, and the watch of its events and `until`, for every subcommand that follows
 * a motion. Calls of a program are left out. Sets the members of *options for the formulation and for events. absolute:
 * NULL if the tree coordinates are integrated. Ownership: the caller releases *made and *events (NULL: there are none),
 * in this order, also after an error. */
kt_status kt_simulate_scene(const kt_scene *scene, const kt_model *model, const kt_run *run,
                            const kt_absolute *absolute, kt_simulation_options *options, kt_simulated *made,
                            kt_scene_watch **events, kt_error *error);

/* A motion that is shown at times of the caller's choice. */
typedef struct kt_play {
    const kt_scene *scene;
    const kt_model *model;
    kt_simulation *simulation;  /* NULL: the motion is recorded */
    kt_absolute_motion *motion; /* its owner in the absolute formulation; else NULL */
    kt_recorded *recorded;      /* the caller's; NULL: it is simulated */
    double time;                /* s, of the state that is shown, if it is recorded */
    double *q;                  /* its positions */
    kt_scene_watch *events;
    uint64_t angles;       /* events of the scene, as bits, whose formulas read atan2 and have not jumped yet */
    double ended;          /* s, when an event ends the run; NaN: none does, or the end is not found yet */
    const char *ended_by;  /* the event's name, "until" for the condition of the scene; NULL: none */
    bool is_over;          /* the event has happened: the simulation stays where it is */
    const kt_model *shown; /* the model that data belong to: events change it */
    kt_data *data;
} kt_play;

/* Creates the simulation at its start. kt_play_end releases it, also after an error. */
kt_status kt_play_start(kt_play *play, const kt_scene *scene, const kt_model *model, const kt_absolute *absolute,
                        kt_error *error);
void kt_play_end(kt_play *play);
/* Likewise, of records, which must outlive the play. */
kt_status kt_play_start_recorded(kt_play *play, const kt_scene *scene, const kt_model *model, kt_recorded *recorded,
                                 kt_error *error);

/* Advances to a time, or to the event that ends the run before it; there the simulation stays. */
kt_status kt_play_to(kt_play *play, double time, kt_error *error);

/* Sets *time to the end of the run within `limit`: the event that ends it, or the limit. The play must be at its start,
 * and is there again afterwards; ended and ended_by then name the event. Cost: a run, if the scene has events. */
kt_status kt_play_find_end(kt_play *play, double limit, double *time, kt_error *error);

/* Writes the poses of all bodies at the positions q; in the present state. */
kt_status kt_poses_take(const kt_model *model, kt_data *data, const double *q, kt_pose *poses, kt_error *error);
kt_status kt_play_poses(kt_play *play, kt_pose *poses, kt_error *error);

/* Returns the position of a marker in the present state, in the world frame, m. The kinematics are those of the last
 * kt_play_poses. */
kt_vec3 kt_play_point(const kt_play *play, int body, int marker);

/* Returns a watch over the energy of a scene's motion, before the motion begins. */
kt_energy_watch kt_energy_watch_of(const kt_scene *scene, const kt_model *model);

#endif
