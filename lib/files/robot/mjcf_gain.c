/* Kinds of actuators in MJCF: gain, bias, activation and control, with their defaults (mjcf_actuator.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* ---- kinds of actuators ----------------------------------------------------------------------------------------- */

typedef enum gain_type { FIXED, AFFINE, MUSCLE, USER } gain_type;
typedef enum bias_type { NO_BIAS, AFFINE_BIAS, MUSCLE_BIAS, USER_BIAS } bias_type;

static void read_here(kt_mjcf *m, const kt_element *e, const char *name, int least, int most, double *values) {
    double read[10];
    const char *text = kt_xml_attribute(e, name);
    const int count = text != NULL ? kt_parse_numbers(text, 10, read) : 0;
    if (text != NULL && count < least)
        (void)kt_mjcf_fault(m, e, "%s: expected %d to 10 numbers, found '%.60s'", name, least, text);
    for (int i = 0; i < count && i < most; i++)
        values[i] = read[i];
}

static void set_kind(kt_mjcf_actuator *a, int gain, int bias, kt_mjcf_dynamics_type dynamics) {
    a->gain_type = gain;
    a->bias_type = bias;
    a->dynamics.type = dynamics;
}

static void read_general(kt_mjcf *m, const kt_element *e, kt_mjcf_actuator *a) {
    static const char *const gains[] = {"fixed", "affine", "muscle", "user", NULL};
    static const char *const biases[] = {"none", "affine", "muscle", "user", NULL};
    a->gain_type = kt_mjcf_choice(m, e, NULL, "gaintype", gains, a->gain_type);
    a->bias_type = kt_mjcf_choice(m, e, NULL, "biastype", biases, a->bias_type);
    a->dynamics = kt_mjcf_dynamics_of(m, e, a->dynamics);
    read_here(m, e, "gainprm", 1, KT_MJCF_MUSCLE_NUMBERS, a->gain);
    read_here(m, e, "biasprm", 1, KT_MJCF_MUSCLE_NUMBERS, a->bias);
}

/* A cylinder has the gain of its area and a filter. */
static void read_cylinder(kt_mjcf *m, const kt_element *e, kt_mjcf_actuator *a) {
    double diameter = 0.0;
    read_here(m, e, "timeconst", 1, 1, a->dynamics.numbers);
    read_here(m, e, "bias", 1, 3, a->bias);
    read_here(m, e, "area", 1, 1, a->gain);
    read_here(m, e, "diameter", 1, 1, &diameter);
    if (kt_xml_attribute(e, "diameter") != NULL)
        a->gain[0] = 0.25 * 3.14159265358979323846 * diameter * diameter;
    set_kind(a, FIXED, AFFINE_BIAS, KT_MJCF_FILTER);
}

/* A servo of positions. A damping above zero is a ratio (kt_mjcf_resolve_damping). */
static void read_position_servo(kt_mjcf *m, const kt_element *e, kt_mjcf_actuator *a) {
    double damping = -a->bias[2];
    read_here(m, e, "kp", 1, 1, a->gain);
    read_here(m, e, "kv", 1, 1, &damping);
    read_here(m, e, "inheritrange", 1, 1, &a->inherit);
    a->bias[1] = -a->gain[0];
    a->bias[2] = -damping;
    read_here(m, e, "dampratio", 1, 1, a->bias + 2);
    read_here(m, e, "timeconst", 1, 1, a->dynamics.numbers);
    if (kt_xml_attribute(e, "timeconst") != NULL)
        a->dynamics.type = a->dynamics.numbers[0] == 0.0 ? KT_MJCF_STATIC : KT_MJCF_FILTER;
    set_kind(a, FIXED, AFFINE_BIAS, strcmp(e->name, "intvelocity") == 0 ? KT_MJCF_INTEGRATOR : a->dynamics.type);
}

/* A negative number of a muscle means the present number. */
static void read_muscle_numbers(kt_mjcf *m, const kt_element *e, const char *name, int least, int most,
                                double *values) {
    double read[2] = {-1.0, -1.0};
    read_here(m, e, name, least, most, read);
    for (int i = 0; i < most; i++)
        values[i] = read[i] >= 0.0 ? read[i] : values[i];
}

