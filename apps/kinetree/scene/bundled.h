/* Location of the bundled scenes. */
#ifndef KT_COMMAND_SCENE_BUNDLED_H
#define KT_COMMAND_SCENE_BUNDLED_H

#include <stdbool.h>
#include <stddef.h>

/* Writes the path of the folder. Returns false after printing an error if there is none. */
bool kt_bundled_find(char *folder, size_t size);

#endif
