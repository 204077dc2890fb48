/* Events that have written rows, and those of hard contacts, for pictures: when, and their names. Summaries and checkpoints list them,
 * so that pictures of finished records have those of the run. */
#ifndef KT_COMMAND_RECORDS_MARKS_H
#define KT_COMMAND_RECORDS_MARKS_H

#include "kinetree/simulation.h"

#include <jansson.h>

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
    json_t *read; /* owns the names of those that were read; NULL: none were */
} kt_marks;

/* Adds the event of a record, if it is one and not the one that was added last: before and behind it there is a row. */
void kt_marks_add(kt_marks *marks, const kt_record *record);

/* A new object with "marks", a list of {time, name}, and "marks_cut". */
json_t *kt_marks_describe(const kt_marks *marks);

/* Takes the marks of an object that describes them, among other things, and shares it; kt_marks_free follows. False: it does not. */
bool kt_marks_read(kt_marks *marks, json_t *object);
void kt_marks_free(kt_marks *marks);

/* What a subtitle says of them: "", or how many are shown of more. */
const char *kt_marks_note(const kt_marks *marks);

#endif
