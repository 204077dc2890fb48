/* Checks a description.
 *
 * First every name is entered in one table. Then every parent is looked up, and cycles are found. After that the items
 * are checked one by one, so that faults are reported in the order of the items. The cost is linear in the size of the
 * description, but for names of tables, which are compared in pairs: other names are looked up by hash, and suggestions
 * have a fixed budget. No function is recursive.
 *
 * Cycles: from each body a walk goes towards the world, and marks the path with the walk's own number. A walk that
 * meets its own mark has found a cycle; a walk that meets another mark joins a path of an earlier walk. Every body is
 * marked once.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"
#include "effect/effect.h"
#include "expression/lookup.h"
#include "joint/joint.h"
#include "loop/loop.h"
#include "model/relative.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- counts and memory ------------------------------------------------------------------------------------------- */

/* Whether a list can be read. */
static bool check_description_list(kt_checker *checker, const char *field, const void *list, int count) {
    if (count < 0)
        kt_checker_fault(checker, field, -1, "%s: the count is %d; it cannot be negative", field, count);
    else if (count > KT_COUNT_MOST)
        kt_checker_fault(checker, field, -1, "%s: the count is %d; %d is the most", field, count, KT_COUNT_MOST);
    else if (count > 0 && list == NULL)
        kt_checker_fault(checker, field, -1, "%s: the list is NULL, and its count %d", field, count);
    else
        return true;
    return false;
}

static bool check_counts(kt_checker *checker) {
    const kt_description *d = checker->description;
    const bool bodies = check_description_list(checker, "bodies", d->bodies, d->body_count);
    const bool loops = check_description_list(checker, "loops", d->loops, d->loop_count);
    const bool effects = check_description_list(checker, "effects", d->effects, d->effect_count);
    const bool hold = check_description_list(checker, "hold", (const void *)d->hold, d->hold_count);
    const bool states = check_description_list(checker, "states", d->states, d->state_count);
    const bool tables = check_description_list(checker, "tables", d->tables, d->table_count);
    if (!bodies || !loops || !effects || !hold || !states || !tables)
        return false;
    size_t markers = 0;
    for (int i = 0; i < d->body_count; i++)
        markers += (size_t)kt_checker_marker_count(&d->bodies[i]);
    if (markers > KT_COUNT_MOST) {
        kt_checker_fault(checker, "bodies", -1, "bodies have %lu markers in all; %d is the most",
                         (unsigned long)markers, KT_COUNT_MOST);
        return false;
    }
    return true;
}

/* Allocates one block: the table of names, then two numbers for each body. Returns NULL if there is no memory. */
static void *place_memory(kt_checker *checker) {
    const kt_description *d = checker->description;
    const size_t bodies = (size_t)d->body_count;
    size_t names = 2 * bodies + (size_t)d->loop_count + (size_t)d->effect_count;
    names += (size_t)d->state_count;
    for (int i = 0; i < d->body_count; i++)
        names += (size_t)kt_checker_marker_count(&d->bodies[i]);
    const size_t table = kt_names_size(names);
    char *memory = malloc(table + 2 * bodies * sizeof(int));
    if (memory == NULL)
        return NULL;
    kt_names_init(&checker->names, names, memory);
    checker->parent = (int *)(void *)(memory + table);
    checker->mark = checker->parent + bodies;
    checker->effort = 10000000 + 64 * (int64_t)names;
    return memory;
}

static void add_checked_name(kt_checker *checker, int scope, const char *name, int index) {
    if (name != NULL && *name != '\0')
        (void)kt_names_add(&checker->names, scope, name, index); /* of equal names the first is kept */
}

/* Enters all names. The scope of a marker's name is the index of its body, so that each body has markers of its own. */
static void add_checked_names(kt_checker *checker) {
    const kt_description *d = checker->description;
    for (int i = 0; i < d->body_count; i++) {
        add_checked_name(checker, KT_SCOPE_BODY, d->bodies[i].name, i);
        add_checked_name(checker, KT_NAMES_OF_JOINTS, d->bodies[i].joint.name, i);
        for (int k = 0; k < kt_checker_marker_count(&d->bodies[i]); k++)
            add_checked_name(checker, i, d->bodies[i].markers[k].name, k);
    }
    for (int i = 0; i < d->loop_count; i++)
        add_checked_name(checker, KT_SCOPE_LOOP, d->loops[i].name, i);
    for (int i = 0; i < d->effect_count; i++)
        add_checked_name(checker, KT_SCOPE_EFFECT, d->effects[i].name, i);
    for (int i = 0; i < d->state_count; i++)
        add_checked_name(checker, KT_SCOPE_STATE, d->states[i].name, i);
}

