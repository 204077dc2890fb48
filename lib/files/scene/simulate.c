/* The sections `simulate` and `output`: the settings of a run, and its records. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "integrator/integrator.h"
#include "model/describe.h"
#include "scene/scene_event.h"
#include "scene/scene_part.h"
#include "scene/vary.h"

#include <math.h>
#include <string.h>

static const char *const formulation_names[] = {KT_FORMULATION_LIST(KT_LISTED_NAME)};
static const char *const reduction_names[] = {KT_REDUCTION_LIST(KT_LISTED_NAME)};
static const char *const metric_names[] = {KT_METRIC_LIST(KT_LISTED_NAME)};
static const char *const plan_names[] = {KT_PLAN_LIST(KT_LISTED_NAME)};
static const char *const scheme_names[] = {KT_CONTACT_SCHEME_LIST(KT_LISTED_NAME)};
static const kt_choice formulations = {"simulate.formulation", formulation_names, KT_COUNT_OF(formulation_names), 0,
                                       NULL};
static const kt_choice reductions = {"simulate.reduction", reduction_names, KT_COUNT_OF(reduction_names), 0, NULL};
static const kt_choice metrics = {"simulate.metric", metric_names, KT_COUNT_OF(metric_names), 0, NULL};
static const kt_choice plans = {"simulate.plan", plan_names, KT_COUNT_OF(plan_names), 0, NULL};
static const kt_choice schemes = {"simulate.contact", scheme_names, KT_COUNT_OF(scheme_names), 0, NULL};

#define RECORD_NAME(id, bit, name) #name,
#define RECORD_BIT(id, bit, name) bit,
static const char *const record_names[] = {KT_RECORD_LIST(RECORD_NAME)};
static const unsigned record_bits[] = {KT_RECORD_LIST(RECORD_BIT)};
static const kt_choice records = {"output.record", record_names, KT_COUNT_OF(record_names), 0, NULL};

/* ---- the method -------------------------------------------------------------------------------------------------- */

static bool read_integrator(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const char **integrator = kt_field_in(object, field);
    char all[256];
    (void)kt_method_names(false, all, sizeof all);
    if (node->kind != KT_NODE_TEXT || node->count == 0)
        return kt_fault_expected(r, scope, node, "the name of a method");
    const char *name = node->of.text;
    const kt_method *method = kt_method_find(name);
    if (method != NULL) {
        *integrator = method->name;
        return true;
    }
    kt_nearest nearest = kt_nearest_make(name, &r->effort);
    for (int i = 0; i < kt_method_count(); i++)
        if (!kt_nearest_try(&nearest, kt_method_at(i)->name))
            break;
    if (nearest.best != NULL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "there is no method %s; did you mean '%s'? There are %s",
                           kt_name_quote(name).text, nearest.best, all);
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "there is no method %s; there are %s", kt_name_quote(name).text,
                       all);
}

static const kt_kind kind_integrator = {.read = read_integrator, .write = kt_text_write, .size = sizeof(char *)};

/* ---- tolerances -------------------------------------------------------------------------------------------------- */

static const kt_field tolerance_fields[] = {
    {.key = "relative", .kind = &kt_kind_number, .offset = offsetof(kt_run, relative), .flags = KT_FIELD_REQUIRED},
    {.key = "absolute", .kind = &kt_kind_number, .offset = offsetof(kt_run, absolute), .flags = KT_FIELD_REQUIRED},
};
static const kt_table tolerance_table = {.fields = tolerance_fields, .count = 2, .flow = true};

static bool read_tolerance(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_run *run = kt_field_in(object, field);
    if (node->kind == KT_NODE_TEXT) {
        double value;
        if (!kt_read_number(r, scope, node, KT_QUANTITY_POSITIVE, &value))
            return false;
        run->relative = run->absolute = value;
        if (kt_number_follows(r, node, true, &run->relative))
            kt_number_follows_too(r, &run->absolute);
        return true;
    }
    if (node->kind == KT_NODE_LIST)
        return kt_fault_expected(r, scope, node, "a number or {relative: ..., absolute: ...}");
    (void)kt_table_read(r, scope, node, &tolerance_table, run);
    if (kt_node_is_faulty(node))
        return false;
    if (!(run->relative >= 0.0 && run->absolute >= 0.0 && run->relative + run->absolute > 0.0))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "tolerances cannot be negative, and one must be greater than 0");
    return true;
}

