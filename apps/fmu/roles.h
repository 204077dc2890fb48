/* The parameters of a scene as parameters of an FMU. The command and the binary of an FMU both use these roles. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_ROLES_H
#define KT_FMU_ROLES_H

#include "kinetree/scene.h"

/* Fixed: until the end of the initialization. Tunable: also later. Others follow from parameters of these kinds. */
typedef enum kt_fmu_role {
    KT_FMU_FIXED,
    KT_FMU_TUNABLE,
    KT_FMU_FOLLOWS_FIXED,
    KT_FMU_FOLLOWS_TUNABLE,
} kt_fmu_role;

static inline bool kt_fmu_role_follows(kt_fmu_role role) { return role >= KT_FMU_FOLLOWS_FIXED; }
static inline bool kt_fmu_role_is_tunable(kt_fmu_role role) { return role % 2 == 1; }

/* Finds the roles of the parameters of a scene, from the text of the resources from which the scene was read. The scene
 * is read once or twice more for each parameter. */
void kt_fmu_find_roles(const char *text, size_t size, const kt_scene *scene, kt_fmu_role *roles);

#endif
