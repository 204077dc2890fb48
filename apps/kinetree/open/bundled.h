/* Location of the bundled scenes and of other installed files. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_BUNDLED_H
#define KT_COMMAND_SCENE_BUNDLED_H

#include <stdbool.h>
#include <stddef.h>

/* Finds a file in three folders, or one of these folders if the name is empty. The first place is relative to the
 * folder of this program, so that an installation can be moved. The second is in the tree of the build. The third is
 * that of the configured installation. Returns false if none of them has it. */
enum { KT_PLACES = 3 };
bool kt_find_installed(const char *const places[KT_PLACES], const char *name, char *path, size_t size);

/* Whether an entry of the folder is a scene; for scandir. */
struct dirent;
int kt_is_bundled_scene(const struct dirent *entry);

/* Writes the path of the folder. If there is none, prints an error if `reports`, and returns false. */
bool kt_bundled_find(char *folder, size_t size, bool reports);

#endif
