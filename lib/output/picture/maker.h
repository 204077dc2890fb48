/* The steps that make a picture. Each step fills lists of the picture, and reads the lists of earlier steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_MAKER_H
#define KT_PICTURE_MAKER_H

#include "kinetree/mechanism.h"
#include "picture/picture.h"

typedef struct kt_picture_maker {
    kt_picture *picture;
    const kt_scene *scene;
    const kt_description *description;
    const kt_picture_options *options;
    const kt_model *model;
    const kt_pose *poses;
    int *first, *next; /* solids of each rigid part, as chained lists: -1 ends one */
} kt_picture_maker;

/* The body in the description. */
static inline const kt_body *kt_picture_source(const kt_picture_maker *m, int body) {
    return &m->description->bodies[kt_body_source(m->model, body)];
}

/* picture_list.c: the contents of the description, in its order. */
void kt_picture_list_joints(kt_picture_maker *m);
void kt_picture_list_loops(kt_picture_maker *m);
void kt_picture_list_relations(kt_picture_maker *m);
void kt_picture_list_effects(kt_picture_maker *m);

/* Whether a slider of the world represents only a number, such as the length of a tendon. */
bool kt_picture_is_number(const kt_picture_maker *m, int body);

/* given_solids.c: solids of the scene. Boxes of the same inertia may replace shapes and meshes. */
void kt_picture_add_solid(kt_picture_maker *m, kt_solid solid);
void kt_picture_list_shapes(kt_picture_maker *m);
kt_status kt_picture_list_meshes(kt_picture_maker *m, kt_error *error);
void kt_picture_list_boxes(kt_picture_maker *m);

/* Sets the radius of slender rods and points, which follows from the size of the picture. */
void kt_picture_thicken(kt_picture_maker *m);

/* Whether a body has a solid among those that are listed so far. */
bool kt_picture_has_own(const kt_picture_maker *m, int body);

/* extent.c: sizes and planes. `lengths` has room for all solids and joints. */
kt_bounds kt_picture_measure(kt_picture_maker *m, double *lengths);
void kt_picture_list_planes(kt_picture_maker *m, kt_bounds bounds);

/* implied_disc.c: parts the masses at one point of one axis: balls become discs along the axis, blocks are nested. */
void kt_picture_part_masses(kt_picture_maker *m);

/* implied.c: solids that the scene leaves out. */
void kt_picture_imply_solids(kt_picture_maker *m);

#endif
