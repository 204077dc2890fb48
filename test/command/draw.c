/* kinetree draw. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sanitized.h"
#include "shell.h"

#include <cairo.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char pair[] = "kinetree: 1\n"
                           "name: 'two </text><script>alert(1)</script> & rods'\n"
                           "gravity: [0, -9.81, 0]\n"
                           "bodies:\n"
                           "  - name: upper\n"
                           "    joint: {type: revolute, axis: z, position: 60 deg}\n"
                           "    mass: 1\n"
                           "    shape: {type: rod, to: [0, -1, 0]}\n"
                           "  - name: lower\n"
                           "    parent: upper\n"
                           "    joint: {type: revolute, axis: z, at: [0, -1, 0]}\n"
                           "    mass: 1\n"
                           "    shape: {type: rod, to: [0, -1, 0]}\n"
                           "    markers: {tip: [0, -1, 0]}\n"
                           "simulate: {duration: 1, integrator: dopri5, tolerance: 1e-6}\n";

static int count_of(const char *text, const char *part) {
    int count = 0;
    for (; text != NULL && (text = strstr(text, part)) != NULL; text += strlen(part))
        count++;
    return count;
}

/* An SVG: whole, small, its words as text, on a light or a dark page. */
static void expect_picture(const char *name, bool is_dark) {
    const char *svg = kt_read_file(name);
    kt_need(kt_check_true(name, svg != NULL));
    kt_check_contains("is whole", svg, "</svg>");
    kt_check_above("shapes", count_of(svg, "<path"), 5.0);
    kt_check_below("bytes", (double)strlen(svg), 60000.0);
    kt_check_equal_int("letters drawn as shapes", count_of(svg, "glyph"), 0);
    kt_check_equal_int("properties at their defaults", count_of(svg, "-opacity") + count_of(svg, "miterlimit"), 0);
    if (is_dark)
        kt_check_below("lightness of the page", kt_page_lightness(svg), 0.2);
    else
        kt_check_above("lightness of the page", kt_page_lightness(svg), 0.9);
}

KT_TEST(every_bundled_scene_is_drawn_small) {
    kt_ran ran =
        kt_shell("for f in %s/*.yaml; do $K draw $f --out $(basename $f .yaml).svg || exit; done; ls *.svg", KT_SCENES);
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_above("pictures", kt_count_lines(ran.out), 48.0);
    char *names = strdup(ran.out != NULL ? ran.out : "");
    for (char *rest = names, *name; (name = strtok_r(rest, "\n", &rest)) != NULL;)
        expect_picture(name, false);
    free(names);
}

KT_TEST(names_in_a_scene_are_text_and_nothing_else) {
    kt_write_file("pair.yaml", pair);
    kt_expect(0, "pair.svg", "$K draw pair.yaml --names");
    const char *svg = kt_read_file("pair.svg");
    kt_check_equal_int("scripts", count_of(svg, "<script"), 0);
    kt_check_contains("the title", svg,
                      ">two &#60;/text&#62;&#60;script&#62;alert(1)&#60;/script&#62; &#38; rods</text>");
    kt_check_contains("a body", svg, ">upper</text>");
    kt_check_contains("a marker", svg, ">tip</text>");
    kt_check_contains("the view", svg, ">at the start; in its plane</text>");
}

KT_TEST(dark_pictures_have_a_dark_page) {
    kt_write_file("pair.yaml", pair);
    kt_expect(0, "d.svg", "$K draw pair.yaml --dark --out d.svg");
    expect_picture("d.svg", true);
    kt_ran ran = kt_shell("$K draw pair.yaml --out d.png 2>/dev/null && head -c 4 d.png | tail -c 3");
    kt_check_text("a PNG", ran.out, "PNG");
}

/* Pixels of rows [from, to) of a PNG that do not have the colour of its first one. */
static int ink_of(const char *name, int from, int to) {
    cairo_surface_t *picture = cairo_image_surface_create_from_png(name);
    const unsigned char *data = cairo_image_surface_get_data(picture);
    const int width = cairo_image_surface_get_width(picture), stride = cairo_image_surface_get_stride(picture);
    int count = 0;
    for (int y = from; y < to && data != NULL && y < cairo_image_surface_get_height(picture); y++)
        for (int x = 0; x < width; x++)
            count += memcmp(data + y * stride + 4 * x, data, 3) != 0;
    cairo_surface_destroy(picture);
    return count;
}

