/* Makes the elements of MJCF that a shorter element stands for (mjcf_make.h). */
#include "robot/mjcf_make.h"

#include "document/number.h"

#include <string.h>

const char *kt_mjcf_write_numbers(kt_mjcf *m, int count, const double *values) {
    char text[8 * KT_NUMBER_SIZE];
    size_t length = 0;
    for (int i = 0; i < count; i++) {
        text[length] = ' ';
        length += i > 0;
        kt_number_format(text + length, values[i]);
        length += strlen(text + length);
    }
    const char *kept = kt_reader_text(m->r, &m->r->scratch, text, length);
    return kept;
}

static size_t count_words(const char *const *attributes) {
    size_t count = 0;
    while (attributes[count] != NULL)
        count++;
    return count;
}

kt_element *kt_mjcf_add_element(kt_mjcf *m, kt_element *parent, const kt_element *from, const char *name,
                                const char *const *attributes, const kt_element *like) {
    const size_t own = count_words(attributes), more = like != NULL ? count_words(like->attributes) : 0;
    const char **all = own % 2 == 0 ? kt_reader_take(m->r, &m->r->scratch, own + more + 1, sizeof *all) : NULL;
    kt_element *e = all != NULL ? kt_element_at(m->r, from, name, all) : NULL;
    if (e == NULL)
        return NULL;
    if (++m->elements > KT_MJCF_ELEMENTS_MOST) {
        if (!kt_draft_is_wrong(&m->draft))
            (void)kt_mjcf_fault(m, from, "cables and copies make more than %d elements of the model",
                                (int)KT_MJCF_ELEMENTS_MOST);
        return NULL;
    }
    size_t count = own;
    memcpy(all, attributes, own * sizeof *all);
    for (size_t i = 0; i < more; i += 2) {
        if (strcmp(like->attributes[i], "kind") == 0)
            continue;
        all[count++] = like->attributes[i];
        all[count++] = like->attributes[i + 1];
    }
    kt_element_hang(parent, e);
    return e;
}
