/* Robots in the Unified Robot Description Format: links and joints of XML to bodies of a description.
 *
 * A link of URDF is a body of ours. The joint with this link as child is the body's joint: both frames are the same. As
 * in our descriptions, `origin` gives the joint's frame in the parent link, and the axis is in the joint's frame.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/urdf.h"

#include <string.h>

/* ---- the scene --------------------------------------------------------------------------------------------------- */

static const kt_note link_notes[] = {
    KT_NOTE(kt_urdf, undeclared, START, "no link 'world' is declared; this parent is taken for the world"),
    KT_NOTE(kt_urdf, freed, START, "links that the file fixes to the world, and that --floating lets move freely:"),
};

static const kt_note joint_notes[] = {
    KT_NOTE(kt_urdf, renamed, DETAIL,
            "names of links that are not valid names of bodies, with '_' in place of invalid characters:"),
    KT_NOTE(kt_urdf, starts, START, "joints that start at a limit, since zero is outside their limits:"),
    KT_NOTE(kt_urdf, limits, MOTION, "limits of position, which do not act without --stops:"),
    KT_NOTE(kt_urdf, disordered, START, "joints whose limits of position are left out, since lower is above upper:"),
    KT_NOTE(kt_urdf, followers, START, "joints that follow other joints, and therefore do not start at zero:"),
    KT_NOTE(kt_urdf, beyond, START, "joints that start beyond their own limits, since they follow others:"),
    KT_NOTE(kt_urdf, fixed_mimics, DETAIL,
            "mimics that are left out, since the joint or the one that it follows is fixed:"),
};

static const kt_note mass_notes[] = {
    KT_NOTE(kt_urdf, by_density, DETAIL,
            "links without <inertial> that have mass and inertia of their shapes, by --density:"),
    KT_NOTE(kt_urdf, by_geoms, DETAIL,
            "links that have mass and inertia of their collisions, by 'inertiafromgeom' of <mujoco>:"),
    KT_NOTE(kt_urdf, hollow, MOTION,
            "meshes of links that have mass and inertia of their shapes, left out of the mass, since they cannot be "
            "read or are not closed:"),
    KT_NOTE(kt_urdf, doubled, MOTION, "links with several <inertial>, of which the first counts:"),
    KT_NOTE(kt_urdf, bounded, DETAIL, "masses and inertias raised to the least of 'boundmass' and 'boundinertia':"),
    KT_NOTE(kt_urdf, balanced, DETAIL, "impossible inertias, which 'balanceinertia' makes those of spheres:"),
    KT_NOTE(kt_urdf, massless, MOTION,
            "no link has a mass, so that only positions, pictures and degrees of freedom can be computed (--density "
            "computes masses from shapes, --mass LINK=MASS sets one mass)"),
    KT_NOTE(kt_urdf, geared, DETAIL, "transmissions whose rotor inertia became the joint's armature:"),
    KT_NOTE(kt_urdf, words, DETAIL,
            "transmissions with a reduction or an inertia that is no number, which is left out:"),
    KT_NOTE(kt_urdf, ungeared, DETAIL, "transmissions that are left out, since they have no rotor inertia:"),
    KT_NOTE(kt_urdf, rates, START,
            "limits of effort or speed that are left out, since they are no numbers, or below zero:"),
    KT_NOTE(kt_urdf, no_gravity, DETAIL, "links without gravity, each held by a force against its weight:"),
    KT_NOTE(kt_urdf, scales, DETAIL, "scales of meshes that are not three numbers, taken as 1:"),
};

static const kt_note last_notes[] = {
    KT_NOTE(kt_urdf, shapes, DETAIL, "visuals without a geometry that is known, left out of pictures:"),
};

/* An element or a meaning that another version adds would be missed: urdfdom rejects such a file. */
static void note_version(kt_notes *n, const kt_urdf *u) {
    const char *version = kt_xml_attribute(u->robot, "version");
    if (version != NULL && strcmp(version, "1.0") != 0 && strcmp(version, "1.1") != 0)
        kt_note_put(n, KT_NOTE_RANK_START, &(kt_left){.first = u->robot, .count = 1},
                    "version %s of URDF is not known; the file is read as version 1.1", kt_name_quote(version).text);
}

static void note_root(kt_notes *n, const kt_urdf *u, int root) {
    const kt_left base = {.first = u->links[root].element, .count = u->links[root].body != NULL};
    kt_note_put(n, KT_NOTE_RANK_START, &base, "link %s %s, gravity is %s",
                kt_name_quote(kt_xml_attribute(base.first, "name")).text,
                u->source->options->floating ? "moves freely" : "is fixed to the world (--floating lets it move)",
                u->has_gravity ? "that of <mujoco>" : "9.81 m/s^2 along -z");
    if (u->source->late.line > 0) {
        const kt_element declaration = {.line = u->source->late.line, .column = u->source->late.column};
        kt_note_put(n, KT_NOTE_RANK_DETAIL, &(kt_left){.first = &declaration, .count = 1},
                    "the XML declaration is not at the beginning of the file, where other readers expect it");
    }
    KT_NOTES_PUT(n, u, link_notes);
    if (u->source->options->floating && kt_urdf_is_world(u, root) && u->freed.count == 0)
        kt_note_put(n, KT_NOTE_RANK_START, &(kt_left){.first = u->links[root].element, .count = 1},
                    "--floating frees nothing: no link is fixed to the world");
}

/* Makes a note of each kind of change or omission. */
static void make_urdf_notes(const kt_urdf *u, int root, kt_scene *scene) {
    kt_notes n;
    if (!kt_notes_begin(&n, u->r, u->source->path))
        return;
    note_root(&n, u, root);
    note_version(&n, u);
    KT_NOTES_PUT(&n, u, joint_notes);
    kt_inertia_notes(&n, &u->inertias);
    KT_NOTES_PUT(&n, u, mass_notes);
    kt_appearance_notes(&n, &u->appearance);
    KT_NOTES_PUT(&n, u, last_notes);
    kt_collisions_notes(&n, &u->collisions, u->source->options, u->robot, u->gravity);
    kt_note_renamed_joints(&n, &u->draft);
    kt_notes_end(&n, &u->strange, scene);
}

static void make_scene(kt_urdf *u, kt_scene *scene) {
    if (!kt_urdf_collect(u))
        return;
    kt_urdf_read_extensions(u);
    const int root = kt_urdf_root(u);
    kt_urdf_names(u, root);
    kt_urdf_bodies(u);
    if (kt_draft_is_wrong(&u->draft))
        return;
    kt_inertias_check(&u->inertias, &u->draft, u->source->options);
    kt_urdf_given_masses(u);
    kt_urdf_extend(u);
    kt_collisions_contacts(&u->collisions, &u->draft, u->source, u->gravity);
    scene->description.gravity = u->gravity;
    scene->description.inertia_check = u->inertias.limit;
    if (kt_draft_finish(&u->draft, &u->appearance, kt_xml_attribute(u->robot, "name"), scene))
        make_urdf_notes(u, root, scene);
}

void kt_urdf_scene(kt_reader *r, const kt_robot_source *source, kt_scene *scene) {
    kt_urdf u = {.r = r,
                 .source = source,
                 .draft = {.r = r, .root = source->root, .has_link_places = true},
                 .appearance = {.r = r, .source = source},
                 .robot = source->root};
    make_scene(&u, scene);
}
