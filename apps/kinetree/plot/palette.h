/* The colours of pictures. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_PALETTE_H
#define KT_COMMAND_PLOT_PALETTE_H

#include "plot/plot.h"

/* Red, green and blue, 0 to 1 (sRGB). */
typedef struct kt_colour {
    double red, green, blue;
} kt_colour;

/* The colours of a light or a dark page. */
typedef struct kt_palette {
    kt_colour paper, ink, quiet, faint;
    kt_colour series[KT_PLOT_SERIES_MAX];
} kt_palette;

const kt_palette *kt_palette_choose(bool is_dark);

/* a, moved by a share of the way to b. */
kt_colour kt_colour_mix(kt_colour a, kt_colour b, double share);

#endif
