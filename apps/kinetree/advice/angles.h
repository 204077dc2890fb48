/* Warnings about values in scenes that are probably mistakes: angles in degrees without the unit, effects that exert no
 * force, and own columns that copy another one with another unit. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_ADVICE_ANGLES_H
#define KT_COMMAND_ADVICE_ANGLES_H

#include "advice/warnings.h"
#include "text/arguments.h"

/* Warns of doubtful angles: start positions of joints, constant positions of effects in joints (stops, rests and
 * targets), and rotations of frames. With only_whole, it warns of whole numbers alone: the ends of earlier runs, which
 * are other numbers, may have many turns. Numbers of the settings above 50 rad are reported, too. Without only_whole,
 * the function also warns of positions that functions of time drive. settings: of the command line; NULL: none. Returns
 * the number of warnings. */
int kt_angles_warn(kt_warnings *warnings, const kt_scene *scene, bool only_whole, const kt_settings *settings);

/* Prints the same warnings, with only_whole, without a list. Returns their number. */
int kt_angles_say(const kt_scene *scene, const kt_settings *settings);

/* Warns of doubtful angles that these settings give, and of no other angles. Returns the number of warnings. */
int kt_angles_set_warn(kt_warnings *warnings, const kt_scene *scene, const kt_settings *settings);

/* Warns, once each, of bodies whose shapes give a density that no solid has, and of inertias that masses within the
 * shapes of a body cannot have. margin: the factor beyond these bounds, 1 or more: shapes may be mere sketches. Returns
 * the number of warnings. */
int kt_plausible_warn(kt_warnings *warnings, const kt_scene *scene, double margin);

/* Warns of springs, bushings, friction and drag all of whose numbers are 0, and of effects whose ends cannot move.
 * Numbers are not checked if an event sets parameters of the scene. Returns the number of warnings. */
int kt_idle_warn(kt_warnings *warnings, const kt_scene *scene);

/* Warns of slender rods on spherical and free joints whose turn about their own axis nothing resists. Returns the
 * number of warnings. */
int kt_slender_warn(kt_warnings *warnings, const kt_scene *scene);

/* Warns of own columns (`output.columns`) whose formula is the name of a column alone, and whose unit measures the same
 * quantity with another factor: `{value: position.arm, unit: deg}`. The unit is a label, and numbers are not converted.
 * Other formulas may convert. Returns the number of warnings. */
int kt_column_units_warn(kt_warnings *warnings, const kt_scene *scene, const kt_model *model);

#endif
