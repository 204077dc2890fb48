/* Parameters (kinetree/model.h): finding them by name, and setting them in copies of a model.
 *
 * Since a copy is a model like any other, setting a number means writing it to the position at which the compiler would
 * write it. The recursions read bodies by way of their links, whose inertias are summed again; a planar link is
 * projected again.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"
#include "compile/find_planar.h"
#include "dynamics/dynamics.h"
#include "effect/effect.h"
#include "joint/joint.h"
#include "kinetree/descriptor.h"
#include "model/parameter_key.h"
#include "model/switching.h"

#include <stdio.h>
#include <string.h>

/* ---- numbers of effects ------------------------------------------------------------------------------------------ */

/* Returns the address of a number of kt_effect in its record. */
static double *effect_number_of(kt_effect_record *r, const kt_key *key) {
#define PARAMETER_NUMBER(member)                                                                                       \
    if (key->offset == offsetof(kt_effect, member))                                                                    \
        return &r->member;
    KT_EFFECT_NUMBERS(PARAMETER_NUMBER)
#undef PARAMETER_NUMBER
    if (key->offset == offsetof(kt_effect, quadratics))
        return r->quadratics;
    return key->offset == offsetof(kt_effect, stiffnesses) ? r->stiffnesses : r->dampings;
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* A name in parts: "effect " or "loop " or nothing, an item, a key; the texts are cut to fit. */
typedef struct parts {
    bool effect, loop;
    char item[128], key[64];
} parts;

/* Rejects a path of a scene file, "bodies.rod.mass", with the name of the parameter, "rod.mass". Names of items have no
 * points. Returns KT_OK for other names. */
static kt_status reject_scene_path(const char *name, kt_error *error) {
    static const char *const sections[][2] = {{"bodies.", ""}, {"effects.", "effect "}, {"loops.", "loop "}};
    for (int i = 0; i < 3; i++) {
        const size_t length = strlen(sections[i][0]);
        if (strncmp(name, sections[i][0], length) != 0 || strchr(name + length, '.') == NULL)
            continue;
        return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter",
                            "%s is a path in a scene file; did you mean '%s%.60s'?", kt_name_quote(name).text,
                            sections[i][1], name + length);
    }
    return KT_OK;
}

/* Splits "[effect |loop ]ITEM.KEY" at the last point. */
static kt_status split_parameter_name(const char *name, parts *p, kt_error *error) {
    const char *rest = name;
    *p = (parts){.effect = strncmp(name, "effect ", 7) == 0, .loop = strncmp(name, "loop ", 5) == 0};
    rest += p->effect ? 7 : p->loop ? 5 : 0;
    const char *point = strrchr(rest, '.');
    if (!point || (size_t)(point - rest) >= sizeof p->item || strlen(point + 1) >= sizeof p->key)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "parameter",
            "%s is not the name of a parameter; write gravity, BODY.mass, effect NAME.stiffness or loop NAME.position",
            kt_name_quote(name).text);
    memcpy(p->item, rest, (size_t)(point - rest));
    memcpy(p->key, point + 1, strlen(point + 1));
    return KT_OK;
}

static const char *effect_name_at(const kt_model *m, size_t i) {
    return m->effect[i].name ? m->text + m->effect[i].name : NULL;
}
static const char *loop_name(const kt_model *m, size_t i) { return m->text + m->loop[i].name; }
static const char *body_name(const kt_model *m, size_t i) { return i ? m->text + m->body[i].name : NULL; }

/* The index of a name among `count` names name_of(m, 0), ...; or -1 after an error with the nearest name. Items whose
 * name is NULL cannot be found. */
static int find_item(const kt_model *m, const char *what, const char *name,
                     const char *(*name_of)(const kt_model *m, size_t i), size_t count, kt_error *error) {
    for (size_t i = 0; i < count; i++)
        if (name_of(m, i) && strcmp(name_of(m, i), name) == 0)
            return (int)i;
    kt_nearest search = kt_nearest_make(name, NULL);
    for (size_t i = 0; i < count; i++)
        if (!kt_nearest_try(&search, name_of(m, i)))
            break;
    if (search.best)
        (void)kt_error_set(error, KT_ERROR_ARGUMENT, "parameter", "there is no %s %s; did you mean %s?", what,
                           kt_name_quote(name).text, kt_name_quote(search.best).text);
    else
        (void)kt_error_set(error, KT_ERROR_ARGUMENT, "parameter", "there is no %s %s", what, kt_name_quote(name).text);
    return -1;
}

