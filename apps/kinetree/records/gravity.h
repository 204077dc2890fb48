/* Gravity in joints: the joint forces that balance it, as formulas read them (gravity.JOINT). */
#ifndef KT_COMMAND_RECORDS_GRAVITY_H
#define KT_COMMAND_RECORDS_GRAVITY_H

#include "kinetree/simulation.h"

typedef struct kt_gravity kt_gravity;

/* Allocates the memory for a model and its sets. Returns NULL if memory is insufficient. */
kt_gravity *kt_gravity_create(const kt_model *model);
void kt_gravity_free(kt_gravity *gravity);

/* Returns the joint forces (nv) at (t, q). They are valid until the next call; NaN if the position is not finite. */
const double *kt_gravity_evaluate(kt_gravity *gravity, const kt_model *model, double t, const double *q);

#endif
