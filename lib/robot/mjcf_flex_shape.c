/* Points and elements of a <flexcomp> by a formula: grids, circles, squares and discs; surfaces or volumes of boxes,
 * cylinders and ellipsoids.
 *
 * Points have the order of MuJoCo, whose numbers name the bodies. There are n_k points along axis k, with the spacing
 * s_k and the half side h_k = s_k (n_k - 1)/2. A grid has the coordinates s_k i_k - h_k. The others have points on a
 * surface alone. With coordinates u_k from -1 to 1 on the surface of a cube, these are at
 *     box:                h_k u_k
 *     cylinder and disc:  max(|u_x|, |u_y|) h_k u_k / |(u_x, u_y)|  along x and y
 *     ellipsoid:          h_k u_k / |u|
 * A volume also has the centre, and each of its tetrahedra has a triangle of the surface and the centre. A surface is
 * open where z is largest. Source: user_flexcomp.cc. */
#include "robot/mjcf_flex.h"

#include <math.h>

static int numbers_of_dim(const kt_flex *f) { return f->dim + 1; }

/* ---- room -------------------------------------------------------------------------------------------------------- */

static bool fault_of_many_points(kt_mjcf *m, const kt_flex *f) {
    return kt_mjcf_fault(m, f->element, "expected 1 to %d points and elements", (int)KT_FLEX_NUMBERS_MOST);
}

bool kt_flex_take(kt_mjcf *m, kt_flex *f, double points, double elements) {
    if (!(points >= 1.0 && points <= KT_FLEX_NUMBERS_MOST && elements <= KT_FLEX_NUMBERS_MOST))
        return fault_of_many_points(m, f);
    f->room = (int)points;
    f->element_room = (int)elements;
    f->points = kt_reader_take(m->r, &m->r->scratch, (size_t)f->room + 1, sizeof *f->points);
    f->elements = kt_reader_take(m->r, &m->r->scratch, 4 * (size_t)f->element_room + 1, sizeof *f->elements);
    return (f->points != NULL && f->elements != NULL);
}

void kt_flex_add_point(kt_flex *f, double x, double y, double z) {
    if (f->count < f->room)
        f->points[f->count++] = (kt_flex_point){.at = {x, y, z}};
}

void kt_flex_add_element(kt_flex *f, const int *points) {
    const int size = numbers_of_dim(f);
    if (f->element_count == f->element_room)
        return;
    for (int k = 0; k < size; k++)
        f->elements[f->element_count * size + k] = points[k];
    f->element_count++;
}

/* ---- grids ------------------------------------------------------------------------------------------------------- */

typedef struct flex_layout {
    int n[3];
    double spacing[3], half[3];
} flex_layout;

/* The counts and spacings; `least`: of points along each axis that the shape has. */
static bool read_flex_layout(kt_mjcf *m, kt_flex *f, int axes, int least, flex_layout *l) {
    double count[3] = {10.0, 10.0, 10.0};
    *l = (flex_layout){.spacing = {0.02, 0.02, 0.02}};
    (void)kt_mjcf_numbers(m, f->element, NULL, "count", 3, 3, count);
    (void)kt_mjcf_numbers(m, f->element, NULL, "spacing", 3, 3, l->spacing);
    for (int k = 0; k < 3; k++) {
        const int fewest = k < axes ? least : 1;
        if (!(count[k] >= fewest))
            return kt_mjcf_fault(m, f->element, "count: expected %d or more points along axis %d", fewest, k + 1);
        if (count[k] > KT_FLEX_NUMBERS_MOST)
            return fault_of_many_points(m, f);
        l->n[k] = f->counts[k] = (int)count[k];
        l->half[k] = 0.5 * l->spacing[k] * (l->n[k] - 1);
    }
    return true;
}

static bool make_flex_circle(kt_mjcf *m, kt_flex *f) {
    flex_layout l;
    if (!read_flex_layout(m, f, 1, 3, &l) || !kt_flex_take(m, f, l.n[0] - 1.0, l.n[0] - 1.0))
        return false;
    const int count = l.n[0] - 1;
    const double angle = 2.0 * 3.14159265358979323846 / count, r = 0.5 * l.spacing[0] / sin(0.5 * angle);
    for (int i = 0; i < count; i++) {
        kt_flex_add_point(f, r * cos(angle * i), r * sin(angle * i), 0.0);
        kt_flex_add_element(f, (const int[]){i, i + 1 < count ? i + 1 : 0});
    }
    return true;
}

static double along_grid(const flex_layout *l, int axis, int i) {
    return l->spacing[axis] * (i - 0.5 * (l->n[axis] - 1));
}

