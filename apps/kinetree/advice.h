/* What would close the loops of a scene. */
#ifndef KT_COMMAND_ADVICE_H
#define KT_COMMAND_ADVICE_H

#include "command.h"

enum { KT_ADVICE_COORDINATES_MAX = 60 }; /* larger mechanisms are not tried: an assembly that fails takes long */

/* Whether the scene's loops close without joint `out` among those held (-1: all of these), and with `in` (NULL: none
 * more). */
bool kt_closes_holding(const kt_scene *scene, int out, const char *in);

/* After an assembly that failed: says how far each equation is open, and what would close the loops. */
void kt_say_open_loops(const kt_scene *scene, const kt_model *model);

#endif
