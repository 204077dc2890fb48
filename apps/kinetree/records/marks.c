/* Lists the events of a run for its pictures, and reads such a list. */
#include "records/marks.h"

#include "text/json.h"

#include <string.h>

void kt_marks_add(kt_marks *marks, const kt_record *record) {
    const kt_mark *last = marks->count > 0 ? &marks->mark[marks->count - 1] : NULL;
    if (record->event == NULL ||
        (last != NULL && last->time == record->time && strcmp(last->name, record->event->name) == 0))
        return;
    marks->is_cut = marks->count == KT_MARKS_MAX;
    if (!marks->is_cut)
        marks->mark[marks->count++] = (kt_mark){record->time, record->event->name};
}

static uint64_t count_transitions(const kt_contact_counts *seen) {
    return seen->impacts + seen->closings + seen->openings + seen->sticks + seen->slips + seen->jammed;
}

void kt_marks_sync_contacts(kt_marks *marks, const kt_record *record, const kt_contact_counts *seen) {
    kt_contact_mark *last = &marks->contact;
    last->time = last->any ? last->time : record->time;
    last->any = true;
    last->transitions = count_transitions(seen);
}

void kt_marks_add_contact(kt_marks *marks, const kt_record *record, const kt_contact_counts *seen) {
    const uint64_t now = count_transitions(seen);
    kt_contact_mark *last = &marks->contact;
    if (last->any && now != last->transitions) {
        last->moved = true;
        last->moved_at = record->time;
    }
    last->any = true;
    last->time = record->time;
    last->transitions = now;
    if (last->moved && record->time == last->moved_at)
        kt_marks_add(marks, record);
}

json_t *kt_marks_describe(const kt_marks *marks) {
    json_t *list = json_array();
    for (int i = 0; i < marks->count; i++)
        json_array_append_new(
            list, json_pack("{s:f, s:o}", "time", marks->mark[i].time, "name", kt_json_text(marks->mark[i].name)));
    return json_pack("{s:o, s:b}", "marks", list, "marks_cut", (int)marks->is_cut);
}

json_t *kt_marks_save(const kt_marks *marks) {
    json_t *object = kt_marks_describe(marks);
    const kt_contact_mark *last = &marks->contact;
    if (last->any)
        json_object_set_new(object, "contact",
                            json_pack("{s:f, s:I}", "time", last->time, "transitions", (json_int_t)last->transitions));
    if (last->moved)
        json_object_set_new(object, "contact_moved", json_real(last->moved_at));
    return object;
}

static void read_contact(kt_contact_mark *to, const json_t *object) {
    const json_t *contact = json_object_get(object, "contact"), *moved = json_object_get(object, "contact_moved");
    to->any = contact != NULL;
    to->time = json_number_value(json_object_get(contact, "time"));
    to->transitions = (uint64_t)json_integer_value(json_object_get(contact, "transitions"));
    to->moved = moved != NULL;
    to->moved_at = json_number_value(moved);
}

bool kt_marks_read(kt_marks *marks, json_t *object) {
    const json_t *list = json_object_get(object, "marks");
    const size_t count = json_array_size(list);
    *marks = (kt_marks){.is_cut = json_is_true(json_object_get(object, "marks_cut"))};
    if (!json_is_array(list) || count > KT_MARKS_MAX)
        return false;
    read_contact(&marks->contact, object);
    for (size_t i = 0; i < count; i++) {
        const json_t *mark = json_array_get(list, i), *time = json_object_get(mark, "time");
        const char *name = json_string_value(json_object_get(mark, "name"));
        if (!json_is_number(time) || name == NULL)
            return false;
        marks->mark[marks->count++] = (kt_mark){json_number_value(time), name};
    }
    marks->read = json_incref(object);
    return true;
}

void kt_marks_free(kt_marks *marks) {
    json_decref(marks->read);
    *marks = (kt_marks){.count = 0};
}

const char *kt_marks_note(const kt_marks *marks) { return marks->is_cut ? "; the first 500 events are marked" : ""; }
