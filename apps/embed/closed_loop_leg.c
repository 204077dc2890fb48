/* A leg with a four-bar linkage whose foot follows a path: a mechanism with a closed loop within a control loop.
 *
 *     embed-closed_loop_leg [--csv FILE]
 *
 *     hip o===crank     There are two motors at the hip: one rotates the thigh, the other a crank on the thigh.
 *         |\   |        The crank bends the knee through a rod. Thigh, crank, rod and shank form a loop: four
 *   thigh | \  | rod    joints with two degrees of freedom.
 *    knee o==lever      Every millisecond the controller reads the encoders of the two motors (quantised) and their
 *        /              speeds. These are its only measurements. Then it takes two steps:
 *       / shank
 *   foot
 *
 * 1. kt_state_assemble closes the loop with the motors' joints held, which gives angles and speeds of knee and rod.
 * 2. The foot is to have the acceleration s = r'' + D (r' - p') + K (r - p). Its acceleration
 *    p'' = p0'' + sum_i c_i u_i is affine in the torques u of the motors, also in the presence of loops. Three
 *    evaluations of the acceleration, without torques and with one unit torque each, therefore give p0'', c_1 and c_2.
 *    Two linear equations then give the torques.
 *
 * The experiment is run twice. The plant first equals the controller's model. Then it has 0.2 kg on the foot and
 * friction in the joints, both unknown to the controller. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { THIGH = 0, CRANK, ROD, SHANK, JOINTS, MOTORS = 2 }; /* order of the coordinates in q and v */

static const double sample = 1e-3, duration = 3.0, settled = 0.5;   /* s */
static const double count = 2.0 * 3.14159265358979323846 / 65536.0; /* rad, of the encoders */
static const double stiffness = 2500.0, damping = 100.0;            /* K in s^-2, D in s^-1 */
static const double limit = 120.0;                                  /* N m, of each motor */
static const kt_vec3 foot = {0.0, -0.4, 0.0};                       /* on the shank, m */

/* ---- the mechanism ----------------------------------------------------------------------------------------------- */

static kt_body link_from(const char *name, const char *parent, kt_vec3 at, kt_vec3 to, double mass, double angle) {
    kt_body body = kt_body_default();
    body.name = name;
    body.parent = parent;
    body.joint.type = KT_JOINT_REVOLUTE; /* about z; x is forward, y is up */
    body.joint.at = at;
    body.joint.position[0] = angle;
    body.mass = mass;
    body.shape.type = KT_SHAPE_ROD;
    body.shape.to = to;
    body.com_of_shape = body.inertia_of_shape = true;
    return body;
}

/* load: mass on the foot, kg; friction: viscous, in every joint, N m s. */
static kt_status describe(double load, double friction, kt_model **model, kt_error *error) {
    const kt_vec3 hip = {0.0, 0.0, 0.0}, knee = {0.0, -0.4, 0.0};
    const kt_vec3 end = {-0.07, 0.0, 0.0}, down = {0.0, -0.4, 0.0}, lever = {-0.031, -0.039, 0.0};
    const char *held[MOTORS] = {"thigh", "crank"};
    kt_body bodies[JOINTS + 1] = {
        [THIGH] = link_from("thigh", NULL, hip, knee, 3.0, 0.5),
        [CRANK] = link_from("crank", "thigh", hip, end, 0.3, 0.0),
        [ROD] = link_from("rod", "crank", end, down, 0.3, 0.05),
        [SHANK] = link_from("shank", "thigh", knee, foot, 1.5, -0.9),
        [JOINTS] = link_from("load", "shank", foot, hip, load, 0.0),
    };
    bodies[JOINTS].joint.type = KT_JOINT_FIXED;
    bodies[JOINTS].shape.type = KT_SHAPE_NONE;
    bodies[JOINTS].com_of_shape = bodies[JOINTS].inertia_of_shape = false;

    kt_loop pin = kt_loop_default();
    pin.name = "pin";
    pin.type = KT_LOOP_REVOLUTE;
    pin.between[0].body = "rod";
    pin.between[0].at = down;
    pin.between[1].body = "shank";
    pin.between[1].at = lever;

    kt_effect dampers[JOINTS];
    for (int i = 0; i < JOINTS; i++) {
        dampers[i] = kt_effect_default();
        dampers[i].type = KT_EFFECT_JOINT_DAMPER;
        dampers[i].joint = bodies[i].name;
        dampers[i].damping = friction;
    }
    kt_description leg = kt_description_default();
    leg.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    leg.bodies = bodies;
    leg.body_count = load > 0.0 ? JOINTS + 1 : JOINTS;
    leg.loops = &pin;
    leg.loop_count = 1;
    leg.effects = dampers;
    leg.effect_count = friction > 0.0 ? JOINTS : 0;
    leg.hold = held; /* kt_state_assemble leaves these coordinates unchanged */
    leg.hold_count = MOTORS;
    return kt_model_compile(&leg, NULL, model, error);
}

