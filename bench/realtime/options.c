/* The command line of bench/realtime. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "options.h"

#include "report.h"

#include <errno.h>
#include <getopt.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

static bool read_count(const char *text, long least, long *count) {
    char *end;
    errno = 0;
    const long value = strtol(text, &end, 10);
    if (end == text || *end != '\0' || errno != 0 || value < least || value > 1000000000)
        return false;
    *count = value;
    return true;
}

int kt_realtime_read(int argc, char **argv, kt_realtime_options *settings) {
    enum { STEPS = 1, PACED, SENSORS, MARKDOWN, CSV, HELP };
    static const struct option known[] = {{"steps", required_argument, NULL, STEPS},
                                          {"paced", required_argument, NULL, PACED},
                                          {"sensors", no_argument, NULL, SENSORS},
                                          {"markdown", no_argument, NULL, MARKDOWN},
                                          {"csv", required_argument, NULL, CSV},
                                          {"help", no_argument, NULL, HELP},
                                          {NULL, 0, NULL, 0}};
    for (int found; (found = getopt_long(argc, argv, "", known, NULL)) != -1;) {
        bool good = true;
        if (found == STEPS) {
            good = read_count(optarg, 2, &settings->steps);
        } else if (found == PACED) {
            good = read_count(optarg, 0, &settings->paced) && settings->paced != 1;
        } else if (found == SENSORS) {
            settings->sensors = true;
        } else if (found == MARKDOWN) {
            settings->markdown = true;
        } else if (found == CSV) {
            settings->csv = optarg;
        } else if (found == HELP) {
            printf("Times of single steps (rk4, 1 ms), free running and paced at 1 kHz\nUsage: %s [OPTION...]\n\n"
                   "  --steps N     free running, 2 or more (%ld)\n"
                   "  --paced N     paced, N ms a scene; 0: none (%ld)\n"
                   "  --sensors     accelerations of points and all reactions are read in each step\n"
                   "  --markdown    prints a table in Markdown\n"
                   "  --csv FILE    writes the figures there\n"
                   "  --help        this text\n\n"
                   "Exit status: 0 measured, 2 nothing to trust was measured.\n",
                   argv[0], settings->steps, settings->paced);
            return KT_BENCH_DONE;
        } else {
            return KT_BENCH_FAILED; /* getopt has told */
        }
        if (!good) {
            (void)fprintf(stderr, "%s: '%s' is no value for that option; --help shows them\n", argv[0], optarg);
            return KT_BENCH_FAILED;
        }
    }
    if (optind == argc)
        return -1;
    (void)fprintf(stderr, "%s: '%s' is no option; --help shows them\n", argv[0], argv[optind]);
    return KT_BENCH_FAILED;
}
