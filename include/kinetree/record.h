/* Records: the quantities of a motion at one time, as a recorder receives them.
 *
 * A run selects the quantities by bits (kt_run.record), and kt_simulation_run passes the records to a callback.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_RECORD_H
#define KINETREE_RECORD_H

#include "kinetree/mechanism.h"
#include "kinetree/model.h"

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The quantities that a record can contain, as bits, in the order in which records are written. X(id, bit, name in
 * scene files)
 *
 * KT_RECORD_BALANCE requests the energies and the work done by effects, by applied torques and wrenches, and by driven
 * loops. Two additional equations integrate the powers with the motion, using the same method. These equations do not
 * affect the step size, so the motion has the same bits with and without a balance. The steps are chosen for the
 * motion, so that a drift of the balance shows how accurately these steps integrate the powers. A run without a balance
 * has no additional cost. */
#define KT_RECORD_LIST(X)                                                                                              \
    X(KT_RECORD_POSITION, 1, position)         /* q */                                                                 \
    X(KT_RECORD_VELOCITY, 2, velocity)         /* v */                                                                 \
    X(KT_RECORD_ACCELERATION, 4, acceleration) /* a */                                                                 \
    X(KT_RECORD_ENERGY, 8, energy)             /* kinetic and potential */                                             \
    X(KT_RECORD_BALANCE, 64, balance)          /* energies and works */                                                \
    X(KT_RECORD_CONSTRAINT, 16, constraint)    /* residuals of loops */                                                \
    X(KT_RECORD_REACTION, 32, reaction)        /* in joints and loops */                                               \
    X(KT_RECORD_BEARING, 262144, bearing)      /* in joints, without effects and drives */                             \
    X(KT_RECORD_MULTIPLIER, 128, multiplier)   /* of the loops' equations */                                           \
    X(KT_RECORD_MOMENTUM, 256, momentum)       /* linear, and angular about the world's origin */                      \
    X(KT_RECORD_ORIENTATION, 512, orientation) /* of bodies */                                                         \
    X(KT_RECORD_MARKER_VELOCITY, 1024, marker velocity)                                                                \
    X(KT_RECORD_MARKER_ACCELERATION, 2048, marker acceleration)                                                        \
    X(KT_RECORD_EFFECT, 4096, effect)   /* forces and motions of effects (kt_effect_quantity_at) */                    \
    X(KT_RECORD_CLOSURE, 8192, closure) /* relative coordinates of loops (kt_loop_motion_evaluate) */                  \
    X(KT_RECORD_STATE, 16384, state)    /* auxiliary states (kt_auxiliary_state) */                                    \
    X(KT_RECORD_ANGULAR_VELOCITY, 32768, angular velocity)         /* of bodies */                                     \
    X(KT_RECORD_ANGULAR_ACCELERATION, 65536, angular acceleration) /* of bodies */                                     \
    X(KT_RECORD_SINGULAR_VALUE, 131072, singular value)            /* the least one of the loops' Jacobian */          \
    X(KT_RECORD_GRAVITY, 524288, gravity)                          /* joint forces that balance gravity */

/* The bits of the quantities that are recorded. */
enum {
    KT_RECORD_DEFAULT = 0, /* position, velocity, energy; constraint if there are loops; auxiliary states */
#define KT_RECORD_ENUM(id, bit, name) id = bit,
    KT_RECORD_LIST(KT_RECORD_ENUM)
#undef KT_RECORD_ENUM
};

/* Returns the name of one bit in scene files ("energy"), or NULL for any other value. */
KT_API const char *kt_record_name(unsigned bit);

/* The work done since the start or the last kt_simulation_set_state. Effects have dissipated the first of the two. The
 * second is the work done by driving effects, torques, wrenches and driven loops. The powers are integrated with the
 * motion and do not change the motion. Some adaptive steps are too long for the powers, such as those of an evenly
 * turning drive, or of a contact that a drive closes. Then the powers are integrated once more along that step, to the
 * tolerances of the motion. With fixed steps, the work has the order of the method. */
typedef struct kt_work {
    double dissipated, supplied; /* J */
} kt_work;