/* ---- the tree ---------------------------------------------------------------------------------------------------- */

/* Looks up the parents, without reporting parents that do not exist. */
static void find_parents(kt_checker *checker) {
    const kt_description *d = checker->description;
    for (int i = 0; i < d->body_count; i++) {
        const char *name = d->bodies[i].parent;
        int parent = KT_BODY_WORLD;
        if (name != NULL && strcmp(name, "world") != 0)
            parent = kt_names_find(&checker->names, KT_SCOPE_BODY, name);
        else
            name = NULL;
        checker->parent[i] = name != NULL && parent < 0 ? KT_BODY_UNKNOWN : parent;
    }
}

/* Sets mark = 1 at the first body of each cycle, and a smaller value elsewhere. */
static void find_cycles(kt_checker *checker) {
    const int count = checker->description->body_count;
    const int *parent = checker->parent;
    int *mark = checker->mark;
    /* Walk i leaves the mark -1 - i; the first body of a cycle gets 1 at once, which no walk uses. */
    memset(mark, 0, (size_t)count * sizeof *mark);
    for (int i = 0; i < count; i++) {
        int body = i;
        while (body >= 0 && mark[body] == 0) {
            mark[body] = -1 - i;
            body = parent[body];
        }
        if (body < 0 || mark[body] != -1 - i)
            continue;
        int first = body;
        for (int k = parent[body]; k != body; k = parent[k])
            first = k < first ? k : first;
        mark[first] = 1;
    }
}

/* Reports the cycle of parents that begins at a body, with the names of at most SHOWN bodies. */
static void report_cycle(kt_checker *checker, int first) {
    enum { SHOWN = 4 };
    const kt_body *bodies = checker->description->bodies;
    char names[(SHOWN + 2) * (KT_NAME_TEXT_SIZE + 4)];
    size_t end = 0;
    int length = 0;
    for (int k = first; length == 0 || k != first; k = checker->parent[k])
        if (length++ < SHOWN)
            end += (size_t)snprintf(names + end, sizeof names - end, "%s -> ", kt_name_quote(bodies[k].name).text);
    if (length == 1)
        kt_checker_fault(checker, "parent", -1, "parent %s is the body itself; name another body, or 'world'",
                         kt_name_quote(bodies[first].name).text);
    else
        kt_checker_fault(checker, "parent", -1,
                         "the parents form a cycle of %d bodies, %s%s%s; give one of them another parent", length,
                         names, length > SHOWN ? "... -> " : "", kt_name_quote(bodies[first].name).text);
}

/* ---- items, in their order --------------------------------------------------------------------------------------- */

static void check_world(kt_checker *checker) {
    checker->item = KT_ITEM_SCENE;
    checker->index = 0;
    kt_checker_vector(checker, "gravity", -1, "", checker->description->gravity);
    if (!(checker->description->tolerance >= 0.0 && checker->description->tolerance <= 1e-3))
        kt_checker_fault(checker, "initial.tolerance", -1, "tolerance is %g; give 0 to 1e-3",
                         checker->description->tolerance);
    if ((unsigned)checker->description->inertia_check >= KT_INERTIA_LIMIT_COUNT)
        kt_checker_fault(checker, "inertia_check", -1,
                         "inertia_check is %d, and there is no such value; take one of kt_inertia_limit",
                         (int)checker->description->inertia_check);
}

static void check_bodies(kt_checker *checker) {
    const kt_description *d = checker->description;
    checker->item = KT_ITEM_BODY;
    for (int i = 0; i < d->body_count && !kt_checker_is_done(checker); i++) {
        const kt_body *body = &d->bodies[i];
        checker->index = i;
        kt_checker_name(checker, KT_SCOPE_BODY, "bodies", body->name, false);
        if (checker->parent[i] == KT_BODY_UNKNOWN)
            (void)kt_checker_body(checker, "parent", -1, "parent", body->parent);
        if (checker->mark[i] == 1) /* the first body of a cycle (find_cycles) */
            report_cycle(checker, i);
        kt_checker_body_rules(checker, body);
    }
}

