/* The models of a description whose loops or effects are switched: one model for each set of active items.
 *
 * These sets are 2^n models of n loops and effects that the caller switches. Contacts with more than a few switches
 * (kt_model_options.contact_switches) are masked. Then each set of the other switches has two models: all contacts
 * open, and all contacts closed. The time and the memory of both grow with the number of contacts. A simulation derives
 * all other sets from the second model (contact/mask.h), whose groups are dense.
 *
 * Each model is compiled separately, from the description in which the others are off. Constraint groups, their ranks
 * and forms, and the planes of trees follow from the loops that are on. A model is therefore as fast as one that never
 * had the others. For example, apps/embed/standing.c has 18 coordinates. With all feet off the ground, as a tree, an
 * evaluation takes 25,000 instructions. With all four feet down, as one dense group, an evaluation takes 120,000. A
 * single group whose rows were left out would fill and factor its matrices of 18 coordinates in flight, too. All models
 * are copied into one block.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"

#include "base/copy.h"
#include "base/pool.h"
#include "compile/one_sided.h"
#include "effect/effect.h"
#include "evaluate/open.h"
#include "evaluate/slip.h"

#include <stdio.h>
#include <string.h>

/* Hard stops and contacts (compile/one_sided.c) are off in all models. Friction that sticks has two switches: the
 * switch of its loop, and the switch of the effect, which means that the joint slips backwards. If only the loop's
 * switch is on, friction sticks, and the effect is off. If both are on, friction is released, and the loop is off,
 * too. */
static kt_switching switching_of(const kt_effect *effect) {
    if (kt_effect_sticks(effect))
        return effect->switching == KT_SWITCHED_OFF ? KT_SWITCHED_ON : KT_SWITCHED_OFF;
    return kt_effect_is_hard(effect) ? KT_ALWAYS_ON : effect->switching;
}

int kt_switches_count(const kt_description *d) {
    int count = 0;
    for (int i = 0; i < d->loop_count; i++)
        count += KT_IS_SWITCHED(&d->loops[i]);
    for (int i = 0; i < d->effect_count; i++)
        count += switching_of(&d->effects[i]) != KT_ALWAYS_ON;
    return count;
}

typedef struct compilation {
    kt_pool pool;
    kt_description description; /* with the arrays below */
    const kt_hard_loop *hard;   /* of each loop, or NULL */
    kt_loop *loops;
    kt_effect *effects;
    kt_switches switches;
    kt_switch *item;            /* of the switches */
    int32_t *loop_switch;       /* of each loop, and of each effect behind them; -1: it has none */
    int32_t *effect_switch;     /* these */
    int32_t *contact;           /* of each effect: the loop of a contact with friction that it is */
    int32_t *place;             /* scratch, one number an effect */
    int bits;                   /* of switches that do not share any, which may be too many */
    uint64_t initial, released; /* sets: of the description; masked friction of joints that a simulation releases */
    kt_model **model;           /* by their indices */
} compilation;

static int effect_of_loop(const compilation *c, int loop) { return c->hard != NULL ? c->hard[loop].effect : -1; }

/* The effect whose friction sticks by the loop of switch k; -1: none. */
static int effect_of_stick(const compilation *c, int k) {
    const int loop = c->item[k].loop;
    return loop >= 0 && c->loops[loop].side == KT_SIDE_NONE ? effect_of_loop(c, loop) : -1;
}

/* Adds a switch for an item that may be switched, and marks it in the initial set if it is on at first. Switches from
 * `own` on share their bits, and have no bit of their own in a set. */
static void add_variant_switch(compilation *c, kt_switch item, kt_switching switching) {
    if (switching == KT_ALWAYS_ON || switching == KT_NEVER_ON)
        return;
    if (switching == KT_SWITCHED_ON && c->switches.count < c->switches.own)
        c->initial |= (uint64_t)1 << c->switches.count;
    *(item.loop >= 0 ? &c->loop_switch[item.loop] : &c->effect_switch[item.effect]) = c->switches.count;
    c->item[c->switches.count++] = item;
}

/* Whether a loop belongs to a contact: the loop bounds a side, or is a contact's sticking friction
 * (compile/one_sided.c).
 * */
