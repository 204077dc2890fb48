/* Attributes of MJCF: default classes, numbers, words, orientations, names; and the elements of a body. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/file.h"
#include "robot/mjcf.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

/* ---- faults ------------------------------------------------------------------------------------------------------ */

const kt_element *kt_mjcf_body_around(const kt_element *e) {
    do
        e = e->parent;
    while (e != NULL && strcmp(e->name, "body") != 0);
    return e;
}

/* "body 'thigh': joint 'knee': ": the nearest body around an element, and the element. */
static void add_element_context(kt_phrase *phrase, const kt_element *e) {
    const kt_element *path[] = {kt_mjcf_body_around(e), e};
    for (int i = 0; i < 2; i++) {
        if (path[i] == NULL || path[i]->parent == NULL)
            continue;
        const char *name = kt_xml_attribute(path[i], "name");
        kt_phrase_add(phrase, "%s%s%s: ", path[i]->name, name != NULL ? " " : "",
                      name != NULL ? kt_name_quote(name).text : "");
    }
}

bool kt_mjcf_fault(kt_mjcf *m, const kt_element *e, const char *format, ...) {
    kt_phrase where = {.length = 0};
    va_list arguments;
    add_element_context(&where, e);
    va_start(arguments, format);
    const bool result = kt_xml_fault_in(m->r, e, where.text, format, arguments);
    va_end(arguments);
    return result;
}

/* ---- default classes --------------------------------------------------------------------------------------------- */

enum { NONE = -2 };

static kt_mjcf_class *class_at(const kt_mjcf *m, int i) { return (kt_mjcf_class *)m->classes.items + i; }

/* Adds a <default> of the root (is_main), or of a class, and the classes in it. */
static void add_class(kt_mjcf *m, const kt_element *e, bool is_main, int outer) {
    const char *name = kt_xml_attribute(e, "class");
    const int index = m->classes.count, document = e->document;
    kt_mjcf_class *to = kt_list_add(m->r, &m->r->scratch, &m->classes, sizeof *to);
    if (to == NULL)
        return;
    *to = (kt_mjcf_class){.name = name, .element = e, .outer = outer};
    if (is_main)
        kt_mjcf_document_at(m, document)->main = index;
    else if (name == NULL)
        (void)kt_mjcf_fault(m, e, "the attribute 'class' is missing");
    for (const kt_element *child = kt_xml_child(e, "default"); child != NULL; child = kt_xml_next(child, "default"))
        add_class(m, child, false, index);
}

/* The number of a class that an attribute names; without such a name, the number of `around`. */
static int class_of(kt_mjcf *m, const kt_element *e, const char *attribute, int around) {
    const char *name = kt_xml_attribute(e, attribute);
    if (name == NULL)
        return around;
    const int found = kt_names_find(&m->names, KT_MJCF_CLASSES + e->document, name);
    if (found >= 0)
        return found;
    if (strcmp(name, "main") == 0)
        return kt_mjcf_document_at(m, e->document)->main;
    (void)kt_mjcf_fault(m, e, "%s %s does not exist", attribute, kt_name_quote(name).text);
    return around;
}

/* Gives elements their classes: their own, else the childclass of the elements around them in their document. A
 * <default> is a class at a document's root alone. */
static void number_elements(kt_mjcf *m, kt_element *within, int around) {
    for (kt_element *e = within->first; e != NULL; e = e->next) {
        if (within->parent == NULL && strcmp(e->name, "default") == 0)
            continue;
        const int outer = e->document == within->document ? around : kt_mjcf_document_at(m, e->document)->main;
        e->number = class_of(m, e, "class", outer);
        number_elements(m, e, class_of(m, e, "childclass", outer));
    }
}

/* The classes of a document. The outermost are one class, written in any number of places. A class within one of them
 * has the values of this place and of those before it; places behind it do not change the class, as in MuJoCo. */
