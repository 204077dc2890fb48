/* Passive forces, fixed tendons and actuators of MJCF as effects.
 *
 * A fixed tendon has the length L = sum c_i q_i. One with a single joint acts in it, with the factor c. One with
 * several becomes the position of a body without mass, on a prismatic joint of its own, which a coupling holds to that
 * sum: forces in it are c_i times that in each joint.
 *
 * An actuator acts along g L with the gear g: its force is f = gain u + b0 + b1 g L + b2 g L', with the control u and,
 * where the gain is affine, gain = g0 + g1 g L + g2 g L'. With constant u this is c0 + c1 g L + c2 g L', and g f acts
 * on L: a motor where c1 = c2 = 0, else a servo of stiffness -g^2 c1 and damping -g^2 c2.
 */
#include "import/mjcf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- a scalar joint, or a tendon --------------------------------------------------------------------------------- */

/* What acts along a length L = factor q of a scalar joint. */
typedef struct line {
    const kt_element *element;
    const char *tag, *joint;
    double factor;
} line;

static kt_effect *add_along(kt_mjcf *m, const line *l, kt_effect_type type) {
    kt_effect *effect = kt_draft_effect(&m->draft, l->element, type);
    if (effect != NULL)
        effect->joint = l->joint;
    return effect;
}

static void add_spring(kt_mjcf *m, const line *l, double stiffness, double rest) {
    kt_effect *effect = stiffness != 0.0 ? add_along(m, l, KT_EFFECT_JOINT_SPRING) : NULL;
    if (effect == NULL)
        return;
    effect->stiffness = stiffness * l->factor * l->factor;
    effect->rest = kt_function_constant(rest / l->factor);
}

static void add_damping(kt_mjcf *m, const line *l) {
    const double damping = kt_mjcf_number(m, l->element, l->tag, "damping", 0.0);
    const double friction = kt_mjcf_number(m, l->element, l->tag, "frictionloss", 0.0);
    kt_effect *damper = damping != 0.0 ? add_along(m, l, KT_EFFECT_JOINT_DAMPER) : NULL;
    if (damper != NULL)
        damper->damping = damping * l->factor * l->factor;
    kt_effect *rub = friction != 0.0 ? add_along(m, l, KT_EFFECT_JOINT_FRICTION) : NULL;
    if (rub != NULL) {
        rub->coulomb = friction * fabs(l->factor);
        kt_left_count(&m->friction, l->element);
    }
}