static void write_tolerance(kt_emitter *e, const kt_member *m) {
    const kt_run *run = kt_member_value(m);
    if (kt_same_bits(&run->relative, &run->absolute, sizeof run->relative))
        kt_emit_number(e, run->relative);
    else
        kt_table_write(e, &tolerance_table, run, kt_member_standard(m));
}

/* A run with a fixed step has no tolerance. */
static bool same_tolerance(const kt_member *m) {
    const kt_run *run = kt_member_value(m), *rest = kt_member_standard(m);
    return run->step > 0.0 || (kt_same_bits(&run->relative, &rest->relative, sizeof run->relative) &&
                               kt_same_bits(&run->absolute, &rest->absolute, sizeof run->absolute));
}

static const kt_kind kind_tolerance = {.read = read_tolerance, .write = write_tolerance, .same = same_tolerance};

/* ---- simulate ---------------------------------------------------------------------------------------------------- */

static bool read_duration(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    double value;
    if (!kt_read_number(r, scope, node, KT_QUANTITY_NUMBER, &value))
        return false;
    if (value < 0.0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%.40s' cannot be negative", node->of.text);
    memcpy(kt_field_in(object, field), &value, sizeof value);
    (void)kt_number_follows(r, node, true, kt_field_in(object, field)); /* 0 is read anew */
    return true;
}

static const kt_kind kind_duration = {.read = read_duration, .write = kt_kind_numbers_write, .size = sizeof(double)};

#define AT(member) .offset = offsetof(kt_scene, member)
static const kt_field simulate_fields[] = {
    {.key = "duration", .kind = &kind_duration, AT(run.duration)},
    {.key = "integrator", .kind = &kind_integrator, AT(run.integrator)},
    {.key = "step", .kind = &kt_kind_positive, AT(run.step)},
    {.key = "tolerance", .kind = &kind_tolerance, AT(run)},
    {.key = "max_step", .kind = &kt_kind_positive, AT(run.max_step)},
    {.key = "rho", .kind = &kt_kind_number, AT(run.rho)},
    {.key = "formulation", .kind = &kt_kind_choice, AT(formulation), .detail = &formulations},
    {.key = "reduction", .kind = &kt_kind_choice, AT(reduction), .detail = &reductions},
    {.key = "metric", .kind = &kt_kind_choice, AT(run.metric), .detail = &metrics},
    {.key = "plan", .kind = &kt_kind_choice, AT(run.plan), .detail = &plans},
    {.key = "contact", .kind = &kt_kind_choice, AT(contact), .detail = &schemes},
    {.key = "until", .kind = &kt_kind_until, AT(until.when)},
};
static const kt_table simulate_table = {.fields = simulate_fields, .count = KT_COUNT_OF(simulate_fields)};

/* A method without an error estimate needs a step and cannot use a tolerance. */
static void check_scene_method(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_run *run) {
    kt_node *step = kt_node_find(node, "step"), *tolerance = kt_node_find(node, "tolerance");
    kt_node *integrator = kt_node_find(node, "integrator");
    const kt_method *method = run->integrator != NULL ? kt_method_find(run->integrator) : NULL;
    kt_node *rho = kt_node_find(node, "rho");
    if (rho != NULL && (method == NULL || !(method->rho > 0.0)) && !kt_node_is_faulty(integrator))
        kt_fault_at(r, KT_ERROR_SCENE, scope, rho,
                    "'rho' is for integrator two-step, and this is %s; leave it out, or take two-step",
                    method != NULL ? method->name : "the default");
    if (step != NULL && tolerance != NULL) {
        kt_fault_at(r, KT_ERROR_SCENE, scope, tolerance,
                    "'step' is for a fixed step and 'tolerance' for an adaptive one; leave one of them out");
        return;
    }
    kt_node *most = kt_node_find(node, "max_step");
    if (step != NULL && most != NULL) {
        kt_fault_at(r, KT_ERROR_SCENE, scope, most,
                    "'step' is for a fixed step and 'max_step' bounds adaptive ones; leave one of them out");
        return;
    }
    if (method == NULL || kt_method_is_adaptive(method) || step != NULL || kt_node_is_faulty(integrator) ||
        kt_node_has_stray(node) /* the step, maybe */ || (r->scene->gives_step && tolerance == NULL))
        return;
    char adaptive[256];
    (void)kt_method_names(true, adaptive, sizeof adaptive);
    if (tolerance != NULL)
        kt_fault_at(r, KT_ERROR_SCENE, scope, tolerance,
                    "%s has a fixed step and no tolerance; give 'step' in its place, or choose an adaptive method: %s",
                    method->name, adaptive);
    else
        kt_fault_at(r, KT_ERROR_SCENE, scope, integrator,
                    "%s has a fixed step; give 'step' as well, or choose an adaptive method: %s", method->name,
                    adaptive);
}

/* Hard stops, contacts, slack ropes and friction that sticks are loops while they are closed. */
static bool may_have_loops(const kt_reader *r) {
    const kt_description *d = r->scene->description;
    bool found = d == NULL || kt_node_find(r->root, "loops") != NULL || d->loop_count > 0;
    for (int i = 0; !found && i < d->effect_count; i++)
        found = kt_effect_is_hard(&d->effects[i]) || kt_effect_sticks(&d->effects[i]);
    return found;
}

/* Time stepping over contacts has a fixed step and no other method. Returns whether the scene takes it. */
static bool check_scheme(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_scene *scene) {
    static const char *const others[] = {"integrator", "tolerance", "max_step", "rho", "formulation"};
    kt_node *contact = kt_node_find(node, "contact");
    if (contact == NULL || scene->contact != KT_CONTACT_STEPS)
        return false;
    for (size_t i = 0; i < KT_COUNT_OF(others); i++) {
        kt_node *other = kt_node_find(node, others[i]);
        if (other != NULL)
            kt_fault_at(r, KT_ERROR_SCENE, scope, other,
                        "'contact: steps' is a method of its own with a fixed step, in tree coordinates; leave '%s' "
                        "or 'contact' out",
                        others[i]);
    }
    if (kt_node_find(node, "step") == NULL && !kt_node_has_stray(node) && !r->scene->gives_step)
        kt_fault_at(r, KT_ERROR_SCENE, scope, contact, "'contact: steps' has a fixed step; give 'step' as well");
    if (!may_have_loops(r))
        kt_fault_at(r, KT_ERROR_SCENE, scope, contact,
                    "the scene has no hard contact, stop or slack rope, and no friction that sticks; leave 'contact' "
                    "out");
    return true;
}

/* Reports the limits that no run could satisfy, one after the other, each at its key; the interval is not among
 * them. */
static void check_run_limits(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_run *run) {
    const kt_run standard = kt_run_default();
    kt_run left = *run;
    kt_error error = {0};
    left.interval = 0.0;
    for (bool right = !kt_node_is_faulty(node); right && kt_run_check(&left, &error) != KT_OK;) {
        kt_node *given = kt_node_find(node, error.where);
        const kt_scope here = {.outer = scope, .key = error.where};
        kt_fault_at(r, KT_ERROR_SCENE, &here, given != NULL ? given : node, "%s", error.message);
        if (strcmp(error.where, "duration") == 0) {
            left.duration = standard.duration;
        } else if (strcmp(error.where, "rho") == 0) {
            left.rho = standard.rho;
        } else {
            left.step = standard.step;
            left.relative = standard.relative;
            left.absolute = standard.absolute;
        }
    }
}

static bool read_simulate(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_scene *scene = kt_field_in(object, field);
    if (!kt_table_read(r, scope, node, &simulate_table, scene))
        return false;
    if (!check_scheme(r, scope, node, scene))
        check_scene_method(r, scope, node, &scene->run);
    check_run_limits(r, scope, node, &scene->run);
    return true;
}

const kt_kind kt_kind_simulate = {
    .read = read_simulate, .write = kt_map_write, .same = kt_map_same, .detail = &simulate_table};

/* ---- output ------------------------------------------------------------------------------------------------------ */

static bool read_record_list(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    unsigned *out = kt_field_in(object, field), bits = 0;
    if (node->kind != KT_NODE_LIST || node->count == 0)
        return kt_fault_expected(r, scope, node, "a list of quantities, such as [position, energy]");
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++) {
        int record = kt_choice_read(r, &here, item, &records);
        if (record < 0)
            continue;
        if ((bits & record_bits[record]) != 0)
            kt_fault_at(r, KT_ERROR_SCENE, &here, item, "'%s' is there already; remove one", record_names[record]);
        if (record_bits[record] == KT_RECORD_SINGULAR_VALUE && !may_have_loops(r))
            kt_fault_at(r, KT_ERROR_SCENE, &here, item,
                        "the scene has no loops, whose equations could become dependent; remove 'singular value'");
        bits |= record_bits[record];
    }
    *out = bits;
    return true;
}

