/* The fuzzers' entries in the suite: every file of the corpus is fed to one, and then mutations of them, made up here.
 *
 * The inputs run in a process of their own. Both processes share the memory with the present input. If the process
 * ends, the input is written into a file. The time is that of the processor, so that a busy machine changes only the
 * number of mutations. The mutations themselves depend on KT_SEED alone. KT_FUZZ_SECONDS sets the time (0: none). Its
 * default of 15 takes a minute for the four targets. KT_FUZZ_INPUT names a file that is run alone, without a process of
 * its own: for debuggers.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "check.h"
#include "fuzz.h"

enum { SIZE_MAX_OF_INPUT = 16384, FILES_MAX = 4096, SECONDS_OF_ONE = 20 };

typedef struct input {
    uint8_t *data;
    size_t size;
} input;

/* Messages of the working process. */
typedef struct shared {
    uint64_t runs;
    size_t size;
    uint8_t data[SIZE_MAX_OF_INPUT];
} shared;

static input corpus[FILES_MAX];
static int corpus_count;
static shared *now;

static bool read_input(const char *path, input *in) {
    FILE *file = fopen(path, "rb");
    in->data = malloc(SIZE_MAX_OF_INPUT);
    if (file == NULL || in->data == NULL)
        return false;
    in->size = fread(in->data, 1, SIZE_MAX_OF_INPUT, file);
    (void)fclose(file);
    return true;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

/* In the order of names, so that the mutations are the same on every machine. */
static bool read_corpus(void) {
    char *names[FILES_MAX], path[4096];
    int count = 0;
    if (corpus_count > 0)
        return true;
    DIR *directory = opendir(FUZZ_CORPUS);
    if (directory == NULL)
        return false;
    for (const struct dirent *entry = readdir(directory); entry != NULL && count < FILES_MAX;
         entry = readdir(directory))
        if (entry->d_name[0] != '.')
            names[count++] = strdup(entry->d_name);
    (void)closedir(directory);
    qsort((void *)names, (size_t)count, sizeof *names, by_name);
    for (int i = 0; i < count; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", FUZZ_CORPUS, names[i]);
        if (read_input(path, &corpus[corpus_count]))
            corpus_count++;
        free(names[i]);
    }
    return corpus_count == count && count > 0;
}

/* ---- one input --------------------------------------------------------------------------------------------------- */

/* The input is in memory of exactly its size; SIGPROF ends a run that takes too long. */
static void run_one(const uint8_t *data, size_t size) {
    const struct itimerval limit = {{0, 0}, {SECONDS_OF_ONE, 0}};
    uint8_t *exact = malloc(size + (size == 0));
    memmove(now->data, data, size);
    now->size = size;
    if (exact == NULL)
        abort();
    memcpy(exact, data, size);
    (void)setitimer(ITIMER_PROF, &limit, NULL);
    (void)LLVMFuzzerTestOneInput(exact, size);
    now->runs++;
    free(exact);
}

static void keep_input(int status) {
    const char *name = "fuzz-" FUZZ_TARGET "-found.bin";
    FILE *file = fopen(name, "wb");
    if (file == NULL || fwrite(now->data, 1, now->size, file) != now->size)
        name = "(which cannot be written)";
    if (file != NULL)
        (void)fclose(file);
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF)
        kt_note("an input takes more than %d s", SECONDS_OF_ONE);
    else
        kt_note("an input ends the process (status %#x)", (unsigned)status);
    kt_note("it is in the file %s; again: KT_FUZZ_INPUT=%s fuzz-" FUZZ_TARGET, name, name);
}

/* Runs `work` in a process of its own. */
static void run_apart(const char *what, void (*work)(void)) {
    int status = -1;
    struct rusage usage = {0};
    if (now == NULL)
        now = mmap(NULL, sizeof *now, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    kt_need(kt_check_true("memory to share", now != MAP_FAILED));
    now->runs = 0;
    (void)fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        work();
        exit(0); /* not _exit: leaks are looked for */
    }
    kt_need(kt_check_true("a process of its own", child > 0 && wait4(child, &status, 0, &usage) == child));
    kt_note("%s: %llu runs, %ld MB", what, (unsigned long long)now->runs, usage.ru_maxrss / 1024);
    if (!kt_check_equal_int(what, status, 0))
        keep_input(status);
    kt_check_below("memory, MB", (double)usage.ru_maxrss / 1024.0, 1024.0);
}

