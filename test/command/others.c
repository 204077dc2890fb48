/* make, info, demo, integrators, pictures, and outputs that appear on a terminal only. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sanitized.h"
#include "shell.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

KT_TEST(everything_that_make_makes_runs) {
    static const char *const kinds[] = {"chain", "pendulum", "tree"};
    static const char *const joints[] = {"revolute", "prismatic", "screw",     "cylindrical",
                                         "planar",   "universal", "spherical", "mixed"};
    int asked = 0;
    for (size_t k = 0; k < 3; k++)
        for (size_t j = 0; j < 8; j++) {
            if (!kt_is_asked(&asked, 3)) /* of each joint one kind */
                continue;
            kt_ran ran = kt_shell("for o in '' '--axes xyz' '--seed 5' '--shape rod' '--angle 20deg'; do $K make %s "
                                  "--links 8 --joint %s $o | $K run - --quiet --out /dev/null --duration 0.2 || exit "
                                  "1; done",
                                  kinds[k], joints[j]);
            kt_check_equal_int(joints[j], ran.code, 0);
            kt_check_text(kinds[k], ran.err, "");
        }
}

KT_TEST(make_gives_the_scene_that_was_asked_for) {
    kt_ran ran = kt_shell("$K make tree --links 7 --branching 3 --mass 2.5 --length 0.5 | $K info -");
    kt_check_contains("bodies", ran.out, "bodies     7\n");
    kt_check_contains("mass", ran.out, "mass       17.5 kg");
    kt_check_contains("branching", ran.out,
                      "world\n"
                      "`- link1  revolute, 1 dof, 2.5 kg\n"
                      "   |- link2  revolute, 1 dof, 2.5 kg\n"
                      "   |  |- link5  revolute, 1 dof, 2.5 kg\n"
                      "   |  |- link6  revolute, 1 dof, 2.5 kg\n"
                      "   |  `- link7  revolute, 1 dof, 2.5 kg, markers tip\n"
                      "   |- link3  revolute, 1 dof, 2.5 kg\n"
                      "   `- link4  revolute, 1 dof, 2.5 kg\n");
    ran = kt_shell("$K make pendulum --links 2 --length 2 --angle 90deg | $K evaluate -");
    json_t *root = kt_json(ran.out);
    /* The chain is level, along x. Joint 1 carries point masses at 2 and 4 m. Its moment is g (2 + 4). */
    kt_check_near("mass matrix", kt_json_at(root, "mass_matrix[0][0]"), 20.0, 1e-14);
    kt_check_near("bias", kt_json_at(root, "bias[0]"), 6.0 * 9.81, 1e-13);
    json_decref(root);
    ran = kt_shell("$K make chain --links 30 --seed 3 >a; $K make chain --links 30 --seed 3 | cmp - a && $K make chain "
                   "--links 30 --seed 4 | cmp -s - a; test $? = 1");
    kt_check_equal_int("equal seeds, equal scenes; others, others", ran.code, 0);
}

/* info of a pendulum with two stops at each of some links. */
static kt_ran describe_stops(const char *links) {
    return kt_shell("($K make pendulum --links 2; echo 'effects:'; for j in %s; do echo \"  - {type: joint_limit, "
                    "joint: link$j, lower: -1, upper: 1, restitution: 0.5}\"; done) | $K info -",
                    links);
}

KT_TEST(info_tells_how_many_models_what_is_switched_takes) {
    kt_ran ran = describe_stops("1");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("switched", ran.out, "\nswitched   2 loops and effects: 2^2 = 4 models, 0.");
    ran = describe_stops("1 2");
    kt_check_contains("more contacts", ran.out,
                      "\nswitched   4 loops and effects; a run makes the models of contact sets; 0.");
    kt_check_true("of others nothing", strstr(kt_shell("$K make pendulum | $K info -").out, "switched") == NULL);
}

