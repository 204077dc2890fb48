/* The armature of a spatial tendon, as an import makes it (mjcf_length.c): a slider without mass whose position is the
 * length of a path, a coupling
 *     s - sum_i sqrt(x_i^2 + y_i^2 + z_i^2) / n_i = constant,
 * and for each part of the path three sliders without mass whose end a spherical loop keeps at the next point. A
 * formula counts as that sum if both agree at some positions. Such bodies and loops are removed from the
 * description, and the path becomes a rope. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/formula_names.h"
#include "model/joint_name.h"
#include "robot/write.h"

#include "kinetree/effect.h"

#include <math.h>
#include <string.h>

enum { PARTS = (KT_FORMULA_VARIABLE_MAX - 1) / 3 };

/* The parts of one length that were found: indices of bodies and loops. */
typedef struct found_length {
    int slider, coupling, count;
    int sliders[3 * PARTS], loops[PARTS];
    double factor[PARTS]; /* 1 / n_i */
} found_length;

static int find_by_joint(const kt_export *x, const char *joint) {
    for (int i = 0; i < x->d->body_count; i++)
        if (strcmp(kt_joint_name_of(kt_export_body(x, i)), joint) == 0)
            return i;
    return -1;
}

static bool is_zero_vector(kt_vec3 v) { return kt_vec3_norm(v) == 0.0; }

/* A slider without mass, shape and markers, along an axis of its parent. */
static bool is_plain_slider(const kt_body *b, int axis) {
    const kt_vec3 unit = kt_vec3_make(axis == 0, axis == 1, axis == 2);
    const kt_mat3 turn = kt_mat3_of_rotation(&b->joint.rotation);
    return b->joint.type == KT_JOINT_PRISMATIC && b->mass == 0.0 && b->variable_mass == NULL &&
           b->shape.type == KT_SHAPE_NONE && b->shape_count == 0 && b->marker_count == 0 &&
           is_zero_vector(kt_vec3_sub(b->joint.axis, unit)) &&
           is_zero_vector(kt_vec3_sub(turn.x, kt_vec3_make(1, 0, 0))) &&
           is_zero_vector(kt_vec3_sub(turn.y, kt_vec3_make(0, 1, 0)));
}

/* How often bodies and joints are referred to. */
static int count_ends(const kt_export *x, const char *body) {
    int count = 0;
    for (int i = 0; i < x->d->loop_count; i++)
        for (int k = 0; k < 2; k++)
            count += kt_text_is(x->d->loops[i].between[k].body, body);
    for (int i = 0; i < x->d->effect_count; i++) {
        for (int k = 0; k < 2; k++)
            count += kt_text_is(x->d->effects[i].between[k].body, body);
        for (int k = 0; k < x->d->effects[i].path_count; k++)
            count += kt_text_is(x->d->effects[i].path[k].end.body, body);
    }
    for (int i = 0; i < x->d->body_count; i++)
        count += kt_text_is(kt_export_body(x, i)->parent, body);
    return count;
}

static int count_drives(const kt_export *x, const char *joint) {
    int count = 0;
    for (int i = 0; i < x->d->effect_count; i++)
        count += kt_text_is(x->d->effects[i].joint, joint);
    for (int i = 0; i < x->d->loop_count; i++)
        for (int k = 0; k < x->d->loops[i].term_count; k++)
            count += kt_text_is(x->d->loops[i].terms[k].joint, joint);
    return count;
}

/* The spherical loop at the end of three sliders, one on another; -1: they have another form. */
static int find_loop_of_part(const kt_export *x, const int sliders[3]) {
    int found = -1;
    for (int k = 0; k < 3; k++) {
        const kt_body *b = sliders[k] >= 0 ? kt_export_body(x, sliders[k]) : NULL;
        if (b == NULL || !is_plain_slider(b, k) || b->joint.armature[0] != 0.0 || count_ends(x, b->name) != 1 ||
            count_drives(x, kt_joint_name_of(b)) != 1 ||
            (k > 0 &&
             (!kt_text_is(b->parent, kt_export_body(x, sliders[k - 1])->name) || !is_zero_vector(b->joint.at))))
            return -1;
    }
    for (int i = 0; i < x->d->loop_count; i++) {
        const kt_loop *loop = &x->d->loops[i];
        if (loop->type == KT_LOOP_SPHERICAL && loop->switching == KT_ALWAYS_ON &&
            kt_text_is(loop->between[0].body, kt_export_body(x, sliders[2])->name) && loop->between[0].marker == NULL &&
            is_zero_vector(loop->between[0].at))
            found = i;
    }
    return found;
}

