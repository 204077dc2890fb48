/* Invalid effects: every fault is reported, and a NaN is not compared with other numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion/simulation/scenes.h"

#include "kinetree/mechanism.h"

#include <math.h>
#include <stdio.h>

typedef struct told {
    size_t length;
    char text[2048];
} told;

static void tell(void *user, const kt_place *place, const kt_error *error) {
    told *t = user;
    (void)place;
    const int length = snprintf(t->text + t->length, sizeof t->text - t->length, "%s\n", error->message);
    if (length > 0 && (size_t)length < sizeof t->text - t->length)
        t->length += (size_t)length;
}

/* Checks all reported faults of an effect on a slider. */
static void check_told(kt_effect effect, const char *expected) {
    kt_lone lone;
    told seen = {0, ""};
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    effect.joint = effect.between[0].body = lone.body.name;
    lone.description.bodies = &lone.body;
    lone.description.effects = &effect;
    lone.description.effect_count = 1;
    const kt_status status = kt_description_check(&lone.description, tell, &seen, NULL);
    kt_check_equal_int("status", status, expected[0] == '\0' ? KT_OK : KT_ERROR_MODEL);
    kt_check_text("told", seen.text, expected);
}

static kt_effect of_type(kt_effect_type type) {
    kt_effect effect = kt_effect_of(type, NULL);
    return effect;
}

KT_TEST(stops_are_two_numbers_in_order_or_one) {
    kt_effect stop = of_type(KT_EFFECT_JOINT_LIMIT);
    stop.stiffness = 1.0;
    check_told(stop, "there is neither lower nor upper; give at least one of them\n");
    stop.lower = 1.0;
    check_told(stop, "");
    stop.upper = 0.5;
    check_told(stop, "lower is 1, above upper, which is 0.5; exchange them\n");
    stop.upper = (double)NAN;
    check_told(stop, "upper is nan; give a finite number\n");
    stop.upper = 2.0;
    check_told(stop, "");
    stop.lower = (double)NAN;
    check_told(stop, "lower is nan; give a finite number\n");
    stop.lower = (double)INFINITY; /* the end that there is not is the other way */
    check_told(stop, "lower is inf; give a finite number\n");
    stop.lower = -(double)INFINITY;
    check_told(stop, "");
    stop.upper = -(double)INFINITY;
    check_told(stop, "upper is -inf; give a finite number\n");
}

KT_TEST(servo_needs_stiffness_or_damping_and_a_limit_above_zero) {
    kt_effect servo = of_type(KT_EFFECT_SERVO);
    servo.target = kt_function_constant(1.0);
    check_told(servo, "there is neither stiffness nor damping; give at least one of them\n");
    servo.damping = 1.0;
    check_told(servo, "");
    servo.limit = 0.0;
    check_told(servo, "limit is 0; it must be greater than 0\n");
    servo.limit = 1.0;
    servo.lower = 2.0;
    servo.upper = 1.0;
    check_told(servo, "lower is 2, above upper, which is 1; exchange them\n");
    servo.lower = -1.0;
    servo.target = (kt_function){.type = KT_FUNCTION_NONE};
    check_told(servo, "target is missing; give a number or a function of time\n");
}

KT_TEST(friction_at_rest_is_compared_with_that_in_motion_where_both_are_numbers) {
    kt_effect friction = of_type(KT_EFFECT_JOINT_FRICTION);
    friction.coulomb = 2.0;
    friction.breakaway = 1.0;
    check_told(friction, "static is 1, less than coulomb, which is 2; raise static, or leave it out to have both "
                         "alike\n");
    friction.coulomb = (double)NAN;
    check_told(friction, "coulomb is nan; give a finite number\n");
    friction.coulomb = 2.0;
    friction.breakaway = -1.0;
    check_told(friction, "static is -1; it cannot be negative\n");
    friction.breakaway = 0.0;
    check_told(friction, "");
}

