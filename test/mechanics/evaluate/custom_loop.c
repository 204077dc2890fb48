/* Loops from C against the library's own: a distance that changes with time, and a knife edge. Both are written once
 * more as callbacks that give everything, rows alone, or residuals alone. Some callbacks reject. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

#include "kinetree/kinetree.h"

#include <math.h>
#include <string.h>

/* ---- the loops --------------------------------------------------------------------------------------------------- */

/* |d| = 1.5 + 0.2 sin(2 t) */
static int keep_distance(void *user, double t, const kt_loop_motion *m, kt_loop_equation *row) {
    const kt_loop_given given = *(const kt_loop_given *)user;
    const double norm = kt_vec3_norm(m->position);
    const kt_vec3 n = kt_vec3_scale(1.0 / norm, m->position), across = kt_vec3_cross(n, m->velocity);
    row->residual = norm - 1.5 - 0.2 * sin(2.0 * t);
    if (given == KT_LOOP_GIVES_RESIDUAL)
        return 0;
    row->force = n;
    row->rate = -0.4 * cos(2.0 * t);
    if (given == KT_LOOP_GIVES_ALL)
        row->drift = kt_vec3_dot(across, across) / norm + 0.8 * sin(2.0 * t);
    return 0;
}

/* No velocity along the second end's y axis. */
static int glide(void *user, double t, const kt_loop_motion *m, kt_loop_equation *row) {
    (void)t;
    row->force = m->rotation.y;
    if (*(const kt_loop_given *)user == KT_LOOP_GIVES_ALL)
        row->drift = kt_vec3_dot(kt_vec3_cross(m->omega, m->rotation.y), m->velocity);
    return 0;
}

/* A turn about the axis between two bodies: the angle of a hinge is 0.3 t, and its other two angles are 0. */
static int turn(void *user, double t, const kt_loop_motion *m, kt_loop_equation *row) {
    (void)user;
    row[0].residual = atan2(m->rotation.x.y, m->rotation.x.x) - 0.3 * t;
    row[1].residual = m->rotation.z.x;
    row[2].residual = m->rotation.z.y;
    return 0;
}

/* The second end's z axis stays normal to the first's: c = e . f = 0. */
static int keep_normal(void *user, double t, const kt_loop_motion *m, kt_loop_equation *row) {
    const kt_loop_given given = *(const kt_loop_given *)user;
    const kt_vec3 e = kt_vec3_make(0.0, 0.0, 1.0), f = m->rotation.z;
    (void)t;
    row->residual = kt_vec3_dot(e, f);
    if (given == KT_LOOP_GIVES_RESIDUAL)
        return 0;
    row->moment = kt_vec3_cross(f, e);
    if (given == KT_LOOP_GIVES_ALL)
        row->drift = kt_vec3_dot(e, kt_vec3_cross(m->omega, kt_vec3_cross(m->omega, f)));
    return 0;
}

static int reject(void *user, double t, const kt_loop_motion *m, kt_loop_equation *row) {
    (void)m;
    row->residual = m->position.x;
    row->force = kt_vec3_make(1.0, 0.0, 0.0);
    return t > 0.1 ? *(const int *)user : 0;
}

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

typedef struct mechanism {
    kt_body body[2];
    kt_loop loop[2];
    kt_description description;
    kt_model *model;
    kt_data *data;
} mechanism;

static kt_body box(const char *name, kt_joint_type type) {
    kt_body body = kt_body_of(name, NULL, type, 1.3);
    body.com = kt_vec3_make(0.1, 0.05, -0.02);
    body.inertia = (kt_sym3){0.05, 0.08, 0.06, 0.0, 0.0, 0.0};
    return body;
}

