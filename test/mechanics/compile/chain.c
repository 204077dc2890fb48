/* Mechanisms of 100 000 links: the stack does not grow with the number of links. plan/work counts the instructions of
 * their compilation. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MANY = 100000, STACK = 256 * 1024 };

typedef char text[16];

typedef struct large {
    int count;
    kt_body *bodies;
    text *names;
    kt_model *model;
    kt_data *data;
    double *q, *v, *a, *tau; /* of the initial state */
} large;

typedef enum shape { CHAIN, BACKWARDS, STAR, IN_A_PLANE } shape;

/* Rods of 1 m, each turning about the next coordinate axis at the end of the last rod. They are described from the tip
 * to the root, or all on the world. A last shape is a straight chain that turns about z alone. */
static void describe(large *x, shape form, int count) {
    memset(x, 0, sizeof *x);
    x->count = count;
    x->bodies = calloc((size_t)count, sizeof *x->bodies);
    x->names = calloc((size_t)count, sizeof *x->names);
    if (!x->bodies || !x->names)
        abort();
    for (int i = 0; i < count; i++)
        snprintf(x->names[i], sizeof x->names[i], "link%d", i);
    for (int i = 0; i < count; i++) {
        kt_body *body = &x->bodies[form == BACKWARDS ? count - 1 - i : i];
        *body = kt_body_of(x->names[i], i && form != STAR ? x->names[i - 1] : NULL, KT_JOINT_REVOLUTE, 0.0);
        if (form != IN_A_PLANE)
            body->joint.axis = kt_vec3_make(i % 3 == 0, i % 3 == 1, i % 3 == 2);
        body->joint.at = kt_vec3_make(i && form != STAR ? 1.0 : 0.0, 0.0, 0.0);
        body->mass = 1.0;
        body->com = kt_vec3_make(0.5, 0.0, 0.0);
        body->inertia = kt_sym3_make(0.01, 1.0 / 12.0, 1.0 / 12.0, 0.0, 0.0, 0.0);
    }
}

static bool compile(large *x) {
    kt_error e = {0};
    kt_description d = kt_description_of(x->bodies, x->count, NULL, 0, NULL, 0);
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    return kt_fine("compiles", kt_model_compile(&d, NULL, &x->model, &e), &e) &&
           kt_fine("has data", kt_data_create(x->model, &x->data, &e), &e);
}

static void release(large *x) {
    kt_data_free(x->data);
    kt_model_free(x->model);
    free(x->bodies);
    free(x->names);
    free(x->q);
}

/* All the calls, from the initial state; the largest force that is left when forward dynamics are inverted, which
 * should be none. */
static double residual(large *x) {
    const size_t n = (size_t)x->count;
    kt_error e = {0};
    kt_wrench *w = calloc(n + 1, sizeof *w);
    x->q = calloc(4 * n, sizeof *x->q);
    if (!x->q || !w)
        abort();
    x->v = x->q + n;
    x->a = x->v + n;
    x->tau = x->a + n;
    kt_model_initial(x->model, x->q, x->v);
    const bool fine =
        kt_fine("forward", kt_dynamics_forward(x->model, x->data, x->q, x->v, NULL, NULL, x->a, &e), &e) &&
        kt_fine("inverse", kt_dynamics_inverse(x->model, x->data, x->q, x->v, x->a, NULL, x->tau, &e), &e) &&
        kt_fine("kinematics", kt_kinematics_update(x->model, x->data, x->q, x->v, x->a, &e), &e);
    kt_joint_reactions(x->model, x->data, NULL, w);
    free(w);
    return fine ? kt_tree_largest(x->tau, x->count) : (double)NAN;
}

typedef struct run {
    shape form;
    double residual;
    int last; /* body of the last name */
} run;

static void *work(void *user) {
    run *r = user;
    large x;
    describe(&x, r->form, MANY);
    r->residual = compile(&x) ? residual(&x) : (double)NAN;
    r->last = x.model ? kt_body_find(x.model, "link99999") : -1;
    release(&x);
    return NULL;
}

/* A level of recursion takes 16 bytes at least: depth times that is six times the stack. */
static run run_with_little_stack(shape form) {
    run r = {.form = form, .residual = (double)NAN};
    pthread_attr_t attributes;
    pthread_t thread;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, STACK);
    if (pthread_create(&thread, &attributes, work, &r) == 0)
        pthread_join(thread, NULL);
    pthread_attr_destroy(&attributes);
    return r;
}

/* Weights are 5e10 N m at the root, accelerations some rad/s^2. The residual is that of a short chain. */
KT_TEST(a_chain_of_100000_links_takes_no_stack) {
    const run r = run_with_little_stack(CHAIN);
    kt_check_equal_int("the tip", r.last, MANY);
    kt_check_below("force that is left", r.residual, 1e-13);
}

KT_TEST(a_chain_described_from_its_tip_takes_no_stack) {
    const run r = run_with_little_stack(BACKWARDS);
    kt_check_equal_int("the tip", r.last, MANY);
    kt_check_below("force that is left", r.residual, 1e-13);
}

KT_TEST(a_star_of_100000_links_takes_no_stack) {
    const run r = run_with_little_stack(STAR);
    kt_check_equal_int("the last", r.last, MANY);
    kt_check_below("force that is left", r.residual, 1e-14);
}

/* The inertia about the locked axes is 3e14 kg m^2, about z some 0.3. */
KT_TEST(a_straight_chain_of_100000_links_in_a_plane_is_not_singular) {
    const run r = run_with_little_stack(IN_A_PLANE);
    kt_check_equal_int("the tip", r.last, MANY);
    kt_check_below("force that is left", r.residual, 1e-14);
}
