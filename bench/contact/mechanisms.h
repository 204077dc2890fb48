/* Mechanisms with hard contacts on a floor, or with hard stops. */
#ifndef KT_BENCH_CONTACT_MECHANISMS_H
#define KT_BENCH_CONTACT_MECHANISMS_H

#include "kinetree/model.h"

enum { KT_MECHANISM_BODIES = 32, KT_MECHANISM_ITEMS = 16 };

/* A contact of a sphere with the floor z = 0, or a stop of a joint. */
typedef struct kt_mechanism_item {
    bool stop;
    const char *body; /* or the joint */
    kt_vec3 at;
    double radius, friction, restitution, lower;
} kt_mechanism_item;

typedef struct kt_mechanism {
    kt_body body[KT_MECHANISM_BODIES];
    char name[KT_MECHANISM_BODIES][8];
    kt_mechanism_item item[KT_MECHANISM_ITEMS];
    int bodies, items;
    bool closed; /* a pin closes a four-bar */
} kt_mechanism;

void kt_mechanism_box(kt_mechanism *m);
void kt_mechanism_tripod(kt_mechanism *m); /* the box on three corners */
void kt_mechanism_quadruped(kt_mechanism *m);
void kt_mechanism_humanoid(kt_mechanism *m);
void kt_mechanism_biped(kt_mechanism *m);   /* the legs of the humanoid with its pelvis */
void kt_mechanism_chain(kt_mechanism *m);   /* of 20 links in space, with 10 stops */
void kt_mechanism_fourbar(kt_mechanism *m); /* with a rod on its coupler, whose joint has a stop */

/* Compiles the mechanism; with its contacts, or without. */
KT_CHECKED kt_status kt_mechanism_compile(const kt_mechanism *m, bool contacts, kt_isa isa, kt_model **model,
                                          kt_error *error);

#endif