/* Pixels that are far from grey. */
static int colour_of(const char *name) {
    cairo_surface_t *picture = cairo_image_surface_create_from_png(name);
    const unsigned char *data = cairo_image_surface_get_data(picture);
    const int width = cairo_image_surface_get_width(picture), stride = cairo_image_surface_get_stride(picture);
    int count = 0;
    for (int y = 0; y < cairo_image_surface_get_height(picture) && data != NULL; y++)
        for (int x = 0; x < width; x++) {
            const unsigned char *at = data + y * stride + 4 * x;
            count += abs(at[0] - at[1]) + abs(at[1] - at[2]) > 60;
        }
    cairo_surface_destroy(picture);
    return count;
}

/* Links of a pixel and a half each, along a page of 1,560 pixels: at least two rows of them. */
KT_TEST(circles_of_joints_do_not_hide_a_thousand_links) {
    kt_expect(0, "chain.png", "$K make chain --links 1000 >chain.yaml; $K draw chain.yaml --out chain.png");
    kt_check_above("pixels of the links' colours", colour_of("chain.png"), 3000.0);
}

/* Two weights on a rope over a pulley, which is the highest part of the picture and has no solid. */
static const char over_pulley[] =
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
    "  - {name: a, joint: {type: prismatic, axis: z, at: [-0.1, 0, 1]}, mass: 3, shape: {type: sphere, radius: 0.05}}\n"
    "  - {name: b, joint: {type: prismatic, axis: z, at: [0.1, 0, 1]}, mass: 2, shape: {type: sphere, radius: 0.05}}\n"
    "effects:\n  - type: expression\n"
    "    path: [a, {body: world, at: [0, 0, 2], radius: 0.1, axis: y, side: [0, 0, 1]}, b]\n"
    "    force: \"-1e4*max(length - 2.314, 0) - 50*speed\"\n"
    "simulate: {duration: 0.8}\n";

/* The title ends above row 110, and the drawing begins below row 150. Rows are pixels, at twice the size of an
 * SVG's. */
KT_TEST(nothing_lies_between_the_title_of_a_png_and_what_is_drawn) {
    static const char *const scenes[] = {"pair.yaml --strobe 8 --until 0.5 --trace lower.tip",
                                         "pair.yaml --names",
                                         KT_SCENES "/articulated-rotor.yaml --axes",
                                         "over.yaml",
                                         "over.yaml --view iso",
                                         "over.yaml --at 0,0.4",
                                         "over.yaml --strobe 5"};
    kt_write_file("pair.yaml", pair);
    kt_write_file("over.yaml", over_pulley);
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        kt_expect(0, "t.png", "$K draw %s --out t.png", scenes[i]);
        kt_check_equal_int("pixels between", ink_of("t.png", 110, 150), 0);
        kt_check_above("pixels of the title", ink_of("t.png", 0, 110), 1000.0);
        kt_check_above("pixels below", ink_of("t.png", 150, 2000), 5000.0);
    }
}

/* Rods that slide and turn by themselves: the places of the picture are those of the mechanism. */
KT_TEST(states_lie_side_by_side_or_over_each_other_with_paths) {
    kt_write_file("pair.yaml", pair);
    kt_expect(0, "a.svg", "$K draw pair.yaml --at 0,0.25,0.5 --out a.svg");
    const char *svg = kt_read_file("a.svg");
    kt_check_contains("the first", svg, ">0 s</text>");
    kt_check_contains("the second", svg, ">0.25 s</text>");
    kt_check_contains("the third", svg, ">0.5 s</text>");
    kt_check_contains("words", svg, ">3 states up to 0.5 s; in its plane</text>");
    kt_expect(0, "b.svg", "$K draw pair.yaml --strobe 8 --until 0.5 --trace lower.tip --out b.svg");
    svg = kt_read_file("b.svg");
    kt_check_contains("words", svg, ">8 states from 0 to 0.5 s; in its plane</text>");
    kt_check_above("lines", count_of(svg, " L "), 100.0);
    expect_picture("b.svg", false);
}

/* A figure in space, a rope in a plane: of twelve states some 190 and 250 kB. */
KT_TEST(large_strobe_pictures_become_simpler_and_say_so) {
    static const char *const scenes[] = {"humanoid", "rope"};
    for (int i = 0; i < 2; i++) {
        kt_expect(0, "of 12 states in flat colours", "$K draw %s/%s.yaml --strobe 12 --out s.svg", KT_SCENES,
                  scenes[i]);
        expect_picture("s.svg", false);
        kt_check_equal_int("words of all states", count_of(kt_read_file("s.svg"), ">12 states"), 0);
    }
    kt_ran ran = kt_shell("$K draw %s/rope.yaml --strobe 12 --out s.png 2>&1", KT_SCENES);
    kt_check_text("a PNG needs no word", ran.out, "picture: s.png\n");
}

