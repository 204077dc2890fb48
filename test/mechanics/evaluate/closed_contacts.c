/* Accelerations and normal forces of random mechanisms, some of whose contacts stick and some slip. One of the joints
 * may be at its stop. They are compared with the equations of motion and of the contacts in one matrix, which is solved
 * in long double. This matrix has the mass matrix of the composite bodies, and Jacobians of points, which no contact of
 * the library uses.
 *
 * A contact need not touch: its accelerations are those of the equation "the gap stays as it is".
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"

#include "evaluate/evaluate.h"
#include "evaluate/open.h"

#include "kinetree/control.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { CONTACTS = 3, STOP = CONTACTS - 1, NV = 40, SIZE = NV + 3 * CONTACTS, MECHANISMS = 60 };
typedef enum contact_state { OPEN = 0, SLIPS, STICKS, STATES } contact_state;

typedef struct subject {
    kt_tree tree; /* without contacts */
    kt_effect effect[CONTACTS];
    kt_mat3 plane[CONTACTS];
    char name[CONTACTS][8];
    int stop;        /* the body on whose joint the last one is a stop; -1: it is a contact */
    kt_model *model; /* with them; the description is that of the tree */
} subject;

/* The matrix of M a + h = tau + J' external + F lambda, J a + drift = 0, its right-hand side, and its solution. */
typedef struct whole {
    long double k[SIZE][SIZE + 1], x[SIZE];
    int nv, n, normal[CONTACTS]; /* the row of each normal force; 0 if the contact is open */
} whole;

static void add_contacts(subject *s, kt_random *random) {
    for (int k = 0; k < CONTACTS; k++) {
        kt_effect *e = &s->effect[k];
        const kt_vec3 z = kt_tree_direction(random), across = kt_vec3_cross(z, kt_tree_direction(random));
        const kt_vec3 x = kt_vec3_scale(1.0 / kt_vec3_norm(across), across);
        s->plane[k] = (kt_mat3){x, kt_vec3_cross(z, x), z};
        *e = kt_effect_default();
        (void)snprintf(s->name[k], sizeof s->name[k], "c%d", k);
        e->name = s->name[k];
        e->type = KT_EFFECT_CONTACT;
        e->restitution = 0.0;
        e->friction = kt_random_uniform(random, 0.05, 0.3);
        e->radius = kt_random_uniform(random, 0.02, 0.2);
        e->between[0].body = s->tree.body[kt_random_int(random, 0, s->tree.description.body_count - 1)].name;
        e->between[0].at = kt_tree_vector(random, -0.5, 0.5);
        e->between[1].at = kt_tree_vector(random, -1.0, 1.0);
        e->between[1].rotation = kt_rotation_matrix(s->plane[k]);
    }
}

/* Replaces the last contact with a stop, in some mechanisms. */
static void add_stop(subject *s, kt_random *random) {
    const int body = kt_random_int(random, 0, s->tree.description.body_count - 1);
    const kt_joint_type type = s->tree.body[body].joint.type;
    s->stop = -1;
    if (type != KT_JOINT_REVOLUTE && type != KT_JOINT_PRISMATIC && type != KT_JOINT_SCREW)
        return;
    kt_effect *e = &s->effect[STOP];
    s->stop = body;
    *e = kt_effect_of(KT_EFFECT_JOINT_LIMIT, s->tree.body[body].name);
    e->name = s->name[STOP];
    e->restitution = 0.0;
    e->lower = -100.0;
}

static void grow(subject *s, int bodies, kt_random *random) {
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = bodies;
    plan.floats = true;
    plan.from_world = 0.1;
    plan.with_armature = 0.2;
    kt_tree_grow(&s->tree, &plan, random);
    kt_need(kt_check_below("nv", s->tree.nv, NV));
    add_contacts(s, random);
    add_stop(s, random);
    kt_description d = s->tree.description;
    d.effects = s->effect;
    d.effect_count = CONTACTS;
    kt_model_options options = kt_model_options_default();
    options.contact_switches = 2 * CONTACTS;
    s->model = kt_test_model(&d, &options);
}

static const kt_model *model_of(const subject *s, const contact_state *state) {
    uint64_t set = 0;
    for (int k = 0; k < CONTACTS; k++) {
        set |= state[k] != OPEN ? kt_switch_bits(s->model, 2 * k) : 0;
        set |= state[k] == STICKS && (k < STOP || s->stop < 0) ? kt_switch_bits(s->model, 2 * k + 1) : 0;
    }
    return kt_model_switched(s->model, set);
}

/* ---- the whole matrix -------------------------------------------------------------------------------------------- */

