/* The main of every test program. A program has many files, and each file runs in a process of its own. No file then
 * sees what another has left in static variables. If a test ends its process, the runner names the test and its end,
 * and starts a new process for the tests behind it.
 *
 *     PROGRAM [--list | --here] [PATTERN...]
 *
 * --list prints the names of the tests. --here runs all tests in one process, for debuggers.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _DEFAULT_SOURCE
#include "runner.h"

#include "check.h"

#include <fnmatch.h>
#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* Seconds after which a test hangs, unless KT_PATIENCE has others. The longest takes some minutes on a slow machine. */
enum { PATIENCE = 1800 };

enum { NOT_RUN, PASSED, SKIPPED, FAILED };

kt_running_test kt_running = {.name = ""};

static kt_test *first_test;
static kt_test *last_test;

void kt_test_register(kt_test *test) {
    if (first_test == NULL)
        first_test = test;
    else
        last_test->next = test;
    last_test = test;
}

static void (*before_tests)(void);

void kt_test_before(void (*function)(void)) { before_tests = function; }

/* ---- one test ---------------------------------------------------------------------------------------------------- */

static jmp_buf end_of_test;

void kt_end_test(void) { longjmp(end_of_test, 1); }

void kt_need(bool held) {
    if (!held)
        kt_end_test();
}

kt_random kt_random_of_test(void) { return kt_random_named(kt_running.name); }

/* Static, because tests count allocations and make them fail. */
enum { MAX_OWNED = 20000 };
static struct {
    void *object;
    void (*release)(void *object);
} owned[MAX_OWNED];
static size_t owned_count;

void kt_test_own(void *object, void (*release)(void *object)) {
    if (object == NULL)
        return;
    if (owned_count == MAX_OWNED) {
        fputs("a test must own no more than MAX_OWNED objects\n", stderr);
        abort();
    }
    owned[owned_count].object = object;
    owned[owned_count++].release = release;
}

void kt_test_release(void *object) {
    for (size_t i = owned_count; object != NULL && i-- > 0;)
        if (owned[i].object == object) {
            void (*const release)(void *) = owned[i].release;
            owned_count--;
            memmove(&owned[i], &owned[i + 1], (owned_count - i) * sizeof *owned);
            release(object);
            return;
        }
}

static void release_owned(void) {
    while (owned_count > 0) {
        owned_count--;
        owned[owned_count].release(owned[owned_count].object);
    }
}

/* The name of a file without its folder and ending. */
static const char *stem_of(const char *file, int *length) {
    const char *slash = strrchr(file, '/');
    const char *stem = slash == NULL ? file : slash + 1;
    *length = (int)strcspn(stem, ".");
    return stem;
}

static void print_name(const kt_test *test, const char *more) {
    int length;
    const char *stem = stem_of(test->file, &length);
    printf("%.*s/%s%s\n", length, stem, test->name, more);
}

static void print_mark(const char *mark, const kt_test *test, const char *more) {
    printf("[ %-8s ] ", mark);
    print_name(test, more);
}

/* Processor seconds of this process and of what it started: the machine may be busy. */
static double seconds_of_processors(void) {
    const int whose[] = {RUSAGE_SELF, RUSAGE_CHILDREN};
    double seconds = 0.0;
    for (int i = 0; i < 2; i++) {
        struct rusage use;
        if (getrusage(whose[i], &use) == 0)
            seconds += (double)(use.ru_utime.tv_sec + use.ru_stime.tv_sec) +
                       1e-6 * (double)(use.ru_utime.tv_usec + use.ru_stime.tv_usec);
    }
    return seconds;
}

static unsigned char result_of(void) {
    if (kt_running.checks == 0 && kt_running.skips > 0)
        return SKIPPED;
    if (kt_running.checks == 0)
        puts("       no check was made");
    else if (kt_running.failures > 0)
        printf("       %zu of %zu checks failed\n", kt_running.failures, kt_running.checks);
    return kt_running.checks == 0 || kt_running.failures > 0 ? FAILED : PASSED;
}

/* Apart, since a jump may lose the variables of its function. */
__attribute__((noinline)) static void run_body(const kt_test *test) {
    if (setjmp(end_of_test) == 0)
        test->body();
    release_owned();
}

static unsigned char run_test(const kt_test *test) {
    char took[40] = "";
    kt_running = (kt_running_test){.name = test->name};
    print_mark("RUN", test, "");
    const double begin = seconds_of_processors();
    run_body(test);
    const double seconds = seconds_of_processors() - begin;
    if (seconds > 0.05)
        (void)snprintf(took, sizeof took, " (%.2f s)", seconds);
    const unsigned char result = result_of();
    if (result == PASSED)
        print_mark("      OK", test, took);
    else if (result == FAILED)
        print_mark(" FAILED ", test, took);
    return result;
}

/* ---- all tests --------------------------------------------------------------------------------------------------- */

/* Tests from `next` on, whose number is `count`; processes share the results. */
typedef struct batch {
    const kt_test **tests;
    size_t count;
    volatile size_t *next;
    volatile unsigned char *results;
} batch;

