/* Mechanisms as robots: what of a description belongs to which joint, and what is lost. */
#define _XOPEN_SOURCE 700 /* newlocale */
#include "export/robot.h"
#include "base/require.h"
#include "model/joint_name.h"

#include <locale.h>
#include <string.h>

/* ---- what belongs to a joint ------------------------------------------------------------------------------------- */

static void take_effect(kt_export *x, const kt_effect *e, kt_robot_format format) {
    static const char *const names[KT_EFFECT_TYPE_COUNT] = {
#define KT_NAME(id, name) [id] = "effects of type " #name,
        KT_EFFECT_LIST(KT_NAME)
#undef KT_NAME
    };
    const int body = e->joint != NULL ? kt_names_find(&x->names, 1, e->joint) : -1;
    kt_export_forces *f = body >= 0 ? &x->forces[body] : NULL;
    if (f != NULL && e->type == KT_EFFECT_JOINT_DAMPER) {
        f->damping += e->damping;
    } else if (f != NULL && e->type == KT_EFFECT_JOINT_FRICTION) {
        f->damping += e->viscous;
        f->friction += e->coulomb;
        kt_export_lose(x, "smoothing and breakaway of joint_friction");
    } else if (f != NULL && e->type == KT_EFFECT_JOINT_SPRING && format == KT_ROBOT_MJCF && f->stiffness == 0.0 &&
               (e->rest.type == KT_FUNCTION_NONE || e->rest.type == KT_FUNCTION_CONSTANT)) {
        f->stiffness = e->stiffness;
        f->rest = e->rest.type == KT_FUNCTION_CONSTANT ? e->rest.value : 0.0;
        f->damping += e->damping;
    } else {
        kt_export_lose(x, (unsigned)e->type < KT_EFFECT_TYPE_COUNT ? names[e->type] : "effects of a caller's own");
    }
}

/* A coupling of two joints as one that follows the other; false where it cannot be one. */
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

static bool has_sites(const kt_loop *loop) { return loop->type == KT_LOOP_SPHERICAL || loop->type == KT_LOOP_WELD; }

static void take_loop(kt_export *x, const kt_loop *loop, kt_robot_format format) {
    static const char *const names[KT_LOOP_TYPE_COUNT] = {
#define KT_NAME(id, name) [id] = "loops of type " #name,
        KT_LOOP_LIST(KT_NAME)
#undef KT_NAME
    };
    if (follow(x, loop, format) || (format == KT_ROBOT_MJCF && has_sites(loop)))
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
    if (memory == NULL || x->parent == NULL || x->first_child == NULL || x->next_child == NULL || x->forces == NULL ||
        x->followers == NULL)
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

static kt_status refuse(const kt_export *x, kt_robot_format format, kt_error *error) {
    for (int i = 0; i < x->d->body_count; i++) {
        const kt_body *b = &x->d->bodies[i];
        const bool is_urdf = format == KT_ROBOT_URDF, is_deep = b->joint.type == KT_JOINT_FREE && x->parent[i] >= 0;
        if (b->joint.type == KT_JOINT_SCREW || (is_urdf && b->joint.type == KT_JOINT_SPHERICAL))
            return kt_error_set(error, KT_ERROR_MODEL, b->name, "%s has no %s joint%s", is_urdf ? "URDF" : "MJCF",
                                kt_joint_type_name(b->joint.type),
                                b->joint.type == KT_JOINT_SPHERICAL ? "; MJCF has" : "");
        if (!is_urdf && is_deep)
            return kt_error_set(error, KT_ERROR_MODEL, b->name,
                                "MJCF has free joints on the world alone, and this one is on '%s'", b->parent);
    }
    return KT_OK;
}

static kt_status write_robot(kt_export *x, kt_robot_format format, kt_error *error) {
    if (!take_memory(x))
        return out_of_memory(error);
    find_tree(x);
    const kt_status status = refuse(x, format, error);
    if (status != KT_OK)
        return status;
    for (int i = 0; i < x->d->effect_count; i++)
        take_effect(x, &x->d->effects[i], format);
    for (int i = 0; i < x->d->loop_count; i++)
        take_loop(x, &x->d->loops[i], format);
    for (int i = 0; i < x->d->state_count; i++)
        kt_export_lose(x, "own states");
    if (format == KT_ROBOT_URDF)
        kt_export_urdf(x);
    else
        kt_export_mjcf(x);
    if (fflush(x->stream) != 0 || ferror(x->stream))
        return kt_error_set(error, KT_ERROR_FILE, "", "the stream cannot be written to; is the disk full?");
    return KT_OK;
}

kt_status kt_robot_write(const kt_description *description, kt_robot_format format, FILE *stream, kt_robot_lost *lost,
                         void *user, kt_error *error) {
    if (KT_IS_MISSING(error, description, stream))
        return KT_ERROR_ARGUMENT;
    if ((unsigned)format > KT_ROBOT_MJCF)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "", "format is %d; give one of kt_robot_format", (int)format);
    kt_status status = kt_description_check(description, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    kt_export x = {.d = description, .stream = stream};
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0)
        return out_of_memory(error);
    locale_t before = uselocale(plain);
    status = write_robot(&x, format, error);
    (void)uselocale(before);
    freelocale(plain);
    for (int i = 0; i < x.lost_count && lost != NULL && status == KT_OK; i++)
        lost(user, x.lost[i].what, x.lost[i].count);
    kt_pool_free(x.pool.chunks);
    return status;
}
