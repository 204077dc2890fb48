/* The steps from a description to a model. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMPILE_COMPILE_H
#define KT_COMPILE_COMPILE_H

#include "base/inner.h"
#include "compile/one_sided.h"
#include "model/check.h"
#include "model/model.h"
#include "model/switching.h"

#include <stdbool.h>
#include <string.h>

/* kt_model_compile without the check and without measured springs. */
KT_INNER kt_status kt_model_build(const kt_description *description, const kt_model_options *options, kt_model **model,
                                  kt_error *error);

/* variants.c: counts the switched loops and effects, and builds the models of all their sets in one block. The result
 * *model is the model of the description itself. The function `compile` makes one model of a checked description, in
 * which the other loops and effects are off: KT_SWITCHED_OFF. hard: of each loop; NULL: no effect is a loop. */
typedef kt_status kt_compile_call(const kt_description *description, const kt_model_options *options, kt_model **model,
                                  kt_error *error);
int kt_switches_count(const kt_description *description);
kt_status kt_variants_compile(const kt_description *description, const kt_hard_loop *hard,
                              const kt_model_options *options, kt_compile_call *compile, kt_model **model,
                              kt_error *error);

/* Builds the tree of a description that has been checked, only for kt_tree_check. */
kt_status kt_model_try(const kt_description *description, kt_report *report, void *user, kt_error *error);

/* Reports the faults that only the whole tree shows, in the order of the description; report may be NULL. If effects
 * act on a joint without inertia, this is no fault: the joint is given an armature of 1 and counted (massless.c). */
kt_status kt_tree_check(kt_model *tree, const kt_description *description, kt_report *report, void *user,
                        kt_error *error);

/* Checks an auxiliary state of the checker's description. */
void kt_checker_state(kt_checker *checker, const kt_auxiliary_state *state);

/* Attaches loops and effects to a model that has bodies and links; replaces *model by a larger model. */
kt_status kt_model_attach(kt_model **model, const kt_description *description, const kt_planar_loop *flat,
                          kt_error *error);

/* Gives an entry among the articulated inertias to each link that uses an entry. In trees these are the links that
 * branch, and links whose joint has more than one degree of freedom. If there are constraint groups, all links have an
 * entry, with the link's index. */
void kt_articulated_number(kt_model *model);

/* Determines the structural ranks of all constraint groups (rank.c). */
kt_status kt_groups_rank(kt_model *model, kt_error *error);

/* The estimate that decides between dense matrices and fronts. The struct has the operations of both, and whether a
 * special form of fronts would suffice if all equations were independent. */
typedef struct kt_form_estimate {
    double front_flops, dense_flops;
    bool fits_delassus, is_front4;
} kt_form_estimate;

/* form.c: the first form of a group, before its ranks are found; whether it has fronts; the form of its damped steps.
 */
void kt_form_begin(const kt_model *model, kt_group *group);
bool kt_form_is_front(const kt_model *model, kt_group *group, const kt_form_estimate *of);
void kt_form_choose_damped(const kt_model *model, kt_group *group);
/* Chooses the forms of all groups. Must be called once ranks are found, and again after each change of the inputs of
 * the choice.
 */
void kt_forms_choose(kt_model *model);
/* A group of few equations is left to the fronts. */
void kt_form_reject_inexact(kt_group *group);

/* Leaves groups of few equations to the fronts where their own form would lose digits (delassus_accuracy.c). */
kt_status kt_delassus_check_accuracy(kt_model *model, kt_error *error);

/* Gives the groups' matrices their places in the data (gather.c). */
void kt_groups_place_matrices(kt_model *model);

/* Determines from the ranks at which steps of fronts equations may be delayed, and how much memory the groups need then
 * (front_order.c). Call kt_groups_place_matrices afterwards. */
void kt_fronts_find_delays(kt_model *model);

/* Sets the lengths of springs that start unstretched. Errors: KT_ERROR_MEMORY. */
kt_status kt_model_measure_springs(kt_model *model, const kt_description *description, kt_error *error);

/* massless.c: kt_massless_is_carried returns whether effects act on the parts that a link carries. The second
 * function gives an armature of 1 to the coordinates of a link that move no mass. The last one finds the motions of
 * these coordinates that move no mass, in a complete model. Errors: KT_ERROR_MODEL if such motions do not exist, or no
 * force holds them (the message names the body); KT_ERROR_MEMORY. */
bool kt_massless_is_carried(const kt_model *tree, const kt_description *description, size_t link);
void kt_massless_mark(kt_model *tree, size_t link);
KT_CHECKED kt_status kt_massless_find(kt_model *model, const kt_description *description, kt_error *error);

