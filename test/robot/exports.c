/* Exports, read by today's MuJoCo (mujoco_wasm.mjs; KT_MUJOCO_WASM names its
 * folder), against the mechanism that was written. Other tests read an export
 * back; here nothing reads it but MuJoCo.
 *
 * Let y be our velocities, except those of lengths that an export drops. With v
 * = A y for ours and w = B y for theirs, mass matrices and bias forces satisfy
 *
 *     A' M A = B' N B,    A' f = B' g.
 *
 * A free joint counts from the world in theirs: P is our joint frame, turned as
 * URDF turns a mechanism whose gravity is not along -z. Then p = P q for
 * positions, and B has the rotation of P.
 *
 * KT_ROBOT_FILES names robots, separated by blanks, which are imported and
 * exported. Without it those of the tests' data are taken. */
#include "../scene_files.h"
#include "answer.h"
#include "check.h"
#include "match.h"
#include "numbers.h"
#include "random.h"

#include "kinetree/export.h"
#include "kinetree/import.h"
#include "kinetree/kinetree.h"
#include "model/joint_name.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { STATES = 5, FILES = 800, LINE = 600, PLATES = 40 };

/* An export: of which scene, in which format, and what its writer reported. */
typedef struct exported {
    char source[LINE], path[120];
    kt_robot_format format;
    double raised;  /* the largest moment of inertia that was added */
    bool has_screw; /* a screw has become a hinge and a slide */
    kt_scene scene;
} exported;

typedef struct pair {
    const exported *file;
    answer theirs;
    kt_model *model;
    kt_data *data;
    double *a, *b;                                               /* A and B, a column for each y */
    double *q, *v, *zero, *tau, *matrix, *left, *right, *forces; /* forces: A' f and B' g */
} pair;

