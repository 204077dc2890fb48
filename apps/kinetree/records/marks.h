/* Times and names of the events that have written rows, and of hard contacts, for pictures. Summaries and checkpoints
 * list them, so that pictures of finished records show the events of the run. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_MARKS_H
#define KT_COMMAND_RECORDS_MARKS_H

#include "kinetree/simulation.h"

struct json_t; /* from jansson */

/* Pictures show at most this number of events: the first ones. */
enum { KT_MARKS_MAX = 500 };

typedef struct kt_mark {
    double time;      /* s */
    const char *name; /* the event's */
} kt_mark;

/* The last record of a hard contact, and the last one after a transition. An instant of several contacts spans records,
 * and a checkpoint may lie between them. */
typedef struct kt_contact_mark {
    bool any;             /* a hard contact has been recorded, */
    bool moved;           /* and one after a transition */
    double time;          /* s, of the record */
    double moved_at;      /* s, of the record after a transition */
    uint64_t transitions; /* transitions of hard contacts until the record */
} kt_contact_mark;

typedef struct kt_marks {
    int count;
    bool is_cut; /* more marks have occurred than there is room for */
    kt_contact_mark contact;
    kt_mark mark[KT_MARKS_MAX];
    struct json_t *read; /* owns the names of those that were read; NULL: none were */
} kt_marks;

/* Adds the event of a record, if the record has one. An event has a row before and a row behind it, so that the event
 * that was added last is not added again. */
void kt_marks_add(kt_marks *marks, const kt_record *record);

/* Adds the event of a hard contact if an impact or a transition happens at its instant. A contact may also arrive or
 * part within rounding while others carry the body, which changes nothing. The contacts of one instant may change
 * together, at the first of their events. A contact that comes to rest without an event has one record, after its
 * transition. `seen`: the counts at the record. */
void kt_marks_add_contact(kt_marks *marks, const kt_record *record, const kt_contact_counts *seen);

/* Notes the counts at any other record: transitions before it belong to no later record of a contact. */
void kt_marks_sync_contacts(kt_marks *marks, const kt_record *record, const kt_contact_counts *seen);

/* Returns a new object with "marks", a list of {time, name}, and "marks_cut". */
struct json_t *kt_marks_describe(const kt_marks *marks);

/* Returns a new object with all members of `marks`, for checkpoints. */
struct json_t *kt_marks_save(const kt_marks *marks);

/* Reads the marks of an object of kt_marks_describe or kt_marks_save, which may have other members. Returns false if
 * the object has no valid marks. Ownership: takes a reference to the object; kt_marks_free releases it. */
bool kt_marks_read(kt_marks *marks, struct json_t *object);
/* Reads the marks of a summary, and the name of its scene unless `name` is NULL. command: for messages. Returns -1, or
 * an exit code after printing the error. */
int kt_marks_load(const char *path, const char *command, kt_marks *marks, char *name, size_t size);
void kt_marks_free(kt_marks *marks);

/* Returns the note for a subtitle: "", or the number of marked events if there were more. */
const char *kt_marks_note(const kt_marks *marks);

#endif
