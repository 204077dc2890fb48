/* A program that runs a scene in another engine for `kinetree accuracy --peers`. The command finds such programs on the
 * PATH by their names, kinetree-peer-NAME, and anyone may write one:
 *
 *     kinetree-peer-NAME --methods
 *     kinetree-peer-NAME METHOD SETTING INTERVAL RECORDS MJCF SCENE [PATH=VALUE ...]
 *
 * The first form prints the engine's name and version, then a line for each method: its name, and `step` or
 * `tolerance`. The second form runs the scene from 0 to RECORDS * INTERVAL seconds with a step or tolerance of SETTING.
 * MJCF is the scene as `kinetree export --mjcf` writes it. SCENE is its file, with settings that replace its values. It
 * prints a table of CSV with a row for each record, from 0 on. Its columns are
 *     cpu            processor time of the whole run without output, s; the least of several runs
 *     evaluations    how often the run computed accelerations
 *     time           s
 *     x.BODY y.BODY z.BODY w.BODY i.BODY j.BODY k.BODY     origin of a body's frame in the world (m), and quaternion
 * Exit status 0, or another one with a line on standard error that states why. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_PEERS_PEER_H
#define KT_BENCH_PEERS_PEER_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { PEER_REASON = 300, PEER_POSE = 7 };

typedef struct peer_request {
    const char *method;
    double setting, interval; /* s, or a tolerance; s */
    int records;
    const char *mjcf, *scene;
    const char *const *settings;
    int setting_count;
    char reason[PEER_REASON]; /* why a function failed */
} peer_request;

typedef struct peer_method {
    const char *name;
    bool has_tolerance; /* instead of a step */
} peer_method;

/* An engine. The functions return whether they succeeded; if not, request->reason states why. */
typedef struct peer_engine {
    const char *(*version)(void); /* its name and version */
    const peer_method *methods;   /* ends with a name that is NULL */
    bool (*open)(peer_request *request, void **run);
    /* Runs from 0 to the end. poses (NULL: none are wanted) receives PEER_POSE numbers of each body at each record. */
    bool (*run)(void *run, double *poses);
    int (*body_count)(const void *run);               /* without the world */
    const char *(*body_name)(const void *run, int i); /* NULL: it is not in the scene, and not printed */
    long (*evaluations)(const void *run);             /* of the last run */
    void (*close)(void *run);
} peer_engine;

/* The program of an engine. */
int peer_main(const peer_engine *engine, int argc, char **argv);

/* The number of equal steps of at most `step` between two records. */
int peer_steps(const peer_request *request);

#ifdef __cplusplus
}
#endif

#endif