/* ---- mutations --------------------------------------------------------------------------------------------------- */

static void insert(uint8_t *data, size_t *size, size_t at, const uint8_t *part, size_t length) {
    if (*size + length > SIZE_MAX_OF_INPUT)
        return;
    memmove(data + at + length, data + at, *size - at);
    memcpy(data + at, part, length);
    *size += length;
}

static void erase(uint8_t *data, size_t *size, size_t at, size_t length) {
    length = length < *size - at ? length : *size - at;
    memmove(data + at, data + at + length, *size - at - length);
    *size -= length;
}

static size_t below(kt_random *random, size_t count) {
    return count == 0 ? 0 : (size_t)(kt_random_bits(random) % (uint64_t)count);
}

/* A part of any file of the corpus. */
static const uint8_t *any_part(kt_random *random, size_t *length) {
    const input *other = &corpus[below(random, (size_t)corpus_count)];
    const size_t at = below(random, other->size);
    *length = 1 + below(random, (size_t)1 << below(random, 8));
    *length = *length < other->size - at ? *length : other->size - at;
    return other->data + at;
}

static void mutate_once(kt_random *random, uint8_t *data, size_t *size) {
    static const uint8_t telling[] = {0, 1, 127, 128, 255, '\n', ' ', ':', '[', ']', '{', '}', '-', '0', '9', 'e', '#'};
    const size_t at = below(random, *size + 1);
    const uint8_t value = telling[below(random, sizeof telling)];
    size_t length;
    switch (*size == 0 ? 3 : below(random, 8)) {
    case 0:
        data[at % *size] ^= (uint8_t)(1U << below(random, 8));
        break;
    case 1:
        data[at % *size] = (uint8_t)kt_random_bits(random);
        break;
    case 2:
        data[at % *size] = value;
        break;
    case 3:
        insert(data, size, at, &value, 1);
        break;
    case 4:
        erase(data, size, at, 1 + below(random, (size_t)1 << below(random, 6)));
        break;
    case 5: {
        uint8_t copy[64];
        length = below(random, sizeof copy);
        length = length < *size - at ? length : *size - at;
        memcpy(copy, data + at, length);
        insert(data, size, below(random, *size + 1), copy, length);
        break;
    }
    case 6: {
        const uint8_t *part = any_part(random, &length);
        insert(data, size, at, part, length);
        break;
    }
    default: {
        const uint8_t *part = any_part(random, &length);
        length = length < *size - at ? length : *size - at;
        memcpy(data + at, part, length);
        break;
    }
    }
}

static double processor_seconds(void) {
    struct timespec t;
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double wanted_seconds(void) {
    const char *text = getenv("KT_FUZZ_SECONDS");
    return text != NULL && *text != '\0' ? strtod(text, NULL) : 15.0;
}

static void run_corpus(void) {
    for (int i = 0; i < corpus_count; i++)
        run_one(corpus[i].data, corpus[i].size);
}

static void run_mutations(void) {
    static uint8_t data[SIZE_MAX_OF_INPUT];
    kt_random random = kt_random_named("fuzz " FUZZ_TARGET);
    while (processor_seconds() < wanted_seconds()) {
        const input *from = &corpus[below(&random, (size_t)corpus_count)];
        size_t size = from->size;
        memcpy(data, from->data, size);
        for (size_t i = 1 + below(&random, (size_t)1 << below(&random, 5)); i > 0; i--)
            mutate_once(&random, data, &size);
        run_one(data, size);
    }
}

/* For debuggers: one input, in this process. */
static void run_named(const char *path) {
    static shared own;
    input in = {NULL, 0};
    now = &own;
    if (kt_check_true("an input, and it is read", read_input(path, &in)))
        run_one(in.data, in.size);
    free(in.data);
}

KT_TEST(corpus_is_replayed_without_a_finding) {
    const char *named = getenv("KT_FUZZ_INPUT");
    if (named != NULL)
        run_named(named);
    else if (kt_check_true("there is a corpus, and it is read: " FUZZ_CORPUS, read_corpus()))
        run_apart("corpus", run_corpus);
}

KT_TEST(mutations_of_the_corpus_find_nothing) {
    if (kt_check_true("there is a corpus, and it is read", read_corpus()) && getenv("KT_FUZZ_INPUT") == NULL)
        run_apart("mutations", run_mutations);
}
