/* The parts of a scene that begin anew if a motion starts at t = 0 in a later state of the same scene. */
#ifndef KT_COMMAND_SCENE_ANEW_H
#define KT_COMMAND_SCENE_ANEW_H

#include "kinetree/scene.h"

/* Prints that functions of time, masses that are functions of time, times in events and limits of events begin anew.
 * Each line begins with `start`, such as "the motion starts at t = 0 from the state of run.json". `source` names what
 * has the state. Prints nothing if the scene has no such part. FMUs are left to the caller. */
void kt_say_anew(const kt_scene *scene, const char *start, const char *source);

#endif
