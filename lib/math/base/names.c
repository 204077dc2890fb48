/* Names: a hash table with open addressing, and the Damerau-Levenshtein distance.
 *
 * Hash: FNV-1a, 64 bits (Fowler, Noll, Vo: http://www.isthe.com/chongo/tech/comp/fnv/), whose two halves are then mixed
 * by a multiplication. The hash is not seeded, so that equal descriptions are always treated alike.
 *
 * Distance of a[1..m] and b[1..n] in its restricted form (optimal string alignment: no letter moves twice):
 *   D(i,0) = i, D(0,j) = j,
 *   D(i,j) = min( D(i-1,j) + 1, D(i,j-1) + 1, D(i-1,j-1) + [a_i != b_j],
 *                 D(i-2,j-2) + 1 where a_i = b_{j-1} and a_{i-1} = b_j ).
 * Only the band |i - j| <= limit can hold values <= limit.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/names.h"
#include "base/text.h"

#include <string.h>

/* ---- tables ------------------------------------------------------------------------------------------------------ */

static size_t slot_count(size_t count) {
    size_t slots = 4;
    while (slots * 2 / 3 < count)
        slots *= 2;
    return slots;
}

size_t kt_names_size(size_t count) { return slot_count(count) * sizeof(kt_name_slot); }

void kt_names_init(kt_names *names, size_t count, void *memory) {
    size_t slots = slot_count(count);
    names->slots = memory;
    names->mask = slots - 1;
    for (size_t i = 0; i < slots; i++)
        names->slots[i] = (kt_name_slot){NULL, 0, 0, 0};
}

static uint32_t hash_of(int scope, const char *name) {
    uint64_t hash = UINT64_C(14695981039346656037) ^ (uint32_t)scope;
    hash *= UINT64_C(1099511628211);
    for (const char *c = name; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * UINT64_C(1099511628211);
    hash ^= hash >> 32;
    hash *= UINT64_C(0x9E3779B97F4A7C15);
    return (uint32_t)(hash >> 32);
}

/* Returns the slot that holds the name, or the empty slot in which the name can be entered. */
static kt_name_slot *name_slot_of(const kt_names *names, int scope, const char *name, uint32_t hash) {
    for (size_t i = hash & names->mask;; i = (i + 1) & names->mask) {
        kt_name_slot *slot = &names->slots[i];
        if (slot->name == NULL)
            return slot;
        if (slot->hash == hash && slot->scope == scope && strcmp(slot->name, name) == 0)
            return slot;
    }
}

int kt_names_add(kt_names *names, int scope, const char *name, int index) {
    uint32_t hash = hash_of(scope, name);
    kt_name_slot *slot = name_slot_of(names, scope, name, hash);
    if (slot->name != NULL)
        return slot->index;
    *slot = (kt_name_slot){name, hash, scope, index};
    return -1;
}

int kt_names_find(const kt_names *names, int scope, const char *name) {
    const kt_name_slot *slot = name_slot_of(names, scope, name, hash_of(scope, name));
    return slot->name == NULL ? -1 : slot->index;
}

/* ---- spelling ---------------------------------------------------------------------------------------------------- */

/* Replaces tolower of ctype.h, which depends on the locale. */
static char lower(char c) { return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c; }

bool kt_name_is_valid(const char *name) {
    if (name == NULL || !kt_is_letter(*name))
        return false;
    for (name++; *name != '\0'; name++)
        if (!kt_is_letter(*name) && !kt_is_digit(*name) && *name != '-')
            return false;
    return true;
}

kt_name_text kt_name_quote(const char *name) {
    static const char dots[] = "...";
    const size_t most = KT_NAME_TEXT_SIZE - 3; /* two quotes and the terminating zero */
    kt_name_text out;
    size_t length = 0;
    while (length <= most && name[length] != '\0')
        length++;
    bool cut = length > most;
    if (cut) {
        length = most - (sizeof dots - 1);
        while (length > 0 && ((unsigned char)name[length] & 0xC0U) == 0x80U) /* no cut within a UTF-8 character */
            length--;
    }
    char *to = out.text;
    *to++ = '\'';
    for (size_t i = 0; i < length; i++) {
        unsigned char c = (unsigned char)name[i];
        *to++ = c < 0x20U || c == 0x7FU ? '?' : name[i];
    }
    if (cut) {
        memcpy(to, dots, sizeof dots - 1);
        to += sizeof dots - 1;
    }
    *to++ = '\'';
    *to = '\0';
    /* cppcheck-suppress uninitvar ; written through `to` */
    return out;
}

/* ---- the nearest name -------------------------------------------------------------------------------------------- */

enum { LONGEST = 64, FARTHEST = 4 }; /* a longer or more distant name is not a misspelling */

/* Returns the length of a text, or LONGEST + 1 if the text is longer than LONGEST. */
static size_t bounded_length(const char *text) {
    size_t length = 0;
    while (length <= LONGEST && text[length] != '\0')
        length++;
    return length;
}

static int smaller_int(int a, int b) { return a < b ? a : b; }
static int larger_int(int a, int b) { return a > b ? a : b; }

/* Returns the distance of two texts of m and n letters, or limit + 1 if the distance exceeds limit. In D, `row` is row
 * i, and `last` and `before` are the two rows before it. */
static int edit_distance(const char *a, int m, const char *b, int n, int limit) {
    int rows[3][LONGEST + 2];
    int *before = rows[0], *last = rows[1], *row = rows[2];
    const int far = limit + 1;
    for (int j = 0; j <= n; j++)
        last[j] = smaller_int(j, far);
    for (int i = 1; i <= m; i++) {
        int from = larger_int(1, i - limit), to = smaller_int(n, i + limit);
        row[from - 1] = from == 1 ? smaller_int(i, far) : far;
        int least = row[from - 1];
        for (int j = from; j <= to; j++) {
            int d = last[j - 1] + (lower(a[i - 1]) != lower(b[j - 1]));
            if (j < i + limit) /* else last[j] lies outside the band */
                d = smaller_int(d, last[j] + 1);
            d = smaller_int(d, row[j - 1] + 1);
            if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]))
                d = smaller_int(d, before[j - 2] + 1);
            row[j] = smaller_int(d, far);
            least = smaller_int(least, row[j]);
        }
        if (least == far)
            return far;
        int *spare = before;
        before = last;
        last = row;
        row = spare;
    }
    return last[n];
}

kt_nearest kt_nearest_make(const char *wanted, int64_t *effort) {
    kt_nearest search = {.wanted = wanted, .length = bounded_length(wanted), .limit = -1};
    search.effort = effort;
    if (search.length == 1)
        search.limit = 0; /* of a single letter, only the case may differ: a replaced letter leaves no similarity */
    else if (search.length > 1 && search.length <= LONGEST)
        search.limit = FARTHEST;
    return search;
}

bool kt_nearest_try(kt_nearest *search, const char *candidate) {
    if (search->limit < 0 || (search->effort != NULL && *search->effort <= 0))
        return false;
    if (candidate == NULL)
        return true;
    int m = (int)search->length, n = (int)bounded_length(candidate);
    const int limit = smaller_int(search->limit, larger_int(larger_int(m, n), 3) / 3);
    bool fits = n <= LONGEST && n - m <= limit && m - n <= limit;
    if (search->effort != NULL)
        *search->effort -= 1 + n + (fits ? m * (2 * limit + 1) : 0);
    if (!fits)
        return true;
    int d = edit_distance(search->wanted, m, candidate, n, limit);
    if (d <= limit) {
        search->best = candidate;
        search->limit = d - 1;
    }
    return search->limit >= 0;
}
