/* Models and worlds in SDF, the XML of Gazebo: links and joints to a description.
 *
 * Frames of the file and of included files come first, with their names and poses. Links and joints follow, then the
 * tree that spans them, then bodies, loops and forces. A joint starts at the position zero, unless <initial_position>
 * gives another.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <string.h>

/* ---- what is not known ------------------------------------------------------------------------------------------- */

/* Elements that are read, or that define joints and links, with their attributes. Sections that do not concern the
 * motion are counted as a whole. */
static const kt_known known[] = {
    {" sdf ", " version "},
    {" world link collision visual ", " name "},
    {" drake:proximity_properties drake:mu_static drake:mu_dynamic ", " "},
    {" model ", " name canonical_link placement_frame "},
    {" include ", " merge "},
    {" joint ", " name type "},
    {" frame ", " name attached_to "},
    {" pose ", " relative_to rotation_format degrees frame "},
    {" inertial ", " auto "},
    {" xyz ", " expressed_in "},
    {" mimic ", " joint axis "},
    {" gravity static uri name placement_frame mass density inertia ixx ixy ixz iyy iyz izz"
     " parent child axis axis2 use_parent_model_frame dynamics damping friction"
     " spring_reference spring_stiffness initial_position limit lower upper effort velocity"
     " multiplier offset reference thread_pitch screw_thread_pitch gearbox_ratio"
     " gearbox_reference_body kinematic geometry ",
     " "},
};

static const kt_known_list all_known = {
    known,
    sizeof known / sizeof *known,
    .apart = " surface ",
    .closed = " geometry ",
    .read = " self_collide material transparency cast_shadows state density viscosity ",
    .harmless =
        " surface sensor light scene physics gui audio spherical_coordinates magnetic_field atmosphere wind "
        "laser_retro max_contacts meta battery projector particle_emitter road grid audio_sink audio_source "
        "visibility_flags enable_metrics actor stiffness dissipation allow_auto_disable " KT_COMPLIANCE_OF_DRAKE,
    .moving = " plugin velocity_decay fluid_added_mass enable_wind population experimental:params " KT_MOVING_OF_DRAKE
              "drake:rotor_inertia "};

/* ---- notes ------------------------------------------------------------------------------------------------------- */

static const kt_note first_notes[] = {
    KT_NOTE(kt_sdf, newer, NAME, "versions of SDF that are newer than 1.12, read as if they were that:"),
    KT_NOTE(kt_sdf, older, DETAIL, "versions of SDF that are older than 1.4, converted to that:"),
    KT_NOTE(kt_sdf, others, START, "worlds and models after the first, which are left out:"),
    KT_NOTE(kt_sdf, missing, MOTION,
            "models that are neither in the model's folder nor on the search path nor where Gazebo keeps models of "
            "servers, left out:"),
    KT_NOTE(kt_sdf, unversioned, START,
            "models of a server in a given version; any version on the search path is taken:"),
    KT_NOTE(
        kt_sdf, renamed_models, START,
        "models before SDF 1.7 that have the name of another model, and are called NAME_1, NAME_2, ... in the scene:"),
    KT_NOTE(kt_sdf, states, START, "initial states of worlds (<state>) that are left out:"),
    KT_NOTE(kt_sdf, renamed, DETAIL, "names of bodies that a scene cannot have, with '_' or a number:"),
    KT_NOTE(kt_sdf, renamed_frames, DETAIL,
            "frames before SDF 1.7 that have the name of another item, and are called NAME_frame in the scene:"),
    KT_NOTE(kt_sdf, floating, START, "links that move freely, since no joint connects them with the world:"),
    KT_NOTE(kt_sdf, reserved, MOTION,
            "links with the name 'world', which is reserved: joints to 'world' hold the world, and these links are "
            "free; give them another name:"),
    KT_NOTE(kt_sdf, freed, START, "links that the file fixes to the world, and that --floating lets move freely:"),
    KT_NOTE(kt_sdf, at_rest, START, "links of static models, fixed to the world:"),
    KT_NOTE(kt_sdf, standard_masses, START,
            "links without a mass or an inertia, which take the defaults of the format (1 kg, 1 kg m^2; --density "
            "computes both from shapes):"),
    KT_NOTE(kt_sdf, by_density, DETAIL,
            "links without <inertial> that have mass and inertia of their collisions, by --density:"),
    KT_NOTE(kt_sdf, by_geometry, DETAIL, "links whose mass and inertia are those of their collisions:"),
};

