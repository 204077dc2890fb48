/* Masses and inertias of URDF: those that no body has, judged by rigid parts, and those that the file lacks. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "r.urdf"
#include "robot.h"

#include "kinetree/kinetree.h"

#include <stdio.h>

/* ---- inertias that no body has ----------------------------------------------------------------------------------- */

#define INERTIA(mass, x, y, z)                                                                                         \
    "<inertial><mass value='" mass "'/><inertia ixx='" x "' iyy='" y "' izz='" z                                       \
    "' ixy='0' ixz='0' iyz='0'/></inertial>"
#define ARM_WITH(arm, sensor)                                                                                          \
    "<robot name='r'><link name='base'/><link name='arm'>" arm "</link><link name='imu'>" sensor "</link>"             \
    "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/></joint>"                               \
    "<joint name='k' type='fixed'><parent link='arm'/><child link='imu'/><origin xyz='0.5 0 0' rpy='0.3 0.2 0.1'/>"    \
    "</joint></robot>"

KT_TEST(inertias_are_judged_by_rigid_parts) {
    static const struct {
        const char *text;
        bool read[3]; /* warn, strict, accept */
        const char *told;
    } table[] = {
        {ARM_WITH(INERTIA("1", "0.1", "0.1", "0.1"), INERTIA("0.001", "0", "0", "3e-6")),
         {true, true, true},
         "of links, within"},
        {ARM_WITH(INERTIA("1", "0.1", "0.1", "0.1"), INERTIA("0", "0", "0", "2e-35")),
         {true, true, true},
         "nothing but rounding"},
        {ARM_WITH(INERTIA("1", "1", "1", "2.1"), ""), {true, false, true}, "by up to 5 % of it: 1"},
        {ARM_WITH(INERTIA("1", "1", "1", "2.3"), ""), {false, false, true}, "by up to 15 % of it: 1"},
        {ARM_WITH(INERTIA("1", "-1", "1", "1"), ""), {false, false, true}, "impossible inertias are used as they are"},
        {ARM_WITH(INERTIA("1", "1", "1", "1"), INERTIA("1", "-3", "1", "1")),
         {false, false, true},
         "impossible inertias"},
        {ARM_WITH(INERTIA("1", "1", "1", "1"), ""), {true, true, true}, ""},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        for (int how = 0; how < 3; how++) {
            const kt_robot_options options = {.inertia = (kt_robot_inertia)how};
            kt_scene *scene = kt_test_scene_place();
            const kt_status status = parse(table[i].text, &options, scene);
            kt_note("case %d, %d: %s", (int)i, how, status == KT_OK ? "read" : faults.text);
            kt_check_equal_int("read", status == KT_OK, table[i].read[how]);
            if (status != KT_OK) {
                kt_check_contains("at the element", faults.text, "inertial: inertia: the principal moments are");
                continue;
            }
            kt_check_equal_int(table[i].told, count_notes(scene, table[i].told) > 0,
                               table[i].told[0] != '\0' || scene->note_count > 0);
            (void)kt_test_scene(kt_test_written(scene));
        }
}

/* A mass of 1 kg at 0.5 m from the link's origin has `0.25 kg m^2` about it. Its rounding is some 1e-16. A moment of
 * 1e-12 without other moments is rejected. */
KT_TEST(rounding_of_zero_is_no_inertia_of_a_part_alone) {
    static const struct {
        const char *inertia;
        bool is_nothing;
    } table[] = {{"2e-35", true}, {"-3e-17", true}, {"1e-12", false}, {"-1e-12", false}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[900];
        kt_scene *scene = kt_test_scene_place();
        (void)snprintf(text, sizeof text,
                       "<robot name='r'><link name='base'/><link name='head'><inertial><mass value='1'/><origin "
                       "xyz='0.5 0 0'/><inertia ixx='0' iyy='0' izz='%s' ixy='0' ixz='%s' iyz='0'/></inertial></link>"
                       "<joint name='j' type='continuous'><parent link='base'/><child link='head'/><axis xyz='0 0 1'/>"
                       "</joint></robot>",
                       table[i].inertia, table[i].inertia);
        const kt_status status = parse(text, NULL, scene);
        kt_check_equal_int(table[i].inertia, status == KT_OK, table[i].is_nothing);
        if (status != KT_OK)
            continue;
        const kt_sym3 *inertia = &find_body(scene, "head")->inertia;
        kt_check_equal_bits("it is zero", &inertia->xx, (const double[]){0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 6);
        kt_check_equal_int("told", count_notes(scene, "nothing but rounding, taken for zero: 1"), 1);
    }
}

/* The part is a dumbbell: two points of `1 kg`, `1 m` apart along x. Each of its links has an odd inertia: 0.1 along x
 * and -0.1 along y. Together they have `0.2 - 0.2 + 0.5` about y. The inertia of one link alone, or with the parallel
 * axes the wrong way round, is rejected. */
KT_TEST(inertia_of_a_part_is_that_of_its_links_about_their_common_centre) {
    for (int tenths = 0; tenths < 10; tenths++) {
        /* x: 0.4; y: -0.2 + d^2 / 2; z: 0.2 + d^2 / 2. z <= x + y always; x <= y + z: 0.4 <= d^2; y >= 0: d^2 >=
         * 0.4. */
        const double d = 0.1 * tenths, x = 0.4, y = -0.2 + 0.5 * d * d, z = 0.2 + 0.5 * d * d;
        const bool is_body = y >= 0.0 && x <= y + z && z <= x + y + 1e-12;
        const kt_robot_options strict = {.inertia = KT_ROBOT_INERTIA_STRICT};
        char text[1000];
        kt_scene *scene = kt_test_scene_place();
        (void)snprintf(
            text, sizeof text,
            "<robot name='r'><link name='base'/><link name='a'>" INERTIA(
                "1", "0.2", "-0.1",
                "0.1") "</link><link name='b'>" INERTIA("1", "0.2", "-0.1",
                                                        "0.1") "</link><joint name='j' type='continuous'><parent "
                                                               "link='base'/><child link='a'/></joint>"
                                                               "<joint name='k' type='fixed'><parent link='a'/><child "
                                                               "link='b'/><origin xyz='0.%d 0 0'/></joint></robot>",
            tenths);
        const kt_status status = parse(text, &strict, scene);
        kt_note("d = %.1f m", d);
        kt_check_equal_int("read", status == KT_OK, is_body);
    }
}

/* ---- masses that the file does not have -------------------------------------------------------------------------- */

#define BARE                                                                                                           \
    "<robot name='r'><link name='a'/><link name='b'><visual><geometry><sphere radius='0.5'/></geometry></visual>"      \
    "</link><joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint></robot>"

/* Places and mobility exist without masses, accelerations do not; one mass is enough for this robot. */
KT_TEST(robot_without_masses_has_places_but_no_accelerations) {
    static const char *const masses[] = {"b=2"};
    const kt_robot_options weighed = {.masses = masses, .mass_count = 1};
    const double q = 0.3, v = 1.0, mass[] = {0.0, 2.0};
    for (int with = 0; with < 2; with++) {
        kt_error error = {0};
        double a = 0.0;
        const kt_opened r = kt_test_open(test_robot(BARE, with ? &weighed : NULL), NULL);
        kt_check_equal_int("degrees of freedom", kt_model_mobility(r.model).minimal, 1);
        kt_check_equal_int("places", kt_kinematics_update(r.model, r.data, &q, &v, NULL, &error), KT_OK);
        kt_check_equal_int("accelerations",
                           kt_acceleration_evaluate(r.model, r.data, 0.0, &q, &v, NULL, NULL, &a, &error),
                           with ? KT_OK : KT_ERROR_SINGULAR);
        kt_check_equal_int("it is told", has_note(r.scene, "no link has a mass"), !with);
        kt_check_equal_bits("mass", &find_body(r.scene, "b")->mass, &mass[with], 1);
    }
}
