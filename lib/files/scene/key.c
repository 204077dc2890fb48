/* The kinds of keys that only loops and effects have: ends, joints, functions of time, frames. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/formula_names.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"
#include "scene/vary.h"

#include "base/copy.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* ---- words and distances ----------------------------------------------------------------------------------------- */

/* If the key is missing, the distance is the initial one, which is the default before reading. */
static bool read_distance(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    ((kt_effect *)object)->initial_length = false;
    return kt_put_number(r, scope, node, kt_key_quantity(r, field), kt_field_in(object, field));
}

static bool same_distance(const kt_member *m) { return ((const kt_effect *)m->object)->initial_length; }

static const char *const frame_names[] = {"world", "body"};
static const kt_choice frames = {"effects.frame", frame_names, 2, 0, NULL};

/* ---- ends -------------------------------------------------------------------------------------------------------- */

/* A body and its point are one end, but two keys. If the end has a marker, that is the point. */
static void write_end_body(kt_emitter *e, const kt_member *m) {
    kt_end end;
    memcpy(&end, kt_member_value(m), sizeof end);
    end.at = kt_vec3_make(0.0, 0.0, 0.0);
    kt_write_end(e, &end);
}

static bool read_end_body(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_end(r, scope, node, kt_field_in(object, field));
}

/* Reads a vector; or a marker, MARKER or BODY.MARKER, of the body that the other key has named. */
static bool read_end_point(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_end *on = &((kt_effect *)object)->between[0], point;
    (void)field;
    if (on->marker != NULL || on->at.x != 0.0 || on->at.y != 0.0 || on->at.z != 0.0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'on' gives the place already; leave one of them out");
    if (node->kind == KT_NODE_LIST)
        return kt_read_vector(r, scope, node, &on->at);
    if (node->kind != KT_NODE_TEXT || on->body == NULL)
        return kt_fault_expected(r, scope, node, "a list of three numbers, or a marker");
    if (!kt_read_end(r, scope, node, &point))
        return false;
    if (point.body == NULL || (point.marker != NULL && strcmp(point.body, on->body) != 0))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is not on %s; name a marker of that body",
                           kt_name_quote(node->of.text).text, kt_name_quote(on->body).text);
    on->marker = point.marker != NULL ? point.marker : point.body;
    return true;
}

