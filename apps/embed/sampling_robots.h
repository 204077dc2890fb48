/* The robots of sampling_mpc.c: a cart-pole that is swung up, and a quadruped that trots on the spot.
 *
 * The quadruped moves in the plane x, y. A trunk has two legs at each end, with a thigh and a shank each. The feet
 * touch the ground elastically and with friction. Springs and dampers hold the joints at a stance, as servos would, and
 * the controls are changes of these targets. Pairs of diagonal legs are to lift their feet in turns. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMBED_SAMPLING_ROBOTS_H
#define EMBED_SAMPLING_ROBOTS_H

#include <kinetree/kinetree.h>
#include <math.h>
#include <stdio.h>

enum { HORIZON_MOST = 40, ROLLOUTS_MOST = 384, INPUTS_MOST = 8, COORDINATES_MOST = 11 };

typedef struct robot {
    const char *columns; /* names of the columns of `write` */
    kt_status (*describe)(kt_model **model, kt_error *error);
    void (*write)(FILE *csv, double t, const double *q, const double *v, const double *torque);
    double (*cost)(double t, const double *q, const double *v,
                   const double *u); /* cost of a state and the input before it */
    int coordinates, first_driven, inputs;
    int horizon, rollouts;                                        /* samples of a plan; plans */
    double sample, duration;                                      /* s */
    kt_batch_job job;                                             /* a sample of the planner */
    double gain, limit;                                           /* joint force for an input; greatest input */
    double spread, smooth;                                        /* size of noise; correlation from sample to sample */
    double last, temperature;                                     /* weight of the last sample; lambda */
    void (*judge)(double left, const double *q, double worst[2]); /* at so many s before the end */
    void (*report)(const double worst[2]);
} robot;

static const double half_turn = 3.14159265358979323846;

/* ---- the cart-pole ----------------------------------------------------------------------------------------------- */

enum { CART = 0, POLE = 1 };
static const double rail = 1.0; /* m, to each side */

static inline kt_status cart_pole_describe(kt_model **model, kt_error *error) {
    kt_body bodies[2] = {kt_body_default(), kt_body_default()};
    bodies[CART].name = "cart";
    bodies[CART].joint.type = KT_JOINT_PRISMATIC;
    bodies[CART].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    bodies[CART].mass = 0.8;

    bodies[POLE].name = "pole"; /* upright at zero, hanging at the start */
    bodies[POLE].parent = "cart";
    bodies[POLE].joint.type = KT_JOINT_REVOLUTE; /* about z; y is up */
    bodies[POLE].joint.position[0] = half_turn;
    bodies[POLE].mass = 0.2;
    bodies[POLE].shape.type = KT_SHAPE_ROD;
    bodies[POLE].shape.to = kt_vec3_make(0.0, 0.6, 0.0);
    bodies[POLE].com_of_shape = bodies[POLE].inertia_of_shape = true;

    kt_description cart_pole = kt_description_default();
    cart_pole.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    cart_pole.bodies = bodies;
    cart_pole.body_count = 2;
    return kt_model_compile(&cart_pole, NULL, model, error);
}

static inline double cart_pole_cost(double t, const double *q, const double *v, const double *u) {
    const double beyond = fmax(0.0, fabs(q[CART]) - 0.8 * rail);
    (void)t;
    return 6.0 * (1.0 - cos(q[POLE])) + 0.06 * v[POLE] * v[POLE] + 1.0 * q[CART] * q[CART] + 0.1 * v[CART] * v[CART] +
           400.0 * beyond * beyond + 1e-3 * u[0] * u[0];
}

static inline void cart_pole_judge(double left, const double *q, double worst[2]) {
    if (left <= 1.0)
        worst[0] = fmax(worst[0], fabs(remainder(q[POLE], 2.0 * half_turn)));
    worst[1] = fmax(worst[1], fabs(q[CART]));
}

static inline void cart_pole_report(const double worst[2]) {
    printf("in the last second within %.4f rad of upright; cart never further than %.3f m out\n", worst[0], worst[1]);
}

static inline void cart_pole_write(FILE *csv, double t, const double *q, const double *v, const double *torque) {
    fprintf(csv, "%.9g,%.17g,%.17g,%.17g,%.17g,%.17g\n", t, q[CART], q[POLE], v[CART], v[POLE], torque[CART]);
}