/* Whether the formula is - sum_i factor_i |d_i|; finds the factors. The slider is the first variable. */
static bool fit_length(kt_export *x, const kt_loop *loop, found_length *f) {
    static const double numbers[] = {0.3, -1.2, 0.7, 2.1, -0.4, 1.6, 0.9};
    kt_coupling_names names = {.description = x->d, .loop = loop};
    const kt_symbols symbols = kt_coupling_symbols(&names);
    const kt_expression *formula = kt_export_parse(x, loop->formula, &symbols);
    double at[KT_FORMULA_VARIABLE_MAX];
    if (formula == NULL)
        return false;
    for (int i = 0; i < f->count; i++) {
        memset(at, 0, sizeof at);
        at[1 + 3 * i] = 1.0;
        f->factor[i] = -kt_expression_evaluate(formula, at);
        if (!(f->factor[i] > 0.0))
            return false;
    }
    for (int n = 0; n < 20; n++) {
        double sum = 0.0;
        at[0] = numbers[n % 7];
        for (int i = 0; i < f->count; i++) {
            double square = 0.0;
            for (int k = 0; k < 3; k++) {
                const double d = numbers[(n + i + 2 * k + n * k) % 7];
                at[1 + 3 * i + k] = d;
                square += d * d;
            }
            sum += f->factor[i] * sqrt(square);
        }
        if (!(fabs(kt_expression_evaluate(formula, at) + sum) <= 1e-12 * sum))
            return false;
    }
    return true;
}

static bool find_armature_path(kt_export *x, int coupling, found_length *f) {
    const kt_loop *loop = &x->d->loops[coupling];
    *f = (found_length){.coupling = coupling, .count = (loop->term_count - 1) / 3};
    if (loop->type != KT_LOOP_COUPLING || loop->switching != KT_ALWAYS_ON || loop->formula == NULL ||
        loop->term_count % 3 != 1 || f->count < 1 || loop->terms[0].coefficient != 1.0)
        return false;
    f->slider = find_by_joint(x, loop->terms[0].joint);
    const kt_body *slider = f->slider >= 0 ? kt_export_body(x, f->slider) : NULL;
    if (slider == NULL || slider->parent != NULL || !is_plain_slider(slider, 2) || count_ends(x, slider->name) != 0 ||
        count_drives(x, kt_joint_name_of(slider)) != 1)
        return false;
    for (int i = 0; i < f->count; i++) {
        for (int k = 0; k < 3; k++) {
            f->sliders[3 * i + k] = find_by_joint(x, loop->terms[1 + 3 * i + k].joint);
            if (loop->terms[1 + 3 * i + k].coefficient != 0.0)
                return false;
        }
        f->loops[i] = find_loop_of_part(x, f->sliders + 3 * i);
        if (f->loops[i] < 0)
            return false;
    }
    return fit_length(x, loop, f) && f->factor[0] == 1.0;
}

/* ---- the path ---------------------------------------------------------------------------------------------------- */

static bool is_same_end(const kt_end *a, const kt_end *b) {
    return (a->body == b->body || kt_text_is(a->body, b->body)) && is_zero_vector(kt_vec3_sub(a->at, b->at));
}

