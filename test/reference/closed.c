/* SPDX-License-Identifier: Apache-2.0 */
#include "closed.h"

#include "kinetree/study.h"

#include <math.h>

void kt_closed_compile(kt_case *c, kt_reduction reduction, kt_metric metric) {
    kt_model_options options = kt_model_options_default();
    options.reduction = kt_reduction_method_of(reduction);
    options.metric = metric;
    c->model = kt_test_model(&c->scene.description, &options);
}

kt_case kt_closed_open(const char *name, kt_reduction reduction, kt_metric metric) {
    kt_note("%s, %s, %s", name, kt_reduction_name(reduction), kt_metric_name(metric));
    kt_case c = kt_case_open(name);
    kt_closed_compile(&c, reduction, metric);
    return c;
}

kt_vec3 kt_closed_place(const kt_case *c, const kt_record *record, const char *body, const char *marker) {
    const int b = kt_body_find(c->model, body), m = b < 0 ? -1 : kt_marker_find(c->model, b, marker);
    if (m < 0) {
        kt_note("there is no marker %s.%s", body, marker);
        (void)kt_check_true("marker", false);
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    }
    return kt_point_position(c->model, record->data, b, kt_marker_at(c->model, b, m));
}

double kt_closed_q(const kt_case *c, const kt_record *record, const char *joint) {
    return record->q[kt_case_q(c, joint)];
}

double kt_closed_v(const kt_case *c, const kt_record *record, const char *joint) {
    return record->v[kt_case_v(c, joint)];
}