static const kt_note later_notes[] = {
    KT_NOTE(kt_sdf, no_gravity, DETAIL, "links without gravity, each held by a force against its weight:"),
    KT_NOTE(kt_sdf, kinematic, MOTION, "kinematic links, which move as others do:"),
    KT_NOTE(kt_sdf, halves, DETAIL,
            "joints of two axes, each two joints with a body without mass between them, which has the joint's name:"),
    KT_NOTE(kt_sdf, offsets, DETAIL,
            "joints that are not at the origin of their link, on a body of their own, named after the joint:"),
    KT_NOTE(kt_sdf, reversed, DETAIL, "joints that carry their parent, since another joint carries the child:"),
    KT_NOTE(kt_sdf, loops, DETAIL, "joints that close loops:"),
    KT_NOTE(kt_sdf, loop_forces, MOTION,
            "joints whose damping, friction, springs and stops are left out, since they close loops and have several "
            "axes, or the name of another joint:"),
    KT_NOTE(kt_sdf, still_joints, DETAIL, "joints within one rigid part, left out:"),
    KT_NOTE(kt_sdf, gearboxes, DETAIL, "gearboxes, which are couplings of the joints between their links:"),
    KT_NOTE(kt_sdf, lost_gears, MOTION,
            "gearboxes that are left out, since joints between their links and the reference turn about other "
            "directions than the axes:"),
    KT_NOTE(kt_sdf, lost_mimics, MOTION,
            "mimics that are left out, since one of the two joints has no axis in the tree:"),
    KT_NOTE(kt_sdf, friction, MOTION, KT_NOTE_SMOOTH_FRICTION),
    KT_NOTE(kt_sdf, outside, START, "joints that start outside their limits:"),
    KT_NOTE(kt_sdf, disordered, START, "limits of position that are left out, since lower is above upper:"),
    KT_NOTE(kt_sdf, limits, MOTION, "limits of position, which do not act without --stops:"),
};

static const kt_note last_notes[] = {
    KT_NOTE(kt_sdf, pictures, DETAIL, "visuals that pictures do not have (planes, polylines ...), left out:"),
};

