/* Attaches loops and effects to a compiled tree.
 *
 * A loop acts between two links. The links from below their common ancestor down to each are its paths. Only the
 * coordinates of the paths enter its equations. Loops whose paths share a link form a constraint group (gather.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"

#include "algebra/vector_parts.h"
#include "base/aligned.h"
#include "compile/find_planar.h"
#include "dynamics/dynamics.h"
#include "effect/effect.h"
#include "effect/path.h"
#include "evaluate/load_friction.h"
#include "expression/lookup.h"
#include "joint/joint.h"
#include "loop/loop.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_attach, ATTACH_FIELDS, const kt_counts *n)

/* ---- paths ------------------------------------------------------------------------------------------------------- */

/* Finds the frames of a loop's ends in their links, the common ancestor of the links, and the links on both paths,
 * which become one set with the loop. */
static kt_status trace_frames(kt_attach *a, const kt_loop *loop, kt_loop_record *r, kt_error *error) {
    for (int k = 0; k < 2; k++) {
        const kt_status status =
            kt_attach_place_end(a->tree, &loop->between[k], &r->body[k], &r->link[k], &r->frame[k], error);
        if (status != KT_OK)
            return status;
        kt_attach_align_axis(&r->frame[k], kt_loop_axis(loop, k));
    }
    r->ancestor = kt_attach_ancestor(a, r->link[0], r->link[1]);
    for (int k = 0; k < 2 && !kt_loop_is_off(r); k++)
        r->length[k] = kt_attach_join_path(a, r->link[k], r->ancestor);
    if (r->length[0] && r->length[1])
        kt_attach_join(a, r->link[0], r->link[1]);
    return KT_OK;
}

/* Finds the links of a relation's joints. The links between them and their common ancestor become one set. */
static void trace_relation(kt_attach *a, const kt_loop *loop, kt_loop_record *r, kt_counts *n) {
    r->term = (int32_t)n->term;
    r->term_count = kt_loop_term_count(loop);
    n->term += (size_t)r->term_count;
    const int32_t first = kt_attach_joint_link(a->tree, kt_loop_term(loop, 0).joint);
    r->link[0] = first;
    r->ancestor = a->tree->link[first].parent;
    for (int k = 1; k < r->term_count; k++) {
        const int32_t other = kt_attach_joint_link(a->tree, kt_loop_term(loop, k).joint);
        r->ancestor = kt_attach_ancestor(a, r->ancestor, a->tree->link[other].parent);
    }
    for (int k = 0; k < r->term_count; k++) {
        const int32_t other = kt_attach_joint_link(a->tree, kt_loop_term(loop, k).joint);
        (void)kt_attach_join_path(a, other, r->ancestor);
        kt_attach_join(a, other, first);
    }
}

/* ---- functions of time and angles at the initial positions ------------------------------------------------------- */

static kt_pose end_pose(const kt_attach *a, const kt_loop_record *r, int k) {
    return kt_pose_compose(a->pose[r->link[k]], r->frame[k]);
}

/* The angle of the second frame about the common z axis: twice the angle of the quaternion's z part. */
static double relative_angle(const kt_attach *a, const kt_loop_record *r) {
    const kt_mat3 first = end_pose(a, r, 0).rotation, second = end_pose(a, r, 1).rotation;
    const kt_quat p = kt_quat_from_mat3(kt_mat3_multiply(kt_mat3_transpose(first), second));
    return 2.0 * atan2(p.z, p.w);
}

static double distance_between(kt_pose a, kt_pose b) { return kt_vec3_norm(kt_vec3_sub(b.position, a.position)); }

/* Whether the function of a loop is to be the distance of its ends. */
static bool takes_distance(const kt_loop *loop) {
    return kt_loop_kinds_baseline[kt_loop_kind_index(loop->type)]->initial_distance &&
           loop->function.type == KT_FUNCTION_NONE;
}

