/* Location of the bundled scenes. */
#ifndef KT_COMMAND_SCENE_BUNDLED_H
#define KT_COMMAND_SCENE_BUNDLED_H

#include <stdbool.h>
#include <stddef.h>

/* Finds the folder of this program, without a trailing slash. Returns false if the system hides it. */
bool kt_own_folder(char *folder, size_t size);

/* Whether an entry of the folder is a scene; for scandir. */
struct dirent;
int kt_is_bundled_scene(const struct dirent *entry);

/* Writes the path of the folder. If there is none, prints an error if `reports`, and returns false. */
bool kt_bundled_find(char *folder, size_t size, bool reports);

#endif
