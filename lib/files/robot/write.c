/* Mechanisms as robots: the parts of a description that belong to each joint, and the parts that are lost. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* newlocale */
#include "robot/write.h"
#include "base/require.h"
#include "effect/actuator.h"
#include "model/joint_name.h"

#include <float.h>
#include <locale.h>
#include <stdio.h>
#include <string.h>

/* ---- what belongs to a joint ------------------------------------------------------------------------------------- */

static bool is_motor(const kt_effect *e) { return e->type == KT_EFFECT_MOTOR || e->type == KT_EFFECT_SERVO; }

/* Whether numbers are equal. */
static bool are_equal(const double *values, int count) {
    for (int i = 1; i < count; i++)
        if (values[i] != values[0])
            return false;
    return true;
}

static bool end_is_origin(const kt_end *end) {
    const kt_vec3 at = end->at;
    return end->marker == NULL && at.x == 0.0 && at.y == 0.0 && at.z == 0.0 && end->rotation.type == KT_ROTATION_NONE;
}

static bool are_same_vectors(kt_vec3 a, kt_vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

static bool are_same_poses(const kt_pose *a, const kt_pose *b) {
    const kt_mat3 *r = &a->rotation, *s = &b->rotation;
    return are_same_vectors(a->position, b->position) && are_same_vectors(r->x, s->x) && are_same_vectors(r->y, s->y) &&
           are_same_vectors(r->z, s->z);
}

/* The stiffness and damping of a ball or free joint, which MJCF has for all axes at once: those of a bushing between
 * the body and its parent that acts alike along and about all axes. A free joint has a damping alone. */
static bool take_bushing(kt_export *x, const kt_effect *e) {
    const int body = e->type == KT_EFFECT_BUSHING ? kt_export_find(x, e->between[1].body) : -1;
    const kt_joint *joint = body >= 0 ? &kt_export_body(x, body)->joint : NULL;
    if (joint == NULL || !end_is_origin(&e->between[1]) || x->role[body] != KT_EXPORT_BODY ||
        kt_export_find(x, e->between[0].body) != x->parent[body])
        return false;
    const kt_pose rest = kt_export_end(x, &e->between[0]), frame = {kt_mat3_of_rotation(&joint->rotation), joint->at};
    const bool turns = are_equal(e->stiffnesses, 3) && e->stiffnesses[0] == 0.0 && are_equal(e->dampings, 3) &&
                       e->dampings[0] == 0.0 && are_equal(e->stiffnesses + 3, 3) && are_equal(e->dampings + 3, 3) &&
                       (e->stiffnesses[3] == 0.0 || are_same_poses(&rest, &frame));
    const bool moves = are_equal(e->dampings, 6) && are_equal(e->stiffnesses, 6) && e->stiffnesses[0] == 0.0;
    if (!(joint->type == KT_JOINT_SPHERICAL && turns) &&
        !(joint->type == KT_JOINT_FREE && moves && !kt_export_is_deep(x, body)))
        return false;
    x->forces[body].damping[0] += e->dampings[3];
    x->forces[body].stiffness[0] += e->stiffnesses[3];
    return true;
}

/* URDF has dampers and friction of joints alone. An effect that the format cannot express is lost. */
static void take_effect(kt_export *x, const kt_effect *e, kt_robot_format format) {
    static const char *const names[KT_EFFECT_TYPE_COUNT] = {
#define KT_NAME(id, name) [id] = "effects of type " #name,
        KT_EFFECT_LIST(KT_NAME)
#undef KT_NAME
    };
    const int body = kt_export_scalar(x, e->joint);
    kt_export_forces *f = body >= 0 ? &x->forces[body] : NULL;
    if (e->switching == KT_SWITCHED_OFF) {
        kt_export_lose(x, "effects that are switched off at the start");
    } else if (f != NULL && e->type == KT_EFFECT_JOINT_DAMPER) {
        f->damping[0] += e->damping;
    } else if (f != NULL && e->type == KT_EFFECT_JOINT_FRICTION) {
        f->damping[0] += e->viscous;
        f->friction += e->coulomb;
        kt_export_lose(x, "smoothing and breakaway of joint_friction");
        if (e->friction > 0.0 || e->efficiency != 1.0)
            kt_export_lose(x, "friction that is proportional to a load (joint_friction)");
    } else if (f != NULL && e->type == KT_EFFECT_JOINT_SPRING && format == KT_ROBOT_MJCF && f->stiffness[0] == 0.0 &&
               f->stiffness[1] == 0.0 && f->stiffness[2] == 0.0 &&
               (e->rest.type == KT_FUNCTION_NONE || e->rest.type == KT_FUNCTION_CONSTANT)) {
        f->stiffness[0] = e->stiffness;
        f->rest[0] = f->rest[1] = e->rest.type == KT_FUNCTION_CONSTANT ? e->rest.value : 0.0;
        f->damping[0] += e->damping;
    } else if (f != NULL && is_motor(e) && format == KT_ROBOT_MJCF) {
        x->motors[x->motor_count++] = (kt_export_motor){e, body};
    } else if (format != KT_ROBOT_MJCF || !(take_bushing(x, e) || kt_export_take_rope(x, e) ||
                                            kt_export_take_spring(x, e) || kt_export_take_actuators(x, e))) {
        if (e->type == KT_EFFECT_EXPRESSION && e->law == NULL && !kt_effect_has_numbers(e) && format == KT_ROBOT_MJCF)
            kt_export_lose(x, "forces by formulas (actuators and springs by numbers have a place)");
        else
            kt_export_lose(x, (unsigned)e->type < KT_EFFECT_TYPE_COUNT ? names[e->type] : "effects of a caller's own");
    }
}

/* A coupling of two joints as one that follows the other; false if it cannot be one. */
static bool follow(kt_export *x, const kt_loop *loop, kt_robot_format format) {
    if (loop->type != KT_LOOP_COUPLING || loop->term_count != 2)
        return false;
    for (int i = 0; i < 2; i++) {
        const kt_term *own = &loop->terms[i], *other = &loop->terms[1 - i];
        const int body = kt_names_find(&x->names, 1, own->joint), master = kt_names_find(&x->names, 1, other->joint);
        kt_export_follower found = {.master = master};
        if (body < 0 || master < 0 || body == master || x->followers[body].master >= 0 ||
            x->followers[master].master == body || !kt_export_polynomial(x, loop, i, found.a) ||
            (format == KT_ROBOT_URDF && (found.a[2] != 0.0 || found.a[3] != 0.0 || found.a[4] != 0.0)))
            continue;
        x->followers[body] = found;
        return true;
    }
    return false;
}

/* A coupling of any number of joints, as a tendon that is held. */
static bool tie(kt_export *x, const kt_loop *loop) {
    bool fine = loop->type == KT_LOOP_COUPLING && loop->formula == NULL && loop->term_count > 0;
    for (int k = 0; k < loop->term_count && fine; k++) {
        const int body = kt_export_scalar(x, loop->terms[k].joint);
        fine = body >= 0 && x->role[body] != KT_EXPORT_SUM;
    }
    if (fine)
        x->tendons[x->tendon_count++] = loop;
    return fine;
}

static bool coupling_is_sum(const kt_export *x, const kt_loop *loop) {
    for (int k = 0; k < loop->term_count; k++) {
        const int body = kt_names_find(&x->names, 1, loop->terms[k].joint);
        if (body >= 0 && x->sum[body] == loop)
            return true;
    }
    return false;
}

/* Accepts a prescribed motion of one coordinate. A motion that is not constant is lost. */
static bool accept_motion(kt_export *x, const kt_loop *loop) {
    if (!kt_export_is_held(x, loop))
        return false;
    if (loop->function.type != KT_FUNCTION_CONSTANT)
        kt_export_lose(x, "prescribed motions, whose joints are held at the start");
    return true;
}

static bool take_loop_of_mjcf(kt_export *x, const kt_loop *loop) {
    if (coupling_is_sum(x, loop) || follow(x, loop, KT_ROBOT_MJCF) || tie(x, loop) || accept_motion(x, loop))
        return true;
    if (loop->type == KT_LOOP_UNIVERSAL && kt_export_has_sites(loop))
        kt_export_lose(x, "axes of universal loops, which are connected points");
    return kt_export_has_sites(loop);
}

static void take_loop(kt_export *x, const kt_loop *loop, kt_robot_format format) {
    static const char *const names[KT_LOOP_TYPE_COUNT] = {
#define KT_NAME(id, name) [id] = "loops of type " #name,
        KT_LOOP_LIST(KT_NAME)
#undef KT_NAME
    };
    if (format == KT_ROBOT_MJCF ? take_loop_of_mjcf(x, loop) : follow(x, loop, format))
        return;
    kt_export_lose(x, (unsigned)loop->type < KT_LOOP_TYPE_COUNT ? names[loop->type] : "loops of a caller's own");
}

/* ---- the tree ---------------------------------------------------------------------------------------------------- */

static kt_status out_of_memory(kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory to write the robot");
}

static bool take_memory(kt_export *x) {
    const size_t count = (size_t)x->d->body_count + 1;
    size_t names = 2 * count;
    for (int i = 0; i < x->d->body_count; i++)
        names += (size_t)x->d->bodies[i].marker_count;
    void *memory = kt_pool_take(&x->pool, 1, kt_names_size(names));
    x->parent = kt_pool_take(&x->pool, count, sizeof *x->parent);
    x->first_child = kt_pool_take(&x->pool, count, sizeof *x->first_child);
    x->next_child = kt_pool_take(&x->pool, count, sizeof *x->next_child);
    x->forces = kt_pool_take(&x->pool, count, sizeof *x->forces);
    x->followers = kt_pool_take(&x->pool, count, sizeof *x->followers);
    x->role = kt_pool_take(&x->pool, count, sizeof *x->role);
    x->sum = kt_pool_take(&x->pool, count, sizeof *x->sum);
    x->motors = kt_pool_take(&x->pool, (size_t)x->d->effect_count + 1, sizeof *x->motors);
    x->ropes = kt_pool_take(&x->pool, (size_t)(x->d->effect_count + x->length_count) + 1, sizeof *x->ropes);
    size_t listed = 1;
    for (int i = 0; i < x->d->effect_count; i++)
        listed += (size_t)x->d->effects[i].actuator_count;
    x->actuators = kt_pool_take(&x->pool, listed, sizeof *x->actuators);
    x->lines = kt_pool_take(&x->pool, listed + (size_t)x->d->effect_count, sizeof *x->lines);
    x->is_kept = kt_pool_take(&x->pool, (size_t)x->d->state_count + 1, sizeof *x->is_kept);
    x->tendons = kt_pool_take(&x->pool, (size_t)x->d->loop_count + 1, sizeof *x->tendons);
    x->mesh_files = kt_pool_take(&x->pool, (size_t)x->mesh_count + 1, sizeof *x->mesh_files);
    if (memory == NULL || x->parent == NULL || x->first_child == NULL || x->next_child == NULL || x->forces == NULL ||
        x->followers == NULL || x->role == NULL || x->sum == NULL || x->motors == NULL || x->ropes == NULL ||
        x->actuators == NULL || x->lines == NULL || x->is_kept == NULL || x->tendons == NULL || x->mesh_files == NULL)
        return false;
    kt_names_init(&x->names, names, memory);
    return true;
}

static void find_tree(kt_export *x) {
    x->first_root = -1;
    for (int i = 0; i < x->d->body_count; i++) {
        (void)kt_names_add(&x->names, 0, x->d->bodies[i].name, i);
        (void)kt_names_add(&x->names, 1, kt_joint_name_of(&x->d->bodies[i]), i);
        for (int k = 0; k < x->d->bodies[i].marker_count; k++)
            (void)kt_names_add(&x->names, 2, x->d->bodies[i].markers[k].name, i);
        x->first_child[i] = -1;
        x->followers[i].master = -1;
    }
    for (int i = x->d->body_count - 1; i >= 0; i--) { /* from the last, so that children come in their order */
        const char *parent = x->d->bodies[i].parent;
        x->parent[i] = parent != NULL ? kt_names_find(&x->names, 0, parent) : -1;
        int *first = x->parent[i] >= 0 ? &x->first_child[x->parent[i]] : &x->first_root;
        x->next_child[i] = *first;
        *first = i;
    }
}

/* Rejects joints that URDF does not have. MJCF has an element for each joint. */
static kt_status reject_for_urdf(const kt_export *x, kt_error *error) {
    for (int i = 0; i < x->d->body_count; i++) {
        const kt_body *b = &x->d->bodies[i];
        if (b->joint.type == KT_JOINT_SCREW || b->joint.type == KT_JOINT_SPHERICAL)
            return kt_error_set(error, KT_ERROR_MODEL, b->name, "URDF has no %s joint; MJCF has",
                                kt_joint_type_name(b->joint.type));
    }
    return KT_OK;
}

/* Returns a word for the origin of an auxiliary state, because a scene may have states that its file does not list.
 * scene: NULL if the mechanism comes from a description. */
static const char *kind_of_state(const kt_scene *scene, const char *name) {
    if (scene != NULL && kt_scene_is_place_state(scene, name))
        return "numbers of the places of footholds";
    for (int i = 0; scene != NULL && i < scene->parameter_count; i++)
        if (strcmp(scene->parameters[i].name, name) == 0)
            return "parameters as set by events";
    return "auxiliary states";
}

static void lose_the_rest(kt_export *x) {
    for (int i = 0; i < x->d->state_count; i++)
        if (!x->is_kept[i])
            kt_export_lose(x, kind_of_state(x->scene, x->d->states[i].name));
    for (int i = 0; i < x->d->body_count; i++)
        if (x->d->bodies[i].variable_mass != NULL)
            kt_export_lose(x, "masses that vary with time, which stay as they are given");
}

/* Reports the numbers of bodies that have been changed so that readers accept them. */
static bool report_moments(kt_export *x) {
    enum { ROOM = 240 };
    char *text = kt_pool_take(&x->pool, ROOM, 1), *massless = kt_pool_take(&x->pool, ROOM, 1);
    if (text == NULL || massless == NULL)
        return false;
    (void)snprintf(text, ROOM,
                   "bodies whose moments of inertia are raised, by at most %.3g kg m^2 (%.60s), since MuJoCo rejects "
                   "them",
                   x->most_raised, x->most_raised_body != NULL ? x->most_raised_body : "");
    (void)snprintf(massless, ROOM, "bodies that move without mass, with %.2g kg, since MuJoCo rejects them", x->least);
    for (int i = 0; i < x->raised; i++)
        kt_export_lose(x, text);
    for (int i = 0; i < x->lightened; i++)
        kt_export_lose(x, massless);
    for (int i = 0; i < x->weighted; i++)
        kt_export_lose(x,
                       "fixed bodies with moments of inertia and without mass, with some 1e-14 kg, since MuJoCo leaves "
                       "them out");
    return true;
}

static kt_status write_robot(kt_export *x, kt_robot_format format, kt_error *error) {
    const bool is_urdf = format == KT_ROBOT_URDF;
    if (!(is_urdf || kt_export_take_lengths(x)) || !take_memory(x))
        return out_of_memory(error);
    for (int i = 0; i < x->length_count; i++)
        x->ropes[x->rope_count++] = x->lengths[i];
    find_tree(x);
    const kt_status status = is_urdf ? reject_for_urdf(x, error) : KT_OK;
    if (status != KT_OK)
        return status;
    if (!kt_export_assemble(x) || !(is_urdf || kt_export_find_roles(x)) ||
        !kt_export_find_meshes(x, is_urdf ? NULL : ".stl .obj .msh"))
        return out_of_memory(error);
    x->least = is_urdf ? 1.5e-14 : 1.5e-15; /* 1.5 times what MuJoCo rejects (write_moment.c) */
    x->least_fixed = is_urdf ? x->least : 0.0;
    x->spare = is_urdf ? 32.0 * DBL_EPSILON : 0.0;
    if (!kt_export_find_inertials(x))
        return out_of_memory(error);
    for (int i = 0; i < x->d->effect_count; i++)
        take_effect(x, &x->d->effects[i], format);
    for (int i = 0; i < x->d->loop_count; i++)
        take_loop(x, &x->d->loops[i], format);
    lose_the_rest(x);
    if (is_urdf)
        kt_export_urdf(x);
    else
        kt_export_mjcf(x);
    if (!report_moments(x))
        return out_of_memory(error);
    if (fflush(x->stream) != 0 || ferror(x->stream))
        return kt_error_set(error, KT_ERROR_FILE, "", "the stream cannot be written to; is the disk full?");
    return KT_OK;
}

/* Numbers are printed in the locale C, which this thread alone uses meanwhile. */
static kt_status write_checked(kt_export *x, kt_robot_format format, kt_robot_lost *lost, void *user, kt_error *error) {
    if ((unsigned)format > KT_ROBOT_MJCF)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "", "format is %d; give one of kt_robot_format", (int)format);
    kt_status status = kt_description_check(x->d, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0)
        return out_of_memory(error);
    locale_t before = uselocale(plain);
    status = write_robot(x, format, error);
    (void)uselocale(before);
    freelocale(plain);
    for (int i = 0; i < x->lost_count && lost != NULL && status == KT_OK; i++)
        lost(user, x->lost[i].what, x->lost[i].count);
    kt_pool_free(x->pool.chunks);
    return status;
}

kt_status kt_robot_write(const kt_description *description, kt_robot_format format, FILE *stream, kt_robot_lost *lost,
                         void *user, kt_error *error) {
    if (KT_IS_MISSING(error, description, stream))
        return KT_ERROR_ARGUMENT;
    kt_export x = {.d = description, .stream = stream};
    return write_checked(&x, format, lost, user, error);
}

kt_status kt_robot_write_scene(const kt_scene *scene, kt_robot_format format, const char *folder, FILE *stream,
                               kt_robot_lost *lost, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, scene, stream))
        return KT_ERROR_ARGUMENT;
    kt_export x = {.d = &scene->description,
                   .scene = scene,
                   .meshes = scene->meshes,
                   .mesh_count = scene->mesh_count,
                   .folder = folder,
                   .stream = stream};
    for (int i = 0; i < scene->event_count; i++)
        kt_export_lose(&x, "events");
    return write_checked(&x, format, lost, user, error);
}
