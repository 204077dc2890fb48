/* Every rule of loops and effects, each broken once. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdio.h>

#include "check.h"
#include "mechanism.h"

static const double nan_value = (double)NAN;

#define REJECTS_LOOP(loop, change, sub, field, where, message)                                                         \
    MECHANISM_REJECTS(kt_loop *l = &m.loops[loop]; (void)l, change, KT_ITEM_LOOP, loop, sub, field, where, message)
#define PASSES_LOOP(what, loop, change) MECHANISM_PASSES(kt_loop *l = &m.loops[loop]; (void)l, change, what)
#define REJECTS_EFFECT(effect, change, sub, field, where, message)                                                     \
    MECHANISM_REJECTS(kt_effect *e = &m.effects[effect];                                                               \
                      (void)e, change, KT_ITEM_EFFECT, effect, sub, field, where, message)

KT_TEST(names_and_types_of_loops_are_checked) {
    REJECTS_LOOP(ROD, l->name = NULL, -1, "name", "loops[1]", "name is missing; give it one");
    REJECTS_LOOP(ROD, l->name = "a b", -1, "name", "loop 'a b'",
                 "name 'a b' is not valid; begin with a letter or _, go on with letters, digits, _ and -");
    REJECTS_LOOP(ROD, l->name = "close", -1, "name", "loop 'close'",
                 "name 'close' is that of loops[0] already; choose another");
    REJECTS_LOOP(ROD, l->type = (kt_loop_type)97, -1, "type", "loop 'rod'",
                 "type is 97, and there is no loop of that number; take one of kt_loop_type");
    PASSES_LOOP("name of a body", ROD, l->name = "crank");
}

KT_TEST(ends_of_loops_exist) {
    REJECTS_LOOP(CLOSE, l->between[1].body = "roker", 1, "between", "loop 'close'",
                 "body 'roker' does not exist; did you mean 'rocker'?");
    REJECTS_LOOP(CLOSE, l->between[0].body = "piston", 0, "between", "loop 'close'",
                 "body 'piston' does not exist; name a body of the scene, or 'world'");
    REJECTS_LOOP(CLOSE, l->between[0].body = "wrld", 0, "between", "loop 'close'",
                 "body 'wrld' does not exist; did you mean 'world'?");
    REJECTS_LOOP(CLOSE, l->between[1].marker = "edn", 1, "between", "loop 'close'",
                 "body 'rocker' has no marker 'edn'; did you mean 'end'?");
    REJECTS_LOOP(CLOSE, l->between[1].marker = "start", 1, "between", "loop 'close'",
                 "body 'rocker' has no marker 'start'; add it, or give the point by `at`");
    REJECTS_LOOP(CLOSE, l->between[0].marker = "tip", 0, "between", "loop 'close'",
                 "body 'coupler' has no marker 'tip'; add it, or give the point by `at`");
    REJECTS_LOOP(ROD, l->between[0].marker = "tip", 0, "between", "loop 'rod'",
                 "the world has no markers, and no 'tip'; give the point by `at`");
    REJECTS_LOOP(CLOSE, (l->between[0] = l->between[1], l->between[0].marker = NULL), -1, "between", "loop 'close'",
                 "both ends are on 'rocker'; it takes two bodies");
    REJECTS_LOOP(ROD, l->between[1].body = "world", -1, "between", "loop 'rod'",
                 "both ends are on the world; it takes two bodies");
    REJECTS_LOOP(CLOSE, l->between[0].at.y = nan_value, 0, "between", "loop 'close'",
                 "between[0].at[1] is nan; give a finite number");
    REJECTS_LOOP(ROD, l->between[1].at.z = 1e200, 1, "between", "loop 'rod'",
                 "between[1].at[2] is 1e+200, and the equations would overflow; magnitudes end at 1e+50");
    PASSES_LOOP("at, next to a marker", CLOSE, l->between[1].at.x = nan_value);
}

KT_TEST(rotations_of_ends_are_checked) {
    const kt_rotation wrong = kt_rotation_axis_angle(kt_vec3_make(0.0, 0.0, 0.0), 1.0);
    kt_mat3 matrix;
    kt_error error;
    kt_check_true("no rotation", kt_rotation_evaluate(&wrong, &matrix, &error) != KT_OK);
    for (int end = 0; end < 2; end++) {
        char message[KT_MESSAGE_SIZE + 40];
        snprintf(message, sizeof message, "between[%d].rotation: %s", end, error.message);
        REJECTS_LOOP(CLOSE, l->between[end].rotation = wrong, end, "between", "loop 'close'", message);
    }
}

/* Counts the faults after a change of one member of a loop. The count shows whether the check of this type reads the
 * member. */
