/* Every rule of a function of time, each broken once. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "check.h"
#include "mechanics/compile/mechanism.h"

static const double nan_value = (double)NAN, infinite = (double)INFINITY;

static fault_list faults_of(int loop, kt_function function) {
    mechanism m;
    mechanism_fill(&m);
    m.loops[loop].function = function;
    return mechanism_faults(&m.description);
}

static void rejects(kt_function function, const char *message) {
    kt_check_text("motion", faults_of(DRIVE, function).text, message);
}

static void rejects_length(kt_function function, const char *message) {
    kt_check_text("length", faults_of(ROD, function).text, message);
}

static void passes(const char *what, int loop, kt_function function) {
    kt_check_text(what, faults_of(loop, function).text, "");
}

#define AT_DRIVE "loop 3 -1 position | loop 'drive' | position"
#define AT_ROD "loop 1 -1 length | loop 'rod' | length"

KT_TEST(numbers_of_functions_are_finite) {
    rejects(kt_function_constant(nan_value), AT_DRIVE " is nan; give a finite number\n");
    rejects(kt_function_sine(nan_value, 1.0, 0.0, 0.0), AT_DRIVE ".sine.amplitude is nan; give a finite number\n");
    rejects(kt_function_sine(1.0, infinite, 0.0, 0.0), AT_DRIVE ".sine.frequency is inf; give a finite number\n");
    rejects(kt_function_sine(1.0, -1.0, 0.0, 0.0), AT_DRIVE ".sine.frequency is -1; it cannot be negative\n");
    rejects(kt_function_sine(1.0, 1.0, -infinite, 0.0), AT_DRIVE ".sine.phase is -inf; give a finite number\n");
    rejects(kt_function_sine(1.0, 1.0, 0.0, 1e60),
            AT_DRIVE ".sine.offset is 1e+60, and the equations would overflow; magnitudes end at 1e+50\n");
    rejects(kt_function_ramp(nan_value, 1.0, 0.0, 1.0), AT_DRIVE ".ramp.from is nan; give a finite number\n");
    rejects(kt_function_ramp(0.0, nan_value, 0.0, 1.0), AT_DRIVE ".ramp.to is nan; give a finite number\n");
    rejects(kt_function_ramp(0.0, 1.0, nan_value, 1.0), AT_DRIVE ".ramp.start is nan; give a finite number\n");
    rejects(kt_function_ramp(0.0, 1.0, 0.0, nan_value), AT_DRIVE ".ramp.end is nan; give a finite number\n");
    const double coefficients[] = {1.0, nan_value, 2.0};
    rejects(kt_function_polynomial(coefficients, 3), AT_DRIVE ".polynomial[1] is nan; give a finite number\n");
    const double rows[] = {0.0, 1.0, 1.0, 2.0, nan_value, 3.0}, heights[] = {0.0, 1.0, 1.0, infinite};
    rejects(kt_function_table(rows, 6, KT_INTERPOLATION_CUBIC), AT_DRIVE ".table[2][0] is nan; give a finite number\n");
    rejects(kt_function_table(heights, 4, KT_INTERPOLATION_CUBIC),
            AT_DRIVE ".table[1][1] is inf; give a finite number\n");
}

KT_TEST(all_wrong_numbers_of_a_function_are_told) {
    rejects(kt_function_sine(nan_value, nan_value, nan_value, nan_value), AT_DRIVE
            ".sine.amplitude is nan; give a finite number\n" AT_DRIVE
            ".sine.frequency is nan; give a finite number\n" AT_DRIVE
            ".sine.phase is nan; give a finite number\n" AT_DRIVE ".sine.offset is nan; give a finite number\n");
    rejects(kt_function_ramp(nan_value, nan_value, nan_value, nan_value), AT_DRIVE
            ".ramp.from is nan; give a finite number\n" AT_DRIVE ".ramp.to is nan; give a finite number\n" AT_DRIVE
            ".ramp.start is nan; give a finite number\n" AT_DRIVE ".ramp.end is nan; give a finite number\n");
}

KT_TEST(ramps_end_after_they_start) {
    rejects(kt_function_ramp(0.0, 1.0, 2.0, 2.0), AT_DRIVE ".ramp starts at 2 and ends at 2; it must end later\n");
    rejects(kt_function_ramp(0.0, 1.0, 2.0, 1.5), AT_DRIVE ".ramp starts at 2 and ends at 1.5; it must end later\n");
    rejects(kt_function_ramp(0.0, 1.0, 0.0, 1e-60),
            AT_DRIVE ".ramp starts at 0 and ends at 9.9999999999999997e-61; it must end later\n");
    rejects(kt_function_ramp(nan_value, 1.0, 2.0, 1.5),
            AT_DRIVE ".ramp.from is nan; give a finite number\n" AT_DRIVE
                     ".ramp starts at 2 and ends at 1.5; it must end later\n");
    passes("ramp downwards", DRIVE, kt_function_ramp(1.0, 0.0, -2.0, 1.5));
    passes("ramp that stays", DRIVE, kt_function_ramp(1.0, 1.0, 0.0, 1.0));
}

KT_TEST(lists_of_functions_can_be_read) {
    static const double numbers[] = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
    rejects(kt_function_polynomial(numbers, 0), AT_DRIVE ".polynomial has no coefficients; give c0, c1, ...\n");
    rejects(kt_function_polynomial(NULL, 2), AT_DRIVE ".polynomial has no coefficients; give c0, c1, ...\n");
    passes("polynomial of degree 0", DRIVE, kt_function_polynomial(numbers, 1));
    rejects(kt_function_table(numbers, 2, KT_INTERPOLATION_LINEAR), AT_DRIVE ".table needs two rows [t, y] or more\n");
    rejects(kt_function_table(NULL, 4, KT_INTERPOLATION_LINEAR), AT_DRIVE ".table needs two rows [t, y] or more\n");
    rejects(kt_function_table(numbers, 5, KT_INTERPOLATION_LINEAR),
            AT_DRIVE ".table has 5 numbers; rows are pairs of t and y\n");
    rejects(kt_function_table(numbers, 6, (kt_interpolation)3),
            AT_DRIVE ".interpolation is 3; there are linear (0), cubic (1) and monotone (2)\n");
    passes("two rows", DRIVE, kt_function_table(numbers, 4, KT_INTERPOLATION_CUBIC));
    kt_function unknown = kt_function_constant(1.0);
    unknown.type = (kt_function_type)10;
    rejects(unknown,
            AT_DRIVE " has function type 10, and there is none of that number; take one of kt_function_type\n");
}

KT_TEST(functions_made_of_others_are_whole) {
    const kt_function parts[] = {kt_function_constant(1.0), kt_function_ramp(0.0, 1.0, 2.0, 2.0), {.text = NULL}};
    kt_function deep[6] = {kt_function_constant(1.0)};
    rejects(kt_function_bump(1.0, 2.0, 2.0), AT_DRIVE ".bump starts at 2 and ends at 2; it must end later\n");
    rejects(kt_function_sum(parts, 0), AT_DRIVE ".sum has no functions; give one or more\n");
    rejects(kt_function_product(NULL, 1), AT_DRIVE ".product has no functions; give one or more\n");
    rejects(kt_function_sum(parts, 2), AT_DRIVE ".ramp starts at 2 and ends at 2; it must end later\n");
    rejects(kt_function_product(parts + 2, 1), AT_DRIVE ": part 0 is no function\n");
    rejects(kt_function_expression(NULL), AT_DRIVE " has no formula; give it as text\n");
    rejects(kt_function_expression("2*s"), AT_DRIVE ": there is no name 's'; names are t (column 3 of '2*s')\n");
    for (int i = 1; i < 6; i++)
        deep[i] = kt_function_sum(&deep[i - 1], 1);
    rejects(deep[5], AT_DRIVE ".sum is within too many others; put fewer of them into one another\n");
    passes("four deep", DRIVE, deep[4]);
    passes("formula", ROD, kt_function_expression("2 + sin(t)"));
}

KT_TEST(times_of_tables_increase) {
    const double equal[] = {0.0, 1.0, 1.0, 2.0, 1.0, 3.0}, back[] = {0.0, 1.0, -0.5, 2.0};
    const double close[] = {0.0, 1.0, 1e-60, 2.0};
    rejects(kt_function_table(equal, 6, KT_INTERPOLATION_LINEAR),
            AT_DRIVE ".table[2] has time 1 after 1; times must increase\n");
    rejects(kt_function_table(back, 4, KT_INTERPOLATION_LINEAR),
            AT_DRIVE ".table[1] has time -0.5 after 0; times must increase\n");
    rejects(kt_function_table(close, 4, KT_INTERPOLATION_LINEAR),
            AT_DRIVE ".table[1] has time 9.9999999999999997e-61 after 0; times must increase\n");
}

KT_TEST(lengths_stay_greater_than_zero) {
    rejects_length(kt_function_constant(0.0), AT_ROD " is 0; it must be greater than 0\n");
    rejects_length(kt_function_constant(nan_value), AT_ROD " is nan; give a finite number\n");
    rejects_length(kt_function_sine(1.0, 1.0, 0.0, 0.75), AT_ROD " falls to -0.25; it must stay greater than 0\n");
    rejects_length(kt_function_sine(-1.0, 1.0, 0.0, 1.0), AT_ROD " falls to 0; it must stay greater than 0\n");
    rejects_length(kt_function_ramp(1.0, -2.0, 0.0, 1.0), AT_ROD " falls to -2; it must stay greater than 0\n");
    rejects_length(kt_function_ramp(0.0, 2.0, 0.0, 1.0), AT_ROD " falls to 0; it must stay greater than 0\n");
    const double numbers[] = {-0.5, 1.0, 2.0, -3.0};
    rejects_length(kt_function_polynomial(numbers, 4), AT_ROD " falls to -0.5; it must stay greater than 0\n");
    rejects_length(kt_function_table(numbers, 4, KT_INTERPOLATION_LINEAR),
                   AT_ROD " falls to -3; it must stay greater than 0\n");
    passes("not given", ROD, (kt_function){.type = KT_FUNCTION_NONE});
    passes("sine above zero", ROD, kt_function_sine(-1.0, 1.0, 0.0, 1.25));
    passes("sine that stands still above zero", ROD, kt_function_sine(-1.0, 0.0, -1.5, 0.1));
    rejects_length(kt_function_sine(1.0, 0.0, -0.0, 0.0), AT_ROD " falls to 0; it must stay greater than 0\n");
    passes("ramp above zero", ROD, kt_function_ramp(1.0, 0.5, 0.0, 1.0));
    const double rows[] = {-1.0, 1.0, 0.0, 2.0};
    passes("table above zero", ROD, kt_function_table(rows, 4, KT_INTERPOLATION_LINEAR));
    passes("polynomial that starts above zero", ROD, kt_function_polynomial(rows + 1, 2));
}

/* The sign of a function is checked only if the function can be evaluated. Each of these would fall below zero. */
KT_TEST(a_wrong_function_has_no_least_value) {
    static const double coefficients[] = {-1.0, (double)NAN}, rows[] = {0.0, -1.0, 0.0, -2.0, 1.0};
    const kt_function functions[] = {
        kt_function_sine(nan_value, 1.0, 0.0, -1.0),
        kt_function_sine(1.0, nan_value, 0.0, -1.0),
        kt_function_sine(1.0, -1.0, 0.0, -1.0),
        kt_function_sine(1.0, 1.0, nan_value, -1.0),
        kt_function_sine(1.0, 1.0, 0.0, nan_value),
        kt_function_ramp(nan_value, -1.0, 0.0, 1.0),
        kt_function_ramp(-1.0, nan_value, 0.0, 1.0),
        kt_function_ramp(-1.0, 1.0, nan_value, 1.0),
        kt_function_ramp(-1.0, 1.0, 0.0, nan_value),
        kt_function_ramp(-1.0, 1.0, 1.0, 0.0),
        kt_function_polynomial(coefficients, 2),
        kt_function_polynomial(coefficients, 0),
        kt_function_table(rows, 4, KT_INTERPOLATION_LINEAR),
        kt_function_table(rows, 5, KT_INTERPOLATION_LINEAR),
        kt_function_table(rows, 2, KT_INTERPOLATION_LINEAR),
        kt_function_table(rows, 4, (kt_interpolation)7),
        kt_function_constant(nan_value),
    };
    for (size_t i = 0; i < sizeof functions / sizeof *functions; i++)
        kt_check_equal_int("faults", faults_of(ROD, functions[i]).count, 1);
}
