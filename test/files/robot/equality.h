/* Residuals of MuJoCo's equalities between two bodies, and those of the loops that are made of them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_IMPORT_EQUALITY_H
#define KT_TEST_IMPORT_EQUALITY_H

#include "check.h"

#include "kinetree/kinetree.h"

#include "kinetree/expression.h"

#include <math.h>
#include <string.h>

/* The pose of an end whose body has this one. */
static inline kt_pose pose_of_end(kt_pose body, const kt_end *end) {
    kt_pose own = kt_pose_identity();
    own.position = end->at;
    if (end->rotation.type != KT_ROTATION_NONE)
        (void)!kt_rotation_evaluate(&end->rotation, &own.rotation, NULL);
    return kt_pose_compose(body, own);
}

/* The distance of both points along the world's axes. For a weld, also MuJoCo's vector part of the quaternion between
 * both orientations. Its norm is the sine of half the angle. MuJoCo multiplies the vector by the weld's torquescale. */
static inline void compare_ends(const kt_loop *loop, kt_pose a, kt_pose b, double torquescale, const double *theirs,
                                kt_worst *worst) {
    const kt_vec3 d = kt_vec3_sub(a.position, b.position);
    const double apart[3] = {d.x, d.y, d.z}, scale = fmax(1.0, kt_vec3_norm(d));
    for (int k = 0; k < 3; k++)
        kt_worst_near(worst, apart[k], theirs[k], 1e-14 * scale, "%s, %d", loop->name, k);
    if (loop->type != KT_LOOP_WELD)
        return;
    const kt_mat3 between = kt_mat3_multiply(kt_mat3_transpose(a.rotation), b.rotation);
    const double angle = kt_vec3_norm(kt_euler_vector_from_mat3(between));
    kt_worst_near(worst, torquescale * sin(0.5 * angle), kt_vec3_norm(kt_vec3_make(theirs[3], theirs[4], theirs[5])),
                  1e-14 * fmax(1.0, torquescale), "%s, sine of half the angle", loop->name);
}

/* The variables of a coupling's formula are the positions of the joints of its terms. */
static inline bool find_term(void *user, const char *name, kt_symbol *symbol) {
    const kt_loop *loop = user;
    for (int k = 0; k < loop->term_count; k++)
        if (strncmp(name, "position.", 9) == 0 && strcmp(name + 9, loop->terms[k].joint) == 0) {
            *symbol = (kt_symbol){.index = k};
            return true;
        }
    return false;
}

enum { COUPLING_TERMS = 8, COUPLING_FORMULA = 400 /* numbers */ };

/* Reads the formula of a coupling (NULL: it has none) into `memory`, of COUPLING_FORMULA numbers. */
static inline bool parse_coupling(const kt_loop *loop, double *memory, const kt_expression **formula) {
    const kt_symbols symbols = {.find = find_term, .user = (void *)loop};
    kt_error error = {0};
    *formula = NULL;
    return kt_check_true("formulas have room", loop->term_count <= COUPLING_TERMS) &&
           (loop->formula == NULL ||
            kt_check_equal_int("formula",
                               kt_expression_parse(loop->formula, &symbols, memory, COUPLING_FORMULA * sizeof *memory,
                                                   formula, NULL, &error),
                               KT_OK));
}

/* The residual of a coupling whose joints have these positions. */
static inline double open_by(const kt_loop *loop, const kt_expression *formula, const double *at) {
    double sum = -loop->offset;
    for (int k = 0; k < loop->term_count; k++)
        sum += loop->terms[k].coefficient * at[k];
    return sum + (formula != NULL ? kt_expression_evaluate(formula, at) : 0.0);
}

#endif