static int faults_when(kt_loop_type type, void (*spoil)(kt_loop *)) {
    mechanism m;
    mechanism_fill(&m);
    m.loops[CLOSE].type = type;
    m.loops[CLOSE].function = kt_function_constant(1.0);
    m.loops[CLOSE].joint = "crank";
    m.loops[CLOSE].terms = m.terms;
    m.loops[CLOSE].term_count = 2;
    m.loops[CLOSE].radius = m.loops[CLOSE].radius2 = 1.0;
    m.loops[CLOSE].teeth = m.loops[CLOSE].teeth2 = 2.0;
    m.loops[CLOSE].surface = (kt_surface){.type = KT_SURFACE_TORUS, .radius = 1.0, .tube = 0.5};
    m.loops[CLOSE].curve = (kt_track){.type = KT_TRACK_HELIX, .radius = 1.0, .pitch = 0.5};
    kt_check_equal_int("faults of the sound loop", mechanism_faults(&m.description).count, 0);
    spoil(&m.loops[CLOSE]);
    return mechanism_faults(&m.description).count;
}

static void spoil_ends(kt_loop *l) { l->between[0].body = "nobody"; }
static void spoil_axis(kt_loop *l) { l->axis = kt_vec3_make(0.0, 0.0, 0.0); }
static void spoil_axis2(kt_loop *l) { l->axis2 = kt_vec3_make(0.0, 0.0, 0.0); }
static void spoil_pitch(kt_loop *l) { l->pitch = nan_value; }
static void spoil_radius(kt_loop *l) { l->radius = 0.0; }
static void spoil_function(kt_loop *l) { l->function.value = nan_value; }
static void spoil_joint(kt_loop *l) { l->joint = "nobody"; }
static void spoil_terms(kt_loop *l) { l->term_count = 0; }
static void spoil_offset(kt_loop *l) { l->offset = nan_value; }
static void spoil_surface(kt_loop *l) { l->surface.tube = 0.0; }
static void spoil_curve(kt_loop *l) { l->curve.radius = -1.0; }

KT_TEST(each_loop_type_reads_what_the_format_says) {
    static void (*const spoil[])(kt_loop *) = {spoil_ends,   spoil_axis,     spoil_axis2, spoil_pitch,
                                               spoil_radius, spoil_function, spoil_joint, spoil_terms,
                                               spoil_offset, spoil_surface,  spoil_curve};
    static const struct {
        kt_loop_type type;
        const char *reads; /* one digit for each member above */
    } table[] = {
        {KT_LOOP_SPHERICAL, "10000000000"},  {KT_LOOP_INLINE, "11000000000"},      {KT_LOOP_INPLANE, "11000000000"},
        {KT_LOOP_DISTANCE, "10000100000"},   {KT_LOOP_PARALLEL, "10000000000"},    {KT_LOOP_COAXIAL, "11000000000"},
        {KT_LOOP_ORTHOGONAL, "11100000000"}, {KT_LOOP_REVOLUTE, "11000000000"},    {KT_LOOP_PRISMATIC, "11000000000"},
        {KT_LOOP_SCREW, "11010000000"},      {KT_LOOP_CYLINDRICAL, "11000000000"}, {KT_LOOP_PLANAR, "11000000000"},
        {KT_LOOP_WELD, "10000000000"},       {KT_LOOP_UNIVERSAL, "11100000000"},   {KT_LOOP_COUPLING, "00000001100"},
        {KT_LOOP_MOTION, "00000110000"},     {KT_LOOP_ROLLING, "11101000000"},     {KT_LOOP_KNIFE_EDGE, "11000000000"},
        {KT_LOOP_RATES, "00000101000"},      {KT_LOOP_HOMOKINETIC, "11000000000"}, {KT_LOOP_SURFACE, "11000000010"},
        {KT_LOOP_CURVE, "11000100001"},      {KT_LOOP_GEAR, "11000000000"},        {KT_LOOP_RACK, "11001000000"},
        {KT_LOOP_WORM, "11001000000"},       {KT_LOOP_SPAN, "11000000000"},        {KT_LOOP_BELT, "11001000000"},
    };
    kt_check_equal_int("types in the table", sizeof table / sizeof *table, KT_LOOP_TYPE_COUNT);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char found[12] = "";
        for (size_t k = 0; k < 11; k++)
            found[k] = (char)('0' + faults_when(table[i].type, spoil[k]));
        kt_check_text(kt_loop_type_name(table[i].type), found, table[i].reads);
    }
}