typedef struct findings {
    kt_worst mass, bias;
} findings;

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static void hear_of_change(void *user, const char *what, int count) {
    exported *e = user;
    const char *found = strstr(what, "are raised, by at most ");
    if (found != NULL)
        e->raised = strtod(found + strlen("are raised, by at most "), NULL);
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

/* ---- our model --------------------------------------------------------------------------------------------------- */

/* Whether URDF turns the mechanism, so that its gravity is along -z. */
static bool is_turned(const exported *e) {
    const kt_vec3 g = e->scene.description.gravity;
    return e->format == KT_ROBOT_URDF && (g.x != 0.0 || g.y != 0.0 || g.z > 0.0);
}

/* Compiles the tree. Parts that only loops move need the loops. URDF has no
 * armature, and one size of gravity. */
static kt_status compile(pair *p, kt_error *error) {
    kt_description d = p->file->scene.description;
    kt_body *bodies = calloc((size_t)d.body_count + 1, sizeof *bodies);
    if (bodies == NULL)
        return KT_ERROR_MEMORY;
    for (int i = 0; i < d.body_count; i++) {
        bodies[i] = d.bodies[i];
        bodies[i].variable_mass = NULL; /* exports have the masses of the start */
        if (p->file->format == KT_ROBOT_URDF)
            memset(bodies[i].joint.armature, 0, sizeof bodies[i].joint.armature);
    }
    d.bodies = bodies;
    if (p->file->format == KT_ROBOT_URDF)
        d.gravity =
            is_turned(p->file) ? kt_vec3_scale(9.81, kt_vec3_normalize(d.gravity)) : kt_vec3_make(0.0, 0.0, -9.81);
    d.effect_count = d.hold_count = 0;
    const int loops = d.loop_count;
    d.loop_count = 0;
    kt_status status = kt_model_compile(&d, NULL, &p->model, error);
    d.loop_count = loops;
    if (status != KT_OK && status != KT_ERROR_MEMORY)
        status = kt_model_compile(&d, NULL, &p->model, error);
    free(bodies);
    return status;
}

static bool load(pair *p) {
    kt_error error = {0};
    if (compile(p, &error) != KT_OK || kt_data_create(p->model, &p->data, &error) != KT_OK) {
        kt_note("%s: %s", error.where, error.message);
        return false;
    }
    const size_t nq = (size_t)kt_model_nq(p->model), nv = (size_t)kt_model_nv(p->model), nw = (size_t)p->theirs.nv;
    const size_t square = nv * nv;
    return TAKE_NUMBERS({&p->q, nq}, {&p->v, nv}, {&p->zero, nv}, {&p->tau, nv}, {&p->matrix, square}, {&p->a, square},
                        {&p->b, nw * nv}, {&p->left, square}, {&p->right, square}, {&p->forces, 2 * nv});
}

static void release(pair *p) {
    kt_data_free(p->data);
    kt_model_free(p->model);
    free(p->q);
    release_answer(&p->theirs);
}

/* ---- coordinates ------------------------------------------------------------------------------------------------- */

/* Their joint NAME, or NAME with an ending; NULL: there is none. */
static const answer_joint *find_joint(const pair *p, const char *name, const char *ending) {
    char whole[2 * NAME];
    (void)snprintf(whole, sizeof whole, "%s%s", name, ending);
    for (int i = 0; i < p->theirs.joint_count; i++)
        if (strcmp(p->theirs.joints[i].name, whole) == 0)
            return &p->theirs.joints[i];
    return NULL;
}

/* Part k of a joint of several coordinates. */
static const answer_joint *find_part(const pair *p, const char *name, int k) {
    char ending[16];
    static const char *const of_urdf[] = {"_TX", "_TY", "_RZ"};
    (void)snprintf(ending, sizeof ending, "__%d", k);
    const answer_joint *found = find_joint(p, name, k > 0 ? ending : "");
    return found == NULL && k < 3 ? find_joint(p, name, of_urdf[k]) : found;
}

/* Our coordinates c + first + k are theirs along the columns of a rotation,
 * from a point: v = R' w. */
static void map_vector(pair *p, kt_coordinates c, int first, const answer_joint *const theirs[3], int count,
                       kt_mat3 rotation, kt_vec3 from) {
    const kt_vec3 columns[3] = {rotation.x, rotation.y, rotation.z};
    const double origin[3] = {from.x, from.y, from.z};
    for (int k = 0; k < count; k++) {
        const double column[3] = {columns[k].x, columns[k].y, columns[k].z};
        p->q[c.q + first + k] = 0.0;
        p->v[c.v + first + k] = 0.0;
        for (int l = 0; l < count; l++) {
            const int at = theirs[0] == theirs[count - 1] ? l : 0; /* a free joint has all three */
            p->b[(c.v + first + k) * p->theirs.nv + theirs[l]->v + at] = column[l];
            p->q[c.q + first + k] += column[l] * (p->theirs.qpos[theirs[l]->q + at] - origin[l]);
            p->v[c.v + first + k] += column[l] * p->theirs.qvel[theirs[l]->v + at];
        }
    }
}

static void map_ball(pair *p, kt_coordinates c, int first_q, int first_v, const double *quat, int v, kt_quat before) {
    const kt_quat q = kt_quat_multiply(before, kt_quat_make(quat[0], quat[1], quat[2], quat[3]));
    const double values[4] = {q.w, q.x, q.y, q.z};
    memcpy(p->q + c.q + first_q, values, sizeof values);
    for (int k = 0; k < 3; k++) {
        p->v[c.v + first_v + k] = p->theirs.qvel[v + k];
        p->b[(c.v + first_v + k) * p->theirs.nv + v + k] = 1.0;
    }
}

/* The frame that a free joint of ours counts from, in the world of theirs. */
static kt_pose frame_in_theirs(const pair *p, const kt_body *body) {
    kt_pose own = {.position = body->joint.at, .rotation = kt_mat3_identity()}, turn = kt_pose_identity();
    if (body->joint.rotation.type != KT_ROTATION_NONE)
        (void)!kt_rotation_evaluate(&body->joint.rotation, &own.rotation, NULL);
    if (is_turned(p->file)) /* about the vertical nothing depends on the angle */
        turn.rotation = kt_mat3_transpose(
            kt_triad_from_axis(kt_vec3_scale(-1.0, kt_vec3_normalize(p->file->scene.description.gravity)), 2));
    return kt_pose_compose(turn, own);
}

/* MuJoCo's frame of a planar joint: the shortest turn from z to the axis, by
 * which it takes x and y. */
static kt_mat3 planar_frame(kt_vec3 axis) {
    const kt_vec3 u = kt_vec3_normalize(axis), z = kt_vec3_make(0.0, 0.0, 1.0), w = kt_vec3_cross(z, u);
    const double sine = kt_vec3_norm(w), angle = atan2(sine, u.z);
    if (sine < 1e-10)
        return u.z > 0.0 ? kt_mat3_identity() : kt_matrix_about(0, 3.14159265358979323846);
    return kt_matrix_from_euler_vector(kt_vec3_scale(angle / sine, w));
}

static bool map_free(pair *p, const kt_body *body, kt_coordinates c, const answer_joint *first) {
    const answer_joint *const all[3] = {first, find_part(p, kt_joint_name_of(body), 1),
                                        find_part(p, kt_joint_name_of(body), 2)};
    const answer_joint *ball = find_part(p, kt_joint_name_of(body), 3);
    if (first->type == 0) {
        const kt_pose frame = frame_in_theirs(p, body);
        const answer_joint *const one[3] = {first, first, first};
        const kt_vec3 x = frame.rotation.x, y = frame.rotation.y, z = frame.rotation.z;
        map_vector(p, c, 0, one, 3, (kt_mat3){.x = x, .y = y, .z = z}, frame.position);
        map_ball(p, c, 3, 3, p->theirs.qpos + first->q + 3, first->v + 3,
                 kt_quat_conjugate(kt_quat_from_matrix(frame.rotation)));
        return true;
    }
    if (all[1] == NULL || all[2] == NULL || ball == NULL || ball->type != 1)
        return false;
    map_vector(p, c, 0, all, 3, kt_mat3_identity(), kt_vec3_make(0.0, 0.0, 0.0));
    map_ball(p, c, 3, 3, p->theirs.qpos + ball->q, ball->v, kt_quat_make(1.0, 0.0, 0.0, 0.0));
    return true;
}

/* The row of A of a length that an export drops: c_n n = offset - sum c_i q_i.
 */
static bool map_length(pair *p, const kt_body *body, kt_coordinates c) {
    const kt_description *d = &p->file->scene.description;
    const int nv = kt_model_nv(p->model);
    for (int i = 0; i < d->loop_count; i++) {
        const kt_loop *loop = &d->loops[i];
        double own = 0.0;
        for (int k = 0; k < loop->term_count && loop->type == KT_LOOP_COUPLING && loop->formula == NULL; k++)
            if (strcmp(loop->terms[k].joint, kt_joint_name_of(body)) == 0)
                own = loop->terms[k].coefficient;
        for (int k = 0; k < loop->term_count && own != 0.0; k++)
            for (int b = 1; b < kt_model_body_count(p->model); b++)
                if (strcmp(kt_joint_name(p->model, b), loop->terms[k].joint) == 0 &&
                    find_joint(p, loop->terms[k].joint, "") != NULL) {
                    const int other = kt_body_coordinates(p->model, b).v;
                    p->a[other * nv + c.v] = -loop->terms[k].coefficient / own;
                    p->v[c.v] += p->a[other * nv + c.v] * p->v[other];
                }
        if (own != 0.0)
            return true;
    }
    return false;
}

static bool map_body(pair *p, int b) {
    const kt_coordinates c = kt_body_coordinates(p->model, b);
    const kt_body *body = &p->file->scene.description.bodies[kt_body_source(p->model, b)];
    const char *name = kt_joint_name_of(body);
    const answer_joint *all[3] = {find_part(p, name, 0), find_part(p, name, 1), find_part(p, name, 2)};
    const int nv = kt_model_nv(p->model);
    for (int k = 0; k < c.nv; k++)
        p->a[(c.v + k) * nv + c.v + k] = 1.0;
    if (c.nv == 0)
        return true;
    if (all[0] == NULL)
        return false;
    if (body->joint.type == KT_JOINT_FREE)
        return map_free(p, body, c, all[0]);
    if (body->joint.type == KT_JOINT_SPHERICAL) {
        map_ball(p, c, 0, 0, p->theirs.qpos + all[0]->q, all[0]->v, kt_quat_make(1.0, 0.0, 0.0, 0.0));
        return all[0]->type == 1;
    }
    kt_mat3 between = kt_mat3_identity();
    for (int k = 1; k < c.nv; k++)
        if (all[k] == NULL)
            return false;
    if (body->joint.type == KT_JOINT_PLANAR && p->file->format == KT_ROBOT_URDF)
        between = kt_mat3_multiply(kt_mat3_transpose(planar_frame(body->joint.axis)),
                                   kt_triad_from_axis(kt_vec3_normalize(body->joint.axis), 2));
    if (c.nv == 1)
        all[1] = all[2] = all[0];
    for (int k = 0; k < c.nv && c.nv == 1; k++) {
        p->q[c.q] = p->theirs.qpos[all[0]->q];
        p->v[c.v] = p->theirs.qvel[all[0]->v];
        p->b[c.v * p->theirs.nv + all[0]->v] = 1.0;
    }
    if (c.nv > 1)
        map_vector(p, c, 0, all, c.nv, between, kt_vec3_make(0.0, 0.0, 0.0));
    return true;
}

/* Returns whether all of our coordinates are found in theirs. */
static bool map_all(pair *p) {
    const int nv = kt_model_nv(p->model);
    memset(p->a, 0, (size_t)nv * (size_t)nv * sizeof *p->a);
    memset(p->b, 0, (size_t)nv * (size_t)p->theirs.nv * sizeof *p->b);
    for (int b = 1; b < kt_model_body_count(p->model); b++)
        if (!map_body(p, b)) {
            const kt_coordinates c = kt_body_coordinates(p->model, b);
            const kt_body *body = &p->file->scene.description.bodies[kt_body_source(p->model, b)];
            p->v[c.v] = 0.0;
            p->a[c.v * nv + c.v] = 0.0;
            if (c.nv != 1 || p->file->format == KT_ROBOT_URDF || !map_length(p, body, c)) {
                kt_note("%s: joint %s is not in the export", p->file->path, kt_joint_name(p->model, b));
                return false;
            }
        }
    return true;
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

static bool compute(const pair *p) {
    kt_error error = {0};
    kt_status status = kt_kinematics_update(p->model, p->data, p->q, p->v, NULL, &error);
    if (status == KT_OK)
        status = kt_dynamics_mass(p->model, p->data, p->q, p->matrix, &error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(p->model, p->data, p->q, p->v, p->zero, NULL, p->tau, &error);
    return status == KT_OK || kt_check_true(error.message, false);
}

static void compare_state(const pair *p, findings *f, double worst[2]) {
    const int nv = kt_model_nv(p->model), nw = p->theirs.nv;
    double *ours = p->forces, *theirs = p->forces + nv;
    const double slack = kt_model_body_count(p->model) * (p->file->raised + 2e-14);
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
    pair p = {.file = file};
    char said[1000], why[1000];
    double worst[2] = {0.0, 0.0};
    if (fscanf(from, "%999s", said) != 1 || strcmp(said, file->path) != 0 || fscanf(from, "%999s", said) != 1) {
        (void)kt_check_true("the file is answered", false);
        return;
    }
    if (strcmp(said, "read") != 0) {
        kt_note("%s, %s: rejected by MuJoCo:%s", file->source, file->path,
                fgets(why, sizeof why, from) != NULL ? why : "");
        return;
    }
    n->read++;
    if (!read_header(from, &p.theirs)) {
        (void)kt_check_true("the model is described", false);
        return;
    }
    const bool is_same = !file->has_screw && load(&p);
    bool is_mapped = is_same;
    for (int i = 0; i < STATES; i++) {
        if (!read_state(from, &p.theirs)) {
            (void)kt_check_true("a state is read", false);
            break;
        }
        is_mapped = is_mapped && map_all(&p);
        if (is_mapped && compute(&p))
            compare_state(&p, f, worst);
    }
    n->compared += is_mapped;
    n->turned += is_mapped && is_turned(file);
    n->without_joints += is_mapped && kt_model_nv(p.model) == 0;
    kt_note("%s %s: nv %d, mass matrix %.1e, bias %.1e%s", file->source,
            file->format == KT_ROBOT_URDF ? "URDF" : "MJCF", p.theirs.nv, worst[0], worst[1],
            is_mapped ? "" : ", not compared");
    release(&p);
}

static bool compare_files(const exported *files, int count, counts *n) {
    const char *package = getenv("KT_MUJOCO_WASM");
    findings f = {kt_worst_make("mass matrix"), kt_worst_make("bias force")};
    size_t room = 200 * ((size_t)count + 10);
    char *command = malloc(room);
    if (!kt_check_true("there is memory", command != NULL))
        return false;
    size_t used = (size_t)snprintf(command, room, "node '%s' '%s' %d", SCRIPT, package, STATES);
    for (int i = 0; i < count && used < room; i++)
        used += (size_t)snprintf(command + used, room - used, " '%s'", files[i].path);
    FILE *from = used < room ? popen(command, "r") : NULL;
    free(command);
    if (!kt_check_true("node runs", from != NULL))
        return false;
    for (int i = 0; i < count; i++)
        compare_next(from, &files[i], &f, n);
    while (fgetc(from) != EOF) /* node may still write the end of the last line */
        continue;
    kt_check_equal_int("node ends", pclose(from), 0);
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
        if (getenv("KT_KEEP") == NULL)
            (void)remove(files[i].path);
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
    struct dirent **entries;
    char folder[] = "/tmp/kinetree-exports-XXXXXX";
    counts n = {0};
    if (getenv("KT_MUJOCO_WASM") == NULL) {
        kt_skip("today's MuJoCo", "KT_MUJOCO_WASM does not name the folder of npm's @mujoco/mujoco");
        return;
    }
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    const int listed = scandir(KT_SCENES, &entries, kt_is_scene_file, alphasort);
    for (int i = 0; i < listed; i++) {
        char path[LINE];
        (void)snprintf(path, sizeof path, "%s/%s", KT_SCENES, entries[i]->d_name);
        n.written = add_exports(exports, n.written, path, folder, read_scene);
        free(entries[i]);
    }
    free(entries);
    if (compare_files(exports, n.written, &n)) {
        kt_note("%d exports of %d scenes: %d read, %d compared, %d turned upright", n.written, listed, n.read,
                n.compared, n.turned);
        kt_check_equal_int("exports that MuJoCo reads", n.read, n.written);
        kt_check_above("exports that are compared", n.compared, n.written - 2);
        kt_check_above("turned upright", n.turned, 0);
    }
    free_exports(exports, n.written);
    (void)rmdir(folder);
}

/* Compares both exports of a robot in URDF that is given as a text. */
static void compare_text(const char *text, int expected) {
    char folder[] = "/tmp/kinetree-exports-XXXXXX", path[LINE];
    counts n = {0};
    if (getenv("KT_MUJOCO_WASM") == NULL) {
        kt_skip("today's MuJoCo", "KT_MUJOCO_WASM does not name the folder of npm's @mujoco/mujoco");
        return;
    }
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
        return;
    (void)snprintf(path, sizeof path, "%s/robot.urdf", folder);
    FILE *to = fopen(path, "w");
    if (to != NULL && fputs(text, to) >= 0 && fclose(to) == 0)
        n.written = add_exports(exports, 0, path, folder, read_robot);
    if (compare_files(exports, n.written, &n)) {
        kt_check_equal_int("exports", n.written, expected);
        kt_check_equal_int("exports that are compared", n.compared, expected);
    }
    free_exports(exports, n.written);
    (void)remove(path);
    (void)rmdir(folder);
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
    compare_text(text, 2);
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
    char folder[] = "/tmp/kinetree-exports-XXXXXX", path[LINE];
    kt_random random = kt_random_of_test();
    counts n = {0};
    if (getenv("KT_MUJOCO_WASM") == NULL) {
        kt_skip("today's MuJoCo", "KT_MUJOCO_WASM does not name the folder of npm's @mujoco/mujoco");
        return;
    }
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
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
    (void)remove(path);
    (void)rmdir(folder);
}

KT_TEST(exports_of_robots_have_the_masses_of_the_robots_in_mujoco) {
    static const char *const own[] = {
        MODELS "/mjcf/tree.xml",    MODELS "/mjcf/masses.xml", MODELS "/mjcf/ties.xml",    MODELS "/arm.urdf",
        MODELS "/mjcf/tendons.xml", MODELS "/mjcf/meshes.xml", MODELS "/mjcf/servos.xml",  MODELS "/mjcf/attach.xml",
        MODELS "/mjcf/spatial.xml", MODELS "/mjcf/medium.xml", MODELS "/mjcf/muscles.xml", MODELS "/mjcf/wraps.xml",
        MODELS "/mjcf/cables.xml",  MODELS "/mjcf/flex.xml",
    };
    static char list[400000];
    char folder[] = "/tmp/kinetree-exports-XXXXXX";
    const char *named = getenv("KT_ROBOT_FILES");
    counts n = {0};
    int robots = 0;
    if (getenv("KT_MUJOCO_WASM") == NULL) {
        kt_skip("today's MuJoCo", "KT_MUJOCO_WASM does not name the folder of npm's @mujoco/mujoco");
        return;
    }
    if (!kt_check_true("there is a folder", mkdtemp(folder) != NULL))
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
    (void)rmdir(folder);
}
