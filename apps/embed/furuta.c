/* A Furuta pendulum, swung up and balanced by a controller that learns all it needs from the library's own model.
 *
 *     embed-furuta [--csv FILE]
 *
 * The plant is a kt_simulation. The controller is what would run on the real device: every 2 ms it reads two encoders
 * (quantised), takes speeds from their filtered differences, and asks for a torque, which is limited and reaches the
 * motor one sample later. After 8 s the pendulum's tip gets a knock.
 *
 * Swing-up by energy (Astrom and Furuta 2000, Automatica 36, 287-295): an acceleration s of the arm feeds the power
 * -M12 theta' s into the pendulum, so s = -k E M12 / M22 theta', less a spring and a damper that keep the arm near its
 * place, with E the energy that is lacking and M the mass matrix. The torque for it is s M11 + theta'' M12 + h1, where
 * theta'' M22 = -h2 - M12 s and h is the bias force: both come from the library's recursions at every sample.
 *
 * Balance by a linear quadratic regulator: at start the model is linearised upright, x' = A x + B u, and u = -K x with
 * K = B'X / r minimises the integral of x'Qx + r u^2, where X solves A'X + X A - X B B'X / r + Q = 0. The columns of
 * (U1; U2) that span the stable subspace of the Hamiltonian matrix (A, -B B'/r; -Q, -A'), found by LAPACK's ordered
 * Schur form, give X = U2 U1^-1 (Laub 1979, IEEE Trans. Automatic Control 24, 913-921). Against the delay the regulator
 * is given the state that the model foresees for the time when the torque arrives, x + T (A x + B w).
 */
#include <kinetree/kinetree.h>
#include <lapacke.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { N = 4 }; /* states: angles of arm and pendulum, and their speeds */

static const double pi = 3.14159265358979323846;
static const double sample = 2e-3, duration = 12.0;                /* s */
static const double limit = 0.08;                                  /* N m, of the motor */
static const double count = 2.0 * 3.14159265358979323846 / 8192.0; /* rad, of the encoders */
static const double near = 0.4, lost = 0.7;                        /* rad */
static const double smoothing = 0.6;                               /* of the speeds: weight of what was before */
static const double knock_time = 8.0, knock_length = 0.02, knock_force = 0.2; /* on the tip: s, s, N */
static const double pump = 3000.0, fastest = 50.0; /* of the arm's acceleration in swinging up: 1/(J s), 1/s^2 */
static const double surplus = 0.2;                 /* of energy, part of m g l: the arm's spring takes some back */
static const double centre[2] = {10.0, 2.0};       /* its spring and damper, 1/s^2, 1/s */
static const double arm_length = 0.2, pendulum_length = 0.25; /* m */

/* All memory that the library gets after the model is compiled: nothing is allocated. */
static _Alignas(KT_ALIGNMENT) unsigned char plant_memory[32 * 1024], design_memory[32 * 1024], data_memory[8 * 1024];

static kt_status describe(kt_model **model, kt_error *error) {
    kt_body bodies[2] = {kt_body_default(), kt_body_default()};
    kt_body *arm = &bodies[0], *pendulum = &bodies[1];
    arm->name = "arm";
    arm->joint.type = KT_JOINT_REVOLUTE; /* about z, the default */
    arm->mass = 0.1;
    arm->shape.type = KT_SHAPE_ROD;
    arm->shape.to = kt_vec3_make(arm_length, 0.0, 0.0);
    arm->shape.radius = 0.005;
    arm->com_of_shape = arm->inertia_of_shape = true;

    pendulum->name = "pendulum"; /* upright at zero, hangs at the start */
    pendulum->parent = "arm";
    pendulum->joint.type = KT_JOINT_REVOLUTE;
    pendulum->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    pendulum->joint.at = kt_vec3_make(arm_length, 0.0, 0.0);
    pendulum->joint.position[0] = pi;
    pendulum->mass = 0.03;
    pendulum->shape = arm->shape;
    pendulum->shape.to = kt_vec3_make(0.0, 0.0, pendulum_length);
    pendulum->com_of_shape = pendulum->inertia_of_shape = true;

    kt_description furuta = kt_description_default();
    furuta.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    furuta.bodies = bodies;
    furuta.body_count = 2;
    return kt_model_compile(&furuta, NULL, model, error); /* copies all that it needs */
}