/* A spring and a stop in a joint, a motor, a gear: each adds lines. */
KT_TEST(what_acts_in_joints_has_symbols) {
    static const char *const acts[] = {
        "effects: [{type: joint_spring, joint: upper, stiffness: 2}]\n",
        "effects: [{type: joint_limit, joint: upper, stiffness: 2, lower: -1, upper: 2}]\n",
        "effects: [{type: motor, joint: upper, torque: 2}]\n",
        "loops: [{name: gear, type: coupling, coefficients: {upper: 1, lower: 2}}]\n",
        "loops: [{name: drive, type: motion, joint: upper, position: {polynomial: [0, 1]}}]\n"};
    kt_write_file("pair.yaml", pair);
    kt_expect(0, "p.svg", "$K draw pair.yaml --out p.svg");
    const int plain = count_of(kt_read_file("p.svg"), "<path");
    for (size_t i = 0; i < sizeof acts / sizeof *acts; i++) {
        char text[4096];
        snprintf(text, sizeof text, "%s%s", pair, acts[i]);
        kt_write_file("acts.yaml", text);
        kt_expect(0, "q.svg", "$K draw acts.yaml --out q.svg");
        kt_check_above(acts[i], count_of(kt_read_file("q.svg"), "<path"), plain);
    }
}

/* The square of a planar joint is painted before the line of a contact's ground, which it would cover. */
/* The place at which a property first has a value: cairo 1.16 writes a style, 1.18 attributes. */
static const char *first_with(const char *svg, const char *property, const char *value) {
    char style[64], attribute[64];
    (void)snprintf(style, sizeof style, "%s:%s;", property, value);
    (void)snprintf(attribute, sizeof attribute, " %s=\"%s\"", property, value);
    const char *found = strstr(svg, style);
    return found ? found : strstr(svg, attribute);
}

