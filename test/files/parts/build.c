/* A builder: beams against closed forms and against the same beams in scene files, trees against the places of their
 * links, and what is rejected. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "files/scene/collect.h"

#include "kinetree/analysis.h"
#include "kinetree/build.h"
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

static bool is_fine(const char *what, kt_status status, const kt_error *e) {
    if (status != KT_OK)
        kt_note("%s: %s", e->where, e->message);
    return status == KT_OK || kt_check_true(what, false);
}

/* ---- beams ------------------------------------------------------------------------------------------------------- */

static kt_beam plane_beam(int segments) {
    kt_beam beam = kt_beam_default();
    beam.name = "b";
    beam.segments = segments;
    beam.length = 1.0;
    beam.mass.value = 1.0;
    beam.EI[1].value = 1.0;
    return beam;
}

/* The lowest frequency of a beam on its own, rad/s. */
static double lowest_frequency(const kt_beam *beam) {
    double q[64], v[64], lowest = (double)NAN;
    kt_builder *builder = NULL;
    kt_model *model = NULL;
    kt_linearization *linearization = NULL;
    kt_modes *modes = NULL;
    kt_error e = {0};
    bool good = is_fine("builder", kt_builder_create(&builder, &e), &e) &&
                is_fine("beam", kt_builder_add_beam(builder, beam, &e), &e);
    const kt_description description = kt_builder_describe(builder);
    good = good && is_fine("model", kt_model_compile(&description, NULL, &model, &e), &e) &&
           is_fine("linearisation", kt_linearization_create(model, NULL, &linearization, &e), &e) &&
           is_fine("modes", kt_modes_create(model, &modes, &e), &e);
    if (good)
        kt_model_initial(model, q, v);
    if (good && is_fine("linearised", kt_linearization_evaluate(linearization, 0.0, q, v, NULL, &e), &e) &&
        is_fine("their modes", kt_modes_evaluate(modes, kt_linearization_system(linearization), &e), &e))
        for (int i = kt_modes_count(modes) - 1; i >= 0; i--)
            if (kt_modes_at(modes, i).imaginary > 1e-3)
                lowest = kt_modes_at(modes, i).imaginary;
    kt_modes_free(modes);
    kt_linearization_free(linearization);
    kt_model_free(model);
    kt_builder_free(builder);
    return lowest;
}

/* The root of 1 + cos x cosh x = 0, squared [S. Timoshenko, Vibration Problems in Engineering]. The error of n segments
 * is of the order 1 / n^2. */
KT_TEST(a_cantilever_has_eulers_frequency) {
    const double exact = 3.51601526850015;
    const kt_beam coarse = plane_beam(20), fine = plane_beam(40);
    const double far = lowest_frequency(&coarse) - exact, near = lowest_frequency(&fine) - exact;
    kt_check_near("40 segments", near, 0.0, 2e-3);
    kt_check_near("the order", log2(far / near), 2.0, 0.05);
}

/* The text of the scene that a builder describes. */
static const char *text_of_builder(const kt_builder *builder) {
    kt_scene scene = kt_scene_default();
    scene.description = kt_builder_describe(builder);
    return kt_test_written(&scene);
}

static void check_against_scene(const char *what, const kt_beam *beam, const char *text) {
    kt_builder *builder = NULL;
    kt_error e = {0};
    const kt_marker rim = {.name = "rim", .at = {0.1, 0.0, 0.0}, .rotation = kt_rotation_rpy(0.0, 0.0, 0.3)};
    kt_body hub = kt_body_of("hub", NULL, KT_JOINT_REVOLUTE, 2.0);
    hub.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    hub.markers = &rim;
    hub.marker_count = 1;
    if (is_fine("builder", kt_builder_create(&builder, &e), &e) &&
        is_fine("hub", kt_builder_add_body(builder, &hub, &e), &e) &&
        is_fine("beam", kt_builder_add_beam(builder, beam, &e), &e))
        kt_check_text(what, text_of_builder(builder), kt_test_written(kt_test_scene(text)));
    kt_builder_free(builder);
}

