/* The plan of a constraint group that is reduced front by front (reduction/front.h). Each link has one step, which
 * lists the loops that are complete after it. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_FRONT_PLAN_H
#define KT_MODEL_FRONT_PLAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A link is added to the front. A slot stores the acceleration of the link per unit of each parameter, as long as later
 * links or loops depend on this link. */
typedef struct kt_front_step {
    int32_t link;
    int32_t up; /* the step of its parent, or -1 if that is the group's parent */
    int32_t slot;
    int32_t loop, loop_count;         /* in model->front_loop: the loops that are complete with this link */
    int32_t term, term_count;         /* in model->front_term: the terms of relations on this link's coordinate */
    int32_t last_use, last_use_count; /* in model->front_last_use: steps of links on which nothing depends any more */
    size_t at;                        /* the step's first number among the group's matrices */
} kt_front_step;

/* A term of a relation of joint positions, whose equation is collected term by term. */
typedef struct kt_front_term {
    int32_t loop, term; /* in model->loop, model->term */
    int32_t slot;       /* slot of the equation, after those of the links */
    bool first;         /* the first of the relation's terms, in the order of the steps */
} kt_front_term;

/* A group's plan. */
typedef struct kt_front_plan {
    int32_t step;             /* the first of its steps, one a link */
    int32_t slots, relations; /* how many there are at most: links, equations */
    int32_t delayed_most;     /* the most equations that a step passes on: KT_FRONT_DELAYED_MOST or none */
    int32_t width, stride;    /* the largest number of parameters, without and with the parent's, in whole lanes */
    size_t vectors;           /* in slots, of an acceleration's components and of equations */
    size_t shared;            /* place of the arrays that all steps share, among the group's matrices */
    size_t count;             /* count of numbers that the plan needs in the data */
} kt_front_plan;

/* The number of components of an acceleration in space; in a plane, half as many. The number of equations that
 * can be delayed at a time. */
enum { KT_FRONT_SPACE = 6, KT_FRONT_DELAYED_MOST = 6 };

/* The largest numbers of a step. The parameters, `params`, include the new ones, of which `kept` remain after the step.
 * The step closes `rows` equations. An upper bound of the vectors in slots is `vectors`. */
typedef struct kt_front_size {
    size_t params, rows, kept, vectors;
} kt_front_size;

/* A number of entries, rounded up to whole lanes (reduction/front_lanes.h). */
enum { KT_FRONT_LANES = 4 };
static inline int kt_front_padded(int n) { return (n + KT_FRONT_LANES - 1) / KT_FRONT_LANES * KT_FRONT_LANES; }

/* The count of numbers that a step keeps for the substitution back (reduction/front.h). */
static inline size_t kt_front_step_count(const kt_front_size *s) {
    const size_t base = KT_FRONT_SPACE, n = s->params, k = s->rows, half = n / 2, more = KT_FRONT_LANES - 1;
    const size_t reflectors = s->kept < half ? s->kept : half;
    return base * n + k * (n + 1) + k + k * s->vectors + k + reflectors * (n + more + 1) +
           n * (s->kept + base + more + 1);
}

#endif