/* ---- the controller ---------------------------------------------------------------------------------------------- */

typedef struct controller {
    const kt_model *model;
    kt_data *data;
    int shank;
    double q[JOINTS], v[JOINTS]; /* estimated state; the last two elements also start the next assembly */
    kt_vec3 position;            /* of the foot, estimated, m */
} controller;

/* The path at t with its derivatives r, r', r'': an ellipse, 0.3 m long and 0.12 m high, two revolutions per second. */
static void path_at(double t, kt_vec3 r[3]) {
    const double w = 4.0 * 3.14159265358979323846, a = w * t;
    r[0] = kt_vec3_make(0.15 * cos(a), -0.66 + 0.06 * sin(a), 0.0);
    r[1] = kt_vec3_make(-0.15 * w * sin(a), 0.06 * w * cos(a), 0.0);
    r[2] = kt_vec3_make(-0.15 * w * w * cos(a), -0.06 * w * w * sin(a), 0.0);
}

/* Computes the foot's acceleration under the joint torques tau. */
static kt_status foot_acceleration(const controller *c, const double *tau, kt_vec3 *acceleration, kt_error *error) {
    double a[JOINTS];
    kt_status status = kt_acceleration_evaluate(c->model, c->data, 0.0, c->q, c->v, tau, NULL, a, error);
    if (status == KT_OK)
        status = kt_kinematics_update(c->model, c->data, c->q, c->v, a, error);
    if (status == KT_OK)
        *acceleration = kt_point_acceleration(c->model, c->data, c->shank, foot);
    return status;
}

/* Computes the torques at t. angle, speed: of the motors, as measured; torque: of all joints; only those of the motors
 * are written. */
static kt_status control(controller *c, double t, const double *angle, const double *speed, double *torque,
                         kt_error *error) {
    kt_vec3 r[3], p[1 + MOTORS], s;
    memcpy(c->q, angle, MOTORS * sizeof(double));
    memcpy(c->v, speed, MOTORS * sizeof(double));
    kt_status status = kt_state_assemble(c->model, c->data, t, c->q, c->v, error);
    for (int i = 0; i <= MOTORS && status == KT_OK; i++) {
        const double unit[JOINTS] = {i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0, 0.0, 0.0};
        status = foot_acceleration(c, unit, &p[i], error);
    }
    if (status != KT_OK)
        return status;
    c->position = kt_point_position(c->model, c->data, c->shank, foot);
    const kt_vec3 velocity = kt_point_velocity(c->model, c->data, c->shank, foot);
    path_at(t, r);
    s = kt_vec3_add(kt_vec3_scale(stiffness, kt_vec3_sub(r[0], c->position)),
                    kt_vec3_scale(damping, kt_vec3_sub(r[1], velocity)));
    s = kt_vec3_sub(kt_vec3_add(s, r[2]), p[0]);
    const kt_vec3 c1 = kt_vec3_sub(p[1], p[0]), c2 = kt_vec3_sub(p[2], p[0]);
    const double determinant = c1.x * c2.y - c2.x * c1.y; /* zero if the leg or its linkage is stretched */
    torque[THIGH] = fmax(-limit, fmin(limit, (s.x * c2.y - c2.x * s.y) / determinant));
    torque[CRANK] = fmax(-limit, fmin(limit, (c1.x * s.y - s.x * c1.y) / determinant));
    return KT_OK;
}

/* ---- the experiment ---------------------------------------------------------------------------------------------- */

/* Largest distance of the foot from its path after settling (m), largest torque (N m) and largest residual of the
 * loop. */
