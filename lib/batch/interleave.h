/* The records of links, bodies and planes in lanes: a record's numbers, which come first in it, each of all lanes; then
 * what all lanes have in common, as indices. So code that is compiled for lanes declares them (model/record.h,
 * model/planar.h).
 */
#ifndef KT_BATCH_INTERLEAVE_H
#define KT_BATCH_INTERLEAVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A record of one model: its bytes, how many numbers it begins with, and where its last member ends: what is behind that may
 * be of any value. */
typedef struct kt_record_shape {
    size_t bytes, numbers, end;
} kt_record_shape;

extern const kt_record_shape kt_link_shape, kt_planar_link_shape, kt_plane_shape, kt_body_shape;

/* `count` records: those of one model, and those in lanes, which are `stride` bytes apart. */
typedef struct kt_records {
    const kt_record_shape *shape;
    size_t count, width, stride;
    const void *from;
    void *to;
} kt_records;

/* Writes the numbers to the lanes of a mask, and what is common. */
void kt_records_interleave(const kt_records *records, uint32_t lanes);

/* Whether two arrays of records, of models of one structure, have in common what lanes must. */
bool kt_records_agree(const kt_record_shape *shape, size_t count, const void *a, const void *b);

#endif
