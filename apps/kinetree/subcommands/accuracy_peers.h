/* Points of other engines in an accuracy study (--peers). Programs on the PATH run the scene in them. The rules for
 * such programs are in bench/peers/peer.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SUBCOMMANDS_ACCURACY_PEERS_H
#define KT_COMMAND_SUBCOMMANDS_ACCURACY_PEERS_H

#include "command.h"

#include "kinetree/study.h"

enum {
    KT_PEER_CURVES_MAX = 32,
    KT_PEER_POINTS_MAX = 20,
};

/* A method of an engine: points by decreasing setting. */
typedef struct kt_peer_curve {
    char engine[48], method[32]; /* "MuJoCo 2.3.7", "RK4" */
    bool adaptive;
    int count;
    kt_accuracy_point points[KT_PEER_POINTS_MAX];
    char reason[200]; /* why a run failed; empty: none did */
} kt_peer_curve;

typedef struct kt_peers {
    int count;
    kt_peer_curve curves[KT_PEER_CURVES_MAX];
} kt_peers;

typedef struct kt_peer_work {
    const kt_scene *scene;
    const char *path; /* the scene's file */
    const kt_settings *settings;
    kt_accuracy *study;
    double budget; /* s of processor time for all engines */
    bool is_quiet;
} kt_peer_work;

/* Runs the scene in all engines that are found, over a ladder of steps or tolerances. Allocates *peers; the caller
 * releases it with free. Returns -1, or an exit code after printing the error. */
int kt_peers_measure(const kt_peer_work *work, kt_peers **peers);

#endif
