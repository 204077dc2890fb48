/* Marks of hard contacts across a checkpoint. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/marks.h"

#include "check.h"
#include <jansson.h>

/* A record of a contact's event, after `transitions` impacts. */
static void add(kt_marks *marks, const char *name, double time, uint64_t transitions) {
    const kt_event event = {.name = name};
    const kt_record record = {.t = time, .event = &event, .index = KT_INDEX_CONTACT};
    const kt_contact_counts seen = {.impacts = transitions};
    kt_marks_add_contact(marks, &record, &seen);
}

/* Writes the marks as a checkpoint does, and reads the text. */
static bool resume(const kt_marks *from, kt_marks *to) {
    json_t *saved = kt_marks_save(from);
    char *text = json_dumps(saved, JSON_COMPACT | JSON_REAL_PRECISION(17));
    json_t *read = text != NULL ? json_loads(text, 0, NULL) : NULL;
    const bool fine = read != NULL && kt_marks_read(to, read);
    json_decref(read);
    json_decref(saved);
    free(text);
    return fine;
}

/* Two corners of a box reach the floor at an instant. The first event makes both transitions, and the second one makes
 * none. A contact that arrives within rounding a moment later has no mark. A checkpoint behind any of the records
 * leaves the marks as they are. */
KT_TEST(a_checkpoint_between_contacts_of_one_instant_keeps_their_marks) {
    static const double instant = 1.0 / 3.0, later = 0.34;
    static const struct {
        const char *name;
        double time;
        uint64_t transitions;
    } records[] = {{"left", instant, 7}, {"left", instant, 9}, {"right", instant, 9}, {"right", instant, 9},
                   {"left", later, 9},   {"left", later, 9},   {"right", 0.5, 9},     {"right", 0.5, 10}};
    enum { RECORDS = sizeof records / sizeof *records };
    static const char *const names[] = {"left", "right", "right"};
    const double times[] = {instant, instant, 0.5};
    for (int pause = 0; pause <= RECORDS; pause++) {
        kt_marks first = {.count = 0}, second = {.count = 0}, *marks = &first;
        for (int i = 0; i < RECORDS; i++) {
            if (i == pause && kt_check_true("resumes", resume(&first, &second)))
                marks = &second;
            add(marks, records[i].name, records[i].time, records[i].transitions);
        }
        kt_note("a checkpoint behind %d records", pause);
        if (kt_check_equal_int("marks", marks->count, 3))
            for (int k = 0; k < 3; k++) {
                kt_check_text("name", marks->mark[k].name, names[k]);
                kt_check_equal_bits("time", &marks->mark[k].time, &times[k], 1);
            }
        kt_marks_free(&second);
    }
}

/* Summaries list the marks alone. */
KT_TEST(a_summary_has_no_state_of_contacts) {
    kt_marks marks = {.count = 0};
    add(&marks, "left", 0.5, 1);
    add(&marks, "left", 0.5, 2);
    json_t *described = kt_marks_describe(&marks), *saved = kt_marks_save(&marks);
    kt_check_equal_int("members of a summary", (long long)json_object_size(described), 2);
    kt_check_equal_int("members of a checkpoint", (long long)json_object_size(saved), 4);
    json_decref(saved);
    json_decref(described);
}
