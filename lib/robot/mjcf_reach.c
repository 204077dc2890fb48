/* Lengths of muscles of MJCF: their range, and the acceleration by a unit force.
 *
 * The length of an actuator is l = g L(q), with its gear g and the length L of its joint or tendon. The acceleration is
 * |M^-1 g dL/dq| at the reference positions. A file may give the range of l (`lengthrange`). If it does not, the range
 * goes from the least to the largest length within the limits of joints. This is exact for joints and fixed tendons.
 * The length of a spatial tendon is followed from the reference positions uphill and downhill, one joint after the
 * other, until no joint changes it any more, or a limit is reached. MuJoCo pulls the actuator with a small force and a
 * strong damping to the same ends, with its soft limits. With `uselimit`, both take the limits of a joint, without the
 * gear.
 *
 * There is no range if a joint on which the length depends has no limits and slides, or has more than one axis. There
 * is none if equalities or limits of other tendons may bound it, or if the length jumps at its end. MuJoCo rejects most
 * of these models.
 */
#include "kinetree/dynamics.h"
#include "linear/cholesky.h"
#include "mechanism/path_force.h"
#include "robot/contact.h"
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* The joint or the tendon of an actuator; -1: it is none. */
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

/* ---- ends of a path's length ------------------------------------------------------------------------------------- */

/* Turns one joint so that the length grows (sense 1) or shrinks (sense -1), up to a limit or a turning point. A
 * hinge without limits makes a turn at most. */
static void walk_joint(const length *l, const kt_mjcf_joint *j, kt_coordinates c, double sense) {
    enum { STEPS = 16, HALVINGS = 60 };
    double *x = &l->tree->q[c.q], best = sense * evaluate_length(l);
    const double slope = sense * l->gradient[c.v], direction = slope > 0.0 ? 1.0 : -1.0, infinite = (double)INFINITY;
    const double lower = j->is_limited ? j->lower : -infinite, upper = j->is_limited ? j->upper : infinite;
    double step = direction * (j->is_limited ? upper - lower : 6.283185307179586) / STEPS;
    bool has_turned = false;
    if (fabs(slope) <= 1e-9 * fabs(best))
        return;
    for (int n = 0; n < STEPS || (has_turned && n < STEPS + HALVINGS); n++) {
        const double before = *x;
        *x = fmin(fmax(before + step, lower), upper);
        const double now = sense * evaluate_length(l);
        if (now > best && sense * direction * l->gradient[c.v] > 0.0) {
            best = now;
            if (*x == lower || *x == upper)
                return;
        } else {
            *x = before;
            has_turned = true;
        }
        step *= has_turned ? 0.5 : 1.0;
    }
}

/* Whether a joint changes the length. */
static bool moves_path(const length *l, kt_coordinates c, double size) {
    double sum = 0.0;
    for (int k = 0; k < c.nv; k++)
        sum = fmax(sum, fabs(l->gradient[c.v + k]));
    return sum > 1e-9 * size;
}

/* Whether a joint carries some points of the path, but not all. */
static bool is_between(const length *l, const kt_mjcf_joint *j) {
    int carried = 0;
    for (int k = 0; k < l->links; k++) {
        const char *name = kt_body_name(l->tree->model, l->bodies[k]);
        int body = 0;
        for (int i = 1; i < l->m->bodies.count && l->bodies[k] > 0; i++)
            body = strcmp(kt_mjcf_body_at(l->m, i)->name, name) == 0 ? i : body;
        carried += body > 0 && kt_mjcf_is_carried(l->m, body, j->body);
    }
    return carried > 0 && carried < l->links;
}

/* Whether the walks ended at limits and turning points. Else the length jumps at an end (effect/path.c). */
static bool ends_at_limits(const length *l, double sense) {
    const double size = fabs(evaluate_length(l));
    bool is_flat = true;
    for (int i = 0; i < l->m->joints.count; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(l->m, i);
        const kt_coordinates c = kt_mjcf_coordinates_of(l->m, l->tree->model, j);
        if (!kt_mjcf_is_scalar(j) || !is_between(l, j))
            continue;
        const double slope = sense * l->gradient[c.v], x = l->tree->q[c.q];
        is_flat =
            is_flat && (fabs(slope) <= 1e-4 * size || (j->is_limited && x == (slope > 0.0 ? j->upper : j->lower)));
    }
    return is_flat;
}

static bool find_end_of_path(const length *l, double sense, double *found) {
    enum { CYCLES = 200 };
    const kt_contact_tree *tree = l->tree;
    double last = (double)-INFINITY;
    for (int i = 0; i < l->m->joints.count; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(l->m, i);
        const kt_coordinates c = kt_mjcf_coordinates_of(l->m, tree->model, j);
        if (!is_between(l, j))
            continue;
        const double size = evaluate_length(l);
        if ((!kt_mjcf_is_scalar(j) || (j->type == KT_MJCF_SLIDE && !j->is_limited)) && moves_path(l, c, size))
            return false;
        if (kt_mjcf_is_scalar(j) && j->is_limited)
            tree->q[c.q] = fmin(fmax(tree->q[c.q], j->lower), j->upper);
    }
    for (int n = 0; n < CYCLES; n++) {
        *found = evaluate_length(l);
        if (!(sense * *found > last + 1e-12 * fabs(*found)))
            return isfinite(*found) && ends_at_limits(l, sense);
        last = sense * *found;
        for (int i = 0; i < l->m->joints.count; i++) {
            const kt_mjcf_joint *j = kt_mjcf_joint_at(l->m, i);
            if (kt_mjcf_is_scalar(j) && is_between(l, j))
                walk_joint(l, j, kt_mjcf_coordinates_of(l->m, tree->model, j), sense);
        }
    }
    return false;
}

