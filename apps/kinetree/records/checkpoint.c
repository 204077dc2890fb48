/* Checkpoints of a run. A checkpoint has a header, the progress of the run, the states of the simulation and of the
 * watch on modes, and the extremes of all columns. The warnings and marks so far follow as JSON. A checksum over the
 * whole content ends the file. It detects accidents, and anybody can compute it. Therefore counts, indices and flags
 * are checked: those that follow from the scene must be those of this run.
 *
 * A checkpoint belongs to one scene, one set of options and one beginning of a file of records. The fingerprints are
 * computed from the library's version and the scene as it would be written now. One fingerprint is without, the other
 * with the options of the command line. The checkpoint also holds the length and a checksum of the records.
 *
 * Order of writing: the records, flushed to the disk; the checkpoint as FILE.new, flushed; FILE.new renamed to FILE;
 * the folder, flushed. So FILE is complete at any moment, and never ahead of the records.
 *
 * The run that writes FILE holds a lock against other runs. Before the first checkpoint of a new FILE, the lock is on
 * FILE.new, so that no empty FILE appears. A file of an earlier run is locked itself. Each FILE.new is locked before it
 * is renamed to FILE. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/checkpoint.h"

#include "base/sum.h"
#include "kinetree/kinetree.h"
#include "text/input.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The results of a run so far, besides the simulation's state. */
typedef struct kt_progress_so_far {
    kt_so_far run;
    kt_written records;
    uint64_t extremes; /* columns */
    uint64_t words;    /* bytes of the text with warnings and marks */
} kt_progress_so_far;

typedef struct kt_checkpoint_head {
    char kind[16];
    uint64_t scene, run, size;
    char words[160];
} kt_checkpoint_head;

static const char checkpoint_kind[16] = "kinetree run 15";

enum { WORDS_MOST = 1 << 24 }; /* bytes; a run has some dozens of warnings */

static const int64_t COUNT_MOST = INT64_C(1) << 53; /* records */

static bool say_no_memory(void) {
    kt_say("there is not enough memory for checkpoints");
    return false;
}

/* Returns the checksum of a scene with these settings, and of the library's version. 0: the scene cannot be written,
 * which has been reported. Events are added separately, because a scene cannot be written if its events set parameters
 * that numbers of the scene follow. */
static uint64_t sum_of_scene(const kt_scene *from, const kt_run *run) {
    char *text = NULL;
    size_t size = 0;
    kt_error error = {.code = KT_ERROR_MEMORY};
    kt_scene scene = *from;
    scene.run = *run;
    if (scene.contact == KT_CONTACT_STEPS)
        scene.run.integrator = NULL; /* the name of time stepping is none of the format's */
    scene.event_count = 0;
    FILE *stream = open_memstream(&text, &size);
    const kt_status status = stream == NULL ? KT_ERROR_MEMORY : kt_scene_write(&scene, stream, &error);
    const bool fine = (stream == NULL || fclose(stream) == 0) && status == KT_OK && text != NULL;
    uint64_t sum = fine ? kt_sum_add(kt_sum_add(KT_SUM_START, text, size), kt_version(), strlen(kt_version())) : 0;
    for (int i = 0; fine && i < from->event_count; i++) {
        const uint64_t event = kt_scene_event_sum(from, &from->events[i]);
        sum = kt_sum_add(sum, &event, sizeof event);
    }
    if (!fine && error.code == KT_ERROR_MEMORY)
        (void)say_no_memory();
    else if (!fine)
        kt_say("checkpoints need the scene as a file: %s", error.message);
    free(text);
    return sum;
}

static bool take_fingerprints(kt_checkpoint *checkpoint, const kt_outcome *outcome,
                              const kt_simulation_options *options) {
    const kt_run *run = outcome->run, none = kt_run_default();
    checkpoint->scene = sum_of_scene(outcome->scene, &none);
    checkpoint->run = checkpoint->scene != 0 ? sum_of_scene(outcome->scene, run) : 0;
    if (checkpoint->scene == 0 || checkpoint->run == 0)
        return false;
    checkpoint->run = kt_sum_add(checkpoint->run, &options->record, sizeof options->record);
    checkpoint->run = kt_sum_add(checkpoint->run, &options->unprojected, sizeof options->unprojected);
    snprintf(checkpoint->words, sizeof checkpoint->words, "%s, %g s, a record every %g s%s",
             kt_describe_method(run).text, run->duration, run->interval > 0.0 ? run->interval : run->duration / 1000.0,
             options->unprojected ? ", unprojected" : "");
    return true;
}

