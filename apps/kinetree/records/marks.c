/* Lists the events of a run for its pictures. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/marks.h"

#include <string.h>

void kt_marks_add(kt_marks *marks, const kt_record *record) {
    const kt_mark *last = marks->count > 0 ? &marks->mark[marks->count - 1] : NULL;
    if (record->event == NULL ||
        (last != NULL && last->time == record->t && strcmp(last->name, record->event->name) == 0))
        return;
    marks->is_cut = marks->count == KT_MARKS_MAX;
    if (!marks->is_cut)
        marks->mark[marks->count++] = (kt_mark){record->t, record->event->name};
}

static uint64_t count_transitions(const kt_contact_counts *seen) {
    return seen->impacts + seen->closings + seen->openings + seen->sticks + seen->slips + seen->jammed;
}

void kt_marks_sync_contacts(kt_marks *marks, const kt_record *record, const kt_contact_counts *seen) {
    kt_contact_mark *last = &marks->contact;
    last->time = last->any ? last->time : record->t;
    last->any = true;
    last->transitions = count_transitions(seen);
}

void kt_marks_add_contact(kt_marks *marks, const kt_record *record, const kt_contact_counts *seen) {
    const uint64_t now = count_transitions(seen);
    kt_contact_mark *last = &marks->contact;
    if (last->any && now != last->transitions) {
        last->moved = true;
        last->moved_at = record->t;
    }
    last->any = true;
    last->time = record->t;
    last->transitions = now;
    if (last->moved && record->t == last->moved_at)
        kt_marks_add(marks, record);
}

const char *kt_marks_note(const kt_marks *marks) { return marks->is_cut ? "; the first 500 events are marked" : ""; }
