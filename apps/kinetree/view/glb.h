/* A motion as glTF 2.0 in one binary file (GLB), which other viewers and modellers read. */
#ifndef KT_COMMAND_VIEW_GLB_H
#define KT_COMMAND_VIEW_GLB_H

#include "view/motion.h"

/* Writes the file: a node for each body, animated, with meshes of its solids. name: of the scene. Returns KT_EXIT_DONE,
 * or an exit code after printing the error. */
int kt_glb_write(const kt_motion *motion, const char *name, const char *path);

#endif
