/* Arrays that grow: on the heap here, in a pool by kt_pool_grow (pool.h). */
#ifndef KT_BASE_GROW_H
#define KT_BASE_GROW_H

#include <stdlib.h>

/* The room for `more` items behind `count`: as it is if that suffices, else more than twice as large; 0: too much. */
static inline size_t kt_grown_room(size_t count, size_t more, size_t room) {
    enum { ROOM_MOST = 1 << 30, ROOM_FIRST = 8 };
    if (count <= room && more <= room - count)
        return room;
    if (count > ROOM_MOST || more > ROOM_MOST - count)
        return 0;
    return (2 * room > count + more ? 2 * room : count + more) + ROOM_FIRST;
}

/* Returns the array with room for `more` items behind `count`, at its old or at a new place; NULL if there is no memory
 * for it. The old array is then unchanged. */
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
