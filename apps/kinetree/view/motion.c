/* The motion of a mechanism for pictures that move. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "view/motion.h"

#include "command.h"
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"
#include "open/released.h"

#include <math.h>
#include <stdlib.h>

enum { TRIANGLES = 40000 }; /* of meshes, in pages and in files for other viewers */

size_t kt_motion_width(const kt_motion *motion) { return motion->columns->count - 1 + (motion->has_drift ? 1 : 0); }

size_t kt_motion_bodies(const kt_motion *motion) { return (size_t)kt_model_body_count(motion->model) - 1; }

static size_t frame_size(const kt_motion *motion, size_t forces) {
    return sizeof(double) + kt_motion_bodies(motion) * (3 * sizeof(float) + 4 * sizeof(int16_t)) +
           (kt_motion_width(motion) + 3 * forces) * sizeof(float);
}

double kt_frame_interval(double duration) { return duration / fmin(fmax(60.0 * duration, 600.0), 6000.0); }

kt_motion *kt_motion_start(const kt_scene *scene, kt_columns *columns, int64_t records, bool has_reactions) {
    kt_motion *motion = calloc(1, sizeof *motion);
    if (motion == NULL)
        return NULL;
    *motion = (kt_motion){.scene = scene,
                          .model = columns->model,
                          .columns = columns,
                          .has_drift = (columns->record & KT_RECORD_ENERGY) != 0};
    const size_t reactions = has_reactions ? kt_motion_bodies(motion) + (size_t)scene->description.loop_count : 0;
    const size_t forces = reactions + (size_t)scene->description.effect_count;
    motion->forces = calloc(forces + 1, sizeof *motion->forces);
    if (motion->forces == NULL) {
        kt_motion_free(motion);
        return NULL;
    }
    motion->has_reactions = has_reactions;
    const double bytes = (double)records * (double)frame_size(motion, forces);
    motion->stride = (int64_t)ceil(fmax(bytes / (double)KT_MOTION_BYTES_MAX, 1.0));
    motion->expected = (size_t)(records / motion->stride) + 3;
    return motion;
}

void kt_motion_free(kt_motion *motion) {
    if (motion == NULL)
        return;
    kt_picture_free(motion->picture);
    free(motion->forces);
    free(motion->times);
    free(motion->places);
    free(motion->turns);
    free(motion->values);
    free(motion->force_values);
    free(motion->lines);
    free(motion->poses);
    free(motion->released);
    free(motion);
}

/* ---- the first frame --------------------------------------------------------------------------------------------- */

static void list_reaction_arrows(kt_motion *motion) {
    const kt_picture *picture = motion->picture;
    for (int i = 0; i < picture->joint_count; i++) {
        const kt_picture_joint *joint = &picture->joints[i];
        if (joint->type != KT_JOINT_FREE)
            motion->forces[motion->force_count++] =
                (kt_motion_force){KT_FORCE_JOINT, joint->body, joint->frame.body, joint->frame.pose.position};
    }
    for (int i = 0; i < picture->loop_count; i++) {
        const kt_body_frame *end = &picture->loops[i].ends[0];
        motion->forces[motion->force_count++] =
            (kt_motion_force){KT_FORCE_LOOP, picture->loops[i].loop, end->body, end->pose.position};
    }
}

/* Lists the forces that effects exert on bodies; a torque has none. */
static void list_effect_forces(kt_motion *motion) {
    const kt_picture *picture = motion->picture;
    for (int i = 0; i < picture->effect_count; i++) {
        const kt_picture_effect *effect = &picture->effects[i];
        const kt_body_frame *end = &effect->ends[0];
        const kt_force_source source = effect->type == KT_EFFECT_CONTACT ? KT_FORCE_CONTACT : KT_FORCE_EFFECT;
        if (effect->end_count > 0 && effect->type != KT_EFFECT_TORQUE)
            motion->forces[motion->force_count++] = (kt_motion_force){source, i, end->body, end->pose.position};
    }
}

