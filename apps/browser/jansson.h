/* The type of lists of the command (jansson), whose headers name it. A page has no such lists: host.c has its own. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BROWSER_JANSSON_H
#define KT_BROWSER_JANSSON_H

typedef struct json_t json_t;

#endif
