/* Actions of events, as nodes of the file. Names of states depend on them, before the events are read. */
#ifndef KT_SCENE_ACTION_H
#define KT_SCENE_ACTION_H

#include "scene/reader.h"

/* Visits the actions of the file's events that are mappings. */
typedef void kt_action_visit(const kt_node *action, void *user);
void kt_actions_visit(const kt_reader *r, kt_action_visit *visit, void *user);

#endif
