/* The variables of an FMU that a scene names, and their units. */
#ifndef KT_COMMAND_FMU_PORT_H
#define KT_COMMAND_FMU_PORT_H

#include "fmu/description.h"
#include "kinetree/scene.h"

/* How a scene uses a variable. */
typedef enum kt_fmu_role { KT_FMU_INPUT, KT_FMU_OUTPUT, KT_FMU_PARAMETER } kt_fmu_role;

/* Finds the variable of a port. Returns NULL after an error at the place of the port: a name that the FMU lacks, a
 * variable for another role, a type that is no number. */
const kt_fmi_variable *kt_fmu_port_find(const kt_fmi_description *description, const kt_scene_fmu *fmu,
                                        const kt_scene_port *port, kt_fmu_role role, kt_error *error);

/* Returns whether the value can be converted to the type of the variable; else *error has the reason. */
bool kt_fmu_value_fits(const kt_fmi_variable *variable, double value, kt_error *error);

/* Writes the reason why the units of a port differ. Returns false if they are equal, or one of them is unknown. */
bool kt_fmu_units_differ(const kt_description *scene, const kt_fmi_description *description, const kt_scene_port *port,
                         kt_fmu_role role, char *text, size_t size);

#endif
