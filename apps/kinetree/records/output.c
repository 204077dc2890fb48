/* Result files: names, checks, and the renaming at the end. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _DEFAULT_SOURCE   /* flock */
#define _XOPEN_SOURCE 700 /* realpath */
#include "records/output.h"

#include "command.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { LOCK_TRIES = 100 /* a second */, OPEN_TRIES = 3, LINKS_MOST = 40 };

static bool is_stream(const char *path) { return strcmp(path, "-") == 0; }

char *kt_folder_of(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash == NULL ? strdup(".") : strndup(path, slash == path ? 1 : (size_t)(slash - path));
}

char *kt_join_texts(const char *a, const char *b, const char *c) {
    const size_t room = strlen(a) + strlen(b) + strlen(c) + 1;
    char *text = malloc(room);
    if (text != NULL)
        snprintf(text, room, "%s%s%s", a, b, c);
    return text;
}

/* Returns the canonical name of a file, which need not exist; NULL: its folder does not exist, or memory is
 * insufficient. */
static char *find_canonical_name(const char *path) {
    char *whole = realpath(path, NULL);
    if (whole != NULL || errno != ENOENT)
        return whole;
    char *folder = kt_folder_of(path);
    if (folder == NULL)
        return NULL;
    char *real = realpath(folder, NULL);
    free(folder);
    if (real == NULL)
        return NULL;
    const char *slash = strrchr(path, '/');
    whole = kt_join_texts(real, "/", slash != NULL ? slash + 1 : path);
    free(real);
    return whole;
}

/* Returns the text of a symbolic link, from the folder of the link. NULL: memory is insufficient. */
static char *read_one_link(const char *path) {
    char text[PATH_MAX];
    const ssize_t length = readlink(path, text, sizeof text - 1);
    if (length < 0)
        return NULL;
    text[length] = '\0';
    char *folder = text[0] != '/' ? kt_folder_of(path) : NULL;
    char *name = text[0] == '/' ? strdup(text) : folder != NULL ? kt_join_texts(folder, "/", text) : NULL;
    free(folder);
    return name;
}

char *kt_follow_links(const char *path) {
    struct stat status;
    char *name = strdup(path);
    for (int i = 0; name != NULL && lstat(name, &status) == 0 && S_ISLNK(status.st_mode); i++) {
        char *next = i < LINKS_MOST ? read_one_link(name) : NULL;
        free(name);
        name = next;
        if (i == LINKS_MOST)
            errno = ELOOP;
    }
    return name;
}

/* Returns whether a file is written directly, without a partial file: devices, pipes and links to nonexistent files. */
static bool is_written_in_place(const char *path) {
    struct stat status;
    if (stat(path, &status) == 0)
        return !S_ISREG(status.st_mode);
    return lstat(path, &status) == 0;
}

static bool name_is_free(const char *path) {
    struct stat status;
    return lstat(path, &status) != 0 && errno == ENOENT;
}

/* ---- one result -------------------------------------------------------------------------------------------------- */

/* NAME.partial is the program's own name, in a folder in which others may have put a link: the file behind the link
 * would be overwritten. */
static int check_partial(kt_output *output) {
    struct stat status;
    if (lstat(output->partial, &status) != 0 || S_ISREG(status.st_mode))
        return -1;
    kt_say("%s is %s, and results are not written through it; remove it, or give the result another name",
           output->partial, S_ISLNK(status.st_mode) ? "a symbolic link" : "no regular file");
    free(output->partial); /* it is nothing of this run */
    output->partial = NULL;
    return KT_EXIT_INTEGRATION;
}

int kt_output_start(kt_output *output, const char *path) {
    *output = (kt_output){.name = NULL, .lock = -1};
    if (is_stream(path) || is_written_in_place(path)) {
        output->name = strdup(path);
    } else {
        struct stat status;
        const bool is_link = lstat(path, &status) == 0 && S_ISLNK(status.st_mode);
        output->name = is_link ? realpath(path, NULL) : strdup(path);
        output->partial = output->name != NULL ? kt_join_texts(output->name, ".partial", "") : NULL;
        if (output->partial == NULL) {
            free(output->name);
            output->name = NULL;
        }
    }
    if (output->name == NULL)
        return kt_say_no_memory(NULL);
    return output->partial != NULL ? check_partial(output) : -1;
}

