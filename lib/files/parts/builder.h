/* The arrays of a builder. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BUILD_BUILDER_H
#define KT_BUILD_BUILDER_H

#include "base/pool.h"
#include "kinetree/build.h"

struct kt_builder {
    kt_pool pool; /* names and markers */
    kt_body *bodies;
    kt_loop *loops;
    kt_effect *effects;
    int body_count, loop_count, effect_count; /* in use */
    size_t body_room, loop_room, effect_room; /* allocated */
};

/* Makes room for this many further items. */
kt_status kt_builder_reserve(kt_builder *builder, int bodies, int loops, int effects, kt_error *error);

/* A name that belongs to the builder: STEM, between, number. NULL if there is no memory. */
const char *kt_builder_name(kt_builder *builder, const char *stem, const char *between, int number);

/* A marker that belongs to the builder; NULL if there is no memory. */
const kt_marker *kt_builder_marker(kt_builder *builder, const char *name, kt_vec3 at);

kt_status kt_builder_out_of_memory(kt_error *error);

#endif
