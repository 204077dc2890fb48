/* Lengths of muscles of MJCF: their range, and the acceleration by a unit force.
 *
 * The length of an actuator is l = g L(q), with its gear g and the length L of its joint or tendon. The acceleration is
 * |M^-1 g dL/dq| at the reference positions. The range of l is that of the file (`lengthrange`). With `uselimit`, it is
 * that of the limits of the joint or tendon, without the gear, as in MuJoCo. Otherwise there is no range: MuJoCo finds
 * it in a simulation, and writes it with mj_saveLastXML.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/path_force.h"
#include "kinetree/dynamics.h"
#include "linear/cholesky.h"
#include "robot/mjcf.h"
#include "robot/robot_contact.h"

#include <math.h>
#include <string.h>

/* The joint or the tendon of an actuator; -1: the actuator has none. */
typedef struct line {
    int joint, tendon;
    double gear;
} line;

/* A length in a state of the tree, and its gradient. The path of a spatial tendon has its points in axes of bodies. */
typedef struct length {
    kt_mjcf *m;
    const kt_contact_tree *tree;
    line on;
    kt_path_point_record *points;
    int bodies[KT_PATH_LINK_MAX], links;
    double *jacobian, *gradient; /* room for 6 nv and nv numbers */
} length;

static line line_of(kt_mjcf *m, const kt_element *e) {
    const char *joint = kt_xml_attribute(e, "joint"), *tendon = kt_xml_attribute(e, "tendon");
    line found = {.joint = -1, .tendon = -1, .gear = kt_mjcf_gear_of(m, e)};
    joint = joint != NULL ? joint : kt_xml_attribute(e, "jointinparent");
    if (joint != NULL)
        found.joint = kt_names_find(&m->names, KT_MJCF_JOINTS, joint);
    else if (tendon != NULL)
        found.tendon = kt_names_find(&m->names, KT_MJCF_TENDONS, tendon);
    return found;
}

static const kt_mjcf_tendon *tendon_of(const length *l) {
    return l->on.tendon >= 0 ? kt_mjcf_tendon_at(l->m, l->on.tendon) : NULL;
}

kt_coordinates kt_mjcf_coordinates_of(const kt_mjcf *m, const kt_model *model, const kt_mjcf_joint *j) {
    const int body = kt_body_find(model, kt_draft_body_at(&m->draft, j->carrier_index)->name);
    return body > 0 ? kt_body_coordinates(model, body) : (kt_coordinates){.nv = 0};
}

/* ---- lengths ----------------------------------------------------------------------------------------------------- */

/* The points of a path, each with an index into l->bodies, which lists each body once. */
static bool read_reach_points(length *l) {
    const kt_mjcf_tendon *t = tendon_of(l);
    l->points = kt_reader_take(l->m->r, &l->m->r->scratch, (size_t)t->path_count + 1, sizeof *l->points);
    if (l->points == NULL)
        return false;
    for (int i = 0; i < t->path_count; i++) {
        const kt_pose frame = {.rotation = kt_mat3_identity(), .position = t->path[i].end.at};
        const char *name = t->path[i].end.body;
        const int body = name != NULL ? kt_body_find(l->tree->model, name) : 0;
        int k = 0;
        while (k < l->links && l->bodies[k] != body)
            k++;
        if (k == l->links)
            l->bodies[l->links++] = body;
        l->points[i] = kt_path_record_of(&t->path[i], &frame, k);
    }
    return true;
}

static double length_of_path(const length *l) {
    kt_effect_end frame[KT_PATH_LINK_MAX];
    kt_path_value value;
    for (int k = 0; k < l->links; k++) {
        const kt_pose pose = kt_body_pose(l->tree->model, l->tree->data, l->bodies[k]);
        frame[k] = (kt_effect_end){.axes = pose.rotation, .point = pose.position};
    }
    kt_path_measure(l->points, tendon_of(l)->path_count, frame, l->links, &value);
    for (int k = 0; k < l->links; k++) {
        if (l->bodies[k] == 0)
            continue;
        kt_point_jacobian(l->tree->model, l->tree->data, l->bodies[k], kt_vec3_make(0.0, 0.0, 0.0), l->jacobian);
        for (int j = 0; j < kt_model_nv(l->tree->model); j++) {
            const double *column = l->jacobian + 6 * (size_t)j;
            l->gradient[j] += kt_vec3_dot(value.unit[k].moment, kt_vec3_make(column[0], column[1], column[2])) +
                              kt_vec3_dot(value.unit[k].force, kt_vec3_make(column[3], column[4], column[5]));
        }
    }
    return value.length;
}

/* The length at the positions of the tree, and its gradient. */
static double evaluate_length(const length *l) {
    const kt_contact_tree *tree = l->tree;
    const kt_mjcf_tendon *t = tendon_of(l);
    const kt_mjcf_term own = {l->on.joint, 1.0};
    int count;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(l->m, l->on.tendon, &own, &count);
    double sum = 0.0;
    kt_error error;
    memset(l->gradient, 0, (size_t)kt_model_nv(tree->model) * sizeof *l->gradient);
    if (t != NULL && t->path_count > 0)
        return kt_kinematics_update(tree->model, tree->data, tree->q, tree->v, NULL, &error) == KT_OK
                   ? length_of_path(l)
                   : (double)NAN;
    for (int i = 0; i < count; i++) {
        const kt_coordinates c = kt_mjcf_coordinates_of(l->m, tree->model, kt_mjcf_joint_at(l->m, terms[i].joint));
        sum += terms[i].coefficient * tree->q[c.q];
        l->gradient[c.v] += terms[i].coefficient;
    }
    return sum;
}

/* ---- ranges ------------------------------------------------------------------------------------------------------ */

