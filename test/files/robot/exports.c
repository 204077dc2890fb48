/* Exports, read by today's MuJoCo (mujoco_wasm.mjs; KT_MUJOCO_WASM names its folder), against the mechanism that was
 * written. Other tests read an export back; here nothing reads it but MuJoCo.
 *
 * KT_ROBOT_FILES names robots, separated by blanks, which are imported and exported. Without it those of the tests'
 * data are taken. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "export_pair.h"
#include "files/scene/collect.h"
#include "folder.h"

#include "check.h"
#include "node.h"
#include "random.h"

#include "kinetree/import.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { STATES = 5, FILES = 800, PLATES = 40 };

typedef struct findings {
    kt_worst mass, bias;
} findings;

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static void hear_of_change(void *user, const char *what, int count) {
    exported *e = user;
    const char *found = strstr(what, "are raised, by at most ");
    if (found != NULL)
        e->raised = strtod(found + strlen("are raised, by at most "), NULL);
    e->is_changed = e->is_changed || strstr(what, " kg") != NULL;
    if (getenv("KT_ROBOT_FILES") != NULL)
        kt_note("%s: %d %s", e->path, count, what);
}

/* Returns whether it is written. URDF lacks some joints, for which there is a
 * reason. */
static bool write_export(exported *e, const char *folder) {
    kt_error error = {0};
    FILE *file = fopen(e->path, "w");
    if (file == NULL)
        return kt_check_true("a file is opened", false);
    const kt_status status = kt_robot_write_scene(&e->scene, e->format, folder, file, hear_of_change, e, &error);
    (void)fclose(file);
    for (int i = 0; i < e->scene.description.body_count; i++)
        e->has_screw = e->has_screw || e->scene.description.bodies[i].joint.type == KT_JOINT_SCREW;
    if (status == KT_OK)
        return true;
    (void)remove(e->path);
    kt_note("%s: %s: %s", e->source, error.where, error.message);
    (void)kt_check_true("URDF lacks a joint",
                        e->format == KT_ROBOT_URDF && strstr(error.message, "URDF has no ") != NULL);
    return false;
}

/* ---- comparing --------------------------------------------------------------------------------------------------- */

/* T' M T for T with `columns` columns, and T' f. */
static void reduce(const double *t, const double *m, const double *f, int rows, int columns, double *mass,
                   double *force) {
    for (int i = 0; i < columns; i++) {
        force[i] = 0.0;
        for (int r = 0; r < rows; r++)
            force[i] += t[i * rows + r] * f[r];
        for (int k = 0; k < columns; k++) {
            double sum = 0.0;
            for (int r = 0; r < rows; r++)
                for (int s = 0; s < rows && t[i * rows + r] != 0.0; s++)
                    sum += t[i * rows + r] * m[r * rows + s] * t[k * rows + s];
            mass[i * columns + k] = sum;
        }
    }
}

static double largest(const double *values, int count) {
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(values[i]));
    return most;
}

