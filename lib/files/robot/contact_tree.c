/* The tree of a robot that touches the ground: mobilities, and how deep it starts in the ground.
 *
 * The mobility of a point is the mean of (J M^-1 J')_ii over the three directions, with the mass matrix M and the
 * Jacobian J of the point. It is the acceleration per force, averaged over the directions of the force.
 */
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

static kt_pose pose_of(const kt_contact_tree *tree, const kt_end *end) {
    const int body = end->body != NULL ? kt_body_find(tree->model, end->body) : 0;
    const kt_pose own = {.rotation = kt_matrix_of_rotation(&end->rotation), .position = end->at};
    return body > 0 ? kt_pose_compose(kt_body_pose(tree->model, tree->data, body), own) : own;
}

double kt_contact_depth(kt_draft *d) {
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
        const kt_pose point = pose_of(&tree, &e->between[0]), plane = pose_of(&tree, &e->between[1]);
        const kt_vec3 apart = kt_vec3_sub(point.position, plane.position);
        depth = fmax(depth, e->radius - kt_vec3_dot(plane.rotation.z, apart));
    }
    kt_contact_tree_free(&tree);
    return depth;
}
