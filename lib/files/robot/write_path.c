/* Springs and dampers between two ends and along paths, as spatial tendons of MJCF; polynomial springs in joints.
 *
 * Each point of a path is a site, and each surface a geom without mass. A side is a site outside of the geom, and the
 * centre of a ring is a site inside. A spring in a joint is the joint's if its length is the position, and that of a
 * tendon fixed to the joint otherwise. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/write.h"

#include <math.h>
#include <string.h>

/* ---- which effects are tendons ----------------------------------------------------------------------------------- */

/* A linear spring between two ends. */
static bool take_line_spring(kt_export *x, const kt_effect *e) {
    if (e->initial_length || !(e->length >= 0.0) || !kt_export_add_rope(x, e))
        return false;
    kt_export_rope *rope = &x->ropes[x->rope_count - 1];
    rope->stiffness[0] = e->stiffness;
    rope->damping[0] = e->damping;
    rope->rest[0] = rope->rest[1] = e->length;
    return true;
}

bool kt_export_take_rope(kt_export *x, const kt_effect *e) {
    const kt_polynomial_spring *s = e->type == KT_EFFECT_EXPRESSION && e->end_count == 2 ? e->spring : NULL;
    if (s == NULL)
        return e->type == KT_EFFECT_SPRING && take_line_spring(x, e);
    if (s->beyond) {
        kt_export_lose(x, "stops along paths");
        return true; /* counted here: nothing else can represent it */
    }
    if (!(s->rest[0] >= 0.0) || !kt_export_add_rope(x, e))
        return false;
    kt_export_rope *rope = &x->ropes[x->rope_count - 1];
    memcpy(rope->stiffness, s->stiffness, sizeof rope->stiffness);
    memcpy(rope->damping, s->damping, sizeof rope->damping);
    memcpy(rope->rest, s->rest, sizeof rope->rest);
    rope->friction = s->friction;
    if (s->friction != 0.0)
        kt_export_lose(x, "smoothing of the friction of paths");
    return true;
}

/* ---- springs in joints ------------------------------------------------------------------------------------------- */

static bool is_zero_polynomial(const double k[3]) { return k[0] == 0.0 && k[1] == 0.0 && k[2] == 0.0; }

/* Whether a spring can be added to those of a joint, or of the tendon that its slider represents. */
static bool fits_in_joint(const kt_export *x, const kt_polynomial_spring *s, int body) {
    const kt_export_forces *f = &x->forces[body];
    const bool has_spring = !is_zero_polynomial(s->stiffness);
    return s->factor == 1.0 && (!has_spring || is_zero_polynomial(f->stiffness)) &&
           (!has_spring || x->role[body] == KT_EXPORT_SUM || s->rest[0] == s->rest[1]);
}

bool kt_export_take_spring(kt_export *x, const kt_effect *e) {
    const kt_polynomial_spring *s = e->type == KT_EFFECT_EXPRESSION && e->end_count == 0 ? e->spring : NULL;
    const int body = s != NULL ? kt_export_scalar(x, e->joint) : -1;
    if (body < 0)
        return false;
    kt_export_forces *f = &x->forces[body];
    if (fits_in_joint(x, s, body)) {
        for (int k = 0; k < 3; k++)
            f->damping[k] += s->damping[k];
        if (is_zero_polynomial(s->stiffness))
            return true;
        memcpy(f->stiffness, s->stiffness, sizeof f->stiffness);
        memcpy(f->rest, s->rest, sizeof f->rest);
        return true;
    }
    kt_term *term = x->role[body] != KT_EXPORT_SUM ? kt_pool_take(&x->pool, 1, sizeof *term) : NULL;
    if (term == NULL)
        return false;
    *term = (kt_term){e->joint, s->factor};
    x->lines[kt_export_add_line(x, e->name, term, 1)].spring = s;
    return true;
}

void kt_export_write_polynomial(kt_export *x, const char *name, const double k[3]) {
    if (!is_zero_polynomial(k))
        kt_export_numbers(x, name, k, k[1] != 0.0 || k[2] != 0.0 ? 3 : 1);
}

bool kt_export_add_rope(kt_export *x, const kt_effect *e) {
    const bool divides_first = e->path_count > 0 && e->path[0].divisor > 0.0 && e->path[0].divisor != 1.0;
    if (!divides_first)
        x->ropes[x->rope_count++] = (kt_export_rope){.effect = e};
    return !divides_first;
}

/* ---- points ------------------------------------------------------------------------------------------------------ */

static int count_points(const kt_effect *e) { return e->path_count > 0 ? e->path_count : 2; }

