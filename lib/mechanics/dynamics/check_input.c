/* Checks of inputs: numbers that are not finite, and quaternions of zeros. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "joint/joint.h"

static double wrench_excess_of(const kt_wrench *w) {
    return (w->moment.x - w->moment.x) + (w->moment.y - w->moment.y) + (w->moment.z - w->moment.z) +
           (w->force.x - w->force.x) + (w->force.y - w->force.y) + (w->force.z - w->force.z);
}

static bool input_wrench_is_finite(const kt_wrench *w) { return wrench_excess_of(w) == 0.0; }

bool kt_wrenches_are_finite(const kt_model *model, const kt_wrench *external) {
    double sum = 0.0;
    for (size_t b = 1; b < model->n.body; b++)
        sum += wrench_excess_of(&external[b]);
    return sum == 0.0;
}

/* A body's joint. */
static kt_where_text name_joint_at_fault(const kt_model *model, size_t body) {
    return kt_where_format("joint '%.100s'", kt_joint_name(model, (int)body));
}

/* Reports the first of `count` numbers that is not finite; one of them is not. */
static kt_status reject_numbers(const kt_model *model, size_t body, const char *what, const double *x, int count,
                                kt_error *error) {
    int k = 0;
    while (k + 1 < count && isfinite(x[k]))
        k++;
    const kt_where_text where = name_joint_at_fault(model, body);
    if (count == 1)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, where.text, "its %s is %g; give a finite number", what, x[k]);
    return kt_error_set(error, KT_ERROR_NOT_FINITE, where.text, "its %s[%d] is %g; give a finite number", what, k,
                        x[k]);
}

static bool quaternion_is_zero(const kt_body_record *b, const double *q) {
    const int quaternion = kt_joint_quaternion((kt_joint_type)b->type);
    int k = 0;
    while (quaternion >= 0 && k < 4 && q[b->q + quaternion + k] == 0.0)
        k++;
    return k == 4;
}

static kt_status check_input_quaternion(const kt_model *model, size_t body, const double *q, kt_error *error) {
    if (!quaternion_is_zero(&model->body[body], q))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_ARGUMENT, name_joint_at_fault(model, body).text,
                        "its quaternion is zero, which is no rotation; give one of norm 1 (1, 0, 0, 0: not turned)");
}

/* Finds the input at fault body by body, for the message. */
static kt_status blame_input(const kt_model *model, const kt_input *in, kt_error *error) {
    for (size_t i = 1; i < model->n.body; i++) {
        const kt_body_record *b = &model->body[i];
        const size_t nq = (size_t)kt_joint_sizes[b->type].nq, nv = (size_t)kt_joint_sizes[b->type].nv;
        if (!kt_all_finite(in->q + b->q, nq))
            return reject_numbers(model, i, "position", in->q + b->q, (int)nq, error);
        if (in->v && !kt_all_finite(in->v + b->v, nv))
            return reject_numbers(model, i, "velocity", in->v + b->v, (int)nv, error);
        if (in->x && !kt_all_finite(in->x + b->v, nv))
            return reject_numbers(model, i, in->what, in->x + b->v, (int)nv, error);
        const kt_status status = check_input_quaternion(model, i, in->q, error);
        if (status != KT_OK)
            return status;
        if (in->external && !input_wrench_is_finite(&in->external[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE,
                                kt_where_format("body '%.100s'", kt_body_name(model, (int)i)).text,
                                "the external wrench on it is not finite; give finite numbers");
    }
    return KT_OK;
}

kt_status kt_input_check(const kt_model *model, const kt_input *in, kt_error *error) {
    bool fine = !in->external && kt_all_finite(in->q, model->n.q) && (!in->v || kt_all_finite(in->v, model->n.v)) &&
                (!in->x || kt_all_finite(in->x, model->n.v));
    for (size_t i = 1; fine && model->n.q > model->n.v && i < model->n.body; i++) /* there are quaternions */
        fine = !quaternion_is_zero(&model->body[i], in->q);
    return fine ? KT_OK : blame_input(model, in, error);
}

kt_status kt_input_reject_not_finite(const kt_model *model, double t, const kt_input *in, kt_error *error) {
    const kt_status status = kt_input_check(model, in, error);
    return status != KT_OK ? status
                           : kt_error_set(error, KT_ERROR_NOT_FINITE, kt_where_format("t = %.9g s", t).text,
                                          "a position or velocity is huge");
}

kt_status kt_columns_check(size_t n, int columns, const double *x, kt_error *error) {
    if (columns < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "columns", "%d columns are not possible; give 0 or more",
                            columns);
    const size_t count = n * (size_t)columns;
    if (!x && count > 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "x", "it is NULL; give %lu numbers", (unsigned long)count);
    for (size_t i = 0; i < count; i++)
        if (!(fabs(x[i]) <= KT_COLUMN_MOST))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, "x",
                                "number %lu of column %lu is %g; give finite numbers up to %g", (unsigned long)(i % n),
                                (unsigned long)(i / n), x[i], KT_COLUMN_MOST);
    return KT_OK;
}

/* Returns the first body on a spherical or free joint that nothing resists turning about an axis: a rod without a
 * radius. NULL: there is none. */
static const char *find_slender_body(const kt_model *model) {
    for (size_t i = 1; i < model->n.body; i++) {
        const kt_body_record *body = &model->body[i];
        const kt_const_sym3 j = body->inertia;
        const double trace = j.xx + j.yy + j.zz;
        const double det = j.xx * (j.yy * j.zz - j.yz * j.yz) - j.xy * (j.xy * j.zz - j.yz * j.xz) +
                           j.xz * (j.xy * j.yz - j.yy * j.xz);
        if ((body->type == KT_JOINT_SPHERICAL || body->type == KT_JOINT_FREE) && trace > 0.0 &&
            det <= 1e-12 * trace * trace * trace)
            return model->text + body->name;
    }
    return NULL;
}

kt_status kt_inertia_reject_motion(const kt_model *model, const char *where, kt_error *error) {
    const char *slender = find_slender_body(model);
    if (slender == NULL)
        return kt_error_set(error, KT_ERROR_SINGULAR, where,
                            "the mechanism has no positive inertia along one of the degrees of freedom that its loops "
                            "leave: give the bodies that move there mass or inertia");
    return kt_error_set(error, KT_ERROR_SINGULAR, where,
                        "the mechanism has no positive inertia along one of the degrees of freedom that its loops "
                        "leave: nothing resists a turn of '%.100s' about its own axis. Give its shape a 'radius', or "
                        "the body an inertia about that axis",
                        slender);
}
