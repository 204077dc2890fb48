/* Models in MJCF and URDF, read here and by today's MuJoCo (mujoco_wasm.mjs, by npm's @mujoco/mujoco). KT_MUJOCO_WASM
 * names its folder. At random states, mass matrix, bias force, places of bodies and accelerations are the same. The
 * forces of springs, dampers, motors and servos agree as well, and so do the residuals of equalities.
 *
 * Contacts, friction and the forces of equalities are left out in both: MuJoCo's are soft. Lengths of tendons are
 * coordinates here alone and follow from the joints. Ours are compared as `v = T v'`, `M' = T' M T`, `f' = T' f`.
 * KT_ROBOT_FILES names more files, separated by blanks. They may include files of the folder KT_ROBOT_ROOT. With
 * KT_ROBOT_KEYFRAME=k, the controls of their only keyframe act, if its name is `k`. A file that either reader rejects
 * is reported. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "folder.h"
#include "import_pair.h"

#include "draw.h"
#include "equality.h"
#include "files/scene/collect.h"
#include "match.h"
#include "node.h"

#include "kinetree/export.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { STATES = 20, FILES_MOST = 1000 };

static int equalities_compared, lengths_compared; /* of all files and states; of all files */

typedef struct findings {
    kt_worst weight, mass, bias, place, turn, force, acceleration, residual;
} findings;

/* ---- comparing --------------------------------------------------------------------------------------------------- */

static double largest(const double *values, size_t count) {
    double most = 1e-6;
    for (size_t i = 0; i < count; i++)
        most = fmax(most, fabs(values[i]));
    return most;
}

/* T' f */
static const double *reduce(const import_pair *p, const double *ours) {
    const int nv = kt_model_nv(p->model);
    for (int i = 0; i < p->theirs.nv; i++) {
        p->along[i] = 0.0;
        for (int k = 0; k < nv; k++)
            p->along[i] += p->of[i * nv + k] * ours[k];
    }
    return p->along;
}

/* The error is relative to the largest of theirs. If that is only rounding beside `terms`, the error is relative to a
 * share of `terms`. */
static void compare_vector(kt_worst *worst, const import_pair *p, const double *ours, const double *theirs,
                           double terms, double bound) {
    /* where all forces of an export cancel, rounding is that of forces of the size of the mass matrix */
    const double floor =
        p->is_ours ? fmax(1.0, largest(p->theirs.mass, (size_t)p->theirs.nv * (size_t)p->theirs.nv)) : 0.0;
    const double scale = fmax(largest(theirs, (size_t)p->theirs.nv), fmax(0.01 * terms, floor));
    for (int i = 0; i < p->theirs.nv; i++)
        kt_worst_near(worst, ours[i], theirs[i], bound * scale, "%d", i);
}

static void compare_matrix(kt_worst *worst, const import_pair *p, double bound) {
    const double scale = largest(p->theirs.mass, (size_t)p->theirs.nv * (size_t)p->theirs.nv);
    const int nv = kt_model_nv(p->model);
    for (int i = 0; i < p->theirs.nv; i++)
        for (int k = 0; k < nv; k++) {
            double sum = 0.0;
            for (int l = 0; l < nv; l++)
                sum += p->matrix[k + nv * l] * p->of[i * nv + l];
            p->product[i * nv + k] = sum;
        }
    for (int i = 0; i < p->theirs.nv; i++)
        for (int k = 0; k < p->theirs.nv; k++) {
            double sum = 0.0;
            for (int l = 0; l < nv; l++)
                sum += p->of[k * nv + l] * p->product[i * nv + l];
            kt_worst_near(worst, sum, p->theirs.mass[i * p->theirs.nv + k], bound * scale, "%d, %d", i, k);
        }
}

