/* Arrays that grow on the heap; kt_pool_grow (pool.h) does the same in a pool. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_GROW_H
#define KT_BASE_GROW_H

#include <stdlib.h>

/* Returns a room that holds `more` items behind `count`: the present room if it suffices, else more than twice as much.
 * Returns 0 if the number of items overflows. */
static inline size_t kt_grown_room(size_t count, size_t more, size_t room) {
    enum { ROOM_MOST = 1 << 30, ROOM_FIRST = 8 };
    if (count <= room && more <= room - count)
        return room;
    if (count > ROOM_MOST || more > ROOM_MOST - count)
        return 0;
    return (2 * room > count + more ? 2 * room : count + more) + ROOM_FIRST;
}

/* Returns the array with room for `more` items behind `count`, at its old or at a new place; if memory is missing,
 * returns NULL and leaves the old array unchanged. */
static inline void *kt_heap_grow(void *items, size_t count, size_t more, size_t *room, size_t size) {
    const size_t wanted = kt_grown_room(count, more, *room);
    if (wanted == *room)
        return items;
    void *grown = wanted > 0 && wanted <= (size_t)-1 / size ? realloc(items, wanted * size) : NULL;
    if (grown != NULL)
        *room = wanted;
    return grown;
}

#endif
