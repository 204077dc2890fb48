/* Data that serve a simulation's present model, for libraries that are built with the core. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_FOLLOW_H
#define KT_MODEL_FOLLOW_H

#include "base/inner.h"
#include "kinetree/model.h"

/* A mechanism has a model for each set of active contacts. If the data belong to the model of another set, initialises
 * the data for this model. */
KT_INNER void kt_data_follow(const kt_model *model, kt_data *data);

#endif
