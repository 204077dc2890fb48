/* A builder: arrays that double when they are full, and a pool for the names. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parts/builder.h"

#include "base/grow.h"
#include "base/require.h"

#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

kt_status kt_builder_out_of_memory(kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, "builder", "there is not enough memory");
}

kt_status kt_builder_create(kt_builder **builder, kt_error *error) {
    if (KT_IS_MISSING(error, builder))
        return KT_ERROR_ARGUMENT;
    *builder = calloc(1, sizeof **builder);
    return *builder != NULL ? KT_OK : kt_builder_out_of_memory(error);
}

void kt_builder_free(kt_builder *builder) {
    if (builder == NULL)
        return;
    free(builder->bodies);
    free(builder->loops);
    free(builder->effects);
    kt_pool_free(builder->pool.chunks);
    free(builder);
}

kt_status kt_builder_reserve(kt_builder *b, int bodies, int loops, int effects, kt_error *error) {
    const size_t body_count = (size_t)b->body_count, loop_count = (size_t)b->loop_count,
                 effect_count = (size_t)b->effect_count;
    kt_body *body = kt_heap_grow(b->bodies, body_count, (size_t)bodies, &b->body_room, sizeof *body);
    b->bodies = body != NULL ? body : b->bodies;
    kt_loop *loop = kt_heap_grow(b->loops, loop_count, (size_t)loops, &b->loop_room, sizeof *loop);
    b->loops = loop != NULL ? loop : b->loops;
    kt_effect *effect = kt_heap_grow(b->effects, effect_count, (size_t)effects, &b->effect_room, sizeof *effect);
    b->effects = effect != NULL ? effect : b->effects;
    const bool fits = b->body_room >= body_count + (size_t)bodies && b->loop_room >= loop_count + (size_t)loops &&
                      b->effect_room >= effect_count + (size_t)effects;
    return fits ? KT_OK : kt_builder_out_of_memory(error);
}

const char *kt_builder_name(kt_builder *builder, const char *stem, const char *between, int number) {
    enum { DIGITS = 12 };
    const size_t size = strlen(stem) + strlen(between) + DIGITS;
    char *name = kt_pool_take(&builder->pool, size, 1);
    if (name != NULL)
        (void)snprintf(name, size, "%s%s%d", stem, between, number);
    return name;
}

const kt_marker *kt_builder_marker(kt_builder *builder, const char *name, kt_vec3 at) {
    kt_marker *marker = kt_pool_take(&builder->pool, 1, sizeof *marker);
    if (marker != NULL)
        *marker = (kt_marker){.name = name, .at = at};
    return marker;
}

kt_status kt_builder_add_body(kt_builder *builder, const kt_body *body, kt_error *error) {
    if (KT_IS_MISSING(error, builder, body))
        return KT_ERROR_ARGUMENT;
    const kt_body copy = *body; /* it may lie in the array, which moves */
    const kt_status status = kt_builder_reserve(builder, 1, 0, 0, error);
    if (status == KT_OK)
        builder->bodies[builder->body_count++] = copy;
    return status;
}

kt_status kt_builder_add_loop(kt_builder *builder, const kt_loop *loop, kt_error *error) {
    if (KT_IS_MISSING(error, builder, loop))
        return KT_ERROR_ARGUMENT;
    const kt_loop copy = *loop; /* it may lie in the array, which moves */
    const kt_status status = kt_builder_reserve(builder, 0, 1, 0, error);
    if (status == KT_OK)
        builder->loops[builder->loop_count++] = copy;
    return status;
}

kt_status kt_builder_add_effect(kt_builder *builder, const kt_effect *effect, kt_error *error) {
    if (KT_IS_MISSING(error, builder, effect))
        return KT_ERROR_ARGUMENT;
    const kt_effect copy = *effect; /* it may lie in the array, which moves */
    const kt_status status = kt_builder_reserve(builder, 0, 0, 1, error);
    if (status == KT_OK)
        builder->effects[builder->effect_count++] = copy;
    return status;
}

kt_body *kt_builder_body(kt_builder *builder, int i) {
    return builder != NULL && i >= 0 && i < builder->body_count ? &builder->bodies[i] : NULL;
}

kt_description kt_builder_describe(const kt_builder *builder) {
    kt_description description = kt_description_default();
    if (builder == NULL)
        return description;
    description.bodies = builder->bodies;
    description.body_count = builder->body_count;
    description.loops = builder->loops;
    description.loop_count = builder->loop_count;
    description.effects = builder->effects;
    description.effect_count = builder->effect_count;
    return description;
}
