/* The table of hard cases as a picture. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_HARD_DRAW_H
#define KT_BENCH_HARD_DRAW_H

#include <stdbool.h>

enum { KT_HARD_ENGINES = 3, KT_HARD_DOTS_MAX = 128 };

/* One line: a measure of a case and its value for each engine. A NaN means no value. Then `words` give the reason, or
 * are empty. */
typedef struct kt_hard_dots {
    char label[120];
    double bound, value[KT_HARD_ENGINES];
    char words[KT_HARD_ENGINES][40];
} kt_hard_dots;

/* Writes an SVG or PNG picture, by its name. False after saying why not. */
bool kt_hard_draw(const char *path, bool is_dark, const kt_hard_dots *dots, int count,
                  const char *const names[KT_HARD_ENGINES]);

#endif
