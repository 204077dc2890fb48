/* The points of a flexcomp: their names, and their places in formulas. */
#include "algebra/parts.h"
#include "robot/mjcf_elastic.h"

#include <math.h>
#include <stdio.h>

const char *kt_flex_name_point(kt_mjcf *m, const kt_flex *f, int i, const char *suffix) {
    char text[48];
    (void)snprintf(text, sizeof text, "_%d%s", i, suffix);
    return kt_mjcf_join(m, f->element, f->name, text);
}

static kt_vec3 rest_of_point(const kt_flex *f, int i) {
    return kt_vec3_make(f->points[i].at[0], f->points[i].at[1], f->points[i].at[2]);
}

kt_vec3 kt_elastic_span(const kt_flex *f, int from, int to) {
    return kt_vec3_sub(rest_of_point(f, to), rest_of_point(f, from));
}

int kt_elastic_put_point(const kt_mjcf *m, const kt_elastic *p, int point, int axis, bool is_rate, double factor,
                         double *constant, kt_mjcf_formula *to) {
    int count = 0;
    *constant += factor * p->f->points[point].at[axis];
    if (p->body[point] < 0)
        return 0;
    const kt_mjcf_body *b = kt_mjcf_body_at(m, p->body[point]);
    for (int k = 0; k < b->joint_count; k++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, b->first_joint + k);
        const double s = factor * kt_vec3_part(kt_vec3_normalize(j->axis), axis);
        if (s == 0.0)
            continue;
        *constant -= s * j->ref;
        kt_mjcf_put(to, s < 0.0 ? " - " : " + ");
        kt_mjcf_put_coordinate(to, fabs(s), is_rate ? "velocity" : "position", j->name);
        count++;
    }
    return count;
}

void kt_elastic_put_span(const kt_mjcf *m, const kt_elastic *p, const int ends[2], int axis, bool is_rate,
                         kt_mjcf_formula *to) {
    double constant = 0.0;
    kt_mjcf_formula terms = {.whole = true};
    (void)kt_elastic_put_point(m, p, ends[1], axis, is_rate, 1.0, &constant, &terms);
    (void)kt_elastic_put_point(m, p, ends[0], axis, is_rate, -1.0, &constant, &terms);
    kt_mjcf_print(to, "(%g%s)", is_rate ? 0.0 : constant, terms.text);
}

kt_effect *kt_elastic_add(kt_mjcf *m, const kt_flex *f, const kt_mjcf_formula *formula) {
    return kt_mjcf_add_formula(m, f->element, formula, "elasticity of a flexcomp that is too long for a formula");
}
