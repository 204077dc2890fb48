/* The conditions that checks, random numbers and counts of allocations must meet. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "interpose.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include <lapacke.h>

KT_TEST(bounds_are_reached_but_not_passed) {
    kt_check_near("at the bound", 1.5, 1.0, 0.5);
    kt_check_near("equal, bound zero", 0.1, 0.1, 0.0);
    kt_check_below("at the bound", 2.0, 2.0);
    kt_check_above("at the bound", 2.0, 2.0);
    kt_check_equal_bits("one NaN", &(double){(double)NAN}, &(double){(double)NAN}, 1);
}

/* The first outputs from the state `(1, 2, 3, 4)`, worked out by hand from the definition `rotl(5 s1, 7) 9`:
 *   s1 = 2:                                       10 * 2^7 * 9 = 11520
 *   s1 = 2 ^ (3 ^ 1) = 0:                         0
 *   s1 = (3 ^ 1 ^ 2 * 2^17) ^ (1 ^ 4 ^ 2) = 2^18 + 5:  5 (2^18 + 5) * 2^7 * 9 = 1509978240 */
KT_TEST(generator_is_xoshiro256) {
    kt_random random = {{1, 2, 3, 4}};
    kt_check_equal_int("first", (long long)kt_random_bits(&random), 11520);
    kt_check_equal_int("second", (long long)kt_random_bits(&random), 0);
    kt_check_equal_int("third", (long long)kt_random_bits(&random), 1509978240);
}

KT_TEST(streams_depend_on_their_name_alone) {
    kt_random a = kt_random_named("a"), again = kt_random_named("a"), b = kt_random_named("b");
    uint64_t first = kt_random_bits(&a);
    kt_check_true("the same name", first == kt_random_bits(&again));
    kt_check_true("another name", first != kt_random_bits(&b));
    kt_random own = kt_random_of_test(), named = kt_random_named("streams_depend_on_their_name_alone");
    kt_check_true("the test's own", kt_random_bits(&own) == kt_random_bits(&named));
}

/* The mean of x over N samples has the deviation s / sqrt(N), and that of x^2 has s2 / sqrt(N). The bound is four of
 * them. */
KT_TEST(random_numbers_have_their_moments) {
    enum { N = 100000 };
    kt_random random = kt_random_of_test();
    double uniform = 0.0, normal = 0.0, normal2 = 0.0, axis2 = 0.0;
    double lowest = 1.0, highest = 0.0;
    int counts[6] = {0};
    for (int i = 0; i < N; i++) {
        double u = kt_random_uniform(&random, 2.0, 3.0) - 2.0;
        double x = kt_random_normal(&random);
        double n[3];
        kt_random_direction(&random, 3, n);
        lowest = fmin(lowest, u);
        highest = fmax(highest, u);
        uniform += u / N;
        normal += x / N;
        normal2 += x * x / N;
        axis2 += n[2] * n[2] / N;
        counts[kt_random_int(&random, -2, 3) + 2]++;
    }
    double deviation = 4.0 / sqrt((double)N);
    kt_check_near("uniform: mean", uniform, 0.5, deviation * sqrt(1.0 / 12.0));
    kt_check_below("uniform: lowest", lowest, 10.0 / N);
    kt_check_below("uniform: 1 - highest", 1.0 - highest, 10.0 / N);
    kt_check_near("normal: mean", normal, 0.0, deviation);
    kt_check_near("normal: mean square", normal2, 1.0, deviation * sqrt(2.0));
    /* z of a uniform direction is uniform in `-1 .. 1`: the mean square is `1/3`, its variance `1/5 - 1/9`. */
    kt_check_near("direction: mean square of z", axis2, 1.0 / 3.0, deviation * sqrt(1.0 / 5.0 - 1.0 / 9.0));
    for (int i = 0; i < 6; i++)
        kt_check_near("int: share", counts[i] / (double)N, 1.0 / 6.0, deviation * sqrt(5.0 / 36.0));
}

KT_TEST(direction_is_of_unit_length) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("| |n| - 1 |");
    for (int n = 1; n <= 4; n++) {
        for (int i = 0; i < 100; i++) {
            double x[4], square = 0.0;
            kt_random_direction(&random, n, x);
            for (int k = 0; k < n; k++)
                square += x[k] * x[k];
            kt_worst_near(&error, sqrt(square), 1.0, 4.0 * DBL_EPSILON, "n = %d", n);
        }
    }
}

/* Through pointers that the compiler cannot see through, or it would leave the calls out. */
static void *(*volatile make)(size_t) = malloc;
static void *(*volatile make_zero)(size_t, size_t) = calloc;
static void *(*volatile make_again)(void *, size_t) = realloc;
static void *(*volatile make_aligned)(size_t, size_t) = aligned_alloc;
static int (*volatile make_posix)(void **, size_t, size_t) = posix_memalign;
static void (*volatile unmake)(void *) = free;

KT_TEST(every_allocation_is_counted) {
    kt_interpose_start();
    void *a = make(10), *b = make_zero(2, 10), *c = make_again(NULL, 10), *d = make_aligned(64, 128), *e = NULL;
    int status = make_posix(&e, 64, 100);
    c = make_again(c, 2000);
    void *all[] = {a, b, c, d, e, NULL};
    for (int i = 0; i < 6; i++)
        unmake(all[i]);
    long allocations = kt_interpose_stop();
    unmake(make(10));
    kt_check_equal_int("allocations", allocations, 6);
    kt_check_equal_int("frees", kt_interpose_frees(), 5);
    kt_check_true("all were made", a && b && c && d && e && status == 0);
    kt_check_true("aligned", (uintptr_t)d % 64 == 0 && (uintptr_t)e % 64 == 0);
    kt_check_true("none was to fail", !kt_interpose_has_failed());
}

/* A call of LAPACKE makes its workspace itself, within its own library; its _work form takes the caller's. */
KT_TEST(allocation_inside_a_library_is_counted) {
    double a[] = {1.0, 2.0, 3.0, 4.0}, tau[2], work[64];
    kt_interpose_start();
    int status = LAPACKE_dgeqrf(LAPACK_COL_MAJOR, 2, 2, a, 2, tau);
    kt_check_above("allocations of LAPACKE_dgeqrf", (double)kt_interpose_stop(), 1.0);
    kt_interpose_start();
    status |= LAPACKE_dgeqrf_work(LAPACK_COL_MAJOR, 2, 2, a, 2, tau, work, 64);
    kt_check_equal_int("allocations of LAPACKE_dgeqrf_work", kt_interpose_stop(), 0);
    kt_check_equal_int("status", status, 0);
}

KT_TEST(chosen_allocation_fails_alone) {
    for (int n = 1; n <= 5; n++) {
        void *made[6] = {NULL};
        kt_interpose_start_failing(n);
        made[1] = make(8);
        made[2] = make_zero(1, 8);
        made[3] = make_again(NULL, 8);
        made[4] = make_aligned(16, 16);
        int status = make_posix(&made[5], 16, 16);
        kt_interpose_stop();
        for (int i = 1; i <= 5; i++)
            kt_check_true("fails where it is its turn", (made[i] == NULL) == (i == n));
        kt_check_true("posix_memalign says so", (status != 0) == (n == 5));
        kt_check_true("reached", kt_interpose_has_failed());
        for (int i = 1; i <= 5; i++)
            unmake(made[i]);
    }
    kt_interpose_start_failing(2);
    unmake(make(8));
    kt_interpose_stop();
    kt_check_true("not reached", !kt_interpose_has_failed());
}
