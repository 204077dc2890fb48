/* Reading and writing with a list of what is refused: for tests of what the engine cannot do yet. */
#ifndef KT_SCENE_PARSE_H
#define KT_SCENE_PARSE_H

#include "kinetree/scene.h"

/* As kt_scene_parse and kt_scene_write, with a list in place of kt_support_refused; NULL refuses nothing. */
KT_CHECKED kt_status kt_scene_parse_without(const char *const *refused, const char *path, const char *text, size_t size,
                                            kt_scene *scene, kt_scene_report *report, void *user, kt_error *error);
KT_CHECKED kt_status kt_scene_write_without(const char *const *refused, const kt_scene *scene, FILE *stream,
                                            kt_error *error);

#endif
