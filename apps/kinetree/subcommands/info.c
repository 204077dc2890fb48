/* kinetree info: shows the contents of a scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/penetration.h"
#include "subcommands/run.h"
#include "text/arguments.h"
#include "text/json.h"
#include "text/reference.h"

#include "kinetree/batch.h"
#include "kinetree/build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the plan --------------------------------------------------------------------------------------------------- */

static const char *const phase_names[KT_PHASE_COUNT] = {"evaluation", "step", "record"};
static const char *const phase_titles[KT_PHASE_COUNT] = {"At every evaluation of accelerations", "After every step",
                                                         "At every record"};

/* Writes "2 links", "1 link". All units are plurals except "pass", whose count is always one. */
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

/* ---- the forms of constraint groups ------------------------------------------------------------------------------ */

static const char *form_name(kt_group_form form) {
#define INFO_FORM(id, name) [id] = #name,
    static const char *const names[KT_GROUP_FORM_COUNT] = {KT_GROUP_FORM_LIST(INFO_FORM)};
#undef INFO_FORM
    return names[form];
}

static bool groups_are_alike(const kt_loop_group *a, const kt_loop_group *b) {
    return a->form == b->form && a->reason == b->reason && a->coordinates == b->coordinates &&
           a->equations == b->equations && a->rank == b->rank;
}

/* Returns the number of successive groups from `first` on with equal printed values. */
static int alike_from(const kt_model *model, int first) {
    const kt_loop_group group = kt_loop_group_at(model, first);
    int end = first + 1;
    while (end < kt_loop_group_count(model)) {
        const kt_loop_group next = kt_loop_group_at(model, end);
        if (!groups_are_alike(&group, &next))
            break;
        end++;
    }
    return end - first;
}

static void print_groups(const kt_model *model) {
    const int count = kt_loop_group_count(model);
    if (count)
        puts("\nForms of constraint groups");
    for (int first = 0, alike; first < count; first += alike) {
        const kt_loop_group group = kt_loop_group_at(model, first);
        alike = alike_from(model, first);
        printf("  %-9s %3d group%s of %d coordinates, %d equations, rank %d: %s\n", form_name(group.form), alike,
               alike > 1 ? "s" : "", group.coordinates, group.equations, group.rank, group.reason);
    }
}

static json_t *list_groups(const kt_model *model) {
    json_t *list = json_array();
    for (int g = 0; g < kt_loop_group_count(model); g++) {
        const kt_loop_group group = kt_loop_group_at(model, g);
        json_array_append_new(list, json_pack("{s:s, s:s, s:i, s:i, s:i}", "form", form_name(group.form), "reason",
                                              group.reason, "coordinates", group.coordinates, "equations",
                                              group.equations, "rank", group.rank));
    }
    return list;
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

static void print_plan(const kt_model *model, const kt_model *integrated, const kt_plan_step *steps, int count) {
    printf("Plan: %s\n", kt_model_plan(model));
    for (int phase = 0; phase < KT_PHASE_COUNT; phase++)
        print_phase(steps, count, (kt_phase)phase);
    print_groups(integrated);
    print_dropped(steps, count);
}

static int write_plan(const kt_model *model, const kt_model *integrated, const kt_plan_step *steps, int count) {
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
    json_object_set_new(root, "groups", list_groups(integrated));
    return kt_json_write(root, "-");
}

typedef struct info_arguments {
    kt_settings settings;
    bool plan, json;
} info_arguments;

#define KT_AT(member) offsetof(info_arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_FLAG("plan", plan,
            "print the computations of each evaluation, step and record, their sizes, and those that the scene avoids"),
    KT_FLAG("json", json, "print the plan as JSON"),
    KT_READER_OPTIONS,
};

static const kt_option_rule rules[] = {{"json", true, "plan", NULL}};