static const char *const body_keys[] = {"mass", "com", "inertia", "armature", "hold"};

/* How many numbers a parameter of a body has. */
static int parameter_count_of(const kt_model *m, int body, kt_parameter_kind kind) {
    const int counts[] = {1, 3, 6, kt_joint_sizes[m->body[body].type].nv, 1};
    return counts[kind - KT_PARAMETER_MASS];
}

static kt_status reject_key(const char *what, const parts *p, const kt_nearest *search, kt_error *error) {
    if (search->best)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter", "%s %s has no parameter %s; did you mean %s?", what,
                            kt_name_quote(p->item).text, kt_name_quote(p->key).text, kt_name_quote(search->best).text);
    return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter", "%s %s has no parameter %s", what,
                        kt_name_quote(p->item).text, kt_name_quote(p->key).text);
}

/* Finds BODY.KEY. An armature exists only if the joint has coordinates. */
static kt_status find_of_body(const kt_model *m, const parts *p, kt_parameter *parameter, kt_error *error) {
    const int body = kt_body_find(m, p->item);
    if (body <= 0) {
        (void)find_item(m, "body", p->item, body_name, m->n.body, error);
        return KT_ERROR_ARGUMENT;
    }
    kt_nearest search = kt_nearest_make(p->key, NULL);
    for (int k = 0; k < 5; k++) {
        const kt_parameter_kind kind = (kt_parameter_kind)(KT_PARAMETER_MASS + k);
        const int count = parameter_count_of(m, body, kind);
        if (strcmp(p->key, body_keys[k]) == 0 && count > 0) {
            *parameter = (kt_parameter){.kind = kind, .item = body, .count = count};
            return KT_OK;
        }
        (void)kt_nearest_try(&search, count > 0 ? body_keys[k] : NULL);
    }
    return reject_key("body", p, &search, error);
}

/* The key of the place of a loop's end on the world. */
static const char place[] = "place";

/* Whether a number of an effect can change. Loops are in the place of a hard effect, and their numbers are fixed. Only
 * the coefficient of friction is a number of the effect: a contact with friction has a second loop, which sticks.
 * Friction of a joint that was compiled without a load has no place for the load. */
static bool has_effect_parameter(const kt_effect_record *effect, const kt_key *key) {
    const bool is_coefficient = key->offset == offsetof(kt_effect, friction);
    if (effect->hard)
        return is_coefficient && effect->type == KT_EFFECT_CONTACT && effect->loops == 2;
    return effect->type != KT_EFFECT_JOINT_FRICTION || effect->load_slot > 0 ||
           !(is_coefficient || key->offset == offsetof(kt_effect, efficiency));
}

/* Rejects a number of an effect that cannot change. */
static kt_status reject_fixed(const kt_effect_record *effect, const parts *p, kt_error *error) {
    if (effect->hard && !(effect->type == KT_EFFECT_CONTACT && strcmp(p->key, "friction") == 0))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter",
                            "effect %s is hard: loops are in its place, whose numbers are fixed, except the friction "
                            "of a contact",
                            kt_name_quote(p->item).text);
    return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter",
                        "effect %s was compiled without %s, and has no equations for it; compile the description with "
                        "such friction",
                        kt_name_quote(p->item).text, effect->hard ? "friction" : "friction from a load");
}

