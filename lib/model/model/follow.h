/* Data that serve a simulation's present model, for libraries that are built with the core. */
#ifndef KT_MODEL_FOLLOW_H
#define KT_MODEL_FOLLOW_H

#include "base/inner.h"
#include "kinetree/model.h"

/* Initialises data of one of the models of a mechanism for another one of them, if they belong to a model of another
 * set. */
KT_INNER void kt_data_follow(const kt_model *model, kt_data *data);

#endif
