/* Writes the events of a run as JSON, and reads such a list. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/marks.h"

#include "text/json.h"

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