KT_TEST(info_is_short_for_any_size) {
    kt_ran ran = kt_shell("$K make chain --links 10000 | $K info -");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("abridged", ran.out,
                      "world\n"
                      "`- link1  revolute, 1 dof, 1 kg\n"
                      "   `- link2  revolute, 1 dof, 1 kg\n"
                      "      : 9997 more, from link3 on, each on the one before\n"
                      "      `- link10000  revolute, 1 dof, 1 kg, markers tip\n");
    ran = kt_shell("$K make tree --links 10000 | $K info -");
    kt_check_below("lines of a tree", kt_count_lines(ran.out), 120.0);
    kt_check_above("lines of a tree", kt_count_lines(ran.out), 50.0);
    kt_check_contains("what is left out", ran.out, " bodies more\n");
    ran = kt_shell("$K make tree --links 5000 --branching 4999 | $K info -");
    kt_check_contains("many children", ran.out, ": 4991 children more, 4991 bodies in all\n");
    ran = kt_shell("$K make pendulum | $K info -");
    kt_check_contains("one body", ran.out, "world\n`- link1  revolute, 1 dof, 1 kg, markers tip\n");
    kt_check_contains("plan", ran.out, "\nplan       planar, ");
    ran = kt_shell("$K make chain --links 3 --axes xyz | $K info -");
    kt_check_contains("plan", ran.out, "\nplan       spatial, ");
}

/* Two arms, a spring on the second, a damper in the first. Each energy that exists is listed with its amount. For the
 * others, the reason is given.
 */
static const char sprung[] = "kinetree: 1\n"
                             "bodies:\n"
                             "  - {name: a, joint: {type: revolute, axis: [1, 1, 0]}, mass: 1, inertia: [1, 1, 1]}\n"
                             "  - {name: b, parent: a, joint: {type: spherical}, mass: 1, inertia: [1, 1, 1]}\n"
                             "effects:\n"
                             "  - {type: spring, between: [{body: b, at: [1, 0, 0]}, world], stiffness: 3}\n"
                             "  - {type: joint_damper, joint: a, damping: 1}\n"
                             "output: {record: [position]}\n";

KT_TEST(info_plan_lists_kernels_and_what_is_left_out) {
    kt_write_file("e.yaml", sprung);
    kt_ran ran = kt_shell("$K info --plan e.yaml");
    kt_check_equal_int("exit code", ran.code, 0);
    static const char *const parts[] = {
        "effect joint_damper                        1 effect\n",
        "motion of links that carry forces          2 links\n",
        "effect spring                              1 effect\n",
        "articulated bodies in space                2 links\n",
        "quaternions to unit norm                   1 quaternion\n",
        "loops in space                             the scene names no loops",
        "gravity                                    the scene names none",
        "power of driven loops (inverse dynamics)   no balance is recorded",
        "energies                                   not recorded",
    };
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        kt_check_contains("plan", ran.out, parts[i]);
    ran = kt_shell("$K info --plan --json e.yaml");
    json_t *root = kt_json(ran.out);
    kt_check_text("plan", json_string_value(kt_json_find(root, "plan")), "spatial");
    size_t index;
    json_t *step;
    int ran_count = 0;
    json_array_foreach(json_object_get(root, "steps"), index, step) {
        const bool dropped = !json_is_null(json_object_get(step, "dropped"));
        const char *name = json_string_value(json_object_get(step, "name"));
        kt_check_true(name, dropped == (json_integer_value(json_object_get(step, "count")) == 0));
        kt_check_true(name, json_object_get(step, "flops") == NULL);
        ran_count += !dropped;
    }
    kt_check_equal_int("kernels that run", ran_count, 8);
    json_decref(root);
    kt_expect(1, "--plan goes with it", "$K info --json e.yaml");
}

