/* An instance of an FMU (instance.h).
 *
 * The archive is unpacked to a temporary folder. If it has no resources, the folder is removed as soon as the binary is
 * loaded, so that nothing remains even if the program is killed. Else it is removed at the end.
 */
#include "fmu/instance.h"

#include <ctype.h>
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { KT_FMI_BINARY = KT_FMU_PATH + KT_FMU_PATH / 4 }; /* bytes of the path of a binary */

#ifdef __linux__
#include <link.h>

/* Whether a file has all bytes that its parts name. The loader ends the program at the first one that is missing. */
static bool has_all_parts(FILE *file, const ElfW(Ehdr) * head, uint64_t size) {
    ElfW(Phdr) part;
    bool fine = head->e_phoff <= size && fseek(file, (long)head->e_phoff, SEEK_SET) == 0;
    for (int i = 0; i < head->e_phnum && fine; i++)
        fine = fread(&part, sizeof part, 1, file) == 1 &&
               (part.p_type != PT_LOAD || (part.p_offset <= size && part.p_filesz <= size - part.p_offset));
    return fine;
}

/* Returns the fault of a binary; NULL: it has none that shows in its file. */
static const char *fault_of_binary(const char *path) {
    ElfW(Ehdr) head = {.e_phnum = 0};
    struct stat status = {.st_size = 0};
    FILE *file = fopen(path, "rb");
    const bool is_read = file != NULL && fstat(fileno(file), &status) == 0 && fread(&head, sizeof head, 1, file) == 1;
    const char *fault = NULL;
    if (!is_read || memcmp(head.e_ident, ELFMAG, SELFMAG) != 0 || head.e_phentsize != sizeof(ElfW(Phdr)))
        fault = "cannot be loaded: it is no shared library of this system";
    else if (!has_all_parts(file, &head, (uint64_t)status.st_size))
        fault = "is cut off";
    if (file != NULL)
        (void)fclose(file);
    return fault;
}
#else
static const char *fault_of_binary(const char *path) {
    (void)path;
    return NULL;
}
#endif

/* Unpacks an archive. Writes the path of its binary. */
static kt_status unpack_binary(kt_fmi_instance *f, const char *file, char path[KT_FMI_BINARY], kt_error *error) {
    char binary[KT_FMU_PATH / 4];
    kt_fmi_binary_name(&f->description, binary, sizeof binary);
    const kt_status status = kt_fmu_unpack(file, f->folder, error);
    if (status != KT_OK)
        return status;
    (void)snprintf(path, KT_FMI_BINARY, "%s/%s", f->folder, binary);
    if (access(path, F_OK) != 0)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, NULL,
                            "%.200s has no binary for this system, %s; export the FMU for it, or build its sources",
                            file, binary);
    const char *fault = fault_of_binary(path);
    return fault == NULL
               ? KT_OK
               : kt_error_set(error, KT_ERROR_SCENE, NULL, "%.200s: its binary %s; export the FMU again", file, fault);
}

static kt_status load_binary(kt_fmi_instance *f, const char *file, kt_error *error) {
    char path[KT_FMI_BINARY];
    const kt_status status = unpack_binary(f, file, path, error);
    if (status != KT_OK)
        return status;
    f->library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (f->library == NULL)
        return kt_error_set(error, KT_ERROR_SCENE, NULL, "%.200s: its binary cannot be loaded: %.300s", file,
                            dlerror());
    return kt_fmi_find_functions(f, file, error);
}

/* Writes the URI of the resources in a folder, in which other characters than those of names have their number. */
static void write_resources_uri(const char *folder, char *uri, size_t size) {
    size_t used = (size_t)snprintf(uri, size, "file://");
    for (; *folder != '\0'; folder++) {
        const unsigned char c = (unsigned char)*folder;
        const bool is_plain = isalnum(c) || strchr("/-._~", c) != NULL;
        used += (size_t)snprintf(uri + used, size - used, is_plain ? "%c" : "%%%02X", c);
    }
    (void)snprintf(uri + used, size - used, "/resources");
}

/* A folder of resources that is empty is none. */
static void name_resources(kt_fmi_instance *f) {
    char path[KT_FMI_BINARY];
    (void)snprintf(path, sizeof path, "%s/resources", f->folder);
    (void)rmdir(path);
    if (access(path, F_OK) != 0)
        kt_fmu_remove(f->folder);
    else if (f->description.version == 3)
        (void)snprintf(f->resources, sizeof f->resources, "%s/resources/", f->folder);
    else
        write_resources_uri(f->folder, f->resources, sizeof f->resources);
}

kt_status kt_fmi_renew(kt_fmi_instance *f, kt_error *error) {
    char where[KT_WHERE_SIZE];
    kt_fmi_free_instance(f);
    const bool is_broken = f->worst == KT_FMI_FATAL;
    f->worst = is_broken ? KT_FMI_FATAL : KT_FMI_OK;
    if (!is_broken && f->calls->instantiate(f))
        return KT_OK;
    (void)snprintf(where, sizeof where, "FMU '%.60s'", f->name);
    return kt_error_set(error, KT_ERROR_CALLBACK, where, "no instance can be made%s%s",
                        f->message[0] != '\0' ? ": " : "", f->message);
}

kt_status kt_fmi_inspect(const char *file, kt_error *error) {
    char path[KT_FMI_BINARY];
    kt_fmi_instance f = {.name = NULL};
    kt_status status = kt_fmi_description_read(file, &f.description, error);
    if (status == KT_OK)
        status = unpack_binary(&f, file, path, error);
    kt_fmi_close(&f);
    return status;
}

kt_status kt_fmi_open(kt_fmi_instance *f, const char *name, const char *file, kt_error *error) {
    f->name = name;
    kt_status status = kt_fmi_description_read(file, &f->description, error);
    f->calls = f->description.version == 2 ? &kt_fmi2_interface : &kt_fmi3_interface;
    if (status == KT_OK)
        status = load_binary(f, file, error);
    if (status == KT_OK)
        name_resources(f);
    return status == KT_OK ? kt_fmi_renew(f, error) : status;
}

void kt_fmi_close(kt_fmi_instance *f) {
    kt_fmi_free_instance(f);
    if (f->library != NULL)
        (void)dlclose(f->library);
    kt_fmu_remove(f->folder);
    kt_fmi_description_free(&f->description);
    *f = (kt_fmi_instance){.name = NULL};
}
