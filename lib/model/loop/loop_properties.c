/* Properties that follow from the descriptors of loop types, and queries of the loops of a model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"

#include "loop/loop.h"

#include <math.h>
#include <string.h>

#define KT_LOOP_EXTERN(id, name) extern const kt_descriptor kt_loop_##name##_descriptor;
KT_LOOP_LIST(KT_LOOP_EXTERN)
#undef KT_LOOP_EXTERN
extern const kt_descriptor kt_loop_custom_descriptor;

const kt_descriptor *kt_loop_descriptor(kt_loop_type type) {
#define KT_LOOP_ENTRY(id, name) [id] = &kt_loop_##name##_descriptor,
    static const kt_descriptor *const descriptors[KT_LOOP_TYPE_COUNT] = {KT_LOOP_LIST(KT_LOOP_ENTRY)};
#undef KT_LOOP_ENTRY
    return type == KT_LOOP_CUSTOM                ? &kt_loop_custom_descriptor
           : (unsigned)type < KT_LOOP_TYPE_COUNT ? descriptors[type]
                                                 : NULL;
}

bool kt_loop_is_relation(kt_loop_type type) { return kt_descriptor_end_count(kt_loop_descriptor(type)) == 0; }

int kt_loop_equation_count(const kt_loop *loop) {
    if (!loop)
        return 0;
    if (!kt_loop_type_exists(loop->type))
        return 0;
    if (kt_loop_is_relation(loop->type))
        return 1;
    const kt_loop_kind *kind = kt_loop_kinds_baseline[kt_loop_kind_index(loop->type)];
    return kind->row_count ? kind->row_count(loop) : kind->rows;
}

int kt_loop_term_count(const kt_loop *loop) {
    if (!kt_loop_is_relation(loop->type))
        return 0;
    return kt_descriptor_reads(kt_loop_descriptor(loop->type), KT_LOOP_AT(terms)) ? loop->term_count : 1;
}

kt_term kt_loop_term(const kt_loop *loop, int k) {
    if (kt_descriptor_reads(kt_loop_descriptor(loop->type), KT_LOOP_AT(terms)))
        return loop->terms[k];
    return (kt_term){.joint = loop->joint, .coefficient = 1.0};
}

kt_vec3 kt_loop_axis(const kt_loop *loop, int end) {
    const kt_descriptor *descriptor = kt_loop_descriptor(loop->type);
    const kt_vec3 second = loop->second_axis;
    if (end == 1 && kt_descriptor_reads(descriptor, KT_LOOP_AT(axis2)))
        return loop->axis2;
    const bool two = kt_descriptor_reads(descriptor, KT_LOOP_AT(second_axis)) && kt_vec3_dot(second, second) > 0.0;
    return end == 1 && two ? second : loop->axis;
}

int kt_loop_count(const kt_model *model) { return model ? (int)model->n.loop : 0; }
const char *kt_loop_name(const kt_model *model, int loop) {
    return model && KT_IS_INDEX(loop, model->n.loop) ? model->text + model->loop[loop].name : NULL;
}
kt_side kt_loop_side(const kt_model *model, int loop) {
    if (model && KT_IS_INDEX(loop, model->n.loop))
        return (kt_side)model->loop[loop].side;
    (void)model, (void)loop;
    return KT_SIDE_NONE;
}

bool kt_loop_is_stick(const kt_model *model, int loop) {
    if (model && KT_IS_INDEX(loop, model->n.loop))
        return model->loop[loop].friction > 0;
    (void)model, (void)loop;
    return false;
}

kt_loop_type kt_loop_type_of(const kt_model *model, int loop) {
    return model && KT_IS_INDEX(loop, model->n.loop) ? (kt_loop_type)model->loop[loop].type : KT_LOOP_TYPE_COUNT;
}

int kt_loop_find(const kt_model *model, const char *name) {
    if (!model || !name)
        return -1;
    for (int loop = 0; loop < kt_loop_count(model); loop++)
        if (strcmp(kt_loop_name(model, loop), name) == 0)
            return loop;
    return -1;
}

kt_loop_rows kt_loop_rows_of(const kt_model *model, int loop) {
    if (!model || !KT_IS_INDEX(loop, model->n.loop))
        return (kt_loop_rows){-1, 0};
    return (kt_loop_rows){.first = (int)model->loop[loop].equation, .count = (int)model->loop[loop].row_count};
}

/* Two frames that are no special case of any type. */
static void generic_ends(kt_loop_end end[2]) {
    static const double turned[3][3] = {{0.48, 0.6, 0.64}, {-0.8, 0.6, 0.0}, {-0.36, -0.48, 0.8}};
    memset(end, 0, 2 * sizeof end[0]);
    for (int k = 0; k < 3; k++) {
        end[0].axes[k][k] = 1.0;
        end[1].axes[k] = (kt_vector){turned[k][0], turned[k][1], turned[k][2], 0.0};
    }
    end[1].point = (kt_vector){0.3, 0.5, 0.7, 0.0};
}

