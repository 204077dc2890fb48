/* A problem with Coulomb's friction, its solver and a solution, in memory that is full of garbage at first. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CONE_ROOM_H
#define KT_TEST_CONE_ROOM_H

#include "cone/coulomb.h"

#include <stdlib.h>
#include <string.h>

#include "check.h"

typedef struct coulomb_room {
    kt_coulomb *c;
    kt_coulomb_solver *solver;
    kt_coulomb_solution *solution;
    void *memory[4];
} coulomb_room;

static inline void *make_garbage(size_t size) {
    void *memory = aligned_alloc(KT_ARENA_ALIGNMENT, size);
    kt_need(memory != NULL);
    return memset(memory, 0xa5, size);
}

/* For up to so many items and rows; the matrices have room for all items. */
static inline coulomb_room make_room(size_t items, size_t rows) {
    coulomb_room room = {.memory = {make_garbage(kt_coulomb_matrices_size(rows, items)),
                                    make_garbage(kt_coulomb_size(items, rows)),
                                    make_garbage(kt_coulomb_solver_size(items, rows, items)),
                                    make_garbage(kt_coulomb_solution_size(items, rows))}};
    room.c = kt_coulomb_init(items, rows, items, room.memory[1], room.memory[0]);
    room.solver = kt_coulomb_solver_init(items, rows, items, room.memory[2], room.memory[0]);
    room.solution = kt_coulomb_solution_init(items, rows, room.memory[3]);
    return room;
}

static inline void free_room(coulomb_room *room) {
    for (size_t k = 0; k < sizeof room->memory / sizeof *room->memory; k++)
        free(room->memory[k]);
}

#endif