/* Finds "loop NAME.KEY" or "effect NAME.KEY": by the keys of the item's type, or the place of a loop's end. */
static kt_status find_of_type(const kt_model *m, const parts *p, kt_parameter *parameter, kt_error *error) {
    const char *what = p->loop ? "loop" : "effect";
    const size_t count = p->loop ? m->n.loop : m->n.effect + m->n.effect_off;
    const int item = find_item(m, what, p->item, p->loop ? loop_name : effect_name_at, count, error);
    if (item < 0)
        return KT_ERROR_ARGUMENT;
    if (p->loop && strcmp(p->key, place) == 0 && kt_loop_movable_end(&m->loop[item]) >= 0) {
        *parameter = (kt_parameter){.kind = KT_PARAMETER_LOOP_PLACE, .item = item, .count = KT_PLACE_COUNT};
        return KT_OK;
    }
    const kt_descriptor *d = p->loop ? kt_loop_descriptor((kt_loop_type)m->loop[item].type)
                                     : kt_effect_descriptor((kt_effect_type)m->effect[item].type);
    kt_nearest search = kt_nearest_make(p->key, NULL);
    for (int k = 0; d && k < d->key_count; k++) {
        const kt_key *key = &d->keys[k];
        kt_parameter found = {.item = item};
        if (!kt_parameter_classify(key, p->loop, &found) || (p->loop && m->loop[item].curve.type == KT_FUNCTION_NONE))
            continue; /* no number, or the arc length of a curve that is free */
        if (strcmp(key->name, p->key) == 0 || (key->also && strcmp(key->also, p->key) == 0)) {
            if (!p->loop && !has_effect_parameter(&m->effect[item], key))
                return reject_fixed(&m->effect[item], p, error);
            *parameter = found;
            return KT_OK;
        }
        (void)kt_nearest_try(&search, key->name);
    }
    if (!p->loop && m->effect[item].hard)
        return reject_fixed(&m->effect[item], p, error);
    (void)kt_nearest_try(&search, p->loop && kt_loop_movable_end(&m->loop[item]) >= 0 ? place : NULL);
    return reject_key(what, p, &search, error);
}

kt_status kt_parameter_find(const kt_model *model, const char *name, kt_parameter *parameter, kt_error *error) {
    if (KT_IS_MISSING(error, model, name, parameter))
        return KT_ERROR_ARGUMENT;
    parts p;
    if (strcmp(name, "gravity") == 0) {
        *parameter = (kt_parameter){.kind = KT_PARAMETER_GRAVITY, .count = 3};
        return KT_OK;
    }
    kt_status status = reject_scene_path(name, error);
    if (status == KT_OK)
        status = split_parameter_name(name, &p, error);
    if (status != KT_OK)
        return status;
    return p.effect || p.loop ? find_of_type(model, &p, parameter, error) : find_of_body(model, &p, parameter, error);
}

/* ---- whose it is ------------------------------------------------------------------------------------------------- */

/* Whether a key of this descriptor, of a loop or of an effect, gives the parameter. */
static bool has_parameter_key(const kt_descriptor *d, bool of_loop, const kt_parameter *parameter) {
    kt_parameter found;
    for (int k = 0; d && k < d->key_count; k++)
        if (parameter->key == &d->keys[k])
            return kt_parameter_classify(parameter->key, of_loop, &found) && found.kind == parameter->kind &&
                   found.count == parameter->count;
    return false;
}

/* Whether a parameter, which the caller may have filled, is one of this model: an index in range, a key of the item's
 * type, and its count of numbers. */
static bool belongs(const kt_model *m, const kt_parameter *parameter) {
    const int item = parameter->item;
    switch (parameter->kind) {
    case KT_PARAMETER_GRAVITY:
        return parameter->count == 3;
    case KT_PARAMETER_MASS:
    case KT_PARAMETER_COM:
    case KT_PARAMETER_INERTIA:
    case KT_PARAMETER_ARMATURE:
    case KT_PARAMETER_HOLD:
        return item > 0 && KT_IS_INDEX(item, m->n.body) && parameter->count > 0 &&
               parameter->count == parameter_count_of(m, item, parameter->kind);
    case KT_PARAMETER_EFFECT:
    case KT_PARAMETER_EFFECT_CURVE:
    case KT_PARAMETER_EFFECT_VALUE:
        return KT_IS_INDEX(item, m->n.effect + m->n.effect_off) &&
               has_parameter_key(kt_effect_descriptor((kt_effect_type)m->effect[item].type), false, parameter) &&
               has_effect_parameter(&m->effect[item], parameter->key);
    case KT_PARAMETER_LOOP_CURVE:
        return KT_IS_INDEX(item, m->n.loop) &&
               has_parameter_key(kt_loop_descriptor((kt_loop_type)m->loop[item].type), true, parameter);
    case KT_PARAMETER_LOOP_PLACE:
        return KT_IS_INDEX(item, m->n.loop) && kt_loop_movable_end(&m->loop[item]) >= 0 &&
               parameter->count == KT_PLACE_COUNT;
    }
    return false;
}

kt_status kt_parameter_require(const kt_model *model, const kt_parameter *parameter, kt_error *error) {
    if (belongs(model, parameter))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter",
                        "it does not belong to this model; find the parameter by its name (kt_parameter_find)");
}

/* ---- present numbers --------------------------------------------------------------------------------------------- */

