/* Records in lanes (interleave.h). The source is compiled for one state, in which the records belong to one model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/interleave.h"

#include "batch/lanes.h"
#include "model/model.h"

#include <string.h>

/* The shape of a record. The numbers of a record end before `common`, the first member that all lanes share; `last` is
 * the last member. */
#define SHAPE(type, common, last)                                                                                      \
    { sizeof(type), offsetof(type, common) / sizeof(double), offsetof(type, last) + sizeof(((type *)NULL)->last) }

const kt_record_shape kt_link_shape = SHAPE(kt_link, parent, has_armature);
const kt_record_shape kt_planar_link_shape = SHAPE(kt_planar_link, parent, carries_others);
const kt_record_shape kt_plane_shape = SHAPE(kt_plane, first, last);
const kt_record_shape kt_body_shape = SHAPE(kt_body_record, link, on_variable_link);

void kt_records_interleave(const kt_records *r, uint32_t lanes) {
    const size_t numbers = r->shape->numbers, width = r->width, common = r->shape->bytes - numbers * sizeof(double);
    for (size_t i = 0; i < r->count; i++) {
        const char *from = (const char *)r->from + i * r->shape->bytes;
        const double *x = (const void *)from;
        char *record = (char *)r->to + i * r->stride;
        double *to = (void *)record;
        for (size_t lane = 0; lane < width; lane++)
            for (size_t k = 0; k < numbers && (lanes >> lane & 1U); k++)
                to[k * width + lane] = x[k];
        memcpy(record + numbers * width * sizeof *to, from + numbers * sizeof *x, common);
    }
}

/* Whether two arrays of records of one structure agree in the members that lanes share. */
static bool do_records_agree(const kt_record_shape *shape, size_t count, const void *a, const void *b) {
    const size_t numbers = shape->numbers * sizeof(double);
    for (size_t i = 0; i < count; i++)
        if (memcmp((const char *)a + i * shape->bytes + numbers, (const char *)b + i * shape->bytes + numbers,
                   shape->end - numbers) != 0)
            return false;
    return true;
}

static bool rows_are_equal(const void *a, const void *end, const void *b) {
    return memcmp(a, b, (size_t)((const char *)end - (const char *)a)) == 0;
}

/* Whether two models agree in their members that are no arrays. */
static bool settings_agree(const kt_model *a, const kt_model *b) {
    return a->bytes == b->bytes && a->shape == b->shape && a->kernels == b->kernels && a->forward == b->forward &&
           a->sweep == b->sweep && a->reduction == b->reduction && a->metric == b->metric && a->driven == b->driven &&
           (a->disagreement > 0.0) == (b->disagreement > 0.0) && (a->n.group == 0 || a->length == b->length);
}

/* Compares the arrays that all lanes share. Ranges of arrays follow the order of KT_MODEL_FIELDS. The
 * initial state, markers and limits are left out, since no recursion reads them. The table of names is left out, since
 * it has pointers. */
bool kt_lanes_agree(const kt_model *a, const kt_model *b) {
    if (a == b)
        return true;
    return settings_agree(a, b) && do_records_agree(&kt_link_shape, a->n.link, a->link, b->link) &&
           memcmp(a->rest, b->rest, a->n.rest * sizeof *a->rest) == 0 &&
           do_records_agree(&kt_plane_shape, a->n.plane, a->plane, b->plane) &&
           do_records_agree(&kt_planar_link_shape, a->n.planar, a->planar, b->planar) &&
           rows_are_equal(a->planar_rest, a->body, b->planar_rest) &&
           do_records_agree(&kt_body_shape, a->n.body, a->body, b->body) &&
           rows_are_equal(a->armature, a->index, b->armature);
}