KT_TEST(info_plan_names_the_form_of_each_constraint_group_and_why) {
    kt_ran ran = kt_shell("$K info --plan " KT_SCENES "/four-bar.yaml");
    kt_check_contains(
        "plan", ran.out,
        "\nForms of constraint groups\n"
        "  pin         1 group of 3 coordinates, 5 equations, rank 2: one pin closes three coordinates in a "
        "plane\n");
    ran = kt_shell("$K info --plan --json " KT_SCENES "/four-bar.yaml");
    json_t *root = kt_json(ran.out);
    const json_t *group = json_array_get(json_object_get(root, "groups"), 0);
    kt_check_equal_int("groups", (int)json_array_size(json_object_get(root, "groups")), 1);
    kt_check_text("form", json_string_value(json_object_get(group, "form")), "pin");
    kt_check_contains("reason", json_string_value(json_object_get(group, "reason")), "one pin closes");
    json_decref(root);
}

KT_TEST(info_plan_counts_one_in_the_singular) {
    kt_write_file("one.yaml", "kinetree: 1\nbodies:\n  - {name: a, joint: {type: free}, mass: 1, inertia: [1, 1, 1]}\n"
                              "effects:\n  - {type: drag, on: a, linear: 1}\n");
    const kt_ran ran = kt_shell("$K info --plan one.yaml");
    static const char *const parts[] = {"wrenches from bodies onto links            1 body\n",
                                        "articulated bodies in space                1 link\n",
                                        "energies                                   1 pass\n"};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        kt_check_contains("plan", ran.out, parts[i]);
}

KT_TEST(info_tells_how_a_scene_is_run) {
    kt_write_file("s.yaml", "kinetree: 1\n"
                            "name: a name\n"
                            "bodies: [{name: a, mass: 2, com: [1, 0, 0], inertia: [1, 1, 1], joint: {type: free}}]\n"
                            "simulate: {duration: 3, integrator: rk4, step: 0.01}\n"
                            "output: {interval: 0.1, record: [position, reaction]}\n");
    kt_ran ran = kt_shell("$K info s.yaml");
    kt_check_contains("name", ran.out, "a name\n");
    kt_check_contains("degrees of freedom", ran.out, "dof        6 (7 positions: 1 quaternion)\n");
    kt_check_contains("mass", ran.out, "mass       2 kg, centre at [1, 0, 0] m\n");
    kt_check_contains("gravity", ran.out, "gravity    none\n");
    kt_check_contains("run", ran.out, "simulate   3 s, rk4 with steps of 0.01 s, tree formulation\n");
    kt_check_contains("output", ran.out, "output     every 0.1 s: position, reaction\n");
}

/* Masses of 3 and 1 kg are at y = 1 and 3 m. The upper one is on a spring that is 0.5 m longer than its length. It
 * moves at 2 m/s along x. The centre of mass is at y = 1.5 m. This gives
 *     spring              0.5 * 80 * 0.25 J
 *     gravity             10 * (3 * 1 + 1 * 3) J
 *     momentum            2 kg m/s
 *     angular momentum    -2 * 3 kg m^2/s about the world's origin, -2 * (3 - 1.5) about the centre of mass */
KT_TEST(info_and_evaluate_count_springs_and_momentum) {
    kt_write_file("m.yaml", "kinetree: 1\n"
                            "gravity: [0, -10, 0]\n"
                            "bodies:\n"
                            "  - {name: low, mass: 3, joint: {type: prismatic, axis: x, at: [0, 1, 0]}}\n"
                            "  - {name: high, mass: 1, joint: {type: prismatic, axis: x, at: [0, 3, 0], velocity: 2}}\n"
                            "effects:\n"
                            "  - {type: spring, between: [low, high], stiffness: 80, length: 1.5}\n"
                            "simulate: {duration: 1}\n");
    kt_ran ran = kt_shell("$K info m.yaml");
    kt_check_contains("energy", ran.out, "energy     2 J kinetic, 70 J potential: 60 J of gravity, 10 J of effects\n");
    kt_check_contains("momentum", ran.out,
                      "momentum   [2, 0, 0] kg m/s, angular [0, 0, -6] kg m^2/s about the world's origin, [0, 0, -3] "
                      "about the centre of mass\n");
    ran = kt_shell("$K evaluate m.yaml");
    json_t *root = kt_json(ran.out);
    kt_check_near("mass", kt_json_at(root, "mass.total"), 4.0, 0.0);
    kt_check_near("centre", kt_json_at(root, "mass.center[1]"), 1.5, 1e-15);
    kt_check_near("linear", kt_json_at(root, "momentum.linear[0]"), 2.0, 0.0);
    kt_check_near("about the origin", kt_json_at(root, "momentum.angular[2]"), -6.0, 1e-14);
    kt_check_near("about the centre", kt_json_at(root, "momentum.angular_about_center[2]"), -3.0, 1e-14);
    kt_check_near("energy", kt_json_at(root, "energy.potential"), 70.0, 1e-13);
    json_decref(root);
}