static void describe(mechanism *m, bool planar) {
    memset(m, 0, sizeof *m);
    m->body[0] = box("arm", KT_JOINT_REVOLUTE);
    m->body[0].joint.position[0] = 0.4;
    m->body[0].joint.velocity[0] = 0.7;
    m->body[1] = box("sled", planar ? KT_JOINT_PLANAR : KT_JOINT_FREE);
    const double position[7] = {1.0, 1.2, planar ? 0.3 : 0.2, 0.9, 0.1, -0.3, 0.2},
                 velocity[6] = {0.3, -0.2, 0.5, 0.4, 0.1, -0.6};
    memcpy(m->body[1].joint.position, position, sizeof position);
    memcpy(m->body[1].joint.velocity, velocity, sizeof velocity);
    if (!planar) {
        double norm = 0.0;
        for (int i = 3; i < 7; i++)
            norm += position[i] * position[i];
        for (int i = 3; i < 7; i++)
            m->body[1].joint.position[i] /= sqrt(norm);
    }
    m->description = kt_description_default();
    m->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    m->description.bodies = m->body;
    m->description.body_count = 2;
    m->description.loops = m->loop;
    for (int i = 0; i < 2; i++) {
        m->loop[i] = kt_loop_default();
        m->loop[i].between[0].body = i ? NULL : "arm";
        m->loop[i].between[0].at = kt_vec3_make(i ? 0.0 : 0.3, 0.0, 0.0);
        m->loop[i].between[1].body = "sled";
        m->loop[i].between[1].at = kt_vec3_make(0.1, 0.2, planar ? 0.0 : 0.1);
    }
    m->loop[0].name = "rod";
    m->loop[1].name = "edge";
}

static void describe_own(mechanism *m) {
    m->loop[0].type = KT_LOOP_DISTANCE;
    m->loop[0].function = kt_function_sine(0.2, 1.0 / 3.14159265358979323846, 0.0, 1.5);
    m->loop[1].type = KT_LOOP_KNIFE_EDGE;
    m->loop[1].axis = kt_vec3_make(0.0, 1.0, 0.0);
    m->description.loop_count = 2;
}

static void describe_custom(mechanism *m, kt_loop_given *given) {
    static kt_loop_given rows;
    rows = *given == KT_LOOP_GIVES_ALL ? KT_LOOP_GIVES_ALL : KT_LOOP_GIVES_ROWS;
    m->loop[0].type = m->loop[1].type = KT_LOOP_CUSTOM;
    m->loop[0].equations = keep_distance;
    m->loop[1].equations = glide;
    m->loop[0].equation_count = m->loop[1].equation_count = 1;
    m->loop[0].driven = true;
    m->loop[0].given = *given;
    m->loop[1].given = rows;
    m->loop[0].user = given;
    m->loop[1].user = &rows;
    m->loop[1].holonomic = false;
    m->description.loop_count = 2;
}

static void compile(mechanism *m) {
    m->model = kt_test_model(&m->description, NULL);
    m->data = kt_test_data(m->model);
}

enum { NQ = 8, NV = 7 };

typedef struct result {
    double q[NQ], v[NV], a[NV];
    kt_wrench joints[3], loops[2];
    double multipliers[2];
    bool closed;
    double moved; /* the largest difference of the assembled states */
} result;

static double largest_difference(const double *a, const double *b, int count) {
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = isnan(a[i] - b[i]) ? (double)NAN : fmax(most, fabs(a[i] - b[i]));
    return most;
}

/* `at`: the state where accelerations are compared; NULL: the assembled one. */
static void evaluate(mechanism *m, const result *at, result *r) {
    const double t = 0.3;
    kt_error e = {0};
    memset(r, 0, sizeof *r);
    kt_model_initial(m->model, r->q, r->v);
    r->closed = kt_state_assemble(m->model, m->data, t, r->q, r->v, &e) == KT_OK;
    if (at) {
        r->moved = fmax(largest_difference(r->q, at->q, NQ), largest_difference(r->v, at->v, NV));
        memcpy(r->q, at->q, sizeof r->q);
        memcpy(r->v, at->v, sizeof r->v);
    }
    if (!kt_check_true("assembles", r->closed) ||
        !kt_fine("accelerates", kt_acceleration_evaluate(m->model, m->data, t, r->q, r->v, NULL, NULL, r->a, &e), &e))
        return;
    (void)kt_fine("reacts", kt_reaction_evaluate(m->model, m->data, t, r->q, r->v, NULL, NULL, r->joints, r->loops, &e),
                  &e);
    (void)kt_fine("multipliers",
                  kt_multiplier_evaluate(m->model, m->data, t, r->q, r->v, NULL, NULL, r->multipliers, &e), &e);
}

/* Assemblies close to 1e-12. At one state, a callback that gives everything has an error of rounding. First differences
 * leave 1e-12 of numbers up to 20. Second ones leave 1e-10. */
