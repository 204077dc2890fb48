/* kinetree modes --formulation: the eigenvalues that another formulation of the loops adds to the spectrum of the
 * mechanism. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/output.h"
#include "subcommands/modes.h"
#include "text/json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Returns whether an eigenvalue of the formulation belongs to the mechanism. It does if its distance from a mode of the
 * mechanism is within the error of finite differences. */
static bool is_mechanisms(const kt_small_motion *motion, double real, double imaginary, double scale) {
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (hypot(real - mode.real, fabs(imaginary) - mode.imaginary) <= 1e-6 * scale + mode.error)
            return true;
    }
    return false;
}

static int print_formulation_table(const kt_small_motion *motion, const char *name, const double *real,
                                   const double *imaginary, int count) {
    const double scale = fmax(1.0, hypot(real[count - 1], imaginary[count - 1]));
    printf("%s: eigenvalues of the formulation '%s' in %s%d tree coordinate%s\n", kt_show(motion->name).text, name,
           count > 2 ? "all " : "", count / 2, count > 2 ? "s" : "");
    printf("  %14s  %14s\n", "real, 1/s", "imaginary");
    for (int i = 0; i < count; i++) {
        if (imaginary[i] < 0.0)
            continue;
        char pair[32];
        snprintf(pair, sizeof pair, imaginary[i] > 0.0 ? "+- %.6g" : "%.6g", imaginary[i]);
        printf("  %14.6g  %14s  %s\n", fabs(real[i]) > 1e-7 * scale ? real[i] : 0.0, pair,
               is_mechanisms(motion, real[i], imaginary[i], scale) ? "the mechanism's" : "added by the formulation");
    }
    return kt_finish_output(KT_EXIT_DONE);
}

static json_t *describe_formulation_modes(const kt_small_motion *motion, const char *name, const double *real,
                                          const double *imaginary, int count) {
    json_t *root = json_object(), *list = json_array();
    json_object_set_new(root, "scene", json_string(motion->name));
    json_object_set_new(root, "formulation", json_string(name));
    for (int i = 0; i < count; i++)
        json_array_append_new(
            list, json_pack("{s:o, s:o}", "real", kt_json_number(real[i]), "imaginary", kt_json_number(imaginary[i])));
    json_object_set_new(root, "eigenvalues", list);
    return root;
}

int kt_modes_print_formulation(const kt_small_motion *motion, kt_constraint_formulation_type type, double alpha,
                               double beta, bool json) {
    const int count = 2 * kt_model_nv(motion->model);
    const char *name = kt_constraint_formulation_name(type);
    kt_constraint_formulation_options options = kt_constraint_formulation_options_default(type, 0.01);
    kt_constraint_formulation *formulation = NULL;
    kt_error error = {0};
    double *real = calloc(2 * (size_t)count + 1, sizeof *real), *imaginary = real != NULL ? real + count : NULL;
    options.alpha = isnan(alpha) ? options.alpha : alpha;
    options.beta = isnan(beta) ? options.alpha : beta;
    if (real == NULL)
        return kt_say_no_memory(NULL);
    kt_status status = kt_constraint_formulation_create(motion->model, &options, &formulation, &error);
    if (status == KT_OK)
        status = kt_constraint_formulation_spectrum(formulation, motion->data, 0.0, motion->q, motion->v, real,
                                                    imaginary, &error);
    int code = kt_say_status(status, &error);
    if (status == KT_OK)
        code = json ? kt_json_write(describe_formulation_modes(motion, name, real, imaginary, count), "-")
                    : print_formulation_table(motion, name, real, imaginary, count);
    kt_constraint_formulation_free(formulation);
    free(real);
    return code;
}
