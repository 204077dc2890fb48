/* Queries of a compiled model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/model.h"

#include <string.h>

#define KT_JOINT_COUNTS(id, name, nq, nv) [id] = {nq, nv},
const kt_joint_size kt_joint_sizes[KT_JOINT_TYPE_COUNT] = {KT_JOINT_LIST(KT_JOINT_COUNTS)};
#undef KT_JOINT_COUNTS

int kt_model_body_count(const kt_model *model) { return model ? (int)model->n.body : 0; }
int kt_model_nq(const kt_model *model) { return model ? (int)model->n.q : 0; }
int kt_model_nv(const kt_model *model) { return model ? (int)model->n.v : 0; }
kt_vec3 kt_model_gravity(const kt_model *model) {
    if (!model)
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    return kt_v4_vec3(model->gravity);
}
const char *kt_model_name(const kt_model *model) { return model ? model->text + model->name : NULL; }

kt_isa kt_model_isa(const kt_model *model) { return model ? model->isa : KT_ISA_AUTO; }

const char *kt_model_plan(const kt_model *model) {
    if (!model)
        return NULL;
    static const char *const name[KT_SWEEP_COUNT] = {"spatial", "planar", "mixed"};
    return name[model->sweep];
}

void kt_model_initial(const kt_model *model, double *q, double *v) {
    if (model && q)
        memcpy(q, model->q0, model->n.q * sizeof *q);
    if (model && v)
        memcpy(v, model->v0, model->n.v * sizeof *v);
}

const char *kt_body_name(const kt_model *model, int body) {
    return model && KT_IS_INDEX(body, model->n.body) ? model->text + model->body[body].name : NULL;
}
int kt_body_parent(const kt_model *model, int body) {
    return model && KT_IS_INDEX(body, model->n.body) ? model->body[body].parent : -1;
}
double kt_body_mass(const kt_model *model, int body) {
    return model && KT_IS_INDEX(body, model->n.body) ? model->body[body].mass : (double)NAN;
}
int kt_body_find(const kt_model *model, const char *name) {
    return model && name ? kt_names_find(&model->names, 0, name) : -1;
}
int kt_joint_index(const kt_model *model, const char *name) {
    const int own = kt_names_find(&model->names, KT_NAMES_OF_JOINTS, name);
    const int body = own < 0 ? kt_names_find(&model->names, 0, name) : own;
    return body >= 0 && (own >= 0 || model->body[body].joint_name == model->body[body].name) ? body : -1;
}
const char *kt_joint_name(const kt_model *model, int body) {
    return model && KT_IS_INDEX(body, model->n.body) ? model->text + model->body[body].joint_name : NULL;
}
int kt_body_source(const kt_model *model, int body) {
    return model && KT_IS_INDEX(body, model->n.body) ? model->body[body].source : -1;
}

kt_coordinates kt_body_coordinates(const kt_model *model, int body) {
    if (!model || !KT_IS_INDEX(body, model->n.body))
        return (kt_coordinates){.type = KT_JOINT_FIXED, .q = -1, .v = -1};
    const kt_body_record *b = &model->body[body];
    return (kt_coordinates){.type = (kt_joint_type)b->type,
                            .q = b->q,
                            .nq = kt_joint_sizes[b->type].nq,
                            .v = b->v,
                            .nv = kt_joint_sizes[b->type].nv};
}

/* Coordinates are in the order of the bodies. A body without coordinates has the same v as the next body. The result is
 * therefore the last body whose first coordinate is not larger than v. */
int kt_velocity_body(const kt_model *model, int v) {
    if (!model)
        return -1;
    int low = 0, high = (int)model->n.body; /* body[low].v <= v < body[high].v */
    if (v < 0 || v >= (int)model->n.v)
        return -1;
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (model->body[middle].v <= v)
            low = middle;
        else
            high = middle;
    }
    return low;
}

int kt_marker_count(const kt_model *model, int body) {
    return model && KT_IS_INDEX(body, model->n.body) ? model->body[body].marker_count : 0;
}

const char *kt_marker_name(const kt_model *model, int body, int marker) {
    return model && KT_IS_INDEX(body, model->n.body) && KT_IS_INDEX(marker, model->body[body].marker_count)
               ? model->text + model->marker[model->body[body].marker + marker].name
               : NULL;
}

kt_vec3 kt_marker_at(const kt_model *model, int body, int marker) {
    if (!model || !KT_IS_INDEX(body, model->n.body) || !KT_IS_INDEX(marker, model->body[body].marker_count))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    return model->marker[model->body[body].marker + marker].frame.position;
}

kt_mat3 kt_marker_rotation(const kt_model *model, int body, int marker) {
    const kt_vec3 none = kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    if (!model || !KT_IS_INDEX(body, model->n.body) || !KT_IS_INDEX(marker, model->body[body].marker_count))
        return (kt_mat3){none, none, none};
    return model->marker[model->body[body].marker + marker].frame.rotation;
}

int kt_marker_find(const kt_model *model, int body, const char *name) {
    return model && KT_IS_INDEX(body, model->n.body) && name ? kt_names_find(&model->names, 1 + body, name) : -1;
}
