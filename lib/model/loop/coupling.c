/* Coupling: sum of coefficient * position + formula = offset; gears, pulleys, mimic joints, cams. The contribution of
 * the formula depends on all positions of the equation and is evaluated by constraint/formula_row.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/loop.h"

#include "model/formula_names.h"

static kt_relation_row coupling_relation(const kt_loop_record *loop, const double *numbers, double sum, double t) {
    double offset[3];
    kt_curve_evaluate(&loop->curve, numbers, t, offset);
    return (kt_relation_row){.residual = sum - offset[0], .closes = 1.0};
}

static size_t coupling_number_count(const kt_loop *loop) {
    return kt_loop_has_formula(loop) ? (kt_expression_size(loop->formula) + sizeof(double) - 1) / sizeof(double) : 0;
}

/* The formula has been parsed before, by the check of the description. */
static void prepare_coupling(const kt_description *description, const kt_loop *loop, double *numbers,
                             kt_loop_record *record) {
    kt_coupling_names names = {.description = description, .loop = loop};
    kt_symbols symbols = kt_coupling_symbols(&names);
    const kt_expression *formula;
    kt_error ignored;
    symbols.compiled = numbers; /* tables are the first numbers of a model */
    if (kt_loop_has_formula(loop) &&
        kt_expression_parse(loop->formula, &symbols, numbers + record->number, kt_expression_size(loop->formula),
                            &formula, NULL, &ignored) == KT_OK)
        record->form = 1;
}

const kt_loop_kind KT_KERNEL(kt_loop_coupling) = {
    .relate = coupling_relation, .number_count = coupling_number_count, .prepare = prepare_coupling};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"coefficients", KT_KEY_TERMS, KT_LOOP_AT(terms), "", "c_i, a mapping of joints of one coordinate to numbers",
     "none", .needed = false},
    {"formula", KT_KEY_FORMULA, KT_LOOP_AT(formula), "", "f, a formula of `position.JOINT` of such joints, as of a cam",
     "none", .needed = false},
    {"offset", KT_KEY_NUMBER, KT_LOOP_AT(offset), "rad|m", "the sum of all terms", .needed = false},
};
const kt_descriptor kt_loop_coupling_descriptor = {
    .name = "coupling",
    .help = "a relation of joint positions: gears, pulleys, joints that follow others; with a formula, cams",
    .formula = "sum of c_i q_i + f(q) = offset",
    .example = "bodies:\n"
               "  - name: pinion\n"
               "    joint: {type: revolute, axis: y}\n"
               "    mass: 1\n"
               "    shape: {type: rod, to: [0, 0, 0.1]}\n"
               "  - name: gear\n"
               "    joint: {type: revolute, axis: y, at: [0.4, 0, 0], position: 30 deg}\n"
               "    mass: 2\n"
               "    shape: {type: rod, to: [0, 0, 0.3]}\n"
               "loops:\n"
               "  - {name: mesh, type: coupling, coefficients: {pinion: 1, gear: 3}, offset: 90 deg}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