/* The numbers of a function of time as a parameter: y, y', y'' and the time to which they belong (KT_CURVE_FOLLOWS), or
 * its values at t = 0 if it has not been set. */
static void get_curve(const kt_model *m, const kt_curve *curve, double *values) {
    const bool set = kt_curve_follows(curve);
    if (!set)
        kt_curve_evaluate(curve, m->number, 0.0, values);
    else
        memcpy(values, (const double[]){curve->a, curve->b, curve->c}, 3 * sizeof *values);
    values[3] = set ? curve->d : 0.0;
}

/* Reads the numbers that kt_parameter_put writes. A massless coordinate has an armature of 1 for the recursion
 * (massless.c), but none of its own. */
static void get_parameter(const kt_model *model, const kt_parameter *parameter, double *values) {
    const kt_body_record *body = &model->body[parameter->kind <= KT_PARAMETER_HOLD ? parameter->item : 0];
    const kt_sym3 *j = &body->inertia;
    switch (parameter->kind) {
    case KT_PARAMETER_GRAVITY:
        memcpy(values, (const double[]){model->gravity[0], model->gravity[1], model->gravity[2]}, 3 * sizeof *values);
        break;
    case KT_PARAMETER_MASS:
        values[0] = body->mass;
        break;
    case KT_PARAMETER_COM:
        memcpy(values, (const double[]){body->com.x, body->com.y, body->com.z}, 3 * sizeof *values);
        break;
    case KT_PARAMETER_INERTIA:
        memcpy(values, (const double[]){j->xx, j->yy, j->zz, j->xy, j->xz, j->yz}, 6 * sizeof *values);
        break;
    case KT_PARAMETER_ARMATURE:
        for (int k = 0; k < parameter->count; k++)
            values[k] = kt_is_massless(model, (size_t)body->v + (size_t)k) ? 0.0 : model->armature[body->v + k];
        break;
    case KT_PARAMETER_HOLD:
        values[0] = 0.0;
        for (int k = 0; k < kt_joint_sizes[body->type].nv; k++)
            if (model->held[body->v + k] || model->held_velocity[body->v + k])
                values[0] = 1.0;
        break;
    case KT_PARAMETER_EFFECT:
        memcpy(values, effect_number_of(&model->effect[parameter->item], parameter->key),
               (size_t)parameter->count * sizeof *values);
        break;
    case KT_PARAMETER_EFFECT_CURVE:
        get_curve(model, &model->effect[parameter->item].curve[0], values);
        break;
    case KT_PARAMETER_EFFECT_VALUE:
        for (int k = 0; k < 3; k++) {
            double now[3];
            kt_curve_evaluate(&model->effect[parameter->item].curve[k], model->number, 0.0, now);
            values[k] = now[0];
        }
        break;
    case KT_PARAMETER_LOOP_CURVE:
        get_curve(model, &model->loop[parameter->item].curve, values);
        break;
    case KT_PARAMETER_LOOP_PLACE:
        kt_loop_end_pose_get(model, parameter->item, values);
        break;
    }
}

/* The model in which a parameter has its numbers: for a loop that is off, a model in which the loop is on. */
static const kt_model *model_with(const kt_model *model, const kt_parameter *parameter) {
    const bool off = parameter->kind >= KT_PARAMETER_LOOP_CURVE && kt_loop_is_off(&model->loop[parameter->item]);
    return off ? kt_variants_model(model->variants, kt_variants_count(model->variants) - 1) : model;
}

kt_status kt_parameter_get(const kt_model *model, const kt_parameter *parameter, double *values, kt_error *error) {
    if (KT_IS_MISSING(error, model, parameter, values))
        return KT_ERROR_ARGUMENT;
    const kt_status status = kt_parameter_require(model, parameter, error);
    if (status == KT_OK)
        get_parameter(model_with(model, parameter), parameter, values);
    return status;
}

/* ---- new numbers ------------------------------------------------------------------------------------------------- */

static void set_body(kt_model *m, const kt_parameter *parameter, const double *x) {
    kt_body_record *body = &m->body[parameter->item];
    if (parameter->kind == KT_PARAMETER_MASS)
        body->mass = x[0];
    else if (parameter->kind == KT_PARAMETER_COM)
        body->com = kt_vec3_make(x[0], x[1], x[2]);
    else
        body->inertia = kt_sym3_make(x[0], x[1], x[2], x[3], x[4], x[5]);
    kt_link_add_inertia(m, body->link);
}

