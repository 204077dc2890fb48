/* Own columns that copy another column, and state another unit. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/angles.h"

#include "records/columns.h"
#include "scene/units.h"

#include <math.h>
#include <string.h>

/* Returns the SI unit that a unit is converted to. NULL: it is an SI unit, or not known. */
static const char *si_unit_behind(const char *name) {
    const kt_unit *unit = kt_unit_find(name, strlen(name));
    return unit != NULL && !kt_unit_is_si(unit) ? unit->si : NULL;
}

/* Returns the unit of the column with this name; NULL: there is none. */
static const char *unit_of_column(const kt_columns *all, const char *name) {
    const size_t column = strcmp(name, "t") == 0 ? 0 : kt_columns_find(all, name, 0);
    return column < all->count ? kt_column_quantity(all, column).unit : NULL;
}

int kt_column_units_warn(kt_warnings *warnings, const kt_scene *scene, const kt_model *model) {
    const kt_warning warning = kt_warning_of(
        "column_unit", (double)NAN, NULL, "Convert in the formula, as in 'position.arm*180/pi', or correct the unit");
    kt_columns all = {0};
    int count = 0;
    const bool fine = scene->column_count > 0 && kt_columns_list_all(&all, scene, model);
    for (int k = 0; k < scene->column_count && fine; k++) {
        const kt_scene_column *column = &scene->columns[k];
        const char *si = column->unit != NULL ? si_unit_behind(column->unit) : NULL;
        const char *own = si != NULL ? unit_of_column(&all, column->formula) : NULL;
        if (own == NULL || strcmp(own, si) != 0)
            continue;
        kt_warn(warnings, &warning, "column '%s' has the numbers of '%s', in %s, and its unit is %s", column->name,
                column->formula, own, column->unit);
        count++;
    }
    kt_columns_free(&all);
    return count;
}
