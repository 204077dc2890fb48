/* A woodpecker toy and its time stepping, for tests and for bench/run hard. */
#ifndef KT_TEST_SCENE_WOODPECKER_H
#define KT_TEST_SCENE_WOODPECKER_H

/* Leine, Glocker, van Campen, Nonlinear Dynamics of the Woodpecker Toy, DETC 2001, equations 6 to 10 and their data: y
 * of the sleeve, angles phi_M of the sleeve and phi_S of the bird, small in all but their size. What turns moves along
 * straight lines in the scene: the edges of the sleeve by (h_M, r_M) phi_M against it, the bird's mass by l_M phi_M +
 * l_G phi_S, the beak by (-h_S, l_G - l_S) phi_S. It begins where the bird passes phi_S = -0.2788 while the sleeve
 * slides, as Siconos' example does (Glocker 1995). */
extern const char kt_woodpecker_scene[];

/* The same data, for other descriptions: radii of the pole and of the sleeve's hole, half the sleeve's height, levers,
 * in m; the spring, N m/rad; kg; kg m^2; the start, rad, m/s, rad/s. */
typedef struct kt_woodpecker {
    double r0, rM, hM, lM, lG, hS, lS, c, friction, restitution, mM, mS, JM, JS, g, phiS, fall, turn;
} kt_woodpecker;

extern const kt_woodpecker kt_woodpecker_data;

/* Contacts of the beak with the pole, of which those within 0.05 s are one peck: the period is the mean of those that
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
