/* Models in MJCF, the XML of MuJoCo: bodies, joints and equalities to a description.
 *
 * Included files and attached models come first, with the compiler's settings. Default classes follow.
 * Classes and settings determine the meaning of all other attributes. Bodies, joints and masses come next, then the
 * start, then the remaining items of the scene.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

/* ---- notes ------------------------------------------------------------------------------------------------------- */

static const kt_note body_notes[] = {
    KT_NOTE(kt_mjcf, renamed, DETAIL, "names of bodies that a scene cannot have, with '_' or a number:"),
    KT_NOTE(kt_mjcf, fixed_bodies, START, "bodies that are fixed to the world (--floating lets them move):"),
    KT_NOTE(kt_mjcf, freed, START, "bodies that the file fixes to the world, and that --floating lets move freely:"),
    KT_NOTE(kt_mjcf, several, DETAIL,
            "joints after the first of a body, each on a body of its own without mass, which has the joint's name:"),
    KT_NOTE(kt_mjcf, offsets, DETAIL,
            "joints that are not at the origin of their body, on a body of their own, named after the joint:"),
    KT_NOTE(kt_mjcf, attached, MOTION,
            "bodies of this model that it attaches again (attach without a model), left out:"),
    KT_NOTE(kt_mjcf, incomplete, MOTION,
            "tendons, equalities and actuators that are left out, since they refer to parts that are not attached:"),
    KT_NOTE(kt_mjcf, lost_settings, MOTION,
            "attached models with settings for a whole model (option, settotalmass); the settings of this model apply "
            "instead:"),
    KT_NOTE(kt_mjcf, mocap, START, "bodies that a program moves (mocap), fixed to the world:"),
    KT_NOTE(kt_mjcf, keys, START, "keyframes, none of which is used as the start (import --keyframe NAME uses one):"),
    KT_NOTE(kt_mjcf, by_density, DETAIL, "geoms without a mass and a density, which take the density of --density:"),
    KT_NOTE(kt_mjcf, by_geoms, DETAIL, "bodies whose mass and inertia are those of their geoms:"),
};

static const kt_note force_notes[] = {
    KT_NOTE(kt_mjcf, mesh_files, DETAIL, "meshes that cannot be read, or enclose nothing:"),
    KT_NOTE(kt_mjcf, builtins, MOTION,
            "surfaces that MuJoCo has built in, left out; its mj_saveLastXML writes their vertices:"),
    KT_NOTE(kt_mjcf, bounded, DETAIL, "masses and inertias raised to the least of 'boundmass' and 'boundinertia':"),
    KT_NOTE(kt_mjcf, balanced, DETAIL, "impossible inertias, which 'balanceinertia' makes those of spheres:"),
    KT_NOTE(kt_mjcf, soft, MOTION, "soft equalities, which are exact loops in the scene:"),
    KT_NOTE(
        kt_mjcf, armatures, MOTION,
        "armatures of spatial tendons that are left out: MuJoCo rejects paths around geoms, and the others have too "
        "many parts or a part without a length:"),
    KT_NOTE(kt_mjcf, tied_paths, DETAIL,
            "spatial tendons with an armature, each a body without mass that a coupling moves:"),
    KT_NOTE(kt_mjcf, branches, MOTION,
            "tendons whose armature couples branches of the tree, a part of the inertia that MuJoCo leaves out:"),
    KT_NOTE(kt_mjcf, scaled, MOTION,
            "welds with a torquescale other than 0 and 1, whose weak or strong torques are exact in the scene:"),
    KT_NOTE(kt_mjcf, disabled, DETAIL,
            "what flags of <option> turn off is left out (springs, dampers, dry friction, limits, equalities, "
            "actuators, limits of controls)"),
    KT_NOTE(kt_mjcf, idle, DETAIL, "actuators that flags or 'actuatorgroupdisable' turn off, left out:"),
    KT_NOTE(kt_mjcf, idle_ties, DETAIL, "equalities that flags turn off, left out:"),
    KT_NOTE(kt_mjcf, inactive, DETAIL, "equalities that are not active, left out:"),
    KT_NOTE(kt_mjcf, tied, DETAIL, "fixed tendons of several joints, each a body without mass that a coupling moves:"),
    KT_NOTE(kt_mjcf, friction, MOTION, KT_NOTE_SMOOTH_FRICTION),
    KT_NOTE(kt_mjcf, motors, START, "motors, whose torque is that of the control at the start (0 without --keyframe):"),
    KT_NOTE(kt_mjcf, servos, START, "servos, whose target is that of the control at the start (0 without --keyframe):"),
    KT_NOTE(kt_mjcf, activations, START,
            "activations of actuators, which are auxiliary states and follow the control at the start:"),
    KT_NOTE(kt_mjcf, sums, START,
            "joints in which actuators act by a formula, with the control at the start, since the sum of their "
            "forces is bounded, their stiffness or damping is below zero, or they are muscles:"),
    KT_NOTE(kt_mjcf, limits, MOTION, "limits of position, which do not act without --stops:"),
    KT_NOTE(kt_mjcf, soft_stops, START, KT_NOTE_SOFT_STOPS),
    KT_NOTE(kt_mjcf, lost_limits, START, "limits of ball joints that are left out:"),
    KT_NOTE(kt_mjcf, fluid, MOTION, "bodies with geoms of fluidshape=\"ellipsoid\", on which no medium acts:"),
};

