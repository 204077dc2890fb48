/* Ctrl-C (SIGINT) while results are written: a message names the partial file, counts its lines, and states how to
 * continue. Then the program ends by the signal, which shells show as exit status 130. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_INTERRUPT_H
#define KT_COMMAND_RECORDS_INTERRUPT_H

#include "kinetree/status.h"

/* Watches for SIGINT, unless that is ignored. path: the partial file, which stays as it is; NULL: there is no message.
 * counted: "record" if each line behind the first one is a record. If it is NULL, the lines are not counted. removed:
 * an unfinished file, which the interrupt removes; NULL: none. Does nothing without both files. */
void kt_interrupt_start(const char *path, const char *counted, const char *removed);

/* Sets the last sentences of the message, which replace earlier ones. */
void kt_interrupt_advise(const char *format, ...) KT_PRINTF(1, 2);

/* Ends the watch. Call this before the file is renamed. */
void kt_interrupt_end(void);

#endif
