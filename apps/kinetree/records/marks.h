/* Events that have written rows, and those of hard contacts, for pictures: when, and their names. */
#ifndef KT_COMMAND_RECORDS_MARKS_H
#define KT_COMMAND_RECORDS_MARKS_H

#include "kinetree/simulation.h"

/* Pictures show the first ones of more. */
enum { KT_MARKS_MAX = 500 };

typedef struct kt_mark {
    double time;      /* s */
    const char *name; /* the event's */
} kt_mark;

typedef struct kt_marks {
    int count;
    bool is_cut; /* there were more */
    kt_mark mark[KT_MARKS_MAX];
} kt_marks;

/* Adds the event of a record, if it is one and not the one that was added last: before and behind it there is a row. */
static inline void kt_marks_add(kt_marks *marks, const kt_record *record) {
    const kt_mark *last = marks->count > 0 ? &marks->mark[marks->count - 1] : NULL;
    if (record->event == NULL || (last != NULL && last->time == record->time && last->name == record->event->name))
        return;
    marks->is_cut = marks->count == KT_MARKS_MAX;
    if (!marks->is_cut)
        marks->mark[marks->count++] = (kt_mark){record->time, record->event->name};
}

#endif
