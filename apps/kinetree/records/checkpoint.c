/* Checkpoints of a run: a header, what the run has recorded so far, the simulation's state, and a checksum over all of
 * it.
 *
 * A checkpoint belongs to one scene and one set of options. Its fingerprint is computed from the scene as it would be
 * written now, with the options of the command line applied, and from the library's version. A checkpoint is written to
 * FILE.new, flushed to the disk and renamed to FILE, so that FILE is complete at any moment. */
#include "records/checkpoint.h"

#include "kinetree/kinetree.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The results of a run so far, besides the simulation's state. */
typedef struct kt_progress_so_far {
    int64_t records, lines;
    uint64_t sound_steps;
    double cpu_seconds;
    kt_energy_watch energy;
    kt_residual constraint;
} kt_progress_so_far;

typedef struct kt_checkpoint_head {
    char kind[16];
    uint64_t scene, size;
} kt_checkpoint_head;

static const char checkpoint_kind[16] = "kinetree run 3";

/* FNV-1a hash, 64 bits (Fowler, Noll, Vo). It detects accidental differences, not forged ones. */
static uint64_t sum_of(uint64_t sum, const void *bytes, size_t size) {
    const unsigned char *byte = bytes;
    for (size_t i = 0; i < size; i++)
        sum = (sum ^ byte[i]) * 0x100000001b3U;
    return sum;
}

static const uint64_t sum_start = 0xcbf29ce484222325U;

static int take_fingerprint(kt_checkpoint *checkpoint, const kt_outcome *outcome,
                            const kt_simulation_options *options) {
    char *text = NULL;
    size_t size = 0;
    kt_error error = {0};
    kt_scene scene = *outcome->scene;
    scene.run = *outcome->run;
    FILE *stream = open_memstream(&text, &size);
    kt_status status = stream == NULL ? KT_ERROR_MEMORY : kt_scene_write(&scene, stream, &error);
    bool fine = (stream == NULL || fclose(stream) == 0) && status == KT_OK && text != NULL;
    if (fine) {
        checkpoint->scene = sum_of(sum_start, text, size);
        checkpoint->scene = sum_of(checkpoint->scene, kt_version(), strlen(kt_version()));
        checkpoint->scene = sum_of(checkpoint->scene, &options->record, sizeof options->record);
        checkpoint->scene = sum_of(checkpoint->scene, &options->unprojected, sizeof options->unprojected);
    }
    free(text);
    if (fine)
        return -1;
    kt_say("there is not enough memory for checkpoints");
    return KT_EXIT_INTEGRATION;
}

int kt_checkpoint_open(kt_checkpoint *checkpoint, const char *path, double interval, const kt_outcome *outcome,
                       const kt_simulation_options *options) {
    *checkpoint = (kt_checkpoint){.path = path, .interval = interval, .last = kt_clock()};
    checkpoint->size = kt_simulation_state_size(outcome->simulation);
    checkpoint->block = malloc(checkpoint->size);
    if (checkpoint->block != NULL)
        return take_fingerprint(checkpoint, outcome, options);
    kt_say("there is not enough memory for checkpoints");
    return KT_EXIT_INTEGRATION;
}

void kt_checkpoint_close(kt_checkpoint *checkpoint) {
    free(checkpoint->block);
    checkpoint->block = NULL;
}

bool kt_checkpoint_is_due(const kt_checkpoint *checkpoint) {
    return checkpoint->path != NULL && kt_clock() - checkpoint->last >= checkpoint->interval;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static bool put(int file, const void *bytes, size_t size, uint64_t *sum) {
    const char *from = bytes;
    *sum = sum_of(*sum, bytes, size);
    while (size > 0) {
        ssize_t count = write(file, from, size);
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0)
            return false;
        from += count;
        size -= (size_t)count;
    }
    return true;
}

static bool write_parts(int file, const kt_checkpoint *checkpoint, const kt_progress_so_far *so_far) {
    kt_checkpoint_head head = {.scene = checkpoint->scene, .size = checkpoint->size};
    uint64_t sum = sum_start, unused = 0;
    memcpy(head.kind, checkpoint_kind, sizeof head.kind);
    return put(file, &head, sizeof head, &sum) && put(file, so_far, sizeof *so_far, &sum) &&
           put(file, checkpoint->block, checkpoint->size, &sum) && put(file, &sum, sizeof sum, &unused);
}

