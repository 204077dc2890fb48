/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "folder.h"

#include "check.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int remove_entry(const char *path, const struct stat *status, int kind, struct FTW *place) {
    (void)status, (void)kind, (void)place;
    return remove(path);
}

static void remove_test_folder(void *folder) {
    if (getenv("KT_KEEP") != NULL)
        printf("       KT_KEEP: %s stays\n", (const char *)folder);
    else if (nftw(folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS) != 0)
        fprintf(stderr, "%s is left\n", (const char *)folder);
    free(folder);
}

const char *kt_test_folder(void) {
    char *folder = strdup("/tmp/kinetree-test-XXXXXX");
    kt_need((folder != NULL && mkdtemp(folder) != NULL) || kt_check_true("there is a folder", false));
    kt_test_own(folder, remove_test_folder);
    return folder;
}

const char *kt_test_path(const char *folder, const char *name) {
    const size_t size = strlen(folder) + strlen(name) + 2;
    char *path = malloc(size);
    kt_need(path != NULL || kt_check_true("there is memory", false));
    (void)snprintf(path, size, "%s/%s", folder, name);
    kt_test_own(path, free);
    return path;
}

const char *kt_test_bytes(const char *folder, const char *name, const void *bytes, size_t size) {
    const char *path = kt_test_path(folder, name);
    char *part = strdup(path);
    for (char *slash = part + strlen(folder) + 1; (slash = strchr(slash, '/')) != NULL; *slash++ = '/') {
        *slash = '\0';
        (void)mkdir(part, 0700);
    }
    free(part);
    FILE *file = fopen(path, "wb");
    const bool is_written = file != NULL && fwrite(bytes, 1, size, file) == size;
    kt_need((file != NULL && fclose(file) == 0 && is_written) || kt_check_true(path, false));
    return path;
}

char *kt_test_read(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    kt_need(file != NULL || kt_check_true(path, false));
    char *text = NULL;
    size_t used = 0, count;
    do {
        text = realloc(text, used + 65537);
        kt_need(text != NULL || kt_check_true("there is memory", false));
        count = fread(text + used, 1, 65536, file);
        used += count;
    } while (count > 0);
    (void)fclose(file);
    text[used] = '\0';
    kt_test_own(text, free);
    if (size != NULL)
        *size = used;
    return text;
}

const char *kt_test_file(const char *folder, const char *name, const char *text) {
    return kt_test_bytes(folder, name, text, strlen(text));
}