static void add_classes(kt_mjcf *m, int document) {
    const int first = m->classes.count;
    const kt_element *root = kt_mjcf_document_at(m, document)->root;
    for (const kt_element *e = kt_xml_child(root, "default"); e != NULL; e = kt_xml_next(e, "default"))
        add_class(m, e, true, kt_mjcf_document_at(m, document)->main);
    const int last = kt_mjcf_document_at(m, document)->main;
    for (int i = first; i < m->classes.count; i++) {
        kt_mjcf_class *c = class_at(m, i);
        const bool is_main = c->element->parent == root;
        if (c->name == NULL)
            continue;
        const int other = kt_names_add(&m->names, KT_MJCF_CLASSES + document, c->name, is_main ? last : i);
        if (other >= 0 && !is_main)
            (void)kt_mjcf_fault(m, c->element, "class %s stands in line %u, too", kt_name_quote(c->name).text,
                                (unsigned)class_at(m, other)->element->line);
    }
}

void kt_mjcf_classes(kt_mjcf *m) {
    for (int i = 0; i < m->documents.count; i++)
        add_classes(m, i);
    for (int i = 0; i < m->documents.count && !m->r->out_of_memory; i++)
        number_elements(m, kt_mjcf_document_at(m, i)->root, kt_mjcf_document_at(m, i)->main);
}

const kt_element *kt_mjcf_class_element(const kt_mjcf *m, int *number) {
    if (*number < 0)
        return NULL;
    const kt_mjcf_class *c = class_at(m, *number);
    *number = c->outer;
    return c->element;
}

/* The attribute of a <default> that is one of a tag, or of several words. */
static const char *text_of_default(const kt_element *d, const char *tag, const char *name) {
    const bool is_meant = *tag == ' ' ? kt_words_have(tag, d->name) : strcmp(d->name, tag) == 0;
    return is_meant ? kt_xml_attribute(d, name) : NULL;
}

static void replace_text(const char *text, int index, const char **value, int *which) {
    if (text != NULL) {
        *value = text;
        *which = index;
    }
}

/* The text of one of several attributes: the text of the element, else of the innermost class with any of these
 * attributes. Among several at one place, the last counts. */
static const char *nearest_text(const kt_mjcf *m, const kt_element *e, const char *tag, const char *const *names,
                                int count, int *which) {
    const char *value = NULL;
    int class = e->number;
    for (int i = 0; i < count; i++)
        replace_text(kt_xml_attribute(e, names[i]), i, &value, which);
    while (value == NULL && tag != NULL) {
        const kt_element *defaults = kt_mjcf_class_element(m, &class);
        if (defaults == NULL)
            break;
        for (const kt_element *d = defaults->first; d != NULL; d = d->next)
            for (int i = 0; i < count; i++)
                replace_text(text_of_default(d, tag, names[i]), i, &value, which);
    }
    return value;
}

const char *kt_mjcf_text(const kt_mjcf *m, const kt_element *e, const char *tag, const char *name) {
    int which;
    return nearest_text(m, e, tag, &name, 1, &which);
}

/* ---- numbers and words ------------------------------------------------------------------------------------------- */

/* Reads the numbers of the classes, from the outermost class inwards. A class with fewer numbers leaves the remaining
 * ones unchanged. */
static void read_numbers_of_classes(const kt_mjcf *m, int class, const char *tag, const char *name, int room,
                                    double *values) {
    const kt_element *defaults = kt_mjcf_class_element(m, &class);
    if (defaults == NULL)
        return;
    read_numbers_of_classes(m, class, tag, name, room, values);
    for (const kt_element *d = defaults->first; d != NULL; d = d->next) {
        const char *text = text_of_default(d, tag, name);
        if (text != NULL)
            (void)kt_parse_numbers(text, room, values);
    }
}

/* Whether an attribute has bounds, such as `range` or `forcerange`. The weights of groups are none. */
static bool is_bounds(const char *name) {
    const size_t length = strlen(name);
    return length >= 5 && strcmp(name + length - 5, "range") == 0 && strcmp(name, "inertiagrouprange") != 0;
}

int kt_mjcf_numbers(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, int least, int most,
                    double *values) {
    double read[16];
    const char *text = kt_mjcf_text(m, e, tag, name);
    const int room = most < 16 ? most : 16;
    if (text == NULL)
        return 0;
    const int count = is_bounds(name) ? kt_parse_bounds(text, room, read) : kt_parse_numbers(text, room, read);
    if (count < least) {
        if (least == most)
            (void)kt_mjcf_fault(m, e, "%s: expected %d number%s, found '%.60s'", name, least, least > 1 ? "s" : "",
                                text);
        else
            (void)kt_mjcf_fault(m, e, "%s: expected %d to %d numbers, found '%.60s'", name, least, most, text);
        return 0;
    }
    if (is_bounds(name) && count == 2 && (read[0] == (double)INFINITY || read[1] == -(double)INFINITY))
        (void)kt_mjcf_fault(m, e, "%s: from %g to %g there is no number; exchange the signs", name, read[0], read[1]);
    if (least < most && tag != NULL)
        read_numbers_of_classes(m, e->number, tag, name, room, values);
    memcpy(values, read, (size_t)count * sizeof *values);
    return count;
}