KT_TEST(loops_written_once_more_do_the_same) {
    static const double bounds[3] = {2e-10, 4e-12, 2e-14};
    for (int planar = 0; planar < 2; planar++) {
        mechanism own;
        result expected;
        describe(&own, planar);
        describe_own(&own);
        compile(&own);
        evaluate(&own, NULL, &expected);
        kt_check_text("plan", kt_model_plan(own.model), planar ? "planar" : "spatial");
        for (int given = KT_LOOP_GIVES_RESIDUAL; given <= KT_LOOP_GIVES_ALL; given++) {
            mechanism m;
            result found;
            kt_loop_given what = (kt_loop_given)given;
            describe(&m, planar);
            describe_custom(&m, &what);
            compile(&m);
            evaluate(&m, &expected, &found);
            kt_check_text("plan", kt_model_plan(m.model), planar ? "planar" : "spatial");
            kt_check_below("assembled states", found.moved, fmax(bounds[given], 1e-11));
            kt_check_below("accelerations", largest_difference(found.a, expected.a, NV), 20.0 * bounds[given]);
            kt_check_below("multipliers", largest_difference(found.multipliers, expected.multipliers, 2),
                           20.0 * bounds[given]);
            kt_check_below("reactions of loops",
                           largest_difference(&found.loops[0].moment.x, &expected.loops[0].moment.x, 12),
                           20.0 * bounds[given]);
            kt_check_equal_int("equations", kt_model_mobility(m.model).equations, 2);
            kt_check_equal_int("type", kt_loop_type_of(m.model, 1), KT_LOOP_CUSTOM);
        }
    }
}

/* A moment between ends that turn about different axes: the arm about its own, the sled about all. Seen from the arm,
 * the rate of w is w2' - w1' - w1 x w2. The last term is 10 to 20 % of accelerations here. The reference is
 * `orthogonal`, whose equation has the same slope in closed states; bounds as above. */
KT_TEST(moments_between_turning_ends_are_those_of_orthogonal) {
    mechanism own;
    result expected;
    describe(&own, false);
    own.loop[0].type = KT_LOOP_ORTHOGONAL;
    own.description.loop_count = 1;
    compile(&own);
    evaluate(&own, NULL, &expected);
    for (int given = KT_LOOP_GIVES_RESIDUAL; given <= KT_LOOP_GIVES_ALL; given++) {
        mechanism m;
        result found;
        kt_loop_given what = (kt_loop_given)given;
        describe(&m, false);
        m.loop[0].type = KT_LOOP_CUSTOM;
        m.loop[0].equations = keep_normal;
        m.loop[0].equation_count = 1;
        m.loop[0].given = what;
        m.loop[0].user = &what;
        m.description.loop_count = 1;
        compile(&m);
        evaluate(&m, &expected, &found);
        kt_check_below("accelerations", largest_difference(found.a, expected.a, NV), 4e-13);
        kt_check_below("multipliers", largest_difference(found.multipliers, expected.multipliers, 1), 4e-14);
    }
}

/* Derivatives of the accelerations: differences over those of the loops. */
KT_TEST(accelerations_of_custom_loops_have_their_derivatives) {
    static const double bounds[3] = {1e-5, 1e-7, 1e-9};
    static _Alignas(KT_ALIGNMENT) char work[1 << 20];
    mechanism own;
    double expected[3 * NV * NV];
    result at;
    kt_error e = {0};
    describe(&own, false);
    describe_own(&own);
    compile(&own);
    evaluate(&own, NULL, &at);
    (void)kt_fine("derivatives",
                  kt_acceleration_derivatives(own.model, own.data, work, sizeof work, 0.3, at.q, at.v, NULL, NULL,
                                              expected, expected + NV * NV, expected + 2 * NV * NV, &e),
                  &e);
    for (int given = KT_LOOP_GIVES_RESIDUAL; given <= KT_LOOP_GIVES_ALL; given++) {
        mechanism m;
        kt_loop_given what = (kt_loop_given)given;
        double found[3 * NV * NV];
        describe(&m, false);
        describe_custom(&m, &what);
        compile(&m);
        kt_need_fine("derivatives",
                     kt_acceleration_derivatives(m.model, m.data, work, sizeof work, 0.3, at.q, at.v, NULL, NULL, found,
                                                 found + NV * NV, found + 2 * NV * NV, &e),
                     &e);
        kt_check_below("da/dq, da/dv, da/dtau", largest_difference(found, expected, 3 * NV * NV), bounds[given]);
    }
}