/* Sets gravity in space and in each plane. */
static void set_gravity(kt_model *m, const double *x) {
    const kt_vec3 gravity = kt_vec3_make(x[0], x[1], x[2]);
    m->gravity = kt_v4_from(gravity);
    for (size_t p = 0; p < m->n.plane; p++)
        kt_plane_set_weights(m, &m->plane[p]);
}

static kt_curve curve_at(const double *x) {
    return (kt_curve){.type = KT_CURVE_FOLLOWS, .a = x[0], .b = x[1], .c = x[2], .d = x[3]};
}

static kt_curve constant_curve(double x) { return (kt_curve){.type = KT_FUNCTION_CONSTANT, .a = x}; }

static bool stands(const kt_curve *curve) { return kt_curve_rests(curve) || kt_curve_follows(curve); }

bool kt_parameter_stands(const kt_model *model, const kt_parameter *parameter) {
    switch (parameter->kind) {
    case KT_PARAMETER_EFFECT_CURVE:
        return stands(&model->effect[parameter->item].curve[0]);
    case KT_PARAMETER_EFFECT_VALUE:
        for (int k = 0; k < 3; k++)
            if (!kt_curve_rests(&model->effect[parameter->item].curve[k]))
                return false;
        return true;
    case KT_PARAMETER_LOOP_CURVE:
        return stands(&model->loop[parameter->item].curve);
    default:
        return true;
    }
}

/* The rules of a description, for the body or the joint after the change. */
static kt_status check_body(const kt_model *m, const kt_parameter *parameter, const double *x, kt_error *error) {
    const kt_body_record *record = &m->body[parameter->item];
    kt_body body = kt_body_default();
    for (size_t k = 0; k < m->n.varying && parameter->kind != KT_PARAMETER_ARMATURE; k++)
        if (m->varying[k].body == parameter->item)
            return kt_error_set(error, KT_ERROR_MODEL, "parameter",
                                "the mass of body '%.100s' is a function of time, and no number; change the function",
                                m->text + record->name);
    for (int k = 0; k < kt_joint_sizes[record->type].nv; k++)
        if (kt_is_massless(m, (size_t)record->v + (size_t)k))
            return kt_error_set(error, KT_ERROR_MODEL, "parameter",
                                "joint '%.100s' moves no mass and follows from the balance of forces: compile the "
                                "description with the mass that it is to have",
                                m->text + record->joint_name);
    body.name = m->text + record->name;
    body.joint.type = (kt_joint_type)record->type;
    body.mass = parameter->kind == KT_PARAMETER_MASS ? x[0] : record->mass;
    if (parameter->kind == KT_PARAMETER_COM)
        body.com = kt_vec3_make(x[0], x[1], x[2]);
    if (parameter->kind == KT_PARAMETER_INERTIA)
        body.inertia = kt_sym3_make(x[0], x[1], x[2], x[3], x[4], x[5]);
    if (parameter->kind == KT_PARAMETER_ARMATURE)
        memcpy(body.joint.armature, x, (size_t)parameter->count * sizeof *x);
    kt_description around = kt_description_default();
    around.bodies = &body;
    around.body_count = 1;
    kt_checker checker = kt_checker_make(&around, NULL, NULL);
    checker.item = KT_ITEM_BODY;
    if (parameter->kind == KT_PARAMETER_ARMATURE)
        kt_joint_check(&checker, &body.joint);
    else
        kt_checker_mass(&checker, &body);
    return kt_checker_result(&checker, error);
}

/* The rules of a description, for the effect after the change: rules of the key, and rules between numbers. */
static kt_status check_changed_effect(const kt_model *m, const kt_parameter *parameter, const double *x,
                                      kt_error *error) {
    const kt_effect standard = kt_effect_default();
    kt_effect_record record = m->effect[parameter->item];
    kt_effect effect = standard;
    memcpy(effect_number_of(&record, parameter->key), x, (size_t)parameter->count * sizeof *x);
    effect.type = (kt_effect_type)record.type;
    effect.name = effect_name_at(m, (size_t)parameter->item);
    effect.initial_length = false;
    effect.stick = record.direction != 0.0;
    effect.restitution = record.hard ? 0.0 : standard.restitution;
    effect.load = record.load_slot > 0 && record.load_loop >= 0 ? loop_name(m, (size_t)record.load_loop) : NULL;
#define PARAMETER_NUMBER(member) effect.member = record.member;
    KT_EFFECT_NUMBERS(PARAMETER_NUMBER)
#undef PARAMETER_NUMBER
    memcpy(effect.stiffnesses, record.stiffnesses, sizeof effect.stiffnesses);
    memcpy(effect.dampings, record.dampings, sizeof effect.dampings);
    memcpy(effect.quadratics, record.quadratics, sizeof effect.quadratics);
    kt_description around = kt_description_default();
    around.effects = &effect;
    around.effect_count = 1;
    kt_checker checker = kt_checker_make(&around, NULL, NULL);
    checker.item = KT_ITEM_EFFECT;
    checker.set = true;
    kt_checker_key(&checker, parameter->key, &effect, &standard);
    if (kt_effect_kind_of(record.type)->check)
        kt_effect_kind_of(record.type)->check(&checker, &effect);
    return kt_checker_result(&checker, error);
}