static void write_record(kt_emitter *e, const kt_member *m) {
    const unsigned *bits = kt_member_value(m);
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < records.count; i++)
        if ((*bits & record_bits[i]) != 0)
            kt_emit_word(e, record_names[i]);
    kt_emit_end(e);
}

static const kt_kind kind_record = {.read = read_record_list, .write = write_record, .size = sizeof(unsigned)};

/* Reports a marker that does not exist, and suggests the one that was probably meant. */
static bool report_marker(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_end *end, int body) {
    const kt_description *d = r->scene->description;
    kt_nearest nearest = kt_nearest_make(body < 0 ? end->body : end->marker, &r->effort);
    bool more = d != NULL;
    if (body < 0)
        for (int i = 0; more && i < d->body_count; i++)
            more = kt_nearest_try(&nearest, d->bodies[i].name);
    else
        for (int i = 0; more && i < d->bodies[body].marker_count; i++)
            more = kt_nearest_try(&nearest, d->bodies[body].markers[i].name);
    kt_phrase mend = {.length = 0};
    if (nearest.best != NULL)
        kt_phrase_add(&mend, "did you mean '%s'?", nearest.best);
    else
        kt_phrase_add(&mend, "name a %s of the scene", body < 0 ? "body" : "marker");
    if (body < 0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "body %s does not exist; %s", kt_name_quote(end->body).text,
                           mend.text);
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "body %s has no marker %s; %s", kt_name_quote(end->body).text,
                       kt_name_quote(end->marker).text, mend.text);
}

