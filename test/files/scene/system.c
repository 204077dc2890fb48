/* Failures of system calls while a scene is read or written: each gives a clear error, and nothing changes.
 *
 * These calls are the program's own; the C library's come after them.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* AT_EMPTY_PATH, syscall */
#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "check.h"
#include "collect.h"

static struct {
    int interruptions; /* of read, still to come */
    int read_error;    /* errno of read; 0: it works */
    bool endless;      /* read never comes to an end */
    int status_error;  /* errno of fstat */
    bool no_locale;
} trouble;

/* NOLINTBEGIN(readability-inconsistent-declaration-parameter-name): the system's have underscores */
ssize_t read(int file, void *bytes, size_t size) {
    if (trouble.interruptions > 0 || trouble.read_error != 0) {
        errno = trouble.interruptions > 0 ? EINTR : trouble.read_error;
        trouble.interruptions -= trouble.interruptions > 0;
        return -1;
    }
    if (trouble.endless) {
        memset(bytes, ' ', size);
        return (ssize_t)size;
    }
    return syscall(SYS_read, file, bytes, size);
}

/* The name of read in code with checked copies (_FORTIFY_SOURCE). */
ssize_t __read_chk(int file, void *bytes, size_t size, size_t room);
ssize_t __read_chk(int file, void *bytes, size_t size, size_t room) {
    (void)room;
    return read(file, bytes, size);
}

int fstat(int file, struct stat *status) {
    if (trouble.status_error != 0) {
        errno = trouble.status_error;
        return -1;
    }
    return fstatat(file, "", status, AT_EMPTY_PATH);
}

locale_t newlocale(int mask, const char *name, locale_t base) {
    (void)mask;
    (void)name;
    if (trouble.no_locale) {
        errno = ENOMEM;
        return (locale_t)0;
    }
    return duplocale(base == (locale_t)0 ? LC_GLOBAL_LOCALE : base); /* a test runs in the C locale */
}
/* NOLINTEND(readability-inconsistent-declaration-parameter-name) */

/* A file of its own with this text, and its name; the caller removes it. */
static bool make_file(char path[32], const char *text) {
    strcpy(path, "/tmp/kinetree-system-XXXXXX");
    const int file = mkstemp(path);
    const size_t length = strlen(text);
    const bool written = file >= 0 && write(file, text, length) == (ssize_t)length;
    return kt_check_true("a file", file >= 0 && close(file) == 0 && written);
}

static const char small[] = "kinetree: 1\nname: small\n";

static void check_rejected(const char *path, const char *message) {
    kt_scene scene, rest = kt_scene_default();
    kt_error error = {KT_OK, "", ""};
    memcpy(&scene, &rest, sizeof scene);
    kt_check_equal_int("status", kt_scene_read(path, &scene, NULL, NULL, &error), KT_ERROR_FILE);
    kt_check_text("where", error.where, path);
    kt_check_text("message", error.message, message);
    kt_check_true("the scene is untouched", kt_same_bytes(&scene, &rest, sizeof scene));
}

KT_TEST(interrupted_reading_goes_on) {
    char path[32];
    kt_scene scene;
    if (!make_file(path, small))
        return;
    trouble.interruptions = 3;
    const kt_status status = kt_scene_read(path, &scene, NULL, NULL, NULL);
    const int left = trouble.interruptions;
    trouble.interruptions = 0;
    (void)unlink(path);
    kt_check_equal_int("interruptions left", left, 0);
    kt_need(kt_check_equal_int("status", status, KT_OK));
    kt_check_text("name", scene.description.name, "small");
    kt_scene_free(&scene);
}

KT_TEST(failing_reading_is_said_in_the_systems_words) {
    char path[32];
    if (!make_file(path, small))
        return;
    trouble.read_error = EIO;
    check_rejected(path, "cannot be read: Input/output error");
    trouble.read_error = 4095; /* no system has words for it */
    check_rejected(path, "cannot be read: error 4095");
    trouble.read_error = 0;
    trouble.status_error = EOVERFLOW;
    check_rejected(path, "cannot be read: Value too large for defined data type");
    trouble.status_error = 0;
    (void)unlink(path);
}

/* Its size was small when the program requested the size. */
KT_TEST(file_that_grows_without_end_is_rejected) {
    char path[32];
    if (!make_file(path, small))
        return;
    trouble.endless = true;
    check_rejected(path, "the file has more than 64 MB; a scene has at most that");
    trouble.endless = false;
    (void)unlink(path);
}

KT_TEST(without_a_locale_nothing_is_read_or_written) {
    kt_scene scene, rest = kt_scene_default();
    kt_error error = {KT_OK, "", ""};
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    kt_need(kt_check_true("a stream", stream != NULL));
    memcpy(&scene, &rest, sizeof scene);
    trouble.no_locale = true;
    kt_check_equal_int("reading", kt_scene_parse("x", small, sizeof small - 1, &scene, NULL, NULL, &error),
                       KT_ERROR_MEMORY);
    kt_check_text("message", error.message, "there is not enough memory to read the scene");
    kt_check_true("the scene is untouched", kt_same_bytes(&scene, &rest, sizeof scene));
    kt_check_equal_int("writing", kt_scene_write(&scene, stream, &error), KT_ERROR_MEMORY);
    kt_check_text("message", error.message, "there is not enough memory to write the scene");
    trouble.no_locale = false;
    (void)fclose(stream);
    kt_check_equal_int("bytes written", (long long)size, 0);
    free(text);
}