/* Rows with moments: a hinge whose angle is driven, by residuals alone. With theta = 0.3 t about a fixed axis the
 * body's acceleration about it is 0. */
KT_TEST(moments_follow_from_residuals) {
    mechanism m;
    describe(&m, false);
    m.loop[0] = m.loop[1];
    m.loop[0].type = KT_LOOP_CUSTOM;
    m.loop[0].equations = turn;
    m.loop[0].equation_count = 3;
    m.loop[0].driven = true;
    m.loop[0].given = KT_LOOP_GIVES_RESIDUAL;
    m.description.loop_count = 1;
    compile(&m);
    double q[NQ], v[NV], a[NV];
    kt_error e = {0};
    kt_model_initial(m.model, q, v);
    kt_need_fine("assembles", kt_state_assemble(m.model, m.data, 0.5, q, v, &e), &e);
    kt_need_fine("accelerates", kt_acceleration_evaluate(m.model, m.data, 0.5, q, v, NULL, NULL, a, &e), &e);
    const int at = kt_body_coordinates(m.model, kt_body_find(m.model, "sled")).v + 3;
    kt_check_near("angular velocity x", v[at], 0.0, 1e-14);
    kt_check_near("angular velocity y", v[at + 1], 0.0, 1e-14);
    kt_check_near("angular velocity z", v[at + 2], 0.3, 2e-13);
    for (int k = 0; k < 3; k++)
        kt_check_near("angular acceleration", a[at + k], 0.0, 5e-13);
}

/* ---- a coupling with a formula ----------------------------------------------------------------------------------- */

enum { SLOPE_STEPS = 20000 };
static const double bowl = 0.4, fall = 9.81;

/* z = c x^2 in a field g along -z:  x'' (1 + 4 c^2 x^2) + 4 c^2 x x'^2 + 2 c g x = 0 */
static double bead_acceleration(double x, double v) {
    return -2.0 * bowl * x * (2.0 * bowl * v * v + fall) / (1.0 + 4.0 * bowl * bowl * x * x);
}

/* The reduced equation by Kutta's method of order four. */
static void slide_bead(double duration, double *x, double *v) {
    const double h = duration / SLOPE_STEPS;
    for (int i = 0; i < SLOPE_STEPS; i++) {
        const double x1 = *v, v1 = bead_acceleration(*x, *v);
        const double x2 = *v + 0.5 * h * v1, v2 = bead_acceleration(*x + 0.5 * h * x1, x2);
        const double x3 = *v + 0.5 * h * v2, v3 = bead_acceleration(*x + 0.5 * h * x2, x3);
        const double x4 = *v + h * v3, v4 = bead_acceleration(*x + h * x3, x4);
        *x += h / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4);
        *v += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    }
}

