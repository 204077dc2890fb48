/* The motions of hard cases in other engines, watched as in this one. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_PEERS_H
#define KT_BENCH_HARD_PEERS_H

#include "../../test/hard/hard.h"
#include "../peers/twin.h"

/* Runs the motion of h (opened, with a simulation at its start) with motion->step and writes the observations to
 * `watch`. Returns false if the engine cannot run the motion or gave up. Then `words` (KT_HARD_WORDS) hold a short
 * reason. */
typedef bool kt_hard_peer_run(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words);

kt_hard_peer_run kt_hard_mujoco, kt_hard_ode;

/* Their versions. */
const char *kt_hard_mujoco_version(void);
const char *kt_hard_ode_version(void);

/* ---- what they share --------------------------------------------------------------------------------------------- */

/* Fills h->pose and h->twist with the start of the simulation. False, with words, where a joint, loop or effect is none
 * that both engines have. */
bool kt_hard_peer_begin(kt_hard *h, char *words);

/* The mechanism for an engine. */
kt_twin kt_hard_twin(kt_hard *h);

/* The views of a run in turn: steps until the next one, 0 behind the last. */
long kt_hard_peer_steps(const kt_hard *h, const kt_hard_motion *motion, long view);

/* Hands h->pose and h->twist to the watch; false, with words, where they are no numbers any more. */
bool kt_hard_peer_view(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, double t, char *words);

#endif
