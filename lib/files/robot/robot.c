/* Robots in any of the formats: which one it is, by the root element. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot.h"
#include "base/options.h"
#include "base/require.h"

#include "scene/scene_part.h"

#include <math.h>
#include <string.h>

typedef struct request {
    const kt_robot_options *options;
    const char *folder; /* of the file; NULL: it is text */
} request;

/* An explanation of a root element that no reader accepts; "" if there is none. */
static const char *known_as(const char *name) {
    if (strcmp(name, "mujocoinclude") == 0)
        return "; this is a part of a model in MJCF, which a model includes";
    return "";
}

static bool is_expanded(kt_reader *r, const kt_element *root) {
    for (const kt_element *e = root->first; e != NULL; e = e->next)
        if (strncmp(e->name, "xacro:", 6) == 0)
            return kt_fault_put(r, KT_ERROR_SCENE, e->line, e->column,
                                "<%.40s> is for the macro processor xacro; run it first, and read what it writes",
                                e->name);
    return true;
}

static void read_robot(kt_reader *r, const char *path, const char *text, size_t size, const void *user,
                       kt_scene *scene) {
    const request *asked = user;
    kt_element *root = NULL;
    kt_robot_source source = {.options = asked->options, .path = path, .folder = asked->folder};
    if (!kt_xml_parse(r, text, size, &root, &source.late))
        return;
    source.root = root;
    if (source.options->keyframe != NULL && strcmp(root->name, "mujoco") != 0)
        (void)kt_fault_put(r, KT_ERROR_SCENE, root->line, root->column,
                           "keyframe '%.60s': there are keyframes in MJCF alone", source.options->keyframe);
    if (strcmp(root->name, "mujoco") == 0)
        kt_mjcf_scene(r, &source, scene);
    else if (kt_sdf_is_root(root))
        kt_sdf_scene(r, &source, scene);
    else if (strcmp(root->name, "robot") != 0)
        (void)kt_fault_put(
            r, KT_ERROR_SCENE, root->line, root->column,
            "a robot in URDF begins with <robot name=\"...\">, one in MJCF with <mujoco>, one in SDF with "
            "<sdf version=\"...\">, not with <%.40s>%s",
            root->name, known_as(root->name));
    else if (is_expanded(r, root))
        kt_urdf_scene(r, &source, scene);
}

static kt_status check_options(const kt_robot_options *o, kt_error *error) {
    if (o->mass_count < 0 || (o->mass_count > 0 && o->masses == NULL))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "", "masses must be an array of mass_count texts, not of %d",
                            o->mass_count);
    if ((unsigned)o->inertia > KT_ROBOT_INERTIA_ACCEPT || !(o->density >= 0.0) || !isfinite(o->density))
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "",
            "inertia is %d, density %g; give one of kt_robot_inertia, and a finite number, zero or above",
            (int)o->inertia, o->density);
    if (!isfinite(o->ground) || (o->has_ground && !o->contacts))
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "",
            "contacts is %s, has_ground %s, ground %g; a ground has a finite height, and needs contacts",
            o->contacts ? "true" : "false", o->has_ground ? "true" : "false", o->ground);
    if (isfinite(o->stop_stiffness) && o->stop_stiffness >= 0.0 && isfinite(o->stop_damping) && o->stop_damping >= 0.0)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_ARGUMENT, "",
                        "stop_stiffness and stop_damping cannot be %g and %g; give finite "
                        "numbers, zero or above",
                        o->stop_stiffness, o->stop_damping);
}

kt_status kt_robot_parse(const char *path, const char *text, size_t size, const kt_robot_options *options,
                         kt_scene *scene, kt_scene_report *report, void *user, kt_error *error) {
    kt_robot_options own = kt_robot_options_default();
    const kt_robot_options *o = KT_OPTIONS(kt_robot_options, ground, &own, options, error);
    if (o == NULL || KT_IS_MISSING(error, text || !size, scene))
        return KT_ERROR_ARGUMENT;
    const request asked = {o, NULL};
    const kt_status status = check_options(o, error);
    return status != KT_OK
               ? status
               : kt_format_parse((kt_format_choice){read_robot, &asked}, path, text, size, scene, report, user, error);
}

kt_status kt_robot_read(const char *path, const kt_robot_options *options, kt_scene *scene, kt_scene_report *report,
                        void *user, kt_error *error) {
    kt_robot_options own = kt_robot_options_default();
    const kt_robot_options *o = KT_OPTIONS(kt_robot_options, ground, &own, options, error);
    if (o == NULL || KT_IS_MISSING(error, path, scene))
        return KT_ERROR_ARGUMENT;
    const char *slash = strrchr(path, '/');
    const size_t length = slash == NULL ? 0 : slash == path ? 1 : (size_t)(slash - path);
    kt_pool pool = {0};
    const kt_status status = check_options(o, error);
    if (status != KT_OK)
        return status;
    const char *folder = slash != NULL ? kt_pool_text(&pool, path, length) : ".";
    const request asked = {o, folder};
    const kt_status read =
        folder != NULL ? kt_format_read((kt_format_choice){read_robot, &asked}, path, scene, report, user, error)
                       : kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for the path");
    kt_pool_free(pool.chunks);
    return read;
}
