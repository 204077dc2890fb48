/* The motion of a mechanism for pictures that move: poses of its bodies, columns and forces, frame by frame.
 *
 *     kt_motion *motion = kt_motion_start(scene, &columns, records, true);
 *     code = kt_motion_take(motion, record, kt_columns_evaluate(&columns, record));     for each record
 *     code = kt_view_write(motion, ...), kt_glb_write(motion, ...)
 *     kt_motion_free(motion);
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_VIEW_MOTION_H
#define KT_COMMAND_VIEW_MOTION_H

#include "kinetree/scene.h"
#include "picture/picture.h"
#include "records/columns.h"

#include <stdint.h>

/* The most bytes that frames take; of a longer motion only every second (third, ...) record becomes a frame. */
#define KT_MOTION_BYTES_MAX (48 << 20)

typedef enum kt_force_source {
    KT_FORCE_JOINT,   /* reaction on the child, at the joint */
    KT_FORCE_LOOP,    /* reaction on the second end, at the first */
    KT_FORCE_CONTACT, /* on the sphere, at its lowest point */
    KT_FORCE_EFFECT,  /* on the first end, and its opposite on the second, if there is one */
} kt_force_source;

/* A force in each frame, and the point where it acts. */
typedef struct kt_motion_force {
    kt_force_source source;
    int index; /* the body of the joint, the loop, or the effect in the picture */
    int body;  /* the body to which the point is fixed; of a contact, the sphere's */
    kt_vec3 at;
} kt_motion_force;

typedef struct kt_motion {
    const kt_scene *scene;
    const kt_model *model;
    kt_picture *picture;             /* NULL: there is no frame yet */
    const kt_simulation *simulation; /* source of the released elements of a frame; NULL: none. Set as `boxes` */
    bool boxes;                      /* the motion shows boxes of inertia; set by the caller before the first frame */
    kt_columns *columns;             /* the caller's; the first is time, which frames store separately */
    bool has_drift;                  /* after the columns, the change of the total energy or of the balance */
    double energy_start;
    kt_motion_force *forces;
    int force_count;
    bool has_reactions; /* reactions of joints and loops are present; forces of effects are always present */
    kt_vec3 centre;     /* positions of bodies are relative to it, so that single precision suffices */

    /* Frames; the world is not among the bodies here. */
    size_t count, room;
    size_t expected;     /* frames of the whole run, with its last record and its last state */
    double *times;       /* s */
    float *places;       /* [frame][body][3], m */
    int16_t *turns;      /* [frame][body][4]: quaternions times 32767, of the sign that is nearer to the frame before */
    float *values;       /* [frame][kt_motion_width] */
    uint64_t *released;  /* loops and effects that do not act (kt_released_set) */
    float *force_values; /* [frame][force][3], N, world axes */
    float *lines;        /* [frame][line][2][3]: of the paths of effects, m, as places */
    int line_count;
    kt_pose *poses;   /* poses of all bodies, in the frame that is made */
    int64_t stride;   /* every stride-th record becomes a frame; the last one always does */
    int64_t taken;    /* records */
    bool is_loose;    /* the last frame is replaced by the next record */
    double fastest;   /* rad/s, the largest angular velocity at any frame */
    int fastest_body; /* ... and the body that has it */
} kt_motion;

/* Returns the interval between the records of a view, s. A view plays 60 records a second, but has neither very few nor
 * very many. */
double kt_frame_interval(double duration);

/* Creates a motion without frames. columns: the content of frames besides poses and forces; they must outlive the
 * motion. records: the number of records that will be taken. has_reactions: records have reactions, also if no column
 * has them.
 *
 * Errors: NULL if memory is insufficient. */
kt_motion *kt_motion_start(const kt_scene *scene, kt_columns *columns, int64_t records, bool has_reactions);
void kt_motion_free(kt_motion *motion);

/* Adds a record, whose data hold its kinematics; values: of the columns. Returns 0, or -1 after printing the error. */
int kt_motion_take(kt_motion *motion, const kt_record *record, const double *values);
/* Adds the poses, positions and velocities of a state, without forces and energies. A state is ignored if it is not
 * later than the last frame or if its poses cannot be computed. Returns 0, or -1 after printing that memory is
 * insufficient. */
int kt_motion_take_state(kt_motion *motion, double time, const double *q, const double *v);

/* Hands over the frames in the order of view/motion.js: `count` numbers of `size` bytes each, several times. */
typedef void kt_frame_sink(void *user, const void *numbers, size_t count, size_t size);
void kt_motion_write_frames(const kt_motion *motion, kt_frame_sink *put, void *user);

/* The count of numbers in a row of values: the columns except time, and the drift. */
size_t kt_motion_width(const kt_motion *motion);
/* The count of bodies in a frame, without the world. */
size_t kt_motion_bodies(const kt_motion *motion);

#endif
