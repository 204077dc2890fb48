/* kinetree info --plan: what is computed for a scene, and what is not. */
#include "info_plan.h"

#include "json.h"

#include <stdio.h>
#include <string.h>

static const char *const phase_names[KT_PHASE_COUNT] = {"evaluation", "step", "record"};
static const char *const phase_titles[KT_PHASE_COUNT] = {"At every evaluation of accelerations", "After every step",
                                                         "At every record"};

/* "2 links", "1 link"; units are plurals, but for "pass", of which there is one. */
static void print_amount(const kt_plan_step *s, char *text, size_t size) {
    const size_t length = strlen(s->unit);
    const char *body = s->count == 1 && strcmp(s->unit, "bodies") == 0 ? "body" : s->unit;
    const bool cut =
        s->count == 1 && length > 1 && body == s->unit && s->unit[length - 1] == 's' && s->unit[length - 2] != 's';
    snprintf(text, size, "%lld %.*s", (long long)s->count, (int)strlen(body) - cut, body);
}

static void print_phase(const kt_plan_step *steps, int count, kt_phase phase) {
    int done = 0;
    printf("\n%s\n", phase_titles[phase]);
    for (int i = 0; i < count; i++) {
        const kt_plan_step *s = &steps[i];
        if (s->phase != phase || s->dropped)
            continue;
        char amount[48];
        print_amount(s, amount, sizeof amount);
        printf("  %-42s %s\n", s->name, amount);
        done++;
    }
    if (done == 0)
        puts("  nothing");
}

static void print_dropped(const kt_plan_step *steps, int count) {
    puts("\nLeft out");
    for (int i = 0; i < count; i++)
        if (steps[i].dropped)
            printf("  %-42s %s\n", steps[i].name, steps[i].dropped);
}

void kt_info_print_plan(const kt_model *model, const kt_run *run) {
    kt_plan_step steps[KT_PLAN_STEPS_MAX];
    const int count = kt_plan_steps(model, run, steps);
    printf("Plan: %s\n", kt_model_plan(model));
    for (int phase = 0; phase < KT_PHASE_COUNT; phase++)
        print_phase(steps, count, (kt_phase)phase);
    print_dropped(steps, count);
}

int kt_info_write_plan(const kt_model *model, const kt_run *run) {
    kt_plan_step steps[KT_PLAN_STEPS_MAX];
    const int count = kt_plan_steps(model, run, steps);
    json_t *root = json_object(), *list = json_array();
    for (int i = 0; i < count; i++) {
        const kt_plan_step *s = &steps[i];
        json_t *step = json_pack("{s:s, s:s, s:I, s:s}", "phase", phase_names[s->phase], "name", s->name, "count",
                                 (json_int_t)s->count, "unit", s->unit);
        json_object_set_new(step, "dropped", s->dropped ? json_string(s->dropped) : json_null());
        json_array_append_new(list, step);
    }
    json_object_set_new(root, "plan", json_string(kt_model_plan(model)));
    json_object_set_new(root, "steps", list);
    return kt_json_write(root, "-");
}