/* The function of time in the loop's equation. A length that is not given is the initial distance of the ends. */
static kt_function loop_function_of(const kt_attach *a, const kt_loop *loop, const kt_loop_record *r) {
    if (kt_descriptor_reads(kt_loop_descriptor(loop->type), KT_LOOP_AT(offset)))
        return kt_function_constant(loop->offset);
    if (takes_distance(loop))
        return kt_function_constant(distance_between(end_pose(a, r, 0), end_pose(a, r, 1)));
    if (kt_attach_is_relation(r->type) && loop->function.type == KT_FUNCTION_NONE)
        return kt_function_constant(0.0);
    return loop->function;
}

/* The distance of two points that coincide has no gradient. */
static kt_status check_distance(const kt_attach *a, const kt_loop *loop, const kt_loop_record *r, kt_error *error) {
    if (!takes_distance(loop))
        return KT_OK;
    const kt_pose first = end_pose(a, r, 0), second = end_pose(a, r, 1);
    const double rounding = 16.0 * DBL_EPSILON * (kt_vec3_norm(first.position) + kt_vec3_norm(second.position));
    char where[KT_WHERE_SIZE];
    if (distance_between(first, second) > rounding)
        return KT_OK;
    (void)snprintf(where, sizeof where, "loop '%.100s'", loop->name);
    return kt_error_set(
        error, KT_ERROR_MODEL, where,
        "it has no length, and its ends coincide at the given positions, so that its length would be 0; "
        "give a length, or type: spherical");
}

/* The count of a loop's numbers, without the numbers of its function of time. */
static size_t loop_number_count(const kt_loop *loop) {
    const kt_loop_kind *kind = kt_loop_kinds_baseline[kt_loop_kind_index(loop->type)];
    return kind->number_count ? kind->number_count(loop) : 0;
}

static void prepare_loop(const kt_description *description, const kt_loop *loop, kt_model *m, kt_loop_record *r,
                         size_t *number) {
    const kt_loop_kind *kind = kt_loop_kinds_baseline[kt_loop_kind_index(loop->type)];
    r->number = *number;
    if (kind->prepare)
        kind->prepare(description, loop, m->number, r);
    *number += loop_number_count(loop);
}

/* By how many radians a link turns an end about its z axis for each radian of its coordinate: 1, -1 or 0. *counts
 * becomes false if the link turns about another axis, or has no such coordinate. */
static double turn_of_link(const kt_attach *a, int32_t index, kt_vec3 z, bool *counts) {
    const kt_link *link = &a->tree->link[index];
    const kt_motion_facts facts = kt_motion_facts_of(link->motion);
    if (facts.angles + facts.quaternions == 0)
        return 0.0;
    const double along = kt_vec3_dot(kt_mat3_column(a->pose[index].rotation, link->axis), z);
    const bool is_about = facts.positions == 1 && fabs(fabs(along) - 1.0) < 1e-12;
    *counts = *counts && is_about;
    return is_about ? copysign(1.0, along) : 0.0;
}

/* The ends of a loop in the initial position, with the turns of their joints about the loop's axes. */
static kt_loop_start start_of_loop(const kt_attach *a, const kt_loop_record *r) {
    kt_loop_start at = {.end = {end_pose(a, r, 0), end_pose(a, r, 1)}, .counted = {true, true}};
    for (int k = 0; k < 2; k++)
        for (int32_t i = r->link[k]; i != r->ancestor; i = a->tree->link[i].parent) {
            const double turn = turn_of_link(a, i, at.end[k].rotation.z, &at.counted[k]);
            at.turn[k] += turn != 0.0 ? turn * a->tree->q0[a->tree->link[i].q] : 0.0;
        }
    return at;
}