static bool find_ends_of_path(const length *l, double range[2]) {
    const size_t nq = (size_t)kt_model_nq(l->tree->model);
    double *start = kt_reader_take(l->m->r, &l->m->r->scratch, nq + 1, sizeof *start);
    bool is_found = start != NULL;
    if (!is_found)
        return false;
    memcpy(start, l->tree->q, nq * sizeof *start);
    for (int side = 0; side < 2 && is_found; side++) {
        is_found = find_end_of_path(l, side == 1 ? 1.0 : -1.0, &range[side]);
        memcpy(l->tree->q, start, nq * sizeof *start);
    }
    return is_found;
}

/* ---- ranges ------------------------------------------------------------------------------------------------------ */

static bool is_limit_used(kt_mjcf *m) {
    bool is_used = false;
    for (const kt_element *e = kt_xml_child(m->root, "compiler"); e != NULL; e = kt_xml_next(e, "compiler"))
        for (const kt_element *r = kt_xml_child(e, "lengthrange"); r != NULL; r = kt_xml_next(r, "lengthrange"))
            is_used = kt_mjcf_flag(m, r, NULL, "uselimit", is_used);
    return is_used;
}

static bool read_tendon_limits(kt_mjcf *m, const kt_mjcf_tendon *t, double range[2]) {
    return !m->off.limits && kt_mjcf_is_limited(m, t->element, "tendon", "limited", "range") &&
           kt_mjcf_numbers(m, t->element, "tendon", "range", 2, 2, range) == 2;
}

/* The sum of the joints' limits. */
static bool add_joint_limits(const length *l, double range[2]) {
    const kt_mjcf_term own = {l->on.joint, 1.0};
    int count;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(l->m, l->on.tendon, &own, &count);
    range[0] = range[1] = 0.0;
    for (int i = 0; i < count; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(l->m, terms[i].joint);
        const double ends[2] = {terms[i].coefficient * j->lower, terms[i].coefficient * j->upper};
        if (!j->is_limited)
            return false;
        range[0] += fmin(ends[0], ends[1]);
        range[1] += fmax(ends[0], ends[1]);
    }
    return true;
}

/* The range of the length within the limits of joints alone. */
static bool find_joint_range(const length *l, double range[2]) {
    const kt_mjcf_tendon *t = tendon_of(l);
    return !l->m->off.limits &&
           (t != NULL && t->path_count > 0 ? find_ends_of_path(l, range) : add_joint_limits(l, range));
}

/* Whether the limits of a tendon may bound joints: if its range within the limits of joints is not within its own. */
static bool may_bind(const length *l, int index) {
    kt_mjcf_tendon *t = kt_mjcf_tendon_at(l->m, index);
    length own = {.m = l->m,
                  .tree = l->tree,
                  .on = {.joint = -1, .tendon = index, .gear = 1.0},
                  .jacobian = l->jacobian,
                  .gradient = l->gradient};
    double limits[2], range[2];
    if (t->is_judged || !read_tendon_limits(l->m, t, limits))
        return t->is_judged && t->may_bind;
    t->is_judged = true;
    t->may_bind = (t->path_count > 0 && !read_reach_points(&own)) || !find_joint_range(&own, range) ||
                  range[0] < limits[0] || range[1] > limits[1];
    return t->may_bind;
}

/* Whether equalities, or limits of tendons other than that of the length, may bound joints. */
static bool is_tied(const length *l) {
    bool found = false;
    for (const kt_element *e = kt_mjcf_section(l->m, "equality", NULL); e != NULL && !l->m->off.equalities;
         e = kt_mjcf_section(l->m, "equality", e))
        found = found || kt_mjcf_flag(l->m, e, "equality", "active", true);
    for (int i = 0; i < l->m->tendons.count && !found; i++)
        found = i != l->on.tendon && may_bind(l, i);
    return found;
}

/* The range of the length of a joint or tendon, within the limits of joints and its own. */
static bool find_range(const length *l, double range[2]) {
    const double infinite = (double)INFINITY;
    double limits[2] = {-infinite, infinite};
    const kt_mjcf_tendon *t = tendon_of(l);
    const bool is_limited = t != NULL && read_tendon_limits(l->m, t, limits);
    if (is_tied(l))
        return false;
    if (!find_joint_range(l, range)) {
        memcpy(range, limits, sizeof limits);
        return is_limited;
    }
    range[0] = fmax(range[0], limits[0]);
    range[1] = fmin(range[1], limits[1]);
    return true;
}

static void take_range(const length *l, kt_mjcf_reach *reach) {
    double range[2] = {0.0, 0.0};
    if (kt_mjcf_numbers(l->m, reach->element, KT_MJCF_ACTUATORS, "lengthrange", 2, 2, range) == 2 &&
        range[0] < range[1]) {
        memcpy(reach->range, range, sizeof range);
        reach->is_found = true;
        return;
    }
    double gear = l->on.gear;
    if (tendon_of(l) == NULL && is_limit_used(l->m) && add_joint_limits(l, range)) {
        gear = 1.0;
    } else {
        if (!find_range(l, range))
            return;
        reach->is_computed = true;
    }
    reach->range[0] = fmin(gear * range[0], gear * range[1]);
    reach->range[1] = fmax(gear * range[0], gear * range[1]);
    reach->is_found = reach->range[0] < reach->range[1];
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