static const kt_note last_notes[] = {
    KT_NOTE(kt_mjcf, pictures, DETAIL,
            "geoms that are left out of pictures, since they are the world's, or planes, or meshes that a scene "
            "cannot place:"),
};

static const kt_note contact_notes[] = {
    KT_NOTE(kt_mjcf, touched.lost, MOTION,
            "geoms that touch planes, left out, since they have no mesh that can be read, no mass, or a solref without "
            "stiffness:"),
    KT_NOTE(kt_mjcf, touched.made, START, KT_NOTE_STIFF),
    KT_NOTE(kt_mjcf, touched.floors, START, KT_NOTE_FLOORS),
    KT_NOTE(kt_mjcf, touched.rounded, MOTION, KT_NOTE_ROUNDED),
    KT_NOTE(kt_mjcf, touched.rough, MOTION, KT_NOTE_ROUGH),
    KT_NOTE(kt_mjcf, contacts_between, MOTION, "geoms that could touch other geoms than planes, left out:"),
};

static bool is_flying(const kt_mjcf *m) {
    bool is_free = m->freed.count > 0;
    for (int i = 0; i < m->joints.count; i++)
        is_free = is_free || kt_mjcf_joint_at(m, i)->type == KT_MJCF_FREE;
    return is_free;
}

static void note_contacts(kt_notes *n, const kt_mjcf *m) {
    if (!m->source->options->contacts && is_flying(m) && kt_vec3_norm(m->gravity) > 0.0)
        kt_note_falling(n, &m->contacts, m->gravity);
    else if (!m->source->options->contacts)
        kt_note_put(n, KT_NOTE_RANK_START, &m->contacts,
                    "geoms that could touch others, left out, since contacts are effects: %d", m->contacts.count);
    kt_note_put(n, KT_NOTE_RANK_DETAIL, &m->touched.made, "geoms that can touch the planes, %d in number: %d",
                m->touched.planes.count, m->touched.made.count);
    KT_NOTES_PUT(n, m, contact_notes);
    if (m->source->options->contacts && m->touched.planes.count == 0 && is_flying(m) && kt_vec3_norm(m->gravity) > 0.0)
        kt_note_groundless(n, m->root);
    kt_note_sunk(n, m->root, m->touched.depth);
}

