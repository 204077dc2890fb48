/* Kinds of columns, which share a panel, its title and its unit. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/kind.h"

#include <string.h>

const kt_column_kind kt_column_kinds[] = {
    {"position", NULL, "Positions", "rad or m", true, false, false},
    {"velocity", NULL, "Velocities", "rad/s or m/s", false, false, false},
    {"acceleration", NULL, "Accelerations", "rad/s\u00b2 or m/s\u00b2", false, false, false},
    {"gravity", NULL, "Gravity in joints", "N m or N", false, false, false},
    {"marker", ".x|.y|.z", "Markers", "m", false, false, false},
    {"marker", ".vx|.vy|.vz", "Velocities of markers", "m/s", false, false, false},
    {"marker", ".ax|.ay|.az", "Accelerations of markers", "m/s\u00b2", false, false, false},
    {"effect", " [N]", "Forces of effects", "N", true, false, false},
    {"effect", " [N m]", "Torques of effects", "N m", true, false, false},
    {"effect", " [m]| [rad]", "Lengths and angles of effects", "m or rad", false, false, false},
    {"effect", " [m/s]| [rad/s]", "Rates of effects", "m/s or rad/s", false, false, false},
    {"effect", " [W]", "Powers of effects", "W", false, false, false},
    {"momentum", ".px|.py|.pz", "Momentum", "kg m/s", false, false, false},
    {"momentum", ".lx|.ly|.lz", "Angular momentum", "kg m\u00b2/s", false, false, false},
    {"state", NULL, "Auxiliary states", NULL, true, false, false},
    {"energy", NULL, "Energies", "J", true, false, true},
    {"constraint", NULL, "Loops open by", "rad or m, and per second", true, true, true},
    {"bearing", ".fx|.fy|.fz", "Bearings: forces", "N", false, false, false},
    {"bearing", ".mx|.my|.mz", "Bearings: moments", "N m", false, false, false},
    {"reaction", ".fx|.fy|.fz", "Reactions: forces", "N", false, false, false},
    {"reaction", ".mx|.my|.mz", "Reactions: moments", "N m", false, false, false},
    {"reaction", NULL, "Multipliers", "N or N m", false, false, false},
    {NULL, NULL, "Values", NULL, false, false, true},
};

bool kt_column_begins(const char *name, const char *beginning) {
    const size_t length = strlen(beginning);
    return strncmp(name, beginning, length) == 0 &&
           (name[length] == '\0' || name[length] == '.' || name[length] == '[' || name[length] == ' ');
}

bool kt_column_ends(const char *name, const char *ends) {
    const size_t length = strlen(name);
    for (const char *end = ends; *end != '\0';) {
        const size_t size = strcspn(end, "|");
        if (length >= size && strncmp(name + length - size, end, size) == 0)
            return true;
        end += size + (end[size] == '|');
    }
    return false;
}

int kt_column_kind_of(const char *name) {
    for (int k = 0; k < KT_COLUMN_KINDS - 1; k++)
        if (kt_column_begins(name, kt_column_kinds[k].name) &&
            (kt_column_kinds[k].ends == NULL || kt_column_ends(name, kt_column_kinds[k].ends)))
            return k;
    return KT_COLUMN_KINDS - 1;
}

bool kt_column_is_own(const char *name) {
    return kt_column_kind_of(name) == KT_COLUMN_KINDS - 1 && strchr(name, '.') == NULL && strcmp(name, "time") != 0;
}

bool kt_column_has_own_unit(const char *name) {
    const size_t length = strlen(name);
    return kt_column_kind_of(name) == KT_COLUMN_KINDS - 1 && strstr(name, " [") != NULL && name[length - 1] == ']';
}
