/* The steps from a description to a model. */
#ifndef KT_COMPILE_COMPILE_H
#define KT_COMPILE_COMPILE_H

#include "model/check.h"
#include "model/model.h"

/* kt_model_compile without the check. */
kt_status kt_model_build(const kt_description *description, const kt_model_options *options, kt_model **model,
                         kt_error *error);

/* Builds the tree of a description that has been checked, for nothing but kt_tree_check. */
kt_status kt_model_try(const kt_description *description, kt_report *report, void *user, kt_error *error);

/* The faults that only the whole tree shows, in the order of the description; report may be NULL. */
kt_status kt_tree_check(const kt_model *tree, const kt_description *description, kt_report *report, void *user,
                        kt_error *error);

/* Loops and effects onto a model that has bodies and links; *model may move. */
kt_status kt_model_attach(kt_model **model, const kt_description *description, const kt_planar_loop *flat,
                          kt_error *error);

/* The structural ranks of all groups (rank.c). */
kt_status kt_groups_rank(kt_model *model, kt_error *error);

/* Gives springs that start unstretched their lengths. Errors: KT_ERROR_MEMORY. */
kt_status kt_model_measure_springs(kt_model *model, const kt_description *description, kt_error *error);

/* pose.c: poses of all links in the world at q, and for these poses their twists (world axes, of their origins). */
void kt_link_poses(const kt_model *model, const double *q, kt_pose *poses);
void kt_link_twists(const kt_model *model, const double *v, const kt_pose *poses, kt_twist *twists);

/* ---- the rules of the items: each reports what is at fault and goes on ---------------------------------------------
 */

/* check_body.c: all but its place in the tree. */
void kt_checker_body_rules(kt_checker *checker, const kt_body *body);
/* check_body.c: its mass, com, inertia and shape. */
void kt_checker_mass(kt_checker *checker, const kt_body *body);

/* shape.c: a shape. */
void kt_checker_shape(kt_checker *checker, const kt_shape *shape);

#endif