/* Completes a record from the given positions; a loop that does not fit them is rejected. */
static kt_status start_loop(const kt_attach *a, const kt_loop *loop, kt_loop_record *r, kt_error *error) {
    const kt_loop_kind *kind = kt_loop_kinds_baseline[kt_loop_kind_index(loop->type)];
    if (kind->initial_angle)
        r->angle = relative_angle(a, r);
    if (!kind->start)
        return KT_OK;
    const kt_loop_start at = start_of_loop(a, r);
    kt_error reason;
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "loop '%.100s'", loop->name);
    return kind->start(loop, &at, r, &reason) ? KT_OK
                                              : kt_error_set(error, KT_ERROR_MODEL, where, "%s", reason.message);
}

/* The signs with which the joints on both paths count the turns of a loop's ends. */
static void fill_loop_turns(const kt_attach *a, kt_model *m, kt_loop_record *r, size_t *number) {
    r->turn = *number;
    for (int k = 0; k < 2 && r->counted && !kt_loop_is_off(r); k++) {
        const kt_vec3 z = end_pose(a, r, k).rotation.z;
        bool ignored = true;
        for (int i = 0; i < r->length[k]; i++)
            m->number[(*number)++] = turn_of_link(a, m->path[r->path[k] + i], z, &ignored);
    }
}

/* Makes the record of each loop: its numbers, ends and equations, and the links that it connects. */
static kt_status trace_loops(kt_attach *a, kt_counts *n, kt_error *error) {
    const kt_description *d = a->description;
    for (int i = 0; i < d->loop_count; i++) {
        const kt_loop *loop = &d->loops[i];
        kt_loop_record *r = &a->loop[i];
        *r = (kt_loop_record){.type = (int32_t)loop->type, .source = i, .pitch = loop->pitch, .radius = loop->radius};
        r->side = (int32_t)loop->side;
        r->restitution = loop->restitution;
        r->rest_velocity = loop->rest_velocity;
        r->poisson = loop->poisson;
        r->comes = KT_IS_SWITCHED(loop);
        r->released = false;
        r->kind = kt_loop_kind_index(loop->type);
        r->contact = loop->holonomic;
        if (loop->coordinates)
            r->joint = (int32_t)kt_loop_joint_type(loop->type);
        r->axis[0] = loop->axis;
        r->axis[1] = loop->axis2;
        const bool off = KT_IS_OFF(loop);
        r->group = off ? -1 : 0;
        r->term_count = off ? -1 : 0;
        r->row_count = off ? 0 : kt_loop_equation_count(loop);
        r->equation = (int32_t)n->row;
        n->row += (size_t)r->row_count;
        if (kt_attach_is_relation(r->type)) {
            if (!off)
                trace_relation(a, loop, r, n);
        } else {
            kt_status status = trace_frames(a, loop, r, error);
            if (status != KT_OK)
                return status;
            n->load += kt_loop_kinds_baseline[r->kind]->load != NULL && !off;
            status = start_loop(a, loop, r, error);
            if (status == KT_OK)
                status = check_distance(a, loop, r, error);
            if (status != KT_OK)
                return status;
        }
        const kt_function function = loop_function_of(a, loop, r);
        n->number += kt_curve_number_count(&function) + loop_number_count(loop);
        n->number += r->counted && !off ? (size_t)(r->length[0] + r->length[1]) : 0;
        n->text += strlen(loop->name) + 1;
    }
    return KT_OK;
}

/* The function of time of a loop that is switched off: steps do not end at its corners. */
static const kt_curve no_curve = {.type = KT_FUNCTION_CONSTANT};

/* A relation of rates may be driven at one speed. Its right-hand side is then no function of time, but no zero. */
bool kt_loop_drives(const kt_model *m, const kt_loop_record *r) {
    return !kt_loop_is_off(r) &&
           (kt_loop_is_driven(r) ||
            (r->term_count && kt_loop_kinds_baseline[r->kind]->relate(r, m->number, 0.0, 0.0).rate != 0.0));
}

/* Tables of formulas are the first numbers of a model. Returns how many numbers they take. */
static size_t fill_tables(const kt_description *description, kt_model *m) {
    size_t number = 0;
    for (int k = 0; k < description->table_count; k++) {
        if (m)
            kt_lookup_compile(&description->tables[k], m->number + number);
        number += kt_lookup_numbers(&description->tables[k]);
    }
    return number;
}