static void note_mesh_masses(kt_notes *n, const kt_mjcf *m) {
    const char *reason = m->mesh_files.count > 0 ? m->mesh_files.what
                         : m->builtins.count > 0 ? "MuJoCo has it built in"
                                                 : "a field of heights without a size";
    kt_note_put(
        n, KT_NOTE_RANK_MOTION, &m->mesh_masses,
        "the mass of geoms is missing in %d bod%s (%s), since the mesh has none (%s); --mass BODY=MASS gives one",
        m->mesh_masses.count, m->mesh_masses.count > 1 ? "ies" : "y", m->massless_names.text, reason);
}

static void make_mjcf_notes(const kt_mjcf *m, kt_scene *scene) {
    kt_notes n;
    if (!kt_notes_begin(&n, m->r, m->source->path))
        return;
    KT_NOTES_PUT(&n, m, body_notes);
    note_mesh_masses(&n, m);
    KT_NOTES_PUT(&n, m, force_notes);
    kt_note_each(&n, &m->changes, "", "");
    kt_note_put(&n, KT_NOTE_RANK_DETAIL, &m->unnamed_sites,
                "sites that are no markers, since they have no name or are the world's: %d", m->unnamed_sites.count);
    kt_appearance_notes(&n, &m->appearance);
    KT_NOTES_PUT(&n, m, last_notes);
    note_contacts(&n, m);
    kt_note_each(&n, &m->forces, "a force or an equality that is left out, ", "");
    kt_note_renamed_joints(&n, &m->draft);
    kt_notes_end(&n, &m->strange, scene);
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

static bool init_names(kt_mjcf *m) {
    return kt_robot_names(m->r, &m->names, 2 * (size_t)m->elements + 2) && /* tendons have two names */
           kt_namer_init(&m->bodies_named, m->r, 5 * m->elements + 2) &&
           kt_namer_init(&m->draft.loop_names, m->r, 2 * m->elements + 2) &&
           kt_namer_init(&m->states_named, m->r, m->elements + 2) &&
           kt_namer_init(&m->joints_named, m->r, 7 * m->elements + 4) &&
           kt_namer_init(&m->effects_named, m->r,
                         (m->source->options->contacts ? KT_CONTACT_POINTS_MOST + 1 : 1) * (m->elements + 2));
}

/* Prepares the tree of elements (files, attached models), the names, the classes and the options. */
static bool prepare(kt_mjcf *m) {
    kt_mjcf_expand(m);
    if (kt_draft_is_wrong(&m->draft) || !init_names(m))
        return false;
    kt_mjcf_classes(m);
    kt_mjcf_read_options(m);
    kt_mjcf_count_strange(m);
    return !kt_draft_is_wrong(&m->draft);
}

void kt_mjcf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene) {
    kt_mjcf m = {.r = r,
                 .source = source,
                 .root = (kt_element *)source->root,
                 .draft = {.r = r, .root = source->root},
                 .appearance = {.r = r, .source = source}};
    static const kt_inertia_limit limits[] = {KT_INERTIA_WARN, KT_INERTIA_STRICT, KT_INERTIA_ACCEPT};
    if (!prepare(&m))
        return;
    kt_mjcf_collect(&m);
    if (kt_draft_is_wrong(&m.draft))
        return;
    kt_mjcf_mark_incomplete(&m);
    kt_mjcf_start(&m);
    kt_mjcf_make_bodies(&m);
    kt_mjcf_read_tendons(&m);
    kt_mjcf_find_inertias(&m);
    kt_mjcf_passive(&m);
    kt_mjcf_make_tendons(&m);
    kt_mjcf_actuators(&m);
    kt_mjcf_equalities(&m);
    kt_mjcf_contacts(&m);
    if (kt_draft_is_wrong(&m.draft))
        return;
    scene->description.gravity = m.gravity;
    scene->description.inertia_check = limits[source->options->inertia];
    if (kt_draft_finish(&m.draft, &m.appearance, kt_xml_attribute(m.root, "model"), scene))
        make_mjcf_notes(&m, scene);
}
