/* Documents in the flow style of YAML, {key: value, list: [1, 2]}, which FMUs read without libyaml. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_FLOW_H
#define KT_DOCUMENT_FLOW_H

#include "document/node.h"

#include <stdio.h>

/* Writes a tree of nodes. Each entry of the outermost mapping and of the lists in it has a line of its own. Another
 * reader of YAML takes the text for the same tree. */
void kt_flow_write(const kt_node *root, FILE *stream);

#endif
