/* The records of links, bodies and planes in lanes. A record begins with its floating-point numbers, each for all
 * lanes. The members that all lanes share, such as indices, follow. Code that is compiled for lanes declares the
 * records in this way (model/record.h, model/planar.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BATCH_INTERLEAVE_H
#define KT_BATCH_INTERLEAVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The shape of a record of one model: its bytes, the number of floating-point numbers at its beginning, and the end of
 * its last member. Bytes behind that end are padding of any value. */
typedef struct kt_record_shape {
    size_t bytes, numbers, end;
} kt_record_shape;

extern const kt_record_shape kt_link_shape, kt_planar_link_shape, kt_plane_shape, kt_body_shape;

/* `count` records: the records of one model, and the records in lanes, which are `stride` bytes apart. */
typedef struct kt_records {
    const kt_record_shape *shape;
    size_t count, width, stride;
    const void *from;
    void *to;
} kt_records;

/* Writes the numbers to the lanes of a mask, and the shared members. */
void kt_records_interleave(const kt_records *records, uint32_t lanes);

#endif
