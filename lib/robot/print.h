/* Texts with numbers that are as short as their bits allow: formulas of scenes, and elements of robots. */
#ifndef KT_ROBOT_PRINT_H
#define KT_ROBOT_PRINT_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

/* Takes a piece of a text: a part of the format, or the text of an argument. */
typedef void kt_print_piece(void *to, const char *text, size_t length, bool is_argument);

/* Prints as printf does, but with three conversions alone: %s, %d, and %g, which is the text of kt_number_format. */
void kt_print_pieces(kt_print_piece *put, void *to, const char *format, va_list arguments);

#endif