static bool is_contact(const compilation *c, int loop) {
    return c->loops[loop].side != KT_SIDE_NONE ||
           (c->loops[loop].type == KT_LOOP_ROLLING && effect_of_loop(c, loop) >= 0);
}

/* Whether switch k belongs to a contact, or to friction of a joint that sticks. */
static bool is_of_contact(const compilation *c, int k) {
    const kt_switch *item = &c->item[k];
    return item->loop >= 0 ? is_contact(c, item->loop) || effect_of_stick(c, k) >= 0
                           : kt_effect_sticks(&c->effects[item->effect]);
}

/* Masks contacts if their switches are too many for a model of each set. */
static kt_status mask_contacts(compilation *c, const kt_model_options *options, kt_error *error) {
    const int most =
        options->contact_switches > KT_CONTACT_SWITCHES ? options->contact_switches : (int)KT_CONTACT_SWITCHES;
    int others = 0;
    for (int k = 0; k < c->switches.count; k++)
        others += !is_of_contact(c, k);
    if (c->switches.count <= KT_SWITCH_MAX && c->switches.count - others <= most)
        return KT_OK;
    for (int k = 0; k < c->switches.count; k++) {
        const uint64_t bits = k < c->switches.own ? (uint64_t)1 << k : kt_switches_all;
        if (is_of_contact(c, k) && c->item[k].loop >= 0)
            c->switches.masked |= bits;
        else if (is_of_contact(c, k))
            c->switches.back |= bits;
    }
    if (others >= KT_SWITCH_MAX)
        return kt_error_set(error, KT_ERROR_MODEL, "switching",
                            "%d loops and effects are switched besides contacts and friction, which would be %.0f "
                            "models; switch at most %d",
                            others, exp2(others + (c->switches.masked != 0)),
                            KT_SWITCH_MAX - (c->switches.masked != 0));
    if (c->bits > KT_SWITCH_BITS)
        return kt_error_set(error, KT_ERROR_MODEL, "switching",
                            "friction that sticks in joints needs %d switches, two a joint, besides %d others; there "
                            "are %d, so leave `stick` out in some joints",
                            c->bits - others, others, KT_SWITCH_BITS);
    c->released = c->initial & c->switches.masked;
    c->initial &= ~(c->switches.masked | c->switches.back);
    return KT_OK;
}

/* Lists the switches of loops; if these are listed `apart`, only of contacts, or only of the other loops. */
static void add_loop_switches(compilation *c, const kt_description *d, bool apart, bool contacts) {
    for (int i = 0; i < d->loop_count; i++)
        if (!apart || is_contact(c, i) == contacts)
            add_variant_switch(c, (kt_switch){.loop = i, .effect = -1}, d->loops[i].switching);
}

/* A contact that is released at first has no bit by which events engage it. */
static kt_status reject_released(const compilation *c, const kt_description *d, kt_error *error) {
    for (int i = 0; i < d->loop_count; i++)
        if (d->loops[i].side != KT_SIDE_NONE && c->hard[i].released)
            return kt_error_set(error, KT_ERROR_MODEL, "switching",
                                "'%.60s' is a hard contact or stop that is switched off, in a model of more than %d "
                                "contacts and switches; let it act, or leave other contacts out",
                                d->loops[i].name ? d->loops[i].name : "", KT_SWITCH_BITS);
    return KT_OK;
}

/* Lists all switches. Contacts that share bits come last. */
static kt_status list_switches(compilation *c, const kt_description *d, int count, kt_error *error) {
    const bool shares = count > KT_SWITCH_BITS;
    c->switches.own = count;
    for (int i = 0; shares && i < d->loop_count; i++)
        c->switches.own -= KT_IS_SWITCHED(&d->loops[i]) && is_contact(c, i);
    c->bits = c->switches.own;
    if (c->switches.own > KT_SWITCH_BITS)
        c->switches.own = KT_SWITCH_BITS;
    add_loop_switches(c, d, shares, false);
    for (int i = 0; i < d->effect_count; i++)
        add_variant_switch(c, (kt_switch){.loop = -1, .effect = i}, switching_of(&d->effects[i]));
    if (shares)
        add_loop_switches(c, d, true, true);
    return shares ? reject_released(c, d, error) : KT_OK;
}