static void add_flex_lines(kt_flex *f, const flex_layout *l) {
    for (int i = 0; i < l->n[0]; i++) {
        kt_flex_add_point(f, along_grid(l, 0, i), 0.0, 0.0);
        if (i > 0)
            kt_flex_add_element(f, (const int[]){i - 1, i});
    }
}

/* The triangles of the square whose first corner is a point. Those of a disc are symmetric to its centre. */
static void add_flex_square(kt_flex *f, const flex_layout *l, int ix, int iy, bool is_crossed) {
    const int n = l->n[1], step = l->n[2];
    const int v[4] = {step * (n * ix + iy), step * (n * (ix + 1) + iy), step * (n * (ix + 1) + iy + 1),
                      step * (n * ix + iy + 1)};
    kt_flex_add_element(f, (const int[]){v[0], v[1], v[is_crossed ? 3 : 2]});
    kt_flex_add_element(f, (const int[]){v[is_crossed ? 1 : 0], v[2], v[3]});
}

static void add_flex_squares(kt_flex *f, const flex_layout *l, bool is_disc) {
    static const double small = 1e-14;
    for (int ix = 0; ix < l->n[0]; ix++)
        for (int iy = 0; iy < l->n[1]; iy++) {
            const double x = along_grid(l, 0, ix), y = along_grid(l, 1, iy);
            const bool is_crossed = is_disc && ((x < -small && y > -small) || (x > -small && y < -small));
            kt_flex_add_point(f, x, y, 0.0);
            if (ix + 1 < l->n[0] && iy + 1 < l->n[1])
                add_flex_square(f, l, ix, iy, is_crossed);
        }
}

/* Six tetrahedra for each cube. */
static void add_flex_cubes(kt_flex *f, const flex_layout *l) {
    static const int tetrahedra[6][4] = {{0, 3, 1, 7}, {0, 1, 4, 7}, {1, 3, 2, 7},
                                         {1, 2, 6, 7}, {1, 5, 4, 7}, {1, 6, 5, 7}};
    static const int corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    const int *n = l->n;
    for (int ix = 0; ix < n[0]; ix++)
        for (int iy = 0; iy < n[1]; iy++)
            for (int iz = 0; iz < n[2]; iz++) {
                kt_flex_add_point(f, along_grid(l, 0, ix), along_grid(l, 1, iy), along_grid(l, 2, iz));
                for (int t = 0; t < 6 && ix + 1 < n[0] && iy + 1 < n[1] && iz + 1 < n[2]; t++) {
                    int at[4];
                    for (int k = 0; k < 4; k++) {
                        const int *c = corners[tetrahedra[t][k]];
                        at[k] = ((ix + c[0]) * n[1] + iy + c[1]) * n[2] + iz + c[2];
                    }
                    kt_flex_add_element(f, at);
                }
            }
}

/* Moves the points of a square to a disc. */
static void round_flex_square(kt_flex *f, const flex_layout *l) {
    for (int i = 0; i < f->count; i++) {
        double *p = f->points[i].at;
        const double most = fmax(fabs(p[0]), fabs(p[1])), norm = hypot(p[0], p[1]);
        for (int k = 0; k < 2 && norm > 0.0; k++)
            p[k] *= l->half[k] * most / norm;
        if (!(norm > 0.0))
            p[0] = l->half[0] * most;
    }
}

bool kt_flex_grid(kt_mjcf *m, kt_flex *f) {
    const bool is_disc = kt_text_is(f->type, "disc");
    flex_layout l;
    if (is_disc || kt_text_is(f->type, "square"))
        f->dim = 2;
    if (f->dim == 1 && kt_text_is(f->type, "circle"))
        return make_flex_circle(m, f);
    if (!read_flex_layout(m, f, f->dim, 2, &l))
        return false;
    const double points = (double)l.n[0] * (f->dim > 1 ? l.n[1] : 1.0) * (f->dim > 2 ? l.n[2] : 1.0);
    if (!kt_flex_take(m, f, points, (f->dim == 3 ? 6.0 : f->dim) * points))
        return false;
    if (f->dim == 2 && l.n[2] != 1)
        return kt_mjcf_fault(m, f->element, "count: a surface has 1 point along axis 3");
    if (f->dim == 1)
        add_flex_lines(f, &l);
    else if (f->dim == 2)
        add_flex_squares(f, &l, is_disc);
    else
        add_flex_cubes(f, &l);
    if (is_disc)
        round_flex_square(f, &l);
    return true;
}

/* ---- boxes ------------------------------------------------------------------------------------------------------- */

