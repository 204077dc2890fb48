/* SPDX-License-Identifier: Apache-2.0 */
#include "steep.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* x = a (t - b), r sin(w t + c), or their sum. */
static void write_argument(kt_random *random, char *text, size_t size) {
    const bool line = kt_random_int(random, 0, 2) > 0, wave = !line || kt_random_int(random, 0, 1) > 0;
    const double slope = exp(kt_random_uniform(random, -1.0, 7.0)), at = kt_random_uniform(random, 0.0, 10.0);
    const double range = exp(kt_random_uniform(random, -2.0, 3.4)), rate = exp(kt_random_uniform(random, 0.0, 5.7));
    (void)snprintf(text, size, "%.4g*(t - %.4g) + %.4g*sin(%.4g*t + %.4g)", line ? slope : 0.0, at, wave ? range : 0.0,
                   rate, at);
}

void kt_write_steep_formula(kt_random *random, char *text, size_t size) {
    static const char *const functions[] = {"exp(-(%s)^2)",  "tanh(%s)",        "exp(sin(%s))",
                                            "log(cosh(%s))", "1/(1 + exp(%s))", "sqrt(1 + (%s)^2)*sin(300*t)"};
    const int terms = kt_random_int(random, 1, 4);
    size_t end = 0;
    for (int k = 0; k < terms; k++) {
        char argument[128], term[192];
        write_argument(random, argument, sizeof argument);
        const char *function = functions[kt_random_int(random, 0, 5)], *hole = strstr(function, "%s");
        (void)snprintf(term, sizeof term, "%.*s%s%s", (int)(hole - function), function, argument, hole + 2);
        end += (size_t)snprintf(text + end, size - end, "%s%.4g*%s", k > 0 ? " + " : "",
                                kt_random_uniform(random, -8.0, 8.0), term);
    }
}
