/* Models in MJCF: the result of each element, included files, copies, warnings, and faults at their places. Numbers of
 * trees, forces and equalities are compared with MuJoCo in mjcf_mujoco.c. */
#define ROBOT "m.xml"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define BALL "<geom size='0.1'/>"
#define WORLD(within) "<mujoco><worldbody>" within "</worldbody></mujoco>"

/* ---- what becomes of a model ------------------------------------------------------------------------------------- */

KT_TEST(single_joint_at_the_origin_is_that_of_its_body) {
    kt_scene scene;
    if (!parse_right(WORLD("<body name='a' pos='1 2 3'><joint name='j' axis='0 1 0' armature='0.5'/>" BALL "</body>"),
                     NULL, &scene))
        return;
    const kt_body *a = find_body(&scene, "a");
    kt_check_equal_int("bodies", scene.description.body_count, 1);
    kt_check_equal_int("type", a->joint.type, KT_JOINT_REVOLUTE);
    kt_check_equal_bits("place", &a->joint.at.x, (const double[]){1.0, 2.0, 3.0}, 3);
    kt_check_equal_bits("armature", &a->joint.armature[0], &(double){0.5}, 1);
    kt_check_near("mass", a->mass, 4.0 / 3.0 * acos(-1.0), 1e-15);
    kt_scene_free(&scene);
}

KT_TEST(further_joints_of_a_body_and_those_off_its_origin_have_bodies_of_their_own) {
    kt_scene scene;
    if (!parse_right(WORLD("<body name='a'><joint name='x' axis='1 0 0'/><joint name='y' pos='0 0 1'/>" BALL "</body>"),
                     NULL, &scene))
        return;
    kt_check_equal_int("bodies", scene.description.body_count, 3);
    kt_check_text("y is on x", find_body(&scene, "y")->parent, "x");
    kt_check_text("a is on y", find_body(&scene, "a")->parent, "y");
    kt_check_equal_int("fixed", find_body(&scene, "a")->joint.type, KT_JOINT_FIXED);
    kt_check_equal_bits("back at the origin", &find_body(&scene, "a")->joint.at.x, (const double[]){-0.0, -0.0, -1.0},
                        3);
    kt_check_equal_bits("without mass", &find_body(&scene, "y")->mass, &(double){0.0}, 1);
    kt_scene_free(&scene);
}

/* The mass matrix at the start, by the compiled model. */
static int mass_of(const kt_scene *scene, double *matrix) {
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_error error = {0};
    int nv = -1;
    double q[64];
    if (kt_model_compile(&scene->description, NULL, &model, &error) == KT_OK && kt_model_nv(model) <= 8 &&
        kt_data_create(model, &data, &error) == KT_OK) {
        nv = kt_model_nv(model);
        double v[8];
        kt_model_initial(model, q, v);
        nv = kt_dynamics_mass(model, data, q, matrix, &error) == KT_OK ? nv : -1;
    }
    kt_data_free(data);
    kt_model_free(model);
    return nv;
}

/* Two texts that describe the same mechanism. */
static void check_same(const char *what, const char *one, const char *other) {
    double a[64], b[64];
    kt_scene first, second;
    if (!parse_right(one, NULL, &first))
        return;
    if (!parse_right(other, NULL, &second)) {
        kt_scene_free(&first);
        return;
    }
    kt_worst worst = kt_worst_make(what);
    const int n = mass_of(&first, a);
    if (kt_check_equal_int("degrees of freedom", n, mass_of(&second, b)) && kt_check_above("of both", n, 0.5))
        for (int i = 0; i < n * n; i++)
            kt_worst_near(&worst, a[i], b[i], 64.0 * DBL_EPSILON * fmax(fabs(b[i]), 1.0), "%d", i);
    kt_check_worst(&worst);
    kt_scene_free(&first);
    kt_scene_free(&second);
}

#define ARM(placing, extra)                                                                                            \
    "<body name='a' " placing                                                                                          \
    "><joint name='j' axis='1 2 3'/><geom type='box' size='0.1 0.2 0.3' pos='0.3 0 0'/>" extra "</body>"

KT_TEST(frames_and_copies_stand_where_bodies_written_by_hand_do) {
    check_same("a frame", WORLD("<frame pos='1 2 3' euler='0 0 90'>" ARM("pos='1 0 0'", "") "</frame>"),
               WORLD(ARM("pos='1 3 3' euler='0 0 90'", "")));
    check_same("what is in a frame of a body",
               WORLD("<body><frame pos='0 1 0' euler='90 0 0'><joint axis='0 1 0'/><geom size='0.1 0.2' type='capsule' "
                     "pos='1 0 0'/></frame></body>"),
               WORLD("<body><joint axis='0 0 1' pos='0 1 0'/><geom size='0.1 0.2' type='capsule' pos='1 1 0' euler='90 "
                     "0 0'/></body>"));
    check_same(
        "copies",
        WORLD("<replicate count='2' offset='0 1 0' euler='90 0 0' sep='-'><body name='a' pos='0 1 2'><joint/>" BALL
              "<geom size='0.2' pos='0.2 0.3 0.1'/></body></replicate>"),
        WORLD("<body pos='0 1 2'><joint/>" BALL "<geom size='0.2' pos='0.2 0.3 0.1'/></body>"
              "<body pos='0 -1 1' quat='1 1 0 0'><joint/>" BALL "<geom size='0.2' pos='0.2 0.3 0.1'/></body>"));
}

