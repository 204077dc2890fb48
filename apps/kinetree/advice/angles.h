/* Angles that were probably given in degrees without the unit. */
#ifndef KT_COMMAND_ADVICE_ANGLES_H
#define KT_COMMAND_ADVICE_ANGLES_H

#include "advice/warnings.h"

/* Warns of doubtful angles: start positions of joints, constant positions of effects in joints (stops, rests and
 * targets), and rotations of frames. With only_whole, it warns of whole numbers alone: the ends of earlier runs, which
 * are other numbers, may have many turns. Without it, it also warns of positions that functions of time drive. Returns
 * the number of warnings. */
int kt_angles_warn(kt_warnings *warnings, const kt_scene *scene, bool only_whole);

/* Prints the same warnings, of whole numbers alone, without a list. Returns their number. */
int kt_angles_say(const kt_scene *scene, bool quiet);

#endif
