/* Lengths of tendons are coordinates here alone and follow from the joints: with v' of theirs, `v = T v'`. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "import_pair.h"

#include "check.h"
#include "match.h"
#include "numbers.h"

#include "model/joint_name.h"

#include <stdlib.h>
#include <string.h>

/* ---- loading ----------------------------------------------------------------------------------------------------- */

static bool is_theirs(const import_pair *p, const char *name) {
    for (int i = 0; i < p->theirs.joint_count; i++)
        if (same_name(name, p->theirs.joints[i].name))
            return true;
    return false;
}

/* A coupling that is the length of a tendon: its first joint is none of theirs, the others are. */
static bool is_length(const import_pair *p, const kt_loop *loop) {
    return loop->type == KT_LOOP_COUPLING && loop->formula == NULL && loop->term_count > 1 &&
           !is_theirs(p, loop->terms[0].joint) && is_theirs(p, loop->terms[1].joint);
}

/* A loop that places a slider for the length of a spatial tendon. The start of such a slider is a guess. */
static bool is_path(const import_pair *p, const kt_loop *loop) {
    const kt_description *d = &p->scene.description;
    const bool is_coupling = loop->type == KT_LOOP_COUPLING && loop->formula != NULL;
    const char *name = is_coupling ? loop->terms[0].joint : loop->between[0].body;
    if (name == NULL || (!is_coupling && loop->type != KT_LOOP_SPHERICAL))
        return false;
    for (int i = 0; i < d->body_count; i++)
        if (strcmp(is_coupling ? kt_joint_name_of(&d->bodies[i]) : d->bodies[i].name, name) == 0)
            return d->bodies[i].joint.guess && !is_theirs(p, kt_joint_name_of(&d->bodies[i]));
    return false;
}

/* Compiles the tree without loops, except for those of tendon lengths. Parts that only other loops move need these
 * loops. Dry friction is a constraint of MuJoCo's. */
static kt_status compile_imported(import_pair *p, kt_error *error) {
    kt_description d = p->scene.description;
    kt_effect *effects = calloc((size_t)d.effect_count + 1, sizeof *effects);
    kt_loop *loops = calloc((size_t)d.loop_count + 1, sizeof *loops);
    kt_body *bodies = calloc((size_t)d.body_count + 1, sizeof *bodies);
    int kept = 0;
    for (int i = 0; i < d.effect_count && effects != NULL; i++) {
        effects[i] = d.effects[i];
        if (effects[i].type == KT_EFFECT_JOINT_FRICTION)
            effects[i].coulomb = effects[i].breakaway = 0.0;
    }
    for (int i = 0; i < d.loop_count && loops != NULL; i++) {
        p->has_paths = p->has_paths || is_path(p, &d.loops[i]);
        if (is_length(p, &d.loops[i]) || is_path(p, &d.loops[i]))
            loops[kept++] = d.loops[i];
    }
    for (int i = 0; i < d.body_count && bodies != NULL; i++) { /* the assembly moves guesses alone */
        kt_joint *joint = &bodies[i].joint;
        bodies[i] = d.bodies[i];
        double *w = joint->position + (joint->type == KT_JOINT_FREE ? 3 : 0);
        joint->given =
            joint->guess ? 0 : KT_GIVEN_POSITION | KT_GIVEN_ORIENTATION | KT_GIVEN_VELOCITY | KT_GIVEN_ANGULAR;
        if ((joint->type == KT_JOINT_FREE || joint->type == KT_JOINT_SPHERICAL) && !joint->guess)
            *w = *w == 0.0 && w[1] == 0.0 && w[2] == 0.0 && w[3] == 0.0 ? 1.0 : *w;
    }
    d.bodies = bodies;
    d.effects = effects;
    d.loops = loops;
    d.loop_count = kept;
    kt_status status = effects != NULL && loops != NULL && bodies != NULL ? kt_model_compile(&d, NULL, &p->model, error)
                                                                          : KT_ERROR_MEMORY;
    p->is_tree = status == KT_OK;
    if (status != KT_OK && status != KT_ERROR_MEMORY) {
        d.loops = p->scene.description.loops;
        d.loop_count = p->scene.description.loop_count;
        status = kt_model_compile(&d, NULL, &p->model, error);
    }
    free(effects);
    free(loops);
    free(bodies);
    return status;
}

bool load_import_pair(import_pair *p, const char *path, const kt_robot_options *options) {
    kt_error error = {0};
    if (kt_robot_read(path, options, &p->scene, NULL, NULL, &error) != KT_OK || compile_imported(p, &error) != KT_OK ||
        kt_data_create(p->model, &p->data, &error) != KT_OK) {
        kt_note("%s: %s", error.where, error.message);
        return false;
    }
    const size_t nq = (size_t)kt_model_nq(p->model), nv = (size_t)kt_model_nv(p->model);
    const size_t theirs = (size_t)p->theirs.nv;
    return TAKE_NUMBERS({&p->q, nq}, {&p->v, nv}, {&p->a, nv}, {&p->tau, nv}, {&p->matrix, nv * nv},
                        {&p->of, nv * theirs}, {&p->product, nv * theirs}, {&p->reduced, theirs * theirs},
                        {&p->along, theirs});
}

