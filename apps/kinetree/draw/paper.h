/* Declarations shared by the files that paint drawings of mechanisms with cairo. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_DRAW_PAPER_H
#define KT_COMMAND_DRAW_PAPER_H

#include "draw/draw.h"
#include "picture/hiding.h"
#include "plot/paper.h"

#include <stdint.h>

/* A point of the page, in its units; y points down. */
typedef struct kt_spot {
    double x, y;
} kt_spot;

/* Paths of points, cut into short pieces, with the parts that solids hide (trace.c). */
typedef struct kt_traces kt_traces;

/* The part of the page on which one state is painted. */
typedef struct kt_sheet {
    cairo_t *c; /* NULL: nothing is painted */
    const kt_palette *palette;
    const kt_drawing *drawing;
    const kt_pose *poses; /* poses of all bodies in the state */
    double scale;         /* units of the page a metre */
    double x, y;          /* place of the origin of the camera's frame */
    double pin;           /* radius of a joint's symbol, on the page */
    double fade;          /* how far colours are from those of the latest state, towards the paper: 0 to 1 */
    bool is_grey;         /* all bodies have the colour of fixed ones */
    kt_traces *traces;    /* kt_paint_solids notes the parts that it hides; NULL: none */
    uint64_t *order;      /* kt_paint_solids adds the things that it paints to this hash; NULL: none */
} kt_sheet;

/* ---- places and colours (sheet.c) -------------------------------------------------------------------------------- */

/* From the camera's frame, and from the world, to the page. */
kt_spot kt_sheet_spot(const kt_sheet *sheet, kt_vec3 point);
kt_spot kt_sheet_place(const kt_sheet *sheet, kt_vec3 point);

/* Whether the state is an earlier one of a drawing that has to be small. */
bool kt_sheet_is_plain(const kt_sheet *sheet);
/* Whether joint symbols of a radius, on the page, would hide all bodies. There must be more than `least` joints, and
 * most of them must be near their predecessors in the list. */
bool kt_sheet_is_crowded(const kt_sheet *sheet, double radius, int least);

/* The colour of a body: that of its rigid part, or that of parts that are fixed to the ground. */
kt_colour kt_sheet_colour(const kt_sheet *sheet, int body);
/* The colour of lines around an area of a colour. */
kt_colour kt_sheet_edge(const kt_sheet *sheet, kt_colour fill);
/* A colour as far towards the paper as the state is faded. */
kt_colour kt_sheet_faded(const kt_sheet *sheet, kt_colour colour);

/* The origin of a frame on a body; and whether a body is fixed to the ground. */
kt_spot kt_sheet_frame(const kt_sheet *sheet, const kt_body_frame *frame);
bool kt_sheet_is_ground(const kt_sheet *sheet, int body);

/* ---- mounts (mount.c) -------------------------------------------------------------------------------------------- */

/* The place where the ground holds a frame, in the world. */
typedef struct kt_mount {
    kt_vec3 place;   /* origin of the frame, or the end of the fixed part that carries it */
    bool is_of_part; /* the end of a part: of its solids, or the origin of a body of rods */
    bool is_above;   /* the part is held at its upper end, since the frame is below its middle */
} kt_mount;

kt_mount kt_mount_of(const kt_sheet *sheet, const kt_body_frame *frame);

/* Symbols of the ground have the same place in all states of a drawing. The place depends on these states: the state of
 * rest if there is one, else an even selection of all. k counts from 0 to kt_mount_states() - 1. */
int kt_mount_states(const kt_drawing *drawing);
const kt_pose *kt_mount_state(const kt_drawing *drawing, int k);

/* ---- solids (solid.c) -------------------------------------------------------------------------------------------- */

/* Paints a piece, in the camera's frame, with light from above on the left. */
void kt_paint_piece(const kt_sheet *sheet, const kt_piece *piece, kt_colour colour);

/* The colour of a surface whose unit normal, in the camera's frame, is n. */
kt_colour kt_paint_shade(kt_colour colour, kt_vec3 n);

/* ---- solids as pixels (raster.c) --------------------------------------------------------------------------------- */

typedef struct kt_raster kt_raster;

/* The pixels of a rectangle of the page, from its upper left to its lower right; NULL: memory is insufficient. */
kt_raster *kt_raster_create(const kt_sheet *sheet, kt_spot low, kt_spot high);
void kt_raster_free(kt_raster *raster);

/* kt_raster_paint paints a solid, in the camera's frame. A line surrounds the solids of each number `thing`.
 * kt_raster_show puts the pixels on the page. Both return false if memory is insufficient. */
bool kt_raster_paint(kt_raster *raster, const kt_solid *solid, int thing, kt_colour colour);
bool kt_raster_show(const kt_raster *raster);

/* Removes the things whose numbers are below `first`. What they hide stays hidden. */
void kt_raster_keep(kt_raster *raster, int first);

/* The depth of the nearest solid at a spot. Returns false if there is none. */
bool kt_raster_depth(const kt_raster *raster, kt_spot at, double *depth);

