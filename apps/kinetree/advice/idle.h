/* Effects that exert no force, whatever the motion. */
#ifndef KT_COMMAND_ADVICE_IDLE_H
#define KT_COMMAND_ADVICE_IDLE_H

#include "advice/warnings.h"

/* Warns of springs, bushings, friction and drag all of whose numbers are 0, and of effects whose ends cannot move.
 * Numbers are not checked if an event or an FMU sets parameters of the scene. Returns the number of warnings. */
int kt_idle_warn(kt_warnings *warnings, const kt_scene *scene);

#endif