void release_import_pair(import_pair *p) {
    kt_data_free(p->data);
    kt_model_free(p->model);
    kt_scene_free(&p->scene);
    release_answer(&p->theirs);
    free(p->q);
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* Our body that a joint of theirs moves: the one whose joint has its name. If there is none, it is the next one after
 * `last`, since both are in the order of the file. */
static int find_carrier(const import_pair *p, const answer_joint *theirs, int last) {
    const kt_description *d = &p->scene.description;
    int next = -1;
    for (int i = 0; i < d->body_count; i++) {
        const kt_body *b = &d->bodies[i];
        if (b->joint.type == KT_JOINT_FIXED)
            continue;
        if (theirs->name[0] != '.' && same_name(kt_joint_name_of(b), theirs->name))
            return i;
        next = next < 0 && i > last ? i : next;
    }
    return next;
}

/* Our coordinate of a scalar joint of this name. */
static int find_coordinate(const import_pair *p, const char *name, bool is_velocity) {
    const kt_description *d = &p->scene.description;
    for (int i = 0; i < d->body_count; i++)
        if (strcmp(kt_joint_name_of(&d->bodies[i]), name) == 0) {
            const kt_coordinates c = kt_body_coordinates(p->model, our_body(p->model, d->bodies[i].name));
            return is_velocity ? c.v : c.q;
        }
    return -1;
}

/* The rows of T of lengths of tendons. */
static void find_lengths(import_pair *p) {
    const int nv = kt_model_nv(p->model);
    for (int i = 0; i < p->scene.description.loop_count; i++) {
        const kt_loop *loop = &p->scene.description.loops[i];
        const int row = is_length(p, loop) ? find_coordinate(p, loop->terms[0].joint, true) : -1;
        p->lengths += row >= 0;
        for (int k = 1; k < loop->term_count && row >= 0; k++)
            for (int j = 0; j < p->theirs.joint_count; j++)
                if (same_name(loop->terms[k].joint, p->theirs.joints[j].name))
                    p->of[p->theirs.joints[j].v * nv + row] -= loop->terms[k].coefficient / loop->terms[0].coefficient;
    }
}

bool match_import_pair(import_pair *p) {
    static const int dofs[] = {6, 3, 1, 1}; /* free, ball, slide, hinge */
    int last = -1;
    for (int i = 0; i < p->theirs.joint_count; i++) {
        answer_joint *j = &p->theirs.joints[i];
        last = find_carrier(p, j, last);
        j->carrier = last >= 0 ? our_body(p->model, p->scene.description.bodies[last].name) : -1;
        const kt_coordinates c =
            j->carrier >= 0 ? kt_body_coordinates(p->model, j->carrier) : (kt_coordinates){.nv = 0};
        if (c.nv != dofs[j->type])
            return kt_check_true(j->name, false);
        for (int k = 0; k < c.nv; k++)
            p->of[(j->v + k) * kt_model_nv(p->model) + c.v + k] = 1.0;
    }
    for (int i = 0; i < p->theirs.body_count; i++)
        p->theirs.bodies[i].ours = p->theirs.bodies[i].placed =
            i > 0 ? our_body(p->model, p->theirs.bodies[i].name) : 0;
    for (int i = 0; i < p->theirs.joint_count; i++)
        if (p->theirs.joints[i].type == 0) /* a free body's frame may be turned to that of its inertia */
            p->theirs.bodies[p->theirs.joints[i].body].placed = p->theirs.joints[i].carrier;
    find_lengths(p);
    return true;
}

void set_import_state(import_pair *p) {
    const int nv = kt_model_nv(p->model);
    for (int i = 0; i < p->theirs.joint_count; i++) {
        const answer_joint *j = &p->theirs.joints[i];
        const kt_coordinates c = kt_body_coordinates(p->model, j->carrier);
        memcpy(p->q + c.q, p->theirs.qpos + j->q, (size_t)c.nq * sizeof *p->q);
        memcpy(p->v + c.v, p->theirs.qvel + j->v, (size_t)c.nv * sizeof *p->v);
    }
    for (int i = 0; i < p->scene.description.loop_count; i++) {
        const kt_loop *loop = &p->scene.description.loops[i];
        if (!is_length(p, loop))
            continue;
        double sum[2] = {0.0, 0.0};
        const int q = find_coordinate(p, loop->terms[0].joint, false),
                  v = find_coordinate(p, loop->terms[0].joint, true);
        for (int j = 0; j < p->theirs.joint_count; j++) {
            const double factor = p->of[p->theirs.joints[j].v * nv + v];
            sum[0] += factor * (factor != 0.0 ? p->theirs.qpos[p->theirs.joints[j].q] : 0.0);
            sum[1] += factor * (factor != 0.0 ? p->theirs.qvel[p->theirs.joints[j].v] : 0.0);
        }
        p->q[q] = sum[0];
        p->v[v] = sum[1];
    }
}