KT_TEST(joints_keep_their_names_and_limits) {
    kt_scene scene;
    if (!parse_right(WORLD("<body name='a'><joint name='hip' range='-90 45' limited='true' actuatorfrcrange='-20 30' "
                           "actuatorfrclimited='true'/>" BALL "<body name='b'><joint name='a' type='slide'/>" BALL
                           "<body name='c'><joint/>" BALL "</body></body></body>"),
                     NULL, &scene))
        return;
    const kt_joint *hip = &scene.description.bodies[0].joint;
    kt_check_text("its own", hip->name, "hip");
    kt_check_near("lower", hip->limits.lower, -1.5707963267948966, 1e-15);
    kt_check_near("upper", hip->limits.upper, 0.78539816339744828, 1e-15);
    kt_check_near("effort", hip->limits.effort, 30.0, 1e-15);
    kt_check_text("that of another body, whose joint has its own", scene.description.bodies[1].joint.name, "a");
    kt_check_true("none: that of the body", scene.description.bodies[2].joint.name == NULL);
    kt_scene_free(&scene);
}

KT_TEST(copies_bear_numbers) {
    kt_scene scene;
    if (!parse_right(
            WORLD("<replicate count='10' offset='0 1 0' sep='-'><body name='a'><joint/>" BALL "</body></replicate>"),
            NULL, &scene))
        return;
    kt_check_equal_int("bodies", scene.description.body_count, 10);
    kt_check_text("first", scene.description.bodies[0].name, "a-00");
    kt_check_text("last", scene.description.bodies[9].name, "a-09");
    kt_check_near("place of the last", scene.description.bodies[9].joint.at.y, 9.0, 1e-14);
    kt_scene_free(&scene);
}

KT_TEST(keyframe_is_the_start_and_gives_controls) {
    static const char text[] =
        "<mujoco><worldbody><body name='f' pos='1 1 1'><freejoint/>" BALL "</body><body name='a'><joint name='a' "
        "ref='30'/>" BALL "<body name='b'><joint type='ball'/>" BALL
        "</body></body></worldbody><actuator><motor name='m' "
        "joint='a' gear='3'/><position joint='a' kp='4' gear='2'/></actuator><keyframe><key name='other'/><key "
        "name='k' "
        "qpos='1 2 3 0 1 0 0 0.5 0 0 1 0' qvel='1 2 3 4 5 6 7 8 9 10' ctrl='0.25 0.5'/></keyframe></mujoco>";
    const kt_robot_options options = {.keyframe = "k"};
    kt_scene scene;
    if (!parse_right(text, &options, &scene))
        return;
    const kt_body *f = find_body(&scene, "f");
    kt_check_equal_bits("free", f->joint.position, (const double[]){1, 2, 3, 0, 1, 0, 0}, 7);
    kt_check_equal_bits("its velocity", f->joint.velocity, (const double[]){1, 2, 3, 4, 5, 6}, 6);
    kt_check_equal_bits("hinge", find_body(&scene, "a")->joint.position, (const double[]){0.5}, 1);
    kt_check_equal_bits("ball", find_body(&scene, "b")->joint.position, (const double[]){0, 0, 1, 0}, 4);
    const kt_effect *effects = scene.description.effects;
    kt_check_near("torque of the motor, gear u", effects[0].torque.value, 0.75, 1e-15);
    kt_check_near("stiffness of the servo, gear^2 kp", effects[1].stiffness, 16.0, 1e-15);
    kt_check_near("its target, u / gear", effects[1].target.value, 0.25, 1e-15);
    kt_scene_free(&scene);
    if (!parse_right(text, NULL, &scene))
        return;
    kt_check_near("without a keyframe the reference position", find_body(&scene, "a")->joint.position[0],
                  acos(-1.0) / 6.0, 1e-15);
    kt_scene_free(&scene);
}

/* A ball of 3 kg and radius `0.1 m`, 0.5 m below its hinge: `I = 0.1 + 2/5 3 0.1^2 + 3 0.5^2`. Along g q the inertia is
 * `I / g^2`, and the damping in the joint `g^2 2 zeta sqrt(kp I / g^2)`. The control 0 is moved into half of `0.2 to
 * 1`. */
KT_TEST(servo_has_a_ratio_of_the_critical_damping_and_the_range_of_its_joint) {
    static const char text[] =
        "<mujoco><compiler angle='radian'/><worldbody><body name='a'><joint name='a' axis='0 1 0' armature='0.1' "
        "range='0.2 1'/>"
        "<geom size='0.1' pos='0 0 -0.5' mass='3'/></body></worldbody>"
        "<actuator><position joint='a' kp='50' dampratio='0.5' gear='2' inheritrange='0.5'/></actuator></mujoco>";
    kt_scene scene;
    if (!parse_right(text, NULL, &scene))
        return;
    if (kt_check_equal_int("effects", scene.description.effect_count, 1)) {
        const kt_effect *servo = &scene.description.effects[0];
        const double inertia = 0.1 + 0.4 * 3.0 * 0.01 + 3.0 * 0.25;
        kt_check_near("stiffness, g^2 kp", servo->stiffness, 200.0, 1e-13);
        kt_check_near("damping", servo->damping, 2.0 * sqrt(50.0 * inertia), 1e-13);
        kt_check_near("target", servo->target.value, 0.2, 1e-15);
    }
    kt_scene_free(&scene);
}

