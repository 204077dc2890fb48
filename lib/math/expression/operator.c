/* Values of the operators and functions of formulas. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/expression.h"

#include "algebra/elementary.h"

#include <math.h>

/* The result of an operator of two values. */
static double value_of_two(kt_operator code, double x, double y) {
    switch (code) {
    case KT_OPERATOR_ADD:
        return x + y;
    case KT_OPERATOR_SUBTRACT:
        return x - y;
    case KT_OPERATOR_MULTIPLY:
        return x * y;
    case KT_OPERATOR_DIVIDE:
        return x / y;
    case KT_OPERATOR_POWER:
        return pow(x, y);
    case KT_OPERATOR_LESS:
        return x < y;
    case KT_OPERATOR_LESS_EQUAL:
        return x <= y;
    case KT_OPERATOR_GREATER:
        return x > y;
    case KT_OPERATOR_GREATER_EQUAL:
        return x >= y;
    case KT_OPERATOR_EQUAL:
        return x == y;
    case KT_OPERATOR_NOT_EQUAL:
        return x != y;
    case KT_OPERATOR_ATAN2:
        return atan2(x, y);
    case KT_OPERATOR_MIN:
        return x <= y || isnan(x) ? x : y;
    case KT_OPERATOR_MAX:
        return x >= y || isnan(x) ? x : y;
    case KT_OPERATOR_HYPOT:
        return kt_hypot(x, y);
    default:
        return (double)NAN; /* unreachable: the reader writes only these codes */
    }
}

/* The result of an operator or function of one value. */
static double value_of_one(kt_operator code, double x) {
    switch (code) {
    case KT_OPERATOR_NEGATE:
        return -x;
    case KT_OPERATOR_SIN:
        return sin(x);
    case KT_OPERATOR_COS:
        return cos(x);
    case KT_OPERATOR_TAN:
        return tan(x);
    case KT_OPERATOR_ASIN:
        return asin(x);
    case KT_OPERATOR_ACOS:
        return acos(x);
    case KT_OPERATOR_ATAN:
        return atan(x);
    case KT_OPERATOR_SINH:
        return sinh(x);
    case KT_OPERATOR_COSH:
        return cosh(x);
    case KT_OPERATOR_TANH:
        return tanh(x);
    case KT_OPERATOR_EXP:
        return exp(x);
    case KT_OPERATOR_LOG:
        return log(x);
    case KT_OPERATOR_SQRT:
        return sqrt(x);
    case KT_OPERATOR_ABS:
        return fabs(x);
    case KT_OPERATOR_SIGN:
        return kt_sign_of(x);
    case KT_OPERATOR_STEP:
        return x >= 0.0;
    default:
        return (double)NAN; /* unreachable: the reader writes only these codes */
    }
}

double kt_operator_value(kt_operator code, double x, double y) {
    return kt_operator_is_binary(code) ? value_of_two(code, x, y) : value_of_one(code, x);
}
