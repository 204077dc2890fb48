/* Compiles the absolute formulation (absolute.h), from a transformed description.
 *
 * Each body gets a free joint on the world, with the pose and the twist of the tree's initial state. Its joint becomes
 * a loop of the same kind, from the joint frame on the parent to the body frame. A screw's loop measures its angle from
 * the initial angle. At this angle the body has already advanced by pitch times angle; therefore the end on the body is
 * set back by this length. The names of counters and crosses contain a full stop, which no name of the caller's does.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/absolute.h"

#include "base/aligned.h"
#include "base/arena.h"
#include "base/where.h"
#include "compile/compile.h"
#include "dynamics/dynamics.h"
#include "effect/effect.h"
#include "evaluate/evaluate.h"
#include "evaluate/load_friction.h"
#include "joint/joint.h"
#include "model/formula_names.h"
#include "model/relative.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

/* Working arrays, in one block. */
#define LOOSEN_FIELDS(X)                                                                                               \
    X(kt_pose, pose, n->link, "of the tree's links")                                                                   \
    X(kt_twist, twist, n->link, "of the tree's links")                                                                 \
    X(bool, counted, n->tree, "bodies whose joint's position is referred to")                                          \
    X(kt_body, body, n->body, "first the caller's")                                                                    \
    X(kt_loop, loop, n->loop, "first the caller's")                                                                    \
    X(kt_effect, effect, n->effect, "the caller's")                                                                    \
    X(kt_term, term, n->term, "of couplings")                                                                          \
    X(char, text, n->text, "names that are new")

typedef struct loosen_counts {
    size_t link, tree, body, loop, effect, term, text;
} loosen_counts;

typedef struct loosen {
    const kt_description *from;
    const kt_model *tree;
    kt_absolute_joint *joint;
    loosen_counts used;
    KT_ARENA_DECLARE(LOOSEN_FIELDS)
} loosen;

KT_ARENA_ARRAYS(place_arrays, loosen, LOOSEN_FIELDS, const loosen_counts *n)

/* ---- the initial state ------------------------------------------------------------------------------------------- */

/* The pose of a body of the tree in its initial state. */
static kt_pose initial_pose_of(const loosen *w, int32_t body) {
    const kt_body_record *b = &w->tree->body[body];
    return kt_pose_compose(w->pose[b->link], b->in_link);
}

/* The twist of a body of the tree at its own origin, in its initial state and in world axes. */
static kt_twist twist_of(const loosen *w, int32_t body) {
    const kt_body_record *b = &w->tree->body[body];
    const kt_vec3 arm = kt_mat3_apply(w->pose[b->link].rotation, b->in_link.position);
    kt_twist t = w->twist[b->link];
    t.linear = kt_vec3_add(t.linear, kt_vec3_cross(t.angular, arm));
    return t;
}

/* Replaces the joint of a body by a free joint on the world that starts with this pose and twist. */
static void set_free(kt_body *body, kt_pose pose, kt_twist twist) {
    body->parent = NULL;
    body->joint = kt_joint_default();
    body->joint.type = KT_JOINT_FREE;
    kt_free_coordinates(pose, twist, body->joint.position, body->joint.velocity);
}

/* ---- references to joint positions ------------------------------------------------------------------------------- */

static bool has_terms(const kt_loop *loop) {
    return kt_descriptor_kind(kt_loop_descriptor(loop->type), KT_KEY_TERMS) != NULL;
}

/* Calls note for each reference to the position of a joint, with the location of the joint's name. */
static void each_reference(loosen *w, void (*note)(loosen *w, const char **joint)) {
    for (int i = 0; i < w->from->loop_count; i++)
        if (kt_descriptor_kind(kt_loop_descriptor(w->loop[i].type), KT_KEY_JOINT) != NULL)
            note(w, &w->loop[i].joint);
    for (size_t i = 0; i < w->used.term; i++)
        note(w, &w->term[i].joint);
    for (int i = 0; i < w->from->effect_count; i++)
        if (kt_effect_end_count(&w->effect[i]) == 0 && kt_joint_index(w->tree, w->effect[i].joint) >= 0)
            note(w, &w->effect[i].joint); /* coordinates of loops stay these, and NAME[k] is one of the joint's loop */
}