#define HUB                                                                                                            \
    "kinetree: 1\nbodies:\n  - {name: hub, mass: 2, inertia: [1, 1, 1], joint: {type: revolute}, markers: "            \
    "{rim: {at: [0.1, 0, 0], rotation: {rpy: [0, 0, 0.3]}}}}\nbeams:\n"

/* A scene reads its beams through the nodes of a file, where numbers and ends have other ways. */
KT_TEST(beams_of_c_are_those_of_scene_files) {
    static const double mass[] = {0.5, 0.4, 0.3}, bending[] = {50.0, 45.0};
    kt_beam a = kt_beam_default(), b = plane_beam(3), c = kt_beam_default();
    a.name = "a";
    a.from.body = "hub";
    a.from.marker = "rim";
    a.segments = 4;
    a.length = 1.0;
    a.mass = (kt_beam_property){.stations = mass, .station_count = 3};
    a.EA.value = 1e5;
    a.GA[0].value = a.GA[1].value = 4e4;
    a.GJ.value = 30.0;
    a.EI[0].value = 60.0;
    a.EI[1] = (kt_beam_property){.stations = bending, .station_count = 2};
    a.curvature = kt_vec3_make(0.1, 0.2, 0.3);
    a.damping = 1e-3;
    check_against_scene(
        "stretches, from a marker", &a,
        HUB "  - {name: a, from: hub.rim, segments: 4, length: 1, mass_per_length: [0.5, 0.4, 0.3], EA: 1e5, "
            "GA: [4e4, 4e4], GJ: 30, EI: [[60, 50], [60, 45]], curvature: [0.1, 0.2, 0.3], damping: "
            "1e-3}\n");
    b.ends[0] = KT_BEAM_FREE;
    b.curvature.z = 0.5;
    check_against_scene("free in a plane", &b,
                        HUB "  - {name: b, ends: [free, free], segments: 3, length: 1, mass_per_length: 1, EI: 1, "
                            "curvature: [0, 0, 0.5]}\n");
    c = a;
    c.name = "c";
    c.from = kt_end_default();
    c.to.at = kt_vec3_make(0.9, 0.0, 0.1);
    c.ends[0] = KT_BEAM_HINGED;
    c.ends[1] = KT_BEAM_CLAMPED;
    c.mass = (kt_beam_property){.value = 0.3};
    c.EA.value = c.GA[0].value = c.GA[1].value = 0.0;
    c.EI[1] = (kt_beam_property){.value = 50.0};
    c.polar_inertia = 1e-4;
    check_against_scene(
        "keeps its length, closed by a loop", &c,
        HUB "  - {name: c, to: {body: world, at: [0.9, 0, 0.1]}, ends: [hinged, clamped], segments: 4, length: "
            "1, mass_per_length: 0.3, GJ: 30, EI: [60, 50], inertia_per_length: 1e-4, curvature: [0.1, "
            "0.2, 0.3], damping: 1e-3}\n");
}

/* ---- trees ------------------------------------------------------------------------------------------------------- */

/* Links 2, 3, 4 of a tree of branching 3 lie on link 1, and 5 and 6 on link 2. Each of them is turned by -45, 0 or
 * 45 degrees against its parent, and has its tip one length further on. */