/* Of radii 1, 4, 9 m along z, x and y: 9 m along y, and sqrt(1 4) = 2 m across. */
KT_TEST(ellipsoids_are_drawn_as_rods_as_long_or_spheres) {
    kt_scene scene;
    if (!parse_right(WORLD("<body name='a'><geom type='ellipsoid' size='4 9 1' pos='1 2 3'/></body>"
                           "<body name='b'><geom type='ellipsoid' size='2 2 2' pos='1 2 3'/></body>"),
                     NULL, &scene))
        return;
    const kt_shape *rod = &find_body(&scene, "a")->shape, *ball = &find_body(&scene, "b")->shape;
    kt_check_equal_int("rod", rod->type, KT_SHAPE_ROD);
    kt_check_near("radius", rod->radius, 2.0, 1e-15);
    kt_check_equal_bits("from", &rod->from.x, (const double[]){1.0, -5.0, 3.0}, 3);
    kt_check_equal_bits("to", &rod->to.x, (const double[]){1.0, 9.0, 3.0}, 3);
    kt_check_equal_int("ball", ball->type, KT_SHAPE_SPHERE);
    kt_check_near("its radius", ball->radius, 2.0, 1e-15);
    kt_check_contains("told", scene.notes[2].what, "ellipsoids, which pictures have as rods");
    kt_scene_free(&scene);
}

KT_TEST(sites_are_markers_limits_are_stops_and_floating_frees) {
    const kt_robot_options options = {.floating = true, .stop_stiffness = 10.0, .stop_damping = 2.0};
    kt_scene scene;
    if (!parse_right(WORLD("<body name='base'>" BALL "<body name='a'><joint range='-90 45'/>" BALL
                           "<site name='tip' pos='1 2 3'/></body></body>"),
                     &options, &scene))
        return;
    const kt_body *a = find_body(&scene, "a");
    kt_check_equal_int("base", find_body(&scene, "base")->joint.type, KT_JOINT_FREE);
    kt_check_equal_int("markers", a->marker_count, 1);
    kt_check_equal_bits("place", &a->markers[0].at.x, (const double[]){1.0, 2.0, 3.0}, 3);
    kt_check_equal_int("effects", scene.description.effect_count, 1);
    kt_check_near("lower", scene.description.effects[0].lower, -acos(-1.0) / 2.0, 1e-15);
    kt_check_near("upper", scene.description.effects[0].upper, acos(-1.0) / 4.0, 1e-15);
    kt_scene_free(&scene);
}

/* ---- what is told ------------------------------------------------------------------------------------------------ */

KT_TEST(what_is_changed_or_left_out_is_told_once_with_number_and_place) {
    static const char text[] =
        "<mujoco>\n<worldbody><camera/><camera/>\n<body name='a b'><joint name='j' range='0 1' dampin='1'/>" BALL
        "</body>\n<body name='m' mocap='true'/><attach body='y' "
        "prefix='z'/></worldbody>\n<tendon><spatial/></tendon>\n<actuator><muscle joint='j'/>"
        "<motor joint='j'/></actuator>\n<equality><joint joint1='j' "
        "polycoef='1'/></equality><keyframe><key/></keyframe>"
        "</mujoco>";
    static const char *const expected[][2] = {
        {"m.xml:3:1", "names of bodies that a scene cannot have, with '_' or a number: 1"},
        {"m.xml:4:1", "bodies that are fixed to the world (--floating lets them move): 1"},
        {"m.xml:4:30", "bodies of this model that it attaches again (attach without a model), left out: 1"},
        {"m.xml:4:1", "bodies that a program moves (mocap), fixed to the world: 1"},
        {"m.xml:7:64", "keyframes, of which none is the start (import --keyframe NAME): 1"},
        {"m.xml:3:1", "bodies whose mass and inertia are those of their geoms: 1"},
        {"m.xml:7:11", "soft equalities, which are exact loops in the scene: 1"},
        {"m.xml:6:30", "motors, whose torque is that of the control at the start (0 without --keyframe): 1"},
        {"m.xml:3:18", "limits of position, which do not act without --stops: 1"},
        {"m.xml:3:58", "geoms that could touch others, left out, since contacts are effects: 1"},
        {"m.xml:5:9", "a force or an equality that is left out, spatial tendon around a geom that is no sphere or "
                      "cylinder, or without two sites in a "
                      "branch: 1"},
        {"m.xml:6:11", "a force or an equality that is left out, muscle whose lengthrange is not given and "
                       "cannot be found: 1"},
        {"m.xml:3:18", "names that are not known here, and left out: dampin (1)"},
        {"m.xml:2:12", "elements and attributes that do not concern the motion, left out: camera (2)"},
    };
    static const kt_note_rank ranks[] = {
        KT_NOTE_RANK_DETAIL, KT_NOTE_RANK_START,  KT_NOTE_RANK_MOTION, KT_NOTE_RANK_START, KT_NOTE_RANK_START,
        KT_NOTE_RANK_DETAIL, KT_NOTE_RANK_MOTION, KT_NOTE_RANK_START,  KT_NOTE_RANK_START, KT_NOTE_RANK_START,
        KT_NOTE_RANK_MOTION, KT_NOTE_RANK_MOTION, KT_NOTE_RANK_NAME,   KT_NOTE_RANK_DETAIL};
    const int count = (int)(sizeof expected / sizeof *expected);
    kt_scene scene;
    if (!parse_right(text, NULL, &scene))
        return;
    kt_check_equal_int("notes", scene.note_count, count);
    for (int i = 0; i < scene.note_count && i < count; i++) {
        kt_check_text("where", scene.notes[i].where, expected[i][0]);
        kt_check_text("what", scene.notes[i].what, expected[i][1]);
        kt_check_equal_int(expected[i][1], scene.notes[i].rank, ranks[i]);
    }
    kt_scene_free(&scene);
}