/* An end without its marker. */
static kt_end plain_end(const kt_export *x, const kt_end *end) {
    kt_end plain = kt_end_default();
    plain.body = kt_text_is(end->body, "world") ? NULL : end->body;
    plain.at = end->at;
    for (int i = 0; i < x->d->body_count && end->marker != NULL; i++)
        for (int k = 0; k < kt_export_body(x, i)->marker_count; k++)
            if (kt_text_is(kt_export_body(x, i)->name, end->body) &&
                kt_text_is(kt_export_body(x, i)->markers[k].name, end->marker))
                plain.at = kt_export_body(x, i)->markers[k].at;
    return plain;
}

/* The path as an effect without a force. */
static kt_effect *make_armature_path(kt_export *x, const found_length *f) {
    kt_effect *e = kt_pool_take(&x->pool, 1, sizeof *e);
    kt_path_point *path = kt_pool_take(&x->pool, 2 * (size_t)f->count, sizeof *path);
    if (e == NULL || path == NULL)
        return NULL;
    *e = kt_effect_default();
    e->name = kt_joint_name_of(kt_export_body(x, f->slider));
    for (int i = 0; i < x->d->effect_count; i++) /* a tendon of springs and dampers has the name */
        e->name = kt_text_is(x->d->effects[i].name, e->name) ? NULL : e->name;
    e->end_count = 2;
    e->path = path;
    for (int i = 0; i < f->count; i++) {
        const kt_body *first = kt_export_body(x, f->sliders[3 * i]);
        kt_end from = kt_end_default();
        from.body = kt_text_is(first->parent, "world") ? NULL : first->parent;
        from.at = first->joint.at;
        const bool goes_on =
            i > 0 && f->factor[i] == f->factor[i - 1] && is_same_end(&from, &path[e->path_count - 1].end);
        if (!goes_on)
            path[e->path_count++] = (kt_path_point){.end = from, .divisor = i > 0 ? 1.0 / f->factor[i] : 0.0};
        path[e->path_count++] = (kt_path_point){.end = plain_end(x, &x->d->loops[f->loops[i]].between[1])};
    }
    return e;
}

/* Removes marked bodies and loops. */
static bool remove_marked(kt_export *x, const bool *body, const bool *loop) {
    kt_description *d = kt_pool_take(&x->pool, 1, sizeof *d);
    kt_body *bodies = kt_pool_take(&x->pool, (size_t)x->d->body_count + 1, sizeof *bodies);
    kt_loop *loops = kt_pool_take(&x->pool, (size_t)x->d->loop_count + 1, sizeof *loops);
    if (d == NULL || bodies == NULL || loops == NULL)
        return false;
    *d = *x->d;
    d->body_count = d->loop_count = 0;
    for (int i = 0; i < x->d->body_count; i++)
        if (!body[i])
            bodies[d->body_count++] = x->d->bodies[i];
    for (int i = 0; i < x->d->loop_count; i++)
        if (!loop[i])
            loops[d->loop_count++] = x->d->loops[i];
    d->bodies = bodies;
    d->loops = loops;
    x->d = d;
    return true;
}

bool kt_export_take_lengths(kt_export *x) {
    bool *body = kt_pool_take(&x->pool, (size_t)x->d->body_count + 1, sizeof *body);
    bool *loop = kt_pool_take(&x->pool, (size_t)x->d->loop_count + 1, sizeof *loop);
    x->lengths = kt_pool_take(&x->pool, (size_t)x->d->loop_count + 1, sizeof *x->lengths);
    if (body == NULL || loop == NULL || x->lengths == NULL)
        return false;
    for (int i = 0; i < x->d->loop_count; i++) {
        found_length f;
        if (!find_armature_path(x, i, &f))
            continue;
        kt_effect *path = make_armature_path(x, &f);
        if (path == NULL)
            return false;
        x->lengths[x->length_count++] =
            (kt_export_rope){.effect = path, .armature = kt_export_body(x, f.slider)->joint.armature[0]};
        body[f.slider] = loop[f.coupling] = true;
        for (int k = 0; k < f.count; k++) {
            loop[f.loops[k]] = true;
            for (int n = 0; n < 3; n++)
                body[f.sliders[3 * k + n]] = true;
        }
    }
    return x->length_count == 0 || remove_marked(x, body, loop);
}