/* ---- the design: all that the controller knows of the plant, asked from the model at start ----------------------- */

typedef struct design {
    double a[N * N], b[N]; /* column-major */
    double gain[N];        /* K */
    double residual;       /* of the Riccati equation, against Q's largest */
    double inertia;        /* of the pendulum about its joint, kg m^2 */
    double weight;         /* m g l, N m */
} design;

static const double cost[N] = {1.0, 5.0, 0.02, 0.02}, price = 500.0; /* Q, diagonal, and r */

static lapack_logical is_stable(const double *re, const double *im) {
    (void)im;
    return *re < 0.0;
}

/* The largest number of A'X + X A - X B B'X / r + Q, with K = B'X / r. */
static double riccati_residual(const design *d, const double *x) {
    double most = 0.0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double sum = (i == j ? cost[i] : 0.0) - price * d->gain[i] * d->gain[j];
            for (int k = 0; k < N; k++)
                sum += d->a[i * N + k] * x[j * N + k] + x[k * N + i] * d->a[j * N + k];
            most = fmax(most, fabs(sum));
        }
    return most / cost[1];
}

static int solve_riccati(design *d) {
    enum { M = 2 * N };
    double h[M * M] = {0.0}, u[M * M], re[M], im[M], u1t[N * N], x[N * N];
    lapack_int stable, pivots[N];
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            h[j * M + i] = d->a[j * N + i];
            h[(N + j) * M + i] = -d->b[i] * d->b[j] / price;
            h[(N + j) * M + N + i] = -d->a[i * N + j];
        }
    for (int i = 0; i < N; i++)
        h[i * M + N + i] = -cost[i];
    if (LAPACKE_dgees(LAPACK_COL_MAJOR, 'V', 'S', is_stable, M, h, M, &stable, re, im, u, M) != 0 || stable != N)
        return 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) { /* X = U2 U1^-1 is symmetric: U1' X = U2' */
            u1t[j * N + i] = u[i * M + j];
            x[j * N + i] = u[i * M + N + j];
        }
    if (LAPACKE_dgesv(LAPACK_COL_MAJOR, N, N, u1t, N, pivots, x, N) != 0)
        return 0;
    for (int j = 0; j < N; j++) {
        d->gain[j] = 0.0;
        for (int i = 0; i < N; i++)
            d->gain[j] += d->b[i] * x[j * N + i] / price;
    }
    d->residual = riccati_residual(d, x);
    return 1;
}

