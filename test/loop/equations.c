/* phi, phi' and phi'' of every type, on its manifold and far off it, against the same equations written from the
 * relative pose in jets (moving.c): the Jacobian, b' and b'' at once. */
#include "moving.h"

#include <float.h>

#define EPS DBL_EPSILON

KT_TEST(rows_give_the_equations_and_their_rates) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
        if (kt_loop_kinds_baseline[type]->rows == 0)
            continue;
        kt_worst residual = kt_worst_make(kt_loop_type_name((kt_loop_type)type));
        kt_worst first = kt_worst_make("  phi'"), second = kt_worst_make("  phi''");
        for (int n = 0; n < 2000; n++) {
            double numbers[MOVING_NUMBERS];
            const kt_loop_record loop = moving_loop(&random, type, numbers);
            const double t = kt_random_uniform(&random, 0.0, 5.0);
            const moving a = moving_random(&random, 2.0), b = moving_random(&random, 2.0);
            kt_v4 acceleration[2][2];
            const kt_loop_end end[2] = {moving_end(&a, acceleration[0]), moving_end(&b, acceleration[1])};
            kt_loop_row rows[KT_LOOP_ROW_MAX];
            jet phi[6];
            const int count = kt_loop_kinds_baseline[type]->evaluate(&loop, numbers, end, t, rows);
            if (count != moving_equations(&loop, t, &a, &b, phi))
                kt_check_true("count", false);
            for (int k = 0; k < count; k++) {
                const moving_rates rates = moving_rates_of(&rows[k], end, acceleration);
                const double m = sqrt(kt_v4_dot(rows[k].moment, rows[k].moment)), s = 1.0 + m;
                if (rows[k].holonomic)
                    kt_worst_near(&residual, rows[k].residual, (double)phi[k].x, 1e-14 * s, "n %d row %d m %g", n, k,
                                  m);
                kt_worst_near(&first, rates.first, (double)phi[k].d, 1e-13 * s, "n %d row %d m %g", n, k, m);
                kt_worst_near(&second, rates.second, (double)phi[k].dd, 1e-12 * s * s, "n %d row %d m %g", n, k, m);
            }
        }
        if (residual.count)
            kt_check_worst(&residual);
        kt_check_worst(&first);
        kt_check_worst(&second);
    }
}
