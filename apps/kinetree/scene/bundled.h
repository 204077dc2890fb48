/* Location of the bundled scenes and of other installed files. */
#ifndef KT_COMMAND_SCENE_BUNDLED_H
#define KT_COMMAND_SCENE_BUNDLED_H

#include <stdbool.h>
#include <stddef.h>

/* Finds a file in folders, or a folder if its name is empty. places: one from the folder of this program, so that an
 * installation can be moved; one in the tree of the build; one in which the build was configured to install files.
 * Returns false if none of them has it. */
enum { KT_PLACES = 3 };
bool kt_find_installed(const char *const places[KT_PLACES], const char *name, char *path, size_t size);

/* Whether an entry of the folder is a scene; for scandir. */
struct dirent;
int kt_is_bundled_scene(const struct dirent *entry);

/* Writes the path of the folder. If there is none, prints an error if `reports`, and returns false. */
bool kt_bundled_find(char *folder, size_t size, bool reports);

#endif