static void add_stop(kt_mjcf *m, const line *l, double lower, double upper) {
    const kt_robot_options *o = m->source->options;
    kt_effect *stop = o->stop_stiffness != 0.0 ? add_along(m, l, KT_EFFECT_JOINT_LIMIT) : NULL;
    if (stop == NULL)
        return;
    stop->stiffness = o->stop_stiffness;
    stop->damping = o->stop_damping;
    stop->lower = fmin(lower / l->factor, upper / l->factor);
    stop->upper = fmax(lower / l->factor, upper / l->factor);
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* A ball or free joint: springs and dampers between the joint frame and the body, about (and along) all axes. A spring
 * turns by -stiffness times the Euler vector. */
static void spring_ball(kt_mjcf *m, const kt_mjcf_joint *j) {
    const double damping = kt_mjcf_number(m, j->element, j->tag, "damping", 0.0);
    const double stiffness = kt_mjcf_number(m, j->element, j->tag, "stiffness", 0.0);
    if (kt_mjcf_number(m, j->element, j->tag, "frictionloss", 0.0) != 0.0)
        kt_unknown_count(&m->forces, "frictionloss of a ball or free joint", j->element);
    if (damping == 0.0 && stiffness == 0.0)
        return;
    kt_effect *effect = kt_draft_effect(&m->draft, j->element, KT_EFFECT_BUSHING);
    if (effect == NULL)
        return;
    const kt_joint *joint = &((const kt_body *)m->draft.bodies.items)[j->carrier_index].joint;
    const kt_pose start = kt_mjcf_body_at(m, j->body)->pose;
    effect->between[0].body = ((const kt_body *)m->draft.bodies.items)[j->carrier_index].parent;
    effect->between[0].at = joint->at;
    effect->between[0].rotation = joint->rotation;
    effect->between[1].body = j->carrier;
    if (j->type == KT_MJCF_FREE) { /* from where the body stands */
        effect->between[0].at = start.position;
        effect->between[0].rotation = kt_rotation_of_matrix(start.rotation);
    }
    for (int i = j->type == KT_MJCF_FREE ? 0 : 3; i < 6; i++) {
        effect->stiffnesses[i] = stiffness;
        effect->dampings[i] = damping;
    }
}

static void act_in_joint(kt_mjcf *m, const kt_mjcf_joint *j) {
    if (!kt_mjcf_is_scalar(j)) {
        spring_ball(m, j);
        return;
    }
    const line l = {j->element, j->tag, j->name, 1.0};
    const double angle = j->type == KT_MJCF_HINGE ? kt_mjcf_settings_of(m, j->element)->angle : 1.0;
    add_spring(m, &l, kt_mjcf_number(m, j->element, j->tag, "stiffness", 0.0),
               angle * kt_mjcf_number(m, j->element, j->tag, "springref", 0.0));
    add_damping(m, &l);
    if (j->is_limited)
        add_stop(m, &l, j->lower, j->upper);
}

/* A part of the weight is taken away, at the centre of mass. */
static void float_body(kt_mjcf *m, const kt_mjcf_body *b, kt_vec3 gravity) {
    const double g[3] = {gravity.x, gravity.y, gravity.z};
    kt_effect *effect =
        b->gravcomp != 0.0 && b->mass > 0.0 ? kt_draft_effect(&m->draft, b->element, KT_EFFECT_FORCE) : NULL;
    if (effect == NULL)
        return;
    effect->between[0].body = b->name;
    effect->between[0].at = b->com;
    for (int i = 0; i < 3; i++)
        effect->value[i] = kt_function_constant(-b->gravcomp * b->mass * g[i]);
}

void kt_mjcf_passive(kt_mjcf *m) {
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++)
        act_in_joint(m, kt_mjcf_joint_at(m, i));
    for (int i = 1; i < m->bodies.count && !m->r->out_of_memory; i++)
        float_body(m, kt_mjcf_body_at(m, i), m->gravity);
}

/* ---- fixed tendons ----------------------------------------------------------------------------------------------- */

static void add_term(kt_mjcf *m, const kt_element *e, kt_mjcf_tendon *t) {
    const int joint = kt_mjcf_find(m, e, "joint", KT_MJCF_JOINTS);
    const double coefficient = kt_mjcf_number(m, e, NULL, "coef", 0.0);
    if (joint < 0)
        return;
    const kt_mjcf_joint *j = kt_mjcf_joint_at(m, joint);
    if (!kt_mjcf_is_scalar(j)) {
        (void)kt_mjcf_fault(m, e, "a fixed tendon is made of hinge and slide joints");
        return;
    }
    if (coefficient == 0.0)
        return;
    kt_mjcf_term *term = kt_list_add(m->r, &m->r->scratch, &m->terms, sizeof *term);
    if (term == NULL)
        return;
    *term = (kt_mjcf_term){joint, coefficient};
    t->count++;
    t->length += coefficient * j->ref;
    t->start += coefficient * j->start;
}

/* A body whose position is the tendon's length. */
static void make_length(kt_mjcf *m, kt_mjcf_tendon *t) {
    const char *name = kt_xml_attribute(t->element, "name");
    kt_body *body = kt_draft_body(&m->draft, t->element);
    kt_loop *loop = kt_mjcf_add_loop(m, t->element, KT_LOOP_COUPLING, "tendon");
    kt_term *terms = kt_pool_take(&m->r->keep, (size_t)t->count + 1, sizeof *terms);
    if (body == NULL || loop == NULL || terms == NULL) {
        (void)kt_reader_out_of_memory(m->r);
        return;
    }
    body->name = kt_namer_make(&m->bodies_named, name != NULL && *name != '\0' ? name : "tendon");
    body->joint.type = KT_JOINT_PRISMATIC;
    body->joint.position[0] = t->start;
    body->joint.armature[0] = kt_mjcf_number(m, t->element, "tendon", "armature", 0.0);
    const char *joint = kt_namer_make(&m->joints_named, body->name);
    body->joint.name = strcmp(joint, body->name) != 0 ? joint : NULL;
    terms[0] = (kt_term){joint, 1.0};
    for (int i = 0; i < t->count; i++) {
        const kt_mjcf_term *term = kt_mjcf_term_at(m, t->first + i);
        terms[i + 1] = (kt_term){kt_mjcf_joint_at(m, term->joint)->name, -term->coefficient};
    }
    loop->terms = terms;
    loop->term_count = t->count + 1;
    t->joint = joint;
    t->coefficient = 1.0;
    kt_left_count(&m->tied, t->element);
}