const char *kt_output_path(const kt_output *output) { return output->partial != NULL ? output->partial : output->name; }

/* Locks a file for as long as it is open. A run that has just been killed may hold it for a moment, until its last
 * write has ended. File systems without locks are written without one. Returns false, with errno, if another run has
 * it. */
static bool lock(int file) {
    for (int i = 0; flock(file, LOCK_EX | LOCK_NB) != 0; i++) {
        if (errno != EWOULDBLOCK && errno != EINTR)
            return true;
        if (i == LOCK_TRIES) {
            errno = EBUSY;
            return false;
        }
        (void)nanosleep(&(struct timespec){.tv_nsec = 10000000}, NULL);
    }
    return true;
}

bool kt_file_is_named(int file, const char *name) {
    struct stat open_one, named;
    return fstat(file, &open_one) == 0 && stat(name, &named) == 0 && open_one.st_dev == named.st_dev &&
           open_one.st_ino == named.st_ino;
}

/* Returns EBUSY in errno if the file is locked. Also returns it if another file took the name at every try, because
 * another run then keeps putting files there. */
int kt_open_locked(const char *name, int flags) {
    for (int i = 0; i < OPEN_TRIES; i++) {
        const int file = open(name, flags | O_NOFOLLOW | O_CLOEXEC, 0666);
        const bool is_mine = file >= 0 && lock(file);
        if (file < 0 || (is_mine && kt_file_is_named(file, name)))
            return file;
        (void)close(file);
        if (!is_mine)
            break;
    }
    errno = EBUSY;
    return -1;
}

int kt_output_open(kt_output *output, int flags) {
    const char *name = kt_output_path(output);
    if (output->partial == NULL)
        return open(name, flags | O_CLOEXEC, 0666);
    const int file = kt_open_locked(name, flags);
    if (file >= 0)
        output->lock = fcntl(file, F_DUPFD_CLOEXEC, 0); /* the file may be closed before it is renamed */
    return file;
}

FILE *kt_output_stream(const kt_output *output) {
    const int own = output->partial != NULL ? O_NOFOLLOW : 0;
    const int file = open(kt_output_path(output), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | own, 0666);
    FILE *stream = file >= 0 ? fdopen(file, "w") : NULL;
    if (stream == NULL && file >= 0)
        (void)close(file);
    return stream;
}

void kt_sync_folder(const char *path) {
    char *folder = kt_folder_of(path);
    const int file = folder != NULL ? open(folder, O_RDONLY | O_CLOEXEC) : -1;
    if (file >= 0) {
        (void)fsync(file);
        (void)close(file);
    }
    free(folder);
}

/* Renames the partial file; the new file gets the permissions of the old one. */
static int put_in_place(const kt_output *output) {
    struct stat old;
    if (stat(output->name, &old) == 0)
        (void)chmod(output->partial, old.st_mode & 07777);
    if (rename(output->partial, output->name) == 0)
        return 0;
    kt_say("%s cannot be written: %s; the result is in %s", output->name, strerror(errno), output->partial);
    return -1;
}

int kt_output_end(kt_output *output, kt_output_fate fate) {
    int failed = 0;
    if (output->partial != NULL && (fate == KT_OUTPUT_WHOLE || (fate == KT_OUTPUT_PART && name_is_free(output->name))))
        failed = put_in_place(output);
    if (output->partial != NULL && fate == KT_OUTPUT_NOTHING)
        (void)unlink(output->partial);
    if (output->partial != NULL && output->lock >= 0)
        (void)close(output->lock);
    free(output->partial);
    free(output->name);
    *output = (kt_output){.name = NULL, .lock = -1};
    return failed;
}