/* Elements that change the motion have a warning of their own. Flags that turn elements off are obeyed. */
KT_TEST(what_changes_the_motion_is_a_warning_of_its_own) {
    static const char text[] =
        "<mujoco><option density='1' wind='1 0 0'><flag actuation='disable' equality='disable' "
        "spring='disable'/></option>"
        "<asset><mesh name='lost' file='lost.stl'/></asset><worldbody><body name='a'><joint name='j' stiffness='3' "
        "damping='2'/>" BALL "<geom type='mesh' mesh='lost'/><composite/></body><body name='b'><joint name='k'/>" BALL
        "<geom size='.1' fluidshape='ellipsoid'/></body></worldbody><actuator><motor joint='j' delay='1'/></actuator>"
        "<equality><joint joint1='j' joint2='k'/></equality></mujoco>";
    static const char *const expected[] = {"give a replicate for points: 1", "of 1 body (a); --mass",
                                           "wind, so that the medium is at rest: 1", "on which no medium acts: 1"};
    kt_scene scene;
    int warnings = 0;
    if (!parse_right(text, NULL, &scene))
        return;
    for (int i = 0; i < scene.note_count; i++)
        warnings += scene.notes[i].rank == KT_NOTE_RANK_MOTION;
    kt_check_equal_int("warnings", warnings, 4);
    for (size_t k = 0; k < sizeof expected / sizeof *expected; k++) {
        int found = 0;
        for (int i = 0; i < scene.note_count; i++)
            found += scene.notes[i].rank == KT_NOTE_RANK_MOTION && strstr(scene.notes[i].what, expected[k]) != NULL;
        kt_check_equal_int(expected[k], found, 1);
    }
    kt_check_equal_int("effects: a damper and a drag", scene.description.effect_count, 2);
    kt_check_equal_int("loops", scene.description.loop_count, 0);
    kt_scene_free(&scene);
}

