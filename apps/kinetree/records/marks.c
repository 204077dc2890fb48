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

json_t *kt_marks_describe(const kt_marks *marks) {
    json_t *list = json_array();
    for (int i = 0; i < marks->count; i++)
        json_array_append_new(
            list, json_pack("{s:f, s:o}", "time", marks->mark[i].time, "name", kt_json_text(marks->mark[i].name)));
    return json_pack("{s:o, s:b}", "marks", list, "marks_cut", (int)marks->is_cut);
}

bool kt_marks_read(kt_marks *marks, json_t *object) {
    const json_t *list = json_object_get(object, "marks");
    const size_t count = json_array_size(list);
    *marks = (kt_marks){.is_cut = json_is_true(json_object_get(object, "marks_cut"))};
    if (!json_is_array(list) || count > KT_MARKS_MAX)
        return false;
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
