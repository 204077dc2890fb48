/* KT_INNER marks internal names of the core that libkinetree-study and libkinetree-scene use. These libraries are built
 * with the core. The shared library exports the names, but no public header declares them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_INNER_H
#define KT_BASE_INNER_H

#include "kinetree/status.h"

#define KT_INNER KT_API

#endif