/* Such an element has no class with a number to look up. */
KT_TEST(default_that_is_not_at_the_root_is_no_class) {
    static const char text[] = "<mujoco><worldbody><body name='a'><joint name='j'/>" BALL
                               "</body></worldbody><actuator><default joint='j'/></actuator></mujoco>";
    kt_scene scene;
    if (!parse_right(text, NULL, &scene))
        return;
    kt_check_equal_int("effects", scene.description.effect_count, 0);
    int warnings = 0;
    for (int i = 0; i < scene.note_count; i++)
        warnings +=
            scene.notes[i].rank == KT_NOTE_RANK_MOTION && strstr(scene.notes[i].what, "left out, default: 1") != NULL;
    kt_check_equal_int("warnings", warnings, 1);
    kt_scene_free(&scene);
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(faults_are_told_at_their_places) {
    static const struct {
        const char *text, *fault;
    } table[] = {
        {WORLD("<body name='a'><geom type='box' size='1 2'/></body>"),
         "1:35: body 'a': geom: size: a box needs 3 numbers above zero\n"},
        {WORLD("<body name='a'><geom type='cone' size='1'/></body>"),
         "1:35: body 'a': geom: type: there is no 'cone'; it is one of plane, hfield, sphere, capsule, ellipsoid, "
         "cylinder, box, mesh, sdf\n"},
        {WORLD("<body name='a' pos='0 0'/>"), "1:20: body 'a': pos: expected 3 numbers, found '0 0'\n"},
        {WORLD("<body name='a' pos='0 0 nan'/>"), "1:20: body 'a': pos: expected 3 numbers, found '0 0 nan'\n"},
        {WORLD("<body name='a' quat='0 0 0 0'/>"), "1:20: body 'a': quat: the norm is zero or too large\n"},
        {WORLD("<body name='a'/><body name='a'/>"),
         "1:36: body 'a': there is another body of this name; each needs one of its own\n"},
        {WORLD("<body name='a'><body name='b'><freejoint/></body></body>"),
         "1:50: body 'b': freejoint: a free joint is the only joint of a body of the world\n"},
        {WORLD("<joint/>"), "1:20: joint: the world has no joints; put it into a <body>\n"},
        {WORLD("<body name='a' childclass='x'/>"), "1:20: body 'a': childclass 'x' does not exist\n"},
        {"<mujoco><default><default/></default></mujoco>", "1:18: default: the attribute 'class' is missing\n"},
        {"<mujoco><compiler eulerseq='xyw'/></mujoco>",
         "1:9: compiler: eulerseq: expected three of x, y, z, X, Y, Z, found 'xyw'\n"},
        {"<mujoco><compiler coordinate='global'/></mujoco>",
         "1:9: compiler: coordinate: there is no 'global'; it is one of local\n"},
        {"<mujoco><equality><joint joint1='j'/></equality></mujoco>", "1:19: joint: joint1 'j' does not exist\n"},
        {"<mujoco><include file='b.xml'/></mujoco>",
         "1:9: include: a robot that is no file, but text, cannot include files\n"},
        {WORLD("<replicate count='1e6'><replicate count='1e6'><body/></replicate></replicate>"),
         "1:43: replicate: copies make more than 1048576 elements of the model\n"},
        {WORLD("<replicate count='0.5'/>"), "1:20: replicate: count: expected a whole number from 1 to 1048576\n"},
        {WORLD("<body name='a'><geom size='1'><attach model='x' prefix='p_'/></geom></body>"),
         "1:50: body 'a': attach: it stands in <geom>; put it into <worldbody>, <body>, <frame> or "
         "<replicate>\n"},
        {"<mujoco><default><joint><attach model='x' prefix='p_'/></joint></default></mujoco>",
         "1:25: attach: it stands in <joint>; put it into <worldbody>, <body>, <frame> or <replicate>\n"},
        {"<!DOCTYPE mujoco [<!ENTITY a 'b'>]><mujoco/>",
         "1:18: a document type (<!DOCTYPE ...>) is not read; leave it out\n"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene scene;
        kt_check_equal_int("it is rejected", parse(table[i].text, NULL, &scene), KT_ERROR_SCENE);
        kt_check_text(table[i].text, faults.text, table[i].fault);
        kt_check_equal_int("places out of order", faults.strange, 0);
    }
}

/* `before`, a part that is repeated, and `after`, which the caller frees; NULL after a failed check. */
static char *repeat(const char *before, const char *part, size_t count, const char *after) {
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (!kt_check_true("there is memory", stream != NULL))
        return NULL;
    (void)fputs(before, stream);
    for (size_t i = 0; i < count; i++)
        (void)fputs(part, stream);
    (void)fputs(after, stream);
    kt_check_equal_int("it is written", fclose(stream), 0);
    return text;
}

/* A model that is too large for its copies must not lose them without a message. Names that grow with every copy must
 * not take all memory. */
KT_TEST(large_models_are_rejected_and_lose_nothing) {
    static const struct {
        const char *before, *part, *after, *fault;
        size_t count;
    } table[] = {
        {"<mujoco>", "<a/>", "<worldbody><replicate count='1'><body/></replicate></worldbody></mujoco>",
         ": replicate: copies make more than 1048576 elements of the model\n", 1 << 20},
        {"<mujoco><worldbody><replicate count='100'><body name='", "long", "'/></replicate></worldbody></mujoco>",
         ": names with prefixes and numbers of copies take more than 64 MB\n", 1 << 18},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene scene;
        char *text = repeat(table[i].before, table[i].part, table[i].count, table[i].after);
        if (text != NULL && kt_check_equal_int("it is rejected", parse(text, NULL, &scene), KT_ERROR_SCENE))
            kt_check_contains("fault", faults.text, table[i].fault);
        free(text);
    }
}

/* ---- included files ---------------------------------------------------------------------------------------------- */

static bool put_file(const char *folder, const char *name, const char *text) {
    char path[300];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    const bool is_written = file != NULL && fputs(text, file) >= 0;
    return (file != NULL && fclose(file) == 0 && is_written) || kt_check_true(path, false);
}

static kt_status read_in(const char *folder, const char *text, const kt_robot_options *options, kt_scene *scene) {
    char path[300];
    kt_error error = {0};
    (void)snprintf(path, sizeof path, "%s/inner/m.xml", folder);
    memset(&faults, 0, sizeof faults);
    (void)snprintf(faults.path, sizeof faults.path, "%.200s", path);
    return put_file(folder, "inner/m.xml", text) ? kt_robot_read(path, options, scene, kt_collect, &faults, &error)
                                                 : KT_ERROR_FILE;
}

#define INCLUDE(file) "<mujoco><include file='" file "'/></mujoco>"

KT_TEST(files_are_included_from_the_folder_of_the_model_alone) {
    static const char *const rejected[][2] = {
        {INCLUDE("../outer.xml"), "a file is included from the model's folder alone"},
        {INCLUDE("sub/../../outer.xml"), "a file is included from the model's folder alone"},
        {INCLUDE("/etc/hostname"), "a file is included from the model's folder alone"},
        {INCLUDE("link.xml"), "the file lies outside of the model's folder, by a link"},
        {INCLUDE("missing.xml"), "cannot be read: No such file or directory"},
        {INCLUDE("circle.xml"), "files include each other in a circle, or more than 64 deep"},
        {INCLUDE("m.xml"), "files include each other in a circle, or more than 64 deep"},
        {INCLUDE("broken.xml"), "broken.xml:2:14: this is no well-formed XML: mismatched tag"},
        {INCLUDE("wrong.xml"), "wrong.xml:1:27: body 'w': pos: expected 3 numbers, found 'x'"},
        {INCLUDE("other.xml"), "begins with <robot>, not with <mujocoinclude> or <mujoco>"},
    };
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX", inner[300], link[300];
    kt_scene scene;
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    (void)snprintf(inner, sizeof inner, "%s/inner", folder);
    (void)snprintf(link, sizeof link, "%s/inner/link.xml", folder);
    kt_check_equal_int("folder", mkdir(inner, 0700), 0);
    kt_check_equal_int("link", symlink("../outer.xml", link), 0);
    put_file(folder, "outer.xml", "<mujocoinclude/>");
    put_file(folder, "inner/part.xml",
             "<mujoco><worldbody><body name='part'><joint/>" BALL "</body></worldbody></mujoco>");
    put_file(folder, "inner/circle.xml", INCLUDE("circle.xml"));
    put_file(folder, "inner/broken.xml", "<mujoco>\n<worldbody></mujoco>");
    put_file(folder, "inner/wrong.xml",
             "<mujocoinclude><worldbody><body name='w' pos='x'/></worldbody></mujocoinclude>");
    put_file(folder, "inner/other.xml", "<robot/>");
    for (size_t i = 0; i < sizeof rejected / sizeof *rejected; i++) {
        kt_check_equal_int(rejected[i][0], read_in(folder, rejected[i][0], NULL, &scene), KT_ERROR_SCENE);
        kt_check_true(rejected[i][1], strstr(faults.text, rejected[i][1]) != NULL);
        if (strstr(faults.text, rejected[i][1]) == NULL)
            kt_note("%s", faults.text);
    }
    if (kt_check_equal_int("status", read_in(folder, INCLUDE("part.xml"), NULL, &scene), KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 1);
        kt_check_true("its note names the included file",
                      scene.note_count > 0 && strstr(scene.notes[0].where, "part.xml:1:"));
        kt_scene_free(&scene);
    }
    static const char *const names[] = {"inner/m.xml",     "inner/part.xml",  "inner/circle.xml", "inner/broken.xml",
                                        "inner/wrong.xml", "inner/other.xml", "inner/link.xml",   "outer.xml"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        (void)snprintf(link, sizeof link, "%s/%s", folder, names[i]);
        kt_check_equal_int("removed", unlink(link), 0);
    }
    kt_check_equal_int("removed", rmdir(inner) + rmdir(folder), 0);
}

/* A file that is in both folders is the model's, as MuJoCo 3.14 finds it. */
KT_TEST(what_an_included_file_names_is_in_the_folder_of_the_model_or_in_its_own) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX", path[300];
    static const char *const folders[] = {"inner/sub", "inner"};
    static const char *const files[][2] = {
        {"inner/sub/both.xml",
         "<mujoco><asset><mesh name='s' file='solid.obj'/><model name='x' file='leaf.xml'/></asset>"
         "<include file='part.xml'/><worldbody><include file='near.xml'/>"
         "<attach model='x' prefix='p_'/></worldbody></mujoco>"},
        {"inner/sub/leaf.xml", WORLD("<body name='leaf'><joint/>" BALL "</body>")},
        {"inner/sub/near.xml",
         "<mujoco><body name='near'><joint/><geom type='mesh' mesh='s' density='600'/></body></mujoco>"},
        {"inner/sub/part.xml", "<mujoco><worldbody><body name='wrong'/></worldbody></mujoco>"},
        {"inner/part.xml", "<mujoco><worldbody><body name='part'><joint/>" BALL "</body></worldbody></mujoco>"},
        {"inner/sub/solid.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"},
        {"inner/m.xml", ""},
    };
    kt_scene scene;
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    for (int i = 1; i >= 0; i--) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, folders[i]);
        kt_check_equal_int("folder", mkdir(path, 0700), 0);
    }
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        put_file(folder, files[i][0], files[i][1]);
    if (kt_check_equal_int("status", read_in(folder, INCLUDE("sub/both.xml"), NULL, &scene), KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 3);
        kt_check_text("of the part's folder", find_body(&scene, "p_leaf")->name, "p_leaf");
        kt_check_text("of the model's folder", find_body(&scene, "part")->name, "part");
        kt_check_near("mass by a mesh of the part's folder", find_body(&scene, "near")->mass, 100.0, 1e-12);
        kt_check_true("drawn from there",
                      scene.mesh_count == 1 && strstr(scene.meshes[0].file, "/sub/solid.obj") != NULL);
        kt_scene_free(&scene);
    }
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, files[i][0]);
        kt_check_equal_int("removed", unlink(path), 0);
    }
    for (int i = 0; i < 2; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, folders[i]);
        kt_check_equal_int("removed", rmdir(path), 0);
    }
    kt_check_equal_int("removed", rmdir(folder), 0);
}