/* The joint that a tendon acts in; false where it has none. */
static bool find_length(kt_mjcf *m, kt_mjcf_tendon *t) {
    if (t->joint == NULL && t->count == 1) {
        const kt_mjcf_term *term = kt_mjcf_term_at(m, t->first);
        t->joint = kt_mjcf_joint_at(m, term->joint)->name;
        t->coefficient = term->coefficient;
    } else if (t->joint == NULL && t->count > 1) {
        make_length(m, t);
    }
    return t->joint != NULL;
}

static void act_in_tendon(kt_mjcf *m, kt_mjcf_tendon *t) {
    double rest[2] = {-1.0, -1.0}, range[2] = {0.0, 0.0};
    const kt_element *e = t->element;
    const double stiffness = kt_mjcf_number(m, e, "tendon", "stiffness", 0.0);
    const bool rubs = kt_mjcf_number(m, e, "tendon", "damping", 0.0) != 0.0 ||
                      kt_mjcf_number(m, e, "tendon", "frictionloss", 0.0) != 0.0;
    const bool is_heavy = kt_mjcf_number(m, e, "tendon", "armature", 0.0) != 0.0;
    const bool is_limited = kt_mjcf_is_limited(m, e, "tendon", "limited", "range") &&
                            kt_mjcf_numbers(m, e, "tendon", "range", 2, 2, range) == 2;
    if (is_limited)
        kt_left_count(&m->limits, e);
    if (stiffness == 0.0 && !rubs && !is_heavy && !(is_limited && m->source->options->stop_stiffness != 0.0))
        return;
    if (is_heavy && t->count == 1)
        make_length(m, t);
    if (!find_length(m, t))
        return;
    const line l = {e, "tendon", t->joint, t->coefficient};
    if (kt_mjcf_numbers(m, e, "tendon", "springlength", 1, 2, rest) == 2 && rest[0] != rest[1])
        kt_unknown_count(&m->forces, "spring with a range of rest lengths", e);
    else
        add_spring(m, &l, stiffness, rest[0] == -1.0 ? t->length : rest[0]);
    add_damping(m, &l);
    if (is_limited)
        add_stop(m, &l, range[0], range[1]);
}