static void set_motion(const subject *s, const kt_tree_state *at, whole *w) {
    static double mass[NV * NV], bias[NV];
    const kt_tree *tree = &s->tree;
    kt_error e = {0};
    memset(w, 0, sizeof *w);
    w->nv = w->n = tree->nv;
    kt_tree_mass(tree, at, mass);
    kt_need_fine("bias", kt_dynamics_inverse(tree->model, tree->data, at->q, at->v, NULL, at->external, bias, &e), &e);
    kt_tree_kinematics(tree, at);
    for (int i = 0; i < w->nv; i++) {
        for (int j = 0; j < w->nv; j++)
            w->k[i][j] = (long double)mass[j * w->nv + i];
        w->k[i][SIZE] = (long double)(at->tau[i] - bias[i]);
    }
}

/* Adds the row n . (u + omega x lever), its drift, and `force` times its transpose to a column. */
static void add_row(whole *w, const double *jacobian, kt_twist drift, kt_vec3 n, kt_vec3 lever, int row, bool is_row,
                    int at, double force) {
    const kt_vec3 turn = kt_vec3_cross(lever, n);
    for (int i = 0; i < w->nv; i++) {
        const double *c = jacobian + (size_t)(6 * i);
        const double x = turn.x * c[0] + turn.y * c[1] + turn.z * c[2] + n.x * c[3] + n.y * c[4] + n.z * c[5];
        w->k[row][i] += is_row ? (long double)x : 0.0L;
        w->k[i][at] -= (long double)(force * x);
    }
    if (is_row)
        w->k[row][SIZE] -= (long double)(kt_vec3_dot(turn, drift.angular) + kt_vec3_dot(n, drift.linear));
}

static void add_contact(const subject *s, int k, contact_state state, whole *w) {
    static double jacobian[6 * NV];
    const kt_model *model = s->tree.model;
    kt_data *data = s->tree.data;
    const kt_effect *e = &s->effect[k];
    const kt_vec3 axis[3] = {s->plane[k].x, s->plane[k].y, s->plane[k].z}, none = {0.0, 0.0, 0.0};
    const kt_vec3 lever = kt_vec3_scale(-e->radius, axis[2]);
    const int body = kt_body_find(model, e->between[0].body), row = w->n;
    const kt_twist drift = kt_frame_bias(model, data, body, e->between[0].at, KT_TWIST_ALIGNED);
    const kt_vec3 slip = kt_vec3_add(kt_point_velocity(model, data, body, e->between[0].at),
                                     kt_vec3_cross(kt_body_twist(model, data, body).angular, lever));
    const double x = kt_vec3_dot(axis[0], slip), y = kt_vec3_dot(axis[1], slip), size = hypot(x, y);
    kt_point_jacobian(model, data, body, e->between[0].at, jacobian);
    add_row(w, jacobian, drift, axis[2], none, row, true, row, 1.0);
    if (state == SLIPS) {
        add_row(w, jacobian, drift, axis[0], lever, row, false, row, -e->friction * x / size);
        add_row(w, jacobian, drift, axis[1], lever, row, false, row, -e->friction * y / size);
    }
    for (int i = 0; i < 2 && state == STICKS; i++)
        add_row(w, jacobian, drift, axis[i], lever, row + 1 + i, true, row + 1 + i, 1.0);
    w->normal[k] = row;
    w->n += state == STICKS ? 3 : 1;
}

static void add_stop_row(const subject *s, whole *w) {
    const kt_model *model = s->tree.model;
    const int v = kt_body_coordinates(model, kt_body_find(model, s->tree.body[s->stop].name)).v;
    w->normal[STOP] = w->n;
    w->k[w->n][v] = 1.0L;
    w->k[v][w->n] = -1.0L;
    w->n++;
}

/* Gauss's elimination with the largest pivot of each column. Returns the ratio of the largest pivot to the smallest. */
static double solve(whole *w) {
    long double most = 0.0L, least = (long double)INFINITY;
    for (int j = 0; j < w->n; j++) {
        int best = j;
        for (int i = j + 1; i < w->n; i++)
            best = fabsl(w->k[i][j]) > fabsl(w->k[best][j]) ? i : best;
        for (int c = 0; c <= SIZE; c++) {
            const long double x = w->k[j][c];
            w->k[j][c] = w->k[best][c];
            w->k[best][c] = x;
        }
        most = fmaxl(most, fabsl(w->k[j][j]));
        least = fminl(least, fabsl(w->k[j][j]));
        for (int i = j + 1; i < w->n; i++) {
            const long double f = w->k[i][j] / w->k[j][j];
            for (int c = j; c <= SIZE; c++)
                w->k[i][c] -= f * w->k[j][c];
        }
    }
    for (int i = w->n - 1; i >= 0; i--) {
        w->x[i] = w->k[i][SIZE];
        for (int j = i + 1; j < w->n; j++)
            w->x[i] -= w->k[i][j] * w->x[j];
        w->x[i] /= w->k[i][i];
    }
    return (double)(most / least);
}

