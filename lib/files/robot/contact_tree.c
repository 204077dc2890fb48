/* The tree of a robot that touches the ground: mobilities, and the initial depth in the ground.
 *
 * The mobility of a point is the mean of (J M^-1 J')_ii over the three directions, with the mass matrix M and the
 * Jacobian J of the point. The mobility is the acceleration per force, averaged over the directions of the force.
 *
 * A stop without a stiffness is as soft as MuJoCo's default for limits, under a force that accelerates its joint by
 * 9.81 rad/s^2 or m/s^2: the mobility is (M^-1)_jj, at the start.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "linear/cholesky.h"
#include "robot/robot_contact.h"

#include <math.h>
#include <string.h>

static kt_status fill_tree(kt_reader *r, kt_contact_tree *tree, kt_error *error) {
    const size_t nq = (size_t)kt_model_nq(tree->model), nv = (size_t)kt_model_nv(tree->model);
    tree->q = kt_reader_take(r, &r->scratch, nq + nv + 1, sizeof *tree->q);
    if (tree->q == NULL)
        return KT_ERROR_MEMORY;
    tree->v = tree->q + nq;
    kt_model_initial(tree->model, tree->q, tree->v);
    memset(tree->v, 0, nv * sizeof *tree->v);
    const kt_status status = kt_data_create(tree->model, &tree->data, error);
    return status == KT_OK ? kt_kinematics_update(tree->model, tree->data, tree->q, tree->v, NULL, error) : status;
}

kt_status kt_contact_tree_make(kt_reader *r, const kt_body *bodies, int count, kt_contact_tree *tree, kt_error *error) {
    kt_description d = kt_description_default();
    *tree = (kt_contact_tree){.model = NULL};
    d.bodies = bodies;
    d.body_count = count;
    d.inertia_check = KT_INERTIA_ACCEPT;
    kt_status status = kt_model_compile(&d, NULL, &tree->model, error);
    if (status == KT_OK)
        status = fill_tree(r, tree, error);
    if (status != KT_OK)
        kt_contact_tree_free(tree);
    return status;
}

void kt_contact_tree_free(kt_contact_tree *tree) {
    kt_data_free(tree->data);
    kt_model_free(tree->model);
    *tree = (kt_contact_tree){.model = NULL};
}

double kt_contact_mobility(const kt_contact_tree *tree, int body, kt_vec3 at, const double *factors, double *room) {
    const int nv = kt_model_nv(tree->model);
    double *x = room + (size_t)6 * (size_t)nv, sum = 0.0;
    kt_point_jacobian(tree->model, tree->data, body, at, room);
    for (int k = 0; k < 3; k++) {
        for (int j = 0; j < nv; j++)
            x[j] = room[6 * j + 3 + k];
        kt_dense_solve(factors, nv, x);
        for (int j = 0; j < nv; j++)
            sum += x[j] * room[6 * j + 3 + k] / 3.0;
    }
    return sum;
}

/* ---- the start --------------------------------------------------------------------------------------------------- */

kt_pose kt_contact_pose(const kt_contact_tree *tree, const kt_end *end) {
    const int body = end->body != NULL ? kt_body_find(tree->model, end->body) : 0;
    const kt_pose own = {.rotation = kt_mat3_of_rotation(&end->rotation), .position = end->at};
    return body > 0 ? kt_pose_compose(kt_body_pose(tree->model, tree->data, body), own) : own;
}

/* The Cholesky factor of the mass matrix, and behind it room for a vector; NULL if there is none. */
static double *factor_tree(kt_draft *d, const kt_contact_tree *tree) {
    const size_t nv = (size_t)kt_model_nv(tree->model);
    double *mass = kt_reader_take(d->r, &d->r->scratch, nv * nv + nv + 1, sizeof *mass);
    if (mass == NULL || kt_dynamics_mass(tree->model, tree->data, tree->q, mass, NULL) != KT_OK ||
        !kt_dense_cholesky(mass, nv, (int)nv, NULL))
        return NULL;
    return mass;
}

/* (M^-1)_jj of the joint of a stop; 1 if it is in a loop. */
static double stop_mobility(const kt_draft *d, const kt_contact_tree *tree, double *factors, const char *joint) {
    const int nv = kt_model_nv(tree->model);
    double *x = factors + (size_t)nv * (size_t)nv;
    for (int i = 0; i < d->bodies.count; i++) {
        const kt_body *body = kt_draft_body_at(d, i);
        if (strcmp(kt_joint_name_of(body), joint) != 0)
            continue;
        const kt_coordinates c = kt_body_coordinates(tree->model, kt_body_find(tree->model, body->name));
        memset(x, 0, (size_t)nv * sizeof *x);
        x[c.v] = 1.0;
        kt_dense_solve(factors, nv, x);
        return c.nv == 1 ? x[c.v] : 1.0;
    }
    return 1.0;
}

static void soften_stops(kt_draft *d, const kt_contact_tree *tree) {
    const kt_contact_law law = kt_contact_law_standard();
    double *factors = d->soft_stops.count > 0 ? factor_tree(d, tree) : NULL;
    for (int i = 0; factors != NULL && i < d->soft_stops.count; i++) {
        kt_effect *stop = (kt_effect *)d->effects.items + ((const int *)d->soft_stops.items)[i];
        const double a = stop_mobility(d, tree, factors, stop->joint);
        (void)kt_contact_law_yield(&law, 0.0, a, 9.81 / a, &stop->stiffness, &stop->damping);
    }
}

double kt_contact_settle(kt_draft *d) {
    kt_contact_tree tree;
    kt_error error;
    double depth = 0.0;
    const kt_status status = kt_contact_tree_make(d->r, d->bodies.items, d->bodies.count, &tree, &error);
    if (status == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(d->r);
    if (status != KT_OK)
        return 0.0;
    for (int i = 0; i < d->effects.count; i++) {
        const kt_effect *e = (const kt_effect *)d->effects.items + i;
        if (e->type != KT_EFFECT_CONTACT)
            continue;
        const kt_pose point = kt_contact_pose(&tree, &e->between[0]), plane = kt_contact_pose(&tree, &e->between[1]);
        const kt_vec3 apart = kt_vec3_sub(point.position, plane.position);
        depth = fmax(depth, e->radius - kt_vec3_dot(plane.rotation.z, apart));
    }
    soften_stops(d, &tree);
    kt_contact_tree_free(&tree);
    return depth;
}
