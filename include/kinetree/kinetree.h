/* All of kinetree. */
#ifndef KINETREE_KINETREE_H
#define KINETREE_KINETREE_H

#include "kinetree/algebra.h"
#include "kinetree/analysis.h"
#include "kinetree/batch.h"
#include "kinetree/body.h"
#include "kinetree/build.h"
#include "kinetree/closure.h"
#include "kinetree/codegen.h"
#include "kinetree/control.h"
#include "kinetree/dae.h"
#include "kinetree/description.h"
#include "kinetree/descriptor.h"
#include "kinetree/dynamics.h"
#include "kinetree/effect.h"
#include "kinetree/equations.h"
#include "kinetree/export.h"
#include "kinetree/expression.h"
#include "kinetree/formulation.h"
#include "kinetree/function.h"
#include "kinetree/identification.h"
#include "kinetree/import.h"
#include "kinetree/integrator.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/method.h"
#include "kinetree/model.h"
#include "kinetree/record.h"
#include "kinetree/run.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"
#include "kinetree/simulation.h"
#include "kinetree/stability.h"
#include "kinetree/status.h"
#include "kinetree/study.h"

#ifdef KT_COMPAT_0_1 /* names and calls of version 0.1 */
#include "kinetree/compat.h"
#endif

#endif
