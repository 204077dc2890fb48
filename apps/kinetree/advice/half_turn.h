/* Effects in an angle of a loop that is not counted across turns. At half a turn from the start, the angle jumps by a
 * whole turn. */
#ifndef KT_COMMAND_ADVICE_HALF_TURN_H
#define KT_COMMAND_ADVICE_HALF_TURN_H

#include "advice/warnings.h"

enum { KT_HALF_TURNS_MOST = 16 };

/* The first effects in angles of loops, and their coordinates at the last record. */
typedef struct kt_half_turns {
    int count;
    int effect[KT_HALF_TURNS_MOST];
    bool reported[KT_HALF_TURNS_MOST];
    double angle[KT_HALF_TURNS_MOST]; /* rad; NaN: no record yet */
} kt_half_turns;

void kt_half_turns_begin(kt_half_turns *turns, const kt_model *model);

/* Takes a record, whose data must hold its kinematics. Warns, once for each effect, of an angle that has jumped since
 * the previous record. */
void kt_half_turns_add(kt_half_turns *turns, kt_warnings *warnings, const kt_scene *scene, const kt_record *record);

#endif
