/* Solids as pixels, for pictures with meshes, which are not convex. The depth of each pixel decides which solid is
 * visible there. The pixels become one image of the page; symbols and lines stay lines. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"

#include "picture/picture_mesh.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    FINE = 4,   /* samples a unit of the page, along each axis */
    COARSE = 2, /* pixels of the image, likewise: each is the mean of some samples */
    SIDES = 32,
    MOST = 1 << 26, /* samples */
};

typedef struct sample {
    float depth; /* towards the viewer */
    int thing;   /* -1: none */
    unsigned char red, green, blue;
} sample;

struct kt_raster {
    const kt_sheet *sheet;
    double left, top;  /* of the image on the page */
    int width, height; /* of samples, multiples of FINE */
    sample *samples;
    kt_mesh mesh; /* of the solid that is painted */
};

/* ---- memory ------------------------------------------------------------------------------------------------------ */

kt_raster *kt_raster_create(const kt_sheet *sheet, kt_spot low, kt_spot high) {
    const double margin = 2.0, width = ceil(high.x - low.x + 2.0 * margin),
                 height = ceil(high.y - low.y + 2.0 * margin);
    kt_raster *raster =
        width > 0.0 && height > 0.0 && width * height * FINE * FINE < MOST ? calloc(1, sizeof *raster) : NULL;
    if (raster == NULL)
        return NULL;
    *raster = (kt_raster){.sheet = sheet,
                          .left = floor(low.x - margin),
                          .top = floor(low.y - margin),
                          .width = FINE * (int)(width + 1.0),
                          .height = FINE * (int)(height + 1.0)};
    const size_t count = (size_t)raster->width * (size_t)raster->height;
    raster->samples = malloc(count * sizeof *raster->samples);
    for (size_t i = 0; i < count && raster->samples != NULL; i++)
        raster->samples[i] = (sample){.depth = -FLT_MAX, .thing = -1};
    if (raster->samples != NULL)
        return raster;
    free(raster);
    return NULL;
}

void kt_raster_free(kt_raster *raster) {
    if (raster == NULL)
        return;
    kt_mesh_free(&raster->mesh);
    free(raster->samples);
    free(raster);
}

/* ---- triangles --------------------------------------------------------------------------------------------------- */

typedef struct corner {
    double x, y, z; /* samples, from the left and from the top; depth */
    kt_vec3 normal;
} corner;

static corner raster_corner_of(const kt_raster *r, int point) {
    const kt_spot at = kt_sheet_spot(r->sheet, r->mesh.points[point]);
    return (corner){FINE * (at.x - r->left), FINE * (at.y - r->top), r->mesh.points[point].z, r->mesh.normals[point]};
}

static unsigned char byte_of(double x) { return (unsigned char)lround(255.0 * fmin(fmax(x, 0.0), 1.0)); }

/* Writes a sample, unless a nearer one is there. Both sides of a surface are shaded, because files disagree about which
 * one is outside. */
static void put_sample(kt_raster *r, int thing, kt_colour colour, size_t at, double depth, kt_vec3 normal) {
    sample *s = &r->samples[at];
    if (!((float)depth > s->depth))
        return;
    const double length = kt_vec3_norm(normal), side = normal.z < 0.0 ? -1.0 : 1.0;
    const kt_colour tone = kt_paint_shade(colour, kt_vec3_scale(length > 0.0 ? side / length : 0.0, normal));
    *s = (sample){(float)depth, thing, byte_of(tone.red), byte_of(tone.green), byte_of(tone.blue)};
}

/* Paints the samples with their centres within a triangle, by barycentric coordinates. */
static void paint_triangle(kt_raster *r, int thing, kt_colour colour, const int *points) {
    const corner a = raster_corner_of(r, points[0]), b = raster_corner_of(r, points[1]),
                 c = raster_corner_of(r, points[2]);
    const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    const int x0 = (int)fmax(floor(fmin(a.x, fmin(b.x, c.x))), 0.0),
              y0 = (int)fmax(floor(fmin(a.y, fmin(b.y, c.y))), 0.0);
    const int x1 = (int)fmin(ceil(fmax(a.x, fmax(b.x, c.x))), r->width),
              y1 = (int)fmin(ceil(fmax(a.y, fmax(b.y, c.y))), r->height);
    if (!(fabs(area) > 0.0))
        return;
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            const double u = x + 0.5, v = y + 0.5;
            const double wb = ((u - a.x) * (c.y - a.y) - (c.x - a.x) * (v - a.y)) / area;
            const double wc = ((b.x - a.x) * (v - a.y) - (u - a.x) * (b.y - a.y)) / area, wa = 1.0 - wb - wc;
            if (wa < 0.0 || wb < 0.0 || wc < 0.0)
                continue;
            const kt_vec3 normal = kt_vec3_add(kt_vec3_scale(wa, a.normal),
                                               kt_vec3_add(kt_vec3_scale(wb, b.normal), kt_vec3_scale(wc, c.normal)));
            put_sample(r, thing, colour, (size_t)y * (size_t)r->width + (size_t)x, wa * a.z + wb * b.z + wc * c.z,
                       normal);
        }
}