KT_TEST(demo_lists_and_runs_the_scenes_of_a_folder) {
    kt_ran ran =
        kt_shell("mkdir -p scenes && $K make pendulum >scenes/one.yaml && $K make chain --links 3 "
                 ">scenes/two.yaml && echo 'kinetree: 7' >scenes/wrong.yaml && KINETREE_SCENES=scenes $K demo");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("list", ran.out, "one    pendulum of 1 link\ntwo    chain of 3 links\n");
    kt_check_contains("a wrong one", ran.out, "wrong  (does not read;");
    ran = kt_shell("KINETREE_SCENES=scenes $K demo two --duration 0.5 --quiet && cat two.csv");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("records", ran.out, "time,position.link1,position.link2,position.link3,");
    kt_check_contains("the last record", ran.out, "\n0.5,");
    kt_expect(1, "did you mean 'two'?", "KINETREE_SCENES=scenes $K demo tow");
    kt_expect(1, "--duration", "KINETREE_SCENES=scenes $K demo two --duraton 1");
    kt_expect(2, "no folder", "KINETREE_SCENES=nowhere $K demo");
}

KT_TEST(integrators_are_all_listed) {
    static const char *const names[] = {"euler", "rk4", "rkc2", "dop853"};
    kt_ran ran = kt_shell("$K integrators");
    kt_check_true("header",
                  strncmp(ran.out, "name            order  stages  adaptive  dense  family      title\n", 66) == 0);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char line[32];
        snprintf(line, sizeof line, "\n%s ", names[i]);
        const char *first = strstr(ran.out, line);
        kt_check_true(names[i], first != NULL && strstr(first + 1, line) != NULL); /* and its source */
    }
    kt_check_contains("dopri5", ran.out,
                      "\ndopri5              5       7       yes      4  explicit    Dormand-Prince");
    kt_check_contains("rk4", ran.out, "\nrk4                 4       4        no      3  ");
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

KT_TEST(pictures_are_drawn_or_rejected_in_words) {
    kt_expect(0, NULL, "$K make tree --joint mixed --links 9 >t.yaml");
#ifdef KT_WITH_CAIRO
    kt_expect(0, NULL,
              "$K run t.yaml --quiet --duration 0.2 --plot t.svg && $K run t.yaml --quiet --duration 0.2 --plot "
              "t.png");
    const char *svg = kt_read_file("t.svg");
    kt_check_contains("SVG", svg, "<svg");
    kt_check_contains("text is text", svg, ">time, s</text>");
    kt_check_true("and no letter is a shape", strstr(svg, "glyph") == NULL);
    kt_check_above("size", (double)strlen(svg), 10000.0);
    kt_ran ran = kt_shell("head -c 4 t.png | od -An -c; wc -c <t.png");
    kt_check_contains("PNG", ran.out, " 211   P   N   G\n");
    kt_check_above("size", strtod(ran.out + strcspn(ran.out, "\n"), NULL), 20000.0);
    kt_expect(1, "ends in .svg, .png or .pdf", "$K run t.yaml --plot t.jpg");
    kt_expect(4, "none/t.png cannot be written", "$K run t.yaml --quiet --duration 0.2 --plot none/t.png");
    kt_expect(4, "none/t.svg cannot be written", "$K run t.yaml --quiet --duration 0.2 --plot none/t.svg");
#else
    kt_expect(1, "without cairo", "$K run t.yaml --plot t.svg");
#endif
}