static void count_joint(loosen *w, const char **joint) { w->counted[kt_joint_index(w->tree, *joint)] = true; }

static void name_counter(loosen *w, const char **joint) {
    *joint = w->body[w->joint[kt_joint_index(w->tree, *joint)].counter - 1].name;
}

/* ---- joints become loops ----------------------------------------------------------------------------------------- */

/* Adds the name of a body that the transformation makes. count_most() has room for one of each body. */
static const char *name_absolute_part(loosen *w, const char *name, const char *part) {
    char *text = w->text + w->used.text;
    const size_t size = strlen(name) + strlen(part) + 1;
    (void)snprintf(text, size, "%s%s", name, part);
    w->used.text += size;
    return text;
}

static const char position_part[] = ".position", cross_part[] = ".cross";

/* Adds a massless body; returns its index in the absolute model. */
static int32_t add_absolute_body(loosen *w, const char *name, kt_body **body) {
    *body = &w->body[w->used.body];
    **body = kt_body_default();
    (*body)->name = name;
    return (int32_t)++w->used.body;
}

/* Adds a loop between the origins and axes of two bodies; returns its index. */
static int32_t add_absolute_loop(loosen *w, const char *name, kt_loop_type type, const char *first, const char *second,
                                 kt_loop **loop) {
    *loop = &w->loop[w->used.loop];
    **loop = kt_loop_default();
    (*loop)->name = name;
    (*loop)->type = type;
    (*loop)->between[0] = (*loop)->between[1] = kt_end_default();
    (*loop)->between[0].body = first;
    (*loop)->between[1].body = second;
    return (int32_t)w->used.loop++;
}

/* Places the end on the parent at the joint frame. */
static void start_at_joint(kt_loop *loop, const kt_joint *joint) {
    loop->between[0].at = joint->at;
    loop->between[0].rotation = joint->rotation;
}

/* Adds a counter: a massless body with the joint's one coordinate, tied to the body. If the counter rotates, its x axis
 * is kept normal to the body's y axis. If the counter slides, the body's origin is kept in the plane through the
 * counter's origin and normal to the axis. */
static void add_counter(loosen *w, const kt_body *body, kt_absolute_joint *j) {
    kt_element elements[KT_ELEMENT_MAX];
    kt_body *counter;
    kt_loop *tie;
    (void)kt_joint_elements(&body->joint, elements);
    const bool slides = kt_motion_facts_of(elements[0].motion).lengths > 0;
    const char *name = name_absolute_part(w, body->name, position_part);
    j->counter = add_absolute_body(w, name, &counter);
    counter->parent = body->parent;
    counter->joint = body->joint;
    counter->joint.name = NULL;
    counter->joint.type = slides ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE;
    j->tie = add_absolute_loop(w, name, slides ? KT_LOOP_INPLANE : KT_LOOP_ORTHOGONAL, name, body->name, &tie);
    tie->axis = slides ? j->axes.triad.z : j->axes.triad.x;
    tie->axis2 = j->axes.triad.y;
}

/* Replaces a universal joint whose axes are not normal to each other. A revolute loop about the first axis connects the
 * parent with the cross. A second revolute loop about the second axis connects the cross with the body. */
static void add_absolute_cross(loosen *w, const kt_body *body, kt_absolute_joint *j, int32_t self) {
    kt_body *cross;
    kt_loop *first, *second;
    kt_pose pose;
    kt_twist twist;
    const int32_t up = w->tree->body[self].parent;
    const char *name = name_absolute_part(w, body->name, cross_part);
    kt_cross_motion(j, initial_pose_of(w, up), twist_of(w, up), body->joint.position, body->joint.velocity, &pose,
                    &twist);
    j->cross = add_absolute_body(w, name, &cross);
    set_free(cross, pose, twist);
    (void)add_absolute_loop(w, name, KT_LOOP_REVOLUTE, body->parent, name, &first);
    start_at_joint(first, &body->joint);
    first->axis = j->axes.triad.z;
    j->loop = add_absolute_loop(w, kt_joint_name_of(body), KT_LOOP_REVOLUTE, name, body->name, &second);
    second->axis = j->axes.second;
}