static void compare_places(const import_pair *p, findings *f) {
    for (int i = 1; i < p->theirs.body_count; i++) {
        const int b = p->theirs.bodies[i].placed;
        if (b < 0)
            continue;
        const kt_pose pose = kt_body_pose(p->model, p->data, b);
        const kt_vec3 x = pose.rotation.x, y = pose.rotation.y, z = pose.rotation.z;
        const double at[3] = {pose.position.x, pose.position.y, pose.position.z};
        const double rows[9] = {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
        const double scale = fmax(1.0, kt_vec3_norm(pose.position));
        for (int k = 0; k < 3; k++)
            kt_worst_near(&f->place, at[k], p->theirs.xpos[3 * i + k], 1e-14 * scale, "%s", p->theirs.bodies[i].name);
        for (int k = 0; k < 9; k++)
            kt_worst_near(&f->turn, rows[k], p->theirs.xmat[9 * i + k], 1e-14, "%s", p->theirs.bodies[i].name);
    }
}

/* The pose of our body of this name; NULL: the world. */
static kt_pose pose_of_body(const import_pair *p, const char *name) {
    const int index = name != NULL ? our_body(p->model, name) : 0;
    return index > 0 ? kt_body_pose(p->model, p->data, index) : kt_pose_identity();
}

/* The residual of a coupling of joints. False: it has other joints, such as lengths of tendons. */
static bool compare_coupling(const import_pair *p, const kt_loop *loop, double theirs, kt_worst *worst) {
    double at[COUPLING_TERMS], memory[COUPLING_FORMULA], size = fabs(loop->offset);
    const kt_expression *formula = NULL;
    if (!parse_coupling(loop, memory, &formula))
        return false;
    for (int k = 0; k < loop->term_count; k++) {
        const answer_joint *of = NULL;
        for (int j = 0; j < p->theirs.joint_count; j++)
            if (same_name(loop->terms[k].joint, p->theirs.joints[j].name))
                of = &p->theirs.joints[j];
        if (of == NULL)
            return false;
        at[k] = p->theirs.qpos[of->q];
        size += fabs(loop->terms[k].coefficient * at[k]);
    }
    kt_worst_near(worst, open_by(loop, formula, at), theirs, 1e-14 * fmax(1.0, size + fabs(theirs)), "%s", loop->name);
    return true;
}

/* Returns how many equalities are compared. */
static int compare_equalities(const import_pair *p, kt_worst *worst) {
    int compared = 0;
    for (int i = 0; i < p->theirs.equality_count; i++)
        for (int k = 0; k < p->scene.description.loop_count; k++) {
            const kt_loop *loop = &p->scene.description.loops[k];
            const double *theirs = p->theirs.residual + (size_t)6 * (size_t)i;
            if (loop->name == NULL || !same_name(loop->name, p->theirs.equalities[i]))
                continue;
            if (loop->type == KT_LOOP_COUPLING) {
                compared += compare_coupling(p, loop, *theirs, worst);
            } else {
                const kt_end *ends = loop->between;
                compare_ends(loop, pose_of_end(pose_of_body(p, ends[0].body), &ends[0]),
                             pose_of_end(pose_of_body(p, ends[1].body), &ends[1]), p->theirs.torquescales[i], theirs,
                             worst);
                compared++;
            }
        }
    return compared;
}

/* The file gives the masses. MuJoCo merges links of URDF that are fixed to each other. */
static void compare_masses(const import_pair *p, findings *f, double bound) {
    for (int i = 1; i < p->theirs.body_count; i++)
        if (p->theirs.bodies[i].ours >= 0) {
            const kt_body *b = &p->scene.description.bodies[kt_body_source(p->model, p->theirs.bodies[i].ours)];
            kt_worst_near(&f->weight, b->mass, p->theirs.bodies[i].mass, bound * p->theirs.bodies[i].mass, "%s",
                          p->theirs.bodies[i].name);
        }
}

static kt_status compute(import_pair *p) {
    kt_error error = {0};
    memset(p->a, 0, (size_t)kt_model_nv(p->model) * sizeof *p->a);
    kt_status status = p->has_paths ? kt_state_assemble(p->model, p->data, 0.0, p->q, p->v, &error) : KT_OK;
    if (status == KT_OK)
        status = kt_kinematics_update(p->model, p->data, p->q, p->v, NULL, &error);
    if (status == KT_OK)
        status = kt_dynamics_mass(p->model, p->data, p->q, p->matrix, &error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(p->model, p->data, p->q, p->v, p->a, NULL, p->tau, &error);
    return status;
}

static void compare_forces(import_pair *p, findings *f, double bound) {
    kt_error error = {0};
    if (kt_effect_forces(p->model, p->data, 0.0, p->q, p->v, p->tau, &error) != KT_OK)
        kt_worst_below(&f->force, (double)NAN, 0.0, "%s", error.message);
    compare_vector(&f->force, p, reduce(p, p->tau), p->theirs.force, 0.0, bound);
    if (p->is_ours) /* a rope of 100 links multiplies rounding by the condition number of its mass matrix */
        return;
    if (kt_acceleration_evaluate(p->model, p->data, 0.0, p->q, p->v, NULL, NULL, p->a, &error) != KT_OK)
        kt_worst_below(&f->acceleration, (double)NAN, 0.0, "%s", error.message);
    for (int i = 0; i < p->theirs.joint_count; i++) {
        const kt_coordinates c = kt_body_coordinates(p->model, p->theirs.joints[i].carrier);
        memcpy(p->along + p->theirs.joints[i].v, p->a + c.v, (size_t)c.nv * sizeof *p->a);
    }
    compare_vector(&f->acceleration, p, p->along, p->theirs.qacc, 0.0, 40.0 * bound);
}

/* The bound is that of matrices, forces and places; accelerations have forty times it. Returns how many equalities are
 * compared. */
static int compare_states(FILE *from, import_pair *p, double bound) {
    findings f = {kt_worst_make("masses"),        kt_worst_make("mass matrix"),
                  kt_worst_make("bias force"),    kt_worst_make("place, m"),
                  kt_worst_make("orientation"),   kt_worst_make("forces"),
                  kt_worst_make("accelerations"), kt_worst_make("residuals of equalities")};
    int equalities = 0;
    for (int n = 0; n < STATES; n++) {
        const bool is_read = read_state(from, &p->theirs);
        set_import_state(p);
        if (!is_read || compute(p) != KT_OK) {
            (void)kt_check_true(is_read ? "a state is computed" : "a state is read", false);
            return 0;
        }
        if (p->theirs.activation_count > 0 && kt_auxiliary_state_count(p->model) == p->theirs.activation_count)
            memcpy(kt_auxiliary_states(p->model, p->data), p->theirs.act,
                   (size_t)p->theirs.activation_count * sizeof *p->theirs.act);
        if (!p->has_paths) { /* else accelerations have the armatures */
            compare_matrix(&f.mass, p, bound);
            compare_vector(&f.bias, p, reduce(p, p->tau), p->theirs.bias,
                           largest(p->theirs.mass, (size_t)p->theirs.nv * (size_t)p->theirs.nv), bound);
        }
        compare_places(p, &f);
        equalities += compare_equalities(p, &f.residual);
        if (p->is_tree)
            compare_forces(p, &f, bound);
    }
    compare_masses(p, &f, bound);
    const kt_worst *all[] = {&f.weight, &f.mass, &f.bias, &f.place, &f.turn, &f.force, &f.acceleration, &f.residual};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        if (all[i]->count > 0)
            kt_check_worst(all[i]);
    return equalities;
}

/* A model and the bound of its mass matrix, bias and forces, as a part of their largest entry. */
typedef struct model_file {
    const char *path;
    double bound;
    const char *keyframe;       /* whose controls act; NULL: none */
    bool is_ours, is_only_read; /* an export of a scene; one of which MuJoCo makes other bodies and joints (URDF) */
} model_file;

/* Returns whether both read the next file. If either rejects it, the test reports this. */
static bool compare_next(FILE *from, const model_file *file) {
    const kt_robot_options options = {.keyframe = file->keyframe, .allow = getenv("KT_ROBOT_ROOT")};
    const char *path = file->path;
    import_pair p = {.q = NULL, .is_ours = file->is_ours};
    bool read = false;
    kt_note("%s", path);
    if (is_read_by_mujoco(from, path) && kt_check_true("it is described", read_header(from, &p.theirs))) {
        read = !file->is_only_read && load_import_pair(&p, path, &options) && match_import_pair(&p);
        lengths_compared += p.lengths;
        for (int n = 0; n < STATES && !read; n++)
            (void)read_state(from, &p.theirs);
        if (read)
            equalities_compared += compare_states(from, &p, file->bound);
        read = read || file->is_only_read;
    }
    release_import_pair(&p);
    return read;
}

/* All files are answered by one process. Returns how many both read; -1: nobody answers here. */
static int compare_files(const model_file *files, int count) {
    static const char *paths[FILES_MOST];
    char states[20];
    int read = 0;
    if (!has_mujoco() || !kt_check_true("there is room", count <= FILES_MOST))
        return -1;
    for (int i = 0; i < count; i++)
        paths[i] = files[i].path;
    (void)snprintf(states, sizeof states, "%d", STATES);
    FILE *from = ask_mujoco(states, paths, count);
    if (from == NULL)
        return -1;
    for (int i = 0; i < count; i++)
        read += compare_next(from, &files[i]);
    end_answers(from);
    return read;
}

/* MuJoCo stores the vertices of meshes as single-precision numbers. The error is 6e-8 of their size, and an inertia has
 * several of them. */
KT_TEST(models_are_those_that_mujoco_of_today_reads) {
    static const model_file files[] = {
        {KT_MODELS "/mjcf/tree.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/masses.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/ties.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/arm.urdf", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/tendons.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/meshes.xml", 1e-9, NULL, false, false},
        {KT_MODELS "/mjcf/servos.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/attach.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/spatial.xml", 1e-13, "k", false, false},
        {KT_MODELS "/mjcf/medium.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/muscles.xml", 1e-13, "k", false, false},
        {KT_MODELS "/mjcf/wraps.xml", 1e-13, NULL, false, false},
        {KT_MODELS "/mjcf/armature.xml", 1e-13, NULL, false, false},
        {KT_MODELS "/mjcf/fields.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/aligned.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/fitted.xml", 1e-12, NULL, false, false},
        {KT_MODELS "/mjcf/fitted_boxes.xml", 1e-6, NULL, false, false},
        {KT_MODELS "/mjcf/defaults.xml", 1e-10, "k", false, false}, /* MuJoCo subtracts two ellipsoids */
        {KT_MODELS "/extended.urdf", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/bounds.xml", 4e-14, NULL, false, false},
        {KT_MODELS "/mjcf/thrusters.xml", 1e-13, "k", false, false},
        {KT_MODELS "/mjcf/places.xml", 4e-14, "k", false, false},
        {KT_MODELS "/mjcf/heavier.xml", 4e-14, NULL, false, false},
    };
    equalities_compared = 0;
    const int count = (int)(sizeof files / sizeof *files), read = compare_files(files, count);
    if (read >= 0) {
        kt_check_equal_int("files that both read", read, count);
        kt_check_equal_int("equalities compared", equalities_compared,
                           (8 + 3) * STATES); /* of ties.xml and attach.xml */
    }
}

KT_TEST(files_that_are_named_are_those_that_mujoco_of_today_reads) {
    static model_file files[FILES_MOST];
    const char *named = getenv("KT_ROBOT_FILES");
    char list[100000];
    int count = 0;
    if (named == NULL) {
        kt_skip("files that are named", "KT_ROBOT_FILES names none");
        return;
    }
    (void)snprintf(list, sizeof list, "%s", named);
    for (char *path = strtok(list, " \n"); path != NULL && count < FILES_MOST; path = strtok(NULL, " \n"))
        files[count++] = (model_file){path, 1e-7, getenv("KT_ROBOT_KEYFRAME"), false, false}; /* vertices of meshes */
    const int read = compare_files(files, count);
    if (read >= 0)
        kt_note("%d of %d files are read by both", read, count);
}

/* Draws models, and compares them with a bound for masses and forces. */
static void compare_random(int count, bool has_meshes, double bound) {
    enum { MOST = 150 };
    static model_file files[MOST];
    static char paths[MOST][80];
    const char *folder = kt_test_folder();
    kt_random random = kt_random_of_test();
    kt_need(count <= MOST || kt_check_true("there is room", false));
    for (int i = 0; i < count; i++) {
        (void)snprintf(paths[i], sizeof paths[i], "%s/%d.xml", folder, i);
        files[i] = (model_file){paths[i], bound, "k", false, false};
        FILE *to = fopen(paths[i], "w");
        const bool is_written = to != NULL && draw_mjcf(to, &random, has_meshes);
        (void)kt_check_true("it is written", to != NULL && fclose(to) == 0 && is_written);
    }
    lengths_compared = equalities_compared = 0;
    const int read = compare_files(files, count);
    if (read >= 0) {
        kt_check_equal_int("models that both read", read, count);
        kt_check_above("lengths of tendons", lengths_compared, 0.1 * count);
        kt_check_above("equalities", equalities_compared, 0.5 * count * STATES);
    }
}

/* Random models of all features that decide forces and accelerations. They have bounds of actuators, joints and tendons
 * (for one or several), springs, dampers, tendons with armature, flags, masses by shells, and frames of inertia. Forces
 * and masses agree to rounding, although the masses of small geoms within large ones lose digits. Accelerations lose as
 * many digits as the mass matrix, and agree to 1e-7. */
KT_TEST(random_models_have_the_accelerations_that_mujoco_of_today_computes) { compare_random(150, false, 2.5e-10); }

/* Meshes of each rule, of faces or of vertices alone. MuJoCo's axes of their inertia are off by up to 1e-8, and a light
 * body with a spring-damper of its own inertia multiplies that. */
KT_TEST(random_meshes_have_the_masses_that_mujoco_of_today_computes) { compare_random(60, true, 1e-6); }

/* ---- exports ----------------------------------------------------------------------------------------------------- */

enum { EXPORTS_MOST = 400, EXPORT_NAME = 120 };

/* Writes a scene in a format. Returns whether it could be; URDF lacks some joints, for which there is a reason. */
static bool write_export(const kt_scene *scene, kt_robot_format format, const char *folder, const char *path) {
    kt_error error = {0};
    FILE *file = fopen(path, "w");
    if (!kt_check_true("a file is opened", file != NULL))
        return false;
    const kt_status status = kt_robot_write_scene(scene, format, folder, file, NULL, NULL, &error);
    (void)fclose(file);
    if (status == KT_OK)
        return true;
    (void)kt_check_true("URDF lacks a joint", format == KT_ROBOT_URDF && strstr(error.message, "URDF has no ") != NULL);
    return false;
}

/* MuJoCo reads every export of a bundled scene, and finds the same model as our reader. */
KT_TEST(exports_of_bundled_scenes_are_read_by_mujoco_of_today) {
    static char names[EXPORTS_MOST][EXPORT_NAME];
    static model_file files[EXPORTS_MOST];
    const char *folder = kt_test_folder();
    const int scenes = kt_bundled_count();
    int count = 0;
    if (!has_mujoco())
        return;
    for (int i = 0; i < scenes; i++) {
        const kt_scene *scene = kt_test_bundled(kt_bundled(i));
        for (int format = 0; format < 2 && count < EXPORTS_MOST; format++) {
            (void)snprintf(names[count], EXPORT_NAME, "%s/%.60s.%s", folder, kt_bundled(i),
                           format == KT_ROBOT_URDF ? "urdf" : "xml");
            files[count] = (model_file){names[count], 1e-12, NULL, true, format == KT_ROBOT_URDF};
            count += write_export(scene, (kt_robot_format)format, folder, names[count]);
        }
    }
    equalities_compared = 0;
    const int read = compare_files(files, count);
    kt_note("%d exports of %d scenes; %d equalities", count, scenes, equalities_compared);
    kt_check_above("exports", count, 2 * scenes - 10);
    kt_check_equal_int("exports that both read", read, count);
    kt_check_above("equalities", equalities_compared, 100.0);
}
