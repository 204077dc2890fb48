/* Models of SDF as texts. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_SDF_TEXT_H
#define KT_TEST_ROBOT_SDF_TEXT_H

#define SDF(within) "<sdf version='1.9'><model name='m'>" within "</model></sdf>"
#define LINK(name) "<link name='" name "'/>"

#endif
