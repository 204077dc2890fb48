/* The size below which an inertia along a degree of freedom counts as none, relative to the inertia that is carried. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_NO_INERTIA_H
#define KT_DYNAMICS_NO_INERTIA_H

#define KT_NO_INERTIA 1e-14 /* about 45 units of rounding */

#endif
