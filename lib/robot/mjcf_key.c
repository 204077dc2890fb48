/* The start of a model in MJCF: one of its keyframes.
 *
 * The keyframe of an attached model has numbers for all joints and actuators of that model, in its order. The attached
 * ones take their numbers. The others of the whole begin at their reference positions, at rest and without control. */
#include "robot/mjcf.h"

#include <string.h>

static double *key_numbers(kt_mjcf *m, const kt_element *key, const char *name, int count) {
    const char *text = kt_xml_attribute(key, name);
    if (text == NULL)
        return NULL;
    double *values = kt_pool_take(&m->r->scratch, (size_t)count + 1, sizeof *values);
    if (values == NULL)
        (void)kt_reader_out_of_memory(m->r);
    else if (kt_parse_numbers(text, count, values) != count) {
        (void)kt_mjcf_fault(m, key, "%s: expected %d numbers, found '%.60s'", name, count, text);
        values = NULL;
    }
    return values;
}

/* ---- attached models --------------------------------------------------------------------------------------------- */

static double *zeros(kt_mjcf *m, int count) {
    double *values = kt_pool_take(&m->r->scratch, (size_t)count + 1, sizeof *values);
    if (values == NULL)
        (void)kt_reader_out_of_memory(m->r);
    else
        memset(values, 0, ((size_t)count + 1) * sizeof *values);
    return values;
}

/* The reference positions of all joints. */
static double *reference_positions(kt_mjcf *m) {
    double *qpos = zeros(m, m->nq);
    for (int i = 0; i < m->joints.count && qpos != NULL; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        const kt_pose pose = kt_mjcf_place_of(m, j->body);
        const kt_quat turn =
            j->type == KT_MJCF_FREE ? kt_quat_from_matrix(pose.rotation) : kt_quat_make(1.0, 0.0, 0.0, 0.0);
        double *to = qpos + j->position;
        if (j->type == KT_MJCF_FREE) {
            memcpy(to, (const double[]){pose.position.x, pose.position.y, pose.position.z}, 3 * sizeof *to);
            to += 3;
        }
        if (kt_mjcf_is_scalar(j))
            *to = j->ref;
        else
            memcpy(to, (const double[]){turn.w, turn.x, turn.y, turn.z}, 4 * sizeof *to);
    }
    return qpos;
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
    m->qpos = reference_positions(m);
    m->qvel = zeros(m, m->nv);
    m->ctrl = zeros(m, m->ctrl_count);
    if (m->r->out_of_memory)
        return;
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

static const kt_element *find_key(kt_mjcf *m, const char *wanted) {
    const kt_element *found = NULL;
    for (const kt_element *e = kt_mjcf_section(m, "keyframe", NULL); e != NULL; e = kt_mjcf_section(m, "keyframe", e)) {
        const char *name = kt_xml_attribute(e, "name");
        if (wanted == NULL)
            kt_left_count(&m->keys, e);
        found = found == NULL && wanted != NULL && name != NULL && strcmp(name, wanted) == 0 ? e : found;
    }
    if (wanted != NULL && found == NULL)
        reject_key(m, wanted);
    return found;
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
        m->key = key;
        m->qpos = key_numbers(m, key, "qpos", m->nq);
        m->qvel = key_numbers(m, key, "qvel", m->nv);
        m->ctrl = key_numbers(m, key, "ctrl", m->ctrl_count);
    }
    for (int i = 0; i < m->joints.count && m->qpos != NULL; i++) {
        kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        if (kt_mjcf_is_scalar(j))
            j->start = m->qpos[j->position];
    }
}

void kt_mjcf_keep_start(kt_mjcf *m) {
    kt_body *bodies = m->draft.bodies.items;
    for (int i = 0; i < m->joints.count && m->source->options->keyframe != NULL; i++)
        bodies[kt_mjcf_joint_at(m, i)->carrier_index].joint.given |=
            KT_GIVEN_POSITION | KT_GIVEN_ORIENTATION | KT_GIVEN_VELOCITY | KT_GIVEN_ANGULAR;
}