/* The plane of a planar joint is the paper. Seen from elsewhere it is a square, which does not cover the ground. */
KT_TEST(ground_of_a_contact_is_not_covered_by_the_plane_of_a_joint) {
    kt_write_file("ground.yaml",
                  "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                  "  - {name: ball, joint: {type: planar, axis: z, position: [0.5, 0.5, 0]}, mass: 1,\n"
                  "     shape: {type: sphere, radius: 0.1}, markers: {c: [0, 0, 0]}}\n"
                  "effects: [{type: contact, point: ball.c, radius: 0.1, plane: world, axis: y, stiffness: 1e5}]\n");
    for (int aside = 0; aside < 2; aside++) {
        kt_expect(0, NULL, "$K draw ground.yaml --out ground.svg --view %s 2>/dev/null", aside ? "30,0" : "z");
        const char *svg = kt_read_file("ground.svg");
        const char *square = first_with(svg, "fill", "#f2f2f2"), *ground = first_with(svg, "stroke-width", "1.4");
        kt_check_true("a square aside alone", (square != NULL) == (aside == 1));
        kt_check_true("then the ground", ground != NULL && (square == NULL || square < ground));
    }
}

KT_TEST(views_are_read_and_rejected) {
    kt_write_file("pair.yaml", pair);
    static const char *const views[][2] = {{"x", "seen along x"},
                                           {"iso", "isometric"},
                                           {"-20,90", "seen from 20\u00b0 to the left and 90\u00b0 above"},
                                           {"z", "seen along z"}};
    for (size_t i = 0; i < sizeof views / sizeof views[0]; i++) {
        kt_expect(0, "v.svg", "$K draw pair.yaml --out v.svg --axes --view=%s", views[i][0]);
        kt_check_contains(views[i][0], kt_read_file("v.svg"), views[i][1]);
    }
    kt_expect(1, "--view takes x, y, z, iso or AZIMUTH,ELEVATION", "$K draw pair.yaml --view front");
    kt_expect(1, "--view takes", "$K draw pair.yaml --view 20,100");
    kt_expect(1, "--at takes times in rising order", "$K draw pair.yaml --at 1,0.5");
    kt_expect(1, "--at takes times in rising order", "$K draw pair.yaml --at 1,x");
    kt_expect(1, "--at takes times in rising order", "$K draw pair.yaml --at ''");
    kt_expect(1, "--at takes times from 0 on, and -1 s is negative", "$K draw pair.yaml --at=-1");
    kt_expect(1, "--at takes times from 0 on, and -1 s is negative", "$K draw pair.yaml --at=-1,0.5");
    kt_expect(1, "--strobe takes a number of states from 1 up to 60, not 0", "$K draw pair.yaml --strobe 0");
    kt_expect(1, "--until is the end of --strobe or --trace", "$K draw pair.yaml --until 0.5");
    kt_expect(1, "--until is the end of --strobe or --trace", "$K draw pair.yaml --at 0,1 --trace lower.tip --until 1");
    kt_expect(1, "exclude each other", "$K draw pair.yaml --at 1 --strobe 3");
    kt_expect(1, "up to 60", "$K draw pair.yaml --strobe 61");
    kt_expect(1, "draw: --trace: body 'lower' has no marker 'top'; did you mean 'tip'?",
              "$K draw pair.yaml --trace lower.top");
    kt_expect(1, "a picture's name ends in .svg, .png or .pdf", "$K draw pair.yaml --out p.jpg");
}

/* Two rods that are too short to meet. */
KT_TEST(loops_that_cannot_be_closed_are_shown_open) {
    kt_write_file("open.yaml",
                  "kinetree: 1\n"
                  "bodies:\n"
                  "  - {name: a, joint: {type: revolute}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
                  "  - {name: b, joint: {type: revolute, at: [5, 0, 0]}, mass: 1,\n"
                  "     shape: {type: rod, to: [-1, 0, 0]}}\n"
                  "loops:\n"
                  "  - {name: gap, type: revolute, between: [{body: a, at: [1, 0, 0]}, {body: b, at: [-1, 0, 0]}]}\n");
    kt_expect(3, "open.svg shows the given state", "$K draw open.yaml");
    const char *svg = kt_read_file("open.svg");
    kt_check_contains("words", svg, "as given: loops are open, in red");
    kt_check_contains("red", svg, "#d91a1a");
}

#if !KT_ADDRESS_SANITIZER
/* 90 kB of stack were taken for finding fonts. */
KT_TEST(pictures_are_drawn_with_little_stack) {
    kt_write_file("pair.yaml", pair);
    kt_expect(0, "least.png", "(ulimit -s 72; $K draw pair.yaml --out least.png; )");
    kt_expect(0, "usual.png", "$K draw pair.yaml --out usual.png && cmp usual.png least.png");
    kt_expect(0, "least.svg", "(ulimit -s 72; $K draw pair.yaml --out least.svg; )");
}
#endif

/* At 1e17 m, positions are rounded to 16 m. A ball of some decimetres was drawn as a circle of 1e8 units, without
 * end. */
KT_TEST(a_mechanism_far_from_the_origin_is_drawn_as_finely_as_its_positions_are_known) {
    static const char *const places[] = {"[1.3, 0.2, 1.0e+17]", "[1.0e+17, 0, 0]", "[-1.0e+30, 1.0e+30, 1.0e+30]"};
    for (int i = 0; i < 3; i++) {
        char text[400];
        snprintf(
            text, sizeof text,
            "kinetree: 1\ngravity: [1, 7, 4]\nbodies: [{name: b, joint: {type: planar, axis: y, at: %s, position: "
            "[-2, 0.3, 2]},\n mass: 1, com: [0.7, 0.05, 0.3], inertia: [1, 1, 1], markers: {m: [0.4, -0.5, 1.3]}}]\n",
            places[i]);
        kt_write_file("far.yaml", text);
        kt_expect(0, "far.svg shows nothing finer than ", "timeout 20 $K draw far.yaml");
        expect_picture("far.svg", false);
    }
    kt_write_file("pair.yaml", pair);
    const kt_ran ran = kt_shell("$K draw pair.yaml 2>&1");
    kt_check_equal_int("words of a mechanism at hand", count_of(ran.out, "finer"), 0);
}

KT_TEST(a_picture_without_bodies_is_told) {
    kt_write_file("none.yaml", "kinetree: 1\n");
    const kt_ran ran = kt_shell("$K draw none.yaml --out none.svg");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("words", ran.err, "none.svg, which is empty: the scene has no bodies\n");
}

/* A square frame of 3 m has a square hole of 1 m in its middle. A rod behind it is seen through the hole alone. A ball
 * is in front of it. */
static const char ring[] = "v -1.5 -1.5 0\nv 1.5 -1.5 0\nv 1.5 1.5 0\nv -1.5 1.5 0\n"
                           "v -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\n"
                           "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
static const char framed[] = "kinetree: 1\nbodies:\n"
                             "  - {name: frame, mass: 1, joint: {type: fixed}}\n"
                             "  - {name: rod, mass: 1, joint: {type: free, position: {%s}},\n"
                             "     shape: {type: box, size: [2.8, 0.2, 0.2]}}\n"
                             "%s"
                             "meshes: [{body: frame, file: parts/ring.obj}%s]\n";

static const char behind[] = "position: [0, 0, -1]";

/* The colour of a pixel, as red, green, blue; page units from the middle of the drawing. */
static unsigned colour_at(const char *name, double x, double y) {
    cairo_surface_t *picture = cairo_image_surface_create_from_png(name);
    const unsigned char *data = cairo_image_surface_get_data(picture);
    const int stride = cairo_image_surface_get_stride(picture);
    const int column = (int)lround(0.5 * cairo_image_surface_get_width(picture) + 2.0 * x);
    const int row = (int)lround(2.0 * (64.0 + 280.0 - y));
    unsigned pixel = 0;
    if (data != NULL)
        memcpy(&pixel, data + row * stride + 4 * column, sizeof pixel);
    cairo_surface_destroy(picture);
    return pixel & 0xFFFFFFU;
}

KT_TEST(meshes_hide_and_show_what_is_behind_them) {
    static const char ball[] = "  - {name: ball, mass: 1, joint: {type: free, position: {position: [1, 1, 1]}},\n"
                               "     shape: {type: sphere, radius: 0.3}}\n";
    char text[2000];
    (void)kt_shell("mkdir -p parts");
    kt_write_file("parts/ring.obj", ring);
    (void)snprintf(text, sizeof text, framed, behind, ball, "");
    kt_write_file("framed.yaml", text);
    kt_expect(0, "f.png", "$K draw framed.yaml --view z --out f.png");
    const double unit = (560.0 - 60.0) / 3.0; /* page units a metre: 3 m fill the height but for the border */
    const unsigned frame = colour_at("f.png", -unit, 0.0), rod = colour_at("f.png", -0.2 * unit, 0.0);
    const unsigned seen = colour_at("f.png", unit, unit), through = colour_at("f.png", -0.2 * unit, 0.3 * unit);
    const unsigned edge = colour_at("f.png", -1.0 * unit, -1.0 * unit);
    kt_note("frame %06x, rod %06x, ball %06x, page %06x", frame, rod, seen, through);
    kt_check_equal_int("the frame hides the rod", (int)frame, (int)edge);
    kt_check_true("the rod is seen through the hole", rod != frame && rod != 0xFFFFFF);
    kt_check_true("the ball is before the frame", seen != frame && seen != 0xFFFFFF);
    kt_check_equal_int("the page is seen through the hole", (int)through, 0xFFFFFF);
    kt_expect(0, "f.svg", "$K draw framed.yaml --view z --out f.svg");
    kt_check_equal_int("one image", count_of(kt_read_file("f.svg"), "<image"), 1);
    kt_expect(0, "b.svg", "$K draw framed.yaml --view z --boxes --out b.svg");
    kt_check_equal_int("boxes need none", count_of(kt_read_file("b.svg"), "<image"), 0);
}

/* The rod leans through the hole: one half is before the frame, the other behind it, so no order of whole bodies is
 * right. */
KT_TEST(a_body_that_leans_through_a_mesh_is_half_hidden) {
    char text[2000];
    (void)kt_shell("mkdir -p parts");
    kt_write_file("parts/ring.obj", ring);
    (void)snprintf(text, sizeof text, framed, "orientation: [0.96, 0, 0.28, 0]", "", "");
    kt_write_file("lean.yaml", text);
    kt_expect(0, "lean.png", "$K draw lean.yaml --view z --out lean.png");
    const double unit = (560.0 - 60.0) / 3.0,
                 at = 0.75 * unit; /* the rod ends at 1.18 m; at 0.75 m off its axis, it is 0.48 m from the frame */
    const unsigned edge = colour_at("lean.png", -unit, -unit), left = colour_at("lean.png", -at, 0.0);
    const unsigned right = colour_at("lean.png", at, 0.0), middle = colour_at("lean.png", 0.0, 0.0);
    kt_note("frame %06x, left %06x, middle %06x, right %06x", edge, left, middle, right);
    kt_check_true("one half is hidden, the other is not", (left == edge) != (right == edge));
    kt_check_true("the middle is seen", middle != edge && middle != 0xFFFFFF);
}

/* Pixels of a path's blue in a column, in the upper or in the lower half of the drawing; page units from its middle. */
static int blue_of(const char *name, double x, bool is_upper) {
    cairo_surface_t *picture = cairo_image_surface_create_from_png(name);
    const unsigned char *data = cairo_image_surface_get_data(picture);
    const int height = cairo_image_surface_get_height(picture), middle = (128 + height - 132) / 2;
    const int column = (int)lround(0.5 * cairo_image_surface_get_width(picture) + 2.0 * x);
    int count = 0;
    for (int y = is_upper ? 128 : middle; y < (is_upper ? middle : height - 132) && data != NULL; y++) {
        const unsigned char *at = data + y * cairo_image_surface_get_stride(picture) + 4 * column;
        count += at[0] - at[2] > 60;
    }
    cairo_surface_destroy(picture);
    return count;
}

/* A ball runs around a post, and through the hole of a frame. The near half of its path is lower on the page. */
KT_TEST(paths_in_space_are_before_and_behind_bodies) {
    static const char ball[] = "bodies:\n"
                               "  - {name: arm, joint: {type: revolute, axis: %s, position: %s,\n"
                               "     velocity: 6.283185307179586}, mass: 1, markers: {m: [1, 0, 0]},\n"
                               "     shape: {type: sphere, radius: 0.05, at: [1, 0, 0]}}\n";
    char orbit[600], text[1000];
    (void)kt_shell("mkdir -p parts");
    kt_write_file("parts/ring.obj", ring);
    (void)snprintf(orbit, sizeof orbit, ball, "z", "0");
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\ngravity: [0, 0, -9.81]\nsimulate: {duration: 1}\n%s"
                   "  - {name: post, joint: {type: fixed}, shape: {type: cylinder, radius: 0.3, length: 2}}\n",
                   orbit);
    kt_write_file("post.yaml", text);
    (void)snprintf(orbit, sizeof orbit, ball, "[0, 1, 0.3]", "90 deg");
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\ngravity: [0, 0, 0]\nsimulate: {duration: 1}\n%s"
                   "  - {name: frame, mass: 1, joint: {type: fixed}}\nmeshes: [{body: frame, file: parts/ring.obj}]\n",
                   orbit);
    kt_write_file("hole.yaml", text);
    static const struct {
        const char *words;
        double x; /* page units from the middle, on the post or the frame */
    } pictures[] = {{"post.yaml --view 0,25", 10.0},
                    {"post.yaml --view 0,25 --strobe 8", 10.0},
                    {"hole.yaml --view z", 0.8 * 500.0 / 3.0}};
    for (size_t i = 0; i < sizeof pictures / sizeof *pictures; i++) {
        kt_expect(0, "t.png", "$K draw %s --trace arm.m --out t.png", pictures[i].words);
        kt_check_above("pixels of the near half", blue_of("t.png", pictures[i].x, false), 0.0);
        kt_check_equal_int("pixels of the far half", blue_of("t.png", pictures[i].x, true), 0);
    }
}

