/* Cables of MJCF: elastic torques between bodies, and faults. The bodies themselves are compared with those of MuJoCo
 * (mujoco_wasm.c, cables.xml), whose WebAssembly lacks the plugin of elasticity. The torques are compared with its
 * formula: -diag(k) (phi - phi0) in the axes of the body before, k = (G J, E Iy, E Iz) / L. */
#define ROBOT "m"
#include "robot.h"

#include "kinetree/kinetree.h"

#include <math.h>

enum { JOINTS = 3, TRIALS = 20 };

#define ELASTIC(twist, bend, more)                                                                                     \
    "<plugin plugin='mujoco.elasticity.cable'><config key='twist' value='" twist "'/><config key='bend' value='" bend  \
    "'/>" more "</plugin>"
#define CABLE(attributes, content)                                                                                     \
    "<mujoco><worldbody><composite type='cable' prefix='c' initial='none' " attributes ">" content                     \
    "</composite></worldbody></mujoco>"
#define CURVE "vertex='0 0 0  0.1 0 0  0.19 0.04 0  0.26 0.11 0  0.3 0.2 0'"
#define STRAIGHT "curve='s' count='5 1 1' size='0.5'"

static const double pi = 3.14159265358979323846;

/* Torques of the joints between the bodies of a cable at positions q, quaternions. */
static void torques_of(const char *text, const double *q, double *torques, char *warning) {
    kt_error error = {0};
    const double v[3 * JOINTS] = {0.0};
    warning[0] = '\0';
    kt_scene *scene = test_robot(text, NULL);
    for (int i = 0; i < scene->note_count; i++)
        if (scene->notes[i].rank == KT_NOTE_RANK_MOTION)
            (void)snprintf(warning, 200, "%.199s", scene->notes[i].what);
    const kt_opened cable = kt_test_open(scene, NULL);
    kt_need(kt_check_equal_int("degrees of freedom", kt_model_nv(cable.model), 3 * JOINTS));
    kt_need_fine("torques", kt_effect_forces(cable.model, cable.data, 0.0, q, v, torques, &error), &error);
}

/* The Euler vector of (cos, 0, 0, sin) rotations and others, at most half a turn. */
static kt_vec3 vector_of(kt_quat q) {
    const double s = sqrt(q.x * q.x + q.y * q.y + q.z * q.z), angle = 2.0 * atan2(q.w < 0.0 ? -s : s, fabs(q.w));
    return kt_vec3_scale(s > 0.0 ? angle / s : 2.0, kt_vec3_make(q.x, q.y, q.z));
}

static kt_vec3 turned(kt_quat q, kt_vec3 x) {
    const kt_quat r = kt_quat_multiply(kt_quat_multiply(q, kt_quat_make(0.0, x.x, x.y, x.z)), kt_quat_conjugate(q));
    return kt_vec3_make(r.x, r.y, r.z);
}

/* Compares a joint. rest: the angle about z of the body at rest, phi0: the one without torque. */
static void compare_joint(kt_worst *worst, const double *q, const double *torque, const double k[3], double rest,
                          double phi0) {
    const kt_quat whole = kt_quat_multiply(kt_quat_make(cos(0.5 * rest), 0.0, 0.0, sin(0.5 * rest)),
                                           kt_quat_make(q[0], q[1], q[2], q[3]));
    const kt_vec3 phi = vector_of(whole);
    const kt_vec3 before = kt_vec3_make(-k[0] * phi.x, -k[1] * phi.y, -k[2] * (phi.z - phi0));
    const kt_vec3 here = turned(kt_quat_conjugate(whole), before);
    const double expected[] = {here.x, here.y, here.z}, size = k[0] + k[1] + k[2];
    for (int i = 0; i < 3; i++)
        kt_worst_below(worst, fabs(torque[i] - expected[i]), 1e-14 * size, "axis %d", i);
}

/* The angles and lengths of CURVE. Vertices are single-precision numbers. */
static void curve_of(double *angles, double *lengths) {
    static const float x[] = {0.0F, 0.1F, 0.19F, 0.26F, 0.3F}, y[] = {0.0F, 0.0F, 0.04F, 0.11F, 0.2F};
    for (int i = 0; i < JOINTS; i++) {
        const double ax = (double)(x[i + 1] - x[i]), ay = (double)(y[i + 1] - y[i]);
        const double bx = (double)(x[i + 2] - x[i + 1]), by = (double)(y[i + 2] - y[i + 1]);
        angles[i] = atan2(ax * by - ay * bx, ax * bx + ay * by);
        lengths[i] = sqrt(ax * ax + ay * ay);
    }
}

