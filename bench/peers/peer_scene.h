/* A scene that a peer builds again by itself: read, assembled, with its bodies at the start. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_PEERS_PEER_SCENE_H
#define KT_BENCH_PEERS_PEER_SCENE_H

#include "../book/equations.h"
#include "peer.h"
#include "twin.h"

typedef struct peer_scene {
    equations e;
    bool is_open;
    int count;       /* bodies, in the order of the description: */
    int *parent;     /* -1: the world */
    kt_pose *pose;   /* at the start */
    kt_twist *twist; /* at the start */
} peer_scene;

/* Opens the scene of a request, whose joints and loops must be known to all engines; false with request->reason. In
 * both cases peer_scene_close releases it. */
bool peer_scene_open(peer_request *request, peer_scene *scene);
void peer_scene_close(peer_scene *scene);

kt_twin peer_scene_twin(const peer_scene *scene);

/* Writes the PEER_POSE numbers of a pose. */
void peer_pose_write(kt_pose pose, double *numbers);

#endif
