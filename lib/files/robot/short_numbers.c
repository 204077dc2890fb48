/* Texts with numbers that are as short as their bits allow. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/number.h"
#include "robot/robot.h"

#include <stdio.h>
#include <string.h>

void kt_print_pieces(kt_print_piece *put, void *to, const char *format, va_list arguments) {
    for (const char *at = format; *at != '\0';) {
        const size_t length = strcspn(at, "%");
        char number[KT_NUMBER_SIZE];
        const char *text = number;
        put(to, at, length, false);
        at += length;
        if (*at == '\0')
            return;
        if (at[1] == 's')
            text = va_arg(arguments, const char *);
        else if (at[1] == 'd')
            (void)snprintf(number, sizeof number, "%d", va_arg(arguments, int));
        else
            kt_number_format(number, va_arg(arguments, double));
        put(to, text, strlen(text), true);
        at += 2;
    }
}
