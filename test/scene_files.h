/* The bundled scenes, for scandir(KT_SCENES, ...). */
#ifndef KT_TEST_SCENE_FILES_H
#define KT_TEST_SCENE_FILES_H

#include <dirent.h>
#include <string.h>

static inline int kt_is_scene_file(const struct dirent *entry) {
    const size_t length = strlen(entry->d_name);
    return length > 5 && strcmp(entry->d_name + length - 5, ".yaml") == 0;
}

#endif