static bool is_limit_used(kt_mjcf *m) {
    bool is_used = false;
    for (const kt_element *e = kt_xml_child(m->root, "compiler"); e != NULL; e = kt_xml_next(e, "compiler"))
        for (const kt_element *r = kt_xml_child(e, "lengthrange"); r != NULL; r = kt_xml_next(r, "lengthrange"))
            is_used = kt_mjcf_flag(m, r, NULL, "uselimit", is_used);
    return is_used;
}

static void take_range(const length *l, kt_mjcf_reach *reach) {
    double range[2] = {0.0, 0.0};
    const bool is_given = kt_mjcf_numbers(l->m, reach->element, KT_MJCF_ACTUATORS, "lengthrange", 2, 2, range) == 2 &&
                          range[0] < range[1];
    const kt_mjcf_tendon *t = tendon_of(l);
    const kt_mjcf_joint *j = l->on.joint >= 0 ? kt_mjcf_joint_at(l->m, l->on.joint) : NULL;
    if (!is_given && is_limit_used(l->m)) {
        range[0] = j != NULL && j->is_limited ? j->lower : 0.0;
        range[1] = j != NULL && j->is_limited ? j->upper : 0.0;
        if (t != NULL && kt_mjcf_is_limited(l->m, t->element, "tendon", "limited", "range"))
            (void)kt_mjcf_numbers(l->m, t->element, "tendon", "range", 2, 2, range);
    }
    memcpy(reach->range, range, sizeof range);
    reach->is_found = range[0] < range[1];
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

static double acceleration_of(const length *l, const double *factors) {
    const int nv = kt_model_nv(l->tree->model);
    double sum = 0.0;
    (void)evaluate_length(l);
    kt_dense_solve(factors, nv, l->gradient);
    for (int i = 0; i < nv; i++)
        sum += l->gradient[i] * l->gradient[i];
    return fabs(l->on.gear) * sqrt(sum);
}

/* ---- all muscles ------------------------------------------------------------------------------------------------- */

static bool element_is_muscle(kt_mjcf *m, const kt_element *e) {
    const kt_mjcf_actuator a = kt_mjcf_actuator_of(m, e);
    return a.has_active || a.has_passive;
}

const kt_element *kt_mjcf_find_muscle(kt_mjcf *m, const kt_element *last) {
    const kt_element *e = kt_mjcf_section(m, "actuator", last);
    while (e != NULL && !element_is_muscle(m, e))
        e = kt_mjcf_section(m, "actuator", e);
    return e;
}

static void add_reach(kt_mjcf *m, const kt_element *e, const kt_contact_tree *tree, const double *factors,
                      double *room) {
    length l = {.m = m, .tree = tree, .on = line_of(m, e), .jacobian = room};
    l.gradient = room + 6 * (size_t)kt_model_nv(tree->model);
    const kt_mjcf_tendon *t = tendon_of(&l);
    const bool is_path = t != NULL && t->path_count > 0;
    if (t != NULL ? t->count == 0 && !is_path : l.on.joint < 0 || !kt_mjcf_is_scalar(kt_mjcf_joint_at(m, l.on.joint)))
        return;
    if (is_path && !read_reach_points(&l))
        return;
    kt_mjcf_reach *reach = kt_list_add(m->r, &m->r->scratch, &m->reaches, sizeof *reach);
    if (reach == NULL)
        return;
    *reach = (kt_mjcf_reach){.element = e, .acceleration = acceleration_of(&l, factors)};
    take_range(&l, reach);
}

/* Adds a J'J of a tendon's gradient J, for pairs of joints of which one carries the other. */
static void add_length_square(const length *l, double armature, double *mass) {
    const int nv = kt_model_nv(l->tree->model);
    for (int i = 0; i < l->m->joints.count; i++)
        for (int k = 0; k < l->m->joints.count; k++) {
            const kt_coordinates row = kt_mjcf_coordinates_of(l->m, l->tree->model, kt_mjcf_joint_at(l->m, i));
            const kt_coordinates column = kt_mjcf_coordinates_of(l->m, l->tree->model, kt_mjcf_joint_at(l->m, k));
            if (!kt_mjcf_is_chain(l->m, i, k))
                continue;
            for (int r = row.v; r < row.v + row.nv; r++)
                for (int c = column.v; c < column.v + column.nv; c++)
                    mass[c * nv + r] += armature * l->gradient[r] * l->gradient[c];
        }
}

void kt_mjcf_add_path_armatures(kt_mjcf *m, const kt_contact_tree *tree, double *mass, double *room) {
    for (int i = 0; i < m->tendons.count && !m->r->out_of_memory; i++) {
        const double armature = kt_mjcf_path_armature(m, kt_mjcf_tendon_at(m, i));
        length l = {.m = m, .tree = tree, .on = {.joint = -1, .tendon = i, .gear = 1.0}, .jacobian = room};
        l.gradient = room + 6 * (size_t)kt_model_nv(tree->model);
        if (armature != 0.0 && read_reach_points(&l) && isfinite(evaluate_length(&l)))
            add_length_square(&l, armature, mass);
    }
}

void kt_mjcf_find_reaches(kt_mjcf *m, const kt_contact_tree *tree, const double *factors, double *room) {
    for (const kt_element *e = kt_mjcf_find_muscle(m, NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_find_muscle(m, e))
        add_reach(m, e, tree, factors, room);
}

const kt_mjcf_reach *kt_mjcf_reach_of(const kt_mjcf *m, const kt_element *e) {
    const kt_mjcf_reach *all = m->reaches.items;
    for (int i = 0; i < m->reaches.count; i++)
        if (all[i].element == e)
            return &all[i];
    return NULL;
}