/* Locks FILE, or FILE.new if there is no FILE. Another run may rename its first FILE.new to FILE in between; then FILE
 * is tried. Returns the descriptor, or -1 with errno. */
static int lock_name(kt_checkpoint *checkpoint) {
    struct stat status;
    for (;;) {
        checkpoint->has_file = stat(checkpoint->file, &status) == 0;
        const int file =
            kt_open_locked(checkpoint->has_file ? checkpoint->file : checkpoint->new_path, O_RDWR | O_CREAT);
        if (file < 0 || checkpoint->has_file || stat(checkpoint->file, &status) != 0)
            return file;
        (void)unlink(checkpoint->new_path);
        (void)close(file);
    }
}

/* A device or a pipe would be replaced by a file. */
static bool take_lock(kt_checkpoint *checkpoint) {
    struct stat status;
    if (checkpoint->path == NULL)
        return true;
    checkpoint->file = kt_follow_links(checkpoint->path);
    if (checkpoint->file == NULL) {
        kt_say("checkpoint %s cannot be written: %s", checkpoint->path, strerror(errno));
        return false;
    }
    checkpoint->new_path = kt_join_texts(checkpoint->file, ".new", "");
    if (checkpoint->new_path == NULL)
        return say_no_memory();
    const bool is_other = stat(checkpoint->file, &status) == 0 && !S_ISREG(status.st_mode);
    checkpoint->lock = is_other ? -1 : lock_name(checkpoint);
    if (checkpoint->lock < 0)
        kt_say("checkpoint %s cannot be written: %s; --checkpoint FILE names another file", checkpoint->path,
               is_other         ? "it is not a file"
               : errno == EBUSY ? "another run writes its checkpoints there"
               : errno == ELOOP ? "FILE.new next to it is a symbolic link, which is not followed"
                                : strerror(errno));
    return checkpoint->lock >= 0;
}

int kt_checkpoint_open(kt_checkpoint *checkpoint, const char *path, double interval, const kt_outcome *outcome,
                       const kt_simulation_options *options, kt_mode_watch *modes) {
    *checkpoint = (kt_checkpoint){.path = path,
                                  .lock = -1,
                                  .interval = interval,
                                  .last = kt_clock(),
                                  .records.sum = KT_SUM_START,
                                  .modes = modes};
    checkpoint->size = kt_simulation_state_size(outcome->simulation);
    checkpoint->mode_size = modes != NULL ? kt_mode_watch_state_size(modes) : 0;
    checkpoint->block = malloc(checkpoint->size + checkpoint->mode_size);
    if (checkpoint->block == NULL)
        (void)say_no_memory();
    const bool fine =
        checkpoint->block != NULL && take_fingerprints(checkpoint, outcome, options) && take_lock(checkpoint);
    return fine ? -1 : KT_EXIT_INTEGRATION;
}

void kt_checkpoint_close(kt_checkpoint *checkpoint) {
    if (checkpoint->lock >= 0 && !checkpoint->has_file)
        (void)unlink(checkpoint->new_path); /* the run has ended before its first checkpoint */
    if (checkpoint->lock >= 0)
        (void)close(checkpoint->lock);
    free(checkpoint->new_path);
    free(checkpoint->file);
    free(checkpoint->block);
    *checkpoint = (kt_checkpoint){.lock = -1};
}

