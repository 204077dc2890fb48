/* Where the bundled scenes are. */
#ifndef KT_APPS_BUNDLED_H
#define KT_APPS_BUNDLED_H

#include <stdbool.h>
#include <stddef.h>

/* Writes the folder's path; returns false, having said why, if there is none. */
bool kt_bundled_find(char *folder, size_t size);

#endif
