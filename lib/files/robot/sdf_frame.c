/* Frames of SDF: items with a name and a pose, in nested models.
 *
 * The pose of a frame is relative to its base: X_i = X_base(i) P_i, from the world on. The base is the frame that
 * `relative_to` names. Without it, the base of a joint is its child. The base of a <frame> element is the frame that it
 * is attached to, and that of other items is the model around them. All poses are those with all joints at zero, so
 * that the frames are a tree for any joints. The pose of one frame in another is composed along the path between the
 * two, so that distant models cause no rounding.
 *
 * If a model has a placement frame F, the pose P places that frame: X_model = X_base P (X_F in the model)^-1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <stdio.h>
#include <string.h>

/* ---- collecting -------------------------------------------------------------------------------------------------- */

static void add_children(kt_sdf *m, const kt_element *within, int scope, int home);

/* home: -1 for the outermost item, which has no name. */
static int add_frame(kt_sdf *m, kt_sdf_kind kind, const kt_element *e, int scope, int home) {
    const int index = m->frames.count;
    kt_sdf_frame *f = kt_list_add(m->r, &m->r->scratch, &m->frames, sizeof *f);
    if (f == NULL)
        return -1;
    *f = (kt_sdf_frame){.kind = kind, .element = e, .scope = scope, .home = home, .base = -1, .depth = -1, .link = -1};
    f->follows = -1;
    f->pose = f->world = kt_pose_identity();
    if (home >= 0) {
        f->version = kt_sdf_frame_at(m, home)->version;
        f->is_static = kt_sdf_frame_at(m, home)->is_static;
        f->name = kt_xml_attribute(e, "name");
        f->pose_element = kt_xml_child(e, "pose");
        if (f->name == NULL || *f->name == '\0')
            (void)kt_robot_fault(m->r, e, "the attribute 'name' is missing");
    }
    return index;
}

static void add_model(kt_sdf *m, const kt_element *e, int scope, int home) {
    const int index = add_frame(m, KT_SDF_MODEL, e, scope, home);
    if (index < 0)
        return;
    kt_sdf_frame *f = kt_sdf_frame_at(m, index);
    f->is_static = kt_sdf_flag(m, e, "static", false) || f->is_static;
    f->placement = e;
    f->placed = kt_xml_attribute(e, "placement_frame");
    add_children(m, e, index, index);
}

/* Settings of <include> that replace those of the model. */
static void override(kt_sdf *m, const kt_element *e, kt_sdf_frame *f) {
    const char *name = kt_sdf_text(e, "name");
    f->name = name != NULL ? name : f->name;
    f->is_static = kt_sdf_flag(m, e, "static", f->is_static);
    if (kt_xml_child(e, "pose") != NULL)
        f->pose_element = kt_xml_child(e, "pose");
    if (kt_sdf_text(e, "placement_frame") != NULL) {
        f->placement = e;
        f->placed = kt_sdf_text(e, "placement_frame");
    }
}

/* A merged model has no scope of its own. Its items are in the model around it, and their poses are relative to a
 * frame. */
static void include_model(kt_sdf *m, const kt_element *e, int scope, int home) {
    const char *merge = kt_xml_attribute(e, "merge");
    int version = 0;
    const kt_element *model = kt_sdf_include(m, e, &version);
    const bool is_merged = merge != NULL && kt_sdf_is_true(m, e, merge);
    const int index = model != NULL ? add_frame(m, is_merged ? KT_SDF_FRAME : KT_SDF_MODEL, model, scope, home) : -1;
    if (index < 0)
        return;
    kt_sdf_frame *f = kt_sdf_frame_at(m, index);
    f->version = version;
    f->is_static = kt_sdf_flag(m, model, "static", false) || f->is_static;
    f->placement = model;
    f->placed = kt_xml_attribute(model, "placement_frame");
    override(m, e, f);
    if (is_merged && f->name != NULL)
        f->name = kt_robot_print(m->r, &m->r->scratch, "_merged__%s__model__", f->name);
    add_children(m, model, is_merged ? scope : index, index);
}

