/* Evaluations in states in which an open contact touches. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EVALUATE_OPEN_H
#define KT_EVALUATE_OPEN_H

#include "model/model.h"

/* Rejects a state in which an open contact touches and does not part, since an evaluation would leave its reaction out.
 * Data keep all results. kt_open_contacts_reject (evaluate/evaluate.h) exempts data of an owner that follows
 * contacts.
 *
 * kt_open_contacts_place also sets kt_data.placed if the poses of the spatial links are those of q. The caller
 * evaluates accelerations in this state next, or resets it. */
KT_CHECKED kt_status kt_open_contacts_check(const kt_model *model, kt_data *data, double t, const double *q,
                                            const double *v, kt_error *error);
KT_CHECKED kt_status kt_open_contacts_place(const kt_model *model, kt_data *data, double t, const double *q,
                                            const double *v, kt_error *error);

#endif