/* ---- paths (trace.c) --------------------------------------------------------------------------------------------- */

/* Paints all paths of a drawing, before the solids. */
void kt_paint_paths(const kt_sheet *sheet);

/* The paths of a drawing, for the solids of one state or several. NULL: memory is insufficient. */
kt_traces *kt_traces_create(const kt_sheet *sheet);
void kt_traces_free(kt_traces *traces);

/* Notes the parts of sheet->traces that painted solids hide. `depth` receives the largest z of the solids at x and y of
 * a point, in the camera's frame. The function returns false if no solid is there. */
typedef bool kt_trace_depth(const void *user, kt_vec3 at, double *depth);
void kt_traces_cover(const kt_sheet *sheet, kt_trace_depth *depth, const void *user);

/* Paints the parts of sheet->traces that are in front of solids, after the solids. */
void kt_paint_near_paths(const kt_sheet *sheet);

/* Writes the same parts of the first path, up to a share of its points, as dashes of a line of length 1. A dash of 0.3
 * behind a gap of 0.2 is "0 0.2 0.3 1". The caller frees the text; NULL: memory is insufficient. */
char *kt_traces_dashes(const kt_sheet *sheet, double share);

/* ---- rails (rail.c) ---------------------------------------------------------------------------------------------- */

/* Widens [low, high] to the reach of a body's solids along the z axis of a frame, from its origin. Solids that the axis
 * misses are ignored. r: radius of joint symbols, m. */
void kt_reach_along(const kt_picture *picture, const kt_pose *poses, int body, const kt_pose *frame, double r,
                    double *low, double *high);

/* The rail of a joint that slides, along z of its frame, for all states of a drawing. The rail has half of the length
 * of the body beyond the outermost states. Returns false if there is none, since a solid of the parent is there or the
 * joint does not slide. */
bool kt_rail_span(const kt_drawing *drawing, const kt_picture_joint *joint, double r, double *low, double *high);

/* ---- lines (line.c) ---------------------------------------------------------------------------------------------- */

/* In this order: the point at a share of the way from a to b; the distance; the unit direction from a to b. For equal
 * points the direction is to the right. kt_spot_offset goes `ahead` along a direction and `aside` to its right. The
 * right of a direction to the right is down. */
kt_spot kt_spot_between(kt_spot a, kt_spot b, double share);
double kt_spot_distance(kt_spot a, kt_spot b);
kt_spot kt_spot_direction(kt_spot a, kt_spot b);
kt_spot kt_spot_offset(kt_spot from, kt_spot along, double ahead, double aside);

/* The first function adds a line to the path, the second paints it. */
void kt_trace_line(cairo_t *c, kt_spot from, kt_spot to);
void kt_paint_line(const kt_sheet *sheet, kt_spot from, kt_spot to, double width, kt_colour colour);
/* A line with a head at its end. */
void kt_paint_arrow(const kt_sheet *sheet, kt_spot from, kt_spot to, double width, kt_colour colour);
void kt_paint_dashes(const kt_sheet *sheet, kt_spot from, kt_spot to, kt_colour colour, double width);
/* Short oblique lines along the left side of a line, as seen from its beginning. Such lines mark fixed ground. */
void kt_paint_hatching(const kt_sheet *sheet, kt_spot from, kt_spot to);
/* Paints a spring, a damper, or both side by side, between `from` and `to`. Paints only the part from share a to share
 * b. If a bar is inside the spring, `around` is its radius on the page, and the spring alone represents both. */
void kt_paint_spring(const kt_sheet *sheet, kt_spot from, kt_spot to, double a, double b, bool has_stiffness,
                     bool has_damping, double around);

/* ---- symbols ----------------------------------------------------------------------------------------------------- */

/* Solids, and in space joints, feet, bushings and springs, the farthest first (depth.c). Notes the parts of
 * sheet->traces that they hide. Paints nothing if sheet->c is NULL. Returns false if memory is insufficient. */
bool kt_paint_solids(const kt_sheet *sheet);

/* Joints as circles, the ground below them, loops (joint.c); effects, relations between joints (effect.c). */
void kt_paint_pivots(const kt_sheet *sheet);
void kt_paint_mounts(const kt_sheet *sheet);
void kt_paint_loops(const kt_sheet *sheet);
void kt_paint_effects(const kt_sheet *sheet);
void kt_paint_relations(const kt_sheet *sheet);

/* Paints the things behind all solids: planes, and in diagrams the ground. */
void kt_paint_ground(const kt_sheet *sheet);

/* Whether a plane is that of the paper: a planar mechanism moves in it, and it is not drawn. Its square would be larger
 * than the motion. */
bool kt_plane_is_paper(const kt_drawing *d, const kt_picture_plane *plane, const kt_pose *poses);
/* Paints the things in front of all solids (symbol.c): joints, loops and springs of diagrams; axes, arrows, markers,
 * names. */
void kt_paint_symbols(const kt_sheet *sheet);

#endif
