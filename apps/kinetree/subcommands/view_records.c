/* kinetree view --records: a page of a motion that has been recorded, by a run or by a program. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/recorded.h"
#include "open/released.h"
#include "subcommands/run.h"
#include "view/view.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Records have no list of the loops and effects that are released. */
static void note_released(const kt_scene *scene) {
    char names[400];
    kt_released_names(scene, names, sizeof names);
    if (names[0] != '\0')
        kt_say("view: records do not list the loops and effects that are released: %s are shown as at the start",
               names);
}

static int write_recorded(const kt_run_arguments *arguments, const kt_scene *scene, const kt_model *model,
                          const char *title, const char *page) {
    kt_recorded recorded;
    kt_marks marks = {.count = 0};
    char method[200];
    int code = arguments->marks != NULL ? kt_marks_load(arguments->marks, "view", &marks, NULL, 0) : -1;
    if (code >= 0)
        return code;
    code = kt_recorded_open(&recorded, arguments->records, model);
    const char *slash = strrchr(arguments->records, '/');
    (void)snprintf(method, sizeof method, "records of %.180s", slash != NULL ? slash + 1 : arguments->records);
    const kt_view view = {.name = title, .method = method, .marks = &marks};
    if (code == KT_EXIT_DONE && !arguments->quiet)
        note_released(scene);
    if (code == KT_EXIT_DONE)
        code = kt_view_write_recorded(scene, model, &recorded, arguments->boxes, &view, page);
    kt_recorded_close(&recorded);
    kt_marks_free(&marks);
    return code;
}

int kt_run_view_records(const kt_run_arguments *arguments, const kt_scene *scene, const kt_model *model,
                        const char *base) {
    char own[4096], replaced[400] = "";
    if (arguments->out != NULL)
        return kt_misuse("view: --records shows records and writes none; leave out --out, or name a page, FILE.html");
    snprintf(own, sizeof own, "%s.html", base);
    const char *page = arguments->view != NULL ? arguments->view : own;
    int code = kt_check_result("view", "the records", arguments->records, "--view", page);
    code = code < 0 ? kt_check_ending("--view", page, ".html") : code;
    if (code >= 0)
        return code;
    kt_note_replaced(page, replaced, sizeof replaced);
    code = write_recorded(arguments, scene, model, kt_title_of(model, base), page);
    if (code == KT_EXIT_DONE && !arguments->quiet)
        kt_say_written("view", page, "", replaced);
    return code;
}