static kt_path_point point_at(const kt_effect *e, int k) {
    return e->path_count > 0 ? e->path[k] : (kt_path_point){.end = e->between[k]};
}

static void write_name(kt_export *x, const char *attribute, int rope, int point, const char *suffix) {
    const char *name = x->ropes[rope].effect->name;
    if (name != NULL)
        kt_export_print(x, " %s=\"%s", attribute, name);
    else
        kt_export_print(x, " %s=\"rope%d", attribute, rope + 1);
    if (point >= 0)
        kt_export_print(x, "__%d%s", point + 1, suffix);
    kt_export_print(x, "\"");
}

void kt_export_rope_name(kt_export *x, const char *attribute, int rope) { write_name(x, attribute, rope, -1, ""); }

static void write_site(kt_export *x, int rope, int point, const char *suffix, kt_vec3 at) {
    kt_export_print(x, "<site");
    write_name(x, "name", rope, point, suffix);
    kt_export_print(x, " pos=\"%g %g %g\"/>", at.x, at.y, at.z);
}

/* A side is far outside: MuJoCo before 3.0 compares its distance in the plane of the path with the radius. */
static void write_surface(kt_export *x, int rope, int k, const kt_path_point *point, const kt_pose *frame) {
    const bool is_cylinder = kt_vec3_norm(point->axis) > 0.0, has_side = kt_vec3_norm(point->side) > 0.0;
    const double size[2] = {point->radius, point->radius};
    kt_export_print(x, "<geom");
    write_name(x, "name", rope, k, "");
    kt_export_print(x, " type=\"%s\" mass=\"0\" contype=\"0\" conaffinity=\"0\" group=\"3\"",
                    is_cylinder ? "cylinder" : "sphere");
    kt_export_numbers(x, "size", size, is_cylinder ? 2 : 1);
    kt_export_vector(x, "pos", frame->position);
    if (is_cylinder)
        kt_export_vector(x, "zaxis", kt_mat3_apply(frame->rotation, point->axis));
    kt_export_print(x, "/>");
    if (point->inside)
        write_site(x, rope, k, "__side", frame->position);
    else if (has_side)
        write_site(x, rope, k, "__side",
                   kt_vec3_add(frame->position,
                               kt_vec3_scale(20.0 * point->radius,
                                             kt_mat3_apply(frame->rotation, kt_vec3_normalize(point->side)))));
}

void kt_export_rope_points(kt_export *x, int body) {
    for (int i = 0; i < x->rope_count; i++)
        for (int k = 0; k < count_points(x->ropes[i].effect); k++) {
            const kt_path_point point = point_at(x->ropes[i].effect, k);
            if ((kt_export_find(x, point.end.body)) != body)
                continue;
            const kt_pose frame = kt_export_end(x, &point.end);
            if (point.radius > 0.0)
                write_surface(x, i, k, &point, &frame);
            else
                write_site(x, i, k, "", frame.position);
        }
}

/* ---- tendons ----------------------------------------------------------------------------------------------------- */

static void write_entry(kt_export *x, int rope, int k, const kt_path_point *point) {
    if (k > 0 && point->divisor > 0.0)
        kt_export_print(x, "<pulley divisor=\"%g\"/>", point->divisor);
    kt_export_print(x, point->radius > 0.0 ? "<geom" : "<site");
    write_name(x, point->radius > 0.0 ? "geom" : "site", rope, k, "");
    if (point->radius > 0.0 && (point->inside || kt_vec3_norm(point->side) > 0.0))
        write_name(x, "sidesite", rope, k, "__side");
    kt_export_print(x, "/>");
}

void kt_export_ropes(kt_export *x) {
    for (int i = 0; i < x->rope_count; i++) {
        const kt_export_rope *rope = &x->ropes[i];
        kt_export_print(x, "    <spatial");
        write_name(x, "name", i, -1, "");
        kt_export_write_polynomial(x, "stiffness", rope->stiffness);
        if (!is_zero_polynomial(rope->stiffness))
            kt_export_numbers(x, "springlength", rope->rest, rope->rest[0] < rope->rest[1] ? 2 : 1);
        kt_export_write_polynomial(x, "damping", rope->damping);
        kt_export_unless_zero(x, "frictionloss", rope->friction);
        kt_export_unless_zero(x, "armature", rope->armature);
        kt_export_sum_range(x, rope->effect->actuators);
        kt_export_print(x, ">");
        for (int k = 0; k < count_points(rope->effect); k++) {
            const kt_path_point point = point_at(rope->effect, k);
            write_entry(x, i, k, &point);
        }
        kt_export_print(x, "</spatial>\n");
    }
}