/* kt_output_fill. *is_said: the error has been printed. */
static kt_status fill_output(const char *path, kt_status (*write)(FILE *file, const void *what, kt_error *error),
                             const void *what, bool *is_said, kt_error *error) {
    kt_output output;
    *is_said = kt_output_start(&output, path) >= 0;
    if (*is_said)
        return kt_reject_memory(error);
    errno = 0;
    FILE *file = is_stream(path) ? stdout : kt_output_stream(&output);
    kt_status status = file != NULL ? write(file, what, error) : KT_OK;
    bool fine = file != NULL && fflush(file) == 0 && !ferror(file);
    int reason = errno;
    if (file != NULL && file != stdout && fclose(file) != 0 && fine) {
        fine = false;
        reason = errno;
    }
    if (!fine && status == KT_OK)
        status = kt_error_set(error, KT_ERROR_FILE, NULL, "%s", strerror(reason != 0 ? reason : EIO));
    *is_said = kt_output_end(&output, status == KT_OK ? KT_OUTPUT_WHOLE : KT_OUTPUT_NOTHING) != 0;
    if (*is_said)
        status = kt_error_set(error, KT_ERROR_FILE, NULL, "the complete file could not be renamed");
    return status;
}

kt_status kt_output_fill(const char *path, kt_status (*write)(FILE *file, const void *what, kt_error *error),
                         const void *what, kt_error *error) {
    bool is_said;
    return fill_output(path, write, what, &is_said, error);
}

/* A function that leaves its errors in the stream. */
typedef struct plain_writer {
    void (*write)(FILE *file, const void *what);
    const void *what;
} plain_writer;

static kt_status write_plain(FILE *file, const void *what, kt_error *error) {
    const plain_writer *writer = what;
    (void)error;
    writer->write(file, writer->what);
    return KT_OK;
}

int kt_output_write(const char *path, void (*write)(FILE *file, const void *what), const void *what) {
    const plain_writer writer = {write, what};
    kt_error error = {0};
    bool is_said;
    const kt_status status = fill_output(path, write_plain, &writer, &is_said, &error);
    if (status != KT_OK && !is_said)
        kt_say("%s cannot be written: %s", kt_show_result(path).text, error.message);
    return status == KT_OK ? KT_EXIT_DONE : KT_EXIT_INTEGRATION;
}

char *kt_partial_name(const char *path) {
    return path == NULL                                   ? NULL
           : is_stream(path) || is_written_in_place(path) ? strdup(path)
                                                          : kt_join_texts(path, ".partial", "");
}

char *kt_part_name(const char *path) {
    return path != NULL && !is_stream(path) && name_is_free(path) ? strdup(path) : kt_partial_name(path);
}

void kt_note_replaced(const char *path, char *text, size_t size) {
    struct stat status;
    struct tm local;
    char when[32];
    const size_t used = strlen(text);
    if (path == NULL || is_stream(path) || stat(path, &status) != 0 || !S_ISREG(status.st_mode) ||
        localtime_r(&status.st_mtime, &local) == NULL || strftime(when, sizeof when, "%Y-%m-%d %H:%M", &local) == 0)
        return;
    (void)snprintf(text + used, size - used, "%s%s of %s", used > 0 ? ", " : "", kt_show(path).text, when);
}

const char *kt_temporary_folder(void) {
    const char *folder = getenv("TMPDIR");
    return folder != NULL && folder[0] == '/' ? folder : "/tmp";
}

void kt_say_written(const char *what, const char *path, const char *remark, const char *replaced) {
    kt_print("%s: %s%s\n", what, kt_show_result(path).text, remark);
    if (replaced[0] != '\0')
        kt_print("  replaces an older %s\n", replaced);
}

ptrdiff_t kt_stem_length(const char *path, const char *endings) {
    const size_t length = path != NULL ? strlen(path) : 0;
    for (const char *end = endings; *end != '\0';) {
        const size_t size = strcspn(end, "|");
        if (length >= size && strncasecmp(path + length - size, end, size) == 0)
            return (ptrdiff_t)(length - size);
        end += size + (end[size] == '|');
    }
    return -1;
}

