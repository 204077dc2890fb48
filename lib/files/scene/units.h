/* Units of physical quantities by their names. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_UNITS_H
#define KT_SCENE_UNITS_H

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

typedef struct kt_unit {
    const char *name, *si; /* the SI unit of what it measures; "1": of any quantity */
    double divided, times; /* a number of it is number * times / divided in SI units */
} kt_unit;

#define KT_UNIT_PI 3.14159265358979323846

/* Returns NULL if the unit is not known. Exact factors stay exact: `20 ms` are `20/1000 s`. */
static inline const kt_unit *kt_unit_find(const char *name, size_t length) {
    static const kt_unit units[] = {{"1", "1", 1, 1},
                                    {"s", "s", 1, 1},
                                    {"ms", "s", 1e3, 1},
                                    {"us", "s", 1e6, 1},
                                    {"min", "s", 1, 60},
                                    {"h", "s", 1, 3600},
                                    {"m", "m", 1, 1},
                                    {"mm", "m", 1e3, 1},
                                    {"cm", "m", 1e2, 1},
                                    {"um", "m", 1e6, 1},
                                    {"km", "m", 1, 1e3},
                                    {"m/s", "m/s", 1, 1},
                                    {"mm/s", "m/s", 1e3, 1},
                                    {"km/h", "m/s", 3.6, 1},
                                    {"m/s^2", "m/s^2", 1, 1},
                                    {"mm/s^2", "m/s^2", 1e3, 1},
                                    {"N", "N", 1, 1},
                                    {"mN", "N", 1e3, 1},
                                    {"kN", "N", 1, 1e3},
                                    {"N m", "N m", 1, 1},
                                    {"Nm", "N m", 1, 1},
                                    {"mN m", "N m", 1e3, 1},
                                    {"N mm", "N m", 1e3, 1},
                                    {"N cm", "N m", 1e2, 1},
                                    {"kN m", "N m", 1, 1e3},
                                    {"kg", "kg", 1, 1},
                                    {"g", "kg", 1e3, 1},
                                    {"W", "W", 1, 1},
                                    {"kW", "W", 1, 1e3},
                                    {"V", "V", 1, 1},
                                    {"A", "A", 1, 1},
                                    {"Pa", "Pa", 1, 1},
                                    {"bar", "Pa", 1, 1e5},
                                    {"rad", "rad", 1, 1},
                                    {"deg", "rad", 180, KT_UNIT_PI},
                                    {"rad/s", "rad/s", 1, 1},
                                    {"deg/s", "rad/s", 180, KT_UNIT_PI},
                                    {"rpm", "rad/s", 30, KT_UNIT_PI},
                                    {"\u00b0", "rad", 180, KT_UNIT_PI},
                                    {"\u00b0/s", "rad/s", 180, KT_UNIT_PI},
                                    {"J", "J", 1, 1},
                                    {"mJ", "J", 1e3, 1},
                                    {"kJ", "J", 1, 1e3},
                                    {"mW", "W", 1e3, 1}};
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++)
        if (strlen(units[i].name) == length && strncmp(units[i].name, name, length) == 0)
            return &units[i];
    return NULL;
}

/* Whether a number in this unit equals the number in SI units. */
static inline bool kt_unit_is_si(const kt_unit *unit) { return unit->divided == 1 && unit->times == 1; }

#endif