/* Lists the contacts with friction by their effects. */
static void list_contacts(compilation *c) {
    for (int i = 0; i < c->description.loop_count; i++) {
        const int effect = effect_of_loop(c, i);
        if (c->loops[i].side != KT_SIDE_NONE && effect >= 0)
            c->contact[effect] = i;
    }
}

/* Copies the lists of loops and effects, whose switching is set for each model, and finds the switches and their sets.
 * loop_switch, effect_switch, contact and place share one array. */
static kt_status begin_compilation(compilation *c, const kt_description *d, const kt_model_options *options,
                                   kt_error *error) {
    const size_t loops = (size_t)d->loop_count, effects = (size_t)d->effect_count;
    const int count = kt_switches_count(d);
    c->description = *d;
    c->loops = kt_pool_take(&c->pool, loops, sizeof *c->loops);
    c->effects = kt_pool_take(&c->pool, effects, sizeof *c->effects);
    c->item = kt_pool_take(&c->pool, (size_t)count, sizeof *c->item);
    c->loop_switch = kt_pool_take(&c->pool, loops + 3 * effects, sizeof *c->loop_switch);
    if (!c->loops || !c->effects || !c->item || !c->loop_switch)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < loops + 2 * effects; i++)
        c->loop_switch[i] = -1;
    c->effect_switch = c->loop_switch + loops;
    c->contact = c->effect_switch + effects;
    c->place = c->contact + effects;
    c->switches.loops = d->loop_count;
    c->switches.effects = d->effect_count;
    kt_copy(c->loops, d->loops, loops * sizeof *c->loops);
    kt_copy(c->effects, d->effects, effects * sizeof *c->effects);
    c->description.loops = c->loops;
    c->description.effects = c->effects;
    list_contacts(c);
    kt_status status = list_switches(c, d, count, error);
    if (status == KT_OK)
        status = mask_contacts(c, options, error);
    if (status != KT_OK)
        return status;
    c->model = kt_pool_take(&c->pool, (size_t)kt_switches_models(&c->switches), sizeof(kt_model *));
    return c->model ? KT_OK : kt_error_set(error, KT_ERROR_MEMORY, "", "out of memory");
}

static void end_compilation(compilation *c) {
    for (uint64_t k = 0; c->model && k < kt_switches_models(&c->switches); k++)
        kt_model_free(c->model[k]);
    kt_pool_free(c->pool.chunks);
}

static const char *switch_name_of(const compilation *c, int k) {
    const kt_switch *item = &c->item[k];
    const char *name = item->loop >= 0 ? c->loops[item->loop].name : c->effects[item->effect].name;
    return name ? name : "";
}

/* Adds to an error the names of the items that are switched off in the model that the error concerns. */
static kt_status reject_variant(const compilation *c, uint64_t set, const kt_error *from, kt_error *error) {
    char text[256] = "";
    size_t used = 0;
    for (int k = 0; k < c->switches.count && used < sizeof text - 1; k++)
        if (!kt_switches_has(&c->switches, set, k)) {
            const int length =
                snprintf(text + used, sizeof text - used, "%s'%.40s'", used ? ", " : "", switch_name_of(c, k));
            used += length > 0 ? (size_t)length : 0;
        }
    return used == 0 ? kt_error_set(error, from->code, from->where, "%s", from->message)
                     : kt_error_set(error, from->code, from->where, "with %s switched off: %s", text, from->message);
}

/* Sets whether a contact with friction slips: while it is closed and does not stick. */
static void set_slipping_contact(const compilation *c, int32_t stick, int effect, kt_model *model) {
    kt_loop_record *loop = c->contact[effect] >= 0 ? &model->loop[c->contact[effect]] : NULL;
    if (loop == NULL)
        return;
    loop->rubs = effect + 1;
    loop->slips = !kt_loop_is_off(loop) && kt_loop_is_off(&model->loop[stick]) ? effect + 1 : 0;
    if (loop->slips > 0)
        kt_slip_add(model);
}