bool kt_raster_paint(kt_raster *r, const kt_solid *solid, int thing, kt_colour colour) {
    r->mesh.point_count = r->mesh.triangle_count = 0;
    if (!kt_mesh_add_solid(&r->mesh, solid, SIDES))
        return false;
    for (int i = 0; i < r->mesh.triangle_count; i++)
        paint_triangle(r, thing, colour, r->mesh.corners + 3 * i);
    return true;
}

/* ---- the image --------------------------------------------------------------------------------------------------- */

/* Whether something else begins next to or below a sample: there is a line around each thing. */
static bool is_edge(const kt_raster *r, int x, int y) {
    const sample *s = &r->samples[(size_t)y * (size_t)r->width + (size_t)x];
    const int right = x + 2 < r->width ? s[2].thing : -1,
              below = y + 2 < r->height ? s[2 * (ptrdiff_t)r->width].thing : -1;
    return s->thing != right || s->thing != below;
}

/* The mean of the samples in a pixel, premultiplied. */
static uint32_t pixel_at(const kt_raster *r, int column, int row) {
    enum { SPAN = FINE / COARSE };
    double red = 0.0, green = 0.0, blue = 0.0, opacity = 0.0;
    for (int k = 0; k < SPAN * SPAN; k++) {
        const int x = SPAN * column + k % SPAN, y = SPAN * row + k / SPAN;
        const sample *s = &r->samples[(size_t)y * (size_t)r->width + (size_t)x];
        const bool edge = is_edge(r, x, y);
        const double bright = edge ? 0.45 : 1.0;
        if (s->thing < 0 && !edge)
            continue;
        opacity += 1.0;
        if (s->thing < 0)
            continue;
        red += bright * s->red;
        green += bright * s->green;
        blue += bright * s->blue;
    }
    const double share = 1.0 / (SPAN * SPAN);
    return (uint32_t)lround(255.0 * share * opacity) << 24 | (uint32_t)lround(share * red) << 16 |
           (uint32_t)lround(share * green) << 8 | (uint32_t)lround(share * blue);
}

void kt_raster_keep(kt_raster *r, int first) {
    for (size_t i = 0; i < (size_t)r->width * (size_t)r->height; i++)
        if (r->samples[i].thing < first)
            r->samples[i] = (sample){.depth = -FLT_MAX, .thing = -1};
}

bool kt_raster_depth(const kt_raster *r, kt_spot at, double *depth) {
    const double x = FINE * (at.x - r->left), y = FINE * (at.y - r->top);
    if (!(x >= 0.0 && x < r->width && y >= 0.0 && y < r->height))
        return false;
    const sample *s = &r->samples[(size_t)y * (size_t)r->width + (size_t)x];
    *depth = (double)s->depth;
    return s->thing >= 0;
}

bool kt_raster_show(const kt_raster *r) {
    const int width = r->width / FINE * COARSE, height = r->height / FINE * COARSE;
    cairo_surface_t *image = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height);
    cairo_t *c = r->sheet->c;
    if (cairo_surface_status(image) != CAIRO_STATUS_SUCCESS) {
        cairo_surface_destroy(image);
        return false;
    }
    cairo_surface_flush(image);
    unsigned char *bytes = cairo_image_surface_get_data(image);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const uint32_t pixel = pixel_at(r, x, y);
            memcpy(bytes + (ptrdiff_t)y * cairo_image_surface_get_stride(image) + 4 * (ptrdiff_t)x, &pixel,
                   sizeof pixel);
        }
    cairo_surface_mark_dirty(image);
    cairo_save(c);
    cairo_translate(c, r->left, r->top);
    cairo_scale(c, 1.0 / COARSE, 1.0 / COARSE);
    cairo_set_source_surface(c, image, 0.0, 0.0);
    cairo_paint(c);
    cairo_restore(c);
    cairo_surface_destroy(image);
    return true;
}