typedef struct findings {
    double error, torque, open;
} findings;

static kt_status experiment(const kt_model *plant, controller *c, FILE *csv, findings *f, kt_error *error) {
    kt_run fixed = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    fixed.integrator = "rk4";
    fixed.step = sample;
    fixed.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_CONSTRAINT;
    options.kinematics = true; /* for the position of the plant's foot, which the controller does not use */
    kt_simulation *simulation = NULL;
    kt_status status = kt_simulation_create(plant, &fixed, &options, &simulation, error);
    *f = (findings){0};
    kt_model_initial(c->model, c->q, c->v);
    for (long k = 0; status == KT_OK && (double)k * sample < duration; k++) {
        const double t = (double)k * sample;
        double torque[JOINTS] = {0.0};
        kt_record seen;
        kt_vec3 r[3];
        path_at(t, r);
        status = kt_simulation_sense(simulation, &seen, error);
        if (status != KT_OK)
            break;
        const double angle[MOTORS] = {count * round(seen.q[THIGH] / count), count * round(seen.q[CRANK] / count)};
        const kt_vec3 p = kt_point_position(plant, seen.data, c->shank, foot);
        status = control(c, t, angle, seen.v, torque, error);
        f->open = fmax(f->open, seen.constraint.position);
        f->torque = fmax(f->torque, fmax(fabs(torque[THIGH]), fabs(torque[CRANK])));
        f->error = t >= settled ? fmax(f->error, kt_vec3_norm(kt_vec3_sub(p, r[0]))) : f->error;
        if (csv != NULL)
            fprintf(csv, "%.9g,%.17g,%.17g,%.17g,%.17g,%.9g,%.9g,%.9g\n", t, p.x, p.y, r[0].x, r[0].y, torque[THIGH],
                    torque[CRANK], seen.constraint.position);
        if (status == KT_OK)
            status = kt_simulation_set_torque(simulation, torque, error);
        if (status == KT_OK)
            status = kt_simulation_tick(simulation, sample, error);
    }
    kt_simulation_free(simulation);
    return status;
}

int main(int argc, char **argv) {
    FILE *csv = argc == 3 && strcmp(argv[1], "--csv") == 0 ? fopen(argv[2], "w") : NULL;
    if (argc != 1 && csv == NULL) {
        fprintf(stderr, "usage: %s [--csv FILE], a file that can be written\n", argv[0]);
        return 2;
    }
    static _Alignas(KT_ALIGNMENT) unsigned char memory[32 * 1024]; /* the controller's workspace */
    kt_error error;
    kt_model *known = NULL, *loaded = NULL;
    controller c = {0};
    findings exact, rough;
    kt_status status = describe(0.0, 0.0, &known, &error);
    if (status == KT_OK)
        status = describe(0.2, 0.05, &loaded, &error);
    if (status == KT_OK)
        status = kt_data_init(known, memory, sizeof memory, &c.data, &error);
    if (status == KT_OK) {
        c.model = known;
        c.shank = kt_body_find(known, "shank");
        status = experiment(known, &c, NULL, &exact, &error);
    }
    if (csv != NULL)
        fprintf(csv, "time,marker.foot.x,marker.foot.y,marker.path.x,marker.path.y,torque.hip,torque.crank,constraint."
                     "position\n");
    if (status == KT_OK)
        status = experiment(loaded, &c, csv, &rough, &error);
    if (csv != NULL && fclose(csv) != 0 && status == KT_OK)
        status = kt_error_set(&error, KT_ERROR_FILE, argv[2], "cannot be written");
    if (status == KT_OK) {
        const kt_mobility dof = kt_model_mobility(known);
        printf("%d joints, %d freedoms; the controller works in %zu bytes\n", dof.tree, dof.minimal,
               kt_data_size(known));
        printf("model known: foot within %.3f mm of its path, torques up to %.1f N m\n", 1e3 * exact.error,
               exact.torque);
        printf("load and friction unknown: within %.3f mm, up to %.1f N m; the loop is open by %.1e m at most\n",
               1e3 * rough.error, rough.torque, rough.open);
    } else {
        fprintf(stderr, "%s: %s\n", error.where, error.message);
    }
    kt_model_free(loaded);
    kt_model_free(known);
    return status == KT_OK ? 0 : 1;
}