KT_TEST(numbers_of_loops_are_checked) {
    REJECTS_LOOP(CLOSE, l->axis = kt_vec3_make(0.0, 0.0, 0.0), -1, "axis", "loop 'close'",
                 "axis is zero; give it a direction, such as [0, 0, 1]");
    REJECTS_LOOP(CARDAN, l->axis2 = kt_vec3_make(0.0, 0.0, 0.0), -1, "axis2", "loop 'cardan'",
                 "axis2 is zero; give it a direction, such as [0, 0, 1]");
    REJECTS_LOOP(CLOSE, (l->type = KT_LOOP_SCREW, l->pitch = nan_value), -1, "pitch", "loop 'close'",
                 "pitch is nan; give a finite number");
    REJECTS_LOOP(WHEEL, l->radius = -1.0, -1, "radius", "loop 'wheel'", "radius is -1; it must be greater than 0");
    REJECTS_LOOP(GEAR, l->offset = nan_value, -1, "offset", "loop 'gear'", "offset is nan; give a finite number");
}

KT_TEST(joints_of_motions_have_one_coordinate) {
    REJECTS_LOOP(DRIVE, l->joint = NULL, -1, "joint", "loop 'drive'",
                 "joint is missing; name the body that it carries");
    REJECTS_LOOP(DRIVE, l->joint = "world", -1, "joint", "loop 'drive'",
                 "the world has no joint; name a body of the scene");
    REJECTS_LOOP(DRIVE, l->joint = "crnak", -1, "joint", "loop 'drive'",
                 "joint 'crnak' does not exist; did you mean 'crank'?");
    REJECTS_LOOP(DRIVE, l->joint = "piston", -1, "joint", "loop 'drive'",
                 "joint 'piston' does not exist; name a body of the scene");
    REJECTS_LOOP(DRIVE, l->joint = "ball", -1, "joint", "loop 'drive'",
                 "joint 'ball' is spherical; name a joint of one coordinate: revolute, prismatic or screw");
    REJECTS_LOOP(DRIVE, l->joint = "base", -1, "joint", "loop 'drive'",
                 "joint 'base' is fixed; name a joint of one coordinate: revolute, prismatic or screw");
    REJECTS_LOOP(DRIVE, l->joint = "wrld", -1, "joint", "loop 'drive'",
                 "joint 'wrld' does not exist; name a body of the scene");
    REJECTS_LOOP(DRIVE,
                 (l->joint = "crank", m.bodies[CRANK].joint.type = KT_JOINT_PLANAR, m.terms[0].joint = "screw",
                  m.effects[ENGINE].joint = "screw"),
                 -1, "joint", "loop 'drive'",
                 "joint 'crank' is planar; name a joint of one coordinate: revolute, prismatic or screw");
    PASSES_LOOP("screw", DRIVE, l->joint = "screw");
    PASSES_LOOP("revolute", DRIVE, l->joint = "rocker");
    REJECTS_LOOP(DRIVE, l->function.type = KT_FUNCTION_NONE, -1, "position", "loop 'drive'",
                 "position is missing; give a number or a function of time");
}

KT_TEST(couplings_are_checked) {
    const char *missing = "coefficients are missing; give each joint its own";
    REJECTS_LOOP(GEAR, l->term_count = 0, -1, "coefficients", "loop 'gear'", missing);
    REJECTS_LOOP(GEAR, l->term_count = -3, -1, "coefficients", "loop 'gear'", missing);
    REJECTS_LOOP(GEAR, l->terms = NULL, -1, "coefficients", "loop 'gear'", missing);
    REJECTS_LOOP(GEAR, m.terms[1].joint = "crank", 1, "coefficients", "loop 'gear'",
                 "joint 'crank' is given twice; add up its coefficients");
    REJECTS_LOOP(GEAR, m.terms[1].joint = "bird", 1, "coefficients", "loop 'gear'",
                 "joint 'bird' is free; name a joint of one coordinate: revolute, prismatic or screw");
    REJECTS_LOOP(GEAR, m.terms[0].coefficient = nan_value, 0, "coefficients", "loop 'gear'",
                 "coefficients of 'crank' is nan; give a finite number");
    const char *zero = "coefficients are all zero, or nearly so; give one that is not zero";
    REJECTS_LOOP(GEAR, m.terms[0].coefficient = m.terms[1].coefficient = 0.0, -1, "coefficients", "loop 'gear'", zero);
    REJECTS_LOOP(GEAR, (m.terms[0].coefficient = 0.0, m.terms[1].coefficient = 9e-51), -1, "coefficients",
                 "loop 'gear'", zero);
    PASSES_LOOP("one zero among others", GEAR, (m.terms[0].coefficient = 0.0));
    PASSES_LOOP("one term: a locked joint", GEAR, l->term_count = 1);
    mechanism two;
    mechanism_fill(&two);
    two.terms[0].joint = two.terms[1].joint = "nobody";
    kt_check_equal_int("unknown joints do not stand twice", mechanism_faults(&two.description).count, 2);
    /* Two couplings may share their joints. */
    PASSES_LOOP("joints in two couplings", CLOSE, (l->type = KT_LOOP_COUPLING, l->terms = m.terms, l->term_count = 2));
}

