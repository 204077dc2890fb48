/* Spatial tendons of MJCF as forces along paths (effect/path.c).
 *
 * A tendon leads through sites, and around spheres and cylinders between two sites. A pulley ends a branch of the path,
 * and divides the lengths of the next branch by its divisor. A surface with a side site within its radius is a ring.
 * A tendon between two sites alone acts between two ends.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include "evaluate/path_force.h"

#include <string.h>

/* ---- paths ------------------------------------------------------------------------------------------------------- */

void kt_mjcf_add_wrap(kt_mjcf *m, const kt_element *e, int body, kt_pose frame) {
    static const char *const words[] = {"sphere", "cylinder", NULL};
    const char *name = kt_xml_attribute(e, "name"), *type = kt_mjcf_text(m, e, "geom", "type");
    const bool is_cylinder = type != NULL && strcmp(type, words[1]) == 0;
    double size[3] = {0.0};
    if (name == NULL || (type != NULL && strcmp(type, words[0]) != 0 && !is_cylinder) ||
        kt_names_find(&m->names, KT_MJCF_WRAPS, name) >= 0 || kt_mjcf_text(m, e, "geom", "mesh") != NULL ||
        kt_mjcf_numbers(m, e, "geom", "size", 1, 3, size) == 0 || !(size[0] > 0.0))
        return;
    (void)kt_names_add(&m->names, KT_MJCF_WRAPS, name, m->wraps.count);
    kt_mjcf_wrap *wrap = kt_list_add(m->r, &m->r->scratch, &m->wraps, sizeof *wrap);
    if (wrap != NULL)
        *wrap = (kt_mjcf_wrap){.body = body,
                               .pose = kt_pose_compose(frame, kt_mjcf_pose(m, e, "geom")),
                               .radius = size[0],
                               .is_cylinder = is_cylinder};
}

/* The motion of a joint from its reference to the position where its spring has no force. */
static kt_pose spring_turn(const kt_mjcf_joint *j) {
    const double x = j->spring - j->ref;
    kt_pose turn = kt_pose_identity();
    if (j->type == KT_MJCF_SLIDE)
        turn.position = kt_vec3_scale(x, kt_vec3_normalize(j->axis));
    if (j->type != KT_MJCF_HINGE)
        return turn;
    turn.rotation = kt_mat3_from_euler_vector(kt_vec3_scale(x, kt_vec3_normalize(j->axis)));
    turn.position = kt_vec3_sub(j->at, kt_mat3_apply(turn.rotation, j->at));
    return turn;
}

/* The pose of a body in the world while the springs of all joints have no force. */
static kt_pose pose_at_rest(const kt_mjcf *m, int body) {
    kt_pose pose = kt_pose_identity();
    for (; body > 0; body = kt_mjcf_body_at(m, body)->parent) {
        const kt_mjcf_body *b = kt_mjcf_body_at(m, body);
        kt_pose own = b->pose;
        for (int k = 0; k < b->joint_count; k++)
            own = kt_pose_compose(own, spring_turn(kt_mjcf_joint_at(m, b->first_joint + k)));
        pose = kt_pose_compose(own, pose);
    }
    return pose;
}

/* Names of bodies are unique, and that of the world is missing. */
int kt_mjcf_body_of_end(const kt_mjcf *m, const kt_end *end) {
    for (int i = 1; i < m->bodies.count; i++)
        if (kt_mjcf_body_at(m, i)->name == end->body)
            return i;
    return 0;
}

/* The length of the path while the springs of all joints have no force. */
static double length_at_rest(kt_mjcf *m, const kt_mjcf_tendon *t) {
    kt_path_point_record *records = kt_reader_take(m->r, &m->r->scratch, (size_t)t->path_count, sizeof *records);
    if (records == NULL)
        return 0.0;
    for (int i = 0; i < t->path_count; i++) { /* all in the axes of the world */
        const kt_pose on = pose_at_rest(m, kt_mjcf_body_of_end(m, &t->path[i].end));
        const kt_pose frame = {.position = kt_pose_apply(on, t->path[i].end.at), .rotation = on.rotation};
        records[i] = kt_path_record_of(&t->path[i], &frame, 0);
    }
    const kt_effect_end world = {.axes = kt_mat3_identity()};
    kt_path_value value;
    kt_path_measure(records, t->path_count, &world, 1, &value);
    return value.length;
}

int kt_mjcf_common_body(const kt_mjcf *m, int a, int b) {
    while (a != b) {
        int *lower = a > b ? &a : &b;
        *lower = kt_mjcf_body_at(m, *lower)->parent;
    }
    return a;
}

/* Whether a joint leaves a surface in its place: a hinge about the axis of a cylinder, or through the centre of a
 * sphere. surface: in the world. */