/* ---- attached models --------------------------------------------------------------------------------------------- */

#define ATTACH(assets, how)                                                                                            \
    "<mujoco><asset>" assets "</asset><worldbody><body name='host'><joint/>" BALL "<attach " how                       \
    "/></body></worldbody></mujoco>"
#define MODEL(file) "<model name='x' file='" file "'/>"
#define OF_X "model='x' prefix='p_'"

static const char *const attached_files[][2] = {
    {"outer.xml", "<mujoco/>"},
    {"inner/part.xml",
     "<mujoco model='part'><compiler angle='radian' eulerseq='zyx' meshdir='meshes'/>"
     "<option gravity='0 0 -1'/>"
     "<default><joint damping='0.7'/><default class='c'><joint armature='2'/></default></default>"
     "<asset><mesh file='solid.obj'/>" MODEL(
         "sub/leaf.xml") "</asset>"
                         "<worldbody><frame pos='9 9 9'><body name='arm' pos='1 0 0' euler='0.5 0 0'>"
                         "<joint name='j' class='c' range='-1 1' ref='0.5'/>" BALL "<attach model='x' prefix='in_'/>"
                         "<site name='tip' pos='0 0 1'/></body></frame>"
                         "<body name='far'><joint name='k' type='ball'/><geom type='mesh' mesh='solid'/>"
                         "<joint name='l'/></body></worldbody>"
                         "<tendon><fixed name='t' stiffness='3'><joint joint='in_m' coef='2'/></fixed>"
                         "<fixed name='u' stiffness='3'><joint joint='l' coef='2'/></fixed></tendon>"
                         "<equality><joint joint1='j' joint2='in_m'/><connect body1='arm' body2='far' anchor='0 0 0'/>"
                         "<connect body1='arm' anchor='0 0 0'/></equality>"
                         "<actuator><position joint='l' kp='2'/><position name='a' joint='j' kp='4'/>"
                         "<motor tendon='u'/><motor name='b' tendon='t'/></actuator>"
                         "<keyframe><key name='up' qpos='0.75 0.125 1 0 0 0 7' qvel='1 2 3 4 5 6' ctrl='1 2 3 4'/>"
                         "</keyframe></mujoco>"},
    {"inner/sub/leaf.xml", "<mujoco><worldbody><body name='leaf' euler='90 0 0'><joint name='m' springref='90' "
                           "stiffness='1'/>" BALL "</body></worldbody></mujoco>"},
    {"inner/meshes/solid.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"},
    {"inner/circle.xml", ATTACH(MODEL("circle.xml"), OF_X)},
    {"inner/round.xml", ATTACH(MODEL("sub/back.xml"), OF_X)},
    {"inner/sub/back.xml", ATTACH(MODEL("../round.xml"), OF_X)},
    {"inner/bare.xml", "<mujocoinclude/>"},
    {"inner/around.xml",
     "<mujoco><default><default class='c'><joint damping='0.7' axis='0 1 0'/><geom density='500'/></default></default>"
     "<asset>" MODEL("sub/leaf.xml") "</asset><worldbody><frame childclass='c'><body name='base'>" BALL
                                     "<frame pos='1 0 0'><body name='hand'><joint/>" BALL
                                     "</body><attach model='x' prefix='in_'/></frame></body>"
                                     "</frame></worldbody></mujoco>"},
    {"inner/m.xml", ""},
};
static const char *const attached_folders[] = {"", "/inner", "/inner/sub", "/inner/meshes"};

