/* What can be asked about the loops of a model one by one. */
#include "kinetree/loop.h"
#include "model/internal.h"

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
