/* The objects that tests begin with. If one cannot be made, the reason is a failed check, and the test ends. The
 * objects are released at the end of the test. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_FIXTURE_H
#define KT_TEST_FIXTURE_H

#include "check.h"
#include "describe.h"

#include "kinetree/analysis.h"
#include "kinetree/control.h"
#include "kinetree/simulation.h"

/* Whether the call succeeded; a failure is a failed check with the error's words. */
bool kt_fine(const char *what, kt_status status, const kt_error *error);

/* The same, and ends the test after a failure. */
void kt_need_fine(const char *what, kt_status status, const kt_error *error);

/* With the options of the library where they are NULL. */
kt_model *kt_test_model(const kt_description *description, const kt_model_options *options);
kt_data *kt_test_data(const kt_model *model);
kt_linearization *kt_test_linearization(const kt_model *model, const kt_linearization_options *options);
kt_modes *kt_test_modes(const kt_model *model);
kt_spectrum *kt_test_spectrum(const kt_model *model, int samples);
kt_floquet *kt_test_floquet(const kt_model *model, const kt_floquet_options *options);
kt_mass_inverse *kt_test_mass_inverse(const kt_model *model, int rows);
kt_simulation *kt_test_simulation(const kt_model *model, const kt_run *run, const kt_simulation_options *options);

/* Goes on to a time, or with all records to the end of the run. */
void kt_test_advance(kt_simulation *simulation, double time);
void kt_test_run(kt_simulation *simulation, kt_recorder *recorder, void *user);

#endif
