/* The output of mujoco_wasm.mjs for a model: its bodies, joints and equalities, and random states one by one. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_ANSWER_H
#define KT_TEST_ROBOT_ANSWER_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

enum { NAME = 200 };

typedef struct answer_body {
    char name[NAME];
    double mass;
    int ours, placed; /* -1: none; the one whose frame it has */
} answer_body;

typedef struct answer_joint {
    char name[NAME];
    int type, q, v, body, carrier; /* carrier: our body that it moves */
} answer_joint;

/* A model of theirs. The arrays of numbers are those of the state that was read last. */
typedef struct answer {
    int body_count, joint_count, nq, nv, equality_count, activation_count;
    answer_body *bodies;
    answer_joint *joints;
    char (*equalities)[NAME];
    double *torquescales; /* of equalities */
    double *qpos, *qvel, *mass, *bias, *force, *qacc, *xpos, *xmat, *residual, *act;
} answer;

/* The next word, as a number. */
static inline bool read_number(FILE *from, double *value) {
    char word[64], *end = word;
    if (fscanf(from, "%63s", word) == 1)
        *value = strtod(word, &end);
    return end != word && *end == '\0';
}

static inline bool read_numbers(FILE *from, double *values, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (!read_number(from, &values[i]))
            return false;
    return true;
}

/* Counts and indices, up to six. */
static inline bool read_integers(FILE *from, int count, int *const *values) {
    double read[6];
    if (!read_numbers(from, read, (size_t)count))
        return false;
    for (int i = 0; i < count; i++)
        *values[i] = (int)read[i];
    return true;
}

static inline size_t state_size(const answer *a) {
    const size_t nv = (size_t)a->nv;
    return (size_t)a->nq + nv * nv + 4 * nv + 12 * (size_t)a->body_count + 6 * (size_t)a->equality_count +
           (size_t)a->activation_count;
}

static inline bool read_header(FILE *from, answer *a) {
    if (!read_integers(
            from, 6,
            (int *const[]){&a->body_count, &a->joint_count, &a->nq, &a->nv, &a->equality_count, &a->activation_count}))
        return false;
    const size_t bodies = (size_t)a->body_count, nq = (size_t)a->nq, nv = (size_t)a->nv;
    a->bodies = calloc(bodies + 1, sizeof *a->bodies);
    a->joints = calloc((size_t)a->joint_count + 1, sizeof *a->joints);
    a->equalities = calloc((size_t)a->equality_count + 1, sizeof *a->equalities);
    a->torquescales = calloc((size_t)a->equality_count + 1, sizeof *a->torquescales);
    a->qpos = calloc(state_size(a) + 1, sizeof *a->qpos);
    if (a->bodies == NULL || a->joints == NULL || a->equalities == NULL || a->torquescales == NULL || a->qpos == NULL)
        return false;
    a->qvel = a->qpos + nq;
    a->mass = a->qvel + nv;
    a->bias = a->mass + nv * nv;
    a->force = a->bias + nv;
    a->qacc = a->force + nv;
    a->xpos = a->qacc + nv;
    a->xmat = a->xpos + 3 * bodies;
    a->residual = a->xmat + 9 * bodies;
    a->act = a->residual + 6 * (size_t)a->equality_count;
    for (int i = 0; i < a->body_count; i++)
        if (fscanf(from, "%199s", a->bodies[i].name) != 1 || !read_number(from, &a->bodies[i].mass))
            return false;
    for (int i = 0; i < a->joint_count; i++) {
        answer_joint *j = &a->joints[i];
        if (fscanf(from, "%199s", j->name) != 1 ||
            !read_integers(from, 4, (int *const[]){&j->type, &j->q, &j->v, &j->body}))
            return false;
    }
    for (int i = 0; i < a->equality_count; i++)
        if (fscanf(from, "%199s", a->equalities[i]) != 1 || !read_number(from, &a->torquescales[i]))
            return false;
    return true;
}

/* A whole state is in the order of the array. */
static inline bool read_state(FILE *from, answer *a) { return read_numbers(from, a->qpos, state_size(a)); }

static inline void release_answer(answer *a) {
    free(a->bodies);
    free(a->joints);
    free(a->equalities);
    free(a->torquescales);
    free(a->qpos);
}

#endif