static void add_children(kt_sdf *m, const kt_element *within, int scope, int home) {
    for (const kt_element *e = within->first; e != NULL && !m->r->out_of_memory; e = e->next)
        if (strcmp(e->name, "link") == 0)
            (void)add_frame(m, KT_SDF_LINK, e, scope, home);
        else if (strcmp(e->name, "joint") == 0)
            (void)add_frame(m, KT_SDF_JOINT, e, scope, home);
        else if (strcmp(e->name, "frame") == 0)
            (void)add_frame(m, KT_SDF_FRAME, e, scope, home);
        else if (strcmp(e->name, "model") == 0)
            add_model(m, e, scope, home);
        else if (strcmp(e->name, "include") == 0)
            include_model(m, e, scope, home);
}

void kt_sdf_collect(kt_sdf *m, const kt_element *within, bool is_world, int version) {
    const int world = add_frame(m, KT_SDF_WORLD, m->root, -1, -1);
    if (world < 0)
        return;
    kt_sdf_frame_at(m, world)->version = version;
    if (is_world)
        add_children(m, within, world, world);
    else
        add_model(m, within, world, world);
    m->root_scope = is_world ? world : 1;
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* Joints have their own scope of names: before 1.7, a joint and a link may have one name. */
static int scope_of(int scope, bool is_joint) { return 2 * scope + is_joint; }

/* NAME_frame, or if that is taken, the first free name NAME_frameI from the frame's own number I on. Of a model NAME_1,
 * or a later number. */
static const char *other_name(kt_sdf *m, const kt_sdf_frame *f, int number) {
    const bool is_model = f->kind == KT_SDF_MODEL;
    const char *ending = is_model ? "_" : "_frame";
    const size_t room = strlen(f->name) + 32;
    char *made = kt_reader_take(m->r, &m->r->scratch, room, 1);
    if (made == NULL)
        return f->name;
    (void)snprintf(made, room, "%s%s", f->name, is_model ? "_1" : ending);
    for (number = is_model ? 2 : number; kt_names_find(&m->names, scope_of(f->scope, false), made) >= 0; number++)
        (void)snprintf(made, room, "%s%s%d", f->name, ending, number);
    return made;
}

/* Whether an item may have the name of another one, and gets one of its own. Before 1.7, frames could have the names of
 * models, links and other frames, and models those of other models. For a model, the version is that of the file that
 * includes it. */
static bool may_share_name(const kt_sdf *m, const kt_sdf_frame *f, const kt_sdf_frame *other) {
    if (f->kind == KT_SDF_MODEL)
        return other->kind == KT_SDF_MODEL && kt_sdf_frame_at(m, f->home)->version < 107;
    return f->kind == KT_SDF_FRAME && f->version < 107;
}

/* Returns whether the item has a name of its own now, or a fault was reported. */
static bool add_frame_name(kt_sdf *m, int i, bool is_last) {
    kt_sdf_frame *f = kt_sdf_frame_at(m, i);
    const int scope = scope_of(f->scope, f->kind == KT_SDF_JOINT);
    const int other = f->name != NULL ? kt_names_add(&m->names, scope, f->name, i) : -1;
    if (other >= 0 && may_share_name(m, f, kt_sdf_frame_at(m, other))) {
        if (!is_last)
            return false;
        f->name = other_name(m, f, i);
        (void)kt_names_add(&m->names, scope, f->name, i);
        kt_left_count(f->kind == KT_SDF_MODEL ? &m->renamed_models : &m->renamed_frames, f->element);
    } else if (other >= 0) {
        (void)kt_robot_fault(m->r, f->element, "the name is that of the %s in line %u, too",
                             kt_sdf_frame_at(m, other)->element->name,
                             (unsigned)kt_sdf_frame_at(m, other)->element->line);
    }
    return true;
}

/* Frames are last, and models that have to be renamed, since others keep their names. */
static void add_names(kt_sdf *m) {
    const size_t count = (size_t)m->frames.count + 1;
    bool *is_named = kt_reader_take(m->r, &m->r->scratch, count, sizeof *is_named);
    if (is_named == NULL || !kt_robot_names(m->r, &m->names, count))
        return;
    for (int i = 1; i < m->frames.count; i++)
        is_named[i] = kt_sdf_frame_at(m, i)->kind != KT_SDF_FRAME && add_frame_name(m, i, false);
    for (int i = 1; i < m->frames.count; i++)
        if (!is_named[i])
            (void)add_frame_name(m, i, true);
}

static int find_in_scope(const kt_sdf *m, int scope, const char *name) {
    const int found = kt_names_find(&m->names, scope_of(scope, false), name);
    return found >= 0 ? found : kt_names_find(&m->names, scope_of(scope, true), name);
}

/* A::B::c: c in the model B in the model A of the scope. */
static int find_nested(const kt_sdf *m, int scope, const char *name) {
    char part[256];
    int found = find_in_scope(m, scope, name);
    for (const char *end = strstr(name, "::"); found < 0 && end != NULL; end = strstr(name, "::")) {
        const size_t length = (size_t)(end - name);
        if (length >= sizeof part)
            return -1;
        memcpy(part, name, length);
        part[length] = '\0';
        scope = find_in_scope(m, scope, part);
        if (scope < 0 || kt_sdf_frame_at(m, scope)->kind != KT_SDF_MODEL)
            return -1;
        name = end + 2;
        found = strcmp(name, "__model__") == 0 ? scope : find_in_scope(m, scope, name);
    }
    return found;
}

int kt_sdf_find(kt_sdf *m, const kt_element *e, int frame, const char *name) {
    const kt_sdf_frame *f = kt_sdf_frame_at(m, frame);
    if (strcmp(name, "__model__") == 0)
        return f->home;
    if (strcmp(name, "world") == 0) /* the name is reserved: no link or joint takes it */
        return 0;
    const int found = find_nested(m, f->scope, name);
    if (found >= 0)
        return found;
    kt_nearest nearest = kt_nearest_make(name, &m->r->effort);
    m->r->effort -= m->frames.count;
    for (int i = 1; i < m->frames.count && m->r->effort > 0; i++)
        if (kt_sdf_frame_at(m, i)->scope == f->scope && kt_sdf_frame_at(m, i)->name != NULL &&
            !kt_nearest_try(&nearest, kt_sdf_frame_at(m, i)->name))
            break;
    if (m->missing.count > 0) {
        (void)kt_robot_fault(
            m->r, e, "%s does not exist; it may be in an included model that is not in the model's folder: %.120s",
            kt_name_quote(name).text, m->missing.what);
        return -1;
    }
    (void)kt_robot_fault(m->r, e, "%s does not exist%s%s%s", kt_name_quote(name).text,
                         nearest.best != NULL ? "; did you mean " : "",
                         nearest.best != NULL ? kt_name_quote(nearest.best).text : "", nearest.best != NULL ? "?" : "");
    return -1;
}

/* ---- bases ------------------------------------------------------------------------------------------------------- */

int kt_sdf_named_by(kt_sdf *m, int frame, const char *child) {
    const kt_element *e = kt_sdf_frame_at(m, frame)->element;
    const char *name = kt_sdf_text(e, child);
    const int found = name != NULL ? kt_sdf_find(m, kt_xml_child(e, child), frame, name) : -1;
    if (name == NULL)
        (void)kt_robot_fault(m->r, e, "<%s> is missing", child);
    return found;
}

/* The frame that `relative_to` of a pose names; without the attribute, `standard`. */
static int relative_to(kt_sdf *m, const kt_element *pose, int frame, int standard) {
    const char *name = pose != NULL ? kt_xml_attribute(pose, "relative_to") : NULL;
    if (name == NULL && pose != NULL && kt_sdf_frame_at(m, frame)->version <= 106)
        name = kt_xml_attribute(pose, "frame"); /* its name until 1.6 */
    return name != NULL && *name != '\0' ? kt_sdf_find(m, pose, frame, name) : standard;
}

/* A model, or one that is merged into the model around it. */
static bool is_sdf_model(const kt_sdf_frame *f) {
    return f->kind != KT_SDF_WORLD && strcmp(f->element->name, "model") == 0;
}

/* The scope of the items in a model. */
static int scope_within(const kt_sdf *m, int model) {
    const kt_sdf_frame *f = kt_sdf_frame_at(m, model);
    return f->kind == KT_SDF_MODEL ? model : f->scope;
}

/* The canonical link: the named one, else the first in the model, else that of the first model in it. */
static int canonical_of(kt_sdf *m, int model) {
    const kt_sdf_frame *f = kt_sdf_frame_at(m, model);
    const char *name = kt_xml_attribute(f->element, "canonical_link");
    if (name != NULL && *name != '\0') {
        const int found = find_nested(m, scope_within(m, model), name);
        if (found < 0)
            (void)kt_robot_fault(m->r, f->element, "canonical_link %s does not exist", kt_name_quote(name).text);
        return found;
    }
    return f->follows; /* found by find_canonical */
}

/* Finds the first link of each model, or else its first model. Links of a merged model also belong to the model around
 * it. */
static void find_canonical(kt_sdf *m) {
    for (int pass = 0; pass < 2; pass++)
        for (int i = 1; i < m->frames.count; i++) {
            const kt_sdf_frame *f = kt_sdf_frame_at(m, i);
            for (int at = f->home; f->kind == (pass ? KT_SDF_MODEL : KT_SDF_LINK) && at > 0;) {
                kt_sdf_frame *model = kt_sdf_frame_at(m, at);
                model->follows = model->follows < 0 ? i : model->follows;
                at = at != f->scope ? model->home : 0;
            }
        }
}

/* A link follows itself, a model its canonical link, a joint its child, and a frame the item that it is attached to.
 * Joints and frames have their poses in what they follow, links and models in `home`, unless relative_to names a frame.
 */
static void find_frame_base(kt_sdf *m, int i) {
    kt_sdf_frame *f = kt_sdf_frame_at(m, i);
    int standard = f->home;
    if (f->kind == KT_SDF_LINK) {
        f->follows = i;
    } else if (is_sdf_model(f)) {
        f->follows = canonical_of(m, i);
    } else if (f->kind == KT_SDF_JOINT) {
        f->follows = standard = kt_sdf_named_by(m, i, "child");
    } else {
        const char *name = kt_xml_attribute(f->element, "attached_to");
        if (name != NULL && *name != '\0')
            standard = kt_sdf_find(m, f->element, i, name);
        f->follows = standard;
    }
    f->base = relative_to(m, f->pose_element, i, standard);
    f->pose = kt_sdf_read_pose(m, f->pose_element);
}

/* ---- placement --------------------------------------------------------------------------------------------------- */

/* With `placement_frame` F, the pose X of an included model is that of its frame F. The frame of the model itself, in
 * which F has the pose P, then has the pose X P^-1. P is the product of the poses from F up to the model. Models within
 * the model are placed before, since F may belong to one of them. */
static void place_model(kt_sdf *m, int model) {
    kt_sdf_frame *f = kt_sdf_frame_at(m, model);
    kt_pose pose = kt_pose_identity();
    if (f->placed == NULL || *f->placed == '\0')
        return;
    int at = strcmp(f->placed, "__model__") == 0 ? model : find_nested(m, scope_within(m, model), f->placed);
    if (at < 0)
        (void)kt_robot_fault(m->r, f->placement, "placement_frame %s does not exist", kt_name_quote(f->placed).text);
    for (int steps = 0; at >= 0 && at != model && steps < m->frames.count; steps++) {
        pose = kt_pose_compose(kt_sdf_frame_at(m, at)->pose, pose);
        at = kt_sdf_frame_at(m, at)->base;
    }
    if (at == model)
        f->pose = kt_pose_compose(f->pose, kt_pose_invert(pose)); /* else a circle is reported */
}

/* ---- poses ------------------------------------------------------------------------------------------------------- */

/* Depths and poses in the world, from the bases outwards. */
static void settle(kt_sdf *m) {
    enum { ON_PATH = -2 };
    int *path = kt_reader_take(m->r, &m->r->scratch, (size_t)m->frames.count, sizeof *path);
    if (path == NULL)
        return;
    kt_sdf_frame_at(m, 0)->depth = 0;
    for (int i = 1; i < m->frames.count; i++) {
        int count = 0, at = i;
        for (; at >= 0 && kt_sdf_frame_at(m, at)->depth == -1; at = kt_sdf_frame_at(m, at)->base) {
            kt_sdf_frame_at(m, at)->depth = ON_PATH;
            path[count++] = at;
        }
        if (at < 0 || kt_sdf_frame_at(m, at)->depth == ON_PATH) {
            const kt_sdf_frame *f = kt_sdf_frame_at(m, i);
            if (at >= 0)
                (void)kt_robot_fault(m->r, f->element, "poses are relative to each other in a circle");
            at = 0; /* which has been reported, as a name that does not exist has */
            kt_sdf_frame_at(m, path[count - 1])->base = 0;
        }
        while (count-- > 0) {
            kt_sdf_frame *f = kt_sdf_frame_at(m, path[count]), *base = kt_sdf_frame_at(m, at);
            f->depth = base->depth + 1;
            f->world = kt_pose_compose(base->world, f->pose);
            at = path[count];
        }
    }
}

void kt_sdf_place(kt_sdf *m) {
    add_names(m);
    if (m->r->out_of_memory)
        return;
    find_canonical(m);
    kt_sdf_frame_at(m, 0)->follows = 0;
    for (int i = 1; i < m->frames.count; i++)
        find_frame_base(m, i);
    for (int i = m->frames.count - 1; i > 0; i--)
        place_model(m, i);
    settle(m);
}

kt_pose kt_sdf_pose(const kt_sdf *m, int of, int in) {
    enum { STEPS_MOST = 64 };
    kt_pose up = kt_pose_identity(), down = kt_pose_identity();
    for (int steps = 0; of != in && steps < STEPS_MOST; steps++) {
        const bool is_upper = kt_sdf_frame_at(m, of)->depth >= kt_sdf_frame_at(m, in)->depth;
        int *at = is_upper ? &of : &in;
        kt_pose *pose = is_upper ? &up : &down;
        *pose = kt_pose_compose(kt_sdf_frame_at(m, *at)->pose, *pose);
        *at = kt_sdf_frame_at(m, *at)->base;
    }
    if (of != in) {
        up = kt_pose_compose(kt_sdf_frame_at(m, of)->world, up);
        down = kt_pose_compose(kt_sdf_frame_at(m, in)->world, down);
    }
    return kt_pose_compose(kt_pose_invert(down), up);
}

kt_pose kt_sdf_pose_within(kt_sdf *m, const kt_element *e, int frame) {
    const kt_element *pose = kt_xml_child(e, "pose");
    const kt_pose own = kt_sdf_read_pose(m, pose);
    const int base = relative_to(m, pose, frame, frame);
    return base < 0 || base == frame ? own : kt_pose_compose(kt_sdf_pose(m, base, frame), own);
}

/* The path to the link is shortened, so that the next search along it is short. */
int kt_sdf_link_of(kt_sdf *m, const kt_element *e, int frame) {
    int at = frame;
    for (int steps = 0; at >= 0 && kt_sdf_frame_at(m, at)->follows != at && steps < m->frames.count; steps++)
        at = kt_sdf_frame_at(m, at)->follows;
    if (at < 0 || kt_sdf_frame_at(m, at)->follows != at) {
        (void)kt_robot_fault(m->r, e, "this is attached to no link");
        return -1;
    }
    while (frame != at) {
        const int next = kt_sdf_frame_at(m, frame)->follows;
        kt_sdf_frame_at(m, frame)->follows = at;
        frame = next;
    }
    return at == 0 ? 0 : kt_sdf_frame_at(m, at)->link;
}
