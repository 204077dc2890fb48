/* The properties of a method that its table determines without the family: sizes and orders. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

bool kt_method_is_adaptive(const kt_method *method) { return method ? method->embedded_order > 0 : false; }

double kt_method_error_order(const kt_method *method) {
    if (method->embedded_order_low > 0)
        return 2 * method->embedded_order - method->embedded_order_low + 1;
    return 1 + (method->embedded_order < method->order ? method->embedded_order : method->order);
}

/* The cubic through both states and slopes is exact to theta^3, but its order is at most the order of the states at its
 * ends.
 */
int kt_method_dense_order(const kt_method *method) {
    if (!method)
        return 0;
    if (method->dense_order > 0)
        return method->dense_order;
    return method->order < 3 ? method->order : 3;
}

kt_status kt_table_reject(const kt_method *method, kt_error *error, const char *message) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, method->name == NULL ? "method" : method->name, "%s", message);
}

kt_status kt_table_check_sizes(const kt_method *m, kt_error *error) {
    if (m->stages < 1 || m->stages > KT_METHOD_STAGES_MAX || m->dense_stages < 0 ||
        m->dense_stages > KT_METHOD_STAGES_MAX || kt_method_slots(m) > KT_METHOD_STAGES_MAX)
        return kt_table_reject(m, error,
                               "a method has 1 to 32 stages, those of the dense output and the new slope included");
    if (m->fsal && m->stages < 2)
        return kt_table_reject(m, error, "a method of one stage cannot be fsal");
    if (m->order < 1 || m->order > KT_METHOD_ORDER_MAX || m->embedded_order < 0 ||
        m->embedded_order > KT_METHOD_ORDER_MAX || m->embedded_order_low < 0 ||
        m->embedded_order_low > KT_METHOD_ORDER_MAX || m->dense_order < 0 || m->dense_order > KT_METHOD_ORDER_MAX)
        return kt_table_reject(m, error, "orders are 1 to 12; an embedded or dense order that is not there is 0");
    if (m->dense_terms < 0 || m->dense_terms > KT_METHOD_DENSE_TERMS_MAX)
        return kt_table_reject(m, error, "a dense output has 0 to 8 terms beyond the cubic");
    if (m->a == NULL || m->b == NULL || m->c == NULL)
        return kt_table_reject(m, error, "a, b and c must be given (a points anywhere if there is one stage)");
    if ((m->embedded_order > 0) != (m->e != NULL) || (m->embedded_order_low > 0) != (m->e_low != NULL) ||
        (m->e_low != NULL && m->e == NULL))
        return kt_table_reject(m, error, "error weights and embedded orders belong together: give both or neither");
    if ((m->dense_terms > 0) != (m->dense_d != NULL) ||
        (m->dense_stages > 0 && (m->dense_a == NULL || m->dense_c == NULL)))
        return kt_table_reject(m, error, "dense_terms > 0 needs dense_d, dense_stages > 0 needs dense_a and dense_c");
    return KT_OK;
}