static bool same_point(const kt_member *m) {
    return ((const kt_effect *)m->object)->between[0].marker != NULL ||
           kt_same_bits(kt_member_value(m), kt_member_standard(m), sizeof(kt_vec3));
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

static bool read_joint_name(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const char **joint = kt_field_in(object, field);
    if (!kt_read_name(r, scope, node, "a name", joint))
        return false;
    r->scene->joint_quantity = (int)kt_joint_quantity(r, *joint);
    return true;
}

static bool read_terms(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_loop *loop = object;
    (void)field;
    return kt_terms_read(r, scope, node, kt_put_number, &loop->terms, &loop->term_count);
}

/* With a formula the joints that it reads are terms, with coefficients of 0, which are not written. */
static bool is_written_term(const kt_loop *loop, int i) {
    const double coefficient = loop->terms[i].coefficient;
    return !kt_loop_has_formula(loop) || coefficient != 0.0 || signbit(coefficient);
}

static void write_coupling_terms(kt_emitter *e, const kt_member *m) {
    const kt_loop *loop = m->object;
    kt_emit_map(e, KT_EMIT_FLOW);
    for (int i = 0; i < loop->term_count; i++) {
        if (!is_written_term(loop, i))
            continue;
        kt_emit_name(e, loop->terms[i].joint);
        kt_emit_number(e, loop->terms[i].coefficient);
    }
    kt_emit_end(e);
}

static bool read_loop_name(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_name(r, scope, node, "the name of a loop", (const char **)kt_field_in(object, field));
}

static bool same_terms(const kt_member *m) {
    const kt_loop *loop = m->object;
    bool any = !kt_loop_has_formula(loop);
    for (int i = 0; i < loop->term_count; i++)
        any = any || is_written_term(loop, i);
    return !any;
}

/* The joints of one coordinate that a formula reads. */
typedef struct joint_names {
    kt_reader *r;
    const kt_description *description;
    const char *joint[KT_FORMULA_VARIABLE_MAX + 1];
    int count;
    kt_formula_names all; /* of which others are suggested */
} joint_names;

/* Coordinates of joints with several have brackets in their names. */
static bool find_joint_symbol(void *user, const char *name, kt_symbol *symbol) {
    joint_names *names = user;
    kt_variable found;
    int k = 0;
    if (strchr(name, '[') != NULL || !kt_variable_find(names->description, name, &found) ||
        found.type != KT_VARIABLE_POSITION)
        return false;
    const char *joint = kt_joint_name_of(&names->description->bodies[found.body]);
    while (k < names->count && strcmp(names->joint[k], joint) != 0)
        k++;
    if (k == names->count && k <= KT_FORMULA_VARIABLE_MAX)
        names->joint[names->count++] = joint;
    *symbol = (kt_symbol){.index = k};
    return true;
}

/* No name is suggested once the effort for suggestions is used up. */
static const char *list_joint(void *user, int k) {
    joint_names *names = user;
    const kt_symbols symbols = kt_formula_symbols(&names->all);
    const char *name;
    for (int i = 0; (name = symbols.list(symbols.user, i)) != NULL && names->r->effort > 0; i++) {
        names->r->effort -= 100;
        if (kt_position_of_joint(name) != NULL && strchr(name, '[') == NULL && k-- == 0)
            return name;
    }
    return NULL;
}

static bool has_term(const kt_loop *loop, const char *joint) {
    for (int i = 0; i < loop->term_count; i++)
        if (loop->terms[i].joint != NULL && strcmp(loop->terms[i].joint, joint) == 0)
            return true;
    return false;
}

/* The joints that the formula reads become terms. */
static bool add_formula_terms(kt_reader *r, const joint_names *names, kt_loop *loop) {
    kt_term *terms = kt_pool_take(&r->keep, (size_t)(loop->term_count + names->count) + 1, sizeof *terms);
    if (terms == NULL)
        return kt_reader_out_of_memory(r);
    kt_copy(terms, loop->terms, (size_t)loop->term_count * sizeof *terms);
    loop->terms = terms;
    for (int i = 0; i < names->count; i++)
        if (!has_term(loop, names->joint[i]))
            terms[loop->term_count++] = (kt_term){.joint = names->joint[i], .coefficient = 0.0};
    return true;
}

/* Sets whether the offset of a coupling by a formula is an angle (with the unit deg) or a number. It is an angle if one
 * of the joints that the formula reads turns. For a coupling by coefficients, their reader decides. */
static void set_quantity(kt_reader *r, const joint_names *names) {
    r->scene->joint_quantity = KT_QUANTITY_NUMBER;
    for (int i = 0; i < names->count; i++)
        if (kt_joint_quantity(r, names->joint[i]) == KT_QUANTITY_ANGLE)
            r->scene->joint_quantity = KT_QUANTITY_ANGLE;
}

/* The coefficients have been read before, the offset is read behind. */
static bool read_coupling(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    if (node->kind != KT_NODE_TEXT)
        return kt_fault_expected(r, scope, node, "a formula (\"position.follower - 0.2*position.cam^2\")");
    if (!kt_variables_are_known(r)) {
        node->faulty = true; /* a fault of the bodies has been reported */
        return false;
    }
    const kt_effect none = {.end_count = 0};
    joint_names names = {
        .r = r, .description = r->scene->description, .all = kt_formula_names_of(r->scene->description, &none)};
    const kt_symbols symbols = {.find = find_joint_symbol, .list = list_joint, .user = &names};
    if (!kt_read_formula(r, scope, node, &symbols, true, kt_field_in(object, field)))
        return false;
    if (names.count == 0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "the formula reads no joint; write position.JOINT");
    if (((const kt_loop *)object)->term_count == 0)
        set_quantity(r, &names);
    return add_formula_terms(r, &names, object);
}

/* ---- functions of time ------------------------------------------------------------------------------------------- */

/* Reads a function in the unit of its key to `out`, which belongs to the description. Therefore a constant may be bound
 * to a parameter of the scene: the number at this place follows later changes of the parameter. */
static bool put_function_at(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                            kt_function *out) {
    r->scene->unit = kt_key_unit(r, field);
    const bool good = kt_read_function(r, scope, node, kt_key_quantity(r, field), out);
    r->scene->unit = NULL;
    if (!good)
        return false;
    if (out->type == KT_FUNCTION_CONSTANT)
        (void)kt_number_follows(r, node, false, &out->value);
    return true;
}

static bool read_function(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return put_function_at(r, scope, node, field, kt_field_in(object, field));
}

static void write_function(kt_emitter *e, const kt_member *m) { kt_write_function(e, kt_member_value(m)); }

static bool read_function_list(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                               void *object) {
    kt_function *functions = kt_field_in(object, field);
    if (node->kind != KT_NODE_LIST || node->count != 3)
        return kt_fault_expected(r, scope, node, "a list of three numbers or functions of time");
    bool good = true;
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        good = put_function_at(r, &here, item, field, &functions[here.index]) && good;
    return good;
}

static void write_functions(kt_emitter *e, const kt_member *m) {
    const kt_function *functions = kt_member_value(m);
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < 3; i++)
        kt_write_function(e, &functions[i]);
    kt_emit_end(e);
}