#ifdef KT_WITH_CAIRO
KT_TEST(picture_of_a_run_shows_what_is_recorded) {
    kt_write_file("w.yaml", "kinetree: 1\n"
                            "gravity: [0, -9.81, 1]\n"
                            "bodies: [{name: a, joint: {type: revolute, velocity: 1}, mass: 1, inertia: [1, 1, 1],\n"
                            "  com: [0.5, 0, 0], markers: {tip: [1, 0, 0]}}]\n"
                            "simulate: {duration: 0.5}\n");
    kt_expect(0, NULL, "$K run w.yaml --quiet --plot w.svg");
    const char *svg = kt_read_file("w.svg");
    kt_check_contains("angles", svg, ">Angles, rad<");
    kt_check_contains("energy", svg, ">Drift of the total energy, ");
    kt_check_true("no velocities", strstr(svg, "Angular velocities") == NULL);
    kt_expect(0, NULL, "$K run w.yaml --quiet --plot w.svg --record velocity,acceleration,reaction --markers a.tip");
    svg = kt_read_file("w.svg");
    static const char *const parts[] = {">Angular velocities, rad/s<",
                                        ">Angular accelerations, ",
                                        ">Markers, m<",
                                        ">a.tip.y<",
                                        ">Reactions: forces, ",
                                        ">a.mx<"};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
        kt_check_contains("recorded", svg, parts[i]);
    kt_check_true("no positions", strstr(svg, "Angles") == NULL);
}

/* Eleven joints: the first eight rest, the ninth turns slowly, the last ones fast, one trembles by rounding. A residual
 * falls to 1e-222. */
/* The name of a joint's column has no unit. A summary of the run next to the records has it. */
KT_TEST(plot_takes_units_from_the_summary_beside_it) {
    kt_write_file("two.yaml", "kinetree: 1\n"
                              "gravity: [0, -9.81, 0]\n"
                              "bodies:\n"
                              "  - {name: cart, joint: {type: prismatic, axis: y}, mass: 1}\n"
                              "  - {name: arm, joint: {type: revolute}, mass: 1, com: [1, 0, 0]}\n"
                              "simulate: {duration: 1}\n");
    kt_expect(0, NULL, "rm -f two.json; $K run two.yaml --quiet --out two.csv");
    kt_expect(0, "picture", "$K plot two.csv --columns position.arm,velocity.arm --out none.svg");
    kt_check_equal_int("without a summary", kt_count_of(kt_read_file("none.svg"), ">Positions, rad or m<"), 1);
    kt_expect(0, NULL, "$K run two.yaml --quiet --out two.csv --summary two.json");
    kt_expect(0, "picture", "$K plot two.csv --columns position.arm,velocity.arm --out arm.svg");
    kt_check_equal_int("an angle", kt_count_of(kt_read_file("arm.svg"), ">Positions, rad<"), 1);
    kt_check_equal_int("its rate", kt_count_of(kt_read_file("arm.svg"), ">Velocities, rad/s<"), 1);
    kt_expect(0, "picture", "$K plot two.csv --columns position.cart --out cart.svg");
    kt_check_equal_int("a length", kt_count_of(kt_read_file("cart.svg"), ">Positions, m<"), 1);
    kt_expect(0, "picture", "$K plot two.csv --columns position --out both.svg");
    kt_check_equal_int("both", kt_count_of(kt_read_file("both.svg"), ">Positions, rad or m<"), 1);
}