/* Applies a switch of friction that sticks. The effect is off while its loop is on, and when the friction is released.
 * The model stores the direction of slipping. */
static void set_stick(compilation *c, int k, uint64_t set, kt_model *model) {
    const int effect = effect_of_stick(c, k);
    if (effect < 0)
        return;
    const int32_t loop = c->item[k].loop;
    if (model)
        model->loop[loop].friction = effect + 1;
    if (model && c->loops[loop].type == KT_LOOP_ROLLING)
        set_slipping_contact(c, loop, effect, model);
    if (c->loops[loop].type == KT_LOOP_ROLLING)
        return;
    const int32_t back = c->effect_switch[effect];
    const bool backwards = back >= 0 && kt_switches_has(&c->switches, set, back);
    const bool is_on = kt_switches_has(&c->switches, set, k);
    const bool is_masked = (c->switches.masked & kt_switches_bit(&c->switches, k)) != 0;
    c->effects[effect].switching = is_on && !is_masked ? KT_SWITCHED_OFF : KT_ALWAYS_ON;
    c->loops[loop].switching = is_on && !backwards ? KT_ALWAYS_ON : KT_SWITCHED_OFF;
    if (model && is_masked)
        model->loop[loop].released = (c->released & kt_switches_bit(&c->switches, k)) != 0;
    for (size_t i = 0; model && i < model->n.effect + model->n.effect_off; i++)
        if (model->effect[i].source == effect) {
            model->effect[i].direction = backwards ? -1.0 : 1.0;
            model->effect[i].idle = is_on && is_masked;
        }
}

/* Counts the contacts and friction of each island. */
static void count_items_of_islands(kt_model *model) {
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        kt_island *island = loop->group >= 0 ? &model->island[model->group[loop->group].island] : NULL;
        if (island == NULL)
            continue;
        island->side += loop->side != KT_SIDE_NONE;
        island->rubs += loop->rubs > 0;
        island->dry += loop->friction > 0 && loop->type == KT_LOOP_RATES;
    }
}

/* The sets between are taken from the model in which all contacts are closed: its groups have the form of any set. */
static kt_model_options options_of(const compilation *c, const kt_model_options *options, uint64_t set) {
    kt_model_options own = *options;
    if ((set & c->switches.masked) != 0) {
        own.structure = KT_STRUCTURE_DENSE;
        own.excluded_forms |= 1U << KT_FORM_PIN;
    }
    return own;
}

/* Compiles the model of one set: items in the set are always on, the others are switched off. Friction that sticks is
 * set before (in the description) and after (in the model). */
static kt_status compile_one_set(compilation *c, const kt_model_options *options, kt_compile_call *compile,
                                 uint64_t index, kt_error *error) {
    const uint64_t set = kt_switches_set(&c->switches, index);
    const kt_model_options own = options_of(c, options, set);
    kt_error from = {.code = KT_OK};
    for (int k = 0; k < c->switches.count; k++) {
        const kt_switching switching = kt_switches_has(&c->switches, set, k) ? KT_ALWAYS_ON : KT_SWITCHED_OFF;
        if (c->item[k].loop >= 0) /* one that is off at first remains switched: its place may move (rank_places.c) */
            c->loops[c->item[k].loop].switching =
                switching == KT_ALWAYS_ON && !kt_switches_has(&c->switches, c->initial, k) ? KT_SWITCHED_ON : switching;
        else
            c->effects[c->item[k].effect].switching = switching;
    }
    for (int k = 0; k < c->switches.count; k++)
        set_stick(c, k, set, NULL);
    const kt_status status = compile(&c->description, &own, &c->model[index], &from);
    for (int i = 0; status == KT_OK && c->hard != NULL && i < c->description.loop_count; i++)
        c->model[index]->loop[i].released = c->hard[i].released;
    for (int k = 0; status == KT_OK && k < c->switches.count; k++)
        set_stick(c, k, set, c->model[index]);
    if (status == KT_OK) {
        count_items_of_islands(c->model[index]);
        kt_model_seal(c->model[index]);
    }
    return status == KT_OK ? KT_OK : reject_variant(c, set, &from, error);
}

