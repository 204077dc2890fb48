/* Velocities that events set: {set: {velocity.arm: "-0.8*velocity.arm"}} (impulse.c). */
#ifndef KT_SCENE_IMPULSE_H
#define KT_SCENE_IMPULSE_H

#include "base/pool.h"
#include "kinetree/scene.h"

/* Whether a name that an event sets is that of a velocity. */
bool kt_is_velocity_name(const char *name);

/* Whether an event of the scene sets velocities. */
bool kt_impulses_are_set(const kt_scene *scene);

typedef struct kt_impulses kt_impulses;

/* Memory for a model and for `count` velocities at most; NULL if there is not enough. */
kt_impulses *kt_impulses_create(kt_pool *pool, const kt_model *model, int count);

/* Sets the velocities at[i] of the simulation to values[i]. The others become the velocities nearest to theirs with
 * which the loops stay closed. If loops, or the velocities before, do not permit a value, it is counted
 * (kt_impulses_missed). */
KT_CHECKED kt_status kt_impulses_apply(kt_impulses *impulses, kt_simulation *simulation, kt_data *data, const int *at,
                                       const double *values, int count, kt_error *error);

/* The values that could not be set: their count, and the first of them. */
kt_scene_missed kt_impulses_missed(const kt_impulses *impulses);

#endif
