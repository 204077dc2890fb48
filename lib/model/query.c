/* Queries of a compiled model. */
#include "model/model.h"

#include <string.h>

#define KT_JOINT_COUNTS(id, name, nq, nv) [id] = {nq, nv},
const kt_joint_size kt_joint_sizes[KT_JOINT_TYPE_COUNT] = {KT_JOINT_LIST(KT_JOINT_COUNTS)};
#undef KT_JOINT_COUNTS

int kt_model_body_count(const kt_model *model) { return (int)model->n.body; }
int kt_model_nq(const kt_model *model) { return (int)model->n.q; }
int kt_model_nv(const kt_model *model) { return (int)model->n.v; }
kt_vec3 kt_model_gravity(const kt_model *model) { return kt_v4_vec3(model->gravity); }
const char *kt_model_name(const kt_model *model) { return model->text + model->name; }

kt_isa kt_model_isa(const kt_model *model) { return model->level; }

const char *kt_model_plan(const kt_model *model) {
    static const char *const name[KT_SWEEP_COUNT] = {"spatial", "planar", "mixed"};
    return name[model->sweep];
}

void kt_model_initial(const kt_model *model, double *q, double *v) {
    memcpy(q, model->q0, model->n.q * sizeof *q);
    memcpy(v, model->v0, model->n.v * sizeof *v);
}

const char *kt_body_name(const kt_model *model, int body) { return model->text + model->body[body].name; }
int kt_body_parent(const kt_model *model, int body) { return model->body[body].parent; }
double kt_body_mass(const kt_model *model, int body) { return model->body[body].mass; }
int kt_body_find(const kt_model *model, const char *name) { return kt_names_find(&model->names, 0, name); }
int kt_body_source(const kt_model *model, int body) { return model->body[body].source; }

kt_coordinates kt_body_coordinates(const kt_model *model, int body) {
    const kt_body_record *b = &model->body[body];
    return (kt_coordinates){.type = (kt_joint_type)b->type,
                            .q = b->q,
                            .nq = kt_joint_sizes[b->type].nq,
                            .v = b->v,
                            .nv = kt_joint_sizes[b->type].nv};
}

/* Coordinates are in the order of the bodies, and a body without coordinates has the same v as the next body: the
 * result is the last body whose first coordinate is not larger than v. */
int kt_body_of_velocity(const kt_model *model, int v) {
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

int kt_marker_count(const kt_model *model, int body) { return model->body[body].marker_count; }

const char *kt_marker_name(const kt_model *model, int body, int marker) {
    return model->text + model->marker[model->body[body].marker + marker].name;
}

kt_vec3 kt_marker_at(const kt_model *model, int body, int marker) {
    return model->marker[model->body[body].marker + marker].at;
}

int kt_marker_find(const kt_model *model, int body, const char *name) {
    return kt_names_find(&model->names, 1 + body, name);
}
