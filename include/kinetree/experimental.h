/* Experimental: all headers whose functions and structs may change in any version. kinetree.h has the stable ones. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_EXPERIMENTAL_H
#define KINETREE_EXPERIMENTAL_H

#include "kinetree/analysis.h"
#include "kinetree/build.h"
#include "kinetree/codegen.h"
#include "kinetree/dae.h"
#include "kinetree/descriptor.h"
#include "kinetree/ensemble.h"
#include "kinetree/export.h"
#include "kinetree/expression.h"
#include "kinetree/formulation.h"
#include "kinetree/identification.h"
#include "kinetree/import.h"
#include "kinetree/integrator.h"
#include "kinetree/stability.h"
#include "kinetree/study.h"

#endif
