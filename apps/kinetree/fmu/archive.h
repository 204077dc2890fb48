/* The archive of an FMU: its entries in memory, and all of it in a temporary folder. */
#ifndef KT_COMMAND_FMU_ARCHIVE_H
#define KT_COMMAND_FMU_ARCHIVE_H

#include "kinetree/status.h"

#include <stddef.h>

enum { KT_FMU_PATH = 4096 };

/* Reads an entry into *text, with a terminating zero; the caller frees it. Errors: KT_ERROR_SCENE: the file is no
 * archive, or does not have the entry; KT_ERROR_FILE, KT_ERROR_MEMORY. */
KT_CHECKED kt_status kt_fmu_read_entry(const char *path, const char *entry, char **text, size_t *size, kt_error *error);

/* Writes all entries to a new temporary folder, whose name goes to `folder` (KT_FMU_PATH bytes). Errors: as above. The
 * folder is removed after an error. */
KT_CHECKED kt_status kt_fmu_unpack(const char *path, char *folder, kt_error *error);

/* Removes such a folder with its content; an empty name: nothing. */
void kt_fmu_remove(char *folder);

#endif
