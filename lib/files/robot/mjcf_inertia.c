/* Effective inertias of joints and mobilities of bodies of a model in MJCF, at its reference positions.
 *
 * `springdamper` defines stiffness and damping relative to the inertia of the joint. A joint of n coordinates has
 *     I = n / sum_i (M^-1)_ii
 * with the mass matrix M of the tree. A tendon of length L adds armature J'J with J = dL/dq to M, for pairs of joints
 * of which one carries the other. A joint with the time constant T and the damping ratio z then has
 *     stiffness = I / (T z)^2,   damping = 2 I / T.
 *
 * Muscles need the inverse of the mass matrix, too (mjcf_reach.c).
 *
 * Contacts are softer if the touching body is lighter: its mobility is the mobility of its centre of mass
 * (contact_tree.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "linear/cholesky.h"
#include "robot/mjcf.h"
#include "robot/robot_contact.h"

#include <string.h>

static bool is_asked(kt_mjcf *m, const kt_mjcf_joint *j) {
    double v[2] = {0.0, 0.0};
    return kt_mjcf_numbers(m, j->element, j->tag, "springdamper", 2, 2, v) == 2 && v[0] > 0.0 && v[1] > 0.0;
}

/* The bodies, at the reference positions. */
static void copy_bodies(const kt_mjcf *m, kt_body *bodies) {
    memcpy(bodies, m->draft.bodies.items, (size_t)m->draft.bodies.count * sizeof *bodies);
    for (int i = 0; i < m->joints.count; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        kt_joint *joint = &bodies[j->carrier_index].joint;
        memcpy(joint->position, kt_joint_default().position, sizeof joint->position);
        memcpy(joint->velocity, kt_joint_default().velocity, sizeof joint->velocity);
        if (kt_mjcf_is_scalar(j))
            joint->position[0] = j->ref;
    }
}

/* M += armature J'J for fixed tendons, whose J are the coefficients. */
static void add_tendons(kt_mjcf *m, const kt_model *model, double *mass) {
    const int nv = kt_model_nv(model);
    for (int t = 0; t < m->tendons.count; t++) {
        const kt_mjcf_tendon *tendon = kt_mjcf_tendon_at(m, t);
        const kt_mjcf_term *terms = kt_mjcf_term_at(m, tendon->first);
        const double armature = kt_mjcf_number(m, tendon->element, "tendon", "armature", 0.0);
        for (int i = 0; i < tendon->count && armature != 0.0; i++)
            for (int k = 0; k < tendon->count; k++) {
                if (!kt_mjcf_is_chain(m, terms[i].joint, terms[k].joint))
                    continue;
                const int row = kt_mjcf_coordinates_of(m, model, kt_mjcf_joint_at(m, terms[i].joint)).v;
                const int column = kt_mjcf_coordinates_of(m, model, kt_mjcf_joint_at(m, terms[k].joint)).v;
                mass[column * nv + row] += armature * terms[i].coefficient * terms[k].coefficient;
            }
    }
}

/* The inertias of all joints with `springdamper`, from a factorised mass matrix; x has room for one vector. */
static void take_inertias(kt_mjcf *m, const kt_model *model, const double *factors, double *x) {
    const int nv = kt_model_nv(model);
    for (int i = 0; i < m->joints.count; i++) {
        kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        const kt_coordinates c = kt_mjcf_coordinates_of(m, model, j);
        double sum = 0.0;
        for (int k = c.v; k < c.v + c.nv && is_asked(m, j); k++) {
            memset(x, 0, (size_t)nv * sizeof *x);
            x[k] = 1.0;
            kt_dense_solve(factors, nv, x);
            sum += x[k];
        }
        j->inertia = sum > 0.0 ? c.nv / sum : 0.0;
    }
}

/* The mobilities of all bodies, for contacts; room: for a Jacobian and a vector. */
static void take_mobilities(kt_mjcf *m, const kt_contact_tree *tree, const double *factors, double *room) {
    for (int i = 1; i < m->bodies.count; i++) {
        kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        const int body = kt_body_find(tree->model, b->name);
        if (body >= 0)
            b->mobility = kt_contact_mobility(tree, body, b->com, factors, room);
    }
}

/* `mass` is M with the armatures of all tendons, and then its Cholesky factor. */
static kt_status find_all(kt_mjcf *m, const kt_contact_tree *tree, kt_error *error) {
    const size_t nv = (size_t)kt_model_nv(tree->model);
    double *mass = kt_reader_take(m->r, &m->r->scratch, nv * nv + 8 * nv + 1, sizeof *mass);
    if (mass == NULL)
        return KT_ERROR_MEMORY;
    double *room = mass + nv * nv;
    const kt_status status = kt_dynamics_mass(tree->model, tree->data, tree->q, mass, error);
    if (status != KT_OK)
        return status;
    add_tendons(m, tree->model, mass);
    kt_mjcf_add_path_armatures(m, tree, mass, room);
    if (!kt_dense_cholesky(mass, nv, (int)nv, NULL))
        return KT_ERROR_SINGULAR;
    take_inertias(m, tree->model, mass, room);
    if (m->source->options->contacts)
        take_mobilities(m, tree, mass, room);
    kt_mjcf_find_reaches(m, tree, mass, room);
    return KT_OK;
}

void kt_mjcf_find_inertias(kt_mjcf *m) {
    kt_contact_tree tree;
    kt_error error = {0};
    const kt_element *first = NULL;
    for (int i = 0; i < m->joints.count; i++)
        first = first == NULL && is_asked(m, kt_mjcf_joint_at(m, i)) ? kt_mjcf_joint_at(m, i)->element : first;
    if (first == NULL && m->source->options->contacts && (m->nv > 0 || m->notes.freed.count > 0))
        first = m->root;
    first = first == NULL && m->nv > 0 ? kt_mjcf_find_muscle(m, NULL) : first;
    if (first == NULL || m->r->out_of_memory)
        return;
    kt_body *bodies = kt_reader_take(m->r, &m->r->scratch, (size_t)m->draft.bodies.count + 1, sizeof *bodies);
    kt_status status = KT_ERROR_MEMORY;
    if (bodies != NULL) {
        copy_bodies(m, bodies);
        status = kt_contact_tree_make(m->r, bodies, m->draft.bodies.count, &tree, &error);
    }
    if (status == KT_OK) {
        status = find_all(m, &tree, &error);
        kt_contact_tree_free(&tree);
    }
    if (status == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(m->r);
    else if (status != KT_OK)
        kt_unknown_count(&m->changes, "springdamper, muscles or contacts, since inertias along them cannot be computed",
                         first);
}
