/* The start of a model in MJCF: one of its keyframes.
 *
 * The keyframe of an attached model has numbers for all joints and actuators of that model, in its order. Attached
 * joints and actuators get their numbers from this keyframe. The others of the whole begin at their reference
 * positions, at rest and without control. Numbers of `act`, `mpos` and `mquat` of an attached model are left out with a
 * warning. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* NULL: the keyframe has no such attribute, or a wrong number of values, which is reported. */
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

/* Counts the bodies that a program moves. */
static int count_mocap(kt_mjcf *m) {
    int count = 0;
    for (int i = 1; i < m->bodies.count; i++)
        count += is_keyed_mocap(m, i);
    return count;
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

/* The keyframe of an attached model has numbers for that model's joints and controls alone; all others begin at the
 * reference. */
static void start_attached(kt_mjcf *m, const kt_element *key) {
    const kt_list *list = &kt_mjcf_document_at(m, key->document)->joints;
    int nq = 0, nv = 0;
    for (int i = 0; i < list->count; i++) {
        const kt_element *joint = ((const kt_element *const *)list->items)[i];
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

/* The keyframe of a name; a name without a keyframe is a fault. Without a name, counts the keyframes that are left out.
 */
static const kt_element *find_key(kt_mjcf *m, const char *wanted) {
    const kt_element *found = NULL;
    for (const kt_element *e = kt_mjcf_section(m, "keyframe", NULL); e != NULL; e = kt_mjcf_section(m, "keyframe", e)) {
        const char *name = kt_xml_attribute(e, "name");
        if (wanted == NULL)
            kt_left_count(&m->notes.keys, e);
        else if (found == NULL && name != NULL && strcmp(name, wanted) == 0)
            found = e;
    }
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
    const kt_element *key = find_key(m, m->source->options->keyframe);
    if (key == NULL)
        return;
    for (const kt_element *e = kt_mjcf_section(m, "actuator", NULL); e != NULL; e = kt_mjcf_section(m, "actuator", e))
        m->ctrl_count++;
    if (key->document > 0) {
        start_attached(m, key);
    } else {
        m->qpos = key_numbers(m, key, "qpos", m->nq);
        m->qvel = key_numbers(m, key, "qvel", m->nv);
        m->ctrl = key_numbers(m, key, "ctrl", m->ctrl_count);
        m->act = key_numbers(m, key, "act", count_first_activations(m, m->ctrl_count));
        read_mocap(m, key, count_mocap(m));
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
        pose.rotation = kt_mat3_from_quat(kt_quat_make(turn[0], turn[1], turn[2], turn[3]));
    return pose;
}
