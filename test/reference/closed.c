#include "closed.h"

#include "kinetree/study.h"

#include <math.h>

bool kt_closed_compile(kt_case *c, kt_reduction reduction, kt_metric metric) {
    kt_model_options options = kt_model_options_default();
    kt_error error = {KT_OK, "", ""};
    options.reduction = kt_reduction_method_of(reduction);
    options.metric = metric;
    kt_model_free(c->model);
    c->model = NULL;
    return kt_fine("model", kt_model_compile(&c->scene.description, &options, &c->model, &error), &error);
}

bool kt_closed_open(kt_case *c, const char *name, kt_reduction reduction, kt_metric metric) {
    kt_note("%s, %s, %s", name, kt_reduction_name(reduction), kt_metric_name(metric));
    return kt_case_open(c, name) && kt_closed_compile(c, reduction, metric);
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
