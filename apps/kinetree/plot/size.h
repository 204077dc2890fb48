/* The size of a picture. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_SIZE_H
#define KT_COMMAND_PLOT_SIZE_H

/* The size of the page in its units, which are pixels of a screen and points of a PDF. 0: chosen to fit a screen. */
typedef struct kt_plot_size {
    int width, height;
} kt_plot_size;

/* Reads "1200x800" (NULL: not given). Returns -1, or an exit code after printing the error. */
int kt_plot_size_read(const char *command, const char *text, kt_plot_size *size);

#endif