static void run_here(const batch *b, size_t end) {
    if (before_tests != NULL)
        before_tests();
    const char *asked = getenv("KT_PATIENCE");
    const int patience = asked != NULL ? atoi(asked) : 0;
    while (*b->next < end) {
        alarm(patience > 0 ? (unsigned)patience : PATIENCE);
        b->results[*b->next] = run_test(b->tests[*b->next]);
        alarm(0);
        ++*b->next;
    }
}

/* Returns whether the process ended as it should. */
static bool run_apart(const batch *b, size_t end) {
    (void)fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        run_here(b, end);
        exit(0);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) {
        perror("a process for tests cannot be made");
        exit(2);
    }
    if (WIFSIGNALED(status))
        printf("       the process was ended by signal %d (%s)\n", WTERMSIG(status),
               WTERMSIG(status) == SIGALRM ? "the test hangs" : strsignal(WTERMSIG(status)));
    else if (WEXITSTATUS(status) != 0 || *b->next < end)
        printf("       the process ended with status %d\n", WEXITSTATUS(status));
    else
        return true;
    return false;
}

/* The tests of one file. What ends a process after the last test, such as a leak, counts for that test. */
static void run_file(const batch *b, size_t end) {
    while (*b->next < end) {
        if (run_apart(b, end))
            continue;
        const size_t culprit = *b->next < end ? *b->next : end - 1;
        if (b->results[culprit] != FAILED)
            print_mark(" FAILED ", b->tests[culprit],
                       culprit == *b->next ? "" : " and those before it in their process");
        b->results[culprit] = FAILED;
        *b->next = culprit + 1;
    }
}

static size_t end_of_file(const batch *b, size_t begin) {
    size_t end = begin + 1;
    while (end < b->count && strcmp(b->tests[end]->file, b->tests[begin]->file) == 0)
        end++;
    return end;
}

/* ---- what is asked ----------------------------------------------------------------------------------------------- */

static bool is_chosen(const kt_test *test, char **patterns) {
    int length;
    char whole[512];
    const char *stem = stem_of(test->file, &length);
    if (*patterns == NULL)
        return true;
    for (; *patterns != NULL; patterns++) {
        (void)snprintf(whole, sizeof whole, "%.*s/%s", length, stem, test->name);
        if (fnmatch(*patterns, whole, 0) == 0 || fnmatch(*patterns, test->name, 0) == 0)
            return true;
        whole[length] = '\0';
        if (fnmatch(*patterns, whole, 0) == 0)
            return true;
    }
    return false;
}

/* Threads of OpenBLAS start when it is loaded. They do not survive a fork, and what they allocate meets tests that make
 * allocations fail. The program therefore starts again with one thread. */
static void start_without_threads(char **argv) {
    if (getenv("OPENBLAS_NUM_THREADS") == NULL && strchr(argv[0], '/') != NULL) {
        setenv("OPENBLAS_NUM_THREADS", "1", 1);
        (void)execv(argv[0], argv);
    }
}

static void *shared_memory(size_t size) {
    void *memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) {
        perror("memory for results");
        exit(2);
    }
    return memory;
}

static int finish(const batch *b) {
    size_t counts[4] = {0};
    for (size_t i = 0; i < b->count; i++)
        counts[b->results[i]]++;
    for (size_t i = 0; i < b->count; i++)
        if (b->results[i] == FAILED)
            print_mark("FAILURE", b->tests[i], "");
    printf("%zu passed, %zu failed, %zu skipped\n", counts[PASSED], counts[FAILED], counts[SKIPPED]);
    return counts[FAILED] > 0 ? 1 : 0;
}

int main(int argc, char **argv) {
    start_without_threads(argv);
    /* A crash must not take the lines before it along. */
    setvbuf(stdout, NULL, _IOLBF, 0);
    const bool lists = argc > 1 && strcmp(argv[1], "--list") == 0;
    const bool is_here = argc > 1 && strcmp(argv[1], "--here") == 0;
    size_t count = 0;
    for (const kt_test *test = first_test; test != NULL; test = test->next)
        count++;
    const size_t bytes = sizeof(size_t) + (count + 1) * (sizeof(kt_test *) + 1);
    size_t *memory = shared_memory(bytes);
    batch b = {.tests = (const kt_test **)(memory + 1), .next = memory};
    for (const kt_test *test = first_test; test != NULL; test = test->next)
        if (is_chosen(test, argv + 1 + (lists || is_here)))
            b.tests[b.count++] = test;
    b.results = (unsigned char *)(b.tests + count + 1);
    if (b.count == 0) {
        fputs(count == 0 ? "a test program must have tests\n" : "no test has such a name\n", stderr);
        return 1;
    }
    for (size_t i = 0; lists && i < b.count; i++)
        print_name(b.tests[i], "");
    if (lists)
        return 0;
    printf("seed %llu (KT_SEED sets another)\n", (unsigned long long)kt_random_seed());
    while (*b.next < b.count)
        if (is_here)
            run_here(&b, b.count);
        else
            run_file(&b, end_of_file(&b, *b.next));
    return finish(&b);
}