/* The names of two columns differ in their 600th letter. Of several words for a column of a sweep, the first counts. */
KT_TEST(plot_reads_names_of_any_length) {
    char a[601], text[4000];
    memset(a, 'x', 600);
    a[600] = '\0';
    snprintf(text, sizeof text, "time,%sa,%sb\n0,1,2\n1,2,5\n", a, a);
    kt_write_file("long.csv", text);
    kt_expect(0, "picture: long.svg", "$K plot long.csv --columns %sb --out long.svg", a);
    snprintf(text, sizeof text, "run,%sa,%sb,status,p.end,p.max\n0,1,1,done,1,2\n1,2,1,done,2,3\n2,1,2,done,3,4\n", a,
             a);
    kt_write_file("sweep.csv", text);
    kt_expect(0, "picture: map.svg", "$K plot sweep.csv --map %sa,%sb --columns p.end --out map.svg", a, a);
    kt_expect(0, "picture: by.svg", "$K plot sweep.csv --x p.max --columns %sb --out by.svg", a);
    kt_expect(1, "--map takes two columns, A,B, not 'p'", "$K plot sweep.csv --map p --columns p.end --out map.svg");
    kt_expect(1, "there is no column 'q'", "$K plot sweep.csv --map q,p.end --columns p.end --out map.svg");
    kt_expect(0, "picture: once.svg", "$K plot sweep.csv --x run --columns p.end --out once.svg");
    kt_expect(0, "picture: twice.svg", "$K plot sweep.csv --x run --columns p,p.end,p.max --out twice.svg");
    kt_expect(0, "picture: all.svg", "$K plot sweep.csv --x run --columns p --out all.svg");
    kt_expect(0, NULL, "cmp twice.svg all.svg");
}

/* `state` is recorded by default, and a column by a formula is recorded since the scene asks for it. A table without
 * any known quantity is drawn as a whole. */
KT_TEST(plot_shows_states_and_columns_by_formulas_by_default) {
    kt_write_file("rc.yaml", "kinetree: 1\n"
                             "bodies:\n"
                             "  - {name: rotor, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                             "states: {current: {initial: 1, rate: -current}}\n"
                             "effects: [{type: expression, joint: rotor, force: 2*current}]\n"
                             "simulate: {duration: 1}\n"
                             "output: {columns: {lag: current - velocity.rotor}, record: [position, state]}\n");
    kt_expect(0, NULL, "$K run rc.yaml --quiet --out rc.csv");
    kt_expect(0, "picture: rc.svg", "$K plot rc.csv");
    const char *svg = kt_read_file("rc.svg");
    kt_check_equal_int("auxiliary states", kt_count_of(svg, ">Auxiliary states<"), 1);
    kt_check_equal_int("own columns", kt_count_of(svg, ">Values<"), 1);
    kt_check_equal_int("the column", kt_count_of(svg, ">lag<"), 1);
    kt_check_equal_int("the time is no value", kt_count_of(svg, ">time<"), 0);
    kt_write_file("other.csv", "t,a,b.c\n0,1,2\n1,2,4\n2,0,9\n");
    kt_expect(0, "picture: other.svg", "$K plot other.csv");
    svg = kt_read_file("other.svg");
    kt_check_equal_int("a and b.c", kt_count_of(svg, ">a<") + kt_count_of(svg, ">b.c<"), 2);
}