static bool is_oblique(const kt_absolute_joint *j) {
    return fabs(kt_vec3_dot(j->axes.triad.z, j->axes.second)) > 4.0 * DBL_EPSILON;
}

/* Adds the loop that replaces a joint of the tree, between the body and its parent. */
static void close_joint(loosen *w, const kt_body *body, kt_absolute_joint *j, int32_t self) {
    const kt_joint *joint = &body->joint;
    const kt_loop_type type = kt_joint_kinds[joint->type]->loop;
    kt_loop *loop;
    j->loop = j->tie = -1;
    if (type == KT_LOOP_UNIVERSAL && is_oblique(j)) {
        add_absolute_cross(w, body, j, self);
        return;
    }
    if (type != KT_LOOP_TYPE_COUNT) {
        j->loop = add_absolute_loop(w, kt_joint_name_of(body), type, body->parent, body->name, &loop);
        start_at_joint(loop, joint);
        loop->axis = j->axes.triad.z;
        loop->axis2 = j->axes.second;
        loop->pitch = joint->pitch;
        if (type == KT_LOOP_SCREW)
            loop->between[1].at = kt_vec3_scale(-joint->pitch * joint->position[0], j->axes.triad.z);
    }
    if (w->counted[self])
        add_counter(w, body, j);
}

static void copy_list(void *to, const void *from, int count, size_t size) {
    if (count > 0)
        memcpy(to, from, (size_t)count * size);
}

/* Copies bodies, loops and effects; the joints of the bodies and the names of joints are replaced later. */
static void copy_all(loosen *w) {
    const kt_description *d = w->from;
    copy_list(w->body, d->bodies, d->body_count, sizeof *w->body);
    copy_list(w->loop, d->loops, d->loop_count, sizeof *w->loop);
    copy_list(w->effect, d->effects, d->effect_count, sizeof *w->effect);
    for (int i = 0; i < d->loop_count; i++) {
        kt_loop *loop = &w->loop[i];
        if (!has_terms(loop))
            continue;
        loop->terms = w->term + w->used.term;
        copy_list(w->term + w->used.term, d->loops[i].terms, loop->term_count, sizeof *w->term);
        w->used.term += (size_t)loop->term_count;
    }
    for (size_t i = 0; i < w->tree->n.effect; i++) { /* springs have their measured lengths */
        kt_effect *effect = &w->effect[w->tree->effect[i].source];
        effect->length = w->tree->effect[i].length;
        effect->initial_length = false;
    }
    w->used.body = (size_t)d->body_count;
    w->used.loop = (size_t)d->loop_count;
}

/* The first pass over the references finds the joints that need a counter. The last pass replaces the names of these
 * joints by those of their counters, which exist by then. */
static void transform_description(loosen *w) {
    const kt_description *d = w->from;
    copy_all(w);
    each_reference(w, count_joint);
    for (int32_t b = 1; b < (int32_t)w->tree->n.body; b++) {
        const kt_body_record *r = &w->tree->body[b];
        const kt_body *body = &d->bodies[r->source];
        kt_absolute_joint *j = &w->joint[b];
        *j = (kt_absolute_joint){.type = r->type, .body = r->source + 1, .frame = r->joint};
        j->parent = w->tree->body[r->parent].source + 1;
        j->axes = kt_joint_axes_of(&body->joint);
        close_joint(w, body, j, b);
        set_free(&w->body[r->source], initial_pose_of(w, b), twist_of(w, b));
    }
    each_reference(w, name_counter);
}

/* ---- the model --------------------------------------------------------------------------------------------------- */

/* Upper bounds of the counts: each joint may add a body, and three loops. */
static loosen_counts count_most(const kt_description *d, const kt_model *tree) {
    const size_t bodies = (size_t)d->body_count;
    loosen_counts n = {
        .link = tree->n.link, .tree = tree->n.body, .body = 2 * bodies, .effect = (size_t)d->effect_count};
    n.loop = (size_t)d->loop_count + 3 * bodies;
    for (int i = 0; i < d->loop_count; i++)
        n.term += has_terms(&d->loops[i]) ? (size_t)d->loops[i].term_count : 0;
    for (int i = 0; i < d->body_count; i++)
        n.text += strlen(d->bodies[i].name) + sizeof position_part;
    return n;
}

