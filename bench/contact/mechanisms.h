/* Mechanisms with hard contacts, or with hard stops. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_CONTACT_MECHANISMS_H
#define KT_BENCH_CONTACT_MECHANISMS_H

#include "kinetree/model.h"

enum {
    KT_MECHANISM_BODIES = 32,
    KT_MECHANISM_ITEMS = 20,
    KT_MECHANISM_PLANES = 8,
    KT_MECHANISM_EFFECTS = KT_MECHANISM_ITEMS * (KT_MECHANISM_PLANES + KT_MECHANISM_ITEMS / 2)
};

/* A sphere that touches the planes, or a stop of a joint. */
typedef struct kt_mechanism_item {
    bool stop;
    const char *body; /* or the joint */
    kt_vec3 at;
    double radius, friction, restitution, lower;
} kt_mechanism_item;

/* A plane through a point, with its normal. */
typedef struct kt_mechanism_plane {
    kt_vec3 at, normal;
} kt_mechanism_plane;

typedef struct kt_contact_mechanism {
    kt_body body[KT_MECHANISM_BODIES];
    char name[KT_MECHANISM_BODIES][8];
    kt_mechanism_item item[KT_MECHANISM_ITEMS];
    kt_mechanism_plane plane[KT_MECHANISM_PLANES];
    int bodies, items, planes;
    bool closed;  /* a pin closes a four-bar */
    bool touches; /* spheres touch each other as well */
    kt_effect effect[KT_MECHANISM_EFFECTS];
    char effect_name[KT_MECHANISM_EFFECTS][8];
    kt_loop pin;
} kt_contact_mechanism;

/* The block: the height of its centre at rest, and of its fall, m; its speed along x, m/s. */
#define KT_BLOCK_LOW 0.12
#define KT_BLOCK_DROP 0.1
#define KT_BLOCK_SPEED 2.0

void kt_mechanism_box(kt_contact_mechanism *m);
void kt_mechanism_tripod(kt_contact_mechanism *m); /* the box on three corners */
void kt_mechanism_block(kt_contact_mechanism *m);  /* falls flat on its four corners and slides */
void kt_mechanism_heap(kt_contact_mechanism *m);   /* of 20 spheres above a bin whose floor is a funnel */
void kt_mechanism_quadruped(kt_contact_mechanism *m);
void kt_mechanism_humanoid(kt_contact_mechanism *m);
void kt_mechanism_biped(kt_contact_mechanism *m);   /* the legs of the humanoid with its pelvis */
void kt_mechanism_chain(kt_contact_mechanism *m);   /* of 20 links in space, with 10 stops */
void kt_mechanism_fourbar(kt_contact_mechanism *m); /* with a rod on its coupler, whose joint has a stop */

/* Describes the mechanism; with its contacts, or without. The parts of the description are in *m. */
kt_description kt_mechanism_describe(kt_contact_mechanism *m, bool contacts);

/* Compiles this description. */
KT_CHECKED kt_status kt_mechanism_compile(kt_contact_mechanism *m, bool contacts, kt_isa isa, kt_model **model,
                                          kt_error *error);

#endif
