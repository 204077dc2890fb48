/* All stable headers of kinetree. The other ones are included by kinetree/experimental.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_KINETREE_H
#define KINETREE_KINETREE_H

#include "kinetree/algebra.h"
#include "kinetree/batch.h"
#include "kinetree/body.h"
#include "kinetree/closure.h"
#include "kinetree/control.h"
#include "kinetree/description.h"
#include "kinetree/dynamics.h"
#include "kinetree/effect.h"
#include "kinetree/function.h"
#include "kinetree/instant.h"
#include "kinetree/joint.h"
#include "kinetree/lookup.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/method.h"
#include "kinetree/model.h"
#include "kinetree/quantity.h"
#include "kinetree/record.h"
#include "kinetree/run.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"
#include "kinetree/simulation.h"
#include "kinetree/status.h"

#endif