/* Whether an effect acts in one angle of a universal joint that becomes two loops. */
static bool acts_in_cross(const kt_model *tree, const kt_description *d, const kt_effect *effect) {
    if (kt_effect_end_count(effect) > 0 || kt_joint_index(tree, effect->joint) >= 0)
        return false;
    const kt_coordinate_name name = kt_coordinate_name_of(effect->joint);
    for (int i = 0; i < d->body_count && name.has_index; i++) {
        const kt_body *body = &d->bodies[i];
        const kt_absolute_joint joint = {.axes = kt_joint_axes_of(&body->joint)};
        if (body->joint.type == KT_JOINT_UNIVERSAL && kt_coordinate_is_of(effect->joint, name, kt_joint_name_of(body)))
            return is_oblique(&joint);
    }
    return false;
}

static kt_status reject_effect(const kt_description *d, int i, const char *why, kt_error *error) {
    const kt_effect *effect = &d->effects[i];
    const kt_where_text where = effect->name != NULL
                                    ? kt_where_format("effect '%.100s'", effect->name)
                                    : kt_where_format("effects[%d] (%s)", i, kt_effect_type_name(effect->type));
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, where.text, "%s; run it with formulation: tree", why);
}

static kt_status reject_loop(const kt_description *d, int i, const char *why, kt_error *error) {
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, kt_where_format("loop '%.100s'", d->loops[i].name).text,
                        "%s; run it with formulation: tree", why);
}

/* Rejects descriptions that the transformed model cannot follow. The transformed model has no variables of the tree's
 * joints and markers, which formulas read, and no sets of switched elements. */
static kt_status check_absolute(const kt_model *tree, const kt_description *d, kt_error *error) {
    static const char switched[] = "it is switched on and off while the mechanism moves";
    for (int i = 0; i < d->effect_count; i++)
        if (acts_in_cross(tree, d, &d->effects[i]))
            return reject_effect(d, i,
                                 "it acts in one angle of a universal joint whose axes are not normal to each other, "
                                 "and which has no such angle here",
                                 error);
        else if (d->effects[i].type == KT_EFFECT_EXPRESSION)
            return reject_effect(d, i, "its variables are those of the tree", error);
    for (int i = 0; i < d->loop_count; i++)
        if (kt_loop_has_formula(&d->loops[i]))
            return reject_loop(d, i, "its formula reads joints of the tree", error);
    for (int i = d->effect_count; i-- > 0;)
        if (d->effects[i].switching != KT_ALWAYS_ON)
            return reject_effect(d, i, switched, error);
    for (int i = d->loop_count; i-- > 0;)
        if (d->loops[i].switching != KT_ALWAYS_ON)
            return reject_loop(d, i, switched, error);
    return KT_OK;
}

static kt_status compile_absolute(loosen *w, const kt_model_options *options, kt_model **model, kt_error *error) {
    kt_description to = *w->from;
    const kt_status rejected = check_absolute(w->tree, w->from, error);
    if (rejected != KT_OK)
        return rejected;
    kt_link_poses(w->tree, w->tree->q0, w->pose);
    kt_link_twists(w->tree, w->tree->v0, w->pose, w->twist);
    transform_description(w);
    to.bodies = w->body;
    to.body_count = (int)w->used.body;
    to.loops = w->loop;
    to.loop_count = (int)w->used.loop;
    to.effects = w->effect;
    to.hold = NULL; /* the tree is assembled, not this model */
    to.hold_count = 0;
    return kt_model_build(&to, options, model, error);
}

/* Bodies without joints have no rotors. */
static kt_status reject_armature(const kt_model *tree, kt_error *error) {
    for (size_t i = 1; i < tree->n.link; i++)
        if (tree->link[i].has_armature)
            return kt_error_set(
                error, KT_ERROR_UNSUPPORTED,
                kt_where_format("joint '%.100s'", tree->text + tree->body[tree->link[i].body].joint_name).text,
                "it has armature, which the absolute formulation cannot have: there are no joints whose "
                "rotors could turn; take the formulation 'tree', or leave joint.armature out");
    return KT_OK;
}

