/* Muscles of MJCF from the formulas that an import makes of them (mjcf_muscle.c).
 *
 * The numbers of a muscle are read from the texts of its force and of the rate of its activation. The caller compares
 * the functions below with the formulas, so that a text that only looks like a muscle is none. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/write.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- texts ------------------------------------------------------------------------------------------------------- */

/* Reads a number behind a word, and moves behind it. */
static bool read_behind(const char **at, const char *word, double *value) {
    const char *found = *at != NULL ? strstr(*at, word) : NULL;
    char *end = NULL;
    if (found == NULL)
        return false;
    found += strlen(word);
    *value = strtod(found, &end);
    *at = end;
    return end != found;
}

/* Reads "offset + slope*NAME", where the offset 0 and the slope 1 are left out, up to `stop`. */
static bool read_scaled(const char *at, const char *stop, double line[2]) {
    char *end = NULL;
    const char *last = strstr(at, stop);
    if (last == NULL)
        return false;
    line[0] = 0.0;
    line[1] = 1.0;
    double number = strtod(at, &end);
    if (end == at)
        return true;
    if (strncmp(end, " + ", 3) == 0 && end < last) {
        line[0] = number;
        at = end + 3;
        number = strtod(at, &end);
    }
    if (end != at)
        line[1] = number;
    return end < last;
}

/* Moves behind "clamp((", the scaled length and " + ", to the limit that follows. */
static bool read_limit_of_muscle(const char **at, const char *scaled, size_t length, double *limit) {
    const char *found = strstr(*at, "*(clamp((");
    if (found == NULL || strncmp(found + 9, scaled, length) != 0 || strncmp(found + 9 + length, " + ", 3) != 0)
        return false;
    char *end = NULL;
    *limit = -strtod(found + 12 + length, &end);
    *at = end;
    return true;
}

static bool read_muscle_force(const char *text, kt_export_muscle *m) {
    const char *at = text + strspn(text, "(");
    double passive, scaled[2], rate[2];
    char *end = NULL;
    m->gear = strtod(at, &end);
    at = end;
    if (!read_behind(&at, "*(", &passive) || at == NULL || strstr(at, "max((") == NULL)
        return false;
    const char *name = strstr(at, "max((") + 5, *stop = strstr(name, " + -1)*");
    if (stop == NULL || !read_scaled(name, " + -1)*", scaled) || !read_behind(&at, ")*(", &m->force) ||
        !read_limit_of_muscle(&at, name, (size_t)(stop - name), &m->shortest) ||
        !read_limit_of_muscle(&at, name, (size_t)(stop - name), &m->longest) || strstr(at, "*(clamp(") == NULL ||
        !read_scaled(strstr(at, "*(clamp(") + 8, " + 1, 0, 1)", rate))
        return false;
    m->force = -m->force;
    m->passive = -passive / m->force;
    m->offset = scaled[0];
    m->slope = scaled[1];
    m->rate = rate[1];
    m->stretched = read_behind(&at, " + 0)*1, 0, ", &m->stretched) ? 1.0 + m->stretched : 1.0;
    return m->force > 0.0 && m->gear != 0.0 && m->slope / m->gear > 0.0 && m->rate / m->gear > 0.0;
}

bool kt_export_read_muscle(const char *force, const char *rate, kt_export_muscle *m) {
    const char *at = rate;
    if (rate == NULL || !read_behind(&at, "(", &m->control) || !read_behind(&at, ")/(", &m->times[1]) ||
        !read_behind(&at, " + (", &m->times[0]))
        return false;
    const char *share = strstr(at, "clamp((");
    m->times[2] = share != NULL && read_behind(&share, " + ", &m->times[2]) ? 2.0 * m->times[2] : 0.0;
    return read_muscle_force(force, m);
}

/* ---- functions --------------------------------------------------------------------------------------------------- */

static double bounded(double x, double lower, double upper) { return fmin(fmax(x, lower), upper); }

/* From 0 at s = 0 to 1 at s = 2. */
static double bump(double s) {
    const double x = bounded(s, 0.0, 2.0), over = fmax(x - 1.0, 0.0);
    return 0.5 * x * x - over * over;
}

double kt_export_muscle_force(const kt_export_muscle *m, double length, double speed, double w) {
    const double l = m->offset + m->slope * length, v = m->rate * speed, c = m->stretched - 1.0;
    const double active =
        bump(2.0 * (l - m->shortest) / (1.0 - m->shortest)) * bump(2.0 * (m->longest - l) / (m->longest - 1.0));
    const double slow = bounded(v + 1.0, 0.0, 1.0), fast = bounded(v, 0.0, fmax(c, 0.0));
    const double s = fmax(2.0 * (l - 1.0) / (m->longest - 1.0), 0.0), over = fmax(s - 1.0, 0.0);
    const double speeds = slow * slow + (c > 0.0 ? fast * (2.0 - fast / c) : 0.0);
    return -m->gear * m->force * (w * active * speeds + 0.5 * m->passive * (s * s - over * over));
}

double kt_export_muscle_rate(const kt_export_muscle *m, double w) {
    const double e = 0.5 + 1.5 * bounded(w, 0.0, 1.0), up = m->times[0] * e, down = m->times[1] / e;
    const double more = m->control - w,
                 x = m->times[2] > 0.0 ? bounded(more / m->times[2] + 0.5, 0.0, 1.0) : more > 0.0;
    return more / (down + (up - down) * x * x * x * (10.0 + x * (6.0 * x - 15.0)));
}

/* ---- the element ------------------------------------------------------------------------------------------------- */

/* The range of the length is that of MuJoCo's usual range of the scaled length. Negative limits would mean defaults. */
void kt_export_write_muscle(kt_export *x, const kt_export_muscle *m) {
    static const double range[2] = {0.75, 1.05};
    const double unit = m->gear / m->slope, vmax = m->slope / m->rate;
    kt_export_print(x, " gear=\"%g\" timeconst=\"%g %g\"", m->gear, m->times[0], m->times[1]);
    if (m->times[2] > 0.0)
        kt_export_print(x, " tausmooth=\"%g\"", m->times[2]);
    kt_export_print(x, " lengthrange=\"%g %g\" range=\"%g %g\"", (range[0] - m->offset) * unit,
                    (range[1] - m->offset) * unit, range[0], range[1]);
    kt_export_print(x, " force=\"%g\" lmin=\"%g\" lmax=\"%g\" vmax=\"%g\" fpmax=\"%g\" fvmax=\"%g\"/>\n", m->force,
                    m->shortest, m->longest, vmax, m->passive, m->stretched);
}
