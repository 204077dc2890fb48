/* What scene-files.md describes and this version cannot do yet.
 *
 * This list is the one switch: take a line away when the engine can do what it names, and the tables of keys do the
 * rest, if they have it already. An entry is a key of the file ("loops"), a key of a section ("simulate.plan"), or a
 * word that stands for a key's value ("simulate.reduction.svd").
 */
#include "scene/support.h"

#include <string.h>

const char *const kt_support_refused[] = {
    NULL,
};

/* What follows "WHERE." in an entry, if it is one name; else NULL. */
static const char *name_at(const char *entry, const char *where) {
    size_t length = strlen(where);
    if (length > 0) {
        if (strncmp(entry, where, length) != 0 || entry[length] != '.')
            return NULL;
        entry += length + 1;
    }
    return strchr(entry, '.') == NULL ? entry : NULL;
}

const char *kt_support_refused_name(const char *const *refused, const char *where, size_t n) {
    for (; refused != NULL && *refused != NULL; refused++) {
        const char *name = name_at(*refused, where);
        if (name != NULL && n-- == 0)
            return name;
    }
    return NULL;
}

bool kt_support_is_refused(const char *const *refused, const char *where, const char *name) {
    for (; refused != NULL && *refused != NULL; refused++) {
        const char *here = name_at(*refused, where);
        if (here != NULL && strcmp(here, name) == 0)
            return true;
    }
    return false;
}
