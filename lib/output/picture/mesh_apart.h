/* Meshes that a library reads in a process of its own: if the library crashes, the program continues. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_MESH_APART_H
#define KT_PICTURE_MESH_APART_H

#include "mesh/mesh.h"

/* Reads the contents of a file of a path. */
typedef kt_status kt_mesh_reader(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error);

/* Calls a reader in a child process and returns the status of the reader. The limits of the process are those of
 * document/apart.h. On failure *mesh is untouched. Errors: those of the reader; KT_ERROR_SCENE if the process ends
 * without an answer, or does not answer in time; KT_ERROR_MEMORY. */
kt_status kt_mesh_read_apart(kt_mesh_reader *reader, double seconds, const char *path, const char *text, size_t size,
                             kt_triangles *mesh, kt_error *error);

#endif