/* ---- filling the model ------------------------------------------------------------------------------------------- */

/* Copies the records to the model, and compiles the functions and numbers of each loop. */
static void fill_attached_loops(const kt_attach *a, kt_model *m, size_t *number, size_t *text) {
    if (m->n.loop)
        memcpy(m->loop, a->loop, m->n.loop * sizeof *m->loop);
    kt_paths_fill(m);
    for (size_t i = 0; i < m->n.loop; i++) {
        const kt_loop *loop = &a->description->loops[i];
        kt_loop_record *r = &m->loop[i];
        kt_vec3 origin;
        if (!kt_attach_is_relation(r->type) && !kt_loop_is_off(r) && kt_attach_find_origin(m, r, &origin))
            r->origin = origin;
        for (int k = 0; k < r->term_count; k++)
            m->term[r->term + k] = (kt_term_record){.link = kt_attach_joint_link(m, kt_loop_term(loop, k).joint),
                                                    .coefficient = kt_loop_term(loop, k).coefficient};
        if (m->n.planar && !kt_attach_is_relation(r->type) && !kt_loop_is_off(r) &&
            (size_t)(r->link[0] ? r->link[0] : r->link[1]) >= m->n.spatial) {
            m->planar_loop[i] = a->flat[i];
            kt_planar_ends(m, r, &m->planar_loop[i]);
        }
        const kt_function function = loop_function_of(a, loop, r);
        const kt_curve curve = kt_curve_compile(&function, m->number, *number);
        r->curve = kt_loop_is_off(r) && curve.type != KT_FUNCTION_NONE ? no_curve : curve;
        *number += kt_curve_number_count(&function);
        prepare_loop(a->description, loop, m, r, number);
        fill_loop_turns(a, m, r, number);
        m->driven |= kt_loop_drives(m, r);
        r->name = kt_model_store_text(m, text, loop->name);
    }
}

/* Finds the frames on which an effect acts, or its joint. */
static kt_status place_effect(kt_attach *a, const kt_model *m, const kt_effect *effect, kt_effect_record *r,
                              kt_error *error) {
    const int ends = kt_effect_end_count(effect);
    r->ends = ends;
    if (ends == 0)
        kt_attach_place_in_coordinate(a, m, effect, r);
    for (int k = 0; k < ends; k++) {
        const kt_end *end = kt_effect_end_at(effect, k);
        const kt_status status = kt_attach_place_end(m, end, &r->body[k], &r->link[k], &r->frame[k], error);
        if (status != KT_OK)
            return status;
        r->arm[k] = kt_vec3_sub(r->frame[k].position, m->body[r->body[k]].in_link.position);
    }
    if (kt_effect_aligns_second_end(effect))
        kt_attach_align_axis(&r->frame[1], effect->axis);
    if (kt_effect_has_axle(effect))
        kt_attach_align_axis(&r->frame[0], effect->axle);
    return KT_OK;
}

/* Numbers friction from loads, in the description's order. */
static void fill_load(const kt_attach *a, const kt_effect *effect, kt_effect_record *r, int32_t *load) {
    const kt_description *d = a->description;
    r->load_slot = kt_effect_has_load(effect) ? ++*load : 0;
    r->load_loop = -1;
    for (int i = 0; r->load_slot > 0 && effect->load != NULL && i < d->loop_count; i++)
        if (strcmp(d->loops[i].name, effect->load) == 0)
            r->load_loop = i;
}

/* Fills the records of all effects, also of those that are off. On entry and on return, *number, *variable, *part and
 * *text are the first free indices in lists of the model. */
