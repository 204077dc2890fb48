/* Runs a scene in other engines. Each run is a process, so that a crash or a run without end is only a point that
 * failed. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _DEFAULT_SOURCE /* mkdtemp */
#include "subcommands/accuracy_peers.h"

#include "kinetree/export.h"
#include "records/output.h"
#include "records/table.h"
#include "subcommands/run.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATH_ROOM = 4096, POSE = 7, ARGUMENTS = 8 + KT_SETTINGS_MAX };

static const char prefix[] = "kinetree-peer-";
static const char *const files[] = {"scene.xml", "answer.csv", "words.txt"};
enum { FILE_SCENE, FILE_ANSWER, FILE_WORDS, FILES };

typedef struct kt_peer_session {
    const kt_peer_work *work;
    kt_peers *peers;
    char folder[PATH_ROOM - 32], path[FILES][PATH_ROOM];
    char program[KT_PEER_CURVES_MAX][PATH_ROOM]; /* of each curve */
    double share;                                /* s of processor time for each curve */
    double *poses;                               /* of a run, record by record */
} kt_peer_session;

/* ---- processes --------------------------------------------------------------------------------------------------- */

static void become(kt_peer_session *s, char **arguments, double seconds) {
    const struct rlimit time = {(rlim_t)seconds + 1, (rlim_t)seconds + 2}, none = {0, 0};
    const int out = open(s->path[FILE_ANSWER], O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int words = open(s->path[FILE_WORDS], O_WRONLY | O_CREAT | O_TRUNC, 0600);
    (void)setrlimit(RLIMIT_CPU, &time);
    (void)setrlimit(RLIMIT_CORE, &none);
    if (out >= 0 && words >= 0 && dup2(out, STDOUT_FILENO) >= 0 && dup2(words, STDERR_FILENO) >= 0)
        (void)execv(arguments[0], arguments);
    _exit(127);
}

/* Copies the first line of a file, without its end. */
static void first_line(const char *path, char *line, size_t size) {
    FILE *file = fopen(path, "r");
    line[0] = '\0';
    if (file != NULL && fgets(line, (int)size, file) != NULL)
        line[strcspn(line, "\r\n")] = '\0';
    if (file != NULL)
        (void)fclose(file);
}

/* Runs a program with at most `seconds` of processor time. On failure returns false, and `reason` states why. */
static bool run_program(kt_peer_session *s, char **arguments, double seconds, char *reason, size_t size) {
    int status = 0;
    const pid_t child = fork();
    if (child < 0) {
        (void)snprintf(reason, size, "no process can be started: %s", strerror(errno));
        return false;
    }
    if (child == 0)
        become(s, arguments, seconds);
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return false;
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return true;
    if (WIFSIGNALED(status))
        (void)snprintf(reason, size,
                       WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL ? "it takes too long"
                                                                                  : "signal %d ended it",
                       WTERMSIG(status));
    else
        first_line(s->path[FILE_WORDS], reason, size);
    if (reason[0] == '\0')
        (void)snprintf(reason, size, "it ended with status %d and printed no reason", WEXITSTATUS(status));
    return false;
}

/* ---- a run ------------------------------------------------------------------------------------------------------- */

static const double *pose_column(const kt_table *table, char axis, const char *body) {
    char name[256];
    (void)snprintf(name, sizeof name, "%c.%s", axis, body);
    return kt_table_column(table, name);
}

/* Copies the poses of all bodies, record by record. */
static bool take_peer_poses(kt_peer_session *s, const kt_table *table, kt_peer_curve *curve) {
    const kt_model *model = kt_accuracy_model(s->work->study);
    const size_t rows = (size_t)kt_accuracy_results_of(s->work->study)->records + 1;
    const size_t width = POSE * ((size_t)kt_model_body_count(model) - 1);
    if (table->rows != rows) {
        (void)snprintf(curve->reason, sizeof curve->reason, "its table has %zu rows, not %zu", table->rows, rows);
        return false;
    }
    for (int b = 1; b < kt_model_body_count(model); b++)
        for (size_t k = 0; k < POSE; k++) {
            const double *column = pose_column(table, "xyzwijk"[k], kt_body_name(model, b));
            if (column == NULL) {
                (void)snprintf(curve->reason, sizeof curve->reason, "it has no body '%.60s' with a pose of its own",
                               kt_body_name(model, b));
                return false;
            }
            for (size_t row = 0; row < rows; row++)
                s->poses[row * width + POSE * ((size_t)b - 1) + k] = column[row];
        }
    return true;
}

static double last_number(const kt_table *table, const char *name) {
    const double *column = kt_table_column(table, name);
    return column != NULL && table->rows > 0 ? column[table->rows - 1] : (double)NAN;
}

/* Reads the table of a run into a point. */
static bool take_peer_answer(kt_peer_session *s, kt_peer_curve *curve, kt_accuracy_point *point) {
    kt_table table;
    kt_error error = {0};
    if (kt_table_read_file(s->path[FILE_ANSWER], &table) >= 0) {
        (void)snprintf(curve->reason, sizeof curve->reason, "its table cannot be read");
        return false;
    }
    bool good = take_peer_poses(s, &table, curve);
    if (good && kt_accuracy_compare(s->work->study, s->poses, point, &error) != KT_OK) {
        (void)snprintf(curve->reason, sizeof curve->reason, "%.190s", error.message);
        good = false;
    }
    const double evaluations = last_number(&table, "evaluations");
    point->cpu = last_number(&table, "cpu");
    point->counts.evaluations = evaluations >= 0.0 && evaluations < 1e18 ? (uint64_t)evaluations : 0;
    kt_table_free(&table);
    return good;
}

/* A run at point->setting. Returns whether the ladder may continue: a setting that is too coarse for a run is a point
 * without a result, and so is one that is too slow, which ends the ladder. */
static bool run_setting(kt_peer_session *s, const char *program, kt_peer_curve *curve, kt_accuracy_point *point) {
    const kt_accuracy_results *results = kt_accuracy_results_of(s->work->study);
    char setting[32], interval[32], records[16], *arguments[ARGUMENTS];
    const char *const given[] = {program, curve->method,       setting,      interval,
                                 records, s->path[FILE_SCENE], s->work->path};
    int count = 0;
    char reason[sizeof curve->reason] = "";
    (void)snprintf(setting, sizeof setting, "%.17g", point->setting);
    (void)snprintf(interval, sizeof interval, "%.17g", results->interval);
    (void)snprintf(records, sizeof records, "%d", results->records);
    for (; count < (int)(sizeof given / sizeof given[0]); count++)
        arguments[count] = (char *)(uintptr_t)given[count];
    for (int i = 0; i < s->work->settings->count; i++)
        arguments[count++] = (char *)(uintptr_t)s->work->settings->text[i];
    arguments[count] = NULL;
    const double setting_given = point->setting;
    *point = (kt_accuracy_point){.setting = setting_given, .cpu = (double)NAN, .status = KT_ERROR_STEP};
    point->error.judged = HUGE_VAL;
    const bool ran = run_program(s, arguments, 6.0 * s->share + 2.0, reason, sizeof reason);
    if (ran)
        return take_peer_answer(s, curve, point);
    (void)snprintf(curve->reason, sizeof curve->reason, "%s", reason);
    return strcmp(reason, "it takes too long") != 0;
}

/* ---- a ladder ---------------------------------------------------------------------------------------------------- */

/* Whether two halves of a step have not made the error smaller. */
static bool has_stopped_falling(const kt_peer_curve *curve) {
    if (curve->adaptive || curve->count < 3)
        return false;
    const kt_accuracy_point *last = &curve->points[curve->count - 1];
    return last[0].usable && last[-1].usable && last[-2].usable &&
           fmin(last[0].error.judged, last[-1].error.judged) > 0.9 * last[-2].error.judged;
}

/* Steps from the interval of the records on, each half as long as the one before; tolerances from 0.1 on, each a tenth.
 * A failure counts as the curve's own only if no finer setting succeeds. */
static void climb_peer_curve(kt_peer_session *s, const char *program, kt_peer_curve *curve) {
    const kt_accuracy_results *results = kt_accuracy_results_of(s->work->study);
    double setting = curve->adaptive ? 0.1 : results->interval;
    for (bool goes_on = true; goes_on && curve->count < KT_PEER_POINTS_MAX;) {
        kt_accuracy_point *point = &curve->points[curve->count++];
        setting *= curve->count == 1 ? 1.0 : curve->adaptive ? 0.1 : 0.5;
        point->setting = setting;
        goes_on = run_setting(s, program, curve, point) && !has_stopped_falling(curve) &&
                  !(point->cpu * (curve->adaptive ? 1.8 : 2.0) > s->share) && !(curve->adaptive && setting < 2e-13);
        if (point->status == KT_OK)
            curve->reason[0] = '\0';
        if (point->usable && point->error.judged < results->uncertainty.judged)
            goes_on = false;
    }
}

/* ---- engines ----------------------------------------------------------------------------------------------------- */

/* Adds the methods of a program. */
static void add_methods(kt_peer_session *s, const char *program) {
    char option[] = "--methods", reason[200] = "", line[128], engine[48];
    char *arguments[] = {(char *)(uintptr_t)program, option, NULL};
    if (!run_program(s, arguments, 5.0, reason, sizeof reason)) {
        kt_say("accuracy: --peers: %s cannot be used: %s", program, reason);
        return;
    }
    first_line(s->path[FILE_ANSWER], engine, sizeof engine);
    FILE *file = fopen(s->path[FILE_ANSWER], "r");
    for (int i = 0; file != NULL && fgets(line, sizeof line, file) != NULL; i++) {
        kt_peer_curve *curve = &s->peers->curves[s->peers->count];
        char kind[16] = "";
        *curve = (kt_peer_curve){.count = 0};
        if (i == 0 || sscanf(line, "%31s %15s", curve->method, kind) != 2)
            continue;
        if (s->peers->count + 1 == KT_PEER_CURVES_MAX) {
            kt_say("accuracy: --peers: %d methods are measured; those after %s %s are left out", s->peers->count,
                   engine, s->peers->curves[s->peers->count - 1].method);
            break;
        }
        (void)snprintf(curve->engine, sizeof curve->engine, "%s", engine);
        curve->adaptive = strcmp(kind, "tolerance") == 0;
        (void)snprintf(s->program[s->peers->count++], PATH_ROOM, "%s", program);
    }
    if (file != NULL)
        (void)fclose(file);
}

static int compare_names(const void *a, const void *b) { return strcmp(a, b); }

/* Adds the methods of all programs of a folder, in the order of their names. The first program of a name counts. */
static void search_folder(kt_peer_session *s, const char *folder) {
    char found[KT_PEER_CURVES_MAX][PATH_ROOM];
    size_t count = 0;
    DIR *directory = opendir(folder);
    for (const struct dirent *entry; directory != NULL && (entry = readdir(directory)) != NULL;) {
        bool is_new = strncmp(entry->d_name, prefix, sizeof prefix - 1) == 0 && strchr(entry->d_name, '.') == NULL;
        for (int i = 0; i < s->peers->count && is_new; i++)
            is_new = strcmp(strrchr(s->program[i], '/') + 1, entry->d_name) != 0;
        if (!is_new || count == KT_PEER_CURVES_MAX)
            continue;
        (void)snprintf(found[count], PATH_ROOM, "%s/%s", folder, entry->d_name);
        count += access(found[count], X_OK) == 0;
    }
    if (directory != NULL)
        (void)closedir(directory);
    qsort(found, count, sizeof found[0], compare_names);
    for (size_t i = 0; i < count; i++)
        add_methods(s, found[i]);
}

static void search_peers(kt_peer_session *s) {
    const char *path = getenv("PATH");
    char *copy = strdup(path != NULL ? path : ""), *rest = NULL;
    if (copy == NULL)
        return;
    for (char *folder = strtok_r(copy, ":", &rest); folder != NULL; folder = strtok_r(NULL, ":", &rest))
        search_folder(s, folder);
    free(copy);
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

static void say_lost_by_peer(void *user, const char *what, int count) {
    const kt_peer_work *work = user;
    if (!work->is_quiet)
        kt_say("accuracy: --peers: the file for engines that read MJCF leaves out or "
               "changes: %s (%d)",
               what, count);
}

/* Removes a file or a folder. Links are removed, and not followed. */
static void remove_peer_tree(const char *path) {
    struct stat status;
    DIR *folder = lstat(path, &status) == 0 && S_ISDIR(status.st_mode) ? opendir(path) : NULL;
    const struct dirent *item;
    while (folder != NULL && (item = readdir(folder)) != NULL) {
        char below[PATH_ROOM];
        if (strcmp(item->d_name, ".") != 0 && strcmp(item->d_name, "..") != 0 &&
            snprintf(below, PATH_ROOM, "%s/%s", path, item->d_name) < PATH_ROOM)
            remove_peer_tree(below);
    }
    if (folder != NULL)
        (void)closedir(folder);
    (void)remove(path);
}

/* Makes the folder of the exchanged files, with the scene as MJCF. */
static int make_files(kt_peer_session *s) {
    kt_error error = {0};
    (void)snprintf(s->folder, sizeof s->folder, "%.3900s/kinetree-XXXXXX", kt_temporary_folder());
    if (mkdtemp(s->folder) == NULL) {
        kt_say("accuracy: --peers: %s cannot be made: %s", s->folder, strerror(errno));
        s->folder[0] = '\0';
        return KT_EXIT_INTEGRATION;
    }
    for (int i = 0; i < FILES; i++)
        (void)snprintf(s->path[i], PATH_ROOM, "%s/%s", s->folder, files[i]);
    FILE *file = fopen(s->path[FILE_SCENE], "w");
    if (file == NULL)
        return kt_reject(KT_EXIT_INTEGRATION, "accuracy: --peers: %s cannot be written: %s", s->path[FILE_SCENE],
                         strerror(errno));
    const kt_status status = kt_robot_write_scene(s->work->scene, KT_ROBOT_MJCF, s->folder, file, say_lost_by_peer,
                                                  (void *)(uintptr_t)s->work, &error);
    if (fclose(file) != 0 || status != KT_OK)
        return kt_reject(KT_EXIT_SCENE, "accuracy: --peers: the scene cannot be written as MJCF: %s", error.message);
    return -1;
}

static int measure_peers(kt_peer_session *s) {
    int code = make_files(s);
    if (code >= 0)
        return code;
    search_peers(s);
    if (s->peers->count == 0)
        return kt_misuse("accuracy: --peers: no program %sNAME is on the PATH; 'bench/run engines SCENE' builds those "
                         "of MuJoCo, ODE, Simbody and SUNDIALS",
                         prefix);
    kt_progress progress = kt_progress_start(s->work->is_quiet);
    s->share = s->work->budget / s->peers->count;
    for (int i = 0; i < s->peers->count; i++) {
        char words[96];
        (void)snprintf(words, sizeof words, "%s %s", s->peers->curves[i].engine, s->peers->curves[i].method);
        kt_progress_show(&progress, (double)i / s->peers->count, words);
        climb_peer_curve(s, s->program[i], &s->peers->curves[i]);
    }
    kt_progress_end(&progress);
    return -1;
}

int kt_peers_measure(const kt_peer_work *work, kt_peers **peers) {
    const kt_model *model = kt_accuracy_model(work->study);
    const size_t rows = (size_t)kt_accuracy_results_of(work->study)->records + 1;
    kt_peer_session *s = calloc(1, sizeof *s);
    kt_peers *made = calloc(1, sizeof *made);
    double *poses = calloc(rows * POSE * (size_t)kt_model_body_count(model), sizeof *poses);
    int code = KT_EXIT_INTEGRATION;
    if (s != NULL && made != NULL && poses != NULL) {
        *s = (kt_peer_session){.work = work, .peers = made, .poses = poses};
        code = measure_peers(s);
        if (s->folder[0] != '\0')
            remove_peer_tree(s->folder);
    } else {
        kt_say("there is not enough memory");
    }
    free(poses);
    free(s);
    if (code < 0)
        *peers = made;
    else
        free(made);
    return code;
}