/* pose.c: computes the poses of all links in the world at q, and for these poses their twists (world axes, of the
 * links' origins). */
KT_INNER void kt_link_poses(const kt_model *model, const double *q, kt_pose *poses);
KT_INNER void kt_link_twists(const kt_model *model, const double *v, const kt_pose *poses, kt_twist *twists);

/* Copies a text into the texts of a model from *used on, and returns its position. */
static inline uint32_t kt_model_store_text(kt_model *m, size_t *used, const char *text) {
    const uint32_t at = (uint32_t)*used;
    const size_t length = strlen(text) + 1;
    memcpy(m->text + at, text, length);
    *used += length;
    return at;
}

/* attach.c: marks the coordinates of a joint that assembly must not change, because the description gives their values;
 * or none. */
void kt_joint_hold(kt_model *model, const kt_body_record *body, bool held);

/* attach.c: whether the loop is on, and depends on time or drives at a constant speed. */
bool kt_loop_drives(const kt_model *m, const kt_loop_record *r);

/* set_parameter.c: Returns KT_ERROR_ARGUMENT unless the parameter belongs to this model. */
KT_CHECKED kt_status kt_parameter_require(const kt_model *model, const kt_parameter *parameter, kt_error *error);

/* Sets a parameter without a check: for differences, in which a mass may be negative. */
void kt_parameter_put(kt_model *copy, const kt_parameter *parameter, const double *values);
/* Whether the numbers of kt_parameter_get describe the current model. Returns false for a function of time that is
 * neither constant nor set by a parameter. */
bool kt_parameter_stands(const kt_model *model, const kt_parameter *parameter);

/* Functions of time of a model: one of each loop, then three of each effect. Parameters replace such functions, and the
 * numbers of kt_parameter_get do not describe them. The second function copies them. The third one writes those of a
 * parameter back, in all variants. */
static inline size_t kt_curve_count(const kt_model *model) {
    return model->n.loop + 3 * (model->n.effect + model->n.effect_off);
}
void kt_curves_save(const kt_model *model, kt_curve *curves);
void kt_curves_restore(kt_model *copy, const kt_parameter *parameter, const kt_curve *curves);

/* loop_place.c: the place of a loop's end on the world, as six numbers x (KT_PARAMETER_LOOP_PLACE). The first function
 * returns that end. The result is -1 if no end lies on the world, if the loop bounds a side, or if the loop counts an
 * angle from the start. The check reports places that the plane of the loop does not have. */
enum { KT_PLACE_COUNT = 6 };
int kt_loop_movable_end(const kt_loop_record *r);
void kt_loop_end_pose_write(kt_pose pose, double *x);
void kt_loop_end_pose_get(const kt_model *m, int loop, double *x);
KT_CHECKED kt_status kt_loop_end_pose_check(const kt_model *m, int loop, const double *x, kt_error *error);
void kt_loop_end_pose_put(kt_model *m, int loop, const double *x);

/* ---- the rules of the items -------------------------------------------------------------------------------------- */

/* Each of these functions reports the faults of an item and continues.
 *
 * check_body.c: all rules of a body except the rules of its position in the tree. */
void kt_checker_body_rules(kt_checker *checker, const kt_body *body);
/* Whether a joint has limits. */
bool kt_joint_is_limited(const kt_joint *joint);
/* mass_properties.c: the rules of its mass, com, inertia and shape. */
void kt_checker_mass(kt_checker *checker, const kt_body *body);
/* compile_variable_mass.c: the same for a mass that is a function of time. */
void kt_checker_variable_mass(kt_checker *checker, const kt_body *body);
/* Whether the description gives the inertia of a variable mass; otherwise the inertia is in proportion to the mass. */
static inline bool kt_variable_mass_has_moments(const kt_variable_mass *variable) {
    bool has = false;
    for (int k = 0; k < 6; k++)
        has |= variable->inertia[k].type != KT_FUNCTION_NONE;
    return has;
}

/* Area, centroid, and the mean squares and product of the coordinates from the centroid. */
typedef struct kt_polygon {
    double area;       /* above 0 whichever way round the corners go */
    double x, y;       /* centroid */
    double xx, yy, xy; /* means over the area */
} kt_polygon;

/* points: x, y of each corner. O(count). */
kt_polygon kt_polygon_measure(const double *points, int count);

/* Whether two edges meet that do not follow each other, or two that do lie on each other; their indices. O(count^2). */
bool kt_polygon_crosses(const double *points, int count, int *first, int *second);

#endif
