/* Records of a run as HDF5: their columns, and the parameters of the scene as attributes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include <stdlib.h>
#include <string.h>

int kt_run_keep_start(kt_keep *keep, const char *out) {
    const int code = kt_keep_open(keep, out, false);
    return code < 0 && kt_keep_begin(keep, 0) != 0 ? KT_EXIT_INTEGRATION : code;
}

static void parameters_of(const void *user, int64_t run, double *values) {
    const kt_scene *scene = ((const kt_outcome *)user)->scene;
    (void)run;
    for (int i = 0; i < scene->parameter_count; i++)
        values[i] = scene->parameters[i].value;
}

/* Names of columns, their units and names of parameters, in one array. */
static const char **list_words(const kt_scene *scene, const kt_columns *columns) {
    enum { NAME_SIZE = 512 };
    const size_t n = columns->count, all = 2 * n + (size_t)scene->parameter_count;
    const char **words = calloc(1, (all + 1) * sizeof *words + n * NAME_SIZE);
    char *names = words != NULL ? (char *)(words + all + 1) : NULL;
    for (size_t i = 0; words != NULL && i < n; i++) {
        (void)kt_column_name(columns, i, names + i * NAME_SIZE, NAME_SIZE);
        words[i] = names + i * NAME_SIZE;
        words[n + i] = kt_column_quantity(columns, i).unit;
    }
    for (int i = 0; words != NULL && i < scene->parameter_count; i++) {
        const char *name = scene->parameters[i].name; /* the attribute `status` is that of the run */
        words[2 * n + (size_t)i] = strcmp(name, "status") == 0 ? "parameters.status" : name;
    }
    return words;
}

int kt_run_keep_end(kt_keep *keep, const kt_outcome *outcome, size_t rows, int code, kt_output_fate fate) {
    const kt_columns *columns = outcome->columns;
    const size_t n = columns->count;
    if (keep->file == NULL)
        return kt_keep_end(keep, NULL, KT_OUTPUT_NOTHING);
    const char **list = list_words(outcome->scene, columns);
    const kt_keep_words words = {.columns = list,
                                 .units = list != NULL ? list + n : NULL,
                                 .column_count = n,
                                 .names = list != NULL ? list + 2 * n : NULL,
                                 .name_count = (size_t)outcome->scene->parameter_count,
                                 .values = parameters_of,
                                 .user = outcome,
                                 .only = "records"};
    int failed = list == NULL ? -1 : kt_keep_close_run(keep, 0, code, rows, n);
    if (list == NULL)
        kt_say("there is not enough memory");
    char *side = kt_partial_name(keep->output.name);
    failed = kt_keep_end(keep, &words, failed == 0 ? fate : KT_OUTPUT_AS_IS) != 0 ? -1 : failed;
    if (failed != 0 && side != NULL)
        kt_say("%s has no HDF5 yet, and cannot be read; free some space and repeat the run, or write CSV "
               "(--out FILE.csv), which keeps the records until the disk is full",
               side);
    free(side);
    free(list);
    return failed;
}