/* Springs that start unstretched take their lengths from the model of the initial set; the other models copy these
 * lengths. */
static void share_lengths(const compilation *c, kt_model *to) {
    const kt_model *from = c->model[kt_switches_index(&c->switches, c->initial)];
    const size_t count = from->n.effect + from->n.effect_off;
    for (size_t i = 0; i < count; i++)
        c->place[from->effect[i].source] = (int32_t)i;
    for (size_t i = 0; i < count; i++)
        to->effect[i].length = from->effect[c->place[to->effect[i].source]].length;
}

/* Bytes of the data: for a mask, in which any contacts may slip, the bytes for all contacts. */
static size_t data_size_of(const compilation *c, const kt_model *model) {
    kt_model slipping = *model;
    if ((model->set & c->switches.masked) == 0)
        return kt_data_size(model);
    slipping.n.slip = slipping.n.slip_work = 0;
    for (size_t i = 0; i < model->n.loop; i++)
        if (model->loop[i].rubs > 0 && slipping.n.slip < model->n.v)
            kt_slip_add(&slipping);
    slipping.variants = NULL;
    return kt_data_size(&slipping);
}

/* Adds the bits of the contacts of a model and of friction that sticks. An effect of friction is on while its joint
 * slips backwards if its bit is in `back` (switching.h). */
static void set_contact_bits(kt_variants *variants, const kt_model *model) {
    for (int i = 0; i < (int)model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        if (loop->side == KT_SIDE_NONE && loop->friction == 0)
            continue;
        const uint64_t back = kt_switch_bits(model, kt_effect_switch(model, loop->friction - 1));
        variants->contacts |= kt_switch_bits(model, kt_loop_switch(model, i)) | back;
        variants->back |= back;
    }
}

/* Copies all models into one block. */
static kt_status join_variants(const compilation *c, kt_model **model, kt_error *error) {
    const uint64_t models = kt_switches_models(&c->switches);
    const size_t head = kt_variants_head(&c->switches);
    size_t bytes = head;
    for (uint64_t k = 0; k < models; k++)
        bytes += kt_arena_round(c->model[k]->bytes);
    kt_variants *variants = kt_arena_allocate(bytes, "the models", error);
    if (!variants)
        return KT_ERROR_MEMORY;
    memset(variants, 0, head);
    variants->check_open = kt_open_contacts_place;
    variants->switches = c->switches;
    memcpy(variants->at + models, c->item, (size_t)c->switches.count * sizeof *c->item);
    memcpy((int32_t *)(uintptr_t)kt_variants_switch_of_loop(variants), c->loop_switch,
           (size_t)(c->switches.loops + c->switches.effects) * sizeof *c->loop_switch);
    variants->bytes = bytes;
    size_t at = head;
    for (uint64_t k = 0; k < models; k++) {
        kt_model *from = c->model[k], *to = (kt_model *)(void *)((char *)variants + at);
        share_lengths(c, from);
        from->set = kt_switches_set(&c->switches, k);
        kt_model_copy_one(from, to);
        to->placed = false;
        to->variants = variants;
        to->revision = 0; /* parameters are set in all models at once */
        variants->at[k] = at;
        at += kt_arena_round(from->bytes);
        set_contact_bits(variants, to);
        kt_contacts_link(&c->description, c->place, to);
        const size_t data = data_size_of(c, from);
        variants->data = data > variants->data ? data : variants->data;
    }
    *model = kt_variants_model(variants, (uint64_t)kt_switches_index(&c->switches, c->initial));
    return KT_OK;
}

kt_status kt_variants_compile(const kt_description *description, const kt_hard_loop *hard,
                              const kt_model_options *options, kt_compile_call *compile, kt_model **model,
                              kt_error *error) {
    compilation c = {.hard = hard};
    kt_status status = begin_compilation(&c, description, options, error);
    for (uint64_t k = 0; status == KT_OK && k < kt_switches_models(&c.switches); k++)
        status = compile_one_set(&c, options, compile, k, error);
    if (status == KT_OK)
        status = join_variants(&c, model, error);
    end_compilation(&c);
    return status;
}