/* The first and the last column with ink, of rows [from, to) of a PNG. */
static void ink_span(const char *name, int from, int to, int *left, int *right) {
    cairo_surface_t *picture = cairo_image_surface_create_from_png(name);
    const unsigned char *data = cairo_image_surface_get_data(picture);
    const int width = cairo_image_surface_get_width(picture), stride = cairo_image_surface_get_stride(picture);
    *left = width;
    *right = -1;
    for (int y = from; y < to && data != NULL; y++)
        for (int x = 0; x < width; x++)
            if (memcmp(data + y * stride + 4 * x, data, 3) != 0) {
                *left = x < *left ? x : *left;
                *right = x > *right ? x : *right;
            }
    cairo_surface_destroy(picture);
}

static int height_of_png(const char *name) {
    cairo_surface_t *picture = cairo_image_surface_create_from_png(name);
    const int height = cairo_image_surface_get_height(picture);
    cairo_surface_destroy(picture);
    return height;
}

/* A trolley of 1 m moves by 6 m, seen from the side. Its rail is the longest thing in each of two rows: 8 m.
 * The border of a cell is 30 units, and symbols extend into it. */
KT_TEST(rails_are_the_same_in_all_states_and_within_the_page) {
    kt_write_file("rail.yaml",
                  "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                  "  - {name: trolley, joint: {type: prismatic, axis: x, at: [0, 0, 3], velocity: 3}, mass: 1,\n"
                  "     shape: {type: box, size: [1, 0.6, 0.3]}}\n"
                  "  - {name: load, parent: trolley, joint: {type: universal, axis: x, axis2: y}, mass: 1,\n"
                  "     shape: {type: rod, to: [0, 0, -2], radius: 0.05}}\nsimulate: {duration: 2}\n");
    kt_expect(0, "rail.png", "$K draw rail.yaml --view y --at 0,2 --out rail.png");
    const int height = height_of_png("rail.png"), middle = (128 + height - 132) / 2;
    int left[2], right[2];
    ink_span("rail.png", 128, middle, &left[0], &right[0]);
    ink_span("rail.png", middle, height - 132, &left[1], &right[1]);
    kt_note("rails from %d to %d and from %d to %d", left[0], right[0], left[1], right[1]);
    kt_check_equal_int("left end of the second", left[1], left[0]);
    kt_check_equal_int("right end of the second", right[1], right[0]);
    kt_check_above("left end", left[0], 60.0);
    kt_check_below("right end", right[0], 1740.0);
}

/* The x of a text in an SVG, page units; NaN: it is not there. */
static double x_of_text(const char *svg, const char *text) {
    double x = (double)NAN;
    for (const char *at = svg; at != NULL && (at = strstr(at, "<text x=\"")) != NULL; at++) {
        const char *end = strchr(at, '>');
        if (end != NULL && strncmp(end + 1, text, strlen(text)) == 0 && sscanf(at, "<text x=\"%lf", &x) == 1)
            break;
    }
    return x;
}

/* Two wheels 4 m apart. The name of each contact is next to its wheel, and not at the origin of the ground. */
KT_TEST(names_of_contacts_are_at_their_wheels) {
    kt_write_file("axles.yaml",
                  "kinetree: 1\nbodies:\n"
                  "  - {name: frame, joint: {type: prismatic, axis: x, at: [0, 0, 1]}, mass: 1}\n"
                  "  - {name: near, parent: frame, joint: {type: revolute, axis: y}, mass: 1,\n"
                  "     shape: {type: cylinder, radius: 1, length: 0.2, axis: y}}\n"
                  "  - {name: far, parent: frame, joint: {type: revolute, axis: y, at: [4, 0, 0]}, mass: 1,\n"
                  "     shape: {type: cylinder, radius: 1, length: 0.2, axis: y}}\n"
                  "loops:\n"
                  "  - {name: first, type: rolling, wheel: near, axis: y, radius: 1, on: world, normal: z}\n"
                  "  - {name: second, type: rolling, wheel: far, axis: y, radius: 1, on: world, normal: z}\n");
    kt_expect(0, "axles.svg", "$K draw axles.yaml --names --view y --quiet");
    const char *svg = kt_read_file("axles.svg");
    kt_check_near("name of the second contact from its wheel", x_of_text(svg, "second"), x_of_text(svg, "far"), 60.0);
    kt_check_near("name of the first contact from its wheel", x_of_text(svg, "first"), x_of_text(svg, "near"), 60.0);
    kt_check_above("wheels are apart by", fabs(x_of_text(svg, "far") - x_of_text(svg, "near")), 200.0);
}

/* A name has a gap to the next one in its row, and those without room are counted. */
KT_TEST(names_without_room_are_counted) {
    const kt_ran ran = kt_shell("$K make chain --links 200 >names.yaml && $K draw names.yaml --names");
    const char *lacks = strstr(ran.err, "names.svg lacks "), *svg = kt_read_file("names.svg");
    int left_out = 0, shown = 0;
    double row[200] = {0.0}, end[200] = {0.0}, least = 1e9;
    kt_check_true("names are left out",
                  lacks != NULL && sscanf(lacks, "names.svg lacks %d names, for", &left_out) == 1);
    for (const char *at = svg; (at = strstr(at, "<text x=\"")) != NULL; at++) {
        double x, y;
        if (sscanf(at, "<text x=\"%lf\" y=\"%lf\"", &x, &y) != 2 || strncmp(strchr(at, '>'), ">link", 5) != 0 ||
            strspn(strchr(at, '>') + 5, "0123456789") != 3)
            continue;
        for (int k = 0; k < shown; k++)
            least = fabs(row[k] - y) < 1.0 ? fmin(least, fabs(end[k] - x)) : least;
        row[shown] = y;
        end[shown++] = x;
    }
    kt_check_above("pitch of names of three digits, page units", least, 45.0);
    kt_check_equal_int("names of links", kt_count_of(svg, ">link") + left_out, 200);
    kt_expect(0, "picture: andrews.svg\n", "$K draw " KT_SCENES "/andrews.yaml --names");
    kt_check_equal_int("one name for four markers at a place", kt_count_of(kt_read_file("andrews.svg"), ">E<"), 1);
}

enum { TRIANGLES_MOST = 8 };

/* The triangles of mounts in an SVG: the y of the tip, and how far the side is below it. Page units. */
static int triangles_of(const char *svg, double tip[TRIANGLES_MOST], double down[TRIANGLES_MOST]) {
    int count = 0;
    for (const char *at = svg; at != NULL && (at = strstr(at, "<path")) != NULL; at++) {
        const char *fill = strstr(at, "#e0e0e0"), *d = strstr(at, " d=\""), *end = strchr(at, '>');
        double x, y[3];
        if (fill == NULL || fill > end || d == NULL || d > end ||
            sscanf(d, " d=\"M %lf %lf L %lf %lf L %lf %lf Z", &x, &y[0], &x, &y[1], &x, &y[2]) != 6 || y[1] != y[2] ||
            count == TRIANGLES_MOST)
            continue;
        tip[count] = y[0];
        down[count++] = y[1] - y[0];
    }
    return count;
}

/* A crank that is below its joint at first, and above it at last. The first state alone would turn the triangle. */
KT_TEST(mounts_are_the_same_in_all_states) {
    double tip[TRIANGLES_MOST], down[TRIANGLES_MOST];
    kt_write_file("crank.yaml", "kinetree: 1\nbodies:\n"
                                "  - {name: crank, joint: {type: revolute, axis: z, position: -90 deg,\n"
                                "     velocity: 6.283185307179586}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
                                "simulate: {duration: 1}\n");
    kt_expect(0, "crank.svg", "$K draw crank.yaml --at 0,0.25,0.5");
    if (kt_check_equal_int("triangles", triangles_of(kt_read_file("crank.svg"), tip, down), 3))
        for (int i = 0; i < 3; i++)
            kt_check_above("the side is below the tip by", down[i], 5.0);
}

/* An arm on a base without a shape, which is a post of 0.3 m. */
KT_TEST(ground_is_below_the_fixed_part) {
    static const char base[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: base%s}\n"
        "  - {name: a, parent: base, joint: {type: revolute, axis: y, at: [0, 0, %g]}, mass: 1,\n"
        "     shape: {type: rod, to: [0.3, 0, 0], radius: 0.02}}\n";
    double tip[TRIANGLES_MOST] = {0.0}, down[TRIANGLES_MOST] = {0.0};
    char text[600];
    for (int i = 0; i < 3; i++) { /* a post, one that hangs, a box */
        const double height = i == 1 ? -0.3 : 0.3;
        (void)snprintf(text, sizeof text, base, i == 2 ? ", shape: {type: box, size: [0.1, 0.1, 0.1]}" : "", height);
        kt_write_file("base.yaml", text);
        kt_expect(0, "base.svg", "$K draw base.yaml");
        const char *svg = kt_read_file("base.svg");
        kt_check_equal_int("triangles", triangles_of(svg, tip, down), 1);
        if (i != 1) { /* the drawing is above y = 64 + 560 */
            kt_check_above("the tip is at the lower end", tip[0], 500.0);
            kt_check_above("the side is below the tip by", down[0], 5.0);
        } else {
            kt_check_below("the tip is at the upper end", tip[0], 190.0);
            kt_check_above("the side is above the tip by", -down[0], 5.0);
        }
    }
    (void)snprintf(text, sizeof text, base, "", 0.3);
    kt_write_file("base.yaml", text);
    kt_expect(0, "base.png", "$K draw base.yaml --view iso --out base.png");
    const int height = height_of_png("base.png");
    int left, right, bottom = height - 132;
    while (bottom > 0 && ink_of("base.png", bottom - 1, bottom) == 0)
        bottom--;
    ink_span("base.png", bottom - 20, bottom, &left, &right);
    kt_check_above("width of the lowest thing, a plate, in pixels", right - left, 50.0);
}

KT_TEST(meshes_that_cannot_be_read_are_told_once) {
    char text[2000];
    (void)kt_shell("mkdir -p parts");
    kt_write_file("parts/ring.obj", ring);
    kt_write_file("parts/odd.stl", "this is no surface");
    (void)snprintf(
        text, sizeof text, framed, behind, "",
        ", {body: rod, file: parts/odd.stl}, {body: rod, file: parts/none.obj}, {body: rod, file: parts/x.step}");
    kt_write_file("lost.yaml", text);
    kt_expect(0, "3 meshes are not shown; the first is ", "$K draw lost.yaml --out l.svg");
    kt_expect(0, "odd.stl: there is no triangle in the mesh", "$K draw lost.yaml --out l.svg");
    kt_expect(0, "3 meshes are not shown", "$K view lost.yaml --duration 0.1 --view l.html");
}
