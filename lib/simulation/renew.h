/* Parameters of models that a simulation makes while it runs. */
#ifndef KT_SIMULATION_RENEW_H
#define KT_SIMULATION_RENEW_H

#include "base/inner.h"
#include "kinetree/simulation.h"

/* Takes parameters over that kt_parameter_set has set: the model of a set of masked contacts has copies of some numbers
 * (contact/mask.h). Steps, runs, records and accelerations do so by themselves. Call it before you evaluate the model
 * in between.
 * Cost: a comparison of two revisions if nothing has been set. */
KT_INNER void kt_simulation_renew_model(const kt_simulation *simulation);

#endif