static void draw_quat(kt_random *random, double *q) {
    kt_quat drawn = kt_quat_make(1.5 + kt_random_uniform(random, -1.0, 1.0), kt_random_uniform(random, -1.0, 1.0),
                                 kt_random_uniform(random, -1.0, 1.0), kt_random_uniform(random, -1.0, 1.0));
    drawn = kt_quat_normalize(drawn);
    q[0] = drawn.w, q[1] = drawn.x, q[2] = drawn.y, q[3] = drawn.z;
}

/* Equal stiffnesses about all axes (E = 2 G for a circle), and no torque where the cable is straight. */
KT_TEST(round_cables_as_stiff_in_twist_as_in_bending_have_the_torque_of_mujoco) {
    static const char *const texts[] = {
        CABLE(CURVE, ELASTIC("2e6", "4e6", "<config key='flat' value='true'/>") "<geom type='capsule' size='0.01'/>"),
        CABLE(STRAIGHT, ELASTIC("2e6", "4e6", "") "<geom type='cylinder' size='0.01'/>")};
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("torque, N m");
    double q[4 * JOINTS], torques[3 * JOINTS], angles[JOINTS], lengths[JOINTS];
    char warning[200];
    curve_of(angles, lengths);
    for (int n = 0; n < TRIALS; n++)
        for (int c = 0; c < 2; c++) {
            for (int i = 0; i < JOINTS; i++)
                draw_quat(&random, q + 4 * i);
            torques_of(texts[c], q, torques, warning);
            kt_check_text("no warning", warning, "");
            for (int i = 0; i < JOINTS; i++) {
                const double stiffness = 2e6 * 0.5 * pi * 1e-8 / (c == 0 ? lengths[i] : 0.125);
                const double k[] = {stiffness, stiffness, stiffness};
                compare_joint(&worst, q + 4 * i, torques + 3 * i, k, c == 0 ? angles[i] : 0.0, 0.0);
            }
        }
}

/* A strip that is curved at rest bends in the plane of its curve. */
KT_TEST(curved_strips_that_bend_in_their_plane_have_the_torque_of_mujoco) {
    static const char text[] = CABLE(CURVE, ELASTIC("3e7", "5e7", "") "<geom type='box' size='1 0.004 0.02'/>");
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("torque, N m");
    double q[4 * JOINTS] = {0.0}, torques[3 * JOINTS], angles[JOINTS], lengths[JOINTS];
    char warning[200];
    curve_of(angles, lengths);
    for (int n = 0; n < TRIALS; n++) {
        for (int i = 0; i < JOINTS; i++) {
            const double half = 0.5 * kt_random_uniform(&random, -1.0, 1.0);
            q[4 * i] = cos(half);
            q[4 * i + 3] = sin(half);
        }
        torques_of(text, q, torques, warning);
        kt_check_contains("it differs elsewhere", warning, "differ from MuJoCo's by up to ");
        for (int i = 0; i < JOINTS; i++) {
            const double iy = 0.008 * 0.04 * 0.04 * 0.04 / 12.0, iz = 0.04 * 0.008 * 0.008 * 0.008 / 12.0;
            const double k[] = {0.0, 5e7 * iy / lengths[i], 5e7 * iz / lengths[i]};
            compare_joint(&worst, q + 4 * i, torques + 3 * i, k, angles[i], angles[i]);
        }
    }
}

/* Saint-Venant's torsion constant of a square of half side a is 2.25 a^4, of which the formula has 2.2533. */
KT_TEST(square_cables_twist_as_bars_do) {
    static const char text[] = CABLE(STRAIGHT, ELASTIC("1e7", "0", "") "<geom type='box' size='1 0.01 0.01'/>");
    double q[4 * JOINTS] = {0.0}, torques[3 * JOINTS];
    char warning[200];
    for (int i = 0; i < JOINTS; i++) {
        q[4 * i] = cos(0.15);
        q[4 * i + 1] = sin(0.15);
    }
    torques_of(text, q, torques, warning);
    for (int i = 0; i < JOINTS; i++)
        kt_check_near("twist, N m", torques[3 * i], -1e7 * 2.25e-8 * 0.3 / 0.125, 2e-3 * 0.54);
}