KT_TEST(plot_takes_what_moves_and_leaves_out_noise) {
    char text[8192];
    size_t used = 0;
#define PUT(...) used += (size_t)snprintf(text + used, sizeof text - used, __VA_ARGS__)
    PUT("time");
    for (int k = 1; k <= 11; k++)
        PUT(",position.j%d", k);
    PUT(",reaction.pin.fx,reaction.pin.fz,reaction.pin.mz,constraint.position\n");
    for (int i = 0; i <= 20; i++) {
        PUT("%g", 0.05 * i);
        for (int k = 1; k <= 8; k++)
            PUT(",%g", k == 1 ? 0.0 : 0.1 * k);
        PUT(",%.17g,%.17g,%.17g", 0.01 * i, 0.3 * i, i % 2 * 1e-16);
        PUT(",%d,%.17g,%.17g,%s\n", 100 + i, i * 1e-14, 2.0 * i, i == 10 ? "1e-222" : "1e-16");
    }
#undef PUT
    kt_write_file("many.csv", text);
    kt_ran ran = kt_shell("$K plot many.csv --columns position,reaction,constraint --out many.svg");
    kt_check_equal_int("exit code", ran.code, 0);
    kt_check_contains("told", ran.err,
                      "left out of the picture, since zero or rounding noise: position.j1, position.j11, "
                      "reaction.pin.fz\n");
    const char *svg = kt_read_file("many.svg");
    static const char *const shown[] = {">j9<", ">j10<", ">j2<", ">j6<", ">pin.fx<", ">pin.mz<", "3 columns of zeros"};
    for (size_t i = 0; i < sizeof shown / sizeof *shown; i++)
        kt_check_contains("shown", svg, shown[i]);
    static const char *const hidden[] = {">j1<", ">j7<", ">j8<", ">j11<", ">pin.fz<", "\u2212222", "\u2212200"};
    for (size_t i = 0; i < sizeof hidden / sizeof *hidden; i++)
        kt_check_true(hidden[i], strstr(svg, hidden[i]) == NULL);
    ran = kt_shell("$K plot many.csv --columns position,reaction --log --out log.svg");
    kt_check_contains("noise on logarithmic axes", ran.err, "position.j11, reaction.pin.fz\n");
    kt_check_contains("signs are not drawn", kt_read_file("log.svg"), "; magnitudes</text>");
    kt_write_file("small.csv", "time,position.a,constraint.position\n0,1,1e-222\n1,2,3e-222\n");
    ran = kt_shell("$K plot small.csv --columns position,constraint --out small.svg");
    kt_check_contains("a residual that is none", ran.err, "rounding noise: constraint.position\n");
    kt_write_file("zeros.csv", "time,position.a,constraint.position\n0,1,0\n1,2,0\n");
    ran = kt_shell("$K plot zeros.csv --out zeros.svg");
    kt_check_contains("residuals that are zero", ran.err, "rounding noise: constraint.position\n");
    kt_check_true("have no panel", strstr(kt_read_file("zeros.svg"), "Loops open by") == NULL);
    kt_write_file("late.csv", "time,position.a,constraint.position\n0,101,0\n5,103,1e-16\n6,104,3e-16\n10,107,2e-16\n");
    kt_expect(0, "picture: late.svg", "$K plot late.csv --out late.svg");
    const char *two = strstr(kt_read_file("late.svg"), ">2<");
    kt_check_true("panels have one axis of time", two != NULL && strstr(two + 1, ">2<") != NULL);
    kt_write_file("units.csv", "time,effect.strut.force [N],effect.strut.power [W]\n0,1,2\n1,2,3\n");
    kt_expect(0, "picture: units.svg", "$K plot units.csv --columns effect.strut --out units.svg");
    kt_check_contains("a column without its unit", kt_read_file("units.svg"), ">strut.force<");
    kt_check_contains("which the title has", kt_read_file("units.svg"), ">Powers of effects, W<");
    ran = kt_shell("$K plot many.csv --columns position.j11 --out one.svg");
    kt_check_text("alone it is what was asked for", ran.err, "picture: one.svg\n");
    kt_check_contains("and shown", kt_read_file("one.svg"), ">j11<");
}

/* Pixels a unit, from the first and the last tick of an axis. */
static double scale_of_ticks(const char *svg, bool of_y) {
    double first = 0.0, last = 0.0, from = 0.0, to = 0.0;
    int count = 0;
    for (const char *at = strstr(svg, "<text"); at != NULL; at = strstr(at + 1, "<text")) {
        const char *content = strchr(at, '>');
        char anchor[16] = "", *end;
        const double value = strtod(content + 1, &end);
        double x, y;
        if (sscanf(at, "<text x=\"%lf\" y=\"%lf\" font-size=\"11.5\" fill=\"#%*6c\" text-anchor=\"%6[a-z]", &x, &y,
                   anchor) != 3 ||
            *end != '<' || (strcmp(anchor, "end") == 0) != of_y)
            continue;
        last = value;
        to = of_y ? -y : x;
        if (count++ == 0) {
            first = last;
            from = to;
        }
    }
    return count > 1 ? (to - from) / (last - first) : (double)NAN;
}

