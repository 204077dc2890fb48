/* The types of joints, loops, effects, functions and shapes, from their descriptors (kinetree/descriptor.h). */
#ifndef KT_COMMAND_TEXT_TYPES_H
#define KT_COMMAND_TEXT_TYPES_H

#include "base/names.h"

#include <stdbool.h>

/* Prints everything about the types of this name (a joint and a loop may share one) for a terminal. Returns false if
 * there is none. */
bool kt_types_print(const char *name);

/* Compares a name with those of all types. */
void kt_types_try(kt_nearest *nearest);

/* Prints the page of all types in Markdown. */
void kt_types_print_page(void);

#endif