void kt_mjcf_make_tendons(kt_mjcf *m) {
    for (const kt_element *e = kt_mjcf_section(m, "tendon", NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_section(m, "tendon", e)) {
        const int index = m->tendons.count;
        if (strcmp(e->name, "fixed") != 0) {
            kt_unknown_count(&m->forces, "spatial tendon", e);
            continue;
        }
        kt_mjcf_tendon *t = kt_list_add(m->r, &m->r->scratch, &m->tendons, sizeof *t);
        if (t == NULL)
            return;
        *t = (kt_mjcf_tendon){.element = e, .first = m->terms.count};
        kt_mjcf_add_name(m, KT_MJCF_TENDONS, e, index);
        for (const kt_element *c = kt_xml_child(e, "joint"); c != NULL; c = kt_xml_next(c, "joint"))
            add_term(m, c, t);
        act_in_tendon(m, t);
    }
}

/* ---- actuators --------------------------------------------------------------------------------------------------- */

typedef enum gain_type { FIXED, AFFINE, MUSCLE, USER } gain_type;
typedef enum bias_type { NO_BIAS, AFFINE_BIAS, MUSCLE_BIAS, USER_BIAS } bias_type;

/* What an actuator has, its defaults included: MuJoCo keeps one set of numbers for all kinds. */
typedef struct actuator {
    gain_type gain_type;
    bias_type bias_type;
    bool is_dynamic, is_strange; /* has an activation; is of a kind that is left out */
    double gain[3], bias[3];
    double inherit; /* the range of control is this part of what it acts along; 0: it is one of its own */
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

/* The shortcuts set gain and bias; what they read begins as what the defaults have set. */
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

/* What an actuator acts along; false where that is left out, which is counted. */
static bool find_line(kt_mjcf *m, const kt_element *e, line *l) {
    const char *attribute = kt_xml_attribute(e, "joint") != NULL           ? "joint"
                            : kt_xml_attribute(e, "jointinparent") != NULL ? "jointinparent"
                                                                           : "tendon";
    *l = (line){.element = e, .factor = 1.0};
    if (kt_xml_attribute(e, attribute) == NULL) {
        kt_unknown_count(&m->forces, "actuator of a site, body or crank", e);
        return false;
    }
    if (strcmp(attribute, "tendon") == 0) {
        const int index = kt_names_find(&m->names, KT_MJCF_TENDONS, kt_xml_attribute(e, "tendon"));
        if (index < 0 || !find_length(m, kt_mjcf_tendon_at(m, index))) {
            kt_unknown_count(&m->forces, "actuator of a tendon that is left out", e);
            return false;
        }
        l->joint = kt_mjcf_tendon_at(m, index)->joint;
        l->factor = kt_mjcf_tendon_at(m, index)->coefficient;
        return true;
    }
    const int joint = kt_mjcf_find(m, e, attribute, KT_MJCF_JOINTS);
    if (joint >= 0 && !kt_mjcf_is_scalar(kt_mjcf_joint_at(m, joint)))
        kt_unknown_count(&m->forces, "actuator of a ball or free joint", e);
    if (joint < 0 || !kt_mjcf_is_scalar(kt_mjcf_joint_at(m, joint)))
        return false;
    l->joint = kt_mjcf_joint_at(m, joint)->name;
    return true;
}

/* Whether it pulls its length to the control: gain u - gain L. */
static bool is_position(const actuator *a) {
    return a->gain_type == FIXED && a->bias_type == AFFINE_BIAS && a->gain[0] == -a->bias[1];
}

/* Whether a body is another one, or is carried by it. */
static bool is_carried(const kt_mjcf *m, int body, int by) {
    while (body > by)
        body = kt_mjcf_body_at(m, body)->parent;
    return body == by;
}

/* M_jj of a scalar joint at the reference position: its armature and, of all that it carries,
 *     slide: sum m_i;    hinge: sum a' I_i a + m_i |a x (c_i - p)|^2, about the axis a through p. */
static double carried_inertia(kt_mjcf *m, const kt_mjcf_joint *j) {
    const kt_pose at = kt_mjcf_body_at(m, j->body)->world;
    const kt_vec3 a = kt_mat3_apply(at.rotation, kt_vec3_normalize(j->axis)), p = kt_pose_apply(at, j->at);
    double sum = kt_mjcf_number(m, j->element, j->tag, "armature", 0.0);
    for (int i = j->body; i < m->bodies.count; i++) {
        const kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        if (!is_carried(m, i, j->body))
            continue;
        const kt_vec3 arm = kt_vec3_cross(a, kt_vec3_sub(kt_pose_apply(b->world, b->com), p));
        const kt_vec3 inner = kt_mat3_apply_transposed(b->world.rotation, a);
        sum += j->type == KT_MJCF_SLIDE
                   ? b->mass
                   : kt_vec3_dot(inner, kt_sym3_apply(b->inertia, inner)) + b->mass * kt_vec3_dot(arm, arm);
    }
    return sum;
}

/* The inertia along what an actuator acts along, g L: each joint's, with dL/dq = c, as 1 / (g c)^2 of its own. */
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

/* A damping above zero of an actuator of positions is a ratio to the critical one, 2 sqrt(stiffness inertia). */
static void resolve_damping(kt_mjcf *m, const kt_element *e, actuator *a, double gear) {
    if (is_position(a) && a->bias[2] > 0.0 && gear != 0.0)
        a->bias[2] *= -2.0 * sqrt(fmax(0.0, -a->bias[1] * inertia_along(m, e, gear)));
}

/* The limits of what an actuator acts along; false where it has none. */
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

/* The control within its range, or within a part of that of what it acts along. */
static double limit_control(kt_mjcf *m, const kt_element *e, const actuator *a, double control) {
    double range[2];
    bool is_limited = read_limit(m, e, "ctrllimited", "ctrlrange", range);
    if (!is_limited && a->inherit > 0.0 && is_position(a) && read_limits_along(m, e, range)) {
        const double middle = 0.5 * (range[0] + range[1]), half = 0.5 * a->inherit * (range[1] - range[0]);
        range[0] = middle - half;
        range[1] = middle + half;
        is_limited = true;
    }
    return is_limited ? fmin(fmax(control, range[0]), range[1]) : control;
}

/* c0 + c1 L + c2 L', the force for a constant control. */
static void force_of(const actuator *a, double control, double c[3]) {
    for (int i = 0; i < 3; i++)
        c[i] = (i == 0 || a->gain_type == AFFINE ? a->gain[i] * control : 0.0) +
               (a->bias_type == AFFINE_BIAS ? a->bias[i] : 0.0);
}

static void add_servo(kt_mjcf *m, const line *l, const double c[3], double gear, const double force[2],
                      bool is_limited) {
    const double stiffness = -gear * gear * c[1], damping = -gear * gear * c[2], push = gear * c[0];
    kt_effect *servo = add_along(m, l, KT_EFFECT_SERVO);
    double *line_of_time = kt_pool_take(&m->r->keep, 2, sizeof *line_of_time);
    if (servo == NULL || line_of_time == NULL) {
        (void)kt_reader_out_of_memory(m->r);
        return;
    }
    servo->stiffness = stiffness;
    servo->damping = damping;
    line_of_time[1] =
        stiffness > 0.0 ? 0.0 : push / damping; /* without stiffness the target's rate is that of the control */
    servo->target = stiffness > 0.0 || push == 0.0 ? kt_function_constant(stiffness > 0.0 ? push / stiffness : 0.0)
                                                   : kt_function_polynomial(line_of_time, 2);
    if (is_limited && force[0] == -force[1] && force[1] > 0.0)
        servo->limit = fabs(gear) * force[1];
    else if (is_limited)
        kt_unknown_count(&m->forces, "limit of a servo's force that is not symmetric", l->element);
    kt_left_count(&m->servos, l->element);
}

static void add_motor(kt_mjcf *m, const line *l, double push, double gear, const double force[2], bool is_limited) {
    kt_effect *motor = add_along(m, l, KT_EFFECT_MOTOR);
    if (motor == NULL)
        return;
    motor->torque = kt_function_constant(gear * (is_limited ? fmin(fmax(push, force[0]), force[1]) : push));
    kt_left_count(&m->motors, l->element);
}

static void name_effect(kt_mjcf *m, const kt_element *e) {
    const char *name = kt_xml_attribute(e, "name");
    kt_effect *effects = m->draft.effects.items;
    if (name != NULL && *name != '\0')
        effects[m->draft.effects.count - 1].name = kt_namer_make(&m->effects_named, name);
}

static void act(kt_mjcf *m, const kt_element *e, double control) {
    actuator a = {.gain = {1.0}};
    double force[2] = {0.0, 0.0}, gear = 1.0, c[3];
    line l;
    apply_classes(m, e->number, &a);
    apply_actuator(m, e, &a);
    if (a.is_strange || a.is_dynamic || a.gain_type > AFFINE || a.bias_type > AFFINE_BIAS) {
        kt_unknown_count(&m->forces, a.is_strange ? e->name : "actuator with an activation, or of a user's kind", e);
        return;
    }
    if (!find_line(m, e, &l))
        return;
    const char *tag = common_tag(m, e, "gear");
    double gears[6];
    if (tag != NULL && kt_mjcf_numbers(m, e, tag, "gear", 1, 6, gears) > 0)
        gear = gears[0];
    const bool is_limited = read_limit(m, e, "forcelimited", "forcerange", force);
    resolve_damping(m, e, &a, gear);
    force_of(&a, limit_control(m, e, &a, control), c);
    gear *= l.factor;
    if (gear == 0.0)
        return;
    if (c[1] > 0.0 || c[2] > 0.0) {
        kt_unknown_count(&m->forces, "actuator of negative stiffness or damping", e);
        return;
    }
    const int before = m->draft.effects.count;
    if (c[1] == 0.0 && c[2] == 0.0)
        add_motor(m, &l, c[0], gear, force, is_limited);
    else
        add_servo(m, &l, c, gear, force, is_limited);
    if (m->draft.effects.count > before)
        name_effect(m, e);
}

void kt_mjcf_actuators(kt_mjcf *m) {
    int index = 0;
    for (const kt_element *e = kt_mjcf_section(m, "actuator", NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_section(m, "actuator", e), index++)
        act(m, e, m->ctrl != NULL ? m->ctrl[index] : 0.0);
}
