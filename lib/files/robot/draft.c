/* The scene that a reader of robots builds: bodies, loops and effects, each with its element of the file. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot_contact.h"

#include <string.h>

static void *add(kt_draft *d, kt_list *items, kt_list *elements, size_t size, const kt_element *e) {
    void *item = kt_list_add(d->r, &d->r->keep, items, size);
    const kt_element **from = kt_list_add(d->r, &d->r->scratch, elements, sizeof *from);
    if (item == NULL || from == NULL)
        return NULL;
    *from = e;
    return item;
}

kt_body *kt_draft_body(kt_draft *d, const kt_element *e, const kt_element *link) {
    kt_body *body = add(d, &d->bodies, &d->body_elements, sizeof *body, e);
    const char **joint = kt_list_add(d->r, &d->r->scratch, &d->joint_names, sizeof *joint);
    const char **name = kt_list_add(d->r, &d->r->scratch, &d->link_names, sizeof *name);
    const kt_element **of = kt_list_add(d->r, &d->r->scratch, &d->links, sizeof *of);
    if (body == NULL || joint == NULL || name == NULL || of == NULL)
        return NULL;
    *body = kt_body_default();
    *of = link;
    return body;
}

bool kt_draft_find_parents(kt_draft *d) {
    const size_t room = (size_t)d->bodies.count + 1;
    int *parents = kt_reader_take(d->r, &d->r->scratch, room, sizeof *parents);
    if (parents == NULL || !kt_robot_names(d->r, &d->body_names, room))
        return false;
    for (int i = 0; i < d->bodies.count; i++)
        (void)kt_names_add(&d->body_names, 0, kt_draft_body_at(d, i)->name, i);
    for (int i = 0; i < d->bodies.count; i++) {
        const char *parent = kt_draft_body_at(d, i)->parent;
        parents[i] = parent != NULL ? kt_names_find(&d->body_names, 0, parent) : -1;
    }
    d->parents = parents;
    return true;
}

static bool has_own_joint_name(const kt_draft *d, int body) {
    const char *name = *kt_draft_joint_name(d, body);
    return name != NULL && strcmp(name, ((const kt_body *)d->bodies.items)[body].name) != 0;
}

/* A joint without its own name has the name of its body. Joints that move keep this name. A body that is fixed without
 * a joint of the file gets another name, if a joint of the file has this name. */
void kt_draft_name_joints(kt_draft *d, kt_namer *joints) {
    for (int pass = 0; pass < 3; pass++)
        for (int i = 0; i < d->bodies.count; i++) {
            kt_body *body = kt_draft_body_at(d, i);
            const bool has_own = has_own_joint_name(d, i), is_fixed = body->joint.type == KT_JOINT_FIXED;
            if (pass != (has_own ? 1 : is_fixed && *kt_draft_joint_name(d, i) == NULL ? 2 : 0))
                continue;
            const char *wanted = has_own ? *kt_draft_joint_name(d, i) : body->name;
            const char *name = kt_namer_make(joints, wanted);
            kt_renamed *renamed = has_own && strcmp(name, wanted) != 0
                                      ? kt_list_add(d->r, &d->r->scratch, &d->renamed, sizeof *renamed)
                                      : NULL;
            if (renamed != NULL)
                *renamed = (kt_renamed){((const kt_element *const *)d->body_elements.items)[i], wanted, name};
            if (has_own || strcmp(name, wanted) != 0)
                body->joint.name = name;
        }
}

void kt_note_renamed_joints(kt_notes *notes, const kt_draft *d) {
    enum { PAGE = 40 };
    const kt_renamed *renamed = d->renamed.items;
    for (int i = 0; i < d->renamed.count && i < PAGE; i++)
        kt_note_put(notes, KT_NOTE_RANK_NAME, &(kt_left){.first = renamed[i].element, .count = 1},
                    "joint %s is called '%s', since names have letters, digits, _ and -, and each joint its own",
                    kt_name_quote(renamed[i].before).text, renamed[i].now);
    if (d->renamed.count > PAGE)
        kt_note_put(notes, KT_NOTE_RANK_NAME, &(kt_left){.first = renamed[PAGE].element, .count = 1},
                    "further joints that have other names: %d; the scene has them in this order",
                    d->renamed.count - PAGE);
}

void kt_joint_set_free(kt_joint *joint, kt_pose pose) {
    const kt_quat q = kt_quat_from_mat3(pose.rotation);
    const double start[] = {pose.position.x, pose.position.y, pose.position.z, q.w, q.x, q.y, q.z};
    joint->type = KT_JOINT_FREE;
    memcpy(joint->position, start, sizeof start);
}