KT_TEST(exponent_of_a_contact_is_a_number_from_one_on) {
    kt_effect contact = of_type(KT_EFFECT_CONTACT);
    contact.stiffness = 1.0;
    check_told(contact, "");
    contact.exponent = (double)NAN;
    check_told(contact, "exponent is nan; give a finite number\n");
    contact.exponent = 0.999;
    check_told(contact,
               "exponent is 0.999; it must be 1 or more: below, contact would begin with an infinite stiffness\n");
    contact.exponent = 1.0;
    check_told(contact, "");
}

KT_TEST(hard_contacts_have_no_rolling_or_torsional_friction) {
    kt_effect contact = of_type(KT_EFFECT_CONTACT);
    contact.rolling = 0.1;
    contact.torsion = 0.2;
    contact.stiffness = 1.0;
    check_told(contact, "");
    contact.stiffness = 0.0;
    contact.restitution = 0.5;
    check_told(contact, "a hard contact has no rolling or torsional friction; give a stiffness in place of the "
                        "restitution, or leave `rolling` out\n");
    contact.rolling = 0.0;
    check_told(contact, "a hard contact has no rolling or torsional friction; give a stiffness in place of the "
                        "restitution, or leave `torsion` out\n");
    contact.torsion = 0.0;
    check_told(contact, "");
    contact.restitution = 1.0;
    check_told(contact, "");
    contact.restitution = 1.1;
    check_told(contact, "restitution is 1.1; it must be 0 to 1\n");
}

KT_TEST(force_has_three_components_in_a_frame_that_there_is) {
    kt_effect force = of_type(KT_EFFECT_FORCE);
    check_told(force, "value has a component missing; give three numbers or functions of time\n"
                      "value has a component missing; give three numbers or functions of time\n"
                      "value has a component missing; give three numbers or functions of time\n");
    for (int k = 0; k < 3; k++)
        force.value[k] = (kt_function){.type = KT_FUNCTION_CONSTANT, .value = 1.0};
    check_told(force, "");
    force.frame = KT_FRAME_BODY;
    check_told(force, "");
    force.frame = (kt_frame)7;
    check_told(force, "frame is 7; take KT_FRAME_WORLD or KT_FRAME_BODY\n");
}

/* A bushing measures how far its ends are turned. */
KT_TEST(bushing_at_no_rotation_is_rejected_with_the_body) {
    kt_lone lone;
    kt_effect bushing = of_type(KT_EFFECT_BUSHING);
    kt_error error = {KT_OK, "", ""};
    double q[7] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0}, v[6] = {0.0}, a[6] = {77.0};
    kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
    bushing.between[0].body = lone.body.name;
    for (int k = 0; k < 6; k++)
        bushing.stiffnesses[k] = 1.0;
    lone.description.effects = &bushing;
    lone.description.effect_count = 1;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_data *data = kt_test_data(model);
    q[4] = (double)NAN;
    kt_check_equal_int("status", kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error),
                       KT_ERROR_NOT_FINITE);
    kt_note("%s: %s", error.where, error.message);
    kt_check_contains("where", error.where, "'block'");
    kt_check_near("nothing is written", a[0], 77.0, 0.0);
}

/* A component of a quaternion has no velocity of its own, so that forces cannot be differentiated by it. */
KT_TEST(formulas_of_forces_read_no_component_of_a_quaternion) {
    static const char expected[] =
        "force: a component of a quaternion is no variable of forces; take coordinates of markers\n";
    static const char *const reads[] = {"position.bird[2]", "position.bird[3]", "position.bird[6]", "velocity.bird[3]"};
    kt_body bird = kt_body_of("bird", NULL, KT_JOINT_FREE, 1.0);
    bird.inertia.xx = bird.inertia.yy = bird.inertia.zz = 1.0;
    for (int k = 0; k < 4; k++) {
        kt_effect pull = of_type(KT_EFFECT_EXPRESSION);
        pull.end_count = 1;
        pull.between[0].body = "bird";
        pull.formula[0] = reads[k];
        const kt_description d = kt_description_of(&bird, 1, NULL, 0, &pull, 1);
        told seen = {0, ""};
        const bool is_turn = k == 1 || k == 2;
        kt_check_equal_int("status", kt_description_check(&d, tell, &seen, NULL), is_turn ? KT_ERROR_MODEL : KT_OK);
        kt_check_text(reads[k], seen.text, is_turn ? expected : "");
    }
}
