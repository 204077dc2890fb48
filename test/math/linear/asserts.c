/* Asserts of the library: a function that is called wrongly ends its process. Functions in headers are compiled with
 * this test, which has asserts. Functions of the library have asserts in builds with -Db_ndebug=false. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone.h"
#include "linear/cholesky.h"
#include "linear/qr.h"

#include "check.h"

#include <signal.h>
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MEMORY = 1 << 16 };

/* More equations than there are coordinates: the rank is beyond the matrix. */
static void solve_with_rank(int rank) {
    double factor[4] = {2.0, 0.0, 1.0, 3.0}, scale[2], y[4] = {1.0, 1.0, 1.0, 1.0};
    int32_t pivot[2] = {0, 1};
    kt_qr_solve(&(kt_qr){.m = 2, .k = 2, .factor = factor, .reflector_scale = scale, .pivot = pivot}, 2, rank, y);
}

/* One contact has room in the matrices. */
static void solve_contacts(int n) {
    static _Alignas(64) char memory[MEMORY], matrices[MEMORY];
    const double W[36] = {1.0}, b[6] = {1.0, 0.0, 0.0, 1.0}, mu[2] = {0.5, 0.5};
    double p[6] = {0.0};
    (void)kt_cone_solve(kt_cone_init(1, 1, memory, matrices), &(kt_cone_problem){.n = n, .W = W, .b = b, .mu = mu}, p);
}

static void initialise_at(int offset) {
    static _Alignas(64) char memory[MEMORY], matrices[MEMORY];
    (void)kt_cone_init(1, 1, memory + offset, matrices);
}

/* The signal that ends a call; 0: it returns. */
static int signal_of(void (*call)(int), int argument) {
    int how = 0;
    const pid_t child = fork();
    if (child == 0) {
        (void)freopen("/dev/null", "w", stderr);
        call(argument);
        _exit(0);
    }
    return child > 0 && waitpid(child, &how, 0) == child ? WIFSIGNALED(how) ? WTERMSIG(how) : 0 : -1;
}

/* A matrix whose columns are shorter than the matrix is high. */
static void factor_with_stride(int stride) {
    double l[4] = {2.0, 0.0, 0.0, 3.0};
    (void)kt_dense_cholesky(l, (size_t)stride, 2, NULL);
}

KT_TEST(functions_in_headers_end_a_call_that_violates_a_requirement) {
    kt_check_equal_int("rank 2 of 2", signal_of(solve_with_rank, 2), 0);
    kt_check_equal_int("rank 3 of 2", signal_of(solve_with_rank, 3), SIGABRT);
    kt_check_equal_int("columns of two numbers", signal_of(factor_with_stride, 2), 0);
    kt_check_equal_int("columns of one number", signal_of(factor_with_stride, 1), SIGABRT);
}

KT_TEST(functions_of_the_library_do_so_in_builds_with_asserts) {
    kt_check_equal_int("one contact", signal_of(solve_contacts, 1), 0);
    kt_check_equal_int("aligned memory", signal_of(initialise_at, 0), 0);
    if (!KT_LIBRARY_ASSERTS) {
        kt_note("this library has no asserts");
        return;
    }
    kt_check_equal_int("two contacts in the memory of one", signal_of(solve_contacts, 2), SIGABRT);
    kt_check_equal_int("memory off by eight bytes", signal_of(initialise_at, 8), SIGABRT);
}