static bool leaves_in_place(const kt_mjcf *m, const kt_mjcf_joint *j, const kt_mjcf_wrap *wrap,
                            const kt_pose *surface) {
    static const double near = 1e-9; /* m; of directions, rad */
    const kt_pose on = kt_mjcf_body_at(m, j->body)->world;
    const kt_vec3 axis = kt_mat3_apply(on.rotation, kt_vec3_normalize(j->axis)), z = surface->rotation.z;
    const kt_vec3 arm = kt_vec3_sub(surface->position, kt_pose_apply(on, j->at));
    const bool is_parallel = kt_vec3_norm(kt_vec3_cross(axis, z)) < near;
    if (j->type == KT_MJCF_SLIDE)
        return wrap->is_cylinder && is_parallel;
    if (j->type == KT_MJCF_HINGE)
        return kt_vec3_norm(kt_vec3_cross(axis, arm)) < near && (is_parallel || !wrap->is_cylinder);
    return j->type == KT_MJCF_BALL && !wrap->is_cylinder && kt_vec3_norm(arm) < near;
}

/* The pose of a surface in another body, in which the joints between both bodies leave it; false if they do not. */
static bool find_surface_in(const kt_mjcf *m, const kt_mjcf_wrap *wrap, int body, kt_pose *pose) {
    const kt_pose surface = kt_pose_compose(kt_mjcf_body_at(m, wrap->body)->world, wrap->pose);
    const int common = kt_mjcf_common_body(m, wrap->body, body), ends[2] = {wrap->body, body};
    for (int k = 0; k < 2; k++)
        for (int b = ends[k]; b != common; b = kt_mjcf_body_at(m, b)->parent)
            for (int i = 0; i < kt_mjcf_body_at(m, b)->joint_count; i++)
                if (!leaves_in_place(m, kt_mjcf_joint_at(m, kt_mjcf_body_at(m, b)->first_joint + i), wrap, &surface))
                    return false;
    *pose = kt_pose_compose(kt_pose_invert(kt_mjcf_body_at(m, body)->world), surface);
    return true;
}

/* Sets the point to a geom, or returns false if the path cannot lead around it. A side site on another body needs a
 * surface that rests in that body, too. */
static bool set_surface(kt_mjcf *m, const kt_element *e, kt_path_point *point) {
    const char *name = kt_xml_attribute(e, "geom");
    const int index = name != NULL ? kt_names_find(&m->names, KT_MJCF_WRAPS, name) : -1;
    if (index < 0)
        return false;
    const kt_mjcf_wrap *wrap = (const kt_mjcf_wrap *)m->wraps.items + index;
    const bool has_side = kt_xml_attribute(e, "sidesite") != NULL;
    const int side = has_side ? kt_mjcf_find(m, e, "sidesite", KT_MJCF_SITES) : -1;
    const int body = side >= 0 ? kt_mjcf_site_at(m, side)->body : wrap->body;
    kt_pose pose;
    if ((has_side && side < 0) || !find_surface_in(m, wrap, body, &pose))
        return false;
    point->end.body = kt_mjcf_body_at(m, body)->name;
    point->end.at = pose.position;
    point->radius = wrap->radius;
    if (wrap->is_cylinder)
        point->axis = pose.rotation.z;
    if (!has_side)
        return true;
    const kt_vec3 d = kt_vec3_sub(kt_mjcf_site_at(m, side)->pose.position, pose.position);
    point->inside = kt_vec3_norm(d) < wrap->radius;
    if (!point->inside)
        point->side = d;
    return true;
}

/* Ends the branch that began with point `first`: a single point has no length. */
static void end_branch(kt_mjcf_tendon *t, int first) {
    if (t->path_count == first + 1)
        t->path_count = first;
}

/* Whether a surface is between two points of a branch. */
static bool is_between_points(const kt_mjcf_tendon *t, int i) {
    const kt_path_point *p = t->path;
    return i > 0 && i + 1 < t->path_count && !(p[i - 1].radius > 0.0) && !(p[i + 1].radius > 0.0) &&
           !(p[i + 1].divisor > 0.0);
}

/* A pulley ends a branch of the path; the first point behind it has its divisor. Returns false if the path is
 * incomplete. */
