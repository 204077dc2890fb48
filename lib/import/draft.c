/* The scene that a reader of robots builds: bodies, loops and effects, each with its element of the file. */
#include "import/robot.h"

#include <string.h>

static void *add(kt_draft *d, kt_list *items, kt_list *elements, size_t size, const kt_element *e) {
    void *item = kt_list_add(d->r, &d->r->keep, items, size);
    const kt_element **from = kt_list_add(d->r, &d->r->scratch, elements, sizeof *from);
    if (item == NULL || from == NULL)
        return NULL;
    *from = e;
    return item;
}

kt_body *kt_draft_body(kt_draft *d, const kt_element *e) {
    kt_body *body = add(d, &d->bodies, &d->body_elements, sizeof *body, e);
    if (body != NULL)
        *body = kt_body_default();
    return body;
}

kt_loop *kt_draft_loop(kt_draft *d, const kt_element *e, kt_loop_type type, const char *name) {
    kt_loop *loop = add(d, &d->loops, &d->loop_elements, sizeof *loop, e);
    if (loop == NULL)
        return NULL;
    *loop = kt_loop_default();
    loop->type = type;
    loop->name = kt_namer_make(&d->loop_names, name);
    return loop;
}

kt_effect *kt_draft_effect(kt_draft *d, const kt_element *e, kt_effect_type type) {
    kt_effect *effect = add(d, &d->effects, &d->effect_elements, sizeof *effect, e);
    if (effect == NULL)
        return NULL;
    *effect = kt_effect_default();
    effect->type = type;
    return effect;
}

int kt_terms_merge(kt_term *terms, int count) {
    int kept = 0;
    for (int i = 0; i < count; i++) {
        int same = 0;
        while (same < kept && strcmp(terms[same].joint, terms[i].joint) != 0)
            same++;
        if (same < kept)
            terms[same].coefficient += terms[i].coefficient;
        else
            terms[kept++] = terms[i];
    }
    return kept;
}

/* The faults that the description's own check finds, at the element that each comes from. */
static void take_fault(void *user, const kt_place *place, const kt_error *error) {
    const kt_draft *d = user;
    const kt_list *lists[] = {
        [KT_ITEM_BODY] = &d->body_elements, [KT_ITEM_LOOP] = &d->loop_elements, [KT_ITEM_EFFECT] = &d->effect_elements};
    const bool is_listed = place->item >= KT_ITEM_BODY && place->item <= KT_ITEM_EFFECT;
    const kt_element *e = is_listed ? ((const kt_element *const *)lists[place->item]->items)[place->index] : d->root;
    const kt_element *at = e->included != NULL ? e->included : e;
    (void)kt_fault_put(d->r, error->code, at->line, at->column, "%s%s%s", error->where,
                       error->where[0] != '\0' ? ": " : "", error->message);
}

bool kt_draft_is_wrong(const kt_draft *d) { return d->r->out_of_memory || d->r->fault_count > 0; }

static void fill_description(kt_draft *d, const char *name, kt_description *to) {
    to->bodies = d->bodies.items;
    to->body_count = d->bodies.count;
    to->loops = d->loops.items;
    to->loop_count = d->loops.count;
    to->effects = d->effects.items;
    to->effect_count = d->effects.count;
    to->name = name != NULL ? kt_pool_text(&d->r->keep, name, strlen(name)) : NULL;
    if (name != NULL && to->name == NULL)
        (void)kt_reader_out_of_memory(d->r);
}

bool kt_draft_finish(kt_draft *d, const char *path, const char *name, kt_scene *scene) {
    kt_error error;
    fill_description(d, name, &scene->description);
    if (!d->r->out_of_memory && kt_description_check(&scene->description, take_fault, d, &error) == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(d->r);
    return !kt_draft_is_wrong(d) && kt_marks_make(d->r, path, scene, d->body_elements.items, d->loop_elements.items);
}
