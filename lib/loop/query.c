/* What can be asked about the loops of a model one by one. */
#include "kinetree/loop.h"

#include "loop/loop.h"

#include <string.h>

int kt_loop_count(const kt_model *model) { return (int)model->n.loop; }
const char *kt_loop_name(const kt_model *model, int loop) { return model->text + model->loop[loop].name; }
kt_loop_type kt_loop_type_of(const kt_model *model, int loop) { return (kt_loop_type)model->loop[loop].type; }

int kt_loop_find(const kt_model *model, const char *name) {
    for (int loop = 0; loop < kt_loop_count(model); loop++)
        if (strcmp(kt_loop_name(model, loop), name) == 0)
            return loop;
    return -1;
}

kt_loop_rows kt_loop_rows_of(const kt_model *model, int loop) {
    return (kt_loop_rows){.first = (int)model->loop[loop].equation, .count = (int)model->loop[loop].row_count};
}

/* Two frames that no type of loop takes for a special case. */
static void generic_ends(kt_loop_end end[2]) {
    static const double turned[3][3] = {{0.48, 0.6, 0.64}, {-0.8, 0.6, 0.0}, {-0.36, -0.48, 0.8}};
    memset(end, 0, 2 * sizeof end[0]);
    for (int k = 0; k < 3; k++) {
        end[0].axes[k][k] = 1.0;
        end[1].axes[k] = (kt_vector){turned[k][0], turned[k][1], turned[k][2], 0.0};
    }
    end[1].point = (kt_vector){0.3, 0.5, 0.7, 0.0};
}

/* Equations that exert a force are of places, those that exert a moment alone of directions. */
kt_loop_measure kt_loop_measure_of(const kt_model *model, int loop, int row) {
    const kt_loop_record *record = &model->loop[loop];
    kt_loop_end end[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    if (record->term_count) {
        const kt_link *link = &model->link[model->term[record->term].link];
        return record->type != KT_LOOP_MOTION        ? KT_MEASURE_SUM
               : link->motion == KT_MOTION_PRISMATIC ? KT_MEASURE_LENGTH
                                                     : KT_MEASURE_ANGLE;
    }
    generic_ends(end);
    if (row >= kt_loop_kinds_baseline[record->type]->evaluate(record, model->number, end, 0.0, rows) ||
        !rows[row].holonomic)
        return KT_MEASURE_NONE;
    const kt_vector f = rows[row].force;
    return f[0] != 0.0 || f[1] != 0.0 || f[2] != 0.0 ? KT_MEASURE_LENGTH : KT_MEASURE_ANGLE;
}
