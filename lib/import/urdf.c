/* Robots in the Unified Robot Description Format: links and joints of XML to bodies of a description.
 *
 * A link of URDF is a body of ours, and the joint that has it as child is that body's joint: both frames are the same.
 * URDF gives the joint's frame by `origin` in the parent link, and the axis in the joint's frame, as we do.
 */
#include "import/urdf.h"
#include "base/require.h"

#include "scene/part.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* ---- what is left out -------------------------------------------------------------------------------------------- */

/* Adds a note at the first place where something was counted, if it was. */
static void note(kt_urdf *u, const kt_left *left, const char *format, ...) KT_PRINTF(3, 4);

static void note(kt_urdf *u, const kt_left *left, const char *format, ...) {
    char what[KT_MESSAGE_SIZE];
    va_list arguments;
    if (left->count == 0)
        return;
    va_start(arguments, format);
    (void)vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    const size_t room = strlen(u->path) + 32;
    char *where = kt_pool_take(&u->r->keep, room, 1);
    kt_scene_note *to = &u->notes[u->note_count++];
    to->where = where;
    to->what = kt_pool_text(&u->r->keep, what, strlen(what));
    if (to->where == NULL || to->what == NULL) {
        (void)kt_reader_out_of_memory(u->r);
        return;
    }
    (void)snprintf(where, room, "%s:%u:%u", u->path, (unsigned)left->first->line, (unsigned)left->first->column);
}

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

static void note_odd_inertias(kt_urdf *u) {
    kt_phrase by = {.length = 0};
    if (isinf(u->worst_excess))
        kt_phrase_add(&by, "a principal moment being negative, or none beside it");
    else
        kt_phrase_add(&by, "their largest principal moment exceeding the sum of the others by up to %.2g %% of it",
                      100.0 * u->worst_excess);
    note(u, &u->odd_inertias,
         "inertias that no body has are computed with, %s: %d; where such a part moves, accelerations may be wrong or "
         "not exist",
         by.text, u->odd_inertias.count);
}

/* Tells what was changed or left out, each kind once. */
static void make_notes(kt_urdf *u, int root, kt_scene *scene) {
    const kt_left base = {.first = u->links[root].element, .count = u->links[root].body != NULL};
    kt_phrase unknown = {.length = 0};
    u->notes = kt_pool_take(&u->r->keep, NOTES, sizeof *u->notes);
    if (u->notes == NULL) {
        (void)kt_reader_out_of_memory(u->r);
        return;
    }
    note(u, &base, "link %s %s; gravity is 9.81 m/s^2 along -z",
         kt_name_quote(kt_xml_attribute(base.first, "name")).text,
         u->options->floating ? "moves freely" : "is fixed to the world (--floating lets it move)");
    if (u->late.line > 0) {
        const kt_element declaration = {.line = u->late.line, .column = u->late.column};
        note(u, &(kt_left){.first = &declaration, .count = 1},
             "the XML declaration is not at the beginning of the file, where other readers expect it");
    }
    note(u, &u->undeclared, "no link 'world' is declared; this parent is taken for the world");
    note(u, &u->freed, "links that are fixed to the world and move freely, by --floating: %d", u->freed.count);
    if (u->options->floating && kt_urdf_is_world(u, root) && u->freed.count == 0)
        note(u, &(kt_left){.first = u->links[root].element, .count = 1},
             "--floating frees nothing: no link is fixed to the world");
    note(u, &u->renamed, "names of links that names of bodies cannot be, with '_' in place of what is not allowed: %d",
         u->renamed.count);
    note(u, &u->starts, "joints that start at a limit, since zero is outside their limits: %d", u->starts.count);
    if (u->options->stop_stiffness == 0.0)
        note(u, &u->limits, "joints whose limits of position are left out (--stops makes effects of them): %d",
             u->limits.count);
    note(u, &u->disordered, "joints whose limits of position are left out, since lower is above upper: %d",
         u->disordered.count);
    note(u, &u->followers, "joints that start where the joints that they follow put them, which is not zero: %d",
         u->followers.count);
    note(u, &u->beyond, "joints that start beyond their own limits, since they follow others: %d", u->beyond.count);
    note(u, &u->fixed_mimics, "mimics that are left out, since the joint or the one that it follows is fixed: %d",
         u->fixed_mimics.count);
    note(u, &u->sizeless, "shapes that are left out of pictures, since a dimension is not above zero: %d",
         u->sizeless.count);
    note(u, &u->nothings, "inertias that are nothing but rounding, taken for zero: %d", u->nothings.count);
    note(u, &u->odd_links,
         "inertias that no body has, of links within rigid parts whose inertia is one of bodies (the scene has "
         "'inertia_check: accept'): %d",
         u->odd_links.count);
    note_odd_inertias(u);
    note(u, &u->by_density, "links without <inertial> that have mass and inertia of their shapes, by --density: %d",
         u->by_density.count);
    note(u, &u->rates, "joints whose limits of effort and speed are left out: %d", u->rates.count);
    note(u, &u->meshes, "meshes that are left out of pictures: %d", u->meshes.count);
    note(u, &u->shapes, "visuals that are left out of pictures, since a body has one shape: %d", u->shapes.count);
    note(u, &u->contacts, "collision shapes that are left out, since contacts are effects: %d", u->contacts.count);
    for (int i = 0; i < u->left_count; i++)
        kt_phrase_add(&unknown, "%s%s (%d)", i > 0 ? ", " : "", u->left[i].what, u->left[i].count);
    if (u->left_count > 0)
        note(u, &u->left[0],
             "elements and attributes that do not concern the motion, or are not known, are left out: %s",
             unknown.text);
    scene->notes = u->notes;
    scene->note_count = u->note_count;
}