/* ---- formulas of effects ----------------------------------------------------------------------------------------- */

static bool read_effect_formula(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_effect *effect,
                                const char **text) {
    if (node->kind != KT_NODE_TEXT)
        return kt_fault_expected(r, scope, node, "a formula");
    if (!kt_variables_are_known(r)) {
        node->faulty = true; /* a fault of the bodies or states has been reported */
        return false;
    }
    kt_formula_names names = kt_formula_names_of(r->scene->description, effect);
    const kt_symbols symbols = kt_formula_symbols(&names);
    return kt_read_formula(r, scope, node, &symbols, false, text);
}

/* One formula, or a list of three. */
static bool read_formulas(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const char **formulas = kt_field_in(object, field);
    kt_scope here = {.outer = scope};
    bool good = true;
    if (node->kind != KT_NODE_LIST)
        return read_effect_formula(r, scope, node, object, formulas);
    if (node->count != 3)
        return kt_fault_expected(r, scope, node, "a formula, or a list of three");
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        good = read_effect_formula(r, &here, item, object, &formulas[here.index]) && good;
    return good;
}

static void write_formulas(kt_emitter *e, const kt_member *m) {
    const char *const *formulas = kt_member_value(m);
    if (((const kt_effect *)m->object)->end_count != 1) {
        kt_emit_text(e, formulas[0]);
        return;
    }
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < 3; i++)
        kt_emit_text(e, formulas[i] != NULL ? formulas[i] : "0*t");
    kt_emit_end(e);
}

static bool same_formulas(const kt_member *m) {
    const char *const *formulas = kt_member_value(m);
    return formulas[0] == NULL && formulas[1] == NULL && formulas[2] == NULL;
}

/* A bound is that of actuators, and is ignored without them. */
static bool read_bound(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_put_number(r, scope, node, KT_QUANTITY_NUMBER, kt_field_in(object, field));
}

static bool same_bound(const kt_member *m) {
    return ((const kt_effect *)m->object)->actuators == NULL ||
           kt_same_bits(kt_member_value(m), kt_member_standard(m), sizeof(double));
}

/* ---- all kinds --------------------------------------------------------------------------------------------------- */

