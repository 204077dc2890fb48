/* Robots in the Unified Robot Description Format: links and joints of XML to bodies of a description.
 *
 * A link of URDF is a body of ours. The joint with this link as child is the body's joint: both frames are the same. As
 * in our descriptions, `origin` gives the joint's frame in the parent link, and the axis is in the joint's frame.
 */
#include "import/urdf.h"

#include <math.h>
#include <string.h>

/* ---- the scene --------------------------------------------------------------------------------------------------- */

static bool take_memory(kt_urdf *u) {
    kt_pool *keep = &u->r->keep, *scratch = &u->r->scratch;
    const size_t links = (size_t)u->link_count + 1, joints = (size_t)u->joint_count;
    u->bodies = kt_pool_take(keep, links + 1, sizeof *u->bodies);
    u->loops = kt_pool_take(keep, joints + 1, sizeof *u->loops);
    u->effects = kt_pool_take(keep, 3 * joints + 1, sizeof *u->effects);
    u->body_elements = kt_pool_take(scratch, links + 1, sizeof *u->body_elements);
    u->body_links = kt_pool_take(scratch, links + 1, sizeof *u->body_links);
    u->loop_elements = kt_pool_take(scratch, joints + 1, sizeof *u->loop_elements);
    u->effect_elements = kt_pool_take(scratch, 3 * joints + 1, sizeof *u->effect_elements);
    return (u->bodies != NULL && u->loops != NULL && u->effects != NULL && u->body_elements != NULL &&
            u->body_links != NULL && u->loop_elements != NULL && u->effect_elements != NULL) ||
           kt_reader_out_of_memory(u->r);
}

/* The element of a body that a field comes from: of masses its <inertia> or <mass>, else the joint that carries it. */
static const kt_element *element_of_body(const kt_urdf *u, const kt_place *place) {
    const kt_element *link = u->links[u->body_links[place->index]].element, *inertial = kt_xml_child(link, "inertial");
    const bool is_mass = strcmp(place->field, "mass") == 0, is_inertia = strcmp(place->field, "inertia") == 0;
    const kt_element *e = inertial != NULL && (is_mass || is_inertia) ? kt_xml_child(inertial, place->field) : NULL;
    return e != NULL ? e : u->body_elements[place->index];
}

/* The faults that the description's own check finds, at the element that each comes from. */
static void take_fault(void *user, const kt_place *place, const kt_error *error) {
    const kt_urdf *u = user;
    const kt_element *e = u->robot;
    if (place->item == KT_ITEM_BODY)
        e = element_of_body(u, place);
    else if (place->item == KT_ITEM_LOOP)
        e = u->loop_elements[place->index];
    else if (place->item == KT_ITEM_EFFECT)
        e = u->effect_elements[place->index];
    (void)kt_fault_put(u->r, error->code, e->line, e->column, "%s%s%s", error->where,
                       error->where[0] != '\0' ? ": " : "", error->message);
}

static void note_links(kt_notes *n, const kt_urdf *u, int root) {
    const kt_left base = {.first = u->links[root].element, .count = u->links[root].body != NULL};
    kt_note_put(n, &base, "link %s %s; gravity is 9.81 m/s^2 along -z",
                kt_name_quote(kt_xml_attribute(base.first, "name")).text,
                u->options->floating ? "moves freely" : "is fixed to the world (--floating lets it move)");
    if (u->late.line > 0) {
        const kt_element declaration = {.line = u->late.line, .column = u->late.column};
        kt_note_put(n, &(kt_left){.first = &declaration, .count = 1},
                    "the XML declaration is not at the beginning of the file, where other readers expect it");
    }
    kt_note_put(n, &u->undeclared, "no link 'world' is declared; this parent is taken for the world");
    kt_note_put(n, &u->freed, "links that are fixed to the world and move freely, by --floating: %d", u->freed.count);
    if (u->options->floating && kt_urdf_is_world(u, root) && u->freed.count == 0)
        kt_note_put(n, &(kt_left){.first = u->links[root].element, .count = 1},
                    "--floating frees nothing: no link is fixed to the world");
    kt_note_put(n, &u->renamed,
                "names of links that names of bodies cannot be, with '_' in place of what is not allowed: %d",
                u->renamed.count);
    kt_note_renamed_joints(n, &u->renamed_joints);
}

static void note_joints(kt_notes *n, const kt_urdf *u) {
    kt_note_put(n, &u->starts, "joints that start at a limit, since zero is outside their limits: %d", u->starts.count);
    if (u->options->stop_stiffness == 0.0)
        kt_note_put(n, &u->limits, "joints whose limits of position are data alone (--stops makes effects of them): %d",
                    u->limits.count);
    kt_note_put(n, &u->disordered, "joints whose limits of position are left out, since lower is above upper: %d",
                u->disordered.count);
    kt_note_put(n, &u->followers, "joints that start where the joints that they follow put them, which is not zero: %d",
                u->followers.count);
    kt_note_put(n, &u->beyond, "joints that start beyond their own limits, since they follow others: %d",
                u->beyond.count);
    kt_note_put(n, &u->fixed_mimics,
                "mimics that are left out, since the joint or the one that it follows is fixed: %d",
                u->fixed_mimics.count);
}