static void describe_bead(mechanism *m, kt_term terms[2]) {
    memset(m, 0, sizeof *m);
    m->body[0] = box("across", KT_JOINT_PRISMATIC);
    m->body[0].mass = 0.0;
    m->body[0].inertia = (kt_sym3){.xx = 0.0};
    m->body[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    m->body[0].joint.position[0] = 0.8;
    m->body[0].joint.velocity[0] = 0.3;
    m->body[1] = box("up", KT_JOINT_PRISMATIC);
    m->body[1].parent = "across";
    m->body[1].joint.position[0] = 0.8 * 0.8 * bowl;
    m->body[1].joint.velocity[0] = 2.0 * bowl * 0.8 * 0.3;
    m->loop[0] = kt_loop_of("bowl", KT_LOOP_COUPLING);
    m->loop[0].terms = terms;
    m->loop[0].term_count = 2;
    m->loop[0].formula = "-0.4*position.across^2";
    m->description = kt_description_default();
    m->description.gravity = kt_vec3_make(0.0, 0.0, -fall);
    kt_describe(&m->description, m->body, 2, m->loop, 1, NULL, 0);
}

/* Bounds: the tolerances, which both methods keep to (2e-14 and 3e-12 were measured), of velocities three times. */
KT_TEST(bead_on_a_parabola_that_a_formula_gives_moves_as_its_reduced_equation_says) {
    static const char *const methods[] = {"dop853", "radau5"};
    static const double tolerances[] = {1e-12, 1e-11};
    kt_term terms[2] = {{"up", 1.0}, {"across", 0.0}};
    mechanism m;
    double x = 0.8, v = 0.3, a[2];
    kt_error e = {0};
    slide_bead(2.0, &x, &v);
    describe_bead(&m, terms);
    compile(&m);
    kt_need_fine("accelerates",
                 kt_acceleration_evaluate(m.model, m.data, 0.0, (double[]){0.8, 0.256}, (double[]){0.3, 0.192}, NULL,
                                          NULL, a, &e),
                 &e);
    const double expected = bead_acceleration(0.8, 0.3);
    kt_check_near("across", a[0], expected, 1e-14);
    kt_check_near("up", a[1], 2.0 * bowl * (0.3 * 0.3 + 0.8 * expected), 1e-14);
    for (int i = 0; i < 2; i++) {
        kt_run run = kt_run_default();
        run.integrator = methods[i];
        run.relative = run.absolute = tolerances[i];
        kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
        kt_need_fine("runs", kt_simulation_advance(simulation, 2.0, &e), &e);
        kt_check_near("position", kt_simulation_positions(simulation)[0], x, tolerances[i]);
        kt_check_near("velocity", kt_simulation_velocities(simulation)[0], v, 3.0 * tolerances[i]);
        kt_check_near("on the parabola", kt_simulation_positions(simulation)[1], bowl * x * x, tolerances[i]);
    }
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

KT_TEST(rejections_name_the_loop_and_its_code) {
    static const struct {
        int code;
        kt_status status;
        const char *says;
    } table[] = {{3, KT_ERROR_CONSTRAINT, "cannot compute its equations here (code 3)"},
                 {-7, KT_ERROR_CALLBACK, "stopped (code -7)"}};
    for (size_t i = 0; i < 2; i++) {
        mechanism m;
        int code = table[i].code;
        double q[NQ], v[NV], a[NV] = {0.25};
        kt_error e = {0};
        describe(&m, false);
        m.loop[0].type = KT_LOOP_CUSTOM;
        m.loop[0].equations = reject;
        m.loop[0].equation_count = 1;
        m.loop[0].user = &code;
        m.loop[0].given = KT_LOOP_GIVES_ROWS;
        m.description.loop_count = 1;
        compile(&m);
        kt_model_initial(m.model, q, v);
        kt_check_equal_int("before", kt_state_assemble(m.model, m.data, 0.0, q, v, &e), KT_OK);
        kt_check_equal_int("accelerations", kt_acceleration_evaluate(m.model, m.data, 0.5, q, v, NULL, NULL, a, &e),
                           (int)table[i].status);
        kt_note("%s: %s", e.where, e.message);
        kt_check_true("says so", strstr(e.message, table[i].says) != NULL && strstr(e.where, "rod") != NULL);
        kt_check_near("output", a[0], 0.25, 0.0);
        kt_check_equal_int("assembly", kt_state_assemble(m.model, m.data, 0.5, q, v, &e), (int)table[i].status);
        kt_note("%s: %s", e.where, e.message);
        kt_check_true("says so", strstr(e.message, table[i].says) != NULL);
        kt_check_equal_int("projection", kt_state_project(m.model, m.data, 0.5, q, v, NULL, &e), (int)table[i].status);
        kt_check_equal_int("equations", kt_loop_equations(m.model, m.data, 0.5, q, v, NULL, a, NULL, NULL, &e),
                           (int)table[i].status);
    }
}

/* Differences in time reach the callback up to 0.03 s later. */
static int reject_later(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equation) {
    equation->residual = motion->position.x;
    return t > 0.5 ? *(const int *)user : 0;
}

KT_TEST(rejections_of_states_nearby_name_the_loop_and_its_code) {
    mechanism m;
    int code = -7;
    double q[NQ], v[NV], a[NV];
    kt_error e = {0};
    describe(&m, false);
    m.loop[0].type = KT_LOOP_CUSTOM;
    m.loop[0].equations = reject_later;
    m.loop[0].equation_count = 1;
    m.loop[0].user = &code;
    m.description.loop_count = 1;
    compile(&m);
    kt_model_initial(m.model, q, v);
    (void)kt_fine("assembly", kt_state_assemble(m.model, m.data, 0.0, q, v, &e), &e);
    (void)kt_fine("long before", kt_acceleration_evaluate(m.model, m.data, 0.0, q, v, NULL, NULL, a, &e), &e);
    kt_check_equal_int("just before", kt_acceleration_evaluate(m.model, m.data, 0.49, q, v, NULL, NULL, a, &e),
                       KT_ERROR_CALLBACK);
    kt_check_contains("where", e.where, "rod");
    kt_check_contains("message", e.message, "stopped (code -7)");
    for (int i = 0; i < NV; i++)
        v[i] = 3.0; /* differences along a fast motion take shorter steps than those of positions at rest */
    kt_check_equal_int("projection", kt_state_project(m.model, m.data, 0.475, q, v, NULL, &e), KT_ERROR_CALLBACK);
    kt_check_contains("message", e.message, "stopped (code -7)");
}

/* A number that is not finite, at each place of an equation. Numbers that a callback need not write do not count. */
static int write_what_is_not_finite(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equation) {
    const int place = *(const int *)user;
    equation->residual = motion->position.x;
    equation->force = kt_vec3_make(1.0, 0.0, 0.0);
    double *numbers[] = {&equation->residual, &equation->moment.y, &equation->force.z, &equation->rate,
                         &equation->drift};
    *numbers[place] = t < 0.5 ? *numbers[place] : place % 2 == 0 ? (double)NAN : HUGE_VAL;
    return 0;
}

KT_TEST(equations_that_are_not_finite_name_the_loop) {
    static const kt_loop_given given[] = {KT_LOOP_GIVES_RESIDUAL, KT_LOOP_GIVES_ROWS, KT_LOOP_GIVES_ROWS,
                                          KT_LOOP_GIVES_ROWS, KT_LOOP_GIVES_ALL};
    for (int place = 0; place < 5; place++) {
        mechanism m;
        double q[NQ], v[NV], a[NV];
        kt_error e = {0};
        describe(&m, false);
        m.loop[0].type = KT_LOOP_CUSTOM;
        m.loop[0].equations = write_what_is_not_finite;
        m.loop[0].equation_count = 1;
        m.loop[0].user = &place;
        m.loop[0].given = given[place];
        m.description.loop_count = 1;
        compile(&m);
        kt_model_initial(m.model, q, v);
        (void)kt_fine("assembly", kt_state_assemble(m.model, m.data, 0.0, q, v, &e), &e);
        kt_check_equal_int("accelerations", kt_acceleration_evaluate(m.model, m.data, 1.0, q, v, NULL, NULL, a, &e),
                           KT_ERROR_NOT_FINITE);
        kt_check_text("where", e.where, "loop 'rod', t = 1 s");
        kt_check_text("message", e.message, "its callback gave equations that are not finite");
        if (place == 0) {
            kt_check_equal_int("projection", kt_state_project(m.model, m.data, 1.0, q, v, NULL, &e),
                               KT_ERROR_NOT_FINITE);
            kt_check_text("where", e.where, "loop 'rod', t = 1 s");
        }
    }
}

KT_TEST(wrong_descriptions_are_told) {
    static const struct {
        int equations;
        bool holonomic, callback;
        kt_loop_given given;
        const char *says;
    } table[] = {{0, true, true, KT_LOOP_GIVES_ALL, "equation_count is 0; give 1 to 6"},
                 {7, true, true, KT_LOOP_GIVES_ALL, "equation_count is 7; give 1 to 6"},
                 {1, true, false, KT_LOOP_GIVES_ALL, "equations is missing"},
                 {1, false, true, KT_LOOP_GIVES_RESIDUAL, "no residuals"},
                 {1, true, true, (kt_loop_given)9, "given is 9"}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        mechanism m;
        kt_error e = {0};
        describe(&m, false);
        m.loop[0].type = KT_LOOP_CUSTOM;
        m.loop[0].equations = table[i].callback ? keep_distance : NULL;
        m.loop[0].equation_count = table[i].equations;
        m.loop[0].holonomic = table[i].holonomic;
        m.loop[0].given = table[i].given;
        m.description.loop_count = 1;
        kt_check_equal_int("status", kt_model_compile(&m.description, NULL, &m.model, &e), KT_ERROR_MODEL);
        kt_note("%s: %s", e.where, e.message);
        kt_check_true(table[i].says, strstr(e.message, table[i].says) != NULL);
    }
}
