/* The archive of an FMU (archive.h), read by minizip. Names that lead out of the folder are rejected. */
#include "fmu/archive.h"
#include "base/text.h"
#include "command.h"
#include "records/output.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- folders ----------------------------------------------------------------------------------------------------- */

/* Removes a file or a folder. Links are removed, and not followed. */
static void remove_tree(const char *path) {
    struct stat status;
    if (lstat(path, &status) != 0)
        return;
    if (!S_ISDIR(status.st_mode)) {
        (void)unlink(path);
        return;
    }
    DIR *folder = opendir(path);
    const struct dirent *item;
    while (folder != NULL && (item = readdir(folder)) != NULL) {
        if (strcmp(item->d_name, ".") == 0 || strcmp(item->d_name, "..") == 0)
            continue;
        const size_t room = strlen(path) + strlen(item->d_name) + 2;
        char *below = malloc(room);
        if (below == NULL)
            break;
        (void)snprintf(below, room, "%s/%s", path, item->d_name);
        remove_tree(below);
        free(below);
    }
    if (folder != NULL)
        (void)closedir(folder);
    (void)rmdir(path);
}

void kt_fmu_remove(char *folder) {
    if (folder[0] != '\0')
        remove_tree(folder);
    folder[0] = '\0';
}

#if KT_IMPORTS_FMU

#include <minizip/unzip.h>

/* ---- entries ----------------------------------------------------------------------------------------------------- */

/* The largest entry, and the largest number of entries: small archives can expand to large ones. */
static const uint64_t entry_most = (uint64_t)1 << 30;
enum { ENTRIES_MOST = 100000, NAME_SIZE = 1024, BLOCK = 1 << 16 };

static unzFile open_archive(const char *path, kt_error *error) {
    struct stat status;
    unzFile zip = NULL;
    if (stat(path, &status) != 0 || access(path, R_OK) != 0)
        (void)kt_error_set(error, KT_ERROR_FILE, NULL, "%.200s cannot be read: %s", path, strerror(errno));
    else if (!S_ISREG(status.st_mode) || (zip = unzOpen64(path)) == NULL)
        (void)kt_error_set(error, KT_ERROR_SCENE, NULL, "%.200s is no FMU: it is no zip archive", path);
    return zip;
}

static kt_status reject_entry(const char *path, const char *entry, kt_error *error) {
    return kt_error_set(error, KT_ERROR_SCENE, NULL,
                        "%.200s: the entry '%.100s' is damaged, too large, or leads out of the archive", path, entry);
}

kt_status kt_fmu_read_entry(const char *path, const char *entry, char **text, size_t *size, kt_error *error) {
    unz_file_info64 info;
    unzFile zip = open_archive(path, error);
    *text = NULL;
    if (zip == NULL)
        return error->code;
    kt_status status = KT_OK;
    if (unzLocateFile(zip, entry, 1) != UNZ_OK)
        status = kt_error_set(error, KT_ERROR_SCENE, NULL, "%.200s is no FMU: it has no %.100s", path, entry);
    else if (unzGetCurrentFileInfo64(zip, &info, NULL, 0, NULL, 0, NULL, 0) != UNZ_OK ||
             info.uncompressed_size > entry_most || unzOpenCurrentFile(zip) != UNZ_OK)
        status = reject_entry(path, entry, error);
    if (status == KT_OK && (*text = malloc((size_t)info.uncompressed_size + 1)) == NULL)
        status = kt_reject_memory(error);
    if (status == KT_OK) {
        const int count = unzReadCurrentFile(zip, *text, (unsigned)info.uncompressed_size);
        *size = (size_t)info.uncompressed_size;
        (*text)[*size] = '\0';
        if (count < 0 || (uint64_t)count != info.uncompressed_size || unzCloseCurrentFile(zip) != UNZ_OK)
            status = reject_entry(path, entry, error);
    }
    if (status != KT_OK) {
        free(*text);
        *text = NULL;
    }
    (void)unzClose(zip);
    return status;
}

/* Makes the folders of a name. */
static bool make_folders(char *path, size_t from) {
    for (char *slash = strchr(path + from, '/'); slash != NULL; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        const bool fine = mkdir(path, S_IRWXU) == 0 || errno == EEXIST;
        *slash = '/';
        if (!fine)
            return false;
    }
    return true;
}

/* Writes the current entry to a file. */
static bool extract_entry(unzFile zip, const char *path) {
    char block[BLOCK];
    uint64_t total = 0;
    int count = -1;
    const int file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRWXU);
    bool fine = file >= 0 && unzOpenCurrentFile(zip) == UNZ_OK;
    while (fine && (count = unzReadCurrentFile(zip, block, sizeof block)) > 0) {
        total += (uint64_t)count;
        fine = total <= entry_most && write(file, block, (size_t)count) == count;
    }
    fine = fine && count == 0 && unzCloseCurrentFile(zip) == UNZ_OK;
    if (file >= 0)
        fine = close(file) == 0 && fine;
    return fine;
}

static kt_status unpack_entry(unzFile zip, const char *path, const char *folder, kt_error *error) {
    char name[NAME_SIZE], to[KT_FMU_PATH];
    if (unzGetCurrentFileInfo64(zip, NULL, name, sizeof name, NULL, 0, NULL, 0) != UNZ_OK)
        return reject_entry(path, "?", error);
    name[sizeof name - 1] = '\0';
    const int length = snprintf(to, sizeof to, "%s/%s", folder, name);
    if (!kt_path_is_inner(name) || length >= (int)sizeof to || !make_folders(to, strlen(folder) + 1))
        return reject_entry(path, name, error);
    if (to[length - 1] == '/')
        return KT_OK;
    return extract_entry(zip, to) ? KT_OK : reject_entry(path, name, error);
}

kt_status kt_fmu_unpack(const char *path, char *folder, kt_error *error) {
    unzFile zip = open_archive(path, error);
    kt_status status = zip != NULL ? KT_OK : error->code;
    int entries = 0;
    (void)snprintf(folder, KT_FMU_PATH, "%.2000s/kinetree-fmu-XXXXXX", kt_temporary_folder());
    if (status == KT_OK && mkdtemp(folder) == NULL)
        status = kt_error_set(error, KT_ERROR_FILE, NULL, "no temporary folder %.200s can be made: %s", folder,
                              strerror(errno));
    if (status != KT_OK)
        folder[0] = '\0';
    for (int code = status == KT_OK ? unzGoToFirstFile(zip) : UNZ_ERRNO; code == UNZ_OK && status == KT_OK;
         code = unzGoToNextFile(zip))
        status = ++entries <= ENTRIES_MOST ? unpack_entry(zip, path, folder, error) : reject_entry(path, "?", error);
    if (status != KT_OK)
        kt_fmu_remove(folder);
    if (zip != NULL)
        (void)unzClose(zip);
    return status;
}

#else

static kt_status reject_build(kt_error *error) {
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, NULL,
                        "this build of kinetree does not read FMUs; build it on Linux with minizip");
}

kt_status kt_fmu_read_entry(const char *path, const char *entry, char **text, size_t *size, kt_error *error) {
    (void)path, (void)entry, (void)size;
    *text = NULL;
    return reject_build(error);
}

kt_status kt_fmu_unpack(const char *path, char *folder, kt_error *error) {
    (void)path;
    folder[0] = '\0';
    return reject_build(error);
}

#endif
