/* The colours of pictures: those of M. Okabe and K. Ito (Color Universal Design, 2008), which people with any kind of
 * colour blindness can distinguish, without the yellow, which is hard to see on white. On a dark page the blue is
 * lighter, and black becomes white. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/palette.h"

#define KT_OKABE_ITO                                                                                                   \
    {0.835, 0.369, 0.000},     /* vermilion */                                                                         \
        {0.000, 0.620, 0.451}, /* bluish green */                                                                      \
        {0.800, 0.475, 0.655}, /* reddish purple */                                                                    \
        {0.902, 0.624, 0.000}, /* orange */                                                                            \
    {                                                                                                                  \
        0.337, 0.706, 0.914                                                                                            \
    } /* sky blue */

static const kt_palette light = {{1.00, 1.00, 1.00},
                                 {0.13, 0.13, 0.13},
                                 {0.42, 0.42, 0.42},
                                 {0.88, 0.88, 0.88},
                                 {{0.000, 0.447, 0.698}, KT_OKABE_ITO, {0.000, 0.000, 0.000}}};
static const kt_palette dark = {{0.051, 0.067, 0.090},
                                {0.90, 0.92, 0.94},
                                {0.62, 0.65, 0.69},
                                {0.17, 0.19, 0.23},
                                {{0.220, 0.545, 0.992}, KT_OKABE_ITO, {1.000, 1.000, 1.000}}};

const kt_palette *kt_palette_choose(bool is_dark) { return is_dark ? &dark : &light; }

kt_colour kt_colour_mix(kt_colour a, kt_colour b, double share) {
    return (kt_colour){a.red + share * (b.red - a.red), a.green + share * (b.green - a.green),
                       a.blue + share * (b.blue - a.blue)};
}