static bool read_traced_marker(kt_reader *r, const kt_scope *scope, kt_node *node, kt_names *names, int index,
                               kt_marker_pair *out) {
    kt_end end = kt_end_default();
    if (node->kind != KT_NODE_TEXT)
        return kt_fault_expected(r, scope, node, "BODY.MARKER");
    if (!kt_read_end(r, scope, node, &end))
        return false;
    if (end.body == NULL || end.marker == NULL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected BODY.MARKER, found %s; name a marker of a body",
                           kt_name_quote(node->of.text).text);
    int body = kt_find_body(r, end.body);
    if (body < 0 && !kt_names_are_known(r))
        return false;
    if (body < 0 || kt_find_marker(r, body, end.marker) < 0)
        return body >= 0 && kt_body_is_hidden(r, body) ? false : report_marker(r, scope, node, &end, body);
    if (kt_names_add(names, 0, node->of.text, index) >= 0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is there already; remove one",
                           kt_name_quote(node->of.text).text);
    *out = (kt_marker_pair){end.body, end.marker};
    return true;
}

static bool read_traced_markers(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                                void *object) {
    (void)field;
    kt_run *run = &((kt_scene *)object)->run;
    kt_node **nodes = NULL;
    int count = 0;
    if (!kt_list_nodes(r, scope, node, "a list of markers [BODY.MARKER, ...]", &nodes, &count))
        return false;
    kt_marker_pair *markers = kt_pool_take(&r->keep, (size_t)count, sizeof *markers);
    void *memory = kt_pool_take(&r->scratch, 1, kt_names_size((size_t)count));
    if (markers == NULL || memory == NULL)
        return kt_reader_out_of_memory(r);
    kt_names names;
    kt_names_init(&names, (size_t)count, memory);
    for (int i = 0; i < count; i++) {
        const kt_scope here = {.outer = scope, .index = i};
        (void)read_traced_marker(r, &here, nodes[i], &names, i, &markers[i]);
    }
    run->markers = markers;
    run->marker_count = count;
    return true;
}

static void write_traced_markers(kt_emitter *e, const kt_member *m) {
    const kt_run *run = &((const kt_scene *)m->object)->run;
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < run->marker_count; i++)
        kt_emit_pair(e, run->markers[i].body, run->markers[i].marker);
    kt_emit_end(e);
}