/* "gravity", "body 'arm'", "effect 'motor'", "loop 'drive'" */
static void name_item(const kt_model *m, const kt_parameter *parameter, char where[KT_WHERE_SIZE]) {
    const size_t item = (size_t)parameter->item;
    if (parameter->kind == KT_PARAMETER_GRAVITY)
        (void)snprintf(where, KT_WHERE_SIZE, "gravity");
    else if (parameter->kind <= KT_PARAMETER_HOLD)
        (void)snprintf(where, KT_WHERE_SIZE, "body '%.100s'", body_name(m, item));
    else if (parameter->kind >= KT_PARAMETER_LOOP_CURVE)
        (void)snprintf(where, KT_WHERE_SIZE, "loop '%.100s'", loop_name(m, item));
    else
        (void)snprintf(where, KT_WHERE_SIZE, "effect '%.100s'", effect_name_at(m, item));
}

/* Gravity, hold and functions of time: finite, and in the range of their key where that is a value. */
static kt_status check_numbers(const kt_model *m, const kt_parameter *parameter, const double *x, kt_error *error) {
    const kt_key *key = parameter->key;
    const char *name = key                                          ? key->name
                       : parameter->kind == KT_PARAMETER_HOLD       ? "hold"
                       : parameter->kind == KT_PARAMETER_LOOP_PLACE ? place
                                                                    : "gravity";
    char where[KT_WHERE_SIZE];
    name_item(m, parameter, where);
    for (int k = 0; k < parameter->count; k++)
        if (!kt_number_is_fine(x[k]))
            return kt_error_set(error, KT_ERROR_MODEL, where, "%s is %g; magnitudes end at %g", name, x[k],
                                KT_NUMBER_MOST);
    if (key && key->range == KT_RANGE_POSITIVE && !(x[0] > 0.0))
        return kt_error_set(error, KT_ERROR_MODEL, where, "%s is %g; it must be greater than 0", name, x[0]);
    return KT_OK;
}

/* Checks whether the model can be set, and whether the new values pass the rules for the description. */
static kt_status check_parameter(const kt_model *model, const kt_parameter *parameter, const double *values,
                                 kt_error *error) {
    kt_status status = kt_parameter_require(model, parameter, error);
    if (status != KT_OK)
        return status;
    if (!model->placed && !model->settable)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "kt_parameter_set",
            "a compiled model is immutable; make a copy in memory of your own (kt_model_copy) and set it there");
    if (parameter->kind >= KT_PARAMETER_MASS && parameter->kind <= KT_PARAMETER_ARMATURE)
        return check_body(model, parameter, values, error);
    if (parameter->kind == KT_PARAMETER_EFFECT)
        return check_changed_effect(model, parameter, values, error);
    status = check_numbers(model, parameter, values, error);
    return status == KT_OK && parameter->kind == KT_PARAMETER_LOOP_PLACE
               ? kt_loop_end_pose_check(model_with(model, parameter), parameter->item, values, error)
               : status;
}

/* The function of time of a loop that is off is that of the models in which the loop is on. */
static void put_loop_curve(kt_model *m, kt_loop_record *loop, kt_curve curve) {
    loop->curve = kt_loop_is_off(loop) ? loop->curve : curve;
    m->driven = false;
    for (size_t i = 0; i < m->n.loop; i++)
        m->driven = m->driven || kt_loop_drives(m, &m->loop[i]);
}

