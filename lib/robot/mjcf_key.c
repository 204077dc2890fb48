/* The start of a model in MJCF: one of its keyframes.
 *
 * The keyframe of an attached model has numbers for all joints and actuators of that model, in its order. The attached
 * ones take their numbers. The others of the whole begin at their reference positions, at rest and without control.
 * Numbers of `act`, `mpos` and `mquat` of an attached model are left out with a warning.
 *
 * In a model with a <replicate>, a keyframe K has numbers for the joints before it and for those in it, once. As in
 * MuJoCo, K then is the start in which all copies are at their reference positions. In the start K with the suffix of a
 * copy, this copy takes the numbers, and no actuator has a control or an activation. Of the bodies that a program
 * moves, those before the <replicate> take their numbers. */
#include "robot/mjcf_copies.h"

#include <math.h>
#include <string.h>

static double *key_numbers(kt_mjcf *m, const kt_element *key, const char *name, int count) {
    const char *text = kt_xml_attribute(key, name);
    if (text == NULL)
        return NULL;
    double *values = kt_reader_take(m->r, &m->r->scratch, (size_t)count + 1, sizeof *values);
    if (values != NULL && kt_parse_numbers(text, count, values) != count) {
        (void)kt_mjcf_fault(m, key, "%s: expected %d numbers, found '%.60s'", name, count, text);
        values = NULL;
    }
    return values;
}

/* ---- bodies that a program moves, and activations ---------------------------------------------------------------- */

static bool is_keyed_mocap(kt_mjcf *m, int body) {
    return kt_mjcf_flag(m, kt_mjcf_body_at(m, body)->element, NULL, "mocap", false);
}

/* Counts the bodies that a program moves. With `once`, only those before the copies; -1: there are some in copies. */
static int count_mocap(kt_mjcf *m, bool once) {
    int count = 0, before = -1;
    for (int i = 1; i < m->bodies.count; i++) {
        const bool is_copy = once && kt_mjcf_copy_of(m, kt_mjcf_body_at(m, i)->element, -1) == 0;
        before = is_copy && before < 0 ? count : before;
        if (is_copy && is_keyed_mocap(m, i))
            return -1;
        count += is_keyed_mocap(m, i);
    }
    return before >= 0 ? before : count;
}

/* Reads the places of the first bodies that a program moves, in the order of the bodies. */
static void read_mocap(kt_mjcf *m, const kt_element *key, int count) {
    m->mocap_keyed = count;
    m->mpos = key_numbers(m, key, "mpos", 3 * count);
    m->mquat = key_numbers(m, key, "mquat", 4 * count);
}

static int count_activations(kt_mjcf *m, const kt_element *actuator) {
    const kt_mjcf_dynamics d = kt_mjcf_actuator_of(m, actuator).dynamics;
    return kt_mjcf_activations_of(&d);
}

/* Counts the activations of the first actuators. */
static int count_first_activations(kt_mjcf *m, int actuators) {
    int count = 0;
    for (const kt_element *e = kt_mjcf_section(m, "actuator", NULL); e != NULL && actuators-- > 0;
         e = kt_mjcf_section(m, "actuator", e))
        count += count_activations(m, e);
    return count;
}

/* Reports an attribute of a keyframe that is left out. */
static void count_unread(kt_mjcf *m, const kt_element *key, const char *attribute, const char *what) {
    if (kt_xml_attribute(key, attribute) != NULL)
        kt_unknown_count(&m->changes, what, key);
}

/* ---- attached models --------------------------------------------------------------------------------------------- */

static double *zeros(kt_mjcf *m, int count) {
    return kt_reader_take(m->r, &m->r->scratch, (size_t)count + 1, sizeof(double));
}

