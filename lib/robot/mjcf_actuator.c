/* Actuators of MJCF as effects.
 *
 * An actuator with the gear g acts along the length g L. For the control u it has the force f, clamped to `forcerange`:
 *     f = gain u + b0 + b1 g L + b2 g L',   gain = g0 + g1 g L + g2 g L'.
 * Only an affine gain has g1 and g2. For a constant u, f is the clamp of c0 + c1 g L + c2 g L', and g f acts on L. The
 * actuator is a motor if c1 = c2 = 0. Else it is a servo of stiffness -g^2 c1 and damping -g^2 c2.
 *
 * `actuatorfrcrange` of a joint bounds the sum of the actuator forces in this joint. For a single actuator, its own
 * bounds and these are one pair, since a clamp of a clamp is a clamp. For several actuators, or for a tendon that acts
 * in several joints, the sum becomes a formula in each joint.
 */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* ---- what an actuator is ----------------------------------------------------------------------------------------- */

typedef enum gain_type { FIXED, AFFINE, MUSCLE, USER } gain_type;
typedef enum bias_type { NO_BIAS, AFFINE_BIAS, MUSCLE_BIAS, USER_BIAS } bias_type;

/* The properties of an actuator with its defaults. MuJoCo keeps one set of numbers for all kinds. */
typedef struct actuator {
    gain_type gain_type;
    bias_type bias_type;
    bool is_dynamic, is_strange; /* has an activation; is of a kind that is left out */
    double gain[3], bias[3];
    double inherit; /* the range of control is this part of the length's range; 0: it has its own */
} actuator;

static void read_here(kt_mjcf *m, const kt_element *e, const char *name, int least, int most, double *values) {
    double read[10];
    const char *text = kt_xml_attribute(e, name);
    const int count = text != NULL ? kt_parse_numbers(text, 10, read) : 0;
    if (text != NULL && count < least)
        (void)kt_mjcf_fault(m, e, "%s: expected %d to 10 numbers, found '%.60s'", name, least, text);
    for (int i = 0; i < count && i < most; i++)
        values[i] = read[i];
}

static void read_general(kt_mjcf *m, const kt_element *e, actuator *a) {
    static const char *const gains[] = {"fixed", "affine", "muscle", "user", NULL};
    static const char *const biases[] = {"none", "affine", "muscle", "user", NULL};
    const char *dynamics = kt_xml_attribute(e, "dyntype");
    a->gain_type = (gain_type)kt_mjcf_choice(m, e, NULL, "gaintype", gains, (int)a->gain_type);
    a->bias_type = (bias_type)kt_mjcf_choice(m, e, NULL, "biastype", biases, (int)a->bias_type);
    if (dynamics != NULL)
        a->is_dynamic = strcmp(dynamics, "none") != 0;
    read_here(m, e, "gainprm", 1, 3, a->gain);
    read_here(m, e, "biasprm", 1, 3, a->bias);
}

/* The shortcuts set gain and bias. The numbers that they read begin with the values that the defaults have set. */
static void apply_actuator(kt_mjcf *m, const kt_element *e, actuator *a) {
    double k[3] = {a->gain[0], 0.0, 0.0}, v = -a->bias[2];
    a->is_strange = false;
    if (strcmp(e->name, "general") == 0) {
        read_general(m, e, a);
    } else if (strcmp(e->name, "motor") == 0) {
        *a = (actuator){.gain = {1.0}};
    } else if (strcmp(e->name, "position") == 0) {
        double ratio = -v, inherit = a->inherit;
        read_here(m, e, "kp", 1, 1, k);
        read_here(m, e, "kv", 1, 1, &v);
        read_here(m, e, "inheritrange", 1, 1, &inherit);
        if (kt_xml_attribute(e, "dampratio") != NULL) {
            read_here(m, e, "dampratio", 1, 1, &ratio);
            v = -ratio;
        }
        *a = (actuator){.gain = {k[0]}, .bias_type = AFFINE_BIAS, .bias = {0.0, -k[0], -v}, .inherit = inherit};
        a->is_dynamic = kt_xml_attribute(e, "timeconst") != NULL;
    } else if (strcmp(e->name, "velocity") == 0) {
        read_here(m, e, "kv", 1, 1, k);
        *a = (actuator){.gain = {k[0]}, .bias_type = AFFINE_BIAS, .bias = {0.0, 0.0, -k[0]}};
    } else if (strcmp(e->name, "damper") == 0) {
        k[0] = 0.0;
        read_here(m, e, "kv", 1, 1, k);
        *a = (actuator){.gain_type = AFFINE, .gain = {0.0, 0.0, -k[0]}};
    } else {
        a->is_strange = true;
    }
}

