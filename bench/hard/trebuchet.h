/* The trebuchet in each engine. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_TREBUCHET_H
#define KT_BENCH_HARD_TREBUCHET_H

#include "../../test/files/scene/trebuchet.h"
#include "events.h"

/* Sees where the ball is, x, y, x', y', and from the last millisecond, where it lands. */
void kt_trebuchet_see(kt_events_watch *watch, double t, const double ball[4]);

#endif