KT_TEST(links_of_a_tree_lie_on_the_ends_of_their_parents) {
    static const double turn[6] = {0.0, -0.25, 0.0, 0.25, -0.5, -0.25};
    static const int parent[6] = {-1, 0, 0, 0, 1, 1};
    double x[6], y[6];
    kt_link_tree tree = kt_link_tree_default();
    kt_builder *builder = NULL;
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_error e = {0};
    tree.name = "link";
    tree.count = 6;
    tree.branching = 3;
    tree.end = kt_vec3_make(2.0, 0.0, 0.0);
    tree.link.joint.type = KT_JOINT_REVOLUTE;
    tree.link.mass = 1.0;
    tree.link.com = tree.end;
    bool good = is_fine("builder", kt_builder_create(&builder, &e), &e) &&
                is_fine("tree", kt_builder_add_tree(builder, &tree, &e), &e);
    const kt_description description = kt_builder_describe(builder);
    good = good && is_fine("model", kt_model_compile(&description, NULL, &model, &e), &e) &&
           is_fine("data", kt_data_create(model, &data, &e), &e);
    if (good) {
        const double q[6] = {0.0};
        kt_check_equal_int("links", kt_model_body_count(model) - 1, 6);
        good = is_fine("poses", kt_kinematics_update(model, data, q, NULL, NULL, &e), &e);
    }
    for (int i = 0; good && i < 6; i++) {
        const int p = parent[i];
        x[i] = (p < 0 ? 0.0 : x[p]) + 2.0 * cos(pi * turn[i]);
        y[i] = (p < 0 ? 0.0 : y[p]) + 2.0 * sin(pi * turn[i]);
        char name[8] = {'l', 'i', 'n', 'k', (char)('1' + i), '\0'};
        const kt_vec3 tip = kt_point_position(model, data, kt_body_find(model, name), tree.end);
        kt_check_near("x", tip.x, x[i], 1e-14);
        kt_check_near("y", tip.y, y[i], 1e-14);
    }
    kt_data_free(data);
    kt_model_free(model);
    kt_builder_free(builder);
}

/* The array of bodies moves as it grows, also while a body of it is added once more. */
KT_TEST(a_body_that_was_added_can_be_added_again) {
    kt_builder *builder = NULL;
    kt_error e = {0};
    kt_body body = kt_body_default();
    body.mass = 3.0;
    if (!is_fine("builder", kt_builder_create(&builder, &e), &e) ||
        !is_fine("body", kt_builder_add_body(builder, &body, &e), &e))
        return;
    void *fence[100]; /* behind the array, which thus cannot grow in its place */
    for (int i = 0; i < 100; i++) {
        fence[i] = malloc(4096);
        (void)is_fine("again", kt_builder_add_body(builder, kt_builder_body(builder, 0), &e), &e);
    }
    for (int i = 0; i < 100; i++)
        free(fence[i]);
    int equal = 0;
    for (int i = 0; i <= 100; i++)
        equal += kt_builder_body(builder, i)->mass == 3.0;
    kt_check_equal_int("bodies with its mass", equal, 101);
    kt_builder_free(builder);
}

KT_TEST(bodies_can_be_changed_until_they_are_described) {
    kt_builder *builder = NULL;
    kt_error e = {0};
    kt_link_tree tree = kt_link_tree_default();
    tree.name = "link";
    tree.count = 2;
    if (!is_fine("builder", kt_builder_create(&builder, &e), &e) ||
        !is_fine("tree", kt_builder_add_tree(builder, &tree, &e), &e))
        return;
    kt_builder_body(builder, 1)->mass = 7.0;
    kt_check_near("the mass in the description", kt_builder_describe(builder).bodies[1].mass, 7.0, 0.0);
    kt_check_true("there is no body 2", kt_builder_body(builder, 2) == NULL && kt_builder_body(builder, -1) == NULL);
    kt_builder_free(builder);
}

/* ---- what is wrong ----------------------------------------------------------------------------------------------- */

static void check_rejected(const kt_beam *beam, const char *where, const char *message) {
    kt_builder *builder = NULL;
    kt_error e = {0};
    if (!is_fine("builder", kt_builder_create(&builder, &e), &e))
        return;
    kt_check_equal_int("status", kt_builder_add_beam(builder, beam, &e), KT_ERROR_MODEL);
    kt_check_text("where", e.where, where);
    kt_check_text("message", e.message, message);
    kt_check_equal_int("bodies that were added", kt_builder_describe(builder).body_count, 0);
    kt_builder_free(builder);
}