/* A muscle has its own defaults in place of those that all actuators have. Its attributes are the numbers of the gain,
 * and the bias has the same numbers. */
static void read_muscle(kt_mjcf *m, const kt_element *e, kt_mjcf_actuator *a) {
    static const double own[] = {0.75, 1.05, -1.0, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2};
    static const char *const names[] = {"force", "scale", "lmin", "lmax", "vmax", "fpmax", "fvmax"};
    double *gain = a->gain, *times = a->dynamics.numbers;
    for (int i = 0; i < KT_MJCF_MUSCLE_NUMBERS; i++)
        gain[i] = gain[i] == (i == 0 ? 1.0 : 0.0) ? own[i] : gain[i];
    times[0] = times[0] == 1.0 ? 0.01 : times[0];
    times[1] = times[1] == 0.0 ? 0.04 : times[1];
    read_muscle_numbers(m, e, "timeconst", 1, 2, times);
    read_here(m, e, "tausmooth", 1, 1, times + 2);
    read_muscle_numbers(m, e, "range", 2, 2, gain);
    for (int i = 2; i < KT_MJCF_MUSCLE_NUMBERS; i++)
        read_muscle_numbers(m, e, names[i - 2], 1, 1, gain + i);
    memcpy(a->bias, gain, sizeof a->bias);
    set_kind(a, MUSCLE, MUSCLE_BIAS, KT_MJCF_MUSCLE);
}

/* Each kind sets some numbers and keeps the others, which are those that the defaults of any kind have set. */
static void apply_actuator(kt_mjcf *m, const kt_element *e, kt_mjcf_actuator *a) {
    a->is_strange = false;
    if (strcmp(e->name, "general") == 0) {
        read_general(m, e, a);
    } else if (strcmp(e->name, "motor") == 0) {
        a->gain[0] = 1.0;
        set_kind(a, FIXED, NO_BIAS, KT_MJCF_STATIC);
    } else if (strcmp(e->name, "position") == 0 || strcmp(e->name, "intvelocity") == 0) {
        read_position_servo(m, e, a);
    } else if (strcmp(e->name, "velocity") == 0) {
        read_here(m, e, "kv", 1, 1, a->gain);
        memset(a->bias, 0, sizeof a->bias);
        a->bias[2] = -a->gain[0];
        set_kind(a, FIXED, AFFINE_BIAS, KT_MJCF_STATIC);
    } else if (strcmp(e->name, "damper") == 0) {
        double damping = a->gain_type == AFFINE ? -a->gain[2] : 0.0;
        read_here(m, e, "kv", 1, 1, &damping);
        memset(a->gain, 0, sizeof a->gain);
        a->gain[2] = -damping;
        set_kind(a, AFFINE, NO_BIAS, KT_MJCF_STATIC);
    } else if (strcmp(e->name, "cylinder") == 0) {
        read_cylinder(m, e, a);
    } else if (strcmp(e->name, "muscle") == 0) {
        read_muscle(m, e, a);
    } else {
        a->is_strange = true;
        a->dynamics.type = KT_MJCF_STATIC;
    }
}

/* Defaults from the outermost class inwards, each in the order of the file. */
static void apply_classes(kt_mjcf *m, int class, kt_mjcf_actuator *a) {
    const kt_element *e = kt_mjcf_class_element(m, &class);
    if (e == NULL)
        return;
    apply_classes(m, class, a);
    for (const kt_element *d = e->first; d != NULL; d = d->next)
        if (kt_words_have(KT_MJCF_ACTUATORS, d->name))
            apply_actuator(m, d, a);
}