double kt_mjcf_number(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, double standard) {
    (void)kt_mjcf_numbers(m, e, tag, name, 1, 1, &standard);
    return standard;
}

kt_vec3 kt_mjcf_vector(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, kt_vec3 standard) {
    double v[3] = {standard.x, standard.y, standard.z};
    (void)kt_mjcf_numbers(m, e, tag, name, 3, 3, v);
    return kt_vec3_make(v[0], v[1], v[2]);
}

int kt_mjcf_choice(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, const char *const *words,
                   int standard) {
    const char *text = kt_mjcf_text(m, e, tag, name);
    kt_phrase all = {.length = 0};
    if (text == NULL)
        return standard;
    for (int i = 0; words[i] != NULL; i++) {
        if (strcmp(words[i], text) == 0)
            return i;
        kt_phrase_add(&all, "%s%s", i > 0 ? ", " : "", words[i]);
    }
    (void)kt_mjcf_fault(m, e, "%s: there is no '%.40s'; it is one of %s", name, text, all.text);
    return standard;
}

kt_mjcf_motion kt_mjcf_motion_of(kt_mjcf *m, const kt_element *joint) {
    static const char *const words[] = {"free", "ball", "slide", "hinge", NULL};
    if (strcmp(joint->name, "freejoint") == 0)
        return KT_MJCF_FREE;
    return (kt_mjcf_motion)kt_mjcf_choice(m, joint, "joint", "type", words, KT_MJCF_HINGE);
}

bool kt_mjcf_flag(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, bool standard) {
    static const char *const words[] = {"false", "true", NULL};
    return kt_mjcf_choice(m, e, tag, name, words, standard) == 1;
}

bool kt_mjcf_is_limited(kt_mjcf *m, const kt_element *e, const char *tag, const char *limited, const char *range) {
    static const char *const words[] = {"false", "true", "auto", NULL};
    const int choice = kt_mjcf_choice(m, e, tag, limited, words, 2);
    const char *text = kt_mjcf_text(m, e, tag, range);
    double bounds[2];
    if (text != NULL && kt_parse_bounds(text, 2, bounds) == 2 && isinf(bounds[0]) && isinf(bounds[1]) &&
        bounds[0] < bounds[1])
        return false; /* from -inf to inf */
    return choice == 1 || (choice == 2 && kt_mjcf_settings_of(m, e)->autolimits && text != NULL);
}

/* ---- orientations ------------------------------------------------------------------------------------------------ */

static bool is_zero(kt_vec3 v) { return !(kt_vec3_norm_wide(v) > 0.0); }

static kt_mat3 of_columns(kt_vec3 x, kt_vec3 y, kt_vec3 z) {
    kt_mat3 r;
    r.x = x;
    r.y = y;
    r.z = z;
    return r;
}

/* x along the first, y in the plane of both. */
static kt_mat3 from_xyaxes(kt_mjcf *m, const kt_element *e, const double v[6]) {
    const kt_vec3 a = kt_vec3_make(v[0], v[1], v[2]), b = kt_vec3_make(v[3], v[4], v[5]);
    const kt_vec3 x = is_zero(a) ? a : kt_vec3_normalize(a);
    const kt_vec3 across = kt_vec3_sub(b, kt_vec3_scale(kt_vec3_dot(x, b), x));
    if (is_zero(a) || is_zero(across)) {
        (void)kt_mjcf_fault(m, e, "xyaxes: the two axes are zero or parallel");
        return kt_mat3_identity();
    }
    const kt_vec3 y = kt_vec3_normalize(across);
    return of_columns(x, y, kt_vec3_cross(x, y));
}

