/* Surfaces in formats that assimp reads (COLLADA and others), if the build has found assimp. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_FOREIGN_H
#define KT_PICTURE_FOREIGN_H

#include "mesh/mesh.h"

/* Reads the contents of a file, whose format its name ends in. On failure *mesh is untouched. Errors: KT_ERROR_SCENE
 * (the fault of the file, or that there is no assimp), KT_ERROR_MEMORY. */
kt_status kt_foreign_parse(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error);

#endif