void kt_parameter_put(kt_model *copy, const kt_parameter *parameter, const double *values) {
    copy->revision++;
    switch (parameter->kind) {
    case KT_PARAMETER_GRAVITY:
        set_gravity(copy, values);
        break;
    case KT_PARAMETER_MASS:
    case KT_PARAMETER_COM:
    case KT_PARAMETER_INERTIA:
        set_body(copy, parameter, values);
        break;
    case KT_PARAMETER_ARMATURE:
        memcpy(copy->armature + copy->body[parameter->item].v, values, (size_t)parameter->count * sizeof *values);
        kt_armature_update_flags(copy);
        kt_masses_attach(copy);
        kt_massless_attach(copy);
        kt_forms_choose(copy);
        break;
    case KT_PARAMETER_HOLD:
        kt_joint_hold(copy, &copy->body[parameter->item], values[0] != 0.0);
        break;
    case KT_PARAMETER_EFFECT:
        memcpy(effect_number_of(&copy->effect[parameter->item], parameter->key), values,
               (size_t)parameter->count * sizeof *values);
        break;
    case KT_PARAMETER_EFFECT_CURVE:
        copy->effect[parameter->item].curve[0] = curve_at(values);
        break;
    case KT_PARAMETER_EFFECT_VALUE:
        for (int k = 0; k < 3; k++)
            copy->effect[parameter->item].curve[k] = constant_curve(values[k]);
        break;
    case KT_PARAMETER_LOOP_CURVE:
        put_loop_curve(copy, &copy->loop[parameter->item], curve_at(values));
        break;
    case KT_PARAMETER_LOOP_PLACE:
        kt_loop_end_pose_put(copy, parameter->item, values);
        break;
    }
}

/* Returns the parameter as it is in another variant of the model, where effects may have another order. */
static kt_parameter parameter_in(const kt_model *from, const kt_parameter *parameter, const kt_model *to) {
    kt_parameter there = *parameter;
    if (parameter->kind < KT_PARAMETER_EFFECT || parameter->kind > KT_PARAMETER_EFFECT_VALUE)
        return there;
    for (size_t i = 0; i < to->n.effect + to->n.effect_off; i++)
        if (to->effect[i].source == from->effect[parameter->item].source)
            there.item = (int)i;
    return there;
}

/* Writes numbers, or functions of time if `curves` is given, to the copy and all its variants. */
static void put_in_variants(kt_model *copy, const kt_parameter *parameter, const double *values,
                            const kt_curve *curves) {
    const uint64_t count = copy->variants ? kt_variants_count(copy->variants) : 1;
    for (uint64_t k = 0; k < count; k++) {
        kt_model *model = copy->variants ? kt_variants_model(copy->variants, k) : copy;
        const kt_parameter there = parameter_in(copy, parameter, model);
        if (curves == NULL)
            kt_parameter_put(model, &there, values);
        else if (parameter->kind == KT_PARAMETER_LOOP_CURVE)
            put_loop_curve(model, &model->loop[there.item], *curves);
        else
            memcpy(model->effect[there.item].curve, curves, 3 * sizeof *curves);
        model->revision++;
    }
}

kt_status kt_parameter_set(kt_model *copy, const kt_parameter *parameter, const double *values, kt_error *error) {
    if (KT_IS_MISSING(error, copy, parameter, values))
        return KT_ERROR_ARGUMENT;
    const kt_status status = check_parameter(copy, parameter, values, error);
    if (status == KT_OK)
        put_in_variants(copy, parameter, values, NULL);
    return status;
}

void kt_curves_save(const kt_model *model, kt_curve *curves) {
    for (kt_parameter of = {.kind = KT_PARAMETER_LOOP_CURVE}; of.item < (int)model->n.loop; of.item++)
        *curves++ = model_with(model, &of)->loop[of.item].curve;
    for (size_t i = 0; i < model->n.effect + model->n.effect_off; i++, curves += 3)
        memcpy(curves, model->effect[i].curve, sizeof model->effect[i].curve);
}

void kt_curves_restore(kt_model *copy, const kt_parameter *parameter, const kt_curve *curves) {
    const size_t item = (size_t)parameter->item;
    if (parameter->kind == KT_PARAMETER_LOOP_CURVE)
        put_in_variants(copy, parameter, NULL, curves + item);
    if (parameter->kind == KT_PARAMETER_EFFECT_CURVE || parameter->kind == KT_PARAMETER_EFFECT_VALUE)
        put_in_variants(copy, parameter, NULL, curves + copy->n.loop + 3 * item);
}