static kt_status find_design(const kt_model *model, kt_data *data, design *d, kt_error *error) {
    const int motor = kt_body_coordinates(model, kt_body_find(model, "arm")).v;
    const double upright[2] = {0.0, 0.0}, rest[2] = {0.0, 0.0};
    const kt_linearization_options options = {.inputs = &motor, .input_count = 1};
    kt_linearization *linearization = NULL;
    double mass[4];
    kt_status status =
        kt_linearization_place(model, &options, design_memory, sizeof design_memory, &linearization, error);
    if (status == KT_OK)
        status = kt_linearization_evaluate(linearization, 0.0, upright, rest, NULL, error);
    if (status == KT_OK)
        status = kt_dynamics_mass(model, data, upright, mass, error);
    if (status == KT_OK)
        status = kt_kinematics_update(model, data, upright, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    const kt_linear_system *s = kt_linearization_system(linearization);
    memcpy(d->a, s->state, sizeof d->a);
    memcpy(d->b, s->input, sizeof d->b);
    d->inertia = mass[3];
    d->weight = kt_potential_energy(model, data); /* the arm's own is zero */
    if (!solve_riccati(d))
        return kt_error_set(error, KT_ERROR_SINGULAR, "design", "the Riccati equation has no solution");
    return KT_OK;
}

/* ---- the controller: called once a sample, knows encoder counts alone -------------------------------------------- */

typedef struct controller {
    design design;
    double x[N];    /* angles, the pendulum's counted from upright; filtered speeds */
    double waiting; /* the torque that was asked for last, on its way to the motor */
    int is_balancing;
} controller;

static double from_upright(double angle) { return remainder(angle, 2.0 * pi); }

static void read_sensors(controller *c, const double counts[2]) {
    for (int i = 0; i < 2; i++) {
        const double angle = i == 0 ? counts[0] * count : from_upright(counts[1] * count);
        const double speed = from_upright(angle - c->x[i]) / sample;
        c->x[2 + i] = smoothing * c->x[2 + i] + (1.0 - smoothing) * speed;
        c->x[i] = angle;
    }
}

static kt_status swing_up(const kt_model *model, kt_data *data, const controller *c, double *u, kt_error *error) {
    const design *d = &c->design;
    double mass[4], bias[2];
    kt_status status = kt_dynamics_mass(model, data, c->x, mass, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(model, data, c->x, c->x + 2, NULL, NULL, bias, error);
    if (status != KT_OK)
        return status;
    const double lack = d->weight * (surplus + 1.0 - cos(c->x[1])) - 0.5 * d->inertia * c->x[3] * c->x[3];
    const double speed = c->x[3] + 1e-2; /* with a nudge to begin with */
    const double feed = fmax(-fastest, fmin(fastest, -pump * lack * speed * mass[1] / mass[3]));
    const double s = feed - centre[0] * c->x[0] - centre[1] * c->x[2];
    *u = mass[0] * s - mass[1] * (bias[1] + mass[1] * s) / mass[3] + bias[0];
    return KT_OK;
}

static double regulate(const controller *c) {
    const design *d = &c->design;
    double u = 0.0;
    for (int i = 0; i < N; i++) {
        double ahead = c->x[i] + sample * d->b[i] * c->waiting; /* c->waiting acts until the next sample */
        for (int j = 0; j < N; j++)
            ahead += sample * d->a[j * N + i] * c->x[j];
        u -= d->gain[i] * ahead;
    }
    return u;
}

/* Balances from where the regulator asks for no more than the motor can give, until the pendulum has fallen. */
static kt_status control(const kt_model *model, kt_data *data, controller *c, const double counts[2], kt_error *error) {
    kt_status status = KT_OK;
    read_sensors(c, counts);
    double u = regulate(c);
    if (fabs(c->x[1]) > (c->is_balancing ? lost : near) || (!c->is_balancing && fabs(u) > limit)) {
        c->is_balancing = 0;
        status = swing_up(model, data, c, &u, error);
    } else {
        c->is_balancing = 1;
    }
    if (status == KT_OK)
        c->waiting = fmax(-limit, fmin(limit, u));
    return status;
}

/* ---- the experiment ---------------------------------------------------------------------------------------------- */

/* A force on the pendulum's tip, across it: a wrench about the origin of the body frame, world axes. */
static kt_wrench knock_on(const kt_model *model, kt_data *data, int body) {
    const kt_mat3 axes = kt_body_pose(model, data, body).rotation;
    const kt_vec3 force = kt_vec3_scale(knock_force, axes.y);
    return (kt_wrench){kt_vec3_cross(kt_vec3_scale(pendulum_length, axes.z), force), force};
}

typedef struct findings {
    double caught, most, late; /* when the pendulum is first held; the largest torque; the largest angle at the end */
} findings;

static kt_status experiment(const kt_model *model, kt_data *data, controller *c, kt_simulation *plant, FILE *csv,
                            findings *f, kt_error *error) {
    const int pendulum = kt_body_find(model, "pendulum");
    const double *q = kt_simulation_positions(plant), *v;
    kt_status status = KT_OK;
    *f = (findings){.caught = NAN};
    for (long k = 0; status == KT_OK && (double)k * sample < duration; k++, q = kt_simulation_positions(plant)) {
        const double t = (double)k * sample, torque[2] = {c->waiting, 0.0};
        const double counts[2] = {round(q[0] / count), round(q[1] / count)};
        v = kt_simulation_velocities(plant);
        status = control(model, data, c, counts, error);
        if (c->is_balancing && isnan(f->caught))
            f->caught = t;
        f->most = fmax(f->most, fabs(torque[0]));
        f->late = t >= duration - 2.0 ? fmax(f->late, fabs(from_upright(q[1]))) : f->late;
        if (csv != NULL)
            fprintf(csv, "%.9g,%.17g,%.17g,%.9g,%.9g,%.9g\n", t, q[0], q[1], v[0], v[1], torque[0]);
        kt_wrench wrenches[3] = {0};
        if (status == KT_OK && t >= knock_time && t < knock_time + knock_length) {
            status = kt_kinematics_update(model, data, q, NULL, NULL, error);
            wrenches[pendulum] = knock_on(model, data, pendulum);
        }
        if (status == KT_OK)
            status = kt_simulation_set_wrenches(plant, wrenches, error);
        if (status == KT_OK)
            status = kt_simulation_set_torque(plant, torque, error);
        if (status == KT_OK)
            status = kt_simulation_advance(plant, (double)(k + 1) * sample, error);
    }
    return status;
}

int main(int argc, char **argv) {
    FILE *csv = argc == 3 && strcmp(argv[1], "--csv") == 0 ? fopen(argv[2], "w") : NULL;
    if (argc != 1 && csv == NULL) {
        fprintf(stderr, "usage: %s [--csv FILE], a file that can be written\n", argv[0]);
        return 2;
    }
    kt_error error;
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_simulation *plant = NULL;
    kt_run fixed = kt_run_default();
    fixed.integrator = "rk4";
    fixed.step = 1e-3;
    controller c = {.x = {0.0, pi, 0.0, 0.0}};
    findings f = {0};
    if (csv != NULL)
        fprintf(csv, "time,position.arm,position.pendulum,velocity.arm,velocity.pendulum,torque.motor\n");
    kt_status status = describe(&model, &error);
    if (status == KT_OK)
        status = kt_data_place(model, data_memory, sizeof data_memory, &data, &error);
    if (status == KT_OK)
        status = kt_simulation_place(model, &fixed, NULL, plant_memory, sizeof plant_memory, &plant, &error);
    if (status == KT_OK)
        status = find_design(model, data, &c.design, &error);
    if (status == KT_OK)
        status = experiment(model, data, &c, plant, csv, &f, &error);
    if (csv != NULL && fclose(csv) != 0 && status == KT_OK)
        status = kt_error_set(&error, KT_ERROR_FILE, argv[2], "cannot be written");
    if (status == KT_OK) {
        printf("gain: arm %.4f, pendulum %.4f N m/rad, speeds %.4f, %.4f N m s/rad; Riccati residual %.1e\n",
               c.design.gain[0], c.design.gain[1], c.design.gain[2], c.design.gain[3], c.design.residual);
        printf("caught after %.3f s, knocked at %.0f s; in the last 2 s within %.4f rad of upright\n", f.caught,
               knock_time, f.late);
        printf("largest torque %.4f N m of %.4f N m allowed\n", f.most, limit);
    } else {
        fprintf(stderr, "%s: %s\n", error.where, error.message);
    }
    kt_model_free(model);
    return status == KT_OK ? 0 : 1;
}