/* Creates the picture and its bounds from the first frame. */
static int begin_picture(kt_motion *motion, const kt_data *data) {
    const int count = kt_model_body_count(motion->model);
    kt_pose *poses = motion->poses = malloc((size_t)count * sizeof *poses);
    const kt_picture_options options = {.boxes = motion->boxes, .triangles = TRIANGLES};
    kt_status status = KT_ERROR_MEMORY;
    for (int body = 0; body < count && poses != NULL; body++)
        poses[body] = kt_body_pose(motion->model, data, body);
    if (poses != NULL)
        status = kt_picture_create(motion->scene, motion->model, poses, &options, &motion->picture, NULL);
    if (status == KT_OK) {
        const kt_bounds bounds = kt_picture_widen(motion->picture, poses, kt_bounds_empty());
        if (bounds.low.x <= bounds.high.x)
            motion->centre = kt_vec3_scale(0.5, kt_vec3_add(bounds.low, bounds.high));
        if (motion->has_reactions)
            list_reaction_arrows(motion);
        list_effect_forces(motion);
        for (int i = 0; i < motion->picture->effect_count; i++)
            motion->line_count += motion->picture->effects[i].line_count;
    } else {
        kt_say("there is not enough memory for the motion");
    }
    return status == KT_OK ? 0 : -1;
}

/* ---- frames ------------------------------------------------------------------------------------------------------ */

static bool widen_list(void *list, size_t room, size_t size) {
    void **at = list;
    void *more = realloc(*at, room * size + 1);
    if (more != NULL)
        *at = more;
    return more != NULL;
}

static int make_frame_room(kt_motion *motion) {
    if (motion->count < motion->room)
        return 0;
    const size_t room = motion->room > 0 ? 2 * motion->room : motion->expected, bodies = kt_motion_bodies(motion);
    if (!widen_list(&motion->times, room, sizeof *motion->times) ||
        !widen_list(&motion->places, room, 3 * bodies * sizeof *motion->places) ||
        !widen_list(&motion->turns, room, 4 * bodies * sizeof *motion->turns) ||
        !widen_list(&motion->values, room, kt_motion_width(motion) * sizeof *motion->values) ||
        !widen_list(&motion->released, room, sizeof *motion->released) ||
        !widen_list(&motion->lines, room, 6 * (size_t)motion->line_count * sizeof *motion->lines) ||
        !widen_list(&motion->force_values, room, 3 * (size_t)motion->force_count * sizeof *motion->force_values)) {
        kt_say("there is not enough memory for the motion");
        return -1;
    }
    motion->room = room;
    return 0;
}

static void put_float_vector(float *to, kt_vec3 u) {
    to[0] = (float)u.x;
    to[1] = (float)u.y;
    to[2] = (float)u.z;
}

/* q and -q are the same rotation. The sign is chosen for the shorter way from the frame before. */
static void put_short_quaternion(int16_t *to, const int16_t *before, kt_quat q) {
    const double x[] = {q.w, q.x, q.y, q.z};
    double same = 0.0;
    for (int k = 0; k < 4 && before != NULL; k++)
        same += x[k] * before[k];
    const double scale = same < 0.0 ? -32767.0 : 32767.0;
    for (int k = 0; k < 4; k++) /* rounds to the nearest: the conversion truncates a positive number */
        to[k] = (int16_t)((int)(scale * x[k] + 32768.5) - 32768);
}

static void put_poses(kt_motion *motion, const kt_data *data) {
    const size_t bodies = kt_motion_bodies(motion), frame = motion->count;
    for (size_t b = 0; b < bodies; b++) {
        const size_t at = frame * bodies + b;
        const kt_pose pose = kt_body_pose(motion->model, data, (int)b + 1);
        put_float_vector(motion->places + 3 * at, kt_vec3_sub(pose.position, motion->centre));
        put_short_quaternion(motion->turns + 4 * at, frame > 0 ? motion->turns + 4 * (at - bodies) : NULL,
                             kt_quat_from_mat3(pose.rotation));
    }
}

/* Checks every fourth record, and each rigid part once. A shorter rotation is too brief to be seen turning
 * backwards. */
static void find_fastest_turn(kt_motion *motion, const kt_data *data) {
    const int bodies = kt_model_body_count(motion->model);
    if (motion->taken % 4 != 0)
        return;
    for (int body = 1; body < bodies; body++) {
        if (motion->picture->part[body] != body)
            continue;
        const double speed = kt_vec3_norm(kt_body_twist(motion->model, data, body).angular);
        if (speed > motion->fastest) {
            motion->fastest = speed;
            motion->fastest_body = body;
        }
    }
}

