/* Collisions of URDF and SDF that touch planes: which do, with which friction, and that robots rest on them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "folder.h"
#include "run_file.h"

#define ROBOT "r"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const kt_robot_options on_plane = {.contacts = true},
                              on_ground = {.contacts = true, .has_ground = true, .floating = true, .ground = -0.5};

static int count_contacts(const kt_scene *scene) {
    int count = 0;
    for (int i = 0; i < scene->description.effect_count; i++)
        count += scene->description.effects[i].type == KT_EFFECT_CONTACT;
    return count;
}

/* ---- which shapes touch ------------------------------------------------------------------------------------------ */

#define INERTIAL "<inertial><mass value='2'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>"
#define URDF_OF(link, geometry, collision, rest)                                                                       \
    "<robot name='r'><link name='a'>" INERTIAL link "<collision name='c'><origin xyz='0 0 .1'/><geometry>" geometry    \
    "</geometry>" collision "</collision></link>" rest "</robot>"
#define URDF(geometry, rest) URDF_OF("", geometry, "", rest)
#define BALL "<sphere radius='.1'/>"
#define GAZEBO(mu, mu2)                                                                                                \
    "<gazebo reference='a'><collision><surface><friction><ode><mu>" mu "</mu><mu2>" mu2                                \
    "</mu2></ode></friction></surface></collision></gazebo>"
#define DRAKE(slip, rest)                                                                                              \
    "<drake:proximity_properties><drake:mu_dynamic value='" slip "'/><drake:mu_static value='" rest                    \
    "'/></drake:proximity_properties>"
#define SDF_DRAKE "<drake:proximity_properties><drake:mu_dynamic>0.25</drake:mu_dynamic></drake:proximity_properties>"
#define BOX "<box size='.2 .4 .6'/>"
#define SDF_LINK(geometry, surface)                                                                                    \
    "<link name='l'><collision name='c'><geometry>" geometry "</geometry>" surface "</collision></link>"
#define SDF_WORLD(link, normal, surface)                                                                               \
    "<sdf version='1.9'><world name='w'><model name='m'><pose>0 0 2 0 0 0</pose>" link "</model>"                      \
    "<model name='ground'><static>true</static>" SDF_LINK("<plane><normal>" normal "</normal></plane>",                \
                                                          surface) "</model></world></sdf>"
#define SURFACE(contact, mu)                                                                                           \
    "<surface><contact>" contact "</contact><friction><ode><mu>" mu "</mu></ode></friction></surface>"
#define BULLET(mu, rest) "<surface><friction><bullet><friction>" mu "</friction></bullet>" rest "</friction></surface>"
#define SPHERE "<sphere><radius>.3</radius></sphere>"

KT_TEST(collisions_touch_planes_with_the_smaller_friction) {
    static const struct {
        const char *text;
        const kt_robot_options *options;
        int contacts;
        double friction;
    } table[] = {
        {URDF(BOX, ""), &on_ground, 8, 1.0},
        {URDF("<sphere radius='.1'/>", "<gazebo reference='a'><mu1>0.4</mu1></gazebo>"), &on_ground, 1, 0.4},
        {URDF("<sphere radius='.1'/>", "<gazebo reference='b'><mu1>0.4</mu1></gazebo>"), &on_ground, 1, 1.0},
        {URDF(BALL, GAZEBO("0.2", "0.2")), &on_ground, 1, 0.2},
        {URDF(BALL, GAZEBO("0.2", "0.2") "<gazebo reference='a'><mu1>0.4</mu1></gazebo>"), &on_ground, 1, 0.4},
        {URDF_OF("<contact><lateral_friction value='0.1'/><stiffness value='3'/></contact>", BALL, "", ""), &on_ground,
         1, 0.1},
        {URDF_OF("", BALL, DRAKE("0.15", "0.25"), ""), &on_ground, 1, 0.15},
        {URDF_OF("<contact><lateral_friction value='0.1'/></contact>", BALL, DRAKE("0.15", "0.15"), ""), &on_ground, 1,
         0.15},
        {SDF_WORLD(SDF_LINK(SPHERE, SDF_DRAKE), "0 0 1", SURFACE("", "0.3")), &on_plane, 1, 0.25},
        {URDF("<cylinder radius='.1' length='1'/>", ""), &on_ground, 2, 1.0},
        {URDF("<mesh filename='none.stl'/>", ""), &on_ground, 0, 0.0},
        {URDF(BOX, ""), &on_plane, 0, 0.0}, /* no plane, and it does not move */
        {SDF_WORLD(SDF_LINK(SPHERE, ""), "0 0 1", SURFACE("", "0.3")), &on_plane, 1, 0.3},
        {SDF_WORLD(SDF_LINK(SPHERE, SURFACE("", "0.2")), "0 0 1", SURFACE("", "50")), &on_plane, 1, 0.2},
        {SDF_WORLD(SDF_LINK(SPHERE, BULLET("0.15", "")), "0 0 1", SURFACE("", "0.2")), &on_plane, 1, 0.15},
        {SDF_WORLD(SDF_LINK(SPHERE, BULLET("0.15", "<ode><mu>0.3</mu></ode>")), "0 0 1", ""), &on_plane, 1, 0.3},
        {SDF_WORLD(SDF_LINK(SPHERE, SURFACE("<collide_bitmask>0x02</collide_bitmask>", "1")), "0 0 1",
                   SURFACE("<collide_bitmask>0x05</collide_bitmask>", "1")),
         &on_plane, 0, 0.0},
        {SDF_WORLD(SDF_LINK(SPHERE, SURFACE("<collide_without_contact>true</collide_without_contact>", "1")), "0 0 1",
                   ""),
         &on_plane, 0, 0.0},
        {SDF_WORLD(SDF_LINK("<capsule><radius>.1</radius><length>1</length></capsule>", ""), "1 0 0", ""), &on_plane, 2,
         1.0},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, table[i].options);
        kt_check_equal_int(table[i].text, count_contacts(scene), table[i].contacts);
        for (int k = 0; k < scene->description.effect_count; k++)
            if (scene->description.effects[k].type == KT_EFFECT_CONTACT)
                kt_check_near("friction", scene->description.effects[k].friction, table[i].friction, 0.0);
    }
}