/* The reference positions of all joints, at rest and without control. */
static void begin_at_reference(kt_mjcf *m) {
    m->qpos = zeros(m, m->nq);
    m->qvel = zeros(m, m->nv);
    m->ctrl = zeros(m, m->ctrl_count);
    for (int i = 0; i < m->joints.count && m->qpos != NULL; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        kt_joint at = kt_joint_default();
        if (j->type == KT_MJCF_FREE)
            kt_joint_set_free(&at, kt_mjcf_place_of(m, j->body));
        else
            at.position[0] = kt_mjcf_is_scalar(j) ? j->ref : 1.0; /* of a ball a quaternion */
        memcpy(m->qpos + j->position, at.position, (size_t)kt_mjcf_nq(j->type) * sizeof *m->qpos);
    }
}

/* Copies the numbers of a key (NULL: it has none) to those joints of its document that are attached. The joints have
 * the same order in both. */
static void take_joints(kt_mjcf *m, int document, const double *qpos, const double *qvel) {
    const kt_list *list = &kt_mjcf_document_at(m, document)->joints;
    const kt_element *const *all = list->items;
    for (int i = 0, k = 0, q = 0, v = 0; i < m->joints.count; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        if (!kt_mjcf_is_within(m, j->element->document, document))
            continue;
        for (; k < list->count && all[k] != j->element; k++) {
            q += kt_mjcf_nq(kt_mjcf_motion_of(m, all[k]));
            v += kt_mjcf_nv(kt_mjcf_motion_of(m, all[k]));
        }
        if (k == list->count)
            return;
        if (qpos != NULL)
            memcpy(m->qpos + j->position, qpos + q, (size_t)kt_mjcf_nq(j->type) * sizeof *qpos);
        if (qvel != NULL)
            memcpy(m->qvel + j->velocity, qvel + v, (size_t)kt_mjcf_nv(j->type) * sizeof *qvel);
    }
}

/* Controls of those actuators that are attached; without `from`, only counts those of the document. */
static int take_controls(kt_mjcf *m, int document, const double *from) {
    int count = 0, index = 0;
    for (const kt_element *e = kt_mjcf_section_of_all(m, "actuator", NULL); e != NULL;
         e = kt_mjcf_section_of_all(m, "actuator", e)) {
        const bool is_attached = e->number != KT_MJCF_INCOMPLETE;
        const bool is_own = kt_mjcf_is_within(m, e->document, document);
        if (from != NULL && is_own && is_attached)
            m->ctrl[index] = from[count];
        count += is_own;
        index += is_attached;
    }
    return count;
}

static void start_attached(kt_mjcf *m, const kt_element *key) {
    const kt_list *list = &kt_mjcf_document_at(m, key->document)->joints;
    int nq = 0, nv = 0;
    for (int i = 0; i < list->count; i++) {
        const kt_element *joint = ((const kt_element *const *)list->items)[i];
        if (joint->number == KT_MJCF_ORPHAN) {
            (void)kt_mjcf_fault(m, key, "its model is attached in a <replicate>; which copy it is of is not known");
            return;
        }
        const kt_mjcf_motion type = kt_mjcf_motion_of(m, joint);
        nq += kt_mjcf_nq(type);
        nv += kt_mjcf_nv(type);
    }
    const double *qpos = key_numbers(m, key, "qpos", nq), *qvel = key_numbers(m, key, "qvel", nv);
    const double *ctrl = key_numbers(m, key, "ctrl", take_controls(m, key->document, NULL));
    begin_at_reference(m);
    if (m->r->out_of_memory)
        return;
    count_unread(m, key, "act", "act of the keyframe of an attached model, whose activations begin at zero");
    count_unread(m, key, "mpos", "mpos of the keyframe of an attached model, whose bodies stay in their places");
    count_unread(m, key, "mquat", "mquat of the keyframe of an attached model, whose bodies keep their orientations");
    take_joints(m, key->document, qpos, qvel);
    if (ctrl != NULL)
        (void)take_controls(m, key->document, ctrl);
}

/* ---- models with copies ------------------------------------------------------------------------------------------ */

/* The joints that a keyframe of a model with copies has numbers for are the first ones. Returns how many, and their
 * numbers; -1: all. */