const kt_usage kt_usage_info = {
    .command = "info",
    .examples = "  kinetree info robot.yaml\n"
                "  kinetree make tree --links 1000 | kinetree info -\n"
                "  kinetree info --plan robot.yaml\n",
    .operands = "SCENE",
    .about = "Shows sizes, masses and the settings of a run, and draws the tree of the scene.\n"
             "The tree has joints with their degrees of freedom (dof), masses and markers. Long chains and large trees "
             "are abridged.\n",
    KT_OPTIONS_OF(options),
    KT_RULES_OF(rules),
};

static const char *name_isa(kt_isa isa) {
    switch (isa) {
    case KT_ISA_V3:
        return "x86-64-v3 (AVX2)";
    case KT_ISA_V4:
        return "x86-64-v4 (AVX-512)";
    default:
        return "baseline";
    }
}

/* Sets rounding errors to zero for display. */
static double tidy(double x, double scale) { return fabs(x) < 1e-12 * scale ? 0.0 : x; }

static void show_sizes(const kt_model *model) {
    kt_mobility dof = kt_model_mobility(model);
    int nq = kt_model_nq(model), nv = kt_model_nv(model);
    printf("bodies     %d\n", kt_model_body_count(model) - 1);
    printf("dof        %d", dof.minimal);
    if (dof.equations > 0)
        printf(": %d of the tree, less %d by loops (%d equations)", dof.tree, dof.rank, dof.equations);
    if (nq != nv)
        printf(" (%d positions: %d quaternion%s)", nq, nq - nv, kt_plural(nq - nv));
    printf("\nplan       %s, %s kernels; --plan lists its steps\n", kt_model_plan(model),
           name_isa(kt_model_isa(model)));
}

enum { LISTED_MAX = 20 };

/* Shows a constraint group: its loops by name and type, and the number of its independent equations. */
static void show_group(const kt_model *model, int index) {
    const kt_loop_group group = kt_loop_group_at(model, index);
    const int redundant = group.equations - group.rank;
    for (int i = 0; i < group.loop_count && i < LISTED_MAX; i++)
        printf("%s%s (%s)", i ? ", " : "  ", kt_loop_name(model, group.loops[i]),
               kt_loop_type_name(kt_loop_type_of(model, group.loops[i])));
    if (group.loop_count > LISTED_MAX)
        printf(" and %d more", group.loop_count - LISTED_MAX);
    printf(": %d equation%s in %d coordinate%s, ", group.equations, kt_plural(group.equations), group.coordinates,
           kt_plural(group.coordinates));
    if (redundant > 0)
        printf("%d independent; %d repeat%s the others\n", group.rank, redundant, redundant == 1 ? "s" : "");
    else
        puts("all independent");
}

static void show_loops(const kt_model *model) {
    const int count = kt_loop_group_count(model);
    if (count > 0)
        puts(count == 1 ? "\nloops" : "\nloops, in groups that are reduced by themselves");
    for (int g = 0; g < count && g < LISTED_MAX; g++)
        show_group(model, g);
    if (count > LISTED_MAX)
        printf("  and %d groups more\n", count - LISTED_MAX);
}

/* Shows what became of the joints of a graph, and why. */
static void show_graph(const kt_scene *scene) {
    int carrying = 0, cut = 0;
    for (int i = 0; i < scene->joint_count; i++) {
        carrying += scene->joints[i].body != NULL;
        cut += scene->joints[i].length > 0;
    }
    if (scene->joint_count > 0)
        printf("\njoints: %d carr%s bodies, %d close%s loops\n", carrying, carrying == 1 ? "ies" : "y", cut,
               cut == 1 ? "s" : "");
    for (int i = 0; i < scene->joint_count && i < LISTED_MAX; i++) {
        const kt_graph_choice *c = &scene->joints[i];
        if (c->body != NULL)
            printf("  %s carries %s%s\n", c->joint, c->body, c->is_reversed ? ", its first end" : "");
        else if (c->length == 0)
            printf("  %s is left out: %s\n", c->joint, kt_graph_reason_words(c->reason));
        else
            printf("  %s closes a loop of %d joints: %s%s\n", c->joint, c->length, kt_graph_reason_words(c->reason),
                   c->loses_start ? "; its given start is not used" : "");
    }
    if (scene->joint_count > LISTED_MAX)
        printf("  and %d more\n", scene->joint_count - LISTED_MAX);
}