bool kt_checkpoint_is_due(const kt_checkpoint *checkpoint) {
    return checkpoint->path != NULL && kt_clock() - checkpoint->last >= checkpoint->interval;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static bool put_bytes_to(int file, const void *bytes, size_t size, uint64_t *sum) {
    size_t done;
    *sum = kt_sum_add(*sum, bytes, size);
    const int reason = kt_write_bytes(file, bytes, size, &done);
    errno = reason;
    return reason == 0;
}

static bool write_parts(int file, const kt_checkpoint *checkpoint, const kt_progress_so_far *so_far,
                        const kt_extremes *extremes, const char *words) {
    kt_checkpoint_head head;
    uint64_t sum = KT_SUM_START, unused = 0;
    memset(&head, 0, sizeof head);
    memcpy(head.kind, checkpoint_kind, sizeof head.kind);
    memcpy(head.words, checkpoint->words, sizeof head.words);
    head.scene = checkpoint->scene;
    head.run = checkpoint->run;
    head.size = checkpoint->size + checkpoint->mode_size;
    return put_bytes_to(file, &head, sizeof head, &sum) && put_bytes_to(file, so_far, sizeof *so_far, &sum) &&
           put_bytes_to(file, checkpoint->block, head.size, &sum) &&
           put_bytes_to(file, extremes->column, extremes->count * sizeof *extremes->column, &sum) &&
           put_bytes_to(file, words, so_far->words, &sum) && put_bytes_to(file, &sum, sizeof sum, &unused);
}

/* Returns the locked file to write: a new FILE.new, or for the first checkpoint the one with the lock. If that has been
 * deleted, another one takes its place. -1, with errno, if there is none. */
static int open_new_file(kt_checkpoint *checkpoint) {
    if (!checkpoint->has_file && kt_file_is_named(checkpoint->lock, checkpoint->new_path))
        return checkpoint->lock;
    const int file = kt_open_locked(checkpoint->new_path, O_WRONLY | O_CREAT);
    if (file >= 0 && !checkpoint->has_file) {
        (void)close(checkpoint->lock);
        checkpoint->lock = file;
    }
    return file;
}

/* Writes FILE.new and renames it to FILE. The new file is locked before it gets the name; for the first checkpoint it
 * is locked already, and stays open if it cannot be written: the next try begins at its start again. */
static bool write_and_rename(kt_checkpoint *checkpoint, const kt_progress_so_far *so_far, const kt_extremes *extremes,
                             const char *words) {
    const int file = open_new_file(checkpoint);
    if (file < 0)
        return false;
    if (ftruncate(file, 0) == 0 && lseek(file, 0, SEEK_SET) == 0 &&
        write_parts(file, checkpoint, so_far, extremes, words) && fsync(file) == 0 &&
        rename(checkpoint->new_path, checkpoint->file) == 0) {
        if (checkpoint->has_file)
            (void)close(checkpoint->lock);
        checkpoint->lock = file;
        checkpoint->has_file = true;
        kt_sync_folder(checkpoint->file);
        return true;
    }
    const int reason = errno;
    if (checkpoint->has_file) { /* else it is removed with the lock */
        (void)unlink(checkpoint->new_path);
        (void)close(file);
    }
    errno = reason;
    return false;
}

/* Brings the records to the disk, and adds those since the last checkpoint to the sum. Streams are not read back. */
static bool sum_records(kt_checkpoint *checkpoint, const kt_lines *lines) {
    kt_written *records = &checkpoint->records;
    if (!lines->is_regular)
        return true;
    if (fsync(lines->file) != 0 || !kt_csv_sum(lines->file, records->bytes, lines->written, &records->sum)) {
        kt_say("%s, the records until the checkpoint, cannot be read back: %s", lines->path, strerror(errno));
        return false;
    }
    if (records->bytes == 0)
        kt_sync_folder(lines->path);
    records->bytes = lines->written;
    return true;
}

/* Reports that a checkpoint cannot be written, once in a run. The motion and its records are sound without it. */
static void warn_of_lost_checkpoint(kt_checkpoint *checkpoint, kt_outcome *outcome, int reason) {
    char text[1200], last[64] = "this run has written none";
    if (checkpoint->is_lost)
        return;
    checkpoint->is_lost = true;
    if (checkpoint->is_written)
        snprintf(last, sizeof last, "the last one is of t = %.9g s", checkpoint->time);
    snprintf(text, sizeof text, "checkpoint %s cannot be written: %s; %s", kt_show(checkpoint->path).text,
             strerror(reason), last);
    const kt_warning warning = {.code = "checkpoint",
                                .time = kt_simulation_time(outcome->simulation),
                                .value = (double)NAN,
                                .is_said = outcome->warnings.quiet,
                                .remedy = "The run goes on, and tries again at each interval of checkpoints"};
    if (warning.is_said)
        kt_say("warning: %s. %s", text, warning.remedy);
    kt_warn(&outcome->warnings, &warning, "%s", text);
}

/* Returns 0 if the file is written, else 1. */
static int write_checkpoint_file(kt_checkpoint *checkpoint, const kt_progress_so_far *so_far, kt_outcome *outcome,
                                 const char *words) {
    if (write_and_rename(checkpoint, so_far, &outcome->extremes, words)) {
        checkpoint->is_written = true;
        checkpoint->time = kt_simulation_time(outcome->simulation);
        return 0;
    }
    warn_of_lost_checkpoint(checkpoint, outcome, errno);
    return 1;
}

int kt_checkpoint_write(kt_checkpoint *checkpoint, kt_outcome *outcome, const kt_lines *lines) {
    json_t *reported = kt_marks_save(&outcome->marks);
    json_object_set_new(reported, "warnings", kt_warnings_describe(&outcome->warnings));
    char *words = json_dumps(reported, JSON_COMPACT | JSON_REAL_PRECISION(17));
    bool fine = (words != NULL && !kt_json_is_short()) || say_no_memory();
    kt_progress_so_far so_far;
    int code = -1;
    json_decref(reported);
    fine = fine && sum_records(checkpoint, lines);
    if (fine) {
        memset(&so_far, 0, sizeof so_far);
        so_far.run = outcome->so_far;
        so_far.records = checkpoint->records;
        so_far.extremes = outcome->extremes.count;
        so_far.words = strlen(words);
        kt_simulation_save(outcome->simulation, checkpoint->block);
        if (checkpoint->modes != NULL)
            kt_mode_watch_save(checkpoint->modes, (char *)checkpoint->block + checkpoint->size);
        code = write_checkpoint_file(checkpoint, &so_far, outcome, words);
    }
    free(words);
    checkpoint->last = kt_clock();
    return code;
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

static bool take_bytes(FILE *file, void *bytes, size_t size, uint64_t *sum) {
    if (fread(bytes, 1, size, file) != size)
        return false;
    *sum = kt_sum_add(*sum, bytes, size);
    return true;
}

/* The content of a checkpoint file, and its fault. */
typedef struct kt_checkpoint_content {
    kt_progress_so_far so_far;
    kt_extreme *extremes; /* of all columns */
    char *words;          /* the text with warnings and marks */
    char wrong[480];      /* empty: nothing is */
} kt_checkpoint_content;

static void reject_checkpoint(kt_checkpoint_content *content, const char *what) {
    snprintf(content->wrong, sizeof content->wrong, "%s", what);
}

/* Returns NULL after printing the error. */
static FILE *open_checkpoint(const char *path) {
    kt_error error = {0};
    FILE *file = kt_input_open(path, &kt_input_checkpoint, &error);
    if (file == NULL)
        kt_say_error(&error);
    return file;
}

int kt_checkpoint_check(const char *path) {
    static const char kind[] = "kinetree run ";
    char begin[sizeof kind - 1];
    kt_error error = {0};
    FILE *file = open_checkpoint(path);
    if (file == NULL)
        return KT_EXIT_SCENE;
    const size_t count = fread(begin, 1, sizeof begin, file);
    if (ferror(file))
        (void)kt_file_reject(path, &kt_input_checkpoint, errno, &error);
    (void)fclose(file);
    if (error.code != KT_OK) {
        kt_say_error(&error);
        return KT_EXIT_SCENE;
    }
    if (count == 0 || (count == sizeof begin && memcmp(begin, kind, sizeof begin) == 0))
        return -1;
    return kt_misuse("%s is no checkpoint; --resume takes the file that --checkpoint has written, and --from starts "
                     "from the summary or the records of a run",
                     kt_show(path).text);
}

static bool check_file_head(const kt_checkpoint *checkpoint, const kt_checkpoint_head *head,
                            kt_checkpoint_content *content) {
    if (memcmp(head->kind, checkpoint_kind, sizeof head->kind) != 0)
        reject_checkpoint(content, "it is not a checkpoint of this version of kinetree");
    else if (head->scene != checkpoint->scene)
        reject_checkpoint(content, "it belongs to another scene; give the one whose run wrote it");
    else if (strncmp(head->words, checkpoint->words, sizeof head->words) != 0)
        snprintf(content->wrong, sizeof content->wrong,
                 "it belongs to a run with other options: that was by %.159s; this one is by %.159s", head->words,
                 checkpoint->words);
    else if (head->run != checkpoint->run || head->size != checkpoint->size + checkpoint->mode_size)
        reject_checkpoint(
            content, "it belongs to a run that recorded something else; give the --record and --markers of that run");
    return content->wrong[0] == '\0';
}

/* Reads a checkpoint of a run with this number of columns into *content and the block. */
static void read_checkpoint_parts(FILE *file, const kt_checkpoint *checkpoint, size_t columns,
                                  kt_checkpoint_content *content) {
    kt_checkpoint_head head;
    kt_progress_so_far *so_far = &content->so_far;
    uint64_t sum = KT_SUM_START, given = 0, unused = 0;
    if (!take_bytes(file, &head, sizeof head, &sum)) {
        reject_checkpoint(content, ftell(file) == 0 ? "it is empty: the run has ended before its first checkpoint"
                                                    : "it is too short to be a checkpoint");
        return;
    }
    if (!check_file_head(checkpoint, &head, content))
        return;
    bool fine = take_bytes(file, so_far, sizeof *so_far, &sum) &&
                take_bytes(file, checkpoint->block, head.size, &sum) && so_far->extremes == columns &&
                so_far->words < WORDS_MOST &&
                (content->extremes = calloc(columns + 1, sizeof *content->extremes)) != NULL &&
                take_bytes(file, content->extremes, columns * sizeof *content->extremes, &sum) &&
                (content->words = calloc(1, so_far->words + 1)) != NULL;
    fine = fine && take_bytes(file, content->words, so_far->words, &sum) &&
           take_bytes(file, &given, sizeof given, &unused) && fgetc(file) == EOF;
    if (!fine)
        reject_checkpoint(content, "it is not as long as it was written: was it copied in full?");
    else if (given != sum)
        reject_checkpoint(content, "its sum is wrong: it has been damaged");
}

static bool flags_fit(const bool *flags, int count) {
    const unsigned char *bytes = (const unsigned char *)flags;
    for (int i = 0; i < count; i++)
        if (bytes[i] > 1)
            return false;
    return true;
}

static bool compressions_fit(const kt_compressions *c, const kt_compressions *own) {
    return c->count == own->count && c->left == own->left && memcmp(c->loop, own->loop, sizeof c->loop) == 0 &&
           memcmp(c->of_model, own->of_model, sizeof c->of_model) == 0;
}

static bool half_turns_fit(const kt_half_turns *t, const kt_half_turns *own) {
    return t->count == own->count && memcmp(t->effect, own->effect, sizeof t->effect) == 0 &&
           flags_fit(t->reported, KT_HALF_TURNS_MOST);
}

static bool energy_fits(const kt_energy_watch *e, const kt_energy_watch *own) {
    return e->energetics == own->energetics && (e->has_balance == 0 || e->has_balance == 1) &&
           (e->has_estimate == 0 || e->has_estimate == 1) && e->records >= 0 && e->records <= COUNT_MOST;
}

/* Returns whether the results of a checkpoint can be those of a run that has begun as this one. */
static bool results_fit(const kt_progress_so_far *so_far, const kt_so_far *own) {
    const kt_so_far *run = &so_far->run;
    const kt_stability_watch *s = &run->stability;
    return run->records >= 0 && run->records <= COUNT_MOST && so_far->records.bytes >= 0 && run->cpu_seconds >= 0.0 &&
           isfinite(run->cpu_seconds) && energy_fits(&run->energy, &own->energy) && s->estimates >= 0 &&
           s->estimates <= WORDS_MOST && s->compared >= 0 && s->compared <= WORDS_MOST && s->bounded >= 0 &&
           s->bounded <= s->compared && compressions_fit(&run->compressions, &own->compressions) &&
           half_turns_fit(&run->half_turns, &own->half_turns);
}

/* Restores the run from the content; sets content->wrong if the simulation rejects the content. */
static void apply_checkpoint(kt_checkpoint *checkpoint, kt_checkpoint_content *content, kt_outcome *outcome) {
    const kt_progress_so_far *so_far = &content->so_far;
    kt_error error = {0};
    json_t *reported = json_loads(content->words, 0, NULL);
    if (reported == NULL || !kt_marks_read(&outcome->marks, reported)) {
        reject_checkpoint(content, "its warnings and marks cannot be read");
    } else if (!results_fit(so_far, &outcome->so_far)) {
        reject_checkpoint(content,
                          "a count, an index or a flag in it does not fit this run: the file has been changed");
    } else if (kt_simulation_restore(outcome->simulation, checkpoint->block, &error) != KT_OK) {
        reject_checkpoint(content, strstr(error.message, "accelerations of the caller's") == NULL ? error.message
                                   : outcome->is_native
                                       ? "the run that wrote it had no --native; leave it out here, too"
                                       : "the run that wrote it had --native; give it here, too");
    } else {
        kt_warnings_replace(&outcome->warnings, json_object_get(reported, "warnings"));
        if (checkpoint->modes != NULL)
            kt_mode_watch_restore(checkpoint->modes, (const char *)checkpoint->block + checkpoint->size);
        checkpoint->records = so_far->records;
        outcome->so_far = so_far->run;
        memcpy(outcome->extremes.column, content->extremes, outcome->extremes.count * sizeof *content->extremes);
    }
    json_decref(reported);
}

int kt_checkpoint_resume(kt_checkpoint *checkpoint, const char *path, kt_outcome *outcome) {
    kt_checkpoint_content content = {.words = NULL};
    FILE *file = open_checkpoint(path);
    if (file == NULL)
        return KT_EXIT_SCENE;
    read_checkpoint_parts(file, checkpoint, outcome->extremes.count, &content);
    (void)fclose(file);
    if (content.wrong[0] == '\0')
        apply_checkpoint(checkpoint, &content, outcome);
    free(content.words);
    free(content.extremes);
    if (content.wrong[0] == '\0')
        return -1;
    return kt_misuse("checkpoint %s: %s", path, content.wrong);
}
