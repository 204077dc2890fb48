/* The error of a run that another program made. Such a program reports the poses of bodies in the world. These are the
 * coordinates of the absolute formulation, from which the joints' coordinates follow. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "base/require.h"
#include "compare/absolute.h"
#include "compare/accuracy.h"

#include <math.h>
#include <string.h>

enum { POSE = 7 }; /* x, y, z, w, i, j, k */

/* The scratch of a comparison. */
typedef struct kt_pose_reader {
    kt_absolute *absolute;
    double *memory;
    double *free_q, *free_v; /* of the absolute formulation; rates are not known, and stay zero */
    double *q, *v;           /* of the tree */
} kt_pose_reader;

static void close_reader(kt_pose_reader *reader) {
    kt_absolute_free(reader->absolute);
    kt_aligned_release(reader->memory);
}

static kt_status open_reader(const kt_accuracy *study, kt_pose_reader *reader, kt_error *error) {
    *reader = (kt_pose_reader){.absolute = NULL};
    const kt_status status =
        kt_absolute_create(study->description, &study->own.model, study->model, &reader->absolute, error);
    if (status != KT_OK)
        return status;
    const kt_model *model = kt_absolute_model(reader->absolute);
    const size_t free_nq = (size_t)kt_model_nq(model), free_nv = (size_t)kt_model_nv(model);
    const size_t count = free_nq + free_nv + study->nq + study->nv;
    reader->memory = kt_aligned_allocate(count * sizeof *reader->memory);
    if (reader->memory == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "accuracy", "there is not enough memory for the poses");
    memset(reader->memory, 0, count * sizeof *reader->memory);
    reader->free_q = reader->memory;
    reader->free_v = reader->free_q + free_nq;
    reader->q = reader->free_v + free_nv;
    reader->v = reader->q + study->nq;
    return KT_OK;
}

/* Writes the joints' positions for one row of poses into reader->q, which holds the positions of the previous row.
 * Returns whether all poses are finite and have a rotation. */
static bool read_pose_row(const kt_accuracy *study, kt_pose_reader *reader, const double *poses) {
    const kt_model *model = kt_absolute_model(reader->absolute);
    for (int b = 1; b < kt_model_body_count(study->model); b++, poses += POSE) {
        double *to = reader->free_q + kt_body_coordinates(model, reader->absolute->joint[b].body).q;
        double square = 0.0;
        for (int k = 3; k < POSE; k++)
            square += poses[k] * poses[k];
        if (!(isfinite(poses[0]) && isfinite(poses[1]) && isfinite(poses[2]) && isfinite(square) && square > 0.25))
            return false;
        memcpy(to, poses, POSE * sizeof *to);
        for (int k = 3; k < POSE; k++)
            to[k] /= sqrt(square);
    }
    kt_absolute_to_tree(reader->absolute, reader->free_q, reader->free_v, NULL, 0.0, reader->q, reader->v, NULL);
    return true;
}

/* The largest difference over the records, and the difference at the last record; NaN if a pose is invalid. */
static kt_accuracy_error find_error(const kt_accuracy *study, kt_pose_reader *reader, const double *poses) {
    const size_t width = POSE * (size_t)(kt_model_body_count(study->model) - 1);
    const double unknown = (double)NAN;
    kt_accuracy_error found = {.velocity = unknown,
                               .end_velocity = unknown,
                               .energy = unknown,
                               .quantity = unknown,
                               .constraint = {unknown, unknown}};
    memcpy(reader->q, study->reference.q, study->nq * sizeof *reader->q);
    for (int row = 0; row <= study->results.records && !isnan(found.position); row++) {
        found.end_position = unknown;
        if (read_pose_row(study, reader, poses + (size_t)row * width))
            found.end_position = kt_accuracy_distance(study, kt_accuracy_row(study, &study->reference, row),
                                                      (kt_accuracy_state){reader->q, reader->v})
                                     .position;
        if (!(found.end_position <= found.position))
            found.position = found.end_position;
    }
    return found;
}

kt_status kt_accuracy_compare(kt_accuracy *study, const double *poses, kt_accuracy_point *point, kt_error *error) {
    if (KT_IS_MISSING(error, study, poses, point))
        return KT_ERROR_ARGUMENT;
    kt_pose_reader reader;
    const kt_status status = open_reader(study, &reader, error);
    if (status == KT_OK) {
        point->error = find_error(study, &reader, poses);
        point->status = isnan(point->error.position) ? KT_ERROR_STEP : KT_OK;
        kt_accuracy_judge(study, point);
    }
    close_reader(&reader);
    return status;
}