static void show_effects(const kt_description *description) {
    int count = description->effect_count;
    if (count > 0)
        puts("\neffects");
    for (int i = 0; i < count && i < LISTED_MAX; i++) {
        const char *name = description->effects[i].name;
        printf("  %s%s%s\n", name != NULL ? name : "", name != NULL ? "  " : "",
               kt_effect_type_name(description->effects[i].type));
    }
    if (count > LISTED_MAX)
        printf("  and %d more\n", count - LISTED_MAX);
}

static void print_vector(const char *before, kt_vec3 x, double scale, const char *after) {
    printf("%s[%g, %g, %g]%s", before, tidy(x.x, scale), tidy(x.y, scale), tidy(x.z, scale), after);
}

/* Shows mass, energies, momentum and gravity for the kinematics in data. */
static void show_masses(const kt_model *model, kt_data *data, const double *q, const double *v) {
    kt_vec3 center;
    const kt_vec3 g = kt_model_gravity(model);
    const double mass = kt_mass_center(model, data, &center), size = kt_vec3_norm(center);
    printf("mass       %g kg, centre at ", mass);
    print_vector("", center, size, " m\n");
    const double weight = tidy(kt_potential_energy(model, data), mass * kt_vec3_norm(g) * size);
    const double kinetic = kt_kinetic_energy(model, data);
    const double elastic = tidy(kt_effect_energy(model, data, 0.0, q, v), kinetic + fabs(weight));
    printf("energy     %g J kinetic, %g J potential", kinetic, weight + elastic);
    if (elastic != 0.0)
        printf(": %g J of gravity, %g J of effects", weight, elastic);
    putchar('\n');
    const kt_wrench momentum = kt_momentum(model, data);
    if (kinetic > 0.0) {
        const kt_vec3 moved = kt_vec3_cross(center, momentum.force);
        const double linear = sqrt(2.0 * mass * kinetic), angular = linear * size + kt_vec3_norm(momentum.moment);
        print_vector("momentum   ", momentum.force, linear, " kg m/s, angular ");
        print_vector("", momentum.moment, angular, " kg m^2/s about the world's origin, ");
        print_vector("", kt_vec3_sub(momentum.moment, moved), angular, " about the centre of mass\n");
    }
    if (kt_vec3_norm(g) > 0.0)
        print_vector("gravity    ", g, 0.0, " m/s^2\n");
    else
        puts("gravity    none");
}

/* Whether a model of each set of switches is compiled. */
static bool has_all_sets(const kt_model *model) {
    const int count = kt_switch_count(model);
    bool all = count <= KT_SWITCH_MAX;
    for (int k = 0; all && k < count; k++)
        all = kt_model_switched(model, kt_switch_bits(model, k)) != NULL;
    return all;
}

/* Shows the number of switched loops and effects, the number of models for their sets, and the memory of these
 * models. */
static void show_sets(const kt_model *model) {
    const int count = kt_switch_count(model);
    if (count > 0 && !has_all_sets(model))
        printf("switched   %d loops and effects; a run makes the models of contact sets; %.3g MB of compiled models\n",
               count, 1e-6 * (double)kt_model_size(model));
    else if (count > 0)
        printf("switched   %d loops and effects: 2^%d = %d models, %.3g MB, compiled before the run begins\n", count,
               count, 1 << count, 1e-6 * (double)kt_model_size(model));
}

