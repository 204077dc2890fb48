/* The shared library loads OpenBLAS, whose threads start with it, when a model first needs it and not before. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"
#include "kinetree/experimental.h"
#include "kinetree/kinetree.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static int count_threads(void) {
    DIR *folder = opendir("/proc/self/task");
    int count = 0;
    for (struct dirent *entry; folder != NULL && (entry = readdir(folder)) != NULL;)
        count += entry->d_name[0] != '.';
    if (folder != NULL)
        closedir(folder);
    return count;
}

static bool has_loaded(const char *name) {
    char line[4352];
    FILE *maps = fopen("/proc/self/maps", "r");
    bool found = false;
    while (maps != NULL && fgets(line, sizeof line, maps) != NULL)
        found = found || strstr(line, name) != NULL;
    if (maps != NULL)
        fclose(maps);
    return found;
}

enum { LINKS_MOST = 64 };

/* A chain of so many links of 1 m, the ends of which stay where they are at the start: an arc of a circle. */
static kt_model *compile_rope(int links, kt_reduction reduction) {
    static kt_body bodies[LINKS_MOST];
    static char names[LINKS_MOST][8];
    kt_vec3 end = {0.0, 0.0, 0.0};
    double direction = 0.0;
    for (int i = 0; i < links; i++) {
        const double turn = i == 0 ? 0.5 : -1.0 / links;
        snprintf(names[i], sizeof names[i], "link%d", i);
        bodies[i] = kt_body_of(names[i], i > 0 ? names[i - 1] : NULL, KT_JOINT_REVOLUTE, 1.0);
        bodies[i].joint.at = kt_vec3_make(i > 0 ? 1.0 : 0.0, 0.0, 0.0);
        bodies[i].joint.position[0] = turn;
        bodies[i].com = kt_vec3_make(0.5, 0.0, 0.0);
        bodies[i].inertia.yy = bodies[i].inertia.zz = 1.0 / 12.0;
        direction += turn;
        end = kt_vec3_add(end, kt_vec3_make(cos(direction), sin(direction), 0.0));
    }
    kt_loop loop = kt_loop_of("end", KT_LOOP_SPHERICAL);
    loop.between[0].body = names[links - 1];
    loop.between[0].at = kt_vec3_make(1.0, 0.0, 0.0);
    loop.between[1].at = end;
    kt_description rope = kt_description_default();
    rope.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    kt_describe(&rope, bodies, links, &loop, 1, NULL, 0);
    kt_model_options options = kt_model_options_default();
    options.reduction = kt_reduction_method_of(reduction);
    options.structure = KT_STRUCTURE_DENSE; /* link by link nothing here would need OpenBLAS */
    kt_model *model = NULL;
    kt_error error = {0};
    if (!kt_check_equal_int("compiled", kt_model_compile(&rope, &options, &model, &error), KT_OK))
        kt_note("%s: %s", error.where, error.message);
    return model;
}

/* a: the accelerations at the end of a tenth of a second. */
static void run(const kt_model *model, double *a) {
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    if (model == NULL)
        return;
    kt_check_equal_int("made", kt_simulation_create(model, NULL, NULL, &simulation, &error), KT_OK);
    if (simulation == NULL)
        return;
    kt_check_equal_int("run", kt_simulation_advance(simulation, 0.1, &error), KT_OK);
    kt_check_equal_int("accelerations", kt_simulation_acceleration(simulation, a, &error), KT_OK);
    kt_simulation_free(simulation);
}

/* The tests run in this order, as a loaded library stays. */
KT_TEST(program_that_needs_no_lapack_has_one_thread) {
    double a[LINKS_MOST];
    kt_check_true("version", kt_version() != NULL);
    kt_check_equal_int("threads of a program that asks for the version", count_threads(), 1);
    kt_model *model = compile_rope(5, KT_REDUCTION_QR);
    run(model, a);
    kt_model_free(model);
    kt_check_equal_int("threads after a small mechanism with a loop", count_threads(), 1);
    kt_check_true("OpenBLAS is not loaded", !has_loaded("openblas"));
}

KT_TEST(derivatives_of_a_small_mechanism_need_no_lapack) {
    double d[3][25], q[5], v[5];
    kt_model *model = compile_rope(5, KT_REDUCTION_QR);
    kt_data *data = NULL;
    kt_error error = {0};
    static _Alignas(KT_ALIGNMENT) char memory[1 << 16];
    if (model == NULL || kt_data_create(model, &data, &error) != KT_OK)
        return;
    kt_model_initial(model, q, v);
    kt_check_equal_int("assembled", kt_state_assemble(model, data, 0.0, q, v, &error), KT_OK);
    const kt_status status = kt_acceleration_derivatives(model, data, memory, sizeof memory, 0.0, q, v, NULL, NULL,
                                                         d[0], d[1], d[2], &error);
    if (!kt_check_equal_int("derivatives", status, KT_OK))
        kt_note("%s: %s", error.where, error.message);
    kt_check_true("OpenBLAS is not loaded", !has_loaded("openblas"));
    kt_data_free(data);
    kt_model_free(model);
}

KT_TEST(wide_group_loads_lapack_and_agrees_with_partitioning) {
    double qr[LINKS_MOST] = {(double)NAN}, partition[LINKS_MOST] = {(double)NAN}, largest = 0.0;
    kt_model *other = compile_rope(48, KT_REDUCTION_PARTITION);
    run(other, partition);
    kt_check_true("partitioning needs no OpenBLAS", !has_loaded("openblas"));
    kt_model *wide = compile_rope(48, KT_REDUCTION_QR);
    kt_check_true("the module is loaded when the model is compiled", has_loaded("kinetree-lapack"));
    run(wide, qr);
    for (int i = 0; i < 48; i++)
        largest = fmax(largest, fabs(partition[i]));
    KT_WORST error = kt_worst_make("acceleration");
    for (int i = 0; i < 48; i++) /* 1e-9, the tolerance of both runs, ten times */
        kt_worst_near(&error, qr[i], partition[i], 1e-8 * largest, "link %d", i);
    kt_model_free(wide);
    kt_model_free(other);
}

KT_TEST(reduction_by_singular_values_agrees_with_qr) {
    double qr[8] = {(double)NAN}, svd[8] = {(double)NAN};
    kt_model *model = compile_rope(5, KT_REDUCTION_QR), *other = compile_rope(5, KT_REDUCTION_SVD);
    run(model, qr);
    run(other, svd);
    KT_WORST error = kt_worst_make("acceleration");
    for (int i = 0; i < 5; i++)
        kt_worst_near(&error, svd[i], qr[i], 1e-11 * (fabs(qr[i]) + 1.0), "link %d", i);
    kt_model_free(other);
    kt_model_free(model);
}
