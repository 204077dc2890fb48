/* Bodies whose mass is a function of time: their check, and their records in a model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "compile/compile.h"

void kt_checker_variable_mass(kt_checker *checker, const kt_body *body) {
    static const char *const names[6] = {"inertia[0]", "inertia[1]", "inertia[2]",
                                         "inertia[3]", "inertia[4]", "inertia[5]"};
    const kt_variable_mass *variable = body->variable_mass;
    if (variable == NULL)
        return;
    if (variable->mass.type == KT_FUNCTION_NONE)
        kt_checker_fault(checker, "mass", -1, "variable_mass has no mass; give its function of time");
    else
        kt_checker_positive_function(checker, "mass", &variable->mass);
    for (int k = 0; k < 6; k++)
        (void)kt_checker_function(checker, names[k], &variable->inertia[k]);
    if (body->mass == 0.0)
        kt_checker_fault(checker, "mass", -1,
                         "mass is 0 where its function of time begins; give the mass above 0 to which com and inertia "
                         "belong");
}

void kt_attach_count_masses(const kt_description *description, kt_counts *n) {
    for (int i = 0; i < description->body_count; i++) {
        const kt_variable_mass *variable = description->bodies[i].variable_mass;
        if (variable == NULL)
            continue;
        n->number += kt_curve_number_count(&variable->mass);
        for (int k = 0; k < 6; k++)
            n->number += kt_curve_number_count(&variable->inertia[k]);
    }
}

static kt_curve compile_curve(const kt_function *function, kt_model *m, size_t *number) {
    const kt_curve curve = kt_curve_compile(function, m->number, *number);
    *number += kt_curve_number_count(function);
    return curve;
}

void kt_attach_fill_masses(const kt_description *description, kt_model *m, size_t *number) {
    size_t count = 0;
    for (size_t b = 1; b < m->n.body; b++) {
        const kt_variable_mass *variable = description->bodies[m->body[b].source].variable_mass;
        if (variable == NULL)
            continue;
        kt_mass_record *r = &m->varying[count++];
        *r = (kt_mass_record){.body = (int32_t)b, .has_moments = kt_variable_mass_has_moments(variable)};
        r->curve[0] = compile_curve(&variable->mass, m, number);
        for (int k = 0; k < 6; k++)
            r->curve[1 + k] = compile_curve(&variable->inertia[k], m, number);
        for (size_t other = 1; other < m->n.body; other++)
            m->body[other].on_variable_link |= m->body[other].link == m->body[b].link;
    }
}