#define TORSIONAL(rest) "<surface><friction><torsional>" rest "</torsional></friction></surface>"

/* PyBullet gives the arms; SDF gives a patch of radius a, on which the pressure of Hertz has the moment of the friction
 * at the distance 3 pi a / 16 on average. The larger arm of both surfaces counts. */
KT_TEST(collisions_have_arms_of_rolling_and_torsional_friction) {
    static const double average = 0.58904862254808623;
    static const struct {
        const char *text;
        double rolling, torsion;
    } table[] = {
        {URDF(BALL, ""), 0.0, 0.0},
        {URDF_OF("<contact><rolling_friction value='.02'/><spinning_friction value='.03'/></contact>", BALL, "", ""),
         0.02, 0.03},
        {SDF_WORLD(SDF_LINK(SPHERE, ""), "0 0 1", TORSIONAL("<patch_radius>.1</patch_radius>")), 0.0, 0.1 * average},
        {SDF_WORLD(SDF_LINK(SPHERE, TORSIONAL("<coefficient>.5</coefficient><patch_radius>.3</patch_radius>")), "0 0 1",
                   TORSIONAL("<patch_radius>.1</patch_radius>")),
         0.0, 0.15 * average},
        {SDF_WORLD(SDF_LINK(SPHERE, TORSIONAL("<use_patch_radius>false</use_patch_radius>"
                                              "<patch_radius>.3</patch_radius><surface_radius>1</surface_radius>")),
                   "0 0 1", ""),
         0.0, 0.0},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, strstr(table[i].text, "<sdf") ? &on_plane : &on_ground);
        kt_check_equal_int(table[i].text, count_contacts(scene), 1);
        for (int k = 0; k < scene->description.effect_count; k++)
            if (scene->description.effects[k].type == KT_EFFECT_CONTACT) {
                kt_check_near("rolling", scene->description.effects[k].rolling, table[i].rolling, 0.0);
                kt_check_near("torsion", scene->description.effects[k].torsion, table[i].torsion, 1e-15);
            }
    }
}

/* Frictions that a contact cannot have, or that disagree, are warnings; equal ones are not. */
KT_TEST(frictions_that_a_contact_cannot_have_are_warnings) {
    static const char by_direction[] = "mu2 differs from mu1", at_rest[] = "mu_static differs",
                      disputed[] = "different frictions", deepening[] = "has a surface_radius";
    static const struct {
        const char *text;
        const char *note;
    } table[] = {
        {URDF(BALL, GAZEBO("0.2", "0.2")), NULL},
        {URDF(BALL, GAZEBO("0.2", "0.3")), by_direction},
        {URDF(BALL, "<gazebo reference='a'><mu2>0.5</mu2></gazebo>"), by_direction},
        {URDF_OF("", BALL, DRAKE("0.1", "0.1"), ""), NULL},
        {URDF_OF("", BALL, DRAKE("0.1", "0.2"), ""), at_rest},
        {URDF_OF("<contact><lateral_friction value='0.1'/></contact>", BALL, "", GAZEBO("0.1", "0.1")), NULL},
        {URDF_OF("<contact><lateral_friction value='0.1'/></contact>", BALL, "", GAZEBO("0.2", "0.2")), disputed},
        {SDF_WORLD(SDF_LINK(SPHERE, "<surface><friction><ode><mu>1</mu><mu2>2</mu2></ode></friction></surface>"),
                   "0 0 1", ""),
         by_direction},
        {SDF_WORLD(SDF_LINK(SPHERE, TORSIONAL("<use_patch_radius>false</use_patch_radius>"
                                              "<surface_radius>1</surface_radius>")),
                   "0 0 1", ""),
         deepening},
        {SDF_WORLD(SDF_LINK(SPHERE, TORSIONAL("<surface_radius>1</surface_radius>")), "0 0 1", ""), NULL},
    };
    static const char *const notes[] = {by_direction, at_rest, disputed, deepening};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, &on_ground);
        for (size_t k = 0; k < sizeof notes / sizeof *notes; k++)
            kt_check_equal_int(table[i].text, has_ranked_note(scene, KT_NOTE_RANK_MOTION, notes[k]),
                               table[i].note == notes[k]);
    }
}