/* ---- comparison -------------------------------------------------------------------------------------------------- */

typedef struct found {
    double a[NV], multiplier[3 * CONTACTS];
    bool near_singular;
} found;

static kt_status evaluate(const kt_model *model, const kt_tree_state *at, found *to, kt_error *error) {
    kt_data *data = NULL;
    kt_status status = kt_data_create(model, &data, error);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(model, data, 0.0, at->q, at->v, at->tau, at->external, to->a, error);
    if (status == KT_OK)
        status = kt_multiplier_evaluate(model, data, 0.0, at->q, at->v, at->tau, at->external, to->multiplier, error);
    to->near_singular = data != NULL && kt_data_crossings(data).near > 0;
    kt_data_free(data);
    return status;
}

typedef struct tally {
    kt_worst a, normal;
    int compared[STATES], stops, wedged, touching;
} tally;

static bool has_open(const contact_state *state) {
    for (int k = 0; k < CONTACTS; k++)
        if (state[k] == OPEN)
            return true;
    return false;
}

static void compare(const subject *s, const contact_state *state, const kt_tree_state *at, int index, tally *t) {
    static whole w;
    found f;
    kt_error e = {0};
    const kt_model *model = model_of(s, state);
    kt_need(kt_check_true("model of the set", model != NULL));
    set_motion(s, at, &w);
    for (int k = 0; k < CONTACTS; k++)
        if (state[k] != OPEN && k == STOP && s->stop >= 0)
            add_stop_row(s, &w);
        else if (state[k] != OPEN)
            add_contact(s, k, state[k], &w);
    const double condition = solve(&w);
    const kt_status status = evaluate(model, at, &f, &e);
    t->wedged += status == KT_ERROR_SINGULAR; /* friction wedges a contact, or rows contradict each other */
    const bool touches = has_open(state) && status == KT_ERROR_UNSUPPORTED; /* an open contact touches in this state */
    t->touching += touches;
    if (touches || status == KT_ERROR_SINGULAR || f.near_singular || !(condition < 1e8) ||
        !kt_fine("acceleration", status, &e))
        return;
    const double rounding = condition * DBL_EPSILON;
    long double size = 0.0L, force = 0.0L;
    for (int i = 0; i < w.nv; i++)
        size = fmaxl(size, fabsl(w.x[i]));
    for (int i = w.nv; i < w.n; i++)
        force = fmaxl(force, fabsl(w.x[i]));
    for (int i = 0; i < w.nv; i++)
        kt_worst_near(&t->a, f.a[i] / (double)size, (double)(w.x[i] / size), 50.0 * rounding, "mechanism %d, v %d",
                      index, i);
    for (int k = 0; k < CONTACTS; k++) {
        const bool stops = k == STOP && s->stop >= 0;
        const int loop = kt_loop_find(model, stops ? "c2.lower" : s->name[k]);
        t->stops += stops && state[k] != OPEN;
        t->compared[state[k]]++;
        if (state[k] != OPEN)
            kt_worst_near(&t->normal, fabs(f.multiplier[kt_loop_rows_of(model, loop).first]) / (double)force,
                          (double)fabsl(w.x[w.normal[k]] / force), 500.0 * rounding, "mechanism %d, contact %d", index,
                          k);
    }
}

/* All states of the contacts of some trees. Bounds: measured over ten seeds, at most 19 and 197 in units of rounding,
 * and 17 sets that are rejected. */
static void compare_trees(int bodies) {
    static subject s;
    kt_tree_state at;
    kt_random random = kt_random_of_test();
    tally t = {.a = kt_worst_make("acceleration"), .normal = kt_worst_make("normal force")};
    for (int n = 0; n < MECHANISMS; n++) {
        grow(&s, bodies, &random);
        kt_tree_state_draw(&s.tree, &random, &at);
        for (int set = 1; set < STATES * STATES * STATES; set++) {
            const contact_state state[CONTACTS] = {(contact_state)(set % STATES),
                                                   (contact_state)(set / STATES % STATES),
                                                   (contact_state)(set / STATES / STATES)};
            compare(&s, state, &at, n, &t);
        }
    }
    kt_check_worst(&t.a);
    kt_check_worst(&t.normal);
    kt_check_above("contacts that slip", t.compared[SLIPS], 300);
    kt_check_above("contacts that stick", t.compared[STICKS], 300);
    kt_check_above("stops", t.stops, 30);
    kt_check_below("sets rejected", t.wedged, 40);
    kt_check_above("sets rejected as an open contact touches", t.touching, 100);
}

KT_TEST(contacts_of_short_trees_obey_their_equations) { compare_trees(3); }

