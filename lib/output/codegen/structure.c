/* The hash of all that a generated file folds. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/sum.h"
#include "codegen/loops.h"
#include "kinetree/codegen.h"

static void hash_code_bytes(uint64_t *h, const void *bytes, size_t count) { *h = kt_sum_add(*h, bytes, count); }

static void hash_code_int(uint64_t *h, int x) {
    const int32_t fixed = x;
    hash_code_bytes(h, &fixed, sizeof fixed);
}

/* Which of some numbers are zero. */
static void hash_code_zeros(uint64_t *h, const double *x, int count) {
    for (int i = 0; i < count; i++)
        hash_code_int(h, x[i] == 0.0);
}

uint64_t kt_codegen_structure(const kt_model *model) {
    uint64_t h = KT_SUM_START;
    if (model == NULL)
        return 0;
    const kt_vec3 g = kt_model_gravity(model);
    hash_code_zeros(&h, (const double[]){g.x, g.y, g.z}, 3);
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *r = &model->body[b];
        const kt_vec3 c = r->com, p = r->joint.position;
        const kt_sym3 j = r->inertia;
        hash_code_int(&h, r->type);
        hash_code_int(&h, r->parent);
        hash_code_zeros(&h, (const double[]){r->mass, c.x, c.y, c.z, p.x, p.y, p.z}, 7);
        hash_code_zeros(&h, (const double[]){j.xx, j.yy, j.zz, j.xy, j.xz, j.yz}, 6);
        hash_code_bytes(&h, &r->in_link.rotation, sizeof r->in_link.rotation);
    }
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *l = &model->link[i];
        const double pitch = kt_link_pitch(l);
        hash_code_int(&h, l->motion);
        hash_code_int(&h, l->axis);
        hash_code_int(&h, l->parent);
        hash_code_zeros(&h, &pitch, 1);
        hash_code_zeros(&h, model->armature + l->v, kt_link_dofs(l));
        if (l->rest_is_rotated)
            hash_code_bytes(&h, &kt_link_rest_of(l)->axes, sizeof(kt_mat3));
    }
    kt_code_hash_effects(model, hash_code_bytes, &h);
    kt_code_hash_loops(model, hash_code_bytes, &h);
    return h;
}
