/* A whip of 100 links whose end hangs on a slack rope, for tests and for bench/run hard. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SIMULATION_WHIP_H
#define KT_TEST_SIMULATION_WHIP_H

#include "kinetree/description.h"

#include <stdbool.h>

/* Links of 1 cm and 10 g, which extend along x, turn about z, and fall along -y. The other members are the point at
 * which the rope ends, and its length, m. */
enum { KT_WHIP_LINKS = 100 };
#define KT_WHIP_LINK 0.01
#define KT_WHIP_MASS 0.01
#define KT_WHIP_GRAVITY 9.81
#define KT_WHIP_X 0.9
#define KT_WHIP_Y 0.3
#define KT_WHIP_ROPE 0.35

typedef struct kt_whip {
    kt_body body[KT_WHIP_LINKS];
    char name[KT_WHIP_LINKS][8];
    kt_loop rope; /* from the point to the tip */
    kt_description description;
} kt_whip;

void kt_whip_make(kt_whip *whip, double restitution, bool has_rope);

/* The tip, of positions of the joints. */
void kt_whip_tip(const double *q, double *x, double *y);

/* How much longer than the rope it is from the point to the tip. */
double kt_whip_stretch(const double *q);

#endif
