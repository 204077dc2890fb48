/* Prints the figures of the exercises, chapter by chapter. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "notes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void tell(const char *exercise, double figure) { printf("%s %.17g\n", exercise, figure); }

double any(void) {
    static unsigned long long state = 20200309; /* the revision of the notes */
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(state >> 11) / 4503599627370496.0 - 1.0;
}

kt_vec3 any_vector(void) {
    const double x = any(), y = any();
    return kt_vec3_make(x, y, any());
}

kt_mat3 any_rotation(void) { return kt_mat3_from_quat(kt_quat_from_euler_vector(kt_vec3_scale(2.0, any_vector()))); }

double size_of(kt_vec3 a) { return sqrt(kt_vec3_dot(a, a)); }

double difference(kt_mat3 a, kt_mat3 b) {
    const kt_mat3 d = kt_mat3_add(a, kt_mat3_scale(-1.0, b));
    const double all[] = {d.x.x, d.x.y, d.x.z, d.y.x, d.y.y, d.y.z, d.z.x, d.z.y, d.z.z};
    double most = 0.0;
    for (int i = 0; i < 9; i++)
        most = fmax(most, fabs(all[i]));
    return most;
}

bool works(kt_status status, const kt_error *error) {
    if (status != KT_OK)
        fprintf(stderr, "%s: %s\n", error->where, error->message);
    return status == KT_OK;
}

bool open_mechanism(mechanism *m, const char *text) {
    kt_error e = {0};
    memset(m, 0, sizeof *m);
    if (!works(kt_scene_parse("scene", text, strlen(text), &m->scene, NULL, NULL, &e), &e) ||
        !works(kt_model_compile(&m->scene.description, NULL, &m->model, &e), &e) ||
        !works(kt_data_create(m->model, &m->data, &e), &e))
        return false;
    kt_model_initial(m->model, m->q, m->v);
    return works(kt_state_assemble(m->model, m->data, 0.0, m->q, m->v, &e), &e);
}

void close_mechanism(mechanism *m) {
    kt_data_free(m->data);
    kt_model_free(m->model);
    kt_scene_free(&m->scene);
}

int main(void) {
    const bool all = rotations() && dynamics() && integration() && constraints() && coordinates();
    return all ? EXIT_SUCCESS : EXIT_FAILURE;
}