static kt_status fill_effects(kt_attach *a, kt_model *m, size_t *number, size_t *variable, size_t *part, size_t *text,
                              kt_error *error) {
    size_t term = a->loop_terms, point = 0, link = 0;
    int32_t load = 0;
    for (size_t i = 0; i < m->n.effect + m->n.effect_off; i++) {
        const kt_effect *effect = &a->description->effects[i];
        kt_effect_record *r = &a->effect[i];
        *r = (kt_effect_record){.type = (int32_t)effect->type, .source = (int32_t)i};
#define ATTACH_NUMBER(member) r->member = effect->member;
        KT_EFFECT_NUMBERS(ATTACH_NUMBER)
#undef ATTACH_NUMBER
        r->hard = kt_effect_is_hard(effect);
        fill_load(a, effect, r, &load);
        r->disc = kt_effect_has_axle(effect);
        memcpy(r->stiffnesses, effect->stiffnesses, sizeof r->stiffnesses);
        memcpy(r->dampings, effect->dampings, sizeof r->dampings);
        memcpy(r->quadratics, effect->quadratics, sizeof r->quadratics);
        r->in_body = effect->frame == KT_FRAME_BODY;
        r->exhaust = effect->exhaust;
        r->wrench = effect->wrench;
        r->joint_force = effect->joint_force;
        r->wrench_derivatives = KT_IF_JACOBIAN(effect->wrench_derivatives);
        r->joint_force_derivatives = KT_IF_JACOBIAN(effect->joint_force_derivatives);
        r->breakpoint = effect->breakpoint;
        r->user = effect->user;
        if (effect->name)
            r->name = kt_model_store_text(m, text, effect->name);
        const kt_status status = place_effect(a, m, effect, r, error);
        if (status != KT_OK)
            return status;
        if (r->relative.type)
            kt_attach_fill_turns(a, m, r, &term);
        if (kt_effect_has_path(effect)) {
            const kt_status traced = kt_attach_fill_path(m, effect, r, &point, &link, error);
            if (traced != KT_OK)
                return traced;
        }
        for (int k = 0; k < 3; k++) {
            const kt_function *function = kt_effect_function(effect, k);
            r->curve[k] = kt_curve_compile(function, m->number, *number);
            *number += kt_curve_number_count(function);
        }
        if (effect->type == KT_EFFECT_EXPRESSION && !KT_IS_OFF(effect)) {
            const kt_status read = kt_attach_fill_formulas(a, m, effect, r, number, variable, part, error);
            if (read != KT_OK)
                return read;
        }
    }
    return KT_OK;
}

/* Returns a larger model that contains the tree. */
static kt_model *grow_tree(const kt_model *tree, const kt_counts *n, kt_error *error) {
    const size_t bytes = kt_model_layout(NULL, n);
    kt_model *m = kt_arena_allocate(bytes, "the model", error);
    if (!m)
        return NULL;
    memset(m, 0, bytes);
    *m = *tree;
    (void)kt_model_layout(m, n);
    n = &tree->n; /* from here on the counts of the tree */
#define ATTACH_COPY(type, name, count, meaning) memcpy(m->name, tree->name, (count) * sizeof(type));
    KT_MODEL_FIELDS(ATTACH_COPY)
#undef ATTACH_COPY
    return m;
}

static bool gives(const kt_model *m, size_t from, size_t count, unsigned what) {
    for (size_t k = from; k < from + count; k++)
        if (m->given[k] & what)
            return true;
    return false;
}

/* Marks the coordinates of a joint named by `hold`, which assembly fixes: the coordinates that the description gives.
 * If the description gives no position of this joint, all its positions are fixed. If the description gives no velocity
 * of any joint, the caller of kt_state_assemble sets the joint's velocities, and assembly does not change these
 * velocities unless the loops require it. If not `held`, removes all marks of `hold`. */
