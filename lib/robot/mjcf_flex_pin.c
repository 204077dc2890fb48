/* Points of a <flexcomp> that do not move, and points that belong to no element.
 *
 * Numbers of pins are those of all points. After that, points of files without an element vanish, and the others are
 * numbered anew. A grid has the number i_x n_y + i_y, or (i_x n_y + i_y) n_z + i_z. Source: user_flexcomp.cc. */
#include "robot/mjcf_flex.h"

#include <string.h>

/* Marks points of a grid, from the first three numbers to the last three. */
static void pin_flex_grid(const kt_flex *f, const double *low, const double *high, bool *pinned, int room) {
    for (int ix = (int)low[0]; ix <= (int)high[0]; ix++)
        for (int iy = (int)low[1]; iy <= (int)high[1]; iy++)
            for (int iz = (int)low[2]; iz <= (int)high[2]; iz++) {
                const int row = ix * f->counts[1] + iy, at = f->dim == 2 ? row : row * f->counts[2] + iz;
                if (at < room)
                    pinned[at] = true;
            }
}

/* Marks the points of one attribute: numbers of points, or of places in a grid; in pairs for a range. */
static bool read_flex_pins(kt_mjcf *m, const kt_flex *f, const kt_element *pin, bool is_grid, bool is_range,
                           bool *pinned, int room) {
    const char *name = is_grid ? (is_range ? "gridrange" : "grid") : is_range ? "range" : "id";
    const int axes = is_grid ? f->dim : 1, size = axes * (1 + is_range), points = f->count;
    double *numbers;
    const int count = kt_flex_numbers(m, pin, name, &numbers);
    if (count > 0 && is_grid && f->dim == 1)
        return kt_mjcf_fault(m, pin, "%s: a line has no grid; give `id` or `range`", name);
    if (count > 0 && is_grid && f->is_given)
        return kt_mjcf_fault(m, pin, "%s: points of a file or of the text have no grid; give `id` or `range`", name);
    if (count < 0 || count % size != 0)
        return count >= 0 && kt_mjcf_fault(m, pin, "%s: expected a multiple of %d numbers", name, size);
    for (int i = 0; i < count; i += size) {
        double ends[2][3] = {{0.0}, {0.0}};
        for (int k = 0; k < axes; k++) {
            const double most = is_grid && f->counts[k] > 0 ? f->counts[k] : points;
            ends[0][k] = numbers[i + k];
            ends[1][k] = numbers[i + k + (is_range ? axes : 0)];
            for (int n = 0; n < 2; n++)
                if (!(ends[n][k] >= 0.0 && ends[n][k] < most))
                    return kt_mjcf_fault(m, pin, "%s: there is no such point", name);
        }
        if (is_grid)
            pin_flex_grid(f, ends[0], ends[1], pinned, room);
        for (int k = (int)ends[0][0]; k <= (int)ends[1][0] && !is_grid; k++)
            pinned[k] = true;
    }
    return true;
}

/* Removes points without an element. */
static bool remove_unused(kt_mjcf *m, kt_flex *f, bool *pinned) {
    const int numbers = f->element_count * (f->dim + 1);
    int *after = kt_reader_take(m->r, &m->r->scratch, (size_t)f->count + 1, sizeof *after), kept = 0;
    if (after == NULL)
        return false;
    for (int i = 0; i < numbers; i++)
        after[f->elements[i]] = 1;
    for (int i = 0; i < f->count; i++) {
        if (after[i] == 0)
            continue;
        f->points[kept] = f->points[i];
        pinned[kept] = pinned[i];
        after[i] = kept++;
    }
    for (int i = 0; i < numbers; i++)
        f->elements[i] = after[f->elements[i]];
    f->count = kept;
    return true;
}

bool kt_flex_pin(kt_mjcf *m, kt_flex *f, bool *pinned, int room) {
    bool all = true;
    memset(pinned, kt_mjcf_flag(m, f->element, NULL, "rigid", false), (size_t)room);
    for (const kt_element *pin = kt_xml_child(f->element, "pin"); pin != NULL; pin = kt_xml_next(pin, "pin"))
        for (int kind = 0; kind < 4; kind++)
            if (!read_flex_pins(m, f, pin, kind > 1, kind % 2 == 1, pinned, room))
                return false;
    pinned[0] = pinned[0] || f->motion == KT_FLEX_RADIAL;
    for (int i = 0; i < f->count; i++)
        all = all && pinned[i];
    if (all)
        memset(pinned, true, (size_t)room);
    return !f->is_given || remove_unused(m, f, pinned);
}

/* MuJoCo 3.14 does not find the body `world` of pins under the prefix of an <attach>, and drops the flex. */
void kt_flex_note_attached_pins(kt_mjcf *m, const kt_flex *f) {
    bool has_pins = false;
    for (int i = 0; i < f->count && f->motion < KT_FLEX_TRILINEAR; i++)
        has_pins = has_pins || f->points[i].is_pinned;
    if (has_pins && f->element->document > 0 && kt_mjcf_body_around(f->element) == NULL)
        kt_unknown_count(&m->changes,
                         "a flexcomp with pins in the world of an attached model: MuJoCo loses its edges and "
                         "elasticity, and here they act",
                         f->element);
}