static bool compute(const export_pair *p) {
    kt_error error = {0};
    kt_status status = kt_kinematics_update(p->model, p->data, p->q, p->v, NULL, &error);
    if (status == KT_OK)
        status = kt_dynamics_mass(p->model, p->data, p->q, p->matrix, &error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(p->model, p->data, p->q, p->v, p->zero, NULL, p->tau, &error);
    return status == KT_OK || kt_check_true(error.message, false);
}

/* The largest distance of two bodies, or of a body and the world, in each direction. */
static double farthest(const export_pair *p) {
    double least[3] = {0.0, 0.0, 0.0}, most[3] = {0.0, 0.0, 0.0}, sum = 0.0;
    for (int i = 1; i < kt_model_body_count(p->model); i++) {
        const kt_vec3 x = kt_body_pose(p->model, p->data, i).position;
        const double at[3] = {x.x, x.y, x.z};
        for (int k = 0; k < 3; k++) {
            least[k] = fmin(least[k], at[k]);
            most[k] = fmax(most[k], at[k]);
        }
    }
    for (int k = 0; k < 3; k++)
        sum += (most[k] - least[k]) * (most[k] - least[k]);
    return sqrt(sum);
}

/* Bodies that got a mass have up to 2e-14 kg, at a distance from the axes. */
static void compare_state(const export_pair *p, findings *f, double worst[2]) {
    const int nv = kt_model_nv(p->model), nw = p->theirs.nv;
    double *ours = p->forces, *theirs = p->forces + nv;
    const double reach = farthest(p), least = 2e-14 * (1.0 + reach * reach);
    const double slack = p->file->is_changed ? kt_model_body_count(p->model) * (p->file->raised + least) : 0.0;
    reduce(p->a, p->matrix, p->tau, nv, nv, p->left, ours);
    reduce(p->b, p->theirs.mass, p->theirs.bias, nw, nv, p->right, theirs);
    const double mass = largest(p->right, nv * nv), bias = fmax(mass, largest(theirs, nv));
    for (int i = 0; i < nv * nv; i++) {
        worst[0] = fmax(worst[0], fabs(p->left[i] - p->right[i]) / mass);
        kt_worst_near(&f->mass, p->left[i], p->right[i], 1e-12 * mass + slack, "%s, %d %d", p->file->path, i / nv,
                      i % nv);
    }
    for (int i = 0; i < nv; i++) {
        worst[1] = fmax(worst[1], fabs(ours[i] - theirs[i]) / bias);
        kt_worst_near(&f->bias, ours[i], theirs[i], 1e-12 * bias + 10.0 * slack, "%s, %d", p->file->path, i);
    }
}

typedef struct counts {
    int written, read, compared, without_joints, turned; /* turned: upright, of those compared */
} counts;

static void compare_next(FILE *from, const exported *file, findings *f, counts *n) {
    export_pair p = {.file = file};
    double worst[2] = {0.0, 0.0};
    if (!is_read_by_mujoco(from, file->path)) {
        kt_note("%s", file->source);
        return;
    }
    n->read++;
    if (!read_header(from, &p.theirs)) {
        (void)kt_check_true("the model is described", false);
        return;
    }
    const bool is_same = !file->has_screw && load_export_pair(&p);
    bool is_mapped = is_same;
    for (int i = 0; i < STATES; i++) {
        if (!read_state(from, &p.theirs)) {
            (void)kt_check_true("a state is read", false);
            break;
        }
        is_mapped = is_mapped && map_export_pair(&p);
        if (is_mapped && compute(&p))
            compare_state(&p, f, worst);
    }
    n->compared += is_mapped;
    n->turned += is_mapped && is_turned_upright(file);
    n->without_joints += is_mapped && kt_model_nv(p.model) == 0;
    kt_note("%s %s: nv %d, mass matrix %.1e, bias %.1e%s", file->source,
            file->format == KT_ROBOT_URDF ? "URDF" : "MJCF", p.theirs.nv, worst[0], worst[1],
            is_mapped ? "" : ", not compared");
    release_export_pair(&p);
}

static bool compare_files(const exported *files, int count, counts *n) {
    static const char *paths[FILES];
    findings f = {kt_worst_make("mass matrix"), kt_worst_make("bias force")};
    char states[20];
    for (int i = 0; i < count; i++)
        paths[i] = files[i].path;
    (void)snprintf(states, sizeof states, "%d", STATES);
    FILE *from = ask_mujoco(states, paths, count);
    if (from == NULL)
        return false;
    for (int i = 0; i < count; i++)
        compare_next(from, &files[i], &f, n);
    end_answers(from);
    kt_check_worst(&f.mass);
    kt_check_worst(&f.bias);
    return true;
}

/* Writes both formats of what `read` has made of a file. */
static int add_exports(exported *files, int count, const char *source, const char *folder,
                       kt_status (*read)(const char *, kt_scene *, kt_error *)) {
    for (int format = 0; format < 2 && count < FILES; format++) {
        exported *e = &files[count];
        kt_error error = {0};
        *e = (exported){.format = (kt_robot_format)format};
        (void)snprintf(e->source, sizeof e->source, "%s", source);
        (void)snprintf(e->path, sizeof e->path, "%s/%d.%s", folder, count, format == KT_ROBOT_URDF ? "urdf" : "xml");
        if (read(source, &e->scene, &error) != KT_OK) {
            kt_note("%s: %s: %s", source, error.where, error.message);
            return count;
        }
        if (write_export(e, folder))
            count++;
        else
            kt_scene_free(&e->scene);
    }
    return count;
}

static void free_exports(exported *files, int count) {
    for (int i = 0; i < count; i++) {
        kt_scene_free(&files[i].scene);
    }
}

static kt_status read_scene(const char *path, kt_scene *scene, kt_error *error) {
    return kt_scene_read(path, scene, NULL, NULL, error);
}

static kt_status read_robot(const char *path, kt_scene *scene, kt_error *error) {
    const kt_robot_options options = {.allow = getenv("KT_ROBOT_ROOT")};
    return kt_robot_read(path, &options, scene, NULL, NULL, error);
}

static exported exports[FILES];

KT_TEST(exports_of_bundled_scenes_have_the_masses_of_the_scenes_in_mujoco) {
    const char *folder = kt_test_folder();
    counts n = {0};
    if (!has_mujoco())
        return;
    for (int i = 0; kt_bundled(i) != NULL; i++)
        n.written = add_exports(exports, n.written, kt_bundled_path(kt_bundled(i)), folder, read_scene);
    if (compare_files(exports, n.written, &n)) {
        kt_note("%d exports of %d scenes: %d read, %d compared, %d turned upright", n.written, kt_bundled_count(),
                n.read, n.compared, n.turned);
        kt_check_equal_int("exports that MuJoCo reads", n.read, n.written);
        kt_check_above("exports that are compared", n.compared, n.written - 2);
        kt_check_above("turned upright", n.turned, 0);
    }
    free_exports(exports, n.written);
}

/* Compares both exports of a robot that is given as a text. */
static bool compare_text(const char *text, int written, int compared) {
    const char *folder = kt_test_folder();
    counts n = {0};
    if (!has_mujoco())
        return false;
    n.written = add_exports(exports, 0, kt_test_file(folder, "robot.urdf", text), folder, read_robot);
    if (compare_files(exports, n.written, &n)) {
        kt_check_equal_int("exports", n.written, written);
        kt_check_equal_int("exports that MuJoCo reads", n.read, written);
        kt_check_equal_int("exports that are compared", n.compared, compared);
    }
    free_exports(exports, n.written);
    return true;
}

/* A link with moments and without mass that is fixed to another: MuJoCo merges
 * both. */
KT_TEST(exports_keep_the_inertia_of_links_without_mass) {
    static const char text[] = "<robot name='r'><link name='b'/><link name='a'><inertial><mass "
                               "value='1'/><inertia ixx='.1' iyy='.1' izz='.1' "
                               "ixy='0' ixz='0' iyz='0'/></inertial></link><link "
                               "name='c'><inertial><mass value='0'/><inertia ixx='.2' "
                               "iyy='.2' izz='.3' ixy='0' ixz='0' iyz='0'/></inertial></link><joint "
                               "name='j' type='continuous'><parent "
                               "link='b'/><child link='a'/><axis xyz='0 0 1'/></joint><joint name='k' "
                               "type='fixed'><parent link='a'/><child "
                               "link='c'/></joint></robot>";
    (void)compare_text(text, 2, 2);
}

/* Sensors whose moments no body has, on a link with right ones. MuJoCo judges each link, and the export gives their
 * mass to that link. */
KT_TEST(exports_keep_rigid_parts_with_wrong_moments_of_fixed_links) {
    static const char text[] =
        "<robot name='r'><link name='b'/><link name='a'><inertial><origin xyz='.1 0 .05' rpy='.1 .2 .3'/><mass "
        "value='2'/><inertia ixx='.1' iyy='.12' izz='.15' ixy='.01' ixz='0' iyz='0'/></inertial></link>"
        "<link name='s'><inertial><origin xyz='0 .02 0'/><mass value='.05'/><inertia ixx='.001' iyy='.001' izz='.01' "
        "ixy='0' ixz='0' iyz='0'/></inertial></link><link name='t'><inertial><origin xyz='0 0 .3' rpy='1 0 0'/><mass "
        "value='.1'/><inertia ixx='.01' iyy='.001' izz='.001' ixy='.0001' ixz='0' iyz='0'/></inertial></link>"
        "<joint name='j' type='continuous'><parent link='b'/><child link='a'/><axis xyz='.6 0 .8'/></joint>"
        "<joint name='k' type='fixed'><parent link='a'/><child link='s'/><origin xyz='.1 .2 .3' rpy='.4 .5 "
        ".6'/></joint>"
        "<joint name='l' type='fixed'><parent link='s'/><child link='t'/><origin xyz='.3 .2 .1' rpy='.6 .5 "
        ".4'/></joint>"
        "</robot>";
    if (compare_text(text, 2, 2))
        kt_check_true("no moment is raised", !exports[0].is_changed && !exports[1].is_changed);
}

/* MuJoCo's bodies have at most six coordinates: those of a long chain of links without mass are on several. */
KT_TEST(exports_of_long_chains_without_mass_are_read_by_mujoco) {
    static const char *const axes[] = {"1 0 0", "0 1 0", "0 0 1"};
    static char text[8000];
    enum { LINKS = 15 };
    size_t length = (size_t)snprintf(text, sizeof text, "<mujoco><worldbody>");
    for (int i = 0; i < LINKS; i++)
        length +=
            (size_t)snprintf(text + length, sizeof text - length,
                             "<body pos='.1 0 .2' euler='10 20 30'><joint axis='%s' armature='.1'/>", axes[i % 3]);
    length += (size_t)snprintf(text + length, sizeof text - length, "<geom size='.1' mass='1'/>");
    for (int i = 0; i < LINKS; i++)
        length += (size_t)snprintf(text + length, sizeof text - length, "</body>");
    (void)snprintf(text + length, sizeof text - length, "</worldbody></mujoco>");
    (void)compare_text(text, 2, 1); /* URDF has no armature */
}

/* Plates have a + b = c. MuJoCo turns the matrices of URDF, and its rounding
 * must not make a + b < c. */
static bool write_plates(const char *path, kt_random *random) {
    FILE *to = fopen(path, "w");
    if (to == NULL)
        return kt_check_true("a file is opened", false);
    fputs("<robot name='plates'><link name='b0'/>", to);
    for (int i = 1; i <= PLATES; i++) {
        const double a = kt_random_uniform(random, 1e-3, 1.0), b = kt_random_uniform(random, 1e-3, 1.0);
        fprintf(to,
                "<link name='b%d'><inertial><origin rpy='%.17g %.17g %.17g'/><mass "
                "value='1'/>",
                i, kt_random_uniform(random, -3.0, 3.0), kt_random_uniform(random, -1.5, 1.5),
                kt_random_uniform(random, -3.0, 3.0));
        fprintf(to,
                "<inertia ixx='%.17g' iyy='%.17g' izz='%.17g' ixy='0' ixz='0' "
                "iyz='0'/></inertial></link>",
                a, b, a + b);
        fprintf(to,
                "<joint name='j%d' type='continuous'><parent link='b%d'/><child "
                "link='b%d'/><origin xyz='%.17g 0 .1'/>"
                "<axis xyz='0 1 0'/></joint>",
                i, (i - 1) / 3, i, kt_random_uniform(random, -1.0, 1.0));
    }
    fputs("</robot>\n", to);
    return fclose(to) == 0;
}

KT_TEST(exports_of_plates_at_odd_angles_are_read_by_mujoco) {
    const char *folder = kt_test_folder();
    char path[LINE];
    kt_random random = kt_random_of_test();
    counts n = {0};
    if (!has_mujoco())
        return;
    (void)snprintf(path, sizeof path, "%s/plates.urdf", folder);
    for (int i = 0; i < 4 && write_plates(path, &random); i++)
        n.written = add_exports(exports, n.written, path, folder, read_robot);
    if (compare_files(exports, n.written, &n)) {
        kt_check_equal_int("exports", n.written, 8);
        kt_check_equal_int("exports that MuJoCo reads", n.read, n.written);
        kt_check_equal_int("exports that are compared", n.compared, n.written);
    }
    free_exports(exports, n.written);
}

KT_TEST(exports_of_robots_have_the_masses_of_the_robots_in_mujoco) {
    static const char *const own[] = {
        KT_MODELS "/mjcf/tree.xml",   KT_MODELS "/mjcf/masses.xml",  KT_MODELS "/mjcf/ties.xml",
        KT_MODELS "/arm.urdf",        KT_MODELS "/mjcf/tendons.xml", KT_MODELS "/mjcf/meshes.xml",
        KT_MODELS "/mjcf/servos.xml", KT_MODELS "/mjcf/attach.xml",  KT_MODELS "/mjcf/spatial.xml",
        KT_MODELS "/mjcf/medium.xml", KT_MODELS "/mjcf/muscles.xml", KT_MODELS "/mjcf/wraps.xml",
    };
    static char list[400000];
    const char *folder = kt_test_folder();
    const char *named = getenv("KT_ROBOT_FILES");
    counts n = {0};
    int robots = 0;
    if (!has_mujoco())
        return;
    if (named != NULL) {
        (void)snprintf(list, sizeof list, "%s", named);
        for (char *path = strtok(list, " \n"); path != NULL; path = strtok(NULL, " \n"), robots++)
            n.written = add_exports(exports, n.written, path, folder, read_robot);
    } else {
        for (; robots < (int)(sizeof own / sizeof *own); robots++)
            n.written = add_exports(exports, n.written, own[robots], folder, read_robot);
    }
    if (compare_files(exports, n.written, &n)) {
        kt_note("%d exports of %d robots: %d read, %d compared, %d without joints", n.written, robots, n.read,
                n.compared, n.without_joints);
        kt_check_equal_int("exports that MuJoCo reads", n.read, n.written);
    }
    free_exports(exports, n.written);
}
