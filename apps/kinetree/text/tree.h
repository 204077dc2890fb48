/* The tree of a model, drawn as text. */
#ifndef KT_COMMAND_TEXT_TREE_H
#define KT_COMMAND_TEXT_TREE_H

#include "kinetree/model.h"

/* Prints the tree on standard output, abridged to about a hundred lines. Returns 0, or -1 if memory is insufficient. */
int kt_tree_draw(const kt_model *model);

#endif