static int count_keyed_joints(const kt_mjcf *m, int *nq, int *nv) {
    int count = 0, last = -1;
    for (int i = 0; i < m->joints.count && m->replicate_count == 1; i++)
        if (kt_mjcf_copy_of(m, kt_mjcf_joint_at(m, i)->element, -1) == 0)
            last = i;
    *nq = *nv = 0;
    if (last < 0)
        return -1;
    for (; count <= last; count++) {
        *nq += kt_mjcf_nq(kt_mjcf_joint_at(m, count)->type);
        *nv += kt_mjcf_nv(kt_mjcf_joint_at(m, count)->type);
    }
    return count;
}

static int count_key_numbers(const char *text) {
    static const char space[] = " \t\r\n";
    int count = 0;
    for (text += strspn(text, space); *text != '\0'; text += strspn(text, space), count++)
        text += strcspn(text, space);
    return count;
}

/* Whether an attribute of a keyframe has `count` numbers (below zero: any), less than `all` that the model has. */
static bool has_fewer_numbers(const kt_element *key, const char *attribute, int count, int all) {
    const char *text = kt_xml_attribute(key, attribute);
    const int numbers = text != NULL ? count_key_numbers(text) : all;
    return numbers < all && (count < 0 || numbers == count);
}

/* The number of actuators outside of the copies, which come first. */
static int count_outer_actuators(const kt_mjcf *m) {
    const int outer = m->ctrl_count - m->copies.count * m->moved_actuators.count;
    return outer > 0 ? outer : 0; /* copies that are left out are no actuators */
}

/* Whether a keyframe has numbers for one copy alone. */
static bool is_keyed_once(kt_mjcf *m, const kt_element *key) {
    int nq, nv;
    if (count_keyed_joints(m, &nq, &nv) < 0)
        return false;
    const int actuators = count_outer_actuators(m) + m->moved_actuators.count;
    const int mocap = count_mocap(m, true), all = count_mocap(m, false);
    return has_fewer_numbers(key, "qpos", nq, m->nq) || has_fewer_numbers(key, "qvel", nv, m->nv) ||
           has_fewer_numbers(key, "ctrl", actuators, m->ctrl_count) ||
           has_fewer_numbers(key, "act", count_first_activations(m, actuators),
                             count_first_activations(m, m->ctrl_count)) ||
           has_fewer_numbers(key, "mpos", 3 * mocap, 3 * all) || has_fewer_numbers(key, "mquat", 4 * mocap, 4 * all);
}

/* Finds the actuator with an index; NULL: there is none. */
static const kt_element *find_actuator(const kt_mjcf *m, int index) {
    const kt_element *e = kt_mjcf_section(m, "actuator", NULL);
    while (e != NULL && index-- > 0)
        e = kt_mjcf_section(m, "actuator", e);
    return e;
}

/* Takes the controls and activations of the actuators outside of the copies. In the file, those of copies are between
 * them. */
static void take_outer_controls(kt_mjcf *m, const kt_element *key) {
    const kt_list *moved = &m->moved_actuators;
    const int outer = count_outer_actuators(m), count = outer + moved->count;
    const double *ctrl = key_numbers(m, key, "ctrl", count);
    const int activations = count_first_activations(m, count);
    const double *act = key_numbers(m, key, "act", activations);
    const kt_element *next = find_actuator(m, 0), *copied = find_actuator(m, outer);
    double *values = zeros(m, count_first_activations(m, m->ctrl_count));
    m->act = values;
    for (int place = 0, i = 0, k = 0, from = 0, to = 0; place < count && values != NULL; place++) {
        const bool is_moved = k < moved->count && ((const int *)moved->items)[k] == place;
        const kt_element **e = is_moved ? &copied : &next;
        const int wanted = *e != NULL ? count_activations(m, *e) : 0;
        const int width = wanted < activations - from ? wanted : activations - from;
        if (!is_moved && act != NULL)
            memcpy(values + to, act + from, (size_t)width * sizeof *values);
        if (!is_moved && ctrl != NULL && i < outer)
            m->ctrl[i] = ctrl[place];
        to += is_moved ? 0 : width;
        from += width;
        i += !is_moved;
        k += is_moved;
        *e = *e != NULL ? kt_mjcf_section(m, "actuator", *e) : NULL;
    }
}