static void check_custom_loop(kt_checker *checker, const kt_loop *loop) {
    if (loop->equations == NULL)
        kt_checker_fault(checker, "equations", -1, "equations is missing; give the callback that writes them");
    if (loop->equation_count < 1 || loop->equation_count > 6)
        kt_checker_fault(checker, "equation_count", -1, "equation_count is %d; give 1 to 6", loop->equation_count);
    if ((unsigned)loop->given > KT_LOOP_GIVES_ALL)
        kt_checker_fault(checker, "given", -1, "given is %d; take one of kt_loop_given", (int)loop->given);
    else if (!loop->holonomic && loop->given == KT_LOOP_GIVES_RESIDUAL)
        kt_checker_fault(checker, "given", -1,
                         "a loop that is not holonomic has no residuals; give its rows (KT_LOOP_GIVES_ROWS or _ALL)");
}

static void check_switching(kt_checker *checker, kt_switching switching) {
    if (switching == KT_ALWAYS_ON)
        return;
    if ((unsigned)switching >= KT_SWITCHING_COUNT)
        kt_checker_fault(checker, "switching", -1, "switching is %d; take one of kt_switching", (int)switching);
}

/* A loop without equations is there for effects in its coordinates. */
static void check_never_on(kt_checker *checker, const kt_loop *loop) {
    if (loop->switching == KT_NEVER_ON && (kt_relative_count(loop->type) == 0 || loop->slack))
        kt_checker_fault(checker, "switched", -1,
                         "a loop that is never on only measures coordinates, and this one has none; leave it out, or "
                         "take 'off'");
}

/* Checks a loop that bounds one side. */
static void check_side(kt_checker *checker, const kt_loop *loop) {
    const bool may = loop->type == KT_LOOP_DISTANCE || loop->type == KT_LOOP_INPLANE || loop->type == KT_LOOP_SURFACE ||
                     loop->type == KT_LOOP_COUPLING || (loop->type == KT_LOOP_SPAN && loop->side == KT_SIDE_NONE);
    if (loop->side == KT_SIDE_NONE &&
        !(loop->slack && (loop->type == KT_LOOP_DISTANCE || loop->type == KT_LOOP_SPAN))) {
        if (loop->restitution != 0.0 || loop->poisson)
            kt_checker_fault(checker, loop->poisson ? "poisson" : "restitution", -1,
                             "only a loop that bounds one side bounces; give `side` or `slack`, or leave this key out");
        return;
    }
    if ((unsigned)loop->side >= KT_SIDE_COUNT)
        kt_checker_fault(checker, "side", -1, "side is %d; take one of kt_side", (int)loop->side);
    else if (!may)
        kt_checker_fault(checker, "side", -1, "no loop but distance, inplane, surface and coupling bounds one side");
    else if (!(loop->restitution >= 0.0 && loop->restitution <= 1.0))
        kt_checker_fault(checker, "restitution", -1, "restitution is %g; it must be 0 to 1", loop->restitution);
    else if (!(loop->rest_velocity >= 0.0 && isfinite(loop->rest_velocity)))
        kt_checker_fault(checker, "rest_velocity", -1, "rest_velocity is %g; it must be 0 or more",
                         loop->rest_velocity);
}

static void check_loop(kt_checker *checker, const kt_loop *loop) {
    const kt_descriptor *descriptor = kt_loop_descriptor(loop->type);
    const kt_loop standard = kt_loop_default();
    kt_checker_name(checker, KT_SCOPE_LOOP, "loops", loop->name, false);
    if (descriptor == NULL)
        kt_checker_fault(checker, "type", -1,
                         "type is %d, and there is no loop of that number; take one of kt_loop_type", (int)loop->type);
    else
        kt_checker_keys(checker, descriptor, loop, &standard);
    if (loop->type == KT_LOOP_CUSTOM)
        check_custom_loop(checker, loop);
    if (loop->coordinates && kt_loop_joint_type(loop->type) == KT_JOINT_FIXED)
        kt_checker_fault(checker, "coordinates", -1,
                         "a loop of this type stands for no joint with coordinates; leave the key out");
    check_switching(checker, loop->switching);
    check_never_on(checker, loop);
    check_side(checker, loop);
}

/* A load is the force of a loop between two ends. */
static void check_load(kt_checker *checker, const kt_effect *effect) {
    const int loop = effect->load != NULL ? kt_names_find(&checker->names, KT_SCOPE_LOOP, effect->load) : -1;
    const kt_descriptor *descriptor = loop >= 0 ? kt_loop_descriptor(checker->description->loops[loop].type) : NULL;
    if (descriptor != NULL && kt_descriptor_end_count(descriptor) != 2)
        kt_checker_fault(
            checker, "load", -1,
            "loop %s is %s, which exerts no force at a point; name a loop between two ends, such as a gear",
            kt_name_quote(effect->load).text, descriptor->name);
}

