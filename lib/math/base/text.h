/* Texts: how they begin, letters of names, paths. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_TEXT_H
#define KT_BASE_TEXT_H

#include <stdbool.h>
#include <string.h>

static inline bool kt_text_begins(const char *text, const char *with) { return strncmp(text, with, strlen(with)) == 0; }

static inline bool kt_is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
static inline bool kt_is_digit(char c) { return c >= '0' && c <= '9'; }

/* Whether a path is relative and has no '..' in it, so that the path stays within its folder. */
static inline bool kt_path_is_inner(const char *path) {
    if (path[0] == '/' || path[0] == '\0' || strchr(path, '\\') != NULL)
        return false;
    for (const char *part = path; part != NULL; part = strchr(part, '/')) {
        part += *part == '/';
        if (strncmp(part, "..", 2) == 0 && (part[2] == '/' || part[2] == '\0'))
            return false;
    }
    return true;
}

#endif