static void note_masses(kt_notes *n, const kt_urdf *u) {
    kt_judge_notes(n, &u->judge);
    kt_note_put(n, &u->by_density,
                "links without <inertial> that have mass and inertia of their shapes, by --density: %d",
                u->by_density.count);
    kt_note_put(n, &u->massless,
                "no link has a mass: places, pictures and degrees of freedom alone can be computed (--density gives "
                "masses by shapes, --mass LINK=MASS one)");
    kt_note_put(n, &u->geared, "transmissions whose rotor inertia became the joint's armature: %d", u->geared.count);
    kt_note_put(n, &u->words, "transmissions with a reduction or an inertia that is no number, which is left out: %d",
                u->words.count);
    kt_note_put(n, &u->ungeared, "transmissions that are left out, since they have no rotor inertia: %d",
                u->ungeared.count);
}

static void note_rest(kt_notes *n, const kt_urdf *u) {
    kt_note_put(n, &u->rates,
                "limits of effort or speed that are left out, since they are no numbers, or below zero: %d",
                u->rates.count);
    kt_note_put(n, &u->scales, "scales of meshes that are not three numbers, taken as 1: %d", u->scales.count);
    kt_appearance_notes(n, &u->appearance);
    kt_note_put(n, &u->shapes, "visuals without a geometry that is known, left out of pictures: %d", u->shapes.count);
    kt_note_put(n, &u->contacts, "collision shapes that are left out, since contacts are effects: %d",
                u->contacts.count);
    kt_note_strange(n, &u->strange);
}

/* Makes a note of each kind of change or omission. */
static void make_notes(const kt_urdf *u, int root, kt_scene *scene) {
    kt_notes n;
    if (!kt_notes_begin(&n, u->r, u->path))
        return;
    note_links(&n, u, root);
    note_joints(&n, u);
    note_masses(&n, u);
    note_rest(&n, u);
    scene->notes = n.notes;
    scene->note_count = n.count;
}

static void judge_inertias(kt_urdf *u) {
    const int count = u->description->body_count;
    int *parents = kt_pool_take(&u->r->scratch, (size_t)count + 1, sizeof *parents);
    int *body_of = kt_pool_take(&u->r->scratch, (size_t)u->link_count + 1, sizeof *body_of);
    const kt_element **links = kt_pool_take(&u->r->scratch, (size_t)count + 1, sizeof *links);
    if (parents == NULL || body_of == NULL || links == NULL) {
        (void)kt_reader_out_of_memory(u->r);
        return;
    }
    for (int i = 0; i < u->link_count; i++)
        body_of[i] = -1;
    for (int b = 0; b < count; b++)
        body_of[u->body_links[b]] = b;
    for (int b = 0; b < count; b++) {
        const kt_urdf_link *link = &u->links[u->body_links[b]];
        links[b] = link->element;
        parents[b] = link->carrier >= 0 ? body_of[u->joints[link->carrier].parent] : -1;
    }
    u->judge = (kt_judge){
        .r = u->r, .options = u->options, .bodies = u->bodies, .parents = parents, .elements = links, .count = count};
    kt_judge_inertias(&u->judge);
    u->description->inertia_check = u->judge.limit;
}

static void make_scene(kt_urdf *u, kt_scene *scene) {
    kt_error error;
    if (!kt_urdf_collect(u))
        return;
    const int root = kt_urdf_root(u);
    if (!take_memory(u))
        return;
    u->description = &scene->description;
    kt_urdf_names(u, root);
    kt_urdf_bodies(u);
    scene->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    if (u->r->out_of_memory || u->r->fault_count > 0)
        return;
    judge_inertias(u);
    kt_urdf_given_masses(u);
    kt_appearance_finish(&u->appearance, u->bodies, u->description->body_count, scene);
    const char *name = kt_xml_attribute(u->robot, "name");
    if (name != NULL) {
        scene->description.name = kt_pool_text(&u->r->keep, name, strlen(name));
        if (scene->description.name == NULL)
            (void)kt_reader_out_of_memory(u->r);
    }
    if (u->r->out_of_memory || u->r->fault_count > 0)
        return;
    if (kt_description_check(&scene->description, take_fault, u, &error) == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(u->r);
    if (u->r->out_of_memory || u->r->fault_count > 0 ||
        !kt_marks_make(u->r, u->path, scene, u->body_elements, u->loop_elements))
        return;
    make_notes(u, root, scene);
}

void kt_urdf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene) {
    kt_urdf u = {.r = r,
                 .options = source->options,
                 .appearance = {.r = r, .source = source},
                 .robot = source->root,
                 .path = source->path,
                 .late = source->late};
    make_scene(&u, scene);
}
