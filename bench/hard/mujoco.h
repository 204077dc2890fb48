/* What both parts of bench/run hard ask of MuJoCo. */
#ifndef KT_BENCH_HARD_MUJOCO_H
#define KT_BENCH_HARD_MUJOCO_H

#include <mujoco/mujoco.h>
#include <stddef.h>

enum { KT_MUJOCO_REASON = 300 };

/* The model of an MJCF in memory, which is freed; NULL and MuJoCo's words where there is no text, or it is refused. */
mjModel *kt_mujoco_read(char *text, size_t size, char reason[KT_MUJOCO_REASON]);

#endif