KT_TEST(what_makes_no_beam_is_rejected) {
    static const double falling[] = {1.0, 0.5, -0.1};
    kt_beam beam = plane_beam(1);
    check_rejected(&beam, "beam 'b'", "segments: 1: segments are a whole number, 2 to 10000");
    beam = plane_beam(4);
    beam.length = (double)NAN;
    check_rejected(&beam, "beam 'b'", "length: nan m must be above zero and finite");
    beam = plane_beam(4);
    beam.mass = (kt_beam_property){.stations = falling, .station_count = 3};
    check_rejected(&beam, "beam 'b'", "mass_per_length: station 2: -0.1 must be above zero and finite");
    beam.mass.station_count = 1;
    check_rejected(&beam, "beam 'b'", "mass_per_length: 1 stations along the beam; there must be two or more");
    beam = plane_beam(4);
    beam.mass.value = 0.0;
    check_rejected(&beam, "beam 'b'", "the mass per length is missing");
    beam = plane_beam(4);
    beam.EI[1].value = 0.0;
    check_rejected(&beam, "beam 'b'", "the stiffness EI of bending is missing");
    beam = plane_beam(4);
    beam.ends[1] = (kt_beam_end)7;
    check_rejected(&beam, "beam 'b'", "ends: there is no end 7; take KT_BEAM_CLAMPED, _HINGED or _FREE");
    beam = plane_beam(4);
    beam.curvature.x = (double)INFINITY;
    check_rejected(&beam, "beam 'b'", "curvature: the curvature is not finite");
    beam.curvature = kt_vec3_make(0.0, 0.25, 0.5);
    check_rejected(&beam, "beam 'b'",
                   "curvature: EI is one number, so the beam lies in its plane; curvature about x or y (0, 0.25 rad/m) "
                   "needs EI: [y, z] and GJ");
    beam = plane_beam(4);
    beam.from.body = "hub";
    beam.from.marker = "rim";
    check_rejected(&beam, "beam 'b'",
                   "from: body 'hub' with a marker 'rim' has not been added; add it before the beam");
    beam = plane_beam(4);
    beam.ends[1] = KT_BEAM_CLAMPED;
    check_rejected(
        &beam, "beam 'b'",
        "to: the second end is attached; give its place (body \"world\" for the world's origin), or make the "
        "end free");
    beam.name = NULL;
    check_rejected(&beam, "beam ''", "name: the name is missing; the segments are NAME-1, NAME-2, ...");
}

KT_TEST(what_makes_no_tree_is_rejected) {
    kt_builder *builder = NULL;
    kt_error e = {0};
    kt_link_tree tree = kt_link_tree_default();
    if (!is_fine("builder", kt_builder_create(&builder, &e), &e))
        return;
    tree.name = "t";
    kt_check_equal_int("no links", kt_builder_add_tree(builder, &tree, &e), KT_ERROR_MODEL);
    kt_check_text("message", e.message, "0 links; there must be at least one");
    tree.count = 2;
    tree.branching = 0;
    kt_check_equal_int("no branching", kt_builder_add_tree(builder, &tree, &e), KT_ERROR_MODEL);
    kt_check_text("message", e.message, "a branching of 0; each link carries one (a chain) or more");
    tree.branching = 2;
    tree.fan = (double)NAN;
    kt_check_equal_int("no fan", kt_builder_add_tree(builder, &tree, &e), KT_ERROR_MODEL);
    tree.fan = 1.0;
    tree.name = NULL;
    kt_check_equal_int("no name", kt_builder_add_tree(builder, &tree, &e), KT_ERROR_MODEL);
    kt_check_text("where", e.where, "tree ''");
    kt_check_equal_int("links that were added", kt_builder_describe(builder).body_count, 0);
    kt_builder_free(builder);
}