/* Small letters: about carried axes, on the right; capital ones: about fixed axes, on the left. */
kt_mat3 kt_mjcf_rotation_of_euler(const kt_mjcf_settings *settings, const double angles[3]) {
    kt_mat3 r = kt_mat3_identity();
    for (int i = 0; i < 3; i++) {
        const char c = settings->sequence[i];
        const bool is_fixed = c >= 'X' && c <= 'Z';
        const kt_mat3 one = kt_mat3_about(is_fixed ? c - 'X' : c - 'x', settings->angle * angles[i]);
        r = is_fixed ? kt_mat3_multiply(one, r) : kt_mat3_multiply(r, one);
    }
    return r;
}

static kt_mat3 from_axisangle(kt_mjcf *m, const kt_element *e, const double v[4]) {
    const kt_vec3 axis = kt_vec3_make(v[0], v[1], v[2]);
    if (!is_zero(axis))
        return kt_mat3_from_euler_vector(
            kt_vec3_scale(kt_mjcf_settings_of(m, e)->angle * v[3], kt_vec3_normalize(axis)));
    (void)kt_mjcf_fault(m, e, "axisangle: the axis is zero");
    return kt_mat3_identity();
}

static kt_mat3 from_zaxis(kt_mjcf *m, const kt_element *e, const double v[3]) {
    const kt_vec3 axis = kt_vec3_make(v[0], v[1], v[2]);
    if (!is_zero(axis))
        return kt_mat3_z_to(kt_vec3_normalize(axis));
    (void)kt_mjcf_fault(m, e, "zaxis: the axis is zero");
    return kt_mat3_identity();
}

/* The innermost attribute counts, but `quat` counts only if no other attribute gives an orientation. */
static kt_mat3 orientation(kt_mjcf *m, const kt_element *e, const char *tag) {
    static const char *const kinds[] = {"axisangle", "xyaxes", "zaxis", "euler"};
    static const int sizes[] = {4, 6, 3, 3};
    double v[6];
    int kind = -1;
    kt_mat3 r = kt_mat3_identity();
    if (kt_mjcf_numbers(m, e, tag, "quat", 4, 4, v) == 4) {
        const kt_quat q = kt_quat_make(v[0], v[1], v[2], v[3]);
        if (kt_quat_norm_squared(q) > 0.0 && isfinite(kt_quat_norm_squared(q)))
            r = kt_mat3_from_quat(kt_quat_normalize(q));
        else
            (void)kt_mjcf_fault(m, e, "quat: the norm is zero or too large");
    }
    if (nearest_text(m, e, tag, kinds, 4, &kind) == NULL ||
        kt_mjcf_numbers(m, e, tag, kinds[kind], sizes[kind], sizes[kind], v) == 0)
        return r;
    return kind == 0   ? from_axisangle(m, e, v)
           : kind == 1 ? from_xyaxes(m, e, v)
           : kind == 2 ? from_zaxis(m, e, v)
                       : kt_mjcf_rotation_of_euler(kt_mjcf_settings_of(m, e), v);
}

/* The middle of `fromto`, with z along it. */
static bool from_ends(kt_mjcf *m, const kt_element *e, const char *tag, kt_pose *pose) {
    double v[6];
    if (kt_mjcf_numbers(m, e, tag, "fromto", 6, 6, v) != 6)
        return false;
    const kt_vec3 a = kt_vec3_make(v[0], v[1], v[2]), b = kt_vec3_make(v[3], v[4], v[5]);
    if (is_zero(kt_vec3_sub(a, b)))
        return kt_mjcf_fault(m, e, "fromto: the two points coincide");
    pose->position = kt_vec3_scale(0.5, kt_vec3_add(a, b));
    pose->rotation = kt_mat3_z_to(kt_vec3_normalize(kt_vec3_sub(b, a)));
    return true;
}