kt_end kt_end_at(const char *body, kt_pose pose) {
    kt_end end = kt_end_default();
    end.body = body;
    end.at = pose.position;
    end.rotation = kt_rotation_of_matrix(pose.rotation);
    return end;
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

kt_loop *kt_draft_coupling(kt_draft *d, const kt_element *e, const char *name, int count, kt_term **terms) {
    kt_loop *loop = kt_draft_loop(d, e, KT_LOOP_COUPLING, name);
    *terms = kt_reader_take(d->r, &d->r->keep, (size_t)count, sizeof **terms);
    if (loop == NULL || *terms == NULL)
        return NULL;
    loop->terms = *terms;
    loop->term_count = count;
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

kt_effect *kt_draft_joint_effect(kt_draft *d, const kt_element *e, kt_effect_type type, const char *joint) {
    kt_effect *effect = kt_draft_effect(d, e, type);
    if (effect != NULL)
        effect->joint = joint;
    return effect;
}

void kt_draft_spring(kt_draft *d, const kt_element *e, const char *joint, double stiffness, double rest) {
    kt_effect *spring = stiffness != 0.0 ? kt_draft_joint_effect(d, e, KT_EFFECT_JOINT_SPRING, joint) : NULL;
    if (spring == NULL)
        return;
    spring->stiffness = stiffness;
    spring->rest = kt_function_constant(rest);
}

void kt_draft_resistance(kt_draft *d, const kt_element *e, const char *joint, double damping, double friction) {
    kt_effect *damper = damping != 0.0 ? kt_draft_joint_effect(d, e, KT_EFFECT_JOINT_DAMPER, joint) : NULL;
    if (damper != NULL)
        damper->damping = damping;
    kt_effect *rub = friction != 0.0 ? kt_draft_joint_effect(d, e, KT_EFFECT_JOINT_FRICTION, joint) : NULL;
    if (rub != NULL)
        rub->coulomb = friction;
}

bool kt_draft_lift(kt_draft *d, const kt_element *e, const kt_body *body, kt_vec3 gravity, double share) {
    const double g[3] = {gravity.x, gravity.y, gravity.z};
    kt_effect *effect = share != 0.0 && body->mass > 0.0 ? kt_draft_effect(d, e, KT_EFFECT_FORCE) : NULL;
    if (effect == NULL)
        return false;
    effect->between[0].body = body->name;
    effect->between[0].at = body->com;
    for (int i = 0; i < 3; i++)
        effect->value[i] = kt_function_constant(-share * body->mass * g[i]);
    return true;
}

void kt_draft_stop(kt_draft *d, const kt_element *e, const kt_robot_options *o, const char *joint, double lower,
                   double upper) {
    kt_effect *stop = kt_robot_has_stops(o) ? kt_draft_joint_effect(d, e, KT_EFFECT_JOINT_LIMIT, joint) : NULL;
    if (stop == NULL)
        return;
    stop->stiffness = o->stop_stiffness;
    stop->damping = o->stop_damping;
    stop->lower = lower;
    stop->upper = upper;
    const kt_contact_law law = kt_contact_law_standard();
    if (o->stop_stiffness == 0.0)
        (void)kt_contact_law_yield(&law, 0.0, 1.0, 9.81, &stop->stiffness, &stop->damping);
    int *soft = o->stop_stiffness == 0.0 ? kt_list_add(d->r, &d->r->scratch, &d->soft_stops, sizeof *soft) : NULL;
    if (soft != NULL)
        *soft = d->effects.count - 1;
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

/* The element in a link that has the mass or the inertia, for a fault of this field; else `other`. */
static const kt_element *element_of_mass(const kt_element *link, const char *field, const kt_element *other) {
    const kt_element *inertial = kt_xml_child(link, "inertial");
    const bool is_mass = strcmp(field, "mass") == 0 || strcmp(field, "inertia") == 0;
    const kt_element *e = inertial != NULL && is_mass ? kt_xml_child(inertial, field) : NULL;
    return e != NULL ? e : other;
}

/* The faults that the description's own check finds, at the element that each comes from. */
static void take_fault(void *user, const kt_place *place, const kt_error *error) {
    const kt_draft *d = user;
    const kt_list *lists[] = {
        [KT_ITEM_BODY] = &d->body_elements, [KT_ITEM_LOOP] = &d->loop_elements, [KT_ITEM_EFFECT] = &d->effect_elements};
    const bool is_listed = place->item >= KT_ITEM_BODY && place->item <= KT_ITEM_EFFECT;
    const kt_element *e = is_listed ? ((const kt_element *const *)lists[place->item]->items)[place->index] : d->root;
    if (place->item == KT_ITEM_BODY && d->has_link_places)
        e = element_of_mass(((const kt_element *const *)d->links.items)[place->index], place->field, e);
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
    to->states = d->states.items;
    to->state_count = d->states.count;
    to->name = name != NULL ? kt_reader_text(d->r, &d->r->keep, name, strlen(name)) : NULL;
}

/* Contacts with friction that builds up over a small slip are stiff, of which explicit steps take too many. */
static bool draft_has_contacts(const kt_draft *d) {
    for (int i = 0; i < d->effects.count; i++)
        if (((const kt_effect *)d->effects.items)[i].type == KT_EFFECT_CONTACT)
            return true;
    return false;
}

bool kt_draft_finish(kt_draft *d, kt_appearance *appearance, const char *name, kt_scene *scene) {
    kt_error error;
    if (d->parents == NULL)
        (void)kt_draft_find_parents(d);
    kt_appearance_finish(appearance, d, scene);
    fill_description(d, name, &scene->description);
    if (draft_has_contacts(d))
        scene->run.integrator = KT_ROBOT_STIFF_METHOD;
    if (!d->r->out_of_memory && kt_description_check(&scene->description, take_fault, d, &error) == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(d->r);
    return !kt_draft_is_wrong(d) &&
           kt_marks_make(d->r, appearance->source->path, scene, d->body_elements.items, d->loop_elements.items);
}
