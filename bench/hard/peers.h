/* The motions of hard cases in other engines, watched as in this one. */
#ifndef KT_BENCH_HARD_PEERS_H
#define KT_BENCH_HARD_PEERS_H

#include "../../test/hard/hard.h"

/* Runs the motion of h (opened, compiled, with a simulation at its start) with motion->step and writes what was seen to
 * `watch`. False where the engine cannot, or gave up: `words` (KT_HARD_WORDS) say why. */
typedef bool kt_hard_peer_run(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words);

kt_hard_peer_run kt_hard_mujoco, kt_hard_ode;

/* Their versions. */
const char *kt_hard_mujoco_version(void);
const char *kt_hard_ode_version(void);

#endif