int kt_check_ending(const char *option, const char *path, const char *ending) {
    struct stat status;
    if (path == NULL || kt_stem_length(path, ending) > 0 ||
        (stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)))
        return -1;
    return kt_misuse("%s takes the name of a file that ends in %s, not '%s'", option, ending, path);
}

/* Endings of the results of another option. */
typedef struct other_ending {
    const char *ending, *option;
} other_ending;

/* Prints an error if a name has one of the endings. Returns -1 if it has none, else KT_EXIT_USAGE. */
static int check_other_endings(const char *writes, const char *path, const other_ending *other, int count) {
    for (int i = 0; i < count; i++)
        if (kt_stem_length(path, other[i].ending) >= 0)
            return kt_misuse("%s, not '%s'; did you mean %s?", writes, path, other[i].option);
    return -1;
}

int kt_check_records(const char *path) {
    static const other_ending other[] = {{".html", "--view"},  {".svg|.png|.pdf", "--plot"},
                                         {".glb", "--glb"},    {".json", "--summary"},
                                         {".yaml", "--scene"}, {".gz", "--out - | gzip"}};
    return check_other_endings("--out writes records as CSV", path, other, sizeof other / sizeof other[0]);
}

int kt_check_lines(const char *path) {
    static const other_ending other[] = {
        {".h5|.hdf5", "--keep"}, {".svg|.png|.pdf", "'kinetree plot' afterwards"}, {".gz", "--out - | gzip"}};
    return check_other_endings("sweep: --out writes lines as CSV", path, other, sizeof other / sizeof other[0]);
}

int kt_check_summary(const char *path) {
    static const other_ending other[] = {{".csv|.h5", "--out"}, {".yaml", "--scene"}};
    return check_other_endings("--summary writes JSON", path, other, sizeof other / sizeof other[0]);
}

/* ---- all files of a command -------------------------------------------------------------------------------------- */

/* Returns whether two names denote the same file, also through links. A file that is written directly (a device) may be
 * named any number of times. */
static bool files_are_same(const char *a, const char *b) {
    struct stat first, second;
    if (is_stream(a) || is_stream(b))
        return false;
    const bool has_first = stat(a, &first) == 0, has_second = stat(b, &second) == 0;
    if (has_first && has_second)
        return S_ISREG(first.st_mode) && first.st_dev == second.st_dev && first.st_ino == second.st_ino;
    if (has_first != has_second)
        return false;
    char *one = find_canonical_name(a), *other = find_canonical_name(b);
    const bool same = one != NULL && other != NULL && strcmp(one, other) == 0;
    free(one);
    free(other);
    return same;
}

/* Returns whether two files are the same, or b is the partial file of a. */
static bool collides(const kt_file_use *a, const kt_file_use *b) {
    char *partial = a->is_written ? kt_partial_name(a->path) : NULL;
    const bool same = files_are_same(a->path, b->path) || (partial != NULL && files_are_same(partial, b->path));
    free(partial);
    return same;
}

/* Prints that a result would overwrite an input: at its end, or with its partial file during the command. */
static void say_overwrites_input(const char *command, const kt_file_use *result, const char *input,
                                 const char *itself) {
    char *partial = files_are_same(result->path, input) ? NULL : kt_partial_name(result->path);
    if (partial == NULL)
        kt_say("%s: %s is %s; give the results another file", command, kt_show(result->path).text, itself);
    else
        kt_say("%s: %s is written as %s first, which is %s; give the results another file", command,
               kt_show(result->path).text, kt_show(partial).text, itself);
    free(partial);
}

static void say_overwrites_scene(const char *command, const kt_file_use *result, const kt_file_use *input) {
    char itself[256];
    (void)snprintf(itself, sizeof itself, "%s itself", input->what);
    say_overwrites_input(command, result, input->path, itself);
}