/* An expression acts at one of three places: two ends, one end, or a joint. */
static bool same_ends(const kt_member *m) {
    const kt_effect *effect = m->object;
    return effect->end_count != 2 || effect->path_count > 0;
}
static bool same_end(const kt_member *m) { return ((const kt_effect *)m->object)->end_count != 1; }
static bool same_joint_name(const kt_member *m) {
    const kt_effect *effect = m->object;
    return effect->joint == NULL || effect->end_count != 0;
}

const kt_kind *kt_kind_of_item_key(const kt_key *key) {
    static const kt_kind distance = {
        .read = read_distance, .write = kt_kind_numbers_write, .same = same_distance, .size = sizeof(double)};
    static const kt_kind frame = {
        .read = kt_word_read, .write = kt_word_write, .size = sizeof(kt_frame), .detail = &frames};
    static const kt_kind body = {.read = read_end_body, .write = write_end_body};
    static const kt_kind point = {
        .read = read_end_point, .write = kt_kind_numbers_write, .same = same_point, .size = sizeof(kt_vec3)};
    static const kt_kind joint = {.read = read_joint_name, .write = kt_text_write};
    static const kt_kind terms = {.read = read_terms, .write = write_coupling_terms, .same = same_terms};
    static const kt_kind bound = {
        .read = read_bound, .write = kt_kind_numbers_write, .same = same_bound, .size = sizeof(double)};
    static const kt_kind loop = {.read = read_loop_name, .write = kt_text_write, .size = sizeof(char *)};
    static const kt_kind coupling = {.read = read_coupling, .write = kt_text_write, .size = sizeof(char *)};
    static const kt_kind function = {.read = read_function, .write = write_function, .size = sizeof(kt_function_type)};
    static const kt_kind formulas = {.read = read_formulas, .write = write_formulas, .same = same_formulas};
    static const kt_kind functions = {
        .read = read_function_list, .write = write_functions, .size = sizeof(kt_function_type)};
    static const kt_kind *const kinds[KT_KEY_KIND_COUNT] = {
        [KT_KEY_FRAME] = &frame,
        [KT_KEY_END] = &kt_kind_end,
        [KT_KEY_ENDS] = &kt_kind_ends,
        [KT_KEY_BODY] = &body,
        [KT_KEY_POINT] = &point,
        [KT_KEY_JOINT] = &joint,
        [KT_KEY_TERMS] = &terms,
        [KT_KEY_FUNCTION] = &function,
        [KT_KEY_FUNCTIONS] = &functions,
        [KT_KEY_DISTANCE] = &distance,
        [KT_KEY_SURFACE] = &kt_kind_surface,
        [KT_KEY_TRACK] = &kt_kind_track,
        [KT_KEY_FORMULA] = &coupling,
        [KT_KEY_FORMULAS] = &formulas,
        [KT_KEY_PATH] = &kt_kind_path,
        [KT_KEY_ACTUATORS] = &kt_kind_actuators,
        [KT_KEY_SPRING] = &kt_kind_spring,
        [KT_KEY_BOUND] = &bound,
        [KT_KEY_LOOP] = &loop,
    };
    static const kt_kind optional_ends = {.read = kt_kind_ends_read, .write = kt_kind_ends_write, .same = same_ends};
    static const kt_kind optional_end = {.read = kt_kind_end_read, .write = kt_kind_end_write, .same = same_end};
    static const kt_kind optional_joint = {.read = read_joint_name, .write = kt_text_write, .same = same_joint_name};
    if (!key->needed && key->kind == KT_KEY_ENDS)
        return &optional_ends;
    if (!key->needed && key->kind == KT_KEY_END)
        return &optional_end;
    if (!key->needed && key->kind == KT_KEY_JOINT)
        return &optional_joint;
    return kinds[key->kind] != NULL ? kinds[key->kind] : kt_kind_of_value_key(key);
}