void kt_joint_hold(kt_model *m, const kt_body_record *body, bool held) {
    const size_t count = (size_t)kt_joint_sizes[body->type].nv, first = (size_t)body->v;
    const bool has_position = gives(m, first, count, KT_POSITION_GIVEN);
    const bool has_velocities = gives(m, 0, m->n.v, KT_VELOCITY_GIVEN);
    for (size_t k = first; k < first + count; k++) {
        const unsigned given = m->given[k] & (KT_POSITION_GIVEN | KT_VELOCITY_GIVEN);
        m->held[k] = held && (!has_position || (given & KT_POSITION_GIVEN) != 0);
        m->held_velocity[k] = held && (given & KT_VELOCITY_GIVEN) != 0;
        m->given[k] = (uint8_t)(given | (held && !has_velocities ? KT_VELOCITY_KEPT : 0U));
    }
}

/* Counts what loops, effects, states and masses add to the tree (a->tree, which is *model), and fills a larger model,
 * which replaces the tree. Ranks are found last, since they need the complete equations. */
static kt_status attach_all(kt_attach *a, kt_counts *n, kt_model **model, kt_error *error) {
    const kt_description *d = a->description;
    for (size_t i = 0; i < n->link; i++) {
        a->above[i] = (int32_t)i;
        a->depth[i] = i ? a->depth[a->tree->link[i].parent] + 1 : 0;
    }
    kt_link_poses(a->tree, a->tree->q0, a->pose);
    kt_attach_measure_links(a, n->link);
    kt_status status = trace_loops(a, n, error);
    if (status != KT_OK)
        return status;
    kt_attach_place_paths(a, n);
    kt_attach_number_groups(a, n);
    a->loop_terms = n->term;
    status = kt_attach_count_effects(a, n, error);
    if (status == KT_OK)
        status = kt_attach_count_states(a, n, error);
    kt_attach_count_masses(d, n);
    if (status != KT_OK)
        return status;
    for (int i = 0; i < d->effect_count; i++)
        for (int k = 0; k < 3; k++)
            n->number += kt_curve_number_count(kt_effect_function(&d->effects[i], k));
    n->number += fill_tables(d, NULL);
    kt_model *m = grow_tree(a->tree, n, error);
    if (!m)
        return KT_ERROR_MEMORY;
    m->n = *n;
    kt_model_name_all(m);
    size_t number = fill_tables(d, m), variable = 0, part = 0, text = a->tree->n.text;
    fill_attached_loops(a, m, &number, &text);
    m->length = 1.0;
    kt_attach_measure_loops(a, m);
    kt_attach_fill_groups(a, m);
    kt_armature_update_flags(m);
    for (int i = 0; i < d->hold_count; i++)
        kt_joint_hold(m, &m->body[kt_joint_index(m, d->hold[i])], true);
    status = fill_effects(a, m, &number, &variable, &part, &text, error);
    if (status == KT_OK)
        status = kt_attach_fill_states(a, m, &number, &variable, &part, &text, error);
    kt_attach_fill_masses(d, m, &number);
    kt_load_attach(m);
    if (status != KT_OK) {
        kt_aligned_release(m);
        return status;
    }
    kt_attach_fill_effects(a, m);
    kt_aligned_release(*model);
    *model = m;
    m->tolerance = d->tolerance;
    return kt_groups_rank(m, error);
}

kt_status kt_model_attach(kt_model **model, const kt_description *description, const kt_planar_loop *flat,
                          kt_error *error) {
    kt_counts n = (*model)->n;
    n.loop = (size_t)description->loop_count;
    for (int i = 0; i < description->effect_count; i++)
        n.effect_off += KT_IS_OFF(&description->effects[i]);
    n.effect = (size_t)description->effect_count - n.effect_off;
    n.x = (size_t)description->state_count;
    n.planar_loop = n.planar ? n.loop : 0;
    n.massless = (*model)->found_massless;
    kt_attach a = {.description = description, .flat = flat, .tree = *model};
    const size_t bytes = place_arrays(NULL, NULL, &n);
    void *memory = kt_arena_allocate(bytes, "compiling loops and effects", error);
    if (!memory)
        return KT_ERROR_MEMORY;
    memset(memory, 0, bytes);
    (void)place_arrays(&a, memory, &n);
    const kt_status status = attach_all(&a, &n, model, error);
    kt_aligned_release(memory);
    return status;
}