static bool is_actuator(const kt_element *e) {
    static const char *const names[] = {"general",     "motor",    "position", "velocity", "damper",
                                        "intvelocity", "cylinder", "muscle",   "adhesion"};
    bool found = false;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        found = found || strcmp(e->name, names[i]) == 0;
    return found;
}

/* Defaults from the outermost class inwards, each in the order of the file. */
static void apply_classes(kt_mjcf *m, int class, actuator *a) {
    const kt_element *e = kt_mjcf_class_element(m, &class);
    if (e == NULL)
        return;
    apply_classes(m, class, a);
    for (const kt_element *d = e->first; d != NULL; d = d->next)
        if (is_actuator(d))
            apply_actuator(m, d, a);
}

/* An attribute that all kinds have, of the element or of the defaults of any kind. */
static const char *common_tag(const kt_mjcf *m, const kt_element *e, const char *name) {
    static const char *const tags[] = {"general", "motor", "position", "velocity", "damper"};
    if (kt_mjcf_text(m, e, e->name, name) != NULL)
        return e->name;
    for (size_t i = 0; i < sizeof tags / sizeof *tags; i++)
        if (kt_mjcf_text(m, e, tags[i], name) != NULL)
            return tags[i];
    return NULL;
}

static bool read_limit(kt_mjcf *m, const kt_element *e, const char *limited, const char *name, double range[2]) {
    const char *tag = common_tag(m, e, name);
    return tag != NULL &&
           kt_mjcf_is_limited(m, e, common_tag(m, e, limited) != NULL ? common_tag(m, e, limited) : tag, limited,
                              name) &&
           kt_mjcf_numbers(m, e, tag, name, 2, 2, range) == 2;
}

/* Whether the actuator is a servo of its length: gain u - gain L. */
static bool is_position(const actuator *a) {
    return a->gain_type == FIXED && a->bias_type == AFFINE_BIAS && a->gain[0] == -a->bias[1];
}

/* M_jj of a scalar joint at the reference position. It is the armature plus a sum over all bodies that the joint
 * carries. A slide has the terms m_i. A hinge about the axis a through p has the terms a' I_i a + m_i |a x (c_i -
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

/* The inertia along the length g L of an actuator. A joint with dL/dq = c adds its own inertia times 1 / (g c)^2. */
static double inertia_along(kt_mjcf *m, const kt_element *e, double gear) {
    const char *tendon = kt_xml_attribute(e, "tendon");
    if (tendon == NULL) {
        const char *attribute = kt_xml_attribute(e, "joint") != NULL ? "joint" : "jointinparent";
        const int joint = kt_mjcf_find(m, e, attribute, KT_MJCF_JOINTS);
        return joint >= 0 ? carried_inertia(m, kt_mjcf_joint_at(m, joint)) / (gear * gear) : 0.0;
    }
    const kt_mjcf_tendon *t = kt_mjcf_tendon_at(m, kt_names_find(&m->names, KT_MJCF_TENDONS, tendon));
    double sum = 0.0;
    for (int i = 0; i < t->count; i++) {
        const kt_mjcf_term *term = kt_mjcf_term_at(m, t->first + i);
        const double c = gear * term->coefficient;
        sum += carried_inertia(m, kt_mjcf_joint_at(m, term->joint)) / (c * c);
    }
    return sum;
}