static bool read_tendon_points(kt_mjcf *m, kt_mjcf_tendon *t) {
    double divisor = 0.0;
    int first = 0;
    for (const kt_element *c = t->element->first; c != NULL; c = c->next) {
        kt_path_point *point = &t->path[t->path_count];
        *point = (kt_path_point){.end = kt_end_default()};
        if (strcmp(c->name, "pulley") == 0) {
            end_branch(t, first);
            first = t->path_count;
            divisor = kt_mjcf_number(m, c, NULL, "divisor", 0.0);
            if (!(divisor > 0.0))
                return false;
            continue;
        }
        if (strcmp(c->name, "site") == 0) {
            const int site = kt_mjcf_find(m, c, "site", KT_MJCF_SITES);
            if (site < 0)
                return false;
            point->end.body = kt_mjcf_body_at(m, kt_mjcf_site_at(m, site)->body)->name;
            point->end.at = kt_mjcf_site_at(m, site)->pose.position;
            point->divisor = t->path_count == first ? divisor : 0.0;
        } else if (!set_surface(m, c, point)) {
            return false;
        }
        t->path_count++;
    }
    end_branch(t, first);
    for (int i = 0; i < t->path_count; i++)
        if (t->path[i].radius > 0.0 && !is_between_points(t, i))
            return false;
    return t->path_count > 1;
}

/* The number of different bodies along the path. */
static int count_bodies(const kt_mjcf_tendon *t) {
    int count = 0;
    for (int i = 0; i < t->path_count; i++) {
        int k = 0;
        while (k < i && t->path[k].end.body != t->path[i].end.body)
            k++;
        count += k == i;
    }
    return count;
}

bool kt_mjcf_read_path(kt_mjcf *m, kt_mjcf_tendon *t) {
    size_t count = 1;
    for (const kt_element *c = t->element->first; c != NULL; c = c->next)
        count++;
    t->path = kt_reader_take(m->r, &m->r->keep, count, sizeof *t->path);
    if (t->path == NULL)
        return false;
    if (!read_tendon_points(m, t))
        return false;
    for (int i = 0; i < t->path_count; i++)
        t->is_bounded = t->is_bounded || kt_mjcf_is_bounded_above(m, kt_mjcf_body_of_end(m, &t->path[i].end));
    t->moves = count_bodies(t) > 1;
    t->rest = length_at_rest(m, t);
    return count_bodies(t) <= KT_PATH_LINK_MAX;
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

kt_effect *kt_mjcf_add_along_path(kt_mjcf *m, kt_mjcf_tendon *t, const kt_element *e) {
    kt_effect *effect = t->moves ? kt_draft_effect(&m->draft, e, KT_EFFECT_EXPRESSION) : NULL;
    if (effect == NULL)
        return NULL;
    kt_mjcf_name_effect(m, kt_xml_attribute(e, "name"));
    effect->end_count = 2;
    if (t->path_count > 2 || t->path[0].divisor > 0.0) {
        effect->path = t->path;
        effect->path_count = t->path_count;
        return effect;
    }
    for (int k = 0; k < 2; k++)
        effect->between[k] = t->path[k].end;
    return effect;
}

/* ---- springs, dampers and stops ---------------------------------------------------------------------------------- */

static void add_path_spring(kt_mjcf *m, kt_mjcf_tendon *t, const kt_polynomial_spring *numbers) {
    kt_polynomial_spring *spring = kt_reader_take(m->r, &m->r->keep, 1, sizeof *spring);
    kt_effect *effect = spring != NULL ? kt_mjcf_add_along_path(m, t, t->element) : NULL;
    if (effect == NULL)
        return;
    *spring = *numbers;
    effect->spring = spring;
}

void kt_mjcf_act_in_path(kt_mjcf *m, kt_mjcf_tendon *t) {
    const kt_element *e = t->element;
    const kt_robot_options *o = m->source->options;
    kt_polynomial_spring p = kt_polynomial_spring_default(), stop = p;
    p.rest[0] = p.rest[1] = -1.0;
    if (!m->off.springs)
        (void)kt_mjcf_numbers(m, e, "tendon", "stiffness", 1, 3, p.stiffness);
    if (!m->off.dampers)
        (void)kt_mjcf_numbers(m, e, "tendon", "damping", 1, 3, p.damping);
    if (kt_mjcf_numbers(m, e, "tendon", "springlength", 1, 2, p.rest) == 1)
        p.rest[1] = p.rest[0];
    if (p.rest[0] < 0.0)
        p.rest[0] = p.rest[1] = t->rest;
    if (!m->off.friction)
        p.friction = kt_mjcf_number(m, e, "tendon", "frictionloss", 0.0);
    if (p.friction != 0.0)
        kt_left_count(&m->notes.friction, e);
    if (kt_mjcf_is_any(p.stiffness) || kt_mjcf_is_any(p.damping) || p.friction != 0.0)
        add_path_spring(m, t, &p);
    if (m->off.limits || !kt_mjcf_is_limited(m, e, "tendon", "limited", "range") ||
        kt_mjcf_numbers(m, e, "tendon", "range", 2, 2, stop.rest) != 2)
        return;
    kt_left_count(&m->notes.limits, e);
    stop.stiffness[0] = o->stop_stiffness;
    stop.damping[0] = o->stop_damping;
    stop.beyond = true;
    if (o->stop_stiffness != 0.0)
        add_path_spring(m, t, &stop);
}