static bool mark_scene(const kt_urdf *u, kt_scene *scene) {
    kt_pool *keep = &u->r->keep;
    kt_scene_marks *marks = kt_pool_take(keep, 1, sizeof *marks);
    kt_mark *bodies = kt_pool_take(keep, (size_t)u->link_count + 1, sizeof *bodies);
    kt_mark *loops = kt_pool_take(keep, (size_t)u->joint_count + 1, sizeof *loops);
    char *name = kt_pool_text(keep, u->path, strlen(u->path));
    if (marks == NULL || bodies == NULL || loops == NULL || name == NULL)
        return kt_reader_out_of_memory(u->r);
    for (int i = 0; i < scene->description.body_count; i++)
        bodies[i] = (kt_mark){u->body_elements[i]->line, u->body_elements[i]->column};
    for (int i = 0; i < scene->description.loop_count; i++)
        loops[i] = (kt_mark){u->loop_elements[i]->line, u->loop_elements[i]->column};
    *marks = (kt_scene_marks){.path = name, .bodies = bodies, .loops = loops};
    scene->marks = marks;
    return true;
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
    kt_urdf_judge_inertias(u);
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
    if (u->r->out_of_memory || u->r->fault_count > 0 || !mark_scene(u, scene))
        return;
    make_notes(u, root, scene);
}

static bool is_robot(kt_reader *r, const kt_element *root) {
    static const char *const others[][2] = {{"mujoco", "; this is MJCF, the format of MuJoCo, which is not read"},
                                            {"mujocoinclude", "; this is a part of a file in MJCF, which is not read"},
                                            {"sdf", "; this is SDF, the format of Gazebo, which is not read"}};
    const char *known = "";
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        known = strcmp(root->name, others[i][0]) == 0 ? others[i][1] : known;
    if (strcmp(root->name, "robot") != 0)
        return kt_fault_put(r, KT_ERROR_SCENE, root->line, root->column,
                            "a robot in URDF begins with <robot name=\"...\">, not with <%.40s>%s", root->name, known);
    for (const kt_element *e = root->first; e != NULL; e = e->next)
        if (strncmp(e->name, "xacro:", 6) == 0)
            return kt_fault_put(r, KT_ERROR_SCENE, e->line, e->column,
                                "<%.40s> is for the macro processor xacro; run it first, and read what it writes",
                                e->name);
    return true;
}

static void read_robot(kt_reader *r, const char *path, const char *text, size_t size, const void *options,
                       kt_scene *scene) {
    static const kt_urdf_options standard;
    kt_element *root = NULL;
    kt_xml_late late;
    if (!kt_xml_parse(r, text, size, &root, &late) || !is_robot(r, root))
        return;
    kt_urdf u = {.r = r, .options = options != NULL ? options : &standard, .robot = root, .path = path, .late = late};
    make_scene(&u, scene);
}

static kt_status check_options(const kt_urdf_options *o, kt_error *error) {
    if (o != NULL && ((unsigned)o->inertia > KT_URDF_INERTIA_ACCEPT || !(o->density >= 0.0) || !isfinite(o->density)))
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "",
            "inertia is %d, density %g; give one of kt_urdf_inertia, and a finite number, zero or above",
            (int)o->inertia, o->density);
    if (o == NULL || (isfinite(o->stop_stiffness) && o->stop_stiffness >= 0.0 && isfinite(o->stop_damping) &&
                      o->stop_damping >= 0.0))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_ARGUMENT, "",
                        "stiffness and damping of stops cannot be %g and %g; give finite "
                        "numbers, zero or above",
                        o->stop_stiffness, o->stop_damping);
}

kt_status kt_urdf_parse(const char *path, const char *text, size_t size, const kt_urdf_options *options,
                        kt_scene *scene, kt_scene_report *report, void *user, kt_error *error) {
    KT_REQUIRE(error, text || !size, scene);
    const kt_status status = check_options(options, error);
    return status != KT_OK ? status
                           : kt_format_parse(read_robot, options, path, text, size, scene, report, user, error);
}

kt_status kt_urdf_read(const char *path, const kt_urdf_options *options, kt_scene *scene, kt_scene_report *report,
                       void *user, kt_error *error) {
    KT_REQUIRE(error, path, scene);
    const kt_status status = check_options(options, error);
    return status != KT_OK ? status : kt_format_read(read_robot, options, path, scene, report, user, error);
}
