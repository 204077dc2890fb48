/* Pictures of scenes at their start, for the running test (see fixture.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_PICTURE_SHOWN_H
#define KT_TEST_PICTURE_SHOWN_H

#include "files/scene/collect.h"

#include "kinetree/mechanism.h"
#include "picture/picture.h"

#include <stdlib.h>

typedef struct shown {
    kt_opened at;
    kt_pose *poses;
    kt_picture *picture;
} shown;

static inline void release_picture(void *picture) { kt_picture_free(picture); }

static inline shown show(kt_scene *scene, const kt_picture_options *options) {
    shown s = {.at = kt_test_open(scene, NULL)};
    kt_error error = {0};
    double *q = calloc((size_t)(kt_model_nq(s.at.model) + kt_model_nv(s.at.model)) + 1, sizeof *q);
    s.poses = calloc((size_t)kt_model_body_count(s.at.model), sizeof *s.poses);
    kt_test_own(q, free);
    kt_test_own(s.poses, free);
    kt_need((q != NULL && s.poses != NULL) || kt_check_true("there is memory", false));
    kt_model_initial(s.at.model, q, q + kt_model_nq(s.at.model));
    kt_need_fine("kinematics", kt_kinematics_update(s.at.model, s.at.data, q, NULL, NULL, &error), &error);
    for (int i = 0; i < kt_model_body_count(s.at.model); i++)
        s.poses[i] = kt_body_pose(s.at.model, s.at.data, i);
    kt_need_fine("picture", kt_picture_create(scene, s.at.model, s.poses, options, &s.picture, &error), &error);
    kt_test_own(s.picture, release_picture);
    return s;
}

#endif
