/* Problems with exact solutions, and an integrator in memory of its own. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_PROBLEMS_H
#define KT_TEST_PROBLEMS_H

#include "fixture.h"

#include "kinetree/integrator.h"

typedef struct problem {
    const char *name;
    size_t n;
    double start, end;
    int (*rhs)(double t, const double *y, double *dydt, void *user);
    void (*solution)(double t, double *y);
} problem;

enum { PROBLEM_MAX = 5, HISTORY_MAX = 64 };

/* Whether the method evaluates the stages of its table, one by one: explicit, of one step, with a fixed
 * number of them. */
bool goes_by_its_table(const kt_method *method);

/* Nonlinear, not autonomous, closed form:
 *     y1' = 2 t y2^(1/5) y4, y2' = 10 t exp(5 (y3 - 1)) y4, y3' = 2 t y4, y4' = -2 t ln y1
 *     y = (exp(sin t^2), exp(5 sin t^2), 1 + sin t^2, cos t^2) */
extern const problem problem_chirp;

/* y' = 2 t (1 + y^2), y = tan(t^2 + 1/2): not autonomous, one equation. */
extern const problem problem_tangent;

/* The plane Kepler problem, eccentricity 0.2, one revolution and a half. */
extern const problem problem_kepler;

/* Van der Pol's oscillator, mu = 1e6; and y' = lambda (y - sin t) + cos t, whose solution through 0 is sin t, with
 * lambda in *user (Prothero and Robinson). Both stiff. */
int van_der_pol(double t, const double *y, double *dydt, void *user);
int forced(double t, const double *y, double *dydt, void *user);

/* An integrator in allocated memory, which the running test owns. A rejected one ends the test. */
kt_integrator *integrator_make(const kt_method *method, size_t n, kt_integrator_options options);

/* The same, started: from y at time t, or at the start of a problem. */
kt_integrator *integrator_start(const kt_method *method, size_t n, kt_integrator_options options,
                                int (*rhs)(double t, const double *y, double *dydt, void *user), void *user, double t,
                                const double *y);
kt_integrator *integrator_begin(const kt_method *method, const problem *p, kt_integrator_options options);

/* One step, and a value within the last step. False after a failed check. */
bool integrator_step(kt_integrator *integrator, double limit);
bool integrator_value(kt_integrator *integrator, double t, double *y);

kt_integrator_options fixed_step(double step);

/* The largest error of so many fixed steps of a method for the equation `forced` from t = 0.25 to 1.75. */
double forced_error(const kt_method *method, double lambda, int steps);
kt_integrator_options tolerance(double relative, double absolute);

/* Checks the order of these errors within `room`: `levels` times, with halved steps. */
void check_forced_order(const kt_method *method, double lambda, int first_steps, int levels, double order, double room);

/* Checks y1(2) of van_der_pol from (2, 0), and that there are few steps: an explicit method takes 1e6. */
kt_integrator_counts check_stiff_oscillator(const kt_method *method, double tol, double bound);

/* Checks y and the number of evaluations in each of four parts of `forced`, whose lambda is -1e5, -1, -1e5 and -1. The
 * caller knows the Jacobian in the first and in the last part. That of the first one misleads in the second, and serves
 * again in the third. */
void check_lost_jacobian(const kt_method *method, double evaluations, double bound);

/* Steps until t; whether all went well. */
bool integrate_to(kt_integrator *integrator, double t);

/* max_i |y_i - solution_i(t)|, and its largest at the ends of steps until the end of the problem */
double error_at(const problem *p, double t, const double *y);
double error_until_end(kt_integrator *integrator, const problem *p);

/* The same bits, without a word about it. */
bool same_bits(const double *a, const double *b, size_t count);

/* Least-squares slope of ln(error) over ln(h). */
double slope_of(const double *h, const double *error, int count);

#endif
