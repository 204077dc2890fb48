/* A live page contains a scene in flow style, the engine for browsers, and the motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_VIEW_LIVE_H
#define KT_COMMAND_VIEW_LIVE_H

#include "command.h"
#include "text/bytes.h"

typedef struct kt_live {
    kt_bytes scene, engine; /* engine: WebAssembly, as gzip */
} kt_live;

/* Reads the engine, before the run. Returns -1, or an exit code after printing what is missing. */
int kt_live_find_engine(kt_live *live);

/* Takes the scene of a file, with the settings of the command line, as a page reads it: without other files. scene: the
 * same one as it was read. Returns -1, or an exit code after printing why the scene cannot be live. */
int kt_live_take_scene(kt_live *live, const char *path, const kt_settings *settings, const kt_scene *scene);

void kt_live_free(kt_live *live);

#endif