void kt_mjcf_gears_of(kt_mjcf *m, const kt_element *e, double gears[6]) {
    memcpy(gears, (const double[]){1.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 6 * sizeof *gears);
    (void)kt_mjcf_numbers(m, e, KT_MJCF_ACTUATORS, "gear", 1, 6, gears);
}

double kt_mjcf_gear_of(kt_mjcf *m, const kt_element *e) {
    double gears[6];
    kt_mjcf_gears_of(m, e, gears);
    return gears[0];
}

bool kt_mjcf_actuator_range(kt_mjcf *m, const kt_element *e, const char *limited, const char *name, double range[2]) {
    const bool is_damper = strcmp(e->name, "damper") == 0 && strcmp(limited, "ctrllimited") == 0; /* always limited */
    return kt_mjcf_text(m, e, KT_MJCF_ACTUATORS, name) != NULL &&
           (is_damper || kt_mjcf_is_limited(m, e, KT_MJCF_ACTUATORS, limited, name)) &&
           kt_mjcf_numbers(m, e, KT_MJCF_ACTUATORS, name, 2, 2, range) == 2;
}

/* Whether the actuator is a servo of its length: gain u - gain L. */
static bool is_position(const kt_mjcf_actuator *a) {
    return a->gain_type == FIXED && a->bias_type == AFFINE_BIAS && a->gain[0] == -a->bias[1];
}

/* M_jj of a scalar joint at the reference position. This inertia is the armature plus a sum over all bodies that the
 * joint carries. A slide has the terms m_i. A hinge about the axis a through p has the terms a' I_i a + m_i |a x (c_i -
 * p)|^2. */
static double carried_inertia(kt_mjcf *m, const kt_mjcf_joint *j) {
    const kt_pose at = kt_mjcf_body_at(m, j->body)->world;
    const kt_vec3 a = kt_mat3_apply(at.rotation, kt_vec3_normalize(j->axis)), p = kt_pose_apply(at, j->at);
    double sum = kt_mjcf_number(m, j->element, j->tag, "armature", 0.0);
    for (int i = j->body; i < m->bodies.count; i++) {
        const kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        if (!kt_mjcf_is_carried(m, i, j->body))
            continue;
        const kt_vec3 arm = kt_vec3_cross(a, kt_vec3_sub(kt_pose_apply(b->world, b->com), p));
        const kt_vec3 inner = kt_mat3_apply_transposed(b->world.rotation, a);
        sum += j->type == KT_MJCF_SLIDE
                   ? b->mass
                   : kt_vec3_dot(inner, kt_sym3_apply(b->inertia, inner)) + b->mass * kt_vec3_dot(arm, arm);
    }
    return sum;
}

/* A damping above zero is a ratio to the critical damping, 2 sqrt(stiffness inertia). As in MuJoCo, the numbers
 * alone decide whether the actuator is one of positions, whatever the types of gain and bias are. */
void kt_mjcf_resolve_damping(kt_mjcf *m, const kt_element *e, kt_mjcf_actuator *a, double gear, int tendon,
                             const kt_mjcf_term *own) {
    int count;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(m, tendon, own, &count);
    double inertia = 0.0; /* along g L: a joint with dL/dq = c adds its own times 1 / (g c)^2 */
    if (a->bias_type == MUSCLE_BIAS || a->gain[0] != -a->bias[1] || !(a->bias[2] > 0.0))
        return;
    if (tendon >= 0 && kt_mjcf_tendon_at(m, tendon)->path_count > 0) {
        kt_unknown_count(&m->changes, "dampratio of an actuator of a spatial tendon, which is left out", e);
        a->bias[2] = 0.0;
        return;
    }
    for (int i = 0; i < count && gear != 0.0; i++) {
        const double c = gear * terms[i].coefficient;
        inertia += carried_inertia(m, kt_mjcf_joint_at(m, terms[i].joint)) / (c * c);
    }
    if (gear != 0.0)
        a->bias[2] *= -2.0 * sqrt(fmax(0.0, -a->bias[1] * inertia));
}

/* The limits of the joint or tendon of an actuator; false if it has none. */
static bool read_limits_along(kt_mjcf *m, const kt_element *e, double range[2]) {
    const char *tendon = kt_xml_attribute(e, "tendon");
    if (tendon != NULL) {
        const int index = kt_names_find(&m->names, KT_MJCF_TENDONS, tendon);
        const kt_element *t = index >= 0 ? kt_mjcf_tendon_at(m, index)->element : NULL;
        return t != NULL && kt_mjcf_is_limited(m, t, "tendon", "limited", "range") &&
               kt_mjcf_numbers(m, t, "tendon", "range", 2, 2, range) == 2;
    }
    const char *attribute = kt_xml_attribute(e, "joint") != NULL ? "joint" : "jointinparent";
    const int joint = kt_mjcf_find(m, e, attribute, KT_MJCF_JOINTS);
    if (joint < 0 || !kt_mjcf_joint_at(m, joint)->is_limited)
        return false;
    range[0] = kt_mjcf_joint_at(m, joint)->lower;
    range[1] = kt_mjcf_joint_at(m, joint)->upper;
    return true;
}

/* A range that is a part of the range of the actuator's joint or tendon; false if it is none. */
bool kt_mjcf_inherited_range(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double range[2]) {
    if (!(a->inherit > 0.0) || !is_position(a) || !read_limits_along(m, e, range))
        return false;
    const double middle = 0.5 * (range[0] + range[1]), half = 0.5 * a->inherit * (range[1] - range[0]);
    range[0] = middle - half;
    range[1] = middle + half;
    return true;
}

bool kt_mjcf_control_range(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double range[2]) {
    const bool is_limited = kt_mjcf_actuator_range(m, e, "ctrllimited", "ctrlrange", range) ||
                            (a->dynamics.type != KT_MJCF_INTEGRATOR && kt_mjcf_inherited_range(m, e, a, range));
    return is_limited && !m->off.control_limits;
}

double kt_mjcf_control_of(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control) {
    double range[2];
    return kt_mjcf_control_range(m, e, a, range) ? fmin(fmax(control, range[0]), range[1]) : control;
}

void kt_mjcf_gains_of(const kt_mjcf_actuator *a, double gain[3], double bias[3]) {
    for (int i = 0; i < 3; i++) {
        gain[i] = (i == 0 && a->gain_type == FIXED) || a->gain_type == AFFINE ? a->gain[i] : 0.0;
        bias[i] = a->bias_type == AFFINE_BIAS ? a->bias[i] : 0.0;
    }
}

void kt_mjcf_force_of(const kt_mjcf_actuator *a, double control, double c[3]) {
    double gain[3], bias[3];
    kt_mjcf_gains_of(a, gain, bias);
    for (int i = 0; i < 3; i++)
        c[i] = gain[i] * control + bias[i];
}

const kt_muscle *kt_mjcf_muscle_of(kt_mjcf *m, const double numbers[KT_MJCF_MUSCLE_NUMBERS],
                                   const kt_mjcf_reach *reach) {
    static const double least = 1e-15; /* of divisors */
    kt_muscle *made = kt_reader_take(m->r, &m->r->keep, 1, sizeof *made);
    if (made == NULL)
        return NULL;
    *made = (kt_muscle){.range = {numbers[0], numbers[1]},
                        .lengths = {reach->range[0], reach->range[1]},
                        .force = numbers[2] < 0.0 ? numbers[3] / fmax(least, reach->acceleration) : numbers[2],
                        .shortest = numbers[4],
                        .longest = numbers[5],
                        .speed = numbers[6],
                        .passive = numbers[7],
                        .stretched = numbers[8]};
    return made;
}

kt_mjcf_actuator kt_mjcf_actuator_of(kt_mjcf *m, const kt_element *e) {
    kt_mjcf_actuator a = {.gain = {1.0}, .dynamics = {.numbers = {1.0}}};
    apply_classes(m, e->number, &a);
    apply_actuator(m, e, &a);
    a.is_of_user = a.dynamics.type == KT_MJCF_LOST || a.gain_type == USER || a.bias_type == USER_BIAS;
    a.has_active = a.gain_type == MUSCLE;
    a.has_passive = a.bias_type == MUSCLE_BIAS;
    a.has_affine_gain = a.gain_type == AFFINE;
    a.dynamics.delay = kt_mjcf_number(m, e, KT_MJCF_ACTUATORS, "delay", 0.0);
    return a;
}
