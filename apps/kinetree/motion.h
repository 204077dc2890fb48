/* The motion of a mechanism for pictures that move: poses of its bodies, columns and forces, frame by frame.
 *
 *     kt_motion *motion = kt_motion_start(scene, model, run, records, true);
 *     code = kt_motion_take(motion, record);                    for each record
 *     code = kt_view_write(motion, ...), kt_glb_write(motion, ...)
 *     kt_motion_free(motion);
 */
#ifndef KT_COMMAND_MOTION_H
#define KT_COMMAND_MOTION_H

#include "columns.h"
#include "kinetree/scene.h"
#include "picture/picture.h"

#include <stdint.h>

/* The most bytes that frames take; of a longer motion only every second (third, ...) record becomes a frame. */
#define KT_MOTION_BYTES_MAX (48 << 20)

/* The point where a force acts that frames have: that of a joint, or of a loop's first end. */
typedef struct kt_motion_force {
    bool is_loop;
    int index; /* the body of the joint, or the loop */
    int body;  /* to which the point is fixed */
    kt_vec3 at;
} kt_motion_force;

typedef struct kt_motion {
    const kt_scene *scene;
    const kt_model *model;
    kt_picture *picture; /* NULL: there is no frame yet */
    kt_columns columns;  /* the first is time, which frames have apart */
    bool has_drift;      /* after the columns comes the change of the total energy, or of the balance */
    double energy_start;
    kt_motion_force *forces;
    int force_count;
    kt_pose *poses; /* of one frame */
    kt_vec3 centre; /* places of bodies are relative to this, so that single precision does for them */

    /* Frames; bodies do not count the world here. */
    size_t count, room;
    double *times;    /* s */
    float *places;    /* [frame][body][3], m */
    int16_t *turns;   /* [frame][body][4]: quaternions times 32767, of the sign that is nearer to the frame before */
    float *values;    /* [frame][kt_motion_width] */
    float *reactions; /* [frame][force][3], N, on the child or second end, world axes */
    int64_t stride;   /* every stride-th record becomes a frame; the last one always does */
    int64_t taken;    /* records */
    bool is_loose;    /* the last frame gives way to the next record */
    double fastest;   /* rad/s, the largest angular velocity at any frame */
    int fastest_body; /* ... and whose */
} kt_motion;

/* run: the options of the run, and what is recorded. records: how many will be taken. has_reactions: records have them,
 * whether columns do or not. Returns NULL if memory is insufficient. */
kt_motion *kt_motion_start(const kt_scene *scene, const kt_model *model, const kt_run *run, int64_t records,
                           bool has_reactions);
void kt_motion_free(kt_motion *motion);

/* Adds a record, whose data hold its kinematics. Returns 0, or -1 after printing the error. */
int kt_motion_take(kt_motion *motion, const kt_record *record);
/* Adds a state, if it is later than the last frame and its poses can be computed: poses, positions and velocities,
 * without forces and energies. Returns 0, or -1 after printing that memory is insufficient. */
int kt_motion_take_state(kt_motion *motion, double time, const double *q, const double *v);

/* Numbers in a row of values: the columns but time, and the drift. */
size_t kt_motion_width(const kt_motion *motion);
/* Bodies of a frame, the world left out. */
size_t kt_motion_bodies(const kt_motion *motion);

#endif