/* The number of a point of the surface: both ends of z come first, then both of y, then both of x. */
static int number_in_box(const kt_flex *f, const flex_layout *l, int ix, int iy, int iz) {
    const int *n = l->n, is_open = f->dim == 2, first = !is_open, inner = n[2] - 2 + is_open;
    const int sides = (2 - is_open) * n[0] * n[1];
    if (iz == 0 || (iz == n[2] - 1 && !is_open))
        return first + (iz > 0 ? n[0] * n[1] : 0) + ix * n[1] + iy;
    if (iy == 0 || iy == n[1] - 1)
        return first + sides + (iy > 0 ? n[0] * inner : 0) + ix * inner + iz - 1;
    return first + sides + 2 * n[0] * inner + (ix > 0 ? (n[1] - 2) * inner : 0) + (iy - 1) * inner + iz - 1;
}

static void add_point_of_box(kt_flex *f, const flex_layout *l, const int i[3]) {
    double u[3], factor = 1.0;
    for (int k = 0; k < 3; k++)
        u[k] = 2.0 * i[k] / (l->n[k] - 1) - 1.0;
    const double flat = hypot(u[0], u[1]), norm = hypot(flat, u[2]);
    if (kt_text_is(f->type, "cylinder"))
        factor = flat > 0.0 ? fmax(fabs(u[0]), fabs(u[1])) / flat : 0.0;
    else if (kt_text_is(f->type, "ellipsoid"))
        factor = norm > 0.0 ? 1.0 / norm : 0.0;
    const bool is_flat = kt_text_is(f->type, "cylinder");
    kt_flex_add_point(f, factor * l->half[0] * u[0], factor * l->half[1] * u[1],
                      (is_flat ? 1.0 : factor) * l->half[2] * u[2]);
}

/* A triangle of the surface; in a volume, the tetrahedron of it and the centre. */
static void add_flex_facet(kt_flex *f, const int corners[3]) {
    const int *c = corners;
    kt_flex_add_element(f, f->dim == 3 ? (const int[]){0, c[0], c[1], c[2]} : c);
}

/* Both triangles of a square on the side at an end (0 or 1) of the axis `across`. Without their orientation. */
static void add_facets(kt_flex *f, const flex_layout *l, int across, int end, const int at[2]) {
    const int a = across == 0 ? 1 : 0, b = across == 2 ? 1 : 2;
    int v[2][2];
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) {
            int p[3];
            p[across] = end * (l->n[across] - 1);
            p[a] = at[0] + i;
            p[b] = at[1] + k;
            v[i][k] = number_in_box(f, l, p[0], p[1], p[2]);
        }
    const bool is_other = f->dim == 2 && across < 2 && (across == 0) != (end == 1); /* its diagonal */
    add_flex_facet(f, (const int[]){v[is_other][0], v[!is_other][0], v[!is_other][1]});
    add_flex_facet(f, (const int[]){v[is_other][0], v[!is_other][1], v[is_other][1]});
}

bool kt_flex_box(kt_mjcf *m, kt_flex *f) {
    flex_layout l;
    int i[3];
    if (f->dim == 1)
        return kt_mjcf_fault(m, f->element, "dim: a %.20s is a surface (2) or a volume (3)", f->type);
    if (!read_flex_layout(m, f, 3, 2, &l))
        return false;
    const double sides[3] = {(double)l.n[1] * l.n[2], (double)l.n[0] * l.n[2], (double)l.n[0] * l.n[1]};
    const double surface = 2.0 * (sides[0] + sides[1] + sides[2]);
    if (!kt_flex_take(m, f, surface + 1.0, 2.0 * surface))
        return false;
    if (f->dim == 3)
        kt_flex_add_point(f, 0.0, 0.0, 0.0);
    for (int across = 2; across >= 0; across--)
        for (int end = 0; end < (across == 2 ? f->dim - 1 : 2); end++) {
            const int a = across == 0 ? 1 : 0, b = across == 2 ? 1 : 2;
            const int skip_a = across == 0, skip_b = across < 2; /* what the sides before have */
            i[across] = end * (l.n[across] - 1);
            for (i[a] = skip_a; i[a] < l.n[a] - skip_a; i[a]++)
                for (i[b] = skip_b; i[b] < l.n[b] - (skip_b && f->dim == 3); i[b]++)
                    add_point_of_box(f, &l, i);
        }
    for (int across = 2; across >= 0; across--)
        for (int end = 0; end < (across == 2 ? f->dim - 1 : 2); end++) {
            const int a = across == 0 ? 1 : 0, b = across == 2 ? 1 : 2;
            for (int x = 0; x + 1 < l.n[a]; x++)
                for (int y = 0; y + 1 < l.n[b]; y++)
                    add_facets(f, &l, across, end, (const int[]){x, y});
        }
    return true;
}