/* An equation measures a length if its multiplier exerts a force, and an angle if its multiplier exerts only a
 * moment. */
kt_loop_measure kt_loop_measure_of(const kt_model *model, int loop, int row) {
    if (!model || !KT_IS_INDEX(loop, model->n.loop) || !KT_IS_INDEX(row, model->loop[loop].row_count))
        return KT_MEASURE_NONE;
    const kt_loop_record *record = &model->loop[loop];
    kt_loop_end end[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    if (record->term_count) {
        const kt_link *link = &model->link[model->term[record->term].link];
        if (kt_loop_kinds_baseline[record->kind]->relate(record, model->number, 0.0, 0.0).closes == 0.0)
            return KT_MEASURE_NONE;
        if (record->type != KT_LOOP_MOTION)
            return KT_MEASURE_SUM;
        return kt_link_lengths(link) ? KT_MEASURE_LENGTH : KT_MEASURE_ANGLE;
    }
    generic_ends(end);
    if (row >= kt_loop_kinds_baseline[record->kind]->evaluate(record, model->number, end, 0.0, rows) ||
        !rows[row].holonomic)
        return KT_MEASURE_NONE;
    const kt_vector f = rows[row].force;
    return f[0] != 0.0 || f[1] != 0.0 || f[2] != 0.0 ? KT_MEASURE_LENGTH : KT_MEASURE_ANGLE;
}

double kt_loop_unit(const kt_model *model, int loop, int row) {
    const kt_loop_record *record = &model->loop[loop];
    double unit = 0.0;
    if (record->term_count == 0)
        return kt_loop_measure_of(model, loop, row) == KT_MEASURE_ANGLE ? 1.0 : model->length;
    for (int i = 0; i < record->term_count; i++) {
        const kt_term_record *term = &model->term[record->term + i];
        const bool is_length = kt_link_lengths(&model->link[term->link]) > 0;
        unit = fmax(unit, fabs(term->coefficient) * (is_length ? model->length : 1.0));
    }
    return unit;
}

/* A relation of joints is an angle itself; see orientation.h for the others. */
double kt_loop_residual_angle(const kt_model *model, int loop, int row, double residual) {
    if (!model || !KT_IS_INDEX(loop, model->n.loop) || !KT_IS_INDEX(row, model->loop[loop].row_count))
        return (double)NAN;
    const int type = model->loop[loop].type;
    if (kt_loop_is_relation((kt_loop_type)type))
        return residual;
    return kt_loop_kinds_baseline[model->loop[loop].kind]->part[row] == KT_PART_NORMAL ? 2.0 * atan(residual / 2.0)
                                                                                       : 4.0 * atan(residual / 4.0);
}

kt_loop_disagreement kt_loop_disagreement_of(const kt_model *model, int loop) {
    if (!model || !KT_IS_INDEX(loop, model->n.loop))
        return (kt_loop_disagreement){(double)NAN, (double)NAN};
    const double *found = model->loop[loop].disagreement;
    return (kt_loop_disagreement){.length = found[0], .angle = found[1]};
}