/* The inputs that only a scene names, and the results of a command, until the program ends. Either may become known
 * first. */
typedef struct noted_file {
    const char *what; /* of a result: the command */
    struct noted_file *next;
    char path[];
} noted_file;
static noted_file *noted_files[2]; /* inputs, results */

/* Prints an error if a result would overwrite an input, and notes the file. Returns -1, or an exit code. */
static int note_file(const char *what, const char *path, bool is_written) {
    for (const noted_file *n = noted_files[!is_written]; n != NULL; n = n->next) {
        const kt_file_use use = {what, path, is_written}, other = {n->what, n->path, !is_written};
        const kt_file_use *result = is_written ? &use : &other, *input = is_written ? &other : &use;
        if (!collides(result, input))
            continue;
        say_overwrites_input(result->what, result, input->path, input->what);
        return KT_EXIT_USAGE;
    }
    noted_file *noted = malloc(sizeof *noted + strlen(path) + 1);
    if (noted == NULL)
        return kt_say_no_memory(NULL);
    *noted = (noted_file){.what = what, .next = noted_files[is_written]};
    memcpy(noted->path, path, strlen(path) + 1);
    noted_files[is_written] = noted;
    return -1;
}

int kt_check_input(const char *what, const char *path) { return path != NULL ? note_file(what, path, false) : -1; }

int kt_check_files(const char *command, const kt_file_use *uses, int count) {
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) {
            const kt_file_use *a = &uses[i], *b = &uses[j];
            if (i == j || a->path == NULL || b->path == NULL || !a->is_written || (b->is_written && j > i) ||
                !(collides(a, b) || (b->is_written && collides(b, a))))
                continue;
            if (b->is_written)
                kt_say("%s: %s and %s are one file, %s; give each result a file of its own", command, b->what, a->what,
                       a->path);
            else
                say_overwrites_scene(command, a, b);
            return KT_EXIT_USAGE;
        }
    for (int i = 0; i < count; i++) {
        int code = uses[i].is_written ? kt_check_writable(uses[i].path) : -1;
        if (code < 0 && uses[i].is_written && uses[i].path != NULL)
            code = note_file(command, uses[i].path, true);
        if (code >= 0)
            return code;
    }
    return -1;
}

/* Prints why a file cannot be written, by errno. */
int kt_check_result(const char *command, const char *what, const char *input, const char *option, const char *path) {
    const kt_file_use uses[] = {{what, input, false}, {option, path, true}};
    return kt_check_files(command, uses, 2);
}

static void say_unwritable(const char *path) {
    const int reason = errno;
    char *folder = kt_folder_of(path);
    struct stat status;
    if (reason == ENOENT && *path != '\0' && folder != NULL && stat(folder, &status) != 0 && errno == ENOENT)
        kt_say("%s cannot be written: %s; create the folder %s first", path, strerror(reason), folder);
    else
        kt_say("%s cannot be written: %s", *path != '\0' ? path : "a file without a name", strerror(reason));
    free(folder);
}

int kt_check_writable(const char *path) {
    struct stat status;
    if (path == NULL || is_stream(path))
        return -1;
    errno = *path == '\0' ? ENOENT : 0;
    bool exists = *path != '\0' && stat(path, &status) == 0;
    if (exists && S_ISDIR(status.st_mode))
        errno = EISDIR;
    else if (exists && access(path, W_OK) == 0 && !S_ISREG(status.st_mode))
        return -1;
    else if ((exists && access(path, W_OK) == 0) || (!exists && errno == ENOENT && *path != '\0')) {
        char *real = exists ? realpath(path, NULL) : NULL, *folder = kt_folder_of(real != NULL ? real : path);
        const int rejected = folder == NULL ? 0 : access(folder, W_OK | X_OK);
        const int reason = errno;
        free(folder);
        free(real);
        if (rejected == 0)
            return -1;
        errno = reason;
    }
    say_unwritable(path);
    return KT_EXIT_INTEGRATION;
}