static bool write_beside(const char *beside, const kt_checkpoint *checkpoint, const kt_progress_so_far *so_far) {
    int file = open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0)
        return false;
    bool written = write_parts(file, checkpoint, so_far) && fsync(file) == 0;
    int reason = errno;
    bool closed = close(file) == 0;
    reason = written ? errno : reason;
    if (written && closed && rename(beside, checkpoint->path) == 0)
        return true;
    reason = written && closed ? errno : reason;
    (void)unlink(beside);
    errno = reason;
    return false;
}

int kt_checkpoint_write(kt_checkpoint *checkpoint, const kt_outcome *outcome, long long lines) {
    kt_progress_so_far so_far;
    memset(&so_far, 0, sizeof so_far);
    so_far = (kt_progress_so_far){.records = outcome->records,
                                  .lines = lines,
                                  .sound_steps = outcome->sound_steps,
                                  .energy = outcome->energy,
                                  .cpu_seconds = outcome->cpu_seconds,
                                  .constraint = outcome->constraint};
    kt_simulation_save(outcome->simulation, checkpoint->block);
    size_t room = strlen(checkpoint->path) + sizeof ".new";
    char *beside = malloc(room);
    if (beside == NULL) {
        kt_say("there is not enough memory for a checkpoint");
        return -1;
    }
    snprintf(beside, room, "%s.new", checkpoint->path);
    bool fine = write_beside(beside, checkpoint, &so_far);
    if (!fine)
        kt_say("checkpoint %s cannot be written: %s", checkpoint->path, strerror(errno));
    free(beside);
    checkpoint->last = kt_clock();
    return fine ? 0 : -1;
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

static bool take(FILE *file, void *bytes, size_t size, uint64_t *sum) {
    if (fread(bytes, 1, size, file) != size)
        return false;
    *sum = sum_of(*sum, bytes, size);
    return true;
}

/* Reads a checkpoint into *so_far and the block. Returns NULL on success, otherwise a description of the error. */
static const char *read_parts(FILE *file, const kt_checkpoint *checkpoint, kt_progress_so_far *so_far) {
    kt_checkpoint_head head;
    uint64_t sum = sum_start, given = 0, unused = 0;
    if (!take(file, &head, sizeof head, &sum))
        return "it is too short to be a checkpoint";
    if (memcmp(head.kind, checkpoint_kind, sizeof head.kind) != 0)
        return "it is not a checkpoint of this version of kinetree";
    if (head.scene != checkpoint->scene || head.size != checkpoint->size)
        return "it belongs to another scene, or to this one run with other options; give the scene and the options of "
               "the "
               "run that wrote it";
    if (!take(file, so_far, sizeof *so_far, &sum) || !take(file, checkpoint->block, checkpoint->size, &sum) ||
        !take(file, &given, sizeof given, &unused) || fgetc(file) != EOF)
        return "it is not as long as it was written: was it copied in full?";
    return given == sum ? NULL : "its sum is wrong: it has been damaged";
}

int kt_checkpoint_resume(kt_checkpoint *checkpoint, const char *path, kt_outcome *outcome, long long *lines) {
    kt_progress_so_far so_far;
    kt_error error = {0};
    struct stat status;
    const bool is_other = stat(path, &status) == 0 && !S_ISREG(status.st_mode);
    FILE *file = is_other ? NULL : fopen(path, "rb");
    if (file == NULL) {
        kt_say("checkpoint %s cannot be read: %s", path, is_other ? "it is not a file" : strerror(errno));
        return KT_EXIT_USAGE;
    }
    const char *wrong = read_parts(file, checkpoint, &so_far);
    (void)fclose(file);
    if (wrong == NULL && kt_simulation_restore(outcome->simulation, checkpoint->block, &error) != KT_OK)
        wrong = error.message;
    if (wrong != NULL) {
        kt_say("checkpoint %s: %s", path, wrong);
        return KT_EXIT_USAGE;
    }
    outcome->records = so_far.records;
    outcome->sound_steps = so_far.sound_steps;
    outcome->energy = so_far.energy;
    outcome->constraint = so_far.constraint;
    outcome->cpu_seconds = so_far.cpu_seconds;
    *lines = so_far.lines;
    return -1;
}
