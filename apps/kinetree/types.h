/* The types of joints, loops, effects, functions and shapes, from their descriptors (kinetree/descriptor.h). */
#ifndef KT_COMMAND_TYPES_H
#define KT_COMMAND_TYPES_H

#include "base/names.h"

#include <stdbool.h>

/* All that a type of this name is, for a terminal: a joint and a loop may have the same. False if there is none. */
bool kt_types_print(const char *name);

/* Compares a name with those of all types. */
void kt_types_try(kt_nearest *nearest);

/* All types as a page in Markdown. */
void kt_types_print_page(void);

#endif