/* If the damping of an actuator of positions is above zero, it is a ratio to the critical one, 2 sqrt(stiffness
 * inertia). */
static void resolve_damping(kt_mjcf *m, const kt_element *e, actuator *a, double gear) {
    if (is_position(a) && a->bias[2] > 0.0 && gear != 0.0)
        a->bias[2] *= -2.0 * sqrt(fmax(0.0, -a->bias[1] * inertia_along(m, e, gear)));
}

/* The limits of the joint or tendon of an actuator; false if it has none. */
static bool read_limits_along(kt_mjcf *m, const kt_element *e, double range[2]) {
    const char *tendon = kt_xml_attribute(e, "tendon");
    if (tendon != NULL) {
        const kt_element *t = kt_mjcf_tendon_at(m, kt_names_find(&m->names, KT_MJCF_TENDONS, tendon))->element;
        return kt_mjcf_is_limited(m, t, "tendon", "limited", "range") &&
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

/* The control, clamped to its range, or to a part of the range of the actuator's joint or tendon. */
static double limit_control(kt_mjcf *m, const kt_element *e, const actuator *a, double control) {
    double range[2];
    bool is_limited = read_limit(m, e, "ctrllimited", "ctrlrange", range);
    if (!is_limited && a->inherit > 0.0 && is_position(a) && read_limits_along(m, e, range)) {
        const double middle = 0.5 * (range[0] + range[1]), half = 0.5 * a->inherit * (range[1] - range[0]);
        range[0] = middle - half;
        range[1] = middle + half;
        is_limited = true;
    }
    return is_limited && !m->off.control_limits ? fmin(fmax(control, range[0]), range[1]) : control;
}

/* c0 + c1 L + c2 L', the force for a constant control. */
static void force_of(const actuator *a, double control, double c[3]) {
    for (int i = 0; i < 3; i++)
        c[i] = (i == 0 || a->gain_type == AFFINE ? a->gain[i] * control : 0.0) +
               (a->bias_type == AFFINE_BIAS ? a->bias[i] : 0.0);
}

/* ---- actions ----------------------------------------------------------------------------------------------------- */

/* An actuator along the length L of a joint or a tendon, with the force gear times the clamp of c0 + c1 gear L + c2
 * gear L'. If several act along one tendon and their sum is bounded, one factor scales the forces before that clamp. */
typedef struct action {
    const kt_element *element;
    int tendon; /* -1: none */
    kt_mjcf_term own;
    double gear, c[3], bounds[2];
    bool is_formula;
    bool is_shared; /* the sum of the forces along the tendon has the bounds `shared` */
    double shared[2];
} action;

static action *action_at(const kt_list *actions, int i) { return (action *)actions->items + i; }

/* The terms of joints whose sum is the length of an action. */
static const kt_mjcf_term *terms_of(const kt_mjcf *m, const action *d, int *count) {
    const kt_mjcf_tendon *t = d->tendon >= 0 ? kt_mjcf_tendon_at(m, d->tendon) : NULL;
    *count = t != NULL ? t->count : 1;
    return t != NULL ? kt_mjcf_term_at(m, t->first) : &d->own;
}

/* dL/dq of a joint. */
static double lever_of(const kt_mjcf *m, const action *d, int joint) {
    int count;
    double sum = 0.0;
    const kt_mjcf_term *terms = terms_of(m, d, &count);
    for (int i = 0; i < count; i++)
        sum += terms[i].joint == joint ? terms[i].coefficient : 0.0;
    return sum;
}

/* Finds the joint or tendon of an actuator. If it is left out, counts it and returns false. */
static bool find_length_of(kt_mjcf *m, const kt_element *e, action *d) {
    const char *attribute = kt_xml_attribute(e, "joint") != NULL           ? "joint"
                            : kt_xml_attribute(e, "jointinparent") != NULL ? "jointinparent"
                                                                           : "tendon";
    if (kt_xml_attribute(e, attribute) == NULL) {
        kt_unknown_count(&m->forces, "actuator of two sites, a body or a crank", e);
        return false;
    }
    if (strcmp(attribute, "tendon") == 0) {
        d->tendon = kt_names_find(&m->names, KT_MJCF_TENDONS, kt_xml_attribute(e, "tendon"));
        if (d->tendon < 0 || kt_mjcf_tendon_at(m, d->tendon)->count == 0)
            kt_unknown_count(&m->forces, "actuator of a tendon that is left out", e);
        return d->tendon >= 0 && kt_mjcf_tendon_at(m, d->tendon)->count > 0;
    }
    const int joint = kt_mjcf_find(m, e, attribute, KT_MJCF_JOINTS);
    d->own = (kt_mjcf_term){joint, 1.0};
    if (joint >= 0 && !kt_mjcf_is_scalar(kt_mjcf_joint_at(m, joint)))
        kt_unknown_count(&m->forces, "actuator of a ball or free joint", e);
    return joint >= 0 && kt_mjcf_is_scalar(kt_mjcf_joint_at(m, joint));
}

static double clamp(double x, double lower, double upper) { return fmin(fmax(x, lower), upper); }

/* Bounds that hold after others: a clamp of a clamp. */
static void clamp_bounds(double bounds[2], const double by[2]) {
    for (int i = 0; i < 2; i++)
        bounds[i] = clamp(bounds[i], by[0], by[1]);
}

/* Whether `option actuatorgroupdisable` has the group of an actuator. */
static bool is_disabled(kt_mjcf *m, const kt_element *e) {
    const char *tag = common_tag(m, e, "group");
    const double group = tag != NULL ? kt_mjcf_number(m, e, tag, "group", 0.0) : 0.0;
    return group >= 0.0 && group < 31.0 && (m->off.actuator_groups >> (int)group & 1) != 0;
}

static void name_effect(kt_mjcf *m, const char *name) {
    kt_effect *effects = m->draft.effects.items;
    if (name != NULL && *name != '\0')
        effects[m->draft.effects.count - 1].name = kt_namer_make(&m->effects_named, name);
}

/* Half of a wrench on the body of a site, along its axes. */
static void add_at_site(kt_mjcf *m, const kt_element *e, const kt_mjcf_site *site, kt_effect_type type,
                        const double *gear, double force) {
    const kt_vec3 along = kt_mat3_apply(site->pose.rotation, kt_vec3_make(gear[0], gear[1], gear[2]));
    const double parts[3] = {along.x, along.y, along.z};
    if (parts[0] == 0.0 && parts[1] == 0.0 && parts[2] == 0.0)
        return;
    kt_effect *effect = kt_draft_effect(&m->draft, e, type);
    if (effect == NULL)
        return;
    effect->between[0].body = kt_mjcf_body_at(m, site->body)->name;
    effect->between[0].at = site->pose.position;
    effect->frame = KT_FRAME_BODY;
    for (int k = 0; k < 3; k++)
        effect->value[k] = kt_function_constant(force * parts[k]);
    name_effect(m, kt_xml_attribute(e, "name"));
}

/* Whether the forces of actuators are bounded in a joint that carries a body. */
static bool is_bounded_above(const kt_mjcf *m, int body) {
    bool found = false;
    for (int i = 0; i < m->joints.count; i++)
        found = found ||
                (kt_mjcf_is_carried(m, body, kt_mjcf_joint_at(m, i)->body) && !isinf(kt_mjcf_joint_at(m, i)->effort));
    return found;
}

/* An actuator of a site without another site acts with force times gear, a force and a moment in the site's axes. Its
 * length is zero. */
static void act_at_site(kt_mjcf *m, const kt_element *e, const actuator *a, double control) {
    const int index = kt_mjcf_find(m, e, "site", KT_MJCF_SITES);
    const kt_mjcf_site *site = index >= 0 ? kt_mjcf_site_at(m, index) : NULL;
    double gear[6] = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0}, c[3], bounds[2];
    const char *tag = common_tag(m, e, "gear");
    if (tag != NULL)
        (void)kt_mjcf_numbers(m, e, tag, "gear", 1, 6, gear);
    force_of(a, limit_control(m, e, a, control), c);
    if (c[2] != 0.0)
        kt_unknown_count(&m->changes, "damping of an actuator of a site, which is left out", e);
    if (common_tag(m, e, "delay") != NULL)
        kt_unknown_count(&m->changes, "delay of an actuator's control, which acts at once", e);
    if (read_limit(m, e, "forcelimited", "forcerange", bounds))
        c[0] = clamp(c[0], bounds[0], bounds[1]);
    if (site == NULL || site->body == 0)
        return;
    if (is_bounded_above(m, site->body))
        kt_unknown_count(&m->changes, "actuatorfrcrange of joints that an actuator of a site moves, too", e);
    add_at_site(m, e, site, KT_EFFECT_FORCE, gear, c[0]);
    add_at_site(m, e, site, KT_EFFECT_TORQUE, gear + 3, c[0]);
    kt_left_count(&m->motors, e);
}

static void add_action(kt_mjcf *m, const kt_element *e, double control, kt_list *actions) {
    const double infinite = (double)INFINITY;
    action d = {.element = e, .tendon = -1, .gear = 1.0, .bounds = {-infinite, infinite}};
    actuator a = {.gain = {1.0}};
    double force[2];
    apply_classes(m, e->number, &a);
    apply_actuator(m, e, &a);
    if (a.is_strange || a.is_dynamic || a.gain_type > AFFINE || a.bias_type > AFFINE_BIAS) {
        kt_unknown_count(&m->forces, a.is_strange ? e->name : "actuator with an activation, or of a user's kind", e);
        return;
    }
    if (kt_xml_attribute(e, "site") != NULL && common_tag(m, e, "refsite") == NULL) {
        act_at_site(m, e, &a, control);
        return;
    }
    if (!find_length_of(m, e, &d))
        return;
    const char *tag = common_tag(m, e, "gear");
    double gears[6];
    if (tag != NULL && kt_mjcf_numbers(m, e, tag, "gear", 1, 6, gears) > 0)
        d.gear = gears[0];
    if (read_limit(m, e, "forcelimited", "forcerange", force))
        memcpy(d.bounds, force, sizeof force);
    resolve_damping(m, e, &a, d.gear);
    force_of(&a, limit_control(m, e, &a, control), d.c);
    if (common_tag(m, e, "delay") != NULL)
        kt_unknown_count(&m->changes, "delay of an actuator's control, which acts at once", e);
    action *to = d.gear != 0.0 ? kt_list_add(m->r, &m->r->scratch, actions, sizeof *to) : NULL;
    if (to != NULL)
        *to = d;
}

/* ---- bounds of sums ---------------------------------------------------------------------------------------------- */

/* The next action along the same tendon; NULL: there is none. */
static action *next_sharer(const kt_list *actions, const action *d) {
    for (action *next = (action *)d + 1; next < action_at(actions, actions->count); next++)
        if (next->tendon == d->tendon)
            return next;
    return NULL;
}

/* Whether all actions along a tendon have one gear, and no bounds of their own: then the sum is clamped as a whole. */
static bool is_one_sum(const kt_list *actions, const action *first) {
    bool is_one = true;
    for (const action *d = first; d != NULL; d = next_sharer(actions, d))
        is_one = is_one && d->gear == first->gear && isinf(d->bounds[0]) && isinf(d->bounds[1]);
    return is_one;
}

/* `actuatorfrcrange` of a tendon bounds the sum of the forces along it, without their gears. If zero is outside of the
 * range, a scaling factor has a pole. */
static void limit_tendon(kt_mjcf *m, const kt_list *actions, action *d) {
    double range[2], own[2] = {d->bounds[0], d->bounds[1]};
    const kt_element *t = d->tendon >= 0 ? kt_mjcf_tendon_at(m, d->tendon)->element : NULL;
    if (t == NULL || d->is_shared || !kt_mjcf_is_limited(m, t, "tendon", "actuatorfrclimited", "actuatorfrcrange") ||
        kt_mjcf_numbers(m, t, "tendon", "actuatorfrcrange", 2, 2, range) != 2)
        return;
    if (next_sharer(actions, d) == NULL) {
        memcpy(d->bounds, range, sizeof range);
        clamp_bounds(d->bounds, own);
        return;
    }
    if (!(range[0] < 0.0 && range[1] > 0.0) && !is_one_sum(actions, d)) {
        kt_unknown_count(&m->changes,
                         "actuatorfrcrange without zero of a tendon that several actuators pull, which is left out", t);
        return;
    }
    for (action *each = d; each != NULL; each = next_sharer(actions, each)) {
        each->is_shared = true;
        memcpy(each->shared, range, sizeof range);
    }
}

/* Whether a formula is needed. It is if a sum that contains the actuator is bounded. It is also needed if the force
 * grows with the length or its rate, since no servo has such a force. */
static bool needs_formula(const kt_mjcf *m, const kt_list *actions, const action *d) {
    int count;
    const kt_mjcf_term *terms = terms_of(m, d, &count);
    if (d->is_shared)
        return true;
    for (int i = 0; i < count; i++) {
        int sharers = 0;
        if (isinf(kt_mjcf_joint_at(m, terms[i].joint)->effort))
            continue;
        for (int k = 0; k < actions->count; k++)
            sharers += lever_of(m, action_at(actions, k), terms[i].joint) != 0.0;
        if (sharers > 1 || count > 1)
            return true;
    }
    return d->c[1] > 0.0 || d->c[2] > 0.0;
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* c: the coefficients of the force in the joint for the constant, the position and the velocity. */
static void add_servo(kt_mjcf *m, const kt_mjcf_line *l, const double c[3], const double bounds[2]) {
    kt_effect *servo = kt_mjcf_add_along(m, l, KT_EFFECT_SERVO);
    double *line_of_time = kt_pool_take(&m->r->keep, 2, sizeof *line_of_time);
    if (servo == NULL || line_of_time == NULL) {
        (void)kt_reader_out_of_memory(m->r);
        return;
    }
    servo->stiffness = 0.0 - c[1]; /* no negative zero */
    servo->damping = 0.0 - c[2];
    /* without stiffness the target's rate is that of the control */
    line_of_time[1] = servo->stiffness > 0.0 ? 0.0 : c[0] / servo->damping;
    servo->target = servo->stiffness > 0.0 ? kt_function_constant(c[0] / servo->stiffness)
                    : c[0] == 0.0          ? kt_function_constant(0.0)
                                           : kt_function_polynomial(line_of_time, 2);
    servo->lower = bounds[0];
    servo->upper = bounds[1];
    kt_left_count(&m->servos, l->element);
}

/* Adds an actuator as an effect of its own. No other actuator shares its bounds. */
static void add_alone(kt_mjcf *m, const action *d) {
    kt_mjcf_line l = {.element = d->element, .factor = 1.0};
    kt_mjcf_tendon *t = d->tendon >= 0 ? kt_mjcf_tendon_at(m, d->tendon) : NULL;
    if (t != NULL && !kt_mjcf_find_length(m, t))
        return;
    l.joint = t != NULL ? t->joint : kt_mjcf_joint_at(m, d->own.joint)->name;
    l.factor = d->gear * (t != NULL ? t->coefficient : 1.0);
    const double c[3] = {l.factor * d->c[0], l.factor * l.factor * d->c[1], l.factor * l.factor * d->c[2]};
    const double ends[2] = {l.factor * d->bounds[0], l.factor * d->bounds[1]};
    double bounds[2] = {fmin(ends[0], ends[1]), fmax(ends[0], ends[1])};
    int count;
    const kt_mjcf_term *terms = terms_of(m, d, &count);
    if (count == 1)
        clamp_bounds(bounds, kt_mjcf_joint_at(m, terms[0].joint)->force);
    if ((c[1] != 0.0 || c[2] != 0.0) && bounds[0] < bounds[1]) {
        add_servo(m, &l, c, bounds);
    } else {
        kt_effect *motor = kt_mjcf_add_along(m, &l, KT_EFFECT_MOTOR);
        if (motor == NULL)
            return;
        motor->torque = kt_function_constant(clamp(c[0], bounds[0], bounds[1]));
        kt_left_count(&m->motors, d->element);
    }
    name_effect(m, kt_xml_attribute(d->element, "name"));
}

/* Writes "clamp(", "min(", "max(" or "(", according to the finite bounds; at the end, the bounds and ")". */
static void put_bounded(kt_mjcf_formula *to, const double bounds[2], bool begins) {
    const bool is_below = !isinf(bounds[1]), is_above = !isinf(bounds[0]);
    if (begins) {
        kt_mjcf_put(to, is_below && is_above ? "clamp(" : is_below ? "min(" : is_above ? "max(" : "(");
        return;
    }
    for (int i = 0; i < 2; i++) {
        if (isinf(bounds[i]))
            continue;
        kt_mjcf_put(to, ", ");
        kt_mjcf_put_number(to, bounds[i]);
    }
    kt_mjcf_put(to, ")");
}

/* "2 + -5*position.a + -1*velocity.a" of c0 + c1 L + c2 L'. */
static void put_affine(const kt_mjcf *m, const action *d, const double c[3], kt_mjcf_formula *to) {
    static const char *const quantities[] = {"position", "velocity"};
    int count;
    const kt_mjcf_term *terms = terms_of(m, d, &count);
    kt_mjcf_put_number(to, c[0]);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < count && c[k + 1] != 0.0; i++) {
            kt_mjcf_put(to, " + ");
            kt_mjcf_put_coordinate(to, c[k + 1] * terms[i].coefficient, quantities[k],
                                   kt_mjcf_joint_at(m, terms[i].joint)->name);
        }
}

static void put_force(const kt_mjcf *m, const action *d, kt_mjcf_formula *to) {
    const double c[3] = {d->c[0], d->c[1] * d->gear, d->c[2] * d->gear};
    put_affine(m, d, c, to);
}

/* The sum of the forces of all actuators that share a tendon, before bounds. */
static void put_shared_sum(const kt_mjcf *m, const kt_list *actions, const action *first, kt_mjcf_formula *to) {
    double c[3] = {0.0, 0.0, 0.0};
    for (const action *d = first; d != NULL; d = next_sharer(actions, d)) {
        c[0] += d->c[0];
        c[1] += d->c[1] * d->gear;
        c[2] += d->c[2] * d->gear;
    }
    put_affine(m, first, c, to);
}

/* The factor that brings a sum S between bounds l < 0 < u: "*u/max(u, S)*l/min(l, S)". */
static void put_share(const kt_mjcf *m, const kt_list *actions, const action *first, kt_mjcf_formula *to) {
    static const char *const calls[] = {"/min(", "/max("};
    for (int i = 0; i < 2; i++) {
        kt_mjcf_put(to, "*");
        kt_mjcf_put_number(to, first->shared[i]);
        kt_mjcf_put(to, calls[i]);
        kt_mjcf_put_number(to, first->shared[i]);
        kt_mjcf_put(to, ", ");
        put_shared_sum(m, actions, first, to);
        kt_mjcf_put(to, ")");
    }
}

/* Writes a term such as `3*clamp(2 + -5*position.a + -1*velocity.a, -1, 1)`. For the first of several actuators that
 * share a tendon, writes the terms of all. */
static void put_action(const kt_mjcf *m, const kt_list *actions, const action *first, double lever,
                       kt_mjcf_formula *to) {
    const bool is_one = first->is_shared && is_one_sum(actions, first);
    for (const action *d = first; d != NULL; d = d->is_shared && !is_one ? next_sharer(actions, d) : NULL) {
        const double *bounds = is_one ? d->shared : d->bounds;
        kt_mjcf_put(to, d != first ? " + " : "");
        kt_mjcf_put_number(to, d->gear * lever);
        kt_mjcf_put(to, "*");
        put_bounded(to, bounds, true);
        kt_mjcf_put(to, d->is_shared && !is_one ? "(" : "");
        if (is_one)
            put_shared_sum(m, actions, d, to);
        else
            put_force(m, d, to);
        kt_mjcf_put(to, d->is_shared && !is_one ? ")" : "");
        if (d->is_shared && !is_one)
            put_share(m, actions, first, to);
        put_bounded(to, bounds, false);
    }
}

/* Whether an action is part of one that is written with another along the same tendon. */
static bool is_written_with_another(const kt_list *actions, int index) {
    const action *d = action_at(actions, index);
    for (int i = 0; i < index && d->is_shared; i++)
        if (action_at(actions, i)->tendon == d->tendon)
            return true;
    return false;
}

/* The sum of all actuators that act in a joint with formulas. */
static void add_sum(kt_mjcf *m, const kt_list *actions, int joint) {
    const kt_mjcf_joint *j = kt_mjcf_joint_at(m, joint);
    kt_mjcf_formula to = {.whole = true};
    const action *last = NULL;
    int sharers = 0, variables = 0, count;
    put_bounded(&to, j->force, true);
    for (int i = 0; i < actions->count; i++) {
        const action *d = action_at(actions, i);
        const double lever = d->is_formula && !is_written_with_another(actions, i) ? lever_of(m, d, joint) : 0.0;
        if (lever == 0.0)
            continue;
        kt_mjcf_put(&to, sharers++ > 0 ? " + " : "");
        put_action(m, actions, d, lever, &to);
        (void)terms_of(m, d, &count);
        variables += 2 * count;
        last = d;
    }
    put_bounded(&to, j->force, false);
    if (sharers == 0)
        return;
    const char *text = variables <= KT_FORMULA_VARIABLE_MAX ? kt_mjcf_keep_formula(m, &to) : NULL;
    kt_effect *effect = text != NULL ? kt_draft_effect(&m->draft, last->element, KT_EFFECT_EXPRESSION) : NULL;
    if (effect == NULL) {
        kt_unknown_count(&m->forces, "actuators whose limited sum is too long for a formula", last->element);
        return;
    }
    effect->joint = j->name;
    effect->formula[0] = text;
    kt_phrase name = {.length = 0};
    kt_phrase_add(&name, "%.150s_actuators", j->name);
    name_effect(m, sharers == 1 && last->tendon < 0 ? kt_xml_attribute(last->element, "name") : name.text);
    kt_left_count(&m->sums, last->element);
}

void kt_mjcf_actuators(kt_mjcf *m) {
    kt_list actions = {.count = 0};
    int index = 0;
    for (const kt_element *e = kt_mjcf_section(m, "actuator", NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_section(m, "actuator", e), index++)
        if (m->off.actuation || is_disabled(m, e))
            kt_left_count(&m->idle, e);
        else
            add_action(m, e, m->ctrl != NULL ? m->ctrl[index] : 0.0, &actions);
    for (int i = 0; i < actions.count; i++)
        limit_tendon(m, &actions, action_at(&actions, i));
    for (int i = 0; i < actions.count; i++)
        action_at(&actions, i)->is_formula = needs_formula(m, &actions, action_at(&actions, i));
    for (int i = 0; i < actions.count && !m->r->out_of_memory; i++)
        if (!action_at(&actions, i)->is_formula)
            add_alone(m, action_at(&actions, i));
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++)
        add_sum(m, &actions, i);
}
