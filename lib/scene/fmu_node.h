/* Effects of the type `fmu`, as nodes of the file, before anything else is read. */
#ifndef KT_SCENE_FMU_NODE_H
#define KT_SCENE_FMU_NODE_H

#include "scene/reader.h"

/* Takes these items out of the section `effects`. */
void kt_fmus_take(kt_reader *r);

/* Whether an output of an FMU is the parameter of this name; NULL: any parameter. */
bool kt_fmus_set(const kt_reader *r, const char *name);

/* The first key of a mapping of an FMU; NULL: the mapping is missing, empty or something else. */
kt_node *kt_fmu_first(const kt_node *item, const char *key);

/* Whether a section of the file, a mapping, has a key. */
bool kt_section_has(const kt_reader *r, const char *section, const char *key);

#endif