KT_TEST(contacts_of_trees_obey_their_equations) { compare_trees(6); }

/* Boxes of which two corners slip. More than ten switches have no model of each set. */
enum { BOXES = 2, CORNERS = 2 };
static const char *const box_names[BOXES] = {"b0", "b1"};

typedef struct boxes {
    kt_body body[BOXES];
    kt_effect effect[BOXES * CORNERS];
    double q[7 * BOXES], v[6 * BOXES];
} boxes;

static void add_box(boxes *b, int i, int box) {
    const double at[7] = {2.0 * box, 0.0, 0.12, 1.0}, rate[6] = {0.5 - box, 0.3 * box, 0.0, 0.0, 0.0, 0.7 + box};
    kt_body *body = &b->body[i];
    *body = kt_body_of(box_names[i], NULL, KT_JOINT_FREE, 1.0 + box);
    body->com = kt_vec3_make(0.01, 0.02 * box, 0.03);
    body->inertia = (kt_sym3){0.2, 0.21, 0.25 + 0.1 * box, 0.01, 0.0, 0.02};
    for (int k = 0; k < CORNERS; k++) {
        kt_effect *contact = &b->effect[CORNERS * i + k];
        *contact = kt_effect_of(KT_EFFECT_CONTACT, NULL);
        contact->between[0].body = box_names[i];
        contact->between[0].at = kt_vec3_make(k == 0 ? 0.3 : -0.2, 0.2 * k - 0.2, -0.1);
        contact->radius = 0.02;
        contact->restitution = 0.0;
        contact->friction = 0.2 + 0.1 * box + 0.05 * k;
    }
    memcpy(b->q + 7 * (size_t)i, at, sizeof at);
    memcpy(b->v + 6 * (size_t)i, rate, sizeof rate);
}

/* Evaluates so many boxes, from the box `first` on. */
static void slide_boxes(int first, int count, double *a) {
    boxes b;
    kt_error e = {0};
    uint64_t set = 0;
    for (int i = 0; i < count; i++)
        add_box(&b, i, first + i);
    kt_description d = kt_description_of(b.body, count, NULL, 0, b.effect, CORNERS * count);
    d.gravity = kt_vec3_make(0.5, 0.0, -9.81);
    kt_model_options options = kt_model_options_default();
    options.contact_switches = KT_SWITCH_MAX;
    kt_model *made = kt_test_model(&d, &options);
    for (int k = 0; k < CORNERS * count; k++)
        set |= kt_switch_bits(made, 2 * k);
    const kt_model *model = kt_model_switched(made, set);
    kt_data *data = kt_test_data(model);
    kt_need_fine("acceleration", kt_acceleration_evaluate(model, data, 0.0, b.q, b.v, NULL, NULL, a, &e), &e);
}

/* Contacts of two bodies are in two groups, each of which has responses of its own. */
KT_TEST(boxes_slide_together_as_each_alone) {
    double both[12], alone[12];
    slide_boxes(0, 2, both);
    slide_boxes(0, 1, alone);
    slide_boxes(1, 1, alone + 6);
    for (int i = 0; i < 12; i++)
        kt_check_near("acceleration", both[i], alone[i], 1e-13);
}

/* A box on one corner that slips, with another one in the air. */
static const kt_model *compile_corner(boxes *b) {
    kt_model_options options = kt_model_options_default();
    add_box(b, 0, 0);
    b->effect[1].between[0].at.z = 0.4;
    kt_description d = kt_description_of(b->body, 1, NULL, 0, b->effect, CORNERS);
    options.contact_switches = 2 * CORNERS;
    const kt_model *made = kt_test_model(&d, &options);
    return kt_model_switched(made, kt_switch_bits(made, 0));
}

/* Poses of a check for open contacts serve the accelerations of its own call alone. Linearisations check the last
 * state, and then go on with others. */
KT_TEST(checks_of_open_contacts_leave_accelerations_elsewhere) {
    boxes b;
    kt_error e = {0};
    double a[2][6], other[7];
    const kt_model *model = compile_corner(&b);
    memcpy(other, b.q, sizeof other);
    other[3] = 0.8;
    other[4] = 0.6;
    for (int i = 0; i < 2; i++) {
        const kt_dynamic_state at = {.q = other, .v = b.v};
        kt_data *data = kt_test_data(model);
        if (i == 1)
            kt_need_fine("check", kt_open_contacts_check(model, data, 0.0, b.q, b.v, &e), &e);
        kt_need_fine("acceleration", kt_acceleration_trusted(model, data, &at, a[i], &e), &e);
    }
    for (int i = 0; i < 6; i++)
        kt_check_near("acceleration behind a check", a[1][i], a[0][i], 0.0);
}