static void put_frame_values(kt_motion *motion, const kt_record *record, const double *values) {
    float *row = motion->values + motion->count * kt_motion_width(motion);
    for (size_t i = 1; i < motion->columns->count; i++)
        *row++ = (float)values[i];
    if (motion->count == 0)
        motion->energy_start = kt_shown_energy_of(record);
    if (motion->has_drift)
        *row = (float)(kt_shown_energy_of(record) - motion->energy_start);
}

/* Returns zero for an unknown force. Reactions may be missing in a record, and in the last state of a failure a force
 * may not be finite. */
static kt_vec3 arrow_force_of(const kt_motion *motion, const kt_motion_force *force, const kt_record *record) {
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0);
    const kt_wrench *reactions = force->source == KT_FORCE_LOOP ? record->loop_reactions : record->reactions;
    kt_effect_load load;
    if (force->source == KT_FORCE_JOINT || force->source == KT_FORCE_LOOP)
        return reactions != NULL ? reactions[force->index].force : none;
    return kt_effect_evaluate(motion->model, record->data, record->t, record->q, record->v,
                              motion->picture->effects[force->index].effect, &load, NULL) == KT_OK
               ? load.wrench[0].force
               : none;
}

static void put_forces(kt_motion *motion, const kt_record *record) {
    float *row = motion->force_values + 3 * motion->count * (size_t)motion->force_count;
    for (int i = 0; i < motion->force_count; i++)
        put_float_vector(row + 3 * i, arrow_force_of(motion, &motion->forces[i], record));
}

/* A motion, and where the next line of its frame is stored. */
typedef struct line_writer {
    const kt_motion *motion;
    float *to;
} line_writer;

static void put_line(void *user, kt_vec3 from, kt_vec3 to) {
    line_writer *w = user;
    put_float_vector(w->to, kt_vec3_sub(from, w->motion->centre));
    put_float_vector(w->to + 3, kt_vec3_sub(to, w->motion->centre));
    w->to += 6;
}

/* Writes the lines of the paths of effects. */
static void put_paths(kt_motion *motion, const kt_data *data) {
    line_writer w = {motion, motion->lines + 6 * motion->count * (size_t)motion->line_count};
    for (int body = 0; body < kt_model_body_count(motion->model) && motion->line_count > 0; body++)
        motion->poses[body] = kt_body_pose(motion->model, data, body);
    for (int i = 0; i < motion->picture->effect_count; i++)
        kt_picture_path(motion->picture, &motion->picture->effects[i], motion->poses, put_line, &w);
}

int kt_motion_take(kt_motion *motion, const kt_record *record, const double *values) {
    if (motion->is_loose)
        motion->count--;
    motion->is_loose = false;
    motion->model = record->model;
    if ((motion->picture == NULL && begin_picture(motion, record->data) != 0) || make_frame_room(motion) != 0)
        return -1;
    motion->times[motion->count] = record->t;
    motion->released[motion->count] =
        motion->simulation != NULL ? kt_released_set(motion->scene, motion->simulation) : 0;
    put_poses(motion, record->data);
    find_fastest_turn(motion, record->data);
    put_frame_values(motion, record, values);
    put_forces(motion, record);
    put_paths(motion, record->data);
    motion->count++;
    motion->is_loose = motion->taken % motion->stride != 0;
    motion->taken++;
    return 0;
}

int kt_motion_take_state(kt_motion *motion, double time, const double *q, const double *v) {
    if (motion->count > 0 && !(time > motion->times[motion->count - 1]))
        return 0;
    kt_error error = {0};
    kt_data *data = NULL;
    kt_status status = kt_data_create(motion->model, &data, &error);
    int failed = status == KT_OK ? 0 : -1;
    if (failed != 0)
        kt_say_error(&error);
    else
        status = kt_kinematics_update(motion->model, data, q, v, NULL, &error);
    if (status == KT_OK) {
        const kt_record record = {.model = motion->model,
                                  .t = time,
                                  .q = q,
                                  .v = v,
                                  .kinetic = (double)NAN,
                                  .potential = (double)NAN,
                                  .work = {(double)NAN, (double)NAN},
                                  .constraint = {(double)NAN, (double)NAN},
                                  .data = data};
        const double fastest = motion->fastest; /* of records: the state at a failure may be very fast */
        motion->is_loose = false;
        failed = kt_motion_take(motion, &record, kt_columns_evaluate(motion->columns, &record));
        motion->is_loose = false;
        motion->fastest = fastest;
    }
    kt_data_free(data);
    return failed;
}
