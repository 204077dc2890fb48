/* Springs and dampers between two ends and along paths, as spatial tendons of MJCF.
 *
 * A force f(L, L') is that of a tendon if it is k (r - L) - c L' with k, c >= 0 and r >= 0: the tendon has the
 * stiffness k, the spring length r and the damping c. If r is the number in [a, b] that is nearest to L, the tendon has
 * the spring lengths a and b. The values at some lengths and rates decide whether a formula is that function. Each
 * point of the path is a site, and each surface a geom without mass. A side is a site outside of the geom, and the
 * centre of a ring is a site inside. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/formula_names.h"
#include "robot/write.h"

#include "kinetree/effect.h"

#include <math.h>
#include <string.h>

/* ---- which effects are tendons ----------------------------------------------------------------------------------- */

static double value_at(const kt_expression *formula, const kt_formula_names *names, double length, double rate) {
    double at[KT_FORMULA_VARIABLE_MAX] = {0.0};
    for (int k = 0; k < names->count; k++)
        at[k] = (int)names->variable[k].type == KT_VARIABLE_LENGTH ? length : rate;
    return kt_expression_evaluate(formula, at);
}

static bool reads_path_alone(const kt_formula_names *names) {
    for (int k = 0; k < names->count; k++)
        if ((int)names->variable[k].type != KT_VARIABLE_LENGTH && (int)names->variable[k].type != KT_VARIABLE_SPEED)
            return false;
    return true;
}

/* k, c, and the ends a and b of the lengths without force. */
typedef struct rope_line {
    double stiffness, damping, rest[2];
} rope_line;

/* Whether a formula is such a force at some lengths and rates. */
static bool is_rope(const kt_expression *formula, const kt_formula_names *names, const rope_line *r) {
    static const double lengths[] = {1e-3, 0.02, 0.11, 0.37, 0.9, 1.7, 4.1, 13.0, 90.0};
    static const double rates[] = {-50.0, -3.1, -0.4, -0.01, 0.02, 0.7, 5.3, 80.0};
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++)
        for (size_t k = 0; k < sizeof rates / sizeof *rates; k++) {
            const double rest = fmin(fmax(lengths[i], r->rest[0]), r->rest[1]);
            const double terms[3] = {r->stiffness * rest, r->stiffness * lengths[i], r->damping * rates[k]};
            const double error = value_at(formula, names, lengths[i], rates[k]) - (terms[0] - terms[1] - terms[2]);
            if (!(fabs(error) <= 1e-12 * (fabs(terms[0]) + fabs(terms[1]) + fabs(terms[2]))))
                return false;
        }
    return true;
}

/* Finds the numbers of a formula. A rope whose force is zero up to a length has the slope k at large lengths alone. */
static bool find_line(kt_export *x, const kt_effect *e, rope_line *r) {
    static const double far = 1024.0;
    kt_formula_names names = kt_formula_names_of(x->d, e);
    const kt_symbols symbols = kt_formula_symbols(&names);
    const kt_expression *formula = kt_export_parse(x, e->formula[0], &symbols);
    if (formula == NULL || !reads_path_alone(&names))
        return false;
    const double start = value_at(formula, &names, 0.0, 0.0), end = value_at(formula, &names, far, 0.0);
    r->damping = start - value_at(formula, &names, 0.0, 1.0);
    r->stiffness = start - value_at(formula, &names, 1.0, 0.0);
    r->rest[0] = r->rest[1] = r->stiffness > 0.0 ? start / r->stiffness : 0.0;
    if (is_rope(formula, &names, r))
        return r->stiffness > 0.0 || start == 0.0;
    r->stiffness = (end - value_at(formula, &names, 2.0 * far, 0.0)) / far;
    if (!(r->stiffness > 0.0))
        return false;
    r->rest[0] = start / r->stiffness;
    r->rest[1] = far + end / r->stiffness;
    return is_rope(formula, &names, r);
}

bool kt_export_take_rope(kt_export *x, const kt_effect *e) {
    rope_line r = {.stiffness = 0.0};
    if (e->type == KT_EFFECT_EXPRESSION && e->end_count == 2 && e->law == NULL) {
        if (!find_line(x, e, &r))
            return false;
    } else if (e->type == KT_EFFECT_SPRING && !e->initial_length) {
        r = (rope_line){e->stiffness, e->damping, {e->length, e->length}};
    } else {
        return false;
    }
    if (!(r.rest[0] >= 0.0 && r.rest[1] >= r.rest[0] && r.stiffness >= 0.0 && r.damping >= 0.0) ||
        !kt_export_add_rope(x, e))
        return false;
    kt_export_rope *rope = &x->ropes[x->rope_count - 1];
    rope->stiffness = r.stiffness;
    rope->damping = r.damping;
    memcpy(rope->rest, r.rest, sizeof r.rest);
    return true;
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
        if (rope->stiffness > 0.0) {
            kt_export_numbers(x, "stiffness", &rope->stiffness, 1);
            kt_export_numbers(x, "springlength", rope->rest, rope->rest[0] < rope->rest[1] ? 2 : 1);
        }
        kt_export_unless_zero(x, "damping", rope->damping);
        kt_export_unless_zero(x, "armature", rope->armature);
        kt_export_print(x, ">");
        for (int k = 0; k < count_points(rope->effect); k++) {
            const kt_path_point point = point_at(rope->effect, k);
            write_entry(x, i, k, &point);
        }
        kt_export_print(x, "</spatial>\n");
    }
}
