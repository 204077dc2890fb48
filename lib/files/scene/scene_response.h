/* Quantities that follow from the state with the equations of motion, as variables of events. The names are those of
 * columns: accelerations, reactions, angular velocities (scene_response.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_SCENE_RESPONSE_H
#define KT_SCENE_SCENE_RESPONSE_H

#include "base/pool.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"

typedef enum kt_response_type {
    KT_RESPONSE_ACCELERATION,         /* acceleration.JOINT, acceleration.JOINT[k] */
    KT_RESPONSE_MARKER_ACCELERATION,  /* marker.BODY.MARKER.ax */
    KT_RESPONSE_ANGULAR_VELOCITY,     /* angular_velocity.BODY.x, .body_x */
    KT_RESPONSE_ANGULAR_ACCELERATION, /* angular_acceleration.BODY.x, .body_x */
    KT_RESPONSE_JOINT_REACTION,       /* reaction.JOINT.fx */
    KT_RESPONSE_LOOP_REACTION,        /* reaction.LOOP.fx */
    KT_RESPONSE_MULTIPLIER            /* reaction.LOOP.multiplier */
} kt_response_type;

/* A response in a model. */
typedef struct kt_event_response {
    kt_response_type type;
    int item, component; /* body or loop; of an acceleration the index in v */
    kt_vec3 point;       /* place of a marker, in the body's frame */
} kt_event_response;

/* Whether formulas of events may use a name of this description. Loops of hard stops and contacts, NAME.lower, have the
 * names of their effects. */
bool kt_response_is_named(const kt_description *description, const char *name);

/* Writes the k-th name, k from 0, those of hard contacts excepted; false: there is none. */
bool kt_response_name(const kt_description *description, int k, char *text, size_t size);

/* Finds the quantity of a name in the description's model. Errors: KT_ERROR_MODEL (the model does not have it). */
KT_CHECKED kt_status kt_response_bind(const kt_description *description, const kt_model *model, const char *name,
                                      kt_event_response *response, kt_error *error);

/* The values of all responses at an instant. */
typedef struct kt_responses {
    kt_simulation *simulation;
    double *a, *multiplier;
    kt_wrench *joint, *loop;
    const kt_model *model; /* model to which the wrenches belong */
    const kt_data *data;   /* with the motion */
} kt_responses;

/* Memory for a model; false if there is not enough. */
bool kt_responses_take(kt_pool *pool, const kt_model *model, kt_responses *responses);

/* The bit of a response among those that have to be evaluated. All but angular velocities need the accelerations. */
static inline unsigned kt_response_bit(const kt_event_response *response) { return 1U << response->type; }

/* Whether responses of these bits belong to whole steps (KT_EVENT_HOLDS). */
bool kt_responses_are_stepped(const kt_responses *responses, unsigned bits);

/* Evaluates the responses of these bits, and the motion in the data of `at`. Errors: those of kt_acceleration_evaluate,
 * and with time stepping those of records. */
KT_CHECKED kt_status kt_responses_evaluate(kt_responses *responses, unsigned bits, const kt_instant *at,
                                           kt_error *error);

/* The value of a response that was evaluated. */
double kt_response_value(const kt_responses *responses, const kt_event_response *response);

#endif