/* The range of x is 4 m, and that of y is 1 m. Both begin at 0. */
KT_TEST(path_in_space_has_one_scale_on_both_axes) {
    kt_write_file("path.csv", "time,marker.a.tip.x,marker.a.tip.y\n0,0,0\n1,1,1\n2,4,0.5\n");
    kt_expect(0, "picture: path.svg", "$K plot path.csv --x marker.a.tip.x --columns marker.a.tip.y");
    const char *svg = kt_read_file("path.svg");
    const double across = scale_of_ticks(svg, false);
    kt_check_above("pixels a metre", across, 50.0);
    kt_check_near("as many up", scale_of_ticks(svg, true), across, 0.02); /* places have two decimals */
}
#endif

/* A name without its first part. */
KT_TEST(half_names_of_markers_and_columns_are_completed) {
    kt_write_file("half.yaml", "kinetree: 1\n"
                               "bodies: [{name: leg, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1],\n"
                               "  markers: {toe: [1, 0, 0]}}]\n"
                               "simulate: {duration: 0.1}\n");
    kt_expect(1, "run: --markers takes BODY.MARKER, not 'toe'; did you mean 'leg.toe'?",
              "$K run half.yaml --markers toe");
    kt_expect(0, NULL, "$K run half.yaml --markers leg.toe --quiet");
#ifdef KT_WITH_CAIRO
    kt_expect(1,
              "there is no column 'leg'; about it there are 'position.leg', 'velocity.leg', 'marker.leg.toe.x', "
              "'marker.leg.toe.y' and 1 more\n",
              "$K plot half.csv --columns leg");
    kt_expect(1, "there is no column 'qqqqqqqq'; the columns are 'time', 'position.leg', 'velocity.leg', ",
              "$K plot half.csv --columns qqqqqqqq");
    kt_expect(1, "there is no column 'velocty'; did you mean 'velocity'?", "$K plot half.csv --columns velocty");
    kt_expect(1, "there is no column 'velocty'; the columns are ", "$K plot half.csv --x velocty");
#endif
    kt_expect(1, "half.yaml is a scene, not a robot: 'kinetree run half.yaml' runs it as it is", "$K import half.yaml");
}

/* ---- on a terminal ----------------------------------------------------------------------------------------------- */

KT_TEST(terminal_gets_boxes_and_a_bar) {
    kt_ran ran = kt_terminal("$K make tree --links 3 | $K info -");
    kt_check_contains("boxes", ran.out, "\u2514\u2500 link1");
    kt_check_contains("boxes", ran.out, "   \u251c\u2500 link2");
    ran = kt_terminal("LC_ALL=C $K make tree --links 3 | LC_ALL=C $K info -");
    kt_check_contains("no boxes in another locale", ran.out, "`- link1");
    /* A run that waits for the reader of its records takes more than a second on any machine: a bar, which is gone in
     * the end. */
    static const char line[] =
        "($K run c.yaml --integrator rk4 --step 1e-3 --interval 1e-3 --duration 2 --record energy --out - %s; "
        "echo $? >code) | (head -c 1; sleep 1.1; cat) >/dev/null";
    kt_shell("$K make chain --links 30 >c.yaml");
    ran = kt_terminal(line, "");
    kt_check_text("exit code", kt_read_file("code"), "0\n");
    kt_check_contains("bar", ran.out, "\u2588\u2588");
    kt_check_contains("it is cleared before the report", ran.out, "\r\033[Kchain of 30 links: ");
    ran = kt_terminal(line, "--quiet");
    kt_check_text("quiet", ran.out, "");
}
