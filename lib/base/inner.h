/* KT_INNER marks what libkinetree-study and libkinetree-scene, which are built with the core, use of the core's inside: the
 * shared library exports it, but no public header has it. */
#ifndef KT_BASE_INNER_H
#define KT_BASE_INNER_H

#include "kinetree/status.h"

#define KT_INNER KT_API

#endif