static bool make_attached(char *folder) {
    char path[300];
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return false;
    for (size_t i = 1; i < sizeof attached_folders / sizeof *attached_folders; i++) {
        (void)snprintf(path, sizeof path, "%s%s", folder, attached_folders[i]);
        kt_check_equal_int("folder", mkdir(path, 0700), 0);
    }
    for (size_t i = 0; i < sizeof attached_files / sizeof *attached_files; i++)
        put_file(folder, attached_files[i][0], attached_files[i][1]);
    return true;
}

static void remove_attached(const char *folder) {
    char path[300];
    for (size_t i = 0; i < sizeof attached_files / sizeof *attached_files; i++) {
        (void)snprintf(path, sizeof path, "%s/%s", folder, attached_files[i][0]);
        kt_check_equal_int("removed", unlink(path), 0);
    }
    for (size_t i = sizeof attached_folders / sizeof *attached_folders; i-- > 0;) {
        (void)snprintf(path, sizeof path, "%s%s", folder, attached_folders[i]);
        kt_check_equal_int("removed", rmdir(path), 0);
    }
}

KT_TEST(models_are_attached_from_the_folder_of_the_model_alone) {
    static const char *const rejected[][2] = {
        {ATTACH(MODEL("../outer.xml"), OF_X), "a file is included from the model's folder alone"},
        {ATTACH(MODEL("missing.xml"), OF_X), "cannot be read: No such file or directory"},
        {ATTACH(MODEL("m.xml"), OF_X), "the file is attached within itself"},
        {ATTACH(MODEL("circle.xml"), OF_X), "circle.xml:1:16: model 'x': the file is attached within itself"},
        {ATTACH(MODEL("round.xml"), OF_X), "the file is attached within itself"},
        {ATTACH(MODEL("bare.xml"), OF_X), "begins with <mujocoinclude>, not with <mujoco>"},
        {ATTACH("", OF_X), "there is no <model> 'x' in <asset>"},
        {ATTACH("<model name='x'/>", OF_X), "model 'x': the attribute 'file' is missing"},
        {ATTACH(MODEL("part.xml"), "model='x'"), "attach: the attribute 'prefix' is missing"},
        {ATTACH(MODEL("part.xml"), OF_X " body='nobody'"), "attach: body 'nobody' does not exist in the model"},
        {ATTACH(MODEL("part.xml"), "model='x' prefix='' body='arm'/><body name='arm'"),
         "there is another body of this name"},
    };
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    if (!make_attached(folder))
        return;
    for (size_t i = 0; i < sizeof rejected / sizeof *rejected; i++) {
        kt_check_equal_int(rejected[i][0], read_in(folder, rejected[i][0], NULL, &scene), KT_ERROR_SCENE);
        kt_check_true(rejected[i][1], strstr(faults.text, rejected[i][1]) != NULL);
        if (strstr(faults.text, rejected[i][1]) == NULL)
            kt_note("%s", faults.text);
    }
    remove_attached(folder);
}

/* The scene of a model as text; "" after a failed check. */
static void write_scene(const char *folder, const char *model, const char *keyframe, char *text, size_t room) {
    const kt_robot_options options = {.keyframe = keyframe};
    kt_error error = {0};
    kt_scene scene;
    memset(text, 0, room);
    if (!kt_check_equal_int("status", read_in(folder, model, &options, &scene), KT_OK)) {
        kt_note("%s", faults.text);
        return;
    }
    FILE *stream = fmemopen(text, room - 1, "w");
    kt_check_true("it is written",
                  stream != NULL && kt_scene_write(&scene, stream, &error) == KT_OK && fclose(stream) == 0);
    kt_scene_free(&scene);
}

/* The same, with names, classes and units of the whole; numbers of a keyframe are those of MuJoCo 3.14's. */
KT_TEST(attached_models_are_those_written_by_hand) {
#define HAND_HEAD                                                                                                      \
    "<mujoco model='m'><compiler angle='radian'/><option gravity='0 0 -5'/><default><joint damping='0.1'/>"            \
    "<default class='c'><joint armature='1'/></default>"
#define HAND_BODY                                                                                                      \
    "<worldbody><body name='host' childclass='c'><joint name='h' springref='0.5' stiffness='1'/>" BALL                 \
    "<frame pos='0 1 0' quat='1 0 0 1'>"
    static const char attached[] =
        HAND_HEAD "</default><asset><model file='part.xml'/></asset>" HAND_BODY
                  "<attach model='part' body='arm' prefix='p_'/></frame><body name='last'><joint name='n'/>" BALL
                  "</body></body></worldbody><actuator><motor name='q' joint='n'/></actuator></mujoco>";
    static const char by_hand[] = HAND_HEAD
        "<default class='part'><joint damping='0.7'/></default><default class='leaf'><joint damping='0'/></default>"
        "</default>" HAND_BODY "<body name='p_arm' childclass='part' pos='1 0 0' euler='0 0 0.5'>"
        "<joint name='p_j' armature='2' range='-1 1' ref='0.5'/>" BALL
        "<body name='p_in_leaf' euler='1.5707963267948966 0 0' childclass='leaf'>"
        "<joint name='p_in_m' springref='1.5707963267948966' stiffness='1'/>" BALL "</body>"
        "<site name='p_tip' pos='0 0 1'/></body></frame><body name='last'><joint name='n'/>" BALL
        "</body></body></worldbody>"
        "<tendon><fixed name='p_t' stiffness='3'><joint joint='p_in_m' coef='2'/></fixed></tendon>"
        "<equality><joint joint1='p_j' joint2='p_in_m'/><connect body1='p_arm' anchor='0 0 0'/></equality>"
        "<actuator><motor name='q' joint='n'/><position name='p_a' joint='p_j' kp='4'/>"
        "<motor name='p_b' tendon='p_t'/></actuator>"
        "<keyframe><key name='p_up' qpos='0 0.75 0.125 0' qvel='0 1 2 0' ctrl='0 2 4'/></keyframe></mujoco>";
    static char one[20000], other[20000];
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    if (!make_attached(folder))
        return;
    for (int i = 0; i < 2; i++) {
        write_scene(folder, attached, i > 0 ? "p_up" : NULL, one, sizeof one);
        write_scene(folder, by_hand, i > 0 ? "p_up" : NULL, other, sizeof other);
        kt_check_text(i > 0 ? "from the keyframe" : "the scene", one, other);
    }
    remove_attached(folder);
}

