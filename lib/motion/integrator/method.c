/* The properties of a method that its family determines. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

const kt_method_family *kt_method_family_of(const kt_method *method) {
    return method->family != NULL ? method->family : &kt_family_explicit;
}

const char *kt_method_family_name(const kt_method *method) { return method ? kt_method_family_of(method)->name : NULL; }

bool kt_method_is_implicit(const kt_method *method) { return method ? kt_method_family_of(method)->implicit : false; }

bool kt_method_needs_newton(const kt_method *method) {
    const kt_method_family *family = kt_method_family_of(method);
    return family->implicit || family->switches;
}

bool kt_method_stages_vary(const kt_method *method) {
    return method ? kt_method_family_of(method)->stages_max > 0 : false;
}

kt_status kt_method_check_sizes(const kt_method *method, kt_error *error) {
    if (method == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "method",
                            "no method is given; kt_method_find finds methods by name");
    return kt_method_family_of(method)->check_sizes(method, error);
}
