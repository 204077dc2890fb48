/* Own columns that copy another column, and state another unit. */
#ifndef KT_COMMAND_ADVICE_COLUMN_UNIT_H
#define KT_COMMAND_ADVICE_COLUMN_UNIT_H

#include "advice/warnings.h"

/* Warns of own columns (`output.columns`) whose formula is the name of a column alone, and whose unit measures the same
 * quantity with another factor: `{value: position.arm, unit: deg}`. The unit is a label, and numbers are not converted.
 * Other formulas may convert. Returns the number of warnings. */
int kt_column_units_warn(kt_warnings *warnings, const kt_scene *scene, const kt_model *model);

#endif