kt_pose kt_mjcf_pose(kt_mjcf *m, const kt_element *e, const char *tag) {
    kt_pose pose = kt_pose_identity();
    if (tag != NULL && from_ends(m, e, tag, &pose))
        return pose;
    pose.position = kt_mjcf_vector(m, e, tag, "pos", pose.position);
    pose.rotation = orientation(m, e, tag);
    return pose;
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

const char *kt_mjcf_join(kt_mjcf *m, const kt_element *e, const char *first, const char *second) {
    m->joined_bytes += strlen(first) + strlen(second) + 1;
    if (m->joined_bytes > KT_FILE_SIZE_MAX) {
        if (!kt_draft_is_wrong(&m->draft))
            (void)kt_mjcf_fault(m, e, "names with prefixes take more than %d MB", KT_FILE_SIZE_MAX >> 20);
        return NULL;
    }
    return kt_robot_print(m->r, &m->r->scratch, "%s%s", first, second);
}

void kt_mjcf_add_name(kt_mjcf *m, int scope, const kt_element *e, int index) {
    const char *name = kt_element_name(e, NULL);
    if (name != NULL && kt_names_add(&m->names, scope, name, index) >= 0)
        (void)kt_mjcf_fault(m, e, "there is another %s of this name; each needs one of its own", e->name);
}

int kt_mjcf_find(kt_mjcf *m, const kt_element *e, const char *attribute, int scope) {
    const char *name = kt_xml_attribute(e, attribute);
    if (name == NULL) {
        (void)kt_mjcf_fault(m, e, "the attribute '%s' is missing", attribute);
        return -1;
    }
    const int found = kt_names_find(&m->names, scope, name);
    if (found < 0)
        (void)kt_mjcf_fault(m, e, "%s %s does not exist", attribute, kt_name_quote(name).text);
    return found;
}

kt_element *kt_mjcf_section_of_all(const kt_mjcf *m, const char *section, const kt_element *last) {
    if (last != NULL && last->next != NULL)
        return last->next;
    const kt_element *s = last == NULL ? kt_xml_child(m->root, section) : kt_xml_next(last->parent, section);
    while (s != NULL && s->first == NULL)
        s = kt_xml_next(s, section);
    return s != NULL ? s->first : NULL;
}

const kt_element *kt_mjcf_section(const kt_mjcf *m, const char *section, const kt_element *last) {
    do
        last = kt_mjcf_section_of_all(m, section, last);
    while (last != NULL && last->number == KT_MJCF_INCOMPLETE);
    return last;
}

/* ---- what is not known ------------------------------------------------------------------------------------------- */

/* Elements that are read, and common ones that do not concern the motion (appearance, parameters of MuJoCo's solver for
 * contacts). Other elements are left out and reported. */
#define LINE                                                                                                           \
    "joint jointinparent tendon gear ctrlrange ctrllimited forcerange forcelimited group delay site refsite body "     \
    "slidersite cranksite actearly lengthrange"
static const kt_known known[] = {
    {" mujoco ", " model "},
    {" compiler ", " angle eulerseq autolimits settotalmass balanceinertia boundmass boundinertia inertiafromgeom "
                   "inertiagrouprange meshdir assetdir texturedir exactmeshinertia strippath coordinate convexhull "
                   "usethread discardvisual fusestatic alignfree fitaabb "},
    {" default ", " class "},
    {" worldbody ", " childclass "},
    {" body ", " name childclass pos quat axisangle xyaxes zaxis euler mocap gravcomp user "},
    {" frame ", " name childclass pos quat axisangle xyaxes zaxis euler "},
    {" inertial ", " pos quat axisangle xyaxes zaxis euler mass diaginertia fullinertia "},
    {" joint ", " name class type group pos axis stiffness range limited solreflimit solimplimit solreffriction "
                "solimpfriction margin ref springref armature damping frictionloss user joint1 joint2 polycoef active "
                "solref solimp joint coef actuatorfrcrange actuatorfrclimited "
                "actuatorgravcomp springdamper "},
    {" freejoint ", " name group align "},
    {" geom ", " name class type contype conaffinity condim group priority size material rgba friction mass density "
               "solmix solref solimp margin gap fromto pos quat axisangle xyaxes zaxis euler mesh hfield fitscale "
               "shellinertia user "},
    {" site ", " name class type group material rgba size fromto pos quat axisangle xyaxes zaxis euler user "},
    {" fixed ", " name class group limited range solreflimit solimplimit solreffriction solimpfriction margin "
                "frictionloss springlength stiffness damping armature width material rgba user actuatorfrcrange "
                "actuatorfrclimited "},
    {" tendon ", " name class limited range solreflimit solimplimit solreffriction solimpfriction margin frictionloss "
                 "springlength stiffness damping armature width material rgba active tendon1 tendon2 polycoef solref "
                 "solimp group user actuatorfrcrange actuatorfrclimited "},
    {" connect ", " name class active solref solimp body1 body2 anchor site1 site2 "},
    {" weld ", " name class active solref solimp body1 body2 relpose anchor torquescale site1 site2 "},
    {" equality ", " active solref solimp "},
    {" motor ", " name class " LINE " user "},
    {" position ", " name class " LINE " kp "
                   "kv dampratio inheritrange timeconst user "},
    {" velocity damper ", " name class " LINE " kv "
                          "user "},
    {" general ", " name class " LINE " "
                  "gaintype biastype dyntype gainprm biasprm dynprm actdim actrange actlimited user "},
    {" muscle ", " name class " LINE " timeconst tausmooth range force scale lmin lmax vmax fpmax fvmax user "},
    {" pair ", " class condim friction gap margin solimp solref solreffriction "},
    {" attach ", " model body prefix "},
    {" model ", " name file content_type "},
    {" actuator asset keyframe deformable ", " "},
    {" mesh ", " name class file scale refpos refquat vertex face inertia maxhullvert builtin params "},
    {" option ", " gravity actuatorgroupdisable density viscosity wind timestep cone impratio "},
    {" key ", " name time qpos qvel act ctrl mpos mquat "},
};

/* Sections that concern only looks, memory or measurements are counted as a whole. Spatial tendons and actuators that
 * are not read are reported as forces. Flags are reported with the feature that they turn off. */
static const kt_known_list all_known = {
    known,
    sizeof known / sizeof *known,
    .apart = " visual statistic size custom sensor contact extension material texture skin hfield camera light ",
    .closed = " ",
    .read = " flag flex spatial adhesion cylinder intvelocity pid dcmotor orientation ",
    .harmless =
        " visual statistic size custom sensor contact extension material texture skin hfield camera light lengthrange "
        "integrator jacobian solver iterations tolerance ls_iterations ls_tolerance "
        "noslip_iterations noslip_tolerance ccd_iterations ccd_tolerance mpr_iterations mpr_tolerance sdf_iterations "
        "sdf_initpoints sleep_tolerance o_margin o_solref o_solimp o_friction apirate collision magnetic sleep "
        "simple "
        "saveinertial conflict smoothnormal normal texcoord material content_type "
        "fluidshape fluidcoef surfacevel solreffix solimpfix nsample interp lengthrange cranklength default "
        "octree_maxdepth needsdf ",
    .moving = " flexvert flexstrain plugin armature damping adhesion "};

/* Flexible bodies as mj_saveLastXML writes them. */
static void count_flexes(kt_mjcf *m) {
    for (const kt_element *e = kt_mjcf_section(m, "deformable", NULL); e != NULL;
         e = kt_mjcf_section(m, "deformable", e))
        if (strcmp(e->name, "flex") == 0)
            kt_unknown_count(&m->changes, "a flex of <deformable>, whose elastic forces and edges are left to MuJoCo",
                             e);
}

/* In attached models, counts the elements that are not moved to the model: settings and classes. */
void kt_mjcf_count_strange(kt_mjcf *m) {
    count_flexes(m);
    kt_strange_search(&m->strange, &all_known, m->root);
    for (int i = 1; i < m->documents.count; i++)
        for (const kt_element *e = kt_mjcf_document_at(m, i)->root->first; e != NULL; e = e->next)
            if (strcmp(e->name, "worldbody") != 0)
                kt_strange_search(&m->strange, &all_known, e);
}

/* ---- traversal --------------------------------------------------------------------------------------------------- */

static void each_within(kt_mjcf *m, const kt_element *within, const char *name, int body, kt_pose frame,
                        kt_mjcf_each *each) {
    for (const kt_element *e = within->first; e != NULL && !m->r->out_of_memory; e = e->next)
        if (strcmp(e->name, name) == 0)
            each(m, e, body, frame);
        else if (strcmp(e->name, "frame") == 0)
            each_within(m, e, name, body, kt_pose_compose(frame, kt_mjcf_pose(m, e, NULL)), each);
}

void kt_mjcf_for_each(kt_mjcf *m, const kt_element *within, const char *name, int body, kt_mjcf_each *each) {
    if (body > 0) {
        each_within(m, within, name, body, kt_pose_identity(), each);
        return;
    }
    for (const kt_element *w = kt_xml_child(m->root, "worldbody"); w != NULL; w = kt_xml_next(w, "worldbody"))
        each_within(m, w, name, body, kt_pose_identity(), each);
}