/* Frames around it are lost, their classes are not; those of another model never were its own. Numbers of MuJoCo
 * 3.14. */
KT_TEST(an_attached_body_has_the_class_of_what_is_around_it_in_its_model) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    if (!make_attached(folder))
        return;
    if (kt_check_equal_int("status", read_in(folder, ATTACH(MODEL("around.xml"), OF_X " body='hand'"), NULL, &scene),
                           KT_OK)) {
        const kt_body *hand = find_body(&scene, "p_hand");
        kt_check_near("mass", hand->mass, 2.0 / 3.0 * acos(-1.0), 1e-15);
        kt_check_equal_bits("axis", &hand->joint.axis.x, (const double[]){0.0, 1.0, 0.0}, 3);
        kt_check_equal_bits("place", &hand->joint.at.x, (const double[]){0.0, 0.0, 0.0}, 3);
        if (kt_check_equal_int("effects", scene.description.effect_count, 1))
            kt_check_equal_bits("damping", &scene.description.effects[0].damping, &(double){0.7}, 1);
        kt_scene_free(&scene);
    } else {
        kt_note("%s", faults.text);
    }
    if (kt_check_equal_int("status", read_in(folder, ATTACH(MODEL("around.xml"), OF_X " body='in_leaf'"), NULL, &scene),
                           KT_OK)) {
        kt_check_near("mass of a leaf", find_body(&scene, "p_in_leaf")->mass, 4.0 / 3.0 * acos(-1.0), 1e-15);
        kt_scene_free(&scene);
    }
    remove_attached(folder);
}

KT_TEST(long_prefixes_are_rejected) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    char *text = repeat("<mujoco><asset>" MODEL("part.xml") "</asset><worldbody><attach model='x' prefix='", "long",
                        1 << 20, "'/></worldbody></mujoco>");
    if (text != NULL && make_attached(folder)) {
        kt_check_equal_int("it is rejected", read_in(folder, text, NULL, &scene), KT_ERROR_SCENE);
        kt_check_contains("fault", faults.text, "names with prefixes and numbers of copies take more than 64 MB");
        remove_attached(folder);
    }
    free(text);
}

/* Such joints exist only as copies. A keyframe has no number for each, and their class is that of the attached
 * model. */
KT_TEST(keyframes_of_models_in_replicates_are_rejected_at_their_place) {
    static const char within[] = "<mujoco><default><joint type='ball'/></default><asset>" MODEL(
        "part.xml") "</asset><worldbody><replicate count='2' offset='0 1 0'><attach model='x' prefix='p_'/>"
                    "</replicate></worldbody></mujoco>";
    static const char told[] = "its model is attached in a <replicate>; which copy it is of is not known";
    const kt_robot_options options = {.keyframe = "p_up"};
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    kt_scene scene;
    if (!make_attached(folder))
        return;
    kt_check_equal_int("status", read_in(folder, within, &options, &scene), KT_ERROR_SCENE);
    kt_check_true(told, strstr(faults.text, "part.xml:1:") != NULL && strstr(faults.text, told) != NULL);
    kt_check_equal_int("without it", read_in(folder, within, NULL, &scene), KT_OK);
    kt_check_equal_int("bodies", scene.description.body_count, 2 * 4);
    kt_scene_free(&scene);
    remove_attached(folder);
}

/* The whole world of a model that is attached twice. A joint of a body that stays behind keeps its numbers. */
KT_TEST(a_model_is_attached_whole_and_more_than_once) {
    char folder[] = "/tmp/kinetree-mjcf-XXXXXX";
    const kt_robot_options options = {.keyframe = "b_up"};
    kt_scene scene;
    if (!make_attached(folder))
        return;
    if (kt_check_equal_int("status",
                           read_in(folder,
                                   ATTACH(MODEL("part.xml"), "model='x' prefix='a_'/><attach model='x' prefix='b_'"),
                                   &options, &scene),
                           KT_OK)) {
        kt_check_equal_int("bodies", scene.description.body_count, 9);
        kt_check_equal_int("effects", scene.description.effect_count,
                           2 * (3 + 1 + 2 + 4)); /* dampers, springs, of tendons, actuators */
        kt_check_near("mass of a mesh", find_body(&scene, "b_far")->mass, 1000.0 / 6.0, 1e-12);
        kt_check_equal_bits("of the keyframe", find_body(&scene, "b_arm")->joint.position, (const double[]){0.75}, 1);
        kt_check_equal_bits("of the other's reference", find_body(&scene, "a_arm")->joint.position,
                            (const double[]){0.5}, 1);
        kt_check_equal_bits("of the last joint", find_body(&scene, "b_far")->joint.velocity, (const double[]){6.0}, 1);
        kt_scene_free(&scene);
    } else {
        kt_note("%s", faults.text);
    }
    remove_attached(folder);
}