/* The work done, estimated from the powers at the ends of steps (kt_simulation_options.watch_works). All numbers count
 * from the start. Without an estimate, all numbers are NaN. */
typedef struct kt_work_estimate {
    double net;    /* dissipated - supplied, J. kinetic + potential + net is constant, up to the errors of the
                      integration and of the estimate */
    double error;  /* of the estimate, J: four times the sum of the differences between cubics and parabolas through
                      powers. In a step in which a joint of a driven model turns by more than a radian, it is the whole
                      work of that step */
    double turned; /* the integral of |dissipated| + |supplied| as powers, J: the size of the works */
} kt_work_estimate;

struct kt_event;

/* The index of a record at a time other than k * interval. */
typedef enum kt_record_index {
    KT_INDEX_EVENT = -1,   /* of an event that records or stops; of kt_simulation_sense */
    KT_INDEX_CONTACT = -2, /* of a hard contact, or friction that sticks (record_contacts), by the name of its loop */
} kt_record_index;

/* A record, as a recorder receives it; valid during the call. Between the ends of steps q and v are interpolated and
 * projected. */
typedef struct kt_record {
    int64_t index;                /* k; negative: of an event (kt_record_index) */
    double t;                     /* s: k * interval, the duration for the last one, or the time of an event */
    const struct kt_event *event; /* the event of this record; NULL: the record is one of those at k * interval */
    const double *q;              /* nq */
    const double *v;              /* nv */
    const double *x;              /* auxiliary states, kt_auxiliary_state_count */

    /* Requested quantities; NULL or NaN if they are not requested. Each comment ends with the names of the requests. */
    const double *a;                 /* nv; acceleration */
    double kinetic, potential;       /* J; energy, balance */
    kt_work work;                    /* since the start; balance. kinetic + potential + work.dissipated - work.supplied
                                        is constant, up to the error of the integration */
    kt_work_estimate estimate;       /* watch_works */
    kt_residual constraint;          /* constraint */
    const kt_wrench *reactions;      /* one for each body, as in kt_joint_reactions; reaction */
    const kt_wrench *loop_reactions; /* one for each loop, as in kt_reaction_evaluate; reaction */
    const double *multipliers;       /* one for each equation, as in kt_multiplier_evaluate; reaction or multiplier */
    const kt_model *model;           /* the caller's; if loops or effects are switched, the model with the present
                                        set */
    const kt_data *data;             /* kinematics of q and v, and of a if it is given, for kt_body_pose,
                                        kt_point_position and similar queries; energy, reaction or kinematics */
    double slow_slip; /* m/s; friction of slower slip of hard contacts acts against a later slip. 0: there
                                        are no hard contacts */
} kt_record;

/* The force of one contact in a state. All vectors have world axes.
 *
 * The first body is that of the sphere, the point or the disc (kt_effect.between[0]). The force acts on the first body
 * at `point`, and its opposite on the body of the plane there. So a body that rests on a floor has a force upwards, and
 * friction that slows slip has force . slip < 0. This is the sign of all columns `effect.NAME`. */
typedef struct kt_contact_load {
    bool touches, sticks; /* it has a force; it is hard, and its friction holds it at rest */
    kt_vec3 point;        /* the lowest point of the first body, m */
    kt_vec3 normal;       /* the unit normal of the plane, towards the first body */
    kt_vec3 force;        /* normal force and friction, N; 0 if it does not touch */
    kt_vec3 slip;         /* velocity of the first body less that of the other one at `point`, across the normal, m/s */
} kt_contact_load;

/* Finds the force of a contact in a record: of elastic ones, of hard ones that stick or slip, and with time stepping.
 * The argument effect is the index in the description. kt_contact_force does so in the present state.
 * Errors: KT_ERROR_ARGUMENT if the effect is no contact, or if it is hard and the run does not request
 * KT_RECORD_REACTION. *load is then unchanged.
 * Cost: O(1). */
KT_API KT_CHECKED kt_status kt_record_contact(const kt_record *record, int effect, kt_contact_load *load,
                                              kt_error *error);

/* Returns 0 to continue, and any other number to stop. */
typedef int kt_recorder(const kt_record *record, void *user);

#ifdef __cplusplus
}
#endif
#endif