static void check_one_effect(kt_checker *checker, const kt_effect *effect) {
    kt_checker_name(checker, KT_SCOPE_EFFECT, "effects", effect->name, true);
    if (effect->type != KT_EFFECT_CUSTOM && kt_effect_descriptor(effect->type) == NULL)
        kt_checker_fault(checker, "type", -1,
                         "type is %d, and there is no effect of that number; take one of kt_effect_type",
                         (int)effect->type);
    else
        kt_effect_check(checker, effect);
    check_load(checker, effect);
    check_switching(checker, effect->switching);
    if (effect->switching == KT_NEVER_ON)
        kt_checker_fault(checker, "switched", -1, "an effect that is never on has no effect; leave it out");
}

/* The names of held joints. A new stamp marks bodies that are listed, so that the marks need not be cleared. */
static void check_hold(kt_checker *checker) {
    const kt_description *d = checker->description;
    const int stamp = ++checker->stamp;
    checker->item = KT_ITEM_HOLD;
    for (int i = 0; i < d->hold_count && !kt_checker_is_done(checker); i++) {
        checker->index = i;
        const int body = kt_checker_joint(checker, "hold", -1, d->hold[i]);
        if (body >= 0 && checker->mark[body] == stamp)
            kt_checker_fault(checker, "hold", -1, "joint %s is listed twice; name it once",
                             kt_name_quote(d->hold[i]).text);
        if (body >= 0)
            checker->mark[body] = stamp;
    }
}

static void check_states(kt_checker *checker) {
    const kt_description *d = checker->description;
    checker->item = KT_ITEM_STATE;
    for (checker->index = 0; checker->index < d->state_count && !kt_checker_is_done(checker); checker->index++)
        kt_checker_state(checker, &d->states[checker->index]);
}

static void check_tables(kt_checker *checker) {
    const kt_description *d = checker->description;
    checker->item = KT_ITEM_SCENE;
    for (int k = 0; k < d->table_count && !kt_checker_is_done(checker); k++) {
        const kt_lookup *table = &d->tables[k];
        char fault[KT_MESSAGE_SIZE];
        if (table->name == NULL || !kt_name_is_valid(table->name) || strchr(table->name, '-') != NULL)
            kt_checker_fault(checker, "tables", k,
                             "table %s has no name that formulas can call; take letters, digits and _",
                             kt_name_quote(table->name != NULL ? table->name : "").text);
        else if (!kt_lookup_check(table, fault, sizeof fault))
            kt_checker_fault(checker, "tables", k, "table '%.60s': %s", table->name, fault);
        for (int i = 0; i < k && table->name != NULL && d->tables[i].name != NULL; i++)
            if (strcmp(d->tables[i].name, table->name) == 0)
                kt_checker_fault(checker, "tables", k, "two tables have the name '%.60s'; rename one", table->name);
    }
}

static void check_all(kt_checker *checker) {
    const kt_description *d = checker->description;
    check_tables(checker);
    add_checked_names(checker);
    find_parents(checker);
    find_cycles(checker);
    check_world(checker);
    check_bodies(checker);
    checker->stamp = 1; /* the largest mark that the cycles leave */
    checker->item = KT_ITEM_LOOP;
    for (checker->index = 0; checker->index < d->loop_count && !kt_checker_is_done(checker); checker->index++)
        check_loop(checker, &d->loops[checker->index]);
    checker->item = KT_ITEM_EFFECT;
    for (checker->index = 0; checker->index < d->effect_count && !kt_checker_is_done(checker); checker->index++)
        check_one_effect(checker, &d->effects[checker->index]);
    check_hold(checker);
    check_states(checker);
}

kt_status kt_description_check(const kt_description *description, kt_report *report, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, description))
        return KT_ERROR_ARGUMENT;
    kt_checker checker = kt_checker_make(description, report, user);
    if (check_counts(&checker)) {
        void *memory = place_memory(&checker);
        if (memory == NULL)
            return kt_error_set(error, KT_ERROR_MEMORY, "kt_description_check",
                                "no memory to check %d bodies; use a smaller model", description->body_count);
        check_all(&checker);
        free(memory);
    }
    return kt_checker_result(&checker, error);
}
