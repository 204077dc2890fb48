/* Names of velocity coordinates: in words for small motions, and as in the columns of results. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/linear.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Names a direction in a joint's frame: "z" or "-x". If it lies along no axis, the name is its vector, as in `[0.6, 0,
 * -0.8]`. */
static void name_direction(char *text, size_t size, kt_vec3 direction) {
    const double d[3] = {direction.x, direction.y, direction.z}, rounding = 1e-9;
    double shown[3];
    for (int k = 0; k < 3; k++) {
        shown[k] = round(1000.0 * d[k]) / 1000.0 + 0.0; /* no -0 */
        if (fabs(d[(k + 1) % 3]) <= rounding && fabs(d[(k + 2) % 3]) <= rounding) {
            snprintf(text, size, "%s%c", d[k] < 0.0 ? "-" : "", "xyz"[k]);
            return;
        }
    }
    snprintf(text, size, "[%g, %g, %g]", shown[0], shown[1], shown[2]);
}

/* Names velocity component k of a joint that has several: "x", "about x", "angle"; "angle 1" if it has two.
 * Translations of a planar joint go along the first two axes of the triad about its normal. */
static kt_coordinate_name name_component(const kt_joint *joint, kt_joint_type type, int k) {
    const kt_coordinate_kind kind = kt_joint_coordinate_kind(type, k);
    kt_coordinate_name name = {""};
    int before = 0, all = 0; /* of this kind */
    for (int i = 0; i < KT_JOINT_NV_MAX; i++)
        if (kt_joint_coordinate_kind(type, i) == kind) {
            before += i < k;
            all++;
        }
    if (kind == KT_COORDINATE_TRANSLATION && type == KT_JOINT_PLANAR && joint != NULL) {
        const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(joint->axis), 2);
        name_direction(name.text, sizeof name.text, before == 0 ? triad.x : triad.y);
    } else if (kind == KT_COORDINATE_TRANSLATION || kind == KT_COORDINATE_ROTATION)
        snprintf(name.text, sizeof name.text, "%s%c", kind == KT_COORDINATE_ROTATION ? "about " : "",
                 "xyz"[before % 3]);
    else
        snprintf(name.text, sizeof name.text, "%s%s%.0d", kind == KT_COORDINATE_LENGTH ? "length" : "angle",
                 all > 1 ? " " : "", all > 1 ? before + 1 : 0);
    return name;
}

/* Returns the scene's joint of a body in the model; NULL: the scene does not have it. */
static const kt_joint *scene_joint_of(const kt_small_motion *motion, int body) {
    const kt_description *d = &motion->scene.description;
    for (int i = 0; i < d->body_count; i++)
        if (kt_body_find(motion->model, d->bodies[i].name) == body)
            return &d->bodies[i].joint;
    return NULL;
}

/* Returns the word for an auxiliary state. A parameter that events set is a state that the scene does not list. */
static const char *word_for_state(const kt_scene *scene, const char *name) {
    for (int k = 0; k < scene->parameter_count; k++)
        if (strcmp(scene->parameters[k].name, name) == 0)
            return "parameter";
    return "state";
}

kt_coordinate_name kt_name_coordinate(const kt_small_motion *motion, int coordinate) {
    const kt_model *model = motion->model;
    kt_coordinate_name name;
    if (coordinate >= kt_model_nv(model)) {
        const char *state = kt_auxiliary_state_name(model, coordinate - kt_model_nv(model));
        snprintf(name.text, sizeof name.text, "%s %.80s", word_for_state(&motion->scene, state), state);
        return name;
    }
    const int body = kt_velocity_body(model, coordinate);
    const kt_coordinates at = kt_body_coordinates(model, body);
    snprintf(name.text, sizeof name.text, "%.80s%s%.24s", kt_joint_name(model, body), at.nv > 1 ? " " : "",
             at.nv > 1 ? name_component(scene_joint_of(motion, body), at.type, coordinate - at.v).text : "");
    return name;
}

kt_coordinate_name kt_name_column(const kt_model *model, int coordinate) {
    const int body = kt_velocity_body(model, coordinate);
    const kt_coordinates at = kt_body_coordinates(model, body);
    kt_coordinate_name name;
    (void)snprintf(name.text, sizeof name.text, at.nv > 1 ? "%s[%d]" : "%s", kt_joint_name(model, body),
                   coordinate - at.v);
    return name;
}
