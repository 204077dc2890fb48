/* Models in MJCF, the XML of MuJoCo: bodies, joints and equalities to a description.
 *
 * Included files and attached models come first, with the compiler's settings. Default classes follow.
 * Classes and settings determine the meaning of all other attributes. Bodies, joints and masses come next, then the
 * start, then the remaining items of the scene.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

/* ---- notes ------------------------------------------------------------------------------------------------------- */

#define MJCF_NOTE(name, rank, text) KT_NOTE(kt_mjcf, notes.name, rank, text),
static const kt_note body_notes[] = {KT_MJCF_BODY_NOTES(MJCF_NOTE)};
static const kt_note force_notes[] = {KT_MJCF_FORCE_NOTES(MJCF_NOTE)};
static const kt_note geom_notes[] = {KT_MJCF_GEOM_NOTES(MJCF_NOTE)};
#undef MJCF_NOTE

static const kt_note contact_notes[] = {
    KT_NOTE(kt_mjcf, touched.lost, MOTION,
            "geoms that touch planes, left out, since they have no mesh that can be read, no mass, or a solref without "
            "stiffness:"),
    KT_NOTE(kt_mjcf, touched.made, START, KT_NOTE_STIFF),
    KT_NOTE(kt_mjcf, touched.floors, START, KT_NOTE_FLOORS),
    KT_NOTE(kt_mjcf, touched.rounded, MOTION, KT_NOTE_ROUNDED),
    KT_NOTE(kt_mjcf, touched.rough, MOTION, KT_NOTE_ROUGH),
    KT_NOTE(kt_mjcf, notes.contacts_off, MOTION,
            "no geom touches another in spite of --contacts, since a flag of <option> turns contacts off"),
    KT_NOTE(kt_mjcf, notes.contacts_between, MOTION, "geoms that could touch other geoms than planes, left out:"),
};

static bool is_flying(const kt_mjcf *m) {
    bool is_free = m->notes.freed.count > 0;
    for (int i = 0; i < m->joints.count; i++)
        is_free = is_free || kt_mjcf_joint_at(m, i)->type == KT_MJCF_FREE;
    return is_free;
}

static void note_contacts(kt_notes *n, const kt_mjcf *m) {
    if (!m->source->options->contacts && is_flying(m) && kt_vec3_norm(m->gravity) > 0.0)
        kt_note_falling(n, &m->notes.contacts, m->gravity);
    else if (!m->source->options->contacts)
        kt_note_put(n, KT_NOTE_RANK_START, &m->notes.contacts,
                    "geoms that could touch others, left out, since contacts are effects: %d", m->notes.contacts.count);
    kt_note_put(n, KT_NOTE_RANK_DETAIL, &m->touched.made, "geoms that can touch the planes, %d in number: %d",
                m->touched.planes.count, m->touched.made.count);
    KT_NOTES_PUT(n, m, contact_notes);
    if (m->source->options->contacts && !m->off.contacts && m->touched.planes.count == 0 && is_flying(m) &&
        kt_vec3_norm(m->gravity) > 0.0)
        kt_note_groundless(n, m->root);
    kt_note_sunk(n, m->root, m->touched.depth);
}

static void note_mesh_masses(kt_notes *n, const kt_mjcf *m) {
    const char *reason = m->notes.mesh_files.count > 0 ? m->notes.mesh_files.what
                         : m->notes.builtins.count > 0 ? "MuJoCo has it built in"
                                                       : "a field of heights without a size";
    kt_note_put(
        n, KT_NOTE_RANK_MOTION, &m->notes.mesh_masses,
        "the mass of geoms is missing in %d bod%s (%s), since the mesh has none (%s); --mass BODY=MASS gives one",
        m->notes.mesh_masses.count, m->notes.mesh_masses.count > 1 ? "ies" : "y", m->massless_names.text, reason);
}

static void make_mjcf_notes(const kt_mjcf *m, kt_scene *scene) {
    kt_notes n;
    if (!kt_notes_begin(&n, m->r, m->source->path))
        return;
    KT_NOTES_PUT(&n, m, body_notes);
    note_mesh_masses(&n, m);
    KT_NOTES_PUT(&n, m, force_notes);
    kt_note_each(&n, &m->changes, "", "");
    kt_note_put(&n, KT_NOTE_RANK_DETAIL, &m->notes.unnamed_sites,
                "sites that are no markers, since they have no name or are the world's: %d",
                m->notes.unnamed_sites.count);
    kt_appearance_notes(&n, &m->appearance);
    KT_NOTES_PUT(&n, m, geom_notes);
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
