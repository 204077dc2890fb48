/* Closed mechanisms: scenes compiled with each way of reducing their loops, and checks that apply to all of them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_REFERENCE_CLOSED_H
#define KT_TEST_REFERENCE_CLOSED_H

#include "scene.h"

/* Opens a scene, to be reduced in this way; notes which. */
kt_case kt_closed_open(const char *name, kt_reduction reduction, kt_metric metric);

/* Compiles the scene's description again, as it is now. */
void kt_closed_compile(kt_case *c, kt_reduction reduction, kt_metric metric);

/* The place of a marker in a record; a failed check and NaN where there is none. */
kt_vec3 kt_closed_place(const kt_case *c, const kt_record *record, const char *body, const char *marker);

/* The first position (velocity) of a joint in a record. */
double kt_closed_q(const kt_case *c, const kt_record *record, const char *joint);
double kt_closed_v(const kt_case *c, const kt_record *record, const char *joint);

#endif