/* Forces in N, of a total weight of 9.8 N. */
static const robot cart_pole = {
    .columns = "time,position.cart,position.pole,velocity.cart,velocity.pole,torque.cart",
    .describe = cart_pole_describe,
    .write = cart_pole_write,
    .cost = cart_pole_cost,
    .coordinates = 2,
    .inputs = 1,
    .horizon = 40,
    .rollouts = 384,
    .sample = 0.02,
    .duration = 6.0,
    .job = {.task = KT_BATCH_STEP, .h = 0.02, .steps = 1},
    .gain = 1.0,
    .limit = 8.0,
    .spread = 1.5,
    .smooth = 0.9,
    .last = 10.0,
    .temperature = 0.02,
    .judge = cart_pole_judge,
    .report = cart_pole_report,
};

/* ---- the quadruped ----------------------------------------------------------------------------------------------- */

enum { LEGS = 4, X = 0, Y = 1, PITCH = 2, FIRST_LEG = 3 };
static const double hip = 0.2, bone = 0.2, foot_radius = 0.02; /* m: from the middle; of thigh and shank */
static const double knee = 1.2, hold = 60.0;                   /* rad, of the stance; N m/rad */
static const double stance = 0.35;                             /* m, of the trunk */
static const double lift = 0.04, period = 0.4;                 /* m; s, of a gait in which each foot is lifted once */

/* The height of a foot above the ground. Legs 0 and 1 are in front. Diagonal legs, such as 0 and 3, are lifted
 * together. */
static inline double foot_height(const double *q, int leg) {
    const double thigh = q[PITCH] + q[FIRST_LEG + 2 * leg], shank = thigh + q[FIRST_LEG + 2 * leg + 1];
    return q[Y] + (leg < 2 ? hip : -hip) * sin(q[PITCH]) - bone * (cos(thigh) + cos(shank)) - foot_radius;
}

/* The target of the height of a foot. */
static inline double foot_target(double t, int leg) {
    const double phase = 2.0 * half_turn * t / period + (leg == 1 || leg == 2 ? half_turn : 0.0);
    return lift * fmax(0.0, sin(phase));
}

enum { LIMBS = 2 * LEGS }; /* thighs and shanks, in turns */
static const char *const limb_names[1 + LIMBS] = {"trunk",  "thigh0", "shank0", "thigh1", "shank1",
                                                  "thigh2", "shank2", "thigh3", "shank3"};

static inline bool is_shank(int limb) { return limb % 2 == 0; }

static inline void add_trunk(kt_body *trunk) {
    *trunk = kt_body_default();
    trunk->name = limb_names[0];
    trunk->joint.type = KT_JOINT_PLANAR; /* normal to z; y is up */
    trunk->joint.position[Y] = stance;
    trunk->mass = 8.0;
    trunk->inertia = (kt_sym3){.xx = 0.2, .yy = 0.2, .zz = 0.2};
}

/* A thigh on the trunk, or a shank on the thigh before it, and the spring of its joint. */
static inline void add_limb(kt_body *limb, kt_effect *spring, int i) {
    const double size = is_shank(i) ? 1e-3 : 2e-3;
    *limb = kt_body_default();
    limb->name = limb_names[i];
    limb->parent = limb_names[is_shank(i) ? i - 1 : 0];
    limb->joint.type = KT_JOINT_REVOLUTE; /* about z */
    limb->joint.at = is_shank(i) ? kt_vec3_make(0.0, -bone, 0.0) : kt_vec3_make(i <= LEGS ? hip : -hip, 0.0, 0.0);
    limb->joint.position[0] = is_shank(i) ? -knee : 0.5 * knee;
    limb->joint.armature[0] = 0.02; /* inertia of a motor behind its gear, kg m^2 */
    limb->mass = is_shank(i) ? 0.2 : 0.5;
    limb->com = kt_vec3_make(0.0, -0.5 * bone, 0.0);
    limb->inertia = (kt_sym3){.xx = size, .yy = size, .zz = size};
    *spring = kt_effect_default();
    spring->type = KT_EFFECT_JOINT_SPRING;
    spring->joint = limb->name;
    spring->stiffness = hold;
    spring->damping = 1.5;
    spring->rest = kt_function_constant(limb->joint.position[0]);
}

