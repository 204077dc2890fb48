/* SPDX-License-Identifier: Apache-2.0 */
#include "peer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SAMPLES_LEAST = 3, SAMPLES_MOST = 15 };
static const double time_most = 0.2;     /* s of repetitions, unless fewer than SAMPLES_LEAST */
static const double sample_least = 1e-3; /* s: shorter runs are repeated within a sample */

int peer_steps(const peer_request *request) {
    return (int)fmax(1.0, ceil(request->interval / request->setting * (1.0 - 1e-9)));
}

/* The clock of a process has the resolution of a tick if its processor time is limited; that of a thread does not. */
static double seconds_now(void) {
    struct timespec time;
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static bool read_request(int argc, char **argv, peer_request *request) {
    if (argc < 7)
        return false;
    request->method = argv[1];
    request->setting = strtod(argv[2], NULL);
    request->interval = strtod(argv[3], NULL);
    request->records = (int)strtol(argv[4], NULL, 10);
    request->mjcf = argv[5];
    request->scene = argv[6];
    request->settings = (const char *const *)argv + 7;
    request->setting_count = argc - 7;
    return request->setting > 0.0 && request->interval > 0.0 && request->records > 0;
}

static double sample(const peer_engine *engine, void *run, int repeats) {
    const double from = seconds_now();
    for (int k = 0; k < repeats; k++)
        (void)engine->run(run, NULL);
    return seconds_now() - from;
}

/* The least time of repeated runs without output. */
static double measure(const peer_engine *engine, void *run) {
    double least = HUGE_VAL, used = 0.0, last;
    int repeats = 1;
    while ((last = sample(engine, run, repeats)) < sample_least && repeats < 100000)
        repeats *= 4;
    for (int k = 0; k < SAMPLES_MOST && (k < SAMPLES_LEAST || used < time_most); k++) {
        least = fmin(least, last);
        used += last;
        last = sample(engine, run, repeats);
    }
    return fmin(least, last) / repeats;
}

static void print_table(const peer_engine *engine, void *run, const peer_request *request, const double *poses,
                        double cpu) {
    static const char axes[] = "xyzwijk";
    const int count = engine->body_count(run);
    const long evaluations = engine->evaluations(run);
    printf("cpu,evaluations,time");
    for (int i = 0; i < count; i++)
        for (int k = 0; k < PEER_POSE && engine->body_name(run, i) != NULL; k++)
            printf(",%c.%s", axes[k], engine->body_name(run, i));
    for (int row = 0; row <= request->records; row++) {
        printf("\n%.17g,%ld,%.17g", cpu, evaluations, row * request->interval);
        for (int i = 0; i < count; i++, poses += PEER_POSE)
            for (int k = 0; k < PEER_POSE && engine->body_name(run, i) != NULL; k++)
                printf(",%.17g", poses[k]);
    }
    printf("\n");
}

static int run_scene(const peer_engine *engine, peer_request *request) {
    void *run = NULL;
    double *poses = NULL;
    bool good = engine->open(request, &run);
    if (good) {
        const size_t width = PEER_POSE * (size_t)engine->body_count(run);
        poses = calloc(((size_t)request->records + 1) * width + 1, sizeof *poses);
        if (poses == NULL)
            (void)snprintf(request->reason, PEER_REASON, "there is not enough memory");
        good = poses != NULL && engine->run(run, poses);
    }
    if (good)
        print_table(engine, run, request, poses, measure(engine, run));
    else
        (void)fprintf(stderr, "%s\n", request->reason);
    free(poses);
    if (run != NULL)
        engine->close(run);
    return good && fflush(stdout) == 0 && !ferror(stdout) ? 0 : 1;
}

int peer_main(const peer_engine *engine, int argc, char **argv) {
    peer_request request = {.reason = "it failed"};
    if (argc == 2 && strcmp(argv[1], "--methods") == 0) {
        puts(engine->version());
        for (const peer_method *m = engine->methods; m->name != NULL; m++)
            printf("%s %s\n", m->name, m->has_tolerance ? "tolerance" : "step");
        return 0;
    }
    if (read_request(argc, argv, &request))
        return run_scene(engine, &request);
    (void)fprintf(stderr,
                  "usage: %s --methods\n       %s METHOD SETTING INTERVAL RECORDS MJCF SCENE [PATH=VALUE ...]\n",
                  argv[0], argv[0]);
    return 2;
}