/* Places the moved bodies before the copies. Numbers for bodies in copies are left out with a warning. */
static void start_mocap_of_copies(kt_mjcf *m, const kt_element *key) {
    const int count = count_mocap(m, true);
    if (count >= 0) {
        read_mocap(m, key, count);
        return;
    }
    count_unread(m, key, "mpos", "mpos of a keyframe with bodies in copies that a program moves, which stay");
    count_unread(m, key, "mquat", "mquat of a keyframe with bodies in copies that a program moves, which do not turn");
}

/* Sets the start from a keyframe that has numbers for one copy, -1: for none of them. */
static void start_copy(kt_mjcf *m, const kt_element *key, int copy) {
    int nq, nv;
    const int count = count_keyed_joints(m, &nq, &nv);
    const double *qpos = key_numbers(m, key, "qpos", nq), *qvel = key_numbers(m, key, "qvel", nv);
    int from = -1, near = -1; /* the first joint of the first copy; the copy of the last joint */
    begin_at_reference(m);
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        const int of = kt_mjcf_copy_of(m, j->element, near);
        near = of >= 0 ? of : near;
        from = of == 0 && from < 0 ? i : from;
        const int per_copy = from >= 0 ? count - from : 0;
        const int source = of < 0 && i < count ? i : of >= 0 && of == copy ? i - copy * per_copy : -1;
        if (source < 0)
            continue;
        const kt_mjcf_joint *s = kt_mjcf_joint_at(m, source);
        if (qpos != NULL)
            memcpy(m->qpos + j->position, qpos + s->position, (size_t)kt_mjcf_nq(j->type) * sizeof *qpos);
        if (qvel != NULL)
            memcpy(m->qvel + j->velocity, qvel + s->velocity, (size_t)kt_mjcf_nv(j->type) * sizeof *qvel);
    }
    if (copy < 0 && !m->r->out_of_memory)
        take_outer_controls(m, key);
    start_mocap_of_copies(m, key);
}

/* ---- any model --------------------------------------------------------------------------------------------------- */

/* Reports an unknown keyframe with the nearest name, or else with the first names that there are. */
static void reject_key(kt_mjcf *m, const char *wanted) {
    enum { SHOWN = 6 };
    kt_nearest nearest = kt_nearest_make(wanted, NULL);
    kt_phrase names = {.length = 0};
    int count = 0;
    for (const kt_element *e = kt_mjcf_section(m, "keyframe", NULL); e != NULL; e = kt_mjcf_section(m, "keyframe", e)) {
        const char *name = kt_xml_attribute(e, "name");
        (void)kt_nearest_try(&nearest, name);
        if (name != NULL && count++ < SHOWN)
            kt_phrase_add(&names, "%s%.40s", count > 1 ? ", " : "", name);
    }
    const kt_name_text quoted = kt_name_quote(wanted);
    if (nearest.best != NULL)
        (void)kt_mjcf_fault(m, m->root, "there is no keyframe %s; did you mean %s?", quoted.text,
                            kt_name_quote(nearest.best).text);
    else if (count > 0)
        (void)kt_mjcf_fault(m, m->root, "there is no keyframe %s; the names are %s%s", quoted.text, names.text,
                            count > SHOWN ? ", ..." : "");
    else
        (void)kt_mjcf_fault(m, m->root, "there is no keyframe %s; the robot has no keyframe with a name", quoted.text);
}

/* Whether a name is that of a keyframe with the suffix of a copy; sets the copy. */
static bool is_key_of_copy(const kt_mjcf *m, const char *name, const char *wanted, int *copy) {
    const size_t length = strlen(name);
    if (m->replicate_count != 1 || strncmp(wanted, name, length) != 0)
        return false;
    for (*copy = m->copies.count - 1; *copy >= 0; --*copy)
        if (strcmp(((const kt_mjcf_copy *)m->copies.items)[*copy].suffix, wanted + length) == 0)
            return true;
    return false;
}

