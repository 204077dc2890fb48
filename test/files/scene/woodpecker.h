/* A woodpecker toy and its time stepping, for tests and for bench/run hard. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_WOODPECKER_H
#define KT_TEST_SCENE_WOODPECKER_H

/* Leine, Glocker, van Campen, Nonlinear Dynamics of the Woodpecker Toy, DETC 2001, equations 6 to 10 and their data.
 * The coordinates are y of the sleeve and the angles phi_M of the sleeve and phi_S of the bird. The model treats the
 * angles as small, although they are not. The parts that turn move along straight lines in the scene:
 *     edges of the sleeve   (h_M, r_M) phi_M against it
 *     mass of the bird      l_M phi_M + l_G phi_S
 *     beak                  (-h_S, l_G - l_S) phi_S
 * The motion begins when the bird passes phi_S = -0.2788 while the sleeve slides, as in Siconos' example (Glocker
 * 1995). */
extern const char kt_woodpecker_scene[];

/* The same data, for other descriptions. In m: the radii of the pole and of the sleeve's hole, half the sleeve's
 * height, and the levers. Then follow the spring in N m/rad, the masses in kg and the inertias in kg m^2. The start is
 * in rad, m/s and rad/s. */
typedef struct kt_woodpecker {
    double r0, rM, hM, lM, lG, hS, lS, c, friction, restitution, mM, mS, JM, JS, g, phiS, fall, turn;
} kt_woodpecker;

extern const kt_woodpecker kt_woodpecker_data;

/* Contacts of the beak with the pole. Contacts within 0.05 s are one peck. The period is the mean of the pecks that
 * begin after 1 s. */
typedef struct kt_pecks {
    int count;
    double first, last;
} kt_pecks;

void kt_pecks_see(kt_pecks *pecks, double t);
double kt_pecks_period(const kt_pecks *pecks);

/* The period of 3 s of its motion, by Moreau's time stepping with Newton's rule in steps of h. This is Poisson's rule
 * here, since all impacts slip. The error is of order h: 2.7e-5 s at 1e-5 s. */
double kt_woodpecker_period(double h);

#endif
