/* The watch of a simulation that a program drives, such as a control loop of Python. The watch gives the warnings of
 * `kinetree run`: of the start, the fixed step, the energy and the contacts, and prints nothing. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_ADVICE_DRIVEN_H
#define KT_COMMAND_ADVICE_DRIVEN_H

#include "kinetree/scene.h"
#include "kinetree/simulation.h"

typedef struct kt_driven kt_driven;

/* Creates the watch. events: the scene's, or NULL. calls: forces of the model are functions of the program. Then the
 * watch evaluates none of them. All arguments must outlive it. Returns NULL if memory is insufficient. */
kt_driven *kt_driven_create(const kt_scene *scene, const kt_model *model, const kt_run *run, kt_simulation *simulation,
                            kt_scene_watch *events, bool calls);
void kt_driven_free(kt_driven *driven);

/* kt_driven_begin takes the state before the first step after a restart. kt_driven_take takes the state after a call
 * that has moved the simulation, once in 32 steps, and more often at first. The result is true if the states show a
 * fault that has not been reported: the caller should fetch the warnings. Cost: nothing in most calls; else that of a
 * record, and for fixed steps of a fiftieth of all evaluations. */
void kt_driven_begin(kt_driven *driven);
bool kt_driven_take(kt_driven *driven);
/* Takes a record of kt_simulation_run in place of the present state. */
void kt_driven_record(kt_driven *driven, const kt_record *record);

/* The program changes the state or a parameter, and the energy with it. The next state is a new start. */
void kt_driven_restart(kt_driven *driven);
/* The program sets torques: they supply energy, which nothing accounts for. */
void kt_driven_supply(kt_driven *driven);

/* Examines all states so far, and returns the warnings from index `from` on as a JSON list, each code once. The caller
 * releases the text with kt_driven_text_free. NULL: memory is insufficient. */
char *kt_driven_warnings(kt_driven *driven, size_t from);
void kt_driven_text_free(char *text);

#endif