static inline void add_foot(kt_effect *foot, int leg) {
    *foot = kt_effect_default();
    foot->type = KT_EFFECT_CONTACT;
    foot->between[0] = (kt_end){.body = limb_names[2 + 2 * leg], .at = {0.0, -bone, 0.0}};
    foot->axis = kt_vec3_make(0.0, 1.0, 0.0);
    foot->radius = foot_radius;
    foot->stiffness = 6e3;
    foot->exponent = 1.0;
    foot->dissipation = 0.5;
    foot->friction = 0.8;
    foot->slip = 0.1;
}

static inline kt_status quadruped_describe(kt_model **model, kt_error *error) {
    kt_body bodies[1 + LIMBS];
    kt_effect effects[LIMBS + LEGS];
    add_trunk(&bodies[0]);
    for (int i = 1; i <= LIMBS; i++)
        add_limb(&bodies[i], &effects[i - 1], i);
    for (int leg = 0; leg < LEGS; leg++)
        add_foot(&effects[LIMBS + leg], leg);
    kt_description quadruped = kt_description_default();
    quadruped.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    quadruped.bodies = bodies;
    quadruped.body_count = 1 + LIMBS;
    quadruped.effects = effects;
    quadruped.effect_count = LIMBS + LEGS;
    return kt_model_compile(&quadruped, NULL, model, error);
}

static inline double quadruped_cost(double t, const double *q, const double *v, const double *u) {
    const double rise = q[Y] - stance;
    double sum = 300.0 * rise * rise + 20.0 * q[PITCH] * q[PITCH] + 10.0 * q[X] * q[X] + v[X] * v[X] +
                 0.5 * v[Y] * v[Y] + 0.2 * v[PITCH] * v[PITCH];
    for (int leg = 0; leg < LEGS; leg++) {
        const double off = foot_height(q, leg) - foot_target(t, leg);
        sum += 500.0 * off * off;
    }
    for (int i = 0; i < LIMBS; i++)
        sum += 0.02 * u[i] * u[i];
    return sum;
}

static inline void quadruped_judge(double left, const double *q, double worst[2]) {
    if (left <= 1.0)
        worst[0] = fmax(worst[0], fabs(q[Y] - stance));
    worst[1] = fmax(worst[1], fabs(q[PITCH]));
}

static inline void quadruped_report(const double worst[2]) {
    printf("in the last second within %.4f m of its height; never pitched by more than %.3f rad\n", worst[0], worst[1]);
}

static inline void quadruped_write(FILE *csv, double t, const double *q, const double *v, const double *torque) {
    double largest = 0.0;
    (void)v;
    for (int i = FIRST_LEG; i < FIRST_LEG + LIMBS; i++)
        largest = fmax(largest, fabs(torque[i]));
    fprintf(csv, "%.9g,%.17g,%.17g,%.17g,%.17g", t, q[X], q[Y], q[PITCH], largest);
    for (int leg = 0; leg < LEGS; leg++)
        fprintf(csv, ",%.17g,%.17g", foot_height(q, leg), foot_target(t, leg));
    fprintf(csv, "\n");
}

/* Changes of the targets of joints, in rad. */
static const robot quadruped = {
    .columns = "time,x,height,pitch,torque,foot.0,target.0,foot.1,target.1,foot.2,target.2,foot.3,target.3",
    .describe = quadruped_describe,
    .write = quadruped_write,
    .cost = quadruped_cost,
    .coordinates = FIRST_LEG + LIMBS,
    .first_driven = FIRST_LEG,
    .inputs = LIMBS,
    .horizon = 10,
    .rollouts = 64,
    .sample = 0.02,
    .duration = 2.0,
    .job = {.task = KT_BATCH_SEMI_IMPLICIT_STEP, .h = 0.0025, .steps = 8},
    .gain = 60.0,
    .limit = 0.5,
    .spread = 0.15,
    .smooth = 0.8,
    .last = 1.0,
    .temperature = 0.1,
    .judge = quadruped_judge,
    .report = quadruped_report,
};

#endif