KT_TEST(effects_are_checked) {
    REJECTS_EFFECT(OIL, e->name = "", -1, "name", "effects[1]", "name is missing; give it one");
    REJECTS_EFFECT(ENGINE, e->name = "oil", -1, "name", "effect 'oil'",
                   "name 'oil' is that of effects[1] already; choose another");
    REJECTS_EFFECT(OIL, e->type = (kt_effect_type)99, -1, "type", "effect 'oil'",
                   "type is 99, and there is no effect of that number; take one of kt_effect_type");
    REJECTS_EFFECT(COIL, e->between[1].marker = "hele", 1, "between", "effects[0]",
                   "body 'crank' has no marker 'hele'; did you mean 'heel'?");
    REJECTS_EFFECT(COIL, e->between[1] = e->between[0], -1, "between", "effects[0]",
                   "both ends are on 'bird'; it takes two bodies");
    REJECTS_EFFECT(COIL, e->stiffness = -1.0, -1, "stiffness", "effects[0]", "stiffness is -1; it cannot be negative");
    REJECTS_EFFECT(COIL, e->damping = -2.0, -1, "damping", "effects[0]", "damping is -2; it cannot be negative");
    REJECTS_EFFECT(COIL, e->length = nan_value, -1, "length", "effects[0]", "length is nan; give a finite number");
    REJECTS_EFFECT(COIL, e->length = -0.5, -1, "length", "effects[0]", "length is -0.5; it cannot be negative");
    REJECTS_EFFECT(OIL, e->damping = 1e300, -1, "damping", "effect 'oil'",
                   "damping is 1e+300, and the equations would overflow; magnitudes end at 1e+50");
    REJECTS_EFFECT(OIL, e->joint = "gimbal", -1, "joint", "effect 'oil'",
                   "joint 'gimbal' is universal; name a joint of one coordinate: revolute, prismatic or screw");
    REJECTS_EFFECT(ENGINE, e->joint = NULL, -1, "joint", "effect 'engine'",
                   "joint is missing; name the body that it carries");
    REJECTS_EFFECT(ENGINE, e->torque.type = KT_FUNCTION_NONE, -1, "torque", "effect 'engine'",
                   "torque is missing; give a number or a function of time");
    REJECTS_EFFECT(ENGINE, e->torque.value = nan_value, -1, "torque", "effect 'engine'",
                   "torque is nan; give a finite number");
    REJECTS_EFFECT(OIL, (e->type = KT_EFFECT_JOINT_LIMIT, e->stiffness = 1.0, e->lower = nan_value), -1, "lower",
                   "effect 'oil'", "lower is nan; give a finite number");
    REJECTS_EFFECT(OIL, (e->type = KT_EFFECT_JOINT_LIMIT, e->stiffness = 1.0), -1, "lower", "effect 'oil'",
                   "there is neither lower nor upper; give at least one of them");
    REJECTS_EFFECT(OIL, (e->type = KT_EFFECT_TORQUE, e->value[0] = e->value[1] = kt_function_constant(1.0)), -1,
                   "value", "effect 'oil'", "value has a component missing; give three numbers or functions of time");
    REJECTS_EFFECT(COIL, (e->type = KT_EFFECT_BUSHING, e->dampings[3] = -1.0), -1, "damping", "effects[0]",
                   "damping[3] is -1; it cannot be negative");
    REJECTS_EFFECT(COIL, (e->type = KT_EFFECT_ATTRACTION, e->strength = nan_value), -1, "strength", "effects[0]",
                   "strength is nan; give a finite number");
    REJECTS_EFFECT(COIL, (e->type = KT_EFFECT_CONTACT, e->exponent = 0.9), -1, "exponent", "effects[0]",
                   "exponent is 0.9; it must be 1 or more: below, contact would begin with an infinite stiffness");
    mechanism m;
    mechanism_fill(&m);
    m.effects[COIL].initial_length = true;
    m.effects[COIL].length = nan_value;
    m.effects[OIL].name = "crank";
    mechanism_passes("length that the start replaces; name of a body", &m);
}
