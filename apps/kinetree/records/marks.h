/* Times and names of the events that have written rows, and of hard contacts, for pictures. Summaries and checkpoints
 * list them, so that pictures of finished records show the events of the run. */
#ifndef KT_COMMAND_RECORDS_MARKS_H
#define KT_COMMAND_RECORDS_MARKS_H

#include "kinetree/simulation.h"

#include <jansson.h>

/* Pictures show at most this number of events: the first ones. */
enum { KT_MARKS_MAX = 500 };

typedef struct kt_mark {
    double time;      /* s */
    const char *name; /* the event's */
} kt_mark;

typedef struct kt_marks {
    int count;
    bool is_cut; /* there were more */
    kt_mark mark[KT_MARKS_MAX];
    json_t *read; /* owns the names of those that were read; NULL: none were */
} kt_marks;

/* Adds the event of a record, if the record has one. An event has a row before and a row behind it, so that the event
 * that was added last is not added again. */
void kt_marks_add(kt_marks *marks, const kt_record *record);

/* Returns a new object with "marks", a list of {time, name}, and "marks_cut". */
json_t *kt_marks_describe(const kt_marks *marks);

/* Reads the marks of an object of kt_marks_describe, which may have other members. Returns false if the object has no
 * valid marks. Ownership: takes a reference to the object; kt_marks_free releases it. */
bool kt_marks_read(kt_marks *marks, json_t *object);
void kt_marks_free(kt_marks *marks);

/* Returns the note for a subtitle: "", or the number of marked events if there were more. */
const char *kt_marks_note(const kt_marks *marks);

#endif