/* MuJoCo saves a cable as bodies with a plugin each. Neighbours share an instance, and have elastic torques. */
KT_TEST(bodies_with_the_instance_of_a_plugin_are_a_cable) {
#define LINK(name, plugin)                                                                                             \
    "<body name='" name                                                                                                \
    "' pos='0.1 0 0'><joint type='ball'/><geom type='capsule' size='0.01' fromto='0 0 0 0.1 0 0'/>"                    \
    "<plugin instance='" plugin "'/>"
    static const char text[] =
        "<mujoco><extension><plugin plugin='mujoco.elasticity.cable'><instance name='one'><config key='bend' "
        "value='4e6'/>"
        "<config key='twist' value='2e6'/></instance><instance name='two'/></plugin></extension><worldbody>" LINK(
            "a", "one") LINK("b", "one") LINK("c", "two") "</body></body></body></worldbody></mujoco>";
#undef LINK
    kt_scene *scene = test_robot(text, NULL);
    const kt_effect *effect = scene->description.effects;
    kt_need(kt_check_equal_int("effects", scene->description.effect_count, 1));
    kt_check_equal_int("a bushing", effect->type, KT_EFFECT_BUSHING);
    kt_check_text("from", effect->between[0].body, "a");
    kt_check_text("to", effect->between[1].body, "b");
}

KT_TEST(default_classes_do_not_apply_to_cables_and_prefixes_do) {
    static const char text[] =
        "<mujoco><default><geom density='7'/><joint damping='3'/></default><worldbody>"
        "<composite type='cable' prefix='c' curve='s' count='3 1 1' size='1'><geom type='box' size='1 0.1 0.1'/>"
        "</composite><replicate count='2' offset='1 0 0'><body><joint/><geom size='1'/><composite type='cable' "
        "prefix='r' curve='0 s' count='2 1 1' size='1'><geom type='box' size='1 0.1 "
        "0.1'/></composite></body></replicate>"
        "</worldbody></mujoco>";
    kt_scene *scene = test_robot(text, NULL);
    kt_check_equal_int("dampers: of the two joints without a cable", scene->description.effect_count, 2);
    kt_check_near("mass", find_body(scene, "cB_last")->mass, 1000.0 * 0.5 * 0.04, 1e-12 * 20.0);
    kt_check_near("mass of a copy", find_body(scene, "rB_first1")->mass, 1000.0 * 0.04, 1e-12 * 40.0);
}

KT_TEST(faults_of_cables_are_told_at_their_places) {
#define GEOM "<geom type='capsule' size='0.01'/>"
    static const char *const table[][2] = {
        {CABLE(STRAIGHT, ""), "a cable needs a <geom> whose type is capsule, cylinder or box"},
        {CABLE(STRAIGHT, "<geom size='1'/>"), "a cable needs a <geom> whose type is capsule, cylinder or box"},
        {CABLE("curve='s exp'  count='5 1 1'", GEOM),
         "curve: expected up to three of 0, s, cos(s), sin(s), found 's exp'"},
        {CABLE("curve='s s s s' count='5 1 1'", GEOM), "curve: expected up to three"},
        {CABLE("curve='s' count='5 2 1'", GEOM), "count: a cable needs a whole number of two vertices or more"},
        {CABLE("curve='s'", GEOM), "count: a cable needs a whole number of two vertices or more"},
        {CABLE("curve='s' count='1e9 1 1'", GEOM), "a cable has at most 1000 vertices here"},
        {CABLE("vertex='0 0 0 1 1'", GEOM), "vertex: expected three numbers for each of two vertices or more"},
        {CABLE("vertex='0 0 0 1 1 x'", GEOM), "vertex: expected three numbers for each of two vertices or more"},
        {CABLE("vertex='0 0 0 0 0 0'", GEOM), "fromto: the two points coincide"},
    };
#undef GEOM
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = kt_test_scene_place();
        if (kt_check_true(table[i][1], parse(table[i][0], NULL, scene) != KT_OK))
            kt_check_contains("fault", faults.text, table[i][1]);
    }
}

KT_TEST(composites_that_mujoco_removed_have_a_warning) {
    static const char *const table[][2] = {
        {"<mujoco><worldbody><body><composite type='rope' count='4 1 1' spacing='.1'/></body></worldbody></mujoco>",
         "give the type cable, or a flexcomp with dim 1: 1"},
        {"<mujoco><worldbody><body><composite type='cloth' count='4 4 1' spacing='.1'/></body></worldbody></mujoco>",
         "composites of points, cloths and solids, which MuJoCo removed"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot(table[i][0], NULL);
        kt_check_true(table[i][1], has_ranked_note(scene, KT_NOTE_RANK_MOTION, table[i][1]));
        kt_check_equal_int("bodies", scene->description.body_count, 1);
    }
}