static void make_sdf_notes(const kt_sdf *m, kt_scene *scene) {
    kt_notes n;
    if (!kt_notes_begin(&n, m->r, m->source->path))
        return;
    KT_NOTES_PUT(&n, m, first_notes);
    kt_note_put(&n, KT_NOTE_RANK_MOTION, &m->lost_masses,
                "collisions that are meshes have no inertia in the scene, and without <mass> no mass: of %d link%s "
                "(%s); --mass LINK=MASS gives one",
                m->lost_masses.count, m->lost_masses.count > 1 ? "s" : "", m->massless_names.text);
    kt_inertia_notes(&n, &m->inertias);
    KT_NOTES_PUT(&n, m, later_notes);
    kt_appearance_notes(&n, &m->appearance);
    KT_NOTES_PUT(&n, m, last_notes);
    kt_collisions_notes(&n, &m->collisions, m->source->options, m->root, m->gravity);
    kt_note_renamed_joints(&n, &m->draft);
    kt_notes_end(&n, &m->strange, scene);
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

/* Gravity is that of the world, until 1.5 that of its physics. Without a world it is the format's. */
static void read_gravity(kt_sdf *m, const kt_element *world) {
    const kt_element *physics = world != NULL ? kt_xml_child(world, "physics") : NULL;
    m->gravity = kt_vec3_make(0.0, 0.0, -9.8);
    m->gravity = kt_sdf_vector(m, physics, "gravity", m->gravity);
    m->gravity = kt_sdf_vector(m, world, "gravity", m->gravity);
}

/* The first world, or the first model; others are counted. */
static const kt_element *choose(kt_sdf *m) {
    const kt_element *world = kt_xml_child(m->root, "world");
    const kt_element *chosen = world != NULL ? world : kt_xml_child(m->root, "model");
    for (const kt_element *e = m->root->first; e != NULL; e = e->next)
        if (e != chosen && (strcmp(e->name, "world") == 0 || strcmp(e->name, "model") == 0))
            kt_left_count(&m->others, e);
    if (chosen == NULL)
        (void)kt_robot_fault(m->r, m->root, "there is no <model> and no <world>");
    if (world != NULL)
        for (const kt_element *e = kt_xml_child(world, "state"); e != NULL; e = kt_xml_next(e, "state"))
            kt_left_count(&m->states, e);
    return chosen;
}

/* A world whose models were not found may have no bodies left. */
static void require_bodies(kt_sdf *m, const kt_element *chosen) {
    if (m->draft.bodies.count > 0 || m->missing.count == 0)
        return;
    const bool is_served = strncmp(m->missing.what, "https://", 8) == 0 || strncmp(m->missing.what, "http://", 7) == 0;
    (void)kt_robot_fault(m->r, chosen,
                         "no body is left, since its included models were not found: %d, the first is %s; name "
                         "their folder by GZ_SIM_RESOURCE_PATH, GAZEBO_MODEL_PATH or --search%s",
                         m->missing.count, m->missing.what,
                         is_served ? ", or open the world once in Gazebo, which keeps models of servers "
                                     "(GZ_FUEL_CACHE_PATH)"
                                   : "");
}

static void make_items(kt_sdf *m) {
    kt_sdf_read_joints(m);
    if (kt_draft_is_wrong(&m->draft) || !kt_namer_init(&m->draft.loop_names, m->r, 2 * m->frames.count + 2))
        return;
    kt_sdf_grow_tree(m);
    if (kt_draft_is_wrong(&m->draft))
        return;
    kt_sdf_make_bodies(m);
    kt_sdf_make_loops(m);
    if (kt_draft_is_wrong(&m->draft))
        return;
    kt_sdf_make_effects(m);
    kt_sdf_couple(m);
}

void kt_sdf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene) {
    kt_sdf m = {.r = r,
                .source = source,
                .root = (kt_element *)source->root,
                .known = &all_known,
                .draft = {.r = r, .root = source->root},
                .appearance = {.r = r, .source = source}};
    const int version = kt_sdf_version(&m, m.root);
    const kt_element *chosen = choose(&m);
    if (version == 0 || chosen == NULL)
        return;
    const bool is_world = strcmp(chosen->name, "world") == 0;
    read_gravity(&m, is_world ? chosen : NULL);
    kt_strange_search(&m.strange, &all_known, m.root);
    kt_sdf_collect(&m, chosen, is_world, version);
    if (kt_draft_is_wrong(&m.draft))
        return;
    kt_sdf_place(&m);
    if (kt_draft_is_wrong(&m.draft))
        return;
    make_items(&m);
    require_bodies(&m, chosen);
    if (kt_draft_is_wrong(&m.draft))
        return;
    kt_collisions_contacts(&m.collisions, &m.draft, source, m.gravity);
    scene->description.gravity = m.gravity;
    scene->description.inertia_check = m.inertias.limit;
    if (kt_draft_finish(&m.draft, &m.appearance, kt_xml_attribute(chosen, "name"), scene))
        make_sdf_notes(&m, scene);
}