/* Finds the keyframe, and the copy that it is of; -1: none. */
static const kt_element *find_key(kt_mjcf *m, const char *wanted, int *copy) {
    const kt_element *found = NULL, *of_copy = NULL;
    for (const kt_element *e = kt_mjcf_section(m, "keyframe", NULL); e != NULL; e = kt_mjcf_section(m, "keyframe", e)) {
        const char *name = kt_xml_attribute(e, "name");
        int of;
        if (wanted == NULL)
            kt_left_count(&m->keys, e);
        if (wanted == NULL || name == NULL)
            continue;
        found = found == NULL && strcmp(name, wanted) == 0 ? e : found;
        if (of_copy == NULL && e->document == 0 && is_key_of_copy(m, name, wanted, &of)) {
            of_copy = e;
            *copy = of;
        }
    }
    if (found != NULL)
        *copy = -1;
    found = found != NULL ? found : of_copy;
    if (wanted != NULL && found == NULL)
        reject_key(m, wanted);
    return found;
}

/* A quaternion of any length is a rotation, and one of zeros is none. */
static const double *normalize_turn(double *turn) {
    double size = 0.0, sum = 0.0;
    for (int i = 0; i < 4; i++)
        size = fmax(size, fabs(turn[i]));
    for (int i = 0; i < 4 && size > 0.0; i++) {
        turn[i] /= size;
        sum += turn[i] * turn[i];
    }
    if (!(size > 0.0))
        memcpy(turn, (const double[]){1.0, 0.0, 0.0, 0.0}, 4 * sizeof *turn);
    for (int i = 0; i < 4 && size > 0.0; i++)
        turn[i] /= sqrt(sum);
    return turn;
}

void kt_mjcf_start(kt_mjcf *m) {
    int copy = -1;
    const kt_element *key = find_key(m, m->source->options->keyframe, &copy);
    if (key == NULL)
        return;
    for (const kt_element *e = kt_mjcf_section(m, "actuator", NULL); e != NULL; e = kt_mjcf_section(m, "actuator", e))
        m->ctrl_count++;
    if (key->document > 0) {
        start_attached(m, key);
    } else if (copy >= 0 || is_keyed_once(m, key)) {
        start_copy(m, key, copy);
    } else {
        m->qpos = key_numbers(m, key, "qpos", m->nq);
        m->qvel = key_numbers(m, key, "qvel", m->nv);
        m->ctrl = key_numbers(m, key, "ctrl", m->ctrl_count);
        m->act = key_numbers(m, key, "act", count_first_activations(m, m->ctrl_count));
        read_mocap(m, key, count_mocap(m, false));
    }
    for (int i = 0; i < m->joints.count && m->qpos != NULL; i++) {
        kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        if (kt_mjcf_is_scalar(j))
            j->start = m->qpos[j->position];
        else
            (void)normalize_turn(m->qpos + j->position + (j->type == KT_MJCF_FREE ? 3 : 0));
    }
}

void kt_mjcf_keep_start(kt_mjcf *m) {
    kt_body *bodies = m->draft.bodies.items;
    for (int i = 0; i < m->joints.count && m->source->options->keyframe != NULL; i++)
        bodies[kt_mjcf_joint_at(m, i)->carrier_index].joint.given |=
            KT_GIVEN_POSITION | KT_GIVEN_ORIENTATION | KT_GIVEN_VELOCITY | KT_GIVEN_ANGULAR;
}

kt_pose kt_mjcf_mocap_pose(kt_mjcf *m, const kt_mjcf_body *b) {
    kt_pose pose = b->pose;
    if ((m->mpos == NULL && m->mquat == NULL) || !kt_mjcf_flag(m, b->element, NULL, "mocap", false))
        return pose;
    const int place = m->mocap_count++;
    if (place >= m->mocap_keyed)
        return pose;
    const double *at = m->mpos != NULL ? m->mpos + 3 * place : NULL;
    const double *turn = m->mquat != NULL ? normalize_turn(m->mquat + 4 * place) : NULL;
    if (at != NULL)
        pose.position = kt_vec3_make(at[0], at[1], at[2]);
    if (turn != NULL)
        pose.rotation = kt_matrix_from_quat(kt_quat_make(turn[0], turn[1], turn[2], turn[3]));
    return pose;
}