/* Shows properties of the assembled initial state, and warnings about it. */
static int show_start(const kt_scene *scene, const kt_model *model) {
    kt_error error = {0};
    kt_data *data = NULL;
    kt_warnings warnings = {.quiet = false};
    const int nq = kt_model_nq(model);
    double *state = kt_given_state(model);
    kt_status status = state == NULL ? kt_reject_memory(&error) : kt_data_create(model, &data, &error);
    int code = KT_EXIT_DONE;
    if (status == KT_OK)
        code = kt_start_assemble(scene, model, data, state, state + nq);
    if (status == KT_OK && code == KT_EXIT_DONE)
        status = kt_kinematics_update(model, data, state, state + nq, NULL, &error);
    if (status == KT_OK && code == KT_EXIT_DONE) {
        show_masses(model, data, state, state + nq);
        (void)kt_penetration_warn(&warnings, scene, model, state);
        kt_warnings_free(&warnings);
    } else if (status != KT_OK) {
        kt_say_error(&error);
    }
    kt_data_free(data);
    free(state);
    return code != KT_EXIT_DONE ? code : kt_exit_code(status);
}

static void show_run(const kt_scene *scene, const kt_model *model, const kt_model *integrated) {
    const kt_run *run = &scene->run;
    const char *reason = scene->contact == KT_CONTACT_STEPS ? NULL : kt_run_method_reason(run, integrated);
    kt_method storage;
    printf("simulate   %g s, %s", run->duration, kt_scene_method_name(scene, integrated, &storage));
    kt_print_steps(run, stdout);
    printf(", %s formulation\n", kt_formulation_name(scene->formulation));
    if (reason != NULL)
        printf("           (%s is %s)\n", kt_run_method(run, integrated, &storage)->name, reason);
    fputs("output     ", stdout);
    if (run->interval > 0.0)
        printf("every %g s: ", run->interval);
    else
        fputs("about 1000 records: ", stdout);
    unsigned record = kt_run_record(run, model);
    const char *comma = "";
    for (unsigned bit = 1; bit != 0 && bit <= record; bit <<= 1)
        if ((record & bit) != 0) {
            printf("%s%s", comma, kt_record_name(bit));
            comma = ", ";
        }
    for (int i = 0; i < run->marker_count; i++)
        printf(", %s.%s", run->markers[i].body != NULL ? run->markers[i].body : "world", run->markers[i].marker);
    putchar('\n');
}

static int show_all(const kt_scene *scene, const kt_model *model, const kt_model *integrated) {
    if (scene->description.name != NULL)
        printf("%s\n\n", kt_show(scene->description.name).text);
    show_sizes(model);
    show_sets(model);
    int code = show_start(scene, model);
    show_run(scene, model, integrated);
    putchar('\n');
    if (kt_tree_draw(model) != 0)
        code = kt_say_no_memory("the tree");
    show_graph(scene);
    show_loops(model);
    show_effects(&scene->description);
    return code;
}

/* Shows the plan of the model that is integrated. */
static int show_plan(const kt_scene *scene, const kt_model *model, const kt_model *integrated, bool json) {
    kt_plan_step steps[KT_PLAN_STEPS_MAX];
    kt_run run = scene->run;
    run.record = kt_run_record(&run, model);
    const int count = kt_plan_steps(integrated, &run, steps);
    if (json)
        return write_plan(model, integrated, steps, count);
    print_plan(model, integrated, steps, count);
    return KT_EXIT_DONE;
}

static int show_scene(const kt_scene *scene, const kt_model *model, const void *user) {
    const info_arguments *arguments = user;
    kt_absolute *absolute = NULL;
    int code = kt_compile_absolute(scene, model, &absolute);
    const kt_model *integrated = kt_integrated_model(model, absolute);
    if (code == KT_EXIT_DONE)
        code =
            arguments->plan ? show_plan(scene, model, integrated, arguments->json) : show_all(scene, model, integrated);
    kt_absolute_free(absolute);
    return code;
}

int kt_command_info(int argc, char **argv) {
    info_arguments arguments = {.plan = false};
    const int code = kt_arguments_read(&kt_usage_info, argc, argv, &arguments, NULL);
    return code >= 0 ? code : kt_finish_output(kt_use_model(argv[1], &arguments.settings, show_scene, &arguments));
}