/* Compiles the model, and fills made->joint. */
static kt_status loosen_all(const kt_description *description, const kt_model_options *options, kt_absolute *made,
                            kt_error *error) {
    const kt_model *tree = made->tree;
    const loosen_counts n = count_most(description, tree);
    loosen w = {.from = description, .tree = tree, .joint = made->joint};
    const size_t bytes = place_arrays(NULL, NULL, &n);
    void *memory = kt_arena_allocate(bytes, "the absolute formulation", error);
    if (!memory)
        return KT_ERROR_MEMORY;
    memset(memory, 0, bytes);
    (void)place_arrays(&w, memory, &n);
    const kt_status status = compile_absolute(&w, options, &made->model, error);
    kt_aligned_release(memory);
    return status;
}

/* If assembly moves the tree's initial state, makes the assembled state the model's initial state: free bodies would be
 * assembled otherwise. A tree that cannot be assembled is reported when it is simulated. */
static kt_status start_assembled(kt_absolute *made, kt_error *error) {
    const kt_model *tree = made->tree;
    const size_t nq = tree->n.q, nv = tree->n.v;
    kt_data *data = NULL;
    double *given = kt_arena_allocate(2 * (nq + nv) * sizeof *given + 1, "the start of free bodies", error);
    kt_status status = given != NULL ? kt_data_create(tree, &data, error) : KT_ERROR_MEMORY;
    if (status == KT_OK) {
        double *q = given + nq + nv, *v = q + nq;
        kt_model_initial(tree, given, given + nq);
        kt_model_initial(tree, q, v);
        if (kt_state_assemble(tree, data, 0.0, q, v, NULL) == KT_OK && memcmp(q, given, (nq + nv) * sizeof *q) != 0 &&
            kt_kinematics_update(tree, data, q, v, NULL, NULL) == KT_OK)
            kt_absolute_from_tree(made, data, q, v, made->model->q0, made->model->v0);
    }
    kt_data_free(data);
    kt_aligned_release(given);
    return status;
}

kt_status kt_absolute_create(const kt_description *description, const kt_model_options *options, const kt_model *model,
                             kt_absolute **absolute, kt_error *error) {
    if (KT_IS_MISSING(error, description, model, absolute))
        return KT_ERROR_ARGUMENT;
    const kt_model_options defaults = kt_model_options_default();
    kt_absolute *made;
    kt_status status = kt_massless_reject(model, "formulation", "absolute coordinates do not support this", error);
    if (status == KT_OK)
        status = reject_armature(model, error);
    if (status == KT_OK)
        status = kt_load_reject(model, "formulation", "absolute coordinates do not support this; use formulation: tree",
                                error);
    if (status == KT_OK)
        status = kt_auxiliary_states_reject(model, "formulation",
                                            "absolute coordinates do not carry them; use formulation: tree", error);
    if (status == KT_OK)
        status = kt_masses_reject(model, "formulation",
                                  "absolute coordinates do not support this; use formulation: tree", error);
    if (status != KT_OK)
        return status;
    const size_t bytes = sizeof *made + model->n.body * sizeof made->joint[0];
    made = kt_arena_allocate(bytes, "the absolute formulation", error);
    if (!made)
        return KT_ERROR_MEMORY;
    memset(made, 0, bytes);
    made->tree = model;
    status = loosen_all(description, options ? options : &defaults, made, error);
    if (status != KT_OK) {
        kt_aligned_release(made);
        return status;
    }
    status = start_assembled(made, error);
    if (status != KT_OK) {
        kt_absolute_free(made);
        return status;
    }
    memset(made->model->given, 0, made->model->n.v); /* it is about joints: assembly moves free bodies alike */
    for (size_t b = 1; b < model->n.body; b++)
        made->model->body[made->joint[b].body].fixed = model->body[b].fixed;
    *absolute = made;
    return KT_OK;
}

void kt_absolute_free(kt_absolute *absolute) {
    if (!absolute)
        return;
    kt_model_free(absolute->model);
    kt_aligned_release(absolute);
}

const kt_model *kt_absolute_model(const kt_absolute *absolute) { return absolute ? absolute->model : NULL; }
