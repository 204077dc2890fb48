/* The plan of a scene, for people and as JSON. */
#ifndef KT_COMMAND_INFO_PLAN_H
#define KT_COMMAND_INFO_PLAN_H

#include "command.h"

void kt_info_print_plan(const kt_model *model, const kt_run *run);
/* Returns KT_EXIT_DONE or an exit code after saying why. */
int kt_info_write_plan(const kt_model *model, const kt_run *run);

#endif