KT_TEST(free_robots_without_ground_are_told_in_all_formats) {
    static const kt_robot_options floating = {.floating = true}, groundless = {.floating = true, .contacts = true},
                                  deep = {.floating = true, .contacts = true, .has_ground = true, .ground = 0.3};
    static const struct {
        const char *text;
        const kt_robot_options *options;
        const char *note;
    } table[] = {
        {URDF(BOX, ""), &floating, "falls, 4.9 m in the first second"},
        {URDF(BOX, ""), &groundless, "--ground HEIGHT adds a floor"},
        {URDF(BOX, ""), &deep, "starts 0.5 m deep in the ground"},
        {URDF("<mesh filename='none.stl'/>", ""), &on_ground, "no mesh that can be read"},
        {SDF_WORLD(SDF_LINK(SPHERE, ""), "0 0 1", ""), NULL, "falls, 4.9 m in the first second"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, table[i].options);
        kt_check_true(table[i].note, has_ranked_note(scene, KT_NOTE_RANK_MOTION, table[i].note));
    }
}

/* ---- robots that rest -------------------------------------------------------------------------------------------- */

/* The height of a free body after ten seconds. */
static double rest_height(const char *text, const kt_robot_options *options, const char *body) {
    return positions_of(run_file(kt_test_file(kt_test_folder(), "r.urdf", text), options, NULL, 10.0), body)[2];
}

/* With MuJoCo's defaults x is small against the third number of solimp, so that d(x) = 0.9 to 0.95; k and b follow.
 * Here by bisection, of N A (1 - d) = k d^2 x with k = 1 / (0.95^2 0.02^2). */
static double depth_of(double mobility, double force) {
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 200; i++) {
        const double x = 0.5 * (low + high), part = fmin(x / 0.001, 1.0);
        const double d = 0.9 + 0.05 * (part < 0.5 ? 2.0 * part * part : 1.0 - 2.0 * (1.0 - part) * (1.0 - part));
        if (d * d * x / (0.9025 * 4e-4) < mobility * force * (1.0 - d))
            low = x;
        else
            high = x;
    }
    return high;
}

/* A ball that falls by 10 cm rests at the depth of its weight, which is between those of the law: its stiffness has
 * MuJoCo's depth under an eighth and under half of the weight. A box rests on four corners. */
KT_TEST(dropped_bodies_rest_at_the_depth_of_the_law) {
    const kt_robot_options ground = {.contacts = true, .has_ground = true, .floating = true, .ground = -0.1};
    const double weight = 2.0 * 9.81, x1 = depth_of(0.5, weight / 8.0), x2 = depth_of(0.5, weight / 2.0);
    const double power = log(4.0) / log(x2 / x1);
    kt_check_near("ball", rest_height(URDF("<sphere radius='.1'/>", ""), &ground, "a"),
                  -0.1 - x1 * pow(8.0, 1.0 / power), 1e-11);
    const kt_robot_options low = {.contacts = true, .has_ground = true, .floating = true, .ground = -0.3};
    kt_check_near("box", rest_height(URDF(BOX, ""), &low, "a"), -0.1 - x1 * pow(2.0, 1.0 / power), 1e-11);
}

/* A crate of SDF slides down an inclined plane, if the friction is less than the slope, and stays otherwise. */
KT_TEST(crates_slide_on_inclined_planes_of_sdf_by_their_friction) {
    static const char form[] =
        "<sdf version='1.9'><world name='w'><model name='m'><pose>0 0 .11 0 0.3 0</pose><link "
        "name='l'><inertial><mass>1"
        "</mass><inertia><ixx>.01</ixx><iyy>.01</iyy><izz>.01</izz></inertia></inertial><collision name='c'><geometry>"
        "<box><size>.2 .2 .2</size></box></geometry></collision></link></model><model name='ground'><static>1</static>"
        "<link name='l'><collision name='c'><geometry><plane><normal>0.29552 0 0.95534</normal></plane></geometry>"
        "<surface><friction><ode><mu>%s</mu></ode></friction></surface></collision></link></model></world></sdf>";
    static const char *const frictions[] = {"0.1", "0.6"};
    double x[2] = {(double)NAN, (double)NAN};
    for (int i = 0; i < 2; i++) {
        char text[2000];
        (void)snprintf(text, sizeof text, form, frictions[i]);
        const kt_mechanism *m = run_file(kt_test_file(kt_test_folder(), "crate.sdf", text), &on_plane, NULL, 1.0);
        x[i] = kt_simulation_positions(m->simulation)[kt_body_coordinates(m->model, 1).q];
    }
    /* g (sin 0.3 - 0.1 cos 0.3) t^2 / 2 along the slope, of which cos 0.3 along x; g is 9.8 m/s^2 */
    kt_check_near("it slides", x[0], 4.9 * (sin(0.3) - 0.1 * cos(0.3)) * cos(0.3), 0.005);
    kt_check_near("it stays", x[1], 0.0, 5e-4);
}