static const kt_kind kind_markers = {.read = read_traced_markers, .write = write_traced_markers, .size = sizeof(int)};

#undef AT
#define AT(member) .offset = offsetof(kt_scene, run.member)
static const kt_field output_fields[] = {
    {.key = "interval", .kind = &kt_kind_positive, AT(interval)},
    {.key = "record", .kind = &kind_record, AT(record)},
    {.key = "markers", .kind = &kind_markers, AT(marker_count)},
    {.key = "columns", .kind = &kt_kind_columns, .offset = offsetof(kt_scene, column_count)},
};
const kt_table kt_output_table = {.fields = output_fields, .count = KT_COUNT_OF(output_fields)};

/* ---- the check of a run that a caller made -----------------------------------------------------------------------
 *
 * A run that is written must be readable again without faults. */

static bool is_positive(double value) { return isfinite(value) && value > 0.0; }

static kt_status reject_run_value(kt_error *error, const char *where, const char *message) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, where, "%s", message);
}

static kt_status check_run_method(const kt_run *run, kt_error *error) {
    const kt_method *method = run->integrator == NULL ? NULL : kt_method_find(run->integrator);
    if (method == NULL && run->integrator != NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "simulate.integrator", "there is no method %s",
                            kt_name_quote(run->integrator).text);
    if (!kt_is_not_negative(run->step))
        return reject_run_value(error, "simulate.step", "the step must be finite and not negative");
    if (run->step > 0.0)
        return KT_OK;
    if (method != NULL && !kt_method_is_adaptive(method))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "simulate.step", "%s has a fixed step; give it", method->name);
    if (!kt_is_not_negative(run->relative) || !kt_is_not_negative(run->absolute) ||
        !is_positive(run->relative + run->absolute))
        return reject_run_value(error, "simulate.tolerance",
                                "tolerances must be finite, not negative, and one of them above 0");
    return KT_OK;
}

static kt_status check_traced_marker(const kt_names *names, const kt_run *run, int i, kt_error *error) {
    const char *body = run->markers[i].body, *marker = run->markers[i].marker;
    if (body == NULL || marker == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "output.markers", "[%d] has no body or no marker", i);
    const int index = kt_names_find(names, 0, body);
    if (index < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "output.markers", "[%d]: body %s does not exist", i,
                            kt_name_quote(body).text);
    if (kt_names_find(names, index + 1, marker) < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "output.markers", "[%d]: body %s has no marker %s", i,
                            kt_name_quote(body).text, kt_name_quote(marker).text);
    return KT_OK;
}

static kt_status check_traced_markers(const kt_run *run, const kt_description *description, kt_error *error) {
    if (run->marker_count < 0 || (run->marker_count > 0 && run->markers == NULL))
        return reject_run_value(error, "output.markers", "the list is NULL, or its count negative");
    if (run->marker_count == 0)
        return KT_OK;
    kt_pool pool = {NULL, 0};
    kt_names names;
    kt_status status = KT_OK;
    if (!kt_index_bodies(&pool, &names, description->bodies, description->body_count))
        status = kt_error_set(error, KT_ERROR_MEMORY, "output.markers", "there is not enough memory to look them up");
    for (int i = 0; status == KT_OK && i < run->marker_count; i++)
        status = check_traced_marker(&names, run, i, error);
    kt_pool_free(pool.chunks);
    return status;
}

kt_status kt_check_run(const kt_run *run, const kt_description *description, kt_error *error) {
#define RECORD_OR(id, bit, name) | bit
    static const unsigned known = 0U KT_RECORD_LIST(RECORD_OR);
#undef RECORD_OR
    if (!kt_is_not_negative(run->duration))
        return reject_run_value(error, "simulate.duration", "the duration must be finite and not negative");
    if (!kt_is_not_negative(run->interval))
        return reject_run_value(error, "output.interval", "the interval must be finite and not negative");
    if ((run->record & ~known) != 0)
        return reject_run_value(error, "output.record", "a record bit has no meaning; use those of KT_RECORD_LIST");
    kt_status status = check_run_method(run, error);
    if (status == KT_OK)
        status = kt_run_check(run, error);
    return status == KT_OK ? check_traced_markers(run, description, error) : status;
}
